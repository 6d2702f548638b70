/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction of rigid contacts on round surfaces in the plane of motion, against the digits of
 * bench/machines/contact_digits.py; rolling over many turns, rest and small motions in a hollow. */
#include "ways.h"
#include <kempe/equilibrium.h>
#include <kempe/modes.h>
#include <math.h>
#include <string.h>

#define G 9.81

/* A cylinder rolls in a hollow as a pendulum. */
static void rolls_in_a_hollow(void)
{
    loaded l = load("tests/models/contact_hollow.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 5);
        if (run) {
            CHECK_NEAR(last_q(run)[0], 0.7560633179155342685, e);
            CHECK_NEAR(last_q(run)[1], -0.4882297198067255701, e);
            CHECK_NEAR(last_q(run)[2], 0.02328391683526527092, 20 * e);
            CHECK_NEAR(last_lambda(run)[0], 10.70031009265823899, 20 * e);
            CHECK_NEAR(last_lambda(run)[1], 5.494060110186215684, 20 * e);
            CHECK_TEXT(entry(run, "friction", 0)->text, "'in_friction' sticks");
            CHECK(!entry(run, "friction", 1));
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* A point slides in a hollow, turns and stops; another leaves a crest. */
static void slides_on_an_arc(void)
{
    loaded l = load("tests/models/contact_arc.yaml"), m = load("tests/models/contact_crest.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 3), *other = simulate(&m, &ways[k], 1.2);
        const kmp_log_entry *turn = run ? entry(run, "friction", 1) : NULL,
                            *stop = run ? entry(run, "friction", 2) : NULL,
                            *off = other ? entry(other, "contact", 1) : NULL;
        CHECK(turn && stop && off);
        if (stop) {
            CHECK_TEXT(turn->text, "'on_friction' slips backward");
            CHECK_TEXT(stop->text, "'on_friction' sticks");
            CHECK_NEAR(turn->t, 1.051812776985302608, e);
            CHECK_NEAR(stop->t, 2.054453688405914776, e);
            CHECK_NEAR(last_q(run)[0], -0.1516105401000122232, e);
        }
        if (off) {
            CHECK_TEXT(off->text, "'on' opens");
            CHECK_NEAR(off->t, 0.4263490702976408507, e);
            CHECK_NEAR(last_q(other)[0], 1.772652609687006866, 10 * e);
            CHECK_NEAR(last_qd(other)[1], -9.52097477886843169, 10 * e);
        }
        kempe_trajectory_free(run);
        kempe_trajectory_free(other);
    }
    unload(&l);
    unload(&m);
}

/* Driven around a fixed cylinder several times: the turn of a wheel that rolls, also where the angle starts again. */
static void rolls_around(void)
{
    loaded l =
        load_text("kempe: 1\n"
                  "ground: {points: {O: [0, 0, 0]}}\n"
                  "bodies:\n"
                  "  arm: {joint: {name: a, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {S: [0.4, "
                  "0, 0]}}\n"
                  "  slide: {joint: {name: s, prismatic: x, at: arm.S}, mass: 1}\n"
                  "  wheel: {joint: {name: w, revolute: z, at: slide}, mass: 2, inertia: {zz: 0.01}, points: {C: "
                  "[0, 0, 0]}}\n"
                  "forces: {press: {joint: s, force: -500}}\n"
                  "drives: {d: {joint: a, angle: \"3*t + t^2/5\"}}\n"
                  "contacts: {c: {cylinder: wheel.C, radius: 0.1, on: {cylinder: ground.O, radius: 0.3}, "
                  "restitution: 0, friction: 0.9}}\n"
                  "start: {q: {s: 0, w: 0}, qd: {w: 9}}\n");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 10);
        if (run) {
            CHECK_NEAR(last_q(run)[0], 50, 1e-9);
            CHECK_NEAR(last_q(run)[2], 3 * 50, 10 * ways[k].tolerance); /* relative to the arm: R/r */
            CHECK(!entry(run, "friction", 1));
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

#define WHEEL(friction)                                                                                                \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies: {c: {joint: {name: c, planar: z, at: ground}, mass: 2, inertia: {zz: 0.01}, points: {C: [0, 0, 0]}}}\n"   \
    "contacts: {in: {cylinder: c.C, radius: 0.1, on: {cylinder: ground.O, radius: 1, inside: yes}, restitution: "      \
    "0" friction "}}\n"                                                                                                \
    "start: {q: {c.1: 0.05, c.2: -0.5}}\n"

/* Small motions of a wheel at the bottom: it rolls with friction, and slides without. */
static void small_motions(void)
{
    static const struct {
        const char *text;
        double w;
    } at[] = {{WHEEL(", friction: 0.3"), 2. / 3}, {WHEEL(""), 1}};
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(at[k].text);
        kempe_modes *modes = NULL;
        kempe_table *table = NULL;
        double most = 0;
        CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
        CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
        for (int i = 0; table && i < kempe_table_row_count(table); i++)
            most = fmax(most, fabs(kempe_table_number(table, i, kempe_table_find(table, "im"))));
        CHECK_NEAR(most, sqrt(at[k].w * G / 0.9), 1e-10);
        kempe_table_free(table);
        kempe_modes_free(modes);
        unload(&l);
    }
}

/* A disc strikes a cylinder beside its top: the impulses along the normal and along the surface are those of a plane
 * there, whatever the angle. Friction holds, or is too small. */
static void strikes_beside_the_top(void)
{
    static const double mu[] = {0.3, 0.01};
    for (int k = 0; k < 2 * WAYS; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                       "  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                       "  lift: {joint: {name: y, prismatic: y, at: slide}}\n"
                       "  disc: {joint: {name: r, revolute: z, at: lift}, mass: 1, inertia: {zz: 0.001}, points: {C: "
                       "[0, 0, 0]}}\n"
                       "contacts: {c: {cylinder: disc.C, axis: z, radius: 50 mm, on: {cylinder: ground.O, axis: z, "
                       "radius: 0.5}, restitution: 0, friction: %g}}\n"
                       "start: {q: {x: -0.4, y: 0.7}, qd: {x: 1}}\n",
                       mu[k % 2]);
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[k / 2], 0.3);
        const kmp_log_entry *impact = entry(run, "impact", 0);
        CHECK(impact != NULL);
        if (impact) {
            const double t = impact->t, x = -0.4 + t, y = 0.7 - G * t * t / 2, size = hypot(x, y);
            const double normal = (x - G * t * y) / size, along = (-y - G * t * x) / size;
            /* the surface moves with 1/m + r^2/J per impulse */
            const double stick = fabs(along) / 3.5, push = fmin(mu[k % 2] * -normal, stick);
            const double loss = normal * normal / 2 + push * (fabs(along) - 3.5 * push / 2);
            CHECK_NEAR(size, 0.55, ways[k / 2].tolerance);
            CHECK(k % 2 ? push < stick : push == stick);
            CHECK_NEAR(impact->before - impact->after, loss, 10 * ways[k / 2].tolerance);
        }
        kempe_trajectory_free(run);
        unload(&l);
    }
}

int main(void)
{
    TEST(strikes_beside_the_top);
    TEST(rolls_in_a_hollow);
    TEST(slides_on_an_arc);
    TEST(rolls_around);
    TEST(small_motions);
    return check_report();
}
