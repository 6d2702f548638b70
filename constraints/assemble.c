/* SPDX-License-Identifier: BSD-3-Clause */
/* From afar: Gauss-Newton on the scaled h over the coordinates that are not held, damped twice (Levenberg, Marquardt):
 * by |h|, so that directions whose rank is not decided before the loops are closed are left alone (Yamashita and
 * Fukushima, Computing Suppl. 15 (2001) 239: still quadratic, to the nearest closed state, where closures are
 * redundant), and by a bound on the step. Where it comes to rest with h open it is pushed aside a few times, because a
 * straight guess may be a saddle; the smallest rest is the gap to report. Near: KINSOL with line search on the chosen
 * rows and dependent coordinates, which wants a square system; then Gauss-Newton again, without a bound, to round-off.
 * A large J stays sparse: its steps come from [1 -J'; J damping^2]. */
#include "constraints/assemble.h"
#include "base/memory.h"
#include "constraints/charts.h"
#include "constraints/kinsol.h"
#include "constraints/partition.h"
#include "constraints/plant.h"
#include "constraints/rounding.h"
#include "constraints/tolerances.h"
#include "linalg/least.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MAX_ITERATIONS = 200, MAX_POLISH = 40, MAX_CHOICES = 4 };
#define SHORTEST_STEP   1e-8
#define PUSH            0.3
#define NEARLY_SINGULAR 0.1 /* determinant of the axes of a spherical joint */
/* With more places than this J is not made dense, and KINSOL is left out. */
#define DENSE_MOST (1 << 14)

/* One assembly at work. Arrays over free coordinates only are marked so. */
typedef struct work {
    const kempe_system *s;
    kempe_assembly *a;
    kmp_plant *plant;
    const kmp_guess *guess;
    int n, m, free_count;
    int *free; /* coordinates that may move */
    bool large;
    double *jac;        /* m x n, unscaled; this and the next two for a small J */
    double *scaled;     /* m x free, scaled */
    double *damped;     /* (m + free) x free: the same over a multiple of the unit matrix */
    kmp_entries sparse; /* of a large J: m x free, scaled, in the three arrays below */
    int *entry_row, *entry_col;
    double *entry;
    int *place;     /* n: of a coordinate among the free ones */
    double *right;  /* m + free */
    double *h;      /* m, scaled */
    double *step;   /* free, scaled */
    double *trial;  /* n */
    double *from;   /* n: the guess, in the charts at hand */
    bool *fixed;    /* n: given rates */
    double *best;   /* n */
    int *part_wish; /* n */
    kmp_partition part;
    bool has_part;
    bool starved;        /* a step found no memory */
    int rank;            /* of J where the other rows stay open by rounding; -1: there are none */
    double near;         /* scaled |h| from which the rows are told apart, or Newton's method is trusted */
    const bool *dropped; /* m: rows that are left alone; NULL: none */
} work;

static void evaluate(work *w, const double *q)
{
    kmp_plant_closure(w->plant, 0, q);
    for (int r = 0; r < w->m; r++)
        w->h[r] = w->dropped && w->dropped[r] ? 0 : w->plant->h[r] / w->s->row_scale[r];
}

static double norm(int n, const double *x)
{
    double s = 0;
    for (int i = 0; i < n; i++)
        s += x[i] * x[i];
    return sqrt(s);
}

static double largest(int n, const double *x)
{
    double s = 0;
    for (int i = 0; i < n; i++)
        s = fmax(s, isfinite(x[i]) ? fabs(x[i]) : INFINITY);
    return s;
}

