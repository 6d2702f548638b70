/* SPDX-License-Identifier: BSD-3-Clause */
/* Assembly from a distant guess: Gauss-Newton by least changes of the free coordinates
 * (constraints/closing/least_change.h), damped by |h| and by a bound on the step. If it stalls with h open, each group
 * of loops that shares no free coordinate with another is searched separately: from the guess, from a few states near
 * it, because a straight guess may be a saddle, and from states anywhere. The smallest |h| is the gap to report. Near a
 * solution: Newton's method on the chosen rows and dependent coordinates, a square system, or KINSOL with line search
 * where that does not contract. Gauss-Newton without a bound then converges to round-off. */
#include "constraints/closing/assemble.h"
#include "base/union_find.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/close.h"
#include "constraints/closing/cut_start.h"
#include "constraints/closing/goals.h"
#include "constraints/closing/kinsol.h"
#include "constraints/closing/least_change.h"
#include "constraints/closing/random_walk.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/start.h"
#include <math.h>
#include <string.h>

enum {
    MOST_CORRECTIONS = 40,
    MAX_CHOICES = 4,
    MOST_DENSE = 128 /* number of rows of KINSOL's matrix */,
    WIDE_STARTS = 16
};
#define PUSH  0.3
#define WIDE  3.14159265358979312 /* rad, or characteristic lengths */
#define WORTH 0.1                 /* least part of |h| by which a step near a solution must reduce it */

/* State of one assembly. */
typedef struct work {
    const kempe_system *s;
    kempe_assembly *a;
    kmp_evaluator *eval;
    kmp_least_change least;
    kmp_rotation_vectors vectors;
    kmp_closer closer;
    const kmp_guess *guess;
    int n, m;
    kmp_arena arena;
    double *trial;      /* n; also used for rows */
    double *from;       /* n: the guess in the present charts */
    double *best;       /* n */
    double *rate;       /* m */
    bool *fixed;        /* n: prescribed rates */
    kmp_partition part; /* choice of u and v for KINSOL */
    double *jacobian;   /* m x n, for KINSOL's matrix */
    kmp_loosening loose;
    bool apart;  /* groups of loops were closed one by one */
    int rank;    /* rank of J if other rows stay open by rounding; -1: none */
    double near; /* scaled |h| below which the rank of J is decided and Newton's method is used */
} work;

static void evaluate(work *w)
{
    kmp_eval_closure(w->eval, 0, w->a->q);
}

static double residual(const work *w)
{
    return kmp_eval_residual(w->eval);
}

static void copy(const work *w, double *to, const double *from)
{
    memcpy(to, from, (size_t)w->n * sizeof *to);
}

/* True if a closure that aligns axes has them turned by more than a right angle. */
static bool is_turned(work *w)
{
    bool turned = false;
    if (w->vectors.count > 0)
        evaluate(w);
    kmp_rotation_vectors_measure(&w->vectors, w->eval);
    for (int i = 0; i < w->vectors.count; i++)
        turned = turned || w->vectors.angle[i] > acos(0);
    return turned;
}

static void refine(work *w);

/* Groups of closure rows and free coordinates: loops of different groups do not depend on each other. */
typedef struct groups {
    int count;
    int *motion, *row; /* n, m: the group of each, -1: none */
    bool *hold, *left_out;
} groups;

/* false: no memory. */
static bool find_groups(work *w, groups *g)
{
    const kmp_pattern *p = &w->s->jacobian;
    int n = w->n, m = w->m, *parent = KMP_ARENA_NEW(&w->arena, int, n + m);
    if (!parent || !KMP_ARENA_MAKE(&w->arena, KMP_ROOM(int, n, &g->motion), KMP_ROOM(int, m, &g->row),
                                   KMP_ROOM(bool, n, &g->hold), KMP_ROOM(bool, m, &g->left_out)))
        return false;
    for (int k = 0; k < n + m; k++)
        parent[k] = k;
    for (int e = 0; e < p->count; e++)
        if (!w->guess->hold[p->col[e]])
            parent[kmp_root_of(parent, n + p->row[e])] = kmp_root_of(parent, p->col[e]);
    for (int k = 0; k < n; k++)
        g->motion[k] = -1;
    for (int r = 0; r < m; r++) {
        int root = kmp_root_of(parent, n + r), *group = &g->motion[root < n ? root : 0];
        g->row[r] = -1;
        if (root >= n) /* no free coordinate */
            continue;
        *group = *group < 0 ? g->count++ : *group;
        g->row[r] = *group;
    }
    for (int k = 0; k < n; k++)
        g->motion[k] = g->motion[kmp_root_of(parent, k)];
    return true;
}

