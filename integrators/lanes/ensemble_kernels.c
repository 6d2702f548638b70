/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/clones.h"
#include "base/simd4.h"
#include "integrators/lanes/ensemble_inside.h"
#include "integrators/steppers/dop853.h"
#include <math.h>

/* Eight doubles, in memory of any alignment. */
typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

#define COMBINE(vector, w)                                                                                             \
    for (size_t i = 0; i < size * (w); i += (w)) {                                                                     \
        vector sum = a[0] * *(const vector *)(k[0] + i);                                                               \
        for (int j = 1; j < terms; j++)                                                                                \
            sum += a[j] * *(const vector *)(k[j] + i);                                                                 \
        *(vector *)(out + i) = *(const vector *)(y + i) + *(const vector *)h * sum;                                    \
    }

KMP_CLONES static void combine_8(size_t size, const double *y, const double *h, int terms, const double *a,
                                 const double *const *k, double *out){COMBINE(eight, 8)}

KMP_CLONES static void combine_4(size_t size, const double *y, const double *h, int terms, const double *a,
                                 const double *const *k, double *out)
{
    COMBINE(kmp_four, 4)
}

void kmp_lanes_combine(size_t width, size_t size, const double *y, const double *h, int terms, const double *a,
                       const double *const *k, double *out)
{
    if (width == 8) {
        combine_8(size, y, h, terms, a, k, out);
        return;
    }
    if (width == 4) {
        combine_4(size, y, h, terms, a, k, out);
        return;
    }
    for (size_t i = 0; i < size * width; i++) {
        double sum = a[0] * k[0][i];
        for (int j = 1; j < terms; j++)
            sum += a[j] * k[j][i];
        out[i] = y[i] + h[i % width] * sum;
    }
}

KMP_CLONES static void solution_8(size_t size, const kmp_dop853_step *step)
{
    kmp_dop853_solution(8, size, step);
}

KMP_CLONES static void solution_4(size_t size, const kmp_dop853_step *step)
{
    kmp_dop853_solution(4, size, step);
}

void kmp_lanes_solution(size_t width, size_t size, const kmp_dop853_step *step)
{
    if (width == 8)
        solution_8(size, step);
    else if (width == 4)
        solution_4(size, step);
    else
        kmp_dop853_solution(width, size, step);
}

/* -- the end of a step ------------------------------------------------------------------------------- */

KMP_INLINE double larger_of(double a, double b)
{
    return b > a ? b : a;
}

/* NaN counts as infinite. */
KMP_INLINE double or_infinite(double x)
{
    return x <= DBL_MAX ? x : INFINITY;
}

KMP_INLINE void measure_closures(size_t w, const kmp_lanes_end *e)
{
    for (size_t l = 0; l < w; l++)
        e->residual[l] = e->correction[l] = e->growth[l] = 0;
    for (size_t i = 0; i < (size_t)e->m * w; i += w)
        for (size_t l = 0; l < w; l++)
            e->residual[l] = larger_of(e->residual[l], or_infinite(fabs(e->h[i + l]) / e->row_scale[i + l]));
    for (int i = 0; i < e->r; i++) {
        const double *dv = e->dv + (size_t)i * w, *weight = e->weight + (size_t)i * w,
                     *scale = e->scale + (size_t)e->v[i] * w;
        for (size_t l = 0; l < w; l++) {
            double size = fabs(dv[l]), rounded = KMP_CORRECTION_ROUNDING * scale[l],
                   part = or_infinite(size / weight[l]);
            e->correction[l] = larger_of(e->correction[l], size <= rounded && size <= weight[l] ? 0 : part);
        }
    }
    for (int i = 0; i < e->r; i++)
        for (int c = 0; c < e->p; c++) {
            const double *b = e->b + (size_t)(c * e->r + i) * w, *u = e->scale + (size_t)e->u[c] * w,
                         *v = e->scale + (size_t)e->v[i] * w;
            for (size_t l = 0; l < w; l++)
                e->growth[l] = larger_of(e->growth[l], or_infinite(fabs(b[l]) * u[l] / v[l]));
        }
}

KMP_CLONES static void measure_8(const kmp_lanes_end *end)
{
    measure_closures(8, end);
}

void kmp_lanes_measure(size_t width, const kmp_lanes_end *end)
{
    if (width == 8)
        measure_8(end);
    else
        measure_closures(width, end);
}

KMP_INLINE void take_lanes(size_t w, size_t size, const double *restrict which, const double *restrict from,
                           double *restrict to)
{
    for (size_t i = 0; i < size * w; i += w)
        for (size_t l = 0; l < w; l++)
            to[i + l] = which[l] > 0 ? from[i + l] : to[i + l];
}

KMP_CLONES static void take_8(size_t size, const double *which, const double *from, double *to)
{
    take_lanes(8, size, which, from, to);
}

void kmp_lanes_take(size_t width, size_t size, const double *which, const double *from, double *to)
{
    if (width == 8)
        take_8(size, which, from, to);
    else
        take_lanes(width, size, which, from, to);
}
