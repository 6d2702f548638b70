/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/eigen_complex.h"
#include "base/memory.h"

void zgeev_(const char *left, const char *right, const int *n, double *a, const int *lda, double *values, double *vl,
            const int *ldvl, double *vr, const int *ldvr, double *work, const int *lwork, double *rwork, int *info);

int kmp_eigen_complex(int n, double *a, double *values)
{
    int lwork = 4 * n + 4, one = 1, info = -1;
    double none[2], *work = KMP_NEW(double, 2 * lwork), *real = KMP_NEW(double, 2 * n + 1);
    if (work && real)
        zgeev_("N", "N", &n, a, &n, values, none, &one, none, &one, work, &lwork, real, &info);
    kmp_free(work);
    kmp_free(real);
    return info == 0 ? 0 : -1;
}
