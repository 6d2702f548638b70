/* SPDX-License-Identifier: BSD-3-Clause */
/* Links from bodies and motions; vectors between link axes; positions of points.
 *
 * Positions go from the point inwards. Along a run of rotations about one common axis each constant vector is turned
 * by the sum of the angles, and the run's vectors are added at its end only: a planar mechanism is then a sum of
 * vectors turned by absolute angles. */
#include "dynamics/kinematics.h"
#include "base/memory.h"
#include "symbolic/rotation.h"
#include "symbolic/table.h"
#include <math.h>
#include <string.h>

/* -- numbers of the model as nodes ------------------------------------------------------------------- */

static kmp_ref call(kmp_graph *g, kmp_function f, kmp_ref a, kmp_ref b, kmp_ref c)
{
    (void)b, (void)c;
    switch (f) {
#define KMP_FUNCTION(name, arity, value, node)                                                                         \
    case KMP_FUNCTION_##name:                                                                                          \
        return node;
#include "model/functions.def"
#undef KMP_FUNCTION
    case KMP_FUNCTION_COUNT:
        break;
    }
    return KMP_ZERO;
}

static double parameter_value(const kmp_tree *tree, int index)
{
    return tree->model->parameters[index].number.value;
}

/* An exact zero stays a zero: the zero pattern of the data is part of a program's identity. */
static kmp_ref parameter(const kmp_tree *tree, int index)
{
    double value = parameter_value(tree, index);
    if (!tree->keep_parameters || value == 0)
        return kmp_const(tree->graph, value);
    return kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
}

static double constant_value(const kmp_tree *tree, const kmp_expr *e);

/* Number of a condition, -1 when there is no memory. */
static int event_number(kmp_events *events, const kmp_expr *e)
{
    for (int k = 0; k < events->count; k++)
        if (events->condition[k] == e)
            return k;
    const kmp_expr **grown = kmp_realloc(events->condition, (size_t)events->count + 1, sizeof(const kmp_expr *));
    if (!grown)
        return -1;
    events->condition = grown;
    events->condition[events->count] = e;
    return events->count++;
}

/* a < b, or what stands for it during a step. */
static kmp_ref condition(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b)
{
    kmp_graph *g = tree->graph;
    kmp_ref less = kmp_less(g, a, b);
    bool moves = kmp_graph_node(g, kmp_id(less))->depends & ~(1u << KMP_IN_PARAMETER);
    if (!tree->events || !moves)
        return less;
    int k = event_number(tree->events, e);
    return k >= 0 ? kmp_input(g, KMP_IN_MODE, (uint32_t)k) : less;
}

kmp_ref kmp_tree_expression(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    switch (e->kind) {
    case KMP_EXPR_NUMBER:
        return kmp_const(g, e->value);
    case KMP_EXPR_PARAMETER:
        return parameter(tree, e->index);
    case KMP_EXPR_TIME:
        return kmp_input(g, KMP_IN_TIME, 0);
    case KMP_EXPR_Q:
        return kmp_input(g, KMP_IN_Q, (uint32_t)e->index);
    case KMP_EXPR_QD:
        return kmp_input(g, KMP_IN_QD, (uint32_t)e->index);
    case KMP_EXPR_TABLE:
        return kmp_table_at(g, kmp_graph_add_table(g, e->table->table), kmp_tree_expression(tree, e->a));
    case KMP_EXPR_NEG:
        return kmp_neg(kmp_tree_expression(tree, e->a));
    case KMP_EXPR_POW:
        return kmp_power(g, kmp_tree_expression(tree, e->a), constant_value(tree, e->b));
    default:
        break;
    }
    kmp_ref a = kmp_tree_expression(tree, e->a), b = e->b ? kmp_tree_expression(tree, e->b) : KMP_ZERO;
    switch (e->kind) {
    case KMP_EXPR_ADD:
        return kmp_add(g, a, b);
    case KMP_EXPR_SUB:
        return kmp_sub(g, a, b);
    case KMP_EXPR_MUL:
        return kmp_mul(g, a, b);
    case KMP_EXPR_LESS:
        return condition(tree, e, a, b);
    case KMP_EXPR_GREATER:
        return condition(tree, e, b, a);
    case KMP_EXPR_AT_MOST:
        return kmp_select(g, condition(tree, e, b, a), KMP_ZERO, KMP_ONE);
    case KMP_EXPR_AT_LEAST:
        return kmp_select(g, condition(tree, e, a, b), KMP_ZERO, KMP_ONE);
    case KMP_EXPR_CALL:
        if (e->function == KMP_FUNCTION_sign)
            return kmp_select(g, condition(tree, e, a, KMP_ZERO), kmp_neg(KMP_ONE), KMP_ONE);
        return call(g, e->function, a, b, e->c ? kmp_tree_expression(tree, e->c) : KMP_ZERO);
    default:
        return kmp_div(g, a, b);
    }
}

