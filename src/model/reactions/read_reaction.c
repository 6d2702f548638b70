/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction by the reaction that presses its surfaces together. The reaction of a closure is the vector of its
 * multipliers. The reaction of a joint of the tree is that of translations across its axis, which are added to its
 * chain and locked: their multipliers are its components. In a plane mechanism they stay in the plane. */
#include "linalg/dot.h"
#include "model/read/reading.h"
#include <float.h>
#include <math.h>
#include <string.h>

#define PARALLEL (16 * DBL_EPSILON)

/* -- joints of the tree ------------------------------------------------------------------------------ */

static bool is_parallel(const double a[3], const double b[3])
{
    return fabs(kmp_dot(3, a, b)) >= 1 - PARALLEL;
}

static bool is_turned(const kempe_model *model, const kmp_body *body)
{
    return body->turned || (body->at >= 0 && model->points[body->at].turned) ||
           (body->to >= 0 && model->points[body->to].turned);
}

/* The normal of a plane mechanism: all rotations are about it, no translation is along it. */
static bool find_normal(const kempe_model *model, double normal[3])
{
    bool found = false;
    for (int k = 0; k < model->motion_count && !found; k++) {
        found = model->motions[k].rotation;
        memcpy(normal, model->motions[k].axis, 3 * sizeof *normal);
    }
    for (int i = 1; i < model->body_count; i++)
        found = found && !is_turned(model, &model->bodies[i]);
    for (int k = 0; found && k < model->motion_count; k++) {
        const kmp_motion *m = &model->motions[k];
        found = m->rotation ? is_parallel(m->axis, normal) : fabs(kmp_dot(3, m->axis, normal)) <= PARALLEL;
    }
    return found;
}

/* Directions across a motion's axis in which its joint carries a load; their number. */
static int directions_of(const kempe_model *model, const kmp_motion *motion, double direction[2][3])
{
    double normal[3];
    int least = 0;
    if (find_normal(model, normal) && !motion->rotation) {
        kmp_cross3(normal, motion->axis, direction[0]);
        return 1;
    }
    for (int i = 1; i < 3; i++)
        least = fabs(motion->axis[i]) < fabs(motion->axis[least]) ? i : least;
    double other[3] = {least == 0, least == 1, least == 2}, across[3];
    kmp_cross3(motion->axis, other, across);
    double size = sqrt(kmp_dot(3, across, across));
    for (int i = 0; i < 3; i++)
        direction[0][i] = across[i] / size;
    kmp_cross3(motion->axis, direction[0], direction[1]);
    return 2;
}

/* Inserts translations at the beginning of a body's chain. */
static void insert(kmp_reader *r, int b, int count, double direction[2][3])
{
    kempe_model *model = r->model;
    kmp_body *body = &model->bodies[b];
    int first = body->first_motion, after = model->motion_count;
    kmp_motion *motions = KMP_ARENA_NEW(&model->arena, kmp_motion, after + count);
    if (!motions)
        return;
    memcpy(motions, model->motions, (size_t)first * sizeof *motions);
    memcpy(motions + first + count, model->motions + first, (size_t)(after - first) * sizeof *motions);
    for (int k = 0; k < count; k++) {
        const char *name = kmp_arena_printf(&model->arena, count == 1 ? "%s_load" : "%s_load%d", body->joint, k + 1);
        if (name && kmp_name_find(KMP_COORDINATES(model), name) >= 0)
            kmp_reader_complain(r, body->place,
                                "the name '%s' is that of the reaction of joint '%s', which has friction", name,
                                body->joint);
        motions[first + k] = (kmp_motion){.name = name ? name : "", .number = body->motion_count + 1 + k, .body = b};
        for (int i = 0; i < 3; i++)
            motions[first + k].axis[i] = direction[k][i] + 0.0; /* no negative zero */
    }
    for (int i = 1; i < model->body_count; i++)
        model->bodies[i].first_motion += i != b && model->bodies[i].first_motion >= first ? count : 0;
    model->motions = motions;
    model->motion_count += count;
    body->motion_count += count;
    body->load_count = count;
}

