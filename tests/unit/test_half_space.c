/* SPDX-License-Identifier: BSD-3-Clause */
/* Kalker's coefficients from the half-space itself, without his table: constant tractions in the rectangles of a grid,
 * their displacements by Cerruti's formulas, and nothing that slips: what a particle is displaced by on its way from
 * one rectangle to the next is what the bodies would slip by (Kalker 1990, section 4). The grid's error is some per
 * cent; that of C23 has one sign where spin makes a force, and the other where creep makes a moment. */
#include "base/memory.h"
#include "linalg/dense/dense.h"
#include "testing.h"
#include <kempe/rolling_contact.h>
#include <math.h>

enum { GRID = 24, MOST = GRID * GRID };

typedef struct ellipse {
    double a, b, nu, hx, hy; /* semi-axes, Poisson's ratio, sides of a rectangle */
    int count;               /* of rectangles */
    double x[MOST], y[MOST];
} ellipse;

static void place(ellipse *e, double ratio, double nu)
{
    *e = (ellipse){.a = sqrt(ratio), .b = 1 / sqrt(ratio), .nu = nu};
    e->hx = 2 * e->a / GRID, e->hy = 2 * e->b / GRID;
    for (int k = 0; k < MOST; k++) {
        double x = -e->a + (k / GRID + 0.5) * e->hx, y = -e->b + (k % GRID + 0.5) * e->hy;
        if (hypot(x / e->a, y / e->b) < 1)
            e->x[e->count] = x, e->y[e->count++] = y;
    }
}

/* Displacement of both bodies against each other at (x, y) from a rectangle's middle, times G: [of x, y][by x, y]. */
static void displaced(const ellipse *e, double x, double y, double by[2][2])
{
    memset(by, 0, 4 * sizeof(double));
    for (int k = 0; k < 4; k++) {
        double u = x + (k & 1 ? 0.5 : -0.5) * e->hx, v = y + (k & 2 ? 0.5 : -0.5) * e->hy, r = hypot(u, v);
        double sign = k == 0 || k == 3 ? 1 / 3.14159265358979323846 : -1 / 3.14159265358979323846;
        double over_u = v * log(u + r), over_v = u * log(v + r); /* integrals of u^2 / r^3 and v^2 / r^3 */
        by[0][0] += sign * (over_u + (1 - e->nu) * over_v);
        by[1][1] += sign * (over_v + (1 - e->nu) * over_u);
        by[0][1] -= sign * e->nu * r;
        by[1][0] -= sign * e->nu * r;
    }
}

/* Two rows of the equations, for the rectangle number i, and their right-hand sides for creep along, across and spin.
 */
static void add_rows(const ellipse *e, int i, double *matrix, double *sides)
{
    int n = 2 * e->count;
    for (int j = 0; j < e->count; j++) {
        double here[2][2], before[2][2];
        displaced(e, e->x[i] - e->x[j], e->y[i] - e->y[j], here);
        displaced(e, e->x[i] + e->hx - e->x[j], e->y[i] - e->y[j], before);
        for (int p = 0; p < 2; p++)
            for (int q = 0; q < 2; q++)
                matrix[2 * i + p + n * (2 * j + q)] = here[p][q] - before[p][q];
    }
    sides[2 * i] = sides[2 * i + 1 + n] = -e->hx;
    sides[2 * i + 2 * n] = e->hx * e->y[i];
    sides[2 * i + 1 + 2 * n] = -e->hx * (e->x[i] + 0.5 * e->hx);
}

/* Sums of force along, across and moment for unit creep along, across and unit spin; G and a b are one. */
static void solve(const ellipse *e, double sum[3][3])
{
    int n = 2 * e->count, *pivot = KMP_NEW(int, n);
    double *matrix = KMP_NEW(double, n *n), *sides = KMP_NEW(double, 3 * n);
    for (int i = 0; i < e->count; i++)
        add_rows(e, i, matrix, sides);
    CHECK(kmp_lu_factor(n, matrix, pivot) == 0);
    kmp_lu_solve(n, matrix, pivot, 3, sides);
    memset(sum, 0, 9 * sizeof(double));
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < e->count; i++) {
            double x = sides[2 * i + k * n] * e->hx * e->hy, y = sides[2 * i + 1 + k * n] * e->hx * e->hy;
            sum[k][0] += x, sum[k][1] += y, sum[k][2] += e->x[i] * y - e->y[i] * x;
        }
    kmp_free(pivot);
    kmp_free(matrix);
    kmp_free(sides);
}

static void compare(double ratio, double nu)
{
    static ellipse e;
    kempe_kalker c;
    double sum[3][3];
    place(&e, ratio, nu);
    solve(&e, sum);
    CHECK(kempe_contact_kalker(ratio, nu, &c) == KEMPE_OK);
    printf("a/b %.1f, nu %.2f: %.3f %.3f %.3f and %.3f, %.3f, table %.3f %.3f %.3f, %.3f\n", ratio, nu, -sum[0][0],
           -sum[1][1], -sum[2][1], sum[1][2], -sum[2][2], c.c11, c.c22, c.c23, c.c33);
    CHECK_NEAR(-sum[0][0] / c.c11, 1, 0.03);
    CHECK_NEAR(-sum[1][1] / c.c22, 1, 0.03);
    CHECK_NEAR(0.5 * (sum[1][2] - sum[2][1]) / c.c23, 1, 0.04);
    CHECK_NEAR(-sum[2][2] / c.c33, 1, 0.06);
    CHECK(fabs(sum[0][1]) < 1e-9 && fabs(sum[0][2]) < 1e-9 && fabs(sum[1][0]) < 1e-9 && fabs(sum[2][0]) < 1e-9);
}

static void test_circle(void)
{
    compare(1, 0.25);
}

static void test_long_across(void)
{
    compare(0.2, 0.25);
}

/* Between rows of the table. */
static void test_long_along(void)
{
    compare(6.6, 0.28);
}

int main(void)
{
    TEST(test_circle);
    TEST(test_long_across);
    TEST(test_long_along);
    return check_report();
}
