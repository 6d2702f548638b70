/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies: their joints, their order and their points. The tree comes from the joints' `at`; parents are put before
 * their children, the file's order kept otherwise. */
#include "model/read/read_bodies.h"
#include "model/data/model.h"
#include "model/language/number_algebra.h"
#include "model/read/read_flexible.h"
#include "model/read/read_include.h"
#include "model/read/read_linkage.h"
#include "model/read/read_mass.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "model/read/segments.h"
#include <math.h>
#include <string.h>

/* -- joints of bodies -------------------------------------------------------------------------------- */

/* Joints as chains of elementary motions: a row of joints.def with its axis, or the chain written out. */

/* The keys that determine the kind of joint: its name, or the motions. */
static const char *const kinds[] = {
#define KMP_JOINT(name, chain) #name,
#include "model/data/joints.def"
#undef KMP_JOINT
    "motions"};

static const kmp_key joint_keys[] = {
#define KMP_JOINT(name, chain) {#name, "", ""},
#include "model/data/joints.def"
#undef KMP_JOINT
#define KMP_COUPLING_NUMBER(kind, joint_key, unit, ...) {#joint_key, unit, ""},
#include "model/data/closure_numbers.def"
#include "model/keys/joint_keys.def"
    {0}};

bool kmp_reader_add_motion(kmp_reader *r, kmp_motion motion)
{
    kempe_model *model = r->model;
    if (!KMP_ARENA_GROW(&model->arena, model->motions, model->motion_count))
        return false;
    model->motions[model->motion_count++] = motion;
    return true;
}

static void add_motion(kmp_reader *r, int body, bool rotation, const double axis[3])
{
    const kmp_motion motion = {.name = "", .body = body, .rotation = rotation, .axis = {axis[0], axis[1], axis[2]}};
    r->model->bodies[body].motion_count += kmp_reader_add_motion(r, motion);
}

/* Replaces a motion that could not be read, so that references to it cause no further errors. */
static void add_stand_in(kmp_reader *r, int body, bool rotation)
{
    static const double z[3] = {0, 0, 1};
    add_motion(r, body, rotation, z);
}

/* -- chains -------------------------------------------------------------------------------------- */

/* R1 .. R3, T1 .. T3, with or without a minus. */
static bool read_code(const char *text, bool *rotation, double axis[3])
{
    double sign = text[0] == '-' ? -1 : 1;
    const char *code = text + (text[0] == '-');
    if ((code[0] != 'R' && code[0] != 'T') || code[1] < '1' || code[1] > '3' || code[2] != '\0')
        return false;
    *rotation = code[0] == 'R';
    axis[0] = axis[1] = axis[2] = 0;
    axis[code[1] - '1'] = sign;
    return true;
}

static void read_one_motion(kmp_reader *r, const kmp_yaml *node, const char *what, int body)
{
    bool rotation = false;
    double axis[3];
    if (node->kind == KMP_YAML_MAP && node->count == 1 &&
        (strcmp(node->keys[0]->text, "R") == 0 || strcmp(node->keys[0]->text, "T") == 0)) {
        rotation = node->keys[0]->text[0] == 'R';
        if (kmp_read_axis(r, node->items[0], what, axis))
            add_motion(r, body, rotation, axis);
        else
            add_stand_in(r, body, rotation);
        return;
    }
    if (node->kind == KMP_YAML_SCALAR && read_code(node->text, &rotation, axis)) {
        add_motion(r, body, rotation, axis);
        return;
    }
    kmp_complain_of(r, node, what,
                    "a motion is R1, R2, R3, T1, T2, T3, one of them with a minus, {R: axis} or {T: axis}%s%s%s",
                    node->text[0] ? ", not '" : "", node->text, node->text[0] ? "'" : "");
    add_stand_in(r, body, !strchr(node->text, 'T'));
}

