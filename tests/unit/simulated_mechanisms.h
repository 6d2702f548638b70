/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations of simulators, written by hand. */
#ifndef KEMPE_TESTS_SIMULATED_MECHANISMS_H
#define KEMPE_TESTS_SIMULATED_MECHANISMS_H

#include "exchange/simulator/kempe_simulator.h"
#include "symbolic/graph.h"
#include <math.h>
#include <stddef.h>

#define GRAVITY 9.81

/* -- a pendulum: two translations and a length; parameters length and mass; an input, the force along x ------- */

#define PENDULUM_LENGTH 0.7
#define PENDULUM_MASS   2.0

static void pendulum_prepare(const double *p, double *k)
{
    k[0] = p[0] * p[0];
    k[1] = p[1];
}

static void pendulum_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    h[0] = at->q[0] * at->q[0] + at->q[1] * at->q[1] - at->k[0];
    J[0] = 2 * at->q[0];
    J[1] = 2 * at->q[1];
    h_t[0] = 0;
}

static void pendulum_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    double m = at->k[1];
    M[0] = M[3] = m;
    M[1] = M[2] = 0;
    C[0] = -at->u[0];
    C[1] = m * GRAVITY;
    jdqd[0] = 2 * (at->qd[0] * at->qd[0] + at->qd[1] * at->qd[1]);
}

/* Kinetic and potential energy, and the force in the rod. */
static void pendulum_show(const kempe_arguments *at, double *y)
{
    double m = at->k[1];
    y[0] = m / 2 * (at->qd[0] * at->qd[0] + at->qd[1] * at->qd[1]) + m * GRAVITY * at->q[1];
    y[1] = 2 * sqrt(at->k[0]) * at->lambda[0];
}

static void pendulum_along(const kempe_arguments *at, const kempe_direction *d, double *dynamics, double *h,
                           double *rates, double *accelerations, double *y, double *value)
{
    const double *q = at->q, *qd = at->qd, *qdd = at->qdd;
    double m = at->k[1], length = sqrt(at->k[0]), dm = d->p[1], dl = d->p[0];
    (void)value;
    dynamics[0] = dm * qdd[0] + m * d->qdd[0] - d->u[0] - 2 * (d->q[0] * at->lambda[0] + q[0] * d->lambda[0]);
    dynamics[1] = dm * (qdd[1] + GRAVITY) + m * d->qdd[1] - 2 * (d->q[1] * at->lambda[0] + q[1] * d->lambda[0]);
    h[0] = 2 * (q[0] * d->q[0] + q[1] * d->q[1]) - 2 * length * dl;
    rates[0] = 2 * (d->q[0] * qd[0] + d->q[1] * qd[1] + q[0] * d->qd[0] + q[1] * d->qd[1]);
    accelerations[0] = 2 * (d->q[0] * qdd[0] + d->q[1] * qdd[1] + q[0] * d->qdd[0] + q[1] * d->qdd[1]) +
                       4 * (qd[0] * d->qd[0] + qd[1] * d->qd[1]);
    y[0] = dm / 2 * (qd[0] * qd[0] + qd[1] * qd[1]) + m * (qd[0] * d->qd[0] + qd[1] * d->qd[1]) + dm * GRAVITY * q[1] +
           m * GRAVITY * d->q[1];
    y[1] = 2 * (dl * at->lambda[0] + length * d->lambda[0]);
}

static const char *const pendulum_coordinates[] = {"x", "y"}, *const pendulum_rows[] = {"rod"},
                         *const pendulum_inputs[] = {"push"}, *const pendulum_parameters[] = {"length", "mass"},
                         *const pendulum_outputs[] = {"energy", "force"};
static const int translations[] = {KEMPE_COORDINATE_TRANSLATION, KEMPE_COORDINATE_TRANSLATION};
static const double pendulum_scale[] = {PENDULUM_LENGTH, PENDULUM_LENGTH},
                    pendulum_row_scale[] = {2 * PENDULUM_LENGTH * PENDULUM_LENGTH},
                    pendulum_values[] = {PENDULUM_LENGTH, PENDULUM_MASS}, nothing[12] = {0},
                    pendulum_start[] = {PENDULUM_LENGTH, 0};
