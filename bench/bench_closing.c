/* SPDX-License-Identifier: BSD-3-Clause */
/* The forms of the reduced formulation at equal error: integrated, and newton, which closes the loops in every
 * evaluation, both by DOP853. An error is the largest at equidistant rows of the whole run. The reference is a run of
 * the projected formulation at a tolerance of 1e-13. A time is the least of several runs, which alternate between the
 * forms and have one row each. The ratio compares newton's runs with integrated ones, whose time is interpolated at the
 * same error. */
#include "bench.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { RUNS = 7, TOLERANCES = 8, FORMS = 2, ROWS = 240 };

static const double rtols[TOLERANCES] = {1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
static const char *const forms[FORMS] = {"integrated", "newton"};

typedef struct result {
    double error, cpu; /* s */
    kmp_run_report report;
} result;

/* Rows of q. */
typedef struct motion {
    int n, count;
    double *q; /* ROWS x n */
} motion;

static int keep_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    motion *m = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    memcpy(m->q + m->count++ * m->n, q, (size_t)m->n * sizeof *q);
    return 0;
}

/* With so many equidistant rows, the last one at the end. False: the run fails. */
static bool run_once(const bench *b, const kempe_assembly *start, kmp_run_spec spec, int rows, motion *m,
                     kmp_run_report *report)
{
    double times[ROWS];
    if (kmp_run_resolve(b->system, &spec) != KEMPE_OK)
        return false;
    for (int k = 0; k < rows; k++)
        times[k] = spec.t_end * (k + 1) / rows;
    spec.time_count = rows;
    spec.times = times;
    m->count = 0;
    *report = (kmp_run_report){0};
    bool good = kmp_run(b->system, &spec, start, keep_row, m, report) == KEMPE_OK;
    free(report->reason);
    return good;
}

static double error_of(const motion *reference, const motion *m)
{
    double worst = 0;
    for (int i = 0; i < ROWS * m->n; i++)
        worst = fmax(worst, fabs(m->q[i] - reference->q[i]) / fmax(1, fabs(reference->q[i])));
    return worst;
}

/* Time of the integrated form at an error, on the straight line through its two nearest runs in logarithms. */
static double time_at(const result *r, double error)
{
    for (int k = 0; k + 1 < TOLERANCES; k++)
        if (error <= r[k].error && error >= r[k + 1].error && r[k].error > r[k + 1].error) {
            double part = log(r[k].error / error) / log(r[k].error / r[k + 1].error);
            return r[k].cpu * pow(r[k + 1].cpu / r[k].cpu, part);
        }
    return NAN;
}

static void measure(const bench *b, const kempe_assembly *start, motion *reference, motion *m)
{
    result all[FORMS][TOLERANCES];
    kmp_run_report ignored;
    kmp_run_spec exact = {.formulation = "projected", .integrator = "dop853", .rtol = 1e-13};
    if (!run_once(b, start, exact, ROWS, reference, &ignored))
        return;
    for (int f = 0; f < FORMS; f++)
        for (int k = 0; k < TOLERANCES; k++) {
            const kmp_run_spec spec = {
                .formulation = "reduced", .form = forms[f], .integrator = "dop853", .rtol = rtols[k]};
            bool good = run_once(b, start, spec, ROWS, m, &ignored);
            all[f][k] = (result){.cpu = INFINITY, .error = good ? error_of(reference, m) : NAN};
        }
    for (int k = 0; k < TOLERANCES; k++)
        for (int turn = 0; turn < RUNS * FORMS; turn++) {
            result *r = &all[turn % FORMS][k];
            const kmp_run_spec spec = {
                .formulation = "reduced", .form = forms[turn % FORMS], .integrator = "dop853", .rtol = rtols[k]};
            if (run_once(b, start, spec, 1, m, &r->report))
                r->cpu = fmin(r->cpu, r->report.cpu_s);
        }
    for (int k = 0; k < TOLERANCES; k++) {
        const result *i = &all[0][k], *w = &all[1][k];
        printf("  %.0e | %8.1e %9.3f %6ld | %8.1e %9.3f %6ld %5.2f | %5.2f\n", rtols[k], i->error, 1e3 * i->cpu,
               i->report.rhs, w->error, 1e3 * w->cpu, w->report.rhs, (double)w->report.newton / (double)w->report.rhs,
               w->cpu / time_at(all[0], w->error));
    }
}

int bench_closing(int count, char **paths)
{
    static const char *const usual[] = {"examples/four_bar/four_bar.yaml", "examples/andrews/andrews.yaml",
                                        "examples/stewart/stewart.yaml", "examples/suspension/suspension.yaml"};
    int models = count > 1 ? count - 1 : (int)(sizeof usual / sizeof *usual);
    printf("          integrated                  newton\n");
    printf("  rtol  | error        ms     rhs   | error        ms     rhs  corrections | ratio at equal error\n");
    for (int k = 0; k < models; k++) {
        const char *path = count > 1 ? paths[k + 1] : usual[k];
        bench b = bench_load(path);
        kempe_assembly *start = NULL;
        motion reference = {.n = b.system->n, .q = calloc((size_t)(ROWS * b.system->n), sizeof(double))};
        motion m = {.n = b.system->n, .q = calloc((size_t)(ROWS * b.system->n), sizeof(double))};
        printf("%s\n", path);
        if (kempe_assembly_new(b.system, &start) == KEMPE_OK)
            measure(&b, start, &reference, &m);
        kempe_assembly_free(start);
        free(reference.q);
        free(m.q);
        bench_free(&b);
    }
    return 0;
}
