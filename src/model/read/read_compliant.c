/* SPDX-License-Identifier: BSD-3-Clause */
/* A contact with a law: its geometry, its law as an expression of depth and rate, its friction, the film of a journal.
 * The geometry of joints with clearance serves rigid contacts, too. */
#include "model/read/read_compliant.h"
#include "model/data/compliant.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/language/number_algebra.h"
#include "model/read/read_contacts.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

/* -- joints with clearance --------------------------------------------------------------------------- */

/* Geometry of joints with clearance: the journal in its bearing, the ball in its socket, the slider in its guide. Each
 * is read for compliant and for rigid contacts. */

/* A contact whose geometry is being read. */
typedef struct geometry {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_force *force;
} geometry;

/* -- numbers and formulas ------------------------------------------------------------------------------ */

static const kmp_expr *read_formula(kmp_reader *r, const char *text, const kmp_expr_locals *locals)
{
    return kmp_expr_formula(&r->model->arena, text, locals);
}

/* A positive length, NULL without the key or after an error. */
static const kmp_expr *read_length(const geometry *c, const char *key, bool required)
{
    return kmp_read_ruled_key(c->r, c->map, c->what, key, required, KMP_DIM_LENGTH, KMP_FIELD_POSITIVE);
}

static double number_of(const kmp_reader *r, const kmp_expr *e)
{
    return e ? kmp_expr_value(e, r->parameter_values) : NAN;
}

/* -- places ---------------------------------------------------------------------------------------------- */

/* A motion in a plane: place along the axes after its normal, cosine and sine of the angle, the angular velocity. */
typedef struct plane_motion {
    int normal;
    const kmp_expr *place[2], *cosine, *sine, *spin;
} plane_motion;

static const kmp_expr *coordinate(kmp_reader *r, kmp_expr_kind kind, const kmp_body *body, int number)
{
    kmp_expr e = {.kind = KMP_EXPR_NUMBER};
    for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++)
        if (r->model->motions[k].number == number)
            e = (kmp_expr){.kind = kind, .index = k};
    return kmp_expr_make(&r->model->arena, e);
}

/* A component of a measure of the second point in the axes of the first. */
static const kmp_expr *component(kmp_reader *r, kmp_measure_kind kind, const int point[2], int number)
{
    kmp_measure_argument arguments[2];
    if (!kmp_reader_measure_argument(r, point[1], -1, &arguments[0]) ||
        !kmp_reader_measure_argument(r, point[0], -1, &arguments[1]))
        return NULL;
    const kmp_expr *whole = kmp_expr_measure(&r->model->arena, kind, 2, arguments);
    if (!whole)
        return NULL;
    kmp_expr e = *whole;
    e.number = number;
    return kmp_expr_make(&r->model->arena, e);
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
    kmp_local_put(&locals, "a", coordinate(c->r, KMP_EXPR_Q, body, 3));
    *out = (plane_motion){.normal = axis_of(turn->axis)};
    for (int k = 0; k < 2; k++)
        out->place[k] = coordinate(c->r, KMP_EXPR_Q, body, 1 + k);
    out->cosine = read_formula(c->r, "cos(a)", &locals);
    out->sine = read_formula(c->r, "sin(a)", &locals);
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
    const bool open = k < 0 || model->closures[k].point[0] < 0;
    if (open && c->r->unread)
        return false;
    if (open)
        return KMP_COMPLAIN(c, node, "'%s' is not a joint with clearance", node->text);
    if (axis_of(model->closures[k].axis[0]) < 0)
        return KMP_COMPLAIN(c, node, "the axis of a clearance is x, y or z of its points");
    if (guide && axis_of(model->closures[k].axis[1]) != axis_of(model->closures[k].axis[0]))
        return KMP_COMPLAIN(c, node, "both points of a guide need the same axis");
    place_between(c, model->closures[k].point, axis_of(model->closures[k].axis[0]), out);
    return true;
}

/* A length x over the clearance c; NULL without one of them. */
static const kmp_expr *over_clearance(const geometry *g, const char *formula, const kmp_expr *x, const kmp_expr *c)
{
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "x", x);
    kmp_local_put(&locals, "c", c);
    return locals.count == 2 ? read_formula(g->r, formula, &locals) : NULL;
}

/* -- journals ---------------------------------------------------------------------------------------------- */

