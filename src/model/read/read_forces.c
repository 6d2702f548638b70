/* SPDX-License-Identifier: BSD-3-Clause */
/* Force elements: the rows of force_kinds.def. */
#include "model/read/read_forces.h"
#include "base/context.h"
#include "linalg/dense/lapack.h"
#include "model/data/bushing_matrix.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/read_closures.h"
#include "model/read/read_contacts.h"
#include "model/read/read_reaction.h"
#include "model/read/read_states.h"
#include "model/read/read_thread.h"
#include "model/read/read_values.h"
#include "model/read/reader.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

/* An eigenvalue below this part of the largest one, or of the diagonal, is rounding of zero. */
#define INDEFINITE 1e-12

static const kmp_key force_keys[] = {
#include "model/keys/force_keys.def"
    {0}};

static const char *const places[] = {"joint",   "spring", "line", "cylinder", "torsion",
                                     "bushing", "at",     "on",   "sliding"};

/* An element being read. */
typedef struct element {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_force *force;
    kmp_expr_locals locals; /* of its law */
} element;

/* -- choice -------------------------------------------------------------------------------------- */

/* The key for the place of action; `spring` is the kind when there is a joint. */
static const char *find_place(const element *e)
{
    int place = -1, count = kmp_count_keys(e->map, KMP_NAMES_OF(places), &place);
    count -= kmp_yaml_get(e->map, "joint") && kmp_yaml_get(e->map, "spring");
    if (count == 1)
        return places[place];
    kmp_complain_keys(e->r, e->map->place, e->what, KMP_NAMES_OF(places), count);
    return NULL;
}

static void complain_words(const element *e, const char *place, int found)
{
    if (strcmp(place, "joint") == 0)
        KMP_COMPLAIN(e, e->map,
                     "exactly one of the keys torque, force, spring, stops, friction is expected with 'joint', not %d",
                     found);
    for (int k = 0; k < KMP_FORCE_KINDS && strcmp(place, "joint") != 0; k++)
        if (strcmp(kmp_force_rows[k].place, place) == 0)
            kmp_read_required(e->r, e->map, e->what, kmp_force_rows[k].word);
}

static int find_kind(const element *e, const char *place)
{
    int kind = -1, found = 0;
    if (strcmp(place, "sliding") == 0) {
        static const char *const words[] = {"friction", "force", "torque"};
        const int word = kmp_read_one_key(e->r, e->map, e->what, KMP_NAMES_OF(words));
        return word < 0 ? -1 : word == 0 ? KMP_FORCE_FRICTION : KMP_FORCE_ALONG;
    }
    for (int k = 0; k < KMP_FORCE_KINDS; k++) {
        const char *word = kmp_force_rows[k].word;
        bool effort = word && strcmp(word, "effort") == 0;
        bool given = !word || (effort ? kmp_yaml_get(e->map, "torque") || kmp_yaml_get(e->map, "force")
                                      : kmp_yaml_get(e->map, word) != NULL);
        if (strcmp(kmp_force_rows[k].place, place) == 0 && given) {
            kind = k;
            found++;
        }
    }
    if (kind == KMP_FORCE_JOINT && kmp_yaml_get(e->map, "torque") && kmp_yaml_get(e->map, "force"))
        found++;
    if (found == 1)
        return kind;
    complain_words(e, place, found);
    return -1;
}

/* -- numbers ------------------------------------------------------------------------------------- */

static bool turns_about(const element *e)
{
    return e->force->motion >= 0 ? e->r->model->motions[e->force->motion].rotation : e->force->turns;
}

static kmp_dimension dimension_of(const element *e, const kmp_force_field *field)
{
    const bool rotation = turns_about(e);
    kmp_dimension d = kmp_dimension_power(rotation ? KMP_DIM_TORQUE : KMP_DIM_FORCE, field->effort);
    d = kmp_dimension_times(d, rotation ? KMP_DIM_NUMBER : KMP_DIM_LENGTH, field->coordinate);
    d.angle = rotation && field->coordinate == 1 && field->effort == 0;
    return kmp_dimension_times(d, KMP_DIM_TIME, field->time);
}

/* A level of friction, or a coefficient, that is read. */
typedef struct level_reading {
    kmp_reader *r;
    const char *name;
    kmp_dimension dimension;
    const kmp_expr *reaction, *radius; /* factors of a coefficient; NULL: none */
    bool bounded;                      /* it has a limit in both directions */
} level_reading;

