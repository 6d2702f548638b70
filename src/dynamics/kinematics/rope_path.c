/* SPDX-License-Identifier: BSD-3-Clause */
/* In the plane across the axes a span from circle i to circle j, with radii r that have the sign of their turn, has the
 * direction of d = c_j - c_i turned by -asin(p/|d|), p = r_j - r_i. Its length is sqrt(d^2 - p^2 + z^2), z along the
 * axis. Angles are continuous because they are differences from the start: a + atan2(sin(x - a), cos(x - a)), where x
 * stays within half a turn of a, which the end of a run guards. The rotations of drums are coordinates without limits.
 */
#include "dynamics/kinematics/rope_path.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/touching.h"
#include "dynamics/kinematics/tree_start.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"
#include "symbolic/substitute.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* Shortest free part next to a sheave, over its radius: the forces of a part that is used up have no direction. */
#define LEAST_SPAN 0.01
/* Largest change of an angle since the start, in rad: short of half a turn by more than a step of a run changes it. */
#define MOST_TURNED 3.1
/* Smallest wrap of a sheave, in rad: a rope that just touches it starts with rounding. */
#define LEAST_WRAP -1e-6

/* Cosine of the angle, 1 deg, by which both neighbours of a sphere are not opposite each other: there the shorter way
 * changes its side. */
#define OPPOSITE 0.99985

/* Conditions of a place: of the path with all sheaves, then of the path without one that the rope has left. */
enum { SPAN_ENDS, TURN_ENDS, WRAP_ENDS, PATH_CONDITIONS, OFF = 2 * PATH_CONDITIONS, LAYERS, SIDE_ENDS };

/* The roughest path of a drum with layers: angles of finer ones differ by 1e-12 rad where dr/dw is 1e-3 of the span. */
enum { ROUGHEST = 3 };

/* A path, or one of its parts, in the axes of the link that carries all its places. */
typedef struct path {
    const kmp_tree *tree;
    const kmp_rope *rope;
    int link;
    kmp_vec axis;
    int without;   /* a place that it leaves out; -1: none */
    int rough;     /* for drums with layers: 0 .. ROUGHEST; their radius is by the next rougher path */
    kmp_ref holds; /* 1 where the rope has this path, otherwise 0 */
} path;

typedef struct span {
    kmp_ref length;
    kmp_vec along; /* unit vector across the axis */
} span;

/* From a place to another one. */
static kmp_vec from_to(const path *p, int k, int other)
{
    return kmp_vec_sub(p->tree->graph, kmp_point_position(p->tree, p->rope->places[other].point, p->link),
                       kmp_point_position(p->tree, p->rope->places[k].point, p->link));
}

/* The unit normal of the plane of a sphere's centre and both its neighbours, about which the rope turns to the left. */
static kmp_vec plane_of_ball(const path *p)
{
    kmp_graph *g = p->tree->graph;
    const kmp_vec from[2] = {from_to(p, 1, 0), from_to(p, 1, 2)}, n = kmp_vec_cross(g, from[0], from[1]);
    return kmp_vec_scale(g, kmp_div(g, KMP_ONE, kmp_sqrt(g, kmp_vec_dot(g, n, n))), n);
}

static path path_of(const kmp_tree *tree, const kmp_rope *rope)
{
    path p = {.tree = tree,
              .rope = rope,
              .link = kmp_point_link(tree, rope->places[0].point),
              .without = -1,
              .holds = KMP_ONE};
    for (int k = 0; k < rope->count; k++) {
        const kmp_rope_place *place = &rope->places[k];
        p.link = kmp_tree_common(tree, p.link, kmp_point_link(tree, place->point));
        if (place->turns)
            p.link = kmp_tree_common(tree, p.link, tree->mounts[place->carrier].link);
    }
    p.axis = kmp_vec_zero();
    if (rope->plane >= 0) {
        const kmp_rope_place *place = &rope->places[rope->plane];
        const double e[3] = {place->axis == 0, place->axis == 1, place->axis == 2};
        p.axis = place->ball ? plane_of_ball(&p) : kmp_point_direction(tree, place->point, e, p.link);
    }
    return p;
}

