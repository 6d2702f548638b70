/* SPDX-License-Identifier: BSD-3-Clause */
/* The formulation of a motion with sensitivities (forward.h): its unknowns and their ODE, its choice of u, its rows,
 * its creation and its run. It passes changes by forward_changes.c, and events of the run by forward_events.c. Their
 * place is in forward_place.c, derivatives of their times in forward_times.c, next values of states in
 * forward_resets.c, delayed signals in forward_delays.c, and maps for the adjoint method in forward_map.c. */
#include "analyses/sensitivity/forward.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/sensitivity/forward_delays.h"
#include "analyses/sensitivity/forward_events.h"
#include "analyses/sensitivity/forward_map.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/decide/run_start.h"
#include "integrators/formulations/cost_model.h"
#include "model/data/run_settings.h"
#include "model/data/state.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

int kmp_forward_first_other_mode(const kmp_forward_formulation *f, const double *mode)
{
    for (int k = 0; k < f->system->events.count; k++)
        if (kmp_forward_mode_differs(f, k, mode))
            return k;
    return -1;
}

/* Near a rank loss of J the formulation uses all coordinates and their sensitivities in place of u, with the integrator
 * that steps over such places (integrators/steppers/singular_step.h). Across the event u and all smooth quantities
 * continue straight. A parameter that moves the closures there makes this impossible; if such an entry is present,
 * nothing is stepped over. */

/* Largest distance of a step's end from its prediction (rad, characteristic lengths): positions within it are found
 * from there.
 */
#define FARTHEST 0.3
/* The same where drives move contacts or other conditions, which a step may go by FARTHEST. */
#define NEAR_FOR_EVENTS 1e-3
/* Finer tolerances are impossible near a singular position. */
#define ZONE_RTOL 1e-9

/* The rows of u among the unknowns from `block` on; `room`: for p. */
static const double *rows_of(const kmp_forward_formulation *f, const double *block, double *room)
{
    if (!f->zone.now)
        return block;
    for (int i = 0; i < f->p; i++)
        room[i] = block[f->v->linear.part.u[i]];
    return room;
}

static const double *position_of(const kmp_forward_formulation *f, const double *y, int k)
{
    return rows_of(f, y + (k + 1) * f->width, f->zone.su);
}

static const double *rate_of(const kmp_forward_formulation *f, const double *y, int k)
{
    return rows_of(f, y + kmp_forward_blocks(f) + (k + 1) * f->width, f->zone.sud);
}

int kmp_forward_come_to(kmp_forward_formulation *f, double t, const double *y)
{
    const double *ud = rows_of(f, y + kmp_forward_blocks(f), f->zone.ud);
    f->in_lanes = false;
    return f->zone.now ? kmp_sensitivity_equations_near(f->v, t, y, ud) : kmp_sensitivity_equations_at(f->v, t, y, ud);
}

void kmp_forward_follow(kmp_forward_formulation *f, const double *y, int k, double *dq, double *dqd, double *dqdd,
                        double *dlambda)
{
    kmp_sensitivity_equations_follow(f->v, k, position_of(f, y, k), rate_of(f, y, k), dq, dqd, dqdd, dlambda);
}

/* -- the ODE ----------------------------------------------------------------------------------------- */

/* dy at the last state, which is the state of y. */
static void give(kmp_forward_formulation *f, const double *y, double *dy)
{
    kmp_sensitivity_equations *v = f->v;
    int w = f->width, half = kmp_forward_blocks(f);
    memcpy(dy, y + half, (size_t)half * sizeof *dy);
    for (int i = 0; i < w; i++)
        dy[half + i] = v->linear.qdd[kmp_forward_unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        const double *su = position_of(f, y, k), *sud = rate_of(f, y, k);
        if (f->zone.now)
            kmp_sensitivity_equations_follow(v, k, su, sud, NULL, NULL, dy + half + (k + 1) * w, NULL);
        else
            kmp_sensitivity_equations_accelerate(v, k, su, sud, dy + half + (k + 1) * w);
        kmp_forward_delays_rates(f, y, k, dy + half + (k + 1) * w);
    }
    const kmp_forward_target *target = f->options->integrand;
    if (f->integrals) {
        f->place.t = NAN; /* the place is lost below */
        dy[2 * half] = kmp_target_value(target, v);
    }
    for (int k = 0; f->integrals && k < f->count; k++) {
        kmp_forward_follow(f, y, k, f->place.dq, f->place.dqd, f->dqdd, f->dlambda);
        if (target->shown)
            kmp_slopes_along(v->slopes, &v->slopes->outputs,
                             &(kmp_direction){NULL, f->place.dq, f->place.dqd, f->dqdd, f->dlambda, NULL}, k, v->shown);
        const kmp_sensitivity_equations_row along = {
            .q = f->place.dq, .qd = f->place.dqd, .qdd = f->dqdd, .lambda = f->dlambda, .shown = v->shown};
        dy[2 * half + 1 + k] = kmp_target_of_row(target, v, &along);
    }
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    kmp_forward_formulation *f = self;
    if (kmp_forward_come_to(f, t, y) != KMP_GO)
        return KMP_RETRY;
    give(f, y, dy);
    return KMP_GO;
}

