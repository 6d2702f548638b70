/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/doctor_walk.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

enum { MOST_ITERATIONS = 40 };
#define LEAST_DAMPING 1e-12

static int imax(int a, int b)
{
    return a > b ? a : b;
}

kmp_walk *kmp_walk_new(const kempe_system *system)
{
    kmp_walk *w = KMP_NEW(kmp_walk, 1);
    if (!w)
        return NULL;
    int n = system->n, m = system->m, size = imax(n, m);
    *w = (kmp_walk){.system = system, .n = n, .m = m, .plant = kmp_plant_new(system, "tape")};
    w->jacobian = KMP_NEW(double, m *n);
    w->h = KMP_NEW(double, m);
    w->copy = KMP_NEW(double, size *size);
    w->normal = KMP_NEW(double, m *m);
    w->right = KMP_NEW(double, m);
    w->basis = KMP_NEW(double, size *size);
    w->trial = KMP_NEW(double, n);
    w->order = KMP_NEW(int, size);
    if (w->plant && w->jacobian && w->h && w->copy && w->normal && w->right && w->basis && w->trial && w->order)
        return w;
    kmp_walk_free(w);
    return NULL;
}

void kmp_walk_free(kmp_walk *w)
{
    if (!w)
        return;
    kmp_plant_free(w->plant);
    kmp_free(w->jacobian);
    kmp_free(w->h);
    kmp_free(w->copy);
    kmp_free(w->normal);
    kmp_free(w->right);
    kmp_free(w->basis);
    kmp_free(w->trial);
    kmp_free(w->order);
    kmp_free(w);
}

void kmp_walk_evaluate(kmp_walk *w, const double *q)
{
    const kempe_system *s = w->system;
    kmp_plant_closure(w->plant, 0, q);
    kmp_plant_dense_jacobian(w->plant, w->jacobian);
    for (int r = 0; r < w->m; r++)
        w->h[r] = w->plant->h[r] / s->row_scale[r];
    for (int k = 0; k < w->n; k++)
        for (int r = 0; r < w->m; r++)
            w->jacobian[r + k * w->m] *= w->hold && w->hold[k] ? 0 : s->scale[k] / s->row_scale[r];
}

static double largest(int count, const double *x)
{
    double most = 0;
    for (int k = 0; k < count; k++)
        most = fmax(most, isfinite(x[k]) ? fabs(x[k]) : INFINITY);
    return most;
}

/* right = (J J' + mu^2)^-1 h with mu = |h|: redundant rows whose rank is undecided before h is closed are left alone.
 */
static bool multipliers(kmp_walk *w)
{
    int m = w->m, n = w->n;
    double square = 0;
    for (int r = 0; r < m; r++)
        square += w->h[r] * w->h[r];
    for (int c = 0; c < m; c++)
        for (int r = c; r < m; r++) {
            double sum = r == c ? fmax(square, LEAST_DAMPING) : 0;
            for (int k = 0; k < n; k++)
                sum += w->jacobian[r + k * m] * w->jacobian[c + k * m];
            w->normal[r + c * m] = sum;
        }
    if (kmp_cholesky_factor(m, w->normal) != 0)
        return false;
    memcpy(w->right, w->h, (size_t)m * sizeof *w->right);
    kmp_cholesky_solve(m, w->normal, w->right);
    return true;
}

/* q less J' right, no coordinate farther than KMP_LONGEST_CORRECTION. */
static void correct(kmp_walk *w, double *q)
{
    int m = w->m, n = w->n;
    for (int k = 0; k < n; k++) {
        w->trial[k] = 0;
        for (int r = 0; r < m; r++)
            w->trial[k] += w->jacobian[r + k * m] * w->right[r];
    }
    double size = largest(n, w->trial), factor = size > KMP_LONGEST_CORRECTION ? KMP_LONGEST_CORRECTION / size : 1;
    for (int k = 0; k < n; k++)
        q[k] -= factor * w->trial[k] * w->system->scale[k];
}

