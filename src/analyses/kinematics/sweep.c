/* SPDX-License-Identifier: BSD-3-Clause */
/* Pseudo-arclength continuation (Keller 1977; Allgower and Georg 1990): predictor along the tangent, Newton corrector
 * across it, step control by the angle of tangents and the convergence of corrections. */
#include "analyses/kinematics/sweep.h"
#include "analyses/kinematics/path_bounds.h"
#include "analyses/parts/closed_state.h"
#include "base/arena.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include <float.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The end of a corrector: at s (base NULL), or at the distance `offset` along the tangent of `base`. */
typedef struct kmp_sweep_target {
    const kmp_sweep_pose *base;
    double offset, s;
} kmp_sweep_target;

/* -- one state ---------------------------------------------------------------------------------------------- */

/* Newton's method on scaled h and the driving conditions, over u and s. Tangent and second derivatives follow from one
 * factorisation. */

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

/* Closures, factors and the tangent space at x and the time t. false: Jv is singular. */
static bool evaluate_at_time(kmp_sweep *w, double t, const double *x)
{
    kmp_eval_closure(w->eval, t, x);
    if (!w->red.eval || kmp_reduction_factor(&w->red))
        return false;
    kmp_reduction_tangent(&w->red);
    span(w);
    return true;
}

static bool evaluate_at(kmp_sweep *w, const double *x)
{
    return evaluate_at_time(w, time_at(w, x[w->n]), x);
}

/* J of the evaluator's last closure without the dropped rows, valid until the next call. */
static const double *dropped_jacobian(kmp_sweep *w)
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
    kmp_eval_use_closure(w->eval, t, pose->x, w->eval->h, dropped_jacobian(w), w->eval->h_t);
    return kmp_rank_margin_at(&w->margin, w->eval);
}

/* -- measures ---------------------------------------------------------------------------------------- */

/* <a's tangent, b's tangent>, and the offset of b along a's tangent. */
static double cosine_between(const kmp_sweep *w, const kmp_sweep_pose *a, const kmp_sweep_pose *b)
{
    double sum = 0;
    for (int i = 0; i <= w->n; i++)
        sum += a->dx[i] / w->unit[i] * (b->dx[i] / w->unit[i]);
    return sum;
}

static double offset_along(const kmp_sweep *w, const kmp_sweep_pose *a, const kmp_sweep_pose *b)
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
    return !evaluate_at(c->w, x);
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
        w->rhs[row] = c->target->offset - offset_along(w, base, &(kmp_sweep_pose){.x = (double *)c->x});
    take_drift(w, violation);
    meet(w, w->drift, dx);
    w->effort.newton++;
    return true;
}

/* Closes `pose` by Newton; `first`: the size of the first correction, `ratio`: the worst of one over that before it
 * while they are above rounding. false: it does not converge. */
static bool close_pose(kmp_sweep *w, const kmp_sweep_target *target, kmp_sweep_pose *pose, double *first, double *ratio)
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

/* The unit tangent at a closed pose, along the tangent of `along` (NULL: with increasing s). False: Jv is singular. */
static bool find_tangent(kmp_sweep *w, kmp_sweep_pose *pose, const kmp_sweep_pose *along)
{
    if (!evaluate_at(w, pose->x) || !factor(w, along))
        return false;
    w->rhs[w->p] = 1;
    meet(w, NULL, pose->dx);
    double length = sqrt(cosine_between(w, pose, pose));
    for (int i = 0; i <= w->n; i++)
        pose->dx[i] /= length;
    return isfinite(length);
}

double kmp_sweep_hold(kmp_sweep *w, const kmp_sweep_pose *pose)
{
    int p = w->p;
    if (p == 0)
        return 1;
    if (!evaluate_at(w, pose->x))
        return 0;
    put_gradients(w, NULL);
    put_matrix(w, p);
    kmp_lu_complete(p, p, w->matrix, NULL, w->order, w->order + p + 1, w->pivots);
    /* Each leading row is at most as long as the motion that X can show: 1.5 a column. */
    return w->pivots[p - 1] / fmax(1, w->pivots[0]);
}

/* jdqd at rates qs: at constant time it is only the second-order part of the rates. */
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

