/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * The equations of motion at one state, for user programs: control, optimisation, other integrators.
 *
 *     kempe_workspace *ws;
 *     kempe_workspace_new(system, &ws);
 *     kempe_workspace_evaluate(ws, t, q, qd);
 *     const double *M = kempe_workspace_mass(ws);            n x n, column-major
 *     kempe_workspace_forward_dynamics(ws, t, q, qd, NULL, qdd, lambda);
 *
 * If forces of the model depend on multipliers, C excludes that load until kempe_workspace_forward_dynamics has
 * computed them.
 *
 * The equations are M(q) qdd + C(q, qd, t) = Q + J' lambda, h(q, t) = 0; n coordinates (rad or m), m closure rows.
 *
 * Equations are evaluated by machine code. Accelerations are computed as in a run: by articulated bodies if that costs
 * less (docs/solvers.md), otherwise on the independent rows and coordinates of the model's start. If these are singular
 * or the start cannot be assembled, rows are chosen at each state. Near closed states, rows that are redundant at the
 * start count only if J exceeds the error of h.
 *
 * States (docs/model/states.md) with samples or events have the rate zero: they change only between calls, by the
 * caller. The rate of a delayed signal is not the rate of a run, because a state has no past; a warning reports this.
 *
 * A workspace belongs to one thread at a time; any number of them may work on one system. Make and free workspaces in
 * the thread that made the system. After kempe_workspace_new nothing here allocates, but the first calls for many
 * states; nothing touches the context: error messages are in kempe_workspace_message.
 */
#ifndef KEMPE_WORKSPACE_H
#define KEMPE_WORKSPACE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_workspace kempe_workspace;

/** Makes a workspace; the model is assembled once. The system must outlive it. Dry friction that sticks in runs only
 * slips here, as with "slip" below, and a warning reports this. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workspace_new(const kempe_system *system, kempe_workspace **workspace);

/** Makes one with another part of dry friction that sticks. "slip": an element has its level against its rate, and no
 * force at rest. "stick": at each state elements stick or slip, and rigid contacts are closed or open, as in a run that
 * starts there. Elements that stick and closed contacts have rows in h, J and jdqd, and their force is lambda. Such
 * evaluations allocate, and change the message of the context where friction has no solution or several: one thread at
 * a time may use the system. They fail where surfaces overlap or strike. "none": no such friction acts. Friction with a
 * `speed` has its law in all of them. KEMPE_E_ARGUMENT: another word. */
KEMPE_API kempe_status kempe_workspace_new_with_friction(const kempe_system *system, const char *friction,
                                                         kempe_workspace **workspace);
KEMPE_API void kempe_workspace_free(kempe_workspace *workspace);

/** Message of the last call on this workspace: one sentence, never NULL. It is why the call failed, or, after one that
 * succeeded, a table that the state leaves (the first state of many): values are not to be trusted there. "": none. */
KEMPE_API const char *kempe_workspace_message(const kempe_workspace *workspace);

/** Evaluates everything below at t (s), q and qd (n values each; qd NULL: at rest). q need not close the loops.
 * KEMPE_E_FAILED: a value is not finite there. */
KEMPE_API kempe_status kempe_workspace_evaluate(kempe_workspace *workspace, double t, const double *q,
                                                const double *qd);

/** Sets an input of the model (kempe/settings.h) to value + rate s + acceleration s^2 / 2, where s is the time since t,
 * in place of its samples. KEMPE_E_ARGUMENT: there is no such input, or a number is not finite. */
KEMPE_API kempe_status kempe_workspace_set_input(kempe_workspace *workspace, int input, double t, double value,
                                                 double rate, double acceleration);

/** Values at the state of the last kempe_workspace_evaluate or call for dynamics. The workspace owns them, and the next
 * call overwrites them. M (n x n, symmetric), C (n: bias on the side of M qdd, applied forces included with their sign
 * changed), h (m), J = dh/dq (m x n), jdqd (m): d2h/dt2 = J qdd + jdqd. Matrices are column-major. */
KEMPE_API const double *kempe_workspace_mass(const kempe_workspace *workspace);
KEMPE_API const double *kempe_workspace_bias(const kempe_workspace *workspace);
KEMPE_API const double *kempe_workspace_h(const kempe_workspace *workspace);
KEMPE_API const double *kempe_workspace_jacobian(const kempe_workspace *workspace);
KEMPE_API const double *kempe_workspace_jdqd(const kempe_workspace *workspace);

/** The numbers of the rows of closures and drives, from 0; the other rows are of friction and contacts, and are zero
 * while these slip or are open. The workspace owns them. */
KEMPE_API int kempe_workspace_closure_row_count(const kempe_workspace *workspace);
KEMPE_API const int *kempe_workspace_closure_rows(const kempe_workspace *workspace);

