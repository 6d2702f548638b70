/* SPDX-License-Identifier: BSD-3-Clause */
/* The paths of ropes: places, the coordinates that turn drums, and the angles at the start. */
#include "model/read/read_ropes.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/three.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/data/rope.h"
#include "model/files/nodes.h"
#include "model/language/expression_value.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

#define TURN 6.28318530717958647692
/* A wrap below zero by less, in rad, is none: the rope just touches its sheave, with rounding. */
#define NO_WRAP 1e-6
/* Slack over length that counts as zero at the start: written lengths have nine digits. */
#define SHORT 1e-9
/* Difference of pitches over a pitch that counts as none: written ones have nine digits. */
#define SAME_PITCH 1e-9
/* Sine of the angle of a span out of the plane of its sheave, 5 deg, beyond which its direction is in doubt. */
#define OBLIQUE 0.087

#define HALF_TURN 3.14159265358979323846

/* Full turns on a sheave, and points of the table of a drum: an equation has a term for each point. */
enum { MOST_TURNS = 1000, MOST_LAYERS = 34 };

static const kmp_key rope_keys[] = {
#include "model/keys/rope_keys.def"
    {0}};
static const kmp_key place_keys[] = {
#include "model/keys/rope_place_keys.def"
    {0}};

/* A rope that is being read. */
typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map, *list;
    const char *what;
    kmp_rope *rope;
    const kmp_pose_zero *at;
} reading;

/* -- places -------------------------------------------------------------------------------------------- */

/* The element of friction has its texts (rope_elements.c). With it the rotation of the sheave counts. */
static bool read_rim(const reading *c, const kmp_yaml *map, kmp_rope_place *place)
{
    const kmp_yaml *friction = kmp_yaml_get(map, "friction"), *groove = kmp_yaml_get(map, "groove");
    const char *of[2] = {kmp_reader_say(c->r, "friction of %s", c->what),
                         kmp_reader_say(c->r, "groove of %s", c->what)};
    kmp_number number = {0};
    place->turns = place->drum || friction;
    if (friction && !kmp_read_ruled(c->r, friction, of[0], KMP_DIM_NUMBER, KMP_FIELD_NOT_NEGATIVE, &number))
        return false;
    if (groove &&
        !kmp_read_ruled(c->r, groove, of[1], kmp_key_dimension(place_keys, "groove"), KMP_FIELD_POSITIVE, &number))
        return false;
    return !groove || number.value <= HALF_TURN ||
           kmp_reader_complain(c->r, groove->place, "%s is %.6g deg: it is at most 180 deg, a flat rim", of[1],
                               number.value * 180 / HALF_TURN);
}

/* Wheels of one belt or chain have its pitch. */
static bool check_pitch(const reading *c, const kmp_yaml *pitch, double own)
{
    kmp_number first;
    const char *of = kmp_reader_say(c->r, "the pitch of %s", c->what);
    for (int k = 0; k < c->rope->count; k++) {
        const kmp_yaml *node = kmp_yaml_get(c->list->items[k], "pitch");
        if (node && kmp_read_number(c->r, node, of, KMP_DIM_LENGTH, &first) &&
            fabs(own - first.value) > SAME_PITCH * first.value)
            return kmp_reader_complain(c->r, pitch->place,
                                       "%s is %.9g mm, and on another wheel it is %.9g mm: a belt or chain has one "
                                       "pitch",
                                       of, 1e3 * own, 1e3 * first.value);
    }
    return true;
}

/* The radius as it is written, or the radius on which the pitch lies around the teeth; NULL: it is wrong. */
static const kmp_yaml *radius_of(const reading *c, const kmp_yaml *map, bool drum)
{
    const kmp_yaml *teeth = kmp_yaml_get(map, "teeth"), *pitch = kmp_yaml_get(map, "pitch");
    const char *of[2] = {kmp_reader_say(c->r, "teeth of %s", c->what),
                         kmp_reader_say(c->r, "the pitch of %s", c->what)};
    double count;
    kmp_number length = {0};
    if (!teeth && !pitch)
        return kmp_read_required(c->r, map, c->what, "radius");
    const kmp_place place = teeth ? teeth->place : pitch->place;
    if (!teeth || !pitch || kmp_yaml_get(map, "radius")) {
        kmp_reader_complain(c->r, place, "%s: a wheel has a radius, or teeth and pitch", c->what);
        return NULL;
    }
    if (!drum) {
        kmp_reader_complain(c->r, place, "%s: teeth belong to a drum, or to a wheel with 'grip: yes'", c->what);
        return NULL;
    }
    if (!kmp_read_whole(c->r, teeth, of[0], "is", 1, INFINITY, &count) ||
        !kmp_read_ruled(c->r, pitch, of[1], KMP_DIM_LENGTH, KMP_FIELD_POSITIVE, &length) ||
        !check_pitch(c, pitch, length.value))
        return NULL;
    return kmp_yaml_word(&c->r->scratch, pitch->place, kmp_reader_say(c->r, "%.17g*(%s)/(2*pi)", count, pitch->text));
}