/* Two axes [a, b], which are perpendicular to each other. */
static void read_two_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3])
{
    double a[3], b[3], square[3][3];
    if (!kmp_read_axis(r, node->items[0], what, a) || !kmp_read_axis(r, node->items[1], what, b))
        return;
    if (fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > 1e-6)
        kmp_complain_of(r, node, what, "the two axes are not perpendicular to each other");
    else if (kmp_square_axes(0, a, 1, b, square))
        memcpy(m, square, sizeof square);
}

/* The columns of m are a, b and c of the chain. */
void kmp_read_chain_axes(kmp_reader *r, const char *chain, const kmp_yaml *node, const char *what, double m[3][3])
{
    double axis[3], own[3][3];
    int first = 2;
    if (node->kind == KMP_YAML_LIST && node->count == 2 && strchr(chain, 'b')) {
        read_two_axes(r, node, what, m);
        return;
    }
    if (!kmp_read_axis(r, node, what, axis))
        return;
    for (int k = 0; k < 3; k++)
        if (fabs(axis[k]) == 1)
            first = k;
    kmp_complete_axes(first, axis, own);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[i][k] = own[i][(first + k) % 3];
}

void kmp_check_joint_keys(kmp_reader *r, const kmp_joint_row *row, const kmp_yaml *joint, const char *what)
{
    for (int k = 0; k < kmp_joint_names.count; k++) {
        const kmp_joint_row *other = &kmp_joint_rows[k];
        const kmp_yaml *node = kmp_joint_key(other) ? kmp_yaml_get(joint, kmp_joint_key(other)) : NULL;
        if (node && other != row)
            kmp_complain_of(r, node, what, "only a %s has a %s", other->name, kmp_joint_key(other));
    }
}

static void read_armature(kmp_reader *r, const kmp_yaml *joint, const char *what, kmp_body *body)
{
    const kmp_yaml *node = kmp_yaml_get(joint, "armature");
    if (!node)
        return;
    if (body->motion_count != 1) {
        kmp_complain_of(r, node, what, "only a joint with one coordinate has an armature");
        return;
    }
    kmp_dimension unit = r->model->motions[body->first_motion].rotation ? KMP_DIM(2, 1, 0) : KMP_DIM(0, 1, 0);
    (void)kmp_read_ruled(r, node, kmp_reader_say(r, "the armature of %s", what), unit, KMP_FIELD_NOT_NEGATIVE,
                         &body->armature);
}

