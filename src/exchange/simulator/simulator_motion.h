/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of a motion, its advance to a time, changes of inputs and parameters on the way, and states of an
 * integrator of the caller. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_steps.h"

/* -- outputs at a time ----------------------------------------------------------------------------------- */

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

/* Steps of Newton's method for deformations in balance. */
enum { MOST_BALANCES = 60 };

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

/* Evaluates the loops at the placed q without a choice. */
static void evaluate_without_choice(kempe_simulator *s, double t)
{
    for (int i = 0; i < s->equations->rows; i++)
        s->part.row[i] = i;
    for (int j = 0; j < s->equations->coordinates; j++)
        s->part.column[j] = j;
    find_structure(s);
    (void)evaluate_loops(s, t);
}

/* Makes the first choice at the placed q, before and after the loops are closed. */
static outcome close_start(kempe_simulator *s, double t, const int *fixed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int r = rank_of(s);
    evaluate_without_choice(s, t);
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
    if (!changed || !e->start.values)
        return moved;
    kempe_arguments at = arguments_at(s, t);
    e->start.values(&at, given);
    for (int j = 0; j < e->coordinates; j++) {
        double dq = given[2 * j] - e->start.given[2 * j], dqd = given[2 * j + 1] - e->start.given[2 * j + 1];
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
        s->part.fixed[j] = (s->equations->start.keeps[j] & what) != 0;
        count += s->part.fixed[j];
    }
    return count;
}

/* Closes the loops at the moved start: coordinates and rates that the model keeps move the others. */
static outcome close_moved(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    int kept = mark_kept(s, KEMPE_START_KEEPS_PLACE);
    for (int k = 0; kept == 0 && e->start.independent && k < e->freedom; k++)
        s->part.fixed[e->start.independent[k]] = 1;
    const outcome said = close_start(s, t, s->part.fixed);
    return said == GOOD && mark_kept(s, KEMPE_START_KEEPS_RATE) > 0 ? close_start(s, t, s->part.fixed) : said;
}

/* -- a start at given values ----------------------------------------------------------------------------------- */

static bool is_given(const double *given, int j)
{
    return given && !isnan(given[j]);
}

static bool are_given(const kempe_simulator *s, const double *given)
{
    bool any = false;
    for (int j = 0; j < s->equations->coordinates; j++)
        any = any || is_given(given, j);
    return any;
}

/* True if the marked coordinates can be independent together at the place of the last evaluation. */
static bool is_free(kempe_simulator *s)
{
    const struct kempe_simulator_parts *part = &s->part;
    const int r = rank_of(s);
    order_pivots(s, part->fixed);
    bool free = r == 0 || part->pivots[r - 1] > s->equations->rank_tolerance * part->pivots[0];
    for (int i = 0; i < r; i++)
        free = free && !part->fixed[part->new_column[i]];
    return free;
}

/* Marks coordinates that are independent at the placed q: as many of the given ones as can be together, first the
 * independent ones of a run; then others of these. */
static void mark_given(kempe_simulator *s, double t, const double *given)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    const int n = e->coordinates, r = rank_of(s), f = freedom_of(s);
    int marked = 0;
    for (int j = 0; j < n; j++)
        part->fixed[j] = 0;
    for (int k = 0; e->start.independent && k < e->freedom; k++)
        part->fixed[e->start.independent[k]] = 1;
    evaluate_without_choice(s, t);
    choose(s, e->start.independent ? part->fixed : NULL);
    for (int j = 0; j < n; j++)
        part->fixed[j] = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < (pass == 0 ? n : f) && marked < f; k++) {
            const int j = part->column[(r + k) % n];
            if (part->fixed[j] || is_given(given, j) != (pass == 0))
                continue;
            part->fixed[j] = 1;
            part->fixed[j] = is_free(s);
            marked += part->fixed[j];
        }
}

/* Longest way of a marked coordinate between two closings, in its scale; attempts, each with ways half as long. */
#define GIVEN_WAY 0.25
enum { MOST_ATTEMPTS = 8 };

/* The number of closings on the way from `from` to the given values. Other given coordinates than the marked ones are
 * guesses of an assembly mode, which a way from another mode cannot reach. */
