/* SPDX-License-Identifier: BSD-3-Clause */
/* State spaces: A against the Jacobian that integrators use, B, C and D against differences whose error falls with the
 * square of the step, the properties of K and G that mechanics gives them, the linear motion against the nonlinear one.
 */
#include "analyses/linearize/channels.h"
#include "analyses/linearize/linearize_study.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/formulations/reduced_jacobian.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/linearize.h>
#include <kempe/settings.h>

enum { MOST = 128 };

/* -- A ----------------------------------------------------------------------------------------------- */

/* d(ud, udd)/d(u, ud) by the implicit-function theorem on the closed reduced system. */
static bool jacobian(const kempe_linearization *l, double *j)
{
    const kmp_linear *from = &l->channels.linear;
    kmp_evaluator *eval = kmp_eval_new(from->system, "tape");
    kmp_reduction red;
    kmp_reduced_jacobian jac;
    double udd[MOST];
    bool ok = eval && kmp_reduction_init(&red, eval, &from->part) == KEMPE_OK &&
              kmp_reduced_jacobian_init(&jac, &red) == KEMPE_OK;
    if (!ok)
        return false;
    if (from->eval->system->chart_count)
        kmp_eval_set_charts(eval, from->eval->chart);
    kmp_eval_freeze(eval, 0, from->q, from->qd);
    kmp_eval_closure(eval, 0, from->q);
    ok = kmp_reduction_factor(&red) == 0;
    kmp_reduction_tangent(&red);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, from->qd);
    ok = ok && kmp_reduction_accelerate(&red, udd) == 0;
    kmp_reduced_jacobian_eval(&jac, 0, from->q, from->qd, udd, 2 * from->p, j);
    kmp_reduced_jacobian_free(&jac);
    kmp_reduction_free(&red);
    kmp_eval_free(eval);
    return ok;
}

static double largest(int count, const double *x)
{
    double most = 0;
    for (int k = 0; k < count; k++)
        most = check_max(most, fabs(x[k]));
    return most;
}

static void a_is_the_jacobian_of_the_reduced_formulation(void)
{
    /* on rails: forces of multipliers, with which Mr is not symmetric */
    const char *const examples[] = {"four_bar/four_bar",
                                    "stephenson/stephenson",
                                    "andrews/andrews",
                                    "governor/governor",
                                    "stewart/stewart",
                                    "suspension/suspension",
                                    "bogie_track/bogie_on_rails",
                                    "restrained_wheelset/wheelset_on_rails"};
    static double j[MOST * MOST];
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++) {
        char path[128];
        (void)snprintf(path, sizeof path, "examples/%s.yaml", examples[k]);
        loaded m = load(path);
        kempe_linearization *l = NULL;
        CHECK(kempe_linearization_new(m.system, &(kempe_linearize_options){.at = "start"}, &l) == KEMPE_OK);
        int rows, columns;
        const double *a = kempe_linearization_matrix(l, KEMPE_MATRIX_A, &rows, &columns);
        CHECK(rows == columns && rows <= MOST);
        memset(j, 0, sizeof j);
        CHECK(jacobian(l, j));
        double worst = 0, size = largest(rows * columns, a);
        for (int e = 0; e < rows * columns; e++)
            worst = check_max(worst, fabs(a[e] - j[e]));
        CHECK(size > 1 && worst <= 1e-12 * size);
        kempe_linearization_free(l);
        unload(&m);
    }
}

/* -- B, C and D -------------------------------------------------------------------------------------- */

/* A slider-crank on a driven base with a pendulum on its slider: every input is a parameter as well. In the second one
 * the loads are inputs of the model. */
