/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced formulation: an ODE in the independent coordinates (Fisette and Samin 1996, eqs. 43-46), in two forms on
 * one state y = (u, ud[, v][, work]).
 *
 * - integrated: v is integrated by vd = Bvu ud + x_t; stages never iterate. At each accepted step one simplified Newton
 *   correction with the present factors returns v to the closure; a larger one than the error weight rejects the step.
 * - newton: every evaluation closes v for its u by Newton's method. Explicit one-step methods predict v by integrating
 *   it, others along the tangent from the last accepted step only. An evaluation whose corrections stop contracting
 *   fails and shortens the step. */
#include "integrators/formulations/reduced.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/tolerances.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/coordinate_exchange.h"
#include "integrators/decide/run_start.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/formulations/fastest_rate.h"
#include "integrators/formulations/reduced_programs.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include <float.h>
#include <kempe/kempe.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The choice of u on the reduced formulation. It ends at a dead centre: |Bvu| grows without bound and det Jv changes
 * sign. Both are monitored at every accepted step, because the ODE may pass such a point and continue wrongly without
 * any other sign. Before a dead centre u and v are exchanged, unless u is fixed. */

/* With fewer degrees of freedom the reduced mass is the cheapest. */
#define MANY_FREEDOMS 12
/* Cost of an operation of a reduced mass with zeros, relative to one without. */
#define BY_LISTS 2

/* -- monitoring ---------------------------------------------------------------------------------------- */

static const char *name_of(const kmp_reduced *d, int k)
{
    return k >= 0 ? kmp_model_motion(d->s->model, k)->name : "?";
}

static int dead_centre(kmp_reduced *d, double t, const char *sign, int v, int u)
{
    kmp_text_printf(&d->formulation.reason,
                    "independent coordinate '%s' reached a dead centre at t = %.9g s: %s for '%s'; '%s' determines the "
                    "mechanism only up to there. Choose another (--independent), or the projected formulation",
                    name_of(d, u), t, sign, name_of(d, v), name_of(d, u));
    return KMP_HALT;
}

/* The right-hand side is a function of only u where v is closed for it. An integrator that restarts at each exchange
 * would lose more than it gains. */
static double exchange_limit(const kmp_reduced *d, bool of_user)
{
    return kmp_exchange_limit(of_user, !d->integrated && !d->start.restarts);
}

/* Computes |Bvu| of the present tangent, and decides if an exchange is due. */
static void reduced_judge(kmp_reduced *d)
{
    if (d->r == 0)
        return;
    d->growth = kmp_reduction_growth(&d->red, &d->growth_v, &d->growth_u);
    d->formulation.due = !d->start.fixed && d->growth > exchange_limit(d, d->part.user);
}

/* Judges |Bvu| at the step's end, with the signs of Jv's blocks there: KMP_GO, KMP_RETRY, KMP_HALT. */
static int reduced_watch(kmp_reduced *d, double t, const int *signs)
{
    if (d->r == 0)
        return KMP_GO;
    reduced_judge(d);
    /* A block of Jv that was singular within the step may be an ignored change point, and no dead centre of u, at which
     * |Bvu| grows. */
    bool passed = d->start.margin->ignored && d->growth <= KMP_EXCHANGE_WISH;
    size_t bytes = (size_t)kmp_block_count(d->red.block) * sizeof *signs;
    bool crossed = memcmp(signs, d->signs, bytes) != 0 && !passed;
    if (d->start.fixed && crossed)
        return dead_centre(d, t, "two branches meet, and |dv/du| is largest", d->growth_v, d->growth_u);
    if (d->start.fixed && d->growth > KMP_GROWTH_LIMIT)
        return dead_centre(d, t, "|dv/du| exceeds 1000", d->growth_v, d->growth_u);
    d->crossed = crossed;
    if (!crossed)
        memcpy(d->signs, signs, bytes);
    return crossed ? KMP_RETRY : KMP_GO;
}

/* Reports why steps have shrunk to nothing: at a dead centre that evaluations cannot pass, or where det Jv repeatedly
 * changes its sign. */
static void reduced_explain(kmp_formulation *formulation)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    kmp_text what = {0};
    if (d->growth >= KMP_GROWTH_EXPLAINS) {
        kmp_text_printf(&what, "the loops cannot be closed beyond it, and |dv/du| has grown to %.3g", d->growth);
        (void)dead_centre(d, d->t, what.s ? what.s : "", d->growth_v, d->growth_u);
        kmp_text_free(&what);
    } else if (d->crossed) {
        kmp_text_printf(&formulation->reason,
                        "two branches meet at t = %.9g s (change point, |dv/du| = %.3g), and the motion may continue "
                        "on either; change start or lengths, or use the projected formulation",
                        d->t, d->growth);
    }
}

/* -- evaluators --------------------------------------------------------------------------------------- */

/* With many degrees of freedom the sparse saddle system costs less than the reduced mass, which has fewer zeros. */
static bool reduced_try_saddle(kmp_reduced *d)
{
    if (d->p < MANY_FREEDOMS || d->eval->by_bodies)
        return true;
    if (!kmp_saddle_init(&d->saddle, d->eval, &d->part))
        return false;
    double cost = d->saddle.sparse ? kmp_sparse_operations(d->saddle.sparse) : 0,
           count = (double)kmp_reduction_count(&d->red).paper;
    count *= d->red.zeros ? BY_LISTS : 1;
    d->by_saddle = cost > 0 && KMP_SPARSE_COST * cost < count;
    if (!d->by_saddle)
        kmp_saddle_free(&d->saddle);
    return true;
}

/* Makes the saddle system of the partition's rows, if it is used, where the evaluator already uses the formulation's
 * dynamics. false: no memory. */
static bool reduced_renew_saddle(kmp_reduced *d)
{
    long factorizations = d->saddle.factorizations;
    kmp_saddle_free(&d->saddle);
    bool made = !d->by_saddle || kmp_saddle_init(&d->saddle, d->eval, &d->part);
    d->saddle.factorizations = factorizations;
    return made;
}

