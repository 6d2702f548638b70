/* SPDX-License-Identifier: BSD-3-Clause */
/* Outlines that are cams, and ideal followers on them. */
#include "model/read/read_cams.h"
#include "constraints/tolerances.h"
#include "model/data/angle_sum.h"
#include "model/data/cam.h"
#include "model/data/model.h"
#include "model/read/read_include.h"
#include "model/read/read_outlines.h"
#include "model/read/read_values.h"
#include <math.h>

#define DEGREE (KMP_TURN / 360)

static const kmp_key part_keys[] = {
#include "model/keys/cam_part_keys.def"
    {0}};
static const kmp_key follower_keys[] = {
#include "model/keys/cam_follower_keys.def"
    {0}};
static const kmp_key place_keys[] = {
#include "model/keys/cam_place_keys.def"
    {0}};

static const char *const forms[] = {"roller", "knife", "flat"};

static kmp_cam *new_cam(const kmp_outline_reading *c)
{
    kmp_cam *cam = KMP_ARENA_NEW(&c->r->model->arena, kmp_cam, 1);
    if (cam)
        *cam = (kmp_cam){.outline = c->outline};
    c->outline->closed = true;
    c->outline->cam = cam;
    return cam;
}

/* -- tables and places ----------------------------------------------------------------------------------- */

bool kmp_read_cam_polar(kmp_outline_reading *c)
{
    const int found = kmp_read_reference(c->r, c->node, c->what, "table", KMP_NAMED(c->r->model, table));
    kmp_cam *cam = found < 0 ? NULL : new_cam(c);
    const kmp_named_table *table = found < 0 ? NULL : &c->r->model->tables[found];
    if (!cam || !table->table)
        return false;
    const kmp_table *t = table->table;
    const double range = t->x[t->count - 1] - t->x[0];
    if (t->method != KMP_TABLE_PERIODIC || table->rise != 0)
        return KMP_COMPLAIN(c, c->node,
                            "the table '%s' must be a spline with 'periodic: yes': the profile has the same radius and "
                            "slope at both ends",
                            c->node->text);
    if (fabs(range - KMP_TURN) > KMP_WRITTEN_DIGITS * KMP_TURN)
        return KMP_COMPLAIN(c, c->node, "the table '%s' covers %.9g deg: a cam has one turn, 360 deg", c->node->text,
                            range / DEGREE);
    for (int k = 0; k < t->count; k++)
        if (!(t->y[k] > 0))
            return KMP_COMPLAIN(c, c->node, "the radius is %.6g m at %.6g deg: it must be positive", t->y[k],
                                t->x[k] / DEGREE);
    cam->table = table->table;
    return true;
}

bool kmp_read_cam_points(kmp_outline_reading *c)
{
    kmp_reader *r = c->r;
    const char *of = kmp_reader_say(r, "%s: points", c->what);
    if (!kmp_read_list(r, c->node, of, -1))
        return false;
    const int count = c->node->count;
    if (count < 4)
        return KMP_COMPLAIN(c, c->node, "a closed spline needs four places or more, not %d", count);
    double *at = KMP_ARENA_NEW(&r->scratch, double, 3 * (count + 1)), area = 0;
    kmp_cam *cam = at ? new_cam(c) : NULL;
    if (!cam)
        return false;
    double *length = at, *place[2] = {at + count + 1, at + 2 * (count + 1)};
    for (int k = 0; k < count; k++)
        for (int i = 0; i < 2; i++)
            if (!kmp_read_list(r, c->node->items[k], of, 2) ||
                !kmp_read_fixed(r, c->node->items[k]->items[i], of, KMP_DIM_LENGTH, &place[i][k]))
                return false;
    length[0] = 0;
    for (int k = 1; k <= count; k++) {
        for (int i = 0; i < 2 && k == count; i++)
            place[i][k] = place[i][0];
        const double step = hypot(place[0][k] - place[0][k - 1], place[1][k] - place[1][k - 1]);
        if (!(step > 0))
            return KMP_COMPLAIN(c, c->node->items[k % count], "place %d is the same as place %d%s", k % count + 1, k,
                                k == count ? ": the spline closes itself" : "");
        length[k] = length[k - 1] + step;
        area += place[0][k - 1] * place[1][k] - place[0][k] * place[1][k - 1];
    }
    if (!(area > 0))
        return KMP_COMPLAIN(c, c->node, "the places go clockwise: write them counter-clockwise");
    for (int i = 0; i < 2; i++) {
        cam->place[i] = kmp_table_new(KMP_TABLE_PERIODIC, count + 1, length, place[i]);
        r->scratch.failed = r->scratch.failed || !cam->place[i];
    }
    return cam->place[0] && cam->place[1];
}