#define MACHINE(loads, way)                                                                                            \
    "kempe: 1\n"                                                                                                       \
    "name: machine\n"                                                                                                  \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "parameters: {" loads "k: 300, sway: 0.05, a0: 1.1, p0: 0.4, ad: 3, pd: -2}\n"                                     \
    "ground: {points: {O: [0, 0, 0], S: [0, 0, 0]}}\n"                                                                 \
    "bodies:\n"                                                                                                        \
    "  lift: {joint: {prismatic: y, at: ground.O}, mass: 2, points: {A: [0, 0, 0]}}\n"                                 \
    "  crank: {joint: {revolute: z, at: lift.A}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.01}, "                    \
    "points: {B: [0.3, 0, 0]}}\n"                                                                                      \
    "  rod: {joint: {revolute: z, at: crank.B}, mass: 1.5, com: [0.4, 0.02, 0], inertia: {zz: 0.06}, "                 \
    "points: {C: [0.8, 0, 0], E: [0.4, 0.1, 0]}}\n"                                                                    \
    "  slider: {joint: {prismatic: x, at: ground.S}, mass: 3, points: {C: [0, 0, 0]}}\n"                               \
    "  pend: {joint: {revolute: z, at: slider.C}, mass: 0.5, com: [0, -0.2, 0], inertia: {zz: 0.003}, "                \
    "points: {P: [0, -0.4, 0]}}\n"                                                                                     \
    "loops: {C: {ball: [rod.C, slider.C]}}\n"                                                                          \
    "drives: {lift: {joint: lift, displacement: \"sway*sin(3*t) + " way "\"}}\n"                                       \
    "forces:\n"                                                                                                        \
    "  spring: {joint: slider, spring: {stiffness: k, damping: 4, rest: 0.8}}\n"                                       \
    "  torque: {joint: crank, torque: \"tau - 0.1*qd(crank)\"}\n"                                                      \
    "  pull: {at: rod.E, force: [fx, fy, 0]}\n"                                                                        \
    "sensors: {s: \"k*q(slider)^2 + qd(pend)*q(crank)\"}\n"                                                            \
    "start: {q: {crank: a0, rod: -1.4, slider: 0.8, pend: p0, lift: 0}, qd: {crank: ad, pend: pd}, "                   \
    "hold: [crank, pend]}\n"                                                                                           \
    "run: {independent: [crank, pend], outputs: [q, qdd, lambda, position(rod.E), velocity(pend.P), "                  \
    "acceleration(pend.P), "                                                                                           \
    "reaction(C), force(spring), s]}\n"

static const char *const machine = MACHINE("tau: 0, fx: 0, fy: 0, w0: 0, w1: 0, w2: 0, ", "w0 + w1*t + w2*t^2/2");
static const char *const given_machine =
    MACHINE("", "way") "inputs: {tau: {unit: N*m}, fx: {unit: N}, fy: {unit: N}, way: {unit: mm}}\n";

static const char *const inputs = "effort(crank),force(rod.E.x),force(rod.E.y),drive(lift),k";
static const char *const names[] = {"tau", "fx", "fy", "w0", "w1", "w2", "k"};
static const double sizes[] = {10, 10, 10, 0.1, 1, 10, 300};

enum { INPUTS = 7, STATES = 4 };

/* The nonlinear machine: (udd, y) at (u, ud) and inputs. */
typedef struct nonlinear {
    kmp_variant *variant;
    kempe_system *system;
    kmp_linear linear;
    int outputs;
} nonlinear;

static bool nonlinear_init(nonlinear *f, const kempe_model *model, const double *q)
{
    int wish[] = {1, 4};
    return kmp_variant_new(model, INPUTS, names, &f->variant) == KEMPE_OK &&
           kempe_system_new(kmp_variant_model(f->variant), &f->system) == KEMPE_OK &&
           kmp_linear_init(&f->linear, f->system, "tape") == KEMPE_OK &&
           kmp_linear_choose(&f->linear, 0, q, wish, 2) == KEMPE_OK;
}

/* Values in the order of the outputs of the model. */
static int evaluate(nonlinear *f, const double *q, const double *x, const double *w, double *out)
{
    kmp_text why = {0};
    double start[MOST];
    kmp_linear *l = &f->linear;
    memcpy(start, q, (size_t)l->n * sizeof *q);
    start[1] = x[0];
    start[4] = x[1];
    CHECK(kmp_variant_set(f->variant, w, &why) == KEMPE_OK && kmp_system_rescale(f->system));
    kmp_linear_renew_parameters(l);
    CHECK(kmp_linear_at_motion(l, 0, start, x + 2) == KEMPE_OK);
    int at = 0;
    out[at++] = l->qdd[1];
    out[at++] = l->qdd[4];
    for (int k = 0; k < l->n; k++)
        out[at++] = l->q[k];
    for (int k = 0; k < l->n; k++)
        out[at++] = l->qdd[k];
    for (int k = 0; k < l->m; k++)
        out[at++] = l->lambda[k];
    const double *shown = kmp_eval_shown(l->eval, 0, l->q, l->qd, l->qdd, l->lambda);
    for (int k = 0; k < 3 * 4 + 2; k++)
        out[at++] = shown[k];
    return at;
}

