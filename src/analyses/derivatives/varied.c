/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion with sensitivities as a state: predicted from the nearer of two anchors along tangent and curvature, closed
 * by Newton's method, and differentiated there. Matrices belong to the linear equations at the state. */
#include "analyses/derivatives/varied.h"
#include "analyses/derivatives/state_sensitivity.h"
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/close.h"
#include "constraints/closing/deformation_rows.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/tolerances.h"
#include "linalg/dense/factors.h"
#include "linalg/dense/lapack.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/state.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

kempe_status kmp_sensitivity_equations_init(kmp_sensitivity_equations *varied, const kempe_system *system,
                                            const char *backend, kmp_slopes *slopes)
{
    *varied = (kmp_sensitivity_equations){.system = system,
                                          .slopes = slopes,
                                          .n = system->n,
                                          .m = system->m,
                                          .count = slopes->count,
                                          .columns = slopes->count};
    kempe_status status = kmp_linear_init(&varied->linear, system, backend);
    const int n = system->n;
    if (status == KEMPE_OK &&
        !KMP_ARENA_MAKE(&varied->arena,
                        KMP_ROOM(double, n, &varied->q, &varied->udd, &varied->residual, &varied->anchor[0].q,
                                 &varied->anchor[1].q),
                        KMP_ROOM(double, n *(2 + n), &varied->anchor[0].drift, &varied->anchor[1].drift),
                        KMP_ROOM(double, 3 * system->m + n, &varied->part),
                        KMP_ROOM(double, 2 * n + system->m, &varied->shift),
                        KMP_ROOM(double, n + system->m, &varied->zero), KMP_ROOM(double, n, &varied->base),
                        KMP_ROOM(double, slopes->shown, &varied->shown)))
        status = kmp_fail_memory(system->context);
    if (status != KEMPE_OK)
        kmp_sensitivity_equations_free(varied);
    return status;
}

KMP_CLEARS(kmp_sensitivity_equations, varied, kmp_linear_free(&varied->linear), kmp_arena_free(&varied->arena))

/* -- the state --------------------------------------------------------------------------------------- */

/* Anchors without a tangent. */
static void stand_alone(kmp_sensitivity_equations *v, double t, const double *q)
{
    for (int k = 0; k < 2; k++) {
        kmp_sensitivity_equations_place *at = &v->anchor[k];
        at->t = t;
        memcpy(at->q, q, (size_t)v->n * sizeof *q);
        memset(at->drift, 0, (size_t)(v->n * (2 + v->linear.p)) * sizeof *q);
    }
}

kempe_status kmp_sensitivity_equations_choose(kmp_sensitivity_equations *varied, double t, const double *q,
                                              const double *qd, const int *wish, int wish_count)
{
    kmp_linear *l = &varied->linear;
    KMP_TRY(kmp_linear_choose(l, t, q, wish, wish_count));
    if (!l->held)
        kmp_eval_freeze(l->eval, t, q, qd);
    l->held = true;
    stand_alone(varied, t, q);
    return KEMPE_OK;
}

kempe_status kmp_sensitivity_equations_take(kmp_sensitivity_equations *varied, double t, const double *q,
                                            kmp_partition *part)
{
    kempe_status status = kmp_linear_take(&varied->linear, part);
    if (status == KEMPE_OK)
        stand_alone(varied, t, q);
    return status;
}

kmp_sensitivity_equations_place *kmp_sensitivity_equations_next_anchor(kmp_sensitivity_equations *varied)
{
    kmp_sensitivity_equations_place *at = varied->anchor, last = at[0];
    at[0] = at[1];
    at[1] = last;
    return at;
}

void kmp_sensitivity_equations_anchor(kmp_sensitivity_equations *varied)
{
    const kmp_linear *l = &varied->linear;
    kmp_sensitivity_equations_place *at = kmp_sensitivity_equations_next_anchor(varied);
    memcpy(at->q, l->q, (size_t)varied->n * sizeof *l->q);
    memcpy(at->drift, l->red.x_t, (size_t)varied->n * sizeof *l->q);
    memcpy(at->drift + varied->n, l->red.a0, (size_t)varied->n * sizeof *l->q);
    memcpy(at->drift + 2 * varied->n, l->red.x, (size_t)(varied->n * l->p) * sizeof *l->q);
    at->t = l->t;
}

/* Predicts along the tangent, with its curvature. */
static void predict_from(kmp_sensitivity_equations *v, const kmp_sensitivity_equations_place *at, double t,
                         const double *u)
{
    const kmp_partition *part = &v->linear.part;
    const double *curve = at->drift + v->n, *x = curve + v->n;
    double tau = t - at->t;
    for (int i = 0; i < v->n; i++)
        v->q[i] = at->q[i] + tau * (at->drift[i] + 0.5 * tau * curve[i]);
    for (int k = 0; k < part->p; k++) {
        double du = u[k] - at->q[part->u[k]];
        for (int i = 0; i < v->n; i++)
            v->q[i] += x[i + k * v->n] * du;
    }
    for (int k = 0; k < part->p; k++)
        v->q[part->u[k]] = u[k];
}

