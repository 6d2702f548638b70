/* SPDX-License-Identifier: BSD-3-Clause */
/* Spherical joints between steps: centred before their angles become singular, and followed in the user's coordinates,
 * which are continuous across changes of charts. */
#include "integrators/run/runner_center.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include "model/data/body.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

/* Over the largest rate: rounding of an equal state. */
#define SAME 1e-7
/* Number of halvings of the path to a row to follow the angles. Angles that are still discontinuous passed their
 * singular position. */
enum { MOST_HALVINGS = 24 };

/* True if a spherical joint has other angles than the user's. */
static bool has_moved(const kmp_runner *run)
{
    return run->eval->chart_version > 0 && !kmp_charts_are_own(run->s, run->eval->chart);
}

/* -- coordinates of the user --------------------------------------------------------------------------- */

/* Follows the user's coordinates to q of the charts, from where q was `before`. false, with nothing changed: the change
 * is too large to be continuous, and `anyhow` is not set. */
static bool follow_angles(kmp_runner *run, const double *q, bool anyhow)
{
    const kempe_system *s = run->s;
    double *seen = run->turned.now, *next = run->turned.next, *before = run->turned.before;
    memcpy(next, q, (size_t)s->n * sizeof *next);
    for (int c = 0; c < kmp_charts_count(s); c++) {
        int first = s->chart_first[c];
        if (!kmp_chart_is_own(run->eval->chart, c) &&
            kmp_chart_follow(s, c, run->eval->chart, before, seen + first, !anyhow, q, next + first) >
                KMP_AXES_NEAR_BY &&
            !anyhow)
            return false;
    }
    memcpy(seen, next, (size_t)s->n * sizeof *seen);
    memcpy(before, q, (size_t)s->n * sizeof *before);
    return true;
}

kempe_status kmp_runner_position(kmp_runner *run, double t, double *q)
{
    KMP_TRY(kmp_runner_dense(run, t));
    run->formulation->position(run->formulation, t, run->room.y, q);
    return KEMPE_OK;
}

kempe_status kmp_runner_place(kmp_runner *run, double t)
{
    KMP_TRY(kmp_runner_position(run, t, run->room.state));
    kmp_eval_closure(run->eval, t, run->room.state);
    return KEMPE_OK;
}

void kmp_runner_follow(kmp_runner *run, double t)
{
    double *q = run->room.state, from = run->turned.t, end = t;
    if (!has_moved(run) || !(from < t) || kmp_runner_position(run, from, run->turned.before) != KEMPE_OK)
        return;
    for (int halvings = 0; run->turned.t < t;) {
        if (kmp_runner_position(run, end, q) != KEMPE_OK)
            return;
        if (!follow_angles(run, q, halvings >= MOST_HALVINGS)) {
            end = from + (end - from) / 2;
            halvings++;
            continue;
        }
        run->turned.t = from = end;
        end = t;
        halvings = 0;
    }
}

void kmp_runner_show(kmp_runner *run, double *q, double *qd, double *qdd)
{
    for (int c = 0; has_moved(run) && c < kmp_charts_count(run->s); c++)
        if (!kmp_chart_is_own(run->eval->chart, c))
            (void)kmp_chart_show(run->s, c, run->eval->chart, run->turned.now + run->s->chart_first[c], q, qd, qdd);
}

/* -- centring ---------------------------------------------------------------------------------------- */

static void note_center(const kmp_runner *run, int c, double t, double regular)
{
    const kempe_model *model = run->s->model;
    kmp_run_log_add(run->log, "centring", t, regular, 1,
                    "inner angles of joint '%s' chosen again far from their singular position (determinant of the axes "
                    "%.3g -> 1); reported angles continue",
                    kmp_model_body(model, kmp_model_motion(model, run->s->chart_first[c])->body)->joint, regular);
}

