/* SPDX-License-Identifier: BSD-3-Clause */
/* Follows a prescribed motion by prediction and correction: Taylor's series along the tangent, then Newton's method on
 * the dependent coordinates. Short steps and the signs of Jv's blocks keep the branch. */
#include "analyses/inverse/prescribed_motion.h"
#include "analyses/inverse/kept_rows.h"
#include "analyses/parts/closed_state.h"
#include "analyses/parts/substep.h"
#include "base/memory.h"
#include "base/quantile.h"
#include "base/spline.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/tolerances.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/state.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

/* Largest residual of h at which Newton's method may stall where redundant rows near the closed position make its
 * matrix ill-conditioned. It is two digits below the threshold of the rank decision that follows. */
#define STALLED (KMP_RANK / 100)
/* Largest correction of a prediction by Newton's method: a part of the step, or an absolute limit; and the longest step
 * (rad, or characteristic lengths). */
#define TRUSTED_PART 0.1
#define TRUSTED_MOVE 1e-3
#define LONGEST_MOVE 0.3
/* The shortest step, relative to the whole path. */
#define SHORTEST 1e-7

/* -- the table ---------------------------------------------------------------------------------------- */

/* True if the column is given; a column with missing values is noted. */
static bool is_given(int rows, int n, const double *values, int i, int order, kmp_gap_in_table *gap)
{
    int count = 0, first_gap = -1;
    for (int r = 0; r < rows; r++) {
        bool there = isfinite(values[r * n + i]);
        count += there;
        if (!there && first_gap < 0)
            first_gap = r;
    }
    if (count > 0 && count < rows && gap->coordinate < 0)
        *gap = (kmp_gap_in_table){i, first_gap, order};
    return count == rows;
}

/* Column k of an order: column i of n that are given, or the derivatives at the rows of the spline through the column
 * of the order before. room: 4 numbers per row. */
static void put_column(kmp_prescribed *m, int order, int k, int n, const double *given, int i, double *room)
{
    int rows = m->rows;
    double *column = room, *slope = column + rows, *to = m->value[order] + k;
    for (int r = 0; r < rows; r++)
        slope[r] = m->given[order][k] ? given[r * n + i] : 0;
    for (int r = 0; order > 0 && r < rows; r++)
        column[r] = m->value[order - 1][r * m->count + k];
    if (!m->given[order][k] && rows > 1)
        kmp_spline_slopes(rows, m->t, column, slope, slope + rows);
    for (int r = 0; r < rows; r++)
        to[r * m->count] = slope[r];
}

bool kmp_prescribed_init(kmp_prescribed *motion, int rows, const double *t, int n, const double *q, const double *qd,
                         const double *qdd, kmp_gap_in_table *gap)
{
    const double *from[] = {q, qd, qdd};
    kmp_prescribed *m = motion;
    *m = (kmp_prescribed){.rows = rows};
    *gap = (kmp_gap_in_table){.coordinate = -1};
    double *room = KMP_NEW(double, 4 * (size_t)rows);
    m->coordinate = KMP_ARENA_NEW(&m->arena, int, n);
    m->t = KMP_ARENA_NEW(&m->arena, double, rows);
    for (int order = 0; order < 3; order++) {
        m->value[order] = KMP_ARENA_NEW(&m->arena, double, (size_t)rows *(size_t)n);
        m->given[order] = KMP_ARENA_NEW(&m->arena, bool, n);
    }
    bool ok = !m->arena.failed && room;
    if (ok)
        memcpy(m->t, t, (size_t)rows * sizeof *t);
    for (int i = 0; ok && i < n; i++)
        if (is_given(rows, n, q, i, 0, gap)) {
            for (int order = 0; order < 3; order++)
                m->given[order][m->count] = is_given(rows, n, from[order], i, order, gap);
            m->coordinate[m->count++] = i;
        }
    ok = ok && gap->coordinate < 0;
    for (int k = 0; ok && k < m->count; k++)
        for (int order = 0; order < 3; order++)
            put_column(m, order, k, n, from[order], m->coordinate[k], room);
    kmp_free(room);
    if (!ok)
        kmp_prescribed_free(m);
    return ok;
}

