/* SPDX-License-Identifier: BSD-3-Clause */
/* Graphs of joints: which are cut and what is said of it, the same equations as from trees and closures, the same
 * motion whatever is cut, joints seen from their second body. */
#include "base/file.h"
#include "check.h"
#include "constraints/kinds/kind.h"
#include "derived.h"
#include "random_model.h"
#include "results/columns.h"

static kempe_context *context;

static kempe_model *read_text(const char *text)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text(context, text, "text", &model) != KEMPE_OK)
        printf("%s\n%s\n", kempe_context_message(context), text);
    CHECK(model != NULL);
    return model;
}

static kempe_model *read_file(const char *name)
{
    kempe_model *model = NULL;
    char path[512];
    snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, name);
    if (kempe_model_read(context, path, &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

/* A row of joints.def with that of cuts.def, which may be missing. */
typedef struct joint_kind {
    const char *name, *chain, *closure;
    int rows;
} joint_kind;

static bool joint_kind_at(int k, joint_kind *kind)
{
    static const joint_kind joints[] = {
#define KMP_JOINT(name, chain) {#name, chain, NULL, 0},
#include "model/joints.def"
#undef KMP_JOINT
    };
    static const joint_kind cuts[] = {
#define KMP_CUT(joint, closure, rows, axes) {#joint, NULL, #closure, rows},
#include "model/cuts.def"
#undef KMP_CUT
    };
    if (k >= (int)(sizeof joints / sizeof *joints))
        return false;
    *kind = joints[k];
    for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++)
        if (strcmp(cuts[i].name, kind->name) == 0) {
            kind->closure = cuts[i].closure;
            kind->rows = cuts[i].rows;
        }
    return true;
}

/* -- the same equations ---------------------------------------------------------------------------------- */

static void check_close(const char *what, int n, const double *a, const double *b)
{
    double off = 0, size = 1;
    for (int k = 0; k < n; k++) {
        off = fmax(off, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
        size = fmax(size, fabs(b[k]));
    }
    if (!(off <= 1e-12 * size))
        printf("%s: off by %.3g of %.3g\n", what, off, size);
    CHECK(off <= 1e-12 * size);
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

static const char four_bar[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\n"
    "parameters: {crank: 0.3, coupler: 0.8, rocker: 0.7, base: 0.9, crank_mass: 1, coupler_mass: 1, rocker_mass: 1,\n"
    "  diagonal: sqrt(base^2 + crank^2), along: (coupler^2 - rocker^2 + diagonal^2)/(2*diagonal),\n"
    "  across: sqrt(coupler^2 - along^2), Cx: (along*base + across*crank)/diagonal,\n"
    "  Cy: crank + (across*base - along*crank)/diagonal}\n"
    "ground: {points: {O: [0, 0, 0], D: [base, 0, 0]}}\n"
    "bodies:\n"
    "  crank: {mass: crank_mass, com: [0, crank/2, 0], inertia: {zz: crank_mass*crank^2/12},\n"
    "          points: {O: [0, 0, 0], B: [0, crank, 0]}}\n"
    "  coupler: {mass: coupler_mass, com: [Cx/2, (Cy - crank)/2, 0], inertia: {zz: coupler_mass*coupler^2/12},\n"
    "            points: {O: [0, 0, 0], C: [Cx, Cy - crank, 0]}}\n"
    "  rocker: {mass: rocker_mass, com: [(Cx - base)/2, Cy/2, 0], inertia: {zz: rocker_mass*rocker^2/12},\n"
    "           points: {O: [0, 0, 0], C: [Cx - base, Cy, 0]}}\n";

static kempe_model *read_two(const char *head, const char *tail)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "%s%s", head, tail);
    kempe_model *model = read_text(text.s ? text.s : "");
    kmp_text_free(&text);
    return model;
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
    check_equations(read_file("tests/models/spatial_slider_crank.yaml"), read_text(graph), true);
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
    kempe_model *tree = read_file("tests/models/stewart.yaml");
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

/* -- the same motion --------------------------------------------------------------------------------------- */

enum { MOST_COLUMNS = 64 };

/* The outputs at the first and the last row of a run, without the time; their number, 0 when it failed. */
static int run_text(const char *text, const char *road, double t_end, double rtol, double *first, double *last)
{
    kempe_model *model = read_text(text);
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_run run = kempe_run_default();
    kmp_columns columns = {0};
    int count = 0;
    run.road = road;
    run.t_end = run.every = t_end;
    run.rtol = rtol;
    bool good = model && kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK;
    if (!good)
        printf("%s\n%s\n", kempe_context_message(context), text);
    CHECK(good);
    kmp_plant *plant = good ? kmp_plant_new(system, "tape") : NULL;
    if (plant && kmp_columns_init(&columns, system) && columns.count <= MOST_COLUMNS) {
        kmp_columns_fill(t, plant, 0, first);
        kmp_columns_fill(t, plant, kempe_trajectory_row_count(t) - 1, last);
        count = columns.count - 1;
        memmove(first, first + 1, (size_t)count * sizeof *first);
        memmove(last, last + 1, (size_t)count * sizeof *last);
    }
    kmp_columns_free(&columns);
    kmp_plant_free(plant);
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    return count;
}

static double farthest(int n, const double *a, const double *b)
{
    double off = 0, size = 1;
    for (int k = 0; k < n; k++) {
        off = fmax(off, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
        size = fmax(size, fabs(b[k]));
    }
    return off / size;
}

static void put_four_bar(kmp_text *text, int cut)
{
    static const char *const names[] = {"A", "B", "C", "D"};
    static const char *const points[] = {"ground.O, crank.O", "crank.B, coupler.O", "rocker.C, coupler.C",
                                         "rocker.O, ground.D"};
    kmp_text_printf(text, "%sjoints:\n", four_bar);
    for (int k = 0; k < 4; k++)
        kmp_text_printf(text, "  %s: {revolute: [%s]%s}\n", names[k], points[k], k == cut ? ", cut: yes" : "");
}

/* The rates of all four hinges at the start, at 20 rad/s of the crank. */
static void start_rates(double rates[4])
{
    kmp_text text = {0};
    double first[MOST_COLUMNS], last[MOST_COLUMNS];
    put_four_bar(&text, 2);
    kmp_text_put(&text, "start: {qd: {A: 20}, hold: [A]}\nrun: {outputs: [qd(A), qd(B), qd(D)]}\n");
    CHECK(run_text(text.s, NULL, 1e-3, 1e-12, first, last) == 3);
    rates[0] = first[0];
    rates[1] = first[1];
    rates[2] = first[0] + first[1] + first[2]; /* coupler against rocker, which turns by -D */
    rates[3] = first[2];
    CHECK_NEAR(rates[0], 20, 1e-14);
    kmp_text_free(&text);
}

/* The example's reference, of 113-bit arithmetic: the angles of crank and rocker at t = 2; here the points that they
 * carry, whatever is cut. */
static void test_every_cut_of_the_four_bar(void)
{
    const double crank = 48.0361818028095014, rocker = 0.333951832272976212;
    double rates[4];
    start_rates(rates);
    for (int cut = 0; cut < 4; cut++) {
        kmp_text text = {0};
        double first[MOST_COLUMNS], last[MOST_COLUMNS];
        put_four_bar(&text, cut);
        kmp_text_put(&text, "start: {qd: {");
        for (int k = 0, written = 0; k < 4; k++)
            if (k != cut)
                kmp_text_printf(&text, "%s%c: %.17g", written++ ? ", " : "", 'A' + k, rates[k]);
        kmp_text_put(&text, "}}\nrun: {outputs: [position(crank.B), position(rocker.C)]}\n");
        CHECK(run_text(text.s, cut % 2 ? "projected" : NULL, 2, 1e-12, first, last) == 6);
        double x = first[3] - 0.9, y = first[4];
        CHECK_NEAR(last[0], -0.3 * sin(crank), 1e-8);
        CHECK_NEAR(last[1], 0.3 * cos(crank), 1e-8);
        CHECK_NEAR(last[3], 0.9 + x * cos(rocker) - y * sin(rocker), 1e-8);
        CHECK_NEAR(last[4], x * sin(rocker) + y * cos(rocker), 1e-8);
        kmp_text_free(&text);
    }
}

/* The example's reference, an integral over the crank's angle in 34 digits: where the crank's and the coupler's ends
 * are at t = 2, for pairs of hinges that are cut. All hinges have a start value, for there is more than one way to
 * close. */
static void test_cuts_of_the_six_bar(void)
{
    static const char *const cuts[] = {"BQ", "AE", "DP", "DE", "BE", "AQ", "BP"};
    static const char *const hinges[] = {"O: {revolute: [ground.O, crank.O]",   "A: {revolute: [coupler.A, crank.A]",
                                         "B: {revolute: [coupler.B, rocker.B]", "D: {revolute: [ground.D, rocker.D]",
                                         "P: {revolute: [coupler.P, rod.P]",    "Q: {revolute: [rod.Q, lever.Q]",
                                         "E: {revolute: [lever.E, ground.E]"};
    char *model = NULL;
    size_t length;
    CHECK(kmp_file_read(context, KEMPE_ROOT "/examples/stephenson/stephenson.yaml", &model, &length) == KEMPE_OK);
    char *joints = model ? strstr(model, "\njoints:") : NULL;
    CHECK(joints != NULL);
    for (size_t k = 0; joints && k < sizeof cuts / sizeof *cuts; k++) {
        double first[MOST_COLUMNS], last[MOST_COLUMNS];
        kmp_text text = {0};
        kmp_text_printf(&text, "%.*s\njoints:\n", (int)(joints - model), model);
        for (int j = 0; j < 7; j++)
            kmp_text_printf(&text, "  %s%s}\n", hinges[j], strchr(cuts[k], hinges[j][0]) ? ", cut: yes" : "");
        kmp_text_put(&text,
                     "start: {q: {O: 90 deg, A: 65 deg, B: 80 deg, D: 105 deg, P: -27 deg, Q: 82 deg, E: -79 deg},"
                     " hold: [O], qd: {O: 15}}\nrun: {outputs: [position(crank.A), position(coupler.P)]}\n");
        CHECK(run_text(text.s, k % 2 ? "projected" : NULL, 2, 1e-12, first, last) == 6);
        CHECK_NEAR(last[0], 0.3 * cos(37.71152463158547582), 1e-9);
        CHECK_NEAR(last[1], 0.3 * sin(37.71152463158547582), 1e-9);
        CHECK_NEAR(last[3], 0.31264018736112810811, 1e-9);
        CHECK_NEAR(last[4], 0.71424442385362478444, 1e-9);
        kmp_text_free(&text);
    }
    kmp_free(model);
}

/* -- random graphs ----------------------------------------------------------------------------------------- */

enum { GRAPH_BODIES = 5, GRAPH_LOOPS = 3, GRAPH_JOINTS = GRAPH_BODIES + GRAPH_LOOPS };

/* Bodies somewhere in space, and joints between them that fit with all coordinates zero, whatever is cut. */
typedef struct random_links {
    pose body[GRAPH_BODIES + 1];
    int ends[GRAPH_JOINTS][2];
    joint_kind kind[GRAPH_JOINTS];
    pose place[GRAPH_JOINTS];
} random_links;

static pose random_pose(void)
{
    pose p = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {between(-1, 1), between(-1, 1), between(-1, 1)}};
    double e[3] = {between(-1, 1), between(-1, 1), between(0.1, 1)};
    double length = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    for (int k = 0; k < 3; k++)
        e[k] /= length;
    pose_turn(&p, e, between(-3, 3));
    return p;
}

static joint_kind random_kind(void)
{
    joint_kind kind = {0};
    do
        (void)joint_kind_at(pick(9), &kind);
    while (!kind.closure);
    return kind;
}

/* At least two degrees of freedom. */
static random_links random_links_new(uint64_t seed)
{
    random_links g;
    int rows;
    random_seed(seed);
    g.body[0] = (pose){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    for (int b = 1; b <= GRAPH_BODIES; b++)
        g.body[b] = random_pose();
    for (int j = 0; j < GRAPH_JOINTS; j++) {
        bool swap = pick(2);
        int a = j < GRAPH_BODIES ? pick(j + 1) : pick(GRAPH_BODIES), b = j < GRAPH_BODIES ? j + 1 : GRAPH_BODIES;
        g.ends[j][swap] = a;
        g.ends[j][!swap] = b == a ? 0 : b;
        g.place[j] = random_pose();
    }
    do {
        rows = 0;
        for (int j = 0; j < GRAPH_JOINTS; j++) {
            g.kind[j] = random_kind();
            rows += g.kind[j].rows;
        }
    } while (rows > 6 * GRAPH_BODIES - 2);
    return g;
}

/* A joint's point in the axes of one of its bodies. */
static void put_place(kmp_text *text, const pose *body, const pose *place, int joint)
{
    double at[3] = {0}, axes[3][3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            at[i] += body->r[k][i] * (place->x[k] - body->x[k]);
            for (int n = 0; n < 3; n++)
                axes[i][n] += body->r[k][i] * place->r[k][n];
        }
    kmp_text_printf(text,
                    "J%d: {at: [%.17g, %.17g, %.17g], axes: {x: [%.17g, %.17g, %.17g], z: [%.17g, %.17g, %.17g]}}",
                    joint, at[0], at[1], at[2], axes[0][0], axes[1][0], axes[2][0], axes[0][2], axes[1][2], axes[2][2]);
}

static void put_links(kmp_text *text, const random_links *g, const bool *cut)
{
    kmp_text_put(text, "kempe: 1\ngravity: [1, -9, 2]\n");
    for (int b = 0; b <= GRAPH_BODIES; b++) {
        if (b == 0)
            kmp_text_put(text, "ground: {points: {G: [1, 1, 1]");
        else
            kmp_text_printf(text,
                            "%s  b%d: {mass: %d.5, com: [0.1, 0.%d, -0.2], inertia: {xx: 0.3, yy: 0.4, zz: 0.5, xy: "
                            "0.05}, points: {G: [0.2, 0.1, 0.3]",
                            b == 1 ? "bodies:\n" : "", b, b, b);
        for (int j = 0; j < GRAPH_JOINTS; j++)
            if (g->ends[j][0] == b || g->ends[j][1] == b) {
                kmp_text_put(text, ", ");
                put_place(text, &g->body[b], &g->place[j], j);
            }
        kmp_text_put(text, "}}\n");
    }
    kmp_text_put(text, "joints:\n");
    for (int j = 0; j < GRAPH_JOINTS; j++) {
        kmp_text_printf(text, "  j%d: {%s: [", j, g->kind[j].name);
        for (int k = 0; k < 2; k++)
            if (g->ends[j][k])
                kmp_text_printf(text, "%sb%d.J%d", k ? ", " : "", g->ends[j][k], j);
            else
                kmp_text_printf(text, "%sground.J%d", k ? ", " : "", j);
        kmp_text_printf(text, "]%s%s}\n", g->kind[j].chain[0] && j % 3 ? ", axis: [1, 2, -1]" : "",
                        !cut     ? ""
                        : cut[j] ? ", cut: yes"
                                 : ", cut: no");
    }
    kmp_text_put(text, "forces: {s: {spring: [ground.G, b1.G], stiffness: 50, damping: 2}}\nrun: {outputs: [");
    for (int b = 1; b <= GRAPH_BODIES; b++)
        kmp_text_printf(text, "%sposition(b%d.G), acceleration(b%d.G)", b > 1 ? ", " : "", b, b);
    kmp_text_put(text, "]}\n");
}

/* Joints taken in a random order, those that close a loop are cut. */
static void random_cuts(const random_links *g, bool *cut)
{
    int order[GRAPH_JOINTS], group[GRAPH_BODIES + 1];
    for (int b = 0; b <= GRAPH_BODIES; b++)
        group[b] = b;
    for (int j = 0; j < GRAPH_JOINTS; j++) {
        int at = pick(j + 1);
        for (int k = j; k > at; k--)
            order[k] = order[k - 1];
        order[at] = j;
    }
    for (int k = 0; k < GRAPH_JOINTS; k++) {
        int a = group[g->ends[order[k]][0]], b = group[g->ends[order[k]][1]];
        cut[order[k]] = a == b;
        for (int i = 0; i <= GRAPH_BODIES; i++)
            if (group[i] == a)
                group[i] = b;
    }
}

/* At rest with all joints closed, and a while later: the same accelerations and places from every tree. */
static void test_random_graphs(void)
{
    for (uint64_t seed = 1; seed <= 24; seed++) {
        random_links g = random_links_new(seed);
        double first[4][MOST_COLUMNS], last[4][MOST_COLUMNS];
        for (int trial = 0; trial < 4; trial++) {
            kmp_text text = {0};
            bool cut[GRAPH_JOINTS];
            random_cuts(&g, cut);
            put_links(&text, &g, trial ? cut : NULL);
            CHECK(run_text(text.s, "projected", 0.1, 1e-11, first[trial], last[trial]) == 6 * GRAPH_BODIES);
            kmp_text_free(&text);
            if (trial == 0)
                continue;
            double start = farthest(6 * GRAPH_BODIES, first[trial], first[0]);
            double end = farthest(6 * GRAPH_BODIES, last[trial], last[0]);
            if (!(start <= 1e-9 && end <= 1e-7))
                printf("graph %d, tree %d: off by %.3g and %.3g\n", (int)seed, trial, start, end);
            CHECK(start <= 1e-9 && end <= 1e-7);
        }
    }
}

/* Sum over the bodies of the coordinates between the ground and the body, for a set of joints; -1 when it is no tree.
 */
static int depth_of(const random_links *g, unsigned tree)
{
    int depth[GRAPH_BODIES + 1], reached = 1, sum = 0;
    for (int b = 1; b <= GRAPH_BODIES; b++)
        depth[b] = -1;
    depth[0] = 0;
    for (int before = 0; before < reached;) {
        before = reached;
        for (int j = 0; j < GRAPH_JOINTS; j++) {
            int a = g->ends[j][0], b = g->ends[j][1];
            if (!(tree & 1u << j) || (depth[a] < 0) == (depth[b] < 0))
                continue;
            depth[depth[a] < 0 ? a : b] = depth[depth[a] < 0 ? b : a] + (int)strlen(g->kind[j].chain) / 2;
            reached++;
        }
    }
    for (int b = 1; b <= GRAPH_BODIES; b++)
        sum += depth[b];
    return reached == GRAPH_BODIES + 1 ? sum : -1;
}

static int rows_of(const random_links *g, unsigned tree)
{
    int rows = 0;
    for (int j = 0; j < GRAPH_JOINTS; j++)
        rows += tree & 1u << j ? 0 : g->kind[j].rows;
    return rows;
}

static unsigned chosen_tree(const random_links *g)
{
    kmp_text text = {0};
    unsigned tree = 0;
    put_links(&text, g, NULL);
    kempe_model *model = read_text(text.s);
    for (int b = 1; model && b < model->body_count; b++)
        tree |= 1u << (model->bodies[b].joint[1] - '0');
    kempe_model_free(model);
    kmp_text_free(&text);
    return tree;
}

/* No tree has cuts of fewer rows; of those with as few, few have shorter chains. */
static void test_choice_is_best(void)
{
    enum { GRAPHS = 300 };
    int shortest = 0;
    double worst = 1;
    for (uint64_t seed = 1; seed <= GRAPHS; seed++) {
        random_links g = random_links_new(seed);
        unsigned chosen = chosen_tree(&g);
        int rows = rows_of(&g, chosen), depth = depth_of(&g, chosen), least = depth;
        CHECK(depth >= 0);
        for (unsigned tree = 0; tree < 1u << GRAPH_JOINTS; tree++) {
            int count = 0;
            for (int j = 0; j < GRAPH_JOINTS; j++)
                count += (tree & 1u << j) != 0;
            int other = count == GRAPH_BODIES ? depth_of(&g, tree) : -1;
            if (other < 0)
                continue;
            CHECK(rows_of(&g, tree) >= rows);
            if (rows_of(&g, tree) == rows && other < least)
                least = other;
        }
        shortest += depth == least;
        if (least > 0)
            worst = fmax(worst, (double)depth / least);
    }
    printf("  of %d graphs %d have the shortest chains too, at worst %.2f times as long\n", GRAPHS, shortest, worst);
    CHECK(10 * shortest >= 9 * GRAPHS);
}

/* -- from the second body ------------------------------------------------------------------------------------ */

/* The second point of the joint against the first, for coordinates by name. */
static pose between_points(const kempe_model *model, const double *q, const char *a, const char *b)
{
    pose p[MODEL_MAX_BODIES], at[2], d;
    const char *const names[2] = {a, b};
    plain_poses(model, q, p);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < model->point_count; i++)
            if (strcmp(model->bodies[model->points[i].body].name, names[k]) == 0 &&
                strcmp(model->points[i].name, "P") == 0) {
                at[k] = p[model->points[i].body];
                plain_point(model, p, i, at[k].x);
                if (model->points[i].turned)
                    pose_multiply(&at[k], model->points[i].axes);
            }
    for (int i = 0; i < 3; i++) {
        d.x[i] = 0;
        for (int k = 0; k < 3; k++) {
            d.x[i] += at[0].r[k][i] * (at[1].x[k] - at[0].x[k]);
            d.r[i][k] = 0;
            for (int n = 0; n < 3; n++)
                d.r[i][k] += at[0].r[n][i] * at[1].r[n][k];
        }
    }
    return d;
}

/* A joint from a to b, of which one or the other hangs on the ground. */
static void check_reversed(const joint_kind *kind)
{
    static const char *const bodies[] = {"a", "b"};
    pose found[2];
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        double q[8] = {0};
        kmp_text_printf(&text,
                        "kempe: 1\nbodies:\n"
                        "  a: {%s points: {P: {at: [1, 2, 3], axes: {x: [1, 2, 0.5]}}}}\n"
                        "  b: {%s points: {P: {at: [-0.5, 1, 2], axes: {y: [1, -1, 2]}}}}\n"
                        "joints: {J: {%s: [a.P, b.P]%s}}\n",
                        k ? "" : "joint: {name: G, motions: [T1, R2], at: ground}, ",
                        k ? "joint: {name: G, motions: [T1, R2], at: ground}, " : "", kind->name,
                        strchr(kind->chain, '=')   ? ", axis: [1, 2, 2], pitch: 0.1"
                        : strchr(kind->chain, 'b') ? ", axes: [[1, 2, 2], [0, 1, -1]]"
                        : kind->chain[0]           ? ", axis: [1, 2, 2]"
                                                   : "");
        kempe_model *model = read_text(text.s);
        kmp_text_free(&text);
        if (!model)
            return;
        CHECK(model->bodies[2].reversed == (k == 1));
        CHECK_TEXT(model->bodies[1].name, bodies[k]);
        for (int i = 0; i < model->motion_count; i++) {
            const char *name = model->motions[i].name;
            q[i] = name[0] == 'G' ? 0.3 : name[1] ? 0.2 + 0.3 * (name[2] - '0') : 0.7;
        }
        found[k] = between_points(model, q, "a", "b");
        kempe_model_free(model);
    }
    for (int i = 0; i < 12; i++)
        CHECK_NEAR((&found[1].r[0][0])[i], (&found[0].r[0][0])[i], 1e-14);
}

static void test_reversed(void)
{
    joint_kind kind;
    int count = 0;
    for (int k = 0; joint_kind_at(k, &kind); k++)
        if (strcmp(kind.name, "free") != 0) {
            check_reversed(&kind);
            count++;
        }
    CHECK(count == 8);
}

/* A screw that is counted from its second body advances as it does from its first. */
static void test_reversed_screw(void)
{
    double first[2][MOST_COLUMNS], last[2][MOST_COLUMNS];
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {P: [0, 0, 1]}}\n"
                        "bodies: {a: {mass: 2, com: [0.1, 0, 0.2], inertia: {xx: 0.1, yy: 0.1, zz: 0.15}, "
                        "points: {P: [0, 0.1, -0.3]}}}\n"
                        "joints: {J: {screw: [%s], pitch: 0.2}}\n"
                        "run: {outputs: [position(a.P), velocity(a.P), q(J.1), q(J.2), lambda(J)]}\n",
                        k ? "a.P, ground.P" : "ground.P, a.P");
        CHECK(run_text(text.s, NULL, 0.5, 1e-10, first[k], last[k]) == 9);
        kmp_text_free(&text);
    }
    for (int i = 0; i < 6; i++)
        CHECK_NEAR(last[1][i], last[0][i], 1e-9);
    CHECK_NEAR(last[1][6], -last[0][6], 1e-9);
    CHECK_NEAR(last[1][7], -last[0][7], 1e-9);
    CHECK(last[0][6] < -0.01);
}

