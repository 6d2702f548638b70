/* SPDX-License-Identifier: BSD-3-Clause */
/* The inertia of a flexible body in the recursions: what its deformation adds to the wrench of its link, to a column of
 * M and to composite bodies, and the forces on its own coordinates. They are the moments of the acceleration
 * alpha + beta x + 2 w x xd + xdd with 1, x and each field phi_k over the mass. */
#include "dynamics/formalisms/flexible_body.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"

/* Row e of a deformation: slope' row of its fields. */
static kmp_ref of_coordinate(kmp_graph *g, const kmp_deformation *d, int e, const kmp_ref *row)
{
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < d->fields; k++)
        sum = kmp_add(g, sum, kmp_mul(g, d->slope[k * d->count + e], row[k]));
    return sum;
}

/* Accelerations of the fields by accelerations of the coordinates (NULL: none), with `curved` the accelerations at
 * constant rates. */
static void accelerate_fields(kmp_graph *g, const kmp_deformation *d, const kmp_ref *qdd, bool curved, kmp_ref *zdd)
{
    for (int k = 0; k < d->fields; k++) {
        zdd[k] = curved ? d->curve[k] : KMP_ZERO;
        for (int e = 0; qdd && e < d->count; e++)
            zdd[k] = kmp_add(g, zdd[k], kmp_mul(g, d->slope[k * d->count + e], qdd[d->first + e]));
    }
}

/* The wrench about the origin that accelerates the fields of a body at rest. */
static kmp_wrench field_wrench(kmp_graph *g, const kmp_deformation *d, const kmp_ref *zdd)
{
    kmp_wrench w = {kmp_vec_zero(), kmp_vec_zero()};
    for (int k = 0; k < d->fields; k++) {
        w.force = kmp_vec_add(g, w.force, kmp_vec_scale(g, zdd[k], d->field[k]));
        w.moment = kmp_vec_add(g, w.moment, kmp_vec_scale(g, zdd[k], kmp_matrix_axial(g, &d->moment[k])));
    }
    return w;
}

/* The forces on the coordinates of a body at rest that accelerate its fields: sum_l tr T_kl zdd_l. */
static kmp_ref field_inertia(kmp_graph *g, const kmp_deformation *d, int k, const kmp_ref *zdd)
{
    kmp_ref sum = KMP_ZERO;
    for (int l = 0; l < d->fields; l++)
        if (zdd[l] != KMP_ZERO)
            sum = kmp_add(g, sum, kmp_mul(g, kmp_matrix_trace(g, &d->by_field[k * d->fields + l]), zdd[l]));
    return sum;
}

/* The deformation adds to the wrench of its link, and has its own inertial forces:
 *
 *     force   2 w x sd + S zdd                    sd = S zd
 *     moment  2 (tr N w - N w) + ax(sum zdd_k Z_k)          N = sum zd_k Z_k
 *     R_k     S_k.alpha + beta : Z_k + 2 w.ax(sum_l T_kl zd_l) + sum_l tr T_kl zdd_l
 *
 * which are the moments of alpha + beta x + 2 w x xd + xdd with 1, x and phi_k. */
