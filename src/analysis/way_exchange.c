/* SPDX-License-Identifier: BSD-3-Clause */
/* Unknowns exchanged: R and what is fixed and required, over u and what is released. By least squares, damped as far as
 * a bound on the step asks for (Levenberg, Marquardt): rows may be more than unknowns where R says the same twice, and
 * coordinates that nothing depends on stay where they are. Derivatives are exact. */
#include "analysis/exchange.h"
#include "analysis/way.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "linalg/least.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 100, MOST_OF_PART = 25, MOST_DAMPINGS = 60, MOST_POLISH = 6 };

#define FIRST_BOUND   0.3
#define LARGEST       1.0 /* rad, or characteristic lengths */
#define SMALLEST      1e-7
#define SMALLEST_PART 1e-3
#define DEPENDENT     1e-8

typedef struct solver {
    kmp_way *w;
    kmp_exchange *x;
    int p, rows, columns, shown, capacity;
    double *jacobian;          /* rows x columns, scaled */
    double *value, *row_size;  /* rows */
    double *column_size;       /* columns */
    double *damped, *right;    /* (rows + columns) x columns; rows + columns */
    double *step;              /* columns, scaled */
    double *moves;             /* n x columns: dq of each */
    double *unit;              /* columns */
    double *dqd, *dqdd;        /* n */
    double *dlambda;           /* m */
    double *parameters;        /* of a direction of the outputs */
    double *partial;           /* 3 m + n */
    double *along;             /* shown */
    double *dr;                /* p */
    double *kept, *kept_value; /* n; what is free */
    double *good, *good_value; /* the same: the last that met its targets */
    double *from, *to;         /* targets */
} solver;

static bool make_room(solver *s)
{
    size_t n = (size_t)s->w->n, m = (size_t)s->w->l->m, f = (size_t)s->x->free_count, t = (size_t)s->x->target_count;
    size_t rows = n + t, columns = n + f;
    s->jacobian = KMP_NEW(double, rows *columns);
    s->value = KMP_NEW(double, rows);
    s->row_size = KMP_NEW(double, rows);
    s->column_size = KMP_NEW(double, columns);
    s->damped = KMP_NEW(double, (rows + columns) * columns);
    s->right = KMP_NEW(double, rows + columns);
    s->step = KMP_NEW(double, columns);
    s->moves = KMP_NEW(double, n *columns);
    s->unit = KMP_NEW(double, columns);
    s->dqd = KMP_NEW(double, n);
    s->dqdd = KMP_NEW(double, n);
    s->dlambda = KMP_NEW(double, m);
    s->parameters = KMP_NEW(double, f);
    s->partial = KMP_NEW(double, 3 * m + n);
    s->along = KMP_NEW(double, s->shown);
    s->dr = KMP_NEW(double, n);
    s->kept = KMP_NEW(double, n);
    s->kept_value = KMP_NEW(double, f);
    s->good = KMP_NEW(double, n);
    s->good_value = KMP_NEW(double, f);
    s->from = KMP_NEW(double, t);
    s->to = KMP_NEW(double, t);
    return s->jacobian && s->value && s->row_size && s->column_size && s->damped && s->right && s->step && s->moves &&
           s->unit && s->dqd && s->dqdd && s->dlambda && s->parameters && s->partial && s->along && s->dr && s->kept &&
           s->kept_value && s->good && s->good_value && s->from && s->to;
}

static void free_room(solver *s)
{
    double *rooms[] = {s->jacobian, s->value,      s->row_size, s->column_size, s->damped, s->right,
                       s->step,     s->moves,      s->unit,     s->dqd,         s->dqdd,   s->dlambda,
                       s->along,    s->dr,         s->partial,  s->parameters,  s->kept,   s->kept_value,
                       s->good,     s->good_value, s->from,     s->to};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
}

/* -- the equations ----------------------------------------------------------------------------------- */

static kmp_instant instant(const kmp_linear *l)
{
    const kmp_plant *plant = l->plant;
    return (kmp_instant){l->t, l->q, l->qd, l->qdd, l->lambda, NULL, plant->mode, plant->chart, plant->chart_version};
}

