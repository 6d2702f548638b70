/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/margin.h"
#include "base/memory.h"
#include "constraints/pick.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

/* What is usual near a change point. */
#define USUAL 0.1
/* It is near one only when elsewhere, at some configurations with all angles turned by up to TURN, that pivot is larger
 * by more than SMALL_HERE: lengths that differ by a thousand make small pivots everywhere. */
#define TURN       0.5
#define ELSEWHERE  5
#define SMALL_HERE 0.1
/* A margin below LOCKED, which leaving out one row lifts above FREED, is that row's doing. */
#define LOCKED 0.1
#define FREED  0.2
/* With more rows than this a quick look goes before the dense decomposition, which is called for when pivots have
 * fallen below this part of their usual size. */
#define MANY_ROWS 24
#define CALLS_FOR 0.4
bool kmp_margin_init(kmp_margin *margin, const kempe_system *system, const kmp_partition *part)
{
    int m = system->m, n = system->n,
        large = kmp_pick_is_large(m, n, system->jacobian.count) ? system->jacobian.count : 0;
    *margin = (kmp_margin){
        .system = system, .r = part->r, .step_t = NAN, .usual = part->r > 0 ? part->pivots[part->r - 1] : 1};
    margin->near = part->r > 0 && margin->usual < KMP_MARGIN_NEAR * part->pivots[0];
    if (margin->near)
        margin->usual = USUAL * part->pivots[0]; /* started near a change point: its own size says nothing */
    margin->a = large ? NULL : KMP_NEW(double, m *n);
    margin->order = large ? kmp_order_new(m, n) : NULL;
    margin->row_order = large ? kmp_order_new(m, n) : NULL;
    margin->entry_row = KMP_NEW(int, large);
    margin->entry_col = KMP_NEW(int, large);
    margin->pivots = KMP_NEW(double, m + n);
    margin->largest = KMP_NEW(double, n);
    margin->row = KMP_NEW(int, m);
    margin->col = KMP_NEW(int, n);
    margin->entry = KMP_NEW(int, system->jacobian.count);
    margin->value = KMP_NEW(double, system->jacobian.count);
    if ((large ? !margin->order || !margin->row_order : !margin->a) || !margin->entry_row || !margin->entry_col ||
        !margin->pivots || !margin->largest || !margin->row || !margin->col || !margin->entry || !margin->value)
        return false;
    margin->last = part->r > 0 ? part->pivots[part->r - 1] : 1;
    for (int k = 0; k < m; k++)
        margin->row[k] = k < part->r ? part->rows[k] : part->redundant[k - part->r];
    for (int k = 0; k < n; k++)
        margin->col[k] = k < part->r ? part->v[k] : part->u[k - part->r];
    return true;
}

void kmp_margin_free(kmp_margin *margin)
{
    kmp_free(margin->a);
    kmp_order_free(margin->order);
    kmp_order_free(margin->row_order);
    kmp_free(margin->entry_row);
    kmp_free(margin->entry_col);
    kmp_free(margin->pivots);
    kmp_free(margin->largest);
    kmp_free(margin->row);
    kmp_free(margin->col);
    kmp_block_free(margin->block);
    kmp_free(margin->entry);
    kmp_free(margin->value);
    *margin = (kmp_margin){0};
}

/* The least of that many pivots and one more; NaN when there is no memory. */
static double pivot_of_entries(kmp_order *order, const kmp_entries *a, int which)
{
    const int *r, *c;
    const double *pivots;
    double largest, least;
    if (!kmp_order_run(order, a, which + 1, &r, &c, &pivots))
        return NAN;
    kmp_order_extremes(pivots, which + 1, &largest, &least);
    return least;
}

/* The given pivot of some rows (all when `rows` is NULL) of the scaled J; NaN when there is no memory. */
static double pivot_of(kmp_margin *margin, const kmp_plant *plant, const int *rows, int count, int which)
{
    const kempe_system *s = margin->system;
    int entries = 0;
    if (margin->a)
        memset(margin->a, 0, (size_t)(count * s->n) * sizeof *margin->a);
    for (int e = 0, at = 0; e < s->jacobian.count; e++) { /* entries are row by row */
        int row = s->jacobian.row[e], col = s->jacobian.col[e];
        while (rows && at < count && rows[at] < row)
            at++;
        if (rows && (at == count || rows[at] != row))
            continue;
        double value = plant->jacobian[e] * s->scale[col] / s->row_scale[row];
        if (margin->a) {
            margin->a[(rows ? at : row) + col * count] = value;
        } else {
            margin->entry_row[entries] = rows ? at : row;
            margin->entry_col[entries] = col;
            margin->value[entries++] = value;
        }
    }
    kmp_entries a = {count, s->n, entries, margin->entry_row, margin->entry_col, margin->value};
    if (margin->a)
        kmp_pivots_complete(count, s->n, margin->a, margin->largest, margin->row, margin->col, margin->pivots);
    return margin->a ? margin->pivots[which] : pivot_of_entries(rows ? margin->row_order : margin->order, &a, which);
}

/* -1 .. 1, always the same ones. */
static double chance(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)*state / 2147483648.0 - 1;
}

static void swap_down(double *x, int k)
{
    for (; k > 0 && x[k] < x[k - 1]; k--) {
        double t = x[k];
        x[k] = x[k - 1];
        x[k - 1] = t;
    }
}

