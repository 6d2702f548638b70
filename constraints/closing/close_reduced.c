/* SPDX-License-Identifier: BSD-3-Clause */
/* The correction dv = -Jv^-1 h for given u as a kmp_closer, with the blocks of a reduction. */
#include "constraints/closing/close_reduced.h"
#include "constraints/closing/close.h"

static int place(void *self, double t, const double *q)
{
    kmp_reduction *red = self;
    kmp_eval_closure(red->eval, t, q);
    return kmp_reduction_factor(red);
}

static bool correct(void *self, const double *violation, double *dv)
{
    kmp_reduction *red = self;
    (void)violation, (void)dv; /* h, in place */
    kmp_reduction_correction(red);
    red->newton++;
    return true;
}

int kmp_reduction_close(kmp_reduction *red, double t, double *q, const double *w, double fraction)
{
    const kempe_system *s = red->eval->system;
    const kmp_closer closer = {.self = red,
                               .eval = red->eval,
                               .scale = s->scale,
                               .count = red->r,
                               .at = red->part->v,
                               .dx = red->dv,
                               .rows = red->part->rows,
                               .row_count = red->r,
                               .place = place,
                               .correct = correct};
    const kmp_close_rule rule = {
        .most = KMP_CLOSING_PASSES, .contracting = true, .enough = kmp_close_rounding(s), .w = w, .fraction = fraction};
    return !kmp_close(&closer, &rule, t, q).closed;
}
