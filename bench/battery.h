/* SPDX-License-Identifier: BSD-3-Clause */
/* The hard cases: for each one the model, how far and how finely it runs, and how its result is judged - by published
 * digits, by closed forms, or by a four-bar written out by hand in long double; never by another run of Kempe's. */
#ifndef KEMPE_BENCH_BATTERY_H
#define KEMPE_BENCH_BATTERY_H

#include "base/memory.h"
#include "base/text.h"
#include "bench/chain.h"
#include "bench/four_bar_by_hand.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "model/data/body.h"
#include "model/data/force.h"
#include "output/verdict.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef M_PI
#define M_PI 3.14159265358979323846
#endif

/* The expected result of a case on every formulation. */
typedef enum hard_end { HARD_RUNS, HARD_STOPS } hard_end;

#define HARD_ANY HUGE_VAL

/* Error of the rows of a run, by a rule of the case; `state` holds the start by its first row. */
typedef double hard_rule(const kempe_system *system, const kmp_samples *table, const kmp_evaluator *eval);

typedef struct hard_case {
    const char *name, *model; /* model: a file from the root, or the text of one, or "windows N" */
    const char *reference;    /* CSV from the root; then `rule` may be NULL */
    hard_rule *rule;
    double t_end;
    double rtol;            /* 0: 1e-11 */
    double bar, bar_dae;    /* errors allowed, by IDA; 0: 1e-8, 1e-5 */
    double energy;          /* drift allowed; 0: 1e-7; HARD_ANY: not judged */
    double t_dae, rtol_dae; /* 0: the same */
    hard_end end;
    bool slow;              /* not in the quick part */
    double known;           /* error of a known miss, times three: beyond it a miss is a failure; 0: none is known */
    const char *integrator; /* of the reduced formulation, closed; NULL: the usual one */
    kempe_setting set;
} hard_case;

typedef struct hard_formulation {
    const char *formulation, *form;
    const char *integrator; /* NULL: the usual one */
} hard_formulation;

static const hard_formulation hard_formulations[] = {{"reduced", "integrated", NULL},    {"reduced", "newton", NULL},
                                                     {"projected", "none", NULL},        {"dae", "stabilized1", NULL},
                                                     {"reduced", "integrated", "radau"}, {"projected", "none", "radau"},
                                                     {"dae", "index1", "radau"}};
/* Numbers of methods: by the usual integrators, and in all. */
enum { HARD_FORMULATIONS = 4, HARD_METHODS = 7, HARD_ROWS = 101 };

typedef struct hard_scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    int passages; /* of change points that the log spoke of */
} hard_scene;

/* -- models ------------------------------------------------------------------------------------------ */

/* A02: N square windows, angles from +x, at `angle` with rate `rate`. */
static char *hard_windows(int n, double angle, double rate)
{
    kmp_text t = {0};
    chain_put(&t, "windows", n, false);
    kmp_text_put(&t, "start:\n  q: {");
    for (int i = 0; i <= 2 * n; i++)
        kmp_text_printf(&t, "%s%c%d: %.17g", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1,
                        i <= n ? angle : -angle);
    kmp_text_put(&t, "}\n  qd: {");
    for (int i = 0; i <= 2 * n; i++) /* all of them: near a flat position they are ambiguous otherwise */
        kmp_text_printf(&t, "%s%c%d: %.17g", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1,
                        i <= n ? rate : -rate);
    kmp_text_put(&t, "}\n");
    return kmp_text_take(&t);
}

static void hard_listen(void *user, kempe_level level, const char *line)
{
    hard_scene *s = user;
    (void)level;
    s->passages += strstr(line, "change point") != NULL;
}

static kempe_status hard_read(hard_scene *s, const char *root, const hard_case *c)
{
    char path[512];
    int n;
    double angle = M_PI / 2, rate = -1;
    if (sscanf(c->model, "windows %d %lf %lf", &n, &angle, &rate) >= 1) {
        char *text = hard_windows(n, angle, rate);
        kempe_status status = kempe_model_read_text(s->context, text ? text : "", "windows", &s->model);
        kmp_free(text);
        return status;
    }
    if (strchr(c->model, '\n'))
        return kempe_model_read_text(s->context, c->model, c->name, &s->model);
    snprintf(path, sizeof path, "%s/%s", root, c->model);
    return kempe_model_read_set(s->context, path, &c->set, c->set.name != NULL, &s->model);
}

