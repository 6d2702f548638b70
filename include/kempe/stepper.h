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
 * Error control chooses the steps, independent of the requested times: kempe_simulate gives the same numbers. A stepper
 * belongs to the thread of its context.
 *
 * Inputs. A force function (kempe/extend.h) may read values that the caller sets between calls, as a controller or a
 * sampled signal does. Such a value acts from the current time on: with a force function each call restarts the
 * integrator there and makes no step beyond the requested time. One-step methods keep their step size. A multistep
 * method (adams, bdf, ida) restarts at order one, which is slow with many short calls. A force that depends on t, q and
 * qd alone needs no restart: kempe_stepper_keep_inputs.
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

/** Assembles at t = 0; `output_step`, `reference` and checkpoints of the run are ignored. The system must outlive the
 * stepper. KEMPE_E_ARGUMENT: a name or number of the run is wrong; KEMPE_E_FAILED: the run cannot start;
 * KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_stepper_new(const kempe_system *system, const kempe_run_options *run,
                                         kempe_stepper **stepper);
KEMPE_API void kempe_stepper_free(kempe_stepper *stepper);

/** Advances to the end of the integrator's next step; after kempe_stepper_advance, to the end of the current one.
 * KEMPE_E_ARGUMENT at t_end. KEMPE_E_FAILED and KEMPE_STOPPED: see kempe_stepper_reason; the state is unchanged. */
KEMPE_API kempe_status kempe_stepper_step(kempe_stepper *stepper);

/** Advances to t (s), neither backwards nor beyond t_end (KEMPE_E_ARGUMENT), in as many steps as needed. The state at t
 * is that of the last step's polynomial, with its loops closed. */
KEMPE_API kempe_status kempe_stepper_advance(kempe_stepper *stepper, double t);

/** keep = 1: other inputs of the force function than t, q and qd are constant from now on, and the steps are those of
 * kempe_simulate. keep = 0 (initially): they may change between calls. */
KEMPE_API void kempe_stepper_keep_inputs(kempe_stepper *stepper, int keep);

/** The current state: t in s; q, qd, qdd (n values) and lambda (row_count of the system), owned by the stepper and
 * overwritten by the next step. */
KEMPE_API double kempe_stepper_time(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_q(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_qd(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_qdd(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_lambda(const kempe_stepper *stepper);

KEMPE_API kempe_work kempe_stepper_work(const kempe_stepper *stepper);

/** Reason of the last failure or stop as a sentence; "" if there is none. */
KEMPE_API const char *kempe_stepper_reason(const kempe_stepper *stepper);

KEMPE_END
#endif
