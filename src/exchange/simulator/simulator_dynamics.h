/* SPDX-License-Identifier: BSD-3-Clause */
/* Closing of loops by Newton's method, accelerations, multipliers, the right-hand side, and their failures as
 * sentences. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_memory.h"

/* -- loops ----------------------------------------------------------------------------------------------- */

static kempe_arguments arguments_at(const kempe_simulator *s, double t)
{
    const struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = {t, part->k, part->q, part->qd, part->qdd, part->lambda, part->modes, part->held, part->chart};
    return at;
}

/* Evaluates h, J and h_t at the placed q and factors Jv, whose rows are scaled: scaled columns have the same pivots. */
static outcome evaluate_loops(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates;
    *factors_are_present(s) = 0;
    if (e->rows == 0)
        return GOOD;
    kempe_arguments at = arguments_at(s, t);
    e->closures(&at, part->h, part->jacobian, part->h_t);
    s->work.closings++;
    double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        const int *column = part->column + from;
        for (int i = 0; i < count; i++) {
            const double *row = part->jacobian + (ptrdiff_t)part->row[from + i] * n;
            double size = part->inverse_row[part->row[from + i]];
            for (int k = 0; k < count; k++)
                loop[i + k * count] = row[column[k]] * size;
        }
        if (kmp_lu_factor(count, loop, part->pivot + from))
            return SINGULAR_LOOPS;
        loop += (ptrdiff_t)count * count;
    }
    return GOOD;
}

/* x <- Jv^-1 x or x <- Jv^-T x, by the factors, whose rows are scaled. */
static void solve_loops(const kempe_simulator *s, double *x, int transposed)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        if (transposed)
            kmp_lu_solve_transposed(count, loop, part->pivot + from, x + from);
        else
            kmp_lu_solve(count, loop, part->pivot + from, 1, x + from);
        loop += (ptrdiff_t)count * count;
    }
}

/* x = -Jv^-1 of rows; `rows` has all m. */
static void solve_rows(const kempe_simulator *s, const double *rows, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    for (int i = 0; i < rank_of(s); i++)
        x[i] = -rows[part->row[i]] * part->inverse_row[part->row[i]];
    solve_loops(s, x, 0);
}

static double opening(const kempe_simulator *s, int row)
{
    return fabs(s->part.h[row]) * s->part.inverse_row[row];
}

/* The largest h of the rows that are kept, scaled; infinite if an entry is not finite. */
static double residual(const kempe_simulator *s)
{
    double worst = 0;
    for (int i = 0; i < rank_of(s); i++) {
        double open = opening(s, s->part.row[i]);
        worst = open <= worst ? worst : open <= DBL_MAX ? open : INFINITY;
    }
    return worst;
}

/* Closes the loops by Newton's method on v at the placed q; leaves J and its factors there. *first: the size of the
 * first correction (may be NULL). */
static outcome close_loops(kempe_simulator *s, double t, double *first)
{
    const kmp_close_rule rule = {.most = KMP_CLOSING_PASSES,
                                 .contracting = true,
                                 .longest = KMP_LONGEST_CORRECTION,
                                 .enough = KMP_CLOSED_ENOUGH};
    const double *scale = s->equations->scale, noise = kmp_close_noise(s->equations->coordinates, scale, s->part.q);
    const int *v = s->part.column, r = rank_of(s);
    kmp_closed out = {0};
    double last = INFINITY, part;
    while (out.corrections < rule.most) {
        if (evaluate_loops(s, t) != GOOD)
            return SINGULAR_LOOPS;
        solve_rows(s, s->part.h, s->part.correction);
        double size = 0; /* infinite where a correction is not finite */
        for (int i = 0; i < r; i++) {
            double d = fabs(s->part.correction[i]) / scale[v[i]];
            size = d <= size ? size : d <= DBL_MAX ? d : INFINITY;
        }
        const kmp_closing_move move = kmp_closing_judge(&out, &rule, noise, size, INFINITY, residual(s), &last, &part);
        if (first)
            *first = out.first;
        for (int i = 0; i < r && move != KMP_CLOSING_STOPS; i++)
            s->part.q[v[i]] += part * s->part.correction[i];
        if (move != KMP_CLOSING_GOES)
            break;
    }
    return out.closed ? GOOD : OPEN;
}

