/* SPDX-License-Identifier: BSD-3-Clause */
/* Radau IIA of fixed orders for stiff motion: orders by halving steps, with one Jacobian and with those of all stages,
 * dense output, van der Pol's equation, how long a Jacobian is kept. */
#include "integrators/steppers/collocation.h"
#include "testing.h"
#include <stdlib.h>

/* -- orders ------------------------------------------------------------------------------------------- */

/* x'' = 2 x^3, w' = x^2: x = 1 / (1 + t), w = 1 - x. */
static int fall(void *self, double t, const double *y, double *dy)
{
    (void)self, (void)t;
    dy[0] = y[1];
    dy[1] = 2 * y[0] * y[0] * y[0];
    dy[2] = y[0] * y[0];
    return KMP_GO;
}

static int fall_jacobian(void *self, double t, const double *y, double *j)
{
    (void)self, (void)t;
    j[1] = 6 * y[0] * y[0];
    j[2] = 2 * y[0];
    j[3] = 1;
    return KMP_GO;
}

static double off(const double *y, double t)
{
    double x = 1 / (1 + t);
    return fmax(fabs(y[0] - x), fmax(fabs(y[1] + x * x), fabs(y[2] - 1 + x)));
}

/* The places in a step at which dense output is evaluated. */
#define INSIDE 0.75

typedef struct fixed {
    const kmp_solver_kind *kind;
    kmp_collocation *s;
    kmp_iteration iteration;
} fixed;

/* The worst errors over (0, 2) with `steps` equal ones: of their ends, and inside of them when each begins anew from
 * the solution. */
static void walk(const fixed *f, int steps, bool apart, double *end, double *middle)
{
    double h = 2.0 / steps, y[3] = {1, -1, 0};
    *end = *middle = 0;
    for (int k = 0; k < steps; k++) {
        double t = k * h, x = 1 / (1 + t), inside[3];
        if (apart)
            y[0] = x, y[1] = -x * x, y[2] = 1 - x;
        CHECK(f->kind->start(f->s, t, y, NULL, 9, h) == KEMPE_OK);
        kmp_collocation_begin_with(f->s, f->iteration);
        CHECK(f->kind->step(f->s) == KEMPE_OK);
        CHECK_NEAR(f->s->base.t, t + h, 1e-14);
        CHECK(f->kind->dense(f->s, t + INSIDE * h, inside, NULL) == KEMPE_OK);
        CHECK(f->kind->dense(f->s, t + h, y, NULL) == KEMPE_OK);
        *end = fmax(*end, off(y, t + h));
        *middle = fmax(*middle, off(inside, t + INSIDE * h));
    }
}

/* `eliminates`: the problem says which unknowns are derivatives, and which nothing depends on. */
static void check_orders(const char *name, int stages, int steps, bool together, bool eliminates)
{
    static const double loose[3] = {1, 1, 1};
    kempe_context *context = kempe_context_new();
    kmp_ode ode = {.n = 3, .rhs = fall, .jacobian = fall_jacobian, .positions = eliminates, .quadratures = eliminates};
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-2, loose}, .linear = "auto"};
    fixed f = {.kind = kmp_solver_find(name), .iteration = together ? KMP_ITERATION_COUPLED : KMP_ITERATION_NEWTON};
    f.s = f.kind->create(f.kind, &setup);
    f.s->limit =
        together ? 1e-16 : 1e-14; /* steps by no tolerance, stages to rounding; quadratures are a sweep behind */
    f.s->most_sweeps = 40;
    double end[2], middle[2], unused;
    for (int k = 0; k < 2; k++) {
        walk(&f, steps << k, false, &end[k], &unused);
        walk(&f, steps << (k + 1), true, &unused, &middle[k]);
    }
    double order = log2(end[0] / end[1]), inside = log2(middle[0] / middle[1]);
    printf("  %s %s%s: order %.2f (%.1e, %.1e), inside one step %.2f\n", name, together ? "all stages" : "one Jacobian",
           eliminates ? ", eliminated" : "", order, end[0], end[1], inside);
    CHECK(fabs(order - (2 * stages - 1)) < 0.3 && fabs(inside - (stages + 2)) < 0.4);
    f.kind->release(f.s);
    kempe_context_free(context);
}

static void test_orders(void)
{
    for (int way = 0; way < 4; way++) {
        check_orders("radau5", 3, 16, way & 1, way & 2);
        check_orders("radau9", 5, 12, way & 1, way & 2);
    }
}