void kmp_flexible_wrench(const kmp_tree *tree, const kmp_deformation *d, const kmp_ref *qdd, const kmp_link_motion *m,
                         kmp_wrench *w, kmp_ref *effort)
{
    kmp_graph *g = tree->graph;
    kmp_ref *zdd = KMP_GRAPH_NEW(g, kmp_ref, d->fields), *row = KMP_GRAPH_NEW(g, kmp_ref, d->fields);
    const kmp_ref two = kmp_const(g, 2);
    kmp_matrix n = {{{KMP_ZERO}}};
    if (!zdd || !row)
        return;
    accelerate_fields(g, d, qdd, true, zdd);
    kmp_wrench more = field_wrench(g, d, zdd);
    for (int k = 0; k < d->fields; k++) {
        kmp_matrix t = {{{KMP_ZERO}}};
        n = kmp_matrix_add(g, n, d->rate[k], &d->moment[k]);
        for (int l = 0; l < d->fields; l++)
            t = kmp_matrix_add(g, t, d->rate[l], &d->by_field[k * d->fields + l]);
        row[k] = kmp_vec_dot(g, d->field[k], m->alpha);
        for (int e = 0; e < 9; e++)
            row[k] = kmp_add(g, row[k], kmp_mul(g, m->beta.x[e / 3][e % 3], d->moment[k].x[e / 3][e % 3]));
        row[k] = kmp_add(g, row[k], kmp_mul(g, two, kmp_vec_dot(g, m->w, kmp_matrix_axial(g, &t))));
        row[k] = kmp_add(g, row[k], field_inertia(g, d, k, zdd));
    }
    kmp_vec gyration =
        kmp_vec_sub(g, kmp_vec_scale(g, kmp_matrix_trace(g, &n), m->w), kmp_matrix_apply(g, &n, false, m->w));
    kmp_vec coriolis = kmp_vec_cross(g, m->w, kmp_deformation_momentum(g, d));
    w->force = kmp_vec_add(g, w->force, kmp_vec_add(g, more.force, kmp_vec_scale(g, two, coriolis)));
    w->moment = kmp_vec_add(g, w->moment, kmp_vec_add(g, more.moment, kmp_vec_scale(g, two, gyration)));
    for (int e = 0; e < d->count; e++)
        effort[d->first + e] = kmp_add(g, effort[d->first + e], of_coordinate(g, d, e, row));
}

/* The same for accelerations of a body at rest. */
void kmp_flexible_column(const kmp_tree *tree, const kmp_deformation *d, const kmp_ref *qdd, kmp_vec o, kmp_vec a,
                         kmp_wrench *w, kmp_ref *effort)
{
    kmp_graph *g = tree->graph;
    kmp_ref *zdd = KMP_GRAPH_NEW(g, kmp_ref, d->fields), *row = KMP_GRAPH_NEW(g, kmp_ref, d->fields);
    if (!zdd || !row)
        return;
    accelerate_fields(g, d, qdd, false, zdd);
    const kmp_wrench more = field_wrench(g, d, zdd);
    w->force = kmp_vec_add(g, w->force, more.force);
    w->moment = kmp_vec_add(g, w->moment, more.moment);
    for (int k = 0; k < d->fields; k++) {
        row[k] = kmp_vec_dot(g, d->field[k], a);
        row[k] = kmp_add(g, row[k], kmp_vec_dot(g, o, kmp_matrix_axial(g, &d->moment[k])));
        row[k] = kmp_add(g, row[k], field_inertia(g, d, k, zdd));
    }
    for (int e = 0; e < d->count; e++)
        effort[d->first + e] = kmp_add(g, effort[d->first + e], of_coordinate(g, d, e, row));
}

/* -- M by composite bodies --------------------------------------------------------------------------- */

static kmp_ref *mass_entry(const kmp_tree *tree, kmp_ref *m, int i, int k)
{
    const int n = kmp_model_motion_count(tree->model);
    return i > k ? &m[i * n + k] : &m[k * n + i];
}

/* The entries of motion k with the entries of link h, from the wrench that an acceleration of k makes there. */
void kmp_mass_couple(const kmp_tree *tree, int h, int k, kmp_wrench *w, kmp_ref *m)
{
    const kmp_link *link = &tree->links[h];
    const kmp_ref along = kmp_wrench_project(link, w);
    if (link->motion >= 0)
        *mass_entry(tree, m, k, link->motion) = along;
    for (int e = 0; link->guide && e < link->guide->count; e++) {
        kmp_ref *entry = mass_entry(tree, m, k, link->guide->first + e);
        *entry = kmp_add(tree->graph, *entry, kmp_mul(tree->graph, link->guide->slope[e], along));
    }
}

static void add_wrench(kmp_graph *g, kmp_wrench *w, kmp_ref factor, const kmp_wrench *more)
{
    w->force = kmp_vec_add(g, w->force, kmp_vec_scale(g, factor, more->force));
    w->moment = kmp_vec_add(g, w->moment, kmp_vec_scale(g, factor, more->moment));
}

