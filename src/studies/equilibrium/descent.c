/* SPDX-License-Identifier: BSD-3-Clause */
/* The state of a search for an equilibrium: its unknowns, residual and matrices in characteristic units. Unknowns are
 * the positions u_k, or rates in their place; held rates are left out. */
#include "studies/equilibrium/descent.h"
#include "base/memory.h"
#include "constraints/closing/charts.h"
#include "constraints/tolerances.h"
#include "linalg/dot.h"
#include <math.h>
#include <string.h>

#define ELSEWHERE 0.3  /* rad, or characteristic lengths */
#define UNCHANGED 1e-9 /* of R there, relative to the forces that act */
#define SLACK     1e-4 /* relative to the largest work: smaller works count as rounding */

bool kmp_descent_init(kmp_descent *w)
{
    int n = w->n;
    KMP_ARENA_MAKE(&w->arena,
                   KMP_ROOM(double, n, &w->q, &w->begin, &w->rates, &w->work, &w->size, &w->values, &w->right, &w->step,
                            &w->force, &w->move, &w->trial),
                   KMP_ROOM(double, n *n, &w->matrix, &w->vectors, &w->factors),
                   KMP_ROOM(int, n, &w->pivot, &w->place, &w->rate),
                   KMP_ROOM(double, w->search->rate_count, &w->given));
    for (int k = 0; w->given && k < w->search->rate_count; k++)
        w->given[k] = w->search->rates[k].rate;
    size_t charts = KMP_CHART_SIZE * (size_t)w->l->system->chart_count;
    if (charts > 0)
        w->given_chart = KMP_ARENA_NEW(&w->arena, double, charts);
    if (w->given_chart)
        memcpy(w->given_chart, w->l->eval->chart, charts * sizeof *w->given_chart);
    return !w->arena.failed;
}

void kmp_descent_give_up(kmp_descent *w)
{
    for (int k = 0; w->given && k < w->search->rate_count; k++)
        w->search->rates[k].rate = w->given[k];
    if (w->given_chart)
        kmp_eval_set_charts(w->l->eval, w->given_chart);
}

/* -- the measure of R -------------------------------------------------------------------------------- */

double kmp_descent_scale(const kmp_linear *l, int k)
{
    return l->system->scale[l->part.u[k]];
}

/* The equation of a state has a unit of its own: its terms are no work that others compare with. */
static bool is_state(const kmp_linear *l, int k)
{
    return kmp_state_of(l->system->model, l->part.u[k]) != NULL;
}

/* The forces along u_k, and their changes by a unit of each coordinate and each current rate, as work. Of a state: its
 * rate, and the changes of this rate by the coordinates and by the size of each state, times its own size. */
static double work_of(const kmp_linear *l, int k)
{
    double acting = 0, row = 0, column = 0, s = kmp_descent_scale(l, k);
    for (int i = 0; i < l->n; i++)
        acting += fabs(l->red.x[i + k * l->n] * l->force[i]) * s;
    for (int j = 0; j < l->p; j++) {
        double rate = fabs(l->qd[l->part.u[j]]);
        bool states = is_state(l, k) && is_state(l, j);
        acting += fabs(l->damping[k + j * l->p]) * (states ? fmax(rate, kmp_descent_scale(l, j)) : rate) * s;
        row += fabs(l->stiffness[k + j * l->p]) * s * kmp_descent_scale(l, j);
        column += fabs(l->stiffness[j + k * l->p]) * s * kmp_descent_scale(l, j);
    }
    return acting + fmax(row, column);
}

double kmp_descent_measure(const kmp_linear *l, double *work, double *most)
{
    double worst = 0;
    *most = 0;
    for (int k = 0; k < l->p; k++) {
        work[k] = work_of(l, k);
        *most = fmax(*most, is_state(l, k) ? 0 : work[k]);
    }
    for (int k = 0; k < l->p; k++) {
        work[k] += is_state(l, k) ? 0 : SLACK * *most;
        if (work[k] > 0)
            worst = fmax(worst, fabs(l->residual[k]) * kmp_descent_scale(l, k) / work[k]);
    }
    return worst;
}