static bool is_layered(const reading *c, const kmp_yaml *radius)
{
    return radius->kind == KMP_YAML_SCALAR &&
           kmp_name_find(KMP_NAMED(c->r->model, table), kmp_reader_name(c->r, radius->place.file, radius->text)) >= 0;
}

/* The radius of a drum over the angle that is wound on it. */
static bool read_layers(const reading *c, const kmp_yaml *map, const kmp_yaml *radius, kmp_rope_place *place)
{
    const char *of = kmp_reader_say(c->r, "wound of %s", c->what);
    const kmp_named_table *named = kmp_read_table_name(c->r, radius, kmp_reader_say(c->r, "the radius of %s", c->what));
    const kmp_table *t = named ? named->table : NULL;
    const kmp_yaml *wound = kmp_yaml_get(map, "wound");
    if (!t)
        return false;
    if (!place->drum)
        return KMP_COMPLAIN(c, radius, "a sheave has one radius: the table '%s' is for a drum", radius->text);
    if (t->method != KMP_TABLE_LINEAR || t->count > MOST_LAYERS)
        return KMP_COMPLAIN(c, radius,
                            "the table '%s' of its radius has the method %s and %d points: it is 'method: linear' with "
                            "at most %d points",
                            radius->text, kmp_table_method_word(t->method), t->count, MOST_LAYERS);
    if (wound && !kmp_read_fixed(c->r, wound, of, kmp_key_dimension(place_keys, "wound"), &place->wound))
        return false;
    if (!(place->wound >= t->x[0] && place->wound <= t->x[t->count - 1]))
        return kmp_reader_complain(c->r, wound ? wound->place : radius->place,
                                   "%s is %.6g rad: the table '%s' has the radius from %.6g to %.6g rad", of,
                                   place->wound, radius->text, t->x[0], t->x[t->count - 1]);
    for (int k = 0; k < t->count; k++)
        if (!(t->y[k] > 0))
            return KMP_COMPLAIN(c, radius, "the table '%s' has the radius %.6g m at %.6g rad: it must be positive",
                                radius->text, t->y[k], t->x[k]);
    place->layers = named;
    place->radius = (kmp_number){.value = kmp_table_value(t, 0, place->wound)};
    return true;
}

static bool read_round(const reading *c, const kmp_yaml *map, kmp_rope_place *place)
{
    static const char *const ways[] = {"left", "right"};
    const kmp_yaml *radius = radius_of(c, map, place->drum), *turns = kmp_yaml_get(map, "turns");
    const char *of = kmp_reader_say(c->r, "the radius of %s", c->what);
    double full = 0;
    if (!kmp_read_required(c->r, map, c->what, "turn"))
        return false;
    const int way = kmp_read_choice_of(c->r, map, "turn", c->what, KMP_NAMES_OF(ways), "the turn is", -1);
    place->turn = way == 0 ? 1 : -1;
    place->axis = kmp_read_choice_of(c->r, map, "axis", c->what, kmp_axis_letters, "the axis is", 2);
    if (way < 0 || place->axis < 0)
        return false;
    if (radius && is_layered(c, radius)) {
        if (!read_layers(c, map, radius, place))
            return false;
    } else if (kmp_yaml_get(map, "wound")) {
        return kmp_reader_complain(c->r, kmp_yaml_get(map, "wound")->place,
                                   "%s: wound belongs to a drum whose radius is a table", c->what);
    }
    if (!radius || (!place->layers && !kmp_read_number(c->r, radius, of, KMP_DIM_LENGTH, &place->radius)) ||
        !kmp_check_rule(c->r, radius, of, KMP_FIELD_POSITIVE, place->radius.value, ""))
        return false;
    of = kmp_reader_say(c->r, "turns of %s", c->what);
    if (turns && !kmp_read_whole(c->r, turns, of, "is", 0, MOST_TURNS, &full))
        return false;
    place->wrap = TURN * full;
    place->leaves = kmp_yaml_get(map, "may_leave");
    place->helix = kmp_yaml_get(map, "helix");
    return read_rim(c, map, place) &&
           kmp_read_choice_of(c->r, map, "may_leave", c->what, kmp_yes, "may_leave is", 0) == 0 &&
           kmp_read_choice_of(c->r, map, "helix", c->what, kmp_yes, "helix is", 0) == 0;
}

