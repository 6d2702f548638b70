/* SPDX-License-Identifier: BSD-3-Clause */
/* Graphs of joints have the equations of trees and closures, wherever their bodies have their origins and axes. */
#include "base/text.h"
#include "derived.h"
#include "distance.h"
#include "dynamics/equations.h"
#include "joint_graphs.h"
#include "model/data/body.h"
#include "model/data/model.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>

static void check_close(const char *what, int n, const double *a, const double *b)
{
    double off = distance(n, a, b);
    if (!(off <= 1e-12))
        printf("%s: off by %.3g\n", what, off);
    CHECK(off <= 1e-12);
}

/* M and C, with `closures` h, J and jdqd too, at random states; frees both models. */
static void check_equations(kempe_model *tree, kempe_model *graph, bool closures)
{
    enum { SETS = 255 };
    derived a, b;
    CHECK(tree && graph && tree->motion_count == graph->motion_count);
    if (!tree || !graph || !derived_init(&a, tree, SETS, KMP_SCHEME_COMPOSITE, false))
        return;
    CHECK(derived_init(&b, graph, SETS, KMP_SCHEME_COMPOSITE, false));
    CHECK(!closures || a.m == b.m);
    for (int k = 0; k < a.n; k++)
        CHECK_TEXT(graph->motions[k].name, tree->motions[k].name);
    for (int trial = 0; trial < 3; trial++) {
        state s = random_state_vectors();
        derived_eval(&a, &s);
        derived_eval(&b, &s);
        check_close("M", a.n * a.n, b.mass, a.mass);
        check_close("C", a.n, b.bias, a.bias);
        if (closures) {
            check_close("h", a.m, b.h, a.h);
            check_close("J", a.m * a.n, b.jacobian, a.jacobian);
            check_close("jdqd", a.m, b.jdqd, a.jdqd);
        }
    }
    derived_free(&a);
    derived_free(&b);
    kempe_model_free(tree);
    kempe_model_free(graph);
}

static void test_four_bar(void)
{
    kempe_model *graph = read_two(four_bar, "joints:\n"
                                            "  C: {revolute: [coupler.C, rocker.C]}\n"
                                            "  crank: {revolute: [ground.O, crank.O], cut: no}\n"
                                            "  coupler: {revolute: [crank.B, coupler.O], cut: no}\n"
                                            "  rocker: {revolute: [ground.D, rocker.O], cut: no}\n");
    check_equations(read_file("examples/four_bar/four_bar.yaml"), graph, true);
}

static void test_spatial_slider_crank(void)
{
    static const char graph[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {A: [0, 0.1, 0.12], X: [0.2, 0, 0]}}\nbodies:\n"
        "  crank: {mass: 0.12, inertia: {xx: 1e-4, yy: 1e-5, zz: 1e-4}, points: {O: [0, 0, 0], P: [0, 0, 0.08]}}\n"
        "  slider: {mass: 2, points: {U: [0, 0, 0]}}\n"
        "  rod: {mass: 0.5, com: [-0.1, 0.05, 0.1], inertia: {xx: 0.0024, yy: 0.0036, zz: 0.0024, xy: 0.0008, "
        "xz: 0.0016, yz: -0.0008}, points: {O: [0, 0, 0], E: [-0.2, 0.1, 0.2]}}\n"
        "joints:\n"
        "  B: {spherical: [crank.P, rod.E]}\n"
        "  A: {revolute: [ground.A, crank.O], axis: x}\n"
        "  S: {prismatic: [ground.X, slider.U], axis: x}\n"
        "  U: {universal: [slider.U, rod.O], axes: [z, [-1, -2, 0]]}\n";
    check_equations(read_file("tests/models/spatial_slider_crank_hung.yaml"), read_text(graph), true);
}

/* The points of a body of another model. */
static void put_points_of(kmp_text *text, const kempe_model *model, const char *body)
{
    kmp_text_put(text, "points: {O: [0, 0, 0]");
    for (int k = 0; k < model->point_count; k++) {
        const kmp_point *point = &model->points[k];
        if (strcmp(model->bodies[point->body].name, body) != 0)
            continue;
        kmp_text_printf(text, ", %s: ", point->name);
        for (int i = 0; i < 3; i++) {
            kmp_text_put(text, i ? ", " : "[");
            kmp_text_number(text, point->at[i].value);
        }
        kmp_text_put(text, "]");
    }
    kmp_text_put(text, "}");
}

