/* SPDX-License-Identifier: BSD-3-Clause */
/* The runtime of generated simulators, on equations written by hand whose motions have closed forms. */
#include "exchange/simulator/kempe_simulator.h"
#include "integrators/friction/shared_contacts.h"
#include "testing.h"
#include "unit/simulated_mechanisms.h"

#include <stdbool.h>
#include <stdlib.h>

static double memory[4][8192];

static void begin_at(kempe_simulator *s, const kempe_equations *e, int place)
{
    CHECK(kempe_simulator_memory(e) <= 8192);
    kempe_simulator_init(s, e, memory[place]);
    s->settings.rtol = s->settings.atol = 1e-12;
}

#define GOES(call) CHECK_STATUS(s, call, KEMPE_SIMULATOR_GOES)
#define CHECK_STATUS(s, call, expected)                                                                                \
    do {                                                                                                               \
        kempe_simulator_status status = (call);                                                                        \
        CHECK(status == (expected));                                                                                   \
        if (status != (expected))                                                                                      \
            printf("  %s\n", (s)->message);                                                                            \
    } while (0)

/* -- periods ------------------------------------------------------------------------------------------- */

/* The complete elliptic integral K(k) by the arithmetic-geometric mean. */
static double elliptic(double k)
{
    double a = 1, b = sqrt(1 - k * k);
    for (int i = 0; i < 20; i++) {
        double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
    }
    return acos(-1) / (2 * a);
}

static const kempe_simulator_method both[] = {KEMPE_METHOD_DOP853, KEMPE_METHOD_DOPRI5};

/* Swings from the horizontal: T = 4 sqrt(L/g) K(sin(45 degrees)). */
static void pendulum_has_its_period(void)
{
    for (int i = 0; i < 2; i++) {
        kempe_simulator simulator, *s = &simulator;
        begin_at(s, &pendulum, 0);
        s->settings.method = both[i];
        GOES(kempe_simulator_start(s, 0));
        double period = 4 * sqrt(PENDULUM_LENGTH / GRAVITY) * elliptic(sqrt(0.5));
        GOES(kempe_simulator_advance(s, 10 * period));
        CHECK_NEAR(s->q[0], PENDULUM_LENGTH, 1e-10);
        CHECK_NEAR(s->q[1], 0, 1e-10);
        CHECK(s->work.exchanges >= 30);
        CHECK_NEAR(hypot(s->q[0], s->q[1]), PENDULUM_LENGTH, 1e-15);
        GOES(kempe_simulator_advance(s, 10.25 * period));
        CHECK_NEAR(s->qd[0], -sqrt(2 * GRAVITY * PENDULUM_LENGTH), 1e-10);
        CHECK_NEAR(s->lambda[0] * 2 * -PENDULUM_LENGTH, 3 * PENDULUM_MASS * GRAVITY, 1e-10);
        printf("  %g steps, %g rejected, %g evaluations, %g closings, %g exchanges\n", s->work.steps, s->work.rejected,
               s->work.evaluations, s->work.closings, s->work.exchanges);
    }
}

/* -- other mechanisms -------------------------------------------------------------------------------------- */

/* theta, x and the reduced mass and potential of the slider-crank at phi. */
static double crank_energy(double phi, double rate, double *x)
{
    double theta = -asin(CRANK * sin(phi) / ROD), turn = -CRANK * cos(phi) / (ROD * cos(theta));
    double slide = -CRANK * sin(phi) - ROD * sin(theta) * turn, between = ROD_MASS * CRANK * ROD / 2;
    double mass = CRANK_MASS * CRANK * CRANK / 3 + ROD_MASS * CRANK * CRANK + ROD_MASS * ROD * ROD / 4 * turn * turn +
                  2 * between * cos(phi - theta) * turn + SLIDER_MASS * slide * slide;
    double height = (CRANK_MASS / 2 + ROD_MASS) * CRANK * sin(phi) + ROD_MASS * ROD / 2 * sin(theta);
    *x = CRANK * cos(phi) + ROD * cos(theta);
    return rate > 0 ? mass / 2 * rate * rate + GRAVITY * height
                    : sqrt(mass / 2 / (-rate - GRAVITY * height)); /* -rate: the energy; 1 over the rate */
}

/* Full turns: the time of one is an integral of a periodic function, which the trapezoidal rule finds to rounding. */
static void crank_turns_in_its_time(void)
{
    double x, energy = crank_energy(0.4, SPIN, &x), turn = 0;
    enum { POINTS = 400 };
    for (int i = 0; i < POINTS; i++)
        turn += crank_energy(2 * acos(-1) * i / POINTS, -energy, &x) * 2 * acos(-1) / POINTS;
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &slider_crank, 0);
    s->settings.rtol = 1e-14;
    GOES(kempe_simulator_start(s, 0));
    CHECK(s->qd[0] == SPIN);
    GOES(kempe_simulator_advance(s, 5 * turn));
    CHECK_NEAR(s->q[0], 0.4 + 10 * acos(-1), 1e-10);
    CHECK_NEAR(s->qd[0], SPIN, 1e-10);
    (void)crank_energy(0.4, 1, &x);
    CHECK_NEAR(s->q[2], x, 1e-10);
    printf("  %g steps, %g exchanges\n", s->work.steps, s->work.exchanges);
}

