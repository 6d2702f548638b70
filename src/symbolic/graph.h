/* SPDX-License-Identifier: BSD-3-Clause */
/* The expression graph: hash-consed nodes in one array, simplified when made; the order of ids is topological.
 *
 * A reference is id << 1 | sign, so that unary minus costs nothing and does not exist as a node; the number zero is
 * node 0 and one is node 1. The same construction in the same order gives the same ids: nothing depends on addresses.
 * Running out of memory is sticky: references are then zero and kmp_graph_failed returns true. */
#pragma once

#include "base/arena.h"
#include "symbolic/argument_order.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct kmp_implicit;

typedef uint32_t kmp_ref;

#define KMP_ZERO ((kmp_ref)0)
#define KMP_ONE  ((kmp_ref)2)

typedef enum kmp_op {
#define KMP_LEAF(name)                                       KMP_OP_##name,
#define KMP_BINARY(name, text, value)                        KMP_OP_##name,
#define KMP_UNARY(name, text, parity, value, derivative)     KMP_OP_##name,
#define KMP_BINARY_FUNCTION(name, text, value, differential) KMP_OP_##name,
#define KMP_TERNARY(name, text, value, differential)         KMP_OP_##name,
#define KMP_APPLIED(name, text)                              KMP_OP_##name,
#include "symbolic/ops_end.h"
    KMP_OP_COUNT
} kmp_op;

/** The vectors that inputs belong to. */
typedef enum kmp_input_kind {
    KMP_IN_PARAMETER,
    KMP_IN_TIME, /* t, then for each given function of t three numbers: value and two derivatives */
    KMP_IN_Q,
    KMP_IN_QD,
    KMP_IN_QDD,
    KMP_IN_LAMBDA,
    KMP_IN_MU,
    KMP_IN_MODE,   /* 1 or 0 for each condition, constant during a step */
    KMP_IN_PLACE,  /* x, y, z that kmp_graph_replace puts something for: in no program */
    KMP_IN_CHART,  /* constant rotations that change between steps, 9 numbers each, row by row */
    KMP_IN_FORCE,  /* three a body, at its centre of mass, body axes */
    KMP_IN_TORQUE, /* three per body, in body axes */
    KMP_IN_EFFORT, /* one per coordinate, in addition to the model's forces */
    KMP_IN_ALONG,  /* directions of differentiation, one after the other */
    KMP_IN_KEPT,   /* of each closure row, by articulated bodies: 1, or 0 where it has no multiplier */
    KMP_IN_COUNT
} kmp_input_kind;

/** Index in KMP_IN_TIME of a given function of t, or of a derivative of it by t. */
enum { KMP_TIME_NUMBERS = 3 };
static inline uint32_t kmp_time_index(int function, int derivative)
{
    return (uint32_t)(1 + KMP_TIME_NUMBERS * function + derivative);
}

/* The inputs that a node depends on: bits (1 << kmp_input_kind). */
typedef struct kmp_node {
    uint8_t op;
    uint16_t depends;
    uint32_t a, b, c; /* operands (references); INPUT: kind, index; CONST: a = index of its value */
} kmp_node;

typedef struct kmp_graph kmp_graph;

/** Simplifications made when a node is created. */
enum {
    KMP_RULE_ZERO = 1,   /* zeros and ones, arithmetic of numbers */
    KMP_RULE_CANCEL = 2, /* a - a, a + b - a, terms with the same base */
    KMP_RULE_SHARE = 4,  /* equal nodes are one, and become auxiliary variables; squares are collected */
    KMP_RULE_TRIG = 8,   /* cos^2 + sin^2, rotations of rotated pairs about the same axis */
    KMP_RULE_RUNS = 16,  /* rotations by the sum of both angles; without it only back to the source */
    KMP_RULE_ALL = 31
};

kmp_graph *kmp_graph_new(void);
/** With room for this number of nodes from the beginning; it grows beyond. */
kmp_graph *kmp_graph_new_for(uint32_t nodes);
/** Selects rules, to measure the gain of each: a new graph applies all. */
void kmp_graph_set_rules(kmp_graph *g, unsigned rules);
void kmp_graph_free(kmp_graph *g);
bool kmp_graph_failed(const kmp_graph *g);

/** A state of a graph to return to: trials leave no nodes, tables, blocks and rotated pairs behind. Its room remains.
 */
typedef struct kmp_graph_mark {
    uint32_t nodes, values;
    int tables, implicits;
    struct kmp_rotations *rotations;
} kmp_graph_mark;

