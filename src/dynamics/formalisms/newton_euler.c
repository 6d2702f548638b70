/* SPDX-License-Identifier: BSD-3-Clause */
/* All quantities of link i are in its own axes. p_z^{hi} is the joint's offset p plus, for a translation, its slide.
 * Applied forces enter with their moment about the link's origin instead of the centre of mass. */
#include "dynamics/formalisms/newton_euler.h"
#include "dynamics/formalisms/flexible_body.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"
#include "model/data/flexible.h"
#include "model/data/state.h"
#include "symbolic/graph.h"
#include "symbolic/label.h"

/* -- names ------------------------------------------------------------------------------------------- */

/* Names of quantities in printed equations: ROBOTRAN's names where it has them, an entry's number and then the link's.
 * Numbers in parentheses are equations of Fisette and Samin 1996. */
static const kmp_quantity_label name_rate = {"OM", "angular velocity, (11)"};
static const kmp_quantity_label name_acceleration = {"OMp", "angular acceleration, (12)"};
static const kmp_quantity_label name_beta = {"BS", "angular acceleration and centripetal terms as a matrix, (13)"};
static const kmp_quantity_label name_linear = {"AlF", "acceleration of the origin less gravity, (14)"};
static const kmp_quantity_label name_force = {"FF", "force of the joint, (25)"};
static const kmp_quantity_label name_moment = {"CF", "moment of the joint, (27)"};
static const kmp_quantity_label name_column_rate = {"OpM", "angular acceleration per qdd, (22)"};
static const kmp_quantity_label name_column_linear = {"AlM", "acceleration of the origin per qdd, (23)"};
static const kmp_quantity_label name_column_force = {"FM", "force of the joint per qdd, (35)"};
static const kmp_quantity_label name_column_moment = {"CM", "moment of the joint per qdd, (36)"};
static const kmp_quantity_label name_mass = {"mC", "mass of what the joint carries"};
static const kmp_quantity_label name_first = {"lC", "first moment of what the joint carries"};
static const kmp_quantity_label name_second = {"IC", "inertia of what the joint carries about its origin"};

/* column 0: none. */
static void name_entry(kmp_graph *g, const kmp_quantity_label *quantity, kmp_ref r, int entry, int link, int column)
{
    kmp_graph_label(g, r, (kmp_label){.quantity = quantity, .entry = entry, .link = link, .column = column});
}

static void name_vector(kmp_graph *g, const kmp_quantity_label *quantity, kmp_vec v, int link, int column)
{
    for (int k = 0; k < 3 && kmp_graph_has_labels(g); k++)
        name_entry(g, quantity, v.x[k], k + 1, link, column);
}

/* (13) */
static void set_beta(kmp_graph *g, kmp_link_motion *m)
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        kmp_ref wj = m->w.x[j], wk = m->w.x[k];
        m->beta.x[i][i] = kmp_neg(kmp_add(g, kmp_mul(g, wj, wj), kmp_mul(g, wk, wk)));
        kmp_ref ww = kmp_mul(g, m->w.x[i], wj);
        m->beta.x[i][j] = kmp_sub(g, ww, m->wd.x[k]);
        m->beta.x[j][i] = kmp_add(g, ww, m->wd.x[k]);
    }
}

static kmp_ref signed_for(const kmp_link *link, kmp_ref r)
{
    return link->reversed ? kmp_neg(r) : r;
}

/* The acceleration of link i's motion by the accelerations of the coordinates, signed like q; without its part at
 * constant rates. */
static kmp_ref own_acceleration(const kmp_tree *tree, int i, const kmp_ref *qdd)
{
    const kmp_link *link = &tree->links[i];
    kmp_ref sum = KMP_ZERO;
    if (link->motion >= 0)
        return qdd[link->motion];
    for (int k = 0; link->guide && k < link->guide->count; k++)
        sum = kmp_add(tree->graph, sum, kmp_mul(tree->graph, link->guide->slope[k], qdd[link->guide->first + k]));
    return sum;
}

