/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances of mechanisms with different numbers on one thread: in lanes, in four lanes (AVX2), in one lane, and each
 * by a run of its own on the reduced formulation, which has the derived system at hand, too. Instances a second of the
 * processor's time; all take turns, and ratios are medians over the rounds; separate runs are made of every k-th
 * instance, to save time. Exit code 1: lanes are less than the required number of times as fast as runs one by one,
 * which the output names, or one lane or four have other bits.
 *
 *     bench ensemble [NAME..] [--lanes ROUNDS]      only these mechanisms; only lanes, for a profile */
#include "base/memory.h"
#include "bench.h"
#include "ensemble/lanes/ensemble_run.h"
#include "model/data/body.h"
#include "model/data/parameter.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST_COUNT = 10000, MOST_ROUNDS = 9, MOST_COLUMNS = 7, MOST_N = 16, WAYS = 4 };

/* A number of a model file that becomes a parameter. */
typedef struct named_number {
    const char *name, *number, *before; /* before: the text in front of it */
} named_number;

/* Andrews' file has no parameters. */
static const named_number andrews_numbers[] = {{"crank", "0.007", "points: {F: ["},
                                               {"motor", "0.033", "torque: "},
                                               {"stiffness", "4530", "stiffness: "},
                                               {"mass", "0.07050", "mass: "}};

typedef struct mechanism {
    const char *name, *file;
    int count, stride, rounds;
    double spread, required; /* required: lanes against runs one by one */
    const char *columns[MOST_COLUMNS];
    const named_number *numbers;
    size_t number_count;
} mechanism;

static const mechanism mechanisms[] = {
    {"four_bar",
     "examples/four_bar/four_bar.yaml",
     10000,
     25,
     3,
     0.05,
     12,
     {"crank", "coupler", "rocker", "base", "crank_mass", "coupler_mass", "rocker_mass"},
     NULL,
     0},
    {"andrews",
     "examples/andrews/andrews.yaml",
     2400,
     8,
     5,
     0.02,
     5,
     {"crank", "motor", "stiffness", "mass"},
     andrews_numbers,
     sizeof andrews_numbers / sizeof *andrews_numbers},
    {"slider_crank",
     "examples/slider_crank/slider_crank.yaml",
     2400,
     8,
     5,
     0.05,
     5,
     {"r", "l", "crank_mass", "rod_mass", "slider_mass"},
     NULL,
     0},
    {"stephenson",
     "examples/stephenson/stephenson.yaml",
     2400,
     8,
     5,
     0.02,
     5,
     {"crank", "coupler", "rocker", "rod", "lever", "rho"},
     NULL,
     0}};

/* One way to run, over every `stride`-th instance. */
typedef struct execution {
    const char *name;
    kmp_ensemble_execution how;
    int stride;
    double seconds[MOST_ROUNDS];
    int count, alone, failed;
    long rhs, steps, exchanges;
    double *q;
} execution;

