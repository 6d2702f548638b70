/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps and their errors, their dense output, and the search of events in them. Spherical joints: coordinates of the
 * motion count from an orientation that changes between steps, before their angles become singular; the breaks of the
 * caller are followed. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_samples.h"
#include "integrators/events/watch_site.h"

/* -- dense output ---------------------------------------------------------------------------------------- */

static void list_stages(const kempe_simulator *s, double **k)
{
    for (int i = 0; i < KMP_RK_MAX_STAGES; i++)
        k[i + 1] = s->part.stages + (ptrdiff_t)i * size_of_y(s);
    k[0] = NULL;
}

static void list_vectors(const kempe_simulator *s, double **r)
{
    for (int i = 0; i < KMP_RK_MAX_INTERPOLANTS; i++)
        r[i] = s->part.vectors + (ptrdiff_t)i * size_of_y(s);
}

/* k[number] = f(t + c h, y + h sum a k), within a function that has s, size, y, h, t, k and C. */
#define STAGE(number, a, ...)                                                                                          \
    do {                                                                                                               \
        kmp_rk_combine(size, y, h, KMP_TERMS(a), a, (const double *const[]){__VA_ARGS__}, s->part.stage);              \
        outcome at_stage = slopes_alone(s, t + C[number] * h, s->part.stage, k[number]);                               \
        if (at_stage != GOOD)                                                                                          \
            return at_stage;                                                                                           \
    } while (0)

/* The vectors of the dense output of the last step. */
static outcome prepare_dense(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s);
    double *state = part->state, *k[KMP_RK_MAX_STAGES + 1], *r[KMP_RK_MAX_INTERPOLANTS];
    double t = state[AT_BEGIN], h = state[AT_TAKEN];
    const double *y = part->y_old, *const C = kmp_dop853_c;
    bool long_one = state[AT_METHOD_TAKEN] == (double)KEMPE_METHOD_DOP853;
    if (state[AT_DENSE] > 0)
        return GOOD;
    list_stages(s, k);
    list_vectors(s, r);
    if (long_one)
        KMP_DOP853_DENSE_STAGES(STAGE, k);
    const kmp_rk_numbers *method = &methods[(int)state[AT_METHOD_TAKEN]];
    const double *last = r[method->interpolants - 1];
    kmp_rk_cubics(size, 1, h, y, part->y_new, k[1], k[method->end], r);
    if (long_one)
        kmp_dop853_dense_all(size, 0, 1, h, k, r);
    for (int i = 0; i < size && !long_one; i++)
        r[4][i] = kmp_dopri5_dense(h, k, i);
    state[AT_DENSE] = 1;
    state[AT_COARSE] =
        !(s->settings.fixed_step > 0) && kmp_rk_is_coarse(size, method->interpolants, last, 1, part->weight, 1);
    return GOOD;
}

static bool step_within(kempe_simulator *s, double t, double *y);

/* y at t within the last step. */
static outcome interpolate(kempe_simulator *s, double t, double *y)
{
    struct kempe_simulator_parts *part = &s->part;
    const double *state = part->state;
    int size = size_of_y(s);
    double *r[KMP_RK_MAX_INTERPOLANTS];
    bool ends = !(t < state[AT_END]) || !(state[AT_TAKEN] > 0);
    if (ends || !(t > state[AT_BEGIN])) {
        copy(size, ends ? part->y_new : part->y_old, y);
        return GOOD;
    }
    outcome said = prepare_dense(s);
    list_vectors(s, r);
    if (said == GOOD && state[AT_COARSE] > 0 && step_within(s, t, y))
        return GOOD;
    if (said == GOOD)
        kmp_rk_interpolate(size, methods[(int)state[AT_METHOD_TAKEN]].interpolants, r,
                           (t - state[AT_BEGIN]) / state[AT_TAKEN], y);
    return said;
}

/* -- angles of spherical joints -------------------------------------------------------------------------- */

/* Follows the caller's angles to the placed q. False, with nothing changed: they change too much to be continuous, and
 * `anyhow` is not set. */
