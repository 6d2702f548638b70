/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Exact derivatives of the equations of motion at one state, or at many, also through closed loops: for optimal
 * control, identification and learning.
 *
 *     const char *const names[] = {"force", "rod_mass"};                   an input and a parameter of the model
 *     kempe_workspace_add_derivatives(workspace, 2, names, NULL);
 *     kempe_workspace_derivatives out = {.udd_u = A, .udd_ud = D, .udd_p = B};
 *     kempe_workspace_forward_derivatives(workspace, t, q, qd, NULL, qdd, lambda, &out);
 *
 * A workspace (kempe/workspace.h) is prepared once; a call then costs as much as a few forward dynamics.
 */
#ifndef KEMPE_DERIVATIVES_H
#define KEMPE_DERIVATIVES_H

#include <kempe/workspace.h>

KEMPE_BEGIN

/** Places for derivatives, column-major; NULL: not required. p is the number of independent coordinates, k the number
 * of names that the workspace was prepared for.
 *
 * In all coordinates, as functions of q, qd, Q and the named inputs and parameters, which need not close the loops:
 * from M qdd + C = Q + J' lambda and J qdd + jdqd = 0 by the implicit-function theorem.
 *
 * Along motions that keep the loops closed: the independent accelerations udd by u, by their rates ud, by Q and by the
 * named inputs and parameters (dp). All coordinates change by dq = q_u du + q_p dp and
 * dqd = q_u dud + qd_u du + qd_p dp (Wehage and Haug, J. Mech. Des. 104, 1982).
 *
 * Outputs y (l values): positions, velocities, accelerations, sensors, forces and reactions, whose accelerations and
 * multipliers follow from the state. */
typedef struct kempe_workspace_derivatives {
    double *qdd_q, *qdd_qd, *qdd_Q;          /* n x n */
    double *lambda_q, *lambda_qd, *lambda_Q; /* m x n; rows of redundant constraint equations are zero */
    double *udd_u, *udd_ud, *udd_Q;          /* p x p, p x p, p x n */
    double *q_u, *qd_u;                      /* n x p */
    double *qdd_p, *lambda_p;                /* n x k, m x k */
    double *udd_p, *q_p, *qd_p;              /* p x k, n x k, n x k */
    double *y, *y_q, *y_qd, *y_Q, *y_p;      /* l; l x n, l x k: in all coordinates */
    double *y_u, *y_ud, *y_up;               /* l x p, l x p, l x k: along closed motions */
} kempe_workspace_derivatives;

/** Places for derivatives of inverse dynamics, column-major; NULL: not required. */
typedef struct kempe_inverse_derivatives {
    double *Q_q, *Q_qd, *Q_qdd; /* n x n; the last one is M */
    double *Q_p;                /* n x k */
} kempe_inverse_derivatives;

/** Prepares the calls below: derives the derivatives of the equations, or reads them from the cache. `names` (count; 0:
 * none): inputs and parameters of the model by which derivatives are taken, too; parameters that depend on a named one
 * change with it, unless they are named as well. The modes, mean axes and modal
 * damping of a flexible body follow from its present numbers and do not change. In the thread that made the system.
 * `outputs`: words separated by commas, as kempe_outputs_new takes them, such as "position(coupler.C), force(spring)";
 * NULL: none. Another call replaces names and outputs. KEMPE_E_ARGUMENT, with the reason in the message: the model has
 * rigid contacts, and the workspace was made without "stick"; a name is neither an input nor a parameter that may vary,
 * or is given twice. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workspace_add_derivatives(kempe_workspace *workspace, int count, const char *const *names,
                                                       const char *outputs);

/** The number of names of the last kempe_workspace_add_derivatives. */
KEMPE_API int kempe_workspace_name_count(const kempe_workspace *workspace);

/** The number of values of its outputs, and the name of one, as of a column in a result file; NULL: there is none. */
KEMPE_API int kempe_workspace_output_count(const kempe_workspace *workspace);
KEMPE_API const char *kempe_workspace_output_name(const kempe_workspace *workspace, int k);

/** Accelerations qdd (n), multipliers lambda (m; NULL: not required; zero in rows of friction that slips, whose force
 * is the output force(NAME)) and their exact derivatives, for the present inputs and conditions of the model. In a
 * workspace made with "stick", friction and contacts keep the modes that they have at the state (kempe_workspace_mode).
 * Only the loops count for the independent coordinates. Friction that shares its load with others at rest keeps its
 * force. Forces that depend on multipliers change with these. A user-defined force is differentiated by differences.
 * After kempe_workspace_add_derivatives; no allocation. KEMPE_E_ARGUMENT: not prepared, or t is not finite.
 * KEMPE_E_FAILED, with the reason: as kempe_workspace_forward_dynamics; derivatives by u are requested where u does not
 * describe the motion, or where the loops are open. */