/* dx/ds and d2x/ds2 at a closed pose, where s determines it; where a drive jumps, the ones before. false: it does not.
 */
static bool find_derivatives(kmp_sweep *w, const kmp_sweep_pose *pose, double *qs, double *qss)
{
    const double t = time_at(w, pose->x[w->n]);
    const double at = w->time >= 0 ? kmp_eval_row_time(w->eval, t, pose->x, pose->dx) : t;
    if (!evaluate_at_time(w, at, pose->x) || !factor(w, NULL))
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

/* A step: the first one, the longest (of any coordinate, scaled; of s when time is swept), the shortest. */
#define FIRST_STEP 0.02
#define LONGEST    0.35
#define LONGEST_S  0.02
#define SHORTEST   1e-9
#define MOST_STEPS 1000000
/* A step is accepted when tangents turn by less than about KMP_SWEEP_TURN, the first correction is below this part of
 * the step, and each correction is below this part of the one before. */
#define LEAST_COSINE (1 - KMP_SWEEP_TURN * KMP_SWEEP_TURN / 2)
#define MOST_OFF     0.2
#define CONTRACTION  0.3
/* Near a change point no step is longer than the first part of its apparent distance. A change of sign that steps of
 * SHORT cannot resolve is a change point too. */
#define APPROACH 0.5
#define NEAR     0.3
#define SHORT    1e-7
/* Relative tolerance of driven rows. */
#define FOLLOWS 1e-6
/* A corner of the path, where the rate of a drive jumps or a closure has a kink, is passed by no step. The position
 * continues behind it: this part of the path farther, by a correction that is below CORNER_MOST. */
#define CORNER      (8 * SHORTEST)
#define CORNER_MOST 1e-5
/* A row is found by bracketing, not by Newton on s, where s changes more slowly, relative to the motion, than this part
 * of its fastest change. */
#define SLOW 0.05

/* SAMPLES: the number of intervals of time in the search for rows that move. SAMPLED: of a longest step, the pieces at
 * whose ends h is compared where it has no bounds. */
enum { EPSILONS = 64, MOST_LEAPS = 6, SAMPLES = 7, SAMPLED = 64 };

/* -- making and standing ----------------------------------------------------------------------------- */

static void pose_copy(const kmp_sweep *w, const kmp_sweep_pose *from, kmp_sweep_pose *to)
{
    memcpy(to->x, from->x, (size_t)(w->n + 1) * sizeof *to->x);
    memcpy(to->dx, from->dx, (size_t)(w->n + 1) * sizeof *to->dx);
}

static void poses_swap(kmp_sweep_pose *a, kmp_sweep_pose *b)
{
    kmp_sweep_pose c = *a;
    *a = *b;
    *b = c;
}

kempe_status kmp_sweep_init(kmp_sweep *sweep, const kempe_system *system, const char *backend, const bool *closures)
{
    *sweep = (kmp_sweep){.system = system, .n = system->n, .time = -1};
    sweep->eval = kmp_eval_new(system, backend);
    if (!sweep->eval)
        return KEMPE_E_MEMORY;
    sweep->eval->inputs.before = true;
    ptrdiff_t x = system->n + 1, m = system->m;
    if (!KMP_ARENA_MAKE(&sweep->arena, KMP_ROOM(bool, m, &sweep->dropped), KMP_ROOM(int, m, &sweep->moving),
                        KMP_ROOM(double, x, &sweep->here.x, &sweep->here.dx, &sweep->next.x, &sweep->next.dx,
                                 &sweep->between.x, &sweep->between.dx, &sweep->entry.x, &sweep->entry.dx, &sweep->unit,
                                 &sweep->drift, &sweep->dx, &sweep->xs, &sweep->xss),
                        KMP_ROOM(double, m, &sweep->jd), KMP_ROOM(double, system->jacobian.count, &sweep->masked))) {
        kmp_sweep_free(sweep);
        return kmp_fail_memory(system->context);
    }
    sweep->path = kmp_path_bounds_new(sweep);
    if (!sweep->path) {
        kmp_sweep_free(sweep);
        return kmp_fail_memory(system->context);
    }
    sweep->eval->unmet.left_out = sweep->dropped;
    memcpy(sweep->unit, system->scale, (size_t)system->n * sizeof *sweep->unit);
    sweep->unit[system->n] = 1;
    for (int r = 0; r < system->m; r++) {
        sweep->dropped[r] = closures[system->rows[r].closure];
        sweep->any_dropped = sweep->any_dropped || sweep->dropped[r];
    }
    return KEMPE_OK;
}

static void forget_choice(kmp_sweep *w)
{
    kmp_reduction_free(&w->red);
    kmp_partition_free(&w->part);
    kmp_arena_free(&w->of_choice);
}

/* Room for `count` other driven values. */
static bool renew_parameters(kmp_sweep *w, int count, const kmp_sweep_parameter *parameters)
{
    int p = w->p;
    kmp_arena *arena = &w->of_leads;
    kmp_arena_free(arena);
    w->count = count;
    w->time = -1;
    w->parameter = KMP_ARENA_NEW(arena, kmp_sweep_parameter, count);
    w->order = KMP_ARENA_NEW(arena, int, 2 * (p + 1));
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, (p + 1) * (w->n + 1), &w->gradient),
                        KMP_ROOM(double, (p + 1) * (p + 1), &w->matrix), KMP_ROOM(double, p + 1, &w->rhs, &w->pivots)))
        return false;
    memcpy(w->parameter, parameters, (size_t)count * sizeof *parameters);
    return true;
}

