/* SPDX-License-Identifier: BSD-3-Clause */
/* One clone of the lane loop for each width of vectors, with the same bits from each. */
#include "backend/sincos.h"
#include "base/clones.h"
#include <kempe/runtime.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

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

/* -- lanes ----------------------------------------------------------------------------------------------- */

enum { WIDEST = 16 };

/* Each part for all lanes before the next part: the chains of two registers overlap. Numbers |x| beyond the limit and
 * NaN make beyond[l] negative. */
static KMP_INTO_CLONES void angle(size_t w, const double *restrict x, double *restrict s, double *restrict c,
                                  int64_t *restrict beyond)
{
    double r[WIDEST], y[WIDEST], z[WIDEST], a[WIDEST], b[WIDEST];
    uint64_t quadrant[WIDEST];
    for (size_t l = 0; l < w; l++)
        beyond[l] |= KMP_SINCOS_LIMIT_BITS - (int64_t)kempe_bits_(fabs(x[l]));
    for (size_t l = 0; l < w; l++)
        quadrant[l] = kempe_reduce_(fabs(x[l]), &r[l], &y[l]);
    for (size_t l = 0; l < w; l++)
        z[l] = r[l] * r[l];
    for (size_t l = 0; l < w; l++)
        a[l] = kempe_sine_(r[l], y[l], z[l]);
    for (size_t l = 0; l < w; l++)
        b[l] = kempe_cosine_(r[l], y[l], z[l]);
    for (size_t l = 0; l < w; l++)
        kempe_place_(x[l], quadrant[l], a[l], b[l], &s[l], &c[l]);
}

/* The angles of a call by their slots. */
typedef struct call {
    int n;
    double *v;
    const uint32_t *x, *s, *c;
} call;

/* The limit is tested once for all angles: their computations then overlap. *any is negative if an argument is beyond
 * it. */
static KMP_INTO_CLONES void angles(size_t w, const call *all, int64_t *any)
{
    int64_t beyond[WIDEST] = {0};
    for (int k = 0; k < all->n; k++)
        angle(w, all->v + w * all->x[k], all->v + w * all->s[k], all->v + w * all->c[k], beyond);
    for (size_t l = 0; l < w; l++)
        *any |= beyond[l];
}

KMP_LANES_TWINS(sincos, angles, (size_t width, const call *all, int64_t *any), all, any)

void kmp_sincos_beyond(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    const size_t w = (size_t)width;
    for (int k = 0; k < n; k++)
        for (size_t l = 0; l < w; l++) {
            double at = v[w * x[k] + l];
            if (!(fabs(at) <= KEMPE_SINCOS_LIMIT)) {
                v[w * s[k] + l] = sin(at);
                v[w * c[k] + l] = cos(at);
            }
        }
}

void kmp_sincos_lanes(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    int64_t any = 0;
    KMP_TWIN(sincos)((size_t)width, &(call){n, v, x, s, c}, &any);
    if (any < 0)
        kmp_sincos_beyond(n, width, v, x, s, c);
}
