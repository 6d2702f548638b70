/* SPDX-License-Identifier: BSD-3-Clause */
/* Function blocks: controllers, transfer functions, delays, hysteresis and composite functions against closed forms,
 * difference equations written out here, and the same laws written by hand. */
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <float.h>
#include <kempe/table.h>

#define MASS "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"

static kempe_trajectory *run_model(const loaded *l, const char *formulation, const char *integrator)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {.formulation = formulation, .integrator = integrator, .no_convergence_check = 1};
    kempe_status status = l->system ? kempe_simulate(l->system, &run, &trajectory) : KEMPE_E_ARGUMENT;
    if (status != KEMPE_OK)
        printf("  %s\n", kempe_context_message(l->context));
    CHECK(status == KEMPE_OK);
    return trajectory;
}

static double sensor_at(const kempe_trajectory *trajectory, int row, const char *column)
{
    kempe_table *table = NULL;
    CHECK(kempe_trajectory_table(trajectory, "rows", &table) == KEMPE_OK);
    int k = table ? kempe_table_find(table, column) : -1;
    double value = k >= 0 ? kempe_table_number(table, row, k) : NAN;
    kempe_table_free(table);
    return value;
}

/* -- composite functions ------------------------------------------------------------------------------ */

static void functions(void)
{
    static const double want[][4] = {{1, 0.1, -0.4, 0},
                                     {1 + 2 * 0.15625, 0.25, -0.15, 0.25},
                                     {2, 0.5, 0, 0.5},
                                     {1 + 2 * 0.84375, 0.6, 0, 0.75},
                                     {3, 0.6, 0.2, 1}};
    loaded l = load_text("kempe: 1\n" MASS "sensors: {a: \"step(t, 0, 1, 1, 3)\", b: \"saturation(t, 0.1, 0.6)\",\n"
                         "  c: \"dead_zone(t, 0.4, 0.8)\", d: \"ramp(2*t, 0, 2)\"}\n"
                         "run: {t_end: 1, output_step: 0.25, outputs: [a, b, c, d]}\n");
    kempe_trajectory *t = run_model(&l, "reduced", "dop853");
    for (int row = 0; row < 5; row++)
        for (int k = 0; k < 4; k++)
            CHECK_NEAR(sensor_at(t, row, (const char *[]){"sensor.a", "sensor.b", "sensor.c", "sensor.d"}[k]),
                       want[row][k], 1e-14);
    kempe_trajectory_free(t);
    unload(&l);
}

/* Repeated arguments would make a text of 100 characters a tree of millions. */
static void nested(void)
{
    char text[512], expr[400] = "t";
    kempe_model *model = NULL;
    kempe_context *context = kempe_context_new();
    for (int k = 0; k < 12; k++) {
        char more[400];
        (void)snprintf(more, sizeof more, "step(%.300s,0,0,1,1)", expr);
        memcpy(expr, more, sizeof expr);
    }
    (void)snprintf(text, sizeof text, "kempe: 1\n" MASS "sensors: {a: \"%s\"}\n", expr);
    CHECK(kempe_model_read_text(context, text, "model.yaml", &model) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "the expression is too long") != NULL);
    kempe_context_free(context);
}

/* -- controllers -------------------------------------------------------------------------------------- */

/* A mass under a controller, whose motion is known in closed form; on every method. */
static void known_motion(void)
{
    loaded l =
        load_text("kempe: 1\n"
                  "states: {c: {pid: 1 - q(x), proportional: 100, integral: 200, derivative: 15, slope: -qd(x)}}\n" MASS
                  "forces: {control: {joint: x, force: c - 5}}\n"
                  "run: {t_end: 2, output_step: 2, rtol: 1e-10, atol: 1e-10}\n");
    kmp_method method;
    int count = 0;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options run = {.formulation = method.formulation,
                                 .form = method.form,
                                 .integrator = method.integrator,
                                 .no_convergence_check = 1};
        CHECK(kempe_simulate(l.system, &run, &trajectory) == KEMPE_OK);
        CHECK_NEAR(kempe_trajectory_q(trajectory, 1)[0], 1.00153311387384009, 1e-6);
        CHECK_NEAR(kempe_trajectory_qd(trajectory, 1)[1], 200 * 0.0254710191755189266, 1e-5);
        kempe_trajectory_free(trajectory);
    }
    CHECK(count > 20);
    unload(&l);
}

