/* SPDX-License-Identifier: BSD-3-Clause */
/* The margin of rank along a run: inverse iteration for the least combination of rows, always from the same vector, so
 * that w is smooth in q. A line through the last two values predicts where it passes zero. Cheap tests of pivots and
 * signs exclude that in most steps. */
#include "constraints/partition/rank_margin.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "integrators/decide/dropped_rows.h"
#include "linalg/dense/dot.h"
#include "model/data/body.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Passes of inverse iteration from the same vector everywhere, so that u varies smoothly with the configuration. */
enum { PASSES = 2 };
/* Number of other configurations for comparison. */
enum { ELSEWHERE = 5 };

bool kmp_rank_margin_init(kmp_rank_margin *margin, const kempe_system *system, const kmp_partition *part)
{
    int m = system->m, n = system->n, r = part->r, entries = system->jacobian.count;
    unsigned chance = 1;
    *margin = (kmp_rank_margin){.system = system, .r = r, .step_t = NAN, .clear_t = -INFINITY};
    KMP_ARENA_MAKE(&margin->arena, KMP_ROOM(int, m, &margin->place), KMP_ROOM(int, n, &margin->column),
                   KMP_ROOM(int, m + 1, &margin->row_start),
                   KMP_ROOM(int, entries, &margin->entry, &margin->entry_row, &margin->entry_column),
                   KMP_ROOM(int, r, &margin->taken, &margin->signs_stood, &margin->drop_column),
                   KMP_ROOM(int, m - r + 1, &margin->now.start, &margin->stood.start),
                   KMP_ROOM(int, (m - r) * r, &margin->now.kept, &margin->stood.kept),
                   KMP_ROOM(double, (m - r) * r, &margin->now.t, &margin->stood.t),
                   KMP_ROOM(double, m, &margin->now.z, &margin->stood.z, &margin->begin),
                   KMP_ROOM(double, n, &margin->now.w, &margin->stood.w, &margin->other),
                   KMP_ROOM(double, r, &margin->u, &margin->drop_value, &margin->along),
                   KMP_ROOM(double, 4 * r, &margin->room));
    if (!KMP_ARENA_EACH(&margin->arena, double, entries, &margin->weight, &margin->value, &margin->now.jacobian,
                        &margin->stood.jacobian))
        return false;
    for (int e = 0; e < entries; e++)
        margin->weight[e] = system->scale[system->jacobian.col[e]] / system->row_scale[system->jacobian.row[e]];
    for (int row = 0, e = 0; row < m; row++) {
        while (e < entries && system->jacobian.row[e] == row)
            e++;
        margin->row_start[row + 1] = e;
    }
    for (int k = 0; k < m; k++) { /* 0.5 .. 1 with either sign, always the same ones */
        chance = chance * 1664525u + 1013904223u;
        margin->begin[k] = ((double)chance / 4294967296.0 * 0.5 + 0.5) * (chance >> 7 & 1 ? 1 : -1);
    }
    return kmp_rank_margin_choose(margin, part);
}

KMP_CLEARS(kmp_rank_margin, margin, kmp_arena_free(&margin->arena), kmp_block_free(margin->block),
           kmp_partition_free(&margin->part))

/* Makes the block of the rows and columns in margin->part. */
static bool renew_block(kmp_rank_margin *margin)
{
    const kmp_pattern *jac = &margin->system->jacobian;
    const kmp_partition *part = &margin->part;
    memset(margin->place, -1, (size_t)part->m * sizeof *margin->place);
    memset(margin->column, -1, (size_t)part->n * sizeof *margin->column);
    for (int k = 0; k < part->r; k++) {
        margin->place[part->rows[k]] = k;
        margin->column[part->v[k]] = k;
    }
    margin->count = 0;
    for (int e = 0; e < jac->count; e++)
        if (margin->place[jac->row[e]] >= 0 && margin->column[jac->col[e]] >= 0) {
            margin->entry_row[margin->count] = margin->place[jac->row[e]];
            margin->entry_column[margin->count] = margin->column[jac->col[e]];
            margin->entry[margin->count++] = e;
        }
    margin->pivot = 0;
    margin->seen = false; /* the signs of the last step's end belong to another block */
    kmp_block_free(margin->block);
    margin->block = kmp_block_new(part->r, margin->count, margin->entry_row, margin->entry_column);
    return margin->block;
}

