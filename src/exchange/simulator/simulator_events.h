/* SPDX-License-Identifier: BSD-3-Clause */
/* Search of events in a step. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_dense.h"
#include "integrators/events/watch_site.h"

/* The values of conditions at t within the last step, which is placed; with its accelerations if `rates`. */
static outcome look_at(kempe_simulator *s, double t, bool rates, double *value)
{
    struct kempe_simulator_parts *part = &s->part;
    outcome said = interpolate(s, t, part->probe);
    if (said != GOOD)
        return said;
    place_y(s, part->probe);
    said = close_loops(s, t, NULL);
    if (said != GOOD)
        return said;
    evaluate_rates(s);
    if (rates || !s->equations->early) {
        said = accelerate(s, t);
        if (said != GOOD)
            return said;
        complete(s);
    }
    evaluate_changes(s, t, value);
    return GOOD;
}

/* Cuts the step at the place where it has an event, at t. `flip` has the conditions that change there. */
static void cut_step(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    for (int k = 0; k < s->equations->conditions; k++)
        if (part->flip[k] > 0 && kind_of(s, k) == KMP_CONDITION_ENDS) {
            part->flip[k] = 0;
            part->state[AT_ENDED] = part->state[AT_ENDED] > 0 ? part->state[AT_ENDED] : k + 1;
        }
    pack_y(s, part->q, part->qd, part->y_new);
    part->state[AT_END] = t;
    part->state[AT_EVENT] = part->state[AT_FRESH] = 1;
    part->state[AT_EXCHANGE] = is_choice_bad(s, KMP_EXCHANGE_GROWTH);
}

/* -- the site of kempe_events.c ------------------------------------------------------------------------------ */

/* The simulator that watches; the last outcome that is not good. */
typedef struct event_watcher {
    kempe_simulator *s;
    outcome said;
} event_watcher;

/* Ends of the step are there. */
static int look_within(void *self, double t, double *change, double *solved)
{
    event_watcher *w = self;
    kempe_simulator *s = w->s;
    const kempe_watch *watch = s->equations->watch;
    const double *state = s->part.state;
    if (t == state[AT_BEGIN] || t == state[AT_END])
        take_place(s, t == state[AT_END] ? s->part.end : s->part.begin);
    else
        w->said = look_at(s, t, true, change);
    if (w->said != GOOD)
        return 1;
    if (!watch->values) {
        evaluate_changes(s, t, change);
        return 0;
    }
    kempe_arguments at = arguments_at(s, t);
    double *value = s->part.watched + numbers_of_watch(s->equations) - s->equations->conditions - watch->solved;
    watch->values(&at, value);
    copy(s->equations->conditions, value, change);
    copy(watch->solved, value + s->equations->conditions, solved);
    return 0;
}

static bool is_sense(const kempe_simulator *s, int k, bool of_contact)
{
    const kempe_friction *friction = s->equations->friction;
    bool found = false;
    for (int i = 0; friction && i < friction->elements; i++)
        found = found || (friction->slot[i] == k && (friction->contact[i] || !of_contact));
    return found;
}

static bool may_change(const void *self, int k)
{
    const kempe_simulator *s = ((const event_watcher *)self)->s;
    return kmp_condition_may_change(kind_of(s, k), is_sense(s, k, false), s->part.modes + k);
}

static bool is_held(const void *self, int k)
{
    const kempe_simulator *s = ((const event_watcher *)self)->s;
    return kmp_condition_holds(kind_of(s, k), s->part.modes[k]);
}

/* -- location of an event ------------------------------------------------------------------------------------ */

static int look_alone(void *self, double t)
{
    event_watcher *w = self;
    w->said = look_at(w->s, t, false, w->s->part.changes + w->s->equations->conditions);
    return w->said != GOOD;
}

static bool is_contact(const void *self, int k)
{
    return is_sense(((const event_watcher *)self)->s, k, true);
}