/* -- several stages at once -------------------------------------------------------------------------------- */

/* Only the motion; its sensitivities follow it (kmp_ode.follow). */
static int rhs_of_stages(void *self, const double *t, const double *y, double *dy)
{
    kmp_forward_formulation *f = self;
    ptrdiff_t rates = (ptrdiff_t)kmp_forward_blocks(f) * KMP_STAGE_LANES;
    return kmp_varied_lanes_run(f->options->lanes, false, t, y, y + rates, dy + rates);
}

static int follow_stages(void *self, double *a, double *b)
{
    kmp_forward_formulation *f = self;
    return kmp_varied_lanes_matrices(f->options->lanes, a, b);
}

static int motion_alone(void *self, double t, const double *y, double *dy)
{
    kmp_forward_formulation *f = self;
    kmp_linear *l = &f->v->linear;
    const int half = kmp_forward_blocks(f);
    l->plain = true;
    int said = kmp_forward_come_to(f, t, y);
    l->plain = f->count == 0;
    for (int i = 0; said == KMP_GO && i < f->p; i++) {
        dy[i] = y[half + i];
        dy[half + i] = l->qdd[l->part.u[i]];
    }
    return said;
}

/* At the end of a step the accelerations belong to its last stage, which lies there; its loops are closed. */
static int end_of_step(void *self, double t, const double *y, double *dy)
{
    kmp_forward_formulation *f = self;
    kmp_sensitivity_equations *v = f->v;
    if (!kmp_varied_lanes_last(f->options->lanes, t, v->q))
        return motion_alone(self, t, y, dy);
    memcpy(dy, y + kmp_forward_blocks(f), (size_t)f->p * sizeof *dy);
    for (int i = 0; i < f->p; i++)
        v->q[v->linear.part.u[i]] = y[i];
    f->in_lanes = true;
    return kmp_sensitivity_equations_close(v, t, v->q, y + kmp_forward_blocks(f));
}