KMP_CLEARS(kmp_prescribed, motion, kmp_arena_free(&motion->arena))

/* The quintic from (q, v, a) at 0 to (q, v, a) at h, with its derivatives at s h. */
static void quintic(double h, const double from[3], const double to[3], double s, double out[3])
{
    double v = h * from[1], a = h * h * from[2];
    double d = to[0] - from[0] - v - a / 2, dv = h * to[1] - v - a, da = h * h * to[2] - a;
    double c3 = 10 * d - 4 * dv + da / 2, c4 = -15 * d + 7 * dv - da, c5 = 6 * d - 3 * dv + da / 2;
    out[0] = from[0] + s * (v + s * (a / 2 + s * (c3 + s * (c4 + s * c5))));
    out[1] = (v + s * (a + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h;
    out[2] = (a + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))) / (h * h);
}

void kmp_prescribed_at(const kmp_prescribed *motion, double t, double *q, double *qd, double *qdd)
{
    const kmp_prescribed *m = motion;
    int row = kmp_ordered_last(m->t, 0, m->rows, t), n = m->count;
    const double *x = m->value[0] + row * n, *v = m->value[1] + row * n, *a = m->value[2] + row * n;
    bool on_row = t <= m->t[row] || row == m->rows - 1;
    double h = on_row ? 1 : m->t[row + 1] - m->t[row];
    for (int k = 0; k < n; k++) {
        const double from[] = {x[k], v[k], a[k]};
        double at[] = {x[k], v[k], a[k]};
        if (!on_row)
            quintic(h, from, (double[]){x[k + n], v[k + n], a[k + n]}, (t - m->t[row]) / h, at);
        q[m->coordinate[k]] = at[0];
        qd[m->coordinate[k]] = at[1];
        qdd[m->coordinate[k]] = at[2];
    }
}

/* -- construction and release ------------------------------------------------------------------------ */

kempe_status kmp_prescribed_motion_init(kmp_prescribed_motion *prescribed, const kempe_system *system,
                                        const char *backend, const kmp_prescribed *motion, bool at_rest,
                                        const int *wish, int wish_count)
{
    kmp_prescribed_motion *g = prescribed;
    *g = (kmp_prescribed_motion){.system = system,
                                 .motion = motion,
                                 .at_rest = at_rest,
                                 .wish = wish,
                                 .wish_count = wish_count,
                                 .n = system->n,
                                 .m = system->m,
                                 .off.coordinate = -1};
    unsigned long failures = kmp_memory_failures();
    g->eval = kmp_eval_new(system, backend);
    if (!g->eval)
        return kmp_memory_failures() != failures ? KEMPE_E_MEMORY : KEMPE_E_ARGUMENT;
    g->eval->inputs.before = true;
    if (!KMP_ARENA_MAKE(&g->arena, KMP_ROOM(int, g->n, &g->sign, &g->u), KMP_ROOM(bool, g->m, &g->left_out),
                        KMP_ROOM(bool, g->n, &g->given),
                        KMP_ROOM(double, g->n, &g->q, &g->qd, &g->qdd, &g->trial, &g->move, &g->ud, &g->udd, &g->rest,
                                 &g->from, &g->tq, &g->tqd, &g->tqdd),
                        KMP_ROOM(double, g->m, &g->rows), KMP_ROOM(double, system->jacobian.count, &g->masked))) {
        kmp_prescribed_motion_free(g);
        return kmp_fail_memory(system->context);
    }
    for (int k = 0; motion && k < motion->count; k++)
        g->given[motion->coordinate[k]] = true;
    for (int k = kmp_model_coordinates(system->model); k < g->n; k++)
        g->given[k] = true;
    /* Drives of coordinates in the table are ignored. */
    for (int r = 0; r < g->m; r++) {
        const kmp_closure *closure = kmp_model_closure(g->system->model, g->system->rows[r].closure);
        g->left_out[r] = kmp_closure_is_drive(closure) && g->given[closure->motion];
    }
    g->eval->unmet.left_out = g->left_out;
    return KEMPE_OK;
}