static void place_journal(const geometry *c)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "journal");
    int about = kmp_read_choice_of(c->r, c->map, "axis", c->what, kmp_axis_letters, "the axis is", 2), point[2];
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
    if (number_of(r, journal->clearance) >= number_of(r, journal->radius))
        kmp_complain_of(r, map, what, "the clearance is not less than the radius of the bearing");
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
    return of ? kmp_expr_rate(&r->model->arena, of) : NULL;
}

/* The velocity of its surface along the bearing, where its centre is at the distance c: elsewhere there is no contact,
 * and this is smooth at the centre. */
static const kmp_expr *slip_of(kmp_reader *r, const kmp_force *force, const kmp_journal *journal)
{
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "c", journal->clearance);
    kmp_local_put(&locals, "r", journal->radius);
    kmp_local_put(&locals, "x", force->vector[0]);
    kmp_local_put(&locals, "y", force->vector[1]);
    kmp_local_put(&locals, "u", rate_of(r, force->vector[0]));
    kmp_local_put(&locals, "v", rate_of(r, force->vector[1]));
    kmp_local_put(&locals, "w", force->vector[2]);
    return locals.count == 7 ? read_formula(r, "(x*v - y*u)/c + (r - c)*w", &locals) : NULL;
}

/* The surfaces of a ball with a radius: a sphere in a hollow one. */
static void read_ball_surfaces(kmp_reader *r, const kmp_force *force, const kmp_journal *journal,
                               kmp_contact_pair *pair)
{
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "c", journal->clearance);
    kmp_local_put(&locals, "r", journal->radius);
    const kmp_expr *inner = locals.count == 2 ? read_formula(r, "r - c", &locals) : NULL;
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
    kmp_local_put(&locals, "c", journal->clearance);
    kmp_local_put(&locals, "x", force->vector[0]);
    kmp_local_put(&locals, "y", force->vector[1]);
    kmp_local_put(&locals, "z", journal->ball ? force->vector[2] : NULL);
    *pair = (kmp_contact_pair){.motion = -1, .side = {{.point = -1}, {.point = -1}}, .clearance = journal->clearance};
    pair->gap = read_formula(r, journal->ball ? "(c - (x^2 + y^2 + z^2)/c)/2" : "(c - (x^2 + y^2)/c)/2", &locals);
    if (journal->radius && journal->ball)
        read_ball_surfaces(r, force, journal, pair);
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

/* A corner at (l, h) in the slider's axes is at (a + c l - s h, b + s l + c h) in the axes of the guide, of which
 * the first is along the guide where `first`. */
static bool find_corner(const geometry *c, const plane_motion *motion, int corner, bool first, kmp_contact_pair *pair,
                        const kmp_expr **slip)
{
    static const char *const keys[] = {"clearance", "length", "height"}, *const names[] = {"g", "l", "h"};
    const char *l = corners[corner].along > 0 ? "l/2" : "(-l/2)", *h = corners[corner].across > 0 ? "h/2" : "(-h/2)";
    kmp_expr_locals locals = {0};
    for (int k = 0; k < 3; k++)
        kmp_local_put(&locals, names[k], read_length(c, keys[k], true));
    kmp_local_put(&locals, "a", motion->place[0]);
    kmp_local_put(&locals, "b", motion->place[1]);
    kmp_local_put(&locals, "c", motion->cosine);
    kmp_local_put(&locals, "s", motion->sine);
    if (locals.count < 7)
        return false;
    const char *one = kmp_reader_say(c->r, "(a + c*%s - s*%s)", first ? l : h, first ? h : l);
    const char *other = kmp_reader_say(c->r, "(b + s*%s + c*%s)", first ? l : h, first ? h : l);
    pair->gap = read_formula(
        c->r, kmp_reader_say(c->r, "h/2 + g %s %s", corners[corner].across > 0 ? "-" : "+", first ? other : one),
        &locals);
    c->force->centred[0] = over_clearance(c, "(x - c)/c", pair->gap, locals.local[0].expr);
    pair->way = read_formula(c->r, first ? one : other, &locals);
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
    int corner = word ? kmp_read_choice(r, word, what, KMP_NAMES(corners, 4), "the corner is") : -1;
    int along = axis ? kmp_read_choice(r, axis, what, kmp_axis_letters, "the axis is") : -1;
    if (corner < 0 || along < 0 || !place_in_joint(&c, node, true, &motion))
        return false;
    if (along == motion.normal)
        return kmp_complain_of(r, axis, what, "the guide is along the normal of the plane of motion");
    return find_corner(&c, &motion, corner, along == (motion.normal + 1) % 3, pair, &force->vector[0]);
}

