/* SPDX-License-Identifier: BSD-3-Clause */
/* Pairs of gear wheels. The joints on the path in the tree from one wheel to the other decide what each pair is: up to
 * the carrier they turn about the axis of the first wheel, and from there about the axis of the second one, or move
 * along a rack. So planets, a turning housing and a ring fixed to the ground need no further words. */
#include "model/read/read_gears.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "model/data/coordinates.h"
#include "model/data/gear.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/files/nodes.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

/* A distance of the axes that differs by more from the one by teeth and module, relatively, changes printed digits. */
#define SAME_DISTANCE 1e-6

static const kmp_key gear_keys[] = {
#include "model/keys/gear_keys.def"
    {0}};

/* A joint between the wheels: it is passed from its body up to the parent, or down. */
typedef struct passed {
    int motion;
    bool up;
    int beyond; /* the body behind it, as seen from the first wheel */
} passed;

/* A pair that is being read, in the axes of the ground with all coordinates zero. */
typedef struct pair {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_gear *gear;
    passed *path;
    int count, split; /* joints on the path; of the first wheel */
    kmp_pose_zero at;
    double a[2][3], centre[2][3]; /* of the wheels */
    double length;                /* the size of their places */
} pair;

/* -- the wheels ---------------------------------------------------------------------------------------- */

static bool read_wheel(const pair *p, const kmp_yaml *node, int which)
{
    const kempe_model *model = p->r->model;
    const char *text = kmp_read_word(p->r, node, p->what);
    if (text && strchr(text, '.')) {
        const int point = kmp_read_point(p->r, node, p->what);
        p->gear->centre[which] = point;
        p->gear->wheel[which] = point >= 0 ? model->points[point].body : -1;
        return point >= 0;
    }
    const int joint = text ? kmp_joint_find(model, kmp_reader_name(p->r, node->place.file, text)) : -1;
    if (joint >= 0) {
        const kmp_body *b = &model->bodies[joint];
        p->gear->wheel[which] = b->loads_parent ? b->parent : joint;
        p->gear->centre[which] = b->loads_parent ? b->at : b->to;
        return true;
    }
    p->gear->wheel[which] = text ? kmp_read_body(p->r, node, p->what) : -1;
    p->gear->centre[which] = -1;
    return p->gear->wheel[which] >= 0;
}

static bool read_wheels(const pair *p)
{
    const kmp_yaml *node = kmp_read_required(p->r, p->map, p->what, "between");
    if (!node || !kmp_read_list(p->r, node, kmp_reader_say(p->r, "%s: between", p->what), 2))
        return false;
    bool good = read_wheel(p, node->items[0], 0);
    good = read_wheel(p, node->items[1], 1) && good;
    if (good && p->gear->wheel[0] == p->gear->wheel[1])
        return KMP_COMPLAIN(p, p->map, "both wheels are the same body");
    return good;
}

static const char *wheel_name(const pair *p, int which)
{
    return p->r->model->bodies[p->gear->wheel[which]].name;
}

/* -- the path between them ----------------------------------------------------------------------------- */

static bool add_passed(pair *p, int body, bool up)
{
    const kmp_body *b = &p->r->model->bodies[body];
    if (b->flexible > 0)
        return KMP_COMPLAIN(p, p->map,
                            "the flexible body '%s' is between the wheels, so that their axes do not rest in one body",
                            b->name);
    if (b->motion_count - b->load_count > 1)
        return KMP_COMPLAIN(p, p->map,
                            "joint '%s' between the wheels has several coordinates; wheels turn by revolute joints, "
                            "and racks move by prismatic ones",
                            b->joint);
    if (b->load_count > 0)
        return KMP_COMPLAIN(p, p->map,
                            "friction is pressed by the reaction of joint '%s', which would be without the force of "
                            "the teeth: give that friction by torque or force in place of mu",
                            b->joint);
    if (b->motion_count == 1)
        p->path[p->count++] = (passed){b->first_motion, up, up ? b->parent : body};
    else if (p->count > 0 && up)
        p->path[p->count - 1].beyond = b->parent;
    return true;
}