/* -- laws -------------------------------------------------------------------------------------------------- */

static bool read_part(kmp_reader *r, const kmp_yaml *map, const char *what, bool turns, kmp_cam_part *part)
{
    const char *of = kmp_reader_say(r, "%s: law", what);
    if (!kmp_read_map(r, map, of, part_keys))
        return false;
    const kmp_yaml *to = kmp_read_required(r, map, of, "to"), *rise = kmp_yaml_get(map, "rise");
    const kmp_yaml *by = rise ? kmp_read_required(r, map, of, "by") : kmp_yaml_get(map, "by");
    if (!to || (rise && !by) || !kmp_read_fixed(r, to, of, KMP_DIM_NUMBER, &part->to) ||
        (rise && !kmp_read_fixed(r, rise, of, turns ? KMP_DIM_NUMBER : KMP_DIM_LENGTH, &part->rise)))
        return false;
    if (!(part->to > part->from))
        return kmp_complain_of(r, to, what, "this part ends at %.6g deg, where it begins at %.6g deg",
                               part->to / DEGREE, part->from / DEGREE);
    if (!rise && by)
        return kmp_complain_of(r, by, what, "a part without 'rise' is a dwell, which has no law");
    const int law = by ? kmp_read_choice(r, by, what, KMP_NAMES_OF(kmp_cam_law_words), "by is") : 0;
    part->law = law < 0 ? KMP_CAM_LINEAR : (kmp_cam_law_kind)law;
    if (by && law == KMP_CAM_LINEAR)
        return kmp_complain_of(r, by, what,
                               "'linear' has corners at both ends, where the rate of the follower would jump: a cam "
                               "needs a smooth law, such as cycloidal");
    return law >= 0;
}

static bool read_parts(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_cam *cam)
{
    double sum = 0, most = 0;
    if (!kmp_read_list(r, node, kmp_reader_say(r, "%s: law", what), -1))
        return false;
    cam->parts = KMP_ARENA_NEW(&r->model->arena, kmp_cam_part, node->count + 1);
    for (int k = 0; cam->parts && k < node->count; k++) {
        kmp_cam_part *part = &cam->parts[cam->part_count++];
        *part = (kmp_cam_part){.from = k > 0 ? part[-1].to : 0};
        if (!read_part(r, node->items[k], what, cam->arm != 0, part))
            return false;
        sum += part->rise;
        most = fmax(most, fabs(part->rise));
    }
    if (!cam->parts)
        return false;
    const double end = cam->part_count > 0 ? cam->parts[cam->part_count - 1].to : 0;
    if (fabs(end - KMP_TURN) > KMP_WRITTEN_DIGITS * KMP_TURN)
        return kmp_complain_of(r, node, what, "the last part of the law ends at %.9g deg, not at 360 deg",
                               end / DEGREE);
    cam->parts[cam->part_count - 1].to = KMP_TURN;
    if (fabs(sum) > KMP_WRITTEN_DIGITS * most)
        return kmp_complain_of(r, node, what,
                               "the sum of the rises is %.6g %s: it must be zero, so that the profile is closed", sum,
                               cam->arm != 0 ? "rad" : "m");
    return true;
}

/* One of the keys roller, knife and flat. */
static bool read_form(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_follower_form *form, double *radius)
{
    const int key = kmp_read_one_key(r, map, what, KMP_NAMES_OF(forms));
    if (key < 0)
        return false;
    const kmp_yaml *node = kmp_yaml_get(map, forms[key]);
    *form = (kmp_follower_form)key;
    *radius = 0;
    if (key == KMP_FOLLOWER_ROLLER)
        return kmp_read_fixed_ruled(r, node, kmp_reader_say(r, "%s: roller", what), KMP_DIM_LENGTH, KMP_FIELD_POSITIVE,
                                    radius);
    return key != KMP_FOLLOWER_KNIFE || kmp_read_choice(r, node, what, kmp_yes, "knife is") == 0;
}