static void test_stewart(void)
{
    kempe_model *tree = read_file("tests/models/stewart_tree.yaml");
    kmp_text text = {0};
    if (!tree)
        return;
    kmp_text_put(&text, "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {");
    for (int k = 0; k < tree->parameter_count; k++) {
        kmp_text_printf(&text, "%s%s: ", k ? ", " : "", tree->parameters[k].name);
        kmp_text_number(&text, tree->parameters[k].number.value);
    }
    kmp_text_put(&text, "}\nground: {");
    put_points_of(&text, tree, "ground");
    kmp_text_put(&text, "}\nbodies:\n  platform: {joint: {free: x, at: ground.C}, mass: 10, "
                        "inertia: {xx: 0.6, yy: 0.7, zz: 1.2}, ");
    put_points_of(&text, tree, "platform");
    kmp_text_put(&text, "}\n");
    for (int k = 1; k <= 6; k++)
        kmp_text_printf(&text,
                        "  leg%d: {points: {O: [0, 0, 0], W: {at: [0, 0, 0], axes: {z: [x%d, y%d, 1]}}}}\n"
                        "  lower%d: {mass: 1, com: [0, 0, 0.25], inertia: {xx: 0.02, yy: 0.02, zz: 0.001}, "
                        "points: {O: [0, 0, 0]}}\n"
                        "  upper%d: {mass: 0.5, com: [0, 0, L%d - 0.25], inertia: {xx: 0.01, yy: 0.01, zz: 0.0005}, "
                        "points: {O: [0, 0, 0], E: [0, 0, L%d]}}\n",
                        k, k, k, k, k, k, k);
    kmp_text_put(&text, "joints:\n");
    for (int k = 1; k <= 6; k++)
        kmp_text_printf(&text,
                        "  C%d: {spherical: [upper%d.E, platform.P%d]}\n"
                        "  U%d: {universal: [ground.B%d, leg%d.O], axis: x}\n"
                        "  W%d: {weld: [leg%d.W, lower%d.O]}\n"
                        "  S%d: {prismatic: [lower%d.O, upper%d.O]}\n",
                        k, k, k, k, k, k, k, k, k, k, k, k);
    kmp_text_put(&text, "forces:\n");
    for (int k = 1; k <= 6; k++)
        kmp_text_printf(&text,
                        "  s%d: {spring: [ground.B%d, platform.P%d], stiffness: 2000, damping: 10, free_length: L%d}\n",
                        k, k, k, k);
    kempe_model *graph = read_text(text.s ? text.s : "");
    CHECK(graph && graph->cut_count == 6);
    check_equations(tree, graph, true);
    kmp_text_free(&text);
}

