/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs at a time, and the start of a motion. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_steps.h"

/* Makes the placed, complete state the present one, with its conditions and outputs. */
static void show_place(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    show_coordinates(s, t);
    kempe_arguments at = arguments_at(s, t);
    if (e->conditions > 0)
        e->changes(&at, part->value);
    show_friction(s, part->value);
    copy(e->rows, part->lambda, s->lambda);
    if (e->outputs > 0)
        e->show(&at, s->y);
    take_states(s);
    s->t = t;
    part->state[AT_BAD] = is_choice_bad(s, KMP_EXCHANGE_CALLERS);
    *factors_are_present(s) = 1;
}

/* Shows the state y at t with its loops closed. */
static outcome show_state(kempe_simulator *s, double t, const double *y)
{
    outcome said = slopes_closed(s, t, y, NULL);
    if (said == GOOD) {
        complete(s);
        show_place(s, t);
    }
    return said;
}

static kempe_simulator_status show_at(kempe_simulator *s, double t)
{
    follow_angles(s, t);
    outcome said = interpolate(s, t, s->part.probe);
    if (said == GOOD)
        said = show_state(s, t, s->part.probe);
    return said == GOOD ? KEMPE_SIMULATOR_GOES : explain(s, said, t);
}

/* -- start -------------------------------------------------------------------------------------------------- */

/* The end of the last step is t, at the placed, closed q and ud; the next step starts there. */
static void restart(kempe_simulator *s, double t)
{
    double *state = s->part.state;
    if (state[AT_TAKEN] > 0 && t < state[AT_END])
        state[AT_NEXT] = state[AT_TAKEN];
    pack_y(s, s->part.q, s->part.qd, s->part.y_new);
    state[AT_BEGIN] = state[AT_END] = t;
    state[AT_TAKEN] = 0;
    state[AT_DENSE] = state[AT_EVENT] = state[AT_EXCHANGE] = state[AT_ENDED] = 0;
    begin_control(s);
}

/* Makes the first choice at the placed q, before and after the loops are closed. */
static outcome close_start(kempe_simulator *s, double t, const int *fixed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int r = rank_of(s);
    for (int i = 0; i < e->rows; i++)
        part->row[i] = i;
    for (int j = 0; j < e->coordinates; j++)
        part->column[j] = j;
    find_structure(s);
    (void)evaluate_loops(s, t);
    choose(s, fixed);
    outcome said = close_loops(s, t, NULL);
    if (said != GOOD)
        return said;
    (void)evaluate_loops(s, t);
    choose(s, fixed);
    if (r > 0 && !(part->pivots[r - 1] > e->rank_tolerance * part->pivots[0])) {
        (void)evaluate_loops(s, t);
        return SINGULAR_LOOPS;
    }
    said = close_loops(s, t, NULL);
    return said == GOOD && !fixed ? improve_choice(s, t) : said;
}

/* -- a start that moves with parameters ---------------------------------------------------------------------- */

/* Moves the placed start of the model by what the parameters change of its given values. True: they, or the closures,
 * are others. */
static bool move_start(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *given = part->dq; /* dqd follows */
    bool moved = false, changed = false;
    for (int k = 0; k < e->parameters; k++) {
        bool other = s->p[k] != e->parameter_values[k];
        changed = changed || other;
        moved = moved || (other && e->parameter_fixed && e->parameter_fixed[k]);
    }
    if (!changed || !e->start)
        return moved;
    kempe_arguments at = arguments_at(s, t);
    e->start(&at, given);
    for (int j = 0; j < e->coordinates; j++) {
        double dq = given[2 * j] - e->start_given[2 * j], dqd = given[2 * j + 1] - e->start_given[2 * j + 1];
        part->q[j] += dq;
        part->qd[j] += dqd;
        moved = moved || dq != 0 || dqd != 0;
    }
    return moved;
}

