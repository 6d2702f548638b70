/* SPDX-License-Identifier: BSD-3-Clause */
/* Makes equations of a graph an implicit block of it. Nodes that depend on the unknowns go into the block; the other
 * operands they need become its arguments, as late as possible. */
#pragma once

#include "symbolic/graph.h"

/** Unknown j while its equations are written. */
kmp_ref kmp_unknown(kmp_graph *g, int j);

/** Solutions y of residual(y) = 0 from first guesses that depend on no unknown. All are zero, and the graph has failed,
 * when there is no memory, or an equation contains a block that depends on the unknowns. */
void kmp_enclose(kmp_graph *g, int unknowns, const kmp_ref *residual, const kmp_ref *guess, kmp_ref *solution);
