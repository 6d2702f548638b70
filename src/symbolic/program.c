/* SPDX-License-Identifier: BSD-3-Clause */
/* Scheduling: mark the nodes that each stage needs, number them, write them as instructions. */
#include "symbolic/program.h"
#include "base/memory.h"
#include "symbolic/implicit.h"
#include "symbolic/live.h"
#include "symbolic/program_forms.h"
#include "symbolic/shorten.h"
#include "symbolic/table_function.h"
#include <string.h>

enum { PARAMETER_STAGE = 1 }; /* marks are stage + 1 */

/* The nodes of a graph that a program needs, in order. Arrays by node, in which those of others have no meaning. */
typedef struct needed {
    const kmp_graph *graph;
    unsigned still; /* kinds of inputs that are constant during steps */
    uint32_t *id, count;
    uint8_t *mark;    /* stage + 1; 0: not needed */
    uint32_t *number; /* of the value, + 1 */
    kmp_arena room;
} needed;

/* Lists the marked nodes among the first `nodes`. false: no memory. */
static bool list_needed(needed *n, uint32_t nodes)
{
    uint32_t count = 0;
    for (uint32_t id = nodes; (id = kmp_live_before(n->mark, id)) != UINT32_MAX;)
        count++;
    n->id = KMP_ARENA_NEW(&n->room, uint32_t, count);
    n->number = kmp_realloc(NULL, nodes, sizeof *n->number);
    if (!n->id || !n->number)
        return false;
    n->count = count;
    for (uint32_t id = nodes; (id = kmp_live_before(n->mark, id)) != UINT32_MAX;)
        n->id[--count] = id;
    /* Moves nodes that are constant during steps to stage 0, whatever stages need them. */
    for (uint32_t k = 0; k < n->count; k++)
        if ((kmp_graph_node(n->graph, n->id[k])->depends & ~n->still) == 0)
            n->mark[n->id[k]] = PARAMETER_STAGE;
    return true;
}

static uint32_t operand(const uint32_t *number, kmp_ref r)
{
    return (number[kmp_id(r)] - 1) << 1 | (r & 1);
}

static void write_code(const needed *of, kmp_program *p)
{
    const uint32_t *number = of->number;
    int leaves = p->constant_count + p->input_count;
    for (uint32_t k = 0; k < of->count; k++) {
        const kmp_node *n = kmp_graph_node(of->graph, of->id[k]);
        int arity = kmp_op_arity((kmp_op)n->op);
        if (arity == 0)
            continue;
        kmp_instruction *in = &p->instruction[(int)number[of->id[k]] - 1 - leaves];
        *in = (kmp_instruction){.op = n->op, .a = operand(number, n->a)};
        if (kmp_op_form_of((kmp_op)n->op) == KMP_FORM_APPLIED) {
            in->b = n->b;
            in->c = n->c;
        }
        if (arity > 1)
            in->b = operand(number, n->b);
        if (arity > 2)
            in->c = operand(number, n->c);
    }
}

kmp_program *kmp_program_with_room(size_t stages, size_t code, size_t outputs, size_t constants, size_t inputs)
{
    kmp_program *p = KMP_NEW(kmp_program, 1);
    if (!p)
        return NULL;
    KMP_ARENA_MAKE(&p->arena, KMP_ROOM(int, stages + 1, &p->code, &p->outputs), KMP_ROOM(uint32_t, outputs, &p->output),
                   KMP_ROOM(kmp_instruction, code, &p->instruction), KMP_ROOM(double, constants, &p->constant),
                   KMP_ROOM(kmp_program_input, inputs, &p->input), KMP_ROOM(kmp_program_shared, 1, &p->shared));
    if (!p->arena.failed)
        return p;
    kmp_program_free(p);
    return NULL;
}

/* Copies the blocks in use, numbered in their order. */
static bool take_blocks(kmp_graph *g, kmp_program *p)
{
    int blocks = 0;
    while (kmp_graph_implicit(g, blocks))
        blocks++;
    int *number = KMP_GRAPH_NEW(g, int, blocks); /* + 1, 0: not met */
    for (int i = 0; number && i < p->code[p->stages]; i++) {
        kmp_instruction *in = &p->instruction[i];
        if (in->op != KMP_OP_IMPLICIT)
            continue;
        if (number[in->b] == 0)
            number[in->b] = 1 + kmp_program_add_block(p, kmp_implicit_block(kmp_graph_implicit(g, (int)in->b)));
        if (number[in->b] == 0)
            return false;
        in->b = (uint32_t)(number[in->b] - 1);
    }
    return number;
}