/* Columns of [A B; C D], the accelerations' rows first, by central differences. */
static int differences(nonlinear *f, const double *q, const double *x, double step, double *table)
{
    int rows = 0;
    for (int c = 0; c < STATES + INPUTS; c++) {
        double plus[MOST], minus[MOST], xs[2][STATES], ws[2][INPUTS], h = step * (c < STATES ? 1 : sizes[c - STATES]);
        for (int side = 0; side < 2; side++) {
            memcpy(xs[side], x, sizeof xs[side]);
            memset(ws[side], 0, sizeof ws[side]);
            ws[side][6] = 300;
            *(c < STATES ? &xs[side][c] : &ws[side][c - STATES]) += side ? -h : h;
        }
        rows = evaluate(f, q, xs[0], ws[0], plus);
        (void)evaluate(f, q, xs[1], ws[1], minus);
        for (int i = 0; i < rows; i++)
            table[i + c * rows] = (plus[i] - minus[i]) / (2 * h);
    }
    return rows;
}

static void exact(const kempe_linearization *l, int rows, double *table)
{
    int states, outputs, columns;
    const double *a = kempe_linearization_matrix(l, KEMPE_MATRIX_A, &states, &columns);
    const double *b = kempe_linearization_matrix(l, KEMPE_MATRIX_B, &states, &columns);
    const double *c = kempe_linearization_matrix(l, KEMPE_MATRIX_C, &outputs, &columns);
    const double *d = kempe_linearization_matrix(l, KEMPE_MATRIX_D, &outputs, &columns);
    CHECK(states == STATES && columns == INPUTS && outputs + 2 == rows);
    for (int k = 0; k < STATES + INPUTS; k++)
        for (int i = 0; i < rows; i++) {
            const double *top = k < STATES ? a + k * STATES : b + (k - STATES) * STATES;
            const double *low = k < STATES ? c + k * outputs : d + (k - STATES) * outputs;
            table[i + k * rows] = i < 2 ? top[2 + i] : low[i - 2];
        }
}

/* The largest difference of two tables, each row by the largest of its entries. */
static double apart(int rows, const double *a, const double *b)
{
    double worst = 0;
    for (int i = 0; i < rows; i++)
        for (int part = 0; part < 2; part++) {
            double size = 1, off = 0;
            for (int k = part ? STATES : 0; k < (part ? STATES + INPUTS : STATES); k++) {
                double unit = k < STATES ? 1 : sizes[k - STATES];
                size = check_max(size, fabs(b[i + k * rows]) * unit);
                off = check_max(off, fabs(a[i + k * rows] - b[i + k * rows]) * unit);
            }
            worst = check_max(worst, off / size);
        }
    return worst;
}

static void all_four_are_derivatives(void)
{
    loaded m = load_text(machine);
    kempe_linearization *l = NULL;
    static double coarse[MOST * MOST], fine[MOST * MOST], table[MOST * MOST];
    CHECK(kempe_linearization_new(
              m.system, &(kempe_linearize_options){.at = "start", .inputs = inputs, .independent = "crank,pend"}, &l) ==
          KEMPE_OK);
    CHECK(kempe_linearization_is_equilibrium(l) == 0);
    const double *q = kempe_linearization_q(l), *qd = kempe_linearization_qd(l);
    double x[] = {q[1], q[4], qd[1], qd[4]};
    CHECK_NEAR(qd[1], 3, 1e-14);
    CHECK_NEAR(qd[0], 0.15, 1e-14); /* the base sways */
    nonlinear f;
    CHECK(nonlinear_init(&f, m.model, q));
    int rows = differences(&f, q, x, 8e-3, coarse);
    exact(l, rows, table);
    double far = apart(rows, coarse, table);
    (void)differences(&f, q, x, 2e-3, fine);
    double near = apart(rows, fine, table), slope = log(far / near) / log(4);
    CHECK(far > 1e-6 && slope > 1.95 && slope < 2.05);
    for (int k = 0; k < rows * (STATES + INPUTS); k++) /* extrapolated: fourth order */
        fine[k] += (fine[k] - coarse[k]) / 15;
    CHECK(apart(rows, fine, table) < 1e-7);
    (void)differences(&f, q, x, 1e-5, fine);
    CHECK(apart(rows, fine, table) < 1e-8);
    kmp_linear_free(&f.linear);
    kempe_system_free(f.system);
    kmp_variant_free(f.variant);
    kempe_linearization_free(l);
    unload(&m);
}