bool kmp_rank_margin_choose(kmp_rank_margin *margin, const kmp_partition *part)
{
    kmp_partition_free(&margin->part);
    margin->step_t = NAN;
    return kmp_partition_copy(&margin->part, part) && (part->r == 0 || renew_block(margin));
}

/* -- u, w and T --------------------------------------------------------------------------------------- */

/* x = G^-1 b by conjugate gradients. Few iterations suffice: G differs from 1 only where T is large. */
static void without_dropped(const kmp_rank_margin *margin, const double *b, double *x)
{
    int r = margin->r;
    double *g = margin->room, *p = g + r, *gap = p + r, size = kmp_dot(r, b, b), first = size;
    memset(x, 0, (size_t)r * sizeof *x);
    memcpy(gap, b, (size_t)r * sizeof *gap);
    memcpy(p, b, (size_t)r * sizeof *p);
    for (int pass = 0; pass < r && size > KMP_MARGIN_GAP * KMP_MARGIN_GAP * first; pass++) {
        /* out = G x, G = 1 + T'T: the product of a combination of the kept rows with all rows. */
        const kmp_rank_margin_view *need = &margin->now;
        memcpy(g, p, (size_t)margin->r * sizeof *g);
        for (int d = 0; d < margin->part.m - margin->r; d++) {
            double part = 0;
            for (int e = need->start[d]; e < need->start[d + 1]; e++)
                part += need->t[e] * p[need->kept[e]];
            for (int e = need->start[d]; e < need->start[d + 1]; e++)
                g[need->kept[e]] += part * need->t[e];
        }
        double step = size / kmp_dot(r, p, g), before = size;
        for (int k = 0; k < r; k++) {
            x[k] += step * p[k];
            gap[k] -= step * g[k];
        }
        size = kmp_dot(r, gap, gap);
        for (int k = 0; k < r; k++)
            p[k] = gap[k] + size / before * p[k];
    }
}

/* Finds the combination z of all rows, |z| = 1, with the least |J'z|, by the equivalent combination u of the kept rows:
 * J'z = J_kept' u, z'z = u' G^-1 u. It starts from the same z everywhere, so that it varies smoothly, whichever rows
 * are kept. */
static void find_u(kmp_rank_margin *margin)
{
    int r = margin->r, dropped = margin->part.m - r;
    double *u = margin->u, *a = margin->room + 3 * r;
    const kmp_rank_margin_view *need = &margin->now;
    for (int k = 0; k < r; k++)
        u[k] = margin->begin[margin->part.rows[k]];
    for (int d = 0; d < dropped; d++)
        for (int e = need->start[d]; e < need->start[d + 1]; e++)
            u[need->kept[e]] += need->t[e] * margin->begin[margin->part.redundant[d]];
    for (int pass = 0; pass <= PASSES; pass++) {
        if (dropped > 0)
            without_dropped(margin, u, a);
        else
            memcpy(a, u, (size_t)r * sizeof *a);
        double size = sqrt(kmp_dot(r, u, a));
        for (int k = 0; k < r; k++)
            u[k] = (pass < PASSES ? a[k] : u[k]) / size;
        if (pass < PASSES) {
            kmp_block_solve(margin->block, 1, u);
            kmp_block_solve_transposed(margin->block, u);
        }
        for (int k = 0; pass == PASSES && k < r; k++)
            a[k] /= size;
    }
    for (int k = 0; k < r; k++)
        margin->now.z[margin->part.rows[k]] = a[k];
    for (int d = 0; d < dropped; d++) {
        double sum = 0;
        for (int e = need->start[d]; e < need->start[d + 1]; e++)
            sum += need->t[e] * a[need->kept[e]];
        margin->now.z[margin->part.redundant[d]] = sum;
    }
}

/* Computes w. Returns the largest entry outside the columns of the block over the largest inside. */
static double find_w(kmp_rank_margin *margin)
{
    const kmp_pattern *jac = &margin->system->jacobian;
    double inside = 0, outside = 0;
    memset(margin->now.w, 0, (size_t)margin->system->n * sizeof *margin->now.w);
    for (int e = 0; e < jac->count; e++) {
        int row = margin->place[jac->row[e]];
        if (row >= 0)
            margin->now.w[jac->col[e]] += margin->now.jacobian[e] * margin->u[row];
    }
    for (int k = 0; k < margin->system->n; k++)
        if (margin->column[k] >= 0)
            inside = fmax(inside, fabs(margin->now.w[k]));
        else
            outside = fmax(outside, fabs(margin->now.w[k]));
    return outside / inside;
}