static int parts_of_way(const kempe_simulator *s, const double *given, const double *from)
{
    double longest = 0;
    bool guess = false;
    for (int j = 0; j < s->equations->coordinates; j++)
        if (is_given(given, j)) {
            guess = guess || !s->part.fixed[j];
            longest = fmax(longest, fabs(given[j] - from[j]) / s->equations->scale[j]);
        }
    return guess ? 1 : 1 + (int)fmin(longest / GIVEN_WAY, 1e4);
}

/* Closes the loops at the given q, from the placed q `from`: on the way the marked coordinates that are not given stay.
 */
static outcome go_to_given(kempe_simulator *s, double t, const double *given, const double *from)
{
    const int n = s->equations->coordinates;
    double *q = s->part.q;
    outcome said = OPEN;
    int parts = parts_of_way(s, given, from);
    for (int attempt = 0; attempt < MOST_ATTEMPTS && said != GOOD; attempt++, parts *= 2) {
        const bool guessed = parts == 1;
        copy(n, from, q);
        said = GOOD;
        for (int i = 1; i <= parts && said == GOOD; i++) {
            for (int j = 0; j < n; j++)
                if (is_given(given, j) && (guessed || s->part.fixed[j]))
                    q[j] = i < parts ? from[j] + (given[j] - from[j]) * i / parts : given[j];
            said = close_start(s, t, s->part.fixed);
        }
    }
    return said;
}

/* The same from the placed q. The other coordinates give way if the loops do not close with them as they are. */
static outcome close_given_place(kempe_simulator *s, double t, const double *given)
{
    const int n = s->equations->coordinates;
    double *from = s->part.dq;
    mark_given(s, t, given);
    copy(n, s->part.q, from);
    outcome said = go_to_given(s, t, given, from);
    if (said != GOOD) {
        for (int j = 0; j < n; j++)
            s->part.fixed[j] = s->part.fixed[j] && is_given(given, j);
        said = go_to_given(s, t, given, from);
    }
    return said;
}

/* Closes the loops at the given values: the marked coordinates and rates have them. */
static outcome close_given(kempe_simulator *s, double t, const double *q, const double *qd)
{
    const outcome said = close_given_place(s, t, q);
    if (said != GOOD)
        return said;
    mark_given(s, t, qd);
    for (int j = 0; j < s->equations->coordinates; j++)
        if (is_given(qd, j))
            s->part.qd[j] = qd[j];
    return close_start(s, t, s->part.fixed);
}

/* Given values may be off by rounding of their third digit where they follow from others. */
#define GIVEN_ROUNDED 1e-3

/* Refuses the given value that is farthest from the placed motion, if it is far. */
static kempe_simulator_status check_given(kempe_simulator *s, const double *given, const double *found, bool rates)
{
    const kempe_equations *e = s->equations;
    double most = GIVEN_ROUNDED;
    int worst = -1;
    for (int j = 0; j < e->coordinates; j++) {
        if (!is_given(given, j))
            continue;
        const double size = rates ? fabs(given[j]) + fabs(found[j]) : e->scale[j],
                     off = size > 0 ? fabs(found[j] - given[j]) / size : 0;
        worst = off > most ? j : worst;
        most = fmax(most, off);
    }
    if (worst < 0)
        return KEMPE_SIMULATOR_GOES;
    return fail_with(s,
                     "the given start contradicts itself or the loops: the %s of '%s' would be %.6g, not %.6g; leave "
                     "out %s that follow from others",
                     rates ? "rate" : "value", e->coordinate_names[worst], found[worst], given[worst],
                     rates ? "rates" : "coordinates");
}

/* -- deformations in balance ---------------------------------------------------------------------------------- */

/* The loads of the deformations that move, without accelerations of u, at the placed q with its loops closed. */
static outcome load_deformations(kempe_simulator *s, double t, double *loads)
{
    struct kempe_simulator_parts *part = &s->part;
    outcome said = close_loops(s, t, NULL);
    if (said == GOOD)
        said = evaluate_loops(s, t);
    if (said != GOOD)
        return said;
    evaluate_rates(s);
    kempe_arguments at = arguments_at(s, t);
    s->equations->motion(&at, part->mass, part->bias, part->jdqd);
    add_constant(s, part->bias, part->jdqd, part->load);
    for (int k = 0, i = 0; k < freedom_of(s); k++)
        if (s->equations->start.keeps[part->column[rank_of(s) + k]] & KEMPE_START_BALANCES) {
            loads[i] = project_on(s, k, part->load);
            said = fabs(loads[i++]) <= DBL_MAX ? said : NOT_FINITE;
        }
    return said;
}

