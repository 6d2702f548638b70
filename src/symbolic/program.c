/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs: straight-line code in stages, made from a graph, and what is done with it as a whole.
 *
 * Scheduling marks the nodes that each stage needs, backwards from its outputs. A node belongs to the first stage that
 * needs it; nodes that depend only on parameters and charts go to stage 0, which runs once. Nodes keep the order in
 * which the graph made them, which puts operands before their uses, and are numbered: constants, inputs, then
 * instructions. The other sections copy, compare and count programs, select stages of them, bring them back into a
 * graph, and print their text (docs/program_format.md). */
#include "symbolic/program.h"
#include "base/memory.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/live.h"
#include "symbolic/ops.h"
#include "symbolic/program_forms.h"
#include "symbolic/table_function.h"
#include "symbolic/trig.h"
#include <math.h>
#include <string.h>

/* -- scheduling ---------------------------------------------------------------------------------------- */

enum { PARAMETER_STAGE = 1 }; /* marks are stage + 1 */

/* The nodes of a graph that a program needs, in order. Arrays by node, in which entries of others have no meaning. */
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
static bool copy_blocks(kmp_graph *g, kmp_program *p)
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
static bool copy_tables(const kmp_graph *g, kmp_program *p)
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

static bool copy_labels(const needed *n, kmp_program *p)
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

/* The program of `groups` stages after the stage of parameters. NULL: no memory. */
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
    if (copy_tables(g, p) && copy_blocks(g, p) && copy_labels(n, p))
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

static kmp_program *schedule_groups(kmp_graph *g, int groups, const int *count, const kmp_ref *const *outputs,
                                    unsigned still)
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
    return schedule_groups(g, groups, count, outputs, 1u << KMP_IN_PARAMETER | 1u << KMP_IN_CHART);
}

kmp_program *kmp_program_of_parameters(kmp_graph *g, int count, const kmp_ref *outputs)
{
    return schedule_groups(g, 1, &count, &outputs, 1u << KMP_IN_PARAMETER);
}

/* -- copies and comparison --------------------------------------------------------------------------------- */

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

int kmp_program_time_order(const kmp_program *p, int function)
{
    int order = -1;
    for (int k = 0; k < p->input_count; k++)
        for (int d = 0; d < KMP_TIME_NUMBERS; d++)
            if (p->input[k].kind == KMP_IN_TIME && p->input[k].index == kmp_time_index(function, d) && d > order)
                order = d;
    return order;
}

/* The inputs in which an instruction is nonlinear, by the inputs that its operands a, b and c depend on. */
static uint64_t bends(kmp_op op, uint64_t a, uint64_t b, uint64_t c)
{
    switch (op) {
    case KMP_OP_ADD:
    case KMP_OP_LIST:
        return 0;
    case KMP_OP_MUL:
        return a & b;
    case KMP_OP_DIV:
        return b;
    default:
        return a | b | c;
    }
}