/* -- exchanges --------------------------------------------------------------------------------------- */

static bool is_among(const int *list, int count, int k)
{
    for (int i = 0; i < count; i++)
        if (list[i] == k)
            return true;
    return false;
}

/* Index of the work among the unknowns. */
static int reduced_work(const kmp_reduced *d)
{
    return 2 * d->p + (d->has_v ? d->r : 0);
}

/* Sets the tolerances of the unknowns. */
static void reduced_set_tolerances(kmp_reduced *d)
{
    double *atol = d->formulation.atol;
    kmp_start_tolerances(d->p, d->part.u, d->has_v ? d->r : 0, d->part.v, kmp_model_coordinates(d->s->model),
                         d->s->scale, d->start.atol, d->start.rate_scale, 1, atol);
    if (d->has_work)
        atol[reduced_work(d)] = KMP_UNCONTROLLED;
}

/* Records the end of a step, without d->anchor, which needs accelerations. */
static void reduced_remember_place(kmp_reduced *d, double t, const double *y)
{
    d->t = t;
    if (d->integrated)
        return;
    /* Weights of errors of v, and the noise of closing. */
    for (int i = 0; i < d->n; i++)
        d->weight[i] = d->start.atol * d->s->scale[i] + d->start.rtol * fabs(d->q[i]);
    for (int i = 0; i < d->r; i++) {
        d->by_scale[i] = 1 / d->s->scale[d->part.v[i]];
        d->by_weight[i] = 1 / d->weight[d->part.v[i]];
    }
    d->anchor.noise = kmp_close_noise(d->n, d->s->scale, d->q);
    if (d->has_v)
        return;
    memcpy(d->anchor.u, y, (size_t)d->p * sizeof *d->anchor.u);
    /* The weights of u in the progress: rates over their square, in scales. */
    const double *ud = y + d->p;
    double speed = 0;
    for (int k = 0; k < d->p; k++) {
        double scale = d->s->scale[d->part.u[k]];
        d->anchor.w[k] = ud[k] / (scale * scale);
        speed += d->anchor.w[k] * ud[k];
    }
    d->anchor.by_time = d->s->rheonomic || !(speed > DBL_MIN);
    for (int k = 0; k < d->p; k++)
        d->anchor.w[k] /= speed;
    memcpy(d->anchor.b, d->red.bvu, (size_t)(d->r * d->p) * sizeof *d->anchor.b);
    for (int i = 0; i < d->r; i++) {
        d->anchor.v[i] = d->q[d->part.v[i]];
        d->anchor.t[i] = d->red.x_t[d->part.v[i]];
    }
}

/* Records the end of a step, from which v is predicted. */
static void reduced_remember(kmp_reduced *d, double t, const double *y)
{
    reduced_remember_place(d, t, y);
    for (int i = 0; !d->has_v && i < d->r; i++) {
        /* The i-th component of vdd without the part of udd. */
        double vdd = d->by_saddle ? d->qdd[d->part.v[i]] : d->red.a0[d->part.v[i]];
        for (int k = 0; d->by_saddle && k < d->p; k++)
            vdd -= d->red.bvu[i + k * d->r] * d->qdd[d->part.u[k]];
        d->anchor.c[i] = vdd;
    }
}

/* Computes factors, tangent, signs and anchor of d->q with the present partition. */
static int reduced_linearise_at(kmp_reduced *d, double t, const double *y)
{
    d->contraction = 0;
    kmp_eval_closure(d->eval, t, d->q);
    if (kmp_reduction_factor(&d->red))
        return KMP_HALT;
    kmp_reduction_tangent(&d->red);
    if (d->r > 0)
        kmp_block_take_signs(d->red.block, d->signs);
    reduced_remember(d, t, y);
    return KMP_GO;
}

static void log_exchange(const kmp_reduced *d, double t, const kmp_partition *before)
{
    kmp_text out = {0}, in = {0};
    for (int k = 0; k < d->p; k++) {
        if (!is_among(d->part.u, d->p, before->u[k]))
            kmp_text_printf(&out, "%s'%s'", out.length ? ", " : "", name_of(d, before->u[k]));
        if (!is_among(before->u, d->p, d->part.u[k]))
            kmp_text_printf(&in, "%s'%s'", in.length ? ", " : "", name_of(d, d->part.u[k]));
    }
    kmp_run_log_add(d->start.log, "exchange", t, d->growth, d->part.max_b,
                    "%s instead of %s as independent coordinate: |dv/du| %.3g -> %.3g", in.s ? in.s : "",
                    out.s ? out.s : "", d->growth, d->part.max_b);
    kmp_text_free(&out);
    kmp_text_free(&in);
}

/* Makes a due exchange at d->q and d->qd, the evaluator's place; y becomes the state in the new unknowns. */
static int reduced_exchange(kmp_reduced *d, double t, double *y)
{
    kmp_partition before;
    d->formulation.due = false;
    if (!kmp_reduced_keep(d) || !kmp_partition_copy(&before, &d->part))
        return KMP_HALT;
    /* The workspace of the new partition, then the state in its unknowns. */
    kmp_reduction red = d->red;
    bool made = kmp_partition_exchange(&d->part, d->s, d->eval->jacobian, exchange_limit(d, false)) == KEMPE_OK &&
                kmp_reduction_init(&d->red, d->eval, &d->part) == KEMPE_OK;
    if (made) {
        d->red.newton = red.newton;
        d->red.factorizations = red.factorizations;
        kmp_reduction_free(&red);
    } else {
        d->red = red;
    }
    int said = KMP_HALT;
    if (made && reduced_renew_saddle(d)) {
        kmp_reduced_pack(&d->part, d->has_v, d->q, d->qd, y);
        reduced_set_tolerances(d);
        d->formulation.exchanges++;
        bool worth = d->use.steps >= KMP_FORMULATION_BRIEF, lanes = d->start.lanes;
        d->start.lanes = lanes && !d->formulation.spares;
        said = reduced_linearise_at(d, t, y) == KMP_GO ? kmp_reduced_make_program(d, worth) : KMP_HALT;
        d->start.lanes = d->start.lanes || d->programs.stages.lanes;
        d->formulation.lacks_lanes = lanes && !d->start.lanes;
    }
    if (said == KMP_GO)
        log_exchange(d, t, &before);
    kmp_partition_free(&before);
    return said;
}

