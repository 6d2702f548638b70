/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of a wheel: a rigid wheel touches at the nearest point of all zones, an elastic wheel in each zone where
 * it lies on the rail. */
#include "rail/wheel/patch.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "rail/wheel/pair.h"
#include "symbolic/average.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/substitute.h"
#include <math.h>

/* Largest distance of candidates for the nearest point of a wheel of 0.46 m, in m: times kmp_wheel.scale. */
#define SPACING 0.001
enum { FEWEST = 5, MOST = 128, BEYOND = 3 };

/* -- the nearest point ------------------------------------------------------------------------------- */

/* Candidates are evenly spaced within the zone; few beyond a border, where the cubic balances all slopes. */
static int candidates_of(const kmp_wheel *wheel, int index, double *candidate)
{
    static const double part[BEYOND] = {0.03, 0.3, 1.2};
    const double *zone = wheel->zone[index], length = zone[1] - zone[0];
    const double border = kmp_zone_border(wheel), give = kmp_zone_give(wheel);
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
    kmp_wheel_pair in = kmp_pair_inside(p, local, list, &count);
    kmp_ref unknown = kmp_input(local, KMP_IN_Q, 0);
    kmp_trace t = kmp_trace_at(&in, unknown);
    kmp_ref merit = kmp_add(local, kmp_pair_drop(&in, &t), kmp_zone_penalty(local, wheel, zone, unknown));
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
    kmp_ref curvature[2] = {kmp_slope_of(g, kmp_slope_of(g, kmp_pair_drop(p, &t), place), place),
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
    const kmp_wheel_pair p = kmp_pair_of(tree, wheel, pose);
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
    kmp_track_at(tree, &tree->model->tracks[wheel->track], pose->centre, &pose->place);
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
    kmp_ref cosine = kmp_cosine_of(g, patch->slope), sine = kmp_mul(g, patch->slope, cosine);
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

/* It lies around the nearest point (pair.c). If curvatures change, the patch differs from that of the curvature at
 * the nearest point; where two places are nearly as near the wheel touches at both. The contact is therefore taken at
 * averages over the zone, <f> = integral of f exp(-D/e) over s, divided by that of exp(-D/e). This is smoothed contact
 * (Netter, Schupp, Rulka, Schroeder, "New aspects of contact modelling and validation within multibody system
 * simulation of railway vehicles", Veh. Syst. Dyn. 29 Suppl. (1998) 246, with a fixed e there). With D a parabola of
 * curvature D'' the variance of s is e/D'' and
 *
 *     log of the integral of exp(-D/e) = - least D / e + log(2 pi variance) / 2
 *
 * which give the curvature and the least D for any D: for a parabola they are exact. The spread e is that of the load:
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
    kmp_wheel_pair in = kmp_pair_inside(p, local, list, count);
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), from = kmp_sub(local, s, kmp_const(local, middle));
    kmp_trace t = kmp_trace_at(&in, s);
    kmp_ref gap = kmp_add(local, kmp_pair_drop(&in, &t), kmp_zone_penalty(local, wheel, zone, s));
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

/* At constant s: dy/ds, and the rate of D without that of the centre's height. */
typedef struct held {
    kmp_ref slope, rate;
} held;

/* Derives them in a graph of its own, where s and the arguments are inputs, and their rates. */
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
    held h = {.rate = kmp_derivative_of(d, kmp_pair_drop(in, &t))};
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
        kmp_wheel_pair in = kmp_pair_inside(p, local, list, &count);
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
    const kmp_wheel_pair p = kmp_pair_of(tree, wheel, pose);
    averages first, all;
    kmp_derivative *dt = kmp_time_derivative(tree);
    /* e of the current penetration, and at least the spread that the zone's places resolve. */
    spread_by(&p, wheel, zone, 2, kmp_const(g, WIDER * wheel->least_spread[zone]), pose->up, &first);
    kmp_ref deep = kmp_binary(g, KMP_OP_MAX, kmp_sub(g, first.height, pose->up), KMP_ZERO);
    kmp_ref loaded = kmp_mul(g, kmp_const(g, LOADED), deep), least = kmp_const(g, wheel->least_spread[zone]);
    kmp_ref e = kmp_sqrt(g, kmp_sqrt(g, kmp_add(g, kmp_power(g, loaded, 4), kmp_power(g, least, 4))));
    spread_by(&p, wheel, zone, 1, e, pose->up, &all);
    const held h = held_at(&p, dt, all.s);
    kmp_ref cosine = kmp_cosine_of(g, all.slope), depth = kmp_mul(g, cosine, kmp_sub(g, all.height, pose->up));
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
    patch->weight = kmp_zone_weight(g, wheel, zone, all.s);
}

/* -- a rigid wheel ----------------------------------------------------------------------------------- */

/* True if `gap` of a zone is less than the least before it. The condition is constant during a step, and a change
 * requires a tenth of a nanometre for a metre of radius. Both gaps are equal where it happens, and rounding would
 * revert it. */
static kmp_ref is_nearer(const kmp_tree *tree, const kmp_wheel *wheel, int zone, kmp_ref gap, kmp_ref least)
{
    return kmp_tree_condition(tree, wheel, zone, kmp_sub(tree->graph, gap, least), 1e-10 * wheel->radius.value,
                              "a rigid contact has one contact point, but two points of the wheel would have to touch; "
                              "use 'contact: elastic'",
                              "wheel '%s': contact in zone %d", wheel->name, zone + 1);
}

void kmp_wheel_touch(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    const kmp_wheel_pair p = kmp_pair_of(tree, wheel, pose);
    kmp_ref s = KMP_ZERO, least = KMP_ZERO;
    for (int zone = 0; zone < wheel->zone_count; zone++) {
        kmp_ref other = nearest(&p, wheel, zone);
        kmp_trace t = kmp_trace_at(&p, other);
        kmp_ref gap = kmp_add(g, kmp_pair_drop(&p, &t), kmp_zone_penalty(g, wheel, zone, other));
        kmp_ref nearer = KMP_ONE;
        if (zone > 0)
            nearer = is_nearer(tree, wheel, zone, gap, least);
        s = kmp_select(g, nearer, other, s);
        least = kmp_select(g, nearer, gap, least);
    }
    kmp_trace t = kmp_trace_at(&p, s);
    patch->slope = kmp_table_derivative_at(g, p.rail, 1, kmp_add(g, p.out, t.y));
    fill(&p, wheel, pose, &t, s, patch);
    patch->gap = kmp_mul(g, kmp_cosine_of(g, patch->slope), kmp_add(g, pose->up, kmp_pair_drop(&p, &t)));
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
