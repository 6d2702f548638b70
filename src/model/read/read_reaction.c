/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction by the reaction that presses its surfaces together. The reaction of a closure is the vector of its
 * multipliers. The reaction of a joint of the tree is the force of translations across its axis, which are added to its
 * chain and locked: their multipliers are its components. Rows of closures that only these translations move carry
 * nothing (dynamics/closures.c), so that a joint of a plane mechanism carries what presses it across the plane. */
#include "model/read/read_reaction.h"
#include "linalg/dense/dot.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/read/read_closures.h"
#include "model/read/read_flexible.h"
#include "model/read/read_include.h"
#include "model/read/reading.h"
#include <float.h>
#include <math.h>
#include <string.h>

#define PARALLEL (16 * DBL_EPSILON)

enum { DIRECTIONS = 3 };

/* -- joints of the tree ------------------------------------------------------------------------------ */

static bool is_parallel(const double a[3], const double b[3])
{
    return fabs(kmp_dot(3, a, b)) >= 1 - PARALLEL;
}

/* True if every entry of a section has one of these keys. */
static bool has_only(const kmp_yaml *section, int count, const char *const keys[])
{
    bool only = true;
    for (int i = 0; section && i < section->count && only; i++) {
        only = false;
        for (int k = 0; k < count; k++)
            only = only || kmp_yaml_get(section->items[i], keys[k]);
    }
    return only;
}

/* True if no section has what can push a body along the normal of a plane mechanism: forces are efforts on coordinates,
 * closures join points that stay at one height. */
static bool pushes_in_plane(const kmp_yaml *root)
{
    static const char *const joints[] = {"joint"}, *const closures[] = {"ball", "revolute", "prismatic", "coupler"};
    return !kmp_yaml_get(root, "wheels") && has_only(kmp_yaml_get(root, "forces"), 1, joints) &&
           has_only(kmp_yaml_get(root, "contacts"), 1, joints) && has_only(kmp_yaml_get(root, "loops"), 4, closures) &&
           has_only(kmp_yaml_get(root, "joints"), 4, closures);
}

/* True if gravity, or a force at a point, has a component along the normal. */
static bool is_pressed(const kempe_model *model, const kmp_yaml *root, const double normal[3])
{
    const kmp_yaml *forces = kmp_yaml_get(root, "forces");
    bool pressed = false;
    for (int i = 0; i < 3; i++) {
        pressed = pressed || normal[i] * model->gravity[i].value != 0;
        for (int k = 0; normal[i] != 0 && forces && k < forces->count; k++) {
            const kmp_yaml *force = kmp_yaml_get(forces->items[k], "force");
            bool given = force && force->kind == KMP_YAML_LIST && force->count == 3;
            pressed = pressed || (given && strcmp(force->items[i]->text, "0") != 0);
        }
    }
    return pressed;
}

/* The normal of a plane mechanism: all rotations are about it, no translation is along it. *pressed: gravity or
 * something else may push along it. */
static bool find_normal(const kmp_reader *r, double normal[3], bool *pressed)
{
    const kempe_model *model = r->model;
    bool found = false;
    for (int k = 0; k < model->motion_count && !found; k++) {
        found = model->motions[k].rotation;
        memcpy(normal, model->motions[k].axis, 3 * sizeof *normal);
    }
    *pressed = !pushes_in_plane(r->root);
    for (int i = 0; i < 3; i++)
        *pressed = *pressed || normal[i] * model->gravity[i].value != 0 || (normal[i] != 0 && model->gravity[i].expr);
    for (int i = 1; i < model->body_count; i++) {
        const kmp_body *b = &model->bodies[i];
        bool turned =
            b->turned || (b->at >= 0 && model->points[b->at].turned) || (b->to >= 0 && model->points[b->to].turned);
        found = found && !turned && kmp_flexible_in_plane(r, i, normal);
    }
    for (int k = 0; found && k < model->motion_count; k++) {
        const kmp_motion *m = &model->motions[k];
        found = m->rotation ? is_parallel(m->axis, normal) : fabs(kmp_dot(3, m->axis, normal)) <= PARALLEL;
    }
    return found;
}

