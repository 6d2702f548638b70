/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and drives. */
#include "model/read/read_closures.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/read_cams.h"
#include "model/read/read_contacts.h"
#include "model/read/read_gears.h"
#include "model/read/read_linkage.h"
#include "model/read/read_reaction.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reader.h"
#include "model/read/reading.h"
#include <string.h>

/* The kinds that are keys of loops. */
static const struct {
    const char *name;
    kmp_closure_kind kind;
} kinds[] = {
#define KMP_CLOSURE(name, ...) {#name, KMP_CLOSURE_##name},
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
};

static const kmp_key closure_keys[] = {
#define KMP_CLOSURE(name, ...) {#name, "", ""},
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
#define KMP_CLOSURE_NUMBER(kind, key, unit, ...) {#key, unit, ""},
#include "model/data/closure_numbers.def"
#include "model/keys/closure_keys.def"
    {0}};

#define NEEDS(what) (1u << KMP_NEEDS_##what)

/* The kinds that accept a key; a number's own key belongs to the kind of its row. */
static const struct {
    const char *key;
    kmp_closure_kind kind; /* NONE: by what a kind needs */
    unsigned needs;
} takes[] = {
#define KMP_CLOSURE_NUMBER(kind, key, ...) {#key, KMP_CLOSURE_##kind, 0},
#include "model/data/closure_numbers.def"
    {"axis", KMP_CLOSURE_NONE, NEEDS(AXIS) | NEEDS(SAME_AXIS) | NEEDS(SHAFTS)},
    {"axes", KMP_CLOSURE_NONE, NEEDS(SAME_AXIS) | NEEDS(TWO_AXES) | NEEDS(SHAFTS)},
    {"plunging", KMP_CLOSURE_NONE, NEEDS(SHAFTS)},
    {"table", KMP_CLOSURE_NONE, NEEDS(CURVE)},
    {"y", KMP_CLOSURE_NONE, NEEDS(CURVE)},
    {"z", KMP_CLOSURE_NONE, NEEDS(CURVE)},
    {"curve", KMP_CLOSURE_NONE, NEEDS(CURVE)},
    {"roller", KMP_CLOSURE_NONE, NEEDS(FOLLOWER)},
    {"knife", KMP_CLOSURE_NONE, NEEDS(FOLLOWER)},
    {"flat", KMP_CLOSURE_NONE, NEEDS(FOLLOWER)},
    {"on", KMP_CLOSURE_NONE, NEEDS(FOLLOWER)},
    {"equals", KMP_CLOSURE_NONE, NEEDS(TERMS)},
    {"power", KMP_CLOSURE_NONE, NEEDS(EXPRESSION) | NEEDS(CURVE)}};

/* The number of its kind; for a function of time the value at t = 0 is checked. */
static void read_number(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_closure_number *own = kmp_closure_number_of(closure->kind);
    const kmp_yaml *node = kmp_read_required(r, map, what, own->key);
    const char *name = kmp_reader_say(r, "the %s of %s", own->key, what);
    double first = 0;
    const kmp_expr *expr =
        node ? kmp_read_function(r, node, name, kmp_key_dimension(closure_keys, own->key), &first) : NULL;
    if (!expr)
        return;
    closure->number = kmp_number_of(expr, first);
    if (!kmp_expr_is_constant(expr)) {
        closure->number.expr = NULL;
        closure->function = expr;
    }
    (void)kmp_check_rule(r, node, name, own->rule, first, own->hint);
}

static void read_power(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *power = kmp_yaml_get(map, "power");
    double value = 1;
    if (power)
        (void)kmp_read_fixed(r, power, kmp_reader_say(r, "%s: power", what), KMP_DIM_ANY, &value);
    closure->power = (int)value;
    if (power && (closure->power != value || value < 0 || value > 2))
        kmp_complain_of(r, power, what, "the power of a length is 0, 1 or 2");
}

static void add_curve(kmp_closure *closure, const kmp_expr *expr, int side)
{
    if (!expr)
        return;
    closure->curve_side[closure->curve_count] = side;
    closure->curve[closure->curve_count++] = expr;
}

static bool is_condition(const kmp_expr *e, const void *user)
{
    (void)user;
    return e->kind == KMP_EXPR_CALL && (e->function == KMP_FUNCTION_if || e->function == KMP_FUNCTION_sign);
}

/* Rows are differentiated twice: no jumps. */
static void read_curve_expression(kmp_reader *r, const kmp_yaml *node, const char *what, int side, kmp_closure *closure)
{
    const kmp_expr *expr =
        kmp_read_expr(r, node, what, side ? kmp_key_dimension(closure_keys, side == 1 ? "y" : "z") : KMP_DIM_ANY,
                      side ? KMP_OF_X : KMP_OF_PLACE);
    if (kmp_expr_find(expr, is_condition, NULL))
        kmp_complain_of(r, node, what, "a curve must be smooth, without 'if' and 'sign'");
    add_curve(closure, expr, side);
}

