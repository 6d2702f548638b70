/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions for an integrator of the caller. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_advance.h"

void kempe_simulator_get_states(const kempe_simulator *s, double *x)
{
    copy(2 * s->equations->freedom, s->part.x, x);
}

void kempe_simulator_get_rates(const kempe_simulator *s, double *dx)
{
    copy(2 * s->equations->freedom, s->part.rates, dx);
}

void kempe_simulator_get_choice(const kempe_simulator *s, int *independent)
{
    for (int k = 0; k < s->equations->freedom; k++)
        independent[k] = s->part.column[least_rank(s->equations) + k];
}

void kempe_simulator_get_changes(const kempe_simulator *s, double *value)
{
    const kempe_equations *e = s->equations;
    for (int k = 0; k < e->conditions; k++) {
        bool numbers = e->condition_kind[k] == KEMPE_CONDITION_KINK || e->condition_kind[k] >= KEMPE_CONDITION_NUMBER;
        value[k] = numbers ? 1 : s->part.value[k];
    }
}

/* The number of states of callers that are dependent now, and begin at their values: rows between rates that are held
 * determine no coordinate, only its rate, which the caller integrates. */
static int states_that_roll(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    return e->friction && e->friction->rolls > 0 ? rank_of(s) - least_rank(e) : 0;
}

/* Moves the placed, closed q to the states x of a caller and time t1 in equal parts, each along the tangent of the one
 * before. */
static outcome follow(kempe_simulator *s, double t0, double t1, const double *x, int parts, double *first)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    const int f = freedom_of(s), r = rank_of(s), rolling = states_that_roll(s);
    const int *held = part->column + least_rank(e);
    const double *u = x + r - least_rank(e);
    double *from = part->probe, *rolled = from + f;
    for (int k = 0; k < f; k++)
        from[k] = part->q[part->column[r + k]];
    for (int k = 0; k < rolling; k++)
        rolled[k] = part->q[held[k]];
    for (int i = 1; i <= parts; i++) {
        double share = (double)i / parts, dt = (t1 - t0) / parts;
        outcome said = evaluate_loops(s, t0 + (share - 1.0 / parts) * (t1 - t0));
        if (said != GOOD)
            return said;
        for (int k = 0; k < f; k++)
            part->qd[part->column[r + k]] = dt != 0 ? (u[k] - from[k]) / parts / dt : (u[k] - from[k]) / parts;
        if (!(dt != 0))
            clear(e->rows, part->h_t);
        evaluate_rates(s);
        for (int j = 0; j < r; j++)
            part->q[part->column[j]] += part->qd[part->column[j]] * (dt != 0 ? dt : 1);
        for (int k = 0; k < rolling; k++)
            part->q[held[k]] = rolled[k] + share * (x[k] - rolled[k]);
        for (int k = 0; k < f; k++)
            part->q[part->column[r + k]] = i == parts ? u[k] : from[k] + share * (u[k] - from[k]);
        double size = 0;
        said = close_loops(s, i == parts ? t1 : t0 + share * (t1 - t0), &size);
        *first = fmax(*first, size);
        if (said != GOOD)
            return said;
    }
    return GOOD;
}

kempe_simulator_status kempe_simulator_set_states(kempe_simulator *s, double t, const double *x)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = freedom_of(s), r = rank_of(s), held = e->freedom - f;
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    s->message[0] = 0;
    kempe_simulator_save(s, part->backup);
    hold_arguments(s);
    for (int k = 0; k < e->conditions; k++) /* an integrator of the caller does not locate kinks */
        part->modes[k] = kind_of(s, k) == KMP_CONDITION_KINK ? 0 : part->modes[k];
    clear(e->conditions, part->flip);
    outcome said = OPEN;
    double first = INFINITY;
    for (int parts = 1; parts <= MOST_PARTS && (said != GOOD || first > KMP_TRUSTED_CORRECTION); parts *= 4) {
        first = 0;
        copy(n, part->inner_q, part->q);
        said = follow(s, s->t, t, x, parts, &first);
    }
    for (int k = 0; k < f; k++)
        part->qd[part->column[r + k]] = x[e->freedom + held + k];
    if (said == GOOD)
        said = slopes_here(s, t, NULL);
    if (said != GOOD) {
        kempe_simulator_status status = explain(s, said, t);
        put_back(s, part->backup);
        return status;
    }
    complete(s);
    restart(s, t);
    part->state[AT_EXCHANGE] = is_choice_bad(s, KMP_EXCHANGE_GROWTH);
    show_place(s, t);
    return KEMPE_SIMULATOR_GOES;
}

