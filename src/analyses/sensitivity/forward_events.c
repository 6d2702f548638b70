/* SPDX-License-Identifier: BSD-3-Clause */
/* Events that end a formulation of a motion with sensitivities (forward.h): impacts, friction that begins or ceases to
 * stick, closures that switch. The derivatives of all coordinates at the place leave one formulation along the event,
 * where time is a function of the parameters, and arrive in the next one, which may have other degrees of freedom. */
#include "analyses/sensitivity/forward_events.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/sensitivity/forward_delays.h"
#include "analyses/sensitivity/forward_impact.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

/* -- along an event ------------------------------------------------------------------------------------- */

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
    const bool moves = kmp_forward_are_different(f, f->swing, NULL);
    if (f->cause_before >= 0 ? kmp_forward_are_different(f, f->swing, f->common)
                             : kmp_forward_are_different(f, f->common, NULL)) {
        for (int k = 0; k < f->samples && f->resets > 0 && !jumps; k++)
            if (f->taken[k])
                return kmp_forward_halt_at_event(f, k, t);
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
    if (kmp_forward_find_reset_swing(f, jump, t) != KMP_GO || (f->passing && join_event(f, t, jump != NULL) != KMP_GO))
        return KMP_HALT;
    if (!f->passing && kmp_forward_are_different(f, f->swing, NULL))
        return kmp_forward_halt(
            f, "a state changes at t = %.9g s, where the equations are derived again: derivatives end there", t);
    memcpy(f->new_chart, eval->chart, kmp_forward_chart_bytes(f));
    memcpy(f->new_mode, eval->mode, kmp_forward_mode_bytes(f));
    kmp_eval_set_charts(eval, f->chart);
    kmp_forward_set_modes(f, f->mode);
    if (qd)
        kmp_forward_delays_pass(f, t, qd);
    kmp_forward_take_next_values(f, t);
    kmp_forward_set_modes(f, f->new_mode);
    kmp_eval_set_charts(eval, f->new_chart);
    return KMP_GO;
}

/* -- before an event ------------------------------------------------------------------------------------ */

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
    const bool given = kmp_forward_input_jumps(f, t);
    int cause = -1;
    for (int k = 0; k < f->system->events.count; k++) {
        const kmp_condition *condition = &f->system->events.condition[k];
        f->near[k] = given && !condition->kink && condition->role == KMP_ROLE_NONE && kmp_forward_coincides(f, k, t, y);
    }
    memset(f->swing, 0, (size_t)f->count * sizeof *f->swing);
    for (int k = 0; k < f->system->events.count && !given; k++) {
        if (!event->caused[k] || f->system->events.condition[k].kink)
            continue;
        const bool crossed = kmp_forward_find_swing(f, k, y);
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
    return kmp_same_time(f->sampled_t, t) && kmp_forward_are_different(f, f->swing, NULL)
               ? kmp_forward_halt_at_event(f, f->sampled, t)
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

int kmp_forward_leave_at_event(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_linear *l = &f->v->linear;
    if (kmp_forward_spread(f, t, y) != KMP_GO || find_common_swing(f, t, y) != KMP_GO)
        return KMP_HALT;
    f->integrand_before = kmp_forward_integrand_here(f);
    begin_terms(f);
    memcpy(f->qdd_before, l->qdd, (size_t)f->n * sizeof *l->qdd);
    go_along(f, l->qdd);
    f->passing = true;
    return KMP_GO;
}

/* -- behind it ------------------------------------------------------------------------------------------ */

int kmp_forward_arrive_with_signals(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first)
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

int kmp_forward_arrive_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first)
{
    const kmp_passed_event *event = start->passed;
    if (!event || (!f->passing && !(first && event->impact)))
        return KMP_GO;
    for (int k = 0; f->passing && k < f->system->events.count; k++)
        if (f->near[k] && kmp_forward_mode_differs(f, k, start->eval->mode))
            return kmp_forward_halt_at_input(f, k, start->t);
    memcpy(f->swing, f->common, (size_t)f->count * sizeof *f->swing);
    kmp_forward_note_swings(f, f->mode, start->t, f->cause_before);
    memcpy(f->mode, start->eval->mode, kmp_forward_mode_bytes(f));
    if (kmp_forward_charts_differ(f, start->eval->chart))
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

int kmp_forward_go_on_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, double *y)
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
        y[2 * kmp_forward_blocks(f) + 1 + k] += (f->integrand_before - kmp_forward_integrand_here(f)) * f->common[k];
    if (f->passing && (f->last_t != start->t || kmp_forward_are_different(f, f->common, NULL))) {
        memcpy(f->last, f->common, (size_t)f->count * sizeof *f->last);
        f->last_t = start->t;
    }
    f->passing = false;
    if (hold_rows(f) != KMP_GO)
        return KMP_HALT;
    kmp_forward_pack(f, y);
    return KMP_GO;
}