void kmp_reduced_pack(const kmp_partition *part, bool has_v, const double *q, const double *qd, double *y)
{
    for (int k = 0; k < part->p; k++) {
        y[k] = q[part->u[k]];
        y[part->p + k] = qd[part->u[k]];
    }
    for (int i = 0; has_v && i < part->r; i++)
        y[2 * part->p + i] = q[part->v[i]];
}

/* -- prediction of v ---------------------------------------------------------------------------------- */

/* Prediction of v in the newton form where it is not among the unknowns: along its tangent and curvature from the last
 * accepted step. */

/* Predicts d->v of (t, u) from the last accepted step: B du + x_t tau + c s^2 / 2. */
static void reduced_predict(kmp_reduced *d, double t, const double *u)
{
    double tau = t - d->t, s = 0; /* progress of u since the last accepted step, in its time */
    for (int k = 0; k < d->p; k++)
        s += d->anchor.w[k] * (u[k] - d->anchor.u[k]);
    /* Small rates, from which a motion begins, say little of the progress. */
    const double most = KMP_PREDICTED_PROGRESS * fabs(tau);
    s = d->anchor.by_time ? tau : fmax(-most, fmin(s, most));
    const double half = 0.5 * s * s;
    const kmp_sparse_tangent *zeros = d->red.zeros;
    for (int i = 0; i < d->r; i++)
        d->v[i] = d->anchor.v[i] + tau * d->anchor.t[i] + half * d->anchor.c[i];
    for (int k = 0; k < d->p; k++) {
        const double *b = d->anchor.b + k * d->r;
        double du = u[k] - d->anchor.u[k];
        if (zeros) {
            const int *row;
            for (int e = 0, count = kmp_sparse_tangent_rows(zeros, k, &row); e < count; e++)
                d->v[row[e]] += b[row[e]] * du;
            continue;
        }
        for (int i = 0; i < d->r; i++)
            d->v[i] += b[i] * du;
    }
}

/* -- evaluation --------------------------------------------------------------------------------------- */

static void place_q(kmp_reduced *d, const double *u, const double *v)
{
    for (int k = 0; k < d->p; k++)
        d->q[d->part.u[k]] = u[k];
    for (int i = 0; i < d->r; i++)
        d->q[d->part.v[i]] = v[i];
}

/* Puts q, with v of the unknowns or predicted. */
static void put_q(kmp_reduced *d, double t, const double *y)
{
    if (!d->has_v)
        reduced_predict(d, t, y);
    place_q(d, y, d->has_v ? y + 2 * d->p : d->v);
}

/* qd at the placed q. */
static void close_rates(kmp_reduced *d, const double *ud)
{
    if (d->by_saddle)
        kmp_reduction_rates_alone(&d->red, ud, d->qd);
    else
        kmp_reduction_rates(&d->red, ud, d->qd);
}

/* Computes d->q and d->qd at (t, y), factors of Jv and the tangent. KMP_GO or KMP_RETRY. Accelerations by articulated
 * bodies need no tangent. */
static int reduced_place(kmp_reduced *d, double t, const double *y)
{
    put_q(d, t, y);
    if (d->integrated)
        kmp_eval_closure(d->eval, t, d->q);
    if (d->integrated ? kmp_reduction_factor(&d->red)
                      : kmp_reduction_close(&d->red, t, d->q, d->weight, KMP_CORRECTION_IN_STAGE))
        return KMP_RETRY;
    if (!d->by_saddle)
        kmp_reduction_tangent(&d->red);
    close_rates(d, y + d->p);
    return KMP_GO;
}

/* udd at the present q and qd. */
static int accelerate_closed(kmp_reduced *d)
{
    kmp_eval_mass(d->eval);
    if (!d->by_saddle)
        return kmp_reduction_move(&d->red, d->qd, d->udd) ? KMP_RETRY : KMP_GO;
    kmp_eval_bias(d->eval, d->qd);
    /* Computes qdd, lambda and udd without a reduced mass. */
    if (kmp_saddle_factor(&d->saddle))
        return KMP_RETRY;
    kmp_saddle_accelerations(&d->saddle, d->qdd, d->lambda);
    for (int k = 0; k < d->p; k++)
        d->udd[k] = d->qdd[d->part.u[k]];
    return KMP_GO;
}

/* As reduced_place; then d->udd, too. */
static int reduced_evaluate(kmp_reduced *d, double t, const double *y)
{
    return reduced_place(d, t, y) == KMP_GO ? accelerate_closed(d) : KMP_RETRY;
}

/* qdd and lambda from udd. */
static void find_multipliers(kmp_reduced *d)
{
    if (d->by_saddle)
        return;
    kmp_reduction_accelerations(&d->red, d->udd, d->qdd);
    kmp_reduction_multipliers(&d->red, d->qdd, d->lambda);
}

/* Power of moving closures, after any accelerations. */
static double reduced_drive_power(kmp_reduced *d)
{
    if (!d->s->rheonomic)
        return 0;
    find_multipliers(d);
    return kmp_eval_drive_power(d->eval, d->lambda);
}

/* -- newton form by the program ----------------------------------------------------------------------- */

/* An evaluation of the newton form by the program: corrections of the predicted v until the rest of
 * the program, which is evaluated at the corrected v, finds it closed. The correction that is left there tests that. */

/* The largest component of a correction of v, in scales and in error weights; infinite if an entry is not finite. */
typedef struct extent {
    double scaled, weighted;
} extent;

static extent measure(const kmp_reduced *d, const double *dv)
{
    extent e = {0};
    double sum = 0;
    for (int i = 0; i < d->r; i++) {
        double change = fabs(dv[i]), scaled = change * d->by_scale[i], part = change * d->by_weight[i];
        sum += change;
        e.scaled = scaled > e.scaled ? scaled : e.scaled;
        e.weighted = part > e.weighted ? part : e.weighted;
    }
    return sum <= DBL_MAX ? e : (extent){INFINITY, INFINITY};
}