double kmp_equilibrium_residual(const kmp_linear *linear)
{
    double most;
    return kmp_descent_measure(linear, linear->unit, &most);
}

bool kmp_descent_is_idle(const kmp_linear *l, int k, const double *work)
{
    if (kmp_state_of(l->system->model, l->part.u[k]))
        return false;
    for (int i = 0; i < l->p; i++)
        if (fabs(l->stiffness[i + k * l->p]) * kmp_descent_scale(l, i) * kmp_descent_scale(l, k) >
            KMP_WAY_FLAT * work[i])
            return false;
    return true;
}

/* True if R is unchanged when u_k moves: q, ud and R, zero except along held coordinates, are the state's. */
static bool stays(kmp_linear *l, const double *q, const double *ud, const double *residual, int k, const double *work,
                  double *moved)
{
    int c = l->part.u[k];
    memcpy(moved, q, (size_t)l->n * sizeof *moved);
    moved[c] += ELSEWHERE * l->system->scale[c];
    bool same = kmp_linear_at(l, l->t, moved, ud, NULL) == KEMPE_OK;
    for (int i = 0; same && i < l->p; i++)
        same = fabs(l->residual[i] - residual[i]) * kmp_descent_scale(l, i) <= UNCHANGED * work[i];
    return same;
}

int kmp_equilibrium_idle(kmp_linear *linear, int *idle)
{
    kmp_linear *l = linear;
    int n = l->n, count = 0, candidates = 0;
    double *q = KMP_NEW(double, 5 * n), most;
    if (!q)
        return -1;
    double *ud = q + n, *work = ud + n, *moved = work + n, *residual = moved + n;
    (void)kmp_descent_measure(l, work, &most);
    memcpy(q, l->q, (size_t)n * sizeof *q);
    memcpy(residual, l->residual, (size_t)l->p * sizeof *residual);
    for (int k = 0; k < l->p; k++) {
        ud[k] = l->qd[l->part.u[k]];
        if (kmp_descent_is_idle(l, k, work))
            idle[candidates++] = k;
    }
    for (int i = 0; i < candidates; i++)
        if (stays(l, q, ud, residual, idle[i], work, moved))
            idle[count++] = l->part.u[idle[i]];
    bool back = candidates == 0 || kmp_linear_at(l, l->t, q, ud, NULL) == KEMPE_OK;
    if (candidates > 0)
        kmp_linear_matrices(l);
    kmp_free(q);
    return back ? count : -1;
}

/* -- unknowns ---------------------------------------------------------------------------------------- */

double kmp_descent_unit(const kmp_descent *w, int i)
{
    double scale = kmp_descent_scale(w->l, w->place[i]);
    return w->rate[i] < 0 ? scale : fmax(scale, fabs(w->search->rates[w->rate[i]].rate));
}

double kmp_descent_entry(const kmp_descent *w, int row, int column)
{
    const double *from = w->rate[column] < 0 ? w->l->stiffness : w->l->damping;
    return from[w->place[row] + w->place[column] * w->l->p];
}

/* The index of u_k among the steady coordinates; -1: none. */
static int steady_of(const kmp_descent *w, int k)
{
    for (int i = 0; i < w->search->rate_count; i++)
        if (w->search->rates[i].coordinate == w->l->part.u[k])
            return i;
    return -1;
}

/* Determines the unknowns of the current state; changes by rates count as work, too. Returns the residual of their
 * equations, infinite where one is not finite. */
