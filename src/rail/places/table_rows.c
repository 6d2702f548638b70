/* SPDX-License-Identifier: BSD-3-Clause */
#include "rail/places/table_rows.h"
#include "base/clones.h"
#include "base/simd4.h"

/* True where functions in the processor's own names of its instructions are compiled; they run if it has these. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(KMP_NO_AVX512)
#define KMP_GATHERS 1
#include <immintrin.h>
#else
#define KMP_GATHERS 0
#endif

/* Pieces of points, of which some are in parts of several knots. */
static void bisect(const kmp_table *t, int n, double sign, const double *x, int *piece)
{
    for (int k = 0; k < n; k++) {
        const double far = (sign * x[k] - t->x[0]) * t->per_length, low = far >= 0 ? far : 0;
        piece[k] = kmp_table_knot(t, (int)(low < t->last_part ? low : t->last_part), sign * x[k]);
    }
}

/* Finds pieces; beyond the ends and for NaN any piece will do. */
KMP_CLONES static void find(const kmp_table *t, int n, double sign, const double *x, int *piece)
{
    const double first = t->x[0], most = t->last_part, scale = t->per_length, *const at_knot = t->x;
    const int *const knot = t->knot;
    for (int k = 0; k < n; k += KMP_FOUR) {
        const kmp_four at = sign * KMP_FOUR_CONST(x + k), far = (at - first) * scale;
        const kmp_four low = KMP_FOUR_SELECT(far >= 0, far, (kmp_four){0});
        const kmp_four part = KMP_FOUR_SELECT(low < most, low, KMP_FOUR_ALL(most));
        int knots = 0;
#pragma GCC unroll 4
        for (int l = 0; l < KMP_FOUR; l++) {
            const int *in = knot + (int)part[l], more = in[1] - in[0];
            piece[k + l] = in[0] + (-(at_knot[in[1]] <= at[l]) & more);
            knots |= more;
        }
        if (knots > 1)
            bisect(t, KMP_FOUR, sign, x + k, piece + k);
    }
}

#if KMP_GATHERS
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion" /* in macros of the header, without optimisation */
/* The same by gathers, for registers of eight doubles. */
KMP_REDUCED_PROGRAM_EIGHTS static void find_in_eights(const kmp_table *t, int n, double sign, const double *x,
                                                      int *piece)
{
    const __m512d most = _mm512_set1_pd(t->last_part), first = _mm512_set1_pd(t->x[0]), signs = _mm512_set1_pd(sign);
    const __m512d scale = _mm512_set1_pd(t->per_length);
    const __m512i low_half = _mm512_set1_epi64(0xffffffff);
    for (int k = 0; k < n; k += 8) {
        const __m512d at = _mm512_mul_pd(signs, _mm512_loadu_pd(x + k));
        const __m512d far = _mm512_mul_pd(_mm512_sub_pd(at, first), scale);
        const __m512d part = _mm512_min_pd(_mm512_max_pd(far, _mm512_setzero_pd()), most);
        const __m256i in = _mm512_cvttpd_epi32(part);
        const __m512i knots = _mm512_i32gather_epi64(in, t->knot, 4);
        const __m512i after = _mm512_srli_epi64(knots, 32), before = _mm512_and_si512(knots, low_half);
        const __m512d knot = _mm512_i64gather_pd(after, t->x, 8);
        const __mmask8 right = _mm512_cmp_pd_mask(knot, at, _CMP_LE_OQ);
        const __m512i found = _mm512_mask_blend_epi64(right, before, after);
        _mm256_storeu_si256((__m256i *)(void *)(piece + k), _mm512_cvtepi64_epi32(found));
        if (_mm512_cmpgt_epi64_mask(_mm512_sub_epi64(after, before), _mm512_set1_epi64(1)))
            bisect(t, 8, sign, x + k, piece + k);
    }
}
#pragma GCC diagnostic pop
#endif

/* Values in four pieces at a distance s from their left knots; `derivative` is a compile-time constant, here and
 * below. */