static const int pendulum_fixed[] = {1, 0};

static const kempe_equations pendulum = {.name = "pendulum",
                                         .hash = "",
                                         .coordinates = 2,
                                         .rows = 1,
                                         .freedom = 1,
                                         .inputs = 1,
                                         .parameters = 2,
                                         .outputs = 2,
                                         .kept = 2,
                                         .coordinate_names = pendulum_coordinates,
                                         .row_names = pendulum_rows,
                                         .input_names = pendulum_inputs,
                                         .parameter_names = pendulum_parameters,
                                         .output_names = pendulum_outputs,
                                         .coordinate_kind = translations,
                                         .scale = pendulum_scale,
                                         .row_scale = pendulum_row_scale,
                                         .parameter_values = pendulum_values,
                                         .parameter_fixed = pendulum_fixed,
                                         .input_values = nothing,
                                         .rank_tolerance = 1e-10,
                                         .start = {.q = pendulum_start, .qd = nothing},
                                         .prepare = pendulum_prepare,
                                         .closures = pendulum_closures,
                                         .motion = pendulum_motion,
                                         .show = pendulum_show,
                                         .along = pendulum_along};

/* -- a slider-crank: phi, theta, x; the rod has its mass at its middle; driven: phi follows a spin ------------- */

#define CRANK       0.3
#define ROD         1.0
#define CRANK_MASS  0.4
#define ROD_MASS    1.5
#define SLIDER_MASS 2.5
#define SPIN        7.0

static void crank_loop(const kempe_arguments *at, double *h, double *J)
{
    double s = sin(at->q[0]), c = cos(at->q[0]), sr = sin(at->q[1]), cr = cos(at->q[1]);
    h[0] = CRANK * c + ROD * cr - at->q[2];
    h[1] = CRANK * s + ROD * sr;
    J[0] = -CRANK * s;
    J[1] = -ROD * sr;
    J[2] = -1;
    J[3] = CRANK * c;
    J[4] = ROD * cr;
    J[5] = 0;
}

static void crank_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    crank_loop(at, h, J);
    h_t[0] = h_t[1] = 0;
}

static void driven_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    crank_loop(at, h, J);
    h[2] = at->q[0] - 0.4 - SPIN * at->t;
    J[6] = 1;
    J[7] = J[8] = h_t[0] = h_t[1] = 0;
    h_t[2] = -SPIN;
}

static void crank_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    double s = sin(at->q[0]), c = cos(at->q[0]), sr = sin(at->q[1]), cr = cos(at->q[1]);
    double w = at->qd[0] * at->qd[0], wr = at->qd[1] * at->qd[1], between = ROD_MASS * CRANK * ROD / 2;
    for (int i = 0; i < 9; i++)
        M[i] = 0;
    M[0] = CRANK_MASS * CRANK * CRANK / 3 + ROD_MASS * CRANK * CRANK;
    M[4] = ROD_MASS * ROD * ROD / 4;
    M[1] = M[3] = between * cos(at->q[0] - at->q[1]);
    M[8] = SLIDER_MASS;
    C[0] = between * sin(at->q[0] - at->q[1]) * wr + (CRANK_MASS / 2 + ROD_MASS) * GRAVITY * CRANK * c;
    C[1] = -between * sin(at->q[0] - at->q[1]) * w + ROD_MASS * GRAVITY * ROD / 2 * cr;
    C[2] = 0;
    jdqd[0] = -CRANK * c * w - ROD * cr * wr;
    jdqd[1] = -CRANK * s * w - ROD * sr * wr;
}

static void driven_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    crank_motion(at, M, C, jdqd);
    jdqd[2] = 0;
}

static const char *const crank_coordinates[] = {"phi", "theta", "x"}, *const crank_rows[] = {"loop x", "loop y",
                                                                                             "drive"};