/* The one key that determines the kind of joint. */
static void read_kind(kmp_reader *r, const kmp_yaml *joint, const char *what, int body)
{
    int kind = -1, count = kmp_count_keys(joint, KMP_NAMES_OF(kinds), &kind);
    const kmp_joint_row *row = kind >= 0 && kind < kmp_joint_names.count ? &kmp_joint_rows[kind] : NULL;
    if (row) {
        const char *chain = row->chain;
        const kmp_yaml *node = kmp_yaml_get(joint, row->name);
        double m[3][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
        if (!chain[0] && !kmp_is_word(node, "yes"))
            kmp_complain_of(r, node, what, "a joint without motions is written with the value 'yes'");
        if (chain[0])
            kmp_read_chain_axes(r, chain, node, what, m);
        for (; chain[0] && chain[0] != '='; chain += 2) {
            double axis[3];
            for (int i = 0; i < 3; i++)
                axis[i] = m[i][chain[1] - 'a'];
            add_motion(r, body, chain[0] == 'R', axis);
        }
    } else if (count > 0) {
        const kmp_yaml *motions = kmp_yaml_get(joint, "motions");
        bool good = kmp_read_list(r, motions, kmp_reader_say(r, "%s: motions", what), -1);
        if (good && motions->count == 0)
            kmp_complain_of(r, motions, what, "a joint needs at least one motion");
        for (int i = 0; good && i < motions->count; i++)
            read_one_motion(r, motions->items[i], what, body);
    }
    kmp_check_joint_keys(r, row, joint, what);
    const char *key = row ? kmp_joint_key(row) : NULL; /* of the number that couples two motions */
    const kmp_yaml *number = key ? kmp_read_required(r, joint, what, key) : NULL;
    r->model->bodies[body].coupling = key ? row : NULL;
    if (number)
        kmp_read_number(r, number, kmp_reader_say(r, "the %s of %s", key, what), kmp_key_dimension(joint_keys, key),
                        &r->model->bodies[body].number);
    read_armature(r, joint, what, &r->model->bodies[body]);
    if (count != 1)
        kmp_complain_keys(r, joint->place, what, KMP_NAMES_OF(kinds), count);
    if (count == 0)
        add_stand_in(r, body, true);
}

/* -- joints -------------------------------------------------------------------------------------- */

/* The inverse X1(q1) X2(q2) .. of a chain is .. X2(-q2) X1(-q1): the last motion first, about the opposite axis.
 * Motions that are all about and along one axis keep their order. */
static void reverse_chain(kmp_motion *motions, int count)
{
    bool turn = false;
    for (int k = 1; k < count; k++)
        turn = turn || memcmp(motions[k].axis, motions[0].axis, sizeof motions[0].axis) != 0;
    for (int k = 0; k < count / 2 && turn; k++) {
        kmp_motion last = motions[count - 1 - k];
        motions[count - 1 - k] = motions[k];
        motions[k] = last;
    }
    for (int k = 0; k < count; k++)
        for (int i = 0; i < 3; i++)
            motions[k].axis[i] = 0 - motions[k].axis[i];
}

/* The given name of coordinate k of a joint, which its names leave out by `~`; otherwise its own. */
static const char *coordinate_name(kmp_reader *r, const kmp_body *body, const kmp_yaml *names, int k)
{
    const kmp_yaml *node = names && k < names->count ? names->items[k] : NULL;
    if (node && strcmp(node->text, "~") != 0) {
        const char *given = kmp_read_name(r, node, kmp_reader_say(r, "a coordinate of joint '%s'", body->joint));
        if (given)
            return kmp_reader_name(r, node->place.file, given);
    }
    return body->motion_count == 1 ? body->joint : kmp_reader_say(r, "%s.%d", body->joint, k + 1);
}

static void check_coordinate(kmp_reader *r, const kmp_body *body, const kmp_yaml *names, int k)
{
    const kempe_model *model = r->model;
    const char *name = model->motions[k].name;
    kmp_place place = names->items[k - body->first_motion]->place;
    for (int i = 1; i <= body - model->bodies; i++)
        if (&model->bodies[i] != body && strcmp(model->bodies[i].joint, name) == 0)
            kmp_reader_complain(r, place, "the coordinate '%s' of joint '%s' has the name of another joint", name,
                                body->joint);
    for (int i = 0; i < k; i++)
        if (strcmp(model->motions[i].name, name) == 0)
            kmp_reader_complain(r, place, "the coordinate '%s' of joint '%s' has the name of one of joint '%s'", name,
                                body->joint, model->bodies[model->motions[i].body].joint);
}

/* Names and numbers that the motions have before a chain is reversed. */
static void name_motions(kmp_reader *r, const kmp_body *body, const kmp_yaml *names)
{
    const char *what = kmp_reader_say(r, "the coordinates of joint '%s'", body->joint);
    if (names && !kmp_read_list(r, names, what, body->motion_count))
        names = NULL;
    for (int k = 0; k < body->motion_count; k++) {
        kmp_motion *motion = &r->model->motions[body->first_motion + k];
        const char *kept = kmp_arena_strdup(&r->model->arena, coordinate_name(r, body, names, k));
        motion->name = kept ? kept : "";
        motion->number = k + 1;
    }
    for (int k = 0; k < body->motion_count && names; k++)
        check_coordinate(r, body, names, body->first_motion + k);
}

static void check_unique(kmp_reader *r, kmp_place place, int body)
{
    const kmp_body *bodies = r->model->bodies;
    if (kmp_linkage_find(r, bodies[body].joint) != KMP_LINKED_NOT)
        return;
    const kmp_name_list joints = {&bodies[1].joint, sizeof *bodies, body};
    int i = 1 + kmp_index_find(&r->joints, &r->scratch, joints, -1, 0, bodies[body].joint);
    if (i > 0 && i < body && strcmp(bodies[i].name, bodies[body].name) != 0) {
        kmp_reader_complain(r, place, "duplicate joint '%s': it is also the joint of body '%s'", bodies[i].joint,
                            bodies[i].name);
        return;
    }
    int k = kmp_index_find(&r->motions, &r->scratch, KMP_COORDINATES(r->model), -1, 0, bodies[body].joint);
    if (k >= 0 && strcmp(bodies[r->model->motions[k].body].joint, bodies[body].joint) != 0)
        kmp_reader_complain(r, place, "the joint '%s' has the name of a coordinate of joint '%s'", bodies[body].joint,
                            bodies[r->model->motions[k].body].joint);
}

static void read_joint(kmp_reader *r, const kmp_yaml *joint, int i)
{
    kmp_body *body = &r->model->bodies[i];
    const char *linked = kmp_linkage_what(r, joint), *linked_name = kmp_linkage_name(r, joint);
    const char *what = linked ? linked : kmp_reader_say(r, "the joint of body '%s'", body->name);
    body->first_motion = r->model->motion_count;
    body->loads_parent = kmp_linkage_loads_parent(r, joint);
    if (!joint)
        return;
    if (joint->kind != KMP_YAML_MAP) {
        kmp_reader_complain(r, joint->place, "%s must be a mapping such as {revolute: z, at: ground}", what);
        return;
    }
    kmp_read_map(r, joint, what, joint_keys);
    const kmp_yaml *name = kmp_yaml_get(joint, "name");
    const char *given = name ? kmp_read_name(r, name, "a joint") : NULL;
    given = given ? kmp_reader_name(r, name->place.file, given) : linked_name;
    const char *kept = given ? kmp_arena_strdup(&r->model->arena, given) : NULL;
    body->joint = kept ? kept : body->joint;
    check_unique(r, name ? name->place : body->place, i);
    const kmp_yaml *frame = kmp_yaml_get(joint, "frame");
    body->turned = frame && kmp_read_axes(r, frame, kmp_reader_say(r, "the frame of %s", what), body->frame);
    read_kind(r, joint, what, i);
    name_motions(r, body, kmp_yaml_get(joint, "coordinates"));
    const kmp_yaml *reversed = kmp_yaml_get(joint, "reversed");
    body->reversed = kmp_is_word(reversed, "yes");
    if (reversed && !body->reversed)
        kmp_complain_of(r, reversed, what, "reversed is 'yes' or absent");
    if (body->reversed && body->motion_count > 0)
        reverse_chain(&r->model->motions[body->first_motion], body->motion_count);
}

/* A body in its order of the file. */
typedef struct source {
    const char *name;
    const kmp_yaml *key, *map, *joint, *at, *to;
    int parent; /* source, -1 the ground */
    bool placed;
} source;

typedef struct sources {
    kmp_reader *r;
    source *list;
    int count;
    int *order; /* of the sources in the model, parents first */
    int placed;
    kmp_name_index names;
} sources;

static const kmp_key ground_keys[] = {
#include "model/keys/ground_keys.def"
    {0}};
const kmp_key kmp_body_keys[] = {
#include "model/keys/body_keys.def"
    {0}};

static bool take_sources(sources *s, const kmp_yaml *map)
{
    kmp_reader *r = s->r;
    s->list = KMP_ARENA_NEW(&r->scratch, source, map->count);
    s->order = KMP_ARENA_NEW(&r->scratch, int, map->count);
    if (!s->list || !s->order)
        return false;
    for (int i = 0; i < map->count; i++) {
        const char *what = kmp_reader_say(r, "body '%s'", map->keys[i]->text);
        source *to = &s->list[i];
        to->name = map->keys[i]->text;
        to->key = map->keys[i];
        to->map = map->items[i];
        to->parent = -1;
        const char *name = kmp_read_name(r, to->key, "a body");
        if (name && strcmp(name, "ground") == 0)
            kmp_reader_complain(r, to->key->place, "'ground' exists already: its points are under the key 'ground'");
        const kmp_include_instance *instance = kmp_reader_instance(r, to->key->place.file);
        if (name && instance && instance->ports && strcmp(name + strlen(instance->prefix), "port") == 0)
            kmp_reader_complain(r, to->key->place, "a body of a file with ports cannot have the name 'port'");
        if (!kmp_read_map(r, to->map, what, kmp_body_keys))
            continue;
        to->joint = r->linkage  ? kmp_linkage_joint(r->linkage, i + 1)
                    : r->unread ? kmp_yaml_get(to->map, "joint")
                                : kmp_read_required(r, to->map, what, "joint");
        if (to->joint && to->joint->kind == KMP_YAML_MAP)
            to->at = kmp_read_required(r, to->joint, kmp_reader_say(r, "the joint of %s", what), "at");
        to->to = kmp_yaml_get(to->joint, "to");
    }
    s->count = map->count;
    return true;
}

/* -- order --------------------------------------------------------------------------------------- */

/* Names an end of a joint in messages. */
static const char *what_of(kmp_reader *r, const kmp_yaml *joint, const char *end, const char *body)
{
    const char *linked = kmp_linkage_name(r, joint) ? kmp_linkage_what(r, joint) : NULL;
    return linked ? linked : kmp_reader_say(r, "'%s' of body '%s'", end, body);
}

static void find_parent(sources *s, source *child)
{
    kmp_reader *r = s->r;
    const char *what = what_of(r, child->joint, "at", child->name);
    const char *text = child->at ? kmp_read_word(r, child->at, what) : NULL;
    if (!text)
        return;
    const char *said = kmp_reader_say(r, "%.*s", (int)strcspn(text, "."), text);
    const char *name = kmp_reader_body_name(r, child->at->place.file, said);
    if (strcmp(name, "ground") == 0)
        return;
    child->parent = kmp_index_find(&s->names, &r->scratch, KMP_NAMES(s->list, s->count), -1, 0, name);
    if (child->parent >= 0)
        return;
    kmp_nearest nearest = kmp_nearest_begin(name);
    kmp_nearest_offer(&nearest, "ground");
    kmp_nearest_offer_all(&nearest, KMP_NAMES(s->list, s->count));
    if (strcmp(said, "ground") != 0) /* otherwise the include is in error, which puts it on no body */
        kmp_reader_complain_unknown(r, child->at->place, &nearest, "%s: unknown body '%s'", what, said);
    child->at = NULL;
}

static int parent_of(const void *user, int i)
{
    return ((const source *)user)[i].parent;
}

/* Reports that a body is its own ancestor. The cycle is cut at its first body in the file, so that it is reported once.
 */
static void cut_circle(sources *s, int i)
{
    int steps = 0, first;
    while (i >= 0 && !s->list[i].placed && steps <= s->count) {
        i = s->list[i].parent;
        steps++;
    }
    if (steps <= s->count)
        return;
    const char *chain = kmp_reader_cycle(s->r, KMP_NAMES(s->list, s->count), parent_of, s->list, i, &first);
    kmp_reader_complain(s->r, s->list[first].at->place, "bodies are attached to each other in a cycle: %s", chain);
    s->list[first].parent = -1;
    s->list[first].at = NULL;
}

/* Places body i after its ancestors: the path to the root is written from the end of the free part of `order`. */
static void place(sources *s, int i)
{
    int top = s->count;
    cut_circle(s, i);
    for (; i >= 0 && !s->list[i].placed; i = s->list[i].parent) {
        s->list[i].placed = true;
        s->order[--top] = i;
    }
    memmove(s->order + s->placed, s->order + top, (size_t)(s->count - top) * sizeof *s->order);
    s->placed += s->count - top;
}

/* -- bodies -------------------------------------------------------------------------------------- */

static bool make_bodies(sources *s)
{
    kempe_model *model = s->r->model;
    for (int k = 0; k < s->count; k++) {
        const source *from = &s->list[s->order[k]];
        kmp_body *body = &model->bodies[k + 1];
        body->name = kmp_arena_strdup(&model->arena, from->name);
        body->joint = body->name;
        body->place = from->key->place;
        body->at = body->to = -1;
        if (!body->name)
            return false;
    }
    model->body_count = s->count + 1;
    int *place = KMP_ARENA_NEW(&s->r->scratch, int, s->count); /* of a source among the bodies */
    for (int k = 0; place && k < s->count; k++)
        place[s->order[k]] = k + 1;
    for (int k = 0; place && k < s->count; k++) {
        int parent = s->list[s->order[k]].parent;
        model->bodies[k + 1].parent = parent >= 0 ? place[parent] : 0;
    }
    return place;
}

/* BODY.POINT, or -1 for a body's origin. */
static int resolve_end(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const kmp_include_instance *instance = node ? kmp_reader_instance(r, node->place.file) : NULL;
    if (instance && strcmp(node->text, "ground") == 0)
        return instance->ground;
    return node && strchr(node->text, '.') ? kmp_read_point_text(r, node->place, node->text, what) : -1;
}

/* The body's own end: one of its points, or BODY.POINT. */
static int resolve_own_end(kmp_reader *r, const kmp_yaml *node, int body, const char *what)
{
    if (!node || !kmp_read_word(r, node, what))
        return -1;
    bool full = strchr(node->text, '.') || strcmp(node->text, "ground") == 0;
    int point = full ? resolve_end(r, node, what) : kmp_read_point_of(r, node->place, body, node->text, what);
    if (point < 0 || r->model->points[point].body == body)
        return point;
    kmp_complain_of(r, node, what, "point '%s' is on body '%s'", node->text,
                    r->model->bodies[r->model->points[point].body].name);
    return -1;
}

/* -- points -------------------------------------------------------------------------------------- */

static const kmp_key point_keys[] = {
#include "model/keys/point_keys.def"
    {0}};

/* From a point of the ground of an included file to the same on the body that the file is put on, where `ground` is the
 * origin of the file. */
static void move_to_ground(kmp_reader *r, const kmp_point *ground, kmp_point *point)
{
    point->body = ground->body;
    point->station = ground->station;
    for (int k = 0; ground->station > 0 && k < 3; k++)
        point->offset[k] = kmp_number_add(&r->model->arena, point->at[k], ground->offset[k]);
    for (int k = 0; k < 3; k++) {
        int symbol = point->at[k].symbol ? point->at[k].symbol : ground->at[k].symbol;
        point->at[k] = kmp_number_add(&r->model->arena, point->at[k], ground->at[k]);
        point->at[k].symbol = symbol;
    }
}

/* Points of a body; points of the ground of an included file have the point of its origin as `ground`. */
static void read_points(kmp_reader *r, const kmp_yaml *owner, int body, const kmp_point *ground)
{
    kempe_model *model = r->model;
    const char *what = kmp_reader_say(r, "the points of body '%s'", model->bodies[body].name);
    const kmp_yaml *map = kmp_yaml_get(owner, "points");
    if (!map || !kmp_read_map(r, map, what, NULL))
        return;
    for (int i = 0; i < map->count; i++) {
        kmp_point *point = &model->points[model->point_count];
        kmp_read_name(r, map->keys[i], "a point");
        point->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!point->name)
            return;
        point->body = body;
        model->point_count++;
        /* [x, y, z], or {at: [x, y, z], axes: {..}}; on a flexible body {station: x, offset: [x, y, z], axes: {..}} */
        const kmp_yaml *node = map->items[i];
        what = kmp_reader_say(r, "point '%s.%s'", model->bodies[body].name, map->keys[i]->text);
        if (node->kind == KMP_YAML_MAP) {
            kmp_read_map(r, node, what, point_keys);
            const kmp_yaml *axes = kmp_yaml_get(node, "axes");
            point->turned = axes && kmp_read_axes(r, axes, what, point->axes);
        }
        kmp_read_point_place(r, node, what, point);
        if (ground)
            move_to_ground(r, ground, point);
    }
}

