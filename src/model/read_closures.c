/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures. */
#include "model/reading.h"
#include <string.h>

typedef struct closure_kind {
    const char *name;
    bool length; /* wants one */
} closure_kind;

static const closure_kind kinds[] = {{"ball", false}, {"rod", true}};

enum { KINDS = sizeof kinds / sizeof kinds[0] };

static const char *const closure_keys[] = {"ball", "rod", "length", NULL};

static void read_length(kmp_reader *r, const kmp_node *node, const char *what, kmp_closure *closure)
{
    const char *length_of = kmp_reader_say(r, "the length of %s", what);
    if (kmp_read_number(r, node, length_of, KMP_DIM_LENGTH, &closure->length) && !(closure->length.value > 0))
        kmp_reader_complain(r, node->place, "%s is %.6g: it must be positive (a ball closure has length zero)",
                            length_of, closure->length.value);
}

static const closure_kind *find_kind(kmp_reader *r, const kmp_node *map, const char *what)
{
    const closure_kind *kind = NULL;
    int found = 0;
    for (int i = 0; i < KINDS; i++)
        if (kmp_node_get(map, kinds[i].name)) {
            kind = &kinds[i];
            found++;
        }
    if (found == 1)
        return kind;
    kmp_reader_complain(r, map->place, "%s: exactly one of the keys ball, rod is wanted, not %d", what, found);
    return NULL;
}

static void read_closure(kmp_reader *r, const kmp_node *map, const char *what, kmp_closure *closure)
{
    if (!kmp_read_map(r, map, what, closure_keys))
        return;
    const closure_kind *kind = find_kind(r, map, what);
    if (!kind)
        return;
    closure->kind = kind->name;
    kmp_read_two_points(r, kmp_node_get(map, kind->name), what, closure->point);
    const kmp_node *length = kmp_node_get(map, "length");
    if (kind->length && !length)
        kmp_read_required(r, map, what, "length");
    else if (!kind->length && length)
        kmp_reader_complain(r, length->place, "%s: a %s closure has no length", what, kind->name);
    else if (length)
        read_length(r, length, what, closure);
}

void kmp_read_closures(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_node *map = kmp_node_get(r->root, "loops");
    if (!map || !kmp_read_map(r, map, "loops", NULL))
        return;
    model->closures = KMP_ARENA_NEW(&model->arena, kmp_closure, map->count);
    for (int i = 0; model->closures && i < map->count; i++) {
        kmp_closure *closure = &model->closures[i];
        kmp_read_name(r, map->keys[i], "a loop");
        closure->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!closure->name)
            return;
        closure->kind = "";
        closure->place = map->keys[i]->place;
        model->closure_count++;
        read_closure(r, map->items[i], kmp_reader_say(r, "loop '%s'", closure->name), closure);
    }
}
