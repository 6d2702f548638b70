/* SPDX-License-Identifier: BSD-3-Clause */
/* The earliest event of a step of a run (integrators/events/event_pieces.h). Bounds use cubics for the coordinates,
 * through their values and rates at both ends of the piece. Accelerations, multipliers and solutions of implicit
 * blocks, with unknown rates, are parabolas through the values at both ends and in the middle. Then the
 * conditions change. */
#include "integrators/run/events.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/validity.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/link_tree.h"
#include "integrators/decide/event_location.h"
#include "integrators/decide/restart.h"
#include "model/data/body.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_value.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* Of the range of a table: a motion that passes its end by less does not leave it. */
#define AT_END 1e-6

/* Beyond all numbers of a motion, with a finite square. */
#define HUGE_NUMBER 1e100

enum { CLOSELY = 2 }; /* least number of halvings in a run that checks another one */

/* -- evaluation ---------------------------------------------------------------------------------------- */

/* True if the value of condition k violates its validity. */
static bool is_invalid(const kmp_event_tracker *c, int k, double change)
{
    return kmp_condition_invalid(&c->s->events.condition[k], change, c->past[k].largest);
}

/* Notes that a table is left, or a level negative, at one of the places that have been evaluated, or forgets it: it
 * need not be found. */
static void note_outside(kmp_event_tracker *c, const double *change)
{
    for (int k = 0; c->watches_validity && k < c->s->events.count; k++)
        c->past[k].outside = change && (c->past[k].outside || is_invalid(c, k, change[k]));
}

/* Completes the state at t and evaluates the conditions there, into a probe. */
static int look_at(void *self, double t, kmp_event_probe *probe)
{
    kmp_event_tracker *c = self;
    const size_t n = (size_t)c->s->n, size = n * sizeof(double);
    KMP_TRY(kmp_event_tracker_look(c, t));
    probe->t = t;
    memcpy(probe->change, c->change, (size_t)c->s->events.count * sizeof(double));
    memcpy(probe->state, c->q, size);
    memcpy(probe->state + n, c->qd, size);
    if (c->s->changes_by_rates) {
        memcpy(probe->state + 2 * n, c->qdd, size);
        memcpy(probe->state + 3 * n, c->lambda, (size_t)c->s->m * sizeof(double));
    }
    for (int i = 0, at = 0; i < 2; at += c->search.solved[i++])
        if (c->search.solved[i] > 0)
            memcpy(probe->solved + at, c->eval->conditions.solved[i], (size_t)c->search.solved[i] * sizeof(double));
    note_outside(c, probe->change);
    return KEMPE_OK;
}

static bool any_differs(const kmp_event_tracker *c, const kmp_event_probe *probe)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (kmp_event_tracker_differs(c, k, probe->change[k]))
            return true;
    return false;
}

/* The largest value of the parabola through three points in turn, the middle one above the others. */
static double vertex(const double *t, const double *x, double t2, double x2)
{
    double h0 = t[1] - t[0], h1 = t2 - t[1], s0 = (x[1] - x[0]) / h0, s1 = (x2 - x[1]) / h1;
    double bend = (s1 - s0) / (h0 + h1), slope = s0 + bend * h0; /* of the parabola, at the middle point */
    return bend < 0 ? x[1] - 0.25 * slope * slope / bend : x[1];
}

/* The largest size of a measured condition, also between steps. */
static void note_peak(kmp_event_tracker *c, int k, double t, double size)
{
    kmp_last_values *v = &c->past[k].latest;
    if (v->count > 0 && !(t > v->t[1]))
        return;
    if (v->count == 2 && v->x[1] >= v->x[0] && v->x[1] >= size)
        c->past[k].peak = fmax(c->past[k].peak, vertex(v->t, v->x, t, size));
    v->t[0] = v->t[1];
    v->x[0] = v->x[1];
    v->t[1] = t;
    v->x[1] = size;
    v->count = v->count > 0 ? 2 : 1;
}

/* True if the violation of condition k has been reported: of a table at either of its ends and calls, of a friction by
 * any of its levels. */
static bool is_reported(const kmp_event_tracker *c, int k)
{
    const kmp_condition *condition = c->s->events.condition;
    for (int i = 0; i < c->s->events.count; i++)
        if (c->past[i].reported && kmp_validities_equal(&condition[i], &condition[k]))
            return true;
    return false;
}

static void log_table(const kmp_event_tracker *c, const kmp_condition *condition, double value, double t)
{
    double x;
    if (condition->validity != KMP_VALIDITY_TABLE)
        return;
    const kmp_named_table *table = condition->expr->table;
    const int end = kmp_validity_end(condition, value, &x);
    kmp_run_log_add(c->plan.log, "table", t, x, NAN, "table '%s' is used at %.6g, beyond its points %.6g .. %.6g",
                    table->name, x, kmp_table_end(table, end & ~1), kmp_table_end(table, end | 1));
}

/* Reports the tables that the motion has left, and the levels that are negative, by an evaluation at t. */
static void event_tracker_report(kmp_event_tracker *c, double t, const double *change)
{
    for (int k = 0; c->watches_validity && k < c->s->events.count; k++) {
        const kmp_condition *condition = &c->s->events.condition[k];
        if (condition->validity == KMP_VALIDITY_LEVEL)
            c->past[k].largest = fmax(c->past[k].largest, fabs(change[k]));
        if (!is_invalid(c, k, change[k]))
            continue;
        atomic_store_explicit(&c->s->left[k], true, memory_order_relaxed);
        const bool reported = is_reported(c, k);
        c->past[k].reported = true;
        if (reported)
            continue;
        log_table(c, condition, change[k], t);
        kmp_doubt_condition(c->s, condition, change[k], t);
    }
}