/* One expression that is zero on the curve (or surface), or two, for surfaces that intersect in it. */
static void read_implicit(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_closure *closure)
{
    if (node->kind != KMP_YAML_LIST) {
        read_curve_expression(r, node, what, 0, closure);
        return;
    }
    if (node->count < 1 || node->count > 2) {
        kmp_complain_of(r, node, what, "curve has one expression or two, not %d", node->count);
        return;
    }
    for (int k = 0; k < node->count; k++)
        read_curve_expression(r, node->items[k], what, 0, closure);
}

static void read_curve(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *table = kmp_yaml_get(map, "table"), *y = kmp_yaml_get(map, "y"), *z = kmp_yaml_get(map, "z");
    const kmp_yaml *curve = kmp_yaml_get(map, "curve"), *power = kmp_yaml_get(map, "power");
    closure->power = 1;
    if ((table != NULL) + (y || z) + (curve != NULL) != 1) {
        kmp_complain_of(r, map, what, "exactly one of table, y (and z), curve is expected");
        return;
    }
    if (table) { /* y = table(x), as an expression */
        closure->table = kmp_read_table_name(r, table, what);
        const kmp_expr *x = kmp_expr_make(&r->model->arena, (kmp_expr){.kind = KMP_EXPR_PLACE});
        const kmp_expr *of =
            kmp_expr_make(&r->model->arena, (kmp_expr){.kind = KMP_EXPR_TABLE, .table = closure->table, .a = x});
        if (closure->table && x && of)
            add_curve(closure, of, 1);
    }
    if (y)
        read_curve_expression(r, y, kmp_reader_say(r, "%s: y", what), 1, closure);
    if (z)
        read_curve_expression(r, z, kmp_reader_say(r, "%s: z", what), 2, closure);
    if (curve) {
        read_implicit(r, curve, what, closure);
        read_power(r, map, what, closure);
    } else if (power) {
        kmp_complain_of(r, power, what, "y and z are lengths: power belongs to curve");
    }
}

/* {COORDINATE: factor, ...}; the factors bring the coordinates to the unit of the first one. */
static void read_terms(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *node = kmp_yaml_get(map, "coupler"), *equals = kmp_yaml_get(map, "equals");
    kmp_number *constant = equals ? KMP_ARENA_NEW(&r->model->arena, kmp_number, 1) : NULL;
    if (node->kind != KMP_YAML_MAP || node->count < 2) {
        kmp_complain_of(r, node, what, "a coupling has two coordinates or more, such as {A: 1, B: -2}");
        return;
    }
    closure->terms = KMP_ARENA_NEW(&r->model->arena, kmp_term, node->count);
    for (int k = 0; closure->terms && k < node->count; k++) {
        kmp_term *term = &closure->terms[k];
        const char *of = kmp_reader_say(r, "%s: the factor of '%s'", what, node->keys[k]->text);
        term->motion = kmp_read_motion(r, node->keys[k], what);
        if (term->motion < 0 || !kmp_read_number(r, node->items[k], of, KMP_DIM_ANY, &term->factor))
            continue;
        closure->term_count++;
        if (term->factor.value == 0)
            kmp_reader_complain(r, node->items[k]->place, "%s is zero", of);
    }
    closure->motion = closure->term_count == node->count ? closure->terms[0].motion : -1;
    if (constant && kmp_read_number(r, equals, kmp_reader_say(r, "%s: equals", what), KMP_DIM_ANY, constant))
        closure->constant = constant;
}

static void read_constraint(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *node = kmp_yaml_get(map, "constraint");
    closure->function = kmp_read_expr(r, node, what, KMP_DIM_ANY, KMP_OF_STATE);
    const kmp_expr *rate = kmp_expr_find(closure->function, kmp_expr_is_rate, NULL);
    const kmp_state *state = rate && rate->kind == KMP_EXPR_QD ? kmp_state_of(r->model, rate->index) : NULL;
    if (state)
        kmp_complain_of(r, node, what, "a constraint may depend on t, q(..) and positions, not on state '%s'",
                        state->name);
    else if (rate)
        kmp_complain_of(r, node, what,
                        "a constraint may depend on t, q(..) and positions, not on qd(..) and other rates");
    read_power(r, map, what, closure);
}

