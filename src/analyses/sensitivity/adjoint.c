/* SPDX-License-Identifier: BSD-3-Clause */
/* Adjoint method: the derivative of one scalar, at the end of a motion or integrated over it, by all parameters at
 * once, for any number of them. First the motion, stored as values of u and ud within each step; then backwards in time
 * the weights L of its state, with y' = f(y, p), y = (u, ud),
 *
 *     -dL/dt = f_y' L + g_y      L(t_end) = G_y      dG/dp = G_p + L(0)' dy_0/dp + integral of L' f_p + g_p
 *
 * (Cao, Li, Petzold and Serban, SIAM J. Scientific Computing 24 (2003) 1076, for index 1 and 0; here of the reduced
 * equations). f_y' L is kmp_linear_back: no matrix is made. Events and exchanges of u are passed backwards by the
 * transposes of their maps (forward.h). Between two of them the degrees of freedom are the same: a segment.
 *
 * Backwards the unknowns are the weights of u and ud (p each), then the quadratures of the parameters that move the
 * mechanism, and the weights of distances at which friction is held, which are constant parameters while it is; their
 * time is t_end - t. Other parameters, as start values, have no quadrature, since L' f_p + g_p is zero: only maps
 * change their weights.
 *
 * A map of an event may hold only for the parameters: its columns by parts of the state break what the derivatives by
 * parameters must satisfy (kmp_forward_requirement). This is another scalar, linear in the state before the event,
 * which goes back to the start like the target, and vanishes for each parameter. */
#include "analyses/sensitivity/adjoint.h"
#include "analyses/derivatives/varied_lanes.h"
#include "analyses/sensitivity/forward.h"
#include "base/arena.h"
#include "base/clones.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/steppers/solver.h"
#include "linalg/dense/dot.h"
#include "platform/platform.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Values of u and ud in each step, at Chebyshev's points: their polynomial is the polynomial of the integrators' dense
 * outputs, none of which has a higher degree. */
enum { NODES = 8 };

typedef struct kept_step {
    struct kept_step *before, *behind;
    int p;
    double from, to;
    double values[]; /* NODES x 2 p */
} kept_step;

typedef struct kept_map {
    struct kept_map *before;
    kmp_forward_map of; /* its arrays are copies, but for: */
    kmp_partition part; /* behind it */
    kept_step *last;    /* before it; NULL: none */
} kept_map;

typedef struct placed_requirement {
    const kept_map *map;
    const kmp_forward_requirement *of;
} placed_requirement;

typedef struct adjoint {
    kmp_arena arena;
    kmp_sensitivity_equations *v;
    const kmp_forward *options;
    const kmp_forward_target *target;
    bool integral;
    const double *sizes;
    int n, m, p, count, held, size;
    int moving, *moves; /* parameters with quadratures: their numbers */
    const int *row;     /* held rows of friction */
    double reach;       /* size of the weights at the end, for tolerances */
    double rate_scale;
    kmp_solver_work work;
    long before; /* steps backwards of other scalars */
    int steps;
    kept_step *begin, *end;     /* of the whole motion */
    size_t kept;                /* bytes of steps and maps */
    kept_map *map;              /* the last one */
    bool weighs;                /* the target adds weights on the way back */
    int required;               /* requirements of all maps: */
    placed_requirement *placed; /* the last one first */
    int present, past, ways;    /* the next one that goes back, and the first one that does not; ways back so far */
    const char *unmet;          /* of the first event whose requirement is not met */
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_ode ode;
    kept_step *first, *last, *at;                 /* steps: of the current segment; the last one used */
    double *y;                                    /* weights: of u, ud (p each), parameters, held distances */
    double *unknown, *atol;                       /* of the integrator: a part of y */
    double *by;                                   /* weights on parameters and held distances at a state: room */
    double *state, *gradient, value;              /* of the target at the end */
    double *end_q;                                /* the end of the last step, n */
    double *own_chart, *own_q, *own_qd, *own_qdd; /* the end in the user's coordinates: charts; n */
    double *dq, *dqd, *dqdd;                      /* n: room */
    double *wq, *wqd, *wqdd, *wlambda, *w, *wu;   /* n, n, n, m; n; p */
    double *matrix, *weights;                     /* p x 2 p; of the unknowns behind a map */
    double *off, *span;                           /* count: derivatives of a requirement, and their size */
    kmp_changes_weight back;
    bool known;   /* the matrices in lanes belong to these times, and to this segment */
    bool weighed; /* so do the slopes of the quadratures */
    double at_t[KMP_STAGE_LANES];
    double stood;                           /* time of the whole state at the end of the motion; NAN: it is left */
    double *stages;                         /* 2 p: u and ud, in lanes */
    double *of_state, *by_parameters, *udd; /* in lanes: p x 2 p; moving, or the ones of the last lane; p */
} adjoint;

/* -- the stored motion ------------------------------------------------------------------------------- */

static double node(int j)
{
    static const double pi = 3.14159265358979323846;
    return 0.5 * (1 - cos(pi * j / (NODES - 1)));
}

static int keep_step(void *user, kmp_runner *runner, double from, double to)
{
    adjoint *a = user;
    const kmp_linear *l = &a->v->linear;
    size_t width = 2 * (size_t)(a->p = l->p);
    kept_step *step = kmp_arena_alloc(&a->arena, 1, sizeof *step + NODES * width * sizeof *step->values);
    if (!step)
        return 1;
    a->kept += NODES * width * sizeof *step->values;
    for (int j = 0; j < NODES; j++) {
        const double *y = kmp_runner_unknowns(runner, j == NODES - 1 ? to : from + node(j) * (to - from));
        if (!y)
            return 1;
        memcpy(step->values + (size_t)j * width, y, width * sizeof *y);
    }
    step->p = (int)width / 2;
    step->from = from;
    step->to = to;
    step->before = a->end;
    *(a->end ? &a->end->behind : &a->begin) = step;
    a->end = step;
    a->steps++;
    memcpy(a->end_q, l->q, (size_t)a->n * sizeof *l->q);
    return 0;
}

