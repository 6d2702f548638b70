/* SPDX-License-Identifier: BSD-3-Clause */
/* Loop closures and drives. */
#include "model/read/reading.h"
#include <string.h>

typedef enum needs { NOTHING, LENGTH, AXIS, SAME_AXIS, TWO_AXES, CURVE, TERMS, EXPRESSION } needs;

typedef struct closure_kind {
    const char *name;
    needs needs;
} closure_kind;

static const closure_kind kinds[] = {
#define KMP_CLOSURE(name, needs) {#name, needs},
#include "model/closure_kinds.def"
#undef KMP_CLOSURE
};

enum { KINDS = sizeof kinds / sizeof kinds[0] };

static const char *const closure_keys[] = {
#define KMP_CLOSURE(name, needs) #name,
#include "model/closure_kinds.def"
#undef KMP_CLOSURE
    "length", "axis", "axes", "table", "y", "z", "curve", "equals", "power", NULL};

/* The kinds that accept a key. */
static const struct {
    const char *key;
    unsigned needs;
} takes[] = {{"length", 1u << LENGTH},
             {"axis", 1u << AXIS | 1u << SAME_AXIS},
             {"axes", 1u << SAME_AXIS | 1u << TWO_AXES},
             {"table", 1u << CURVE},
             {"y", 1u << CURVE},
             {"z", 1u << CURVE},
             {"curve", 1u << CURVE},
             {"equals", 1u << TERMS},
             {"power", 1u << EXPRESSION | 1u << CURVE}};

static void check_keys(kmp_reader *r, const kmp_yaml *map, const char *what, const closure_kind *kind)
{
    for (size_t k = 0; k < sizeof takes / sizeof *takes; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, takes[k].key);
        if (node && !(takes[k].needs & 1u << kind->needs))
            kmp_reader_complain(r, node->place, "%s: a %s closure has no %s", what, kind->name, takes[k].key);
    }
}

/* For a function of time the value at t = 0 is checked. */
static void read_length(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_closure *closure)
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

static const closure_kind *find_kind(kmp_reader *r, const kmp_yaml *map, const char *what)
{
    const closure_kind *kind = NULL;
    int found = 0;
    for (int i = 0; i < KINDS; i++)
        if (kmp_yaml_get(map, kinds[i].name)) {
            kind = &kinds[i];
            found++;
        }
    if (found == 1)
        return kind;
    const char *names = kinds[0].name;
    for (int i = 1; i < KINDS; i++)
        names = kmp_reader_say(r, "%s, %s", names, kinds[i].name);
    kmp_reader_complain(r, map->place, "%s: exactly one of the keys %s is expected, not %d", what, names, found);
    return NULL;
}

/* `axis` for both points, or `axes: [of the first, of the second]`; z without either. */
static void read_closure_axes(kmp_reader *r, const kmp_yaml *map, const char *what, const closure_kind *kind,
                              kmp_closure *closure)
{
    const kmp_yaml *axis = kmp_yaml_get(map, "axis"), *axes = kmp_yaml_get(map, "axes");
    closure->axis[0][2] = closure->axis[1][2] = 1;
    if (kind->needs == TWO_AXES && !axes)
        kmp_read_required(r, map, what, "axes");
    if (axis && axes)
        kmp_reader_complain(r, map->place, "%s: 'axis' and 'axes' exclude each other", what);
    if (axis && kmp_read_axis(r, axis, what, closure->axis[0]))
        memcpy(closure->axis[1], closure->axis[0], sizeof closure->axis[1]);
    if (axes && kmp_read_list(r, axes, kmp_reader_say(r, "%s: axes", what), 2))
        for (int k = 0; k < 2; k++)
            kmp_read_axis(r, axes->items[k], what, closure->axis[k]);
}

static void read_power(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *power = kmp_yaml_get(map, "power");
    kmp_number number = {.value = 1};
    if (power)
        kmp_read_number(r, power, kmp_reader_say(r, "%s: power", what), KMP_DIM_ANY, &number);
    kmp_reader_fix(r, &number);
    closure->power = (int)number.value;
    if (power && (closure->power != number.value || number.value < 0 || number.value > 2))
        kmp_reader_complain(r, power->place, "%s: the power of a length is 0, 1 or 2", what);
}

static void add_curve(kmp_closure *closure, const kmp_expr *expr, int side)
{
    if (!expr)
        return;
    closure->curve_side[closure->curve_count] = side;
    closure->curve[closure->curve_count++] = expr;
}

static bool has_condition(const kmp_expr *e)
{
    bool own = e && e->kind == KMP_EXPR_CALL && (e->function == KMP_FUNCTION_if || e->function == KMP_FUNCTION_sign);
    return e && (own || has_condition(e->a) || has_condition(e->b) || has_condition(e->c));
}

/* Rows are differentiated twice: no jumps. */
static void read_curve_expression(kmp_reader *r, const kmp_yaml *node, const char *what, int side, kmp_closure *closure)
{
    const kmp_expr *expr = kmp_read_curve(r, node, what, side ? KMP_DIM_LENGTH : KMP_DIM_ANY, side ? 1 : 3);
    if (has_condition(expr))
        kmp_reader_complain(r, node->place, "%s: a curve must be smooth, without 'if' and 'sign'", what);
    add_curve(closure, expr, side);
}

