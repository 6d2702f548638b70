/* SPDX-License-Identifier: BSD-3-Clause */
/* Where a wheel comes nearest to its rail, and where it lies on it.
 *
 * In the cross-section of the track at the wheel's centre (x forwards, y outwards, z up) the axle is e = (e1, e2, e3),
 * and r(s) is the radius of the wheel at s along it. Of the circle at s only the point whose normal has no x component
 * can touch a rail that is drawn along x (Wang 1984, "the trace line"): with c^2 = e2^2 + e3^2 its direction from the
 * axle is
 *
 *     u = sin(b) l + cos(b) k,     sin(b) = r' e1 / c,     l = (x - e1 e) / c,     k = (0, e3, -e2) / c
 *
 * so that, with a = (e1 / c)^2 and cos(b) = sqrt(1 - a r'^2), it is from the wheel's centre at
 *
 *     x = (s + r r') e1,     y = t e2 + w e3,     z = t e3 - w e2,     t = s - a r r',     w = r cos(b) / c
 *
 * The vertical gap over the rail's height g is D(s) = zc + z(s) - g(yc + y(s)); both come nearest where it is least:
 * there D' = 0, and the gap along the common normal is D cos(contact angle). That is where a rigid wheel touches.
 *
 * An elastic one lies on the rail around there, and where curvatures change its patch is not the one that they make at
 * the nearest point; where two places are nearly as near it is on both. Its contact is taken at averages over the zone,
 * <f> = integral of f exp(-D/e) over s, by that of exp(-D/e) (smoothed contact: Netter, Schupp, Rulka, Schroeder,
 * "New aspects of contact modelling and validation within multibody system simulation of railway vehicles", Veh. Syst.
 * Dyn. 29 Suppl. (1998) 246, with a fixed e there). With D a parabola of curvature D'' the variance of s is e/D'' and
 *
 *     log of the integral of exp(-D/e) = - least D / e + log(2 pi variance) / 2
 *
 * which are taken for the curvature and the least D whatever D is: of a parabola they are exact. The spread e is that
 * of the load: Hertz' ellipse carries it over s with a variance of b^2/5, where a round patch has b^2 = d/D'' for a
 * penetration d, so that e = d/5. d itself comes from averages of a fixed e. All of that is smooth where the nearest
 * point jumps. Against solutions for the half-space it is nearer than the nearest point (examples/manchester).
 *
 * A zone ends smoothly: beyond its border a cubic is added to D that brings the least back, and the zone's weight falls
 * from 1 to 0 around the border as the next zone's rises. */
#include "wheel/patch.h"
#include "base/memory.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/table.h"
#include <math.h>

/* Of the fixed spread, in least spreads: as much as every other place resolves. */
#define WIDER 4

/* Least standard deviation of s, m: where all weight is on one place, in a profile that has an edge. */
#define NARROW 2e-6

/* Part of the penetration that is the spread: above. */
#define LOADED 0.2

/* Of candidates for the nearest point, m apart at most. */
#define SPACING 0.001
enum { FEWEST = 5, MOST = 128, BEYOND = 3, ARGUMENTS = 6 };

/* Beyond a border, m: where a slope of 10 is balanced. */
#define GIVE 1e-3

/* A wheel against a rail in one graph. */
typedef struct pair {
    kmp_graph *g;
    int wheel, rail; /* tables: both heights */
    kmp_ref radius, out, axle[3];
} pair;

/* A point of the trace line, from the wheel's centre. */
typedef struct trace {
    kmp_ref radius, slope; /* r and r' */
    kmp_ref x, y, z;
} trace;

static trace trace_at(const pair *p, kmp_ref s)
{
    kmp_graph *g = p->g;
    const kmp_ref *e = p->axle;
    trace t;
    t.radius = kmp_sub(g, p->radius, kmp_table_at(g, p->wheel, s));
    t.slope = kmp_neg(kmp_table_derivative_at(g, p->wheel, 1, s));
    kmp_ref c2 = kmp_add(g, kmp_mul(g, e[1], e[1]), kmp_mul(g, e[2], e[2]));
    kmp_ref a = kmp_div(g, kmp_mul(g, e[0], e[0]), c2), rise = kmp_mul(g, t.radius, t.slope);
    /* a wheel turned so far that no point of the circle has such a normal has left the rail long ago */
    kmp_ref inside = kmp_sub(g, KMP_ONE, kmp_mul(g, a, kmp_mul(g, t.slope, t.slope)));
    kmp_ref cosine = a == KMP_ZERO ? KMP_ONE : kmp_sqrt(g, kmp_binary(g, KMP_OP_MAX, inside, kmp_const(g, 1e-4)));
    kmp_ref along = kmp_sub(g, s, kmp_mul(g, a, rise));
    kmp_ref down = kmp_div(g, kmp_mul(g, t.radius, cosine), kmp_sqrt(g, c2));
    t.x = kmp_mul(g, kmp_add(g, s, rise), e[0]);
    t.y = kmp_add(g, kmp_mul(g, along, e[1]), kmp_mul(g, down, e[2]));
    t.z = kmp_sub(g, kmp_mul(g, along, e[2]), kmp_mul(g, down, e[1]));
    return t;
}