static const int crank_kinds[] = {KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_TRANSLATION};
static const double ones[12] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
static const double crank_start[] = {0.4, -0.1, 1.2}, crank_rates[] = {SPIN, 0, 0};

#define CRANK_EQUATIONS                                                                                                \
    .hash = "", .coordinates = 3, .coordinate_names = crank_coordinates, .row_names = crank_rows,                      \
    .coordinate_kind = crank_kinds, .scale = ones, .row_scale = ones, .rank_tolerance = 1e-10,                         \
    .start = {.q = crank_start, .qd = crank_rates}

static const kempe_equations slider_crank = {CRANK_EQUATIONS, .name = "slider crank",     .rows = 2,
                                             .freedom = 1,    .closures = crank_closures, .motion = crank_motion};
static const kempe_equations driven_crank = {CRANK_EQUATIONS, .name = "driven crank",      .rows = 3,
                                             .freedom = 0,    .closures = driven_closures, .motion = driven_motion};

/* -- a parallelogram of three rockers (phi, psi, chi) on a coupler (theta): one of four rows is redundant --------- */

#define ROCKER  0.5
#define COUPLER 0.8

static void parallelogram_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    const double *q = at->q, share[2] = {1, 0.5};
    for (int i = 0; i < 2; i++) {
        double *rows = J + 8 * i, a = COUPLER * share[i];
        int other = i + 2;
        h[2 * i] = ROCKER * cos(q[0]) + a * cos(q[1]) - ROCKER * cos(q[other]) - a;
        h[2 * i + 1] = ROCKER * sin(q[0]) + a * sin(q[1]) - ROCKER * sin(q[other]);
        for (int j = 0; j < 8; j++)
            rows[j] = 0;
        rows[0] = -ROCKER * sin(q[0]);
        rows[1] = -a * sin(q[1]);
        rows[other] = ROCKER * sin(q[other]);
        rows[4] = ROCKER * cos(q[0]);
        rows[5] = a * cos(q[1]);
        rows[4 + other] = -ROCKER * cos(q[other]);
        h_t[2 * i] = h_t[2 * i + 1] = 0;
    }
}

/* A point mass of 1 kg at the end of each rocker. */
static void parallelogram_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    const double *q = at->q, *qd = at->qd, share[2] = {1, 0.5};
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++)
            M[4 * i + j] = i == j && i != 1 ? ROCKER * ROCKER : 0;
        C[i] = i != 1 ? GRAVITY * ROCKER * cos(q[i]) : 0;
    }
    for (int i = 0; i < 2; i++) {
        double a = COUPLER * share[i];
        int other = i + 2;
        jdqd[2 * i] = -ROCKER * cos(q[0]) * qd[0] * qd[0] - a * cos(q[1]) * qd[1] * qd[1] +
                      ROCKER * cos(q[other]) * qd[other] * qd[other];
        jdqd[2 * i + 1] = -ROCKER * sin(q[0]) * qd[0] * qd[0] - a * sin(q[1]) * qd[1] * qd[1] +
                          ROCKER * sin(q[other]) * qd[other] * qd[other];
    }
}

static const char *const parallelogram_coordinates[] = {"phi", "theta", "psi", "chi"}, *const parallelogram_rows[] = {
                                                                                           "first x", "first y",
                                                                                           "second x", "second y"};
static const int rotations[] = {KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_ROTATION,
                                KEMPE_COORDINATE_ROTATION};
static const double parallelogram_start[] = {-0.6, 0, -0.6, -0.6};
static const kempe_equations parallelogram = {.name = "parallelogram",
                                              .hash = "",
                                              .coordinates = 4,
                                              .rows = 4,
                                              .freedom = 1,
                                              .coordinate_names = parallelogram_coordinates,
                                              .row_names = parallelogram_rows,
                                              .coordinate_kind = rotations,
                                              .scale = ones,
                                              .row_scale = ones,
                                              .rank_tolerance = 1e-10,
                                              .start = {.q = parallelogram_start, .qd = nothing},
                                              .closures = parallelogram_closures,
                                              .motion = parallelogram_motion};

