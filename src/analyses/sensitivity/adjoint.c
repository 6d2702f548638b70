/* SPDX-License-Identifier: BSD-3-Clause */
/* Adjoint method: the derivative of one scalar, at the end of a motion or integrated over it, by all parameters at
 * once, for any number of them. First the motion, which is recorded (recorded_motion.h); then backwards in time the
 * weights L of its state, with y' = f(y, p), y = (u, ud),
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
#include "analyses/sensitivity/adjoint_stages.h"
#include "analyses/sensitivity/recorded_motion.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/steppers/solver.h"
#include "linalg/dense/dot.h"
#include "platform/platform.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The scalar, with weights on the results of a state: its own, or weights of other unknowns there. */
typedef struct differentiated {
    const kmp_forward_target *of;
    bool integral;
    bool weighs;                   /* as an integral it adds weights on the way back */
    double *q, *qd, *qdd, *lambda; /* weights: n, n, n, m */
    double *dq, *dqd, *dqdd;       /* n: room */
} differentiated;

/* Integrates backwards, from one change to the next: an integrator for as long as the unknowns keep their number. */
typedef struct integrator {
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    kmp_ode ode;
    double *y, *atol;     /* its unknowns, a part of the weights */
    double reach;         /* size of the weights at the end, for tolerances */
    kmp_solver_work work; /* of all integrators before */
    long before;          /* steps for other scalars */
} integrator;

typedef struct placed_requirement {
    const kmp_recorded_map *map;
    const kmp_forward_requirement *of;
} placed_requirement;

/* The requirements of all maps, which go back to the start several at a time. */
typedef struct requirements {
    placed_requirement *placed; /* the last one first */
    int present, past;          /* the next one that goes back, and the first one that does not */
    int ways;                   /* back so far */
    const char *unmet;          /* of the first event whose requirement is not met */
    double *off, *span;         /* count: derivatives of a requirement, and their size */
} requirements;

typedef struct adjoint {
    kmp_arena arena;
    kmp_sensitivity_equations *v;
    const kmp_forward *options;
    const double *sizes;
    int n, m, p, count;
    int moving, *moves; /* parameters with quadratures: their numbers */
    double rate_scale;
    kmp_recorded_motion motion;
    differentiated scalar;
    integrator integrator;
    kmp_adjoint_stages stages;
    requirements required;
    double *y;       /* weights: of u, ud (p each), parameters, held distances */
    double *weights; /* the same behind a map */
    double *by;      /* weights on parameters and held distances at a state: room */
    double *state;   /* 2 n: u and ud */
    double stood;    /* time of the whole state at the end of the motion; NAN: it is left */
    double *w, *wu;  /* n, p: room */
    double *matrix;  /* p x 2 p */
    kmp_changes_weight back;
} adjoint;

/* -- gradients at a state ---------------------------------------------------------------------------- */

/* Converts weights wq, wqd and, `whole`, wqdd on a motion in other charts to weights on it in these, by the columns of
 * the Jacobian between the charts. */