/* BODY.POINT */
static const char *name_of(const path *p, int place)
{
    const kmp_point *point = &p->tree->model->points[p->rope->places[place].point];
    const char *name = kmp_arena_printf(kmp_graph_arena(p->tree->graph), "%s.%s",
                                        p->tree->model->bodies[point->body].name, point->name);
    return name ? name : "";
}

/* The place after another one, and before it. */
static int after(const path *p, int k)
{
    return kmp_rope_next(p->rope, k, 1, p->without);
}

static int before(const path *p, int k)
{
    return kmp_rope_next(p->rope, k, -1, p->without);
}

/* The value of a condition of this path, and its number. */
static kmp_ref where_it_holds(const path *p, kmp_ref value)
{
    return p->holds == KMP_ONE ? value : kmp_select(p->tree->graph, p->holds, value, KMP_ONE);
}

static int numbered(const path *p, int condition)
{
    return p->without < 0 ? condition : PATH_CONDITIONS + condition;
}

static kmp_ref layer_radius(const path *p, int place);

static kmp_ref signed_radius(const path *p, int place)
{
    const kmp_ref r = p->rope->places[place].layers ? layer_radius(p, place)
                                                    : kmp_tree_number(p->tree, &p->rope->places[place].radius);
    return p->rope->places[place].turn < 0 ? kmp_neg(r) : r;
}

/* Runs end where a free part next to a sheave is used up. */
static void end_span(const path *p, int k, int next, kmp_ref difference, kmp_ref square)
{
    kmp_graph *g = p->tree->graph;
    if (p->rough > 0)
        return;
    const kmp_ref least = kmp_mul(g, kmp_const(g, LEAST_SPAN * LEAST_SPAN), kmp_mul(g, difference, difference));
    kmp_tree_end(p->tree, &p->rope->places[k], numbered(p, SPAN_ENDS), where_it_holds(p, kmp_sub(g, square, least)),
                 "one of them has come to the rim of the other, where the rope has no free part left",
                 "rope '%s': '%s' and '%s' touch", p->rope->name, name_of(p, k), name_of(p, next));
}

/* True for the path on a cylinder along which it may rise. Its lengths are those across the axis. */
static bool is_helix(const path *p)
{
    return p->without < 0 && p->rope->plane >= 0 && p->rope->places[p->rope->plane].helix;
}

/* Span k of the path, from place k to the next one. */
static span span_of(const path *p, int k)
{
    kmp_graph *g = p->tree->graph;
    const kmp_rope *rope = p->rope;
    const int next = after(p, k);
    const kmp_vec whole = from_to(p, k, next);
    const kmp_ref all = kmp_vec_dot(g, whole, whole);
    if (rope->places[k].turn == 0 && rope->places[next].turn == 0) {
        const kmp_ref length = kmp_sqrt(g, all);
        return (span){length, kmp_vec_scale(g, kmp_div(g, KMP_ONE, length), whole)};
    }
    const kmp_ref deep = kmp_vec_dot(g, whole, p->axis);
    const kmp_vec d = kmp_vec_sub(g, whole, kmp_vec_scale(g, deep, p->axis));
    const kmp_ref across = kmp_vec_dot(g, d, d), difference = kmp_sub(g, signed_radius(p, next), signed_radius(p, k));
    const kmp_ref square = kmp_sub(g, across, kmp_mul(g, difference, difference)), free = kmp_sqrt(g, square);
    end_span(p, k, next, difference, square);
    const kmp_vec turned =
        kmp_vec_sub(g, kmp_vec_scale(g, free, d), kmp_vec_scale(g, difference, kmp_vec_cross(g, p->axis, d)));
    return (span){is_helix(p) ? free : kmp_sqrt(g, kmp_sub(g, all, kmp_mul(g, difference, difference))),
                  kmp_vec_scale(g, kmp_div(g, KMP_ONE, across), turned)};
}

/* -- angles -------------------------------------------------------------------------------------------- */

