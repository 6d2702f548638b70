/* SPDX-License-Identifier: BSD-3-Clause */
/* Search of events in a step. A part of kempe_simulator.c. */
#ifndef SIMULATOR_EVENTS_H
#define SIMULATOR_EVENTS_H

#include "exchange/simulator/simulator_dense.h"
#include "integrators/events/watch_site.h"

/* Places the motion at part x of the last step by polynomials through both ends with their accelerations: a few
 * roundings of a step's error away, without evaluations. Multipliers are not those of the motion. */
static void estimate(kempe_simulator *s, double x)
{
    struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates;
    const double *begin = part->begin, *end = part->end;
    double h = part->state[AT_TAKEN];
    for (int i = 0; i < n; i++) {
        double p0 = begin[i], p1 = h * begin[n + i], p2 = 0.5 * h * h * begin[2 * n + i];
        double a = end[i] - p0 - p1 - p2, b = h * end[n + i] - p1 - 2 * p2, c = 0.5 * (h * h * end[2 * n + i] - 2 * p2);
        double p3 = 10 * a - 4 * b + c, p4 = -15 * a + 7 * b - 2 * c, p5 = 6 * a - 3 * b + c;
        part->q[i] = p0 + x * (p1 + x * (p2 + x * (p3 + x * (p4 + x * p5))));
        part->qd[i] = (p1 + x * (2 * p2 + x * (3 * p3 + x * (4 * p4 + x * 5 * p5)))) / h;
        part->qdd[i] = (2 * p2 + x * (6 * p3 + x * (12 * p4 + x * 20 * p5))) / (h * h);
    }
}

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

/* Narrows the first change between parts `near` and `far` of the step to *t, where it has happened, with the values
 * there. */
static outcome narrow(kempe_simulator *s, double near, double f_near, double far, double f_far, double *t)
{
    struct kempe_simulator_parts *part = &s->part;
    double begin = part->state[AT_BEGIN], *value = part->changes + s->equations->conditions;
    double tolerance = fmax(4 * DBL_EPSILON * fmax(fabs(near), fabs(far)), 1e-14 * (far - near)), x;
    kmp_bracket b = kmp_bracket_of(near - begin, f_near, far - begin, f_far);
    while (kmp_bracket_next(&b, tolerance, &x)) {
        outcome said = look_at(s, begin + x, false, value);
        if (said != GOOD)
            return said;
        double f = most_beyond(s, value);
        kmp_bracket_take(&b, x, f, f > 0);
    }
    *t = begin + b.far;
    return look_at(s, *t, false, value);
}

/* Cuts the step at t, where the values have changed. */
static void cut_step(kempe_simulator *s, double t, const double *value)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    for (int k = 0; k < e->conditions; k++) {
        bool changes = beyond(s, k, value[k]) > 0;
        part->flip[k] = changes && e->condition_kind[k] != KEMPE_CONDITION_ENDS;
        if (changes && e->condition_kind[k] == KEMPE_CONDITION_ENDS && !(part->state[AT_ENDED] > 0))
            part->state[AT_ENDED] = k + 1;
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
    bool exact;
} event_watcher;

