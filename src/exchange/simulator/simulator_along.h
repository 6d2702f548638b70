/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact directional derivatives. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_motion.h"

static void call_along(kempe_simulator *s, const kempe_direction *direction)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, s->t);
    e->along(&at, direction, part->dynamics, part->dh, part->drates, part->daccelerations, part->dy, part->dvalue);
}

/* Adds the change of v from `rows` to dx: -Jv^-1 rows. */
static void add_dependent(kempe_simulator *s, const double *rows, double *dx)
{
    const struct kempe_simulator_parts *part = &s->part;
    solve_rows(s, rows, part->correction);
    for (int i = 0; i < rank_of(s); i++)
        dx[part->column[i]] += part->correction[i];
}

/* -- changes of a start -------------------------------------------------------------------------------------- */

/* True if parameters that move the start change, or have changed. */
static bool moves_start(const kempe_simulator *s, const kempe_simulator_change *change)
{
    const kempe_equations *e = s->equations;
    bool moves = false;
    for (int k = 0; e->start.keeps && e->parameter_fixed && k < e->parameters; k++)
        moves =
            moves || (e->parameter_fixed[k] && ((change->p && change->p[k] != 0) || s->p[k] != e->parameter_values[k]));
    return moves;
}

/* The changes of the given start values, in pairs q, qd. The simulator is saved in `backup`. */
static void change_given(kempe_simulator *s, const double *dp, double *change)
{
    static const double weights[] = {45, -9, 1};
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    const double *p = part->backup + (s->p - part->state);
    double *given = part->stages, largest = 0;
    clear(2 * e->coordinates, change);
    for (int k = 0; k < e->parameters; k++)
        largest = fmax(largest, fabs(dp[k]) / (p[k] != 0 ? fabs(p[k]) : 1));
    for (int i = -3; e->start.values && largest > 0 && i <= 3; i++) {
        const double step = KMP_START_DIFFERENCE / largest;
        if (i == 0)
            continue;
        for (int k = 0; k < e->parameters; k++)
            s->p[k] = p[k] + i * step * dp[k];
        if (e->prepare)
            e->prepare(s->p, part->k);
        kempe_arguments at = arguments_at(s, s->t);
        e->start.values(&at, given);
        for (int j = 0; j < 2 * e->coordinates; j++)
            change[j] += (i < 0 ? -1 : 1) * weights[(i < 0 ? -i : i) - 1] * given[j] / (60 * step);
    }
    copy(e->parameters, p, s->p);
    if (e->prepare)
        e->prepare(s->p, part->k);
}

/* Chooses with the marked coordinates as independent ones, and factors Jv. */
static outcome choose_marked(kempe_simulator *s)
{
    outcome said = evaluate_loops(s, s->t);
    if (said != GOOD)
        return said;
    choose(s, s->part.fixed);
    return evaluate_loops(s, s->t);
}

/* dq and dqd of a start that is closed again: coordinates that are kept move as their given values do. */
static outcome change_start(kempe_simulator *s, const kempe_simulator_change *change, const kempe_direction *direction)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    const int n = e->coordinates, f = freedom_of(s), r = rank_of(s);
    const bool moves = moves_start(s, change);
    if (charts_have_moved(s)) /* start values belong to other angles */
        return MOVED_ANGLES;
    double *given = part->stages + 2 * n;
    kempe_simulator_save(s, part->backup);
    clear(2 * n, given);
    if (moves && change->p)
        change_given(s, change->p, given);
    const bool from = change->start == KEMPE_CHANGE_START_FROM;
    for (int j = 0; j < n; j++) {
        given[2 * j] = from && is_given(change->given_q, j) ? 0 : given[2 * j];
        given[2 * j + 1] = from && is_given(change->given_qd, j) ? 0 : given[2 * j + 1];
    }
    int kept = moves ? mark_kept(s, KEMPE_START_KEEPS_PLACE) : 0;
    for (int j = 0; !moves && j < n; j++)
        part->fixed[j] = 0;
    for (int k = 0; kept == 0 && e->start.independent && k < e->freedom; k++)
        part->fixed[e->start.independent[k]] = 1;
    if (from)
        mark_given(s, s->t, change->given_q);
    outcome said = choose_marked(s);
    for (int k = 0; k < f; k++)
        part->dq[part->column[r + k]] = given[2 * part->column[r + k]];
    if (said == GOOD && r > 0) {
        call_along(s, direction);
        add_dependent(s, part->dh, part->dq);
    }
    if (said == GOOD && from)
        mark_given(s, s->t, change->given_qd);
    if (said == GOOD && (from || (moves && mark_kept(s, KEMPE_START_KEEPS_RATE) > 0)))
        said = choose_marked(s);
    for (int k = 0; k < f; k++)
        part->dqd[part->column[r + k]] = given[2 * part->column[r + k] + 1];
    if (said == GOOD && r > 0) {
        call_along(s, direction);
        add_dependent(s, part->drates, part->dqd);
    }
    put_back(s, part->backup);
    return said == GOOD ? refresh(s) : said;
}

