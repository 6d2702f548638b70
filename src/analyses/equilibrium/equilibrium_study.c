/* SPDX-License-Identifier: BSD-3-Clause */
/* The search for an equilibrium: a state with its unknowns, residual and matrices in characteristic units; Newton's
 * method by damped least squares, with which all searches end; before it, the descent from afar. Unknowns are the
 * positions u_k, or rates in their place; held rates are left out. */
#include "analyses/equilibrium/equilibrium_study.h"
#include "analyses/equilibrium/exchange.h"
#include "analyses/equilibrium/friction_at_rest.h"
#include "analyses/parts/substep.h"
#include "base/arena.h"
#include "base/bracket.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "integrators/run/island_runs.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/lapack.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

typedef struct descent {
    kmp_linear *l;
    kmp_search *search;
    kmp_arena arena;           /* of all arrays */
    kmp_contact_set *contacts; /* NULL: none */
    double t;
    int n;
    double *q;                 /* n: the current state */
    double *begin;             /* n */
    double *given;             /* original values of search->rates */
    double *given_chart;       /* NULL: no joint is spherical */
    double *rates;             /* p: ud */
    double *work;              /* p: forces and their changes along each u, as work */
    double most;               /* the largest of them */
    double residual, reported; /* scaled; as last noted */
    int count;                 /* unknowns, and as many equations R = 0 */
    int *place;                /* count: the index of each unknown in u */
    int *rate;                 /* count: the entry of search->rates that is unknown in place of the position; -1 */
    double *size;              /* count: of a step's unknowns, their units */
    double *matrix, *vectors, *factors; /* count x count */
    double *values, *right;             /* count */
    double *step;                       /* count: of the unknowns, their units */
    double *force;                      /* p: R at the current state */
    double *move, *trial;               /* n */
    int *pivot;                         /* p */
    double least;                       /* least eigenvalue of the scaled Kr */
    bool flat;
    double bound;
    kempe_status status; /* of errors other than failure to converge */
} descent;

#define BALANCED    1e-10 /* residual of an equilibrium */
#define FIRST_BOUND 0.3   /* of a step: rad, or characteristic lengths */
#define ELSEWHERE   0.3   /* rad, or characteristic lengths */
#define NO_CHANGE   1e-9  /* of R there, relative to the forces that act */
#define SLACK       1e-4  /* relative to the largest work: smaller works count as rounding */

static bool descent_init(descent *w)
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

/* -- the measure of R -------------------------------------------------------------------------------- */

double kmp_descent_scale(const kmp_linear *l, int k)
{
    return l->system->scale[l->part.u[k]];
}

/* The equation of a state has a separate unit: its terms are not a work that others compare with. */
static bool is_state(const kmp_linear *l, int k)
{
    return kmp_state_of(l->system->model, l->part.u[k]) != NULL;
}

double kmp_descent_measure(const kmp_linear *l, double *work, double *most)
{
    double worst = 0;
    *most = 0;
    for (int k = 0; k < l->p; k++) {
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
        work[k] = acting + fmax(row, column);
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

int kmp_equilibrium_idle(kmp_linear *l, int *idle)
{
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
    /* Parameters that leave R, zero except along held coordinates, as it is when they move. */
    for (int i = 0; i < candidates; i++) {
        int c = l->part.u[idle[i]];
        memcpy(moved, q, (size_t)n * sizeof *moved);
        moved[c] += ELSEWHERE * l->system->scale[c];
        bool same = kmp_linear_residual_at(l, l->t, moved, ud) == KEMPE_OK;
        for (int k = 0; same && k < l->p; k++)
            same = fabs(l->residual[k] - residual[k]) * kmp_descent_scale(l, k) <= NO_CHANGE * work[k];
        if (same)
            idle[count++] = c;
    }
    bool back = candidates == 0 || kmp_linear_at(l, l->t, q, ud, NULL) == KEMPE_OK;
    if (candidates > 0)
        kmp_linear_matrices(l);
    kmp_free(q);
    return back ? count : -1;
}

/* -- unknowns ---------------------------------------------------------------------------------------- */

/* The unit of unknown i: the characteristic size of a position; for a rate one such size per second, or the rate
 * itself if larger. */
static double descent_unit(const descent *w, int i)
{
    double scale = kmp_descent_scale(w->l, w->place[i]);
    return w->rate[i] < 0 ? scale : fmax(scale, fabs(w->search->rates[w->rate[i]].rate));
}

/* The derivative of the equation of unknown `row` by unknown `column`. */
static double descent_entry(const descent *w, int row, int column)
{
    const double *from = w->rate[column] < 0 ? w->l->stiffness : w->l->damping;
    return from[w->place[row] + w->place[column] * w->l->p];
}

/* The index of u_k among the steady coordinates; -1: none. */
static int steady_of(const descent *w, int k)
{
    for (int i = 0; i < w->search->rate_count; i++)
        if (w->search->rates[i].coordinate == w->l->part.u[k])
            return i;
    return -1;
}

/* Determines the unknowns of the current state; changes by rates count as work, too. Returns the residual of their
 * equations, infinite if an entry is not finite. */
static double take_unknowns(descent *w)
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
            double changed = fabs(descent_entry(w, i, j)) * scale * descent_unit(w, j);
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

/* The rates of the steady coordinates are others now. */
static void descent_take_rates(descent *w)
{
    for (int k = 0; k < w->l->p; k++) {
        int i = steady_of(w, k);
        w->rates[k] = i < 0 ? 0 : w->search->rates[i].rate;
    }
}

/* The first of the steady coordinates that is not independent; -1: all are. */
static int find_dependent(const descent *w)
{
    for (int k = 0; k < w->search->rate_count; k++)
        if (kmp_linear_place(w->l, w->search->rates[k].coordinate) < 0)
            return w->search->rates[k].coordinate;
    return -1;
}

/* Chooses u at w->q, with the steady coordinates in it. */
static kempe_status descent_choose(descent *w)
{
    KMP_TRY(kmp_linear_choose(w->l, w->t, w->q, NULL, 0));
    if (find_dependent(w) >= 0) {
        /* A choice with the steady coordinates in it: those columns of J are pivoted last. */
        for (int k = 0; k < w->search->rate_count; k++)
            w->pivot[k] = w->search->rates[k].coordinate;
        KMP_TRY(kmp_linear_prefer(w->l, w->t, w->q, w->search->rate_count, w->pivot));
    }
    int dependent = find_dependent(w);
    if (dependent >= 0)
        return kmp_fail(
            w->l->system->context, KEMPE_E_FAILED,
            "the velocity of '%s' follows from the closures: it cannot be prescribed together with the others",
            w->l->system->model->motions[dependent].name);
    descent_take_rates(w);
    return KEMPE_OK;
}

/* Takes l to q. False: impossible. */
static bool descent_at(descent *w, const double *q)
{
    return kmp_linear_at(w->l, w->t, q, w->rates, NULL) == KEMPE_OK &&
           isfinite(kmp_dot(w->l->p, w->l->residual, w->l->residual));
}

/* Joints whose angles come near to their singular position begin in the middle of other charts. */
static bool descent_center(descent *w)
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
static bool descent_arrive(descent *w)
{
    kmp_linear *l = w->l;
    int v, u;
    memcpy(w->q, l->q, (size_t)w->n * sizeof *w->q);
    for (int k = 0; k < l->p; k++) {
        int steady = steady_of(w, k);
        if (steady >= 0)
            w->search->rates[steady].rate = w->rates[k];
    }
    if (descent_center(w) || kmp_reduction_growth(&l->red, &v, &u) > KMP_EXCHANGE_STILL) {
        w->status = descent_choose(w);
        w->search->exchanges++;
        if (w->status != KEMPE_OK || !descent_at(w, w->q))
            return false;
        memcpy(w->q, l->q, (size_t)w->n * sizeof *w->q);
    }
    kmp_linear_matrices(l);
    (void)kmp_descent_measure(l, w->work, &w->most);
    w->residual = take_unknowns(w);
    memcpy(w->force, l->residual, (size_t)l->p * sizeof *w->force);
    return isfinite(w->residual);
}

/* Closes and opens contacts at w->q as their set is now, and makes that state the current one. False: as
 * descent_arrive. */
static bool descent_press(descent *w)
{
    w->status = kmp_contact_set_press(w->contacts, w->t, w->q);
    if (w->status == KEMPE_OK)
        w->status = kmp_contact_set_check(w->contacts);
    if (w->status == KEMPE_OK)
        w->status = descent_choose(w);
    return w->status == KEMPE_OK && descent_at(w, w->q) && descent_arrive(w);
}

static void descent_note(descent *w, double residual)
{
    kmp_search *s = w->search;
    if (s->iterations < KMP_MOST_ITERATIONS) {
        s->steps[s->iterations] = 0;
        s->residuals[s->iterations++] = residual;
    }
    w->reported = residual;
}

static void descent_note_step(descent *w, double step)
{
    if (w->search->iterations > 0)
        w->search->steps[w->search->iterations - 1] = step;
}

/* -- steps ------------------------------------------------------------------------------------------- */

/* dq of the step, and its length. */
static double descent_spread(descent *w)
{
    const kmp_linear *l = w->l;
    double far = 0;
    memset(w->move, 0, (size_t)w->n * sizeof *w->move);
    for (int k = 0; k < w->count; k++) {
        for (int i = 0; w->rate[k] < 0 && i < w->n; i++)
            w->move[i] += l->red.x[i + w->place[k] * w->n] * w->step[k];
        far = fmax(far, w->rate[k] < 0 ? 0 : fabs(w->step[k]) / descent_unit(w, k));
    }
    for (int i = 0; i < w->n; i++) {
        double size = fabs(w->move[i]) / l->system->scale[i];
        far = size > far || !isfinite(size) ? size : far;
    }
    return far;
}

/* Takes l to a part of the step. */
static bool descent_try(descent *w, double part)
{
    for (int i = 0; i < w->n; i++)
        w->trial[i] = w->q[i] + part * w->move[i];
    for (int k = 0; k < w->count; k++)
        if (w->rate[k] >= 0)
            w->rates[w->place[k]] = w->search->rates[w->rate[k]].rate + part * w->step[k];
    return descent_at(w, w->trial);
}

/* -- errors ---------------------------------------------------------------------------------------------- */

static kempe_status descent_complain(const descent *w, const char *why)
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
                    w->search->iterations, w->residual, BALANCED, state ? "in the rate of the state" : "along",
                    m ? m->name : "", state ? -most_force : most_force,
                    state              ? "per second"
                    : m && m->rotation ? "N m"
                                       : "N",
                    why,
                    w->search->balanced
                        ? "the held coordinates may displace it: hold it too, or start nearer to an equilibrium"
                        : "start from another position");
}

