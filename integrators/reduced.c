/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced road: an ODE in the independent coordinates (Fisette and Samin 1996, eqs. 43-46), in two forms on one
 * state y = (u, ud[, v][, work]).
 *
 * carried   v is integrated along by vd = Bvu ud + x_t; stages never iterate. At each accepted step one simplified
 * Newton correction with the factors at hand takes v back to the closure; a correction beyond one error weight refuses
 * the step. closed    every evaluation closes v on u by Newton, predicted along the tangent from the last accepted step
 * and from nowhere else; an evaluation whose corrections stop contracting fails and shortens the step.
 *
 * A choice of u ends at a dead centre: |Bvu| grows without bound and det Jv changes sign. Both are watched at every
 * accepted step, because the ODE itself may pass such a point and go on wrongly without any other sign. */
#include "base/memory.h"
#include "constraints/fused.h"
#include "constraints/tolerances.h"
#include "integrators/reduced_residual.h"
#include "integrators/redundant.h"
#include "integrators/road.h"
#include <math.h>
#include <string.h>

/* With fewer freedoms the reduced mass is the best there is. */
#define MANY_FREEDOMS 12
/* What an operation of a reduced mass with zeros costs, by one without. */
#define BY_LISTS 2

typedef struct reduced {
    kmp_road road; /* first */
    const kempe_system *s;
    kmp_plant *plant;
    kmp_margin *margin;
    kmp_partition part; /* its own: exchanges change it */
    kmp_reduction red;
    kmp_fused *fused;  /* carried; NULL: there is none */
    bool apart;        /* its order of elimination is bad where the last step ended */
    long steps;        /* since the last exchange */
    bool by_saddle;    /* accelerations and multipliers come from there: by articulated bodies, or with many freedoms */
    kmp_saddle saddle; /* v's rates are the reduction's all the same */
    kmp_reduced_jacobian tangents; /* when asked for */
    kmp_reduced_residual residual; /* likewise */
    bool carried, has_work, fixed, restarts;
    bool due; /* an exchange, before the next step */
    kmp_journal *journal;
    int n, p, r;
    double *q, *qd;       /* n */
    double *weight;       /* n: error weights of coordinates at the last accepted step */
    double *anchor_u;     /* p, of the last accepted step */
    double *anchor_v;     /* r */
    double *anchor_b;     /* r x p: tangent there */
    double *anchor_t;     /* r: what moving closures add to vd there */
    double *anchor_c;     /* r: vdd there less what udd makes */
    double *udd;          /* p */
    double *qdd, *lambda; /* n, m: where closures move */
    int *signs;           /* r: of the determinants of Jv's blocks, at the start, the last exchange or step */
    int *signs_now;       /* r */
    double rtol, atol, rate_scale;
    double t;      /* of the last accepted step */
    bool crossed;  /* det Jv had changed its sign at the end of the last step tried */
    double growth; /* |Bvu| there, scaled, and where */
    int growth_v, growth_u;
} reduced;

static void pack(reduced *d, const double *q, const double *qd, double *y)
{
    for (int k = 0; k < d->p; k++) {
        y[k] = q[d->part.u[k]];
        y[d->p + k] = qd[d->part.u[k]];
    }
    for (int i = 0; d->carried && i < d->r; i++)
        y[2 * d->p + i] = q[d->part.v[i]];
}

static int work_index(const reduced *d)
{
    return 2 * d->p + (d->carried ? d->r : 0);
}

static void put_u(reduced *d, const double *y)
{
    for (int k = 0; k < d->p; k++)
        d->q[d->part.u[k]] = y[k];
}

/* Of the carried form. */
static void put_state(reduced *d, const double *y)
{
    put_u(d, y);
    for (int i = 0; i < d->r; i++)
        d->q[d->part.v[i]] = y[2 * d->p + i];
}

/* Along the tangent from the last accepted step and its curvature: dv = B du + x_t tau + c tau^2 / 2. */
static void predict_v(reduced *d, double t, const double *y)
{
    double tau = t - d->t;
    for (int i = 0; i < d->r; i++) {
        double v = d->anchor_v[i] + tau * (d->anchor_t[i] + 0.5 * tau * d->anchor_c[i]);
        for (int k = 0; k < d->p; k++)
            v += d->anchor_b[i + k * d->r] * (y[k] - d->anchor_u[k]);
        d->q[d->part.v[i]] = v;
    }
}