kmp_ref kmp_tree_event(const kmp_tree *tree, int k)
{
    const kmp_expr *e = tree->events->condition[k];
    kmp_ref a = kmp_tree_expression(tree, e->a), b = e->b ? kmp_tree_expression(tree, e->b) : KMP_ZERO;
    bool turned = e->kind == KMP_EXPR_GREATER || e->kind == KMP_EXPR_AT_MOST;
    return turned ? kmp_sub(tree->graph, b, a) : kmp_sub(tree->graph, a, b);
}

/* Exponents are numbers of the program, whatever the parameters do. */
static double constant_value(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_tree folded = *tree;
    double value = NAN;
    folded.keep_parameters = false;
    kmp_ref r = kmp_tree_expression(&folded, e);
    return kmp_is_const(tree->graph, r, &value) ? value : NAN;
}

kmp_ref kmp_tree_number(const kmp_tree *tree, const kmp_number *number)
{
    if (!tree->keep_parameters || !number->expr || number->value == 0)
        return kmp_const(tree->graph, number->value);
    return kmp_tree_expression(tree, number->expr);
}

kmp_vec kmp_tree_vector(const kmp_tree *tree, const kmp_number number[3])
{
    kmp_vec v;
    for (int k = 0; k < 3; k++)
        v.x[k] = kmp_tree_number(tree, &number[k]);
    return v;
}

/* -- constant rotations ------------------------------------------------------------------------------ */

static void identity(double m[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] = i == j;
}

static kmp_vec apply(kmp_graph *g, double m[3][3], bool transposed, kmp_vec v)
{
    kmp_vec r = kmp_vec_zero();
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            r.x[i] = kmp_add(g, r.x[i], kmp_mul(g, kmp_const(g, transposed ? m[j][i] : m[i][j]), v.x[j]));
    return r;
}

/* Axes whose third is the unit vector e: Rodrigues' turn of z onto e about z x e. */
static void axes_along(const double e[3], double m[3][3])
{
    double c = e[2];
    if (c < 0) { /* turn -z instead, then half a turn about x: far from the singular case */
        double f[3] = {e[0], -e[1], -e[2]};
        axes_along(f, m);
        for (int j = 0; j < 3; j++) {
            m[1][j] = -m[1][j];
            m[2][j] = -m[2][j];
        }
        return;
    }
    double k = 1 / (1 + c);
    double r[3][3] = {{1 - k * e[0] * e[0], -k * e[0] * e[1], e[0]},
                      {-k * e[0] * e[1], 1 - k * e[1] * e[1], e[1]},
                      {-e[0], -e[1], c}};
    memcpy(m, r, sizeof r);
}

/* Chooses the link's axes in model axes: the model's own when the motion is about one of them. */
static void choose_axes(kmp_link *link, const double e[3])
{
    identity(link->a);
    for (int k = 0; k < 3; k++)
        if (fabs(e[k]) == 1) {
            link->axis = k;
            link->reversed = e[k] < 0;
            return;
        }
    link->axis = 2;
    axes_along(e, link->a);
}