/* -- Newton's method by damped least squares --------------------------------------------------------- */

/* Newton's method on R, and on targets, over the unknowns of the search and the released quantities. Least squares,
 * damped as far as a bound on the step requires (Levenberg, Marquardt). The rows may outnumber the unknowns where rows
 * of R are redundant, and coordinates that nothing depends on stay where they are. Derivatives are exact. */

enum { MOST_STEPS = 100, MOST_OF_PART = 25, MOST_DAMPINGS = 60, MOST_POLISH = 6, CLOSINGS = 2 };

#define LARGEST       1.0 /* rad, or characteristic lengths */
#define SMALLEST      1e-7
#define SMALLEST_PART 1e-3
#define DEPENDENT     1e-8

typedef struct solver {
    descent *w;
    kmp_exchange *x;
    int p, rows, columns, shown; /* p: unknowns of the search */
    double *jacobian;            /* rows x columns, scaled */
    double *value, *row_size;    /* rows */
    double *column_size;         /* columns */
    double *damped, *right;      /* (rows + columns) x columns; rows + columns */
    double *step;                /* columns, scaled */
    double *moves;               /* n x columns: dq of each */
    double *unit;                /* n: a change of u or ud */
    double *dqd, *dqdd;          /* n */
    double *dlambda;             /* m */
    double *partial;             /* 3 m + n */
    double *along;               /* shown */
    double *dr;                  /* p */
    double *kept, *good;         /* states to come back to: before a step; the last that met its targets */
    double *from, *to;           /* targets */
} solver;

/* -- the equations ----------------------------------------------------------------------------------- */

/* All rows at l's state, in the current sizes; returns the largest. */
static double evaluate(solver *s, double *value)
{
    const kmp_linear *l = s->w->l;
    kmp_instant at = kmp_linear_instant(l);
    const double *shown = s->shown > 0 ? kmp_slopes_values(&s->x->slopes->outputs, &at) : NULL;
    double worst = 0;
    for (int k = 0; k < s->p; k++)
        value[k] = l->residual[s->w->place[k]] / s->row_size[k];
    for (int k = 0; k < s->x->target_count; k++) {
        const kmp_exchange_target *t = &s->x->target[k];
        double reached = t->coordinate >= 0 ? l->q[t->coordinate] : shown ? shown[t->shown] : NAN;
        value[s->p + k] = (reached - t->value) / s->row_size[s->p + k];
    }
    for (int k = 0; k < s->rows; k++)
        worst = fabs(value[k]) > worst || !isfinite(value[k]) ? fabs(value[k]) : worst;
    return isfinite(worst) ? worst : INFINITY;
}

/* The change by one unit of unknown j: of a position, a rate, or a released quantity. */
static kmp_change change_by(solver *s, int j)
{
    const descent *w = s->w;
    int parameter = j - s->p, rate = parameter - s->x->parameter_count;
    memset(s->unit, 0, (size_t)w->n * sizeof *s->unit);
    if (parameter >= 0 && rate < 0)
        return kmp_slopes_change(s->x->slopes, parameter, s->partial);
    if (parameter < 0)
        s->unit[w->place[j]] = descent_unit(w, j);
    for (int k = 0; rate >= 0 && k < w->l->p; k++)
        s->unit[k] = w->l->part.u[k] == w->search->rates[s->x->rate[rate]].coordinate;
    return parameter < 0 && w->rate[j] < 0 ? (kmp_change){.u = s->unit} : (kmp_change){.ud = s->unit};
}