/* A pendulum: rockers of a parallelogram swing as one does. */
static void redundant_rows_are_left_out(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &parallelogram, 0);
    GOES(kempe_simulator_start(s, 0));
    double swing = acos(-1) / 2 - 0.6, period = 4 * sqrt(ROCKER / GRAVITY) * elliptic(sin(swing / 2));
    GOES(kempe_simulator_advance(s, 7 * period));
    for (int i = 0; i < 4; i++)
        CHECK_NEAR(s->q[i], parallelogram_start[i], 1e-10);
    int zero = 0;
    for (int i = 0; i < 4; i++)
        zero += s->lambda[i] == 0;
    CHECK(zero >= 1);
    printf("  %g steps, %g rejected\n", s->work.steps, s->work.rejected);
}

/* Loops that are apart are solved apart if the zeros of J and M are known. The motion is the same. */
static void structure_does_not_change_the_motion(void)
{
    kempe_simulator simulators[2], *s = &simulators[0], *other = &simulators[1];
    begin_at(s, &pair, 0);
    begin_at(other, &structured_pair, 1);
    for (int i = 0; i < 2; i++) {
        CHECK_STATUS(&simulators[i], kempe_simulator_start(&simulators[i], 0), KEMPE_SIMULATOR_GOES);
        CHECK_STATUS(&simulators[i], kempe_simulator_advance(&simulators[i], 4), KEMPE_SIMULATOR_GOES);
    }
    CHECK(s->part.blocks == 1 && other->part.blocks == 2);
    for (int i = 0; i < 6; i++) {
        CHECK_NEAR(other->q[i], s->q[i], 1e-9);
        CHECK_NEAR(other->qdd[i], s->qdd[i], 1e-8);
    }
}

static void driven_crank_follows_its_drive(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &driven_crank, 0);
    GOES(kempe_simulator_start(s, 0));
    for (int i = 1; i < 30; i++) {
        double t = 0.1 * i;
        double phi = 0.4 + SPIN * t, theta = -asin(CRANK * sin(phi) / ROD);
        GOES(kempe_simulator_advance(s, t));
        CHECK_NEAR(s->q[0], phi, 1e-15);
        CHECK_NEAR(s->q[1], theta, 1e-14);
        CHECK_NEAR(s->qd[2], -CRANK * SPIN * sin(phi) + CRANK * SPIN * cos(phi) * tan(theta), 1e-13);
    }
    CHECK(s->work.steps < 500);
    printf("  %g steps, %g rejected\n", s->work.steps, s->work.rejected);
}

static void forces_depend_on_multipliers(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &block, 0);
    GOES(kempe_simulator_start(s, 0));
    GOES(kempe_simulator_advance(s, 1.5));
    double along = GRAVITY * (sin(SLOPE) - RUB * cos(SLOPE)) * 1.5 * 1.5 / 2;
    CHECK_NEAR(s->q[0], along * cos(SLOPE), 1e-13);
    CHECK_NEAR(s->q[1], -along * sin(SLOPE), 1e-13);
    CHECK_NEAR(s->lambda[0], -2 * GRAVITY * cos(SLOPE), 1e-13);
}

/* -- events ------------------------------------------------------------------------------------------------ */

static void spring_switches(void)
{
    kempe_simulator simulator, *s = &simulator;
    for (int i = 0; i < 2; i++) {
        begin_at(s, &spring, 0);
        s->settings.method = both[i];
        GOES(kempe_simulator_start(s, 0));
        double period = acos(-1) / sqrt(SOFT) + acos(-1) / sqrt(STIFF);
        GOES(kempe_simulator_advance(s, 10 * period));
        CHECK_NEAR(s->q[0], 1, 1e-10);
        CHECK_NEAR(s->qd[0], 0, 1e-10);
        CHECK(s->work.events == 20);
        GOES(kempe_simulator_advance(s, 10 * period + acos(-1) / sqrt(SOFT) / 2 + acos(-1) / sqrt(STIFF) / 2));
        CHECK_NEAR(s->q[0], -sqrt(SOFT / STIFF), 1e-10);
        printf("  %g steps, %g evaluations\n", s->work.steps, s->work.evaluations);
    }
}

/* Kinks are located like events, without being some: as many steps as with a condition. An integrator of the caller has
 * the equations follow them. */
static void kinks_are_located(void)
{
    kempe_simulator simulators[2], *s = &simulators[0], *other = &simulators[1];
    double period = acos(-1) / sqrt(SOFT) + acos(-1) / sqrt(STIFF);
    const double beyond[2] = {-0.1, 0};
    double dx[2];
    begin_at(s, &kinked, 0);
    begin_at(other, &spring, 1);
    GOES(kempe_simulator_start(s, 0));
    CHECK_STATUS(other, kempe_simulator_start(other, 0), KEMPE_SIMULATOR_GOES);
    GOES(kempe_simulator_advance(s, 10 * period));
    CHECK_STATUS(other, kempe_simulator_advance(other, 10 * period), KEMPE_SIMULATOR_GOES);
    CHECK_NEAR(s->q[0], 1, 1e-10);
    CHECK_NEAR(s->qd[0], 0, 1e-10);
    CHECK(s->work.events == 0 && s->work.steps <= 1.05 * other->work.steps);
    GOES(kempe_simulator_set_states(s, s->t, beyond));
    kempe_simulator_get_rates(s, dx);
    CHECK_NEAR(dx[1], 0.1 * STIFF, 1e-12);
}

