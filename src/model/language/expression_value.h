/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of expressions. */
#pragma once

#include "model/language/expression.h"

/** The ends of the variables of a table: 0 the first of x, 1 the last of x, 2 and 3 the first and the last of y. */
double kmp_table_end(const kmp_named_table *table, int end);

/** Value with the given parameter values; t, q, qd and lambda must not occur (NaN then). */
double kmp_expr_value(const kmp_expr *expr, const double *parameters);

/** That of a number. */
double kmp_number_at(const kmp_number *number, const double *parameters);

/** The value at a time t. */
double kmp_expr_value_at(const kmp_expr *expr, const double *parameters, double t);

/** The same where parameters take the place of inputs: 1 + the number of one by inputs, or 0; NULL: none do. */
double kmp_expr_value_of(const kmp_expr *expr, const double *parameters, const int *constants, double t);

/** The extent of an expression. Parameter k has the extent `of[k]`; NULL: parameters are operands like others. */
kmp_extent kmp_expr_extent(const kmp_expr *expr, const kmp_extent *of);
bool kmp_extent_is_long(kmp_extent extent);

/** The first node for which `is` is true, each before its operands; NULL when there is none. */
const kmp_expr *kmp_expr_find(const kmp_expr *expr, kmp_expr_test is, const void *user);

/** kmp_expr_find, also in the expressions of names. */
const kmp_expr *kmp_expr_find_named(const kmp_expr *expr, kmp_expr_test is, const void *user);

/** Tests for it: the time itself, and an input. */
bool kmp_expr_is_time(const kmp_expr *expr, const void *unused);
bool kmp_expr_is_input(const kmp_expr *expr, const void *unused);

/** True if two leaves are the same. */
bool kmp_expr_same_leaf(const kmp_expr *a, const kmp_expr *b);

/** The first lambda(..) in an expression, or a reaction, NULL when there is none; NULL has none. */
const kmp_expr *kmp_expr_lambda(const kmp_expr *expr);

/** True if an expression contains the time or an input. NULL: false. */
bool kmp_expr_has_time(const kmp_expr *expr);

/** A test for kmp_expr_find: a comparison, or a sign. */
bool kmp_expr_compares(const kmp_expr *expr, const void *unused);

/** True when only numbers and parameters occur. */
bool kmp_expr_is_constant(const kmp_expr *expr);
