/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of closures: ball, rod, products of axes with the distance or with other axes, aligned axes, twist. Each gives
 * its rows as expressions, in the frame of the nearest common ancestor, and force or moment of its multipliers. */
#include "constraints/kinds/kind_parts.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"
#include <math.h>

int kmp_part_frame(const kmp_tree *tree, const kmp_closure *closure)
{
    return kmp_point_frame(tree, closure->point[0], closure->point[1]);
}

/* Numbers of bodies increase from parents to children. */
kmp_vec kmp_part_own(const kmp_tree *tree, const kmp_closure *closure, kmp_vec v)
{
    const kmp_point *p = kmp_model_point(tree->model, closure->point[0]);
    const kmp_point *q = kmp_model_point(tree->model, closure->point[1]);
    return kmp_body_vector_back(tree, kmp_model_common_body(tree->model, p->body, q->body), v);
}

/* e, a, b on the body of point `side` (0 or 1), axes of the frame. */
static void axes_of(const kmp_tree *tree, const kmp_closure *closure, int side, kmp_vec axes[3])
{
    double a[3], b[3];
    int frame = kmp_part_frame(tree, closure), point = closure->point[side];
    /* Vectors a and b across a unit vector e: coordinate axes when e is one. */
    const double *e = closure->axis[side];
    int k = fabs(e[2]) >= fabs(e[0]) && fabs(e[2]) >= fabs(e[1]) ? 2 : fabs(e[1]) >= fabs(e[0]) ? 1 : 0;
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double length = sqrt(e[k] * e[k] + e[i] * e[i]);
    a[k] = -e[i] / length + 0.0;
    a[i] = e[k] / length;
    a[j] = 0;
    for (int n = 0; n < 3; n++)
        b[n] = e[(n + 1) % 3] * a[(n + 2) % 3] - e[(n + 2) % 3] * a[(n + 1) % 3] + 0.0;
    axes[0] = kmp_point_direction(tree, point, closure->axis[side], frame);
    axes[1] = kmp_point_direction(tree, point, a, frame);
    axes[2] = kmp_point_direction(tree, point, b, frame);
}

kmp_vec kmp_part_gap(const kmp_tree *tree, const kmp_closure *closure)
{
    int frame;
    return kmp_point_difference(tree, closure->point[0], closure->point[1], &frame);
}

/* -- ball: the points coincide, d = 0 in the axes of the nearest common ancestor ------------------------ */

static void ball(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_vec d = kmp_part_own(tree, closure, kmp_part_gap(tree, closure));
    for (int k = 0; k < 3; k++)
        h[k] = d.x[k];
}

static kmp_vec ball_force(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], lambda[1], lambda[2]}};
}

const kmp_part kmp_part_ball = {3, 1, ball, ball_force, NULL};

/* -- rod: the distance of two points is constant or a function of time ------------------------------------- */

/* h = (d.d - L^2) / 2 with d = Q - P, smooth for every d; lambda d is the force on Q's body. */
static void rod(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    kmp_vec d = kmp_part_gap(tree, closure);
    kmp_ref half = kmp_const(g, 0.5);
    kmp_ref length =
        closure->function ? kmp_tree_bent(tree, closure->function) : kmp_tree_number(tree, &closure->number);
    h[0] = kmp_mul(g, half, kmp_sub(g, kmp_vec_dot(g, d, d), kmp_mul(g, length, length)));
}

static kmp_vec rod_force(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec d = kmp_part_gap(tree, closure);
    return kmp_part_own(tree, closure, kmp_vec_scale(tree->graph, lambda[0], d));
}

const kmp_part kmp_part_rod = {1, 2, rod, rod_force, NULL};

/* -- products of axes of the first body with d, whose force is along them; or with e2, which have a moment -- */

static void products(const kmp_tree *tree, const kmp_closure *closure, int from, int rows, bool moment, kmp_ref *h)
{
    kmp_vec first[3], second[3] = {moment ? kmp_vec_zero() : kmp_part_gap(tree, closure)};
    axes_of(tree, closure, 0, first);
    if (moment)
        axes_of(tree, closure, 1, second);
    for (int k = 0; k < rows; k++)
        h[k] = kmp_vec_dot(tree->graph, first[from + k], second[0]);
}

static kmp_vec load_of_products(const kmp_tree *tree, const kmp_closure *closure, int from, int rows, bool moment,
                                const kmp_ref *lambda)
{
    kmp_vec first[3], second[3];
    axes_of(tree, closure, 0, first);
    if (moment)
        axes_of(tree, closure, 1, second);
    kmp_graph *g = tree->graph;
    kmp_vec v = first[from];
    if (rows == 2)
        v = kmp_vec_add(g, kmp_vec_scale(g, lambda[0], v), kmp_vec_scale(g, lambda[1], first[from + 1]));
    if (moment)
        v = kmp_vec_cross(g, second[0], v);
    return kmp_part_own(tree, closure, rows == 1 ? kmp_vec_scale(g, lambda[0], v) : v);
}

