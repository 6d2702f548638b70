/* SPDX-License-Identifier: BSD-3-Clause */
/* Contact patches strip by strip, and on a grid, against closed forms. */
#include "rail/contact/half_space.h"
#include "testing.h"
#include <kempe/rolling_contact.h>
#include <math.h>

static const double pi = 3.14159265358979323846, modulus = 82e9 / 0.72;

enum { STRIPS = 401 };

typedef struct body {
    double gap[STRIPS], bend[STRIPS], centre[STRIPS], along[STRIPS];
    kmp_strip strip[STRIPS];
    kmp_strip_gap in;
} body;

/* A gap with constant curvatures in strips over -width..width; `skew` moves the centres of the strips. */
static void fill(body *b, int strips, double width, double along, double across, double skew)
{
    b->in = (kmp_strip_gap){.count = strips,
                            .first = -width,
                            .step = 2 * width / (strips - 1),
                            .gap = b->gap,
                            .bend = b->bend,
                            .centre = b->centre,
                            .along = b->along};
    for (int k = 0; k < strips; k++) {
        double y = b->in.first + k * b->in.step;
        b->gap[k] = 0.5 * across * y * y;
        b->bend[k] = across;
        b->centre[k] = skew * y;
        b->along[k] = along;
    }
}

static kempe_ellipse hertz(double along, double across, double normal)
{
    kempe_touch touch = {.along = along, .across = across, .shear_modulus = 82e9, .poisson = 0.28};
    kempe_ellipse e;
    CHECK(kempe_contact_hertz(&touch, normal, &e) == KEMPE_OK);
    return e;
}

/* ANALYN is Hertz's ellipse for constant curvatures: the strips are exact, their sum is that of the integrals. */
static void test_analyn(void)
{
    static body b;
    for (double across = 0.3; across < 100; across *= 3) {
        kmp_arena arena = {0};
        kmp_normal_load_patch p;
        kempe_ellipse e = hertz(2.1, across, 60e3);
        fill(&b, STRIPS, 1.3 * e.b, 2.1, across, 0.3);
        CHECK(kmp_strips_press(KMP_STRIPS_ANALYN, &b.in, modulus, 60e3, &arena, b.strip, &p));
        CHECK_NEAR(p.approach / e.approach, 1, 2e-4);
        CHECK_NEAR(p.pressure / e.pressure, 1, 2e-4);
        CHECK_NEAR(p.area / (pi * e.a * e.b), 1, 2e-4);
        CHECK(p.lobes == 1 && fabs(p.place) < 1e-9);
        CHECK_NEAR((b.strip[STRIPS / 2].to - b.strip[STRIPS / 2].from) / (2 * e.a), 1, 2e-4);
        kmp_arena_free(&arena);
    }
}

/* Kik and Piotrowski on two spheres, radius r of the patch: N = 4/3 E* d r, r^2 = 0.55 d/A, largest pressure 3 N/(2 pi
 * r^2). */
static void test_overlap(void)
{
    static body b;
    kmp_arena arena = {0};
    kmp_normal_load_patch p;
    const double normal = 60e3, curvature = 2;
    double d = cbrt(pow(0.75 * normal / modulus, 2) * curvature / 2 / 0.55), r = sqrt(0.55 * d / (curvature / 2));
    fill(&b, STRIPS, 1.3 * r, curvature, curvature, 0);
    CHECK(kmp_strips_press(KMP_STRIPS_KP, &b.in, modulus, normal, &arena, b.strip, &p));
    CHECK_NEAR(p.approach / d, 1, 2e-3);
    CHECK_NEAR(p.area / (pi * r * r), 1, 2e-3);
    CHECK_NEAR(p.pressure / (1.5 * normal / (pi * r * r)), 1, 2e-3);
    kmp_arena_free(&arena);
}

/* Hertz's ellipse on a grid of some hundred rectangles. */
static void check_grid(double along, double across, int rows, double width, double within)
{
    static body b;
    kmp_arena arena = {0};
    kempe_ellipse e = hertz(along, across, 60e3);
    kmp_normal_load_patch p = {0};
    kmp_half_space s;
    fill(&b, rows, width * e.b, along, across, 0);
    CHECK(kmp_strips_press(KMP_STRIPS_ANALYN, &b.in, modulus, 60e3, &arena, b.strip, &p));
    CHECK(kmp_half_space_press(&b.in, modulus, 60e3, 30, &arena, b.strip, &p, &s) == KMP_HALF_SPACE_SOLVED);
    double load = 0;
    for (int k = 0; k < rows * s.columns; k++)
        load += s.pressure[k] * s.dx * b.in.step;
    CHECK_NEAR(load / 60e3, 1, 1e-12);
    CHECK_NEAR(p.approach / e.approach, 1, within);
    CHECK_NEAR(p.pressure / e.pressure, 1, within);
    CHECK_NEAR(p.area / (pi * e.a * e.b), 1, 2 * within);
    CHECK(p.lobes == 1 && s.iterations < 100);
    kmp_arena_free(&arena);
}

static void test_grid(void)
{
    check_grid(2, 2, 31, 1.5, 5e-3);
    check_grid(2, 0.4, 31, 1.5, 5e-3);
    check_grid(2, 20, 31, 1.5, 5e-3);
    check_grid(2, 200, 31, 1.6, 1e-2);
}