/* The momentum along the ramp is kept. */
static void rates_jump_where_closures_switch(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &ramp, 0);
    GOES(kempe_simulator_start(s, 0));
    GOES(kempe_simulator_advance(s, 1));
    CHECK_NEAR(s->qd[0], 3 / 1.25, 1e-14);
    CHECK_NEAR(s->q[0], 3 / 1.25 * (1 - 1.0 / 3), 1e-14);
    CHECK_NEAR(s->q[1], 0.5 * s->q[0], 1e-15);
}

static void motion_ends(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &spring, 0);
    s->p[0] = 0.9;
    kempe_simulator_set_parameters(s);
    CHECK_STATUS(s, kempe_simulator_start(s, 0), KEMPE_SIMULATOR_ENDED);
    CHECK_TEXT(s->message, "spring: the motion ends at t = 0: x > limit; raise limit");
    const double q = 0.5, qd = 3;
    s->p[0] = 1.25;
    GOES(kempe_simulator_start_from(s, 1, &q, &qd));
    CHECK_STATUS(s, kempe_simulator_advance(s, 5), KEMPE_SIMULATOR_ENDED);
    double size = hypot(0.5, 1.5);
    CHECK_NEAR(s->q[0], 1.25, 1e-13);
    CHECK_NEAR(s->t, 1 + (asin(1.25 / size) - asin(0.5 / size)) / 2, 1e-11);
    CHECK_STATUS(s, kempe_simulator_advance(s, 6), KEMPE_SIMULATOR_ENDED);
}

/* Steps are long: the mass passes the limit and comes back within one. */
static void short_changes_are_found(void)
{
    kempe_simulator simulator, *s = &simulator;
    const double q = 0, qd = 2;
    for (int i = 1; i < 40; i++) {
        begin_at(s, &spring, 0);
        s->settings.rtol = s->settings.atol = 1e-4;
        s->p[0] = 1 - 1e-3;
        GOES(kempe_simulator_start_from(s, -0.01 * i, &q, &qd));
        CHECK_STATUS(s, kempe_simulator_advance(s, 5), KEMPE_SIMULATOR_ENDED);
        CHECK_NEAR(s->t, -0.01 * i + asin(1 - 1e-3) / 2, 2e-3);
    }
}

/* -- a body that turns freely, with a condition that is nearly met in each turn: sin x + sin 2x / 2 is 1.299038 at most
 */

static void turning_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)at, (void)jdqd;
    M[0] = 1;
    C[0] = 0;
}

static void turning_changes(const kempe_arguments *at, double *value)
{
    value[0] = 1.2990382 - sin(at->q[0]) - 0.5 * sin(2 * at->q[0]);
}

static void a_condition_that_is_not_decided_is_named(void)
{
    static const double constants[] = {1.2990382, 0.5}, fast[] = {1000};
    static const int inputs[] = {KEMPE_WATCH_Q, 0}, kinds[] = {KEMPE_CONDITION_SWITCHES}, traits[] = {0};
    static const unsigned steps[] = {KMP_OP_SIN, 4, 0,  0, KMP_OP_ADD, 4, 4,  0, KMP_OP_SIN, 8, 0,  0,
                                     KMP_OP_MUL, 2, 10, 0, KMP_OP_ADD, 6, 12, 0, KMP_OP_ADD, 0, 15, 0};
    static const unsigned outputs[] = {16};
    static const char *const names[] = {"peak"};
    const kempe_watch watch = {.constants = 2,
                               .inputs = 1,
                               .steps = 6,
                               .constant = constants,
                               .input = inputs,
                               .step = steps,
                               .output = outputs,
                               .traits = traits,
                               .search = kempe_watch_search};
    kempe_equations turning = dragged;
    turning.name = "turning";
    turning.condition_names = names;
    turning.condition_kind = kinds;
    turning.start.qd = fast;
    turning.motion = turning_motion;
    turning.changes = turning_changes;
    turning.watch = &watch;
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &turning, 0);
    GOES(kempe_simulator_start(s, 0));
    CHECK_STATUS(s, kempe_simulator_advance(s, 1000), KEMPE_SIMULATOR_FAILED);
    CHECK(s->t == 0 &&
          strstr(s->message,
                 "turning: peak: the search for changes reached its limit of evaluations in the step from t = "));
    s->settings.longest = 1;
    GOES(kempe_simulator_advance(s, 10));
    CHECK_NEAR(s->q[0], 10001, 1e-9);
}

static double dragged_rate(double t, double v)
{
    return 1 - 400 * t - 3 * v * fabs(v);
}

/* From rest the first step passes the kink of the drag, which has no side there, and is made again. Rates would
 * be off by 4e-9; those of short steps of fourth order are right to 1e-12. */
static void a_step_that_passes_a_kink_is_made_again(void)
{
    enum { PARTS = 500 };
    kempe_simulator simulator, *s = &simulator;
    const double row = 0.0005, h = row / PARTS;
    double v = 0;
    begin_at(s, &dragged, 0);
    s->settings.rtol = s->settings.atol = 1e-10;
    GOES(kempe_simulator_start(s, 0));
    for (int k = 0; k < 80 * PARTS; k++) {
        const double t = h * k, a = dragged_rate(t, v), b = dragged_rate(t + h / 2, v + h / 2 * a);
        const double c = dragged_rate(t + h / 2, v + h / 2 * b), d = dragged_rate(t + h, v + h * c);
        v += h / 6 * (a + 2 * b + 2 * c + d);
        if ((k + 1) % PARTS != 0)
            continue;
        GOES(kempe_simulator_advance(s, row * ((k + 1) / PARTS)));
        CHECK_NEAR(s->qd[0], v, 1e-10);
        CHECK_NEAR(s->qdd[0], dragged_rate(s->t, v), 2e-10);
    }
}