/* -- bounds of conditions that are x, its rate, and limit - x ------------------------------------------------------ */

static const double watch_constants[] = {0};
static const int watch_place[] = {KEMPE_WATCH_Q, 0, KEMPE_WATCH_PARAMETER, 0}, watch_traits[] = {0, 0, 0};
static const int watch_rates[] = {KEMPE_WATCH_QD, 0};
static const unsigned watch_difference[] = {KMP_OP_ADD, 2, 1, 0}, watch_outputs[] = {0, 4, 0};
static const kempe_watch watch_x = {.inputs = 1,
                                    .constant = watch_constants,
                                    .input = watch_place,
                                    .output = watch_outputs,
                                    .traits = watch_traits,
                                    .search = kempe_watch_search};
static const kempe_watch watch_rate = {.inputs = 1,
                                       .constant = watch_constants,
                                       .input = watch_rates,
                                       .output = watch_outputs,
                                       .traits = watch_traits,
                                       .search = kempe_watch_search};
static const kempe_watch watch_limit = {.inputs = 2,
                                        .steps = 1,
                                        .constant = watch_constants,
                                        .input = watch_place,
                                        .step = watch_difference,
                                        .output = watch_outputs,
                                        .traits = watch_traits,
                                        .search = kempe_watch_search};

/* -- a mass on a spring, which is stiffer where x < 0; it ends beyond a parameter; an input pushes -------------- */

#define SOFT  4.0
#define STIFF 400.0

static void spring_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    M[0] = 1;
    C[0] = (at->modes[0] > 0 ? STIFF : SOFT) * at->q[0] - at->u[0];
}

static void spring_changes(const kempe_arguments *at, double *value)
{
    value[0] = at->q[0];
    value[1] = at->k[0] - at->q[0];
    value[2] = at->q[0];
}

static void spring_prepare(const double *p, double *k)
{
    k[0] = p[0];
}

static const char *const spring_coordinates[] = {"x"}, *const spring_conditions[] = {"x < 0", "x > limit", "abs"},
                         *const spring_parameters[] = {"limit"}, *const spring_advice[] = {NULL, "raise limit", NULL};
static const int spring_kinds[] = {KEMPE_CONDITION_SWITCHES, KEMPE_CONDITION_ENDS, KEMPE_CONDITION_KINK};
static const double spring_values[] = {1e3};
static const kempe_equations spring = {.name = "spring",
                                       .hash = "",
                                       .coordinates = 1,
                                       .freedom = 1,
                                       .inputs = 1,
                                       .parameters = 1,
                                       .conditions = 3,
                                       .kept = 1,
                                       .coordinate_names = spring_coordinates,
                                       .input_names = pendulum_inputs,
                                       .parameter_names = spring_parameters,
                                       .condition_names = spring_conditions,
                                       .advice = spring_advice,
                                       .coordinate_kind = translations,
                                       .condition_kind = spring_kinds,
                                       .scale = ones,
                                       .parameter_values = spring_values,
                                       .input_values = nothing,
                                       .rank_tolerance = 1e-10,
                                       .start = {.q = ones, .qd = nothing},
                                       .prepare = spring_prepare,
                                       .motion = spring_motion,
                                       .changes = spring_changes,
                                       .watch = &watch_limit};

/* -- a mass that runs away: x = exp(40 t) ------------------------------------------------------------------------ */

#define RUNAWAY 40.0
static const double runaway_rate[] = {RUNAWAY};

static void runaway_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    M[0] = 1;
    C[0] = -RUNAWAY * RUNAWAY * at->q[0];
}

static const kempe_equations runaway = {.name = "runaway",
                                        .hash = "",
                                        .coordinates = 1,
                                        .freedom = 1,
                                        .coordinate_names = spring_coordinates,
                                        .coordinate_kind = translations,
                                        .scale = ones,
                                        .rank_tolerance = 1e-10,
                                        .start = {.q = ones, .qd = runaway_rate},
                                        .motion = runaway_motion};

