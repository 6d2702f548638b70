/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced equations of motion in implicit form, for an integrator of F(t, y, y') = 0: no reduced mass is factored,
 * and a residual needs none. With y = (u, ud[, work]):
 *
 *     u' - ud = 0      X' (M qdd + C) = 0, qdd = X ud' + a0      work' - power = 0 */
#include "integrators/formulations/reduced.h"
#include <math.h>
#include <string.h>

/* Evaluates the state of a residual: q, qd, M and C. */
static int prepare_residual(kmp_reduced *d, double t, const double *y)
{
    if (kmp_reduced_place(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_eval_mass(d->eval);
    kmp_eval_bias(d->eval, d->qd);
    return KMP_GO;
}

static int residual(void *self, double t, const double *y, const double *yp, double *r)
{
    kmp_reduced *d = self;
    if (prepare_residual(d, t, y) != KMP_GO)
        return KMP_RETRY;
    memcpy(d->udd, yp + d->p, (size_t)d->p * sizeof *d->udd);
    kmp_reduction_residual(&d->red, d->udd, r + d->p);
    for (int k = 0; k < d->p; k++) {
        r[k] = yp[k] - y[d->p + k];
        if (!isfinite(r[d->p + k]))
            return KMP_RETRY;
    }
    if (d->has_work)
        r[kmp_reduced_work(d)] =
            yp[kmp_reduced_work(d)] - kmp_eval_power_here(d->eval, d->qd) - kmp_reduced_drive_power(d);
    return KMP_GO;
}

static int matrix(void *self, double t, double cj, const double *y, const double *yp, double *values)
{
    kmp_reduced *d = self;
    if (prepare_residual(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_reduction_residual(&d->red, yp + d->p, d->udd); /* for a0 */
    const kmp_dae *dae = &d->formulation.dae;
    memset(d->jacobian, 0, (size_t)(dae->n * dae->n) * sizeof *d->jacobian);
    kmp_reduced_jacobian_of_residual(&d->tangents, t, cj, d->q, d->qd, yp + d->p, dae->n, d->jacobian);
    for (int c = 0; c < dae->n; c++)
        for (long k = dae->col_start[c]; k < dae->col_start[c + 1]; k++)
            values[k] = d->jacobian[dae->row[k] + (long)c * dae->n];
    return KMP_GO;
}

/* Evaluates the step's end, which the integrator has not done; corrects nothing. */
static int accept(void *self, double t, const double *y, const double *yp)
{
    kmp_reduced *d = self;
    kmp_reduced_program_end end;
    (void)yp;
    if (kmp_reduced_evaluate(d, t, y) != KMP_GO || kmp_reduced_come_to_end(d, t, y, &end) != KMP_GO)
        return KMP_RETRY;
    return kmp_reduced_may_end(d, t, y, &end);
}

/* Pattern of column k: u'[k] or -ud[k], then the rows of the motion and of the work, which are full. */
static int fill_pattern(const kmp_reduced *d, long *col_start, long *row)
{
    int nz = 0, size = d->formulation.size;
    for (int c = 0; c < size; c++) {
        col_start[c] = nz;
        if (c < 2 * d->p)
            row[nz++] = c % d->p;
        for (int i = c < 2 * d->p ? d->p : c; i < size; i++)
            row[nz++] = i;
    }
    col_start[size] = nz;
    return nz;
}

kempe_status kmp_reduced_describe(kmp_reduced *d, double t)
{
    kmp_arena *a = &d->formulation.arena;
    int size = d->formulation.size;
    long *col_start = KMP_ARENA_NEW(a, long, size + 1), *row = KMP_ARENA_NEW(a, long, size *(size + 1));
    double *ones = KMP_ARENA_NEW(a, double, size);
    d->jacobian = KMP_ARENA_NEW(a, double, size *size);
    d->formulation.yp = KMP_ARENA_NEW(a, double, size);
    KMP_TRY(kmp_made(d->s->context, !a->failed));
    for (int i = 0; i < size; i++)
        ones[i] = 1;
    d->formulation.dae = (kmp_dae){.n = size,
                                   .nz = fill_pattern(d, col_start, row),
                                   .col_start = col_start,
                                   .row = row,
                                   .differential = ones,
                                   .factor = ones,
                                   .self = d,
                                   .residual = residual,
                                   .matrix = matrix,
                                   .accept = accept};
    if (kmp_reduced_rhs(d, t, d->formulation.y, d->formulation.yp) == KMP_GO)
        return KEMPE_OK;
    return kmp_fail(d->s->context, KEMPE_E_FAILED, "the accelerations cannot be evaluated at t = %.9g", t);
}
