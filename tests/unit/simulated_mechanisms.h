/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations of simulators, written by hand. */
#ifndef KEMPE_TESTS_SIMULATED_MECHANISMS_H
#define KEMPE_TESTS_SIMULATED_MECHANISMS_H

#include "generate/simulator/kempe_simulator.h"
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
                                         .start_q = pendulum_start,
                                         .start_qd = nothing,
                                         .prepare = pendulum_prepare,
                                         .closures = pendulum_closures,
                                         .motion = pendulum_motion,
                                         .show = pendulum_show,
                                         .along = pendulum_along};

#endif
