/* SPDX-License-Identifier: BSD-3-Clause */
/* A wheel over its rail.
 *
 * In the cross-section of the track at the wheel's centre (x forwards, y outwards, z up) the axle is e = (e1, e2, e3).
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
#include "rail/wheel/pair.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

kmp_wheel_pair kmp_pair_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose)
{
    kmp_wheel_pair p = {.g = tree->graph, .radius = kmp_tree_number(tree, &wheel->radius), .out = pose->out};
    memcpy(p.axle, pose->axle, sizeof p.axle);
    p.wheel = kmp_graph_add_table(tree->graph, wheel->profile->height);
    p.rail = kmp_graph_add_table(tree->graph, tree->model->tracks[wheel->track].rail);
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

kmp_wheel_pair kmp_pair_inside(const kmp_wheel_pair *p, kmp_graph *local, kmp_ref *list, int *count)
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

kmp_ref kmp_pair_drop(const kmp_wheel_pair *p, const kmp_trace *t)
{
    return kmp_sub(p->g, t->z, kmp_table_at(p->g, p->rail, kmp_add(p->g, p->out, t->y)));
}

kmp_ref kmp_slope_of(kmp_graph *g, kmp_ref x, kmp_ref s)
{
    kmp_ref slope;
    kmp_derivatives_by(g, s, 1, &x, &slope);
    return slope;
}

kmp_ref kmp_cosine_of(kmp_graph *g, kmp_ref slope)
{
    return kmp_div(g, KMP_ONE, kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, slope, slope))));
}

/* -- zones ------------------------------------------------------------------------------------------- */

double kmp_zone_give(const kmp_wheel *wheel)
{
    return 1e-3 * wheel->scale;
}

double kmp_zone_border(const kmp_wheel *wheel)
{
    double border = wheel->form == KMP_CONTACT_RIGID ? 0 : kmp_zone_give(wheel);
    for (int k = 0; k < wheel->zone_count; k++)
        border = fmin(border, (wheel->zone[k][1] - wheel->zone[k][0]) / 4);
    return border;
}

/* The distance of s beyond a border, outside of the zone: side 0 is the lower border. */
static kmp_ref beyond(kmp_graph *g, const kmp_wheel *wheel, int zone, int side, kmp_ref s)
{
    double border = kmp_zone_border(wheel), end = wheel->zone[zone][side] + (side ? border : -border);
    kmp_ref over = kmp_sub(g, s, kmp_const(g, end));
    return kmp_binary(g, KMP_OP_MAX, side ? over : kmp_neg(over), KMP_ZERO);
}

kmp_ref kmp_zone_penalty(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s)
{
    double give = kmp_zone_give(wheel);
    kmp_ref sum = KMP_ZERO;
    for (int side = 0; side < 2; side++)
        sum = kmp_add(g, sum, kmp_power(g, beyond(g, wheel, zone, side, s), 3));
    return kmp_mul(g, kmp_const(g, 10 / (3 * give * give)), sum);
}

kmp_ref kmp_zone_weight(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s)
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
