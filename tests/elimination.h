/* SPDX-License-Identifier: BSD-3-Clause */
/* Linear equations with ALL unknowns, for programs beside the library. To be included after ALL, and after NUMBER where
 * they are complex. */
#ifndef ELIMINATION_H
#define ELIMINATION_H

#include <tgmath.h>

#ifndef NUMBER
#define NUMBER double
#endif

/* a x = b by elimination with row pivots; x in b. */
static void eliminate(NUMBER a[ALL][ALL], NUMBER b[ALL])
{
    for (int k = 0; k < ALL; k++) {
        int p = k;
        for (int i = k + 1; i < ALL; i++)
            p = fabs(a[i][k]) > fabs(a[p][k]) ? i : p;
        for (int j = 0; j < ALL; j++) {
            NUMBER x = a[k][j];
            a[k][j] = a[p][j];
            a[p][j] = x;
        }
        NUMBER x = b[k];
        b[k] = b[p];
        b[p] = x;
        for (int i = k + 1; i < ALL; i++) {
            NUMBER f = a[i][k] / a[k][k];
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