/* The size of a target, by its changes with the coordinates. */
static double target_size(const solver *s, int row)
{
    const kmp_exchange_target *t = &s->x->target[row - s->p];
    double sum = 0;
    if (t->coordinate >= 0)
        return s->w->l->system->scale[t->coordinate];
    for (int j = 0; j < s->p; j++)
        sum += fabs(s->jacobian[row + j * s->rows]);
    return sum > 0 ? sum : t->value != 0 ? fabs(t->value) : 1;
}

static void linearise(solver *s)
{
    kmp_linear *l = s->w->l;
    kmp_instant at = kmp_linear_instant(l);
    s->p = s->w->count;
    s->rows = s->p + s->x->target_count;
    s->columns = s->p + s->x->free_count;
    if (s->x->slopes)
        kmp_slopes_at(s->x->slopes, &at);
    if (s->shown > 0)
        (void)kmp_slopes_values(&s->x->slopes->outputs, &at);
    /* The changes of all rows, and of q, by one unit of each unknown. */
    for (int j = 0; j < s->columns; j++) {
        double *move = s->moves + j * l->n, *column = s->jacobian + j * s->rows;
        kmp_change change = change_by(s, j);
        kmp_linear_follow(l, &change, &(kmp_response){move, s->dqd, s->dqdd, s->dlambda, s->dr});
        if (s->shown > 0)
            kmp_slopes_along(s->x->slopes, &s->x->slopes->outputs,
                             &(kmp_direction){NULL, move, s->dqd, s->dqdd, s->dlambda, NULL},
                             j < s->p + s->x->parameter_count ? j - s->p : -1, s->along);
        for (int k = 0; k < s->p; k++)
            column[k] = s->dr[s->w->place[k]];
        for (int k = 0; k < s->x->target_count; k++) {
            const kmp_exchange_target *t = &s->x->target[k];
            column[s->p + k] = t->coordinate >= 0 ? move[t->coordinate] : s->along[t->shown];
        }
    }
    for (int i = 0; i < s->rows; i++) {
        int k = i < s->p ? s->w->place[i] : 0;
        s->row_size[i] = i >= s->p           ? target_size(s, i)
                         : s->w->work[k] > 0 ? s->w->work[k] / kmp_descent_scale(l, k)
                                             : 1;
    }
    for (int j = 0; j < s->columns; j++) {
        double most = 0, *column = s->jacobian + j * s->rows;
        for (int i = 0; i < s->rows; i++) {
            column[i] /= s->row_size[i];
            most = fmax(most, fabs(column[i]));
        }
        s->column_size[j] = j < s->p || most == 0 ? 1 : 1 / most;
        for (int i = 0; i < s->rows; i++)
            column[i] *= s->column_size[j];
        for (int i = 0; i < l->n; i++)
            s->moves[i + j * l->n] *= s->column_size[j];
    }
}

/* -- steps ------------------------------------------------------------------------------------------- */

static double norm(int n, const double *x)
{
    return sqrt(kmp_dot(n, x, x));
}

/* The step of least |J s + f|^2 + |damping s|^2. false: no memory. */
static bool damped_step(solver *s, double damping)
{
    int rows = s->rows, all = rows + s->columns;
    memset(s->damped, 0, (size_t)(all * s->columns) * sizeof *s->damped);
    memset(s->right, 0, (size_t)all * sizeof *s->right);
    for (int j = 0; j < s->columns; j++) {
        memcpy(s->damped + j * all, s->jacobian + j * rows, (size_t)rows * sizeof *s->damped);
        s->damped[rows + j + j * all] = damping;
    }
    for (int i = 0; i < rows; i++)
        s->right[i] = -s->value[i];
    return kmp_least_squares(all, s->columns, s->damped, s->right, KMP_RANK, s->step) >= 0;
}

/* Converts the step to dq, and returns its length: released quantities count relative to their values. */
static double spread_all(solver *s)
{
    descent *w = s->w;
    double far = 0;
    for (int j = 0; j < s->p; j++) {
        w->step[j] = s->step[j] * descent_unit(w, j);
        far = fmax(far, w->rate[j] < 0 ? 0 : FIRST_BOUND * fabs(s->step[j]));
    }
    for (int i = 0; i < w->n; i++) {
        w->move[i] = 0;
        for (int j = 0; j < s->columns; j++)
            w->move[i] += s->moves[i + j * w->n] * s->step[j];
        double size = fabs(w->move[i]) / w->l->system->scale[i];
        far = size > far || !isfinite(size) ? size : far;
    }
    for (int f = 0; f < s->x->free_count; f++) {
        double value = fabs(s->x->value[f]), change = fabs(s->column_size[s->p + f] * s->step[s->p + f]);
        if (value > 0)
            far = fmax(far, FIRST_BOUND * change / value);
    }
    return far;
}

static bool bounded_step(solver *s, double bound, double *far)
{
    double damping = 0;
    for (int k = 0; k < MOST_DAMPINGS; k++) {
        if (!damped_step(s, damping))
            return false;
        *far = spread_all(s);
        if (*far <= bound)
            return true;
        damping = damping > 0 ? 3 * damping : 1e-8;
    }
    return true;
}

/* The residual predicted after a step. */
static double promise(const solver *s)
{
    double sum = 0;
    for (int i = 0; i < s->rows; i++) {
        double left = s->value[i];
        for (int j = 0; j < s->columns; j++)
            left += s->jacobian[i + j * s->rows] * s->step[j];
        sum += left * left;
    }
    return sqrt(sum);
}

static bool set_free(solver *s, const double *value)
{
    bool set = kmp_exchange_set(s->x, value, s->w->l, s->w->search->rates);
    if (set)
        descent_take_rates(s->w);
    return set;
}

/* Takes l to the end of the step; the values there in s->right. */
static double try_step(solver *s)
{
    for (int k = 0; k < s->x->free_count; k++)
        s->x->trial[k] = s->x->value[k] + s->column_size[s->p + k] * s->step[s->p + k];
    if (!set_free(s, s->x->trial) || !descent_try(s->w, 1))
        return INFINITY;
    double worst = evaluate(s, s->right);
    return worst < INFINITY ? norm(s->rows, s->right) : INFINITY;
}

static bool accept(solver *s)
{
    for (int k = 0; k < s->x->free_count; k++)
        s->x->value[k] = s->x->trial[k];
    return descent_arrive(s->w);
}

static bool go_back(solver *s)
{
    return set_free(s, s->x->value) && descent_at(s->w, s->w->q) && descent_arrive(s->w);
}

/* Saves the current state in `to`: q, released quantities, rates. */
static void save(const solver *s, double *to)
{
    const kmp_search *search = s->w->search;
    memcpy(to, s->w->q, (size_t)s->w->n * sizeof *to);
    to += s->w->n;
    for (int k = 0; k < s->x->free_count; k++)
        *to++ = s->x->value[k];
    for (int k = 0; k < search->rate_count; k++)
        *to++ = search->rates[k].rate;
}

