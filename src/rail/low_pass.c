/* SPDX-License-Identifier: BSD-3-Clause */
/* The transfer function is the sum of r/(s - p) over the poles p and their conjugates (S. Butterworth, Wireless
 * Engineer 7 (1930) 536). Each term is a state z' = p z + u, advanced exactly: u is linear between two samples. */
#include "rail/low_pass.h"
#include "base/memory.h"
#include <complex.h>
#include <stddef.h>

static const double two_pi = 6.283185307179586476925286766559;

enum { BUTTERWORTH = 4, PAIRS = BUTTERWORTH / 2 };

/* z after a step h is grow z + first u0 + last u1. Without a step u jumps. */
typedef struct advance {
    double complex grow, first, last;
} advance;

bool kmp_low_pass(double cutoff, int count, int stride, const double *t, int signals, const double *in, double *out)
{
    double complex pole[PAIRS], residue[PAIRS], *state = KMP_NEW(double complex, PAIRS *signals);
    /* The poles above the real axis, and their residues. */
    const double w = two_pi * cutoff;
    double complex all[BUTTERWORTH];
    for (int k = 0; k < BUTTERWORTH; k++)
        all[k] = w * cexp(I * (two_pi / 2) * (2 * k + BUTTERWORTH + 1) / (2 * BUTTERWORTH));
    for (int k = 0; k < PAIRS; k++) {
        pole[k] = all[k];
        residue[k] = w * w * w * w;
        for (int i = 0; i < BUTTERWORTH; i++)
            residue[k] /= i == k ? 1 : all[k] - all[i];
    }
    for (int s = 0; state && s < signals; s++) {
        out[(ptrdiff_t)s * count] = in[(ptrdiff_t)s * count];
        for (int i = 0; i < PAIRS; i++)
            state[PAIRS * s + i] = -in[(ptrdiff_t)s * count] / pole[i];
    }
    for (int k = stride; state && k < count; k += stride) {
        advance step[PAIRS];
        for (int i = 0; i < PAIRS; i++) {
            const double h = t[k] - t[k - stride];
            const double complex grow = cexp(pole[i] * h), held = (grow - 1) / pole[i];
            const double complex ramp = h > 0 ? (held / h - 1) / pole[i] : 0;
            step[i] = (advance){grow, held - ramp, ramp};
        }
        for (int s = 0; s < signals; s++) {
            const ptrdiff_t at = (ptrdiff_t)s * count + k;
            double complex *z = state + PAIRS * s;
            double sum = 0;
            for (int i = 0; i < PAIRS; i++) {
                z[i] = step[i].grow * z[i] + step[i].first * in[at - stride] + step[i].last * in[at];
                sum += 2 * creal(residue[i] * z[i]);
            }
            out[at] = sum;
        }
    }
    const bool good = state;
    kmp_free(state);
    return good;
}