static bool see_angles(kempe_simulator *s, bool anyhow)
{
    const kempe_charts *charts = s->equations->charts;
    struct kempe_simulator_parts *part = &s->part;
    copy(3 * charts->joints, part->seen, part->next_seen);
    for (int c = 0; c < charts->joints; c++) {
        const double *chart = chart_of(s, c);
        double *next = part->next_seen + 3 * (ptrdiff_t)c;
        if (is_own(chart))
            copy(3, part->q + charts->first[c], next);
        else if (charts->follow(charts, c, chart, part->seen_q, part->seen + 3 * (ptrdiff_t)c, !anyhow, part->q, next) >
                     KMP_AXES_NEAR_BY &&
                 !anyhow)
            return false;
    }
    copy(3 * charts->joints, part->next_seen, part->seen);
    copy(s->equations->coordinates, part->q, part->seen_q);
    return true;
}

/* Follows the caller's angles to t within the last step. */
static void follow_angles(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    if (!charts_have_moved(s) || !(*part->seen_t < t) || interpolate(s, *part->seen_t, part->probe) != GOOD)
        return;
    place_y(s, part->probe);
    copy(s->equations->coordinates, part->q, part->seen_q);
    *factors_are_present(s) = 0;
    double end = t;
    for (int halvings = 0; *part->seen_t < t;) {
        const double from = *part->seen_t;
        if (interpolate(s, end, part->probe) != GOOD)
            return;
        place_y(s, part->probe);
        if (!see_angles(s, halvings >= MOST_HALVINGS)) {
            end = from + (end - from) / 2;
            halvings++;
            continue;
        }
        *part->seen_t = end;
        end = t;
        halvings = 0;
    }
}

/* The placed, complete state in the caller's coordinates, which are s->q, qd and qdd. */
static void show_coordinates(kempe_simulator *s, double t)
{
    const kempe_charts *charts = s->equations->charts;
    struct kempe_simulator_parts *part = &s->part;
    const int n = s->equations->coordinates;
    copy(n, part->q, s->q);
    copy(n, part->qd, s->qd);
    copy(n, part->qdd, s->qdd);
    if (!charts)
        return;
    copy(n, part->q, part->inner_q);
    copy(n, part->qd, part->inner_qd);
    copy(n, part->qdd, part->inner_qdd);
    for (int c = 0; c < charts->joints; c++) {
        double *seen = part->seen + 3 * (ptrdiff_t)c;
        if (!is_own(chart_of(s, c)))
            charts->show(charts, c, chart_of(s, c), seen, s->q, s->qd, s->qdd);
        copy(3, s->q + charts->first[c], seen);
    }
    *part->seen_t = t;
}

/* Changes of the motion's coordinates, rates and accelerations into the caller's. */
static void carry_changes(kempe_simulator *s)
{
    const kempe_charts *charts = s->equations->charts;
    struct kempe_simulator_parts *part = &s->part;
    const double *const inner[] = {part->q, part->qd, part->qdd}, *const shown[] = {s->q, s->qd, s->qdd};
    double *const change[] = {part->dq, part->dqd, part->dqdd};
    for (int c = 0; charts && c < charts->joints; c++)
        if (!is_own(chart_of(s, c)))
            charts->carry(charts, c, chart_of(s, c), inner, shown, change);
}

/* -- events ---------------------------------------------------------------------------------------------- */

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

/* The element whose sense a condition is; -1: none. */
static int element_of(const kempe_simulator *s, int k)
{
    const kempe_friction *friction = s->equations->friction;
    int found = -1;
    for (int i = 0; friction && i < friction->elements; i++)
        found = friction->slot[i] == k ? i : found;
    return found;
}