static void forget_choice(kmp_prescribed_motion *g)
{
    kmp_reduction_free(&g->red);
    kmp_partition_free(&g->part);
}

void kmp_prescribed_motion_free(kmp_prescribed_motion *prescribed)
{
    kmp_prescribed_motion *g = prescribed;
    forget_choice(g);
    kmp_arena_free(&g->arena);
    kmp_eval_free(g->eval);
    *g = (kmp_prescribed_motion){0};
}

/* -- the choice of independent coordinates ----------------------------------------------------------- */

static const char *name_of(const kmp_prescribed_motion *g, int coordinate)
{
    return kmp_model_motion(g->system->model, coordinate)->name;
}

static kempe_status fail_undetermined(const kmp_prescribed_motion *g, int count, const int *free_ones)
{
    kempe_context *context = g->system->context;
    kmp_text names = {0};
    for (int k = 0; k < count; k++)
        kmp_text_printf(&names, "%s'%s'", k ? ", " : "", name_of(g, free_ones[k]));
    kempe_status status = KEMPE_E_FAILED;
    if (names.failed)
        status = kmp_fail_memory(context);
    else if (g->motion)
        (void)kmp_fail(
            context, status,
            "the coordinates of the motion do not determine all others: %d more %s required, such as %s%s%s%s", count,
            count == 1 ? "is" : "are", names.s, g->motion->cut ? "; the columns of joint '" : "",
            g->motion->cut ? g->motion->cut : "",
            g->motion->cut ? "' do not count, because it is cut: 'cut: no' in this joint keeps it" : "");
    else
        (void)kmp_fail(context, status,
                       "the drives do not determine the motion of all coordinates: %s %s free; drive %s too, or give a "
                       "simulated motion",
                       names.s, count == 1 ? "is" : "are", count == 1 ? "it" : "them");
    kmp_text_free(&names);
    return status;
}

/* u among the coordinates of the table: all others must be determined by them. */
static kempe_status choose_among_given(kmp_prescribed_motion *g, int *count)
{
    int missing = 0, *u = g->u;
    *count = kmp_partition_prefer(g->system, g->masked, g->given, u);
    if (*count < 0)
        return kmp_fail_memory(g->system->context);
    for (int k = 0; k < *count; k++)
        if (!g->given[u[k]])
            u[missing++] = u[k];
    return missing ? fail_undetermined(g, missing, u) : KEMPE_OK;
}

/* Chooses the independent coordinates at (t, q). */
static kempe_status choose(kmp_prescribed_motion *g, double t, const double *q)
{
    const int coordinates = kmp_model_coordinates(g->system->model), states = g->n - coordinates;
    bool some = (g->motion && g->motion->count < coordinates) || (states > 0 && !g->at_rest);
    int count = g->at_rest ? g->wish_count : 0;
    forget_choice(g);
    kmp_eval_closure(g->eval, t, q);
    kmp_eval_mask(g->eval, g->left_out, g->masked);
    if (count > 0)
        memcpy(g->u, g->wish, (size_t)count * sizeof *g->u);
    KMP_TRY(some ? choose_among_given(g, &count) : KEMPE_OK);
    int kept = 0; /* motions of states are independent in any case, and not chosen */
    for (int k = 0; k < count; k++)
        if (g->u[k] < kmp_model_coordinates(g->system->model))
            g->u[kept++] = g->u[k];
    count = kept;
    KMP_TRY(kmp_partition_init(&g->part, g->system, g->masked, g->u, count));
    if (!g->motion && !g->at_rest && g->part.p > states)
        return fail_undetermined(g, g->part.p, g->part.u);
    KMP_TRY(kmp_reduction_init(&g->red, g->eval, &g->part));
    if (g->red.block && kmp_reduction_factor(&g->red) == 0)
        kmp_block_take_signs(g->red.block, g->sign);
    return KEMPE_OK;
}