static KMP_INTO_CLONES void within(int derivative, const kmp_four *c, const kmp_four *s, kmp_four *y)
{
    if (derivative == 0)
        *y = c[0] + *s * (c[1] + *s * (c[2] + *s * c[3]));
    else if (derivative == 1)
        *y = c[1] + *s * (2 * c[2] + *s * (3 * c[3]));
    else if (derivative == 2)
        *y = 2 * c[2] + *s * (6 * c[3]);
    else if (derivative == 3)
        *y = 6 * c[3];
    else
        *y = KMP_FOUR_ALL(0.0);
}

/* Straight on from an end. */
static KMP_INTO_CLONES void beyond(const kmp_table *t, int derivative, int end, double slope, const kmp_four *at,
                                   kmp_four *y)
{
    if (derivative == 0)
        *y = t->y[end] + slope * (*at - t->x[end]);
    else
        *y = KMP_FOUR_ALL(derivative == 1 ? slope : 0.0);
}

/* Four values in their pieces or beyond the ends. */
static KMP_INTO_CLONES void value_of(const kmp_table *t, int derivative, const kmp_four *at, const kmp_four *c,
                                     const kmp_four *s, double *y)
{
    const int last = t->count - 1;
    kmp_four here, before, behind;
    within(derivative, c, s, &here);
    beyond(t, derivative, 0, t->piece[0][1], at, &before);
    beyond(t, derivative, last, t->last_slope, at, &behind);
    here = KMP_FOUR_SELECT(*at < t->x[0], before, here);
    here = KMP_FOUR_SELECT(*at > t->x[last], behind, here);
    KMP_FOUR_AT(y) = KMP_FOUR_SELECT(*at == *at, here, *at);
}

static KMP_INTO_CLONES void look_up(const kmp_table *t, int derivative, int n, double sign, const double *x,
                                    const int *piece, double *y, double *slope)
{
    for (int k = 0; k < n; k += KMP_FOUR) {
        const int *p = piece + k;
        const kmp_four at = sign * KMP_FOUR_CONST(x + k);
        const kmp_four s = at - (kmp_four){t->x[p[0]], t->x[p[1]], t->x[p[2]], t->x[p[3]]};
        kmp_four c[4];
        /* The coefficients of four pieces, by power: a transposition. */
        const kmp_four x0 = KMP_FOUR_CONST(t->piece[p[0]]), x1 = KMP_FOUR_CONST(t->piece[p[1]]);
        const kmp_four x2 = KMP_FOUR_CONST(t->piece[p[2]]), x3 = KMP_FOUR_CONST(t->piece[p[3]]);
        const kmp_four even01 = KMP_FOUR_OF(x0, x1, 0, 4, 2, 6), odd01 = KMP_FOUR_OF(x0, x1, 1, 5, 3, 7);
        const kmp_four even23 = KMP_FOUR_OF(x2, x3, 0, 4, 2, 6), odd23 = KMP_FOUR_OF(x2, x3, 1, 5, 3, 7);
        c[0] = KMP_FOUR_OF(even01, even23, 0, 1, 4, 5);
        c[1] = KMP_FOUR_OF(odd01, odd23, 0, 1, 4, 5);
        c[2] = KMP_FOUR_OF(even01, even23, 2, 3, 6, 7);
        c[3] = KMP_FOUR_OF(odd01, odd23, 2, 3, 6, 7);
        value_of(t, derivative, &at, c, &s, y + k);
        if (slope)
            value_of(t, derivative + 1, &at, c, &s, slope + k);
    }
}

KMP_CLONES static void look_up_all(const kmp_table *t, int derivative, int n, double sign, const double *x,
                                   const int *piece, double *y)
{
    if (derivative == 0)
        look_up(t, 0, n, sign, x, piece, y, NULL);
    else if (derivative == 1)
        look_up(t, 1, n, sign, x, piece, y, NULL);
    else if (derivative == 2)
        look_up(t, 2, n, sign, x, piece, y, NULL);
    else if (derivative == 3)
        look_up(t, 3, n, sign, x, piece, y, NULL);
    else
        look_up(t, 4, n, sign, x, piece, y, NULL);
}

