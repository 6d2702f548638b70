/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors of the estimates by the linearised model (Seber and Wild 1989, section 2.1): with J of the weighted residuals
 * and s^2 their sum of squares by the degrees of freedom, the covariance is s^2 (J'J)^-1. Columns of J are scaled to
 * norm 1, so that its singular values do not depend on units. Values below KMP_FIT_RANK are zero: along their right
 * vectors the data determines nothing. Parameters at bounds are left out. The degrees of freedom are the measurements
 * less the rank of J.
 *
 * A column has as many degrees of freedom as measurements, less the trace of its part of the projection J (J'J)^-1 J'
 * (Rao and Kleffe 1988, Estimation of Variance Components, section 5). A standard error whose columns' deviations come
 * from the residuals has the degrees of freedom of Satterthwaite (Biometrics Bulletin 2 (1946) 110). */
#include "ensemble/fit/fit_statistics.h"
#include "analyses/dense/singular_values.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "ensemble/fit/fit_study.h"
#include "ensemble/statistics/statistics.h"
#include <float.h>
#include <math.h>
#include <string.h>

typedef struct judge {
    kempe_fit *f;
    kmp_arena arena;
    int free, *which;      /* parameters that are not at bounds */
    double *scaled, *norm; /* residuals x free; of each column of J */
    double *covariance;    /* free x free */
    double *share;         /* columns: the part of a variance that each adds */
    kmp_singular svd;
} judge;

static void scale_columns(judge *j)
{
    const kempe_fit *f = j->f;
    for (int k = 0; k < j->free; k++) {
        const double *from = f->slope + (ptrdiff_t)j->which[k] * f->residuals;
        double *to = j->scaled + (ptrdiff_t)k * f->residuals, sum = 0;
        for (int i = 0; i < f->residuals; i++)
            sum += from[i] * from[i];
        j->norm[k] = sqrt(sum);
        for (int i = 0; i < f->residuals; i++)
            to[i] = sum > 0 ? from[i] / j->norm[k] : 0;
    }
}

double kmp_fit_slope_error(const kempe_fit *fit)
{
    double error = KMP_FIT_RANK * kmp_fit_rows(fit, 0)->rtol;
    for (int k = 0; k < fit->run_count; k++)
        error = fmax(error, kmp_fit_rows(fit, k)->slope_error);
    return error;
}

/* Degrees of freedom of the standard error of free parameter k. */
static double freedom_of(judge *j, int k)
{
    kempe_fit *f = j->f;
    double sum = 0, squares = 0;
    int i = 0;
    if (f->given)
        return f->freedoms;
    memset(j->share, 0, (size_t)f->columns * sizeof *j->share);
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at); i++) {
        double part = 0;
        for (int r = 0; r < f->rank; r++)
            part += j->svd.vt[r + k * j->svd.k] / j->svd.s[r] * j->svd.u[i + (ptrdiff_t)r * f->residuals];
        j->share[f->run[at.run].among[at.column]] += part * part;
    }
    for (int c = 0; c < f->columns; c++) {
        sum += j->share[c];
        squares += j->share[c] * j->share[c] / fmax(f->freedom[c], DBL_EPSILON);
    }
    return sum > 0 ? fmin(fmax(sum * sum / squares, 1), f->freedoms) : f->freedoms;
}

/* Takes as many combinations of parameters as the data determines: the others fit nothing, and leave the residuals
 * their degrees of freedom. */
static void take_rank(kempe_fit *f, int rank)
{
    double sum = 0;
    for (int i = 0; i < f->residuals; i++)
        sum += f->residual[i] * f->residual[i];
    f->rank = rank;
    f->freedoms = f->residuals - rank;
    f->scatter = sqrt(sum / f->freedoms);
}

static void give_errors(judge *j)
{
    kempe_fit *f = j->f;
    for (int k = 0; k < j->free; k++) {
        int p = j->which[k];
        if (f->state[p] == KMP_FIT_OPEN)
            continue;
        f->factor[p] = kmp_student_quantile(0.5 + 0.5 * f->confidence, freedom_of(j, k));
        f->error[p] = f->scatter * sqrt(j->covariance[k + k * j->free]) / j->norm[k];
        f->low[p] = f->value[p] - f->factor[p] * f->error[p];
        f->high[p] = f->value[p] + f->factor[p] * f->error[p];
        for (int i = 0; i < j->free; i++) {
            double both = j->covariance[k + k * j->free] * j->covariance[i + i * j->free];
            if (f->state[j->which[i]] != KMP_FIT_OPEN)
                f->correlation[p + j->which[i] * f->count] = j->covariance[k + i * j->free] / sqrt(both);
        }
    }
}