/* Keys that only a sheave between the ends has. */
static bool check_place(const reading *c, const kmp_yaml *map, int k, bool drum)
{
    static const char *const keys[] = {"turns", "friction", "groove", "may_leave", "helix"};
    const bool end = !c->rope->closed && (k == 0 || k == c->list->count - 1);
    if (drum && !end)
        return KMP_COMPLAIN(c, map, "a rope ends on a drum, so that a drum is its first or its last place");
    if (!drum && end)
        return KMP_COMPLAIN(c, map, "a sheave lies between two other places; a rope ends at a point or on a drum");
    for (int i = 0; drum && i < 5; i++)
        if (kmp_yaml_get(map, keys[i]))
            return KMP_COMPLAIN(c, kmp_yaml_get(map, keys[i]),
                                "a drum, or a wheel with grip, has no %s: the rope does not slide there", keys[i]);
    if (kmp_yaml_get(map, "groove") && !kmp_yaml_get(map, "friction"))
        return KMP_COMPLAIN(c, map, "groove belongs to friction");
    if (kmp_yaml_get(map, "grip"))
        return KMP_COMPLAIN(c, map, "grip is 'yes' or absent, and belongs to a 'round'");
    if (c->rope->closed && kmp_yaml_get(map, "friction"))
        return KMP_COMPLAIN(c, map, "friction on a sheave is for a rope with two ends");
    if (kmp_yaml_get(map, "may_leave") && kmp_yaml_get(map, "friction"))
        return KMP_COMPLAIN(c, map, "a sheave with friction has no may_leave");
    return true;
}

/* A sphere has a radius, and the rope may leave it. */
static bool read_ball(const reading *c, const kmp_yaml *map, kmp_rope_place *place)
{
    const char *of = kmp_reader_say(c->r, "the radius of %s", c->what);
    const kmp_yaml *radius = kmp_read_required(c->r, map, c->what, "radius");
    for (int i = 0; i < map->count; i++)
        if (strcmp(map->keys[i]->text, "sphere") != 0 && strcmp(map->keys[i]->text, "radius") != 0)
            return KMP_COMPLAIN(c, map->keys[i], "a sphere has a radius and no %s", map->keys[i]->text);
    *place = (kmp_rope_place){.point = place->point, .turn = 1, .ball = true, .leaves = true};
    return radius && kmp_read_ruled(c->r, radius, of, KMP_DIM_LENGTH, KMP_FIELD_POSITIVE, &place->radius);
}

static bool read_place(const reading *c, int k)
{
    static const char *const kinds[] = {"round", "drum", "sphere"};
    const kmp_yaml *node = c->list->items[k];
    kmp_rope_place *place = &c->rope->places[k];
    *place = (kmp_rope_place){.point = -1};
    if (node->kind != KMP_YAML_MAP) {
        place->point = kmp_read_point(c->r, node, c->what);
        return place->point >= 0;
    }
    if (!kmp_read_map(c->r, node, c->what, place_keys))
        return false;
    const int kind = kmp_read_one_key(c->r, node, c->what, KMP_NAMES_OF(kinds));
    if (kind < 0 || !check_place(c, node, k, kind == 1))
        return false;
    place->drum = kind == 1;
    place->point = kmp_read_point(c->r, kmp_yaml_get(node, kinds[kind]), c->what);
    if (place->point < 0 || !(kind == 2 ? read_ball : read_round)(c, node, place))
        return false;
    if (!place->ball && c->r->model->bodies[c->r->model->points[place->point].body].flexible > 0)
        return KMP_COMPLAIN(c, node,
                            "a sheave or drum on a flexible body has an axis that does not rest: put it on a rigid "
                            "body that is welded to it");
    if (c->rope->plane < 0)
        c->rope->plane = k;
    return true;
}

/* -- axes ---------------------------------------------------------------------------------------------- */