/* Of the size of a coordinate: the most that it moves between two positions on the way to another. */
#define WAY_AT_ONCE 0.3

/* The nearer anchor. */
static const kmp_sensitivity_equations_place *nearer(const kmp_sensitivity_equations *v, double t)
{
    return &v->anchor[fabs(t - v->anchor[1].t) < fabs(t - v->anchor[0].t)];
}

/* Predicts from the nearer anchor. */
static void predict(kmp_sensitivity_equations *v, double t, const double *u)
{
    predict_from(v, nearer(v, t), t, u);
}

/* Closes the loops on the way from an anchor to (t, u) in parts, each predicted from the two before it, into v->q.
 * False where a coordinate moves by more than a part of its size at once: it could come to another position. */
static bool walk(kmp_sensitivity_equations *v, const kmp_sensitivity_equations_place *at, double t, const double *u,
                 int parts)
{
    const kmp_partition *part = &v->linear.part;
    double *before = v->shift;
    bool closed = true;
    memcpy(v->q, at->q, (size_t)v->n * sizeof *v->q);
    memcpy(before, at->q, (size_t)v->n * sizeof *before);
    for (int k = 1; closed && k <= parts; k++) {
        const double now = at->t + (t - at->t) * k / parts;
        for (int i = 0; i < v->n; i++) {
            const double q = v->q[i];
            v->q[i] += k == 1 ? (now - at->t) * at->drift[i] : q - before[i];
            before[i] = q;
        }
        for (int i = 0; i < part->p; i++)
            v->q[part->u[i]] = at->q[part->u[i]] + (u[i] - at->q[part->u[i]]) * k / parts;
        closed = !kmp_reduction_close(&v->linear.red, now, v->q, NULL, 0);
        for (int i = 0; closed && i < v->n; i++)
            closed = fabs(v->q[i] - before[i]) <= WAY_AT_ONCE * v->system->scale[i];
    }
    return closed;
}

bool kmp_sensitivity_equations_walk(kmp_sensitivity_equations *varied, double t, const double *u)
{
    enum { FEW = 8, MANY = 512 };
    bool closed = false;
    for (int parts = FEW; !closed && parts <= MANY; parts *= FEW)
        closed = walk(varied, nearer(varied, t), t, u, parts);
    return closed;
}

double kmp_sensitivity_equations_miss(kmp_sensitivity_equations *varied, const double *u)
{
    const kmp_linear *l = &varied->linear;
    double most = 0;
    predict_from(varied, &varied->anchor[0], l->t, u);
    for (int i = 0; i < varied->n; i++)
        most = fmax(most, fabs(l->q[i] - varied->q[i]) / varied->system->scale[i]);
    return most;
}

int kmp_sensitivity_equations_position(kmp_sensitivity_equations *varied, double t, const double *u, double *q)
{
    predict(varied, t, u);
    if (kmp_reduction_close(&varied->linear.red, t, varied->q, NULL, 0) &&
        !kmp_sensitivity_equations_walk(varied, t, u))
        return KMP_RETRY;
    memcpy(q, varied->q, (size_t)varied->n * sizeof *q);
    return KMP_GO;
}

int kmp_sensitivity_equations_at(kmp_sensitivity_equations *varied, double t, const double *u, const double *ud)
{
    predict(varied, t, u);
    return kmp_sensitivity_equations_near(varied, t, varied->q, ud);
}

int kmp_sensitivity_equations_near(kmp_sensitivity_equations *varied, double t, const double *q, const double *ud)
{
    kmp_linear *l = &varied->linear;
    if (kmp_linear_at_motion(l, t, q, ud) != KEMPE_OK)
        return KMP_RETRY;
    for (int i = 0; i < varied->n; i++)
        if (!isfinite(l->qdd[i]))
            return KMP_RETRY;
    if (l->plain || varied->weighted || varied->count == 0)
        return KMP_GO;
    kmp_instant at = kmp_linear_instant(l);
    kmp_slopes_at(varied->slopes, &at);
    return KMP_GO;
}

int kmp_sensitivity_equations_close(kmp_sensitivity_equations *varied, double t, const double *q, const double *ud)
{
    return kmp_linear_close(&varied->linear, t, q, ud) == KEMPE_OK ? KMP_GO : KMP_RETRY;
}