/* The joints from the first wheel up to the common body, then down to the second one. */
static bool find_path(pair *p)
{
    const kempe_model *model = p->r->model;
    const int top = kmp_model_common_body(model, p->gear->wheel[0], p->gear->wheel[1]);
    int down = 0;
    for (int b = p->gear->wheel[0]; b != top; b = model->bodies[b].parent)
        if (!add_passed(p, b, true))
            return false;
    for (int b = p->gear->wheel[1]; b != top; b = model->bodies[b].parent)
        down++;
    for (int k = down - 1; k >= 0; k--) {
        int b = p->gear->wheel[1];
        for (int i = 0; i < k; i++)
            b = model->bodies[b].parent;
        if (!add_passed(p, b, false))
            return false;
    }
    if (p->count < 2)
        return KMP_COMPLAIN(
            p, p->map,
            "between '%s' and '%s' there is only one joint; both must move against the body that carries their axes",
            wheel_name(p, 0), wheel_name(p, 1));
    return true;
}

/* True if joints `from` to `to` have one axis: rotations about one line, or translations along one direction. */
static bool is_one_axis(const pair *p, int from, int to)
{
    const kmp_motion *motions = p->r->model->motions;
    const int first = p->path[from].motion;
    bool one = true;
    for (int k = from + 1; k < to; k++) {
        const int m = p->path[k].motion;
        double off[3], across[3];
        for (int i = 0; i < 3; i++)
            off[i] = p->at.places[m][i] - p->at.places[first][i];
        kmp_cross3(off, p->at.axes[first], across);
        one = one && motions[m].rotation == motions[first].rotation &&
              kmp_is_parallel(p->at.axes[m], p->at.axes[first]) &&
              (!motions[m].rotation || sqrt(kmp_dot(3, across, across)) <= KMP_SAME_AXIS * p->length);
    }
    return one;
}

static void put_term(const pair *p, int k, int side, kmp_term *term)
{
    const passed *at = &p->path[k];
    const double along = kmp_dot(3, p->at.axes[at->motion], p->at.axes[p->gear->axis[side]]);
    const bool towards = side == 0 ? at->up : !at->up; /* the wheel's side is the body of the joint */
    *term = (kmp_term){at->motion, {.value = (towards ? 1 : -1) * (along > 0 ? 1 : -1)}};
}

/* Carrier, axes, and the coordinates that move each wheel against the carrier. */
static bool find_axes(pair *p, kmp_closure *closure)
{
    kmp_gear *gear = p->gear;
    const kempe_model *model = p->r->model;
    for (int k = p->count - 1; k > 0; k--) /* the first place where the axis changes */
        p->split = is_one_axis(p, 0, k) && is_one_axis(p, k, p->count) ? k : p->split;
    if (p->split == 0)
        return KMP_COMPLAIN(p, p->map,
                            "no body carries both axes: joints from '%s' turn about one line up to a body, and on to "
                            "'%s' about another line; joint '%s' does not fit",
                            wheel_name(p, 0), wheel_name(p, 1),
                            model->bodies[model->motions[p->path[1].motion].body].joint);
    gear->carrier = p->path[p->split - 1].beyond;
    gear->axis[0] = p->path[0].motion;
    gear->axis[1] = p->path[p->count - 1].motion;
    gear->first_count = p->split;
    if (!model->motions[gear->axis[0]].rotation)
        return KMP_COMPLAIN(p, p->map, "the first wheel of 'between' turns; a rack is the second one");
    gear->form = model->motions[gear->axis[1]].rotation ? KMP_GEAR_PARALLEL : KMP_GEAR_RACK;
    closure->terms = KMP_ARENA_NEW(&p->r->model->arena, kmp_term, p->count);
    for (int k = 0; closure->terms && k < p->count; k++)
        put_term(p, k, k >= p->split, &closure->terms[k]);
    closure->term_count = closure->terms ? p->count : 0;
    for (int side = 0; side < 2; side++) {
        kmp_pose at = p->at.poses[gear->wheel[side]];
        if (gear->centre[side] >= 0)
            kmp_pose_of_point(model, p->at.poses, p->at.q, gear->centre[side], &at);
        memcpy(p->centre[side], at.p, sizeof at.p);
        memcpy(p->a[side], p->at.axes[gear->axis[side]], sizeof p->a[side]);
    }
    return true;
}