/* J of the plant's last closure on the free coordinates, scaled. */
static void sparse_jacobian(work *w)
{
    const kmp_pattern *jac = &w->s->jacobian;
    int nz = 0;
    for (int k = 0; k < w->n; k++)
        w->place[k] = -1;
    for (int k = 0; k < w->free_count; k++)
        w->place[w->free[k]] = k;
    for (int e = 0; e < jac->count; e++)
        if (w->place[jac->col[e]] >= 0 && !(w->dropped && w->dropped[jac->row[e]])) {
            w->entry_row[nz] = jac->row[e];
            w->entry_col[nz] = w->place[jac->col[e]];
            w->entry[nz++] = w->plant->jacobian[e] * w->s->scale[jac->col[e]] / w->s->row_scale[jac->row[e]];
        }
    w->sparse = (kmp_entries){w->m, w->free_count, nz, w->entry_row, w->entry_col, w->entry};
}

static void scaled_jacobian(work *w)
{
    if (w->large) {
        sparse_jacobian(w);
        return;
    }
    kmp_plant_dense_jacobian(w->plant, w->jac);
    for (int k = 0; k < w->free_count; k++)
        for (int r = 0; r < w->m; r++)
            w->scaled[r + k * w->m] = w->dropped && w->dropped[r] ? 0
                                                                  : w->jac[r + w->free[k] * w->m] *
                                                                        w->s->scale[w->free[k]] / w->s->row_scale[r];
}

static void move(const work *w, const double *q, double factor, double *to)
{
    memcpy(to, q, (size_t)w->n * sizeof *to);
    for (int k = 0; k < w->free_count; k++)
        to[w->free[k]] -= factor * w->step[k] * w->s->scale[w->free[k]];
}

/* Whether there is a step. Without memory what comes of it is no result. */
static bool took_step(work *w, kmp_least_outcome outcome)
{
    w->starved = w->starved || outcome == KMP_LEAST_NO_MEMORY;
    return outcome == KMP_LEAST_FOUND;
}

static bool took_dense_step(work *w, int rank)
{
    return took_step(w, rank < 0 ? KMP_LEAST_NO_MEMORY : KMP_LEAST_FOUND);
}

/* The step of least |J s - h|^2 + |damping s|^2 from the last scaled_jacobian. */
static bool damped_step(work *w, double damping)
{
    int m = w->m, f = w->free_count, rows = m + f;
    if (w->large)
        return took_step(w, kmp_least_squares_sparse(&w->sparse, w->h, damping, KMP_RANK, w->step));
    for (int k = 0; k < f; k++)
        for (int i = 0; i < rows; i++)
            w->damped[i + k * rows] = i < m ? w->scaled[i + k * m] : i - m == k ? damping : 0;
    for (int i = 0; i < rows; i++)
        w->right[i] = i < m ? w->h[i] : 0;
    return took_dense_step(w, kmp_least_squares(rows, f, w->damped, w->right, KMP_RANK, w->step));
}

/* The same, damped by |h| and then as far as the bound on the step asks for. */
static bool bounded_step(work *w, double bound)
{
    double damping = fmax(norm(w->m, w->h), DBL_MIN);
    for (int k = 0; k < 60; k++, damping *= 3) {
        if (!damped_step(w, damping))
            return false;
        if (largest(w->free_count, w->step) <= bound)
            return true;
    }
    return false;
}

/* What a step promises to leave of |h|. */
static double promise(const work *w)
{
    double sum = 0;
    if (w->large) {
        memcpy(w->right, w->h, (size_t)w->m * sizeof *w->right);
        for (int e = 0; e < w->sparse.nz; e++)
            w->right[w->entry_row[e]] -= w->entry[e] * w->step[w->entry_col[e]];
        return norm(w->m, w->right);
    }
    for (int r = 0; r < w->m; r++) {
        double left = w->h[r];
        for (int k = 0; k < w->free_count; k++)
            left -= w->scaled[r + k * w->m] * w->step[k];
        sum += left * left;
    }
    return sqrt(sum);
}

