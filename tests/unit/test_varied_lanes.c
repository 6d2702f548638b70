/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 3 */
/* A motion with sensitivities at eight places at once (analyses/derivatives/varied_lanes.h) has the accelerations and
 * the matrices that it has at each of them alone: loops, redundant rows, moving closures, trees, events. Then the
 * derivatives of whole runs whose stages run in lanes, beside those of dop853, and of other methods of an integrator in
 * lanes. */
#include "analyses/derivatives/varied_lanes.h"
#include "constraints/closing/assemble.h"
#include "loaded.h"
#include "model/data/parameter.h"
#include "model/data/variant.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/sensitivity.h>

enum { W = KMP_STAGE_LANES, MOST = 64 };

typedef struct fixture {
    kempe_context *context;
    kempe_model *model;
    kmp_variant *variant;
    kempe_system *system;
    kmp_slopes *slopes;
    kmp_sensitivity_equations v;
    kmp_varied_lanes lanes;
    int count;
    const char *names[MOST];
} fixture;

/* `path`: of a file, or a text. */
static bool open_fixture(fixture *f, const char *path)
{
    char full[1024];
    *f = (fixture){.context = kempe_context_new()};
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    if (strchr(path, '\n'))
        CHECK(kempe_model_read_text(f->context, path, "model.yaml", &f->model) == KEMPE_OK);
    else
        CHECK(kempe_model_read(f->context, full, &f->model) == KEMPE_OK);
    for (int k = 0; k < kmp_model_parameter_count(f->model) && f->count < MOST; k++)
        if (!kmp_model_parameter(f->model, k)->number.expr && !kmp_model_parameter(f->model, k)->fixed)
            f->names[f->count++] = kmp_model_parameter(f->model, k)->name;
    CHECK(kmp_variant_new(f->model, f->count, f->names, &f->variant) == KEMPE_OK);
    CHECK(kempe_system_new(kmp_variant_model(f->variant), &f->system) == KEMPE_OK);
    CHECK(kmp_slopes_new(f->system, "native", f->count, f->names, false, &f->slopes) == KEMPE_OK);
    CHECK(kmp_sensitivity_equations_init(&f->v, f->system, "native", f->slopes) == KEMPE_OK);
    kmp_linear_derive(&f->v.linear);
    bool can = kmp_varied_lanes_can(&f->v);
    CHECK(can == kmp_varied_lanes_suit(f->system));
    CHECK(!can || kmp_varied_lanes_init(&f->lanes, &f->v) == KEMPE_OK);
    return can;
}

static void close_fixture(fixture *f)
{
    kmp_varied_lanes_free(&f->lanes);
    kmp_sensitivity_equations_free(&f->v);
    kmp_slopes_free(f->slopes);
    kempe_system_free(f->system);
    kmp_variant_free(f->variant);
    kempe_model_free(f->model);
    kempe_context_free(f->context);
}

/* The largest difference over the largest number. */
static double off(int count, const double *lanes, int lane, const double *alone)
{
    double worst = 0, size = 1e-12;
    for (int k = 0; k < count; k++) {
        size = check_max(size, fabs(alone[k]));
        worst = check_max(worst, fabs(lanes[k * W + lane] - alone[k]));
    }
    return worst / size;
}

/* udd, and the matrices column by column, of a lane. By parts sweeps have the error with which they close. */
static void compare_lane(fixture *f, bool once, double t, const double *u, const double *ud, int lane,
                         const double *udd, const double *a, const double *b)
{
    const double small = once || f->lanes.fused.program ? 1e-9 : 1e-5;
    static double matrix[2 * MOST * MOST], by[MOST * MOST], zero[MOST];
    kmp_sensitivity_equations *v = &f->v;
    int p = v->linear.p;
    double own[MOST];
    CHECK(kmp_sensitivity_equations_at(v, t, u, ud) == KMP_GO);
    for (int k = 0; k < p; k++)
        own[k] = v->linear.qdd[v->linear.part.u[k]];
    CHECK(off(p, udd, lane, own) < small);
    kmp_sensitivity_equations_matrix(v, matrix);
    CHECK(off(2 * p * p, a, lane, matrix) < small);
    for (int k = 0; k < f->count; k++)
        kmp_sensitivity_equations_accelerate(v, k, zero, zero, by + k * p);
    CHECK(off(p * f->count, b, lane, by) < small);
}

