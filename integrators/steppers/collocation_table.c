/* SPDX-License-Identifier: BSD-3-Clause */
/* Coefficients by Legendre polynomials: nodes, which are zeros of the difference of two of them, and eigenvalues of A
 * are given as numbers, A comes from Gauss's rule exact for the degree. All is computed once for a number of stages.
 */
#include "integrators/steppers/collocation_table.h"
#include "base/clones.h"
#include "base/simd4.h"
#include "linalg/dense/dense.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <string.h>

typedef struct number {
    double re, im;
} number;

enum { S = KMP_COLLOCATION_STAGES, E = KMP_COLLOCATION_EIGENVALUES, GAUSS = 8 };

/* Gauss's rule on (0, 1), exact for degree 15: for products of two polynomials of degree S. */
static const double GAUSS_NODE[GAUSS] = {0.019855071751231884158, 0.1016667612931866302,  0.23723379504183550709,
                                         0.40828267875217509753,  0.59171732124782490247, 0.76276620495816449291,
                                         0.8983332387068133698,   0.98014492824876811584};
static const double GAUSS_WEIGHT[GAUSS] = {0.050614268145188129576, 0.11119051722668723527, 0.15685332293894364367,
                                           0.18134189168918099148,  0.18134189168918099148, 0.15685332293894364367,
                                           0.11119051722668723527,  0.050614268145188129576};

/* 0 and the zeros of P_s - P_s-1 for Legendre polynomials P of (0, 1), by the number of stages s. */
static const double NODE[S + 1][S + 1] = {
    [2] = {0, 0.33333333333333331, 1},
    [3] = {0, 0.15505102572168222, 0.64494897427831777, 1},
    [4] = {0, 0.088587959512703901, 0.40946686444073471, 0.787659461760847, 1},
    [5] = {0, 0.057104196114517697, 0.2768430136381238, 0.58359043236891683, 0.86024013565621948, 1},
    [6] = {0, 0.039809857051468743, 0.19801341787360821, 0.43797481024738616, 0.69546427335363614, 0.90146491420117358,
           1},
    [7] = {0, 0.029316427159784907, 0.1480785996684843, 0.3369846902811543, 0.55867151877155008, 0.7692338620300545,
           0.92694567131974115, 1}};

/* Eigenvalues of A, the zeros of its characteristic polynomial sum k! m[k] lambda^k with prod (x - c[i]) = sum m[k]
 * x^k, of pairs one. The first is the real one, for even s their geometric mean. */
static const number EIGENVALUE[S + 1][E] = {
    [2] = {{0.40824829046386307, 0}, {0.33333333333333331, 0.23570226039551581}},
    [3] = {{0.27488882959567751, 0}, {0.16255558520216126, 0.18494932440714076}},
    [4] = {{0.18575057999133596, 0},
           {0.18866380337915384, 0.061774416896890644},
           {0.097050482335131805, 0.14418247112153684}},
    [5] = {{0.15906584442746982, 0},
           {0.065065778545743719, 0.116468527740317},
           {0.13317907701829951, 0.074994511835818678}},
    [6] = {{0.12013537858879869, 0},
           {0.12752426252015225, 0.027605246617305977},
           {0.046984466935002377, 0.097085513478025923},
           {0.098218543272118236, 0.074380905641177636}},
    [7] = {{0.11189646530003809, 0},
           {0.075280411819774601, 0.06981960078083467},
           {0.03571655826407788, 0.082953154313331501},
           {0.10228556649689736, 0.039427496438061503}}};

/* The largest |x prod (x - c[i])| on (0, 1). */
static const double GAP[S + 1] = {
    [2] = 0.078244140625,       [3] = 0.018252640000000001,   [4] = 0.0044231726343749982,
    [5] = 0.001147115956182292, [6] = 0.00028293696050419925, [7] = 6.988904716436159e-05};

/* -- polynomials ---------------------------------------------------------------------------------------- */

/* p[0 .. most]: Legendre polynomials of (0, 1) at x. */
static void legendre(int most, double x, double *p)
{
    double z = 2 * x - 1;
    p[0] = 1;
    p[1] = z;
    for (int i = 2; i <= most; i++)
        p[i] = ((2 * i - 1) * z * p[i - 1] - (i - 1) * p[i - 2]) / i;
}

static KMP_INTO_CLONES void lagrange_of(int w, int count, const double *node, const double *barycentric,
                                        const double *restrict x, double *restrict value)
{
    double product[KMP_COLLOCATION_LANES];
    for (int l = 0; l < w; l++)
        product[l] = 1;
    for (int j = 0; j < count; j++)
        for (int l = 0; l < w; l++) {
            value[j * w + l] = barycentric[j] * product[l];
            product[l] *= x[l] - node[j];
        }
    for (int l = 0; l < w; l++)
        product[l] = 1;
    for (int j = count; j-- > 0;)
        for (int l = 0; l < w; l++) {
            value[j * w + l] *= product[l];
            product[l] *= x[l] - node[j];
        }
}

