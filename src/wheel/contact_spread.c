/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of an elastic wheel with its rail.
 *
 * It lies around the nearest point (pair.c). If curvatures change, the patch differs from that of the curvature at
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
#include "wheel/contact_spread.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/sums/average.h"
#include "symbolic/table_function.h"
#include <math.h>

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

kmp_spread kmp_spread_find(const kmp_tree *tree, const kmp_wheel_pair *p, const kmp_wheel *wheel, int zone,
                           const kmp_wheel_pose *pose)
{
    kmp_graph *g = p->g;
    averages all;
    kmp_derivative *dt = kmp_time_derivative(tree);
    /* e of the current penetration, and at least the spread that the zone's places resolve. */
    kmp_ref up = pose->up;
    averages first;
    spread_by(p, wheel, zone, 2, kmp_const(g, WIDER * wheel->least_spread[zone]), up, &first);
    kmp_ref deep = kmp_binary(g, KMP_OP_MAX, kmp_sub(g, first.height, up), KMP_ZERO);
    kmp_ref loaded = kmp_mul(g, kmp_const(g, LOADED), deep), least = kmp_const(g, wheel->least_spread[zone]);
    kmp_ref e = kmp_sqrt(g, kmp_sqrt(g, kmp_add(g, kmp_power(g, loaded, 4), kmp_power(g, least, 4))));
    spread_by(p, wheel, zone, 1, e, pose->up, &all);
    const held h = held_at(p, dt, all.s);
    kmp_ref cosine = kmp_cosine_of(g, all.slope);
    kmp_spread spread = {.s = all.s, .slope = all.slope};
    spread.depth = kmp_mul(g, cosine, kmp_sub(g, all.height, pose->up));
    /* D'' from averages: e over the variance, along the slope. */
    kmp_ref slope = h.slope;
    kmp_ref steep = kmp_power(g, kmp_add(g, KMP_ONE, kmp_mul(g, all.slope, all.slope)), 1.5);
    spread.across = kmp_div(g, e, kmp_mul(g, kmp_mul(g, all.variance, kmp_mul(g, slope, slope)), steep));
    spread.closing = kmp_mul(g, cosine, kmp_add(g, kmp_derivative_of(dt, pose->up), h.rate));
    kmp_derivative_free(dt);
    return spread;
}