void kmp_sensitivity_equations_matrix(kmp_sensitivity_equations *varied, double *matrix)
{
    kmp_linear *l = &varied->linear;
    int p = l->p;
    double *unit = varied->udd;
    memset(unit, 0, (size_t)p * sizeof *unit);
    for (int c = 0; c < 2 * p; c++) {
        double *column = matrix + c * p;
        unit[c % p] = 1;
        kmp_change change = {.u = c < p ? unit : NULL, .ud = c < p ? NULL : unit};
        kmp_linear_follow(l, &change, &(kmp_response){.residual = column});
        kmp_linear_accelerate(l, column, column);
        unit[c % p] = 0;
    }
}

const char *kmp_sensitivity_equations_singular(const kmp_sensitivity_equations *varied)
{
    const kempe_system *s = varied->system;
    for (int c = 0; c < kmp_charts_count(s); c++)
        if (kmp_chart_regular(s, c, varied->linear.q) < KMP_AXES_LOST)
            return s->model->bodies[s->model->motions[s->chart_first[c]].body].joint;
    return NULL;
}

/* -- parameters -------------------------------------------------------------------------------------- */

kmp_change kmp_sensitivity_equations_change(kmp_sensitivity_equations *varied, int k)
{
    const int m = varied->m;
    double *room = varied->part;
    if (k < varied->count)
        return kmp_slopes_change(varied->slopes, k == KMP_COLUMN_OF_TIME ? varied->count : k, room);
    memset(room, 0, (size_t)(3 * m + varied->n) * sizeof *room);
    return (kmp_change){.h = room, .rate = room + m, .curve = room + 2 * m, .force = room + 3 * m};
}

static kmp_change change_by(kmp_sensitivity_equations *v, int k, const double *u, const double *ud)
{
    kmp_change change = kmp_sensitivity_equations_change(v, k);
    for (int r = 0; v->held && k != KMP_COLUMN_OF_TIME && r < v->m; r++)
        v->part[r] -= v->held[k * v->m + r];
    change.u = u;
    change.ud = ud;
    return change;
}

static void accelerate(kmp_sensitivity_equations *v, const kmp_change *change, double *sudd)
{
    kmp_linear_follow(&v->linear, change, &(kmp_response){.residual = v->residual});
    kmp_linear_accelerate(&v->linear, v->residual, sudd);
}

void kmp_sensitivity_equations_accelerate(kmp_sensitivity_equations *varied, int k, const double *su, const double *sud,
                                          double *sudd)
{
    kmp_change change = change_by(varied, k, su, sud);
    accelerate(varied, &change, sudd);
}

void kmp_sensitivity_equations_follow(kmp_sensitivity_equations *varied, int k, const double *su, const double *sud,
                                      double *q, double *qd, double *qdd, double *lambda)
{
    kmp_change change = change_by(varied, k, su, sud);
    if (qdd || lambda) {
        accelerate(varied, &change, varied->udd);
        change.udd = varied->udd;
    }
    kmp_linear_follow(&varied->linear, &change, &(kmp_response){q, qd, qdd, lambda, NULL});
}

/* The change of the equations by parameter k, q and time in v->part, at the state of the slopes and of `d`: of J qd +
 * h_t, or of M qdd + C - J' lambda. */
static const double *change_along(kmp_sensitivity_equations *v, const double *d, bool rates, int k, const double *dq,
                                  double time)
{
    const int count = rates ? v->m : v->n;
    double *sum = v->shift, *timed = v->part + (rates ? v->m : 3 * v->m);
    memset(sum, 0, (size_t)count * sizeof *sum);
    if (time != 0) {
        (void)kmp_sensitivity_equations_change(v, KMP_COLUMN_OF_TIME);
        for (int i = 0; i < count; i++)
            sum[i] = time * timed[i];
    }
    (void)kmp_sensitivity_equations_change(v, k);
    for (int i = 0; i < count; i++)
        sum[i] += timed[i];
    kmp_tangents_add(&v->linear.tangents, rates ? KMP_RATE_Q : KMP_R_Q, d, 1, dq, sum);
    return sum;
}

/* J' w by multipliers: M qdd + C - J' lambda depends on them by no other term. */
static void pull_by_multipliers(kmp_sensitivity_equations *v, kmp_instant at, const double *w, const double *dq,
                                const double *time, double *out)
{
    for (int side = 0; side < 2; side++) {
        at.lambda = side ? w : v->zero;
        kmp_slopes_at(v->slopes, &at);
        const double *d = kmp_tangents_derivatives(&v->linear.tangents, &at);
        for (int k = 0; k < v->columns; k++) {
            const double *force = change_along(v, d, false, k, dq + k * v->n, time ? time[k] : 0);
            for (int i = 0; i < v->n; i++)
                out[k * v->n + i] += side ? -force[i] : force[i];
        }
    }
}

