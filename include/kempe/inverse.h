/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Inverse dynamics with the loops closed: what chosen coordinates must be driven with, forces and torques, for a given
 * motion (docs/inverse.md).
 *
 *     kempe_inverse *inverse = NULL;
 *     kempe_inverse_options ask = {.actuators = "slide1,slide2", .motion = "motion.csv"};
 *     if (kempe_inverse_new(system, &ask, &inverse) == KEMPE_OK)
 *         printf("%g N\n", kempe_inverse_tau(inverse, 0)[0]);
 *     kempe_inverse_free(inverse);
 */
#ifndef KEMPE_INVERSE_H
#define KEMPE_INVERSE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** NULL and 0 take the defaults. */
typedef struct kempe_inverse_options {
    const char *actuators; /* coordinates, comma-separated; NULL: those that the model's drives move */
    const char *weights;   /* NAME=W,..: of their efforts where there are more than freedoms; 1 where not given */
    const char *motion;    /* CSV with t, q.NAME and, if known, qd.NAME and qdd.NAME; NULL: the model's drives, or where
                            * there are none, its start */
    const char *independent;  /* of the start: coordinates whose accelerations are zero, comma-separated */
    const char *backend;      /* as for a run */
    double t_end;             /* s: of the drives' motion; of a table no more than it has */
    double output_step;       /* s between rows; of a table 0: its own rows */
    int no_convergence_check; /* rates and accelerations made from a table's rows are not checked */
} kempe_inverse_options;

typedef struct kempe_inverse kempe_inverse;

/** Follows the motion row by row. Where a table lacks rates or accelerations it is followed once more with every other
 * row, unless `once`: a warning is logged when efforts come out otherwise. KEMPE_E_FAILED: the motion is not possible,
 * or not with these actuators; `*inverse` is then given, with the reason, as far as it came, and so on KEMPE_STOPPED.
 * KEMPE_E_INPUT: the table, with file:line:column. KEMPE_E_ARGUMENT: a name, a number, or no actuators. */
KEMPE_API kempe_status kempe_inverse_new(const kempe_system *system, const kempe_inverse_options *ask,
                                         kempe_inverse **inverse);
KEMPE_API void kempe_inverse_free(kempe_inverse *inverse);

/** "ok", "stopped" or "failed", and the sentence that goes with it ("" when ok). */
KEMPE_API const char *kempe_inverse_status(const kempe_inverse *inverse);
KEMPE_API const char *kempe_inverse_reason(const kempe_inverse *inverse);

KEMPE_API int kempe_inverse_actuator_count(const kempe_inverse *inverse);
/** Index of the k-th actuator's coordinate (kempe_model_coordinate_name). */
KEMPE_API int kempe_inverse_actuator(const kempe_inverse *inverse, int k);

/** Degrees of freedom that the actuators have to move, and how many of them they can, at the worst row. Rows where the
 * loops are singular, with more freedoms, do not count, here and below. */
KEMPE_API int kempe_inverse_freedoms(const kempe_inverse *inverse);
KEMPE_API int kempe_inverse_rank(const kempe_inverse *inverse);

/** Largest |M qdd + C - J' lambda - S tau| of all rows, over the size of its terms. */
KEMPE_API double kempe_inverse_residual(const kempe_inverse *inverse);

KEMPE_API int kempe_inverse_row_count(const kempe_inverse *inverse);
KEMPE_API double kempe_inverse_time(const kempe_inverse *inverse, int row);

/** Of one row, owned by the object: q, qd, qdd (n), efforts and powers of the actuators (N m or N, W), lambda
 * (row_count of the system; zero for drives and for rows that are redundant). */
KEMPE_API const double *kempe_inverse_q(const kempe_inverse *inverse, int row);
KEMPE_API const double *kempe_inverse_qd(const kempe_inverse *inverse, int row);
KEMPE_API const double *kempe_inverse_qdd(const kempe_inverse *inverse, int row);
KEMPE_API const double *kempe_inverse_tau(const kempe_inverse *inverse, int row);
KEMPE_API const double *kempe_inverse_power(const kempe_inverse *inverse, int row);
KEMPE_API const double *kempe_inverse_lambda(const kempe_inverse *inverse, int row);

KEMPE_API kempe_status kempe_inverse_print(const kempe_inverse *inverse, kempe_format format, char **text);

/** t, tau.NAME and power.NAME of the actuators, q, qd, qdd, lambda.CLOSURE.k, reaction.LOOP.x .. and moment.LOOP.x ..,
 * whole or not at all. */
KEMPE_API kempe_status kempe_inverse_write_csv(const kempe_inverse *inverse, const char *path);

#ifdef __cplusplus
}
#endif
#endif