/* g = a_parent' a_link; `turned` unless the two are the same. */
static void relate_axes(kmp_link *link, const kmp_link *parent)
{
    link->turned = memcmp(link->a, parent->a, sizeof link->a) != 0;
    identity(link->g);
    for (int i = 0; link->turned && i < 3; i++)
        for (int j = 0; j < 3; j++) {
            link->g[i][j] = 0;
            for (int k = 0; k < 3; k++)
                link->g[i][j] += parent->a[k][i] * link->a[k][j];
        }
}

kmp_vec kmp_link_from_model(const kmp_tree *tree, int i, kmp_vec v)
{
    kmp_link *link = &tree->links[i];
    return link->axis == 2 && link->a[2][2] != 1 ? apply(tree->graph, link->a, true, v) : v;
}

/* -- the tree ---------------------------------------------------------------------------------------- */

/* Model axes tensor into link axes: a' I a, by columns. */
static kmp_tensor tensor_from_model(const kmp_tree *tree, int i, const kmp_number number[6])
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    kmp_tensor t, r;
    for (int k = 0; k < 6; k++)
        t.x[k] = kmp_tree_number(tree, &number[k]);
    if (memcmp(tree->links[i].a, tree->links[0].a, sizeof tree->links[i].a) == 0)
        return t;
    for (int k = 0; k < 6; k++) {
        kmp_vec e = kmp_vec_zero();
        for (int j = 0; j < 3; j++)
            e.x[j] = kmp_const(tree->graph, tree->links[i].a[j][column[k]]);
        kmp_vec ie = apply(tree->graph, tree->links[i].a, true, kmp_tensor_apply(tree->graph, t, e));
        r.x[k] = ie.x[row[k]];
    }
    return r;
}

static void set_body(kmp_tree *tree, int i, const kmp_body *body)
{
    kmp_link *link = &tree->links[i];
    link->mass = kmp_tree_number(tree, &body->mass);
    link->com = kmp_link_from_model(tree, i, kmp_tree_vector(tree, body->com));
    link->inertia = tensor_from_model(tree, i, body->inertia);
}

static void set_motion(kmp_tree *tree, int k)
{
    const kmp_motion *motion = &tree->model->motions[k];
    const kmp_body *body = &tree->model->bodies[motion->body];
    kmp_link *link = &tree->links[k + 1];
    bool first = k == body->first_motion, last = k == body->first_motion + body->motion_count - 1;
    link->parent = first ? tree->body_link[body->parent] : k;
    link->body = last ? motion->body : -1;
    link->rotation = motion->rotation;
    choose_axes(link, motion->axis);
    relate_axes(link, &tree->links[link->parent]);
    link->q = kmp_input(tree->graph, KMP_IN_Q, (uint32_t)k);
    link->qd = kmp_input(tree->graph, KMP_IN_QD, (uint32_t)k);
    if (link->reversed) {
        link->q = kmp_neg(link->q);
        link->qd = kmp_neg(link->qd);
    }
    if (first && body->at >= 0)
        link->p = kmp_point_local(tree, body->at);
    if (last)
        set_body(tree, k + 1, body);
}

bool kmp_tree_init(kmp_tree *tree, kmp_graph *g, const kempe_model *model, bool keep_parameters)
{
    *tree =
        (kmp_tree){.graph = g, .model = model, .keep_parameters = keep_parameters, .count = model->motion_count + 1};
    tree->links = KMP_NEW(kmp_link, tree->count);
    tree->body_link = KMP_NEW(int, model->body_count);
    if (!tree->links || !tree->body_link) {
        kmp_tree_free(tree);
        return false;
    }
    tree->links[0].parent = -1;
    identity(tree->links[0].a);
    for (int b = 1; b < model->body_count; b++)
        tree->body_link[b] = model->bodies[b].first_motion + model->bodies[b].motion_count;
    for (int k = 0; k < model->motion_count; k++)
        set_motion(tree, k);
    tree->gravity = kmp_tree_vector(tree, model->gravity);
    return !kmp_graph_failed(g);
}