static const kmp_key contact_keys[] = {
#include "model/read/contact_keys.def"
    {0}};
static const kmp_key friction_keys[] = {
#include "model/read/contact_friction_keys.def"
    {0}};

typedef struct law_row {
    const char *word, *unit, *force, *store;
} law_row;

static const law_row laws[] = {
#define KMP_COMPLIANT_LAW(word, unit, force, store, source) {word, unit, force, store},
#include "model/data/compliant_laws.def"
#undef KMP_COMPLIANT_LAW
};

/* Words of all rows; one with two rows occurs twice. */
static const kmp_name_list law_words = {laws, sizeof laws[0], sizeof laws / sizeof laws[0]};

#define KMP_LOCAL(k)                                                                                                   \
    {                                                                                                                  \
        .kind = KMP_EXPR_PLACE, .index = (k)                                                                           \
    }
static const kmp_expr quantities[] = {KMP_LOCAL(KMP_LOCAL_DEPTH), KMP_LOCAL(KMP_LOCAL_RATE),
                                      KMP_LOCAL(KMP_LOCAL_IMPACT), KMP_LOCAL(KMP_LOCAL_SLIP)};
static const char *const quantity_names[] = {"depth", "rate", "impact", "slip"};

/* A contact being read. */
typedef struct contact {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_force *force;
    struct kmp_compliant *made;
    kmp_expr_locals numbers; /* the expressions of its law so far, and the quantities */
} contact;

/* -- numbers --------------------------------------------------------------------------------------- */

/* The number of a key, NULL without it or after an error. */
static const kmp_expr *read_given(const contact *c, const char *key, kmp_dimension wanted, kmp_field_rule rule)
{
    return kmp_read_ruled_key(c->r, c->map, c->what, key, false, wanted, rule);
}

/* The k-th of one or two numbers, one for both. */
static const kmp_expr *read_of_two(const contact *c, const char *key, int k, kmp_field_rule rule)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, key);
    kmp_number number = {0};
    if (!node && kmp_key_default(contact_keys, key, 1, &number.value))
        return kmp_number_expr(&c->r->model->arena, number);
    if (!node || node->kind != KMP_YAML_LIST)
        return read_given(c, key, kmp_key_dimension(contact_keys, key), rule);
    return kmp_read_list(c->r, node, kmp_reader_say(c->r, "%s of %s", key, c->what), 2) &&
                   kmp_read_ruled(c->r, node->items[k], kmp_reader_say(c->r, "the %s of %s", key, c->what),
                                  kmp_key_dimension(contact_keys, key), rule, &number)
               ? kmp_number_expr(&c->r->model->arena, number)
               : NULL;
}

/* -- law ------------------------------------------------------------------------------------------- */

/* The row of a word: of two the one whose number is given, otherwise the first. */
static const law_row *find_law(const char *word, const kmp_yaml *map)
{
    const law_row *found = NULL;
    for (int k = 0; k < law_words.count; k++) {
        const char *force = laws[k].force;
        bool given = (kmp_text_behind_word(force, "damping") && kmp_yaml_get(map, "damping")) ||
                     (kmp_text_behind_word(force, "restitution") && kmp_yaml_get(map, "restitution"));
        if (strcmp(laws[k].word, word) == 0 && (!found || given))
            found = &laws[k];
    }
    return found;
}

bool kmp_contact_keeps_rate(const kmp_yaml *map)
{
    const kmp_yaml *law = kmp_yaml_get(map, "law"), *force = kmp_yaml_get(map, "force");
    const law_row *row = law && law->kind == KMP_YAML_SCALAR ? find_law(law->text, map) : NULL;
    const char *text = row ? row->force : force && force->kind == KMP_YAML_SCALAR ? force->text : "";
    return kmp_text_behind_word(text, "impact");
}