KMP_CLEARS(kmp_sweep, sweep, forget_choice(sweep), kmp_rank_margin_free(&sweep->margin),
           kmp_arena_free(&sweep->of_leads), kmp_arena_free(&sweep->arena), kmp_eval_free(sweep->eval))

/* Chooses u, v and rows at the evaluator's last closure; rank -1: by the pivots. */
static kempe_status choose(kmp_sweep *w, int rank)
{
    forget_choice(w);
    KMP_TRY(kmp_partition_of_rank(&w->part, w->system, dropped_jacobian(w), rank, NULL, 0));
    if (w->margin.system && !kmp_rank_margin_choose(&w->margin, &w->part))
        return kmp_fail_memory(w->system->context);
    KMP_TRY(kmp_reduction_init(&w->red, w->eval, &w->part));
    w->span = KMP_ARENA_NEW(&w->of_choice, double, (w->n + 1) * (w->part.p + 1));
    w->signs = KMP_ARENA_NEW(&w->of_choice, int, w->part.r);
    return w->of_choice.failed ? kmp_fail_memory(w->system->context) : KEMPE_OK;
}

kempe_status kmp_sweep_stand(kmp_sweep *w, double t, const double *q)
{
    KMP_TRY(kmp_made(w->system->context, renew_parameters(w, 1, &(kmp_sweep_parameter){-1, t, t})));
    w->time = 0;
    memcpy(w->here.x, q, (size_t)w->n * sizeof *q);
    w->here.x[w->n] = 0;
    kmp_rank_margin_free(&w->margin);
    (void)evaluate_at(w, w->here.x); /* the closure; nothing is chosen yet */
    KMP_TRY(choose(w, -1));
    w->p = w->part.p;
    KMP_TRY(kmp_made(w->system->context, kmp_rank_margin_init(&w->margin, w->system, &w->part)));
    if (w->any_dropped)
        w->margin.near = w->part.r > 0 && w->part.pivots[w->part.r - 1] < KMP_MARGIN_EXACT * w->part.pivots[0];
    else
        kmp_rank_margin_begin(&w->margin, w->eval, t, q);
    (void)evaluate_at(w, w->here.x);
    if (w->margin.near)
        return kmp_fail(w->system->context, KEMPE_E_FAILED,
                        "the start is near a change point, where branches meet (%.1e), and the direction of motion is "
                        "ambiguous: use another start position ('start:')",
                        w->margin.last / w->margin.usual);
    return KEMPE_OK;
}

