/* SPDX-License-Identifier: BSD-3-Clause */
/* Equalities of MJCF as closures. A coupling without positions keeps the positions of the file: the frames of the
 * bodies at the reference coordinates. A fixed tendon is a linear form of coordinates, a spatial one a rope.
 * An actuator is a force of its input, and of the length and rate of its transmission by affine laws. */
#include "exchange/formats/mjcf_couplings.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/mjcf.h"
#include "exchange/formats/mjcf_bodies.h"
#include "exchange/formats/mjcf_tendons.h"
#include <math.h>
#include <string.h>

/* A linear form of coordinates: one of them, or the length of a fixed tendon; and its value at the references. */
typedef struct form {
    int count;
    const char **joint;
    double *factor, reference, rest; /* the latter: where the springs of joints are at rest */
    bool slides, mixed;              /* it is a length; it is the sum of a length and an angle */
} form;

/* -- forms --------------------------------------------------------------------------------------------- */

/* Adds to a form: a coordinate of Kempe; a joint of the file; the joints of the fixed tendon of a name. */
static void add_term(kmp_mjcf *m, form *f, const char *joint, double factor)
{
    int k = 0;
    while (k < f->count && strcmp(f->joint[k], joint) != 0)
        k++;
    if (k < f->count) {
        f->factor[k] += factor;
        return;
    }
    const char **joints = kmp_arena_room(m->im->arena, f->joint, f->count, sizeof *joints);
    double *factors = kmp_arena_room(m->im->arena, f->factor, f->count, sizeof *factors);
    if (!joints || !factors)
        return;
    f->joint = joints;
    f->factor = factors;
    joints[f->count] = joint;
    factors[f->count++] = factor;
}

static void add_joint(kmp_mjcf *m, form *f, const kmp_element *from, const char *name, double factor)
{
    const kmp_mjcf_joint *j = name ? kmp_mjcf_joint_of(m, from, name) : NULL;
    if (!j)
        return;
    f->slides = f->count == 0 ? j->slides : f->slides;
    f->mixed = f->mixed || f->slides != j->slides;
    f->reference += factor * j->reference;
    f->rest += factor * j->rest;
    add_term(m, f, j->own, factor);
}

/* Prints a form, "1*q(a) + -0.5*q(b)"; `word`: q, or qd for its rate. */
static void put_form(kmp_text *text, const form *f, const char *word)
{
    for (int k = 0; k < f->count; k++)
        kmp_text_printf(text, "%s%.17g*%s(%s)", k > 0 ? " + " : "", f->factor[k], word, f->joint[k]);
}

/* The tendon of a name, of any kind; NULL after a complaint. */
static const kmp_element *tendon_named(kmp_mjcf *m, const kmp_element *from, const char *name)
{
    const kmp_element *found = NULL;
    for (const kmp_element *section = kmp_element_find(m->im->model, "tendon"); section && !found;
         section = kmp_element_again(section))
        for (const kmp_element *e = section->first; e && !found; e = e->next) {
            const char *own = kmp_element_text(e, "name");
            found = own && strcmp(own, name) == 0 ? e : NULL;
        }
    if (!found)
        kmp_import_complain(m->im, from->place, "the tendon", name, "does not exist");
    return found;
}

static bool is_fixed(const kmp_element *tendon)
{
    return strcmp(tendon->name, "fixed") == 0;
}

static void add_joints(kmp_mjcf *m, form *f, const kmp_element *tendon)
{
    for (const kmp_element *e = kmp_element_find(tendon, "joint"); e; e = kmp_element_again(e))
        add_joint(m, f, e, kmp_import_attribute(m->im, e, "joint"), kmp_import_read_number(m->im, e, "coef", 1));
}

/* -- two bodies ---------------------------------------------------------------------------------------- */

static const kmp_mjcf_body *body_of(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key)
{
    const char *name = kmp_mjcf_text(item, key);
    if (!name && strcmp(key, "body2") == 0)
        return &m->world;
    if (!name)
        kmp_import_complain(m->im, item->own->place, "attribute", key, "is missing here");
    return name ? kmp_mjcf_body_of(m, item->own, name) : NULL;
}

static const char *site_of(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key)
{
    const char *name = kmp_mjcf_text(item, key);
    const kmp_mjcf_site *s = name ? kmp_mjcf_site_of(m, item->own, name) : NULL;
    if (!name)
        kmp_import_complain(m->im, item->own->place, "attribute", key, "is missing here");
    return s ? s->point : NULL;
}

