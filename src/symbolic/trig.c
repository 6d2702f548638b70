/* SPDX-License-Identifier: BSD-3-Clause */
/* sin(a + b) = sin a cos b + cos a sin b, where sin and cos of a and of b are needed by other nodes or follow by the
 * same rule. Angles are visited in id order, so a part precedes its sum. */
#include "symbolic/trig.h"
#include "base/arena.h"
#include "base/memory.h"
#include "symbolic/function_table.h"
#include "symbolic/label.h"
#include "symbolic/live.h"
#include "symbolic/stack.h"
#include <string.h>

/* -- rotated pairs ----------------------------------------------------------------------------------- */

/* A hash table from result pairs to their source and angle. A pair and its three quarter turns are one entry. */

enum { TURNS = 4 };

typedef struct two {
    kmp_ref y, z;
} two;

typedef struct entry {
    two pair;   /* of its quarter turns the one that is_kept */
    two source; /* pair = Rot(angle) source */
    kmp_ref angle;
} entry;

struct kmp_rotations {
    entry *entries; /* in the order of their time */
    uint32_t count, room;
    uint32_t *slots; /* 1 + an entry; 0: free */
    uint32_t size;
    uint32_t *of_node; /* 1 + TURNS entry + turn, where the turned pair begins with the node; 0: none */
    uint32_t node_capacity;
    kmp_ref angle, cosine, sine; /* of the last rotation */
    bool failed;
};

kmp_rotations *kmp_rotations_new(void)
{
    return KMP_NEW(kmp_rotations, 1);
}

void kmp_rotations_free(kmp_rotations *r)
{
    if (!r)
        return;
    kmp_free(r->entries);
    kmp_free(r->slots);
    kmp_free(r->of_node);
    kmp_free(r);
}

static void copy(void *to, const void *from, size_t count, size_t size)
{
    if (count)
        memcpy(to, from, count * size);
}

/* The table has the room of the copy, or more. */
static void assign(kmp_rotations *r, const kmp_rotations *from)
{
    kmp_rotations own = *r;
    copy(own.entries, from->entries, from->count, sizeof *own.entries);
    copy(own.slots, from->slots, from->size, sizeof *own.slots);
    copy(own.of_node, from->of_node, from->node_capacity, sizeof *own.of_node);
    *r = *from;
    r->entries = own.entries;
    r->slots = own.slots;
    r->of_node = own.of_node;
}

kmp_rotations *kmp_rotations_copy(const kmp_rotations *r)
{
    kmp_rotations *c = kmp_rotations_new();
    if (!c)
        return NULL;
    c->entries = KMP_NEW(entry, r->room);
    c->slots = KMP_NEW(uint32_t, r->size);
    c->of_node = KMP_NEW(uint32_t, r->node_capacity);
    if (c->entries && c->slots && c->of_node) {
        assign(c, r);
        return c;
    }
    kmp_rotations_free(c);
    return NULL;
}

void kmp_rotations_assign(kmp_rotations *r, const kmp_rotations *copy)
{
    bool failed = r->failed;
    assign(r, copy);
    r->failed = failed;
}

bool kmp_rotations_failed(const kmp_rotations *r)
{
    return r->failed;
}

/* -- quarter turns --------------------------------------------------------------------------------- */

static two turned(two p, unsigned turn)
{
    switch (turn % TURNS) {
    case 1:
        return (two){kmp_neg(p.z), p.y};
    case 2:
        return (two){kmp_neg(p.y), kmp_neg(p.z)};
    case 3:
        return (two){p.z, kmp_neg(p.y)};
    default:
        return p;
    }
}

static bool is_kept(two p)
{
    return p.y != KMP_ZERO && !kmp_is_negative(p.y) &&
           (kmp_id(p.y) > kmp_id(p.z) || (kmp_id(p.y) == kmp_id(p.z) && !kmp_is_negative(p.z)));
}

/* The turn from the pair that is kept to p, which becomes that pair. A pair of zeros has none. */
static unsigned turn_to_kept(two *p)
{
    unsigned turn = 0;
    for (two q = *p; !is_kept(q) && ++turn < TURNS;)
        q = turned(*p, TURNS - turn);
    *p = turned(*p, TURNS - turn);
    return turn;
}

/* -- the table ------------------------------------------------------------------------------------- */

static uint32_t slot(const kmp_rotations *r, two p)
{
    uint32_t k = (p.y * 0x9e3779b1u ^ p.z * 0x85ebca6bu);
    k ^= k >> 15;
    for (k &= r->size - 1; r->slots[k]; k = (k + 1) & (r->size - 1)) {
        const entry *e = &r->entries[r->slots[k] - 1];
        if (e->pair.y == p.y && e->pair.z == p.z)
            break;
    }
    return k;
}