/* -- the choice ---------------------------------------------------------------------------------------------- */

static void check_choice(const char *tail, const char *cut, const char *why)
{
    kempe_model *model = read_two(four_bar, tail);
    CHECK(model && model->cut_count == 1);
    if (model && model->cut_count == 1) {
        CHECK_TEXT(model->cuts[0].joint, cut);
        CHECK_TEXT(model->cuts[0].why, why);
        CHECK(model->cuts[0].rows == kmp_closure_kind_find(model->cuts[0].closure)->rows);
    }
    kempe_model_free(model);
}

#define HINGES                                                                                                         \
    "joints:\n  A: {revolute: [ground.O, crank.O]}\n  B: {revolute: [crank.B, coupler.O]}\n"                           \
    "  C: {revolute: [coupler.C, rocker.C]}\n"

static void test_choice(void)
{
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\n", "C",
                 "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nstart: {q: {C: 1}}\n", "B",
                 "it has no start value, unlike C; it is farther from the ground than A, D");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O]}\n", "D", "it has fewer rows than A, B, C");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O]}\nrun: {outputs: [lambda(A)]}\n", "A",
                 "output lambda(A) asks for what it transmits");
    check_choice(
        HINGES "  D: {spherical: [ground.D, rocker.O], cut: no}\nrun: {u: [C]}\n", "B",
        "it is farther from the ground than A; not to be cut: D (cut: no), C (it is asked for as independent)");
    check_choice(HINGES "  D: {screw: [ground.D, rocker.O], pitch: 1 mm}\nstart: {hold: [C]}\n"
                        "drives: {m: {joint: A, locked: yes}}\n",
                 "B",
                 "the others of its loop are not to be cut: A (drive 'm' moves it), D (a screw cannot be cut), C "
                 "(the start holds it)");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nrun: {outputs: [reaction(A)]}\n", "A",
                 "output reaction(A) asks for what it transmits");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O], cut: yes}\n", "D", "the model says so (cut: yes)");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O], cut: no}\nsensors: {s: 2*q( C )}\n"
                        "loops: {G: {couple: {B: 1, C: 2}}}\n",
                 "A",
                 "the others of its loop are not to be cut: D (cut: no), C (loop 'G' depends on it), B (loop 'G' "
                 "depends on it)");
}

