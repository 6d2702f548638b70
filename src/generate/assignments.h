/* SPDX-License-Identifier: BSD-3-Clause */
/* Graph outputs as scalar assignments for reading: an auxiliary variable for each expression that is used more than
 * once or would make a line too long, everything else in place. */
#pragma once

#include "base/text.h"
#include "dynamics/equations.h"

/** One output and its name. */
typedef struct kmp_assignment {
    const char *set; /* "M", "C" ... */
    int row, col;    /* from 0; -1: no such index */
    kmp_ref value;
} kmp_assignment;

/** One assignment per line, zero outputs left out; the auxiliary variables of a set precede it. False: no memory. */
bool kmp_assignments_print(const kmp_equations *eq, int count, const kmp_assignment *assignments, kmp_text *text);
