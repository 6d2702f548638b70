/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides LAPACK's Fortran binding and its workspace. */
#include "analyses/dense/singular_values.h"
#include "linalg/dense/dot.h"
#include <string.h>

extern void dgesvd_(const char *jobu, const char *jobvt, const int *m, const int *n, double *a, const int *lda,
                    double *s, double *u, const int *ldu, double *vt, const int *ldvt, double *work, const int *lwork,
                    int *info);

static int imax(int a, int b)
{
    return a > b ? a : b;
}

int kmp_singular_right(int n, double *a, double *values, double *v)
{
    int lwork = 5 * n + 1, one = 1, info = -1;
    kmp_arena room = {0};
    double none, *work = KMP_ARENA_NEW(&room, double, lwork);
    if (work)
        dgesvd_("N", "A", &n, &n, a, &n, values, &none, &one, v, &n, work, &lwork, &info);
    kmp_arena_free(&room);
    for (int i = 0; info == 0 && i < n; i++)
        for (int j = 0; j < i; j++) {
            double kept = v[i + j * n];
            v[i + j * n] = v[j + i * n];
            v[j + i * n] = kept;
        }
    return info == 0 ? 0 : -1;
}

bool kmp_singular_init(kmp_singular *svd, kmp_arena *arena, int m, int n)
{
    int k = m < n ? m : n;
    *svd = (kmp_singular){.m = m, .n = n, .k = k, .lwork = 4 * imax(3 * k + imax(m, n), 5 * k) + 1};
    return KMP_ARENA_MAKE(arena, KMP_ROOM(double, m *k, &svd->u), KMP_ROOM(double, k, &svd->s),
                          KMP_ROOM(double, k *n, &svd->vt), KMP_ROOM(double, m *n, &svd->copy),
                          KMP_ROOM(double, svd->lwork, &svd->work));
}

bool kmp_singular_decompose(kmp_singular *svd, const double *a)
{
    int info = 0, entries = svd->m * svd->n;
    if (!kmp_all_finite(entries, a))
        return false;
    memcpy(svd->copy, a, (size_t)entries * sizeof *a);
    if (svd->k > 0)
        dgesvd_("S", "S", &svd->m, &svd->n, svd->copy, &svd->m, svd->s, svd->u, &svd->m, svd->vt, &svd->k, svd->work,
                &svd->lwork, &info);
    return info == 0;
}