static bool restore(solver *s, const double *from)
{
    kmp_search *search = s->w->search;
    memcpy(s->w->q, from, (size_t)s->w->n * sizeof *from);
    from += s->w->n;
    for (int k = 0; k < s->x->free_count; k++)
        s->x->value[k] = *from++;
    for (int k = 0; k < search->rate_count; k++)
        search->rates[k].rate = *from++;
    return go_back(s);
}

static bool damped_down(solver *s, double *bound)
{
    double before = norm(s->rows, s->value), far;
    for (; *bound > SMALLEST; *bound *= 0.4) {
        if (!bounded_step(s, *bound, &far)) {
            s->w->status = kmp_fail_memory(s->w->l->system->context);
            return false;
        }
        double promised = before - promise(s), gained = before - try_step(s);
        if (promised > 0 && gained > 0.1 * promised) {
            if (gained > 0.6 * promised)
                *bound = fmin(2 * *bound, LARGEST);
            descent_note_step(s->w, far);
            return accept(s);
        }
        if (!go_back(s) || !(promised > 0))
            return false;
    }
    return false;
}

/* -- iteration --------------------------------------------------------------------------------------- */

static double take(solver *s)
{
    linearise(s);
    return s->w->residual = evaluate(s, s->value);
}

static kempe_status complain(const solver *s)
{
    const descent *w = s->w;
    int worst = 0;
    if (!w->search->exchange)
        return descent_complain(w, "Newton's method makes no further progress");
    for (int k = 0; k < s->rows; k++)
        if (fabs(s->value[k]) > fabs(s->value[worst]))
            worst = k;
    bool target = worst >= s->p;
    return kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                    "no equilibrium is found: after %d iterations %s '%s' has a relative error of %.2e (required: "
                    "%.0e)%s%s: check that the unknowns attain the held and target values, or start nearer",
                    w->search->iterations, target ? "the value of" : "the balance along",
                    target ? s->x->target[worst - s->p].name
                           : w->l->system->model->motions[w->l->part.u[w->place[worst]]].name,
                    fabs(s->value[worst]), BALANCED, s->x->why.s ? "; further progress is impossible: " : "",
                    s->x->why.s ? s->x->why.s : "");
}

/* Released quantities must be determined: no combination of the other unknowns may have the same effect. */
static kempe_status check_determined(solver *s)
{
    kempe_context *context = s->w->l->system->context;
    for (int f = 0; f < s->x->free_count; f++) {
        int others = 0;
        const double *own = s->jacobian + (s->p + f) * s->rows;
        for (int j = 0; j < s->columns; j++)
            if (j != s->p + f)
                memcpy(s->damped + others++ * s->rows, s->jacobian + j * s->rows, (size_t)s->rows * sizeof *s->damped);
        KMP_TRY(kmp_made(context, kmp_least_squares(s->rows, others, s->damped, own, KMP_RANK, s->step) >= 0));
        double left = 0;
        for (int i = 0; i < s->rows; i++) {
            double sum = own[i];
            for (int j = 0; j < others; j++)
                sum -= s->damped[i + j * s->rows] * s->step[j];
            left = fmax(left, fabs(sum));
        }
        if (left <= DEPENDENT)
            return kmp_fail(
                context, KEMPE_E_FAILED,
                "--solve-for: '%s' is not determined: %s; add a held or target value, or remove it from --solve-for",
                s->x->name[f],
                norm(s->rows, own) == 0 ? "it has no effect here" : "other unknowns have the same effect");
    }
    return KEMPE_OK;
}

static bool polish(solver *s)
{
    for (int k = 0; k < MOST_POLISH && s->w->residual > 0; k++) {
        double before = s->w->residual;
        save(s, s->kept);
        if (!damped_step(s, 0))
            return false;
        double far = spread_all(s);
        if (!(try_step(s) < INFINITY && accept(s) && take(s) < 0.5 * before)) {
            if (!restore(s, s->kept))
                return false;
            (void)take(s);
            return true;
        }
        descent_note_step(s->w, far);
        descent_note(s->w, s->w->residual);
    }
    return true;
}

/* Checks that there are as many equations as unknowns: R of a coordinate that nothing depends on is an additional one.
 */
static kempe_status check_counts(const solver *s)
{
    const descent *w = s->w;
    int idle = 0, most;
    for (int k = 0; k < w->l->p; k++)
        idle += kmp_descent_is_idle(w->l, k, w->work);
    most = s->x->target_count + idle;
    if (s->x->free_count <= most)
        return KEMPE_OK;
    return kmp_fail(w->l->system->context, KEMPE_E_ARGUMENT,
                    "--solve-for: %d additional unknown%s, but %d additional equation%s: give one held or target value "
                    "for each unknown",
                    s->x->free_count, s->x->free_count == 1 ? "" : "s", most, most == 1 ? "" : "s");
}

/* Solves from the current state for the current targets. */
static kempe_status solve_targets(solver *s, int most)
{
    descent *w = s->w;
    double bound = FIRST_BOUND;
    for (int k = 0;; k++) {
        bool reported = k == 0 && w->reported == w->residual;
        if (kmp_interrupted(w->l->system->context))
            return w->status = descent_complain(w, "interrupted");
        double residual = take(s);
        if (!reported)
            descent_note(w, residual);
        if (residual <= BALANCED)
            return KEMPE_OK;
        if (k == most || !damped_down(s, &bound))
            return w->status != KEMPE_OK ? w->status : KEMPE_E_FAILED;
    }
}

/* Moves the targets from their values at the current state to the required ones: at once, or after a failure in smaller
 * and smaller parts. From a state that is not an equilibrium the first part rarely succeeds. */
static kempe_status follow(solver *s)
{
    kmp_adaptive_substeps parts = KMP_PARTS;
    kempe_status status = KEMPE_OK;
    (void)take(s);
    for (int k = 0; k < s->x->target_count; k++) {
        s->to[k] = s->x->target[k].value;
        s->from[k] = s->to[k] + s->value[s->p + k] * s->row_size[s->p + k];
    }
    save(s, s->good);
    while (kmp_substeps_next(&parts, s->x->target_count > 0 ? SMALLEST_PART : 1)) {
        if (status == KEMPE_E_FAILED && !restore(s, s->good))
            return status;
        double part = parts.next;
        for (int k = 0; k < s->x->target_count; k++)
            s->x->target[k].value = s->from[k] + part * (s->to[k] - s->from[k]);
        if (s->x->target_count > 0)
            s->w->search->iterations = 0;
        status = solve_targets(s, parts.next == 1 && parts.done == 0 ? MOST_STEPS : MOST_OF_PART);
        if (status != KEMPE_OK && (status != KEMPE_E_FAILED || s->w->status != KEMPE_OK))
            return status;
        kmp_substeps_take(&parts, status == KEMPE_OK);
        if (status == KEMPE_OK)
            save(s, s->good);
    }
    return status;
}

