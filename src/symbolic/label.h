/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of nodes for printed equations: separate from the graph, and without influence on it. */
#pragma once

#include "symbolic/graph.h"

/** A quantity of many entries: the beginning of their names, and its description. Static. */
typedef struct kmp_quantity_label {
    const char *stem, *meaning;
} kmp_quantity_label;

/** "OM12": entry 1 of the angular velocity of link 2; "FM12_3": the share of motion 3. */
typedef struct kmp_label {
    const kmp_quantity_label *quantity; /* NULL: no label */
    int entry, link, column;            /* column 0: none */
    bool negative;                      /* the node is the negative of the named value */
} kmp_label;

/** Labels the node of a reference, unless it is a leaf or has a label. */
void kmp_graph_label(kmp_graph *g, kmp_ref r, kmp_label label);

/** NULL where there is none. */
const kmp_label *kmp_graph_label_of(const kmp_graph *g, uint32_t id);