/* D less the height of the wheel's centre. */
static kmp_ref drop(const pair *p, const trace *t)
{
    return kmp_sub(p->g, t->z, kmp_table_at(p->g, p->rail, kmp_add(p->g, p->out, t->y)));
}

/* dx/ds */
static kmp_ref slope_of(kmp_graph *g, kmp_ref x, kmp_ref s)
{
    kmp_ref one = KMP_ONE, slope = KMP_ZERO;
    kmp_derivative *d = kmp_derivative_new(g, 1, &s, &one);
    if (d)
        slope = kmp_derivative_of(d, x);
    else
        kmp_graph_fail(g);
    kmp_derivative_free(d);
    return slope;
}

/* -- zones ------------------------------------------------------------------------------------------- */

/* Half of the way on which one zone's weight falls and the next one's rises. A rigid wheel touches in one zone: there
 * the border is sharp, or both zones were equally near around it. */
static double border_of(const kmp_wheel *wheel)
{
    double border = wheel->form == KMP_CONTACT_RIGID ? 0 : GIVE;
    for (int k = 0; k < wheel->zone_count; k++)
        border = fmin(border, (wheel->zone[k][1] - wheel->zone[k][0]) / 4);
    return border;
}

/* How far s is beyond a border, outside of it: side 0 the lower one. */
static kmp_ref beyond(kmp_graph *g, const kmp_wheel *wheel, int zone, int side, kmp_ref s)
{
    double border = border_of(wheel), end = wheel->zone[zone][side] + (side ? border : -border);
    kmp_ref over = kmp_sub(g, s, kmp_const(g, end));
    return kmp_binary(g, KMP_OP_MAX, side ? over : kmp_neg(over), KMP_ZERO);
}

static kmp_ref penalty(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s)
{
    kmp_ref sum = KMP_ZERO;
    for (int side = 0; side < 2; side++)
        sum = kmp_add(g, sum, kmp_power(g, beyond(g, wheel, zone, side, s), 3));
    return kmp_mul(g, kmp_const(g, 10 / (3 * GIVE * GIVE)), sum);
}

/* 1 within, 0 beyond, 6 x^5 - 15 x^4 + 10 x^3 between. */
static kmp_ref weight_at(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s)
{
    double border = border_of(wheel);
    kmp_ref weight = KMP_ONE;
    for (int side = 0; side < 2; side++) {
        kmp_ref way = kmp_sub(g, s, kmp_const(g, wheel->zone[zone][side]));
        kmp_ref x = kmp_add(g, kmp_mul(g, kmp_const(g, (side ? -0.5 : 0.5) / border), way), kmp_const(g, 0.5));
        x = kmp_binary(g, KMP_OP_MIN, kmp_binary(g, KMP_OP_MAX, x, KMP_ZERO), KMP_ONE);
        kmp_ref inner = kmp_sub(g, kmp_mul(g, kmp_const(g, 6), x), kmp_const(g, 15));
        inner = kmp_add(g, kmp_mul(g, inner, x), kmp_const(g, 10));
        weight = kmp_mul(g, weight, kmp_mul(g, kmp_power(g, x, 3), inner));
    }
    return weight;
}

/* -- the nearest point ------------------------------------------------------------------------------- */

/* Evenly within the zone; beyond a border, where the cubic balances all slopes between, few. */
static int candidates_of(const kmp_wheel *wheel, int index, double *candidate)
{
    static const double give[BEYOND] = {0.03, 0.3, 1.2};
    const double *zone = wheel->zone[index], length = zone[1] - zone[0], border = border_of(wheel);
    int count = (int)fmin(MOST, fmax(FEWEST, ceil(length / SPACING) + 1));
    for (int k = 0; k < count; k++)
        candidate[k] = zone[0] + length * k / (count - 1);
    for (int k = 0; k < BEYOND; k++) {
        candidate[count++] = zone[0] - border - give[k] * GIVE;
        candidate[count++] = zone[1] + border + give[k] * GIVE;
    }
    return count;
}