static const kmp_expr *product(kmp_reader *r, const kmp_expr *a, const kmp_expr *b)
{
    return kmp_expr_make(&r->model->arena, (kmp_expr){.kind = KMP_EXPR_MUL, .a = a, .b = b});
}

/* A level, or a coefficient times a reaction, and times a radius if there is one. */
static const kmp_expr *read_one_level(const level_reading *x, const kmp_yaml *node)
{
    const kmp_expr *level = kmp_read_expr(x->r, node, x->name, x->dimension, KMP_OF_LOADS);
    if (!level || !x->reaction)
        return level;
    level = product(x->r, level, x->reaction);
    return x->radius && level ? product(x->r, x->radius, level) : level;
}

/* The level against rates of one sign. */
static const kmp_expr *read_side(const level_reading *x, const kmp_yaml *node)
{
    if (!kmp_is_word(node, "unlimited")) {
        const kmp_expr *level = read_one_level(x, node);
        const kmp_expr *factor = level && x->radius ? level->b : level;
        factor = factor && x->reaction ? factor->a : factor;
        const bool constant = factor && kmp_expr_is_constant(factor);
        const double value = constant ? kmp_expr_value(factor, x->r->parameter_values) : 0;
        return kmp_check_rule(x->r, node, x->name, KMP_FIELD_NOT_NEGATIVE, value, "") ? level : NULL;
    }
    if (!x->bounded)
        return kmp_expr_make(&x->r->model->arena, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = INFINITY});
    kmp_reader_complain(x->r, node->place, "%s: a static level has a limit; make the level itself unlimited", x->name);
    return NULL;
}

/* A level, or a list of one against positive rates and one against negative ones. */
static const kmp_expr *read_levels(const level_reading *x, const kmp_yaml *node)
{
    if (!node || node->kind != KMP_YAML_LIST)
        return node ? read_one_level(x, node) : NULL;
    if (node->count != 2) {
        kmp_reader_complain(x->r, node->place,
                            "%s: a list has two levels: against positive rates, and against negative ones", x->name);
        return NULL;
    }
    const kmp_expr *a = read_side(x, node->items[0]), *b = read_side(x, node->items[1]);
    if (!a || !b)
        return NULL;
    if (kmp_expr_is_unlimited(a) && kmp_expr_is_unlimited(b))
        kmp_reader_complain(x->r, node->place, "%s: only one direction may be unlimited; use a lock", x->name);
    return kmp_expr_make(&x->r->model->arena, (kmp_expr){.kind = KMP_EXPR_SIDES, .a = a, .b = b});
}

/* Reads the level of a friction force if it is an expression. false: the level is a number, which the caller reads. */
static bool is_law(const element *e, const kmp_force_field *field, const kmp_yaml *node, const char *name)
{
    static const char *const by_reaction[] = {"mu", "mu_static", "radius", "flank"}, *const speeds[] = {"speed",
                                                                                                        "regularise"};
    bool level = strcmp(field->key, "effort") == 0;
    if (e->force->kind != KMP_FORCE_FRICTION || kmp_name_find(KMP_NAMES_OF(speeds), field->key) >= 0)
        return false;
    if (kmp_name_find(KMP_NAMES_OF(by_reaction), field->key) >= 0)
        return true; /* read_reaction */
    const level_reading reading = {.r = e->r, .name = name, .dimension = dimension_of(e, field), .bounded = !level};
    const kmp_expr *law = read_levels(&reading, node);
    if (law && law->kind != KMP_EXPR_SIDES && kmp_expr_is_constant(law))
        return false;
    *(level ? &e->force->effort : &e->force->holding_effort) = law;
    return true;
}