static bool same_matrices(const kempe_linearization *a, const kempe_linearization *b)
{
    static const kempe_matrix which[] = {KEMPE_MATRIX_A, KEMPE_MATRIX_B, KEMPE_MATRIX_C, KEMPE_MATRIX_D};
    double worst = 0;
    for (int k = 0; k < 4; k++) {
        int rows[2], columns[2];
        const double *x = kempe_linearization_matrix(a, which[k], &rows[0], &columns[0]);
        const double *y = kempe_linearization_matrix(b, which[k], &rows[1], &columns[1]);
        CHECK(rows[0] == rows[1] && columns[0] == columns[1]);
        double size = largest(rows[0] * columns[0], x);
        for (int e = 0; e < rows[0] * columns[0]; e++)
            worst = check_max(worst, fabs(x[e] - y[e]) / size);
    }
    return worst < 1e-14;
}

/* A torque, a force and a drive's function by inputs of the model act as those that the study knows. */
static void inputs_of_the_model_are_loads(void)
{
    loaded m = load_text(machine), given = load_text(given_machine);
    kempe_linearization *a = NULL, *b = NULL;
    kempe_linearize_options options = {.at = "start", .inputs = inputs, .independent = "crank,pend"};
    CHECK(kempe_linearization_new(m.system, &options, &a) == KEMPE_OK);
    options.inputs = "tau,fx,fy,way,k";
    CHECK(kempe_linearization_new(given.system, &options, &b) == KEMPE_OK);
    CHECK(a && b && same_matrices(a, b));
    CHECK_TEXT(b->channels.loads.name[5], "way.dd");
    CHECK_TEXT(b->channels.loads.unit[0], "N m"); /* as results show the unit of the input */
    CHECK_TEXT(b->channels.loads.unit[4], "m/s");
    kempe_linearization_free(a);
    kempe_linearization_free(b);
    unload(&m);
    unload(&given);
}

/* -- K and G ----------------------------------------------------------------------------------------- */

static double skewness(int p, const double *x, double sign)
{
    double worst = 0;
    for (int i = 0; i < p; i++)
        for (int k = 0; k < p; k++)
            worst = check_max(worst, fabs(x[i + k * p] + sign * x[k + i * p]));
    return worst / largest(p * p, x);
}

static void k_is_symmetric_for_conservative_forces(void)
{
    loaded m = load("examples/suspension/suspension.yaml");
    kempe_linearization *l = NULL;
    int p, columns;
    CHECK(kempe_linearization_new(m.system, &(kempe_linearize_options){.at = "equilibrium left_wheel=0"}, &l) ==
          KEMPE_OK);
    CHECK(kempe_linearization_is_equilibrium(l) == 1);
    CHECK(skewness(15, kempe_linearization_matrix(l, KEMPE_MATRIX_K, &p, &columns), -1) < 1e-12 && p == 15);
    CHECK(skewness(15, kempe_linearization_matrix(l, KEMPE_MATRIX_G, &p, &columns), -1) < 1e-12); /* dampers alone */
    kempe_linearization_free(l);
    unload(&m);
}

/* A rotor in gimbals: outer about x, inner about y, spin about z. With J the axial moment and s the spin, the pair of
 * gimbals is coupled by J s cos(inner), with opposite signs; all else of G is zero while the gimbals stand still. */
static void the_gyroscopic_part_of_g_is_skew(void)
{
    loaded m = load_text("kempe: 1\n"
                         "ground: {points: {O: [0, 0, 0]}}\n"
                         "bodies:\n"
                         "  outer: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: "
                         "0.04}, points: {O: [0, 0, 0]}}\n"
                         "  inner: {joint: {revolute: y, at: outer.O}, mass: 1, inertia: {xx: 0.01, yy: 0.02, zz: "
                         "0.02}, points: {O: [0, 0, 0]}}\n"
                         "  rotor: {joint: {revolute: z, at: inner.O}, mass: 2, inertia: {xx: 0.03, yy: 0.03, zz: "
                         "0.05}}\n"
                         "start: {q: {inner: 0.4}, qd: {rotor: 100}}\n");
    kempe_linearization *l = NULL;
    int p, columns;
    CHECK(kempe_linearization_new(m.system, &(kempe_linearize_options){.at = "start"}, &l) == KEMPE_OK);
    const double *g = kempe_linearization_matrix(l, KEMPE_MATRIX_G, &p, &columns);
    CHECK(p == 3);
    CHECK_NEAR(fabs(g[0 + 1 * 3]), 0.05 * 100 * cos(0.4), 1e-13);
    CHECK(skewness(3, g, 1) < 1e-14);
    CHECK(kempe_linearization_is_equilibrium(l) == 1); /* the rotor goes on, and no force changes */
    kempe_linearization_free(l);
    unload(&m);
}

