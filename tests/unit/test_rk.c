/* SPDX-License-Identifier: BSD-3-Clause */
/* DOP853 and DOPRI5: the tableaus, the orders of solution and dense output, step-size control, and what the formulation
 * says.
 */
#include "base/memory.h"
#include "integrators/steppers/rk.h"
#include "testing.h"

/* The one that the tests run, what it must do, and how hard it may work. */
static const kmp_solver_kind *kind;
static const kmp_rk_method *method;
static int extra_stages;
static long arenstorf_steps;
static double coarse_error;

static const double tight[8] = {1e-12, 1e-12, 1e-12, 1e-12, 1e-12, 1e-12, 1e-12, 1e-12};

static kmp_rk *make(const kmp_ode *ode, double rtol, const double *atol)
{
    return kind->create(kind, &(kmp_solver_setup){.ode = ode, .tolerance = {rtol, atol}});
}

/* -- a nonlinear problem with a known solution: y = exp(s), exp(5 s), s + 1, cos(t^2), s = sin(t^2) -- */

static int curve(void *self, double t, const double *y, double *dy)
{
    (void)self;
    dy[0] = 2 * t * pow(y[1], 0.2) * y[3];
    dy[1] = 10 * t * exp(5 * (y[2] - 1)) * y[3];
    dy[2] = 2 * t * y[3];
    dy[3] = -2 * t * log(y[0]);
    return KMP_GO;
}

static void curve_at(double t, double *y)
{
    double s = sin(t * t);
    y[0] = exp(s);
    y[1] = exp(5 * s);
    y[2] = s + 1;
    y[3] = cos(t * t);
}

static double distance(const double *y, double t)
{
    double exact[4], worst = 0;
    curve_at(t, exact);
    for (int i = 0; i < 4; i++)
        worst = check_max(worst, fabs(y[i] - exact[i]) / exact[1]);
    return worst;
}

/* n equal steps over [0.3, 1.1]: error at the end, and of the dense output anywhere. */
static void equal_steps(int n, double *at_end, double *within)
{
    const double loose[4] = {1e3, 1e3, 1e3, 1e3};
    kmp_ode ode = {.n = 4, .rhs = curve};
    kmp_rk *s = make(&ode, 1, loose);
    double y[4], t = 0.3, h = 0.8 / n;
    curve_at(t, y);
    *within = 0;
    for (int k = 1; k <= n; k++) {
        double t1 = 0.3 + h * k, middle[4];
        CHECK(kmp_rk_start(s, t, y, NULL, t1, h) == KEMPE_OK);
        CHECK(kmp_rk_step(s) == KEMPE_OK && s->base.t == t1);
        for (int j = 1; j < 8; j++) {
            double tm = t + (t1 - t) * j / 8;
            CHECK(kmp_rk_dense(s, tm, middle, NULL) == KEMPE_OK);
            *within = fmax(*within, distance(middle, tm));
        }
        memcpy(y, s->y, sizeof y);
        t = t1;
    }
    *at_end = distance(y, t);
    kind->release(s);
}

static void test_orders(void)
{
    double end[3], within[3];
    for (int i = 0; i < 3; i++)
        equal_steps((method->numbers.order > 5 ? 6 : 96) << i, &end[i], &within[i]);
    double order = log2(end[0] / end[1]), dense = log2(within[0] / within[1]);
    printf("  order %.2f, %.2f; dense %.2f, %.2f\n", order, log2(end[1] / end[2]), dense, log2(within[1] / within[2]));
    CHECK(order > method->numbers.order - 0.5 && order < method->numbers.order + 1.5);
    CHECK(dense > method->numbers.order - 1.2 &&
          dense < method->numbers.order + 1.2); /* one order less, one more locally */
    CHECK(end[1] < coarse_error);
}

/* With dy = 1 and y = t at the start, y is t in every stage where the row of the tableau sums to c. */
static int unit_slope(void *self, double t, const double *y, double *dy)
{
    double *worst = self;
    *worst = fmax(*worst, fabs(y[0] - t));
    dy[0] = 1;
    return KMP_GO;
}

static void test_rows_sum_to_the_nodes(void)
{
    double worst = 0, y = 0.25;
    kmp_ode ode = {.n = 1, .self = &worst, .rhs = unit_slope};
    kmp_rk *s = make(&ode, 1e-8, tight);
    kmp_rk_start(s, 0.25, &y, NULL, 1.25, 1.0);
    CHECK(kmp_rk_step(s) == KEMPE_OK);
    CHECK(kmp_rk_dense(s, 0.8125, &y, NULL) == KEMPE_OK);
    CHECK_NEAR(y, 0.8125, 1e-15);
    CHECK(worst < 2e-14);
    CHECK(s->base.work.rhs == method->numbers.end + extra_stages);
    kind->release(s);
}

/* -- Arenstorf's orbit (Hairer, Norsett, Wanner, II.0, (0.1), (0.2)) --------------------------------- */