/* Begins the lanes, if the integrator uses them. */
static void add_lanes(kmp_forward_formulation *f)
{
    kmp_sensitivity_equations *v = f->v;
    kmp_ode *ode = &f->formulation.ode;
    if (!f->start.lanes || f->zone.now || f->integrals || !f->options->lanes ||
        (f->start.passed && f->start.passed->friction))
        return;
    kmp_varied_lanes_begin(f->options->lanes);
    ode->lanes = rhs_of_stages;
    ode->width = KMP_STAGE_LANES;
    ode->followers = f->count;
    ode->follow = follow_stages;
    ode->alone = motion_alone;
    ode->end = end_of_step;
    kmp_counts count = kmp_program_count(f->system->motion, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
    count.paper += kmp_reduction_count(&v->linear.red).paper;
    ode->cycles = kmp_cycles_by_parts((double)count.paper, false);
    ode->cycles_of_lanes = kmp_varied_lanes_cycles(f->options->lanes);
    ode->cycles_of_step = f->count > 0 ? kmp_varied_lanes_matrix_cycles(f->options->lanes) : 0;
}

/* df/dy of (u, ud) is also the Jacobian of the sensitivities by their own values. Its change with u, which Newton's
 * method does not need, is left out. */
static int jacobian(void *self, double t, const double *y, double *j)
{
    kmp_forward_formulation *f = self;
    kmp_linear *l = &f->v->linear;
    bool plain = l->plain;
    int p = f->p, half = kmp_forward_blocks(f), size = f->formulation.size;
    l->plain = false;
    int said = kmp_forward_come_to(f, t, y);
    l->plain = plain;
    if (said != KMP_GO)
        return KMP_RETRY;
    kmp_sensitivity_equations_matrix(f->v, f->matrix);
    for (int i = 0; i < half; i++)
        j[i + (half + i) * size] = 1;
    for (int b = 0; b < half; b += p)
        for (int k = 0; k < 2 * p; k++)
            memcpy(j + half + b + (b + k % p + (k < p ? 0 : half)) * size, f->matrix + k * p, (size_t)p * sizeof *j);
    return KMP_GO;
}

/* -- the end of a step --------------------------------------------------------------------------------------- */

int kmp_forward_stand_at(kmp_forward_formulation *f, double t, const double *y, bool whole)
{
    kmp_linear *l = &f->v->linear;
    l->plain = f->count == 0 || !whole;
    int said = kmp_forward_come_to(f, t, y);
    if (said != KMP_GO && !f->zone.now && kmp_sensitivity_equations_walk(f->v, t, y))
        said = kmp_sensitivity_equations_near(f->v, t, f->v->q, rows_of(f, y + kmp_forward_blocks(f), f->zone.ud));
    l->plain = f->count == 0;
    if (said != KMP_GO && f->formulation.reason.length == 0)
        kmp_text_printf(&f->formulation.reason, "the loops do not close at t = %.9g", t);
    return said == KMP_GO ? KMP_GO : KMP_HALT;
}

/* Stores signs of Jv's blocks, predictions and conditions of the last state; checks that u is still well conditioned.
 */
static void settle(kmp_forward_formulation *f)
{
    const kmp_linear *l = &f->v->linear;
    kmp_forward_choice *choice = &f->choice;
    int row, column;
    memcpy(f->mode, l->eval->conditions.mode, kmp_forward_mode_bytes(f));
    if (f->in_lanes)
        kmp_varied_lanes_anchor(f->options->lanes, KMP_STAGE_LANES - 1);
    else
        kmp_sensitivity_equations_anchor(f->v);
    choice->crossed = false;
    if (l->red.r == 0)
        return;
    kmp_block_take_signs(l->red.block, choice->signs);
    choice->growth = kmp_reduction_growth(&l->red, &row, &column);
    choice->due = !f->start.fixed && !f->zone.now && choice->growth > KMP_EXCHANGE_VARIED;
}

/* Continues from the place at t with other unknowns: y, weights and the state. Columns that only pass an event are not
 * integrated. */
static int take_up(kmp_forward_formulation *f, double t, double *y)
{
    kmp_forward_pack(f, y);
    const int w = f->width, count = f->options->alone ? 0 : f->count, half = w * (1 + count);
    double *atol = f->formulation.atol;
    for (int b = 0; b <= count; b++)
        for (int i = 0; i < w; i++) {
            int k = kmp_forward_unknowns(f)[i];
            double of = f->start.atol * f->system->scale[k] / (b ? f->sizes[b - 1] : 1);
            kmp_start_tolerance(kmp_state_of(f->system->model, k) != NULL, of, f->start.rate_scale, &atol[b * w + i],
                                &atol[half + b * w + i]);
        }
    for (int b = 0; b < f->integrals && b <= count; b++)
        atol[2 * half + b] = f->start.atol * f->options->spec->t_end / (b ? f->sizes[b - 1] : 1);
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    settle(f);
    return KMP_GO;
}

/* -- a zone ------------------------------------------------------------------------------------------ */

/* Puts the last state, complete, into the unknowns that led to it. */
static void put_closed(kmp_forward_formulation *f, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int n = f->n, half = kmp_forward_blocks(f);
    for (int k = 0; k < f->count; k++)
        kmp_forward_follow(f, y, k, y + (k + 1) * n, y + half + (k + 1) * n, NULL, NULL);
    memcpy(y, l->q, (size_t)n * sizeof *y);
    memcpy(y + half, l->qd, (size_t)n * sizeof *y);
}

static int closed(void *self, double t, double *y, bool as_it_is, double *dy, double *distance)
{
    kmp_forward_formulation *f = self;
    if (!dy)
        kmp_eval_closure(kmp_forward_eval(f), t, y);
    else if (kmp_forward_come_to(f, t, y) != KMP_GO)
        return KMP_RETRY;
    if (dy && !as_it_is)
        put_closed(f, y);
    if (dy)
        give(f, y, dy);
    if (distance)
        *distance = kmp_rank_margin_at(f->start.margin, kmp_forward_eval(f));
    return KMP_GO;
}

static void say_change_point(kmp_forward_formulation *f, double t)
{
    kmp_text_printf(&f->formulation.reason,
                    "the mechanism reaches a change point near t = %.9g, where branches meet: %s", t,
                    f->options->alone ? "the adjoint method cannot cross it, but the forward method may"
                                      : "parameters of its closures have no derivative beyond it");
}

/* -- the end of a step ------------------------------------------------------------------------------- */

/* True if a step is too long for the search of events between its ends: drives move conditions, whatever the errors of
 * the unknowns, which may be none. A step over a whole rise of a cam would not see it. Coordinates that events do not
 * depend on may go any way. */
static bool passes_events(const kmp_forward_formulation *f, const double *y)
{
    const kempe_system *s = f->system;
    const double *from = f->v->anchor[0].q, *to = f->v->linear.q;
    bool any = false, far = kmp_sensitivity_equations_miss(f->v, y) > NEAR_FOR_EVENTS;
    for (int k = 0; k < s->events.count && s->rheonomic; k++)
        any = any || s->events.condition[k].validity == KMP_VALIDITY_NONE;
    for (int i = 0; i < f->n; i++)
        far = far || (f->watched[i] && fabs(to[i] - from[i]) > FARTHEST * s->scale[i]);
    return any && far;
}

/* Accepts a step: it must not have jumped over a dead centre of u; evaluated last. */
static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    kmp_forward_formulation *f = self;
    const kmp_linear *l = &f->v->linear;
    const char *joint = f->own_angles ? kmp_sensitivity_equations_singular(f->v) : NULL;
    (void)dy, (void)w;
    if (joint) {
        kmp_text_printf(&f->formulation.reason,
                        "the angles of spherical joint '%s' approach their singular position at t = %.9g s, where "
                        "their integrals end; use rows, or give the joint other axes",
                        joint, t);
        return KMP_HALT;
    }
    if (f->zone.now) {
        put_closed(f, y);
        kmp_sensitivity_equations_anchor(f->v);
        return KMP_GO;
    }
    if (l->red.r > 0) {
        const bool crosses = !kmp_block_has_signs(l->red.block, f->choice.signs);
        f->choice.crossed = f->choice.crossed || crosses;
        if (crosses || kmp_sensitivity_equations_miss(f->v, y) > FARTHEST || passes_events(f, y))
            return KMP_RETRY;
    }
    if (f->options->alone && l->red.r > 0 && kmp_rank_margin_at(f->start.margin, l->eval) < KMP_MARGIN_ENDS) {
        say_change_point(f, t);
        return KMP_HALT;
    }
    int said = kmp_redundant_check(l->eval, &l->part, t, f->start.atol + f->start.rtol, &f->formulation.reason);
    if (said == KMP_GO && kmp_rank_margin_refuses(f->start.margin, l->eval, t))
        said = KMP_RETRY;
    if (said == KMP_GO)
        settle(f);
    return said;
}