static void *copy_of(adjoint *a, const void *from, size_t count, size_t size)
{
    void *to = from ? kmp_arena_alloc(&a->arena, count, size) : NULL;
    if (to && count > 0)
        memcpy(to, from, count * size);
    return to;
}

static size_t chart_size(const adjoint *a)
{
    return KMP_CHART_SIZE * (size_t)a->v->system->chart_count;
}

/* Copies the requirements of a map, the last one first. False: no memory. */
static bool keep_requirements(adjoint *a, const kmp_forward_map *map, const kmp_forward_requirement **to)
{
    const size_t columns = (size_t)map->columns;
    for (; *to; *to = (*to)->before)
        a->required--;
    for (const kmp_forward_requirement *from = map->requirement; from; from = from->before) {
        kmp_forward_requirement *copy = copy_of(a, from, 1, sizeof *from);
        if (!copy)
            return false;
        copy->off = copy_of(a, from->off, columns, sizeof(double));
        copy->term = copy_of(a, from->term, (size_t)from->terms * columns, sizeof(double));
        copy->reason = copy_of(a, from->reason, strlen(from->reason) + 1, 1);
        copy->before = NULL;
        *to = copy;
        to = &copy->before;
        a->required++;
    }
    return true;
}

static int keep_map(void *user, const kmp_forward_map *map, bool again)
{
    adjoint *a = user;
    kept_map *to = again ? a->map : KMP_ARENA_NEW(&a->arena, kept_map, 1);
    if (!to)
        return 1;
    if (!again) {
        *to = (kept_map){a->map, *map, {0}, a->end};
        to->of.requirement = NULL;
        to->of.row = copy_of(a, map->row, (size_t)map->held, sizeof(int));
        to->of.q = copy_of(a, map->q, (size_t)a->n, sizeof(double));
        to->of.mode = copy_of(a, map->mode, (size_t)a->v->system->events.count, sizeof(double));
        to->of.chart = copy_of(a, map->chart, chart_size(a), sizeof(double));
        a->map = to;
    }
    const size_t columns = (size_t)map->columns, p = (size_t)map->p_after, held = (size_t)map->held;
    to->of.p_after = map->p_after;
    kmp_partition_free(&to->part);
    if (!kmp_partition_copy(&to->part, map->part))
        return 1;
    to->of.u_after = copy_of(a, map->u_after, columns * p, sizeof(double));
    to->of.ud_after = copy_of(a, map->ud_after, columns * p, sizeof(double));
    to->of.held_after = copy_of(a, map->held_after, columns * held, sizeof(double));
    to->of.integral_after = copy_of(a, map->integral_after, columns, sizeof(double));
    if (!keep_requirements(a, map, &to->of.requirement))
        return 1;
    a->kept += columns * (2 * p + held + 1) * sizeof(double);
    a->held = map->held;
    a->row = to->of.row;
    return a->arena.failed;
}

/* Stores the end in the user's coordinates. */
static int keep_end(void *user, const kmp_sensitivity_equations_row *row)
{
    adjoint *a = user;
    size_t bytes = (size_t)a->n * sizeof(double);
    memcpy(a->own_q, row->q, bytes);
    memcpy(a->own_qd, row->qd, bytes);
    memcpy(a->own_qdd, row->qdd, bytes);
    a->value = kmp_target_of_row(a->target, a->v, row);
    return 0;
}

/* u and ud at t within a step, by the barycentric formula. */
static void recall(const adjoint *a, const kept_step *step, double t, double *y)
{
    const double *values = step->values;
    double x = (t - step->from) / (step->to - step->from), sum = 0;
    memset(y, 0, (size_t)(2 * a->p) * sizeof *y);
    for (int j = 0; j < NODES; j++) {
        double off = x - node(j), weight = (j % 2 ? -1 : 1) * (j == 0 || j == NODES - 1 ? 0.5 : 1);
        if (off == 0) {
            memcpy(y, values + 2 * a->p * j, (size_t)(2 * a->p) * sizeof *y);
            return;
        }
        weight /= off;
        sum += weight;
        for (int i = 0; i < 2 * a->p; i++)
            y[i] += weight * values[2 * a->p * j + i];
    }
    for (int i = 0; i < 2 * a->p; i++)
        y[i] /= sum;
}

/* The step of the current segment that contains t. */
static const kept_step *step_at(adjoint *a, double t)
{
    while (a->at != a->first && t < a->at->from)
        a->at = a->at->before;
    while (a->at != a->last && t > a->at->to)
        a->at = a->at->behind;
    return a->at;
}

/* -- gradients at a state ---------------------------------------------------------------------------- */

/* Converts weights wq, wqd and, `whole`, wqdd on a motion in other charts to weights on it in these, by the columns of
 * the Jacobian between the charts. */
