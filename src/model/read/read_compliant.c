/* SPDX-License-Identifier: BSD-3-Clause */
/* A contact with a law: its geometry, its law as an expression of depth and rate, its friction. */
#include "model/read/read_compliant.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/read_contacts.h"
#include "model/read/read_film.h"
#include "model/read/read_journal.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <math.h>
#include <string.h>

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
    kmp_expr_locals numbers; /* those of its law so far, and the quantities */
} contact;

/* -- numbers --------------------------------------------------------------------------------------- */

/* One number of a node; NULL after an error. */
static const kmp_expr *read_one(const contact *c, const kmp_yaml *node, const char *key, kmp_dimension wanted,
                                kmp_field_rule rule)
{
    kmp_number number;
    const char *name = kmp_reader_say(c->r, "the %s of %s", key, c->what);
    if (!kmp_read_number(c->r, node, name, wanted, &number) ||
        !kmp_check_rule(c->r, node, name, rule, number.value, ""))
        return NULL;
    return kmp_read_as_expr(c->r, &number);
}

/* The number of a key, NULL without it or after an error. */
static const kmp_expr *read_given(const contact *c, const char *key, kmp_dimension wanted, kmp_field_rule rule)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, key);
    return node ? read_one(c, node, key, wanted, rule) : NULL;
}

/* The k-th of one or two numbers, one for both. */
static const kmp_expr *read_of_two(const contact *c, const char *key, int k, kmp_field_rule rule)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, key);
    kmp_number absent = {0};
    if (!node && kmp_key_default(contact_keys, key, 1, &absent.value))
        return kmp_read_as_expr(c->r, &absent);
    if (node && node->kind == KMP_YAML_LIST &&
        !kmp_read_list(c->r, node, kmp_reader_say(c->r, "%s of %s", key, c->what), 2))
        return NULL;
    if (node && node->kind == KMP_YAML_LIST)
        node = node->items[k];
    return node ? read_one(c, node, key, kmp_key_dimension(contact_keys, key), rule) : NULL;
}

static double value_of(const contact *c, const kmp_expr *e)
{
    return e ? kmp_expr_value(e, c->r->parameter_values) : NAN;
}

/* -- law ------------------------------------------------------------------------------------------- */

/* True if a text has a word. */
static bool mentions(const char *text, const char *word)
{
    size_t n = strlen(word);
    for (const char *at = strstr(text, word); at; at = strstr(at + 1, word))
        if ((at == text || !strchr("abcdefghijklmnopqrstuvwxyz_", at[-1])) &&
            !(at[n] && strchr("abcdefghijklmnopqrstuvwxyz_", at[n])))
            return true;
    return false;
}

static bool fits(const law_row *row, const kmp_yaml *map)
{
    return (mentions(row->force, "damping") && kmp_yaml_get(map, "damping")) ||
           (mentions(row->force, "restitution") && kmp_yaml_get(map, "restitution"));
}

/* The row of a word: of two the one whose number is given, otherwise the first. */
static const law_row *find_law(const char *word, const kmp_yaml *map)
{
    const law_row *found = NULL;
    for (int k = 0; k < law_words.count; k++)
        if (strcmp(laws[k].word, word) == 0 && (!found || fits(&laws[k], map)))
            found = &laws[k];
    return found;
}

bool kmp_contact_keeps_rate(const kmp_yaml *map)
{
    const kmp_yaml *law = kmp_yaml_get(map, "law"), *force = kmp_yaml_get(map, "force");
    const law_row *row = law && law->kind == KMP_YAML_SCALAR ? find_law(law->text, map) : NULL;
    return row ? mentions(row->force, "impact")
               : force && force->kind == KMP_YAML_SCALAR && mentions(force->text, "impact");
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
    kmp_add_local(&locals, "a", kmp_read_as_expr(c->r, &touch->radius[0]));
    if (touch->side[1].shape == KMP_TOUCH_PLANE)
        return kmp_read_formula(c->r, "a", &locals);
    kmp_add_local(&locals, "b", kmp_read_as_expr(c->r, &touch->radius[1]));
    return kmp_read_formula(c->r, touch->side[1].hollow ? "a*b/(b - a)" : "a*b/(a + b)", &locals);
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
        kmp_add_local(&locals, "a", made->radius);
        kmp_add_local(&locals, "c", made->clearance);
        return locals.count == 2 ? kmp_read_formula(c->r, "a*(a - c)/c", &locals) : NULL;
    }
    if (!radii && is_of_spheres(&c->force->touch))
        return radius_of_sides(c);
    if (!radii)
        kmp_read_required(c->r, c->map, c->what, "radii");
    kmp_add_local(&locals, "a", read_of_two(c, "radii", 0, KMP_FIELD_ANY));
    if (!radii || radii->kind != KMP_YAML_LIST)
        return locals.count == 1 ? kmp_read_formula(c->r, "a", &locals) : NULL;
    kmp_add_local(&locals, "b", read_of_two(c, "radii", 1, KMP_FIELD_ANY));
    return locals.count == 2 ? kmp_read_formula(c->r, "a*b/(a + b)", &locals) : NULL;
}

