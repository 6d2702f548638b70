/* SPDX-License-Identifier: BSD-3-Clause */
/* Spherical joints: coordinates of the motion count from an orientation that changes between steps, before their angles
 * become singular; those of the caller are followed. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_dense.h"

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
        else if (charts->follow(charts, c, chart, part->seen + 3 * (ptrdiff_t)c, !anyhow, part->q, next) >
                     KMP_AXES_NEAR_BY &&
                 !anyhow)
            return false;
    }
    copy(3 * charts->joints, part->next_seen, part->seen);
    return true;
}

/* Follows the caller's angles to t within the last step. */
static void follow_angles(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    if (!charts_have_moved(s))
        return;
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

/* Changes of the motion's coordinates, rates and accelerations into those of the caller's. */
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