/* Numbers become numbers of the local graph, everything else an argument. */
static kmp_ref argument(kmp_graph *g, kmp_graph *local, kmp_ref x, kmp_ref *list, int *count)
{
    double value;
    if (kmp_is_const(g, x, &value))
        return kmp_const(local, value);
    list[*count] = x;
    return kmp_input(local, KMP_IN_PARAMETER, (uint32_t)(*count)++);
}

static pair in_block(const pair *p, kmp_graph *local, kmp_ref *list, int *count)
{
    pair in = {.g = local};
    in.wheel = kmp_graph_add_table(local, kmp_graph_table(p->g, p->wheel));
    in.rail = kmp_graph_add_table(local, kmp_graph_table(p->g, p->rail));
    in.radius = argument(p->g, local, p->radius, list, count);
    in.out = argument(p->g, local, p->out, list, count);
    for (int k = 0; k < 3; k++)
        in.axle[k] = argument(p->g, local, p->axle[k], list, count);
    return in;
}

/* s where D is least; false: no memory. */
static bool nearest(const pair *p, const kmp_wheel *wheel, int zone, kmp_ref *s)
{
    kmp_ref list[ARGUMENTS], guess = KMP_ZERO;
    double candidate[MOST + 2 * BEYOND];
    int count = 0;
    kmp_graph *local = kmp_graph_new();
    if (!local)
        return false;
    pair in = in_block(p, local, list, &count);
    kmp_ref unknown = kmp_input(local, KMP_IN_Q, 0);
    trace t = trace_at(&in, unknown);
    kmp_ref merit = kmp_add(local, drop(&in, &t), penalty(local, wheel, zone, unknown));
    kmp_ref residual = slope_of(local, merit, unknown);
    if (kmp_graph_failed(local)) {
        kmp_graph_free(local);
        return false;
    }
    kmp_implicit *made = kmp_implicit_new_among(local, 1, count, &residual, &guess,
                                                candidates_of(wheel, zone, candidate), candidate, merit);
    int block = made ? kmp_graph_add_implicit(p->g, made) : -1;
    if (block < 0)
        return false;
    kmp_implicit_at(p->g, block, list, s);
    return true;
}

/* Relative curvature of both profiles in the plane of their normals: D'' by y along the slope, and never flatter than
 * a hundredth of the curvature along, smoothly: Hertz' theory ends there. */
static kmp_ref curvature_across(const pair *p, kmp_ref s, kmp_ref slope, kmp_ref along)
{
    kmp_graph *g = p->g;
    kmp_ref place = kmp_input(g, KMP_IN_PLACE, 0);
    trace t = trace_at(p, place);
    kmp_ref bend[2] = {slope_of(g, slope_of(g, drop(p, &t), place), place), slope_of(g, t.y, place)};
    for (int k = 0; k < 2; k++)
        bend[k] = kmp_graph_replace(g, 1, &place, &s, bend[k]);
    kmp_ref steep = kmp_power(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope)), 1.5);
    kmp_ref x = kmp_div(g, bend[0], kmp_mul(g, kmp_mul(g, bend[1], bend[1]), steep));
    kmp_ref least = kmp_mul(g, kmp_const(g, 0.02), along), half = kmp_const(g, 0.5);
    kmp_ref root = kmp_sqrt(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, least, least)));
    return kmp_mul(g, half, kmp_add(g, x, root));
}

/* -- in space ---------------------------------------------------------------------------------------- */

static kmp_vec combine(kmp_graph *g, const kmp_vec axis[3], kmp_ref x, kmp_ref y, kmp_ref z)
{
    kmp_vec sum = kmp_vec_scale(g, x, axis[0]);
    sum = kmp_vec_add(g, sum, kmp_vec_scale(g, y, axis[1]));
    return kmp_vec_add(g, sum, kmp_vec_scale(g, z, axis[2]));
}