static bool may_change(const void *self, int k)
{
    const kempe_simulator *s = ((const event_watcher *)self)->s;
    return kmp_condition_may_change(kind_of(s, k), element_of(s, k) >= 0, s->part.modes + k);
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

static double size_of(const void *self, int k)
{
    const kempe_simulator *s = ((const event_watcher *)self)->s;
    const kempe_friction *friction = s->equations->friction;
    const int i = element_of(s, k);
    return i >= 0 && friction->contact[i] ? friction->size[i] : 0;
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
        const kmp_location_site site = {w,    count,  e->condition_kind, part->modes, value, look_alone, NULL, NULL,
                                        NULL, size_of};
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
    report_conditions(s, to, change);
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
                  "%s: the search for changes reached its limit of evaluations in the step from t = %.9g on: set "
                  "'longest' in the settings",
                  e->condition_names[status - KMP_WATCH_UNDECIDED], part->state[AT_BEGIN]);
        return REPORTED;
    }
    if (status != 0)
        return w.said;
    bool passed = false;
    const outcome said = found ? GOOD : hold_branches(s, part->changes, &passed);
    *again = found ? shortened(s) : passed ? part->state[AT_TAKEN] : 0;
    return said;
}

/* -- steps ----------------------------------------------------------------------------------------------- */

/* Stages, solution, weights and error of a step h from y_new to `candidate`, whose loops are closed. */
static outcome run_stages(kempe_simulator *s, double h, double *error)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s);
    double *k[KMP_RK_MAX_STAGES + 1], t = part->state[AT_END];
    const double *y = part->y_new, *C;
    list_stages(s, k);
    if (s->settings.method == KEMPE_METHOD_DOP853) {
        const kmp_dop853_step step = {y, &h, part->atol, k, s->settings.rtol, part->candidate, part->weight, error};
        C = kmp_dop853_c;
        KMP_DOP853_STAGES(STAGE, k);
        kmp_dop853_solution(1, false, (size_t)size, &step);
    } else {
        C = kmp_dopri5_c;
        KMP_DOPRI5_STAGES(STAGE, k);
        kmp_dopri5_solution(size, y, h, k, part->candidate);
        outcome said = slopes_alone(s, t + h, part->candidate, k[7]);
        if (said != GOOD)
            return said;
        *error = kmp_dopri5_error(size, h, k, y, part->candidate, part->atol, s->settings.rtol, part->weight);
    }
    return GOOD;
}

/* True where the correction that has closed the loops at the end of an attempt is small enough, in error weights. */
static bool corrects_little(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    kmp_last_correction last;
    double worst = 0;
    for (int i = 0; i < rank_of(s); i++) {
        const int at = 2 * freedom_of(s) + i, c = part->column[i];
        worst = fmax(worst, kmp_correction_size(part->q[c] - part->candidate[at], part->weight[at], e->scale[c]));
    }
    memcpy(&last, part->state + AT_CORRECTED, sizeof last);
    const bool small =
        kmp_correction_is_small(worst, e->rows > rank_of(s) + rows_let_go(s), part->state[AT_END], &last);
    memcpy(part->state + AT_CORRECTED, &last, sizeof last);
    return small;
}

static kmp_attempt attempt(kempe_simulator *s, double h, double t_new, double *error, outcome *said)
{
    struct kempe_simulator_parts *part = &s->part;
    const bool fixed = s->settings.fixed_step > 0;
    double *k[KMP_RK_MAX_STAGES + 1];
    list_stages(s, k);
    *said = run_stages(s, h, error);
    if (*said != GOOD)
        return KMP_ATTEMPT_BAD_STAGE;
    if (!kmp_step_passes(*error, fixed))
        return KMP_ATTEMPT_BAD_ERROR;
    place_y(s, part->candidate);
    *said = close_loops(s, t_new, NULL);
    if (*said != GOOD)
        return KMP_ATTEMPT_BAD_STAGE;
    if (signs_of_loops(s) != part->state[AT_SIGN] || (!fixed && !corrects_little(s)) ||
        kmp_dropped_judge(share_of_rows(s)) == KMP_KEPT_LOST)
        return KMP_ATTEMPT_BAD_STEP;
    for (int i = 0; i < rank_of(s); i++)
        part->candidate[2 * freedom_of(s) + i] = part->q[part->column[i]];
    *said = slopes_here(s, t_new, k[methods[s->settings.method].end]);
    return *said == GOOD ? KMP_ATTEMPT_TAKEN : KMP_ATTEMPT_BAD_STAGE;
}

