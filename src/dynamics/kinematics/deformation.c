/* SPDX-License-Identifier: BSD-3-Clause */
/* With fields phi_k, z = (q, eta), eta_j = q' E_j q / 2 and places X of the undeformed body, the moments of the
 * deformed one are
 *
 *     s = int x dm = b + sum S_k z_k        Z_k = int phi_k x' dm = Z0_k + sum T_kl z_l
 *     P = int x x' dm = P0 + sum z_k (Z0_k + Z_k')        inertia about the origin: tr P 1 - P
 *
 * from constants b, S, Z0, T, P0 (kmp_flexible). All that is of second order in q is in the quadratic functions eta. */
#include "dynamics/kinematics/deformation.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"
#include "model/flexible/body_spectrum.h"
#include <math.h>

static kmp_ref coordinate(const kmp_tree *tree, const kmp_flexible *f, int k, bool rate)
{
    return kmp_input(tree->graph, rate ? KMP_IN_QD : KMP_IN_Q, (uint32_t)(f->first + k));
}

static kmp_matrix matrix_of(const kmp_tree *tree, const kmp_number *number, bool transposed)
{
    kmp_matrix m;
    for (int k = 0; k < 9; k++)
        m.x[k / 3][k % 3] = kmp_tree_number(tree, &number[transposed ? k % 3 * 3 + k / 3 : k]);
    return m;
}

kmp_matrix kmp_matrix_add(kmp_graph *g, kmp_matrix a, kmp_ref w, const kmp_matrix *b)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a.x[i][j] = kmp_add(g, a.x[i][j], kmp_mul(g, w, b->x[i][j]));
    return a;
}

kmp_vec kmp_matrix_axial(kmp_graph *g, const kmp_matrix *y)
{
    kmp_vec v;
    for (int k = 0; k < 3; k++)
        v.x[k] = kmp_sub(g, y->x[(k + 2) % 3][(k + 1) % 3], y->x[(k + 1) % 3][(k + 2) % 3]);
    return v;
}

kmp_ref kmp_matrix_trace(kmp_graph *g, const kmp_matrix *y)
{
    return kmp_add(g, kmp_add(g, y->x[0][0], y->x[1][1]), y->x[2][2]);
}

/* row_k = sum_l m_kl x_l of a symmetric n x n matrix of numbers. */
static void apply_symmetric(const kmp_tree *tree, const kmp_flexible *f, const kmp_number *m, bool rate, kmp_ref *row)
{
    kmp_graph *g = tree->graph;
    for (int k = 0; k < f->count; k++) {
        row[k] = KMP_ZERO;
        for (int l = 0; l < f->count; l++)
            row[k] = kmp_add(g, row[k],
                             kmp_mul(g, kmp_tree_number(tree, &m[k * f->count + l]), coordinate(tree, f, l, rate)));
    }
}

static kmp_ref dot_coordinates(const kmp_tree *tree, const kmp_flexible *f, const kmp_ref *row, bool rate)
{
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < f->count; k++)
        sum = kmp_add(tree->graph, sum, kmp_mul(tree->graph, row[k], coordinate(tree, f, k, rate)));
    return sum;
}

/* Fields: their values z, slopes, rates and curves. */
static void set_fields(const kmp_tree *tree, const kmp_flexible *f, kmp_deformation *d, kmp_ref *z, kmp_ref *row)
{
    kmp_graph *g = tree->graph;
    const int n = f->count;
    for (int k = 0; k < n; k++) {
        z[k] = coordinate(tree, f, k, false);
        d->slope[k * n + k] = KMP_ONE;
        d->rate[k] = coordinate(tree, f, k, true);
    }
    for (int j = 0; j < f->quadratic_count; j++) {
        const kmp_number *e = f->quadratic + (ptrdiff_t)j * n * n;
        kmp_ref *slope = d->slope + (ptrdiff_t)(n + j) * n;
        apply_symmetric(tree, f, e, false, slope);
        z[n + j] = kmp_mul(g, kmp_const(g, 0.5), dot_coordinates(tree, f, slope, false));
        d->rate[n + j] = dot_coordinates(tree, f, slope, true);
        apply_symmetric(tree, f, e, true, row);
        d->curve[n + j] = dot_coordinates(tree, f, row, true);
    }
}