/* The frames in both bodies that a connect or weld makes one. */
static void meet(kmp_mjcf *m, const kmp_mjcf_item *item, const kmp_mjcf_body *const body[2], kmp_pose frame[2])
{
    bool connects = strcmp(item->own->name, "connect") == 0;
    double anchor[3] = {0}, given[7] = {0};
    const kmp_pose back[2] = {kmp_frame_inverse(&body[0]->world), kmp_frame_inverse(&body[1]->world)};
    kmp_pose at = kmp_frame_none(), second = kmp_frame_in(&back[0], &body[1]->world);
    if (kmp_mjcf_numbers(m, item, "anchor", 3, 3, anchor) == 0 && connects)
        kmp_import_complain(m->im, item->own->place, "attribute", "anchor", "is missing here");
    memcpy(at.p, anchor, sizeof at.p);
    if (connects) {
        const kmp_pose world = kmp_frame_in(&body[0]->world, &at);
        frame[0] = at;
        frame[1] = kmp_frame_in(&back[1], &world);
        memcpy(frame[1].r, kmp_frame_none().r, sizeof frame[1].r);
        return;
    }
    frame[0] = kmp_frame_in(&second, &at);
    frame[1] = at;
    if (kmp_mjcf_numbers(m, item, "relpose", 7, 7, given) && kmp_frame_turn(given + 3, frame[0].r))
        memcpy(frame[0].p, given, sizeof frame[0].p); /* of the anchor */
}

static void add_pair(kmp_mjcf *m, const kmp_mjcf_item *item, const char *name)
{
    kmp_import *im = m->im;
    bool connects = strcmp(item->own->name, "connect") == 0;
    const char *points[2];
    if (kmp_mjcf_text(item, "site1") || kmp_mjcf_text(item, "site2")) {
        points[0] = site_of(m, item, "site1");
        points[1] = site_of(m, item, "site2");
    } else {
        const kmp_mjcf_body *body[2] = {body_of(m, item, "body1"), body_of(m, item, "body2")};
        kmp_pose frame[2];
        if (!body[0] || !body[1])
            return;
        meet(m, item, body, frame);
        for (int k = 0; k < 2; k++)
            points[k] = kmp_import_point(im, item->own->place, body[k]->own, name, &frame[k]);
    }
    if (points[0] && points[1])
        kmp_import_loop(im, item->own, name, connects ? "ball" : "weld", points, NULL);
}

/* -- coordinates --------------------------------------------------------------------------------------- */

/* y - y0 = a0 + a1 d + a2 d^2 + .., d = x - x0, by Horner's rule; without x the value of y is constant. */
static void add_polynomial(kmp_mjcf *m, const kmp_element *e, const char *name, const form *y, const form *x,
                           const double a[5])
{
    kmp_import *im = m->im;
    kmp_text text = {0};
    kmp_yaml *map = kmp_import_map(im, e->place);
    put_form(&text, y, "q");
    kmp_text_printf(&text, " - (%.17g)", y->reference + a[0]);
    int most = x->count > 0 ? 4 : 0;
    while (most > 0 && a[most] == 0)
        most--;
    for (int k = 1; k <= most; k++) {
        kmp_text_printf(&text, " %s (", k == 1 ? "-" : "+");
        put_form(&text, x, "q");
        kmp_text_printf(&text, " - (%.17g))*(%.17g", x->reference, a[k]);
    }
    for (int k = 0; k < most; k++)
        kmp_text_put(&text, ")");
    kmp_import_word(im, map, e->place, "constraint", kmp_text_keep(&text, im->arena));
    kmp_import_word(im, map, e->place, "power", y->slides ? "1" : "0");
    kmp_import_add(im, "loops", e, name, map);
}