/* The derivatives of the loads by the `count` deformations at `own`, by differences; q is the placed one again. */
static outcome slope_deformations(kempe_simulator *s, double t, int count, const int *own, const double *loads)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *kept = part->dq;
    outcome said = GOOD;
    copy(e->coordinates, part->q, kept);
    for (int k = 0; k < count && said == GOOD; k++) {
        const double move = KMP_STATIC_DIFFERENCE * e->scale[own[k]];
        double *column = part->joint + (ptrdiff_t)k * count;
        part->q[own[k]] += move;
        said = load_deformations(s, t, column);
        for (int i = 0; i < count; i++)
            column[i] = (column[i] - loads[i]) / move;
        copy(e->coordinates, kept, part->q);
    }
    return said;
}

/* True if the symmetric part of the stiffness of the deformations is positive. */
static bool is_stiffness_positive(kempe_simulator *s, int count)
{
    const double *joint = s->part.joint;
    double *even = s->part.reduced;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < count; k++)
            even[i + k * count] = (joint[i + k * count] + joint[k + i * count]) / 2;
    return kmp_cholesky_factor(count, even) == 0;
}

/* Moves the deformations of a placed, closed start until their loads vanish: other coordinates that are marked stay,
 * and so do the rates of u. Newton's method as in the library (constraints/closing/static_start.c). */
static outcome balance_start(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *loads = part->dqd, *step = part->right, last = INFINITY, length = INFINITY;
    int count = 0, *own = part->new_column;
    (void)mark_kept(s, KEMPE_START_BALANCES | KEMPE_START_STAYS);
    outcome said = close_start(s, t, part->fixed);
    for (int k = 0; k < freedom_of(s); k++)
        if (e->start.keeps[part->column[rank_of(s) + k]] & KEMPE_START_BALANCES)
            own[count++] = part->column[rank_of(s) + k];
    for (int pass = 0; said == GOOD && length > KMP_STATIC_STEP && !(length <= KMP_STATIC_ROUNDED && length >= last);
         pass++) {
        last = length;
        said = pass < MOST_BALANCES ? load_deformations(s, t, loads) : UNBALANCED;
        if (said == GOOD)
            said = slope_deformations(s, t, count, own, loads);
        if (said == GOOD && !is_stiffness_positive(s, count))
            said = UNBALANCED;
        if (said != GOOD || kmp_lu_factor(count, part->joint, part->joint_pivot))
            return said == GOOD ? UNBALANCED : said;
        copy(count, loads, step);
        kmp_lu_solve(count, part->joint, part->joint_pivot, 1, step);
        length = 0;
        for (int k = 0; k < count; k++) {
            part->q[own[k]] -= step[k];
            length = fmax(length, fabs(step[k]) / e->scale[own[k]]);
        }
    }
    return said == GOOD ? load_deformations(s, t, loads) : said;
}

/* True if deformations of the model's start move into balance, and its loads differ from the loads of the model. */
static bool is_out_of_balance(const kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    bool balances = false, other = t != 0;
    for (int j = 0; e->start.keeps && j < e->coordinates; j++)
        balances = balances || (e->start.keeps[j] & KEMPE_START_BALANCES);
    for (int k = 0; k < e->parameters; k++)
        other = other || s->p[k] != e->parameter_values[k];
    for (int k = 0; k < 3 * e->inputs; k++)
        other = other || s->u[k] != e->input_values[k];
    return balances && other;
}

