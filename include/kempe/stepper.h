/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A run under your control: you say how far, and read the state where it stands.
 *
 *     kempe_run_options run = kempe_run_options_default();
 *     run.t_end = 10;
 *     kempe_stepper *stepper;
 *     kempe_stepper_new(system, &run, &stepper);
 *     for (int k = 1; k <= 1000 && status == KEMPE_OK; k++) {
 *         status = kempe_stepper_advance(stepper, 0.01 * k);
 *         show(kempe_stepper_t(stepper), kempe_stepper_q(stepper));
 *     }
 *
 * The steps are the integrator's, chosen by its error control, and the same whatever is asked: kempe_simulate gives
 * the same numbers. A stepper belongs to the thread of its context.
 *
 * Inputs. A force by a function of yours (kempe/extend.h) may read what you set between calls, as a controller or a
 * sampled signal does. Such a value acts from where the stepper stands: with such a force each call begins the
 * integrator anew there and makes no step beyond the time asked for. One-step methods go on with the step they had; a
 * multistep method (adams, bdf, ida) begins again at order one, which many short calls make slow. A force that depends
 * on t, q and qd alone needs none of that: kempe_stepper_keep_inputs.
 */
#ifndef KEMPE_STEPPER_H
#define KEMPE_STEPPER_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct kempe_stepper kempe_stepper;

/** What has been done so far. `rejected` by the error test, `refused` by the mechanism or for want of convergence;
 * `centrings` of spherical joints. */
typedef struct kempe_work {
    long steps, rejected, refused, rhs, newton, factorizations, exchanges, centrings;
} kempe_work;

/** Assembles and stands at t = 0; `output_step`, `reference` and checkpoints of the run do not matter here. The system
 * must outlive it. KEMPE_E_ARGUMENT: a name or number of the run; KEMPE_E_FAILED: it cannot start; KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_stepper_new(const kempe_system *system, const kempe_run_options *run,
                                         kempe_stepper **stepper);
KEMPE_API void kempe_stepper_free(kempe_stepper *stepper);

/** Goes to the end of the integrator's next step (of the one it stands in, after kempe_stepper_advance).
 *  KEMPE_E_ARGUMENT at t_end. KEMPE_E_FAILED and KEMPE_STOPPED: see kempe_stepper_reason; the state stays. */
KEMPE_API kempe_status kempe_stepper_step(kempe_stepper *stepper);

/** Goes to t (s), not back and not beyond t_end (KEMPE_E_ARGUMENT): as many steps as it takes, the state at t from the
 *  last one's polynomial, its loops closed. */
KEMPE_API kempe_status kempe_stepper_advance(kempe_stepper *stepper, double t);

/** keep = 1: what the force by a function reads beside t, q and qd stays the same from here on, and the steps are again
 * those of kempe_simulate. 0, at first: it may change between calls. */
KEMPE_API void kempe_stepper_keep_inputs(kempe_stepper *stepper, int keep);

/** Where it stands: s; q, qd, qdd (n values) and lambda (row_count of the system), owned by the stepper and overwritten
 *  by the next step. */
KEMPE_API double kempe_stepper_t(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_q(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_qd(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_qdd(const kempe_stepper *stepper);
KEMPE_API const double *kempe_stepper_lambda(const kempe_stepper *stepper);

KEMPE_API kempe_work kempe_stepper_work(const kempe_stepper *stepper);

/** Why it went no further: a sentence; "" when all is well. */
KEMPE_API const char *kempe_stepper_reason(const kempe_stepper *stepper);

#ifdef __cplusplus
}
#endif
#endif
