/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints as chains of elementary motions: a row of joints.def with its axis, or the chain written out. */
#include "model/reading.h"
#include <math.h>
#include <string.h>

static const struct {
    const char *name, *chain;
} joints[] = {
#define KMP_JOINT(name, chain) {#name, chain},
#include "model/joints.def"
#undef KMP_JOINT
};

enum { JOINTS = sizeof joints / sizeof joints[0] };

static const char *const joint_keys[] = {
#define KMP_JOINT(name, chain) #name,
#include "model/joints.def"
#undef KMP_JOINT
    "motions", "name", "at", NULL};

/* The motions so far; the array doubles when it is full. */
typedef struct list {
    kmp_reader *r;
    int capacity;
} list;

static void add_motion(list *l, int body, bool rotation, const double axis[3])
{
    kempe_model *model = l->r->model;
    if (model->motion_count == l->capacity) {
        int capacity = l->capacity ? 2 * l->capacity : 16;
        kmp_motion *grown = KMP_ARENA_NEW(&model->arena, kmp_motion, capacity);
        if (!grown)
            return;
        if (model->motion_count > 0)
            memcpy(grown, model->motions, (size_t)model->motion_count * sizeof *grown);
        model->motions = grown;
        l->capacity = capacity;
    }
    kmp_motion *motion = &model->motions[model->motion_count++];
    *motion = (kmp_motion){.name = "", .body = body, .rotation = rotation, .axis = {axis[0], axis[1], axis[2]}};
    model->bodies[body].motion_count++;
}

/* Stands for a motion that could not be read, so that what refers to it is not complained of too. */
static void add_stand_in(list *l, int body, bool rotation)
{
    static const double z[3] = {0, 0, 1};
    add_motion(l, body, rotation, z);
}

/* -- axes ---------------------------------------------------------------------------------------- */

/* x, y, z with or without a minus. */
static bool read_letter_axis(const char *text, double axis[3])
{
    double sign = text[0] == '-' ? -1 : 1;
    const char *letter = text + (text[0] == '-');
    if (letter[0] < 'x' || letter[0] > 'z' || letter[1] != '\0')
        return false;
    axis[0] = axis[1] = axis[2] = 0;
    axis[letter[0] - 'x'] = sign;
    return true;
}

/* Scaled by the largest component first, so that no square overflows or vanishes. */
static bool normalise(double axis[3])
{
    double largest = fmax(fabs(axis[0]), fmax(fabs(axis[1]), fabs(axis[2])));
    if (!(largest > 0))
        return false;
    for (int i = 0; i < 3; i++)
        axis[i] /= largest;
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    for (int i = 0; i < 3; i++)
        axis[i] /= length;
    return true;
}

