/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Inputs of models: samples held, joined by lines or by a spline act at their times, on every formulation and
 * integrator; drives and conditions follow them; what cannot be followed is refused. */
#include "base/text.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "studies/simulate/trajectory.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <kempe/table.h>

/* Values after t = 0, 0.7, 1.3, 2.1 s: times that are no multiples of each other. */
#define WHEEL                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "inputs:\n"                                                                                                        \
    "  u: {default: 0, unit: kN*m, t: [0, 0.7, 1.3, 2.1], value: [0, 2e-3, -1e-3, 0.5e-3], method: %s}\n"              \
    "bodies:\n"                                                                                                        \
    "  wheel: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"                                \
    "forces: {motor: {joint: A, torque: %s}}\n"
#define RUN "run: {t_end: 3, output_step: 0.25, rtol: 1e-9}\n"

static const double knot[4] = {0, 0.7, 1.3, 2.1}, value[4] = {0, 2, -1, 0.5};

static double held(double t)
{
    double sum = 0;
    for (int k = 0; k < 4; k++)
        sum += value[k] * fmax(fmin(t, k < 3 ? knot[k + 1] : INFINITY) - knot[k], 0);
    return sum;
}

static double joined(double t)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double h = knot[k + 1] - knot[k], s = fmin(fmax(t - knot[k], 0), h);
        sum += s * (value[k] + 0.5 * s * (value[k + 1] - value[k]) / h);
    }
    return sum + value[3] * fmax(t - knot[3], 0);
}

/* The cubic through four samples is one polynomial: Lagrange's form, integrated by Simpson's rule, which is exact. */
static double lagrange(double t)
{
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        double term = value[k];
        for (int j = 0; j < 4; j++)
            term *= j == k ? 1 : (t - knot[j]) / (knot[k] - knot[j]);
        sum += term;
    }
    return sum;
}

static double splined(double t)
{
    double end = fmin(t, knot[3]);
    return end / 6 * (lagrange(0) + 4 * lagrange(end / 2) + lagrange(end)) + value[3] * fmax(t - knot[3], 0);
}

static double if_above(double t)
{
    return fmax(fmin(t, 1.3) - 0.7, 0);
}

/* The largest error of qd over the rows of one run; NaN when it fails. */
static double error_of(const kempe_system *system, const kmp_method *method, double (*rate)(double t))
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {.formulation = method->formulation,
                             .form = method->form,
                             .integrator = method->integrator,
                             .no_convergence_check = 1};
    double error = kempe_simulate(system, &run, &trajectory) == KEMPE_OK ? 0 : NAN;
    for (int k = 0; k < kempe_trajectory_row_count(trajectory); k++) {
        double t = kempe_trajectory_time(trajectory, k);
        error = check_max(error, fabs(kempe_trajectory_qd(trajectory, k)[0] - rate(t)));
    }
    kempe_trajectory_free(trajectory);
    return error;
}

/* Every method; the errors of multistep methods add up over their restarts. */
static void everywhere(const char *text, double (*rate)(double t))
{
    loaded l = load_text(text);
    kmp_method method;
    int count = 0;
    double worst = 0;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
        double error = error_of(l.system, &method, rate);
        worst = check_max(worst, error);
        if (!(error < 1e-7))
            printf("  %s %s %s: error %.2g\n", method.formulation, method.form ? method.form : "", method.integrator,
                   error);
        CHECK(error < 1e-7);
    }
    printf("  %d methods, largest error %.2g\n", count, worst);
    CHECK(count > 20);
    unload(&l);
}

static void check_wheel(const char *method, const char *torque, double (*rate)(double t))
{
    char text[1024];
    (void)snprintf(text, sizeof text, WHEEL RUN, method, torque);
    everywhere(text, rate);
}

static void hold(void)
{
    check_wheel("hold", "u", held);
}

static void linear(void)
{
    check_wheel("linear", "u", joined);
}

static void cubic(void)
{
    check_wheel("cubic", "u", splined);
}

