/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * What a program adds to a system at run time: forces by a function, beside the expressions of the model.
 *
 *     static int brake(void *user, double t, const double *q, const double *qd, double *effort)
 *     {
 *         effort[0] -= *(const double *)user * qd[0];
 *         return 0;
 *     }
 *     ...
 *     kempe_system_set_force(system, brake, &damping);
 *
 * Kinds of joint, closure, force and integrator are rows of tables in Kempe's sources: docs/extending.md.
 */
#ifndef KEMPE_EXTEND_H
#define KEMPE_EXTEND_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Adds your generalized efforts (n; N m or N, zero when called) to the right side at (t, q, qd): with the expressions
 *  of the model, one more way to say a force. Returns 0, or not 0 when it cannot be evaluated there: the step is then
 *  tried smaller. It must be smooth and a function of its arguments alone, but for what changes between calls of a
 *  stepper (kempe/stepper.h); it is called from every thread that works on the system. Where derivatives are wanted
 * (the dae formulation, stiff integrators) they are taken by differences. */
typedef int kempe_force_fn(void *user, double t, const double *q, const double *qd, double *effort);

/** To be called before anything works on the system; NULL takes the force away. */
KEMPE_API void kempe_system_set_force(kempe_system *system, kempe_force_fn *force, void *user);

#ifdef __cplusplus
}
#endif
#endif
