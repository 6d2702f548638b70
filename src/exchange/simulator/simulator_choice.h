/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice and exchange of independent coordinates and rows. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_messages.h"

/* The number of coordinates before the states of the model. */
static int motions_of(const kempe_equations *e)
{
    int count = 0;
    while (count < e->coordinates && e->coordinate_kind[count] != KEMPE_COORDINATE_STATE)
        count++;
    return count;
}

static void set_weights(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    kmp_start_tolerances(freedom_of(s), part->column + rank_of(s), rank_of(s), part->column, motions_of(e), e->scale,
                         s->settings.atol, part->state[AT_RATE], 1, part->atol);
}

/* Rows and columns of the scaled J, which is evaluated, in the order of complete pivoting, and the pivots. Coordinates
 * marked as fixed (NULL: none) come last. */
static void order_pivots(kempe_simulator *s, const int *fixed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++)
            part->pick[i + (ptrdiff_t)j * m] =
                part->jacobian[(ptrdiff_t)i * n + j] * e->scale[j] * part->inverse_row[i];
    kmp_lu_complete(m, n, part->pick, fixed, part->new_row, part->new_column, part->pivots);
}

static void take_order(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    for (int i = 0; i < s->equations->rows; i++)
        part->row[i] = part->new_row[i];
    for (int j = 0; j < s->equations->coordinates; j++)
        part->column[j] = part->new_column[j];
    find_structure(s);
}

/* Chooses rows and dependent coordinates, as many as before. Coordinates marked as fixed stay independent as far as
 * they can. */
static void choose(kempe_simulator *s, const int *fixed)
{
    order_pivots(s, fixed);
    take_order(s);
}

/* Exchanges dependent and independent coordinates until none of the scaled B is too large. J is that of the present
 * place. */
static outcome improve_choice(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    const int f = freedom_of(s), r = rank_of(s);
    double *b = part->tangent, largest;
    for (int left = 4 * e->coordinates, made = 1; made > 0; left -= made) {
        if (evaluate_loops(s, t) != GOOD)
            return SINGULAR_LOOPS;
        evaluate_rates(s);
        for (int k = 0; k < f; k++)
            for (int i = 0; i < r; i++)
                b[i + k * r] *= e->scale[part->column[r + k]] / e->scale[part->column[i]];
        made = kmp_exchange_columns(r, f, b, part->column, kmp_exchange_limit(false, false), left, part->diagonal,
                                    part->new_column, &largest);
        s->work.exchanges += made;
        find_structure(s);
    }
    return GOOD;
}

/* -- charts of spherical joints ----------------------------------------------------------------------------------- */

/* True where the angles of a joint are near to singular at the placed q. */
static bool charts_are_due(const kempe_simulator *s)
{
    const kempe_charts *charts = s->equations->charts;
    bool due = false;
    for (int c = 0; charts && c < charts->joints; c++)
        due = due || charts->regular(charts, c, s->part.q) < KMP_AXES_CENTRED;
    return due;
}

/* Gives the joints that are due new angles at the placed q and qd, and others with them: each time ends steps. */
static void center_charts(kempe_simulator *s, double t)
{
    const kempe_charts *charts = s->equations->charts;
    struct kempe_simulator_parts *part = &s->part;
    if (!charts_are_due(s))
        return;
    for (int c = 0; c < charts->joints; c++) {
        if (charts->regular(charts, c, part->q) > KMP_AXES_ALONG)
            continue;
        if (is_own(chart_of(s, c)))
            copy(3, part->q + charts->first[c], part->seen + 3 * (ptrdiff_t)c);
        charts->center(charts, c, chart_of(s, c), part->q, part->qd);
    }
    *part->seen_t = t;
}

/* -- exchanges ---------------------------------------------------------------------------------------------------- */

/* Exchanges the choice at the placed, closed q, and angles that are near to singular; qd is placed too. */
static outcome exchange_choice(kempe_simulator *s, double t)
{
    center_charts(s, t);
    if (evaluate_loops(s, t) != GOOD || kmp_dropped_judge(share_of_rows(s)) != KMP_KEPT_WELL)
        choose(s, NULL);
    outcome said = improve_choice(s, t);
    if (said == GOOD)
        said = evaluate_loops(s, t);
    if (said == GOOD)
        s->part.state[AT_SIGN] = signs_of_loops(s);
    set_weights(s);
    return said;
}

/* True where the choice at the place of the last evaluation is bad. */
static bool is_choice_bad(const kempe_simulator *s, double limit)
{
    const int *v = s->part.column, r = rank_of(s);
    int worst[2];
    return kmp_exchange_growth(r, v, freedom_of(s), v + r, s->part.tangent, s->equations->scale, worst, worst + 1) >
               limit ||
           kmp_dropped_judge(share_of_rows(s)) != KMP_KEPT_WELL || charts_are_due(s);
}

/* Rows of friction that are not held: they are zero. */
static int rows_let_go(const kempe_simulator *s)
{
    const kempe_friction *friction = s->equations->friction;
    int count = 0;
    for (int i = 0; friction && i < friction->elements; i++)
        count += !(s->part.modes[friction->slot[i] + 1] > 0);
    return count;
}

/* False after a message: a redundant row does not close with the others at t. */
static bool dropped_rows_close(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    const int r = rank_of(s);
    const int row = kmp_dropped_open(r, s->part.row, e->rows - r, s->part.row + r, 1, s->part.h, e->row_scale,
                                     s->settings.atol + s->settings.rtol, s->part.state[AT_LOOSE]);
    if (row >= 0)
        fail_with(
            s,
            "closure row '%s', redundant at the start, has the residual %.3g (scaled) at t = %.9g: the motion began "
            "at a change point, where the closures have a lower rank; start near it, on the intended branch",
            e->row_names[row], opening(s, row), t);
    return row < 0;
}
