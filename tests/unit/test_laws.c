/* SPDX-License-Identifier: BSD-3-Clause */
/* The laws of rolling contact as expressions: against the numbers of kempe/rolling_contact.h, derivatives against
 * differences, and finite where something is zero. */
#include "base/memory.h"
#include "rail/wheel/laws.h"
#include "symbolic/derivative.h"
#include "testing.h"
#include <kempe/rolling_contact.h>
#include <math.h>

/* Arguments of the expressions, as parameters. */
enum { ALONG, ACROSS, SHEAR, NORMAL, FRICTION, SLIP_X, SLIP_Y, SPIN, INPUTS };

/* Results: force and moment of a law, axes and stiffness; then their derivatives by each input. */
enum { FORCE_X, FORCE_Y, MOMENT, AXIS_A, AXIS_B, STIFFNESS, OUTPUTS };

typedef struct scene {
    kmp_graph *g;
    kmp_ref input[INPUTS], output[OUTPUTS], slope[OUTPUTS][INPUTS];
    double *value;
} scene;

static const double poisson = 0.28;

static void derive(scene *s)
{
    for (int k = 0; k < INPUTS; k++) {
        kmp_ref one = KMP_ONE;
        kmp_derivative *d = kmp_derivative_new(s->g, 1, &s->input[k], &one);
        for (int i = 0; i < OUTPUTS; i++)
            s->slope[i][k] = kmp_derivative_of(d, s->output[i]);
        kmp_derivative_free(d);
    }
}

static scene made(kmp_creep_law law)
{
    scene s = {.g = kmp_graph_new()};
    for (uint32_t k = 0; k < INPUTS; k++)
        s.input[k] = kmp_input(s.g, KMP_IN_PARAMETER, k);
    kmp_touch touch = {
        .along = s.input[ALONG], .across = s.input[ACROSS], .shear_modulus = s.input[SHEAR], .poisson = poisson};
    kmp_creep creep = {.touch = touch,
                       .normal = s.input[NORMAL],
                       .friction = s.input[FRICTION],
                       .slip = {s.input[SLIP_X], s.input[SLIP_Y]},
                       .spin = s.input[SPIN]};
    kmp_creep_force force;
    kmp_creep_law_force(s.g, law, &creep, &force);
    s.output[FORCE_X] = force.force[0];
    s.output[FORCE_Y] = force.force[1];
    s.output[MOMENT] = force.moment;
    kmp_hertz_axes(s.g, &touch, s.input[NORMAL], &s.output[AXIS_A]);
    s.output[STIFFNESS] = kmp_hertz_stiffness(s.g, &touch);
    derive(&s);
    CHECK(!kmp_graph_failed(s.g));
    s.value = KMP_NEW(double, (int)kmp_graph_count(s.g));
    return s;
}

static void release(scene *s)
{
    kmp_free(s->value);
    kmp_graph_free(s->g);
}

static double valued(const scene *s, kmp_ref r)
{
    return kmp_is_negative(r) ? -s->value[kmp_id(r)] : s->value[kmp_id(r)];
}

static void evaluate(const scene *s, const double at[INPUTS], double out[OUTPUTS])
{
    const double *inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = at};
    kmp_graph_eval(s->g, inputs, s->value);
    for (int k = 0; k < OUTPUTS; k++)
        out[k] = valued(s, s->output[k]);
}

static const kempe_creep_law numeric_law[KMP_CREEP_LAWS] = {KEMPE_CREEP_NONE, KEMPE_CREEP_LINEAR, KEMPE_CREEP_SHEN,
                                                            KEMPE_CREEP_POLACH, KEMPE_CREEP_TANH};

/* Points of a grid: curvatures from slender to slender, forces, creep from nothing to sliding, spin of either sign. */
enum { GRID = 6 * 5 * 6 * 4 };

static void grid_point(int k, double at[INPUTS])
{
    static const double ratio[] = {1e-4, 0.013, 0.4, 1, 3.3, 900}, normal[] = {100, 3e3, 2e4, 9e4, 4e5};
    static const double slip[][2] = {{1e-7, 0}, {0, -3e-5}, {2e-4, 3e-4}, {-4e-3, 1e-3}, {1e-3, -0.07}, {0.4, 0.3}};
    static const double spin[] = {0, 0.02, -0.5, 3};
    at[ALONG] = 2.2, at[ACROSS] = 2.2 / ratio[k % 6], at[NORMAL] = normal[k / 6 % 5];
    at[SLIP_X] = slip[k / 30 % 6][0], at[SLIP_Y] = slip[k / 30 % 6][1], at[SPIN] = spin[k / 180];
    at[SHEAR] = 82e9, at[FRICTION] = 0.3;
}