/* -- the same spring as a kink of |x| ------------------------------------------------------------------------------ */

static void kinked_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    double x = at->q[0], side = at->modes[0];
    M[0] = 1;
    C[0] = (STIFF + SOFT) / 2 * x - (STIFF - SOFT) / 2 * (side != 0 ? -side * x : fabs(x));
}

static void kinked_changes(const kempe_arguments *at, double *value)
{
    value[0] = at->q[0];
}

static const char *const kinked_conditions[] = {"abs"};
static const int kinked_kinds[] = {KEMPE_CONDITION_KINK};
static const kempe_equations kinked = {.name = "kinked",
                                       .hash = "",
                                       .coordinates = 1,
                                       .freedom = 1,
                                       .conditions = 1,
                                       .coordinate_names = spring_coordinates,
                                       .condition_names = kinked_conditions,
                                       .coordinate_kind = translations,
                                       .condition_kind = kinked_kinds,
                                       .scale = ones,
                                       .rank_tolerance = 1e-10,
                                       .start = {.q = ones, .qd = nothing},
                                       .motion = kinked_motion,
                                       .changes = kinked_changes,
                                       .watch = &watch_x};

/* -- a mass from rest with quadratic drag under a force that turns ----------------------------------------------------
 */

static void dragged_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    double v = at->qd[0], side = at->modes[0];
    M[0] = 1; /* qdd = 1 - 400 t - 3 v |v| */
    C[0] = 3 * v * (side != 0 ? -side * v : fabs(v)) - (1 - 400 * at->t);
}

static void dragged_changes(const kempe_arguments *at, double *value)
{
    value[0] = at->qd[0];
}

static const kempe_equations dragged = {.name = "dragged",
                                        .hash = "",
                                        .coordinates = 1,
                                        .freedom = 1,
                                        .conditions = 1,
                                        .coordinate_names = spring_coordinates,
                                        .condition_names = kinked_conditions,
                                        .coordinate_kind = translations,
                                        .condition_kind = kinked_kinds,
                                        .scale = ones,
                                        .rank_tolerance = 1e-10,
                                        .start = {.q = ones, .qd = nothing},
                                        .early = 1,
                                        .motion = dragged_motion,
                                        .changes = dragged_changes,
                                        .watch = &watch_rate};

/* -- a mass on a stiff spring and damper whose other end moves as sin(t), with a force that makes its motion the same
 * --- */

#define FAST   1e3
#define DAMPED 3.0

static void relaxing_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    M[0] = 1;
    C[0] = FAST * FAST * (at->q[0] - sin(at->t)) + 2 * DAMPED * FAST * (at->qd[0] - cos(at->t)) + sin(at->t);
}

static const kempe_equations relaxing = {.name = "relaxing",
                                         .hash = "",
                                         .coordinates = 1,
                                         .freedom = 1,
                                         .coordinate_names = spring_coordinates,
                                         .coordinate_kind = translations,
                                         .scale = ones,
                                         .rank_tolerance = 1e-10,
                                         .start = {.q = nothing, .qd = ones},
                                         .motion = relaxing_motion};

/* -- a force that pushes against its own condition: it changes back and forth ------------------------------------ */

static void chatter_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    M[0] = 1;
    C[0] = at->modes[0] > 0 ? -1 : 1;
}

static void chatter_changes(const kempe_arguments *at, double *value)
{
    value[0] = at->qd[0];
}

static const char *const chatter_conditions[] = {"rate < 0"};
static const kempe_equations chatter = {.name = "chatter",
                                        .hash = "",
                                        .coordinates = 1,
                                        .freedom = 1,
                                        .conditions = 1,
                                        .coordinate_names = spring_coordinates,
                                        .condition_names = chatter_conditions,
                                        .coordinate_kind = translations,
                                        .condition_kind = spring_kinds,
                                        .scale = ones,
                                        .rank_tolerance = 1e-10,
                                        .start = {.q = ones, .qd = ones},
                                        .motion = chatter_motion,
                                        .changes = chatter_changes,
                                        .watch = &watch_rate};

