/* SPDX-License-Identifier: BSD-3-Clause */
/* Rolling contact against tables of others, closed forms and limits. */
#include "rail/contact/half_space.h"
#include "testing.h"
#include <kempe/rolling_contact.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

static void check_within(const char *what, double found, double expected, double share)
{
    if (fabs(found - expected) > share * fabs(expected))
        printf("%s: %.6g, expected %.6g within %.2g\n", what, found, expected, share);
    CHECK(fabs(found - expected) <= share * fabs(expected));
}

/* Abramowitz and Stegun, table 17.1 and 17.2: K and E at k^2 = 0, 0.5, 0.9, 0.99. */
static void test_elliptic(void)
{
    const double table[][3] = {{0, 1.570796326794896, 1.570796326794896},
                               {0.5, 1.854074677301372, 1.350643881047675},
                               {0.9, 2.578092113348173, 1.104774732704073},
                               {0.99, 3.695637362989874, 1.015993545025224}};
    for (int k = 0; k < 4; k++) {
        double g = sqrt(1 - table[k][0]), B, D;
        kmp_elliptic(g, &B, &D);
        CHECK_NEAR(B + D, table[k][1], 1e-14);
        CHECK_NEAR(B + g * g * D, table[k][2], 1e-14);
    }
}

static const kempe_touch steel = {.along = 2, .across = 2, .shear_modulus = 82e9, .poisson = 0.28};

/* Two spheres: a^3 = 3 N R / (4 E*), delta = a^2 / R, with 2 / R = the curvature either way, E* = G / (1 - nu). */
static void test_sphere(void)
{
    const double normal = 60e3, modulus = 82e9 / 0.72, radius = 2 / (2.0 + 2.0);
    double a = cbrt(3 * normal * radius / (4 * modulus));
    kempe_ellipse e;
    CHECK(kempe_contact_hertz(&steel, normal, &e) == KEMPE_OK);
    CHECK_NEAR(e.a / a, 1, 1e-14);
    CHECK_NEAR(e.b / a, 1, 1e-14);
    CHECK_NEAR(e.approach / (a * a / radius), 1, 1e-14);
    CHECK_NEAR(e.pressure / (1.5 * normal / (pi * a * a)), 1, 1e-14);
    CHECK_NEAR(e.stiffness / (4 * modulus * sqrt(radius) / 3), 1, 1e-14);
    CHECK(kempe_contact_hertz(&steel, 0, &e) == KEMPE_OK && e.a == 0 && e.approach == 0 && e.pressure == 0);
}

/* Ellipses that CONTACT (github eve70a/CONTACT, r2707) prints to four figures, of half the curvatures: in
 * examples/fastsim.ref_out 0.8464e-3 and 0.2406e-2 1/mm for 8 and 4 mm under 82 kN (approach 0.09267 mm, 1223 MPa), in
 * examples/tractcurv.ref_out 0.8e-3 and 0.2814e-3 for 6.304 and 12.61 mm under 106.7 kN. */
static void test_ellipses(void)
{
    kempe_touch touch = {.along = 2 * 0.8464, .across = 2 * 2.406, .shear_modulus = 82e9, .poisson = 0.28};
    kempe_ellipse e;
    CHECK(kempe_contact_hertz(&touch, 82e3, &e) == KEMPE_OK);
    check_within("a", e.a, 8e-3, 2e-4);
    check_within("b", e.b, 4e-3, 2e-4);
    check_within("approach", e.approach, 0.09267e-3, 2e-4);
    check_within("pressure", e.pressure, 1223e6, 5e-4);
    touch.along = 2 * 0.8, touch.across = 2 * 0.2814;
    CHECK(kempe_contact_hertz(&touch, 106.7e3, &e) == KEMPE_OK);
    check_within("a", e.a, 6.304e-3, 2e-4);
    check_within("b", e.b, 12.61e-3, 5e-4);
}