/* Evaluates the present state again where the scratch has another one. */
static outcome refresh(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    if (*factors_are_present(s) > 0)
        return GOOD;
    place_state_of(s, part->inner_q, part->inner_qd);
    outcome said = evaluate_loops(s, s->t);
    if (said == GOOD)
        said = slopes_here(s, s->t, NULL);
    if (said == GOOD) {
        complete(s);
        show_friction(s, s->part.value);
        *factors_are_present(s) = 1;
    }
    return said;
}

double kempe_simulator_next_time(const kempe_simulator *s)
{
    return next_sample(s);
}

int kempe_simulator_wants_exchange(const kempe_simulator *s)
{
    return s->part.state[AT_BAD] > 0;
}

/* Notes the events of friction that the caller has located: by the values that it has seen, because other ones may
 * differ by rounding. A value of zero is such an event too. The caller may have passed the end of a slip: rates that
 * are not larger than the one against it count as none. */
static occasion passed_by_caller(kempe_simulator *s)
{
    const kempe_friction *friction = s->equations->friction;
    const struct kempe_simulator_parts *part = &s->part;
    occasion at = {false, KMP_FRICTION_DRIFT * s->settings.rtol};
    const double pace = pace_of_rates(s, part->inner_qd);
    for (int i = 0; friction && i < friction->elements; i++) {
        const int slip = friction->slot[i], stick = slip + KMP_ROLE_HELD - KMP_ROLE_SENSE;
        part->flip[slip] = part->value[slip] <= 0;
        part->flip[stick] = part->value[stick] <= 0;
        at.event = at.event || part->flip[slip] > 0 || part->flip[stick] > 0;
        if (part->flip[slip] > 0 && !friction->contact[i])
            at.still =
                fmax(at.still, (1 + KMP_FRICTION_TIE) * fabs(part->value[slip + KMP_ROLE_RATE - KMP_ROLE_SENSE]) /
                                   (friction->size[i] * pace));
    }
    return at;
}

kempe_simulator_status kempe_simulator_update(kempe_simulator *s, int *changed)
{
    struct kempe_simulator_parts *part = &s->part;
    bool any = false;
    *changed = 0;
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    s->message[0] = 0;
    kempe_simulator_save(s, part->backup);
    place_state_of(s, part->inner_q, part->inner_qd);
    restart(s, s->t);
    kempe_simulator_status status = pass_instant(s, s->t, part->y_new, passed_by_caller(s), &any);
    if (status == KEMPE_SIMULATOR_GOES && is_choice_bad(s, KMP_EXCHANGE_CALLERS)) {
        outcome said = exchange_choice(s, s->t);
        if (said == GOOD)
            said = slopes_here(s, s->t, NULL);
        if (said == GOOD)
            complete(s);
        else
            status = explain(s, said, s->t);
        any = true;
    }
    if (status == KEMPE_SIMULATOR_FAILED) {
        put_back(s, part->backup);
        return status;
    }
    pack_y(s, part->q, part->qd, part->y_new);
    show_place(s, s->t);
    *changed = any;
    return part->state[AT_ENDED] > 0 ? end_motion(s) : KEMPE_SIMULATOR_GOES;
}
