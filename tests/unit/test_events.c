/* SPDX-License-Identifier: BSD-3-Clause */
/* Events of conditions on every formulation, against closed forms: a mass on a spring stop, a force that is switched
 * off, a pendulum and a crank between stops; friction that slides along its condition says so. */
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "testing.h"
#include <math.h>
#include <stdlib.h>

static int notes;

static void count_notes(void *user, kempe_level level, const char *line)
{
    (void)user;
    notes += level == KEMPE_LOG_INFO && strstr(line, "became") != NULL;
}

/* The exact value of the first coordinate in a row. NULL: not known. */
typedef void expected_fn(double t, double *q, double *qd);
/* The conserved quantity, when work is counted. */
typedef double energy_fn(double t, const double *q, const double *qd);

typedef struct watch {
    expected_fn *expected;
    energy_fn *energy;
    double error, first, drift, last;
    int rows;
} watch;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    watch *w = user;
    double x, v;
    (void)qdd, (void)lambda, (void)work;
    if (w->expected) {
        w->expected(t, &x, &v);
        w->error = fmax(w->error, fmax(fabs(q[0] - x), fabs(qd[0] - v)));
    }
    if (w->energy) {
        double e = w->energy(t, q, qd);
        w->first = w->rows == 0 ? e : w->first;
        w->drift = fmax(w->drift, fabs(e - w->first));
    }
    w->last = q[0];
    w->rows++;
    return 0;
}

enum { TIMES = 401 };

typedef struct method {
    const char *formulation, *form;
    double rtol, error;
} combination;

static const combination methods[] = {{"reduced", "integrated", 1e-13, 1e-9},
                                      {"reduced", "newton", 1e-13, 1e-9},
                                      {"projected", NULL, 1e-13, 1e-9},
                                      {"dae", "stabilized1", 1e-11, 1e-6}};
enum { WAYS = sizeof methods / sizeof *methods };

static kmp_run_report go(const loaded *s, const combination *method, double t_end, watch *w, kempe_status expected)
{
    double times[TIMES];
    kmp_run_report report;
    kmp_run_spec spec = {
        .formulation = method->formulation, .form = method->form, .rtol = method->rtol, .t_end = t_end, .times = times};
    for (int k = 0; k < TIMES; k++)
        times[k] = t_end * k / (TIMES - 1);
    spec.time_count = TIMES;
    CHECK(kmp_run_resolve(s->system, &spec) == KEMPE_OK);
    kempe_context_set_log(s->context, count_notes, NULL);
    notes = 0;
    kempe_status status = kmp_run(s->system, &spec, NULL, take_row, w, &report);
    CHECK(status == expected);
    if (status != KEMPE_OK && expected == KEMPE_OK)
        printf("  %s\n", report.reason ? report.reason : kempe_context_message(s->context));
    CHECK(notes == report.events);
    return report;
}

/* -- a mass on a spring stop ------------------------------------------------------------------------- */

static const double gravity = 9.81, stiffness = 4000, mass = 2, height = 0.5;

/* Falls, swings half a sine and a little more under its weight, flies. */
static void bounce(double t, double *q, double *qd)
{
    double w = sqrt(stiffness / mass), v = sqrt(2 * gravity * height), fall = v / gravity;
    double contact = 2 * (acos(-1.0) - atan(v * w / gravity)) / w, sag = gravity / (w * w);
    double s = t + fall, period = contact + 2 * fall; /* from a lift-off on */
    s -= period * floor(s / period);
    if (s <= 2 * fall) {
        *q = v * s - 0.5 * gravity * s * s;
        *qd = v - gravity * s;
    } else {
        double angle = w * (s - 2 * fall);
        *q = sag * (cos(angle) - 1) - v / w * sin(angle);
        *qd = -sag * w * sin(angle) - v * cos(angle);
    }
}

static double bounce_energy(double t, const double *q, const double *qd)
{
    double x = fmin(q[0], 0);
    (void)t;
    return (0.5 * mass * qd[0] * qd[0] + mass * gravity * q[0] + 0.5 * stiffness * x * x) / (mass * gravity * height);
}

