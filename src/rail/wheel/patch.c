/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of a wheel: a rigid wheel touches at the nearest point of all zones, an elastic wheel in each zone where
 * it lies on the rail. */
#include "rail/wheel/patch.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "model/data/wheels.h"
#include "rail/places/average.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/substitute.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* -- the track ------------------------------------------------------------------------------------------- */

/* On a straight track a place is a projection. On a curved track its arc length s is the place of the least horizontal
 * distance to the middle line r: (p - r(s)) . r'(s) = 0. */

/* The track's own point and axes. */
typedef struct ground {
    kmp_vec begin, axis[3];
} ground;

/* -- curved ---------------------------------------------------------------------------------------- */

enum { PLANE = 2 };

/* The block of a track that the graph has already; -1: none. The graph itself would find an equal block, but building
 * one takes some milliseconds, for each wheel. */
static int find_block(const kmp_graph *g, const kmp_track *track)
{
    const kmp_implicit *implicit;
    size_t size = (size_t)track->candidate_count * sizeof(double);
    for (int k = 0; (implicit = kmp_graph_implicit(g, k)); k++) {
        const kmp_program_block *block = kmp_implicit_block(implicit);
        if (block->candidates == track->candidate_count && memcmp(block->candidate, track->candidate, size) == 0 &&
            block->program->table_count == PLANE && kmp_table_equal(block->program->table[0], track->x) &&
            kmp_table_equal(block->program->table[1], track->y))
            return k;
    }
    return -1;
}

/* The arc length for a point in the plane. */
static int add_block(kmp_graph *g, const kmp_track *track)
{
    kmp_graph *local = kmp_graph_new();
    if (!local)
        return kmp_graph_add_implicit(g, NULL);
    kmp_table *line[PLANE] = {track->x, track->y};
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), residual = KMP_ZERO, merit = KMP_ZERO, guess = KMP_ZERO;
    for (unsigned k = 0; k < PLANE; k++) {
        int table = kmp_graph_add_table(local, line[k]);
        kmp_ref off = kmp_sub(local, kmp_input(local, KMP_IN_PARAMETER, k), kmp_table_at(local, table, s));
        residual = kmp_add(local, residual, kmp_mul(local, off, kmp_table_derivative_at(local, table, 1, s)));
        merit = kmp_add(local, merit, kmp_mul(local, off, off));
    }
    kmp_implicit *block =
        kmp_implicit_new_among(local, 1, PLANE, &residual, &guess, track->candidate_count, track->candidate, merit);
    return kmp_graph_add_implicit(g, block);
}

/* Turned about the track's direction: the left rail goes up. */
static void cant(const kmp_tree *tree, const kmp_track *track, kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    kmp_ref angle = kmp_table_at(g, kmp_graph_add_table(g, track->cant), place->along);
    kmp_ref c = kmp_cos(g, angle), s = kmp_sin(g, angle);
    kmp_vec left = place->axis[1], up = place->axis[2];
    place->axis[1] = kmp_vec_add(g, kmp_vec_scale(g, c, left), kmp_vec_scale(g, s, up));
    place->axis[2] = kmp_vec_sub(g, kmp_vec_scale(g, c, up), kmp_vec_scale(g, s, left));
}

static void curved(const kmp_tree *tree, const kmp_track *track, const ground *at, kmp_vec point,
                   kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    kmp_vec off = kmp_vec_sub(g, point, at->begin);
    kmp_ref plane[PLANE] = {kmp_vec_dot(g, off, at->axis[0]), kmp_vec_dot(g, off, at->axis[1])};
    int block = find_block(g, track);
    if (block < 0)
        block = add_block(g, track);
    place->along = KMP_ZERO;
    kmp_implicit_at(g, block, plane, &place->along);
    /* The cross-section at place->along. */
    int x = kmp_graph_add_table(g, track->x), y = kmp_graph_add_table(g, track->y);
    kmp_ref dx = kmp_table_derivative_at(g, x, 1, place->along), dy = kmp_table_derivative_at(g, y, 1, place->along);
    kmp_ref length = kmp_sqrt(g, kmp_add(g, kmp_mul(g, dx, dx), kmp_mul(g, dy, dy)));
    kmp_ref c = kmp_div(g, dx, length), s = kmp_div(g, dy, length);
    kmp_vec ahead = kmp_vec_scale(g, kmp_table_at(g, x, place->along), at->axis[0]),
            aside = kmp_vec_scale(g, kmp_table_at(g, y, place->along), at->axis[1]);
    place->origin = kmp_vec_add(g, at->begin, kmp_vec_add(g, ahead, aside));
    place->axis[0] = kmp_vec_add(g, kmp_vec_scale(g, c, at->axis[0]), kmp_vec_scale(g, s, at->axis[1]));
    place->axis[1] = kmp_vec_sub(g, kmp_vec_scale(g, c, at->axis[1]), kmp_vec_scale(g, s, at->axis[0]));
    place->axis[2] = at->axis[2];
    if (track->cant)
        cant(tree, track, place);
}

