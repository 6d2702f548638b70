/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a program's outputs (bound_code.h). */
#pragma once

#include "backend/bound_code.h"
#include "base/arena.h"
#include "symbolic/program.h"

typedef struct kmp_bounds {
    const kmp_program *program;
    kmp_bound_code code;
    uint32_t *output; /* operands among the values of the code */
    bool *known;      /* by output: it has bounds */
    bool *given;      /* by output: a given value is needed for it */
    kmp_bound *value;
    bool *needed;  /* by value: a wanted output needs it */
    bool *chooses; /* by input: it is the condition of a choice, whose value says what is needed */
    int *listed;   /* operations that some outputs need (kmp_bounds_limit) */
} kmp_bounds;

/** Bounds of a program, which must outlive them, in the arena. NULL: no memory. */
kmp_bounds *kmp_bounds_new(const kmp_program *program, kmp_arena *arena);

/** True if output k (of all stages, in order) is an unknown of an implicit block: its bounds are given, by
 * kmp_bound_give, to outputs that depend on it. */
bool kmp_bounds_is_solved(const kmp_bounds *bounds, int k);

/** Input k of the program. */
void kmp_bounds_set(kmp_bounds *bounds, int k, kmp_bound bound);

/** Computes all bounds. `constants`: values only of parameters are evaluated again, after a change. No allocation. */
void kmp_bounds_run(kmp_bounds *bounds, bool constants);

/** Marks, by inputs that choose, what the required ones of `count` outputs need. kmp_bounds_run_wanted then
 * computes their bounds, with the constants of the last run, from the inputs that they need. No allocation. */
void kmp_bounds_want(kmp_bounds *bounds, int count, const int *output, const bool *wanted);
void kmp_bounds_run_wanted(kmp_bounds *bounds);

/** True if a wanted output needs input k. */
static inline bool kmp_bounds_needs(const kmp_bounds *bounds, int k)
{
    return bounds->needed[bounds->code.constants + k];
}

/** Limits the next calls to outputs among these, so that only their operations are then evaluated; NULL: no limit. */
void kmp_bounds_limit(kmp_bounds *bounds, int count, const int *output, const bool *among);

/** Bounds of output k; infinite where none are known. */
kmp_bound kmp_bounds_get(const kmp_bounds *bounds, int k);
