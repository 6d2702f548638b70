/* SPDX-License-Identifier: BSD-3-Clause */
/* Exchange of independent and dependent coordinates: when it is due, and which ones are exchanged. v = B u + ...; a
 * large entry of the scaled B says that u is near to a dead centre. The decisions of every choice of coordinates, of
 * runs, of lanes and of generated simulators, which have this file too. */
#pragma once

#include "integrators/decide/inlined.h"
#include "linalg/dense/factors.h"

/* B is to be computed again after the exchange of an entry of this size: its rounding is large. */
#define KMP_EXCHANGE_LONG_DUE 100.0

/** The growth of B, scaled, beyond which an exchange is due: of a user's choice, or of a choice on which only the
 * right-hand side depends. */
KMP_INLINE double kmp_exchange_limit(bool of_user, bool closed)
{
    return of_user ? KMP_EXCHANGE_WISH : closed ? KMP_EXCHANGE_CLOSED : KMP_EXCHANGE_GROWTH;
}

/** The largest entry of B (r x p, column by column), scaled, infinite if an entry is not finite; *v and *u: the
 * coordinates of it, -1 where all are zero. */
KMP_INLINE double kmp_exchange_growth(int r, const int *v, int p, const int *u, const double *b, const double *scale,
                                      int *worst_v, int *worst_u)
{
    double worst = 0;
    *worst_v = *worst_u = -1;
    for (int k = 0; k < p; k++)
        for (int i = 0; i < r; i++) {
            double size = fabs(b[i + (ptrdiff_t)k * r]) * scale[u[k]] / scale[v[i]];
            if (size > worst || !(size <= DBL_MAX)) {
                worst = size <= DBL_MAX ? size : INFINITY;
                *worst_v = v[i];
                *worst_u = u[k];
            }
        }
    return worst;
}

/** Finds the largest entry of column k of B, and its row. */
KMP_INLINE void kmp_exchange_look(int r, const double *b, int k, double *most, int *at)
{
    most[k] = at[k] = 0;
    for (int i = 0; i < r; i++) {
        const double size = fabs(b[i + (ptrdiff_t)k * r]);
        at[k] = size > most[k] ? i : at[k];
        most[k] = size > most[k] ? size : most[k];
    }
}

/** Exchanges v_i and u_k of the largest entries of the scaled B, one after the other, until none exceeds `growth`, for
 * `left` times at most, or until B is to be computed again. column: coordinates v (r), then u (p). Room: most and at,
 * p. Returns the number of exchanges; *largest: the largest entry before them. */
static inline int kmp_exchange_columns(int r, int p, double *b, int *column, double growth, int left, double *most,
                                       int *at, double *largest)
{
    double size = 0;
    for (int k = 0; k < p; k++)
        kmp_exchange_look(r, b, k, most, at);
    *largest = 0;
    for (int count = 0;; count++) {
        int k = 0;
        for (int j = 1; j < p; j++)
            k = most[j] > most[k] ? j : k;
        *largest = p > 0 && count == 0 ? most[k] : *largest;
        if (p == 0 || count >= left || size >= KMP_EXCHANGE_LONG_DUE || !(most[k] > growth))
            return count;
        /* v = B u solved for u_k and inserted into the other rows. */
        const int i = at[k];
        double *leaving = b + (ptrdiff_t)k * r;
        size = most[k];
        for (int j = 0; j < p; j++)
            if (j != k && kmp_exchange_column(r, i, leaving, b + (ptrdiff_t)j * r))
                kmp_exchange_look(r, b, j, most, at);
        kmp_exchange_pivot(r, i, leaving);
        kmp_exchange_look(r, b, k, most, at);
        kmp_swap_int(&column[i], &column[r + k]);
    }
}