/* Lagrange polynomials of nodes[0 .. count) at w places x, which are the lanes of value. Loops over the usual number of
 * lanes are unrolled. */
static KMP_CLONES void lagrange(int w, int count, const double *node, const double *barycentric, const double *x,
                                double *value)
{
    if (w == KMP_COLLOCATION_LANES)
        lagrange_of(KMP_COLLOCATION_LANES, count, node, barycentric, x, value);
    else
        lagrange_of(w, count, node, barycentric, x, value);
}

static void find_barycentric(int count, const double *node, double *barycentric)
{
    for (int j = 0; j < count; j++) {
        double product = 1;
        for (int k = 0; k < count; k++)
            product *= k == j ? 1 : node[j] - node[k];
        barycentric[j] = 1 / product;
    }
}

/* -- coefficients --------------------------------------------------------------------------------------- */

/* a[i][j] is the integral of the j-th Lagrange polynomial of c from 0 to c[i]. */
static void integrate(kmp_collocation_table *table)
{
    int s = table->stages;
    double barycentric[S] = {0}, value[S] = {0};
    const double *c = table->node + 1;
    find_barycentric(s, c, barycentric);
    lagrange(1, s, c, barycentric, &(double){0}, table->start);
    for (int j = 0; j < s; j++)
        table->lead[j] = barycentric[j] / s;
    for (int i = 0; i < s; i++)
        for (int g = 0; g < GAUSS; g++) {
            lagrange(1, s, c, barycentric, &(double){c[i] * GAUSS_NODE[g]}, value);
            for (int j = 0; j < s; j++)
                table->a[i][j] += c[i] * GAUSS_WEIGHT[g] * value[j];
        }
    for (int i = 0; i < s; i++)
        for (int j = 0; j < s; j++)
            for (int k = 0; k < s; k++)
                table->aa[i][j] += table->a[i][k] * table->a[k][j];
}

/* Coefficients of prod (x - c[i]), by powers of x. */
static void find_product(const kmp_collocation_table *table, double *m)
{
    memset(m, 0, (S + 1) * sizeof *m);
    m[0] = 1;
    for (int i = 1; i <= table->stages; i++)
        for (int k = i; k >= 0; k--)
            m[k] = (k > 0 ? m[k - 1] : 0) - table->node[i] * m[k];
}

void kmp_collocation_make(kmp_collocation_table *table, int stages)
{
    *table = (kmp_collocation_table){.stages = stages, .gap = GAP[stages], .filter = EIGENVALUE[stages][0].re};
    memcpy(table->node, NODE[stages], sizeof table->node);
    for (int i = 0; i <= stages; i++)
        table->centre += table->node[i] / (stages + 1);
    integrate(table);
    int s = table->stages;
    double p[S + 1] = {0}, value[S + 1] = {0};
    find_barycentric(s + 1, table->node, table->barycentric);
    for (int g = 0; g < GAUSS; g++) {
        legendre(s, GAUSS_NODE[g], p);
        kmp_collocation_weights(table, 1, &GAUSS_NODE[g], value);
        for (int i = 0; i <= s; i++)
            for (int j = 0; j <= s; j++)
                table->legendre[i][j] += (2 * i + 1) * GAUSS_WEIGHT[g] * p[i] * value[j];
    }
    for (int j = 0; j < stages; j++) {
        double *end = table->end[j];
        end[KMP_END_ONCE] = table->a[stages - 1][j];
        end[KMP_END_TWICE] = table->aa[stages - 1][j];
        end[KMP_END_SLOPE] = -table->filter * table->start[j];
        for (int i = 0; i < stages; i++)
            end[KMP_END_SLOPE_TWICE] -= table->filter * table->start[i] * table->a[i][j];
    }
}

/* -- eigenvectors ---------------------------------------------------------------------------------------- */

static number times(number x, number y)
{
    return (number){x.re * y.re - x.im * y.im, x.re * y.im + x.im * y.re};
}

/* A polynomial p with p(0) = 0 and p = lambda p' at all c is sum lambda^k M^(k) with M = prod (x - c[i]); p(c[i]) are
 * the components of the eigenvector: v[i] = sum over k >= 1 of lambda^k M^(k)(c[i]). */
static void find_vector(const kmp_collocation_table *table, const double *m, number lambda, number *v)
{
    int s = table->stages;
    for (int i = 0; i < s; i++) {
        double derivative[S + 1];
        number power = {1, 0};
        memcpy(derivative, m, sizeof derivative);
        v[i] = (number){0, 0};
        for (int k = 1; k <= s; k++) {
            double value = 0;
            for (int l = 0; l <= s - k; l++)
                derivative[l] = (l + 1) * derivative[l + 1];
            for (int l = s - k; l >= 0; l--)
                value = value * table->node[i + 1] + derivative[l];
            power = times(power, lambda);
            v[i].re += value * power.re;
            v[i].im += value * power.im;
        }
    }
}