/* Records the sizes of values at a point where no condition has changed. */
static void note_sizes(kmp_event_tracker *c, double t, const double *change)
{
    for (int k = 0; k < c->s->events.count; k++) {
        c->past[k].most = fmax(c->past[k].most, fabs(change[k]));
        if (c->s->events.condition[k].measured && c->mode[k] > 0)
            note_peak(c, k, t, fabs(change[k]));
    }
    event_tracker_report(c, t, change);
}

/* -- bounds over a piece ------------------------------------------------------------------------------ */

/* Bound of the time, or of an input of the model: a cubic between its ends, of a derivative one of lower degree. */
static kmp_bound time_over(const kmp_event_tracker *c, uint32_t index, const kmp_step_piece *p)
{
    double a[KMP_TIME_NUMBERS + 2] = {0}, b[KMP_TIME_NUMBERS + 2] = {0};
    if (index == 0)
        return (kmp_bound){p->a->t, p->b->t, 1, 1};
    const kmp_signal_piece *cubic = &c->inputs->piece[(index - 1) / KMP_TIME_NUMBERS];
    uint32_t d = (index - 1) % KMP_TIME_NUMBERS;
    kmp_signal_values(cubic, p->a->t, a);
    kmp_signal_values(cubic, p->b->t, b);
    a[KMP_TIME_NUMBERS] = b[KMP_TIME_NUMBERS] = 6 * cubic->c[3];
    return kmp_bound_over(p->b->t - p->a->t, a[d], a[d + 1], b[d], b[d + 1]);
}

static kmp_bound input_over(const kmp_event_tracker *c, const kmp_program_input *in, const kmp_step_piece *p)
{
    size_t n = (size_t)c->s->n, i = in->index;
    const double *x = p->a->state, *y = p->b->state;
    double h = p->b->t - p->a->t;
    switch (in->kind) {
    case KMP_IN_TIME:
        return time_over(c, in->index, p);
    case KMP_IN_Q:
        return kmp_bound_over(h, x[i], x[n + i], y[i], y[n + i]);
    case KMP_IN_QD:
        return kmp_bound_over(h, x[n + i], x[2 * n + i], y[n + i], y[2 * n + i]);
    case KMP_IN_MODE:
        return kmp_bound_still(c->mode[i]);
    case KMP_IN_CHART:
        return kmp_bound_still(c->eval->chart[i]);
    case KMP_IN_PARAMETER:
        return kmp_bound_still(c->parameters[i]);
    default: /* accelerations and multipliers */
        i += in->kind == KMP_IN_QDD ? 2 * n : 3 * n;
        return p->m ? kmp_bound_through(h, x[i], p->m->state[i], y[i]) : kmp_bound_still(x[i]);
    }
}

/* Says which conditions are wanted; false: all bounds are, with constants that have changed. */
static bool want_bounds(kmp_event_tracker *c, const bool *wanted)
{
    kmp_event_search *s = &c->search;
    if (s->charts != c->eval->chart_version)
        return false;
    kmp_bounds_want(s->bounds, c->s->events.count, s->output, wanted);
    return true;
}

static void run_bounds(kmp_event_tracker *c, bool few)
{
    if (few)
        kmp_bounds_run_wanted(c->search.bounds);
    else
        kmp_bounds_run(c->search.bounds, true);
    c->search.charts = c->eval->chart_version;
}

static void bind(void *self, const kmp_step_piece *p, const bool *open)
{
    kmp_event_tracker *c = self;
    const kmp_program *program = c->s->changes;
    kmp_event_search *s = &c->search;
    for (int k = 0; k < program->input_count && !s->stills; k++)
        kmp_bounds_set(s->bounds, k, input_over(c, &program->input[k], p));
    for (int i = 0; i < s->move_count; i++)
        if (s->bounds->chooses[s->moves[i]])
            kmp_bounds_set(s->bounds, s->moves[i], input_over(c, &program->input[s->moves[i]], p));
    const bool few = want_bounds(c, open);
    for (int i = 0; i < s->move_count && s->stills; i++)
        if (!few || kmp_bounds_needs(s->bounds, s->moves[i]))
            kmp_bounds_set(s->bounds, s->moves[i], input_over(c, &program->input[s->moves[i]], p));
    s->stills = true;
    for (int i = 0, at = 0; p->m && i < 2; i++)
        for (int k = 0; k < s->solved[i]; k++, at++)
            if (kmp_bounds_is_solved(s->bounds, s->first_solved[i] + k))
                kmp_bound_give(
                    s->bounds->value, s->bounds->output[s->first_solved[i] + k],
                    kmp_bound_through(p->b->t - p->a->t, p->a->solved[at], p->m->solved[at], p->b->solved[at]));
    run_bounds(c, few);
}

/* A motion that passes the value zero of condition k of validity by less does not pass it. */
static double validity_slack(const kmp_event_tracker *c, int k)
{
    const kmp_condition *condition = &c->s->events.condition[k];
    if (condition->validity == KMP_VALIDITY_LEVEL)
        return KMP_LEVEL_ROUNDING * c->past[k].largest;
    if (condition->validity == KMP_VALIDITY_DEFLECTION)
        return KMP_DEFLECTION_SLACK;
    if (condition->validity == KMP_VALIDITY_ROTATION)
        return 0;
    const kmp_named_table *table = condition->expr->table;
    const int end = condition->number - kmp_table_end_number(table, 0);
    return AT_END * (kmp_table_end(table, end | 1) - kmp_table_end(table, end & ~1));
}

