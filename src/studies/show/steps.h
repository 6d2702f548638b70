/* SPDX-License-Identifier: BSD-3-Clause */
/* The number of steps of a program when all independent operations run at once (Fisette and Samin 1996, section 3.2).
 * The vector step index of a variable is one more than the largest index of the variables it is computed from. */
#pragma once

#include "symbolic/program.h"

/** `serial`: variables, one assignment each; `vector`: their largest index, -1 without memory. */
typedef struct kmp_steps {
    long serial, vector;
} kmp_steps;

/** A variable is an output, or a value that is used more than once; a value used once is part of its user's assignment.
 * Inputs, numbers, functions of parameters alone, and sines and cosines of sums of inputs have index 0 and are not
 * counted. */
kmp_steps kmp_program_steps(const kmp_program *p);
