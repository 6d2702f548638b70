/* SPDX-License-Identifier: BSD-3-Clause */
/* Polynomials through Chebyshev's points: exact for polynomials of degree 8; integral, extremes and zeros of functions
 * whose own are known; a kink that is found to be none. */
#include "output/quantities/smooth_piece.h"
#include "testing.h"

static const double PI = 3.14159265358979323846;

static kmp_smooth_piece piece_of(double (*f)(double), double from, double to)
{
    double values[KMP_PIECE_POINTS];
    for (int k = 0; k < KMP_PIECE_POINTS; k++)
        values[k] = f(from + 0.5 * (1 + kmp_piece_point(k)) * (to - from));
    return kmp_piece_of(from, to, values);
}

static double eighth(double t)
{
    return 3 + t * (2 - t * t * (1 + t * t * t * t * t / 7));
}

static double shorter(double t)
{
    return 0.3 * exp(-t);
}

static double kink(double t)
{
    return fabs(t - 0.3);
}

static double even(double t)
{
    return 1 - t * t;
}

static void test_exact(void)
{
    const kmp_smooth_piece p = piece_of(eighth, -1, 2);
    for (int k = 0; k <= 30; k++) {
        double x = -1 + k / 15.0;
        CHECK_NEAR(kmp_piece_value(&p, x), eighth(kmp_piece_time(&p, x)), 4e-15 * 40); /* 40: the largest value */
    }
    /* of 3 + 2 t - t^3 - t^8/7: 3 t + t^2 - t^4/4 - t^9/63 */
    CHECK_NEAR(kmp_piece_integral(&p), 3 * 3 + (4 - 1) - (16 - 1) / 4.0 - (512 + 1) / 63.0, 4e-15 * 40);
    CHECK(kmp_piece_time(&p, -1) == -1 && kmp_piece_time(&p, 1) == 2);
}

static void test_smooth(void)
{
    const kmp_smooth_piece p = piece_of(shorter, 0, 0.2), bad = piece_of(kink, 0, 1), sine = piece_of(sin, 0, PI / 2);
    CHECK(kmp_piece_error(&p) < 2e-14); /* 2 0.3 (0.1/2)^7 / 7! / 8 */
    CHECK(kmp_piece_error(&bad) > 1e-3);
    CHECK(kmp_piece_error(&sine) < 1e-7 && kmp_piece_error(&sine) > 1e-10);
    CHECK_NEAR(kmp_piece_integral(&sine), 1, 1e-9);
}

static void test_turns(void)
{
    double x[KMP_PIECE_POINTS], low, high;
    const kmp_smooth_piece p = piece_of(cos, 0.5, 4), flat = piece_of(even, -1, 3), up = piece_of(exp, 0, 1);
    CHECK(kmp_piece_turns(&p, x) == 3 && x[0] == -1 && x[2] == 1);
    CHECK_NEAR(kmp_piece_time(&p, x[1]), PI, 1e-4);
    CHECK_NEAR(kmp_piece_value(&p, x[1]), -1, 4e-6); /* twice the next term, 2 J_9(1.75) */
    CHECK(kmp_piece_turns(&flat, x) == 3);
    CHECK_NEAR(kmp_piece_time(&flat, x[1]), 0, 1e-14);
    CHECK(kmp_piece_turns(&up, x) == 2);
    kmp_piece_extremes(&p, &low, &high);
    CHECK(low <= -1 && high >= cos(0.5) && high < 3);
}

static double wave(double t)
{
    return sin(7 * t) + 0.2 * cos(16 * t);
}

static double corner(double t)
{
    return fmax(t - 0.9, 3 * (0.2 - t));
}

/* No value of a function passes the rough bounds of its pieces, which come near to smooth functions. */
static void test_rough_bounds(void)
{
    double (*const functions[])(double) = {sin, exp, kink, even, wave, corner, shorter};
    double values[KMP_PIECE_POINTS], low, high;
    for (size_t f = 0; f < sizeof functions / sizeof *functions; f++)
        for (int piece = 0; piece < 200; piece++) {
            double from = -1 + 0.011 * piece, to = from + 0.002 * (1 + piece % 90);
            for (int k = 0; k < KMP_PIECE_POINTS; k++) /* the points between are not read */
                values[k] = k % 2 ? NAN : functions[f](from + 0.5 * (1 + kmp_piece_point(k)) * (to - from));
            kmp_piece_rough_bounds(values, &low, &high);
            for (int k = 0; k <= 100; k++) {
                double x = functions[f](from + k * (to - from) / 100);
                CHECK(x >= low - 1e-15 && x <= high + 1e-15);
            }
        }
    for (int k = 0; k < KMP_PIECE_POINTS; k++)
        values[k] = sin(0.05 * (1 + kmp_piece_point(k)));
    kmp_piece_rough_bounds(values, &low, &high);
    CHECK_NEAR(low, 0, 1e-3);
    CHECK_NEAR(high, sin(0.1), 1e-3);
}

static void test_zero(void)
{
    const kmp_smooth_piece p = piece_of(cos, 0.5, 2.5);
    CHECK_NEAR(kmp_piece_time(&p, kmp_piece_zero(&p, -1, 1)), PI / 2, 1e-7);
}

int main(void)
{
    TEST(test_exact);
    TEST(test_smooth);
    TEST(test_turns);
    TEST(test_rough_bounds);
    TEST(test_zero);
    return check_report();
}