/* The first coordinate of a group, from 1, of which the file gives no start value; 0: it gives one. */
static int first_without_start(const work *w, const groups *g, int group)
{
    int first = 0;
    for (int k = w->n; k-- > 0;) {
        if (g->motion[k] != group)
            continue;
        if (kmp_model_start(w->s->model)->q_given[k])
            return 0;
        first = k + 1;
    }
    return first;
}

/* Closes the rows of one group by its own coordinates; the others stay. */
static void close_group(work *w, groups *g, int group)
{
    const bool *left_out = w->eval->unmet.left_out;
    unsigned state = 1;
    for (int k = 0; k < w->n; k++)
        g->hold[k] = w->guess->hold[k] || g->motion[k] != group;
    for (int r = 0; r < w->m; r++)
        g->left_out[r] = (left_out && left_out[r]) || g->row[r] != group;
    w->least.hold = g->hold;
    w->eval->unmet.left_out = g->left_out;
    evaluate(w);
    double best = residual(w);
    copy(w, w->best, w->a->q);
    int attempts = w->guess->pushes + (w->guess->pushes > 0 ? WIDE_STARTS : 0);
    bool searched = false;
    for (int k = g->count > 1 ? 0 : 1; k <= attempts && !(best <= w->near); k++) {
        /* The guess plus a random offset; the numbers are the same on every machine. */
        double far = k == 0 ? 0 : k <= w->guess->pushes ? PUSH : WIDE;
        for (int i = 0; i < w->n; i++)
            if (!g->hold[i])
                w->a->q[i] = w->from[i] + far * kmp_walk_random(&state) * w->s->scale[i];
        w->a->iterations += kmp_close_from_afar(&w->closer, w->near, 0, 0, w->a->q, w->trial);
        if (residual(w) < best * (1 - 1e-6)) {
            best = residual(w);
            copy(w, w->best, w->a->q);
            searched = k > w->guess->pushes;
        }
    }
    if (searched && best <= w->near && w->a->searched == 0)
        w->a->searched = first_without_start(w, g, group);
    copy(w, w->a->q, w->best);
    evaluate(w);
    if (w->apart && best <= w->near)
        refine(w);
    w->least.hold = w->guess->hold;
    w->eval->unmet.left_out = left_out;
}

/* False: no memory. */
static bool close_from_guess(work *w)
{
    groups g = {0};
    w->a->iterations += kmp_close_from_afar(&w->closer, w->near, 0, 0, w->a->q, w->trial);
    if (residual(w) <= w->near)
        return true;
    if (!find_groups(w, &g))
        return false;
    w->apart = g.count > 1;
    for (int group = 0; group < g.count; group++)
        close_group(w, &g, group);
    evaluate(w);
    return true;
}

/* -- near: Newton's method on the chosen rows and v -------------------------------------------------- */

static int dependent_rows(void *self, const double *v, double *out)
{
    work *w = self;
    for (int i = 0; i < w->part.r; i++)
        w->a->q[w->part.v[i]] = v[i];
    evaluate(w);
    for (int i = 0; i < w->part.r; i++)
        out[i] = w->eval->h[w->part.rows[i]];
    return 0;
}

static int dependent_matrix(void *self, const double *v, double *out)
{
    work *w = self;
    int r = w->part.r;
    (void)dependent_rows(w, v, w->trial);
    kmp_eval_dense_jacobian(w->eval, w->jacobian);
    for (int k = 0; k < r; k++)
        for (int i = 0; i < r; i++)
            out[i + k * r] = w->jacobian[w->part.rows[i] + w->part.v[k] * w->m];
    return 0;
}

