/* SPDX-License-Identifier: BSD-3-Clause */
/* Replaces the operations of SUNDIALS' serial vector that dominate IDA's steps by vectorised ones. Sums are taken in
 * eight fixed interleaved parts, so that every vector width gives the same bits; a combination of many vectors is one
 * pass. Loops are cloned by width as those of sines are (src/backend/sincos.c). All other operations are SUNDIALS'
 * own. */
#include "integrators/sundials/host_vector.h"
#include "base/clones.h"

#include <math.h>
#include <stddef.h>

enum { LANES = 8 };

/* -- loops -------------------------------------------------------------------------------------------- */

/* z = a x + b y; z may be x or y */
KMP_CLONES static void sum(ptrdiff_t n, double a, const double *x, double b, const double *y, double *z)
{
    for (ptrdiff_t i = 0; i < n; i++)
        z[i] = a * x[i] + b * y[i];
}

/* z = a x; z may be x */
KMP_CLONES static void scale(ptrdiff_t n, double a, const double *x, double *z)
{
    for (ptrdiff_t i = 0; i < n; i++)
        z[i] = a * x[i];
}

static double total(const double part[LANES])
{
    return ((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7]));
}

static double square(double x, double w)
{
    return x * w * (x * w);
}

/* Sum of the squares of x w, over entries with positive `mask` (NULL: all). */
static KMP_INTO_CLONES double sum_squares(ptrdiff_t n, const double *x, const double *w, const double *mask)
{
    double part[LANES] = {0};
    ptrdiff_t whole = n - n % LANES;
    for (ptrdiff_t i = 0; i < whole; i += LANES)
        for (int k = 0; k < LANES; k++)
            part[k] += !mask || mask[i + k] > 0 ? square(x[i + k], w[i + k]) : 0;
    for (ptrdiff_t i = whole; i < n; i++)
        part[i - whole] += !mask || mask[i] > 0 ? square(x[i], w[i]) : 0;
    return total(part);
}

KMP_CLONES static double squares(ptrdiff_t n, const double *x, const double *w)
{
    return sum_squares(n, x, w, NULL);
}

KMP_CLONES static double squares_where(ptrdiff_t n, const double *x, const double *w, const double *mask)
{
    return sum_squares(n, x, w, mask);
}

/* z = sum of a[k] x[k] over count >= 1 vectors; z may be any of them */
KMP_CLONES static void combination(ptrdiff_t n, int count, const double *a, const double *const *x, double *z)
{
    ptrdiff_t whole = n - n % LANES;
    for (ptrdiff_t i = 0; i < whole; i += LANES) {
        double part[LANES];
        for (int k = 0; k < LANES; k++)
            part[k] = a[0] * x[0][i + k];
        for (int v = 1; v < count; v++)
            for (int k = 0; k < LANES; k++)
                part[k] += a[v] * x[v][i + k];
        for (int k = 0; k < LANES; k++)
            z[i + k] = part[k];
    }
    for (ptrdiff_t i = whole; i < n; i++) {
        double one = a[0] * x[0][i];
        for (int v = 1; v < count; v++)
            one += a[v] * x[v][i];
        z[i] = one;
    }
}

/* -- callbacks of SUNDIALS ----------------------------------------------------------------------------- */

static ptrdiff_t length(N_Vector x)
{
    return NV_LENGTH_S(x);
}

static void linear_sum(double a, N_Vector x, double b, N_Vector y, N_Vector z)
{
    sum(length(x), a, NV_DATA_S(x), b, NV_DATA_S(y), NV_DATA_S(z));
}

static void scaled(double a, N_Vector x, N_Vector z)
{
    if (a == 1 && x == z)
        return;
    scale(length(x), a, NV_DATA_S(x), NV_DATA_S(z));
}

static double norm(N_Vector x, N_Vector w)
{
    return sqrt(squares(length(x), NV_DATA_S(x), NV_DATA_S(w)) / (double)length(x));
}

static double norm_where(N_Vector x, N_Vector w, N_Vector mask)
{
    return sqrt(squares_where(length(x), NV_DATA_S(x), NV_DATA_S(w), NV_DATA_S(mask)) / (double)length(x));
}

/* More vectors than this are combined in parts; no integrator has so many. */
enum { MOST = 16 };

static int linear_combination(int count, double *a, N_Vector *x, N_Vector z)
{
    const double *from[MOST + 1] = {NULL};
    double factor[MOST + 1];
    for (int done = 0; done < count;) {
        int more = 0;
        if (done > 0) { /* the sum so far */
            factor[more] = 1;
            from[more++] = NV_DATA_S(z);
        }
        for (; done < count && more <= MOST; done++) {
            factor[more] = a[done];
            from[more++] = NV_DATA_S(x[done]);
        }
        combination(length(z), more, factor, from, NV_DATA_S(z));
    }
    return 0;
}

N_Vector kmp_vector_new(sunindextype n, SUNContext context)
{
    N_Vector v = N_VNew_Serial(n, context);
    if (!v)
        return NULL;
    v->ops->nvlinearsum = linear_sum;
    v->ops->nvscale = scaled;
    v->ops->nvwrmsnorm = norm;
    v->ops->nvwrmsnormmask = norm_where;
    v->ops->nvlinearcombination = linear_combination;
    return v;
}