static kmp_bound bound_of(const void *self, int k)
{
    const kmp_event_tracker *c = self;
    const kmp_condition *condition = &c->s->events.condition[k];
    kmp_bound bound = kmp_bounds_get(c->search.bounds, c->search.output[k]);
    if (condition->validity == KMP_VALIDITY_NONE)
        return bound;
    const double slack = validity_slack(c, k);
    bound.low += slack;
    bound.high += slack;
    return c->past[k].reported || c->past[k].outside ? kmp_bound_still(1) : bound;
}

static bool holds(const void *self, int k)
{
    const kmp_event_tracker *c = self;
    return kmp_condition_holds((kmp_condition_kind)c->kind[k], c->mode[k]);
}

/* The end of a table is bounded until it has been left. Small deflections at both ends of a step are not bounded, and
 * rates never are: steps resolve vibrations. */
static bool may_change(const void *self, int k)
{
    const kmp_event_tracker *c = self;
    if (c->search.away.now && c->search.away.far[k])
        return false;
    const bool sense = c->s->events.condition[k].role == KMP_ROLE_SENSE;
    if (c->s->events.condition[k].validity == KMP_VALIDITY_ROTATION || c->never[k])
        return false;
    if (c->s->events.condition[k].validity == KMP_VALIDITY_DEFLECTION &&
        fmin(c->search.ends[0]->change[k], c->search.ends[1]->change[k]) > KMP_DEFLECTION_SMALL)
        return false;
    return c->kind[k] == KMP_CONDITION_VALIDITY ||
           kmp_condition_may_change((kmp_condition_kind)c->kind[k], sense, &c->mode[k]);
}

/* -- contacts that are far away ------------------------------------------------------------------------- */

enum {
    FAR_LEAST = 24, /* open contacts from which on a box pays */
    FAR_STEPS = 8,  /* lengths of the step in which rates as now stay within the box */
    FAR_LASTS = 16  /* steps after which the box is computed again, because one around long steps is wide */
};
#define FAR_PART 1e-3 /* of the size of a coordinate: a box is at least so much wider than the step */

/* True for inputs that a distance can depend on, which change within a step. */
static bool is_placing(const kmp_program_input *in)
{
    return in->kind == KMP_IN_TIME || in->kind == KMP_IN_Q;
}

static bool is_in_box(const kmp_event_tracker *c, const kmp_step_piece *p)
{
    const kmp_event_search *s = &c->search;
    bool inside = s->away.known && s->away.steps < FAR_LASTS && s->away.charts == c->eval->chart_version;
    const int held = KMP_ROLE_HELD - KMP_ROLE_SENSE;
    for (int k = 0; inside && k < c->s->events.count; k++)
        if (s->away.far[k] || c->s->events.condition[k].role == KMP_ROLE_NONE)
            inside = s->away.mode[k] == c->mode[k] && (!s->away.far[k] || s->away.mode[k + held] == c->mode[k + held]);
    for (int i = 0; inside && i < s->move_count; i++) {
        const kmp_program_input *in = &c->s->changes->input[s->moves[i]];
        if (!is_placing(in))
            continue;
        const kmp_bound bound = input_over(c, in, p);
        inside = bound.low >= s->away.low[i] && bound.high <= s->away.high[i];
    }
    return inside;
}

/* Sets the bounds of the inputs to a box that contains their values within the step. */
static void take_box(kmp_event_tracker *c, const kmp_step_piece *p)
{
    kmp_event_search *s = &c->search;
    const kmp_program *program = c->s->changes;
    for (int k = 0; k < program->input_count; k++)
        kmp_bounds_set(s->bounds, k, input_over(c, &program->input[k], p));
    for (int i = 0; i < s->move_count; i++) {
        const kmp_program_input *in = &program->input[s->moves[i]];
        if (!is_placing(in))
            continue;
        kmp_bound bound = input_over(c, in, p);
        const double least = in->kind == KMP_IN_Q ? FAR_PART * c->s->scale[in->index] : 0;
        const double reach = FAR_STEPS * (p->b->t - p->a->t) * fmax(fabs(bound.down), fabs(bound.up)) + least;
        s->away.low[i] = bound.low -= reach;
        s->away.high[i] = bound.high += reach;
        kmp_bounds_set(s->bounds, s->moves[i], bound);
    }
}

/* Finds the contacts whose surfaces do not meet within a box around the step: their distance without the part that
 * counts as none has a positive bound. */