kempe_status kmp_sweep_let_move(kmp_sweep *w, const kmp_sweep_parameter *time, double t, const double *q)
{
    int p = w->p;
    /* Rows with nonzero h_t at some time on the path, which is zero in all others; they are dropped here. */
    w->moving_count = 0;
    for (int k = 0; k <= SAMPLES; k++) {
        kmp_eval_closure(w->eval, kmp_sweep_parameter_value(time, (double)k / SAMPLES), q);
        for (int r = 0; w->eval->h_t && r < w->system->m; r++)
            if (w->eval->h_t[r] != 0 && !w->dropped[r]) {
                w->dropped[r] = w->any_dropped = true;
                w->moving[w->moving_count++] = r;
            }
    }
    if (w->moving_count == 0)
        return KEMPE_OK;
    kempe_status status = kmp_sweep_stand(w, t, q);
    if (status == KEMPE_E_MEMORY || (status == KEMPE_OK && w->p == p + w->moving_count))
        return status;
    for (int k = 0; k < w->moving_count; k++) /* some are redundant: they stay closures */
        w->dropped[w->moving[k]] = false;
    w->moving_count = 0;
    return kmp_sweep_stand(w, t, q);
}

/* -- candidates for driven coordinates --------------------------------------------------------------- */

/* Sorts coordinates into the order in which their rows of X pivot, each with those before it, and last of all those
 * marked `later`. Coordinates that do not count (NULL: all do) are treated as constant. Returns the number of
 * independent ones.
 */
static int pivot_motions(const kmp_sweep *w, const bool *counts, const int *later, double *matrix, int *order)
{
    int n = w->n, p = w->p, rank = 0;
    double *pivots = matrix + n * p;
    for (int c = 0; c < n; c++)
        for (int j = 0; j < p; j++)
            matrix[j + c * p] = !counts || counts[c] ? w->span[c * (p + 1) + j] / w->unit[c] : 0;
    kmp_lu_complete(p, n, matrix, later, order + n, order, pivots);
    while (rank < p && pivots[rank] > FOLLOWS)
        rank++;
    return rank;
}

int kmp_sweep_order(kmp_sweep *w, const bool *given, int *order)
{
    int rank = -1, *later = KMP_NEW(int, w->n);
    double *matrix = KMP_NEW(double, (w->n + 1) * w->p);
    if (matrix && later) {
        rank = pivot_motions(w, given, NULL, matrix, order);
        for (int k = 0; k < w->n; k++)
            later[order[k]] = k >= rank;
        (void)pivot_motions(w, NULL, later, matrix, order);
    }
    kmp_free(matrix);
    kmp_free(later);
    return rank;
}

kempe_status kmp_sweep_along(kmp_sweep *w, int count, const kmp_sweep_parameter *parameters, double s)
{
    KMP_TRY(kmp_made(w->system->context, renew_parameters(w, count, parameters)));
    double size = 0; /* the range of the driven coordinate, 1 for the time */
    for (int k = 0; k < count; k++) {
        double range = fabs(parameters[k].to - parameters[k].from);
        if (parameters[k].coordinate < 0)
            w->time = k;
        size = fmax(size, parameters[k].coordinate < 0 ? range > 0 : range / w->unit[parameters[k].coordinate]);
    }
    w->unit[w->n] = 1 / size;
    w->here.x[w->n] = s;
    w->last_margin = w->last_step = w->fastest = 0;
    if (!(size > 0) || kmp_sweep_hold(w, &w->here) < FOLLOWS)
        return KEMPE_E_FAILED;
    return find_tangent(w, &w->here, NULL) ? KEMPE_OK : KEMPE_E_FAILED;
}

/* -- between two poses ------------------------------------------------------------------------------- */

static kmp_stretch between(const kmp_sweep *w, const kmp_sweep_pose *a, const kmp_sweep_pose *b)
{
    return (kmp_stretch){a, b, offset_along(w, a, b), cosine_between(w, a, b)};
}

static void x_at(const kmp_sweep *w, const kmp_stretch *e, double part, int order, double *x)
{
    for (int i = 0; i <= w->n; i++)
        x[i] = kmp_stretch_x(e, i, part, order);
}

/* The closed pose at a part of the length, with its tangent, in between. */
static bool pose_at(kmp_sweep *w, const kmp_stretch *e, double part)
{
    double first, ratio;
    kmp_sweep_target target = {.base = e->a, .offset = part * e->length};
    x_at(w, e, part, 0, w->between.x);
    return close_pose(w, &target, &w->between, &first, &ratio) && find_tangent(w, &w->between, e->a);
}

