/* SPDX-License-Identifier: BSD-3-Clause */
/* Hash-consing and the simplifications at birth: zeros, ones, numbers, signs, commutative order, a - a, a + b - a,
 * equal terms, cos^2 + sin^2. Fisette and Samin 1996, section 3.1, at the moment a node would be made. */
#include "symbolic/graph.h"
#include "base/memory.h"
#include "symbolic/implicit.h"
#include "symbolic/label.h"
#include "symbolic/rotation.h"
#include "symbolic/table.h"
#include <math.h>
#include <string.h>

struct kmp_graph {
    kmp_node *nodes;
    uint32_t count, capacity;
    double *values; /* of CONST nodes */
    uint32_t value_count, value_capacity;
    uint32_t *table; /* id + 1, 0 = free; open addressing */
    uint32_t table_size;
    kmp_rotations *rotations;
    kmp_labels *labels; /* NULL: none are kept */
    kmp_table **tables;
    int table_count;
    kmp_implicit **implicits;
    int implicit_count;
    unsigned rules;
    bool failed;
};

/* -- nodes ----------------------------------------------------------------------------------------- */

static uint32_t mix(uint32_t op, uint32_t a, uint32_t b, uint32_t c)
{
    uint64_t k = ((uint64_t)a << 32 | b) * 0x9e3779b97f4a7c15u + ((uint64_t)c << 8 | op);
    k ^= k >> 29;
    k *= 0xbf58476d1ce4e5b9u;
    return (uint32_t)(k >> 32);
}

static uint32_t hash_node(const kmp_graph *g, const kmp_node *n)
{
    uint64_t bits;
    if (n->op != KMP_OP_CONST)
        return mix(n->op, n->a, n->b, n->c);
    memcpy(&bits, &g->values[n->a], sizeof bits);
    return mix(n->op, (uint32_t)bits, (uint32_t)(bits >> 32), 0);
}

static bool same_node(const kmp_graph *g, const kmp_node *n, const kmp_node *m)
{
    if (n->op != m->op)
        return false;
    if (n->op == KMP_OP_CONST)
        return memcmp(&g->values[n->a], &g->values[m->a], sizeof(double)) == 0;
    return n->a == m->a && n->b == m->b && n->c == m->c;
}

static bool grow_table(kmp_graph *g)
{
    uint32_t size = g->table_size ? 2 * g->table_size : 4096;
    uint32_t *table = KMP_NEW(uint32_t, size);
    if (!table)
        return false;
    for (uint32_t id = 0; id < g->count; id++) {
        uint32_t k = hash_node(g, &g->nodes[id]) & (size - 1);
        while (table[k])
            k = (k + 1) & (size - 1);
        table[k] = id + 1;
    }
    kmp_free(g->table);
    g->table = table;
    g->table_size = size;
    return true;
}

static bool reserve(kmp_graph *g)
{
    if (g->failed || g->count >= UINT32_MAX / 4)
        return false;
    if (2 * (g->count + 1) > g->table_size && !grow_table(g))
        return false;
    if (g->count < g->capacity)
        return true;
    uint32_t capacity = g->capacity ? 2 * g->capacity : 2048;
    kmp_node *nodes = kmp_realloc(g->nodes, capacity, sizeof *nodes);
    if (!nodes)
        return false;
    g->nodes = nodes;
    g->capacity = capacity;
    return true;
}

static uint16_t depends_of(const kmp_graph *g, const kmp_node *n)
{
    if (n->op == KMP_OP_CONST)
        return 0;
    if (n->op == KMP_OP_INPUT)
        return (uint16_t)(1u << n->a);
    uint16_t d = 0;
    for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
        d |= g->nodes[kmp_id(kmp_operand(n, k))].depends;
    return d;
}

/* The node itself, or its elder twin. */
kmp_ref kmp_graph_intern(kmp_graph *g, kmp_node n)
{
    if (!reserve(g)) {
        g->failed = true;
        return KMP_ZERO;
    }
    uint32_t k = hash_node(g, &n) & (g->table_size - 1);
    bool shared = g->rules & KMP_RULE_SHARE || n.op == KMP_OP_CONST || n.op == KMP_OP_INPUT;
    for (; g->table[k]; k = (k + 1) & (g->table_size - 1))
        if (shared && same_node(g, &g->nodes[g->table[k] - 1], &n))
            return (g->table[k] - 1) << 1;
    n.depends = depends_of(g, &n);
    g->nodes[g->count] = n;
    g->table[k] = ++g->count;
    return (g->count - 1) << 1;
}

