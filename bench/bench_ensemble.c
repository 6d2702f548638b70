/* SPDX-License-Identifier: BSD-3-Clause */
/* Ten thousand four-bars with different lengths and masses: in lanes, in one lane, and each by a run of its own on the
 * reduced formulation, which has the derived system at hand, too. Instances a second of the processor's time, medians
 * of rounds in which all three take turns; where a run for each would take too long it gets every k-th. Fails when
 * lanes are not five times as fast as runs one by one, or when one lane has other bits. */
#include "base/memory.h"
#include "bench.h"
#include "integrators/lanes/ensemble_run.h"
#include "model/model.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { COUNT = 10000, SAMPLE = 25, ROUNDS = 3, COLUMNS = 7, MOST_N = 16 };

#define TARGET 5.0

static const char *const names[COLUMNS] = {"crank",      "coupler",      "rocker",     "base",
                                           "crank_mass", "coupler_mass", "rocker_mass"};

/* One way to run, over every `stride`-th instance. */
typedef struct execution {
    const char *name;
    kmp_ensemble_execution how;
    int stride;
    double seconds[ROUNDS];
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
    for (int k = 0; k < model->parameter_count; k++)
        if (strcmp(model->parameters[k].name, name) == 0)
            return model->parameters[k].number.value;
    return NAN;
}

static void run(kmp_ensemble *e, int n, const double *all, execution *w, int round)
{
    static double values[COUNT * COLUMNS], qd[COUNT * MOST_N];
    static kmp_ensemble_result results[COUNT];
    const kmp_run_spec spec = {0};
    w->count = COUNT / w->stride;
    for (int i = 0; i < w->count; i++)
        memcpy(values + i * COLUMNS, all + i * w->stride * COLUMNS, COLUMNS * sizeof *values);
    if (!w->q)
        w->q = calloc((size_t)(w->count * n), sizeof *w->q);
    double begin = bench_now();
    if (!w->q || kmp_ensemble_run(e, &spec, &w->how, w->count, values, results, w->q, qd) != KEMPE_OK) {
        fprintf(stderr, "%s: the ensemble could not be run\n", w->name);
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

static void report(const execution *w, double median)
{
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

int main(void)
{
    static double values[COUNT * COLUMNS];
    bench b = bench_load("examples/four_bar/four_bar.yaml");
    kmp_ensemble *e = NULL;
    execution executions[] = {{.name = "lanes", .how = {.threads = 1}, .stride = 1},
                              {.name = "one lane", .how = {.threads = 1, .width = 1}, .stride = SAMPLE},
                              {.name = "runs one by one", .how = {.threads = 1, .alone = true}, .stride = SAMPLE}};
    double median[3];
    int n = b.model->motion_count, differ;
    if (kmp_ensemble_new(b.model, COLUMNS, names, &e) != KEMPE_OK || n > MOST_N) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        return 1;
    }
    for (int i = 0; i < COUNT * COLUMNS; i++)
        values[i] = value_of(b.model, names[i % COLUMNS]) * (1 + 0.05 * (2 * next_random() - 1));
    for (int round = 0; round < ROUNDS; round++)
        for (int k = 0; k < 3; k++)
            run(e, n, values, &executions[k], round);
    for (int k = 0; k < 3; k++)
        median[k] = bench_median(ROUNDS, executions[k].seconds);
    run(e, n, values, &executions[0], 0);
    kmp_ensemble_work work = kmp_ensemble_get_work(e);
    printf("four-bars of %d, lengths and masses by up to 5 %% from the example's; 5 s, rtol 1e-10; CPU time, start and "
           "end "
           "included\nlanes: %d, %s, %d choices of u, %.2f of them at work\n\n",
           COUNT, work.width, work.native ? "machine code" : "loops", work.pools,
           (double)work.lane_steps / (double)work.sweeps);
    printf("%-24s %6s %10s %10s %8s %8s %8s %6s %6s\n", "", "count", "1/s", "us each", "ns/rhs", "steps", "exch.",
           "alone", "failed");
    for (int k = 0; k < 3; k++)
        report(&executions[k], median[k]);
    double off = distance(&executions[0], &executions[1], n, &differ), apart = 0;
    int other;
    apart = distance(&executions[0], &executions[2], n, &other);
    printf("\nlanes against one lane: %.2f times as fast, %d numbers differ (%.2g)\n", median[1] / median[0], differ,
           off);
    printf("lanes against runs one by one: %.2f times as fast (target %.0f), coordinates within %.2g\n",
           median[2] / median[0], TARGET, apart);
    for (int k = 0; k < 3; k++)
        free(executions[k].q);
    kmp_ensemble_free(e);
    bench_free(&b);
    return median[2] / median[0] >= TARGET && differ == 0 ? 0 : 1;
}
