/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations, multipliers, and the right-hand side. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_loops.h"

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

/* Column j: the change of C by multiplier j at the placed multipliers. Subtracts these changes from C: `bias` is that
 * of the tangent at zero multipliers. A slope that is not finite, as that of a root of squares at zero, counts as none:
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

/* The largest change of the placed multipliers by those of the last solution, which take their place, relative to the
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
        solve_loops_transposed(s, lambda);
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

/* By M and C alone. */
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

/* qdd and lambda at the place of the last evaluation. */
static void complete(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s);
    solve_motion(s, part->load, part->udd, part->correction);
    for (int k = 0; k < f; k++)
        part->qdd[part->column[r + k]] = part->udd[k];
    for (int i = 0; i < r; i++) {
        double a = part->constant[i];
        for (int k = 0; k < f; k++)
            a += part->tangent[i + k * r] * part->udd[k];
        part->qdd[part->column[i]] = a;
        part->lambda[part->row[i]] = part->correction[i];
    }
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