/* The numbers beside the expressions, with the expressions' own ellipse. */
static void compare(const scene *s, kmp_creep_law law, const double at[INPUTS])
{
    double out[OUTPUTS];
    evaluate(s, at, out);
    kempe_touch touch = {.along = at[ALONG], .across = at[ACROSS], .shear_modulus = at[SHEAR], .poisson = poisson};
    kempe_ellipse e;
    CHECK(kempe_contact_hertz(&touch, at[NORMAL], &e) == KEMPE_OK);
    CHECK_NEAR(out[AXIS_A] / e.a, 1, 1e-8);
    CHECK_NEAR(out[AXIS_B] / e.b, 1, 1e-8);
    CHECK_NEAR(out[STIFFNESS] / e.stiffness, 1, 1e-8);
    kempe_creep creep = {.a = out[AXIS_A],
                         .b = out[AXIS_B],
                         .shear_modulus = at[SHEAR],
                         .poisson = poisson,
                         .normal = at[NORMAL],
                         .friction = at[FRICTION],
                         .slip = {at[SLIP_X], at[SLIP_Y]},
                         .spin = at[SPIN]};
    kempe_creep_force f;
    CHECK(kempe_contact_creep(numeric_law[law], &creep, &f) == KEMPE_OK);
    double unit = at[FRICTION] * at[NORMAL];
    if (law == KMP_CREEP_LINEAR)
        unit = check_max(unit, hypot(f.force[0], f.force[1]));
    CHECK_NEAR((out[FORCE_X] - f.force[0]) / unit, 0, 1e-9);
    CHECK_NEAR((out[FORCE_Y] - f.force[1]) / unit, 0, 1e-9);
    CHECK_NEAR((out[MOMENT] - f.moment) / fmax(unit * creep.a, fabs(f.moment)), 0, 1e-9);
}

static void test_numbers(void)
{
    for (int law = KMP_CREEP_NONE; law < KMP_CREEP_LAWS; law++) {
        scene s = made((kmp_creep_law)law);
        for (int k = 0; k < GRID; k++) {
            double at[INPUTS];
            grid_point(k, at);
            compare(&s, (kmp_creep_law)law, at);
        }
        release(&s);
    }
}

/* All sizes of creep, and all ratios of curvatures that the splines are made for. */
static void test_sweeps(void)
{
    for (int law = KMP_CREEP_LINEAR; law < KMP_CREEP_LAWS; law++) {
        scene s = made((kmp_creep_law)law);
        double at[INPUTS];
        grid_point(3 + 6 * 3, at);
        at[SPIN] = 0.1;
        for (double slip = 1e-4; slip < 0.1; slip *= 1.01) {
            at[SLIP_X] = 0.9 * slip, at[SLIP_Y] = -0.4 * slip;
            compare(&s, (kmp_creep_law)law, at);
        }
        for (double t = -12; law == KMP_CREEP_POLACH && t <= 12; t += 0.023) {
            at[ACROSS] = at[ALONG] * exp(t);
            compare(&s, (kmp_creep_law)law, at);
        }
        release(&s);
    }
}

/* Derivatives against central differences, each over the size that the output has near there. Polach's law has a kink
 * by spin where there is none. */
static void check_slopes(const scene *s, const double at[INPUTS], int inputs)
{
    double out[OUTPUTS], slope[OUTPUTS][INPUTS];
    evaluate(s, at, out);
    for (int i = 0; i < OUTPUTS; i++)
        for (int k = 0; k < INPUTS; k++)
            slope[i][k] = valued(s, s->slope[i][k]);
    double force = at[FRICTION] * at[NORMAL] + hypot(out[FORCE_X], out[FORCE_Y]), slip = hypot(at[SLIP_X], at[SLIP_Y]);
    const double unit[OUTPUTS] = {force,       force,       force * 1e-2 + fabs(out[MOMENT]),
                                  out[AXIS_A], out[AXIS_B], out[STIFFNESS]};
    for (int k = 0; k < inputs; k++) {
        double step = k < SLIP_X  ? 1e-5 * at[k]
                      : k == SPIN ? 1e-5 * (fabs(at[SPIN]) + 100 * slip)
                                  : 1e-5 * (slip + 1e-3 * fabs(at[SPIN]));
        double below[INPUTS], above[INPUTS], low[OUTPUTS], high[OUTPUTS];
        memcpy(below, at, sizeof below), memcpy(above, at, sizeof above);
        below[k] -= step, above[k] += step;
        evaluate(s, below, low), evaluate(s, above, high);
        for (int i = 0; i < OUTPUTS; i++)
            CHECK_NEAR((slope[i][k] * 2 * step - (high[i] - low[i])) / unit[i], 0, 1e-8);
    }
}

static void test_derivatives(void)
{
    for (int law = KMP_CREEP_LINEAR; law < KMP_CREEP_LAWS; law++) {
        scene s = made((kmp_creep_law)law);
        for (int k = 0; k < GRID; k += 7) {
            double at[INPUTS];
            grid_point(k, at);
            check_slopes(&s, at, law == KMP_CREEP_POLACH && at[SPIN] == 0 ? SPIN : INPUTS);
        }
        release(&s);
    }
}

