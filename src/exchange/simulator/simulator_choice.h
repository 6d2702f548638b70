/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice and exchange of independent coordinates and rows. A part of kempe_simulator.c. */
#ifndef SIMULATOR_CHOICE_H
#define SIMULATOR_CHOICE_H

#include "exchange/simulator/simulator_messages.h"

static void set_weights(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    for (int k = 0; k < f; k++) {
        int c = part->column[r + k];
        bool state = e->coordinate_kind[c] == KEMPE_COORDINATE_STATE;
        double tolerance = s->settings.atol * e->scale[c];
        part->atol[k] = state ? KMP_UNCONTROLLED : tolerance;
        part->atol[f + k] = state ? tolerance : tolerance * part->state[AT_RATE];
    }
    for (int i = 0; i < r; i++)
        part->atol[2 * f + i] = s->settings.atol * e->scale[part->column[i]];
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

/* Exchanges dependent and independent coordinates, largest entry of the scaled B first, until none exceeds
 * KMP_EXCHANGE_GROWTH. J is that of the present place. */
static outcome improve_choice(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    if (evaluate_loops(s, t) != GOOD)
        return SINGULAR_LOOPS;
    evaluate_rates(s);
    double *b = part->tangent;
    for (int k = 0; k < f; k++)
        for (int i = 0; i < r; i++)
            b[i + k * r] *= e->scale[part->column[r + k]] / e->scale[part->column[i]];
    for (int pass = 0; pass < 10 * (f + r); pass++) {
        int worst = 0;
        for (int at = 1; at < f * r; at++)
            if (fabs(b[at]) > fabs(b[worst]))
                worst = at;
        if (f * r == 0 || !(fabs(b[worst]) > KMP_EXCHANGE_GROWTH))
            break;
        int i = worst % r, k = worst / r;
        for (int j = 0; j < f; j++)
            if (j != k)
                (void)kmp_exchange_column(r, i, b + (ptrdiff_t)k * r, b + (ptrdiff_t)j * r);
        kmp_exchange_pivot(r, i, b + (ptrdiff_t)k * r);
        kmp_swap_int(&part->column[i], &part->column[r + k]);
        s->work.exchanges++;
    }
    find_structure(s);
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
    if (evaluate_loops(s, t) != GOOD || share_of_rows(s) > KMP_ROWS_OUT)
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
    return growth(s) > limit || share_of_rows(s) > KMP_ROWS_OUT || charts_are_due(s);
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

/* The first redundant row that does not close with the others; -1: none. */
static int open_row(const kempe_simulator *s)
{
    double allowed = fmax(KMP_DROPPED_WEIGHTS * (s->settings.atol + s->settings.rtol),
                          KMP_DROPPED_TOLERANCES * s->part.state[AT_LOOSE]);
    for (int i = rank_of(s); i < s->equations->rows; i++)
        if (!(opening(s, s->part.row[i]) <= allowed))
            return s->part.row[i];
    return -1;
}

static kempe_simulator_status report_open_row(kempe_simulator *s, int row, double t)
{
    const kempe_equations *e = s->equations;
    return fail_with(
        s,
        "closure row '%s', redundant at the start, has the residual %.3g (scaled) at t = %.9g: the motion began "
        "at a change point, where the closures have a lower rank; start near it, on the intended branch",
        e->row_names[row], opening(s, row), t);
}

#endif