/* Copies the tables in use, numbered in their order. */
static bool take_tables(const kmp_graph *g, kmp_program *p)
{
    for (int i = 0; i < p->code[p->stages]; i++) {
        kmp_instruction *in = &p->instruction[i];
        if (in->op != KMP_OP_TABLE)
            continue;
        int number = kmp_program_add_table(p, kmp_graph_table(g, (int)in->b));
        if (number < 0)
            return false;
        in->b = (uint32_t)number;
    }
    return true;
}

static bool take_labels(const needed *n, kmp_program *p)
{
    int leaves = p->constant_count + p->input_count;
    if (!kmp_graph_has_labels(n->graph))
        return true;
    p->label = KMP_ARENA_NEW(&p->arena, kmp_label, p->code[p->stages]);
    for (uint32_t k = 0; p->label && k < n->count; k++) {
        const kmp_label *label = kmp_graph_label_of(n->graph, n->id[k]);
        if (label)
            p->label[(int)n->number[n->id[k]] - 1 - leaves] = *label;
    }
    return p->label;
}

/* The program of `groups` stages after that of parameters. NULL: no memory. */
static kmp_program *schedule(kmp_graph *g, needed *n, int groups, const int *count, const kmp_ref *outputs)
{
    int constants = 0, inputs = 0, total = 0, stages = groups + 1;
    int *code = KMP_ARENA_NEW(&n->room, int, stages + 1), *next = KMP_ARENA_NEW(&n->room, int, stages);
    if (!code || !next)
        return NULL;
    /* Counts constants, inputs, and in code[s + 1] the instructions of stage s. */
    for (uint32_t k = 0; k < n->count; k++) {
        const kmp_node *node = kmp_graph_node(n->graph, n->id[k]);
        if (kmp_op_arity((kmp_op)node->op) > 0)
            code[n->mark[n->id[k]]]++;
        else
            ++*(node->op == KMP_OP_CONST ? &constants : &inputs);
    }
    for (int s = 0; s < stages; s++)
        code[s + 1] += code[s];
    for (int k = 0; k < groups; k++)
        total += count[k];
    kmp_program *p =
        kmp_program_with_room((size_t)stages, (size_t)code[stages], (size_t)total, (size_t)constants, (size_t)inputs);
    if (!p)
        return NULL;
    p->stages = stages;
    p->graph_nodes = kmp_graph_count(g);
    memcpy(p->code, code, ((size_t)stages + 1) * sizeof *code);
    /* Numbers values: constants, inputs, then instructions stage by stage in the order of the graph. `code`: of stages.
     */
    memcpy(next, code, (size_t)p->stages * sizeof *next);
    for (uint32_t k = 0; k < n->count; k++) {
        uint32_t id = n->id[k];
        const kmp_node *node = kmp_graph_node(n->graph, id);
        if (kmp_op_arity((kmp_op)node->op) > 0) {
            n->number[id] = (uint32_t)(constants + inputs + ++next[n->mark[id] - 1]);
        } else if (node->op == KMP_OP_CONST) {
            p->constant[p->constant_count++] = kmp_graph_value(n->graph, id);
            n->number[id] = (uint32_t)p->constant_count;
        } else {
            p->input[p->input_count++] = (kmp_program_input){(kmp_input_kind)node->a, node->b};
            n->number[id] = (uint32_t)(constants + p->input_count);
        }
    }
    write_code(n, p);
    for (int k = 0; k < groups; k++)
        p->outputs[k + 2] = p->outputs[k + 1] + count[k];
    for (int k = 0; k < total; k++)
        p->output[k] = operand(n->number, outputs[k]);
    if (take_tables(g, p) && take_blocks(g, p) && take_labels(n, p))
        return p;
    kmp_program_free(p);
    return NULL;
}

/* Marks the nodes that each group of outputs needs, in an array of the arena. NULL: no memory. */
static uint8_t *mark_groups(const kmp_graph *g, kmp_arena *room, int groups, const int *count, const kmp_ref *outputs)
{
    uint8_t *mark = KMP_ARENA_NEW(room, uint8_t, kmp_graph_count(g));
    for (int k = 0; mark && k < groups; outputs += count[k], k++)
        kmp_live_begin(count[k], outputs, mark, (uint8_t)(PARAMETER_STAGE + 1 + k));
    if (mark)
        kmp_live_spread(g, mark);
    return mark;
}