static bool is_small(const kmp_reduced *d, extent e)
{
    return e.weighted <= KMP_CORRECTION_IN_STAGE || e.scaled <= d->anchor.noise;
}

static void add(kmp_reduced *d, const double *dv)
{
    for (int i = 0; i < d->r; i++)
        d->v[i] += dv[i];
}

/* Closes d->v and evaluates there. false: corrections do not contract, or pivots are bad. */
static bool close_and_finish(kmp_reduced *d, double t, double *dy)
{
    kmp_reduced_program *program = d->programs.scalar;
    double last = INFINITY, *v = d->state + 2 * d->p;
    for (int k = 0; k < KMP_CLOSING_PASSES; k++) {
        memcpy(v, d->v, (size_t)d->r * sizeof *v);
        kmp_writer_correction c = kmp_reduced_program_close(program, t, d->state);
        extent e = measure(d, c.dv), next = {d->contraction * e.scaled * e.scaled, INFINITY};
        d->red.newton++;
        if (!is_small(d, e) && !kmp_closing_contracts(e.scaled, last))
            return false;
        add(d, c.dv);
        last = e.scaled;
        /* The next correction is about the square of this one, times a factor that the last corrections had: the rest
         * of the program follows once that is small. */
        next.weighted = e.scaled > 0 ? next.scaled * e.weighted / e.scaled : 0;
        if (c.turn > KMP_TURN_SMALL || !is_small(d, next))
            continue;
        bool regular = kmp_reduced_program_finish(program, t, d->state, dy);
        extent left = measure(d, kmp_reduced_program_left(program));
        if (left.scaled > d->anchor.noise)
            d->contraction = left.scaled / (e.scaled * e.scaled);
        if (!is_small(d, left) && !kmp_closing_contracts(left.scaled, last))
            return false;
        add(d, kmp_reduced_program_left(program));
        last = left.scaled;
        if (is_small(d, left))
            return regular;
    }
    return false;
}

/* Evaluates the newton form by the program: d->v is then closed, and dy its derivative. false: the program fails here.
 */
static bool reduced_evaluate_closing(kmp_reduced *d, double t, const double *y, double *dy)
{
    size_t p = (size_t)d->p, r = (size_t)d->r;
    double *slope = d->has_v ? dy : d->slope;
    if (d->has_v)
        memcpy(d->v, y + 2 * p, r * sizeof *y);
    else
        reduced_predict(d, t, y);
    memcpy(d->state, y, 2 * p * sizeof *y);
    bool closed = close_and_finish(d, t, slope);
    if (!d->has_v)
        memcpy(dy, slope, 2 * p * sizeof *dy);
    d->use.closed_by_program = closed && !kmp_reduced_has_saddle_program(d);
    return closed;
}

/* -- right-hand side ---------------------------------------------------------------------------------- */

/* True if the program of the present choice may be used now. */
static inline bool applies(const kmp_reduced *d)
{
    return d->programs.scalar && !d->use.apart && !(d->use.cancelled && kmp_reduced_has_saddle_program(d)) &&
           kmp_reduced_program_applies(d->programs.scalar);
}

int kmp_reduced_rhs(void *self, double t, const double *y, double *dy)
{
    kmp_reduced *d = self;
    bool runs = applies(d), made = false;
    if (runs)
        made = d->integrated ? kmp_reduced_program_run(d->programs.scalar, t, y, dy)
                             : reduced_evaluate_closing(d, t, y, dy);
    d->use.by_saddle_program = made && kmp_reduced_has_saddle_program(d);
    if (!made && runs && d->integrated && !kmp_reduced_has_saddle_program(d) && d->s->load_row_count == 0)
        return KMP_RETRY;
    if (!made) { /* a program gives only dy */
        d->formulation.by_parts++;
        if (reduced_evaluate(d, t, y) != KMP_GO)
            return KMP_RETRY;
        for (int k = 0; k < d->p; k++) {
            dy[k] = y[d->p + k];
            dy[d->p + k] = d->udd[k];
        }
        for (int i = 0; d->has_v && i < d->r; i++)
            dy[2 * d->p + i] = d->qd[d->part.v[i]];
    }
    for (int k = 0; k < d->p; k++)
        if (!isfinite(dy[d->p + k]))
            return KMP_RETRY;
    if (d->has_work)
        dy[reduced_work(d)] = made ? kmp_reduced_program_power(d->programs.scalar)
                                   : kmp_eval_power_here(d->eval, d->qd) + reduced_drive_power(d);
    return KMP_GO;
}

/* The slopes of several stages. NULL: multipliers that forces depend on do not settle in all of them. */
static const double *run_stages(kmp_reduced *d, const double *t, const double *y)
{
    kmp_lanes *lanes = d->programs.stages.lanes;
    kmp_load_passes *x = &d->programs.loads;
    kmp_stage_lanes_place(&d->programs.stages, t, y, NULL);
    if (x->nu) {
        kmp_load_begin(x, d->eval->nu);
        if (!kmp_load_settle_lanes(x, lanes))
            return NULL;
    }
    return kmp_lanes_run(lanes, kmp_reduced_program_layout_of(d->programs.scalar)->stage);
}

/* Callback of an integrator that evaluates several stages at once. The program gives the slopes of u's rates and of v,
 * pivots, and the power. */
