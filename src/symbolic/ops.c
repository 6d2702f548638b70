/* SPDX-License-Identifier: BSD-3-Clause */
/* Properties and values of operations, from the rows of ops.def. */
#include "symbolic/ops.h"
#include "symbolic/op_value.h"

const uint8_t kmp_op_arities[KMP_OP_COUNT] = {
#define KMP_LEAF(name)                                       0,
#define KMP_BINARY(name, text, value)                        2,
#define KMP_UNARY(name, text, parity, value, derivative)     1,
#define KMP_BINARY_FUNCTION(name, text, value, differential) 2,
#define KMP_TERNARY(name, text, value, differential)         3,
#define KMP_APPLIED(name, text)                              1,
#include "symbolic/ops_end.h"
};

static const struct {
    const char *text;
    kmp_op_form form;
    kmp_op_parity parity;
} ops[KMP_OP_COUNT] = {
#define KMP_LEAF(name)                                       {NULL, KMP_FORM_LEAF, KMP_PARITY_NONE},
#define KMP_BINARY(name, text, value)                        {text, KMP_FORM_INFIX, KMP_PARITY_NONE},
#define KMP_UNARY(name, text, parity, value, derivative)     {text, KMP_FORM_FUNCTION, KMP_PARITY_##parity},
#define KMP_BINARY_FUNCTION(name, text, value, differential) {text, KMP_FORM_FUNCTION, KMP_PARITY_NONE},
#define KMP_TERNARY(name, text, value, differential)         {text, KMP_FORM_FUNCTION, KMP_PARITY_NONE},
#define KMP_APPLIED(name, text)                              {text, KMP_FORM_APPLIED, KMP_PARITY_NONE},
#include "symbolic/ops_end.h"
};

const char *kmp_op_text(kmp_op op)
{
    return ops[op].text;
}

kmp_op_form kmp_op_form_of(kmp_op op)
{
    return ops[op].form;
}

kmp_op_parity kmp_op_parity_of(kmp_op op)
{
    return ops[op].parity;
}

double kmp_op_value(kmp_op op, double x, double y, double z)
{
    return kmp_op_value_here(op, x, y, z);
}
