/* SPDX-License-Identifier: BSD-3-Clause */
/* Algebraic variables, and expressions under a name. Each may use those before it. Expressions that depend on
 * multipliers wait until the closures are read; closures cannot depend on them. */
#include "model/read/read_algebraic.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "model/read/linkage.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <ctype.h>
#include <string.h>

/* -- dependence on multipliers ------------------------------------------------------------------------ */

static bool is_letter(char c)
{
    return isalnum((unsigned char)c) || c == '_' || (unsigned char)c >= 0x80;
}

/* True if a text contains a word; `called`: WORD(. */
static bool has_word(const char *text, const char *word, bool called)
{
    size_t length = strlen(word);
    for (const char *s = strstr(text, word); s; s = strstr(s + 1, word))
        if ((s == text || !is_letter(s[-1])) &&
            (called ? s[length + strspn(s + length, " \t")] == '(' : !is_letter(s[length])))
            return true;
    return false;
}

/* The name in the file's own notation. A name unknown to that file keeps its prefix, which no word of the file has. */
static const char *name_in(const kmp_reader *r, int file, const char *name)
{
    const kmp_include_instance *instance = kmp_reader_instance(r, file);
    size_t length = instance ? strlen(instance->prefix) : 0;
    return length > 0 && strncmp(name, instance->prefix, length) == 0 ? name + length : name;
}

/* Under a name, and with multipliers in it or another one that waits. */
static bool waits(const kmp_reader *r, const kmp_yaml *map, int i)
{
    const kmp_yaml *node = map->items[i];
    if (node->kind != KMP_YAML_SCALAR || node->empty)
        return false;
    bool found = false;
    for (int k = 0; kmp_words_of_loads[k] && !found; k++)
        found = has_word(node->text, kmp_words_of_loads[k], true);
    for (int k = 0; k < i && !found; k++) {
        const kmp_unknowns *other = &r->model->unknowns[r->first_algebraic + k];
        found = other->late && has_word(node->text, name_in(r, node->text_place.file, other->name), false);
    }
    return found;
}

/* -- operands ----------------------------------------------------------------------------------------- */

/* Adds a leaf to a sum that has it not yet. */
static void add_leaf(kmp_reader *r, const kmp_expr *leaf, const kmp_expr **sum)
{
    for (const kmp_expr *e = *sum; e; e = e->kind == KMP_EXPR_ADD ? e->b : NULL)
        if (kmp_expr_same_leaf(e->kind == KMP_EXPR_ADD ? e->a : e, leaf))
            return;
    const kmp_expr *more =
        *sum ? kmp_expr_make(&r->model->arena, (kmp_expr){.kind = KMP_EXPR_ADD, .a = leaf, .b = *sum}) : NULL;
    *sum = more ? more : leaf;
}

/* For algebraic variables their operands are appended below them. A rate is a separate operand. */
static void add_leaves(kmp_reader *r, const kmp_expr *e, const kmp_expr **sum)
{
    if (!e)
        return;
    if (e->kind == KMP_EXPR_RATE)
        add_leaf(r, e, sum);
    if (!e->a && e->kind != KMP_EXPR_NUMBER && e->kind != KMP_EXPR_UNKNOWN)
        add_leaf(r, e, sum);
    add_leaves(r, e->a, sum);
    add_leaves(r, e->b, sum);
    add_leaves(r, e->c, sum);
}

static bool occurs(const kmp_expr *e, int index, int number)
{
    return e && ((e->kind == KMP_EXPR_UNKNOWN && e->index == index && e->number == number) ||
                 (e->kind != KMP_EXPR_UNKNOWN &&
                  (occurs(e->a, index, number) || occurs(e->b, index, number) || occurs(e->c, index, number))));
}

/* Adds the operands of an expression to the operands of a name or of a group. */
static kmp_extent take_operands(kmp_reader *r, kmp_place place, const char *what, const kmp_expr *e, kmp_unknowns *u)
{
    const kmp_extent extent = e ? kmp_expr_extent(e, NULL) : (kmp_extent){0};
    add_leaves(r, e, &u->leaves);
    if (!kmp_extent_is_long(extent))
        return extent;
    kmp_reader_complain(r, place,
                        "%s has %.3g operations and operands when the names in it are expanded, in %d levels of names; "
                        "at most %d and %d are allowed: use fewer names within names",
                        what, extent.size, extent.level, KMP_MOST_WRITTEN_OUT, KMP_MOST_NAME_LEVELS);
    return (kmp_extent){0}; /* one message for a chain */
}

void kmp_reader_take_named(kmp_reader *r, kmp_place place, const char *what, const kmp_expr *value, kmp_unknowns *u)
{
    u->zero[0] = value;
    u->extent = take_operands(r, place, what, value, u);
}

/* -- reading ------------------------------------------------------------------------------------------ */

static const char *read_new_name(kmp_reader *r, const kmp_yaml *key, const char *what, const char *name)
{
    const kempe_model *model = r->model;
    bool known = kmp_name_find(KMP_NAMED(model, table), name) >= 0 || kmp_name_means_something(r, name);
    for (int i = 0; i < model->unknowns_count && !known; i++)
        known = kmp_name_find(kmp_unknown_names(&model->unknowns[i]), name) >= 0;
    if (kmp_read_name(r, key, what) && known)
        kmp_reader_complain(r, key->place, "%s cannot have the name '%s', which is already defined", what, name);
    return kmp_arena_strdup(&r->model->arena, name);
}