/* Computes T. A dropped row depends only on rows of its loops. */
static void find_t(kmp_rank_margin *margin)
{
    kmp_rank_margin_view *need = &margin->now;
    margin->rows = 0;
    for (int d = 0; d < margin->part.m - margin->r; d++) {
        int row = margin->part.redundant[d], count = 0, start = need->start[d];
        for (int e = margin->row_start[row]; e < margin->row_start[row + 1]; e++) {
            int column = margin->column[margin->system->jacobian.col[e]];
            if (column < 0)
                continue;
            margin->drop_column[count] = column;
            margin->drop_value[count++] = margin->now.jacobian[e];
        }
        int found = kmp_block_solve_transposed_few(margin->block, KMP_ROWS_NOTHING, count, margin->drop_column,
                                                   margin->drop_value, need->kept + start, need->t + start);
        need->start[d + 1] = start + found;
        for (int e = start; e < start + found; e++)
            if (!(fabs(need->t[e]) <= margin->rows)) {
                margin->rows = fabs(need->t[e]);
                margin->rows_d = d;
                margin->rows_k = need->kept[e];
            }
    }
}

static void scale_jacobian(kmp_rank_margin *margin, const kmp_evaluator *eval)
{
    for (int e = 0; e < margin->system->jacobian.count; e++)
        margin->now.jacobian[e] = margin->weight[e] * eval->jacobian[e];
}

static bool factor(kmp_rank_margin *margin)
{
    for (int k = 0; k < margin->count; k++)
        margin->value[k] = margin->now.jacobian[margin->entry[k]];
    return !kmp_block_factor(margin->block, margin->value);
}

/* Measures the margin of the J taken; zero if singular. Returns the staleness of its columns. */
static double measure_margin(kmp_rank_margin *margin)
{
    double stale = 0;
    margin->last = 0;
    margin->rows = INFINITY;
    margin->quick = false;
    if (factor(margin)) {
        find_t(margin);
        find_u(margin);
        stale = find_w(margin);
        margin->last = sqrt(kmp_dot(margin->system->n, margin->now.w, margin->now.w));
    }
    margin->last = isfinite(margin->last) ? margin->last : 0;
    return margin->last > 0 ? stale : 0;
}

/* The margin |w| at (t, q). */
static double margin_at(kmp_rank_margin *margin, kmp_evaluator *eval, double t, const double *q)
{
    kmp_eval_closure(eval, t, q);
    scale_jacobian(margin, eval);
    (void)measure_margin(margin);
    return margin->last;
}

static double over_usual(const kmp_rank_margin *margin)
{
    return margin->usual > 0 ? margin->last / margin->usual : 0;
}

double kmp_rank_margin_at(kmp_rank_margin *margin, const kmp_evaluator *eval)
{
    if (margin->r == 0)
        return 1;
    scale_jacobian(margin, eval);
    if (measure_margin(margin) > KMP_MARGIN_STALE &&
        kmp_partition_exchange(&margin->part, margin->system, eval->jacobian, KMP_PICK_GROWTH) == KEMPE_OK &&
        renew_block(margin))
        (void)measure_margin(margin);
    margin->usual = fmax(margin->usual, margin->last);
    if (!(margin->pivot > 0) && margin->last > 0) /* usual pivot of a new block */
        margin->pivot = kmp_block_smallest(margin->block) * margin->usual / margin->last;
    return over_usual(margin);
}

/* -- the start ---------------------------------------------------------------------------------------- */

/* The larger |w| when the k-th free coordinate is displaced by KMP_MARGIN_NEAR_BY in either direction and the others
 * follow along the tangent. */