/* q and factors of Jv at (t, y), and the tangent, which accelerations by articulated bodies do not need. */
static int place(reduced *d, double t, const double *y)
{
    if (d->carried) {
        put_state(d, y);
        kmp_plant_closure(d->plant, t, d->q);
        if (kmp_reduction_factor(&d->red))
            return KMP_RETRY;
    } else {
        put_u(d, y);
        predict_v(d, t, y);
        if (kmp_reduction_close(&d->red, t, d->q, d->weight, KMP_CORRECTION_IN_STAGE))
            return KMP_RETRY;
    }
    if (!d->by_saddle)
        kmp_reduction_tangent(&d->red);
    return KMP_GO;
}

/* qd at the placed state. */
static void close_rates(reduced *d, const double *ud)
{
    if (d->by_saddle)
        kmp_reduction_rates_alone(&d->red, ud, d->qd);
    else
        kmp_reduction_rates(&d->red, ud, d->qd);
}

/* qdd, lambda and udd without a reduced mass. */
static int accelerate_at_once(reduced *d)
{
    if (kmp_saddle_factor(&d->saddle))
        return KMP_RETRY;
    kmp_saddle_accelerations(&d->saddle, d->qdd, d->lambda);
    for (int k = 0; k < d->p; k++)
        d->udd[k] = d->qdd[d->part.u[k]];
    return KMP_GO;
}

/* udd at the placed state and its qd. */
static int accelerate_closed(reduced *d)
{
    kmp_plant_mass(d->plant);
    kmp_plant_bias(d->plant, d->qd);
    if (d->by_saddle)
        return accelerate_at_once(d);
    return kmp_reduction_accelerate(&d->red, d->udd) ? KMP_RETRY : KMP_GO;
}

static int accelerate(reduced *d, const double *ud)
{
    close_rates(d, ud);
    return accelerate_closed(d);
}

/* qdd and lambda after that. */
static void complete(reduced *d)
{
    if (d->by_saddle)
        return;
    kmp_reduction_accelerations(&d->red, d->udd, d->qdd);
    kmp_reduction_multipliers(&d->red, d->qdd, d->lambda);
}

static double drive_power(reduced *d)
{
    if (!d->s->rheonomic)
        return 0;
    complete(d);
    return kmp_plant_drive_power(d->plant, d->lambda);
}

static bool is_fused(const reduced *d)
{
    return d->fused && !d->apart && !d->by_saddle && kmp_fused_applies(d->fused);
}

/* q, qd and udd at (t, y), and what they are in dy. The one program makes the latter alone. */
static int evaluate_apart(reduced *d, double t, const double *y, double *dy)
{
    if (place(d, t, y) != KMP_GO || accelerate(d, y + d->p) != KMP_GO)
        return KMP_RETRY;
    for (int k = 0; k < d->p; k++) {
        dy[k] = y[d->p + k];
        dy[d->p + k] = d->udd[k];
    }
    for (int i = 0; d->carried && i < d->r; i++)
        dy[2 * d->p + i] = d->qd[d->part.v[i]];
    return KMP_GO;
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    reduced *d = self;
    bool fused = is_fused(d);
    int said = fused ? (kmp_fused_run(d->fused, t, y, dy) ? KMP_GO : KMP_RETRY) : evaluate_apart(d, t, y, dy);
    for (int k = 0; said == KMP_GO && k < d->p; k++)
        if (!isfinite(dy[d->p + k]))
            return KMP_RETRY;
    if (said == KMP_GO && d->has_work)
        dy[work_index(d)] = fused ? kmp_fused_power(d->fused) : kmp_plant_power_here(d->plant, d->qd) + drive_power(d);
    return said;
}

static int jacobian(void *self, double t, const double *y, double *j)
{
    reduced *d = self;
    if (place(d, t, y) != KMP_GO || accelerate(d, y + d->p) != KMP_GO)
        return KMP_RETRY;
    kmp_reduced_jacobian_eval(&d->tangents, t, d->q, d->qd, d->udd, d->road.size, j);
    return KMP_GO;
}

