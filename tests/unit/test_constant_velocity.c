/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints of constant velocity: both shafts turn alike in any direction of bend, and the moment is the closed form T
 * along both shafts with T tan(angle/2) across them. */
#include "closed_form.h"
#include "evaluated.h"
#include "model/data/model.h"
#include "ways.h"
#include <math.h>

static const double pi = 3.14159265358979323846;

/* -- equal angles --------------------------------------------------------------------------------------- */

/* Shafts on bearings, bent by 30 degrees in a direction across the first one; the drive speeds up and slows down. */
#define SHAFTS(keys, more)                                                                                             \
    "kempe: 1\n"                                                                                                       \
    "ground: {points: {I: [-1, 0, 0], O: {at: [0, 0, 0], axes: {x: [cos(30 deg), sin(30 deg)*cos(%.17g), "             \
    "sin(30 deg)*sin(%.17g)]}}}}\n"                                                                                    \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {revolute: x, at: ground.I}, mass: 1, inertia: {xx: 0.01, yy: 0.02, zz: 0.02}, "                     \
    "points: {U: [1, 0, 0]}}\n"                                                                                        \
    "  b: {joint: {cylindrical: x, at: ground.O}, mass: 1, inertia: {xx: 0.03, yy: 0.02, zz: 0.04}, "                  \
    "points: {U: [0, 0, 0]}}\n"                                                                                        \
    "loops: {J: {constant_velocity: [a.U, b.U], " keys "}}\n" more

static loaded shafts(const char *text, double bend)
{
    char model[2000];
    (void)snprintf(model, sizeof model, text, bend, bend);
    return load_text(model);
}

static void equal_angles(void)
{
    static const double bends[] = {0, 0.7, 1.5707963267948966, 2.5, 4.1, 6};
    for (size_t k = 0; k < sizeof bends / sizeof *bends; k++) {
        loaded l = shafts(SHAFTS("axis: x", "drives: {d: {joint: a, angle: \"2*pi*t + 0.4*sin(7*t)\"}}\n"
                                            "forces: {f: {joint: b.2, torque: \"-2*qd(b.2)\"}}\n"),
                          bends[k]);
        for (int w = 0; w < WAYS; w++) {
            kempe_trajectory *run = simulate(&l, &ways[w], 1);
            int rows = run ? kempe_trajectory_row_count(run) : 0;
            CHECK(rows > 5);
            for (int i = 0; i < rows; i++) {
                const double *q = kempe_trajectory_q(run, i), *first = kempe_trajectory_q(run, 0);
                const double *qd = kempe_trajectory_qd(run, i);
                CHECK_NEAR(q[2] - first[2], q[0] - first[0], 10 * ways[w].tolerance);
                CHECK_NEAR(qd[2], qd[0], 1e-6);
            }
            if (rows > 0)
                CHECK_NEAR(last_q(run)[0], 2 * pi + 0.4 * sin(7), 1e-9);
            kempe_trajectory_free(run);
        }
        unload(&l);
    }
}

/* -- moment --------------------------------------------------------------------------------------------- */

/* 100 N m through a joint at 30 degrees: along both shafts 100 on the second and -100 on the first, across them 100
 * tan(15 deg) = 26.7949192431123 in their plane (reference J1). The multiplier is the torque. */
static void moment_of(const char *text)
{
    loaded l = shafts(text, 0.7);
    const double first[3] = {1, 0, 0}, second[3] = {cos(pi / 6), sin(pi / 6) * cos(0.7), sin(pi / 6) * sin(0.7)};
    const double normal[3] = {0, -sin(0.7), cos(0.7)}; /* of their plane */
    for (int w = 0; w < WAYS; w++) {
        const kempe_run_options options = {.formulation = ways[w].formulation,
                                           .form = ways[w].form,
                                           .integrator = ways[w].integrator,
                                           .rtol = 1e-10,
                                           .t_end = 0.3,
                                           .no_convergence_check = 1};
        evaluated e = evaluate(&l, &options, KEMPE_OK);
        for (int row = 0; row < e.rows; row++) {
            const double *m = shown_at(&e, row), *lambda = kempe_trajectory_lambda(e.run, row);
            double along[3] = {0};
            for (int k = 0; k < 3; k++) {
                along[0] += m[k] * first[k];
                along[1] += m[k] * second[k];
                along[2] += m[k] * normal[k];
            }
            CHECK_NEAR(along[0], 100, 1e-9);
            CHECK_NEAR(along[1], 100, 1e-9);
            CHECK_NEAR(along[2] / 100, 0, 1e-9);
            CHECK_NEAR(hypot(m[1], m[2]), 26.7949192431123, 1e-11 + ways[w].tolerance);
            CHECK_NEAR(lambda[l.system->m - 1], 100, 1e-9); /* its row is the last one */
        }
        release(&e);
    }
    unload(&l);
}

