/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/sweep_point.h"
#include "constraints/close.h"
#include <math.h>
#include <string.h>

enum { MAX_NEWTON = 12 };
/* Corrections below this part of the step lead nowhere else, and shrink as rounding lets them. */
#define SEEN 1e-3

double kmp_lead_value(const kmp_lead *lead, double s)
{
    return s == 1 ? lead->to : lead->from + s * (lead->to - lead->from);
}

static double time_at(const kmp_sweep *w, double s)
{
    return w->time < 0 ? 0 : kmp_lead_value(&w->lead[w->time], s);
}

/* dt/ds */
static double pace_of_time(const kmp_sweep *w)
{
    return w->time < 0 ? 0 : w->lead[w->time].to - w->lead[w->time].from;
}

/* Rows that are dropped are closed whatever happens. */
static void drop(kmp_sweep *w, double t, const double *q)
{
    const kempe_system *s = w->system;
    kmp_plant *plant = w->plant;
    memcpy(w->h, plant->h, (size_t)s->m * sizeof *w->h);
    memcpy(w->jacobian, plant->jacobian, (size_t)s->jacobian.count * sizeof *w->jacobian);
    if (plant->h_t)
        memcpy(w->h_t, plant->h_t, (size_t)s->m * sizeof *w->h_t);
    for (int r = 0; r < s->m; r++)
        if (w->dropped[r])
            w->h[r] = w->h_t[r] = 0;
    for (int e = 0; e < s->jacobian.count; e++)
        if (w->dropped[s->jacobian.row[e]])
            w->jacobian[e] = 0;
    kmp_plant_lend_closure(plant, t, q, w->h, w->jacobian, plant->h_t ? w->h_t : NULL);
}

static void close_at(kmp_sweep *w, double s, const double *q)
{
    double t = time_at(w, s);
    kmp_plant_closure(w->plant, t, q);
    w->full_h = w->plant->h;
    w->full_jacobian = w->plant->jacobian;
    w->full_h_t = w->plant->h_t;
    if (w->any_dropped)
        drop(w, t, q);
}

bool kmp_sweep_evaluate(kmp_sweep *w, double s, const double *q)
{
    close_at(w, s, q);
    if (!w->reduced || kmp_reduction_factor(&w->red))
        return false;
    kmp_reduction_tangent(&w->red);
    kmp_reduction_correction(&w->red);
    return true;
}

double kmp_sweep_margin(kmp_sweep *w, const kmp_pose *pose)
{
    close_at(w, pose->s, pose->q);
    return kmp_margin_at(&w->margin, w->plant);
}

/* -- measures ---------------------------------------------------------------------------------------- */

double kmp_sweep_cosine(const kmp_sweep *w, const kmp_pose *a, const kmp_pose *b)
{
    double sum = w->size * w->size * a->ds * b->ds;
    for (int i = 0; i < w->n; i++)
        sum += a->dq[i] / w->system->scale[i] * (b->dq[i] / w->system->scale[i]);
    return sum;
}

double kmp_sweep_offset(const kmp_sweep *w, const kmp_pose *a, const kmp_pose *b)
{
    double sum = w->size * w->size * a->ds * (b->s - a->s);
    for (int i = 0; i < w->n; i++)
        sum += a->dq[i] / w->system->scale[i] * ((b->q[i] - a->q[i]) / w->system->scale[i]);
    return sum;
}

double kmp_sweep_share(const kmp_sweep *w, const kmp_pose *pose, int coordinate)
{
    double most = 0;
    for (int i = 0; i < w->n; i++)
        most = fmax(most, fabs(pose->dq[i]) / w->system->scale[i]);
    return most > 0 ? fabs(pose->dq[coordinate]) / w->system->scale[coordinate] / most : 0;
}

/* max |dx| in scales */
static double size_of(const kmp_sweep *w, const double *dq, double ds)
{
    double size = w->size * fabs(ds);
    for (int i = 0; i < w->n; i++)
        size = fmax(size, fabs(dq[i]) / w->system->scale[i]);
    return isfinite(size) && isfinite(ds) ? size : INFINITY;
}

/* -- the leading coordinates among u and s ----------------------------------------------------------- */

void kmp_sweep_motion_row(const kmp_sweep *w, int c, double *row, int stride)
{
    const double *scale = w->system->scale;
    for (int j = 0; j < w->p; j++)
        row[j * stride] = w->red.x[c + j * w->n] * scale[w->part.u[j]] / scale[c];
}