void kmp_tree_free(kmp_tree *tree)
{
    kmp_free(tree->links);
    kmp_free(tree->body_link);
    tree->links = NULL;
    tree->body_link = NULL;
}

/* -- vectors between links --------------------------------------------------------------------------- */

static void turn(const kmp_tree *tree, const kmp_link *link, kmp_ref angle, kmp_vec *v)
{
    if (link->rotation)
        kmp_rotate(tree->graph, angle, &v->x[(link->axis + 1) % 3], &v->x[(link->axis + 2) % 3]);
}

kmp_vec kmp_link_to_parent(const kmp_tree *tree, int i, kmp_vec v)
{
    kmp_link *link = &tree->links[i];
    turn(tree, link, link->q, &v);
    return link->turned ? apply(tree->graph, link->g, false, v) : v;
}

kmp_vec kmp_link_to_child(const kmp_tree *tree, int i, kmp_vec v)
{
    kmp_link *link = &tree->links[i];
    if (link->turned)
        v = apply(tree->graph, link->g, true, v);
    turn(tree, link, kmp_neg(link->q), &v);
    return v;
}

kmp_vec kmp_link_slide(const kmp_tree *tree, int i)
{
    const kmp_link *link = &tree->links[i];
    return link->rotation ? kmp_vec_zero() : kmp_vec_axis(link->q, link->axis);
}

int kmp_tree_common(const kmp_tree *tree, int i, int j)
{
    while (i != j) /* a parent has the smaller number */
        if (i > j)
            i = tree->links[i].parent;
        else
            j = tree->links[j].parent;
    return i;
}

bool kmp_tree_is_above(const kmp_tree *tree, int a, int i)
{
    while (i > a)
        i = tree->links[i].parent;
    return i == a;
}

/* -- points ------------------------------------------------------------------------------------------ */

int kmp_point_link(const kmp_tree *tree, int point)
{
    return tree->body_link[tree->model->points[point].body];
}

kmp_vec kmp_point_local(const kmp_tree *tree, int point)
{
    return kmp_link_from_model(tree, kmp_point_link(tree, point), kmp_tree_vector(tree, tree->model->points[point].at));
}

enum { MAX_RUN = 32 };

/* Vectors of one run of parallel axes, waiting to be added. */
typedef struct run {
    kmp_vec v[MAX_RUN];
    int count;
} run;

static void gather(kmp_graph *g, run *r)
{
    for (int k = 1; k < r->count; k++)
        r->v[0] = kmp_vec_add(g, r->v[0], r->v[k]);
    r->count = 1;
}

/* Whether link i turns about the same direction as the link before it did, with nothing between. */
static bool same_run(const kmp_tree *tree, int i, int before)
{
    const kmp_link *a = &tree->links[i], *b = &tree->links[before];
    return a->rotation && b->rotation && a->axis == b->axis && !b->turned;
}

kmp_vec kmp_point_position(const kmp_tree *tree, int point, int ancestor)
{
    kmp_graph *g = tree->graph;
    run r = {.count = 1};
    r.v[0] = kmp_point_local(tree, point);
    for (int i = kmp_point_link(tree, point), before = -1; i != ancestor; before = i, i = tree->links[i].parent) {
        if (before < 0 || !same_run(tree, i, before) || r.count == MAX_RUN)
            gather(g, &r);
        kmp_vec slide = kmp_link_slide(tree, i);
        for (int k = 0; k < r.count; k++)
            r.v[k] = kmp_link_to_parent(tree, i, k == 0 ? kmp_vec_add(g, r.v[0], slide) : r.v[k]);
        if (!kmp_vec_is_zero(tree->links[i].p))
            r.v[r.count++] = tree->links[i].p;
    }
    gather(g, &r);
    return r.v[0];
}

kmp_vec kmp_point_difference(const kmp_tree *tree, int a, int b, int *frame)
{
    *frame = kmp_tree_common(tree, kmp_point_link(tree, a), kmp_point_link(tree, b));
    return kmp_vec_sub(tree->graph, kmp_point_position(tree, b, *frame), kmp_point_position(tree, a, *frame));
}
