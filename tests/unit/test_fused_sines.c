/* SPDX-License-Identifier: BSD-3-Clause */
/* Fused sines and cosines of lanes, and those by rotation, against the wider long double of x87 (where there is one);
 * the bits of a lane beside others and alone. */
#include "ensemble/lanes/fused_sines.h"
#include "sine_errors.h"

static double worst;

/* Lanes have an arithmetic of their own. */
static void measure_lanes(const double *x)
{
    static const uint32_t from = 0, to = 1, beside = 2;
    double v[48];
    memcpy(v, x, 16 * sizeof *x);
    kmp_fused_sincos(1, 16, v, &from, &to, &beside);
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
    if (!has_exact_sines())
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
    const double *odd = odd_arguments;
    CHECK(count_lanes_apart(kmp_fused_sincos, kmp_fused_sincos) == 0);
    for (int k = 0; k < ODD_ARGUMENTS; k++) {
        double v[] = {odd[k], 7, 7}, s = sin(odd[k]), c = cos(odd[k]);
        kmp_fused_sincos(1, 1, v, (const uint32_t[]){0}, (const uint32_t[]){1}, (const uint32_t[]){2});
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
        kmp_fused_sincos(2, width, v, from, to, beside);
        kmp_fused_keep(2, width, v, from, to, beside, pass > 0 ? others : some, base);
    }
    for (int l = 0; l < width; l++) {
        v[l] = at[0][l];
        v[3 * width + l] = at[1][l];
    }
    kmp_fused_near(2, width, v, from, to, beside, base);
}

/* Errors are below 3 units of 2^-53, near zeros too. Lanes that are far away have the bits of fused ones; the bits of a
 * lane do not depend on its neighbours. */
static void test_rotation(void)
{
    int differ = 0;
    worst = 0;
    for (int trial = 0; trial < 20000; trial++) {
        int width = trial % 3 == 0 ? 16 : trial % 3 == 1 ? 8 : 1 + trial % 7;
        double base[2][16], at[2][16], v[6 * 16], alone[6], most = trial % 5 == 0 ? 1 : 0.7 * KMP_FUSED_NEAR;
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
            bool near = hypot(at[0][l] - base[0][l], at[1][l] - base[1][l]) <= KMP_FUSED_NEAR;
            for (int k = 0; k < 2; k++) {
                double x = at[k][l], s = v[(3 * k + 1) * width + l], c = v[(3 * k + 2) * width + l];
                double fused[3] = {x};
                kmp_fused_sincos(1, 1, fused, &(uint32_t){0}, &(uint32_t){1}, &(uint32_t){2});
                if (near && has_exact_sines())
                    worst = check_max(worst, 0x1p53 * (double)fmaxl(fabsl(s - sinl((long double)x)),
                                                                    fabsl(c - cosl((long double)x))));
                else if (!near)
                    differ += !same(s, fused[1]) || !same(c, fused[2]);
            }
        }
    }
    printf("  rotation: %.3f units of 2^-53\n", worst);
    CHECK(differ == 0);
    CHECK(worst < 3 && (worst > 0.5 || !has_exact_sines()));
}

int main(void)
{
    TEST(test_accuracy_of_lanes);
    TEST(test_rotation);
    TEST(test_lanes_of_any_width);
    return check_report();
}