/* The numbers of the element, keys of `map`. */
static void read_fields(const element *e, const kmp_yaml *map, const char *what)
{
    for (int k = 0; k < kmp_force_field_count; k++) {
        const kmp_force_field *field = &kmp_force_fields[k];
        if (field->kind != e->force->kind)
            continue;
        const char *key = kmp_force_key(e->r->model, e->force, field->key);
        const kmp_yaml *node = kmp_yaml_get(map, key);
        if (!node && field->required)
            kmp_read_required(e->r, map, what, key);
        if (!node)
            continue;
        const char *name = kmp_reader_say(e->r, "the %s of %s", key, e->what);
        if (is_law(e, field, node, name))
            continue;
        bool good = (field->size == 3 ? kmp_read_one_or_three : kmp_read_number)(
            e->r, node, name, dimension_of(e, field), kmp_force_number(e->force, k));
        for (int i = 0; good && i < field->size; i++)
            (void)kmp_check_rule(e->r, node, name, field->rule, kmp_force_get(e->force, k)[i].value, "");
    }
}

/* Coefficients times a reaction, and times a radius if there is one. */
static const kmp_expr *read_coefficient(const element *e, const kmp_yaml *map, const char *what, const char *key,
                                        const kmp_expr *reaction, const kmp_expr *radius)
{
    const level_reading reading = {.r = e->r,
                                   .name = kmp_reader_say(e->r, "the %s of %s", key, what),
                                   .dimension = KMP_DIM_NUMBER,
                                   .reaction = reaction,
                                   .radius = radius,
                                   .bounded = strcmp(key, "mu_static") == 0};
    const kmp_expr *level = read_levels(&reading, kmp_yaml_get(map, key));
    return reaction ? level : NULL;
}

/* Levels by a coefficient and a reaction. */
static void read_by_reaction(const element *e, const kmp_yaml *map, const char *what)
{
    kmp_reader *r = e->r;
    kmp_force *force = e->force;
    const kmp_yaml *node = kmp_yaml_get(map, "radius");
    const bool turns = turns_about(e);
    if (turns != (node != NULL))
        kmp_reader_complain(r, map->place,
                            turns ? "%s: mu needs a radius here, because the motion is a rotation"
                                  : "%s: a radius is for rotations, and this motion is a translation",
                            what);
    const kmp_expr *reaction = kmp_read_reaction(r, force, map, what);
    const kmp_expr *radius = turns && node ? kmp_read_expr(r, node, kmp_reader_say(r, "the radius of %s", what),
                                                           KMP_DIM_LENGTH, KMP_OF_LOADS)
                                           : NULL;
    force->effort = read_coefficient(e, map, what, "mu", reaction, radius);
    force->has_static = kmp_yaml_get(map, "mu_static");
    if (force->has_static)
        force->holding_effort = read_coefficient(e, map, what, "mu_static", reaction, radius);
}

/* The level of friction, by its own key or by a reaction. */
static void read_level(const element *e, const kmp_yaml *map, const char *what)
{
    static const char *const others[] = {"mu_static", "radius", "flank", "reaction"};
    kmp_reader *r = e->r;
    const char *own = kmp_force_key(r->model, e->force, "effort");
    e->force->has_static = kmp_yaml_get(map, "static");
    if ((kmp_yaml_get(map, own) != NULL) + (kmp_yaml_get(map, "mu") != NULL) != 1) {
        kmp_complain_of(r, map, what, "exactly one of the keys %s, mu is expected", own);
        return;
    }
    if (kmp_yaml_get(map, "mu") && e->force->has_static)
        kmp_complain_of(r, map, what, "the static level of friction with mu is given by mu_static");
    const kmp_yaml *flank = kmp_yaml_get(map, "flank");
    if (kmp_is_thread(r->model, e->force, map))
        kmp_read_thread(r, map, what, e->force);
    else if (kmp_yaml_get(map, "mu") && flank)
        kmp_complain_of(r, flank, what, "a flank is for the thread of a screw, on its own rotation");
    else if (kmp_yaml_get(map, "mu"))
        read_by_reaction(e, map, what);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (!kmp_yaml_get(map, "mu") && kmp_yaml_get(map, others[k]))
            kmp_complain_of(r, map, what, "%s is for friction with mu", others[k]);
}