/* The body that carries all that is welded to a body. */
static int first_welded(const kempe_model *model, int body)
{
    while (body > 0 && model->bodies[body].motion_count == 0)
        body = model->bodies[body].parent;
    return body;
}

static bool check_carrier(const pair *p)
{
    const kmp_yaml *node = kmp_yaml_get(p->map, "carrier");
    const int body = node ? kmp_read_body(p->r, node, p->what) : p->gear->carrier;
    const kempe_model *model = p->r->model;
    if (body < 0 || first_welded(model, body) == first_welded(model, p->gear->carrier))
        return body >= 0;
    return KMP_COMPLAIN(p, node, "the axes of both wheels rest in '%s', not in '%s'",
                        model->bodies[p->gear->carrier].name, model->bodies[body].name);
}

/* -- numbers ------------------------------------------------------------------------------------------- */

static bool read_own_number(const pair *p, const kmp_yaml *node, int number)
{
    const char *key = kmp_gear_number_keys[number], *name = kmp_reader_say(p->r, "%s: %s", p->what, key);
    kmp_number *own = &p->gear->number[number];
    if (!kmp_read_ruled(p->r, node, name, kmp_key_dimension(gear_keys, key),
                        number == KMP_GEAR_HELIX ? KMP_FIELD_NOT_NEGATIVE : KMP_FIELD_POSITIVE, own))
        return false;
    if (number > KMP_GEAR_MODULE && own->value >= 2 * atan(1))
        return kmp_reader_complain(p->r, node->place, "%s is %.6g deg: it must be less than 90 deg", name,
                                   own->value * 45 / atan(1));
    return true;
}

/* Teeth, starts or radii: one number for one wheel, a list of two for two. */
static bool read_of_wheels(const pair *p, const char *key, int first, int count)
{
    const kmp_yaml *node = kmp_yaml_get(p->map, key);
    const char *name = kmp_reader_say(p->r, "%s: %s", p->what, key);
    bool good = count == 1 || kmp_read_list(p->r, node, name, 2);
    for (int k = 0; k < count && good; k++) {
        const kmp_yaml *own = count == 1 ? node : node->items[k];
        good = strcmp(key, "radius") == 0
                   ? read_own_number(p, own, KMP_GEAR_RADIUS_1 + first + k)
                   : kmp_read_whole(p->r, own, name, "is", 1, INFINITY, &p->gear->teeth[first + k]);
    }
    return good;
}

/* Teeth or radii of all wheels. */
static bool read_sizes(const pair *p)
{
    const bool teeth = kmp_yaml_get(p->map, "teeth"), radius = kmp_yaml_get(p->map, "radius");
    const bool worm = p->gear->form == KMP_GEAR_WORM, rack = p->gear->form == KMP_GEAR_RACK;
    if (worm && radius)
        return KMP_COMPLAIN(
            p, p->map, "a worm and its wheel are given by starts, teeth, and module or lead_angle, without radius");
    if (teeth == radius)
        return KMP_COMPLAIN(p, p->map, "exactly one of the keys teeth, radius is expected");
    if (teeth && rack && !kmp_yaml_get(p->map, "module"))
        return KMP_COMPLAIN(p, p->map, "the wheel of a rack is given by radius, or by teeth and module");
    return (!worm || read_of_wheels(p, "starts", 0, 1)) &&
           read_of_wheels(p, teeth ? "teeth" : "radius", worm, worm || rack ? 1 : 2);
}

