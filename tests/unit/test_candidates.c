/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* Implicit blocks that begin at the best of several candidates: the lowest valley, the nearer side, and the same bits
 * from a program that was written and read. */
#include "backend/machine.h"
#include "read_again.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/solving.h"
#include <math.h>

static double circle_x(double radius2, double slope, double offset)
{
    double a = 1 + slope * slope, b = slope * offset, c = offset * offset - radius2;
    return (-b + sqrt(b * b - a * c)) / a;
}

/* Waves on a parabola around p: many valleys. `sign` turns the residual around, which changes nothing. */
static double waves(double y, double p)
{
    return (y - p) * (y - p) + 0.7 * cos(6 * y);
}

static int waves_block(kmp_graph *g, int sign, int candidates, const double *candidate)
{
    kmp_graph *l = kmp_graph_new();
    kmp_ref y = kmp_input(l, KMP_IN_Q, 0), d = kmp_sub(l, y, kmp_input(l, KMP_IN_PARAMETER, 0)), six = kmp_const(l, 6);
    kmp_ref angle = kmp_mul(l, six, y), one = KMP_ONE;
    kmp_ref merit = kmp_add(l, kmp_mul(l, d, d), kmp_mul(l, kmp_const(l, 0.7), kmp_cos(l, angle)));
    kmp_derivative *by = kmp_derivative_new(l, 1, &y, &one);
    kmp_ref residual = kmp_mul(l, kmp_const(l, sign), kmp_derivative_of(by, merit));
    kmp_derivative_free(by);
    return kmp_graph_add_implicit(g,
                                  kmp_implicit_new_among(l, 1, 1, &residual, &residual, candidates, candidate, merit));
}

static double solve_waves(int sign, int candidates, const double *candidate, double p)
{
    kmp_graph *g = kmp_graph_new();
    int block = waves_block(g, sign, candidates, candidate);
    kmp_solving *s = kmp_solving_new(kmp_implicit_block(kmp_graph_implicit(g, block)), NULL);
    *kmp_solving_arguments(s) = p;
    double y = kmp_solving_value(s, 0);
    kmp_solving_free(s);
    kmp_graph_free(g);
    return y;
}

/* Two lists of arguments in one room have the bits that each has in a room of its own. */
static void test_shared_room(void)
{
    const double candidate[] = {-1.5, -0.5, 0.25, 1.25}, p[2] = {-1.1, 0.7};
    kmp_graph *g = kmp_graph_new();
    int block = waves_block(g, 1, 4, candidate);
    kmp_solving *first = kmp_solving_new(kmp_implicit_block(kmp_graph_implicit(g, block)), NULL);
    kmp_solving *both[2] = {first, kmp_solving_beside(first)};
    for (int k = 0; k < 2; k++)
        *kmp_solving_arguments(both[k]) = p[k];
    for (int k = 0; k < 4; k++) /* rooms alternate; the last two solutions are kept ones */
        CHECK(kmp_solving_value(both[k % 2], 0) == solve_waves(1, 4, candidate, p[k % 2]));
    kmp_solving_free(both[1]);
    CHECK(kmp_solving_value(first, 0) == solve_waves(1, 4, candidate, p[0]));
    kmp_solving_free(first);
    kmp_graph_free(g);
}

static void test_lowest_valley(void)
{
    double candidate[17];
    for (int k = 0; k < 17; k++) /* given in no order */
        candidate[k] = -2 + 0.25 * (k * 5 % 17);
    for (double p = -1.9; p < 1.9; p += 0.037) {
        double y = solve_waves(1, 17, candidate, p), best = INFINITY, lowest = INFINITY;
        for (int k = 0; k < 17; k++)
            best = fmin(best, waves(candidate[k], p));
        for (double x = -2; x <= 2; x += 1e-3)
            lowest = fmin(lowest, waves(x, p));
        CHECK(2 - 0.7 * 36 * cos(6 * y) > 0); /* a valley, no hill */
        CHECK_NEAR(2 * (y - p) - 0.7 * 6 * sin(6 * y), 0, 1e-14);
        CHECK(waves(y, p) <= best);
        CHECK_NEAR(waves(y, p), lowest, 0.06); /* the lowest, or one as low as the spacing can tell */
        CHECK(solve_waves(-1, 17, candidate, p) == y);
        CHECK_NEAR(solve_waves(1, 1, &y, p), y, 1e-15);
    }
}

