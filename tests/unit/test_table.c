/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables: what they reproduce exactly, their ends, their derivatives, and the same bits from graph and tape. */
#include "backend/machine.h"
#include "base/memory.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "table_points.h"
#include <kempe/runtime.h>
#include <math.h>

enum { KNOTS = 9 };

static double cubic(int derivative, double x)
{
    const double values[5] = {1 + x * (-2 + x * (0.5 + x * 0.25)), -2 + x * (1 + x * 0.75), 1 + 1.5 * x, 1.5, 0};
    return values[derivative];
}

static kmp_table *sampled(kmp_table_method method, int count, double (*f)(int, double))
{
    double x[KNOTS], y[KNOTS];
    for (int k = 0; k < count; k++) {
        x[k] = -1 + 0.3 * k + 0.05 * (k % 3);
        y[k] = f(0, x[k]);
    }
    return kmp_table_new(method, count, x, y);
}

static void test_check(void)
{
    const double x[] = {0, 1, 1, 2}, y[] = {0, NAN, 3, 4}, rising[] = {0, 1, 2, 3};
    CHECK(kmp_table_check(4, x, rising) == 2 && kmp_table_check(4, rising, y) == 1);
    CHECK(kmp_table_check(1, x, y) == 1 && kmp_table_check(4, rising, x) == -1);
}

/* Not-a-knot: a cubic is met everywhere, with all derivatives. */
static void test_cubic(void)
{
    kmp_table *t = sampled(KMP_TABLE_CUBIC, KNOTS, cubic);
    for (int derivative = 0; derivative <= 4; derivative++)
        for (double x = -1; x < 1.4; x += 0.043)
            CHECK_NEAR(kmp_table_value(t, derivative, x), cubic(derivative, x), derivative < 2 ? 1e-13 : 1e-11);
    CHECK(isnan(kmp_table_value(t, 0, NAN)));
    kmp_table_free(t);
}

static double parabola(int derivative, double x)
{
    return derivative == 0 ? x * x - x : 2 * x - 1;
}

static void test_few_points(void)
{
    kmp_table *three = sampled(KMP_TABLE_CUBIC, 3, parabola), *two = sampled(KMP_TABLE_CUBIC, 2, parabola);
    for (double x = -1; x <= -0.3; x += 0.05) {
        CHECK_NEAR(kmp_table_value(three, 0, x), parabola(0, x), 1e-14);
        CHECK_NEAR(kmp_table_value(three, 1, x), parabola(1, x), 1e-13);
        CHECK_NEAR(kmp_table_value(two, 1, x), kmp_table_value(two, 1, -1), 1e-15);
    }
    kmp_table_free(three);
    kmp_table_free(two);
}

static void test_linear(void)
{
    const double x[] = {0, 1, 3}, y[] = {2, 4, 0};
    kmp_table *t = kmp_table_new(KMP_TABLE_LINEAR, 3, x, y);
    CHECK_NEAR(kmp_table_value(t, 0, 0.5), 3, 0);
    CHECK_NEAR(kmp_table_value(t, 0, 1), 4, 0);
    CHECK_NEAR(kmp_table_value(t, 1, 1), -2, 0); /* the piece on the right */
    CHECK_NEAR(kmp_table_value(t, 0, 2), 2, 0);
    CHECK_NEAR(kmp_table_value(t, 2, 2), 0, 0);
    CHECK_NEAR(kmp_table_value(t, 0, -1), 0, 0);
    CHECK_NEAR(kmp_table_value(t, 0, 4), -2, 0);
    kmp_table_free(t);
}

/* Value and slope go on beyond the ends. */
/* PCHIP of SciPy; a straight line keeps its slope. */
static void test_monotone(void)
{
    static const double x[] = {0, 1, 2, 3, 5, 6}, y[] = {0, 0, 1, 4, 4.5, 4.5};
    static const double at[] = {.5, 1.5, 2.5, 4, 5.5};
    static const double wanted[] = {0, 0.3125, 2.62382075471698, 4.37735849056604, 4.5};
    kmp_table *t = kmp_table_new(KMP_TABLE_MONOTONE, 6, x, y), *line = kmp_table_new(KMP_TABLE_MONOTONE, 2, x, y + 1);
    CHECK(t && line);
    for (int k = 0; k < 5; k++)
        CHECK_NEAR(kmp_table_value(t, 0, at[k]), wanted[k], 1e-14);
    CHECK_NEAR(kmp_table_value(line, 0, 0.3), 0.3, 1e-15);
    kmp_table_free(t);
    kmp_table_free(line);
}

