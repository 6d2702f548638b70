/* SPDX-License-Identifier: BSD-3-Clause */
/* One state of a sweep: Newton's method on scaled h and the driving conditions, over u and s. Tangent and second
 * derivatives follow from one factorisation. */
#include "analyses/kinematics/sweep_point.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/dot.h"
#include <math.h>
#include <string.h>

enum { MAX_NEWTON = 12 };
/* Corrections below this part of the step cannot change the branch, and shrink as far as rounding permits. */
#define SEEN 1e-3

double kmp_sweep_parameter_value(const kmp_sweep_parameter *parameter, double s)
{
    return s == 1 ? parameter->to : parameter->from + s * (parameter->to - parameter->from);
}

/* t at s, and dt/ds */
static double time_at(const kmp_sweep *w, double s)
{
    return w->time < 0 ? 0 : kmp_sweep_parameter_value(&w->parameter[w->time], s);
}

static double pace_of_time(const kmp_sweep *w)
{
    return w->time < 0 ? 0 : w->parameter[w->time].to - w->parameter[w->time].from;
}

/* Derivatives of each x along each of u and along s, in their units: rows of w->span. */
static void span(kmp_sweep *w)
{
    int n = w->n, p = w->part.p;
    double *row = w->span, pace = pace_of_time(w) * w->unit[n];
    for (int i = 0; i < n; i++, row += p + 1) {
        for (int j = 0; j < p; j++)
            row[j] = w->red.x[i + j * n] * w->unit[w->part.u[j]];
        row[p] = w->red.x_t[i] * pace;
    }
    row[p] = w->unit[n];
}

bool kmp_sweep_evaluate(kmp_sweep *w, const double *x)
{
    kmp_eval_closure(w->eval, time_at(w, x[w->n]), x);
    if (!w->red.eval || kmp_reduction_factor(&w->red))
        return false;
    kmp_reduction_tangent(&w->red);
    span(w);
    return true;
}

const double *kmp_sweep_jacobian(kmp_sweep *w)
{
    if (!w->any_dropped)
        return w->eval->jacobian;
    kmp_eval_mask(w->eval, w->dropped, w->masked);
    return w->masked;
}

double kmp_sweep_margin(kmp_sweep *w, const kmp_sweep_pose *pose)
{
    double t = time_at(w, pose->x[w->n]);
    kmp_eval_closure(w->eval, t, pose->x);
    kmp_eval_use_closure(w->eval, t, pose->x, w->eval->h, kmp_sweep_jacobian(w), w->eval->h_t);
    return kmp_rank_margin_at(&w->margin, w->eval);
}

/* -- measures ---------------------------------------------------------------------------------------- */

double kmp_sweep_cosine(const kmp_sweep *w, const kmp_sweep_pose *a, const kmp_sweep_pose *b)
{
    double sum = 0;
    for (int i = 0; i <= w->n; i++)
        sum += a->dx[i] / w->unit[i] * (b->dx[i] / w->unit[i]);
    return sum;
}

double kmp_sweep_offset(const kmp_sweep *w, const kmp_sweep_pose *a, const kmp_sweep_pose *b)
{
    double sum = 0;
    for (int i = 0; i <= w->n; i++)
        sum += a->dx[i] / w->unit[i] * ((b->x[i] - a->x[i]) / w->unit[i]);
    return sum;
}

double kmp_sweep_fastest(const kmp_sweep *w, const kmp_sweep_pose *pose)
{
    double most = 0;
    for (int i = 0; i < w->n; i++)
        most = fmax(most, fabs(pose->dx[i]) / w->unit[i]);
    return most;
}

/* -- conditions on u and s --------------------------------------------------------------------------- */

/* Gradients with respect to x of the conditions, normalised, each a row of w->gradient: driven coordinates are on their
 * line, moving rows are closed. The last condition is the distance along the tangent of `base` (NULL: along s). */