/** False: no memory. To be freed in any case. */
bool kmp_graph_mark_init(kmp_graph_mark *mark, const kmp_graph *g);
void kmp_graph_mark_free(kmp_graph_mark *mark);
void kmp_graph_return(kmp_graph *g, const kmp_graph_mark *mark);

/** Marks the graph as failed: an operation on it has run out of memory, so its references are invalid too. */
void kmp_graph_fail(kmp_graph *g);

/** Zeroed memory that lives as long as the graph, for n objects, or for several arrays (KMP_ARENA_MAKE). Without it the
 * graph has failed. */
kmp_arena *kmp_graph_arena(kmp_graph *g);
#define KMP_GRAPH_NEW(g, type, n) KMP_ARENA_NEW(kmp_graph_arena(g), type, n)
#define KMP_GRAPH_MAKE(g, ...)    KMP_ARENA_MAKE(kmp_graph_arena(g), __VA_ARGS__)

static inline uint32_t kmp_id(kmp_ref r)
{
    return r >> 1;
}
static inline bool kmp_is_negative(kmp_ref r)
{
    return r & 1;
}
/** The negative of a reference; zero has no sign. */
static inline kmp_ref kmp_neg(kmp_ref r)
{
    return r == KMP_ZERO ? r : r ^ 1;
}

/* The first members of a graph: only for the inline functions below, which every traversal of a graph calls. */
typedef struct kmp_graph_head {
    kmp_node *nodes;
    double *values; /* of CONST nodes */
    uint32_t count;
    unsigned rules;
} kmp_graph_head;

static inline bool kmp_graph_has_rule(const kmp_graph *g, unsigned rule)
{
    return ((const kmp_graph_head *)g)->rules & rule;
}
static inline unsigned kmp_graph_rules(const kmp_graph *g)
{
    return ((const kmp_graph_head *)g)->rules;
}
static inline uint32_t kmp_graph_count(const kmp_graph *g)
{
    return ((const kmp_graph_head *)g)->count;
}
static inline const kmp_node *kmp_graph_node(const kmp_graph *g, uint32_t id)
{
    return &((const kmp_graph_head *)g)->nodes[id];
}
/** True if a value depends on inputs of the kind. */
static inline bool kmp_depends_on(const kmp_graph *g, kmp_ref value, kmp_input_kind kind)
{
    return kmp_graph_node(g, kmp_id(value))->depends & 1u << kind;
}
/** The form of a reference, from the forms of nodes. */
static inline kmp_ref kmp_mapped(const kmp_ref *map, kmp_ref r)
{
    return kmp_is_negative(r) ? kmp_neg(map[kmp_id(r)]) : map[kmp_id(r)];
}
/** Value of a CONST node. */
static inline double kmp_graph_value(const kmp_graph *g, uint32_t id)
{
    return ((const kmp_graph_head *)g)->values[kmp_graph_node(g, id)->a];
}
/** True when r is a number, stored in *value. */
static inline bool kmp_is_const(const kmp_graph *g, kmp_ref r, double *value)
{
    if (kmp_graph_node(g, kmp_id(r))->op != KMP_OP_CONST)
        return false;
    double v = kmp_graph_value(g, kmp_id(r));
    *value = kmp_is_negative(r) ? -v : v;
    return true;
}

/** The node, or an equal one that exists: constructors end with it after simplification. */
kmp_ref kmp_graph_intern(kmp_graph *g, kmp_node n);