/* Column k of B = -Jv^-1 Ju, of the loops that move with its coordinate; adds what they gain by its rate to vd. */
static void evaluate_tangent(kempe_simulator *s, int k, double *restrict vd)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, r = rank_of(s), at = part->column[r + k], block = 0;
    double *restrict x = part->tangent + (ptrdiff_t)k * r, rate = part->qd[at];
    const double *loop = part->loop;
    for (int t = part->touch_begin[k]; t < part->touch_begin[k + 1]; t++) {
        for (; block < part->touch[t]; block++)
            loop += (ptrdiff_t)(part->block[block + 1] - part->block[block]) *
                    (part->block[block + 1] - part->block[block]);
        int from = part->block[block], end = part->block[block + 1];
        for (int i = from; i < end; i++)
            x[i] = -part->jacobian[(ptrdiff_t)part->row[i] * n + at] * part->inverse_row[part->row[i]];
        kmp_lu_solve(end - from, loop, part->pivot + from, 1, x + from);
        for (int i = from; i < end; i++)
            vd[i] += x[i] * rate;
    }
}

/* B, and vd = B ud - Jv^-1 h_t into the placed qd, which has ud. */
static void evaluate_rates(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    double *vd = part->tangent + (ptrdiff_t)f * r;
    bool moves = false;
    for (int i = 0; i < r; i++) {
        vd[i] = -part->h_t[part->row[i]] * part->inverse_row[part->row[i]];
        moves = moves || vd[i] != 0;
    }
    if (moves)
        solve_loops(s, vd, 0);
    for (int k = 0; k < f; k++)
        evaluate_tangent(s, k, vd);
    for (int i = 0; i < r; i++)
        part->qd[part->column[i]] = vd[i];
}

/* The largest share of a kept row in a redundant one, scaled. */
static double share_of_rows(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, r = rank_of(s);
    double most = 0;
    for (int i = r; i < e->rows; i++) {
        const double *row = part->jacobian + (ptrdiff_t)part->row[i] * n;
        for (int k = 0; k < r; k++)
            part->correction[k] = row[part->column[k]] * part->inverse_row[part->row[i]];
        solve_loops(s, part->correction, 1);
        for (int k = 0; k < r; k++)
            most = fmax(most, fabs(part->correction[k]));
    }
    return most;
}

/* The signs of the determinants of the blocks of Jv, as bits of a number; where there are many, of the last ones. */
static double signs_of_loops(const kempe_simulator *s)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    double signs = 1;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        int negative = 0;
        for (int i = 0; i < count; i++)
            negative ^= (loop[i + i * count] < 0) ^ (part->pivot[from + i] != i);
        signs = fmod(2 * signs + negative, 0x1p50);
        loop += (ptrdiff_t)count * count;
    }
    return signs;
}

/* -- accelerations and multipliers ----------------------------------------------------------------------- */

/* x += sum over v of b M, for b of dependent coordinates from `from` to `end`. */
static void add_moved(const kempe_simulator *s, int from, int end, const double *b, double *restrict x)
{
    const struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates;
    for (int i = from; i < end; i++) {
        const double *row = part->mass + (ptrdiff_t)part->column[i] * n;
        double factor = b[i];
        for (int at = part->mass_begin[part->column[i]]; at < part->mass_begin[part->column[i] + 1]; at++)
            x[part->mass_at[at]] += factor * row[part->mass_at[at]];
    }
}

/* Row k of T' c. */
static double project_on(const kempe_simulator *s, int k, const double *c)
{
    int r = rank_of(s);
    const double *b = s->part.tangent + (ptrdiff_t)k * r;
    const int *column = s->part.column, *block = s->part.block;
    double sum = c[column[r + k]];
    for (int t = s->part.touch_begin[k]; t < s->part.touch_begin[k + 1]; t++)
        for (int i = block[s->part.touch[t]]; i < block[s->part.touch[t] + 1]; i++)
            sum += b[i] * c[column[i]];
    return sum;
}

/* T' c. */
static void project(const kempe_simulator *s, const double *c, double *out)
{
    for (int k = 0; k < freedom_of(s); k++)
        out[k] = project_on(s, k, c);
}