static void find_far(kmp_event_tracker *c, const kmp_step_piece *p)
{
    kmp_event_search *s = &c->search;
    const int place = KMP_ROLE_PLACE - KMP_ROLE_SENSE;
    int asked = 0;
    for (int k = 0; k < c->s->events.count; k++) {
        /* The distance of an open contact that depends only on places and times may be far from zero. */
        const kmp_condition *condition = &c->s->events.condition[k];
        s->away.asked[k] = c->size[k] > 0 && c->mode[k] != 0 && c->mode[k + KMP_ROLE_HELD - KMP_ROLE_SENSE] == 0 &&
                           !condition->late && !condition->by_rates && !s->third[k];
        s->away.far[k] = false;
        s->away.mode[k] = c->mode[k];
        asked += s->away.asked[k];
    }
    s->away.known = asked >= FAR_LEAST;
    s->away.steps = 0;
    if (!s->away.known)
        return;
    take_box(c, p);
    run_bounds(c, want_bounds(c, s->away.asked));
    for (int k = 0; k < c->s->events.count; k++)
        s->away.far[k] = s->away.asked[k] && kmp_bounds_get(s->bounds, s->output[k]).low > fmax(c->mode[k + place], 0);
    s->away.charts = c->eval->chart_version;
    s->stills = false;
    for (int k = 0; k < c->s->events.count; k++) /* events that remain, whatever their modes will be */
        s->away.asked[k] = c->kind[k] != KMP_CONDITION_NUMBER && !s->away.far[k];
    for (int k = 0; k < c->s->events.count; k++)
        if (s->away.far[k])
            s->away.asked[k + KMP_ROLE_HELD - KMP_ROLE_SENSE] = false;
}

/* Before a step is searched: the contacts that are far away within it. */
static void watch_far(kmp_event_tracker *c, const kmp_step_piece *p)
{
    kmp_event_search *s = &c->search;
    const bool inside = is_in_box(c, p);
    if (!inside) {
        kmp_bounds_limit(s->bounds, 0, NULL, NULL);
        find_far(c, p);
    }
    s->away.steps++;
    s->away.now = s->away.known;
    if (s->away.now && (!inside || !s->away.limits))
        kmp_bounds_limit(s->bounds, c->s->events.count, s->output, s->away.asked);
    s->away.limits = s->away.now;
}

static void forget_far(kmp_event_tracker *c)
{
    c->search.away.known = c->search.away.now = c->search.away.limits = false;
    kmp_bounds_limit(c->search.bounds, 0, NULL, NULL);
}

/* -- narrowing --------------------------------------------------------------------------------------- */

static int look_alone(void *self, double t)
{
    return kmp_event_tracker_look(self, t);
}

/* A distance depends only on the place, and is looked for at many. */
static int look_for(void *self, double t, int k)
{
    kmp_event_tracker *c = self;
    const kmp_condition *condition = &c->s->events.condition[k];
    if (condition->late)
        return kmp_event_tracker_look(c, t);
    const kmp_state_depth depth = condition->by_rates ? KMP_STATE_RATES : KMP_STATE_PLACE;
    KMP_TRY(c->plan.state(c->plan.user, t, depth, false, c->q, c->qd, c->qdd, c->lambda));
    c->change[k] = kmp_eval_changes(c->eval, t, c->q, c->qd)[k];
    return KEMPE_OK;
}

static void note_before(void *self, int k, double value)
{
    kmp_event_tracker *c = self;
    c->past[k].most = fmax(c->past[k].most, fabs(value));
}

/* Records that a condition is the earliest one so far, and the distance that one with a lag has covered since its last
 * change, to distinguish chattering. */
static int note_crossing(void *self, int k, double low, double high)
{
    kmp_event_tracker *c = self;
    c->earliest = k;
    if (!(c->s->events.condition[k].lag > 0))
        return KEMPE_OK;
    KMP_TRY(kmp_event_tracker_look(c, low + (high - low) / 2));
    c->past[k].most = fmax(c->past[k].most, kmp_event_tracker_changed(c, k) ? 0 : fabs(c->change[k]));
    return kmp_event_tracker_look(c, high);
}

static double size_of(const void *self, int k)
{
    return ((const kmp_event_tracker *)self)->size[k];
}

/* -- the search -------------------------------------------------------------------------------------- */

/* Finds the earliest change in (a, b]. Leaves c there. */
static int find_earliest(kmp_event_tracker *c, const kmp_event_probe *a, const kmp_event_probe *b, double *t)
{
    const kmp_location_site location = {c,          c->s->events.count, c->kind,     c->mode,       c->change,
                                        look_alone, look_for,           note_before, note_crossing, size_of};
    *t = b->t;
    memcpy(c->change, b->change, (size_t)c->s->events.count * sizeof *c->change);
    const int status = kmp_location_earliest(&location, a->t, a->change, t);
    return status == KEMPE_OK ? kmp_location_surface(&location, a->t, t) : status;
}

/* Ends a piece that its ends decide. */
static int end_piece(void *self, const kmp_event_probe *a, const kmp_event_probe *b, bool *found)
{
    kmp_event_tracker *c = self;
    if (any_differs(c, b)) {
        *found = true;
        return find_earliest(c, a, b, &c->search.event);
    }
    note_sizes(c, b->t, b->change);
    return KEMPE_OK;
}

static const kmp_piece_site site = {look_at, bind, bound_of, may_change, holds, end_piece};

/* Late conditions have an output in both stages; the value of the first stage is zero. */
static void find_outputs(kmp_event_search *s, const kempe_system *system)
{
    const int *outputs = system->changes->outputs;
    int late = outputs[2];
    for (int k = 0; k < system->events.count; k++) {
        bool is_late = system->events.condition[k].late;
        s->output[k] = is_late ? late++ : outputs[1] + k;
        s->third[k] = is_late || s->bounds->given[s->output[k]];
    }
    s->first_solved[0] = outputs[1] + system->events.count;
    s->first_solved[1] = late;
    for (int i = 0; i < 2; i++)
        s->solved[i] = outputs[i + 2] - s->first_solved[i];
}