static const char *const form_words[] = {"wheels with parallel axes", "bevel gears", "a worm", "a rack"};

/* Keys that a form does not have. */
static bool check_keys(const pair *p)
{
    static const struct {
        const char *key;
        unsigned forms; /* that have it */
    } row[] = {{"internal", 1u << KMP_GEAR_PARALLEL},
               {"helix", 1u << KMP_GEAR_PARALLEL | 1u << KMP_GEAR_RACK},
               {"hand", 1u << KMP_GEAR_PARALLEL | 1u << KMP_GEAR_RACK | 1u << KMP_GEAR_WORM},
               {"starts", 1u << KMP_GEAR_WORM},
               {"lead_angle", 1u << KMP_GEAR_WORM}};
    bool good = true;
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        const kmp_yaml *node = kmp_yaml_get(p->map, row[k].key);
        if (node && !(row[k].forms >> p->gear->form & 1))
            good = KMP_COMPLAIN(p, node, "%s have no %s", form_words[p->gear->form], row[k].key);
    }
    return good;
}

static bool read_numbers(const pair *p)
{
    static const char *const hands[] = {"right", "left"};
    bool good = check_keys(p) && read_sizes(p);
    (void)kmp_key_default(gear_keys, "pressure_angle", 1, &p->gear->number[KMP_GEAR_PRESSURE].value);
    for (int k = KMP_GEAR_MODULE; k < KMP_GEAR_NUMBERS; k++) {
        const kmp_yaml *node = kmp_yaml_get(p->map, kmp_gear_number_keys[k]);
        good = (!node || read_own_number(p, node, k)) && good;
    }
    const int chosen = kmp_read_choice_of(p->r, p->map, "hand", p->what, KMP_NAMES_OF(hands), "hand is", 0);
    p->gear->left = chosen == 1;
    return good && chosen >= 0;
}

/* The values of both efficiencies, for checks and reports: at most 1; where the first wheel drives some power arrives.
 */
static bool read_efficiency(const pair *p)
{
    const kmp_yaml *node = kmp_yaml_get(p->map, "efficiency"), *friction = kmp_yaml_get(p->map, "friction");
    double *efficiency = p->gear->efficiency;
    efficiency[0] = efficiency[1] = 1;
    if (friction) {
        const char *name = kmp_reader_say(p->r, "%s: friction", p->what);
        kmp_number mu = {0};
        if (p->gear->form != KMP_GEAR_WORM || node || !kmp_gear_has(p->gear, KMP_GEAR_LEAD))
            return kmp_reader_complain(p->r, friction->place,
                                       "%s is for a worm with lead_angle and without efficiency; other gears have "
                                       "efficiency",
                                       name);
        if (!kmp_read_ruled(p->r, friction, name, KMP_DIM_NUMBER, KMP_FIELD_POSITIVE, &mu))
            return false;
        const double t = tan(p->gear->number[KMP_GEAR_LEAD].value), c = cos(p->gear->number[KMP_GEAR_PRESSURE].value);
        efficiency[0] = (c - mu.value * t) / (c + mu.value / t);
        efficiency[1] = (c - mu.value / t) / (c + mu.value * t);
        return true;
    }
    for (int k = 0; node && k < 2; k++) {
        const bool two = node->kind == KMP_YAML_LIST;
        const char *name = kmp_reader_say(p->r, "%s: efficiency", p->what);
        kmp_number value = {0};
        if (two && !kmp_read_list(p->r, node, name, 2))
            return false;
        if (!kmp_read_number(p->r, two ? node->items[k] : node, name, KMP_DIM_NUMBER, &value))
            return false;
        efficiency[k] = value.value;
        if (value.value > 1 || (k == 0 && value.value <= 0))
            return kmp_reader_complain(p->r, node->place, "%s is %.6g: it is at most 1%s", name, value.value,
                                       k == 0 ? " and positive where the first wheel drives" : "");
    }
    return true;
}