static const kmp_expr *read_stiffness(const contact *c, double exponent)
{
    const kmp_yaml *given = kmp_yaml_get(c->map, "stiffness"), *young = kmp_yaml_get(c->map, "young");
    bool turns = c->force->turns;
    kmp_dimension depth = kmp_dimension_power(turns ? KMP_DIM_NUMBER : KMP_DIM_LENGTH, exponent);
    kmp_dimension wanted = kmp_dimension_times(turns ? KMP_DIM_TORQUE : KMP_DIM_FORCE, depth, -1);
    if (given && young)
        kmp_reader_complain(c->r, young->place, "%s: 'stiffness' and 'young' exclude each other", c->what);
    if (given || !young) {
        (void)kmp_read_required(c->r, c->map, c->what, "stiffness");
        return read_given(c, "stiffness", wanted, KMP_FIELD_POSITIVE);
    }
    if (exponent != 1.5)
        kmp_reader_complain(c->r, young->place, "%s: the stiffness by 'young' is that of the exponent 1.5, not %g",
                            c->what, exponent);
    /* Hertz's stiffness of two spheres: F = 4/3 E* sqrt(R) d^1.5, 1/E* = sum (1 - nu^2)/E (Johnson 1985, eq. 4.23). */
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "reduced", reduced_radius(c));
    kmp_add_local(&locals, "young", read_of_two(c, "young", 0, KMP_FIELD_POSITIVE));
    kmp_add_local(&locals, "other_young", read_of_two(c, "young", 1, KMP_FIELD_POSITIVE));
    kmp_add_local(&locals, "poisson", read_of_two(c, "poisson", 0, KMP_FIELD_ANY));
    kmp_add_local(&locals, "other_poisson", read_of_two(c, "poisson", 1, KMP_FIELD_ANY));
    if (locals.count < 5)
        return NULL;
    if (!(value_of(c, locals.local[0].expr) > 0)) {
        kmp_reader_complain(c->r, c->map->place,
                            "%s: the radii do not touch from outside: their sum of curvatures is not positive",
                            c->what);
        return NULL;
    }
    return kmp_read_formula(c->r, "4/3*sqrt(reduced)/((1 - poisson^2)/young + (1 - other_poisson^2)/other_young)",
                            &locals);
}

static const kmp_expr *read_exponent(const contact *c, bool has)
{
    kmp_number absent = {.value = has ? 1.5 : 1};
    const kmp_yaml *node = kmp_yaml_get(c->map, "exponent");
    const kmp_expr *e = node && has ? read_given(c, "exponent", KMP_DIM_NUMBER, KMP_FIELD_POSITIVE) : NULL;
    if (e && value_of(c, e) < 1)
        kmp_reader_complain(c->r, node->place, "the exponent of %s is %g: it must be at least 1", c->what,
                            value_of(c, e));
    return e ? e : kmp_read_as_expr(c->r, &absent);
}

/* Numbers that the law does not have. */
static void refuse_numbers(const contact *c, const law_row *row, const char *const *names, int count)
{
    for (int k = 0; k < count; k++) {
        const kmp_yaml *node = kmp_yaml_get(c->map, names[k]);
        if (node && (!row || !mentions(row->force, names[k])))
            kmp_reader_complain(c->r, node->place, "%s: the law %s has no %s", c->what,
                                row ? row->word : "by an expression", names[k]);
    }
}

