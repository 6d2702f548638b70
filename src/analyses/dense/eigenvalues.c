/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides LAPACK's Fortran binding and its workspace. */
#include "analyses/dense/eigenvalues.h"
#include "base/arena.h"
#include "linalg/dense/lapack.h"
#include <string.h>

extern void dgeevx_(const char *balanc, const char *jobvl, const char *jobvr, const char *sense, const int *n,
                    double *a, const int *lda, double *wr, double *wi, double *vl, const int *ldvl, double *vr,
                    const int *ldvr, int *ilo, int *ihi, double *scale, double *abnrm, double *rconde, double *rcondv,
                    double *work, const int *lwork, int *iwork, int *info);
extern void dsygv_(const int *itype, const char *jobz, const char *uplo, const int *n, double *a, const int *lda,
                   double *b, const int *ldb, double *w, double *work, const int *lwork, int *info);
extern void dsygvd_(const int *itype, const char *jobz, const char *uplo, const int *n, double *a, const int *lda,
                    double *b, const int *ldb, double *w, double *work, const int *lwork, int *iwork, const int *liwork,
                    int *info);
extern void zgeev_(const char *left, const char *right, const int *n, double *a, const int *lda, double *values,
                   double *vl, const int *ldvl, double *vr, const int *ldvr, double *work, const int *lwork,
                   double *rwork, int *info);

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

int kmp_eigen_symmetric(int n, double *k, double *m, double *values)
{
    const bool divides = n >= KMP_EIGEN_DIVIDED;
    int type = 1, lwork = divides ? 1 + 6 * n + 2 * n * n : 3 * n, liwork = 3 + 5 * n, info = 0;
    kmp_arena room = {0};
    double *work = KMP_ARENA_NEW(&room, double, lwork);
    int *iwork = KMP_ARENA_NEW(&room, int, liwork);
    bool made = work && iwork;
    if (made && divides)
        dsygvd_(&type, "V", "L", &n, k, &n, m, &n, values, work, &lwork, iwork, &liwork, &info);
    else if (made && n > 0)
        dsygv_(&type, "V", "L", &n, k, &n, m, &n, values, work, &lwork, &info);
    kmp_arena_free(&room);
    return !made || info < 0 || (info > 0 && info <= n) ? -1 : info > n ? info - n : 0;
}
