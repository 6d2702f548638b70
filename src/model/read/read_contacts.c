/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts: each is a force of its name, and where it is rigid the row of a closure; its friction is a friction element
 * with a separate row. */
#include "model/read/read_contacts.h"
#include "model/data/angle_sum.h"
#include "model/data/cam.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/parallel_curve.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/read/outline_pairs.h"
#include "model/read/read_cams.h"
#include "model/read/read_closures.h"
#include "model/read/read_compliant.h"
#include "model/read/read_include.h"
#include "model/read/read_outlines.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

/* Sine of the angle between parallel axes, up to rounding. */
#define PARALLEL 1e-12
static const kmp_key contact_keys[] = {
#include "model/read/contact_keys.def"
    {0}};
static const kmp_key surface_keys[] = {
#include "model/read/surface_keys.def"
    {0}};

static const char *const firsts[] = {"joint", "gap", "point", "sphere", "cylinder", "outline", "flat"};
static const char *const seconds[] = {"plane", "sphere", "cylinder", "profile", "outline"};

/* A contact being read. */
typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_contact_pair *touch;
} reading;

/* -- limits ------------------------------------------------------------------------------------------------ */

/* A joint that is cut has its coordinate as a function of the others: the gap to its limit. */
static void read_stop_of_cut(const reading *c, const kmp_cut_coordinate *cut, const char *key, bool upper)
{
    const char *of = kmp_reader_say(c->r, "the %s limit of %s", key, c->what);
    const kmp_yaml *node = kmp_yaml_get(c->map, key);
    const kmp_dimension unit = cut->rotation ? KMP_DIM_NUMBER : KMP_DIM_LENGTH;
    kmp_expr *gap = KMP_ARENA_NEW(&c->r->model->arena, kmp_expr, 2);
    kmp_number limit = {0};
    if (!gap || !kmp_read_number(c->r, node, of, unit, &limit))
        return;
    if (cut->rotation && !(fabs(limit.value) < KMP_TURN / 2))
        kmp_reader_complain(c->r, node->place,
                            "%s: joint '%s' is cut, and its angle lies between -180 and 180 deg: let another joint of "
                            "its loop be cut, 'cut: yes'",
                            of, cut->joint);
    gap[0] = (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = limit.value, .unit = unit};
    const kmp_expr *end = limit.expr ? limit.expr : &gap[0];
    gap[1] = (kmp_expr){.kind = KMP_EXPR_SUB, .a = upper ? end : cut->value, .b = upper ? cut->value : end};
    c->touch->gap = &gap[1];
    c->touch->turns = cut->rotation;
}

static void read_stop(const reading *c)
{
    static const char *const ends[] = {"lower", "upper"};
    kmp_contact_pair *touch = c->touch;
    const kmp_yaml *joint = kmp_yaml_get(c->map, "joint");
    const bool named = joint && joint->kind == KMP_YAML_SCALAR;
    const int cut =
        named ? kmp_cut_coordinate_find(c->r->model, kmp_reader_name(c->r, joint->place.file, joint->text)) : -1;
    int motion = cut < 0 ? kmp_read_motion(c->r, joint, c->what) : -1;
    int end = kmp_read_one_key(c->r, c->map, c->what, KMP_NAMES_OF(ends));
    if (cut >= 0 && end >= 0)
        read_stop_of_cut(c, &c->r->model->cut_coordinates[cut], ends[end], end == 1);
    if (motion < 0 || end < 0)
        return;
    const char *of = kmp_reader_say(c->r, "the %s limit of %s", ends[end], c->what);
    touch->motion = motion;
    touch->upper = end == 1;
    touch->turns = c->r->model->motions[motion].rotation;
    (void)kmp_read_number(c->r, kmp_yaml_get(c->map, ends[end]), of, kmp_motion_dimension(c->r->model, motion, 0),
                          &touch->limit);
}

static void read_gap(const reading *c)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "gap");
    kmp_dimension found = KMP_DIM_ANY;
    const kmp_expr *gap = kmp_read_expr(c->r, node, c->what, KMP_DIM_ANY, KMP_OF_STATE);
    if (!gap || !kmp_check_dimension(c->r, node, c->what, gap, KMP_DIM_ANY, &found))
        return;
    c->touch->gap = gap;
    c->touch->turns = !kmp_dimension_fits(found, KMP_DIM_LENGTH);
    if (c->touch->turns && !kmp_dimension_fits(found, KMP_DIM_NUMBER))
        KMP_COMPLAIN(c, node, "the gap is a length or an angle");
    if (kmp_expr_find(gap, kmp_expr_is_rate, NULL))
        KMP_COMPLAIN(c, node, "the gap may depend on t, q(..) and positions, not on rates");
}