/* One step down; `bound` shrinks where steps break their promise and grows where they keep it. false: at rest. */
static bool step_down(work *w, double *bound)
{
    double before = norm(w->m, w->h);
    scaled_jacobian(w);
    for (; *bound > SHORTEST_STEP; *bound *= 0.4) {
        if (!bounded_step(w, *bound))
            return false;
        double promised = before - promise(w);
        if (!(promised > 0)) /* no slope left */
            return false;
        move(w, w->a->q, 1, w->trial);
        evaluate(w, w->trial);
        double gained = before - norm(w->m, w->h);
        if (gained > 0.1 * promised) {
            memcpy(w->a->q, w->trial, (size_t)w->n * sizeof *w->trial);
            if (gained > 0.6 * promised)
                *bound = fmin(2 * *bound, KMP_LONGEST_CORRECTION);
            return true;
        }
        evaluate(w, w->a->q);
    }
    return false;
}

static void descend(work *w)
{
    double bound = KMP_LONGEST_CORRECTION;
    evaluate(w, w->a->q);
    for (int k = 0; k < MAX_ITERATIONS && largest(w->m, w->h) > w->near; k++) {
        w->a->iterations++;
        if (!step_down(w, &bound))
            return;
    }
}

/* The free coordinates from the guess, each by up to PUSH; the same numbers on every machine. */
static void push_aside(work *w, unsigned *state)
{
    for (int k = 0; k < w->free_count; k++) {
        int c = w->free[k];
        *state = *state * 1664525u + 1013904223u;
        double way = (double)(*state >> 8) / (1 << 23) - 1;
        w->a->q[c] = w->from[c] + PUSH * way * w->s->scale[c];
    }
}

static void from_afar(work *w)
{
    unsigned state = 1;
    descend(w);
    double best = largest(w->m, w->h);
    memcpy(w->best, w->a->q, (size_t)w->n * sizeof *w->best);
    for (int k = 0; k < w->guess->pushes && best > w->near && w->free_count > 0; k++) {
        push_aside(w, &state);
        descend(w);
        double now = largest(w->m, w->h);
        if (now < best * (1 - 1e-6)) {
            best = now;
            memcpy(w->best, w->a->q, (size_t)w->n * sizeof *w->best);
        }
    }
    memcpy(w->a->q, w->best, (size_t)w->n * sizeof *w->best);
    evaluate(w, w->a->q);
}

/* -- near: KINSOL on the chosen rows and v ----------------------------------------------------------- */

static void put_dependent(work *w, const double *v)
{
    memcpy(w->trial, w->a->q, (size_t)w->n * sizeof *w->trial);
    for (int i = 0; i < w->part.r; i++)
        w->trial[w->part.v[i]] = v[i];
    evaluate(w, w->trial);
}

static int newton_residual(void *self, const double *v, double *out)
{
    work *w = self;
    put_dependent(w, v);
    for (int i = 0; i < w->part.r; i++)
        out[i] = w->plant->h[w->part.rows[i]];
    return 0;
}

static int newton_matrix(void *self, const double *v, double *out)
{
    work *w = self;
    int r = w->part.r;
    put_dependent(w, v);
    kmp_plant_dense_jacobian(w->plant, w->jac);
    for (int k = 0; k < r; k++)
        for (int i = 0; i < r; i++)
            out[i + k * r] = w->jac[w->part.rows[i] + w->part.v[k] * w->m];
    return 0;
}

/* Rows and v, with the held coordinates in u when they may all be there. false: KINSOL is of no use here, because the
 * rank is not decided yet or a held coordinate would have to move. */
static bool choose_dependent(work *w)
{
    const kempe_system *s = w->s;
    int held = 0, *hold = w->part_wish;
    for (int k = 0; k < w->n; k++)
        if (w->guess->hold[k])
            hold[held++] = k;
    w->has_part = kmp_partition_init(&w->part, s, w->plant->jacobian, hold, held) == KEMPE_OK ||
                  kmp_partition_init(&w->part, s, w->plant->jacobian, NULL, 0) == KEMPE_OK;
    kmp_context_clear(s->context);
    if (!w->has_part || w->part.r == 0 ||
        !(w->part.pivots[w->part.r - 1] > KMP_CLOSED_DECIDED * largest(w->m, w->h) * w->part.pivots[0]))
        return false;
    for (int i = 0; i < w->part.r; i++)
        if (w->guess->hold[w->part.v[i]])
            return false;
    return true;
}