static void explain(kmp_formulation *formulation)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    double t = f->v->anchor[0].t;
    kmp_eval_closure(kmp_forward_eval(f), t, f->v->anchor[0].q);
    if (f->zone.now || f->choice.crossed ||
        (f->choice.growth < KMP_GROWTH_EXPLAINS &&
         kmp_rank_margin_at(f->start.margin, kmp_forward_eval(f)) < KMP_MARGIN_EXPLAINS))
        say_change_point(f, t);
    else if (f->choice.growth >= KMP_GROWTH_EXPLAINS)
        kmp_text_printf(&formulation->reason,
                        "the independent coordinates reach a dead centre at t = %.9g: |dv/du| has grown to %.3g", t,
                        f->choice.growth);
}

/* -- construction ------------------------------------------------------------------------------------ */

/* Makes y, weights and the ODE of the formulation for the current p or n unknowns. False: no memory. */
bool make_unknowns(kmp_forward_formulation *f)
{
    kmp_formulation *formulation = &f->formulation;
    f->width = f->zone.now ? f->n : f->p;
    formulation->rtol = f->zone.now ? fmax(f->start.rtol, ZONE_RTOL) : 0;
    kmp_formulation_make_unknowns(formulation, 2 * kmp_forward_blocks(f) + f->integrals, false);
    formulation->ode = (kmp_ode){.n = formulation->size,
                                 .self = f,
                                 .rhs = rhs,
                                 .accept = accept,
                                 .jacobian = jacobian,
                                 .closed = closed,
                                 .positions = kmp_forward_blocks(f),
                                 .quadratures = f->integrals};
    return !formulation->arena.failed;
}

/* -- other coordinates ------------------------------------------------------------------------------- */

int kmp_forward_choose_anew(kmp_forward_formulation *f, double *y, bool *others)
{
    kmp_linear *l = &f->v->linear;
    kmp_partition part;
    kempe_status status = kmp_partition_of_rank(&part, f->system, l->eval->jacobian, l->part.r, NULL, 0);
    if (status == KEMPE_OK)
        *others = memcmp(l->part.u, part.u, (size_t)f->p * sizeof *part.u) != 0;
    if (status != KEMPE_OK || kmp_sensitivity_equations_take(f->v, f->place.t, f->place.q, &part) != KEMPE_OK)
        return KMP_HALT;
    if (take_up(f, f->place.t, y) != KMP_GO)
        return KMP_HALT;
    f->choice.due = false; /* no choice is better */
    return KMP_GO;
}