static int rhs_of_stages(void *self, const double *t, const double *y, double *dy)
{
    kmp_reduced *d = self;
    if (!d->programs.stages.lanes || !applies(d))
        return KMP_APART;
    const kmp_saddle_program_layout *l = kmp_reduced_program_layout_of(d->programs.scalar);
    size_t w = KMP_STAGE_LANES, p = (size_t)d->p, r = (size_t)d->r;
    bool by_saddle = kmp_reduced_has_saddle_program(d);
    const double *out = run_stages(d, t, y);
    if (!out)
        return KMP_APART;
    memcpy(dy + p * w, out, p * w * sizeof *dy);
    memcpy(dy + 2 * p * w, out + (size_t)l->rates * w, r * w * sizeof *dy);
    if (d->has_work)
        memcpy(dy + (size_t)reduced_work(d) * w, out + (size_t)l->power * w, w * sizeof *dy);
    if (!kmp_stage_lanes_exceed(l->pivots, out + (size_t)l->pivot * w, KMP_SADDLE_PROGRAM_PIVOT,
                                by_saddle ? out + (size_t)l->diagonal * w : NULL))
        return by_saddle ? KMP_APART : KMP_RETRY;
    return kmp_stage_lanes_finite(d->p + d->r, dy + p * w) ? KMP_GO : KMP_RETRY;
}

/* True if stability limits explicit steps so much that stages of radau one by one take less time: they take some four
 * times as many evaluations as a step of dop853. Only at the start, before a choice. */
static bool is_stiff_at_start(const kmp_reduced *d)
{
    const kmp_formulation_start *s = &d->start;
    const double wide = 6, times = 4; /* of the region of stability; of the steps */
    if (d->use.steps > 0 || !(s->atol > 0))
        return false;
    const double rate = kmp_fastest_rate(&d->formulation.ode, s->t, d->formulation.y, d->formulation.atol,
                                         KMP_FASTEST_DIFFERENCE / s->atol);
    return rate * s->length / (s->rate_scale * wide) > times * kmp_steps_expected(s->rtol, s->length);
}

/* Stages are evaluated one by one where no program is good, as with a link without inertia, and none is due later: that
 * is worth while where the motion is stiff. */
static int make_lanes(void *self, double t)
{
    kmp_reduced *d = self;
    kmp_ode *ode = &d->formulation.ode;
    if (kmp_reduced_make_lanes(d, t) != KMP_GO)
        return KMP_HALT;
    d->formulation.lacks_lanes = false;
    const bool may = d->programs.stages.lanes || d->use.made_late || d->use.due_saddle_program < LONG_MAX;
    ode->lanes = may || is_stiff_at_start(d) ? rhs_of_stages : NULL;
    ode->width = ode->lanes ? KMP_STAGE_LANES : 0;
    ode->cycles_of_lanes = ode->lanes ? ode->cycles_of_lanes : 0;
    return KMP_GO;
}