/* Room for one more entry. */
static bool reserve(kmp_rotations *r)
{
    if (r->entries && r->count < r->room)
        return true;
    uint32_t room = r->room ? 2 * r->room : 64, size = 2 * room;
    entry *entries = kmp_realloc(r->entries, room, sizeof *entries);
    r->entries = entries ? entries : r->entries;
    uint32_t *slots = entries ? KMP_NEW(uint32_t, size) : NULL;
    r->failed = r->failed || !slots;
    if (!slots)
        return false;
    kmp_free(r->slots);
    r->slots = slots;
    r->size = size;
    r->room = room;
    for (uint32_t i = 0; i < r->count; i++)
        slots[slot(r, r->entries[i].pair)] = i + 1;
    return true;
}

/* Notes the pair with which a node begins: the first one stays. */
static void note_node(kmp_rotations *r, uint32_t id, uint32_t mark)
{
    if (id >= r->node_capacity) {
        uint32_t capacity = 2 * id + 256;
        uint32_t *of_node = kmp_realloc(r->of_node, capacity, sizeof *of_node);
        if (!of_node) {
            r->failed = true;
            return;
        }
        memset(of_node + r->node_capacity, 0, (capacity - r->node_capacity) * sizeof *of_node);
        r->of_node = of_node;
        r->node_capacity = capacity;
    }
    if (r->of_node[id] == 0)
        r->of_node[id] = mark;
}

/* The entry of a pair that is kept; NULL: none. */
static const entry *find(const kmp_rotations *r, two kept)
{
    uint32_t at = r->size ? r->slots[slot(r, kept)] : 0;
    return at ? &r->entries[at - 1] : NULL;
}

static void remember(kmp_rotations *r, two pair, two source, kmp_ref angle)
{
    two kept = pair;
    unsigned turn = turn_to_kept(&kept);
    if (turn == TURNS || find(r, kept) || !reserve(r))
        return;
    uint32_t index = r->count++;
    r->slots[slot(r, kept)] = index + 1;
    r->entries[index] = (entry){kept, turned(source, TURNS - turn), angle};
    for (unsigned k = 0; k < TURNS; k++) {
        kmp_ref first = turned(pair, k).y;
        if (first != KMP_ZERO && !kmp_is_negative(first))
            note_node(r, kmp_id(first), 1 + TURNS * index + (turn + k) % TURNS);
    }
}

/* -- angles ---------------------------------------------------------------------------------------- */

enum { MAX_TERMS = 64 };

/* The terms of a sum; the returned number may exceed the number stored. */
static int flatten(const kmp_graph *g, kmp_ref a, kmp_ref *terms, int count)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(a));
    if (n->op != KMP_OP_ADD || count >= MAX_TERMS) {
        if (count < MAX_TERMS)
            terms[count] = a;
        return count + 1;
    }
    count = flatten(g, n->a ^ (a & 1), terms, count);
    return flatten(g, n->b ^ (a & 1), terms, count);
}

kmp_ref kmp_angle_add(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref terms[MAX_TERMS], sum = KMP_ZERO;
    int n = flatten(g, b, terms, flatten(g, a, terms, 0));
    if (n > MAX_TERMS)
        return kmp_add(g, a, b);
    for (int i = 1; i < n; i++) /* by id: from the root of the tree outwards */
        for (int k = i; k > 0 && kmp_id(terms[k]) < kmp_id(terms[k - 1]); k--) {
            kmp_ref t = terms[k];
            terms[k] = terms[k - 1];
            terms[k - 1] = t;
        }
    for (int i = 0; i < n; i++) {
        if (i + 1 < n && terms[i] == kmp_neg(terms[i + 1]))
            i++;
        else
            sum = kmp_add(g, sum, terms[i]);
    }
    return sum;
}

/* -- the rotation ---------------------------------------------------------------------------------- */

void kmp_rotate(kmp_graph *g, kmp_ref angle, kmp_ref *y, kmp_ref *z)
{
    kmp_rotations *r = kmp_graph_rotations(g);
    bool collapse = kmp_graph_has_rule(g, KMP_RULE_TRIG);
    if (*y == KMP_ZERO && *z == KMP_ZERO && kmp_graph_has_rule(g, KMP_RULE_ZERO))
        return;
    two kept = {*y, *z};
    unsigned turn = turn_to_kept(&kept);
    const entry *e = collapse && turn < TURNS ? find(r, kept) : NULL;
    kmp_ref sum = e ? kmp_angle_add(g, e->angle, angle) : angle;
    if (e && (sum == KMP_ZERO || kmp_graph_has_rule(g, KMP_RULE_RUNS))) {
        two source = turned(e->source, turn);
        *y = source.y;
        *z = source.z;
        angle = sum;
    }
    if (angle == KMP_ZERO)
        return;
    if (angle != r->angle || !kmp_graph_has_rule(g, KMP_RULE_SHARE)) {
        r->cosine = kmp_cos(g, angle);
        r->sine = kmp_sin(g, angle);
        r->angle = angle;
    }
    kmp_ref y0 = *y, z0 = *z, c = r->cosine, s = r->sine;
    *y = kmp_sub(g, kmp_mul(g, y0, c), kmp_mul(g, z0, s));
    *z = kmp_add(g, kmp_mul(g, y0, s), kmp_mul(g, z0, c));
    if (collapse)
        remember(r, (two){*y, *z}, (two){y0, z0}, angle);
}