/* The state of a residual: q, qd, M and C. */
static int prepare_residual(reduced *d, double t, const double *y)
{
    if (place(d, t, y) != KMP_GO)
        return KMP_RETRY;
    close_rates(d, y + d->p);
    kmp_plant_mass(d->plant);
    kmp_plant_bias(d->plant, d->qd);
    return KMP_GO;
}

static int residual(void *self, double t, const double *y, const double *yp, double *r)
{
    reduced *d = self;
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
        r[work_index(d)] = yp[work_index(d)] - kmp_plant_power_here(d->plant, d->qd) - drive_power(d);
    return KMP_GO;
}

static int matrix(void *self, double t, double cj, const double *y, const double *yp, double *values)
{
    reduced *d = self;
    if (prepare_residual(d, t, y) != KMP_GO)
        return KMP_RETRY;
    kmp_reduction_residual(&d->red, yp + d->p, d->udd); /* for a0 */
    kmp_reduced_residual_matrix(&d->residual, &d->tangents, t, cj, d->q, d->qd, yp + d->p, values);
    return KMP_GO;
}

/* -- watching ---------------------------------------------------------------------------------------- */

static bool is_among(const int *list, int count, int k)
{
    for (int i = 0; i < count; i++)
        if (list[i] == k)
            return true;
    return false;
}

static const char *name_of(const reduced *d, int k)
{
    return k >= 0 ? d->s->model->motions[k].name : "?";
}

static int dead_centre(reduced *d, double t, const char *sign, int v, int u)
{
    kmp_text_printf(
        &d->road.reason,
        "independent coordinate '%s' came to a dead centre at t = %.9g: %s for dependent '%s'; beyond it '%s' "
        "no longer determines the mechanism. Choose another with --u, or take the projected road",
        name_of(d, u), t, sign, name_of(d, v), name_of(d, u));
    return KMP_HALT;
}

static double exchange_growth(const reduced *d)
{
    return d->carried || d->restarts ? KMP_EXCHANGE_GROWTH : KMP_EXCHANGE_CLOSED;
}

/* |Bvu| of the tangent at hand, and whether it asks for an exchange. */
static void judge_choice(reduced *d)
{
    if (d->r == 0)
        return;
    d->growth = kmp_reduction_growth(&d->red, &d->growth_v, &d->growth_u);
    d->due = !d->fixed && d->growth > (d->part.user ? KMP_EXCHANGE_WISH : exchange_growth(d));
}

/* Whether a block of Jv that was singular within the step is no dead centre of u, at which |Bvu| grows, but a change
 * point that nobody asks about. */
static bool is_passed(const reduced *d)
{
    return d->margin->ignored && d->growth <= KMP_EXCHANGE_WISH;
}

static bool same_signs(const reduced *d, const int *signs)
{
    return memcmp(signs, d->signs, (size_t)kmp_block_count(d->red.block) * sizeof *signs) == 0;
}

/* |Bvu| at the step's end; what it asks for. */
static int watch(reduced *d, double t, const int *signs)
{
    if (d->r == 0)
        return KMP_GO;
    judge_choice(d);
    bool crossed = !same_signs(d, signs) && !is_passed(d);
    if (d->fixed && crossed)
        return dead_centre(d, t, "det Jv changed its sign, |dv/du| is largest", d->growth_v, d->growth_u);
    if (d->fixed && d->growth > KMP_GROWTH_LIMIT)
        return dead_centre(d, t, "|dv/du| exceeds 1000", d->growth_v, d->growth_u);
    d->crossed = crossed;
    if (!crossed)
        memcpy(d->signs, signs, (size_t)kmp_block_count(d->red.block) * sizeof *signs);
    return crossed ? KMP_RETRY : KMP_GO;
}

/* Steps that shrink to nothing: at a dead centre that evaluations cannot pass, or where det Jv keeps changing its sign.
 */