/* -- one state --------------------------------------------------------------------------------------- */

/* Reads the table's values at t. */
static void read_table(kmp_prescribed_motion *g, double t)
{
    if (g->motion)
        kmp_prescribed_at(g->motion, t, g->tq, g->tqd, g->tqdd);
    for (int k = kmp_model_coordinates(g->system->model), i = 0; g->state && k < g->n; k++, i++)
        g->tqd[k] = g->state[i];
}

/* Closes `trial` on its u; rows that were dropped as redundant must close with it. */
static bool close_trial(kmp_prescribed_motion *g, double t)
{
    return kmp_reduction_close(&g->red, t, g->trial, NULL, 0) == 0 && kmp_rounding_closed(g->eval);
}

/* Rates and accelerations of q = trial at t, where it becomes the state. KEMPE_E_FAILED: Jv is singular. */
static kempe_status settle(kmp_prescribed_motion *g, double t)
{
    kmp_evaluator *eval = g->eval;
    kmp_reduction *red = &g->red;
    kmp_eval_closure(eval, kmp_eval_row_time(eval, t, g->trial, g->qd), g->trial); /* before a jump of a drive */
    if (kmp_reduction_factor(red))
        return KEMPE_E_FAILED;
    if (g->part.r < g->part.m && !kmp_keeps_rows_well(red, g->left_out, g->rest, g->rows)) {
        KMP_TRY(choose(g, t, g->trial));
        if (kmp_reduction_factor(red))
            return KEMPE_E_FAILED;
    }
    kmp_reduction_tangent(red);
    for (int k = 0; k < g->part.p; k++) {
        g->ud[k] = g->at_rest ? g->qd[g->part.u[k]] : g->tqd[g->part.u[k]];
        g->udd[k] = g->at_rest ? 0 : g->tqdd[g->part.u[k]];
    }
    kmp_reduction_rates(red, g->ud, g->qd);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, g->qd);
    kmp_reduction_residual(red, g->udd, g->rest);
    kmp_reduction_accelerations(red, g->udd, g->qdd);
    for (int k = 0; k < g->n; k++)
        if (!isfinite(g->qd[k]) || !isfinite(g->qdd[k]))
            return KEMPE_E_FAILED;
    memcpy(g->q, g->trial, (size_t)g->n * sizeof *g->q);
    g->t = t;
    return KEMPE_OK;
}

/* Closes `trial` by a choice made there, and once more by a choice made at the closed position, with u from the table.
 * Rows that are redundant where the loops are closed look independent near it. */
static kempe_status close_anew(kmp_prescribed_motion *g, double t, bool *closed)
{
    *closed = false;
    KMP_TRY(choose(g, t, g->trial));
    if (!close_trial(g, t) && !(kmp_eval_residual(g->eval) <= STALLED))
        return KEMPE_OK;
    KMP_TRY(choose(g, t, g->trial));
    for (int k = 0; k < g->part.p; k++)
        if (g->given[g->part.u[k]])
            g->trial[g->part.u[k]] = g->tq[g->part.u[k]];
    *closed = close_trial(g, t);
    return KEMPE_OK;
}

/* The distance of given coordinates that are not independent from their closed positions. */
static void note_off(kmp_prescribed_motion *g)
{
    for (int i = 0; i < g->part.r; i++) {
        int k = g->part.v[i];
        double off = g->given[k] ? fabs(g->q[k] - g->tq[k]) / g->system->scale[k] : 0;
        if (off > g->off.size) {
            g->off.size = off;
            g->off.coordinate = k;
            g->off.t = g->t;
        }
    }
}

