/* SPDX-License-Identifier: BSD-3-Clause */
/* The forms of the reduced formulation at equal error: integrated, and newton, which closes the loops in every
 * evaluation. Errors are at the end, against projected at a tolerance of 1e-13; times are the least of several runs by
 * turns. The ratio compares newton's runs with integrated ones, whose time is interpolated at the same error. */
#include "bench.h"
#include "integrators/run/run.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { RUNS = 7, TOLERANCES = 8, FORMS = 2 };

static const double rtols[TOLERANCES] = {1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
static const char *const forms[FORMS] = {"integrated", "newton"};

typedef struct result {
    double error, cpu; /* s */
    kmp_run_report report;
} result;

typedef struct ending {
    int n;
    double *q;
} ending;

static int keep_last(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                     double work)
{
    const ending *e = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    memcpy(e->q, q, (size_t)e->n * sizeof *q);
    return 0;
}

/* False: the run fails. */
static bool run_once(const bench *b, const kempe_assembly *start, kmp_run_spec spec, ending *e, kmp_run_report *report)
{
    double end;
    if (kmp_run_resolve(b->system, &spec) != KEMPE_OK)
        return false;
    end = spec.t_end;
    spec.time_count = 1;
    spec.times = &end;
    *report = (kmp_run_report){0};
    bool good = kmp_run(b->system, &spec, start, keep_last, e, report) == KEMPE_OK;
    free(report->reason);
    return good;
}

static void compare_with(const ending *reference, const ending *e, result *r)
{
    r->error = 0;
    for (int i = 0; i < e->n; i++)
        r->error = fmax(r->error, fabs(e->q[i] - reference->q[i]) / fmax(1, fabs(reference->q[i])));
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

static void measure(const bench *b, const kempe_assembly *start, ending *reference, ending *e)
{
    result all[FORMS][TOLERANCES];
    kmp_run_report ignored;
    kmp_run_spec exact = {.formulation = "projected", .rtol = 1e-13};
    if (!run_once(b, start, exact, reference, &ignored))
        return;
    for (int f = 0; f < FORMS; f++)
        for (int k = 0; k < TOLERANCES; k++)
            all[f][k] = (result){.cpu = INFINITY, .error = NAN};
    for (int k = 0; k < TOLERANCES; k++)
        for (int turn = 0; turn < RUNS * FORMS; turn++) {
            result *r = &all[turn % FORMS][k];
            kmp_run_spec spec = {.formulation = "reduced", .form = forms[turn % FORMS], .rtol = rtols[k]};
            if (!run_once(b, start, spec, e, &r->report))
                continue;
            compare_with(reference, e, r);
            r->cpu = fmin(r->cpu, r->report.cpu_s);
        }
    for (int k = 0; k < TOLERANCES; k++) {
        const result *i = &all[0][k], *w = &all[1][k];
        printf("  %.0e | %8.1e %9.3f %6ld | %8.1e %9.3f %6ld %5.2f | %5.2f\n", rtols[k], i->error, 1e3 * i->cpu,
               i->report.rhs, w->error, 1e3 * w->cpu, w->report.rhs, (double)w->report.newton / (double)w->report.rhs,
               w->cpu / time_at(all[0], w->error));
    }
}

int main(int count, char **paths)
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
        ending reference = {.n = b.system->n, .q = calloc((size_t)b.system->n, sizeof(double))};
        ending e = {.n = b.system->n, .q = calloc((size_t)b.system->n, sizeof(double))};
        printf("%s\n", path);
        if (kempe_assembly_new(b.system, &start) == KEMPE_OK)
            measure(&b, start, &reference, &e);
        kempe_assembly_free(start);
        free(reference.q);
        free(e.q);
        bench_free(&b);
    }
    return 0;
}