/* -- irregularities -------------------------------------------------------------------------------- */

void kmp_track_at(const kmp_tree *tree, const kmp_track *track, kmp_vec point, kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    ground at = {.begin = kmp_point_position(tree, track->point, 0)};
    kmp_point_axes(tree, track->point, 0, at.axis);
    if (track->curved) {
        curved(tree, track, &at, point, place);
    } else {
        memcpy(place->axis, at.axis, sizeof at.axis);
        place->along = kmp_vec_dot(g, kmp_vec_sub(g, point, at.begin), at.axis[0]);
        place->origin = kmp_vec_add(g, at.begin, kmp_vec_scale(g, place->along, at.axis[0]));
    }
    /* Irregularities move the rails. */
    kmp_ref moved[KMP_IRREGULARITIES], half = kmp_const(g, 0.5);
    for (int k = 0; k < KMP_IRREGULARITIES; k++) {
        const kmp_irregularities *all = &track->irregularities;
        kmp_table *table = all->named[k] ? all->named[k]->table : all->made[k];
        moved[k] = table ? kmp_table_at(g, kmp_graph_add_table(g, table), place->along) : KMP_ZERO;
    }
    kmp_ref wider = kmp_mul(g, half, moved[KMP_IRREGULARITY_GAUGE]),
            apart = kmp_mul(g, half, moved[KMP_IRREGULARITY_CROSS]);
    for (int side = 0; side < KMP_TRACK_SIDES; side++) {
        bool left = side == KMP_TRACK_LEFT;
        kmp_ref aside = moved[KMP_IRREGULARITY_ALIGNMENT];
        place->outwards[side] = kmp_add(g, wider, left ? aside : kmp_neg(aside));
        place->upwards[side] = kmp_add(g, moved[KMP_IRREGULARITY_LEVEL], left ? apart : kmp_neg(apart));
    }
}

/* -- a wheel over its rail ------------------------------------------------------------------------------- */

/* In the cross-section of the track at the wheel's centre (x forwards, y outwards, z up) the axle is e = (e1, e2, e3).
 * The radius of the wheel at s along it is r(s). On the circle at s only the point whose normal has no x component can
 * touch a rail that is drawn along x (Wang 1984, "the trace line"). With c^2 = e2^2 + e3^2 its direction from the axle
 * is
 *
 *     u = sin(b) l + cos(b) k,     sin(b) = r' e1 / c,     l = (x - e1 e) / c,     k = (0, e3, -e2) / c
 *
 * so that, with a = (e1 / c)^2 and cos(b) = sqrt(1 - a r'^2), its position relative to the wheel's centre is
 *
 *     x = (s + r r') e1,     y = t e2 + w e3,     z = t e3 - w e2,     t = s - a r r',     w = r cos(b) / c
 *
 * The vertical gap over the rail's height g is D(s) = zc + z(s) - g(yc + y(s)). The profiles are nearest where it is
 * least: there D' = 0, and the gap along the common normal is D cos(contact angle). A rigid wheel touches there.
 *
 * A zone ends smoothly: beyond its border a cubic is added to D that brings the least back. The zone's weight falls
 * from 1 to 0 around the border as the next zone's rises. */

static kmp_wheel_pair pair_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose)
{
    kmp_wheel_pair p = {.g = tree->graph, .radius = kmp_tree_number(tree, &wheel->radius), .out = pose->out};
    memcpy(p.axle, pose->axle, sizeof p.axle);
    p.wheel = kmp_graph_add_table(tree->graph, wheel->profile->height);
    p.rail = kmp_graph_add_table(tree->graph, kmp_model_track(tree->model, wheel->track)->rail);
    return p;
}