static void put_gradients(kmp_sweep *w, const kmp_sweep_pose *base)
{
    const kmp_pattern *j = &w->system->jacobian;
    int n = w->n;
    double *row = w->gradient;
    memset(row, 0, (size_t)((w->p + 1) * (n + 1)) * sizeof *row);
    for (int k = 0; k < w->count; k++)
        if (k != w->time) {
            const kmp_sweep_parameter *parameter = &w->parameter[k];
            row[parameter->coordinate] = 1 / w->unit[parameter->coordinate];
            row[n] = (parameter->from - parameter->to) / w->unit[parameter->coordinate];
            row += n + 1;
        }
    for (int k = 0; k < w->moving_count; k++, row += n + 1) {
        int r = w->moving[k];
        for (int e = 0; e < j->count; e++)
            if (j->row[e] == r)
                row[j->col[e]] = w->eval->jacobian[e] / w->system->row_scale[r];
        row[n] = w->eval->h_t[r] * pace_of_time(w) / w->system->row_scale[r];
    }
    for (int i = 0; base && i <= n; i++)
        row[i] = base->dx[i] / (w->unit[i] * w->unit[i]);
    if (!base)
        row[n] = 1 / w->unit[n];
}

/* Changes of the first `count` conditions along as many columns of the span; most gradients are sparse. */
static void put_matrix(kmp_sweep *w, int count)
{
    const double *g = w->gradient;
    memset(w->matrix, 0, (size_t)(count * count) * sizeof *w->matrix);
    for (int k = 0; k < count; k++)
        for (int i = 0; i <= w->n; i++, g++)
            for (int j = 0; *g != 0 && j < count; j++)
                w->matrix[k + j * count] += *g * w->span[i * (w->p + 1) + j];
}

/* Factors all conditions at the last evaluation; no right-hand side is needed. False: they are singular. */
static bool factor(kmp_sweep *w, const kmp_sweep_pose *base)
{
    put_gradients(w, base);
    put_matrix(w, w->p + 1);
    memset(w->rhs, 0, (size_t)(w->p + 1) * sizeof *w->rhs);
    return kmp_lu_factor(w->p + 1, w->matrix, w->order) == 0;
}

/* v drifts by -Jv^-1 rows while u and s stay. */
static void take_drift(kmp_sweep *w, const double *rows)
{
    memset(w->drift, 0, (size_t)(w->n + 1) * sizeof *w->drift);
    kmp_reduction_push_in(&w->red, -1, rows, w->red.room, w->drift);
    for (int k = 0; k <= w->p; k++)
        w->rhs[k] -= kmp_dot(w->n + 1, w->gradient + k * (w->n + 1), w->drift);
}

/* dx for the changes w->rhs of the conditions, in addition to the drift (NULL: none). */
static void meet(kmp_sweep *w, const double *drift, double *dx)
{
    int all = w->p + 1;
    kmp_lu_solve(all, w->matrix, w->order, 1, w->rhs);
    for (int i = 0; i <= w->n; i++)
        dx[i] = (drift ? drift[i] : 0) + kmp_dot(all, w->span + i * all, w->rhs);
}

/* -- closing ----------------------------------------------------------------------------------------- */

/* A state that is being closed, towards a target. */
typedef struct closing {
    kmp_sweep *w;
    const kmp_sweep_target *target;
    const double *x; /* of the last `place` */
} closing;

static int place(void *self, double t, const double *x)
{
    closing *c = self;
    (void)t;
    c->x = x;
    return !kmp_sweep_evaluate(c->w, x);
}

static bool correct(void *self, const double *violation, double *dx)
{
    closing *c = self;
    kmp_sweep *w = c->w;
    const kmp_sweep_pose *base = c->target->base;
    int row = 0;
    if (!factor(w, base))
        return false;
    for (int k = 0; k < w->count; k++)
        if (k != w->time) {
            int i = w->parameter[k].coordinate;
            w->rhs[row++] = (kmp_sweep_parameter_value(&w->parameter[k], c->x[w->n]) - c->x[i]) / w->unit[i];
        }
    for (int k = 0; k < w->moving_count; k++)
        w->rhs[row++] = -violation[w->moving[k]] / w->system->row_scale[w->moving[k]];
    w->rhs[row] = (c->target->s - c->x[w->n]) / w->unit[w->n];
    if (base)
        w->rhs[row] = c->target->offset - kmp_sweep_offset(w, base, &(kmp_sweep_pose){.x = (double *)c->x});
    take_drift(w, violation);
    meet(w, w->drift, dx);
    w->effort.newton++;
    return true;
}

