/* SPDX-License-Identifier: BSD-3-Clause */
/* The paths of the pitch points of gear wheels are r phi, where phi is the rotation of a wheel against the carrier. F
 * is the force along the path on the second wheel. Teeth add forces that do no work on rigid axes: with the pressure
 * angle alpha in the normal section and the helix angle beta, |F| tan(alpha)/cos(beta) apart, and F tan(beta) along the
 * axes; of a worm with its lead angle in place of beta, and around the worm. Of bevel gears |F| tan(alpha) is normal to
 * both pitch cones. */
#include "dynamics/kinematics/gear_mesh.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/touching.h"
#include "dynamics/kinematics/tree_start.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"
#include "symbolic/substitute.h"
#include <math.h>
#include <string.h>

/* -- the wheels in the axes of the carrier ------------------------------------------------------------- */

static int link_of(const kmp_tree *tree, const kmp_gear *gear, int side)
{
    return gear->centre[side] >= 0 ? kmp_point_link(tree, gear->centre[side]) : tree->mounts[gear->wheel[side]].link;
}

/* A vector of an ancestor's axes in the axes of the carrier. */
static kmp_vec in_carrier(const kmp_tree *tree, const kmp_gear *gear, int ancestor, kmp_vec v)
{
    v = kmp_from_ancestor(tree, tree->mounts[gear->carrier].link, ancestor, v);
    return kmp_body_vector_back(tree, gear->carrier, v);
}

enum { ALONG = 6 }; /* virtual displacements of a joint, which displace no axis */

/* Centres and axes where all coordinates of the pair are zero. */
static void find_wheels(const kmp_tree *tree, const kmp_closure *closure, kmp_gear_mesh *mesh)
{
    kmp_graph *g = tree->graph;
    const kmp_gear *gear = closure->gear;
    const int carrier = tree->mounts[gear->carrier].link;
    const int top =
        kmp_tree_common(tree, kmp_tree_common(tree, link_of(tree, gear, 0), link_of(tree, gear, 1)), carrier);
    const kmp_vec origin = kmp_link_position(tree, carrier, kmp_vec_zero(), top);
    const int count = closure->term_count + ALONG;
    kmp_ref *from = KMP_GRAPH_NEW(g, kmp_ref, count), *none = KMP_GRAPH_NEW(g, kmp_ref, count);
    kmp_vec found[2][2]; /* centres, axes */
    uint16_t through;
    for (int side = 0; side < 2; side++) {
        const int turning = tree->of_motion[gear->axis[side]];
        const kmp_link *link = &tree->links[turning];
        const kmp_vec e = kmp_vec_axis(link->reversed ? kmp_neg(KMP_ONE) : KMP_ONE, link->axis);
        const int at = gear->centre[side];
        const kmp_vec own = at >= 0 ? kmp_point_local(tree, at) : tree->mounts[gear->wheel[side]].p;
        const kmp_vec centre = kmp_link_position(tree, link_of(tree, gear, side), own, top);
        found[0][side] = in_carrier(tree, gear, top, kmp_vec_sub(g, centre, origin));
        found[1][side] = in_carrier(tree, gear, top, kmp_link_direction(tree, turning, e, top));
    }
    for (int k = 0; from && none && k < count; k++) {
        from[k] = k < ALONG ? kmp_input(g, KMP_IN_ALONG, (uint32_t)k)
                            : kmp_input(g, KMP_IN_Q, (uint32_t)closure->terms[k - ALONG].motion);
        none[k] = KMP_ZERO;
    }
    if (!from || !none || !kmp_substitute(g, count, from, none, 12, found[0][0].x, &through))
        kmp_graph_fail(g);
    memcpy(mesh->centre, found[0], sizeof found[0]);
    memcpy(mesh->axis, found[1], sizeof found[1]);
}

/* -- numbers ------------------------------------------------------------------------------------------- */

static kmp_ref number(const kmp_tree *tree, const kmp_gear *gear, kmp_gear_number k)
{
    return kmp_tree_number(tree, &gear->number[k]);
}

static kmp_ref tangent(kmp_graph *g, kmp_ref angle)
{
    return kmp_div(g, kmp_sin(g, angle), kmp_cos(g, angle));
}

/* Teeth, or radii: the sizes of the wheels to each other. */
static kmp_ref size_of(const kmp_tree *tree, const kmp_gear *gear, int side)
{
    return gear->teeth[side] > 0 ? kmp_const(tree->graph, gear->teeth[side])
                                 : number(tree, gear, (kmp_gear_number)(KMP_GEAR_RADIUS_1 + side));
}