static int arenstorf(void *self, double t, const double *y, double *dy)
{
    (void)self;
    (void)t;
    const double mu = 0.012277471, nu = 1 - mu;
    double a = y[0] + mu, b = y[0] - nu, yy = y[1] * y[1];
    double d1 = pow(a * a + yy, 1.5), d2 = pow(b * b + yy, 1.5);
    dy[0] = y[2];
    dy[1] = y[3];
    dy[2] = y[0] + 2 * y[3] - nu * a / d1 - mu * b / d2;
    dy[3] = y[1] - 2 * y[2] - nu * y[1] / d1 - mu * y[1] / d2;
    return KMP_GO;
}

static void test_arenstorf_closes(void)
{
    const double start[4] = {0.994, 0, 0, -2.00158510637908252240537862224}, period = 17.0652165601579625588917206249;
    kmp_ode ode = {.n = 4, .rhs = arenstorf};
    kmp_rk *s = make(&ode, 1e-12, tight);
    CHECK(kmp_rk_start(s, 0, start, NULL, period, 0) == KEMPE_OK);
    unsigned long before = kmp_memory_count();
    double y[4];
    while (s->base.t < period) {
        CHECK(kmp_rk_step(s) == KEMPE_OK);
        kmp_rk_dense(s, 0.5 * (s->base.t_old + s->base.t), y, NULL);
    }
    CHECK(kmp_memory_count() == before);
    CHECK(s->base.t == period);
    for (int i = 0; i < 2; i++)
        CHECK_NEAR(s->y[i], start[i], 1e-7);
    kmp_solver_work work = s->base.work;
    printf("  %ld steps, %ld rejected, %ld rhs; closes to %.1e\n", work.steps, work.rejected, work.rhs,
           hypot(s->y[0] - start[0], s->y[1]));
    CHECK(work.steps < arenstorf_steps && work.refused == 0);
    kind->release(s);
}

/* -- dense output at the ends, and of an ordinary run ------------------------------------------------ */

static void test_dense_output_of_a_run(void)
{
    kmp_ode ode = {.n = 4, .rhs = curve};
    kmp_rk *s = make(&ode, 1e-9, tight);
    double y[4], dense[4], worst = 0;
    curve_at(0, y);
    CHECK(kmp_rk_start(s, 0, y, NULL, 1.5, 0) == KEMPE_OK);
    CHECK(kmp_rk_dense(s, 0, dense, NULL) == KEMPE_OK && memcmp(y, dense, sizeof y) == 0);
    while (s->base.t < 1.5) {
        memcpy(y, s->y, sizeof y);
        CHECK(kmp_rk_step(s) == KEMPE_OK);
        double t0 = s->base.t_old, t1 = s->base.t;
        kmp_rk_dense(s, t0, dense, NULL);
        CHECK(memcmp(y, dense, sizeof y) == 0);
        kmp_rk_dense(s, nextafter(t1, t0), dense, NULL);
        for (int i = 0; i < 4; i++)
            CHECK_NEAR(dense[i], s->y[i], 1e-14);
        kmp_rk_dense(s, t0 + 0.3 * (t1 - t0), dense, NULL);
        worst = check_max(worst, distance(dense, t0 + 0.3 * (t1 - t0)));
    }
    printf("  within the steps: %.1e\n", worst);
    CHECK(worst < 1e-7);
    kind->release(s);
}

/* -- what the formulation says ------------------------------------------------------------------------------ */

typedef struct formulation {
    double last_rhs_t, wall;
    int accepted, refuse_at, halt_at, always_refuse;
    bool order_kept;
} formulation;

static int decay(void *self, double t, const double *y, double *dy)
{
    formulation *r = self;
    r->last_rhs_t = t;
    if (t > r->wall)
        return KMP_RETRY;
    dy[0] = -y[0];
    return KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    formulation *r = self;
    r->order_kept = r->order_kept && r->last_rhs_t == t && dy[0] == -y[0] && w[0] > 0;
    if (r->always_refuse)
        return KMP_RETRY;
    if (++r->accepted == r->refuse_at)
        return KMP_RETRY;
    if (r->accepted == r->halt_at)
        return KMP_HALT;
    y[0] += 1e-13;
    return KMP_GO;
}

static kmp_rk *start_decay(formulation *r, double h0)
{
    kmp_ode ode = {.n = 1, .self = r, .rhs = decay, .accept = accept};
    kmp_rk *s = make(&ode, 1e-10, tight);
    double y = 1;
    r->order_kept = true;
    CHECK(kmp_rk_start(s, 0, &y, NULL, 2, h0) == KEMPE_OK);
    return s;
}

static void test_accept_sees_and_corrects(void)
{
    formulation r = {.wall = 9};
    kmp_rk *s = start_decay(&r, 0);
    while (s->base.t < 2)
        CHECK(kmp_rk_step(s) == KEMPE_OK);
    CHECK(r.order_kept && r.accepted == s->base.work.steps);
    CHECK_NEAR(s->y[0], exp(-2), 1e-10);
    CHECK(s->y[0] + s->dy[0] != 0); /* y corrected, dy as evaluated */
    CHECK_NEAR(s->dy[0], -exp(-2), 1e-10);
    kind->release(s);
}