/* The length of the next step, or of the next attempt at this one. */
static void choose_next(kempe_simulator *s, kmp_attempt what, double h, double error)
{
    double *state = s->part.state;
    state[AT_NEXT] =
        kmp_step_after(&methods[s->settings.method], what, h, error, state[AT_ERROR], state[AT_REJECTED] > 0);
    state[AT_REJECTED] = what != KMP_ATTEMPT_TAKEN;
}

/* The solution at t within the last step by further steps from its beginning, which leave no trace. False: these cannot
 * be made. */
static bool step_within(kempe_simulator *s, double t, double *y)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state, *k[KMP_RK_MAX_STAGES + 1];
    int size = size_of_y(s), count = numbers_of_step(e);
    const kempe_simulator_work work = s->work;
    copy(HEADER, state, part->aside);
    copy(count, part->y_old, part->aside + HEADER);
    copy(size, part->y_old, part->y_new);
    list_stages(s, k);
    state[AT_END] = state[AT_BEGIN];
    state[AT_NEXT] = t - state[AT_BEGIN];
    for (int tries = 0; tries < KMP_STEP_FINER && state[AT_END] < t; tries++) {
        double t_new = t, error = 0, h = kmp_step_next(state[AT_END], t, state[AT_NEXT], &t_new);
        outcome said = GOOD;
        if (!(h > 0))
            break;
        choose_next(s, attempt(s, h, t_new, &error, &said), h, error);
        if (state[AT_REJECTED] > 0)
            continue;
        state[AT_END] = t_new;
        copy(size, part->candidate, part->y_new);
        copy(size, k[methods[s->settings.method].end], k[1]);
    }
    bool reached = state[AT_END] == t;
    if (reached)
        copy(size, part->y_new, y);
    copy(HEADER, part->aside, state);
    copy(count, part->aside + HEADER, part->y_old);
    s->work = work;
    return reached;
}

/* Hairer's first step. */
static outcome choose_first_step(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s);
    double *k[KMP_RK_MAX_STAGES + 1], t = part->state[AT_END], longest = last_time(s) - t;
    list_stages(s, k);
    for (int i = 0; i < size; i++)
        part->weight[i] = part->atol[i] + s->settings.rtol * fabs(part->y_new[i]);
    double slope = kmp_start_square(size, 1, k[1], NULL, part->weight);
    double h = kmp_start_euler(slope, kmp_start_square(size, 1, part->y_new, NULL, part->weight), longest);
    outcome said = OPEN;
    for (int pass = 0; pass < KMP_START_EULERS && said != GOOD; pass++) {
        h = pass ? h / 4 : h;
        for (int i = 0; i < size; i++)
            part->stage[i] = part->y_new[i] + h * k[1][i];
        said = slopes_alone(s, t + h, part->stage, k[2]);
    }
    double change = kmp_start_square(size, 1, k[2], k[1], part->weight);
    part->state[AT_NEXT] =
        kmp_start_step(h, fmax(sqrt(change) / h, sqrt(slope)), methods[s->settings.method].order, longest);
    return said;
}

/* The next step starts again: the control of its length knows none before. */
static void begin_control(kempe_simulator *s)
{
    double *state = s->part.state;
    state[AT_NEXT] = kmp_restart_proposed(state[AT_NEXT], state[AT_END]);
    state[AT_ERROR] = KMP_RK_ERROR_FLOOR;
    state[AT_REJECTED] = state[AT_HOPELESS] = 0;
    state[AT_CORRECTED + 1] = -DBL_MAX; /* the time of a correction: there is none */
    state[AT_FRESH] = 1;
}