/* J' w by the rates J qd + h_t of one coordinate after the other, where forces depend on multipliers, too. */
static void pull_by_rates(kmp_sensitivity_equations *v, kmp_instant at, const double *w, const double *dq,
                          const double *time, double *out)
{
    double *unit = v->base;
    memset(unit, 0, (size_t)v->n * sizeof *unit);
    at.qd = unit;
    for (int i = -1; i < v->n; i++) {
        if (i >= 0)
            unit[i] = 1;
        kmp_slopes_at(v->slopes, &at);
        const double *d = kmp_tangents_derivatives(&v->linear.tangents, &at);
        for (int k = 0; k < v->columns; k++) {
            const double *rates = change_along(v, d, true, k, dq + k * v->n, time ? time[k] : 0);
            double sum = 0;
            for (int r = 0; r < v->m; r++)
                sum += w[r] * rates[r];
            for (int j = 0; i < 0 && j < v->n; j++)
                out[k * v->n + j] = -sum;
            if (i >= 0)
                out[k * v->n + i] += sum;
        }
        if (i >= 0)
            unit[i] = 0;
    }
}

void kmp_sensitivity_equations_pull(kmp_sensitivity_equations *varied, const kmp_instant *at, const double *w,
                                    const double *dq, const double *time, double *out)
{
    kmp_instant here = *at;
    here.qd = here.qdd = here.lambda = varied->zero;
    memset(out, 0, (size_t)(varied->columns * varied->n) * sizeof *out);
    if (varied->system->load_row_count > 0)
        pull_by_rates(varied, here, w, dq, time, out);
    else
        pull_by_multipliers(varied, here, w, dq, time, out);
}

void kmp_sensitivity_equations_rates(kmp_sensitivity_equations *varied, double *qddd, double *lambda)
{
    const kmp_linear *l = &varied->linear;
    double *ud = varied->shift, *udd = ud + varied->n;
    for (int i = 0; i < l->p; i++) {
        ud[i] = l->qd[l->part.u[i]];
        udd[i] = l->qdd[l->part.u[i]];
    }
    kmp_sensitivity_equations_follow(varied, KMP_COLUMN_OF_TIME, ud, udd, NULL, NULL, qddd, lambda);
}

/* -- the derivative of assembly (constraints/closing/assemble.c) at its solution ---------------------------- */

/* Positions: held coordinates keep their start values. If these do not fix the position, so do the coordinates that
 * assembly leaves unchanged: it moves the dependent coordinates of its choice when the guess is nearly closed. From a
 * guess farther away the position depends on the iterations, and the model does not determine the derivative.
 *
 * Rates: given rates are kept, the others are corrected by the least norm,
 *
 *     d = S Jf' mu      Jf d = -(J qd_given + h_t)      S = scale^2 of the free coordinates,
 *
 * whose derivative is dd = dS Jf' mu + S (dJf' mu + Jf' dmu) with Jf dd from the closures; dS from the characteristic
 * length. */

#define LARGE (1 << 14)

typedef struct beginning {
    kmp_sensitivity_equations *v;
    kmp_arena arena;
    const kempe_assembly *a;
    const double *q, *qd; /* n: the closed state, before deformations move into balance */
    int n, m, held, *hold;
    bool *free;                /* n: rates that are corrected */
    double *jacobian, *scaled; /* m x n; the free columns over the row scales */
    double *mu, *x;            /* m; n */
    double *with, *without;    /* count x n: N' of J' mu by parameters; room */
    double *open, *closing;    /* count x m, count x n: what rates leave open, and their correction */
    double *pulled;            /* n */
} beginning;

/* -- positions --------------------------------------------------------------------------------------- */

/* Assembly takes its own choice if fewer coordinates are held than there are degrees of freedom: KEMPE_OK if the held
 * ones are independent in it. */
static kempe_status choose_as_free(beginning *b)
{
    kmp_linear *l = &b->v->linear;
    kmp_context_clear(b->v->system->context);
    KMP_TRY(kmp_linear_choose(l, 0, b->q, NULL, 0));
    for (int k = 0; k < b->held; k++)
        if (kmp_linear_place(l, b->hold[k]) < 0)
            return kmp_linear_choose(l, 0, b->q, b->hold, b->held); /* whose message says what is possible */
    return KEMPE_OK;
}

/* Held coordinates as independent ones; deformations that hold are some of them, in addition to the ones that the user
 * holds. One that is driven is where its drive has it, if joints have closed the loops. */
static kempe_status choose_with_held(beginning *b)
{
    kmp_linear *l = &b->v->linear;
    const bool *undeformed = b->v->system->model->start.undeformed;
    kempe_status status =
        undeformed ? kmp_linear_prefer(l, 0, b->q, b->held, b->hold) : kmp_linear_choose(l, 0, b->q, b->hold, b->held);
    if (status == KEMPE_E_FAILED && !undeformed)
        status = choose_as_free(b);
    KMP_TRY(status);
    bool independent = true;
    int count = 0;
    for (int k = 0; k < b->held; k++) {
        const bool is = kmp_linear_place(l, b->hold[k]) >= 0;
        independent = independent && (is || (undeformed && undeformed[b->hold[k]] && !b->a->deformed));
        if (is)
            b->hold[count++] = b->hold[k];
    }
    b->held = count;
    return independent ? KEMPE_OK : KEMPE_E_FAILED;
}

