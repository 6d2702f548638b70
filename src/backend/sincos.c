/* SPDX-License-Identifier: BSD-3-Clause */
/* One clone of the lane loop a width of vectors, the same bits from each. */
#include "backend/sincos.h"
#include "backend/clones.h"

#include <kempe/runtime.h>
#include <stddef.h>

KMP_CLONES static void groups_of_8(int n, const double *x, double *s, double *c)
{
    for (int i = 0; i + 8 <= n; i += 8)
        kempe_sincos8_core_(x + i, s + i, c + i);
}

void kmp_sincos_many(int n, const double *x, double *s, double *c)
{
    int whole = n & ~7, rest = n & 7;
    if (whole)
        groups_of_8(whole, x, s, c);
    if (rest <= 2) {
        for (int i = whole; i < n; i++)
            kempe_sincos(x[i], &s[i], &c[i]);
    } else {
        double padded[8] = {0}, ps[8], pc[8];
        memcpy(padded, x + whole, (size_t)rest * sizeof *x);
        groups_of_8(8, padded, ps, pc);
        memcpy(s + whole, ps, (size_t)rest * sizeof *s);
        memcpy(c + whole, pc, (size_t)rest * sizeof *c);
    }
}

KMP_CLONES static void slots_of_8(int n, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    for (int k = 0; k < n; k++) {
        double sine[8], cosine[8];
        kempe_sincos8_core_(v + 8 * (size_t)x[k], sine, cosine);
        memcpy(v + 8 * (size_t)s[k], sine, sizeof sine);
        memcpy(v + 8 * (size_t)c[k], cosine, sizeof cosine);
    }
}

void kmp_sincos_slots(int n, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    slots_of_8(n, v, x, s, c);
}