/* Moments of the deformed mass. */
static void set_moments(const kmp_tree *tree, const kmp_flexible *f, kmp_deformation *d, const kmp_ref *z)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    kmp_graph *g = tree->graph;
    kmp_ref p[6];
    d->whole.mass = kmp_tree_number(tree, f->mass);
    d->whole.moment = kmp_tree_vector(tree, f->moment);
    for (int e = 0; e < 6; e++)
        p[e] = kmp_tree_number(tree, &f->second[e]);
    for (int k = 0; k < d->fields; k++) {
        const kmp_matrix at_rest = matrix_of(tree, f->by_place + (ptrdiff_t)9 * k, false);
        d->moment[k] = at_rest;
        d->field[k] = kmp_tree_vector(tree, f->field + (ptrdiff_t)3 * k);
        for (int l = 0; l < d->fields; l++) {
            kmp_matrix *t = &d->by_field[k * d->fields + l];
            *t = matrix_of(tree, f->by_field + (ptrdiff_t)9 * (k < l ? k * d->fields + l : l * d->fields + k), k > l);
            d->moment[k] = kmp_matrix_add(g, d->moment[k], z[l], t);
        }
        d->whole.moment = kmp_vec_add(g, d->whole.moment, kmp_vec_scale(g, z[k], d->field[k]));
        for (int e = 0; e < 6; e++) {
            const int i = row[e], j = column[e];
            p[e] = kmp_add(g, p[e], kmp_mul(g, z[k], kmp_add(g, at_rest.x[i][j], d->moment[k].x[j][i])));
        }
    }
    for (int k = 0; k < 3; k++) {
        d->whole.inertia.x[k] = kmp_add(g, p[(k + 1) % 3], p[(k + 2) % 3]);
        d->whole.inertia.x[3 + k] = kmp_neg(p[3 + k]);
    }
}

kmp_deformation *kmp_deformation_new(const kmp_tree *tree, const kmp_flexible *f, int innermost)
{
    kmp_graph *g = tree->graph;
    const int n = f->count, fields = n + f->quadratic_count;
    kmp_deformation *d = KMP_GRAPH_NEW(g, kmp_deformation, 1);
    if (!d)
        return NULL;
    *d = (kmp_deformation){.first = f->first, .count = n, .fields = fields, .innermost = innermost};
    kmp_ref *z, *row;
    KMP_GRAPH_MAKE(g, KMP_ROOM(kmp_ref, fields * n, &d->slope), KMP_ROOM(kmp_ref, fields, &d->rate, &d->curve, &z),
                   KMP_ROOM(kmp_ref, n, &row), KMP_ROOM(kmp_vec, fields, &d->field),
                   KMP_ROOM(kmp_matrix, fields, &d->moment), KMP_ROOM(kmp_matrix, fields * fields, &d->by_field),
                   KMP_ROOM(kmp_ref, n * n, &d->stiffness, &d->damping));
    if (kmp_graph_failed(g))
        return NULL;
    set_fields(tree, f, d, z, row);
    set_moments(tree, f, d, z);
    for (int k = 0; k < n * n; k++) {
        d->stiffness[k] = kmp_tree_number(tree, &f->stiffness[k]);
        d->damping[k] = kmp_tree_number(tree, &f->damping[k]);
    }
    return kmp_graph_failed(g) ? NULL : d;
}

static bool is_nothing(const kmp_number *numbers, int count)
{
    bool nothing = true;
    for (int k = 0; k < count; k++)
        nothing = nothing && numbers[k].value == 0 && !numbers[k].expr;
    return nothing;
}

