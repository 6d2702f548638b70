/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a program's outputs, and of their rates, while its inputs move within bounds: interval arithmetic with the
 * chain rule along time (Moore 1966; Neumaier 1990). Ends of intervals are rounded as the operations round, not
 * outwards: a result that is exactly zero stays so. A kink makes the bounds wider, never wrong. */
#ifndef KMP_BACKEND_BOUNDS_H
#define KMP_BACKEND_BOUNDS_H

#include "symbolic/program/program.h"

/** A quantity over a piece of time: its values lie within [low, high], its rates within [down, up]. */
typedef struct kmp_bound {
    double low, high, down, up;
} kmp_bound;

typedef struct kmp_bounds kmp_bounds;

/** Of a program that stays. NULL: no memory. */
kmp_bounds *kmp_bounds_new(const kmp_program *program);
void kmp_bounds_free(kmp_bounds *bounds);

/** Whether bounds of output k (of all stages, in order) are known: what implicit blocks solve for has to be given, and
 * can be where it is an output by itself. */
bool kmp_bounds_know(const kmp_bounds *bounds, int k);

/** Whether output k is what an implicit block solves for; and that it is given. */
bool kmp_bounds_is_solved(const kmp_bounds *bounds, int k);
void kmp_bounds_give(kmp_bounds *bounds, int k, kmp_bound bound);

/** Whether what is given counts for output k. */
bool kmp_bounds_need(const kmp_bounds *bounds, int k);

/** Input k of the program. */
void kmp_bounds_set(kmp_bounds *bounds, int k, kmp_bound bound);

/** With `constants`, what depends on parameters alone is evaluated too: it has changed. No allocation. */
void kmp_bounds_run(kmp_bounds *bounds, bool constants);

/** Bounds of output k; infinite where nothing is known. */
kmp_bound kmp_bounds_get(const kmp_bounds *bounds, int k);

#endif
