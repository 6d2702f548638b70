/* SPDX-License-Identifier: BSD-3-Clause */
/* Circles are points, spheres, cylinders and the corners of an outline, which lie within its solid: they meet all
 * pieces of the other side. Two outlines touch at a corner of one of them, or where an arc curves into the other's
 * solid. */
#include "model/read/outline_pairs.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "model/data/angle_sum.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/read/read_include.h"
#include "model/read/read_outlines.h"
#include "model/read/read_ropes.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

/* Pairs of one contact. */
enum { MOST_PAIRS = 400 };

/* -- outlines of a contact ----------------------------------------------------------------------------- */

void kmp_outline_contact_outlines(const kmp_reader *r, const kmp_yaml *map, const kmp_outline *outline[2])
{
    const kmp_yaml *const nodes[] = {kmp_yaml_get(map, "outline"), kmp_yaml_get(kmp_yaml_get(map, "on"), "outline")};
    for (int k = 0; k < 2; k++) {
        const bool named = nodes[k] && nodes[k]->kind == KMP_YAML_SCALAR;
        const char *name = named ? kmp_reader_name((kmp_reader *)r, nodes[k]->place.file, nodes[k]->text) : "";
        const int found = named ? kmp_name_find(KMP_NAMED(r->model, outline), name) : -1;
        outline[k] = found < 0 ? NULL : &r->model->outlines[found];
    }
}

/* A circle of an outline: a corner, or all of it. */
static bool is_circle(const kmp_piece *piece)
{
    return piece->arc && (piece->corner > 0 || fabs(piece->turn) >= KMP_TURN) && piece->turn > 0;
}

static int circles_of(const kmp_outline *outline)
{
    int count = 0;
    for (int k = 0; outline && k < outline->piece_count; k++)
        count += is_circle(&outline->pieces[k]);
    return outline ? count * outline->copies : 1;
}

static int parts_of(const kmp_outline *outline)
{
    return outline->piece_count * (outline->copies > 1 ? 2 : 1);
}

/* Contacts of a circle with each run: neighbours at a sharp corner, which both touch a point there, are in different
 * ones. */
enum { TURNS = 3 };

/* A bound on the contacts of a circle: with each run; with a law, whose numbers may depend on the radius, with each
 * piece. */
static int contacts_of(const kmp_outline *outline, bool law)
{
    if (!outline)
        return 1;
    const int pieces = parts_of(outline), runs = TURNS * outline->run_count * (outline->copies > 1 ? 2 : 1);
    return law || pieces < runs ? pieces : runs;
}

static bool has_law(const kmp_yaml *map)
{
    return kmp_yaml_get(map, "law") || kmp_yaml_get(map, "force");
}

int kmp_outline_most_pairs(const kmp_reader *r, const kmp_yaml *map)
{
    const bool law = has_law(map);
    const kmp_outline *of[2];
    kmp_outline_contact_outlines(r, map, of);
    if (!of[0] && !of[1])
        return 0;
    const int count = circles_of(of[0]) * contacts_of(of[1], law);
    return of[0] && of[1] ? count + circles_of(of[1]) * contacts_of(of[0], law) : count;
}

/* -- pairs --------------------------------------------------------------------------------------------- */

/* The pairs being made. */
typedef struct making {
    kmp_reader *r;
    const char *what;
    const kmp_yaml *map;
    bool law;
    kmp_outline_pair *pairs;
    int count;
} making;

/* A sharp corner of the other outline meets a line that ends in sharp corners. */
static void meet_corner(kmp_outline_part *part, const kmp_piece *corner)
{
    part->meets_corner = !part->piece.arc && (part->tip[0] != 0 || part->tip[1] != 0);
    for (int k = 0; k < 2; k++) {
        kmp_piece_tangent(corner, k, part->edge[k]);
        for (int i = 0; i < 2 && k == 0; i++)
            part->edge[k][i] = -part->edge[k][i];
    }
}

/* A pair of the circle with each run of pieces that it meets; of two outlines the second time only with lines and
 * hollow arcs. */
