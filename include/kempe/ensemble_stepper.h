/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Many instances of one mechanism advanced by the caller, who sets the inputs and the end of each step: as many
 * steppers (kempe/stepper.h), with the motions in the lanes of a vector register, as in an ensemble (kempe/ensemble.h).
 *
 *     kempe_ensemble_stepper *carts;
 *     kempe_ensemble_stepper_new(model, &run, 256, 0, "q, qd", &carts);
 *     for (int k = 0; k < 256; k++)
 *         kempe_ensemble_stepper_begin(carts, k, NULL, NULL);
 *     for (int step = 1; step <= 200; step++) {
 *         for (int k = 0; k < 256; k++)
 *             t[k] = 0.02 * step;
 *         decide(values, forces);
 *         kempe_ensemble_stepper_advance(carts, t, 1, &input, forces, values);
 *     }
 *
 * An instance keeps its lane's state from one step to the next: coordinates, step size, conditions. No step of the
 * integrator goes beyond the end of a step of the caller. If lanes cannot take an instance to that end, a stepper makes
 * the whole step from its beginning, and lanes take the instance back later if they can. A stepper makes every step of
 * a model that lanes cannot run (kempe_ensemble_stepper_no_lanes).
 *
 * Results depend only on the starts, times and inputs of an instance: they have the same bits for any number of lanes
 * from 1 on, of threads and of other instances. They agree with the results of a stepper to the tolerance of the run.
 */
#ifndef KEMPE_ENSEMBLE_STEPPER_H
#define KEMPE_ENSEMBLE_STEPPER_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_ensemble_stepper kempe_ensemble_stepper;

/** Derives the equations of a model, for `count` instances that have not begun. `threads` of the run share the
 * instances, 0: one for each processor. `lanes` is the number of instances at a time: 0 the best for this machine, up
 * to 16; -1 a stepper for each. `outputs`: words separated by commas, as for kempe_outputs_new. The model must outlive
 * the object. KEMPE_E_ARGUMENT: a name, number or word is wrong, or an option is of rows, references or checkpoints. */
KEMPE_API kempe_status kempe_ensemble_stepper_new(const kempe_model *model, const kempe_run_options *run, int count,
                                                  int lanes, const char *outputs, kempe_ensemble_stepper **stepper);
KEMPE_API void kempe_ensemble_stepper_free(kempe_ensemble_stepper *stepper);

/** The number of instances, and of values of the outputs of one; the name of such a value, as of a column in a result
 * file. */
KEMPE_API int kempe_ensemble_stepper_count(const kempe_ensemble_stepper *stepper);
KEMPE_API int kempe_ensemble_stepper_value_count(const kempe_ensemble_stepper *stepper);
KEMPE_API const char *kempe_ensemble_stepper_value_name(const kempe_ensemble_stepper *stepper, int value);

/** Why lanes cannot run the model; "": they can. */
KEMPE_API const char *kempe_ensemble_stepper_no_lanes(const kempe_ensemble_stepper *stepper);

/** Why a stepper made the last step of the k-th instance; "": lanes did. */
KEMPE_API const char *kempe_ensemble_stepper_single(const kempe_ensemble_stepper *stepper, int k);

/** Begins the k-th instance at t = 0, with the model's own inputs: at the closed state near q and qd (n each; qd NULL:
 * at rest), or at the model's start (q NULL). KEMPE_E_FAILED: the loops cannot be closed from there, and the instance
 * is unchanged; or it cannot start. KEMPE_STOPPED: a condition ends it there. */
KEMPE_API kempe_status kempe_ensemble_stepper_begin(kempe_ensemble_stepper *stepper, int k, const double *q,
                                                    const double *qd);

/** Advances each instance to a time (s): `t` has one for each, NaN where it stays. Inputs of the model with the numbers
 * `inputs` are constant in SI from its present time on: `values` has `input_count` of them for each instance. `outputs`
 * (NULL: not required) receives the values (value_count) of each instance that advances, at its time or where its
 * motion has ended. A motion that fails or ends is none of the others: see kempe_ensemble_stepper_outcome.
 * KEMPE_E_ARGUMENT: an instance has not begun, or its time is before the present one or after t_end. The same: there is
 * no such input, a value is not finite, or a closure depends on the input and would jump. KEMPE_STOPPED: an interrupt,
 * after which some instances have not advanced. */
KEMPE_API kempe_status kempe_ensemble_stepper_advance(kempe_ensemble_stepper *stepper, const double *t, int input_count,
                                                      const int *inputs, const double *values, double *outputs);

/** The k-th instance now: t in s; q and qd (n values), owned by the object; NaN or NULL: there is none. */
KEMPE_API double kempe_ensemble_stepper_time(const kempe_ensemble_stepper *stepper, int k);
KEMPE_API const double *kempe_ensemble_stepper_q(const kempe_ensemble_stepper *stepper, int k);
KEMPE_API const double *kempe_ensemble_stepper_qd(const kempe_ensemble_stepper *stepper, int k);

/** The number of instances whose last step has not reached its end. */
KEMPE_API int kempe_ensemble_stepper_ended_count(const kempe_ensemble_stepper *stepper);

/** Not checked: its last step has reached its end; otherwise stopped or failed, with the reason as a sentence. */
KEMPE_API kempe_outcome kempe_ensemble_stepper_outcome(const kempe_ensemble_stepper *stepper, int k);
KEMPE_API const char *kempe_ensemble_stepper_reason(const kempe_ensemble_stepper *stepper, int k);

KEMPE_END
#endif
