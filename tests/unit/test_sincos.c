/* SPDX-License-Identifier: BSD-3-Clause */
/* Sine and cosine: accuracy against the wider long double of x87 (where there is one), identity of the forms
 * to the last bit, and the corners of the double range. */
#include "backend/sincos.h"
#include "sine_errors.h"
#include <kempe/runtime.h>

static double worst;

static void measure(double x)
{
    double s, c;
    kempe_sincos(x, &s, &c);
    worst = check_max(worst, fmax(ulps(s, sinl((long double)x)), ulps(c, cosl((long double)x))));
}

static void accuracy_over(double low, double high, int points)
{
    worst = 0;
    for (int i = 0; i < points; i++) {
        double x = low + (high - low) * uniform();
        measure(i % 2 ? -x : x);
    }
    printf("  [%g, %g]: %.3f ulp\n", low, high, worst);
    CHECK(worst < 1.0);
}

static void test_accuracy(void)
{
    if (!has_exact_sines())
        return;
    accuracy_over(0, 0.8, 300000);
    accuracy_over(0, 7, 300000);
    accuracy_over(0, 1000, 200000);
    accuracy_over(9e4, 1.1e5, 200000);
    accuracy_over(1e5, 1e15, 10000);
}

static void test_accuracy_near_quadrants(void)
{
    if (!has_exact_sines())
        return;
    worst = 0;
    for (int k = 1; k <= 63000; k++) {
        double x = (double)((long double)k * 1.57079632679489661923132169163975144L / 2.0L);
        measure(x);
        measure(nextafter(x, 0));
        measure(nextafter(x, 1e9));
        measure(x + 1e-9 * uniform());
    }
    measure(0x1.6c6cbc45dc8dep+5); /* 29 pi/2 to 2^-60, the nearest a double comes in this range */
    printf("  near multiples of pi/4: %.3f ulp\n", worst);
    CHECK(worst < 1.0);
}

static void test_tiny(void)
{
    for (double x = 1.0; x > 0; x *= 0.37) {
        double s, c;
        kempe_sincos(-x, &s, &c);
        CHECK(s < 0 && s >= -x && c > 0 && c <= 1);
        if (x < 1e-8)
            CHECK(s == -x && c == 1);
        if (has_exact_sines())
            CHECK(ulps(s, sinl((long double)-x)) < 1.0);
    }
}

static void test_corners(void)
{
    double s, c;
    kempe_sincos(0.0, &s, &c);
    CHECK(same(s, 0.0) && c == 1);
    kempe_sincos(-0.0, &s, &c);
    CHECK(same(s, -0.0) && c == 1);
    kempe_sincos(INFINITY, &s, &c);
    CHECK(isnan(s) && isnan(c));
    kempe_sincos(NAN, &s, &c);
    CHECK(isnan(s) && isnan(c));
    const volatile double far = 1e300; /* the C library's, not the compiler's */
    kempe_sincos(far, &s, &c);
    CHECK(same(s, sin(far)) && same(c, cos(far)));
}

static void test_lanes_are_the_scalar_form(void)
{
    static const double odd[] = {0.0,  -0.0, INFINITY, -INFINITY, NAN,     5e-324, 1e-310,  1e300,
                                 -1e5, 1e5,  1e5 + 1,  -1e17,     DBL_MAX, M_PI_2, -M_PI_4, 0x1.6c6cbc45dc8dep+5};
    int differ = 0;
    for (int i = 0; i < 200000; i++) {
        double x[8], s[8], c[8];
        for (int k = 0; k < 8; k++) {
            double u = uniform();
            x[k] = i % 16 == 0 && u < 0.3 ? odd[(int)(u * 53)] : ldexp(u - 0.5, (int)(40 * uniform()) - 20);
        }
        kempe_sincos8(x, s, c);
        for (int k = 0; k < 8; k++) {
            double ss, cc;
            kempe_sincos(x[k], &ss, &cc);
            differ += !same(s[k], ss) || !same(c[k], cc);
        }
    }
    CHECK(differ == 0);
}

/* Arguments at which the quadrant changes, and at which the scalar form stops to reduce: the neighbours of multiples of
 * pi/4. */
static void test_lanes_are_the_scalar_form_near_quadrants(void)
{
    int differ = 0;
    for (int k = 0; k <= 20000; k++) {
        double at = (double)((long double)k * 3.14159265358979323846L / 4.0L), s[8], c[8];
        double x[8] = {at,        -at,       nextafter(at, -1), nextafter(at, 1e9), -nextafter(at, 1e9),
                       at + 1e-9, at - 1e-9, 0.5 * at};
        kempe_sincos8(x, s, c);
        for (int j = 0; j < 8; j++) {
            double ss, cc;
            kempe_sincos(x[j], &ss, &cc);
            differ += !same(s[j], ss) || !same(c[j], cc);
        }
    }
    CHECK(differ == 0);
}

/* Arguments from anywhere among other values, results by eights, nothing beyond them. */
static void test_slots_are_the_scalar_form(void)
{
    enum { MOST = 24, OUT = 64, END = OUT + 2 * MOST };
    int differ = 0, beyond = 0;
    for (uint32_t n = 1; n <= MOST; n++)
        for (int trial = 0; trial < 50; trial++) {
            double v[END + 1];
            uint32_t angle[MOST], room = 2 * ((n + 7) / 8 * 8);
            for (int k = 0; k <= END; k++)
                v[k] = trial == 7 && k % 5 == 0 ? 1e9 * uniform() : 20 * (uniform() - 0.5);
            for (uint32_t k = 0; k < MOST; k++)
                angle[k] = 5 * k % OUT;
            v[OUT + room] = 7;
            kmp_sincos_slots(n, angle, v, v + OUT);
            for (uint32_t k = 0; k < n; k++) {
                double ss, cc, *at = v + OUT + k / 8 * 16 + k % 8;
                kempe_sincos(v[angle[k]], &ss, &cc);
                differ += !same(at[0], ss) || !same(at[8], cc);
            }
            beyond += v[OUT + room] != 7;
        }
    CHECK(differ == 0);
    CHECK(beyond == 0);
}

static void by_the_scalar_form(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    CHECK(width == 1);
    for (int k = 0; k < n; k++)
        kempe_sincos(v[x[k]], &v[s[k]], &v[c[k]]);
}

/* Each width, and single values among those beyond the limit. */
static void test_lanes_of_any_width(void)
{
    CHECK(count_lanes_apart(kmp_sincos_lanes, by_the_scalar_form) == 0);
}

int main(void)
{
    TEST(test_accuracy);
    TEST(test_accuracy_near_quadrants);
    TEST(test_tiny);
    TEST(test_corners);
    TEST(test_lanes_are_the_scalar_form);
    TEST(test_lanes_are_the_scalar_form_near_quadrants);
    TEST(test_slots_are_the_scalar_form);
    TEST(test_lanes_of_any_width);
    return check_report();
}