/* Takes the coordinates that are possible from the sentence about the choice (constraints/partition/partition.c), in
 * place of that sentence. */
static kempe_status refuse_held(const kempe_system *s)
{
    static const char before[] = "possible choice: ";
    const char *names = strstr(kempe_context_message(s->context), before);
    kmp_text sentence = {0};
    kmp_text_printf(&sentence,
                    "the start has no derivative with respect to parameters: not all held coordinates can be "
                    "independent there; hold others, as many as the degrees of freedom%s%s (start: hold)",
                    names ? ", for example " : "", names ? names + sizeof before - 1 : "");
    kmp_context_clear(s->context);
    return kmp_fail_text(s->context, KEMPE_E_FAILED, &sentence);
}

/* True if a drive or a lock has the coordinate in any case, whether the start holds it or not. */
static bool is_driven(const kempe_model *model, int motion)
{
    for (int c = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c]) && model->closures[c].motion == motion)
            return true;
    return false;
}

/* The number of coordinates on which no closure depends, besides the held ones: assembly leaves them as they are. */
static int count_untouched(const beginning *b)
{
    const kempe_system *s = b->v->system;
    const kmp_linear *l = &b->v->linear;
    int count = 0;
    for (int k = 0; k < l->p; k++) {
        const int c = l->part.u[k];
        bool touched = kmp_state_of(s->model, c) || s->model->start.hold[c];
        for (int e = 0; e < s->jacobian.count && !touched; e++)
            touched = s->jacobian.col[e] == c;
        count += !touched;
    }
    return count;
}

static kempe_status choose_as_assembled(beginning *b)
{
    const kempe_system *s = b->v->system;
    kmp_linear *l = &b->v->linear;
    for (int i = 0; i < b->n; i++)
        if (s->model->start.hold[i] && !is_driven(s->model, i))
            b->hold[b->held++] = i;
    bool near = b->m > 0 && (long)b->m * b->n <= LARGE;
    if (near) {
        for (int i = 0; i < b->n; i++)
            b->x[i] = s->model->start.q[i].value;
        kmp_eval_closure(l->eval, 0, b->x);
        near = kmp_eval_residual(l->eval) <= KMP_CLOSED_NEAR;
    }
    kempe_status status = choose_with_held(b);
    if (status == KEMPE_E_MEMORY)
        return status;
    if (status != KEMPE_OK)
        return refuse_held(s);
    const int freedoms = l->p - s->model->state_count; /* assembly moves no state */
    if (freedoms == b->held + count_untouched(b) || b->m == 0 || near)
        return KEMPE_OK;
    kmp_text sentence = {0};
    kmp_text_printf(&sentence,
                    "the start has no derivative with respect to parameters: it holds %d of %d degrees of freedom, so "
                    "that the result of the assembly depends on the guess; hold",
                    b->held, freedoms);
    for (int k = 0, named = 0; k < l->p; k++)
        if (l->part.u[k] < kmp_model_coordinates(s->model) && !s->model->start.hold[l->part.u[k]])
            kmp_text_printf(&sentence, "%s %s", named++ ? "," : "", s->model->motions[l->part.u[k]].name);
    kmp_text_put(&sentence, " too (start: hold), or give a closed start");
    return kmp_fail_text(s->context, KEMPE_E_FAILED, &sentence);
}

/* -- rates ------------------------------------------------------------------------------------------- */

static double row_scale(const beginning *b, int r)
{
    return b->v->system->row_scale[r];
}

/* Finds the kept rates, and mu / row scales of the correction of the others by assembly: scale Jf' mu, of least norm.
 * False: no memory. */
static bool find_correction(beginning *b)
{
    const kmp_start *start = &b->v->system->model->start;
    double *transposed = KMP_ARENA_NEW(&b->arena, double, (size_t)b->m *(size_t)b->n);
    kmp_eval_dense_jacobian(b->v->linear.eval, b->jacobian);
    for (int i = 0; i < b->n; i++) {
        b->free[i] = b->a->rates_changed || !start->qd_given[i];
        b->x[i] = b->free[i] ? (b->qd[i] - start->qd[i].value) / b->v->system->scale[i] : 0;
    }
    for (int i = 0; i < b->n; i++)
        for (int r = 0; r < b->m; r++)
            b->scaled[r + i * b->m] =
                b->free[i] ? b->jacobian[r + i * b->m] * b->v->system->scale[i] / row_scale(b, r) : 0;
    for (int i = 0; transposed && i < b->n; i++)
        for (int r = 0; r < b->m; r++)
            transposed[i + r * b->n] = b->scaled[r + i * b->m];
    bool ok = transposed &&
              kmp_least_squares(b->n, b->m, transposed, b->x, kmp_rounding_zero(b->v->system, KMP_RANK), b->mu) >= 0;
    for (int r = 0; ok && r < b->m; r++)
        b->mu[r] /= row_scale(b, r);
    return ok;
}

