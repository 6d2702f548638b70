/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Outputs of a mechanism by handle: at given coordinates, at a stepper, at any time of a run; and Jacobians of
 * outputs that move, in all coordinates and in the independent ones (closed chain).
 *
 *     kempe_outputs *outputs;
 *     kempe_outputs_new(system, "position(platform.C1), force(spring), power", &outputs);
 *     double values[7];                                       kempe_outputs_count of them
 *     kempe_outputs_at_stepper(outputs, stepper, values);
 *
 * The words are as under `outputs` in a model file (docs/model/outputs.md); a component may follow, as in
 * position(b.P).x. Conditions in expressions are evaluated at the state.
 *
 * Jacobians. The rate of a position is J qd + (part of the time), its acceleration J qdd + jdqd. An output that depends
 * on rates, as a velocity, has the rate J qdd + jdqd. With the loops closed qd = X ud + x_t, where u are the
 * independent coordinates, and the closed-chain Jacobian is J X.
 *
 * An object belongs to one thread at a time. After kempe_outputs_new nothing here allocates, but kempe_outputs_choose
 * and failing calls do.
 */
#ifndef KEMPE_OUTPUT_HANDLES_H
#define KEMPE_OUTPUT_HANDLES_H

#include <kempe/kempe.h>
#include <kempe/stepper.h>
#include <kempe/table.h>

KEMPE_BEGIN

typedef struct kempe_outputs kempe_outputs;

/** Prepares outputs, words separated by commas. The system must outlive them. KEMPE_E_ARGUMENT: a word is wrong. */
KEMPE_API kempe_status kempe_outputs_new(const kempe_system *system, const char *words, kempe_outputs **outputs);
KEMPE_API void kempe_outputs_free(kempe_outputs *outputs);

/** Number of values; name and unit of one, as of a column in a result file; number of the value with a name, -1: there
 * is none. */
KEMPE_API int kempe_outputs_count(const kempe_outputs *outputs);
KEMPE_API const char *kempe_outputs_name(const kempe_outputs *outputs, int k);
KEMPE_API const char *kempe_outputs_unit(const kempe_outputs *outputs, int k);
KEMPE_API int kempe_outputs_find(const kempe_outputs *outputs, const char *name);

/** Values (kempe_outputs_count) at t (s), q, qd, qdd (n each) and lambda (row_count of the system), with the model's
 * inputs. NULL for qd, qdd or lambda: zero. */
KEMPE_API kempe_status kempe_outputs_at_state(kempe_outputs *outputs, double t, const double *q, const double *qd,
                                              const double *qdd, const double *lambda, double *values);

/** Values at the current row of a stepper, with its inputs; at a row of a trajectory. */
KEMPE_API kempe_status kempe_outputs_at_stepper(kempe_outputs *outputs, const kempe_stepper *stepper, double *values);
KEMPE_API kempe_status kempe_outputs_at_row(kempe_outputs *outputs, const kempe_trajectory *trajectory, int row,
                                            double *values);

/** State at a time (s) of a run that was made with keep_dense: q, qd, qdd (n each), lambda (row_count of the system),
 * NULL: not required. It is the row that the run had written there, up to the last digits: from the polynomial of its
 * step, with the loops closed, accelerations and multipliers solved for. At an event or a sample it is the state
 * before. A trajectory with keep_dense holds its run and about 10 numbers per unknown and step (docs/outputs.md). It
 * belongs to one thread at a time. KEMPE_E_ARGUMENT: it has no dense output, or t is not within the run.
 * KEMPE_E_FAILED: the run could not have written that row. */
KEMPE_API kempe_status kempe_trajectory_at_time(kempe_trajectory *trajectory, double t, double *q, double *qd,
                                                double *qdd, double *lambda);

/** Values of the outputs there. */
KEMPE_API kempe_status kempe_outputs_at_time(kempe_outputs *outputs, kempe_trajectory *trajectory, double t,
                                             double *values);

/** J (count x n) and jdqd (count; NULL: not required) at t, q and qd (NULL: at rest), column-major. Rows of outputs
 * that depend on accelerations or multipliers are NaN. */
KEMPE_API kempe_status kempe_outputs_jacobian(kempe_outputs *outputs, double t, const double *q, const double *qd,
                                              double *jacobian, double *jdqd);

/** Chooses the independent coordinates of closed-chain Jacobians by names separated by commas; NULL: the choice at the
 * model's start, which holds without a call. KEMPE_E_ARGUMENT, KEMPE_E_FAILED: the choice is impossible. */
KEMPE_API kempe_status kempe_outputs_choose(kempe_outputs *outputs, const char *independent);

/** Number p of independent coordinates, and their numbers among all (p; owned by the object). */
KEMPE_API int kempe_outputs_independent_count(const kempe_outputs *outputs);
KEMPE_API const int *kempe_outputs_independent(const kempe_outputs *outputs);

/** Closed-chain Jacobian J X (count x p) at t and closed q, and the accelerations of the outputs at udd = 0 and qd
 * (`drift`, count; NULL: not required; qd NULL: at rest). KEMPE_E_FAILED: the loops are open, or the mechanism is at a
 * dead centre of these coordinates; the message names the coordinate that stops and one that moves. */
KEMPE_API kempe_status kempe_outputs_closed_jacobian(kempe_outputs *outputs, double t, const double *q,
                                                     const double *qd, double *jacobian, double *drift);

KEMPE_END
#endif