/* -- sides --------------------------------------------------------------------------------------------------- */

/* The key `axis`, or `normal`, which may have a sign: 3, 4 and 5 are opposite to x, y and z. */
static int read_letter(const reading *c, const kmp_yaml *map, bool normal)
{
    static const char *const letters[] = {"x", "y", "z", "-x", "-y", "-z"};
    const char *key = normal ? "normal" : "axis";
    int found = kmp_read_choice_of(c->r, map, key, c->what, KMP_NAMES(letters, normal ? 6 : 3),
                                   kmp_reader_say(c->r, "the %s is", key), 2);
    return found < 0 ? 2 : found;
}

static void read_radius(const reading *c, const kmp_yaml *map, int side)
{
    const kmp_yaml *node = kmp_read_required(c->r, map, c->what, "radius");
    if (node)
        (void)kmp_read_ruled(c->r, node, kmp_reader_say(c->r, "the radius of %s", c->what), KMP_DIM_LENGTH,
                             KMP_FIELD_POSITIVE, &c->touch->radius[side]);
}

/* Reports keys that belong to another kind of side than `key`. */
static void refuse_key(const reading *c, const kmp_yaml *map, const char *other, const char *key)
{
    const kmp_yaml *node = kmp_yaml_get(map, other);
    if (node)
        KMP_COMPLAIN(c, node, "the key '%s' does not belong to a '%s'", other, key);
}

/* The first side as a follower on a cam. */
static bool read_cam(const reading *c, const kmp_yaml *node)
{
    const kmp_touch_side *first = &c->touch->side[0];
    const kmp_outline *outline = kmp_read_outline_name(c->r, node, c->what);
    kmp_cam_follower *follower = KMP_ARENA_NEW(&c->r->model->arena, kmp_cam_follower, 1);
    if (!outline || !follower)
        return false;
    kmp_reader_fix(c->r, &c->touch->radius[0]);
    *follower = (kmp_cam_follower){.outline = outline,
                                   .form = first->shape == KMP_TOUCH_FACE  ? KMP_FOLLOWER_FLAT
                                           : c->touch->radius[0].value > 0 ? KMP_FOLLOWER_ROLLER
                                                                           : KMP_FOLLOWER_KNIFE,
                                   .radius = c->touch->radius[0].value,
                                   .leaves = true};
    c->touch->side[1].cam = follower;
    return !c->r->wrong && kmp_check_follower(c->r, c->map, c->what, follower);
}

static bool read_second(const reading *c, const kmp_yaml *map)
{
    kmp_touch_side *side = &c->touch->side[1];
    const char *what = kmp_reader_say(c->r, "the surface of %s", c->what);
    if (!kmp_read_map(c->r, map, what, surface_keys))
        return false;
    int kind = kmp_read_one_key(c->r, map, what, KMP_NAMES_OF(seconds));
    if (kind < 0)
        return false;
    const char *key = seconds[kind];
    const kmp_yaml *inside = kmp_yaml_get(map, "inside");
    side->shape = kind == 0    ? KMP_TOUCH_PLANE
                  : kind == 1  ? KMP_TOUCH_SPHERE
                  : kind == 2  ? KMP_TOUCH_CYLINDER
                  : kind == 3  ? KMP_TOUCH_PROFILE
                  : c->r->pair ? KMP_TOUCH_PIECE
                               : KMP_TOUCH_CAM;
    side->hollow = inside != NULL;
    const int letter = read_letter(c, map, kind == 0);
    side->axis = letter % 3;
    side->against = letter >= 3;
    const kmp_yaml *at = kind >= 3 ? kmp_read_required(c->r, map, c->what, "at") : kmp_yaml_get(map, key);
    side->point = at ? kmp_read_point(c->r, at, c->what) : -1;
    if (kind == 4) {
        side->axis = 2;
        if (!c->r->pair && !read_cam(c, kmp_yaml_get(map, "outline")))
            return false;
    } else if (kind == 3) {
        const kmp_yaml *node = kmp_yaml_get(map, "profile");
        side->table = kmp_read_table_name(c->r, node, c->what);
        if (side->table && side->table->table && side->table->table->method != KMP_TABLE_CUBIC)
            KMP_COMPLAIN(c, node,
                         "a profile is a table by 'spline'; at corners of '%s' a contact would have two normals",
                         side->table->name);
    }
    if (kind == 1 || kind == 2)
        read_radius(c, map, 1);
    for (int k = 0; k < 4; k++) {
        static const char *const others[] = {"normal", "radius", "inside", "at"};
        static const bool fits[5][4] = {
            {true}, {false, true, true}, {false, true, true}, {false, false, false, true}, {false, false, false, true}};
        if (!fits[kind][k])
            refuse_key(c, map, others[k], key);
    }
    if (kind != 2)
        refuse_key(c, map, "axis", key);
    return side->point >= 0;
}