static void test_double_wishbone(void)
{
    static const char graph[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\n"
        "ground: {points: {UF: [-0.048, 0.446, 0.245], UB: [-0.268, 0.478, 0.196], LB: [-0.223, 0.307, 0],\n"
        "                  T: [-0.250, 0.448, 0.054], S: [-0.040, 0.910, -0.026]}}\n"
        "parameters: {tie: \"sqrt((0.250 - 0.176)^2 + (0.448 - 0.821)^2 + (0.054 + 0.016)^2)\"}\n"
        "bodies:\n"
        "  upper: {mass: 5.813, com: [0.162, 0.111, 0.022], inertia: {xx: 0.03, yy: 0.03, zz: 0.06},\n"
        "          points: {O: [0, 0, 0], B: [0.215, 0.238, 0.019]}}\n"
        "  lower: {mass: 23.965, com: [0.223, 0.240, -0.059], inertia: {xx: 0.4, yy: 0.4, zz: 0.8},\n"
        "          points: {O: [0, 0, 0], B: [0.187, 0.480, -0.118]}}\n"
        "  upright: {joint: {motions: [T1, T2, T3, R3, R1, R2], at: ground.S}, mass: 19.45, com: [0, -0.159, 0],\n"
        "            inertia: {xx: 0.1656, yy: 0.1934, zz: 0.04367}, points: {O: [0, 0, 0],\n"
        "            U: [-0.013, -0.194, 0.241], L: [0.004, -0.123, -0.092], T: [-0.136, -0.089, 0.010]}}\n"
        "  spindle: {mass: 14.705, inertia: {yy: 0.07352 + 0.4}, points: {O: [0, 0, 0]}}\n"
        "joints:\n"
        "  upper: {revolute: [ground.UB, upper.O], axis: [0.220, -0.032, 0.049]}\n"
        "  lower: {revolute: [ground.LB, lower.O], axis: x}\n"
        "  spindle: {revolute: [upright.O, spindle.O], axis: y}\n"
        "  U: {spherical: [upper.B, upright.U]}\n"
        "  L: {spherical: [lower.B, upright.L]}\n"
        "loops:\n"
        "  T: {rod: [ground.T, upright.T], length: tie}\n"
        "drives: {motor: {joint: lower, angle: \"-10 deg + 5 deg*t\"}}\n";
    check_equations(read_file("examples/double_wishbone/double_wishbone.yaml"), read_text(graph), false);
}

/* The axes of the cut hinge stand in its points. */
static void test_bennett(void)
{
    static const char graph[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\n"
        "ground: {points: {O: [0, 0, 0], P: {at: [-1.5027138229377355, 0, 0],\n"
        "         axes: {z: [0, -0.42261826174069944, -0.90630778703665]}}}}\n"
        "bodies:\n"
        "  b1: {mass: 1, com: [0.5, 0, 0], inertia: {xx: 0.01, yy: 0.1, zz: 0.1}, points: {O: [0, 0, 0], E: [1, 0, "
        "0]}}\n"
        "  b2: {mass: 1, com: [0.75135691146886774, 0, 0], inertia: {xx: 0.01, yy: 0.2, zz: 0.2},\n"
        "       points: {O: [0, 0, 0], E: [1.5027138229377355, 0, 0]}}\n"
        "  b3: {mass: 1, com: [0.5, 0, 0], inertia: {xx: 0.01, yy: 0.1, zz: 0.1}, points: {O: [0, 0, 0],\n"
        "       E: {at: [1, 0, 0], axes: {z: [0, 0.96592582628906831, 0.25881904510252074]}}}}\n"
        "joints:\n"
        "  B: {revolute: [b3.E, ground.P]}\n"
        "  j1: {revolute: [ground.O, b1.O]}\n"
        "  j2: {revolute: [b1.E, b2.O], axis: [0, -0.64278760968653925, 0.76604444311897801]}\n"
        "  j3: {revolute: [b2.E, b3.O], axis: [0, -0.90630778703665005, -0.42261826174069933]}\n"
        "start: {q: {j1: 1, j2: 2.7568487616769688, j3: -1}, qd: {j1: 2}, hold: [j1]}\n";
    kempe_model *model = read_text(graph);
    CHECK(model && model->cut_count == 1 && strcmp(model->cuts[0].joint, "B") == 0);
    check_equations(read_file("tests/models/bennett_hinge.yaml"), model, false);
}

/* -- origins and axes of no account --------------------------------------------------------------------------- */

/* Three bars in a row; `origin`: of every bar, from its joint; `axes`: of all points. */
static kempe_model *three_bars(double origin, const char *axes)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "kempe: 1\nground: {points: {Q: {at: [0, 0, 0]%s}}}\nbodies:\n", axes);
    for (int b = 1; b <= 3; b++)
        kmp_text_printf(&text,
                        "  b%d: {mass: 1, com: [%.17g, 0, 0], points: {P: {at: [%.17g, 0, "
                        "0]%s}, Q: {at: [%.17g, 0, 0]%s}}}\n",
                        b, 0.5 - origin, -origin, axes, 2 - origin, axes);
    kmp_text_put(&text, "joints:\n  A: {revolute: [ground.Q, b1.P]}\n  B: {revolute: [b1.Q, b2.P]}\n"
                        "  C: {revolute: [b2.Q, b3.P]}\n");
    kempe_model *model = read_text(text.s);
    kmp_text_free(&text);
    return model;
}

static void test_origins(void)
{
    kempe_model *plain = three_bars(0, ""), *moved = three_bars(64, "");
    kempe_system *system = NULL;
    CHECK(moved && kempe_system_new(moved, &system) == KEMPE_OK && system->length == 2);
    kempe_system_free(system);
    check_equations(plain, moved, true);
}

static int instructions(const kempe_model *model)
{
    derived d;
    if (!model || !derived_init(&d, model, 255, KMP_SCHEME_COMPOSITE, false))
        return -1;
    int count = d.program->code[d.program->stages];
    derived_free(&d);
    return count;
}

/* Axes that are turned and turned back cost nothing. */
static void test_axes_cost_nothing(void)
{
    kempe_model *plain = three_bars(0, ""), *turned = three_bars(3, ", axes: {z: [0, 1, 3]}");
    int count = instructions(plain);
    CHECK(count > 0 && instructions(turned) == count);
    check_equations(plain, turned, true);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_four_bar);
    TEST(test_spatial_slider_crank);
    TEST(test_stewart);
    TEST(test_double_wishbone);
    TEST(test_bennett);
    TEST(test_origins);
    TEST(test_axes_cost_nothing);
    kempe_context_free(context);
    return check_report();
}
