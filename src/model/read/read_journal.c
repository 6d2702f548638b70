/* SPDX-License-Identifier: BSD-3-Clause */
/* Geometry of joints with clearance: the journal in its bearing, the ball in its socket, the slider in its guide. Each
 * is read for compliant and for rigid contacts. */
#include "model/read/read_journal.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/read_compliant.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

static const char *const axes[] = {"x", "y", "z"};

/* A contact whose geometry is being read. */
typedef struct geometry {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_force *force;
} geometry;

/* -- numbers and formulas ------------------------------------------------------------------------------ */

const kmp_expr *kmp_read_as_expr(kmp_reader *r, const kmp_number *number)
{
    kmp_expr *e = number->expr ? NULL : KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (e)
        *e = (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = number->value, .symbol = number->symbol};
    return number->expr ? number->expr : e;
}

const kmp_expr *kmp_read_formula(kmp_reader *r, const char *text, const kmp_expr_locals *locals)
{
    const kmp_expr_scope scope = {.context = r->context, .arena = &r->model->arena, .file = r->file, .locals = locals};
    return kmp_expr_parse(&scope, text);
}

void kmp_add_local(kmp_expr_locals *locals, const char *name, const kmp_expr *expr)
{
    if (expr && locals->count < KMP_LOCALS_MOST)
        locals->local[locals->count++] = (kmp_expr_local){name, expr, false};
}

/* A positive length, NULL without the key or after an error. */
static const kmp_expr *read_length(const geometry *c, const char *key, bool required)
{
    const kmp_yaml *node = required ? kmp_read_required(c->r, c->map, c->what, key) : kmp_yaml_get(c->map, key);
    const char *of = kmp_reader_say(c->r, "the %s of %s", key, c->what);
    kmp_number number;
    if (!node || !kmp_read_number(c->r, node, of, KMP_DIM_LENGTH, &number) ||
        !kmp_check_rule(c->r, node, of, KMP_FIELD_POSITIVE, number.value, ""))
        return NULL;
    return kmp_read_as_expr(c->r, &number);
}

static double value_of(const geometry *c, const kmp_expr *e)
{
    return kmp_expr_value(e, c->r->parameter_values);
}

/* -- places ---------------------------------------------------------------------------------------------- */

/* A motion in a plane: place along the axes after its normal, cosine and sine of the angle, the angular velocity. */
typedef struct plane_motion {
    int normal;
    const kmp_expr *place[2], *cosine, *sine, *spin;
} plane_motion;

static const kmp_expr *coordinate(kmp_reader *r, kmp_expr_kind kind, const kmp_body *body, int number)
{
    kmp_expr *e = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    for (int k = body->first_motion; e && k < body->first_motion + body->motion_count; k++)
        if (r->model->motions[k].number == number)
            *e = (kmp_expr){.kind = kind, .index = k};
    return e;
}

/* A component of a measure of the second point in the axes of the first. */
static const kmp_expr *component(kmp_reader *r, kmp_measure_kind kind, const int point[2], int number)
{
    kmp_measure_argument arguments[2];
    if (!kmp_reader_measure_argument(r, point[1], -1, &arguments[0]) ||
        !kmp_reader_measure_argument(r, point[0], -1, &arguments[1]))
        return NULL;
    const kmp_expr *whole = kmp_expr_measure(&r->model->arena, kind, 2, arguments);
    kmp_expr *e = whole ? KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1) : NULL;
    if (e) {
        *e = *whole;
        e->number = number;
    }
    return e;
}

static void place_between(const geometry *c, const int point[2], int normal, plane_motion *out)
{
    int i = (normal + 1) % 3, j = (normal + 2) % 3;
    memcpy(c->force->point, point, sizeof c->force->point);
    *out = (plane_motion){.normal = normal};
    out->place[0] = component(c->r, KMP_MEASURE_POSITION, point, i);
    out->place[1] = component(c->r, KMP_MEASURE_POSITION, point, j);
    out->cosine = component(c->r, KMP_MEASURE_AXES, point, 3 * i + i);
    out->sine = component(c->r, KMP_MEASURE_AXES, point, 3 * i + j);
    out->spin = component(c->r, KMP_MEASURE_ANGULAR_VELOCITY, point, normal);
}