bool kmp_sweep_close(kmp_sweep *w, const kmp_sweep_target *target, kmp_sweep_pose *pose, double *first, double *ratio)
{
    closing c = {.w = w, .target = target};
    const kmp_closer closer = {.self = &c,
                               .eval = w->eval,
                               .scale = w->unit,
                               .count = w->n + 1,
                               .dx = w->dx,
                               .place = place,
                               .correct = correct};
    const kmp_close_rule rule = {.most = MAX_NEWTON,
                                 .contracting = true,
                                 .led = true,
                                 .enough = kmp_close_rounding(w->system),
                                 .seen = SEEN * fabs(target->offset)};
    kmp_closed closed = kmp_close(&closer, &rule, 0, pose->x);
    *first = closed.first;
    *ratio = closed.ratio;
    return closed.closed;
}

/* -- tangent and derivatives ------------------------------------------------------------------------- */

bool kmp_sweep_tangent(kmp_sweep *w, kmp_sweep_pose *pose, const kmp_sweep_pose *along)
{
    if (!kmp_sweep_evaluate(w, pose->x) || !factor(w, along))
        return false;
    w->rhs[w->p] = 1;
    meet(w, NULL, pose->dx);
    double length = sqrt(kmp_sweep_cosine(w, pose, pose));
    for (int i = 0; i <= w->n; i++)
        pose->dx[i] /= length;
    return isfinite(length);
}

double kmp_sweep_hold(kmp_sweep *w, const kmp_sweep_pose *pose)
{
    int p = w->p;
    if (p == 0)
        return 1;
    if (!kmp_sweep_evaluate(w, pose->x))
        return 0;
    put_gradients(w, NULL);
    put_matrix(w, p);
    kmp_lu_complete(p, p, w->matrix, NULL, w->order, w->order + p + 1, w->pivots);
    /* Each leading row is at most as long as the motion that X can show: 1.5 a column. */
    return w->pivots[p - 1] / fmax(1, w->pivots[0]);
}

/* jdqd at rates qs: at constant time it is the second-order part of the rates alone. */
static void take_curve(kmp_sweep *w, const double *qs)
{
    kmp_evaluator *eval = w->eval;
    double pace = pace_of_time(w);
    int m = w->system->m;
    kmp_eval_mass(eval);
    if (pace != 0 || !eval->h_t) {
        for (int i = 0; i < w->n; i++)
            w->dx[i] = pace != 0 ? qs[i] / pace : qs[i];
        kmp_eval_bias(eval, w->dx);
        for (int r = 0; r < m; r++)
            w->jd[r] = eval->jdqd[r] * (pace != 0 ? pace * pace : 1);
        return;
    }
    memset(w->jd, 0, (size_t)m * sizeof *w->jd);
    for (int k = -1; k <= 1; k++) {
        for (int i = 0; i < w->n; i++)
            w->dx[i] = k * qs[i];
        kmp_eval_bias(eval, w->dx);
        for (int r = 0; r < m; r++)
            w->jd[r] += k == 0 ? -eval->jdqd[r] : eval->jdqd[r] / 2;
    }
}

bool kmp_sweep_derivatives(kmp_sweep *w, const kmp_sweep_pose *pose, double *qs, double *qss)
{
    if (!kmp_sweep_evaluate(w, pose->x) || !factor(w, NULL))
        return false;
    w->rhs[w->p] = 1 / w->unit[w->n];
    meet(w, NULL, qs);
    take_curve(w, qs);
    memset(w->rhs, 0, (size_t)(w->p + 1) * sizeof *w->rhs);
    for (int k = 0; k < w->moving_count; k++)
        w->rhs[w->p - w->moving_count + k] = -w->jd[w->moving[k]] / w->system->row_scale[w->moving[k]];
    take_drift(w, w->jd);
    meet(w, w->drift, qss);
    bool finite = true;
    for (int i = 0; i < w->n; i++)
        finite = finite && isfinite(qs[i]) && isfinite(qss[i]);
    return finite;
}
