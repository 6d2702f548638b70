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
#include "linalg/dense/dot.h"
#include <math.h>
#include <string.h>

bool kmp_forward_event_make(kmp_forward_event *event, kmp_arena *arena, const kempe_system *system, int columns)
{
    event->last_t = NAN;
    return KMP_ARENA_MAKE(arena, KMP_ROOM(double, system->n, &event->qdd, &event->row),
                          KMP_ROOM(double, system->m, &event->rows), KMP_ROOM(bool, system->events.count, &event->near),
                          KMP_ROOM(double, columns, &event->swing, &event->last));
}

/* -- next values and signals ---------------------------------------------------------------------------- */

/* Next values and delayed signals that jump take part in the event of the run, before which the place is: they have its
 * time. */
static int join_event(kmp_forward_formulation *f, double t, bool jumps)
{
    const bool moves = kmp_swings_differ(f->count, f->times.swing, NULL);
    if (f->event.cause >= 0 ? kmp_swings_differ(f->count, f->times.swing, f->event.swing)
                            : kmp_swings_differ(f->count, f->event.swing, NULL)) {
        for (int k = 0; k < f->resets.states && f->resets.count > 0 && !jumps; k++)
            if (f->resets.taken[k])
                return kmp_forward_halt_at_event(f, k, t);
        return kmp_forward_halt(
            f,
            "a delayed signal jumps at t = %.9g together with an event: the motion has no derivative with "
            "respect to parameters there",
            t);
    }
    if (f->event.cause < 0 && moves) {
        kmp_forward_add_terms(f, f->place.qd, f->event.qdd, 1, f->times.swing);
        f->event.cause = f->resets.cause;
    }
    memcpy(f->event.swing, f->times.swing, (size_t)f->count * sizeof *f->times.swing);
    return KMP_GO;
}

/* Derivatives of the place across next values of states that the run has noted (kmp_sample_fn), and across delayed
 * signals that jump (`jump`: dt/dp there; `qd`: the rates behind it, NULL at the start of the run). The place is before
 * an event of the run, or at a time that depends on no parameter. */