static bool add_pairs(making *m, kmp_outline_pair pair, const kmp_piece *corner, const kmp_outline *other)
{
    if (!other) {
        m->pairs[m->count++] = pair;
        return true;
    }
    const int count = parts_of(other);
    kmp_outline_part *parts = KMP_ARENA_NEW(&m->r->model->arena, kmp_outline_part, count);
    if (!parts || !kmp_outline_parts(&m->r->model->arena, other, pair.radius, parts))
        return false;
    kmp_outline_part *last[TURNS] = {NULL}, *first = NULL;
    int turn = 0;
    for (int k = 0; k < count; k++) {
        kmp_outline_part *part = &parts[k];
        if (!m->law) /* a rigid contact stops at the surface */
            memset(part->reach, 0, sizeof part->reach);
        if (!m->law && corner)
            meet_corner(part, corner);
        if (!kmp_piece_meets(&part->piece, pair.radius > 0) || (pair.swapped && is_circle(&part->piece)))
            continue;
        if (!first || m->law || first->piece.run != part->piece.run || first->second != part->second) {
            memset(last, 0, sizeof last);
            first = part;
            turn = 0;
        } else {
            turn = part->tip[0] > 0 ? 1 - turn : turn;
        }
        turn = part != first && turn == 0 && part->tip[1] > 0 && part->tip[1] == first->tip[0] ? 2 : turn;
        if (last[turn]) {
            last[turn]->next = part;
        } else {
            pair.part = part;
            m->pairs[m->count++] = pair;
        }
        last[turn] = part;
    }
    return true;
}

static bool add_circles(making *m, const kmp_outline *of, bool swapped, const kmp_outline *other)
{
    for (int copy = 0; copy < of->copies; copy++)
        for (int k = 0; k < of->piece_count; k++) {
            const kmp_piece piece = kmp_piece_copy(of, k, copy);
            if (is_circle(&piece) && !add_pairs(m,
                                                (kmp_outline_pair){.swapped = swapped,
                                                                   .off = true,
                                                                   .at = {piece.centre[0], piece.centre[1]},
                                                                   .radius = piece.radius},
                                                kmp_piece_is_sharp(&piece) ? &piece : NULL, other))
                return false;
        }
    return true;
}

/* Arcs other than corners may lie anywhere in the solid of their outline: their circles may not. */
static bool has_only_circles(making *m, const kmp_outline *outline)
{
    for (int k = 0; k < outline->piece_count; k++) {
        const kmp_piece *piece = &outline->pieces[k];
        if (piece->arc && piece->turn > 0 && !is_circle(piece))
            return KMP_COMPLAIN(m, m->map,
                                "outline '%s' has an arc that is not a corner; planes and other outlines meet only its "
                                "corners, or a whole circle. Take 'round', or a cylinder",
                                outline->name);
    }
    return true;
}

/* The circle of a point, a sphere or a cylinder. */
static bool read_circle(making *m, const kmp_yaml *map, double *radius)
{
    const kmp_yaml *node = kmp_yaml_get(map, "point") ? NULL : kmp_read_required(m->r, map, m->what, "radius");
    *radius = 0;
    return kmp_yaml_get(map, "point") ||
           (node &&
            kmp_read_fixed(m->r, node, kmp_reader_say(m->r, "the radius of %s", m->what), KMP_DIM_LENGTH, radius));
}

/* A circle that just fits between two parallel sides of a hollow outline, or is too large for an arc. */
static bool check_fit(making *m, const kmp_outline *outline, double radius)
{
    for (int k = 0; outline && k < outline->piece_count && radius > 0; k++) {
        const kmp_piece *piece = &outline->pieces[k];
        const double over = piece->radius - radius;
        if (!piece->arc || piece->turn > 0 || over > KMP_WRITTEN_DIGITS * radius)
            continue;
        if (outline->shape == KMP_OUTLINE_SLOT && fabs(over) <= KMP_WRITTEN_DIGITS * radius)
            return KMP_COMPLAIN(m, m->map,
                                "the slot '%s' is just as wide as the circle, %.6g m: without clearance this is a "
                                "joint; write a loop 'point_on_line' in place of the contact",
                                outline->name, 2 * radius);
        return KMP_COMPLAIN(m, m->map,
                            "a circle of radius %.6g m does not fit into the arc of radius %.6g m of outline '%s'",
                            radius, piece->radius, outline->name);
    }
    return true;
}