/* Chooses rows and v, with the held coordinates in u if possible. false: KINSOL is not applicable, because the rank is
 * not decided yet or a held coordinate would have to move. */
static bool choose_dependent(work *w)
{
    const kmp_partition *part = &w->part;
    int held_count = 0, *held = KMP_ARENA_NEW(&w->arena, int, w->n);
    for (int k = 0; held && k < w->n; k++)
        if (w->guess->hold[k])
            held[held_count++] = k;
    kmp_partition_free(&w->part); /* of a search before */
    bool chosen = (held && kmp_partition_init(&w->part, w->s, w->eval->jacobian, held, held_count) == KEMPE_OK) ||
                  kmp_partition_init(&w->part, w->s, w->eval->jacobian, NULL, 0) == KEMPE_OK;
    kmp_context_clear(w->s->context);
    if (!chosen || part->r == 0 || part->r > MOST_DENSE ||
        !(part->pivots[part->r - 1] > KMP_CLOSED_DECIDED * residual(w) * part->pivots[0]))
        return false;
    for (int i = 0; i < part->r; i++)
        if (w->guess->hold[part->v[i]])
            return false;
    return true;
}

/* Newton's method as between the steps of a run. false: corrections do not contract, and q is restored. */
static bool close_by_newton(work *w)
{
    kmp_reduction red;
    bool closed = kmp_reduction_init(&red, w->eval, &w->part) == KEMPE_OK &&
                  !kmp_reduction_close(&red, 0, w->a->q, NULL, 0) && residual(w) <= KMP_CLOSED_ENOUGH;
    w->a->iterations += (int)red.newton;
    kmp_reduction_free(&red);
    kmp_context_clear(w->s->context);
    if (!closed)
        copy(w, w->a->q, w->best);
    return closed;
}

/* KINSOL searches along each of its corrections. */
static void close_by_search(work *w)
{
    const kmp_partition *part = &w->part;
    double *v, *scale_v, *scale_h;
    int iterations = 0;
    if (!KMP_ARENA_EACH(&w->arena, double, part->r, &v, &scale_v, &scale_h) ||
        !(w->jacobian = KMP_ARENA_NEW(&w->arena, double, w->m * w->n)))
        return;
    for (int i = 0; i < part->r; i++) {
        v[i] = w->a->q[part->v[i]];
        scale_v[i] = 1 / w->s->scale[part->v[i]];
        scale_h[i] = 1 / w->s->row_scale[part->rows[i]];
    }
    const kmp_kinsol_problem problem = {w, part->r, scale_v, scale_h, dependent_rows, dependent_matrix};
    if (kmp_kinsol_solve(&problem, KMP_CLOSED_ENOUGH, v, &iterations))
        (void)dependent_rows(w, v, w->trial);
    else
        copy(w, w->a->q, w->best);
    w->a->iterations += iterations;
}

/* Corrects q to round-off; true if the loops are then closed, otherwise q is restored. */
static bool correct_to_rounding(work *w)
{
    const kmp_close_rule rule = kmp_least_change_rule(MOST_CORRECTIONS);
    double before = residual(w);
    copy(w, w->best, w->a->q);
    w->a->iterations += kmp_close(&w->closer, &rule, 0, w->a->q).corrections;
    evaluate(w);
    bool closed = residual(w) <= fmin(before, KMP_CLOSED_ENOUGH);
    if (!closed)
        copy(w, w->a->q, w->best);
    evaluate(w);
    return closed;
}

/* Runs Gauss-Newton from a nearby state until it stalls, then to round-off. */
static void refine(work *w)
{
    w->a->iterations += kmp_close_from_afar(&w->closer, KMP_CLOSED_ENOUGH, WORTH, 0, w->a->q, w->trial);
    if (residual(w) <= KMP_CLOSED_ENOUGH)
        (void)correct_to_rounding(w);
}

/* -- rounded numbers --------------------------------------------------------------------------------- */