/* -- what fits ------------------------------------------------------------------------------------------------- */

/* True if the axis of the first side is parallel to one of the second side's point with all coordinates zero. */
static bool is_parallel(const reading *c, int axis, double *factor)
{
    const kmp_touch_side *s = c->touch->side;
    double angle;
    for (int k = 1; k < 3; k++) {
        const kmp_measure_argument lean[3] = {{.point = s[0].point, .axis = s[0].axis},
                                              {.point = s[1].point, .axis = axis},
                                              {.point = s[1].point, .axis = (axis + k) % 3}};
        (void)kmp_angle_sum(c->r->model, lean, &angle, factor);
        if (fabs(sin(angle)) > PARALLEL)
            return false;
    }
    return true;
}

/* True if it stays parallel. */
static bool stays_parallel(const reading *c, int axis)
{
    const kempe_model *model = c->r->model;
    const kmp_touch_side *s = c->touch->side;
    double angle, *factor = KMP_ARENA_NEW(&c->r->scratch, double, model->motion_count);
    const kmp_measure_argument turn[3] = {{.point = s[1].point, .axis = (axis + 1) % 3},
                                          {.point = s[0].point, .axis = (s[0].axis + 1) % 3},
                                          {.point = s[1].point, .axis = axis}};
    return factor && is_parallel(c, axis, factor) &&
           (kmp_angle_sum(model, turn, &angle, factor) ||
            ((c->r->pair || s[1].shape == KMP_TOUCH_CAM) && kmp_moves_across(model, s[0].point, &turn[2])));
}

static void check_shapes(const reading *c)
{
    const kmp_contact_pair *touch = c->touch;
    const kmp_touch_side *s = touch->side;
    bool folds = false;
    if (c->r->model->points[s[0].point].body == c->r->model->points[s[1].point].body)
        KMP_COMPLAIN(c, c->map, "both sides are on the same body");
    if (s[0].shape == KMP_TOUCH_FACE && s[1].shape != KMP_TOUCH_CAM)
        KMP_COMPLAIN(c, c->map,
                     "a flat face touches an 'outline' that is a cam; on a sphere or a cylinder write the face as the "
                     "'plane' that it touches");
    if (s[0].shape == KMP_TOUCH_FACE && s[1].shape == KMP_TOUCH_CAM &&
        !kmp_stays_across(c->r->model, &(kmp_measure_argument){.point = s[0].point, .axis = s[0].axis},
                          &(kmp_measure_argument){.point = s[1].point, .axis = 2}))
        KMP_COMPLAIN(c, c->map, "the normal of the face does not stay in the plane of the cam, across its axis z");
    if (s[0].shape == KMP_TOUCH_CYLINDER && s[1].shape == KMP_TOUCH_SPHERE)
        KMP_COMPLAIN(c, c->map, "a cylinder on a sphere is written as 'sphere' on a 'cylinder'");
    else if (s[0].shape == KMP_TOUCH_CYLINDER && s[1].shape != KMP_TOUCH_PLANE &&
             !stays_parallel(c, s[1].shape == KMP_TOUCH_PROFILE ? 2 : s[1].axis))
        KMP_COMPLAIN(c, c->map, "the axis of the first cylinder does not stay parallel to the axis of the %s",
                     s[1].shape == KMP_TOUCH_PROFILE ? "profile, z"
                     : s[1].shape == KMP_TOUCH_CAM   ? "cam, z"
                                                     : "second one");
    if (s[1].hollow && touch->radius[1].value > 0 && touch->radius[0].value >= touch->radius[1].value)
        KMP_COMPLAIN(c, c->map, "radius %.6g m does not fit inside radius %.6g m", touch->radius[0].value,
                     touch->radius[1].value);
    if (s[1].shape != KMP_TOUCH_PROFILE || !s[1].table || !s[1].table->table)
        return;
    kmp_reader_fix(c->r, &touch->radius[0]);
    kmp_table *curve = kmp_parallel_curve(s[1].table->table, touch->radius[0].value, &folds);
    kmp_table_free(curve);
    if (folds)
        KMP_COMPLAIN(c, c->map,
                     "somewhere the profile is hollow with a smaller radius than %.6g m: it would touch at two places",
                     touch->radius[0].value);
}

