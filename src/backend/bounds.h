/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a program's outputs, and of their rates, while its inputs move within bounds: interval arithmetic with the
 * chain rule along time (Moore 1966; Neumaier 1990). Ends of intervals are rounded as the operations round, not
 * outwards: a result that is exactly zero stays so. A kink makes the bounds wider, never wrong. */
#pragma once

#include "base/arena.h"
#include "symbolic/program/program.h"

/** A quantity during a time interval: its values lie within [low, high], its rates within [down, up]. */
typedef struct kmp_bound {
    double low, high, down, up;
} kmp_bound;

typedef struct kmp_bounds kmp_bounds;

/** Bounds of a program, which must outlive them, in the arena. NULL: no memory. */
kmp_bounds *kmp_bounds_new(const kmp_program *program, kmp_arena *arena);

/** kmp_bounds_is_solved: true if output k (of all stages, in order) is an unknown of an implicit block.
 * kmp_bounds_give: gives its bounds, which outputs that depend on it need. */
bool kmp_bounds_is_solved(const kmp_bounds *bounds, int k);
void kmp_bounds_give(kmp_bounds *bounds, int k, kmp_bound bound);

/** True if output k depends on given bounds. */
bool kmp_bounds_need(const kmp_bounds *bounds, int k);

/** Input k of the program. */
void kmp_bounds_set(kmp_bounds *bounds, int k, kmp_bound bound);

/** Computes all bounds. `constants`: values of parameters alone are evaluated again, after a change. No allocation. */
void kmp_bounds_run(kmp_bounds *bounds, bool constants);

/** Bounds of output k; infinite where none are known. */
kmp_bound kmp_bounds_get(const kmp_bounds *bounds, int k);
