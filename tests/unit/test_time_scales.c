/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: ensemble */
/* Pulses in functions of time and of the motion, much shorter than the steps of a calm motion: the impulse is that of
 * the integral, on every formulation and integrator. Functions without short intervals have none. */
#include "backend/time_scales.h"
#include "base/memory.h"
#include "instances.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "platform/platform.h"
#include <math.h>

static double last_rate;

static int take_last(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                     double work)
{
    (void)user, (void)t, (void)q, (void)qdd, (void)lambda, (void)work;
    last_rate = qd[0];
    return 0;
}

static loaded pulsed(const char *force)
{
    char text[512];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nparameters: {c: 5.0123, w: 0.01}\ntables: {f: {x: [0, 2, 7, 7.001, 7.002, 7.003, 7.004, "
                   "8, 9, 10], y: [0, 0, 0, 0, 1000, 0, 0, 0, 0, 0], method: linear}, "
                   "p: {x: [0, 0.31, 0.72, 1.1], y: [0, 1, -0.5, 0], periodic: yes}}\n"
                   "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {f: {joint: x, force: \"%s\"}}\nrun: {t_end: 10}\n",
                   force);
    return load_text(text);
}

static const struct {
    const char *formulation, *integrator;
} ways[] = {{"reduced", "dop853"}, {"reduced", "dopri5"}, {"reduced", "radau"}, {"reduced", "radau5"},
            {"reduced", "radau9"}, {"reduced", "bdf"},    {"reduced", "adams"}, {"reduced", "erk"},
            {"reduced", "dirk"},   {"projected", NULL},   {"dae", "ida"},       {"dae", "radau"}};

/* The rate of the slider at the end of a run by one method; `longest`: its longest step, 0: any. */
static double rate_of(const loaded *l, size_t way, double end, double longest)
{
    kmp_run_report report = {0};
    kmp_run_spec spec = {.formulation = ways[way].formulation,
                         .integrator = ways[way].integrator,
                         .rtol = 1e-9,
                         .max_step = longest,
                         .t_end = end,
                         .time_count = 1,
                         .times = &end};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l->system, &spec, NULL, take_last, NULL, &report) == KEMPE_OK);
    kmp_free(report.reason);
    return last_rate;
}

static void impulses(void)
{
    const double root = sqrt(acos(-1));
    const struct {
        const char *force;
        double impulse;
    } pulses[] = {{"exp(-((t - c)/w)^2)/w", root},
                  {"exp(-((t - c)/1e-4)^2)/1e-4 + 0.1*sin(3*t)", root + 0.1 * (1 - cos(30)) / 3},
                  {"(exp(-((t - c)/w)^2) + exp(-((t - 2.3)/(3*w))^2))/w*(1 + 0*q(x))", 4 * root},
                  {"1/(1 + ((t - c)/w)^2)/w", atan(4.9877 / 0.01) + atan(5.0123 / 0.01)},
                  {"(1 - tanh((t - c)/w)^2)/w", 2},
                  {"f(t)", 1}};
    for (size_t k = 0; k < sizeof pulses / sizeof *pulses; k++) {
        loaded l = pulsed(pulses[k].force);
        for (size_t i = 0; l.system && i < sizeof ways / sizeof *ways; i++)
            CHECK_NEAR(rate_of(&l, i, 10, i % 2 ? 20 : 0), pulses[k].impulse, 2e-6); /* 20 is no limit */
        unload(&l);
    }
}

/* Narrow hills of force at a place, at a place that moves, and at a rate: the square of the rate follows from the area,
 * the impulse from the integral over the rate. */
