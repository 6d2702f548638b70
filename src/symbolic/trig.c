/* SPDX-License-Identifier: BSD-3-Clause */
/* sin(a + b) = sin a cos b + cos a sin b, where sin and cos of a and of b are needed by other nodes or follow by the
 * same rule. Angles are visited in id order, so a part precedes its sum. */
#include "symbolic/trig.h"
#include "base/arena.h"
#include "symbolic/function_table.h"
#include "symbolic/label.h"
#include "symbolic/live.h"
#include "symbolic/stack.h"

/* True if sin and cos of r cost nothing or come from calls that are needed anyway. */
static bool at_hand(const kmp_graph *g, const uint8_t *angle_live, kmp_ref r)
{
    return angle_live[kmp_id(r)] || kmp_graph_node(g, kmp_id(r))->op == KMP_OP_CONST;
}

/* The needed sines and cosines, the last one first. false: no memory. */
static bool list_trig(const kmp_graph *g, uint32_t nodes, const uint8_t *live, kmp_stack *trig)
{
    bool ok = true;
    for (uint32_t id = nodes; ok && (id = kmp_live_before(live, id)) != UINT32_MAX;)
        if (kmp_graph_node(g, id)->op == KMP_OP_SIN || kmp_graph_node(g, id)->op == KMP_OP_COS)
            ok = kmp_push(trig, id);
    return ok;
}

typedef struct sincos_of {
    kmp_ref s, c;
} sincos_of;

/* sin and cos of an angle, by the addition theorem when both parts are available. */
static sincos_of expand(kmp_graph *g, const uint8_t *angle_live, kmp_ref angle)
{
    kmp_node n = *kmp_graph_node(g, kmp_id(angle));
    sincos_of r;
    if (n.op == KMP_OP_ADD && at_hand(g, angle_live, n.a) && at_hand(g, angle_live, n.b)) {
        sincos_of p = expand(g, angle_live, n.a), q = expand(g, angle_live, n.b);
        r.s = kmp_add(g, kmp_mul(g, p.s, q.c), kmp_mul(g, p.c, q.s));
        r.c = kmp_sub(g, kmp_mul(g, p.c, q.c), kmp_mul(g, p.s, q.s));
    } else {
        r.s = kmp_sin(g, angle & ~(kmp_ref)1);
        r.c = kmp_cos(g, angle & ~(kmp_ref)1);
    }
    if (kmp_is_negative(angle))
        r.s = kmp_neg(r.s);
    return r;
}

static bool write_out(kmp_graph *g, uint32_t nodes, const uint8_t *live, const kmp_stack *trig, kmp_arena *room,
                      int count, kmp_ref *outputs, bool *changed)
{
    uint8_t *angle_live = KMP_ARENA_NEW(room, uint8_t, nodes);
    for (uint32_t k = 0; angle_live && k < trig->top; k++)
        angle_live[kmp_id(kmp_graph_node(g, trig->id[k])->a)] = 1;
    if (!angle_live)
        return false;
    /* Makes both functions of each angle, up to one of a sum to be expanded. */
    bool any = false;
    for (uint32_t k = trig->top; k-- > 0 && !any;) {
        kmp_node n = *kmp_graph_node(g, trig->id[k]);
        const kmp_node *angle = kmp_graph_node(g, kmp_id(n.a));
        any = angle->op == KMP_OP_ADD && at_hand(g, angle_live, angle->a) && at_hand(g, angle_live, angle->b);
        if (!any)
            (void)expand(g, angle_live, n.a);
    }
    if (!any)
        return true;
    kmp_ref *map = KMP_ARENA_NEW(room, kmp_ref, nodes);
    if (!map)
        return false;
    for (uint32_t id = 0; id < nodes; id++) {
        if (!live[id])
            continue;
        kmp_node n = *kmp_graph_node(g, id);
        if (n.op == KMP_OP_SIN)
            map[id] = expand(g, angle_live, n.a).s;
        else if (n.op == KMP_OP_COS)
            map[id] = expand(g, angle_live, n.a).c;
        else
            map[id] = kmp_graph_rebuild_by(g, g, id, map);
        const kmp_label *label = kmp_graph_label_of(g, id);
        if (label)
            kmp_graph_label(g, map[id], *label);
    }
    for (int k = 0; k < count; k++)
        outputs[k] = kmp_mapped(map, outputs[k]);
    *changed = true;
    return true;
}

bool kmp_trig_sums_of(kmp_graph *g, uint32_t nodes, const uint8_t *live, int count, kmp_ref *outputs, bool *changed)
{
    kmp_arena room = {0};
    kmp_stack trig = {0};
    bool ok = list_trig(g, nodes, live, &trig) &&
              (trig.top == 0 || write_out(g, nodes, live, &trig, &room, count, outputs, changed));
    kmp_free(trig.id);
    kmp_arena_free(&room);
    return ok && !kmp_graph_failed(g);
}

bool kmp_trig_sums(kmp_graph *g, int count, kmp_ref *outputs)
{
    uint32_t nodes = kmp_graph_count(g);
    uint8_t *live = KMP_NEW(uint8_t, nodes);
    bool changed, ok = live;
    if (ok) {
        kmp_live_mark(g, count, outputs, live);
        ok = kmp_trig_sums_of(g, nodes, live, count, outputs, &changed);
    }
    kmp_free(live);
    return ok;
}