static void endless_changes_fail(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &chatter, 0);
    GOES(kempe_simulator_start(s, 0));
    GOES(kempe_simulator_advance(s, 0.5));
    CHECK_STATUS(s, kempe_simulator_advance(s, 2), KEMPE_SIMULATOR_FAILED);
    CHECK(s->t == 0.5);
    CHECK_NEAR(s->qd[0], 0.5, 1e-14);
    CHECK_TEXT(s->message, "chatter: rate < 0 changes back and forth at t = 1: the motion slides along this condition; "
                           "make the law continuous there, for instance with tanh");
    GOES(kempe_simulator_advance(s, 0.75));
    CHECK_NEAR(s->qd[0], 0.25, 1e-12);
}

/* -- bits --------------------------------------------------------------------------------------------------- */

static bool is_same(const kempe_simulator *a, const kempe_simulator *b)
{
    size_t n = (size_t)a->equations->coordinates * sizeof(double), m = (size_t)a->equations->rows * sizeof(double);
    return a->t == b->t && memcmp(a->q, b->q, n) == 0 && memcmp(a->qd, b->qd, n) == 0 &&
           memcmp(a->qdd, b->qdd, n) == 0 && memcmp(a->lambda, b->lambda, m) == 0;
}

static const kempe_equations *const all[] = {&pendulum, &slider_crank, &driven_crank, &parallelogram, &spring,
                                             &block,    &ramp,         &sampled,      &kinked};
enum { ALL = sizeof all / sizeof *all };

static double random_part(void)
{
    static unsigned long long state = 12345;
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(state >> 33) / 2147483648.0;
}

static void requests_do_not_change_bits(void)
{
    const double end = 3.5;
    for (int k = 0; k < ALL * 4; k++) {
        kempe_simulator simulators[2], *s = &simulators[0], *other = &simulators[1];
        for (int i = 0; i < 2; i++) {
            begin_at(&simulators[i], all[k / 4], i);
            simulators[i].settings.method = both[k % 2];
            simulators[i].settings.rtol = simulators[i].settings.atol = 1e-7;
            simulators[i].settings.fixed_step = k % 4 < 2 ? 0 : 0.003;
            CHECK_STATUS(&simulators[i], kempe_simulator_start(&simulators[i], 0), KEMPE_SIMULATOR_GOES);
        }
        GOES(kempe_simulator_advance(s, end));
        for (int i = 1; i <= 1000; i++)
            CHECK_STATUS(other, kempe_simulator_advance(other, i == 1000 ? end : end * i / 1000), KEMPE_SIMULATOR_GOES);
        CHECK(is_same(s, other));
        for (int trial = 0; trial < 5; trial++) {
            CHECK_STATUS(other, kempe_simulator_start(other, 0), KEMPE_SIMULATOR_GOES);
            for (int i = 0; other->t < end && i < 10000; i++) {
                double t = other->t + 0.3 * pow(random_part(), 3);
                CHECK_STATUS(other, kempe_simulator_advance(other, fmin(t, end)), KEMPE_SIMULATOR_GOES);
            }
            CHECK(is_same(s, other));
        }
    }
}

static void restored_simulators_have_the_same_bits(void)
{
    for (int k = 0; k < ALL; k++) {
        kempe_simulator simulators[3], *s = &simulators[0], *other = &simulators[1], *third = &simulators[2];
        for (int i = 0; i < 3; i++) {
            begin_at(&simulators[i], all[k], i);
            CHECK_STATUS(&simulators[i], kempe_simulator_start(&simulators[i], 0), KEMPE_SIMULATOR_GOES);
        }
        s->settings.rtol = 1e-6;
        double *saved = memory[3];
        CHECK(kempe_simulator_saved_numbers(s) <= 8192);
        for (int i = 0; i < 40; i++) {
            GOES(kempe_simulator_advance(s, s->t + 0.037));
            kempe_simulator_save(s, saved);
            GOES(kempe_simulator_advance(s, s->t + 0.5));
            kempe_simulator_restore(third, saved);
            CHECK_STATUS(third, kempe_simulator_advance(third, third->t + 0.1), KEMPE_SIMULATOR_GOES);
            CHECK_STATUS(third, kempe_simulator_advance(third, s->t), KEMPE_SIMULATOR_GOES);
            CHECK(is_same(s, third));
            kempe_simulator_restore(s, saved);
        }
        CHECK_STATUS(other, kempe_simulator_advance(other, 0), KEMPE_SIMULATOR_GOES);
    }
}