/* The solution y > 1 of y - ln y = w, w = ln(4 c/(e depth)), by steps of Newton from w + ln w: five are enough for the
 * last digit where the depth is at most 0.95 of its largest value, 4 c/e^2, at which y = 1. */
static const kmp_expr *johnson_root(const contact *c)
{
    enum { STEPS = 6 };
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "c", c->made->clearance);
    kmp_add_local(&locals, "depth", &quantities[0]);
    const kmp_expr *w = kmp_read_formula(c->r, "log(1.4715177646857693*c/(depth + 1e-300))", &locals), *y;
    locals.count = 0;
    kmp_add_local(&locals, "w", w);
    y = locals.count ? kmp_read_formula(c->r, "w + log(w)", &locals) : NULL;
    for (int k = 0; k < STEPS && y; k++) {
        locals.count = 1;
        kmp_add_local(&locals, "y", y);
        y = kmp_read_formula(c->r, "y*(log(y) + w - 1)/(y - 1)", &locals);
    }
    return y;
}

/* A cylinder in a cylinder: modulus and y of the law's row. */
static void read_johnson(contact *c)
{
    kmp_expr_locals locals = {0};
    if (c->made->form != KMP_COMPLIANT_JOURNAL || c->made->ball) {
        kmp_reader_complain(c->r, c->map->place, "%s: the law johnson is that of a journal in its bearing", c->what);
        return;
    }
    if (!kmp_read_required(c->r, c->map, c->what, "young") || !kmp_read_required(c->r, c->map, c->what, "length"))
        return;
    kmp_add_local(&locals, "young", read_of_two(c, "young", 0, KMP_FIELD_POSITIVE));
    kmp_add_local(&locals, "other_young", read_of_two(c, "young", 1, KMP_FIELD_POSITIVE));
    kmp_add_local(&locals, "poisson", read_of_two(c, "poisson", 0, KMP_FIELD_ANY));
    kmp_add_local(&locals, "other_poisson", read_of_two(c, "poisson", 1, KMP_FIELD_ANY));
    kmp_add_local(&locals, "length", read_given(c, "length", KMP_DIM_LENGTH, KMP_FIELD_POSITIVE));
    if (locals.count < 5 || !c->made->clearance)
        return;
    c->made->limited = true;
    kmp_add_local(
        &c->numbers, "modulus",
        kmp_read_formula(c->r, "pi*length/((1 - poisson^2)/young + (1 - other_poisson^2)/other_young)", &locals));
    kmp_add_local(&c->numbers, "y", johnson_root(c));
}

static void read_row(contact *c, const law_row *row)
{
    static const char *const own[] = {"exponent", "damping", "restitution"};
    kmp_expr_locals *numbers = &c->numbers;
    const kmp_expr *exponent = read_exponent(c, mentions(row->force, "exponent"));
    refuse_numbers(c, row, own, 3);
    for (int k = 1; k < 3; k++)
        if (mentions(row->force, own[k])) {
            (void)kmp_read_required(c->r, c->map, c->what, own[k]);
            const kmp_expr *e =
                read_given(c, own[k], k == 1 && !c->force->turns ? kmp_dimension_of(row->unit) : KMP_DIM_NUMBER,
                           KMP_FIELD_NOT_NEGATIVE);
            if (k == 2) {
                double value = value_of(c, e);
                if (e && (value <= 0 || value > 1))
                    kmp_reader_complain(c->r, kmp_yaml_get(c->map, "restitution")->place,
                                        "the restitution of %s is %g: it must be above 0 and at most 1", c->what,
                                        value);
            }
            kmp_add_local(numbers, own[k], e);
        }
    kmp_add_local(numbers, "exponent", exponent);
    if (mentions(row->force, "modulus"))
        read_johnson(c);
    else
        kmp_add_local(numbers, "stiffness", read_stiffness(c, value_of(c, exponent)));
    if (c->r->wrong)
        return;
    c->made->law = row->word;
    c->force->effort = kmp_read_formula(c->r, row->force, numbers);
    c->made->store = row->store[0] ? kmp_read_formula(c->r, row->store, numbers) : NULL;
}