static double take_unknowns(kmp_descent *w)
{
    const kmp_linear *l = w->l;
    double worst = 0;
    w->count = 0;
    for (int k = 0; k < l->p; k++) {
        int steady = steady_of(w, k);
        if (steady >= 0 && w->search->rates[steady].how == KMP_RATE_HELD)
            continue;
        w->place[w->count] = k;
        w->rate[w->count++] = steady >= 0 && w->search->rates[steady].how == KMP_RATE_FREED ? steady : -1;
    }
    for (int i = 0; i < w->count; i++) {
        int k = w->place[i];
        double scale = kmp_descent_scale(l, k);
        for (int j = 0; j < w->count; j++) {
            double changed = fabs(kmp_descent_entry(w, i, j)) * scale * kmp_descent_unit(w, j);
            if (!isfinite(changed))
                return INFINITY;
            if (w->rate[j] >= 0)
                w->work[k] = fmax(w->work[k], changed);
        }
        if (w->work[k] > 0)
            worst = fmax(worst, fabs(l->residual[k]) * scale / w->work[k]);
    }
    return worst;
}

/* -- one state --------------------------------------------------------------------------------------- */

void kmp_descent_take_rates(kmp_descent *w)
{
    for (int k = 0; k < w->l->p; k++) {
        int i = steady_of(w, k);
        w->rates[k] = i < 0 ? 0 : w->search->rates[i].rate;
    }
}

/* A choice with the steady coordinates in it: those columns of J are pivoted last. */
static kempe_status choose_with_steady(kmp_descent *w)
{
    for (int k = 0; k < w->search->rate_count; k++)
        w->pivot[k] = w->search->rates[k].coordinate;
    return kmp_linear_prefer(w->l, w->t, w->q, w->search->rate_count, w->pivot);
}

/* The first of the steady coordinates that is not independent; -1: all are. */
static int find_dependent(const kmp_descent *w)
{
    for (int k = 0; k < w->search->rate_count; k++)
        if (kmp_linear_place(w->l, w->search->rates[k].coordinate) < 0)
            return w->search->rates[k].coordinate;
    return -1;
}

kempe_status kmp_descent_choose(kmp_descent *w)
{
    KMP_TRY(kmp_linear_choose(w->l, w->t, w->q, NULL, 0));
    KMP_TRY(find_dependent(w) >= 0 ? choose_with_steady(w) : KEMPE_OK);
    int dependent = find_dependent(w);
    if (dependent >= 0)
        return kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                        "the closures decide the rate of '%s': it cannot be prescribed with the others",
                        w->l->system->model->motions[dependent].name);
    kmp_descent_take_rates(w);
    return KEMPE_OK;
}

bool kmp_descent_at(kmp_descent *w, const double *q)
{
    return kmp_linear_at(w->l, w->t, q, w->rates, NULL) == KEMPE_OK &&
           isfinite(kmp_dot(w->l->p, w->l->residual, w->l->residual));
}

/* Joints whose angles come near to their singular position begin in the middle of other charts. */
bool kmp_descent_center(kmp_descent *w)
{
    const kempe_system *s = w->l->system;
    bool any = false;
    for (int c = 0; c < kmp_charts_count(s); c++)
        if (kmp_chart_regular(s, c, w->q) < KMP_AXES_CENTRED) {
            kmp_chart_center(s, c, w->l->eval->chart, w->q, NULL, NULL);
            any = true;
        }
    if (any)
        kmp_eval_set_charts(w->l->eval, w->l->eval->chart);
    return any;
}

/* Makes l's state the current one, with its matrices; chooses u again where it has become ill-conditioned. */
bool kmp_descent_arrive(kmp_descent *w)
{
    kmp_linear *l = w->l;
    int v, u;
    memcpy(w->q, l->q, (size_t)w->n * sizeof *w->q);
    for (int k = 0; k < l->p; k++) {
        int steady = steady_of(w, k);
        if (steady >= 0)
            w->search->rates[steady].rate = w->rates[k];
    }
    if (kmp_descent_center(w) || kmp_reduction_growth(&l->red, &v, &u) > KMP_EXCHANGE_STILL) {
        w->status = kmp_descent_choose(w);
        w->search->exchanges++;
        if (w->status != KEMPE_OK || !kmp_descent_at(w, w->q))
            return false;
        memcpy(w->q, l->q, (size_t)w->n * sizeof *w->q);
    }
    kmp_linear_matrices(l);
    (void)kmp_descent_measure(l, w->work, &w->most);
    w->residual = take_unknowns(w);
    memcpy(w->force, l->residual, (size_t)l->p * sizeof *w->force);
    return isfinite(w->residual);
}