/* Marks the rows to drop at the last evaluation in `dropped`. false: there is no such choice. */
static bool choose_rows(work *w, bool *dropped)
{
    kmp_partition part;
    if (kmp_partition_of_rank(&part, w->s, w->eval->jacobian, w->rank, NULL, 0) != KEMPE_OK) {
        kmp_context_clear(w->s->context);
        return false;
    }
    memset(dropped, 0, (size_t)w->m * sizeof *dropped);
    for (int k = 0; k < w->m - part.r; k++)
        dropped[part.redundant[k]] = true;
    kmp_partition_free(&part);
    return true;
}

/* Closes the independent rows, chosen again until they no longer change. */
static void close_independent(work *w)
{
    size_t bytes = (size_t)w->m * sizeof(bool);
    bool *before = KMP_ARENA_NEW(&w->arena, bool, w->m), *dropped = w->a->dropped;
    for (int pass = 0; before && pass < MAX_CHOICES; pass++) {
        w->eval->unmet.left_out = NULL;
        evaluate(w);
        memcpy(before, dropped, bytes);
        if (!choose_rows(w, dropped) || (pass > 0 && memcmp(before, dropped, bytes) == 0))
            break;
        w->eval->unmet.left_out = dropped;
        refine(w);
    }
    w->eval->unmet.left_out = dropped;
    evaluate(w);
}

/* -- spherical joints -------------------------------------------------------------------------------- */

/* Centres joints with nearly singular angles in the guess: they begin in the middle of another chart. A joint with only
 * some angles held is unchanged; with goals all joints are. false: no memory. */
static bool center_joints(work *w)
{
    int charts = kmp_charts_count(w->s), centred = 0;
    if (w->guess->goals && kmp_model_start(w->s->model)->goal_count > 0)
        return true;
    for (int c = 0; c < charts; c++) {
        const bool *hold = w->guess->hold + w->s->chart_first[c];
        if (hold[0] == hold[1] && hold[1] == hold[2] && kmp_chart_regular(w->s, c, w->a->q) < KMP_AXES_TURNED) {
            kmp_chart_center(w->s, c, w->eval->chart, w->a->q, NULL, NULL);
            centred++;
        }
    }
    if (centred == 0)
        return true;
    kmp_eval_set_charts(w->eval, w->eval->chart);
    w->a->chart = KMP_ARENA_NEW(&w->a->arena, double, KMP_CHART_SIZE *charts);
    return KMP_ARENA_EACH(&w->a->arena, double, w->n, &w->a->inner_q, &w->a->inner_qd);
}

/* The user's angles of joint c; the axes of the guess if the joint did not move. */
static void show_angles(work *w, int c, double angles[3])
{
    int k = w->s->chart_first[c];
    const double *q = w->a->q + k, *from = w->from + k, *guess = w->guess->q + k;
    if (memcmp(q, from, 3 * sizeof *q) == 0) {
        memcpy(angles, guess, 3 * sizeof *q);
        return;
    }
    memcpy(w->trial, w->a->q, (size_t)w->n * sizeof *w->trial);
    (void)kmp_chart_show(w->s, c, w->eval->chart, guess, w->trial, NULL, NULL);
    memcpy(angles, w->trial + k, 3 * sizeof *angles);
}

/* Converts the state to the user's coordinates and keeps the one in the present charts (inner_q, inner_qd, chart). */
static void show_state(work *w)
{
    kempe_assembly *a = w->a;
    if (a->inner_q) {
        memcpy(a->inner_q, a->q, (size_t)w->n * sizeof *a->q);
        memcpy(a->inner_qd, a->qd, (size_t)w->n * sizeof *a->qd);
        memcpy(a->chart, w->eval->chart, (size_t)(KMP_CHART_SIZE * w->s->chart_count) * sizeof *a->chart);
    }
    for (int c = 0; a->inner_q && c < kmp_charts_count(w->s); c++) {
        double angles[3], near[3];
        int k = w->s->chart_first[c];
        if (kmp_chart_is_own(a->chart, c))
            continue;
        show_angles(w, c, angles);
        memcpy(near, angles, sizeof near);
        (void)kmp_chart_show(w->s, c, a->chart, near, a->q, a->qd, NULL);
        memcpy(a->q + k, angles, sizeof angles);
    }
    for (int k = 0; k < w->n; k++)
        a->moved[k] = a->q[k] - w->guess->q[k];
}