/* The row of friction that sticks, a closure of its name. */
static void add_friction_row(const element *e, const kmp_yaml *map)
{
    kempe_model *model = e->r->model;
    kmp_force *force = e->force;
    force->has_speed = kmp_yaml_get(map, "speed");
    if (force->has_speed && force->has_static)
        KMP_COMPLAIN(e, map, "friction with a speed has no static level, because it does not stick");
    if (force->has_speed && kmp_force_has_sides(force))
        KMP_COMPLAIN(e, map,
                     "friction with a speed has one level for both directions, because it does not stick; use a level "
                     "with if(qd(..) > 0, ..)");
    force->has_regularise = kmp_yaml_get(map, "regularise");
    if (force->has_regularise && kmp_force_unlimited(force) != 0)
        KMP_COMPLAIN(e, map, "unlimited friction cannot be regularised");
    if (force->has_speed && force->has_regularise)
        KMP_COMPLAIN(e, map, "friction with a speed is regularised at all times");
    if (force->has_speed)
        return;
    if (kmp_name_find(KMP_NAMED(model, closure), force->name) >= 0)
        kmp_reader_complain(e->r, force->place,
                            "friction that sticks cannot have the name '%s' of a loop or drive: lambda(%s) would be "
                            "ambiguous",
                            force->name, force->name);
    kmp_add_row(e->r, force, KMP_CLOSURE_friction, turns_about(e));
}

/* -- elements ------------------------------------------------------------------------------------ */

/* The law of a force, which knows a quantity and its rate by name. */
static const kmp_expr *read_law(const element *e, const kmp_yaml *node, kmp_dimension wanted)
{
    e->r->locals = &e->locals;
    const kmp_expr *law = kmp_read_expr(e->r, node, e->what, wanted, KMP_OF_LOADS);
    e->r->locals = NULL;
    return law;
}

static void set_locals(element *e, const char *name, const kmp_expr *quantity, const kmp_expr *rate, bool yields)
{
    e->locals = (kmp_expr_locals){2, {{name, quantity, yields}, {"rate", rate, yields}}};
}

/* At a joint, names of the model have priority. */
static void set_joint_locals(element *e)
{
    kmp_arena *arena = &e->r->model->arena;
    int motion = e->force->motion;
    const kmp_expr *q = kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_Q, .index = motion}),
                   *qd = kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_QD, .index = motion});
    if (motion < 0 || !q || !qd)
        return;
    set_locals(e, e->r->model->motions[motion].rotation ? "angle" : "distance", q, qd, true);
}

/* The keys of an element's own mapping. */
static const kmp_key *keys_of(const element *e)
{
    kmp_key *keys = KMP_ARENA_NEW(&e->r->scratch, kmp_key, kmp_force_field_count + 2);
    int count = 0;
    if (keys && e->force->kind == KMP_FORCE_FRICTION)
        keys[count++].name = "reaction";
    for (int k = 0; keys && k < kmp_force_field_count; k++)
        if (kmp_force_fields[k].kind == e->force->kind)
            keys[count++].name = kmp_force_key(e->r->model, e->force, kmp_force_fields[k].key);
    return keys;
}

static void check_stops(const element *e, const kmp_yaml *map)
{
    kmp_force *force = e->force;
    force->has_lower = kmp_yaml_get(map, "lower");
    force->has_upper = kmp_yaml_get(map, "upper");
    if (!force->has_lower && !force->has_upper)
        KMP_COMPLAIN(e, map, "at least one of the keys lower, upper is expected");
    else if (force->has_lower && force->has_upper && force->lower.value >= force->upper.value && !e->r->wrong)
        KMP_COMPLAIN(e, map, "lower is %.6g, which is not below upper, %.6g", force->lower.value, force->upper.value);
}

/* The own mapping of a kind. */
static void read_own(const element *e)
{
    const kmp_yaml *map = kmp_yaml_get(e->map, kmp_force_rows[e->force->kind].word);
    const char *what = kmp_reader_say(e->r, "%s of %s", kmp_force_rows[e->force->kind].word, e->what);
    const kmp_key *keys = keys_of(e);
    if (!keys || !kmp_read_map(e->r, map, what, keys))
        return;
    read_fields(e, map, what);
    if (e->force->kind == KMP_FORCE_STOPS)
        check_stops(e, map);
    if (e->force->kind == KMP_FORCE_FRICTION) {
        read_level(e, map, what);
        add_friction_row(e, map);
    }
}

