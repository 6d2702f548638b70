/* SPDX-License-Identifier: BSD-3-Clause */
/* Outlines of contacts: slots, polygons, teeth and Geneva drives by closed forms. */
#include "model/data/model.h"
#include "model/data/outline.h"
#include "ways.h"
#include <kempe/table.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* A body in the plane, with gravity along -y. */
#define PLANE "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\n"
#define FREE(body, mass, inertia)                                                                                      \
    "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"                                                 \
    "  lift: {joint: {name: y, prismatic: y, at: slide}}\n  " body                                                     \
    ": {joint: {name: r, revolute: z, at: lift}, mass: " mass ", inertia: {xx: 1, yy: 1, zz: " inertia                 \
    "}, points: {C: [0, 0, 0]}}\n"

/* The value of an output at the last row. */
static double at_end(const kempe_trajectory *run, const char *output)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    const double x = table ? kempe_table_number(table, kempe_table_row_count(table) - 1, 1) : NAN;
    kempe_table_free(table);
    return x;
}

/* -- Geneva drives ------------------------------------------------------------------------------------- */

/* A wheel with four slots, 0.1 m from its crank, which turns with 10 rad/s: one flank of each slot is 5 mm from its
 * middle, the other one 6 mm, so that a pin of radius 5 mm on the first one has the ideal motion. */
static loaded geneva(bool far, const char *crank, const char *start)
{
    char model[2048];
    (void)snprintf(
        model, sizeof model,
        "kempe: 1\nground: {points: {O: [0, 0, 0], C: [0.1, 0, 0]}}\n"
        "parameters: {R: \"0.1 m*cos(45 deg)\", k: \"sin(45 deg)\", low: %s mm, high: %s mm}\n"
        "outlines:\n  star: {closed: yes, copies: 4, path: [[\"(R + low)*k\", \"(R - low)*k\"], "
        "[\"(10 mm + low)*k\", \"(10 mm - low)*k\"], [\"(10 mm - high)*k\", \"(10 mm + high)*k\"], "
        "[\"(R - high)*k\", \"(R + high)*k\"]]}\n"
        "bodies:\n"
        "  crank: {joint: {name: a, revolute: z, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {P: [R, "
        "0, 0]}}\n"
        "  wheel: {joint: {name: w, revolute: z, at: ground.C}, mass: 1, inertia: {xx: 2e-4, yy: 2e-4, zz: 2e-4}, "
        "points: {C: [0, 0, 0]}}\n"
        "drives: {turn: {joint: a, angle: \"%s + 10*t/(1 s)\"}}\n"
        "contacts: {pin: {cylinder: crank.P, radius: 5 mm, on: {outline: star, at: wheel.C}, restitution: 0}}\n"
        "start: {%s}\n",
        far ? "6" : "5", far ? "5" : "6", crank, start);
    return load_text(model);
}

