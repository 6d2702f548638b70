/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/symmetric.h"
#include "base/memory.h"
#include "linalg/lapack.h"

int kmp_symmetric_eigen(int n, double *a, double *values)
{
    int lwork = 3 * n, info = -1;
    double *work = KMP_NEW(double, lwork);
    if (work && n > 0)
        dsyev_("V", "L", &n, a, &n, values, work, &lwork, &info);
    kmp_free(work);
    return info == 0 || (n == 0 && work) ? 0 : -1;
}