/* Recursion (11)-(14) from link h to i, with the acceleration of its motion. */
static void forward(const kmp_tree *tree, int i, kmp_ref own, kmp_link_motion *m)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    const kmp_link_motion *h = &m[link->parent];
    kmp_link_motion *mi = &m[i];
    kmp_ref acceleration = link->guide ? kmp_add(g, own, link->guide->curve) : signed_for(link, own);
    kmp_vec rate = kmp_vec_axis(link->qd, link->axis);
    mi->w = kmp_link_to_child(tree, i, h->w);
    mi->wd = kmp_link_to_child(tree, i, h->wd);
    mi->alpha = kmp_link_to_child(tree, i, kmp_vec_add(g, h->alpha, kmp_matrix_apply(g, &h->beta, false, link->p)));
    if (link->rotation) {
        mi->w = kmp_vec_add(g, mi->w, rate);                            /* (11) */
        mi->wd = kmp_vec_add(g, mi->wd, kmp_vec_cross(g, mi->w, rate)); /* (12) */
        mi->wd.x[link->axis] = kmp_add(g, mi->wd.x[link->axis], acceleration);
        set_beta(g, mi);
        return;
    }
    set_beta(g, mi);
    kmp_vec coriolis = kmp_vec_cross(g, mi->w, kmp_vec_scale(g, kmp_const(g, 2), rate));
    mi->alpha = kmp_vec_add(g, mi->alpha, kmp_matrix_apply(g, &mi->beta, false, kmp_link_slide(tree, i))); /* (14) */
    mi->alpha = kmp_vec_add(g, mi->alpha, coriolis);
    mi->alpha.x[link->axis] = kmp_add(g, mi->alpha.x[link->axis], acceleration);
}

/* I wd + w x (I w), written with beta, whose products of rates exist already:
 *
 *     x: Ixx wd_x + (Izz - Iyy) wy wz - Ixy beta_zx + Ixz beta_yx + Iyz (wy^2 - wz^2), and cyclically. */
static kmp_vec gyroscopic(kmp_graph *g, kmp_tensor inertia, const kmp_link_motion *m)
{
    kmp_vec r;
    for (int x = 0; x < 3; x++) {
        int y = (x + 1) % 3, z = (x + 2) % 3;
        kmp_ref wy = m->w.x[y], wz = m->w.x[z];
        kmp_ref xy = inertia.x[kmp_tensor_at[x][y]], xz = inertia.x[kmp_tensor_at[x][z]];
        kmp_ref squares = kmp_sub(g, kmp_mul(g, wy, wy), kmp_mul(g, wz, wz));
        kmp_ref difference = kmp_sub(g, inertia.x[z], inertia.x[y]);
        kmp_ref sum = kmp_add(g, kmp_mul(g, inertia.x[x], m->wd.x[x]), kmp_mul(g, difference, kmp_mul(g, wy, wz)));
        sum = kmp_sub(g, sum, kmp_mul(g, xy, m->beta.x[z][x]));
        sum = kmp_add(g, sum, kmp_mul(g, xz, m->beta.x[y][x]));
        r.x[x] = kmp_add(g, sum, kmp_mul(g, inertia.x[kmp_tensor_at[y][z]], squares));
    }
    return r;
}

/* m alpha + beta b and b x alpha + I wd + w x (I w), about the origin of the link. */
static kmp_wrench composite_wrench(kmp_graph *g, const kmp_composite *own, const kmp_link_motion *m)
{
    kmp_wrench w;
    w.force = kmp_vec_add(g, kmp_vec_scale(g, own->mass, m->alpha), kmp_matrix_apply(g, &m->beta, false, own->moment));
    w.moment = kmp_vec_add(g, kmp_vec_cross(g, own->moment, m->alpha), gyroscopic(g, own->inertia, m));
    return w;
}

/* The link's own share of (25) and (27): with f = m (alpha + beta l) - F and l x f. Or by the first moment b = m l and
 * the second moments about the origin, with f = m alpha + beta b - F and b x alpha - l x F. */
