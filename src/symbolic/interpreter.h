/* SPDX-License-Identifier: BSD-3-Clause */
/* A program run instruction by instruction: for small programs inside others. The bits are the same as of every back
 * end. Programs with implicit blocks are not run here. */
#pragma once

#include "symbolic/program.h"

typedef struct kmp_interpreter kmp_interpreter;

/** The program must outlive it. NULL: no memory. */
kmp_interpreter *kmp_interpreter_new(const kmp_program *program);
void kmp_interpreter_free(kmp_interpreter *interpreter);

void kmp_interpreter_set(kmp_interpreter *interpreter, kmp_input_kind kind, const double *values);

/** Outputs of a stage, whose earlier stages are up to date; valid until it runs again. No allocation. */
const double *kmp_interpreter_run(kmp_interpreter *interpreter, int stage);

/** The outputs of a stage when it last ran. */
const double *kmp_interpreter_outputs(const kmp_interpreter *interpreter, int stage);

/** All values, numbered as in the program. */
const double *kmp_interpreter_values(const kmp_interpreter *interpreter);