/* The angle from one direction to another one to the left about the axis, less `from`; within half a turn of zero. */
static kmp_ref turned_from(const path *p, int k, kmp_vec first, kmp_vec second, double from)
{
    kmp_graph *g = p->tree->graph;
    const kmp_ref sine = kmp_vec_dot(g, p->axis, kmp_vec_cross(g, first, second));
    const kmp_ref cosine = kmp_vec_dot(g, first, second), c = kmp_const(g, cos(from)), s = kmp_const(g, sin(from));
    const kmp_ref change = kmp_binary(g, KMP_OP_ATAN2, kmp_sub(g, kmp_mul(g, c, sine), kmp_mul(g, s, cosine)),
                                      kmp_add(g, kmp_mul(g, c, cosine), kmp_mul(g, s, sine)));
    const kmp_ref left = kmp_sub(g, kmp_const(g, MOST_TURNED * MOST_TURNED), kmp_mul(g, change, change));
    if (p->rough > 0)
        return change;
    kmp_tree_end(p->tree, &p->rope->places[k], numbered(p, TURN_ENDS), where_it_holds(p, left),
                 "angles of a rope at a sheave are within half a turn of the start",
                 "rope '%s' has turned by 3.1 rad about '%s' since the start", p->rope->name, name_of(p, k));
    return change;
}

/* Runs end where the way round a sphere would change its side. */
static void end_side(const path *p)
{
    kmp_graph *g = p->tree->graph;
    const kmp_vec from[2] = {from_to(p, 1, 0), from_to(p, 1, 2)};
    const kmp_ref sizes = kmp_mul(g, kmp_vec_dot(g, from[0], from[0]), kmp_vec_dot(g, from[1], from[1]));
    const kmp_ref opposite = kmp_mul(g, kmp_const(g, OPPOSITE), kmp_sqrt(g, sizes));
    kmp_tree_end(p->tree, &p->rope->places[1], SIDE_ENDS, kmp_add(g, kmp_vec_dot(g, from[0], from[1]), opposite),
                 "its neighbours are opposite each other, and the shorter way would jump to the other side",
                 "rope '%s' lies over the middle of the sphere at '%s'", p->rope->name, name_of(p, 1));
}

static kmp_ref wrap_between(const path *p, int k, kmp_vec in, kmp_vec out)
{
    kmp_graph *g = p->tree->graph;
    const kmp_rope_place *place = &p->rope->places[k];
    const kmp_ref change = turned_from(p, k, in, out, place->turn * place->wrap);
    const kmp_ref wrap = kmp_add(g, kmp_const(g, place->wrap), place->turn > 0 ? change : kmp_neg(change));
    if (place->ball)
        end_side(p);
    if (place->leaves)
        return wrap;
    kmp_tree_end(p->tree, place, numbered(p, WRAP_ENDS), where_it_holds(p, kmp_sub(g, wrap, kmp_const(g, LEAST_WRAP))),
                 "from here on it would be straight", "rope '%s' leaves the sheave at '%s'", p->rope->name,
                 name_of(p, k));
    return wrap;
}

static kmp_ref wrap_at(const path *p, int k)
{
    return wrap_between(p, k, span_of(p, before(p, k)).along, span_of(p, k).along);
}

/* 1 where the rope is off the sheave that it may leave. */
static kmp_ref is_off(const path *p, int k)
{
    return kmp_tree_condition(p->tree, &p->rope->places[k], OFF, wrap_at(p, k), 0, NULL, "rope '%s' is off '%s'",
                              p->rope->name, name_of(p, k));
}

/* A value of the part of a path: with all sheaves, or without the one that it has left. */
static kmp_ref on_part(const kmp_tree *tree, const kmp_rope *rope, int place,
                       kmp_ref (*value)(const path *p, int place))
{
    kmp_graph *g = tree->graph;
    const int k = kmp_rope_leaving(rope);
    path whole = path_of(tree, rope);
    if (k < 0)
        return value(&whole, place);
    const kmp_ref off = is_off(&whole, k);
    path straight = whole;
    straight.without = k;
    straight.holds = off;
    whole.holds = kmp_sub(g, KMP_ONE, off);
    const kmp_ref without = place == k ? KMP_ZERO : value(&straight, place);
    return kmp_select(g, off, without, value(&whole, place));
}