/* Marks the coordinates that keep their place, or their rate; the number of these. */
static int mark_kept(kempe_simulator *s, int what)
{
    int count = 0;
    for (int j = 0; j < s->equations->coordinates; j++) {
        s->part.fixed[j] = (s->equations->start_keeps[j] & what) != 0;
        count += s->part.fixed[j];
    }
    return count;
}

/* Closes the loops at the moved start: coordinates and rates that the model keeps move the others. */
static outcome close_moved(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    int kept = mark_kept(s, KEMPE_START_KEEPS_PLACE);
    for (int k = 0; kept == 0 && e->independent && k < e->freedom; k++)
        s->part.fixed[e->independent[k]] = 1;
    outcome said = close_start(s, t, s->part.fixed);
    if (said == GOOD && mark_kept(s, KEMPE_START_KEEPS_RATE) > 0)
        said = close_start(s, t, s->part.fixed);
    if (said == GOOD)
        said = evaluate_loops(s, t);
    if (said == GOOD)
        evaluate_rates(s);
    return said;
}

static kempe_simulator_status start_here(kempe_simulator *s, double t, bool of_model)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state;
    int *fixed = e->independent ? part->fixed : NULL;
    clear(HEADER, state);
    part->rank = least_rank(e);
    reset_charts(s);
    clear(3 * e->coordinates + e->rows, part->begin);
    state[AT_RATE] = 1;
    state[AT_END] = t;
    clear(e->conditions, part->modes);
    clear(e->conditions, part->repeats);
    clear(e->conditions, part->flip);
    clear(e->conditions, part->largest);
    clear(e->conditions, part->most);
    for (int k = 0; k < e->conditions; k++)
        part->last[k] = -DBL_MAX;
    hold_arguments(s);
    outcome said = GOOD;
    if (of_model && e->start_keeps && move_start(s, t))
        said = close_moved(s, t);
    for (int j = 0; j < e->coordinates; j++)
        part->fixed[j] = 0;
    for (int k = 0; fixed && k < e->freedom; k++)
        fixed[e->independent[k]] = 1;
    if (said == GOOD)
        said = close_start(s, t, fixed);
    if (said != GOOD)
        return explain(s, said, t);
    for (int i = rank_of(s); i < e->rows; i++)
        state[AT_LOOSE] = fmax(state[AT_LOOSE], opening(s, part->row[i]));
    if (state[AT_LOOSE] > KMP_CLOSED_NEAR)
        return explain(s, OPEN, t);
    kempe_simulator_status status = pass_start(s, t, part->y_new);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    if (charts_are_due(s)) {
        said = exchange_choice(s, t);
        if (said == GOOD)
            said = slopes_here(s, t, NULL);
        if (said != GOOD)
            return explain(s, said, t);
        complete(s);
    }
    state[AT_RATE] = rate_of_motion(s);
    set_weights(s);
    double ended = state[AT_ENDED];
    restart(s, t);
    state[AT_ENDED] = ended;
    state[AT_STARTED] = 1;
    show_place(s, t);
    return ended > 0 ? end_motion(s) : KEMPE_SIMULATOR_GOES;
}

static kempe_simulator_status start_at(kempe_simulator *s, double t, const double *q, const double *qd, bool of_model)
{
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    copy(s->equations->coordinates, q, s->part.q);
    copy(s->equations->coordinates, qd, s->part.qd);
    kempe_simulator_status status = start_here(s, t, of_model);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}

kempe_simulator_status kempe_simulator_start(kempe_simulator *s, double t)
{
    return start_at(s, t, s->equations->start_q, s->equations->start_qd, true);
}

kempe_simulator_status kempe_simulator_start_from(kempe_simulator *s, double t, const double *q, const double *qd)
{
    return start_at(s, t, q, qd, false);
}

static kempe_simulator_status refuse_before_start(kempe_simulator *s)
{
    return fail_with(s, "the simulator has not been started: call kempe_simulator_start");
}
