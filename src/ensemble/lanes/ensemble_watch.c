/* SPDX-License-Identifier: BSD-3-Clause */
/* Tests of the lanes at the end of their steps, as those of reduced.c, rank_margin.c and runner_change.c for one run.
 */
#include "ensemble/lanes/ensemble_watch.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/dropped_rows.h"
#include "linalg/dense/dense.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_COLUMNS = KMP_LANE_ROWS + KMP_LANE_FREEDOMS };

const double *kmp_lanes_pivots(const kmp_engine *e, const kmp_lane_group *pool, const double *end)
{
    return end + (size_t)pool->layout.multipliers * e->room.w;
}

void kmp_lanes_watch(kmp_engine *e, kmp_lane_group *pool, kmp_lane_watched *x)
{
    kmp_lane_state *room = &e->room;
    size_t w = room->w;
    x->multiplier = kmp_lanes_values(pool->lanes, KMP_REDUCED_PROGRAM_END);
    x->pivot = kmp_lanes_pivots(e, pool, x->multiplier);
    x->h = x->pivot + (size_t)pool->layout.pivots * w;
    x->jacobian = x->h + (size_t)e->m * w;
    x->b = x->jacobian + (size_t)(e->s->jacobian.count + (e->s->rheonomic ? e->m : 0)) * w;
    x->dv = x->b + (size_t)(e->r * e->p) * w;
    x->has_jacobian = false;
    kmp_lanes_run_in_place(pool->lanes, KMP_REDUCED_PROGRAM_END);
    kmp_lanes_gather(pool->lanes, KMP_REDUCED_PROGRAM_END, 0, (int)((x->jacobian - x->multiplier) / (ptrdiff_t)w));
    kmp_lanes_gather(pool->lanes, KMP_REDUCED_PROGRAM_END, (int)((x->b - x->multiplier) / (ptrdiff_t)w),
                     pool->program->outputs[KMP_REDUCED_PROGRAM_END + 1] -
                         pool->program->outputs[KMP_REDUCED_PROGRAM_END]);
    kmp_lanes_measure(w, e, pool, x);
    kmp_lanes_signs(w, pool->layout.pivots, pool->pivot_block, x->pivot, x->negative);
    memset(x->quiet, 0, sizeof x->quiet);
    if (e->r > 0 && e->m == e->r && kmp_charts_count(e->s) == 0)
        kmp_lanes_find_quiet(w, e, pool, x);
}

/* The last pivot of the scaled J under complete pivoting, over the largest so far. */
static double margin_of(kmp_engine *e, const kmp_lane_watched *x, size_t l)
{
    const kmp_lane_state *room = &e->room;
    const kmp_pattern *pattern = &e->s->jacobian;
    kmp_instance *y = &e->instances[room->who[l]];
    double *a = room->square, largest[MOST_COLUMNS], pivots[KMP_LANE_ROWS];
    int rows[KMP_LANE_ROWS], columns[MOST_COLUMNS];
    memset(a, 0, (size_t)(e->m * e->n) * sizeof *a);
    for (int k = 0; k < pattern->count; k++) {
        size_t row = (size_t)pattern->row[k], col = (size_t)pattern->col[k];
        a[row + col * (size_t)e->m] =
            x->jacobian[(size_t)k * room->w + l] * room->scale[col * room->w + l] / room->row_scale[row * room->w + l];
    }
    kmp_pivots_complete(e->m, e->n, a, largest, rows, columns, pivots);
    y->usual = fmax(y->usual, pivots[e->r - 1]);
    return pivots[e->r - 1] / y->usual;
}

/* An entry of the scaled J, 0 outside its pattern. */
static double entry_of(const kmp_engine *e, const kmp_lane_watched *x, size_t l, int row, int col)
{
    const kmp_pattern *pattern = &e->s->jacobian;
    const kmp_lane_state *room = &e->room;
    for (int k = 0; k < pattern->count; k++)
        if (pattern->row[k] == row && pattern->col[k] == col)
            return x->jacobian[(size_t)k * room->w + l] * room->scale[(size_t)col * room->w + l] /
                   room->row_scale[(size_t)row * room->w + l];
    return 0;
}

