/* SPDX-License-Identifier: BSD-3-Clause */
/* Random mechanisms: planar and spatial, one to four loops, random joints, some redundant, some that cannot be
 * assembled. Each runs on the reduced and on another formulation, `projected` unless the case names one; the outcomes
 * are counted, and what the formulations do not agree about is named.
 *
 *     bench mechanisms [-i INTEGRATOR] [-f FORMULATION] [COUNT [SEED [FIRST]]]      the last one prints the model FIRST
 *                                                                                   alone
 *
 * Nonzero when a wrong answer ended well without a word, when two formulations that have both converged disagree, or
 * when less than 95 % of the mechanisms that are assemblable by construction come to the end on both and agree. If the
 * formulations differ, each is run again at a hundredth of the tolerance. One that differs from itself, or stops there,
 * was wrong, and must have warned; that a motion is chaotic when both do is likely, not proven. Warnings of runs that
 * agree are counted: they were false alarms, or the two were near the bar.
 *
 * A mechanism is assembled by construction: its tree is placed at random coordinates, and each closure joins the tip of
 * a chain to the point of another body where it lies. Coordinates are then disturbed for the guess. */
#include "bench.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Difference of q at the end, relative to max(|q|, 1). */
#define AGREEMENT 1e-6

enum { MAX_BODIES = 24, TEXT = 1 << 16 };

/* -- chance ------------------------------------------------------------------------------------------ */

static uint64_t state;

static double uniform(double low, double high)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state >> 11) / 9007199254740992.0;
}

static int pick(int count)
{
    return (int)uniform(0, count);
}

/* -- a body's place ---------------------------------------------------------------------------------- */

typedef struct place {
    double r[3][3], o[3];
} place;

static void mul(double a[3][3], double b[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            out[i][j] = 0;
            for (int k = 0; k < 3; k++)
                out[i][j] += a[i][k] * b[k][j];
        }
}

/* Rotation about a unit axis (Rodrigues). */
static void turn(const double e[3], double q, double r[3][3])
{
    double c = cos(q), s = sin(q);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            r[i][j] = (i == j ? c : 0) + (1 - c) * e[i] * e[j];
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        r[j][i] += s * e[k];
        r[i][j] -= s * e[k];
    }
}

static void to_ground(const place *p, const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = p->o[i];
        for (int k = 0; k < 3; k++)
            out[i] += p->r[i][k] * x[k];
    }
}

static void to_body(const place *p, const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = 0;
        for (int k = 0; k < 3; k++)
            out[i] += p->r[k][i] * (x[k] - p->o[k]);
    }
}

/* -- a mechanism ------------------------------------------------------------------------------------- */

typedef struct mechanism {
    char bodies[TEXT], points[MAX_BODIES + 1][4096], loops[8192], q[4096];
    place at[MAX_BODIES + 1]; /* 0: the ground */
    double tip[MAX_BODIES + 1][3];
    int count, point_count, loop_count;
    bool planar, assemblable;
} mechanism;

static void add(char *text, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));

static void add(char *text, size_t size, const char *format, ...)
{
    size_t length = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + length, size - length, format, arguments);
    va_end(arguments);
}

static void random_vector(const mechanism *m, double size, double x[3])
{
    for (int k = 0; k < 3; k++)
        x[k] = k == 2 && m->planar ? 0 : uniform(-size, size);
}

static void random_axis(const mechanism *m, bool slide, double e[3])
{
    double length = 0;
    memset(e, 0, 3 * sizeof *e);
    if (m->planar && !slide)
        e[2] = 1;
    else if (pick(2))
        e[pick(m->planar ? 2 : 3)] = 1;
    else {
        random_vector(m, 1, e);
        for (int k = 0; k < 3; k++)
            length += e[k] * e[k];
        for (int k = 0; k < 3; k++)
            e[k] /= sqrt(length);
    }
}

/* A point of a body, named; its number. */
static int add_point(mechanism *m, int body, const double x[3])
{
    add(m->points[body], sizeof m->points[body], "%sP%d: [%.17g, %.17g, %.17g]", *m->points[body] ? ", " : "",
        m->point_count, x[0], x[1], x[2]);
    return m->point_count++;
}

