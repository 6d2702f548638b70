/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides KLU (Davis and Palamadai Natarajan, ACM TOMS 37 (2010) 36): one analysis and one factorisation with pivoting.
 * Later values are refactored with the same pivots, until pivot growth shows that they no longer suit. */
#include "linalg/sparse.h"
#include "base/arena.h"
#include "base/memory.h"
#include <klu.h>
#include <math.h>
#include <string.h>

/* A refactorisation whose reciprocal pivot growth is below this fraction of the last pivoted one's is not kept. */
#define GROWTH_KEPT 1e-3
/* An off-diagonal pivot is taken where the diagonal entry is below this fraction of it. The first value serves matrices
 * that are factored once or seldom, the second those of an integrator's iteration, where fill matters more than
 * accuracy. */
#define DIAGONAL_KEPT         0.1
#define DIAGONAL_OF_ITERATION 1e-3
/* Beyond this size the block-triangular form is left out: its matching takes n^2 in long chains, whose iteration matrix
 * is one block. */
enum { BLOCKS_UP_TO = 4000 };

struct kmp_sparse {
    kmp_arena arena;
    int n, nz;
    long *start, *row; /* compressed columns */
    int *place;        /* position of each entry in them; NULL: in its own columns */
    double *value;
    klu_l_common common;
    klu_l_symbolic *symbolic;
    klu_l_numeric *numeric;
    double growth; /* reciprocal, of the last factorisation with pivoting */
    bool good;     /* the factors are those of the last values */
};

/* A matrix without entries; freed and NULL when there is no memory. */
static kmp_sparse *make(int n, int nz)
{
    kmp_sparse *s = KMP_NEW(kmp_sparse, 1);
    if (!s)
        return NULL;
    s->n = n;
    s->nz = nz;
    KMP_ARENA_MAKE(&s->arena, KMP_ROOM(long, n + 1, &s->start), KMP_ROOM(long, nz, &s->row),
                   KMP_ROOM(double, nz, &s->value));
    klu_l_defaults(&s->common);
    if (!s->arena.failed)
        return s;
    kmp_sparse_free(s);
    return NULL;
}

kmp_sparse *kmp_sparse_new(int n, int nz, const int *row, const int *col, bool symmetric)
{
    kmp_sparse *s = make(n, nz);
    if (!s)
        return NULL;
    s->common.tol = DIAGONAL_KEPT;
    s->common.btf = !symmetric;
    s->place = KMP_ARENA_NEW(&s->arena, int, nz);
    if (s->place) {
        /* Compressed columns; `place` maps each given entry to its own. */
        for (int k = 0; k < s->nz; k++)
            s->start[col[k] + 1]++;
        for (int j = 0; j < s->n; j++)
            s->start[j + 1] += s->start[j];
        for (int k = 0; k < s->nz; k++) {
            s->place[k] = (int)s->start[col[k]]++;
            s->row[s->place[k]] = row[k];
        }
        for (int j = s->n; j > 0; j--)
            s->start[j] = s->start[j - 1];
        s->start[0] = 0;
    }
    s->symbolic = s->place && n > 0 ? klu_l_analyze(n, s->start, s->row, &s->common) : NULL;
    if (s->symbolic && (symmetric || s->symbolic->structural_rank == n))
        return s;
    kmp_sparse_free(s);
    return NULL;
}

kmp_sparse *kmp_sparse_new_columns(int n, int nz)
{
    kmp_sparse *s = make(n, nz);
    if (s) {
        s->common.tol = DIAGONAL_OF_ITERATION;
        s->common.btf = n <= BLOCKS_UP_TO;
    }
    return s;
}

bool kmp_sparse_take_columns(kmp_sparse *s, const long *start, const long *row)
{
    s->nz = (int)start[s->n];
    memcpy(s->start, start, ((size_t)s->n + 1) * sizeof *start);
    memcpy(s->row, row, (size_t)s->nz * sizeof *row);
    s->symbolic = klu_l_analyze(s->n, s->start, s->row, &s->common);
    return s->symbolic;
}

void kmp_sparse_free(kmp_sparse *s)
{
    if (!s)
        return;
    klu_l_free_numeric(&s->numeric, &s->common);
    klu_l_free_symbolic(&s->symbolic, &s->common);
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

double kmp_sparse_operations(const kmp_sparse *s)
{
    return s->symbolic->est_flops + 2 * (s->symbolic->lnz + s->symbolic->unz);
}

/* In common.rgrowth. */
static bool measure_growth(kmp_sparse *s)
{
    return klu_l_rgrowth(s->start, s->row, s->value, s->symbolic, s->numeric, &s->common);
}

/* Refactors with the current pivots; false when they do not suit. */
static bool refactor(kmp_sparse *s)
{
    return s->numeric && klu_l_refactor(s->start, s->row, s->value, s->symbolic, s->numeric, &s->common) &&
           s->common.status == KLU_OK && measure_growth(s) && s->common.rgrowth >= GROWTH_KEPT * s->growth;
}

static bool factor(kmp_sparse *s)
{
    klu_l_free_numeric(&s->numeric, &s->common);
    s->numeric = klu_l_factor(s->start, s->row, s->value, s->symbolic, &s->common);
    bool ok = s->numeric && s->common.status == KLU_OK && measure_growth(s);
    s->growth = ok ? s->common.rgrowth : 0;
    return ok;
}

kmp_sparse_outcome kmp_sparse_factor(kmp_sparse *s, const double *values)
{
    for (int k = 0; s->place && k < s->nz; k++)
        s->value[s->place[k]] = values[k];
    if (!s->place)
        memcpy(s->value, values, (size_t)s->nz * sizeof *values);
    s->good = refactor(s) || factor(s);
    if (s->good)
        return KMP_SPARSE_FACTORED;
    int status = (int)s->common.status;
    klu_l_free_numeric(&s->numeric, &s->common);
    return status == KLU_SINGULAR        ? KMP_SPARSE_SINGULAR
           : status == KLU_OUT_OF_MEMORY ? KMP_SPARSE_NO_MEMORY
                                         : KMP_SPARSE_FAILED;
}

long kmp_sparse_fill(const kmp_sparse *s)
{
    return s->numeric ? s->numeric->lnz + s->numeric->unz + s->numeric->nzoff : 0;
}

void kmp_sort_entries(int n, int count, const int *col, int *start, int *order)
{
    for (int e = 0; e < count; e++)
        start[col[e] + 1]++;
    for (int k = 0; k < n; k++)
        start[k + 1] += start[k];
    for (int e = 0; e < count; e++)
        order[start[col[e]]++] = e;
    for (int k = n; k > 0; k--)
        start[k] = start[k - 1];
    start[0] = 0;
}

bool kmp_sparse_solve(kmp_sparse *s, int m, double *x)
{
    return s->good && klu_l_solve(s->symbolic, s->numeric, s->n, m, x, &s->common);
}

void kmp_sparse_norms(kmp_sparse *s, double *norm, double *inverse)
{
    *norm = 0;
    *inverse = INFINITY;
    for (int j = 0; j < s->n; j++) {
        double sum = 0;
        for (long k = s->start[j]; k < s->start[j + 1]; k++)
            sum += fabs(s->value[k]);
        *norm = fmax(*norm, sum);
    }
    if (s->good && *norm > 0 && klu_l_condest(s->start, s->value, s->symbolic, s->numeric, &s->common))
        *inverse = s->common.condest / *norm;
}