static void hills(void)
{
    const double root = sqrt(acos(-1));
    const struct {
        const char *law;
        double start, end, rate;
    } cases[] = {
        {"exp(-((q(x) - c)/w)^2)/w", 1, 12, sqrt(1 + 2 * root)},
        {"exp(-((q(x) - c)/1e-5)^2)/1e-5", 1, 12, sqrt(1 + 2 * root)},
        {"-0.2*(exp(-((q(x) - c)/w)^2) + exp(-((q(x) - 5.1)/w)^2))/w", 1, 12, -1}, /* thrown back by the second */
        {"exp(-((q(x) - 3*t + 2)/w)^2)/w", 1, 3, 3 - sqrt(4 - 2 * root)},
        {"(1 - tanh((q(x) - c)/w)^2)/w", 1, 12, sqrt(1 + 4)},
        {"1/cosh((q(x) - c)/0.2)^2/0.2", 1, 12, sqrt(1 + 4)}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nparameters: {c: 4.3217, w: 0.004}\n"
                       "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                       "forces: {f: {joint: x, force: \"%s\"}}\nstart: {qd: {x: %.17g}}\nrun: {t_end: 10}\n",
                       cases[k].law, cases[k].start);
        loaded l = load_text(text);
        for (size_t i = 0; l.system && i < sizeof ways / sizeof *ways; i++)
            CHECK_NEAR(rate_of(&l, i, cases[k].end, 0), cases[k].rate, 4e-6);
        unload(&l);
    }
}

/* Functions that change everywhere alike, or slowly, need no limit of steps. */
static void no_pulses(void)
{
    static const char *const forces[] = {"sin(300*t)", "exp(sin(3*t))", "exp(-0.3*t)",
                                         "t^4 - 3*t",  "1/(1 + t)",     "sqrt(1 + t^2)",
                                         "p(t)",       "1e5 + exp(-t)", "sqrt(cos(7*t)^2 + sin(7*t)^2)"};
    for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
        loaded l = pulsed(forces[k]);
        CHECK(l.model && !(kmp_time_scales_shortest(l.model) > 0));
        unload(&l);
    }
}

static void ends(void)
{
    loaded l = pulsed("exp(-((t - c)/w)^2)/w");
    const double parameters[] = {5.0123, 0.01};
    kmp_time_scales scales;
    kmp_arena arena = {0};
    CHECK(kmp_time_scales_find(l.model, parameters, 0, 10, KMP_TIMED_SHORT, &arena, &scales) == KEMPE_OK);
    CHECK(scales.count > 10 && scales.count < 100 && scales.shortest < 0.02 && !scales.open);
    CHECK(kmp_time_scales_end(&scales, 0) > 0.5 && kmp_time_scales_end(&scales, 0) <= 5);
    CHECK(kmp_time_scales_end(&scales, 5.0123) < 5.0123 + 0.02);
    CHECK(isinf(kmp_time_scales_end(&scales, 10)));
    kmp_arena_free(&arena);
    unload(&l);
}

/* Of all functions, those that jump at a comparison have no interval of the size of the jump. */
static void jumps_have_no_interval(void)
{
    static const char *const forces[] = {"if(t < c, 1, sin(t))",  "if(t <= c, 1, sin(t))", "if(t > c, 1, sin(t))",
                                         "if(t >= c, 1, sin(t))", "sin(t)*sign(t - c)",    "q(x)*if(t > c, 1, 2)"};
    const double parameters[] = {5.0123, 0.01};
    for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
        loaded l = pulsed(forces[k]);
        kmp_time_scales scales;
        kmp_arena arena = {0};
        CHECK(kmp_time_scales_find(l.model, parameters, 0, 10, KMP_TIMED_ALL, &arena, &scales) == KEMPE_OK);
        CHECK(scales.shortest > 0.01);
        kmp_arena_free(&arena);
        unload(&l);
    }
}

/* Pulses of functions of time that have a name, of signals with a delay, and of inputs that
 * pass a place. */
