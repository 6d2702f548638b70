/* SPDX-License-Identifier: BSD-3-Clause */
/* Hessians of weighted sums at a state of the public workspace. A state s = (q, qd, qdd, lambda) follows from the
 * unknowns by equations G(s) = 0: the closures h, their rates J qd + h_t and accelerations J qdd + jdqd, and
 * R = M qdd + C - J' lambda - Q. For a sum w(s) the weights mu of the equations with G_s' mu = -w_s make
 *
 *     d2 w / da db = s_a' (w_ss + mu . G_ss) s_b
 *
 * with the changes s_a and s_b of the state along the directions: the second changes of the state have no effect. */
#include "analyses/derivatives/state_derivatives.h"
#include "base/context.h"
#include "base/memory.h"
#include "linalg/dense/dot.h"
#include <math.h>
#include <string.h>

#define PART 1e-4 /* of coordinates and rates, for differences of a user-defined force */

/* -- preparation ------------------------------------------------------------------------------------- */

void kmp_derivatives_release_hessians(kmp_state_derivatives *d)
{
    kmp_curvature_free(&d->curvature);
    kmp_free(d->path);
    d->curved = false, d->path = NULL, d->paths = 0;
}

kempe_status kempe_workspace_add_hessians(kempe_workspace *ws)
{
    KMP_WANTED(NULL, ws, "workspace");
    KMP_TRY(kmp_derivatives_prepared(ws));
    kmp_state_derivatives *d = ws->derivatives.self;
    if (d->curved)
        return KEMPE_OK;
    ws->message[0] = '\0';
    kmp_context_clear(ws->system->context);
    const kempe_status status =
        kmp_curvature_init(&d->curvature, d->varied ? d->varied : ws->system, ws->eval->backend, d->outputs > 0);
    d->curved = status == KEMPE_OK;
    if (!d->curved)
        (void)kmp_workspace_fail(ws, "%s", kempe_context_message(ws->system->context));
    return status;
}

/* Room for changes of the state along each direction, and for q, qd and the force of the user. */
static kempe_status make_room(kempe_workspace *ws, int count)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    if (count <= d->paths)
        return KEMPE_OK;
    const size_t state = 3 * (size_t)ws->n + (size_t)ws->m;
    double *path = kmp_realloc(d->path, state * (size_t)count + 3 * (size_t)ws->n, sizeof *path);
    if (!path) {
        (void)kmp_workspace_fail(ws, "out of memory");
        return KEMPE_E_MEMORY;
    }
    d->path = path;
    d->paths = count;
    return KEMPE_OK;
}

/* -- the Hessian at a state ---------------------------------------------------------------------------- */

/* Puts the weights of all equations and outputs in place. */
static void weigh_equations(kempe_workspace *ws, const kmp_derivative_point *point, const kempe_forward_values *weight,
                            bool closed)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_curvature *c = &d->curvature;
    const int n = ws->n, m = ws->m;
    double *h = c->weight, *rate = h + m, *curve = rate + m, *force = curve + m, *shown = force + n;
    kmp_derivatives_weigh(ws, point, weight, NULL);
    memcpy(curve, d->a, (size_t)m * sizeof *curve);
    memcpy(force, d->force, (size_t)n * sizeof *force);
    memset(h, 0, 2 * (size_t)m * sizeof *h);
    if (closed) { /* dqd has an effect by J dqd = -rate, and dq by J dq = -h */
        kmp_reduction_pull(&ws->red, d->dqd, rate);
        for (int r = 0; r < m; r++)
            rate[r] = -rate[r];
        kmp_tangents_add_transposed(&d->tangents, KMP_RATE_Q, point->tangents, rate, d->dq);
        kmp_reduction_pull(&ws->red, d->dq, h);
        for (int r = 0; r < m; r++)
            h[r] = -h[r];
    }
    memset(shown, 0, (size_t)c->shown * sizeof *shown);
    for (int k = 0; weight->y && k < d->outputs; k++)
        shown[d->shown[k]] += weight->y[k];
}

/* The change of the state along a direction. */
static void follow(kempe_workspace *ws, const kmp_derivative_point *point, const kempe_state_direction *direction,
                   bool closed, double *path)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const size_t n = (size_t)ws->n;
    kmp_state_change along = {direction->q, direction->qd, direction->Q, NULL, -1};
    if (closed) {
        kmp_derivatives_follow(ws, point, direction->u, direction->ud, &(kmp_state_change){.name = -1}, NULL);
        along.q = d->dq;
        along.qd = d->dqd;
    }
    kmp_copy_or_zero(ws->n, along.q, path);
    kmp_copy_or_zero(ws->n, along.qd, path + n);
    kmp_derivatives_respond(ws, point, &along);
    memcpy(path + 2 * n, d->x, n * sizeof *path);
    memcpy(path + 3 * n, d->a, (size_t)ws->m * sizeof *path);
}

/* The weighted force of the user, which R has with a minus, at coordinates and rates moved along two directions. */
static double weighted_force(kempe_workspace *ws, double t, const double *a, double by_a, const double *b, double by_b,
                             double *room)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n;
    for (int i = 0; i < 2 * n; i++)
        room[i] = (i < n ? ws->q[i] : ws->qd[i - n]) + by_a * a[i] + by_b * b[i];
    kmp_system_effort(ws->system, t, room, room + n, room + 2 * n);
    return -kmp_dot(n, d->curvature.weight + 3 * ws->m, room + 2 * n);
}