/* The axis of a place with all coordinates zero, in the axes of the ground. */
static void axis_of(const reading *c, int k, double axis[3])
{
    const kmp_rope_place *place = &c->rope->places[k];
    kmp_pose_axis(c->r->model, c->at, place->point, place->axis, axis);
}

static const char *place_name(kmp_reader *r, const kmp_rope *rope, int k)
{
    const kmp_point *point = &r->model->points[rope->places[k].point];
    return kmp_reader_say(r, "%s.%s", r->model->bodies[point->body].name, point->name);
}

/* The axis of place k is the axis of the place `plane`, and stays so. */
static bool check_axis(const reading *c, int plane, int k, const double axis[3])
{
    const kempe_model *model = c->r->model;
    double own[3];
    axis_of(c, k, own);
    if (!kmp_is_parallel(own, axis))
        return KMP_COMPLAIN(c, c->list->items[k],
                            "the axes of '%s' and '%s' are not parallel, as they are in one rope; the key axis "
                            "selects x, y or z of a point",
                            place_name(c->r, c->rope, plane), place_name(c->r, c->rope, k));
    if (kmp_dot(3, own, axis) < 0)
        c->rope->places[k].turn = -c->rope->places[k].turn;
    const int body[2] = {model->points[c->rope->places[plane].point].body,
                         model->points[c->rope->places[k].point].body};
    const int top = kmp_model_common_body(model, body[0], body[1]);
    for (int side = 0; side < 2; side++) {
        const char *joint = kmp_joint_off_axis(model, c->at, body[side], top, axis, false);
        if (joint)
            return KMP_COMPLAIN(
                c, c->list->items[k],
                "the axes of '%s' and '%s' do not stay parallel, because joint '%s' turns about another axis",
                place_name(c->r, c->rope, plane), place_name(c->r, c->rope, k), joint);
    }
    return true;
}

/* The body that carries all places of the path. */
static int common_body(const reading *c)
{
    const kempe_model *model = c->r->model;
    int top = model->points[c->rope->places[0].point].body;
    for (int k = 1; k < c->rope->count; k++)
        top = kmp_model_common_body(model, top, model->points[c->rope->places[k].point].body);
    return top;
}

/* Some joint, or a flexible body, moves places of the path against each other. */
static bool check_moves(const reading *c)
{
    const kempe_model *model = c->r->model;
    const int top = common_body(c);
    bool moves = model->bodies[top].flexible > 0;
    for (int k = 0; k < c->rope->count; k++)
        for (int body = model->points[c->rope->places[k].point].body; body != top; body = model->bodies[body].parent)
            moves = moves || model->bodies[body].motion_count > 0 || model->bodies[body].flexible > 0;
    return moves || KMP_COMPLAIN(c, c->list,
                                 "all places of its path are fixed to body '%s', so that no motion changes its length",
                                 model->bodies[top].name);
}

static bool is_about(const reading *c, int body, const double axis[3])
{
    const kempe_model *model = c->r->model;
    return model->bodies[body].flexible == 0 &&
           !kmp_joint_off_axis(model, c->at, body, model->bodies[body].parent, axis, false);
}

/* The rotation of a drum against its carrier: the body of the whole path, or where a joint on the way turns about
 * another axis the body that it carries. So the angle of the span against the carrier changes least. */
static void find_rotation(const reading *c, int k, const double axis[3])
{
    const kempe_model *model = c->r->model;
    kmp_rope_place *place = &c->rope->places[k];
    const int top = common_body(c);
    place->carrier = model->points[place->point].body;
    place->turning = KMP_ARENA_NEW(&c->r->model->arena, kmp_rope_turning, model->motion_count + 1);
    while (place->turning && place->carrier != top && is_about(c, place->carrier, axis)) {
        const kmp_body *b = &model->bodies[place->carrier];
        for (int m = b->first_motion; m < b->first_motion + b->motion_count; m++)
            if (model->motions[m].rotation)
                place->turning[place->turning_count++] =
                    (kmp_rope_turning){m, kmp_dot(3, c->at->axes[m], axis) > 0 ? 1 : -1};
        place->carrier = b->parent;
    }
}