static void pulses_elsewhere(void)
{
    static const struct {
        const char *parts, *law;
        double impulse; /* over the root of pi */
    } cases[] = {{"algebraic: {z: t - 5.03}\n", "exp(-(z/w)^2)/w", 1},
                 {"algebraic: {y: t - 5.03, z: y/w}\n", "exp(-z^2)/w", 1},
                 {"states: {v: {delay: 'exp(-((t - 5.03)/w)^2)/w', time: 2}}\n", "v", 1},
                 {"states: {v: {delay: '0*t', time: 7, before: 'exp(-((t + 2.03)/w)^2)/w'}}\n", "v", 1},
                 {"inputs: {u: {t: [0, 10], value: [-1.03, 1], method: linear}}\n", "exp(-(u/w)^2)/w", 10 / 2.03},
                 {"inputs: {u: {t: [0, 10], value: [-1.03, 1], method: linear}}\nalgebraic: {z: u/w}\n", "exp(-z^2)/w",
                  10 / 2.03}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nparameters: {w: 0.001}\n%sbodies: {a: {joint: {name: x, prismatic: x, at: ground}, "
                       "mass: 1}}\nforces: {f: {joint: x, force: \"%s\"}}\nrun: {t_end: 10}\n",
                       cases[k].parts, cases[k].law);
        loaded l = load_text(text);
        for (size_t i = 0; l.system && i < sizeof ways / sizeof *ways; i++)
            CHECK_NEAR(rate_of(&l, i, 10, 0), sqrt(acos(-1)) * cases[k].impulse, 1e-3);
        unload(&l);
    }
}

/* The length of a rope that is shorter for some milliseconds. */
static void a_rope_is_pulled(void)
{
    loaded l =
        load_text("kempe: 1\nparameters: {w: 0.001}\nground: {points: {Q: [-1, 0, 0]}}\n"
                  "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1e6, points: {P: [0, 0, 0]}}}\n"
                  "ropes: {r: {along: [ground.Q, a.P], length: '1 - 0.01*exp(-((t - 5.03)/w)^2)', stiffness: 1e6}}\n"
                  "run: {t_end: 10}\n");
    for (size_t i = 0; l.system && i < sizeof ways / sizeof *ways; i++)
        CHECK_NEAR(rate_of(&l, i, 10, 0), -1e4 * 0.001 * sqrt(acos(-1)) / 1e6, 1e-8);
    unload(&l);
}

/* Instances whose pulses are much narrower than the pulse of the model: each has its impulse. */
static void pulses_of_instances(void)
{
    const double width[] = {1, 0.1, 0.01, 0.001, 1, 0.05};
    enum { WIDTHS = sizeof width / sizeof *width };
    static const char *const names[] = {"w"};
    loaded l = load_text("kempe: 1\nparameters: {c: 5.0123, w: 1}\n"
                         "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: x, force: \"exp(-((t - c)/w)^2)/w\"}}\nrun: {t_end: 10}\n");
    for (int lanes = -1; lanes <= 4; lanes += lanes < 0 ? 2 : 3) {
        instances all = run_instances(&l, lanes, 1, names, WIDTHS, width);
        for (int k = 0; k < WIDTHS; k++)
            CHECK_NEAR(end_rate(&all, k, 0), sqrt(acos(-1)), 1e-7);
        free_instances(&all);
    }
    unload(&l);
}

/* More functions than are studied together: the pulse is in the last one. */
static void many_functions(void)
{
    char force[4000] = "0";
    size_t length = 1;
    for (int k = 0; k < 70; k++)
        length += (size_t)snprintf(force + length, sizeof force - length, " + q(x)*exp(-%d*t)", k);
    (void)snprintf(force + length, sizeof force - length, " + q(x)*0 + 1*(exp(-((t - c)/w)^2)/w)");
    char text[6000];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nparameters: {c: 5.0123, w: 0.01}\n"
                   "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {f: {joint: x, force: \"%s\"}}\nrun: {t_end: 10}\n",
                   force);
    loaded l = load_text(text);
    CHECK(l.model && kmp_time_scales_shortest(l.model) > 0 && kmp_time_scales_shortest(l.model) < 0.02);
    unload(&l);
}

/* Nothing is searched where a function has no values; and a search that finds neither bounds nor changes ends. */
static void searches_end(void)
{
    const double parameters[] = {5.0123, 0.01};
    static const struct {
        const char *force;
        bool open;
        long most; /* halvings */
    } cases[] = {{"sqrt(3.5 - t)", false, 1000},
                 {"sqrt(t - 3.5) + sqrt(6 - t)", false, 1000},
                 {"exp(1e9*sin(t) - 1e9*sin(t + 2*pi))", true, 1000000}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = pulsed(cases[k].force);
        kmp_arena arena = {0};
        kmp_time_scales scales;
        const double before = kmp_cpu_now();
        CHECK(kmp_time_scales_find(l.model, parameters, 0, 10, KMP_TIMED_SHORT, &arena, &scales) == KEMPE_OK);
        CHECK((scales.open != NULL) == cases[k].open && scales.halvings > 0 && scales.halvings <= cases[k].most);
        printf("  %s: %.2g s, %ld halvings, %d intervals%s\n", cases[k].force, kmp_cpu_now() - before, scales.halvings,
               scales.count, scales.open ? ", open" : "");
        kmp_arena_free(&arena);
        unload(&l);
    }
}

int main(void)
{
    TEST(impulses);
    TEST(hills);
    TEST(no_pulses);
    TEST(jumps_have_no_interval);
    TEST(pulses_elsewhere);
    TEST(a_rope_is_pulled);
    TEST(pulses_of_instances);
    TEST(ends);
    TEST(many_functions);
    TEST(searches_end);
    return check_report();
}