bool kmp_rotated_pair(kmp_graph *g, uint32_t id, kmp_pair *pair)
{
    const kmp_rotations *r = kmp_graph_rotations(g);
    if (id >= r->node_capacity || r->of_node[id] == 0)
        return false;
    uint32_t mark = r->of_node[id] - 1;
    const entry *e = &r->entries[mark / TURNS];
    two source = turned(e->source, mark % TURNS);
    *pair = (kmp_pair){source.y, source.z, e->angle, turned(e->pair, mark % TURNS).z};
    return kmp_id(source.y) < id && kmp_id(source.z) < id &&
           kmp_id(e->angle) < id; /* otherwise it would lead to a cycle */
}

/* -- sums of angles ---------------------------------------------------------------------------------- */

typedef struct sincos_of {
    kmp_ref s, c;
} sincos_of;

/* The expansion of sums of angles in one graph. An angle is expanded once: sums of many angles have their parts in
 * common, and without a memory of these the work would grow with the square of the number of parts. */
typedef struct expansion {
    kmp_graph *graph;
    uint8_t *angle_live; /* a node: it is the angle of a needed sine or cosine */
    sincos_of *known;    /* a node: its functions, once they were made */
    uint8_t *is_known;
} expansion;

/* True if sin and cos of r cost nothing or come from calls that are needed anyway. */
static bool at_hand(const expansion *e, kmp_ref r)
{
    return e->angle_live[kmp_id(r)] || kmp_graph_node(e->graph, kmp_id(r))->op == KMP_OP_CONST;
}

static bool is_expandable(const expansion *e, const kmp_node *angle)
{
    return angle->op == KMP_OP_ADD && at_hand(e, angle->a) && at_hand(e, angle->b);
}

/* sin and cos of an angle of the graph as it was, by the addition theorem when both parts are available. */
static sincos_of expand(expansion *e, kmp_ref angle)
{
    const uint32_t id = kmp_id(angle);
    kmp_graph *g = e->graph;
    sincos_of r = e->known[id];
    if (!e->is_known[id]) {
        const kmp_node n = *kmp_graph_node(g, id);
        if (is_expandable(e, &n)) {
            sincos_of p = expand(e, n.a), q = expand(e, n.b);
            r.s = kmp_add(g, kmp_mul(g, p.s, q.c), kmp_mul(g, p.c, q.s));
            r.c = kmp_sub(g, kmp_mul(g, p.c, q.c), kmp_mul(g, p.s, q.s));
        } else {
            r.s = kmp_sin(g, angle & ~(kmp_ref)1);
            r.c = kmp_cos(g, angle & ~(kmp_ref)1);
        }
        e->known[id] = r;
        e->is_known[id] = 1;
    }
    if (kmp_is_negative(angle))
        r.s = kmp_neg(r.s);
    return r;
}

static bool write_out(kmp_graph *g, uint32_t nodes, const uint8_t *live, const kmp_stack *trig, kmp_arena *room,
                      int count, kmp_ref *outputs, bool *changed)
{
    expansion e = {.graph = g,
                   .angle_live = KMP_ARENA_NEW(room, uint8_t, nodes),
                   .known = KMP_ARENA_NEW(room, sincos_of, nodes),
                   .is_known = KMP_ARENA_NEW(room, uint8_t, nodes)};
    if (!e.angle_live || !e.known || !e.is_known)
        return false;
    for (uint32_t k = 0; k < trig->top; k++)
        e.angle_live[kmp_id(kmp_graph_node(g, trig->id[k])->a)] = 1;
    /* Makes both functions of each angle, up to one of a sum to be expanded. */
    bool any = false;
    for (uint32_t k = trig->top; k-- > 0 && !any;) {
        kmp_ref angle = kmp_graph_node(g, trig->id[k])->a;
        any = is_expandable(&e, kmp_graph_node(g, kmp_id(angle)));
        if (!any)
            (void)expand(&e, angle);
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
            map[id] = expand(&e, n.a).s;
        else if (n.op == KMP_OP_COS)
            map[id] = expand(&e, n.a).c;
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
    bool ok = true; /* the needed sines and cosines, the last one first */
    for (uint32_t id = nodes; ok && (id = kmp_live_before(live, id)) != UINT32_MAX;)
        if (kmp_graph_node(g, id)->op == KMP_OP_SIN || kmp_graph_node(g, id)->op == KMP_OP_COS)
            ok = kmp_push(&trig, id);
    ok = ok && (trig.top == 0 || write_out(g, nodes, live, &trig, &room, count, outputs, changed));
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