/* dqd of one parameter without the correction to the closures: given rates as they move, c = dS Jf' mu + S dJf' mu.
 * True if the closures are open then. */
static bool move_rate(beginning *b, int k, const double *dq, double *dqd)
{
    kmp_sensitivity_equations *v = b->v;
    int n = b->n, m = b->m;
    const double *scale = v->system->scale;
    double *open = b->open + (ptrdiff_t)k * m, *rows = b->without + m; /* of the rate */
    double longer = 2 * kmp_slopes_of_start(v->slopes, k, b->x, dqd) / v->system->length;
    for (int i = 0; i < n; i++) {
        bool moves = b->free[i] && !v->system->model->motions[i].rotation;
        dqd[i] += b->free[i] ? scale[i] * scale[i] * b->with[k * n + i] : 0;
        dqd[i] += moves ? longer * (b->qd[i] - v->system->model->start.qd[i].value) : 0;
    }
    (void)kmp_slopes_change(v->slopes, k, b->without);
    kmp_tangents_add(&v->linear.tangents, KMP_RATE_Q, v->linear.d, 1, dq, rows);
    bool any = false;
    for (int r = 0; r < m; r++) {
        for (int i = 0; i < n; i++)
            rows[r] += b->jacobian[r + i * m] * dqd[i];
        open[r] = rows[r] / -row_scale(b, r);
        any = any || open[r] != 0;
    }
    return any;
}

/* Derivatives of the rates, with the least correction to the closures. Afterwards parameter derivatives and tangents
 * belong to the start, with its own rates. False: no memory. */
static bool move_rates(beginning *b, const double *dq, double *dqd)
{
    const kempe_system *s = b->v->system;
    const int n = b->n, m = b->m, count = b->v->count;
    bool open = false;
    if (m > 0 && !find_correction(b))
        return false;
    /* (J' mu)_q dq + (J' mu)_p of all parameters into b->with, and the derivatives of the rates for what follows. */
    kmp_sensitivity_equations *v = b->v;
    bool corrected = false;
    for (int r = 0; r < b->m; r++)
        corrected = corrected || b->mu[r] != 0;
    kmp_instant at = kmp_linear_instant(&v->linear);
    if (corrected)
        kmp_sensitivity_equations_pull(v, &at, b->mu, dq, NULL, b->with);
    else
        memset(b->with, 0, (size_t)(v->count * b->n) * sizeof(double));
    kmp_slopes_at(v->slopes, &at);
    v->linear.d = kmp_tangents_derivatives(&v->linear.tangents, &at);
    for (int k = 0; k < count; k++)
        open |= move_rate(b, k, dq + k * n, dqd + k * n);
    if (!open)
        return true;
    if (kmp_least_squares_of(m, n, b->scaled, count, b->open, kmp_rounding_zero(s, KMP_RANK), b->closing) < 0)
        return false;
    for (int k = 0; k < count * n; k++)
        dqd[k] += s->scale[k % n] * b->closing[k];
    return true;
}

/* -- deformations in balance (constraints/closing/static_start.c) ---------------------------------------- */

/* With u = (e, r), the deformations e leave no residual R_e where u has no accelerations, and r and the rates of u
 * belong to the closed state before:
 *
 *     R_e,e de = -(R_e,r dr + R_e,ud dud + R_e,p) */

typedef struct balance {
    int count, *row;               /* deformations among u */
    double *slope, *step, *u, *ud; /* count x count; count; p; p */
    int *pivot;
} balance;

/* The choice of u, the state, and the factors of R_e,e. */
static kempe_status take_balance(beginning *b, balance *e)
{
    kmp_sensitivity_equations *v = b->v;
    kmp_linear *l = &v->linear;
    const kempe_system *s = v->system;
    const bool *moves = s->model->start.undeformed;
    kmp_partition part;
    KMP_TRY(kmp_deformation_rows_choose(&part, l->eval, &(kmp_deformation_choice){.moves = moves, .q = b->q}));
    KMP_TRY(kmp_linear_take(l, &part));
    const int p = l->p;
    KMP_TRY(kmp_made(s->context,
                     KMP_ARENA_MAKE(&b->arena, KMP_ROOM(int, p, &e->row, &e->pivot), KMP_ROOM(double, p *p, &e->slope),
                                    KMP_ROOM(double, p, &e->step, &e->u, &e->ud))));
    for (int k = 0; k < p; k++)
        if (moves[l->part.u[k]])
            e->row[e->count++] = k;
    kempe_status status = kmp_linear_at_rates(l, 0, b->a->q, b->a->qd, false);
    for (int k = 0; status == KEMPE_OK && k < e->count; k++) {
        e->u[e->row[k]] = 1;
        kmp_linear_follow(l, &(kmp_change){.u = e->u}, &(kmp_response){.residual = v->residual});
        e->u[e->row[k]] = 0;
        for (int i = 0; i < e->count; i++)
            e->slope[i + e->count * k] = v->residual[e->row[i]];
    }
    if (status != KEMPE_OK || kmp_lu_factor(e->count, e->slope, e->pivot) != 0)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the start has no derivative with respect to parameters: its deformations are in balance with "
                        "the load at which a flexible body buckles");
    kmp_instant at = kmp_linear_instant(l);
    kmp_slopes_at(v->slopes, &at);
    return KEMPE_OK;
}