static int renew(kmp_formulation *formulation, double t, double *y, double *yp)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    (void)yp;
    if (!f->choice.due)
        return KMP_GO;
    const bool exchanges = kmp_forward_map_exchanges(f);
    double *all = y;
    bool others;
    if (exchanges && !kmp_forward_map_begin_exchange(f, t, y))
        return KMP_HALT;
    if (f->options->alone && !exchanges)
        all = kmp_forward_map_begin(f, t, y);
    if (!all || kmp_forward_spread(f, t, all) != KMP_GO)
        return KMP_HALT;
    if (kmp_forward_choose_anew(f, all, &others) != KMP_GO || (all != y && kmp_forward_map_end(f, y) != KMP_GO) ||
        (exchanges && kmp_forward_map_end_exchange(f) != KMP_GO))
        return KMP_HALT;
    formulation->exchanges += others;
    return KMP_CHANGED;
}

static int resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const double *jump;
    (void)yp;
    if (kmp_forward_delays_jump(f, t, &jump) != KMP_GO)
        return KMP_HALT;
    const bool changes = f->resets.count > 0 || jump || kmp_forward_charts_differ(f) ||
                         memcmp(f->mode, kmp_forward_eval(f)->conditions.mode, kmp_forward_mode_bytes(f)) != 0;
    double *all = changes && f->options->alone ? kmp_forward_map_begin(f, t, y) : y;
    if (!all || kmp_forward_pass_changes(f, t, q, qd, jump, all) != KMP_GO)
        return KMP_HALT;
    const int half = kmp_forward_blocks(f);
    for (int i = 0; i < f->width; i++) {
        all[i] = q[kmp_forward_unknowns(f)[i]];
        all[half + i] = qd[kmp_forward_unknowns(f)[i]];
    }
    kmp_forward_delays_set(f, t, all);
    if (kmp_forward_stand_at(f, t, all, false) != KMP_GO)
        return KMP_HALT;
    settle(f);
    return all != y ? kmp_forward_map_end(f, y) : KMP_GO;
}

/* -- values of a scalar ------------------------------------------------------------------------------ */

static double weighted(int count, const double *w, const double *x)
{
    double sum = 0;
    for (int i = 0; w && i < count; i++)
        sum += w[i] != 0 ? w[i] * x[i] : 0; /* values without weight may be NaN */
    return sum;
}

double kmp_target_of_row(const kmp_forward_target *w, const kmp_sensitivity_equations *varied,
                         const kmp_sensitivity_equations_row *row)
{
    int n = varied->n;
    return weighted(n, w->q, row->q) + weighted(n, w->qd, row->qd) + weighted(n, w->qdd, row->qdd) +
           weighted(varied->m, w->lambda, row->lambda) + weighted(varied->slopes->shown, w->shown, row->shown);
}

double kmp_target_value(const kmp_forward_target *target, kmp_sensitivity_equations *varied)
{
    const kmp_linear *l = &varied->linear;
    kmp_instant at = kmp_linear_instant(&varied->linear);
    kmp_linear_doubt_state(l, false);
    const double *shown = target->shown ? kmp_slopes_values(&varied->slopes->outputs, &at) : NULL;
    const kmp_sensitivity_equations_row here = {
        .q = l->q, .qd = l->qd, .qdd = l->qdd, .lambda = l->lambda, .shown = shown};
    return kmp_target_of_row(target, varied, &here);
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void position(kmp_formulation *formulation, double t, const double *y, double *q)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    if (f->zone.now)
        memcpy(q, y, (size_t)f->n * sizeof *q);
    else if (kmp_sensitivity_equations_position(f->v, t, y, q) != KMP_GO)
        memcpy(q, f->v->q, (size_t)f->n * sizeof *q);
}