static void hard_unload(hard_scene *s)
{
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

/* false: the scene's message says why; free it all the same. The scene must stay where it is. */
static bool hard_load(hard_scene *s, const char *root, const hard_case *c)
{
    *s = (hard_scene){.context = kempe_context_new()};
    if (!s->context)
        return false;
    kempe_context_set_log(s->context, hard_listen, s);
    return hard_read(s, root, c) == KEMPE_OK && kempe_system_new(s->model, &s->system) == KEMPE_OK;
}

/* -- rules ------------------------------------------------------------------------------------------- */

static const double *hard_last(const kmp_samples *table)
{
    return kmp_samples_get(table, KMP_QUANTITY_Q, table->rows - 1);
}

static double hard_end_time(const kmp_samples *table)
{
    return kmp_samples_time(table, table->rows - 1);
}

static double hard_apart(double x, double y, double rx, double ry)
{
    return hypot(x - rx, y - ry);
}

/* A01's place at 10 or 2000 s. */
static double hard_pendulum_place(double t, double x, double y)
{
    return t > 11 ? hard_apart(x, y, 0.814603068589032166, -0.580018827836935442)
                  : hard_apart(x, y, -0.275087462576116860, -0.961419205099125064);
}

static double hard_pendulum(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    const double *q = hard_last(table);
    (void)s, (void)eval;
    return hard_pendulum_place(hard_end_time(table), -cos(q[0]), -sin(q[0]));
}

static double hard_pendulum_rod(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    const double *q = hard_last(table);
    (void)s, (void)eval;
    return hard_pendulum_place(hard_end_time(table), q[0], q[1]);
}

/* A02's exact reduction: the angle after a time, by Runge and Kutta in long double with half and whole steps. */
static long double hard_swing(int n, long double angle, long double rate, double time)
{
    enum { STEPS = 10000 }; /* off by 1e-10 of the angle */
    long double k = 9.81L * ((n + 1) / 2.0L + n) / ((n + 1) / 3.0L + n), h = (long double)time / STEPS;
    for (int i = 0; i < STEPS; i++) {
        long double a1 = -k * cosl(angle), a2 = -k * cosl(angle + h / 2 * rate);
        long double a3 = -k * cosl(angle + h / 2 * rate + h * h / 4 * a1), a4;
        a4 = -k * cosl(angle + h * rate + h * h / 2 * a2);
        angle += h * rate + h * h / 6 * (a1 + a2 + a3);
        rate += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    return angle;
}

/* Largest difference of any angle of the windows from it, relative to max(angle, 1); started as the first row says. */
static double hard_windows_rule(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    const double *q = hard_last(table), *q0 = kmp_samples_get(table, KMP_QUANTITY_Q, 0);
    int n = (s->n - 1) / 2;
    double rate = kmp_samples_get(table, KMP_QUANTITY_QD, 0)[0], worst = 0;
    double right = (double)hard_swing(n, q0[0], rate, hard_end_time(table));
    (void)eval;
    for (int i = 0; i < s->n; i++) { /* tree order: each v, then its h */
        bool upright = kmp_model_motion(s->model, i)->name[0] == 'a';
        worst = fmax(worst, fabs(q[i] - (upright ? right : -right)) / fmax(1, fabs(right)));
    }
    return worst;
}

/* Bricard: j1 = j3 = j5, j2 = j4, and the relation between them, in every row. */
static double hard_bricard(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    double worst = 0;
    (void)s, (void)eval;
    for (int k = 0; k < table->rows; k++) {
        const double *q = kmp_samples_get(table, KMP_QUANTITY_Q, k);
        worst = fmax(worst, fmax(fabs(q[0] - q[2]), fmax(fabs(q[0] - q[4]), fabs(q[1] - q[3]))));
        worst = fmax(worst, fabs(sin(q[0]) + sin(q[1]) + sin(q[0]) * sin(q[1])));
    }
    return worst;
}

/* Bennett: sin(j1/2) sin(j2/2) = K cos(j1/2) cos(j2/2), j3 = -j1, in every row. */
static double hard_bennett(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    double alpha = 40 * M_PI / 180, beta = 75 * M_PI / 180, worst = 0;
    double k = sin((beta + alpha) / 2) / sin((beta - alpha) / 2);
    (void)s, (void)eval;
    for (int row = 0; row < table->rows; row++) {
        const double *q = kmp_samples_get(table, KMP_QUANTITY_Q, row);
        double left = sin(q[0] / 2) * sin(q[1] / 2), right = k * cos(q[0] / 2) * cos(q[1] / 2);
        worst = fmax(worst, fmax(fabs(q[2] + q[0]), fabs(left - right) / k));
    }
    return worst;
}

static double hard_antiparallelogram(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    const double *q = hard_last(table);
    (void)s, (void)eval;
    double theta = fabs(q[0] - 1.2 + 20.4780898115) / fabs(q[0]);
    for (int k = 1; k < 3; k++)
        theta = fmax(theta, fabs(q[k] + 2.44089476166473 - 22.7229215014) / fabs(q[k]));
    return theta;
}

static double hard_fourbar2(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    const double *q = hard_last(table);
    (void)s, (void)eval;
    return fmax(fabs(q[0] / 40.2420250649953602 - 1), fabs(q[1] + 0.417541177807820895));
}

/* A four-bar whose crank starts at the angle and rate of the first row: its absolute angles by hand. */
static double hard_by_hand(by_hand f, const kmp_samples *table, double h)
{
    const double *q0 = kmp_samples_get(table, KMP_QUANTITY_Q, 0), *qd0 = kmp_samples_get(table, KMP_QUANTITY_QD, 0);
    const double *q = hard_last(table);
    double sum[3] = {1, 1, 1}, start[3] = {q0[0], q0[0] + q0[1], q0[2]}, got[3] = {q[0], q[0] + q[1], q[2]}, worst = 0;
    f.qd[0] = qd0[0];
    f.qd[1] = qd0[0] + qd0[1];
    f.qd[2] = qd0[2];
    for (int k = 0; k < 3; k++)
        f.q[k] = start[k] * sum[k];
    by_hand_run(&f, hard_end_time(table), h);
    for (int k = 0; k < 3; k++)
        worst = fmax(worst, fabs(got[k] - (double)f.q[k]) / fmax(1, fabs(got[k])));
    return worst;
}

static double hard_triple_rocker(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    by_hand f = {.length = {0.8L, 0.5L, 0.7L},
                 .com = {0.4L, 0.25L, 0.35L},
                 .mass = {1, 1, 1},
                 .inertia = {0.05L, 0.02L, 0.04L},
                 .base = 1.2L};
    (void)s, (void)eval;
    return hard_by_hand(f, table, 8e-4); /* its own error: 3e-11 */
}

static double hard_near(const kempe_system *s, const kmp_samples *table, double delta)
{
    by_hand f = {.length = {0.3L, 0.8L, 0.3L},
                 .com = {0.15L, 0.4L, 0.15L},
                 .mass = {1, 1, 1},
                 .inertia = {0.01L, 0.05L, 0.01L},
                 .base = 0.8L + delta};
    (void)s;
    return hard_by_hand(f, table, 2e-4); /* its own error: 3e-10 */
}

static double hard_near_3(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    (void)eval;
    return hard_near(s, table, 1e-3);
}

static double hard_near_6(const kempe_system *s, const kmp_samples *table, const kmp_evaluator *eval)
{
    (void)eval;
    return hard_near(s, table, 1e-6);
}

/* Error against the rigid four-bar times what the stiffness makes of it: 3 m k-fold of the error at 1e6. */
static const char hard_refuse_model[] =
    "kempe: 1\nname: slider at its dead centre\nparameters: {r: 0.2, l: 0.5}\nground: {points: {S: [r + l, 0, 0]}}\n"
    "bodies:\n  crank: {joint: {name: crank, revolute: z, at: ground}, mass: 1, inertia: {zz: r^2}, points: {A: [r, 0, "
    "0]}}\n"
    "  rod: {joint: {name: rod, revolute: z, at: crank.A}, mass: 1, inertia: {zz: l^2}, points: {P: [l, 0, 0]}}\n"
    "  slider: {joint: {name: slider, prismatic: x, at: ground.S}, mass: 1, points: {P: [0, 0, 0]}}\n"
    "loops: {P: {ball: [rod.P, slider.P]}}\ndrives: {push: {joint: slider, displacement: \"-0.1*t\"}}\n";

/* -- the cases --------------------------------------------------------------------------------------- */

#define HARD_EXAMPLE(folder)                                                                                           \
    .model = "examples/" folder "/" folder ".yaml", .reference = "examples/" folder "/reference.csv"

static const hard_case hard_cases[] = {
    {.name = "A01, 10 s", .model = "tests/models/pendulum.yaml", .rule = hard_pendulum, .t_end = 10},
    {.name = "A01, 2000 s",
     .model = "tests/models/pendulum.yaml",
     .rule = hard_pendulum,
     .t_end = 2000,
     .rtol = 1e-13,
     .bar = 1e-7,
     .energy = 1e-9,
     .t_dae = 10,
     .slow = true},
    {.name = "A01 on a rod, 10 s", .model = "tests/models/pendulum_rod.yaml", .rule = hard_pendulum_rod, .t_end = 10},
    {.name = "A01 on a rod, 2000 s",
     .model = "tests/models/pendulum_rod.yaml",
     .rule = hard_pendulum_rod,
     .t_end = 2000,
     .rtol = 1e-13,
     .bar = 1e-7,
     .energy = 1e-9,
     .t_dae = 10,
     .slow = true},
    {.name = "A02 N = 1", .model = "windows 1", .rule = hard_windows_rule, .t_end = 20, .bar = 1e-6},
    {.name = "A02 N = 2", .model = "windows 2", .rule = hard_windows_rule, .t_end = 20, .bar = 1e-6},
    {.name = "A02 N = 2, published", HARD_EXAMPLE("n_four_bar"), .t_end = 20, .bar = 2e-8},
    {.name = "A02 N = 40",
     .model = "windows 40",
     .rule = hard_windows_rule,
     .t_end = 20,
     .bar = 1e-6,
     .rtol_dae = 1e-8,
     .slow = true},
    {.name = "A04, 10 s", HARD_EXAMPLE("bricard"), .t_end = 10},
    {.name = "A04, 100 s", .model = "examples/bricard/bricard.yaml", .rule = hard_bricard, .t_end = 100},
    {.name = "A05", HARD_EXAMPLE("governor"), .t_end = 10, .energy = HARD_ANY, .slow = true},
    {.name = "A05 by BDF", HARD_EXAMPLE("governor"), .t_end = 10, .energy = HARD_ANY, .integrator = "bdf"},
    {.name = "spatial slider-crank", HARD_EXAMPLE("spatial_slider_crank"), .t_end = 5},
    {.name = "Fourbar2", .model = "tests/models/fourbar2.yaml", .rule = hard_fourbar2, .t_end = 5},
    {.name = "4.2 slider-crank", HARD_EXAMPLE("slider_crank"), .t_end = 10},
    {.name = "4.3 equal masses", HARD_EXAMPLE("four_bar"), .t_end = 5},
    {.name = "4.3 spatial joints",
     .model = "examples/four_bar/four_bar_spatial.yaml",
     .reference = "examples/four_bar/reference.csv",
     .t_end = 5},
    {.name = "4.3 masses 1e-6:1:1e6",
     .model = "examples/four_bar/four_bar_ill.yaml",
     .reference = "examples/four_bar/reference_ill.csv",
     .t_end = 5,
     .rtol_dae = 1e-10, /* at 1e-11 IDA's Newton method stops in rounding, and says so */
     .known = 3.3e-8},
    {.name = "Stewart", HARD_EXAMPLE("stewart"), .t_end = 1, .energy = HARD_ANY},
    {.name = "Bennett", .model = "tests/models/bennett_balls.yaml", .rule = hard_bennett, .t_end = 10},
    {.name = "Bennett driven", HARD_EXAMPLE("bennett"), .t_end = 10, .energy = HARD_ANY},
    {.name = "Peaucellier", HARD_EXAMPLE("peaucellier"), .t_end = 4, .energy = HARD_ANY},
    {.name = "Chebyshev", HARD_EXAMPLE("chebyshev"), .t_end = 8, .energy = HARD_ANY},
    {.name = "Jansen", HARD_EXAMPLE("jansen_leg"), .t_end = 4, .energy = HARD_ANY},
    {.name = "double wishbone", HARD_EXAMPLE("double_wishbone"), .t_end = 4, .energy = HARD_ANY},
    {.name = "bushing 1e6 N/m",
     .model = "tests/models/four_bar_bushing.yaml",
     .reference = "examples/four_bar/reference.csv",
     .t_end = 0.5,
     .rtol = 1e-9,
     .bar = 1e-2,
     .bar_dae = 1e-2,
     .energy = HARD_ANY,
     .set = {"k", "1e6"}},
    {.name = "bushing 1e8 N/m",
     .model = "tests/models/four_bar_bushing.yaml",
     .reference = "examples/four_bar/reference.csv",
     .t_end = 0.5,
     .rtol = 1e-9,
     .bar = 1e-4,
     .bar_dae = 1e-4,
     .energy = HARD_ANY,
     .set = {"k", "1e8"}},
    {.name = "bushing 1e10 N/m",
     .model = "tests/models/four_bar_bushing.yaml",
     .reference = "examples/four_bar/reference.csv",
     .t_end = 0.5,
     .rtol = 1e-10,
     .bar = 1e-6,
     .energy = HARD_ANY,
     .set = {"k", "1e10"},
     .slow = true},
    {.name = "1e-3 rad from flat", .model = "windows 2 1e-3 -1", .rule = hard_windows_rule, .t_end = 10, .bar = 1e-6},
    {.name = "1e-6 rad from flat", .model = "windows 2 1e-6 -1", .rule = hard_windows_rule, .t_end = 10, .bar = 1e-6},
    {.name = "1e-9 rad from flat", .model = "windows 2 1e-9 -1", .rule = hard_windows_rule, .t_end = 10, .bar = 1e-6},
    {.name = "1e-3 rad, at rest",
     .model = "windows 2 1e-3 0",
     .rule = hard_windows_rule,
     .t_end = 10,
     .bar = 1e-3,
     .bar_dae = 1e-3},
    {.name = "1e-6 rad, at rest",
     .model = "windows 2 1e-6 0",
     .rule = hard_windows_rule,
     .t_end = 10,
     .bar = 1e-3,
     .bar_dae = 1e-3},
    {.name = "1e-9 rad, at rest",
     .model = "windows 2 1e-9 0",
     .rule = hard_windows_rule,
     .t_end = 10,
     .bar = 1e-3,
     .bar_dae = 1e-3},
    {.name = "triple-rocker", .model = "tests/models/triple_rocker.yaml", .rule = hard_triple_rocker, .t_end = 3},
    {.name = "near change point 1e-3",
     .model = "tests/models/near_parallelogram.yaml",
     .rule = hard_near_3,
     .t_end = 1,
     .set = {"delta", "1e-3"}},
    {.name = "near change point 1e-6",
     .model = "tests/models/near_parallelogram.yaml",
     .rule = hard_near_6,
     .t_end = 1,
     .set = {"delta", "1e-6"}},
    {.name = "antiparallelogram",
     .model = "tests/models/antiparallelogram.yaml",
     .rule = hard_antiparallelogram,
     .t_end = 10,
     .bar = 1e-6},
    {.name = "lock", .model = "tests/models/locked_slider_crank.yaml", .t_end = 3, .rtol = 1e-9, .end = HARD_STOPS},
    {.name = "slider driven at dead centre", .model = hard_refuse_model, .t_end = 1, .rtol = 1e-9, .end = HARD_STOPS},
};
enum { HARD_CASES = sizeof hard_cases / sizeof *hard_cases };

/* -- one run ----------------------------------------------------------------------------------------- */

typedef struct hard_result {
    kempe_status status;
    kmp_run_report report; /* free its reason */
    double error, residual, drift;
    int passages;
    bool passed;
} hard_result;

static double hard_given(double value, double usual)
{
    return value > 0 ? value : usual;
}

static double hard_rtol(const hard_case *c, bool dae)
{
    return hard_given(dae ? c->rtol_dae : 0, hard_given(c->rtol, 1e-11));
}

/* Times of rows: those of the reference, or equal ones. */
static int hard_times(const kmp_reference *reference, double t_end, double *times)
{
    int count = 0;
    for (int k = 0; k < HARD_ROWS; k++)
        times[count++] = t_end * k / (HARD_ROWS - 1);
    for (int k = 0; reference && k < reference->rows && reference->t[k] <= t_end; k++) {
        int at = count++;
        for (; at > 0 && times[at - 1] > reference->t[k]; at--)
            times[at] = times[at - 1];
        times[at] = reference->t[k];
    }
    return count;
}

static bool hard_verdict(const hard_case *c, bool dae, const hard_result *r)
{
    if (c->end == HARD_STOPS)
        return (r->status == KEMPE_E_FAILED || r->status == KEMPE_STOPPED) && r->report.reason &&
               strstr(r->report.reason, "'slider'");
    if (r->status != KEMPE_OK)
        return false;
    double bar = dae ? hard_given(c->bar_dae, 1e-5) : hard_given(c->bar, 1e-8);
    return r->error <= bar && (dae || c->energy == HARD_ANY || r->drift <= hard_given(c->energy, 1e-7));
}

/* A miss that is known, and no worse than known. */
static bool hard_is_known(const hard_case *c, const hard_result *r)
{
    return r->status == KEMPE_OK && r->error <= c->known;
}

static void hard_judge(const hard_scene *s, const hard_case *c, const kmp_samples *table,
                       const kmp_reference *reference, hard_result *r)
{
    kmp_evaluator *eval = kmp_eval_new(s->system, "tape");
    if (eval && table->rows > 0) {
        kmp_verdict v = kmp_verdict_of(table, eval, reference);
        r->residual = fmax(v.h_max, v.hdot_max);
        r->drift = v.drift_rel;
        r->error = c->rule ? c->rule(s->system, table, eval) : v.error[KMP_QUANTITY_Q];
    }
    kmp_eval_free(eval);
}

/* IDA on the dae formulation has bars of its own. */
static bool hard_by_ida(const hard_formulation *formulation)
{
    return strcmp(formulation->formulation, "dae") == 0 && !formulation->integrator;
}

/* rtol 0: the case's own. */
static hard_result hard_run(hard_scene *s, const char *root, const hard_case *c, const hard_formulation *formulation,
                            double rtol)
{
    bool dae = hard_by_ida(formulation), stiff = c->integrator && strcmp(formulation->form, "newton") == 0;
    double times[HARD_ROWS + 100], t_end = dae && c->t_dae > 0 ? c->t_dae : c->t_end;
    hard_result r = {.error = NAN, .residual = NAN, .drift = NAN};
    kmp_reference reference = {0};
    kmp_samples table;
    kmp_samples_init(&table, s->system->n, s->system->m);
    if (c->reference) {
        char path[512];
        snprintf(path, sizeof path, "%s/%s", root, c->reference);
        r.status = kmp_reference_read(s->system, path, &reference);
    }
    int count = hard_times(c->reference ? &reference : NULL, t_end, times), before = s->passages;
    kmp_run_spec spec = {.formulation = formulation->formulation,
                         .form = formulation->form,
                         .integrator = stiff ? c->integrator : formulation->integrator,
                         .rtol = hard_given(rtol, hard_rtol(c, dae)),
                         .t_end = t_end,
                         .time_count = count,
                         .times = times};
    r.status = r.status == KEMPE_OK ? kmp_run_resolve(s->system, &spec) : r.status;
    if (r.status == KEMPE_OK)
        r.status = kmp_run(s->system, &spec, NULL, kmp_samples_add, &table, &r.report);
    if (r.status != KEMPE_OK && !r.report.reason)
        r.report.reason = kmp_strdup(kempe_context_message(s->context));
    hard_judge(s, c, &table, c->reference ? &reference : NULL, &r);
    r.passages = s->passages - before;
    r.passed = hard_verdict(c, dae, &r);
    kmp_samples_free(&table);
    kmp_samples_free(&reference);
    return r;
}

#endif