/* Brewe and Hamrock, J. Lubr. Tech. 99, 1977: the ratio of the axes within 3 % of 1.0339 ratio^0.636. */
static void test_ratio(void)
{
    for (double ratio = 1.5; ratio < 50; ratio *= 1.7) {
        double axes = exp(-kmp_hertz_of(log(ratio)).ratio);
        check_within("Brewe and Hamrock", axes, 1.0339 * pow(ratio, 0.636), 0.03);
        CHECK_NEAR(kmp_hertz_of(-log(ratio)).ratio, log(axes), 1e-14);
    }
}

/* A cylinder is the limit of a slender ellipse: pressure and width of the strip, p^2 = N' E* / (pi R), in its middle,
 * where the line force is N' = (3/2) N / (2 b). */
static void test_line(void)
{
    kempe_touch slender = {.along = 2, .across = 2e-9, .shear_modulus = 82e9, .poisson = 0.28};
    kempe_ellipse e;
    CHECK(kempe_contact_hertz(&slender, 1e5, &e) == KEMPE_OK);
    double line = 1.5 * 1e5 / (2 * e.b), pressure = sqrt(line * 82e9 / 0.72 * 2 / pi);
    CHECK_NEAR(e.pressure / pressure, 1, 1e-6);
}

/* The power law, and dimensions: nothing but the two curvatures, G and nu counts. */
static void test_stiffness(void)
{
    for (int k = -40; k <= 40; k += 3) {
        kempe_touch touch = {.along = exp(0.3 * k), .across = 1.7, .shear_modulus = 8e10, .poisson = 0.3};
        kempe_ellipse small, large;
        CHECK(kempe_contact_hertz(&touch, 3, &small) == KEMPE_OK &&
              kempe_contact_hertz(&touch, 3e5, &large) == KEMPE_OK);
        CHECK_NEAR(small.stiffness * pow(small.approach, 1.5), 3, 1e-13);
        CHECK_NEAR(large.stiffness * pow(large.approach, 1.5) / 3e5, 1, 1e-13);
        CHECK_NEAR(large.a / small.a, cbrt(1e5), 1e-13);
    }
}

/* Bad numbers are refused, and the outputs stay. */
static void test_refused(void)
{
    kempe_ellipse e = {.a = 7};
    kempe_touch touch = steel;
    touch.across = 0;
    CHECK(kempe_contact_hertz(&touch, 1, &e) == KEMPE_E_ARGUMENT &&
          kempe_contact_hertz(&steel, -1, &e) == KEMPE_E_ARGUMENT);
    CHECK(kempe_contact_hertz(&steel, NAN, &e) == KEMPE_E_ARGUMENT && e.a == 7);
    kempe_kalker k = {.c11 = 7};
    CHECK(kempe_contact_kalker(0, 0.3, &k) == KEMPE_E_ARGUMENT &&
          kempe_contact_kalker(1, 0.51, &k) == KEMPE_E_ARGUMENT);
    CHECK(kempe_contact_kalker(NAN, 0.3, &k) == KEMPE_E_ARGUMENT && k.c11 == 7);
    kempe_creep creep = {.a = 1, .b = 1, .shear_modulus = 1, .normal = 1};
    kempe_creep_force f = {.moment = 7};
    CHECK(kempe_contact_creep((kempe_creep_law)17, &creep, &f) == KEMPE_E_ARGUMENT);
    CHECK(kempe_contact_law_name((kempe_creep_law)17) == NULL);
    creep.friction = -1;
    CHECK(kempe_contact_creep(KEMPE_CREEP_LINEAR, &creep, &f) == KEMPE_E_ARGUMENT);
    creep.friction = 0;
    creep.spin = INFINITY;
    CHECK(kempe_contact_creep(KEMPE_CREEP_LINEAR, &creep, &f) == KEMPE_E_ARGUMENT && f.moment == 7);
    double flexibility[3] = {1, 0, 1};
    creep.spin = 0;
    CHECK(kempe_contact_fastsim(&creep, flexibility, &f) == KEMPE_E_ARGUMENT && f.moment == 7);
}

/* -- Kalker's coefficients ------------------------------------------------------------------------- */