int kmp_outline_pairs(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_outline_pair **pairs)
{
    const kmp_yaml *on = kmp_yaml_get(map, "on"),
                   *name[2] = {kmp_yaml_get(map, "outline"), kmp_yaml_get(on, "outline")};
    const kmp_outline *outline[2] = {NULL, NULL};
    making m = {.r = r, .what = what, .map = map, .law = has_law(map)};
    double radius = 0;
    for (int k = 0; k < 2; k++)
        if (name[k] && !(outline[k] = kmp_read_outline_name(r, name[k], what)))
            return -1;
    if ((outline[0] && outline[0]->piece_count == 0) || (outline[1] && outline[1]->piece_count == 0))
        return -1; /* reported where it is read */
    const int most = kmp_outline_most_pairs(r, map);
    if (most > MOST_PAIRS) {
        kmp_complain_of(r, map, what,
                        "%d pairs of corners and sides of both outlines; at most %d can be followed: take simpler "
                        "outlines, or a point or cylinder for the part that touches",
                        most, MOST_PAIRS);
        return -1;
    }
    m.pairs = KMP_ARENA_NEW(&r->scratch, kmp_outline_pair, most + 1);
    bool good = m.pairs != NULL;
    if (!outline[0]) {
        good = good && read_circle(&m, map, &radius) && check_fit(&m, outline[1], radius) &&
               add_pairs(&m, (kmp_outline_pair){.radius = radius}, NULL, outline[1]);
    } else {
        good = good && has_only_circles(&m, outline[0]) && (!outline[1] || has_only_circles(&m, outline[1])) &&
               add_circles(&m, outline[0], false, outline[1]) &&
               (!outline[1] || add_circles(&m, outline[1], true, outline[0]));
    }
    *pairs = m.pairs;
    return good ? m.count : -1;
}

/* -- plane motion -------------------------------------------------------------------------------------- */

/* All rotations between both sides are about the axis z of the outline's point, and no translation is along it; the
 * axis of the other outline is parallel to it, the normal of a plane across it. */
static bool check_plane(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_contact_pair *touch, int owner)
{
    const kempe_model *model = r->model;
    const int point[2] = {touch->side[0].point, touch->side[1].point};
    const kmp_measure_argument z = {.point = point[owner], .axis = 2};
    if (kmp_moves_across(model, point[1 - owner], &z))
        return true;
    kmp_pose_zero at;
    double w[3];
    if (!kmp_pose_at_zero(model, &r->scratch, &at))
        return false;
    kmp_pose_axis(model, &at, point[owner], 2, w);
    const int body[2] = {model->points[point[0]].body, model->points[point[1]].body};
    const int top = kmp_model_common_body(model, body[0], body[1]);
    const char *joint = kmp_joint_off_axis(model, &at, body[0], top, w, true);
    joint = joint ? joint : kmp_joint_off_axis(model, &at, body[1], top, w, true);
    return kmp_complain_of(
        r, map, what, "an outline lies in the x-y plane of '%s.%s', and joint '%s' moves one side out of it",
        model->bodies[body[owner]].name, model->points[point[owner]].name, joint ? joint : "of a flexible body");
}

/* Both sides have parallel axes z; a plane has its normal across the axis. */
static bool check_axes(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_contact_pair *touch)
{
    const kempe_model *model = r->model;
    const bool plane = touch->side[1].shape == KMP_TOUCH_PLANE;
    kmp_pose_zero at;
    double w[2][3];
    if (!kmp_pose_at_zero(model, &r->scratch, &at))
        return false;
    for (int k = 0; k < 2; k++)
        kmp_pose_axis(model, &at, touch->side[k].point, k == 1 && plane ? touch->side[1].axis : 2, w[k]);
    if (plane ? fabs(kmp_dot(3, w[0], w[1])) > KMP_SAME_AXIS : !kmp_is_parallel(w[0], w[1]))
        return kmp_complain_of(r, map, what,
                               plane ? "the normal of the plane is not in the x-y plane of the outline"
                                     : "the axes z of both outlines are not parallel");
    return true;
}