/* Stiffness and backlash, whose contacts have been written (kmp_read_gear_losses); the keys that belong to each other.
 */
static bool read_play(const pair *p)
{
    const kmp_yaml *stiffness = kmp_yaml_get(p->map, "stiffness"), *backlash = kmp_yaml_get(p->map, "backlash");
    const kmp_yaml *damping = kmp_yaml_get(p->map, "damping"), *restitution = kmp_yaml_get(p->map, "restitution");
    const kmp_yaml *loss = kmp_yaml_get(p->map, "efficiency"), *friction = kmp_yaml_get(p->map, "friction");
    p->gear->rigid = !stiffness && !backlash;
    if (!p->gear->rigid && (loss || friction))
        return KMP_COMPLAIN(p, (loss ? loss : friction),
                            "losses are for teeth that are always in contact, without stiffness and backlash");
    if (damping && !stiffness)
        return KMP_COMPLAIN(p, damping, "damping belongs to stiffness");
    if (restitution && (stiffness || !backlash))
        return KMP_COMPLAIN(p, restitution, "restitution belongs to backlash of rigid teeth, without stiffness");
    return true;
}

/* -- the forms ----------------------------------------------------------------------------------------- */

static double size_of(const pair *p, int which)
{
    return p->gear->teeth[which] > 0 ? p->gear->teeth[which] : p->gear->number[KMP_GEAR_RADIUS_1 + which].value;
}

/* From the first centre to the second one, without the part along the first axis, and along the second one, too. */
static double distance_across(const pair *p, bool both, double across[3])
{
    for (int i = 0; i < 3; i++)
        across[i] = p->centre[1][i] - p->centre[0][i];
    const double along[2] = {kmp_dot(3, across, p->a[0]), both ? kmp_dot(3, across, p->a[1]) : 0};
    for (int i = 0; i < 3; i++)
        across[i] = across[i] - along[0] * p->a[0][i] - along[1] * p->a[1][i];
    return sqrt(kmp_dot(3, across, across));
}

static bool finish_parallel(const pair *p)
{
    kmp_gear *gear = p->gear;
    double c[3];
    const double distance = distance_across(p, false, c);
    const bool same = kmp_dot(3, p->a[0], p->a[1]) > 0;
    gear->internal = kmp_yaml_get(p->map, "internal");
    gear->ring = !gear->internal ? -1 : size_of(p, 1) > size_of(p, 0);
    gear->sense = same == gear->internal ? 1 : -1;
    if (gear->internal && size_of(p, 0) == size_of(p, 1))
        return KMP_COMPLAIN(p, p->map, "the ring of an internal pair is larger than the wheel in it");
    if (distance <= KMP_SAME_AXIS * p->length)
        return KMP_COMPLAIN(p, p->map, "both wheels turn about the same axis");
    if (!kmp_gear_has(gear, KMP_GEAR_MODULE))
        return true;
    const double sum = gear->internal ? fabs(size_of(p, 1) - size_of(p, 0)) : size_of(p, 0) + size_of(p, 1);
    const double wanted = gear->number[KMP_GEAR_MODULE].value * sum / (2 * cos(gear->number[KMP_GEAR_HELIX].value));
    if (gear->teeth[0] == 0)
        return KMP_COMPLAIN(p, p->map, "module belongs to teeth; with radius it has no meaning");
    if (fabs(distance - wanted) > SAME_DISTANCE * distance)
        kmp_log(p->r->context, KEMPE_LOG_WARNING,
                "%s: teeth and module give axes %.9g mm apart, and they are %.9g mm apart: the pressure angle belongs "
                "to that distance",
                p->what, 1e3 * wanted, 1e3 * distance);
    return true;
}