#define LOADED                                                                                                         \
    "forces: {m: {joint: a, torque: 100}, l: {joint: b.2, torque: \"-10*qd(b.2)\"}}\n"                                 \
    "start: {qd: {a: 10}}\nrun: {output_step: 0.1, outputs: [moment(J)]}\n"

static void moment(void)
{
    moment_of(SHAFTS("axis: x", LOADED));
    moment_of(SHAFTS("axis: x, plunging: yes", LOADED));
    moment_of(SHAFTS("axis: x, plunging: free", LOADED));
}

/* -- instances and derivatives ------------------------------------------------------------------------ */

/* From rest, (0.01 + 0.03) w' = T - 2 w over 0.05 s. */
static void run_up(double torque, double end[2])
{
    const double k = 2 / 0.04, t = 0.05, grown = 1 - exp(-k * t);
    end[0] = torque / 2 * (t - grown / k);
    end[1] = torque / 2 * grown;
}

static void instances_and_derivatives(void)
{
    char text[2000];
    (void)snprintf(text, sizeof text,
                   SHAFTS("axis: x, plunging: yes",
                          "parameters: {T: 30}\n"
                          "forces: {m: {joint: a, torque: T}, l: {joint: b.2, torque: \"-2*qd(b.2)\"}}\n"
                          "run: {t_end: 0.05, rtol: 1e-11}\n"),
                   0.7, 0.7);
    instances_are(text, "T", 30, 0, run_up, 1e-8);
    slopes_are(text, "forward", "q(a),qd(a)", 30, 0.05, run_up, 1e-9);
    slopes_are(text, "adjoint", "q(a),qd(a)", 30, 0.05, run_up, 1e-8);
}

/* -- half shaft ------------------------------------------------------------------------------------------- */

/* A shaft without bearings between a differential and a wheel that moves up and down: the plunging joint and the fixed
 * one carry it, and its motion is determined. In the plane of the shafts there is no other twist: the wheel turns as
 * the differential does, at any travel. */
static const char half_shaft[] =
    "kempe: 1\n"
    "gravity: [0, 0, -9.81]\n"
    "ground: {points: {D: [0, 0, 0], W: [0, 0.8, 0]}}\n"
    "bodies:\n"
    "  diff: {joint: {revolute: y, at: ground.D}, mass: 2, inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, "
    "points: {P: [0, 0.1, 0]}}\n"
    "  knuckle: {joint: {name: travel, prismatic: z, at: ground.W}, mass: 10, points: {H: [0, 0, 0]}}\n"
    "  wheel: {joint: {name: spin, revolute: y, at: knuckle.H}, mass: 15, inertia: {xx: 0.4, yy: 0.8, zz: 0.4}, "
    "points: {Q: [0, -0.1, 0]}}\n"
    "  shaft: {joint: {name: s, free: y, at: ground.D}, mass: 3, com: [0, 0.3, 0], inertia: {xx: 0.1, yy: 0.001, zz: "
    "0.1}, points: {A: [0, 0, 0], B: [0, 0.6, 0]}}\n"
    "loops:\n"
    "  inner: {constant_velocity: [diff.P, shaft.A], axis: y, plunging: yes}\n"
    "  outer: {constant_velocity: [shaft.B, wheel.Q], axis: y}\n"
    "forces:\n"
    "  engine: {joint: diff, torque: 60}\n"
    "  road: {joint: spin, torque: \"-3*qd(spin)\"}\n"
    "drives: {bump: {joint: travel, displacement: \"0.2*sin(3*t)\"}}\n"
    "start: {q: {s.1: 0.1}, qd: {diff: 5}, hold: [diff]}\n"
    "run: {t_end: 2, output_step: 0.1}\n";