static int jacobian(void *self, double t, const double *y, double *j)
{
    kmp_reduced *d = self;
    if (reduced_evaluate(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_reduced_jacobian_eval(&d->tangents, t, d->q, d->qd, d->udd, d->formulation.size, j);
    return KMP_GO;
}

/* -- end of a step ------------------------------------------------------------------------------------- */

/* True if the program that the last step did without may make the next ones. */
static bool is_good_again(kmp_reduced *d, double t, const double *y)
{
    if (!d->programs.scalar || (kmp_reduced_has_saddle_program(d) && !d->use.apart))
        return d->programs.scalar;
    if (!d->integrated) {
        memcpy(d->state, y, (size_t)(2 * d->p) * sizeof *y);
        for (int i = 0; i < d->r; i++)
            d->state[2 * d->p + i] = d->q[d->part.v[i]];
    }
    return kmp_reduced_program_is_good(d->programs.scalar, t, d->integrated ? y : d->state);
}

/* h, J, Bvu and the correction of v at the step's end, the last evaluation. `end`: values of the reduced program, if
 * that made the evaluation. */
static int reduced_come_to_end(kmp_reduced *d, double t, const double *y, kmp_reduced_program_end *end)
{
    bool by_saddle = kmp_reduced_has_saddle_program(d), good = false;
    if (by_saddle || !applies(d) ||
        (!d->integrated && !d->use.closed_by_program)) { /* h and the factors are available */
        if (d->use.by_saddle_program) {
            place_q(d, y, d->integrated ? y + 2 * d->p : d->v);
            good = kmp_reduced_program_lend(d->programs.scalar, t, d->q, d->start.rtol, d->start.rate_scale,
                                            &d->use.cancelled);
            if (kmp_reduction_factor(&d->red))
                return KMP_RETRY;
        }
        if (d->by_saddle || d->use.by_saddle_program)
            kmp_reduction_tangent(&d->red);
        if (d->integrated)
            kmp_reduction_correction(&d->red);
        if (d->r > 0)
            kmp_block_take_signs(d->red.block, d->signs_now);
        *end = (kmp_reduced_program_end){.good = d->use.by_saddle_program ? good : is_good_again(d, t, y),
                                         .signs = d->signs_now};
        return KMP_GO;
    }
    *end = kmp_reduced_program_at_end(d->programs.scalar);
    place_q(d, y, d->integrated ? y + 2 * d->p : d->v);
    kmp_eval_use_closure(d->eval, t, d->q, end->h, end->jacobian, end->h_t);
    if (d->r > 0) {
        memcpy(d->red.bvu, end->bvu, (size_t)(d->r * d->p) * sizeof *end->bvu);
        memcpy(d->red.dv, end->dv, (size_t)d->r * sizeof *end->dv);
        for (int i = 0; end->x_t && i < d->r; i++) {
            d->red.x_t[d->part.v[i]] = end->x_t[i];
            d->red.a0[d->part.v[i]] = end->a0[i];
        }
        d->red.factorizations++;
    }
    return end->regular ? KMP_GO : KMP_RETRY;
}

/* Corrects v to the closures, if h exceeds rounding; without degrees of freedom v keeps the values of the start. */
static int correct(kmp_reduced *d, double *v, const double *w)
{
    bool still = d->p == 0 && !d->s->rheonomic;
    if (!d->integrated || d->r == 0 || still || kmp_eval_residual(d->eval) < KMP_CLOSED)
        return KMP_GO;
    double worst = 0;
    for (int i = 0; i < d->r; i++)
        worst = fmax(worst, kmp_correction_size(d->red.dv[i], w[i], d->s->scale[d->part.v[i]]));
    if (!kmp_correction_is_small(worst, d->part.m > d->r, d->t, &d->corrected))
        return KMP_RETRY;
    for (int i = 0; i < d->r; i++)
        d->q[d->part.v[i]] = v[i] += d->red.dv[i];
    return KMP_GO;
}

/* Decides if the step may end at y, evaluated by reduced_come_to_end, and then records the end. */
static int reduced_may_end(kmp_reduced *d, double t, const double *y, const kmp_reduced_program_end *end)
{
    int said = reduced_watch(d, t, end->signs);
    if (said == KMP_GO)
        said = kmp_redundant_check(d->eval, &d->part, t, d->start.atol + d->start.rtol, &d->formulation.reason);
    if (said == KMP_GO && kmp_rank_margin_refuses(d->start.margin, d->eval, t))
        said = KMP_RETRY;
    if (said != KMP_GO)
        return said;
    reduced_remember(d, t, y);
    d->formulation.newton = d->red.newton;
    d->formulation.factorizations = d->red.factorizations + d->saddle.factorizations;
    d->use.steps++;
    d->use.apart = d->programs.scalar && !end->good;
    return KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    kmp_reduced *d = self;
    kmp_reduced_program_end end;
    (void)dy;
    int said = reduced_come_to_end(d, t, y, &end);
    if (said == KMP_GO)
        said = correct(d, y + 2 * d->p, w + 2 * d->p);
    if (said == KMP_GO)
        said = reduced_may_end(d, t, y, &end);
    for (int i = 0; said == KMP_GO && d->has_v && !d->integrated && i < d->r; i++)
        y[2 * d->p + i] = d->q[d->part.v[i]];
    d->formulation.rows_by = !d->integrated || !applies(d)       ? KMP_ROWS_BY_PARTS
                             : kmp_reduced_has_saddle_program(d) ? KMP_ROWS_BY_SADDLE_PROGRAM
                                                                 : KMP_ROWS_BY_PROGRAM;
    return said;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void position(kmp_formulation *formulation, double t, const double *y, double *q)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    if (d->has_v)
        put_q(d, t, y);
    else
        (void)reduced_place(d, t, y);
    memcpy(q, d->q, (size_t)d->n * sizeof *q);
}

/* Row at d->q, which is closed. */
static int row_of_rates(kmp_reduced *d, double t, const double *y, double *qd, double *qdd, double *lambda)
{
    kmp_eval_closure(d->eval, t, d->q);
    if (kmp_reduction_factor(&d->red))
        return KMP_HALT;
    kmp_reduction_tangent(&d->red);
    close_rates(d, y + d->p);
    memcpy(qd, d->qd, (size_t)d->n * sizeof *qd);
    if (!qdd)
        return KMP_GO;
    if (accelerate_closed(d) != KMP_GO)
        return KMP_HALT;
    find_multipliers(d);
    memcpy(qdd, d->qdd, (size_t)d->n * sizeof *qdd);
    memcpy(lambda, d->lambda, (size_t)d->part.m * sizeof *lambda);
    return KMP_GO;
}

/* Reports the row that stays open, and its gap. */
static void explain_open(kmp_reduced *d, double t)
{
    const kmp_partition *part = &d->part;
    int worst = 0;
    double most = -1;
    for (int r = 0; r < part->m; r++) {
        double open = kmp_eval_opening(d->eval, r);
        if (!(open <= most)) {
            most = open;
            worst = r;
        }
    }
    kmp_text_printf(&d->formulation.reason,
                    "the loops cannot be closed at the output time t = %.9g s: constraint equation '%s' stays open by "
                    "%.2g (relative)",
                    t, part->m > 0 ? d->s->row_names[worst] : "", most);
    for (int k = 0; k < part->m - part->r; k++)
        if (part->redundant[k] == worst)
            kmp_text_put(&d->formulation.reason,
                         ". It is redundant only up to rounding: give the model's numbers more digits, or remove it");
}

/* The row by the program of the present choice: an evaluation for each correction, and what is left out in others. It
 * takes a third to a half of the time of a row by parts. false: there is none, or it fails here. */
static bool row_by_program(kmp_reduced *d, double t, double *qd, double *qdd, double *lambda)
{
    if (!d->integrated || d->formulation.rows_by == KMP_ROWS_BY_PARTS || !applies(d))
        return false;
    kmp_reduced_program_row row = {.program = d->programs.scalar, .y = d->state, .dy = d->slope, .dx = d->red.dv};
    bool closed = kmp_reduced_program_close_row(&row, t, d->q);
    d->red.newton += row.corrections;
    if (closed && qd)
        kmp_reduced_program_rates(&row, qd);
    if (closed && qdd)
        kmp_reduced_program_complete_row(&row, qdd, lambda);
    return closed;
}

static int row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    *work = d->has_work ? y[reduced_work(d)] : 0;
    put_q(d, t, y);
    if (d->integrated)
        memcpy(d->state, y, (size_t)(2 * d->p + d->r) * sizeof *y);
    if (row_by_program(d, t, qd, qdd, lambda)) {
        memcpy(q, d->q, (size_t)d->n * sizeof *q);
        return KMP_GO;
    }
    put_q(d, t, y);
    if (kmp_reduction_close(&d->red, t, d->q, NULL, 0)) {
        explain_open(d, t);
        return KMP_HALT;
    }
    memcpy(q, d->q, (size_t)d->n * sizeof *q);
    return qd ? row_of_rates(d, t, y, qd, qdd, lambda) : KMP_GO;
}

/* -- new starts --------------------------------------------------------------------------------------- */

/* y' of a new start, if wanted. */
static int put_slope(kmp_reduced *d, double t, const double *y, double *yp)
{
    return yp ? kmp_reduced_rhs(d, t, y, yp) : KMP_GO;
}

static int renew(kmp_formulation *formulation, double t, double *y, double *yp)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    if (!d->formulation.due)
        return kmp_reduced_solve(d, t);
    int said = reduced_place(d, t, y) == KMP_GO ? reduced_exchange(d, t, y) : KMP_HALT;
    return said == KMP_GO && put_slope(d, t, y, yp) == KMP_GO ? KMP_CHANGED : KMP_HALT;
}