/* True for a sphere on a plane, on a sphere or in one. */
static bool is_of_spheres(const kmp_contact_pair *touch)
{
    const kmp_touch_side *side = touch->side;
    return side[0].point >= 0 && side[0].shape == KMP_TOUCH_SPHERE && touch->radius[0].value > 0 &&
           (side[1].shape == KMP_TOUCH_PLANE || side[1].shape == KMP_TOUCH_SPHERE);
}

static const kmp_expr *radius_of_sides(const contact *c)
{
    const kmp_contact_pair *touch = &c->force->touch;
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "a", kmp_number_expr(&c->r->model->arena, touch->radius[0]));
    if (touch->side[1].shape == KMP_TOUCH_PLANE)
        return read_formula(c->r, "a", &locals);
    kmp_local_put(&locals, "b", kmp_number_expr(&c->r->model->arena, touch->radius[1]));
    return read_formula(c->r, touch->side[1].hollow ? "a*b/(b - a)" : "a*b/(a + b)", &locals);
}

/* Radius of curvature of the pair: of a journal in its bearing, of two spheres, of a sphere on a plane. */
static const kmp_expr *reduced_radius(const contact *c)
{
    const struct kmp_compliant *made = c->made;
    const kmp_yaml *radii = kmp_yaml_get(c->map, "radii");
    kmp_expr_locals locals = {0};
    if (made->form == KMP_COMPLIANT_JOURNAL) {
        if (!made->radius)
            kmp_read_required(c->r, c->map, c->what, "radius");
        kmp_local_put(&locals, "a", made->radius);
        kmp_local_put(&locals, "c", made->clearance);
        return locals.count == 2 ? read_formula(c->r, "a*(a - c)/c", &locals) : NULL;
    }
    if (!radii && is_of_spheres(&c->force->touch))
        return radius_of_sides(c);
    if (!radii)
        kmp_read_required(c->r, c->map, c->what, "radii");
    kmp_local_put(&locals, "a", read_of_two(c, "radii", 0, KMP_FIELD_ANY));
    if (!radii || radii->kind != KMP_YAML_LIST)
        return locals.count == 1 ? read_formula(c->r, "a", &locals) : NULL;
    kmp_local_put(&locals, "b", read_of_two(c, "radii", 1, KMP_FIELD_ANY));
    return locals.count == 2 ? read_formula(c->r, "a*b/(a + b)", &locals) : NULL;
}

static const kmp_expr *read_stiffness(const contact *c, double exponent)
{
    const kmp_yaml *given = kmp_yaml_get(c->map, "stiffness"), *young = kmp_yaml_get(c->map, "young");
    bool turns = c->force->turns;
    kmp_dimension depth = kmp_dimension_power(turns ? KMP_DIM_NUMBER : KMP_DIM_LENGTH, exponent);
    kmp_dimension wanted = kmp_dimension_times(turns ? KMP_DIM_TORQUE : KMP_DIM_FORCE, depth, -1);
    if (given && young)
        KMP_COMPLAIN(c, young, "'stiffness' and 'young' exclude each other");
    if (given || !young) {
        (void)kmp_read_required(c->r, c->map, c->what, "stiffness");
        return read_given(c, "stiffness", wanted, KMP_FIELD_POSITIVE);
    }
    if (exponent != 1.5)
        KMP_COMPLAIN(c, young, "the stiffness by 'young' has the exponent 1.5, not %g", exponent);
    /* Hertz's stiffness of two spheres: F = 4/3 E* sqrt(R) d^1.5, 1/E* = sum (1 - nu^2)/E (Johnson 1985, eq. 4.23). */
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "reduced", reduced_radius(c));
    kmp_local_put(&locals, "young", read_of_two(c, "young", 0, KMP_FIELD_POSITIVE));
    kmp_local_put(&locals, "other_young", read_of_two(c, "young", 1, KMP_FIELD_POSITIVE));
    kmp_local_put(&locals, "poisson", read_of_two(c, "poisson", 0, KMP_FIELD_ANY));
    kmp_local_put(&locals, "other_poisson", read_of_two(c, "poisson", 1, KMP_FIELD_ANY));
    if (locals.count < 5)
        return NULL;
    if (!(number_of(c->r, locals.local[0].expr) > 0)) {
        KMP_COMPLAIN(c, c->map, "the radii do not touch from outside: their sum of curvatures is not positive");
        return NULL;
    }
    return read_formula(c->r, "4/3*sqrt(reduced)/((1 - poisson^2)/young + (1 - other_poisson^2)/other_young)", &locals);
}