/* Numbers become numbers of the local graph, everything else an argument. */
kmp_ref kmp_pair_argument(kmp_graph *g, kmp_graph *local, kmp_ref x, kmp_ref *list, int *count)
{
    double value;
    if (kmp_is_const(g, x, &value))
        return kmp_const(local, value);
    if (*count == KMP_PAIR_ARGUMENTS) {
        kmp_graph_fail(g);
        kmp_graph_fail(local);
        return KMP_ZERO;
    }
    list[*count] = x;
    return kmp_input(local, KMP_IN_PARAMETER, (uint32_t)(*count)++);
}

/* The pair in a separate graph, for a block: each expression that is not a number becomes an argument, and is
 * appended to the list. */
static kmp_wheel_pair pair_inside(const kmp_wheel_pair *p, kmp_graph *local, kmp_ref *list, int *count)
{
    kmp_wheel_pair in = {.g = local};
    in.wheel = kmp_graph_add_table(local, kmp_graph_table(p->g, p->wheel));
    in.rail = kmp_graph_add_table(local, kmp_graph_table(p->g, p->rail));
    in.radius = kmp_pair_argument(p->g, local, p->radius, list, count);
    in.out = kmp_pair_argument(p->g, local, p->out, list, count);
    for (int k = 0; k < 3; k++)
        in.axle[k] = kmp_pair_argument(p->g, local, p->axle[k], list, count);
    return in;
}

/* -- the trace line ---------------------------------------------------------------------------------- */

kmp_trace kmp_trace_at(const kmp_wheel_pair *p, kmp_ref s)
{
    kmp_graph *g = p->g;
    const kmp_ref *e = p->axle;
    kmp_trace t;
    t.radius = kmp_sub(g, p->radius, kmp_table_at(g, p->wheel, s));
    t.slope = kmp_neg(kmp_table_derivative_at(g, p->wheel, 1, s));
    kmp_ref c2 = kmp_add(g, kmp_mul(g, e[1], e[1]), kmp_mul(g, e[2], e[2]));
    kmp_ref a = kmp_div(g, kmp_mul(g, e[0], e[0]), c2), rise = kmp_mul(g, t.radius, t.slope);
    /* a wheel turned so far that no point of the circle has such a normal has left the rail long ago */
    kmp_ref inside = kmp_sub(g, KMP_ONE, kmp_mul(g, a, kmp_mul(g, t.slope, t.slope)));
    kmp_ref cosine = a == KMP_ZERO ? KMP_ONE : kmp_sqrt(g, kmp_binary(g, KMP_OP_MAX, inside, kmp_const(g, 1e-4)));
    kmp_ref along = kmp_sub(g, s, kmp_mul(g, a, rise));
    kmp_ref down = kmp_mul(g, kmp_mul(g, t.radius, cosine), kmp_div(g, KMP_ONE, kmp_sqrt(g, c2)));
    t.x = kmp_mul(g, kmp_add(g, s, rise), e[0]);
    t.y = kmp_add(g, kmp_mul(g, along, e[1]), kmp_mul(g, down, e[2]));
    t.z = kmp_sub(g, kmp_mul(g, along, e[2]), kmp_mul(g, down, e[1]));
    return t;
}

/* D less the height of the wheel's centre. */
static kmp_ref pair_drop(const kmp_wheel_pair *p, const kmp_trace *t)
{
    return kmp_sub(p->g, t->z, kmp_table_at(p->g, p->rail, kmp_add(p->g, p->out, t->y)));
}

kmp_ref kmp_slope_of(kmp_graph *g, kmp_ref x, kmp_ref s)
{
    kmp_ref slope;
    kmp_derivatives_by(g, s, 1, &x, &slope);
    return slope;
}

/* The cosine of the angle with this tangent. */
static kmp_ref cosine_of(kmp_graph *g, kmp_ref slope)
{
    return kmp_div(g, KMP_ONE, kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope))));
}

/* -- zones ------------------------------------------------------------------------------------------- */

