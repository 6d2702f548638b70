/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of the iteration for the stages, from step to step: by contraction, and by the time simulated in a
 * counted processor cycle. */
#pragma once

#include "integrators/steppers/collocation.h"

/** Takes an iteration, without the experience of steps before. */
void kmp_collocation_begin_with(kmp_collocation *s, kmp_iteration iteration);

/** The longest step with a good contraction, by the one of a step h. With one Jacobian that is in proportion to the
 * longest way from there to a stage: half a step for a new one, a step more each time it is kept. */
double kmp_collocation_longest(kmp_collocation *s, double h);

/** Chooses the iteration of the next step, after one of length h that could be as long as `by_error` and
 * `by_iteration`. The next iteration is tried when this one has kept several steps far below the error's limit.
 * Picard's returns when it would contract well, one Jacobian for all stages after some time. */
void kmp_collocation_choose(kmp_collocation *s, double h, double by_error, double by_iteration);

/** True if further sweeps after a first one with a correction of this weighted size are by kmp_ode.improve: where that
 * is possible, and the places of the stages change little. */
bool kmp_collocation_is_near(const kmp_collocation *s, double size);

/** After a step that converged by f alone, and not by such sweeps: makes some steps without them, twice as many each
 * time. */
void kmp_collocation_go_far(kmp_collocation *s);

/** True if corrections with the present Jacobian cost less in the next step than a new one and its corrections. */
bool kmp_collocation_keeps_jacobian(const kmp_collocation *s);

/** True if all stages are evaluated at once. */
bool kmp_collocation_in_lanes(const kmp_collocation *s);

/** About the processor cycles of an evaluation of all stages, of Newton's corrections by an iteration, of a renewal of
 * its matrices without evaluations, and of a Jacobian. */
double kmp_collocation_sweep_cost(const kmp_collocation *s);
double kmp_collocation_correction_cost(const kmp_collocation *s, kmp_iteration iteration);
double kmp_collocation_matrix_cost(const kmp_collocation *s, kmp_iteration iteration);
double kmp_collocation_jacobian_cost(const kmp_collocation *s);