/* All rows at l's state, in the sizes at hand; the largest. */
static double evaluate(solver *s, double *value)
{
    const kmp_linear *l = s->w->l;
    kmp_instant at = instant(l);
    const double *shown = s->shown > 0 ? kmp_slopes_values(&s->x->slopes->outputs, &at) : NULL;
    double worst = 0;
    for (int k = 0; k < s->p; k++)
        value[k] = l->residual[k] / s->row_size[k];
    for (int k = 0; k < s->x->target_count; k++) {
        const kmp_target *t = &s->x->target[k];
        double reached = t->coordinate >= 0 ? l->q[t->coordinate] : shown ? shown[t->shown] : NAN;
        value[s->p + k] = (reached - t->value) / s->row_size[s->p + k];
    }
    for (int k = 0; k < s->rows; k++)
        worst = fabs(value[k]) > worst || !isfinite(value[k]) ? fabs(value[k]) : worst;
    return isfinite(worst) ? worst : INFINITY;
}

/* What unknown j changes, one size of a coordinate or a unit of what is free. */
static void fill_column(solver *s, int j)
{
    kmp_linear *l = s->w->l;
    int n = l->n, m = l->m, free = j - s->p;
    double *h = s->partial, *move = s->moves + j * n, *column = s->jacobian + j * s->rows;
    kmp_change change = {0};
    memset(s->unit, 0, (size_t)s->columns * sizeof *s->unit);
    memset(s->parameters, 0, (size_t)s->x->free_count * sizeof *s->parameters);
    if (free < 0) {
        s->unit[j] = kmp_way_scale(l, j);
        change.u = s->unit;
    } else if (free < s->x->parameter_count) {
        kmp_slopes_of_parameter(s->x->slopes, free, h, h + m, h + 2 * m, h + 3 * m);
        change = (kmp_change){.h = h, .rate = h + m, .curve = h + 2 * m, .force = h + 3 * m};
        s->parameters[free] = 1;
    } else {
        int c = s->w->search->rates[s->x->rate[free - s->x->parameter_count]].coordinate;
        for (int k = 0; k < s->p; k++)
            s->unit[k] = l->part.u[k] == c;
        change.ud = s->unit;
    }
    kmp_linear_follow(l, &change, &(kmp_response){move, s->dqd, s->dqdd, s->dlambda, s->dr});
    double no_time = 0;
    if (s->shown > 0)
        kmp_slopes_along(s->x->slopes, &s->x->slopes->outputs,
                         &(kmp_direction){&no_time, move, s->dqd, s->dqdd, s->dlambda, s->parameters}, s->along);
    memcpy(column, s->dr, (size_t)s->p * sizeof *column);
    for (int k = 0; k < s->x->target_count; k++) {
        const kmp_target *t = &s->x->target[k];
        column[s->p + k] = t->coordinate >= 0 ? move[t->coordinate] : s->along[t->shown];
    }
}

/* A target by what the coordinates change of it. */
static double target_size(const solver *s, int row)
{
    const kmp_target *t = &s->x->target[row - s->p];
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
    kmp_instant at = instant(l);
    s->p = l->p;
    s->rows = s->p + s->x->target_count;
    s->columns = s->p + s->x->free_count;
    kmp_slopes_at(s->x->slopes, &at);
    if (s->shown > 0)
        (void)kmp_slopes_values(&s->x->slopes->outputs, &at);
    for (int j = 0; j < s->columns; j++)
        fill_column(s, j);
    for (int i = 0; i < s->rows; i++)
        s->row_size[i] = i >= s->p ? target_size(s, i) : s->w->work[i] > 0 ? s->w->work[i] / kmp_way_scale(l, i) : 1;
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
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
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

/* dq of the step in w->move, and how far it goes: what is free counts in parts of its value. */
static double spread(solver *s)
{
    kmp_way *w = s->w;
    double far = 0;
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

/* What a step promises to leave. */
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
    if (!kmp_exchange_set(s->x, value, s->w->l, s->w->search->rates))
        return false;
    kmp_way_take_rates(s->w);
    return true;
}

/* Takes l to the end of the step; the values there in s->right. */
static double try_step(solver *s)
{
    for (int k = 0; k < s->x->free_count; k++)
        s->x->trial[k] = s->x->value[k] + s->column_size[s->p + k] * s->step[s->p + k];
    if (!set_free(s, s->x->trial) || !kmp_way_try(s->w, 1))
        return INFINITY;
    double worst = evaluate(s, s->right);
    return worst < INFINITY ? norm(s->rows, s->right) : INFINITY;
}

static bool accept(solver *s)
{
    memcpy(s->x->value, s->x->trial, (size_t)s->x->free_count * sizeof *s->x->value);
    return kmp_way_arrive(s->w);
}

static bool go_back(solver *s)
{
    return set_free(s, s->x->value) && kmp_way_at(s->w, s->w->q) && kmp_way_arrive(s->w);
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
            kmp_way_note_step(s->w, far);
            return accept(s);
        }
        if (!go_back(s) || !(promised > 0))
            return false;
    }
    return false;
}