static int row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const kmp_linear *l = &f->v->linear;
    *work = 0;
    int said = qd || f->zone.now ? kmp_forward_stand_at(f, t, y, qdd != NULL)
                                 : kmp_sensitivity_equations_position(f->v, t, y, q);
    if (said != KMP_GO) {
        if (formulation->reason.length == 0)
            kmp_text_printf(&formulation->reason, "the loops cannot be closed at the output time t = %.9g s", t);
        return KMP_HALT;
    }
    if (!qd && !f->zone.now)
        return KMP_GO;
    memcpy(q, l->q, (size_t)f->n * sizeof *q);
    if (qd)
        memcpy(qd, l->qd, (size_t)f->n * sizeof *qd);
    if (!qdd)
        return KMP_GO;
    memcpy(qdd, l->qdd, (size_t)f->n * sizeof *qdd);
    memcpy(lambda, l->lambda, (size_t)f->m * sizeof *lambda);
    f->row_y = y;
    return KMP_GO;
}

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    kmp_forward_formulation *f = user;
    kmp_sensitivity_equations *v = f->v;
    const kmp_chart_motion own = {f->own_chart, q, qd, qdd};
    (void)work;
    if (!f->options->watch.row)
        return 0;
    const kmp_instant at = kmp_linear_instant(&v->linear);
    kmp_linear_doubt_state(&v->linear, false);
    const double *shown = kmp_slopes_values(&v->slopes->outputs, &at);
    f->place.t = NAN; /* the place is lost */
    for (int k = 0; k < f->count; k++) {
        /* The derivatives of the last whole row by parameter k: outputs in the current charts, and the user's
         * coordinates. */
        const kmp_linear *l = &v->linear;
        const kmp_chart_motion inner = {l->eval->chart, l->q, l->qd, l->qdd};
        double *dq = f->place.dq + k * f->n, *dqd = f->place.dqd + k * f->n, *dqdd = f->dqdd + k * f->n;
        double *dlambda = f->dlambda + k * f->m;
        kmp_forward_follow(f, f->row_y, k, dq, dqd, dqdd, dlambda);
        if (v->slopes->shown > 0)
            kmp_slopes_along(v->slopes, &v->slopes->outputs, &(kmp_direction){NULL, dq, dqd, dqdd, dlambda, NULL}, k,
                             f->dshown + k * v->slopes->shown);
        for (int c = 0; c < f->system->chart_count; c++)
            if (!kmp_chart_is_own(inner.chart, c))
                kmp_chart_carry(f->system, c, &inner, &own, dq, dqd, dqdd);
    }
    const kmp_sensitivity_equations_row row_of = {
        t, q, qd, qdd, lambda, shown, f->place.dq, f->place.dqd, f->dqdd, f->dlambda, f->dshown};
    return f->options->watch.row(f->options->watch.user, &row_of);
}

static int take_step(void *user, kmp_runner *runner, double from, double to)
{
    kmp_forward_formulation *f = user;
    if (!kmp_forward_delays_record(f, runner, to))
        return 1;
    const double *y = f->integrals ? kmp_runner_unknowns(runner, to) : NULL;
    if (f->integrals && !y)
        return 1;
    if (y)
        memcpy(f->place.tail, y + 2 * kmp_forward_blocks(f), (size_t)f->integrals * sizeof *y);
    if (to > from)
        kmp_forward_map_end_step(f);
    return f->options->watch.step && to > from ? f->options->watch.step(f->options->watch.user, runner, from, to) : 0;
}

/* -- the formulation ---------------------------------------------------------------------------------------- */

/* v uses another evaluator from now on. */
static void go_by(kmp_forward_formulation *f, kmp_evaluator *eval)
{
    kmp_linear_lend(&f->v->linear, eval);
    kmp_linear_renew_parameters(&f->v->linear);
    kmp_slopes_renew_parameters(f->v->slopes);
}

/* Restores its own evaluator with the runner's charts and conditions. */
static void release(kmp_formulation *formulation)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const kmp_evaluator *eval = kmp_forward_eval(f);
    kmp_arena_free(&formulation->arena);
    if (eval == f->own)
        return;
    kmp_eval_set_charts(f->own, eval->chart);
    for (int k = 0; k < f->system->events.count; k++)
        if (f->system->events.condition[k].role == KMP_ROLE_NONE)
            kmp_eval_set_mode(f->own, k, eval->conditions.mode[k] != 0);
        else
            kmp_eval_set_kink(f->own, k, eval->conditions.mode[k]);
    go_by(f, f->own);
}

static int keep(kmp_formulation *formulation, double t, const double *y)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const double *all = f->options->alone ? kmp_forward_map_begin(f, t, y) : y;
    if (!all)
        return KMP_HALT;
    int said = KMP_GO;
    memcpy(f->place.tail, all + 2 * kmp_forward_blocks(f), (size_t)f->integrals * sizeof *all);
    if (f->start.passed && f->start.passed->now)
        said = kmp_forward_leave_at_event(f, t, all);
    else if (!(f->place.t >= t)) /* charts have changed, and the place with them */
        said = kmp_forward_spread(f, t, all);
    if (f->options->alone)
        kmp_forward_set_columns(f, 0);
    return said;
}

/* Checks a start that is neither the first one nor the place of the last formulation: rates have changed between them.
 */
static kempe_status check_place(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    if (f->event.passing)
        return KEMPE_OK;
    int k = kmp_forward_first_other_mode(f, start->eval->conditions.mode);
    if (k >= 0)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "derivatives with respect to parameters end at t = %.9g s, where %s changes the closures",
                        start->t, f->system->event_text[k]);
    if (start->part->p != f->p || start->t > f->place.t || start->t < f->place.t)
        return kmp_fail(
            f->system->context, KEMPE_E_FAILED,
            "derivatives with respect to parameters end at t = %.9g, where the degrees of freedom are %d, not %d",
            start->t, start->part->p, f->p);
    return KEMPE_OK;
}

