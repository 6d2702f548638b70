/* SPDX-License-Identifier: BSD-3-Clause */
/* Advance to a time, and changes of inputs and parameters on the way. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_start.h"

static kempe_simulator_status step_to(kempe_simulator *s, double t)
{
    double *state = s->part.state, most = s->settings.most_steps > 0 ? s->settings.most_steps : 1e6;
    for (double steps = 0; reach(s) < t && !(state[AT_ENDED] > 0); steps++) {
        if (steps >= most) {
            return fail_with(s,
                             "%.0f steps end at t = %.9g, before t = %.9g: loosen the tolerances, or raise most_steps",
                             most, state[AT_END], t);
        }
        kempe_simulator_status status = make_step(s, false);
        if (status != KEMPE_SIMULATOR_GOES)
            return status;
    }
    if (!(state[AT_ENDED] > 0) || t < state[AT_END])
        return show_at(s, t);
    kempe_simulator_status status = show_at(s, state[AT_END]);
    return status == KEMPE_SIMULATOR_GOES ? end_motion(s) : status;
}

/* Calls step_to, and takes back what it did where it fails. */
static kempe_simulator_status step_or_return(kempe_simulator *s, double t)
{
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    kempe_simulator_status status = step_to(s, t);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}

static kempe_simulator_status stop_here(kempe_simulator *s)
{
    snprintf(s->message, sizeof s->message, "%s: the motion has reached the end of its settings, t = %.9g: raise 'end'",
             s->equations->name, s->t);
    return KEMPE_SIMULATOR_ENDED;
}

/* -- changes by the caller ----------------------------------------------------------------------------------- */

/* Starts again from the present state: with other inputs or parameters, loops are closed and conditions decided anew.
 */
static kempe_simulator_status continue_here(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    bool changed = false;
    double t = s->t;
    place_state_of(s, part->inner_q, part->inner_qd);
    bool event = part->state[AT_EVENT] > 0 && !(t < part->state[AT_END]);
    restart(s, t);
    kempe_simulator_status status = pass_instant(s, t, part->y_new, (occasion){event, 0}, &changed);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    part->state[AT_EXCHANGE] = is_choice_bad(s, KMP_EXCHANGE_GROWTH);
    show_place(s, t);
    return part->state[AT_ENDED] > 0 ? end_motion(s) : KEMPE_SIMULATOR_GOES;
}

static bool same_numbers(int count, const double *a, const double *b)
{
    return count == 0 || memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

/* Takes the inputs and parameters that the caller has changed. */
static kempe_simulator_status take_changes(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    for (int i = 0; i < 3 * e->inputs; i++)
        if (!(fabs(s->u[i]) <= DBL_MAX)) {
            fail_with(s, "input '%s' is not finite at t = %.9g", e->input_names[i / 3], s->t);
            copy(3 * e->inputs, part->held, s->u);
            return KEMPE_SIMULATOR_FAILED;
        }
    s->message[0] = 0;
    if (!(part->state[AT_STARTED] > 0)) {
        hold_arguments(s);
        return KEMPE_SIMULATOR_GOES;
    }
    kempe_simulator_save(s, part->backup);
    hold_arguments(s);
    kempe_simulator_status status = continue_here(s);
    if (status == KEMPE_SIMULATOR_FAILED) {
        put_back(s, part->backup);
        copy(3 * e->inputs, part->held, s->u);
        copy(e->parameters, part->held_p, s->p);
    }
    return status;
}

kempe_simulator_status kempe_simulator_set_inputs(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    s->message[0] = 0;
    return same_numbers(3 * e->inputs, s->u, s->part.held) && same_numbers(e->parameters, s->p, s->part.held_p)
               ? KEMPE_SIMULATOR_GOES
               : take_changes(s);
}

kempe_simulator_status kempe_simulator_set_parameters(kempe_simulator *s)
{
    return kempe_simulator_set_inputs(s);
}

/* -- advance -------------------------------------------------------------------------------------------- */

kempe_simulator_status kempe_simulator_advance(kempe_simulator *s, double t)
{
    if (!(s->part.state[AT_STARTED] > 0))
        return refuse_before_start(s);
    if (!(t >= s->t)) {
        return fail_with(s, "t = %.9g lies before the present time %.9g", t, s->t);
    }
    kempe_simulator_status status = kempe_simulator_set_inputs(s);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    status = s->settings.end < s->t ? KEMPE_SIMULATOR_GOES : step_or_return(s, fmin(t, s->settings.end));
    return status == KEMPE_SIMULATOR_GOES && t > s->settings.end ? stop_here(s) : status;
}

kempe_simulator_status kempe_simulator_step(kempe_simulator *s)
{
    double *state = s->part.state;
    if (!(state[AT_STARTED] > 0))
        return refuse_before_start(s);
    kempe_simulator_status status = kempe_simulator_set_inputs(s);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    if (state[AT_END] > s->t || state[AT_ENDED] > 0)
        return step_or_return(s, state[AT_END]);
    if (!(s->t < s->settings.end))
        return stop_here(s);
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    status = make_step(s, false);
    if (status == KEMPE_SIMULATOR_GOES)
        status = step_to(s, state[AT_END]);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}
