/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/eigen.h"
#include "base/memory.h"
#include "linalg/lapack.h"
#include <string.h>

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
    int ilo, ihi, lwork = n * (n + 6) + 1, info = -1;
    double norm, *left = KMP_NEW(double, n *n), *right = KMP_NEW(double, n *n), *work = KMP_NEW(double, lwork),
                 *scale = KMP_NEW(double, n);
    if (left && right && work && scale) {
        info = 0;
        if (n > 0)
            dgeevx_("B", "V", "V", "N", &n, a, &n, re, im, left, &n, right, &n, &ilo, &ihi, scale, &norm, NULL, NULL,
                    work, &lwork, NULL, &info);
        unpack(n, im, right, v_re, v_im);
        unpack(n, im, left, w_re, w_im);
    }
    kmp_free(left);
    kmp_free(right);
    kmp_free(work);
    kmp_free(scale);
    return info == 0 ? 0 : -1;
}

int kmp_eigen_symmetric(int n, double *k, double *m, double *values)
{
    int type = 1, lwork = 3 * n, info = 0;
    double *work = KMP_NEW(double, lwork);
    if (work && n > 0)
        dsygv_(&type, "V", "L", &n, k, &n, m, &n, values, work, &lwork, &info);
    kmp_free(work);
    return !work || info < 0 || (info > 0 && info <= n) ? -1 : info > n ? info - n : 0;
}
