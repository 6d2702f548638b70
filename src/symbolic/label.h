/* SPDX-License-Identifier: BSD-3-Clause */
/* What nodes are called where equations are written to be read: beside the graph, and of no influence on it. */
#ifndef KMP_SYMBOLIC_LABEL_H
#define KMP_SYMBOLIC_LABEL_H

#include "symbolic/graph.h"

/** A quantity of many entries: how its names begin, and what it is. Static. */
typedef struct kmp_notion {
    const char *stem, *meaning;
} kmp_notion;

/** "OM12": entry 1 of the angular velocity of link 2; "FM12_3": what belongs to motion 3. */
typedef struct kmp_label {
    const kmp_notion *quantity; /* NULL: no label */
    int entry, link, column;    /* column 0: none */
    bool negative;              /* the node is the negative of what is meant */
} kmp_label;

typedef struct kmp_labels kmp_labels;

void kmp_labels_free(kmp_labels *labels);
bool kmp_labels_failed(const kmp_labels *labels);

/** From now on labels are kept; before, they are forgotten. false: no memory. */
bool kmp_graph_keep_labels(kmp_graph *g);

/** Labels the node of a reference, unless it is a leaf or has a label. */
void kmp_graph_label(kmp_graph *g, kmp_ref r, kmp_label label);

/** NULL where there is none. */
const kmp_label *kmp_graph_label_of(const kmp_graph *g, uint32_t id);

/** Whether labels are kept. */
bool kmp_graph_has_labels(const kmp_graph *g);

/** Where the graph keeps them. */
kmp_labels **kmp_graph_labels(kmp_graph *g);

#endif
