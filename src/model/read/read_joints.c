/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints as chains of elementary motions: a row of joints.def with its axis, or the chain written out. */
#include "model/read/read_joints.h"
#include "model/data/model.h"
#include "model/read/read_axes.h"
#include "model/read/read_include.h"
#include "model/read/read_linkage.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

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

static void add_motion(kmp_reader *r, int body, bool rotation, const double axis[3])
{
    kempe_model *model = r->model;
    kmp_motion *motions = kmp_arena_room(&model->arena, model->motions, model->motion_count, sizeof *motions);
    if (!motions)
        return;
    model->motions = motions;
    motions[model->motion_count++] =
        (kmp_motion){.name = "", .body = body, .rotation = rotation, .axis = {axis[0], axis[1], axis[2]}};
    model->bodies[body].motion_count++;
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
    kmp_reader_complain(
        r, node->place,
        "%s: a motion is R1, R2, R3, T1, T2, T3, one of them with a minus, {R: axis} or {T: axis}%s%s%s", what,
        node->text[0] ? ", not '" : "", node->text, node->text[0] ? "'" : "");
    add_stand_in(r, body, !strchr(node->text, 'T'));
}

static void read_motions(kmp_reader *r, const kmp_yaml *node, const char *what, int body)
{
    if (!kmp_read_list(r, node, kmp_reader_say(r, "%s: motions", what), -1))
        return;
    if (node->count == 0)
        kmp_reader_complain(r, node->place, "%s: a joint needs at least one motion", what);
    for (int i = 0; i < node->count; i++)
        read_one_motion(r, node->items[i], what, body);
}