/* Whatever lies between the candidates: a valley near one of them that is below it. */
static void test_coarse_candidates(void)
{
    for (double p = -1.5; p < 1.5; p += 0.1)
        for (double first = -1; first < -0.4; first += 0.05) {
            double candidate[3] = {first, first + 0.7, first + 1.4}, best = INFINITY;
            for (int count = 1; count <= 3; count++) {
                double y = solve_waves(1, count, candidate, p);
                best = fmin(best, waves(candidate[count - 1], p));
                CHECK(2 - 0.7 * 36 * cos(6 * y) > 0 && waves(y, p) <= best);
                CHECK_NEAR(2 * (y - p) - 0.7 * 6 * sin(6 * y), 0, 1e-13);
            }
        }
}

/* The circle once more: its other unknown is guessed on the line, the merit asks for the point that is nearer to
 * (p3, 0). */
static int sides_block(kmp_graph *g)
{
    const double candidate[] = {-2, 2};
    kmp_graph *l = kmp_graph_new();
    kmp_ref x = kmp_input(l, KMP_IN_Q, 0), y = kmp_input(l, KMP_IN_Q, 1), p[4], residual[2], guess[2];
    for (uint32_t k = 0; k < 4; k++)
        p[k] = kmp_input(l, KMP_IN_PARAMETER, k);
    guess[0] = KMP_ZERO;
    guess[1] = kmp_add(l, kmp_mul(l, p[1], x), p[2]);
    residual[0] = kmp_sub(l, kmp_add(l, kmp_mul(l, x, x), kmp_mul(l, y, y)), p[0]);
    residual[1] = kmp_sub(l, guess[1], y);
    kmp_ref d = kmp_sub(l, x, p[3]), merit = kmp_add(l, kmp_mul(l, d, d), kmp_mul(l, y, y));
    return kmp_graph_add_implicit(g, kmp_implicit_new_among(l, 2, 4, residual, guess, 2, candidate, merit));
}

/* Checks values, derivatives against differences, and equal bits of a program that was written and read as bytes. An
 * input that is not a number gives NaN. */
static void test_sides(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref s = kmp_input(g, KMP_IN_Q, 0), arguments[4], xy[2], out[4], one = KMP_ONE, wave;
    int sides = sides_block(g), valley = waves_block(g, 1, 3, (const double[]){-1.4, -0.5, 0.5});
    arguments[0] = kmp_const(g, 4);
    arguments[1] = kmp_mul(g, kmp_const(g, 0.2), s);
    arguments[2] = kmp_const(g, 0.3);
    arguments[3] = s;
    kmp_implicit_at(g, sides, arguments, xy);
    kmp_implicit_at(g, valley, &s, &wave);
    kmp_derivative *d = kmp_derivative_new(g, 1, &s, &one);
    out[0] = xy[0];
    out[1] = wave;
    out[2] = kmp_derivative_of(d, xy[0]);
    out[3] = kmp_derivative_of(d, wave);
    kmp_derivative_free(d);
    const kmp_ref *group = out;
    kmp_program *p = kmp_program_new(g, 1, &(int){4}, &group), *read = read_again(p);
    kmp_machine *m[2] = {kmp_machine_new(p, kmp_backend_find("tape")), kmp_machine_new(read, kmp_backend_find("tape"))};
    for (double at = -1.5; at < 1.6; at += 0.2) {
        double value[3][4];
        const double h = 1e-6;
        for (int k = 0; k < 3; k++) {
            double q = at + (k - 1) * h;
            for (int i = 0; i < 2; i++) {
                kmp_machine_set(m[i], KMP_IN_Q, &q);
                (void)kmp_machine_run(m[i], 1);
            }
            memcpy(value[k], kmp_machine_run(m[0], 1), sizeof value[k]);
            CHECK(memcmp(value[k], kmp_machine_run(m[1], 1), sizeof value[k]) == 0);
        }
        double slope = 0.2 * at;
        CHECK_NEAR(value[1][0], at < 0 ? -circle_x(4, -slope, 0.3) : circle_x(4, slope, 0.3), 1e-15);
        CHECK_NEAR(value[1][2], (value[2][0] - value[0][0]) / (2 * h), 1e-8);
        if (value[0][1] - value[1][1] < 1e-3 && value[1][1] - value[2][1] < 1e-3) /* no other valley between */
            CHECK_NEAR(value[1][3], (value[2][1] - value[0][1]) / (2 * h), 1e-8);
    }
    double none = NAN;
    kmp_machine_set(m[0], KMP_IN_Q, &none);
    CHECK(isnan(kmp_machine_run(m[0], 1)[0]));
    kmp_machine_free(m[0]);
    kmp_machine_free(m[1]);
    kmp_program_free(p);
    kmp_program_free(read);
    kmp_graph_free(g);
}

int main(void)
{
    TEST(test_shared_room);
    TEST(test_lowest_valley);
    TEST(test_coarse_candidates);
    TEST(test_sides);
    return check_report();
}