/* Rows of the table are met. */
static void test_kalker_rows(void)
{
    kempe_kalker k;
    CHECK(kempe_contact_kalker(0.3, 0.25, &k) == KEMPE_OK);
    CHECK_NEAR(k.c11, 3.44, 1e-13);
    CHECK_NEAR(k.c22, 2.75, 1e-13);
    CHECK_NEAR(k.c23, 0.715, 1e-13);
    CHECK_NEAR(k.c33, 2.96, 1e-13);
    CHECK(kempe_contact_kalker(5, 0.5, &k) == KEMPE_OK);
    CHECK_NEAR(k.c11, 8.82, 1e-13);
    CHECK_NEAR(k.c22, 9.79, 1e-13);
    CHECK_NEAR(k.c23, 7.89, 1e-13);
    CHECK_NEAR(k.c33, 0.341, 1e-13);
    CHECK(kempe_contact_kalker(1, 0, &k) == KEMPE_OK);
    CHECK_NEAR(k.c11, 3.40, 1e-13);
    CHECK_NEAR(k.c33, 1.21, 1e-13);
}

/* Far beyond the table: Kalker's asymptotes; a strip long across is plane theory, C11 = pi^2 / (4 (1 - nu)). */
static void test_slender(void)
{
    kempe_kalker k;
    for (int i = 0; i <= 2; i++) {
        double nu = 0.25 * i, g = 1e-6;
        CHECK(kempe_contact_kalker(g, nu, &k) == KEMPE_OK);
        check_within("C11", k.c11, pi * pi / 4 / (1 - nu), 2e-3);
        check_within("C22", k.c22, pi * pi / 4, 2e-3);
        CHECK(kempe_contact_kalker(1e3, nu, &k) == KEMPE_OK);
        double l = log(16e6), x = l - 2 * nu;
        check_within("C11", k.c11, 2e3 * pi / x * (1 + (3 - log(4)) / x), 5e-4);
    }
}

/* Nothing jumps between table and asymptotes, where c33 alone turns over a little. */
static void test_smooth(void)
{
    for (int i = 0; i <= 10; i++) {
        kempe_kalker last, k;
        CHECK(kempe_contact_kalker(1e-4, 0.05 * i, &last) == KEMPE_OK);
        for (double ratio = 1.02e-4; ratio < 1e4; ratio *= 1.02, last = k) {
            CHECK(kempe_contact_kalker(ratio, 0.05 * i, &k) == KEMPE_OK);
            CHECK(k.c11 > 0.993 * last.c11 && k.c11 < 1.03 * last.c11);
            CHECK(k.c22 > last.c22 && k.c22 < 1.03 * last.c22);
            CHECK(k.c23 > last.c23 && k.c23 < 1.04 * last.c23);
            CHECK(k.c33 < last.c33 * 1.003 && k.c33 > 0.95 * last.c33);
        }
    }
}

/* -- the laws -------------------------------------------------------------------------------------- */

static const kempe_creep wheel = {
    .a = 6e-3, .b = 4e-3, .shear_modulus = 82e9, .poisson = 0.28, .normal = 80e3, .friction = 0.3};

static kempe_creep_force force_of(kempe_creep_law law, double x, double y, double spin)
{
    kempe_creep creep = wheel;
    kempe_creep_force f = {{NAN, NAN}, NAN, NAN};
    creep.slip[0] = x, creep.slip[1] = y, creep.spin = spin;
    CHECK(kempe_contact_creep(law, &creep, &f) == KEMPE_OK);
    return f;
}

/* The linear law, term by term: at a/b = 1 and nu = 1/4 the table has 4.12, 3.67, 1.47, 1.19. */
static void test_linear(void)
{
    kempe_creep creep = {.a = 2e-3, .b = 2e-3, .shear_modulus = 1e11, .poisson = 0.25, .normal = 1, .slip = {1e-3, 0}};
    kempe_creep_force f;
    CHECK(kempe_contact_creep(KEMPE_CREEP_LINEAR, &creep, &f) == KEMPE_OK);
    CHECK_NEAR(f.force[0], -4.12 * 4e5 * 1e-3, 1e-12);
    CHECK(f.force[1] == 0 && f.moment == 0);
    creep.slip[0] = 0, creep.slip[1] = 1e-3;
    CHECK(kempe_contact_creep(KEMPE_CREEP_LINEAR, &creep, &f) == KEMPE_OK);
    CHECK_NEAR(f.force[1], -3.67 * 4e5 * 1e-3, 1e-12);
    CHECK_NEAR(f.moment, 1.47 * 4e5 * 2e-3 * 1e-3, 1e-12);
    creep.slip[1] = 0, creep.spin = 0.5;
    CHECK(kempe_contact_creep(KEMPE_CREEP_LINEAR, &creep, &f) == KEMPE_OK);
    CHECK_NEAR(f.force[1], -1.47 * 4e5 * 2e-3 * 0.5, 1e-12);
    CHECK_NEAR(f.moment, -1.19 * 4e5 * 4e-6 * 0.5, 1e-12);
    CHECK(f.force[0] == 0);
}