static double turned(kmp_rank_margin *margin, kmp_evaluator *eval, double t, const double *q, int k)
{
    const kempe_system *s = margin->system;
    const kmp_pattern *jac = &s->jacobian;
    int n = s->n, free = margin->part.u[k];
    double *along = margin->along, *other = margin->other, most = 0;
    (void)margin_at(margin, eval, t, q);
    memset(along, 0, (size_t)margin->r * sizeof *along);
    for (int e = 0; e < jac->count; e++)
        if (jac->col[e] == free && margin->place[jac->row[e]] >= 0)
            along[margin->place[jac->row[e]]] = -margin->now.jacobian[e];
    kmp_block_solve(margin->block, 1, along);
    for (int side = -1; side <= 1; side += 2) {
        for (int i = 0; i < n; i++) {
            int v = margin->column[i];
            double turn = i == free ? KMP_MARGIN_NEAR_BY : v >= 0 ? KMP_MARGIN_NEAR_BY * along[v] : 0;
            other[i] = q[i] + side * turn * s->scale[i];
        }
        most = fmax(most, margin_at(margin, eval, t, other));
    }
    return most;
}

/* The median |w| with all coordinates displaced by up to KMP_MARGIN_ELSEWHERE, with the closures open: lengths that
 * differ by a factor of a thousand make it small everywhere. */
static double elsewhere(kmp_rank_margin *margin, kmp_evaluator *eval, double t, const double *q)
{
    double found[ELSEWHERE], *other = margin->other;
    unsigned chance = 1;
    for (int k = 0; k < ELSEWHERE; k++) {
        for (int i = 0; i < margin->system->n; i++) {
            chance = chance * 1664525u + 1013904223u;
            double turn = KMP_MARGIN_ELSEWHERE * ((double)chance / 2147483648.0 - 1);
            other[i] = kmp_model_motion(margin->system->model, i)->rotation ? q[i] + turn : q[i] * (1 + turn);
        }
        double here = margin_at(margin, eval, t, other);
        int i = k;
        for (; i > 0 && here < found[i - 1]; i--)
            found[i] = found[i - 1];
        found[i] = here;
    }
    return found[ELSEWHERE / 2];
}

void kmp_rank_margin_begin(kmp_rank_margin *margin, kmp_evaluator *eval, double t, const double *q)
{
    const kmp_partition *part = &margin->part;
    if (margin->r == 0)
        return;
    (void)kmp_rank_margin_at(margin, eval);
    double here = margin->last, most = here;
    if (!margin->ignored && part->pivots[part->r - 1] < KMP_MARGIN_LOOK * part->pivots[0]) {
        for (int k = 0; k < part->p; k++)
            most = fmax(most, turned(margin, eval, t, q, k));
        most = fmax(here, fmin(most, elsewhere(margin, eval, t, q)));
        kmp_eval_closure(eval, t, q);
        (void)kmp_rank_margin_at(margin, eval);
    }
    margin->usual = most;
    margin->near = here < KMP_MARGIN_NEAR * most;
    kmp_rank_margin_stand(margin);
}

void kmp_rank_margin_ignore(kmp_rank_margin *margin)
{
    margin->ignored = true;
    margin->near = false;
}

/* -- steps -------------------------------------------------------------------------------------------- */

bool kmp_rank_margin_unwatched(const kmp_rank_margin *margin)
{
    return margin->r == 0 || (margin->ignored && margin->r == margin->part.m);
}

/* The line of w from the last step's end to here. Its point nearest to zero in step lengths from here; the distance of
 * that point from zero; the cosine of the angle by which w has turned. */
typedef struct line {
    double before, when, closest, cosine; /* before: |w| at the last step's end */
    bool known;                           /* the null vector z belongs to the last step's end */
} line;

static line line_of(const kmp_rank_margin *margin)
{
    int n = margin->system->n;
    double same = kmp_dot(margin->part.m, margin->now.z, margin->stood.z), sign = same < 0 ? -1 : 1;
    double new = kmp_dot(n, margin->now.w, margin->now.w), both = sign *kmp_dot(n, margin->now.w, margin->stood.w),
           old = kmp_dot(n, margin->stood.w, margin->stood.w), moved = new - 2 * both + old;
    if (fabs(same) < KMP_MARGIN_SAME || !(moved > 0))
        return (line){sqrt(old), INFINITY, sqrt(new), 1, fabs(same) >= KMP_MARGIN_SAME};
    double along = (new - both) / moved;
    return (line){sqrt(old), -along, sqrt(fmax(0, new - along *along *moved)), both / sqrt(old * new), true};
}

static double needed(const kmp_rank_margin_view *need, int d, int kept)
{
    for (int e = need->start[d]; e < need->start[d + 1]; e++)
        if (need->kept[e] == kept)
            return need->t[e];
    return 0;
}