static void inputs_act_from_their_time(void)
{
    kempe_simulator simulators[2], *s = &simulators[0], *other = &simulators[1];
    for (int i = 0; i < 2; i++) {
        begin_at(&simulators[i], &spring, i);
        CHECK_STATUS(&simulators[i], kempe_simulator_start(&simulators[i], 0), KEMPE_SIMULATOR_GOES);
    }
    GOES(kempe_simulator_advance(s, 0.6));
    for (int i = 1; i <= 60; i++) {
        CHECK_STATUS(other, kempe_simulator_advance(other, i == 60 ? 0.6 : 0.01 * i), KEMPE_SIMULATOR_GOES);
        CHECK_STATUS(other, kempe_simulator_set_inputs(other), KEMPE_SIMULATOR_GOES);
    }
    CHECK(is_same(s, other));
    s->u[0] = 3;
    GOES(kempe_simulator_set_inputs(s));
    CHECK_NEAR(s->qdd[0], 3 - SOFT * cos(1.2), 1e-10);
    GOES(kempe_simulator_advance(s, 0.75)); /* before the event */
    double x = cos(1.2) - 3 / SOFT, v = -2 * sin(1.2), w = 2 * 0.15;
    CHECK_NEAR(s->q[0], 3 / SOFT + x * cos(w) + v / 2 * sin(w), 1e-10);
    s->u[0] = NAN;
    CHECK_STATUS(s, kempe_simulator_set_inputs(s), KEMPE_SIMULATOR_FAILED);
    CHECK_TEXT(s->message, "spring: input 'push' is not finite at t = 0.75");
    CHECK(s->u[0] == 3);
    GOES(kempe_simulator_advance(s, 0.8));
}

/* Advancing takes the inputs and parameters that have changed: spring's motion is x = cos 2 t before. */
static void advancing_takes_changes(void)
{
    for (int by_steps = 0; by_steps < 2; by_steps++) {
        kempe_simulator simulator, *s = &simulator;
        begin_at(s, &spring, 0);
        GOES(kempe_simulator_start(s, 0));
        GOES(kempe_simulator_advance(s, 0.6));
        s->u[0] = 3;
        if (by_steps)
            GOES(kempe_simulator_step(s));
        if (s->t < 0.75)
            GOES(kempe_simulator_advance(s, 0.75));
        double x = cos(1.2) - 3 / SOFT, v = -2 * sin(1.2), w = 2 * (s->t - 0.6);
        CHECK_NEAR(s->q[0], 3 / SOFT + x * cos(w) + v / 2 * sin(w), 1e-10);
        s->u[0] = NAN;
        CHECK_STATUS(s, kempe_simulator_advance(s, 0.8), KEMPE_SIMULATOR_FAILED);
        CHECK_TEXT(strstr(s->message, "input 'push' is not finite") ? "so" : s->message, "so");
        CHECK(s->u[0] == 3);
    }
}

/* -- an integrator of the caller ------------------------------------------------------------------------------- */

static void caller_integrates(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &pendulum, 0);
    GOES(kempe_simulator_start(s, 0));
    double period = 4 * sqrt(PENDULUM_LENGTH / GRAVITY) * elliptic(sqrt(0.5)), h = period / 4000;
    int exchanges = 0;
    for (int i = 0; i < 4000; i++) {
        double x[2], y[2], k[4][2];
        const double at[4] = {0, 0.5, 0.5, 1};
        kempe_simulator_get_states(s, x);
        for (int j = 0; j < 4; j++) {
            for (int l = 0; l < 2; l++)
                y[l] = x[l] + (j > 0 ? at[j] * h * k[j - 1][l] : 0);
            GOES(kempe_simulator_set_states(s, h * (i + at[j]), y));
            kempe_simulator_get_rates(s, k[j]);
        }
        for (int l = 0; l < 2; l++)
            y[l] = x[l] + h / 6 * (k[0][l] + 2 * k[1][l] + 2 * k[2][l] + k[3][l]);
        GOES(kempe_simulator_set_states(s, h * (i + 1), y));
        int changed = 0;
        if (kempe_simulator_wants_update(s))
            GOES(kempe_simulator_update(s, &changed));
        exchanges += changed;
    }
    CHECK(exchanges >= 2);
    CHECK_NEAR(s->q[0], PENDULUM_LENGTH, 1e-8);
    CHECK_NEAR(s->q[1], 0, 1e-8);
    GOES(kempe_simulator_advance(s, 2 * period)); /* its own steps go on from there */
    CHECK_NEAR(s->q[0], PENDULUM_LENGTH, 1e-7);
}

static void flat_changes(const kempe_arguments *at, double *value)
{
    spring_changes(at, value);
    value[0] = fmin(at->q[0], 0);
}

/* A condition that is zero until it holds: its sign is positive there, so that a search finds where it changes. A
 * caller that overlooks the change is asked for an event at the end of the step. */
static void caller_learns_of_flat_conditions(void)
{
    kempe_equations flat = spring;
    flat.name = "flat";
    flat.changes = flat_changes;
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &flat, 0);
    GOES(kempe_simulator_start(s, 0));
    double x[2] = {0.5, -1}, value[3], rates[2];
    GOES(kempe_simulator_set_states(s, 0.1, x));
    kempe_simulator_get_changes(s, value);
    CHECK(value[0] > 0 && !kempe_simulator_wants_update(s));
    x[0] = -0.1;
    GOES(kempe_simulator_set_states(s, 0.2, x));
    kempe_simulator_get_changes(s, value);
    CHECK(value[0] < 0 && kempe_simulator_wants_update(s));
    int changed = 0;
    GOES(kempe_simulator_update(s, &changed));
    CHECK(!kempe_simulator_wants_update(s));
    GOES(kempe_simulator_set_states(s, 0.2, x));
    kempe_simulator_get_rates(s, rates);
    CHECK_NEAR(rates[1], STIFF * 0.1, 1e-12);
    x[0] = 1001;
    GOES(kempe_simulator_set_states(s, 0.3, x));
    CHECK(kempe_simulator_wants_update(s)); /* beyond the limit at which the motion ends */
}