static kempe_status solve_squares(solver *s)
{
    KMP_TRY(check_counts(s));
    kempe_status status = follow(s);
    if (status == KEMPE_E_FAILED && s->w->status == KEMPE_OK)
        (void)complain(s);
    for (int k = 0; k < s->x->target_count; k++)
        s->x->target[k].value = s->to[k];
    if (status == KEMPE_OK)
        status = check_determined(s);
    if (status == KEMPE_OK && !polish(s))
        status = s->w->status != KEMPE_OK ? s->w->status : kmp_fail_memory(s->w->l->system->context);
    return status;
}

/* Newton's method by damped least squares from the current state, with the additions of w->search->exchange; then to
 * round-off. After a failure the state of l is undefined. */
static kempe_status descent_least(descent *w)
{
    kmp_exchange none = {0};
    solver s = {.w = w, .x = w->search->exchange ? w->search->exchange : &none};
    s.shown = s.x->slopes ? s.x->slopes->shown : 0;
    const int n = w->n, m = w->l->m, freed = s.x->free_count, targets = s.x->target_count;
    const int rows = n + targets, columns = n + freed;
    KMP_TRY(kmp_made(
        w->l->system->context,
        KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, n, &s.unit, &s.dqd, &s.dqdd, &s.dr), KMP_ROOM(double, m, &s.dlambda),
                       KMP_ROOM(double, 3 * m + n, &s.partial), KMP_ROOM(double, rows, &s.value, &s.row_size),
                       KMP_ROOM(double, columns, &s.column_size, &s.step), KMP_ROOM(double, rows *columns, &s.jacobian),
                       KMP_ROOM(double, (rows + columns) * columns, &s.damped),
                       KMP_ROOM(double, rows + columns, &s.right), KMP_ROOM(double, n *columns, &s.moves),
                       KMP_ROOM(double, s.shown, &s.along),
                       KMP_ROOM(double, n + freed + w->search->rate_count, &s.kept, &s.good),
                       KMP_ROOM(double, targets, &s.from, &s.to))));
    KMP_TRY(solve_squares(&s));
    /* The loops are closed to round-off, so that results do not depend on the choice of coordinates. With an
     * ill-conditioned choice each correction is rounded in proportion to the dependent motion. */
    bool there = true;
    for (int k = 0; there && k < CLOSINGS && w->l->m > 0; k++) {
        memcpy(w->trial, w->l->q, (size_t)w->n * sizeof *w->trial);
        there = descent_at(w, w->trial);
    }
    there = there && (w->l->m == 0 || descent_arrive(w));
    return there ? KEMPE_OK : w->status != KEMPE_OK ? w->status : descent_complain(w, "the state is lost");
}

/* -- descent from afar ------------------------------------------------------------------------------ */

/* Descent from afar: Newton's direction with the symmetric part of Kr made positive by the moduli of its eigenvalues
 * (as by Dauphin et al., NIPS 27 (2014) 2933), so that s'R < 0. For a conservative mechanism this descends its
 * potential, for any other it follows a heavily damped motion. A step is bounded. Its length is such that the work s'R
 * along it has fallen to half at its end or is still negative (Matthies and Strang, IJNME 14 (1979) 1613): this needs
 * no potential. If R = 0 and Kr has a negative direction, the state is displaced along it. Newton's steps by least
 * squares end the search. */

enum { MOST_HALVINGS = 40, MOST_PUSHES = 12, MOST_DOWN = KMP_MOST_ITERATIONS - 40 };

#define NEAR          0.003 /* Newton's step at a stable equilibrium, rad or characteristic lengths */
#define STILL         1e-6  /* at any other */
#define SHORT_BOUND   1e-3
#define LONGEST       0.3
#define PUSH          0.05
#define FINE          1e-14 /* of a step that ends at a surface */
#define FARTHEST      1e4   /* a longer path is divergent */
#define RUNAWAY_TURNS 20.0  /* rad: a longer rotation without end is divergent */

/* -- directions -------------------------------------------------------------------------------------- */

/* The scaled Kr of the unknowns, and the eigenvectors and values of its symmetric part. False: no memory. */
static bool decompose(descent *w)
{
    int p = w->count;
    for (int k = 0; k < p; k++)
        w->size[k] = descent_unit(w, k) / (w->work[w->place[k]] > 0 ? sqrt(w->work[w->place[k]]) : 1);
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            w->matrix[i + k * p] = descent_entry(w, i, k) * w->size[i] * w->size[k];
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            w->vectors[i + k * p] = (w->matrix[i + k * p] + w->matrix[k + i * p]) / 2;
    if (p > 0 && kmp_symmetric_eigen(p, w->vectors, w->values) != 0) {
        w->status = kmp_fail_memory(w->l->system->context);
        return false;
    }
    w->least = p > 0 ? w->values[0] : 1;
    w->flat = false;
    for (int k = 0; k < p; k++)
        w->flat = w->flat || fabs(w->values[k]) <= KMP_WAY_FLAT;
    return true;
}

/* The step in w->step by the matrix. False: it has none. */
static bool newton_step(descent *w)
{
    int p = w->count;
    double *factors = w->factors;
    memcpy(factors, w->matrix, (size_t)(p * p) * sizeof *factors);
    if (p > 0 && kmp_lu_factor(p, factors, w->pivot))
        return false;
    for (int k = 0; k < p; k++)
        w->step[k] = -w->right[k];
    kmp_lu_solve(p, factors, w->pivot, 1, w->step);
    return true;
}

/* The descent step in w->step. It is Newton's where the symmetric part of Kr is positive or, if any balance is
 * accepted, where it descends. Otherwise it is the direction of a heavily damped motion. */
static bool find_direction(descent *w)
{
    for (int k = 0; k < w->count; k++)
        w->right[k] = w->force[w->place[k]] * w->size[k];
    if (!w->search->balanced || w->flat || !newton_step(w) || !(kmp_dot(w->count, w->step, w->right) < 0)) {
        /* Makes the symmetric part positive; along flat directions without force the step is zero. */
        int p = w->count;
        for (int k = 0; k < p; k++) {
            const double *v = w->vectors + k * p;
            double value = w->values[k], pull = fabs(kmp_dot(p, v, w->right)), wanted = value;
            if (value < -KMP_WAY_FLAT)
                wanted = -value;
            else if (fabs(value) <= KMP_WAY_FLAT)
                wanted = pull > BALANCED ? KMP_WAY_FLAT : 1;
            for (int j = 0; wanted != value && j < p; j++)
                for (int i = 0; v[j] != 0 && i < p; i++)
                    w->matrix[i + j * p] += (wanted - value) * v[i] * v[j];
        }
        if (!newton_step(w))
            return false;
    }
    for (int k = 0; k < w->count; k++)
        w->step[k] *= w->size[k];
    return true;
}

/* -- steps ----------------------------------------------------------------------------------------------- */

static void shorten(descent *w, double factor)
{
    for (int i = 0; i < w->n; i++)
        w->move[i] *= factor;
    for (int k = 0; k < w->count; k++)
        w->step[k] *= factor;
}

/* s'R of the step, of some R. */
static double work_along(const descent *w, const double *residual)
{
    double sum = 0;
    for (int k = 0; k < w->count; k++)
        sum += w->step[k] * residual[w->place[k]];
    return sum;
}

