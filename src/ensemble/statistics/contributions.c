/* SPDX-License-Identifier: BSD-3-Clause */
/* Saltelli, Annoni, Azzini, Campolongo, Ratto, Tarantola, Computer Physics Communications 181 (2010) 259, table 2; the
 * standard errors are those of ratios of means. */
#include "ensemble/statistics/contributions.h"
#include "base/arena.h"
#include "constraints/tolerances.h"
#include "ensemble/sampling/designs.h"
#include "linalg/dense/dense.h"
#include <math.h>
#include <stddef.h>

/* -- regression --------------------------------------------------------------------------------------- */

/* Correlations of the inputs, and of each with the value, from deviations in units of standard deviations. */
static bool correlate(int count, int columns, const double *rows, const double *value, double *scaled, double *matrix,
                      double *with)
{
    int all = columns + 1;
    for (int c = 0; c < all; c++) {
        const double *x = c < columns ? rows + c : value;
        ptrdiff_t stride = c < columns ? columns : 1;
        double sum = 0;
        for (int k = 0; k < count; k++)
            sum += x[k * stride];
        double mean = sum / count, square = 0;
        for (int k = 0; k < count; k++) {
            double d = scaled[(ptrdiff_t)k * all + c] = x[k * stride] - mean;
            square += d * d;
        }
        if (!(square > 0))
            return false;
        for (int k = 0; k < count; k++)
            scaled[(ptrdiff_t)k * all + c] /= sqrt(square);
    }
    for (int i = 0; i < columns; i++)
        for (int j = 0; j < all; j++) {
            double sum = 0;
            for (int k = 0; k < count; k++)
                sum += scaled[(ptrdiff_t)k * all + i] * scaled[(ptrdiff_t)k * all + j];
            if (j < columns)
                matrix[i + j * columns] = sum;
            else
                with[i] = sum;
        }
    return true;
}

static bool solve(int columns, double *matrix, const double *with, double *coefficients, double *explained)
{
    if (kmp_cholesky_factor(columns, matrix))
        return false;
    for (int c = 0; c < columns; c++)
        if (!(matrix[c + c * columns] * matrix[c + c * columns] > KMP_CORRELATION_LEAST))
            return false;
    for (int c = 0; c < columns; c++)
        coefficients[c] = with[c];
    kmp_cholesky_solve(columns, matrix, coefficients);
    *explained = 0;
    for (int c = 0; c < columns; c++)
        *explained += coefficients[c] * with[c];
    return true;
}

bool kmp_regression(int count, int columns, const double *rows, const double *value, double *coefficients,
                    double *explained)
{
    kmp_arena arena = {0};
    double *scaled = KMP_ARENA_NEW(&arena, double, (size_t)count *(size_t)(columns + 1)),
           *matrix = KMP_ARENA_NEW(&arena, double, columns *columns), *with = KMP_ARENA_NEW(&arena, double, columns);
    bool good = !arena.failed && columns > 0 && count > columns + 1 &&
                correlate(count, columns, rows, value, scaled, matrix, with) &&
                solve(columns, matrix, with, coefficients, explained);
    kmp_arena_free(&arena);
    return good;
}

/* -- Sobol's indices ----------------------------------------------------------------------------------- */

bool kmp_is_saltelli(int count, int columns, const double *rows)
{
    int size = kmp_saltelli_group(columns);
    if (columns < 1 || count < size || count % size != 0)
        return false;
    for (int k = 0; k < count; k += size) {
        const double *a = rows + (ptrdiff_t)k * columns, *b = a + columns;
        for (int i = 0; i < columns; i++)
            for (int c = 0; c < columns; c++)
                if (a[(ptrdiff_t)(2 + i) * columns + c] != (c == i ? b[c] : a[c]))
                    return false;
    }
    return true;
}

/* Sums of pairs (x, v) of groups, of which mean(x)/mean(v) is wanted. */
typedef struct ratio {
    int count;
    double x, v, xx, xv, vv;
} ratio;

static void add(ratio *r, double x, double v)
{
    r->count++;
    r->x += x;
    r->v += v;
    r->xx += x * x;
    r->xv += x * v;
    r->vv += v * v;
}

/* The ratio, and its standard error: that of the mean of x - ratio v, over the mean of v. */
static double ratio_of(const ratio *r, double *error)
{
    double s = r->x / r->v, square = r->xx - 2 * s * r->xv + s * s * r->vv; /* sum of (x - s v)^2, whose mean is 0 */
    *error = sqrt(fmax(square, 0)) / fabs(r->v);
    return s;
}

static bool is_whole(int size, const double *value)
{
    for (int i = 0; i < size; i++)
        if (!isfinite(value[i]))
            return false;
    return true;
}

static double centre_of(int count, int size, const double *value, int *groups)
{
    double sum = 0;
    *groups = 0;
    for (int k = 0; k < count; k += size)
        if (is_whole(size, value + k)) {
            sum += 0.5 * (value[k] + value[k + 1]);
            ++*groups;
        }
    return *groups > 0 ? sum / *groups : 0;
}

int kmp_sobol_indices(int count, int columns, const double *value, kmp_sobol_index *indices)
{
    int size = kmp_saltelli_group(columns), groups;
    double centre = centre_of(count, size, value, &groups);
    for (int i = 0; i < columns; i++) {
        ratio first = {0}, total = {0};
        for (int k = 0; k < count; k += size) {
            const double *f = value + k;
            if (!is_whole(size, f))
                continue;
            double a = f[0] - centre, b = f[1] - centre, ab = f[2 + i] - centre, v = 0.5 * (a * a + b * b);
            add(&first, b * (ab - a), v);
            add(&total, 0.5 * (a - ab) * (a - ab), v);
        }
        if (!(first.v > 0))
            return 0;
        indices[i].first = ratio_of(&first, &indices[i].first_error);
        indices[i].total = ratio_of(&total, &indices[i].total_error);
    }
    return groups;
}