static void name_of(int body, char name[16])
{
    if (body)
        snprintf(name, 16, "b%d", body);
    else
        snprintf(name, 16, "ground");
}

/* A new body on `parent`, at its own random angle or slide; returns its number. */
static int add_body(mechanism *m, int parent)
{
    int b = ++m->count;
    bool slide = pick(6) == 0;
    double e[3], x[3], q = slide ? uniform(-0.3, 0.3) : uniform(-2, 2), r[3][3], c[3];
    char name[16];
    name_of(parent, name);
    random_vector(m, 0.8, x);
    if (parent && pick(3))
        memcpy(x, m->tip[parent], sizeof x);
    random_axis(m, slide, e);
    int point = add_point(m, parent, x);
    random_vector(m, 1, m->tip[b]);
    random_vector(m, 0.3, c);
    add(m->bodies, sizeof m->bodies,
        "  b%d:\n    joint: {name: j%d, %s: [%.17g, %.17g, %.17g], at: %s.P%d}\n    mass: %.4f\n    com: [%.4f, %.4f, "
        "%.4f]\n"
        "    inertia: {xx: %.4f, yy: 0.11, zz: 0.12}\n",
        b, b, slide ? "prismatic" : "revolute", e[0], e[1], e[2], name, point, uniform(0.2, 3), c[0], c[1], c[2],
        uniform(0.1, 0.2));
    add(m->q, sizeof m->q, "%sj%d: %.6f", b > 1 ? ", " : "", b, q + uniform(-0.02, 0.02));
    to_ground(&m->at[parent], x, m->at[b].o);
    memcpy(m->at[b].r, m->at[parent].r, sizeof m->at[b].r);
    if (slide) {
        double d[3] = {e[0] * q, e[1] * q, e[2] * q}, moved[3];
        place turned = m->at[b];
        to_ground(&turned, d, moved);
        memcpy(m->at[b].o, moved, sizeof moved);
    } else {
        turn(e, q, r);
        mul(m->at[parent].r, r, m->at[b].r);
    }
    return b;
}

/* A chain from a body, its tip joined to another where it lies; now and then out of reach, twice, or by a rod. */
static void add_loop(mechanism *m)
{
    int base = pick(m->count + 1), links = m->planar ? 2 + pick(2) : 3 + pick(3), tip = base, other, p, q;
    double x[3], y[3];
    char a[16], b[16];
    for (int k = 0; k < links; k++)
        tip = add_body(m, tip);
    other = pick(tip - links + 1); /* ground, or a body from before this chain */
    to_ground(&m->at[tip], m->tip[tip], x);
    to_body(&m->at[other], x, y);
    if (pick(25) == 0) {
        y[0] += 1000;
        m->assemblable = false;
    }
    p = add_point(m, tip, m->tip[tip]);
    name_of(tip, a);
    name_of(other, b);
    if (pick(4) == 0) {
        y[0] += 0.5;
        q = add_point(m, other, y);
        add(m->loops, sizeof m->loops, "  L%d: {rod: [%s.P%d, %s.P%d], length: 0.5}\n", m->loop_count++, a, p, b, q);
        return;
    }
    q = add_point(m, other, y);
    for (int twice = pick(8) == 0; twice >= 0; twice--)
        add(m->loops, sizeof m->loops, "  L%d: {ball: [%s.P%d, %s.P%d]}\n", m->loop_count++, a, p, b, q);
}

/* The model as text. */
static void make(mechanism *m, uint64_t seed, char *text)
{
    state = seed * 0x9e3779b97f4a7c15u + 1;
    memset(m, 0, sizeof *m);
    m->assemblable = true;
    m->planar = pick(2);
    for (int k = 0; k < 3; k++)
        m->at[0].r[k][k] = 1;
    for (int loops = 1 + pick(4); loops > 0 && m->count + 6 < MAX_BODIES; loops--)
        add_loop(m);
    *text = 0;
    add(text, TEXT * 2, "kempe: 1\nname: random-%llu\ngravity: [0, -9.81, 0]\nground: {points: {%s}}\nbodies:\n",
        (unsigned long long)seed, m->points[0]);
    for (char *s = m->bodies, *end; *s; s = end) { /* each body's text, then its points */
        int body = atoi(strstr(s, "b") + 1);
        end = strstr(s + 3, "\n  b");
        end = end ? end + 1 : s + strlen(s);
        add(text, TEXT * 2, "%.*s", (int)(end - s), s);
        if (*m->points[body])
            add(text, TEXT * 2, "    points: {%s}\n", m->points[body]);
    }
    add(text, TEXT * 2, "loops:\n%sstart: {q: {%s}, qd: {j1: %.3f}}\nrun: {t_end: 0.5, rtol: 1e-10}\n", m->loops, m->q,
        uniform(-2, 2));
}