static const kmp_expr *read_exponent(const contact *c, bool has)
{
    const kmp_number absent = {.value = has ? 1.5 : 1};
    const kmp_yaml *node = kmp_yaml_get(c->map, "exponent");
    const kmp_expr *e = node && has ? read_given(c, "exponent", KMP_DIM_NUMBER, KMP_FIELD_POSITIVE) : NULL;
    if (node && number_of(c->r, e) < 1)
        kmp_reader_complain(c->r, node->place, "the exponent of %s is %g: it must be at least 1", c->what,
                            number_of(c->r, e));
    return e ? e : kmp_number_expr(&c->r->model->arena, absent);
}

/* Numbers that the law does not have. */
static void refuse_numbers(const contact *c, const law_row *row, const char *const *names, int count)
{
    for (int k = 0; k < count; k++) {
        const kmp_yaml *node = kmp_yaml_get(c->map, names[k]);
        if (node && (!row || !kmp_text_behind_word(row->force, names[k])))
            KMP_COMPLAIN(c, node, "the law %s has no %s", row ? row->word : "by an expression", names[k]);
    }
}

/* The solution y > 1 of y - ln y = w, w = ln(4 c/(e depth)), by steps of Newton from w + ln w: five are enough for the
 * last digit where the depth is at most 0.95 of its largest value, 4 c/e^2, at which y = 1. */
static const kmp_expr *johnson_root(const contact *c)
{
    enum { STEPS = 6 };
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "c", c->made->clearance);
    kmp_local_put(&locals, "depth", &quantities[0]);
    const kmp_expr *w = read_formula(c->r, "log(1.4715177646857693*c/(depth + 1e-300))", &locals), *y;
    locals.count = 0;
    kmp_local_put(&locals, "w", w);
    y = locals.count ? read_formula(c->r, "w + log(w)", &locals) : NULL;
    for (int k = 0; k < STEPS && y; k++) {
        locals.count = 1;
        kmp_local_put(&locals, "y", y);
        y = read_formula(c->r, "y*(log(y) + w - 1)/(y - 1)", &locals);
    }
    return y;
}

/* A cylinder in a cylinder: modulus and y of the law's row. */
static void read_johnson(contact *c)
{
    kmp_expr_locals locals = {0};
    if (c->made->form != KMP_COMPLIANT_JOURNAL || c->made->ball) {
        KMP_COMPLAIN(c, c->map, "the law johnson holds only for a journal in its bearing");
        return;
    }
    if (!kmp_read_required(c->r, c->map, c->what, "young") || !kmp_read_required(c->r, c->map, c->what, "length"))
        return;
    kmp_local_put(&locals, "young", read_of_two(c, "young", 0, KMP_FIELD_POSITIVE));
    kmp_local_put(&locals, "other_young", read_of_two(c, "young", 1, KMP_FIELD_POSITIVE));
    kmp_local_put(&locals, "poisson", read_of_two(c, "poisson", 0, KMP_FIELD_ANY));
    kmp_local_put(&locals, "other_poisson", read_of_two(c, "poisson", 1, KMP_FIELD_ANY));
    kmp_local_put(&locals, "length", read_given(c, "length", KMP_DIM_LENGTH, KMP_FIELD_POSITIVE));
    if (locals.count < 5 || !c->made->clearance)
        return;
    c->made->limited = true;
    kmp_local_put(&c->numbers, "modulus",
                  read_formula(c->r, "pi*length/((1 - poisson^2)/young + (1 - other_poisson^2)/other_young)", &locals));
    kmp_local_put(&c->numbers, "y", johnson_root(c));
}

