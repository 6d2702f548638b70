/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/clones.h"
#include "integrators/steppers/collocation.h"

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

/* The functions for registers of one type. The loop over the stages is unrolled for their usual number. */
#define KERNELS(lanes, usual)                                                                                          \
    static KMP_INTO_CLONES void sum_of_##lanes(int count, int stages, const double *x, const double *column,           \
                                               const kmp_lane_terms *terms, double *restrict out)                      \
    {                                                                                                                  \
        enum { W = sizeof(lanes) / sizeof(double) };                                                                   \
        const lanes *c = (const lanes *)column;                                                                        \
        const lanes a = *(const lanes *)terms->a_lanes, b = *(const lanes *)terms->b_lanes;                            \
        for (int k = 0; k < count; k++) {                                                                              \
            lanes sum = terms->a[k] * a + terms->b[k] * b;                                                             \
            for (int j = 0; j < stages; j++)                                                                           \
                sum += x[k * W + j] * c[j];                                                                            \
            *(lanes *)(out + k * W) = sum;                                                                             \
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
    static KMP_CLONES void subtract_##lanes(int count, const double *f, const double *x, double *out)                  \
    {                                                                                                                  \
        enum { W = sizeof(lanes) / sizeof(double) };                                                                   \
        for (int k = 0; k < count * W; k += W)                                                                         \
            *(lanes *)(out + k) = *(const lanes *)(f + k) - *(const lanes *)(x + k);                                   \
    }                                                                                                                  \
    static KMP_CLONES void advance_##lanes(int count, const double *weight, const double *change, double *x,           \
                                           double *square)                                                             \
    {                                                                                                                  \
        enum { W = sizeof(lanes) / sizeof(double) };                                                                   \
        lanes sum = {0};                                                                                               \
        for (int k = 0; k < count; k++) {                                                                              \
            lanes by = *(const lanes *)(change + k * W), e = weight[k] * by;                                           \
            *(lanes *)(x + k * W) += by;                                                                               \
            sum += e * e;                                                                                              \
        }                                                                                                              \
        *(lanes *)square = sum;                                                                                        \
    }

KERNELS(four, 4)
KERNELS(eight, 7)

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
    else
        sum_eight(count, stages, x, column, terms, out);
}

void kmp_lanes_subtract(int width, int count, const double *f, const double *x, double *out)
{
    if (width == 4)
        subtract_four(count, f, x, out);
    else
        subtract_eight(count, f, x, out);
}

double kmp_lanes_advance(int width, int count, int stages, const double *weight, const double *change, double *x)
{
    double square[8], sum = 0;
    if (width == 4)
        advance_four(count, weight, change, x, square);
    else
        advance_eight(count, weight, change, x, square);
    for (int l = 0; l < stages; l++)
        sum += square[l];
    return sum;
}