/* The keys offset, arm and distance. */
static bool read_line(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_cam *cam)
{
    static const char *const keys[] = {"offset", "arm", "distance"};
    double *const numbers[] = {&cam->offset, &cam->arm, &cam->pivot};
    int first = -1;
    const int given = kmp_count_keys(map, KMP_NAMES_OF(keys), &first);
    if (given > 0 && cam->form == KMP_FOLLOWER_FLAT)
        return kmp_complain_of(r, kmp_yaml_get(map, keys[first]), what,
                               "the key '%s' belongs to a roller or a knife: the profile under a flat face does not "
                               "depend on the place of its line",
                               keys[first]);
    for (int k = 0; k < 3; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, keys[k]);
        const char *of = kmp_reader_say(r, "%s: %s", what, keys[k]);
        if (node &&
            (!kmp_read_fixed(r, node, of, KMP_DIM_LENGTH, numbers[k]) ||
             (k > 0 && !kmp_check_rule(r, node, of, KMP_FIELD_POSITIVE, k == 1 ? fabs(cam->arm) : cam->pivot, ""))))
            return false;
    }
    if (kmp_yaml_get(map, "offset") && given > 1)
        return kmp_complain_of(r, map, what, "a follower with an 'arm' has no 'offset'");
    return !kmp_yaml_get(map, "arm") == !kmp_yaml_get(map, "distance") ||
           kmp_complain_of(r, map, what, "'arm' and 'distance' belong together");
}

/* Finds what the lift is counted from, by the radius of the path on the base circle. */
static bool find_base(kmp_reader *r, const kmp_yaml *node, const char *what, double radius, kmp_cam *cam)
{
    const double l = fabs(cam->arm), a = cam->pivot;
    cam->base = radius;
    if (cam->arm != 0) {
        if (!(radius > fabs(a - l) && radius < a + l))
            return kmp_complain_of(r, node, what,
                                   "a lever of %.6g m at the distance %.6g m does not reach the base circle: its "
                                   "roller is %.6g m from the centre there",
                                   l, a, radius);
        cam->base = acos((a * a + l * l - radius * radius) / (2 * a * l));
    } else {
        if (!(radius > fabs(cam->offset)))
            return kmp_complain_of(r, node, what, "the offset is %.6g m, the base circle reaches only %.6g m",
                                   cam->offset, radius);
        cam->base = sqrt(radius * radius - cam->offset * cam->offset);
    }
    const double least = cam->arm != 0 || cam->offset != 0 ? 0 : cam->radius;
    const double most = cam->arm != 0 ? KMP_TURN / 2 : INFINITY;
    for (int k = 0; k < cam->part_count; k++) {
        const double at = cam->base + kmp_cam_lift(cam, 0, cam->parts[k].from);
        if (!(at > least && at < most))
            return kmp_complain_of(r, node, what, "the lift at %.6g deg is %s the centre of the cam",
                                   cam->parts[k].from / DEGREE, at > least ? "beyond" : "below");
    }
    return true;
}

bool kmp_read_cam_law(kmp_outline_reading *c)
{
    kmp_reader *r = c->r;
    kmp_cam *cam = new_cam(c);
    const kmp_yaml *base = kmp_read_required(r, c->map, c->what, "base");
    const kmp_yaml *follower = kmp_read_required(r, c->map, c->what, "follower");
    const char *of = kmp_reader_say(r, "%s: base", c->what), *its = kmp_reader_say(r, "%s: follower", c->what);
    double radius;
    if (!cam || !base || !follower || !kmp_read_map(r, follower, its, follower_keys) ||
        !read_form(r, follower, its, &cam->form, &cam->radius) || !read_line(r, follower, its, cam) ||
        !read_parts(r, c->node, c->what, cam) ||
        !kmp_read_fixed_ruled(r, base, of, KMP_DIM_LENGTH, KMP_FIELD_POSITIVE, &radius) ||
        kmp_read_choice_of(r, follower, "flat", its, kmp_yes, "flat is", 0) < 0)
        return false;
    const kmp_cam_follower own = {.outline = c->outline, .form = cam->form, .radius = cam->radius};
    kmp_cam_check hollow;
    if (!find_base(r, c->node, c->what, radius + cam->radius, cam) || !kmp_check_follower(r, c->map, c->what, &own))
        return false;
    if (kmp_cam_is_hollow(cam, &hollow))
        kmp_reader_warn(
            r, c->map->place,
            "%s: the profile is hollow, with a least radius of %.4g m at the polar angle %.4g deg: a larger "
            "base makes it convex",
            c->what, -1 / hollow.curvature, hollow.angle / DEGREE);
    return true;
}