/* m beyond a border: where a slope of 10 is balanced. */
static double zone_give(const kmp_wheel *wheel)
{
    return 1e-3 * wheel->scale;
}

double kmp_zone_border(const kmp_wheel *wheel)
{
    double border = wheel->form == KMP_CONTACT_RIGID ? 0 : zone_give(wheel);
    for (int k = 0; k < wheel->zone_count; k++)
        border = fmin(border, (wheel->zone[k][1] - wheel->zone[k][0]) / 4);
    return border;
}

/* The term added to D beyond the borders of a zone. */
static kmp_ref zone_penalty(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s)
{
    double give = zone_give(wheel);
    kmp_ref sum = KMP_ZERO;
    for (int side = 0; side < 2; side++) { /* 0 is the lower border */
        double border = kmp_zone_border(wheel), end = wheel->zone[zone][side] + (side ? border : -border);
        kmp_ref over = kmp_sub(g, s, kmp_const(g, end));
        kmp_ref beyond = kmp_binary(g, KMP_OP_MAX, side ? over : kmp_neg(over), KMP_ZERO);
        sum = kmp_add(g, sum, kmp_power(g, beyond, 3));
    }
    return kmp_mul(g, kmp_const(g, 10 / (3 * give * give)), sum);
}

/* 1 within, 0 beyond, 6 x^5 - 15 x^4 + 10 x^3 between. */
static kmp_ref zone_weight(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s)
{
    double border = kmp_zone_border(wheel);
    kmp_ref weight = KMP_ONE;
    for (int side = 0; side < 2; side++) {
        kmp_ref distance = kmp_sub(g, s, kmp_const(g, wheel->zone[zone][side]));
        kmp_ref x = kmp_add(g, kmp_mul(g, kmp_const(g, (side ? -0.5 : 0.5) / border), distance), kmp_const(g, 0.5));
        x = kmp_binary(g, KMP_OP_MIN, kmp_binary(g, KMP_OP_MAX, x, KMP_ZERO), KMP_ONE);
        kmp_ref inner = kmp_sub(g, kmp_mul(g, kmp_const(g, 6), x), kmp_const(g, 15));
        inner = kmp_add(g, kmp_mul(g, inner, x), kmp_const(g, 10));
        weight = kmp_mul(g, weight, kmp_mul(g, kmp_power(g, x, 3), inner));
    }
    return weight;
}

/* Largest distance of candidates for the nearest point of a wheel of 0.46 m, in m: times kmp_wheel.scale. */
#define SPACING 0.001
enum { FEWEST = 5, MOST = 128, BEYOND = 3 };

/* -- the nearest point ------------------------------------------------------------------------------- */

/* Candidates are evenly spaced within the zone; few beyond a border, where the cubic balances all slopes. */
static int candidates_of(const kmp_wheel *wheel, int index, double *candidate)
{
    static const double part[BEYOND] = {0.03, 0.3, 1.2};
    const double *zone = wheel->zone[index], length = zone[1] - zone[0];
    const double border = kmp_zone_border(wheel), give = zone_give(wheel);
    int count = (int)fmin(MOST, fmax(FEWEST, ceil(length / (SPACING * wheel->scale) - 1e-6) + 1));
    for (int k = 0; k < count; k++)
        candidate[k] = zone[0] + length * k / (count - 1);
    for (int k = 0; k < BEYOND; k++) {
        candidate[count++] = zone[0] - border - part[k] * give;
        candidate[count++] = zone[1] + border + part[k] * give;
    }
    return count;
}

/* s where D is least. */
static kmp_ref nearest(const kmp_wheel_pair *p, const kmp_wheel *wheel, int zone)
{
    kmp_ref list[KMP_PAIR_ARGUMENTS], guess = KMP_ZERO, s = KMP_ZERO;
    double candidate[MOST + 2 * BEYOND];
    int count = 0;
    kmp_graph *local = kmp_graph_new();
    if (!local) {
        kmp_graph_fail(p->g);
        return s;
    }
    kmp_wheel_pair in = pair_inside(p, local, list, &count);
    kmp_ref unknown = kmp_input(local, KMP_IN_Q, 0);
    kmp_trace t = kmp_trace_at(&in, unknown);
    kmp_ref merit = kmp_add(local, pair_drop(&in, &t), zone_penalty(local, wheel, zone, unknown));
    kmp_ref residual = kmp_slope_of(local, merit, unknown);
    kmp_implicit *made = kmp_implicit_new_among(local, 1, count, &residual, &guess,
                                                candidates_of(wheel, zone, candidate), candidate, merit);
    kmp_implicit_at(p->g, kmp_graph_add_implicit(p->g, made), list, &s);
    return s;
}