/* Derivatives of the closed state before into derivatives of the balance. */
static kempe_status move_into_balance(beginning *b, double *dq, double *dqd)
{
    kmp_sensitivity_equations *v = b->v;
    balance e = {0};
    KMP_TRY(take_balance(b, &e));
    for (int k = 0; k < v->count; k++, dq += b->n, dqd += b->n) {
        for (int i = 0; i < v->linear.p; i++) {
            e.u[i] = dq[v->linear.part.u[i]];
            e.ud[i] = dqd[v->linear.part.u[i]];
        }
        for (int i = 0; i < e.count; i++)
            e.u[e.row[i]] = 0;
        kmp_change change = change_by(v, k, e.u, e.ud);
        kmp_linear_follow(&v->linear, &change, &(kmp_response){.residual = v->residual});
        for (int i = 0; i < e.count; i++)
            e.step[i] = -v->residual[e.row[i]];
        kmp_lu_solve(e.count, e.slope, e.pivot, 1, e.step);
        for (int i = 0; i < e.count; i++)
            e.u[e.row[i]] = e.step[i];
        kmp_sensitivity_equations_follow(v, k, e.u, e.ud, dq, dqd, NULL, NULL);
    }
    return KEMPE_OK;
}

/* -- equilibria -------------------------------------------------------------------------------------- */

/* The reason why an equilibrium has no derivative here; NULL: it has one. */
static const char *obstacle_at(const kempe_system *s, const kempe_assembly *a)
{
    if (a->inner_q)
        return "a spherical joint is near its singular position there; give it other axes";
    if (a->balance->moves)
        return "it is a steady motion, or a drive moves it; give its state as the start (start: q, qd)";
    if (kmp_model_rests(s->model))
        return "friction that sticks, and rigid contacts, have no derivative of an equilibrium; give its state as the "
               "start (start: q)";
    if (kmp_model_has_samples(s->model) || s->model->delay_count > 0)
        return "sampled states, and delays, have no derivative of an equilibrium; give their values as the start "
               "(start: states)";
    return NULL;
}

/* The derivative of an equilibrium: R(u, p) = 0 at rest. Coordinates that nothing depends on have the derivatives of
 * their start values. */
static kempe_status move_equilibrium(kmp_sensitivity_equations *v, const kempe_assembly *a, double *dq, double *dqd)
{
    static const char parameter[] = "a parameter";
    const kempe_system *s = v->system;
    const int n = v->n;
    kmp_linear *l = &v->linear;
    kmp_state_sensitivity at;
    kmp_arena arena = {0};
    const char **names = KMP_ARENA_NEW(&arena, const char *, v->count);
    double *start = KMP_ARENA_NEW(&arena, double, 2 * n);
    kempe_status status = kmp_made(s->context, names && start);
    for (int k = 0; status == KEMPE_OK && k < v->count; k++)
        names[k] = parameter;
    if (status == KEMPE_OK)
        status = kmp_linear_choose(l, 0, a->q, NULL, 0);
    if (status == KEMPE_OK && kmp_linear_at_rates(l, 0, a->q, a->qd, false) != KEMPE_OK)
        status = kmp_fail(s->context, KEMPE_E_FAILED,
                          "the start has no derivative with respect to parameters: the closures are singular at its "
                          "equilibrium");
    if (status == KEMPE_OK)
        status = kmp_state_sensitivity_init(&at, s, v->count, names);
    if (status == KEMPE_OK) {
        status = kmp_state_sensitivity_at(&at, l, v->slopes, KMP_KEEP_EQUILIBRIUM, NULL, NULL);
        if (status == KEMPE_OK && at.rank < l->p && (s->m > 0 || s->model->start.goal_count > 0))
            status = kmp_fail(s->context, KEMPE_E_FAILED,
                              "the start, an equilibrium, has no derivative with respect to parameters: no force "
                              "restrains '%s' there, and its place follows from loops or goals; add a spring",
                              s->model->motions[l->part.u[at.c[at.rank]]].name);
        memcpy(dq, at.q, (size_t)(n * v->count) * sizeof *dq);
        memcpy(dqd, at.qd, (size_t)(n * v->count) * sizeof *dqd);
        for (int k = 0; k < v->count; k++) {
            (void)kmp_slopes_of_start(v->slopes, k, start, start + n);
            for (int i = 0; i < a->balance->idle_count; i++)
                dq[a->balance->idle[i] + k * n] = start[a->balance->idle[i]];
        }
        kmp_state_sensitivity_free(&at);
    }
    kmp_arena_free(&arena);
    return status;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static kempe_status check(const kempe_system *s, const kempe_assembly *a)
{
    const char *why = a->balance ? obstacle_at(s, a) : NULL;
    if (why)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the start, an equilibrium, has no derivative with respect to parameters: %s", why);
    if (a->balance)
        return KEMPE_OK;
    if (s->model->start.goal_count > 0)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the start has no derivative with respect to parameters: it is the position nearest to goals "
                        "(start: goals); give the resulting coordinates as start values, and hold them");
    if (a->centred || a->rested)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the start has no derivative with respect to parameters: its %s are computed without "
                        "clearance; give the %s of all coordinates (start: %s)",
                        a->centred ? "positions" : "rates", a->centred ? "closed positions" : "rates",
                        a->centred ? "q" : "qd");
    if (a->deformed)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the start has no derivative with respect to parameters: deformations help to close its loops; "
                        "give start values of joints that close them, or hold coordinates with 'elastic: free'");
    if (a->inner_q)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the start has no derivative with respect to parameters: a spherical joint is near its "
                        "singular position there; give it other axes");
    return KEMPE_OK;
}