static void body_wrench(const kmp_tree *tree, int i, const kmp_link_motion *m, const kmp_wrench *applied, kmp_wrench *w)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    kmp_vec f, moment;
    if (link->about) {
        const kmp_wrench inertial = composite_wrench(g, &link->own, m);
        f = inertial.force;
        moment = inertial.moment;
        moment = kmp_vec_sub(g, moment, kmp_vec_cross(g, link->com, link->push));
    } else {
        f = kmp_vec_scale(g, link->mass, kmp_vec_add(g, m->alpha, kmp_matrix_apply(g, &m->beta, false, link->com)));
        moment = kmp_vec_cross(g, link->com, kmp_vec_sub(g, f, link->push));
        moment = kmp_vec_add(g, moment, gyroscopic(g, link->inertia, m));
    }
    f = kmp_vec_sub(g, f, link->push);
    moment = kmp_vec_sub(g, moment, link->twist);
    w->force = kmp_vec_add(g, w->force, kmp_vec_sub(g, f, applied->force));
    w->moment = kmp_vec_add(g, w->moment, kmp_vec_sub(g, moment, applied->moment));
}

void kmp_wrench_to_parent(const kmp_tree *tree, int i, kmp_wrench w, kmp_wrench *parent)
{
    kmp_graph *g = tree->graph;
    w.moment = kmp_vec_add(g, w.moment, kmp_vec_cross(g, kmp_link_slide(tree, i), w.force));
    kmp_vec force = kmp_link_to_parent(tree, i, w.force);
    parent->force = kmp_vec_add(g, parent->force, force);
    kmp_vec moment = kmp_vec_cross(g, tree->links[i].p, force);
    moment = kmp_vec_add(g, kmp_link_to_parent(tree, i, w.moment), moment);
    parent->moment = kmp_vec_add(g, parent->moment, moment);
}

/* (37), (38): the component along the joint's motion, signed like q. */
kmp_ref kmp_wrench_project(const kmp_link *link, kmp_wrench *w)
{
    return signed_for(link, *kmp_wrench_along(link, w));
}

/* x of link i's coordinate, with the armature's part for an acceleration. */
static kmp_ref with_armature(const kmp_tree *tree, int i, kmp_ref x, kmp_ref qdd)
{
    kmp_ref armature = tree->links[i].armature;
    return armature == KMP_ZERO ? x : kmp_add(tree->graph, x, kmp_mul(tree->graph, armature, qdd));
}

/* The force of link i's motion to its coordinate, or by its guide to the coordinates of a flexible body. */
static void to_coordinates(const kmp_tree *tree, int i, kmp_wrench *w, const kmp_ref *qdd, kmp_ref *effort)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    const kmp_ref along = kmp_wrench_project(link, w);
    if (link->motion >= 0)
        effort[link->motion] = with_armature(tree, i, along, qdd[link->motion]);
    for (int k = 0; link->guide && k < link->guide->count; k++) {
        kmp_ref *sum = &effort[link->guide->first + k];
        *sum = kmp_add(g, *sum, kmp_mul(g, link->guide->slope[k], along));
    }
}

/* The coordinates of flexible bodies have no force yet. */
static void clear_elastic(const kmp_tree *tree, kmp_ref *effort)
{
    for (int k = 0; k < kmp_model_motion_count(tree->model); k++)
        if (tree->of_motion[k] == 0)
            effort[k] = KMP_ZERO;
}

void kmp_newton_euler_shares(const kmp_tree *tree, const kmp_wrench *applied, kmp_wrench *share, kmp_ref *elastic)
{
    kmp_link_motion *m = KMP_GRAPH_NEW(tree->graph, kmp_link_motion, tree->count);
    if (!m)
        return;
    m[0].alpha = kmp_vec_sub(tree->graph, kmp_vec_zero(), tree->gravity);
    for (int i = 1; i < tree->count; i++) {
        share[i] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
        forward(tree, i, KMP_ZERO, m);
        body_wrench(tree, i, &m[i], &applied[i], &share[i]);
        if (tree->links[i].deformation)
            kmp_flexible_wrench(tree, tree->links[i].deformation, NULL, &m[i], &share[i], elastic);
    }
}

