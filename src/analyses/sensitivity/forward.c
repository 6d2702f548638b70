/* SPDX-License-Identifier: BSD-3-Clause */
/* The formulation of a motion with sensitivities (forward.h): its unknowns and their ODE, its changes between steps,
 * its creation, its rows and its run. Delayed signals are in forward_delays.c. */
#include "analyses/sensitivity/forward.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_delays.h"
#include "analyses/sensitivity/forward_inside.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/decide/run_start.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/friction/friction_inside.h"
#include "model/data/model.h"
#include "model/data/run_settings.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

/* A run takes next values once more than it has states at a time, and twice at its start. */
static int most_resets(const kmp_forward_formulation *f)
{
    return f->samples + 4;
}

/* The coordinates that are unknowns. */
static const int *unknowns(const kmp_forward_formulation *f)
{
    return f->zone ? f->every : f->v->linear.part.u;
}

static size_t chart_bytes(const kmp_forward_formulation *f)
{
    return (size_t)(KMP_CHART_SIZE * f->system->chart_count) * sizeof(double);
}

static size_t mode_bytes(const kmp_forward_formulation *f)
{
    return (size_t)f->system->events.count * sizeof(double);
}

/* True if condition k differs there. The branch of a kink is none: nothing jumps with it. */
static bool mode_differs(const kmp_forward_formulation *f, int k, const double *mode)
{
    return !f->system->events.condition[k].kink && (f->mode[k] != 0) != (mode[k] != 0);
}