/* y = table(x), as an expression. */
static void read_curve_table(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_closure *closure)
{
    kmp_expr *x = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1), *of = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    closure->table = kmp_read_table_name(r, node, what);
    if (!closure->table || !x || !of)
        return;
    *x = (kmp_expr){.kind = KMP_EXPR_PLACE};
    *of = (kmp_expr){.kind = KMP_EXPR_TABLE, .table = closure->table, .a = x};
    add_curve(closure, of, 1);
}

/* One expression that is zero on the curve (or surface), or two, for surfaces that intersect in it. */
static void read_implicit(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_closure *closure)
{
    if (node->kind != KMP_YAML_LIST) {
        read_curve_expression(r, node, what, 0, closure);
        return;
    }
    if (node->count < 1 || node->count > 2) {
        kmp_reader_complain(r, node->place, "%s: curve has one expression or two, not %d", what, node->count);
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
        kmp_reader_complain(r, map->place, "%s: exactly one of table, y (and z), curve is expected", what);
        return;
    }
    if (table)
        read_curve_table(r, table, what, closure);
    if (y)
        read_curve_expression(r, y, kmp_reader_say(r, "%s: y", what), 1, closure);
    if (z)
        read_curve_expression(r, z, kmp_reader_say(r, "%s: z", what), 2, closure);
    if (curve) {
        read_implicit(r, curve, what, closure);
        read_power(r, map, what, closure);
    } else if (power) {
        kmp_reader_complain(r, power->place, "%s: y and z are lengths: power belongs to curve", what);
    }
}

/* {COORDINATE: factor, ...}; the factors bring the coordinates to the unit of the first one. */
static void read_terms(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *node = kmp_yaml_get(map, "coupler"), *equals = kmp_yaml_get(map, "equals");
    kmp_number *constant = equals ? KMP_ARENA_NEW(&r->model->arena, kmp_number, 1) : NULL;
    if (node->kind != KMP_YAML_MAP || node->count < 2) {
        kmp_reader_complain(r, node->place, "%s: a coupling has two coordinates or more, such as {A: 1, B: -2}", what);
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

static bool has_rate(const kmp_expr *e)
{
    return e && (e->kind == KMP_EXPR_QD || has_rate(e->a) || has_rate(e->b) || has_rate(e->c));
}

static void read_constraint(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *node = kmp_yaml_get(map, "constraint");
    closure->function = kmp_read_state(r, node, what, KMP_DIM_ANY);
    if (has_rate(closure->function))
        kmp_reader_complain(r, node->place, "%s: a constraint may depend on t and q(..), not on qd(..)", what);
    read_power(r, map, what, closure);
}

static void read_closure(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    if (!kmp_read_map(r, map, what, closure_keys))
        return;
    const closure_kind *kind = find_kind(r, map, what);
    if (!kind)
        return;
    closure->kind = kind->name;
    check_keys(r, map, what, kind);
    if (kind->needs == TERMS) {
        read_terms(r, map, what, closure);
        return;
    }
    if (kind->needs == EXPRESSION) {
        read_constraint(r, map, what, closure);
        return;
    }
    kmp_read_two_points(r, kmp_yaml_get(map, kind->name), what, closure->point);
    if (kind->needs == AXIS || kind->needs == SAME_AXIS || kind->needs == TWO_AXES)
        read_closure_axes(r, map, what, kind, closure);
    const kmp_yaml *length = kind->needs == LENGTH ? kmp_read_required(r, map, what, "length") : NULL;
    if (length)
        read_length(r, length, what, closure);
    if (kind->needs == CURVE)
        read_curve(r, map, what, closure);
}

/* -- drives -------------------------------------------------------------------------------------- */

static const char *const drive_keys[] = {"joint", "angle", "displacement", "locked", NULL};

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
        kmp_reader_complain(r, map->place, "%s: exactly one of the keys angle, displacement, locked is expected", what);
        return;
    }
    if (locked) {
        drive->kind = "lock";
        if (locked->kind != KMP_YAML_SCALAR || strcmp(locked->text, "yes") != 0)
            kmp_reader_complain(r, locked->place, "%s: locked is 'yes' or absent", what);
        return;
    }
    if (drive->motion < 0)
        return;
    const kmp_motion *m = &r->model->motions[drive->motion];
    const kmp_yaml *given = angle ? angle : displacement;
    if (m->rotation != (angle != NULL))
        kmp_reader_complain(r, given->place, "%s: '%s' is a %s, which is driven by '%s'", what, m->name,
                            m->rotation ? "rotation" : "translation", m->rotation ? "angle" : "displacement");
    else
        drive->function = kmp_read_function(r, given, what, kmp_motion_dimension(r->model, drive->motion, 0), &first);
}

bool kmp_closure_is_drive(const kmp_closure *closure)
{
    return strcmp(closure->kind, "drive") == 0 || strcmp(closure->kind, "lock") == 0;
}