static kmp_vec without(kmp_graph *g, kmp_vec v, kmp_vec axis)
{
    return kmp_vec_sub(g, v, kmp_vec_scale(g, kmp_vec_dot(g, v, axis), axis));
}

/* Splits v into its length and a unit vector. */
static kmp_ref split(kmp_graph *g, kmp_vec v, kmp_vec *unit)
{
    const kmp_ref length = kmp_sqrt(g, kmp_vec_dot(g, v, v));
    *unit = kmp_vec_scale(g, kmp_div(g, KMP_ONE, length), v);
    return length;
}

static kmp_vec from_first(kmp_graph *g, const kmp_gear_mesh *mesh)
{
    return kmp_vec_sub(g, mesh->centre[1], mesh->centre[0]);
}

/* -- the forms ----------------------------------------------------------------------------------------- */

/* Pitch point at a radius of the first wheel, and the directions there. */
static void put_pitch(kmp_graph *g, const kmp_gear *gear, kmp_vec radial, kmp_gear_mesh *mesh)
{
    mesh->pitch = kmp_vec_add(g, mesh->centre[0], kmp_vec_scale(g, mesh->radius[0], radial));
    mesh->along = kmp_vec_cross(g, mesh->axis[0], radial);
    mesh->tilted = kmp_vec_scale(g, gear->left ? KMP_ONE : kmp_neg(KMP_ONE), mesh->axis[0]);
    mesh->apart = gear->ring == 0 ? kmp_vec_sub(g, kmp_vec_zero(), radial) : radial;
}

/* Angles at the pitch circles that are in use: the circles of the module are larger or smaller. tan(beta) grows with
 * the radius, and the base circle r cos(alpha) is the same. */
static void put_angles(const kmp_tree *tree, const kmp_gear *gear, kmp_ref larger, kmp_gear_mesh *mesh)
{
    kmp_graph *g = tree->graph;
    const kmp_ref helix = number(tree, gear, KMP_GEAR_HELIX), normal = number(tree, gear, KMP_GEAR_PRESSURE);
    mesh->axial = gear->number[KMP_GEAR_HELIX].value != 0 ? tangent(g, helix) : KMP_ZERO;
    mesh->separating = kmp_div(g, tangent(g, normal), kmp_cos(g, helix));
    if (larger == KMP_ONE)
        return;
    const kmp_ref t = mesh->separating, square = kmp_add(g, KMP_ONE, kmp_mul(g, t, t)); /* 1/cos^2 */
    mesh->axial = kmp_mul(g, larger, mesh->axial);
    mesh->separating = kmp_sqrt(g, kmp_sub(g, kmp_mul(g, square, kmp_mul(g, larger, larger)), KMP_ONE));
}

static void put_parallel(const kmp_tree *tree, const kmp_gear *gear, kmp_gear_mesh *mesh)
{
    kmp_graph *g = tree->graph;
    const kmp_ref size[2] = {size_of(tree, gear, 0), size_of(tree, gear, 1)};
    kmp_vec radial;
    mesh->distance = split(g, without(g, from_first(g, mesh), mesh->axis[0]), &radial);
    const kmp_ref all = !gear->internal   ? kmp_add(g, size[0], size[1])
                        : gear->ring == 1 ? kmp_sub(g, size[1], size[0])
                                          : kmp_sub(g, size[0], size[1]);
    for (int k = 0; k < 2; k++)
        mesh->radius[k] = kmp_mul(g, mesh->distance, kmp_div(g, size[k], all));
    if (gear->ring == 1)
        radial = kmp_vec_sub(g, kmp_vec_zero(), radial);
    put_pitch(g, gear, radial, mesh);
    kmp_ref larger = KMP_ONE;
    if (kmp_gear_has(gear, KMP_GEAR_MODULE)) {
        const kmp_ref half = kmp_mul(g, kmp_const(g, 0.5), number(tree, gear, KMP_GEAR_MODULE));
        const kmp_ref of_module = kmp_div(g, kmp_mul(g, half, all), kmp_cos(g, number(tree, gear, KMP_GEAR_HELIX)));
        larger = kmp_div(g, mesh->distance, of_module);
    }
    put_angles(tree, gear, larger, mesh);
}