/* Relative curvature of both profiles in the plane of their normals: D'' with respect to y along the slope. It is never
 * below a hundredth of the curvature along, smoothly: Hertz' theory ends there. */
static kmp_ref curvature_across(const kmp_wheel_pair *p, kmp_ref s, kmp_ref slope, kmp_ref along)
{
    kmp_graph *g = p->g;
    kmp_ref place = kmp_input(g, KMP_IN_PLACE, 0);
    kmp_trace t = kmp_trace_at(p, place);
    kmp_ref curvature[2] = {kmp_slope_of(g, kmp_slope_of(g, pair_drop(p, &t), place), place),
                            kmp_slope_of(g, t.y, place)};
    for (int k = 0; k < 2; k++)
        curvature[k] = kmp_graph_replace(g, 1, &place, &s, curvature[k]);
    kmp_ref steep = kmp_power(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope)), 1.5);
    kmp_ref x = kmp_div(g, curvature[0], kmp_mul(g, kmp_mul(g, curvature[1], curvature[1]), steep));
    kmp_ref least = kmp_mul(g, kmp_const(g, 0.02), along), half = kmp_const(g, 0.5);
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, least, least)));
    return kmp_mul(g, half, kmp_add(g, x, root));
}

kmp_ref kmp_patch_fit(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_patch *patch)
{
    if (wheel->form == KMP_CONTACT_RIGID)
        return KMP_ZERO;
    const kmp_wheel_pair p = pair_of(tree, wheel, pose);
    return kmp_div(tree->graph, curvature_across(&p, patch->s, patch->slope, patch->along), patch->across);
}

/* -- in space ---------------------------------------------------------------------------------------- */

static kmp_vec combine(kmp_graph *g, const kmp_vec axis[3], kmp_ref x, kmp_ref y, kmp_ref z)
{
    kmp_vec sum = kmp_vec_scale(g, x, axis[0]);
    sum = kmp_vec_add(g, sum, kmp_vec_scale(g, y, axis[1]));
    return kmp_vec_add(g, sum, kmp_vec_scale(g, z, axis[2]));
}

void kmp_wheel_find(const kmp_tree *tree, const kmp_wheel *wheel, kmp_wheel_pose *pose)
{
    static const double leftwards[3] = {0, 1, 0};
    kmp_graph *g = tree->graph;
    bool left = wheel->side == KMP_TRACK_LEFT;
    pose->centre = kmp_point_position(tree, wheel->point, 0);
    kmp_track_at(tree, kmp_model_track(tree->model, wheel->track), pose->centre, &pose->place);
    const kmp_track_place *place = &pose->place;
    kmp_vec axle = kmp_point_direction(tree, wheel->point, leftwards, 0), arm = pose->centre;
    pose->axis[0] = place->axis[0];
    pose->axis[1] = left ? place->axis[1] : kmp_vec_sub(g, kmp_vec_zero(), place->axis[1]);
    pose->axis[2] = place->axis[2];
    arm = kmp_vec_sub(g, arm, place->origin);
    axle = left ? axle : kmp_vec_sub(g, kmp_vec_zero(), axle);
    pose->out = kmp_sub(g, kmp_vec_dot(g, arm, pose->axis[1]), place->outwards[wheel->side]);
    pose->up = kmp_sub(g, kmp_vec_dot(g, arm, pose->axis[2]), place->upwards[wheel->side]);
    for (int k = 0; k < 3; k++)
        pose->axle[k] = kmp_vec_dot(g, axle, pose->axis[k]);
}