static kempe_simulator_status start_here(kempe_simulator *s, double t, const double *q, const double *qd)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state;
    int *fixed = e->start.independent ? part->fixed : NULL;
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
    const bool given = are_given(s, q) || are_given(s, qd), moved = e->start.keeps && move_start(s, t);
    if (given)
        said = close_given(s, t, q, qd);
    else if (moved)
        said = close_moved(s, t);
    if (said == GOOD && (given || moved))
        said = evaluate_loops(s, t);
    if (said == GOOD && (given || moved))
        evaluate_rates(s);
    if (said == GOOD && given &&
        (check_given(s, q, part->q, false) == KEMPE_SIMULATOR_FAILED ||
         check_given(s, qd, part->qd, true) == KEMPE_SIMULATOR_FAILED))
        return KEMPE_SIMULATOR_FAILED;
    if (said == GOOD && !given && is_out_of_balance(s, t))
        said = balance_start(s, t);
    for (int j = 0; j < e->coordinates; j++)
        part->fixed[j] = 0;
    for (int k = 0; fixed && k < e->freedom; k++)
        fixed[e->start.independent[k]] = 1;
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

kempe_simulator_status kempe_simulator_start_from(kempe_simulator *s, double t, const double *q, const double *qd)
{
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    copy(s->equations->coordinates, s->equations->start.q, s->part.q);
    copy(s->equations->coordinates, s->equations->start.qd, s->part.qd);
    kempe_simulator_status status = start_here(s, t, q, qd);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}

kempe_simulator_status kempe_simulator_start(kempe_simulator *s, double t)
{
    return kempe_simulator_start_from(s, t, NULL, NULL);
}

static kempe_simulator_status refuse_before_start(kempe_simulator *s)
{
    return fail_with(s, "the simulator has not been started: call kempe_simulator_start");
}

/* -- advance --------------------------------------------------------------------------------------------- */

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

/* Starts again from the present state: with other inputs or parameters, loops are closed and conditions decided again.
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

/* Part of its size, or of one unit, by which an input may change as by rounding. */
#define INPUT_CONTINUOUS 1e-9

/* The input that moves a closure and has other values than the motion; -1: none. Steps of the simulator hold inputs:
 * rates are then zero, and a change is a jump, which the loops do not follow. */
static int input_that_moves(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    for (int i = 0; e->input_moves && i < e->inputs; i++) {
        const double *u = s->u + 3 * i, *held = s->part.held + 3 * i;
        if (e->input_moves[i][0] &&
            (u[1] != 0 || u[2] != 0 || !(fabs(u[0] - held[0]) <= INPUT_CONTINUOUS * fmax(fabs(held[0]), 1))))
            return i;
    }
    return -1;
}

/* True after a message; the inputs are then as before. */
static bool refuses_inputs(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const int i = s->part.state[AT_STARTED] > 0 ? input_that_moves(s) : -1;
    if (i >= 0) {
        const double *u = s->u + 3 * i;
        fail_with(
            s,
            "input '%s' moves closure '%s': steps of the simulator hold it at %.9g, and cannot follow it to %.9g, "
            "rate %.9g, acceleration %.9g; model exchange and the library can",
            e->input_names[i], e->input_moves[i], s->part.held[3 * i], u[0], u[1], u[2]);
        copy(3 * e->inputs, s->part.held, s->u);
    }
    return i >= 0;
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

kempe_simulator_status kempe_simulator_set_parameters(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    s->message[0] = 0;
    return same_numbers(3 * e->inputs, s->u, s->part.held) && same_numbers(e->parameters, s->p, s->part.held_p)
               ? KEMPE_SIMULATOR_GOES
               : take_changes(s);
}

kempe_simulator_status kempe_simulator_set_inputs(kempe_simulator *s)
{
    return refuses_inputs(s) ? KEMPE_SIMULATOR_FAILED : kempe_simulator_set_parameters(s);
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

/* -- states of an integrator of the caller --------------------------------------------------------------- */

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
        if (value[k] == 0 && !is_of_friction(e, k))
            value[k] = DBL_MIN; /* it does not hold, and a search of signs follows it on from there */
    }
}

void kempe_simulator_report(kempe_simulator *s)
{
    s->message[0] = 0;
    if (has_changes(s))
        report_conditions(s, s->t, s->part.value);
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

int kempe_simulator_wants_update(const kempe_simulator *s)
{
    bool wanted = s->part.state[AT_BAD] > 0;
    for (int k = 0; k < s->equations->conditions; k++)
        wanted = wanted || (!is_of_friction(s->equations, k) && differs(s, k, s->part.value[k]));
    return wanted;
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