/* -- the motion -------------------------------------------------------------------------------------- */

static void product(int n, const double *a, const double *b, double *c)
{
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            c[i + j * n] = 0;
            for (int k = 0; k < n; k++)
                c[i + j * n] += a[i + k * n] * b[k + j * n];
        }
}

/* x = exp(A t) x by squaring. */
static void exponential(const double *a, double t, double *x)
{
    enum { N = STATES, HALVINGS = 12, TERMS = 14 };
    double e[N * N] = {0}, term[N * N] = {0}, s[N * N], next[N * N];
    for (int k = 0; k < N * N; k++)
        s[k] = a[k] * t / (1 << HALVINGS);
    for (int k = 0; k < N; k++)
        e[k + k * N] = term[k + k * N] = 1;
    for (int j = 1; j <= TERMS; j++) {
        product(N, term, s, next);
        for (int k = 0; k < N * N; k++)
            e[k] += term[k] = next[k] / j;
    }
    for (int j = 0; j < HALVINGS; j++) {
        product(N, e, e, next);
        memcpy(e, next, sizeof e);
    }
    for (int i = 0; i < N; i++) {
        next[i] = 0;
        for (int k = 0; k < N; k++)
            next[i] += e[i + k * N] * x[k];
    }
    memcpy(x, next, N * sizeof *x);
}

/* Largest error of the linear motion after a second, from the equilibrium with all of x moved by eps. */
static double linear_error(const double *q, const double *a, double eps)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    char value[4][40];
    double x[] = {eps, -eps, 2 * eps, eps}, worst = 0;
    (void)snprintf(value[0], 40, "%.17g", q[1] + x[0]);
    (void)snprintf(value[1], 40, "%.17g", q[4] + x[1]);
    (void)snprintf(value[2], 40, "%.17g", x[2]);
    (void)snprintf(value[3], 40, "%.17g", x[3]);
    const kempe_setting set[] = {{"a0", value[0]}, {"p0", value[1]}, {"ad", value[2]}, {"pd", value[3]}, {"sway", "0"}};
    run.t_end = run.output_step = 1;
    run.rtol = 1e-12;
    run.no_convergence_check = 1;
    CHECK(kempe_model_read_text_set(context, machine, "machine", set, 5, &model) == KEMPE_OK &&
          kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK);
    exponential(a, 1, x);
    const double *end = t ? kempe_trajectory_q(t, 1) : q, *rate = t ? kempe_trajectory_qd(t, 1) : q;
    worst = fmax(fabs(end[1] - q[1] - x[0]), fabs(end[4] - q[4] - x[1]));
    worst = check_max(worst, fmax(fabs(rate[1] - x[2]), fabs(rate[4] - x[3])));
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return worst;
}

static void the_linear_motion_is_the_motion_but_for_squares(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_linearization *l = NULL;
    const kempe_setting set[] = {{"sway", "0"}, {"ad", "0"}, {"pd", "0"}};
    int rows, columns;
    CHECK(kempe_model_read_text_set(context, machine, "machine", set, 3, &model) == KEMPE_OK &&
          kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_linearization_new(system, &(kempe_linearize_options){.independent = "crank,pend"}, &l) == KEMPE_OK);
    if (!l)
        printf("%s\n", kempe_context_message(context));
    const double *a = kempe_linearization_matrix(l, KEMPE_MATRIX_A, &rows, &columns);
    const double *q = kempe_linearization_q(l);
    double first = linear_error(q, a, 4e-3), second = linear_error(q, a, 2e-3), third = linear_error(q, a, 1e-3);
    CHECK(first > 1e-7 && first < 1e-2);
    CHECK(first / second > 3.7 && first / second < 4.3);
    CHECK(second / third > 3.8 && second / third < 4.2);
    kempe_linearization_free(l);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(a_is_the_jacobian_of_the_reduced_formulation);
    TEST(all_four_are_derivatives);
    TEST(inputs_of_the_model_are_loads);
    TEST(k_is_symmetric_for_conservative_forces);
    TEST(the_gyroscopic_part_of_g_is_skew);
    TEST(the_linear_motion_is_the_motion_but_for_squares);
    return check_report();
}