static void read_row(contact *c, const law_row *row)
{
    static const char *const own[] = {"exponent", "damping", "restitution"};
    kmp_expr_locals *numbers = &c->numbers;
    const kmp_expr *exponent = read_exponent(c, kmp_text_behind_word(row->force, "exponent"));
    refuse_numbers(c, row, own, 3);
    for (int k = 1; k < 3; k++)
        if (kmp_text_behind_word(row->force, own[k])) {
            (void)kmp_read_required(c->r, c->map, c->what, own[k]);
            const kmp_expr *e =
                read_given(c, own[k], k == 1 && !c->force->turns ? kmp_dimension_of(row->unit) : KMP_DIM_NUMBER,
                           KMP_FIELD_NOT_NEGATIVE);
            if (k == 2) {
                double value = number_of(c->r, e);
                if (value <= 0 || value > 1)
                    kmp_reader_complain(c->r, kmp_yaml_get(c->map, "restitution")->place,
                                        "the restitution of %s is %g: it must be above 0 and at most 1", c->what,
                                        value);
            }
            kmp_local_put(numbers, own[k], e);
        }
    kmp_local_put(numbers, "exponent", exponent);
    if (kmp_text_behind_word(row->force, "modulus"))
        read_johnson(c);
    else
        kmp_local_put(numbers, "stiffness", read_stiffness(c, number_of(c->r, exponent)));
    if (c->r->wrong)
        return;
    c->made->law = row->word;
    c->force->effort = read_formula(c->r, row->force, numbers);
    c->made->store = row->store[0] ? read_formula(c->r, row->store, numbers) : NULL;
}

static void read_law(contact *c)
{
    static const char *const ways[] = {"law", "force"};
    if (kmp_read_one_key(c->r, c->map, c->what, KMP_NAMES_OF(ways)) < 0)
        return;
    const kmp_yaml *word = kmp_yaml_get(c->map, "law"), *own = kmp_yaml_get(c->map, "force");
    for (int k = 0; k < 3; k++)
        kmp_local_put(&c->numbers, quantity_names[k], &quantities[k]);
    if (own) { /* the law of the user, over the same quantities */
        static const char *const numbers[] = {"stiffness", "exponent", "damping", "restitution",
                                              "young",     "poisson",  "radii"};
        refuse_numbers(c, NULL, numbers, 7);
        c->r->locals = &c->numbers;
        c->force->effort =
            kmp_read_expr(c->r, own, c->what, c->force->turns ? KMP_DIM_TORQUE : KMP_DIM_FORCE, KMP_OF_LOADS);
        c->r->locals = NULL;
    } else if (kmp_read_choice(c->r, word, c->what, law_words, "the law is") >= 0) {
        read_row(c, find_law(word->text, c->map));
    }
}

/* -- friction -------------------------------------------------------------------------------------- */

static void read_friction(contact *c)
{
    kmp_reader *r = c->r;
    const kmp_yaml *map = kmp_yaml_get(c->map, "friction");
    const char *what = kmp_reader_say(r, "friction of %s", c->what);
    const bool journal = c->made->form == KMP_COMPLIANT_JOURNAL;
    if (!map || !kmp_read_map(r, map, what, friction_keys))
        return;
    const kmp_yaml *node = kmp_read_required(r, map, what, "coefficient"), *speed = kmp_yaml_get(map, "speed");
    bool sides = c->force->touch.side[0].point >= 0; /* of a ball with a radius, too */
    if (!sides && (journal ? !c->made->radius : !c->force->vector[0]))
        kmp_read_required(r, c->map, c->what, journal ? "radius" : "slip");
    if (!speed && (sides || (c->force->vector[1] && !journal)))
        kmp_read_required(r, map, what, "speed");
    kmp_expr_locals slip = {1, {{"slip", &quantities[KMP_LOCAL_SLIP - KMP_LOCAL_DEPTH], false}}};
    r->locals = &slip;
    c->force->holding_effort = node ? kmp_read_expr(r, node, what, KMP_DIM_NUMBER, KMP_OF_STATE) : NULL;
    r->locals = NULL;
    if (speed)
        c->made->speed = kmp_read_ruled_key(r, map, what, "speed", false, kmp_key_dimension(friction_keys, "speed"),
                                            KMP_FIELD_POSITIVE);
}

/* -- geometry -------------------------------------------------------------------------------------- */

static void read_slip(const contact *c)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "slip");
    kmp_dimension wanted = kmp_key_dimension(contact_keys, "slip");
    const char *what = kmp_reader_say(c->r, "slip of %s", c->what);
    bool list = node && node->kind == KMP_YAML_LIST;
    if (list && !kmp_read_list(c->r, node, what, 3))
        return;
    for (int k = 0; node && k < (list ? 3 : 1); k++)
        c->force->vector[k] = kmp_read_expr(c->r, list ? node->items[k] : node, what, wanted, KMP_OF_STATE);
}