/* The motion of a friction with `mu` that has no closure for its reaction; -1: none, or an error that is reported
 * later. */
static int find_pressed(kmp_reader *r, const kmp_yaml *force)
{
    const kmp_yaml *joint = kmp_yaml_get(force, "joint"), *friction = kmp_yaml_get(force, "friction");
    bool pressed = joint && joint->kind == KMP_YAML_SCALAR && friction && friction->kind == KMP_YAML_MAP &&
                   kmp_yaml_get(friction, "mu") && !kmp_yaml_get(friction, "reaction");
    return pressed ? kmp_name_find(KMP_COORDINATES(r->model), kmp_reader_name(r, joint->place.file, joint->text)) : -1;
}

void kmp_read_pressed(kmp_reader *r)
{
    const kmp_yaml *forces = kmp_yaml_get(r->root, "forces");
    for (int i = 0; forces && forces->kind == KMP_YAML_MAP && i < forces->count; i++) {
        double direction[2][3];
        int motion = forces->items[i]->kind == KMP_YAML_MAP ? find_pressed(r, forces->items[i]) : -1;
        if (motion < 0 || r->model->bodies[r->model->motions[motion].body].motion_count != 1)
            continue;
        int count = directions_of(r->model, &r->model->motions[motion], direction);
        insert(r, r->model->motions[motion].body, count, direction);
    }
}

int kmp_count_pressed(const kempe_model *model)
{
    int count = 0;
    for (int i = 1; i < model->body_count; i++)
        count += model->bodies[i].load_count;
    return count;
}

void kmp_lock_pressed(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int i = 1; i < model->body_count; i++) {
        kmp_body *body = &model->bodies[i];
        body->load_closure = model->closure_count;
        for (int k = 0; k < body->load_count; k++)
            model->closures[model->closure_count++] = (kmp_closure){.name = model->motions[body->first_motion + k].name,
                                                                    .kind = "lock",
                                                                    .place = body->place,
                                                                    .point = {-1, -1},
                                                                    .motion = body->first_motion + k};
    }
}

/* -- the size of a reaction ---------------------------------------------------------------------------- */

static const kmp_expr *size_of(kmp_reader *r, int closure, int count)
{
    kmp_expr *size = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (size)
        *size = (kmp_expr){.kind = KMP_EXPR_LAMBDA, .index = closure, .number = -count};
    return size;
}

/* The closure that a friction names. */
static const kmp_expr *read_closure(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const kempe_model *model = r->model;
    const char *name = kmp_read_word(r, node, what);
    if (!name)
        return NULL;
    int closure = kmp_name_find(KMP_NAMED(model, closure), kmp_reader_name(r, node->place.file, name));
    if (closure < 0)
        kmp_reader_complain(r, node->place, "%s: unknown loop '%s'", what, name);
    else if (kmp_closure_force_rows(&model->closures[closure]) == 0)
        kmp_reader_complain(r, node->place, "%s: the reaction of a %s has no size that presses surfaces together", what,
                            model->closures[closure].kind);
    else
        return size_of(r, closure, 1);
    return NULL;
}

const kmp_expr *kmp_read_reaction(kmp_reader *r, const kmp_force *force, const kmp_yaml *map, const char *what)
{
    const kmp_yaml *node = kmp_yaml_get(map, "reaction");
    const kempe_model *model = r->model;
    if (node)
        return read_closure(r, node, what);
    const kmp_body *body = force->motion >= 0 ? &model->bodies[model->motions[force->motion].body] : NULL;
    if (body && body->load_count > 0)
        return size_of(r, body->load_closure, body->load_count);
    kmp_reader_complain(r, map->place,
                        "%s: mu needs the reaction of a joint with one coordinate, or of a loop by the key 'reaction'",
                        what);
    return NULL;
}
