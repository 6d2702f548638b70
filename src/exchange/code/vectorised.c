/* SPDX-License-Identifier: BSD-3-Clause */
/* The vectorised form of a routine: a statement for all operations of one kind in a step. Instructions are sorted by
 * step index, then by kind of operation. Products with a single reader become part of the reader's sum. */
#include "exchange/code/vectorised.h"
#include "exchange/code/language.h"
#include "exchange/code/write.h"
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

/* The number of columns of the items of a group of operations. */
static int group_operands(kmp_op op)
{
    return op == KMP_OP_MUL ? 3 : kmp_op_arity(op);
}

static void list_items(builder *b)
{
    const kmp_program *p = b->p;
    for (int i = p->code[1]; i < p->code[2]; i++) {
        item it = item_of(b, &p->instruction[i]);
        it.instruction = i;
        for (int k = 0; k < group_operands(it.op); k++)
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
    for (int j = 0; j < group_operands(it->op); j++) {
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

/* Positions of an array's entries in the vector and in the array; zeros are left out. */
typedef struct outputs {
    kmp_arena arena;
    int count;
    int *from, *to;
    bool *minus, signs; /* some change their sign */
} outputs;

static void add_output(outputs *o, const kmp_nesting_levels *l, int output, int to)
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

/* false: no memory. To be freed in any case. */
static bool outputs_init(outputs *o, const kmp_nesting_levels *l, int array, bool by_columns)
{
    const kmp_array *a = &l->routine->arrays[array];
    int output = a->first, cols = a->cols ? a->cols : 1;
    *o = (outputs){0};
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

enum { OPERANDS = 3 };

static const char *const place_lists[OPERANDS] = {"a", "b", "c"}, *const sign_lists[OPERANDS] = {"sa", "sb", "sc"};

/* -- lists ------------------------------------------------------------------------------------------- */

void kmp_vectorised_list(const kmp_code_writer *w)
{
    const kmp_array_spelling *spelling = &w->language->arrays;
    for (int k = 0; k < w->count; k++) {
        kmp_put_list_item(w->text, &w->language->places, k);
        if (w->places)
            kmp_text_printf(w->text, "%d", w->places[k] + w->language->base);
        else
            kmp_text_put(w->text, w->signs[k] ? spelling->minus : spelling->plus);
    }
    kmp_list_end(w->text, &w->language->places, w->count);
}

/* A list of places, or of signs: what is not given is NULL. */
static void put_list(const kmp_code_writer *w, const char *pattern, const char *what, int number, int count,
                     const int *places, const bool *signs)
{
    kmp_code_writer list = *w;
    list.what = what;
    list.number = number;
    list.count = count;
    list.places = places;
    list.signs = signs;
    list.first = places ? places[0] + w->language->base : 0;
    kmp_fill(&list, pattern);
}

static void gather(const kmp_code_writer *w, const char *what, int number, int count, const int *places)
{
    const kmp_array_spelling *spelling = &w->language->arrays;
    put_list(w, count == 1 && spelling->gather_one ? spelling->gather_one : spelling->gather, what, number, count,
             places, NULL);
}

/* -- groups ------------------------------------------------------------------------------------------ */

static int operand_count(const kmp_group *g)
{
    int count = group_operands(g->op);
    return count < OPERANDS ? count : OPERANDS;
}

static void put_operand_signs(const kmp_code_writer *w, const char *pattern, int k)
{
    const kmp_nesting_levels *l = w->levels;
    const kmp_group *g = &l->groups[w->group];
    if (g->minus[k])
        put_list(w, pattern, sign_lists[k], w->group, g->count, NULL, l->minus[k] + g->start);
}

static void gather_operand(const kmp_code_writer *w, int k)
{
    const kmp_nesting_levels *l = w->levels;
    const kmp_group *g = &l->groups[w->group];
    gather(w, place_lists[k], w->group, g->count, l->operand[k] + g->start);
}

void kmp_vectorised_operands(const kmp_code_writer *w)
{
    for (int k = 0; k < operand_count(&w->levels->groups[w->group]); k++) {
        kmp_text_put(w->text, k ? ", " : "");
        put_operand_signs(w, w->language->arrays.signs, k);
        gather_operand(w, k);
    }
}

static void put_call(const kmp_code_writer *w, const kmp_group *g)
{
    const kmp_language *language = w->language;
    if (g->op == KMP_OP_TABLE && language->arrays.table) {
        kmp_fill(w, language->arrays.table);
        return;
    }
    kmp_fill(w, g->op == KMP_OP_TABLE ? language->table_call : language->functions[g->op].call);
    kmp_text_put(w->text, g->op == KMP_OP_TABLE ? "" : "(");
    kmp_vectorised_operands(w);
    kmp_text_put(w->text, ")");
}

/* c + s a b */
static void put_sum(const kmp_code_writer *w, const kmp_group *g)
{
    if (g->adds) {
        gather_operand(w, 2);
        kmp_text_put(w->text, " + ");
    }
    put_operand_signs(w, w->language->arrays.signs, 0);
    kmp_text_put(w->text, g->multiplies ? "(" : "");
    gather_operand(w, 0);
    if (g->multiplies) {
        kmp_text_put(w->text, w->language->arrays.times);
        gather_operand(w, 1);
        kmp_text_put(w->text, ")");
    }
}

void kmp_vectorised_groups(const kmp_code_writer *writer)
{
    const kmp_array_spelling *spelling = &writer->language->arrays;
    kmp_code_writer one = *writer;
    for (one.group = 0; one.group < writer->levels->group_count; one.group++) {
        const kmp_group *g = &writer->levels->groups[one.group];
        one.first = g->first + writer->language->base;
        one.last = g->first + g->count;
        one.table = (int)g->table;
        one.derivative = (int)g->derivative;
        kmp_fill(&one, g->count == 1 && spelling->one ? spelling->one : spelling->range);
        if (g->op == KMP_OP_MUL)
            put_sum(&one, g);
        else
            put_call(&one, g);
        kmp_text_printf(one.text, "%s\n", writer->language->end);
    }
}

/* -- results ----------------------------------------------------------------------------------------- */

/* Calls `put` for each array with entries that are not zero. */
static void each_array(const kmp_code_writer *writer,
                       void (*put)(const kmp_code_writer *w, int array, const outputs *o))
{
    kmp_code_writer one = *writer;
    for (int a = 0; a < writer->routine->array_count; a++) {
        outputs o;
        one.array = &writer->routine->arrays[a];
        if (!outputs_init(&o, writer->levels, a, writer->language->arrays.by_columns))
            writer->text->failed = true;
        else if (o.count > 0)
            put(&one, a, &o);
        kmp_arena_free(&o.arena);
    }
}

static void put_result(const kmp_code_writer *w, int array, const outputs *o)
{
    put_list(w, w->language->arrays.scatter, "to", array, o->count, o->to, NULL);
    if (o->signs)
        put_list(w, w->language->arrays.signs, "sign", array, o->count, NULL, o->minus);
    gather(w, "from", array, o->count, o->from);
    kmp_text_printf(w->text, "%s\n", w->language->end);
}

void kmp_vectorised_results(const kmp_code_writer *writer)
{
    each_array(writer, put_result);
}

static void define_result(const kmp_code_writer *w, int array, const outputs *o)
{
    put_list(w, w->language->arrays.define, "to", array, o->count, o->to, NULL);
    put_list(w, w->language->arrays.define, "from", array, o->count, o->from, NULL);
    if (o->signs)
        put_list(w, w->language->arrays.define_signs, "sign", array, o->count, NULL, o->minus);
}

void kmp_vectorised_lists(const kmp_code_writer *writer)
{
    const kmp_nesting_levels *l = writer->levels;
    kmp_code_writer one = *writer;
    for (one.group = 0; one.group < l->group_count; one.group++) {
        const kmp_group *g = &l->groups[one.group];
        const bool needed[OPERANDS] = {true, g->op != KMP_OP_MUL || g->multiplies, g->op != KMP_OP_MUL || g->adds};
        for (int k = 0; k < operand_count(g); k++)
            if (needed[k])
                put_list(&one, one.language->arrays.define, place_lists[k], one.group, g->count,
                         l->operand[k] + g->start, NULL);
        for (int k = 0; k < OPERANDS; k++)
            put_operand_signs(&one, one.language->arrays.define_signs, k);
    }
    each_array(writer, define_result);
}
