/* SPDX-License-Identifier: BSD-3-Clause */
/* Sums and interpolants of slopes, in all lanes together. */
#pragma once

#include "ensemble/lanes/ensemble_inside.h"

/** For vectors of `size` components. */
void kmp_lanes_combine(size_t width, size_t size, const kmp_lanes_sum *sum);

/** Computes the solution of order 8, the error weights, and the error of each lane: 1 is at the tolerance. */
void kmp_lanes_solution(size_t width, size_t size, const struct kmp_dop853_step *step);

/** The vectors of the interpolant within the present steps: the cubic one (4), or the dense one (8), from all stages.
 */
void kmp_lanes_interpolant(size_t width, size_t size, const struct kmp_dop853_step *step, bool dense,
                           double *const *vector);
/** Its value at x, 0 to 1, in all lanes. */
void kmp_lanes_interpolate(size_t width, size_t size, int vectors, double *const *vector, double x, double *y);

/** The next steps after accepted ones, without regard to rejections before (kmp_step_after). */
void kmp_lanes_next_steps(size_t width, kmp_lane_state *room);

/** Slopes from the outputs of a program; `bad` of the room grows where they are not finite or a pivot is not positive.
 */
void kmp_lanes_publish(size_t width, kmp_engine *e, const kmp_lane_group *pool, const double *y, double *k);

/** Measures the ends of steps: max |h| and max |Bvu|, scaled; max |dv| in weights, of those beyond rounding; the least
 * |pivot| of Jv. */
void kmp_lanes_measure(size_t width, const kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x);

/** Finds the ends of steps that need no decision, and corrects v there. */
void kmp_lanes_find_quiet(size_t width, kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x);

void kmp_lanes_pass_on(size_t width, kmp_lane_state *room, const int64_t *quiet, kmp_lane_attempts *attempts);

/** Exchanges the numbers of some lanes of two vectors of `size` components. */
void kmp_lanes_exchange(size_t width, size_t size, const int64_t *lanes, double *a, double *b);

/** The steps to try, up to limits and as long as an instance allows (kmp_step_next); 0: it is too short, which is not 0
 * in *none, or the lane has no instance. */
void kmp_lanes_choose_tries(size_t width, kmp_lane_state *room, int64_t *none);

/** Finds the signs of blocks from the signs of their pivots: in each lane KMP_SIGN_WORDS words, word k of lane l at k
 * width
 * + l. block: the sign of each pivot. */
void kmp_lanes_signs(size_t width, int pivots, const unsigned char *block, const double *pivot, uint64_t *negative);