/* The law of the user, over the same quantities. */
static void read_own_law(contact *c, const kmp_yaml *node)
{
    static const char *const numbers[] = {"stiffness", "exponent", "damping", "restitution",
                                          "young",     "poisson",  "radii"};
    refuse_numbers(c, NULL, numbers, 7);
    c->r->locals = &c->numbers;
    c->force->effort =
        kmp_read_expr(c->r, node, c->what, c->force->turns ? KMP_DIM_TORQUE : KMP_DIM_FORCE, KMP_OF_LOADS);
    c->r->locals = NULL;
}

static void read_law(contact *c)
{
    static const char *const ways[] = {"law", "force"};
    if (kmp_read_one_key(c->r, c->map, c->what, KMP_NAMES_OF(ways)) < 0)
        return;
    const kmp_yaml *word = kmp_yaml_get(c->map, "law"), *own = kmp_yaml_get(c->map, "force");
    for (int k = 0; k < 3; k++)
        kmp_add_local(&c->numbers, quantity_names[k], &quantities[k]);
    if (own)
        read_own_law(c, own);
    else if (kmp_read_choice(c->r, word, c->what, law_words, "the law is", " or ") >= 0)
        read_row(c, find_law(word->text, c->map));
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
        c->made->speed =
            read_one(c, speed, "speed of friction", kmp_key_dimension(friction_keys, "speed"), KMP_FIELD_POSITIVE);
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

static void read_journal(contact *c)
{
    kmp_journal journal = {0};
    (void)kmp_read_journal(c->r, c->map, c->what, c->force, &journal);
    if (journal.ball && journal.radius && journal.clearance)
        kmp_read_ball_surfaces(c->r, c->force, &journal, &c->force->touch);
    c->made->clearance = journal.clearance;
    c->made->radius = journal.radius;
    c->made->ball = journal.ball;
}

/* The geometry in its words; false: it cannot be read any further. */
static bool read_geometry(contact *c)
{
    kmp_force *force = c->force;
    if (c->made->form == KMP_COMPLIANT_JOURNAL)
        read_journal(c);
    else if (kmp_yaml_get(c->map, "guide"))
        return kmp_read_guide(c->r, c->map, c->what, force, &force->touch);
    else if (kmp_read_touch(c->r, c->map, c->what, &force->touch))
        read_slip(c);
    else
        return false;
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
        kmp_reader_complain(c->r, kmp_yaml_get(c->map, kmp_name_at(keys, first))->place,
                            "%s: the key '%s' does not belong to this contact", c->what, kmp_name_at(keys, first));
}

/* -- the state of the impact ------------------------------------------------------------------------- */

static void read_film(const contact *c)
{
    const kmp_yaml *map = kmp_yaml_get(c->map, "film");
    if (!map)
        return;
    if (c->made->form != KMP_COMPLIANT_JOURNAL || c->made->ball)
        kmp_reader_complain(c->r, map->place, "%s: a journal in its bearing has a film, and this is none", c->what);
    else if (kmp_read_required(c->r, c->map, c->what, "radius") && c->made->radius && c->made->clearance)
        c->made->film = kmp_read_film(c->r, map, c->what, c->made->clearance, c->made->radius);
}

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
    read_film(&c);
    /* The rate where contact begins, at least the smallest one. */
    kempe_model *model = c.r->model;
    kmp_number least = {0};
    const char *name = kmp_reader_say(c.r, "%s.impact", c.force->name);
    const kmp_yaml *node = kmp_yaml_get(c.map, "least_rate");
    c.made->state = kmp_name_find(KMP_NAMED(model, state), name);
    (void)kmp_key_default(contact_keys, "least_rate", 1, &least.value);
    const kmp_expr *given =
        node ? read_given(&c, "least_rate", kmp_key_dimension(contact_keys, "least_rate"), KMP_FIELD_POSITIVE)
             : kmp_read_as_expr(c.r, &least);
    if (c.made->state < 0 || !given)
        return;
    const kmp_measure_argument argument = {.point = -1, .axis = -1, .name = c.force->name};
    kmp_expr_locals locals = {0};
    kmp_add_local(&locals, "least", given);
    kmp_add_local(&locals, "rate", kmp_expr_measure(&model->arena, KMP_MEASURE_APPROACH, 1, &argument));
    kmp_state *state = &model->states[c.made->state];
    state->next = kmp_read_formula(c.r, "max(rate, least)", &locals);
    state->start = kmp_number_of(given, value_of(&c, given));
    state->contact = 1 + (int)(c.force - model->forces);
}
