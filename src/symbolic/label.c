/* SPDX-License-Identifier: BSD-3-Clause */
#include "symbolic/label.h"
#include "base/memory.h"

struct kmp_labels {
    kmp_label *of; /* by id */
    uint32_t capacity;
    bool failed;
};

void kmp_labels_free(kmp_labels *labels)
{
    if (!labels)
        return;
    kmp_free(labels->of);
    kmp_free(labels);
}

bool kmp_labels_failed(const kmp_labels *labels)
{
    return labels && labels->failed;
}

static bool reserve(kmp_labels *labels, uint32_t id)
{
    if (id < labels->capacity)
        return true;
    uint32_t capacity = 2 * id + 256;
    kmp_label *of = kmp_realloc(labels->of, capacity, sizeof *of);
    if (!of) {
        labels->failed = true;
        return false;
    }
    for (uint32_t k = labels->capacity; k < capacity; k++)
        of[k] = (kmp_label){0};
    labels->of = of;
    labels->capacity = capacity;
    return true;
}

bool kmp_graph_keep_labels(kmp_graph *g)
{
    kmp_labels **labels = kmp_graph_labels(g);
    if (!*labels)
        *labels = KMP_NEW(kmp_labels, 1);
    return *labels;
}

void kmp_graph_label(kmp_graph *g, kmp_ref r, kmp_label label)
{
    kmp_labels *labels = *kmp_graph_labels(g);
    uint32_t id = kmp_id(r);
    if (!labels || kmp_op_arity((kmp_op)kmp_graph_node(g, id)->op) == 0 || !reserve(labels, id) ||
        labels->of[id].quantity)
        return;
    label.negative = label.negative != kmp_is_negative(r);
    labels->of[id] = label;
}

bool kmp_graph_has_labels(const kmp_graph *g)
{
    return *kmp_graph_labels((kmp_graph *)g);
}

const kmp_label *kmp_graph_label_of(const kmp_graph *g, uint32_t id)
{
    const kmp_labels *labels = *kmp_graph_labels((kmp_graph *)g);
    return labels && id < labels->capacity && labels->of[id].quantity ? &labels->of[id] : NULL;
}