bool kmp_wheel_find(const kmp_tree *tree, const kmp_wheel *wheel, kmp_wheel_pose *pose)
{
    static const double leftwards[3] = {0, 1, 0};
    kmp_graph *g = tree->graph;
    bool left = wheel->side == KMP_TRACK_LEFT;
    pose->centre = kmp_point_position(tree, wheel->point, 0);
    if (!kmp_track_at(tree, &tree->model->tracks[wheel->track], pose->centre, &pose->place))
        return false;
    const kmp_track_place *place = &pose->place;
    kmp_vec axle = kmp_point_direction(tree, wheel->point, leftwards, 0), way = pose->centre;
    pose->axis[0] = place->axis[0];
    pose->axis[1] = left ? place->axis[1] : kmp_vec_sub(g, kmp_vec_zero(), place->axis[1]);
    pose->axis[2] = place->axis[2];
    way = kmp_vec_sub(g, way, place->origin);
    axle = left ? axle : kmp_vec_sub(g, kmp_vec_zero(), axle);
    pose->out = kmp_sub(g, kmp_vec_dot(g, way, pose->axis[1]), place->outwards[wheel->side]);
    pose->up = kmp_sub(g, kmp_vec_dot(g, way, pose->axis[2]), place->upwards[wheel->side]);
    for (int k = 0; k < 3; k++)
        pose->axle[k] = kmp_vec_dot(g, axle, pose->axis[k]);
    return !kmp_graph_failed(g);
}

static bool pair_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, pair *p)
{
    *p = (pair){.g = tree->graph, .radius = kmp_tree_number(tree, &wheel->radius), .out = pose->out};
    for (int k = 0; k < 3; k++)
        p->axle[k] = pose->axle[k];
    p->wheel = kmp_graph_add_table(tree->graph, wheel->profile->height);
    p->rail = kmp_track_rail_table(tree, &tree->model->tracks[wheel->track]);
    return p->wheel >= 0 && p->rail >= 0;
}

static kmp_ref cosine_of(kmp_graph *g, kmp_ref slope)
{
    return kmp_div(g, KMP_ONE, kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope))));
}

/* The contact at s, with patch->slope there: all but the gap and the curvature across. */
static void fill(const pair *p, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const trace *t, kmp_ref s,
                 kmp_patch *patch)
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

/* -- an elastic wheel -------------------------------------------------------------------------------- */

/* Averages over a zone: of s, from its middle, of its square, and of the rail's slope; and the height of the wheel's
 * centre at which it would touch. */
typedef struct spread {
    kmp_ref s, variance, slope, height;
} spread;

/* The zone's places; for the first, wider spread every other one. */
static int places_of(const kmp_wheel *wheel, int zone, int step, double *place)
{
    int first = zone > 0 ? wheel->nodes_end[zone - 1] : 0, count = 0;
    for (int k = first; k < wheel->nodes_end[zone]; k += step)
        place[count++] = wheel->node[k];
    return count;
}

/* The block of averages with e = 1 / sharp, which may be an argument. NULL: no memory. */
static kmp_implicit *averages(const pair *p, const kmp_wheel *wheel, int zone, int step, kmp_ref sharp, kmp_ref *list,
                              int *count)
{
    double place[KMP_WHEEL_PLACES], middle = (wheel->zone[zone][0] + wheel->zone[zone][1]) / 2;
    kmp_graph *local = kmp_graph_new();
    if (!local)
        return NULL;
    pair in = in_block(p, local, list, count);
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), from = kmp_sub(local, s, kmp_const(local, middle));
    trace t = trace_at(&in, s);
    kmp_ref gap = kmp_add(local, drop(&in, &t), penalty(local, wheel, zone, s));
    kmp_ref exponent = kmp_neg(kmp_mul(local, gap, argument(p->g, local, sharp, list, count)));
    kmp_ref slope = kmp_table_derivative_at(local, in.rail, 1, kmp_add(local, in.out, t.y));
    const kmp_ref averaged[] = {from, kmp_mul(local, from, from), slope};
    return kmp_average_new(local, *count, exponent, 3, averaged, places_of(wheel, zone, step, place), place);
}

/* The zone's averages for a spread e, at each `step` of its places. false: no memory. */
static bool spread_by(const pair *p, const kmp_wheel *wheel, int zone, int step, kmp_ref e, spread *all)
{
    kmp_graph *g = p->g;
    kmp_ref list[ARGUMENTS], value[4];
    int count = 0;
    kmp_implicit *made = averages(p, wheel, zone, step, kmp_div(g, KMP_ONE, e), list, &count);
    int block = made ? kmp_graph_add_implicit(g, made) : -1;
    if (block < 0)
        return false;
    kmp_implicit_at(g, block, list, value);
    kmp_ref variance = kmp_sub(g, value[2], kmp_mul(g, value[1], value[1]));
    all->variance = kmp_add(g, variance, kmp_const(g, NARROW * NARROW));
    kmp_ref width = kmp_mul(g, kmp_const(g, 2 * acos(-1)), all->variance);
    kmp_ref lost = kmp_mul(g, kmp_const(g, 0.5), kmp_unary(g, KMP_OP_LOG, width));
    all->height = kmp_mul(g, e, kmp_sub(g, value[0], lost));
    all->s = kmp_add(g, value[1], kmp_const(g, (wheel->zone[zone][0] + wheel->zone[zone][1]) / 2));
    all->slope = value[3];
    return true;
}