/* Sheaves of a part have one axis. */
static bool find_axes(const reading *c)
{
    double axis[3];
    bool good = true;
    kmp_rope part;
    for (int from = 0, first = 0; kmp_rope_part(c->rope, &first, &part); from = first) {
        if (part.plane < 0 || part.places[part.plane].ball)
            continue;
        const int plane = from + part.plane;
        axis_of(c, plane, axis);
        for (int k = from; k < from + part.count; k++) {
            if (c->rope->places[k].turn != 0 && k != plane)
                good = check_axis(c, plane, k, axis) && good;
            if (c->rope->places[k].turns)
                find_rotation(c, k, axis);
        }
    }
    return good;
}

/* -- numbers ------------------------------------------------------------------------------------------- */

static bool read_own(const reading *c, const char *key, kmp_field_rule rule, kmp_number *number)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, key);
    const char *of = kmp_reader_say(c->r, "%s: %s", c->what, key);
    return !node || kmp_read_ruled(c->r, node, of, kmp_key_dimension(rope_keys, key), rule, number);
}

/* The element that the keys make, and keys that do not belong to it: as rope_elements.c writes it. */
static bool read_kind(const reading *c)
{
    static const char *const stiff[] = {"axial_stiffness", "stiffness"};
    static const char *const elastic[] = {"damping", "preload"};
    static const char *const others[] = {"length",  "axial_stiffness", "stiffness",  "damping",
                                         "preload", "slack",           "restitution"};
    const kmp_yaml *slack = kmp_yaml_get(c->map, "slack"), *restitution = kmp_yaml_get(c->map, "restitution");
    const kmp_yaml *preload = kmp_yaml_get(c->map, "preload"), *force = kmp_yaml_get(c->map, "force");
    const int stiffness = kmp_count_keys(c->map, KMP_NAMES_OF(stiff), &(int){0});
    const bool taut = kmp_is_word(slack, "no");
    int other;
    if (force && kmp_count_keys(c->map, KMP_NAMES_OF(others), &other) > 0)
        return KMP_COMPLAIN(c, kmp_yaml_get(c->map, others[other]),
                            "a rope with a 'force' has no %s: its force is a law of distance and rate", others[other]);
    if (slack && !taut && !kmp_is_word(slack, "yes"))
        return KMP_COMPLAIN(c, slack, "slack is yes or no");
    if (stiffness > 1)
        return KMP_COMPLAIN(c, c->map, "'axial_stiffness' and 'stiffness' exclude each other");
    if (stiffness && taut)
        return KMP_COMPLAIN(c, slack, "an elastic rope only pulls; 'slack: no' is for an inextensible one");
    if (restitution && (stiffness || taut))
        return KMP_COMPLAIN(c, restitution, "restitution belongs to an inextensible rope that may be slack");
    for (int k = 0; k < 2 && !stiffness; k++)
        if (kmp_yaml_get(c->map, elastic[k]))
            return KMP_COMPLAIN(c, kmp_yaml_get(c->map, elastic[k]),
                                "%s belongs to a rope with 'stiffness' or 'axial_stiffness'", elastic[k]);
    if (preload && kmp_yaml_get(c->map, "length"))
        return KMP_COMPLAIN(c, preload, "the preload follows from 'length': give one of both");
    c->rope->kind = force ? KMP_ROPE_LAW : stiffness ? KMP_ROPE_ELASTIC : taut ? KMP_ROPE_TAUT : KMP_ROPE_PULLS;
    c->rope->axial = kmp_yaml_get(c->map, "axial_stiffness");
    c->rope->damped = kmp_yaml_get(c->map, "damping");
    return read_own(c, c->rope->axial ? stiff[0] : stiff[1], KMP_FIELD_POSITIVE, &c->rope->stiffness) &&
           read_own(c, "preload", KMP_FIELD_NOT_NEGATIVE, &c->rope->preload) &&
           read_own(c, "damping", KMP_FIELD_NOT_NEGATIVE, &(kmp_number){0});
}

/* Spheres and helices lie between two points, and a rope may leave one sheave of a part. Such parts have own planes.
 * The angle on a drum with layers follows one path. */
