/* SPDX-License-Identifier: BSD-3-Clause */
/* Complete pivoting of the scaled J, and exchanges of columns in a tableau -Jv^-1 Ju: a column enters in place of one
 * where its entry is largest, until none is above the bound. Sparse matrices keep the same pivots. */
#include "constraints/partition/pivot_columns.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "integrators/decide/coordinate_exchange.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include <math.h>
#include <string.h>

/* A matrix is not made dense with more entries than SPARSE_FROM of which fewer than one in SPARSE_BELOW is nonzero, or
 * with more than DENSE_MOST. */
enum { SPARSE_FROM = 256, SPARSE_BELOW = 6, DENSE_MOST = 1 << 14 };

bool kmp_pick_init(kmp_pick *c, int m, int n, int nz, kmp_arena_lent *room)
{
    double places = (double)m * n;
    bool large = places > DENSE_MOST || (places > SPARSE_FROM && nz * SPARSE_BELOW < places);
    *c = (kmp_pick){.m = m, .n = n, .dense = !large, .growth = KMP_PICK_GROWTH};
    if (room)
        kmp_arena_lend(&c->arena, room);
    return KMP_ARENA_MAKE(&c->arena, KMP_ROOM(int, m, &c->row), KMP_ROOM(int, n, &c->col, &c->fixed),
                          KMP_ROOM(int, nz, &c->entry_row, &c->entry_col), KMP_ROOM(double, nz, &c->value));
}

KMP_CLEARS(kmp_pick, c, kmp_arena_free(&c->arena))

void kmp_pick_add(kmp_pick *c, int row, int col, double value)
{
    c->entry_row[c->nz] = row;
    c->entry_col[c->nz] = col;
    c->value[c->nz++] = value;
}

bool kmp_pick_pivot(kmp_pick *c, const int *fixed, double *pivots)
{
    if (!c->dense) {
        kmp_entries a = {c->m, c->n, c->nz, c->entry_row, c->entry_col, c->value};
        return kmp_sparse_complete(&a, fixed, c->row, c->col, pivots, NULL);
    }
    double *a = KMP_ARENA_NEW(&c->arena, double, c->m * c->n);
    for (int e = 0; a && e < c->nz; e++)
        a[c->entry_row[e] + c->entry_col[e] * c->m] = c->value[e];
    if (a)
        kmp_lu_complete(c->m, c->n, a, fixed, c->row, c->col, pivots);
    return a;
}

/* -- exchanges of columns ------------------------------------------------------------------------------ */

/* The tableau of exchanges between the first r columns and the others, on the first r rows; its arrays are in the arena
 * of the choice. */
typedef struct tableau {
    int r, p;
    double *b;    /* r x p: Bvu */
    double *most; /* p: the largest entry of each column, and its row */
    int *at;
    double *moved;        /* r */
    int *row_at, *col_at; /* m, n: original index of each row and column */
    double *jv;           /* dense: r x r, its factors; sparse: its entries */
    int *pivot;           /* dense: r */
    int *jv_row, *jv_col; /* sparse: row and column of each entry */
    kmp_sparse *sparse;
} tableau;

static bool tableau_init(tableau *t, kmp_pick *c, int r)
{
    size_t rows = (size_t)r, p = (size_t)(c->n - r), nz = c->dense ? 0 : (size_t)c->nz;
    *t = (tableau){.r = r, .p = c->n - r};
    return KMP_ARENA_MAKE(&c->arena, KMP_ROOM(double, rows *p, &t->b), KMP_ROOM(double, p, &t->most),
                          KMP_ROOM(int, p, &t->at), KMP_ROOM(double, rows, &t->moved), KMP_ROOM(int, c->m, &t->row_at),
                          KMP_ROOM(int, c->n, &t->col_at), KMP_ROOM(double, c->dense ? rows *rows : nz, &t->jv),
                          KMP_ROOM(int, rows, &t->pivot), KMP_ROOM(int, nz, &t->jv_row, &t->jv_col));
}

static double *column_of(const tableau *t, int k)
{
    return t->b + (size_t)k * (size_t)t->r;
}

static kmp_pick_outcome factor_sparse(tableau *t, int count)
{
    unsigned long failures = kmp_memory_failures();
    kmp_sparse_free(t->sparse);
    t->sparse = kmp_sparse_new(t->r, count, t->jv_row, t->jv_col, false);
    kmp_sparse_outcome outcome = t->sparse ? kmp_sparse_factor(t->sparse, t->jv) : KMP_SPARSE_SINGULAR;
    return outcome == KMP_SPARSE_FACTORED                                         ? KMP_PICK_MADE
           : outcome == KMP_SPARSE_NO_MEMORY || kmp_memory_failures() != failures ? KMP_PICK_NO_MEMORY
                                                                                  : KMP_PICK_SINGULAR;
}