bool kmp_margin_confirm(kmp_margin *margin, kmp_plant *plant, double t, const double *q)
{
    const kempe_system *s = margin->system;
    double pivot[ELSEWHERE], *other = margin->near ? KMP_NEW(double, s->n) : NULL;
    unsigned state = 1;
    bool lost = false;
    if (!other)
        return !margin->near;
    for (int k = 0; k < ELSEWHERE; k++) {
        for (int i = 0; i < s->n; i++) {
            double turn = TURN * chance(&state);
            other[i] = s->model->motions[i].rotation ? q[i] + turn : q[i] * (1 + turn);
        }
        kmp_plant_closure(plant, t, other);
        pivot[k] = pivot_of(margin, plant, NULL, s->m, margin->r - 1);
        lost = lost || isnan(pivot[k]);
        swap_down(pivot, k);
    }
    kmp_plant_closure(plant, t, q);
    kmp_free(other);
    if (lost)
        return false;
    margin->usual = fmin(margin->usual, pivot[ELSEWHERE / 2]);
    margin->near = margin->last < SMALL_HERE * pivot[ELSEWHERE / 2];
    if (!margin->near)
        margin->usual = fmax(margin->usual, margin->last);
    return true;
}

static double dense_margin(kmp_margin *margin, const kmp_plant *plant)
{
    margin->last = pivot_of(margin, plant, NULL, margin->system->m, margin->r - 1);
    margin->usual = fmax(margin->usual, margin->last);
    return margin->last / margin->usual;
}

/* -- the quick look ---------------------------------------------------------------------------------- */

/* Smallest pivot of the block, 0 when singular. */
static double quick_pivot(kmp_margin *margin, const kmp_plant *plant)
{
    const kempe_system *s = margin->system;
    for (int k = 0; k < margin->count; k++) {
        int e = margin->entry[k];
        margin->value[k] = plant->jacobian[e] * s->scale[s->jacobian.col[e]] / s->row_scale[s->jacobian.row[e]];
    }
    return kmp_block_factor(margin->block, margin->value) ? 0 : kmp_block_smallest(margin->block);
}

/* Positions of 0 .. count - 1 among the first r of a permutation, -1 where behind them. */
static void invert(int count, int r, const int *permutation, int *place)
{
    for (int k = 0; k < count; k++)
        place[permutation[k]] = k < r ? k : -1;
}

/* The block of the last dense decomposition's pivots; none when there is no memory. */
static void renew_block(kmp_margin *margin, const kmp_plant *plant)
{
    const kmp_pattern *jac = &margin->system->jacobian;
    int m = margin->system->m, n = margin->system->n, *at = KMP_NEW(int, m + n + 2 * jac->count);
    kmp_block_free(margin->block);
    margin->block = NULL;
    margin->count = 0;
    if (!at)
        return;
    int *row = at + m + n, *col = row + jac->count;
    invert(m, margin->r, margin->row, at);
    invert(n, margin->r, margin->col, at + m);
    for (int e = 0; e < jac->count; e++)
        if (at[jac->row[e]] >= 0 && at[m + jac->col[e]] >= 0) {
            row[margin->count] = at[jac->row[e]];
            col[margin->count] = at[m + jac->col[e]];
            margin->entry[margin->count++] = e;
        }
    margin->block = kmp_block_new(margin->r, margin->count, row, col);
    margin->quick_usual = margin->block ? quick_pivot(margin, plant) : 0;
    kmp_free(at);
}

static bool looks_well(kmp_margin *margin, const kmp_plant *plant)
{
    if (!margin->block)
        renew_block(margin, plant); /* of the start's partition, at the first step */
    if (!margin->block)
        return false;
    double pivot = quick_pivot(margin, plant);
    margin->quick_usual = fmax(margin->quick_usual, pivot);
    return pivot > CALLS_FOR * margin->quick_usual;
}

double kmp_margin_at(kmp_margin *margin, const kmp_plant *plant)
{
    bool many = margin->a && margin->system->m > MANY_ROWS; /* a large J keeps its order of pivots */
    if (margin->r == 0)
        return 1;
    margin->quick = many && margin->last > CALLS_FOR * margin->usual && looks_well(margin, plant);
    if (margin->quick)
        return margin->last / margin->usual;
    double size = dense_margin(margin, plant);
    if (many && size > CALLS_FOR)
        renew_block(margin, plant);
    return size;
}

void kmp_margin_ignore(kmp_margin *margin)
{
    margin->ignored = true;
    margin->near = false;
}

bool kmp_margin_too_deep(kmp_margin *margin, const kmp_plant *plant, double t)
{
    if (margin->ignored)
        return false;
    margin->step_margin = kmp_margin_at(margin, plant);
    margin->step_t = t;
    return margin->step_margin < KMP_MARGIN_DEEP;
}

bool kmp_margin_knows(const kmp_margin *margin, double t)
{
    return margin->step_t == t;
}

double kmp_margin_after_step(kmp_margin *margin, const kmp_plant *plant, double t)
{
    return kmp_margin_knows(margin, t) ? margin->step_margin : kmp_margin_at(margin, plant);
}

double kmp_margin_of_rows(kmp_margin *margin, const kmp_plant *plant, const kmp_partition *part)
{
    if (margin->r == part->m || margin->r == 0 || margin->quick)
        return 1;
    return pivot_of(margin, plant, part->rows, margin->r, margin->r - 1) / margin->last;
}

int kmp_margin_lock(kmp_margin *margin, const kmp_plant *plant)
{
    int m = margin->system->m, *rows, found = -1;
    if (margin->r == 0 || !plant->h_t || dense_margin(margin, plant) > LOCKED || !(rows = KMP_NEW(int, m)))
        return -1;
    for (int row = 0; row < m && found < 0; row++) {
        if (fabs(plant->h_t[row]) == 0)
            continue;
        for (int k = 0; k < m - 1; k++)
            rows[k] = k + (k >= row);
        if (margin->r == 1 || pivot_of(margin, plant, rows, m - 1, margin->r - 2) > FREED * margin->usual)
            found = row;
    }
    kmp_free(rows);
    return found;
}