/* A rotation has a torque, a translation a force: the other word shows that another motion is intended. */
static void read_effort(const element *e)
{
    kmp_reader *r = e->r;
    const kmp_yaml *torque = kmp_yaml_get(e->map, "torque"), *effort = torque ? torque : kmp_yaml_get(e->map, "force");
    int motion = e->force->motion;
    kmp_dimension wanted = motion >= 0          ? kmp_effort_dimension(r->model, motion)
                           : !e->force->sliding ? KMP_DIM_ANY
                           : e->force->turns    ? KMP_DIM_TORQUE
                                                : KMP_DIM_FORCE;
    if (effort && motion >= 0 && r->model->motions[motion].rotation != (effort == torque)) {
        const kmp_motion *m = &r->model->motions[motion];
        kmp_complain_of(r, effort, e->what, "'%s' is a %s, which takes a '%s', not a '%s'", m->name,
                        m->rotation ? "rotation" : "translation", m->rotation ? "torque" : "force",
                        m->rotation ? "force" : "torque");
        wanted = KMP_DIM_ANY;
    }
    e->force->effort = read_law(e, effort, wanted);
}

static void read_in_joint(element *e)
{
    e->force->motion = kmp_read_motion(e->r, kmp_yaml_get(e->map, "joint"), e->what);
    if (e->force->kind == KMP_FORCE_JOINT) {
        set_joint_locals(e);
        read_effort(e);
    } else if (e->force->motion >= 0) {
        read_own(e);
    }
}

static void read_components(const element *e, const char *key)
{
    const kmp_yaml *list = kmp_yaml_get(e->map, key);
    kmp_dimension wanted = kmp_key_dimension(force_keys, key);
    if (!kmp_read_list(e->r, list, e->what, 3))
        return;
    for (int i = 0; i < 3; i++)
        e->force->vector[i] = kmp_read_expr(
            e->r, list->items[i], kmp_reader_say(e->r, "component %d of %s", i + 1, e->what), wanted, KMP_OF_LOADS);
}

/* -- between two points ---------------------------------------------------------------------------- */

/* The sum of the distances of each point from the next. */
static void set_distance(element *e)
{
    kmp_arena *arena = &e->r->model->arena;
    const kmp_expr *distance = NULL;
    for (int k = 0; k <= e->force->through_count; k++) {
        kmp_measure_argument ends[2];
        for (int i = 0; i < 2; i++)
            if (!kmp_reader_measure_argument(e->r, kmp_force_point(e->force, k + i), -1, &ends[i]))
                return;
        const kmp_expr *part = kmp_expr_measure(arena, KMP_MEASURE_DISTANCE, 2, ends);
        const kmp_expr *sum =
            k > 0 ? kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_ADD, .a = distance, .b = part}) : NULL;
        distance = sum ? sum : part;
    }
    set_locals(e, "distance", distance, kmp_expr_rate(arena, distance), false);
}

/* From the axis that follows the torsion's, of the first point, to the axis of the second. */
static void set_angle(element *e)
{
    kmp_measure_argument axes[3];
    kmp_arena *arena = &e->r->model->arena;
    const int *point = e->force->point;
    int about = e->force->axis, from = (about + 1) % 3;
    if (!kmp_reader_measure_argument(e->r, point[0], from, &axes[0]) ||
        !kmp_reader_measure_argument(e->r, point[1], from, &axes[1]) ||
        !kmp_reader_measure_argument(e->r, point[0], about, &axes[2]))
        return;
    const kmp_expr *angle = kmp_expr_measure(arena, KMP_MEASURE_ANGLE, 3, axes);
    set_locals(e, "angle", angle, kmp_expr_rate(arena, angle), false);
}

/* The points of a rope, two or more. Two points that follow each other differ, and not all are of one body. */
static bool read_rope(const element *e, const kmp_yaml *list)
{
    kmp_force *force = e->force;
    const kmp_point *points = e->r->model->points;
    int count = list->count, *point = KMP_ARENA_NEW(&e->r->model->arena, int, count);
    bool good = point, apart = false;
    for (int k = 0; point && k < count; k++) {
        point[k] = kmp_read_point(e->r, list->items[k], e->what);
        good = good && point[k] >= 0;
        if (good && k > 0 && point[k] == point[k - 1])
            good = KMP_COMPLAIN(e, list->items[k], "point '%s' follows itself", list->items[k]->text);
        apart = apart || (good && points[point[k]].body != points[point[0]].body);
    }
    if (good && !apart)
        good = KMP_COMPLAIN(e, list, "all points are on body '%s'", e->r->model->bodies[points[point[0]].body].name);
    if (!good)
        return false;
    force->point[0] = point[0];
    force->point[1] = point[count - 1];
    force->through = point + 1;
    force->through_count = count - 2;
    return true;
}

