/* SPDX-License-Identifier: BSD-3-Clause */
/* Adjoint method: the derivative of one scalar, at the end of a motion or integrated over it, by all parameters at
 * once, for any number of them. First the motion, stored as values of u and ud within each step; then backwards in time
 * the weights L of its state, with y' = f(y, p), y = (u, ud),
 *
 *     -dL/dt = f_y' L + g_y      L(t_end) = G_y      dG/dp = G_p + L(0)' dy_0/dp + integral of L' f_p + g_p
 *
 * (Cao, Li, Petzold and Serban, SIAM J. Scientific Computing 24 (2003) 1076, for index 1 and 0; here of the reduced
 * equations). f_y' L is kmp_linear_back: no matrix is made. Exchanges of u, and jumps at conditions that change
 * (forward.h), are passed backwards by their transposes.
 *
 * Backwards the unknowns are the weights of u and ud (p each), then the quadratures of all parameters; their time is
 * t_end - t. */
#include "analyses/sensitivity/adjoint.h"
#include "analyses/derivatives/varied_lanes.h"
#include "analyses/parts/unsupported.h"
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
#include "model/data/state.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Values of u and ud in each step, at Chebyshev's points: their polynomial is the polynomial of the integrators' dense
 * outputs, none of which has a higher degree. */
enum { NODES = 8 };

typedef struct kept_step {
    struct kept_step *before, *behind;
    double from, to;
    double values[]; /* NODES x 2 p */
} kept_step;

typedef struct kept_mark {
    struct kept_mark *before;
    kmp_sensitivity_equations_mark of; /* its arrays are copies */
    kept_step *last;                   /* before it; NULL: none */
} kept_mark;