kmp_graph *kmp_graph_new(void)
{
    kmp_graph *g = KMP_NEW(kmp_graph, 1);
    if (!g)
        return NULL;
    g->rules = KMP_RULE_ALL;
    g->rotations = kmp_rotations_new();
    (void)kmp_const(g, 0.0);
    (void)kmp_const(g, 1.0);
    if (g->failed || !g->rotations || g->count != 2) {
        kmp_graph_free(g);
        return NULL;
    }
    return g;
}

void kmp_graph_set_rules(kmp_graph *g, unsigned rules)
{
    g->rules = rules;
}

bool kmp_graph_has_rule(const kmp_graph *g, unsigned rule)
{
    return g->rules & rule;
}

void kmp_graph_free(kmp_graph *g)
{
    if (!g)
        return;
    kmp_rotations_free(g->rotations);
    kmp_labels_free(g->labels);
    for (int k = 0; k < g->table_count; k++)
        kmp_table_free(g->tables[k]);
    kmp_free(g->tables);
    for (int k = 0; k < g->implicit_count; k++)
        kmp_implicit_free(g->implicits[k]);
    kmp_free(g->implicits);
    kmp_free(g->nodes);
    kmp_free(g->values);
    kmp_free(g->table);
    kmp_free(g);
}

void kmp_graph_fail(kmp_graph *g)
{
    g->failed = true;
}

bool kmp_graph_failed(const kmp_graph *g)
{
    return g->failed || kmp_rotations_failed(g->rotations) || kmp_labels_failed(g->labels);
}

uint32_t kmp_graph_count(const kmp_graph *g)
{
    return g->count;
}

const kmp_node *kmp_graph_node(const kmp_graph *g, uint32_t id)
{
    return &g->nodes[id];
}

double kmp_graph_value(const kmp_graph *g, uint32_t id)
{
    return g->values[g->nodes[id].a];
}

kmp_rotations *kmp_graph_rotations(kmp_graph *g)
{
    return g->rotations;
}

kmp_labels **kmp_graph_labels(kmp_graph *g)
{
    return &g->labels;
}

bool kmp_is_const(const kmp_graph *g, kmp_ref r, double *value)
{
    if (g->nodes[kmp_id(r)].op != KMP_OP_CONST)
        return false;
    double v = g->values[g->nodes[kmp_id(r)].a];
    *value = kmp_is_negative(r) ? -v : v;
    return true;
}

/* -- construction ---------------------------------------------------------------------------------- */

kmp_ref kmp_const(kmp_graph *g, double value)
{
    if (value == 0 && g->count > 0)
        return KMP_ZERO;
    bool negative = value < 0;
    if (g->value_count == g->value_capacity) {
        uint32_t capacity = g->value_capacity ? 2 * g->value_capacity : 64;
        double *values = kmp_realloc(g->values, capacity, sizeof *values);
        if (!values) {
            g->failed = true;
            return KMP_ZERO;
        }
        g->values = values;
        g->value_capacity = capacity;
    }
    g->values[g->value_count] = fabs(value);
    uint32_t before = g->count;
    kmp_ref r = kmp_graph_intern(g, (kmp_node){.op = KMP_OP_CONST, .a = g->value_count});
    if (g->count > before)
        g->value_count++;
    return negative ? kmp_neg(r) : r;
}

kmp_ref kmp_input(kmp_graph *g, kmp_input_kind kind, uint32_t index)
{
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_INPUT, .a = (uint32_t)kind, .b = index});
}

/* r = coefficient * base, the coefficient a number. */
static kmp_ref split_coefficient(const kmp_graph *g, kmp_ref r, double *coefficient)
{
    const kmp_node *n = &g->nodes[kmp_id(r)];
    double sign = kmp_is_negative(r) ? -1 : 1;
    if (n->op == KMP_OP_MUL && kmp_is_const(g, n->a, coefficient)) {
        *coefficient *= sign;
        return n->b;
    }
    *coefficient = sign;
    return r & ~(kmp_ref)1;
}

/* True for f(x)^2 with f = op; x in *argument. */
static bool is_square_of(const kmp_graph *g, kmp_ref r, kmp_op op, kmp_ref *argument)
{
    const kmp_node *n = &g->nodes[kmp_id(r)];
    if (n->op != KMP_OP_MUL || n->a != n->b || g->nodes[kmp_id(n->a)].op != op)
        return false;
    *argument = g->nodes[kmp_id(n->a)].a;
    return true;
}

static bool is_pythagoras(const kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref x, y;
    return ((is_square_of(g, a, KMP_OP_SIN, &x) && is_square_of(g, b, KMP_OP_COS, &y)) ||
            (is_square_of(g, a, KMP_OP_COS, &x) && is_square_of(g, b, KMP_OP_SIN, &y))) &&
           x == y;
}