/* The body's own inertia: S T_m and ax(Z T_m) to the columns, T_m' tr T T_m to the inertia of the coordinates. */
void kmp_flexible_own(const kmp_tree *tree, const kmp_deformation *d, kmp_wrench *column, kmp_ref *inertia)
{
    kmp_graph *g = tree->graph;
    kmp_ref *zdd = KMP_GRAPH_NEW(g, kmp_ref, d->fields), *row = KMP_GRAPH_NEW(g, kmp_ref, d->fields);
    for (int e = 0; zdd && row && e < d->count; e++) {
        for (int k = 0; k < d->fields; k++)
            zdd[k] = d->slope[k * d->count + e];
        const kmp_wrench own = field_wrench(g, d, zdd);
        add_wrench(g, &column[e], KMP_ONE, &own);
        for (int k = 0; k < d->fields; k++)
            row[k] = field_inertia(g, d, k, zdd);
        for (int f = 0; f <= e; f++) {
            kmp_ref *entry = &inertia[e * d->count + f];
            *entry = kmp_add(g, *entry, of_coordinate(g, d, f, row));
        }
    }
}

void kmp_flexible_guide(const kmp_tree *tree, int i, const kmp_wrench *unit, kmp_wrench *column, kmp_ref *inertia)
{
    kmp_graph *g = tree->graph;
    const kmp_link *link = &tree->links[i];
    const kmp_guide *guide = link->guide;
    const int n = guide->count;
    for (int e = 0; e < n; e++) {
        const kmp_ref behind = kmp_wrench_project(link, &column[e]);
        for (int f = 0; f <= e; f++)
            inertia[e * n + f] = kmp_add(g, inertia[e * n + f], kmp_mul(g, guide->slope[f], behind));
    }
    for (int e = 0; e < n; e++)
        add_wrench(g, &column[e], guide->slope[e], unit);
    for (int f = 0; f < n; f++) {
        const kmp_ref whole = kmp_wrench_project(link, &column[f]);
        for (int e = f; e < n; e++)
            inertia[e * n + f] = kmp_add(g, inertia[e * n + f], kmp_mul(g, guide->slope[e], whole));
    }
}

/* Columns of the coordinates of the flexible body whose frame is link `frame`, from the leaves inwards. */
void kmp_flexible_mass(const kmp_tree *tree, int frame, const kmp_composite *c, kmp_ref *m)
{
    kmp_graph *g = tree->graph;
    const kmp_deformation *d = tree->links[frame].deformation;
    const int n = d->count;
    kmp_wrench *columns = KMP_GRAPH_NEW(g, kmp_wrench, n * tree->count); /* of each link */
    kmp_ref *inertia = KMP_GRAPH_NEW(g, kmp_ref, n * n);
    bool *present = KMP_GRAPH_NEW(g, bool, tree->count);
    for (int i = tree->count - 1; columns && inertia && present && i > 0; i--) {
        const kmp_link *link = &tree->links[i];
        const bool guided = link->guide && link->guide->first == d->first;
        kmp_wrench *column = columns + (ptrdiff_t)n * i;
        if (i != frame && !guided && !present[i])
            continue;
        if (i == frame)
            kmp_flexible_own(tree, d, column, inertia);
        if (guided) {
            const kmp_wrench unit = kmp_unit_wrench(tree, i, &c[i]);
            kmp_flexible_guide(tree, i, &unit, column, inertia);
        }
        for (int e = 0; e < n; e++) {
            if (!guided)
                kmp_mass_couple(tree, i, d->first + e, &column[e], m);
            if (link->parent > 0)
                kmp_wrench_to_parent(tree, i, column[e], columns + (ptrdiff_t)n * link->parent + e);
        }
        present[link->parent] = true;
    }
    for (int e = 0; inertia && e < n; e++)
        for (int f = 0; f <= e; f++)
            *mass_entry(tree, m, d->first + e, d->first + f) = inertia[e * n + f];
}