/* True if the kept rows have lost their rank since the last step's end: T has passed through infinity. */
static bool rows_lost(const kmp_rank_margin *margin)
{
    double before = needed(&margin->stood, margin->rows_d, margin->rows_k),
           after = needed(&margin->now, margin->rows_d, margin->rows_k);
    const kmp_kept_rank rank = kmp_dropped_judge(margin->rows);
    return rank == KMP_KEPT_LOST || (rank == KMP_KEPT_BADLY && before * after < 0);
}

/* True if the line meets zero within the accuracy of the prediction. */
static bool aims(const kmp_rank_margin *margin, const line *l, double size, double aim)
{
    return l->closest < aim * margin->usual && l->closest < KMP_MARGIN_STEEP * size;
}

/* True if a step passes a singular place, or enters its close surroundings from afar. A formulation that already is in
 * these surroundings may go deeper. */
static bool passes(kmp_rank_margin *margin)
{
    line l = line_of(margin);
    if (l.cosine < KMP_MARGIN_TURNED && l.closest < KMP_MARGIN_PASSED * margin->usual)
        return true;
    double deep = margin->tried > 0 ? 0.5 * KMP_MARGIN_AGAIN * margin->tried : KMP_MARGIN_DEEP * margin->usual;
    bool deeper = margin->last < deep && l.before > deep;
    if (!l.known) /* decided by a shorter step */
        return deeper || (margin->part.m == margin->r && !kmp_block_has_signs(margin->block, margin->signs_stood));
    return deeper && l.when > -1 && aims(margin, &l, l.before, 0.5 * KMP_MARGIN_AIM);
}

/* True if a cheap test excludes a singularity: no pivot of the block has fallen far, no sign has changed, and dropped
 * rows depend little on the kept ones. If change points are ignored only the rows are needed. */
static bool looks_well(kmp_rank_margin *margin, const kmp_evaluator *eval)
{
    if (!margin->stands || margin->refused || !(margin->pivot > 0))
        return false;
    scale_jacobian(margin, eval);
    double least = factor(margin) ? kmp_block_smallest(margin->block) : 0;
    margin->rows = INFINITY;
    if (least > 0)
        find_t(margin);
    margin->pivot = fmax(margin->pivot, least);
    bool well = least > KMP_MARGIN_CALLS * margin->pivot && kmp_dropped_judge(margin->rows) == KMP_KEPT_WELL &&
                kmp_block_has_signs(margin->block, margin->signs_stood);
    margin->quick = margin->ignored || well;
    return margin->quick;
}

static void exchange_views(kmp_rank_margin *margin)
{
    kmp_rank_margin_view now = margin->now;
    margin->now = margin->stood;
    margin->stood = now;
}

/* Computes the full margin of the last step's end, which had only a quick test. */
static void catch_up(kmp_rank_margin *margin)
{
    if (!margin->stands || margin->seen)
        return;
    exchange_views(margin);
    (void)measure_margin(margin);
    kmp_block_take_signs(margin->block, margin->signs_stood);
    exchange_views(margin);
    margin->seen = true;
}

bool kmp_rank_margin_refuses(kmp_rank_margin *margin, const kmp_evaluator *eval, double t)
{
    if (kmp_rank_margin_unwatched(margin))
        return false;
    margin->step_t = t;
    if (looks_well(margin, eval))
        return margin->ignored && rows_lost(margin);
    catch_up(margin);
    (void)kmp_rank_margin_at(margin, eval);
    if (!margin->stands)
        return false;
    if (!margin->seen) { /* seen with another block */
        catch_up(margin);
        (void)kmp_rank_margin_at(margin, eval);
    }
    if (margin->part.m > margin->r && rows_lost(margin))
        return true;
    if (margin->ignored || margin->part.p == 0 || t <= margin->clear_t || !passes(margin))
        return false;
    margin->refused = true;
    return true;
}

double kmp_rank_margin_after_step(kmp_rank_margin *margin, const kmp_evaluator *eval, double t)
{
    if (margin->step_t != t) {
        catch_up(margin);
        return kmp_rank_margin_at(margin, eval);
    }
    return margin->quick ? 1 : over_usual(margin);
}