/* Fills in the contact at s, with patch->slope there: all but the gap and the curvature across. */
static void fill(const kmp_wheel_pair *p, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_trace *t,
                 kmp_ref s, kmp_patch *patch)
{
    kmp_graph *g = p->g;
    patch->s = s;
    patch->y = kmp_add(g, p->out, t->y);
    kmp_ref cosine = cosine_of(g, patch->slope), sine = kmp_mul(g, patch->slope, cosine);
    bool left = wheel->side == KMP_TRACK_LEFT;
    patch->point = kmp_vec_add(g, pose->centre, combine(g, pose->axis, t->x, t->y, t->z));
    patch->normal = combine(g, pose->axis, KMP_ZERO, kmp_neg(sine), cosine);
    patch->side = combine(g, pose->axis, KMP_ZERO, left ? cosine : kmp_neg(cosine), left ? sine : kmp_neg(sine));
    kmp_ref lean = kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, t->slope, t->slope)));
    patch->along = kmp_div(g, KMP_ONE, kmp_mul(g, t->radius, lean));
    patch->weight = KMP_ONE;
    patch->closing = KMP_ZERO;
}

/* -- the place of an elastic wheel -------------------------------------------------------------------- */

/* It lies around the nearest point. If curvatures change, the patch differs from the patch by the curvature
 * at the nearest point; where two places are nearly as near the wheel touches at both. The contact is therefore taken
 * at averages over the zone, <f> = integral of f exp(-D/e) over s, divided by the integral of exp(-D/e). This is
 * smoothed contact (Netter, Schupp, Rulka, Schroeder, "New aspects of contact modelling and validation within multibody
 * system simulation of railway vehicles", Veh. Syst. Dyn. 29 Suppl. (1998) 246, with a fixed e there). With D a
 * parabola of curvature D'' the variance of s is e/D'' and
 *
 *     log of the integral of exp(-D/e) = - least D / e + log(2 pi variance) / 2
 *
 * which give the curvature and the least D for any D: for a parabola they are exact. The spread e follows the load:
 * Hertz' ellipse distributes it over s with a variance of b^2/5. A round patch has b^2 = d/D'' for a penetration d, so
 * that e = d/5. d itself comes from averages of a fixed e. All of that is smooth where the nearest point jumps.
 * Compared with solutions for the half-space it is more accurate than the nearest point (examples/manchester). */
/* The fixed spread in units of the least spread: as much as every other place resolves. */
#define WIDER 4

/* Least standard deviation of s, m for a wheel of 0.46 m: reached where all weight is on one place, in a profile that
 * has an edge. */
#define NARROW 2e-6

/* The spread as a fraction of the penetration: see above. */
#define LOADED 0.2

/* Averages over a zone: of s, from its middle, of its square, and of the rail's slope; and the height of the wheel's
 * centre at which it would touch. */
typedef struct averages {
    kmp_ref s, variance, slope, height;
} averages;

/* The number of the block of averages with e = 1 / sharp, which may be an argument. If the centre is higher than D can
 * compensate there is no contact. -1: no memory. */
static int block_of(const kmp_wheel_pair *p, const kmp_wheel *wheel, int zone, int step, kmp_ref sharp, kmp_ref up,
                    kmp_ref *list, int *count)
{
    double place[KMP_WHEEL_PLACES], middle = (wheel->zone[zone][0] + wheel->zone[zone][1]) / 2;
    kmp_graph *local = kmp_graph_new();
    if (!local)
        return kmp_graph_add_implicit(p->g, NULL);
    kmp_wheel_pair in = pair_inside(p, local, list, count);
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), from = kmp_sub(local, s, kmp_const(local, middle));
    kmp_trace t = kmp_trace_at(&in, s);
    kmp_ref gap = kmp_add(local, pair_drop(&in, &t), zone_penalty(local, wheel, zone, s));
    kmp_ref by = kmp_pair_argument(p->g, local, sharp, list, count), exponent = kmp_neg(kmp_mul(local, gap, by));
    kmp_ref needed = kmp_mul(local, kmp_pair_argument(p->g, local, up, list, count), by);
    kmp_ref slope = kmp_table_derivative_at(local, in.rail, 1, kmp_add(local, in.out, t.y));
    const kmp_ref averaged[] = {from, kmp_mul(local, from, from), slope};
    /* The zone's places; every other one for the first, wider spread. */
    int first = zone > 0 ? wheel->nodes_end[zone - 1] : 0, places = 0;
    for (int k = first; k < wheel->nodes_end[zone]; k += step)
        place[places++] = wheel->node[k];
    return kmp_average_in(p->g, local, *count, exponent, needed, 3, averaged, places, place);
}