/* The names are registered first, so that the equations can use them. */
static bool read_guesses(kmp_reader *r, const kmp_yaml *of, const char *what, kmp_unknowns *u)
{
    if (!kmp_read_map(r, of, what, NULL))
        return false;
    if (of->count < 1 || of->count > KMP_UNKNOWNS_MOST)
        return kmp_reader_complain(r, of->place, "%s has %d names; 1 to %d are allowed", what, of->count,
                                   KMP_UNKNOWNS_MOST);
    for (int k = 0; k < of->count; k++) {
        const kmp_yaml *key = of->keys[k];
        const char *name = kmp_reader_name(r, key->place.file, key->text);
        u->unknown[k] = read_new_name(r, key, "an unknown", name);
        if (!u->unknown[k])
            return false;
        u->count = k + 1;
        (void)kmp_read_number(r, of->items[k], kmp_reader_say(r, "the first guess of unknown '%s'", name), KMP_DIM_ANY,
                              &u->guess[k]);
    }
    return true;
}

static void read_equations(kmp_reader *r, const kmp_yaml *zero, const char *what, int index)
{
    kmp_unknowns *u = &r->model->unknowns[index];
    bool list = zero->kind == KMP_YAML_LIST, good = true;
    int count = list ? zero->count : 1;
    if (count != u->count) {
        kmp_complain_of(r, zero, what, "%d unknown%s need%s the same number of equations, not %d", u->count,
                        u->count == 1 ? "" : "s", u->count == 1 ? "s" : "", count);
        return;
    }
    for (int k = 0; k < count; k++) {
        const char *which = kmp_reader_say(r, "expression %d of %s", k + 1, what);
        u->zero[k] = kmp_read_expr(r, list ? zero->items[k] : zero, which, KMP_DIM_ANY, KMP_OF_STATE);
        good = good && u->zero[k];
    }
    kmp_extent group = {0, 1}; /* its variables are operands of others */
    for (int k = 0; k < count; k++) {
        const int level = take_operands(r, zero->place, what, u->zero[k], u).level;
        group.level = level > group.level ? level : group.level;
    }
    u->extent = group;
    for (int j = 0; good && j < u->count; j++) {
        bool found = false;
        for (int k = 0; k < count; k++)
            found = found || occurs(u->zero[k], index, j);
        if (!found)
            kmp_complain_of(r, zero, what, "unknown '%s' does not occur in the equations", u->unknown[j]);
    }
}

static void read_entry(kmp_reader *r, const kmp_yaml *node, int index)
{
    static const kmp_key keys[] = {
#include "model/keys/algebraic_keys.def"
        {0}};
    kmp_unknowns *u = &r->model->unknowns[index];
    const char *what = kmp_reader_say(r, "algebraic '%s'", u->name);
    if (node->kind == KMP_YAML_SCALAR) {
        kmp_reader_take_named(r, node->place, what, kmp_read_expr(r, node, what, KMP_DIM_ANY, KMP_OF_LOADS), u);
        return;
    }
    if (!kmp_read_map(r, node, what, keys))
        return;
    const kmp_yaml *of = kmp_read_required(r, node, what, "of"), *zero = kmp_read_required(r, node, what, "zero");
    if (of && zero && read_guesses(r, of, kmp_reader_say(r, "%s: of", what), u))
        read_equations(r, zero, what, index);
}

static void read_late_or_now(kmp_reader *r, const kmp_yaml *map, int i, int index)
{
    kempe_model *model = r->model;
    kmp_unknowns *u = &model->unknowns[index];
    bool name = map->items[i]->kind == KMP_YAML_SCALAR;
    if (!name)
        (void)kmp_read_name(r, map->keys[i], "a group of unknowns");
    model->unknowns_count = index + !name; /* a named expression cannot use itself */
    u->late = waits(r, map, i);
    if (!u->late)
        read_entry(r, map->items[i], index);
    model->unknowns_count = index + 1;
}

void kmp_read_unknowns(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_yaml *map = kmp_yaml_get(r->root, "algebraic");
    if (!map || !kmp_read_map(r, map, "algebraic", NULL))
        return;
    for (int i = 0; model->unknowns && i < map->count; i++) {
        kmp_unknowns *u = &model->unknowns[r->first_algebraic + i];
        u->name = map->items[i]->kind == KMP_YAML_SCALAR
                      ? read_new_name(r, map->keys[i], "a name of an expression", map->keys[i]->text)
                      : kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!u->name)
            return;
        read_late_or_now(r, map, i, r->first_algebraic + i);
    }
}

void kmp_read_late_unknowns(kmp_reader *r)
{
    const kmp_yaml *map = kmp_yaml_get(r->root, "algebraic");
    for (int i = r->first_algebraic; i < r->model->unknowns_count; i++) {
        if (r->model->unknowns[i].late)
            read_entry(r, map->items[i - r->first_algebraic], i);
    }
}