/* -- between the ends of steps ------------------------------------------------------------------------------------ */

/* At the bound of its stability a method damps a fast motion at the ends of steps alone: between them the interpolant
 * is wrong by many tolerances. */
static void coarse_interpolants_are_not_taken(void)
{
    const double tolerance = 1e-3;
    kempe_simulator simulator, *s = &simulator;
    double worst = 0;
    begin_at(s, &relaxing, 0);
    s->settings.rtol = s->settings.atol = tolerance;
    GOES(kempe_simulator_start(s, 0));
    for (int k = 1; k <= 3000; k++) {
        GOES(kempe_simulator_advance(s, 1e-3 * k));
        worst = fmax(worst, fabs(s->qd[0] - cos(1e-3 * k)));
    }
    printf("  %g steps, %.1e off\n", s->work.steps, worst);
    CHECK(worst <= 100 * tolerance); /* by interpolants 2900 tolerances */
}

/* -- samples ------------------------------------------------------------------------------------------------------ */

/* Between samples the force is constant: x and its rate at sample k. */
static void sampled_motion_at(int samples, double *x, double *v)
{
    *x = 1;
    *v = 0;
    for (int k = 0; k < samples; k++) {
        double force = -30 * *x - 4 * *v;
        *x += SAMPLE * (*v + SAMPLE / 2 * force);
        *v += SAMPLE * force;
    }
}

/* At the time of a sample the state is that before it. */
static void samples_are_taken(void)
{
    double x, v;
    for (int way = 0; way < 3; way++) {
        kempe_simulator simulator, *s = &simulator;
        begin_at(s, &sampled, 0);
        s->settings.method = both[way == 1];
        s->settings.fixed_step = way == 2 ? 0.02 : 0;
        GOES(kempe_simulator_start(s, 0));
        CHECK_NEAR(s->qd[1], -30, 1e-14);
        CHECK(kempe_simulator_next_time(s) == SAMPLE);
        for (int k = 1; k <= 60; k++) {
            double before = s->qd[1];
            GOES(kempe_simulator_advance(s, 0.1 * k / 2));
            sampled_motion_at(k, &x, &v);
            CHECK_NEAR(s->q[0], x, 1e-13);
            CHECK_NEAR(s->qd[0], v, 1e-13);
            CHECK(s->qd[1] != before || k == 1);
        }
        CHECK(s->qd[2] == 3);
        CHECK(s->work.steps <= (way == 2 ? 240 : 130));
    }
}

/* An integrator of the caller, exact for a constant force, that ends its steps at samples. */
static void caller_stops_at_samples(void)
{
    kempe_simulator simulator, *s = &simulator;
    double x[6], dx[6], v;
    begin_at(s, &sampled, 0);
    GOES(kempe_simulator_start(s, 0));
    for (int k = 1; k <= 40; k++) {
        double t = kempe_simulator_next_time(s), h = t - s->t;
        int changed = 0, choice[3];
        kempe_simulator_get_choice(s, choice);
        kempe_simulator_get_states(s, x);
        kempe_simulator_get_rates(s, dx);
        for (int i = 0; i < 3; i++) {
            x[i] += h * (dx[i] + h / 2 * dx[3 + i]);
            x[3 + i] += h * dx[3 + i];
        }
        CHECK_NEAR(t, k * SAMPLE, 1e-15);
        GOES(kempe_simulator_set_states(s, t, x));
        sampled_motion_at(k, &x[0], &v);
        CHECK_NEAR(s->q[0], x[0], 1e-13);
        GOES(kempe_simulator_update(s, &changed));
        CHECK(changed && choice[0] >= 0);
    }
    sampled_motion_at(40, &x[0], &v);
    CHECK_NEAR(s->qd[1], -30 * x[0] - 4 * v, 1e-12);
}

/* -- derivatives -------------------------------------------------------------------------------------------------- */

static void place_varied(kempe_simulator *s, double by, const double *x, double u, double length, double mass)
{
    s->p[0] = PENDULUM_LENGTH + by * length;
    s->p[1] = PENDULUM_MASS + by * mass;
    s->u[0] = 0.3 + by * u;
    const double angle = -0.7, q[2] = {PENDULUM_LENGTH * cos(angle), PENDULUM_LENGTH * sin(angle)},
                 qd[2] = {-2 * q[1], 2 * q[0]};
    GOES(kempe_simulator_start_from(s, 0, q, qd));
    int c;
    kempe_simulator_get_choice(s, &c);
    double moved[2] = {q[c] + by * x[0], qd[c] + by * x[1]};
    GOES(kempe_simulator_set_states(s, 0, moved));
}

