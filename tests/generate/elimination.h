/* SPDX-License-Identifier: BSD-3-Clause */
/* Linear equations of small size, for loops with ALL unknowns. To be included after ALL. */
#ifndef ELIMINATION_H
#define ELIMINATION_H

#include <math.h>

/* a x = b by elimination with row pivots; x in b. */
static void eliminate(double a[ALL][ALL], double b[ALL])
{
    for (int k = 0; k < ALL; k++) {
        int p = k;
        for (int i = k + 1; i < ALL; i++)
            p = fabs(a[i][k]) > fabs(a[p][k]) ? i : p;
        for (int j = 0; j < ALL; j++) {
            double x = a[k][j];
            a[k][j] = a[p][j];
            a[p][j] = x;
        }
        double x = b[k];
        b[k] = b[p];
        b[p] = x;
        for (int i = k + 1; i < ALL; i++) {
            double f = a[i][k] / a[k][k];
            for (int j = k; j < ALL; j++)
                a[i][j] -= f * a[k][j];
            b[i] -= f * b[k];
        }
    }
    for (int k = ALL - 1; k >= 0; k--) {
        for (int j = k + 1; j < ALL; j++)
            b[k] -= a[k][j] * b[j];
        b[k] /= a[k][k];
    }
}

#endif
