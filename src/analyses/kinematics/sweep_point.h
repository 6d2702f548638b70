/* SPDX-License-Identifier: BSD-3-Clause */
/* One state of a sweep: closing it, its tangent, its derivatives by s. */
#pragma once

#include "analyses/kinematics/sweep.h"

/** Closures, factors and the tangent space at x. false: Jv is singular. */
bool kmp_sweep_evaluate(kmp_sweep *sweep, const double *x);

/** J of the evaluator's last closure without the dropped rows, valid until the next call. */
const double *kmp_sweep_jacobian(kmp_sweep *sweep);

/** The end of a corrector: at s (base NULL), or at the distance `offset` along the tangent of `base`. */
typedef struct kmp_sweep_target {
    const kmp_sweep_pose *base;
    double offset, s;
} kmp_sweep_target;

/** Closes `pose` by Newton; `first`: the size of the first correction, `ratio`: the worst of one over that before it
 * while they are above rounding. false: it does not converge. */
bool kmp_sweep_close(kmp_sweep *sweep, const kmp_sweep_target *target, kmp_sweep_pose *pose, double *first,
                     double *ratio);

/** The unit tangent at a closed pose, along that of `along` (NULL: with increasing s). False: Jv is singular. */
bool kmp_sweep_tangent(kmp_sweep *sweep, kmp_sweep_pose *pose, const kmp_sweep_pose *along);

/** <a's tangent, b's tangent>, and the offset of b along a's tangent. */
double kmp_sweep_cosine(const kmp_sweep *sweep, const kmp_sweep_pose *a, const kmp_sweep_pose *b);
double kmp_sweep_offset(const kmp_sweep *sweep, const kmp_sweep_pose *a, const kmp_sweep_pose *b);

/** dx/ds and d2x/ds2 at a closed pose, where s determines it. false: it does not. */
bool kmp_sweep_derivatives(kmp_sweep *sweep, const kmp_sweep_pose *pose, double *xs, double *xss);

double kmp_sweep_parameter_value(const kmp_sweep_parameter *parameter, double s);

/** The largest |dq_i| in scales. */
double kmp_sweep_fastest(const kmp_sweep *sweep, const kmp_sweep_pose *pose);

/** The conditioning of the driven coordinates here: the smallest pivot over the largest of their directions among all
 * motions; 0 in a dead centre. */
double kmp_sweep_hold(kmp_sweep *sweep, const kmp_sweep_pose *pose);

/** The margin of all rows at a pose (constraints/partition/rank_margin.h). */
double kmp_sweep_margin(kmp_sweep *sweep, const kmp_sweep_pose *pose);