static kmp_program *make(kmp_graph *g, int groups, const int *count, const kmp_ref *const *outputs, unsigned still)
{
    int total = 0;
    needed n = {.graph = g, .still = still};
    kmp_program *p = NULL;
    for (int k = 0; k < groups; k++)
        total += count[k];
    kmp_ref *all = KMP_ARENA_NEW(&n.room, kmp_ref, total);
    for (int k = 0, i = 0; all && k < groups; i += count[k], k++)
        if (count[k])
            memcpy(all + i, outputs[k], (size_t)count[k] * sizeof *all);
    uint32_t nodes = kmp_graph_count(g);
    bool changed = false;
    n.mark = all ? mark_groups(g, &n.room, groups, count, all) : NULL;
    bool ok = n.mark && kmp_trig_sums_of(g, nodes, n.mark, total, all, &changed);
    if (ok && changed) {
        nodes = kmp_graph_count(g);
        n.mark = mark_groups(g, &n.room, groups, count, all);
        ok = n.mark;
    }
    if (ok && list_needed(&n, nodes))
        p = schedule(g, &n, groups, count, all);
    kmp_free(n.number);
    kmp_arena_free(&n.room);
    return p;
}

kmp_program *kmp_program_new(kmp_graph *g, int groups, const int *count, const kmp_ref *const *outputs)
{
    return make(g, groups, count, outputs, 1u << KMP_IN_PARAMETER | 1u << KMP_IN_CHART);
}

kmp_program *kmp_program_of_parameters(kmp_graph *g, int count, const kmp_ref *outputs)
{
    return make(g, 1, &count, &outputs, 1u << KMP_IN_PARAMETER);
}

void kmp_program_free(kmp_program *p)
{
    if (!p || !kmp_program_leave(p))
        return;
    for (int k = 0; k < p->table_count; k++)
        kmp_table_free(p->table[k]);
    kmp_free(p->table);
    for (int k = 0; k < p->block_count; k++)
        kmp_program_free(p->block[k].program);
    kmp_free(p->block);
    kmp_arena_free(&p->arena);
    kmp_free(p);
}

int kmp_program_add_table(kmp_program *p, kmp_table *table)
{
    for (int k = 0; k < p->table_count; k++)
        if (kmp_table_equal(p->table[k], table))
            return k;
    kmp_table **tables = kmp_realloc(p->table, (size_t)p->table_count + 1, sizeof(kmp_table *));
    if (!tables)
        return -1;
    p->table = tables;
    tables[p->table_count] = kmp_table_share(table);
    return p->table_count++;
}

/* `count` objects into room for them. */
static void copy(void *to, const void *from, int count, size_t size)
{
    if (count)
        memcpy(to, from, (size_t)count * size);
}

kmp_program *kmp_program_copy(const kmp_program *p)
{
    int stages = p->stages, code = p->code[stages], outputs = p->outputs[stages];
    kmp_program *c = kmp_program_with_room((size_t)stages, (size_t)code, (size_t)outputs, (size_t)p->constant_count,
                                           (size_t)p->input_count);
    if (!c)
        return NULL;
    c->stages = stages;
    c->graph_nodes = p->graph_nodes;
    c->constant_count = p->constant_count;
    c->input_count = p->input_count;
    copy(c->code, p->code, stages + 1, sizeof *c->code);
    copy(c->outputs, p->outputs, stages + 1, sizeof *c->outputs);
    copy(c->output, p->output, outputs, sizeof *c->output);
    copy(c->instruction, p->instruction, code, sizeof *c->instruction);
    copy(c->constant, p->constant, p->constant_count, sizeof *c->constant);
    copy(c->input, p->input, p->input_count, sizeof *c->input);
    c->label = p->label ? KMP_ARENA_NEW(&c->arena, kmp_label, code) : NULL;
    if (c->label)
        copy(c->label, p->label, code, sizeof *c->label);
    c->contraction = p->contraction ? KMP_ARENA_NEW(&c->arena, uint8_t, code) : NULL;
    if (c->contraction)
        copy(c->contraction, p->contraction, code, sizeof *c->contraction);
    bool ok = !c->arena.failed;
    for (int k = 0; ok && k < p->table_count; k++)
        ok = kmp_program_add_table(c, p->table[k]) == k;
    for (int k = 0; ok && k < p->block_count; k++)
        ok = kmp_program_add_block(c, &p->block[k]) == k;
    if (ok)
        return c;
    kmp_program_free(c);
    return NULL;
}

static bool same(const void *a, const void *b, int count, size_t size)
{
    return count == 0 || memcmp(a, b, (size_t)count * size) == 0;
}