static bool check_parts(const reading *c)
{
    kmp_rope *rope = c->rope;
    int leaving = 0, own = 0, since = 0;
    bool turns = false, layered = false;
    for (int k = 0; k < rope->count; k++) {
        const kmp_rope_place *place = &rope->places[k];
        const bool alone = place->ball || place->helix;
        since = place->turn == 0 ? 0 : since + place->leaves;
        leaving += place->leaves;
        own += alone;
        turns = turns || place->turns;
        layered = layered || place->layers;
        const char *wrong = place->leaves && rope->closed && rope->count < 3
                                ? "a closed rope leaves a sheave only if two others remain"
                            : since > 1 ? "a rope may leave one of its sheaves between two points"
                            : alone && (rope->closed || rope->places[k - 1].turn != 0 || rope->places[k + 1].turn != 0)
                                ? "a sphere, or a cylinder with a helix, lies between two points"
                                : NULL;
        if (wrong)
            return KMP_COMPLAIN(c, c->list->items[k], "%s", wrong);
    }
    rope->parts = own > 0 || leaving > 1;
    const char *wrong = leaving > 0 && layered
                            ? "a rope with a drum whose radius is a table has no sheave with may_leave"
                        : turns && rope->kind == KMP_ROPE_LAW ? "a rope with a 'force' has neither drums nor friction"
                        : rope->parts && (turns || rope->closed)
                            ? "a rope over spheres or helices, or that may leave several sheaves, is open, and has "
                              "neither drums nor friction"
                            : NULL;
    return !wrong || KMP_COMPLAIN(c, c->list, "%s", wrong);
}

static void read_rope(const reading *c)
{
    const kmp_yaml *length = kmp_yaml_get(c->map, "length");
    const char *of = kmp_reader_say(c->r, "%s: %s", c->what, c->rope->closed ? "around" : "along");
    kmp_rope *rope = c->rope;
    bool good = read_kind(c);
    if (length) {
        double first;
        rope->length =
            kmp_read_function(c->r, length, kmp_reader_say(c->r, "%s: length", c->what), KMP_DIM_LENGTH, &first);
    }
    if (!c->list || !kmp_read_list(c->r, c->list, of, -1))
        return;
    if (c->list->count < 2) {
        KMP_COMPLAIN(c, c->list, "a path has two places or more");
        return;
    }
    rope->places = KMP_ARENA_NEW(&c->r->model->arena, kmp_rope_place, c->list->count);
    for (; rope->places && rope->count < c->list->count; rope->count++)
        good = read_place(c, rope->count) && good;
    if (!(good && rope->places && check_parts(c) && check_moves(c) && find_axes(c)))
        rope->count = 0; /* what uses it reports no further error */
}

void kmp_read_ropes(kmp_reader *r)
{
    static const char *const ways[] = {"along", "around"};
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "ropes", "rope");
    if (s.count == 0)
        return;
    kmp_pose_zero at = {0};
    model->ropes = KMP_ARENA_NEW(&model->arena, kmp_rope, s.count);
    if (!model->ropes || (!r->wrong && !kmp_pose_at_zero(model, &r->scratch, &at)))
        return;
    while (kmp_section_next(&s)) {
        kmp_rope *rope = &model->ropes[model->rope_count++];
        *rope = (kmp_rope){.name = s.name, .place = s.node->place, .plane = -1};
        const int way = kmp_read_map(r, s.node, s.what, rope_keys) && !r->wrong
                            ? kmp_read_one_key(r, s.node, s.what, KMP_NAMES_OF(ways))
                            : -1;
        rope->closed = way == 1;
        if (way >= 0)
            read_rope(&(reading){r, s.node, kmp_yaml_get(s.node, ways[way]), s.what, rope, &at});
    }
}

/* -- the start ----------------------------------------------------------------------------------------- */

/* A path at the start, in the axes of the ground. */
typedef struct start_path {
    kmp_reader *r;
    const kmp_pose *poses;
    const double *q;
    kmp_rope *rope;
    double axis[3];
    double (*centre)[3], (*along)[3], *length; /* of places; of spans, of a helix across its axis */
    double rise;                               /* of a helix, along its axis */
    int without;                               /* the place that the rope is off; -1: none */
} start_path;

static double signed_radius(const kmp_rope *rope, int k)
{
    return rope->places[k].turn * rope->places[k].radius.value;
}