bool kmp_read_touch(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_contact_pair *touch)
{
    const reading c = {r, map, what, touch};
    int kind = kmp_read_one_key(r, map, what, KMP_NAMES_OF(firsts));
    *touch = (kmp_contact_pair){.motion = -1, .side = {{.point = -1}, {.point = -1}}};
    if (kind < 0)
        return false;
    for (int k = 0; k < 2 && kind > 0; k++)
        refuse_key(&c, map, k ? "upper" : "lower", firsts[kind]);
    for (int k = 0; k < 3 && kind < 2; k++)
        refuse_key(&c, map, (const char *const[]){"on", "radius", "axis"}[k], firsts[kind]);
    if (kind < 6)
        refuse_key(&c, map, "normal", firsts[kind]);
    if (kind == 0)
        read_stop(&c);
    if (kind == 1)
        read_gap(&c);
    if (kind < 2)
        return touch->motion >= 0 || touch->gap;
    const kmp_yaml *on = kmp_read_required(r, map, what, "on");
    kmp_touch_side *side = &c.touch->side[0];
    bool rolls = kind == 4, outline = kind == 5, face = kind == 6;
    const kmp_yaml *at = outline ? kmp_read_required(r, map, what, "at") : kmp_yaml_get(c.map, firsts[kind]);
    if (!outline)
        refuse_key(&c, map, "at", firsts[kind]);
    side->shape = rolls ? KMP_TOUCH_CYLINDER : face ? KMP_TOUCH_FACE : KMP_TOUCH_SPHERE;
    side->point = at ? kmp_read_point(c.r, at, c.what) : -1;
    if (kind > 2 && !outline && !face)
        read_radius(&c, c.map, 0);
    else
        refuse_key(&c, c.map, "radius", firsts[kind]);
    if (rolls)
        side->axis = read_letter(&c, c.map, false);
    else
        refuse_key(&c, c.map, "axis", firsts[kind]);
    if (face) {
        const int letter = read_letter(&c, c.map, true);
        side->axis = letter % 3;
        side->against = letter >= 3;
    }
    bool good = side->point >= 0;
    good = on && read_second(&c, on) && good;
    if (good)
        check_shapes(&c);
    if (good && (outline || touch->side[1].shape == KMP_TOUCH_PIECE))
        return r->pair && kmp_outline_pair_put(r, map, what, r->pair, touch);
    return good;
}

/* -- the rigid law ------------------------------------------------------------------------------------------------ */

/* A joint with clearance and its contact have one name. */
static void check_name(kmp_reader *r, kmp_place place, const char *name, bool journal)
{
    if (kmp_index_find(&r->forces, &r->scratch, KMP_NAMED(r->model, force), -1, 0, name) >= 0)
        kmp_reader_complain(r, place, "a contact cannot have the name '%s' of a force", name);
    if (!journal && kmp_index_find(&r->closures, &r->scratch, KMP_NAMED(r->model, closure), -1, 0, name) >= 0)
        kmp_reader_complain(r, place,
                            "a contact cannot have the name '%s' of a loop or drive: lambda(%s) would be "
                            "ambiguous",
                            name, name);
}

static kmp_force *add_force(kmp_reader *r, const char *name, kmp_place place, kmp_force_kind kind)
{
    kmp_force *force = &r->model->forces[r->model->force_count++];
    *force = (kmp_force){.name = name, .kind = kind, .place = place, .motion = -1, .point = {-1, -1}};
    return force;
}

static bool read_restitution(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_number *number)
{
    const kmp_yaml *node = kmp_read_required(r, map, what, "restitution");
    const char *of = kmp_reader_say(r, "the restitution of %s", what);
    if (!node || !kmp_read_number(r, node, of, KMP_DIM_NUMBER, number))
        return false;
    return (number->value >= 0 && number->value <= 1) ||
           kmp_reader_complain(r, node->place, "%s is %.6g: it is from 0 to 1", of, number->value);
}