static int count_points(const kmp_yaml *owner)
{
    const kmp_yaml *points = kmp_yaml_get(owner, "points");
    return points && points->kind == KMP_YAML_MAP ? points->count : 0;
}

/* -- the ground of included files ---------------------------------------------------------------- */

/* The origin of an included file's ground: a point named by its prefix and `ground`, on the body that it is put on. */
static int place_ground(kmp_reader *r, const kmp_include_instance *instance)
{
    kempe_model *model = r->model;
    kmp_point *point = &model->points[model->point_count];
    const char *name = kmp_reader_body_name(r, instance->file, "ground");
    kmp_number offset[3] = {{.value = 0}};
    int body = kmp_name_find(KMP_BODY_NAMES(model), name), base = -1;
    const kmp_include_instance *outer = kmp_reader_instance(r, instance->parent);
    if (instance->at && strchr(instance->at->text, '.'))
        base = kmp_read_point_text(r, instance->at->place, instance->at->text, "'at' of an include");
    else if (body < 0 && instance->at) /* otherwise, the ground: not found because memory is exhausted */
        (void)kmp_read_body(r, instance->at, "'at' of an include");
    else if (outer && (!instance->at || strcmp(instance->at->text, "ground") == 0))
        base = outer->ground;
    if (instance->at && base >= 0 && model->points[base].turned)
        kmp_reader_complain(
            r, instance->at->place,
            "'at' of an include: the axes of point '%s' are rotated: a file is included in the axes of a body",
            instance->at->text);
    if (instance->at)
        kmp_check_flexible_ground(r, instance->at, body < 0 ? 0 : body, base);
    if (instance->offset)
        kmp_read_vector(r, instance->offset, "the offset of an include", kmp_key_dimension(kmp_include_keys, "offset"),
                        offset);
    *point = (kmp_point){.name = kmp_arena_strdup(&model->arena, kmp_reader_say(r, "%sground", instance->prefix)),
                         .body = body < 0 ? 0 : body};
    if (!point->name)
        return -1;
    for (int k = 0; k < 3; k++)
        point->at[k] = offset[k];
    if (base >= 0)
        move_to_ground(r, &model->points[base], point);
    return model->point_count++;
}

