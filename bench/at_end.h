/* SPDX-License-Identifier: BSD-3-Clause */
/* The error of q at the end of a run, against a reference with a row there. */
#ifndef KEMPE_BENCH_AT_END_H
#define KEMPE_BENCH_AT_END_H

#include "output/reference.h"
#include <math.h>

static inline double bench_error_at_end(const kmp_reference *reference, int n, double t_end, const double *q)
{
    double worst = 0;
    for (int k = 0; k < reference->rows; k++)
        for (int i = 0; reference->t[k] == t_end && i < n; i++) {
            double ref = reference->value[KMP_QUANTITY_Q][k * n + i];
            if (!isnan(ref))
                worst = fmax(worst, fabs(q[i] - ref) / fmax(fabs(ref), 1));
        }
    return worst;
}

#endif