/* Small creep: Kalker's linear theory, spin alone included. Polach's force goes along the creep. */
static void test_small(void)
{
    const double x = 3e-9, y = -5e-9, spin = 4e-7;
    kempe_creep_force linear = force_of(KEMPE_CREEP_LINEAR, x, y, spin),
                      turned = force_of(KEMPE_CREEP_LINEAR, 0, 0, spin);
    kempe_creep_law laws[] = {KEMPE_CREEP_SHEN, KEMPE_CREEP_TANH, KEMPE_CREEP_FASTSIM};
    for (int k = 0; k < 3; k++) {
        kempe_creep_force f = force_of(laws[k], x, y, spin);
        check_within("along", f.force[0], linear.force[0], 2e-3);
        check_within("across", f.force[1], linear.force[1], 2e-3);
        if (laws[k] != KEMPE_CREEP_FASTSIM)
            check_within("moment", f.moment, linear.moment, 1e-5);
    }
    check_within("Polach along", force_of(KEMPE_CREEP_POLACH, x, 0, 0).force[0], linear.force[0], 1e-5);
    check_within("Polach across", force_of(KEMPE_CREEP_POLACH, 0, y, 0).force[1], linear.force[1] - turned.force[1],
                 1e-5);
    check_within("Polach spin", force_of(KEMPE_CREEP_POLACH, 0, 0, spin).force[1], turned.force[1], 1e-5);
    for (int k = -1; k <= 1; k++) { /* still less creep: no direction of it decides */
        kempe_creep_force tiny = force_of(KEMPE_CREEP_POLACH, 3e-12, k * 5e-12, 0),
                          ruled = force_of(KEMPE_CREEP_LINEAR, 3e-12, k * 5e-12, 0);
        check_within("Polach along without creep", tiny.force[0], ruled.force[0], 1e-5);
        if (k != 0)
            check_within("Polach across without creep", tiny.force[1], ruled.force[1], 1e-5);
    }
    CHECK_NEAR(force_of(KEMPE_CREEP_FASTSIM, x, y, spin).sticking, 1, 0.05);
}

/* Large creep: friction times normal force, against the slip. tanh bounds each component by itself. */
static void test_large(void)
{
    const double bound = wheel.friction * wheel.normal;
    for (int law = KEMPE_CREEP_SHEN; law <= KEMPE_CREEP_FASTSIM1; law++) {
        kempe_creep_force f = force_of((kempe_creep_law)law, -0.5, 0, 0);
        check_within(kempe_contact_law_name((kempe_creep_law)law), f.force[0], bound, 2e-3);
        CHECK(fabs(f.force[1]) < 1e-9 * bound);
        f = force_of((kempe_creep_law)law, 0.3, 0.4, 0.1);
        CHECK(law == KEMPE_CREEP_TANH || hypot(f.force[0], f.force[1]) < 1.001 * bound);
    }
}

/* Turning all signs turns all signs; mirroring across the strip mirrors: y and spin change theirs. */
static void test_mirrored(void)
{
    for (int law = KEMPE_CREEP_LINEAR; law <= KEMPE_CREEP_FASTSIM1; law++) {
        kempe_creep_force f = force_of((kempe_creep_law)law, 1e-3, 7e-4, 0.2);
        kempe_creep_force back = force_of((kempe_creep_law)law, -1e-3, -7e-4, -0.2);
        kempe_creep_force mirror = force_of((kempe_creep_law)law, 1e-3, -7e-4, -0.2);
        CHECK_NEAR(f.force[0], -back.force[0], 1e-12);
        CHECK_NEAR(f.force[1], -back.force[1], 1e-12);
        CHECK_NEAR(f.moment, -back.moment, 1e-10);
        CHECK_NEAR(f.force[0], mirror.force[0], 1e-12);
        CHECK_NEAR(f.force[1], -mirror.force[1], 1e-12);
    }
}