/* The sum of a value over the parts of a path (-1), or the value of a place. */
static kmp_ref on_path(const kmp_tree *tree, const kmp_rope *rope, int place,
                       kmp_ref (*value)(const path *p, int place))
{
    kmp_ref sum = KMP_ZERO;
    kmp_rope part;
    for (int from = 0, first = 0; kmp_rope_part(rope, &first, &part); from = first)
        if (!rope->parts || place < 0 || (place > from && place < first))
            sum = kmp_add(tree->graph, sum, on_part(tree, &part, place < 0 ? place : place - from, value));
    return sum;
}

kmp_ref kmp_rope_wrap(const kmp_tree *tree, const kmp_rope *rope, int place)
{
    return on_path(tree, rope, place, wrap_at);
}

/* Angle that the body has turned to the left, less what the direction of the span has turned: both against the carrier,
 * the second one since the start. */
static kmp_ref turned_against_span(const path *p, int k, kmp_vec along)
{
    const kmp_tree *tree = p->tree;
    kmp_graph *g = tree->graph;
    const kmp_rope_place *place = &p->rope->places[k];
    kmp_vec start;
    for (int i = 0; i < 3; i++)
        start.x[i] = kmp_const(g, place->toward[i]);
    start = kmp_body_vector(tree, place->carrier, start);
    start = kmp_link_direction(tree, tree->mounts[place->carrier].link, start, p->link);
    kmp_ref angle = kmp_neg(turned_from(p, k, start, along, 0));
    for (int i = 0; i < place->turning_count; i++) {
        const kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)place->turning[i].motion);
        angle = kmp_add(g, angle, place->turning[i].sense > 0 ? q : kmp_neg(q));
    }
    const int carrier = tree->mounts[place->carrier].link;
    return kmp_add(g, angle, kmp_virtual_turn(tree, kmp_point_link(tree, place->point), carrier, p->link, p->axis));
}

/* Rim of one radius that has turned to the left against the span. */
static kmp_ref rolled(const path *p, int k, kmp_vec along)
{
    return kmp_mul(p->tree->graph, signed_radius(p, k), turned_against_span(p, k, along));
}

/* -- drums with layers --------------------------------------------------------------------------------- */

/* On a drum the radius r is by straight lines over the wound angle w. The length on it is the integral of r, and the
 * span leaves the circle of the radius r(w). w has the angle of the span, which depends on r: so r has the w of a
 * rougher path, whose radius is by a still rougher one. The roughest path has the radius at the start. Each of them
 * has an error smaller than the next one by dr/dw over the span. The moment of the tension is T r(w) but for that. */

/* The span that the drum at an end pays out or winds up. */
static kmp_vec paying_span(const path *p, int k)
{
    return span_of(p, k > 0 ? before(p, k) : 0).along;
}

static kmp_ref wound_on(const path *p, int k)
{
    kmp_graph *g = p->tree->graph;
    const kmp_rope_place *place = &p->rope->places[k];
    const kmp_ref angle = turned_against_span(p, k, paying_span(p, k));
    const bool winds_left = (place->turn > 0) == (k > 0);
    return kmp_add(g, kmp_const(g, place->wound), winds_left ? angle : kmp_neg(angle));
}

/* Runs end where the drum has no rope, or more than the table says. */
static void end_layers(const path *p, int place, const kmp_table *t, kmp_ref wound)
{
    kmp_graph *g = p->tree->graph;
    const kmp_rope_place *own = &p->rope->places[place];
    const int last = t->count - 1;
    kmp_tree_end(p->tree, own, LAYERS, kmp_sub(g, wound, kmp_const(g, t->x[0])), "its table begins there",
                 "rope '%s' has come to %.6g rad on drum '%s'", p->rope->name, t->x[0], name_of(p, place));
    kmp_tree_end(p->tree, own, LAYERS + last, kmp_sub(g, kmp_const(g, t->x[last]), wound), "its table ends there",
                 "rope '%s' has come to %.6g rad on drum '%s'", p->rope->name, t->x[last], name_of(p, place));
}