static void put_rack(const kmp_tree *tree, const kmp_gear *gear, kmp_gear_mesh *mesh)
{
    kmp_graph *g = tree->graph;
    kmp_vec radial;
    mesh->distance = split(g, without(g, without(g, from_first(g, mesh), mesh->axis[0]), mesh->axis[1]), &radial);
    mesh->radius[0] = number(tree, gear, KMP_GEAR_RADIUS_1);
    if (gear->teeth[0] > 0)
        mesh->radius[0] = kmp_div(g, kmp_mul(g, kmp_const(g, gear->teeth[0] / 2), number(tree, gear, KMP_GEAR_MODULE)),
                                  kmp_cos(g, number(tree, gear, KMP_GEAR_HELIX)));
    mesh->radius[1] = KMP_ZERO;
    put_pitch(g, gear, radial, mesh);
    put_angles(tree, gear, KMP_ONE, mesh);
    mesh->lever[1] = KMP_ONE;
}

/* With the axes e_k from the apex: sin(d1)/sin(d2) = z1/z2, and both cone angles add up to the angle of the axes. */
static void put_bevel(const kmp_tree *tree, const kmp_gear *gear, kmp_gear_mesh *mesh)
{
    kmp_graph *g = tree->graph;
    const kmp_ref size[2] = {size_of(tree, gear, 0), size_of(tree, gear, 1)};
    kmp_vec e[2], radial;
    for (int k = 0; k < 2; k++)
        e[k] = gear->outwards[k] > 0 ? mesh->axis[k] : kmp_vec_sub(g, kmp_vec_zero(), mesh->axis[k]);
    const kmp_ref cosine = kmp_vec_dot(g, e[0], e[1]);
    const kmp_ref sine = split(g, without(g, e[1], e[0]), &radial);
    /* The cone of the first wheel: tan(d1) = z1 sin/(z2 + z1 cos). */
    kmp_ref up = kmp_mul(g, size[0], sine), out = kmp_add(g, size[1], kmp_mul(g, size[0], cosine));
    const kmp_ref both = kmp_sqrt(g, kmp_add(g, kmp_mul(g, up, up), kmp_mul(g, out, out)));
    up = kmp_div(g, up, both);
    out = kmp_div(g, out, both);
    /* From the apex to the first centre, along e1. */
    const kmp_vec d = from_first(g, mesh);
    const kmp_ref ahead = kmp_sub(g, kmp_mul(g, cosine, kmp_vec_dot(g, d, e[1])), kmp_vec_dot(g, d, e[0]));
    const kmp_ref deep = kmp_div(g, ahead, kmp_mul(g, sine, sine));
    const kmp_vec apex = kmp_vec_sub(g, mesh->centre[0], kmp_vec_scale(g, deep, e[0]));
    kmp_ref radius = kmp_div(g, kmp_mul(g, deep, up), out);
    if (gear->teeth[0] == 0)
        radius = size[0];
    else if (kmp_gear_has(gear, KMP_GEAR_MODULE))
        radius = kmp_mul(g, kmp_const(g, gear->teeth[0] / 2), number(tree, gear, KMP_GEAR_MODULE));
    mesh->radius[0] = radius;
    mesh->radius[1] = kmp_mul(g, radius, kmp_div(g, size[1], size[0]));
    mesh->distance = KMP_ZERO;
    const kmp_vec cone = kmp_vec_add(g, kmp_vec_scale(g, out, e[0]), kmp_vec_scale(g, up, radial));
    mesh->pitch = kmp_vec_add(g, apex, kmp_vec_scale(g, kmp_div(g, radius, up), cone));
    mesh->along = kmp_vec_cross(g, mesh->axis[0], radial);
    mesh->tilted = kmp_vec_zero();
    mesh->axial = KMP_ZERO;
    mesh->apart = kmp_vec_sub(g, kmp_vec_scale(g, out, radial), kmp_vec_scale(g, up, e[0]));
    mesh->separating = tangent(g, number(tree, gear, KMP_GEAR_PRESSURE));
}

