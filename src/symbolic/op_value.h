/* SPDX-License-Identifier: BSD-3-Clause */
/* The values of operations as a part of the code that needs them, where a call would take as long as the operation. */
#pragma once

#include "symbolic/graph.h"
#include <kempe/runtime.h>
#include <math.h>

static inline double kempe_sin(double x)
{
    double s, c;
    kempe_sincos(x, &s, &c);
    return s;
}

static inline double kempe_cos(double x)
{
    double s, c;
    kempe_sincos(x, &s, &c);
    return c;
}

/** kmp_op_value (symbolic/ops.h). */
static inline __attribute__((always_inline)) double kmp_op_value_here(kmp_op op, double x, double y, double z)
{
#define VALUE(name, value)                                                                                             \
    case KMP_OP_##name:                                                                                                \
        return value;
    switch (op) {
#define KMP_LEAF(name)
#define KMP_BINARY(name, text, value)                        VALUE(name, value)
#define KMP_UNARY(name, text, parity, value, derivative)     VALUE(name, value)
#define KMP_BINARY_FUNCTION(name, text, value, differential) VALUE(name, value)
#define KMP_TERNARY(name, text, value, differential)         VALUE(name, value)
#define KMP_APPLIED(name, text)
#include "symbolic/ops_end.h"
    default:
        return NAN;
    }
#undef VALUE
}