static bool complain_inside(const start_path *p, int k, int next, double distance, double needed)
{
    const kmp_rope_place *places = p->rope->places;
    const double deep = 1e3 * (needed - distance);
    if (needed == 0)
        return kmp_reader_complain(p->r, p->rope->place, "rope '%s': '%s' and '%s' are at one place at the start",
                                   p->rope->name, place_name(p->r, p->rope, k), place_name(p->r, p->rope, next));
    if (places[k].turn != 0 && places[next].turn != 0)
        return kmp_reader_complain(
            p->r, p->rope->place,
            "rope '%s': at the start the rims at '%s' and '%s' overlap by %.6g mm, so that no span lies between them",
            p->rope->name, place_name(p->r, p->rope, k), place_name(p->r, p->rope, next), deep);
    const int round = places[k].turn != 0 ? k : next;
    return kmp_reader_complain(
        p->r, p->rope->place, "rope '%s': at the start point '%s' is %.6g mm inside the %s at '%s' (radius %.6g mm)",
        p->rope->name, place_name(p->r, p->rope, round == k ? next : k), deep, places[round].ball ? "sphere" : "sheave",
        place_name(p->r, p->rope, round), 1e3 * places[round].radius.value);
}

static bool find_span(start_path *p, int k)
{
    const int next = kmp_rope_next(p->rope, k, 1, p->without);
    double d[3], turned[3];
    for (int i = 0; i < 3; i++)
        d[i] = p->centre[next][i] - p->centre[k][i];
    const double deep = kmp_dot(3, d, p->axis), all = kmp_dot(3, d, d);
    for (int i = 0; i < 3; i++)
        d[i] -= deep * p->axis[i];
    const double square = kmp_dot(3, d, d), difference = signed_radius(p->rope, next) - signed_radius(p->rope, k);
    const double free = square - difference * difference;
    if (!(all - difference * difference > 0) || ((difference != 0 || p->rope->places[k].turn != 0) && !(free > 0)))
        return complain_inside(p, k, next, sqrt(square), fabs(difference));
    kmp_cross3(p->axis, d, turned);
    for (int i = 0; i < 3; i++)
        p->along[k][i] = square > 0 ? (sqrt(fmax(free, 0)) * d[i] - difference * turned[i]) / square : 0;
    p->length[k] = sqrt(all - difference * difference);
    if (p->without < 0 && p->rope->plane >= 0 && p->rope->places[p->rope->plane].helix) {
        p->length[k] = sqrt(free);
        p->rise += deep;
        return true;
    }
    if ((p->rope->places[k].turn != 0 || p->rope->places[next].turn != 0) && fabs(deep) > OBLIQUE * p->length[k])
        kmp_reader_warn(
            p->r, p->rope->place,
            "rope '%s': at the start the span from '%s' to '%s' is %.3g deg out of the plane of the sheave; "
            "its force there is right for small angles",
            p->rope->name, place_name(p->r, p->rope, k), place_name(p->r, p->rope, next),
            asin(fmin(fabs(deep) / p->length[k], 1)) * 360 / TURN);
    return true;
}

/* The angle from one direction to another one to the left about the axis. */
static double angle_between(const start_path *p, const double first[3], const double second[3])
{
    double n[3];
    kmp_cross3(first, second, n);
    return atan2(kmp_dot(3, p->axis, n), kmp_dot(3, first, second));
}

/* Angles of a place from its spans; the length of the rope on it. */
static double find_turn(const start_path *p, int k)
{
    kmp_rope_place *place = &p->rope->places[k];
    const double *in = p->along[k == 0 && !p->rope->closed ? 0 : kmp_rope_next(p->rope, k, -1, p->without)];
    if (place->turns) {
        const double(*r)[3] = p->poses[place->carrier].r;
        for (int i = 0; i < 3; i++)
            place->toward[i] = r[0][i] * in[0] + r[1][i] * in[1] + r[2][i] * in[2];
    }
    if (!kmp_rope_wraps(p->rope, k))
        return 0;
    double wrap = place->turn * angle_between(p, in, p->along[k]);
    if (wrap < -NO_WRAP && !place->leaves)
        wrap += TURN;
    place->wrap += wrap;
    return place->radius.value * place->wrap;
}

/* A coordinate at the start: as it is driven or written. */
static double start_coordinate(const kempe_model *model, int motion, const double *parameters)
{
    for (int c = 0; c < model->closure_count; c++)
        if (model->closures[c].kind == KMP_CLOSURE_drive && model->closures[c].motion == motion &&
            model->closures[c].function)
            return kmp_expr_value_at(model->closures[c].function, parameters, 0);
    return model->start.q[motion].value;
}

const kmp_pose *kmp_start_poses(kmp_reader *r, const double **q)
{
    const kempe_model *model = r->model;
    kmp_pose *poses = KMP_ARENA_NEW(&r->scratch, kmp_pose, model->body_count);
    double *start = KMP_ARENA_NEW(&r->scratch, double, model->motion_count + 1);
    *q = start;
    if (!poses || !start || !model->start.q)
        return NULL;
    for (int k = 0; k < model->motion_count; k++)
        start[k] = start_coordinate(model, k, r->parameter_values);
    kmp_pose_all(model, start, poses);
    return poses;
}