static kempe_status differentiate(beginning *b, double *dq, double *dqd)
{
    kmp_arena *a = &b->arena;
    int n = b->n, m = b->m;
    KMP_TRY(kmp_made(b->v->system->context,
                     KMP_ARENA_MAKE(a, KMP_ROOM(int, n, &b->hold), KMP_ROOM(bool, n, &b->free),
                                    KMP_ROOM(double, n, &b->x, &b->pulled), KMP_ROOM(double, m, &b->mu),
                                    KMP_ROOM(double, 3 * m + n, &b->without),
                                    KMP_ROOM(double, m *n, &b->jacobian, &b->scaled),
                                    KMP_ROOM(double, b->v->count *n, &b->with, &b->closing),
                                    KMP_ROOM(double, b->v->count *m, &b->open))));
    KMP_TRY(choose_as_assembled(b));
    /* The linear state is at the start; tangents and parameter derivatives have its rates. */
    kmp_sensitivity_equations *v = b->v;
    kmp_linear *l = &v->linear;
    if (kmp_linear_at_rates(l, 0, b->q, b->qd, true) != KEMPE_OK)
        return kmp_fail(v->system->context, KEMPE_E_FAILED,
                        "the start has no derivative with respect to parameters: its closures are singular, or a "
                        "coordinate moves no mass");
    kmp_instant at = kmp_linear_instant(&v->linear);
    kmp_slopes_at(v->slopes, &at);
    for (int k = 0; k < v->count; k++) {
        double *to = dq + k * b->n;
        (void)kmp_slopes_of_start(v->slopes, k, b->x, b->pulled);
        for (int i = 0; i < l->p; i++)
            v->udd[i] = b->x[l->part.u[i]];
        kmp_sensitivity_equations_follow(v, k, v->udd, NULL, to, NULL, NULL, NULL);
    }
    KMP_TRY(kmp_made(v->system->context, move_rates(b, dq, dqd)));
    return b->a->held_q ? move_into_balance(b, dq, dqd) : KEMPE_OK;
}

kempe_status kmp_sensitivity_equations_start(kmp_sensitivity_equations *varied, double *q, double *qd, double *dq,
                                             double *dqd)
{
    kempe_assembly *a = NULL;
    beginning b = {.v = varied, .n = varied->n, .m = varied->m};
    kempe_status status = kmp_assembly_at_start(varied->system, &a);
    if (status == KEMPE_OK && varied->count > 0)
        status = check(varied->system, a);
    b.a = a;
    b.q = a && a->held_q ? a->held_q : a ? a->q : NULL;
    b.qd = a && a->held_q ? a->held_qd : a ? a->qd : NULL;
    varied->linear.held = false;
    if (status == KEMPE_OK && varied->count > 0)
        status = a->balance ? move_equilibrium(varied, a, dq, dqd) : differentiate(&b, dq, dqd);
    if (status == KEMPE_OK && a) {
        memcpy(q, a->q, (size_t)varied->n * sizeof *q);
        memcpy(qd, a->qd, (size_t)varied->n * sizeof *qd);
    }
    kmp_arena_free(&b.arena);
    kempe_assembly_free(a);
    return status;
}