kmp_wrench kmp_newton_euler_part(const kmp_tree *tree, const kmp_deformation *part, const kmp_ref *qdd,
                                 const kmp_link_motion *m)
{
    kmp_wrench w = composite_wrench(tree->graph, &part->whole, m);
    kmp_ref *effort = KMP_GRAPH_NEW(tree->graph, kmp_ref, kmp_model_motion_count(tree->model));
    if (effort)
        kmp_flexible_wrench(tree, part, qdd, m, &w, effort);
    return w;
}

void kmp_newton_euler_whole(const kmp_tree *tree, const kmp_ref *qdd, const kmp_wrench *applied, kmp_link_motion *m,
                            kmp_wrench *w, kmp_ref *effort)
{
    m[0] = (kmp_link_motion){.alpha = kmp_vec_sub(tree->graph, kmp_vec_zero(), tree->gravity)};
    for (int i = 0; i < tree->count; i++)
        w[i] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    for (int i = 1; i < tree->count; i++) {
        forward(tree, i, own_acceleration(tree, i, qdd), m);
        name_vector(tree->graph, &name_rate, m[i].w, i, 0);
        name_vector(tree->graph, &name_acceleration, m[i].wd, i, 0);
        name_vector(tree->graph, &name_linear, m[i].alpha, i, 0);
        for (int k = 0; k < 9; k++)
            name_entry(tree->graph, &name_beta, m[i].beta.x[k / 3][k % 3], k + 1, i, 0);
    }
    clear_elastic(tree, effort);
    for (int i = 1; i < tree->count; i++) {
        body_wrench(tree, i, &m[i], &applied[i], &w[i]);
        if (tree->links[i].deformation)
            kmp_flexible_wrench(tree, tree->links[i].deformation, qdd, &m[i], &w[i], effort);
    }
    for (int i = tree->count - 1; i > 0; i--) {
        to_coordinates(tree, i, &w[i], qdd, effort);
        name_vector(tree->graph, &name_force, w[i].force, i, 0);
        name_vector(tree->graph, &name_moment, w[i].moment, i, 0);
        kmp_wrench_to_parent(tree, i, w[i], &w[tree->links[i].parent]);
    }
}

void kmp_newton_euler(const kmp_tree *tree, const kmp_ref *qdd, const kmp_wrench *applied, kmp_ref *effort)
{
    kmp_link_motion *m = KMP_GRAPH_NEW(tree->graph, kmp_link_motion, tree->count);
    kmp_wrench *w = KMP_GRAPH_NEW(tree->graph, kmp_wrench, tree->count);
    if (m && w)
        kmp_newton_euler_whole(tree, qdd, applied, m, w, effort);
}

/* -- M by columns ------------------------------------------------------------------------------------ */

/* (22), (23): the acceleration of a link at rest by given accelerations of the motions: by a unit one in a column of M.
 */
typedef struct column {
    kmp_vec o, a;
} column;

/* From the parent's, h, and the acceleration of the link's own motion. */
static column forward_column(const kmp_tree *tree, int i, kmp_ref acceleration, column h)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    kmp_vec own = kmp_vec_axis(signed_for(link, acceleration), link->axis);
    column c;
    c.o = kmp_link_to_child(tree, i, h.o);
    c.a = kmp_link_to_child(tree, i, kmp_vec_add(g, h.a, kmp_vec_cross(g, h.o, link->p)));
    c.a = kmp_vec_add(g, c.a, kmp_vec_cross(g, c.o, kmp_link_slide(tree, i)));
    if (link->rotation)
        c.o = kmp_vec_add(g, c.o, own);
    else
        c.a = kmp_vec_add(g, c.a, own);
    return c;
}

