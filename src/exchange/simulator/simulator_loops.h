/* SPDX-License-Identifier: BSD-3-Clause */
/* Closing of loops by Newton's method, and rates of dependent coordinates. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_structure.h"

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

/* x <- Jv^-1 x and x <- Jv^-T x, by the factors, whose rows are scaled. */
static void solve_loops(const kempe_simulator *s, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        kmp_lu_solve(count, loop, part->pivot + from, 1, x + from);
        loop += (ptrdiff_t)count * count;
    }
}

static void solve_loops_transposed(const kempe_simulator *s, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        kmp_lu_solve_transposed(count, loop, part->pivot + from, x + from);
        loop += (ptrdiff_t)count * count;
    }
}

/* x = -Jv^-1 of rows; `rows` has all m. */
static void solve_rows(const kempe_simulator *s, const double *rows, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    for (int i = 0; i < rank_of(s); i++)
        x[i] = -rows[part->row[i]] * part->inverse_row[part->row[i]];
    solve_loops(s, x);
}

static double opening(const kempe_simulator *s, int row)
{
    return fabs(s->part.h[row]) * s->part.inverse_row[row];
}

/* The largest h of the rows that are kept, scaled; infinite where one is not finite. */
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
        solve_loops(s, vd);
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
        solve_loops_transposed(s, part->correction);
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
