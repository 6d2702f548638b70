/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps and their errors. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_charts.h"
#include "exchange/simulator/simulator_events.h"

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

/* The next step begins anew: the control of its length knows none before. */
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
              "the motion grows without end: at t = %.6g '%s' has a rate of %.3g %s, and the state is ten times as "
              "large as %.3g s before, for the third time: check the signs of forces, dampings and gains, or set "
              "most_steps",
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
