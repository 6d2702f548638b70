/* SPDX-License-Identifier: BSD-3-Clause */
/* Every integrator of ODEs behind its socket, whatever it is made of: accuracy, dense output, starting anew, failing
 * right-hand sides, refusals, giving up; and a stiff problem for those that use a Jacobian. */
#include "base/memory.h"
#include "integrators/steppers/solver.h"
#include "testing.h"
#include <stdlib.h>

/* An oscillator with a slow drift of its frequency: y'' = -(1 + t/10)^2 y + .., solved by y = sin(t + t^2/20). */
typedef struct formulation {
    double wall;    /* the right-hand side fails beyond it at first */
    double fragile; /* and for a while whenever a step reaches further than this ahead of the last accepted one */
    double t;       /* of the last accepted step */
    int refuse_at, halt_at, accepted, failed;
    double nudge; /* accept corrects y by it */
} formulation;

static int oscillate(void *self, double t, const double *y, double *dy)
{
    formulation *r = self;
    double a = 1 + t / 10;
    if (t > r->wall || t > r->t + r->fragile) {
        r->failed++;
        return KMP_RETRY;
    }
    dy[0] = a * y[1];
    dy[1] = -a * y[0];
    return KMP_GO;
}

static int oscillate_jacobian(void *self, double t, const double *y, double *j)
{
    (void)self;
    (void)y;
    double a = 1 + t / 10;
    j[1] = -a;
    j[2] = a;
    return KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    formulation *r = self;
    CHECK_NEAR(dy[0], (1 + t / 10) * y[1], 1e-14);
    CHECK(w[0] > 0 && w[1] > 0);
    if (++r->accepted == r->refuse_at)
        return KMP_RETRY;
    if (r->accepted == r->halt_at)
        return KMP_HALT;
    r->t = t;
    y[0] += r->nudge;
    return KMP_GO;
}

static const double tight[3] = {1e-10, 1e-10, 1e-10};
static const double start_y[2] = {0, 1};
static kmp_ode ode;

static void *make(const kmp_solver_kind *kind, kempe_context *context, formulation *r, double rtol)
{
    ode = (kmp_ode){.n = 2, .self = r, .rhs = oscillate, .accept = accept, .jacobian = oscillate_jacobian};
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {rtol, tight}, .linear = "auto"};
    kmp_solver *s = kind->create(kind, &setup);
    CHECK(s != NULL);
    return s;
}

static kempe_status run_to(const kmp_solver_kind *kind, kmp_solver *s, double t_end)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; status == KEMPE_OK && s->t < t_end && k < 100000; k++)
        status = kind->step(s);
    return status;
}

static double miss(const kmp_solver_kind *kind, kmp_solver *s, double t)
{
    double y[2], phase = t + t * t / 20;
    CHECK(kind->dense(s, t, y, NULL) == KEMPE_OK);
    return fmax(fabs(y[0] - sin(phase)), fabs(y[1] - cos(phase)));
}

static double first_step(const kmp_solver_kind *kind)
{
    return kind->corrects ? 0 : 1e-5;
}

/* Another solver that receives the last step gives its values, to the bit or to rounding. */
static void check_transfer(const kmp_solver_kind *kind, kempe_context *context, formulation *r, kmp_solver *s)
{
    kmp_number_stream stream = {0};
    kmp_solver *other = make(kind, context, r, 1e-9);
    kind->transfer(s, &stream);
    size_t count = stream.count;
    double *numbers = malloc(count * sizeof *numbers), a[2], b[2];
    stream = (kmp_number_stream){.at = numbers};
    kind->transfer(s, &stream);
    CHECK(stream.count == count);
    stream = (kmp_number_stream){.at = numbers, .back = true};
    kind->transfer(other, &stream);
    CHECK(stream.count == count && other->t == s->t && other->t_old == s->t_old);
    for (int k = 0; k <= 8; k++) {
        double t = k == 8 ? s->t : s->t_old + k / 8.0 * (s->t - s->t_old);
        CHECK(kind->dense(s, t, a, NULL) == KEMPE_OK && kind->dense(other, t, b, NULL) == KEMPE_OK);
        CHECK(fabs(a[0] - b[0]) < 1e-14 && fabs(a[1] - b[1]) < 1e-14);
    }
    free(numbers);
    kind->release(other);
}

static void check_accuracy(const kmp_solver_kind *kind)
{
    kempe_context *context = kempe_context_new();
    formulation r = {.wall = 99, .fragile = 99};
    kmp_solver *s = make(kind, context, &r, 1e-9);
    long before = 0;
    for (int round = 0; round < 2; round++) {
        double worst = 0;
        r.t = 0;
        CHECK(kind->start(s, 0, start_y, NULL, 5, first_step(kind)) == KEMPE_OK);
        CHECK(s->t == 0 && s->t_old == 0 && miss(kind, s, 0) == 0);
        while (s->t < 5) {
            CHECK(kind->step(s) == KEMPE_OK);
            double t0 = s->t_old, t1 = s->t;
            for (int k = 0; k <= 4; k++)
                worst = check_max(worst, miss(kind, s, k == 4 ? t1 : t0 + 0.25 * k * (t1 - t0)));
        }
        kmp_solver_work w = s->work;
        check_transfer(kind, context, &r, s);
        CHECK(s->t == 5 && worst < 1e-6 && miss(kind, s, 5) < 1e-6);
        CHECK(w.steps > before && w.rhs > 0 && (round == 0 || w.steps == 2 * before));
        before = w.steps;
        if (round == 0)
            printf("  %-7s %4ld steps, %5ld rhs, off %.1e at the end, %.1e anywhere\n", kind->name, w.steps, w.rhs,
                   miss(kind, s, 5), worst);
    }
    kind->release(s);
    kempe_context_free(context);
}

