/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/formalisms/tangent_sets.h"
#include "symbolic/partials.h"

/* Both derivations of both matrices: by composite bodies, by differentiation. */
typedef struct both_methods {
    kmp_ref *by_q[2], *by_qd[2];
} both_methods;

/* Chooses the requested variant, or the one in which all requested sets have the fewest operations. */
static bool choose_methods(kmp_equations *eq, unsigned sets, const both_methods *b)
{
    kmp_ref *other = KMP_GRAPH_NEW(eq->graph, kmp_ref, kmp_equations_most_outputs(eq));
    const bool q = sets & (KMP_SET_INVERSE_Q | KMP_SET_CLOSED_Q), qd = sets & KMP_SET_INVERSE_QD;
    kmp_ref *const by_q[2] = {q ? b->by_q[0] : NULL, q ? b->by_q[1] : NULL};
    kmp_ref *const by_qd[2] = {qd ? b->by_qd[0] : NULL, qd ? b->by_qd[1] : NULL};
    kmp_tangent_choice choice = {0};
    int others = 0;
    if (other)
        others = kmp_equations_outputs(eq, sets & ~(unsigned)(KMP_TANGENT_SETS | KMP_SET_CLOSED), other);
    bool ok = other && kmp_tangents_choose(eq->graph, others, other, eq->n * eq->n, by_q, by_qd, &choice);
    eq->savings.by_q = choice.by_q ? KMP_TANGENT_FORWARD : KMP_TANGENT_COMPOSITE;
    eq->savings.by_qd = choice.by_qd ? KMP_TANGENT_FORWARD : KMP_TANGENT_COMPOSITE;
    return ok;
}

static bool derive_by_both(kmp_equations *eq, const kmp_tree *tree, const kmp_forces *forces, unsigned sets,
                           const both_methods *b, kmp_ref *qdd)
{
    kmp_savings *savings = &eq->savings;
    const bool open = savings->by_q == KMP_TANGENT_SHORTER || savings->by_qd == KMP_TANGENT_SHORTER;
    if (open)
        savings->by_q = savings->by_qd = KMP_TANGENT_SHORTER;
    for (int k = 0; k < eq->n; k++)
        qdd[k] = kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k);
    if (savings->by_q != KMP_TANGENT_FORWARD || savings->by_qd != KMP_TANGENT_FORWARD) {
        if (sets & KMP_SET_POWER_SLOPES) {
            eq->power_q = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
            eq->power_qd = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
            if (!eq->power_q || !eq->power_qd)
                return false;
        }
        kmp_tangents_composite(tree, qdd, forces, b->by_q[0], b->by_qd[0], eq->power_q, eq->power_qd);
    }
    if (savings->by_q != KMP_TANGENT_COMPOSITE)
        kmp_partials_all(eq->graph, eq->n, eq->inverse, KMP_IN_Q, eq->n, b->by_q[1]);
    if (savings->by_qd != KMP_TANGENT_COMPOSITE)
        kmp_partials_all(eq->graph, eq->n, eq->inverse, KMP_IN_QD, eq->n, b->by_qd[1]);
    if (kmp_graph_failed(eq->graph) || (open && !choose_methods(eq, sets, b)))
        return false;
    for (int k = 0; k < eq->n * eq->n; k++) {
        eq->inverse_q[k] = b->by_q[savings->by_q == KMP_TANGENT_FORWARD][k];
        eq->inverse_qd[k] = b->by_qd[savings->by_qd == KMP_TANGENT_FORWARD][k];
    }
    return true;
}

/* J' lambda has symmetric derivatives: they are the second ones of lambda' h. `room`: n x n. */
static bool derive_closed(kmp_equations *eq, const kmp_ref *jt_lambda, kmp_ref *room)
{
    int n = eq->n;
    kmp_partials_all(eq->graph, n, jt_lambda, KMP_IN_Q, n, room);
    if (kmp_graph_failed(eq->graph) || !kmp_tangents_mirror(eq->graph, n, room))
        return false;
    for (int k = 0; k < n * n; k++)
        eq->closed_q[k] = kmp_sub(eq->graph, eq->inverse_q[k], room[k]);
    return true;
}

bool kmp_tangent_sets_derive(kmp_equations *eq, const kmp_tree *tree, const kmp_forces *forces, unsigned sets,
                             const kmp_ref *jt_lambda)
{
    size_t size = (size_t)eq->n * (size_t)eq->n;
    kmp_ref *room = KMP_GRAPH_NEW(eq->graph, kmp_ref, 7 * size), *qdd = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
    if (!room || !qdd)
        return false;
    const both_methods b = {{room, room + size}, {room + 2 * size, room + 3 * size}};
    eq->inverse_q = room + 4 * size;
    eq->inverse_qd = room + 5 * size;
    eq->closed_q = room + 6 * size;
    return derive_by_both(eq, tree, forces, sets, &b, qdd) &&
           (!(sets & KMP_SET_CLOSED_Q) || derive_closed(eq, jt_lambda, room));
}