static void carry_back(adjoint *a, const kmp_chart_motion *from, const kmp_chart_motion *to, bool whole)
{
    const kempe_system *s = a->v->system;
    double *w[] = {a->wq, a->wqd, a->wqdd}, *d[] = {a->dq, a->dqd, a->dqdd};
    int orders = whole ? 3 : 2;
    for (int c = 0; c < s->chart_count; c++) {
        int first = s->chart_first[c], chart = KMP_CHART_SIZE * c;
        double back[9] = {0};
        if (memcmp(from->chart + chart, to->chart + chart, KMP_CHART_SIZE * sizeof(double)) == 0)
            continue;
        for (int k = 0; k < 3 * orders; k++) {
            for (int i = 0; i < 3 * orders; i++)
                d[i / 3][first + i % 3] = i == k;
            kmp_chart_carry(s, c, from, to, a->dq, a->dqd, whole ? a->dqdd : NULL);
            for (int i = 0; i < 3 * orders; i++)
                back[k] += w[i / 3][first + i % 3] * d[i / 3][first + i % 3];
        }
        for (int k = 0; k < 3 * orders; k++)
            w[k / 3][first + k % 3] = back[k];
    }
}

/* Weights on all results, and the target's direct derivatives by parameters, times `factor`, into out. */
static void weigh_target(adjoint *a, double *out)
{
    kmp_sensitivity_equations *v = a->v;
    const kmp_forward_target *x = a->target;
    kmp_copy_or_zero(a->n, x->q, a->wq);
    kmp_copy_or_zero(a->n, x->qd, a->wqd);
    kmp_copy_or_zero(a->n, x->qdd, a->wqdd);
    kmp_copy_or_zero(a->m, x->lambda, a->wlambda);
    const kmp_linear *l = &v->linear;
    if (!a->integral) /* else it has no angles that are others in other charts */
        carry_back(a, &(kmp_chart_motion){l->eval->chart, l->q, l->qd, l->qdd},
                   &(kmp_chart_motion){a->own_chart, a->own_q, a->own_qd, a->own_qdd}, true);
    if (!x->shown)
        return;
    kmp_instant at = kmp_linear_instant(&v->linear);
    (void)kmp_slopes_values(&v->slopes->outputs, &at);
    kmp_slopes_gradient(v->slopes, &v->slopes->outputs, x->shown,
                        &(kmp_direction){NULL, a->wq, a->wqd, a->wqdd, a->wlambda, out});
}

/* Adds the weights on parameters that follow from weights on the equations. */
static void add_parameters(adjoint *a, double *out)
{
    kmp_sensitivity_equations *v = a->v;
    const double *part[] = {a->back.h, a->back.rate, a->back.curve, a->back.force};
    const kmp_instant at = kmp_linear_instant(&v->linear);
    for (int i = 0; i < 3; i++)
        memcpy(v->sum->weight + i * a->m, part[i], (size_t)a->m * sizeof(double));
    memcpy(v->sum->weight + 3 * a->m, part[3], (size_t)a->n * sizeof(double));
    const double *slope = kmp_slopes_sum_at(v->sum, &at);
    bool finite = true;
    for (int k = 0; k < v->sum->count; k++)
        finite = finite && isfinite(slope[k]);
    if (!finite) { /* a derivative without weight may be none */
        kmp_slopes_at(v->slopes, &at);
        kmp_slopes_weighted(v->slopes, a->back.h, a->back.rate, a->back.curve, a->back.force, out);
    }
    for (int k = 0; finite && k < v->sum->count; k++)
        out[v->sum->parameter[k]] += slope[k];
}

static void add_back(adjoint *a, double *u, double *ud, double *out)
{
    for (int i = 0; i < a->p; i++) {
        u[i] += a->back.u[i];
        ud[i] += a->back.ud[i];
    }
    add_parameters(a, out);
    for (int j = 0; j < a->held; j++)
        out[a->count + j] -= a->back.h[a->row[j]];
}

/* Adds to u, ud and out the contributions of weights on accelerations udd (p). The target's weights are added to udd,
 * if requested. */
static void go_back(adjoint *a, bool with_target, double *udd, double *u, double *ud, double *out)
{
    kmp_linear *l = &a->v->linear;
    if (with_target) {
        weigh_target(a, out);
        kmp_linear_back(l, &(kmp_weights){a->wq, a->wqd, a->wqdd, a->wlambda, NULL}, &a->back);
        add_back(a, u, ud, out);
        for (int i = 0; i < a->p; i++)
            udd[i] += a->back.udd[i];
    }
    kmp_linear_accelerate_back(l, udd, a->w);
    kmp_linear_back(l, &(kmp_weights){.residual = a->w}, &a->back);
    add_back(a, u, ud, out);
}

/* -- the ODE ----------------------------------------------------------------------------------------- */

static int place(adjoint *a, double back)
{
    double t = fmin(fmax(a->options->spec->t_end - back, a->first->from), a->last->to);
    if (t <= a->stood && t >= a->stood)
        return KMP_GO;
    a->stood = NAN;
    recall(a, step_at(a, t), t, a->state);
    return kmp_sensitivity_equations_at(a->v, t, a->state, a->state + a->p);
}

/* Several stages at once. Their times determine the matrices, which all sweeps of a step share. */

enum { W = KMP_STAGE_LANES };

static int place_stages(adjoint *a, const double *back)
{
    double t[W];
    size_t p = (size_t)a->p;
    for (int l = 0; l < W; l++)
        t[l] = fmin(fmax(a->options->spec->t_end - back[l], a->first->from), a->last->to);
    if (a->known && memcmp(t, a->at_t, sizeof t) == 0)
        return KMP_GO;
    a->known = a->weighed = false;
    for (size_t l = 0; l < W; l++) {
        recall(a, step_at(a, t[l]), t[l], a->state);
        for (size_t i = 0; i < 2 * p; i++)
            a->stages[i * W + l] = a->state[i];
    }
    int said = kmp_varied_lanes_run(a->options->lanes, true, t, a->stages, a->stages + p * W, a->udd);
    if (said == KMP_GO)
        said = kmp_varied_lanes_matrices(a->options->lanes, a->of_state, NULL);
    if (said != KMP_GO)
        return said;
    memcpy(a->at_t, t, sizeof t);
    a->known = true;
    return KMP_GO;
}