/* Which rows of cuts.def say how many rows their closures have. */
static void test_rows(void)
{
    joint_kind kind;
    for (int k = 0; joint_kind_at(k, &kind); k++)
        if (kind.closure) {
            const kmp_closure_kind *closure = kmp_closure_kind_find(kind.closure);
            CHECK(closure && closure->rows == kind.rows);
            CHECK(6 - (int)strlen(kind.chain) / 2 == kind.rows);
        }
}

/* -- start values --------------------------------------------------------------------------------------------- */

static void hear(void *user, kempe_level level, const char *line)
{
    char *said = user;
    if (level == KEMPE_LOG_WARNING)
        snprintf(said, 256, "%s", line);
}

static void test_start_of_cut(void)
{
    char said[256] = "";
    kempe_context_set_log(context, hear, said);
    kempe_model *model = read_two(four_bar, HINGES "  D: {revolute: [ground.D, rocker.O]}\nstart: {q: {A: 1, B: 2, C: "
                                                   "3, D: 4}, qd: {C: 5}}\n");
    kempe_context_set_log(context, NULL, NULL);
    CHECK_TEXT(said, "joint 'C' is cut and has no coordinate: its start value is not used (cut: no keeps the joint)");
    CHECK(model && model->cut_count == 1 && model->cuts[0].start_unused);
    if (model)
        for (int k = 0; k < 3; k++)
            CHECK(model->start.q[k].value == (model->motions[k].name[0] - 'A' + 1));
    kempe_model_free(model);
}