/* Six rows of six numbers. */
static bool read_square(const element *e, const kmp_yaml *node, kmp_bushing_kind kind, kmp_number *to)
{
    const char *what = kmp_reader_say(e->r, "the %s of %s", kmp_bushing_keys[kind], e->what);
    bool good = kmp_read_list(e->r, node, what, KMP_BUSHING_SIZE);
    for (int i = 0; good && i < KMP_BUSHING_SIZE; i++)
        good = kmp_read_list(e->r, node->items[i], kmp_reader_say(e->r, "row %d of %s", i + 1, what), KMP_BUSHING_SIZE);
    for (int k = 0, all = good ? KMP_BUSHING_SIZE * KMP_BUSHING_SIZE : 0; k < all; k++) {
        const char *of = kmp_reader_say(e->r, "entry %s of %s", kmp_bushing_entries[k], what);
        const int length = k / KMP_BUSHING_SIZE / 3 + k % KMP_BUSHING_SIZE / 3 - 1; /* N/m, N or N m per m or rad */
        kmp_dimension unit = kmp_dimension_times(KMP_DIM_FORCE, KMP_DIM_LENGTH, length);
        unit = kmp_dimension_times(unit, KMP_DIM_TIME, kind == KMP_BUSHING_DAMPING);
        good =
            kmp_read_number(e->r, node->items[k / KMP_BUSHING_SIZE]->items[k % KMP_BUSHING_SIZE], of, unit, &to[k]) &&
            good;
    }
    return good;
}

/* The least eigenvalue of the symmetric part, in SI units. To decide on its sign each
 * direction has the unit in which its own entry is one, so that newtons and newton metres have the same weight. */
static bool is_indefinite(const kmp_number *of, double *least)
{
    enum { N = KMP_BUSHING_SIZE };
    double scaled[N * N], plain[N * N], value[N];
    for (int k = 0; k < N * N; k++) {
        const double a = fabs(of[k / N * (N + 1)].value), b = fabs(of[k % N * (N + 1)].value);
        plain[k] = (of[k].value + of[kmp_bushing_opposite(k)].value) / 2;
        scaled[k] = plain[k] / sqrt((a > 0 ? a : 1) * (b > 0 ? b : 1));
    }
    if (kmp_symmetric_eigen(N, scaled, value) != 0)
        return false;
    const bool indefinite = value[0] < -INDEFINITE * fmax(1, value[N - 1]);
    *least = kmp_symmetric_eigen(N, plain, value) == 0 ? value[0] : NAN;
    return indefinite;
}

static void check_matrix(const element *e, const kmp_yaml *node, kmp_bushing_kind kind)
{
    const kmp_bushing_matrix *matrix = e->force->matrix;
    const char *key = kmp_bushing_keys[kind];
    const kmp_number *of = matrix->of[kind];
    const int uneven = kmp_bushing_uneven(matrix, kind), opposite = uneven < 0 ? -1 : kmp_bushing_opposite(uneven);
    double least;
    if (uneven >= 0)
        kmp_reader_complain(
            e->r, node->items[opposite / KMP_BUSHING_SIZE]->items[opposite % KMP_BUSHING_SIZE]->place,
            "the %s of %s is not symmetric: entry %s is %.6g, and entry %s is %.6g; make them equal, or "
            "say 'nonsymmetric: yes'",
            key, e->what, kmp_bushing_entries[uneven], of[uneven].value, kmp_bushing_entries[opposite],
            of[opposite].value);
    else if (!matrix->nonsymmetric && is_indefinite(of, &least))
        kmp_log(e->r->context, KEMPE_LOG_WARNING,
                "%s:%d:%d: the %s of %s is not positive semidefinite: its least eigenvalue is %.6g in SI units, %s",
                e->r->model->source.files[node->place.file], node->place.line, node->place.column, key, e->what, least,
                kind == KMP_BUSHING_STIFFNESS ? "a direction in which it pushes away from the centre"
                                              : "a motion to which it gives energy");
}