static void add_relation(kmp_mjcf *m, const kmp_mjcf_item *item, const char *name)
{
    bool joints = strcmp(item->own->name, "joint") == 0;
    static const char *const keys[2][2] = {{"tendon1", "tendon2"}, {"joint1", "joint2"}};
    double a[5] = {0, 1, 0, 0, 0};
    form forms[2] = {{.count = 0}};
    for (int k = 0; k < 2; k++) {
        const char *word = kmp_mjcf_text(item, keys[joints][k]);
        if (!word && k == 0)
            kmp_import_complain(m->im, item->own->place, "attribute", keys[joints][k], "is missing here");
        else if (word && joints)
            add_joint(m, &forms[k], item->own, word, 1);
        else if (word) {
            const kmp_element *tendon = tendon_named(m, item->own, word);
            if (tendon && !is_fixed(tendon))
                kmp_import_complain(m->im, item->own->place, "the tendon", word,
                                    "is spatial: equalities of fixed tendons are read");
            else if (tendon)
                add_joints(m, &forms[k], tendon);
        }
    }
    form *y = &forms[0], *x = &forms[1];
    kmp_mjcf_numbers(m, item, "polycoef", 1, 5, a);
    if (y->count == 0)
        return;
    if (x->count == 0 ? y->count == 1 : a[2] != 0 || a[3] != 0 || a[4] != 0) {
        add_polynomial(m, item->own, name, y, x, a);
        return;
    }
    for (int k = 0; k < x->count; k++)
        add_term(m, y, x->joint[k], -a[1] * x->factor[k]);
    kmp_import_coupler(m->im, item->own, name, y->count, y->joint, y->factor,
                       y->reference + a[0] - (x->count > 0 ? a[1] * x->reference : 0));
}

void kmp_mjcf_add_equalities(kmp_mjcf *m)
{
    int number = 0;
    for (const kmp_element *section = kmp_element_find(m->im->model, "equality"); section && m->has_equalities;
         section = kmp_element_again(section))
        for (const kmp_element *e = section->first; e; e = e->next) {
            bool pair = strcmp(e->name, "connect") == 0 || strcmp(e->name, "weld") == 0;
            if (!pair && strcmp(e->name, "joint") != 0 && strcmp(e->name, "tendon") != 0)
                continue;
            kmp_mjcf_item item = kmp_mjcf_take(m, e, "equality", NULL);
            const char *own = kmp_element_text(e, "name");
            const char *name =
                own ? kmp_import_clean(m->im, own) : kmp_arena_printf(m->im->arena, "%s_%d", e->name, number + 1);
            number++;
            if (kmp_mjcf_flag(m, &item, "active", true))
                (pair ? add_pair : add_relation)(m, &item, name);
        }
}

/* -- transmissions ------------------------------------------------------------------------------------- */

/* The place of a force: a form, a rope through points, or a path over geoms. Its length and rate as expressions. */
typedef struct transmission {
    form form;
    kmp_yaml *points; /* of a rope; NULL: another place */
    const char *path; /* the length of a path as an expression; NULL: another place */
    double rest;      /* the length where the springs of joints are at rest */
    const char *length, *rate;
} transmission;

/* The rope through the sites of a spatial tendon; false after a complaint. */
static bool add_sites(kmp_mjcf *m, transmission *t, const kmp_element *tendon)
{
    kmp_import *im = m->im;
    const kmp_mjcf_site *last = NULL;
    t->points = kmp_yaml_new(im->arena, KMP_YAML_LIST, tendon->place);
    for (const kmp_element *e = tendon->first; e; e = e->next) {
        const char *name = strcmp(e->name, "site") == 0 ? kmp_import_attribute(im, e, "site") : NULL;
        if (!name)
            continue;
        const kmp_mjcf_site *s = kmp_mjcf_site_of(m, e, name);
        if (!s)
            return false;
        if (last)
            t->rest +=
                hypot(hypot(s->world[0] - last->world[0], s->world[1] - last->world[1]), s->world[2] - last->world[2]);
        kmp_yaml_append(im->arena, t->points, NULL, kmp_yaml_word(im->arena, e->place, s->point));
        last = s;
    }
    t->length = "distance";
    t->rate = "rate";
    return t->points && t->points->count > 1;
}

/* `name`: of the tendon in Kempe. */
static bool take_tendon(kmp_mjcf *m, transmission *t, const kmp_element *tendon, const char *name)
{
    if (!is_fixed(tendon) && !kmp_mjcf_is_wrapped(tendon))
        return add_sites(m, t, tendon);
    if (!is_fixed(tendon)) {
        t->path = kmp_mjcf_add_path(m, tendon, name, &t->rest);
        t->length = "distance";
        t->rate = "rate";
        return t->path;
    }
    kmp_text length = {0}, rate = {0};
    add_joints(m, &t->form, tendon);
    put_form(&length, &t->form, "q");
    put_form(&rate, &t->form, "qd");
    t->rest = t->form.rest;
    t->length = kmp_text_keep(&length, m->im->arena);
    t->rate = kmp_text_keep(&rate, m->im->arena);
    return t->form.count > 0 && t->length && t->rate;
}