/* r1 tan(lead) z2 = z1 r2, and r1 + r2 is the distance. */
static void put_worm(const kmp_tree *tree, const kmp_gear *gear, kmp_gear_mesh *mesh)
{
    kmp_graph *g = tree->graph;
    const kmp_vec d = from_first(g, mesh);
    const kmp_ref ratio = kmp_const(g, gear->teeth[1] / gear->teeth[0]);
    kmp_vec radial;
    kmp_ref lead;
    mesh->distance = split(g, without(g, without(g, d, mesh->axis[0]), mesh->axis[1]), &radial);
    if (kmp_gear_has(gear, KMP_GEAR_LEAD)) {
        lead = tangent(g, number(tree, gear, KMP_GEAR_LEAD));
        mesh->radius[0] = kmp_div(g, mesh->distance, kmp_add(g, KMP_ONE, kmp_mul(g, ratio, lead)));
        mesh->radius[1] = kmp_sub(g, mesh->distance, mesh->radius[0]);
    } else {
        mesh->radius[1] = kmp_mul(g, kmp_const(g, gear->teeth[1] / 2), number(tree, gear, KMP_GEAR_MODULE));
        mesh->radius[0] = kmp_sub(g, mesh->distance, mesh->radius[1]);
        lead = kmp_div(g, mesh->radius[1], kmp_mul(g, ratio, mesh->radius[0]));
    }
    const kmp_ref foot = kmp_vec_dot(g, d, mesh->axis[0]);
    const kmp_vec at = kmp_vec_add(g, mesh->centre[0], kmp_vec_scale(g, foot, mesh->axis[0]));
    mesh->pitch = kmp_vec_add(g, at, kmp_vec_scale(g, mesh->radius[0], radial));
    mesh->along = kmp_vec_scale(g, gear->left ? KMP_ONE : kmp_neg(KMP_ONE), mesh->axis[0]);
    mesh->tilted = kmp_vec_cross(g, mesh->axis[0], radial);
    mesh->axial = lead;
    mesh->apart = radial;
    mesh->separating = kmp_mul(g, tangent(g, number(tree, gear, KMP_GEAR_PRESSURE)),
                               kmp_sqrt(g, kmp_add(g, KMP_ONE, kmp_mul(g, lead, lead))));
    mesh->lever[0] = kmp_div(g, mesh->radius[1], ratio);
}

kmp_gear_mesh kmp_gear_mesh_of(const kmp_tree *tree, const kmp_closure *closure)
{
    static void (*const put[])(const kmp_tree *, const kmp_gear *, kmp_gear_mesh *) = {put_parallel, put_bevel,
                                                                                       put_worm, put_rack};
    kmp_gear_mesh mesh = {0};
    find_wheels(tree, closure, &mesh);
    put[closure->gear->form](tree, closure->gear, &mesh);
    for (int k = 0; k < 2; k++)
        mesh.lever[k] = mesh.lever[k] == KMP_ZERO ? mesh.radius[k] : mesh.lever[k];
    return mesh;
}

/* -- paths --------------------------------------------------------------------------------------------- */

kmp_ref kmp_gear_path(const kmp_tree *tree, const kmp_closure *closure, int side)
{
    kmp_graph *g = tree->graph;
    const kmp_gear *gear = closure->gear;
    kmp_ref turned = KMP_ZERO;
    for (int k = side ? gear->first_count : 0; k < (side ? closure->term_count : gear->first_count); k++) {
        const kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)closure->terms[k].motion);
        turned = kmp_add(g, turned, closure->terms[k].factor.value > 0 ? q : kmp_neg(q));
    }
    turned = kmp_mul(g, kmp_gear_mesh_of(tree, closure).lever[side], turned);
    return side && gear->sense < 0 ? kmp_neg(turned) : turned;
}

kmp_ref kmp_gear_error(const kmp_tree *tree, const kmp_closure *closure)
{
    kmp_graph *g = tree->graph;
    const int count = closure->term_count;
    kmp_ref *q = KMP_GRAPH_NEW(g, kmp_ref, count), *start = KMP_GRAPH_NEW(g, kmp_ref, count);
    kmp_ref error = kmp_sub(g, kmp_gear_path(tree, closure, 0), kmp_gear_path(tree, closure, 1)), first = error;
    bool driven = false;
    if (!q || !start)
        return error;
    for (int k = 0; k < count; k++) {
        const int motion = closure->terms[k].motion;
        q[k] = kmp_input(g, KMP_IN_Q, (uint32_t)motion);
        start[k] = kmp_tree_number(tree, &tree->model->start.q[motion]);
        driven = driven || kmp_is_driven(tree->model, motion);
    }
    if (!driven)
        return kmp_sub(g, error, kmp_graph_replace(g, count, q, start, error));
    kmp_tree plain = {0};
    if (kmp_tree_init(&plain, g, tree->model, tree->keep, false))
        kmp_put_start(&plain, tree, 1, &first);
    else
        kmp_graph_fail(g);
    kmp_tree_free(&plain);
    return kmp_sub(g, error, first);
}

