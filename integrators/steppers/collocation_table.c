/* SPDX-License-Identifier: BSD-3-Clause */
/* Coefficients by Legendre polynomials: nodes as zeros of the difference of two of them, A by Gauss's rule exact for
 * the degree, eigenvalues of A by the method of Durand and Kerner. All is computed once for a number of stages. */
#include "integrators/steppers/collocation_table.h"
#include "base/clones.h"
#include "base/simd4.h"
#include "linalg/dense/dense.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <string.h>

enum { S = KMP_COLLOCATION_STAGES, E = KMP_COLLOCATION_EIGENVALUES, GAUSS = 8 };

/* Gauss's rule on (0, 1), exact for degree 15: for products of two polynomials of degree S. */
static const double GAUSS_NODE[GAUSS] = {0.019855071751231884158, 0.1016667612931866302,  0.23723379504183550709,
                                         0.40828267875217509753,  0.59171732124782490247, 0.76276620495816449291,
                                         0.8983332387068133698,   0.98014492824876811584};
static const double GAUSS_WEIGHT[GAUSS] = {0.050614268145188129576, 0.11119051722668723527, 0.15685332293894364367,
                                           0.18134189168918099148,  0.18134189168918099148, 0.15685332293894364367,
                                           0.11119051722668723527,  0.050614268145188129576};

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

/* Zeros of the difference of two Legendre polynomials, by Newton's method from Chebyshev's nodes; the last one is 1. */
static void find_nodes(kmp_collocation_table *table)
{
    int s = table->stages;
    table->node[0] = 0;
    table->node[s] = 1;
    for (int i = 1; i < s; i++) {
        double x = 0.5 + 0.5 * cos(2 * acos(-1.0) * (s - i) / (2 * s - 1));
        for (int pass = 0; pass < 8; pass++) {
            double p[S + 1] = {0}, slope[2]; /* (1 - z^2) P_k' = k (P_k-1 - z P_k), z = 2 x - 1 */
            legendre(s, x, p);
            for (int k = 0; k < 2; k++)
                slope[k] = (s - k) * (p[s - k - 1] - (2 * x - 1) * p[s - k]) / (2 * x * (1 - x));
            x -= (p[s] - p[s - 1]) / (slope[0] - slope[1]);
        }
        table->node[i] = x;
    }
}

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

static void expand(kmp_collocation_table *table)
{
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

/* Coefficients of the characteristic equation of A in z = 1 / lambda, monic, by powers of z: k! m[k] belongs to
 * z^(s - k) (find_eigenvalues). */
static void find_characteristic(int s, const double *m, double *a)
{
    double factorial = 1;
    for (int k = 0; k <= s; k++) {
        factorial *= k > 0 ? k : 1;
        a[s - k] = factorial * m[k] / m[0];
    }
}

/* The geometric mean of the eigenvalues of A; for odd s from there to the real one, by Newton's method. */
static double find_filter(int s, const double *m)
{
    double a[S + 1] = {0};
    find_characteristic(s, m, a);
    double z = pow(fabs(a[0]), 1.0 / s);
    for (int pass = 0; s % 2 == 1 && pass < 12; pass++) {
        double value = 1, slope = 0;
        for (int k = s; k-- > 0;) {
            slope = slope * z + value;
            value = value * z + a[k];
        }
        z -= value / slope;
    }
    return 1 / z;
}

static void find_gap(kmp_collocation_table *table)
{
    enum { PLACES = 400 };
    for (int k = 1; k < PLACES; k++) {
        double product = 1;
        for (int i = 0; i <= table->stages; i++)
            product *= (double)k / PLACES - table->node[i];
        table->gap = fmax(table->gap, fabs(product));
    }
    for (int i = 0; i <= table->stages; i++)
        table->centre += table->node[i] / (table->stages + 1);
}

void kmp_collocation_make(kmp_collocation_table *table, int stages)
{
    double m[S + 1] = {0};
    *table = (kmp_collocation_table){.stages = stages};
    find_nodes(table);
    integrate(table);
    expand(table);
    find_gap(table);
    find_product(table, m);
    table->filter = find_filter(stages, m);
    for (int j = 0; j < stages; j++) {
        double *end = table->end[j];
        end[KMP_END_ONCE] = table->a[stages - 1][j];
        end[KMP_END_TWICE] = table->aa[stages - 1][j];
        end[KMP_END_SLOPE] = -table->filter * table->start[j];
        for (int i = 0; i < stages; i++)
            end[KMP_END_SLOPE_TWICE] -= table->filter * table->start[i] * table->a[i][j];
    }
}

/* -- eigenvalues ---------------------------------------------------------------------------------------- */

typedef struct number {
    double re, im;
} number;

static number times(number x, number y)
{
    return (number){x.re * y.re - x.im * y.im, x.re * y.im + x.im * y.re};
}

static number over(number x, number y)
{
    double square = y.re * y.re + y.im * y.im;
    return times(x, (number){y.re / square, -y.im / square});
}

/* Zeros of sum a[k] z^k, a[count] = 1, all at once (Durand, Kerner), from places around a circle. A change below ENOUGH
 * of the radius leaves an error of its square. */
static void find_zeros(int count, const double *a, double radius, number *z)
{
    enum { MOST = 200 };
    const double ENOUGH = 1e-8;
    double change = 1;
    for (int i = 0; i < count; i++) {
        double angle = 0.4 + 2 * acos(-1.0) * i / count;
        z[i] = (number){radius * cos(angle), radius * sin(angle)};
    }
    for (int pass = 0; pass < MOST && change > ENOUGH; pass++) {
        change = 0;
        for (int i = 0; i < count; i++) {
            number value = {1, 0}, product = {1, 0};
            for (int k = count; k-- > 0;) {
                value = times(value, z[i]);
                value.re += a[k];
            }
            for (int j = 0; j < count; j++)
                if (j != i)
                    product = times(product, (number){z[i].re - z[j].re, z[i].im - z[j].im});
            number step = over(value, product);
            z[i].re -= step.re;
            z[i].im -= step.im;
            change = fmax(change, (fabs(step.re) + fabs(step.im)) / radius);
        }
    }
}

/* A polynomial p with p(0) = 0 and p = lambda p' at all c is sum lambda^k M^(k) with M = prod (x - c[i]); p(0) = 0 is
 * the characteristic equation, and p(c[i]) are the components of the eigenvector. */
static void find_eigenvalues(kmp_collocation_table *table, const double *m)
{
    double a[S + 1] = {0};
    number z[S];
    int s = table->stages;
    find_characteristic(s, m, a);
    find_zeros(s, a, 1 / table->filter, z);
    table->eigenvalues = 1;
    for (int i = 0; i < s; i++) {
        number root = over((number){1, 0}, z[i]);
        bool is_real = fabs(root.im) < 1e-9 * fabs(root.re);
        if (is_real || root.im < 0) /* the real one is the filter */
            continue;
        table->re[table->eigenvalues] = root.re;
        table->im[table->eigenvalues++] = root.im;
    }
}

/* v[i] = sum over k >= 1 of lambda^k M^(k)(c[i]). */
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
    table->re[0] = table->filter;
    find_eigenvalues(table, m);
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