/* A force `law` that lengthens what it acts on, as NAME; of several joints as NAME_JOINT. */
static void add_force(kmp_mjcf *m, const kmp_element *from, const char *name, const transmission *t, double gear,
                      const char *law)
{
    kmp_import *im = m->im;
    if (t->points || t->path) {
        kmp_yaml *map = kmp_import_map(im, from->place);
        if (t->points)
            kmp_import_put(im, map, from->place, "line", t->points);
        else
            kmp_import_word(im, map, from->place, "sliding", t->path);
        kmp_import_word(im, map, from->place, "force",
                        kmp_arena_printf(im->arena, "%.17g*(%s)", t->points ? 0 - gear : gear, law));
        kmp_import_add(im, "forces", from, name, map);
        return;
    }
    for (int k = 0; k < t->form.count; k++) {
        const kmp_mjcf_joint *j = m->joints;
        double factor = gear * t->form.factor[k];
        while (j && strcmp(j->own, t->form.joint[k]) != 0)
            j = j->next;
        kmp_yaml *map = kmp_import_map(im, from->place);
        kmp_import_word(im, map, from->place, "joint", t->form.joint[k]);
        kmp_import_word(im, map, from->place, j && j->slides ? "force" : "torque",
                        factor == 1 ? law : kmp_arena_printf(im->arena, "%.17g*(%s)", factor, law));
        kmp_import_add(im, "forces", from,
                       t->form.count == 1 ? name : kmp_arena_printf(im->arena, "%s_%s", name, t->form.joint[k]), map);
    }
}

/* -- tendons ------------------------------------------------------------------------------------------- */

/* The length of a tendon whose spring has none. The bodies are known only at the references of their joints. */
static double rest_of(kmp_mjcf *m, const kmp_element *e, const char *name, const transmission *t)
{
    for (const kmp_mjcf_joint *j = t->points || t->path ? m->joints : NULL; j; j = j->next)
        if (j->single && j->rest != j->reference) {
            kmp_import_complain(m->im, e->place, "the tendon", name,
                                "has no springlength, and springs of joints rest at other places than 'ref': give it");
            break;
        }
    return t->rest;
}

/* The force of spring and damper against lengthening, negative: k max(L - b, 0) + k min(L - a, 0) + d rate. */
static const char *spring_law(kmp_mjcf *m, const transmission *t, double stiffness, const double rest[2],
                              double damping)
{
    kmp_text law = {0};
    if (stiffness != 0 && rest[0] == rest[1])
        kmp_text_printf(&law, "%.17g*(%s - (%.17g))", 0 - stiffness, t->length, rest[0]);
    else if (stiffness != 0)
        kmp_text_printf(&law, "%.17g*(max(%s - (%.17g), 0) + min(%s - (%.17g), 0))", 0 - stiffness, t->length, rest[1],
                        t->length, rest[0]);
    if (damping != 0)
        kmp_text_printf(&law, "%s%.17g*(%s)", stiffness != 0 ? " + " : "", 0 - damping, t->rate);
    return kmp_text_keep(&law, m->im->arena);
}

/* The length as an expression of the whole model. */
static const char *whole_length(kmp_mjcf *m, const transmission *t)
{
    kmp_text length = {0};
    for (int k = 0; t->points && k + 1 < t->points->count; k++)
        kmp_text_printf(&length, "%sdistance(%s, %s)", k > 0 ? " + " : "", t->points->items[k]->text,
                        t->points->items[k + 1]->text);
    return t->path ? t->path : t->points ? kmp_text_keep(&length, m->im->arena) : t->length;
}

static bool is_length(const transmission *t)
{
    return t->points || t->path || t->form.slides;
}

/* Dry friction against the rate of the length. */
static void add_friction(kmp_mjcf *m, const kmp_element *e, const char *name, const transmission *t, double level)
{
    kmp_import *im = m->im;
    kmp_yaml *map = kmp_import_map(im, e->place), *law = kmp_import_map(im, e->place);
    kmp_import_word(im, map, e->place, "sliding", whole_length(m, t));
    kmp_import_value(im, law, e->place, is_length(t) ? "force" : "torque", level);
    kmp_import_put(im, map, e->place, "friction", law);
    kmp_import_add(im, "forces", e, kmp_arena_printf(im->arena, "%s_friction", name), map);
}