/* Where KINSOL is of no use or fails, Gauss-Newton goes on alone. */
static void near_by(work *w)
{
    if (w->large || !choose_dependent(w))
        return;
    int r = w->part.r;
    double *v = KMP_NEW(double, 3 * r), *scale_v = v ? v + r : NULL, *scale_h = v ? v + 2 * r : NULL;
    for (int i = 0; v && i < r; i++) {
        v[i] = w->a->q[w->part.v[i]];
        scale_v[i] = 1 / w->s->scale[w->part.v[i]];
        scale_h[i] = 1 / w->s->row_scale[w->part.rows[i]];
    }
    if (v && kmp_kinsol_solve(w->s->context, r, v, scale_v, scale_h, newton_residual, newton_matrix, w, 1e-12,
                              &w->a->newton) == KEMPE_OK)
        for (int i = 0; i < r; i++)
            w->a->q[w->part.v[i]] = v[i];
    else
        kmp_context_clear(w->s->context);
    w->a->iterations += w->a->newton;
    kmp_free(v);
    evaluate(w, w->a->q);
}

/* Without a bound, while it still helps. The least damping leaves directions alone in which J is rounding. */
static void polish(work *w)
{
    evaluate(w, w->a->q);
    double best = largest(w->m, w->h);
    for (int k = 0; k < MAX_POLISH && best > 0; k++) {
        scaled_jacobian(w);
        if (!damped_step(w, fmax(norm(w->m, w->h), KMP_RANK)))
            return;
        move(w, w->a->q, 1, w->trial);
        evaluate(w, w->trial);
        double now = largest(w->m, w->h);
        w->a->iterations++;
        if (!(now < best))
            break;
        best = now;
        memcpy(w->a->q, w->trial, (size_t)w->n * sizeof *w->trial);
    }
    evaluate(w, w->a->q);
}

/* -- rounded numbers --------------------------------------------------------------------------------- */

/* The rows to drop at the last evaluation, into `dropped`. false: there is no such choice. */
static bool choose_rows(work *w, bool *dropped)
{
    kmp_partition part;
    if (kmp_partition_of_rank(&part, w->s, w->plant->jacobian, w->rank, NULL, 0) != KEMPE_OK) {
        kmp_context_clear(w->s->context);
        return false;
    }
    memset(dropped, 0, (size_t)w->m * sizeof *dropped);
    for (int k = 0; k < w->m - part.r; k++)
        dropped[part.redundant[k]] = true;
    kmp_partition_free(&part);
    return true;
}

/* The independent rows closed, chosen anew until they stay the same. */
static void close_independent(work *w)
{
    bool *before = KMP_NEW(bool, w->m), *dropped = w->a->dropped;
    w->starved = w->starved || !before;
    for (int pass = 0; before && pass < MAX_CHOICES; pass++) {
        w->dropped = NULL;
        evaluate(w, w->a->q);
        memcpy(before, dropped, (size_t)w->m * sizeof *before);
        if (!choose_rows(w, dropped) || (pass > 0 && memcmp(before, dropped, (size_t)w->m * sizeof *before) == 0))
            break;
        w->dropped = dropped;
        polish(w);
    }
    w->dropped = dropped;
    evaluate(w, w->a->q);
    kmp_free(before);
}

/* -- spherical joints -------------------------------------------------------------------------------- */

/* Those whose angles are nearly singular in the guess begin in the middle of another chart; one of which only some
 * angles are held stays as it is, and all do where the way to goals is sought. false: no memory. */