/* Two models that mean the same: their trajectories agree to the tolerance of both. */
static void same(const char *states, const char *by_hand, const char *value, int compared)
{
    static const char *const integrators[] = {"dop853", "radau"};
    static const char *const model = "kempe: 1\nstates:\n%s\n" MASS "forces: {control: {joint: x, force: \"%s - 5\"}}\n"
                                     "run: {t_end: 1, output_step: 0.05, rtol: 1e-11, atol: 1e-11}\n";
    char text[2048];
    (void)snprintf(text, sizeof text, model, states, "c");
    loaded a = load_text(text);
    (void)snprintf(text, sizeof text, model, by_hand, value);
    loaded b = load_text(text);
    for (int k = 0; k < 2; k++) {
        kempe_trajectory *s = run_model(&a, "reduced", integrators[k]), *t = run_model(&b, "reduced", integrators[k]);
        int rows = kempe_trajectory_row_count(s);
        CHECK(rows > 1 && rows == kempe_trajectory_row_count(t));
        for (int row = 0; row < rows; row++)
            for (int i = 0; i < compared; i++)
                CHECK_NEAR(kempe_trajectory_qd(s, row)[i], kempe_trajectory_qd(t, row)[i], 1e-8);
        kempe_trajectory_free(s);
        kempe_trajectory_free(t);
    }
    unload(&a);
    unload(&b);
}

#define SUM     "(40*(1 - q(x)) + i)"
#define LIMITED "min(12, max(-9, " SUM "))"
#define WITH_D  "(40*(1 - q(x)) + i - 8*qd(x))"
#define LEAD    "(l + 10*(1 - q(x)))"

static void by_hand(void)
{
    same("  c: {pid: 1 - q(x), proportional: 40, integral: 20, derivative: 8, filter: 10 ms, start: 2}",
         "  i: {start: 2, rate: 20*(1 - q(x))}\n  f: {rate: (1 - q(x) - f)/0.01}",
         "40*(1 - q(x)) + i + 8*(1 - q(x) - f)/0.01", 3);
    same("  c: {pid: 1 - q(x), proportional: 40, integral: 60, limits: [-9, 12], tracking: 0.3}",
         "  i: {rate: \"60*(1 - q(x)) + (" LIMITED " - " SUM ")/0.3\"}", LIMITED, 2);
    same("  c: {pid: 1 - q(x), proportional: 40, integral: 60, derivative: 8, slope: -qd(x), limits: [-9, 12]}",
         "  i: {rate: \"60*(1 - q(x)) + (min(12, max(-9, " WITH_D ")) - " WITH_D ")/sqrt(8/60)\"}",
         "min(12, max(-9, " WITH_D "))", 2);
    /* a controller behind a lead: y = l + 10 u, l' = (u - y)/0.01 */
    same("  c: {pid: e, proportional: 40, integral: 60, limits: [-9, 12]}\n"
         "  e: {transfer: 1 - q(x), numerator: [0.1, 1], denominator: [0.01, 1]}",
         "  i: {rate: \"60*" LEAD " + (min(12, max(-9, 40*" LEAD " + i)) - (40*" LEAD " + i))/(40/60)\"}\n"
         "  l: {rate: (1 - q(x) - " LEAD ")/0.01}",
         "min(12, max(-9, 40*" LEAD " + i))", 3);
}

