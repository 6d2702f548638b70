/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of quantities, and of their rates, while what they depend on moves within bounds: interval arithmetic with the
 * chain rule along time (Moore 1966; Neumaier 1990), by a list of operations. Ends of intervals are rounded as the
 * operations round, not outwards: a result that is exactly zero stays so. A kink makes the bounds wider, never wrong.
 * Generated simulators have this file too. */
#pragma once

#include <stdbool.h>

/* Linkage; static if one file contains all of a generated simulator. */
#ifndef KMP_LOCAL
#define KMP_LOCAL
#endif

/** A quantity during a time interval: its values lie within [low, high], its rates within [down, up]. */
typedef struct kmp_bound {
    double low, high, down, up;
} kmp_bound;

/** An operation: kmp_op, and operands as value << 1 | sign; of a table its number and the order of the derivative in b
 * and c. */
typedef struct kmp_bound_step {
    unsigned op, a, b, c;
} kmp_bound_step;

/** Operations in order. Values: constants, inputs, then the result of each operation. An operation KMP_OP_IMPLICIT has
 * a bound that is given. */
typedef struct kmp_bound_code {
    int constants, inputs, steps;
    int fixed; /* the first operations depend only on parameters */
    const double *constant;
    const kmp_bound_step *step;
    const bool *needed; /* of each value: operations that others, or outputs, need; NULL: all */
    const int *listed;  /* operations from `fixed` on that may be needed, in order; NULL: all */
    int count;          /* their number */
    const void *tables;
    /** Bounds of a table, or of a derivative of it: kmp_table_bounds; its highest derivative that is continuous between
     * the two places, + 1.
     */
    int (*table)(const void *tables, unsigned number, int derivative, double from, double to, double *low,
                 double *high);
} kmp_bound_code;

/** The number of values. */
KMP_LOCAL int kmp_bound_values(const kmp_bound_code *code);

/** Bounds from operation `from` on: 0, or `fixed` where parameters are as before. The inputs have theirs. */
KMP_LOCAL void kmp_bound_run(const kmp_bound_code *code, int from, kmp_bound *value);

/** Marks the values that marked ones need. Of a choice by a fixed value it is the branch that is taken: inputs that are
 * not fixed have infinite bounds here, and the operations that depend only on parameters have theirs. */
KMP_LOCAL void kmp_bound_mark(const kmp_bound_code *code, const kmp_bound *value, bool *needed);

/** An operand, with its sign. */
KMP_LOCAL kmp_bound kmp_bound_of(const kmp_bound *value, unsigned operand);

/** Gives the bound of an operand. */
KMP_LOCAL void kmp_bound_give(kmp_bound *value, unsigned operand, kmp_bound bound);