static bool finish_rack(const pair *p)
{
    kmp_gear *gear = p->gear;
    double c[3], moved[3];
    const double distance = distance_across(p, true, c);
    if (fabs(kmp_dot(3, p->a[0], p->a[1])) > KMP_SAME_AXIS)
        return KMP_COMPLAIN(p, p->map, "the rack does not move across the axis of the wheel");
    if (distance <= KMP_SAME_AXIS * p->length)
        return KMP_COMPLAIN(
            p, p->map,
            "the rack's point is as high as the axis of the wheel: choose a point of the rack on the side "
            "of its teeth, such as on its pitch line");
    kmp_cross3(p->a[0], c, moved);
    gear->sense = kmp_dot(3, moved, p->a[1]) > 0 ? 1 : -1;
    return true;
}

/* Of two lines that are not parallel: from the first centre to the nearest point of its axis, and their distance. */
static double lines_apart(const pair *p, double along[2])
{
    double n[3], d[3];
    const double c = kmp_dot(3, p->a[0], p->a[1]);
    kmp_cross3(p->a[0], p->a[1], n);
    for (int i = 0; i < 3; i++)
        d[i] = p->centre[1][i] - p->centre[0][i];
    const double d0 = kmp_dot(3, d, p->a[0]), d1 = kmp_dot(3, d, p->a[1]), square = kmp_dot(3, n, n);
    along[0] = (d0 - c * d1) / square;
    along[1] = (c * d0 - d1) / square;
    return fabs(kmp_dot(3, d, n)) / sqrt(square);
}

static bool finish_bevel(const pair *p)
{
    kmp_gear *gear = p->gear;
    double along[2];
    (void)lines_apart(p, along);
    for (int k = 0; k < 2; k++) {
        if (fabs(along[k]) <= KMP_SAME_AXIS * p->length)
            return KMP_COMPLAIN(p, p->map,
                                "the axes of bevel gears meet at the point of '%s': give a point in the middle of its "
                                "teeth, as BODY.POINT",
                                wheel_name(p, k));
        gear->outwards[k] = along[k] > 0 ? -1 : 1;
    }
    gear->sense = -gear->outwards[0] * gear->outwards[1];
    const double cosine = -gear->sense * kmp_dot(3, p->a[0], p->a[1]);
    for (int k = 0; k < 2; k++)
        if (size_of(p, !k) + size_of(p, k) * cosine <= KMP_SAME_AXIS * size_of(p, k))
            return KMP_COMPLAIN(p, p->map,
                                "the pitch cone of '%s' would open by 90 deg or more: the axes are at %.6g deg; give "
                                "points where they are nearer, or other teeth",
                                wheel_name(p, k), acos(cosine) * 45 / atan(1));
    return true;
}

static bool finish_worm(const pair *p)
{
    kmp_gear *gear = p->gear;
    const bool module = kmp_gear_has(gear, KMP_GEAR_MODULE), lead = kmp_gear_has(gear, KMP_GEAR_LEAD);
    double c[3], n[3];
    const double distance = distance_across(p, true, c);
    if (fabs(kmp_dot(3, p->a[0], p->a[1])) > KMP_SAME_AXIS)
        return KMP_COMPLAIN(p, p->map, "the axes of a worm and its wheel cross at a right angle");
    if (module == lead)
        return KMP_COMPLAIN(p, p->map, "exactly one of the keys module, lead_angle is expected for a worm");
    if (module && gear->number[KMP_GEAR_MODULE].value * gear->teeth[1] / 2 >= distance)
        return KMP_COMPLAIN(
            p, p->map, "the pitch radius of the wheel, %.6g mm, is not less than the distance of the axes, %.6g mm",
            500 * gear->number[KMP_GEAR_MODULE].value * gear->teeth[1], 1e3 * distance);
    kmp_cross3(p->a[0], p->a[1], n);
    gear->sense = (kmp_dot(3, n, c) > 0) != gear->left ? 1 : -1;
    return true;
}

