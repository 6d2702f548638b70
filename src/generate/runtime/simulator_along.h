/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact directional derivatives. A part of kempe_simulator.c. */
#ifndef SIMULATOR_ALONG_H
#define SIMULATOR_ALONG_H

#include "generate/runtime/simulator_states.h"

static void call_along(kempe_simulator *s, const kempe_direction *direction)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, s->t);
    e->along(&at, direction, part->dynamics, part->dh, part->drates, part->daccelerations, part->dy, part->dvalue);
}

/* dx of v from `rows`: -Jv^-1 rows. */
static void add_dependent(kempe_simulator *s, const double *rows, double *dx)
{
    const struct kempe_simulator_parts *part = &s->part;
    solve_rows(s, rows, part->correction);
    for (int i = 0; i < rank_of(s->equations); i++)
        dx[part->column[i]] = part->correction[i];
}

/* The changes of accelerations and multipliers, by the factors of the motion. */
static void solve_along(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    add_constant(s, part->dynamics, part->daccelerations, part->load);
    solve_motion(s, part->load, part->udd, part->correction);
    for (int k = 0; k < f; k++)
        part->dqdd[part->column[r + k]] = part->udd[k];
    for (int i = 0; i < r; i++) {
        double a = part->constant[i];
        for (int k = 0; k < f; k++)
            a += part->tangent[i + k * r] * part->udd[k];
        part->dqdd[part->column[i]] = a;
        part->dlambda[part->row[i]] = part->correction[i];
    }
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
    int n = e->coordinates, m = e->rows, f = e->freedom, r = rank_of(e);
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    if (!e->along) {
        snprintf(s->message, sizeof s->message, "%s: derivatives were not generated", e->name);
        return KEMPE_SIMULATOR_FAILED;
    }
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
    for (int k = 0; change->x && k < f; k++) {
        part->dq[part->column[r + k]] = change->x[k];
        part->dqd[part->column[r + k]] = change->x[f + k];
    }
    if (r > 0) {
        call_along(s, &direction);
        add_dependent(s, part->dh, part->dq);
        call_along(s, &direction);
        add_dependent(s, part->drates, part->dqd);
    }
    call_along(s, &direction);
    solve_along(s);
    if (change->y || change->value)
        call_along(s, &direction);
    for (int k = 0; change->dx && k < f; k++) {
        change->dx[k] = part->dqd[part->column[r + k]];
        change->dx[f + k] = part->dqdd[part->column[r + k]];
    }
    hand_out(n, part->dq, change->q);
    hand_out(n, part->dqd, change->qd);
    hand_out(n, part->dqdd, change->qdd);
    hand_out(m, part->dlambda, change->lambda);
    hand_out(e->outputs, part->dy, change->y);
    hand_out(e->conditions, part->dvalue, change->value);
    return KEMPE_SIMULATOR_GOES;
}

#endif