/* (34) and the body's own share of (35), (36). */
static kmp_wrench column_wrench(const kmp_tree *tree, int i, column c)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    kmp_wrench w;
    if (link->about) {
        const kmp_composite *own = &link->own;
        w.force = kmp_vec_add(g, kmp_vec_scale(g, own->mass, c.a), kmp_vec_cross(g, c.o, own->moment));
        w.moment = kmp_vec_add(g, kmp_vec_cross(g, own->moment, c.a), kmp_tensor_apply(g, own->inertia, c.o));
        return w;
    }
    w.force = kmp_vec_scale(g, link->mass, kmp_vec_add(g, c.a, kmp_vec_cross(g, c.o, link->com)));
    w.moment = kmp_vec_add(g, kmp_vec_cross(g, link->com, w.force), kmp_tensor_apply(g, link->inertia, c.o));
    return w;
}

/* One column: forward through the subtree of k, backward with the sums of (35), (36). Then to the ancestors, whose
 * entries M[k, h] equal M[h, k]. */
static void mass_column(const kmp_tree *tree, int k, column *c, kmp_wrench *w, kmp_ref *m)
{
    int n = kmp_model_motion_count(tree->model), of_k = tree->links[k].motion;
    const column still = {kmp_vec_zero(), kmp_vec_zero()};
    for (int i = k; i < tree->count; i++) {
        w[i] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
        if (kmp_tree_is_above(tree, k, i))
            c[i] = forward_column(tree, i, i == k ? KMP_ONE : KMP_ZERO, i == k ? still : c[tree->links[i].parent]);
    }
    for (int i = tree->count - 1; i >= k; i--) {
        if (!kmp_tree_is_above(tree, k, i))
            continue;
        kmp_wrench own = column_wrench(tree, i, c[i]);
        w[i].force = kmp_vec_add(tree->graph, w[i].force, own.force);
        w[i].moment = kmp_vec_add(tree->graph, w[i].moment, own.moment);
        m[tree->links[i].motion * n + of_k] = kmp_wrench_project(&tree->links[i], &w[i]); /* (38) */
        name_vector(tree->graph, &name_column_rate, c[i].o, i, k);
        name_vector(tree->graph, &name_column_linear, c[i].a, i, k);
        name_vector(tree->graph, &name_column_force, w[i].force, i, k);
        name_vector(tree->graph, &name_column_moment, w[i].moment, i, k);
        if (i > k)
            kmp_wrench_to_parent(tree, i, w[i], &w[tree->links[i].parent]);
    }
    m[of_k * n + of_k] = with_armature(tree, k, m[of_k * n + of_k], KMP_ONE);
}

static void clear(kmp_ref *m, int count)
{
    for (int k = 0; k < count; k++)
        m[k] = KMP_ZERO;
}

/* Each column by one product, of which half is not needed. */
static void mass_by_products(const kmp_tree *tree, kmp_ref *m)
{
    const int n = kmp_model_motion_count(tree->model);
    kmp_ref *x = KMP_GRAPH_NEW(tree->graph, kmp_ref, n), *entry = KMP_GRAPH_NEW(tree->graph, kmp_ref, n);
    for (int k = 0; x && entry && k < n; k++) {
        x[k] = KMP_ONE;
        kmp_mass_times(tree, x, entry);
        x[k] = KMP_ZERO;
        for (int i = k; i < n; i++)
            m[i * n + k] = entry[i];
    }
}

void kmp_mass_ner(const kmp_tree *tree, kmp_ref *m)
{
    int n = kmp_model_motion_count(tree->model);
    column *c = KMP_GRAPH_NEW(tree->graph, column, tree->count);
    kmp_wrench *w = KMP_GRAPH_NEW(tree->graph, kmp_wrench, tree->count);
    clear(m, n * n);
    if (kmp_model_flexible_count(tree->model) > 0) {
        mass_by_products(tree, m);
        return;
    }
    for (int k = 1; c && w && k < tree->count; k++)
        mass_column(tree, k, c, w, m);
}