#if KMP_GATHERS
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
/* The coefficients of eight pieces, by power: two transpositions of four, of the lanes k and of the lanes k + 4. */
KMP_REDUCED_PROGRAM_EIGHTS static void take_eight_pieces(const kmp_table *t, const int *p, __m512d c[4])
{
    __m512d row[4];
    for (int k = 0; k < 4; k++)
        row[k] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(t->piece[p[k]])),
                                    _mm256_loadu_pd(t->piece[p[k + 4]]), 1);
    const __m512d even01 = _mm512_unpacklo_pd(row[0], row[1]), odd01 = _mm512_unpackhi_pd(row[0], row[1]);
    const __m512d even23 = _mm512_unpacklo_pd(row[2], row[3]), odd23 = _mm512_unpackhi_pd(row[2], row[3]);
    const __m512i low = _mm512_set_epi64(13, 12, 5, 4, 9, 8, 1, 0), high = _mm512_set_epi64(15, 14, 7, 6, 11, 10, 3, 2);
    c[0] = _mm512_permutex2var_pd(even01, low, even23);
    c[1] = _mm512_permutex2var_pd(odd01, low, odd23);
    c[2] = _mm512_permutex2var_pd(even01, high, even23);
    c[3] = _mm512_permutex2var_pd(odd01, high, odd23);
}

/* look_up_both for registers of eight doubles. */
KMP_REDUCED_PROGRAM_EIGHTS static void look_up_both_in_eights(const kmp_table *t, int n, double sign, const double *x,
                                                              const int *piece, double *y, double *slope)
{
    const int last = t->count - 1;
    const double first_slope = t->piece[0][1], last_slope = t->last_slope;
    for (int k = 0; k < n; k += 8) {
        __m512d c[4];
        const __m256i p = _mm256_loadu_si256((const __m256i *)(const void *)(piece + k));
        const __m512d at = _mm512_loadu_pd(x + k) * sign, s = at - _mm512_i32gather_pd(p, t->x, 8);
        take_eight_pieces(t, piece + k, c);
        __m512d value = c[0] + s * (c[1] + s * (c[2] + s * c[3])), rise = c[1] + s * (2 * c[2] + s * (3 * c[3]));
        const __mmask8 before = _mm512_cmp_pd_mask(at, _mm512_set1_pd(t->x[0]), _CMP_LT_OQ);
        const __mmask8 behind = _mm512_cmp_pd_mask(at, _mm512_set1_pd(t->x[last]), _CMP_GT_OQ);
        const __mmask8 undefined = _mm512_cmp_pd_mask(at, at, _CMP_UNORD_Q);
        if (before | behind | undefined) {
            value = _mm512_mask_mov_pd(value, before, t->y[0] + first_slope * (at - t->x[0]));
            value = _mm512_mask_mov_pd(value, behind, t->y[last] + last_slope * (at - t->x[last]));
            value = _mm512_mask_mov_pd(value, undefined, at);
            rise = _mm512_mask_mov_pd(rise, before, _mm512_set1_pd(first_slope));
            rise = _mm512_mask_mov_pd(rise, behind, _mm512_set1_pd(last_slope));
            rise = _mm512_mask_mov_pd(rise, undefined, at);
        }
        _mm512_storeu_pd(y + k, value);
        _mm512_storeu_pd(slope + k, rise);
    }
}
#pragma GCC diagnostic pop
#endif

KMP_CLONES static void look_up_both(const kmp_table *t, int n, double sign, const double *x, const int *piece,
                                    double *y, double *slope)
{
    look_up(t, 0, n, sign, x, piece, y, slope);
}

/* Clones that are not static would be seen outside of a shared library. */
void kmp_table_find(const kmp_table *table, int n, double sign, const double *x, int *piece)
{
#if KMP_GATHERS
    if (kmp_has_eight() && n % 8 == 0) {
        find_in_eights(table, n, sign, x, piece);
        return;
    }
#endif
    find(table, n, sign, x, piece);
}

void kmp_table_values(const kmp_table *table, int derivative, int n, double sign, const double *x, const int *piece,
                      double *y)
{
    look_up_all(table, derivative, n, sign, x, piece, y);
}

void kmp_table_both(const kmp_table *table, int n, double sign, const double *x, const int *piece, double *y,
                    double *slope)
{
#if KMP_GATHERS
    if (kmp_has_eight() && n % 8 == 0) {
        look_up_both_in_eights(table, n, sign, x, piece, y, slope);
        return;
    }
#endif
    look_up_both(table, n, sign, x, piece, y, slope);
}
