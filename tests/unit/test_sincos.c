/* SPDX-License-Identifier: BSD-3-Clause */
/* Sine and cosine: accuracy against the wider long double of x87 (where there is one), identity of the forms
 * to the last bit, and the corners of the double range. */
#include "backend/sincos.h"
#include "testing.h"

#include <float.h>
#include <kempe/runtime.h>
#include <stdint.h>

static uint64_t seed = 1;

/* Knuth's MMIX generator; uniform in [0, 1). */
static double uniform(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) * 0x1p-53;
}

static int same(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

/* pi/2 beyond long double: libm's argument is reduced exactly, so sinl of a double is right to 64 bits. */
static double ulps(double value, long double exact)
{
    int e;
    (void)frexp((double)exact, &e);
    double ulp = ldexp(1.0, e - DBL_MANT_DIG < -1074 ? -1074 : e - DBL_MANT_DIG);
    return (double)(fabsl((long double)value - exact) / (long double)ulp);
}

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
    if (LDBL_MANT_DIG < 64)
        return;
    accuracy_over(0, 0.8, 300000);
    accuracy_over(0, 7, 300000);
    accuracy_over(0, 1000, 200000);
    accuracy_over(9e4, 1.1e5, 200000);
    accuracy_over(1e5, 1e15, 10000);
}