static void test_refused_steps_are_halved(void)
{
    formulation r = {.wall = 9, .refuse_at = 2};
    kmp_rk *s = start_decay(&r, 0.001);
    CHECK(kmp_rk_step(s) == KEMPE_OK && s->base.t == 0.001);
    CHECK(kmp_rk_step(s) == KEMPE_OK);
    double grown = 0.001 * method->numbers.grow;
    CHECK_NEAR(s->base.t, 0.001 + grown / 2, 1e-14); /* full growth, then half */
    CHECK(kmp_rk_step(s) == KEMPE_OK);
    CHECK_NEAR(s->base.t - s->base.t_old, grown / 2, 1e-14); /* none right after */
    CHECK(s->base.work.refused == 1 && s->base.work.rejected == 0);
    kind->release(s);
}

static void test_wall_is_approached_and_reported(void)
{
    formulation r = {.wall = 1};
    kmp_rk *s = start_decay(&r, 0);
    kempe_status said = KEMPE_OK;
    while (said == KEMPE_OK && s->base.t < 2)
        said = kmp_rk_step(s);
    CHECK(said == KEMPE_E_FAILED);
    CHECK_NEAR(s->base.t, 1, 1e-12);
    CHECK_NEAR(s->y[0], exp(-1), 1e-9);
    CHECK(s->base.work.refused > 0);
    kind->release(s);
}

static void test_halt_and_endless_refusal(void)
{
    formulation r = {.wall = 9, .halt_at = 3};
    kmp_rk *s = start_decay(&r, 0);
    CHECK(kmp_rk_step(s) == KEMPE_OK && kmp_rk_step(s) == KEMPE_OK);
    double y = s->y[0], t = s->base.t, dense;
    CHECK(kmp_rk_step(s) == KEMPE_E_FAILED);
    CHECK(s->base.t == t && s->y[0] == y);
    CHECK(kmp_rk_dense(s, t, &dense, NULL) == KEMPE_OK && dense == y);
    CHECK_NEAR(s->dy[0], -y, 1e-12);
    kind->release(s);
    formulation stubborn = {.wall = 9, .always_refuse = 1};
    s = start_decay(&stubborn, 0);
    CHECK(kmp_rk_step(s) == KEMPE_E_FAILED);
    CHECK(s->base.t == 0);
    kind->release(s);
}

static int nan_beyond_half(void *self, double t, const double *y, double *dy)
{
    (void)self;
    dy[0] = t > 0.5 ? NAN : y[0];
    return KMP_GO;
}

static void test_nan_is_a_rejection(void)
{
    kmp_ode ode = {.n = 1, .rhs = nan_beyond_half};
    kmp_rk *s = make(&ode, 1e-8, tight);
    double y = 1;
    kmp_rk_start(s, 0, &y, NULL, 1, 0.4);
    kempe_status said = KEMPE_OK;
    while (said == KEMPE_OK && s->base.t < 1)
        said = kmp_rk_step(s);
    CHECK(said == KEMPE_E_FAILED && isfinite(s->y[0]));
    CHECK(s->base.t > 0.49 && s->base.t <= 0.5);
    kind->release(s);
}

static int nothing(void *self, double t, const double *y, double *dy)
{
    (void)self;
    (void)t;
    (void)y;
    (void)dy;
    return KMP_GO;
}

static void test_no_unknowns(void)
{
    kmp_ode ode = {.n = 0, .rhs = nothing};
    kmp_rk *s = make(&ode, 1e-8, tight);
    double none;
    CHECK(kmp_rk_start(s, 0, &none, NULL, 1, 0) == KEMPE_OK);
    int steps = 0;
    while (s->base.t < 1 && steps++ < 100)
        CHECK(kmp_rk_step(s) == KEMPE_OK);
    CHECK(s->base.t == 1);
    kind->release(s);
}

static void run_all(void)
{
    TEST(test_orders);
    TEST(test_rows_sum_to_the_nodes);
    TEST(test_arenstorf_closes);
    TEST(test_dense_output_of_a_run);
    TEST(test_accept_sees_and_corrects);
    TEST(test_refused_steps_are_halved);
    TEST(test_wall_is_approached_and_reported);
    TEST(test_halt_and_endless_refusal);
    TEST(test_nan_is_a_rejection);
    TEST(test_no_unknowns);
}

int main(void)
{
    printf("dop853\n");
    kind = &kmp_solver_dop853;
    method = kind->method;
    extra_stages = 3;
    arenstorf_steps = 400;
    coarse_error = 1e-9;
    run_all();
    printf("dopri5\n");
    kind = &kmp_solver_dopri5;
    method = kind->method;
    extra_stages = 0;
    arenstorf_steps = 3000;
    coarse_error = 1e-8;
    run_all();
    return check_report();
}