/* Allocates a search in the arena; false: no memory. */
static bool event_search_init(kmp_event_search *s, const kempe_system *system, bool closely, kmp_arena *arena)
{
    int count = system->events.count;
    s->charts = -1;
    s->bounds = kmp_bounds_new(system->changes, arena);
    const kmp_program *program = system->changes;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(int, count, &s->output), KMP_ROOM(int, program->input_count, &s->moves),
                        KMP_ROOM(bool, count, &s->third, &s->away.far, &s->away.asked),
                        KMP_ROOM(double, program->input_count, &s->away.low, &s->away.high),
                        KMP_ROOM(double, count, &s->away.mode),
                        KMP_ROOM(bool, count *(KMP_SEARCH_DEPTH + 1), &s->open)))
        return false;
    s->pieces = (kmp_piece_search){
        .site = &site, .conditions = count, .third = s->third, .open = s->open, .least = closely ? CLOSELY : 0};
    find_outputs(s, system);
    for (int k = 0; k < program->input_count; k++) {
        const kmp_input_kind kind = program->input[k].kind;
        if (kind != KMP_IN_MODE && kind != KMP_IN_CHART && kind != KMP_IN_PARAMETER)
            s->moves[s->move_count++] = k;
    }
    for (int i = 0; i < KMP_SEARCH_LOOKS; i++)
        KMP_ARENA_MAKE(arena, KMP_ROOM(double, count, &s->pieces.look[i].change),
                       KMP_ROOM(double, 3 * system->n + system->m, &s->pieces.look[i].state),
                       KMP_ROOM(double, s->solved[0] + s->solved[1], &s->pieces.look[i].solved));
    return !arena->failed;
}

/* Takes a value of a kink into account; true if it is free and due to be fixed. */
static bool is_away(kmp_event_tracker *c, int k, double change)
{
    return c->s->events.condition[k].kink && kmp_kink_is_away(c->mode[k], change, c->kink, &c->past[k].largest);
}

/* True if a free kink is away from zero in an evaluation at the end of a step. */
static bool event_tracker_would_hold(kmp_event_tracker *c, const double *change)
{
    bool any = false;
    for (int k = 0; c->kink > 0 && k < c->s->events.count; k++)
        any = is_away(c, k, change[k]) || any;
    return any;
}

bool kmp_event_tracker_is_clear(kmp_event_tracker *c, const kmp_event_probe *a, const kmp_event_probe *m,
                                const kmp_event_probe *b)
{
    c->search.pieces.self = c;
    c->search.stills = false;
    c->search.ends[0] = a;
    c->search.ends[1] = b;
    forget_far(c);
    note_outside(c, NULL);
    note_outside(c, b->change);
    if (m)
        note_outside(c, m->change);
    if (event_tracker_would_hold(c, b->change) || any_differs(c, b) || (m && any_differs(c, m)) ||
        !kmp_pieces_are_clear(&c->search.pieces, &(kmp_step_piece){a, m, b}))
        return false;
    if (m)
        note_sizes(c, m->t, m->change);
    note_sizes(c, b->t, b->change);
    return true;
}

void kmp_event_tracker_take(kmp_event_tracker *c, const double *mode, const double *parameters,
                            const kmp_present_inputs *inputs, kmp_condition_past *past)
{
    c->mode = mode;
    c->parameters = parameters;
    c->inputs = inputs;
    c->past = past;
    c->search.ready = false;
    c->search.charts = -1;
    forget_far(c);
    c->search.pieces.undecided = 0;
}

static kmp_event_probe *near_start(kmp_event_tracker *c)
{
    return &c->search.pieces.look[2];
}

bool kmp_event_tracker_hold_passed(kmp_event_tracker *c)
{
    bool passed = c->passed;
    if (passed) {
        kmp_event_tracker_hold_free(c, NULL, near_start(c)->change);
        c->search.ready = false;
    }
    return passed;
}

bool kmp_event_tracker_is_undecided(const kmp_event_tracker *c, kmp_text *why)
{
    const kmp_piece_search *pieces = &c->search.pieces;
    if (pieces->undecided > 0)
        kmp_text_printf(why,
                        "%s: the search for changes reached its limit of evaluations in the step from t = %.9g s on, "
                        "and may have missed one: set a max_step",
                        c->s->event_text[pieces->which], pieces->since);
    return pieces->undecided > 0;
}

kempe_status kmp_event_tracker_find(kmp_event_tracker *c, double from, double to, double *t, bool *found)
{
    kmp_event_search *s = &c->search;
    *found = false;
    c->end = -1;
    if (!(to > from))
        return KEMPE_OK;
    note_outside(c, NULL);
    bool ready = s->ready && s->pieces.look[0].t == from && s->charts == c->eval->chart_version;
    s->ready = false;
    if (!ready)
        KMP_TRY((kempe_status)look_at(c, from, &s->pieces.look[0]));
    KMP_TRY((kempe_status)look_at(c, to, &s->pieces.look[1]));
    s->pieces.self = c;
    s->stills = false;
    s->ends[0] = &s->pieces.look[0];
    s->ends[1] = &s->pieces.look[1];
    watch_far(c, &(kmp_step_piece){&s->pieces.look[0], NULL, &s->pieces.look[1]});
    const long before = s->pieces.undecided;
    KMP_TRY((kempe_status)kmp_pieces_search(&s->pieces, found));
    kmp_text why = {0};
    if (before == 0 && kmp_event_tracker_is_undecided(c, &why) && !why.failed)
        kmp_doubt(c->s->context, "%s", why.s);
    kmp_text_free(&why);
    if (*found) {
        *t = s->event;
        c->end = kmp_event_tracker_first_end(c);
        for (int k = 0; k < c->s->events.count; k++)
            c->located[k] = c->kind[k] == KMP_CONDITION_PASSES && (k == c->earliest || kmp_event_tracker_changed(c, k));
        return KEMPE_OK;
    }
    /* Free kinks that the step has not passed are fixed. */
    c->passed = false;
    if (event_tracker_would_hold(c, s->pieces.look[1].change)) {
        KMP_TRY((kempe_status)look_at(c, from + KMP_STEP_NEAR * (to - from), near_start(c)));
        kmp_event_tracker_hold_free(c, near_start(c)->change, s->pieces.look[1].change);
    }
    kmp_event_probe last = s->pieces.look[1];
    s->pieces.look[1] = s->pieces.look[0];
    s->pieces.look[0] = last;
    s->ready = true;
    return KEMPE_OK;
}