/* Two directions across a unit vector; one across it and the normal of a plane mechanism. Their number. */
static int find_across(const double axis[3], const double *normal, double direction[][3])
{
    int least = 0;
    if (normal) {
        kmp_cross3(normal, axis, direction[0]);
        return 1;
    }
    for (int i = 1; i < 3; i++)
        least = fabs(axis[i]) < fabs(axis[least]) ? i : least;
    double other[3] = {least == 0, least == 1, least == 2}, across[3];
    kmp_cross3(axis, other, across);
    double size = sqrt(kmp_dot(3, across, across));
    for (int i = 0; i < 3; i++)
        direction[0][i] = across[i] / size;
    kmp_cross3(axis, direction[0], direction[1]);
    return 2;
}

static int find_free(const kempe_model *model, const kmp_body *body, bool rotation, const double *axis[])
{
    int count = 0;
    for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++)
        if (model->motions[k].rotation == rotation && count < DIRECTIONS)
            axis[count++] = model->motions[k].axis;
    return count;
}

static bool all_parallel(int count, const double *const axis[], const double e[3])
{
    bool parallel = true;
    for (int k = 0; k < count; k++)
        parallel = parallel && is_parallel(axis[k], e);
    return parallel;
}

/* Directions in which a joint carries a load, at the beginning of its chain; their number. They are across all its
 * translations. The translations of a pin are across its axis. Rotations before them must not turn them. `normal`: of a
 * plane mechanism in which nothing pushes along it; NULL: it is in space. */
static int directions_of(const kempe_model *model, const kmp_body *body, const double *normal,
                         double direction[DIRECTIONS][3])
{
    const double *slide[DIRECTIONS], *turn[DIRECTIONS];
    int slides = find_free(model, body, false, slide), turns = find_free(model, body, true, turn);
    bool turned = slides > 0 && model->motions[body->first_motion].rotation;
    if (body->coupling || kmp_joint_obstacle(model, (int)(body - model->bodies)) || slides > 2)
        return 0;
    if (slides == 2) {
        kmp_cross3(slide[0], slide[1], direction[0]);
        double size = sqrt(kmp_dot(3, direction[0], direction[0]));
        for (int i = 0; i < 3; i++)
            direction[0][i] /= size;
        return !turned || all_parallel(turns, turn, direction[0]);
    }
    if (slides == 1)
        return turned && !all_parallel(turns, turn, slide[0]) ? 0 : find_across(slide[0], normal, direction);
    if (all_parallel(turns, turn, turn[0]))
        return find_across(turn[0], NULL, direction);
    for (int k = 0; k < 9; k++)
        direction[k / 3][k % 3] = k / 3 == k % 3;
    return DIRECTIONS;
}

/* Inserts translations at the beginning of a body's chain. */
static void insert(kmp_reader *r, int b, int count, double direction[DIRECTIONS][3])
{
    kempe_model *model = r->model;
    kmp_body *body = &model->bodies[b];
    int first = body->first_motion, after = model->motion_count;
    kmp_motion *motions = model->motions;
    for (int k = 0; k < count; k++) /* the list keeps room for the ones that follow */
        if (!(motions = kmp_arena_room(&model->arena, motions, after + k, sizeof *motions)))
            return;
    memmove(motions + first + count, motions + first, (size_t)(after - first) * sizeof *motions);
    for (int k = 0; k < count; k++) {
        const char *name = kmp_arena_printf(&model->arena, count == 1 ? "%s_load" : "%s_load%d", body->joint, k + 1);
        if (name && kmp_name_find(KMP_COORDINATES(model), name) >= 0)
            kmp_reader_complain(r, body->place, "the reaction of joint '%s', which has friction, has the name '%s'",
                                name, body->joint);
        motions[first + k] = (kmp_motion){.name = name ? name : "", .number = body->motion_count + 1 + k, .body = b};
        for (int i = 0; i < 3; i++)
            motions[first + k].axis[i] = direction[k][i] + 0.0; /* no negative zero */
    }
    for (int i = 1; i < model->body_count; i++)
        model->bodies[i].first_motion += i != b && model->bodies[i].first_motion >= first ? count : 0;
    model->motions = motions;
    model->motion_count += count;
    r->motions = (kmp_name_index){0}; /* those after the new ones have other numbers */
    body->motion_count += count;
    body->load_count = count;
}

/* The body of the joint of the tree whose reaction a friction with `mu` has; -1: it has the reaction of a closure, or
 * there is an error that is reported later. */