void kmp_runner_center_start(kmp_runner *run, const kempe_assembly *start)
{
    size_t n = (size_t)run->s->n;
    double *q = run->room.state, *qd = q + n;
    memcpy(run->turned.now, start->q, n * sizeof *q);
    memcpy(q, start->inner_q ? start->inner_q : start->q, n * sizeof *q);
    memcpy(qd, start->inner_q ? start->inner_qd : start->qd, n * sizeof *qd);
    run->turned.t = run->spec.t_start;
    if (start->inner_q)
        kmp_eval_set_charts(run->eval, start->chart);
    for (int c = 0; c < kmp_charts_count(run->s); c++)
        if (!kmp_chart_is_own(run->eval->chart, c) ||
            (!run->spec.own_angles && kmp_chart_regular(run->s, c, q) < KMP_AXES_CENTRED)) {
            kmp_chart_center(run->s, c, run->eval->chart, q, qd, NULL);
            run->centrings++;
            note_center(run, c, run->spec.t_start, kmp_chart_regular(run->s, c, start->q));
        }
    if (run->centrings > 0)
        kmp_eval_set_charts(run->eval, run->eval->chart);
}

/* True if joint c may be centred: none of its coordinates must stay independent. */
static bool may_center(const kmp_runner *run, int c)
{
    int first = run->s->chart_first[c];
    for (int k = 0; run->spec.keep_independent && k < run->part.p; k++)
        if (run->part.u[k] >= first && run->part.u[k] < first + 3)
            return false;
    return true;
}

static bool is_due(const kmp_runner *run, const double *q)
{
    for (int c = 0; c < kmp_charts_count(run->s); c++)
        if (may_center(run, c) && kmp_chart_regular(run->s, c, q) < KMP_AXES_CENTRED)
            return true;
    return false;
}

/* True if the formulation has the given state: its rates are those given. */
static bool is_same(const kmp_runner *run, const double *qd, const double *given)
{
    double most = 0, off = 0;
    for (int i = 0; i < run->s->n; i++) {
        most = fmax(most, fabs(given[i]) / run->s->scale[i]);
        off = fmax(off, isfinite(qd[i]) ? fabs(qd[i] - given[i]) / run->s->scale[i] : INFINITY);
    }
    return off <= SAME * most;
}

/* Sets the formulation's unknowns from the mapped state in run->room.state, and again from the row
 * that it completes, which corrects its predictions. false: the formulation cannot continue. */
static bool resume(kmp_runner *run, double t)
{
    int n = run->s->n;
    double *q = run->room.state, *qd = q + n, *row = run->balance.row, work;
    for (int pass = 0; pass < 2; pass++)
        if (run->formulation->resume(run->formulation, t, q, qd, run->room.y, run->room.yp) != KMP_GO ||
            kmp_formulation_row(run->formulation, t, run->room.y, row, &work) != KMP_GO || !is_same(run, row + n, qd))
            return false;
    return true;
}

/* Centres due joints and joints to be centred with them, from q, qd, qdd on. */
static void center(kmp_runner *run, double t, double *q, double *qd, double *qdd)
{
    for (int c = 0; c < kmp_charts_count(run->s); c++) {
        double regular = kmp_chart_regular(run->s, c, q);
        if (!may_center(run, c) || regular > KMP_AXES_ALONG)
            continue;
        kmp_chart_center(run->s, c, run->eval->chart, q, qd, qdd);
        run->centrings++;
        note_center(run, c, t, regular);
    }
    kmp_eval_set_charts(run->eval, run->eval->chart);
}

/* Centres as after an exchange: a one-step method keeps its step size, others restart. If the present choice of
 * coordinates is not possible in the new charts, another is made. */
kempe_status kmp_runner_center(kmp_runner *run, double t)
{
    double h = t - kmp_runner_t_old(run), *q = run->room.state, *qd = q + run->s->n, work;
    if (kmp_charts_count(run->s) == 0 || run->spec.own_angles || !(h > 0) ||
        kmp_runner_position(run, t, q) != KEMPE_OK || !is_due(run, q))
        return KEMPE_OK;
    KMP_TRY(kmp_runner_inner_row(run, t, true, run->room.state, &work));
    if (!has_moved(run))
        memcpy(run->turned.now, q, (size_t)run->s->n * sizeof *q);
    run->turned.t = t;
    center(run, t, q, qd, run->room.qdd);
    kmp_eval_closure(run->eval, t, q);
    kmp_rank_margin_stand_anew(&run->margin, run->eval);
    if (!resume(run, t))
        return kmp_runner_restart(run, t, run->change_point.near, work, h);
    return kmp_runner_start(run, t, run->room.y, run->room.yp, h);
}