/* Changes of a condition with a lag count as simultaneous within this multiple of its lag. */
#define LAGS 100

/* The weight of the lightest body, N: a load that is much smaller is zero but for rounding. */
static double least_weight(const kempe_system *s)
{
    double least = INFINITY;
    for (int b = 1; b < s->model->body_count; b++) {
        const double mass = kmp_number_at(&s->model->bodies[b].mass, s->parameters);
        least = mass > 0 ? fmin(least, mass) : least;
    }
    return isfinite(least) ? least * kmp_system_gravity(s) : 0;
}

void kmp_event_tracker_begin_past(const kempe_system *system, kmp_condition_past *past)
{
    double load = -1;
    for (int k = 0; k < system->events.count; k++) {
        const bool is_level = system->events.condition[k].validity == KMP_VALIDITY_LEVEL;
        load = is_level && load < 0 ? least_weight(system) : load;
        past[k] = (kmp_condition_past){.last = -INFINITY, .largest = is_level ? load : 0};
    }
}

/* The size of the place of a contact, for its sense; 0 for other conditions; 1 where no coordinate moves it. */
static double place_size(const kempe_system *s, const kmp_condition *condition)
{
    const kmp_force *force = condition->of;
    if (condition->role != KMP_ROLE_SENSE || force->kind != KMP_FORCE_TOUCH)
        return 0;
    for (int r = 0; r < s->m; r++)
        if (s->rows[r].closure == force->closure)
            return s->row_scale[r];
    return 1;
}

/* Finds the levels that are not negative by their form, such as constants and multiples of sizes of loads: bounds over
 * steps of these need no search. */
static void find_never(kmp_event_tracker *c)
{
    const kmp_bound any = {-HUGE_NUMBER, HUGE_NUMBER, -HUGE_NUMBER, HUGE_NUMBER};
    kmp_event_search *s = &c->search;
    for (int k = 0; k < c->s->changes->input_count; k++)
        kmp_bounds_set(s->bounds, k, any);
    kmp_bounds_run(s->bounds, true);
    for (int k = 0; k < c->s->events.count; k++)
        c->never[k] = c->s->events.condition[k].validity == KMP_VALIDITY_LEVEL && !s->bounds->given[s->output[k]] &&
                      kmp_bounds_get(s->bounds, s->output[k]).low >= 0;
}

kmp_event_tracker *kmp_event_tracker_new(const kmp_event_setup *plan, kmp_arena *a)
{
    const kempe_system *system = plan->system;
    int n = system->n, count = system->events.count;
    kmp_event_tracker *c = KMP_ARENA_NEW(a, kmp_event_tracker, 1);
    if (!c)
        return NULL;
    *c = (kmp_event_tracker){.plan = *plan,
                             .s = system,
                             .eval = plan->eval,
                             .instant = KMP_EVENT_INSTANT * plan->span,
                             .kink = plan->kinks ? KMP_KINK_TOLERANCES * plan->rtol : 0,
                             .end = -1};
    c->kind = KMP_ARENA_NEW(a, int, count);
    for (int k = 0; c->kind && k < count; k++) {
        const kmp_condition *x = &system->events.condition[k];
        c->kind[k] = x->role == KMP_ROLE_SENSE || x->role == KMP_ROLE_HELD ? KMP_CONDITION_PASSES
                     : x->validity != KMP_VALIDITY_NONE                    ? KMP_CONDITION_VALIDITY
                     : x->role != KMP_ROLE_NONE                            ? KMP_CONDITION_NUMBER
                     : x->kink                                             ? KMP_CONDITION_KINK
                     : x->ends                                             ? KMP_CONDITION_ENDS
                                                                           : KMP_CONDITION_SWITCHES;
        c->watches_validity = c->watches_validity || x->validity != KMP_VALIDITY_NONE;
    }
    c->size = KMP_ARENA_NEW(a, double, count);
    for (int k = 0; c->size && k < count; k++)
        c->size[k] = place_size(system, &system->events.condition[k]);
    c->stays = KMP_ARENA_NEW(a, bool, count);
    c->past = KMP_ARENA_NEW(a, kmp_condition_past, count);
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(double, n, &c->q, &c->qd, &c->qdd), KMP_ROOM(double, system->m, &c->lambda),
                        KMP_ROOM(double, count, &c->change, &c->before),
                        KMP_ROOM(bool, count, &c->located, &c->beyond, &c->never)) ||
        !event_search_init(&c->search, system, plan->closely, a))
        return NULL;
    find_never(c);
    kmp_event_tracker_begin_past(system, c->past);
    kmp_event_tracker_take(c, plan->eval->conditions.mode, system->parameters, &plan->eval->inputs, c->past);
    return c;
}