static bool center_joints(work *w)
{
    int charts = kmp_charts_count(w->s), centred = 0;
    if (w->guess->goals && w->s->model->start.goal_count > 0)
        return true;
    for (int c = 0; c < charts; c++) {
        const bool *hold = w->guess->hold + w->s->chart_first[c];
        if (hold[0] == hold[1] && hold[1] == hold[2] && kmp_chart_regular(w->s, c, w->a->q) < NEARLY_SINGULAR) {
            kmp_chart_center(w->s, c, w->plant->chart, w->a->q, NULL, NULL);
            centred++;
        }
    }
    if (centred == 0)
        return true;
    kmp_plant_set_charts(w->plant, w->plant->chart);
    w->a->inner_q = KMP_NEW(double, w->n);
    w->a->inner_qd = KMP_NEW(double, w->n);
    w->a->chart = KMP_NEW(double, KMP_CHART_SIZE *charts);
    return w->a->inner_q && w->a->inner_qd && w->a->chart;
}

/* The user's angles of joint c: those of the guess where it did not move. */
static void show_angles(work *w, int c, double angles[3])
{
    int k = w->s->chart_first[c];
    const double *q = w->a->q + k, *from = w->from + k, *guess = w->guess->q + k;
    if (memcmp(q, from, 3 * sizeof *q) == 0) {
        memcpy(angles, guess, 3 * sizeof *q);
        return;
    }
    memcpy(w->trial, w->a->q, (size_t)w->n * sizeof *w->trial);
    (void)kmp_chart_show(w->s, c, w->plant->chart, guess, w->trial, NULL, NULL);
    memcpy(angles, w->trial + k, 3 * sizeof *angles);
}