void kmp_mass_times(const kmp_tree *tree, const kmp_ref *x, kmp_ref *out)
{
    kmp_graph *g = tree->graph;
    column *c = KMP_GRAPH_NEW(g, column, tree->count);
    kmp_wrench *w = KMP_GRAPH_NEW(g, kmp_wrench, tree->count);
    if (!c || !w)
        return;
    c[0] = (column){kmp_vec_zero(), kmp_vec_zero()};
    w[0] = (kmp_wrench){kmp_vec_zero(), kmp_vec_zero()};
    clear_elastic(tree, out);
    for (int i = 1; i < tree->count; i++) {
        c[i] = forward_column(tree, i, own_acceleration(tree, i, x), c[tree->links[i].parent]);
        w[i] = column_wrench(tree, i, c[i]);
        if (tree->links[i].deformation)
            kmp_flexible_column(tree, tree->links[i].deformation, x, c[i].o, c[i].a, &w[i], out);
    }
    for (int i = tree->count - 1; i > 0; i--) {
        to_coordinates(tree, i, &w[i], x, out);
        kmp_wrench_to_parent(tree, i, w[i], &w[tree->links[i].parent]);
    }
}

/* -- M by composite bodies --------------------------------------------------------------------------- */

kmp_composite kmp_composite_at_joint(const kmp_tree *tree, int i, kmp_composite c)
{
    c = kmp_composite_shifted(tree->graph, c, kmp_link_slide(tree, i));
    c.moment = kmp_link_to_parent(tree, i, c.moment);
    c.inertia = kmp_link_tensor_to_parent(tree, i, c.inertia);
    return c;
}

void kmp_composite_to_parent(const kmp_tree *tree, int i, kmp_composite c, kmp_composite *parent)
{
    kmp_graph *g = tree->graph;
    c = kmp_composite_shifted(g, kmp_composite_at_joint(tree, i, c), tree->links[i].p);
    *parent = kmp_composite_add(g, *parent, c);
}

/* The composite body about the parent's origin, with the mass that is lumped there already. */
static kmp_composite lumped_to_parent(const kmp_tree *tree, int i, kmp_composite c)
{
    kmp_ref mass = c.mass;
    c = kmp_composite_at_joint(tree, i, c);
    if (tree->links[i].lumped)
        c.mass = KMP_ZERO;
    c = kmp_composite_shifted(tree->graph, c, tree->links[i].p);
    c.mass = mass;
    return c;
}

/* The wrench about the origin that accelerates the composite body of link i along its own joint. */
kmp_wrench kmp_unit_wrench(const kmp_tree *tree, int i, const kmp_composite *c)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    kmp_vec e = kmp_vec_axis(signed_for(link, KMP_ONE), link->axis);
    if (link->rotation)
        return (kmp_wrench){kmp_vec_cross(g, e, c->moment), kmp_tensor_apply(g, c->inertia, e)};
    return (kmp_wrench){kmp_vec_scale(g, c->mass, e), kmp_vec_cross(g, c->moment, e)};
}