/* The part of the cubic at which s is reached: s is monotonic, and may be the s of the end. */
static double guess_part(const kmp_sweep *w, const kmp_stretch *e, double s)
{
    double from = e->a->x[w->n] - s, to = e->b->x[w->n] - s, part;
    kmp_bracket bracket = kmp_bracket_of(0, from, 1, to);
    while (kmp_bracket_next(&bracket, DBL_EPSILON, &part)) {
        double off = kmp_stretch_x(e, w->n, part, 0) - s;
        kmp_bracket_take(&bracket, part, off, to > from ? off >= 0 : off <= 0);
    }
    return bracket.far;
}

/* A sign change of f between 0 and 1, closed poses only, to rounding. f: ds, or s less a target. The pose is in
 * between. */
static bool enclose(kmp_sweep *w, const kmp_stretch *e, bool turn, double s)
{
    int n = w->n;
    double f1 = turn ? e->b->dx[n] : e->b->x[n] - s, part;
    const bool rises = turn ? f1 > 0 : e->b->x[n] > e->a->x[n];
    kmp_bracket bracket = kmp_bracket_of(0, turn ? e->a->dx[n] : e->a->x[n] - s, 1, f1);
    while (kmp_bracket_next(&bracket, 4 * DBL_EPSILON, &part)) {
        if (!pose_at(w, e, part))
            return false;
        double f = turn ? w->between.dx[n] : w->between.x[n] - s;
        if (f == 0 || (!turn && fabs(f) <= DBL_EPSILON * (1 + fabs(s))))
            return true;
        kmp_bracket_take(&bracket, part, f, (f > 0) == rises);
    }
    return true;
}

/* The share of s in the motion. */
static double pace(const kmp_sweep *w, const kmp_sweep_pose *pose)
{
    return fabs(pose->dx[w->n]) / w->unit[w->n];
}

/* The state at s, on this stretch, in between. false: the branch has been lost. */
static bool land(kmp_sweep *w, const kmp_stretch *e, double s)
{
    double first, ratio;
    kmp_sweep_target target = {.s = s};
    x_at(w, e, guess_part(w, e, s), 0, w->between.x);
    w->between.x[w->n] = s;
    if (fmin(pace(w, e->a), pace(w, e->b)) >= SLOW * w->fastest)
        return close_pose(w, &target, &w->between, &first, &ratio) && first <= MOST_OFF * fabs(e->length) + 1e-9;
    bool found = enclose(w, e, false, s);
    w->between.x[w->n] = s;
    return found;
}

/* -- a step ------------------------------------------------------------------------------------------ */

static double longest_step(const kmp_sweep *w)
{
    double step = LONGEST / fmax(kmp_sweep_fastest(w, &w->here), 1e-3);
    return w->time < 0 ? step : fmin(step, LONGEST_S / fmax(pace(w, &w->here), 1e-3));
}

/* Chooses ill-conditioned u or rows again at the current state, and stores the signs of the blocks. */
static kempe_status refresh(kmp_sweep *w)
{
    int v, u;
    if (!evaluate_at(w, w->here.x) || kmp_reduction_growth(&w->red, &v, &u) > KMP_EXCHANGE_SWEEP ||
        w->margin.rows > KMP_ROWS_SWEEP) {
        w->effort.exchanges++;
        KMP_TRY(choose(w, w->margin.r));
        if (!evaluate_at(w, w->here.x))
            return KEMPE_E_FAILED;
    }
    if (w->red.block)
        kmp_block_take_signs(w->red.block, w->signs);
    return KEMPE_OK;
}

/* True if s is monotonic between the ends, or its rate changes sign: at most one turn. */
static bool turns_once(const kmp_sweep *w, const kmp_stretch *e)
{
    bool down = e->a->dx[w->n] < 0;
    if (down != (e->b->dx[w->n] < 0))
        return true;
    for (int k = 1; k < 8; k++)
        if ((kmp_stretch_x(e, w->n, k / 8.0, 1) < 0) != down)
            return false;
    return true;
}

typedef enum verdict { GOOD, BAD, SIGN } verdict;