/* The state as the user counts it; the one in the charts at hand stays beside it. */
static void show_state(work *w)
{
    kempe_assembly *a = w->a;
    if (a->inner_q) {
        memcpy(a->inner_q, a->q, (size_t)w->n * sizeof *a->q);
        memcpy(a->inner_qd, a->qd, (size_t)w->n * sizeof *a->qd);
        memcpy(a->chart, w->plant->chart, (size_t)(KMP_CHART_SIZE * w->s->chart_count) * sizeof *a->chart);
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

/* qd corrected by the least norm over the given columns so that J qd + h_t = 0, damped as in polish; returns what
 * stays. */
static double correct_rates(work *w, const bool *fixed)
{
    double *rate = w->h, *qd = w->a->qd;
    w->free_count = 0;
    for (int k = 0; k < w->n; k++)
        if (!fixed || !fixed[k])
            w->free[w->free_count++] = k;
    for (int pass = 0; pass < 3; pass++) {
        scaled_jacobian(w);
        kmp_plant_rates(w->plant, qd, rate);
        for (int r = 0; r < w->m; r++)
            rate[r] = w->dropped && w->dropped[r] ? 0 : rate[r] / w->s->row_scale[r];
        if (pass == 2 || !damped_step(w, KMP_RANK))
            break;
        move(w, qd, 1, w->trial);
        memcpy(qd, w->trial, (size_t)w->n * sizeof *qd);
    }
    return largest(w->m, rate);
}

/* The model's rates, of centred joints in their charts: one of them given counts as all three. */
static void given_rates(work *w)
{
    const kmp_start *start = &w->s->model->start;
    for (int k = 0; k < w->n; k++) {
        w->a->qd[k] = start->qd[k].value;
        w->fixed[k] = start->qd_given[k];
    }
    for (int c = 0; c < kmp_charts_count(w->s); c++) {
        int k = w->s->chart_first[c];
        if (kmp_chart_is_own(w->plant->chart, c))
            continue;
        double angles[3], rates[3];
        show_angles(w, c, angles);
        memcpy(rates, w->a->qd + k, sizeof rates);
        kmp_chart_enter(w->s, c, w->plant->chart, angles, rates, w->a->q, w->a->qd);
        w->fixed[k] = w->fixed[k + 1] = w->fixed[k + 2] = w->fixed[k] || w->fixed[k + 1] || w->fixed[k + 2];
    }
}

static double fastest(const work *w)
{
    double size = 0;
    for (int k = 0; k < w->n; k++)
        size = fmax(size, fabs(w->a->qd[k]) / w->s->scale[k]);
    for (int r = 0; w->plant->h_t && r < w->m; r++)
        size = fmax(size, fabs(w->plant->h_t[r]) / w->s->row_scale[r]);
    return size;
}

/* Given rates are kept when the closures allow it. */
static void make_rates(work *w)
{
    bool given = false;
    given_rates(w);
    for (int k = 0; k < w->n; k++)
        given = given || w->fixed[k];
    if (w->m == 0)
        return;
    evaluate(w, w->a->q);
    double size = fastest(w), left = correct_rates(w, w->fixed);
    if (given && left > KMP_CLOSED_RATES * fmax(size, fastest(w))) {
        w->a->rates_changed = true;
        given_rates(w);
        left = correct_rates(w, NULL);
    }
    size = fmax(size, fastest(w));
    w->a->rates_left = left > KMP_CLOSED_RATES * size ? left / size : 0;
}

/* -- the verdict ------------------------------------------------------------------------------------- */

/* The gap of each closure as a length, and the open ones by size. */
static void judge(work *w)
{
    kempe_assembly *a = w->a;
    const kempe_model *model = w->s->model;
    a->residual = largest(w->m, w->h);
    for (int r = 0; r < w->m; r++) {
        int c = w->s->rows[r].closure;
        a->open[r] = fabs(w->plant->h[r]) / w->s->row_scale[r];
        a->gaps[c] = hypot(a->gaps[c], a->open[r] * w->s->length);
        a->misfit = w->dropped && w->dropped[r] ? fmax(a->misfit, a->open[r]) : a->misfit;
        a->dropped_count += w->dropped && w->dropped[r];
    }
    a->closed = a->residual <= KMP_CLOSED_ENOUGH && a->misfit * w->s->length <= w->s->closure_tolerance;
    w->starved = !kmp_partition_pivots(w->s, w->plant->jacobian, a->pivots) || w->starved;
    for (int c = 0; c < model->closure_count; c++) {
        a->gap = fmax(a->gap, a->gaps[c]);
        if (a->closed || a->gaps[c] <= KMP_CLOSED_ENOUGH * w->s->length)
            continue;
        int k = a->culprit_count++;
        for (; k > 0 && a->gaps[a->culprits[k - 1]] < a->gaps[c]; k--)
            a->culprits[k] = a->culprits[k - 1];
        a->culprits[k] = c;
    }
}

/* -- all together ------------------------------------------------------------------------------------ */

/* rank < 0: what the system has found. */
static bool work_init(work *w, const kempe_system *s, const kmp_guess *guess, int rank, kempe_assembly *a)
{
    *w = (work){.s = s, .a = a, .guess = guess, .n = s->n, .m = s->m, .plant = kmp_plant_new(s, "tape")};
    const kmp_rounding *rounding = kmp_rounding_of(s);
    w->rank = rank < 0 && rounding ? rounding->rank : rank;
    w->near = w->rank < 0 ? KMP_CLOSED_NEAR : fmax(KMP_CLOSED_NEAR, 2 * s->closure_tolerance / s->length);
    w->free = KMP_NEW(int, s->n);
    w->large = (long)s->m * s->n > DENSE_MOST;
    w->jac = KMP_NEW(double, w->large ? 0 : s->m * s->n);
    w->scaled = KMP_NEW(double, w->large ? 0 : s->m * s->n);
    w->damped = KMP_NEW(double, w->large ? 0 : (s->m + s->n) * s->n);
    w->entry_row = KMP_NEW(int, w->large ? s->jacobian.count : 0);
    w->entry_col = KMP_NEW(int, w->large ? s->jacobian.count : 0);
    w->entry = KMP_NEW(double, w->large ? s->jacobian.count : 0);
    w->place = KMP_NEW(int, s->n);
    w->right = KMP_NEW(double, s->m + s->n);
    w->best = KMP_NEW(double, s->n);
    w->part_wish = KMP_NEW(int, s->n);
    w->h = KMP_NEW(double, s->m);
    w->step = KMP_NEW(double, s->n);
    w->trial = KMP_NEW(double, s->n);
    w->from = KMP_NEW(double, s->n);
    w->fixed = KMP_NEW(bool, s->n);
    if (!w->plant || !w->from || !w->fixed || !w->free || !w->jac || !w->scaled || !w->damped || !w->entry_row ||
        !w->entry_col || !w->entry || !w->place || !w->right || !w->best || !w->part_wish || !w->h || !w->step ||
        !w->trial)
        return false;
    for (int k = 0; k < s->n; k++) {
        a->q[k] = guess->q[k];
        if (!guess->hold[k])
            w->free[w->free_count++] = k;
    }
    bool ok = center_joints(w);
    memcpy(w->from, a->q, (size_t)s->n * sizeof *w->from);
    return ok;
}

static void work_free(work *w)
{
    kmp_plant_free(w->plant);
    if (w->has_part)
        kmp_partition_free(&w->part);
    kmp_free(w->free);
    kmp_free(w->jac);
    kmp_free(w->scaled);
    kmp_free(w->damped);
    kmp_free(w->entry_row);
    kmp_free(w->entry_col);
    kmp_free(w->entry);
    kmp_free(w->place);
    kmp_free(w->right);
    kmp_free(w->best);
    kmp_free(w->part_wish);
    kmp_free(w->h);
    kmp_free(w->step);
    kmp_free(w->trial);
    kmp_free(w->from);
    kmp_free(w->fixed);
}

static void close_near(work *w)
{
    double open = largest(w->m, w->h);
    if (w->rank >= 0 && open <= w->near) {
        close_independent(w);
        return;
    }
    if (open <= w->near && open > KMP_CLOSED_ENOUGH)
        near_by(w);
    polish(w);
}

/* A closed one goes along its branch to where the goals are nearest. false: no memory. */
static bool seek_goals(work *w)
{
    kmp_goals_verdict *goals = &w->a->goals;
    if (!w->guess->goals || goals->count == 0)
        return true;
    if (largest(w->m, w->h) > KMP_CLOSED_ENOUGH)
        return kmp_goals_measure(w->s, w->a->q, goals);
    if (!kmp_goals_seek(w->s, w->guess->hold, w->a->q, goals))
        return false;
    w->a->iterations += goals->steps;
    if (w->dropped)
        close_independent(w);
    else if (w->m > 0)
        polish(w);
    return kmp_goals_measure(w->s, w->a->q, goals);
}

/* false: no memory. */
static bool assemble(work *w)
{
    if (w->m > 0) {
        from_afar(w);
        close_near(w);
    }
    if (!seek_goals(w))
        return false;
    judge(w);
    if (w->a->closed)
        make_rates(w);
    show_state(w);
    return !w->starved;
}

kempe_status kmp_assemble_of_rank(const kempe_system *system, const kmp_guess *guess, int rank,
                                  kempe_assembly **assembly)
{
    work w = {0};
    kempe_assembly *a = kmp_assembly_new(system);
    if (!a || !work_init(&w, system, guess, rank, a) || !assemble(&w)) {
        work_free(&w);
        kempe_assembly_free(a);
        return kmp_fail_memory(system->context);
    }
    work_free(&w);
    *assembly = a;
    return KEMPE_OK;
}

kempe_status kmp_assemble_from(const kempe_system *system, const kmp_guess *guess, kempe_assembly **assembly)
{
    return kmp_assemble_of_rank(system, guess, -1, assembly);
}