void kmp_mass_composite(const kmp_tree *tree, kmp_ref *m)
{
    int n = kmp_model_motion_count(tree->model);
    kmp_composite *c = KMP_GRAPH_NEW(tree->graph, kmp_composite, tree->count);
    clear(m, n * n);
    for (int i = 1; c && i < tree->count; i++)
        c[i] = tree->links[i].base;
    for (int i = tree->count - 1; c && i > 0; i--) {
        kmp_graph *g = tree->graph;
        static const int entry[6] = {1, 5, 9, 2, 3, 6};
        name_entry(g, &name_mass, c[i].mass, 0, i, 0);
        name_vector(g, &name_first, c[i].moment, i, 0);
        for (int k = 0; k < 6; k++)
            name_entry(g, &name_second, c[i].inertia.x[k], entry[k], i, 0);
        const int of_i = tree->links[i].motion;
        kmp_wrench w = {kmp_vec_zero(), kmp_vec_zero()};
        if (of_i >= 0) {
            w = kmp_unit_wrench(tree, i, &c[i]);
            m[of_i * n + of_i] = with_armature(tree, i, kmp_wrench_project(&tree->links[i], &w), KMP_ONE);
        }
        for (int k = i; of_i >= 0 && tree->links[k].parent > 0; k = tree->links[k].parent) {
            kmp_wrench below = {kmp_vec_zero(), kmp_vec_zero()};
            int h = tree->links[k].parent;
            kmp_wrench_to_parent(tree, k, w, &below);
            w = below;
            kmp_mass_couple(tree, h, of_i, &w, m);
            name_vector(tree->graph, &name_column_force, w.force, h, i);
            name_vector(tree->graph, &name_column_moment, w.moment, h, i);
        }
        int h = tree->links[i].parent;
        if (h > 0)
            c[h] = kmp_composite_add(tree->graph, c[h], lumped_to_parent(tree, i, c[i]));
    }
    for (int i = 1; c && i < tree->count; i++)
        if (tree->links[i].deformation)
            kmp_flexible_mass(tree, i, c, m);
}

/* -- energy ------------------------------------------------------------------------------------------ */

/* m v^2 + w' I w of link i, with v of its centre of mass, the part of its deformation, and its armature's part. */
static kmp_ref twice_the_energy(const kmp_tree *tree, int i, kmp_vec v, kmp_vec w)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    const kmp_deformation *d = link->deformation;
    kmp_vec centre = kmp_vec_add(g, v, kmp_vec_cross(g, w, link->com));
    if (d)
        centre =
            kmp_vec_add(g, centre, kmp_vec_scale(g, kmp_div(g, KMP_ONE, link->mass), kmp_deformation_momentum(g, d)));
    kmp_ref sum = kmp_mul(g, link->mass, kmp_vec_dot(g, centre, centre));
    if (d) {
        sum = kmp_add(g, sum, kmp_mul(g, kmp_const(g, 2), kmp_vec_dot(g, w, kmp_deformation_spin(g, d))));
        sum = kmp_add(g, sum, kmp_deformation_energy(g, d));
    }
    sum = kmp_add(g, sum, kmp_vec_dot(g, w, kmp_tensor_apply(g, link->inertia, w)));
    return kmp_add(g, sum, kmp_mul(g, link->armature, kmp_mul(g, link->qd, link->qd)));
}

/* Velocities of origins and angular velocities in the axes of the links, from the ground outwards. */
kmp_ref kmp_kinetic_energy(const kmp_tree *tree)
{
    kmp_graph *g = tree->graph;
    kmp_vec *v = KMP_GRAPH_NEW(g, kmp_vec, tree->count), *w = KMP_GRAPH_NEW(g, kmp_vec, tree->count);
    const int count = tree->count - kmp_model_state_count(tree->model);
    kmp_ref sum = KMP_ZERO;
    if (!v || !w)
        return sum;
    v[0] = w[0] = kmp_vec_zero();
    for (int i = 1; i < count; i++) {
        const kmp_link *link = &tree->links[i];
        const int h = link->parent;
        kmp_vec rate = kmp_vec_axis(link->qd, link->axis);
        w[i] = kmp_link_to_child(tree, i, w[h]);
        v[i] = kmp_link_to_child(tree, i, kmp_vec_add(g, v[h], kmp_vec_cross(g, w[h], link->p)));
        if (link->rotation) {
            w[i] = kmp_vec_add(g, w[i], rate);
        } else {
            v[i] = kmp_vec_add(g, v[i], kmp_vec_cross(g, w[i], kmp_link_slide(tree, i)));
            v[i] = kmp_vec_add(g, v[i], rate);
        }
        sum = kmp_add(g, sum, twice_the_energy(tree, i, v[i], w[i]));
    }
    return kmp_mul(g, kmp_const(g, 0.5), sum);
}