/* The coordinate axis of both sides of a closure; -1: it is oblique. */
static int axis_of(const double axis[3])
{
    for (int k = 0; k < 3; k++)
        if (fabs(axis[k]) == 1)
            return k;
    return -1;
}

/* Of a joint of three motions in a plane: two translations and a rotation. */
static bool place_by_coordinates(const geometry *c, const kmp_body *body, plane_motion *out)
{
    const kmp_motion *turn = NULL;
    for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++)
        if (c->r->model->motions[k].number == 3)
            turn = &c->r->model->motions[k];
    if (!turn || !turn->rotation || axis_of(turn->axis) < 0)
        return false;
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "a", coordinate(c->r, KMP_EXPR_Q, body, 3));
    *out = (plane_motion){.normal = axis_of(turn->axis)};
    for (int k = 0; k < 2; k++)
        out->place[k] = coordinate(c->r, KMP_EXPR_Q, body, 1 + k);
    out->cosine = kmp_read_formula(c->r, "cos(a)", &locals);
    out->sine = kmp_read_formula(c->r, "sin(a)", &locals);
    out->spin = coordinate(c->r, KMP_EXPR_QD, body, 3);
    return true;
}

/* The joint of three motions in a plane, or its closure. */
static bool place_in_joint(const geometry *c, const kmp_yaml *node, bool guide, plane_motion *out)
{
    const kempe_model *model = c->r->model;
    const char *name = kmp_reader_name(c->r, node->place.file, node->text);
    for (int b = 1; b < model->body_count; b++)
        if (strcmp(model->bodies[b].joint, name) == 0 && model->bodies[b].motion_count == 3 &&
            place_by_coordinates(c, &model->bodies[b], out))
            return true;
    int k = kmp_name_find(KMP_NAMED(model, closure), name);
    if (k < 0 || model->closures[k].point[0] < 0)
        return kmp_reader_complain(c->r, node->place, "%s: '%s' is not a joint with clearance", c->what, node->text);
    if (axis_of(model->closures[k].axis[0]) < 0)
        return kmp_reader_complain(c->r, node->place, "%s: the axis of a clearance is x, y or z of its points",
                                   c->what);
    if (guide && axis_of(model->closures[k].axis[1]) != axis_of(model->closures[k].axis[0]))
        return kmp_reader_complain(c->r, node->place, "%s: both points of a guide need the same axis", c->what);
    place_between(c, model->closures[k].point, axis_of(model->closures[k].axis[0]), out);
    return true;
}

/* A length x over the clearance c; NULL without one of them. */
static const kmp_expr *over_clearance(const geometry *g, const char *formula, const kmp_expr *x, const kmp_expr *c)
{
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "x", x);
    kmp_add_local(&locals, "c", c);
    return locals.count == 2 ? kmp_read_formula(g->r, formula, &locals) : NULL;
}

/* -- journals ---------------------------------------------------------------------------------------------- */

static void place_journal(const geometry *c)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "journal"), *axis = kmp_yaml_get(c->map, "axis");
    int about = axis ? kmp_read_choice(c->r, axis, c->what, KMP_NAMES_OF(axes), "the axis is", " or ") : 2, point[2];
    plane_motion motion;
    if (node->kind == KMP_YAML_SCALAR) {
        if (!place_in_joint(c, node, false, &motion))
            return;
    } else if (!kmp_read_two_points(c->r, node, c->what, point) || about < 0) {
        return;
    } else {
        place_between(c, point, about, &motion);
    }
    c->force->vector[0] = motion.place[0];
    c->force->vector[1] = motion.place[1];
    c->force->vector[2] = motion.spin;
}