static void test_accuracy_near_quadrants(void)
{
    if (LDBL_MANT_DIG < 64)
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
        if (LDBL_MANT_DIG >= 64)
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
    kempe_sincos(1e300, &s, &c);
    CHECK(same(s, sin(1e300)) && same(c, cos(1e300)));
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

/* Lanes have an arithmetic of their own. */
static void measure_lanes(const double *x)
{
    static const uint32_t from = 0, to = 1, beside = 2;
    double v[48];
    memcpy(v, x, 16 * sizeof *x);
    kmp_sincos_lanes(true, 1, 16, v, &from, &to, &beside);
    for (int l = 0; l < 16; l++)
        worst =
            check_max(worst, fmax(ulps(v[16 + l], sinl((long double)x[l])), ulps(v[32 + l], cosl((long double)x[l]))));
}

static void lanes_over(double low, double high, int points)
{
    worst = 0;
    for (int i = 0; i < points; i++) {
        double x[16];
        for (int l = 0; l < 16; l++)
            x[l] = (l % 2 ? -1 : 1) * (low + (high - low) * uniform());
        measure_lanes(x);
    }
    printf("  lanes over [%g, %g]: %.3f ulp\n", low, high, worst);
    CHECK(worst > 0.5 && worst < 1.5);
}

static void test_accuracy_of_lanes(void)
{
    if (LDBL_MANT_DIG < 64)
        return;
    lanes_over(0, 0.8, 20000);
    lanes_over(0, 7, 20000);
    lanes_over(0, 1000, 10000);
    lanes_over(9e4, 1.1e5, 10000);
    worst = 0;
    for (int k = 0; k <= 63000; k++) {
        double at = (double)((long double)k * 1.57079632679489661923132169163975144L / 2.0L);
        const double x[16] = {at,
                              -at,
                              nextafter(at, -1),
                              nextafter(at, 1e9),
                              -nextafter(at, 1e9),
                              at + 1e-9 * uniform(),
                              at - 1e-9 * uniform(),
                              0.5 * at,
                              at + 1e-5 * uniform(),
                              at - 1e-3 * uniform(),
                              0x1.6c6cbc45dc8dep+5,
                              -0x1.6c6cbc45dc8dep+5,
                              ldexp(uniform(), -k % 1000),
                              -ldexp(uniform(), -k % 1000),
                              1e9 * uniform(),
                              1e-9 * uniform()};
        measure_lanes(x);
    }
    printf("  lanes near multiples of pi/4: %.3f ulp\n", worst);
    CHECK(worst < 1.5);
}

/* Each width, and single values among those beyond the limit. */
static void test_lanes_of_any_width(void)
{
    static const double odd[] = {0.0, -0.0, INFINITY, -INFINITY, NAN, 5e-324, 1e300, -1e5, 1e5, 1e5 + 1, M_PI_2};
    static const uint32_t from[] = {1, 5}, to[] = {0, 3}, beside[] = {4, 2};
    int differ = 0;
    for (int trial = 0; trial < 400; trial++)
        for (int width = 1; width <= 16; width++) {
            double v[6 * 16], single[6];
            for (int k = 0; k < 6 * width; k++)
                v[k] = trial % 3 == 0 && uniform() < 0.3 ? odd[(int)(uniform() * 11)] : 20 * (uniform() - 0.5);
            bool fused = trial % 2;
            kmp_sincos_lanes(fused, 2, width, v, from, to, beside);
            for (int l = 0; l < width; l++) {
                for (int k = 0; k < 6; k++)
                    single[k] = v[k * width + l];
                kmp_sincos_lanes(fused, 2, 1, single, from, to, beside);
                for (int k = 0; k < 6; k++)
                    differ += !same(single[k], v[k * width + l]);
                for (int k = 0; k < 2 && !fused; k++) {
                    kempe_sincos(single[from[k]], &single[to[k]], &single[beside[k]]);
                    differ += !same(single[to[k]], v[(int)to[k] * width + l]) ||
                              !same(single[beside[k]], v[(int)beside[k] * width + l]);
                }
            }
        }
    CHECK(differ == 0);
    for (int k = 0; k < 11; k++) {
        double v[] = {odd[k], 7, 7}, s = sin(odd[k]), c = cos(odd[k]);
        kmp_sincos_lanes(true, 1, 1, v, (const uint32_t[]){0}, (const uint32_t[]){1}, (const uint32_t[]){2});
        CHECK(fabs(odd[k]) <= 1e5 ? fabs(v[1] - s) <= 1e-15 && fabs(v[2] - c) <= 1e-15
                                  : same(v[1], s) && same(v[2], c));
    }
}

/* Two angles of each lane by rotation, at a distance from a base that has them fused. */
static void turn(int width, double (*base_at)[16], double (*at)[16], double *v)
{
    static const uint32_t from[] = {0, 3}, to[] = {1, 4}, beside[] = {2, 5};
    int64_t some[16] = {0}, others[16];
    double base[6 * 16] = {0};
    for (int l = 0; l < 16; l++)
        others[l] = !(some[l] = l % 3 == 0);
    for (int pass = 0; pass < 2; pass++) {
        for (int l = 0; l < width; l++) {
            v[l] = base_at[0][l];
            v[3 * width + l] = base_at[1][l];
        }
        kmp_sincos_lanes(true, 2, width, v, from, to, beside);
        kmp_sincos_keep(2, width, v, from, to, beside, pass > 0 ? others : some, base);
    }
    for (int l = 0; l < width; l++) {
        v[l] = at[0][l];
        v[3 * width + l] = at[1][l];
    }
    kmp_sincos_near(2, width, v, from, to, beside, base);
}

/* Errors are below 3 units of 2^-53, near zeros too. Lanes that are far away have the bits of fused ones; the bits of a
 * lane do not depend on its neighbours. */
static void test_rotation(void)
{
    int differ = 0;
    worst = 0;
    for (int trial = 0; trial < 20000; trial++) {
        int width = trial % 3 == 0 ? 16 : trial % 3 == 1 ? 8 : 1 + trial % 7;
        double base[2][16], at[2][16], v[6 * 16], alone[6], most = trial % 5 == 0 ? 1 : 0.7 * KMP_SINCOS_NEAR;
        for (int l = 0; l < width; l++)
            for (int k = 0; k < 2; k++) {
                base[k][l] = 50 * (uniform() - 0.5);
                at[k][l] = base[k][l] + most * (2 * uniform() - 1);
            }
        if (trial % 11 == 0)
            at[0][0] = trial % 2 ? NAN : trial % 4 ? INFINITY : 1e300;
        turn(width, base, at, v);
        for (int l = 0; l < width; l++) {
            double base_alone[2][16] = {{base[0][l]}, {base[1][l]}}, at_alone[2][16] = {{at[0][l]}, {at[1][l]}};
            turn(1, base_alone, at_alone, alone);
            for (int k = 0; k < 6; k++)
                differ += !same(alone[k], v[k * width + l]);
            bool near = hypot(at[0][l] - base[0][l], at[1][l] - base[1][l]) <= KMP_SINCOS_NEAR;
            for (int k = 0; k < 2; k++) {
                double x = at[k][l], s = v[(3 * k + 1) * width + l], c = v[(3 * k + 2) * width + l];
                double fused[3] = {x};
                kmp_sincos_lanes(true, 1, 1, fused, &(uint32_t){0}, &(uint32_t){1}, &(uint32_t){2});
                if (near && LDBL_MANT_DIG >= 64)
                    worst = check_max(worst, 0x1p53 * (double)fmaxl(fabsl(s - sinl((long double)x)),
                                                                    fabsl(c - cosl((long double)x))));
                else if (!near)
                    differ += !same(s, fused[1]) || !same(c, fused[2]);
            }
        }
    }
    printf("  rotation: %.3f units of 2^-53\n", worst);
    CHECK(differ == 0);
    CHECK(worst < 3 && (worst > 0.5 || LDBL_MANT_DIG < 64));
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
    TEST(test_accuracy_of_lanes);
    TEST(test_rotation);
    TEST(test_lanes_of_any_width);
    return check_report();
}