bool kmp_outline_pair_put(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_outline_pair *pair,
                          kmp_contact_pair *touch)
{
    const kmp_yaml *on = kmp_yaml_get(map, "on");
    const bool first = kmp_yaml_get(map, "outline"), second = kmp_yaml_get(on, "outline");
    if (first && !second && touch->side[1].shape != KMP_TOUCH_PLANE)
        return kmp_complain_of(r, on, what,
                               "an outline touches a plane or another outline; write a sphere or cylinder as the first "
                               "side, on the outline");
    if (!check_plane(r, map, what, touch, first ? 0 : 1) || (first && !check_axes(r, map, what, touch)))
        return false;
    if (pair->swapped) {
        const kmp_touch_side side = touch->side[0];
        touch->side[0] = touch->side[1];
        touch->side[1] = side;
    }
    if (pair->off) {
        touch->side[0].shape = KMP_TOUCH_CYLINDER;
        touch->side[0].axis = 2;
        touch->side[0].off = true;
        touch->side[0].at[0] = pair->at[0];
        touch->side[0].at[1] = pair->at[1];
        touch->radius[0] = (kmp_number){.value = pair->radius};
    }
    if (pair->part) {
        touch->side[1].shape = KMP_TOUCH_PIECE;
        touch->side[1].axis = 2;
        touch->side[1].piece = pair->part;
        touch->side[1].hollow = pair->part->piece.turn < 0;
        touch->radius[1] = (kmp_number){.value = pair->part->piece.radius};
    }
    return true;
}

/* -- the start ----------------------------------------------------------------------------------------- */

/* The distance of a place from the nearest piece, negative within the solid; *nearest: the piece. At a corner the
 * corner itself is nearest, which has no inside. */
static double height_of(const kmp_outline *outline, const double place[2], int *nearest)
{
    double least = INFINITY, height = INFINITY;
    for (int copy = 0; copy < outline->copies; copy++)
        for (int k = 0; k < outline->piece_count; k++) {
            const kmp_piece piece = kmp_piece_copy(outline, k, copy);
            const double own = kmp_piece_height(&piece, place), size = kmp_piece_distance(&piece, place);
            if (size < least * (1 - KMP_WRITTEN_DIGITS) || (size <= least * (1 + KMP_WRITTEN_DIGITS) && own > height)) {
                least = size;
                height = own;
                *nearest = k;
            }
        }
    return copysign(least, height);
}

static void check_start(kmp_reader *r, const kmp_force *force, const kmp_outline *outline, const kmp_pose *poses,
                        const double *q)
{
    const kmp_touch_side *side = force->touch.side;
    kmp_pose pose[2];
    double place[2] = {0};
    int nearest = 0;
    for (int k = 0; k < 2; k++)
        kmp_pose_of_point(r->model, poses, q, side[k].point, &pose[k]);
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 3; i++) {
            double x = pose[0].p[i] - pose[1].p[i];
            if (side[0].off)
                x += side[0].at[0] * pose[0].r[i][0] + side[0].at[1] * pose[0].r[i][1];
            place[j] += pose[1].r[i][j] * x;
        }
    const double depth = force->touch.radius[0].value - height_of(outline, place, &nearest);
    if (depth > KMP_OUTLINE_DEEP * kmp_outline_size(outline))
        kmp_reader_complain(r, force->place,
                            "contact '%s' overlaps by %.6g m at the start, with its circle at (%.6g, %.6g) m of "
                            "outline '%s', near piece %d: "
                            "begin with the surfaces apart",
                            force->name, depth, place[0], place[1], outline->name, nearest + 1);
}

void kmp_settle_outlines(kmp_reader *r)
{
    const kempe_model *model = r->model;
    const double *q;
    bool assembled = false;
    for (int c = 0; c < model->closure_count; c++)
        assembled =
            assembled || !(kmp_closure_is_of_modes(&model->closures[c]) || kmp_closure_is_drive(&model->closures[c]));
    const bool settles = model->outline_contact_count > 0 && !assembled && !r->wrong;
    const kmp_pose *poses = settles ? kmp_start_poses(r, &q) : NULL;
    for (int c = 0; poses && c < model->outline_contact_count; c++) {
        const kmp_outline_contact *contact = &model->outline_contacts[c];
        for (int k = 0; k < contact->count && !r->wrong; k++) {
            const kmp_force *force = &model->forces[contact->first + k * contact->step];
            const kmp_outline *of =
                force->touch.side[1].point == contact->point[1] ? contact->outline[1] : contact->outline[0];
            if (force->kind == KMP_FORCE_TOUCH && of && of->closed && force->touch.side[1].piece)
                check_start(r, force, of, poses, q);
        }
    }
}
