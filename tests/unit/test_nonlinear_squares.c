/* SPDX-License-Identifier: BSD-3-Clause */
/* Nonlinear least squares against minima in closed form: inside bounds, at them, with places that do not exist, and
 * with an end in between. */
#include "ensemble/fit/nonlinear_squares.h"
#include "testing.h"

typedef struct problem {
    int calls, end_at;
    double wall; /* r does not exist at x0 > wall */
} problem;

/* Rosenbrock's function: (1 - x0)^2 + 100 (x1 - x0^2)^2, a third residual is zero. */
static kmp_lm_message valley(void *user, const double *x, double *residual, double *jacobian)
{
    problem *p = user;
    if (++p->calls == p->end_at)
        return KMP_SQUARES_END;
    if (x[0] > p->wall)
        return KMP_SQUARES_NOWHERE;
    residual[0] = 1 - x[0];
    residual[1] = 10 * (x[1] - x[0] * x[0]);
    residual[2] = 0;
    const double slopes[] = {-1, -20 * x[0], 0, 0, 10, 0};
    memcpy(jacobian, slopes, sizeof slopes);
    return KMP_SQUARES_GO;
}

static kmp_squares_report solve(problem *p, double low, double high, double *x)
{
    const double lower[] = {low, -INFINITY}, upper[] = {high, INFINITY};
    const kmp_squares squares = {.rows = 3,
                                 .count = 2,
                                 .lower = lower,
                                 .upper = upper,
                                 .tolerance = 1e-12,
                                 .most = 200,
                                 .at = valley,
                                 .user = p};
    kmp_squares_report report = {.iterations = -1};
    CHECK(kmp_squares_minimise(&squares, x, &report));
    return report;
}

static void finds_the_minimum(void)
{
    const double bounds[][2] = {{-INFINITY, INFINITY}, {-2, 2}, {-2, INFINITY}, {-INFINITY, 3}};
    for (int k = 0; k < 4; k++) {
        problem p = {.wall = INFINITY};
        double x[] = {-1.2, 1};
        kmp_squares_report report = solve(&p, bounds[k][0], bounds[k][1], x);
        CHECK(report.outcome == KMP_SQUARES_FOUND);
        CHECK(report.evaluations == p.calls && report.refused == 0);
        CHECK(report.iterations > 3 && report.iterations < 60);
        CHECK_NEAR(x[0], 1, 1e-9);
        CHECK_NEAR(x[1], 1, 1e-9);
    }
}

/* With x0 <= 1/2 the least sum is at x = (1/2, 1/4). */
static void stops_at_bounds(void)
{
    const double low[] = {-2, -INFINITY};
    for (int k = 0; k < 2; k++) {
        problem p = {.wall = 0.5};
        double x[] = {-1.2, 1};
        kmp_squares_report report = solve(&p, low[k], 0.5, x);
        CHECK(report.outcome == KMP_SQUARES_FOUND);
        CHECK(x[0] <= 0.5);
        CHECK_NEAR(x[0], 0.5, 1e-6);
        CHECK_NEAR(x[1], 0.25, 1e-6);
    }
}

/* From a start on a bound it leaves it. */
static void leaves_a_bound(void)
{
    problem p = {.wall = INFINITY};
    double x[] = {-2, 4};
    CHECK(solve(&p, -2, 2, x).outcome == KMP_SQUARES_FOUND);
    CHECK_NEAR(x[0], 1, 1e-9);
}

/* atan x0, of which Newton's step from -3 leads to 9.5, and x1; r does not exist at x0 > 1. */
static kmp_lm_message arc(void *user, const double *x, double *residual, double *jacobian)
{
    problem *p = user;
    p->calls++;
    if (x[0] > p->wall)
        return KMP_SQUARES_NOWHERE;
    residual[0] = atan(x[0]);
    residual[1] = x[1];
    residual[2] = 0;
    const double slopes[] = {1 / (1 + x[0] * x[0]), 0, 0, 0, 1, 0};
    memcpy(jacobian, slopes, sizeof slopes);
    return KMP_SQUARES_GO;
}

static void shortens_steps(void)
{
    const double lower[] = {-INFINITY, -INFINITY}, upper[] = {INFINITY, INFINITY};
    problem p = {.wall = 1};
    const kmp_squares squares = {
        .rows = 3, .count = 2, .lower = lower, .upper = upper, .tolerance = 1e-12, .most = 200, .at = arc, .user = &p};
    double x[] = {-3, 1};
    kmp_squares_report report = {.refused = -1};
    CHECK(kmp_squares_minimise(&squares, x, &report));
    CHECK(report.outcome == KMP_SQUARES_FOUND && report.refused > 0);
    CHECK_NEAR(x[0], 0, 1e-9);
    CHECK_NEAR(x[1], 0, 1e-9);
}

static void ends_with_the_best(void)
{
    problem p = {.wall = INFINITY, .end_at = 8};
    double x[] = {-1.2, 1};
    CHECK(solve(&p, -2, 2, x).outcome == KMP_SQUARES_ENDED);
    double valley_floor = 10 * (x[1] - x[0] * x[0]);
    CHECK((1 - x[0]) * (1 - x[0]) + valley_floor * valley_floor < 2.2 * 2.2 + 4.4 * 4.4);
    problem none = {.wall = -5};
    CHECK(solve(&none, -2, 2, x).outcome == KMP_SQUARES_NO_START);
    CHECK(none.calls == 1);
}

static void needs_the_library(void)
{
    problem p = {.wall = INFINITY};
    double x[] = {-1.2, 1}, lower[] = {-2, -2}, upper[] = {2, 2};
    const kmp_squares squares = {
        .rows = 3, .count = 2, .lower = lower, .upper = upper, .tolerance = 1e-12, .most = 9, .at = valley, .user = &p};
    kmp_squares_report report;
    CHECK(kmp_squares_minimise(&squares, x, &report) == kmp_squares_available);
    CHECK(!kmp_squares_available || report.outcome == KMP_SQUARES_MOST);
}

int main(void)
{
    TEST(needs_the_library);
    if (!kmp_squares_available)
        return check_report();
    TEST(finds_the_minimum);
    TEST(stops_at_bounds);
    TEST(leaves_a_bound);
    TEST(shortens_steps);
    TEST(ends_with_the_best);
    return check_report();
}