static int reset_place(kmp_forward_formulation *f, double t, const double *jump, const double *qd)
{
    if (kmp_forward_find_reset_swing(f, jump, t) != KMP_GO ||
        (f->event.passing && join_event(f, t, jump != NULL) != KMP_GO))
        return KMP_HALT;
    if (!f->event.passing && kmp_swings_differ(f->count, f->times.swing, NULL))
        return kmp_forward_halt(
            f, "a state changes at t = %.9g s, where the equations are derived again: derivatives end there", t);
    kmp_forward_step_back(f);
    if (qd)
        kmp_forward_delays_pass(f, t, qd);
    kmp_forward_take_next_values(f, t);
    kmp_forward_step_forth(f);
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

/* dt_e/dp of the event that the run passes, whose conditions have one time: f->event.swing. */
static int find_common_swing(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_passed_event *event = f->start.passed;
    const bool given = kmp_forward_input_jumps(f, t);
    int cause = -1;
    for (int k = 0; k < f->system->events.count; k++) {
        const kmp_condition *condition = &f->system->events.condition[k];
        f->event.near[k] =
            given && !condition->kink && condition->role == KMP_ROLE_NONE && kmp_forward_coincides(f, k, t, y);
    }
    memset(f->times.swing, 0, (size_t)f->count * sizeof *f->times.swing);
    for (int k = 0; k < f->system->events.count && !given; k++) {
        if (!event->caused[k] || f->system->events.condition[k].kink)
            continue;
        const bool crossed = kmp_forward_find_swing(f, k, y);
        /* A condition that the motion has not crossed at t has jumped with the rates or with a state at the event
         * before, which has the same time. */
        if (f->event.last_t == t && f->times.distance * f->start.rate_scale > KMP_SLOPE_JUMPED)
            memcpy(f->times.swing, f->event.last, (size_t)f->count * sizeof *f->times.swing);
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
        if (cause >= 0 && !kmp_forward_have_one_time(f) &&
            kmp_forward_require_one_time(
                f, kmp_arena_printf(&f->arena,
                                    "the conditions %s and %s change together at t = %.9g, at times that depend on "
                                    "parameters in different ways: the motion has no derivative there",
                                    f->system->event_text[cause], f->system->event_text[k], t)) != KMP_GO)
            return KMP_HALT;
        cause = k;
        memcpy(f->event.swing, f->times.swing, (size_t)f->count * sizeof *f->times.swing);
    }
    memcpy(f->event.swing, f->times.swing, (size_t)f->count * sizeof *f->times.swing);
    f->event.cause = cause;
    return kmp_forward_halt_at_sample(f, t);
}

int kmp_forward_leave_at_event(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_linear *l = &f->v->linear;
    if (kmp_forward_spread(f, t, y) != KMP_GO || find_common_swing(f, t, y) != KMP_GO)
        return KMP_HALT;
    f->event.integrand = kmp_forward_integrand_here(f);
    kmp_forward_begin_terms(f);
    memcpy(f->event.qdd, l->qdd, (size_t)f->n * sizeof *l->qdd);
    kmp_forward_add_terms(f, l->qd, l->qdd, 1, f->times.swing);
    f->event.passing = true;
    return KMP_GO;
}

/* -- behind it ------------------------------------------------------------------------------------------ */

int kmp_forward_arrive_with_signals(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first)
{
    const double *jump = NULL;
    if (!first && kmp_forward_delays_jump(f, start->t, &jump) != KMP_GO)
        return KMP_HALT;
    if (jump && !f->event.passing)
        return kmp_forward_halt(
            f, "a delayed signal jumps at t = %.9g s, where the equations are derived again: derivatives end there",
            start->t);
    if (f->resets.count > 0 || jump)
        return reset_place(f, start->t, jump, first ? NULL : start->qd);
    kmp_copy_or_zero(f->count, kmp_forward_event_swing(&f->event), f->times.swing);
    if (!first)
        kmp_forward_delays_pass(f, start->t, start->qd);
    return KMP_GO;
}

int kmp_forward_arrive_after_event(kmp_forward_formulation *f, const kmp_formulation_start *start, bool first)
{
    const kmp_passed_event *event = start->passed;
    if (!event || (!f->event.passing && !(first && event->impact)))
        return KMP_GO;
    for (int k = 0; f->event.passing && k < f->system->events.count; k++)
        if (f->event.near[k] && kmp_forward_mode_differs(f, k, start->eval->conditions.mode))
            return kmp_forward_halt_at_input(f, k, start->t);
    memcpy(f->times.swing, f->event.swing, (size_t)f->count * sizeof *f->times.swing);
    kmp_event_times_note(&f->times, f->mode, start->eval->conditions.mode, start->t, f->event.cause);
    memcpy(f->mode, start->eval->conditions.mode, kmp_forward_mode_bytes(f));
    if (!f->event.passing)
        kmp_forward_begin_terms(f);
    if (f->count > 0 && (event->impact || event->switched) && kmp_forward_strike(f, start) != KMP_GO)
        return KMP_HALT;
    memcpy(f->place.qd, start->qd, (size_t)f->n * sizeof *f->place.qd);
    return KMP_GO;
}

/* The checks of a row that is held: that it keeps its distance and its rate. */
enum { DISTANCE, RATE, CHECKS };

/* Judges the checks of a row. Small changes belong to the last state. */
static int judge_row(kmp_forward_formulation *f, const kmp_friction_element *e, const kmp_forward_check *check)
{
    const kmp_pattern *entries = &f->system->jacobian;
    if (!check[DISTANCE].fails && !check[RATE].fails)
        return KMP_GO;
    memset(f->event.row, 0, (size_t)f->n * sizeof *f->event.row);
    for (int j = 0; j < entries->count; j++)
        if (entries->row[j] == e->row)
            f->event.row[entries->col[j]] += kmp_forward_eval(f)->jacobian[j];
    for (int c = 0; c < CHECKS; c++) {
        if (!check[c].fails)
            continue;
        const char *reason =
            kmp_arena_printf(&f->arena,
                             "%s is closed at t = %.9g s, but its %s changes with a parameter: the "
                             "motion has no derivative there",
                             f->system->event_text[e->slot], f->start.t, c == DISTANCE ? "distance" : "rate");
        if (kmp_forward_require(f, &check[c], f->event.row, reason) != KMP_GO)
            return KMP_HALT;
    }
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
        *moved += by * f->place.dq[at];
        span += fabs(by) * f->terms.span[at];
        rate += by * f->place.dqd[at];
        speed += fabs(by) * f->terms.speed[at];
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
        memcpy(f->event.rows, change.rate, (size_t)f->m * sizeof *f->event.rows);
        kmp_tangents_add(&v->linear.tangents, KMP_RATE_Q, v->linear.d, 1, f->place.dq + k * f->n, f->event.rows);
        for (int i = 0; i < friction->count; i++) {
            const kmp_friction_element *e = &friction->element[i];
            held[e->row] = change.h[e->row];
            if (e->stance != KMP_FRICTION_HELD)
                held[e->row] = 0;
            else if (hold_row(f, e, k, f->event.rows[e->row], &held[e->row], check + CHECKS * i) != KMP_GO)
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
    if (!f->event.passing)
        kmp_forward_begin_terms(f);
    if (f->event.passing)
        kmp_forward_add_terms(f, l->qd, l->qdd, -1, f->event.swing);
    for (int k = 0; f->event.passing && f->integrals && k < f->count; k++)
        y[2 * kmp_forward_blocks(f) + 1 + k] +=
            (f->event.integrand - kmp_forward_integrand_here(f)) * f->event.swing[k];
    if (f->event.passing && (f->event.last_t != start->t || kmp_swings_differ(f->count, f->event.swing, NULL))) {
        memcpy(f->event.last, f->event.swing, (size_t)f->count * sizeof *f->event.last);
        f->event.last_t = start->t;
    }
    f->event.passing = false;
    if (hold_rows(f) != KMP_GO)
        return KMP_HALT;
    kmp_forward_pack(f, y);
    return KMP_GO;
}
