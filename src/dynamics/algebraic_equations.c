/* SPDX-License-Identifier: BSD-3-Clause */
/* The model's algebraic variables as nodes: an implicit block for each group, made when its first variable is used. */
#include "base/clones.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/implicit.h"

/* The value of a name, or all variables of a group. */
KMP_NOINLINE static void solve(const kmp_tree *tree, int index, const kmp_unknowns *u, kmp_ref *value)
{
    kmp_tree inner = *tree; /* within a group kinks stay kinks */
    kmp_ref residual[KMP_UNKNOWNS_MOST], guess[KMP_UNKNOWNS_MOST];
    inner.kinks = false;
    if (u->count == 0) {
        value[0] = kmp_tree_expression(&inner, u->zero[0]);
        return;
    }
    inner.solving = index + 1;
    for (int k = 0; k < u->count; k++) {
        residual[k] = kmp_tree_expression(&inner, u->zero[k]);
        guess[k] = kmp_tree_number(tree, &u->guess[k]);
    }
    kmp_enclose(tree->graph, u->count, residual, guess, value);
}

/* A named expression, whose kinks are conditions: once for all laws of forces. */
KMP_NOINLINE static kmp_ref with_kinks(const kmp_tree *tree, int index, const kmp_unknowns *u)
{
    bool kept = tree->unknown && !tree->bends && (tree->row || !u->late);
    kmp_ref own = KMP_ZERO, *value = kept ? tree->unknown + KMP_UNKNOWNS_MOST * index + 1 : &own;
    if (*value == KMP_ZERO)
        *value = kmp_tree_expression(tree, u->zero[0]);
    return *value;
}

kmp_ref kmp_tree_unknown(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_ref value[KMP_UNKNOWNS_MOST];
    const kmp_unknowns *u = &tree->model->unknowns[e->index];
    if (tree->solving == e->index + 1)
        return kmp_unknown(tree->graph, e->number);
    if (u->count == 0 && (tree->kinks || tree->bends))
        return with_kinks(tree, e->index, u);
    /* Multipliers are not final before the closures' rows are. */
    if (!tree->unknown || (!tree->row && u->late)) {
        solve(tree, e->index, u, value);
        return value[e->number];
    }
    kmp_ref *kept = tree->unknown + KMP_UNKNOWNS_MOST * e->index;
    if (!tree->solved[e->index])
        solve(tree, e->index, u, kept);
    tree->solved[e->index] = true;
    return kept[e->number];
}