typedef struct adjoint {
    kmp_arena arena;
    kmp_sensitivity_equations *v;
    const kmp_forward *options;
    const kmp_forward_target *target;
    bool integral;
    const double *sizes;
    int n, m, p, count, size;
    int steps;
    kept_step *begin, *end; /* of the whole motion */
    kept_mark *mark;        /* the last one */
    int resets;             /* the most of a mark */
    double swing;           /* weight of the time of a condition at which next values have been passed */
    int swung;              /* that condition */
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_ode ode;
    kept_step *first, *last, *at;                 /* steps: of the current segment; the last one used */
    double *y, *atol, *state, *gradient, value;   /* of the target at the end */
    double *end_q;                                /* the end of the last step, n */
    int *end_u;                                   /* independent there */
    double *own_chart, *own_q, *own_qd, *own_qdd; /* the end in the user's coordinates: charts; n */
    double *dq, *dqd, *dqdd;                      /* n: room */
    double *wq, *wqd, *wqdd, *wlambda, *w, *wu;   /* n, n, n, m; n; p */
    double *unit, *matrix;                        /* conditions; p x 2 p */
    double *rates, *wnext;                        /* n of each pass of a reset; states with next values */
    kmp_changes_weight back;
    bool known; /* the matrices in lanes belong to these times, and to this segment */
    double at_t[KMP_STAGE_LANES];
    double stood;                           /* time of the whole state at the end of the motion; NAN: it is left */
    double *stages;                         /* 2 p: u and ud, in lanes */
    double *of_state, *of_parameters, *udd; /* in lanes: p x 2 p; p x count; p */
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
    memcpy(a->end_u, l->part.u, (size_t)a->p * sizeof *a->end_u);
    kept_step *step = kmp_arena_alloc(&a->arena, 1, sizeof *step + NODES * width * sizeof *step->values);
    if (!step)
        return 1;
    for (int j = 0; j < NODES; j++) {
        const double *y = kmp_runner_unknowns(runner, j == NODES - 1 ? to : from + node(j) * (to - from));
        if (!y)
            return 1;
        memcpy(step->values + (size_t)j * width, y, width * sizeof *y);
    }
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

static int samples_of(const adjoint *a)
{
    return a->v->slopes->samples.rows;
}

static int keep_mark(void *user, const kmp_sensitivity_equations_mark *mark)
{
    adjoint *a = user;
    kept_mark *kept_as = KMP_ARENA_NEW(&a->arena, kept_mark, 1);
    if (!kept_as)
        return 1;
    size_t n = (size_t)a->n, p = (size_t)a->v->linear.p, conditions = (size_t)a->v->system->events.count;
    kmp_sensitivity_equations_mark kept = *mark;
    kept.u = copy_of(a, mark->u, p, sizeof(int));
    kept.q = copy_of(a, mark->q, n, sizeof(double));
    kept.y = copy_of(a, mark->y, 2 * p, sizeof(double));
    kept.mode = copy_of(a, mark->mode, conditions, sizeof(double));
    kept.chart = copy_of(a, mark->chart, chart_size(a), sizeof(double));
    kept.next.chart = copy_of(a, mark->next.chart, chart_size(a), sizeof(double));
    kept.next.q = copy_of(a, mark->next.q, n, sizeof(double));
    kept.next.qd = copy_of(a, mark->next.qd, n, sizeof(double));
    kept.reset.taken = copy_of(a, mark->reset.taken, (size_t)mark->reset.times * (size_t)samples_of(a), sizeof(bool));
    kept.reset.y = copy_of(a, mark->reset.y, 2 * p, sizeof(double));
    a->resets = mark->reset.times > a->resets ? mark->reset.times : a->resets;
    *kept_as = (kept_mark){a->mark, kept, a->end};
    a->mark = kept_as;
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

static void add_back(adjoint *a, double *u, double *ud, double *out)
{
    for (int i = 0; i < a->p; i++) {
        u[i] += a->back.u[i];
        ud[i] += a->back.ud[i];
    }
    kmp_slopes_weighted(a->v->slopes, a->back.h, a->back.rate, a->back.curve, a->back.force, out);
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
    kmp_linear_accelerate(l, udd, a->w);
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
    a->known = false;
    for (size_t l = 0; l < W; l++) {
        recall(a, step_at(a, t[l]), t[l], a->state);
        for (size_t i = 0; i < 2 * p; i++)
            a->stages[i * W + l] = a->state[i];
    }
    int said = kmp_varied_lanes_run(a->options->lanes, true, t, a->stages, a->stages + p * W, a->udd);
    if (said == KMP_GO)
        said = kmp_varied_lanes_matrices(a->options->lanes, a->of_state, a->of_parameters);
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

/* The slopes there, by the matrices of that lane. */
static void recall_stage(const adjoint *a, const double *y, double *dy)
{
    int p = a->p;
    for (int c = 0; c < 2 * p + a->count; c++) {
        const double *of =
            c < 2 * p ? a->of_state + (ptrdiff_t)(c * p) * W : a->of_parameters + (ptrdiff_t)((c - 2 * p) * p) * W;
        dy[c] = c < p || c >= 2 * p ? 0 : y[c - p];
        for (int k = 0; k < p; k++)
            dy[c] += of[k * W + W - 1] * y[p + k];
    }
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
    multiply_transposed(p, a->count, a->of_parameters, y + rates, dy + 2 * rates);
    return KMP_GO;
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
    go_back(a, a->integral, a->wu, dy, dy + p, dy + 2 * p);
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

/* Takes the state (t, y) near q, of these independent coordinates. */
static kempe_status stand(adjoint *a, double t, const double *q, const int *u, const double *y)
{
    a->known = false;
    a->stood = NAN;
    KMP_TRY(kmp_sensitivity_equations_choose(a->v, t, q, q, u, a->p));
    if (kmp_sensitivity_equations_at(a->v, t, y, y + a->p) != KMP_GO)
        return fail(a, t);
    kmp_sensitivity_equations_anchor(a->v);
    return KEMPE_OK;
}

/* The state before a mark, in its own unknowns, charts and conditions. */
static kempe_status stand_before(adjoint *a, const kmp_sensitivity_equations_mark *mark)
{
    kmp_evaluator *eval = a->v->linear.eval;
    for (int k = 0; k < a->v->system->events.count; k++)
        kmp_eval_set_mode(eval, k, mark->mode[k] != 0);
    if (mark->next.chart)
        kmp_eval_set_charts(eval, mark->chart);
    return stand(a, mark->t, mark->q, mark->u, mark->y);
}

/* Takes the weights of these u as weights wq and wqd of the whole mechanism. */
static void spread(adjoint *a, const int *u)
{
    memset(a->wq, 0, (size_t)a->n * sizeof *a->wq);
    memset(a->wqd, 0, (size_t)a->n * sizeof *a->wqd);
    for (int i = 0; i < a->p; i++) {
        a->wq[u[i]] = a->y[i];
        a->wqd[u[i]] = a->y[a->p + i];
    }
}

/* The weights of u from wq and wqd, at the last state. */
static void gather(adjoint *a)
{
    kmp_linear_back(&a->v->linear, &(kmp_weights){.q = a->wq, .qd = a->wqd}, &a->back);
    memset(a->y, 0, (size_t)(2 * a->p) * sizeof *a->y);
    add_back(a, a->y, a->y + a->p, a->y + 2 * a->p);
}

/* Converts weights of the new u after the mark to weights of the u before it. */
static kempe_status pass_exchange(adjoint *a, const kmp_sensitivity_equations_mark *mark, const int *next_u)
{
    spread(a, next_u);
    KMP_TRY(stand_before(a, mark));
    const kmp_linear *l = &a->v->linear;
    if (mark->next.chart)
        carry_back(a, &(kmp_chart_motion){mark->chart, l->q, l->qd, NULL}, &mark->next, false);
    gather(a);
    return KEMPE_OK;
}

/* -- next values of states -------------------------------------------------------------------------- */

/* The instant before pass k of a reset, at the last state. */
static kmp_instant before_pass(const adjoint *a, int k)
{
    const kmp_linear *l = &a->v->linear;
    return kmp_instant_of(l->eval, l->t, l->q, a->rates + (ptrdiff_t)k * a->n, l->qdd, l->lambda);
}

/* The weights of the rates at the last state, and of the integrand: how the whole depends on the time of a reset. */
static double weight_of_time(adjoint *a)
{
    const kmp_linear *l = &a->v->linear;
    return kmp_dot(a->n, a->wq, l->qd) + kmp_dot(a->n, a->wqd, l->qdd) +
           (a->integral ? kmp_target_value(a->target, a->v) : 0);
}

/* Converts weights of the states after pass k to weights before it, and adds to the weight of the time. */
static void take_back(adjoint *a, const kmp_sensitivity_equations_reset *reset, int k, double *time)
{
    kmp_sensitivity_equations *v = a->v;
    const kempe_model *model = v->system->model;
    const int samples = samples_of(a);
    const kmp_instant at = before_pass(a, k);
    (void)kmp_slopes_values(&v->slopes->samples, &at);
    for (int i = 0; i < samples; i++) {
        double *weight = &a->wqd[kmp_model_coordinates(model) + kmp_state_of_sample(model, i)];
        bool taken = reset->taken[k * samples + i];
        a->wnext[i] = taken ? *weight : 0;
        *weight = taken ? 0 : *weight;
    }
    kmp_slopes_gradient(v->slopes, &v->slopes->samples, a->wnext,
                        &(kmp_direction){time, a->wq, a->wqd, NULL, NULL, a->y + 2 * a->p});
}

/* Derivatives after a reset are those along it, s + xd- dt_e/dp, mapped by the next values, less xd+ dt_e/dp. */
static kempe_status pass_reset(adjoint *a, const kmp_sensitivity_equations_mark *mark, const int *next_u)
{
    const kmp_sensitivity_equations_reset *reset = &mark->reset;
    double after = 0, time = 0;
    spread(a, next_u);
    if (reset->cause >= 0) {
        if (kmp_sensitivity_equations_at(a->v, mark->t, reset->y, reset->y + a->p) != KMP_GO)
            return fail(a, mark->t);
        after = weight_of_time(a);
    }
    KMP_TRY(stand_before(a, mark));
    /* The rates before each pass of a reset. */
    kmp_sensitivity_equations *v = a->v;
    const kempe_model *model = v->system->model;
    const int first = kmp_model_coordinates(model), samples = samples_of(a);
    memcpy(a->rates, v->linear.qd, (size_t)a->n * sizeof *a->rates);
    for (int k = 0; k + 1 < reset->times; k++) {
        const kmp_instant at = before_pass(a, k);
        const double *value = kmp_slopes_values(&v->slopes->samples, &at);
        double *next = a->rates + (ptrdiff_t)(k + 1) * a->n;
        memcpy(next, a->rates + (ptrdiff_t)k * a->n, (size_t)a->n * sizeof *next);
        for (int i = 0; i < samples; i++)
            if (reset->taken[k * samples + i])
                next[first + kmp_state_of_sample(model, i)] = value[i];
    }
    for (int k = reset->times - 1; k >= 0; k--)
        take_back(a, reset, k, &time);
    if (reset->cause >= 0)
        a->swing += time + weight_of_time(a) - after;
    a->swung = reset->cause >= 0 ? reset->cause : a->swung;
    gather(a);
    return KEMPE_OK;
}

/* The weight of t_e: of the jump of accelerations, and of the integrand. */
static kempe_status pass_condition(adjoint *a, const kmp_sensitivity_equations_mark *mark)
{
    kmp_sensitivity_equations *v = a->v;
    kmp_linear *l = &v->linear;
    const bool swung = a->swung == mark->condition;
    double one = 1, weight = swung ? a->swing : 0;
    a->swing = swung ? 0 : a->swing;
    if (kmp_sensitivity_equations_at(v, mark->t, mark->y, mark->y + a->p) != KMP_GO)
        return fail(a, mark->t);
    for (int i = 0; i < a->p; i++)
        weight -= a->y[a->p + i] * l->qdd[l->part.u[i]];
    weight -= a->integral ? kmp_target_value(a->target, v) : 0;
    KMP_TRY(stand_before(a, mark));
    for (int i = 0; i < a->p; i++)
        weight += a->y[a->p + i] * l->qdd[l->part.u[i]];
    weight += a->integral ? kmp_target_value(a->target, v) : 0;
    kmp_instant at = kmp_linear_instant(&v->linear);
    (void)kmp_slopes_values(&v->slopes->events, &at);
    kmp_slopes_along(v->slopes, &v->slopes->events, &(kmp_direction){&one, l->qd, l->qdd, NULL, NULL, NULL}, -1,
                     a->unit);
    weight /= -a->unit[mark->condition];
    memset(a->unit, 0, (size_t)v->system->events.count * sizeof *a->unit);
    a->unit[mark->condition] = weight;
    memset(a->wq, 0, (size_t)a->n * sizeof *a->wq);
    memset(a->wqd, 0, (size_t)a->n * sizeof *a->wqd);
    kmp_slopes_gradient(v->slopes, &v->slopes->events, a->unit,
                        &(kmp_direction){NULL, a->wq, a->wqd, NULL, NULL, a->y + 2 * a->p});
    kmp_linear_back(l, &(kmp_weights){.q = a->wq, .qd = a->wqd}, &a->back);
    add_back(a, a->y, a->y + a->p, a->y + 2 * a->p);
    return KEMPE_OK;
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
    kempe_status status = a->kind->start(a->solver, a->options->spec->t_end - a->last->to, a->y, NULL, end, *h);
    while (status == KEMPE_OK && a->solver->t < end) {
        status = a->kind->step(a->solver);
        kmp_progress(context, KMP_PROGRESS_STUDY, a->solver->t, a->options->spec->t_end, "s");
        if (status == KEMPE_OK && kmp_interrupted(context))
            return kmp_fail(context, KEMPE_STOPPED, "interrupted");
    }
    if (status == KEMPE_E_FAILED && kmp_memory_failures() != failures)
        return kmp_fail_memory(context);
    if (status == KEMPE_E_FAILED && kempe_context_message(context)[0] == '\0')
        return kmp_fail(context, status, "the step size of the adjoint integration became too small at t = %.9g",
                        a->options->spec->t_end - a->solver->t);
    *h = a->solver->h;
    return status == KEMPE_OK ? a->kind->dense(a->solver, end, a->y, NULL) : status;
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

static kempe_status all_back(adjoint *a, double h)
{
    const int *next_u = a->v->linear.part.u;
    kept_step *last = a->end;
    int *behind = copy_of(a, next_u, (size_t)a->p, sizeof(int));
    KMP_TRY(kmp_made(a->v->system->context, behind));
    for (const kept_mark *k = a->mark; k; k = k->before) {
        KMP_TRY(come_back(a, k->last, last, &h));
        last = k->last;
        KMP_TRY(k->of.condition >= 0    ? pass_condition(a, &k->of)
                : k->of.reset.times > 0 ? pass_reset(a, &k->of, behind)
                                        : pass_exchange(a, &k->of, behind));
        memcpy(behind, k->of.u, (size_t)a->p * sizeof *behind);
    }
    return come_back(a, NULL, last, &h);
}

/* -- end --------------------------------------------------------------------------------------------- */

static bool make_room(adjoint *a)
{
    int n = a->n, m = a->m, p = a->p;
    a->size = 2 * p + a->count;
    a->ode =
        (kmp_ode){.n = a->size, .self = a, .rhs = rhs, .accept = accept, .jacobian = jacobian, .quadratures = a->count};
    return KMP_ARENA_MAKE(
        &a->arena, KMP_ROOM(double, a->size, &a->y, &a->atol),
        KMP_ROOM(double, n, &a->wq, &a->wqd, &a->wqdd, &a->w, &a->dq, &a->dqd, &a->dqdd, &a->back.force),
        KMP_ROOM(double, m, &a->wlambda, &a->back.h, &a->back.rate, &a->back.curve),
        KMP_ROOM(double, p, &a->wu, &a->back.u, &a->back.ud, &a->back.udd), KMP_ROOM(double, 2 * p, &a->state),
        KMP_ROOM(double, 2 * p * p, &a->matrix), KMP_ROOM(double, a->resets *n, &a->rates),
        KMP_ROOM(double, samples_of(a), &a->wnext), KMP_ROOM(double, a->v->system->events.count, &a->unit));
}

/* Begins the lanes, if the integrator uses them. */
static kempe_status add_lanes(adjoint *a)
{
    const size_t p = (size_t)a->p, count = (size_t)a->count;
    if (!a->kind->lanes || a->integral || !a->options->lanes)
        return KEMPE_OK;
    kmp_varied_lanes_begin(a->options->lanes);
    a->ode.lanes = rhs_of_stages;
    a->ode.width = W;
    a->ode.cycles_of_step =
        kmp_varied_lanes_cycles(a->options->lanes) + kmp_varied_lanes_matrix_cycles(a->options->lanes);
    return kmp_made(a->v->system->context,
                    KMP_ARENA_MAKE(&a->arena, KMP_ROOM(double, 2 * p * W, &a->stages), KMP_ROOM(double, p *W, &a->udd),
                                   KMP_ROOM(double, 2 * p * p * W, &a->of_state),
                                   KMP_ROOM(double, p *count *W, &a->of_parameters)));
}

static kempe_status run_back(adjoint *a, kmp_adjoint_report *report)
{
    kempe_context *context = a->v->system->context;
    double rate_scale = report->forward.run.rate_scale;
    if (a->steps == 0)
        return fail(a, a->options->spec->t_end);
    KMP_TRY(kmp_made(context, make_room(a)));
    /* The weights at the end, in y, and their sizes, for the tolerances. */
    kmp_sensitivity_equations *v = a->v;
    int p = a->p;
    double size = 0;
    recall(a, a->end, a->options->spec->t_end, a->state);
    kmp_present_inputs_stand(&v->linear.eval->inputs, a->end->from);
    KMP_TRY(stand(a, a->options->spec->t_end, a->end_q, a->end_u, a->state));
    a->stood = a->options->spec->t_end;
    memset(a->wu, 0, (size_t)p * sizeof *a->wu);
    go_back(a, true, a->wu, a->y, a->y + p, a->y + 2 * p);
    for (int i = 0; i < p; i++) {
        double scale = v->system->scale[v->linear.part.u[i]];
        size = fmax(size, fmax(fabs(a->y[i]) * scale, fabs(a->y[p + i]) * scale * rate_scale));
    }
    size = size > 0 ? size : 1;
    if (a->integral) {
        memset(a->y, 0, (size_t)a->size * sizeof *a->y);
        size *= a->options->spec->t_end;
    }
    for (int i = 0; i < p; i++) {
        double scale = v->system->scale[v->linear.part.u[i]];
        a->atol[i] = a->options->spec->atol * size / scale;
        a->atol[p + i] = a->options->spec->atol * size / (scale * rate_scale);
    }
    for (int k = 0; k < a->count; k++)
        a->atol[2 * p + k] = a->options->spec->atol * size / a->sizes[k];
    report->value = a->integral ? report->forward.integral : a->value;
    a->kind = kmp_solver_find(a->options->spec->integrator);
    KMP_TRY(add_lanes(a));
    a->solver = a->kind->create(a->kind, &(kmp_solver_setup){.context = context,
                                                             .ode = &a->ode,
                                                             .tolerance = {a->options->spec->rtol, a->atol},
                                                             .linear = "auto"});
    if (!a->solver)
        return KEMPE_E_MEMORY;
    KMP_TRY(all_back(a, a->kind->implicit ? fmin(1e-3 / rate_scale, a->options->spec->t_end) : 0));
    const int *u = a->v->linear.part.u;
    for (int k = 0; k < a->count; k++) {
        const double *q = a->options->start_q + k * a->n, *qd = a->options->start_qd + k * a->n;
        a->gradient[k] = a->y[2 * a->p + k];
        for (int i = 0; i < a->p; i++)
            a->gradient[k] += a->y[i] * q[u[i]] + a->y[a->p + i] * qd[u[i]];
    }
    kmp_solver_work work = a->solver->work;
    report->steps = work.steps;
    report->rhs = work.rhs;
    report->kept = (size_t)a->steps * NODES * 2 * (size_t)a->p * sizeof(double);
    return KEMPE_OK;
}

kempe_status kmp_adjoint_run(kmp_sensitivity_equations *varied, const kmp_forward *options,
                             const kmp_forward_target *target, bool integral, const double *sizes, double *gradient,
                             kmp_adjoint_report *report)
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
    if (varied->system->load_row_count > 0)
        return kmp_refuse_load_dependent(varied->system, "the adjoint method");
    spec.times = &spec.t_end;
    spec.time_count = 1;
    const kmp_forward motion = {.spec = &spec,
                                .alone = true,
                                .integrand = integral ? target : NULL,
                                .start_q = KMP_ARENA_NEW(&a.arena, double, a.n *a.count),
                                .start_qd = KMP_ARENA_NEW(&a.arena, double, a.n *a.count),
                                .lanes = options->lanes,
                                .watch = {.user = &a, .row = keep_end, .step = keep_step, .mark = keep_mark}};
    a.options = &motion;
    if (KMP_ARENA_MAKE(&a.arena, KMP_ROOM(double, a.n, &a.end_q, &a.own_q, &a.own_qd, &a.own_qdd),
                       KMP_ROOM(double, chart_size(&a), &a.own_chart), KMP_ROOM(int, a.n, &a.end_u)))
        kmp_charts_reset(varied->system, a.own_chart);
    kempe_status status = a.arena.failed ? kmp_fail_memory(varied->system->context)
                                         : kmp_forward_run(varied, &motion, sizes, NULL, &report->forward);
    if (status == KEMPE_OK) {
        varied->linear.eval->inputs.held = true;
        status = run_back(&a, report);
        varied->linear.eval->inputs.held = false;
        if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED)
            report->forward.run.reason = kmp_strdup(kempe_context_message(varied->system->context));
    }
    if (a.solver)
        a.kind->release(a.solver);
    kmp_arena_free(&a.arena);
    return status;
}