/* Evaluations that fail when a step reaches too far: it is shortened, and the answer is right. */
static void check_failing(const kmp_solver_kind *kind)
{
    kempe_context *context = kempe_context_new();
    formulation r = {.wall = 99, .fragile = 0.012};
    kmp_solver *s = make(kind, context, &r, 1e-8);
    CHECK(kind->start(s, 0, start_y, NULL, 1, first_step(kind)) == KEMPE_OK);
    CHECK(run_to(kind, s, 1) == KEMPE_OK && s->t == 1);
    CHECK(r.failed > 0 && s->work.refused > 0);
    CHECK(miss(kind, s, 1) < 1e-6);
    kind->release(s);

    formulation walled = {.wall = 0.5, .fragile = 99};
    s = make(kind, context, &walled, 1e-8);
    CHECK(kind->start(s, 0, start_y, NULL, 1, first_step(kind)) == KEMPE_OK);
    CHECK(run_to(kind, s, 1) == KEMPE_E_FAILED);
    CHECK(s->t > 0.4 && s->t <= 0.5 && miss(kind, s, s->t) < 1e-6);
    kind->release(s);
    kempe_context_free(context);
}

static void check_say(const kmp_solver_kind *kind)
{
    kempe_context *context = kempe_context_new();
    formulation halting = {.wall = 99, .fragile = 99, .halt_at = 5};
    kmp_solver *s = make(kind, context, &halting, 1e-8);
    CHECK(kind->start(s, 0, start_y, NULL, 5, first_step(kind)) == KEMPE_OK);
    CHECK(run_to(kind, s, 5) == KEMPE_E_FAILED && halting.accepted == 5);
    kind->release(s);
    formulation r = {.wall = 99, .fragile = 99, .refuse_at = 3, .nudge = kind->corrects ? 1e-12 : 0};
    s = make(kind, context, &r, 1e-8);
    CHECK(kind->start(s, 0, start_y, NULL, 5, first_step(kind)) == KEMPE_OK);
    CHECK(run_to(kind, s, 5) == KEMPE_OK && s->work.refused == 1 && s->work.steps == r.accepted - 1 &&
          miss(kind, s, 5) < 1e-6);
    kind->release(s);
    kempe_context_free(context);
}

/* Steps allocate nothing of ours. */
static void check_allocations(const kmp_solver_kind *kind)
{
    kempe_context *context = kempe_context_new();
    formulation r = {.wall = 99, .fragile = 99};
    kmp_solver *s = make(kind, context, &r, 1e-8);
    CHECK(kind->start(s, 0, start_y, NULL, 5, first_step(kind)) == KEMPE_OK);
    unsigned long before = kmp_memory_count();
    CHECK(run_to(kind, s, 5) == KEMPE_OK && kmp_memory_count() == before);
    kind->release(s);
    kempe_context_free(context);
}

/* Prothero and Robinson: y' = -k (y - cos t) - sin t, y = cos t; explicit methods would need k steps a second. */
static int prothero(void *self, double t, const double *y, double *dy)
{
    (void)self;
    dy[0] = -1e6 * (y[0] - cos(t)) - sin(t);
    return KMP_GO;
}

static int prothero_jacobian(void *self, double t, const double *y, double *j)
{
    (void)self;
    (void)t;
    (void)y;
    j[0] = -1e6;
    return KMP_GO;
}

static void check_stiff(const kmp_solver_kind *kind)
{
    for (int exact = 0; exact < 2; exact++) { /* without a Jacobian it is made by differences */
        kempe_context *context = kempe_context_new();
        kmp_ode stiff = {.n = 1, .rhs = prothero, .jacobian = exact ? prothero_jacobian : NULL};
        kmp_solver_setup setup = {.context = context, .ode = &stiff, .tolerance = {1e-7, tight}, .linear = "auto"};
        kmp_solver *s = kind->create(kind, &setup);
        double y = 1;
        CHECK(kind->start(s, 0, &y, NULL, 3, 1e-7) == KEMPE_OK && run_to(kind, s, 3) == KEMPE_OK);
        CHECK(kind->dense(s, 3, &y, NULL) == KEMPE_OK);
        CHECK_NEAR(y, cos(3), 1e-6);
        kmp_solver_work w = s->work;
        CHECK(w.steps < 1500 && w.newton > 0 && w.matrices > 0 && w.factorizations > 0);
        kind->release(s);
        kempe_context_free(context);
    }
}

static void test_all(void)
{
    int kinds = 0;
    for (int k = 0; kmp_solver_get(k); k++) {
        const kmp_solver_kind *kind = kmp_solver_get(k);
        if (kind->dae)
            continue;
        int before = check_failures;
        check_accuracy(kind);
        check_failing(kind);
        check_say(kind);
        check_allocations(kind);
        if (kind->implicit)
            check_stiff(kind);
        if (check_failures > before)
            printf("  %s: wrong\n", kind->name);
        CHECK(kmp_solver_find(kind->name) == kind);
        kinds++;
    }
    CHECK(kinds >= 6);
}

int main(void)
{
    TEST(test_all);
    return check_report();
}
