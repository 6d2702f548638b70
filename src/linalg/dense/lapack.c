/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides LAPACK's Fortran binding and its workspace. The lengths of character arguments are left out, as all of them are
 * one letter. */
#include "linalg/dense/lapack.h"
#include "linalg/dense/dot.h"
#include <string.h>

extern void dgeevx_(const char *balanc, const char *jobvl, const char *jobvr, const char *sense, const int *n,
                    double *a, const int *lda, double *wr, double *wi, double *vl, const int *ldvl, double *vr,
                    const int *ldvr, int *ilo, int *ihi, double *scale, double *abnrm, double *rconde, double *rcondv,
                    double *work, const int *lwork, int *iwork, int *info);
extern void dgelsy_(const int *m, const int *n, const int *nrhs, double *a, const int *lda, double *b, const int *ldb,
                    int *jpvt, const double *rcond, int *rank, double *work, const int *lwork, int *info);
extern void dgesvd_(const char *jobu, const char *jobvt, const int *m, const int *n, double *a, const int *lda,
                    double *s, double *u, const int *ldu, double *vt, const int *ldvt, double *work, const int *lwork,
                    int *info);
extern void dsyev_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w, double *work,
                   const int *lwork, int *info);
extern void dsygv_(const int *itype, const char *jobz, const char *uplo, const int *n, double *a, const int *lda,
                   double *b, const int *ldb, double *w, double *work, const int *lwork, int *info);
extern void zgeev_(const char *left, const char *right, const int *n, double *a, const int *lda, double *values,
                   double *vl, const int *ldvl, double *vr, const int *ldvr, double *work, const int *lwork,
                   double *rwork, int *info);

static int imax(int a, int b)
{
    return a > b ? a : b;
}

/* Columns j, j + 1 of `packed` are the parts of a pair's vector. */
static void unpack(int n, const double *im, const double *packed, double *v_re, double *v_im)
{
    memcpy(v_re, packed, (size_t)n * (size_t)n * sizeof *v_re);
    memset(v_im, 0, (size_t)n * (size_t)n * sizeof *v_im);
    for (int j = 0; j < n; j++)
        if (im[j] > 0 && j + 1 < n) {
            for (int i = 0; i < n; i++) {
                v_re[i + (j + 1) * n] = packed[i + j * n];
                v_im[i + j * n] = packed[i + (j + 1) * n];
                v_im[i + (j + 1) * n] = -packed[i + (j + 1) * n];
            }
            j++;
        }
}

int kmp_eigen_general(int n, double *a, double *re, double *im, double *v_re, double *v_im, double *w_re, double *w_im)
{
    int ilo, ihi, lwork = n * (n + 6) + 1, info = 0;
    double norm, *left, *right, *work, *scale;
    kmp_arena room = {0};
    KMP_ARENA_MAKE(&room, KMP_ROOM(double, n *n, &left, &right), KMP_ROOM(double, lwork, &work),
                   KMP_ROOM(double, n, &scale));
    bool made = !room.failed;
    if (made && n > 0) {
        dgeevx_("B", "V", "V", "N", &n, a, &n, re, im, left, &n, right, &n, &ilo, &ihi, scale, &norm, NULL, NULL, work,
                &lwork, NULL, &info);
        unpack(n, im, right, v_re, v_im);
        unpack(n, im, left, w_re, w_im);
    }
    kmp_arena_free(&room);
    return made && info == 0 ? 0 : -1;
}

int kmp_eigen_complex(int n, double *a, double *values)
{
    int lwork = 4 * n + 4, one = 1, info = -1;
    kmp_arena room = {0};
    double none[2], *work = KMP_ARENA_NEW(&room, double, 2 * lwork), *real = KMP_ARENA_NEW(&room, double, 2 * n);
    if (!room.failed)
        zgeev_("N", "N", &n, a, &n, values, none, &one, none, &one, work, &lwork, real, &info);
    kmp_arena_free(&room);
    return info == 0 ? 0 : -1;
}

int kmp_symmetric_eigen(int n, double *a, double *values)
{
    int lwork = 3 * n, info = 0;
    kmp_arena room = {0};
    double *work = KMP_ARENA_NEW(&room, double, lwork);
    bool made = work;
    if (made && n > 0)
        dsyev_("V", "L", &n, a, &n, values, work, &lwork, &info);
    kmp_arena_free(&room);
    return made && info == 0 ? 0 : -1;
}

int kmp_eigen_symmetric(int n, double *k, double *m, double *values)
{
    int type = 1, lwork = 3 * n, info = 0;
    kmp_arena room = {0};
    double *work = KMP_ARENA_NEW(&room, double, lwork);
    bool made = work;
    if (made && n > 0)
        dsygv_(&type, "V", "L", &n, k, &n, m, &n, values, work, &lwork, &info);
    kmp_arena_free(&room);
    return !made || info < 0 || (info > 0 && info <= n) ? -1 : info > n ? info - n : 0;
}

int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x)
{
    int one = 1, rank = 0, info = 0, rows = imax(m, 1), ldb = imax(rows, n), small = m < n ? m : n;
    int lwork = imax(small + 3 * n + 1, 2 * small + 1) * 4;
    kmp_arena room = {0};
    double *copy = KMP_ARENA_NEW(&room, double, m *n), *rhs = KMP_ARENA_NEW(&room, double, ldb),
           *work = KMP_ARENA_NEW(&room, double, lwork);
    int *pivot = KMP_ARENA_NEW(&room, int, n);
    bool made = !room.failed;
    if (made && m > 0 && n > 0) {
        memcpy(copy, a, (size_t)(m * n) * sizeof *copy);
        memcpy(rhs, b, (size_t)m * sizeof *rhs);
        dgelsy_(&m, &n, &one, copy, &rows, rhs, &ldb, pivot, &rcond, &rank, work, &lwork, &info);
    }
    if (made && n > 0)
        memcpy(x, rhs, (size_t)n * sizeof *x); /* zeros when there are no rows */
    kmp_arena_free(&room);
    return made ? rank : -1;
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