/* M T and T' M T. */
static void reduce_mass(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = freedom_of(s), r = rank_of(s);
    for (int l = 0; l < f; l++) {
        double *moved = part->moved + (ptrdiff_t)l * n;
        copy(n, part->mass + (ptrdiff_t)part->column[r + l] * n, moved);
        for (int t = part->touch_begin[l]; t < part->touch_begin[l + 1]; t++)
            add_moved(s, part->block[part->touch[t]], part->block[part->touch[t] + 1], part->tangent + (ptrdiff_t)l * r,
                      moved);
        for (int k = l; k < f; k++)
            part->reduced[k + l * f] = project_on(s, k, moved);
    }
}

/* Column j: the change of C by multiplier j at the placed multipliers. Subtracts these changes from C: `bias` belongs
 * to the tangent at zero multipliers. A slope that is not finite, as of a root of squares at zero, counts as none:
 * this step is then one of a fixed-point iteration. */
static void evaluate_loads(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, r = rank_of(s);
    kempe_arguments at = arguments_at(s, t);
    e->loads(&at, part->pick);
    for (int j = 0; j < r; j++)
        for (int i = 0; i < n; i++) {
            double slope = part->pick[i * e->rows + part->row[j]];
            slope = fabs(slope) <= DBL_MAX ? slope : 0;
            part->loads[i + j * n] = slope;
            part->bias[i] -= slope * part->lambda[part->row[j]];
        }
}

/* The largest change when the multipliers of the last solution replace the placed ones, relative to the
 * largest one. */
static double take_multipliers(kempe_simulator *s, const double *found)
{
    struct kempe_simulator_parts *part = &s->part;
    double change = 0, size = 0;
    for (int j = 0; j < rank_of(s); j++) {
        double *lambda = &part->lambda[part->row[j]];
        double size_of_row = s->equations->row_scale[part->row[j]];
        change = fmax(change, fabs(found[j] - *lambda) * size_of_row);
        size = fmax(size, fabs(found[j]) * size_of_row);
        *lambda = found[j];
    }
    return size > 0 ? change / size : change;
}

/* [T'MT, T'L; Mv T, Lv - Jv'] of (udd, lambda). */
static outcome factor_joint(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = freedom_of(s), r = rank_of(s);
    for (int l = 0; l < f; l++) {
        for (int k = 0; k < f; k++)
            part->joint[k + l * n] = part->reduced[k > l ? k + l * f : l + k * f];
        for (int i = 0; i < r; i++)
            part->joint[f + i + l * n] = part->moved[part->column[i] + l * n];
    }
    for (int j = 0; j < r; j++) {
        double *column = part->joint + (ptrdiff_t)(f + j) * n;
        project(s, part->loads + (ptrdiff_t)j * n, column);
        for (int i = 0; i < r; i++)
            column[f + i] =
                part->loads[part->column[i] + j * n] - part->jacobian[(ptrdiff_t)part->row[j] * n + part->column[i]];
    }
    return kmp_lu_factor(n, part->joint, part->joint_pivot) ? SINGULAR_MASS : GOOD;
}

static outcome factor_mass(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s);
    for (int k = 0; k < f; k++)
        part->diagonal[k] = part->reduced[k + k * f];
    int bad = kmp_cholesky_factor(f, part->reduced);
    for (int k = 0; k < f && !bad; k++)
        bad = part->reduced[k + k * f] * part->reduced[k + k * f] > KMP_NO_MASS * part->diagonal[k] ? 0 : k + 1;
    if (bad)
        part->diagonal[0] = bad;
    return bad ? SINGULAR_MASS : GOOD;
}

/* M qdd - J' lambda + c = 0 for qdd = T udd: udd, and the multipliers (r; NULL: not wanted). */
static void solve_motion(kempe_simulator *s, const double *c, double *udd, double *lambda)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = freedom_of(s), r = rank_of(s);
    if (e->loads && r > 0) {
        project(s, c, part->right);
        for (int i = 0; i < r; i++)
            part->right[f + i] = c[part->column[i]];
        for (int i = 0; i < n; i++)
            part->right[i] = -part->right[i];
        kmp_lu_solve(n, part->joint, part->joint_pivot, 1, part->right);
        copy(f, part->right, udd);
        if (lambda)
            copy(r, part->right + f, lambda);
        return;
    }
    project(s, c, udd);
    for (int k = 0; k < f; k++)
        udd[k] = -udd[k];
    kmp_cholesky_solve(f, part->reduced, udd);
    for (int i = 0; lambda && i < r; i++) {
        int at = part->column[i];
        lambda[i] = c[at];
        for (int k = 0; k < f; k++)
            lambda[i] += part->moved[at + k * n] * udd[k];
    }
    if (lambda) {
        solve_loops(s, lambda, 1);
        for (int i = 0; i < r; i++)
            lambda[i] *= part->inverse_row[part->row[i]];
    }
}