/* Neighbours of a place that the rope is off have the angles of the path without it. False: that path has no span. */
static bool find_left(start_path *p)
{
    const int k = kmp_rope_leaving(p->rope);
    if (k < 0)
        return true;
    (void)find_turn(p, k);
    if (!(p->rope->places[k].wrap < 0))
        return true;
    p->without = k;
    return find_span(p, kmp_rope_next(p->rope, k, -1, p->without));
}

/* The axis about which the rope turns to the left on a sphere. */
static bool find_plane_of_ball(start_path *p)
{
    double from[2][3], n;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            from[k][i] = p->centre[2 * k][i] - p->centre[1][i];
    kmp_cross3(from[0], from[1], p->axis);
    n = sqrt(kmp_dot(3, p->axis, p->axis));
    for (int i = 0; i < 3; i++)
        p->axis[i] /= n;
    return n > KMP_SAME_AXIS * sqrt(kmp_dot(3, from[0], from[0]) * kmp_dot(3, from[1], from[1])) ||
           kmp_reader_complain(p->r, p->rope->place,
                               "rope '%s': at the start '%s', '%s' and '%s' are in one line, so that the way round the "
                               "sphere is not defined",
                               p->rope->name, place_name(p->r, p->rope, 0), place_name(p->r, p->rope, 1),
                               place_name(p->r, p->rope, 2));
}

/* The length of a part; negative: it is wrong. */
static double settle(start_path *p)
{
    const kempe_model *model = p->r->model;
    const kmp_rope *rope = p->rope;
    double sum = 0;
    kmp_pose pose;
    for (int k = 0; k < rope->count; k++) {
        kmp_pose_of_point(model, p->poses, p->q, rope->places[k].point, &pose);
        memcpy(p->centre[k], pose.p, sizeof pose.p);
        if (k == rope->plane)
            for (int i = 0; i < 3; i++)
                p->axis[i] = pose.r[i][rope->places[k].axis];
    }
    if (rope->plane >= 0 && rope->places[rope->plane].ball && !find_plane_of_ball(p))
        return -1;
    for (int k = 0; k < kmp_rope_spans(rope); k++)
        if (!find_span(p, k))
            return -1;
    const int left = kmp_rope_leaving(rope);
    if (!find_left(p))
        return -1;
    for (int k = 0; k < kmp_rope_spans(rope); k++)
        sum += k == p->without ? 0 : p->length[k];
    for (int k = 0; k < rope->count; k++)
        if (k != left)
            sum += find_turn(p, k);
        else if (p->without < 0)
            sum += rope->places[k].radius.value * rope->places[k].wrap;
    return p->without < 0 ? hypot(sum, p->rise) : sum;
}

void kmp_settle_ropes(kmp_reader *r)
{
    const kempe_model *model = r->model;
    const double *q;
    const kmp_pose *poses = model->rope_count == 0 || r->wrong ? NULL : kmp_start_poses(r, &q);
    for (int k = 0; poses && k < model->rope_count; k++) {
        kmp_rope *rope = &model->ropes[k];
        const size_t count = (size_t)rope->count;
        double sum = 0, length;
        kmp_rope part;
        start_path p = {.r = r, .poses = poses, .q = q, .rope = &part};
        p.centre = kmp_arena_alloc(&r->scratch, count, sizeof *p.centre);
        p.along = kmp_arena_alloc(&r->scratch, count, sizeof *p.along);
        p.length = KMP_ARENA_NEW(&r->scratch, double, count);
        for (int first = 0; !r->scratch.failed && sum >= 0 && kmp_rope_part(rope, &first, &part);) {
            p.without = -1;
            p.rise = 0;
            length = settle(&p);
            sum = length < 0 ? -1 : sum + length;
        }
        length = rope->length ? kmp_expr_value_at(rope->length, r->parameter_values, 0) : sum;
        rope->at_start = length;
        if (sum >= 0 && rope->kind == KMP_ROPE_PULLS && length < sum - SHORT * sum)
            kmp_reader_complain(
                r, rope->place,
                "rope '%s': at the start its path is %.9g m long and its length is %.9g m: it is too short", rope->name,
                sum, length);
    }
}
