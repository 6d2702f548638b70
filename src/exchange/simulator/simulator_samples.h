/* SPDX-License-Identifier: BSD-3-Clause */
/* States that take next values at samples and at events, and what happens at one instant. A part of
 * kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_friction.h"

static double next_sample_of(const kempe_simulator *s, int k)
{
    return s->part.number[k] * s->equations->discrete.period[k];
}

/* The time of the next sample that has not been taken; INFINITY: there is none. */
static double next_sample(const kempe_simulator *s)
{
    double next = INFINITY;
    for (int k = 0; k < s->equations->discrete.states; k++)
        next = fmin(next, next_sample_of(s, k));
    return next;
}

/* The end of steps. */
static double last_time(const kempe_simulator *s)
{
    return kmp_first_limit(next_sample(s), INFINITY, s->settings.end);
}

/* The last time whose state is the state at the end of the last step: where a sample is due, its values are those
 * before. */
static double reach(const kempe_simulator *s)
{
    double t = s->part.state[AT_END];
    return kmp_sample_is_due(next_sample(s), t) ? kmp_last_equal(t) : t;
}

static bool holds(const kempe_simulator *s, int k)
{
    int condition = s->equations->discrete.condition[k];
    return condition >= 0 && (s->part.modes[condition] > 0) == (s->equations->discrete.sense[k] > 0);
}

/* True if the condition of a state has begun to hold, and the state has not changed since. */
static bool meets_events(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    bool any = false;
    for (int k = 0; k < s->equations->discrete.states; k++) {
        bool now = holds(s, k);
        part->due[k] = part->due[k] > 0 || (now && !(part->was[k] > 0));
        part->was[k] = now;
        any = any || part->due[k] > 0;
    }
    return any;
}

/* Gives the states that are due their next values, at the placed state; all are of the state before. */
static bool take_samples(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    bool any = kmp_sample_is_due(next_sample(s), t);
    for (int k = 0; k < e->discrete.states; k++)
        any = any || part->due[k] > 0;
    if (!any)
        return false;
    kempe_arguments at = arguments_at(s, t);
    e->discrete.next(&at, part->next);
    for (int k = 0; k < e->discrete.states; k++) {
        bool sampled = kmp_sample_is_due(next_sample_of(s, k), t);
        if (sampled || part->due[k] > 0)
            part->qd[e->discrete.place[k]] = part->next[k];
        part->number[k] += sampled;
        part->due[k] = 0;
    }
    return true;
}

/* -- an instant -------------------------------------------------------------------------------------------- */

/* An instant: whether it is the event of the last step; a rate of friction that counts as none because an integrator
 * of the caller is not more exact, in sizes of its place and rates of the motion. */
typedef struct occasion {
    bool event;
    double still;
} occasion;

/* Changes the modes that change at the end of the last step. False after a message. */
static bool flip_modes(kempe_simulator *s, double t)
{
    for (int k = 0; k < s->equations->conditions; k++)
        if (s->part.flip[k] > 0 && !is_of_friction(s->equations, k) && !change_mode(s, k, t))
            return false;
    clear(s->equations->conditions, s->part.flip);
    return true;
}

/* Impacts and the modes of friction after all others, which are decided again without the rows that it holds. Modes
 * stay where nothing has changed. */
static kempe_simulator_status decide_friction(kempe_simulator *s, double t, double *y, const occasion *at,
                                              bool *changed)
{
    kempe_simulator_status status = KEMPE_SIMULATOR_GOES;
    if (s->part.state[AT_ENDED] > 0 || !(*changed || passes_friction(s)))
        return status;
    if (!at->event) {
        bool any = false;
        pack_y(s, s->part.q, s->part.qd, y);
        status = release_friction(s, t, y);
        if (status == KEMPE_SIMULATOR_GOES)
            status = settle_modes(s, t, y, true, &any);
    }
    *changed = true;
    if (status == KEMPE_SIMULATOR_GOES)
        status = strike_contacts(s, t);
    return status == KEMPE_SIMULATOR_GOES ? settle_friction(s, t, y, at->still) : status;
}

