/* SPDX-License-Identifier: BSD-3-Clause */
/* Delays of continuous signals: polynomials of the method of steps, an exact root of a characteristic equation, jumps
 * that events and inputs cause, on every method; saved runs, instances, what has no answer. */
#include "instances.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <complex.h>
#include <kempe/equilibrium.h>
#include <kempe/output_handles.h>
#include <kempe/response.h>
#include <kempe/stepper.h>
#include <math.h>
#include <stdlib.h>

#define BODY "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"

/* y' = -y(t - 1), y = 1 before. */
#define STEPS "kempe: 1\nstates:\n  y: {start: 1, rate: -late}\n  late: {delay: y, time: T}\nparameters: {T: 1}\n" BODY

static kempe_trajectory *run_by(const kempe_system *system, const kmp_method *method, double rtol)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {.no_convergence_check = 1, .rtol = rtol, .atol = rtol};
    if (method) {
        run.formulation = method->formulation;
        run.form = method->form;
        run.integrator = method->integrator;
    }
    CHECK(system && kempe_simulate(system, &run, &trajectory) == KEMPE_OK);
    return trajectory;
}

/* y(k T) of y' = -y(t - T) by the method of steps: on each interval a polynomial, the integral of the one before. */
static double steps(int k, double T)
{
    double before[40] = {1}, now[40], y = 1;
    for (int i = 0; i < k; i++) {
        now[0] = y;
        y = 0;
        for (int j = 0; j < 39; j++)
            now[j + 1] = -T * before[j] / (j + 1);
        for (int j = 0; j < 40; j++)
            y += before[j] = now[j];
    }
    return y;
}

/* All methods; errors follow the tolerance. */
static void polynomials(void)
{
    loaded l = load_text(STEPS "run: {t_end: 10, output_step: 1}\n");
    kmp_method method;
    int count = 0;
    for (int i = 0; i < 2; i++)
        for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
            double rtol = i == 0 ? 1e-7 : 1e-10;
            kempe_trajectory *t = run_by(l.system, &method, rtol);
            bool dae = strcmp(method.formulation, "dae") == 0;
            for (int row = 0; row <= 10; row++) {
                const double *qd = kempe_trajectory_qd(t, row);
                CHECK_NEAR(qd[1], steps(row, 1), (dae ? 300 : 60) * rtol);
                CHECK_NEAR(qd[2], row > 0 ? steps(row - 1, 1) : 1, (dae ? 300 : 60) * rtol);
            }
            kempe_trajectory_free(t);
        }
    CHECK(count > 40);
    unload(&l);
}

/* x'' = -k x - g x'(t - T) from the mode of a root s = a + i b: k and g follow from a, b and T, and the motion before
 * is exp(a t) cos(b t). */