/* -- rates ------------------------------------------------------------------------------------------- */

/* Corrects the rates that are not fixed by least changes so that J qd + h_t = 0; returns the remaining residual. */
static double correct_rates(work *w, const bool *fixed)
{
    w->least.hold = fixed;
    if (w->closer.place(w->closer.self, 0, w->a->q) == 0)
        kmp_close_rates(&w->closer, w->rate, w->a->qd);
    w->least.hold = w->guess->hold;
    return kmp_eval_rate_residual(w->eval, w->a->qd);
}

/* Sets the model's rates, for centred joints in their charts: one given rate of a joint counts as all three. */
static void given_rates(work *w)
{
    const kmp_start *start = kmp_model_start(w->s->model);
    for (int k = 0; k < w->n; k++) {
        w->a->qd[k] = start->qd[k].value;
        w->fixed[k] = start->qd_given[k];
    }
    for (int c = 0; c < kmp_charts_count(w->s); c++) {
        int k = w->s->chart_first[c];
        if (kmp_chart_is_own(w->eval->chart, c))
            continue;
        double angles[3], rates[3];
        show_angles(w, c, angles);
        memcpy(rates, w->a->qd + k, sizeof rates);
        kmp_chart_enter(w->s, c, w->eval->chart, angles, rates, w->a->q, w->a->qd);
        w->fixed[k] = w->fixed[k + 1] = w->fixed[k + 2] = w->fixed[k] || w->fixed[k + 1] || w->fixed[k + 2];
    }
}

/* The fastest rate, scaled, of coordinates and of closures. */
static double fastest(const work *w)
{
    double size = kmp_eval_size(w->eval, w->a->qd);
    for (int r = 0; w->eval->h_t && r < w->m; r++)
        size = fmax(size, fabs(w->eval->h_t[r]) / w->s->row_scale[r]);
    return size;
}

/* Makes the rates consistent with the closures. Given rates are kept if these allow it. */
static void meet_closures(work *w)
{
    bool given = false;
    for (int k = 0; k < w->n; k++)
        given = given || w->fixed[k];
    evaluate(w);
    double size = fastest(w), left = correct_rates(w, w->fixed);
    if (given && left > KMP_CLOSED_RATES * fmax(size, fastest(w))) {
        w->a->rates_changed = true;
        given_rates(w);
        left = correct_rates(w, NULL);
    }
    size = fmax(size, fastest(w));
    w->a->rates_left = left > KMP_CLOSED_RATES * size ? left / size : 0;
}

static void make_rates(work *w)
{
    given_rates(w);
    evaluate(w);
    if (!kmp_cut_start_rates(w->eval, w->fixed, w->a->q, w->a->qd))
        w->arena.failed = true;
    if (w->m > 0)
        meet_closures(w);
    if (w->a->rates_changed)
        return;
    /* Joints with clearance rest in their bearings, as far as the given rates let them. */
    w->least.hold = w->fixed;
    w->a->rested = kmp_loosening_rest(&w->loose, w->fixed, w->a->q, w->a->qd, w->a->loose);
    if (w->a->rested && w->m > 0)
        (void)correct_rates(w, w->fixed);
    w->least.hold = w->guess->hold;
}

/* -- result -------------------------------------------------------------------------------------------- */

/* Finds the gap of each closure, from its rows of lengths, and its angle, from its other rows; where they align axes,
 * the angle of the rotation between these. */
static void measure_gaps(work *w)
{
    kempe_assembly *a = w->a;
    a->turned = is_turned(w);
    for (int r = 0; r < w->m; r++) {
        const kmp_row *row = &w->s->rows[r];
        a->open[r] = kmp_eval_opening(w->eval, r);
        a->misfit = a->dropped[r] ? fmax(a->misfit, a->open[r]) : a->misfit;
        if (row->length_power != 0)
            a->gaps[row->closure] = hypot(a->gaps[row->closure], a->open[r] * w->s->length);
        else
            a->turns[row->closure] = hypot(a->turns[row->closure], a->open[r]);
    }
    for (int i = 0; i < w->vectors.count; i++)
        a->turns[w->vectors.closure[i]] = w->vectors.angle[i];
    for (int c = 0; c < kmp_model_closure_count(w->s->model); c++) {
        a->gap = fmax(a->gap, a->gaps[c]);
        a->turn = fmax(a->turn, a->turns[c]);
    }
}