static bool is_of_joint(const kmp_yaml *map)
{
    return kmp_yaml_get(map, "journal") || kmp_yaml_get(map, "socket") || kmp_yaml_get(map, "guide");
}

/* Friction of a contact; across: as in kmp_force. */
static void add_friction(kmp_reader *r, kmp_place place, const char *name, kmp_number mu, const kmp_force *contact,
                         int across)
{
    if (!name) /* no memory */
        return;
    check_name(r, place, name, false);
    kmp_force *friction = add_force(r, name, place, KMP_FORCE_FRICTION);
    friction->level = mu;
    friction->contact = 1 + (int)(contact - r->model->forces);
    kmp_force *touch = &r->model->forces[friction->contact - 1];
    if (touch->rubbing == 0)
        touch->rubbing = 1 + (int)(friction - r->model->forces);
    friction->across = across;
    kmp_add_row(r, friction, KMP_CLOSURE_friction, friction->turns);
}

/* NAME_friction; of a pair of outlines NAME_friction.K. */
static const char *friction_name(kmp_reader *r, const char *contact)
{
    const char *dot = r->pair ? strrchr(contact, '.') : NULL;
    return dot ? kmp_arena_printf(&r->model->arena, "%.*s_friction%s", (int)(dot - contact), contact, dot)
               : kmp_arena_printf(&r->model->arena, "%s_friction", contact);
}

static void read_friction(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_force *contact)
{
    const kmp_yaml *node = kmp_yaml_get(map, "friction");
    const char *of = kmp_reader_say(r, "the friction of %s", what);
    kmp_number mu = {0};
    if (!node || !kmp_read_ruled(r, node, of, KMP_DIM_NUMBER, KMP_FIELD_NOT_NEGATIVE, &mu) ||
        (mu.value == 0 && !mu.expr))
        return;
    const kmp_contact_pair *touch = &contact->touch;
    bool along = touch->way || touch->slip;
    if (!along && touch->side[0].point < 0) {
        if (!is_of_joint(map))
            kmp_reader_complain(r, node->place, "%s: a stop has no surface to slide on", of);
        else
            (void)kmp_read_required(r, map, what, "radius");
        return;
    }
    if (along || kmp_touch_plane(r->model, touch) >= 0) {
        add_friction(r, node->place, friction_name(r, contact->name), mu, contact, 0);
        return;
    }
    for (int k = 1; k <= 2; k++)
        add_friction(r, node->place, kmp_arena_printf(&r->model->arena, "%s_friction%d", contact->name, k), mu, contact,
                     k);
}

/* Surfaces, a stop, or the parts of a joint with clearance. */
static bool read_geometry(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force)
{
    kmp_journal journal = {0};
    if (kmp_yaml_get(map, "guide"))
        return kmp_read_guide(r, map, what, force, &force->touch);
    if (!is_of_joint(map))
        return kmp_read_touch(r, map, what, &force->touch);
    if (!kmp_read_journal(r, map, what, force, &journal))
        return false;
    kmp_read_journal_gap(r, force, &journal, &force->touch);
    return force->touch.gap;
}

static void read_contact(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force)
{
    if (kmp_yaml_get(map, "law") || kmp_yaml_get(map, "force")) {
        force->kind = KMP_FORCE_COMPLIANT;
        if (kmp_read_map(r, map, what, contact_keys))
            kmp_read_compliant(r, map, what, force);
        return;
    }
    /* Keys of a contact with a law. */
    bool of_joint = is_of_joint(map);
    static const char *const keys[] = {"slip",       "stiffness", "exponent",  "damping", "young",  "poisson", "radii",
                                       "least_rate", "film",      "clearance", "length",  "corner", "height"};
    int first = -1, count = of_joint ? 9 : 13;
    if (kmp_count_keys(map, KMP_NAMES(keys, count), &first) > 0)
        kmp_complain_of(r, kmp_yaml_get(map, keys[first]), what,
                        "the key '%s' belongs to a contact with a 'law', or with a 'force'", keys[first]);
    if (!kmp_read_map(r, map, what, contact_keys) || !read_geometry(r, map, what, force) ||
        !read_restitution(r, map, what, &force->restitution))
        return;
    force->turns = force->touch.turns;
    kmp_add_row(r, force, KMP_CLOSURE_touch, force->turns);
    read_friction(r, map, what, force);
}