kmp_ref kmp_const(kmp_graph *g, double value);
kmp_ref kmp_input(kmp_graph *g, kmp_input_kind kind, uint32_t index);
/** Sums and products of two operands that need not be separate nodes; only for kmp_add and kmp_mul. */
kmp_ref kmp_graph_add(kmp_graph *g, kmp_ref a, kmp_ref b);
kmp_ref kmp_graph_mul(kmp_graph *g, kmp_ref a, kmp_ref b);
/* Most operands of equations are zeros and ones, which need no call. */
static inline kmp_ref kmp_add(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    if (kmp_graph_has_rule(g, KMP_RULE_ZERO) && (a == KMP_ZERO || b == KMP_ZERO))
        return a == KMP_ZERO ? b : a;
    return kmp_graph_add(g, a, b);
}
static inline kmp_ref kmp_sub(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    return kmp_add(g, a, kmp_neg(b));
}
static inline kmp_ref kmp_mul(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    if (kmp_graph_has_rule(g, KMP_RULE_ZERO)) {
        if (a == KMP_ZERO || b == KMP_ZERO)
            return KMP_ZERO;
        if (kmp_id(a) == kmp_id(KMP_ONE))
            return kmp_is_negative(a) ? kmp_neg(b) : b;
        if (kmp_id(b) == kmp_id(KMP_ONE))
            return kmp_is_negative(b) ? kmp_neg(a) : a;
    }
    return kmp_graph_mul(g, a, b);
}
kmp_ref kmp_div(kmp_graph *g, kmp_ref a, kmp_ref b);
/** op is one of the rows of functions of two variables. */
kmp_ref kmp_binary(kmp_graph *g, kmp_op op, kmp_ref a, kmp_ref b);
/** 1 when a < b, otherwise 0. */
kmp_ref kmp_less(kmp_graph *g, kmp_ref a, kmp_ref b);
/** x where the condition is not 0, otherwise y; the value that is not chosen may be NaN. */
kmp_ref kmp_select(kmp_graph *g, kmp_ref condition, kmp_ref x, kmp_ref y);

/* The last operand is evaluated first. */
#define kmp_add(g, a, b)               KMP_LAST_FIRST(kmp_add, g, a, b)
#define kmp_sub(g, a, b)               KMP_LAST_FIRST(kmp_sub, g, a, b)
#define kmp_mul(g, a, b)               KMP_LAST_FIRST(kmp_mul, g, a, b)
#define kmp_div(g, a, b)               KMP_LAST_FIRST(kmp_div, g, a, b)
#define kmp_less(g, a, b)              KMP_LAST_FIRST(kmp_less, g, a, b)
#define kmp_binary(g, op, a, b)        KMP_LAST_FIRST_3(kmp_binary, g, op, a, b)
#define kmp_select(g, condition, x, y) KMP_LAST_FIRST_3(kmp_select, g, condition, x, y)

/** The notation of an operation. */
typedef enum kmp_op_form { KMP_FORM_LEAF, KMP_FORM_INFIX, KMP_FORM_FUNCTION, KMP_FORM_APPLIED } kmp_op_form;

/** The effect of its operand's sign on a function. */
typedef enum kmp_op_parity { KMP_PARITY_NONE, KMP_PARITY_ODD, KMP_PARITY_EVEN } kmp_op_parity;

/** Operands of an operation, 0 to 3. */
extern const uint8_t kmp_op_arities[KMP_OP_COUNT];
static inline int kmp_op_arity(kmp_op op)
{
    return kmp_op_arities[op];
}
/** Reference number k of a node. */
static inline kmp_ref kmp_operand(const kmp_node *n, int k)
{
    return k == 0 ? n->a : k == 1 ? n->b : n->c;
}

/** A digest of the nodes from the first one on, and of the outputs. */
uint64_t kmp_graph_digest(const kmp_graph *g, uint32_t first, int count, const kmp_ref *outputs);

/** Values of all nodes for given inputs (inputs[kind][index]): value[kmp_graph_count]. */
void kmp_graph_eval(const kmp_graph *g, const double *const inputs[KMP_IN_COUNT], double *value);
/** Likewise of the nodes that are marked (src/symbolic/live.h); the others keep theirs. */
void kmp_graph_eval_live(const kmp_graph *g, const double *const inputs[KMP_IN_COUNT], const uint8_t *live,
                         double *value);

struct kmp_rotations;
/** The rotated pairs of this graph (src/symbolic/trig.h). */
struct kmp_rotations *kmp_graph_rotations(kmp_graph *g);

struct kmp_derivative;
/** The place of a derivative that is not in use (src/symbolic/derivative.h); it remembers what it has derived. */
struct kmp_derivative **kmp_graph_spare(kmp_graph *g);

struct kmp_partials;
/** The place of partial derivatives that are not in use: their arrays by nodes are zero. */
struct kmp_partials **kmp_graph_spare_partials(kmp_graph *g);

/** Number of the block in the graph, which owns it from now on; the number of an equal block if the graph has one. -1:
 * no memory, or no block: the graph has then failed. */
int kmp_graph_add_implicit(kmp_graph *g, struct kmp_implicit *block);
/** NULL when there is no such number. */
const struct kmp_implicit *kmp_graph_implicit(const kmp_graph *g, int block);

/** Keeps labels from now on; earlier ones are lost. */
void kmp_graph_keep_labels(kmp_graph *g);

/** True if labels are kept. */
bool kmp_graph_has_labels(const kmp_graph *g);
