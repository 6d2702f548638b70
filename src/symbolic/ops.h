/* SPDX-License-Identifier: BSD-3-Clause */
/* Properties and values of operations, from the rows of ops.def. */
#pragma once

#include "symbolic/graph.h"

/** Text of an operation ("+", "sin"), NULL for leaves. */
const char *kmp_op_text(kmp_op op);
kmp_op_form kmp_op_form_of(kmp_op op);
kmp_op_parity kmp_op_parity_of(kmp_op op);
/** Value of an operation, which every back end uses; operands beyond its arity are ignored. NaN for leaves and for
 * applied objects (kmp_table_value). */
double kmp_op_value(kmp_op op, double x, double y, double z);
