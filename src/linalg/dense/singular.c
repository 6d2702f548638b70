/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/singular.h"
#include "base/memory.h"
#include "linalg/lapack.h"
#include <math.h>
#include <string.h>

static int imax(int a, int b)
{
    return a > b ? a : b;
}

bool kmp_singular_init(kmp_singular *svd, int m, int n)
{
    int k = m < n ? m : n, long_side = imax(m, n);
    *svd = (kmp_singular){.m = m, .n = n, .k = k, .lwork = 4 * imax(3 * k + long_side, 5 * k) + 1};
    svd->u = KMP_NEW(double, m *k);
    svd->s = KMP_NEW(double, k);
    svd->vt = KMP_NEW(double, k *n);
    svd->copy = KMP_NEW(double, m *n);
    svd->work = KMP_NEW(double, svd->lwork);
    if (svd->u && svd->s && svd->vt && svd->copy && svd->work)
        return true;
    kmp_singular_free(svd);
    return false;
}

void kmp_singular_free(kmp_singular *svd)
{
    kmp_free(svd->u);
    kmp_free(svd->s);
    kmp_free(svd->vt);
    kmp_free(svd->copy);
    kmp_free(svd->work);
    *svd = (kmp_singular){0};
}

bool kmp_singular_decompose(kmp_singular *svd, const double *a)
{
    int info = 0, entries = svd->m * svd->n;
    for (int i = 0; i < entries; i++)
        if (!isfinite(a[i]))
            return false;
    memcpy(svd->copy, a, (size_t)entries * sizeof *a);
    if (svd->k > 0)
        dgesvd_("S", "S", &svd->m, &svd->n, svd->copy, &svd->m, svd->s, svd->u, &svd->m, svd->vt, &svd->k, svd->work,
                &svd->lwork, &info);
    return info == 0;
}
