/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/clones.h"
#include "integrators/steppers/collocation.h"

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

/* The functions for lanes in V registers, 1 or 2, of one type: compilers keep eight doubles in memory where registers
 * have four. The loop over the stages is unrolled for their usual number. */
#define KERNELS(lanes, type, number, usual)                                                                            \
    static KMP_INTO_CLONES void sum_of_##lanes(int count, int stages, const double *x, const double *column,           \
                                               const kmp_lane_terms *terms, double *restrict out)                      \
    {                                                                                                                  \
        enum { V = number, LAST = V - 1, W = V * (int)(sizeof(type) / sizeof(double)) };                               \
        const type *c = (const type *)column, *a = (const type *)terms->a_lanes, *b = (const type *)terms->b_lanes;    \
        for (int k = 0; k < count; k++) {                                                                              \
            type sum = terms->a[k] * a[0] + terms->b[k] * b[0], more = sum;                                            \
            if (V == 2)                                                                                                \
                more = terms->a[k] * a[LAST] + terms->b[k] * b[LAST];                                                  \
            for (int j = 0; j < stages; j++) {                                                                         \
                sum += x[k * W + j] * c[j * V];                                                                        \
                if (V == 2)                                                                                            \
                    more += x[k * W + j] * c[j * V + LAST];                                                            \
            }                                                                                                          \
            ((type *)out)[k * V] = sum;                                                                                \
            if (V == 2)                                                                                                \
                ((type *)out)[k * V + LAST] = more;                                                                    \
        }                                                                                                              \
    }                                                                                                                  \
    static KMP_CLONES void sum_##lanes(int count, int stages, const double *x, const double *column,                   \
                                       const kmp_lane_terms *terms, double *out)                                       \
    {                                                                                                                  \
        if (stages == (usual))                                                                                         \
            sum_of_##lanes(count, (usual), x, column, terms, out);                                                     \
        else                                                                                                           \
            sum_of_##lanes(count, stages, x, column, terms, out);                                                      \
    }                                                                                                                  \
    static KMP_INTO_CLONES void add_##lanes(double weight, const type *change, type *x, type *square)                  \
    {                                                                                                                  \
        type by = *change, e = weight * by;                                                                            \
        *x += by;                                                                                                      \
        *square += e * e;                                                                                              \
    }                                                                                                                  \
    static KMP_CLONES void advance_##lanes(int count, const double *weight, const double *change, double *x,           \
                                           double *square)                                                             \
    {                                                                                                                  \
        enum { V = number, LAST = V - 1 };                                                                             \
        const type *by = (const type *)change;                                                                         \
        type *to = (type *)x, sum = {0}, more = {0};                                                                   \
        for (int k = 0; k < count; k++) {                                                                              \
            add_##lanes(weight[k], &by[k * V], &to[k * V], &sum);                                                      \
            if (V == 2)                                                                                                \
                add_##lanes(weight[k], &by[k * V + LAST], &to[k * V + LAST], &more);                                   \
        }                                                                                                              \
        ((type *)square)[0] = sum;                                                                                     \
        if (V == 2)                                                                                                    \
            ((type *)square)[LAST] = more;                                                                             \
    }

KERNELS(four, four, 1, 4)
KERNELS(two_fours, four, 2, 7)
KERNELS(eight, eight, 1, 7)

static KMP_CLONES void subtract(int count, const double *f, const double *x, double *out)
{
    for (int k = 0; k < count; k += 4)
        *(four *)(out + k) = *(const four *)(f + k) - *(const four *)(x + k);
}

static KMP_CLONES void scale(int count, double by, const double *x, double *restrict out)
{
    for (int k = 0; k < count; k += 4)
        *(four *)(out + k) = by * *(const four *)(x + k);
}

void kmp_lanes_scale(int count, double by, const double *x, double *out)
{
    scale(count, by, x, out);
}

void kmp_lanes_sum(int width, int count, int stages, const double *x, const double *column, const kmp_lane_terms *terms,
                   double *out)
{
    if (width == 4)
        sum_four(count, stages, x, column, terms, out);
    else if (!kmp_has_eight())
        sum_two_fours(count, stages, x, column, terms, out);
    else
        sum_eight(count, stages, x, column, terms, out);
}

void kmp_lanes_subtract(int width, int count, const double *f, const double *x, double *out)
{
    subtract(width * count, f, x, out);
}

double kmp_lanes_advance(int width, int count, int stages, const double *weight, const double *change, double *x)
{
    double square[8], sum = 0;
    if (width == 4)
        advance_four(count, weight, change, x, square);
    else if (!kmp_has_eight())
        advance_two_fours(count, weight, change, x, square);
    else
        advance_eight(count, weight, change, x, square);
    for (int l = 0; l < stages; l++)
        sum += square[l];
    return sum;
}