/* out (columns) = matrix' x for a matrix of p rows, in lanes. */
static KMP_CLONES void multiply_transposed(int p, int columns, const double *matrix, const double *x, double *out)
{
    for (int c = 0; c < columns; c++) {
        kmp_eight sum = {0};
        for (int k = 0; k < p; k++)
            sum += KMP_EIGHT_CONST(matrix + (ptrdiff_t)(c * p + k) * W) * KMP_EIGHT_CONST(x + (ptrdiff_t)k * W);
        KMP_EIGHT_AT(out + (ptrdiff_t)c * W) = sum;
    }
}

/* True at the end of a step, which is the last lane. */
static bool is_last_stage(const adjoint *a, double back)
{
    double t = a->options->spec->t_end - back;
    return a->known && t <= a->at_t[W - 1] && t >= a->at_t[W - 1];
}

/* Keeps the slopes of the quadratures there: their first numbers may be in the same place. */
static void keep_slopes(adjoint *a, const double *in_lanes)
{
    int last = W - 1; /* the first lane there is a stage */
    while (last > 0 && !(a->at_t[last - 1] > a->at_t[W - 1]))
        last--;
    for (int c = 0; c < a->moving; c++)
        a->by_parameters[c] = in_lanes[c * W + last];
}

/* The slopes there, by the matrices of that lane. */
static void recall_stage(adjoint *a, const double *y, double *dy)
{
    int p = a->p;
    if (!a->weighed) {
        for (int k = 0; k < p * W; k++)
            a->udd[k] = y[p + k / W];
        kmp_varied_lanes_weigh(a->options->lanes, a->udd, a->by_parameters);
        keep_slopes(a, a->by_parameters);
    }
    for (int c = 0; c < 2 * p; c++) {
        const double *of = a->of_state + (ptrdiff_t)(c * p) * W;
        dy[c] = c < p ? 0 : y[c - p];
        for (int k = 0; k < p; k++)
            dy[c] += of[k * W + W - 1] * y[p + k];
    }
    memcpy(dy + 2 * p, a->by_parameters, (size_t)a->moving * sizeof *dy);
}

static int rhs_of_stages(void *self, const double *t, const double *y, double *dy)
{
    adjoint *a = self;
    int p = a->p, rates = p * W, said = place_stages(a, t);
    if (said != KMP_GO)
        return said;
    multiply_transposed(p, 2 * p, a->of_state, y + rates, dy);
    for (int k = 0; k < rates; k++)
        dy[rates + k] += y[k];
    return KMP_GO;
}

static int integrands_of_stages(void *self, const double *t, const double *y, double *dy)
{
    adjoint *a = self;
    const int rates = a->p * W, said = place_stages(a, t);
    if (said != KMP_GO)
        return said;
    kmp_varied_lanes_weigh(a->options->lanes, y + rates, dy + 2 * rates);
    keep_slopes(a, dy + 2 * rates);
    a->weighed = true;
    return KMP_GO;
}

/* Takes the parameters that move the mechanism, and the held distances. */
static void take_moving(const adjoint *a, const double *from, double *to)
{
    for (int k = 0; k < a->moving; k++)
        to[k] = from[a->moves[k]];
    memcpy(to + a->moving, from + a->count, (size_t)a->held * sizeof *to);
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    adjoint *a = self;
    int p = a->p;
    if (is_last_stage(a, t)) {
        recall_stage(a, y, dy);
        return KMP_GO;
    }
    if (place(a, t) != KMP_GO)
        return KMP_RETRY;
    memset(dy, 0, (size_t)a->size * sizeof *dy);
    memcpy(dy + p, y, (size_t)p * sizeof *dy);
    memcpy(a->wu, y + p, (size_t)p * sizeof *dy);
    memset(a->by, 0, (size_t)(a->count + a->held) * sizeof *a->by);
    go_back(a, a->weighs, a->wu, dy, dy + p, a->by);
    take_moving(a, a->by, dy + 2 * p);
    return KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    adjoint *a = self;
    (void)y, (void)dy, (void)w;
    if (is_last_stage(a, t))
        kmp_varied_lanes_anchor(a->options->lanes, W - 1);
    else
        kmp_sensitivity_equations_anchor(a->v);
    return KMP_GO;
}

/* The derivatives of udd by u and ud at a time, from a stage of the step or from an evaluation at that time. */
static int find_matrix(adjoint *a, double back)
{
    double t = a->options->spec->t_end - back;
    for (int l = 0; a->known && l < W; l++) {
        if (t < a->at_t[l] || t > a->at_t[l])
            continue;
        for (int k = 0; k < 2 * a->p * a->p; k++)
            a->matrix[k] = a->of_state[k * W + l];
        return KMP_GO;
    }
    if (place(a, back) != KMP_GO)
        return KMP_RETRY;
    kmp_sensitivity_equations_matrix(a->v, a->matrix);
    return KMP_GO;
}

/* Jacobian of only the weights: the quadratures follow from them. */
static int jacobian(void *self, double t, const double *y, double *j)
{
    adjoint *a = self;
    int p = a->p;
    (void)y;
    if (find_matrix(a, t) != KMP_GO)
        return KMP_RETRY;
    for (int k = 0; k < p; k++) {
        for (int i = 0; i < 2 * p; i++)
            j[i + (p + k) * a->size] = a->matrix[k + i * p];
        j[p + k + k * a->size] = 1;
    }
    return KMP_GO;
}

/* -- segments ---------------------------------------------------------------------------------------- */

static kempe_status fail(adjoint *a, double t)
{
    return kmp_fail(a->v->system->context, KEMPE_E_FAILED,
                    "the state cannot be evaluated in the adjoint integration at t = %.9g", t);
}