/* The geometry in its words; false: it cannot be read any further. */
static bool read_geometry(contact *c)
{
    kmp_force *force = c->force;
    if (c->made->form == KMP_COMPLIANT_JOURNAL) {
        kmp_journal journal = {0};
        (void)kmp_read_journal(c->r, c->map, c->what, c->force, &journal);
        if (journal.ball && journal.radius && journal.clearance)
            read_ball_surfaces(c->r, c->force, &journal, &c->force->touch);
        c->made->clearance = journal.clearance;
        c->made->radius = journal.radius;
        c->made->ball = journal.ball;
    } else if (kmp_yaml_get(c->map, "guide")) {
        return kmp_read_guide(c->r, c->map, c->what, force, &force->touch);
    } else if (kmp_read_touch(c->r, c->map, c->what, &force->touch)) {
        read_slip(c);
    } else {
        return false;
    }
    return true;
}

/* Keys of the other geometry. */
static void refuse_keys(const contact *c)
{
    static const char *const of_gap[] = {"slip", "radii", "on", "corner", "height"},
                             *const of_guide[] = {"slip", "on", "radius"},
                             *const of_joints[] = {"clearance", "corner", "height"};
    bool journal = c->made->form == KMP_COMPLIANT_JOURNAL;
    bool sides = !journal && c->force->touch.side[0].point >= 0;
    const kmp_name_list keys = journal                         ? KMP_NAMES_OF(of_gap)
                               : kmp_yaml_get(c->map, "guide") ? KMP_NAMES_OF(of_guide)
                               : sides                         ? KMP_NAMES(of_gap, 1)
                                                               : KMP_NAMES_OF(of_joints);
    int first = -1;
    if (kmp_count_keys(c->map, keys, &first) > 0)
        KMP_COMPLAIN(c, kmp_yaml_get(c->map, kmp_name_at(keys, first)), "the key '%s' does not belong to this contact",
                     kmp_name_at(keys, first));
}

/* -- films of journals ------------------------------------------------------------------------------- */

/* The film of a journal: its law over the place and the rate of the journal, as film_rows and steps of film_laws.def.
 */

static const kmp_key film_keys[] = {
#include "model/read/film_keys.def"
    {0}};

/* A law's row, or a step of the law before it. */
typedef struct film_row {
    const char *law, *name, *formula;
} film_row;

static const film_row film_rows[] = {
#define KMP_FILM_LAW(word, scale, source) {word, "scale", scale},
#define KMP_FILM_STEP(name, formula)      {NULL, name, formula},
#include "model/data/film_laws.def"
#undef KMP_FILM_LAW
#undef KMP_FILM_STEP
};

enum { FILM_ROWS = sizeof film_rows / sizeof *film_rows };

#define KMP_PLACE(k)                                                                                                   \
    {                                                                                                                  \
        .kind = KMP_EXPR_PLACE, .index = (k)                                                                           \
    }
static const kmp_expr film_places[] = {KMP_PLACE(KMP_LOCAL_FILM_X), KMP_PLACE(KMP_LOCAL_FILM_Y),
                                       KMP_PLACE(KMP_LOCAL_FILM_U), KMP_PLACE(KMP_LOCAL_FILM_V)};
static const char *const place_names[] = {"x", "y", "u", "v"};

/* Only the laws, for a choice. */
static int find_film_law(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *words[FILM_ROWS];
    int at[FILM_ROWS], count = 0;
    for (int k = 0; k < FILM_ROWS; k++)
        if (film_rows[k].law) {
            words[count] = film_rows[k].law;
            at[count++] = k;
        }
    int found = kmp_read_choice(r, node, what, KMP_NAMES(words, count), "the law is");
    return found < 0 ? -1 : at[found];
}