/* -- linear systems ---------------------------------------------------------------------------------- */

/* Two stiffly coupled oscillators, pushed; the last two unknowns are integrals. */
static const double stiff[2][4] = {{-3e4, 1e4, -500, 100}, {2e4, -7e4, 200, -900}};
static const double of_integrals[2][4] = {{1, -2, 0.5, 0}, {0, 3, 0, -1}};

static int push(void *self, double t, const double *y, double *dy)
{
    (void)self;
    for (int i = 0; i < 2; i++) {
        dy[i] = y[2 + i];
        dy[2 + i] = (1 + i) * cos(t);
        dy[4 + i] = t;
        for (int k = 0; k < 4; k++) {
            dy[2 + i] += stiff[i][k] * y[k];
            dy[4 + i] += of_integrals[i][k] * y[k];
        }
    }
    return KMP_GO;
}

static int push_jacobian(void *self, double t, const double *y, double *j)
{
    (void)self, (void)t, (void)y;
    for (int i = 0; i < 2; i++) {
        j[i + (2 + i) * 6] = 1;
        for (int k = 0; k < 4; k++) {
            j[2 + i + k * 6] = stiff[i][k];
            j[4 + i + k * 6] = of_integrals[i][k];
        }
    }
    return KMP_GO;
}

/* The first iteration solves it, the second sees that: any mistake in a matrix or in its elimination takes more. */
static void check_two_iterations(const char *name, bool together, bool eliminates)
{
    kempe_context *context = kempe_context_new();
    const kmp_solver_kind *kind = kmp_solver_find(name);
    double atol[6] = {1e4, 1e4, 1e4, 1e4, 1e4, 1e4}, y[6] = {1, 0, 0, 1, 0, 0};
    kmp_ode ode = {.n = 6,
                   .rhs = push,
                   .jacobian = push_jacobian,
                   .positions = eliminates ? 2 : 0,
                   .quadratures = eliminates ? 2 : 0};
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-2, atol}, .linear = "auto"};
    kmp_collocation *s = kind->create(kind, &setup);
    s->limit = 1e-9;
    for (int k = 0; k < 10; k++) {
        CHECK(kind->start(s, 0.1 * k, y, NULL, 9, 0.01 * (1 + k)) == KEMPE_OK);
        kmp_collocation_begin_with(s, together ? KMP_ITERATION_COUPLED : KMP_ITERATION_NEWTON);
        CHECK(kind->step(s) == KEMPE_OK);
        CHECK(kind->dense(s, s->base.t, y, NULL) == KEMPE_OK);
    }
    kmp_solver_work w = s->base.work;
    printf("  %s %s%s: %ld iterations, %ld steps\n", name, together ? "all stages" : "one Jacobian",
           eliminates ? ", eliminated" : "", w.newton, w.steps);
    CHECK(w.steps == 10 && w.newton == 2 * w.steps && w.rejected + w.refused == 0);
    kind->release(s);
    kempe_context_free(context);
}

static void test_two_iterations(void)
{
    for (int way = 0; way < 4; way++) {
        check_two_iterations("radau5", way & 1, way & 2);
        check_two_iterations("radau9", way & 1, way & 2);
    }
}

/* -- stiff problems ----------------------------------------------------------------------------------- */

#define STIFF 1e6

/* Van der Pol's equation, x' = v, v' = ((1 - x^2) v - x) k, from (2, 0) to 2: digits of the test set for initial value
 * problems (Mazzia and Magherini, release 2.4). */
static int van_der_pol(void *self, double t, const double *y, double *dy)
{
    (void)self, (void)t;
    dy[0] = y[1];
    dy[1] = ((1 - y[0] * y[0]) * y[1] - y[0]) * STIFF;
    return KMP_GO;
}

static int van_der_pol_jacobian(void *self, double t, const double *y, double *j)
{
    int *count = self;
    (void)t;
    ++*count;
    j[1] = (-2 * y[0] * y[1] - 1) * STIFF;
    j[2] = 1;
    j[3] = (1 - y[0] * y[0]) * STIFF;
    return KMP_GO;
}