static int find_pressed(kmp_reader *r, const kmp_yaml *force)
{
    const kempe_model *model = r->model;
    const kmp_yaml *friction = kmp_yaml_get(force, "friction"), *node = kmp_yaml_get(force, "joint");
    const kmp_yaml *reaction = kmp_yaml_get(friction, "reaction");
    if (!friction || friction->kind != KMP_YAML_MAP || !kmp_yaml_get(friction, "mu"))
        return -1;
    node = reaction ? reaction : node;
    if (!node || node->kind != KMP_YAML_SCALAR)
        return -1;
    const char *name = kmp_reader_name(r, node->place.file, node->text);
    if (reaction)
        return kmp_yaml_get(kmp_yaml_get(r->root, "loops"), name) ? -1 : kmp_joint_find(model, name);
    int motion = kmp_name_find(KMP_COORDINATES(model), name);
    return motion >= 0 ? model->motions[motion].body : kmp_joint_find(model, name);
}

void kmp_read_pressed(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_yaml *forces = kmp_yaml_get(r->root, "forces");
    double normal[3] = {0};
    bool pressed, plane = find_normal(r, normal, &pressed);
    model->pressed_plane = plane && is_pressed(model, r->root, normal);
    for (int i = 0; forces && forces->kind == KMP_YAML_MAP && i < forces->count; i++) {
        double direction[DIRECTIONS][3];
        int body = forces->items[i]->kind == KMP_YAML_MAP ? find_pressed(r, forces->items[i]) : -1;
        if (body < 0 || model->bodies[body].load_count > 0)
            continue;
        int count = directions_of(model, &model->bodies[body], plane && !pressed ? normal : NULL, direction);
        if (count > 0)
            insert(r, body, count, direction);
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
        for (int k = body->first_motion; k < body->first_motion + body->load_count; k++)
            kmp_add_closure(r, model->motions[k].name, KMP_CLOSURE_lock, body->place)->motion = k;
    }
}

/* -- the size of a reaction ---------------------------------------------------------------------------- */

static const kmp_expr *size_of(kmp_reader *r, int closure, int count)
{
    return kmp_expr_make(&r->model->arena, (kmp_expr){.kind = KMP_EXPR_LAMBDA, .index = closure, .number = -count});
}

/* The reason why a joint of the tree has no locks. */
static const char *obstacle_of(const kempe_model *model, const kmp_body *body)
{
    const char *obstacle = kmp_joint_obstacle(model, (int)(body - model->bodies));
    const double *axis[DIRECTIONS];
    return obstacle                                           ? obstacle
           : body->coupling                                   ? "it has a thread"
           : find_free(model, body, false, axis) < DIRECTIONS ? "its rotations come before its translations"
                                                              : "it carries no force";
}

/* Of a joint of the tree. */
static const kmp_expr *size_of_joint(kmp_reader *r, kmp_place place, int b, const char *what)
{
    const kmp_body *body = b >= 0 ? &r->model->bodies[b] : NULL;
    if (body && body->load_count > 0)
        return size_of(r, body->load_closure, body->load_count);
    if (body)
        kmp_reader_complain(r, place, "%s: mu needs the reaction of joint '%s', which is not known: %s", what,
                            body->joint, obstacle_of(r->model, body));
    else
        kmp_reader_complain(r, place, "%s: mu needs the reaction of a joint or of a loop by the key 'reaction'", what);
    return NULL;
}

/* The closure, or the joint of the tree, that a friction names. */
static const kmp_expr *read_named(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const kempe_model *model = r->model;
    const char *name = kmp_read_word(r, node, what);
    if (!name)
        return NULL;
    const char *full = kmp_reader_name(r, node->place.file, name);
    int closure = kmp_name_find(KMP_NAMED(model, closure), full), body = kmp_joint_find(model, full);
    if (closure < 0 && body >= 0)
        return size_of_joint(r, node->place, body, what);
    if (closure < 0 && r->unread)
        return NULL;
    if (closure < 0)
        kmp_complain_of(r, node, what, "unknown loop or joint '%s'", name);
    else if (kmp_closure_row_of(&model->closures[closure])->pressing == 0)
        kmp_complain_of(r, node, what, "the reaction of a %s has no size that presses surfaces together",
                        kmp_closure_word(&model->closures[closure]));
    else
        return size_of(r, closure, 1);
    return NULL;
}

const kmp_expr *kmp_read_reaction(kmp_reader *r, const kmp_force *force, const kmp_yaml *map, const char *what)
{
    const kmp_yaml *node = kmp_yaml_get(map, "reaction");
    int body = force->motion >= 0 ? r->model->motions[force->motion].body : -1;
    return node ? read_named(r, node, what) : size_of_joint(r, map->place, body, what);
}