/* No creep, no force, no friction: zeros, never 0/0. */
static void test_nothing(void)
{
    for (int law = KEMPE_CREEP_NONE; law <= KEMPE_CREEP_FASTSIM1; law++) {
        kempe_creep creep = wheel;
        kempe_creep_force f = force_of((kempe_creep_law)law, 0, 0, 0);
        CHECK(f.force[0] == 0 && f.force[1] == 0 && f.moment == 0);
        creep.slip[0] = 1e-3, creep.normal = 0;
        CHECK(kempe_contact_creep((kempe_creep_law)law, &creep, &f) == KEMPE_OK);
        CHECK(law == KEMPE_CREEP_LINEAR || (f.force[0] == 0 && f.moment == 0));
        creep.normal = 1e4, creep.friction = 0;
        CHECK(kempe_contact_creep((kempe_creep_law)law, &creep, &f) == KEMPE_OK);
        CHECK(law == KEMPE_CREEP_LINEAR || (f.force[0] == 0 && f.moment == 0));
    }
}

/* Vermeulen and Johnson 1964: two thirds of the way, 1 - (1 - t/3)^3. */
static void test_johnson(void)
{
    double slope = -force_of(KEMPE_CREEP_LINEAR, 1, 0, 0).force[0], bound = wheel.friction * wheel.normal;
    for (double t = 0.1; t < 3; t += 0.2)
        CHECK_NEAR(force_of(KEMPE_CREEP_SHEN, -t * bound / slope, 0, 0).force[0] / bound, 1 - pow(1 - t / 3, 3), 1e-12);
}

/* Polach's formulas as they are printed, with his K of delta. */
static void test_polach(void)
{
    const double x = 1.1e-3, y = -4e-4, spin = 0.3, a = wheel.a, b = wheel.b, G = wheel.shear_modulus;
    const double bound = wheel.friction * wheel.normal, turned = y + a * spin;
    kempe_kalker c;
    CHECK(kempe_contact_kalker(a / b, wheel.poisson, &c) == KEMPE_OK && turned > fabs(y));
    double s = hypot(x, turned), slope = hypot(c.c11 * x, c.c22 * y) / hypot(x, y);
    double e = G * pi * a * b * slope * s / (4 * bound), F = 2 * bound / pi * (e / (1 + e * e) + atan(e));
    double far = 1 + 6.3 * (1 - exp(-a / b)), d = 8.0 / 3 * G * b * sqrt(a * b) * c.c23 * turned / (bound * far);
    double delta = (d * d - 1) / (d * d + 1);
    double K = d * (delta * delta * delta / 3 - delta * delta / 2 + 1.0 / 6) - pow(1 - delta * delta, 1.5) / 3;
    double F_spin = 9.0 / 16 * a * bound * K * far;
    kempe_creep_force f = force_of(KEMPE_CREEP_POLACH, x, y, spin);
    CHECK_NEAR(f.force[0], -F * x / s, 1e-12);
    CHECK_NEAR(f.force[1], -F * y / s + F_spin * spin / s, 1e-12);
}

/* -- FASTSIM --------------------------------------------------------------------------------------- */

static const kempe_creep reversed = {.a = 8e-3,
                                     .b = 4e-3,
                                     .shear_modulus = 82e9,
                                     .poisson = 0.28,
                                     .normal = 82e3,
                                     .friction = 0.3,
                                     .slip = {0, -0.625e-3},
                                     .spin = 0.625};

/* CONTACT (github eve70a/CONTACT, r2707), examples/fastsim.ref_out, cases 2 and 5, with the flexibilities printed
 * there: 40 x 40 and 200 x 200 elements; their error is in proportion to the element's size, so that the limit is 5 +
 * (5 - 2)/4. Force across, moment, and the share that sticks. */