/* Does what the last step has left: decides at its end, exchanges the choice, evaluates the derivative. */
static kempe_simulator_status begin_step(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state, t = state[AT_END], *k[KMP_RK_MAX_STAGES + 1];
    bool changed = false;
    follow_angles(s, t);
    list_stages(s, k);
    if (!(state[AT_EVENT] > 0))
        take_branches(s);
    if (state[AT_EVENT] > 0 || kmp_sample_is_due(next_sample(s), t)) {
        place_y(s, part->y_new);
        if (evaluate_loops(s, t) == GOOD)
            evaluate_rates(s);
        if (state[AT_EVENT] > 0) /* rates may jump where closures or friction change */
            state[AT_NEXT] =
                !e->switches && !e->friction
                    ? state[AT_TAKEN]
                    : kmp_restart_length(state[AT_TAKEN], t - state[AT_BEGIN],
                                         KMP_FRICTION_INSTANT * KMP_FRICTION_SPAN / state[AT_RATE], INFINITY);
        kempe_simulator_status status = pass_instant(s, t, part->y_new, (occasion){state[AT_EVENT] > 0, 0}, &changed);
        if (status != KEMPE_SIMULATOR_GOES)
            return status;
        state[AT_EVENT] = 0;
        begin_control(s);
        if (has_changes(s)) { /* the step that follows may pass a free kink */
            evaluate_changes(s, t, part->changes);
            note_branches(s, part->changes);
            take_branches(s);
        }
    }
    if (state[AT_EXCHANGE] > 0) {
        place_y(s, part->y_new);
        outcome said = evaluate_loops(s, t);
        if (said == GOOD)
            evaluate_rates(s);
        said = said == GOOD ? exchange_choice(s, t) : said;
        if (said != GOOD)
            return explain(s, said, t);
        pack_y(s, part->q, part->qd, part->y_new);
        state[AT_EXCHANGE] = 0;
        begin_control(s);
    }
    set_weights(s);
    if (!(state[AT_FRESH] > 0)) {
        copy(size_of_y(s), k[methods[(int)state[AT_METHOD_TAKEN]].end], k[1]);
        copy(3 * e->coordinates + e->rows, part->end, part->begin);
        return KEMPE_SIMULATOR_GOES;
    }
    outcome said = slopes(s, t, part->y_new, k[1]);
    if (said != GOOD)
        return explain(s, said, t);
    complete(s);
    put_place(s, part->begin);
    state[AT_SIGN] = signs_of_loops(s);
    state[AT_FRESH] = 0;
    if (!(state[AT_NEXT] > 0) && !(s->settings.fixed_step > 0))
        said = choose_first_step(s);
    return said == GOOD ? KEMPE_SIMULATOR_GOES : explain(s, said, t);
}

/* Takes back the last step, which is made again with the modes that have changed. */
static void take_back(kempe_simulator *s, double h)
{
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state;
    copy(size_of_y(s), part->y_old, part->y_new);
    state[AT_END] = state[AT_BEGIN];
    state[AT_TAKEN] = 0;
    begin_control(s);
    state[AT_NEXT] = h;
    state[AT_EXCHANGE] = state[AT_EVENT] = state[AT_ENDED] = 0;
    clear(s->equations->conditions, part->flip);
    s->work.steps--;
    s->work.rejected++;
}

/* False after a message: the motion, whose step has ended at the placed state, grows without end. A number of steps
 * that is set is the bound of the caller. */
static bool stays_bounded(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    double *state = part->state, t = state[AT_END];
    kmp_growth growth;
    memcpy(&growth, state + AT_GROWTH, sizeof growth);
    if (s->settings.most_steps > 0 || state[AT_TRIED] < growth.next)
        return true;
    const bool endless = kmp_growth_is_endless(
        &growth, state[AT_TRIED], t, kmp_growth_size(size_of_y(s), 1, part->y_new, part->atol, s->settings.atol));
    memcpy(state + AT_GROWTH, &growth, sizeof growth);
    const int which =
        endless ? kmp_growth_explodes(motions_of(e), NULL, e->coordinates, 1, part->qd, e->scale, state[AT_RATE]) : -1;
    if (which < 0)
        return true;
    fail_with(s,
              "the motion grows without end: at t = %.6g '%s' has a rate of %.3g %s, ten times more than %.3g s "
              "before: check forces and gains, or set most_steps",
              t, e->coordinate_names[which], part->qd[which],
              e->coordinate_kind[which] == KEMPE_COORDINATE_ROTATION ? "rad/s" : "m/s", growth.t[0] - growth.t[1]);
    return false;
}

