/* SPDX-License-Identifier: BSD-3-Clause */
/* Chain rule per node, visited from the operands up; a rotated pair (Y, Z) = Rot(a) (y, z) uses
 * dY = Rot(a) (dy, dz) . e1 - Z da, which the graph mostly holds already. */
#include "symbolic/derivative.h"
#include "base/memory.h"
#include "symbolic/rotation.h"

#define UNKNOWN UINT32_MAX

struct kmp_derivative {
    kmp_graph *g;
    kmp_ref *memo; /* by id; UNKNOWN where not yet derived */
    uint32_t capacity;
    uint32_t *stack;
    uint32_t stack_capacity;
    uint8_t depends; /* inputs that move */
};

/* Room in memo for ids below n. */
static bool reserve(kmp_derivative *d, uint32_t n)
{
    if (n <= d->capacity)
        return true;
    uint32_t capacity = n + n / 2 + 64;
    kmp_ref *memo = kmp_realloc(d->memo, capacity, sizeof *memo);
    if (!memo)
        return false;
    for (uint32_t i = d->capacity; i < capacity; i++)
        memo[i] = UNKNOWN;
    d->memo = memo;
    d->capacity = capacity;
    return true;
}

kmp_derivative *kmp_derivative_new(kmp_graph *g, int count, const kmp_ref *leaf, const kmp_ref *direction)
{
    kmp_derivative *d = KMP_NEW(kmp_derivative, 1);
    if (!d)
        return NULL;
    d->g = g;
    if (!reserve(d, kmp_graph_count(g))) {
        kmp_derivative_free(d);
        return NULL;
    }
    for (int k = 0; k < count; k++) {
        d->memo[kmp_id(leaf[k])] = direction[k];
        d->depends |= kmp_graph_node(g, kmp_id(leaf[k]))->depends;
    }
    return d;
}

void kmp_derivative_free(kmp_derivative *d)
{
    if (!d)
        return;
    kmp_free(d->memo);
    kmp_free(d->stack);
    kmp_free(d);
}

/* Known without looking deeper? */
static bool settled(kmp_derivative *d, uint32_t id)
{
    if (d->memo[id] != UNKNOWN)
        return true;
    const kmp_node *n = kmp_graph_node(d->g, id);
    if ((n->depends & d->depends) == 0 || n->op == KMP_OP_INPUT) {
        d->memo[id] = KMP_ZERO;
        return true;
    }
    return false;
}

static kmp_ref of(const kmp_derivative *d, kmp_ref x)
{
    kmp_ref r = d->memo[kmp_id(x)];
    return kmp_is_negative(x) ? kmp_neg(r) : r;
}

static kmp_ref derive_unary(kmp_graph *g, kmp_op op, kmp_ref x, kmp_ref y)
{
    switch (op) {
#define KMP_LEAF(name)
#define KMP_BINARY(name, text)
#define KMP_UNARY(name, text, value, derivative)                                                                       \
    case KMP_OP_##name:                                                                                                \
        return derivative;
#include "symbolic/ops.def"
#undef KMP_LEAF
#undef KMP_BINARY
#undef KMP_UNARY
    default:
        (void)g, (void)x, (void)y;
        return KMP_ZERO;
    }
}

static kmp_ref derive_pair(kmp_derivative *d, const kmp_pair *pair)
{
    kmp_ref dy = of(d, pair->y), dz = of(d, pair->z);
    kmp_rotate(d->g, pair->angle, &dy, &dz);
    return kmp_sub(d->g, dy, kmp_mul(d->g, pair->second, of(d, pair->angle)));
}

static kmp_ref derive(kmp_derivative *d, uint32_t id)
{
    kmp_graph *g = d->g;
    kmp_node n = *kmp_graph_node(g, id);
    kmp_pair pair;
    if (kmp_rotated_pair(g, id, &pair))
        return derive_pair(d, &pair);
    switch ((kmp_op)n.op) {
    case KMP_OP_CONST:
    case KMP_OP_INPUT:
        return KMP_ZERO;
    case KMP_OP_ADD:
        return kmp_add(g, of(d, n.a), of(d, n.b));
    case KMP_OP_MUL:
        return kmp_add(g, kmp_mul(g, of(d, n.a), n.b), kmp_mul(g, n.a, of(d, n.b)));
    case KMP_OP_DIV: /* d(a/b) = (da - (a/b) db) / b */
        return kmp_div(g, kmp_sub(g, of(d, n.a), kmp_mul(g, id << 1, of(d, n.b))), n.b);
    default:
        return kmp_mul(g, derive_unary(g, (kmp_op)n.op, n.a, id << 1), of(d, n.a));
    }
}

/* What derive(id) reads; returns how many. */
static int needs(kmp_derivative *d, uint32_t id, uint32_t need[3])
{
    const kmp_node *n = kmp_graph_node(d->g, id);
    kmp_pair pair;
    if (kmp_rotated_pair(d->g, id, &pair)) {
        need[0] = kmp_id(pair.y);
        need[1] = kmp_id(pair.z);
        need[2] = kmp_id(pair.angle);
        return 3;
    }
    int arity = kmp_op_arity((kmp_op)n->op);
    need[0] = kmp_id(n->a);
    need[1] = kmp_id(n->b);
    return arity;
}

static bool push(kmp_derivative *d, uint32_t *top, uint32_t id)
{
    if (*top == d->stack_capacity) {
        uint32_t capacity = d->stack_capacity ? 2 * d->stack_capacity : 256;
        uint32_t *stack = kmp_realloc(d->stack, capacity, sizeof *stack);
        if (!stack)
            return false;
        d->stack = stack;
        d->stack_capacity = capacity;
    }
    d->stack[(*top)++] = id;
    return true;
}

kmp_ref kmp_derivative_of(kmp_derivative *d, kmp_ref x)
{
    uint32_t top = 0;
    if (kmp_graph_failed(d->g) || !reserve(d, kmp_graph_count(d->g)) || !push(d, &top, kmp_id(x)))
        return KMP_ZERO;
    while (top) {
        uint32_t id = d->stack[top - 1], need[3] = {0};
        if (settled(d, id)) {
            top--;
            continue;
        }
        int count = needs(d, id, need), open = 0;
        for (int k = 0; k < count; k++)
            if (!settled(d, need[k])) {
                if (!push(d, &top, need[k]))
                    return KMP_ZERO;
                open++;
            }
        if (open)
            continue;
        kmp_ref r = derive(d, id);
        d->memo[id] = r;
        top--;
    }
    return of(d, x);
}