static bool same_code(const kmp_program *a, const kmp_program *b)
{
    if (!a->contraction != !b->contraction ||
        (a->contraction && !same(a->contraction, b->contraction, a->code[a->stages], sizeof *a->contraction)))
        return false;
    for (int i = 0; i < a->code[a->stages]; i++) {
        const kmp_instruction *x = &a->instruction[i], *y = &b->instruction[i];
        if (x->op != y->op || x->a != y->a || x->b != y->b || x->c != y->c)
            return false;
    }
    return true;
}

static bool same_leaves(const kmp_program *a, const kmp_program *b)
{
    if (a->constant_count != b->constant_count || a->input_count != b->input_count || a->table_count != b->table_count)
        return false;
    for (int k = 0; k < a->input_count; k++)
        if (a->input[k].kind != b->input[k].kind || a->input[k].index != b->input[k].index)
            return false;
    for (int k = 0; k < a->table_count; k++)
        if (!kmp_table_equal(a->table[k], b->table[k]))
            return false;
    return same(a->constant, b->constant, a->constant_count, sizeof *a->constant);
}

bool kmp_program_equal(const kmp_program *a, const kmp_program *b)
{
    int stages = a->stages;
    return stages == b->stages && a->block_count == 0 && b->block_count == 0 &&
           same(a->code, b->code, stages + 1, sizeof *a->code) &&
           same(a->outputs, b->outputs, stages + 1, sizeof *a->outputs) &&
           same(a->output, b->output, a->outputs[stages], sizeof *a->output) && same_leaves(a, b) && same_code(a, b);
}

int kmp_program_add_block(kmp_program *p, const kmp_program_block *block)
{
    kmp_program_block *blocks = kmp_realloc(p->block, (size_t)p->block_count + 1, sizeof *blocks);
    if (!blocks)
        return -1;
    p->block = blocks;
    kmp_program_block *added = &blocks[p->block_count];
    *added = *block;
    added->candidate = KMP_ARENA_NEW(&p->arena, double, block->candidates);
    if (!added->candidate)
        return -1;
    copy(added->candidate, block->candidate, block->candidates, sizeof *block->candidate);
    added->program = kmp_program_copy(block->program);
    return added->program ? p->block_count++ : -1;
}

double kmp_program_value(const kmp_program *p, int i, double x, double y, double z)
{
    const kmp_instruction *in = &p->instruction[i];
    if (in->op == KMP_OP_TABLE)
        return kmp_table_value(p->table[in->b], (int)in->c, x);
    return kmp_op_value((kmp_op)in->op, x, y, z);
}

/* Signs of operands that an instruction applies: a difference has none. */
static int count_signs(const kmp_instruction *in)
{
    int signs = 0, arity = kmp_op_arity((kmp_op)in->op);
    if (in->op == KMP_OP_ADD || in->op == KMP_OP_MUL) /* most instructions */
        return (int)(in->a & 1) + (in->op == KMP_OP_MUL && in->b & 1);
    for (int k = 0; k < arity; k++)
        signs += (int)(kmp_instruction_operand(in, k) & 1);
    return in->op == KMP_OP_LIST ? 0 : signs;
}

void kmp_counts_take(kmp_counts *c, const kmp_instruction *in, long times)
{
    const long signs = times * count_signs(in);
    c->neg += signs;
    c->robotran += signs;
    switch ((kmp_op)in->op) {
    case KMP_OP_LIST: /* computes nothing */
        return;
    case KMP_OP_ADD:
        c->add += times;
        c->paper += times;
        break;
    case KMP_OP_MUL:
        c->mul += times;
        c->paper += times;
        break;
    case KMP_OP_DIV:
        c->div += times;
        c->paper += times;
        break;
    case KMP_OP_SIN:
    case KMP_OP_COS:
        c->trig += times;
        break;
    default:
        c->other += times;
    }
    c->robotran += times;
}

void kmp_counts_add(kmp_counts *c, const kmp_counts *more, long times)
{
    c->add += times * more->add;
    c->mul += times * more->mul;
    c->div += times * more->div;
    c->neg += times * more->neg;
    c->trig += times * more->trig;
    c->other += times * more->other;
    c->paper += times * more->paper;
    c->robotran += times * more->robotran;
}

kmp_counts kmp_program_count(const kmp_program *p, int first_stage, int last_stage)
{
    kmp_counts c = {0};
    for (int i = p->code[first_stage]; i < p->code[last_stage + 1]; i++)
        kmp_counts_take(&c, &p->instruction[i], 1);
    return c;
}