/* Distance of contact i after a part of the step. */
static double distance_after(descent *w, double part, int i)
{
    bool there = descent_try(w, part);
    kmp_contact_set_look(w->contacts, w->t, w->l->q);
    return there ? w->contacts->gap[i] : -INFINITY;
}

/* The part of the step, from 0 on, at which contact i closes; it overlaps after `part`. */
static double part_to(descent *w, double part, int i)
{
    double x, far = w->contacts->gap[i];
    kmp_contact_set_look(w->contacts, w->t, w->q);
    double near = w->contacts->gap[i];
    if (near <= 0)
        return 0;
    kmp_bracket bracket = kmp_bracket_of(0, near, part, far);
    while (kmp_bracket_next(&bracket, FINE * part, &x)) {
        double gap = distance_after(w, x, i);
        kmp_bracket_take(&bracket, x, gap, gap < 0);
    }
    (void)distance_after(w, bracket.near, i);
    return bracket.near;
}

/* Shortens the step to the first surface that it meets; the contact is w->contacts->struck. */
static double cut(descent *w, double part)
{
    kmp_contact_set *contacts = w->contacts;
    if (!contacts)
        return part;
    contacts->struck = -1;
    kmp_contact_set_look(contacts, w->t, w->l->q);
    for (int i = kmp_contact_set_overlap(contacts); i >= 0 && part > 0; i = kmp_contact_set_overlap(contacts)) {
        contacts->struck = i;
        part = part_to(w, part, i);
    }
    return part;
}

/* The part of the step at which the work has fallen to half or still decreases, or at which surfaces meet. 0: none, or
 * they do at once. */
static double search_line(descent *w)
{
    double first = work_along(w, w->force), part = 1;
    for (int k = 0; k < MOST_HALVINGS; k++) {
        if (!descent_try(w, part)) {
            part /= 2;
            continue;
        }
        part = cut(w, part);
        if (part == 0)
            return 0;
        double last = work_along(w, w->l->residual);
        if (last <= 0.5 * fabs(first))
            return part;
        part *= fmax(0.1, fmin(0.8, first / (first - last)));
    }
    return 0;
}

/* -- forces along a coordinate --------------------------------------------------------------------------- */

/* Forces along a coordinate: the virtual work of gravity, of each force element and of the motion itself on a small
 * change of one independent coordinate. The others are fixed and the closures satisfied. Closures do no work. Each
 * force is evaluated from separate equations, which have only that element. */

#define NOTHING 1e-14 /* in parts of the largest */

enum { GRAVITY = -1, MOTION = -2, USER = -3 };

typedef struct pull {
    int force;     /* of the model, or one of those above */
    double effort; /* N m or N, in the direction of the coordinate */
} pull;

typedef struct load_path {
    pull *pull; /* the nonzero ones, largest first */
    int count;
    double sum;
} load_path;

/* C (n) of a model with only one of its forces (NULL: all of them), at the state of `l` and in its modes. */
static kempe_status evaluate_bias(const kmp_linear *l, const kempe_model *model, const kmp_force *alone, double *bias)
{
    kmp_equations eq;
    kmp_formulas force = {0};
    kmp_instant at = kmp_linear_instant(l);
    kmp_events events = l->system->events; /* the system has recorded all conditions: none is added */
    const kmp_derivation_request scene = {
        .sets = KMP_SET_BIAS, .scheme = KMP_SCHEME_COMPOSITE, .events = &events, .charted = true, .alone = alone};
    KMP_TRY(kmp_equations_derive(&eq, model, &scene));
    bool ok =
        kmp_formulas_init(&force, eq.graph, l->n, eq.dynamics.bias, kmp_backend_find("tape"), l->system->parameters);
    if (ok)
        memcpy(bias, kmp_formulas_at(&force, &at), (size_t)l->n * sizeof *bias);
    kmp_formulas_free(&force);
    kmp_equations_free(&eq);
    return kmp_made(l->system->context, ok);
}

/* The model without forces. */
static kempe_model bare(const kempe_model *model)
{
    kempe_model part = *model;
    for (int i = 0; i < 3; i++)
        part.gravity[i] = (kmp_number){0};
    part.force_count = part.output_count = 0;
    return part;
}

static void add_pull(load_path *path, int force, double effort)
{
    int k = path->count++;
    for (; k > 0 && fabs(path->pull[k - 1].effort) < fabs(effort); k--)
        path->pull[k] = path->pull[k - 1];
    path->pull[k] = (pull){force, effort};
    path->sum += effort;
}

/* The difference of `with` and `without`, along the column x of N. */
static double difference(int n, const double *x, const double *with, const double *without)
{
    return kmp_dot(n, x, without) - kmp_dot(n, x, with);
}

static kempe_status find_pulls(const kmp_linear *l, const double *x, load_path *path, double *with, double *without)
{
    const kempe_model *model = l->system->model;
    kempe_model part = bare(model);
    KMP_TRY(evaluate_bias(l, &part, NULL, without));
    add_pull(path, MOTION, -kmp_dot(l->n, x, without));
    memcpy(part.gravity, model->gravity, sizeof part.gravity);
    KMP_TRY(evaluate_bias(l, &part, NULL, with));
    add_pull(path, GRAVITY, difference(l->n, x, with, without));
    part = bare(model);
    part.force_count = model->force_count;
    for (int k = 0; k < model->force_count; k++) {
        KMP_TRY(evaluate_bias(l, &part, &model->forces[k], with));
        add_pull(path, k, difference(l->n, x, with, without));
    }
    const double *effort = kmp_eval_effort(l->eval, l->t, l->q, l->qd);
    if (effort)
        add_pull(path, USER, kmp_dot(l->n, x, effort));
    while (path->count > 0 && fabs(path->pull[path->count - 1].effort) <= NOTHING * fabs(path->pull[0].effort))
        path->count--;
    return KEMPE_OK;
}

/* Appends the forces along u[k] of the last state: "gravity -9.81 N, 'k' 2 N, together -7.81 N", the nonzero ones,
 * largest first; nothing where there are none. KEMPE_E_MEMORY. */
static kempe_status report_pulls(kmp_text *text, const kmp_linear *linear, int k)
{
    int n = linear->n;
    const kempe_model *model = linear->system->model;
    kmp_arena arena = {0};
    load_path path = {.pull = KMP_ARENA_NEW(&arena, pull, model->force_count + 3)};
    double *with = KMP_ARENA_NEW(&arena, double, n), *without = KMP_ARENA_NEW(&arena, double, n);
    kempe_status status = kmp_made(linear->system->context, !arena.failed);
    if (status == KEMPE_OK)
        status = find_pulls(linear, linear->red.x + k * n, &path, with, without);
    if (status == KEMPE_OK) {
        int coordinate = linear->part.u[k];
        const char *unit = model->motions[coordinate].rotation ? "N m" : "N";
        for (int i = 0; i < path.count; i++) {
            int force = path.pull[i].force;
            kmp_text_put(text, i ? ", " : "");
            if (force >= 0)
                kmp_text_printf(text, "'%s'", model->forces[force].name);
            else
                kmp_text_put(text, force == GRAVITY  ? "gravity"
                                   : force == MOTION ? "its motion"
                                                     : "the force of the caller");
            kmp_text_printf(text, " %.6g %s", path.pull[i].effort, unit);
        }
        if (path.count > 1)
            kmp_text_printf(text, ", together %.6g %s", path.sum, unit);
    }
    kmp_arena_free(&arena);
    return status;
}