/* Takes an attempt: the state at its end and what is to be done there. One that is made again is not once more. */
static kempe_simulator_status take_step(kempe_simulator *s, double h, double t_new, double error, bool again)
{
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state;
    int size = size_of_y(s);
    state[AT_ERROR] = kmp_step_known_error(error);
    state[AT_BEGIN] = state[AT_END];
    state[AT_END] = t_new;
    state[AT_TAKEN] = h;
    state[AT_METHOD_TAKEN] = (double)s->settings.method;
    state[AT_DENSE] = 0;
    copy(size, part->y_new, part->y_old);
    copy(size, part->candidate, part->y_new);
    s->work.steps++;
    if (!dropped_rows_close(s, t_new) || !stays_bounded(s))
        return KEMPE_SIMULATOR_FAILED;
    state[AT_EXCHANGE] = is_choice_bad(s, KMP_EXCHANGE_GROWTH);
    if (!has_changes(s))
        return KEMPE_SIMULATOR_GOES;
    complete(s);
    put_place(s, part->end);
    double shorter_one = 0;
    outcome said = find_event(s, &shorter_one);
    if (said != GOOD)
        return explain(s, said, t_new);
    if (shorter_one > 0 && !again)
        take_back(s, shorter_one);
    return KEMPE_SIMULATOR_GOES;
}

static kempe_simulator_status give_up(kempe_simulator *s, outcome said, kmp_attempt what)
{
    double t = s->part.state[AT_END];
    if (what == KMP_ATTEMPT_BAD_STAGE)
        return explain(s, said, t);
    const char *reason = what == KMP_ATTEMPT_BAD_STEP
                             ? "it passes a place where the loops do not determine the dependent coordinates"
                             : "the motion is singular there, or too fast";
    if (s->settings.fixed_step > 0)
        return fail_with(s, "no step of the constant length %.6g s can be made at t = %.9g: %s; shorten it",
                         s->settings.fixed_step, t, reason);
    return fail_with(s, "the step size is close to the resolution of double precision at t = %.9g: %s", t, reason);
}

/* Makes a step; `again`: up to an event that it has passed. */
static kempe_simulator_status make_step(kempe_simulator *s, bool again)
{
    double *state = s->part.state;
    kempe_simulator_status status = begin_step(s);
    if (status != KEMPE_SIMULATOR_GOES || state[AT_ENDED] > 0)
        return status;
    outcome said = GOOD;
    kmp_attempt what = KMP_ATTEMPT_BAD_ERROR;
    double end = last_time(s);
    for (int tries = 0; tries < KMP_STEP_ATTEMPTS; tries++) {
        double t = state[AT_END], t_new = t, error = 0, next = state[AT_NEXT];
        int hopeless = (int)state[AT_HOPELESS];
        if (s->settings.longest > 0)
            next = fmin(next, s->settings.longest);
        double h = kmp_step_to_try(tries, t, end, next, s->settings.fixed_step, &t_new);
        if (!(h > 0))
            break;
        what = attempt(s, h, t_new, &error, &said);
        state[AT_TRIED]++;
        choose_next(s, what, h, error);
        if (what == KMP_ATTEMPT_TAKEN) {
            bool collapsed = kmp_step_collapsed(&hopeless, h, t_new);
            state[AT_HOPELESS] = hopeless;
            status = collapsed ? give_up(s, GOOD, KMP_ATTEMPT_BAD_ERROR) : take_step(s, h, t_new, error, again);
            if (status == KEMPE_SIMULATOR_GOES && state[AT_END] == t)
                return make_step(s, true);
            if (end < s->settings.end)
                state[AT_NEXT] = fmax(state[AT_NEXT], next); /* h may be cut by a sample */
            return status;
        }
        s->work.rejected++;
    }
    return give_up(s, said, what);
}