static kempe_status fail_with_reason(const kmp_forward_formulation *f)
{
    const char *reason = f->formulation.reason.s;
    return kmp_fail(f->system->context, KEMPE_E_FAILED, "%s", reason ? reason : "derivatives end at an event");
}

/* The unknowns of the place, in which its columns end an event: y, or the unknowns of the map. NULL: the
 * reason is reported. */
static double *take_up_columns(kmp_forward_formulation *f, double t, double *y)
{
    if (f->options->alone)
        kmp_forward_set_columns(f, 0);
    memcpy(y + 2 * kmp_forward_blocks(f), f->place.tail, (size_t)f->integrals * sizeof *y);
    if (take_up(f, t, y) != KMP_GO)
        return NULL;
    return f->options->alone ? kmp_forward_map_unknowns(f) : y;
}

static kempe_status begin(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    kmp_partition part;
    KMP_TRY(f->begun ? check_place(f, start) : KEMPE_OK);
    const bool first = !f->begun, alone = f->options->alone;
    f->begun = true;
    f->p = start->part->p;
    f->redundant = start->part->m - start->part->r;
    KMP_TRY(kmp_made(f->system->context, make_unknowns(f) && kmp_partition_copy(&part, start->part)));
    go_by(f, start->eval);
    f->v->linear.held = true;
    f->v->linear.plain = f->count == 0;
    KMP_TRY(kmp_sensitivity_equations_take(f->v, start->t, start->q, &part));
    f->formulation.part = &f->v->linear.part;
    add_lanes(f);
    if (first)
        memcpy(f->mode, start->eval->conditions.mode, kmp_forward_mode_bytes(f));
    if (alone && first)
        KMP_TRY(kmp_made(f->system->context, kmp_forward_map_begin_start(f)));
    else if (alone)
        kmp_forward_map_go_on(f);
    const bool signals = f->resets.count > 0;
    if (kmp_forward_arrive_with_signals(f, start, first) != KMP_GO)
        return fail_with_reason(f);
    if (f->event.passing && (signals || f->event.cause >= 0 || kmp_swings_differ(f->count, f->event.swing, NULL)))
        kmp_forward_delays_note(f, start->t, f->event.swing);
    if (kmp_forward_arrive_after_event(f, start, first) != KMP_GO)
        return fail_with_reason(f);
    kmp_forward_enter_charts(f, start->q, start->qd);
    KMP_TRY(first ? kmp_forward_delays_begin(f, start->t) : KEMPE_OK);
    double *y = take_up_columns(f, start->t, f->formulation.y);
    if (!y)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "the start cannot be evaluated: its closures are singular, or a coordinate moves no mass");
    if (kmp_forward_go_on_after_event(f, start, y) != KMP_GO)
        return fail_with_reason(f);
    return !alone || kmp_forward_map_end(f, f->formulation.y) == KMP_GO ? KEMPE_OK : KEMPE_E_MEMORY;
}

static const kmp_formulation_kind varied_zone;

static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    kmp_forward_formulation *f = start->user;
    f->zone.now = kind == &varied_zone;
    f->start = *start;
    f->formulation.exchanges = 0;
    kmp_text_free(&f->formulation.reason);
    if (begin(f, start) == KEMPE_OK)
        return &f->formulation;
    release(&f->formulation);
    return NULL;
}

static const kmp_formulation_kind varied_zone = {
    .formulation = "varied", .form = "zone", .corrected = true, .create = create};
static const kmp_formulation_kind varied_formulation = {
    .formulation = "varied", .form = "newton", .corrected = true, .near_singular = &varied_zone, .create = create};

static void note_reset(void *user, int count, const bool *taken, const int *condition)
{
    kmp_forward_formulation *f = user;
    (void)count;
    kmp_forward_resets_note(&f->resets, taken, condition);
}

/* -- the run ----------------------------------------------------------------------------------------- */

bool kmp_forward_make_columns(kmp_forward_formulation *f, int most)
{
    kmp_arena *a = &f->arena;
    const int n = f->n;
    f->most = most;
    return kmp_forward_place_widen(&f->place, a, n, most) && kmp_event_times_make(&f->times, a, f->system, most) &&
           kmp_forward_event_make(&f->event, a, f->system, most) && kmp_forward_terms_make(&f->terms, a, n, most) &&
           KMP_ARENA_MAKE(a, KMP_ROOM(double, n *most, &f->dqdd), KMP_ROOM(double, f->m *most, &f->dlambda, &f->held),
                          KMP_ROOM(double, f->v->slopes->shown *most, &f->dshown));
}

