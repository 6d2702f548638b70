/* SPDX-License-Identifier: BSD-3-Clause */
/* Residuals of closures, scaled by row, and the rows that count in them. A model of rounded numbers can have dependent
 * rows that agree only roughly. As many rows as the rank exceeds are dropped, and what stays open in them, the misfit,
 * is reported apart from the residual. */
#include "constraints/evaluation/residuals.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include <math.h>
#include <string.h>

bool kmp_eval_counts(const kmp_evaluator *eval, int row)
{
    return !eval->unmet.dropped[row] && (!eval->unmet.left_out || !eval->unmet.left_out[row]);
}

void kmp_eval_drop(kmp_evaluator *eval, int count, const int *rows)
{
    if (!kmp_rounding_of(eval->system))
        return;
    memset(eval->unmet.dropped, 0, (size_t)eval->m * sizeof *eval->unmet.dropped);
    for (int k = 0; k < count; k++)
        eval->unmet.dropped[rows[k]] = true;
}

void kmp_eval_drop_widest(kmp_evaluator *eval)
{
    const kmp_rounding *rounding = kmp_rounding_of(eval->system);
    if (!rounding)
        return;
    memset(eval->unmet.dropped, 0, (size_t)eval->m * sizeof *eval->unmet.dropped);
    for (int k = rounding->rank; k < eval->m; k++) {
        int widest = -1;
        for (int r = 0; r < eval->m; r++)
            if (!eval->unmet.dropped[r] && (widest < 0 || kmp_eval_opening(eval, r) > kmp_eval_opening(eval, widest)))
                widest = r;
        eval->unmet.dropped[widest] = true;
    }
}

double kmp_eval_opening(const kmp_evaluator *eval, int row)
{
    return fabs(eval->h[row]) / eval->system->row_scale[row];
}

double kmp_eval_misfit(const kmp_evaluator *eval, int *row)
{
    double widest = 0;
    *row = -1;
    for (int r = 0; r < eval->m; r++)
        if (eval->unmet.dropped[r] && !(eval->unmet.left_out && eval->unmet.left_out[r]) &&
            !(kmp_eval_opening(eval, r) <= widest)) {
            widest = kmp_eval_opening(eval, r);
            *row = r;
        }
    return widest;
}

double kmp_eval_residual(const kmp_evaluator *eval)
{
    double worst = 0;
    for (int r = 0; r < eval->m; r++) {
        double open = kmp_eval_counts(eval, r) ? kmp_eval_opening(eval, r) : 0;
        if (!(open <= worst))
            worst = isnan(open) ? INFINITY : open;
    }
    return worst;
}

double kmp_eval_rate_residual(const kmp_evaluator *eval, const double *qd)
{
    const kmp_pattern *p = &eval->system->jacobian;
    double worst = 0;
    for (int r = 0, k = 0; r < eval->m; r++) { /* entries are in row-major order */
        double rate = eval->h_t ? eval->h_t[r] : 0;
        for (; k < p->count && p->row[k] == r; k++)
            rate += eval->jacobian[k] * qd[p->col[k]];
        if (kmp_eval_counts(eval, r))
            worst = fmax(worst, fabs(rate) / eval->system->row_scale[r]);
    }
    return worst;
}

double kmp_eval_size(const kmp_evaluator *eval, const double *x)
{
    double size = 0;
    for (int i = 0; i < eval->n; i++)
        size = fmax(size, fabs(x[i]) / eval->system->scale[i]);
    return size;
}