/* Ends of the step are there; others are estimated or evaluated. */
static int look_within(void *self, double t, double *change, double *solved)
{
    event_watcher *w = self;
    kempe_simulator *s = w->s;
    const kempe_watch *watch = s->equations->watch;
    const double *state = s->part.state;
    if (t == state[AT_BEGIN] || t == state[AT_END])
        take_place(s, t == state[AT_END] ? s->part.end : s->part.begin);
    else if (w->exact)
        w->said = look_at(s, t, true, change);
    else
        estimate(s, (t - state[AT_BEGIN]) / state[AT_TAKEN]);
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

/* Rates of elements at rest that other rows keep are zero by them, which bounds do not know: they are watched at ends
 * of steps. */
static bool may_change(const void *self, int k)
{
    const kempe_simulator *s = ((const event_watcher *)self)->s;
    const kempe_friction *friction = s->equations->friction;
    const double *mode = s->part.modes + k;
    const int kind = s->equations->condition_kind[k];
    if (kind != KEMPE_CONDITION_PASSES)
        return kind == KEMPE_CONDITION_KINK ? *mode != 0 : kind < KEMPE_CONDITION_NUMBER;
    for (int i = 0; i < friction->elements; i++)
        if (friction->slot[i] == k)
            return *mode != 0 && mode[KMP_ROLE_HELD - KMP_ROLE_SENSE] == 0;
    return *mode > 0 || mode[KMP_ROLE_GIVEN - KMP_ROLE_HELD] != 0;
}

static bool is_held(const void *self, int k)
{
    const kempe_simulator *s = ((const event_watcher *)self)->s;
    return s->part.modes[k] > 0 && s->equations->condition_kind[k] != KEMPE_CONDITION_PASSES;
}

/* Looks for the change between two times; *found: the step now ends there. */
static outcome find_between(kempe_simulator *s, double near, double far, bool *found)
{
    struct kempe_simulator_parts *part = &s->part;
    double *value = part->changes + s->equations->conditions, t = 0, begin = part->state[AT_BEGIN];
    outcome said = look_at(s, far, false, value);
    double f_far = said == GOOD ? most_beyond(s, value) : 0;
    if (said != GOOD || !(f_far > 0))
        return said;
    said = look_at(s, near, false, value);
    double f_near = said == GOOD ? most_beyond(s, value) : 0;
    if (f_near > 0 && near > begin) {
        far = near;
        f_far = f_near;
        near = begin;
        f_near = 0;
    }
    if (said == GOOD)
        said = narrow(s, near, f_near, far, f_far, &t);
    if (said == GOOD) {
        cut_step(s, t, value);
        *found = true;
    }
    return said;
}

static int end_piece(void *self, double from, double to, const double *change, bool *found)
{
    event_watcher *w = self;
    const kempe_equations *e = w->s->equations;
    if (most_beyond(w->s, change) > 0)
        w->said = find_between(w->s, from, to, found);
    if (w->said == GOOD && !*found)
        note_sizes(w->s, change);
    for (int k = 0; w->said == GOOD && !*found && k < e->conditions; k++)
        if (e->condition_kind[k] == KEMPE_CONDITION_TOLD && change[k] < 0)
            snprintf(w->s->message, sizeof w->s->message, "%s: %s at t = %.9g: the table goes straight on there",
                     e->name, e->condition_names[k], to);
    return w->said != GOOD;
}

/* Notes the branches of free kinks at the end of the last step. *again: the step has passed one, which now has the
 * branch of the start of the step. */
static void hold_branches(kempe_simulator *s, const double *end, bool *again)
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
        return;
    estimate(s, KMP_STEP_NEAR);
    evaluate_changes(s, part->state[AT_BEGIN] + KMP_STEP_NEAR * part->state[AT_TAKEN], near);
    for (int k = 0; k < count; k++)
        *again = *again || (fabs(part->flip[k]) > 1 && (near[k] < 0) != (end[k] < 0) && branch_of(s, k, near[k]) != 0);
    if (*again) {
        note_branches(s, near);
        take_branches(s);
    }
}

/* The length with which a step is made again up to the event found; 0: it is not. At the end of a compliant contact the
 * law is continued beyond by the modulus of the depth, with a kink: the polynomial of a step that meets it is wrong
 * before it too. So is that of a step over a point of a table, or into a narrow hill. */
static double shortened(const kempe_simulator *s)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double taken = part->state[AT_TAKEN];
    const double h = (1 + KMP_STEP_BEYOND) * (part->state[AT_END] - part->state[AT_BEGIN]);
    const bool shorter = h * (1 + KMP_STEP_BEYOND) < taken && h > KMP_STEP_AT_ONCE * taken;
    bool meets = false;
    for (int k = 0; k < s->equations->conditions; k++) {
        const int traits = s->equations->watch->traits[k];
        const bool ends = (traits & KEMPE_WATCH_PRESSES) != 0 && part->modes[k] > 0;
        meets = meets || (part->flip[k] > 0 && (ends || ((traits & KEMPE_WATCH_ROUGH) != 0 && shorter)));
    }
    return meets && h < taken && !(s->settings.fixed_step > 0) ? h : 0;
}

/* Finds the first change of a condition within the last step, whose ends are complete. Conditions of multipliers and of
 * solved equations are evaluated, not estimated. *again: the length with which the step is to be made again; 0: it is
 * not. */
static outcome find_event(kempe_simulator *s, double *again)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    event_watcher w = {s, GOOD, !e->early || e->watch->solved > 0 || friction_rests(s)};
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
    if (!found)
        hold_branches(s, part->changes, &passed);
    *again = found ? shortened(s) : passed ? part->state[AT_TAKEN] : 0;
    return GOOD;
}

#endif