static int resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    const bool elsewhere = formulation->rested;
    memcpy(d->q, q, (size_t)d->n * sizeof *q);
    memcpy(d->qd, qd, (size_t)d->n * sizeof *qd);
    kmp_reduced_pack(&d->part, d->has_v, q, qd, y);
    if (reduced_linearise_at(d, t, y) != KMP_GO)
        return KMP_HALT;
    if (elsewhere) { /* what the last steps have shown was elsewhere */
        formulation->rested = false;
        d->use.apart = d->use.cancelled = d->use.by_saddle_program = false;
        d->corrected = (kmp_last_correction){.t = NAN};
    }
    reduced_judge(d);
    if (d->formulation.due && reduced_exchange(d, t, y) != KMP_GO)
        return KMP_HALT;
    if (d->programs.scalar &&
        (kmp_reduced_program_is_stale(d->programs.scalar) ||
         (elsewhere && !kmp_reduced_program_fits(d->programs.scalar))) &&
        kmp_reduced_make_program(d, true) != KMP_GO)
        return KMP_HALT;
    return put_slope(d, t, y, yp);
}

static int stand(kmp_formulation *formulation, double t, const double *y, const double *q)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    memcpy(d->q, q, (size_t)d->n * sizeof *q);
    int said = reduced_linearise_at(d, t, y);
    if (said == KMP_GO)
        said = d->by_saddle ? reduced_evaluate(d, t, y) : reduced_place(d, t, y);
    memcpy(d->q, q, (size_t)d->n * sizeof *q);
    reduced_remember_place(d, t, y);
    return said == KMP_GO ? KMP_GO : KMP_HALT;
}

/* -- as a DAE ----------------------------------------------------------------------------------------- */

/* The reduced equations of motion in implicit form, for an integrator of F(t, y, y') = 0: no reduced mass is factored,
 * and a residual needs none. With y = (u, ud[, work]):
 *
 *     u' - ud = 0      X' (M qdd + C) = 0, qdd = X ud' + a0      work' - power = 0 */