static void read_included_ground(kmp_reader *r, kmp_include_instance *instance)
{
    kempe_model *model = r->model;
    const kmp_yaml *ground = kmp_yaml_get(instance->root, "ground");
    instance->ground = place_ground(r, instance);
    if (instance->ground < 0 || !ground || !kmp_read_map(r, ground, "ground", ground_keys))
        return;
    int first = model->point_count;
    read_points(r, ground, 0, &model->points[instance->ground]);
    for (int k = first; k < model->point_count; k++) {
        model->points[k].name =
            kmp_arena_strdup(&model->arena, kmp_reader_name(r, instance->file, model->points[k].name));
        if (!model->points[k].name)
            model->points[k].name = "";
    }
}

static bool read_all_points(sources *s, const kmp_yaml *ground)
{
    kempe_model *model = s->r->model;
    int count = count_points(ground);
    for (int i = 0; i < s->count; i++)
        count += count_points(s->list[i].map);
    for (int i = 0; i < s->r->instance_count; i++)
        count += 1 + count_points(kmp_yaml_get(s->r->instances[i].root, "ground"));
    model->points = KMP_ARENA_NEW(&model->arena, kmp_point, count);
    if (!model->points)
        return false;
    if (ground && kmp_read_map(s->r, ground, "ground", ground_keys))
        read_points(s->r, ground, 0, NULL);
    for (int k = 0; k < s->count; k++)
        read_points(s->r, s->list[s->order[k]].map, k + 1, NULL);
    kmp_segments_place_points(s->r);
    for (int i = 0; i < s->r->instance_count; i++)
        read_included_ground(s->r, &s->r->instances[i]);
    return true;
}