/* Tries a step of this length to `next`; SIGN: all is well but a block has changed its sign. */
static verdict try_step(kmp_sweep *w, const kmp_sweep_pose *from, double step, bool leap)
{
    double first, ratio;
    kmp_sweep_pose *to = &w->next;
    kmp_sweep_target target = {.base = from, .offset = step};
    for (int i = 0; i <= w->n; i++)
        to->x[i] = from->x[i] + step * from->dx[i];
    if (!close_pose(w, &target, to, &first, &ratio) || first > MOST_OFF * step || ratio > CONTRACTION)
        return BAD;
    if (!find_tangent(w, to, from) || cosine_between(w, from, to) < LEAST_COSINE)
        return BAD;
    bool same = leap || !w->red.block || kmp_block_has_signs(w->red.block, w->signs);
    kmp_stretch e = between(w, from, to);
    if (!turns_once(w, &e) || (!leap && same && !kmp_path_is_followed(w, &e, longest_step(w) / SAMPLED)))
        return BAD;
    return same ? GOOD : SIGN;
}

/* Steps straight across a change point, from the last state well before it; farther where it lies deeper. */
static bool leap(kmp_sweep *w)
{
    double gone = offset_along(w, &w->entry, &w->here), step = 2 * gone + KMP_MARGIN_ENTRY;
    for (int k = 0; k < MOST_LEAPS; k++, step *= 2)
        if (try_step(w, &w->entry, step, true) == GOOD && kmp_sweep_margin(w, &w->next) > KMP_MARGIN_ENTRY / 2)
            return true;
    return false;
}

/* Limits a step to a part of the distance at which the margin would be zero. */
static double near_step(const kmp_sweep *w, double margin, double step)
{
    if (margin > NEAR)
        return step;
    double slope = w->last_step > 0 ? fabs(w->last_margin - margin) / w->last_step : 1;
    return fmin(step, APPROACH * margin / fmax(slope, 1));
}

/* -- the path ---------------------------------------------------------------------------------------- */

typedef struct trace {
    kmp_sweep *w;
    const kmp_sweep_task *task;
    double up;    /* +1, -1: where s goes */
    double step;  /* the longest that is tried next */
    int row;      /* the next */
    double slack; /* rounding of s */
} trace;

static bool reaches(const trace *y, double s, double target)
{
    return y->up * (s - target) >= 0;
}

static double slack_of(const kmp_sweep *w)
{
    double most = 1;
    for (int k = 0; k < w->count; k++) {
        double range = fabs(w->parameter[k].to - w->parameter[k].from);
        if (range > 0)
            most = fmax(most, fmax(fabs(w->parameter[k].from), fabs(w->parameter[k].to)) / range);
    }
    return EPSILONS * DBL_EPSILON * most;
}

/* The row at x, with the derivatives in xs and xss; driven values are set without rounding. */
static void give(trace *y, double *x)
{
    kmp_sweep *w = y->w;
    double s = y->task->s[y->row++];
    for (int k = 0; k < w->count; k++)
        if (k != w->time) {
            const kmp_sweep_parameter *parameter = &w->parameter[k];
            x[parameter->coordinate] = kmp_sweep_parameter_value(parameter, s);
            w->xs[parameter->coordinate] = parameter->to - parameter->from;
            w->xss[parameter->coordinate] = 0;
        }
    y->task->row(y->task->user, s, x, w->xs, w->xss);
}

/* Derivatives by s of the cubic, where no state can be closed. */
static void differentiate_cubic(kmp_sweep *w, const kmp_stretch *e, double s)
{
    double part = guess_part(w, e, s);
    x_at(w, e, part, 0, w->between.x);
    x_at(w, e, part, 1, w->xs);
    x_at(w, e, part, 2, w->xss);
    double s1 = w->xs[w->n], s2 = w->xss[w->n];
    for (int i = 0; i < w->n; i++) {
        w->xss[i] = (w->xss[i] - w->xs[i] / s1 * s2) / (s1 * s1);
        w->xs[i] /= s1;
    }
}