/* -- a mass under a force that is sampled; a counter of the passes of x < 0 ------------------------------------- */

#define SAMPLE 0.05

static void sampled_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)jdqd;
    for (int i = 0; i < 9; i++)
        M[i] = i % 4 == 0;
    C[0] = -at->qd[1];
    C[1] = C[2] = 0;
}

static void sampled_changes(const kempe_arguments *at, double *value)
{
    value[0] = at->q[0];
}

static void sampled_next(const kempe_arguments *at, double *value)
{
    value[0] = -30 * at->q[0] - 4 * at->qd[0];
    value[1] = at->qd[2] + 1;
}

static const char *const sampled_coordinates[] = {"x", "force", "passes"};
static const int sampled_kinds[] = {KEMPE_COORDINATE_TRANSLATION, KEMPE_COORDINATE_STATE, KEMPE_COORDINATE_STATE};
static const int sampled_at[] = {1, 2}, sampled_condition[] = {-1, 0}, sampled_sense[] = {0, 1};
static const int sampled_settles[] = {0, 0};
static const double sampled_period[] = {SAMPLE, INFINITY}, sampled_start[] = {1, 0, 0};
static const kempe_equations sampled = {.name = "sampled",
                                        .hash = "",
                                        .coordinates = 3,
                                        .freedom = 3,
                                        .conditions = 1,
                                        .coordinate_names = sampled_coordinates,
                                        .condition_names = spring_conditions,
                                        .coordinate_kind = sampled_kinds,
                                        .condition_kind = spring_kinds,
                                        .scale = ones,
                                        .rank_tolerance = 1e-10,
                                        .start = {.q = sampled_start, .qd = nothing},
                                        .motion = sampled_motion,
                                        .changes = sampled_changes,
                                        .watch = &watch_x,
                                        .discrete = {.states = 2,
                                                     .place = sampled_at,
                                                     .period = sampled_period,
                                                     .condition = sampled_condition,
                                                     .sense = sampled_sense,
                                                     .settles = sampled_settles,
                                                     .next = sampled_next}};

/* -- a block slides down a slope with friction, a part of the multiplier's size; it is negative ------------------- */

#define SLOPE 0.6
#define RUB   0.25

static void block_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    J[0] = -sin(SLOPE);
    J[1] = -cos(SLOPE);
    h[0] = J[0] * at->q[0] + J[1] * at->q[1];
    h_t[0] = 0;
}

static void block_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    double rub = RUB * fabs(at->lambda[0]);
    M[0] = M[3] = 2;
    M[1] = M[2] = 0;
    C[0] = rub * cos(SLOPE);
    C[1] = 2 * GRAVITY - rub * sin(SLOPE);
    jdqd[0] = 0;
}

static void block_loads(const kempe_arguments *at, double *slopes)
{
    double sense = at->lambda[0] < 0 ? -1 : 1;
    slopes[0] = RUB * sense * cos(SLOPE);
    slopes[1] = -RUB * sense * sin(SLOPE);
}

static const kempe_equations block = {.name = "block",
                                      .hash = "",
                                      .coordinates = 2,
                                      .rows = 1,
                                      .freedom = 1,
                                      .coordinate_names = pendulum_coordinates,
                                      .row_names = pendulum_rows,
                                      .coordinate_kind = translations,
                                      .scale = ones,
                                      .row_scale = ones,
                                      .rank_tolerance = 1e-10,
                                      .start = {.q = nothing, .qd = nothing},
                                      .closures = block_closures,
                                      .motion = block_motion,
                                      .loads = block_loads};

/* -- a bead slides along a floor onto a ramp, where its rates jump --------------------------------------------------
 */

