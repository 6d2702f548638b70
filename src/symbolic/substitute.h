/* SPDX-License-Identifier: BSD-3-Clause */
/* Nodes exchanged for others. */
#pragma once

#include "symbolic/graph.h"

/** Rewrites the outputs in place with from[i] (`count` references, no sign) read as to[i]; operands below a from[i] are
 * not visited. *through: the bits (kmp_input_kind) of inputs that the outputs reach in other ways. False: no memory. */
bool kmp_substitute(kmp_graph *g, int count, const kmp_ref *from, const kmp_ref *to, int output_count, kmp_ref *outputs,
                    uint16_t *through);

/** x with other references in place of `count` inputs. */
kmp_ref kmp_graph_replace(kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by, kmp_ref x);