/* The rows of a stretch up to `limit`; `crossing`: a change point lies in it. False: the branch has been lost. */
static bool give_rows(trace *y, const kmp_stretch *e, double limit, bool crossing)
{
    kmp_sweep *w = y->w;
    const kmp_sweep_task *t = y->task;
    while (y->row < t->count && reaches(y, limit, t->s[y->row])) {
        double s = t->s[y->row];
        if (crossing)
            differentiate_cubic(w, e, s);
        else if (!land(w, e, s) || !find_derivatives(w, &w->between, w->xs, w->xss))
            return false;
        give(y, w->between.x);
    }
    return true;
}

/* A row that is the dead centre itself. */
static void give_dead(trace *y)
{
    const kmp_sweep_task *t = y->task;
    if (y->row < t->count && fabs(t->s[y->row] - y->w->here.x[y->w->n]) <= y->slack)
        t->row(t->user, t->s[y->row++], y->w->here.x, NULL, NULL);
}

/* A step that was closed at its end, but not at rows within it, has passed over a bend: a shorter one is next. */
static kmp_sweep_end shorten(trace *y, double h)
{
    if (h <= SHORTEST)
        return KMP_SWEEP_LOST;
    y->w->effort.rejected++;
    y->step = h / 2;
    return KMP_SWEEP_ON_THE_WAY;
}

/* Moves to s_end, within the stretch of a step h. */
static kmp_sweep_end arrive(trace *y, const kmp_stretch *e, double h)
{
    kmp_sweep *w = y->w;
    if (!land(w, e, y->task->s_end) || !find_tangent(w, &w->between, e->a))
        return shorten(y, h);
    pose_copy(w, &w->between, &w->here);
    return KMP_SWEEP_ARRIVED;
}

static bool goes_on(const trace *y)
{
    return (y->w->next.dx[y->w->n] > 0) == (y->up > 0);
}

/* Crosses a change point: reported where the margin, which decreases linearly to it, is zero; rows in between. */
static kmp_sweep_end cross(trace *y, double margin)
{
    kmp_sweep *w = y->w;
    if (!leap(w) || !goes_on(y))
        return KMP_SWEEP_LOST;
    kmp_stretch e = between(w, &w->entry, &w->next);
    double gone = offset_along(w, &w->entry, &w->here), at = kmp_sweep_margin(w, &w->entry);
    double part = fmin(1, (gone + gone * margin / fmax(at - margin, margin)) / e.length);
    (void)give_rows(y, &e, w->next.x[w->n], true);
    x_at(w, &e, part, 0, w->between.x);
    y->task->change(y->task->user, &w->between, margin);
    w->effort.steps++;
    w->last_margin = margin;
    w->last_step = 0;
    y->step = KMP_MARGIN_ENTRY;
    bool there = reaches(y, w->next.x[w->n], y->task->s_end);
    poses_swap(&w->here, there && y->up > 0 ? &w->entry : &w->next);
    return there ? KMP_SWEEP_ARRIVED : KMP_SWEEP_ON_THE_WAY;
}

/* The closed pose at s, near `here`, in `pose`. */
static bool close_beside(kmp_sweep *w, double s, kmp_sweep_pose *pose)
{
    double first, ratio;
    pose_copy(w, &w->here, pose);
    pose->x[w->n] = s;
    for (int k = 0; k < w->count; k++) /* so that the first correction is of the other side, too */
        if (k != w->time)
            pose->x[w->parameter[k].coordinate] = kmp_sweep_parameter_value(&w->parameter[k], s);
    return close_pose(w, &(kmp_sweep_target){.s = s}, pose, &first, &ratio) && first <= CORNER_MOST;
}

/* Passes a corner of the path, with the rows there: the tangent is another one behind it. */
static kmp_sweep_end pass_corner(trace *y)
{
    kmp_sweep *w = y->w;
    const kmp_sweep_task *t = y->task;
    const double far = w->here.x[w->n] + y->up * CORNER;
    const bool there = reaches(y, far, t->s_end);
    const double s = there ? t->s_end : far;
    if (!close_beside(w, s, &w->next) || !find_tangent(w, &w->next, NULL))
        return KMP_SWEEP_LOST;
    for (int i = 0; i <= w->n; i++)
        w->next.dx[i] *= y->up;
    while (y->row < t->count && reaches(y, s, t->s[y->row])) {
        if (!close_beside(w, t->s[y->row], &w->between) || !find_derivatives(w, &w->between, w->xs, w->xss))
            return KMP_SWEEP_LOST;
        give(y, w->between.x);
    }
    poses_swap(&w->here, &w->next);
    w->effort.steps++;
    w->last_step = 0;
    y->step = FIRST_STEP;
    return there ? KMP_SWEEP_ARRIVED : KMP_SWEEP_ON_THE_WAY;
}

