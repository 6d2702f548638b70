/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides KLU (Davis and Palamadai Natarajan, ACM TOMS 37 (2010) 36): one analysis, one factorisation with pivoting;
 * after that refactorisations with the same pivots, until their growth says that the pivots no longer suit. */
#include "linalg/sparse.h"
#include "base/memory.h"
#include <klu.h>
#include <math.h>
#include <string.h>

/* A refactorisation whose reciprocal pivot growth is below this fraction of the last pivoted one's is not kept. */
#define GROWTH_KEPT 1e-3
/* A pivot off the diagonal is taken where that on it is below this fraction. */
#define DIAGONAL_KEPT 0.1

struct kmp_sparse {
    int n, nz;
    int *start, *row; /* compressed columns */
    int *place;       /* of each entry in them */
    double *value;
    klu_common common;
    klu_symbolic *symbolic;
    klu_numeric *numeric;
    double growth; /* reciprocal, of the last factorisation with pivoting */
    bool good;     /* the factors are those of the last values */
};

static void compress(kmp_sparse *s, const int *row, const int *col)
{
    for (int k = 0; k < s->nz; k++)
        s->start[col[k] + 1]++;
    for (int j = 0; j < s->n; j++)
        s->start[j + 1] += s->start[j];
    for (int k = 0; k < s->nz; k++) {
        s->place[k] = s->start[col[k]]++;
        s->row[s->place[k]] = row[k];
    }
    for (int j = s->n; j > 0; j--)
        s->start[j] = s->start[j - 1];
    s->start[0] = 0;
}

kmp_sparse *kmp_sparse_new(int n, int nz, const int *row, const int *col, bool symmetric)
{
    kmp_sparse *s = KMP_NEW(kmp_sparse, 1);
    if (!s)
        return NULL;
    s->n = n;
    s->nz = nz;
    s->start = KMP_NEW(int, n + 1);
    s->row = KMP_NEW(int, nz);
    s->place = KMP_NEW(int, nz);
    s->value = KMP_NEW(double, nz);
    klu_defaults(&s->common);
    s->common.tol = DIAGONAL_KEPT;
    s->common.btf = !symmetric;
    if (s->start && s->row && s->place && s->value && n > 0) {
        compress(s, row, col);
        s->symbolic = klu_analyze(n, s->start, s->row, &s->common);
    }
    if (s->symbolic && (symmetric || s->symbolic->structural_rank == n))
        return s;
    kmp_sparse_free(s);
    return NULL;
}

void kmp_sparse_free(kmp_sparse *s)
{
    if (!s)
        return;
    klu_free_numeric(&s->numeric, &s->common);
    klu_free_symbolic(&s->symbolic, &s->common);
    kmp_free(s->start);
    kmp_free(s->row);
    kmp_free(s->place);
    kmp_free(s->value);
    kmp_free(s);
}

double kmp_sparse_operations(const kmp_sparse *s)
{
    return s->symbolic->est_flops + 2 * (s->symbolic->lnz + s->symbolic->unz);
}

/* In common.rgrowth. */
static bool measure_growth(kmp_sparse *s)
{
    return klu_rgrowth(s->start, s->row, s->value, s->symbolic, s->numeric, &s->common);
}

/* With the pivots at hand; false when they do not suit. */
static bool refactor(kmp_sparse *s)
{
    return s->numeric && klu_refactor(s->start, s->row, s->value, s->symbolic, s->numeric, &s->common) &&
           s->common.status == KLU_OK && measure_growth(s) && s->common.rgrowth >= GROWTH_KEPT * s->growth;
}

static bool factor(kmp_sparse *s)
{
    klu_free_numeric(&s->numeric, &s->common);
    s->numeric = klu_factor(s->start, s->row, s->value, s->symbolic, &s->common);
    bool ok = s->numeric && s->common.status == KLU_OK && measure_growth(s);
    s->growth = ok ? s->common.rgrowth : 0;
    return ok;
}

int kmp_sparse_factor(kmp_sparse *s, const double *values)
{
    for (int k = 0; k < s->nz; k++)
        s->value[s->place[k]] = values[k];
    s->good = refactor(s) || factor(s);
    if (!s->good)
        klu_free_numeric(&s->numeric, &s->common);
    return s->good ? 0 : 1;
}

void kmp_sparse_solve(kmp_sparse *s, int m, double *x)
{
    if (s->good)
        (void)klu_solve(s->symbolic, s->numeric, s->n, m, x, &s->common);
}

void kmp_sparse_norms(kmp_sparse *s, double *norm, double *inverse)
{
    *norm = 0;
    *inverse = INFINITY;
    for (int j = 0; j < s->n; j++) {
        double sum = 0;
        for (int k = s->start[j]; k < s->start[j + 1]; k++)
            sum += fabs(s->value[k]);
        *norm = fmax(*norm, sum);
    }
    if (s->good && *norm > 0 && klu_condest(s->start, s->value, s->symbolic, s->numeric, &s->common))
        *inverse = s->common.condest / *norm;
}