static void place_ball(const geometry *c)
{
    int point[2];
    if (!kmp_read_two_points(c->r, kmp_yaml_get(c->map, "socket"), c->what, point))
        return;
    memcpy(c->force->point, point, sizeof c->force->point);
    for (int k = 0; k < 3; k++)
        c->force->vector[k] = component(c->r, KMP_MEASURE_POSITION, point, k);
}

bool kmp_read_journal(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_journal *journal)
{
    const geometry c = {r, map, what, force};
    journal->clearance = read_length(&c, "clearance", true);
    journal->radius = read_length(&c, "radius", false);
    journal->ball = kmp_yaml_get(map, "socket") != NULL;
    if (journal->radius && journal->clearance && value_of(&c, journal->clearance) >= value_of(&c, journal->radius))
        kmp_reader_complain(r, map->place, "%s: the clearance is not less than the radius of the bearing", what);
    if (journal->ball)
        place_ball(&c);
    else
        place_journal(&c);
    for (int k = 0; k < (journal->ball ? 3 : 2); k++)
        force->centred[k] = over_clearance(&c, "x/c", force->vector[k], journal->clearance);
    return journal->clearance && force->vector[0] && force->vector[1];
}

static const kmp_expr *rate_of(kmp_reader *r, const kmp_expr *of)
{
    kmp_expr *e = of ? KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1) : NULL;
    if (e)
        *e = (kmp_expr){.kind = KMP_EXPR_RATE, .a = of};
    return e;
}

/* The velocity of its surface along the bearing, where its centre is at the distance c: elsewhere there is no contact,
 * and this is smooth at the centre. */
static const kmp_expr *slip_of(kmp_reader *r, const kmp_force *force, const kmp_journal *journal)
{
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "c", journal->clearance);
    kmp_add_local(&locals, "r", journal->radius);
    kmp_add_local(&locals, "x", force->vector[0]);
    kmp_add_local(&locals, "y", force->vector[1]);
    kmp_add_local(&locals, "u", rate_of(r, force->vector[0]));
    kmp_add_local(&locals, "v", rate_of(r, force->vector[1]));
    kmp_add_local(&locals, "w", force->vector[2]);
    return locals.count == 7 ? kmp_read_formula(r, "(x*v - y*u)/c + (r - c)*w", &locals) : NULL;
}

void kmp_read_ball_surfaces(kmp_reader *r, const kmp_force *force, const kmp_journal *journal, kmp_contact_pair *pair)
{
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "c", journal->clearance);
    kmp_add_local(&locals, "r", journal->radius);
    const kmp_expr *inner = locals.count == 2 ? kmp_read_formula(r, "r - c", &locals) : NULL;
    if (!inner)
        return;
    pair->side[0] = (kmp_touch_side){.shape = KMP_TOUCH_SPHERE, .point = force->point[1], .axis = 2};
    pair->side[1] = (kmp_touch_side){.shape = KMP_TOUCH_SPHERE, .point = force->point[0], .axis = 2, .hollow = true};
    pair->radius[0] = kmp_number_of(inner, kmp_expr_value(inner, r->parameter_values));
    pair->radius[1] = kmp_number_of(journal->radius, kmp_expr_value(journal->radius, r->parameter_values));
}

/* With its centre at (x, y), e = |(x, y)|, the distance (c^2 - e^2)/(2 c) is zero where the surfaces touch, has the
 * slope of their distance there, and is smooth at the centre. */