/* The largest difference of all numbers over the largest number, or 1. */
static double differ(int count, const double *x, const double *y)
{
    double worst = 0, size = 1;
    for (int k = 0; k < count; k++) {
        size = check_max(size, fabs(y[k]));
        worst = check_max(worst, fabs(x[k] - y[k]));
    }
    return worst / size;
}

/* Predictions begin at the last lane as at the same state alone. */
static void compare_anchors(fixture *f, double t, const double *u, const double *ud)
{
    kmp_sensitivity_equations *v = &f->v;
    const int n = v->n, p = v->linear.p, last = W - 1;
    double own[MOST], rate[MOST], q[MOST];
    CHECK(kmp_varied_lanes_last(&f->lanes, t, q) && !kmp_varied_lanes_last(&f->lanes, t + 1, q));
    for (int k = 0; k < p; k++) {
        own[k] = u[k * W + last];
        rate[k] = ud[k * W + last];
    }
    kmp_varied_lanes_anchor(&f->lanes, last);
    CHECK(kmp_sensitivity_equations_at(v, t, own, rate) == KMP_GO);
    CHECK(differ(n, q, v->linear.q) < 1e-9);
    kmp_sensitivity_equations_anchor(v);
    CHECK(differ(n, v->anchor[1].q, v->anchor[0].q) < 1e-9);
    CHECK(differ(n * (2 + p), v->anchor[1].drift, v->anchor[0].drift) < 1e-5);
}

/* `entries`: below the diagonal of the factor of the reduced mass; 0: any. Places around the start, each at a time, a
 * position and rates of its own; then nearby, at the same times. Closed to round-off, by parts, or as sweeps are, by
 * the program where there is one. */
static void compare(const char *path, bool once, long entries)
{
    fixture f;
    kempe_assembly *start = NULL;
    static double u[W * MOST], ud[W * MOST], udd[W * MOST], a[W * 2 * MOST * MOST], b[W * MOST * MOST];
    if (!open_fixture(&f, path)) {
        close_fixture(&f);
        return;
    }
    kmp_sensitivity_equations *v = &f.v;
    CHECK(kempe_assembly_new(f.system, &start) == KEMPE_OK);
    CHECK(kmp_sensitivity_equations_choose(v, 0, start->q, start->qd, NULL, 0) == KEMPE_OK);
    kmp_varied_lanes_begin(&f.lanes);
    const kmp_partition *part = &v->linear.part;
    for (int pass = 0; pass < 2; pass++) {
        double t[W];
        for (int l = 0; l < W; l++)
            t[l] = 1e-3 * l;
        for (int k = 0; k < part->p; k++)
            for (int l = 0; l < W; l++) {
                double scale = f.system->scale[part->u[k]];
                u[k * W + l] = start->q[part->u[k]] + scale * (0.002 * l * cos(k + l) + 1e-4 * pass);
                ud[k * W + l] = start->qd[part->u[k]] + scale * 0.1 * sin(3 * k + l + pass);
            }
        CHECK(kmp_varied_lanes_run(&f.lanes, once, t, u, ud, udd) == KMP_GO);
        CHECK(once || f.lanes.whole == !f.lanes.fused.program);
        compare_anchors(&f, t[W - 1], u, ud);
        CHECK(kmp_varied_lanes_matrices(&f.lanes, a, b) == KMP_GO);
        CHECK(differ(W * part->p, udd, f.lanes.udd) < (once ? 1e-9 : 1e-5));
        CHECK(entries == 0 || (f.lanes.red.mass_start && f.lanes.red.mass_start[part->p] == entries));
        memcpy(udd, f.lanes.udd, (size_t)(W * part->p) * sizeof *udd);
        for (int l = 0; l < W; l++) {
            double one[MOST], rate[MOST];
            for (int k = 0; k < part->p; k++) {
                one[k] = u[k * W + l];
                rate[k] = ud[k * W + l];
            }
            compare_lane(&f, once, t[l], one, rate, l, udd, a, b);
        }
    }
    kempe_assembly_free(start);
    close_fixture(&f);
}

