/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Extension of a system at run time: forces by a function, in addition to the expressions of the model.
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

KEMPE_BEGIN

/** Adds user-defined generalized forces (n; N m or N, zero when called) to the right side at (t, q, qd), in addition to
 * the model's expressions. Returns 0, or not 0 if they cannot be evaluated there: the step is then repeated with a
 * smaller size. The function must be smooth and depend only on its arguments, except for inputs that change between
 * calls of a stepper (kempe/stepper.h). Every thread that works on the system calls it. Derivatives, where needed (the
 * dae formulation, stiff integrators), are taken by differences. */
typedef int kempe_force_fn(void *user, double t, const double *q, const double *qd, double *effort);

/** Sets the force function. Call it before anything works on the system; NULL removes the force. */
KEMPE_API void kempe_system_set_force(kempe_system *system, kempe_force_fn *force, void *user);

KEMPE_END
#endif
