/* SPDX-License-Identifier: BSD-3-Clause */
/* Chains of N windows (IFToMM A02), N = 2 .. 2000: what reading, deriving, assembling, checking and preparing cost, and
 * a right-hand side of the reduced and the projected formulation and a residual of the dae formulation, with all that
 * steps need besides, in total and a coordinate, and a row of the table.
 *
 *     bench scale [LARGEST N, 2000 if absent [unequal]]
 */
#include "bench.h"
#include "chain.h"
#include "constraints/diagnosis/diagnosis.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include <kempe/check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct chain {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    double read_s, derive_s;
} chain;

static bool make(chain *c, int n, bool unequal)
{
    char *text = chain_text(n, unequal, 0);
    double begin = bench_now();
    *c = (chain){.context = kempe_context_new()};
    bool made = text && kempe_model_read_text(c->context, text, "chain", &c->model) == KEMPE_OK;
    c->read_s = bench_now() - begin;
    begin = bench_now();
    made = made && kempe_system_new(c->model, &c->system) == KEMPE_OK;
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
    double build_s, cpu_s, row_s;
    long steps, rhs;
    char *reason; /* NULL: it went */
} cost;

enum { ROWS = 10 };

/* Rows within the last step, seconds each. */
static double time_rows(kmp_runner *runner, const kempe_system *s)
{
    double *row = calloc((size_t)(3 * s->n + s->m), sizeof *row), work, begin = bench_now();
    double from = kmp_runner_t_old(runner), to = kmp_runner_t(runner);
    for (int k = 1; row && k <= ROWS; k++)
        if (kmp_runner_row(runner, from + (to - from) * k / ROWS, row, &work) != KEMPE_OK)
            break;
    free(row);
    return (bench_now() - begin) / ROWS;
}

/* Steps of a runner, then rows. */
static cost run(const chain *c, const kempe_assembly *start, const char *formulation, const char *form, double rtol,
                int steps)
{
    double t_end = 0.3; /* flat at 0.55 s: not before the zone there */
    cost result = {0};
    kmp_run_report report = {0};
    kmp_runner *runner = NULL;
    kmp_run_spec spec = {.formulation = formulation,
                         .form = form,
                         .linear = strcmp(formulation, "dae") ? NULL : "klu",
                         .rtol = rtol,
                         .t_end = t_end};
    if (kmp_run_resolve(c->system, &spec) == KEMPE_OK && kmp_runner_new(c->system, &spec, start, &runner) == KEMPE_OK) {
        double begin = bench_now();
        for (int k = 0; k < steps && kmp_runner_t(runner) < t_end && kmp_runner_step(runner) == KEMPE_OK;)
            k++;
        result.cpu_s = bench_now() - begin;
        result.row_s = time_rows(runner, c->system);
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
    printf(" | %7.3f %5ld %4ld %8.2f %7.1f %8.1f", c->build_s, c->steps, c->rhs, us, 1e3 * us / size, 1e6 * c->row_s);
}

static double time_check(const chain *c)
{
    kempe_check *check = NULL;
    double begin = bench_now();
    (void)kempe_check_new(c->system, &check);
    kempe_check_free(check);
    return bench_now() - begin;
}

static const struct {
    const char *title, *formulation, *form;
    double rtol;
} formulations[] = {{"reduced/integrated to 0.3 s", "reduced", "integrated", 1e-8},
                    {"projected to 0.3 s", "projected", "none", 1e-8},
                    {"dae/stabilized1, klu, 30 steps", "dae", "stabilized1", 1e-6}};
enum { FORMULATIONS = sizeof formulations / sizeof *formulations };

static void measure(int n, bool unequal)
{
    chain c;
    kempe_assembly *start = NULL;
    cost costs[FORMULATIONS] = {{0}};
    double assemble_s = 0, check_s = 0;
    int size = 2 * n + 1;
    if (make(&c, n, unequal)) {
        double begin = bench_now();
        bool closed = kempe_assembly_new(c.system, &start) == KEMPE_OK;
        assemble_s = bench_now() - begin;
        check_s = time_check(&c);
        for (int k = 0; closed && k < FORMULATIONS; k++)
            costs[k] = run(&c, start, formulations[k].formulation, formulations[k].form, formulations[k].rtol, 30);
    }
    printf("%5d %6d | %7.3f %7.3f %8.3f %7.3f", n, size, c.read_s, c.derive_s, assemble_s, check_s);
    for (int k = 0; k < FORMULATIONS; k++)
        print_cost(&costs[k], size);
    printf("\n");
    for (int k = 0; k < FORMULATIONS; k++) {
        if (costs[k].reason || costs[k].steps == 0)
            printf("      %s: %s\n", formulations[k].formulation,
                   costs[k].reason ? costs[k].reason : kempe_context_message(c.context));
        free(costs[k].reason);
    }
    fflush(stdout);
    kempe_assembly_free(start);
    unmake(&c);
}

int bench_scale(int argc, char **argv)
{
    static const int sizes[] = {2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000};
    int largest = argc > 1 ? atoi(argv[1]) : 2000;
    bool unequal = argc > 2;
    printf("%12s | %-32s", "", "seconds");
    for (int k = 0; k < FORMULATIONS; k++)
        printf(" | %-44s", formulations[k].title);
    printf("\n%5s %6s | %7s %7s %8s %7s", "N", "coord.", "read", "derive", "assemble", "check");
    for (int k = 0; k < FORMULATIONS; k++)
        printf(" | %7s %5s %4s %8s %7s %8s", "prepare", "steps", "rhs", "us a rhs", "ns each", "us a row");
    printf("\n");
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes && sizes[k] <= largest; k++)
        measure(sizes[k], unequal);
    return 0;
}