/* max(of - w_k, 0) at a point of the table, by the condition of w - w_k: the slope of r changes there. Rougher paths
 * have small kinks, which are passed. */
static kmp_ref beyond_point(const path *p, int place, int k, kmp_ref wound, kmp_ref of)
{
    kmp_graph *g = p->tree->graph;
    const kmp_rope_place *own = &p->rope->places[place];
    const double at = own->layers->table->x[k];
    const kmp_ref beyond = kmp_sub(g, of, kmp_const(g, at));
    if (p->rough > 0)
        return kmp_binary(g, KMP_OP_MAX, beyond, KMP_ZERO);
    const kmp_ref less =
        kmp_tree_condition(p->tree, own, LAYERS + k, kmp_sub(g, wound, kmp_const(g, at)), 0, NULL,
                           "rope '%s' has less than %.6g rad on drum '%s'", p->rope->name, at, name_of(p, place));
    return kmp_select(g, less, KMP_ZERO, beyond);
}

/* w of the radius, by the rougher path. */
static kmp_ref rougher_wound(const path *p, int place)
{
    path rougher = *p;
    rougher.rough++;
    return wound_on(&rougher, place);
}

static kmp_ref layer_radius(const path *p, int place)
{
    kmp_graph *g = p->tree->graph;
    const kmp_table *t = p->rope->places[place].layers->table;
    if (p->rough == ROUGHEST)
        return kmp_const(g, p->rope->places[place].radius.value);
    const kmp_ref wound = rougher_wound(p, place);
    if (p->rough == 0)
        end_layers(p, place, t, wound);
    kmp_ref sum = kmp_add(g, kmp_const(g, t->y[0]),
                          kmp_mul(g, kmp_const(g, t->piece[0][1]), kmp_sub(g, wound, kmp_const(g, t->x[0]))));
    for (int k = 1; k < t->count - 1; k++)
        sum = kmp_add(
            g, sum,
            kmp_mul(g, kmp_const(g, t->piece[k][1] - t->piece[k - 1][1]), beyond_point(p, place, k, wound, wound)));
    return sum;
}

/* The length of the rope on the drum, from the first point of the table on. */
static kmp_ref layer_length(const path *p, int place)
{
    kmp_graph *g = p->tree->graph;
    const kmp_table *t = p->rope->places[place].layers->table;
    const kmp_ref wound = wound_on(p, place), first = kmp_sub(g, wound, kmp_const(g, t->x[0]));
    kmp_ref sum = kmp_add(g, kmp_mul(g, kmp_const(g, t->y[0]), first),
                          kmp_mul(g, kmp_const(g, 0.5 * t->piece[0][1]), kmp_mul(g, first, first)));
    for (int k = 1; k < t->count - 1; k++) {
        const kmp_ref beyond = beyond_point(p, place, k, rougher_wound(p, place), wound);
        const double half = 0.5 * (t->piece[k][1] - t->piece[k - 1][1]);
        sum = kmp_add(g, sum, kmp_mul(g, kmp_const(g, half), kmp_mul(g, beyond, beyond)));
    }
    return sum;
}

/* -- lengths ------------------------------------------------------------------------------------------- */

/* The length up to the arrival at a place, or of the whole path (-1); of a helix across its axis. */
static kmp_ref length_across(const path *p, int place)
{
    kmp_graph *g = p->tree->graph;
    const kmp_rope *rope = p->rope;
    kmp_ref sum = KMP_ZERO;
    const int first = p->without == 0 ? 1 : 0;
    span in = rope->closed ? span_of(p, before(p, first)) : (span){0};
    for (int k = first, next; k != place; k = next) {
        next = after(p, k);
        if (!rope->closed && next == 0)
            break;
        const span own = span_of(p, k);
        if (kmp_rope_wraps(rope, k)) {
            const kmp_ref r = kmp_tree_number(p->tree, &rope->places[k].radius);
            sum = kmp_add(g, sum, kmp_mul(g, r, wrap_between(p, k, in.along, own.along)));
        }
        sum = kmp_add(g, sum, own.length);
        in = own;
        if (next == first)
            break;
    }
    return sum;
}