/* Chooses again where another choice would be better: it exists, and |Bvu| has grown. */
static kempe_status renew(kmp_prescribed_motion *g)
{
    int v, u;
    if (g->part.p == 0 || g->at_rest ||
        (g->motion && g->motion->count + kmp_model_state_count(g->system->model) == g->part.p) ||
        kmp_reduction_growth(&g->red, &v, &u) < KMP_EXCHANGE_LED)
        return KEMPE_OK;
    return choose(g, g->t, g->q);
}

/* -- the path ---------------------------------------------------------------------------------------- */

/* Closes the prediction q + move, with u prescribed, and checks that the branch is unchanged. */
static bool follow(kmp_prescribed_motion *g, double t)
{
    double length = 0, added = 0;
    for (int k = 0; k < g->n; k++) {
        length = fmax(length, fabs(g->move[k]) / g->system->scale[k]);
        g->trial[k] = g->q[k] + g->move[k];
    }
    if (!(length <= LONGEST_MOVE) || !close_trial(g, t))
        return false;
    for (int k = 0; k < g->n; k++)
        added = fmax(added, fabs(g->trial[k] - g->q[k] - g->move[k]) / g->system->scale[k]);
    return added <= fmax(TRUSTED_MOVE, TRUSTED_PART * length) &&
           (!g->red.block || kmp_block_has_signs(g->red.block, g->sign));
}

static kempe_status fail_beyond(const kmp_prescribed_motion *g, double t)
{
    int fast = 0;
    for (int k = 1; k < g->n; k++)
        if (fabs(g->qd[k]) / g->system->scale[k] > fabs(g->qd[fast]) / g->system->scale[fast])
            fast = k;
    return kmp_fail(g->system->context, KEMPE_E_FAILED,
                    "the loops cannot be closed beyond t = %.9g s (next instant: %.9g s): the position is not "
                    "attainable, or a dead centre lies between; '%s' moves fastest there",
                    g->t, t, name_of(g, fast));
}

static bool is_all_given(const kmp_prescribed_motion *g)
{
    return g->motion && g->motion->count == kmp_model_coordinates(g->system->model);
}

/* A step to t; positions are from the table if it has all coordinates, otherwise predicted by Taylor's series. */
static bool step(kmp_prescribed_motion *g, double t)
{
    double h = t - g->t;
    if (is_all_given(g)) {
        memcpy(g->trial, g->tq, (size_t)g->n * sizeof *g->trial);
        return close_trial(g, t);
    }
    for (int k = 0; k < g->n; k++)
        g->move[k] = h * (g->qd[k] + h / 2 * g->qdd[k]);
    for (int k = 0; k < g->part.p; k++)
        g->move[g->part.u[k]] = g->tq[g->part.u[k]] - g->q[g->part.u[k]];
    return follow(g, t);
}

/* Steps to `next`. If it fails with redundant rows, the kept ones may be singular where the mechanism is not: it tries
 * again with a choice made here. If the table has all coordinates, it tries again with a choice made there. */
static kempe_status try_step(kmp_prescribed_motion *g, double next, bool *done)
{
    read_table(g, next);
    *done = step(g, next) && settle(g, next) == KEMPE_OK;
    if (!*done && !is_all_given(g) && g->part.r < g->part.m) {
        KMP_TRY(choose(g, g->t, g->q));
        *done = step(g, next) && settle(g, next) == KEMPE_OK;
    }
    if (*done || !is_all_given(g))
        return KEMPE_OK;
    memcpy(g->trial, g->tq, (size_t)g->n * sizeof *g->trial);
    KMP_TRY(close_anew(g, next, done));
    *done = *done && settle(g, next) == KEMPE_OK;
    return KEMPE_OK;
}