/* -- joints in bodies beside joints between bodies ----------------------------------------------------------------- */

/* A body's own joint, with a frame, by which the body carries what it stands on when nothing else does. */
static void test_own_joint_turned(void)
{
    pose found[2];
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\nbodies:\n"
                        "  a: {%s points: {P: {at: [1, 2, 3], axes: {x: [1, 2, 0.5]}}}}\n"
                        "  b: {joint: {name: J, spherical: [1, 1, 0], at: a.P, to: P, frame: {y: [1, 2, 3]}}, "
                        "points: {P: {at: [-0.5, 1, 2], axes: {y: [1, -1, 2]}}, Q: [0, 0, 0]}}\n%s",
                        k ? "" : "joint: {name: G, weld: yes, at: ground}, ",
                        k ? "ground: {points: {O: [0, 0, 0]}}\njoints: {G: {weld: [ground.O, b.Q]}}\n" : "");
        kempe_model *model = read_text(text.s);
        kmp_text_free(&text);
        if (!model)
            return;
        double q[3];
        for (int i = 0; i < 3; i++)
            q[i] = 0.3 * (model->motions[i].name[2] - '0');
        CHECK(model->bodies[2].reversed == (k == 1));
        CHECK_TEXT(model->bodies[2].joint, "J");
        found[k] = between_points(model, q, "a", "b");
        kempe_model_free(model);
    }
    for (int i = 0; i < 12; i++)
        CHECK_NEAR((&found[1].r[0][0])[i], (&found[0].r[0][0])[i], 1e-14);
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

