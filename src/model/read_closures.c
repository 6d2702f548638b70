/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and drives. */
#include "model/reading.h"
#include <string.h>

typedef struct closure_kind {
    const char *name;
    bool length; /* wants one */
} closure_kind;

static const closure_kind kinds[] = {
#define KMP_CLOSURE(name, length) {#name, length},
#include "model/closures.def"
#undef KMP_CLOSURE
};

enum { KINDS = sizeof kinds / sizeof kinds[0] };

static const char *const closure_keys[] = {
#define KMP_CLOSURE(name, length) #name,
#include "model/closures.def"
#undef KMP_CLOSURE
    "length", NULL};

/* Of a function of time the value at t = 0 is judged. */
static void read_length(kmp_reader *r, const kmp_node *node, const char *what, kmp_closure *closure)
{
    const char *length_of = kmp_reader_say(r, "the length of %s", what);
    double first = 0;
    const kmp_expr *expr = kmp_read_function(r, node, length_of, KMP_DIM_LENGTH, &first);
    if (!expr)
        return;
    closure->length = kmp_number_of(expr, first);
    if (!kmp_expr_is_constant(expr)) {
        closure->length.expr = NULL;
        closure->function = expr;
    }
    if (!(first > 0))
        kmp_reader_complain(r, node->place, "%s is %.6g: it must be positive (a ball closure has length zero)",
                            length_of, first);
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
    const char *names = kinds[0].name;
    for (int i = 1; i < KINDS; i++)
        names = kmp_reader_say(r, "%s, %s", names, kinds[i].name);
    kmp_reader_complain(r, map->place, "%s: exactly one of the keys %s is wanted, not %d", what, names, found);
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

/* -- drives -------------------------------------------------------------------------------------- */

static const char *const drive_keys[] = {"joint", "angle", "displacement", NULL};

static void read_drive(kmp_reader *r, const kmp_node *map, const char *what, kmp_closure *drive)
{
    double first;
    if (!kmp_read_map(r, map, what, drive_keys))
        return;
    const kmp_node *joint = kmp_read_required(r, map, what, "joint");
    const kmp_node *angle = kmp_node_get(map, "angle"), *displacement = kmp_node_get(map, "displacement");
    drive->motion = joint ? kmp_read_motion(r, joint, what) : -1;
    if (!angle == !displacement) {
        kmp_reader_complain(r, map->place, "%s: exactly one of the keys angle, displacement is wanted", what);
        return;
    }
    if (drive->motion < 0)
        return;
    const kmp_motion *m = &r->model->motions[drive->motion];
    const kmp_node *given = angle ? angle : displacement;
    if (m->rotation != (angle != NULL))
        kmp_reader_complain(r, given->place, "%s: '%s' is a %s, which is driven by '%s'", what, m->name,
                            m->rotation ? "rotation" : "translation", m->rotation ? "angle" : "displacement");
    else
        drive->function = kmp_read_function(r, given, what, kmp_motion_dimension(r->model, drive->motion, 0), &first);
}

/* A coordinate has one drive. */
static void check_driven(kmp_reader *r, int number)
{
    const kmp_closure *closures = r->model->closures;
    for (int k = 0; k < number; k++)
        if (closures[number].function && closures[k].function && closures[k].motion == closures[number].motion) {
            kmp_reader_complain(r, closures[number].place, "drive '%s': '%s' is driven by '%s' already",
                                closures[number].name, r->model->motions[closures[k].motion].name, closures[k].name);
            return;
        }
}

/* -- all ----------------------------------------------------------------------------------------- */

static const kmp_closure *find_namesake(const kempe_model *model, int number)
{
    for (int k = 0; k < number; k++)
        if (strcmp(model->closures[k].name, model->closures[number].name) == 0)
            return &model->closures[k];
    return NULL;
}

static kmp_closure *add_closure(kmp_reader *r, const kmp_node *key, const char *kind)
{
    kempe_model *model = r->model;
    kmp_closure *closure = &model->closures[model->closure_count];
    kmp_read_name(r, key, kind[0] ? "a drive" : "a loop");
    *closure = (kmp_closure){.kind = kind, .place = key->place, .point = {-1, -1}, .motion = -1};
    closure->name = kmp_arena_strdup(&model->arena, key->text);
    if (!closure->name)
        return NULL;
    if (find_namesake(model, model->closure_count))
        kmp_reader_complain(r, key->place, "a drive cannot be called '%s', like a loop: lambda(%s) is one of them",
                            closure->name, closure->name);
    model->closure_count++;
    return closure;
}

static void read_loops(kmp_reader *r, const kmp_node *map)
{
    for (int i = 0; i < map->count; i++) {
        kmp_closure *closure = add_closure(r, map->keys[i], "");
        if (!closure)
            return;
        read_closure(r, map->items[i], kmp_reader_say(r, "loop '%s'", closure->name), closure);
    }
}

static void read_drives(kmp_reader *r, const kmp_node *map)
{
    for (int i = 0; i < map->count; i++) {
        kmp_closure *drive = add_closure(r, map->keys[i], "drive");
        if (!drive)
            return;
        read_drive(r, map->items[i], kmp_reader_say(r, "drive '%s'", drive->name), drive);
        check_driven(r, r->model->closure_count - 1);
    }
}

void kmp_read_closures(kmp_reader *r)
{
    const kmp_node *loops = kmp_node_get(r->root, "loops"), *drives = kmp_node_get(r->root, "drives");
    bool has_loops = loops && kmp_read_map(r, loops, "loops", NULL);
    bool has_drives = drives && kmp_read_map(r, drives, "drives", NULL);
    int count = (has_loops ? loops->count : 0) + (has_drives ? drives->count : 0);
    r->model->closures = KMP_ARENA_NEW(&r->model->arena, kmp_closure, count);
    if (!r->model->closures)
        return;
    if (has_loops)
        read_loops(r, loops);
    if (has_drives)
        read_drives(r, drives);
}