/* The axes decide the form: parallel, meeting or crossing. */
static bool find_form(const pair *p)
{
    const kmp_yaml *starts = kmp_yaml_get(p->map, "starts");
    double along[2];
    if (p->gear->form == KMP_GEAR_RACK || kmp_is_parallel(p->a[0], p->a[1]))
        return true;
    const double apart = lines_apart(p, along);
    p->gear->form = apart <= KMP_SAME_AXIS * p->length ? KMP_GEAR_BEVEL : KMP_GEAR_WORM;
    if (p->gear->form == KMP_GEAR_WORM && !starts)
        return KMP_COMPLAIN(p, p->map,
                            "the axes of '%s' and '%s' pass each other at %.6g mm: bevel gears have axes that meet, "
                            "and a worm has the key starts",
                            wheel_name(p, 0), wheel_name(p, 1), 1e3 * apart);
    return true;
}

static bool (*const finish[])(const pair *p) = {[KMP_GEAR_PARALLEL] = finish_parallel,
                                                [KMP_GEAR_BEVEL] = finish_bevel,
                                                [KMP_GEAR_WORM] = finish_worm,
                                                [KMP_GEAR_RACK] = finish_rack};

/* -- the whole ----------------------------------------------------------------------------------------- */

/* Places and axes with all coordinates zero. False: no memory. */
static bool find_poses(pair *p)
{
    const kempe_model *model = p->r->model;
    p->path = KMP_ARENA_NEW(&p->r->scratch, passed, model->body_count);
    if (!p->path || !kmp_pose_at_zero(model, &p->r->scratch, &p->at))
        return false;
    for (int b = 0; b < model->body_count; b++)
        p->length = fmax(p->length, sqrt(kmp_dot(3, p->at.poses[b].p, p->at.poses[b].p)));
    for (int k = 0; k < model->point_count; k++) {
        const kmp_number *at = model->points[k].at;
        p->length = fmax(p->length, hypot(hypot(at[0].value, at[1].value), at[2].value));
    }
    return true;
}

void kmp_read_gear(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    pair p = {.r = r, .map = map, .what = what};
    if (!kmp_read_map(r, map, what, gear_keys))
        return;
    p.gear = KMP_ARENA_NEW(&r->model->arena, kmp_gear, 1);
    if (!p.gear || !read_wheels(&p) || r->wrong || !find_poses(&p))
        return;
    p.gear->ring = -1;
    if (find_path(&p) && find_axes(&p, closure) && check_carrier(&p) && find_form(&p) && read_numbers(&p) &&
        read_efficiency(&p) && read_play(&p) && finish[p.gear->form](&p))
        closure->gear = p.gear;
}

/* -- losses and play ----------------------------------------------------------------------------------- */

/* Losses become friction, and stiffness and backlash become contacts of both flanks, before the model is read. Friction
 * acts along the path of the first pitch point, with a level for each direction. The first wheel has the force
 * lambda/e1 where it drives with the efficiency e1. It has e2 lambda where the second wheel drives with e2. So
 * self-locking pairs, whose e2 is not positive, have finite levels. */

/* The words for both efficiencies: one text, a list of two, or from the friction of a worm's thread with the lead
 * angle g and the pressure angle a: (cos a - mu tan g)/(cos a + mu/tan g) forwards, (cos a - mu/tan g)/(cos a + mu tan
 * g) backwards. NULL: there is no loss. */
static bool efficiency_words(kmp_reader *r, const kmp_yaml *gear, const char *words[2])
{
    const kmp_yaml *node = kmp_yaml_get(gear, "efficiency"), *friction = kmp_yaml_get(gear, "friction");
    const kmp_yaml *lead = kmp_yaml_get(gear, "lead_angle"), *angle = kmp_yaml_get(gear, "pressure_angle");
    const bool two = node && node->kind == KMP_YAML_LIST && node->count == 2;
    if (friction && lead && !node) {
        const char *a = angle && angle->text ? angle->text : "20 deg", *g = lead->text, *mu = friction->text;
        words[0] = kmp_reader_say(r, "((cos(%s) - (%s)*tan(%s))/(cos(%s) + (%s)/tan(%s)))", a, mu, g, a, mu, g);
        words[1] = kmp_reader_say(r, "((cos(%s) - (%s)/tan(%s))/(cos(%s) + (%s)*tan(%s)))", a, mu, g, a, mu, g);
        return mu && g;
    }
    for (int k = 0; k < 2; k++)
        words[k] = two ? node->items[k]->text : node && node->kind == KMP_YAML_SCALAR ? node->text : NULL;
    return words[0] && words[1];
}

