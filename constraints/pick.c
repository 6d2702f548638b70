/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/pick.h"
#include "base/memory.h"
#include "constraints/pick_blocks.h"
#include "constraints/tolerances.h"
#include "linalg/dense.h"
#include "linalg/sparse.h"
#include <math.h>
#include <string.h>

/* With more places than SPARSE_FROM, and fewer than one in SPARSE_BELOW taken, or with more than DENSE_MOST a matrix is
 * not made dense. */
enum { SPARSE_FROM = 256, SPARSE_BELOW = 6, DENSE_MOST = 1 << 14 };

bool kmp_pick_is_large(int m, int n, int nz)
{
    double places = (double)m * n;
    return places > DENSE_MOST || (places > SPARSE_FROM && nz * SPARSE_BELOW < places);
}

bool kmp_pick_init(kmp_pick *c, int m, int n, int nz, bool dense)
{
    *c = (kmp_pick){.m = m, .n = n, .dense = dense, .growth = KMP_PICK_GROWTH};
    c->row = KMP_NEW(int, m);
    c->col = KMP_NEW(int, n);
    c->fixed = KMP_NEW(int, n);
    c->entry_row = KMP_NEW(int, nz);
    c->entry_col = KMP_NEW(int, nz);
    c->value = KMP_NEW(double, nz);
    if (dense) {
        c->a = KMP_NEW(double, m *n);
        c->jv = KMP_NEW(double, m *m);
        c->b = KMP_NEW(double, m *n);
        c->pivot = KMP_NEW(int, m);
    }
    return c->row && c->col && c->fixed && c->entry_row && c->entry_col && c->value &&
           (!dense || (c->a && c->jv && c->b && c->pivot));
}

void kmp_pick_free(kmp_pick *c)
{
    void *arrays[] = {c->row, c->col, c->fixed, c->entry_row, c->entry_col, c->value, c->a, c->jv, c->b, c->pivot};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
    *c = (kmp_pick){0};
}

void kmp_pick_add(kmp_pick *c, int row, int col, double value)
{
    c->entry_row[c->nz] = row;
    c->entry_col[c->nz] = col;
    c->value[c->nz++] = value;
    if (c->dense)
        c->a[row + col * c->m] = value;
}

bool kmp_pick_pivot(kmp_pick *c, const int *fixed, double *pivots)
{
    if (!c->dense) {
        kmp_entries a = {c->m, c->n, c->nz, c->entry_row, c->entry_col, c->value};
        return kmp_sparse_complete(&a, fixed, c->row, c->col, pivots);
    }
    memcpy(c->b, c->a, (size_t)(c->m * c->n) * sizeof *c->b);
    kmp_lu_complete(c->m, c->n, c->b, fixed, c->row, c->col, pivots);
    return true;
}

/* -- dense ------------------------------------------------------------------------------------------- */

/* Jv of columns col[0..r) and rows row[0..r), factored; false when singular. */
static bool factor_jv(kmp_pick *c, int r)
{
    for (int k = 0; k < r; k++)
        for (int i = 0; i < r; i++)
            c->jv[i + k * r] = c->a[c->row[i] + c->col[k] * c->m];
    return kmp_lu_factor(r, c->jv, c->pivot) == 0;
}

/* b (r x p) = Bvu = -Jv^-1 Ju. */
static bool compute_b(kmp_pick *c, int r)
{
    int p = c->n - r;
    if (!factor_jv(c, r))
        return false;
    for (int k = 0; k < p; k++)
        for (int i = 0; i < r; i++)
            c->b[i + k * r] = -c->a[c->row[i] + c->col[r + k] * c->m];
    kmp_lu_solve(r, c->jv, c->pivot, p, c->b);
    return true;
}

static double largest(const double *b, int count, int *at)
{
    double worst = 0;
    *at = 0;
    for (int k = 0; k < count; k++)
        if (fabs(b[k]) > worst) {
            worst = fabs(b[k]);
            *at = k;
        }
    return worst;
}

/* Exchanges columns until no |B| exceeds the growth bound. */
static bool exchange(kmp_pick *c, int r, int most, int *exchanges, double *max_b)
{
    int p = c->n - r, at;
    for (*exchanges = 0;; ++*exchanges) {
        if (!compute_b(c, r))
            return false;
        *max_b = largest(c->b, r * p, &at);
        if (r == 0 || *max_b <= c->growth || *exchanges >= most)
            return true;
        kmp_pick_swap(c, at % r, r + at / r);
    }
}

static void norms(kmp_pick *c, int r, double *norm, double *inverse)
{
    for (int k = 0; k < r; k++) {
        double sum = 0, sum_inverse = 0;
        for (int i = 0; i < r; i++) {
            sum += fabs(c->a[c->row[i] + c->col[k] * c->m]);
            c->b[i] = i == k;
        }
        kmp_lu_solve(r, c->jv, c->pivot, 1, c->b);
        for (int i = 0; i < r; i++)
            sum_inverse += fabs(c->b[i]);
        *norm = fmax(*norm, sum);
        *inverse = fmax(*inverse, sum_inverse);
    }
}

kmp_pick_outcome kmp_pick_improve_dense(kmp_pick *c, int r, int most, int *exchanges, kmp_pick_quality *quality)
{
    double max_b;
    if (!exchange(c, r, most, exchanges, &max_b))
        return KMP_PICK_SINGULAR;
    quality->max_b = fmax(quality->max_b, max_b);
    norms(c, r, &quality->norm, &quality->inverse);
    return KMP_PICK_MADE;
}

void kmp_pick_swap(kmp_pick *c, int i, int k)
{
    int moved = c->col[i];
    c->col[i] = c->col[k];
    c->col[k] = moved;
}

/* -- either ------------------------------------------------------------------------------------------ */

kmp_pick_outcome kmp_pick_improve(kmp_pick *c, int r, int most, int *exchanges, double *max_b, double *cond)
{
    kmp_pick_quality quality = {0};
    *exchanges = 0;
    kmp_pick_outcome outcome = c->dense ? kmp_pick_improve_dense(c, r, most, exchanges, &quality)
                                        : kmp_pick_improve_blocks(c, r, most, exchanges, &quality);
    *max_b = quality.max_b;
    *cond = r > 0 ? quality.norm * quality.inverse : 1;
    return outcome;
}
