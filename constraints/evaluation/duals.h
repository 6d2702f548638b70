/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of a program's outputs at one point as numbers: forward-mode differentiation along several inputs at a
 * time (Griewank and Walther 2008, ch. 3). They are as exact as derived expressions and need no preparation; deriving
 * expressions pays only for many evaluations. */
#pragma once

#include "base/arena.h"
#include "symbolic/program.h"

enum { KMP_DUALS_WIDTH = 8, KMP_DUALS_MARKED = 64 }; /* inputs at a time */

typedef struct kmp_duals kmp_duals;

/** True if all operations of the program are supported here: implicit blocks are not. */
bool kmp_duals_know(const kmp_program *program);

/** Derivatives of a program, which must outlive them, in the arena. The outputs from `aside` on, `aside_count` of them,
 * may be left out later. NULL: no memory. */
kmp_duals *kmp_duals_new(const kmp_program *program, int aside, int aside_count, kmp_arena *arena);

/** All inputs of a kind. */
void kmp_duals_set(kmp_duals *duals, kmp_input_kind kind, const double *values);

/** Values at these inputs, of all operations. No allocation, as all that follows. */
void kmp_duals_run(kmp_duals *duals);

/** Value of output k. */
double kmp_duals_value(const kmp_duals *duals, int k);

/** Derivatives at the values along inputs `first` to `first` + KMP_DUALS_WIDTH - 1 of a kind. `few`: without the
 * outputs that may be left out. */
void kmp_duals_along(kmp_duals *duals, kmp_input_kind kind, uint32_t first, bool few);

/** The derivatives of output k; false where it does not depend on any of these inputs. */
bool kmp_duals_get(const kmp_duals *duals, int k, double slope[KMP_DUALS_WIDTH]);

/** Marks all values that depend on inputs `first` to `first` + KMP_DUALS_MARKED - 1 of a kind, at any values of them.
 * Each output has a bit for each such input. */
void kmp_duals_mark(kmp_duals *duals, kmp_input_kind kind, uint32_t first);
uint64_t kmp_duals_moves(const kmp_duals *duals, int k);