/* The work of a torque is the kinetic energy: the motion follows the input exactly in large steps, which integrate the
 * power nevertheless. */
static void work_of_inputs(void)
{
    char text[1024];
    kmp_method method;
    (void)snprintf(text, sizeof text, WHEEL RUN, "linear", "u");
    loaded l = load_text(text);
    for (int k = 0; l.system && kmp_method_get(k, &method); k++) {
        kempe_trajectory *run = NULL;
        kempe_run_options options = {.formulation = method.formulation,
                                     .form = method.form,
                                     .integrator = method.integrator,
                                     .no_convergence_check = 1};
        CHECK(kempe_simulate(l.system, &options, &run) == KEMPE_OK);
        CHECK(run && run->verdict.drift_rel < 1e-3);
        if (run && !(run->verdict.drift_rel < 1e-3))
            printf("  %s %s %s: energy %.2g\n", method.formulation, method.form ? method.form : "", method.integrator,
                   run->verdict.drift_rel);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* The integral of sin(7 t) in straight lines between times of 10 ms. */
static double sampled_sine(double t)
{
    double sum = 0;
    for (int k = 0; k < 300 && 0.01 * k < t; k++) {
        double h = fmin(t - 0.01 * k, 0.01), from = sin(0.07 * k), to = sin(0.07 * (k + 1));
        sum += h * (from + 0.5 * h * (to - from) / 0.01);
    }
    return sum;
}

/* A four-bar beside the wheel changes its independent coordinates at samples of the input, where every step ends. */
static void exchange_at_samples(void)
{
    static const char *const methods[][3] = {{"reduced", "integrated", "dop853"}, {"reduced", "integrated", "dopri5"},
                                             {"reduced", "integrated", "radau"},  {"reduced", "integrated", "erk"},
                                             {"reduced", "newton", "dop853"},     {"projected", NULL, "dop853"}};
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\ninputs: {u: {unit: N*m, method: linear, t: [0");
    for (int k = 1; k <= 300; k++)
        kmp_text_printf(&text, ", %.2f", 0.01 * k);
    kmp_text_put(&text, "], value: [0");
    for (int k = 1; k <= 300; k++)
        kmp_text_printf(&text, ", %.17g", sin(0.07 * k));
    kmp_text_put(&text, "]}}\n"
                        "ground: {points: {D: [0.9, 0, 0]}}\n"
                        "bodies:\n"
                        "  wheel: {joint: {name: W, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
                        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.03}, "
                        "points: {B: [0.3, 0, 0]}}\n"
                        "  coupler: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.2}, "
                        "points: {C: [0.8, 0, 0]}}\n"
                        "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.2}, "
                        "points: {C: [0.7, 0, 0]}}\n"
                        "loops: {C: {ball: [coupler.C, rocker.C]}}\n"
                        "forces: {motor: {joint: W, torque: u}}\n"
                        "start: {q: {A: 90 deg, B: -45 deg, D: 90 deg}, hold: [A], qd: {A: 3}}\n"
                        "run: {t_end: 3, output_step: 0.5, rtol: 1e-9}\n");
    loaded l = load_text(text.s);
    for (size_t k = 0; k < sizeof methods / sizeof *methods && l.system; k++)
        CHECK(error_of(l.system,
                       &(kmp_method){.formulation = methods[k][0], .form = methods[k][1], .integrator = methods[k][2]},
                       sampled_sine) < 1e-9);
    unload(&l);
    kmp_text_free(&text);
}

static void condition_on_a_held_input(void)
{
    check_wheel("hold", "\"if(u > 1, 1, 0)\"", if_above);
}

/* -- drives ------------------------------------------------------------------------------------------ */

#define CRANE                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "inputs:\n"                                                                                                        \
    "  x: {unit: mm, t: [0, 1, 2, 4], value: [0, 100, 800, 6400], method: %s}\n"                                       \
    "bodies:\n"                                                                                                        \
    "  cart: {joint: {name: X, prismatic: x, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [0, 0, 0]}}\n"        \
    "  load: {joint: {name: A, revolute: z, at: cart.P}, mass: 1, com: [0, -1, 0], inertia: {zz: 0.1}}\n"              \
    "drives: {d: {joint: X, displacement: x}}\n"                                                                       \
    "run: {t_end: 3, output_step: 0.25, rtol: 1e-9}\n"

/* The drive follows 0.1 t^3 in position, rate and acceleration. */
static void drive_by_a_spline(void)
{
    char text[1024];
    kmp_method method;
    (void)snprintf(text, sizeof text, CRANE, "cubic");
    loaded l = load_text(text);
    for (int i = 0; l.system && kmp_method_get(i, &method); i++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options run = {.formulation = method.formulation,
                                 .form = method.form,
                                 .integrator = method.integrator,
                                 .no_convergence_check = 1};
        CHECK(kempe_simulate(l.system, &run, &trajectory) == KEMPE_OK);
        for (int k = 0; k < kempe_trajectory_row_count(trajectory); k++) {
            double t = kempe_trajectory_time(trajectory, k);
            CHECK_NEAR(kempe_trajectory_q(trajectory, k)[0], 0.1 * t * t * t, 1e-8);
            CHECK_NEAR(kempe_trajectory_qd(trajectory, k)[0], 0.3 * t * t, 1e-8);
            CHECK_NEAR(kempe_trajectory_qdd(trajectory, k)[0], 0.6 * t, 1e-6);
        }
        kempe_trajectory_free(trajectory);
    }
    unload(&l);
}

/* The same motion by an expression: the forces of the drive are equal too. */
static void drive_by_an_expression(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, CRANE, "cubic");
    loaded a = load_text(text);
    char *at = strstr(text, "displacement: x");
    (void)snprintf(at, sizeof text - (size_t)(at - text),
                   "displacement: 0.1*t^3}}\nrun: {t_end: 3, output_step: 0.25, rtol: 1e-9}\n");
    loaded b = load_text(text);
    kempe_trajectory *input = NULL, *expression = NULL;
    CHECK(kempe_simulate(a.system, NULL, &input) == KEMPE_OK);
    CHECK(kempe_simulate(b.system, NULL, &expression) == KEMPE_OK);
    for (int k = 0; k < kempe_trajectory_row_count(input); k++) {
        CHECK_NEAR(kempe_trajectory_q(input, k)[1], kempe_trajectory_q(expression, k)[1], 1e-8);
        CHECK_NEAR(kempe_trajectory_lambda(input, k)[0], kempe_trajectory_lambda(expression, k)[0], 1e-7);
    }
    kempe_trajectory_free(input);
    kempe_trajectory_free(expression);
    unload(&a);
    unload(&b);
}

/* A drive cannot follow a jump: the run ends there, with the drive, its place and the input. */
static void drive_by_jumps(void)
{
    static const char *const method[] = {"hold", "linear"}, *const word[] = {"value", "rate"};
    char text[1024];
    for (int k = 0; k < 2; k++) {
        (void)snprintf(text, sizeof text, CRANE, method[k]);
        loaded l = load_text(text);
        kempe_trajectory *trajectory = NULL;
        CHECK(kempe_simulate(l.system, NULL, &trajectory) == KEMPE_E_FAILED);
        const char *reason = kempe_trajectory_reason(trajectory);
        CHECK(strstr(reason, "model.yaml:8:10: closure 'd' depends on input 'x', whose ") && strstr(reason, word[k]) &&
              strstr(reason, "jumps at t = 1 s"));
        kempe_trajectory_free(trajectory);
        unload(&l);
    }
}

/* -- values from outside ------------------------------------------------------------------------------ */

/* A setting is a constant in the unit of the input, or samples of a file. */
static void settings(void)
{
    static const char path[] = "test_inputs.csv";
    char samples[128], text[1024];
    FILE *csv = fopen(path, "w");
    CHECK(csv != NULL);
    if (!csv)
        return;
    (void)fputs("t,torque\n0,0\n0.7,2e-3\n1.3,-1e-3\n2.1,0.5e-3\n", csv);
    (void)fclose(csv);
    (void)snprintf(samples, sizeof samples, "%s:torque:hold", path);
    (void)snprintf(text, sizeof text, WHEEL RUN, "linear", "u");
    const kempe_setting set[] = {{"u", "3e-3"}, {"u", "4 N*m"}, {"u", samples}};
    const double want[] = {9, 12, held(3)};
    for (int k = 0; k < 3; k++) {
        loaded l = {.context = kempe_context_new()};
        kempe_trajectory *trajectory = NULL;
        (void)kempe_model_read_text_set(l.context, text, "model.yaml", &set[k], 1, &l.model);
        l = load_finish(l);
        CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
        const double *qd = kempe_trajectory_qd(trajectory, kempe_trajectory_row_count(trajectory) - 1);
        CHECK_NEAR(qd ? qd[0] : NAN, want[k], 1e-8);
        kempe_trajectory_free(trajectory);
        unload(&l);
    }
    (void)remove(path);
}

/* The one error of a model with this section. */
static void refused(const char *section, const char *sentence)
{
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ninputs:\n  %s\nbodies:\n  wheel: {joint: {name: A, revolute: z, at: ground}, mass: 1, "
                   "inertia: {zz: 1}}\nforces: {motor: {joint: A, torque: u}}\n",
                   section);
    load_rejected(text, sentence);
}

static void mistakes(void)
{
    refused("u: {default: 3 N}\n  sin: {}", "an input cannot have the name 'sin'");
    refused("u: {default: 3 N, unit: N*m}", "default of input 'u': expected N*m, got N");
    refused("u: {unit: Nq}", "unit of input 'u': 'Nq' is not a unit");
    refused("u: {unit: N}", "expected N*m, got N");
    refused("u: {t: [0, 1], value: [0, 1]}", "input 'u' has no key 'method'");
    refused("u: {t: [0, 0], value: [0, 1], method: hold}", "times must increase: 0 comes after 0");
    refused("u: {t: [0, 1], value: [0, 1], method: spline}", "the method is hold, linear or cubic, not 'spline'");
    refused("u: {}\n  v: {default: u}", "input 'u' is not allowed here: a constant is expected");
}

/* Outputs at the time of a jump have the value before it, as the accelerations have. */
static void rows_at_jumps(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text,
                   WHEEL "sensors: {s: u}\n"
                         "run: {t_end: 3, output_step: 0.1, outputs: [qdd, s]}\n",
                   "hold", "u");
    loaded l = load_text(text);
    kempe_trajectory *trajectory = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
    CHECK(trajectory && kempe_trajectory_table(trajectory, "rows", &table) == KEMPE_OK);
    int qdd = kempe_table_find(table, "qdd.A"), s = kempe_table_find(table, "sensor.s");
    for (int k = 0; k < kempe_table_row_count(table); k++)
        CHECK_NEAR(kempe_table_number(table, k, qdd), kempe_table_number(table, k, s), 1e-12);
    kempe_table_free(table);
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* Programs of such models read back from text; generated code has no inputs yet and refuses the sets. */
static void printed(void)
{
    char text[1024], *program = NULL;
    (void)snprintf(text, sizeof text, CRANE, "cubic");
    loaded l = load_text(text);
    CHECK(kempe_system_print(l.system, KEMPE_VIEW_EQUATIONS, KEMPE_TEXT, &program) == KEMPE_OK);
    CHECK(program && strstr(program, "h") != NULL && strstr(program, "x''") != NULL);
    kempe_text_free(program);
    unload(&l);
}

int main(void)
{
    TEST(hold);
    TEST(linear);
    TEST(cubic);
    TEST(work_of_inputs);
    TEST(exchange_at_samples);
    TEST(condition_on_a_held_input);
    TEST(drive_by_a_spline);
    TEST(drive_by_an_expression);
    TEST(drive_by_jumps);
    TEST(settings);
    TEST(mistakes);
    TEST(rows_at_jumps);
    TEST(printed);
    return check_report();
}
