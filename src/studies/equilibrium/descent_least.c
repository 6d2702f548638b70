/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method on R, and on targets, over the unknowns of the search and the released quantities. Least squares,
 * damped as far as a bound on the step requires (Levenberg, Marquardt). There may be more rows than unknowns where rows
 * of R are redundant, and coordinates that nothing depends on stay where they are. Derivatives are exact. */
#include "base/share.h"
#include "constraints/tolerances.h"
#include "linalg/dense/lapack.h"
#include "linalg/dot.h"
#include "studies/equilibrium/descent.h"
#include "studies/equilibrium/exchange.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 100, MOST_OF_PART = 25, MOST_DAMPINGS = 60, MOST_POLISH = 6, CLOSINGS = 2 };

#define FIRST_BOUND   0.3
#define LARGEST       1.0 /* rad, or characteristic lengths */
#define SMALLEST      1e-7
#define SMALLEST_PART 1e-3
#define DEPENDENT     1e-8

typedef struct solver {
    kmp_descent *w;
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

static bool make_room(solver *s)
{
    int n = s->w->n, m = s->w->l->m, f = s->x->free_count, t = s->x->target_count, r = s->w->search->rate_count;
    int rows = n + t, columns = n + f;
    return KMP_ARENA_MAKE(
        &s->w->arena, KMP_ROOM(double, n, &s->unit, &s->dqd, &s->dqdd, &s->dr), KMP_ROOM(double, m, &s->dlambda),
        KMP_ROOM(double, 3 * m + n, &s->partial), KMP_ROOM(double, rows, &s->value, &s->row_size),
        KMP_ROOM(double, columns, &s->column_size, &s->step), KMP_ROOM(double, rows *columns, &s->jacobian),
        KMP_ROOM(double, (rows + columns) * columns, &s->damped), KMP_ROOM(double, rows + columns, &s->right),
        KMP_ROOM(double, n *columns, &s->moves), KMP_ROOM(double, s->shown, &s->along),
        KMP_ROOM(double, n + f + r, &s->kept, &s->good), KMP_ROOM(double, t, &s->from, &s->to));
}

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

/* The change by one unit of unknown j, of a position or a rate. */
static kmp_change position_or_rate(solver *s, int j)
{
    const kmp_descent *w = s->w;
    s->unit[w->place[j]] = kmp_descent_unit(w, j);
    return w->rate[j] < 0 ? (kmp_change){.u = s->unit} : (kmp_change){.ud = s->unit};
}

/* The change by one unit of a released quantity. */
static kmp_change freed(solver *s, int f)
{
    const kmp_linear *l = s->w->l;
    if (f < s->x->parameter_count)
        return kmp_slopes_change(s->x->slopes, f, s->partial);
    int c = s->w->search->rates[s->x->rate[f - s->x->parameter_count]].coordinate;
    for (int k = 0; k < l->p; k++)
        s->unit[k] = l->part.u[k] == c;
    return (kmp_change){.ud = s->unit};
}

static void fill_column(solver *s, int j)
{
    kmp_linear *l = s->w->l;
    double *move = s->moves + j * l->n, *column = s->jacobian + j * s->rows;
    memset(s->unit, 0, (size_t)l->n * sizeof *s->unit);
    kmp_change change = j < s->p ? position_or_rate(s, j) : freed(s, j - s->p);
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
    for (int j = 0; j < s->columns; j++)
        fill_column(s, j);
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
static double spread(solver *s)
{
    kmp_descent *w = s->w;
    double far = 0;
    for (int j = 0; j < s->p; j++) {
        w->step[j] = s->step[j] * kmp_descent_unit(w, j);
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
        *far = spread(s);
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
        kmp_descent_take_rates(s->w);
    return set;
}

/* Takes l to the end of the step; the values there in s->right. */
static double try_step(solver *s)
{
    for (int k = 0; k < s->x->free_count; k++)
        s->x->trial[k] = s->x->value[k] + s->column_size[s->p + k] * s->step[s->p + k];
    if (!set_free(s, s->x->trial) || !kmp_descent_try(s->w, 1))
        return INFINITY;
    double worst = evaluate(s, s->right);
    return worst < INFINITY ? norm(s->rows, s->right) : INFINITY;
}

static bool accept(solver *s)
{
    for (int k = 0; k < s->x->free_count; k++)
        s->x->value[k] = s->x->trial[k];
    return kmp_descent_arrive(s->w);
}

static bool go_back(solver *s)
{
    return set_free(s, s->x->value) && kmp_descent_at(s->w, s->w->q) && kmp_descent_arrive(s->w);
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

static bool step_down(solver *s, double *bound)
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
            kmp_descent_note_step(s->w, far);
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
    const kmp_descent *w = s->w;
    int worst = 0;
    if (!w->search->exchange)
        return kmp_descent_complain(w, "Newton's method makes no further progress");
    for (int k = 0; k < s->rows; k++)
        if (fabs(s->value[k]) > fabs(s->value[worst]))
            worst = k;
    bool target = worst >= s->p;
    return kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                    "no equilibrium is found for the given unknowns: after %d iterations %s '%s' has a relative error "
                    "of %.2e (required: %.0e)%s%s: check that the held and target values are attainable and that the "
                    "unknowns act on them, or start nearer",
                    w->search->iterations, target ? "the value of" : "the balance along",
                    target ? s->x->target[worst - s->p].name
                           : w->l->system->model->motions[w->l->part.u[w->place[worst]]].name,
                    fabs(s->value[worst]), KMP_WAY_BALANCED, s->x->why.s ? "; further progress is impossible: " : "",
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
        double far = spread(s);
        if (!(try_step(s) < INFINITY && accept(s) && take(s) < 0.5 * before)) {
            if (!restore(s, s->kept))
                return false;
            (void)take(s);
            return true;
        }
        kmp_descent_note_step(s->w, far);
        kmp_descent_note(s->w, s->w->residual);
    }
    return true;
}

/* Checks that there are as many equations as unknowns: R of a coordinate that nothing depends on is an additional one.
 */
static kempe_status check_counts(const solver *s)
{
    const kmp_descent *w = s->w;
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
static kempe_status solve(solver *s, int most)
{
    kmp_descent *w = s->w;
    double bound = FIRST_BOUND;
    for (int k = 0;; k++) {
        bool reported = k == 0 && w->reported == w->residual;
        if (kmp_interrupted(w->l->system->context))
            return w->status = kmp_descent_complain(w, "interrupted");
        double residual = take(s);
        if (!reported)
            kmp_descent_note(w, residual);
        if (residual <= KMP_WAY_BALANCED)
            return KEMPE_OK;
        if (k == most || !step_down(s, &bound))
            return w->status != KEMPE_OK ? w->status : KEMPE_E_FAILED;
    }
}

/* Moves the targets from their values at the current state to the required ones: at once, or after a failure in smaller
 * and smaller parts. From a state that is no equilibrium the first part rarely succeeds. */
static kempe_status follow(solver *s)
{
    kmp_parts parts = KMP_PARTS;
    kempe_status status = KEMPE_OK;
    (void)take(s);
    for (int k = 0; k < s->x->target_count; k++) {
        s->to[k] = s->x->target[k].value;
        s->from[k] = s->to[k] + s->value[s->p + k] * s->row_size[s->p + k];
    }
    save(s, s->good);
    while (kmp_parts_next(&parts, s->x->target_count > 0 ? SMALLEST_PART : 1)) {
        if (status == KEMPE_E_FAILED && !restore(s, s->good))
            return status;
        double part = parts.next;
        for (int k = 0; k < s->x->target_count; k++)
            s->x->target[k].value = s->from[k] + part * (s->to[k] - s->from[k]);
        if (s->x->target_count > 0)
            s->w->search->iterations = 0;
        status = solve(s, parts.next == 1 && parts.done == 0 ? MOST_STEPS : MOST_OF_PART);
        if (status != KEMPE_OK && (status != KEMPE_E_FAILED || s->w->status != KEMPE_OK))
            return status;
        kmp_parts_take(&parts, status == KEMPE_OK);
        if (status == KEMPE_OK)
            save(s, s->good);
    }
    return status;
}

static kempe_status run(solver *s)
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

/* Closes the loops to round-off, so that results do not depend on the choice of coordinates. With an ill-conditioned
 * choice each correction is rounded in proportion to the dependent motion. */
static bool close_well(kmp_descent *w)
{
    for (int k = 0; k < CLOSINGS && w->l->m > 0; k++) {
        memcpy(w->trial, w->l->q, (size_t)w->n * sizeof *w->trial);
        if (!kmp_descent_at(w, w->trial))
            return false;
    }
    return w->l->m == 0 || kmp_descent_arrive(w);
}

kempe_status kmp_descent_least(kmp_descent *w)
{
    kmp_exchange none = {0};
    solver s = {.w = w, .x = w->search->exchange ? w->search->exchange : &none};
    s.shown = s.x->slopes ? s.x->slopes->shown : 0;
    kempe_status status = make_room(&s) ? run(&s) : kmp_fail_memory(w->l->system->context);
    if (status == KEMPE_OK && !close_well(w))
        status = w->status != KEMPE_OK ? w->status : kmp_descent_complain(w, "the state is lost");
    return status;
}
