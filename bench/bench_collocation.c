/* SPDX-License-Identifier: BSD-3-Clause */
/* CPU time of Radau IIA with its stages in lanes and of the other methods, which take turns in one run: milliseconds to
 * an error of q of 1e-6, 1e-8 and 1e-10. The error is the largest at ROWS times of the run over max(|q|, 1), against
 * the reduced formulation at rtol 1e-13. Each time is the least of several runs with one row.
 *
 *     bench collocation [-v] [NAME ..]
 */
#include "base/memory.h"
#include "bench.h"
#include "chain.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "output/samples.h"
#include "stiffened.h"
#include "trees.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { ROWS = 240, TARGETS = 3, MOST_POINTS = 24, TURNS = 3 };

static const double target[TARGETS] = {1e-6, 1e-8, 1e-10};

typedef struct method {
    const char *formulation, *form, *integrator;
} method;

static const method methods[] = {{"reduced", NULL, "dop853"},
                                 {"projected", NULL, "dop853"},
                                 {"reduced", "newton", "radau9"},
                                 {"reduced", NULL, "radau"},
                                 {"projected", NULL, "radau"}};

enum { METHODS = sizeof methods / sizeof *methods };

static char *windows_2(void)
{
    return chain_hanging(2);
}

static char *windows_10(void)
{
    return chain_hanging(10);
}

static char *windows_40(void)
{
    return chain_hanging(40);
}

static char *tree(void)
{
    return tree_text(TREE_BINARY, 29);
}

typedef struct problem {
    const char *name, *path;
    char *(*text)(void);
    double t_end;
    const char *given, *stiffness; /* a word of the file and the one in its place: explicit methods are left out */
} problem;

static const problem problems[] = {
    {.name = "four_bar", .path = "examples/four_bar/four_bar.yaml", .t_end = 5},
    {.name = "slider_crank", .path = "examples/slider_crank/slider_crank.yaml", .t_end = 10},
    {.name = "andrews", .path = "examples/andrews/andrews.yaml", .t_end = 0.03},
    {.name = "windows 2", .text = windows_2, .t_end = 10},
    {.name = "double_wishbone", .path = "examples/double_wishbone/double_wishbone.yaml", .t_end = 2},
    {.name = "windows 10", .text = windows_10, .t_end = 10},
    {.name = "stewart", .path = "examples/stewart/stewart.yaml", .t_end = 1},
    {.name = "tree 29", .text = tree, .t_end = 1},
    {.name = "suspension", .path = "examples/suspension/suspension.yaml", .t_end = 1},
    {.name = "windows 40", .text = windows_40, .t_end = 10},
    {.name = "limousine", .path = "examples/limousine/limousine.yaml", .t_end = 0.2},
    {.name = "governor", .path = "examples/governor/governor.yaml", .t_end = 10},
    {"governor x100", "examples/governor/governor.yaml", NULL, 10, "K: 8e5, c: 4e4", "K: 8e7, c: 4e6"},
    {"governor x10000", "examples/governor/governor.yaml", NULL, 10, "K: 8e5, c: 4e4", "K: 8e9, c: 4e8"},
};

/* -- runs ---------------------------------------------------------------------------------------------- */

typedef struct point {
    double rtol, error, ms;
    kmp_run_report report;
} point;

typedef struct curve {
    point points[MOST_POINTS];
    int count;
} curve;

static int ignore_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                      double work)
{
    (void)user, (void)t, (void)q, (void)qd, (void)qdd, (void)lambda, (void)work;
    return 0;
}

static bool run(const bench *b, const kempe_assembly *start, const method *w, double rtol, int rows, double t_end,
                kmp_samples *table, kmp_run_report *report)
{
    double times[ROWS];
    for (int k = 0; k < rows; k++)
        times[k] = k + 1 == rows ? t_end : t_end * (k + 1) / rows;
    kmp_run_spec spec = {.formulation = w->formulation,
                         .form = w->form,
                         .integrator = w->integrator,
                         .rtol = rtol,
                         .t_end = t_end,
                         .time_count = rows,
                         .times = times,
                         .limit_s = 2};
    *report = (kmp_run_report){0};
    bool good = kmp_run_resolve(b->system, &spec) == KEMPE_OK &&
                kmp_run(b->system, &spec, start, table ? kmp_samples_add : ignore_row, table, report) == KEMPE_OK;
    kmp_free(report->reason);
    return good;
}

static double error_of(const kmp_samples *table, const kmp_samples *reference)
{
    double worst = 0;
    const double *got = table->value[KMP_QUANTITY_Q], *ref = reference->value[KMP_QUANTITY_Q];
    for (int k = 0; k < reference->rows * reference->n; k++)
        worst = fmax(worst, fabs(got[k] - ref[k]) / fmax(fabs(ref[k]), 1));
    return worst;
}