static void add_tendon(kmp_mjcf *m, const kmp_element *e, int number)
{
    kmp_import *im = m->im;
    const kmp_mjcf_item item = kmp_mjcf_take(m, e, "tendon", NULL);
    const char *own = kmp_element_text(e, "name"), *limited = kmp_mjcf_text(&item, "limited"),
               *name = own ? kmp_import_clean(im, own) : kmp_arena_printf(im->arena, "tendon_%d", number);
    double range[2] = {0}, stiffness = m->has_springs ? kmp_mjcf_number(m, &item, "stiffness", 0) : 0,
           damping = m->has_dampers ? kmp_mjcf_number(m, &item, "damping", 0) : 0,
           friction = m->has_friction ? kmp_mjcf_number(m, &item, "frictionloss", 0) : 0, rest[2] = {-1, -1};
    transmission t = {.points = NULL};
    const bool limits =
        m->has_limits && kmp_mjcf_numbers(m, &item, "range", 2, 2, range) == 2 &&
        (limited && strcmp(limited, "auto") != 0 ? kmp_mjcf_flag(m, &item, "limited", false) : m->ranges_count);
    if ((stiffness == 0 && damping == 0 && friction == 0 && !limits) || !take_tendon(m, &t, e, name))
        return;
    if (limits)
        kmp_import_limits(im, e, name, whole_length(m, &t), range[0], range[1]);
    if (kmp_mjcf_numbers(m, &item, "springlength", 1, 2, rest) == 1)
        rest[1] = rest[0];
    if (rest[0] == -1 && rest[1] == -1 && stiffness != 0) /* both are absent; one of them is a length */
        rest[0] = rest[1] = rest_of(m, e, name, &t);
    if (stiffness != 0 || damping != 0)
        add_force(m, e, kmp_arena_printf(im->arena, "%s_spring", name), &t, 1,
                  spring_law(m, &t, stiffness, rest, damping));
    if (friction != 0)
        add_friction(m, e, name, &t, friction);
}

void kmp_mjcf_add_tendons(kmp_mjcf *m)
{
    int number = 0;
    for (const kmp_element *section = kmp_element_find(m->im->model, "tendon"); section;
         section = kmp_element_again(section))
        for (const kmp_element *e = section->first; e; e = e->next)
            if (strcmp(e->name, "fixed") == 0 || strcmp(e->name, "spatial") == 0)
                add_tendon(m, e, ++number);
}

/* -- actuators ----------------------------------------------------------------------------------------- */

static const char actuators[] = " motor position velocity general damper ";

/* A force is gain[0] + gain[1] length + gain[2] rate, times the input, plus the same of the bias. */
typedef struct law {
    double gain[10], bias[10];
    const char *gain_type, *bias_type, *dynamics; /* words of MuJoCo */
    const char *by;                               /* the word that gave numbers; NULL: none, or a motor */
    bool biased;                                  /* numbers of a word 'general' may stay in the numbers of a servo */
    bool unclear;                                 /* versions of MuJoCo take different numbers */
} law;

static const law unit_law = {.gain = {1}, .gain_type = "fixed", .bias_type = "none", .dynamics = "none"};

/* True if the element has the number. */
static bool take_number(kmp_mjcf *m, const kmp_mjcf_item *e, const char *key, double *value)
{
    return kmp_mjcf_numbers(m, e, key, 1, 1, value) > 0;
}

static bool take_word(const kmp_element *e, const char *key, const char **word)
{
    const char *text = kmp_element_text(e, key);
    *word = text ? text : *word;
    return text;
}

static void take_general(kmp_mjcf *m, const kmp_mjcf_item *e, law *a)
{
    bool gain = kmp_mjcf_numbers(m, e, "gainprm", 1, 10, a->gain) > 0, any = gain;
    any = kmp_mjcf_numbers(m, e, "biasprm", 1, 10, a->bias) > 0 || any;
    any = take_word(e->own, "gaintype", &a->gain_type) || any;
    any = take_word(e->own, "biastype", &a->bias_type) || any;
    any = take_word(e->own, "dyntype", &a->dynamics) || any;
    a->biased = a->biased || (any && a->by && strcmp(a->by, e->own->name) != 0) || strcmp(a->dynamics, "none") != 0;
    for (int k = 0; k < 3; k++)
        a->biased = a->biased || (any && a->bias[k] != 0);
    a->by = any ? e->own->name : a->by;
}

