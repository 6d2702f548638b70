/* SPDX-License-Identifier: BSD-3-Clause */
/* One clone of the lane loop for each width of vectors, with the same bits from each. */
#include "backend/sincos.h"
#include "base/clones.h"
#include "base/simd4.h"

#include <kempe/runtime.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

KMP_CLONES static void groups_of_8(int n, const double *x, double *s, double *c)
{
    for (int i = 0; i + 8 <= n; i += 8)
        kempe_sincos8_core_(x + i, s + i, c + i);
}

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

/* True if all lanes of all angles are within the limit; false for NaN. For registers of one type: compilers take
 * comparisons of eight apart where there are none of eight. */
#define ARE_WITHIN(name, lanes, mask)                                                                                  \
    static KMP_INTO_CLONES bool name(int n, int width, const double *v, const uint32_t *x)                             \
    {                                                                                                                  \
        enum { W = sizeof(lanes) / sizeof(double) };                                                                   \
        mask beyond = {0};                                                                                             \
        int64_t any = 0;                                                                                               \
        for (int k = 0; k < n; k++)                                                                                    \
            for (int l = 0; l < width; l += W) {                                                                       \
                const lanes *at = (const lanes *)(v + (size_t)width * x[k] + l);                                       \
                beyond |= ~((lanes)(*(const mask *)at & INT64_MAX) <= KEMPE_SINCOS_LIMIT);                             \
            }                                                                                                          \
        for (int l = 0; l < W; l++)                                                                                    \
            any |= beyond[l];                                                                                          \
        return !any;                                                                                                   \
    }

ARE_WITHIN(fours_are_within, kmp_four, kmp_four_mask)
ARE_WITHIN(eights_are_within, kmp_eight, kmp_eight_mask)

static KMP_INTO_CLONES void angle_of_8(bool within, const double *restrict x, double *restrict s, double *restrict c)
{
    for (int l = 0; within && l < 8; l++)
        kempe_sincos_core_(x[l], &s[l], &c[l]);
    if (!within)
        kempe_sincos8_core_(x, s, c);
}

/* Each part of kempe_sincos_core_ for two registers before the next part: their chains overlap. */
static KMP_INTO_CLONES void angle_of_16(const double *restrict x, double *restrict s, double *restrict c)
{
    enum { W = 16 };
    double r[W], y[W], sine[W], cosine[W];
    uint64_t quadrant[W];
    for (int l = 0; l < W; l++)
        quadrant[l] = kempe_reduce_(fabs(x[l]), &r[l], &y[l]);
    for (int l = 0; l < W; l++)
        sine[l] = kempe_sine_(r[l], y[l], r[l] * r[l]);
    for (int l = 0; l < W; l++)
        cosine[l] = kempe_cosine_(r[l], y[l], r[l] * r[l]);
    for (int l = 0; l < W; l++)
        kempe_place_(x[l], quadrant[l], sine[l], cosine[l], &s[l], &c[l]);
}

/* The limit is tested once for all angles: their computations then overlap. */
#define LANES_OF_8(name, are_within)                                                                                   \
    KMP_CLONES static void name(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)  \
    {                                                                                                                  \
        bool within = are_within(n, width, v, x);                                                                      \
        size_t w = (size_t)width;                                                                                      \
        for (int k = 0; k < n && within && w == 16; k++)                                                               \
            angle_of_16(v + w * x[k], v + w * s[k], v + w * c[k]);                                                     \
        for (int k = 0; k < n && !(within && w == 16); k++)                                                            \
            for (size_t l = 0; l < w; l += 8)                                                                          \
                angle_of_8(within, v + w * x[k] + l, v + w * s[k] + l, v + w * c[k] + l);                              \
    }

LANES_OF_8(lanes_in_fours, fours_are_within)
LANES_OF_8(lanes_in_eights, eights_are_within)

void kmp_sincos_lanes(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    if (kmp_has_eight())
        lanes_in_eights(n, width, v, x, s, c);
    else
        lanes_in_fours(n, width, v, x, s, c);
}