/* (p + q) + b where b cancels p or q, or where p and b are numbers. */
static bool add_to_sum(kmp_graph *g, kmp_ref sum, kmp_ref b, kmp_ref *result)
{
    kmp_node n = g->nodes[kmp_id(sum)];
    double x, y;
    if (n.op != KMP_OP_ADD)
        return false;
    kmp_ref p = kmp_is_negative(sum) ? kmp_neg(n.a) : n.a;
    kmp_ref q = kmp_is_negative(sum) ? kmp_neg(n.b) : n.b;
    if (p == kmp_neg(b))
        *result = q;
    else if (q == kmp_neg(b))
        *result = p;
    else if (kmp_is_const(g, p, &x) && kmp_is_const(g, b, &y))
        *result = kmp_add(g, kmp_const(g, x + y), q);
    else
        return false;
    return true;
}

static bool is_number(const kmp_graph *g, kmp_ref r)
{
    return g->nodes[kmp_id(r)].op == KMP_OP_CONST;
}

/* Numbers first, then by id. */
static void order(const kmp_graph *g, kmp_ref *a, kmp_ref *b)
{
    bool swap = is_number(g, *a) != is_number(g, *b) ? is_number(g, *b) : kmp_id(*b) < kmp_id(*a);
    if (swap) {
        kmp_ref c = *a;
        *a = *b;
        *b = c;
    }
}

/* Zeros and numbers. */
static bool add_numbers(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO)
        *result = b;
    else if (b == KMP_ZERO)
        *result = a;
    else if (kmp_is_const(g, a, &x) && kmp_is_const(g, b, &y))
        *result = kmp_const(g, x + y);
    else
        return false;
    return true;
}

/* Terms that cancel or have the same base; squares of a sine and a cosine. */
static bool merge_terms(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    kmp_ref p = split_coefficient(g, a, &x), q = split_coefficient(g, b, &y);
    bool cancel = g->rules & KMP_RULE_CANCEL;
    if (cancel && p == q)
        *result = kmp_mul(g, kmp_const(g, x + y), p);
    else if (g->rules & KMP_RULE_TRIG && x == y && is_pythagoras(g, p, q))
        *result = kmp_const(g, x);
    else
        return cancel && (add_to_sum(g, a, b, result) || add_to_sum(g, b, a, result));
    return true;
}

kmp_ref kmp_add(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref r;
    if (g->rules & KMP_RULE_ZERO && add_numbers(g, a, b, &r))
        return r;
    if (g->rules & KMP_RULE_CANCEL && a == kmp_neg(b))
        return KMP_ZERO;
    if (merge_terms(g, a, b, &r))
        return r;
    order(g, &a, &b);
    kmp_ref sign = a & 1;
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_ADD, .a = a ^ sign, .b = b ^ sign}) ^ sign;
}

kmp_ref kmp_sub(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    return kmp_add(g, a, kmp_neg(b));
}

/* (p w) w = p (w w): squares of rates are shared by many terms. */
static bool collect_square(kmp_graph *g, kmp_ref product, kmp_ref w, kmp_ref *result)
{
    kmp_node n = g->nodes[kmp_id(product)];
    if (n.op != KMP_OP_MUL || is_number(g, w))
        return false;
    if (n.b == w && n.a != w)
        *result = kmp_mul(g, n.a, kmp_mul(g, w, w));
    else if (n.a == w && n.b != w)
        *result = kmp_mul(g, n.b, kmp_mul(g, w, w));
    else
        return false;
    return true;
}

/* Zeros, ones and numbers; a and b without sign. */
static bool multiply_numbers(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO || b == KMP_ZERO) {
        *result = KMP_ZERO;
        return true;
    }
    if (a == KMP_ONE || b == KMP_ONE) {
        *result = (a == KMP_ONE ? b : a) ^ sign;
        return true;
    }
    if (!kmp_is_const(g, a, &x))
        return false;
    if (kmp_is_const(g, b, &y)) {
        *result = kmp_const(g, sign ? -x * y : x * y);
        return true;
    }
    kmp_ref base = split_coefficient(g, b, &y);
    if (base == b)
        return false;
    *result = kmp_mul(g, kmp_const(g, sign ? -x * y : x * y), base);
    return true;
}