static void derivatives_are_exact(void)
{
    const double x[2] = {0.7, -0.4}, p[2] = {0.3, 0.9}, u[3] = {1.1, 0, 0};
    double exact[9], at[2][9], error[2];
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &pendulum, 0);
    place_varied(s, 0, x, u[0], p[0], p[1]);
    const kempe_simulator_change change = {
        .x = x, .p = p, .u = u, .dx = exact, .y = exact + 2, .q = exact + 4, .qdd = exact + 6, .lambda = exact + 8};
    GOES(kempe_simulator_along(s, &change));
    for (int i = 0; i < 2; i++) {
        double by = i == 0 ? 1e-3 : 1e-4;
        for (int side = 0; side < 2; side++) {
            place_varied(s, side ? by : -by, x, u[0], p[0], p[1]);
            kempe_simulator_get_rates(s, at[side]);
            memcpy(at[side] + 2, s->y, 2 * sizeof(double));
            memcpy(at[side] + 4, s->q, 2 * sizeof(double));
            memcpy(at[side] + 6, s->qdd, 2 * sizeof(double));
            at[side][8] = s->lambda[0];
        }
        error[i] = 0;
        for (int k = 0; k < 9; k++)
            error[i] = fmax(error[i], fabs((at[1][k] - at[0][k]) / (2 * by) - exact[k]));
    }
    CHECK_NEAR(log10(error[0] / error[1]), 2, 0.02);
    CHECK(error[1] < 1e-5);
    kempe_simulator_init(s, &slider_crank, memory[0]);
    GOES(kempe_simulator_start(s, 0));
    CHECK_STATUS(s, kempe_simulator_along(s, &change), KEMPE_SIMULATOR_FAILED);
    CHECK_TEXT(s->message, "slider crank: derivatives were not generated");
}

/* -- a start at given values --------------------------------------------------------------------------------------- */

/* Coordinates and rates that are given are kept to the last bit, also those that depend on others in a run. Guesses of
 * all select the assembly mode. Values that contradict the loops are refused by name. */
static void given_values_are_kept(void)
{
    const double angle = 1.1, lean = -asin(CRANK * sin(angle) / ROD), place = CRANK * cos(angle) + ROD * cos(lean),
                 behind = CRANK * cos(angle) - ROD * cos(lean);
    const double slide[] = {NAN, NAN, place}, speed[] = {NAN, NAN, -0.5}, other[] = {angle, acos(-1) - lean, behind},
                 wrong[] = {angle, NAN, place + 0.01}, far[] = {NAN, NAN, 2}, fast[] = {3, NAN, 0.1};
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &slider_crank, 0);
    GOES(kempe_simulator_start_from(s, 0, slide, speed));
    CHECK(s->q[2] == place && s->qd[2] == -0.5);
    CHECK_NEAR(s->q[0], angle, 1e-12);
    CHECK_NEAR(s->qd[0] * (-CRANK * sin(angle) - ROD * sin(lean) * -CRANK * cos(angle) / (ROD * cos(lean))), -0.5,
               1e-12);
    GOES(kempe_simulator_start_from(s, 0, NULL, speed));
    CHECK(s->q[0] == 0.4 && s->qd[2] == -0.5);
    GOES(kempe_simulator_start_from(s, 0, other, NULL));
    CHECK_NEAR(s->q[1], acos(-1) - lean, 1e-12);
    CHECK_NEAR(s->q[2], behind, 1e-12);
    CHECK_STATUS(s, kempe_simulator_start_from(s, 0, wrong, NULL), KEMPE_SIMULATOR_FAILED);
    CHECK(strstr(s->message, "the given start contradicts itself or the loops: the value of 'phi' would be 1.06") ||
          strstr(s->message, "the given start contradicts itself or the loops: the value of 'x' would be"));
    CHECK(s->q[2] == behind || fabs(s->q[2] - behind) < 1e-12);
    CHECK_STATUS(s, kempe_simulator_start_from(s, 0, far, NULL), KEMPE_SIMULATOR_FAILED);
    CHECK(strstr(s->message, "stays open by"));
    CHECK_STATUS(s, kempe_simulator_start_from(s, 0, NULL, fast), KEMPE_SIMULATOR_FAILED);
    CHECK(strstr(s->message, "leave out rates that follow from others"));
}

/* A place that is given stays where a parameter changes: x = sqrt(L^2 - y^2), dx/dL = L/x. */
static void given_values_have_derivatives(void)
{
    const double y = -0.6 * PENDULUM_LENGTH, given[] = {NAN, y}, p[2] = {1, 0};
    double q[2];
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &pendulum, 0);
    GOES(kempe_simulator_start_from(s, 0, given, NULL));
    CHECK(s->q[1] == y);
    const kempe_simulator_change change = {.start = KEMPE_CHANGE_START_FROM, .given_q = given, .p = p, .q = q};
    GOES(kempe_simulator_along(s, &change));
    CHECK(q[1] == 0);
    CHECK_NEAR(q[0], PENDULUM_LENGTH / s->q[0], 1e-14);
}

/* -- failures ------------------------------------------------------------------------------------------------------ */