/* An element changes the law of the elements before it: all actuators have one law, whatever their words. A number that
 * a servo does not have is the one of a law before it. Of a law by another servo some versions of MuJoCo take it,
 * others its usual value. */
static void take_law(kmp_mjcf *m, const kmp_element *element, law *a)
{
    const kmp_mjcf_item e = kmp_mjcf_plain(element);
    const char *word = element->name;
    const bool position = strcmp(word, "position") == 0, damper = strcmp(word, "damper") == 0;
    const bool affine = strcmp(a->gain_type, "affine") == 0, general = a->by && strcmp(a->by, "general") == 0;
    const bool servo = a->by && !general && strcmp(a->by, word) != 0; /* another one */
    double kp = a->gain[0], kv = damper ? (affine ? 0 - a->gain[2] : 0) : position ? 0 - a->bias[2] : a->gain[0];
    if (strcmp(word, "general") == 0) {
        take_general(m, &e, a);
        return;
    }
    const law before = *a;
    *a = unit_law;
    if (strcmp(word, "motor") == 0)
        return;
    const bool has_kp = take_number(m, &e, "kp", &kp), has_kv = take_number(m, &e, "kv", &kv);
    if (damper)
        a->unclear = !has_kv && affine && (general || before.unclear);
    else
        a->unclear = !(has_kv && (has_kp || !position)) && (before.unclear || servo);
    a->biased = before.biased;
    a->unclear = a->unclear || (position && before.biased);
    a->by = word;
    a->gain[0] = damper ? 0 : position ? kp : kv;
    a->gain[2] = damper ? 0 - kv : 0;
    a->gain_type = damper ? "affine" : "fixed";
    a->bias_type = damper ? "none" : "affine";
    a->bias[1] = position ? 0 - kp : 0;
    a->bias[2] = damper ? 0 : 0 - kv;
}

/* The law of an element with its defaults: the outermost one first. */
static law read_law(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    law a = unit_law;
    for (int k = item->count - 1; k >= 0; k--)
        take_law(m, item->defaults[k], &a);
    take_law(m, item->own, &a);
    return a;
}

/* Numbers of a law that is not affine are none. */
static bool settle_law(law *a)
{
    const bool gain = strcmp(a->gain_type, "affine") == 0, bias = strcmp(a->bias_type, "affine") == 0;
    if (!gain)
        a->gain[1] = a->gain[2] = 0;
    if (!bias)
        memset(a->bias, 0, sizeof a->bias);
    return (gain || strcmp(a->gain_type, "fixed") == 0) && (bias || strcmp(a->bias_type, "none") == 0) &&
           strcmp(a->dynamics, "none") == 0;
}

/* "(a + b*length + c*rate)", without the parts that are zero; false: all are. */
static bool put_affine(kmp_text *text, const double a[3], const transmission *t, double gear)
{
    const char *const of[3] = {NULL, t->length, t->rate};
    bool any = false;
    for (int k = 0; k < 3; k++) {
        double factor = k > 0 ? gear * a[k] : a[k];
        if (factor == 0)
            continue;
        kmp_text_printf(text, "%s%.17g", any ? " + " : "(", factor);
        if (of[k])
            kmp_text_printf(text, "*(%s)", of[k]);
        any = true;
    }
    kmp_text_put(text, any ? ")" : "");
    return any;
}

/* `inside` between the two limits of an attribute, where they hold. */
static const char *clamp(kmp_mjcf *m, const kmp_mjcf_item *item, const char *range, const char *limited,
                         const char *inside)
{
    const bool damper = strcmp(item->own->name, "damper") == 0 && strcmp(range, "ctrlrange") == 0;
    double limit[2] = {0};
    const char *word = kmp_mjcf_text(item, limited);
    bool given = kmp_mjcf_numbers(m, item, range, 2, 2, limit) == 2,
         counts = word && strcmp(word, "auto") != 0 ? kmp_mjcf_flag(m, item, limited, false) : m->ranges_count;
    return given && (counts || damper) && inside /* the input of a damper always has limits */
               ? kmp_arena_printf(m->im->arena, "max(%.17g, min(%.17g, %s))", limit[0], limit[1], inside)
               : inside;
}