/* c = C + M a for the accelerations a of v at udd = 0, -Jv^-1 of `rows`. */
static void add_constant(kempe_simulator *s, const double *bias, const double *rows, double *c)
{
    solve_rows(s, rows, s->part.constant);
    copy(s->equations->coordinates, bias, c);
    add_moved(s, 0, rank_of(s), s->part.constant, c);
}

/* Only by M and C. */
static outcome accelerate_once(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, t);
    s->equations->motion(&at, part->mass, part->bias, part->jdqd);
    s->work.evaluations++;
    reduce_mass(s);
    outcome said = factor_mass(s);
    if (said != GOOD)
        return said;
    add_constant(s, part->bias, part->jdqd, part->load);
    solve_motion(s, part->load, part->udd, NULL);
    return GOOD;
}

/* C depends on the multipliers: Newton's method from zero, of which one step is exact where C is linear in them. */
static outcome accelerate_loaded(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, t);
    double before = INFINITY;
    for (int k = 0; k < MOST_LOADS; k++) {
        s->equations->motion(&at, part->mass, part->bias, part->jdqd);
        s->work.evaluations++;
        evaluate_loads(s, t);
        if (k == 0)
            reduce_mass(s);
        outcome said = factor_joint(s);
        if (said != GOOD)
            return said;
        add_constant(s, part->bias, part->jdqd, part->load);
        solve_motion(s, part->load, part->udd, part->correction);
        double change = take_multipliers(s, part->correction);
        if (!(change <= DBL_MAX))
            return UNSETTLED;
        if (change <= KMP_LOADS_SETTLED || (change <= KMP_LOADS_ROUNDED && change >= before / 2))
            return GOOD;
        before = change;
    }
    return UNSETTLED;
}

/* udd at the placed q and qd. */
static outcome accelerate(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    clear(e->rows, part->lambda);
    outcome said = e->loads && rank_of(s) > 0 ? accelerate_loaded(s, t) : accelerate_once(s, t);
    if (said != GOOD)
        return said;
    for (int k = 0; k < freedom_of(s); k++)
        if (!(fabs(part->udd[k]) <= DBL_MAX))
            return NOT_FINITE;
    return said;
}

/* Accelerations and multipliers of the load, by coordinates and rows. */
static void solve_for(kempe_simulator *s, double *qdd, double *lambda)
{
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    solve_motion(s, part->load, part->udd, part->correction);
    for (int k = 0; k < f; k++)
        qdd[part->column[r + k]] = part->udd[k];
    for (int i = 0; i < r; i++) {
        double a = part->constant[i];
        for (int k = 0; k < f; k++)
            a += part->tangent[i + k * r] * part->udd[k];
        qdd[part->column[i]] = a;
        lambda[part->row[i]] = part->correction[i];
    }
}

/* qdd and lambda at the place of the last evaluation. */
static void complete(kempe_simulator *s)
{
    solve_for(s, s->part.qdd, s->part.lambda);
}

/* -- the right-hand side -------------------------------------------------------------------------------- */

static void place_y(kempe_simulator *s, const double *y)
{
    const struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    for (int k = 0; k < f; k++) {
        part->q[part->column[r + k]] = y[k];
        part->qd[part->column[r + k]] = y[f + k];
    }
    for (int i = 0; i < r; i++)
        part->q[part->column[i]] = y[2 * f + i];
}

static void pack_y(const kempe_simulator *s, const double *q, const double *qd, double *y)
{
    const struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    for (int k = 0; k < f; k++) {
        y[k] = q[part->column[r + k]];
        y[f + k] = qd[part->column[r + k]];
    }
    for (int i = 0; i < r; i++)
        y[2 * f + i] = q[part->column[i]];
}