/* A number that moves with the coordinates: sum_k linear_k q_k + q' more q / 2. `bent`: n, for more q. */
static kmp_ref value_by_coordinates(const kmp_tree *tree, const kmp_flexible *f, const kmp_number *linear,
                                    const kmp_ref *bent)
{
    kmp_graph *g = tree->graph;
    kmp_ref value = KMP_ZERO;
    for (int k = 0; k < f->count; k++) {
        const kmp_ref number = kmp_tree_number(tree, &linear[k]);
        const kmp_ref mean = kmp_add(g, number, kmp_mul(g, kmp_const(g, 0.5), bent[k]));
        value = kmp_add(g, value, kmp_mul(g, mean, coordinate(tree, f, k, false)));
    }
    return value;
}

/* The square of the displacement of a station. */
static kmp_ref deflected(const kmp_tree *tree, const kmp_flexible *f, const kmp_station *station, kmp_ref *bent)
{
    kmp_graph *g = tree->graph;
    const ptrdiff_t n = f->count;
    kmp_ref square = KMP_ZERO;
    for (int axis = 0; axis < 3; axis++) {
        apply_symmetric(tree, f, station->shift_more + axis * n * n, false, bent);
        const kmp_ref way = value_by_coordinates(tree, f, station->shift + axis * n, bent);
        square = kmp_add(g, square, kmp_mul(g, way, way));
    }
    return square;
}

kmp_ref kmp_flexible_margin(const kmp_tree *tree, const kmp_flexible *f)
{
    kmp_graph *g = tree->graph;
    kmp_ref *bent, most = KMP_ZERO;
    KMP_GRAPH_MAKE(g, KMP_ROOM(kmp_ref, f->count + 1, &bent));
    if (kmp_graph_failed(g))
        return KMP_ZERO;
    for (int s = 0; s < f->station_count; s++)
        most = kmp_binary(g, KMP_OP_MAX, most, deflected(tree, f, &f->stations[s], bent));
    for (int k = 0; k < f->count && f->station_count == 1; k++) {
        const kmp_ref way = coordinate(tree, f, k, false);
        if (!kmp_model_motion(tree->model, f->first + k)->rotation)
            most = kmp_binary(g, KMP_OP_MAX, most, kmp_mul(g, way, way));
    }
    const kmp_ref limit = kmp_mul(g, kmp_const(g, KMP_DEFLECTION_LARGE), kmp_tree_number(tree, f->length));
    return kmp_sub(g, KMP_ONE, kmp_div(g, most, kmp_mul(g, limit, limit)));
}

kmp_ref kmp_flexible_rate_margin(const kmp_tree *tree, const kmp_flexible *f)
{
    kmp_graph *g = tree->graph;
    const double fastest = kmp_flexible_fastest(f);
    kmp_ref most = KMP_ZERO;
    for (int b = f->body; b > 0; b = kmp_model_body(tree->model, b)->parent)
        for (int k = 0; k < kmp_model_body(tree->model, b)->motion_count; k++) {
            const int motion = kmp_model_body(tree->model, b)->first_motion + k;
            const kmp_ref rate = kmp_input(g, KMP_IN_QD, (uint32_t)motion);
            if (kmp_model_motion(tree->model, motion)->rotation)
                most = kmp_binary(g, KMP_OP_MAX, most, kmp_mul(g, rate, rate));
        }
    return kmp_sub(g, KMP_ONE, kmp_mul(g, kmp_const(g, 1 / (fastest * fastest)), most));
}