/* Along the axis, from the first place to the last one. */
static kmp_ref rise_of(const path *p)
{
    return kmp_vec_dot(p->tree->graph, p->axis, from_to(p, 0, p->rope->count - 1));
}

/* A helix on the cylinder and its tangents are a straight line where the cylinder is unrolled. */
static kmp_ref length_to(const path *p, int place)
{
    kmp_graph *g = p->tree->graph;
    const kmp_ref length = length_across(p, place);
    if (!is_helix(p))
        return length;
    const kmp_ref rise = rise_of(p);
    return kmp_sqrt(g, kmp_add(g, kmp_mul(g, length, length), kmp_mul(g, rise, rise)));
}

kmp_ref kmp_rope_length(const kmp_tree *tree, const kmp_rope *rope)
{
    return on_path(tree, rope, -1, length_to);
}

/* The length that the drum at an end has paid out, without its value at the start. */
static kmp_ref paid_by(const path *p, bool last)
{
    const int k = last ? p->rope->count - 1 : 0;
    if (!p->rope->places[k].drum)
        return KMP_ZERO;
    if (p->rope->places[k].layers)
        return kmp_neg(layer_length(p, k));
    const kmp_ref paid = rolled(p, k, paying_span(p, k));
    return last ? kmp_neg(paid) : paid;
}

static kmp_ref paid_on(const path *p, int unused)
{
    (void)unused;
    return kmp_add(p->tree->graph, paid_by(p, false), paid_by(p, true));
}

static kmp_ref paid(const kmp_tree *tree, const kmp_rope *rope)
{
    const bool drums = rope->places[0].drum || rope->places[rope->count - 1].drum;
    return drums ? on_path(tree, rope, -1, paid_on) : KMP_ZERO;
}

static kmp_ref slide_at(const path *p, int place)
{
    kmp_graph *g = p->tree->graph;
    const kmp_ref arrived = kmp_sub(g, length_to(p, place), paid_by(p, false));
    return kmp_add(g, arrived, rolled(p, place, span_of(p, before(p, place)).along));
}

kmp_ref kmp_rope_slide(const kmp_tree *tree, const kmp_rope *rope, int place)
{
    return on_path(tree, rope, place, slide_at);
}

/* -- the start ----------------------------------------------------------------------------------------- */

/* The free length of what has the length L at the start under the preload. */
static kmp_ref unloaded(const kmp_tree *tree, const kmp_rope *rope, kmp_ref length)
{
    kmp_graph *g = tree->graph;
    if (rope->preload.value == 0 && !rope->preload.expr)
        return length;
    const kmp_ref stretch = kmp_div(g, kmp_tree_number(tree, &rope->preload), kmp_tree_number(tree, &rope->stiffness));
    if (rope->axial && kmp_rope_is_belt(rope))
        return kmp_mul(g, length, kmp_sub(g, KMP_ONE, stretch));
    return rope->axial ? kmp_div(g, length, kmp_add(g, KMP_ONE, stretch)) : kmp_sub(g, length, stretch);
}

kmp_ref kmp_rope_free_length(const kmp_tree *tree, const kmp_rope *rope)
{
    kmp_graph *g = tree->graph;
    const kmp_ref now = paid(tree, rope);
    if (rope->length && now == KMP_ZERO)
        return kmp_tree_expression(tree, rope->length);
    kmp_ref start[2] = {KMP_ZERO, KMP_ZERO};
    /* Two values at the start: the length, and what was paid out then. */
    kmp_tree plain = {0};
    if (kmp_tree_init(&plain, tree->graph, tree->model, tree->keep, false)) {
        start[0] = kmp_rope_length(&plain, rope);
        start[1] = paid(&plain, rope);
        kmp_put_start(&plain, tree, 2, start);
    } else {
        kmp_graph_fail(tree->graph);
    }
    kmp_tree_free(&plain);
    const kmp_ref length = rope->length ? kmp_tree_expression(tree, rope->length) : unloaded(tree, rope, start[0]);
    return kmp_add(g, length, kmp_sub(g, now, start[1]));
}