/* J x of a row of h with all it has. */
static double row_times(const kmp_sweep *w, int r, const double *x)
{
    const kmp_pattern *j = &w->system->jacobian;
    double sum = 0;
    for (int e = 0; e < j->count; e++) /* entries are row by row; moving rows are few */
        if (j->row[e] == r)
            sum += w->full_jacobian[e] * x[j->col[e]];
    return sum;
}

void kmp_sweep_moving_row(const kmp_sweep *w, int r, double *row, int stride)
{
    const double *scale = w->system->scale;
    for (int j = 0; j < w->p; j++)
        row[j * stride] = row_times(w, r, w->red.x + j * w->n) * scale[w->part.u[j]] / w->system->row_scale[r];
}

/* d(lead)/d(u, s), in scales, of the last evaluation: a coordinate moves by X du + x_t t' ds and ought to move by (to -
 * from) ds, of a moving row J X du + (J x_t + h_t) t' ds = 0. */
static void lead_row(const kmp_sweep *w, const kmp_lead *lead, double *row, int stride)
{
    int c = lead->coordinate;
    kmp_sweep_motion_row(w, c, row, stride);
    row[w->p * stride] = (w->red.x_t[c] * pace_of_time(w) - (lead->to - lead->from)) / w->system->scale[c] / w->size;
}

static void moving_row(const kmp_sweep *w, int r, double *row, int stride)
{
    kmp_sweep_moving_row(w, r, row, stride);
    row[w->p * stride] =
        (row_times(w, r, w->red.x_t) + w->full_h_t[r]) * pace_of_time(w) / w->system->row_scale[r] / w->size;
}

/* p x (p + 1) in an array with that leading dimension. */
static void lead_rows(const kmp_sweep *w, double *a, int leading)
{
    int row = 0;
    for (int k = 0; k < w->count; k++)
        if (k != w->time)
            lead_row(w, &w->lead[k], a + row++, leading);
    for (int k = 0; k < w->moving_count; k++)
        moving_row(w, w->moving[k], a + row++, leading);
}

/* What is left of them when all but s moves by dq: right-hand sides. `of_row`: for moving rows, m values to add. */
static void lead_rest(const kmp_sweep *w, const double *of_lead, const double *of_row, const double *dq)
{
    const double *scale = w->system->scale;
    int row = 0;
    for (int k = 0; k < w->count; k++)
        if (k != w->time)
            w->rhs[row++] = (of_lead[k] - dq[w->lead[k].coordinate]) / scale[w->lead[k].coordinate];
    for (int k = 0; k < w->moving_count; k++) {
        int r = w->moving[k];
        w->rhs[row++] = -(of_row[r] + row_times(w, r, dq)) / w->system->row_scale[r];
    }
}

/* dq of scaled (du, ds). */
static void spread(const kmp_sweep *w, const double *x, double *dq)
{
    double ds = x[w->p] / w->size, pace = pace_of_time(w);
    for (int i = 0; i < w->n; i++)
        dq[i] = w->red.x_t[i] * pace * ds;
    for (int j = 0; j < w->p; j++) {
        double du = x[j] * w->system->scale[w->part.u[j]];
        for (int i = 0; i < w->n; i++)
            dq[i] += w->red.x[i + j * w->n] * du;
    }
}

/* The last row of the corrector: across the base's tangent, or on s. */
static void across(kmp_sweep *w, const kmp_sweep_target *target, const kmp_pose *pose, const double *drift)
{
    int p = w->p, stride = p + 1;
    const kmp_pose *base = target->base;
    const double *scale = w->system->scale;
    for (int j = 0; j <= p; j++)
        w->matrix[p + j * stride] = j == p;
    w->rhs[p] = w->size * (target->s - pose->s);
    if (!base)
        return;
    double time = w->size * base->ds, along = 0;
    for (int i = 0; i < w->n; i++) {
        time += base->dq[i] / scale[i] * (w->red.x_t[i] * pace_of_time(w) / scale[i]) / w->size;
        along += base->dq[i] / scale[i] * (drift[i] / scale[i]);
    }
    for (int j = 0; j < p; j++) {
        double sum = 0;
        for (int i = 0; i < w->n; i++)
            sum += base->dq[i] / scale[i] * (w->red.x[i + j * w->n] / scale[i]);
        w->matrix[p + j * stride] = sum * scale[w->part.u[j]];
    }
    w->matrix[p + p * stride] = time;
    w->rhs[p] = target->offset - kmp_sweep_offset(w, base, pose) - along;
}

