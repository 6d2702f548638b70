/* SPDX-License-Identifier: BSD-3-Clause */
/* Planes whose solid is above: what touches a ceiling under a pull upwards moves as the mirror image of what touches a
 * floor. */
#include "ways.h"
#include <stdlib.h>

/* A scene above its floor, or its mirror image: gravity, normal of the plane, height and its rate. */
#define SCENE(joint, contact, rates)                                                                                   \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, 0, %g]\n"                                                                                            \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies: {b: {joint: {name: b, " joint ", at: ground}, mass: 2, inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, "         \
    "points: {C: [0, 0, 0]}}}\n"                                                                                       \
    "contacts: {c: {" contact ", on: {plane: ground.O, normal: %s}, restitution: 0.4, friction: 0.25}}\n"              \
    "start: {q: {b.1: %g}, qd: {b.1: %g, " rates "}}\n"

static loaded scene(const char *text, bool ceiling, double spin)
{
    char model[2000];
    const double up = ceiling ? -1 : 1;
    (void)snprintf(model, sizeof model, text, -9.81 * up, ceiling ? "-z" : "z", 0.5 * up, -up, spin);
    return load_text(model);
}

/* Floor and ceiling by `count` ways. z, the first coordinate, changes its sign, and so do rotations about x and y. */
static void mirrored(const char *text, double spin, double mirrored_spin, int ways_count, int count, const double *sign)
{
    loaded floor = scene(text, false, spin), ceiling = scene(text, true, mirrored_spin);
    for (int k = 0; k < ways_count; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *below = simulate(&floor, &ways[k], 1.5), *above = simulate(&ceiling, &ways[k], 1.5);
        for (int i = 0; below && above && i < count; i++) {
            CHECK_NEAR(last_q(above)[i], sign[i] * last_q(below)[i], e);
            CHECK_NEAR(last_qd(above)[i], sign[i] * last_qd(below)[i], 10 * e);
        }
        if (below && above) {
            CHECK(entry(above, "impact", 1) && entry(above, "contact", 0));
            CHECK_NEAR(last_lambda(above)[0], 2 * 9.81, e); /* pushes, whatever the side */
            CHECK(fabs(last_qd(above)[1]) > 0.1);           /* it rolls, or slips still */
        }
        kempe_trajectory_free(below);
        kempe_trajectory_free(above);
    }
    unload(&floor);
    unload(&ceiling);
}

/* In the plane z-x a disc slips, then rolls. */
static void disc(void)
{
    static const double sign[] = {-1, 1, -1};
    mirrored(SCENE("planar: y", "cylinder: b.C, axis: y, radius: 0.1", "b.2: 1.5, b.3: %g"), 4, -4, WAYS, 3, sign);
}

/* In space; not by forms that have no rows between rates. */
static void ball(void)
{
    static const double sign[] = {-1, 1, 1};
    mirrored(SCENE("free: z", "sphere: b.C, radius: 0.1", "b.2: 1, b.3: -0.4, b.6: %g"), 3, -3, 5, 3, sign);
}

static void point(void)
{
    static const double sign[] = {-1, 1, 1};
    mirrored(SCENE("free: z", "point: b.C", "b.2: 4, b.3: -2, b.4: %g"), 2, 2, 5, 3, sign);
}

/* With a law of the depth: the depth is measured below the ceiling, too. */
static void compliant(void)
{
    static const char text[] =
        "kempe: 1\n"
        "gravity: [0, 0, %g]\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "bodies: {b: {joint: {name: b, planar: y, at: ground}, mass: 2, inertia: {yy: 0.01}, points: {C: [0, 0, 0]}}}\n"
        "contacts: {c: {sphere: b.C, radius: 0.1, on: {plane: ground.O, normal: %s}, law: hunt_crossley, stiffness: "
        "1e6, damping: 0.3, friction: {coefficient: 0.3, speed: 1 mm/s}}}\n"
        "start: {q: {b.1: %g}, qd: {b.1: %g, b.2: 1, b.3: %g}}\n";
    static const double sign[] = {-1, 1, -1};
    loaded floor = scene(text, false, 4), ceiling = scene(text, true, -4);
    kempe_trajectory *below = simulate(&floor, &ways[1], 0.4), *above = simulate(&ceiling, &ways[1], 0.4);
    for (int i = 0; below && above && i < 3; i++) {
        CHECK_NEAR(last_q(above)[i], sign[i] * last_q(below)[i], 1e-9);
        CHECK_NEAR(last_qd(above)[i], sign[i] * last_qd(below)[i], 1e-7);
    }
    if (above)
        CHECK_NEAR(last_qd(above)[2], -8, 1e-3); /* the angular momentum about the place of contact is kept: it rolls */
    kempe_trajectory_free(below);
    kempe_trajectory_free(above);
    unload(&floor);
    unload(&ceiling);
}

/* Written as it is read, as text and as JSON. */
static void written(void)
{
    loaded l = scene(SCENE("planar: y", "point: b.C", "b.2: %g"), true, 1);
    char *text = NULL, *json = NULL;
    CHECK(kempe_model_print(l.model, KEMPE_TEXT, &text) == KEMPE_OK && strstr(text, "point b.C on plane ground.O -z"));
    CHECK(kempe_model_print(l.model, KEMPE_JSON, &json) == KEMPE_OK && strstr(json, "\"on_axis\": \"-z\""));
    kempe_text_free(text);
    kempe_text_free(json);
    unload(&l);
    load_rejected("kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
                  "bodies: {b: {joint: {name: b, planar: y, at: ground}, mass: 2, inertia: {yy: 1}, points: {C: [0, 0, "
                  "0]}}}\n"
                  "contacts: {c: {point: b.C, on: {plane: ground.O, normal: +z}, restitution: 0}}\n",
                  "the normal is x, y, z, -x, -y or -z, not '+z'");
    load_rejected("kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
                  "bodies: {b: {joint: {name: b, planar: y, at: ground}, mass: 2, inertia: {yy: 1}, points: {C: [0, 0, "
                  "0]}}}\n"
                  "contacts: {c: {point: b.C, on: {cylinder: ground.O, axis: -y, radius: 1}, restitution: 0}}\n",
                  "the axis is x, y or z, not '-y'");
}

int main(void)
{
    TEST(disc);
    TEST(ball);
    TEST(point);
    TEST(compliant);
    TEST(written);
    return check_report();
}