static void a_mass_bounces(void)
{
    loaded s = load("tests/models/bounce.yaml");
    for (int k = 0; k < WAYS; k++) {
        watch w = {.expected = bounce, .energy = bounce_energy};
        kmp_run_report report = go(&s, &methods[k], 3, &w, KEMPE_OK);
        printf("  %-9s %-8s error %.1e energy %.1e events %ld steps %ld\n", methods[k].formulation,
               methods[k].form ? methods[k].form : "", w.error, w.drift, report.events, report.steps);
        CHECK(w.rows == TIMES && w.error < methods[k].error);
        CHECK(w.drift < (k < 3 ? 1e-10 : 1e-6));
        CHECK(report.events == 8);
    }
    unload(&s);
}

static bool is_one_step(const char *integrator)
{
    return strncmp(integrator, "dop", 3) == 0 || strncmp(integrator, "radau", 5) == 0 || strcmp(integrator, "erk") == 0;
}

/* Every formulation, form and integrator that go together: none may lose an event. Multistep methods start anew with
 * order 1 at each. */
static void every_way_bounces(void)
{
    loaded s = load("tests/models/bounce.yaml");
    kmp_method each;
    for (int k = 0; kmp_method_get(k, &each); k++) {
        double times[TIMES];
        watch w = {.expected = bounce, .energy = bounce_energy};
        kmp_run_report report;
        kmp_run_spec spec = {.formulation = each.formulation,
                             .form = each.form,
                             .integrator = each.integrator,
                             .rtol = 1e-8,
                             .t_end = 3,
                             .times = times,
                             .time_count = TIMES};
        for (int i = 0; i < TIMES; i++)
            times[i] = 3.0 * i / (TIMES - 1);
        CHECK(kmp_run_resolve(s.system, &spec) == KEMPE_OK);
        kempe_status status = kmp_run(s.system, &spec, NULL, take_row, &w, &report);
        printf("  %-9s %-8s %-8s error %.1e energy %.1e events %ld steps %ld %s\n", each.formulation, each.form,
               each.integrator, w.error, w.drift, report.events, report.steps, report.reason ? report.reason : "");
        CHECK(status == KEMPE_OK && report.events == 8);
        CHECK(w.error < (is_one_step(each.integrator) ? 1e-4 : 1e-3));
        CHECK(w.drift < 2e-5);
        kmp_free(report.reason);
    }
    unload(&s);
}

/* A law without conditions, so that steps run over its kink, at tolerances from 1e-5 to 1e-12, two a decade. A single
 * error at a kink depends on chance: means over tolerances show how far an integrator can be trusted, and its cost.
 * Located, an error is some 60 tolerances at every tolerance; crossed, 55 times that, for 2.3 times the work. */
static void location_is_what_does_it(void)
{
    loaded located = load("tests/models/bounce.yaml"), crossed = load("tests/models/bounce_kink.yaml");
    enum { TOLERANCES = 15, FINE = 8 };       /* the last seven are fine: 1e-9 to 1e-12 */
    double kept = 0, kept_fine = 0, gain = 0; /* logarithms of errors: located in tolerances, crossed by located */
    for (int k = 0; k < TOLERANCES; k++) {
        const combination method = {"reduced", "integrated", pow(10, -5 - 0.5 * k), 0};
        watch a = {.expected = bounce}, b = {.expected = bounce};
        kmp_run_report with = go(&located, &method, 3, &a, KEMPE_OK), without = go(&crossed, &method, 3, &b, KEMPE_OK);
        printf("  rtol %.1e located %.1e in %ld evaluations, crossed %.1e in %ld\n", method.rtol, a.error, with.rhs,
               b.error, without.rhs);
        CHECK(with.events == 8 && without.events == 0);
        CHECK((double)without.rhs > 1.5 * (double)with.rhs);
        kept += log(a.error / method.rtol) / TOLERANCES;
        kept_fine += k >= FINE ? log(a.error / method.rtol) / (TOLERANCES - FINE) : 0;
        gain += log(b.error / a.error) / TOLERANCES;
    }
    printf("  located %.0f tolerances, fine ones %.0f; crossed %.0f times that\n", exp(kept), exp(kept_fine),
           exp(gain));
    CHECK(exp(kept) < 200 && exp(kept_fine) < 200 && exp(gain) > 20);
    unload(&located);
    unload(&crossed);
}