/* The film of a journal. NULL after an error. */
static const kmp_film *read_film(kmp_reader *r, const kmp_yaml *map, const char *of, const kmp_expr *clearance,
                                 const kmp_expr *radius)
{
    static const char *const sizes[] = {"viscosity", "length", "least"};
    const char *what = kmp_reader_say(r, "film of %s", of);
    kmp_film *film = KMP_ARENA_NEW(&r->model->arena, kmp_film, 1);
    if (!film || !kmp_read_map(r, map, what, film_keys))
        return NULL;
    const kmp_yaml *word = kmp_read_required(r, map, what, "law");
    int law = word ? find_film_law(r, word, what) : -1;
    kmp_expr_locals numbers = {0};
    for (int k = 0; k < 3; k++)
        kmp_local_put(&numbers, sizes[k],
                      kmp_read_ruled_key(r, map, what, sizes[k], true, kmp_key_dimension(film_keys, sizes[k]),
                                         KMP_FIELD_POSITIVE));
    kmp_local_put(&numbers, "clearance", clearance);
    kmp_local_put(&numbers, "radius", radius);
    if (law < 0 || numbers.count < 5)
        return NULL;
    *film = (kmp_film){.law = film_rows[law].law};
    film->scale = read_formula(r, film_rows[law].formula, &numbers);
    film->drag = read_formula(r, "2*pi*viscosity*radius^3*length/clearance", &numbers);
    film->most = read_formula(r, "1 - least/clearance", &numbers);
    /* The steps of a law, of which the last two are its force. */
    kmp_expr_locals locals = {0};
    for (int k = 0; k < 4; k++)
        kmp_local_put(&locals, place_names[k], &film_places[k]);
    for (int k = law + 1; k < FILM_ROWS && !film_rows[k].law; k++) {
        const kmp_expr *step = read_formula(r, film_rows[k].formula, &locals);
        kmp_local_put(&locals, film_rows[k].name, step);
        film->force[0] = film->force[1];
        film->force[1] = step;
    }
    if (film->most && kmp_expr_value(film->most, r->parameter_values) <= 0)
        kmp_complain_of(r, map, what, "the least thickness of the film is not below the clearance");
    return film;
}

static void read_film_of(const contact *c)
{
    const kmp_yaml *map = kmp_yaml_get(c->map, "film");
    if (!map)
        return;
    if (c->made->form != KMP_COMPLIANT_JOURNAL || c->made->ball)
        KMP_COMPLAIN(c, map, "a journal in its bearing has a film, and this is none");
    else if (kmp_read_required(c->r, c->map, c->what, "radius") && c->made->radius && c->made->clearance)
        c->made->film = read_film(c->r, map, c->what, c->made->clearance, c->made->radius);
}

/* -- the whole --------------------------------------------------------------------------------------- */

void kmp_read_compliant(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force)
{
    struct kmp_compliant *made = KMP_ARENA_NEW(&r->model->arena, struct kmp_compliant, 1);
    contact c = {.r = r, .map = map, .what = what, .force = force, .made = made};
    bool journal = kmp_yaml_get(map, "journal") || kmp_yaml_get(map, "socket");
    if (!made)
        return;
    *made = (struct kmp_compliant){.form = journal ? KMP_COMPLIANT_JOURNAL : KMP_COMPLIANT_GAP, .state = -1};
    force->compliant = made;
    force->touch = (kmp_contact_pair){.motion = -1, .side = {{.point = -1}, {.point = -1}}};
    if (!read_geometry(&c))
        return;
    force->turns = force->touch.turns;
    refuse_keys(&c);
    read_law(&c);
    read_friction(&c);
    read_film_of(&c);
    /* The rate where contact begins, at least the smallest one. */
    kempe_model *model = c.r->model;
    kmp_number least = {0};
    const char *name = kmp_reader_say(c.r, "%s.impact", c.force->name);
    const kmp_yaml *node = kmp_yaml_get(c.map, "least_rate");
    c.made->state = kmp_name_find(KMP_NAMED(model, state), name);
    (void)kmp_key_default(contact_keys, "least_rate", 1, &least.value);
    const kmp_expr *given =
        node ? read_given(&c, "least_rate", kmp_key_dimension(contact_keys, "least_rate"), KMP_FIELD_POSITIVE)
             : kmp_number_expr(&model->arena, least);
    if (c.made->state < 0 || !given)
        return;
    const kmp_measure_argument argument = {.point = -1, .axis = -1, .name = c.force->name};
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "least", given);
    kmp_local_put(&locals, "rate", kmp_expr_measure(&model->arena, KMP_MEASURE_APPROACH, 1, &argument));
    kmp_state *state = &model->states[c.made->state];
    state->next = read_formula(c.r, "max(rate, least)", &locals);
    state->start = kmp_number_of(given, number_of(r, given));
    state->contact = 1 + (int)(c.force - model->forces);
}