/* Digits of a periodic spline with mpmath: 10 + 6 cos + 1.5 cos 2 + 0.5 sin 3 at twelve places; two derivatives are
 * continuous where it closes. */
static void test_periodic(void)
{
    enum { N = 13 };
    double x[N], y[N];
    const double turn = 2 * acos(-1);
    for (int k = 0; k < N; k++) {
        x[k] = turn * k / (N - 1);
        y[k] = 10 + 6 * cos(x[k]) + 1.5 * cos(2 * x[k]) + 0.5 * sin(3 * x[k]);
    }
    y[N - 1] = y[0];
    kmp_table *t = kmp_table_new(KMP_TABLE_PERIODIC, N, x, y);
    CHECK(t);
    CHECK_NEAR(kmp_table_value(t, 0, 0.1), 17.5792850529522, 1e-12);
    CHECK_NEAR(kmp_table_value(t, 1, 0.1), 0.148957942121963, 1e-12);
    CHECK_NEAR(kmp_table_value(t, 0, -40 + 7 * turn), 5.55276883716922, 1e-12);
    CHECK_NEAR(kmp_table_value(t, 0, 100.25 - 15 * turn), 16.6637265959689, 1e-12);
    for (int d = 0; d < 3; d++)
        CHECK_NEAR(kmp_table_value(t, d, 0), kmp_table_value(t, d, x[N - 1]), 1e-12);
    kmp_table_free(t);
}

static void test_ends(void)
{
    kmp_table *t = sampled(KMP_TABLE_CUBIC, KNOTS, cubic);
    const double ends[2] = {t->x[0], t->x[KNOTS - 1]}, out[2] = {-1, 1};
    for (int k = 0; k < 2; k++) {
        double beyond = ends[k] + out[k] * 2;
        CHECK_NEAR(kmp_table_value(t, 0, beyond), cubic(0, ends[k]) + out[k] * 2 * cubic(1, ends[k]), 1e-12);
        CHECK_NEAR(kmp_table_value(t, 1, beyond), cubic(1, ends[k]), 1e-12);
        CHECK_NEAR(kmp_table_value(t, 2, beyond), 0, 0);
        CHECK_NEAR(kmp_table_value(t, 0, ends[k] + out[k] * 1e-14), cubic(0, ends[k]), 1e-12);
    }
    kmp_table_free(t);
}

static void test_sine(void)
{
    enum { MANY = 101 };
    double x[MANY], y[MANY];
    for (int k = 0; k < MANY; k++) {
        x[k] = 0.06 * k;
        y[k] = sin(x[k]);
    }
    kmp_table *t = kmp_table_new(KMP_TABLE_CUBIC, MANY, x, y);
    for (double at = 0; at < 6; at += 0.01) {
        CHECK_NEAR(kmp_table_value(t, 0, at), sin(at), 1e-6);
        CHECK_NEAR(kmp_table_value(t, 1, at), cos(at), 1e-4);
    }
    kmp_table_free(t);
}

/* No value or derivative between two places, beyond the ends or not, lies outside; a straight line's are its ends. */
static void test_bounds(void)
{
    kmp_table *t[2] = {sampled(KMP_TABLE_CUBIC, KNOTS, cubic), sampled(KMP_TABLE_LINEAR, KNOTS, cubic)};
    for (int i = 0; i < 2000; i++) {
        double from = between(-2, 2), to = from + between(0, i % 2 ? 0.2 : 2), low, high;
        int derivative = i % 4;
        for (int m = 0; m < 2; m++) {
            kmp_table_bounds(t[m], derivative, from, to, &low, &high);
            for (int k = 0; k <= 50; k++) {
                double y = kmp_table_value(t[m], derivative, from + (to - from) * k / 50);
                CHECK(y >= low - 1e-12 && y <= high + 1e-12);
            }
        }
        CHECK(high - low <= fabs(to - from) * 40 || derivative > 0);
    }
    kmp_table_free(t[0]);
    kmp_table_free(t[1]);
}