static void carry_back(adjoint *a, const kmp_chart_motion *from, const kmp_chart_motion *to, bool whole)
{
    const kempe_system *s = a->v->system;
    double *w[] = {a->scalar.q, a->scalar.qd, a->scalar.qdd}, *d[] = {a->scalar.dq, a->scalar.dqd, a->scalar.dqdd};
    int orders = whole ? 3 : 2;
    for (int c = 0; c < s->chart_count; c++) {
        int first = s->chart_first[c], chart = KMP_CHART_SIZE * c;
        double back[9] = {0};
        if (memcmp(from->chart + chart, to->chart + chart, KMP_CHART_SIZE * sizeof(double)) == 0)
            continue;
        for (int k = 0; k < 3 * orders; k++) {
            for (int i = 0; i < 3 * orders; i++)
                d[i / 3][first + i % 3] = i == k;
            kmp_chart_carry(s, c, from, to, a->scalar.dq, a->scalar.dqd, whole ? a->scalar.dqdd : NULL);
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
    const kmp_forward_target *x = a->scalar.of;
    kmp_copy_or_zero(a->n, x->q, a->scalar.q);
    kmp_copy_or_zero(a->n, x->qd, a->scalar.qd);
    kmp_copy_or_zero(a->n, x->qdd, a->scalar.qdd);
    kmp_copy_or_zero(a->m, x->lambda, a->scalar.lambda);
    const kmp_linear *l = &v->linear;
    if (!a->scalar.integral) /* else it has no angles that are others in other charts */
        carry_back(a, &(kmp_chart_motion){l->eval->chart, l->q, l->qd, l->qdd},
                   &(kmp_chart_motion){a->motion.own_chart, a->motion.own_q, a->motion.own_qd, a->motion.own_qdd},
                   true);
    if (!x->shown)
        return;
    kmp_instant at = kmp_linear_instant(&v->linear);
    (void)kmp_slopes_values(&v->slopes->outputs, &at);
    kmp_slopes_gradient(v->slopes, &v->slopes->outputs, x->shown,
                        &(kmp_direction){NULL, a->scalar.q, a->scalar.qd, a->scalar.qdd, a->scalar.lambda, out});
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
    for (int j = 0; j < a->motion.held; j++)
        out[a->count + j] -= a->back.h[a->motion.row[j]];
}

/* Adds to u, ud and out the contributions of weights on accelerations udd (p). The target's weights are added to udd,
 * if requested. */
static void go_back(adjoint *a, bool with_target, double *udd, double *u, double *ud, double *out)
{
    kmp_linear *l = &a->v->linear;
    if (with_target) {
        weigh_target(a, out);
        kmp_linear_back(l, &(kmp_weights){a->scalar.q, a->scalar.qd, a->scalar.qdd, a->scalar.lambda, NULL}, &a->back);
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
    const double t = kmp_recorded_motion_time(&a->motion, a->options->spec->t_end - back);
    if (t <= a->stood && t >= a->stood)
        return KMP_GO;
    a->stood = NAN;
    kmp_recorded_motion_at(&a->motion, t, a->state);
    return kmp_sensitivity_equations_at(a->v, t, a->state, a->state + a->p);
}

/* All stages of a step at once. */

static int rhs_of_stages(void *self, const double *t, const double *y, double *dy)
{
    return kmp_adjoint_stages_rates(&((adjoint *)self)->stages, t, y, dy);
}

static int integrands_of_stages(void *self, const double *t, const double *y, double *dy)
{
    return kmp_adjoint_stages_integrands(&((adjoint *)self)->stages, t, y, dy);
}

/* Takes the parameters that move the mechanism, and the held distances. */
static void take_moving(const adjoint *a, const double *from, double *to)
{
    for (int k = 0; k < a->moving; k++)
        to[k] = from[a->moves[k]];
    memcpy(to + a->moving, from + a->count, (size_t)a->motion.held * sizeof *to);
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    adjoint *a = self;
    int p = a->p;
    if (kmp_adjoint_stages_end_at(&a->stages, t)) {
        kmp_adjoint_stages_last(&a->stages, y, dy);
        return KMP_GO;
    }
    if (place(a, t) != KMP_GO)
        return KMP_RETRY;
    memset(dy, 0, (size_t)a->integrator.ode.n * sizeof *dy);
    memcpy(dy + p, y, (size_t)p * sizeof *dy);
    memcpy(a->wu, y + p, (size_t)p * sizeof *dy);
    memset(a->by, 0, (size_t)(a->count + a->motion.held) * sizeof *a->by);
    go_back(a, a->scalar.weighs, a->wu, dy, dy + p, a->by);
    take_moving(a, a->by, dy + 2 * p);
    return KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    adjoint *a = self;
    (void)y, (void)dy, (void)w;
    if (kmp_adjoint_stages_end_at(&a->stages, t))
        kmp_varied_lanes_anchor(a->options->lanes, KMP_STAGE_LANES - 1);
    else
        kmp_sensitivity_equations_anchor(a->v);
    return KMP_GO;
}

/* Jacobian of only the weights: the quadratures follow from them. */
static int jacobian(void *self, double t, const double *y, double *j)
{
    adjoint *a = self;
    int p = a->p;
    (void)y;
    if (!kmp_adjoint_stages_matrix(&a->stages, t, a->matrix)) {
        if (place(a, t) != KMP_GO)
            return KMP_RETRY;
        kmp_sensitivity_equations_matrix(a->v, a->matrix);
    }
    for (int k = 0; k < p; k++) {
        for (int i = 0; i < 2 * p; i++)
            j[i + (p + k) * a->integrator.ode.n] = a->matrix[k + i * p];
        j[p + k + k * a->integrator.ode.n] = 1;
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
    a->stages.known = false;
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
    if (!a->integrator.kind->lanes || a->scalar.integral || !a->options->lanes || has_elements(a->v->system))
        return KEMPE_OK;
    a->integrator.ode.lanes = rhs_of_stages;
    a->integrator.ode.integrands = integrands_of_stages;
    a->integrator.ode.width = KMP_STAGE_LANES;
    a->stages.lanes = a->options->lanes;
    a->stages.motion = &a->motion;
    a->stages.t_end = a->options->spec->t_end;
    const bool made = kmp_adjoint_stages_begin(&a->stages, &a->arena, a->p, a->moving);
    a->integrator.ode.cycles_of_step =
        kmp_varied_lanes_cycles(a->options->lanes) + kmp_varied_lanes_matrix_cycles(a->options->lanes);
    return kmp_made(a->v->system->context, made);
}

/* Steps backwards so far. */
static long steps_of(const integrator *x)
{
    return x->work.steps + (x->solver ? x->solver->work.steps : 0);
}

/* Ends the solver, with its work. */
static void end_solver(integrator *x)
{
    if (!x->solver)
        return;
    x->work.steps += x->solver->work.steps;
    x->work.rhs += x->solver->work.rhs;
    x->kind->release(x->solver);
    x->solver = NULL;
}

/* The integrator of a segment. */
static kempe_status make_solver(adjoint *a)
{
    integrator *x = &a->integrator;
    const kmp_run_spec *spec = a->options->spec;
    const int p = a->p, size = 2 * p + a->moving + a->motion.held;
    for (int i = 0; i < p; i++) {
        const double scale = a->v->system->scale[a->v->linear.part.u[i]];
        x->atol[i] = spec->atol * x->reach / scale;
        x->atol[p + i] = spec->atol * x->reach / (scale * a->rate_scale);
    }
    for (int k = 0; k < a->moving; k++)
        x->atol[2 * p + k] = spec->atol * x->reach / a->sizes[a->moves[k]];
    for (int j = 0; j < a->motion.held; j++)
        x->atol[2 * p + a->moving + j] = spec->atol * x->reach / a->v->system->row_scale[a->motion.row[j]];
    if (x->solver && x->ode.n == size)
        return KEMPE_OK;
    end_solver(x);
    x->ode = (kmp_ode){.n = size,
                       .self = a,
                       .rhs = rhs,
                       .accept = accept,
                       .jacobian = jacobian,
                       .quadratures = a->moving + a->motion.held,
                       .results = true};
    KMP_TRY(add_lanes(a));
    kempe_context *context = a->v->system->context;
    x->solver = x->kind->create(
        x->kind,
        &(kmp_solver_setup){.context = context, .ode = &x->ode, .tolerance = {spec->rtol, x->atol}, .linear = "auto"});
    return x->solver ? KEMPE_OK : KEMPE_E_MEMORY;
}

/* -- backwards over segments -------------------------------------------------------------------------- */

/* Integrates backwards over the current segment. */
static kempe_status pass_segment(adjoint *a, double *h)
{
    integrator *x = &a->integrator;
    const kmp_recorded_motion *motion = &a->motion;
    const double t_end = a->options->spec->t_end;
    const size_t both = 2 * (size_t)a->p;
    kempe_context *context = a->v->system->context;
    const double end = t_end - motion->first->from;
    unsigned long failures = kmp_memory_failures();
    a->stages.known = false;
    if (motion->last->to - motion->first->from <= KMP_SAME_TIME * t_end) /* between two events of one time */
        return KEMPE_OK;
    /* The unknowns of the integrator, from all weights. */
    memcpy(x->y, a->y, both * sizeof *a->y);
    take_moving(a, a->y + both, x->y + both);
    kempe_status status = x->kind->start(x->solver, t_end - motion->last->to, x->y, NULL, end, *h);
    while (status == KEMPE_OK && x->solver->t < end) {
        status = x->kind->step(x->solver);
        kmp_progress(context, KMP_PROGRESS_STUDY, x->solver->t, t_end, "s");
        if (status == KEMPE_OK && kmp_interrupted(context))
            return kmp_fail(context, KEMPE_STOPPED, "interrupted");
        const long steps = steps_of(x) - x->before, most = a->options->spec->max_steps;
        if (status == KEMPE_OK && most > 0 && steps >= most && x->solver->t < end)
            return kmp_fail(context, KEMPE_E_FAILED,
                            "the limit of %ld steps (max_steps) is reached backwards at t = %.9g s", most,
                            t_end - x->solver->t);
    }
    if (status == KEMPE_E_FAILED && kmp_memory_failures() != failures)
        return kmp_fail_memory(context);
    if (status == KEMPE_E_FAILED && kempe_context_message(context)[0] == '\0')
        return kmp_fail(context, status, "the step size of the adjoint integration became too small at t = %.9g",
                        t_end - x->solver->t);
    *h = x->solver->h;
    KMP_TRY(status);
    KMP_TRY(x->kind->dense(x->solver, end, x->y, NULL));
    /* All weights, from the unknowns of the integrator. */
    memcpy(a->y, x->y, both * sizeof *a->y);
    for (int k = 0; k < a->moving; k++)
        a->y[both + (size_t)a->moves[k]] = x->y[both + (size_t)k];
    memcpy(a->y + both + a->count, x->y + both + a->moving, (size_t)motion->held * sizeof *a->y);
    return KEMPE_OK;
}

/* Integrates backwards from the end of the step `last` to the end of the step `before` (NULL: the start). */
static kempe_status come_back(adjoint *a, const kmp_recorded_step *before, const kmp_recorded_step *last, double *h)
{
    for (; last != before; last = a->motion.first->before) {
        /* A segment: steps up to `last` and after `before` in which each input is one polynomial, which is taken: steps
         * end at samples. */
        kmp_present_inputs *inputs = &a->v->linear.eval->inputs;
        kmp_present_inputs_stand(inputs, last->from);
        double from = -INFINITY; /* the last time, not after the step, at which a present piece begins */
        for (int k = 0; k < inputs->count; k++)
            from = inputs->piece[k].from <= last->from ? fmax(from, inputs->piece[k].from) : from;
        kmp_recorded_motion_take(&a->motion, before, last, from);
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
        *to += a->scalar.weighs ? map->integral_after[k] : 0;
    }
}

/* The motion before a map, as far as a step ends there, in its own unknowns, charts and conditions. */
static kempe_status stand_before(adjoint *a, const kmp_recorded_map *map)
{
    kmp_evaluator *eval = a->v->linear.eval;
    a->p = map->of.p;
    kmp_recorded_step_at(map->last, map->of.t, a->state);
    kmp_eval_set_modes(eval, map->of.mode);
    if (a->v->system->chart_count > 0)
        kmp_eval_set_charts(eval, map->of.chart);
    kmp_present_inputs_stand(&eval->inputs, map->last->from);
    KMP_TRY(stand(a, map->of.t, map->of.q, &map->before->part, a->state));
    return make_solver(a);
}

/* The same where only other coordinates have become independent: at a state, weights of these are weights of all
 * coordinates, which the loops turn into weights of the ones before and of the parameters. */
static kempe_status pass_exchange(adjoint *a, const kmp_recorded_map *map)
{
    const int after = map->of.p_after, before = map->of.p, rest = a->count + a->motion.held;
    memcpy(a->weights, a->y, (size_t)(2 * after + rest) * sizeof *a->y);
    KMP_TRY(stand_before(a, map));
    memset(a->scalar.q, 0, (size_t)a->n * sizeof *a->scalar.q);
    memset(a->scalar.qd, 0, (size_t)a->n * sizeof *a->scalar.qd);
    for (int i = 0; i < after; i++) {
        a->scalar.q[map->part.u[i]] = a->weights[i];
        a->scalar.qd[map->part.u[i]] = a->weights[after + i];
    }
    kmp_linear_back(&a->v->linear, &(kmp_weights){.q = a->scalar.q, .qd = a->scalar.qd}, &a->back);
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
static void add_requirements(adjoint *a, const kmp_recorded_map *map)
{
    for (; a->required.present < a->required.past && a->required.placed[a->required.present].map == map;
         a->required.present++)
        add_row(a, &a->required.placed[a->required.present], a->required.placed[a->required.present].of->off,
                factor_of(a->required.present));
}

/* The weights at the start, from the weights at the end of the step `last`, behind `map`. */
static kempe_status all_back(adjoint *a, const kmp_recorded_map *map, const kmp_recorded_step *last)
{
    double h = a->integrator.kind->implicit ? fmin(1e-3 / a->rate_scale, a->options->spec->t_end) : 0;
    for (; map; map = map->before) {
        KMP_TRY(come_back(a, map->last, last, &h));
        last = map->last;
        if (map->of.columns == 0) {
            KMP_TRY(pass_exchange(a, map));
            continue;
        }
        pass_map(a, &map->of);
        add_requirements(a, map);
        if (kmp_recorded_map_follows_steps(map))
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
    const placed_requirement *first = &a->required.placed[a->required.present];
    if (a->required.ways++ == MOST_WAYS)
        return kmp_fail(a->v->system->context, KEMPE_E_FAILED,
                        "%s for each part of the state, and the adjoint method examines no more such events: the "
                        "forward method may have those with respect to parameters",
                        first->of->reason);
    memset(a->y, 0, (size_t)(2 * a->n + a->count + a->motion.held) * sizeof *a->y);
    a->required.past = to;
    if (row)
        add_row(a, first, row, 1);
    else
        add_requirements(a, first->map);
    a->integrator.before = steps_of(&a->integrator);
    a->integrator.reach = REQUIREMENT_ERROR / a->options->spec->atol;
    if (kmp_recorded_map_follows_steps(first->map))
        KMP_TRY(stand_before(a, first->map));
    return all_back(a, first->map->before, first->map->last);
}

/* True if the derivatives in y vanish to a part of `span`, or up to `rounding`. */
static bool vanishes(const adjoint *a, const double *off, double part, double rounding)
{
    bool does = true;
    for (int k = 0; k < a->count; k++)
        does = does && fabs(off[k]) <= part * a->required.span[k] + rounding / a->sizes[k];
    return does;
}

/* Finds out if derivatives by parameters satisfy one requirement, which they do not satisfy up to rounding. */
static kempe_status examine_terms(adjoint *a, int number)
{
    const placed_requirement *one = &a->required.placed[number];
    bool met = false;
    for (int k = 0; k < a->count; k++)
        a->required.off[k] = a->y[k] / factor_of(number);
    memset(a->required.span, 0, (size_t)a->count * sizeof *a->required.span);
    for (int j = 0; j < one->of->terms && !met; j++) {
        a->required.present = number;
        KMP_TRY(find_derivatives(a, number, one->of->term + (ptrdiff_t)j * one->map->of.columns));
        for (int k = 0; k < a->count; k++)
            a->required.span[k] += fabs(a->y[k]);
        met = vanishes(a, a->required.off, one->of->part, 1);
    }
    a->required.unmet = met ? a->required.unmet : one->of->reason;
    return KEMPE_OK;
}

/* Finds out if they satisfy the requirements from `from` to `to`: where a sum of all with different factors vanishes
 * up to their rounding, each of them does. */
static kempe_status examine(adjoint *a, int from, int to)
{
    a->required.present = from;
    KMP_TRY(find_derivatives(a, to, NULL));
    memset(a->required.span, 0, (size_t)a->count * sizeof *a->required.span);
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
    if (a->motion.requirements == 0)
        return KEMPE_OK;
    a->required.placed = KMP_ARENA_NEW(&a->arena, placed_requirement, a->motion.requirements);
    KMP_TRY(kmp_made(a->v->system->context, a->required.placed));
    for (const kmp_recorded_map *map = a->motion.map; map; map = map->before)
        for (const kmp_forward_requirement *of = map->of.requirement; of; of = of->before)
            a->required.placed[count++] = (placed_requirement){map, of};
    a->scalar.weighs = false;
    KMP_TRY(examine(a, 0, count));
    return a->required.unmet ? kmp_fail(a->v->system->context, KEMPE_E_FAILED, "%s", a->required.unmet) : KEMPE_OK;
}

/* -- end --------------------------------------------------------------------------------------------- */

static bool make_room(adjoint *a)
{
    const int n = a->n, m = a->m, most = 2 * n + a->count + a->motion.held;
    return KMP_ARENA_MAKE(
        &a->arena, KMP_ROOM(double, most, &a->y, &a->integrator.y, &a->integrator.atol, &a->weights, &a->by),
        KMP_ROOM(int, a->count, &a->moves),
        KMP_ROOM(double, n, &a->scalar.q, &a->scalar.qd, &a->scalar.qdd, &a->w, &a->scalar.dq, &a->scalar.dqd,
                 &a->scalar.dqdd, &a->back.force),
        KMP_ROOM(double, m, &a->scalar.lambda, &a->back.h, &a->back.rate, &a->back.curve),
        KMP_ROOM(double, n, &a->wu, &a->back.u, &a->back.ud, &a->back.udd), KMP_ROOM(double, 2 * n, &a->state),
        KMP_ROOM(double, 2 * n * n, &a->matrix), KMP_ROOM(double, a->count, &a->required.off, &a->required.span));
}

/* The size of the target by its gradient, before the response of the mechanism, and by its value: weights at the end
 * may be rounding, as where the mechanism rests, and are none later. */
static double size_of_target(const adjoint *a)
{
    const double rate = a->rate_scale;
    double most = fabs(a->motion.value);
    for (int i = 0; i < a->n; i++) {
        const double by_rates = fmax(fabs(a->scalar.qd[i]), fabs(a->scalar.qdd[i]) * rate) * rate;
        most = fmax(most, fmax(fabs(a->scalar.q[i]), by_rates) * a->v->system->scale[i]);
    }
    return most;
}

/* The weights at the end, in y. */
static kempe_status begin_at_end(adjoint *a)
{
    const kmp_sensitivity_equations *v = a->v;
    const double t_end = a->options->spec->t_end, rate_scale = a->rate_scale;
    a->scalar.weighs = a->scalar.integral;
    kmp_recorded_step_at(a->motion.end, t_end, a->state);
    kmp_present_inputs_stand(&v->linear.eval->inputs, a->motion.end->from);
    KMP_TRY(stand(a, t_end, a->motion.q, &a->motion.map->part, a->state));
    a->stood = t_end;
    const int p = a->p;
    memset(a->wu, 0, (size_t)p * sizeof *a->wu);
    go_back(a, true, a->wu, a->y, a->y + p, a->y + 2 * p);
    for (int i = 0; i < p; i++) {
        const double scale = v->system->scale[v->linear.part.u[i]];
        a->integrator.reach =
            fmax(a->integrator.reach, fmax(fabs(a->y[i]) * scale, fabs(a->y[p + i]) * scale * rate_scale));
    }
    a->integrator.reach = fmax(a->integrator.reach, KMP_ADJOINT_REACH * size_of_target(a));
    a->integrator.reach = a->integrator.reach > 0 ? a->integrator.reach : 1;
    if (a->scalar.integral) {
        memset(a->y, 0, (size_t)(2 * p + a->count + a->motion.held) * sizeof *a->y);
        a->integrator.reach *= t_end;
    }
    return make_solver(a);
}

static kempe_status run_back(adjoint *a, bool known, double *gradient, kmp_adjoint_report *report)
{
    if (!a->motion.end)
        return fail(a, a->options->spec->t_end);
    a->rate_scale = report->forward.run.rate_scale;
    a->integrator.kind = kmp_solver_find(a->options->spec->integrator);
    KMP_TRY(kmp_made(a->v->system->context, make_room(a)));
    /* An integrand may depend on each parameter itself. */
    const kmp_slopes_sum *sum = a->v->sum;
    a->moving = a->scalar.integral ? a->count : sum->count;
    for (int k = 0; k < a->moving; k++)
        a->moves[k] = a->scalar.integral ? k : sum->parameter[k];
    a->p = a->motion.end->p;
    KMP_TRY(begin_at_end(a));
    report->value = a->scalar.integral ? report->forward.integral : a->motion.value;
    KMP_TRY(all_back(a, a->motion.map, a->motion.end));
    memcpy(gradient, a->y, (size_t)a->count * sizeof *gradient); /* nothing is before the start: p = 0 */
    KMP_TRY(known ? KEMPE_OK : check_requirements(a));
    end_solver(&a->integrator);
    report->steps = a->integrator.work.steps;
    report->rhs = a->integrator.work.rhs;
    report->kept = a->motion.bytes;
    return KEMPE_OK;
}

kempe_status kmp_adjoint_run(kmp_sensitivity_equations *varied, const kmp_forward *options,
                             const kmp_forward_target *target, bool integral, bool known, const double *sizes,
                             double *gradient, kmp_adjoint_report *report)
{
    adjoint a = {.v = varied,
                 .scalar = {.of = target, .integral = integral},
                 .sizes = sizes,
                 .n = varied->n,
                 .m = varied->m,
                 .count = varied->count};
    kmp_run_spec spec = *options->spec;
    *report = (kmp_adjoint_report){0};
    spec.times = &spec.t_end;
    spec.time_count = 1;
    const kmp_forward motion = {.spec = &spec,
                                .alone = true,
                                .integrand = integral ? target : NULL,
                                .lanes = options->lanes,
                                .watch = kmp_recorded_motion_watch(&a.motion)};
    a.options = &motion;
    kempe_status status = kmp_recorded_motion_init(&a.motion, varied, target)
                              ? kmp_forward_run(varied, &motion, sizes, NULL, &report->forward)
                              : kmp_fail_memory(varied->system->context);
    if (status == KEMPE_OK) {
        const double begin = kmp_cpu_now();
        varied->linear.eval->inputs.held = varied->weighted = true;
        status = run_back(&a, known, gradient, report);
        report->cpu_s = kmp_cpu_now() - begin;
        varied->linear.eval->inputs.held = varied->weighted = false;
        if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED)
            report->forward.run.reason = kmp_strdup(kempe_context_message(varied->system->context));
    }
    end_solver(&a.integrator);
    kmp_recorded_motion_free(&a.motion);
    kmp_arena_free(&a.arena);
    return status;
}