/* -- the whole ----------------------------------------------------------------------------------- */

/* The ground exists also without bodies, so that references to it can be read. */
static bool make_ground(kempe_model *model, int bodies)
{
    model->bodies = KMP_ARENA_NEW(&model->arena, kmp_body, bodies + 1);
    if (!model->bodies)
        return false;
    model->body_count = 1;
    model->bodies[0] = (kmp_body){.name = "ground",
                                  .joint = "",
                                  .place = {.line = 1, .column = 1},
                                  .parent = -1,
                                  .at = -1,
                                  .to = -1,
                                  .motion_count = 0};
    return true;
}

static void read_joints(sources *s)
{
    const kmp_yaml **joints = KMP_ARENA_NEW(&s->r->scratch, const kmp_yaml *, s->count);
    for (int k = 0; joints && k < s->count; k++) {
        const source *from = &s->list[s->order[k]];
        kmp_body *body = &s->r->model->bodies[k + 1];
        body->at = resolve_end(s->r, from->at, what_of(s->r, from->joint, "at", body->name));
        body->to = resolve_own_end(s->r, from->to, k + 1, what_of(s->r, from->joint, "to", body->name));
        kmp_check_flexible_joint(s->r, k + 1, from->at, from->to);
        joints[k] = s->list[s->order[k]].joint;
    }
    if (joints) {
        kmp_reader *r = s->r;
        for (int i = 1; i < r->model->body_count; i++)
            read_joint(r, joints[i - 1], i);
        if (r->model->body_count > 1 && r->model->motion_count == 0 && r->model->flexible_count == 0 && !r->wrong &&
            !kmp_yaml_get(r->root, "states"))
            kmp_reader_complain(r, r->model->bodies[1].place,
                                "the mechanism cannot move: all bodies are welded to the ground%s",
                                r->foreign && kmp_context_base(r->context) != KMP_BASE_FREE
                                    ? "; a robot that flies or floats needs a free root (--base free)"
                                    : "");
    }
}

