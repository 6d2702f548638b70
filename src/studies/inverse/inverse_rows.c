/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of an inverse dynamics study, and their summary. */
#include "output/print.h"
#include "output/series_summary.h"
#include "studies/inverse/inverse_study.h"
#include <kempe/inverse.h>
#include <math.h>

double kmp_inverse_unmet(const kempe_inverse *inverse)
{
    return inverse->size > 0 ? inverse->unmet / inverse->size : 0;
}

kmp_inverse_summary kmp_inverse_summarise(const kempe_inverse *inverse, int k)
{
    const kempe_inverse *r = inverse;
    kmp_inverse_summary s = {0};
    for (int row = 0; row < r->rows; row++) {
        double tau = *kmp_inverse_part(r, row, r->at.tau + k), power = *kmp_inverse_part(r, row, r->at.power + k);
        if (row == 0 || fabs(tau) > fabs(s.peak)) {
            s.peak = tau;
            s.peak_t = r->t[row];
        }
        if (row == 0 || fabs(power) > fabs(s.power)) {
            s.power = power;
            s.power_t = r->t[row];
        }
        if (row > 0) {
            double h = r->t[row] - r->t[row - 1];
            s.work += h / 2 * (power + *kmp_inverse_part(r, row - 1, r->at.power + k));
        }
    }
    s.rms = kmp_series_summarise(r->rows, r->t, r->value + r->at.tau + k, r->width).rms;
    return s;
}

KMP_GETTER(const char *kempe_inverse_status(const kempe_inverse *inverse), inverse,
           kmp_checked_word(inverse->status, !inverse->unchecked), "")
KMP_GETTER(const char *kempe_inverse_reason(const kempe_inverse *inverse), inverse, inverse->reason, "")
KMP_GETTER(const char *kempe_inverse_loads_not_unique(const kempe_inverse *inverse), inverse, inverse->not_unique, "")
KMP_GETTER(int kempe_inverse_dof(const kempe_inverse *inverse), inverse, inverse->freedoms, 0)
KMP_GETTER(int kempe_inverse_rank(const kempe_inverse *inverse), inverse, inverse->rank, 0)
KMP_GETTER(double kempe_inverse_residual(const kempe_inverse *inverse), inverse, inverse->residual, NAN)