/* Ends a piece that its ends decide. The step then ends at the earliest change of a condition. */
static int end_piece(void *self, double from, const double *before, double to, const double *change, bool *found)
{
    event_watcher *w = self;
    kempe_simulator *s = w->s;
    struct kempe_simulator_parts *part = &s->part;
    const kempe_equations *e = s->equations;
    const int count = e->conditions;
    double *value = part->changes + count;
    if (any_differs(s, change)) {
        const kmp_location_site site = {w,    count, e->condition_kind, part->modes, value, look_alone,
                                        NULL, NULL,  is_contact};
        copy(count, change, value);
        int status = kmp_location_earliest(&site, from, before, &to);
        for (int k = 0; k < count; k++)
            part->flip[k] = status == 0 && differs(s, k, value[k]);
        if (status == 0)
            status = kmp_location_surface(&site, from, &to);
        if (status == 0)
            cut_step(s, to);
        *found = status == 0;
        return status;
    }
    note_sizes(s, change);
    for (int k = 0; k < count; k++)
        if (kind_of(s, k) == KMP_CONDITION_TOLD && change[k] < 0)
            snprintf(s->message, sizeof s->message, "%s: %s at t = %.9g: the table goes straight on there", e->name,
                     e->condition_names[k], to);
    return 0;
}

/* Notes the branches of free kinks at the end of the last step. *again: the step has passed one, which now has the
 * branch of the start of the step. */
static outcome hold_branches(kempe_simulator *s, const double *end, bool *again)
{
    struct kempe_simulator_parts *part = &s->part;
    const int count = s->equations->conditions;
    double *near = part->changes + count;
    note_branches(s, end);
    bool any = false;
    for (int k = 0; k < count; k++)
        any = any || fabs(part->flip[k]) > 1;
    *again = false;
    if (!any)
        return GOOD;
    const outcome said = look_at(s, part->state[AT_BEGIN] + KMP_STEP_NEAR * part->state[AT_TAKEN], false, near);
    for (int k = 0; said == GOOD && k < count; k++)
        *again = *again ||
                 (fabs(part->flip[k]) > 1 && kmp_kink_is_passed(near[k], end[k], within_kinks(s), part->largest[k]));
    if (*again) {
        note_branches(s, near);
        take_branches(s);
    }
    return said;
}

/* The length with which a step is made again up to the event found; 0: it is not. */
static double shortened(const kempe_simulator *s)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double begin = part->state[AT_BEGIN];
    bool parts = false, rough = false;
    for (int k = 0; k < s->equations->conditions; k++) {
        const int traits = s->equations->watch->traits[k];
        const bool changes = part->flip[k] > 0;
        parts = parts || (changes && (traits & KEMPE_WATCH_PRESSES) != 0 && part->modes[k] > 0);
        rough = rough || (changes && (traits & KEMPE_WATCH_ROUGH) != 0);
    }
    return s->settings.fixed_step > 0
               ? 0
               : kmp_restart_again(begin, part->state[AT_END], begin + part->state[AT_TAKEN], parts, rough);
}

/* Finds the first change of a condition within the last step, whose ends are complete. *again: the length with which
 * the step is to be made again; 0: it is not. */
static outcome find_event(kempe_simulator *s, double *again)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    event_watcher w = {s, GOOD};
    const kmp_watch_site site = {&w,          e->conditions, part->q,  part->qd,   part->qdd,     part->lambda,
                                 part->modes, part->chart,   s->p,     part->held, part->changes, look_within,
                                 may_change,  is_held,       end_piece};
    int found = 0;
    const int status =
        e->watch->search(e->watch, s->part.watched, &site, part->state[AT_BEGIN], part->state[AT_END], &found);
    if (status >= KMP_WATCH_UNDECIDED) {
        fail_with(s,
                  "%s: whether this changes is not decided in the step from t = %.9g on, by as many evaluations as a "
                  "step may have: set 'longest' in the settings",
                  e->condition_names[status - KMP_WATCH_UNDECIDED], part->state[AT_BEGIN]);
        return TOLD;
    }
    if (status != 0)
        return w.said;
    bool passed = false;
    const outcome said = found ? GOOD : hold_branches(s, part->changes, &passed);
    *again = found ? shortened(s) : passed ? part->state[AT_TAKEN] : 0;
    return said;
}