kmp_ref kmp_mul(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    kmp_ref r, sign = (a ^ b) & 1;
    a &= ~(kmp_ref)1;
    b &= ~(kmp_ref)1;
    order(g, &a, &b);
    if (g->rules & KMP_RULE_ZERO && multiply_numbers(g, a, b, sign, &r))
        return r;
    if (g->rules & KMP_RULE_SHARE && (collect_square(g, a, b, &r) || collect_square(g, b, a, &r))) {
        if (g->failed)
            return KMP_ZERO;
        return sign ? kmp_neg(r) : r;
    }
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_MUL, .a = a, .b = b}) ^ sign;
}

kmp_ref kmp_div(kmp_graph *g, kmp_ref a, kmp_ref b)
{
    double x, y;
    kmp_ref sign = (a ^ b) & 1;
    a &= ~(kmp_ref)1;
    b &= ~(kmp_ref)1;
    if (g->rules & KMP_RULE_ZERO && kmp_is_const(g, b, &y)) {
        if (kmp_is_const(g, a, &x))
            return kmp_const(g, sign ? -x / y : x / y);
        return kmp_mul(g, a, kmp_const(g, sign ? -1 / y : 1 / y));
    }
    if (g->rules & KMP_RULE_ZERO && a == KMP_ZERO)
        return KMP_ZERO;
    if (g->rules & KMP_RULE_CANCEL && a == b)
        return KMP_ONE ^ sign;
    return kmp_graph_intern(g, (kmp_node){.op = KMP_OP_DIV, .a = a, .b = b}) ^ sign;
}

/* -- tables ---------------------------------------------------------------------------------------- */

int kmp_graph_add_table(kmp_graph *g, const kmp_table *table)
{
    for (int k = 0; k < g->table_count; k++)
        if (kmp_table_equal(g->tables[k], table))
            return k;
    kmp_table **tables = kmp_realloc(g->tables, (size_t)g->table_count + 1, sizeof(kmp_table *));
    if (tables)
        g->tables = tables;
    kmp_table *copy = tables ? kmp_table_new(table->method, table->count, table->x, table->y) : NULL;
    if (!copy) {
        g->failed = true;
        return -1;
    }
    g->tables[g->table_count] = copy;
    return g->table_count++;
}

const kmp_table *kmp_graph_table(const kmp_graph *g, int table)
{
    return table >= 0 && table < g->table_count ? g->tables[table] : NULL;
}

int kmp_graph_add_implicit(kmp_graph *g, kmp_implicit *block)
{
    kmp_implicit **blocks = kmp_realloc(g->implicits, (size_t)g->implicit_count + 1, sizeof(kmp_implicit *));
    if (!blocks) {
        kmp_implicit_free(block);
        g->failed = true;
        return -1;
    }
    g->implicits = blocks;
    blocks[g->implicit_count] = block;
    return g->implicit_count++;
}

const kmp_implicit *kmp_graph_implicit(const kmp_graph *g, int block)
{
    return block >= 0 && block < g->implicit_count ? g->implicits[block] : NULL;
}

/* -- values ---------------------------------------------------------------------------------------- */

static double operand(const double *value, kmp_ref r)
{
    return kmp_is_negative(r) ? -value[kmp_id(r)] : value[kmp_id(r)];
}

static double implicit_value(const kmp_graph *g, const kmp_node *n, const double *value)
{
    const kmp_block *block = kmp_implicit_block(g->implicits[n->b]);
    kmp_solving *solving = kmp_solving_new(block);
    double y = NAN;
    kmp_ref list = n->a;
    for (int l = 0; solving && l < block->arguments; l++, list = g->nodes[kmp_id(list)].b)
        kmp_solving_arguments(solving)[l] = operand(value, g->nodes[kmp_id(list)].a);
    if (solving)
        y = kmp_solving_value(solving, (int)n->c);
    kmp_solving_free(solving);
    return y;
}

static double value_of(const kmp_graph *g, const kmp_node *n, const double *value)
{
    double x[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
        x[k] = operand(value, kmp_operand(n, k));
    if (n->op == KMP_OP_IMPLICIT)
        return implicit_value(g, n, value);
    if (n->op == KMP_OP_TABLE)
        return kmp_table_value(g->tables[n->b], (int)n->c, x[0]);
    return kmp_op_value((kmp_op)n->op, x[0], x[1], x[2]);
}

void kmp_graph_eval(const kmp_graph *g, const double *const inputs[KMP_IN_COUNT], double *value)
{
    for (uint32_t id = 0; id < g->count; id++) {
        const kmp_node *n = &g->nodes[id];
        if (n->op == KMP_OP_CONST)
            value[id] = g->values[n->a];
        else if (n->op == KMP_OP_INPUT)
            value[id] = inputs[n->a] ? inputs[n->a][n->b] : NAN;
        else
            value[id] = value_of(g, n, value);
    }
}