/* -- evaluation ----------------------------------------------------------------------------------------- */

int kmp_event_tracker_first_end(const kmp_event_tracker *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (c->s->events.condition[k].ends && kmp_event_tracker_changed(c, k))
            return k;
    return -1;
}

double kmp_event_tracker_shortens(const kmp_event_tracker *c, double from, double event, double to,
                                  kmp_repeated repeats)
{
    bool meets = false, ends = false;
    for (int k = 0; k < c->s->events.count; k++) {
        const kmp_condition *condition = &c->s->events.condition[k];
        const bool changed = kmp_event_tracker_changed(c, k);
        meets = meets || (changed && (condition->rough || (repeats == KMP_REPEATED_ALL && !condition->ends)));
        ends = ends || (changed && condition->measured && c->mode[k] > 0);
    }
    return kmp_restart_again(from, event, to, ends && repeats != KMP_REPEATED_ROUGH, meets);
}

/* True if condition k has changed and switches the equations. */
static bool has_switched(const kmp_event_tracker *c, int k)
{
    const kmp_condition *condition = &c->s->events.condition[k];
    return !condition->ends && condition->role == KMP_ROLE_NONE && !c->stays[k] && kmp_event_tracker_changed(c, k);
}

static int first_switched(const kmp_event_tracker *c)
{
    for (int k = 0; k < c->s->events.count; k++)
        if (has_switched(c, k))
            return k;
    return -1;
}

static kempe_status complete(kmp_event_tracker *c, double t, kmp_state_depth depth, bool again)
{
    KMP_TRY(c->plan.state(c->plan.user, t, depth, again, c->q, c->qd, c->qdd, c->lambda));
    kmp_eval_all_changes(c->eval, t, c->q, c->qd, c->qdd, c->lambda, c->change);
    return KEMPE_OK;
}

kempe_status kmp_event_tracker_look(kmp_event_tracker *c, double t)
{
    c->looked = t;
    return complete(c, t, c->s->changes_by_rates ? KMP_STATE_WHOLE : KMP_STATE_RATES, false);
}

void kmp_event_tracker_put_beyond(const kmp_event_tracker *c, double t, double *change)
{
    for (int k = 0; c->search.event == t && k < c->s->events.count; k++)
        change[k] = c->located[k] ? fmin(change[k], -DBL_MIN) : change[k];
}

void kmp_event_tracker_hold_free(kmp_event_tracker *c, const double *before, const double *change)
{
    c->passed = false;
    for (int k = 0; c->kink > 0 && k < c->s->events.count; k++) {
        if (!is_away(c, k, change[k]))
            continue;
        if (before && kmp_kink_is_passed(before[k], change[k], c->kink, c->past[k].largest))
            c->passed = true;
        else
            kmp_eval_set_kink(c->eval, k, change[k] < 0 ? 1 : -1);
    }
}

void kmp_event_tracker_mark_start(kmp_event_tracker *c, double t)
{
    event_tracker_report(c, t, c->change);
    for (int k = 0; k < c->s->events.count; k++)
        if (c->s->events.condition[k].at_start && c->change[k] < 0) {
            atomic_store_explicit(&c->s->left[k], true, memory_order_relaxed);
            kmp_run_log_add(c->plan.log, "event", t, NAN, NAN, "%s, at the start", c->s->event_text[k]);
        }
}

kempe_status kmp_event_tracker_begin(kmp_event_tracker *c, double t, bool *ends)
{
    bool any = false;
    for (int k = 0; k < c->s->events.count; k++)
        any = any || c->s->events.condition[k].ends || c->s->events.condition[k].kink ||
              c->s->events.condition[k].validity || c->s->events.condition[k].at_start;
    *ends = false;
    if (!any)
        return KEMPE_OK;
    KMP_TRY(kmp_event_tracker_look(c, t));
    kmp_event_tracker_hold_free(c, NULL, c->change);
    kmp_event_tracker_mark_start(c, t);
    c->end = kmp_event_tracker_first_end(c);
    *ends = c->end >= 0;
    return KEMPE_OK;
}

/* -- passing ----------------------------------------------------------------------------------------- */

/* Events are counted and named; bends are not. */
static void note_event(kmp_event_tracker *c, int k, double t, bool holds)
{
    const kmp_condition *condition = &c->s->events.condition[k];
    const kmp_expr *e = condition->expr;
    bool stated = !e || (e->kind != KMP_EXPR_AT_MOST && e->kind != KMP_EXPR_AT_LEAST);
    double most = condition->measured && !holds ? fmax(c->past[k].peak, c->past[k].most) : NAN;
    if (condition->bend || condition->rough || condition->silent)
        return;
    const kmp_force *force = condition->measured ? condition->of : NULL;
    if (force) {
        kmp_run_log_contact(c->plan.log, (int)(force - kmp_model_force(c->s->model, 0)), t, holds, most);
        c->past[k].peak = 0;
        c->past[k].latest.count = 0;
        const kmp_contact_words words = kmp_contact_words_of(c->s->model, force->name);
        kmp_run_log_add(c->plan.log, "event", t, NAN, most, "%s '%s' %s", words.noun, force->name,
                        holds ? words.begins : words.ends);
    } else {
        const char *words = condition->at_start ? (holds ? ", from here on" : ", until here")
                            : holds == stated   ? " became true"
                                                : " became false";
        kmp_run_log_add(c->plan.log, "event", t, NAN, most, "%s%s", c->s->event_text[k], words);
    }
    c->count++;
}

