/* SPDX-License-Identifier: BSD-3-Clause */
/* Linear solvers of the dae formulation by size and fill: for each model and solver the entries of the matrix and of
 * its factors, the first factorisation with its analysis, a later one, a solution (at the start), and a run to 0.2 s
 * with rtol 1e-6, whose runs take turns; one that takes more than 2 s has no time.
 *
 *     bench linear_solvers MODEL ...
 *
 * "windows N" is a chain of N windows in a plane, whose equations stay sparse; "ring N" a closed chain of N bars with
 * two rotations each, whose mass matrix in joint coordinates is full. */
#include "bench.h"
#include "chain.h"
#include "integrators/run/methods.h"
#include "integrators/sundials/linear.h"
#include "iteration_matrix.h"
#include "linalg/sparse.h"
#include <kempe/check.h>
#ifdef KEMPE_UMFPACK
#include <umfpack.h>
#endif

enum { MOST_DENSE = 1300, TURNS = 3, MOST_SOLVERS = 8 };
#define MOST_S 2.0 /* of a run; a longer one is given up and has no time */

/* A regular polygon of N bars from a point of the ground back to it, each on two rotations, which falls. */
static char *ring_text(int n)
{
    kmp_text t = {0};
    kmp_text_put(&t, "kempe: 1\nname: ring\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
    for (int i = 0; i < n; i++) {
        kmp_text_printf(&t, "  b%d: {joint: {name: j%d, motions: [R3, R2], at: ", i, i);
        kmp_text_printf(&t, i > 0 ? "b%d.T" : "ground.O", i - 1);
        kmp_text_put(&t, "}, mass: 1, com: [0.05, 0, 0], inertia: {xx: 1e-4, yy: 1e-3, zz: 1e-3}, "
                         "points: {T: [0.1, 0, 0]}}\n");
    }
    kmp_text_printf(&t, "loops:\n  C: {ball: [b%d.T, ground.O]}\nstart:\n  q: {", n - 1);
    for (int i = 0; i < n; i++)
        kmp_text_printf(&t, "%sj%d.1: %.17g deg, j%d.2: %d deg", i > 0 ? ", " : "", i, i > 0 ? 360.0 / n : 0, i,
                        i % 3 - 1);
    kmp_text_put(&t, "}\n");
    return kmp_text_take(&t);
}

static bool load(bench *b, const char *model)
{
    bool windows = strncmp(model, "windows ", 8) == 0, ring = strncmp(model, "ring ", 5) == 0;
    if (!windows && !ring) {
        *b = bench_load(model);
        return true;
    }
    char *text = windows ? chain_text(atoi(model + 8), false, 0) : ring_text(atoi(model + 5));
    *b = (bench){kempe_context_new(), NULL, NULL};
    bool made = text && kempe_model_read_text(b->context, text, model, &b->model) == KEMPE_OK &&
                kempe_system_new(b->model, &b->system) == KEMPE_OK;
    free(text);
    return made;
}

typedef struct result {
    const char *name;
    long fill;
    double first, again, solve, run_s;
    long factored, solved;
} result;

/* The first factorisation: made anew for each sample. */
static double time_of_first(kmp_runner *run, const char *name)
{
    double sample[SAMPLES];
    for (int k = 0; k < SAMPLES; k++) {
        place p;
        open_place(&p, run, name, 1e-3 / run->rate_scale);
        differentiate(&p);
        double from = bench_now();
        factor(&p);
        sample[k] = bench_now() - from;
        close_place(&p);
    }
    return bench_median(SAMPLES, sample);
}

static void measure(kmp_runner *run, result *r)
{
    place p;
    r->first = time_of_first(run, r->name);
    open_place(&p, run, r->name, 1e-3 / run->rate_scale);
    evaluate(&p);
    differentiate(&p);
    r->again = time_of(&p, factor);
    r->solve = time_of(&p, solve);
    r->fill = kmp_linear_fill(p.solver);
    close_place(&p);
}

#ifdef KEMPE_UMFPACK
/* UMFPACK's symbolic analysis alone. */
static double time_of_symbolic(kmp_runner *run)
{
    double sample[SAMPLES];
    place p;
    open_place(&p, run, "umfpack", 1e-3 / run->rate_scale);
    long *start = (long *)SUNSparseMatrix_IndexPointers(p.matrix), *row = (long *)SUNSparseMatrix_IndexValues(p.matrix);
    for (int k = 0; k < SAMPLES; k++) {
        void *symbolic = NULL;
        double from = bench_now();
        (void)umfpack_dl_symbolic(p.dae->n, p.dae->n, start, row, NULL, &symbolic, NULL, NULL);
        sample[k] = bench_now() - from;
        umfpack_dl_free_symbolic(&symbolic);
    }
    close_place(&p);
    return bench_median(SAMPLES, sample);
}
#endif

/* Operations of a factorisation and a solution, by KLU's estimate and dense. */
static void report_operations(const char *model, const kmp_dae *dae)
{
    double n = dae->n;
    kmp_sparse *sparse = kmp_sparse_new_columns(dae->n, dae->nz);
    if (sparse && kmp_sparse_take_columns(sparse, dae->col_start, dae->row))
        printf("%-22s operations: klu %.0f, dense %.0f, %.1f times as many\n", model, kmp_sparse_operations(sparse),
               n * n * (2 * n / 3 + 2), n * n * (2 * n / 3 + 2) / kmp_sparse_operations(sparse));
    kmp_sparse_free(sparse);
}

static void run_by_turns(const bench *b, const kempe_assembly *start, int count, result *r)
{
    for (int turn = 0; turn < TURNS; turn++)
        for (int k = 0; k < count; k++) {
            if (isnan(r[k].run_s))
                continue;
            kmp_run_spec spec = {
                .formulation = "dae", .linear = r[k].name, .rtol = 1e-6, .t_end = 0.2, .limit_s = MOST_S};
            kmp_run_report report = {0};
            bool made = kmp_run_resolve(b->system, &spec) == KEMPE_OK &&
                        kmp_run(b->system, &spec, start, drop_row, NULL, &report) == KEMPE_OK;
            r[k].run_s = !made ? NAN : turn == 0 ? report.cpu_s : fmin(r[k].run_s, report.cpu_s);
            r[k].factored = report.factorizations;
            r[k].solved = report.newton;
            free(report.reason);
        }
}

static void report(const char *model, const bench *b, const kmp_runner *run, int count, const result *r)
{
    const kmp_dae *dae = &run->formulation->dae;
    for (int k = 0; k < count; k++)
        printf("%-22s %5d %5d %7d | %-7s %8ld %5.1f | %9.1f %9.1f %9.1f | %5ld %6ld %9.2f\n", model, b->system->n,
               dae->n, dae->nz, r[k].name, r[k].fill, (double)r[k].fill / dae->nz, 1e6 * r[k].first, 1e6 * r[k].again,
               1e6 * r[k].solve, r[k].factored, r[k].solved, 1e3 * r[k].run_s);
}

static void one(const char *model, const bench *b, const kempe_assembly *start)
{
    kmp_run_spec spec = {.formulation = "dae", .integrator = "ida", .rtol = 1e-6, .t_end = 0.2};
    kmp_runner *run = NULL;
    result r[MOST_SOLVERS] = {{0}};
    int count = 0;
    if (kmp_run_resolve(b->system, &spec) || kmp_runner_new(b->system, &spec, start, &run)) {
        printf("%s: %s\n", model, kempe_context_message(b->context));
        kmp_runner_free(run);
        return;
    }
    for (int k = 0; kmp_linear_name(k) && count < MOST_SOLVERS; k++)
        if (strcmp(kmp_linear_name(k), "dense") != 0 || run->formulation->dae.n <= MOST_DENSE)
            r[count++].name = kmp_linear_name(k);
    for (int k = 0; k < count; k++)
        measure(run, &r[k]);
    run_by_turns(b, start, count, r);
    report(model, b, run, count, r);
    report_operations(model, &run->formulation->dae);
#ifdef KEMPE_UMFPACK
    printf("%-22s symbolic analysis of umfpack: %.1f us\n", model, 1e6 * time_of_symbolic(run));
#endif
    kmp_runner_free(run);
}

int bench_linear_solvers(int argc, char **argv)
{
    printf("%-22s %5s %5s %7s | %-7s %8s %5s | %9s %9s %9s | %5s %6s %9s\n", "", "co-", "un-", "", "", "entries",
           "ratio", "us of the", "us of a", "us of a", "fac-", "so-", "ms of the");
    printf("%-22s %5s %5s %7s | %-7s %8s %5s | %9s %9s %9s | %5s %6s %9s\n", "model", "ord.", "known", "entries",
           "solver", "L + U", "", "first", "later", "solution", "tors", "lut.", "run");
    for (int k = 1; k < argc; k++) {
        const char *slash = strrchr(argv[k], '/');
        bench b;
        kempe_assembly *start = NULL;
        if (!load(&b, argv[k]) || kempe_assembly_new(b.system, &start)) {
            printf("%s: %s\n", argv[k], kempe_context_message(b.context));
            continue;
        }
        one(slash ? slash + 1 : argv[k], &b, start);
        fflush(stdout);
        kempe_assembly_free(start);
        bench_free(&b);
    }
    return 0;
}