static void places(void)
{
    static const char *const paths[] = {
        "examples/four_bar/four_bar.yaml",       "examples/parallel_robot/parallel_robot.yaml",
        "examples/stewart/stewart.yaml",         "examples/suspension/suspension.yaml",
        "examples/governor/governor.yaml",       "examples/slider_crank/slider_crank.yaml",
        "examples/andrews/andrews.yaml",         "examples/double_wishbone/double_wishbone.yaml",
        "examples/delta_robot/delta_robot.yaml", "examples/driven_slider_crank/driven_slider_crank.yaml",
    };
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        printf("  %s\n", paths[k]);
        compare(paths[k], true, 0);
        compare(paths[k], false, 0);
    }
}

/* Pendulums beside each other, two of them double, one with others between its bodies: the factor of the mass has no
 * entries between them. */
static void parts_share_no_inertia(void)
{
    compare("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {m: 2}\nbodies:\n"
            "  f: {joint: {name: f, revolute: z, at: ground}, mass: m, inertia: {zz: 0.1}, points: {P: [1, 0, 0]}}\n"
            "  a: {joint: {name: a, revolute: z, at: ground}, mass: m, inertia: {zz: 0.1}, com: [0.5, 0, 0]}\n"
            "  b: {joint: {name: b, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, com: [0.5, 0, 0], points: "
            "{P: [1, 0, 0]}}\n"
            "  c: {joint: {name: c, revolute: z, at: b.P}, mass: m, inertia: {zz: 0.1}, com: [0.5, 0, 0]}\n"
            "  d: {joint: {name: d, revolute: z, at: ground}, mass: m, inertia: {zz: 0.1}, com: [0.5, 0, 0]}\n"
            "  e: {joint: {name: e, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, com: [0.4, 0, 0]}\n"
            "  g: {joint: {name: g, revolute: z, at: f.P}, mass: m, inertia: {zz: 0.1}, com: [0.5, 0, 0]}\n"
            "start: {q: {f: 1, g: 0.2, a: 0.3, b: 0.4, c: 0.7, d: 1, e: 2}}\n",
            true, 2);
}

/* -- runs ------------------------------------------------------------------------------------------------ */

static kempe_table *run_by(kempe_model *model, const char *integrator, const char *method, const char *outputs)
{
    kempe_run_options run = {.t_end = 0.5, .output_step = 0.5, .rtol = 1e-10, .integrator = integrator};
    kempe_sensitivity_options options = {.outputs = outputs, .method = method, .run = &run};
    kempe_sensitivity *s = NULL;
    kempe_table *table = NULL;
    run.no_convergence_check = 1;
    CHECK(kempe_sensitivity_new(model, &options, &s) == KEMPE_OK);
    CHECK(s && kempe_sensitivity_table(s, "rows", &table) == KEMPE_OK);
    kempe_sensitivity_free(s);
    return table;
}

/* The last rows agree. */
static void same_ends(const kempe_table *a, const kempe_table *b)
{
    CHECK(a && b && kempe_table_column_count(a) == kempe_table_column_count(b));
    int row_a = a ? kempe_table_row_count(a) - 1 : 0, row_b = b ? kempe_table_row_count(b) - 1 : 0;
    for (int c = 0; a && b && c < kempe_table_column_count(a); c++) {
        double x = kempe_table_number(a, row_a, c), y = kempe_table_number(b, row_b, c);
        CHECK(fabs(x - y) <= 1e-6 * (1 + fabs(y)));
    }
}

static void runs(void)
{
    static const char *const paths[] = {"examples/four_bar/four_bar.yaml", "examples/suspension/suspension.yaml",
                                        "examples/parallel_robot/parallel_robot.yaml"};
    static const char *const outputs[] = {"q(rocker)", "q(z)", "q(p)"};
    static const char *const integrators[] = {NULL, "radau", "radau9", "radau5"};
    for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
        loaded l = load(paths[k]);
        kempe_table *by_dop853 = run_by(l.model, "dop853", "forward", outputs[k]);
        for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
            kempe_table *forward = run_by(l.model, integrators[i], "forward", outputs[k]);
            kempe_table *adjoint = run_by(l.model, integrators[i], "adjoint", outputs[k]);
            same_ends(forward, by_dop853);
            same_ends(adjoint, by_dop853);
            kempe_table_free(forward);
            kempe_table_free(adjoint);
        }
        kempe_table_free(by_dop853);
        unload(&l);
    }
}

int main(void)
{
    TEST(places);
    TEST(parts_share_no_inertia);
    TEST(runs);
    return check_report();
}