bool kmp_descent_press(kmp_descent *w)
{
    w->status = kmp_contact_set_press(w->contacts, w->t, w->q);
    if (w->status == KEMPE_OK)
        w->status = kmp_contact_set_check(w->contacts);
    if (w->status == KEMPE_OK)
        w->status = kmp_descent_choose(w);
    return w->status == KEMPE_OK && kmp_descent_at(w, w->q) && kmp_descent_arrive(w);
}

void kmp_descent_note(kmp_descent *w, double residual)
{
    kmp_search *s = w->search;
    if (s->iterations < KMP_MOST_ITERATIONS) {
        s->steps[s->iterations] = 0;
        s->residuals[s->iterations++] = residual;
    }
    w->reported = residual;
}

void kmp_descent_note_step(kmp_descent *w, double step)
{
    if (w->search->iterations > 0)
        w->search->steps[w->search->iterations - 1] = step;
}

/* -- steps ------------------------------------------------------------------------------------------- */

/* dq of the step, and its length. */
double kmp_descent_spread(kmp_descent *w)
{
    const kmp_linear *l = w->l;
    double far = 0;
    memset(w->move, 0, (size_t)w->n * sizeof *w->move);
    for (int k = 0; k < w->count; k++) {
        for (int i = 0; w->rate[k] < 0 && i < w->n; i++)
            w->move[i] += l->red.x[i + w->place[k] * w->n] * w->step[k];
        far = fmax(far, w->rate[k] < 0 ? 0 : fabs(w->step[k]) / kmp_descent_unit(w, k));
    }
    for (int i = 0; i < w->n; i++) {
        double size = fabs(w->move[i]) / l->system->scale[i];
        far = size > far || !isfinite(size) ? size : far;
    }
    return far;
}

bool kmp_descent_try(kmp_descent *w, double part)
{
    for (int i = 0; i < w->n; i++)
        w->trial[i] = w->q[i] + part * w->move[i];
    for (int k = 0; k < w->count; k++)
        if (w->rate[k] >= 0)
            w->rates[w->place[k]] = w->search->rates[w->rate[k]].rate + part * w->step[k];
    return kmp_descent_at(w, w->trial);
}

/* -- errors ---------------------------------------------------------------------------------------------- */

kempe_status kmp_descent_complain(const kmp_descent *w, const char *why)
{
    const kmp_linear *l = w->l;
    int worst = -1;
    double most = -1;
    for (int i = 0; i < w->count; i++) {
        int k = w->place[i];
        double size = fabs(w->force[k]) * kmp_descent_scale(l, k) / w->work[k];
        if (size > most) {
            most = size;
            worst = k;
        }
    }
    const kmp_motion *m = worst >= 0 ? &l->system->model->motions[l->part.u[worst]] : NULL;
    bool state = worst >= 0 && is_state(l, worst);
    double most_force = worst >= 0 ? w->force[worst] : 0;
    return kmp_fail(l->system->context, KEMPE_E_FAILED,
                    "no equilibrium is found: after %d iterations the residual is %.2e (required: %.0e), most of it "
                    "%s '%s', %.3g %s: %s; %s",
                    w->search->iterations, w->residual, KMP_WAY_BALANCED, state ? "in the rate of the state" : "along",
                    m ? m->name : "", state ? -most_force : most_force,
                    state              ? "per second"
                    : m && m->rotation ? "N m"
                                       : "N",
                    why,
                    w->search->balanced
                        ? "the held coordinates may displace it: hold it too, or start nearer to an equilibrium"
                        : "start from another position");
}
