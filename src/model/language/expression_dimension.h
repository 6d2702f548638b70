/* SPDX-License-Identifier: BSD-3-Clause */
/* The dimension of an expression, from the units of its numbers and the dimensions of its parameters. A number
 * without unit is a plain factor in a product and fits any dimension as a whole value; t, q and qd are in SI and fit
 * any dimension. */
#pragma once

#include "model/language/expression.h"

/** The dimension of an expression, from the dimensions and the values of the parameters (the values are needed
 * only in exponents). The first error is kept. */
kmp_dimension kmp_expr_dimension(const kmp_expr *expr, const kmp_dimension *dimensions, const double *values,
                                 kmp_expr_fault *fault);

/** Appends the sentence that belongs to a fault. */
void kmp_expr_print_fault(kmp_text *text, const kmp_expr_fault *fault);
