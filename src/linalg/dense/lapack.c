/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides LAPACK's Fortran binding and its workspace. The lengths of character arguments are left out, as all of them are
 * one letter. */
#include "linalg/dense/lapack.h"
#include <stddef.h>
#include <string.h>

extern void dgelsy_(const int *m, const int *n, const int *nrhs, double *a, const int *lda, double *b, const int *ldb,
                    int *jpvt, const double *rcond, int *rank, double *work, const int *lwork, int *info);
extern void dsyev_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w, double *work,
                   const int *lwork, int *info);
extern void dsyevd_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w,
                    double *work, const int *lwork, int *iwork, const int *liwork, int *info);

static int imax(int a, int b)
{
    return a > b ? a : b;
}

int kmp_symmetric_eigen(int n, double *a, double *values)
{
    const bool divides = n >= KMP_EIGEN_DIVIDED;
    int lwork = divides ? 1 + 6 * n + 2 * n * n : 3 * n, liwork = 3 + 5 * n, info = 0;
    kmp_arena room = {0};
    double *work = KMP_ARENA_NEW(&room, double, lwork);
    int *iwork = KMP_ARENA_NEW(&room, int, liwork);
    bool made = work && iwork;
    if (made && divides)
        dsyevd_("V", "L", &n, a, &n, values, work, &lwork, iwork, &liwork, &info);
    else if (made && n > 0)
        dsyev_("V", "L", &n, a, &n, values, work, &lwork, &info);
    kmp_arena_free(&room);
    return made && info == 0 ? 0 : -1;
}

int kmp_least_squares_of(int m, int n, const double *a, int count, const double *b, double rcond, double *x)
{
    int rank = 0, info = 0, rows = imax(m, 1), ldb = imax(rows, n), small = m < n ? m : n;
    int lwork = imax(small + 3 * n + 1, 2 * small + count) * 4;
    kmp_arena room = {0};
    double *copy = KMP_ARENA_NEW(&room, double, m *n), *rhs = KMP_ARENA_NEW(&room, double, (size_t)ldb *(size_t)count),
           *work = KMP_ARENA_NEW(&room, double, lwork);
    int *pivot = KMP_ARENA_NEW(&room, int, n);
    bool made = !room.failed;
    if (made && m > 0 && n > 0) {
        memcpy(copy, a, (size_t)(m * n) * sizeof *copy);
        for (int k = 0; k < count; k++)
            memcpy(rhs + (ptrdiff_t)k * ldb, b + (ptrdiff_t)k * m, (size_t)m * sizeof *rhs);
        dgelsy_(&m, &n, &count, copy, &rows, rhs, &ldb, pivot, &rcond, &rank, work, &lwork, &info);
    }
    for (int k = 0; made && n > 0 && k < count; k++) /* without rows, the solution is zero */
        memcpy(x + (ptrdiff_t)k * n, rhs + (ptrdiff_t)k * ldb, (size_t)n * sizeof *x);
    kmp_arena_free(&room);
    return made ? rank : -1;
}

int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x)
{
    return kmp_least_squares_of(m, n, a, 1, b, rcond, x);
}
