/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps across singular places, on equations whose right-hand side is 0/0 at one time while their solution is smooth,
 * or turns close by. */
#include "integrators/steppers/singular_step.h"
#include "testing.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* q'' = acceleration(t), with the rounding of a 0/0 of third order at t = 1 where nothing is left out of it */
typedef struct law {
    double (*acceleration)(double t);
    double (*distance)(double t); /* NULL: |t - 1| */
    double nearest;
    long evaluations;
} law;

static double noisy(const law *l, double t)
{
    double d = t - 1;
    return (l->acceleration(t) * d * d * d + DBL_EPSILON * sin(1e9 * t)) / (d * d * d);
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    law *l = self;
    dy[0] = y[1];
    dy[1] = l->acceleration(t);
    l->evaluations++;
    return KMP_GO;
}

static int closed(void *self, double t, double *y, bool as_it_is, double *dy, double *distance)
{
    law *l = self;
    (void)as_it_is;
    l->nearest = dy ? fmin(l->nearest, fabs(t - 1)) : l->nearest;
    if (distance)
        *distance = l->distance ? l->distance(t) : fabs(t - 1);
    if (!dy)
        return KMP_GO;
    dy[0] = y[1];
    dy[1] = noisy(l, t);
    l->evaluations++;
    return isfinite(dy[1]) ? KMP_GO : KMP_RETRY;
}

static double swing(double t)
{
    return cos(3 * t);
}

/* of q = sqrt((t - 1)^2 + 1e-6), which goes straight until a thousandth before t = 1 */
static double corner(double t)
{
    double d = t - 1;
    return 1e-6 / pow(d * d + 1e-6, 1.5);
}

typedef struct crossing {
    law l;
    double atol[2], q, qd, nearest_t, nearest, end;
    bool made;
    double middle; /* q at t = 1, by dense output of the step over it */
} crossing;

/* One step. */
static void make_step(crossing *f, double t0, double q, double qd, double t_end)
{
    kmp_ode ode = {.n = 2, .self = &f->l, .rhs = rhs, .closed = closed, .positions = 1};
    kempe_context *context = kempe_context_new();
    double y[2] = {q, qd};
    f->l.nearest = INFINITY;
    f->atol[0] = f->atol[1] = 1e-9;
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-9, f->atol}};
    const kmp_solver_kind *kind = &kmp_solver_singular_step;
    kmp_solver *solver = kind->create(kind, &setup);
    CHECK(solver && kind->start(solver, t0, y, NULL, t_end, 0) == KEMPE_OK);
    f->made = kind->step(solver) == KEMPE_OK;
    f->end = solver->t;
    CHECK(kind->dense(solver, f->end, y, NULL) == KEMPE_OK);
    f->q = y[0];
    f->qd = y[1];
    kmp_singular_step_nearest(solver, &f->nearest_t, &f->nearest);
    CHECK(!(f->end > 1) || kind->dense(solver, 1, y, NULL) == KEMPE_OK);
    f->middle = y[0];
    kind->release(solver);
    kempe_context_free(context);
}

static void check_swing(const crossing *f, double tolerance)
{
    CHECK(f->made && f->end > 1);
    CHECK_NEAR(f->q, -cos(3 * f->end) / 9, tolerance);
    CHECK_NEAR(f->qd, sin(3 * f->end) / 3, tolerance);
}

static void a_smooth_solution_is_crossed(void)
{
    for (int k = 0; k < 8; k++) { /* wherever it starts */
        double t0 = 0.85 + 0.02 * k;
        crossing f = {.l = {.acceleration = swing}};
        make_step(&f, t0, -cos(3 * t0) / 9, sin(3 * t0) / 3, 1.2);
        check_swing(&f, k < 4 ? 1e-11 : 1e-8);
        CHECK_NEAR(f.middle, -cos(3) / 9, k < 4 ? 1e-11 : 1e-8);
        CHECK(f.l.nearest > 1e-3); /* no node at the place */
        CHECK(fabs(f.nearest_t - 1) < 1e-6 && f.nearest < 1e-6);
    }
}

/* Its square has a corner at t = 1 and no curvature beside it: parabolas through three places on one side have no
 * vertex. */
static double root(double t)
{
    return sqrt(fabs(t - 1));
}

static void the_nearest_time_is_found_where_parabolas_fail(void)
{
    for (int k = 0; k < 8; k++) {
        double t0 = 0.9 + 0.01 * k;
        crossing f = {.l = {.acceleration = swing, .distance = root}};
        make_step(&f, t0, -cos(3 * t0) / 9, sin(3 * t0) / 3, 1.2);
        CHECK(f.made && f.end > 1);
        printf("  from %.2f to %.4f: %.1e off, distance %.1e\n", t0, f.end, f.nearest_t - 1, f.nearest);
        CHECK(fabs(f.nearest_t - 1) < 1e-12 && f.nearest < 1e-6);
    }
}

static void a_start_at_the_place_leads_away(void)
{
    crossing f = {.l = {.acceleration = swing}};
    make_step(&f, 1 + 1e-9, -cos(3) / 9, sin(3) / 3, 1.2);
    check_swing(&f, 1e-8);
}

/* No step is made, and the state is as it was. */
static void a_turn_is_not_crossed(void)
{
    crossing f = {.l = {.acceleration = corner}};
    double d = 0.15, q = sqrt(d * d + 1e-6);
    make_step(&f, 1 - d, q, -d / q, 1.2);
    CHECK(!f.made && f.end == 1 - d && f.q == q && f.qd == -d / q);
}

int main(void)
{
    TEST(a_smooth_solution_is_crossed);
    TEST(the_nearest_time_is_found_where_parabolas_fail);
    TEST(a_start_at_the_place_leads_away);
    TEST(a_turn_is_not_crossed);
    return check_report();
}
