/* SPDX-License-Identifier: BSD-3-Clause */
/* Events that end a formulation of a motion with sensitivities (forward.h): impacts, friction that begins or ceases to
 * stick, closures that switch. The derivatives of all coordinates at the place leave one formulation along the event,
 * where time is a function of the parameters, and arrive in the next one, which may have other degrees of freedom. */
#include "analyses/sensitivity/forward_events.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/sensitivity/forward_delays.h"
#include "analyses/sensitivity/forward_impact.h"
#include "analyses/sensitivity/forward_requirements.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

/* -- along an event ------------------------------------------------------------------------------------- */

/* Adds rates and accelerations, times `sign` and dt_e/dp, to the derivatives, and the sizes of these terms to the sums
 * of sizes, at least by their rounding. */
static void add_terms(kmp_forward_formulation *f, const double *qd, const double *qdd, double sign, const double *swing)
{
    for (int i = 0; i < f->n; i++) {
        const double usual = f->start.rate_scale * f->system->scale[i] * KMP_IMPACT_RATES / KMP_SLOPE_LOOSE;
        const double rate = fabs(qd[i]) + usual, acceleration = fabs(qdd[i]) + usual * f->start.rate_scale;
        f->pace[i] += rate;
        f->pace_of_rates[i] += acceleration;
        for (int k = 0; k < f->count; k++) {
            const int at = k * f->n + i;
            if (swing[k] == 0)
                continue;
            f->dq[at] += qd[i] * (sign * swing[k]);
            f->dqd[at] += qdd[i] * (sign * swing[k]);
            f->span[at] += rate * fabs(swing[k]);
            f->speed[at] += acceleration * fabs(swing[k]);
        }
    }
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
        add_terms(f, f->qd, f->qdd_before, 1, f->swing);
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

/* The size of the quantity by which column k differentiates. */
static double size_of(const kmp_forward_formulation *f, int k)
{
    return f->column_size && k >= f->v->count ? f->column_size[k] : f->sizes[k];
}

/* True if f->swing and f->common are derivatives of one time, up to rounding. */
static bool have_one_time(const kmp_forward_formulation *f)
{
    bool have = true;
    for (int k = 0; k < f->count; k++) {
        const double size = fmax(fabs(f->swing[k]), fabs(f->common[k]));
        const double rounding = KMP_SLOPE_ROUNDED / (f->start.rate_scale * size_of(f, k));
        have = have && fabs(f->swing[k] - f->common[k]) <= KMP_SLOPE_SAME_TIME * size + rounding;
    }
    return have;
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
        if (cause >= 0 && !have_one_time(f) &&
            kmp_forward_require_one_time(
                f, kmp_arena_printf(&f->arena,
                                    "the conditions %s and %s change together at t = %.9g, at times that depend on "
                                    "parameters in different ways: the motion has no derivative there",
                                    f->system->event_text[cause], f->system->event_text[k], t)) != KMP_GO)
            return KMP_HALT;
        cause = k;
        memcpy(f->common, f->swing, (size_t)f->count * sizeof *f->swing);
    }
    memcpy(f->common, f->swing, (size_t)f->count * sizeof *f->swing);
    f->cause_before = cause;
    return kmp_same_time(f->sampled_t, t) && kmp_forward_are_different(f, f->swing, NULL)
               ? kmp_forward_halt_at_event(f, f->sampled, t)
               : KMP_GO;
}

/* Begins the sums of sizes with the derivatives, and with rounding of coordinates. */
static void begin_terms(kmp_forward_formulation *f)
{
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n; i++) {
            const int at = k * f->n + i;
            const double rounding = kmp_forward_rounding(f, i) / size_of(f, k);
            f->span[at] = fabs(f->dq[at]) + rounding;
            f->speed[at] = fabs(f->dqd[at]) + rounding * f->start.rate_scale;
        }
    const size_t size = (size_t)(f->count * f->n) * sizeof *f->dq;
    memcpy(f->dq_before, f->dq, size);
    memcpy(f->dqd_before, f->dqd, size);
    memset(f->pace, 0, (size_t)f->n * sizeof *f->pace);
    memset(f->pace_of_rates, 0, (size_t)f->n * sizeof *f->pace_of_rates);
}