kmp_ref kmp_rope_tension(const kmp_tree *tree, const kmp_rope *rope)
{
    const int force = kmp_name_find(KMP_NAMED(tree->model, force), rope->name);
    if (rope->kind == KMP_ROPE_ELASTIC)
        return kmp_bearing_load_measure(tree, KMP_MEASURE_NORMAL, rope->name);
    if (rope->kind == KMP_ROPE_LAW)
        return force < 0 ? KMP_ZERO : kmp_neg(kmp_tree_expression(tree, tree->model->forces[force].effort));
    return kmp_tree_multiplier(tree, kmp_name_find(KMP_NAMED(tree->model, closure), rope->name), 0);
}

/* -- ends ---------------------------------------------------------------------------------------------- */

/* On the path with all sheaves or without one. The rim of a drum is to the right of a rope that turns left. */
static void end_on(const path *p, bool last, kmp_vec *place, kmp_vec *along)
{
    kmp_graph *g = p->tree->graph;
    const int k = last ? p->rope->count - 1 : 0;
    kmp_vec out = span_of(p, last ? before(p, k) : 0).along;
    if (is_helix(p)) {
        const kmp_ref over = kmp_div(g, KMP_ONE, length_to(p, -1));
        out = kmp_vec_scale(
            g, over,
            kmp_vec_add(g, kmp_vec_scale(g, length_across(p, -1), out), kmp_vec_scale(g, rise_of(p), p->axis)));
    }
    *along = kmp_link_direction(p->tree, p->link, last ? kmp_vec_sub(g, kmp_vec_zero(), out) : out, 0);
    *place = kmp_point_position(p->tree, p->rope->places[k].point, 0);
    if (p->rope->places[k].turn == 0)
        return;
    const kmp_vec rim = kmp_vec_scale(g, kmp_neg(signed_radius(p, k)), kmp_vec_cross(g, p->axis, out));
    *place = kmp_vec_add(g, *place, kmp_link_direction(p->tree, p->link, rim, 0));
}

void kmp_rope_end(const kmp_tree *tree, const kmp_rope *rope, bool last, kmp_vec *place, kmp_vec *along)
{
    kmp_rope part = *rope;
    for (int first = 0; kmp_rope_part(rope, &first, &part) && last;)
        ;
    const int k = kmp_rope_leaving(&part);
    path whole = path_of(tree, &part);
    kmp_vec other[2];
    end_on(&whole, last, place, along);
    if (k < 0)
        return;
    const kmp_ref off = is_off(&whole, k);
    whole.without = k;
    end_on(&whole, last, &other[0], &other[1]);
    for (int i = 0; i < 3; i++) {
        place->x[i] = kmp_select(tree->graph, off, other[0].x[i], place->x[i]);
        along->x[i] = kmp_select(tree->graph, off, other[1].x[i], along->x[i]);
    }
}

/* True for the friction of the rope on one of its sheaves: ROPE_friction, ROPE_friction_2 and so on. */
static bool is_friction_of(const kmp_force *force, const kmp_rope *rope)
{
    const size_t length = strlen(rope->name), word = strlen("_friction");
    return force->kind == KMP_FORCE_FRICTION && strncmp(force->name, rope->name, length) == 0 &&
           strncmp(force->name + length, "_friction", word) == 0 &&
           (force->name[length + word] == '\0' || force->name[length + word] == '_');
}

kmp_ref kmp_rope_end_tension(const kmp_tree *tree, const kmp_rope *rope, bool last)
{
    const kempe_model *model = tree->model;
    kmp_ref tension = kmp_rope_tension(tree, rope);
    for (int k = 0; k < model->force_count && !last; k++)
        if (is_friction_of(&model->forces[k], rope))
            tension = kmp_sub(tree->graph, tension, kmp_tree_multiplier(tree, model->forces[k].closure, 0));
    return tension;
}
