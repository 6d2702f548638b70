/* SPDX-License-Identifier: BSD-3-Clause */
/* Values of a block that depend on unknown 0 alone, at its candidates or places: numbers that are known when code is
 * generated. */
#pragma once

#include "symbolic/program/program.h"

/** Rows of the places, `width` numbers each: the place q[0], then the values q[unknowns] and so on. */
typedef struct kmp_place_values {
    int width;
    double *rows;
} kmp_place_values;

/** The program with such values as inputs, and their rows, in the arena. NULL: no memory. */
kmp_program *kmp_place_values_take(const kmp_program *program, int unknowns, kmp_arena *arena, int places,
                                   const double *place, kmp_place_values *values);