/* Factors Jv and writes -Ju into B. */
static kmp_pick_outcome factor(tableau *t, const kmp_pick *c)
{
    int r = t->r, count = 0;
    for (int i = 0; i < c->m; i++)
        t->row_at[c->row[i]] = i;
    for (int k = 0; k < c->n; k++)
        t->col_at[c->col[k]] = k;
    memset(t->b, 0, (size_t)r * (size_t)t->p * sizeof *t->b);
    if (c->dense)
        memset(t->jv, 0, (size_t)r * (size_t)r * sizeof *t->jv);
    for (int e = 0; e < c->nz; e++) {
        int i = t->row_at[c->entry_row[e]], k = t->col_at[c->entry_col[e]];
        if (i >= r)
            continue;
        if (k >= r) {
            column_of(t, k - r)[i] = -c->value[e];
        } else if (c->dense) {
            t->jv[i + k * r] = c->value[e];
        } else {
            t->jv_row[count] = i;
            t->jv_col[count] = k;
            t->jv[count++] = c->value[e];
        }
    }
    return !c->dense ? factor_sparse(t, count) : kmp_lu_factor(r, t->jv, t->pivot) ? KMP_PICK_SINGULAR : KMP_PICK_MADE;
}

/* Returns ||Jv||_1 ||Jv^-1||_1. */
static double condition(tableau *t, const kmp_pick *c)
{
    double norm = 0, inverse = 0;
    if (t->sparse) {
        kmp_sparse_norms(t->sparse, &norm, &inverse);
        return norm * inverse;
    }
    for (int k = 0; k < t->r; k++) {
        double sum = 0, sum_inverse = 0;
        for (int e = 0; e < c->nz; e++)
            if (c->entry_col[e] == c->col[k] && t->row_at[c->entry_row[e]] < t->r)
                sum += fabs(c->value[e]);
        for (int i = 0; i < t->r; i++)
            t->moved[i] = i == k;
        kmp_lu_solve(t->r, t->jv, t->pivot, 1, t->moved);
        for (int i = 0; i < t->r; i++)
            sum_inverse += fabs(t->moved[i]);
        norm = fmax(norm, sum);
        inverse = fmax(inverse, sum_inverse);
    }
    return norm * inverse;
}

/* Updates B at each exchange. B is computed again after one with a large entry, whose rounding is large, and when no
 * further exchange seems due. */
static kmp_pick_outcome exchange_all(tableau *t, kmp_pick *c, int most, int *exchanges, double *max_b)
{
    for (;;) {
        kmp_pick_outcome outcome = factor(t, c);
        if (outcome != KMP_PICK_MADE)
            return outcome;
        if (t->sparse)
            kmp_sparse_solve(t->sparse, t->p, t->b);
        else
            kmp_lu_solve(t->r, t->jv, t->pivot, t->p, t->b);
        int made = kmp_exchange_columns(t->r, t->p, t->b, c->col, c->growth, most - *exchanges, t->most, t->at, max_b);
        if (made == 0)
            return KMP_PICK_MADE;
        *exchanges += made;
    }
}

kmp_pick_outcome kmp_pick_improve(kmp_pick *c, int r, int most, int *exchanges, double *max_b)
{
    tableau t = {0};
    *exchanges = 0;
    *max_b = 0;
    if (r == 0)
        return KMP_PICK_MADE;
    kmp_pick_outcome outcome =
        tableau_init(&t, c, r) ? exchange_all(&t, c, most, exchanges, max_b) : KMP_PICK_NO_MEMORY;
    kmp_sparse_free(t.sparse);
    return outcome;
}

kmp_pick_outcome kmp_pick_condition(kmp_pick *c, int r, double *cond)
{
    tableau t = {0};
    *cond = 1;
    if (r == 0)
        return KMP_PICK_MADE;
    kmp_pick_outcome outcome = tableau_init(&t, c, r) ? factor(&t, c) : KMP_PICK_NO_MEMORY;
    if (outcome == KMP_PICK_MADE)
        *cond = condition(&t, c);
    kmp_sparse_free(t.sparse);
    return outcome;
}