KEMPE_API kempe_status kempe_workspace_forward_derivatives(kempe_workspace *workspace, double t, const double *q,
                                                           const double *qd, const double *Q, double *qdd,
                                                           double *lambda, const kempe_workspace_derivatives *out);

/** The same at `count` states, with rows of the sizes above for each state, and with the same bits; arguments as in
 * kempe_workspace_forward_states. Groups of 8 states run in vector registers as in kempe_workspace_evaluate_states,
 * where the independent coordinates describe the motion. Ends at the first state that fails, with its status. *failed
 * (may be NULL): that state; -1: none. */
KEMPE_API kempe_status kempe_workspace_derivative_states(kempe_workspace *workspace, int count, const double *t,
                                                         int t_step, const double *q, const double *qd, const double *Q,
                                                         double *qdd, double *lambda,
                                                         const kempe_workspace_derivatives *rows, int *failed);

/** A change of the state; NULL: zero. All coordinates, their rates and forces (n each), which need not close the loops,
 * and the named inputs and parameters (k) change. Along closed motions the independent coordinates and their rates
 * (p each) take the place of q and qd. */
typedef struct kempe_state_direction {
    const double *q, *qd, *Q, *p;
    const double *u, *ud;
} kempe_state_direction;

/** Places for the same; NULL: not required. */
typedef struct kempe_state_gradient {
    double *q, *qd, *Q, *p;
    double *u, *ud;
} kempe_state_gradient;

/** Accelerations (n), multipliers (m) and outputs (l), and coordinates and their rates (n each), of which the dependent
 * ones follow along closed motions; or weights of them. NULL: not required, or zero. */
typedef struct kempe_forward_values {
    double *qdd, *lambda, *y;
    double *q, *qd;
} kempe_forward_values;

/** The derivative of accelerations, multipliers and outputs along a direction (Jacobian-vector product), without the
 * matrices: one further solution of the equations. `value` (may be NULL) receives the values themselves. After
 * kempe_workspace_add_derivatives; no allocation. Errors as kempe_workspace_forward_derivatives; KEMPE_E_ARGUMENT also:
 * q or qd together with u or ud, or a number that is not finite. */
KEMPE_API kempe_status kempe_workspace_forward_jvp(kempe_workspace *workspace, double t, const double *q,
                                                   const double *qd, const double *Q,
                                                   const kempe_state_direction *direction,
                                                   const kempe_forward_values *value,
                                                   const kempe_forward_values *change);

/** The gradient of a weighted sum of accelerations, multipliers and outputs (vector-Jacobian product). It costs one
 * further solution of the equations whatever the number of coordinates and names; along closed motions also one
 * change for each independent coordinate and name. Weights of multipliers of redundant constraint equations do not
 * count. Otherwise as kempe_workspace_forward_jvp. */
KEMPE_API kempe_status kempe_workspace_forward_vjp(kempe_workspace *workspace, double t, const double *q,
                                                   const double *qd, const double *Q,
                                                   const kempe_forward_values *weight,
                                                   const kempe_forward_values *value,
                                                   const kempe_state_gradient *gradient);

/** Prepares second derivatives, after kempe_workspace_add_derivatives: derives the second derivatives of the equations
 * along two directions. In the thread that made the system. KEMPE_E_ARGUMENT: not prepared for first ones; a
 * user-defined force has none. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workspace_add_second_derivatives(kempe_workspace *workspace);

/** The second derivative of accelerations and multipliers along two directions of all coordinates, their rates and
 * forces (members q, qd and Q): `change`, whose y, q and qd must be NULL. With a direction twice it is the curvature
 * along it; a product of the Hessian with a vector is a call for each unit direction. After
 * kempe_workspace_add_second_derivatives; no allocation. Errors as kempe_workspace_forward_jvp; KEMPE_E_ARGUMENT also:
 * a direction of p, u or ud. */
KEMPE_API kempe_status kempe_workspace_forward_second(kempe_workspace *workspace, double t, const double *q,
                                                      const double *qd, const double *Q,
                                                      const kempe_state_direction *first,
                                                      const kempe_state_direction *second,
                                                      const kempe_forward_values *change);

