/* SPDX-License-Identifier: BSD-3-Clause */
/* With M = prod (x - c[i]), a polynomial p with p' - g p = k M and p(0) = 0 is an eigenvector of the differentiation by
 * values at c. g solves sum M^(k)(0) g^(s - k) = 0, and p = sum M^(k) g^(s - k) up to a factor. Extended precision
 * keeps the rounding of these computations below that of the results. */
#include "integrators/steppers/radau_method.h"
#include <complex.h>
#include <math.h>
#include <string.h>

enum { S = KMP_RADAU_MAX_STAGES, SWEEPS = 200 };

typedef long double real;
typedef long double complex number;

/* Coefficient k of Legendre's polynomial of degree n on (0, 1). */
static real legendre(int n, int k)
{
    real value = (n + k) % 2 ? -1 : 1;
    for (int i = 1; i <= k; i++)
        value *= (real)(n - k + i) * (real)(n + i) / ((real)i * (real)i);
    return k > n ? 0 : value;
}

/* A polynomial with leading coefficient 1. */
static number polynomial(int n, const real *coefficient, number x)
{
    number value = 1;
    for (int k = n - 1; k >= 0; k--)
        value = value * x + coefficient[k];
    return value;
}

/* Finds all zeros at once, by Weierstrass's iteration. */
static void find_zeros(int n, const real *coefficient, number *zero)
{
    real size = 0;
    for (int k = 0; k < n; k++)
        size = fmaxl(size, powl(fabsl(coefficient[k]), 1 / (real)(n - k)));
    for (int i = 0; i < n; i++)
        zero[i] = size * cpowl(0.4L + 0.9L * I, i);
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (int i = 0; i < n; i++) {
            number product = 1;
            for (int j = 0; j < n; j++)
                product *= j == i ? 1 : zero[i] - zero[j];
            zero[i] -= polynomial(n, coefficient, zero[i]) / product;
        }
}

/* Refines a zero by Legendre's recurrence, which is more accurate than the powers of x. */
static real polish(int n, real x)
{
    for (int pass = 0; pass < 3; pass++) {
        real y = 2 * x - 1, before = 1, value = y, slope_before = 0, slope = 2;
        for (int k = 1; k < n; k++) {
            real next = ((real)(2 * k + 1) * y * value - (real)k * before) / (real)(k + 1);
            real next_slope = ((real)(2 * k + 1) * (2 * value + y * slope) - (real)k * slope_before) / (real)(k + 1);
            before = value;
            value = next;
            slope_before = slope;
            slope = next_slope;
        }
        x -= (value - before) / (slope - slope_before);
    }
    return x;
}

/* The zeros of P_s - P_s-1, ascending; the last one is 1. */
static void find_nodes(int s, real *c)
{
    real coefficient[S] = {0};
    number zero[S] = {0};
    for (int k = 0; k < s; k++)
        coefficient[k] = (legendre(s, k) - legendre(s - 1, k)) / legendre(s, s);
    find_zeros(s, coefficient, zero);
    for (int i = 0; i < s; i++) {
        real x = polish(s, creall(zero[i]));
        int at = i;
        for (; at > 0 && c[at - 1] > x; at--)
            c[at] = c[at - 1];
        c[at] = x;
    }
    c[s - 1] = 1;
}

/* Coefficients of prod (x - c[i]) without the leading 1. */
static void expand(int s, const real *c, real *m)
{
    memset(m, 0, S * sizeof *m);
    for (int i = 0; i < s; i++)
        for (int k = i; k >= 0; k--)
            m[k] = (k > 0 ? m[k - 1] : 0) - c[i] * (k == i ? 1 : m[k]);
}