/* The piece is that of a search among all knots, to the bit; also from any other piece on. */
static void check_pieces(const kmp_table *t)
{
    double x[TABLE_POINTS];
    table_points(t, x);
    for (int derivative = 0; derivative <= 4; derivative++)
        for (int k = 0; k < TABLE_POINTS; k++) {
            double at = kmp_table_value(t, derivative, x[k]);
            int tried = pick(3) ? pick(t->count) : k - 200;
            double near = kmp_table_value_near(t, derivative, x[k], &tried);
            double searched = kempe_interpolate(t->count, t->x, t->y, (const double(*)[4])t->piece, derivative, x[k]);
            CHECK(memcmp(&at, &searched, sizeof at) == 0 || (isnan(at) && isnan(searched)));
            CHECK(memcmp(&near, &at, sizeof at) == 0 || (isnan(at) && isnan(near)));
        }
}

static void test_pieces(void)
{
    with_tables(check_pieces);
}

/* -- in graph and program ---------------------------------------------------------------------------- */

static void test_graph_tables(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_table *t = sampled(KMP_TABLE_CUBIC, KNOTS, cubic), *line = sampled(KMP_TABLE_LINEAR, KNOTS, cubic);
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0);
    CHECK(kmp_graph_add_table(g, t) == 0 && kmp_graph_add_table(g, line) == 1 && kmp_graph_add_table(g, t) == 0);
    CHECK(kmp_graph_table(g, 2) == NULL && kmp_graph_table(g, -1) == NULL && kmp_table_equal(kmp_graph_table(g, 0), t));
    kmp_ref f = kmp_table_at(g, 0, x), l = kmp_table_at(g, 1, x);
    CHECK(kmp_table_at(g, 0, x) == f && l != f);
    CHECK(kmp_table_at(g, 0, KMP_ZERO) == kmp_const(g, kmp_table_value(t, 0, 0)));
    CHECK(kmp_table_derivative_at(g, 1, 2, x) == KMP_ZERO && kmp_table_derivative_at(g, 0, 3, x) != KMP_ZERO);
    kmp_table_free(t);
    kmp_table_free(line);
    kmp_graph_free(g);
}

static void test_program_tables(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_table *t = sampled(KMP_TABLE_CUBIC, KNOTS, cubic), *line = sampled(KMP_TABLE_LINEAR, KNOTS, cubic);
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), one = KMP_ONE, out[4];
    (void)kmp_graph_add_table(g, t); /* not used by the program */
    int used = kmp_graph_add_table(g, line);
    kmp_derivative *d = kmp_derivative_new(g, 1, &x, &one);
    out[0] = kmp_table_at(g, used, kmp_neg(kmp_mul(g, x, x)));
    out[1] = kmp_derivative_of(d, out[0]);
    out[2] = kmp_table_at(g, 0, kmp_neg(x));
    out[3] = kmp_derivative_of(d, kmp_derivative_of(d, out[2]));
    const kmp_ref *group = out;
    kmp_program *p = kmp_program_new(g, 1, &(int){4}, &group);
    double *value = KMP_NEW(double, kmp_graph_count(g)), q = 0;
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    CHECK(p->table_count == 2);
    random_seed(3);
    for (int k = 0; k < 200; k++) {
        q = between(-1.5, 1.5);
        kmp_machine_set(machine, KMP_IN_Q, &q);
        kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = &q}, value);
        const double *got = kmp_machine_run(machine, 1);
        for (int i = 0; i < 4; i++) {
            double expected = out[i] & 1 ? -value[out[i] >> 1] : value[out[i] >> 1];
            CHECK(memcmp(&got[i], &expected, sizeof expected) == 0);
        }
        CHECK_NEAR(got[0], kmp_table_value(line, 0, -q * q), 0);
        CHECK_NEAR(got[1], -2 * q * kmp_table_value(line, 1, -q * q), 1e-15);
        CHECK_NEAR(got[3], kmp_table_value(t, 2, -q), 1e-15);
    }
    kmp_free(value);
    kmp_machine_free(machine);
    kmp_program_free(p);
    kmp_derivative_free(d);
    kmp_table_free(t);
    kmp_table_free(line);
    kmp_graph_free(g);
}

int main(void)
{
    TEST(test_check);
    TEST(test_cubic);
    TEST(test_few_points);
    TEST(test_linear);
    TEST(test_monotone);
    TEST(test_periodic);
    TEST(test_ends);
    TEST(test_sine);
    TEST(test_bounds);
    TEST(test_pieces);
    TEST(test_graph_tables);
    TEST(test_program_tables);
    return check_report();
}