/* -- from afar --------------------------------------------------------------------------------------- */

/* The coordinate with the longest path, and its length. */
static int farthest(const descent *w, double *far)
{
    int best = 0;
    *far = 0;
    for (int k = 0; k < w->l->p; k++) {
        int c = w->l->part.u[k];
        double size = fabs(w->q[c] - w->begin[c]) / w->l->system->scale[c];
        if (size > *far) {
            *far = size;
            best = k;
        }
    }
    return best;
}

/* Reports the forces at the start along coordinate u[k], which has moved so far since. */
static kempe_status complain_runaway(descent *w, int k, double far)
{
    kmp_linear *l = w->l;
    int coordinate = l->part.u[k], place = -1;
    const kmp_motion *motion = &l->system->model->motions[coordinate];
    kmp_shown as = kmp_shown_as(l->system->context, motion->rotation ? "rad" : "m");
    kmp_text pulls = {0};
    if (!w->search->quiet && descent_at(w, w->begin))
        place = kmp_linear_place(l, coordinate);
    KMP_TRY(place >= 0 ? report_pulls(&pulls, l, place) : KEMPE_OK);
    (void)kmp_fail(l->system->context, KEMPE_E_FAILED,
                   "no equilibrium: nothing restrains '%s', which moves by %.3g %s%s%s: add a spring, stop or closure, "
                   "start nearer to an equilibrium, or hold it and solve for a load",
                   motion->name, as.factor * far * l->system->scale[coordinate], as.unit,
                   pulls.s ? "; forces along it at the start: " : "", pulls.s ? pulls.s : "");
    kmp_text_free(&pulls);
    return KEMPE_E_FAILED;
}

/* Aside along the direction in which Kr falls most. */
static bool push_aside(descent *w)
{
    int largest = 0;
    for (int k = 0; k < w->count; k++) {
        w->step[k] = w->vectors[k] * w->size[k];
        if (fabs(w->vectors[k]) > fabs(w->vectors[largest]))
            largest = k;
    }
    double far = descent_spread(w);
    shorten(w, (w->vectors[largest] < 0 ? -PUSH : PUSH) / far);
    for (int k = 0; k < MOST_HALVINGS; k++)
        if (descent_try(w, ldexp(1, -k)))
            return descent_arrive(w);
    return false;
}

/* Goes `far` along the current direction. */
static bool go_down(descent *w, double far)
{
    double wanted = far;
    if (!(far < HUGE_VAL))
        return false;
    if (far > w->bound) {
        shorten(w, w->bound / far);
        far = w->bound;
    }
    double part = search_line(w);
    if (w->contacts && w->contacts->struck >= 0) {
        if (part > 0)
            memcpy(w->q, w->l->q, (size_t)w->n * sizeof *w->q);
        w->contacts->closed[w->contacts->struck] = KMP_PRESSED;
        descent_note_step(w, part * far);
        return descent_press(w);
    }
    if (part == 0) {
        descent_take_rates(w);
        (void)descent_at(w, w->q);
        return false;
    }
    if (part == 1 && wanted > w->bound)
        w->bound = w->search->balanced ? fmin(2 * w->bound, LONGEST) : 2 * w->bound;
    else if (part < 1)
        w->bound = fmax(0.5 * w->bound, part * far);
    descent_note_step(w, part * far);
    return descent_arrive(w);
}

/* True if the search has converged. Stiff springs make every residual small: the step measures the distance. A start
 * that is already balanced is reported in any case. */
static bool is_there(const descent *w, double far)
{
    if (w->residual > BALANCED)
        return false;
    if (w->search->balanced)
        return true;
    bool stable = w->least >= -KMP_WAY_FLAT;
    return stable ? far <= (w->flat ? STILL : NEAR) : far <= STILL && w->search->iterations == 1 && !w->search->of_part;
}

static kempe_status descend(descent *w)
{
    int pushes = 0;
    double far;
    while (w->search->iterations < MOST_DOWN) {
        if (kmp_interrupted(w->l->system->context))
            return descent_complain(w, "interrupted");
        if (!decompose(w))
            return w->status;
        descent_note(w, w->residual);
        far = find_direction(w) ? descent_spread(w) : HUGE_VAL;
        if (is_there(w, far))
            return KEMPE_OK;
        bool balanced = w->residual <= BALANCED && far <= STILL;
        bool gone = balanced && pushes < MOST_PUSHES ? push_aside(w) : go_down(w, far);
        pushes += balanced;
        if (!gone)
            return w->status != KEMPE_OK ? w->status : descent_complain(w, "no step reduces the energy further");
        int k = farthest(w, &far);
        if (far > FARTHEST)
            return complain_runaway(w, k, far);
    }
    int k = farthest(w, &far);
    return far > RUNAWAY_TURNS ? complain_runaway(w, k, far) : descent_complain(w, "too many iterations");
}

/* -- by parts ---------------------------------------------------------------------------------------------- */

/* Copies the charts of a part from the whole, or back. */
static void copy_charts(descent *w, kmp_linear *part, const int *motion, bool back)
{
    for (int c = 0; c < part->system->chart_count; c++) {
        double *own = part->eval->chart + (ptrdiff_t)KMP_CHART_SIZE * c;
        const int there = kmp_chart_of(w->l->system, motion[part->system->chart_first[c]]);
        double *other = w->l->eval->chart + (ptrdiff_t)KMP_CHART_SIZE * there;
        memcpy(back ? other : own, back ? own : other, KMP_CHART_SIZE * sizeof *own);
    }
    kmp_evaluator *changed = back ? w->l->eval : part->eval;
    if (part->system->chart_count > 0)
        kmp_eval_set_charts(changed, changed->chart);
}

/* Descends with one part only, from w->q, which receives its equilibrium. It takes the rates of its coordinates from
 * the whole. */