/* Takes the state (t, y) near q, in the unknowns of a segment. */
static kempe_status stand(adjoint *a, double t, const double *q, const kmp_partition *part, const double *y)
{
    kmp_partition own;
    a->known = false;
    a->stood = NAN;
    KMP_TRY(kmp_made(a->v->system->context, kmp_partition_copy(&own, part)));
    KMP_TRY(kmp_sensitivity_equations_take(a->v, t, q, &own));
    if (kmp_sensitivity_equations_at(a->v, t, y, y + a->p) != KMP_GO)
        return fail(a, t);
    kmp_sensitivity_equations_anchor(a->v);
    return KEMPE_OK;
}

/* -- the integrator ----------------------------------------------------------------------------------- */

static bool has_elements(const kempe_system *s)
{
    bool has = false;
    for (int k = 0; k < s->events.count; k++)
        has = has || s->events.condition[k].role != KMP_ROLE_NONE;
    return has;
}

/* Begins the lanes, if the integrator uses them. */
static kempe_status add_lanes(adjoint *a)
{
    const size_t p = (size_t)a->p, moving = (size_t)a->moving;
    if (!a->kind->lanes || a->integral || !a->options->lanes || has_elements(a->v->system))
        return KEMPE_OK;
    kmp_varied_lanes_begin(a->options->lanes);
    a->ode.lanes = rhs_of_stages;
    a->ode.integrands = integrands_of_stages;
    a->ode.width = W;
    a->ode.cycles_of_step =
        kmp_varied_lanes_cycles(a->options->lanes) + kmp_varied_lanes_matrix_cycles(a->options->lanes);
    return kmp_made(a->v->system->context,
                    KMP_ARENA_MAKE(&a->arena, KMP_ROOM(double, 2 * p * W, &a->stages), KMP_ROOM(double, p *W, &a->udd),
                                   KMP_ROOM(double, 2 * p * p * W, &a->of_state),
                                   KMP_ROOM(double, moving *W, &a->by_parameters)));
}

/* Ends the integrator, with its work. */
static void add_work(adjoint *a)
{
    if (!a->solver)
        return;
    a->work.steps += a->solver->work.steps;
    a->work.rhs += a->solver->work.rhs;
    a->kind->release(a->solver);
    a->solver = NULL;
}

/* The integrator of a segment. */
static kempe_status make_solver(adjoint *a)
{
    const kmp_run_spec *spec = a->options->spec;
    const int p = a->p, size = 2 * p + a->moving + a->held;
    for (int i = 0; i < p; i++) {
        const double scale = a->v->system->scale[a->v->linear.part.u[i]];
        a->atol[i] = spec->atol * a->reach / scale;
        a->atol[p + i] = spec->atol * a->reach / (scale * a->rate_scale);
    }
    for (int k = 0; k < a->moving; k++)
        a->atol[2 * p + k] = spec->atol * a->reach / a->sizes[a->moves[k]];
    for (int j = 0; j < a->held; j++)
        a->atol[2 * p + a->moving + j] = spec->atol * a->reach / a->v->system->row_scale[a->row[j]];
    if (a->solver && a->size == size)
        return KEMPE_OK;
    add_work(a);
    a->size = size;
    a->ode = (kmp_ode){.n = size,
                       .self = a,
                       .rhs = rhs,
                       .accept = accept,
                       .jacobian = jacobian,
                       .quadratures = a->moving + a->held,
                       .results = true};
    KMP_TRY(add_lanes(a));
    kempe_context *context = a->v->system->context;
    a->solver = a->kind->create(
        a->kind,
        &(kmp_solver_setup){.context = context, .ode = &a->ode, .tolerance = {spec->rtol, a->atol}, .linear = "auto"});
    return a->solver ? KEMPE_OK : KEMPE_E_MEMORY;
}

/* -- backwards over segments -------------------------------------------------------------------------- */

static void put_unknowns(adjoint *a)
{
    const double *from = a->unknown + 2 * a->p;
    double *to = a->y + 2 * a->p;
    memcpy(a->y, a->unknown, 2 * (size_t)a->p * sizeof *a->y);
    for (int k = 0; k < a->moving; k++)
        to[a->moves[k]] = from[k];
    memcpy(to + a->count, from + a->moving, (size_t)a->held * sizeof *to);
}

/* Integrates backwards over the current segment. */
static kempe_status pass_segment(adjoint *a, double *h)
{
    kempe_context *context = a->v->system->context;
    double end = a->options->spec->t_end - a->first->from;
    unsigned long failures = kmp_memory_failures();
    a->known = false;
    if (a->last->to - a->first->from <= KMP_SAME_TIME * a->options->spec->t_end) /* between two events of one time */
        return KEMPE_OK;
    /* The unknowns of the integrator, from all weights. */
    memcpy(a->unknown, a->y, 2 * (size_t)a->p * sizeof *a->y);
    take_moving(a, a->y + 2 * a->p, a->unknown + 2 * a->p);
    kempe_status status = a->kind->start(a->solver, a->options->spec->t_end - a->last->to, a->unknown, NULL, end, *h);
    while (status == KEMPE_OK && a->solver->t < end) {
        status = a->kind->step(a->solver);
        kmp_progress(context, KMP_PROGRESS_STUDY, a->solver->t, a->options->spec->t_end, "s");
        if (status == KEMPE_OK && kmp_interrupted(context))
            return kmp_fail(context, KEMPE_STOPPED, "interrupted");
        const long steps = a->work.steps - a->before + a->solver->work.steps, most = a->options->spec->max_steps;
        if (status == KEMPE_OK && most > 0 && steps >= most && a->solver->t < end)
            return kmp_fail(context, KEMPE_E_FAILED,
                            "the limit of %ld steps (max_steps) is reached backwards at t = %.9g s", most,
                            a->options->spec->t_end - a->solver->t);
    }
    if (status == KEMPE_E_FAILED && kmp_memory_failures() != failures)
        return kmp_fail_memory(context);
    if (status == KEMPE_E_FAILED && kempe_context_message(context)[0] == '\0')
        return kmp_fail(context, status, "the step size of the adjoint integration became too small at t = %.9g",
                        a->options->spec->t_end - a->solver->t);
    *h = a->solver->h;
    KMP_TRY(status);
    KMP_TRY(a->kind->dense(a->solver, end, a->unknown, NULL));
    put_unknowns(a);
    return KEMPE_OK;
}

