/* SPDX-License-Identifier: BSD-3-Clause */
/* How many steps a program takes where everything that can be done at once is (Fisette and Samin 1996, section 3.2):
 * the vector step index of a variable is one more than the largest of the variables that it is computed from. */
#ifndef KMP_SYMBOLIC_PROGRAM_STEPS_H
#define KMP_SYMBOLIC_PROGRAM_STEPS_H

#include "symbolic/program/program.h"

/** `serial`: variables, one assignment each; `vector`: their largest index, -1 without memory. */
typedef struct kmp_steps {
    long serial, vector;
} kmp_steps;

/** A variable is an output, and what is used more than once; what is used once
 *  stands in the assignment of its user. Inputs, numbers, what depends on parameters alone, and sines and cosines of
 *  sums of inputs have index 0 and are not counted. */
kmp_steps kmp_program_steps(const kmp_program *p);

#endif