int kmp_contacts_count(const kmp_reader *r)
{
    const kmp_yaml *map = kmp_yaml_get(r->root, "contacts");
    int count = 0;
    for (int k = 0; map && k < map->count; k++) {
        const int pairs = kmp_outline_most_pairs(r, map->items[k]);
        count += 3 * (pairs > 0 ? pairs : 1);
    }
    return count;
}

/* A point, a disc or a face touches a cam or a whole circle as one surface, all else in pairs. */
static bool has_pairs(const kmp_reader *r, const kmp_yaml *map)
{
    const kmp_outline *outline[2];
    kmp_outline_contact_outlines(r, map, outline);
    return kmp_yaml_get(map, "outline") ||
           (kmp_yaml_get(kmp_yaml_get(map, "on"), "outline") && !(outline[1] && kmp_outline_is_smooth(outline[1])));
}

static bool check_pieces(kmp_reader *r, const kmp_section *s)
{
    const kmp_outline *outline[2];
    const kmp_yaml *face = kmp_yaml_get(s->node, "flat");
    kmp_outline_contact_outlines(r, s->node, outline);
    for (int k = 0; k < 2; k++)
        if (outline[k] && outline[k]->cam)
            return kmp_complain_of(r, s->node, s->what,
                                   "the outline '%s' is a cam, which points, spheres, cylinders and flat faces touch",
                                   outline[k]->name);
    return !face || kmp_complain_of(r, face, s->what,
                                    "a flat face touches an outline that is a cam; write the face as a 'segment' here");
}

/* Each pair of a circle and a piece is a separate contact: NAME.1, NAME.2, .. */
static void read_pairs(kmp_reader *r, const kmp_section *s)
{
    kmp_outline_pair *pairs;
    if (!check_pieces(r, s))
        return;
    if (kmp_contact_keeps_rate(s->node)) {
        kmp_complain_of(r, s->node, s->what,
                        "laws with 'impact' keep one rate, and an outline has many pieces: take another law");
        return;
    }
    const int count = kmp_outline_pairs(r, s->node, s->what, &pairs);
    const int first = r->model->force_count;
    for (int k = 0; k < count && !r->wrong && !r->model->arena.failed; k++) {
        const char *name = kmp_arena_printf(&r->model->arena, "%s.%d", s->name, k + 1);
        if (!name)
            break;
        for (kmp_outline_part *part = pairs[k].part; part; part = part->next)
            part->name = name;
        r->pair = &pairs[k];
        read_contact(r, s->node, s->what, add_force(r, name, s->key->place, KMP_FORCE_TOUCH));
    }
    r->pair = NULL;
    if (count <= 0 || r->wrong || r->model->arena.failed)
        return;
    const int step = (r->model->force_count - first) / count;
    const kmp_touch_side *side = r->model->forces[first].touch.side;
    const int turned = pairs[0].swapped ? 1 : 0;
    kmp_outline_contact *list = r->model->outline_contacts + r->model->outline_contact_count;
    list[0] = (kmp_outline_contact){.name = s->name, .point = {side[turned].point, side[1 - turned].point}};
    kmp_outline_contact_outlines(r, s->node, list[0].outline);
    for (int k = 0; k < step; k++) {
        list[k].first = first + k;
        list[k].count = count;
        list[k].step = step;
    }
    if (step > 1)
        list[1].name = kmp_arena_printf(&r->model->arena, "%s_friction", s->name);
    r->model->outline_contact_count += step;
}

void kmp_read_contacts(kmp_reader *r)
{
    kmp_section s = kmp_read_section(r, "contacts", "contact");
    r->model->outline_contacts = KMP_ARENA_NEW(&r->model->arena, kmp_outline_contact, 2 * s.count + 1);
    if (!r->model->outline_contacts)
        return;
    while (kmp_section_next(&s)) {
        bool law = kmp_yaml_get(s.node, "law") || kmp_yaml_get(s.node, "force");
        check_name(r, s.key->place, s.name, law && is_of_joint(s.node));
        if (has_pairs(r, s.node))
            read_pairs(r, &s);
        else
            read_contact(r, s.node, s.what, add_force(r, s.name, s.key->place, KMP_FORCE_TOUCH));
    }
}