/* The zone's averages for a spread e, at each `step` of its places. */
static void spread_by(const kmp_wheel_pair *p, const kmp_wheel *wheel, int zone, int step, kmp_ref e, kmp_ref up,
                      averages *all)
{
    kmp_graph *g = p->g;
    kmp_ref list[KMP_PAIR_ARGUMENTS], value[4] = {0};
    int count = 0;
    int block = block_of(p, wheel, zone, step, kmp_div(g, KMP_ONE, e), up, list, &count);
    kmp_implicit_at(g, block, list, value);
    kmp_ref variance = kmp_sub(g, value[2], kmp_mul(g, value[1], value[1]));
    double narrow = NARROW * wheel->scale;
    all->variance = kmp_add(g, variance, kmp_const(g, narrow * narrow));
    kmp_ref width = kmp_mul(g, kmp_const(g, 2 * acos(-1)), all->variance);
    kmp_ref lost = kmp_mul(g, kmp_const(g, 0.5), kmp_unary(g, KMP_OP_LOG, width));
    all->height = kmp_mul(g, e, kmp_sub(g, value[0], lost));
    all->s = kmp_add(g, value[1], kmp_const(g, (wheel->zone[zone][0] + wheel->zone[zone][1]) / 2));
    all->slope = value[3];
}

/* At constant s: dy/ds, and the rate of D without the rate of the centre's height. */
typedef struct held {
    kmp_ref slope, rate;
} held;

/* Derives them in a separate graph, where s and the arguments are inputs, and their rates. */
static held derive_held(const kmp_wheel_pair *in, int count)
{
    kmp_graph *local = in->g;
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), argument[KMP_PAIR_ARGUMENTS], rate[KMP_PAIR_ARGUMENTS];
    for (int l = 0; l < count; l++) {
        argument[l] = kmp_input(local, KMP_IN_PARAMETER, (uint32_t)l);
        rate[l] = kmp_input(local, KMP_IN_LAMBDA, (uint32_t)l);
    }
    kmp_trace t = kmp_trace_at(in, s);
    kmp_derivative *d = kmp_derivative_new(local, count, argument, rate);
    held h = {.rate = kmp_derivative_of(d, pair_drop(in, &t))};
    kmp_derivative_free(d);
    h.slope = kmp_slope_of(local, t.y, s);
    return h;
}

static held held_at(const kmp_wheel_pair *p, kmp_derivative *dt, kmp_ref s)
{
    kmp_ref list[KMP_PAIR_ARGUMENTS], rate[KMP_PAIR_ARGUMENTS];
    int count = 0;
    held h = {0};
    kmp_graph *local = kmp_graph_new();
    if (local) {
        kmp_wheel_pair in = pair_inside(p, local, list, &count);
        h = derive_held(&in, count);
    }
    for (int l = 0; l < count; l++)
        rate[l] = kmp_derivative_of(dt, list[l]);
    const kmp_setting setting = {p->g, &s, list, rate};
    kmp_ref both[2] = {h.slope, h.rate};
    if (!local || kmp_graph_failed(local) || !kmp_local_import(&setting, local, 2, both))
        kmp_graph_fail(p->g);
    kmp_graph_free(local);
    return (held){both[0], both[1]};
}

