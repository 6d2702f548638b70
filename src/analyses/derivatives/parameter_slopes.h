/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact partial derivatives of the equations and of the outputs with respect to named parameters that a variant keeps
 * variable (model/data/variant.h). Coordinates, rates, accelerations, multipliers and time are constant. The derivative
 * includes all parameters that depend on the named one. kmp_linear_follow (analyses/derivatives/linearized.h) gives the
 * response of a mechanism. Derived once; values of parameters may change. */
#pragma once

#include "constraints/evaluation/evaluation_point.h"
#include "constraints/partition/small_change.h"
#include "model/data/force.h"

/** Derivatives of one program by columns, and the program. */
typedef struct kmp_slope_matrix {
    int count, rows, columns;
    kmp_tangent *entry;
    int *start; /* columns + 1 */
    kmp_formulas formulas;
    const double *value; /* at the last state; NULL: the matrices are empty, or were not requested */
} kmp_slope_matrix;

typedef struct kmp_slopes {
    const kempe_system *system;
    int n, m, count; /* parameters */
    int shown;       /* output values */
    bool timed;      /* the equations have a column of time after the parameters */
    kmp_slope_matrix
        equations; /* rows: h, rate, curve (m each), force, start q and qd (n each), length; a column a parameter */
    kmp_slope_matrix
        outputs; /* columns: t with the inputs that change with it, q, qd, qdd (n each), lambda (m), parameters */
    kmp_slope_matrix events;  /* derivatives of the conditions of the system, in rows */
    kmp_slope_matrix delayed; /* of delayed signals, of these before the start, and of their delays, in rows: this
                                 number of entries each */
    kmp_slope_matrix samples; /* of the next values of states that are sampled or change at events, in rows: these */
} kmp_slopes;

/** Ends of names of an input of the model, by the order of the derivative: u, u.d, u.dd. */
extern const char *const kmp_derivative_ends[KMP_TIME_NUMBERS];

/** Derives the partial derivatives for a system of a variant's model; `names`: of variable parameters, and of inputs of
 * the model and their derivatives. Includes the
 * outputs if requested, whose values equal kmp_eval_shown. A system whose model is not a variant has outputs, and
 * no parameters (count 0). KEMPE_E_ARGUMENT: a name that is not variable. KEMPE_E_MEMORY. */
kempe_status kmp_slopes_new(const kempe_system *system, const char *backend, int count, const char *const *names,
                            bool with_outputs, kmp_slopes **slopes);
void kmp_slopes_free(kmp_slopes *slopes);

/** The system's parameters have other values now. */
void kmp_slopes_renew_parameters(kmp_slopes *slopes);

/** Takes the state for derivatives of the equations. No allocation, also in the functions below. */
void kmp_slopes_at(kmp_slopes *slopes, const kmp_instant *at);

/** The change of the equations by parameter k, or by time (k = count, if `timed`), with which inputs of the model
 * change; `room` (3 m + n) receives its h, rate, curve and force in turn. */
kmp_change kmp_slopes_change(const kmp_slopes *slopes, int k, double *room);

/** Derivatives with respect to parameter k of the model's start values and rates (n each), independent of the state;
 * returns the derivative of the characteristic length. */
double kmp_slopes_of_start(const kmp_slopes *slopes, int k, double *q, double *qd);

/** out[k] += the derivative of w'(h, rate, curve, force) with respect to parameter k, for all parameters; a NULL part
 * of w is zero. */
void kmp_slopes_weighted(const kmp_slopes *slopes, const double *h, const double *rate, const double *curve,
                         const double *force, double *out);

/** Takes the state for outputs or conditions and their derivatives. Returns their values, in the order of
 * kmp_eval_shown or as kmp_eval_changes has them, valid until the next call. Conditions that end a run are zero. */
const double *kmp_slopes_values(kmp_slope_matrix *of, const kmp_instant *at);

/** The place among the outputs of the force of an element with modes, by its row of the system; -1: another row. */
int kmp_slopes_force_of_modes(const kmp_slopes *slopes, int row);

/** True if condition k depends on accelerations or multipliers. */
bool kmp_slopes_event_is_late(const kmp_slopes *slopes, int k);

/** A direction of differentiation, or a gradient; a NULL member is zero. */
typedef struct kmp_direction {
    double *t, *q, *qd, *qdd, *lambda; /* 1, n, n, n, m */
    double *parameters;                /* count */
} kmp_direction;

/** out = the derivative of all values along a direction; parameter k (negative: none) increases by one where
 * `parameters` is NULL. */