static const char *law_of(kmp_mjcf *m, const kmp_mjcf_item *item, const law *a, const transmission *t, double gear,
                          const char *input)
{
    kmp_text text = {0};
    const char *ctrl = m->has_clamps ? clamp(m, item, "ctrlrange", "ctrllimited", input) : input;
    bool plain = a->gain[0] == 1 && a->gain[1] == 0 && a->gain[2] == 0,
         some = plain || put_affine(&text, a->gain, t, gear);
    kmp_text_printf(&text, "%s%s", plain || !some ? "" : "*", some ? ctrl : "0");
    if (a->bias[0] != 0 || a->bias[1] != 0 || a->bias[2] != 0) {
        kmp_text_put(&text, " + ");
        (void)put_affine(&text, a->bias, t, gear);
    }
    return clamp(m, item, "forcerange", "forcelimited", kmp_text_keep(&text, m->im->arena));
}

/* True if it acts on a coordinate or a tendon, which is taken. */
static bool take_transmission(kmp_mjcf *m, const kmp_mjcf_item *item, transmission *t)
{
    const char *joint = kmp_mjcf_text(item, "joint"), *tendon = kmp_mjcf_text(item, "tendon");
    joint = joint ? joint : kmp_mjcf_text(item, "jointinparent");
    const kmp_mjcf_joint *j = m->joints;
    while (j && (!joint || !j->name || strcmp(j->name, joint) != 0))
        j = j->next;
    if (j && j->single) {
        t->form.slides = j->slides;
        add_term(m, &t->form, j->own, 1);
        t->length = kmp_arena_printf(m->im->arena, "q(%s)", j->own);
        t->rate = kmp_arena_printf(m->im->arena, "qd(%s)", j->own);
        return t->length && t->rate;
    }
    const kmp_element *e = !joint && tendon ? tendon_named(m, item->own, tendon) : NULL;
    return e && take_tendon(m, t, e, kmp_import_clean(m->im, tendon));
}

static void add_actuator(kmp_mjcf *m, const kmp_element *e)
{
    kmp_import *im = m->im;
    const kmp_mjcf_item item = kmp_mjcf_take(m, e, actuators, NULL);
    const char *given = kmp_element_text(e, "name");
    transmission t = {.points = NULL};
    double gear[6] = {1, 0, 0, 0, 0, 0};
    law a = read_law(m, &item);
    bool motor = strcmp(e->name, "motor") == 0;
    if (!take_transmission(m, &item, &t)) {
        kmp_import_leave_out(im, e->place, motor ? KMP_PART_AT_TIMES : KMP_PART_MECHANICS, e->name,
                             "%s '%s' is not used: it moves no joint with one coordinate and no tendon", e->name,
                             given ? given : "");
        return;
    }
    if (a.unclear) {
        kmp_import_leave_out(im, e->place, KMP_PART_MECHANICS, e->name,
                             "%s '%s' is not used: its law follows from defaults of another kind of actuator, which "
                             "versions of MuJoCo read differently: give it its numbers",
                             e->name, given ? given : "");
        return;
    }
    if (!settle_law(&a)) {
        kmp_import_leave_out(im, e->place, KMP_PART_MECHANICS, e->name,
                             "%s '%s' is not used: its law is not affine, or has a state", e->name, given ? given : "");
        return;
    }
    kmp_mjcf_numbers(m, &item, "gear", 1, 6, gear);
    const char *moved = !t.form.joint ? "tendon" : t.form.joint[0],
               *name = given ? kmp_import_clean(im, given) : kmp_arena_printf(im->arena, "%s_%s", moved, e->name),
               *input = kmp_arena_printf(im->arena, "ctrl_%s", name);
    kmp_yaml *map = kmp_import_map(im, e->place);
    if (motor && !t.form.mixed)
        kmp_import_word(im, map, e->place, "unit", is_length(&t) ? "N" : "N*m");
    kmp_import_add(im, "inputs", e, input, map);
    add_force(m, e, name, &t, gear[0], law_of(m, &item, &a, &t, gear[0], input));
}

void kmp_mjcf_add_actuators(kmp_mjcf *m)
{
    for (const kmp_element *section = kmp_element_find(m->im->model, "actuator"); section && m->has_actuators;
         section = kmp_element_again(section))
        for (const kmp_element *e = section->first; e; e = e->next)
            if (kmp_import_is_word(actuators, e->name))
                add_actuator(m, e);
}