static bool read_axis(kmp_reader *r, const kmp_node *node, const char *what, double axis[3])
{
    kmp_number vector[3];
    if (node->kind != KMP_NODE_LIST) {
        if (node->kind == KMP_NODE_SCALAR && read_letter_axis(node->text, axis))
            return true;
        kmp_reader_complain(r, node->place, "%s: an axis is x, y, z, -x, -y, -z or a list of three numbers%s%s%s", what,
                            node->text[0] ? ", not '" : "", node->text, node->text[0] ? "'" : "");
        return false;
    }
    if (!kmp_read_vector(r, node, kmp_reader_say(r, "%s: the axis", what), KMP_DIM_ANY, vector))
        return false;
    for (int i = 0; i < 3; i++)
        axis[i] = vector[i].value;
    if (normalise(axis))
        return true;
    kmp_reader_complain(r, node->place, "%s: the axis has no direction: all its components are zero", what);
    return false;
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

static void read_one_motion(list *l, const kmp_node *node, const char *what, int body)
{
    bool rotation = false;
    double axis[3];
    if (node->kind == KMP_NODE_MAP && node->count == 1 &&
        (strcmp(node->keys[0]->text, "R") == 0 || strcmp(node->keys[0]->text, "T") == 0)) {
        rotation = node->keys[0]->text[0] == 'R';
        if (read_axis(l->r, node->items[0], what, axis))
            add_motion(l, body, rotation, axis);
        else
            add_stand_in(l, body, rotation);
        return;
    }
    if (node->kind == KMP_NODE_SCALAR && read_code(node->text, &rotation, axis)) {
        add_motion(l, body, rotation, axis);
        return;
    }
    kmp_reader_complain(
        l->r, node->place,
        "%s: a motion is R1, R2, R3, T1, T2, T3, one of them with a minus, {R: axis} or {T: axis}%s%s%s", what,
        node->text[0] ? ", not '" : "", node->text, node->text[0] ? "'" : "");
    add_stand_in(l, body, !strchr(node->text, 'T'));
}

static void read_motions(list *l, const kmp_node *node, const char *what, int body)
{
    if (!kmp_read_list(l->r, node, kmp_reader_say(l->r, "%s: motions", what), -1))
        return;
    if (node->count == 0)
        kmp_reader_complain(l->r, node->place, "%s: a joint has at least one motion", what);
    for (int i = 0; i < node->count; i++)
        read_one_motion(l, node->items[i], what, body);
}

static void read_row(list *l, const char *chain, const kmp_node *node, const char *what, int body)
{
    double axis[3] = {0, 0, 1};
    read_axis(l->r, node, what, axis);
    for (; chain[0]; chain += 2)
        add_motion(l, body, chain[0] == 'R', axis);
}

/* The one key that says what kind of joint it is. */
static void read_kind(list *l, const kmp_node *joint, const char *what, int body)
{
    int kinds = 0;
    for (int i = 0; i < JOINTS; i++) {
        const kmp_node *axis = kmp_node_get(joint, joints[i].name);
        if (axis && kinds++ == 0)
            read_row(l, joints[i].chain, axis, what, body);
    }
    const kmp_node *motions = kmp_node_get(joint, "motions");
    if (motions && kinds++ == 0)
        read_motions(l, motions, what, body);
    if (kinds == 1)
        return;
    kmp_text names = {0};
    for (int i = 0; i < JOINTS; i++)
        kmp_text_printf(&names, "%s, ", joints[i].name);
    if (names.failed)
        l->r->scratch.failed = true;
    kmp_reader_complain(l->r, joint->place, "%s: exactly one of the keys %smotions is wanted, not %d", what,
                        names.failed ? "" : names.s, kinds);
    kmp_text_free(&names);
    if (kinds == 0)
        add_stand_in(l, body, true);
}

/* -- joints -------------------------------------------------------------------------------------- */

static void name_motions(kempe_model *model, const kmp_body *body)
{
    for (int k = 0; k < body->motion_count; k++) {
        kmp_motion *motion = &model->motions[body->first_motion + k];
        kmp_text name = {0};
        if (body->motion_count == 1)
            kmp_text_put(&name, body->joint);
        else
            kmp_text_printf(&name, "%s.%d", body->joint, k + 1);
        const char *kept = name.failed ? NULL : kmp_arena_strdup(&model->arena, name.s);
        if (name.failed)
            model->arena.failed = true;
        motion->name = kept ? kept : "";
        kmp_text_free(&name);
    }
}

static void check_unique(kmp_reader *r, kmp_place place, int body)
{
    const kmp_body *bodies = r->model->bodies;
    for (int i = 1; i < body; i++)
        if (strcmp(bodies[i].joint, bodies[body].joint) == 0 && strcmp(bodies[i].name, bodies[body].name) != 0) {
            kmp_reader_complain(r, place, "duplicate joint '%s': it is also the joint of body '%s'", bodies[i].joint,
                                bodies[i].name);
            return;
        }
}

static void read_joint(list *l, const kmp_node *joint, int i)
{
    kmp_reader *r = l->r;
    kmp_body *body = &r->model->bodies[i];
    const char *what = kmp_reader_say(r, "the joint of body '%s'", body->name);
    body->first_motion = r->model->motion_count;
    if (!joint)
        return;
    if (joint->kind != KMP_NODE_MAP) {
        kmp_reader_complain(r, joint->place, "%s must be a mapping such as {revolute: z, at: ground}", what);
        return;
    }
    kmp_read_map(r, joint, what, joint_keys);
    const kmp_node *name = kmp_node_get(joint, "name");
    const char *given = name ? kmp_read_name(r, name, "a joint") : NULL;
    const char *kept = given ? kmp_arena_strdup(&r->model->arena, kmp_reader_name(r, name->place.file, given)) : NULL;
    if (kept)
        body->joint = kept;
    check_unique(r, name ? name->place : body->place, i);
    read_kind(l, joint, what, i);
    name_motions(r->model, body);
}

void kmp_read_motions(kmp_reader *r, const kmp_node *const *joint_nodes)
{
    list l = {.r = r};
    for (int i = 1; i < r->model->body_count; i++)
        read_joint(&l, joint_nodes[i - 1], i);
}