/* -- outcomes ---------------------------------------------------------------------------------------- */

typedef enum outcome {
    AGREED,
    ALARMED,
    SENSITIVE,
    UNSETTLED,
    SILENT,
    DISAGREED,
    UNASSEMBLED,
    ONE_FAILED,
    BOTH_FAILED,
    UNREAD,
    OUTCOMES
} outcome;

static const char *const outcome_text[OUTCOMES] = {
    "both formulations ran and agree", "both ran and agree, one warned",        "both ran, chaotic, both warned",
    "both ran, one is wrong, warned",  "both ran, wrong without a WORD",        "both ran and DISAGREE",
    "not assembled, with a reason",    "one formulation failed, with a reason", "both failed, with a reason",
    "refused by the reader",
};

/* Warnings of the run at hand. */
/* Random start rates contradict the closures; a warning that they were corrected is not counted. */
static void count_warnings(void *user, kempe_level level, const char *line)
{
    *(int *)user += level == KEMPE_LOG_WARNING && strncmp(line, "start: the rate of", 18) != 0;
}

static const char *integrator; /* NULL: the usual ones */
static const char *other = "projected";

static kempe_status simulate(const kempe_system *system, const char *formulation, double rtol, bool once,
                             kempe_trajectory **trajectory)
{
    kempe_run_options run = {0};
    run.no_convergence_check = once;
    run.formulation = formulation;
    run.integrator = integrator;
    run.rtol = rtol;
    run.output_step = 0.5;
    return kempe_simulate(system, &run, trajectory);
}

/* Largest difference of q at the end, relative to max(|q|, 1); -1 when one has no such row. */
static double difference(const kempe_model *model, const kempe_trajectory *a, const kempe_trajectory *b)
{
    int last = kempe_trajectory_row_count(a) - 1, n = kempe_model_coordinate_count(model);
    double worst = 0;
    if (last < 1 || kempe_trajectory_row_count(b) - 1 != last)
        return -1;
    for (int k = 0; k < n; k++) {
        double x = kempe_trajectory_q(a, last)[k], y = kempe_trajectory_q(b, last)[k];
        worst = fmax(worst, fabs(x - y) / fmax(fabs(x), 1));
    }
    return worst;
}

/* True if a formulation differs from itself at a hundredth of the tolerance about as much as from the other one, or
 * does not come to the end there. */
static bool differs_from_itself(const kempe_system *system, const kempe_model *model, const char *formulation,
                                const kempe_trajectory *a, double d)
{
    kempe_trajectory *again = NULL;
    kempe_status status = simulate(system, formulation, 1e-12, true, &again);
    double own = again ? difference(model, a, again) : -1;
    kempe_trajectory_free(again);
    return status != KEMPE_OK || own > fmax(0.1 * d, 0.5 * AGREEMENT);
}

/* Two runs that came to the end; whether each warned. */
static outcome judge_two(const kempe_system *system, const kempe_model *model, const kempe_trajectory *a,
                         const kempe_trajectory *b, bool a_warned, bool b_warned, char *detail, size_t size)
{
    double d = difference(model, a, b);
    add(detail, size, "%.2e", d);
    if (d >= 0 && d < AGREEMENT)
        return a_warned || b_warned ? ALARMED : AGREED;
    bool a_wrong = differs_from_itself(system, model, "reduced", a, d);
    bool b_wrong = differs_from_itself(system, model, other, b, d);
    if ((a_wrong && !a_warned) || (b_wrong && !b_warned)) {
        add(detail, size, " of %s%s", a_wrong && !a_warned ? "reduced " : "", b_wrong && !b_warned ? other : "");
        return SILENT;
    }
    return a_wrong && b_wrong ? SENSITIVE : a_wrong || b_wrong ? UNSETTLED : DISAGREED;
}

