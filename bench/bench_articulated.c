/* SPDX-License-Identifier: BSD-3-Clause */
/* A right-hand side of the reduced formulation by M, C and Cholesky factors, and by articulated bodies: chains and
 * binary trees of N joints about x, y and z alternately, all masses and levers given, and mechanisms with loops.
 * Operations + - * / of the program and of what is solved with its values; microseconds, the least of some runs taken
 * alternately; the choice of auto.
 *
 *     bench articulated [LARGEST N, 400 if absent [MODEL ...]]
 */
#include "base/memory.h"
#include "base/text.h"
#include "bench.h"
#include "dynamics/motion.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "linalg/dense/dense.h"
#include "model/data/model_context.h"
#include <kempe/settings.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 5, WAYS = 2 };
static const char *const words[WAYS] = {"composite", "articulated"};

/* One of the ways: its system, and what it costs. */
typedef struct way {
    kempe_system *system;
    double us, build_s;
    long program, solves, rhs;
} way;

static char *tree_text(int n, bool binary)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nname: tree\ngravity: [0, 0, -9.81]\nbodies:\n");
    for (int b = 1; b <= n; b++) {
        int parent = binary ? b / 2 : b - 1;
        kmp_text_printf(&text, "  b%d: {joint: {revolute: %c, at: ", b, "xyz"[b % 3]);
        kmp_text_printf(&text, parent ? "b%d.P" : "ground", parent);
        kmp_text_put(&text, "}, mass: 1.5, com: [0.1, 0.05, 0.15], inertia: {xx: 0.04, yy: 0.05, zz: 0.06}, "
                            "points: {P: [0.2, 0.1, 0.3]}}\n");
    }
    kmp_text_put(&text, "run: {t_end: 0.1}\n");
    return kmp_text_take(&text);
}

/* Operations of one Cholesky factorisation and solution with k unknowns. */
static long cholesky(int k)
{
    kmp_flops a = kmp_cholesky_factor_flops(k), b = kmp_cholesky_solve_flops(k);
    return a.add + a.mul + a.div + b.add + b.mul + b.div;
}

/* Beside the program: what the way itself needs; Jv and its tangent, which both need, are left out. */
static void count(way *w, bool by_bodies)
{
    const kempe_system *s = w->system;
    int n = s->n, m = s->m, p = n - m;
    const kmp_program *program = by_bodies ? s->bodies->program : s->motion;
    w->program = kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
    if (!by_bodies)
        w->solves =
            cholesky(p) + (m ? 2L * ((p + 1L) * 2 * s->mass.count + (long)p * n + (long)p * (p + 1) / 2 * n) : 0);
}

/* A whole run, its rows left out; microseconds a right-hand side, infinity where it fails. */
static double time_run(const kempe_system *s, long *rhs)
{
    kmp_run_spec spec = {.formulation = "reduced", .form = "integrated", .integrator = "dop853", .rtol = 1e-8};
    kmp_runner *runner = NULL;
    kmp_run_report report = {0};
    double us = INFINITY;
    if (kmp_run_resolve(s, &spec) == KEMPE_OK && kmp_runner_new(s, &spec, NULL, &runner) == KEMPE_OK) {
        kempe_status status = KEMPE_OK;
        kmp_runner_report(runner, &report);
        long before = report.rhs;
        double begin = bench_now();
        while (status == KEMPE_OK && kmp_runner_t(runner) < spec.t_end)
            status = kmp_runner_step(runner);
        double spent = bench_now() - begin;
        kmp_runner_report(runner, &report);
        *rhs = report.rhs;
        if (status == KEMPE_OK)
            us = 1e6 * spent / fmax(1, (double)(report.rhs - before));
    }
    kmp_runner_free(runner);
    return us;
}

static void measure(const char *name, const kempe_model *model)
{
    way savings[WAYS] = {{0}};
    kempe_system *by_itself = NULL;
    bool ok = kempe_system_new_with_algorithm(model, "auto", &by_itself) == KEMPE_OK &&
              kmp_motion_need_bodies(by_itself) == KEMPE_OK;
    for (int k = 0; k < WAYS && ok; k++) {
        double begin = bench_now();
        ok = kempe_system_new_with_algorithm(model, words[k], &savings[k].system) == KEMPE_OK;
        savings[k].build_s = bench_now() - begin;
        savings[k].us = INFINITY;
        if (ok)
            count(&savings[k], k == 1);
    }
    for (int r = 0; r < RUNS && ok; r++)
        for (int k = 0; k < WAYS; k++)
            savings[k].us = fmin(savings[k].us, time_run(savings[k].system, &savings[k].rhs));
    if (ok) {
        printf("%-22s %4d %4d", name, by_itself->n, by_itself->m);
        for (int k = 0; k < WAYS; k++)
            printf(" | %8.3f %8ld %9ld %5ld %9.2f", savings[k].build_s, savings[k].program, savings[k].solves,
                   savings[k].rhs, savings[k].us);
        printf(" | %6.2f %6.2f  %s\n",
               (double)(savings[0].program + savings[0].solves) / (double)(savings[1].program + savings[1].solves),
               savings[0].us / savings[1].us, words[by_itself->bodies->program != NULL]);
    } else {
        printf("%-22s %s\n", name, kempe_context_message(kmp_model_context(model)));
    }
    fflush(stdout);
    kempe_system_free(by_itself);
    for (int k = 0; k < WAYS; k++)
        kempe_system_free(savings[k].system);
}

static void measure_tree(int n, bool binary)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    char name[32], *text = tree_text(n, binary);
    snprintf(name, sizeof name, "%s %d", binary ? "binary tree" : "chain", n);
    if (text && kempe_model_read_text(context, text, "tree", &model) == KEMPE_OK)
        measure(name, model);
    kmp_free(text);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void measure_file(const char *path)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    if (kempe_model_read(context, path, &model) == KEMPE_OK)
        measure(kempe_model_name(model), model);
    else
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
    kempe_context_free(context);
}

int bench_articulated(int argc, char **argv)
{
    static const int sizes[] = {4, 8, 12, 16, 20, 24, 32, 50, 100, 200, 400};
    int largest = argc > 1 ? atoi(argv[1]) : 400;
    printf("%32s", "");
    for (int k = 0; k < WAYS; k++)
        printf(" | %-43s", words[k]);
    printf(" | %s\n%-22s %4s %4s", "times more", "", "n", "m");
    for (int k = 0; k < WAYS; k++)
        printf(" | %8s %8s %9s %5s %9s", "derive s", "program", "solves", "rhs", "us a rhs");
    printf(" | %6s %6s  %s\n", "oper.", "time", "auto takes");
    for (int binary = 0; binary < 2; binary++)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes && sizes[k] <= largest; k++)
            measure_tree(sizes[k], binary);
    for (int k = 2; k < argc; k++)
        measure_file(argv[k]);
    return 0;
}
