/* SPDX-License-Identifier: BSD-3-Clause */
/* What parameters do, exactly: the partial derivatives of the equations and of the outputs by named parameters that a
 * variant keeps open (model/variant.h), with coordinates, rates, accelerations, multipliers and time held. The
 * derivative by a parameter goes through all that follow from it. What follows of it for a mechanism is
 * kmp_linear_follow (analysis/linear.h). Derived once; values of parameters may change. */
#ifndef KMP_DERIVATIVES_PARAMETER_SLOPES_H
#define KMP_DERIVATIVES_PARAMETER_SLOPES_H

#include "integrators/formulations/reduced_jacobian.h"

/** Derivatives of one program by columns, and the program. */
typedef struct kmp_slope_matrix {
    int count, rows, columns;
    kmp_tangent *entry;
    int *start; /* columns + 1 */
    kmp_formulas formulas;
    const double *value; /* at the last state; NULL: nothing is in them, or they were not asked for */
} kmp_slope_matrix;

typedef struct kmp_slopes {
    const kempe_system *system;
    int n, m, count; /* parameters */
    int shown;       /* output values */
    kmp_slope_matrix
        equations; /* rows: h, rate, curve (m each), force, start q and qd (n each), length; a column a parameter */
    kmp_slope_matrix outputs; /* columns: t, q, qd, qdd (n each), lambda (m), parameters */
    kmp_slope_matrix events;  /* likewise; rows: the conditions of the system */
} kmp_slopes;

/** The equations of a system that has met all its conditions: none is added. `events` outlive them. */
kempe_status kmp_slopes_equations(kmp_equations *eq, const kempe_system *system, kmp_events *events, unsigned sets);

/** Of the equations: h, J qd + h_t and J qdd + jdqd (m each), M qdd + C - J' lambda (n). */
void kmp_slopes_collect(const kmp_equations *eq, kmp_ref *of);

/** Which parameters the names are. KEMPE_E_ARGUMENT: one that does not stay open. */
kempe_status kmp_slopes_find(const kempe_system *system, int count, const char *const *names, int *parameter);

/** Adds to leaves (`count`, room for all parameters behind them) that move in some directions the parameters that
 * follow from them, each behind those that it needs: they move as their expressions do. How many there are; -1: no
 * memory. */
int kmp_slopes_lead(const kmp_tree *tree, int count, kmp_ref *leaf, kmp_ref *direction);

/** Derives them for a system of a variant's model; `names`: of parameters that vary. With the outputs, if asked for,
 *  whose values are those of kmp_plant_shown. A system whose model is no variant has outputs, and no parameters (count
 *  0). KEMPE_E_ARGUMENT: a name that does not stay open. KEMPE_E_MEMORY. */
kempe_status kmp_slopes_new(const kempe_system *system, const char *backend, int count, const char *const *names,
                            bool with_outputs, kmp_slopes **slopes);
void kmp_slopes_free(kmp_slopes *slopes);

/** The system's parameters have other values now. */
void kmp_slopes_renew_parameters(kmp_slopes *slopes);

/** Takes the state at which the derivatives of the equations are wanted. No allocation, as all that follow. */
void kmp_slopes_at(kmp_slopes *slopes, const kmp_instant *at);

/** The change that parameter k makes of the equations; `room` (3 m + n) holds its h, rate, curve and force in turn. */
kmp_change kmp_slopes_change(const kmp_slopes *slopes, int k, double *room);

/** By parameter k: of the model's start values and rates (n each), wherever the state is; returns that of the
 *  characteristic length. */
double kmp_slopes_of_start(const kmp_slopes *slopes, int k, double *q, double *qd);

/** out[k] += what changes of w'(h, rate, curve, force) by parameter k, for all of them; a NULL part of w is zero. */
void kmp_slopes_weighted(const kmp_slopes *slopes, const double *h, const double *rate, const double *curve,
                         const double *force, double *out);

/** Takes the state at which outputs or conditions and their derivatives are wanted; their values, in the order of
 * kmp_plant_shown or as kmp_plant_changes has them, valid until the next call. Conditions that end a run are zero. */
const double *kmp_slopes_values(kmp_slope_matrix *of, const kmp_instant *at);

/** A direction in which they are differentiated, or a gradient; NULL: none of it. */
typedef struct kmp_direction {
    double *t, *q, *qd, *qdd, *lambda; /* 1, n, n, n, m */
    double *parameters;                /* count; of a gradient alone */
} kmp_direction;

/** out = the derivative of them all along a direction in which parameter k (negative: none) goes on by one. */
void kmp_slopes_along(const kmp_slopes *slopes, const kmp_slope_matrix *of, const kmp_direction *direction, int k,
                      double *out);

/** Adds the derivatives of w' values to what is not NULL. */
void kmp_slopes_gradient(const kmp_slopes *slopes, const kmp_slope_matrix *of, const double *w,
                         const kmp_direction *gradient);

#endif