/* The first condition that differs there; -1: none. */
static int first_other(const kmp_forward_formulation *f, const double *mode)
{
    for (int k = 0; k < f->system->events.count; k++)
        if (mode_differs(f, k, mode))
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
/* Finer tolerances are impossible near a singular position. */
#define ZONE_RTOL 1e-9

/* The rows of u among the unknowns from `block` on; `room`: for p. */
static const double *rows_of(const kmp_forward_formulation *f, const double *block, double *room)
{
    if (!f->zone)
        return block;
    for (int i = 0; i < f->p; i++)
        room[i] = block[f->v->linear.part.u[i]];
    return room;
}

static const double *position_of(const kmp_forward_formulation *f, const double *y, int k)
{
    return rows_of(f, y + (k + 1) * f->width, f->su);
}

static const double *rate_of(const kmp_forward_formulation *f, const double *y, int k)
{
    return rows_of(f, y + kmp_forward_blocks(f) + (k + 1) * f->width, f->sud);
}

/* Takes the state at (t, y), with the data of small changes unless linear.plain. KMP_GO or KMP_RETRY. */
static int come_to(kmp_forward_formulation *f, double t, const double *y)
{
    const double *ud = rows_of(f, y + kmp_forward_blocks(f), f->ud);
    f->in_lanes = false;
    return f->zone ? kmp_sensitivity_equations_near(f->v, t, y, ud) : kmp_sensitivity_equations_at(f->v, t, y, ud);
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
        dy[half + i] = v->linear.qdd[unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        const double *su = position_of(f, y, k), *sud = rate_of(f, y, k);
        if (f->zone)
            kmp_sensitivity_equations_follow(v, k, su, sud, NULL, NULL, dy + half + (k + 1) * w, NULL);
        else
            kmp_sensitivity_equations_accelerate(v, k, su, sud, dy + half + (k + 1) * w);
        kmp_forward_delays_rates(f, y, k, dy + half + (k + 1) * w);
    }
    const kmp_forward_target *target = f->options->integrand;
    if (f->integrals) {
        f->t = NAN; /* the place is lost below */
        dy[2 * half] = kmp_target_value(target, v);
    }
    for (int k = 0; f->integrals && k < f->count; k++) {
        kmp_forward_follow(f, y, k, f->dq, f->dqd, f->dqdd, f->dlambda);
        if (target->shown)
            kmp_slopes_along(v->slopes, &v->slopes->outputs,
                             &(kmp_direction){NULL, f->dq, f->dqd, f->dqdd, f->dlambda, NULL}, k, v->shown);
        const kmp_sensitivity_equations_row along = {
            .q = f->dq, .qd = f->dqd, .qdd = f->dqdd, .lambda = f->dlambda, .shown = v->shown};
        dy[2 * half + 1 + k] = kmp_target_of_row(target, v, &along);
    }
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    kmp_forward_formulation *f = self;
    if (come_to(f, t, y) != KMP_GO)
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
    int said = come_to(f, t, y);
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
    if (!f->start.lanes || f->zone || f->integrals || !f->options->lanes ||
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
    int said = come_to(f, t, y);
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

/* -- the place --------------------------------------------------------------------------------------- */

int kmp_forward_stand_at(kmp_forward_formulation *f, double t, const double *y, bool whole)
{
    kmp_linear *l = &f->v->linear;
    l->plain = f->count == 0 || !whole;
    int said = come_to(f, t, y);
    l->plain = f->count == 0;
    if (said != KMP_GO && f->formulation.reason.length == 0)
        kmp_text_printf(&f->formulation.reason, "the loops do not close at t = %.9g", t);
    return said == KMP_GO ? KMP_GO : KMP_HALT;
}

/* y, except integrals, from the place. */
static void pack(kmp_forward_formulation *f, double *y)
{
    const int *of = unknowns(f);
    int half = kmp_forward_blocks(f), w = f->width;
    for (int i = 0; i < w; i++) {
        y[i] = f->q[of[i]];
        y[half + i] = f->qd[of[i]];
        for (int k = 0; k < f->count; k++) {
            y[(k + 1) * w + i] = f->dq[k * f->n + of[i]];
            y[half + (k + 1) * w + i] = f->dqd[k * f->n + of[i]];
        }
    }
}

/* Stores signs of Jv's blocks, predictions and conditions of the last state; checks that u is still well conditioned.
 */
static void settle(kmp_forward_formulation *f)
{
    kmp_linear *l = &f->v->linear;
    int row, column;
    memcpy(f->mode, l->eval->mode, mode_bytes(f));
    if (f->in_lanes)
        kmp_varied_lanes_anchor(f->options->lanes, KMP_STAGE_LANES - 1);
    else
        kmp_sensitivity_equations_anchor(f->v);
    f->crossed = false;
    if (l->red.r == 0)
        return;
    kmp_block_take_signs(l->red.block, f->signs);
    f->growth = kmp_reduction_growth(&l->red, &row, &column);
    f->due = !f->start.fixed && !f->zone && f->growth > KMP_EXCHANGE_VARIED;
}

/* Continues from the place at t with other unknowns: y, weights and the state. Columns that only pass an event are not
 * integrated. */
static int take_up(kmp_forward_formulation *f, double t, double *y)
{
    pack(f, y);
    const int w = f->width, count = f->options->alone ? 0 : f->count, half = w * (1 + count);
    double *atol = f->formulation.atol;
    for (int b = 0; b <= count; b++)
        for (int i = 0; i < w; i++) {
            int k = unknowns(f)[i];
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
    else if (come_to(f, t, y) != KMP_GO)
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
    if (f->zone) {
        put_closed(f, y);
        kmp_sensitivity_equations_anchor(f->v);
        return KMP_GO;
    }
    if (l->red.r > 0) {
        kmp_block_take_signs(l->red.block, f->signs_now);
        size_t count = (size_t)kmp_block_count(l->red.block);
        bool crosses = memcmp(f->signs, f->signs_now, count * sizeof *f->signs) != 0;
        f->crossed = f->crossed || crosses;
        if (crosses || kmp_sensitivity_equations_miss(f->v, y) > FARTHEST)
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
    if (f->zone || f->crossed ||
        (f->growth < KMP_GROWTH_EXPLAINS &&
         kmp_rank_margin_at(f->start.margin, kmp_forward_eval(f)) < KMP_MARGIN_EXPLAINS))
        say_change_point(f, t);
    else if (f->growth >= KMP_GROWTH_EXPLAINS)
        kmp_text_printf(&formulation->reason,
                        "the independent coordinates reach a dead centre at t = %.9g: |dv/du| has grown to %.3g", t,
                        f->growth);
}

/* -- construction ------------------------------------------------------------------------------------ */

/* Makes y, weights and the ODE of the formulation for the current p or n unknowns. False: no memory. */
static bool make_unknowns(kmp_forward_formulation *f)
{
    kmp_formulation *formulation = &f->formulation;
    f->width = f->zone ? f->n : f->p;
    formulation->rtol = f->zone ? fmax(f->start.rtol, ZONE_RTOL) : 0;
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

/* An event whose condition changes no faster than this part of its usual rate is touched, not passed. */
#define GRAZING 1e-9
/* -- changes between steps --------------------------------------------------------------------------- */

/* Other independent coordinates, conditions that change, spherical joints that are centred. The eval is the runner's:
 * at a new start its conditions and charts show the changes since the last one. */

/* Puts the whole mechanism at (t, y) into the place. */
static int spread(kmp_forward_formulation *f, double t, const double *y)
{
    kmp_sensitivity_equations *v = f->v;
    if (kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    f->t = t;
    memcpy(f->q, v->linear.q, (size_t)f->n * sizeof *f->q);
    memcpy(f->qd, v->linear.qd, (size_t)f->n * sizeof *f->qd);
    memcpy(f->chart, v->linear.eval->chart, chart_bytes(f));
    for (int k = 0; k < f->count; k++)
        kmp_forward_follow(f, y, k, f->dq + k * f->n, f->dqd + k * f->n, NULL, NULL);
    return KMP_GO;
}

/* Converts the place to the evaluator's charts, in which it is (q, qd). */
static void enter_charts(kmp_forward_formulation *f, const double *q, const double *qd)
{
    const kmp_chart_motion from = {f->chart, f->q, f->qd, NULL}, to = {kmp_forward_eval(f)->chart, q, qd, NULL};
    for (int c = 0; c < f->system->chart_count; c++)
        for (int k = 0; k < f->count && memcmp(from.chart + KMP_CHART_SIZE * c, to.chart + KMP_CHART_SIZE * c,
                                               KMP_CHART_SIZE * sizeof(double)) != 0;
             k++)
            kmp_chart_carry(f->system, c, &from, &to, f->dq + k * f->n, f->dqd + k * f->n, NULL);
    memcpy(f->chart, to.chart, chart_bytes(f));
    memcpy(f->q, q, (size_t)f->n * sizeof *q);
    memcpy(f->qd, qd, (size_t)f->n * sizeof *qd);
}

static bool charts_differ(const kmp_forward_formulation *f, const double *chart)
{
    return memcmp(chart, kmp_forward_eval(f)->chart, chart_bytes(f)) != 0;
}

/* -- other coordinates ------------------------------------------------------------------------------- */

/* Chooses other independent coordinates at the place, in the evaluator's state: as many, again. */
static int choose_anew(kmp_forward_formulation *f, double *y)
{
    kmp_linear *l = &f->v->linear;
    kmp_partition part;
    kempe_status status = kmp_partition_of_rank(&part, f->system, l->eval->jacobian, l->part.r, NULL, 0);
    if (status != KEMPE_OK || kmp_sensitivity_equations_take(f->v, f->t, f->q, &part) != KEMPE_OK)
        return KMP_HALT;
    if (take_up(f, f->t, y) != KMP_GO)
        return KMP_HALT;
    f->due = false; /* there is no better choice */
    return KMP_GO;
}

static int renew(kmp_formulation *formulation, double t, double *y, double *yp)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    (void)yp;
    if (!f->due)
        return KMP_GO;
    double *all = f->options->alone ? kmp_forward_map_begin(f, t, y) : y;
    if (!all || spread(f, t, all) != KMP_GO)
        return KMP_HALT;
    memcpy(f->old_u, f->v->linear.part.u, (size_t)f->p * sizeof *f->old_u);
    if (choose_anew(f, all) != KMP_GO || (all != y && kmp_forward_map_end(f, y) != KMP_GO))
        return KMP_HALT;
    formulation->exchanges += memcmp(f->old_u, f->v->linear.part.u, (size_t)f->p * sizeof *f->old_u) != 0;
    return KMP_CHANGED;
}

/* -- conditions -------------------------------------------------------------------------------------- */

static void set_modes(const kmp_forward_formulation *f, const double *mode)
{
    if (memcmp(kmp_forward_eval(f)->mode, mode, mode_bytes(f)) != 0)
        kmp_eval_set_modes(kmp_forward_eval(f), mode);
}

/* The derivative of condition k along a direction, with parameter i (negative: none). */
static double along(kmp_forward_formulation *f, int k, const kmp_direction *direction, int i)
{
    kmp_slopes_along(f->v->slopes, &f->v->slopes->events, direction, i, f->along);
    return f->along[k];
}

/* dt_e/dp of condition k at the place, which is the last state, with unknowns y. False: the condition is touched, not
 * passed. */
static bool find_swing(kmp_forward_formulation *f, int k, const double *y)
{
    kmp_sensitivity_equations *v = f->v;
    kmp_linear *l = &v->linear;
    const bool late = kmp_slopes_event_is_late(v->slopes, k);
    const int n = f->n;
    double one = 1;
    kmp_instant at = kmp_linear_instant(&v->linear);
    const double value = kmp_slopes_values(&v->slopes->events, &at)[k];
    if (late)
        kmp_sensitivity_equations_rates(v, f->jerk, f->lambda_rate);
    const double by_place = along(f, k, &(kmp_direction){.t = &one, .q = l->qd}, -1);
    const double by_rates = along(f, k, &(kmp_direction){.qd = l->qdd}, -1);
    const double by_loads = late ? along(f, k, &(kmp_direction){.qdd = f->jerk, .lambda = f->lambda_rate}, -1) : 0;
    const double rate = by_place + by_rates + by_loads;
    f->distance = fabs(value / rate);
    for (int i = 0; i < f->count; i++) {
        kmp_direction direction = {.q = f->dq + i * n, .qd = f->dqd + i * n};
        if (late) {
            direction.qdd = f->dqdd;
            direction.lambda = f->dlambda;
            kmp_forward_follow(f, y, i, NULL, NULL, f->dqdd, f->dlambda);
        }
        f->swing[i] = -along(f, k, &direction, i) / rate;
    }
    return fabs(rate) > GRAZING * (fabs(by_place) + fabs(by_rates) + fabs(by_loads));
}

int kmp_forward_halt(kmp_forward_formulation *f, const char *format, ...)
{
    KMP_TEXT_ARGUMENTS(&f->formulation.reason, format);
    if (f->options->alone)
        kmp_text_put(&f->formulation.reason,
                     "; the adjoint method needs derivatives with respect to each part of the state, too: the forward "
                     "method may have those with respect to parameters");
    return KMP_HALT;
}

/* The same where a sample and an event have one time, of which only the time of the sample is the same for all
 * parameters.
 */
static int halt_at_event(kmp_forward_formulation *f, int sample, double t)
{
    const kempe_model *model = f->system->model;
    return kmp_forward_halt(
        f,
        "the state '%s' changes at t = %.9g together with an event whose time depends on parameters: the motion "
        "has no derivative with respect to them there",
        model->states[kmp_state_of_sample(model, sample)].name, t);
}

/* Events of one time have derivatives that are equal up to rounding. */
#define SAME_SWING 1e-6

bool kmp_forward_same_swing(int count, const double *a, const double *b)
{
    for (int i = 0; i < count; i++)
        if (fabs(a[i] - b[i]) > SAME_SWING * fmax(fabs(a[i]), fabs(b[i])))
            return false;
    return true;
}

/* NULL is zero. */
static bool are_different(const kmp_forward_formulation *f, const double *a, const double *b)
{
    for (int i = 0; !(a && b) && i < f->count; i++)
        if ((a && a[i] != 0) || (b && b[i] != 0))
            return true;
    return a && b && !kmp_forward_same_swing(f->count, a, b);
}

static double integrand_here(kmp_forward_formulation *f)
{
    return f->integrals ? kmp_target_value(f->options->integrand, f->v) : 0;
}

/* Adds the jump: the values before less those after, times dt_e/dp. */
static void jump(kmp_forward_formulation *f, double integrand_before, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int half = kmp_forward_blocks(f);
    double integrand = integrand_before - integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] -= l->qdd[unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        for (int i = 0; i < f->width; i++)
            y[half + (k + 1) * f->width + i] += f->before[i] * f->swing[k];
        if (f->integrals)
            y[2 * half + 1 + k] += integrand * f->swing[k];
    }
}

/* The conditions that change at t, to `mode`, do so at times with the derivatives f->swing, by condition k. */
static void note_swings(kmp_forward_formulation *f, const double *mode, double t, int k)
{
    for (int i = 0; i < f->system->events.count; i++)
        if ((mode[i] != 0) != (kmp_forward_eval(f)->mode[i] != 0)) { /* also of kinks, where nothing jumps */
            memcpy(f->swings + (ptrdiff_t)i * f->most, f->swing, (size_t)f->count * sizeof *f->swing);
            f->swung_t[i] = t;
            f->swung_by[i] = k;
        }
}

/* True if the value of an input jumps at t, where its present piece begins. */
static bool input_jumps(const kmp_forward_formulation *f, double t)
{
    const kmp_present_inputs *inputs = &kmp_forward_eval(f)->inputs;
    bool jumps = false;
    for (int i = 0; i < inputs->count; i++)
        jumps = jumps || (kmp_same_time(inputs->piece[i].from, t) && inputs->piece[i].jump == 0);
    return jumps;
}

/* True if the motion itself crosses condition k where an input jumps, at a time that depends on parameters. */
static bool coincides(kmp_forward_formulation *f, int k, double t, const double *y)
{
    return find_swing(f, k, y) && f->distance * f->start.rate_scale <= KMP_SLOPE_JUMPED && f->swung_t[k] != t &&
           are_different(f, f->swing, NULL);
}

static int halt_at_input(kmp_forward_formulation *f, int k, double t)
{
    return kmp_forward_halt(f,
                            "an input jumps at t = %.9g together with the condition %s, whose time depends on "
                            "parameters: the motion has no derivative with respect to them there",
                            t, f->system->event_text[k]);
}

/* Changes condition k, and the others according to `mode`. A jump of an input does so at a time that depends on no
 * parameter. */
static int pass(kmp_forward_formulation *f, int k, const double *mode, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    const bool given = input_jumps(f, t);
    if (spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    if (given && coincides(f, k, t, y))
        return halt_at_input(f, k, t);
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    if (!given && !find_swing(f, k, y))
        return kmp_forward_halt(
            f,
            "the condition %s is touched at t = %.9g without crossing: the motion has no derivative with "
            "respect to parameters there",
            f->system->event_text[k], t);
    if (kmp_same_time(f->sampled_t, t) && are_different(f, f->swing, NULL))
        return halt_at_event(f, f->sampled, t);
    note_swings(f, mode, t, given ? -1 : k);
    kmp_forward_delays_note(f, t, f->swing);
    memcpy(f->mode, l->eval->mode, mode_bytes(f));
    double integrand = integrand_here(f);
    for (int i = 0; i < f->width; i++)
        f->before[i] = l->qdd[unknowns(f)[i]];
    set_modes(f, mode);
    if (come_to(f, t, y) != KMP_GO)
        return kmp_forward_halt(f, "the motion cannot continue after the condition %s at t = %.9g",
                                f->system->event_text[k], t);
    jump(f, integrand, y);
    f->t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* Conditions have changed since the last start: passes the ones that the motion itself has changed one after the other,
 * the last of them with all dependent ones. */
static int pass_conditions(kmp_forward_formulation *f, double t, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int count = f->system->events.count, last = -1, said = KMP_GO;
    memcpy(f->new_mode, l->eval->mode, mode_bytes(f));
    memcpy(f->next_mode, f->mode, mode_bytes(f));
    set_modes(f, f->mode);
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_eval_all_changes(l->eval, t, l->q, l->qd, l->qdd, l->lambda, f->changes);
    for (int k = 0; k < count; k++) {
        bool changes = mode_differs(f, k, f->new_mode);
        f->cause[k] = changes && (f->changes[k] < 0) != (f->mode[k] != 0);
        last = f->cause[k] || (changes && last < 0) ? k : last;
    }
    f->cause[last] = true;
    for (int k = 0; said == KMP_GO && k <= last; k++)
        if (f->cause[k]) {
            f->next_mode[k] = f->new_mode[k];
            said = pass(f, k, k == last ? f->new_mode : f->next_mode, t, y);
        }
    return said;
}

/* -- next values of states ------------------------------------------------------------------------------ */

static bool has_passed(const kmp_forward_formulation *f, int condition, double t)
{
    return kmp_same_time(f->swung_t[condition], t);
}

/* The condition at whose time state `sample` changes; -1: a time that depends on no parameter. A change that has not
 * passed as an event is one that an input or a sample has made. */
static int cause_of(const kmp_forward_formulation *f, int sample, double t)
{
    int k = f->cause_of[sample];
    return k >= 0 && has_passed(f, k, t) ? f->swung_by[k] : -1;
}

/* dt_e/dp of a condition that has passed; NULL: zero. */
static const double *swing_of(const kmp_forward_formulation *f, int condition)
{
    return condition < 0 ? NULL : f->swings + (ptrdiff_t)condition * f->most;
}

/* True if the time of a condition that has passed depends on no parameter. */
static bool is_still(const kmp_forward_formulation *f, int condition)
{
    const double *swing = swing_of(f, condition);
    for (int i = 0; swing && i < f->count; i++)
        if (swing[i] != 0)
            return false;
    return true;
}

/* An event of the motion at t, with or without a state, whose time depends on parameters as `swing` does not. */
static bool any_other(const kmp_forward_formulation *f, const double *swing, double t)
{
    for (int k = 0; k < f->system->events.count; k++)
        if (has_passed(f, k, t) && !is_still(f, f->swung_by[k]) && are_different(f, swing, swing_of(f, f->swung_by[k])))
            return true;
    return false;
}

/* f->swing for the first time that is noted, which those after it follow from; `jump`: of delayed signals that jump,
 * NULL without any. */
static int find_reset_swing(kmp_forward_formulation *f, const double *jump, double t)
{
    const double *common = jump;
    bool any = jump;
    f->reset_cause = -1;
    if (f->follows && f->options->alone)
        return kmp_forward_halt(f,
                                "a state changes at t = %.9g s within rounding of an event before: the adjoint method "
                                "does not support this, the forward method does",
                                t);
    if (f->missed)
        return kmp_forward_halt(f, "states change too often at t = %.9g: derivatives end there", t);
    for (int k = 0; f->resets > 0 && k < f->samples; k++) {
        if (!f->taken[k])
            continue;
        /* dt/dp of the change, zero where it is NULL. Delayed signals that jump change conditions with them. */
        const int cause = cause_of(f, k, t);
        const double *swing = cause < 0 && f->cause_of[k] >= 0 ? jump : swing_of(f, cause);
        if ((any && are_different(f, common, swing)) || any_other(f, swing, t))
            return halt_at_event(f, k, t);
        f->reset_cause = any ? f->reset_cause : cause;
        common = any ? common : swing;
        any = true;
    }
    if (jump && any_other(f, jump, t))
        return kmp_forward_halt(
            f,
            "a delayed signal jumps at t = %.9g together with an event: the motion has no derivative with "
            "respect to parameters there",
            t);
    if (f->resets > 0 && !common) {
        f->sampled_t = t;
        for (int k = 0; k < f->samples; k++)
            f->sampled = f->taken[k] ? k : f->sampled;
    }
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    if (common)
        memcpy(f->swing, common, (size_t)f->count * sizeof *f->swing);
    return KMP_GO;
}

/* Maps the place, whose derivatives are those along the event, by the next values noted at each time. */
static void take_all_next(kmp_forward_formulation *f, double t)
{
    kmp_sensitivity_equations *v = f->v;
    const kmp_linear *l = &v->linear;
    const kempe_model *model = f->system->model;
    const int first = kmp_model_coordinates(model);
    for (int r = 0; r < f->resets; r++) {
        const bool *taken = f->taken + (ptrdiff_t)r * f->samples;
        const kmp_instant at = kmp_instant_of(l->eval, t, f->q, f->qd, l->qdd, l->lambda);
        const double *value = kmp_slopes_values(&v->slopes->samples, &at);
        for (int i = 0; i < f->count; i++) {
            double *dqd = f->dqd + (ptrdiff_t)i * f->n;
            const kmp_direction along = {.t = &f->swing[i], .q = f->dq + (ptrdiff_t)i * f->n, .qd = dqd};
            kmp_slopes_along(v->slopes, &v->slopes->samples, &along, i, f->next);
            for (int k = 0; k < f->samples; k++)
                if (taken[k])
                    dqd[first + kmp_state_of_sample(model, k)] = f->next[k];
        }
        for (int k = 0; k < f->samples; k++)
            if (taken[k])
                f->qd[first + kmp_state_of_sample(model, k)] = value[k];
    }
    f->resets = 0;
}

/* Adds the rate and the acceleration of coordinate i, times `swing`, to its derivatives by parameter k, and the sizes
 * of these terms to the sums of sizes, at least by their rounding. */
static void add_term(kmp_forward_formulation *f, int k, int i, double rate, double acceleration, double swing)
{
    const int at = k * f->n + i;
    const double usual = f->start.rate_scale * f->system->scale[i] * KMP_IMPACT_RATES / KMP_SLOPE_LOOSE;
    f->dq[at] += rate * swing;
    f->dqd[at] += acceleration * swing;
    f->span[at] += (fabs(rate) + usual) * fabs(swing);
    f->speed[at] += (fabs(acceleration) + usual * f->start.rate_scale) * fabs(swing);
}

/* Adds the rates of the place, and these accelerations, times f->swing to its derivatives. */
static void go_along(kmp_forward_formulation *f, const double *qdd)
{
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n && f->swing[k] != 0; i++)
            add_term(f, k, i, f->qd[i], qdd[i], f->swing[k]);
}

/* Next values and delayed signals that jump take part in the event of the run, before which the place is: they have its
 * time. */
static int join_event(kmp_forward_formulation *f, double t, bool jumps)
{
    const bool moves = are_different(f, f->swing, NULL);
    if (f->cause_before >= 0 ? are_different(f, f->swing, f->common) : are_different(f, f->common, NULL)) {
        for (int k = 0; k < f->samples && f->resets > 0 && !jumps; k++)
            if (f->taken[k])
                return halt_at_event(f, k, t);
        return kmp_forward_halt(
            f,
            "a delayed signal jumps at t = %.9g together with an event: the motion has no derivative with "
            "respect to parameters there",
            t);
    }
    if (f->cause_before < 0 && moves) {
        go_along(f, f->qdd_before);
        f->cause_before = f->reset_cause;
    }
    memcpy(f->common, f->swing, (size_t)f->count * sizeof *f->swing);
    return KMP_GO;
}

/* Derivatives of the place across next values of states that the run has noted (kmp_sample_fn), and across delayed
 * signals that jump (`jump`: dt/dp there; `qd`: the rates behind it, NULL at the start of the run). The place is before
 * an event of the run, or at a time that depends on no parameter. */
static int reset_place(kmp_forward_formulation *f, double t, const double *jump, const double *qd)
{
    kmp_evaluator *eval = kmp_forward_eval(f);
    if (find_reset_swing(f, jump, t) != KMP_GO || (f->passing && join_event(f, t, jump != NULL) != KMP_GO))
        return KMP_HALT;
    if (!f->passing && are_different(f, f->swing, NULL))
        return kmp_forward_halt(
            f, "a state changes at t = %.9g s, where the equations are derived again: derivatives end there", t);
    memcpy(f->new_chart, eval->chart, chart_bytes(f));
    memcpy(f->new_mode, eval->mode, mode_bytes(f));
    kmp_eval_set_charts(eval, f->chart);
    set_modes(f, f->mode);
    if (qd)
        kmp_forward_delays_pass(f, t, qd);
    take_all_next(f, t);
    set_modes(f, f->new_mode);
    kmp_eval_set_charts(eval, f->new_chart);
    return KMP_GO;
}

/* States have taken next values since the last start, or delayed signals jump (`jump`: dt/dp there, of a state with
 * rates qd), and conditions have changed with them. */
static int pass_resets(kmp_forward_formulation *f, double t, const double *jump, const double *qd, double *y)
{
    memcpy(f->new_mode, kmp_forward_eval(f)->mode, mode_bytes(f));
    set_modes(f, f->mode);
    if (find_reset_swing(f, jump, t) != KMP_GO || spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    double integrand = integrand_here(f);
    /* Adds the rates of the last state times dt_e/dp to the place. */
    const kmp_linear *l = &f->v->linear;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n && f->swing[k] != 0; i++) {
            f->dq[k * f->n + i] += l->qd[i] * f->swing[k];
            f->dqd[k * f->n + i] += l->qdd[i] * f->swing[k];
        }
    kmp_forward_delays_pass(f, t, qd);
    take_all_next(f, t);
    kmp_forward_delays_note(f, t, f->swing);
    pack(f, y);
    set_modes(f, f->new_mode);
    memcpy(f->mode, f->new_mode, mode_bytes(f));
    if (kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    /* Takes the rates of the last state times dt_e/dp from the unknowns. */
    int half = kmp_forward_blocks(f), w = f->width;
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < w && f->swing[k] != 0; i++) {
            y[(k + 1) * w + i] -= l->qd[unknowns(f)[i]] * f->swing[k];
            y[half + (k + 1) * w + i] -= l->qdd[unknowns(f)[i]] * f->swing[k];
        }
    for (int k = 0; f->integrals && k < f->count; k++)
        if (f->swing[k] != 0)
            y[2 * half + 1 + k] += (integrand - integrand_here(f)) * f->swing[k];
    f->t = NAN; /* the place is the one before the change */
    return KMP_GO;
}

/* -- charts ------------------------------------------------------------------------------------------ */

/* Joints have been centred: converts the place from the charts before to (q, qd) in the current ones. */
static int pass_charts(kmp_forward_formulation *f, double t, const double *q, const double *qd, double *y)
{
    memcpy(f->new_chart, kmp_forward_eval(f)->chart, chart_bytes(f));
    kmp_eval_set_charts(kmp_forward_eval(f), f->chart);
    if (spread(f, t, y) != KMP_GO)
        return KMP_HALT;
    kmp_eval_set_charts(kmp_forward_eval(f), f->new_chart);
    enter_charts(f, q, qd);
    kmp_eval_closure(kmp_forward_eval(f), t, q);
    if (!f->start.fixed && !f->zone)
        return choose_anew(f, y);
    pack(f, y);
    return KMP_GO;
}

/* Passes what has changed: next values of states, delayed signals (`jump`), conditions, charts. */
static int pass_changes(kmp_forward_formulation *f, double t, const double *q, const double *qd, const double *jump,
                        double *y)
{
    if ((f->resets > 0 || jump) && pass_resets(f, t, jump, qd, y) != KMP_GO)
        return KMP_HALT;
    if (first_other(f, kmp_forward_eval(f)->mode) >= 0 && pass_conditions(f, t, y) != KMP_GO)
        return KMP_HALT;
    return charts_differ(f, f->chart) ? pass_charts(f, t, q, qd, y) : KMP_GO;
}

static int resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const double *jump;
    (void)yp;
    if (kmp_forward_delays_jump(f, t, &jump) != KMP_GO)
        return KMP_HALT;
    const bool changes = f->resets > 0 || jump || charts_differ(f, f->chart) ||
                         memcmp(f->mode, kmp_forward_eval(f)->mode, mode_bytes(f)) != 0;
    double *all = changes && f->options->alone ? kmp_forward_map_begin(f, t, y) : y;
    if (!all || pass_changes(f, t, q, qd, jump, all) != KMP_GO)
        return KMP_HALT;
    const int half = kmp_forward_blocks(f);
    for (int i = 0; i < f->width; i++) {
        all[i] = q[unknowns(f)[i]];
        all[half + i] = qd[unknowns(f)[i]];
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
    kmp_linear_tell_tables(l);
    const double *shown = target->shown ? kmp_slopes_values(&varied->slopes->outputs, &at) : NULL;
    const kmp_sensitivity_equations_row here = {
        .q = l->q, .qd = l->qd, .qdd = l->qdd, .lambda = l->lambda, .shown = shown};
    return kmp_target_of_row(target, varied, &here);
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void position(kmp_formulation *formulation, double t, const double *y, double *q)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    if (f->zone)
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
    int said =
        qd || f->zone ? kmp_forward_stand_at(f, t, y, qdd != NULL) : kmp_sensitivity_equations_position(f->v, t, y, q);
    if (said != KMP_GO) {
        if (formulation->reason.length == 0)
            kmp_text_printf(&formulation->reason, "the loops cannot be closed at the output time t = %.9g s", t);
        return KMP_HALT;
    }
    if (!qd && !f->zone)
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
    const kmp_chart_motion own = {f->new_chart, q, qd, qdd};
    (void)work;
    if (!f->options->watch.row)
        return 0;
    const kmp_instant at = kmp_linear_instant(&v->linear);
    kmp_linear_tell_tables(&v->linear);
    const double *shown = kmp_slopes_values(&v->slopes->outputs, &at);
    kmp_charts_reset(f->system, f->new_chart);
    f->t = NAN; /* the place is lost */
    for (int k = 0; k < f->count; k++) {
        /* The derivatives of the last whole row by parameter k: outputs in the current charts, and the user's
         * coordinates. */
        const kmp_linear *l = &v->linear;
        const kmp_chart_motion inner = {l->eval->chart, l->q, l->qd, l->qdd};
        double *dq = f->dq + k * f->n, *dqd = f->dqd + k * f->n, *dqdd = f->dqdd + k * f->n;
        double *dlambda = f->dlambda + k * f->m;
        kmp_forward_follow(f, f->row_y, k, dq, dqd, dqdd, dlambda);
        if (v->slopes->shown > 0)
            kmp_slopes_along(v->slopes, &v->slopes->outputs, &(kmp_direction){NULL, dq, dqd, dqdd, dlambda, NULL}, k,
                             f->dshown + k * v->slopes->shown);
        for (int c = 0; c < f->system->chart_count; c++)
            if (!kmp_chart_is_own(inner.chart, c))
                kmp_chart_carry(f->system, c, &inner, &own, dq, dqd, dqdd);
    }
    const kmp_sensitivity_equations_row row_of = {t,     q,      qd,      qdd,        lambda,   shown,
                                                  f->dq, f->dqd, f->dqdd, f->dlambda, f->dshown};
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
        memcpy(f->tail, y + 2 * kmp_forward_blocks(f), (size_t)f->integrals * sizeof *y);
    f->mapped = f->mapped && !(to > from);
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
            kmp_eval_set_mode(f->own, k, eval->mode[k] != 0);
        else
            kmp_eval_set_kink(f->own, k, eval->mode[k]);
    go_by(f, f->own);
}

/* True if friction or a contact is at rest by the rows of others: its force is constant, and belongs to the values of
 * the parameters. */
static bool shares_load(const kmp_friction_run *friction)
{
    bool shares = false;
    for (int i = 0; friction && i < friction->count; i++)
        shares = shares || friction->element[i].was == KMP_FRICTION_CARRIED;
    return shares;
}

/* True if the condition of the last swing has not been crossed by the motion at t, but has jumped with the rates or
 * with a state at the event before, which has the same time. */
static bool has_jumped(const kmp_forward_formulation *f, double t)
{
    return f->last_t == t && f->distance * f->start.rate_scale > KMP_SLOPE_JUMPED;
}

/* dt_e/dp of the event that the run passes, whose conditions have one time: f->common. */
static int find_common_swing(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_passed_event *event = f->start.passed;
    const bool given = input_jumps(f, t);
    int cause = -1;
    for (int k = 0; k < f->system->events.count; k++) {
        const kmp_condition *condition = &f->system->events.condition[k];
        f->near[k] = given && !condition->kink && condition->role == KMP_ROLE_NONE && coincides(f, k, t, y);
    }
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    for (int k = 0; k < f->system->events.count && !given; k++) {
        if (!event->caused[k] || f->system->events.condition[k].kink)
            continue;
        const bool crossed = find_swing(f, k, y);
        if (has_jumped(f, t))
            memcpy(f->swing, f->last, (size_t)f->count * sizeof *f->swing);
        else if (!crossed)
            return kmp_forward_halt(f,
                                    "the condition %s is touched at t = %.9g without crossing: the motion has no "
                                    "derivative with respect to parameters there",
                                    f->system->event_text[k], t);
        if (f->system->events.condition[k].role == KMP_ROLE_HELD && shares_load(event->friction))
            return kmp_forward_halt(
                f,
                "%s lets go at t = %.9g s, where rows that depend on each other share its load: the "
                "motion has no derivative with respect to parameters there",
                f->system->event_text[k], t);
        if (cause >= 0 && !kmp_forward_same_swing(f->count, f->swing, f->common))
            return kmp_forward_halt(f,
                                    "the conditions %s and %s change together at t = %.9g, at times that depend on "
                                    "parameters in different ways: the motion has no derivative there",
                                    f->system->event_text[cause], f->system->event_text[k], t);
        cause = k;
        memcpy(f->common, f->swing, (size_t)f->count * sizeof *f->swing);
    }
    memcpy(f->common, f->swing, (size_t)f->count * sizeof *f->swing);
    f->cause_before = cause;
    return kmp_same_time(f->sampled_t, t) && are_different(f, f->swing, NULL) ? halt_at_event(f, f->sampled, t)
                                                                              : KMP_GO;
}

/* The size of the quantity by which column k differentiates. */
static double size_of(const kmp_forward_formulation *f, int k)
{
    return f->column_size && k >= f->v->count ? f->column_size[k] : f->sizes[k];
}

/* Begins the sums of sizes with the derivatives, and with rounding of coordinates. */
static void begin_terms(kmp_forward_formulation *f)
{
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n; i++) {
            const int at = k * f->n + i;
            const double rounding = KMP_SLOPE_ROUNDED / KMP_SLOPE_LOOSE * f->system->scale[i] / size_of(f, k);
            f->span[at] = fabs(f->dq[at]) + rounding;
            f->speed[at] = fabs(f->dqd[at]) + rounding * f->start.rate_scale;
        }
}

/* Keeps the place before an event of the run that changes rows or rates, with the derivatives of the last state at
 * t_e(p), along the event. */
static int leave_at_event(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_linear *l = &f->v->linear;
    if (spread(f, t, y) != KMP_GO || find_common_swing(f, t, y) != KMP_GO)
        return KMP_HALT;
    f->integrand_before = integrand_here(f);
    begin_terms(f);
    memcpy(f->qdd_before, l->qdd, (size_t)f->n * sizeof *l->qdd);
    go_along(f, l->qdd);
    f->passing = true;
    return KMP_GO;
}

static int keep(kmp_formulation *formulation, double t, const double *y)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    const double *all = f->options->alone ? kmp_forward_map_begin(f, t, y) : y;
    if (!all)
        return KMP_HALT;
    int said = KMP_GO;
    memcpy(f->tail, all + 2 * kmp_forward_blocks(f), (size_t)f->integrals * sizeof *all);
    if (f->start.passed && f->start.passed->now)
        said = leave_at_event(f, t, all);
    else if (!(f->t >= t)) /* charts have changed, and the place with them */
        said = spread(f, t, all);
    if (f->options->alone)
        kmp_forward_set_columns(f, 0);
    return said;
}

/* Checks a start that is neither the first one nor the place of the last formulation: rates have changed between them.
 */
static kempe_status check_place(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    if (f->passing)
        return KEMPE_OK;
    int k = first_other(f, start->eval->mode);
    if (k >= 0)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "derivatives with respect to parameters end at t = %.9g s, where %s changes the closures",
                        start->t, f->system->event_text[k]);
    if (start->part->p != f->p || start->t > f->t || start->t < f->t)
        return kmp_fail(
            f->system->context, KEMPE_E_FAILED,
            "derivatives with respect to parameters end at t = %.9g, where the degrees of freedom are %d, not %d",
            start->t, start->part->p, f->p);
    return KEMPE_OK;
}

/* Takes next values of states and delayed signals, which may jump only at an event of the run. */
static int arrive_with_signals(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first)
{
    const double *jump = NULL;
    if (!first && kmp_forward_delays_jump(f, start->t, &jump) != KMP_GO)
        return KMP_HALT;
    if (jump && !f->passing)
        return kmp_forward_halt(
            f, "a delayed signal jumps at t = %.9g s, where the equations are derived again: derivatives end there",
            start->t);
    if (f->resets > 0 || jump)
        return reset_place(f, start->t, jump, first ? NULL : start->qd);
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    if (f->passing)
        memcpy(f->swing, f->common, (size_t)f->count * sizeof *f->swing);
    if (!first)
        kmp_forward_delays_pass(f, start->t, start->qd);
    return KMP_GO;
}

static kempe_status fail_with_reason(const kmp_forward_formulation *f)
{
    const char *reason = f->formulation.reason.s;
    return kmp_fail(f->system->context, KEMPE_E_FAILED, "%s", reason ? reason : "derivatives end at an event");
}

/* Derivatives of the rates behind an event of the run, or behind an impact at the start, in the place. */
static int arrive_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first)
{
    const kmp_passed_event *event = start->passed;
    if (!event || (!f->passing && !(first && event->impact)))
        return KMP_GO;
    for (int k = 0; f->passing && k < f->system->events.count; k++)
        if (f->near[k] && mode_differs(f, k, start->eval->mode))
            return halt_at_input(f, k, start->t);
    memcpy(f->swing, f->common, (size_t)f->count * sizeof *f->swing);
    note_swings(f, f->mode, start->t, f->cause_before);
    memcpy(f->mode, start->eval->mode, mode_bytes(f));
    if (charts_differ(f, start->eval->chart))
        return kmp_forward_halt(f, "a spherical joint is centred at an event, t = %.9g: derivatives end there",
                                start->t);
    if (!f->passing)
        begin_terms(f);
    if (f->count > 0 && (event->impact || event->switched) && kmp_forward_strike(f, start) != KMP_GO)
        return KMP_HALT;
    memcpy(f->qd, start->qd, (size_t)f->n * sizeof *f->qd);
    return KMP_GO;
}

/* True if the contact of a row has just had the last of its rebounds, and closes without another one. Parts of the
 * state that have moved it then end at the contact as the rebounds do, which leave nothing of them. */
static bool has_settled(const kmp_forward_formulation *f, const kmp_friction_run *friction,
                        const kmp_friction_element *e)
{
    const kmp_friction_element *contact = e->contact ? e : e->base >= 0 ? &friction->element[e->base] : NULL;
    return contact && !contact->struck && f->start.t - contact->last <= KMP_SLOPE_SETTLED * f->options->spec->t_end;
}

/* A row of friction holds its place, whose derivative stays as it is: `moved`. A closed contact stays closed only if
 * the derivatives of its distance and its rate are zero; derivatives by a part of the state, where it has `settled`,
 * need not be. `rate`: the part of its rate's by the place. Small changes belong to the last state. */
static int hold_row(kmp_forward_formulation *f, const kmp_friction_element *e, int k, bool settled, double rate,
                    double *moved)
{
    const kmp_pattern *entries = &f->system->jacobian;
    double span = fabs(*moved), speed = fabs(rate);
    for (int j = 0; j < entries->count; j++) {
        if (entries->row[j] != e->row)
            continue;
        const double by = kmp_forward_eval(f)->jacobian[j];
        const int at = k * f->n + entries->col[j];
        *moved += by * f->dq[at];
        span += fabs(by) * f->span[at];
        rate += by * f->dqd[at];
        speed += fabs(by) * f->speed[at];
    }
    const bool free = settled && k >= f->v->count, parts = e->contact && fabs(*moved) > KMP_SLOPE_PARTS * span;
    if (!free && (parts || fabs(rate) > KMP_SLOPE_LOOSE * speed))
        return kmp_forward_halt(f,
                                "%s is closed at t = %.9g s, but its %s changes with a parameter: the motion has no "
                                "derivative there",
                                f->system->event_text[e->slot], f->start.t, parts ? "distance" : "rate");
    *moved = e->contact ? 0 : *moved;
    return KMP_GO;
}

static int hold_rows(kmp_forward_formulation *f)
{
    kmp_sensitivity_equations *v = f->v;
    const kmp_friction_run *friction = f->start.passed->friction;
    for (int k = 0; friction && k < f->count; k++) {
        double *held = f->held + k * f->m;
        memset(held, 0, (size_t)f->m * sizeof *held);
        const kmp_change change = kmp_sensitivity_equations_change(v, k);
        memcpy(f->rows, change.rate, (size_t)f->m * sizeof *f->rows);
        kmp_tangents_add(&v->linear.tangents, KMP_RATE_Q, v->linear.d, 1, f->dq + k * f->n, f->rows);
        for (int i = 0; i < friction->count; i++) {
            const kmp_friction_element *e = &friction->element[i];
            held[e->row] = change.h[e->row];
            if (e->stance != KMP_FRICTION_HELD)
                held[e->row] = 0;
            else if (hold_row(f, e, k, has_settled(f, friction, e), f->rows[e->row], &held[e->row]) != KMP_GO)
                return KMP_HALT;
        }
    }
    v->held = friction && f->count > 0 ? f->held : NULL;
    return KMP_GO;
}

/* Ends an event: the derivatives at constant time, and what rows hold from now on. */
static int go_on_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, double *y)
{
    const kmp_linear *l = &f->v->linear;
    if (!start->passed || f->count == 0)
        return KMP_GO;
    if (kmp_forward_stand_at(f, start->t, y, true) != KMP_GO)
        return KMP_HALT;
    if (!f->passing)
        begin_terms(f);
    for (int k = 0; f->passing && k < f->count; k++)
        for (int i = 0; i < f->n; i++)
            add_term(f, k, i, l->qd[i], l->qdd[i], -f->common[k]);
    for (int k = 0; f->passing && f->integrals && k < f->count; k++)
        y[2 * kmp_forward_blocks(f) + 1 + k] += (f->integrand_before - integrand_here(f)) * f->common[k];
    if (f->passing && (f->last_t != start->t || are_different(f, f->common, NULL))) {
        memcpy(f->last, f->common, (size_t)f->count * sizeof *f->last);
        f->last_t = start->t;
    }
    f->passing = false;
    if (hold_rows(f) != KMP_GO)
        return KMP_HALT;
    pack(f, y);
    return KMP_GO;
}

/* The unknowns of the place, in which its columns end an event: y, or the unknowns of the map. NULL: the
 * reason is reported. */
static double *take_up_columns(kmp_forward_formulation *f, double t, double *y)
{
    const int columns = f->count;
    if (f->options->alone)
        kmp_forward_set_columns(f, 0);
    memcpy(y + 2 * kmp_forward_blocks(f), f->tail, (size_t)f->integrals * sizeof *f->tail);
    if (take_up(f, t, y) != KMP_GO)
        return NULL;
    if (!f->options->alone)
        return y;
    kmp_forward_set_columns(f, columns);
    pack(f, f->wide);
    memcpy(f->wide + 2 * kmp_forward_blocks(f), f->tail, (size_t)f->integrals * sizeof *f->tail);
    return f->wide;
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
        memcpy(f->mode, start->eval->mode, mode_bytes(f));
    if (alone && first)
        KMP_TRY(kmp_made(f->system->context, kmp_forward_map_begin_start(f)));
    else if (alone)
        kmp_forward_set_columns(f, f->map.columns);
    const bool signals = f->resets > 0;
    if (arrive_with_signals(f, start, first) != KMP_GO)
        return fail_with_reason(f);
    if (f->passing && (signals || f->cause_before >= 0 || are_different(f, f->common, NULL)))
        kmp_forward_delays_note(f, start->t, f->common);
    if (arrive_after_event(f, start, first) != KMP_GO)
        return fail_with_reason(f);
    enter_charts(f, start->q, start->qd);
    KMP_TRY(first ? kmp_forward_delays_begin(f, start->t) : KEMPE_OK);
    double *y = take_up_columns(f, start->t, f->formulation.y);
    if (!y)
        return kmp_fail(f->system->context, KEMPE_E_FAILED,
                        "the start cannot be evaluated: its closures are singular, or a coordinate moves no mass");
    if (go_on_after_event(f, start, y) != KMP_GO)
        return fail_with_reason(f);
    return !alone || kmp_forward_map_end(f, f->formulation.y) == KMP_GO ? KEMPE_OK : KEMPE_E_MEMORY;
}

static const kmp_formulation_kind varied_zone;

static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    kmp_forward_formulation *f = start->user;
    f->zone = kind == &varied_zone;
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

/* Derivatives follow when the formulation resumes or begins. */
static void note_reset(void *user, int count, const bool *taken, const int *condition)
{
    kmp_forward_formulation *f = user;
    f->missed = f->missed || f->resets == most_resets(f);
    if (f->missed)
        return;
    for (int k = 0; k < count; k++) {
        f->taken[f->resets * f->samples + k] = taken[k];
        f->cause_of[f->resets * f->samples + k] = condition[k];
    }
    f->resets++;
}

int kmp_state_of_sample(const kempe_model *model, int sample)
{
    for (int k = 0;; k++)
        if (model->states[k].next && sample-- == 0)
            return k;
}

/* -- the run ----------------------------------------------------------------------------------------- */

bool kmp_forward_make_columns(kmp_forward_formulation *f, int most)
{
    const int n = f->n, conditions = f->system->events.count;
    const double *tail = f->tail;
    f->most = most;
    KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, n *most, &f->dq, &f->dqd, &f->dqdd, &f->span, &f->speed),
                   KMP_ROOM(double, f->m *most, &f->dlambda, &f->held),
                   KMP_ROOM(double, f->v->slopes->shown *most, &f->dshown),
                   KMP_ROOM(double, most, &f->swing, &f->common, &f->last), KMP_ROOM(double, 1 + most, &f->tail),
                   KMP_ROOM(double, conditions *most, &f->swings),
                   KMP_ROOM(double, f->options->alone ? (2 * n + 1) * (1 + most) : 0, &f->wide));
    if (f->arena.failed)
        return false;
    if (tail)
        f->tail[0] = tail[0];
    return true;
}