/* Differentiation by the values at 0 (left out: it is 0) and at c: row 0 at 0, row 1 + i at c[i]. */
static void differentiate(int s, const real *c, real d[S + 1][S + 1], real *weight)
{
    real x[S + 1] = {0};
    memcpy(x + 1, c, (size_t)s * sizeof *x);
    for (int i = 0; i <= s; i++) {
        weight[i] = 1;
        for (int j = 0; j <= s; j++)
            weight[i] /= j == i ? 1 : x[i] - x[j];
    }
    for (int i = 0; i <= s; i++) {
        d[i][i] = 0;
        for (int j = 0; j <= s; j++)
            if (j != i) {
                d[i][j] = weight[j] / weight[i] / (x[i] - x[j]);
                d[i][i] += 1 / (x[i] - x[j]);
            }
    }
}

/* p at x for an eigenvalue, by successive derivatives of M. */
static number eigenvector(int s, const real *m, number g, real x)
{
    real power[S + 1];
    number value = 0;
    memcpy(power, m, (size_t)s * sizeof *power);
    power[s] = 1;
    for (int k = 0; k <= s; k++) {
        real derivative = 0;
        for (int i = s - k; i >= 0; i--)
            derivative = derivative * x + power[i];
        value += derivative / cpowl(g, k);
        for (int i = 0; i < s - k; i++)
            power[i] = (real)(i + 1) * power[i + 1];
    }
    return value;
}

/* Eigenvalues as zeros of their polynomial: k! m[k] is the k-th derivative of M at 0. */
static void find_eigenvalues(int s, const real *m, number *g)
{
    real coefficient[S] = {0}, factorial[S + 1] = {1};
    for (int k = 1; k <= s; k++)
        factorial[k] = (real)k * factorial[k - 1];
    for (int k = 0; k < s; k++)
        coefficient[k] = factorial[s - k] * (s - k == s ? 1 : m[s - k]) / m[0];
    find_zeros(s, coefficient, g);
}

/* Writes an eigenvector scaled so that the last entry, at the step's end, is 1. */
static void put_column(int s, const real *c, const real *m, number g, real t[S][S], int column, int parts)
{
    number end = eigenvector(s, m, g, 1);
    for (int i = 0; i < s; i++) {
        number v = eigenvector(s, m, g, c[i]) / end;
        t[i][column] = creall(v);
        if (parts > 1)
            t[i][column + 1] = cimagl(v);
    }
}

/* Inverts by Gauss-Jordan elimination with row exchanges. */
static void invert(int s, real a[S][S], real x[S][S])
{
    for (int i = 0; i < s; i++)
        for (int j = 0; j < s; j++)
            x[i][j] = i == j;
    for (int k = 0; k < s; k++) {
        int pivot = k;
        for (int i = k + 1; i < s; i++)
            pivot = fabsl(a[i][k]) > fabsl(a[pivot][k]) ? i : pivot;
        for (int j = 0; j < s; j++) {
            real left = a[k][j], right = x[k][j];
            a[k][j] = a[pivot][j];
            a[pivot][j] = left;
            x[k][j] = x[pivot][j];
            x[pivot][j] = right;
        }
        real scale = 1 / a[k][k];
        for (int j = 0; j < s; j++) {
            a[k][j] *= scale;
            x[k][j] *= scale;
        }
        for (int i = 0; i < s; i++) {
            real factor = a[i][k];
            for (int j = 0; j < s && i != k; j++) {
                a[i][j] -= factor * a[k][j];
                x[i][j] -= factor * x[k][j];
            }
        }
    }
}

static void round_off(int s, real from[S][S], double to[S][S])
{
    for (int i = 0; i < s; i++)
        for (int j = 0; j < s; j++)
            to[i][j] = (double)from[i][j];
}