/* e of the penetration at hand, and not less than what the zone's places resolve. */
static bool loaded_spread(const pair *p, const kmp_wheel *wheel, int zone, kmp_ref up, kmp_ref *e)
{
    kmp_graph *g = p->g;
    spread first;
    if (!spread_by(p, wheel, zone, 2, kmp_const(g, WIDER * wheel->least_spread[zone]), &first))
        return false;
    kmp_ref deep = kmp_binary(g, KMP_OP_MAX, kmp_sub(g, first.height, up), KMP_ZERO);
    kmp_ref loaded = kmp_mul(g, kmp_const(g, LOADED), deep), least = kmp_const(g, wheel->least_spread[zone]);
    *e = kmp_sqrt(g, kmp_sqrt(g, kmp_add(g, kmp_power(g, loaded, 4), kmp_power(g, least, 4))));
    return true;
}

/* With s held: dy/ds, and the rate of D without that of the centre's height. */
typedef struct held {
    kmp_ref way, rate;
} held;

/* In a graph of its own, where s and the arguments are inputs, and their rates. */
static bool derive_held(const pair *in, int count, held *h)
{
    kmp_graph *local = in->g;
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), argument[ARGUMENTS], rate[ARGUMENTS];
    for (int l = 0; l < count; l++) {
        argument[l] = kmp_input(local, KMP_IN_PARAMETER, (uint32_t)l);
        rate[l] = kmp_input(local, KMP_IN_LAMBDA, (uint32_t)l);
    }
    trace t = trace_at(in, s);
    kmp_derivative *d = kmp_derivative_new(local, count, argument, rate);
    if (!d)
        return false;
    h->rate = kmp_derivative_of(d, drop(in, &t));
    kmp_derivative_free(d);
    h->way = slope_of(local, t.y, s);
    return !kmp_graph_failed(local);
}

static bool held_at(const kmp_tree *tree, const pair *p, kmp_ref s, held *h)
{
    kmp_ref list[ARGUMENTS], rate[ARGUMENTS];
    int count = 0;
    kmp_graph *local = kmp_graph_new();
    kmp_derivative *dt = kmp_time_derivative(tree);
    bool ok = local && dt;
    if (ok) {
        pair in = in_block(p, local, list, &count);
        ok = derive_held(&in, count, h);
    }
    for (int l = 0; ok && l < count; l++)
        rate[l] = kmp_derivative_of(dt, list[l]);
    kmp_derivative_free(dt);
    const kmp_setting setting = {p->g, &s, list, rate};
    kmp_ref both[2] = {h->way, h->rate};
    ok = ok && kmp_local_import(&setting, local, 2, both);
    kmp_graph_free(local);
    *h = (held){both[0], both[1]};
    return ok;
}

/* What D'' is for the averages: e over the variance, along the slope. */
static kmp_ref average_across(kmp_graph *g, const spread *all, kmp_ref way, kmp_ref e)
{
    kmp_ref steep = kmp_power(g, kmp_add(g, KMP_ONE, kmp_mul(g, all->slope, all->slope)), 1.5);
    return kmp_div(g, e, kmp_mul(g, kmp_mul(g, all->variance, kmp_mul(g, way, way)), steep));
}

/* The gap's rate with s held. false: no memory. */
static bool closing_rate(const kmp_tree *tree, const kmp_wheel_pose *pose, const held *h, kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    kmp_derivative *dt = kmp_time_derivative(tree);
    if (!dt)
        return false;
    patch->closing = kmp_mul(g, kmp_add(g, kmp_derivative_of(dt, pose->up), h->rate), cosine_of(g, patch->slope));
    kmp_derivative_free(dt);
    return true;
}