static kempe_status descend_part(descent *w, const kempe_system *s, const int *motion)
{
    kmp_linear linear = {0};
    kmp_arena arena = {0};
    double *q = KMP_ARENA_NEW(&arena, double, s->n);
    kmp_search search = {.rates = KMP_ARENA_NEW(&arena, kmp_steady, s->n),
                         .balanced = w->search->balanced,
                         .quiet = w->search->quiet,
                         .of_part = true};
    int *from = KMP_ARENA_NEW(&arena, int, s->n);
    kempe_status status = kmp_made(s->context, !arena.failed);
    for (int k = 0; status == KEMPE_OK && k < s->n; k++) {
        q[k] = w->q[motion[k]];
        for (int i = 0; i < w->search->rate_count; i++)
            if (w->search->rates[i].coordinate == motion[k]) {
                from[search.rate_count] = i;
                search.rates[search.rate_count] = w->search->rates[i];
                search.rates[search.rate_count++].coordinate = k;
            }
    }
    if (status == KEMPE_OK)
        status = kmp_linear_init(&linear, s, w->l->eval->backend->name);
    if (status == KEMPE_OK) {
        copy_charts(w, &linear, motion, false);
        status = kmp_equilibrium_find(&linear, w->t, q, &search);
    }
    if (status == KEMPE_OK)
        copy_charts(w, &linear, motion, true);
    for (int k = 0; status == KEMPE_OK && k < s->n; k++)
        w->q[motion[k]] = q[k];
    for (int i = 0; status == KEMPE_OK && i < search.rate_count; i++)
        w->search->rates[from[i]].rate = search.rates[i].rate;
    kmp_linear_free(&linear);
    kmp_arena_free(&arena);
    return status;
}

/* Surfaces of one part say nothing about the steps of another: each part descends by itself, and the whole begins
 * where they end. The whole has no equilibrium where a part has none. */
static kempe_status descend_by_parts(descent *w)
{
    const struct kmp_island_systems *parts;
    KMP_TRY(kmp_island_systems_of_states(w->l->system, &parts));
    kempe_status status = KEMPE_OK;
    if (!parts)
        return KEMPE_OK;
    descent_note(w, w->residual);
    for (int i = 0; status == KEMPE_OK && i < kmp_island_systems_count(parts); i++) {
        const int *motion;
        const kempe_system *s = kmp_island_system(parts, i, &motion);
        status = descend_part(w, s, motion);
    }
    KMP_TRY(status);
    kmp_contact_set_touch(w->contacts, w->t, w->q);
    return descent_press(w)        ? KEMPE_OK
           : w->status != KEMPE_OK ? w->status
                                   : descent_complain(w, "a contact cannot be closed");
}

static kempe_status find(descent *w)
{
    memcpy(w->begin, w->q, (size_t)w->n * sizeof *w->q);
    KMP_TRY(kmp_contact_set_begin(w->l, w->t, w->q, w->search->keeps, &w->arena, &w->contacts));
    (void)descent_center(w);
    KMP_TRY(descent_choose(w));
    if (!descent_at(w, w->q) || !descent_arrive(w))
        return w->status != KEMPE_OK ? w->status
                                     : kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                                                "the equations cannot be evaluated at the start: loops that do not "
                                                "close, or numbers that are not finite");
    bool descends = !w->search->newton && !w->search->exchange, agrees = false;
    if (descends && w->contacts && w->residual > BALANCED && !w->search->of_part)
        KMP_TRY(descend_by_parts(w));
    while (!agrees) {
        KMP_TRY(descends ? descend(w) : KEMPE_OK);
        KMP_TRY(descent_least(w));
        /* A contact that overlaps at the equilibrium is closed, or one that pulls is opened. */
        agrees = true;
        KMP_TRY(w->contacts ? kmp_contact_set_exchange(w->contacts, w->l, w->most, &agrees) : KEMPE_OK);
        if (!agrees && !descent_press(w))
            return w->status != KEMPE_OK ? w->status : descent_complain(w, "a contact cannot be closed");
    }
    return KEMPE_OK;
}

static kempe_status find_balance(kmp_linear *linear, double t, double *q, kmp_search *search)
{
    descent w = {.l = linear, .search = search, .t = t, .n = linear->n, .reported = NAN};
    w.bound = search->balanced ? SHORT_BOUND : FIRST_BOUND;
    search->iterations = search->exchanges = 0;
    kempe_status status = descent_init(&w) ? KEMPE_OK : kmp_fail_memory(linear->system->context);
    if (status == KEMPE_OK) {
        memcpy(w.q, q, (size_t)w.n * sizeof *q);
        status = find(&w);
        if (status == KEMPE_E_FAILED && kmp_interrupted(linear->system->context))
            status = KEMPE_STOPPED;
        search->residual = w.residual;
    }
    if (status == KEMPE_OK) {
        memcpy(q, w.q, (size_t)w.n * sizeof *q);
        /* The loads along held coordinates, of R = M qdd + C there. */
        for (int i = 0; i < search->rate_count; i++) {
            int k = kmp_linear_place(linear, search->rates[i].coordinate);
            search->rates[i].load = search->rates[i].how == KMP_RATE_HELD && k >= 0 ? linear->residual[k] : 0;
        }
    } else {
        for (int k = 0; w.given && k < w.search->rate_count; k++)
            w.search->rates[k].rate = w.given[k];
        if (w.given_chart)
            kmp_eval_set_charts(w.l->eval, w.given_chart);
    }
    kmp_contact_set_end(w.contacts);
    kmp_arena_free(&w.arena);
    return status;
}

/* Descends with the states among the unknowns, where that fails by Newton's method from the start. If neither succeeds,
 * the descent gives the reason. */
static kempe_status find_with_states(kmp_linear *linear, double t, double *q, kmp_search *search, kmp_steady *rates)
{
    const kempe_model *model = linear->system->model;
    size_t given = (size_t)search->rate_count * sizeof *rates;
    kmp_search with = *search;
    kempe_status status = KEMPE_E_FAILED;
    char *why = NULL;
    with.rates = rates;
    with.rate_count += model->state_count;
    for (int attempt = search->newton; status == KEMPE_E_FAILED && attempt < 2; attempt++) {
        if (attempt > search->newton) {
            /* A descent that has failed says little about equilibria where states have no energy, or the energy falls
             * without end along forces that are not conservative, such as the forces of a full film. */
            if (model->state_count == 0 && (with.iterations < MOST_DOWN || with.exchange))
                break;
            why = kmp_strdup(kempe_context_message(model->context));
            kmp_context_clear(model->context);
        }
        if (given > 0)
            memcpy(rates, search->rates, given);
        /* States as rates to be found, from their start values, after the first `count` rates. */
        int count = search->rate_count;
        for (int k = 0; k < model->state_count; k++) {
            int motion = kmp_model_coordinates(model) + k;
            rates[count + k] =
                (kmp_steady){.coordinate = motion, .rate = model->start.qd[motion].value, .how = KMP_RATE_FREED};
        }
        with.newton = attempt == 1;
        status = find_balance(linear, t, q, &with);
    }
    if (status == KEMPE_E_FAILED && why) {
        kmp_context_clear(model->context);
        (void)kmp_fail(model->context, status, "%s", why);
    }
    kmp_free(why);
    if (given > 0)
        memcpy(search->rates, rates, given);
    with.rates = search->rates;
    with.rate_count = search->rate_count;
    with.newton = search->newton;
    *search = with;
    return status;
}

kempe_status kmp_equilibrium_find(kmp_linear *linear, double t, double *q, kmp_search *search)
{
    const kempe_model *model = linear->system->model;
    kmp_steady *rates = KMP_NEW(kmp_steady, search->rate_count + model->state_count + 1);
    kempe_status status =
        rates ? find_with_states(linear, t, q, search, rates) : kmp_fail_memory(linear->system->context);
    kmp_free(rates);
    return status;
}