/* No creep, no force, no friction, a pulling force, and no wheel's curvatures: everything is finite, derivatives too.
 */
static void test_finite(void)
{
    const double table[][INPUTS] = {
        {2.2, 3.3, 82e9, 8e4, 0.3, 0, 0, 0},       {2.2, 3.3, 82e9, 0, 0.3, 1e-3, 1e-4, 0.1},
        {2.2, 3.3, 82e9, 0, 0.3, 0, 0, 0},         {2.2, 3.3, 82e9, 8e4, 0, 1e-3, 1e-4, 0.1},
        {2.2, 3.3, 82e9, 8e4, 0, 0, 0, 0},         {2.2, 3.3, 82e9, -1e3, 0.3, 1e-3, 1e-4, 0.1},
        {2.2, 3.3, 82e9, 8e4, 0.3, 0, 0, 0.1},     {2.2, 1e-9, 82e9, 8e4, 0.3, 0, 1e-3, 0.1},
        {2.2, 1e9, 82e9, 8e4, 0.3, 0, 1e-3, 0.1},  {2.2, 3.3, 82e9, 8e4, 0.3, 1e6, 1e6, 1e9},
        {2.2, 3.3, 82e9, 1e12, 0.3, 0, 1e-3, 0.1}, {2.2, 3.3, 82e9, 1e-200, 0.3, 0, 1e-3, 0.1}};
    for (int law = KMP_CREEP_NONE; law < KMP_CREEP_LAWS; law++) {
        scene s = made((kmp_creep_law)law);
        for (size_t row = 0; row < sizeof table / sizeof *table; row++) {
            double out[OUTPUTS];
            evaluate(&s, table[row], out);
            for (int i = 0; i < OUTPUTS; i++) {
                CHECK(isfinite(out[i]));
                for (int k = 0; k < INPUTS; k++)
                    CHECK(isfinite(valued(&s, s.slope[i][k])));
            }
            if (table[row][NORMAL] == 0 || (table[row][FRICTION] == 0 && law != KMP_CREEP_LINEAR))
                CHECK(out[FORCE_X] == 0 && out[FORCE_Y] == 0 && out[MOMENT] == 0);
        }
        release(&s);
    }
}

/* Without creep, and with the creep that rounding leaves, every law has the derivatives of the linear theory. */
static void test_rolling(void)
{
    static const double table[][2] = {{0, 0}, {2e-15, -3e-15}, {-4e-14, 1e-16}, {1e-15, 5e-14}};
    scene linear = made(KMP_CREEP_LINEAR);
    for (int law = KMP_CREEP_SHEN; law < KMP_CREEP_LAWS; law++) {
        scene s = made((kmp_creep_law)law);
        for (size_t row = 0; row < sizeof table / sizeof *table; row++) {
            double at[INPUTS] = {2.2, 0.9, 82e9, 8e4, 0.3, table[row][0], table[row][1], 0}, out[OUTPUTS];
            evaluate(&linear, at, out), evaluate(&s, at, out);
            CHECK_NEAR(valued(&s, s.slope[FORCE_X][SLIP_X]) / valued(&linear, linear.slope[FORCE_X][SLIP_X]), 1, 1e-6);
            CHECK_NEAR(valued(&s, s.slope[FORCE_Y][SLIP_Y]) / valued(&linear, linear.slope[FORCE_Y][SLIP_Y]), 1, 1e-6);
            CHECK_NEAR(valued(&s, s.slope[FORCE_X][SLIP_Y]) / valued(&linear, linear.slope[FORCE_X][SLIP_X]), 0, 1e-6);
        }
        release(&s);
    }
    release(&linear);
}

/* No friction from the start: nothing is in the graph. */
static void test_none(void)
{
    scene s = {.g = kmp_graph_new()};
    kmp_ref x = kmp_input(s.g, KMP_IN_PARAMETER, 0);
    kmp_creep creep = {.touch = {.along = x, .across = x, .shear_modulus = x, .poisson = 0.3},
                       .normal = x,
                       .friction = KMP_ZERO,
                       .slip = {x, x},
                       .spin = x};
    kmp_creep_force f;
    for (int law = KMP_CREEP_NONE; law < KMP_CREEP_LAWS; law++) {
        kmp_creep_law_force(s.g, (kmp_creep_law)law, &creep, &f);
        if (law != KMP_CREEP_LINEAR)
            CHECK(f.force[0] == KMP_ZERO && f.force[1] == KMP_ZERO && f.moment == KMP_ZERO);
    }
    kmp_graph_free(s.g);
}

int main(void)
{
    TEST(test_numbers);
    TEST(test_sweeps);
    TEST(test_derivatives);
    TEST(test_finite);
    TEST(test_rolling);
    TEST(test_none);
    return check_report();
}