/* A part of products with axes `from` (0: e1, 1: a1, 2: b1) and on. */
#define PRODUCTS(name, from, rows, moment)                                                                             \
    static void name(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)                                     \
    {                                                                                                                  \
        products(tree, closure, from, rows, moment, h);                                                                \
    }                                                                                                                  \
    static kmp_vec name##_load(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)                \
    {                                                                                                                  \
        return load_of_products(tree, closure, from, rows, moment, lambda);                                            \
    }                                                                                                                  \
    const kmp_part kmp_part_##name = {rows, !(moment), name, name##_load, NULL};

PRODUCTS(line, 1, 2, false)         /* Q is on the line through P along e1: a1.d = b1.d = 0 */
PRODUCTS(plane, 0, 1, false)        /* Q is in the plane through P that is normal to e1: e1.d = 0 */
PRODUCTS(parallel, 1, 2, true)      /* e2 is parallel to e1: a1.e2 = b1.e2 = 0 */
PRODUCTS(perpendicular, 0, 1, true) /* e1.e2 = 0 */

/* -- aligned: the points' axes are parallel -------------------------------------------------------------- */

static void point_axes(const kmp_tree *tree, const kmp_closure *closure, kmp_vec first[3], kmp_vec second[3])
{
    int frame = kmp_part_frame(tree, closure);
    kmp_point_axes(tree, closure->point[0], frame, first);
    kmp_point_axes(tree, closure->point[1], frame, second);
}

/* The skew part of the relative rotation R, half of R32 - R23, R13 - R31, R21 - R12, which is sin(angle) times the axis
 * of R; exact expressions, whose derivatives hold off the closure too. */
static void aligned(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    kmp_vec first[3], second[3];
    point_axes(tree, closure, first, second);
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        kmp_ref twice = kmp_sub(g, kmp_vec_dot(g, first[j], second[i]), kmp_vec_dot(g, first[i], second[j]));
        h[k] = kmp_mul(g, kmp_const(g, 0.5), twice);
    }
}

static kmp_vec aligned_moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_graph *g = tree->graph;
    kmp_vec first[3], second[3], moment = kmp_vec_zero();
    point_axes(tree, closure, first, second);
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        kmp_vec a = kmp_vec_cross(g, second[i], first[j]), b = kmp_vec_cross(g, second[j], first[i]);
        kmp_ref half = kmp_mul(g, kmp_const(g, 0.5), lambda[k]);
        moment = kmp_vec_add(g, moment, kmp_vec_scale(g, half, kmp_vec_sub(g, a, b)));
    }
    return kmp_part_own(tree, closure, moment);
}

const kmp_part kmp_part_aligned = {3, 0, aligned, aligned_moment, NULL};

/* -- twist: both shafts turn by the same angle ----------------------------------------------------------- */

/* Parts of 2 tan(twist/2) = n/d: n twice the skew part of the relative rotation R about the axis, d = 1 + trace of R.
 * The twist is what is left of R behind the least rotation from e1 to e2. The row has no other solution, and d is 0
 * only where the twist or the angle of the shafts is half a turn. */
typedef struct twist_parts {
    kmp_vec first[3], second[3];
    kmp_ref n, d;
} twist_parts;

static twist_parts twist_of(const kmp_tree *tree, const kmp_closure *closure)
{
    kmp_graph *g = tree->graph;
    twist_parts x = {.d = KMP_ONE};
    axes_of(tree, closure, 0, x.first);
    axes_of(tree, closure, 1, x.second);
    kmp_ref skew = kmp_sub(g, kmp_vec_dot(g, x.first[2], x.second[1]), kmp_vec_dot(g, x.first[1], x.second[2]));
    x.n = kmp_mul(g, kmp_const(g, 2), skew);
    for (int k = 0; k < 3; k++)
        x.d = kmp_add(g, x.d, kmp_vec_dot(g, x.first[k], x.second[k]));
    x.d = x.d == KMP_ZERO ? KMP_ONE : x.d; /* folded at all times: the start is refused */
    return x;
}

static void twist(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    const twist_parts x = twist_of(tree, closure);
    h[0] = kmp_div(tree->graph, x.n, x.d);
}

/* From virtual work, lambda (2 (a2 x b1 - b2 x a1) - h sum u2 x u1)/d. On the closure this is lambda (e1 + e2)/(1 +
 * e1.e2): lambda along both shafts, and lambda tan(angle/2) across either, in their plane. */
static kmp_vec twist_moment(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_graph *g = tree->graph;
    const twist_parts x = twist_of(tree, closure);
    kmp_vec of_d = kmp_vec_zero(), a = kmp_vec_cross(g, x.second[1], x.first[2]);
    kmp_vec b = kmp_vec_cross(g, x.second[2], x.first[1]);
    for (int k = 0; k < 3; k++)
        of_d = kmp_vec_add(g, of_d, kmp_vec_cross(g, x.second[k], x.first[k]));
    kmp_vec moment = kmp_vec_scale(g, kmp_const(g, 2), kmp_vec_sub(g, a, b));
    moment = kmp_vec_sub(g, moment, kmp_vec_scale(g, kmp_div(g, x.n, x.d), of_d));
    return kmp_part_own(tree, closure, kmp_vec_scale(g, kmp_div(g, lambda[0], x.d), moment));
}

const kmp_part kmp_part_twist = {1, 0, twist, twist_moment, NULL};
