/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: not_sanitized */
/* Axes as the manual has them: of what closures transmit, those of the ground, however the bodies hang; of their rows
 * those of the nearest common ancestor; of one axis that is given alone, those of the shortest turn. */
#include "balance_of_body.h"
#include "constraints/evaluation/evaluator.h"
#include "model/read/read_values.h"
#include "testing.h"
#include <math.h>

/* -- forces and moments of closures ------------------------------------------------------------------ */

/* Body a is locked, and the closure alone holds body b on it. Accelerations of points of b give its angular
 * acceleration. */
#define SCENE                                                                                                          \
    "kempe: 1\ngravity: [1, 2, -10]\n"                                                                                 \
    "ground: {points: {G: {at: [0.1, 0.2, 0.3], axes: {x: [1, 2, -2], y: [0, 1, 1]}}}}\nbodies:\n"                     \
    "  base: {joint: {%s, at: ground.G}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {\n"                         \
    "    O: [0, 0, 0], X: [1, 0, 0], Y: [0, 1, 0], Z: [0, 0, 1], T: {at: [0.3, -0.2, 0.1], axes: {z: [1, 2, -3]}},\n"  \
    "    P: {at: [0.2, 0.1, -0.4], axes: {y: [1, -1, 2], z: [0.5, 0, 1]}}}}\n%s"                                       \
    "  b: {joint: {free: x, at: %s.P}, mass: 1.5, com: [0.2, 0.1, -0.3], inertia: {xx: 1, yy: 1, zz: 1}, points: {\n"  \
    "    Q: [0, 0, 0], C: [0.2, 0.1, -0.3], X: [1.2, 0.1, -0.3], Y: [0.2, 1.1, -0.3], Z: [0.2, 0.1, 0.7]}}\n"          \
    "loops: {W: {%s}}\n%s"                                                                                             \
    "run: {t_end: 0.01, output_step: 0.01, outputs: [" BALANCE_OF_B

/* A second body, welded to the first one with axes of its own. */
static const char welded[] = "  top: {joint: {weld: yes, at: base.T, frame: {x: [1, 1, -1]}}, points: {\n"
                             "    O: [0, 0, 0], X: [1, 0, 0], Y: [0, 1, 0], Z: [0, 0, 1], "
                             "P: {at: [0.1, 0.2, 0.1], axes: {x: [1, 2, 1]}}}}\n";

static const char *const joints[] = {"name: J, revolute: z",
                                     "name: J, revolute: [1, 2, 2]",
                                     "name: J, revolute: [1, -2, -2]",
                                     "name: J, prismatic: z, to: T",
                                     "name: J, revolute: y, to: T, frame: {z: [1, 2, -1]}",
                                     "name: J, revolute: [2, 1, 0], to: T, reversed: yes, frame: {x: [-1, 1, 3]}",
                                     "name: J, universal: [1, 1, 0]",
                                     "name: J, motions: [R3, {R: [1, 0, 2]}]",
                                     "weld: yes, frame: {x: [1, 2, 3]}",
                                     "weld: yes, to: T"};

static const char *const closures[] = {"ball: [%s.P, b.Q]",
                                       "revolute: [%s.P, b.Q], axis: x",
                                       "universal: [%s.P, b.Q], axes: [x, y]",
                                       "cylindrical: [%s.P, b.Q], axis: [1, 1, 0]",
                                       "prismatic: [%s.P, b.Q], axis: y",
                                       "weld: [%s.P, b.Q]",
                                       "planar: [%s.P, b.Q], axis: x",
                                       "point_on_line: [%s.P, b.Q], axis: z",
                                       "point_on_plane: [%s.P, b.Q], axis: [1, 0, 1]",
                                       "point_on_curve: [%s.P, b.Q], curve: \"y - 0.3*sin(x) - 0.1*z\"",
                                       "rod: [%s.P, b.O], length: 0.3"};

static void run_scene(const char *joint, const char *closure, bool top)
{
    const char *body = top ? "top" : "base", *lock = "drives: {L: {joint: J, locked: yes}}\n";
    char text[4096], loop[128];
    if (strstr(joint, "universal") || strstr(joint, "motions"))
        lock = "drives: {L1: {joint: J.1, locked: yes}, L2: {joint: J.2, locked: yes}}\n"
               "start: {q: {J.1: 0.4, J.2: -0.7}}\n";
    else if (strstr(joint, "weld"))
        lock = "";
    else
        lock = "drives: {L: {joint: J, locked: yes}}\nstart: {q: {J: 0.4}}\n";
    (void)snprintf(loop, sizeof loop, closure, body);
    char *origin = strstr(loop, "b.O"); /* of the rod: a force along a line through the centre of mass */
    if (origin)
        origin[2] = 'C';
    (void)snprintf(text, sizeof text, SCENE, joint, top ? welded : "", body, loop, lock);
    check_balance(text, !origin, 1e-9);
}

static void forces_have_ground_axes(void)
{
    for (size_t j = 0; j < sizeof joints / sizeof *joints; j++)
        for (size_t c = 0; c < sizeof closures / sizeof *closures; c++)
            for (int top = 0; top < 2; top++)
                run_scene(joints[j], closures[c], top);
}