/* What is closed: (q, s), towards a target. */
typedef struct closing {
    kmp_sweep *w;
    const kmp_sweep_target *target;
    kmp_pose pose; /* of the last `place` */
} closing;

static int place(void *self, double t, const double *x)
{
    closing *c = self;
    (void)t;
    memcpy(c->pose.q, x, (size_t)c->w->n * sizeof *x);
    c->pose.s = x[c->w->n];
    return !kmp_sweep_evaluate(c->w, c->pose.s, c->pose.q);
}

static bool correct(void *self, const double *violation, double *dx)
{
    closing *c = self;
    kmp_sweep *w = c->w;
    int p = w->p;
    double *drift = w->normal; /* of q at u and s as they are */
    (void)violation;
    memset(drift, 0, (size_t)w->n * sizeof *drift);
    for (int i = 0; i < w->red.r; i++)
        drift[w->part.v[i]] = w->red.dv[i];
    lead_rows(w, w->matrix, p + 1);
    for (int k = 0; k < w->count; k++)
        w->ahead[k] = k == w->time ? 0 : kmp_lead_value(&w->lead[k], c->pose.s) - c->pose.q[w->lead[k].coordinate];
    lead_rest(w, w->ahead, w->full_h, drift);
    across(w, c->target, &c->pose, drift);
    if (kmp_lu_factor(p + 1, w->matrix, w->order))
        return false;
    kmp_lu_solve(p + 1, w->matrix, w->order, 1, w->rhs);
    spread(w, w->rhs, dx);
    for (int i = 0; i < w->n; i++)
        dx[i] += drift[i];
    dx[w->n] = w->rhs[p] / w->size;
    w->newton++;
    return true;
}