bool kmp_wheel_patch(const kmp_tree *tree, const kmp_wheel *wheel, int zone, const kmp_wheel_pose *pose,
                     kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    pair p;
    spread all;
    kmp_ref e;
    held h = {0};
    if (!pair_of(tree, wheel, pose, &p) || !loaded_spread(&p, wheel, zone, pose->up, &e) ||
        !spread_by(&p, wheel, zone, 1, e, &all) || !held_at(tree, &p, all.s, &h))
        return false;
    trace t = trace_at(&p, all.s);
    patch->slope = all.slope;
    fill(&p, wheel, pose, &t, all.s, patch);
    patch->gap = kmp_mul(g, cosine_of(g, all.slope), kmp_sub(g, pose->up, all.height));
    patch->across = average_across(g, &all, h.way, e);
    patch->weight = weight_at(g, wheel, zone, all.s);
    return closing_rate(tree, pose, &h, patch) && !kmp_graph_failed(g);
}

/* -- a rigid wheel ----------------------------------------------------------------------------------- */

/* Whether `gap` of a zone is less than the least before it. During a step that stands still, and a change has to be by
 * a tenth of a nanometre for a metre of radius: both are equally near where it happens, and rounding would turn it
 * back. */
static kmp_ref is_nearer(const kmp_tree *tree, const kmp_wheel *wheel, int zone, kmp_ref gap, kmp_ref least)
{
    return kmp_tree_condition(
        tree, wheel, zone, kmp_sub(tree->graph, gap, least), 1e-10 * wheel->radius.value,
        "two points of the wheel would have to touch at once, and with 'contact: rigid' one does; "
        "with 'contact: elastic' both do",
        "wheel '%s': contact in zone %d", wheel->name, zone + 1);
}

bool kmp_wheel_touch(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, kmp_patch *patch)
{
    kmp_graph *g = tree->graph;
    pair p;
    kmp_ref s = KMP_ZERO, least = KMP_ZERO;
    if (!pair_of(tree, wheel, pose, &p))
        return false;
    for (int zone = 0; zone < wheel->zone_count; zone++) {
        kmp_ref other;
        if (!nearest(&p, wheel, zone, &other))
            return false;
        trace t = trace_at(&p, other);
        kmp_ref gap = kmp_add(g, drop(&p, &t), penalty(g, wheel, zone, other));
        kmp_ref nearer = KMP_ONE;
        if (zone > 0)
            nearer = is_nearer(tree, wheel, zone, gap, least);
        s = kmp_select(g, nearer, other, s);
        least = kmp_select(g, nearer, gap, least);
    }
    trace t = trace_at(&p, s);
    patch->slope = kmp_table_derivative_at(g, p.rail, 1, kmp_add(g, p.out, t.y));
    fill(&p, wheel, pose, &t, s, patch);
    patch->gap = kmp_mul(g, cosine_of(g, patch->slope), kmp_add(g, pose->up, drop(&p, &t)));
    patch->across = curvature_across(&p, s, patch->slope, patch->along);
    return !kmp_graph_failed(g);
}

bool kmp_wheel_slip(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_patch *patch,
                    kmp_slip *slip)
{
    kmp_graph *g = tree->graph;
    kmp_vec centre;
    kmp_derivative *dt = kmp_time_derivative(tree);
    for (int k = 0; dt && k < 3; k++)
        centre.x[k] = kmp_derivative_of(dt, pose->centre.x[k]);
    kmp_derivative_free(dt);
    if (!dt)
        return false;
    kmp_vec spin = kmp_link_spin(tree, kmp_point_link(tree, wheel->point), 0);
    slip->turn = spin;
    slip->velocity = kmp_vec_add(g, centre, kmp_vec_cross(g, spin, kmp_vec_sub(g, patch->point, pose->centre)));
    kmp_ref forwards = kmp_vec_dot(g, centre, pose->axis[0]), least = kmp_tree_number(tree, &wheel->speed);
    slip->speed = kmp_sqrt(g, kmp_add(g, kmp_mul(g, forwards, forwards), kmp_mul(g, least, least)));
    slip->along = kmp_div(g, kmp_vec_dot(g, slip->velocity, pose->axis[0]), slip->speed);
    slip->across = kmp_div(g, kmp_vec_dot(g, slip->velocity, patch->side), slip->speed);
    slip->sense = kmp_unary(g, KMP_OP_TANH, kmp_div(g, forwards, least));
    slip->spin = kmp_mul(g, slip->sense, kmp_div(g, kmp_vec_dot(g, spin, patch->normal), slip->speed));
    return !kmp_graph_failed(g);
}
