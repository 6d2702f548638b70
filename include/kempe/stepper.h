/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A run advanced by the caller, who sets each end time and reads the state there.
 *
 *     kempe_run_options run = {0};
 *     run.t_end = 10;
 *     kempe_stepper *stepper;
 *     kempe_stepper_new(system, &run, &stepper);
 *     for (int k = 1; k <= 1000 && status == KEMPE_OK; k++) {
 *         status = kempe_stepper_advance(stepper, 0.01 * k);
 *         show(kempe_stepper_time(stepper), kempe_stepper_q(stepper));
 *     }
 *
 * Error control chooses the steps, independent of the requested times: kempe_simulate gives the same numbers. A time
 * that differs from a sample, an event or a stop only by rounding is that time. Its row has the values before it. A
 * stepper belongs to the thread of its context.
 *
 * Inputs. A value that the caller sets acts from the current time on, and no step goes beyond the requested time while
 * values may change. Inputs of the model (kempe/settings.h) are set by kempe_stepper_set_input: the integrator restarts
 * where a value jumps, and continues with its step size and order elsewhere. A one-step method keeps its step size when
 * it restarts. A multistep method (adams, bdf, ida) restarts at order one; where restarts are frequent, a one-step
 * method continues in its place (docs/solvers.md). A force function (kempe/extend.h) may also read other values:
 * each call then restarts the integrator, unless kempe_stepper_keep_inputs says that they are constant.
 *
 * Real time. The conditions: `fixed_step` in the options, formulation `projected`, change_points `ignore`, a model
 * without conditions and without spherical joints, one thread. Then kempe_stepper_advance over a given time and
 * kempe_stepper_step allocate nothing, take no lock and have a bounded number of operations. Elsewhere they make as
 * many steps as the tolerance needs, with up to 1000 attempts each. When coordinates, formulation or integrator change,
 * they allocate, and take a lock of the system for a moment.
 *
 * These functions never allocate, lock or iterate: kempe_stepper_set_input, kempe_stepper_set_input_rates,
 * kempe_stepper_input, kempe_stepper_keep_inputs, kempe_stepper_set_stop, kempe_stepper_work, kempe_stepper_reason and
 * the getters of the state. All others allocate: they make it again, with a bounded number of iterations that close
 * the loops. A failing call allocates its message.
 */
#ifndef KEMPE_STEPPER_H
#define KEMPE_STEPPER_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_stepper kempe_stepper;

/** Work done so far. `rejected` by the error test, `refused` by the mechanism or for lack of convergence; `centrings`
 * of spherical joints. */
typedef struct kempe_work {
    long steps, rejected, refused, rhs, newton, factorizations, exchanges, centrings;
} kempe_work;

/** Assembles at t = 0. The system must outlive the stepper. KEMPE_E_ARGUMENT: a name or number of the run is wrong, or
 * an option is of rows, references or checkpoints. KEMPE_E_FAILED: the run cannot start; KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_stepper_new(const kempe_system *system, const kempe_run_options *run,
                                         kempe_stepper **stepper);
KEMPE_API void kempe_stepper_free(kempe_stepper *stepper);

/** Advances to the end of the integrator's next step; after kempe_stepper_advance, to the end of the current one.
 * KEMPE_E_ARGUMENT at t_end. KEMPE_E_FAILED and KEMPE_STOPPED: see kempe_stepper_reason; the state is unchanged. */
KEMPE_API kempe_status kempe_stepper_step(kempe_stepper *stepper);

/** Advances to t (s), neither backwards nor beyond t_end (KEMPE_E_ARGUMENT), in as many steps as needed. The state at t
 * follows the last step's polynomial, with its loops closed. Without max_steps it fails (KEMPE_E_FAILED)
 * where the rest up to t would take 1e8 steps at the pace of its last 1e5 steps. A given max_steps bounds all steps of
 * the stepper together. */
KEMPE_API kempe_status kempe_stepper_advance(kempe_stepper *stepper, double t);

/** keep = 1: other inputs of the force function than t, q and qd are constant from now on, and the steps are as in
 * kempe_simulate. keep = 0 (initially): they may change between calls. */