/* Two equal spheres far from each other: each has half of the load, and the approach is that of one under it, plus the
 * deflection by the other one, N/(pi E* distance). */
static void test_two_lobes(void)
{
    static body b;
    kmp_arena arena = {0};
    const double curvature = 20, apart = 12e-3, normal = 20e3;
    kempe_ellipse e = hertz(curvature, curvature, normal / 2);
    kmp_normal_load_patch p;
    kmp_half_space s;
    fill(&b, 151, 12e-3, curvature, curvature, 0);
    for (int k = 0; k < 151; k++) {
        double y = fabs(b.in.first + k * b.in.step) - apart / 2;
        b.gap[k] = 0.5 * curvature * y * y;
    }
    CHECK(kmp_strips_press(KMP_STRIPS_ANALYN, &b.in, modulus, normal, &arena, b.strip, &p));
    CHECK(p.lobes == 2);
    CHECK_NEAR(p.pressure / e.pressure, 1, 5e-3);
    CHECK_NEAR(p.approach / e.approach, 1, 5e-3); /* without the interaction */
    CHECK(kmp_half_space_press(&b.in, modulus, normal, 30, &arena, b.strip, &p, &s) == KMP_HALF_SPACE_SOLVED);
    CHECK(p.lobes == 2);
    CHECK_NEAR(p.pressure / e.pressure, 1, 2e-2);
    CHECK_NEAR(p.approach / (e.approach + normal / 2 / (pi * modulus * apart)), 1, 1e-2);
    kmp_arena_free(&arena);
}

/* Rolling on Hertz's ellipse, 1.5 to 1: for small creepages and spin the linear theory with Kalker's coefficients, for
 * large ones friction times the load against the slip. */
static void test_rolling(void)
{
    static body b;
    kmp_arena arena = {0};
    kempe_ellipse e = hertz(2, 2 * 1.9, 60e3);
    kmp_normal_load_patch p;
    kmp_half_space s;
    fill(&b, 31, 1.45 * e.b, 2, 2 * 1.9, 0);
    CHECK(kmp_strips_press(KMP_STRIPS_ANALYN, &b.in, modulus, 60e3, &arena, b.strip, &p));
    CHECK(kmp_half_space_press(&b.in, modulus, 60e3, 30, &arena, b.strip, &p, &s) == KMP_HALF_SPACE_SOLVED);
    for (int k = 0; k < 3; k++) {
        kmp_rolling r = {.shear_modulus = 82e9, .poisson = 0.28, .friction = 0.3};
        kempe_creep linear = {
            .a = e.a, .b = e.b, .shear_modulus = 82e9, .poisson = 0.28, .normal = 60e3, .friction = 0.3};
        kempe_creep_force found, expected;
        r.slip[0] = linear.slip[0] = k == 0 ? 1e-5 : 0;
        r.slip[1] = linear.slip[1] = k == 1 ? -1e-5 : 0;
        r.spin = linear.spin = k == 2 ? 2e-3 : 0;
        CHECK(kempe_contact_creep(KEMPE_CREEP_LINEAR, &linear, &expected) == KEMPE_OK);
        CHECK(kmp_half_space_roll(&b.in, &s, &r, &arena, &found) == KMP_HALF_SPACE_SOLVED);
        int main_one = k == 0 ? 0 : 1;
        CHECK(fabs(found.force[main_one] / expected.force[main_one] - 1) <= (k == 2 ? 0.08 : 0.02));
        CHECK(fabs(found.force[1 - main_one]) <= 1e-9 * fabs(expected.force[main_one]) && found.sticking > 0.9);
    }
    const kmp_rolling sliding = {
        .shear_modulus = 82e9, .poisson = 0.28, .friction = 0.3, .slip = {-3e-2, 4e-2}, .spin = 0};
    kempe_creep_force force;
    CHECK(kmp_half_space_roll(&b.in, &s, &sliding, &arena, &force) == KMP_HALF_SPACE_SOLVED);
    CHECK_NEAR(force.force[0] / (0.6 * 18e3), 1, 1e-3);
    CHECK_NEAR(force.force[1] / (-0.8 * 18e3), 1, 1e-3);
    CHECK(force.sticking == 0);
    kmp_arena_free(&arena);
}

/* A load that presses the contact to the border of the strips is refused by both. */
static void test_beyond(void)
{
    static body b;
    kmp_arena arena = {0};
    kmp_normal_load_patch p = {.lobes = -1}, small;
    kmp_half_space s;
    kempe_ellipse e = hertz(2, 2, 60e3);
    fill(&b, 31, 0.8 * e.b, 2, 2, 0);
    CHECK(!kmp_strips_press(KMP_STRIPS_ANALYN, &b.in, modulus, 60e3, &arena, b.strip, &p) && p.lobes == -1);
    CHECK(kmp_strips_press(KMP_STRIPS_ANALYN, &b.in, modulus, 10e3, &arena, b.strip, &small));
    CHECK(kmp_half_space_press(&b.in, modulus, 60e3, 30, &arena, b.strip, &small, &s) == KMP_HALF_SPACE_LARGE);
    kmp_arena_free(&arena);
}

int main(void)
{
    TEST(test_analyn);
    TEST(test_overlap);
    TEST(test_grid);
    TEST(test_two_lobes);
    TEST(test_rolling);
    TEST(test_beyond);
    return check_report();
}