static double next_random(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double value_of(const kempe_model *model, const char *name)
{
    for (int k = 0; k < kmp_model_parameter_count(model); k++)
        if (strcmp(kmp_model_parameter(model, k)->name, name) == 0)
            return kmp_model_parameter(model, k)->number.value;
    return NAN;
}

/* The text of a file in which numbers have become parameters. */
static char *named_text(const mechanism *m)
{
    static char text[1 << 16], changed[1 << 16];
    FILE *f = fopen(m->file, "r");
    size_t size = f ? fread(text, 1, sizeof text / 2, f) : 0;
    if (f)
        (void)fclose(f);
    text[size] = 0;
    int length = snprintf(changed, sizeof changed, "%s\nparameters: {", text);
    for (size_t k = 0; k < m->number_count; k++)
        length += snprintf(changed + length, sizeof changed - (size_t)length, "%s%s: %s", k > 0 ? ", " : "",
                           m->numbers[k].name, m->numbers[k].number);
    (void)snprintf(changed + length, sizeof changed - (size_t)length, "}\n");
    for (size_t k = 0; k < m->number_count; k++) {
        char from[64], *at;
        int before = snprintf(from, sizeof from, "%s", m->numbers[k].before);
        (void)snprintf(from + before, sizeof from - (size_t)before, "%s", m->numbers[k].number);
        at = strstr(changed, from);
        if (!at)
            return NULL;
        (void)snprintf(text, sizeof text, "%.*s%s%s%s", (int)(at - changed), changed, m->numbers[k].before,
                       m->numbers[k].name, at + strlen(from));
        memcpy(changed, text, sizeof changed);
    }
    return changed;
}

static kempe_model *read_mechanism(const mechanism *m, kempe_context *context)
{
    kempe_model *model = NULL;
    const char *text = m->numbers ? named_text(m) : NULL;
    if (text ? kempe_model_read_text(context, text, m->file, &model) : kempe_model_read(context, m->file, &model)) {
        fprintf(stderr, "%s\n", kempe_context_message(context));
        exit(1);
    }
    return model;
}

static void run(const mechanism *m, kmp_ensemble *e, int n, const double *all, execution *w, int round)
{
    static double values[MOST_COUNT * MOST_COLUMNS], qd[MOST_COUNT * MOST_N];
    static kmp_ensemble_result results[MOST_COUNT];
    const kmp_run_spec spec = {0};
    int columns = 0;
    while (columns < MOST_COLUMNS && m->columns[columns])
        columns++;
    w->count = m->count / w->stride;
    for (int i = 0; i < w->count; i++)
        memcpy(values + i * columns, all + i * w->stride * columns, (size_t)columns * sizeof *values);
    if (!w->q)
        w->q = calloc((size_t)(w->count * n), sizeof *w->q);
    double begin = bench_now();
    if (!w->q || kmp_ensemble_run(e, &spec, &w->how, w->count, values, results, w->q, qd) != KEMPE_OK) {
        fprintf(stderr, "%s, %s: the ensemble could not be run\n", m->name, w->name);
        exit(1);
    }
    w->seconds[round] = (bench_now() - begin) / w->count;
    w->rhs = w->steps = w->exchanges = w->alone = w->failed = 0;
    for (int i = 0; i < w->count; i++) {
        w->rhs += results[i].rhs;
        w->steps += results[i].steps;
        w->exchanges += results[i].exchanges;
        w->alone += results[i].alone;
        w->failed += results[i].status != KEMPE_OK;
        kmp_free(results[i].reason);
    }
}

static double median_of(int count, const double *x)
{
    double copy[MOST_ROUNDS];
    memcpy(copy, x, (size_t)count * sizeof *x);
    return bench_median(count, copy);
}

static double median_ratio(int count, const double *a, const double *b)
{
    double ratio[MOST_ROUNDS];
    for (int k = 0; k < count; k++)
        ratio[k] = a[k] / b[k];
    return bench_median(count, ratio);
}

static void report(const execution *w, int rounds)
{
    double median = median_of(rounds, w->seconds);
    printf("%-24s %6d %10.0f %10.2f %8.1f %8.0f %8.1f %6d %6d\n", w->name, w->count, 1 / median, 1e6 * median,
           1e9 * median * w->count / (double)w->rhs, (double)w->steps / w->count, (double)w->exchanges / w->count,
           w->alone, w->failed);
}

/* Largest distance of coordinates at the end, and how many bits of what both have are the same. */
static double distance(const execution *a, const execution *b, int n, int *differ)
{
    double worst = 0;
    *differ = 0;
    for (int i = 0; i < b->count; i++)
        for (int k = 0; k < n; k++) {
            double x = a->q[(i * b->stride / a->stride) * n + k], y = b->q[i * n + k];
            worst = fmax(worst, fabs(x - y));
            *differ += memcmp(&x, &y, sizeof x) != 0;
        }
    return worst;
}

/* The paired measurement of one mechanism. false: it is slower than required, or one lane has other bits. */
static bool measure(const mechanism *m, int lanes_alone)
{
    static double values[MOST_COUNT * MOST_COLUMNS];
    kempe_context *context = kempe_context_new();
    kempe_model *model = read_mechanism(m, context);
    kmp_ensemble *e = NULL;
    execution executions[WAYS] = {
        {.name = "lanes", .how = {.threads = 1}, .stride = 1},
        {.name = "one lane", .how = {.threads = 1, .width = 1}, .stride = m->stride},
        {.name = "runs one by one", .how = {.threads = 1, .alone = true}, .stride = m->stride},
        {.name = "four lanes", .how = {.threads = 1, .width = 4}, .stride = m->stride}};
    int n = kmp_model_motion_count(model), columns = 0, differ, other, narrow,
        rounds = lanes_alone > 0 ? lanes_alone : m->rounds;
    while (columns < MOST_COLUMNS && m->columns[columns])
        columns++;
    if (kmp_ensemble_new(model, columns, m->columns, &e) != KEMPE_OK || n > MOST_N) {
        fprintf(stderr, "%s\n", kempe_context_message(context));
        exit(1);
    }
    for (int i = 0; i < m->count * columns; i++)
        values[i] = value_of(model, m->columns[i % columns]) * (1 + m->spread * (2 * next_random() - 1));
    for (int round = 0; round < rounds; round++)
        for (int k = WAYS; k-- > 0;)
            if (k == 0 || lanes_alone == 0)
                run(m, e, n, values, &executions[k], round);
    kmp_ensemble_work work = kmp_ensemble_get_work(e);
    printf("%s: %d instances, numbers by up to %g %% from the example's; CPU time, start and end included\nlanes: %d, "
           "%s, %d choice%s of u, %.2f of them at work\n\n",
           m->name, m->count, 100 * m->spread, work.width, work.native ? "machine code" : "loops", work.pools,
           work.pools == 1 ? "" : "s", (double)work.lane_steps / (double)work.sweeps);
    printf("%-24s %6s %10s %10s %8s %8s %8s %6s %6s\n", "", "count", "1/s", "us each", "ns/rhs", "steps", "exch.",
           "alone", "failed");
    bool ok = true;
    for (int k = 0; k < (lanes_alone > 0 ? 1 : WAYS); k++)
        report(&executions[k], rounds);
    if (lanes_alone == 0) {
        double off = distance(&executions[0], &executions[1], n, &differ);
        double apart = distance(&executions[0], &executions[2], n, &other);
        double four = distance(&executions[0], &executions[3], n, &narrow);
        double ratio = median_ratio(rounds, executions[2].seconds, executions[0].seconds);
        printf("\nlanes against one lane: %.2f times as fast, %d numbers differ (%.2g)\n",
               median_ratio(rounds, executions[1].seconds, executions[0].seconds), differ, off);
        printf("lanes against four lanes: %.2f times as fast, %d numbers differ (%.2g)\n",
               median_ratio(rounds, executions[3].seconds, executions[0].seconds), narrow, four);
        bool reached = ratio >= m->required;
        printf("lanes against runs one by one: %.2f times as fast, coordinates within %.2g\n"
               "required: %g times as fast; measured %.2f; reached: %s\n\n",
               ratio, apart, m->required, ratio, reached ? "yes" : "no");
        ok = reached && differ == 0 && narrow == 0;
    }
    for (int k = 0; k < WAYS; k++)
        free(executions[k].q);
    kmp_ensemble_free(e);
    kempe_model_free(model);
    kempe_context_free(context);
    return ok;
}

int bench_ensemble(int argc, char **argv)
{
    int lanes_alone = 0, names = 0;
    bool ok = true;
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--lanes") == 0 && i + 1 < argc)
            lanes_alone = atoi(argv[++i]);
        else
            argv[++names] = argv[i];
    lanes_alone = lanes_alone < MOST_ROUNDS ? lanes_alone : MOST_ROUNDS;
    for (size_t k = 0; k < sizeof mechanisms / sizeof *mechanisms; k++) {
        bool asked = names == 0;
        for (int i = 1; i <= names; i++)
            asked = asked || strcmp(argv[i], mechanisms[k].name) == 0;
        if (asked)
            ok = measure(&mechanisms[k], lanes_alone) && ok;
    }
    return ok ? 0 : 1;
}