bool kmp_rank_margin_leads_on(const kmp_rank_margin *margin, double *when)
{
    if (!margin->stands || margin->quick || margin->ignored || margin->r == 0)
        return false;
    line l = line_of(margin);
    double soonest = margin->tried > 0 ? KMP_MARGIN_AGAIN * margin->tried : KMP_NEAR_SINGULAR_IN * margin->usual;
    bool soon = (margin->refused && margin->tried == 0) || margin->last < soonest;
    *when = l.when;
    return l.when > 0 && soon && aims(margin, &l, margin->last, KMP_MARGIN_AIM);
}

double kmp_rank_margin_when(const kmp_rank_margin *margin)
{
    return line_of(margin).when;
}

void kmp_rank_margin_stand(kmp_rank_margin *margin)
{
    if (margin->r == 0)
        return;
    kmp_block_take_signs(margin->block, margin->signs_stood);
    exchange_views(margin);
    margin->seen = !margin->quick;
    margin->tried = margin->quick || margin->last > KMP_NEAR_SINGULAR_LEFT * margin->usual ? 0 : margin->tried;
    margin->refused = false;
    margin->stands = true;
}

void kmp_rank_margin_stand_anew(kmp_rank_margin *margin, const kmp_evaluator *eval)
{
    if (kmp_rank_margin_unwatched(margin))
        return;
    (void)kmp_rank_margin_at(margin, eval);
    kmp_rank_margin_stand(margin);
    margin->step_t = NAN;
}

/* -- rows --------------------------------------------------------------------------------------------- */

bool kmp_rank_margin_exchange_rows(kmp_rank_margin *margin, const kmp_evaluator *eval)
{
    kmp_partition *part = &margin->part;
    (void)kmp_rank_margin_at(margin, eval);
    for (int k = 0; kmp_dropped_judge(margin->rows) != KMP_KEPT_WELL && k < 4 * part->m; k++) {
        /* Exchanges each dropped row that depends on a kept one by more than KMP_ROWS_OUT with that row, as many at
         * once as have different kept rows. Each exchange multiplies |det Jv| by that entry, so the loop ends. */
        int *taken = margin->taken;
        memset(taken, 0, (size_t)part->r * sizeof *taken);
        const kmp_rank_margin_view *need = &margin->now;
        for (int d = 0; d < part->m - part->r; d++) {
            int most = -1;
            bool apart = true;
            for (int e = need->start[d]; e < need->start[d + 1]; e++) {
                apart = apart && !taken[need->kept[e]];
                most = fabs(need->t[e]) > (most < 0 ? KMP_ROWS_OUT : fabs(need->t[most])) ? e : most;
            }
            if (!apart || most < 0)
                continue;
            for (int e = need->start[d]; e < need->start[d + 1]; e++)
                taken[need->kept[e]] = 1;
            kmp_swap_int(&part->rows[need->kept[most]], &part->redundant[d]);
        }
        kmp_partition_sort(part);
        if (!renew_block(margin))
            return false;
        (void)kmp_rank_margin_at(margin, eval);
    }
    margin->step_t = NAN;
    kmp_rank_margin_stand(margin);
    return true;
}

/* -- locks -------------------------------------------------------------------------------------------- */

/* The least of the first `which` pivots of the rows other than `without`; NaN without memory. */
static double pivot_without(const kmp_rank_margin *margin, const kmp_evaluator *eval, int without, int which)
{
    const kempe_system *s = margin->system;
    const kmp_pattern *jac = &s->jacobian;
    double *pivots = KMP_NEW(double, s->m + s->n + jac->count), *rest = pivots ? pivots + s->m + s->n : NULL,
           found = NAN;
    for (int e = 0; rest && e < jac->count; e++)
        rest[e] = jac->row[e] == without ? 0 : eval->jacobian[e];
    if (rest && kmp_partition_pivots(s, rest, pivots))
        found = which > 0 ? pivots[which - 1] : INFINITY;
    kmp_free(pivots);
    return found;
}

int kmp_rank_margin_lock(kmp_rank_margin *margin, const kmp_evaluator *eval, bool been)
{
    int m = margin->system->m, found = -1;
    if (margin->r == 0 || !eval->h_t || (kmp_rank_margin_at(margin, eval) > KMP_MARGIN_LOCKED && !been))
        return -1;
    for (int row = 0; row < m && found < 0; row++)
        if (fabs(eval->h_t[row]) > 0 &&
            pivot_without(margin, eval, row, margin->r - 1) > KMP_MARGIN_FREED * margin->usual)
            found = row;
    return found;
}