/* -- followers --------------------------------------------------------------------------------------------- */

bool kmp_check_follower(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_cam_follower *follower)
{
    const kmp_outline *outline = follower->outline;
    if (!kmp_outline_is_smooth(outline))
        return kmp_complain_of(r, map, what,
                               "the outline '%s' is not a cam: a cam is smooth, a 'circle', 'polar', 'points' or "
                               "'law'",
                               outline->name);
    if (!outline->cam) /* a circle */
        return true;
    const kmp_cam_check found = kmp_cam_find_fault(outline->cam, follower);
    const double angle = found.angle / DEGREE, radius = fabs(1 / found.curvature);
    switch (found.fault) {
    case KMP_CAM_HOLLOW:
        return kmp_complain_of(r, map, what,
                               "the profile of '%s' is hollow with radius %.6g m at the polar angle %.6g deg: a "
                               "roller of radius %.6g m touches it at two places",
                               outline->name, radius, angle, follower->radius);
    case KMP_CAM_UNDERCUT:
        return kmp_complain_of(r, map, what,
                               "the profile of '%s' has a cusp at the polar angle %.6g deg (undercut): take a "
                               "larger base, a longer part%s",
                               outline->name, angle,
                               follower->form == KMP_FOLLOWER_ROLLER ? " or a smaller roller" : "");
    case KMP_CAM_NOT_FLAT:
        return kmp_complain_of(r, map, what,
                               "the profile of '%s' is hollow at the polar angle %.6g deg, radius %.6g m: a "
                               "flat face touches it at two places",
                               outline->name, angle, radius);
    case KMP_CAM_NOT_ROUND:
        return kmp_complain_of(r, map, what,
                               "the profile of '%s' turns back about the origin at the polar angle %.6g deg",
                               outline->name, angle);
    case KMP_CAM_NOT_FOUND:
        return kmp_complain_of(
            r, map, what,
            "the place of contact on '%s' is not found at the polar angle %.6g deg: the search misses it by "
            "%.2g of the profile, %.0e is allowed; smooth the profile%s",
            outline->name, angle, found.off, KMP_CAM_FOUND,
            follower->form == KMP_FOLLOWER_ROLLER ? " or take a smaller roller" : "");
    case KMP_CAM_NO_MEMORY:
        r->scratch.failed = true;
        return false;
    case KMP_CAM_GOOD:
        break;
    }
    return true;
}

void kmp_read_follower(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure)
{
    const kmp_yaml *on = kmp_read_required(r, map, what, "on");
    kmp_cam_follower *follower = KMP_ARENA_NEW(&r->model->arena, kmp_cam_follower, 1);
    const char *of = kmp_reader_say(r, "%s: on", what);
    closure->point[1] = kmp_read_point(r, kmp_yaml_get(map, "follower"), what);
    if (!on || !follower || !kmp_read_map(r, on, of, place_keys))
        return;
    const kmp_yaml *outline = kmp_read_required(r, on, of, "outline"), *at = kmp_read_required(r, on, of, "at");
    closure->point[0] = at ? kmp_read_point(r, at, of) : -1;
    follower->outline = outline ? kmp_read_outline_name(r, outline, of) : NULL;
    if (!read_form(r, map, what, &follower->form, &follower->radius) || !follower->outline || closure->point[0] < 0 ||
        closure->point[1] < 0 || r->wrong)
        return;
    closure->cam = follower;
    if (follower->form == KMP_FOLLOWER_FLAT && !kmp_read_axis(r, kmp_yaml_get(map, "flat"), what, closure->axis[1]))
        return;
    if (r->model->points[closure->point[0]].body == r->model->points[closure->point[1]].body)
        kmp_complain_of(r, map, what, "follower and cam are on the same body");
    const kmp_measure_argument z = {.point = closure->point[0], .axis = 2};
    const kmp_measure_argument face = {.point = closure->point[1], .along = closure->axis[1]};
    if (follower->form == KMP_FOLLOWER_FLAT && !kmp_stays_across(r->model, &face, &z))
        kmp_complain_of(r, map, what,
                        "the normal of the face does not stay in the plane of the cam, across its axis z");
    (void)kmp_check_follower(r, map, what, follower);
}