/* Matrices of a bushing, in place of its other numbers. */
static void read_matrices(const element *e)
{
    static const char *const others[] = {"stiffness", "damping", "rotational_stiffness", "rotational_damping"};
    const kmp_yaml *nonsymmetric = kmp_yaml_get(e->map, "nonsymmetric");
    const kmp_yaml *nodes[KMP_BUSHING_KINDS];
    bool any = false;
    int other;
    for (int k = 0; k < KMP_BUSHING_KINDS; k++) {
        nodes[k] = kmp_yaml_get(e->map, kmp_bushing_keys[k]);
        any = any || nodes[k];
    }
    if (nonsymmetric && (!any || strcmp(nonsymmetric->text, "yes") != 0))
        kmp_reader_complain(e->r, nonsymmetric->place,
                            any ? "%s: nonsymmetric is 'yes' or absent" : "%s: nonsymmetric belongs to a 'matrix'",
                            e->what);
    if (!any)
        return;
    if (kmp_count_keys(e->map, KMP_NAMES_OF(others), &other) > 0)
        KMP_COMPLAIN(e, kmp_yaml_get(e->map, others[other]),
                     "'%s' and a matrix exclude each other: write it on the diagonal", others[other]);
    kmp_bushing_matrix *matrix = KMP_ARENA_NEW(&e->r->model->arena, kmp_bushing_matrix, 1);
    if (!matrix)
        return;
    e->force->matrix = matrix;
    matrix->nonsymmetric = nonsymmetric != NULL;
    for (int k = 0; k < KMP_BUSHING_KINDS; k++) {
        matrix->given[k] = nodes[k] != NULL;
        if (nodes[k] && read_square(e, nodes[k], (kmp_bushing_kind)k, matrix->of[k]))
            check_matrix(e, nodes[k], (kmp_bushing_kind)k);
    }
}

static void read_between(element *e, const char *place)
{
    kmp_force *force = e->force;
    const kmp_yaml *list = kmp_yaml_get(e->map, place);
    bool rope = e->force->kind == KMP_FORCE_LINE && list->kind == KMP_YAML_LIST && list->count > 2;
    bool good = rope ? read_rope(e, list) : kmp_read_two_points(e->r, list, e->what, e->force->point);
    read_fields(e, e->map, e->what);
    if (force->kind == KMP_FORCE_BUSHING)
        read_matrices(e);
    if (force->kind == KMP_FORCE_TORSION) {
        const int found = kmp_read_choice_of(e->r, e->map, "axis", e->what, kmp_axis_letters, "the axis is", 2);
        e->force->axis = found < 0 ? 2 : found;
    }
    if (!good || !kmp_force_rows[force->kind].word)
        return;
    if (force->kind == KMP_FORCE_TORSION)
        set_angle(e);
    else
        set_distance(e);
    if (force->kind == KMP_FORCE_CYLINDER) {
        static const char *const keys[] = {"pressure", "rod_pressure"};
        for (int k = 0; k < 2; k++) {
            const kmp_yaml *node = kmp_yaml_get(e->map, keys[k]);
            if (node)
                e->force->vector[k] = read_law(e, node, kmp_key_dimension(force_keys, keys[k]));
        }
        if (e->force->bore.value > 0 && e->force->rod.value >= e->force->bore.value)
            KMP_COMPLAIN(e, e->map, "the rod, %.6g m, is not thinner than the bore, %.6g m", e->force->rod.value,
                         e->force->bore.value);
    } else {
        force->effort = read_law(e, kmp_yaml_get(e->map, kmp_force_rows[force->kind].word),
                                 force->kind == KMP_FORCE_TORSION ? KMP_DIM_TORQUE : KMP_DIM_FORCE);
    }
}

/* Reports keys that are known but belong to another kind. */
static void refuse_others(const element *e, const char *place)
{
    const kmp_force_row *row = &kmp_force_rows[e->force->kind];
    const kmp_force_kind kind = e->force->kind;
    const char *more = kind == KMP_FORCE_TORSION    ? "axis"
                       : kind == KMP_FORCE_CYLINDER ? "rod_pressure"
                       : kind == KMP_FORCE_BUSHING  ? "nonsymmetric matrix damping_matrix"
                                                    : "";
    const char *own = !row->word ? "" : strcmp(row->word, "effort") == 0 ? "torque force" : row->word;
    for (int i = 0; i < e->map->count; i++) {
        const char *key = e->map->keys[i]->text;
        bool good = strcmp(key, place) == 0 || kmp_text_behind_word(own, key) || kmp_text_behind_word(more, key);
        for (int k = 0; strcmp(place, "joint") != 0 && k < kmp_force_field_count; k++)
            good = good || (kmp_force_fields[k].kind == kind && strcmp(key, kmp_force_fields[k].key) == 0);
        if (!good && kmp_name_find(kmp_key_names(force_keys), key) >= 0)
            KMP_COMPLAIN(e, e->map->items[i], "the key '%s' does not belong to a force with the key '%s'", key, place);
    }
}