void kmp_read_bodies(kmp_reader *r)
{
    sources s = {.r = r};
    const kmp_yaml *map = kmp_read_required(r, r->root, "the model", "bodies");
    bool good = map && kmp_read_map(r, map, "bodies", NULL);
    if (good && map->count == 0)
        kmp_reader_complain(r, map->place, "bodies: a model needs at least one body");
    if (good && map->kind == KMP_YAML_MAP)
        kmp_read_linkage(r, map);
    if (!make_ground(r->model, good ? map->count : 0) || (good && map->count > 0 && !take_sources(&s, map)))
        return;
    for (int i = 0; i < s.count; i++)
        find_parent(&s, &s.list[i]);
    for (int i = 0; i < s.count; i++)
        place(&s, i);
    if (!make_bodies(&s))
        return;
    for (int k = 0; k < s.count; k++)
        kmp_begin_flexible(r, s.list[s.order[k]].map, k + 1);
    if (!read_all_points(&s, kmp_yaml_get(r->root, "ground")))
        return;
    read_joints(&s);
    for (int k = 0; k < s.count; k++)
        kmp_read_mass(r, s.list[s.order[k]].map, k + 1);
    /* Shapes of the ground, of the model and of included files. */
    static const kmp_number none[3] = {{.value = 0}};
    const kmp_shape_owner own = {.body = 0, .name = "the ground", .origin = none};
    const kmp_yaml *ground = kmp_yaml_get(r->root, "ground");
    if (ground)
        kmp_read_shapes(r, ground, &own);
    for (int i = 0; i < r->instance_count; i++) {
        const kmp_include_instance *instance = &r->instances[i];
        const kmp_yaml *included = kmp_yaml_get(instance->root, "ground");
        if (!included || instance->ground < 0)
            continue;
        const kmp_point *origin = &r->model->points[instance->ground];
        kmp_read_shapes(r, included, &(kmp_shape_owner){origin->body, "the ground", origin->at});
    }
}
