/* SPDX-License-Identifier: BSD-3-Clause */
/* Instructions are sorted by step index (Fisette and Samin 1996, section 3.2), then by kind of operation. Products with
 * a single reader become part of the reader's sum. */
#include "exchange/code/levels.h"
#include <stdlib.h>

/* The operation of one instruction of stage 1: op and operands (of the program, with signs). */
typedef struct item {
    kmp_op op;
    uint32_t operand[3];
    bool minus; /* s of MUL */
    uint32_t table, derivative;
    int level, instruction;
} item;

typedef struct builder {
    kmp_nesting_levels *l;
    const kmp_code_source *source;
    const kmp_program *p;
    int leaves, count;
    int *uses, *level; /* by instruction */
    bool *taken;       /* a product that is part of a sum */
    item *items;
    int *place; /* by value of the program: in the vector */
} builder;

enum { ZERO, ONE }; /* places of the first two numbers; as operands they are NUMBER_ZERO and so on */
static const uint32_t number_zero = UINT32_MAX - 1, number_one = UINT32_MAX - 3;

static int instruction_of(const builder *b, uint32_t operand)
{
    int i = operand >= number_one ? -1 : (int)(operand >> 1) - b->leaves;
    return i >= b->p->code[1] ? i : -1;
}

static int level_of(const builder *b, uint32_t operand)
{
    int i = instruction_of(b, operand);
    return i >= 0 ? b->level[i] : 0;
}

