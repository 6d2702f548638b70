/* SPDX-License-Identifier: BSD-3-Clause */
/* One clone of the lane loop for each width of vectors, with the same bits from each. */
#include "backend/sincos.h"
#include "base/clones.h"
#include "base/simd4.h"

#include <kempe/runtime.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

typedef double eight __attribute__((vector_size(64)));

/* The arguments are combined in registers: a wide load of values that were just stored one by one would have to wait.
 */
KMP_CLONES static void slots_of_8(const uint32_t *angle, const double *v, double *out)
{
    eight all = {v[angle[0]], v[angle[1]], v[angle[2]], v[angle[3]],
                 v[angle[4]], v[angle[5]], v[angle[6]], v[angle[7]]};
    double x[8];
    memcpy(x, &all, sizeof x);
    kempe_sincos8_core_(x, out, out + 8);
}

void kmp_sincos_slots(uint32_t n, const uint32_t *angle, const double *v, double *out)
{
    uint32_t i = 0;
    for (; i + 2 < n; i += 8, out += 16)
        slots_of_8(angle + i, v, out);
    for (; i < n; i++, out++)
        kempe_sincos(v[angle[i]], &out[0], &out[8]);
}