/* A loop that can never close, by the links that it has whatever their origins are. */
static void test_too_short(void)
{
    static const char text[] = "kempe: 1\nground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\nbodies:\n"
                               "  a: {mass: 1, inertia: {zz: 1}, points: {P: [10, 0, 0], Q: [10.5, 0, 0]}}\n"
                               "  b: {mass: 1, inertia: {zz: 1}, points: {P: [-7, 0, 0], Q: [-4, 0, 0]}}\n"
                               "  c: {mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0], Q: [1.25, 0, 0]}}\n"
                               "joints:\n  A: {revolute: [ground.O, a.P]}\n  B: {revolute: [a.Q, b.P]}\n"
                               "  C: {revolute: [b.Q, c.Q]}\n  D: {revolute: [ground.D, c.P]}\n";
    kempe_model *model = read_text(text);
    kempe_system *system = NULL;
    kempe_check *check = NULL;
    char *said = NULL;
    CHECK(model && kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(system && kempe_check_new(system, &check) != KEMPE_E_MEMORY);
    CHECK(check && kempe_check_print(check, KEMPE_TEXT, &said) == KEMPE_OK);
    CHECK(said && strstr(said, "joint C (revolute) is cut"));
    CHECK(said && strstr(said, "loop 'C' can never close: on 'b' it is 3 m from P to Q, the other links reach at most "
                               "1.75 m: 1.25 m are missing"));
    kempe_text_free(said);
    kempe_check_free(check);
    kempe_system_free(system);
    kempe_model_free(model);
}

/* Included graphs: names with prefixes, and their ground on a body. */
static void test_included(void)
{
    static const char *const joints[] = {"T", "l_A", "l_B", "r_A", "r_B"};
    kempe_model *model = read_file("tests/models/two_bars.yaml");
    if (!model)
        return;
    CHECK(model->body_count == 6 && model->cut_count == 2);
    for (int b = 1; b < model->body_count; b++)
        CHECK_TEXT(model->bodies[b].joint, joints[b - 1]);
    CHECK_TEXT(model->cuts[0].joint, "l_C");
    CHECK_TEXT(model->cuts[1].joint, "r_C");
    CHECK_TEXT(model->cuts[0].why, "it has fewer rows than l_A; not to be cut: l_B (force 'l_brake' acts on it)");
    CHECK_TEXT(model->cuts[1].why, "output reaction(r_C) asks for what it transmits");
    CHECK(model->bodies[2].reversed && !model->bodies[3].reversed);
    kempe_model_free(model);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_four_bar);
    TEST(test_spatial_slider_crank);
    TEST(test_stewart);
    TEST(test_double_wishbone);
    TEST(test_bennett);
    TEST(test_every_cut_of_the_four_bar);
    TEST(test_cuts_of_the_six_bar);
    TEST(test_random_graphs);
    TEST(test_choice_is_best);
    TEST(test_reversed);
    TEST(test_reversed_screw);
    TEST(test_choice);
    TEST(test_rows);
    TEST(test_start_of_cut);
    TEST(test_own_joint_turned);
    TEST(test_origins);
    TEST(test_axes_cost_nothing);
    TEST(test_too_short);
    TEST(test_included);
    kempe_context_free(context);
    return check_report();
}