/* The numbers of both conditions are their reasons. */
static void watch_for(const kmp_tree *tree, const kmp_flexible *f, kmp_validity validity, const char *words,
                      double limit)
{
    kmp_events *events = tree->conditions.events;
    kmp_text text = {0};
    if (f->count == 0 || !events || kmp_events_find(events, f, (int)validity) >= 0)
        return;
    kmp_text_printf(&text, "flexible body '%s' %s %.4g%s", kmp_model_body(tree->model, f->body)->name, words, limit,
                    validity == KMP_VALIDITY_DEFLECTION ? " of its length" : " rad/s");
    const kmp_condition condition = {
        .of = f, .number = (int)validity, .validity = validity, .text = kmp_text_take(&text)};
    if (kmp_events_add(events, condition) < 0)
        kmp_graph_fail(tree->graph);
}

void kmp_flexible_watch(const kmp_tree *tree, const kmp_flexible *f)
{
    const double fastest = kmp_flexible_fastest(f);
    watch_for(tree, f, KMP_VALIDITY_DEFLECTION, "deflects by more than", KMP_DEFLECTION_LARGE);
    if (isfinite(fastest))
        watch_for(tree, f, KMP_VALIDITY_ROTATION, "turns with more than", fastest);
}

bool kmp_guide_make(const kmp_tree *tree, const kmp_flexible *f, const kmp_number *linear, const kmp_number *more,
                    double sign, kmp_guide *guide, kmp_ref *value, kmp_ref *rate)
{
    kmp_graph *g = tree->graph;
    const int n = f->count;
    if (is_nothing(linear, n) && is_nothing(more, n * n))
        return false;
    kmp_ref *bent, *row;
    *guide = (kmp_guide){.first = f->first, .count = n};
    KMP_GRAPH_MAKE(g, KMP_ROOM(kmp_ref, n, &bent, &row, &guide->slope));
    if (kmp_graph_failed(g))
        return true;
    const kmp_ref factor = kmp_const(g, sign);
    apply_symmetric(tree, f, more, false, bent);
    apply_symmetric(tree, f, more, true, row);
    for (int k = 0; k < n; k++)
        guide->slope[k] = kmp_mul(g, factor, kmp_add(g, kmp_tree_number(tree, &linear[k]), bent[k]));
    *value = kmp_mul(g, factor, value_by_coordinates(tree, f, linear, bent));
    *rate = dot_coordinates(tree, f, guide->slope, true);
    guide->curve = kmp_mul(g, factor, dot_coordinates(tree, f, row, true));
    return true;
}

kmp_vec kmp_deformation_momentum(kmp_graph *g, const kmp_deformation *d)
{
    kmp_vec sum = kmp_vec_zero();
    for (int k = 0; k < d->fields; k++)
        sum = kmp_vec_add(g, sum, kmp_vec_scale(g, d->rate[k], d->field[k]));
    return sum;
}

/* sum rate_k ax(Z_k) about the origin, less s x momentum / m. */
kmp_vec kmp_deformation_spin(kmp_graph *g, const kmp_deformation *d)
{
    const kmp_vec centre = kmp_vec_scale(g, kmp_div(g, KMP_ONE, d->whole.mass), d->whole.moment);
    kmp_vec sum = kmp_vec_cross(g, kmp_deformation_momentum(g, d), centre);
    for (int k = 0; k < d->fields; k++)
        sum = kmp_vec_add(g, sum, kmp_vec_scale(g, d->rate[k], kmp_matrix_axial(g, &d->moment[k])));
    return sum;
}

kmp_ref kmp_deformation_energy(kmp_graph *g, const kmp_deformation *d)
{
    const kmp_vec momentum = kmp_deformation_momentum(g, d);
    kmp_ref sum = kmp_neg(kmp_div(g, kmp_vec_dot(g, momentum, momentum), d->whole.mass));
    for (int k = 0; k < d->fields; k++) {
        kmp_ref row = KMP_ZERO;
        for (int l = 0; l < d->fields; l++)
            row = kmp_add(g, row, kmp_mul(g, kmp_matrix_trace(g, &d->by_field[k * d->fields + l]), d->rate[l]));
        sum = kmp_add(g, sum, kmp_mul(g, d->rate[k], row));
    }
    return sum;
}