/* Counts drives and the degrees of freedom without them. false: no memory. */
static bool count_drives(work *w)
{
    const kmp_pattern *p = &w->s->jacobian;
    kempe_assembly *a = w->a;
    double *without = KMP_ARENA_NEW(&w->arena, double, p->count);
    if (!without)
        return false;
    for (int r = 0; r < w->m; r++)
        a->drives += kmp_closure_is_drive(kmp_model_closure(w->s->model, w->s->rows[r].closure));
    for (int e = 0; e < p->count; e++)
        without[e] = kmp_closure_is_drive(kmp_model_closure(w->s->model, w->s->rows[p->row[e]].closure))
                         ? 0
                         : w->eval->jacobian[e];
    if (a->drives == 0 || !kmp_partition_pivots(w->s, without, a->pivots))
        return a->drives == 0;
    a->freedoms = w->n;
    for (int k = 0; k < w->m && k < w->n && a->pivots[k] > KMP_RANK_SHAKY * a->pivots[0]; k++)
        a->freedoms--;
    return true;
}

/* Computes the pivots and the openings of the closures; sorts the open ones by size. false: no memory. */
static bool judge_closures(work *w)
{
    kempe_assembly *a = w->a;
    a->residual = w->m > 0 ? residual(w) : 0;
    measure_gaps(w);
    a->closed = a->residual <= KMP_CLOSED_ENOUGH && a->misfit * w->s->length <= w->s->closure_tolerance && !a->turned;
    for (int c = 0; !a->closed && c < kmp_model_closure_count(w->s->model); c++) {
        double extent = kmp_assembly_extent(a, c);
        if (extent <= KMP_CLOSED_ENOUGH * w->s->length)
            continue;
        int k = a->culprit_count++;
        for (; k > 0 && kmp_assembly_extent(a, a->culprits[k - 1]) < extent; k--)
            a->culprits[k] = a->culprits[k - 1];
        a->culprits[k] = c;
    }
    return (a->closed || count_drives(w)) && kmp_partition_pivots(w->s, w->eval->jacobian, a->pivots);
}

/* -- all together ------------------------------------------------------------------------------------ */

static bool work_init(work *w, const kempe_system *s, const kmp_guess *guess, kempe_assembly *a)
{
    *w = (work){.s = s, .a = a, .guess = guess, .n = s->n, .m = s->m, .eval = kmp_eval_new_of_closures(s)};
    const kmp_rounding *rounding = kmp_rounding_of(s);
    w->rank = guess->rank > 0 ? guess->rank : rounding ? rounding->rank : -1;
    w->near = w->rank < 0 ? KMP_CLOSED_NEAR : fmax(KMP_CLOSED_NEAR, 2 * s->closure_tolerance / s->length);
    KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, s->n + s->m, &w->trial), KMP_ROOM(double, s->n, &w->from, &w->best),
                   KMP_ROOM(double, s->m, &w->rate), KMP_ROOM(bool, s->n, &w->fixed));
    if (!w->eval || w->arena.failed || !kmp_least_change_init(&w->least, w->eval) ||
        !kmp_rotation_vectors_init(&w->vectors, s, &w->arena))
        return false;
    w->least.hold = guess->hold;
    w->closer = kmp_least_change_closer(&w->least);
    copy(w, a->q, guess->q);
    bool ok = kmp_loosening_init(&w->loose, s, &w->closer) && center_joints(w);
    copy(w, w->from, a->q);
    return ok;
}

static void work_free(work *w)
{
    kmp_partition_free(&w->part);
    kmp_loosening_free(&w->loose);
    kmp_least_change_free(&w->least);
    kmp_eval_free(w->eval);
    kmp_arena_free(&w->arena);
}