/* The kink of min, max or abs in a force is located by one-step methods as a condition is: the same numbers to a few
 * bits, and nothing noted. Multistep methods run over it. A function with a limited domain, such as a root, is not held
 * beyond its kink.
 */
static void kinks_are_located(void)
{
    static const char *const laws[] = {"-k*min(q(S), 0)", "k*max(-q(S), 0)", "k*(abs(q(S)) - q(S))/2",
                                       "if(t < 9, -k*min(q(S), 0), 0)", "depth*k"};
    loaded condition = load("tests/models/bounce.yaml");
    const combination one_step = {"reduced", "integrated", 1e-9, 0}, many = {"dae", "stabilized1", 1e-7, 0};
    watch a = {.expected = bounce};
    kmp_run_report by_condition = go(&condition, &one_step, 3, &a, KEMPE_OK);
    for (size_t k = 0; k < sizeof laws / sizeof *laws; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 4000, m: 2}\n"
                       "algebraic: {low: \"min(q(S), 0)\", depth: -low}\n"
                       "bodies: {ball: {joint: {name: S, prismatic: y, at: ground}, mass: m}}\n"
                       "forces: {stop: {joint: S, force: \"%s\"}}\nstart: {q: {S: 0.5}}\nrun: {t_end: 3}\n",
                       laws[k]);
        loaded s = load_text(text);
        watch b = {.expected = bounce}, c = {.expected = bounce};
        kmp_run_report by_kink = go(&s, &one_step, 3, &b, KEMPE_OK), over = go(&s, &many, 3, &c, KEMPE_OK);
        printf("  %-30s error %.1e in %ld evaluations, by a condition %.1e in %ld\n", laws[k], b.error, by_kink.rhs,
               a.error, by_condition.rhs);
        CHECK(by_kink.events == 0 && over.events == 0);
        CHECK(b.error < 1.01 * a.error + 1e-12 && labs(by_kink.rhs - by_condition.rhs) < by_condition.rhs / 50);
        unload(&s);
    }
    unload(&condition);
}

static const char *const one_step[] = {"dop853", "dopri5", "radau5", "radau9", "erk", "dirk"};