/* `axis` for both points, or `axes: [of the first, of the second]`; z without either. */
static void read_closure_axes(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *axis = kmp_yaml_get(map, "axis"), *axes = kmp_yaml_get(map, "axes");
    closure->axis[0][2] = closure->axis[1][2] = 1;
    if (kmp_closure_row_of(closure)->needs == KMP_NEEDS_TWO_AXES && !axes)
        kmp_read_required(r, map, what, "axes");
    if (axis && axes)
        kmp_complain_of(r, map, what, "'axis' and 'axes' exclude each other");
    if (axis && kmp_read_axis(r, axis, what, closure->axis[0]))
        memcpy(closure->axis[1], closure->axis[0], sizeof closure->axis[1]);
    if (axes && kmp_read_list(r, axes, kmp_reader_say(r, "%s: axes", what), 2))
        for (int k = 0; k < 2; k++)
            kmp_read_axis(r, axes->items[k], what, closure->axis[k]);
}

/* A joint of constant velocity whose points move apart: along the first shaft, or freely. */
static void read_plunging(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    static const char *const words[] = {"yes", "free"};
    const int word = kmp_read_choice_of(r, map, "plunging", what, KMP_NAMES_OF(words), "plunging is", -1);
    if (word >= 0)
        closure->kind = word == 0 ? KMP_CLOSURE_constant_velocity_plunging : KMP_CLOSURE_constant_velocity_free;
}

/* Some kinds have keys in addition to two points, or in place of them. */
static void read_closure(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    static const struct {
        unsigned needs;
        void (*read)(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure);
    } parts[] = {{NEEDS(TERMS), read_terms},
                 {NEEDS(EXPRESSION), read_constraint},
                 {NEEDS(FOLLOWER), kmp_read_follower},
                 {NEEDS(AXIS) | NEEDS(SAME_AXIS) | NEEDS(TWO_AXES) | NEEDS(SHAFTS), read_closure_axes},
                 {NEEDS(SHAFTS), read_plunging},
                 {NEEDS(NUMBER), read_number},
                 {NEEDS(CURVE), read_curve}};
    if (!kmp_read_map(r, map, what, closure_keys))
        return;
    int found = kmp_read_one_key(r, map, what, KMP_NAMES_OF(kinds));
    if (found < 0)
        return;
    closure->kind = kinds[found].kind;
    const kmp_closure_row *row = kmp_closure_row_of(closure);
    const kmp_closure_number *own = kmp_closure_number_of(closure->kind);
    for (size_t k = 0; k < sizeof takes / sizeof *takes; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, takes[k].key);
        bool good = takes[k].kind ? own && strcmp(own->key, takes[k].key) == 0 : takes[k].needs & 1u << row->needs;
        if (node && !good)
            kmp_complain_of(r, node, what, "a %s closure has no %s", row->name, takes[k].key);
    }
    if (row->needs != KMP_NEEDS_TERMS && row->needs != KMP_NEEDS_EXPRESSION && row->needs != KMP_NEEDS_FOLLOWER)
        kmp_read_two_points(r, kmp_yaml_get(map, row->name), what, closure->point);
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++)
        if (parts[k].needs & 1u << row->needs)
            parts[k].read(r, map, what, closure);
}

/* -- drives -------------------------------------------------------------------------------------- */

static const kmp_key drive_keys[] = {
#include "model/keys/drive_keys.def"
    {0}};

static void read_drive(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *drive)
{
    double first;
    if (!kmp_read_map(r, map, what, drive_keys))
        return;
    const kmp_yaml *joint = kmp_read_required(r, map, what, "joint");
    const kmp_yaml *angle = kmp_yaml_get(map, "angle"), *displacement = kmp_yaml_get(map, "displacement");
    const kmp_yaml *locked = kmp_yaml_get(map, "locked");
    drive->motion = joint ? kmp_read_motion(r, joint, what) : -1;
    if ((angle != NULL) + (displacement != NULL) + (locked != NULL) != 1) {
        kmp_complain_of(r, map, what,
                        "exactly one of the keys angle, displacement, locked is expected; a constant speed is a "
                        "function of t, as angle: 60 rpm*t");
        return;
    }
    if (locked) {
        drive->kind = KMP_CLOSURE_lock;
        if (!kmp_is_word(locked, "yes"))
            kmp_complain_of(r, locked, what, "locked is 'yes' or absent");
        return;
    }
    if (drive->motion < 0)
        return;
    const kmp_motion *m = &r->model->motions[drive->motion];
    const kmp_yaml *given = angle ? angle : displacement;
    if (m->rotation != (angle != NULL))
        kmp_complain_of(r, given, what, "'%s' is a %s, which is driven by '%s'", m->name,
                        m->rotation ? "rotation" : "translation", m->rotation ? "angle" : "displacement");
    else
        drive->function = kmp_read_function(r, given, what, kmp_motion_dimension(r->model, drive->motion, 0), &first);
}

/* True if the drive could be read; otherwise its error is reported already. */
static bool is_understood(const kmp_closure *drive)
{
    return drive->function || drive->kind == KMP_CLOSURE_lock;
}

