/* SPDX-License-Identifier: BSD-3-Clause */
/* The vectorised form of a routine: a statement for all operations of one kind in a step (levels.h). */
#include "exchange/code/vectorised.h"
#include "exchange/code/language.h"
#include "exchange/code/levels.h"
#include "exchange/code/write.h"

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
    int count = kmp_group_operands(g->op);
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
                       void (*put)(const kmp_code_writer *w, int array, const kmp_outputs *o))
{
    kmp_code_writer one = *writer;
    for (int a = 0; a < writer->routine->array_count; a++) {
        kmp_outputs o;
        one.array = &writer->routine->arrays[a];
        if (!kmp_outputs_init(&o, writer->levels, a, writer->language->arrays.by_columns))
            writer->text->failed = true;
        else if (o.count > 0)
            put(&one, a, &o);
        kmp_outputs_free(&o);
    }
}

static void put_result(const kmp_code_writer *w, int array, const kmp_outputs *o)
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

static void define_result(const kmp_code_writer *w, int array, const kmp_outputs *o)
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