static void oscillator(void)
{
    const double a = 0.1, b = 3, T = 0.4, w = 5 * T;
    const double complex s = a + I * b, lag = s * cexp(-s * T);
    const double g = -cimag(s * s) / cimag(lag), k = -creal(s * s + g * lag);
    char text[2000];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nparameters: {a: %.17g, b: %.17g}\n" BODY
                   "states: {v: {delay: qd(x), time: %.17g, before: exp(a*t)*(a*cos(b*t) - b*sin(b*t))}}\n"
                   "forces: {f: {joint: x, force: -%.17g*q(x) - (%.17g)*v}}\nstart: {q: {x: 1}, qd: {x: a}}\n"
                   "run: {t_end: 8, output_step: 1}\n",
                   a, b, T, k, g);
    (void)w;
    loaded l = load_text(text);
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    for (int i = 0; i < 3; i++) {
        kempe_run_options run = {
            .no_convergence_check = 1, .rtol = 1e-11, .atol = 1e-11, .formulation = formulations[i]};
        kempe_trajectory *t = NULL;
        CHECK(l.system && kempe_simulate(l.system, &run, &t) == KEMPE_OK);
        for (int row = 0; row <= 8; row++)
            CHECK_NEAR(kempe_trajectory_q(t, row)[0], exp(a * row) * cos(b * row), i < 2 ? 1e-9 : 1e-7);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* Signals before the start and after it that have a part in common; two delays of one signal. */
static void common_parts(void)
{
    loaded l = load_text("kempe: 1\n" BODY "states:\n  a: {delay: sin(3*t), time: 0.2}\n"
                         "  b: {delay: q(x), time: 0.5, before: cos(3*t)}\n  i: {rate: a}\n  j: {rate: b}\n"
                         "run: {t_end: 0.4, output_step: 0.4, rtol: 1e-11, atol: 1e-11}\n");
    kempe_trajectory *t = run_by(l.system, NULL, 1e-11);
    const double *qd = kempe_trajectory_qd(t, 1);
    CHECK_NEAR(qd[1], sin(0.6), 1e-10);
    CHECK_NEAR(qd[2], cos(0.3), 1e-10);
    CHECK_NEAR(qd[3], (1 - cos(0.6)) / 3, 1e-10);
    CHECK_NEAR(qd[4], (sin(1.5) - sin(0.3)) / 3, 1e-10);
    kempe_trajectory_free(t);
    unload(&l);
}

/* An event of a delayed signal that the past puts back by rounding happens once: x = v t reaches 1/2 later by T. */
static void events_of_the_past(void)
{
    loaded l = load_text("kempe: 1\n" BODY "states:\n  late: {delay: q(x), time: 0.37}\n"
                         "  n: {when: late > 0.5, next: n + 1}\nforces: {f: {joint: x, force: -late}}\n"
                         "start: {qd: {x: 1.1}}\nrun: {t_end: 1.2, output_step: 1.2}\n");
    for (int k = 6; k < 14; k++) {
        kempe_trajectory *t = run_by(l.system, NULL, pow(10, -k));
        CHECK_NEAR(kempe_trajectory_qd(t, 1)[2], 1, 0);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* A held input, delayed, jumps later by the delay: x' is 3 t before, 3 from then on. A relay's event comes back. */
static void jumps(void)
{
    loaded l = load_text("kempe: 1\ninputs: {u: {t: [0, 0.25], value: [1, 4], method: hold}}\n" BODY
                         "states:\n  late: {delay: u, time: 0.3, start: 0}\n  later: {delay: late, time: 0.3}\n"
                         "  y: {rate: late}\n  z: {rate: later}\nrun: {t_end: 1.3, output_step: 1.3}\n");
    kmp_method method;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++) {
        kempe_trajectory *t = run_by(l.system, &method, 1e-8);
        const double *qd = kempe_trajectory_qd(t, 1);
        CHECK_NEAR(qd[1], 4, 1e-7);
        CHECK_NEAR(qd[2], 4, 1e-7);
        CHECK_NEAR(qd[3], 0.25 * 1 + 0.75 * 4, 1e-6);
        CHECK_NEAR(qd[4], 0.25 * 1 + 0.45 * 4, 1e-6);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* The force is the sign of x one delay ago: x = 1 - t^2/2 until x was 0 at sqrt 2, and so on, by hand. */
static void events(void)
{
    loaded l = load_text("kempe: 1\n" BODY "states: {late: {delay: q(x), time: 0.5}}\n"
                         "forces: {f: {joint: x, force: \"if(late > 0, -1, 1)\"}}\nstart: {q: {x: 1}}\n"
                         "run: {t_end: 4, output_step: 4}\n");
    double to = sqrt(2) + 0.5, x = 1 - 0.5 * to * to, v = -to, rest = 4 - to;
    double back = -v - sqrt(v * v - 2 * x); /* x + v s + s^2/2 = 0 */
    kmp_method method;
    CHECK(back + 0.5 > rest || isnan(back) || back < 0);
    for (int k = 0; l.system && kmp_method_get(k, &method); k++) {
        kempe_trajectory *t = run_by(l.system, &method, 1e-9);
        CHECK_NEAR(kempe_trajectory_q(t, 1)[0], x + v * rest + 0.5 * rest * rest, 2e-8);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* Conditions and kinks of the input are located, though nothing else has them: x = t^2/2 passes 1/2 at t = 1. */
static void conditions(void)
{
    loaded l = load_text("kempe: 1\n" BODY "states:\n  late: {delay: \"if(q(x) > 0.5, 1, -1)\", time: 0.3}\n"
                         "  bent: {delay: abs(q(x) - 0.5), time: 0.3}\n  i: {rate: late}\n  j: {rate: bent}\n"
                         "forces: {f: {joint: x, force: 1}}\nrun: {t_end: 3, output_step: 3}\n");
    const double before = 0.5 - 1.0 / 6, after = (2.7 * 2.7 * 2.7 - 1) / 6 - 0.5 * 1.7;
    kmp_method method;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++) {
        kempe_trajectory *t = run_by(l.system, &method, 1e-9);
        const double *qd = kempe_trajectory_qd(t, 1);
        CHECK_NEAR(qd[1], 1, 1e-7);
        CHECK_NEAR(qd[2], 0.5 * 2.7 * 2.7 - 0.5, 1e-7);
        CHECK_NEAR(qd[3], 0.4, 1e-7);
        CHECK_NEAR(qd[4], 0.5 * 0.3 + before + after, 1e-7);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* A ball bounces: the integral of its delayed rate is its height one delay ago, across impacts. */
static void impacts(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\n"
                         "bodies: {ball: {joint: {name: y, prismatic: y, at: ground}, mass: 1}}\n"
                         "states: {late: {delay: qd(y), time: 0.1}, seen: {rate: late}}\n"
                         "contacts: {floor: {joint: y, lower: 0, restitution: 0.8}}\n"
                         "start: {q: {y: 1}}\nrun: {t_end: 2, output_step: 0.1}\n");
    static const char *const formulations[] = {"reduced", "projected"};
    for (int i = 0; l.system && i < 2; i++) {
        kempe_run_options run = {.no_convergence_check = 1, .rtol = 1e-9, .atol = 1e-9, .formulation = formulations[i]};
        kempe_trajectory *t = NULL;
        CHECK(kempe_simulate(l.system, &run, &t) == KEMPE_OK);
        for (int row = 1; row <= 20; row++)
            CHECK_NEAR(kempe_trajectory_qd(t, row)[2], kempe_trajectory_q(t, row - 1)[0] - 1, 1e-8);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* Dense output after the run has the past of the step that it returns to. */
static void dense(void)
{
    loaded l = load_text(STEPS "run: {t_end: 5, rtol: 1e-10, atol: 1e-10}\n");
    const kempe_run_options run = {.no_convergence_check = 1, .keep_dense = 1};
    kempe_trajectory *t = NULL;
    double q[3], qd[3], qdd[3], t_back;
    CHECK(l.system && kempe_simulate(l.system, &run, &t) == KEMPE_OK);
    for (int k = 5; t && k > 0; k--) {
        t_back = k;
        CHECK(kempe_trajectory_at_time(t, t_back, q, qd, qdd, NULL) == KEMPE_OK);
        CHECK_NEAR(qd[1], steps(k, 1), 1e-8);
        CHECK_NEAR(qd[2], steps(k - 1, 1), 1e-8);
        CHECK_NEAR(qdd[2], k > 1 ? -steps(k > 2 ? k - 2 : 0, 1) : 0, 1e-7);
    }
    kempe_trajectory_free(t);
    unload(&l);
}

/* A saved stepper makes the same bits again, also from within a step; its motion is that of a run. */
static void stepper(void)
{
    loaded l = load_text(STEPS "run: {t_end: 10, rtol: 1e-10, atol: 1e-10}\n");
    kempe_stepper *s = NULL;
    kempe_stepper_state *kept = NULL;
    CHECK(l.system && kempe_stepper_new(l.system, NULL, &s) == KEMPE_OK);
    CHECK(kempe_stepper_advance(s, 3.37) == KEMPE_OK);
    CHECK(kempe_stepper_save(s, &kept) == KEMPE_OK);
    CHECK(kempe_stepper_advance(s, 10) == KEMPE_OK);
    double end = kempe_stepper_qd(s)[1];
    CHECK_NEAR(end, steps(10, 1), 1e-8);
    CHECK(kempe_stepper_restore(s, kept) == KEMPE_OK);
    CHECK(kempe_stepper_advance(s, 10) == KEMPE_OK);
    CHECK(kempe_stepper_qd(s)[1] == end);
    kempe_stepper_state_free(kept);
    kempe_stepper_free(s);
    unload(&l);
}

/* The delay is a parameter. */
static void ensemble(void)
{
    static const char *const names[] = {"T"};
    static const double rows[] = {1, 0.5, -1};
    loaded l = load_text(STEPS "run: {t_end: 4, rtol: 1e-9}\n");
    instances all = run_instances(&l, 0, 1, names, 3, rows);
    CHECK_NEAR(end_rate(&all, 0, 1), steps(4, 1), 1e-7);
    CHECK_NEAR(end_rate(&all, 1, 1), steps(8, 0.5), 1e-7);
    CHECK(kempe_ensemble_result_outcome(all.batch, 2) == KEMPE_OUTCOME_FAILED);
    CHECK_TEXT(kempe_ensemble_result_reason(all.batch, 2), "the delay of 'late' is -1 s: a positive time is expected");
    free_instances(&all);
    unload(&l);
}

/* Quantities of instances with pasts of their own: the integral of late is 1 - y. */
static void quantities(void)
{
    static const char *const names[] = {"T"};
    static const double rows[] = {1, 0.5, 1};
    loaded l = load_text(STEPS "run: {t_end: 4, rtol: 1e-9}\n");
    instances all = {0};
    CHECK(l.model && kempe_values_new(l.model, 1, names, 3, rows, &all.values) == KEMPE_OK);
    const kempe_ensemble_options options = {.size = sizeof options,
                                            .quantities = "I=integral(late),e=late + y,r=qdd(x)"};
    CHECK(all.values && kempe_ensemble_new_with(l.model, all.values, &options, &all.ensemble) == KEMPE_OK);
    CHECK(all.ensemble && kempe_ensemble_run(all.ensemble, NULL, 0, &all.batch) == KEMPE_OK);
    for (int i = 0; all.batch && i < 3; i++) {
        int k = rows[i] < 1 ? 8 : 4;
        CHECK_NEAR(kempe_ensemble_result_quantity(all.batch, i, 0), 1 - steps(k, rows[i]), 1e-7);
        CHECK_NEAR(kempe_ensemble_result_quantity(all.batch, i, 1), steps(k - 1, rows[i]) + steps(k, rows[i]), 1e-7);
    }
    free_instances(&all);
    unload(&l);
}

/* A signal that turns 16 times in the time of its delay, recorded from steps as long: y' = sin(20 t - 100) cos(20 t).
 */
static void fast_signals(void)
{
    static const double rtols[] = {1e-6, 1e-8, 1e-10, 1e-12};
    loaded l = load_text("kempe: 1\nbodies: {disk: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: "
                         "0.01}}}\nstates: {d: {delay: sin(q(A)), time: 5}, y: {rate: d*cos(q(A))}}\n"
                         "start: {qd: {A: 20}}\nrun: {t_end: 10}\n");
    const double right = 0.5 * (5 * sin(-100) + (cos(100) - cos(300)) / 40);
    for (int k = 0; k < 4; k++) {
        kempe_trajectory *t = run_by(l.system, NULL, rtols[k]);
        const double *qd = kempe_trajectory_qd(t, kempe_trajectory_row_count(t) - 1);
        CHECK_NEAR(qd ? qd[2] : NAN, right, 20 * rtols[k]);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* A start value of a delay is the signal before, as a parameter of an ensemble too: y(1) = 1 - late. */
static void start_values(void)
{
    static const char *const names[] = {"state.late"};
    static const double rows[] = {1, 0.25};
    loaded l = load_text(STEPS "run: {t_end: 1, rtol: 1e-9}\n");
    instances all = run_instances(&l, 0, 1, names, 2, rows);
    CHECK_NEAR(end_rate(&all, 0, 1), 0, 1e-9);
    CHECK_NEAR(end_rate(&all, 1, 1), 0.75, 1e-9);
    free_instances(&all);
    unload(&l);
}

/* At rest a delayed signal is the signal. */
static void studies(void)
{
    loaded l = load_text("kempe: 1\nparameters: {k: 2}\n" BODY "states: {late: {delay: q(x), time: 0.5}}\n"
                         "forces: {f: {joint: x, force: 3 - k*late - q(x)}}\n");
    kempe_equilibrium *e = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, "q.x")), 1, 1e-12);
    CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, "state.late")), 1, 1e-12);
    kempe_table_free(table);
    CHECK_TEXT(kempe_equilibrium_stability(e, 0), "unstable");
    kempe_equilibrium_free(e);
    unload(&l);
}

/* s + a e^(-s) has no root on the right below a = pi/2, two up to 5 pi/2, then four; with the free mass zeros. */
static void stability(void)
{
    static const struct {
        const char *a, *free, *word;
        int growing;
    } cases[] = {{"1.57", "", "stable", 0},   {"1.572", "", "unstable", 2}, {"7.85", "", "unstable", 2},
                 {"7.86", "", "unstable", 4}, {"1", "#", "neutral", 0},     {"2", "#", "unstable", 2},
                 {"0.001", "", "stable", 0},  {"-1", "", "unstable", 1}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[600], growing[40];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nstates: {late: {delay: y, time: 1}, y: {rate: -(%s)*late}}\n" BODY
                       "%sforces: {f: {joint: x, force: -q(x) - 0.1*qd(x)}}\n",
                       cases[k].a, cases[k].free);
        (void)snprintf(growing, sizeof growing, "growing\": %d", cases[k].growing);
        loaded l = load_text(text);
        kempe_equilibrium *e = NULL;
        char *json = NULL;
        CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
        CHECK_TEXT(kempe_equilibrium_stability(e, 0), cases[k].word);
        CHECK(e && kempe_equilibrium_print(e, KEMPE_JSON, &json) == KEMPE_OK);
        CHECK(json && strstr(json, growing) != NULL);
        free(json);
        kempe_equilibrium_free(e);
        unload(&l);
    }
}

/* Many loops beside each other, whose roots are counted loop by loop: two for each of the first ones, four for the
 * last. */
static void stability_of_many(void)
{
    enum { MANY = 70 };
    static char text[16384], growing[40];
    size_t at = (size_t)snprintf(text, sizeof text, "kempe: 1\nstates:\n");
    for (int k = 0; k < MANY; k++)
        at += (size_t)snprintf(text + at, sizeof text - at,
                               "  late%d: {delay: y%d, time: 1}\n  y%d: {rate: -(%s)*late%d}\n", k, k, k,
                               k < MANY - 1 ? "2" : "7.86", k);
    (void)snprintf(text + at, sizeof text - at, BODY "forces: {f: {joint: x, force: -q(x) - 0.1*qd(x)}}\n");
    (void)snprintf(growing, sizeof growing, "growing\": %d", 2 * MANY + 2);
    loaded l = load_text(text);
    kempe_equilibrium *e = NULL;
    char *json = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    CHECK(e && kempe_equilibrium_print(e, KEMPE_JSON, &json) == KEMPE_OK);
    CHECK(json && strstr(json, growing) != NULL);
    free(json);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* 1/(k + g e^(-i w T) - w^2 + i w c), also of the delayed signal. */
static void response(void)
{
    loaded l = load_text("kempe: 1\ninputs: {f: {default: 0}}\n" BODY "states: {late: {delay: q(x), time: 0.5}}\n"
                         "forces: {f: {joint: x, force: f - 2*q(x) - 0.5*qd(x) - 1.2*late}}\n");
    kempe_response_options ask = {.inputs = "f", .outputs = "q(x),late", .frequencies = "0.05:2:5"};
    kempe_response *r = NULL;
    CHECK(l.system && kempe_response_new(l.system, &ask, &r) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(r && kempe_response_table(r, "rows", &table) == KEMPE_OK);
    for (int k = 0; k < kempe_table_row_count(table); k++) {
        const double degree = 3.14159265358979323846 / 180;
        double w = 360 * degree * kempe_table_number(table, k, 0), a[4];
        for (int i = 0; i < 4; i++)
            a[i] = kempe_table_number(table, k, 1 + i);
        double complex lag = cexp(-0.5 * I * w), exact = 1 / (2 + 1.2 * lag - w * w + 0.5 * I * w);
        CHECK_NEAR(cabs(a[0] * cexp(I * degree * a[1]) - exact), 0, 1e-13 * cabs(exact));
        CHECK_NEAR(cabs(a[2] * cexp(I * degree * a[3]) - exact * lag), 0, 1e-13 * cabs(exact));
    }
    CHECK(kempe_table_row_count(table) == 5);
    kempe_table_free(table);
    kempe_response_free(r);
    unload(&l);
}

static void refused(const char *law, const char *words)
{
    char text[1000];
    (void)snprintf(text, sizeof text, "kempe: 1\nstates: {u: {%s}}\n" BODY, law);
    load_rejected(text, words);
}

static void mistakes(void)
{
    refused("delay: q(x)", "state 'u' has no key 'time'");
    refused("delay: q(x), time: 0", "time of state 'u' is 0: it must be positive");
    refused("delay: q(x), time: 1 m", "expected s, got m");
    refused("delay: q(x), time: 1, before: q(x)", "not allowed here");
    refused("delay: q(x), time: 1, before: t, start: 1", "'before' and 'start' exclude each other");
    refused("delay: q(x), time: 1, sample: 1, before: t", "'before' and 'sample' exclude each other");
    refused("delay: u.signal, time: 1", "an operator or the end is expected here");
}

int main(void)
{
    TEST(polynomials);
    TEST(oscillator);
    TEST(common_parts);
    TEST(events_of_the_past);
    TEST(jumps);
    TEST(events);
    TEST(conditions);
    TEST(impacts);
    TEST(dense);
    TEST(stepper);
    TEST(fast_signals);
    TEST(ensemble);
    TEST(quantities);
    TEST(start_values);
    TEST(studies);
    TEST(response);
    TEST(stability);
    TEST(stability_of_many);
    TEST(mistakes);
    return check_report();
}