/* A coordinate has one drive; an unknown coordinate is reported already. */
static void check_driven(kmp_reader *r, int number)
{
    const kmp_closure *drive = &r->model->closures[number], *other = r->model->closures;
    if (drive->motion < 0 || !is_understood(drive))
        return;
    while (other < drive && !(is_understood(other) && kmp_closure_is_drive(other) && other->motion == drive->motion))
        other++;
    if (other < drive)
        kmp_reader_complain(r, drive->place, "drive '%s': '%s' is already driven by '%s'", drive->name,
                            r->model->motions[drive->motion].name, other->name);
}

/* -- the whole ----------------------------------------------------------------------------------- */

kmp_closure *kmp_add_closure(kmp_reader *r, const char *name, kmp_closure_kind kind, kmp_place place)
{
    kmp_closure *closure = &r->model->closures[r->model->closure_count++];
    *closure = (kmp_closure){.name = name, .kind = kind, .place = place, .point = {-1, -1}, .motion = -1};
    return closure;
}

void kmp_add_row(kmp_reader *r, kmp_force *force, kmp_closure_kind kind, bool turns)
{
    kmp_closure *row = kmp_add_closure(r, force->name, kind, force->place);
    row->force = (int)(force - r->model->forces);
    row->power = turns ? 0 : 1;
    force->closure = (int)(row - r->model->closures);
}

/* Joints between bodies that are cut; their names are checked where they are declared. */
static void read_cuts(kmp_reader *r, const kmp_yaml *map)
{
    for (int i = 0; i < map->count; i++) {
        const char *name = kmp_arena_strdup(&r->model->arena, map->keys[i]->text);
        if (!name)
            return;
        kmp_closure *closure = kmp_add_closure(r, name, KMP_CLOSURE_NONE, map->keys[i]->place);
        if (map->items[i])
            read_closure(r, map->items[i], kmp_reader_say(r, "joint '%s'", name), closure);
        if (map->items[i] && !r->wrong)
            kmp_linkage_read_coordinates(r, map->items[i], closure);
    }
}

/* The coupling of a joint with a number, a closure of the kind's and of the joint's name. */
static void add_couplings(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int b = 1; b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        if (!body->coupling || body->motion_count != 2)
            continue;
        int other = kmp_name_find(KMP_NAMED(model, closure), body->joint);
        if (other >= 0)
            kmp_reader_complain(r, model->closures[other].place,
                                "'%s' is the name of a %s joint, whose coupling is a closure of that name: "
                                "lambda(%s) would be ambiguous",
                                body->joint, body->coupling->name, body->joint);
        kmp_closure *closure =
            kmp_add_closure(r, body->joint, kmp_closure_kind_find(body->coupling->name), body->place);
        closure->motion = body->first_motion;
        closure->number = body->number;
    }
}

/* No two closures have the same name. */
static void check_named(kmp_reader *r, const kmp_section *section)
{
    if (kmp_name_find(KMP_NAMED(r->model, closure), section->name) >= 0)
        kmp_reader_complain(r, section->key->place,
                            "a %s cannot have the name '%s' of a loop: lambda(%s) would be ambiguous", section->kind,
                            section->name, section->name);
}

void kmp_read_closures(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section loops = kmp_read_section(r, "loops", "loop"), drives = kmp_read_section(r, "drives", "drive");
    kmp_section gears = kmp_read_section(r, "gears", "gear");
    const kmp_yaml *cuts = kmp_linkage_cuts(r);
    int count =
        loops.count + gears.count + (cuts ? cuts->count : 0) + drives.count + model->body_count + model->wheel_count;
    const kmp_yaml *forces = kmp_yaml_get(r->root, "forces");
    count += (forces ? forces->count : 0) + kmp_contacts_count(r); /* frictions with modes have a row */
    count += kmp_count_pressed(model);
    model->closures = KMP_ARENA_NEW(&model->arena, kmp_closure, count);
    if (!model->closures)
        return;
    while (kmp_section_next(&loops))
        read_closure(r, loops.node, loops.what, kmp_add_closure(r, loops.name, KMP_CLOSURE_NONE, loops.key->place));
    if (cuts)
        read_cuts(r, cuts);
    while (kmp_section_next(&gears)) {
        check_named(r, &gears);
        kmp_read_gear(r, gears.node, gears.what, kmp_add_closure(r, gears.name, KMP_CLOSURE_gear, gears.key->place));
    }
    while (kmp_section_next(&drives)) {
        check_named(r, &drives);
        read_drive(r, drives.node, drives.what, kmp_add_closure(r, drives.name, KMP_CLOSURE_drive, drives.key->place));
        check_driven(r, model->closure_count - 1);
    }
    add_couplings(r);
    kmp_lock_pressed(r);
    kmp_read_wings(r, KMP_READ_AFTER_CLOSURES);
}
