/* SPDX-License-Identifier: BSD-3-Clause */
/* The LAPACK functions in use, by their Fortran binding. The lengths of character arguments are left out, as all of
 * them are one letter. */
#ifndef KMP_LINALG_LAPACK_H
#define KMP_LINALG_LAPACK_H

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

#endif