void kmp_slopes_along(const kmp_slopes *slopes, const kmp_slope_matrix *of, const kmp_direction *direction, int k,
                      double *out);

/** Adds the derivatives of w' values to each member that is not NULL. */
void kmp_slopes_gradient(const kmp_slopes *slopes, const kmp_slope_matrix *of, const double *w,
                         const kmp_direction *gradient);

/** Derivatives of a weighted sum of h, rate, curve (m each) and of the force (n), as in the rows of kmp_slopes, with
 * respect to parameters. One program, derived once, from the sum back to all of them: at a few times the cost of the
 * equations, whatever the number of parameters. Parameters that are in none of them, as start values, are left out. */
typedef struct kmp_slopes_sum {
    kmp_formulas formulas;
    int n, m, count; /* parameters of the sum */
    int *parameter;  /* count: their numbers among the names */
    double *weight;  /* of the program: of h, rate, curve and the force, one after the other */
} kmp_slopes_sum;

/** `names` as of kmp_slopes_new. KEMPE_E_MEMORY, also KEMPE_E_ARGUMENT: as there. */
kempe_status kmp_slopes_sum_init(kmp_slopes_sum *sum, const kempe_system *system, const kmp_backend *backend, int count,
                                 const char *const *names);
void kmp_slopes_sum_free(kmp_slopes_sum *sum);

/** Evaluates them (count) with the weights of `weight`, valid until the next call. No allocation. */
const double *kmp_slopes_sum_at(kmp_slopes_sum *sum, const kmp_instant *at);

/** Second derivatives of the equations along two numeric directions, for the change of a motion near a state when state
 * and parameters change. One program, derived once,
 *
 *     d/db d/da (R, h, rate, curve),    R = M qdd + C - J' lambda, rate = J qd + h_t, curve = J qdd + jdqd,
 *
 * with a a direction of (q, qd, qdd, lambda), and b a direction of these and of the variable parameters. */
typedef struct kmp_second_derivatives {
    kmp_formulas bent;
    int n, m, count; /* coordinates, rows, parameters */
    double *along;   /* of the program: a (3 n + m), b (3 n + m + count) */
} kmp_second_derivatives;

/** A direction: changes of q, qd, qdd (n each) and lambda (m). NULL: none. */
typedef struct kmp_variation {
    const double *q, *qd, *qdd, *lambda;
} kmp_variation;

/** Second derivatives of R (n), h, rate and curve (m each), valid until the next call. */
typedef struct kmp_second_values {
    const double *force, *h, *rate, *curve;
} kmp_second_values;

/** `names`: of variable parameters of the system's model; dependent parameters change with them. KEMPE_E_ARGUMENT: a
 * name that is not variable. KEMPE_E_FAILED: the user's force has no second derivatives. KEMPE_E_MEMORY. */
kempe_status kmp_second_derivatives_init(kmp_second_derivatives *second, const kempe_system *system,
                                         const kmp_backend *backend, int count, const char *const *names);
void kmp_second_derivatives_free(kmp_second_derivatives *second);

/** Evaluates them at the state of `bent`, along a and b; `parameter` is the change of each parameter along b (NULL:
 * none). No allocation. */
kmp_second_values kmp_second_derivatives_along(kmp_second_derivatives *second, const kmp_variation *a,
                                               const kmp_variation *b, const double *parameter);

/** Second derivatives of a weighted sum of the same values and of outputs, for the Hessian of functions of a motion.
 * One program of two stages, derived once: the gradient of the sum by s = (q, qd, qdd, lambda), and its change along a
 * direction of s. */
typedef struct kmp_curvature {
    kmp_formulas formulas;
    int n, m, shown; /* outputs */
    double *given;   /* of the program: a direction (3 n + m), then the weights */
    double *weight;  /* in it: of h, rate and curve (m each), of R (n) and of the outputs */
} kmp_curvature;

/** Without a user-defined force of the system. With the outputs if requested. KEMPE_E_MEMORY. */
kempe_status kmp_curvature_init(kmp_curvature *curvature, const kempe_system *system, const kmp_backend *backend,
                                bool with_outputs);
void kmp_curvature_free(kmp_curvature *curvature);

/** Takes a state, and the weights, which are in place. No allocation, also below. */
void kmp_curvature_at(kmp_curvature *curvature, const kmp_instant *at);

/** The change of the gradient along a direction (3 n + m each), valid until the next call. */
const double *kmp_curvature_along(kmp_curvature *curvature, const double *direction);