/* The branch of a kink follows the state if the kink is passed within the errors of steps, as at rest, or repeatedly.
 */
static kempe_status change_condition(kmp_event_tracker *c, int k, double t)
{
    const char *advice = c->s->events.condition[k].advice;
    const bool holds = !(c->mode[k] > 0), kink = c->s->events.condition[k].kink;
    kmp_condition_past *past = &c->past[k];
    c->search.ready = false;
    const double lag = c->s->events.condition[k].lag;
    const bool near = lag > 0 && past->most <= LAGS * lag;
    past->repeats = near || kmp_changes_at_once(t, past->last, c->instant) ? past->repeats + 1 : 0;
    if (kink) {
        const bool idle = kmp_kink_is_idle(past->most, c->kink, past->largest, past->repeats);
        kmp_eval_set_kink(c->eval, k, idle ? 0 : holds ? 1 : -1);
    } else {
        kmp_eval_set_mode(c->eval, k, holds);
        note_event(c, k, t, holds);
        if (holds && c->s->events.condition[k].at_start)
            atomic_store_explicit(&c->s->left[k], true, memory_order_relaxed);
    }
    past->last = t;
    past->most = 0;
    if (kink || past->repeats < KMP_EVENT_REPEATS)
        return KEMPE_OK;
    c->stuck = true;
    return kmp_fail(
        c->s->context, KEMPE_E_FAILED, "%s changes back and forth at t = %.9g s: %s", c->s->event_text[k], t,
        advice ? advice
               : "the motion slides along this condition; make the law continuous there, for instance with tanh");
}

/* Changes conditions. Conditions may depend on others, so that one change causes the next. */
static kempe_status change_conditions(kmp_event_tracker *c, double t)
{
    for (int pass = 0; pass < KMP_EVENT_REPEATS && first_switched(c) >= 0; pass++) {
        for (int k = 0; k < c->s->events.count; k++)
            if (has_switched(c, k)) {
                KMP_TRY(change_condition(c, k, t));
                c->stays[k] = c->beyond[k];
            }
        memcpy(c->change, kmp_eval_changes(c->eval, t, c->q, c->qd), (size_t)c->s->events.count * sizeof(double));
    }
    int k = first_switched(c);
    return k < 0 ? KEMPE_OK
                 : kmp_fail(c->s->context, KEMPE_E_FAILED, "%s contradicts another condition at t = %.9g s",
                            c->s->event_text[k], t);
}

kempe_status kmp_event_tracker_foresee(kmp_event_tracker *c, double t)
{
    KMP_TRY(kmp_event_tracker_look(c, t));
    memcpy(c->before, c->mode, (size_t)c->s->events.count * sizeof *c->mode);
    for (int pass = 0; pass < KMP_EVENT_REPEATS && first_switched(c) >= 0; pass++) {
        for (int k = 0; k < c->s->events.count; k++)
            if (has_switched(c, k))
                kmp_eval_set_mode(c->eval, k, !(c->mode[k] > 0));
        memcpy(c->change, kmp_eval_changes(c->eval, t, c->q, c->qd), (size_t)c->s->events.count * sizeof(double));
    }
    return KEMPE_OK;
}

void kmp_event_tracker_note(kmp_event_tracker *c, double t, const double *q, const double *qd)
{
    memcpy(c->before, kmp_eval_changes(c->eval, t, q, qd), (size_t)c->s->events.count * sizeof(double));
    c->noted = true;
}

kempe_status kmp_event_tracker_change(kmp_event_tracker *c, double t, const double *q, const double *qd, bool again,
                                      bool *changed)
{
    int count = c->s->events.count;
    c->search.ready = false;
    memcpy(c->q, q, (size_t)c->s->n * sizeof *q);
    memcpy(c->qd, qd, (size_t)c->s->n * sizeof *qd);
    const double *now = kmp_eval_changes(c->eval, t, q, qd);
    for (int k = 0; k < count; k++) {
        /* A condition that the event has passed is passed: closed and located states differ by rounding. */
        c->beyond[k] = !again && c->looked == t && kmp_event_tracker_changed(c, k);
        c->change[k] = !c->beyond[k] ? now[k] : c->mode[k] > 0 ? fmax(now[k], DBL_MIN) : fmin(now[k], -DBL_MIN);
    }
    for (int k = 0; k < count; k++)
        c->stays[k] = (again && (c->stays[k] || c->past[k].last == t)) ||
                      (c->noted && c->past[k].last == t && c->change[k] == c->before[k]);
    *changed = first_switched(c) >= 0;
    kempe_status status = change_conditions(c, t);
    memset(c->stays, 0, c->noted || !again || !*changed ? (size_t)count * sizeof *c->stays : 0);
    memset(c->beyond, 0, (size_t)count * sizeof *c->beyond);
    return status;
}

kempe_status kmp_event_tracker_pass(kmp_event_tracker *c, double t, bool rates)
{
    KMP_TRY(kmp_event_tracker_look(c, t));
    KMP_TRY(change_conditions(c, t));
    kempe_status status = rates ? complete(c, t, KMP_STATE_WHOLE, true) : KEMPE_OK; /* after the change */
    if (status == KEMPE_OK)
        kmp_event_tracker_hold_free(c, NULL, c->change); /* a step that follows the event may pass the kink */
    return status;
}