int kmp_forward_leave_at_event(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_linear *l = &f->v->linear;
    if (kmp_forward_spread(f, t, y) != KMP_GO || find_common_swing(f, t, y) != KMP_GO)
        return KMP_HALT;
    f->integrand_before = kmp_forward_integrand_here(f);
    begin_terms(f);
    memcpy(f->qdd_before, l->qdd, (size_t)f->n * sizeof *l->qdd);
    add_terms(f, l->qd, l->qdd, 1, f->swing);
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

/* The checks of a row that is held: that it keeps its distance and its rate. */
enum { DISTANCE, RATE, CHECKS };

static const char *reason_of(kmp_forward_formulation *f, const kmp_friction_element *e, int check)
{
    return kmp_arena_printf(&f->arena,
                            "%s is closed at t = %.9g s, but its %s changes with a parameter: the motion has no "
                            "derivative there",
                            f->system->event_text[e->slot], f->start.t, check == DISTANCE ? "distance" : "rate");
}

/* Judges the checks of a row. Small changes belong to the last state. */
static int judge_row(kmp_forward_formulation *f, const kmp_friction_element *e, const kmp_forward_check *check)
{
    const kmp_pattern *entries = &f->system->jacobian;
    if (!check[DISTANCE].fails && !check[RATE].fails)
        return KMP_GO;
    memset(f->row, 0, (size_t)f->n * sizeof *f->row);
    for (int j = 0; j < entries->count; j++)
        if (entries->row[j] == e->row)
            f->row[entries->col[j]] += kmp_forward_eval(f)->jacobian[j];
    for (int c = 0; c < CHECKS; c++)
        if (check[c].fails && kmp_forward_require(f, &check[c], f->row, reason_of(f, e, c)) != KMP_GO)
            return KMP_HALT;
    return KMP_GO;
}

/* A row of friction holds its place, whose derivative stays as it is: `moved`. A closed contact stays closed only if
 * the derivatives of its distance and its rate are zero. `rate`: the part of its rate's by the place. */
static int hold_row(kmp_forward_formulation *f, const kmp_friction_element *e, int k, double rate, double *moved,
                    kmp_forward_check *check)
{
    const kmp_pattern *entries = &f->system->jacobian;
    double span = fabs(*moved), speed = fabs(rate);
    check[RATE].rates = true;
    check[DISTANCE].given[k] = *moved;
    check[RATE].given[k] = rate;
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
    check[DISTANCE].off[k] = *moved;
    check[RATE].off[k] = rate;
    check[DISTANCE].fails = check[DISTANCE].fails || (e->contact && fabs(*moved) > KMP_SLOPE_PARTS * span);
    check[RATE].fails = check[RATE].fails || fabs(rate) > KMP_SLOPE_LOOSE * speed;
    *moved = e->contact ? 0 : *moved;
    return f->options->alone ? KMP_GO : judge_row(f, e, check);
}

static int hold_all(kmp_forward_formulation *f, const kmp_friction_run *friction, kmp_forward_check *check)
{
    kmp_sensitivity_equations *v = f->v;
    for (int k = 0; k < f->count; k++) {
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
            else if (hold_row(f, e, k, f->rows[e->row], &held[e->row], check + CHECKS * i) != KMP_GO)
                return KMP_HALT;
        }
    }
    for (int i = 0; i < friction->count; i++)
        if (judge_row(f, &friction->element[i], check + CHECKS * i) != KMP_GO)
            return KMP_HALT;
    return KMP_GO;
}

static int hold_rows(kmp_forward_formulation *f)
{
    const kmp_friction_run *friction = f->start.passed->friction;
    kmp_arena arena = {0};
    kmp_forward_check *check = NULL;
    int said = KMP_GO;
    if (friction && kmp_forward_make_checks(f, &arena, CHECKS * friction->count, &check)) {
        said = hold_all(f, friction, check);
    } else if (friction) {
        (void)kmp_fail_memory(f->system->context);
        said = KMP_HALT;
    }
    kmp_arena_free(&arena);
    f->v->held = friction && f->count > 0 ? f->held : NULL;
    return said;
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
    if (f->passing)
        add_terms(f, l->qd, l->qdd, -1, f->common);
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