/* Integrates backwards from the end of the step `last` to the end of the step `before` (NULL: the start). */
static kempe_status come_back(adjoint *a, const kept_step *before, kept_step *last, double *h)
{
    for (; last != before; last = a->first->before) {
        /* A segment: steps up to `last` and after `before` in which each input is one polynomial, which is taken: steps
         * end at samples. */
        kmp_present_inputs *inputs = &a->v->linear.eval->inputs;
        a->first = a->last = a->at = last;
        kmp_present_inputs_stand(inputs, last->from);
        double from = -INFINITY; /* the last time, not after the step, at which a present piece begins */
        for (int k = 0; k < inputs->count; k++)
            from = inputs->piece[k].from <= last->from ? fmax(from, inputs->piece[k].from) : from;
        while (a->first->before != before && a->first->before->from >= from)
            a->first = a->first->before;
        KMP_TRY(pass_segment(a, h));
    }
    return KEMPE_OK;
}

static double along(int size, int k, const double *columns, const double *weights)
{
    return kmp_dot(size, columns + (ptrdiff_t)k * size, weights);
}

/* The weight of column k of a map, among the unknowns before it. */
static double *weight_of_column(const adjoint *a, const kmp_forward_map *map, int k)
{
    const int count = a->count, before = 2 * map->p;
    return k < count ? &a->y[before + k] : k < count + before ? &a->y[k - count] : &a->y[k];
}

/* Converts the weights of the state behind a map to weights of the state before it. */
static void pass_map(adjoint *a, const kmp_forward_map *map)
{
    const int after = map->p_after, before = map->p, count = a->count, held = map->held;
    const double *u = a->weights, *ud = u + after, *fixed = ud + after + count;
    memcpy(a->weights, a->y, (size_t)(2 * after + count + held) * sizeof *a->y);
    memset(a->y, 0, (size_t)(2 * before + count + held) * sizeof *a->y);
    memcpy(a->y + 2 * before, ud + after, (size_t)count * sizeof *a->y);
    for (int k = 0; k < map->columns; k++) {
        double *to = weight_of_column(a, map, k);
        *to += along(after, k, map->u_after, u) + along(after, k, map->ud_after, ud) +
               along(held, k, map->held_after, fixed);
        *to += a->weighs ? map->integral_after[k] : 0;
    }
}

/* The motion before a map, as far as a step ends there, in its own unknowns, charts and conditions. */
static kempe_status stand_before(adjoint *a, const kept_map *map)
{
    kmp_evaluator *eval = a->v->linear.eval;
    a->p = map->of.p;
    recall(a, map->last, map->of.t, a->state);
    kmp_eval_set_modes(eval, map->of.mode);
    if (a->v->system->chart_count > 0)
        kmp_eval_set_charts(eval, map->of.chart);
    kmp_present_inputs_stand(&eval->inputs, map->last->from);
    KMP_TRY(stand(a, map->of.t, map->of.q, &map->before->part, a->state));
    return make_solver(a);
}

/* The same where only other coordinates have become independent: at a state, weights of these are weights of all
 * coordinates, which the loops turn into weights of the ones before and of the parameters. */
static kempe_status pass_exchange(adjoint *a, const kept_map *map)
{
    const int after = map->of.p_after, before = map->of.p, rest = a->count + a->held;
    memcpy(a->weights, a->y, (size_t)(2 * after + rest) * sizeof *a->y);
    KMP_TRY(stand_before(a, map));
    memset(a->wq, 0, (size_t)a->n * sizeof *a->wq);
    memset(a->wqd, 0, (size_t)a->n * sizeof *a->wqd);
    for (int i = 0; i < after; i++) {
        a->wq[map->part.u[i]] = a->weights[i];
        a->wqd[map->part.u[i]] = a->weights[after + i];
    }
    kmp_linear_back(&a->v->linear, &(kmp_weights){.q = a->wq, .qd = a->wqd}, &a->back);
    memset(a->y, 0, (size_t)(2 * before) * sizeof *a->y);
    memcpy(a->y + 2 * before, a->weights + 2 * after, (size_t)rest * sizeof *a->y);
    add_back(a, a->y, a->y + before, a->y + 2 * before);
    return KEMPE_OK;
}

/* Adds a row of columns, times `factor`, to the weights before the map of a requirement. It is divided by the rounding
 * to which the requirement vanishes: derivatives by a parameter are then of the size 1 over the parameter's. */
static void add_row(adjoint *a, const placed_requirement *to, const double *row, double factor)
{
    for (int k = 0; k < to->map->of.columns; k++)
        *weight_of_column(a, &to->map->of, k) += factor / (to->of->part * to->of->rounding) * row[k];
}

#define LEAST_FACTOR 0.5

/* Different factors of requirements: what does not vanish does not cancel with another one. */
static double factor_of(int number)
{
    const double x = 0.6180339887498949 * number;
    return LEAST_FACTOR * (1 + x - floor(x));
}