static kempe_trajectory *slides(const char *force, const char *integrator, loaded *l)
{
    char text[512];
    kempe_trajectory *t = NULL;
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nbodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {f: {joint: x, force: \"%s\"}}\nstart: {q: {x: 1}}\n"
                   "run: {t_end: 0.04, output_step: 0.0005}\n",
                   force);
    *l = load_text(text);
    const kempe_run_options run = {.no_convergence_check = 1, .integrator = integrator, .rtol = 1e-10, .atol = 1e-10};
    CHECK(l->system && kempe_simulate(l->system, &run, &t) == KEMPE_OK);
    return t;
}

/* The steps of a mass for 20 s, and its end: with a law, and with entries under `algebraic`. */
static kmp_run_report moves(const char *algebraic, const char *force, const char *formulation, const char *integrator,
                            double *q)
{
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\n"
                   "tables: {soft: {x: [-2, -0.2, 0.1, 2], y: [-8, -1.2, 0.3, 30], method: linear}}\n"
                   "algebraic:\n  unused: 0\n%s"
                   "bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                   "forces: {f: {joint: x, force: \"%s\"}}\nstart: {q: {x: 0.3}, qd: {x: 0.2}}\n",
                   algebraic, force);
    loaded l = load_text(text);
    double end = 20;
    kmp_run_report report = {0};
    watch w = {0};
    kmp_run_spec spec = {.formulation = formulation,
                         .integrator = integrator,
                         .rtol = 1e-8,
                         .t_end = end,
                         .times = &end,
                         .time_count = 1};
    CHECK(l.system && kmp_run_resolve(l.system, &spec) == KEMPE_OK &&
          kmp_run(l.system, &spec, NULL, take_row, &w, &report) == KEMPE_OK);
    *q = w.last;
    kmp_free(report.reason);
    unload(&l);
    return report;
}

/* Kinks in the equations of implicit variables cost no more steps than the same kinks in the force: of a place, of a
 * variable of the group itself, of a group in another, of a rate, of a table; beside a function with a limited domain,
 * which is not held beyond its kink, and where a branch has no solution beyond it. */
static void kinks_of_implicit_variables_are_located(void)
{
    static const struct {
        const char *force, *algebraic, *by_name;
        double more; /* steps and rejected steps, of those with the kink in the force */
    } pairs[] = {
        {"-3*q(x) - 60*max(q(x) - 0.1, 0)", "  g: {of: {e: 0}, zero: \"e - max(q(x) - 0.1, 0)\"}\n", "-3*q(x) - 60*e",
         0.02},
        {"-3*q(x) - 60*max(q(x) - 0.1, 0)",
         "  h: {of: {d: 0}, zero: d - q(x) + 0.1}\n  g: {of: {e: 0}, zero: \"e - max(d, 0)\"}\n", "-3*q(x) - 60*e",
         0.02},
        {"-40*q(x) + 40*(max(q(x), 0)*40/(40 + 70 + 20) + min(q(x), 0)*40/(40 + 20))",
         "  g: {of: {c: 0}, zero: \"40*(q(x) - c) - 70*max(c, 0) - 20*c\"}\n", "-40*(q(x) - c)", 0.02},
        {"-30*q(x) - 5*qd(x)*abs(qd(x)) + sin(3*t)", "  g: {of: {d: 0}, zero: d - 5*qd(x)*abs(qd(x))}\n",
         "-30*q(x) - d + sin(3*t)", 0.02},
        {"-soft(q(x))", "  g: {of: {y: 0, f: 0}, zero: [f - soft(y), y - q(x)]}\n", "-f", 0.02},
        {"-3*q(x) - 60*max(q(x) - 0.1, 0)^1.5",
         "  g: {of: {e: 0, f: 0}, zero: [\"e - max(q(x) - 0.1, 0)\", f - 60*e^1.5]}\n", "-3*q(x) - f", 0.1},
        {"-2*q(x)/(1e-3 + sqrt(1e-6 + 4*abs(q(x))))", "  g: {of: {c: 1}, zero: c*abs(c) + 1e-3*c - q(x)}\n", "-c",
         0.25},
    };
    static const char *const ways[][2] = {{"reduced", "dop853"}, {"reduced", "dopri5"},  {"reduced", "radau"},
                                          {"reduced", "radau5"}, {"reduced", "erk"},     {"reduced", "dirk"},
                                          {"dae", "radau"},      {"projected", "dop853"}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
            double q[2];
            kmp_run_report a = moves("", pairs[i].force, ways[k][0], ways[k][1], &q[0]);
            kmp_run_report b = moves(pairs[i].algebraic, pairs[i].by_name, ways[k][0], ways[k][1], &q[1]);
            const long few = 2 + lround(pairs[i].more * (double)a.steps);
            if (b.steps > a.steps + few || b.rejected > a.rejected + few || k == 0)
                printf("  %zu %s, %s: %ld steps, %ld rejected; %ld, %ld in the force\n", i, ways[k][0], ways[k][1],
                       b.steps, b.rejected, a.steps, a.rejected);
            CHECK(b.steps <= a.steps + few && b.rejected <= a.rejected + few && b.events == a.events);
            CHECK_NEAR(q[1], q[0], 1e-5);
        }
}

/* Quadratic drag, v' = 1 - v^2 from rest to t1, then v' = -1 - v |v|; v = 0 at t0. */
static void drag(double t, double *v, double *vd)
{
    const double t1 = 0.01, c = atan(tanh(t1)), t0 = t1 + c;
    *v = t <= t1 ? tanh(t) : t <= t0 ? tan(c - (t - t1)) : -tanh(t - t0);
    *vd = t <= t1 ? 1 - *v * *v : -1 - *v * fabs(*v);
}

/* The kink has no branch at rest. An event interrupts the first step, in which it gets none; the next step passes it:
 * velocities and accelerations of the rows would be off by 7e-7 and 2e-4. */
static void an_event_comes_before_a_kink(void)
{
    for (size_t i = 0; i < sizeof one_step / sizeof *one_step; i++) {
        loaded l;
        kempe_trajectory *t = slides("if(t < 0.01, 1, -1) - qd(x)*abs(qd(x))", one_step[i], &l);
        for (int k = 0; t && k < kempe_trajectory_row_count(t); k++) {
            const double at = kempe_trajectory_time(t, k);
            double v, vd;
            drag(at, &v, &vd);
            CHECK_NEAR(kempe_trajectory_qd(t, k)[0], v, 1e-9);
            if (fabs(at - 0.01) > 1e-9)
                CHECK_NEAR(kempe_trajectory_qdd(t, k)[0], vd, 1e-9);
        }
        kempe_trajectory_free(t);
        unload(&l);
    }
}

/* From rest over the kink in the first step, beside the same law with a condition: accelerations would be off by 9e-6.
 */
static void a_first_step_passes_a_kink(void)
{
    for (size_t i = 0; i < sizeof one_step / sizeof *one_step; i++) {
        loaded l[2];
        kempe_trajectory *a = slides("1 - 400*t - 3*qd(x)*abs(qd(x))", one_step[i], &l[0]);
        kempe_trajectory *b = slides("1 - 400*t - if(qd(x) > 0, 3, -3)*qd(x)^2", one_step[i], &l[1]);
        for (int k = 0; a && b && k < kempe_trajectory_row_count(a); k++)
            CHECK_NEAR(kempe_trajectory_qdd(a, k)[0], kempe_trajectory_qdd(b, k)[0], 2e-7);
        kempe_trajectory_free(a);
        kempe_trajectory_free(b);
        unload(&l[0]);
        unload(&l[1]);
    }
}

/* The first step after an event, as long as those before it, passes a kink that has no branch: erk makes it again. The
 * rates would differ by 8e-7 from those of the same law with a condition. */
static void a_step_after_an_event_passes_a_kink(void)
{
    static const char *const laws[] = {"-3*qd(x)*abs(qd(x))", "-if(qd(x) > 0, 3, -3)*qd(x)^2"};
    loaded l[2];
    kempe_trajectory *t[2] = {NULL};
    for (int k = 0; k < 2; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nbodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\nforces: {f: "
                       "{joint: x, force: \"if(t < 0.5, 0, 1 - 400*(t - 0.5)) %s\"}}\n"
                       "run: {t_end: 0.52, output_step: 0.001, rtol: 1e-6, integrator: erk}\n",
                       laws[k]);
        l[k] = load_text(text);
        const kempe_run_options run = {.no_convergence_check = 1};
        CHECK(l[k].system && kempe_simulate(l[k].system, &run, &t[k]) == KEMPE_OK);
    }
    for (int k = 0; t[0] && t[1] && k < kempe_trajectory_row_count(t[0]); k++)
        CHECK_NEAR(kempe_trajectory_qd(t[0], k)[0], kempe_trajectory_qd(t[1], k)[0], 1e-10);
    for (int k = 0; k < 2; k++) {
        kempe_trajectory_free(t[k]);
        unload(&l[k]);
    }
}

/* A motion that comes to rest on kinks passes them within the errors of steps, and goes on with the steps of a smooth
 * one. */
static void rest_on_a_kink_costs_no_steps(void)
{
    static const char *const laws[] = {"-100*q(S) - 20*qd(S)",
                                       "-100*q(S) - 20*qd(S) - 0.5*qd(S)*abs(qd(S)) - 30*max(q(S), 0)"};
    static const char *const integrators[] = {"dop853", "dopri5", "radau5", "radau"};
    for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
        kmp_run_report report[2];
        for (int k = 0; k < 2; k++) {
            char text[512];
            double end = 1000;
            watch w = {0};
            (void)snprintf(text, sizeof text,
                           "kempe: 1\nbodies: {ball: {joint: {name: S, prismatic: y, at: ground}, mass: 1}}\n"
                           "forces: {f: {joint: S, force: \"%s\"}}\nstart: {q: {S: -1}}\nrun: {t_end: 1000}\n",
                           laws[k]);
            loaded s = load_text(text);
            kmp_run_spec spec = {
                .integrator = integrators[i], .rtol = 1e-8, .t_end = end, .times = &end, .time_count = 1};
            CHECK(kmp_run_resolve(s.system, &spec) == KEMPE_OK);
            CHECK(kmp_run(s.system, &spec, NULL, take_row, &w, &report[k]) == KEMPE_OK);
            kmp_free(report[k].reason);
            unload(&s);
        }
        printf("  %s: %ld steps without kinks, %ld with\n", integrators[i], report[0].steps, report[1].steps);
        CHECK(report[1].steps < 2 * report[0].steps + 100);
    }
}

/* -- conditions on time, on rates, within each other -------------------------------------------------- */

/* A unit mass without gravity: force 3 until t = 1, then 3 against the motion while it is faster than 1. */
static void braked(double t, double *q, double *qd)
{
    double s = t - 1;
    if (t <= 1) {
        *q = 1.5 * t * t;
        *qd = 3 * t;
    } else if (s <= 2.0 / 3) {
        *q = 1.5 + 3 * s - 1.5 * s * s;
        *qd = 3 - 3 * s;
    } else {
        *q = 1.5 + 2 - 2.0 / 3 + (s - 2.0 / 3);
        *qd = 1;
    }
}

static void a_mass_is_braked(void)
{
    loaded s = load("tests/models/braked.yaml");
    for (int k = 0; k < WAYS; k++) {
        watch w = {.expected = braked};
        kmp_run_report report = go(&s, &methods[k], 4, &w, KEMPE_OK);
        printf("  %-9s %-8s error %.1e events %ld steps %ld\n", methods[k].formulation,
               methods[k].form ? methods[k].form : "", w.error, report.events, report.steps);
        CHECK(w.error < methods[k].error);
        CHECK(report.events == 3); /* faster than 1, time, slower than 1 */
    }
    unload(&s);
}

/* -- a pendulum between stops -------------------------------------------------------------------------- */

static double pendulum_energy(double t, const double *q, const double *qd)
{
    double right = fmax(q[0] - 0.3, 0), left = fmax(-0.5 - q[0], 0);
    (void)t;
    return 0.5 * qd[0] * qd[0] - gravity * cos(q[0]) + 0.5 * 2e4 * right * right + 0.5 * 500 * left * left;
}

static void a_pendulum_meets_stops(void)
{
    loaded s = load("tests/models/pendulum_stops.yaml");
    long events = 0;
    for (int k = 0; k < WAYS; k++) {
        watch w = {.energy = pendulum_energy};
        kmp_run_report report = go(&s, &methods[k], 5, &w, KEMPE_OK);
        printf("  %-9s %-8s energy %.1e events %ld steps %ld\n", methods[k].formulation,
               methods[k].form ? methods[k].form : "", w.drift, report.events, report.steps);
        CHECK(w.drift < (k < 3 ? 1e-10 : 1e-6));
        events = k == 0 ? report.events : events;
        CHECK(report.events == events && events > 10);
    }
    unload(&s);
}

/* -- a loop ------------------------------------------------------------------------------------------- */

/* Slider and crank agree on every formulation, with events while the loop is closed. */
static double last_q[WAYS];
static int at_way;

static int take_last(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                     double work)
{
    (void)user, (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    last_q[at_way] = q[0];
    return 0;
}

static void a_loop_meets_a_stop(void)
{
    loaded s = load("tests/models/slider_stop.yaml");
    const double t_end = 2;
    for (at_way = 0; at_way < WAYS; at_way++) {
        kmp_run_report report;
        kmp_run_spec spec = {.formulation = methods[at_way].formulation,
                             .form = methods[at_way].form,
                             .rtol = methods[at_way].rtol,
                             .t_end = t_end,
                             .time_count = 1,
                             .times = &t_end};
        CHECK(kmp_run_resolve(s.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(s.system, &spec, NULL, take_last, NULL, &report) == KEMPE_OK);
        if (report.reason)
            printf("  %s\n", report.reason);
        printf("  %-9s %-8s q %.15g events %ld steps %ld\n", methods[at_way].formulation,
               methods[at_way].form ? methods[at_way].form : "", last_q[at_way], report.events, report.steps);
        CHECK(report.events >= 4);
        CHECK_NEAR(last_q[at_way], last_q[0], at_way < 3 ? 1e-9 : 1e-6);
        kmp_free(report.reason);
    }
    unload(&s);
}

/* -- a change of formulation ---------------------------------------------------------------------------------- */

/* While it stays a parallelogram it is one crank of inertia 0.155 under 0.6 m of weight; the motor's work is a saw. */
static double parallelogram_energy(double t, const double *q, const double *qd)
{
    (void)t;
    return 0.5 * 0.155 * qd[0] * qd[0] + 0.6 * gravity * sin(q[0]) - fabs(remainder(q[0] - 0.5, 2 * acos(-1)));
}

/* Events go on being counted and held where the zone takes over and hands back. */
static void events_between_change_points(void)
{
    loaded s = load("tests/models/parallelogram_switch.yaml");
    long events = 0;
    for (int k = 0; k < WAYS; k++) {
        watch w = {.energy = parallelogram_energy};
        kmp_run_report report = go(&s, &methods[k], 2, &w, KEMPE_OK);
        printf("  %-9s %-8s energy %.1e of %.1f events %ld\n", methods[k].formulation,
               methods[k].form ? methods[k].form : "", w.drift, w.first, report.events);
        CHECK(report.events >= 6);
        CHECK(k == 0 || report.events == events);
        CHECK(w.drift < 8 * 5e-7 * w.first); /* eight passages of the zone */
        events = report.events;
        kmp_free(report.reason);
    }
    unload(&s);
}

/* -- what cannot be passed ----------------------------------------------------------------------------- */

static void sliding_is_named(void)
{
    loaded s = load("tests/models/friction.yaml");
    for (int k = 0; k < WAYS; k++) {
        watch w = {0};
        kmp_run_report report = go(&s, &methods[k], 4, &w, KEMPE_E_FAILED);
        CHECK(report.reason && strstr(report.reason, "'rub': qd(S) < 0 changes back and forth at t = 2"));
        if (report.reason)
            printf("  %s\n", report.reason);
        kmp_free(report.reason);
    }
    unload(&s);
}

/* From rest friction holds a loop at once. */
static void sliding_from_rest_is_named(void)
{
    loaded s = load("tests/models/friction_loop.yaml");
    for (int k = 0; k < WAYS; k++) {
        watch w = {0};
        kmp_run_report report = go(&s, &methods[k], 2, &w, KEMPE_E_FAILED);
        CHECK(report.reason && strstr(report.reason, "'rub': qd(A) < 0 changes back and forth"));
        CHECK(report.t < 1e-12);
        kmp_free(report.reason);
    }
    unload(&s);
}

/* A kink, and a condition, that differ from the end of the run by rounding. */
static void kinks_at_the_end(void)
{
    static const char *const laws[] = {"max(y - e, 0)", "abs(y - e)", "min(y, e)", "max(q(b) - e, 0)",
                                       "if(y > e, 1, 0)"};
    static const double ends[] = {0.1, 0.7, 1, 2, 3, 7.3};
    for (size_t k = 0; k < sizeof laws / sizeof *laws; k++)
        for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
            char text[512];
            (void)snprintf(text, sizeof text,
                           "kempe: 1\nstates: {y: {rate: 1}}\nbodies:\n"
                           "  a: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                           "  b: {joint: {prismatic: x, at: ground}, mass: 1}\nstart: {qd: {b: 1}}\n"
                           "parameters: {e: %g}\nforces: {f: {joint: a, force: \"%s\"}}\nrun: {t_end: %g}\n",
                           ends[i], laws[k], ends[i]);
            loaded s = load_text(text);
            kempe_trajectory *trajectory = NULL;
            CHECK(s.system && kempe_simulate(s.system, &(kempe_run_options){0}, &trajectory) == KEMPE_OK);
            kempe_trajectory_free(trajectory);
            unload(&s);
        }
}

int main(void)
{
    TEST(kinks_at_the_end);
    TEST(a_mass_bounces);
    TEST(every_way_bounces);
    TEST(location_is_what_does_it);
    TEST(kinks_are_located);
    TEST(kinks_of_implicit_variables_are_located);
    TEST(an_event_comes_before_a_kink);
    TEST(a_first_step_passes_a_kink);
    TEST(a_step_after_an_event_passes_a_kink);
    TEST(rest_on_a_kink_costs_no_steps);
    TEST(a_mass_is_braked);
    TEST(a_pendulum_meets_stops);
    TEST(a_loop_meets_a_stop);
    TEST(events_between_change_points);
    TEST(sliding_is_named);
    TEST(sliding_from_rest_is_named);
    return check_report();
}