/* -- the force ----------------------------------------------------------------------------------------- */

static kmp_vec force_of(kmp_graph *g, const kmp_gear_mesh *mesh, kmp_ref lambda)
{
    kmp_vec f = kmp_vec_add(g, mesh->along, kmp_vec_scale(g, mesh->axial, mesh->tilted));
    f = kmp_vec_scale(g, lambda, f);
    const kmp_ref size = kmp_unary(g, KMP_OP_ABS, lambda);
    return kmp_vec_add(g, f, kmp_vec_scale(g, kmp_mul(g, mesh->separating, size), mesh->apart));
}

/* The normal force of a flank, a contact of the gear's name. */
static kmp_ref flank_force(const kmp_tree *tree, const kmp_closure *closure, const char *flank)
{
    const kempe_model *model = tree->model;
    char *name = kmp_arena_printf(kmp_graph_arena(tree->graph), "%s_%s", closure->name, flank);
    const int k = name ? kmp_name_find(KMP_NAMED(model, force), name) : -1;
    if (k < 0)
        return KMP_ZERO;
    return model->forces[k].kind == KMP_FORCE_TOUCH ? kmp_tree_multiplier(tree, model->forces[k].closure, 0)
                                                    : kmp_bearing_load_measure(tree, KMP_MEASURE_NORMAL, name);
}

kmp_ref kmp_gear_transmitted(const kmp_tree *tree, int c)
{
    const kmp_closure *closure = &tree->model->closures[c];
    if (closure->gear->rigid)
        return kmp_tree_multiplier(tree, c, 0);
    return kmp_sub(tree->graph, flank_force(tree, closure, "front"), flank_force(tree, closure, "back"));
}

void kmp_gear_force(const kmp_tree *tree, const kmp_closure *closure, kmp_ref lambda, int link, kmp_vec *force,
                    kmp_vec *place)
{
    const int carrier = closure->gear->carrier, own = tree->mounts[carrier].link;
    const kmp_gear_mesh mesh = kmp_gear_mesh_of(tree, closure);
    const kmp_vec f = kmp_body_vector(tree, carrier, force_of(tree->graph, &mesh, lambda));
    *force = kmp_link_direction(tree, own, f, link);
    *place = kmp_link_position(tree, own, kmp_body_vector(tree, carrier, mesh.pitch), link);
}

/* -- numbers of a mesh --------------------------------------------------------------------------------- */

static void value_of(const kmp_graph *g, kmp_vec v, double out[3])
{
    for (int k = 0; k < 3; k++)
        if (!kmp_is_const(g, v.x[k], &out[k]))
            out[k] = NAN;
}

bool kmp_gear_numbers_of(const kempe_model *model, const kmp_closure *closure, kmp_gear_numbers *numbers)
{
    kmp_graph *g = kmp_graph_new();
    kmp_tree tree;
    if (!g)
        return false;
    memset(&tree, 0, sizeof tree);
    if (kmp_tree_init(&tree, g, model, KMP_KEEP_NOTHING, false)) {
        const kmp_gear_mesh mesh = kmp_gear_mesh_of(&tree, closure);
        const kmp_vec origin =
            kmp_body_vector_back(&tree, closure->gear->carrier, tree.mounts[closure->gear->carrier].p);
        const kmp_vec size = {{mesh.radius[0], mesh.radius[1], mesh.distance}};
        double sizes[3];
        for (int side = 0; side < 2; side++) {
            value_of(g, kmp_vec_sub(g, mesh.centre[side], origin), numbers->centre[side]);
            value_of(g, mesh.axis[side], numbers->axis[side]);
        }
        value_of(g, kmp_vec_sub(g, mesh.pitch, origin), numbers->pitch);
        value_of(g, mesh.along, numbers->along);
        value_of(g, force_of(g, &mesh, KMP_ONE), numbers->force);
        value_of(g, size, sizes);
        numbers->radius[0] = sizes[0];
        numbers->radius[1] = sizes[1];
        numbers->distance = sizes[2];
    }
    const bool good = !kmp_graph_failed(g);
    kmp_tree_free(&tree);
    kmp_graph_free(g);
    return good;
}