static void test_fastsim(void)
{
    const double flexibility[3] = {0.4937e-13, 0.5152e-13, 0.4090e-13}, share = 18424.0 / 31428, coarse = 738.0 / 1264;
    kempe_creep creep = reversed;
    kempe_creep_force f;
    creep.strips = 1000;
    CHECK(kempe_contact_fastsim(&creep, flexibility, &f) == KEMPE_OK);
    check_within("across", f.force[1], -1.564e4 - (1.564e4 - 1.505e4) / 4, 1e-3);
    check_within("moment", f.moment, -37.98 + (39.00 - 37.98) / 4, 1e-3);
    check_within("sticking", f.sticking, share + (share - coarse) / 4, 5e-3);
    CHECK(fabs(f.force[0]) < 1e-6);
}

/* The one flexibility: each of the three where its creepage is alone, 3 and 4 parts of 5 where these are as 3 to 4.
 * With one alone both are the same; where all slips the force is against the slip, which three turn away. */
static void test_fastsim_of_one(void)
{
    double each[3], one = 7;
    kempe_creep creep = wheel;
    CHECK(kempe_contact_flexibilities(&creep, each) == KEMPE_OK);
    for (int k = 0; k < 3; k++) {
        creep = wheel;
        *(k < 2 ? &creep.slip[k] : &creep.spin) = -2e-4;
        CHECK(kempe_contact_flexibility(&creep, &one) == KEMPE_OK);
        CHECK_NEAR(one / each[k], 1, 1e-14);
        kempe_creep_force alike[2];
        for (int i = 0; i < 2 && k < 2; i++)
            CHECK(kempe_contact_creep(i ? KEMPE_CREEP_FASTSIM1 : KEMPE_CREEP_FASTSIM, &creep, &alike[i]) == KEMPE_OK);
        CHECK(k == 2 || fabs(alike[0].force[k] / alike[1].force[k] - 1) < 1e-13);
    }
    const double root = sqrt(wheel.a * wheel.b);
    creep.slip[0] = 0, creep.slip[1] = 3e-2 * root, creep.spin = -4e-2;
    CHECK(kempe_contact_flexibility(&creep, &one) == KEMPE_OK);
    CHECK_NEAR(one / ((3 * each[1] + 4 * each[2]) / 5), 1, 1e-14);
    creep.a = 0;
    CHECK(kempe_contact_flexibility(&creep, &one) == KEMPE_E_ARGUMENT && one > 0);
    kempe_creep_force f = force_of(KEMPE_CREEP_FASTSIM1, 0.03, 0.04, 0);
    CHECK_NEAR(f.force[1] / f.force[0], 4.0 / 3, 1e-12);
    f = force_of(KEMPE_CREEP_FASTSIM, 0.03, 0.04, 0);
    CHECK(fabs(f.force[1] / f.force[0] * 3 / 4 - 1) > 0.05);
}

/* Creep along alone, CONTACT's examples/tractcurv.ref_out: a/b = 0.5, 106.7 kN, friction 0.33; its exact theory, and
 * its FASTSIM on 44 x 40 elements, which is 3 % above its limit where nothing slips. Shen and Polach beside the exact
 * theory: what docs/contact_laws.md tells. */
static void test_curve(void)
{
    const double exact[] = {9112, 16700, 22820, 27570, 31040, 33330, 34620, 35130, 35180, 35180};
    const double simple[] = {9075, 16380, 22110, 26480, 29690, 31960, 33470, 34400, 34910, 35130};
    kempe_creep creep = {
        .a = 6.304e-3, .b = 12.61e-3, .shear_modulus = 82e9, .poisson = 0.28, .normal = 106.7e3, .friction = 0.33};
    double worst[4] = {0};
    for (int k = 0; k < 10; k++) {
        kempe_creep_force f[4];
        const kempe_creep_law law[4] = {KEMPE_CREEP_FASTSIM, KEMPE_CREEP_SHEN, KEMPE_CREEP_POLACH, KEMPE_CREEP_TANH};
        creep.slip[0] = 4e-4 * (k + 1);
        for (int i = 0; i < 4; i++) {
            CHECK(kempe_contact_creep(law[i], &creep, &f[i]) == KEMPE_OK);
            worst[i] = fmax(worst[i], fabs(f[i].force[0] / -exact[k] - 1));
        }
        check_within("FASTSIM", f[0].force[0], -simple[k], 0.03);
    }
    printf("of CONTACT's exact theory: FASTSIM %.3f, Shen %.3f, Polach %.3f, tanh %.3f\n", worst[0], worst[1], worst[2],
           worst[3]);
    CHECK(worst[0] < 0.06 && worst[1] < 0.05 && worst[2] < 0.07 && worst[3] < 0.07);
}