/* -- all of it --------------------------------------------------------------------------------------- */

static double take(solver *s)
{
    linearise(s);
    return s->w->residual = evaluate(s, s->value);
}

static kempe_status complain(const solver *s)
{
    const kmp_way *w = s->w;
    int worst = 0;
    for (int k = 0; k < s->rows; k++)
        if (fabs(s->value[k]) > fabs(s->value[worst]))
            worst = k;
    bool target = worst >= s->p;
    return kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                    "no equilibrium is found with the unknowns exchanged: after %d iterations %s '%s' is still off by "
                    "%.2e (relative, wanted %.0e)%s%s: check that what is fixed or required can be reached, that what "
                    "is free acts on it, or start nearer",
                    w->search->iterations, target ? "the value of" : "the balance along",
                    target ? s->x->target[worst - s->p].name : w->l->system->model->motions[w->l->part.u[worst]].name,
                    fabs(s->value[worst]), KMP_WAY_BALANCED, s->x->why.s ? "; the way is barred: " : "",
                    s->x->why.s ? s->x->why.s : "");
}

/* What is free has to be determined: no combination of the other unknowns does the same. */
static kempe_status check_determined(solver *s)
{
    kempe_context *context = s->w->l->system->context;
    for (int f = 0; f < s->x->free_count; f++) {
        int others = 0;
        const double *own = s->jacobian + (s->p + f) * s->rows;
        for (int j = 0; j < s->columns; j++)
            if (j != s->p + f)
                memcpy(s->damped + others++ * s->rows, s->jacobian + j * s->rows, (size_t)s->rows * sizeof *s->damped);
        if (kmp_least_squares(s->rows, others, s->damped, own, KMP_RANK, s->step) < 0)
            return kmp_fail_memory(context);
        double left = 0;
        for (int i = 0; i < s->rows; i++) {
            double sum = own[i];
            for (int j = 0; j < others; j++)
                sum -= s->damped[i + j * s->rows] * s->step[j];
            left = fmax(left, fabs(sum));
        }
        if (left <= DEPENDENT)
            return kmp_fail(context, KEMPE_E_FAILED,
                            "free: '%s' is not determined: %s; fix or require something more, or do not free it",
                            s->x->name[f],
                            norm(s->rows, own) == 0 ? "it changes nothing here" : "other unknowns do the same");
    }
    return KEMPE_OK;
}

static bool polish(solver *s)
{
    for (int k = 0; k < MOST_POLISH && s->w->residual > 0; k++) {
        double before = s->w->residual;
        memcpy(s->kept, s->w->q, (size_t)s->w->n * sizeof *s->kept);
        memcpy(s->kept_value, s->x->value, (size_t)s->x->free_count * sizeof *s->kept_value);
        if (!damped_step(s, 0))
            return false;
        double far = spread(s);
        if (try_step(s) < INFINITY && accept(s) && take(s) < 0.5 * before) {
            kmp_way_note_step(s->w, far);
            kmp_way_note(s->w, s->w->residual);
            continue;
        }
        memcpy(s->w->q, s->kept, (size_t)s->w->n * sizeof *s->kept);
        memcpy(s->x->value, s->kept_value, (size_t)s->x->free_count * sizeof *s->kept_value);
        if (!go_back(s))
            return false;
        (void)take(s);
        return true;
    }
    return true;
}