static void ramp_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    double slope = at->modes[0] > 0 ? 0 : 0.5;
    h[0] = at->q[1] - slope * at->q[0];
    J[0] = -slope;
    J[1] = 1;
    h_t[0] = 0;
}

static void ramp_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    (void)at;
    M[0] = M[3] = 2;
    M[1] = M[2] = C[0] = C[1] = jdqd[0] = 0;
}

static void ramp_changes(const kempe_arguments *at, double *value)
{
    value[0] = at->q[0];
}

static const double ramp_start[] = {-1, 0}, ramp_rates[] = {3, 0};
static const kempe_equations ramp = {.name = "ramp",
                                     .hash = "",
                                     .coordinates = 2,
                                     .rows = 1,
                                     .freedom = 1,
                                     .conditions = 1,
                                     .coordinate_names = pendulum_coordinates,
                                     .row_names = pendulum_rows,
                                     .condition_names = spring_conditions,
                                     .coordinate_kind = translations,
                                     .condition_kind = spring_kinds,
                                     .scale = ones,
                                     .row_scale = ones,
                                     .rank_tolerance = 1e-10,
                                     .start = {.q = ramp_start, .qd = ramp_rates},
                                     .closures = ramp_closures,
                                     .motion = ramp_motion,
                                     .changes = ramp_changes,
                                     .watch = &watch_x};

/* -- two slider-cranks that are apart: J and M have blocks ------------------------------------------------------------
 */

static void pair_at(const kempe_arguments *at, int first, kempe_arguments *half)
{
    *half = *at;
    half->q += first;
    half->qd += first;
}

static void pair_closures(const kempe_arguments *at, double *h, double *J, double *h_t)
{
    for (int i = 0; i < 24; i++)
        J[i] = 0;
    for (int k = 0; k < 2; k++) {
        kempe_arguments half;
        double rows[6];
        pair_at(at, 3 * k, &half);
        crank_closures(&half, h + 2 * k, rows, h_t + 2 * k);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 3; j++)
                J[6 * (2 * k + i) + 3 * k + j] = rows[3 * i + j];
    }
}

static void pair_motion(const kempe_arguments *at, double *M, double *C, double *jdqd)
{
    for (int i = 0; i < 36; i++)
        M[i] = 0;
    for (int k = 0; k < 2; k++) {
        kempe_arguments half;
        double mass[9];
        pair_at(at, 3 * k, &half);
        crank_motion(&half, mass, C + 3 * k, jdqd + 2 * k);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                M[6 * (3 * k + i) + 3 * k + j] = mass[3 * i + j];
    }
}

static const char *const pair_names[] = {"phi", "theta", "x", "other phi", "other theta", "other x"};
static const int pair_kinds[] = {KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_TRANSLATION,
                                 KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_TRANSLATION};
static const double pair_start[] = {0.4, -0.1, 1.2, 2, -0.3, 0.9}, pair_rates[] = {SPIN, 0, 0, -3, 0, 0};
static const char *const pair_jacobian_zeros[] = {"xxx000", "xx0000", "000xxx", "000xx0"}, *const pair_mass_zeros[] = {
                                                                                               "xx0000", "xx0000",
                                                                                               "00x000", "000xx0",
                                                                                               "000xx0", "00000x"};

#define PAIR_EQUATIONS                                                                                                 \
    .name = "pair", .hash = "", .coordinates = 6, .rows = 4, .freedom = 2, .coordinate_names = pair_names,             \
    .row_names = parallelogram_rows, .coordinate_kind = pair_kinds, .scale = ones, .row_scale = ones,                  \
    .rank_tolerance = 1e-10, .start = {.q = pair_start, .qd = pair_rates}, .closures = pair_closures,                  \
    .motion = pair_motion

static const kempe_equations pair = {PAIR_EQUATIONS};
static const kempe_equations structured_pair = {PAIR_EQUATIONS, .jacobian_zeros = pair_jacobian_zeros,
                                                .mass_zeros = pair_mass_zeros};

#endif
