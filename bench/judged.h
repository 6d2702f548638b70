/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of the benchmarks of solvers: a run whose rows are compared with reference digits as they come. */
#ifndef KEMPE_BENCH_JUDGED_H
#define KEMPE_BENCH_JUDGED_H

#include "base/memory.h"
#include "bench.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "model/data/force.h"
#include "output/reference.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

typedef struct judged {
    const bench *b;
    const kmp_reference *reference;
    kmp_evaluator *eval; /* for the residuals; may be NULL */
    double q, qd, lambda, h, hdot;
    kmp_run_report report;
    double cpu; /* median */
} judged;

static inline double judged_error(const judged *j, double t, kmp_quantity quantity, int count, const double *got)
{
    double worst = 0;
    for (int k = 0; k < j->reference->rows; k++)
        for (int i = 0; j->reference->t[k] == t && i < count; i++) {
            double ref = j->reference->value[quantity][k * count + i];
            if (!isnan(ref))
                worst = fmax(worst, fabs(got[i] - ref) / fmax(fabs(ref), 1));
        }
    return worst;
}

static inline int judged_row(void *user, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda, double work)
{
    judged *j = user;
    const kempe_system *s = j->b->system;
    (void)qdd, (void)work;
    j->q = fmax(j->q, judged_error(j, t, KMP_QUANTITY_Q, s->n, q));
    j->qd = fmax(j->qd, judged_error(j, t, KMP_QUANTITY_QD, s->n, qd));
    j->lambda = fmax(j->lambda, judged_error(j, t, KMP_QUANTITY_LAMBDA, s->m, lambda));
    if (j->eval) {
        kmp_eval_closure(j->eval, t, q);
        j->h = fmax(j->h, kmp_eval_residual(j->eval));
        j->hdot = fmax(j->hdot, kmp_eval_rate_residual(j->eval, qd));
    }
    return 0;
}

/* Median time of `runs` runs; false when one fails, with its reason printed. */
static inline bool judged_run(judged *j, kmp_run_spec *spec, const kempe_assembly *start, int runs)
{
    double cpu[32];
    if (kmp_run_resolve(j->b->system, spec) != KEMPE_OK)
        return false;
    for (int k = 0; k < runs; k++) {
        j->q = j->qd = j->lambda = j->h = j->hdot = 0;
        kempe_status status = kmp_run(j->b->system, spec, start, judged_row, j, &j->report);
        kmp_free(j->report.reason);
        if (status != KEMPE_OK)
            return false;
        cpu[k] = j->report.cpu_s;
    }
    j->cpu = bench_median(runs, cpu);
    return true;
}

#endif
