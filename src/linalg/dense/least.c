/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/least.h"
#include "base/memory.h"
#include "linalg/lapack.h"
#include <stdbool.h>
#include <string.h>

static int imax(int a, int b)
{
    return a > b ? a : b;
}

int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x)
{
    int one = 1, rank = 0, info = 0, rows = imax(m, 1), ldb = imax(rows, n), small = m < n ? m : n;
    int lwork = imax(small + 3 * n + 1, 2 * small + 1) * 4;
    double *copy = KMP_NEW(double, imax(m * n, 1)), *rhs = KMP_NEW(double, ldb), *work = KMP_NEW(double, lwork);
    int *pivot = KMP_NEW(int, imax(n, 1));
    bool ok = copy && rhs && work && pivot;
    if (ok && m > 0 && n > 0) {
        memcpy(copy, a, (size_t)(m * n) * sizeof *copy);
        memcpy(rhs, b, (size_t)m * sizeof *rhs);
        dgelsy_(&m, &n, &one, copy, &rows, rhs, &ldb, pivot, &rcond, &rank, work, &lwork, &info);
    }
    if (ok && n > 0)
        memcpy(x, rhs, (size_t)n * sizeof *x); /* zeros when there are no rows */
    kmp_free(copy);
    kmp_free(rhs);
    kmp_free(work);
    kmp_free(pivot);
    return ok ? rank : -1;
}