static void half_shaft_turns_the_wheel(void)
{
    loaded l = load_text(half_shaft);
    const int diff = coordinate_named(&l, "diff"), spin = coordinate_named(&l, "spin"),
              up = coordinate_named(&l, "travel");
    for (int w = 0; w < 6; w++) {
        kempe_trajectory *run = simulate(&l, &ways[w], 2);
        int rows = run ? kempe_trajectory_row_count(run) : 0;
        for (int i = 0; i < rows; i++) {
            const double *q = kempe_trajectory_q(run, i);
            CHECK_NEAR(q[spin], q[diff], 10 * ways[w].tolerance);
            CHECK_NEAR(q[up], 0.2 * sin(3 * kempe_trajectory_time(run, i)), 1e-8);
        }
        CHECK(rows == 21 && fabs(last_q(run)[spin]) > 4 * pi);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* -- starts ------------------------------------------------------------------------------------------------- */

/* The row has one solution: an angle that is far off is closed at the right one, not at half a turn from it. */
static void closes_from_far(void)
{
    static const double angles[] = {-170, -100, 91, 135, 179, 1000};
    for (size_t k = 0; k < sizeof angles / sizeof *angles; k++) {
        char more[200];
        (void)snprintf(more, sizeof more, "start: {q: {a: %g deg}, hold: [a]}\n", angles[k]);
        char text[2000];
        (void)snprintf(text, sizeof text, "%s%s", SHAFTS("axis: x", ""), more);
        loaded l = shafts(text, 0), zero = shafts(SHAFTS("axis: x", "start: {hold: [a]}\n"), 0);
        kempe_assembly *a = NULL, *b = NULL;
        CHECK(kempe_assembly_new(l.system, &a) == KEMPE_OK && kempe_assembly_new(zero.system, &b) == KEMPE_OK);
        if (a && b)
            CHECK_NEAR(remainder(kempe_assembly_q(a)[2] - kempe_assembly_q(b)[2] - angles[k] * pi / 180, 2 * pi), 0,
                       1e-9);
        kempe_assembly_free(a);
        kempe_assembly_free(b);
        unload(&l);
        unload(&zero);
    }
}

/* A model with the angle between its shafts. */
static loaded at_angle(double degrees)
{
    char text[1000];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\n"
        "ground: {points: {I: [-1, 0, 0], O: {at: [0, 0, 0], axes: {x: [cos(%.17g deg), sin(%.17g deg), 0]}}}}\n"
        "bodies:\n"
        "  a: {joint: {revolute: x, at: ground.I}, mass: 1, inertia: {xx: 1}, points: {U: [1, 0, 0]}}\n"
        "  b: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1}, points: {U: [0, 0, 0]}}\n"
        "loops: {J: {constant_velocity: [a.U, b.U], axis: x}}\n",
        degrees, degrees);
    return load_text(text);
}

static void folded_shafts(void)
{
    static const double folded[] = {179.5, 180};
    for (int k = 0; k < 2; k++) {
        loaded l = at_angle(folded[k]);
        kempe_trajectory *run = NULL;
        kempe_check *check = NULL;
        CHECK(kempe_simulate(l.system, NULL, &run) == KEMPE_E_FAILED);
        CHECK(strstr(kempe_context_message(l.context),
                     "joint of constant velocity 'J': its shafts are folded onto each other"));
        CHECK(kempe_check_new(l.system, &check) == KEMPE_E_FAILED);
        kempe_check_free(check);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

static int warned;

static void take_warning(void *user, kempe_level level, const char *text)
{
    (void)user;
    warned += level == KEMPE_LOG_WARNING && strstr(text, "its shafts are at") != NULL;
}

static void large_angles(void)
{
    static const double angles[] = {59, 61, 150};
    for (int k = 0; k < 3; k++) {
        loaded l = at_angle(angles[k]);
        kempe_check *check = NULL;
        warned = 0;
        kempe_context_set_log(l.context, take_warning, NULL);
        CHECK(kempe_check_new(l.system, &check) == KEMPE_OK);
        CHECK(warned == (k > 0));
        kempe_check_free(check);
        unload(&l);
    }
}

/* -- graphs ----------------------------------------------------------------------------------------------- */

/* The half shaft as a graph: its joints are in one section, and two of them are cut. */
static const char graph[] =
    "kempe: 1\n"
    "gravity: [0, 0, -9.81]\n"
    "ground: {points: {D: [0, 0, 0], W: [0, 0.8, 0]}}\n"
    "bodies:\n"
    "  diff: {mass: 2, inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, points: {O: [0, 0, 0], P: [0, 0.1, 0]}}\n"
    "  knuckle: {mass: 10, points: {H: [0, 0, 0]}}\n"
    "  wheel: {mass: 15, inertia: {xx: 0.4, yy: 0.8, zz: 0.4}, points: {O: [0, 0, 0], Q: [0, -0.1, 0]}}\n"
    "  shaft: {joint: {name: s, free: y, at: ground.D}, mass: 3, com: [0, 0.3, 0], inertia: {xx: 0.1, yy: 0.001, zz: "
    "0.1}, points: {A: [0, 0, 0], B: [0, 0.6, 0]}}\n"
    "joints:\n"
    "  inner: {constant_velocity: [diff.P, shaft.A], axis: y, plunging: yes}\n"
    "  outer: {constant_velocity: [shaft.B, wheel.Q], axes: [y, y]}\n"
    "  d: {revolute: [ground.D, diff.O], axis: y}\n"
    "  travel: {prismatic: [ground.W, knuckle.H], axis: z}\n"
    "  spin: {revolute: [knuckle.H, wheel.O], axis: y}\n"
    "forces:\n"
    "  engine: {joint: d, torque: 60}\n"
    "  road: {joint: spin, torque: \"-3*qd(spin)\"}\n"
    "drives: {bump: {joint: travel, displacement: \"0.2*sin(3*t)\"}}\n"
    "start: {q: {s.1: 0.1}, qd: {d: 5}, hold: [d]}\n"
    "run: {t_end: 2, output_step: 0.1, outputs: [moment(outer), reaction(inner)]}\n";

static void graph_is_the_same(void)
{
    loaded l = load_text(graph), tree = load_text(half_shaft);
    CHECK(l.model && l.model->cut_count == 2 && l.model->cuts[0].rows == 3 && l.model->cuts[1].rows == 4);
    CHECK(l.system && tree.system && l.system->m == tree.system->m && l.system->n == tree.system->n);
    kempe_trajectory *run = simulate(&l, &ways[0], 2), *other = simulate(&tree, &ways[0], 2);
    if (run && other) {
        static const char *const names[][2] = {{"d", "diff"}, {"spin", "spin"}, {"travel", "travel"}, {"s.4", "s.4"}};
        for (size_t k = 0; k < sizeof names / sizeof *names; k++)
            CHECK_NEAR(last_q(run)[coordinate_named(&l, names[k][0])],
                       last_q(other)[coordinate_named(&tree, names[k][1])], 1e-9);
    }
    kempe_trajectory_free(run);
    kempe_trajectory_free(other);
    unload(&l);
    unload(&tree);
}

#define JOINTS(more)                                                                                                   \
    "kempe: 1\nground: {points: {A: [0, 0, 0]}}\nbodies:\n  a: {mass: 1, inertia: {xx: 1}, points: {P: [0, 0, 0]}}\n"  \
    "joints:\n  A: {revolute: [ground.A, a.P], axis: x}\n  J: {constant_velocity: [a.P, ground.A], axis: x" more "}\n"

static void refused(void)
{
    load_rejected(
        "kempe: 1\nground: {points: {A: [0, 0, 0]}}\nbodies: {a: {mass: 1, inertia: {xx: 1}, points: {P: [0, 0, "
        "0]}}}\njoints: {J: {constant_velocity: [ground.A, a.P], axis: x}}\n",
        "body 'a' is not connected: a constant_velocity has no coordinates; give the body a joint");
    load_rejected(JOINTS(", cut: no"), "joint 'J': a constant_velocity has no coordinates, and is cut at all times");
    load_rejected(JOINTS(", pitch: 2"), "joint 'J': a constant_velocity has no pitch");
    load_rejected(JOINTS(", coordinates: [x]"), "joint 'J': a constant_velocity has no coordinates");
    load_rejected(JOINTS(", plunging: no"), "plunging is yes or free, not 'no'");
    load_rejected(JOINTS(", revolute: [a.P, ground.A]"), "joint 'J': it is either a constant_velocity or a revolute");
    load_rejected(JOINTS("}\n  K: {revolute: [a.P, ground.A], plunging: yes"), "joint 'K': a revolute has no plunging");
    load_rejected(JOINTS("") "forces: {f: {joint: J, torque: 1}}\n", "joint 'J': a cut joint has no coordinate");
    load_rejected(
        "kempe: 1\nbodies:\n  a: {joint: {revolute: x, at: ground}, mass: 1, inertia: {xx: 1}, points: {P: [0, 0, "
        "0]}}\nground: {points: {A: [0, 0, 0]}}\nloops: {J: {constant_velocity: [a.P, ground.A], plunging: no}}\n",
        "plunging is yes or free, not 'no'");
    load_rejected(
        "kempe: 1\nbodies:\n  a: {joint: {revolute: x, at: ground}, mass: 1, inertia: {xx: 1}, points: {P: [0, 0, "
        "0]}}\nground: {points: {A: [0, 0, 0]}}\nloops: {J: {ball: [a.P, ground.A], plunging: yes}}\n",
        "loop 'J': a ball closure has no plunging");
}

int main(void)
{
    TEST(equal_angles);
    TEST(moment);
    TEST(instances_and_derivatives);
    TEST(half_shaft_turns_the_wheel);
    TEST(graph_is_the_same);
    TEST(closes_from_far);
    TEST(folded_shafts);
    TEST(large_angles);
    TEST(refused);
    return check_report();
}
