/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/taken_names.h"
#include "exchange/code/scalar.h"
#include <string.h>

/* Names that are taken, by hash: open addressing over numbers of instructions + 1. */
typedef struct taken {
    int *slot;
    size_t size; /* a power of two */
} taken;

static size_t hash_of(const char *s)
{
    size_t hash = 5381;
    for (; *s; s++)
        hash = hash * 33 + (unsigned char)*s;
    return hash;
}

/* True when the name is new and now taken by instruction i. */
static bool take(taken *t, char *const *name, const char *wanted, int i)
{
    size_t k = hash_of(wanted) & (t->size - 1);
    for (; t->slot[k]; k = (k + 1) & (t->size - 1))
        if (strcmp(name[t->slot[k] - 1], wanted) == 0)
            return false;
    t->slot[k] = i + 1;
    return true;
}

/* -- sines and cosines ------------------------------------------------------------------------------- */

/* "1p2m3" of a sum of coordinates; false for any other operand. */
static bool put_angle(const kmp_program *p, uint32_t operand, bool minus, bool first, int depth, kmp_text *text)
{
    int value = (int)(operand >> 1), input = value - p->constant_count, i = input - p->input_count;
    minus = minus != (bool)(operand & 1);
    if (input >= 0 && i < 0 && p->input[input].kind == KMP_IN_Q) {
        kmp_text_printf(text, "%s%u", minus ? "m" : first ? "" : "p", p->input[input].index + 1);
        return true;
    }
    return i >= 0 && depth < 5 && p->instruction[i].op == KMP_OP_ADD &&
           put_angle(p, p->instruction[i].a, minus, first, depth + 1, text) &&
           put_angle(p, p->instruction[i].b, minus, false, depth + 1, text);
}

static bool put_trigonometric(const kmp_program *p, int i, kmp_text *text)
{
    int op = p->instruction[i].op;
    if (op != KMP_OP_SIN && op != KMP_OP_COS)
        return false;
    kmp_text_put(text, op == KMP_OP_SIN ? "S" : "C");
    return put_angle(p, p->instruction[i].a, false, true, 0, text);
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool put_label(const kmp_program *p, int i, kmp_text *text)
{
    const kmp_label *label = p->label ? &p->label[i] : NULL;
    if (!label || !label->quantity)
        return false;
    kmp_text_put(text, label->quantity->stem);
    if (label->entry)
        kmp_text_printf(text, "%d", label->entry);
    kmp_text_printf(text, "%d", label->link);
    if (label->column)
        kmp_text_printf(text, "_%d", label->column);
    kmp_text_put(text, label->negative ? "n" : ""); /* the negative of the named value */
    return true;
}

static void propose(const kmp_scalar *s, int i, int *others, kmp_text *text)
{
    if (put_trigonometric(s->p, i, text) || text->failed)
        return;
    kmp_text_free(text);
    if (put_label(s->p, i, text) || text->failed)
        return;
    kmp_text_free(text);
    kmp_text_printf(text, "a%d", ++*others);
}

static bool give_one(kmp_scalar *s, taken *t, int i, int *others)
{
    kmp_text text = {0};
    propose(s, i, others, &text);
    for (int again = 2; !text.failed && !take(t, s->name, text.s, i); again++) {
        text.length = strcspn(text.s, "x");
        text.s[text.length] = '\0';
        kmp_text_printf(&text, "x%d", again);
    }
    s->name[i] = kmp_text_keep(&text, &s->arena);
    return s->name[i];
}

bool kmp_names_give(kmp_scalar *s)
{
    taken t = {.size = 64};
    int others = 0;
    while (t.size < 2 * (size_t)s->variables + 2)
        t.size *= 2;
    t.slot = KMP_ARENA_NEW(&s->arena, int, t.size);
    s->name = KMP_ARENA_NEW(&s->arena, char *, s->p->code[s->p->stages]);
    bool ok = t.slot && s->name;
    for (int k = 0; ok && k < s->count; k++) {
        const int set[2] = {s->statements[k].value, s->statements[k].partner};
        for (int j = 0; j < 2 && ok; j++)
            ok = set[j] < 0 || !s->variable[set[j]] || give_one(s, &t, set[j], &others);
    }
    return ok;
}