/** Prepares Hessians of the present outputs, after kempe_workspace_add_derivatives, whose next call removes them. In
 * the thread that made the system. KEMPE_E_ARGUMENT: not prepared for first derivatives. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workspace_add_hessians(kempe_workspace *workspace);

/** The Hessian of a weighted sum of accelerations, multipliers, outputs and coordinates: its second derivatives along
 * each pair of `count` directions (count x count, symmetric). Directions are of all coordinates, their rates and
 * forces. Along closed motions the independent coordinates and their rates take the place of q and qd. Unit directions
 * make the Hessian by all of them. A call costs one further solution of the equations, and for each direction one
 * change of the state and one change of the sum's gradient. Derivatives of a user-defined force are differences, with
 * an error of 1e-7 of its curvature. After kempe_workspace_add_hessians; no allocation after the first call with as
 * many directions. Errors as kempe_workspace_forward_jvp; KEMPE_E_ARGUMENT also: a direction of p. */
KEMPE_API kempe_status kempe_workspace_forward_hessian(kempe_workspace *workspace, double t, const double *q,
                                                       const double *qd, const double *Q,
                                                       const kempe_forward_values *weight, int count,
                                                       const kempe_state_direction *directions, double *hessian);

/** The same at `count` states, of rows of weights for each state, along the same directions, with the same bits;
 * otherwise as kempe_workspace_derivative_states. */
KEMPE_API kempe_status kempe_workspace_hessian_states(kempe_workspace *workspace, int count, const double *t,
                                                      int t_step, const double *q, const double *qd, const double *Q,
                                                      const kempe_forward_values *weights, int direction_count,
                                                      const kempe_state_direction *directions, double *hessians,
                                                      int *failed);

/** Prepares the determinant of the loops, in the thread that made the system. KEMPE_E_ARGUMENT: the independent
 * coordinates are not known. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workspace_add_determinant(kempe_workspace *workspace);

/** The logarithm of |det Jv| at `count` states with closed loops, and its exact first and second derivatives by
 * the independent coordinates along closed motions (p, p x p). NULL: not required. Jv has the columns
 * of J of the dependent coordinates, and the independent rows of the start. The loops are in a singular position where
 * the determinant is zero; assembly modes meet there. A state that fails, and interrupts: as
 * kempe_workspace_derivative_states. After kempe_workspace_add_determinant; no allocation. KEMPE_E_FAILED: the position
 * is singular, or the loops are open. */
KEMPE_API kempe_status kempe_workspace_determinant_states(kempe_workspace *workspace, int count, const double *t,
                                                          int t_step, const double *q, double *logarithm, double *by_u,
                                                          double *by_uu, int *failed);

/** Derivatives of the state x = (u, ud) after steps, column-major; NULL: not required: by the state before, by the
 * forces Q, which are constant meanwhile, and by the names. */
typedef struct kempe_step_derivatives {
    double *x_x, *x_Q, *x_p; /* 2 p x 2 p, 2 p x n, 2 p x k */
} kempe_step_derivatives;

/** Takes `steps` steps of h (s; negative: back) from q and qd (n) to their new values. Loops that are open
 * by at most 0.01 (relative) are closed first. The steps are of the classical Runge-Kutta method of order four in the
 * independent coordinates, with the loops closed at each stage. `out` (may be NULL) receives the derivatives of this
 * map itself, exact but for rounding. Q (NULL: zero) and the inputs are constant, or follow time as the model's inputs
 * do. The error of a step is proportional to h^5: a smaller h shows it. After kempe_workspace_add_derivatives; no
 * allocation after the first call. KEMPE_E_ARGUMENT: not prepared, h is zero, no step, a number is not finite.
 * KEMPE_E_FAILED, with the reason: the loops are open, cannot be closed, or the independent coordinates do not describe
 * the motion at a stage; q and qd are unchanged. KEMPE_STOPPED: kempe_context_interrupt between two steps; they are
 * unchanged, too. */
KEMPE_API kempe_status kempe_workspace_step(kempe_workspace *workspace, double t, double h, int steps, double *q,
                                            double *qd, const double *Q, const kempe_step_derivatives *out);

/** Generalized forces Q = M qdd + C (n), as kempe_workspace_inverse_dynamics has them, and their exact derivatives.
 * After kempe_workspace_add_derivatives; no allocation. KEMPE_E_ARGUMENT: not prepared, or t or an acceleration is not
 * finite. */
KEMPE_API kempe_status kempe_workspace_inverse_derivatives(kempe_workspace *workspace, double t, const double *q,
                                                           const double *qd, const double *qdd, double *Q,
                                                           const kempe_inverse_derivatives *out);

KEMPE_END

#endif