static void close_near(work *w)
{
    double open = residual(w);
    if (w->rank >= 0 && open <= w->near) {
        close_independent(w);
        return;
    }
    if (open > w->near &&
        (correct_to_rounding(w) || w->apart)) /* undamped steps may still leave a stationary point of |h| */
        return;
    /* The dependent coordinates follow. The independent ones keep the values of the guess: a start that is closed
     * to its digits keeps them, and with them the forces of stiff springs. */
    if (open <= w->near && open > KMP_CLOSED_ENOUGH && choose_dependent(w)) {
        copy(w, w->best, w->a->q);
        if (!close_by_newton(w))
            close_by_search(w);
        evaluate(w);
    }
    refine(w);
}

static bool is_closed(work *w)
{
    return residual(w) <= KMP_CLOSED_ENOUGH && !is_turned(w);
}

/* Searches again from the guess by rotation vectors (constraints/closing/least_change.h), whose search does not end
 * at half a turn, if axes that should be parallel were turned by more than a right angle, or are. The last steps are by
 * the closures' rows. Keeps the state found before if it does not close. False: no memory. */
static bool search_by_vectors(work *w)
{
    size_t bytes = (size_t)w->m * sizeof *w->a->dropped;
    const bool *left_out = w->eval->unmet.left_out;
    double *q = KMP_ARENA_NEW(&w->arena, double, w->n);
    bool *dropped = KMP_ARENA_NEW(&w->arena, bool, w->m), turned = is_turned(w);
    if (!q || !dropped)
        return false;
    copy(w, q, w->a->q);
    memcpy(dropped, w->a->dropped, bytes);
    copy(w, w->a->q, w->from);
    memset(w->a->dropped, 0, bytes);
    w->eval->unmet.left_out = NULL;
    if (turned || is_turned(w)) {
        w->least.vectors = &w->vectors;
        bool made = close_from_guess(w);
        w->least.vectors = NULL;
        if (!made)
            return false;
        evaluate(w);
        close_near(w);
    }
    if (!is_closed(w)) {
        copy(w, w->a->q, q);
        memcpy(w->a->dropped, dropped, bytes);
        w->eval->unmet.left_out = left_out;
        evaluate(w);
    }
    return true;
}

/* Moves a closed state along its branch to the point nearest to the goals. false: no memory. */
static bool seek_goals(work *w)
{
    kmp_goals_verdict *goals = &w->a->goals;
    if (!w->guess->goals || goals->count == 0)
        return true;
    if (w->m > 0 && residual(w) > KMP_CLOSED_ENOUGH)
        return kmp_goals_measure(w->s, w->a->q, goals);
    if (!kmp_goals_seek(w->s, w->guess->hold, w->a->q, goals))
        return false;
    w->a->iterations += goals->steps;
    if (w->eval->unmet.left_out)
        close_independent(w);
    else if (w->m > 0)
        refine(w);
    return kmp_goals_measure(w->s, w->a->q, goals);
}

/* Runs one assembly. false: no memory. */
static bool assemble(work *w)
{
    bool ok = true;
    if (w->m > 0) {
        ok = close_from_guess(w);
        close_near(w);
        if (ok && w->vectors.count > 0 && !is_closed(w))
            ok = search_by_vectors(w);
    }
    if (kmp_model_start(w->s->model)->goal_count == 0)
        w->a->centred = kmp_loosening_center(&w->loose, w->guess->hold, w->a->q);
    if (!ok || !seek_goals(w) || !judge_closures(w))
        return false;
    if (w->a->closed)
        make_rates(w);
    show_state(w);
    return !w->arena.failed && !w->loose.arena.failed;
}

kempe_status kmp_assemble_from(const kempe_system *system, const kmp_guess *guess, kempe_assembly **assembly)
{
    work w = {0};
    kempe_assembly *a = kmp_assembly_new(system);
    if (!a || !work_init(&w, system, guess, a) || !assemble(&w)) {
        work_free(&w);
        kempe_assembly_free(a);
        return kmp_fail_memory(system->context);
    }
    work_free(&w);
    *assembly = a;
    return KEMPE_OK;
}