/* Rows of a ball are Q - P in the axes of the ancestor, and lambda the force there. */
static void rows_of_a_ball_are_components(void)
{
    for (size_t j = 0; j < sizeof joints / sizeof *joints; j++) {
        char text[4096];
        bool two = strstr(joints[j], "universal") || strstr(joints[j], "motions");
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nground: {points: {G: {at: [0.1, 0.2, 0.3], axes: {x: [1, 2, -2], y: [0, 1, 1]}}}}\n"
                       "bodies:\n  base: {joint: {%s, at: ground.G}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: "
                       "{P: [0.2, 0.1, -0.4], T: {at: [0.3, -0.2, 0.1], axes: {z: [1, 2, -3]}}}}\n"
                       "  b: {joint: {name: S, motions: [T1, T2, T3], at: base}, mass: 1, points: {Q: [0.5, 0, 0]}}\n"
                       "loops: {W: {ball: [base.P, b.Q]}}\n",
                       joints[j]);
        loaded l = load_text(text);
        kmp_evaluator *eval = l.system ? kmp_eval_new(l.system, "tape") : NULL;
        int first = two ? 2 : strstr(joints[j], "weld") ? 0 : 1;
        double q[5] = {0.3, -0.8};
        const double slide[3] = {0.3, -0.2, 0.7}, h[3] = {0.6, -0.3, 1.1};
        memcpy(q + first, slide, sizeof slide);
        CHECK(eval);
        if (eval) {
            kmp_eval_closure(eval, 0, q);
            for (int k = 0; k < 3; k++)
                CHECK_NEAR(eval->h[k], h[k], 1e-14);
        }
        kmp_eval_free(eval);
        unload(&l);
    }
}

/* -- one axis alone ---------------------------------------------------------------------------------- */

/* Rodrigues' rotation of unit vector k onto e: 1 + V + V V / (1 + cos), V = (k x e) x. */
static void check_shortest(int k, const double e[3])
{
    double unit[3] = {k == 0, k == 1, k == 2}, v[3], m[3][3];
    kmp_cross3(unit, e, v);
    kmp_complete_axes(k, e, m);
    for (int j = 0; j < 3; j++) {
        double x[3] = {j == 0, j == 1, j == 2}, once[3], twice[3];
        kmp_cross3(v, x, once);
        kmp_cross3(v, once, twice);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(m[i][j], x[i] + once[i] + twice[i] / (1 + e[k]), 1e-13);
    }
}

/* Columns are right-handed unit vectors across each other. */
static void check_square(double m[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0, minor = m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                                    m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3];
            for (int k = 0; k < 3; k++)
                sum += m[k][i] * m[k][j];
            CHECK_NEAR(sum, i == j, 1e-15);
            CHECK_NEAR(m[i][j], minor, 1e-15);
        }
}

static void one_axis_turns_the_shortest_way(void)
{
    for (int k = 0; k < 3; k++)
        for (int step = 0; step < 60; step++) {
            double angle = 3.1 * step / 59, way = 0.7 * step, e[3];
            e[k] = cos(angle);
            e[(k + 1) % 3] = sin(angle) * cos(way);
            e[(k + 2) % 3] = sin(angle) * sin(way);
            check_shortest(k, e);
        }
}

/* There the turn is about the axis that is across both, down to where that one is no longer known. */
static void close_to_the_opposite(void)
{
    for (int k = 0; k < 3; k++)
        for (int power = 2; power < 20; power++) {
            double small = 2 * pow(10, -power), e[3], m[3][3];
            int i = (k + 1) % 3, j = (k + 2) % 3;
            e[i] = -0.6 * small;
            e[j] = 0.8 * small;
            e[k] = -sqrt(1 - small * small);
            kmp_complete_axes(k, e, m);
            check_square(m);
            CHECK_NEAR(m[k][k], e[k], 0);
            CHECK_NEAR(m[i][i], small > 1e-9 ? 1 - 0.36 * (1 - e[k]) : 1, 1e-9);
            CHECK_NEAR(m[j][j], small > 1e-9 ? 1 - 0.64 * (1 - e[k]) : -1, 1e-9);
        }
}

static void points_take_them(void)
{
    loaded l = load_text("kempe: 1\nground: {points: {O: {at: [0, 0, 0], axes: {z: [-0.0529, 0.424, -1.28]}}}}\n"
                         "bodies:\n  b: {joint: {name: A, revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1, yy: 1, "
                         "zz: 1}, points: {P: [1, 0, 0]}}\nrun: {outputs: [position(b.P)]}\n");
    static const double expected[3] = {0.970134, 0.239382, 0.039202};
    kmp_evaluator *eval = l.system ? kmp_eval_new(l.system, "tape") : NULL;
    double zero = 0;
    CHECK(eval);
    for (int k = 0; eval && k < 3; k++)
        CHECK_NEAR(kmp_eval_shown(eval, 0, &zero, &zero, &zero, NULL)[k], expected[k], 1e-6);
    kmp_eval_free(eval);
    unload(&l);
}

int main(void)
{
    TEST(forces_have_ground_axes);
    TEST(rows_of_a_ball_are_components);
    TEST(one_axis_turns_the_shortest_way);
    TEST(close_to_the_opposite);
    TEST(points_take_them);
    return check_report();
}