/** Elements of friction that may stick, and rigid contacts, of a workspace made with "stick": how many there are, the
 * name of one, and its mode at the last state. Friction "slips" or "sticks"; it "shares" where others share its load,
 * and is "undetermined" where the loops keep its place. A contact is "closed" or "open", or "shares"; its friction is
 * "open" with it. NULL: there is no such element, or no state yet. */
KEMPE_API int kempe_workspace_mode_count(const kempe_workspace *workspace);
KEMPE_API const char *kempe_workspace_mode_name(const kempe_workspace *workspace, int k);
KEMPE_API const char *kempe_workspace_mode(const kempe_workspace *workspace, int k);

/** Keeps modes at all further states: of the last state of `of`, which may be the workspace itself, or another one of
 * the same system. NULL: they are decided on again at each state. Modes that are kept are not checked: a contact may
 * pull, and surfaces may overlap. The equations of one phase of contact are then a smooth function of the state.
 * KEMPE_E_ARGUMENT: `of` has evaluated no state, or is of another system. */
KEMPE_API kempe_status kempe_workspace_keep_modes(kempe_workspace *workspace, const kempe_workspace *of);

/** Places for values at many states, a row of the sizes above for each state; NULL: not required. */
typedef struct kempe_workspace_rows {
    double *mass, *bias, *h, *jacobian, *jdqd;
} kempe_workspace_rows;

/** Evaluates `count` states, rows of q and qd (count x n; qd NULL: at rest), with the bits of kempe_workspace_evaluate;
 * t has a value for each state, or one for all (t_step 0). Groups of 8 states run in vector registers, after five
 * hundred states, unless the model has conditions, forces that depend on multipliers or a user-defined force. That
 * preparation allocates once. Ends at the first state that fails, with its status; with KEMPE_STOPPED before another
 * state after kempe_context_interrupt. *failed (may be NULL): that state; -1: none. */
KEMPE_API kempe_status kempe_workspace_evaluate_states(kempe_workspace *workspace, int count, const double *t,
                                                       int t_step, const double *q, const double *qd,
                                                       const kempe_workspace_rows *rows, int *failed);

/** Kinetic energy, and potential energy of gravity and springs, at that state, J. */
KEMPE_API double kempe_workspace_kinetic(const kempe_workspace *workspace);
KEMPE_API double kempe_workspace_potential(const kempe_workspace *workspace);

/** Generalized forces that the tree needs for qdd: Q = M qdd + C (n; N m or N), in addition to the model's forces.
 * Loops count as open. KEMPE_E_ARGUMENT: a force depends on multipliers, which kempe_workspace_actuator_forces has. */
KEMPE_API kempe_status kempe_workspace_inverse_dynamics(kempe_workspace *workspace, double t, const double *q,
                                                        const double *qd, const double *qdd, double *Q);

/** Accelerations qdd (n) and multipliers lambda (m; zero for redundant rows; of friction that slips its force, as in
 * rows of runs; NULL: not required) under the model's forces and the generalized forces Q (n; NULL: none).
 * KEMPE_E_FAILED, outputs untouched: a motion carries no mass. KEMPE_E_ARGUMENT: the model has rigid contacts, and the
 * workspace was made without "stick". */
KEMPE_API kempe_status kempe_workspace_forward_dynamics(kempe_workspace *workspace, double t, const double *q,
                                                        const double *qd, const double *Q, double *qdd, double *lambda);

/** Accelerations (count x n) and multipliers (count x m; NULL: not required) at `count` states, with the bits of
 * kempe_workspace_forward_dynamics; Q: rows, too, or NULL. Arguments, and what is evaluated in groups: as in
 * kempe_workspace_evaluate_states; states by articulated bodies are not. */
KEMPE_API kempe_status kempe_workspace_forward_states(kempe_workspace *workspace, int count, const double *t,
                                                      int t_step, const double *q, const double *qd, const double *Q,
                                                      double *qdd, double *lambda, int *failed);

/** The number of independent coordinates u, and their numbers among all (owned by the workspace). Kempe chose them at
 * the start of the model. Friction that sticks and closed contacts do not count. 0 and NULL: the start cannot
 * be assembled. */
KEMPE_API int kempe_workspace_independent_count(const kempe_workspace *workspace);
KEMPE_API const int *kempe_workspace_independent(const kempe_workspace *workspace);

/** Closes the loops at t: changes q, and then qd (NULL: not required), as little as possible. Coordinates with hold[i]
 * not 0 (n; NULL: none) keep q and qd. KEMPE_E_FAILED, q and qd untouched: the loops cannot be closed from here. */
KEMPE_API kempe_status kempe_workspace_close(kempe_workspace *workspace, double t, double *q, double *qd,
                                             const int *hold);

KEMPE_END
#endif