static void explain(kmp_road *road)
{
    reduced *d = (reduced *)road;
    kmp_text what = {0};
    if (d->growth >= KMP_GROWTH_EXPLAINS) {
        kmp_text_printf(&what, "the loops cannot be closed further, |dv/du| has grown to %.3g", d->growth);
        (void)dead_centre(d, d->t, what.s ? what.s : "", d->growth_v, d->growth_u);
        kmp_text_free(&what);
    } else if (d->crossed) {
        kmp_text_printf(
            &road->reason,
            "the closures lose a row at t = %.9g: det Jv changes its sign while |dv/du| stays at %.3g, so two "
            "branches of the mechanism meet there and the motion may go on along either; change the start or "
            "the lengths, or take the projected road",
            d->t, d->growth);
    }
}

/* The i-th of vdd less what udd makes. */
static double vdd_alone(const reduced *d, int i)
{
    double vdd = d->by_saddle ? d->qdd[d->part.v[i]] : d->red.a0[d->part.v[i]];
    for (int k = 0; d->by_saddle && k < d->p; k++)
        vdd -= d->red.bvu[i + k * d->r] * d->qdd[d->part.u[k]];
    return vdd;
}

static void remember(reduced *d, double t, const double *y)
{
    d->t = t;
    if (d->carried)
        return;
    memcpy(d->anchor_u, y, (size_t)d->p * sizeof *d->anchor_u);
    for (int i = 0; i < d->r; i++)
        d->anchor_v[i] = d->q[d->part.v[i]];
    memcpy(d->anchor_b, d->red.bvu, (size_t)(d->r * d->p) * sizeof *d->anchor_b);
    for (int i = 0; i < d->r; i++)
        d->anchor_t[i] = d->red.x_t[d->part.v[i]];
    for (int i = 0; i < d->r; i++)
        d->anchor_c[i] = vdd_alone(d, i);
    for (int i = 0; i < d->n; i++)
        d->weight[i] = d->atol * d->s->scale[i] + d->rtol * fabs(d->q[i]);
}

/* Rounding of h is not corrected. */
static bool is_noise(const reduced *d)
{
    double worst = kmp_plant_residual(d->plant);
    return worst < KMP_CLOSED;
}

/* h, J, Bvu and the correction of v at the step's end, which was evaluated last. `end`: what the one program says, when
 * it was that. */
static int come_to_end(reduced *d, double t, const double *y, kmp_fused_end *end)
{
    if (!is_fused(d)) { /* h and the factors are there */
        if (d->by_saddle)
            kmp_reduction_tangent(&d->red);
        if (d->carried)
            kmp_reduction_correction(&d->red);
        if (d->r > 0)
            kmp_block_take_signs(d->red.block, d->signs_now);
        *end = (kmp_fused_end){.good = d->fused && kmp_fused_is_good(d->fused, t, y), .signs = d->signs_now};
        return KMP_GO;
    }
    *end = kmp_fused_at_end(d->fused);
    put_state(d, y);
    kmp_plant_lend_closure(d->plant, t, d->q, end->h, end->jacobian, end->h_t);
    if (d->r > 0) {
        memcpy(d->red.bvu, end->bvu, (size_t)(d->r * d->p) * sizeof *end->bvu);
        memcpy(d->red.dv, end->dv, (size_t)d->r * sizeof *end->dv);
        d->red.factorizations++;
    }
    return end->regular ? KMP_GO : KMP_RETRY;
}

/* v back to the closures; where nothing can move it stays as the start was closed. */
static int correct(reduced *d, double *v, const double *w)
{
    bool still = d->p == 0 && !d->s->rheonomic;
    if (!d->carried || d->r == 0 || still || is_noise(d))
        return KMP_GO;
    double limit = d->part.m > d->r ? KMP_CORRECTION_REDUNDANT : KMP_CORRECTION_LIMIT;
    for (int i = 0; i < d->r; i++) {
        double rounded = fmin(w[i], KMP_CORRECTION_ROUNDING * d->s->scale[d->part.v[i]]);
        if (!(fabs(d->red.dv[i]) <= fmax(limit * w[i], rounded)))
            return KMP_RETRY;
    }
    for (int i = 0; i < d->r; i++)
        d->q[d->part.v[i]] = v[i] += d->red.dv[i];
    return KMP_GO;
}

