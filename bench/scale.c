/* SPDX-License-Identifier: BSD-3-Clause */
/* Chains of N windows (IFToMM A02), N = 2 .. 2000: what deriving, assembling and preparing cost, and a right-hand side
 * of the reduced road and a residual of the dae road, with all that steps need besides, in total and a coordinate.
 *
 *     scale [LARGEST N, 1000 if absent [unequal]]      2000 prepares for many minutes
 */
#include "bench.h"
#include "chain.h"
#include "constraints/partition.h"
#include "integrators/run.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct chain {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    double derive_s;
} chain;

static bool make(chain *c, int n, bool unequal)
{
    char *text = chain_text(n, unequal, 0);
    double begin = bench_now();
    *c = (chain){.context = kempe_context_new()};
    bool made = text && kempe_model_read_text(c->context, text, "chain", &c->model) == KEMPE_OK &&
                kempe_system_new(c->model, &c->system) == KEMPE_OK;
    c->derive_s = bench_now() - begin;
    free(text);
    return made;
}

static void unmake(chain *c)
{
    kempe_system_free(c->system);
    kempe_model_free(c->model);
    kempe_context_free(c->context);
}

typedef struct cost {
    double build_s, cpu_s;
    long steps, rhs;
    char *reason; /* NULL: it went */
} cost;

/* Steps of a runner, without the rows that a user would want: those are a dense solve each. */
static cost run(const chain *c, const kempe_assembly *start, const char *road, const char *form, double rtol, int steps)
{
    double t_end = 0.3; /* flat at 0.55 s: not before the zone there */
    cost result = {0};
    kmp_run_report report = {0};
    kmp_runner *runner = NULL;
    kmp_run_spec spec = {
        .road = road, .form = form, .linear = strcmp(road, "dae") ? NULL : "klu", .rtol = rtol, .t_end = t_end};
    if (kmp_run_resolve(c->system, &spec) == KEMPE_OK && kmp_runner_new(c->system, &spec, start, &runner) == KEMPE_OK) {
        double begin = bench_now();
        for (int k = 0; k < steps && kmp_runner_t(runner) < t_end && kmp_runner_step(runner) == KEMPE_OK;)
            k++;
        result.cpu_s = bench_now() - begin;
    }
    if (runner)
        kmp_runner_report(runner, &report);
    result.reason = report.reason;
    result.build_s = report.build_s;
    result.steps = report.steps;
    result.rhs = report.rhs;
    kmp_runner_free(runner);
    return result;
}

static void print_cost(const cost *c, int size)
{
    double us = 1e6 * c->cpu_s / fmax(1, (double)c->rhs);
    printf(" | %8.3f %6ld %6ld %10.2f %8.1f", c->build_s, c->steps, c->rhs, us, 1e3 * us / size);
}

static void measure(int n, bool unequal)
{
    chain c;
    kempe_assembly *start = NULL;
    cost reduced = {0}, dae = {0};
    double assemble_s = 0;
    int size = 2 * n + 1;
    if (make(&c, n, unequal)) {
        double begin = bench_now();
        bool closed = kempe_assemble(c.system, &start) == KEMPE_OK;
        assemble_s = bench_now() - begin;
        if (closed) {
            reduced = run(&c, start, "reduced", "carried", 1e-8, 30);
            dae = run(&c, start, "dae", "ah", 1e-6, 30);
        }
    }
    printf("%5d %6d | %8.3f %8.3f", n, size, c.derive_s, assemble_s);
    print_cost(&reduced, size);
    print_cost(&dae, size);
    printf("\n");
    if (reduced.reason || dae.reason || reduced.steps * dae.steps == 0)
        printf("      %s\n", reduced.reason ? reduced.reason
                             : dae.reason   ? dae.reason
                                            : kempe_context_message(c.context));
    fflush(stdout);
    free(reduced.reason);
    free(dae.reason);
    kempe_assembly_free(start);
    unmake(&c);
}

int main(int argc, char **argv)
{
    static const int sizes[] = {2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000};
    int largest = argc > 1 ? atoi(argv[1]) : 1000;
    bool unequal = argc > 2;
    printf("%14s %19s | %-42s | %s\n", "", "seconds", "reduced/carried to 0.3 s", "dae/ah, klu, 30 steps");
    printf("%5s %6s | %8s %8s", "N", "coord.", "derive", "assemble");
    for (int k = 0; k < 2; k++)
        printf(" | %8s %6s %6s %10s %8s", "prepare", "steps", "rhs", "us a rhs", "ns each");
    printf("\n");
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes && sizes[k] <= largest; k++)
        measure(sizes[k], unequal);
    return 0;
}
