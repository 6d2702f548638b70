/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and force elements. */
#include "model/reading.h"
#include <string.h>

/* -- closures ------------------------------------------------------------------------------------ */

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

static void read_length(kmp_reader *r, const kmp_node *node, const char *what, kmp_closure *closure)
{
    const char *length_of = kmp_reader_say(r, "the length of %s", what);
    if (kmp_read_number(r, node, length_of, &closure->length) && !(closure->length.value > 0))
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

/* -- forces -------------------------------------------------------------------------------------- */

static const char *const force_keys[] = {"joint",     "torque",  "force",       "spring",
                                         "stiffness", "damping", "free_length", NULL};

static void refuse_keys(kmp_reader *r, const kmp_node *map, const char *what, const char *kind, const char *const *keys)
{
    for (int i = 0; keys[i]; i++) {
        const kmp_node *node = kmp_node_get(map, keys[i]);
        if (node)
            kmp_reader_complain(r, node->place, "%s: the key '%s' does not belong to a force with the key '%s'", what,
                                keys[i], kind);
    }
}

/* A rotation has a torque, a translation a force: the other word shows that another motion is meant. */
static const kmp_node *find_effort(kmp_reader *r, const kmp_node *map, const char *what, int motion)
{
    const kmp_node *torque = kmp_node_get(map, "torque"), *force = kmp_node_get(map, "force");
    const kmp_node *effort = torque ? torque : force;
    if (!effort || (torque && force)) {
        kmp_reader_complain(r, map->place, "%s: exactly one of the keys torque, force is wanted", what);
        return NULL;
    }
    if (motion < 0)
        return effort;
    const kmp_motion *m = &r->model->motions[motion];
    if (m->rotation != (effort == torque))
        kmp_reader_complain(r, effort->place, "%s: '%s' is a %s, which takes a '%s', not a '%s'", what, m->name,
                            m->rotation ? "rotation" : "translation", m->rotation ? "torque" : "force",
                            m->rotation ? "force" : "torque");
    return effort;
}

static void read_joint_force(kmp_reader *r, const kmp_node *map, const char *what, kmp_force *force)
{
    static const char *const others[] = {"spring", "stiffness", "damping", "free_length", NULL};
    int motion = kmp_read_motion(r, kmp_node_get(map, "joint"), what);
    const kmp_node *effort = find_effort(r, map, what, motion);
    refuse_keys(r, map, what, "joint", others);
    force->kind = KMP_FORCE_JOINT;
    force->motion = motion;
    if (effort)
        force->effort = kmp_read_effort(r, effort, what);
}

static void read_spring(kmp_reader *r, const kmp_node *map, const char *what, kmp_force *force)
{
    static const char *const others[] = {"torque", "force", NULL};
    const kmp_node *stiffness = kmp_read_required(r, map, what, "stiffness");
    const kmp_node *damping = kmp_node_get(map, "damping");
    const kmp_node *free_length = kmp_node_get(map, "free_length");
    force->kind = KMP_FORCE_SPRING;
    force->motion = -1;
    kmp_read_two_points(r, kmp_node_get(map, "spring"), what, force->point);
    refuse_keys(r, map, what, "spring", others);
    if (stiffness)
        kmp_read_number(r, stiffness, kmp_reader_say(r, "the stiffness of %s", what), &force->stiffness);
    if (damping)
        kmp_read_number(r, damping, kmp_reader_say(r, "the damping of %s", what), &force->damping);
    if (free_length)
        kmp_read_number(r, free_length, kmp_reader_say(r, "the free_length of %s", what), &force->free_length);
}

static void read_force(kmp_reader *r, const kmp_node *map, const char *what, kmp_force *force)
{
    if (!kmp_read_map(r, map, what, force_keys))
        return;
    bool joint = kmp_node_get(map, "joint"), spring = kmp_node_get(map, "spring");
    if (joint == spring)
        kmp_reader_complain(r, map->place, "%s: exactly one of the keys joint, spring is wanted, not %d", what,
                            joint + spring);
    else if (joint)
        read_joint_force(r, map, what, force);
    else
        read_spring(r, map, what, force);
}

void kmp_read_forces(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_node *map = kmp_node_get(r->root, "forces");
    if (!map || !kmp_read_map(r, map, "forces", NULL))
        return;
    model->forces = KMP_ARENA_NEW(&model->arena, kmp_force, map->count);
    for (int i = 0; model->forces && i < map->count; i++) {
        kmp_force *force = &model->forces[i];
        kmp_read_name(r, map->keys[i], "a force");
        force->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!force->name)
            return;
        force->place = map->keys[i]->place;
        model->force_count++;
        read_force(r, map->items[i], kmp_reader_say(r, "force '%s'", force->name), force);
    }
}