/* With spin: CONTACT's exact theory there (case 1) has -14.94 kN and -48.21 N m. */
static void test_fastsim_exact(void)
{
    kempe_creep_force f;
    CHECK(kempe_contact_creep(KEMPE_CREEP_FASTSIM, &reversed, &f) == KEMPE_OK);
    check_within("across", f.force[1], -1.494e4, 0.08);
}

/* More strips: the error falls in proportion, and fifty are within 0.5 %. */
static void test_fastsim_converges(void)
{
    kempe_creep creep = reversed;
    kempe_creep_force f[4];
    for (int k = 0; k < 4; k++) {
        creep.strips = k < 3 ? 50 << (2 * k) : 2400;
        CHECK(kempe_contact_creep(KEMPE_CREEP_FASTSIM, &creep, &f[k]) == KEMPE_OK);
    }
    double coarse = fabs(f[0].force[1] - f[3].force[1]), fine = fabs(f[2].force[1] - f[3].force[1]);
    CHECK(coarse < 0.006 * fabs(f[3].force[1]) && fine < coarse / 8);
    kempe_creep_force unasked;
    CHECK(kempe_contact_creep(KEMPE_CREEP_FASTSIM, &reversed, &unasked) == KEMPE_OK &&
          unasked.force[1] == f[0].force[1]);
}

/* No spin, along alone: in every strip slip begins where the traction meets the bound, x = A - 2 c / room: a closed
 * form (Kalker 1982) for t = |linear force| / bound, t = 4/3 of which... is integrated here by itself. */
static void test_fastsim_closed(void)
{
    const double bound = wheel.friction * wheel.normal, slope = -force_of(KEMPE_CREEP_LINEAR, 1, 0, 0).force[0];
    kempe_creep creep = wheel;
    creep.strips = 800;
    for (double t = 0.2; t < 2.5; t += 0.55) {
        double sum = 0, rate = 3 * t / 8, room = 2 / pi;
        const int n = 4000;
        for (int k = 0; k < n; k++) {
            double y = (k + 0.5) / n, A = sqrt(1 - y * y), stick = fmin(2 * A, fmax(0, 2 * A - rate / room)),
                   end = A - stick;
            double adhesion = 0.5 * rate * stick * stick;
            double slip = room * (A * A * (end + A) - (end * end * end + A * A * A) / 3);
            sum += 2 * (adhesion + slip) / n;
        }
        creep.slip[0] = -t * bound / slope;
        kempe_creep_force f;
        CHECK(kempe_contact_creep(KEMPE_CREEP_FASTSIM, &creep, &f) == KEMPE_OK);
        check_within("along", f.force[0] / bound, sum, 1e-4);
    }
}

int main(void)
{
    TEST(test_elliptic);
    TEST(test_sphere);
    TEST(test_ellipses);
    TEST(test_ratio);
    TEST(test_line);
    TEST(test_stiffness);
    TEST(test_refused);
    TEST(test_kalker_rows);
    TEST(test_slender);
    TEST(test_smooth);
    TEST(test_linear);
    TEST(test_small);
    TEST(test_large);
    TEST(test_mirrored);
    TEST(test_nothing);
    TEST(test_johnson);
    TEST(test_polach);
    TEST(test_fastsim);
    TEST(test_curve);
    TEST(test_fastsim_of_one);
    TEST(test_fastsim_exact);
    TEST(test_fastsim_converges);
    TEST(test_fastsim_closed);
    return check_report();
}