/* Adds those requirements of a map whose turn it is. */
static void add_requirements(adjoint *a, const kept_map *map)
{
    for (; a->present < a->past && a->placed[a->present].map == map; a->present++)
        add_row(a, &a->placed[a->present], a->placed[a->present].of->off, factor_of(a->present));
}

/* True if steps end between a map and the one before it. */
static bool follows_steps(const kept_map *map)
{
    return map->last && map->last != (map->before ? map->before->last : NULL);
}

/* The weights at the start, from the weights at the end of the step `last`, behind `map`. */
static kempe_status all_back(adjoint *a, const kept_map *map, kept_step *last)
{
    double h = a->kind->implicit ? fmin(1e-3 / a->rate_scale, a->options->spec->t_end) : 0;
    for (; map; map = map->before) {
        KMP_TRY(come_back(a, map->last, last, &h));
        last = map->last;
        if (map->of.columns == 0) {
            KMP_TRY(pass_exchange(a, map));
            continue;
        }
        pass_map(a, &map->of);
        add_requirements(a, map);
        if (follows_steps(map))
            KMP_TRY(stand_before(a, map));
    }
    return KEMPE_OK;
}

/* -- requirements ------------------------------------------------------------------------------------- */

/* Ways back to the start that requirements may take. */
enum { MOST_WAYS = 250 };

/* The error of the weights of a requirement, whose rounding is 1. */
#define REQUIREMENT_ERROR 1e-2

/* The derivatives by parameters, in y, of the requirements from the present one to `to`, or of another row of this
 * one's map. */
static kempe_status find_derivatives(adjoint *a, int to, const double *row)
{
    const placed_requirement *first = &a->placed[a->present];
    if (a->ways++ == MOST_WAYS)
        return kmp_fail(a->v->system->context, KEMPE_E_FAILED,
                        "%s for each part of the state, and the adjoint method examines no more such events: the "
                        "forward method may have those with respect to parameters",
                        first->of->reason);
    memset(a->y, 0, (size_t)(2 * a->n + a->count + a->held) * sizeof *a->y);
    a->past = to;
    if (row)
        add_row(a, first, row, 1);
    else
        add_requirements(a, first->map);
    a->before = a->work.steps + (a->solver ? a->solver->work.steps : 0);
    a->reach = REQUIREMENT_ERROR / a->options->spec->atol;
    if (follows_steps(first->map))
        KMP_TRY(stand_before(a, first->map));
    return all_back(a, first->map->before, first->map->last);
}

/* True if the derivatives in y vanish to a part of `span`, or up to `rounding`. */
static bool vanishes(const adjoint *a, const double *off, double part, double rounding)
{
    bool does = true;
    for (int k = 0; k < a->count; k++)
        does = does && fabs(off[k]) <= part * a->span[k] + rounding / a->sizes[k];
    return does;
}

/* Finds out if derivatives by parameters satisfy one requirement, which they do not satisfy up to rounding. */
static kempe_status examine_terms(adjoint *a, int number)
{
    const placed_requirement *one = &a->placed[number];
    bool met = false;
    for (int k = 0; k < a->count; k++)
        a->off[k] = a->y[k] / factor_of(number);
    memset(a->span, 0, (size_t)a->count * sizeof *a->span);
    for (int j = 0; j < one->of->terms && !met; j++) {
        a->present = number;
        KMP_TRY(find_derivatives(a, number, one->of->term + (ptrdiff_t)j * one->map->of.columns));
        for (int k = 0; k < a->count; k++)
            a->span[k] += fabs(a->y[k]);
        met = vanishes(a, a->off, one->of->part, 1);
    }
    a->unmet = met ? a->unmet : one->of->reason;
    return KEMPE_OK;
}

/* Finds out if they satisfy the requirements from `from` to `to`: where a sum of all with different factors vanishes
 * up to their rounding, each of them does. */
static kempe_status examine(adjoint *a, int from, int to)
{
    a->present = from;
    KMP_TRY(find_derivatives(a, to, NULL));
    memset(a->span, 0, (size_t)a->count * sizeof *a->span);
    if (vanishes(a, a->y, 0, to - from > 1 ? LEAST_FACTOR : factor_of(from)))
        return KEMPE_OK;
    if (to - from == 1)
        return examine_terms(a, from);
    const int middle = from + (to - from) / 2;
    KMP_TRY(examine(a, from, middle));
    return examine(a, middle, to);
}

/* Checks that the maps hold for the derivatives by parameters. */
static kempe_status check_requirements(adjoint *a)
{
    int count = 0;
    if (a->required == 0)
        return KEMPE_OK;
    a->placed = KMP_ARENA_NEW(&a->arena, placed_requirement, a->required);
    KMP_TRY(kmp_made(a->v->system->context, a->placed));
    for (const kept_map *map = a->map; map; map = map->before)
        for (const kmp_forward_requirement *of = map->of.requirement; of; of = of->before)
            a->placed[count++] = (placed_requirement){map, of};
    a->weighs = false;
    KMP_TRY(examine(a, 0, count));
    return a->unmet ? kmp_fail(a->v->system->context, KEMPE_E_FAILED, "%s", a->unmet) : KEMPE_OK;
}

/* -- end --------------------------------------------------------------------------------------------- */