static bool make_room(kmp_forward_formulation *f)
{
    kmp_arena *a = &f->arena;
    int n = f->n, conditions = f->system->events.count;
    KMP_ARENA_MAKE(a, KMP_ROOM(double, n, &f->q, &f->qd, &f->qdd_before, &f->su, &f->sud, &f->ud, &f->before),
                   KMP_ROOM(double, n, &f->jerk), KMP_ROOM(double, f->m, &f->lambda_rate, &f->rows),
                   KMP_ROOM(double, conditions, &f->mode, &f->new_mode, &f->next_mode, &f->changes, &f->along),
                   KMP_ROOM(double, KMP_CHART_SIZE * f->system->chart_count, &f->chart, &f->new_chart),
                   KMP_ROOM(double, 2 * n * n, &f->matrix),
                   KMP_ROOM(int, n, &f->signs, &f->signs_now, &f->old_u, &f->every),
                   KMP_ROOM(bool, conditions, &f->cause, &f->near), KMP_ROOM(double, conditions, &f->swung_t),
                   KMP_ROOM(int, conditions, &f->swung_by), KMP_ROOM(double, f->samples, &f->next),
                   KMP_ROOM(bool, most_resets(f) * f->samples, &f->taken),
                   KMP_ROOM(int, most_resets(f) * f->samples, &f->cause_of));
    f->sampled_t = f->last_t = NAN;
    for (int k = 0; !a->failed && k < conditions; k++)
        f->swung_t[k] = NAN;
    for (int i = 0; !a->failed && i < f->n; i++)
        f->every[i] = i;
    return !a->failed && kmp_forward_make_columns(f, f->v->count) && kmp_forward_delays_make(f);
}