/* The length of a step along a direction; 0: coordinates and rates do not move. */
static double step_along(const kempe_workspace *ws, const double *a)
{
    double most = 0;
    for (int i = 0; i < 2 * ws->n; i++)
        most =
            fmax(most, fabs(a[i]) / fmax(fabs(i < ws->n ? ws->q[i] : ws->qd[i - ws->n]), ws->system->scale[i % ws->n]));
    return most > 0 ? PART / most : 0;
}

/* The second derivative of a user-defined force, by differences. */
static double bend_of_force(kempe_workspace *ws, double t, const double *a, const double *b, double *room)
{
    const double x = step_along(ws, a), y = step_along(ws, b);
    if (x == 0 || y == 0)
        return 0;
    const double same = weighted_force(ws, t, a, x, b, y, room) + weighted_force(ws, t, a, -x, b, -y, room);
    const double other = weighted_force(ws, t, a, x, b, -y, room) + weighted_force(ws, t, a, -x, b, y, room);
    return (same - other) / (4 * x * y);
}

/* All arguments have been checked. */
static kempe_status derive_at(kempe_workspace *ws, double t, const double *q, const double *qd, const double *Q,
                              const kempe_forward_values *weight, int count, const kempe_state_direction *direction,
                              bool closed, double *hessian)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const int state = 3 * ws->n + ws->m;
    kmp_derivative_point point;
    KMP_TRY(kmp_derivatives_check_weights(ws, weight));
    KMP_TRY(kmp_derivative_point_take(ws, t, q, qd, Q, closed, &point));
    weigh_equations(ws, &point, weight, closed);
    for (int k = 0; k < count; k++)
        follow(ws, &point, &direction[k], closed, d->path + (ptrdiff_t)k * state);
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, ws->answer, ws->answer + ws->n);
    kmp_curvature_at(&d->curvature, &at);
    double *room = d->path + (ptrdiff_t)count * state;
    for (int i = 0; i < count; i++) {
        const double *path = d->path + (ptrdiff_t)i * state, *bent = kmp_curvature_along(&d->curvature, path);
        for (int k = 0; k <= i; k++) {
            const double *other = d->path + (ptrdiff_t)k * state;
            double sum = kmp_dot(state, bent, other);
            if (ws->system->force)
                sum += bend_of_force(ws, t, path, other, room);
            hessian[i + (ptrdiff_t)k * count] = hessian[k + (ptrdiff_t)i * count] = sum;
        }
    }
    return KEMPE_OK;
}

/* Checks everything but the state and the weights. */
static kempe_status check(kempe_workspace *ws, int count, const kempe_state_direction *direction, bool *closed)
{
    KMP_TRY(kmp_derivatives_prepared(ws));
    const kmp_state_derivatives *d = ws->derivatives.self;
    bool all = false;
    *closed = false;
    if (!d->curved)
        return KMP_WORKSPACE_REFUSE(ws, "Hessians are not prepared: call kempe_workspace_add_hessians first");
    if (count < 0)
        return KMP_WORKSPACE_REFUSE(ws, "a number of directions is negative: %d", count);
    for (int k = 0; k < count; k++) {
        if (direction[k].p)
            return KMP_WORKSPACE_REFUSE(
                ws, "Hessians exist along directions of coordinates, rates and Q only: leave out p");
        all = all || direction[k].q || direction[k].qd;
        *closed = *closed || direction[k].u || direction[k].ud;
        KMP_TRY(kmp_derivatives_check_direction(ws, &direction[k]));
    }
    KMP_TRY(kmp_derivatives_refuse_both(ws, all, *closed));
    return make_room(ws, count);
}

kempe_status kempe_workspace_forward_hessian(kempe_workspace *ws, double t, const double *q, const double *qd,
                                             const double *Q, const kempe_forward_values *weight, int count,
                                             const kempe_state_direction *directions, double *hessian)
{
    return kempe_workspace_hessian_states(ws, 1, &t, 0, q, qd, Q, weight, count, directions, hessian, NULL);
}

/* Arguments of a call for many states. */
typedef struct hessian_rows {
    const double *t, *q, *qd, *Q;
    int step; /* of t */
    const kempe_forward_values *weights;
    int directions;
    const kempe_state_direction *direction;
    bool closed;
    double *hessians;
} hessian_rows;

static kempe_status visit_state(kempe_workspace *ws, const void *self, int k, int count, int *done)
{
    const hessian_rows *in = self;
    const kempe_forward_values *all = in->weights;
    const int n = ws->n;
    const kempe_forward_values weight = {kmp_row_at(all->qdd, n, k), kmp_row_at(all->lambda, ws->m, k),
                                         kmp_row_at(all->y, kempe_workspace_output_count(ws), k),
                                         kmp_row_at(all->q, n, k), kmp_row_at(all->qd, n, k)};
    (void)count, (void)done;
    return derive_at(ws, in->t[in->step ? k : 0], kmp_row_at(in->q, n, k), kmp_row_at(in->qd, n, k),
                     kmp_row_at(in->Q, n, k), &weight, in->directions, in->direction, in->closed,
                     kmp_row_at(in->hessians, in->directions * in->directions, k));
}

kempe_status kempe_workspace_hessian_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                            const double *q, const double *qd, const double *Q,
                                            const kempe_forward_values *weights, int direction_count,
                                            const kempe_state_direction *directions, double *hessians, int *failed)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "weights", weights) || !kmp_workspace_given(ws, "directions", directions) ||
        !kmp_workspace_given(ws, "hessians", hessians))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_count(ws, count));
    bool closed;
    KMP_TRY(check(ws, direction_count, directions, &closed));
    const hessian_rows in = {t, q, qd, Q, t_step, weights, direction_count, directions, closed, hessians};
    return kmp_workspace_visit(ws, count, visit_state, &in, failed);
}