bool kmp_walk_close(kmp_walk *w, double *q)
{
    double before = INFINITY;
    kmp_walk_evaluate(w, q);
    for (int k = 0; k < MOST_ITERATIONS; k++) {
        double now = largest(w->m, w->h);
        if (!(now < INFINITY))
            return false;
        if (now <= KMP_CLOSED_AIM || (now <= KMP_CLOSED_ENOUGH && now > 0.5 * before))
            return true;
        if (!multipliers(w))
            return false;
        before = now;
        correct(w, q);
        kmp_walk_evaluate(w, q);
    }
    return largest(w->m, w->h) <= KMP_CLOSED_ENOUGH;
}

/* -- null spaces ------------------------------------------------------------------------------------- */

static void swap_columns(int rows, double *a, int i, int k)
{
    for (int r = 0; r < rows; r++) {
        double t = a[r + i * rows];
        a[r + i * rows] = a[r + k * rows];
        a[r + k * rows] = t;
    }
}

static void swap_rows(int rows, int cols, double *a, int i, int k)
{
    for (int c = 0; c < cols; c++) {
        double t = a[i + c * rows];
        a[i + c * rows] = a[k + c * rows];
        a[k + c * rows] = t;
    }
}

/* The largest entry from (k, k) on brought there; its size. */
static double pivot(int rows, int cols, double *a, int k, int *order)
{
    int row = k, col = k;
    double most = 0;
    for (int c = k; c < cols; c++)
        for (int r = k; r < rows; r++)
            if (fabs(a[r + c * rows]) > most * (1 + 1e-12)) { /* ties go to the first, also with rounding */
                most = fabs(a[r + c * rows]);
                row = r;
                col = c;
            }
    swap_rows(rows, cols, a, k, row);
    swap_columns(rows, a, k, col);
    int t = order[k];
    order[k] = order[col];
    order[col] = t;
    return most;
}

/* Row k over its pivot, and column k zero elsewhere. */
static void eliminate(int rows, int cols, double *a, int k)
{
    double over = 1 / a[k + k * rows];
    for (int c = k; c < cols; c++)
        a[k + c * rows] *= over;
    for (int c = k + 1; c < cols; c++)
        for (int r = 0; r < rows; r++)
            if (r != k)
                a[r + c * rows] -= a[r + k * rows] * a[k + c * rows];
    for (int r = 0; r < rows; r++)
        a[r + k * rows] = r == k;
}

int kmp_null_space(int rows, int cols, double *a, double tolerance, int most, double *basis, int *order, double *last)
{
    double first = 0;
    int rank = 0;
    for (int c = 0; c < cols; c++)
        order[c] = c;
    for (*last = 0; rank < rows && rank < cols && rank < most; rank++) {
        double size = pivot(rows, cols, a, rank, order);
        first = rank ? first : size;
        if (!(size > tolerance * first))
            break;
        *last = size;
        eliminate(rows, cols, a, rank);
    }
    memset(basis, 0, (size_t)(cols * (cols - rank)) * sizeof *basis);
    for (int k = rank; k < cols; k++) {
        double *x = basis + (k - rank) * cols;
        for (int r = 0; r < rank; r++)
            x[order[r]] = -a[r + k * rows];
        x[order[k]] = 1;
    }
    return rank;
}

int kmp_walk_tangents(kmp_walk *w, int most)
{
    memcpy(w->copy, w->jacobian, (size_t)(w->m * w->n) * sizeof *w->copy);
    int rank = kmp_null_space(w->m, w->n, w->copy, KMP_RANK, most, w->basis, w->order, &w->last);
    for (int k = 0; k < w->n - rank; k++) {
        double sum = 0, *x = w->basis + k * w->n;
        for (int i = 0; i < w->n; i++)
            sum += x[i] * x[i];
        for (int i = 0; i < w->n; i++)
            x[i] /= sqrt(sum);
    }
    return rank;
}

double kmp_walk_random(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 23) - 1;
}