/* Friction against the rate of an expression, or a force along it: an angle where the level or force is a torque. */
static void read_sliding(element *e)
{
    const kmp_yaml *node = kmp_yaml_get(e->map, "sliding"), *friction = kmp_yaml_get(e->map, "friction");
    const kmp_yaml *map = friction ? friction : e->map;
    e->force->turns = map->kind == KMP_YAML_MAP && (kmp_yaml_get(map, "torque") || kmp_yaml_get(map, "radius"));
    e->force->sliding =
        kmp_read_expr(e->r, node, e->what, e->force->turns ? KMP_DIM_NUMBER : KMP_DIM_LENGTH, KMP_OF_STATE);
    if (kmp_expr_find(e->force->sliding, kmp_expr_is_rate, NULL))
        KMP_COMPLAIN(e, node, "sliding may depend on t, q(..) and positions, not on rates");
    else if (e->force->sliding && friction)
        read_own(e);
    else if (e->force->sliding) {
        set_locals(e, e->force->turns ? "angle" : "distance", e->force->sliding,
                   kmp_expr_rate(&e->r->model->arena, e->force->sliding), false);
        read_effort(e);
    }
}

static void read_at_point(const element *e)
{
    const kmp_yaml *at = kmp_yaml_get(e->map, "at");
    e->force->point[0] = kmp_read_point(e->r, at, e->what);
    if (e->force->point[0] >= 0 && e->r->model->points[e->force->point[0]].body == 0)
        KMP_COMPLAIN(e, at, "the ground does not move: a force on it has no effect");
    read_components(e, "force");
}

static void read_on_body(const element *e)
{
    const kmp_yaml *on = kmp_yaml_get(e->map, "on");
    e->force->body = kmp_read_body(e->r, on, e->what);
    if (e->force->body == 0)
        KMP_COMPLAIN(e, on, "the ground does not move: a torque on it has no effect");
    if (e->force->body > 0 && e->r->model->bodies[e->force->body].flexible > 0)
        KMP_COMPLAIN(e, on,
                     "body '%s' is flexible, and a torque on it deforms it by where it acts: put it on a rigid body "
                     "that is welded to one of its points",
                     e->r->model->bodies[e->force->body].name);
    read_components(e, "torque");
}

static void read_force(element *e)
{
    if (!kmp_read_map(e->r, e->map, e->what, force_keys))
        return;
    const char *place = find_place(e);
    int kind = place ? find_kind(e, place) : -1;
    if (kind < 0)
        return;
    e->force->kind = (kmp_force_kind)kind;
    if (strcmp(place, "joint") == 0) {
        read_in_joint(e);
    } else if (strcmp(place, "sliding") == 0) {
        read_sliding(e);
    } else if (strcmp(place, "at") == 0) {
        read_at_point(e);
    } else if (strcmp(place, "on") == 0) {
        read_on_body(e);
    } else {
        read_between(e, place);
    }
    refuse_others(e, place);
}

void kmp_read_forces(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "forces", "force");
    model->forces =
        KMP_ARENA_NEW(&model->arena, kmp_force,
                      s.count + model->wheel_count + model->tyre_count + kmp_contacts_count(r) + model->state_count);
    if (!model->forces)
        return;
    while (kmp_section_next(&s)) {
        kmp_force *force = &model->forces[model->force_count++];
        *force = (kmp_force){.name = s.name, .place = s.key->place, .motion = -1};
        read_force(&(element){.r = r, .map = s.node, .what = s.what, .force = force});
    }
    kmp_read_wings(r, KMP_READ_AFTER_FORCES);
    kmp_read_contacts(r);
    kmp_add_state_rates(r);
}