/* Sorts the eigenvalues: the real one first, then of each pair the one with positive imaginary part, by its size. */
static void put_spectrum(kmp_radau_method *method, const real *c, const real *m)
{
    int s = method->stages;
    number g[S] = {0};
    real t[S][S] = {{0}}, inverse[S][S] = {{0}}, b[KMP_RADAU_MAX_PAIRS] = {0};
    find_eigenvalues(s, m, g);
    method->pairs = 0;
    for (int i = 0; i < s; i++) {
        if (fabsl(cimagl(g[i])) < 1e-9L * cabsl(g[i])) {
            method->g = (double)creall(g[i]);
            put_column(s, c, m, creall(g[i]), t, 0, 1);
        } else if (cimagl(g[i]) > 0) {
            int at = method->pairs++;
            for (; at > 0 && b[at - 1] > cimagl(g[i]); at--)
                b[at] = b[at - 1];
            b[at] = cimagl(g[i]);
        }
    }
    for (int pair = 0; pair < method->pairs; pair++)
        for (int i = 0; i < s; i++)
            if (cimagl(g[i]) == b[pair]) {
                method->a[pair] = (double)creall(g[i]);
                method->b[pair] = (double)b[pair];
                put_column(s, c, m, g[i], t, 1 + 2 * pair, 2);
            }
    round_off(s, t, method->t);
    invert(s, t, inverse);
    round_off(s, inverse, method->inverse);
}

/* Sets the matrices; d is the differentiation without the row and column of 0. */
static void put_matrices(kmp_radau_method *method, real at_all[S + 1][S + 1])
{
    int s = method->stages;
    real d[S][S] = {{0}}, butcher[S][S] = {{0}};
    for (int i = 0; i < s; i++) {
        method->slope[i] = (double)at_all[0][1 + i];
        memcpy(d[i], at_all[1 + i] + 1, (size_t)s * sizeof **d);
    }
    round_off(s, d, method->d);
    invert(s, d, butcher);
    round_off(s, butcher, method->butcher);
}

/* Sets the gap by sampling. */
static void put_gap(kmp_radau_method *method, const real *c)
{
    enum { PLACES = 200 };
    real most = 0, sum = 0;
    for (int k = 0; k < PLACES; k++) {
        real x = (real)k / PLACES, product = x;
        for (int i = 0; i < method->stages; i++)
            product *= x - c[i];
        most = fmaxl(most, fabsl(product));
    }
    for (int i = 0; i < method->stages; i++)
        sum += c[i];
    method->gap = (double)most;
    method->centre = (double)(sum / (real)(method->stages + 1));
}

void kmp_radau_method_derive(kmp_radau_method *method, int stages)
{
    real c[S] = {0}, m[S] = {0}, d[S + 1][S + 1] = {{0}}, weight[S + 1] = {0};
    *method = (kmp_radau_method){.stages = stages};
    find_nodes(stages, c);
    expand(stages, c, m);
    differentiate(stages, c, d, weight);
    put_spectrum(method, c, m);
    put_matrices(method, d);
    put_gap(method, c);
    for (int i = 0; i < stages; i++)
        method->c[i] = (double)c[i];
    for (int i = 0; i <= stages; i++) {
        method->node_weight[i] = (double)weight[i];
        method->bend[1 + i] = (double)((i < stages ? m[i] : 1) / (real)(1 + i) / m[0]);
    }
}

/* Weights by the barycentric formula. */
void kmp_radau_weights(const kmp_radau_method *method, double x, double *weight)
{
    int s = method->stages, at = -1;
    double sum = 0;
    for (int j = 0; j < s && at < 0; j++)
        at = x == method->c[j] ? j : at;
    for (int j = 0; j < s; j++) {
        weight[j] = at >= 0 || x == 0 ? at == j : method->node_weight[1 + j] / (x - method->c[j]);
        sum += weight[j];
    }
    if (at >= 0 || x == 0)
        return;
    sum += method->node_weight[0] / x;
    for (int j = 0; j < s; j++)
        weight[j] /= sum;
}

double kmp_radau_bend(const kmp_radau_method *method, double x)
{
    double value = 0;
    for (int k = method->stages + 1; k >= 0; k--)
        value = value * x + method->bend[k];
    return value;
}