/* One step, and the handling of its result. */
static kmp_sweep_end go_on(trace *y)
{
    kmp_sweep *w = y->w;
    double margin = kmp_sweep_margin(w, &w->here);
    kempe_status status = refresh(w);
    if (status != KEMPE_OK)
        return status == KEMPE_E_MEMORY ? KMP_SWEEP_NO_MEMORY : KMP_SWEEP_LOST;
    if (margin > KMP_MARGIN_ENTRY)
        pose_copy(w, &w->here, &w->entry);
    w->fastest = fmax(w->fastest, pace(w, &w->here));
    double h = near_step(w, margin, fmin(y->step, longest_step(w)));
    verdict v = BAD;
    while (margin > KMP_MARGIN_EXACT && h > SHORTEST && (v = try_step(w, &w->here, h, false)) != GOOD) {
        w->effort.rejected++;
        if (v == SIGN && h < SHORT)
            break;
        h /= 2;
    }
    if (v != GOOD) /* a small margin leaves only rounding */
        return margin < KMP_MARGIN_ENTRY ? cross(y, margin) : pass_corner(y);
    w->effort.steps++;
    w->last_margin = margin;
    if (!goes_on(y)) {
        /* s turns between here and next: up to there, or to s_end before it. Rows nearer to it than rounding are it. */
        kmp_stretch e = between(w, &w->here, &w->next);
        if (!enclose(w, &e, true, 0))
            return shorten(y, h);
        pose_copy(w, &w->between, &w->next);
        e = between(w, &w->here, &w->next);
        double limit = w->next.x[w->n] - y->up * y->slack;
        if (!give_rows(y, &e, limit, false))
            return shorten(y, h);
        if (reaches(y, limit, y->task->s_end))
            return arrive(y, &e, h);
        pose_copy(w, &w->next, &w->here);
        w->here.dx[w->n] = 0;
        give_dead(y);
        return KMP_SWEEP_DEAD;
    }
    kmp_stretch e = between(w, &w->here, &w->next);
    double s = w->next.x[w->n];
    if (!give_rows(y, &e, s, false))
        return shorten(y, h);
    w->last_step = h;
    y->step = e.slant > 0.99 ? 2 * h : e.slant > 0.97 ? 1.2 * h : h;
    if (reaches(y, s, y->task->s_end))
        return arrive(y, &e, h);
    poses_swap(&w->here, &w->next);
    return KMP_SWEEP_ON_THE_WAY;
}

/* Chooses the tangent towards s_end: from a dead centre in the reverse direction. */
static void turn(trace *y)
{
    int n = y->w->n;
    double *dx = y->w->here.dx;
    bool dead = dx[n] == 0, back = dead || (dx[n] > 0) != (y->up > 0);
    for (int i = 0; back && i <= n; i++)
        dx[i] = -dx[i];
    if (dead)
        dx[n] = y->up * 1e-300;
}

kmp_sweep_end kmp_sweep_go(kmp_sweep *sweep, const kmp_sweep_task *task)
{
    double s = sweep->here.x[sweep->n];
    trace y = {.w = sweep, .task = task, .up = task->s_end >= s ? 1 : -1, .step = FIRST_STEP, .slack = slack_of(sweep)};
    kmp_sweep_end end = task->s_end == s ? KMP_SWEEP_ARRIVED : KMP_SWEEP_ON_THE_WAY;
    long most = sweep->effort.steps + MOST_STEPS;
    if (sweep->here.dx[sweep->n] == 0)
        give_dead(&y);
    turn(&y);
    pose_copy(sweep, &sweep->here, &sweep->entry);
    while (end == KMP_SWEEP_ON_THE_WAY) {
        if (kmp_interrupted(sweep->system->context))
            end = KMP_SWEEP_INTERRUPTED;
        else
            end = sweep->effort.steps < most ? go_on(&y) : KMP_SWEEP_LOST;
    }
    return end;
}