kempe_status kmp_prescribed_motion_advance(kmp_prescribed_motion *prescribed, double t)
{
    kmp_prescribed_motion *g = prescribed;
    kmp_adaptive_substeps parts = KMP_PARTS;
    double from = g->t;
    while (g->t < t && kmp_substeps_next(&parts, SHORTEST)) {
        bool done = false;
        KMP_TRY(try_step(g, parts.next < 1 ? from + parts.next * (t - from) : t, &done));
        if (done) {
            note_off(g);
            KMP_TRY(renew(g));
        }
        kmp_substeps_take(&parts, done);
    }
    return g->t < t ? fail_beyond(g, t) : KEMPE_OK;
}

/* -- start ------------------------------------------------------------------------------------------- */

/* q at the beginning of the motion, as far as it is known before the loops are closed there. */
static kempe_status find_beginning(kmp_prescribed_motion *g, double t)
{
    if (is_all_given(g)) {
        memcpy(g->q, g->tq, (size_t)g->n * sizeof *g->q);
        return KEMPE_OK;
    }
    /* The assembled start, at t = 0. */
    kempe_assembly *a = NULL;
    kempe_status status = kmp_assembly_at_start(g->system, &a);
    if (status == KEMPE_OK) {
        memcpy(g->q, a->q, (size_t)g->n * sizeof *g->q);
        memcpy(g->qd, a->qd, (size_t)g->n * sizeof *g->qd);
    }
    kempe_assembly_free(a);
    g->t = 0;
    KMP_TRY(status);
    if (g->at_rest)
        return KEMPE_OK;
    KMP_TRY(choose(g, 0, g->q));
    /* Moves from the start to the beginning of the motion: u along a straight line while time advances to t, v along
     * the tangent. */
    kmp_adaptive_substeps parts = KMP_PARTS;
    memcpy(g->from, g->q, (size_t)g->n * sizeof *g->q);
    while (kmp_substeps_next(&parts, SHORTEST)) {
        kmp_eval_closure(g->eval, parts.done * t, g->q);
        if (kmp_reduction_factor(&g->red))
            break;
        kmp_reduction_tangent(&g->red);
        for (int k = 0; k < g->n; k++)
            g->move[k] = (parts.next - parts.done) * t * g->red.x_t[k];
        for (int i = 0; i < g->part.p; i++) {
            int u = g->part.u[i];
            double end = parts.next < 1 ? parts.next * g->tq[u] + (1 - parts.next) * g->from[u] : g->tq[u];
            for (int k = 0; k < g->n; k++)
                g->move[k] += g->red.x[k + i * g->n] * (end - g->q[u]);
        }
        bool there = follow(g, parts.next * t);
        if (there)
            memcpy(g->q, g->trial, (size_t)g->n * sizeof *g->q);
        kmp_substeps_take(&parts, there);
    }
    if (parts.done >= 1)
        return KEMPE_OK;
    return kmp_fail(g->system->context, KEMPE_E_FAILED,
                    "the loops cannot be closed at the beginning, t = %.9g s: only %.3g of the way from the model's "
                    "start is possible; use a nearer start, or give all coordinates",
                    t, parts.done);
}

kempe_status kmp_prescribed_motion_start(kmp_prescribed_motion *prescribed, double t)
{
    kmp_prescribed_motion *g = prescribed;
    bool closed = false;
    read_table(g, t);
    KMP_TRY(find_beginning(g, t));
    memcpy(g->trial, g->q, (size_t)g->n * sizeof *g->q);
    KMP_TRY(close_anew(g, t, &closed));
    if (!closed || settle(g, t) != KEMPE_OK)
        return kmp_fail(
            g->system->context, KEMPE_E_FAILED,
            "the loops cannot be closed at the beginning of the motion, t = %.9g s: |h| remains %.3g (scaled)", t,
            kmp_eval_residual(g->eval));
    note_off(g);
    return KEMPE_OK;
}