/* dy at the placed q and ud, with factored loops. */
static outcome slopes_here(kempe_simulator *s, double t, double *dy)
{
    const struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    evaluate_rates(s);
    outcome said = accelerate(s, t);
    for (int k = 0; dy && k < f; k++) {
        dy[k] = part->qd[part->column[r + k]];
        dy[f + k] = part->udd[k];
    }
    for (int i = 0; dy && i < r; i++)
        dy[2 * f + i] = part->qd[part->column[i]];
    return said;
}

static outcome slopes(kempe_simulator *s, double t, const double *y, double *dy)
{
    place_y(s, y);
    outcome said = evaluate_loops(s, t);
    return said == GOOD ? slopes_here(s, t, dy) : said;
}

/* dy at the placed q and ud by `slopes` of the equations. False: these are not good there. */
static bool written_slopes(kempe_simulator *s, double t, double *dy)
{
    const struct kempe_simulator_parts *part = &s->part;
    const int f = freedom_of(s), r = rank_of(s);
    const kempe_arguments at = arguments_at(s, t);
    double *udd = part->dynamics, *vd = udd + f, *by_coordinate = part->dqdd, checks[2];
    *factors_are_present(s) = 0;
    part->slopes->evaluate(&at, udd, vd, checks);
    s->work.evaluations++;
    if (!(checks[0] > 0 && checks[1] <= 1))
        return false;
    for (int k = 0; k < f; k++)
        by_coordinate[part->slopes->independent[k]] = udd[k];
    for (int i = 0; i < r; i++)
        by_coordinate[part->slopes->dependent[i]] = vd[i];
    for (int k = 0; k < f; k++) {
        dy[k] = part->qd[part->column[r + k]];
        dy[f + k] = by_coordinate[part->column[r + k]];
        if (!(fabs(dy[f + k]) <= DBL_MAX))
            return false;
    }
    for (int i = 0; i < r; i++)
        dy[2 * f + i] = by_coordinate[part->column[i]];
    return true;
}

/* The same as `slopes`, without anything else of the place: by `slopes` of the equations where these are good. */
static outcome slopes_alone(kempe_simulator *s, double t, const double *y, double *dy)
{
    if (!s->part.slopes)
        return slopes(s, t, y, dy);
    place_y(s, y);
    return written_slopes(s, t, dy) ? GOOD : slopes(s, t, y, dy);
}

/* The same with loops closed; dy may be NULL. */
static outcome slopes_closed(kempe_simulator *s, double t, const double *y, double *dy)
{
    place_y(s, y);
    outcome said = close_loops(s, t, NULL);
    return said == GOOD ? slopes_here(s, t, dy) : said;
}

/* -- failures -------------------------------------------------------------------------------------------- */

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
    case REPORTED:
        return KEMPE_SIMULATOR_FAILED;
    case OPEN:
        row = widest_row(s);
        return fail_with(s,
                         "the loops cannot be closed at t = %.9g: constraint equation '%s' stays open by %.2g "
                         "(relative); start nearer to a closed configuration, or change the parameters",
                         t, e->row_names[row], opening(s, row));
    case SINGULAR_LOOPS:
        row = lost_column(s);
        return fail_with(s,
                         "the loops do not determine coordinate '%s' at t = %.9g: the mechanism is in a singular "
                         "configuration, where its constraints are dependent",
                         e->coordinate_names[row], t);
    case SINGULAR_MASS:
        bad = e->loads ? 0 : (int)s->part.diagonal[0] - 1;
        return fail_with(
            s, "the motion of coordinate '%s' moves no mass at t = %.9g: give a body that it moves mass or inertia",
            e->coordinate_names[s->part.column[rank_of(s) + bad]], t);
    case UNSETTLED:
        return fail_with(s,
                         "forces that depend on reactions have no solution that is found from zero reactions at t = "
                         "%.9g: such friction locks or has several solutions; reduce the force",
                         t);
    case UNBALANCED:
        return fail_with(s,
                         "the flexible bodies find no stable balance with the loads at t = %.9g: one of them may "
                         "buckle; change parameters or inputs less",
                         t);
    case MOVED_ANGLES:
        return fail_with(
            s, "the angles of a spherical joint are near to singular at the start: derivatives with respect to "
               "start values are not defined there; start from other angles");
    default:
        return fail_with(s, "accelerations are not finite at t = %.9g: a force or an input there is not a number", t);
    }
}
