/* SPDX-License-Identifier: BSD-3-Clause */
/* Minima in a box against the enumeration of all 3^n combinations of sides, with regular, singular and zero D, also
 * with infinite bounds. */
#include "linalg/dense/box_minimum.h"
#include "linalg/dense/lapack.h"
#include "random.h"
#include "testing.h"

#include <stdbool.h>

enum { MOST = 6 };

typedef struct problem {
    int n;
    double d[MOST * MOST], a[MOST], lower[MOST], upper[MOST];
} problem;

static kmp_box box_of(const problem *p)
{
    return (kmp_box){p->n, p->d, p->a, p->lower, p->upper};
}

/* D = G G' of the given rank, with rows of very different sizes. */
static void randomise(problem *p, int n, int rank)
{
    double g[MOST][MOST];
    p->n = n;
    for (int i = 0; i < n; i++) {
        double size = pow(10, between(-2, 2));
        for (int k = 0; k < rank; k++)
            g[i][k] = size * between(-1, 1);
        p->a[i] = size * between(-1, 1);
        p->upper[i] = between(0, 3) / size;
        p->lower[i] = pick(3) == 0 ? 0 : -p->upper[i];
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            p->d[i + j * n] = 0;
            for (int k = 0; k < rank; k++)
                p->d[i + j * n] += g[i][k] * g[j][k];
        }
}

static double slope(const problem *p, const double *x, int i)
{
    double sum = p->a[i];
    for (int j = 0; j < p->n; j++)
        sum += p->d[i + j * p->n] * x[j];
    return sum;
}

static double value(const problem *p, const double *x)
{
    double sum = 0;
    for (int i = 0; i < p->n; i++)
        sum += x[i] * (slope(p, x, i) + p->a[i]) / 2;
    return sum;
}

/* x of one combination: entries inside by least squares. */
static void solve_face(const problem *p, const int *side, double *x)
{
    double matrix[MOST * MOST], right[MOST], inside[MOST];
    int list[MOST], count = 0;
    for (int i = 0; i < p->n; i++) {
        x[i] = side[i] == 0 ? 0 : side[i] < 0 ? p->lower[i] : p->upper[i];
        if (side[i] == 0)
            list[count++] = i;
    }
    for (int i = 0; i < count; i++) {
        right[i] = -slope(p, x, list[i]);
        for (int j = 0; j < count; j++)
            matrix[i + j * count] = p->d[list[i] + list[j] * p->n];
    }
    if (count > 0)
        kmp_least_squares(count, count, matrix, right, 1e-10, inside);
    for (int i = 0; i < count; i++)
        x[list[i]] = inside[i];
}

/* The least value over all combinations that lie in the box. */
static double least_value(const problem *p)
{
    double least = INFINITY, x[MOST];
    int total = 1, side[MOST];
    for (int i = 0; i < p->n; i++)
        total *= 3;
    for (int k = 0; k < total; k++) {
        bool within = true;
        for (int i = 0, rest = k; i < p->n; i++, rest /= 3)
            side[i] = rest % 3 - 1;
        solve_face(p, side, x);
        for (int i = 0; i < p->n; i++)
            within = within && isfinite(x[i]) && x[i] >= p->lower[i] * (1 + 1e-9) && x[i] <= p->upper[i] * (1 + 1e-9);
        if (within)
            least = fmin(least, value(p, x));
    }
    return least;
}

/* The complementarity conditions, to rounding of each entry's own size. */
static void check_conditions(const problem *p, const double *x, const double *y, const int *side)
{
    for (int i = 0; i < p->n; i++) {
        double size = fabs(p->a[i]), own = slope(p, x, i);
        for (int j = 0; j < p->n; j++)
            size = fmax(size, fabs(p->d[i + j * p->n] * x[j]));
        CHECK(x[i] >= p->lower[i] && x[i] <= p->upper[i]);
        CHECK(fabs(own - y[i]) <= 1e-9 * size);
        CHECK(side[i] != 0 || y[i] == 0);
        CHECK(side[i] <= 0 || x[i] == p->upper[i]);
        CHECK(side[i] >= 0 || x[i] == p->lower[i]);
        CHECK(p->lower[i] == p->upper[i] || side[i] * y[i] <= 1e-9 * size);
    }
}

static void same_as_enumeration(void)
{
    double x[MOST], again[MOST], y[MOST], other[MOST], room[MOST * MOST + 5 * MOST];
    int side[MOST];
    random_seed(7);
    for (int k = 0; k < 600; k++) {
        problem p;
        int n = 1 + pick(5);
        randomise(&p, n, pick(n + 1));
        const kmp_box box = box_of(&p);
        for (int i = 0; i < n; i++) {
            x[i] = 0;
            again[i] = between(-2, 2) * p.upper[i];
        }
        CHECK(kmp_box_minimum(&box, again, other, side, room) == KMP_BOX_FOUND);
        CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
        check_conditions(&p, x, y, side);
        CHECK_NEAR(value(&p, x), least_value(&p), 1e-9);
        for (int i = 0; i < n; i++) /* y does not depend on the guess */
            CHECK(fabs(y[i] - other[i]) <= 1e-8 * (fabs(p.a[i]) + fabs(y[i])));
    }
}