bool kmp_sweep_close(kmp_sweep *w, const kmp_sweep_target *target, kmp_pose *pose, double *first, double *ratio)
{
    closing c = {.w = w, .target = target, .pose = *pose};
    const kmp_closer closer = {.self = &c,
                               .plant = w->plant,
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
    memcpy(w->unit, w->system->scale, (size_t)w->n * sizeof *w->unit);
    w->unit[w->n] = 1 / w->size;
    memcpy(w->x, pose->q, (size_t)w->n * sizeof *w->x);
    w->x[w->n] = pose->s;
    kmp_closed closed = kmp_close(&closer, &rule, 0, w->x);
    memcpy(pose->q, w->x, (size_t)w->n * sizeof *w->x);
    pose->s = w->x[w->n];
    *first = closed.first;
    *ratio = closed.ratio;
    return closed.closed;
}

/* -- tangent and derivatives ------------------------------------------------------------------------- */

/* The null vector of p x (p + 1) in `matrix`, by complete pivoting, in `rhs`. */
static bool null_vector(kmp_sweep *w)
{
    int p = w->p, *row = w->order, *column = w->order + p + 1;
    double *a = w->matrix, *x = w->dx; /* n >= p values */
    kmp_lu_complete(p, p + 1, a, NULL, row, column, w->pivots);
    for (int i = p - 1; i >= 0; i--) {
        double sum = -a[i + p * p];
        for (int j = i + 1; j < p; j++)
            sum -= a[i + j * p] * x[j];
        x[i] = sum / a[i + i * p];
        if (!isfinite(x[i]))
            return false;
    }
    for (int i = 0; i < p; i++)
        w->rhs[column[i]] = x[i];
    w->rhs[column[p]] = 1;
    return true;
}

bool kmp_sweep_tangent(kmp_sweep *w, kmp_pose *pose, const kmp_pose *along)
{
    if (!kmp_sweep_evaluate(w, pose->s, pose->q))
        return false;
    lead_rows(w, w->matrix, w->p);
    if (!null_vector(w))
        return false;
    pose->ds = w->rhs[w->p] / w->size;
    spread(w, w->rhs, pose->dq);
    double length = sqrt(kmp_sweep_cosine(w, pose, pose));
    double sign = along ? kmp_sweep_cosine(w, along, pose) : pose->ds;
    length = sign < 0 ? -length : length;
    for (int i = 0; i < w->n; i++)
        pose->dq[i] /= length;
    pose->ds /= length;
    return isfinite(pose->ds);
}

double kmp_sweep_hold(kmp_sweep *w, const kmp_pose *pose)
{
    int p = w->p;
    if (p == 0)
        return 1;
    if (!kmp_sweep_evaluate(w, pose->s, pose->q))
        return 0;
    lead_rows(w, w->matrix, p);
    kmp_lu_complete(p, p, w->matrix, NULL, w->order, w->order + p + 1, w->pivots);
    /* Each leading row is at most as long as the motion that X can show: 1.5 a column. */
    return w->pivots[p - 1] / fmax(1, w->pivots[0]);
}

/* jdqd at rates qs: with the time standing still it is the part of second order in the rates alone. */
static void take_curve(kmp_sweep *w, const double *qs)
{
    kmp_plant *plant = w->plant;
    double pace = pace_of_time(w);
    int m = w->system->m;
    kmp_plant_mass(plant);
    if (pace != 0 || !plant->h_t) {
        for (int i = 0; i < w->n; i++)
            w->dx[i] = pace != 0 ? qs[i] / pace : qs[i];
        kmp_plant_bias(plant, w->dx);
        for (int r = 0; r < m; r++)
            w->jd[r] = plant->jdqd[r] * (pace != 0 ? pace * pace : 1);
        return;
    }
    memset(w->jd, 0, (size_t)m * sizeof *w->jd);
    for (int k = -1; k <= 1; k++) {
        for (int i = 0; i < w->n; i++)
            w->dx[i] = k * qs[i];
        kmp_plant_bias(plant, w->dx);
        for (int r = 0; r < m; r++)
            w->jd[r] += k == 0 ? -plant->jdqd[r] : plant->jdqd[r] / 2;
    }
}

/* (E X) x = rhs for the leading coordinates E, factors in `matrix`. */
static bool factor_leads(kmp_sweep *w)
{
    lead_rows(w, w->matrix, w->p);
    return kmp_lu_factor(w->p, w->matrix, w->order) == 0;
}

bool kmp_sweep_derivatives(kmp_sweep *w, const kmp_pose *pose, double *qs, double *qss)
{
    int p = w->p;
    const double *scale = w->system->scale;
    double pace = pace_of_time(w);
    if (!kmp_sweep_evaluate(w, pose->s, pose->q) || !factor_leads(w))
        return false;
    for (int i = 0; i < w->n; i++)
        w->normal[i] = w->red.x_t[i] * pace;
    for (int k = 0; k < w->count; k++)
        w->ahead[k] = w->lead[k].to - w->lead[k].from;
    for (int k = 0; k < w->moving_count; k++)
        w->jd[w->moving[k]] = w->full_h_t[w->moving[k]] * pace;
    lead_rest(w, w->ahead, w->jd, w->normal);
    kmp_lu_solve(p, w->matrix, w->order, 1, w->rhs);
    w->rhs[p] = w->size;
    spread(w, w->rhs, qs);
    take_curve(w, qs);
    for (int i = 0; i < w->red.r; i++)
        w->red.dv[i] = -w->jd[w->part.rows[i]];
    if (w->red.r > 0)
        kmp_block_solve(w->red.block, 1, w->red.dv);
    memset(w->normal, 0, (size_t)w->n * sizeof *w->normal);
    for (int i = 0; i < w->red.r; i++)
        w->normal[w->part.v[i]] = w->red.dv[i];
    memset(w->ahead, 0, (size_t)w->count * sizeof *w->ahead);
    lead_rest(w, w->ahead, w->jd, w->normal);
    kmp_lu_solve(p, w->matrix, w->order, 1, w->rhs);
    for (int i = 0; i < w->n; i++) {
        qss[i] = w->normal[i];
        for (int j = 0; j < p; j++)
            qss[i] += w->red.x[i + j * w->n] * w->rhs[j] * scale[w->part.u[j]];
    }
    for (int k = 0; k < w->count; k++) /* what leads is known */
        if (k != w->time) {
            qs[w->lead[k].coordinate] = w->lead[k].to - w->lead[k].from;
            qss[w->lead[k].coordinate] = 0;
        }
    return size_of(w, qs, 0) < INFINITY && size_of(w, qss, 0) < INFINITY;
}