/* The largest coefficient of a dropped row in the kept ones, J_dropped = T J_kept
 * (constraints/partition/rank_margin.h); infinite: these are dependent. */
static double dependence_of(const kmp_engine *e, const kmp_lane_group *pool, const kmp_lane_watched *x, size_t l)
{
    const kmp_partition *part = &pool->part;
    double *a = e->room.square, t[KMP_LANE_ROWS], most = 0;
    int pivot[KMP_LANE_ROWS], r = part->r;
    for (int i = 0; i < r; i++)
        for (int j = 0; j < r; j++) /* transposed */
            a[j + i * r] = entry_of(e, x, l, part->rows[i], part->v[j]);
    if (kmp_lu_factor(r, a, pivot))
        return INFINITY;
    for (int d = 0; d < part->m - r; d++) {
        for (int j = 0; j < r; j++)
            t[j] = entry_of(e, x, l, part->redundant[d], part->v[j]);
        kmp_lu_solve(r, a, pivot, 1, t);
        for (int j = 0; j < r; j++)
            most = fabs(t[j]) <= DBL_MAX ? fmax(most, fabs(t[j])) : INFINITY;
    }
    return most;
}

bool kmp_lane_consents(kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x, size_t l)
{
    kmp_lane_state *room = &e->room;
    size_t w = room->w;
    x->margin[l] = INFINITY;
    x->rows[l] = 0;
    if (e->r == 0 || x->quiet[l])
        return true;
    if (!(x->residual[l] < KMP_CLOSED)) {
        kmp_last_correction *last = &e->instances[room->who[l]].corrected;
        if (!kmp_correction_is_small(x->correction[l], pool->part.m > pool->part.r, room->t[l], last))
            return false;
        for (int i = 0; i < e->r; i++)
            room->y_new[(size_t)(2 * e->p + i) * w + l] += x->dv[(size_t)i * w + l];
    }
    for (size_t k = l; k < KMP_SIGN_WORDS * w; k += w)
        if (x->negative[k] != room->negative[k])
            return false;
    /* As in looks_well of constraints/partition/rank_margin.c: the least pivot of Jv has not fallen far. */
    const double least = x->least[l], before = room->pivot[l];
    room->pivot[l] = least > before ? least : before;
    const bool well = before > 0 && least > KMP_MARGIN_CALLS * room->pivot[l];
    if (!well && !x->has_jacobian) {
        kmp_lanes_gather(pool->lanes, KMP_REDUCED_PROGRAM_END, (int)((x->jacobian - x->multiplier) / (ptrdiff_t)w),
                         (int)((x->b - x->multiplier) / (ptrdiff_t)w));
        x->has_jacobian = true;
    }
    x->margin[l] = well ? INFINITY : margin_of(e, x, l);
    x->rows[l] = well || e->m == e->r ? 0 : dependence_of(e, pool, x, l);
    return x->margin[l] >= KMP_MARGIN_DEEP && kmp_dropped_judge(x->rows[l]) != KMP_KEPT_LOST;
}

bool kmp_lane_order_is_bad(const kmp_engine *e, const kmp_lane_group *pool, const kmp_lane_watched *x, size_t l)
{
    return !kmp_writer_order_is_good(pool->layout.multipliers, pool->row, x->multiplier + l, e->room.row_scale + l,
                                     e->room.w);
}

bool kmp_instance_nears_change(kmp_instance *x, double t, double h, double margin)
{
    if (isinf(margin)) { /* far from any change point */
        x->seen_margin = margin;
        x->seen_t = -1;
        return false;
    }
    double since = t - x->seen_t;
    double fall = since > 0 && x->seen_t >= 0 ? (x->seen_margin - margin) / since : 0;
    x->seen_margin = margin;
    x->seen_t = isnan(margin) ? -1 : t;
    return margin < fall * KMP_GROWING * h || margin < KMP_NEAR_SINGULAR_IN;
}
