/* SPDX-License-Identifier: BSD-3-Clause */
/* Constructors of all operations except arithmetic, and their simplifications. */
#pragma once

#include "symbolic/graph.h"

/** op is one of the unary rows of ops.def. */
kmp_ref kmp_unary(kmp_graph *g, kmp_op op, kmp_ref a);
kmp_ref kmp_sin(kmp_graph *g, kmp_ref a);
kmp_ref kmp_cos(kmp_graph *g, kmp_ref a);
kmp_ref kmp_sqrt(kmp_graph *g, kmp_ref a);
/** a^exponent: products for whole exponents, a square root for halves, POW otherwise. */
kmp_ref kmp_power(kmp_graph *g, kmp_ref a, double exponent);

/** The node of any operation that is neither leaf nor applied. */
kmp_ref kmp_operate(kmp_graph *g, kmp_op op, const kmp_ref operands[3]);
/** Makes node `id` of a graph, which is not a leaf, from new operands (as many as its operation has) in the same graph
 * or another one. Implicit blocks cannot go to another graph, which then fails. */
kmp_ref kmp_graph_rebuild(kmp_graph *to, const kmp_graph *from, uint32_t id, const kmp_ref operands[3]);
/** Makes it from the operands' forms: map[id] of each node. In the same graph leaves, and nodes whose operands are
 * unchanged, are returned as they are. */
kmp_ref kmp_graph_rebuild_by(kmp_graph *to, const kmp_graph *from, uint32_t id, const kmp_ref *map);

/** table(x). Its derivatives are nodes of the same table with a higher order. */
kmp_ref kmp_table_at(kmp_graph *g, int table, kmp_ref x);
kmp_ref kmp_table_derivative_at(kmp_graph *g, int table, int derivative, kmp_ref x);
