/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice and exchange of independent coordinates and rows. Conditions: their values, changes of modes, ends of the
 * motion. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_dynamics.h"

/* -- choice ---------------------------------------------------------------------------------------------- */

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

/* Exchanges dependent and independent coordinates until none of the scaled B is too large. J belongs to the present
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

/* -- exchanges ---------------------------------------------------------------------------------------------------- */

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
        fail_with(s,
                  "constraint equation '%s', redundant at the start, is open by %.3g (relative) at t = %.9g: the "
                  "motion began at a change point; start near it, on the intended branch",
                  e->row_names[row], opening(s, row), t);
    return row < 0;
}

/* -- conditions ------------------------------------------------------------------------------------------ */

static bool is_of_friction(const kempe_equations *e, int k)
{
    return e->condition_kind[k] == KEMPE_CONDITION_PASSES || e->condition_kind[k] >= KEMPE_CONDITION_NUMBER;
}

static kmp_condition_kind kind_of(const kempe_simulator *s, int k)
{
    return (kmp_condition_kind)s->equations->condition_kind[k];
}

/* True if condition k has changed, with this value. */
static bool differs(const kempe_simulator *s, int k, double value)
{
    return kmp_condition_differs(kind_of(s, k), s->part.modes[k], value);
}

static bool any_differs(const kempe_simulator *s, const double *value)
{
    bool any = false;
    for (int k = 0; k < s->equations->conditions; k++)
        any = any || differs(s, k, value[k]);
    return any;
}

static bool has_changes(const kempe_simulator *s)
{
    return s->equations->conditions > 0;
}

/* -- kinks ------------------------------------------------------------------------------------------------- */

/* The part of the largest value of a kink within which it is not fixed. */
static double within_kinks(const kempe_simulator *s)
{
    return KMP_KINK_TOLERANCES * s->settings.rtol;
}

/* The branch on which a kink that is not fixed is to be fixed; 0: it is near to it, or no kink. */
static double branch_of(kempe_simulator *s, int k, double value)
{
    struct kempe_simulator_parts *part = &s->part;
    const bool away = kind_of(s, k) == KMP_CONDITION_KINK &&
                      kmp_kink_is_away(part->modes[k], value, within_kinks(s), &part->largest[k]);
    return !away ? 0 : value < 0 ? 1 : -1;
}

/* Notes the branches of kinks at the end of a step, which the next step takes. */
static void note_branches(kempe_simulator *s, const double *value)
{
    for (int k = 0; k < s->equations->conditions; k++)
        s->part.flip[k] = 2 * branch_of(s, k, value[k]);
}

static void take_branches(kempe_simulator *s)
{
    for (int k = 0; k < s->equations->conditions; k++) {
        if (fabs(s->part.flip[k]) > 1)
            s->part.modes[k] = s->part.flip[k] / 2;
        s->part.flip[k] = 0;
    }
}

/* Largest values since the last change. */
static void note_sizes(kempe_simulator *s, const double *value)
{
    for (int k = 0; k < s->equations->conditions; k++)
        s->part.most[k] = fmax(s->part.most[k], fabs(value[k]));
}

/* Puts conditions of validity into the message, each once, where their values at t are negative by more than
 * rounding.
 */
static void report_conditions(kempe_simulator *s, double t, const double *value)
{
    const kempe_equations *e = s->equations;
    for (int k = 0; k < e->conditions; k++) {
        const double least = -KMP_LEVEL_ROUNDING * fmax(s->part.most[k], fabs(value[k]));
        if (kind_of(s, k) == KMP_CONDITION_VALIDITY && value[k] < least && s->part.repeats[k]++ == 0)
            snprintf(s->message, sizeof s->message, "%s: %s at t = %.9g: %s", e->name, e->condition_names[k], t,
                     e->advice[k]);
    }
}

static void put_place(const kempe_simulator *s, double *place)
{
    const struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates;
    copy(n, part->q, place);
    copy(n, part->qd, place + n);
    copy(n, part->qdd, place + 2 * n);
    copy(s->equations->rows, part->lambda, place + 3 * n);
}

static void take_place(kempe_simulator *s, const double *place)
{
    struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates;
    copy(n, place, part->q);
    copy(n, place + n, part->qd);
    copy(n, place + 2 * n, part->qdd);
    copy(s->equations->rows, place + 3 * n, part->lambda);
}

static void evaluate_changes(kempe_simulator *s, double t, double *value)
{
    kempe_arguments at = arguments_at(s, t);
    s->equations->changes(&at, value);
}

static kempe_simulator_status end_motion(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    int k = (int)s->part.state[AT_ENDED] - 1;
    const char *advice = e->advice ? e->advice[k] : NULL;
    snprintf(s->message, sizeof s->message, "%s: the motion ends at t = %.9g: %s%s%s", e->name, s->t,
             e->condition_names[k], advice && *advice ? "; " : "", advice ? advice : "");
    return KEMPE_SIMULATOR_ENDED;
}