static kempe_status judge_free(judge *j)
{
    kempe_fit *f = j->f;
    ptrdiff_t size = (ptrdiff_t)f->residuals * j->free;
    KMP_TRY(kmp_made(f->context,
                     KMP_ARENA_MAKE(&j->arena, KMP_ROOM(double, size, &j->scaled), KMP_ROOM(double, j->free, &j->norm),
                                    KMP_ROOM(double, j->free * j->free, &j->covariance),
                                    KMP_ROOM(double, f->columns, &j->share)) &&
                         kmp_singular_init(&j->svd, &j->arena, f->residuals, j->free)));
    scale_columns(j);
    if (!kmp_singular_decompose(&j->svd, j->scaled))
        return kmp_fail(f->context, KEMPE_E_FAILED, "the singular values of the Jacobian could not be found");
    /* Right vectors of zero singular values have components of these parameters. */
    const double least = kmp_fit_slope_error(f);
    int rank = 0;
    while (rank < j->free && j->svd.s[rank] > least * j->svd.s[0])
        rank++;
    take_rank(f, rank);
    f->condition = j->free > 0 ? j->svd.s[0] / j->svd.s[j->free - 1] : 1;
    for (int r = f->rank; r < j->free; r++)
        for (int k = 0; k < j->free; k++)
            if (fabs(j->svd.vt[r + k * j->svd.k]) > KMP_FIT_MEMBER)
                f->state[j->which[k]] = KMP_FIT_OPEN;
    /* (J'J)^-1 of the scaled columns, on the directions that the data determines. */
    for (int a = 0; a < j->free; a++)
        for (int b = 0; b < j->free; b++) {
            double sum = 0;
            for (int r = 0; r < j->f->rank; r++)
                sum += j->svd.vt[r + a * j->svd.k] * j->svd.vt[r + b * j->svd.k] / (j->svd.s[r] * j->svd.s[r]);
            j->covariance[a + b * j->free] = sum;
        }
    /* Each column's measurements less the part of the parameters that these determine. */
    int i = 0;
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at); i++)
        for (int r = 0; r < f->rank; r++)
            f->freedom[f->run[at.run].among[at.column]] -=
                j->svd.u[i + (ptrdiff_t)r * f->residuals] * j->svd.u[i + (ptrdiff_t)r * f->residuals];
    for (int c = 0; c < f->columns; c++)
        f->freedom[c] = fmax(f->freedom[c], 0);
    give_errors(j);
    return KEMPE_OK;
}

kempe_status kmp_fit_judge(kempe_fit *fit)
{
    judge j = {.f = fit, .which = KMP_NEW(int, fit->count)};
    KMP_TRY(kmp_made(fit->context, j.which));
    /* A bound is reached within the part of the range that the search resolves. */
    for (int k = 0; k < fit->count; k++) {
        double range = fit->upper[k] - fit->lower[k];
        range = isfinite(range) ? range : fmax(fabs(fit->start[k]), fabs(fit->value[k]));
        fit->state[k] = fit->value[k] - fit->lower[k] <= KMP_FIT_BOUND * range   ? KMP_FIT_LOWER
                        : fit->upper[k] - fit->value[k] <= KMP_FIT_BOUND * range ? KMP_FIT_UPPER
                                                                                 : KMP_FIT_INSIDE;
    }
    for (int k = 0; k < fit->count; k++) {
        fit->error[k] = fit->low[k] = fit->high[k] = fit->factor[k] = NAN;
        for (int i = 0; i < fit->count; i++)
            fit->correlation[k + i * fit->count] = NAN;
        if (fit->state[k] == KMP_FIT_INSIDE)
            j.which[j.free++] = k;
    }
    fit->free = j.free;
    take_rank(fit, 0);
    for (int c = 0; c < fit->columns; c++)
        fit->freedom[c] = fit->number[c];
    kempe_status status = j.free > 0 ? judge_free(&j) : KEMPE_OK;
    kmp_arena_free(&j.arena);
    kmp_free(j.which);
    return status;
}

void kmp_fit_put_open(const kempe_fit *fit, kmp_text *text)
{
    int count = 0;
    for (int k = 0; k < fit->count; k++)
        count += fit->state[k] == KMP_FIT_OPEN;
    if (count == 0)
        return;
    kmp_text_put(text, count == 1 ? "the data does not determine the parameter "
                                  : "the data does not determine all of these parameters: ");
    for (int k = 0, named = 0; k < fit->count; k++)
        if (fit->state[k] == KMP_FIT_OPEN)
            kmp_text_printf(text, "%s%s", named++ ? ", " : "", fit->name[k]);
    kmp_text_printf(text, "; %d of %d combinations are determined; keep %s, or measure another motion", fit->rank,
                    fit->free, count == 1 ? "it at a known value" : "some at known values");
}