/* The pin enters without an impact, and the wheel follows phi = atan2(l sin a, 1 - l cos a), l = sin 45 deg. */
static void a_geneva_wheel_starts_without_impact(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l = geneva(false, "-50 deg", "q: {w: 0}");
        kempe_trajectory *run = simulate(&l, &ways[k], (50 * pi / 180 - 0.5) / 10);
        const double loose = 1e3 * ways[k].tolerance;
        CHECK_NEAR(last_q(run)[1], 0.729156084278831 - pi / 4, loose);
        CHECK_NEAR(last_qd(run)[1], -10 * 0.465583368732984, 10 * loose);
        CHECK_NEAR(at_end(run, "force(pin)"), 0.993872301754023, 100 * loose);
        CHECK_NEAR(at_end(run, "lambda(turn)"), 0.0235452421703199, 100 * loose);
        for (int n = 0; entry(run, "impact", n); n++)
            CHECK(fabs(entry(run, "impact", n)->after - entry(run, "impact", n)->before) < 1e-10);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Behind the middle the other flank slows the wheel down. */
static void a_geneva_wheel_slows_down(void)
{
    for (int k = 0; k < WAYS; k += 3) {
        loaded l = geneva(true, "0", "q: {w: 45 deg}, qd: {w: -24.142135623731}");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.03);
        const double loose = 1e3 * ways[k].tolerance;
        CHECK_NEAR(last_q(run)[1], pi / 4 - 0.57215091711003, loose);
        CHECK_NEAR(last_qd(run)[1], -11.7841354234647, 10 * loose);
        CHECK_NEAR(at_end(run, "force(pin)"), 2.44044823277051, 100 * loose);
        CHECK_NEAR(at_end(run, "lambda(turn)"), -0.110991019701431, 100 * loose);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* -- pawls --------------------------------------------------------------------------------------------- */

/* A rod falls on the corner of a tooth at -10 deg with the restitution 0.2. */
static void a_pawl_falls_on_a_tooth(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            PLANE
            "outlines:\n  tip: {segment: [[0, 0], [0.1, 0]]}\n"
            "  tooth: {polygon: [[0.07, -0.1], [0.09, -0.1], [\"0.08*1 m*cos(10 deg)\", \"-0.08*1 m*sin(10 "
            "deg)\"]]}\n"
            "bodies:\n  pawl: {joint: {name: a, revolute: z, at: ground}, mass: 0.05, com: [0.05, 0, 0], inertia: "
            "{yy: \"0.05*0.01/12\", zz: \"0.05*0.01/12\"}, points: {O: [0, 0, 0]}}\n"
            "contacts: {pawl: {outline: tip, at: pawl.O, on: {outline: tooth, at: ground.O}, restitution: 0.2}}\n"
            "start: {q: {a: 30 deg}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.11);
        const kmp_log_entry *impact = entry(run, "impact", 0);
        CHECK(impact != NULL);
        if (impact) {
            CHECK_NEAR(impact->t, 0.102203000296705, 10 * ways[k].tolerance);
            CHECK_NEAR(impact->before - impact->after, 0.01586037269499, 10 * ways[k].tolerance);
        }
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A wheel with 24 teeth is driven back half a pitch until a tooth meets the pawl, and locks. */
static void a_ratchet_locks(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            "kempe: 1\nground: {points: {P: [0.105, 0, 0]}}\n"
            "outlines:\n  teeth: {closed: yes, copies: 24, path: [[0.12, 0], [0.1, 0], [\"0.1 m*cos(10 deg)\", \"0.1 "
            "m*sin(10 deg)\"]]}\n"
            "bodies:\n  wheel: {joint: {name: w, revolute: z, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 0.01}, "
            "points: {C: [0, 0, 0]}}\n"
            "forces: {back: {joint: w, torque: 2}}\n"
            "contacts: {pawl: {point: ground.P, on: {outline: teeth, at: wheel.C}, restitution: 0}}\n"
            "start: {q: {w: 37.5 deg}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
        const kmp_log_entry *impact = entry(run, "impact", 0);
        CHECK(impact != NULL);
        if (impact) {
            CHECK_NEAR(impact->t, 0.0361800627279134, 10 * ways[k].tolerance);
            CHECK_NEAR(impact->before - impact->after, 0.261799387799149, 10 * ways[k].tolerance);
        }
        CHECK_NEAR(at_end(run, "force(pawl)"), 2 / 0.105, 1e3 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* -- corners ------------------------------------------------------------------------------------------- */

/* A block rocks from one corner to the other, each impact without restitution (Housner). */
static void a_block_rocks(void)
{
    kempe_status status;
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(PLANE "parameters: {tilt: 0.08}\noutlines: {box: {rectangle: [0.2, 1]}}\n" FREE(
            "block", "10", "\"10*1.04/12\"") "contacts: {feet: {outline: box, at: block.C, on: {plane: ground.O, "
                                             "normal: y}, restitution: 0, "
                                             "friction: 5}}\n"
                                             "start: {q: {r: tilt, x: \"-0.5 m*sin(tilt)+ 0.1 m*cos(tilt)\", y: \"0.1 "
                                             "m*sin(tilt) + 0.5 "
                                             "m*cos(tilt)\"}}\n"
                                             "run: {until: \"if(t > 0.3, qd(r), -1) > 0\"}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.3);
        const kmp_log_entry *impact = entry(run, "impact", 0);
        CHECK(impact != NULL);
        if (impact) {
            CHECK_NEAR(impact->t, 0.292540372468249, 10 * ways[k].tolerance);
            CHECK_NEAR(impact->after / impact->before, 0.942307692307692 * 0.942307692307692, 100 * ways[k].tolerance);
        }
        kempe_trajectory_free(run);
        run = simulate_any(&l, &ways[k], 1, &status); /* to its largest tilt on the other corner */
        CHECK(status == KEMPE_OK);
        CHECK_NEAR(last_q(run)[2], -0.0685607796227399, 10 * ways[k].tolerance);
        CHECK_NEAR(last_qd(run)[2], 0, 100 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A rod slides over the corner of a table, and leaves it. */
static void a_rod_slides_over_a_corner(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            PLANE
            "outlines:\n  table: {polygon: [[-2, -1], [0, -1], [0, 0], [-2, 0]]}\n"
            "  bar: {polygon: [[-0.5, 0], [0.5, 0], [0.5, 0.1], [-0.5, 0.1]]}\n" FREE(
                "rod", "1", "\"1/12\"") "contacts: {lie: {outline: bar, at: rod.C, on: {outline: table, at: ground.O}, "
                                        "restitution: 0}}\nstart: {q: {x: 0.1}}\n");
        const double loose = 10 * ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 0.3);
        CHECK_NEAR(hypot(last_q(run)[0], last_q(run)[1]), 0.142437778141984, loose);
        CHECK_NEAR(last_q(run)[2], -0.466644561746408, loose);
        CHECK_NEAR(last_qd(run)[2], -3.00422575083031, 10 * loose);
        CHECK_NEAR(at_end(run, "force(lie)"), 4.30358773901808, 100 * loose);
        kempe_trajectory_free(run);
        run = simulate(&l, &ways[k], 0.38);
        const kmp_log_entry *leaves = NULL;
        for (int n = 0; entry(run, "contact", n); n++)
            leaves = entry(run, "contact", n);
        CHECK(leaves != NULL);
        if (leaves)
            CHECK_NEAR(leaves->t, 0.376515851397015, 100 * loose);
        kempe_trajectory_free(run);
        run = simulate(&l, &ways[k], 0.376515851397015);
        CHECK_NEAR(hypot(last_q(run)[0], last_q(run)[1]), 0.205446169551754, loose);
        CHECK_NEAR(last_q(run)[2], -0.712256791936816, loose);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A grain slides down a wedge onto a floor: a plastic impact in the corner. */
static void a_grain_slides_to_the_floor(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l =
            load_text(PLANE "outlines: {slope: {path: [[5, 0], [0, 0], [\"-0.5 m*cos(30 deg)\", 0.25]]}}\n"
                            "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                            "  grain: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
                            "contacts: {foot: {point: grain.C, on: {outline: slope, at: ground.O}, restitution: 0}}\n"
                            "start: {q: {x: \"-0.499999999999 m*cos(30 deg)\", y: 0.2499999999995}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.6);
        const kmp_log_entry *impact = entry(run, "impact", 0);
        CHECK(impact != NULL);
        if (impact)
            CHECK_NEAR(impact->t, 0.451523640985731, 100 * ways[k].tolerance);
        CHECK_NEAR(last_qd(run)[0], 1.91800677788166, 100 * ways[k].tolerance);
        CHECK_NEAR(last_qd(run)[1], 0, 100 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A wedge falls with its corner on the corner of another one: with both sides of each, symmetric, it rebounds straight.
 * Beside the corner it slips off along the one side that it meets. */
static void corners_meet(void)
{
    for (int k = 0; k < 2 * WAYS; k++) {
        char text[1024];
        const bool beside = k % 2;
        const double off = beside ? 1e-6 : 0;
        (void)snprintf(text, sizeof text,
                       PLANE "outlines:\n  up: {polygon: [[-0.1, -0.1], [0.1, -0.1], [0, 0]]}\n"
                             "  down: {polygon: [[0, 0], [0.1, 0.1], [-0.1, 0.1]]}\nbodies:\n"
                             "  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                             "  wedge: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
                             "contacts: {c: {outline: down, at: wedge.C, on: {outline: up, at: ground.O}, restitution: "
                             "0.5}}\nstart: {q: {x: %g, y: 0.1}}\n",
                       off);
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[k / 2], 0.2);
        const double v = sqrt(2 * 9.81 * (0.1 + off)), t = 0.2 - v / 9.81, loose = 100 * ways[k / 2].tolerance;
        CHECK((entry(run, "corner", 0) != NULL) == !beside);
        /* e = 0.5 along the normal at 45 deg takes 1.5 v/2 into both directions */
        CHECK_NEAR(last_qd(run)[0], beside ? 0.75 * v : 0, loose);
        CHECK_NEAR(last_qd(run)[1], (beside ? -0.25 : 0.5) * v - 9.81 * t, loose);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* -- pieces -------------------------------------------------------------------------------------------- */

/* A frictionless disc that slides along a flank into the round end of a slot has no jump of rates there: with the
 * potential of its height it swings as a pendulum in the end, and energy stays. */
static void pieces_join_without_a_jump(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l =
            load_text(PLANE "outlines: {groove: {slot: 60 mm, width: 30 mm}}\n"
                            "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                            "  pin: {joint: {name: y, prismatic: y, at: slide}, mass: 2, points: {C: [0, 0, 0]}}\n"
                            "contacts: {pin: {point: pin.C, on: {outline: groove, at: ground.O}, restitution: 0}}\n"
                            "start: {q: {x: 30 mm, y: -15 mm}, qd: {x: 0.5}}\n");
        /* it rises in the end to the height v^2/(2 g) = 12.7 mm, and returns */
        kempe_trajectory *run = simulate(&l, &ways[k], 0.06);
        CHECK(entry(run, "impact", 0) == NULL);
        CHECK_NEAR(last_q(run)[1], -0.015, ways[k].tolerance);
        CHECK_NEAR(at_end(run, "force(pin.3)"), 2 * 9.81, 1e3 * ways[k].tolerance);
        kempe_trajectory_free(run);
        run = simulate(&l, &ways[k], 0.08);
        const double x = last_q(run)[0] - 0.06, y = last_q(run)[1], vx = last_qd(run)[0], vy = last_qd(run)[1];
        CHECK(entry(run, "impact", 0) == NULL);
        CHECK_NEAR(hypot(x, y), 0.015, ways[k].tolerance);
        CHECK_NEAR((vx * vx + vy * vy) / 2 + 9.81 * (y + 0.015), 0.125, 10 * ways[k].tolerance);
        CHECK_NEAR(at_end(run, "force(pin)"), 2 * ((vx * vx + vy * vy) / 0.015 - 9.81 * y / 0.015),
                   1e4 * ways[k].tolerance);
        CHECK_NEAR(at_end(run, "gap(pin)"), 0, ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A disc of radius r on a rounded corner of radius R falls from it like a grain from a sphere of radius R + r: it
 * leaves where cos(a) = 2/3. */
static void a_disc_leaves_a_round_corner(void)
{
    for (int k = 0; k < WAYS; k += 3) {
        loaded l = load_text(
            PLANE "outlines: {block: {rectangle: [1, 1], at: [-0.5, -0.5], round: 100 mm}}\n"
                  "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                  "  disc: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
                  "contacts: {c: {sphere: disc.C, radius: 50 mm, on: {outline: block, at: ground.O}, restitution: 0}}\n"
                  "start: {q: {x: -0.2, y: 50 mm}, qd: {x: 0.1}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 2);
        /* it leaves where v^2 = v0^2 + 2 g (R + r) (1 - cos a) = g (R + r) cos a, and keeps v cos a */
        const double reach = 0.15, c = (2 + 0.01 / (9.81 * reach)) / 3;
        CHECK(entry(run, "impact", 0) == NULL);
        CHECK_NEAR(last_qd(run)[0], sqrt(9.81 * reach * c) * c, 1e3 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A disc rolls over the end of a table without slip, and turns about its corner: the pieces are one contact that stays
 * closed, and its place in the stick goes on from one to the next. */
static void a_disc_rolls_over_a_corner(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(PLANE "outlines: {table: {rectangle: [2, 1], at: [-1, -0.5]}}\n" FREE(
            "disc", "1", "0.005") "contacts: {c: {cylinder: disc.C, radius: 0.1, on: {outline: table, at: ground.O}, "
                                  "restitution: 0, friction: 3}}\n"
                                  "start: {q: {x: -0.1, y: 0.1}, qd: {x: 0.3, r: -3}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.5);
        const double loose = 1e2 * ways[k].tolerance, tilt = atan2(last_q(run)[0], last_q(run)[1]);
        const double turning = 9 + 2 * 9.81 * 0.1 * (1 - cos(tilt)) / (0.005 + 0.01);
        CHECK(l.model && l.model->outline_contacts[0].count == 1 && entry(run, "impact", 0) == NULL);
        CHECK(tilt > 0.4);
        CHECK_NEAR(hypot(last_q(run)[0], last_q(run)[1]), 0.1, loose);
        CHECK_NEAR(last_q(run)[2], -1 - tilt, loose);
        CHECK_NEAR(last_qd(run)[2], -sqrt(turning), 10 * loose);
        CHECK_NEAR(at_end(run, "force(c)"), 9.81 * cos(tilt) - 0.1 * turning, 1e3 * loose);
        CHECK_NEAR(at_end(run, "qdd(r)"), -9.81 * 0.1 * sin(tilt) / 0.015, 1e3 * loose);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

static int operations_of(const loaded *l)
{
    char *text = NULL;
    CHECK(l->system && kempe_system_print(l->system, KEMPE_VIEW_STATS, KEMPE_TEXT, &text) == KEMPE_OK);
    const char *found = text ? strstr(text, ", ") : NULL;
    const int count = found ? atoi(found + 2) : 0;
    kempe_text_free(text);
    return count;
}

/* The equations of a regular polygon: their operations hardly grow with the edges, and a disc that falls on one of 40
 * edges strikes as on its plane. */
static void many_edges_cost_little(void)
{
    int operations[2];
    for (int k = 0; k < 2; k++) {
        const int edges = k ? 40 : 4;
        char text[8192];
        int at = snprintf(text, sizeof text, PLANE "outlines: {o: {polygon: [");
        for (int i = 0; i < edges; i++)
            at += snprintf(text + at, sizeof text - (size_t)at, "%s[%.17g, %.17g]", i ? ", " : "",
                           0.5 * cos(2 * pi * (i + 0.5) / edges), 0.5 * sin(2 * pi * (i + 0.5) / edges));
        (void)snprintf(text + at, sizeof text - (size_t)at,
                       "]}}\n" FREE("disc", "1", "0.005") "contacts: {c: {cylinder: disc.C, radius: 0.1, on: {outline: "
                                                          "o, at: ground.O}, restitution: 0, friction: 0.1}}\n"
                                                          "start: {q: {y: 0.7}}\n");
        loaded l = load_text(text);
        CHECK(l.model && l.model->outline_contacts[0].count == 1);
        operations[k] = operations_of(&l);
        kempe_trajectory *run = simulate(&l, &ways[0], 0.3);
        const kmp_log_entry *impact = entry(run, "impact", 0);
        const double height = 0.5 * cos(pi / edges) + 0.1;
        CHECK(impact != NULL);
        if (impact)
            CHECK_NEAR(impact->t, sqrt(2 * (0.7 - height) / 9.81), 1e-12);
        CHECK_NEAR(last_q(run)[1], height, 1e-12);
        kempe_trajectory_free(run);
        unload(&l);
    }
    CHECK(operations[0] > 0 && operations[1] < 4 * operations[0]);
}

/* A block of 200 mm slides flat on a table, whose edge is at x = 0.5 m. Its front corner passes the corner of the table
 * at x = 0.4 m, where nothing stops it: x = 0.2 + t - mu g t^2/2. The same where the solids are listed from another
 * corner on, and with both sides exchanged. */
static void a_block_slides_over_an_edge(void)
{
    static const char *const bodies[] = {"rectangle: [0.2, 0.1]",
                                         "polygon: [[0.1, 0.05], [-0.1, 0.05], [-0.1, -0.05], [0.1, -0.05]]"};
    static const char *const sides[] = {"outline: body, at: thing.C, on: {outline: table, at: ground.O}",
                                        "outline: table, at: ground.O, on: {outline: body, at: thing.C}"};
    static const double mu[] = {0, 0.1};
    for (int k = 0; k < 8 * WAYS; k++) {
        const int by = k % WAYS, of = k / WAYS;
        char model[1024];
        (void)snprintf(model, sizeof model,
                       PLANE
                       "outlines: {body: {%s}, table: {rectangle: [1, 0.5]}}\nbodies:\n"
                       "  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                       "  lift: {joint: {name: y, prismatic: y, at: slide}}\n"
                       "  thing: {joint: {name: r, revolute: z, at: lift}, mass: 1, inertia: {zz: 0.005}, points: "
                       "{C: [0, 0, 0]}}\ncontacts: {touch: {%s, restitution: 0, friction: %g}}\n"
                       "start: {q: {x: 0.2, y: 0.3}, qd: {x: 1}}\n",
                       bodies[of % 2], sides[of / 2 % 2], mu[of / 4]);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[by], 0.29);
        CHECK_NEAR(last_q(run)[0], 0.49 - mu[of / 4] * 9.81 * 0.29 * 0.29 / 2, 10 * ways[by].tolerance);
        CHECK_NEAR(last_q(run)[1], 0.3, 10 * ways[by].tolerance);
        CHECK_NEAR(last_q(run)[2], 0, 10 * ways[by].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Two equal blocks on a floor: one strikes the other with its whole side, whose corners meet corners. With e = 0 both
 * go on at half of the speed. */
static void equal_blocks_strike(void)
{
    for (int k = 0; k < WAYS; k += 3) {
        loaded l = load_text(
            PLANE "outlines: {block: {rectangle: [0.2, 0.1]}}\nbodies:\n"
                  "  s: {joint: {name: x, prismatic: x, at: ground}}\n  l: {joint: {name: y, prismatic: y, at: s}}\n"
                  "  a: {joint: {name: r, revolute: z, at: l}, mass: 1, inertia: {zz: 0.005}, points: {C: [0, 0, 0]}}\n"
                  "  t: {joint: {name: X, prismatic: x, at: ground}}\n  m: {joint: {name: Y, prismatic: y, at: t}}\n"
                  "  b: {joint: {name: R, revolute: z, at: m}, mass: 1, inertia: {zz: 0.005}, points: {C: [0, 0, 0]}}\n"
                  "contacts:\n  strike: {outline: block, at: a.C, on: {outline: block, at: b.C}, restitution: 0}\n"
                  "  one: {outline: block, at: a.C, on: {plane: ground.O, normal: y}, restitution: 0}\n"
                  "  two: {outline: block, at: b.C, on: {plane: ground.O, normal: y}, restitution: 0}\n"
                  "start: {q: {x: 0, y: 0.05, X: 0.5, Y: 0.05}, qd: {x: 1}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.5);
        const double at[] = {0.4, 0.05, 0, 0.6, 0.05, 0};
        for (int i = 0; i < 6; i++)
            CHECK_NEAR(last_q(run)[i], at[i], 10 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A disc rests in a hollow corner of 90 degrees on two compliant pieces: each carries m g/sqrt(2). */
static void a_law_acts_on_pieces(void)
{
    for (int k = 0; k < WAYS; k += 3) {
        loaded l = load_text(
            PLANE "outlines: {valley: {path: [[1, 1], [0, 0], [-1, 1]]}}\n"
                  "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                  "  disc: {joint: {name: y, prismatic: y, at: slide}, mass: 2, points: {C: [0, 0, 0]}}\n"
                  "contacts: {c: {sphere: disc.C, radius: 0.1, on: {outline: valley, at: ground.O}, law: kelvin_voigt, "
                  "stiffness: 1e5, damping: 500}}\n"
                  "start: {q: {x: 0, y: 0.1415}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 1);
        CHECK_NEAR(at_end(run, "force(c)"), 2 * 9.81 * sqrt(2), 1e5 * ways[k].tolerance);
        CHECK_NEAR(last_q(run)[1], sqrt(2) * (0.1 - 2 * 9.81 / sqrt(2) / 1e5), 1e2 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A grain slides on the floor of a box against a wall. With m x'' = -k d for the depth d it comes back with its speed,
 * after half a period; the floor holds it all the time, also where it is behind the wall. */
static void a_law_acts_in_a_corner(void)
{
    for (int k = 0; k < WAYS; k += 3) {
        loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\n"
                             "outlines: {box: {rectangle: [1, 1], hollow: yes}}\n"
                             "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                             "  grain: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
                             "contacts: {c: {point: grain.C, on: {outline: box, at: ground.O}, law: hertz, stiffness: "
                             "1e5, exponent: 1}}\n"
                             "start: {q: {x: 0, y: -0.5000981}, qd: {x: 2}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.5);
        CHECK_NEAR(last_q(run)[0], 0.5 - 2 * (0.25 - acos(-1) / sqrt(1e5)), 1e2 * ways[k].tolerance);
        CHECK_NEAR(last_q(run)[1], -0.5000981, 1e2 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A point is pressed into a hollow corner below a step of 0.1 m, where both sides count 0.05 m deep. Each depth is
 * force over stiffness; behind 0.05 m the floor would be lost, and the run ends by name. */
static void a_law_ends_deep_in_a_corner(void)
{
    static const char *const presses[] = {"49", "51"};
    for (int k = 0; k < 2 * WAYS; k++) {
        char model[1024];
        kempe_status status;
        (void)snprintf(
            model, sizeof model,
            "kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
            "outlines: {step: {path: [[1, 0], [0, 0], [0, 0.1], [-1, 0.1]]}}\n"
            "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
            "  grain: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
            "forces: {p: {joint: x, force: -%s}, w: {joint: y, force: -30}}\n"
            "contacts: {c: {point: grain.C, on: {outline: step, at: ground.O}, law: kelvin_voigt, stiffness: "
            "1000, damping: 100}}\nstart: {q: {x: 0.01, y: 0.01}}\n",
            presses[k % 2]);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate_any(&l, &ways[k / 2], 2, &status);
        if (k % 2 == 0) {
            CHECK_NEAR(last_q(run)[0], -0.049, 1e2 * ways[k / 2].tolerance);
            CHECK_NEAR(last_q(run)[1], -0.03, 1e2 * ways[k / 2].tolerance);
        } else {
            CHECK(status == KEMPE_STOPPED);
            CHECK_NEAR(last_q(run)[0], -0.05, 1e2 * ways[k / 2].tolerance);
            CHECK(run && strstr(kempe_trajectory_reason(run), "is deeper behind a hollow corner than half of the way"));
        }
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A point is held in a triangle with round corners, 2 mm deep and 2 mm before the end of a side. The side presses
 * there, though the line that halves the corner's angle at that end is nearer. */
static void a_law_acts_before_a_round_corner(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
        "outlines: {plate: {polygon: [[0, 0], [1, 0], [0.5, 0.8660254037844386]], round: 0.01}}\n"
        "bodies:\n  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
        "  grain: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
        "drives: {across: {joint: x, displacement: 0.9806794919243112}, up: {joint: y, displacement: 0.002}}\n"
        "contacts: {c: {point: grain.C, on: {outline: plate, at: ground.O}, law: hertz, stiffness: "
        "1e5, exponent: 1}}\n"
        "start: {q: {x: 0.9806794919243112, y: 0.002}}\n");
    kempe_trajectory *run = simulate(&l, &ways[0], 0.1);
    CHECK_NEAR(at_end(run, "force(c)"), 200, 1e-6);
    kempe_trajectory_free(run);
    unload(&l);
}

/* Outlines of an included file have its prefix, in contacts and outputs. */
static void an_included_outline_has_its_prefix(void)
{
    loaded l = load("tests/models/outlined.yaml");
    CHECK(l.model && l.model->outline_count == 1 && strcmp(l.model->outlines[0].name, "a_groove") == 0);
    CHECK(l.model && l.model->outline_contact_count == 1 && l.model->outline_contacts[0].count == 4);
    kempe_trajectory *run = simulate(&l, &ways[0], 0.5);
    CHECK_NEAR(at_end(run, "gap(a_pin)"), 0, 1e-9);
    kempe_trajectory_free(run);
    unload(&l);
}

/* A beam that bends in the plane strikes a table as a plane, as an outline and as a circle that is large. */
static void a_beam_strikes_an_outline(void)
{
    static const char *const on[] = {"{plane: ground.T, normal: y}", "{outline: table, at: ground.T}",
                                     "{outline: disc, at: ground.T}"};
    double angle[3] = {0}, deflection[3] = {0};
    for (int k = 0; k < 3; k++) {
        char text[1024];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {T: [0.8, -0.2, 0]}}\n"
            "outlines: {table: {rectangle: [4, 1], at: [0, -0.5]}, disc: {circle: 1e9, at: [0, -1e9]}}\n"
            "bodies: {arm: {joint: {name: a, revolute: z, at: ground}, flexible: {beam: {length: 0.8, young: "
            "70e9, density: 2700, section: {rectangle: [0.02, 0.01]}}, shapes: {y: 2}}, points: {tip: "
            "{station: 0.8}}}}\n"
            "contacts: {c: {cylinder: arm.tip, axis: z, radius: 0.01, on: %s, restitution: 0%s}}\n"
            "start: {q: {a: 0.1}}\n",
            on[k], ", friction: 0.2");
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[0], 0.194);
        CHECK(entry(run, "impact", 0) != NULL);
        angle[k] = run ? last_q(run)[0] : NAN;
        deflection[k] = run ? last_q(run)[1] : NAN;
        kempe_trajectory_free(run);
        unload(&l);
    }
    for (int k = 1; k < 3; k++) {
        CHECK_NEAR(angle[k], angle[0], 1e-7);
        CHECK_NEAR(deflection[k], deflection[0], 1e-7);
    }
}

/* -- refused ------------------------------------------------------------------------------------------- */

static void refused(void)
{
    static const struct {
        const char *outline, *contact, *words;
    } cases[] = {
        {"slot: 60 mm, width: 10 mm", "cylinder: b.P, radius: 5 mm, on: {outline: o, at: ground.O}, restitution: 0",
         "7:15: contact 'c': the slot 'o' is just as wide as the circle, 0.01 m"},
        {"slot: 60 mm, width: 8 mm", "cylinder: b.P, radius: 5 mm, on: {outline: o, at: ground.O}, restitution: 0",
         "7:15: contact 'c': a circle of radius 0.005 m does not fit into the arc of radius 0.004 m of outline 'o'"},
        {"polygon: [[0, 0], [0, 1], [1, 0]]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "6:25: outline 'o': the corners go clockwise"},
        {"polygon: [[0, 0], [3, 0], [3, 2], [1, -1]]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "6:25: outline 'o': it crosses itself at (1.66667, 0) m"},
        {"path: [[1, 0], [2, 0.1], [1, 0.3]], copies: 24", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "perhaps with a copy: take fewer 'copies'"},
        {"polygon: [[0, 0], [1, 0]]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "a polygon has three corners or more"},
        {"polygon: [[0, 0], [1, 0], [1, 0]]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "6:42: outline 'o': corner 3 is at the place of corner 2"},
        {"rectangle: [1, 0.1], round: 60 mm", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "is too short for corners of radius 0.06 m"},
        {"rectangle: [1, -1]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0", "must be positive"},
        {"rectangle: [1, 1], width: 1", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "the key 'width' does not belong to a 'rectangle'"},
        {"circle: 0.1, rectangle: [1, 1]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "exactly one of the keys polygon, rectangle, circle, segment, slot, path, polar, points, law is expected, not "
         "2"},
        {"circle: 0.1, copies: 2.5", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "copies is 2.5: a whole number from 1 to 1000"},
        {"path: [[0, 0], {arc: [2, 0], through: [1, 0]}]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "the places of this arc are on a straight line"},
        {"path: [[0, 0]]", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0", "begins with a corner"},
        {"circle: 0.1", "point: b.P, on: {outline: p, at: ground.O}, restitution: 0", "unknown outline 'p'"},
        {"rectangle: [0.2, 0.2]", "point: s.P, on: {outline: o, at: ground.O}, restitution: 0",
         "an outline lies in the x-y plane of 'ground.O', and joint 'e' moves one side out of it"},
        {"rectangle: [0.2, 0.2]", "point: b.P, on: {outline: o, at: ground.X}, restitution: 0",
         "an outline lies in the x-y plane of 'ground.X', and joint"},
        {"circle: 0.1", "outline: o, at: b.P, on: {plane: ground.O, normal: z}, restitution: 0",
         "the normal of the plane is not in the x-y plane of the outline"},
        {"circle: 0.1", "outline: o, at: b.P, on: {sphere: ground.O, radius: 1}, restitution: 0",
         "an outline touches a plane or another outline"},
        {"path: [[0, 0], [1, 0], {arc: [0, 1], through: [0.9, 0.9]}], closed: yes",
         "outline: o, at: b.P, on: {plane: ground.O, normal: y}, restitution: 0", "has an arc that is not a corner"},
        {"circle: 6, copies: 2", "point: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "7:12: contact 'c.1' overlaps by 1 m at the start, with its circle at (5, 0) m of outline 'o'"},
        {"rectangle: [0.2, 0.2]",
         "point: b.P, on: {outline: o, at: ground.O}, law: hunt_crossley, stiffness: 1e6, restitution: 0.5",
         "laws with 'impact' keep one rate"},
        {"path: [[1, 0], [0.5, 0.1]], closed: yes, copies: 100",
         "outline: o, at: b.P, on: {outline: o, at: ground.O}, restitution: 0", "pairs of corners and sides"},
        {"circle: 0.1", "point: b.P, at: b.P, on: {outline: o, at: ground.O}, restitution: 0",
         "the key 'at' does not belong to a 'point'"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nground: {points: {O: [0, 0, 0], X: {at: [1, 0, 0], axes: {z: x}}}}\nbodies:\n"
                       "  b: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: [5, 0, "
                       "0]}}\n"
                       "  s: {joint: {name: e, revolute: x, at: ground}, mass: 1, inertia: {xx: 1}, points: {P: [5, 0, "
                       "0]}}\n"
                       "outlines: {o: {%s}}\ncontacts: {c: {%s}}\n",
                       cases[k].outline, cases[k].contact);
        load_rejected(text, cases[k].words);
    }
}

int main(void)
{
    TEST(a_geneva_wheel_starts_without_impact);
    TEST(a_geneva_wheel_slows_down);
    TEST(a_pawl_falls_on_a_tooth);
    TEST(a_ratchet_locks);
    TEST(a_block_rocks);
    TEST(a_rod_slides_over_a_corner);
    TEST(a_grain_slides_to_the_floor);
    TEST(corners_meet);
    TEST(pieces_join_without_a_jump);
    TEST(a_disc_leaves_a_round_corner);
    TEST(a_disc_rolls_over_a_corner);
    TEST(many_edges_cost_little);
    TEST(a_block_slides_over_an_edge);
    TEST(equal_blocks_strike);
    TEST(a_law_acts_on_pieces);
    TEST(a_law_acts_in_a_corner);
    TEST(a_law_ends_deep_in_a_corner);
    TEST(a_law_acts_before_a_round_corner);
    TEST(an_included_outline_has_its_prefix);
    TEST(a_beam_strikes_an_outline);
    TEST(refused);
    return check_report();
}