/* Conditions, impacts and friction; then states that are due at the state behind these, and what they change, which may
 * be events of other states. */
static kempe_simulator_status settle_states(kempe_simulator *s, double t, double *y, const occasion *at, bool *changed)
{
    const kempe_equations *e = s->equations;
    const occasion later = {false, at->still};
    kempe_simulator_status status = settle_modes(s, t, y, true, changed);
    if (e->friction && status == KEMPE_SIMULATOR_GOES)
        status = decide_friction(s, t, y, at, changed);
    bool more = meets_events(s) || kmp_sample_is_due(next_sample(s), t);
    for (int pass = 0; status == KEMPE_SIMULATOR_GOES && more && pass <= e->discrete.states; pass++) {
        bool any = false, taken = take_samples(s, t);
        *changed = taken || *changed;
        pack_y(s, s->part.q, s->part.qd, y);
        status = settle_modes(s, t, y, true, &any);
        if (e->friction && status == KEMPE_SIMULATOR_GOES)
            status = decide_friction(s, t, y, &later, &taken);
        more = meets_events(s);
    }
    return status;
}

/* Decides at t, at the placed state before: the event of the last step, conditions, states that are due, friction.
 * *changed: the state or its modes. The state after, in y too, is placed and complete. */
static kempe_simulator_status pass_instant(kempe_simulator *s, double t, double *y, occasion at, bool *changed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    kempe_simulator_status status = KEMPE_SIMULATOR_GOES;
    *changed = at.event;
    if (!at.event)
        clear(e->conditions, part->flip);
    if (e->friction && at.event)
        status = release_friction(s, t, y);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    if (e->switches && take_samples(s, t)) {
        *changed = true;
        pack_y(s, part->q, part->qd, y);
    }
    copy(e->coordinates, part->qd, part->dqd);
    if (at.event && !flip_modes(s, t))
        return KEMPE_SIMULATOR_FAILED;
    status = settle_states(s, t, y, &at, changed);
    pack_y(s, part->q, part->qd, y);
    return status;
}

/* Decides at the start: samples that are due, conditions, and states that begin with the value of their input. */
static kempe_simulator_status pass_start(kempe_simulator *s, double t, double *y)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    bool changed = false, more = false;
    clear(e->discrete.states, part->due);
    for (int k = 0; k < e->discrete.states; k++)
        part->number[k] = e->discrete.period[k] < INFINITY ? kmp_first_sample(t, e->discrete.period[k]) : 1;
    evaluate_rates(s);
    (void)take_samples(s, t);
    pack_y(s, part->q, part->qd, y);
    kempe_simulator_status status = settle_modes(s, t, y, false, &changed);
    for (int k = 0; k < e->discrete.states; k++) {
        part->due[k] = e->discrete.settles[k] && holds(s, k);
        more = more || part->due[k] > 0;
    }
    if (more && status == KEMPE_SIMULATOR_GOES) {
        (void)take_samples(s, t);
        pack_y(s, part->q, part->qd, y);
        status = settle_modes(s, t, y, false, &changed);
    }
    if (e->friction && status == KEMPE_SIMULATOR_GOES && !(part->state[AT_ENDED] > 0)) {
        part->state[AT_RATE] = rate_of_motion(s);
        e->friction->begin(e->friction, part->decisions);
        status = check_overlap(s, t);
        if (status == KEMPE_SIMULATOR_GOES)
            status = strike_contacts(s, t);
        if (status == KEMPE_SIMULATOR_GOES)
            status = settle_friction(s, t, y, 0);
    }
    for (int k = 0; k < e->discrete.states; k++)
        part->was[k] = holds(s, k);
    note_branches(s, part->value);
    take_branches(s);
    return status;
}
