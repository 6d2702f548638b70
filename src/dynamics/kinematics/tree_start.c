/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/kinematics/tree_start.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "model/data/model.h"
#include "symbolic/substitute.h"

/* The drive of a motion; NULL: it has none. */
static const kmp_closure *drive_of(const kempe_model *model, int motion)
{
    for (int c = 0; c < model->closure_count; c++)
        if (model->closures[c].kind == KMP_CLOSURE_drive && model->closures[c].motion == motion)
            return &model->closures[c];
    return NULL;
}

/* The coordinate of a motion at the start: as it is driven, or as it is written. */
static kmp_ref start_of(const kmp_tree *tree, int motion)
{
    const kmp_closure *drive = drive_of(tree->model, motion);
    return drive ? kmp_tree_expression(tree, drive->function) : kmp_tree_number(tree, &tree->model->start.q[motion]);
}

void kmp_put_start(const kmp_tree *tree, const kmp_tree *of, int count, kmp_ref *values)
{
    kmp_graph *g = tree->graph;
    const kempe_model *model = tree->model;
    const int n = model->motion_count, times = kmp_tree_time_leaf_count(tree);
    kmp_ref *from = KMP_GRAPH_NEW(g, kmp_ref, n + times + 1), *to = KMP_GRAPH_NEW(g, kmp_ref, n + times + 1);
    uint16_t through;
    if (!from || !to) {
        kmp_graph_fail(g);
        return;
    }
    for (int k = 0; k < n; k++) {
        from[k] = kmp_input(g, KMP_IN_Q, (uint32_t)k);
        to[k] = start_of(tree, k);
    }
    if (!kmp_substitute(g, n, from, to, count, values, &through))
        kmp_graph_fail(g);
    from[0] = kmp_input(g, KMP_IN_TIME, 0);
    to[0] = KMP_ZERO;
    for (int k = 0; k < model->input_count; k++) {
        from[1 + k] = kmp_input(g, KMP_IN_TIME, kmp_time_index(k, 0));
        to[1 + k] = kmp_const(g, kmp_signal_value(&model->inputs[k].signal, 0));
    }
    if (!kmp_substitute(g, 1 + model->input_count, from, to, count, values, &through))
        kmp_graph_fail(g);
    for (int k = 0; k < kmp_tree_symbol_count(tree); k++)
        of->symbols[k] = tree->symbols[k] != 0 ? tree->symbols[k] : of->symbols[k];
}

bool kmp_is_driven(const kempe_model *model, int motion)
{
    return drive_of(model, motion) != NULL;
}