static bool make_room(adjoint *a)
{
    const int n = a->n, m = a->m, most = 2 * n + a->count + a->held;
    return KMP_ARENA_MAKE(
        &a->arena, KMP_ROOM(double, most, &a->y, &a->unknown, &a->atol, &a->weights, &a->by),
        KMP_ROOM(int, a->count, &a->moves),
        KMP_ROOM(double, n, &a->wq, &a->wqd, &a->wqdd, &a->w, &a->dq, &a->dqd, &a->dqdd, &a->back.force),
        KMP_ROOM(double, m, &a->wlambda, &a->back.h, &a->back.rate, &a->back.curve),
        KMP_ROOM(double, n, &a->wu, &a->back.u, &a->back.ud, &a->back.udd), KMP_ROOM(double, 2 * n, &a->state),
        KMP_ROOM(double, 2 * n * n, &a->matrix), KMP_ROOM(double, a->count, &a->off, &a->span));
}

/* The size of the target by its gradient, before the response of the mechanism, and by its value: weights at the end
 * may be rounding, as where the mechanism rests, and are none later. */
static double size_of_target(const adjoint *a)
{
    const double rate = a->rate_scale;
    double most = fabs(a->value);
    for (int i = 0; i < a->n; i++) {
        const double by_rates = fmax(fabs(a->wqd[i]), fabs(a->wqdd[i]) * rate) * rate;
        most = fmax(most, fmax(fabs(a->wq[i]), by_rates) * a->v->system->scale[i]);
    }
    return most;
}

/* The weights at the end, in y. */
static kempe_status begin_at_end(adjoint *a)
{
    const kmp_sensitivity_equations *v = a->v;
    const double t_end = a->options->spec->t_end, rate_scale = a->rate_scale;
    a->weighs = a->integral;
    recall(a, a->end, t_end, a->state);
    kmp_present_inputs_stand(&v->linear.eval->inputs, a->end->from);
    KMP_TRY(stand(a, t_end, a->end_q, &a->map->part, a->state));
    a->stood = t_end;
    const int p = a->p;
    memset(a->wu, 0, (size_t)p * sizeof *a->wu);
    go_back(a, true, a->wu, a->y, a->y + p, a->y + 2 * p);
    for (int i = 0; i < p; i++) {
        const double scale = v->system->scale[v->linear.part.u[i]];
        a->reach = fmax(a->reach, fmax(fabs(a->y[i]) * scale, fabs(a->y[p + i]) * scale * rate_scale));
    }
    a->reach = fmax(a->reach, KMP_ADJOINT_REACH * size_of_target(a));
    a->reach = a->reach > 0 ? a->reach : 1;
    if (a->integral) {
        memset(a->y, 0, (size_t)(2 * p + a->count + a->held) * sizeof *a->y);
        a->reach *= t_end;
    }
    return make_solver(a);
}

static kempe_status run_back(adjoint *a, bool known, kmp_adjoint_report *report)
{
    if (a->steps == 0)
        return fail(a, a->options->spec->t_end);
    a->rate_scale = report->forward.run.rate_scale;
    a->kind = kmp_solver_find(a->options->spec->integrator);
    KMP_TRY(kmp_made(a->v->system->context, make_room(a)));
    /* An integrand may depend on each parameter itself. */
    const kmp_slopes_sum *sum = a->v->sum;
    a->moving = a->integral ? a->count : sum->count;
    for (int k = 0; k < a->moving; k++)
        a->moves[k] = a->integral ? k : sum->parameter[k];
    a->p = a->end->p;
    KMP_TRY(begin_at_end(a));
    report->value = a->integral ? report->forward.integral : a->value;
    KMP_TRY(all_back(a, a->map, a->end));
    memcpy(a->gradient, a->y, (size_t)a->count * sizeof *a->gradient); /* nothing is before the start: p = 0 */
    KMP_TRY(known ? KEMPE_OK : check_requirements(a));
    add_work(a);
    report->steps = a->work.steps;
    report->rhs = a->work.rhs;
    report->kept = a->kept;
    return KEMPE_OK;
}

kempe_status kmp_adjoint_run(kmp_sensitivity_equations *varied, const kmp_forward *options,
                             const kmp_forward_target *target, bool integral, bool known, const double *sizes,
                             double *gradient, kmp_adjoint_report *report)
{
    adjoint a = {.v = varied,
                 .target = target,
                 .integral = integral,
                 .sizes = sizes,
                 .n = varied->n,
                 .m = varied->m,
                 .count = varied->count,
                 .gradient = gradient};
    kmp_run_spec spec = *options->spec;
    *report = (kmp_adjoint_report){0};
    spec.times = &spec.t_end;
    spec.time_count = 1;
    const kmp_forward motion = {.spec = &spec,
                                .alone = true,
                                .integrand = integral ? target : NULL,
                                .lanes = options->lanes,
                                .watch = {.user = &a, .row = keep_end, .step = keep_step, .map = keep_map}};
    a.options = &motion;
    if (KMP_ARENA_MAKE(&a.arena, KMP_ROOM(double, a.n, &a.end_q, &a.own_q, &a.own_qd, &a.own_qdd),
                       KMP_ROOM(double, chart_size(&a), &a.own_chart)))
        kmp_charts_reset(varied->system, a.own_chart);
    kempe_status status = a.arena.failed ? kmp_fail_memory(varied->system->context)
                                         : kmp_forward_run(varied, &motion, sizes, NULL, &report->forward);
    if (status == KEMPE_OK) {
        const double begin = kmp_cpu_now();
        varied->linear.eval->inputs.held = varied->weighted = true;
        status = run_back(&a, known, report);
        report->cpu_s = kmp_cpu_now() - begin;
        varied->linear.eval->inputs.held = varied->weighted = false;
        if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED)
            report->forward.run.reason = kmp_strdup(kempe_context_message(varied->system->context));
    }
    if (a.solver)
        a.kind->release(a.solver);
    for (kept_map *map = a.map; map; map = map->before)
        kmp_partition_free(&map->part);
    kmp_arena_free(&a.arena);
    return status;
}