static void check_van_der_pol(const char *name, double rtol, double most, bool exact)
{
    kempe_context *context = kempe_context_new();
    const kmp_solver_kind *kind = kmp_solver_find(name);
    double atol[2] = {rtol, rtol}, y[2] = {2, 0};
    int count = 0;
    kmp_ode ode = {.n = 2,
                   .self = &count,
                   .rhs = van_der_pol,
                   .jacobian = exact ? van_der_pol_jacobian : NULL,
                   .positions = exact};
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {rtol, atol}, .linear = "auto"};
    kmp_solver *s = kind->create(kind, &setup);
    CHECK(kind->start(s, 0, y, NULL, 2, 0) == KEMPE_OK);
    while (s->t < 2 && kind->step(s) == KEMPE_OK)
        ;
    CHECK(s->t == 2 && kind->dense(s, 2, y, NULL) == KEMPE_OK);
    kmp_solver_work w = s->work;
    double worst = fmax(fabs(y[0] / 1.706167732170483 - 1), fabs(y[1] / -0.8928097010247975 - 1));
    printf("  van der Pol, %s %.0e%s: off %.1e, %ld steps, %ld rejected, %ld refused, %ld rhs, %ld Jacobians\n", name,
           rtol, exact ? "" : ", differences", worst, w.steps, w.rejected, w.refused, w.rhs, w.matrices);
    CHECK(worst < most && w.steps < 2500);
    CHECK(!exact || w.matrices == count);
    CHECK(w.matrices < (exact ? 5 : 1) * w.steps && w.factorizations <= w.steps + w.rejected + w.refused);
    kind->release(s);
    kempe_context_free(context);
}

static void test_van_der_pol(void)
{
    for (int exact = 0; exact < 2; exact++) {
        check_van_der_pol("radau5", 1e-7, 1e-5, exact);
        check_van_der_pol("radau9", 1e-7, 1e-5, exact);
        check_van_der_pol("radau9", 1e-10, 1e-8, exact);
    }
}

/* Prothero and Robinson's problem: all of the solution is smooth, all of the problem stiff. The estimate sees nothing
 * of it, yet ends and middles of steps are good to what the tolerance stands for. */
static int linear(void *self, double t, const double *y, double *dy)
{
    const double *k = self;
    dy[0] = -*k * (y[0] - cos(t)) - sin(t);
    return KMP_GO;
}

static int linear_jacobian(void *self, double t, const double *y, double *j)
{
    const double *k = self;
    (void)t, (void)y;
    j[0] = -*k;
    return KMP_GO;
}

static void test_linear(void)
{
    for (int k = 0; kmp_solver_get(k); k++) {
        const kmp_solver_kind *kind = kmp_solver_get(k);
        if (strncmp(kind->name, "radau", 5) != 0 || !kind->implicit)
            continue;
        long steps[3];
        double most = 0;
        for (int decade = 0; decade < 3; decade++) {
            kempe_context *context = kempe_context_new();
            double rate = pow(10, 4 + 2 * decade), atol = 1e-9, y = 1, worst = 0;
            kmp_ode ode = {.n = 1, .self = &rate, .rhs = linear, .jacobian = linear_jacobian};
            kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-9, &atol}, .linear = "auto"};
            kmp_solver *s = kind->create(kind, &setup);
            CHECK(kind->start(s, 0, &y, NULL, 20, 0) == KEMPE_OK);
            while (s->t < 20 && kind->step(s) == KEMPE_OK) {
                CHECK(kind->dense(s, s->t, &y, NULL) == KEMPE_OK);
                worst = check_max(worst, fabs(y - cos(s->t)));
                double middle = 0.5 * (s->t_old + s->t);
                CHECK(kind->dense(s, middle, &y, NULL) == KEMPE_OK);
                worst = check_max(worst, fabs(y - cos(middle)));
            }
            kmp_solver_work w = s->work;
            steps[decade] = w.steps;
            most = check_max(most, worst);
            CHECK(s->t == 20 && worst < 1e-6 && w.matrices == 1);
            kind->release(s);
            kempe_context_free(context);
        }
        printf("  Prothero and Robinson, %s: %ld, %ld, %ld steps, off %.1e at most\n", kind->name, steps[0], steps[1],
               steps[2], most);
        CHECK(labs(steps[2] - steps[0]) <= 5); /* however stiff */
    }
}

int main(void)
{
    TEST(test_orders);
    TEST(test_two_iterations);
    TEST(test_van_der_pol);
    TEST(test_linear);
    return check_report();
}