static void hand_out(int count, const double *from, double *to)
{
    if (to)
        copy(count, from, to);
}

kempe_simulator_status kempe_simulator_along(kempe_simulator *s, const kempe_simulator_change *change)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows, f = freedom_of(s), r = rank_of(s);
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    if (!e->along) {
        return fail_with(s, "derivatives were not generated");
    }
    for (int j = 0; change->start == KEMPE_CHANGE_START && e->start.keeps && j < n; j++)
        if (e->start.keeps[j] & KEMPE_START_BALANCES)
            return fail_with(s, "a start whose deformations are in balance with its loads has no derivatives here: "
                                "start from given coordinates");
    outcome said = refresh(s);
    if (said != GOOD)
        return explain(s, said, s->t);
    const kempe_direction direction = {change->t,
                                       change->p ? change->p : part->zero,
                                       part->dq,
                                       part->dqd,
                                       part->dqdd,
                                       part->dlambda,
                                       change->u ? change->u : part->zero + e->parameters};
    clear(n, part->dq);
    clear(n, part->dqd);
    clear(n, part->dqdd);
    clear(m, part->dlambda);
    if (change->start != KEMPE_CHANGE_HERE)
        said = change_start(s, change, &direction);
    if (said != GOOD)
        return explain(s, said, s->t);
    for (int i = 0; i < r; i++)
        part->dq[part->column[i]] = part->dqd[part->column[i]] = 0;
    for (int k = 0; change->x && k < f; k++) {
        part->dq[part->column[r + k]] += change->x[e->freedom - f + k];
        part->dqd[part->column[r + k]] += change->x[2 * e->freedom - f + k];
    }
    for (int k = 0; change->x && k < states_that_roll(s); k++)
        part->dq[part->column[least_rank(e) + k]] = change->x[k];
    if (r > 0) {
        call_along(s, &direction);
        add_dependent(s, part->dh, part->dq);
        call_along(s, &direction);
        add_dependent(s, part->drates, part->dqd);
    }
    call_along(s, &direction);
    add_constant(s, part->dynamics, part->daccelerations, part->load);
    solve_for(s, part->dqdd, part->dlambda); /* by the factors of the motion */
    if (change->y || change->value || e->friction)
        call_along(s, &direction);
    if (e->friction) { /* outputs read it as multipliers of its rows: show_friction */
        for (int i = 0; i < e->friction->elements; i++)
            part->dlambda[e->friction->row[i]] = part->dvalue[e->friction->slot[i] + KMP_ROLE_GIVEN - KMP_ROLE_SENSE];
        call_along(s, &direction);
    }
    for (int k = 0; change->dx && k < e->freedom; k++) {
        change->dx[k] = part->dqd[part->column[least_rank(e) + k]];
        change->dx[e->freedom + k] = part->dqdd[part->column[least_rank(e) + k]];
    }
    for (int k = 0; change->states && k < e->freedom; k++) {
        change->states[k] = part->dq[part->column[least_rank(e) + k]];
        change->states[e->freedom + k] = part->dqd[part->column[least_rank(e) + k]];
    }
    carry_changes(s);
    hand_out(n, part->dq, change->q);
    hand_out(n, part->dqd, change->qd);
    hand_out(n, part->dqdd, change->qdd);
    hand_out(m, part->dlambda, change->lambda);
    hand_out(e->outputs, part->dy, change->y);
    hand_out(e->conditions, part->dvalue, change->value);
    return KEMPE_SIMULATOR_GOES;
}