static void count_uses(builder *b)
{
    const kmp_program *p = b->p;
    for (int i = p->code[1]; i < p->code[2]; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            if (instruction_of(b, kmp_instruction_operand(&p->instruction[i], k)) >= 0)
                b->uses[instruction_of(b, kmp_instruction_operand(&p->instruction[i], k))]++;
    for (int k = p->outputs[1]; k < p->outputs[2]; k++)
        if (instruction_of(b, p->output[k]) >= 0)
            b->uses[instruction_of(b, p->output[k])]++;
}

static bool is_single_product(const builder *b, uint32_t operand)
{
    int i = instruction_of(b, operand);
    return i >= 0 && b->uses[i] == 1 && b->p->instruction[i].op == KMP_OP_MUL;
}

/* c + s a b for a sum: one operand unchanged, without a sign, the other as a product. */
static item sum_of(builder *b, const kmp_instruction *in)
{
    bool second = !(in->a & 1) && (is_single_product(b, in->b) || (in->b & 1) || !is_single_product(b, in->a));
    uint32_t whole = second ? in->a : in->b, product = second ? in->b : in->a;
    item it = {.op = KMP_OP_MUL, .operand = {product & ~1u, number_one, whole}, .minus = product & 1};
    if (is_single_product(b, product)) {
        const kmp_instruction *m = &b->p->instruction[instruction_of(b, product)];
        it.operand[0] = m->a;
        it.operand[1] = m->b;
        b->taken[instruction_of(b, product)] = true;
    }
    return it;
}

static item item_of(builder *b, const kmp_instruction *in)
{
    if (in->op == KMP_OP_ADD)
        return sum_of(b, in);
    item it = {.op = (kmp_op)in->op, .operand = {in->a, in->b, in->c}};
    if (in->op == KMP_OP_MUL)
        it.operand[2] = number_zero;
    if (in->op == KMP_OP_TABLE) {
        it.table = in->b;
        it.derivative = in->c;
    }
    return it;
}

int kmp_group_operands(kmp_op op)
{
    return op == KMP_OP_MUL ? 3 : kmp_op_arity(op);
}

static void list_items(builder *b)
{
    const kmp_program *p = b->p;
    for (int i = p->code[1]; i < p->code[2]; i++) {
        item it = item_of(b, &p->instruction[i]);
        it.instruction = i;
        for (int k = 0; k < kmp_group_operands(it.op); k++)
            if (level_of(b, it.operand[k]) >= it.level)
                it.level = level_of(b, it.operand[k]);
        b->level[i] = ++it.level;
        b->items[b->count++] = it;
    }
    int kept = 0; /* an item that a sum absorbed after it was listed is removed */
    for (int k = 0; k < b->count; k++)
        if (!b->taken[b->items[k].instruction])
            b->items[kept++] = b->items[k];
    b->count = kept;
}

/* Compares items by step, then kind of operation; equal ones keep their order. */
static int compare(const void *x, const void *y)
{
    const item *a = x, *b = y;
    if (a->level != b->level)
        return a->level - b->level;
    if (a->op != b->op)
        return a->op == KMP_OP_MUL ? -1 : b->op == KMP_OP_MUL ? 1 : (int)a->op - (int)b->op;
    if (a->table != b->table)
        return a->table < b->table ? -1 : 1;
    if (a->derivative != b->derivative)
        return a->derivative < b->derivative ? -1 : 1;
    return a->instruction - b->instruction;
}

static bool same_group(const item *a, const item *b)
{
    return a->level == b->level && a->op == b->op && a->table == b->table && a->derivative == b->derivative;
}

/* -- the vector -------------------------------------------------------------------------------------- */

/* Numbers, then the routine's arguments. */
static void place_leaves(builder *b)
{
    kmp_nesting_levels *l = b->l;
    const kmp_program *p = b->p;
    const kmp_code_source *source = b->source;
    const int width[KMP_ARGUMENTS] = {[KMP_IN_PARAMETER] = source->parameters ? l->routine->kept_count : 0,
                                      [KMP_IN_TIME] = 1,
                                      [KMP_IN_Q] = source->n,
                                      [KMP_IN_QD] = source->n,
                                      [KMP_IN_QDD] = source->n,
                                      [KMP_IN_LAMBDA] = source->m,
                                      [KMP_IN_MODE] = source->mode_entries * source->elements.count,
                                      [KMP_IN_FORCE] = 3 * source->body_count,
                                      [KMP_IN_TORQUE] = 3 * source->body_count,
                                      [KMP_ARGUMENT_INPUTS] = KMP_TIME_NUMBERS * source->input_count};
    l->numbers[l->number_count++] = 0;
    l->numbers[l->number_count++] = 1;
    for (int k = 0; k < p->constant_count; k++) {
        b->place[k] = l->number_count;
        l->numbers[l->number_count++] = p->constant[k];
    }
    l->size = l->number_count;
    for (int kind = 0; kind < KMP_ARGUMENTS; kind++) {
        l->at[kind] = l->size;
        if (kind == KMP_IN_PARAMETER || l->routine->arguments & 1u << kind)
            l->width[kind] = width[kind];
        l->size += l->width[kind];
    }
    for (int v = p->constant_count; v < b->leaves + p->code[1]; v++) {
        const kmp_program_input *in = v < b->leaves ? &p->input[v - p->constant_count] : NULL;
        if (l->routine->kept[v])
            b->place[v] = l->at[KMP_IN_PARAMETER] + l->routine->kept[v] - 1;
        else if (in && in->kind != KMP_IN_PARAMETER)
            b->place[v] = l->at[kmp_argument_of(in)] + kmp_place_in_argument(b->source, in);
    }
}

static void put_item(builder *b, int k, kmp_group *group)
{
    kmp_nesting_levels *l = b->l;
    const item *it = &b->items[k];
    b->place[b->leaves + it->instruction] = l->size++;
    for (int j = 0; j < kmp_group_operands(it->op); j++) {
        bool minus = it->op == KMP_OP_MUL ? j == 0 && it->minus : it->operand[j] < number_one && it->operand[j] & 1;
        l->operand[j][k] = it->operand[j] == number_zero  ? ZERO
                           : it->operand[j] == number_one ? ONE
                                                          : b->place[it->operand[j] >> 1];
        l->minus[j][k] = minus;
        group->minus[j] = group->minus[j] || minus;
    }
    group->multiplies = group->multiplies || it->operand[1] != number_one;
    group->adds = group->adds || it->operand[2] != number_zero;
    group->count++;
}

static void make_groups(builder *b)
{
    kmp_nesting_levels *l = b->l;
    qsort(b->items, (size_t)b->count, sizeof *b->items, compare);
    for (int k = 0; k < b->count; k++) {
        const item *it = &b->items[k];
        if (k == 0 || !same_group(it, it - 1))
            l->groups[l->group_count++] = (kmp_group){.op = it->op,
                                                      .table = it->table,
                                                      .derivative = it->derivative,
                                                      .level = it->level,
                                                      .first = l->size,
                                                      .start = k};
        put_item(b, k, &l->groups[l->group_count - 1]);
        l->steps = it->level;
    }
    for (int k = b->p->outputs[1]; k < b->p->outputs[2]; k++)
        l->output[k - b->p->outputs[1]] = b->place[b->p->output[k] >> 1];
}

bool kmp_levels_init(kmp_nesting_levels *l, const kmp_code_source *source, const kmp_code_routine *routine)
{
    const kmp_program *p = routine->program;
    kmp_arena own = {0}, *a = &l->arena; /* own: until the levels are there */
    int code = p->code[2], leaves = p->constant_count + p->input_count;
    *l = (kmp_nesting_levels){.routine = routine};
    KMP_ARENA_MAKE(a, KMP_ROOM(double, p->constant_count + 2, &l->numbers), KMP_ROOM(kmp_group, code, &l->groups),
                   KMP_ROOM(int, p->outputs[2], &l->output));
    for (int k = 0; k < 3; k++) {
        l->operand[k] = KMP_ARENA_NEW(a, int, code);
        l->minus[k] = KMP_ARENA_NEW(a, bool, code);
    }
    builder b = {.l = l,
                 .source = source,
                 .p = p,
                 .leaves = leaves,
                 .uses = KMP_ARENA_NEW(&own, int, code),
                 .level = KMP_ARENA_NEW(&own, int, code),
                 .taken = KMP_ARENA_NEW(&own, bool, code),
                 .items = KMP_ARENA_NEW(&own, item, code),
                 .place = KMP_ARENA_NEW(&own, int, leaves + code)};
    bool ok = !a->failed && !own.failed;
    if (ok) {
        count_uses(&b);
        list_items(&b);
        place_leaves(&b);
        make_groups(&b);
    }
    kmp_arena_free(&own);
    if (!ok)
        kmp_levels_free(l);
    return ok;
}

void kmp_levels_free(kmp_nesting_levels *l)
{
    kmp_arena_free(&l->arena);
    *l = (kmp_nesting_levels){0};
}

/* -- outputs ----------------------------------------------------------------------------------------- */

static void add_output(kmp_outputs *o, const kmp_nesting_levels *l, int output, int to)
{
    const kmp_program *p = l->routine->program;
    uint32_t operand = p->output[p->outputs[1] + output];
    int from = l->output[output];
    if (from < l->number_count && l->numbers[from] == 0)
        return;
    o->from[o->count] = from;
    o->to[o->count] = to;
    o->minus[o->count++] = operand & 1;
    o->signs = o->signs || operand & 1;
}

bool kmp_outputs_init(kmp_outputs *o, const kmp_nesting_levels *l, int array, bool by_columns)
{
    const kmp_array *a = &l->routine->arrays[array];
    int output = a->first, cols = a->cols ? a->cols : 1;
    *o = (kmp_outputs){0};
    if (!KMP_ARENA_MAKE(&o->arena, KMP_ROOM(int, a->rows *cols, &o->from, &o->to),
                        KMP_ROOM(bool, a->rows *cols, &o->minus)))
        return false;
    for (int i = 0; i < a->rows; i++)
        for (int k = 0; k < (a->symmetric ? i + 1 : cols); k++, output++) {
            add_output(o, l, output, by_columns ? k * a->rows + i : i * cols + k);
            if (a->symmetric && k != i)
                add_output(o, l, output, by_columns ? i * a->rows + k : k * cols + i);
        }
    return true;
}

void kmp_outputs_free(kmp_outputs *o)
{
    kmp_arena_free(&o->arena);
}
