/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/ensemble_kernels.h"
#include "backend/clones.h"
#include "backend/lanes.h"
#include "integrators/dop853_table.h"
#include "integrators/rk_method.h"
#include <math.h>

KMP_INLINE void combine(size_t w, size_t size, const double *restrict y, const double *restrict h, int terms,
                        const double *restrict a, const double *const *k, double *restrict out)
{
    for (size_t i = 0; i < size * w; i += w) {
        double sum[KMP_LANES_MOST];
        for (size_t l = 0; l < w; l++)
            sum[l] = a[0] * k[0][i + l];
        for (int j = 1; j < terms; j++)
            for (size_t l = 0; l < w; l++)
                sum[l] += a[j] * k[j][i + l];
        for (size_t l = 0; l < w; l++)
            out[i + l] = y[i + l] + h[l] * sum[l];
    }
}

KMP_CLONES static void combine_8(size_t size, const double *y, const double *h, int terms, const double *a,
                                 const double *const *k, double *out)
{
    combine(8, size, y, h, terms, a, k, out);
}

KMP_CLONES static void combine_4(size_t size, const double *y, const double *h, int terms, const double *a,
                                 const double *const *k, double *out)
{
    combine(4, size, y, h, terms, a, k, out);
}

void kmp_lanes_combine(size_t width, size_t size, const double *y, const double *h, int terms, const double *a,
                       const double *const *k, double *out)
{
    if (width == 8)
        combine_8(size, y, h, terms, a, k, out);
    else if (width == 4)
        combine_4(size, y, h, terms, a, k, out);
    else
        combine(width, size, y, h, terms, a, k, out);
}

/* Sums of squares of both errors over the components of each lane, as in dop853.c. */
KMP_INLINE void add_errors(size_t w, size_t i, const kmp_lanes_step *s, double *restrict e5, double *restrict e3)
{
    double *const *k = s->k;
    const double *g[] = {k[1] + i, k[6] + i, k[7] + i, k[8] + i, k[9] + i, k[10] + i, k[11] + i, k[12] + i};
    double slope[KMP_LANES_MOST], error5[KMP_LANES_MOST];
    for (size_t l = 0; l < w; l++) {
        slope[l] = B[0] * g[0][l];
        error5[l] = E5[0] * g[0][l];
    }
    for (int j = 1; j < 8; j++)
        for (size_t l = 0; l < w; l++) {
            slope[l] += B[j] * g[j][l];
            error5[l] += E5[j] * g[j][l];
        }
    for (size_t l = 0; l < w; l++) {
        double error3 = slope[l] - B3[0] * g[0][l] - B3[1] * g[4][l] - B3[2] * g[7][l];
        double y0 = s->y[i + l], y1 = y0 + s->h[l] * slope[l], larger = fabs(y0) > fabs(y1) ? fabs(y0) : fabs(y1);
        double weight = s->atol[i + l] + s->rtol * larger;
        s->y_new[i + l] = y1;
        s->weight[i + l] = weight;
        double five = error5[l] / weight;
        error3 /= weight;
        e5[l] += five * five;
        e3[l] += error3 * error3;
    }
}

KMP_INLINE void solution(size_t w, size_t size, const kmp_lanes_step *s)
{
    double e5[KMP_LANES_MOST] = {0}, e3[KMP_LANES_MOST] = {0};
    for (size_t i = 0; i < size * w; i += w)
        add_errors(w, i, s, e5, e3);
    for (size_t l = 0; l < w; l++) {
        double both = e5[l] + 0.01 * e3[l];
        s->error[l] = both < 1e-300 ? 0.0 : fabs(s->h[l]) * e5[l] * sqrt(1.0 / (both * (double)size));
    }
}

KMP_CLONES static void solution_8(size_t size, const kmp_lanes_step *step)
{
    solution(8, size, step);
}

KMP_CLONES static void solution_4(size_t size, const kmp_lanes_step *step)
{
    solution(4, size, step);
}

void kmp_lanes_solution(size_t width, size_t size, const kmp_lanes_step *step)
{
    if (width == 8)
        solution_8(size, step);
    else if (width == 4)
        solution_4(size, step);
    else
        solution(width, size, step);
}
