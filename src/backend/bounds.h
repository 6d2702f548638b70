/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a program's outputs (bound_code.h). */
#pragma once

#include "backend/bound_code.h"
#include "base/arena.h"
#include "symbolic/program/program.h"

typedef struct kmp_bounds kmp_bounds;

/** Bounds of a program, which must outlive them, in the arena. NULL: no memory. */
kmp_bounds *kmp_bounds_new(const kmp_program *program, kmp_arena *arena);

/** Their operations; the operand of output k. False for kmp_bounds_is_known: there are none for it. */
const kmp_bound_code *kmp_bounds_code(const kmp_bounds *bounds);
unsigned kmp_bounds_output(const kmp_bounds *bounds, int k);
bool kmp_bounds_is_known(const kmp_bounds *bounds, int k);

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