/* True if the drive could be read; otherwise its error is reported already. */
static bool is_understood(const kmp_closure *drive)
{
    return drive->function || strcmp(drive->kind, "lock") == 0;
}

/* A coordinate has one drive; an unknown coordinate is reported already. */
static void check_driven(kmp_reader *r, int number)
{
    const kmp_closure *closures = r->model->closures;
    if (closures[number].motion < 0)
        return;
    for (int k = 0; k < number; k++)
        if (is_understood(&closures[number]) && is_understood(&closures[k]) && kmp_closure_is_drive(&closures[k]) &&
            closures[k].motion == closures[number].motion) {
            kmp_reader_complain(r, closures[number].place, "drive '%s': '%s' is already driven by '%s'",
                                closures[number].name, r->model->motions[closures[k].motion].name, closures[k].name);
            return;
        }
}

/* -- the whole ----------------------------------------------------------------------------------- */

static const kmp_closure *find_namesake(const kempe_model *model, int number)
{
    for (int k = 0; k < number; k++)
        if (strcmp(model->closures[k].name, model->closures[number].name) == 0)
            return &model->closures[k];
    return NULL;
}

static kmp_closure *add_closure(kmp_reader *r, const kmp_yaml *key, const char *what, const char *kind)
{
    kempe_model *model = r->model;
    kmp_closure *closure = &model->closures[model->closure_count];
    if (what)
        kmp_read_name(r, key, what);
    *closure = (kmp_closure){.kind = kind, .place = key->place, .point = {-1, -1}, .motion = -1};
    closure->name = kmp_arena_strdup(&model->arena, key->text);
    if (!closure->name)
        return NULL;
    if (what && find_namesake(model, model->closure_count))
        kmp_reader_complain(r, key->place, "a drive cannot have the name '%s' of a loop: lambda(%s) would be ambiguous",
                            closure->name, closure->name);
    model->closure_count++;
    return closure;
}

static void read_loops(kmp_reader *r, const kmp_yaml *map)
{
    for (int i = 0; i < map->count; i++) {
        kmp_closure *closure = add_closure(r, map->keys[i], "a loop", "");
        if (!closure)
            return;
        read_closure(r, map->items[i], kmp_reader_say(r, "loop '%s'", closure->name), closure);
    }
}

/* Joints between bodies that are cut; their names are checked where they are declared. */
static void read_cuts(kmp_reader *r, const kmp_yaml *map)
{
    for (int i = 0; i < map->count; i++) {
        kmp_closure *closure = add_closure(r, map->keys[i], NULL, "");
        if (!closure)
            return;
        if (map->items[i])
            read_closure(r, map->items[i], kmp_reader_say(r, "joint '%s'", closure->name), closure);
    }
}

static void read_drives(kmp_reader *r, const kmp_yaml *map)
{
    for (int i = 0; i < map->count; i++) {
        kmp_closure *drive = add_closure(r, map->keys[i], "a drive", "drive");
        if (!drive)
            return;
        read_drive(r, map->items[i], kmp_reader_say(r, "drive '%s'", drive->name), drive);
        check_driven(r, r->model->closure_count - 1);
    }
}

static int count_screws(const kempe_model *model)
{
    int count = 0;
    for (int b = 1; b < model->body_count; b++)
        count += model->bodies[b].screw;
    return count;
}

/* The coupling of a screw is called like its joint. */
static void add_screws(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int b = 1; b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        if (!body->screw || body->motion_count != 2)
            continue;
        kmp_closure *closure = &model->closures[model->closure_count];
        *closure = (kmp_closure){.name = body->joint,
                                 .kind = "screw",
                                 .place = body->place,
                                 .point = {-1, -1},
                                 .motion = body->first_motion,
                                 .length = body->pitch};
        const kmp_closure *other = find_namesake(model, model->closure_count);
        if (other)
            kmp_reader_complain(r, other->place,
                                "'%s' is the name of a screw joint, whose coupling is a closure of that name: "
                                "lambda(%s) would be ambiguous",
                                other->name, other->name);
        model->closure_count++;
    }
}

void kmp_read_closures(kmp_reader *r)
{
    const kmp_yaml *loops = kmp_yaml_get(r->root, "loops"), *drives = kmp_yaml_get(r->root, "drives");
    const kmp_yaml *cuts = kmp_linkage_cuts(r);
    bool has_loops = loops && kmp_read_map(r, loops, "loops", NULL);
    bool has_drives = drives && kmp_read_map(r, drives, "drives", NULL);
    int count = (has_loops ? loops->count : 0) + (cuts ? cuts->count : 0) + (has_drives ? drives->count : 0) +
                count_screws(r->model) + kmp_count_rigid_wheels(r->model);
    r->model->closures = KMP_ARENA_NEW(&r->model->arena, kmp_closure, count);
    if (!r->model->closures)
        return;
    if (has_loops)
        read_loops(r, loops);
    if (cuts)
        read_cuts(r, cuts);
    if (has_drives)
        read_drives(r, drives);
    add_screws(r);
    kmp_add_wheel_closures(r);
}