/* Whether the step may end at y, where it has been come to; it is remembered then. */
static int look(reduced *d, double t, const double *y, const kmp_fused_end *end)
{
    int said = watch(d, t, end->signs);
    if (said == KMP_GO)
        said = kmp_redundant_check(d->plant, &d->part, t, d->atol + d->rtol, &d->road.reason);
    if (said == KMP_GO && kmp_margin_refuses(d->margin, d->plant, t))
        said = KMP_RETRY;
    if (said != KMP_GO)
        return said;
    remember(d, t, y);
    d->road.newton = d->red.newton;
    d->road.factorizations = d->red.factorizations + d->saddle.factorizations;
    d->steps++;
    d->apart = d->fused && !end->good;
    return KMP_GO;
}

static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    reduced *d = self;
    kmp_fused_end end;
    (void)dy;
    int said = come_to_end(d, t, y, &end);
    if (said == KMP_GO)
        said = correct(d, y + 2 * d->p, w + 2 * d->p);
    return said == KMP_GO ? look(d, t, y, &end) : said;
}

/* The same for an integrator of DAEs, which has evaluated nothing there; nothing is corrected. */
static int accept_residual(void *self, double t, const double *y, const double *yp)
{
    reduced *d = self;
    kmp_fused_end end;
    (void)yp;
    if (place(d, t, y) != KMP_GO || accelerate(d, y + d->p) != KMP_GO || come_to_end(d, t, y, &end) != KMP_GO)
        return KMP_RETRY;
    return look(d, t, y, &end);
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void position(kmp_road *road, double t, const double *y, double *q)
{
    reduced *d = (reduced *)road;
    put_u(d, y);
    if (!d->carried)
        (void)place(d, t, y);
    for (int i = 0; d->carried && i < d->r; i++)
        d->q[d->part.v[i]] = y[2 * d->p + i];
    memcpy(q, d->q, (size_t)d->n * sizeof *q);
}

/* At d->q, which is closed. */
static int row_of_rates(reduced *d, double t, const double *y, double *qd, double *qdd, double *lambda)
{
    kmp_plant_closure(d->plant, t, d->q);
    if (kmp_reduction_factor(&d->red))
        return KMP_HALT;
    kmp_reduction_tangent(&d->red);
    close_rates(d, y + d->p);
    memcpy(qd, d->qd, (size_t)d->n * sizeof *qd);
    if (!qdd)
        return KMP_GO;
    if (accelerate_closed(d) != KMP_GO)
        return KMP_HALT;
    complete(d);
    memcpy(qdd, d->qdd, (size_t)d->n * sizeof *qdd);
    memcpy(lambda, d->lambda, (size_t)d->part.m * sizeof *lambda);
    return KMP_GO;
}

/* Which row stays open, and by how much. */
static void explain_open(reduced *d, double t)
{
    const kmp_partition *part = &d->part;
    int worst = 0;
    double most = -1;
    for (int r = 0; r < part->m; r++) {
        double open = fabs(d->plant->h[r]) / d->s->row_scale[r];
        if (!(open <= most)) {
            most = open;
            worst = r;
        }
    }
    kmp_text_printf(
        &d->road.reason,
        "the closures could not be solved at the output time t = %.9g: row '%s' stays open by %.2g (scaled)", t,
        part->m > 0 ? d->s->row_names[worst] : "", most);
    for (int k = 0; k < part->m - part->r; k++)
        if (part->redundant[k] == worst)
            kmp_text_put(&d->road.reason, ". It is redundant, and does not agree with the other rows to rounding: give "
                                          "the model's numbers more digits, or leave the row out");
}

static int row(kmp_road *road, double t, const double *y, const double *yp, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    reduced *d = (reduced *)road;
    (void)yp;
    put_u(d, y);
    if (d->carried)
        for (int i = 0; i < d->r; i++)
            d->q[d->part.v[i]] = y[2 * d->p + i];
    else
        predict_v(d, t, y);
    if (kmp_reduction_close(&d->red, t, d->q, NULL, 0)) {
        explain_open(d, t);
        return KMP_HALT;
    }
    memcpy(q, d->q, (size_t)d->n * sizeof *q);
    *work = d->has_work ? y[work_index(d)] : 0;
    return qd ? row_of_rates(d, t, y, qd, qdd, lambda) : KMP_GO;
}

/* -- exchanges --------------------------------------------------------------------------------------- */

static void set_tolerances(reduced *d)
{
    double *atol = d->road.atol;
    for (int k = 0; k < d->p; k++) {
        atol[k] = d->atol * d->s->scale[d->part.u[k]];
        atol[d->p + k] = atol[k] * d->rate_scale;
    }
    for (int i = 0; d->carried && i < d->r; i++)
        atol[2 * d->p + i] = d->atol * d->s->scale[d->part.v[i]];
    if (d->has_work)
        atol[work_index(d)] = 1e300; /* judged, not controlled */
}

/* Factors, tangent, sign and anchor of d->q with the partition at hand. */
static int settle(reduced *d, double t, const double *y)
{
    kmp_plant_closure(d->plant, t, d->q);
    if (kmp_reduction_factor(&d->red))
        return KMP_HALT;
    kmp_reduction_tangent(&d->red);
    if (d->r > 0)
        kmp_block_take_signs(d->red.block, d->signs);
    remember(d, t, y);
    return KMP_GO;
}

static void log_exchange(const reduced *d, double t, const kmp_partition *before)
{
    kmp_text out = {0}, in = {0};
    for (int k = 0; k < d->p; k++) {
        if (!is_among(d->part.u, d->p, before->u[k]))
            kmp_text_printf(&out, "%s'%s'", out.length ? ", " : "", name_of(d, before->u[k]));
        if (!is_among(before->u, d->p, d->part.u[k]))
            kmp_text_printf(&in, "%s'%s'", in.length ? ", " : "", name_of(d, d->part.u[k]));
    }
    kmp_journal_note(d->journal, "exchange", t, d->growth, d->part.max_b,
                     "%s instead of %s as independent coordinate: |dv/du| %.3g -> %.3g", in.s ? in.s : "",
                     out.s ? out.s : "", d->growth, d->part.max_b);
    kmp_text_free(&out);
    kmp_text_free(&in);
}

/* Without a reduced mass there is nothing to write out; the power of a drive needs multipliers, and so do forces that
 * depend on them, by iteration. */
static bool can_fuse(const reduced *d)
{
    return d->carried && !d->by_saddle && !(d->has_work && d->s->rheonomic) && d->s->pressed_count == 0;
}

/* For the choice of u at hand, whose factors are, too. */
static int fuse(reduced *d, bool worth)
{
    kmp_fused_free(d->fused);
    d->fused = NULL;
    d->apart = false;
    d->steps = 0;
    return worth && can_fuse(d) && kmp_fused_new(&d->fused, &d->red) != KEMPE_OK ? KMP_HALT : KMP_GO;
}

/* With many freedoms the saddle system, sparse, costs less than the reduced mass, of which more is not zero. */
static bool try_saddle(reduced *d)
{
    if (d->p < MANY_FREEDOMS || d->plant->by_bodies)
        return true;
    if (!kmp_saddle_init(&d->saddle, d->plant, &d->part))
        return false;
    double cost = kmp_saddle_operations(&d->saddle), count = (double)kmp_reduction_count(&d->red).paper;
    count *= d->red.zeros ? BY_LISTS : 1;
    d->by_saddle = cost > 0 && KMP_SPARSE_COST * cost < count;
    if (!d->by_saddle)
        kmp_saddle_free(&d->saddle);
    return true;
}

/* Of the rows that the partition has; the plant has taken what the road goes by. */
static bool renew_saddle(reduced *d)
{
    long factorizations = d->saddle.factorizations;
    kmp_saddle_free(&d->saddle);
    bool made = !d->by_saddle || kmp_saddle_init(&d->saddle, d->plant, &d->part);
    d->saddle.factorizations = factorizations;
    return made;
}

/* The new partition's workspace, and the state in its unknowns. */
static int take_over(reduced *d, double t, double *y)
{
    kmp_reduction before = d->red;
    if (kmp_reduction_init(&d->red, d->plant, &d->part) != KEMPE_OK) {
        d->red = before;
        return KMP_HALT;
    }
    d->red.newton = before.newton;
    d->red.factorizations = before.factorizations;
    kmp_reduction_free(&before);
    if (!renew_saddle(d))
        return KMP_HALT;
    pack(d, d->q, d->qd, y);
    set_tolerances(d);
    d->road.exchanges++;
    bool worth = d->steps >= KMP_ROAD_BRIEF;
    return settle(d, t, y) == KMP_GO ? fuse(d, worth) : KMP_HALT;
}

/* An exchange that is due, at d->q and d->qd, where the plant is. */
static int exchange(reduced *d, double t, double *y)
{
    kmp_partition before;
    d->due = false;
    if (!kmp_partition_copy(&before, &d->part))
        return KMP_HALT;
    int said = kmp_partition_exchange(&d->part, d->s, d->plant->jacobian, exchange_growth(d)) == KEMPE_OK
                   ? take_over(d, t, y)
                   : KMP_HALT;
    if (said == KMP_GO)
        log_exchange(d, t, &before);
    kmp_partition_free(&before);
    return said;
}

/* y' of a new start, where it is wanted. */
static int put_slope(reduced *d, double t, const double *y, double *yp)
{
    return yp ? rhs(d, t, y, yp) : KMP_GO;
}

static int renew(kmp_road *road, double t, double *y, double *yp)
{
    reduced *d = (reduced *)road;
    if (!d->due)
        return KMP_GO;
    if (place(d, t, y) != KMP_GO)
        return KMP_HALT;
    close_rates(d, y + d->p);
    int said = exchange(d, t, y);
    return said == KMP_GO && put_slope(d, t, y, yp) == KMP_GO ? KMP_CHANGED : KMP_HALT;
}

static int resume(kmp_road *road, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                  double *y, double *yp)
{
    reduced *d = (reduced *)road;
    (void)qdd, (void)lambda;
    memcpy(d->q, q, (size_t)d->n * sizeof *q);
    memcpy(d->qd, qd, (size_t)d->n * sizeof *qd);
    pack(d, q, qd, y);
    if (settle(d, t, y) != KMP_GO)
        return KMP_HALT;
    judge_choice(d);
    if (d->due && exchange(d, t, y) != KMP_GO)
        return KMP_HALT;
    return put_slope(d, t, y, yp);
}

/* -- making one -------------------------------------------------------------------------------------- */

static void release(kmp_road *road)
{
    reduced *d = (reduced *)road;
    kmp_fused_free(d->fused);
    kmp_reduced_jacobian_free(&d->tangents);
    kmp_reduced_residual_free(&d->residual);
    kmp_reduction_free(&d->red);
    kmp_saddle_free(&d->saddle);
    kmp_partition_free(&d->part);
    kmp_text_free(&road->reason);
    kmp_free(road->y);
    kmp_free(road->yp);
    kmp_free(road->atol);
    kmp_free(d->q);
    kmp_free(d->qd);
    kmp_free(d->weight);
    kmp_free(d->signs);
    kmp_free(d->signs_now);
    kmp_free(d->anchor_u);
    kmp_free(d->anchor_v);
    kmp_free(d->anchor_b);
    kmp_free(d->anchor_t);
    kmp_free(d->anchor_c);
    kmp_free(d->udd);
    kmp_free(d->qdd);
    kmp_free(d->lambda);
    kmp_free(d);
}

static bool allocate(reduced *d)
{
    kmp_road *road = &d->road;
    road->y = KMP_NEW(double, road->size);
    road->atol = KMP_NEW(double, road->size);
    d->q = KMP_NEW(double, d->n);
    d->qd = KMP_NEW(double, d->n);
    d->weight = KMP_NEW(double, d->n);
    d->signs = KMP_NEW(int, d->r);
    d->signs_now = KMP_NEW(int, d->r);
    d->anchor_u = KMP_NEW(double, d->p);
    d->anchor_v = KMP_NEW(double, d->r);
    d->anchor_b = KMP_NEW(double, d->r * d->p);
    d->anchor_t = KMP_NEW(double, d->r);
    d->anchor_c = KMP_NEW(double, d->r);
    d->udd = KMP_NEW(double, d->p);
    d->qdd = KMP_NEW(double, d->n);
    d->lambda = KMP_NEW(double, d->part.m);
    return road->y && road->atol && d->q && d->qd && d->weight && d->signs && d->signs_now && d->anchor_u &&
           d->anchor_v && d->anchor_b && d->anchor_t && d->anchor_c && d->udd && d->qdd && d->lambda;
}

static bool begin(reduced *d, const kmp_road_start *start)
{
    memcpy(d->q, start->q, (size_t)d->n * sizeof *d->q);
    pack(d, start->q, start->qd, d->road.y);
    if (d->has_work)
        d->road.y[work_index(d)] = start->work;
    if (settle(d, start->t, d->road.y) == KMP_GO)
        return true;
    (void)kmp_fail(d->s->context, KEMPE_E_FAILED, "Jv is singular at t = %.9g", start->t);
    return false;
}

/* As a DAE. */
static bool describe(reduced *d, double t)
{
    d->road.yp = KMP_NEW(double, d->road.size);
    if (!d->road.yp || !kmp_reduced_residual_init(&d->residual, d->p, d->has_work)) {
        (void)kmp_fail_memory(d->s->context);
        return false;
    }
    d->road.dae = (kmp_dae){.self = d, .residual = residual, .matrix = matrix, .accept = accept_residual};
    kmp_reduced_residual_describe(&d->residual, &d->road.dae);
    if (rhs(d, t, d->road.y, d->road.yp) == KMP_GO)
        return true;
    (void)kmp_fail(d->s->context, KEMPE_E_FAILED, "the accelerations cannot be evaluated at t = %.9g", t);
    return false;
}

static bool prepare(reduced *d, const kmp_road_start *start)
{
    if (kmp_reduction_init(&d->red, start->plant, &d->part) != KEMPE_OK)
        return false;
    d->by_saddle = d->plant->by_bodies;
    if (!renew_saddle(d) || (!(start->implicit || start->dae) && !try_saddle(d))) {
        (void)kmp_fail_memory(d->s->context);
        return false;
    }
    if (!begin(d, start))
        return false;
    set_tolerances(d);
    if (fuse(d, !start->brief) != KMP_GO)
        return false;
    if (!(start->implicit || start->dae) || d->carried)
        return true;
    d->road.ode.jacobian = jacobian;
    if (kmp_reduced_jacobian_init(&d->tangents, &d->red, d->has_work) != KEMPE_OK)
        return false;
    return !start->dae || describe(d, start->t);
}

static kmp_road *create(const kmp_road_start *start, bool carried)
{
    const kmp_partition *part = start->part;
    reduced *d = KMP_NEW(reduced, 1);
    if (!d) {
        (void)kmp_fail_memory(start->system->context);
        return NULL;
    }
    d->s = start->system;
    d->plant = start->plant;
    d->margin = start->margin;
    d->fixed = start->fixed;
    d->journal = start->journal;
    d->restarts = start->restarts;
    d->carried = carried || part->p == 0; /* with nothing else in the state, v keeps the steps in hand */
    d->has_work = start->system->dissipative;
    d->n = part->n;
    d->p = part->p;
    d->r = part->r;
    d->rtol = start->rtol;
    d->atol = start->atol;
    d->rate_scale = start->rate_scale;
    d->road.release = release;
    d->road.row = row;
    d->road.position = position;
    d->road.renew = renew;
    d->road.resume = resume;
    d->road.explain = explain;
    d->road.size = work_index(d) + d->has_work;
    d->road.ode = (kmp_ode){
        .n = d->road.size, .self = d, .rhs = rhs, .accept = accept, .positions = d->p, .quadratures = d->has_work};
    if (!kmp_partition_copy(&d->part, part) || !allocate(d))
        (void)kmp_fail_memory(start->system->context);
    else if (prepare(d, start))
        return &d->road;
    release(&d->road);
    return NULL;
}

static kmp_road *create_carried(const kmp_road_start *start)
{
    return create(start, true);
}

static kmp_road *create_closed(const kmp_road_start *start)
{
    return create(start, false);
}

const kmp_road_kind kmp_road_carried = {.road = "reduced",
                                        .form = "carried",
                                        .standard = true,
                                        .corrected = true,
                                        .by_bodies = true,
                                        .create = create_carried};
const kmp_road_kind kmp_road_closed = {.road = "reduced",
                                       .form = "closed",
                                       .standard = true,
                                       .both = true,
                                       .jacobian = true,
                                       .by_bodies = true,
                                       .create = create_closed};