/* Puts the start and its derivatives into the place. */
static kempe_status prepare(kmp_forward_formulation *f)
{
    kmp_sensitivity_equations *v = f->v;
    KMP_TRY(kmp_made(f->system->context, make_room(f)));
    kmp_charts_reset(f->system, f->chart);
    kmp_eval_set_charts(f->own, f->chart);
    f->own->frozen = false; /* by the end of an earlier run, as rows that were held there */
    for (int k = 0; k < f->system->events.count; k++)
        if (f->system->events.condition[k].role != KMP_ROLE_NONE)
            kmp_eval_set_kink(f->own, k, 0);
    go_by(f, f->own);
    v->linear.plain = false;
    KMP_TRY(kmp_sensitivity_equations_start(v, f->q, f->qd, f->dq, f->dqd));
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
    const kempe_assembly start = {.system = f->system, .q = f->q, .qd = f->qd, .closed = true};
    spec.kind = &varied_formulation;
    spec.user = f;
    spec.step = take_step;
    spec.slopes = true;
    spec.sample = f->samples > 0 ? note_reset : NULL;
    spec.own_angles = f->own_angles = f->options->integrand && reads_angles(f->system, f->options->integrand);
    if (f->options->alone)
        spec.change_points = kmp_change_points_word(KMP_CHANGE_POINTS_IGNORE);
    if (status == KEMPE_OK)
        status = kmp_run(f->system, &spec, &start, take_row, f, &report->run);
    report->integral = f->integrals && f->tail ? f->tail[0] : 0;
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
    for (int k = 0; k < f.system->model->state_count; k++)
        f.samples += f.system->model->states[k].next != NULL;
    f.integrals = options->integrand ? 1 + f.count : 0;
    *report = (kmp_forward_report){0};
    kempe_status status = run(&f, report);
    for (int k = 0; integral && f.integrals && f.tail && k < f.count; k++)
        integral[k] = f.tail[1 + k];
    kmp_text_free(&f.formulation.reason);
    kmp_forward_delays_free(&f);
    kmp_arena_free(&f.arena);
    varied->linear.plain = false;
    varied->columns = varied->count;
    varied->held = NULL;
    return status;
}