/* The lead-lag (s + 2)/(s + 1) of a unit step is 2 - e^-t; s/(s/100 + 1) of t is 1 - e^(-100 t). */
static void direct_transfer(void)
{
    loaded l = load_text("kempe: 1\nstates:\n"
                         "  lead: {transfer: 1, numerator: [1, 2], denominator: [1, 1]}\n"
                         "  slope: {transfer: t, numerator: [1, 0], denominator: [0.01, 1]}\n"
                         "  second: {transfer: lead, numerator: [1, 0, 1], denominator: [1, 2, 1]}\n" MASS
                         "sensors: {a: lead, b: slope, c: second}\n"
                         "run: {t_end: 1, rtol: 1e-11, atol: 1e-11, output_step: 0.1, outputs: [a, b, c]}\n");
    kempe_trajectory *trajectory = run_model(&l, "projected", "radau");
    for (int row = 0; row <= 10; row++) {
        double t = 0.1 * row;
        CHECK_NEAR(sensor_at(trajectory, row, "sensor.a"), 2 - exp(-t), 1e-9);
        CHECK_NEAR(sensor_at(trajectory, row, "sensor.b"), 1 - exp(-100 * t), 1e-9);
        /* (s + 2)(s^2 + 1)/(s (s + 1)^3): residue 2 at zero, the rest by partial fractions at -1 */
        CHECK_NEAR(sensor_at(trajectory, row, "sensor.c"), 2 - exp(-t) * (1 + 2 * t + t * t), 1e-9);
    }
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* A sampled controller on a mass: the motion of a sample is exact, the controller is written out. */
static void sampled_controller(void)
{
    loaded l = load_text(
        "kempe: 1\nstates:\n"
        "  c: {pid: 1 - q(x), proportional: 30, integral: 20, derivative: 7, filter: 5 ms, limits: [-8, 20],\n"
        "    tracking: 0.2, sample: 20 ms, start: 0}\n" MASS "forces: {control: {joint: x, force: c - 5}}\n"
        "run: {t_end: 2, output_step: 20 ms, rtol: 1e-12, atol: 1e-12}\n");
    kempe_trajectory *trajectory = run_model(&l, "reduced", "dop853");
    const double T = 0.02, Tf = 5e-3;
    double x = 0, v = 0, i = 0, f = 0;
    for (int k = 0; k < 100; k++) {
        double e = 1 - x, sum = 30 * e + i + 7 * (e - f) / (Tf + T), u = fmin(20, fmax(-8, sum));
        i += T * (20 * e + (u - sum) / 0.2);
        f = (Tf * f + T * e) / (Tf + T);
        x += v * T + (u - 5) * T * T / 2;
        v += (u - 5) * T;
        CHECK_NEAR(kempe_trajectory_q(trajectory, k + 1)[0], x, 1e-11);
        CHECK_NEAR(kempe_trajectory_qd(trajectory, k + 1)[1], u, 1e-9);
    }
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* Difference equations: y = 0.25 y' + 0.5 u + 0.25 u', where ' is one sample before; a delay by three samples. */
static void sampled_transfer(void)
{
    loaded l =
        load_text("kempe: 1\nstates:\n"
                  "  y: {transfer: sin(3*t), numerator: [0.5, 0.25], denominator: [1, -0.25], sample: 0.1}\n"
                  "  w: {transfer: t, numerator: [1], denominator: [2, 0, 0], sample: 0.1}\n"
                  "  d: {delay: t, time: 0.3, sample: 0.1, start: -1}\n" MASS "run: {t_end: 0.8, output_step: 0.05}\n");
    kempe_trajectory *trajectory = run_model(&l, "reduced", "dop853");
    double y = 0, u = 0;
    for (int k = 0; k < 8; k++) {
        double now = sin(3 * (0.1 * k));
        y = 0.25 * y + 0.5 * now + 0.25 * u;
        u = now;
        const double *qd = kempe_trajectory_qd(trajectory, 2 * k + 1);
        CHECK_NEAR(qd ? qd[1] : NAN, y, 1e-13);
        CHECK_NEAR(qd ? qd[3] : NAN, k < 2 ? 0 : 0.5 * 0.1 * (k - 2), 1e-13);
        CHECK_NEAR(qd ? qd[6] : NAN, k < 3 ? -1 : 0.1 * (k - 3), 1e-13);
    }
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* A relay that drives a mass to and fro: events at sqrt 2 and 2 sqrt 2 + sqrt 6, where the rate is -sqrt 6. A second
 * one begins beyond its upper limit. */
static void hysteresis(void)
{
    loaded l = load_text("kempe: 1\nstates:\n"
                         "  way: {hysteresis: q(x), limits: [-1, 1], values: [1, -1]}\n"
                         "  late: {hysteresis: 2 - t, limits: [0.5, 1.5]}\n"
                         "  kept: {hysteresis: t, limits: [0.5, 30], start: 1}\n" MASS
                         "forces: {f: {joint: x, force: way}}\nrun: {t_end: 10, output_step: 1, rtol: 1e-9}\n");
    kmp_method method;
    double s = 10 - 2 * sqrt(2) - sqrt(6);
    int count = 0;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
        kempe_trajectory *t = run_model(&l, method.formulation, method.integrator);
        const double *q = kempe_trajectory_q(t, 10), *qd = kempe_trajectory_qd(t, 10);
        CHECK_NEAR(q ? q[0] : NAN, -1 - sqrt(6) * s + s * s / 2, 1e-6);
        CHECK(qd && qd[1] == 1 && qd[2] == 0 && qd[3] == 0);
        for (int row = 0; row < 3; row++) /* a package may round values that do not change, between its steps */
            CHECK_NEAR(kempe_trajectory_qd(t, row)[2], row < 2, 4 * DBL_EPSILON);
        CHECK(kempe_trajectory_qd(t, 0)[3] == 0);
        kempe_trajectory_free(t);
    }
    CHECK(count > 20);
    unload(&l);
}

/* -- what is refused ---------------------------------------------------------------------------------- */

static void refused(const char *states, const char *sentence)
{
    char text[1024];
    (void)snprintf(text, sizeof text, "kempe: 1\nstates: {%s}\n" MASS "%s", states,
                   strstr(states, "loop") ? "loops: {C: {constraint: q(x) - loop}}\n" : "");
    load_rejected(text, sentence);
}

static void mistakes(void)
{
    refused("a: {pid: 1 - b, proportional: 1, integral: 1}, b: {pid: a, proportional: 1, integral: 1}",
            "depends on itself without a state in between");
    refused("a: {pid: 1, proportional: 3}", "write it as an expression");
    refused("a: {pid: 1, integral: 3, derivative: 1}", "'filter'");
    refused("a: {pid: 1, integral: 3, filter: 1}", "belong to a derivative");
    refused("a: {pid: 1, integral: 3, limits: [0, 1]}", "need the time 'tracking'");
    refused("a: {pid: 1, integral: 3, numerator: [1]}", "'numerator' is not a key of a state with 'pid'");
    refused("a: {pid: 1, integral: 1, derivative: 1, filter: 0}", "it must be positive");
    refused("a: {hysteresis: t, limits: [2, 1]}", "must be below the second one");
    refused("a: {hysteresis: t}", "has no key 'limits'");
    refused("a: {delay: t, time: 0.25, sample: 0.1}", "2.5 samples: a whole number");
    refused("a: {delay: t, sample: 0.1}", "has no key 'time'");
    refused("a: {transfer: t, numerator: [1, 0, 0], denominator: [1, 1]}", "at least the degree of its numerator");
    refused("a: {rate: 1, pid: 2}", "exactly one of");
    refused("loop: {pid: t, integral: 1}", "loop");
}

int main(void)
{
    TEST(functions);
    TEST(nested);
    TEST(known_motion);
    TEST(by_hand);
    TEST(direct_transfer);
    TEST(sampled_controller);
    TEST(sampled_transfer);
    TEST(hysteresis);
    TEST(mistakes);
    return check_report();
}