void kmp_collocation_add_eigenvalues(kmp_collocation_table *table)
{
    int s = table->stages, pivot[S], column = 0;
    double m[S + 1], vectors[S * S], inverse[S * S] = {0};
    find_product(table, m);
    table->eigenvalues = 1 + s / 2;
    for (int e = 0; e < table->eigenvalues; e++) {
        table->re[e] = EIGENVALUE[s][e].re;
        table->im[e] = EIGENVALUE[s][e].im;
    }
    for (int e = s % 2 ? 0 : 1; e < table->eigenvalues; e++) {
        number v[S] = {{0, 0}};
        find_vector(table, m, (number){table->re[e], table->im[e]}, v);
        for (int i = 0; i < s; i++) {
            table->outof_re[i][e] = vectors[i + column * s] = v[i].re;
            table->outof_im[i][e] = v[i].im;
            if (e > 0)
                vectors[i + (column + 1) * s] = v[i].im;
        }
        column += e > 0 ? 2 : 1;
    }
    for (int i = 0; i < s; i++)
        inverse[i + i * s] = 1;
    (void)kmp_lu_factor(s, vectors, pivot);
    kmp_lu_solve(s, vectors, pivot, s, inverse);
    column = 0;
    for (int e = s % 2 ? 0 : 1; e < table->eigenvalues; e++) { /* u1 x + u2 y = Re (u1 - i u2) (x + i y) */
        for (int j = 0; j < s; j++) {
            table->into_re[e][j] = inverse[column + j * s];
            table->into_im[e][j] = e > 0 ? -inverse[column + 1 + j * s] : 0;
        }
        column += e > 0 ? 2 : 1;
    }
}

const kmp_collocation_table *kmp_collocation_table_of(int stages)
{
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    static kmp_collocation_table tables[S + 1];
    kmp_collocation_table *table = &tables[stages];
    (void)pthread_mutex_lock(&lock);
    if (table->eigenvalues == 0) {
        kmp_collocation_make(table, stages);
        kmp_collocation_add_eigenvalues(table);
    }
    (void)pthread_mutex_unlock(&lock);
    return table;
}

/* -- weights -------------------------------------------------------------------------------------------- */

void kmp_collocation_weights(const kmp_collocation_table *table, int places, const double *x, double *weight)
{
    lagrange(places, table->stages + 1, table->node, table->barycentric, x, weight);
}

/* The integral of P_i from 0 is (P_i+1 - P_i-1) / (2 (2 i + 1)) for i > 0. 1 / (2 (2 i + 1)) for i = 1, 2, .. */
#define OF(i) (0.5 / (2 * (i) + 1))
static const double PER_INTEGRAL[S + 1] = {OF(1), OF(2), OF(3), OF(4), OF(5), OF(6), OF(7), OF(8)};
#undef OF
/* P_i = RISE[i] z P_i-1 - FALL[i] P_i-2 with z = 2 x - 1. */
#define RISE(i) ((2.0 * (i)-1) / (i))
#define FALL(i) (((i)-1.0) / (i))
static const double RISE[S + 3] = {0, 1, RISE(2), RISE(3), RISE(4), RISE(5), RISE(6), RISE(7), RISE(8), RISE(9)};
static const double FALL[S + 3] = {0, 0, FALL(2), FALL(3), FALL(4), FALL(5), FALL(6), FALL(7), FALL(8), FALL(9)};
#undef RISE
#undef FALL

/* Each row of results needs these weights: both sums are made in one pass, without divisions. For fewer stages the
 * table has zeros beyond its polynomials. */
static KMP_CLONES void integrals(const kmp_collocation_table *table, double x, double *once, double *twice)
{
    const double z = 2 * x - 1;
    double p[S + 3] = {1, z}, first[S + 2] = {0}, second[S + 1] = {0};
    for (int i = 2; i < S + 3; i++)
        p[i] = RISE[i] * z * p[i - 1] - FALL[i] * p[i - 2];
    first[0] = 0.5 * (p[1] + p[0]);
    KMP_EIGHT_AT(first + 1) = (KMP_EIGHT_CONST(p + 2) - KMP_EIGHT_CONST(p)) * KMP_EIGHT_CONST(PER_INTEGRAL);
    second[0] = 0.5 * (first[1] + first[0]);
    for (int i = 1; i <= S; i++)
        second[i] = (first[i + 1] - first[i - 1]) * PER_INTEGRAL[i - 1];
    kmp_eight sum = {0}, of_sum = {0};
    for (int i = 0; i <= table->stages; i++) {
        sum += KMP_EIGHT_CONST(table->legendre[i]) * first[i];
        of_sum += KMP_EIGHT_CONST(table->legendre[i]) * second[i];
    }
    KMP_EIGHT_AT(once) = sum;
    KMP_EIGHT_AT(twice) = of_sum;
}

void kmp_collocation_integrals(const kmp_collocation_table *table, double x, double *once, double *twice)
{
    integrals(table, x, once, twice);
}
