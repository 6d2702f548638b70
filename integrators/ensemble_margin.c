/* SPDX-License-Identifier: BSD-3-Clause */
/* Complete pivoting in lanes: each lane has its own pivots, so that rows and columns are not exchanged but set to zero
 * once they are used. */
#include "base/clones.h"
#include "integrators/ensemble_inside.h"
#include <math.h>

enum { MOST_COLUMNS = 2 * KMP_LANE_ROWS + KMP_FUSED_FREEDOMS };

/* The largest absolute entry of each lane. */
KMP_INLINE void find_largest(size_t w, size_t count, const double *a, double *best)
{
    for (size_t l = 0; l < w; l++)
        best[l] = 0;
    for (size_t e = 0; e < count; e++)
        for (size_t l = 0; l < w; l++) {
            double x = fabs(a[e * w + l]);
            best[l] = x > best[l] ? x : best[l];
        }
}

/* Takes the pivot's row and column out of each lane: copies of them, the column divided by the pivot. */
KMP_INLINE void take_out(size_t w, size_t m, size_t n, double *a, const double *best, double *row, double *col)
{
    for (size_t l = 0; l < w; l++) {
        size_t at = 0;
        while (at + 1 < m * n && fabs(a[at * w + l]) != best[l])
            at++;
        size_t pr = at / n, pc = at % n;
        double pivot = a[at * w + l], by = pivot != 0 ? 1 / pivot : 0;
        for (size_t j = 0; j < n; j++)
            row[j * w + l] = a[(pr * n + j) * w + l];
        for (size_t i = 0; i < m; i++)
            col[i * w + l] = a[(i * n + pc) * w + l] * by;
        for (size_t j = 0; j < n; j++)
            a[(pr * n + j) * w + l] = 0;
        for (size_t i = 0; i < m; i++)
            a[(i * n + pc) * w + l] = 0;
        row[pc * w + l] = col[pr * w + l] = 0;
    }
}

KMP_INLINE void eliminate(size_t w, size_t m, size_t n, double *a, const double *row, const double *col)
{
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < n; j++)
            for (size_t l = 0; l < w; l++)
                a[(i * n + j) * w + l] -= col[i * w + l] * row[j * w + l];
}

KMP_INLINE void margins(size_t w, size_t m, size_t n, double *restrict a, double *restrict pivot)
{
    double row[MOST_COLUMNS * KMP_LANES_MOST], col[KMP_LANE_ROWS * KMP_LANES_MOST];
    for (size_t k = 0; k < m; k++) {
        find_largest(w, m * n, a, pivot);
        if (k + 1 < m) {
            take_out(w, m, n, a, pivot, row, col);
            eliminate(w, m, n, a, row, col);
        }
    }
}

KMP_CLONES static void eight(size_t m, size_t n, double *a, double *pivot)
{
    margins(8, m, n, a, pivot);
}

KMP_CLONES static void four(size_t m, size_t n, double *a, double *pivot)
{
    margins(4, m, n, a, pivot);
}

void kmp_lane_margins(size_t width, int m, int n, double *a, double *pivot)
{
    if (width == 8)
        eight((size_t)m, (size_t)n, a, pivot);
    else if (width == 4)
        four((size_t)m, (size_t)n, a, pivot);
    else
        margins(width, (size_t)m, (size_t)n, a, pivot);
}