/* Loads on one freedom: levels 1 and 5 hold 4, whatever the guess; 7 is too much. */
static void two_on_one_freedom(void)
{
    const double d[] = {1, 1, 1, 1}, lower[] = {-1, -5}, upper[] = {1, 5};
    double a[] = {4, 4}, x[] = {-2, -2}, y[2], room[14];
    int side[2];
    const kmp_box box = {2, d, a, lower, upper};
    CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
    CHECK_NEAR(x[0] + x[1], -4, 1e-14);
    CHECK(fabs(y[0]) < 1e-14 && fabs(y[1]) < 1e-14);
    a[0] = a[1] = 7;
    CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
    CHECK(x[0] == -1 && x[1] == -5 && side[0] == -1 && side[1] == -1);
    CHECK_NEAR(y[0], 1, 1e-14);
}

/* Contacts: x is not negative. One that opens, one that carries; without support there is no minimum. */
static void infinite_bounds(void)
{
    const double d[] = {2, 0, 0, 1}, lower[] = {0, 0}, upper[] = {INFINITY, INFINITY};
    double a[] = {-3, 4}, x[] = {0, 1}, y[2], room[14];
    int side[2];
    kmp_box box = {2, d, a, lower, upper};
    CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
    CHECK_NEAR(x[0], 1.5, 1e-15);
    CHECK(x[1] == 0 && y[1] == 4);
    const double flat[] = {0, 0, 0, 1};
    box.d = flat;
    CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_UNBOUNDED);
}

/* An entry that D leaves out goes to the bound that its slope demands, and stays where that is zero. */
static void fixed_rates(void)
{
    const double d[] = {0, 0, 0, 0}, lower[] = {-3, -3}, upper[] = {3, 3}, a[] = {-0.5, 0};
    double x[] = {0, 0}, y[2], room[14];
    int side[2];
    const kmp_box box = {2, d, a, lower, upper};
    CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
    CHECK(x[0] == 3 && side[0] == 1 && x[1] == 0 && side[1] == 0);
}

/* A block in a corner, on two supports of the floor and two of the wall, pressed against both. One of the four is
 * redundant, up to errors of D below a neglected pivot. */
static void redundant_up_to_rounding(void)
{
    enum { N = 4 };
    static const double row[N][3] = {{1, 0, 0.057}, {0, 1, 0.109}, {1, 0, -0.057}, {0, 1, -0.109}};
    random_seed(3);
    for (int k = 0; k < 2000; k++) {
        const double error = k % 2 ? 2e-12 : 2e-13, inertia = 0.0059;
        double d[N * N], x[N] = {0}, y[N], room[N * N + 4 * N];
        const double a[] = {-2.7, -9.4, -2.7, -9.4}, lower[N] = {0}, upper[] = {INFINITY, INFINITY, INFINITY, INFINITY};
        int side[N];
        for (int i = 0; i < N; i++)
            for (int j = 0; j <= i; j++)
                d[i + j * N] = d[j + i * N] = row[i][0] * row[j][0] + row[i][1] * row[j][1] +
                                              row[i][2] * row[j][2] / inertia + between(-error, error);
        const kmp_box box = {N, d, a, lower, upper};
        CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
        CHECK_NEAR(x[0] + x[2], 2.7, 1e-9);
        CHECK_NEAR(x[1] + x[3], 9.4, 1e-9);
    }
}

/* Contacts of a block on many supports: the entries of D repeat, so that steps of length zero occur. */
static void many_supports(void)
{
    enum { N = 24 };
    static double d[N * N], a[N], lower[N], upper[N], x[N], y[N], room[N * N + 5 * N];
    int side[N];
    for (int i = 0; i < N; i++) {
        a[i] = -9.81;
        upper[i] = INFINITY;
        for (int j = 0; j < N; j++)
            d[i + j * N] = 1 + 3.0 * (i - 11.5) * (j - 11.5) / (11.5 * 11.5);
    }
    const kmp_box box = {N, d, a, lower, upper};
    CHECK(kmp_box_minimum(&box, x, y, side, room) == KMP_BOX_FOUND);
    double sum = 0, moment = 0;
    for (int i = 0; i < N; i++) {
        sum += x[i];
        moment += x[i] * (i - 11.5);
        CHECK(x[i] >= 0 && fabs(y[i]) < 1e-10);
    }
    CHECK_NEAR(sum, 9.81, 1e-12);
    CHECK(fabs(moment) < 1e-10);
}

int main(void)
{
    TEST(same_as_enumeration);
    TEST(two_on_one_freedom);
    TEST(infinite_bounds);
    TEST(fixed_rates);
    TEST(redundant_up_to_rounding);
    TEST(many_supports);
    return check_report();
}