void kmp_program_dependences(const kmp_program *p, kmp_input_kind kind, uint32_t first, uint64_t *depends,
                             uint64_t *bent)
{
    const uint32_t inputs = (uint32_t)p->constant_count, code = inputs + (uint32_t)p->input_count;
    memset(depends, 0, code * sizeof *depends);
    memset(bent, 0, code * sizeof *bent);
    for (uint32_t k = inputs; k < code; k++) {
        const kmp_program_input *in = &p->input[k - inputs];
        if (in->kind == kind && in->index >= first && in->index - first < 64)
            depends[k] = (uint64_t)1 << (in->index - first);
    }
    for (int k = 0; k < p->code[p->stages]; k++) {
        const uint32_t here = code + (uint32_t)k;
        uint64_t of[3] = {0}, more = 0;
        for (int o = 0; o < 3; o++) { /* a parameter in place of an operand may add inputs, and hides none */
            const uint32_t operand = kmp_instruction_operand(&p->instruction[k], o) >> 1;
            of[o] = operand < here ? depends[operand] : 0;
            more |= operand < here ? bent[operand] : 0;
        }
        depends[here] = of[0] | of[1] | of[2];
        bent[here] = more | bends((kmp_op)p->instruction[k].op, of[0], of[1], of[2]);
    }
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

/* -- counts of operations ---------------------------------------------------------------------------------- */

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

/* -- selection of stages --------------------------------------------------------------------------------- */

/* The first stages of a program are taken over. Instructions of `given` (NULL: none) become inputs. */
typedef struct selection {
    const kmp_program *p;
    int stages;
    const bool *given; /* by instruction */
    int first;         /* of the inputs q that they become */
    int *list, count;  /* the nodes that the others need */
} selection;

static int leaves(const kmp_program *p)
{
    return p->constant_count + p->input_count;
}

static uint32_t renumbered(const uint32_t *number, uint32_t operand)
{
    return (number[operand >> 1] - 1) << 1 | (operand & 1);
}

/* The table or block that an instruction applies; false: no memory. */
static bool select_applied(const kmp_program *p, kmp_instruction *in, int *block, kmp_program *to)
{
    int number = 0;
    if (in->op == KMP_OP_TABLE) {
        number = kmp_program_add_table(to, p->table[in->b]);
    } else if (in->op == KMP_OP_IMPLICIT) {
        if (block[in->b] == 0)
            block[in->b] = 1 + kmp_program_add_block(to, &p->block[in->b]);
        number = block[in->b] - 1;
    } else {
        return true;
    }
    in->b = (uint32_t)number;
    return number >= 0;
}

static bool select_code(const selection *s, uint32_t *number, uint32_t next, int *block, kmp_program *to)
{
    const kmp_program *p = s->p;
    int count = 0;
    for (int stage = 0; stage < to->stages; stage++) {
        to->code[stage] = count;
        for (int i = p->code[stage]; i < p->code[stage + 1]; i++) {
            if (!number[leaves(p) + i] || (s->given && s->given[i]))
                continue;
            kmp_instruction *in = &to->instruction[count++];
            *in = p->instruction[i];
            const int arity = kmp_op_arity((kmp_op)in->op);
            in->a = renumbered(number, in->a);
            if (arity > 1)
                in->b = renumbered(number, in->b);
            if (arity > 2)
                in->c = renumbered(number, in->c);
            number[leaves(p) + i] = ++next;
            if (!select_applied(p, in, block, to))
                return false;
        }
    }
    to->code[to->stages] = count;
    return true;
}

static bool fill_selection(selection *s, uint32_t *number, int *block, kmp_program *to)
{
    const kmp_program *p = s->p;
    to->stages = s->stages;
    to->graph_nodes = p->graph_nodes;
    /* Marks the values that outputs of the stages need, backwards. */
    for (int k = 0; k < p->outputs[s->stages]; k++)
        number[p->output[k] >> 1] = 1;
    for (int i = p->code[s->stages]; i-- > 0;)
        for (int k = 0;
             number[leaves(p) + i] && !(s->given && s->given[i]) && k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            number[kmp_instruction_operand(&p->instruction[i], k) >> 1] = 1;
    /* Copies the constants and inputs in use; marks become numbers + 1. */
    uint32_t next = 0;
    for (int k = 0; k < p->constant_count; k++)
        if (number[k]) {
            to->constant[to->constant_count++] = p->constant[k];
            number[k] = ++next;
        }
    for (int k = 0; k < p->input_count; k++)
        if (number[p->constant_count + k]) {
            to->input[to->input_count++] = p->input[k];
            number[p->constant_count + k] = ++next;
        }
    for (int i = 0; s->given && i < p->code[s->stages]; i++)
        if (s->given[i] && number[leaves(p) + i]) {
            to->input[to->input_count++] = (kmp_program_input){KMP_IN_Q, (uint32_t)(s->first + s->count)};
            s->list[s->count++] = i;
            number[leaves(p) + i] = ++next;
        }
    if (!select_code(s, number, next, block, to))
        return false;
    memcpy(to->outputs, p->outputs, (size_t)(s->stages + 1) * sizeof *to->outputs);
    for (int k = 0; k < to->outputs[s->stages]; k++)
        to->output[k] = renumbered(number, p->output[k]);
    return true;
}

static kmp_program *select_stages(selection *s)
{
    const kmp_program *p = s->p;
    const size_t code = (size_t)p->code[s->stages], inputs = (size_t)p->input_count + (s->given ? code : 0);
    kmp_program *to = kmp_program_with_room((size_t)s->stages, code, (size_t)p->outputs[s->stages],
                                            (size_t)p->constant_count, inputs);
    uint32_t *number = KMP_NEW(uint32_t, leaves(p) + p->code[p->stages]);
    int *block = KMP_NEW(int, p->block_count + 1);
    bool ok = to && number && block && fill_selection(s, number, block, to);
    kmp_free(number);
    kmp_free(block);
    if (ok)
        return to;
    kmp_program_free(to);
    return NULL;
}

kmp_program *kmp_program_first(const kmp_program *p, int stages)
{
    selection s = {.p = p, .stages = stages};
    return select_stages(&s);
}

kmp_program *kmp_program_given(const kmp_program *p, const bool *given, int first, int *list, int *count)
{
    selection s = {.p = p, .stages = p->stages, .given = given, .first = first, .list = list};
    kmp_program *to = select_stages(&s);
    *count = s.count;
    return to;
}

/* -- import: leaves and instructions ------------------------------------------------------------------------ */

static kmp_ref operand_of(const kmp_ref *value, uint32_t operand)
{
    return operand & 1 ? kmp_neg(value[operand >> 1]) : value[operand >> 1];
}

static kmp_ref import_instruction(const kmp_program *p, kmp_graph *g, const kmp_instruction *in, const kmp_ref *value)
{
    kmp_ref x[3] = {0};
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
        x[k] = operand_of(value, kmp_instruction_operand(in, k));
    if (in->op == KMP_OP_IMPLICIT)
        return kmp_implicit_component(g, kmp_graph_add_block(g, &p->block[in->b]), (int)in->c, x[0]);
    if (in->op != KMP_OP_TABLE)
        return kmp_operate(g, (kmp_op)in->op, x);
    int table = kmp_graph_add_table(g, p->table[in->b]);
    return table < 0 ? KMP_ZERO : kmp_table_derivative_at(g, table, (int)in->c, x[0]);
}

/* Constants, and inputs or their replacements. */
static bool import_leaves(const kmp_program *p, kmp_graph *g, int count, const kmp_ref *input, const kmp_ref *by,
                          kmp_ref *value)
{
    uint32_t nodes = kmp_graph_count(g);
    int *which = KMP_NEW(int, nodes); /* + 1, by node */
    for (int k = 0; which && k < count; k++)
        which[kmp_id(input[k])] = k + 1;
    for (int k = 0; which && k < p->input_count; k++) {
        kmp_ref x = kmp_input(g, p->input[k].kind, p->input[k].index);
        int replaced = kmp_id(x) < nodes ? which[kmp_id(x)] : 0;
        value[p->constant_count + k] = replaced ? by[replaced - 1] : x;
    }
    for (int k = 0; which && k < p->constant_count; k++)
        value[k] = kmp_const(g, p->constant[k]);
    bool made = which;
    kmp_free(which);
    return made;
}

/* -- import at two places near each other ------------------------------------------------------------------ */

/* Instructions whose values at the first place are needed: operands of sines and cosines, and what these need. */
static void mark_needed(const kmp_program *p, bool *is_used)
{
    int leaves = p->constant_count + p->input_count;
    for (int i = p->code[p->stages]; i-- > 0;) {
        const kmp_instruction *in = &p->instruction[i];
        bool turns = in->op == KMP_OP_SIN || in->op == KMP_OP_COS;
        for (int k = 0; (turns || is_used[i]) && k < kmp_op_arity((kmp_op)in->op); k++) {
            int from = (int)(kmp_instruction_operand(in, k) >> 1) - leaves;
            if (from >= 0)
                is_used[from] = true;
        }
    }
}

/* sin d and cos d - 1 of a small angle, by their series. */
static void small_angle_series(kmp_graph *g, kmp_ref d, kmp_ref *sine, kmp_ref *versine)
{
    kmp_ref square = kmp_mul(g, d, d);
    *sine = kmp_mul(g, d, kmp_sub(g, KMP_ONE, kmp_mul(g, square, kmp_const(g, 1.0 / 6))));
    *versine = kmp_mul(g, square, kmp_sub(g, kmp_mul(g, square, kmp_const(g, 1.0 / 24)), kmp_const(g, 0.5)));
}

/* Sine or cosine of b = a + d, from sine and cosine of a, as it is plus a small part. */
static kmp_ref turn(kmp_graph *g, kmp_op op, kmp_ref a, kmp_ref b, kmp_angle_updates *turns)
{
    kmp_ref d = kmp_sub(g, b, a), sine, versine, s = kmp_sin(g, a), c = kmp_cos(g, a);
    if (d == KMP_ZERO)
        return kmp_unary(g, op, a);
    bool noted = false;
    for (int k = 0; k < turns->count; k++)
        noted = noted || kmp_id(turns->angle[k]) == kmp_id(d);
    if (!noted)
        turns->angle[turns->count++] = d;
    small_angle_series(g, d, &sine, &versine);
    if (op == KMP_OP_SIN)
        return kmp_add(g, s, kmp_add(g, kmp_mul(g, c, sine), kmp_mul(g, s, versine)));
    return kmp_add(g, c, kmp_sub(g, kmp_mul(g, c, versine), kmp_mul(g, s, sine)));
}

/* -- import of a program ------------------------------------------------------------------------------------ */

bool kmp_program_import(const kmp_program *p, kmp_graph *g, const kmp_importing *how, kmp_ref *outputs)
{
    int leaves = p->constant_count + p->input_count, code = p->code[p->stages], stages = how->stages;
    stages = stages > 0 ? stages : p->stages;
    kmp_ref *value = KMP_NEW(kmp_ref, leaves + code), *at = how->at ? KMP_NEW(kmp_ref, leaves + code) : NULL;
    bool *is_used = how->at ? KMP_NEW(bool, code) : NULL;
    bool made = value && (!how->at || (at && is_used)) && import_leaves(p, g, how->count, how->input, how->by, value) &&
                (!at || import_leaves(p, g, how->count, how->input, how->at, at));
    if (made && is_used)
        mark_needed(p, is_used);
    if (made) {
        /* Values of all instructions. With `at`, values at the first place, sines and cosines come from there. */
        for (int i = 0; i < p->code[stages]; i++) {
            const kmp_instruction *in = &p->instruction[i];
            bool turned = at && (in->op == KMP_OP_SIN || in->op == KMP_OP_COS);
            if (at && is_used[i])
                at[leaves + i] = import_instruction(p, g, in, at);
            if (!turned) {
                value[leaves + i] = import_instruction(p, g, in, value);
                continue;
            }
            const kmp_ref from = operand_of(at, in->a), to = operand_of(value, in->a);
            value[leaves + i] = turn(g, (kmp_op)in->op, from, to, how->turns);
        }
    }
    for (int k = 0; made && k < p->outputs[stages]; k++)
        outputs[k] = operand_of(value, p->output[k]);
    kmp_free(value);
    kmp_free(at);
    kmp_free(is_used);
    return made && !kmp_graph_failed(g);
}

/* -- text ------------------------------------------------------------------------------------------------- */

static const char *const input_words[KMP_IN_COUNT] = {
    "p", "t", "q", "qd", "qdd", "lambda", "mu", "mode", "place", "chart", "force", "torque", "effort", "along", "kept"};

static void print_operand(const kmp_program *p, uint32_t operand_, kmp_text *text)
{
    int value = (int)(operand_ >> 1);
    kmp_text_put(text, operand_ & 1 ? "-" : "");
    if (value < p->constant_count) {
        double x = p->constant[value];
        if (isfinite(x))
            kmp_text_number(text, x);
        else
            kmp_text_put(text, isnan(x) ? "nan" : x < 0 ? "-inf" : "inf");
    } else if (value < p->constant_count + p->input_count) {
        const kmp_program_input *in = &p->input[value - p->constant_count];
        if (in->kind == KMP_IN_TIME && in->index == 0)
            kmp_text_put(text, "t");
        else
            kmp_text_printf(text, "%s[%u]", input_words[in->kind], in->index);
    } else {
        kmp_text_printf(text, "v%d", value - p->constant_count - p->input_count);
    }
}

static void print_instruction(const kmp_program *p, int i, kmp_text *text)
{
    const kmp_instruction *in = &p->instruction[i];
    kmp_text_printf(text, "    v%d = ", i);
    if (kmp_op_form_of((kmp_op)in->op) == KMP_FORM_INFIX) {
        print_operand(p, in->a, text);
        bool minus = in->op == KMP_OP_ADD && (in->b & 1);
        kmp_text_printf(text, " %s ", minus ? "-" : kmp_op_text((kmp_op)in->op));
        print_operand(p, minus ? in->b ^ 1 : in->b, text);
    } else {
        kmp_text_put(text, kmp_op_text((kmp_op)in->op));
        if (kmp_op_form_of((kmp_op)in->op) == KMP_FORM_APPLIED)
            kmp_text_printf(text, "[%u, %u]", in->b, in->c);
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
            kmp_text_put(text, k ? ", " : "(");
            print_operand(p, kmp_instruction_operand(in, k), text);
        }
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, "\n");
}

static void print_table(const kmp_table *table, int number, kmp_text *text)
{
    kmp_text_printf(text, "table %d %s\n", number, kmp_table_method_name(table->method));
    for (int k = 0; k < table->count; k++) {
        kmp_text_put(text, "    ");
        kmp_text_number(text, table->x[k]);
        kmp_text_put(text, " ");
        kmp_text_number(text, table->y[k]);
        kmp_text_put(text, "\n");
    }
}

void kmp_program_print(const kmp_program *p, const char *const *stage_name, kmp_text *text)
{
    kmp_text_put(text, "program 1\n");
    for (int k = 0; k < p->table_count; k++)
        print_table(p->table[k], k, text);
    for (int k = 0; k < p->block_count; k++) {
        kmp_text_printf(text, "implicit %d %s %d arguments %d\n", k, p->block[k].averages ? "averages" : "unknowns",
                        p->block[k].unknowns, p->block[k].arguments);
        const kmp_program_block *block = &p->block[k];
        for (int j = 0; j < block->candidates; j++) {
            kmp_text_put(text, "    ");
            kmp_text_number(text, block->candidate[j]);
            kmp_text_put(text, "\n");
        }
        kmp_program_print(p->block[k].program, NULL, text);
    }
    for (int s = 0; s < p->stages; s++) {
        kmp_text_printf(text, "stage %d%s%s\n", s, stage_name ? " " : "", stage_name ? stage_name[s] : "");
        for (int i = p->code[s]; i < p->code[s + 1]; i++)
            print_instruction(p, i, text);
        for (int k = p->outputs[s]; k < p->outputs[s + 1]; k++) {
            kmp_text_printf(text, "    out[%d] = ", k - p->outputs[s]);
            print_operand(p, p->output[k], text);
            kmp_text_put(text, "\n");
        }
    }
    kmp_text_put(text, "end\n");
}