/* A point more of a curve; false when the run fails or is as exact as the reference. */
static bool add_point(const bench *b, const kempe_assembly *start, const problem *p, const method *w, double rtol,
                      const kmp_samples *reference, curve *c)
{
    kmp_samples table;
    kmp_samples_init(&table, b->system->n, b->system->m);
    point *here = &c->points[c->count];
    *here = (point){.rtol = rtol, .ms = INFINITY};
    bool good = run(b, start, w, rtol, ROWS, p->t_end, &table, &here->report);
    if (good) {
        here->error = error_of(&table, reference);
        c->count++;
    }
    kmp_samples_free(&table);
    return good && here->error > 2e-12;
}

/* -- curves -------------------------------------------------------------------------------------------- */

/* The least time to an error, on lines between neighbouring points; INFINITY: not reached. */
static double time_to(const curve *c, double error)
{
    double best = INFINITY;
    for (int k = 0; k < c->count; k++) {
        const point *a = &c->points[k], *next = a + 1;
        if (a->error <= error)
            best = fmin(best, a->ms);
        if (k + 1 < c->count && a->error > error && next->error <= error) {
            double part = log(error / a->error) / log(next->error / a->error);
            best = fmin(best, exp((1 - part) * log(a->ms) + part * log(next->ms)));
        }
    }
    return best;
}

static void print_points(const method *w, const curve *c)
{
    for (int k = 0; k < c->count; k++) {
        const point *a = &c->points[k];
        printf("    %-9s %-6s %.1e | %8.1e %9.1f | %6ld %5ld %5ld %7ld %5ld %5ld | %9.4f\n", w->formulation,
               w->integrator, a->rtol, a->error, a->error / a->rtol, a->report.steps, a->report.rejected,
               a->report.refused, a->report.rhs, a->report.jacobians, a->report.factorizations, a->ms);
    }
}

static void print_problem(const problem *p, const curve *curves, bool verbose)
{
    double best[TARGETS] = {INFINITY, INFINITY, INFINITY};
    for (int w = 0; verbose && w < METHODS; w++)
        print_points(&methods[w], &curves[w]);
    for (int w = 0; w < METHODS; w++) {
        bool lanes = strcmp(methods[w].integrator, "radau") == 0;
        printf("  %-16s %-9s %-6s", p->name, methods[w].formulation, methods[w].integrator);
        for (int k = 0; k < TARGETS; k++) {
            double ms = time_to(&curves[w], target[k]);
            best[k] = lanes ? best[k] : fmin(best[k], ms);
            if (isfinite(ms))
                printf(" %9.4f", ms);
            else
                printf(" %9s", "-");
            if (lanes)
                printf(" (%5.2f)", best[k] / ms);
        }
        printf("\n");
    }
    fflush(stdout);
}

static void solve(const problem *p, bool verbose)
{
    bench b = {kempe_context_new(), NULL, NULL};
    kempe_assembly *start = NULL;
    kmp_samples reference;
    kmp_run_report report;
    static curve curves[METHODS];
    char *own = p->text ? p->text() : NULL;
    const char *text = p->stiffness ? stiffened(p->path, p->given, p->stiffness) : own;
    if ((text ? kempe_model_read_text(b.context, text, p->name, &b.model)
              : kempe_model_read(b.context, p->path, &b.model)) ||
        kempe_system_new(b.model, &b.system) || kempe_assembly_new(b.system, &start)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        exit(1);
    }
    memset(curves, 0, sizeof curves);
    kmp_samples_init(&reference, b.system->n, b.system->m);
    if (run(&b, start, &methods[p->stiffness ? 2 : 0], 1e-13, ROWS, p->t_end, &reference, &report))
        for (int w = 0; w < METHODS; w++)
            for (double e = -3; e >= -12.5 && (!p->stiffness || w >= 2); e -= 0.5)
                if (!add_point(&b, start, p, &methods[w], pow(10, e), &reference, &curves[w]))
                    break;
    for (int turn = 0; turn < TURNS; turn++)
        for (int w = 0; w < METHODS; w++)
            for (int k = 0; k < curves[w].count; k++) {
                point *a = &curves[w].points[k];
                for (int again = 0; again < (a->ms < 2 ? 5 : 1); again++)
                    if (run(&b, start, &methods[w], a->rtol, 1, p->t_end, NULL, &report))
                        a->ms = fmin(a->ms, 1e3 * report.cpu_s);
            }
    print_problem(p, curves, verbose);
    kmp_samples_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
    kmp_free(own);
}

static bool is_requested(const char *name, int count, char **names)
{
    for (int k = 0; k < count; k++)
        if (strcmp(names[k], name) == 0)
            return true;
    return count == 0;
}

int bench_collocation(int argc, char **argv)
{
    bool verbose = argc > 1 && strcmp(argv[1], "-v") == 0;
    printf("ms to an error of 1e-6, 1e-8, 1e-10 (times as fast as the best of the ways before)\n");
    for (size_t k = 0; k < sizeof problems / sizeof *problems; k++)
        if (is_requested(problems[k].name, argc - 1 - verbose, argv + 1 + verbose))
            solve(&problems[k], verbose);
    return 0;
}