void kmp_read_journal_gap(kmp_reader *r, kmp_force *force, const kmp_journal *journal, kmp_contact_pair *pair)
{
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "c", journal->clearance);
    kmp_add_local(&locals, "x", force->vector[0]);
    kmp_add_local(&locals, "y", force->vector[1]);
    kmp_add_local(&locals, "z", journal->ball ? force->vector[2] : NULL);
    *pair = (kmp_contact_pair){.motion = -1, .side = {{.point = -1}, {.point = -1}}, .clearance = journal->clearance};
    pair->gap = kmp_read_formula(r, journal->ball ? "(c - (x^2 + y^2 + z^2)/c)/2" : "(c - (x^2 + y^2)/c)/2", &locals);
    if (journal->radius && journal->ball)
        kmp_read_ball_surfaces(r, force, journal, pair);
    else if (journal->radius)
        pair->slip = slip_of(r, force, journal);
    force->vector[2] = journal->ball ? force->vector[2] : NULL; /* without friction the rotation has no effect */
}

/* -- guides ------------------------------------------------------------------------------------------------ */

/* The corner of the slider, of its length along and its height across the guide. */
static const struct {
    const char *word;
    int along, across;
} corners[] = {{"front_upper", 1, 1}, {"front_lower", 1, -1}, {"rear_upper", -1, 1}, {"rear_lower", -1, -1}};

const char *kmp_guide_corner(int k)
{
    return k < 4 ? corners[k].word : NULL;
}

/* A corner at (l, h) in the slider's axes is at (a + c l - s h, b + s l + c h) in those of the guide, of which the
 * first is along the guide where `first`. */
static bool find_corner(const geometry *c, const plane_motion *motion, int corner, bool first, kmp_contact_pair *pair,
                        const kmp_expr **slip)
{
    static const char *const keys[] = {"clearance", "length", "height"}, *const names[] = {"g", "l", "h"};
    const char *l = corners[corner].along > 0 ? "l/2" : "(-l/2)", *h = corners[corner].across > 0 ? "h/2" : "(-h/2)";
    kmp_expr_locals locals = {0};
    for (int k = 0; k < 3; k++)
        kmp_add_local(&locals, names[k], read_length(c, keys[k], true));
    kmp_add_local(&locals, "a", motion->place[0]);
    kmp_add_local(&locals, "b", motion->place[1]);
    kmp_add_local(&locals, "c", motion->cosine);
    kmp_add_local(&locals, "s", motion->sine);
    if (locals.count < 7)
        return false;
    const char *one = kmp_reader_say(c->r, "(a + c*%s - s*%s)", first ? l : h, first ? h : l);
    const char *other = kmp_reader_say(c->r, "(b + s*%s + c*%s)", first ? l : h, first ? h : l);
    pair->gap = kmp_read_formula(
        c->r, kmp_reader_say(c->r, "h/2 + g %s %s", corners[corner].across > 0 ? "-" : "+", first ? other : one),
        &locals);
    c->force->centred[0] = over_clearance(c, "(x - c)/c", pair->gap, locals.local[0].expr);
    pair->way = kmp_read_formula(c->r, first ? one : other, &locals);
    *slip = rate_of(c->r, pair->way);
    return pair->gap && *slip;
}

bool kmp_read_guide(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_contact_pair *pair)
{
    const geometry c = {r, map, what, force};
    const kmp_yaml *node = kmp_yaml_get(map, "guide"), *word = kmp_read_required(r, map, what, "corner");
    const kmp_yaml *axis = kmp_read_required(r, map, what, "axis");
    plane_motion motion = {0};
    *pair = (kmp_contact_pair){.motion = -1, .side = {{.point = -1}, {.point = -1}}};
    int corner = word ? kmp_read_choice(r, word, what, KMP_NAMES(corners, 4), "the corner is", " or ") : -1;
    int along = axis ? kmp_read_choice(r, axis, what, KMP_NAMES_OF(axes), "the axis is", " or ") : -1;
    if (corner < 0 || along < 0 || !place_in_joint(&c, node, true, &motion))
        return false;
    if (along == motion.normal)
        return kmp_reader_complain(r, axis->place, "%s: the guide is along the normal of the plane of motion", what);
    return find_corner(&c, &motion, corner, along == (motion.normal + 1) % 3, pair, &force->vector[0]);
}