/* Changes the mode of condition k at t. False after a message: it changes back and forth. */
static bool change_mode(kempe_simulator *s, int k, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    const bool at_once = kmp_changes_at_once(t, part->last[k], KMP_EVENT_INSTANT / part->state[AT_RATE]);
    part->repeats[k] = at_once ? part->repeats[k] + 1 : 0;
    part->last[k] = t;
    if (e->condition_kind[k] == KEMPE_CONDITION_KINK) {
        /* The other branch. It is not fixed where it is passed within the errors of steps, as at rest, or repeatedly.
         */
        const bool idle = kmp_kink_is_idle(part->most[k], within_kinks(s), part->largest[k], (int)part->repeats[k]);
        part->modes[k] = idle ? 0 : part->modes[k] > 0 ? -1 : 1;
        part->most[k] = 0;
        return true;
    }
    part->modes[k] = part->modes[k] > 0 ? 0 : 1;
    s->work.events++;
    if (part->repeats[k] < KMP_EVENT_REPEATS)
        return true;
    const char *advice = e->advice ? e->advice[k] : NULL;
    fail_with(s, "%s changes back and forth at t = %.9g: %s", e->condition_names[k], t,
              advice && *advice
                  ? advice
                  : "the motion slides along this condition; make the law continuous there, for instance with tanh");
    return false;
}

/* Rates after an impact, where modes have changed the closures: M (qd - before) = J' p, J qd + h_t = 0. The placed qd
 * is that before; loops and motion are evaluated. */
static outcome jump(kempe_simulator *s, double t, const double *before, double *y)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = freedom_of(s), r = rank_of(s);
    double worst = 0, fastest = 0;
    for (int j = 0; j < n; j++) {
        worst = fmax(worst, fabs(part->qd[j] - before[j]) / e->scale[j]);
        fastest = fmax(fastest, fabs(before[j]) / e->scale[j]);
    }
    if (!(worst > KMP_RATES_JUMP * fastest))
        return GOOD;
    for (int k = 0; k < f; k++)
        part->qd[part->column[r + k]] = 0;
    evaluate_rates(s);
    reduce_mass(s);
    if (factor_mass(s) != GOOD)
        return SINGULAR_MASS;
    for (int i = 0; i < n; i++) {
        part->right[i] = 0;
        for (int j = 0; j < n; j++)
            part->right[i] += part->mass[(ptrdiff_t)i * n + j] * (before[j] - part->qd[j]);
    }
    project(s, part->right, part->udd);
    kmp_cholesky_solve(f, part->reduced, part->udd);
    pack_y(s, part->q, part->qd, y);
    copy(f, part->udd, y + f);
    return slopes_closed(s, t, y, NULL);
}

/* The rate of the motion, 1/s: of the tolerances of rates. */
static double rate_of_motion(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    const double left = s->settings.end - part->state[AT_END];
    const double rate =
        kmp_start_rate(motions_of(e), e->scale, part->qd, part->qdd, left > 0 && left <= DBL_MAX ? 1 / left : 0);
    return rate > 0 && rate <= DBL_MAX ? rate : 1;
}

/* Changes modes at the placed state. Modes may decide values of others, so that one change causes the next: loops are
 * closed and rates found with the last ones. *last: a condition that has changed, -1: none; *ends: 1 + a condition that
 * ends the motion with these modes, 0. False after a message. */
static bool change_modes(kempe_simulator *s, double t, int *last, int *ends)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int changed = 0;
    *last = -1;
    for (int pass = 0; changed >= 0 && pass < KMP_EVENT_REPEATS; pass++) {
        evaluate_changes(s, t, part->value);
        changed = -1;
        *ends = 0;
        for (int k = 0; k < e->conditions; k++) {
            if (is_of_friction(e, k) || !differs(s, k, part->value[k]))
                continue;
            if (e->condition_kind[k] == KEMPE_CONDITION_ENDS) {
                *ends = k + 1;
                continue;
            }
            if (!change_mode(s, k, t))
                return false;
            *last = changed = k;
        }
    }
    return true;
}

/* Changes modes at the state y until all conditions agree with them; *changed: some have. At the start,
 * where the motion does not continue yet, and where no acceleration is finite because modes are not decided yet,
 * conditions have their values at rest. The state is placed and complete. */
static kempe_simulator_status settle_modes(kempe_simulator *s, double t, double *y, bool goes, bool *changed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int last = -1;
    for (int pass = 0; pass < KMP_EVENT_REPEATS; pass++) {
        if (pass > 0)
            copy(e->coordinates, part->qd, part->dqd);
        outcome said = slopes_closed(s, t, y, NULL);
        if (said == GOOD && goes && *changed)
            said = jump(s, t, part->dqd, y);
        const bool at_rest = said == NOT_FINITE && !goes && pass == 0 && has_changes(s);
        if (said != GOOD && !at_rest)
            return explain(s, said, t);
        if (at_rest) {
            clear(e->coordinates, part->qdd);
            clear(e->rows, part->lambda);
        } else {
            complete(s);
        }
        if (!has_changes(s))
            return KEMPE_SIMULATOR_GOES;
        int ends;
        if (!change_modes(s, t, &last, &ends))
            return KEMPE_SIMULATOR_FAILED;
        *changed = *changed || last >= 0;
        if (last < 0 && ends > 0)
            part->state[AT_ENDED] = ends;
        if (last < 0)
            return at_rest ? explain(s, said, t) : KEMPE_SIMULATOR_GOES;
    }
    return fail_with(s, "%s contradicts another condition at t = %.9g", e->condition_names[last], t);
}