/* As many equations as unknowns: R of a coordinate that nothing depends on is one more. */
static kempe_status check_counts(const solver *s)
{
    const kmp_way *w = s->w;
    int idle = 0, most;
    for (int k = 0; k < w->l->p; k++)
        idle += kmp_way_is_idle(w->l, k, w->work);
    most = s->x->target_count + idle;
    if (s->x->free_count <= most)
        return KEMPE_OK;
    return kmp_fail(w->l->system->context, KEMPE_E_ARGUMENT,
                    "free: %d unknown%s more, but %d equation%s more: fix or require something for each, or free "
                    "less",
                    s->x->free_count, s->x->free_count == 1 ? "" : "s", most, most == 1 ? "" : "s");
}

/* From the state at hand to the targets as they are. */
static kempe_status solve(solver *s, int most)
{
    double bound = FIRST_BOUND;
    for (int k = 0; k < most; k++) {
        if (kmp_interrupted(s->w->l->system->context))
            return s->w->status = kmp_way_complain(s->w, "interrupted");
        kmp_way_note(s->w, take(s));
        if (s->w->residual <= KMP_WAY_BALANCED)
            return KEMPE_OK;
        if (!step_down(s, &bound))
            return s->w->status != KEMPE_OK ? s->w->status : KEMPE_E_FAILED;
    }
    kmp_way_note(s->w, take(s));
    return s->w->residual <= KMP_WAY_BALANCED ? KEMPE_OK : KEMPE_E_FAILED;
}

static void put_targets(solver *s, double part)
{
    for (int k = 0; k < s->x->target_count; k++)
        s->x->target[k].value = s->from[k] + part * (s->to[k] - s->from[k]);
}

static void save(solver *s)
{
    memcpy(s->good, s->w->q, (size_t)s->w->n * sizeof *s->good);
    memcpy(s->good_value, s->x->value, (size_t)s->x->free_count * sizeof *s->good_value);
}

static bool restore(solver *s)
{
    memcpy(s->w->q, s->good, (size_t)s->w->n * sizeof *s->good);
    memcpy(s->x->value, s->good_value, (size_t)s->x->free_count * sizeof *s->good_value);
    return go_back(s);
}

/* The targets go from what they are at the state at hand to what they shall be: at once, or where that fails by smaller
 * and smaller parts. From a state that is no equilibrium the first part only succeeds by luck. */
static kempe_status follow(solver *s)
{
    double done = 0, part = 1;
    (void)take(s);
    for (int k = 0; k < s->x->target_count; k++) {
        s->to[k] = s->x->target[k].value;
        s->from[k] = s->to[k] + s->value[s->p + k] * s->row_size[s->p + k];
    }
    save(s);
    while (done < 1) {
        double next = fmin(1, done + part);
        put_targets(s, next);
        s->w->search->iterations = 0;
        kempe_status status = solve(s, done == 0 && part == 1 ? MOST_STEPS : MOST_OF_PART);
        if (status == KEMPE_OK) {
            done = next;
            part *= 2;
            save(s);
            continue;
        }
        part /= 2;
        if (status != KEMPE_E_FAILED || s->w->status != KEMPE_OK || part < SMALLEST_PART)
            return status;
        if (!restore(s))
            return KEMPE_E_FAILED;
    }
    return KEMPE_OK;
}

static kempe_status run(solver *s)
{
    kempe_status status = check_counts(s);
    if (status != KEMPE_OK)
        return status;
    status = follow(s);
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

kempe_status kmp_way_exchange(kmp_way *w)
{
    solver s = {.w = w, .x = w->search->exchange};
    s.shown = s.x->slopes->shown;
    kempe_status status = make_room(&s) ? run(&s) : kmp_fail_memory(w->l->system->context);
    free_room(&s);
    return status;
}