KEMPE_API void kempe_stepper_keep_inputs(kempe_stepper *stepper, int keep);

/** Sets an input of the model to a constant in SI from the current time on, in place of its samples. The accelerations
 * of the current row remain those before the jump. KEMPE_E_ARGUMENT: there is no such input, the value is not finite,
 * or a closure depends on the input and its value or rate would jump. */
KEMPE_API kempe_status kempe_stepper_set_input(kempe_stepper *stepper, int input, double value);

/** Sets it to value + rate s + acceleration s^2 / 2, where s is the time since now. */
KEMPE_API kempe_status kempe_stepper_set_input_rates(kempe_stepper *stepper, int input, double value, double rate,
                                                     double acceleration);

/** Value of an input at the current time, before a value that was set there; NaN: there is no such input. */
KEMPE_API double kempe_stepper_input(const kempe_stepper *stepper, int input);

/** No step goes beyond t until the stepper is there: a place where a force function jumps. One time is kept, also by
 * saved states; INFINITY: none. KEMPE_E_ARGUMENT: t is not after the current time. */
KEMPE_API kempe_status kempe_stepper_set_stop(kempe_stepper *stepper, double t);

/** Continues from another state at the current time: the closed state near q and qd (n each; qd NULL: at rest).
 * `*moved` (NULL: not required): the largest change of a coordinate that closing made, rad, or over the characteristic
 * length. KEMPE_E_FAILED: the loops cannot be closed from there, and the stepper is unchanged. */
KEMPE_API kempe_status kempe_stepper_set_state(kempe_stepper *stepper, const double *q, const double *qd,
                                               double *moved);

/** Gives parameters of the model other values in SI from the current time on, `count` names and values. The equations
 * are derived again, taking milliseconds, and the loops are closed; `*moved` as for kempe_stepper_set_state. Values
 * that were given before remain. Saved states and outputs of before no longer fit. KEMPE_E_ARGUMENT: a parameter does
 * not exist or determines values outside the equations; KEMPE_E_INPUT, KEMPE_E_FAILED: the model cannot have these
 * values here. The stepper is then unchanged. */
KEMPE_API kempe_status kempe_stepper_set_parameters(kempe_stepper *stepper, int count, const char *const *names,
                                                    const double *values, double *moved);

/** Returns to t = 0 and the model's start, with the model's own inputs: as a new stepper. */
KEMPE_API kempe_status kempe_stepper_reset(kempe_stepper *stepper);

/** A stepper's state to return to. */
typedef struct kempe_stepper_state kempe_stepper_state;

/** Saves the current state. The integrator restarts here, only from the saved numbers: what follows has the same bits
 * as what follows a kempe_stepper_restore, here or in another stepper of the same system and options. Samples and
 * events at this time that have been taken are not taken again. Samples still to come are taken when the stepper
 * continues.
 */
KEMPE_API kempe_status kempe_stepper_save(kempe_stepper *stepper, kempe_stepper_state **state);
KEMPE_API kempe_status kempe_stepper_restore(kempe_stepper *stepper, const kempe_stepper_state *state);
KEMPE_API void kempe_stepper_state_free(kempe_stepper_state *state);

/** Makes another stepper at the same state, by saving and restoring. */
KEMPE_API kempe_status kempe_stepper_copy(kempe_stepper *stepper, kempe_stepper **copy);

/** The current state: t in s; q, qd, qdd (n values) and lambda (row_count of the system), owned by the stepper and
 * overwritten by the next step. */
KEMPE_API double kempe_stepper_time(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_q(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_qd(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_qdd(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_lambda(const kempe_stepper *stepper);

KEMPE_API kempe_work kempe_stepper_work(const kempe_stepper *stepper);

/** Not checked: all is well so far, and nothing repeats the run; not trustworthy: a warning since the start has the
 * reason; stopped or failed: the last call that moves it. And its reason as a sentence, "" if it is neither of these.
 */
KEMPE_API kempe_outcome kempe_stepper_outcome(const kempe_stepper *stepper);
KEMPE_API const char *kempe_stepper_reason(const kempe_stepper *stepper);

KEMPE_END
#endif