static void failures_say_why(void)
{
    kempe_simulator simulator, *s = &simulator;
    begin_at(s, &slider_crank, 0);
    CHECK_STATUS(s, kempe_simulator_advance(s, 1), KEMPE_SIMULATOR_FAILED);
    CHECK_TEXT(s->message, "slider crank: the simulator has not been started: call kempe_simulator_start");
    GOES(kempe_simulator_start(s, 0));
    GOES(kempe_simulator_advance(s, 1));
    CHECK_STATUS(s, kempe_simulator_advance(s, 0.5), KEMPE_SIMULATOR_FAILED);
    CHECK_STATUS(s, kempe_simulator_advance(s, NAN), KEMPE_SIMULATOR_FAILED);
    s->settings.most_steps = 3;
    CHECK_STATUS(s, kempe_simulator_advance(s, 9), KEMPE_SIMULATOR_FAILED);
    CHECK(strstr(s->message, "3 steps end at t = ") && s->t == 1);
    double x[2] = {3, 0};
    int c;
    kempe_simulator_get_choice(s, &c);
    x[0] = c == 2 ? 3 : c == 1 ? 1 : 0;
    if (c > 0) {
        CHECK_STATUS(s, kempe_simulator_set_states(s, 1, x), KEMPE_SIMULATOR_FAILED);
        CHECK(strstr(s->message, "slider crank: the loops ") && s->t == 1);
    }
    s->settings.most_steps = 0;
    GOES(kempe_simulator_advance(s, 1.5));
    s->settings.end = 2;
    CHECK_STATUS(s, kempe_simulator_advance(s, 2.5), KEMPE_SIMULATOR_ENDED);
    CHECK(s->t == 2 && strstr(s->message, "reached the end of its settings, t = 2: raise 'end'"));
    CHECK_STATUS(s, kempe_simulator_step(s), KEMPE_SIMULATOR_ENDED);
    GOES(kempe_simulator_advance(s, 2));
    CHECK_STATUS(s, kempe_simulator_advance(s, 1.5), KEMPE_SIMULATOR_FAILED);
    s->settings.end = 3;
    GOES(kempe_simulator_advance(s, 2.5));
    begin_at(s, &pendulum, 0);
    s->p[1] = 0;
    kempe_simulator_set_parameters(s);
    CHECK_STATUS(s, kempe_simulator_start(s, 0), KEMPE_SIMULATOR_FAILED);
    CHECK(strstr(s->message, "moves no mass at t = 0: give a body that it moves mass or inertia"));
    s->p[0] = NAN;
    CHECK_STATUS(s, kempe_simulator_start(s, 0), KEMPE_SIMULATOR_FAILED);
    CHECK(strstr(s->message, "constraint equation 'rod' stays open by nan"));
}

/* In steps that are so short that it does not overflow before; a number of steps is the bound of the caller. */
static void runaway_motions_end_by_name(void)
{
    kempe_simulator simulator, *s = &simulator;
    for (int bounded = 0; bounded < 2; bounded++) {
        begin_at(s, &runaway, 0);
        s->settings.longest = 1e-4;
        s->settings.most_steps = bounded ? 1e5 : 0;
        GOES(kempe_simulator_start(s, 0));
        GOES(kempe_simulator_advance(s, 1));
        CHECK_STATUS(s, kempe_simulator_advance(s, 4), bounded ? KEMPE_SIMULATOR_GOES : KEMPE_SIMULATOR_FAILED);
        CHECK(bounded || strstr(s->message, "the motion grows without end: at t = 2"));
        CHECK(bounded || strstr(s->message, "'x' has a rate of 2.2"));
        CHECK(s->t == (bounded ? 4 : 1));
    }
    GOES(kempe_simulator_start(s, 0));
    s->settings.longest = 0;
    GOES(kempe_simulator_advance(s, 4));
}

static void memory_is_counted(void)
{
    for (int k = 0; k < ALL; k++) {
        kempe_simulator s;
        for (int i = 0; i < 8192; i++)
            memory[0][i] = memory[1][i] = 77;
        kempe_simulator_init(&s, all[k], memory[0]);
        CHECK(s.part.end_of_memory == memory[0] + kempe_simulator_memory(all[k]));
        CHECK(s.part.backup == memory[0] + kempe_simulator_saved_numbers(&s));
        CHECK(memory[0][kempe_simulator_memory(all[k])] == 77);
    }
    static double room[KEMPE_SIMULATOR_MEMORY(2, 1, 1, 1, 2, 2, 0, 2, 0)];
    CHECK(sizeof room / sizeof *room == (size_t)kempe_simulator_memory(&pendulum));
}

/* The room for decisions (kempe_friction.c): eleven numbers of an element, D and a minimum, and of impacts sixteen. */
static void room_of_decisions(void)
{
    for (int n = 1; n < 50; n++) {
        const int minimum = n * n + kmp_sharing_room(n);
        CHECK(KEMPE_SIMULATOR_FRICTION_ROOM(0, n) >= 11 * n + minimum);
        CHECK(KEMPE_SIMULATOR_FRICTION_ROOM(0, n) + KEMPE_SIMULATOR_CONTACTS(0, n) >= 16 * n + minimum);
    }
}

int main(void)
{
    TEST(room_of_decisions);
    TEST(pendulum_has_its_period);
    TEST(crank_turns_in_its_time);
    TEST(redundant_rows_are_left_out);
    TEST(structure_does_not_change_the_motion);
    TEST(driven_crank_follows_its_drive);
    TEST(forces_depend_on_multipliers);
    TEST(rates_jump_where_closures_switch);
    TEST(spring_switches);
    TEST(kinks_are_located);
    TEST(motion_ends);
    TEST(short_changes_are_found);
    TEST(a_step_that_passes_a_kink_is_made_again);
    TEST(a_condition_that_is_not_decided_is_named);
    TEST(endless_changes_fail);
    TEST(requests_do_not_change_bits);
    TEST(restored_simulators_have_the_same_bits);
    TEST(inputs_act_from_their_time);
    TEST(advancing_takes_changes);
    TEST(caller_integrates);
    TEST(caller_learns_of_flat_conditions);
    TEST(coarse_interpolants_are_not_taken);
    TEST(samples_are_taken);
    TEST(caller_stops_at_samples);
    TEST(derivatives_are_exact);
    TEST(given_values_are_kept);
    TEST(given_values_have_derivatives);
    TEST(failures_say_why);
    TEST(runaway_motions_end_by_name);
    TEST(memory_is_counted);
    return check_report();
}