/* Evaluates the state of a residual: q, qd, M and C. */
static int prepare_residual(kmp_reduced *d, double t, const double *y)
{
    if (reduced_place(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_eval_mass(d->eval);
    kmp_eval_bias(d->eval, d->qd);
    return KMP_GO;
}

static int residual(void *self, double t, const double *y, const double *yp, double *r)
{
    kmp_reduced *d = self;
    if (prepare_residual(d, t, y) != KMP_GO)
        return KMP_RETRY;
    memcpy(d->udd, yp + d->p, (size_t)d->p * sizeof *d->udd);
    kmp_reduction_residual(&d->red, d->udd, r + d->p);
    for (int k = 0; k < d->p; k++) {
        r[k] = yp[k] - y[d->p + k];
        if (!isfinite(r[d->p + k]))
            return KMP_RETRY;
    }
    if (d->has_work)
        r[reduced_work(d)] = yp[reduced_work(d)] - kmp_eval_power_here(d->eval, d->qd) - reduced_drive_power(d);
    return KMP_GO;
}

static int matrix(void *self, double t, double cj, const double *y, const double *yp, double *values)
{
    kmp_reduced *d = self;
    if (prepare_residual(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_reduction_residual(&d->red, yp + d->p, d->udd); /* for a0 */
    const kmp_dae *dae = &d->formulation.dae;
    memset(d->jacobian, 0, (size_t)(dae->n * dae->n) * sizeof *d->jacobian);
    kmp_reduced_jacobian_of_residual(&d->tangents, t, cj, d->q, d->qd, yp + d->p, dae->n, d->jacobian);
    for (int c = 0; c < dae->n; c++)
        for (int64_t k = dae->col_start[c]; k < dae->col_start[c + 1]; k++)
            values[k] = d->jacobian[dae->row[k] + (long)c * dae->n];
    return KMP_GO;
}

/* Evaluates the step's end, which the integrator has not done; corrects nothing. */
static int accept_dae(void *self, double t, const double *y, const double *yp)
{
    kmp_reduced *d = self;
    kmp_reduced_program_end end;
    (void)yp;
    if (reduced_evaluate(d, t, y) != KMP_GO || reduced_come_to_end(d, t, y, &end) != KMP_GO)
        return KMP_RETRY;
    return reduced_may_end(d, t, y, &end);
}

/* Pattern of column k: u'[k] or -ud[k], then the rows of the motion and of the work, which are full. */
static int fill_pattern(const kmp_reduced *d, int64_t *col_start, int64_t *row)
{
    int nz = 0, size = d->formulation.size;
    for (int c = 0; c < size; c++) {
        col_start[c] = nz;
        if (c < 2 * d->p)
            row[nz++] = c % d->p;
        for (int i = c < 2 * d->p ? d->p : c; i < size; i++)
            row[nz++] = i;
    }
    col_start[size] = nz;
    return nz;
}

/* Makes the formulation a DAE, starting at t. */
static kempe_status reduced_describe(kmp_reduced *d, double t)
{
    kmp_arena *a = &d->formulation.arena;
    int size = d->formulation.size;
    int64_t *col_start = KMP_ARENA_NEW(a, int64_t, size + 1), *row = KMP_ARENA_NEW(a, int64_t, size * (size + 1));
    double *ones = KMP_ARENA_NEW(a, double, size);
    d->jacobian = KMP_ARENA_NEW(a, double, size *size);
    d->formulation.yp = KMP_ARENA_NEW(a, double, size);
    KMP_TRY(kmp_made(d->s->context, !a->failed));
    for (int i = 0; i < size; i++)
        ones[i] = 1;
    d->formulation.dae = (kmp_dae){.n = size,
                                   .nz = fill_pattern(d, col_start, row),
                                   .col_start = col_start,
                                   .row = row,
                                   .differential = ones,
                                   .factor = ones,
                                   .self = d,
                                   .residual = residual,
                                   .matrix = matrix,
                                   .accept = accept_dae};
    if (kmp_reduced_rhs(d, t, d->formulation.y, d->formulation.yp) == KMP_GO)
        return KEMPE_OK;
    return kmp_fail(d->s->context, KEMPE_E_FAILED, "the accelerations cannot be evaluated at t = %.9g s", t);
}

/* -- making one -------------------------------------------------------------------------------------- */

static void release(kmp_formulation *formulation)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    kmp_reduced_free_programs(d);
    kmp_reduced_jacobian_free(&d->tangents);
    kmp_reduction_free(&d->red);
    kmp_saddle_free(&d->saddle);
    kmp_partition_free(&d->part);
    kmp_formulation_free(formulation);
}

static kempe_status prepare(kmp_reduced *d, const kmp_formulation_start *start)
{
    bool implicit = start->implicit || start->dae;
    KMP_TRY(kmp_reduction_init(&d->red, start->eval, &d->part));
    d->by_saddle = d->eval->by_bodies;
    if (!reduced_renew_saddle(d) || (!implicit && !reduced_try_saddle(d)))
        return kmp_fail_memory(d->s->context);
    memcpy(d->q, start->q, (size_t)d->n * sizeof *d->q);
    kmp_reduced_pack(&d->part, d->has_v, start->q, start->qd, d->formulation.y);
    if (d->has_work)
        d->formulation.y[reduced_work(d)] = start->work;
    if (reduced_linearise_at(d, start->t, d->formulation.y) != KMP_GO)
        return kmp_fail(d->s->context, KEMPE_E_FAILED,
                        "the Jacobian of the dependent coordinates is singular at t = %.9g s", start->t);
    reduced_set_tolerances(d);
    bool made = kmp_reduced_make_program(d, !start->brief) == KMP_GO;
    if (made && start->early)
        made = kmp_reduced_solve(d, start->t) == KMP_GO;
    if (!made || kmp_reduced_count(d) != KMP_GO)
        return KEMPE_E_FAILED;
    const kmp_ode *ode = &d->formulation.ode;
    bool lanes =
        start->lanes || (start->may_change && kmp_cycles_ratio(ode, start->rtol, start->length) < KMP_RATIO_WORTH);
    if (lanes && d->integrated && make_lanes(d, start->t) != KMP_GO)
        return KEMPE_E_FAILED;
    if (!implicit || d->integrated)
        return KEMPE_OK;
    d->formulation.ode.jacobian = jacobian;
    KMP_TRY(kmp_reduced_jacobian_init(&d->tangents, &d->red));
    return start->dae ? reduced_describe(d, start->t) : KEMPE_OK;
}

/* Without v among the unknowns the closures determine v, and rows between rates cannot. */
static bool can_follow(const kmp_reduced *d)
{
    const char *row = kmp_formulation_row_of_rates(d->s);
    if (d->has_v || !row)
        return true;
    (void)kmp_fail(d->s->context, KEMPE_E_INPUT,
                   "form newton with this integrator finds the dependent coordinates from position constraints, and "
                   "'%s' is a nonholonomic constraint; use form integrated, or integrator dop853",
                   row);
    return false;
}

static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    const kmp_partition *part = start->part;
    kmp_reduced *d = kmp_formulation_new(start, sizeof *d);
    if (!d)
        return NULL;
    d->start = *start;
    d->start.lanes = false;
    d->s = start->system;
    d->eval = start->eval;
    d->integrated = kind->corrected || part->p == 0; /* without other unknowns, v controls the step size */
    d->has_v = d->integrated || !(start->restarts || start->implicit || start->dae);
    d->has_work = start->system->dissipative;
    d->n = part->n;
    d->p = part->p;
    d->r = part->r;
    d->corrected.t = NAN;
    d->formulation.release = release;
    d->formulation.row = row;
    d->formulation.position = position;
    d->formulation.renew = renew;
    d->formulation.resume = resume;
    d->formulation.explain = reduced_explain;
    d->formulation.stand = d->has_v ? NULL : stand;
    d->formulation.curves = d->has_v ? 0 : d->r;
    d->formulation.rests = !start->dae;
    d->formulation.part = &d->part;
    kmp_formulation_make_unknowns(&d->formulation, reduced_work(d) + d->has_work, false);
    bool made =
        kmp_partition_copy(&d->part, part) &&
        KMP_ARENA_MAKE(
            &d->formulation.arena, KMP_ROOM(int, d->r, &d->signs, &d->signs_now),
            KMP_ROOM(double, d->n, &d->q, &d->qd, &d->qdd, &d->weight), KMP_ROOM(double, part->m, &d->lambda),
            KMP_ROOM(double, d->p, &d->udd, &d->anchor.u, &d->anchor.w), KMP_ROOM(double, d->r * d->p, &d->anchor.b),
            KMP_ROOM(double, 2 * d->p + d->r, &d->state, &d->slope),
            KMP_ROOM(double, d->r, &d->anchor.v, &d->anchor.t, &d->anchor.c, &d->v, &d->by_scale, &d->by_weight));
    d->formulation.curve = d->anchor.c;
    if (!made) {
        (void)kmp_fail_memory(start->system->context);
    } else if (can_follow(d)) {
        d->formulation.ode = (kmp_ode){.n = d->formulation.size,
                                       .self = d,
                                       .rhs = kmp_reduced_rhs,
                                       .accept = accept,
                                       .make_lanes = d->integrated ? make_lanes : NULL,
                                       .positions = d->p,
                                       .quadratures = d->has_work};
        if (prepare(d, start) == KEMPE_OK)
            return &d->formulation;
    }
    release(&d->formulation);
    return NULL;
}

const kmp_formulation_kind kmp_formulation_integrated = {.formulation = "reduced",
                                                         .form = "integrated",
                                                         .standard = true,
                                                         .corrected = true,
                                                         .by_bodies = true,
                                                         .by_products = true,
                                                         .in_lanes = true,
                                                         .create = create};
const kmp_formulation_kind kmp_formulation_newton = {.formulation = "reduced",
                                                     .form = "newton",
                                                     .standard = true,
                                                     .both = true,
                                                     .jacobian = true,
                                                     .by_bodies = true,
                                                     .by_products = true,
                                                     .create = create};