static void add_loss(const kmp_entry_owner *own, const kmp_yaml *gear, const char *const words[2])
{
    kmp_reader *r = own->r;
    const char *name = kmp_reader_own_name(r, own->key->place.file, own->key->text), *levels[2];
    for (int k = 0; k < 2; k++) /* against positive rates, and against negative ones */
        levels[k] = kmp_reader_say(r, "if(lambda(%s) %c 0, 1/(%s) - 1, 1 - (%s))*abs(lambda(%s))", name, "><"[k],
                                   words[0], words[1], name);
    kmp_add_own_entry(own, "losses", "forces", kmp_reader_say(r, "%s_loss", own->key->text), gear->place,
                      kmp_yaml_friction(&r->scratch, gear->place, kmp_reader_say(r, "path(%s)", name), levels));
}

/* An entry of a flank: the gap is half of the backlash less the transmission error, or more it. */
static void add_flank(const kmp_entry_owner *own, const kmp_yaml *gear, const char *flank, char sign)
{
    static const char *const keys[] = {"stiffness", "damping", "restitution"};
    kmp_reader *r = own->r;
    const char *name = kmp_reader_own_name(r, own->key->place.file, own->key->text);
    const kmp_yaml *backlash = kmp_yaml_get(gear, "backlash"), *stiffness = kmp_yaml_get(gear, "stiffness");
    kmp_arena *arena = &r->scratch;
    kmp_yaml *entry = kmp_yaml_new(arena, KMP_YAML_MAP, gear->place);
    const char *gap = backlash && backlash->text
                          ? kmp_reader_say(r, "(%s)/2 %c transmission_error(%s)", backlash->text, sign, name)
                          : kmp_reader_say(r, "0 m %c transmission_error(%s)", sign, name);
    kmp_yaml_put_word(arena, entry, gear->place, "gap", gap);
    kmp_yaml_put_word(arena, entry, gear->place, "law", stiffness ? "kelvin_voigt" : NULL);
    for (int k = 0; k < 3; k++) {
        const kmp_yaml *given = kmp_yaml_get(gear, keys[k]);
        kmp_yaml_put(arena, entry, gear->place, keys[k], given);
        if (!given && k == (stiffness ? 1 : 2))
            kmp_yaml_put_word(arena, entry, gear->place, keys[k], "0");
    }
    kmp_add_own_entry(own, "flank", "contacts", kmp_reader_say(r, "%s_%s", own->key->text, flank), gear->place, entry);
}

void kmp_read_gear_losses(kmp_reader *r)
{
    const kmp_yaml *gears = kmp_yaml_get(r->root, "gears");
    const char *words[2];
    kmp_yaml *root = NULL;
    for (int k = 0; gears && gears->kind == KMP_YAML_MAP && k < gears->count; k++) {
        const kmp_yaml *gear = gears->items[k];
        const bool loses = gear && efficiency_words(r, gear, words),
                   plays = gear && (kmp_yaml_get(gear, "stiffness") || kmp_yaml_get(gear, "backlash"));
        if (!root && (loses || plays))
            root = kmp_yaml_copy(&r->scratch, r->root);
        const kmp_entry_owner own = {r, "gear", gears->keys[k], root};
        if (root && loses)
            add_loss(&own, gear, words);
        if (root && plays) {
            add_flank(&own, gear, "front", '-');
            add_flank(&own, gear, "back", '+');
        }
    }
    r->root = root ? root : r->root;
}