/* Two axes [a, b], which are perpendicular to each other. */
static void read_two_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3])
{
    double a[3], b[3], square[3][3];
    if (!kmp_read_axis(r, node->items[0], what, a) || !kmp_read_axis(r, node->items[1], what, b))
        return;
    if (fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > 1e-6)
        kmp_reader_complain(r, node->place, "%s: the two axes are not perpendicular to each other", what);
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

static void read_row(kmp_reader *r, const char *chain, const kmp_yaml *node, const char *what, int body)
{
    double m[3][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
    if (!chain[0] && (node->kind != KMP_YAML_SCALAR || strcmp(node->text, "yes") != 0))
        kmp_reader_complain(r, node->place, "%s: a joint without motions is written with the value 'yes'", what);
    if (chain[0])
        kmp_read_chain_axes(r, chain, node, what, m);
    for (; chain[0] && chain[0] != '='; chain += 2) {
        double axis[3];
        for (int i = 0; i < 3; i++)
            axis[i] = m[i][chain[1] - 'a'];
        add_motion(r, body, chain[0] == 'R', axis);
    }
}

void kmp_check_joint_keys(kmp_reader *r, const kmp_joint_row *row, const kmp_yaml *joint, const char *what)
{
    for (int k = 0; k < kmp_joint_names.count; k++) {
        const kmp_joint_row *other = &kmp_joint_rows[k];
        const kmp_yaml *node = kmp_joint_key(other) ? kmp_yaml_get(joint, kmp_joint_key(other)) : NULL;
        if (node && other != row)
            kmp_reader_complain(r, node->place, "%s: only a %s has a %s", what, other->name, kmp_joint_key(other));
    }
}

/* Reads the number that couples two motions; in other joints its key is an error. */
static void read_number(kmp_reader *r, const kmp_joint_row *row, const kmp_yaml *joint, const char *what,
                        kmp_body *body)
{
    const char *key = row ? kmp_joint_key(row) : NULL;
    kmp_check_joint_keys(r, row, joint, what);
    const kmp_yaml *node = key ? kmp_read_required(r, joint, what, key) : NULL;
    body->coupling = key ? row : NULL;
    if (node)
        kmp_read_number(r, node, kmp_reader_say(r, "the %s of %s", key, what), kmp_key_dimension(joint_keys, key),
                        &body->number);
}

static void read_armature(kmp_reader *r, const kmp_yaml *joint, const char *what, kmp_body *body)
{
    const kmp_yaml *node = kmp_yaml_get(joint, "armature");
    if (!node)
        return;
    if (body->motion_count != 1) {
        kmp_reader_complain(r, node->place, "%s: only a joint with one coordinate has an armature", what);
        return;
    }
    kmp_dimension unit = r->model->motions[body->first_motion].rotation ? KMP_DIM(2, 1, 0) : KMP_DIM(0, 1, 0);
    const char *name = kmp_reader_say(r, "the armature of %s", what);
    if (kmp_read_number(r, node, name, unit, &body->armature))
        kmp_check_rule(r, node, name, KMP_FIELD_NOT_NEGATIVE, body->armature.value, "");
}

/* The one key that determines the kind of joint. */
static void read_kind(kmp_reader *r, const kmp_yaml *joint, const char *what, int body)
{
    int kind = -1, count = kmp_count_keys(joint, KMP_NAMES_OF(kinds), &kind);
    const kmp_joint_row *row = kind >= 0 && kind < kmp_joint_names.count ? &kmp_joint_rows[kind] : NULL;
    if (row)
        read_row(r, row->chain, kmp_yaml_get(joint, row->name), what, body);
    else if (count > 0)
        read_motions(r, kmp_yaml_get(joint, "motions"), what, body);
    read_number(r, row, joint, what, &r->model->bodies[body]);
    read_armature(r, joint, what, &r->model->bodies[body]);
    if (count != 1)
        kmp_complain_keys(r, joint->place, what, KMP_NAMES_OF(kinds), count);
    if (count == 0)
        add_stand_in(r, body, true);
}

/* -- joints -------------------------------------------------------------------------------------- */

/* Motions that may change places: all about and along one axis. */
static bool commute(const kmp_motion *motions, int count)
{
    for (int k = 1; k < count; k++)
        if (memcmp(motions[k].axis, motions[0].axis, sizeof motions[0].axis) != 0)
            return false;
    return true;
}

/* The inverse X1(q1) X2(q2) .. of a chain is .. X2(-q2) X1(-q1): the last motion first, about the opposite axis. */
static void reverse_chain(kmp_motion *motions, int count)
{
    bool turn = !commute(motions, count);
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
    if (linked_name)
        body->joint = kmp_arena_strdup(&r->model->arena, linked_name);
    if (!body->joint)
        body->joint = "";
    const kmp_yaml *name = kmp_yaml_get(joint, "name");
    const char *given = name ? kmp_read_name(r, name, "a joint") : NULL;
    const char *kept = given ? kmp_arena_strdup(&r->model->arena, kmp_reader_name(r, name->place.file, given)) : NULL;
    if (kept)
        body->joint = kept;
    check_unique(r, name ? name->place : body->place, i);
    const kmp_yaml *frame = kmp_yaml_get(joint, "frame");
    body->turned = frame && kmp_read_axes(r, frame, kmp_reader_say(r, "the frame of %s", what), body->frame);
    read_kind(r, joint, what, i);
    name_motions(r, body, kmp_yaml_get(joint, "coordinates"));
    const kmp_yaml *reversed = kmp_yaml_get(joint, "reversed");
    body->reversed = reversed && strcmp(reversed->text, "yes") == 0;
    if (reversed && !body->reversed)
        kmp_reader_complain(r, reversed->place, "%s: reversed is 'yes' or absent", what);
    if (body->reversed && body->motion_count > 0)
        reverse_chain(&r->model->motions[body->first_motion], body->motion_count);
}

void kmp_read_motions(kmp_reader *r, const kmp_yaml *const *joint_nodes)
{
    for (int i = 1; i < r->model->body_count; i++)
        read_joint(r, joint_nodes[i - 1], i);
    if (r->model->body_count > 1 && r->model->motion_count == 0 && !r->wrong && !kmp_yaml_get(r->root, "states"))
        kmp_reader_complain(r, r->model->bodies[1].place,
                            "the mechanism cannot move: all bodies are welded to the ground");
}