static bool make_room(kmp_forward_formulation *f)
{
    kmp_arena *a = &f->arena;
    const kempe_system *s = f->system;
    const int n = f->n;
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(double, s->events.count, &f->mode), KMP_ROOM(double, 2 * n * n, &f->matrix),
                        KMP_ROOM(double, KMP_CHART_SIZE * s->chart_count, &f->own_chart),
                        KMP_ROOM(double, n, &f->zone.su, &f->zone.sud, &f->zone.ud),
                        KMP_ROOM(int, n, &f->zone.every, &f->choice.signs), KMP_ROOM(bool, n, &f->watched)))
        return false;
    for (int i = 0; i < n; i++)
        f->zone.every[i] = i;
    return kmp_forward_place_make(&f->place, a, s) && kmp_forward_resets_make(&f->resets, a, s->model) &&
           kmp_forward_changes_make(f) && kmp_forward_make_columns(f, f->v->count) && kmp_forward_delays_make(f);
}

/* Puts the start and its derivatives into the place. */
static kempe_status prepare(kmp_forward_formulation *f)
{
    kmp_sensitivity_equations *v = f->v;
    KMP_TRY(kmp_made(f->system->context, make_room(f)));
    if (f->system->rheonomic)
        KMP_TRY(kmp_system_watched_coordinates(f->system, f->watched));
    kmp_charts_reset(f->system, f->own_chart);
    kmp_charts_reset(f->system, f->place.chart);
    kmp_eval_set_charts(f->own, f->place.chart);
    kmp_eval_unfreeze(f->own); /* by the end of an earlier run, as rows that were held there */
    for (int k = 0; k < f->system->events.count; k++)
        if (f->system->events.condition[k].role != KMP_ROLE_NONE)
            kmp_eval_set_kink(f->own, k, 0);
    go_by(f, f->own);
    v->linear.plain = false;
    KMP_TRY(kmp_sensitivity_equations_start(v, f->place.q, f->place.qd, f->place.dq, f->place.dqd));
    f->p = v->linear.p;
    return KEMPE_OK;
}

/* True if the target uses coordinates of spherical joints themselves, which differ in each chart. */
static bool reads_angles(const kempe_system *s, const kmp_forward_target *target)
{
    const double *part[] = {target->q, target->qd, target->qdd};
    bool reads = false;
    for (int k = 0; k < 9 * s->chart_count; k++)
        reads = reads || (part[k % 3] && part[k % 3][s->chart_first[k / 9] + k / 3 % 3] != 0);
    return reads;
}

static kempe_status run(kmp_forward_formulation *f, kmp_forward_report *report)
{
    kmp_run_spec spec = *f->options->spec;
    kempe_status status = prepare(f);
    const kempe_assembly start = {.system = f->system, .q = f->place.q, .qd = f->place.qd, .closed = true};
    spec.kind = &varied_formulation;
    spec.user = f;
    spec.step = take_step;
    spec.slopes = true;
    spec.sample = f->resets.states > 0 ? note_reset : NULL;
    spec.own_angles = f->own_angles = f->options->integrand && reads_angles(f->system, f->options->integrand);
    if (f->options->alone)
        spec.change_points = kmp_change_points_word(KMP_CHANGE_POINTS_IGNORE);
    if (status == KEMPE_OK)
        status = kmp_run(f->system, &spec, &start, take_row, f, &report->run);
    report->integral = f->integrals && f->place.tail ? f->place.tail[0] : 0;
    report->redundant = f->redundant;
    if (report->run.reason || (status != KEMPE_E_FAILED && status != KEMPE_STOPPED))
        return status;
    report->run.reason = kmp_strdup(kempe_context_message(f->system->context));
    return report->run.reason ? status : kmp_fail_memory(f->system->context);
}

kempe_status kmp_forward_run(kmp_sensitivity_equations *varied, const kmp_forward *options, const double *sizes,
                             double *integral, kmp_forward_report *report)
{
    kmp_forward_formulation f = {.formulation = {.release = release,
                                                 .row = row,
                                                 .position = position,
                                                 .renew = renew,
                                                 .resume = resume,
                                                 .keep = keep,
                                                 .explain = explain,
                                                 .n = varied->n},
                                 .v = varied,
                                 .own = varied->linear.eval,
                                 .options = options,
                                 .system = varied->system,
                                 .sizes = sizes,
                                 .n = varied->n,
                                 .m = varied->m,
                                 .count = options->alone ? 0 : varied->count};
    f.integrals = options->integrand ? 1 + f.count : 0;
    *report = (kmp_forward_report){0};
    kempe_status status = run(&f, report);
    for (int k = 0; integral && f.integrals && f.place.tail && k < f.count; k++)
        integral[k] = f.place.tail[1 + k];
    kmp_text_free(&f.formulation.reason);
    kmp_forward_delays_free(&f);
    kmp_arena_free(&f.arena);
    varied->linear.plain = false;
    varied->columns = varied->count;
    varied->held = NULL;
    return status;
}
