/* SPDX-License-Identifier: BSD-3-Clause */
/* Decides which parts a model has. The expressions are valued from the parameters as the merged files have them: each
 * parameter follows the ones that refer to it in a list, until no new one comes. */
#include "model/read/part_counts.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/language/expression_value.h"
#include "model/language/limits.h"
#include "model/read/read_include.h"
#include "model/read/read_parameters.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

/* -- values ------------------------------------------------------------------------------------------ */

/* An expression and the parameters that its value needs: the expression is the first. */
typedef struct needed {
    kmp_reader *r;
    int count, room;
    const char **names; /* in the model */
    const kmp_yaml **nodes;
    const kmp_expr **exprs;
    double *values;
    bool *known;
} needed;

static int add(needed *n, const char *name, const kmp_yaml *node)
{
    if (!node || n->count == n->room)
        return -1;
    n->names[n->count] = name;
    n->nodes[n->count] = node;
    return n->count++;
}

/* A setting comes before the value of the file. */
static const kmp_yaml *node_of(kmp_reader *r, const char *name)
{
    const kmp_yaml *node = kmp_yaml_get(kmp_yaml_get(r->root, "parameters"), name);
    const char *set = node ? kmp_setting_of(r, name) : NULL;
    if (!set)
        return node;
    const int file = kmp_reader_add_file(r, kmp_reader_say(r, "--set %s", name));
    return file < 0 ? NULL : kmp_yaml_word(&r->scratch, (kmp_place){.line = 1, .column = 1, .file = file}, set);
}

static int find_needed(void *user, const char *name)
{
    needed *n = user;
    const char *full = kmp_reader_name(n->r, n->r->scope, name);
    for (int k = 1; k < n->count; k++)
        if (strcmp(n->names[k], full) == 0)
            return k;
    return add(n, full, node_of(n->r, full));
}

static const kmp_expr *parse(needed *n, const kmp_yaml *node, const char *what)
{
    kmp_reader *r = n->r;
    if (node->kind != KMP_YAML_SCALAR || node->empty) {
        kmp_reader_complain(r, node->place, "%s is a number or an expression of parameters", what);
        return NULL;
    }
    const kmp_expr_scope scope = {.context = r->context,
                                  .arena = &r->scratch,
                                  .file = r->model->source.files[node->text_place.file],
                                  .line = node->text_place.line,
                                  .column = node->text_place.column,
                                  .user = n,
                                  .parameter = find_needed};
    r->scope = node->text_place.file;
    const kmp_expr *expr = kmp_expr_parse(&scope, node->text);
    r->wrong = r->wrong || !expr;
    return expr;
}

static bool is_unknown(const kmp_expr *expr, const void *user)
{
    const needed *n = user;
    return expr->kind == KMP_EXPR_PARAMETER && !n->known[expr->index];
}

/* Each pass values at least one, or none can be. */
static bool value_first(needed *n)
{
    for (bool more = true; more && !n->known[0];) {
        more = false;
        for (int k = n->count; k-- > 0;) {
            if (n->known[k] || kmp_expr_find(n->exprs[k], is_unknown, n))
                continue;
            n->values[k] = kmp_expr_value(n->exprs[k], n->values);
            n->known[k] = more = true;
        }
    }
    return n->known[0];
}

static bool find_value(kmp_reader *r, const kmp_yaml *node, const char *what, double *value)
{
    const kmp_yaml *parameters = kmp_yaml_get(r->root, "parameters");
    needed n = {.r = r, .room = 1 + (parameters ? parameters->count : 0)};
    KMP_ARENA_MAKE(&r->scratch, KMP_ROOM(const char *, n.room, &n.names), KMP_ROOM(const kmp_yaml *, n.room, &n.nodes),
                   KMP_ROOM(const kmp_expr *, n.room, &n.exprs), KMP_ROOM(double, n.room, &n.values),
                   KMP_ROOM(bool, n.room, &n.known));
    if (r->scratch.failed)
        return false;
    (void)add(&n, "", node);
    for (int k = 0; k < n.count; k++)
        if (!(n.exprs[k] = parse(&n, n.nodes[k], k == 0 ? what : kmp_reader_say(r, "parameter '%s'", n.names[k]))))
            return false;
    if (!value_first(&n))
        return kmp_complain_of(r, node, what, "the parameters in '%s' depend on each other in a cycle", node->text);
    *value = n.values[0];
    if (!isfinite(*value))
        return kmp_complain_of(r, node, what, "'%s' is not finite", node->text);
    if (KMP_ARENA_GROW(&r->scratch, r->decisive, r->decisive_count))
        r->decisive[r->decisive_count++] = node;
    return !r->scratch.failed;
}

int kmp_read_repeat(kmp_reader *r, const kmp_yaml *node)
{
    double value;
    if (!find_value(r, node, "repeat of an include", &value))
        return -1;
    if (value >= 0 && value <= KMP_MOST_INCLUDES && value == floor(value))
        return (int)value;
    kmp_reader_complain(r, node->place, "repeat of an include is %.6g: it is a whole number from 0 to %d", value,
                        KMP_MOST_INCLUDES);
    return -1;
}

bool kmp_is_present(kmp_reader *r, const kmp_yaml *when)
{
    double value = 0;
    return !when || (find_value(r, when, "when", &value) && value != 0);
}

/* -- entries ----------------------------------------------------------------------------------------- */

/* An entry without `when`; of a section of expressions its `value`. */
static const kmp_yaml *without_when(kmp_reader *r, const kmp_yaml *entry)
{
    const kmp_yaml *value = kmp_yaml_get(entry, "value");
    if (value && entry->count == 2)
        return value;
    kmp_yaml *rest = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, entry->place);
    for (int k = 0; rest && k < entry->count; k++)
        if (strcmp(entry->keys[k]->text, "when") != 0)
            kmp_yaml_append(&r->scratch, rest, entry->keys[k], entry->items[k]);
    return rest ? rest : entry;
}

const kmp_yaml *kmp_present_entries(kmp_reader *r, const char *section, const kmp_yaml *map)
{
    static const char *const others[] = {"parameters", "inputs", "states", "tables", "profiles", "tracks"};
    bool any = false;
    if (!map || map->kind != KMP_YAML_MAP || kmp_name_find(KMP_NAMES_OF(others), section) >= 0)
        return map;
    for (int k = 0; k < map->count && !any; k++)
        any = kmp_yaml_get(map->items[k], "when");
    kmp_yaml *present = any ? kmp_yaml_new(&r->scratch, KMP_YAML_MAP, map->place) : NULL;
    for (int k = 0; present && k < map->count; k++) {
        const kmp_yaml *when = kmp_yaml_get(map->items[k], "when");
        if (kmp_is_present(r, when))
            kmp_yaml_append(&r->scratch, present, map->keys[k], when ? without_when(r, map->items[k]) : map->items[k]);
    }
    return present ? present : map;
}

void kmp_fix_part_counts(kmp_reader *r)
{
    for (int k = 0; k < r->decisive_count; k++) {
        double value;
        (void)kmp_read_fixed(r, r->decisive[k], "a number of parts", KMP_DIM_ANY, &value);
    }
}