void kmp_wheel_patch(const kmp_tree *tree, const kmp_wheel *wheel, int zone, const kmp_wheel_pose *pose,
                     kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    const kmp_wheel_pair p = pair_of(tree, wheel, pose);
    averages first, all;
    kmp_derivative *dt = kmp_time_derivative(tree);
    /* e of the current penetration, and at least the spread that the zone's places resolve. */
    spread_by(&p, wheel, zone, 2, kmp_const(g, WIDER * wheel->least_spread[zone]), pose->up, &first);
    kmp_ref deep = kmp_binary(g, KMP_OP_MAX, kmp_sub(g, first.height, pose->up), KMP_ZERO);
    kmp_ref loaded = kmp_mul(g, kmp_const(g, LOADED), deep), least = kmp_const(g, wheel->least_spread[zone]);
    kmp_ref e = kmp_sqrt(g, kmp_sqrt(g, kmp_add(g, kmp_power(g, loaded, 4), kmp_power(g, least, 4))));
    spread_by(&p, wheel, zone, 1, e, pose->up, &all);
    const held h = held_at(&p, dt, all.s);
    kmp_ref cosine = cosine_of(g, all.slope), depth = kmp_mul(g, cosine, kmp_sub(g, all.height, pose->up));
    /* D'' from averages: e over the variance, along the slope. */
    kmp_ref steep = kmp_power(g, kmp_add(g, KMP_ONE, kmp_mul(g, all.slope, all.slope)), 1.5);
    kmp_ref across = kmp_div(g, e, kmp_mul(g, kmp_mul(g, all.variance, kmp_mul(g, h.slope, h.slope)), steep));
    kmp_ref closing = kmp_mul(g, cosine, kmp_add(g, kmp_derivative_of(dt, pose->up), h.rate));
    kmp_derivative_free(dt);
    kmp_trace t = kmp_trace_at(&p, all.s);
    patch->slope = all.slope;
    fill(&p, wheel, pose, &t, all.s, patch);
    patch->gap = kmp_neg(depth);
    patch->across = across;
    patch->closing = closing;
    patch->weight = zone_weight(g, wheel, zone, all.s);
}

/* -- a rigid wheel ----------------------------------------------------------------------------------- */

void kmp_wheel_touch(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    const kmp_wheel_pair p = pair_of(tree, wheel, pose);
    kmp_ref s = KMP_ZERO, least = KMP_ZERO;
    for (int zone = 0; zone < wheel->zone_count; zone++) {
        kmp_ref other = nearest(&p, wheel, zone);
        kmp_trace t = kmp_trace_at(&p, other);
        kmp_ref gap = kmp_add(g, pair_drop(&p, &t), zone_penalty(g, wheel, zone, other));
        kmp_ref nearer = KMP_ONE;
        /* The condition is constant during a step, and a change requires a tenth of a nanometre for a metre of radius.
         * Both gaps are equal where it happens, and rounding would revert it. */
        if (zone > 0)
            nearer = kmp_tree_condition(
                tree, wheel, zone, kmp_sub(g, gap, least), 1e-10 * wheel->radius.value,
                "a rigid contact has one contact point, but two points of the wheel would have to touch; "
                "use 'contact: elastic'",
                "wheel '%s': contact in zone %d", wheel->name, zone + 1);
        s = kmp_select(g, nearer, other, s);
        least = kmp_select(g, nearer, gap, least);
    }
    kmp_trace t = kmp_trace_at(&p, s);
    patch->slope = kmp_table_derivative_at(g, p.rail, 1, kmp_add(g, p.out, t.y));
    fill(&p, wheel, pose, &t, s, patch);
    patch->gap = kmp_mul(g, cosine_of(g, patch->slope), kmp_add(g, pose->up, pair_drop(&p, &t)));
    patch->across = curvature_across(&p, s, patch->slope, patch->along);
}

void kmp_wheel_slip(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_patch *patch,
                    kmp_slip *slip)
{
    kmp_graph *g = tree->graph;
    kmp_vec centre = kmp_vec_rate(tree, pose->centre);
    kmp_vec spin = kmp_link_spin(tree, kmp_point_link(tree, wheel->point), 0);
    slip->turn = spin;
    slip->velocity = kmp_vec_add(g, centre, kmp_vec_cross(g, spin, kmp_vec_sub(g, patch->point, pose->centre)));
    kmp_ref forwards = kmp_vec_dot(g, centre, pose->axis[0]), least = kmp_tree_number(tree, &wheel->speed);
    slip->speed = kmp_sqrt(g, kmp_add(g, kmp_mul(g, forwards, forwards), kmp_mul(g, least, least)));
    slip->along = kmp_div(g, kmp_vec_dot(g, slip->velocity, pose->axis[0]), slip->speed);
    slip->across = kmp_div(g, kmp_vec_dot(g, slip->velocity, patch->side), slip->speed);
    slip->sense = kmp_unary(g, KMP_OP_TANH, kmp_div(g, forwards, least));
    slip->spin = kmp_mul(g, slip->sense, kmp_div(g, kmp_vec_dot(g, spin, patch->normal), slip->speed));
}
