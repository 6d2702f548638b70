/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/doctor_walk.h"
#include "base/memory.h"
#include "constraints/rounding.h"
#include "constraints/tolerances.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

enum { MOST_ITERATIONS = 40, TRIES = 5 };
#define STEP          0.3 /* scaled, of the coordinate that moves most */
#define MOVED         0.2 /* of the step: what must be left of it after closing */
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
    const kmp_rounding *rounding = kmp_rounding_of(system);
    w->rank = rounding ? rounding->rank : -1;
    w->jacobian = KMP_NEW(double, m *n);
    w->h = KMP_NEW(double, m);
    w->copy = KMP_NEW(double, size *size);
    w->normal = KMP_NEW(double, m *m);
    w->right = KMP_NEW(double, m);
    w->basis = KMP_NEW(double, size *size);
    w->trial = KMP_NEW(double, n);
    w->order = KMP_NEW(int, size);
    w->row_order = KMP_NEW(int, m);
    w->pivots = KMP_NEW(double, m + n);
    w->dropped = KMP_NEW(bool, m);
    if (w->plant && w->jacobian && w->h && w->copy && w->normal && w->right && w->basis && w->trial && w->order &&
        w->row_order && w->pivots && w->dropped)
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
    kmp_free(w->row_order);
    kmp_free(w->pivots);
    kmp_free(w->dropped);
    kmp_free(w);
}

void kmp_walk_evaluate(kmp_walk *w, const double *q)
{
    const kempe_system *s = w->system;
    kmp_plant_closure(w->plant, 0, q);
    kmp_plant_dense_jacobian(w->plant, w->jacobian);
    for (int r = 0; r < w->m; r++)
        w->h[r] = w->excluded && w->excluded[r] ? 0 : w->plant->h[r] / s->row_scale[r];
    for (int k = 0; k < w->n; k++)
        for (int r = 0; r < w->m; r++)
            w->jacobian[r + k * w->m] *=
                (w->hold && w->hold[k]) || (w->excluded && w->excluded[r]) ? 0 : s->scale[k] / s->row_scale[r];
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

/* h and J at q of the rows that are not dropped. */
static void evaluate_kept(kmp_walk *w, const double *q)
{
    kmp_walk_evaluate(w, q);
    for (int r = 0; w->rank >= 0 && r < w->m; r++) {
        w->h[r] = w->dropped[r] ? 0 : w->h[r];
        for (int k = 0; w->dropped[r] && k < w->n; k++)
            w->jacobian[r + k * w->m] = 0;
    }
}

/* The rows that are independent where closing begins, whichever coordinates are held. */
static void choose_rows(kmp_walk *w, const double *q)
{
    const bool *hold = w->hold;
    w->hold = NULL;
    kmp_walk_evaluate(w, q);
    w->hold = hold;
    kmp_walk_pivots(w, w->pivots);
    for (int k = 0; k < w->m; k++)
        w->dropped[w->row_order[k]] = k >= w->rank;
}

static bool close_kept(kmp_walk *w, double *q)
{
    double before = INFINITY;
    evaluate_kept(w, q);
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
        evaluate_kept(w, q);
    }
    return largest(w->m, w->h) <= KMP_CLOSED_ENOUGH;
}

bool kmp_walk_close(kmp_walk *w, double *q)
{
    if (w->rank >= 0)
        choose_rows(w, q);
    bool closed = close_kept(w, q);
    if (w->rank >= 0)
        kmp_walk_evaluate(w, q);
    return closed;
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
    most = w->rank >= 0 && w->rank < most ? w->rank : most;
    int rank =
        kmp_null_space(w->m, w->n, w->copy, kmp_rounding_zero(w->system, KMP_RANK), most, w->basis, w->order, &w->last);
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

void kmp_walk_pivots(kmp_walk *w, double *pivots)
{
    memcpy(w->copy, w->jacobian, (size_t)(w->m * w->n) * sizeof *w->copy);
    kmp_lu_complete(w->m, w->n, w->copy, NULL, w->row_order, w->order, pivots);
}

/* -- random ways ------------------------------------------------------------------------------------- */

/* A random direction of the tangent space, its largest entry one, to `way`. */
static void random_tangent(kmp_walk *w, int count, unsigned *state, double *way)
{
    double most = 0;
    memset(way, 0, (size_t)w->n * sizeof *way);
    for (int c = 0; c < count; c++) {
        double part = kmp_walk_random(state);
        for (int k = 0; k < w->n; k++)
            way[k] += part * w->basis[k + c * w->n];
    }
    for (int k = 0; k < w->n; k++)
        most = fmax(most, fabs(way[k]));
    for (int k = 0; k < w->n && most > 0; k++)
        way[k] /= most;
}

double kmp_walk_distance(const kmp_walk *w, const double *a, const double *b)
{
    double most = 0;
    for (int k = 0; k < w->n; k++)
        most = fmax(most, fabs(a[k] - b[k]) / w->system->scale[k]);
    return most;
}

bool kmp_walk_wander(kmp_walk *w, const double *from, unsigned *state, double *way, double *to)
{
    kmp_walk_evaluate(w, from);
    int count = w->n - kmp_walk_tangents(w, w->n);
    double step = STEP;
    for (int k = 0; k < TRIES && count > 0; k++, step *= 0.4) {
        random_tangent(w, count, state, way);
        for (int c = 0; c < w->n; c++)
            to[c] = from[c] + step * way[c] * w->system->scale[c];
        if (kmp_walk_close(w, to) && kmp_walk_distance(w, to, from) > MOVED * step &&
            kmp_walk_distance(w, to, from) < 3 * step)
            return true;
        kmp_walk_evaluate(w, from);
        count = w->n - kmp_walk_tangents(w, w->n);
    }
    return false;
}
