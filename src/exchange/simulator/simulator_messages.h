/* SPDX-License-Identifier: BSD-3-Clause */
/* Failures as sentences. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_dynamics.h"

static int widest_row(const kempe_simulator *s)
{
    int worst = 0;
    double most = -1;
    for (int i = 0; i < s->equations->rows; i++)
        if (!(opening(s, i) <= most)) {
            most = opening(s, i);
            worst = i;
        }
    return worst;
}

/* The dependent coordinate whose pivot of Jv is least. */
static int lost_column(const kempe_simulator *s)
{
    const int *column = s->part.column;
    const double *loop = s->part.loop;
    int least = 0;
    double size = INFINITY;
    for (int b = 0; b < s->part.blocks; b++) {
        int from = s->part.block[b], count = s->part.block[b + 1] - from;
        for (int i = 0; i < count; i++) {
            double pivot = fabs(loop[i + i * count]) * s->equations->scale[column[from + i]];
            if (!(pivot >= size)) {
                least = from + i;
                size = pivot;
            }
        }
        loop += (ptrdiff_t)count * count;
    }
    return column[least];
}

static kempe_simulator_status explain(kempe_simulator *s, outcome said, double t)
{
    const kempe_equations *e = s->equations;
    int row, bad;
    switch (said) {
    case TOLD:
        return KEMPE_SIMULATOR_FAILED;
    case OPEN:
        row = widest_row(s);
        return fail_with(
            s,
            "the loops cannot be closed at t = %.9g: row '%s' has the residual %.2g (scaled); start nearer to a "
            "closed configuration, or change parameters so that the mechanism can reach this one",
            t, e->row_names[row], opening(s, row));
    case SINGULAR_LOOPS:
        row = lost_column(s);
        return fail_with(s,
                         "the loops do not determine coordinate '%s' at t = %.9g: the mechanism is at a singular "
                         "configuration, where its closures lose a row",
                         e->coordinate_names[row], t);
    case SINGULAR_MASS:
        bad = e->loads ? 0 : (int)s->part.diagonal[0] - 1;
        return fail_with(
            s, "the motion of coordinate '%s' moves no mass at t = %.9g: give a body that it moves mass or inertia",
            e->coordinate_names[s->part.column[rank_of(s) + bad]], t);
    case UNSETTLED:
        return fail_with(
            s,
            "forces that depend on reactions have no solution that is found from zero reactions at t = %.9g: "
            "such friction locks or has several solutions; reduce the force",
            t);
    case MOVED_ANGLES:
        return fail_with(
            s, "the angles of a spherical joint are near to singular at the start: derivatives with respect to "
               "start values are not defined there; start from other angles");
    default:
        return fail_with(s, "accelerations are not finite at t = %.9g: a force or an input there is not a number", t);
    }
}