static outcome judge(kempe_context *context, const kempe_system *system, const kempe_model *model, char *detail,
                     size_t size)
{
    kempe_assembly *assembly = NULL;
    kempe_trajectory *a = NULL, *b = NULL;
    outcome result;
    int a_warned = 0, b_warned = 0;
    if (kempe_assembly_new(system, &assembly) != KEMPE_OK) {
        snprintf(detail, size, "%.200s", kempe_context_message(context));
        kempe_assembly_free(assembly);
        return UNASSEMBLED;
    }
    kempe_assembly_free(assembly);
    kempe_context_set_log(context, count_warnings, &a_warned);
    kempe_status first = simulate(system, "reduced", 1e-10, false, &a);
    snprintf(detail, size, "%.150s", first == KEMPE_OK ? "" : kempe_context_message(context));
    kempe_context_set_log(context, count_warnings, &b_warned);
    kempe_status second = simulate(system, other, 1e-10, false, &b);
    kempe_context_set_log(context, NULL, NULL);
    if (second != KEMPE_OK)
        add(detail, size, " | %s: %.150s", other, kempe_context_message(context));
    if (first != KEMPE_OK || second != KEMPE_OK)
        result = first != KEMPE_OK && second != KEMPE_OK ? BOTH_FAILED : ONE_FAILED;
    else
        result = judge_two(system, model, a, b, a_warned > 0, b_warned > 0, detail, size);
    kempe_trajectory_free(a);
    kempe_trajectory_free(b);
    return result;
}

static outcome run_one(uint64_t seed, bool show, bool *assemblable, char *detail, size_t size)
{
    static mechanism m;
    static char text[TEXT * 2];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    outcome result = UNREAD;
    make(&m, seed, text);
    *assemblable = m.assemblable;
    if (show)
        puts(text);
    if (kempe_model_read_text(context, text, "random", &model) == KEMPE_OK &&
        kempe_system_new(model, &system) == KEMPE_OK)
        result = judge(context, system, model, detail, size);
    else
        snprintf(detail, size, "%.300s", kempe_context_message(context));
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return result;
}

int bench_mechanisms(int argc, char **argv)
{
    for (; argc > 2 && argv[1][0] == '-'; argc -= 2, argv += 2)
        *(argv[1][1] == 'i' ? &integrator : &other) = argv[2];
    int count = argc > 1 ? atoi(argv[1]) : 2000, totals[2][OUTCOMES] = {{0}};
    uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1, first = argc > 3 ? strtoull(argv[3], NULL, 10) : 0;
    for (int k = 0; k < count; k++) {
        char detail[1024] = "";
        bool assemblable;
        uint64_t number = argc > 3 ? first : seed * 1000000 + (uint64_t)k;
        outcome result = run_one(number, argc > 3, &assemblable, detail, sizeof detail);
        totals[!assemblable][result]++;
        if (result != AGREED && !(result == UNASSEMBLED && !assemblable))
            printf("%llu: %s: %s\n", (unsigned long long)number, outcome_text[result], detail);
        fflush(stdout);
    }
    for (int kind = 0; kind < 2; kind++) {
        printf("%s\n", kind ? "out of reach by construction" : "assemblable by construction");
        for (int k = 0; k < OUTCOMES; k++)
            printf("  %-32s %6d\n", outcome_text[k], totals[kind][k]);
    }
    int assemblable = 0, well = totals[0][AGREED] + totals[0][ALARMED];
    int bad = totals[0][SILENT] + totals[1][SILENT] + totals[0][DISAGREED] + totals[1][DISAGREED];
    for (int k = 0; k < OUTCOMES; k++)
        assemblable += totals[0][k];
    printf("%.2f %% of those assemblable by construction ran to the end on both formulations and agree\n",
           assemblable ? 100.0 * well / assemblable : 100);
    return bad > 0 || 100 * well < 95 * assemblable;
}
