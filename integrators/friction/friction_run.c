/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/friction/friction_run.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "integrators/run/runner.h"
#include "linalg/dense/box_minimum.h"
#include <math.h>
#include <string.h>

enum {
    MOST_PASSES = 200, /* of the iteration for levels that depend on multipliers */
    MOST_REPEATS = 20  /* decisions without time between them */
};

/* What an element does. */
typedef enum stance {
    SLIPS,
    HELD,    /* by its row */
    CARRIED, /* at rest by the rows of others, with a given force */
    IDLE     /* at rest by other closures: its force is not determined, and taken as zero */
} stance;

typedef struct element {
    int slot; /* its condition KMP_ROLE_SENSE */
    const char *name;
    stance stance, was;         /* now, and before the decision */
    double sense, before_sense; /* of slip */
    bool fired, known;          /* its reserve was used up at the event; it has been decided before */
    bool decides;               /* at rest: decided now */
    bool implied;               /* its row follows from closures */
    bool broken;                /* it slips in this decision */
    double before;              /* its friction at the event */
} element;

struct kmp_friction_run {
    int count;
    element *element;
    double *change; /* values of all conditions */
    int rest;       /* elements that decide, */
    int *which;     /* by number */
    double *d, *a, *lower, *upper, *f, *y, *room;
    double *tried; /* f of the last pass */
    int *side;
    double t; /* of the last decision */
    int repeats;
    double still; /* accelerations below this part of the rate's unit are none */
};

/* -- making -------------------------------------------------------------------------------------------- */

static const char *name_of(const kempe_system *s, int slot)
{
    return ((const kmp_force *)s->events.condition[slot].of)->name;
}

kmp_friction_run *kmp_friction_new(kmp_runner *run, bool *none)
{
    const kmp_events *events = &run->s->events;
    kmp_arena *a = &run->arena;
    kmp_friction_run *x = KMP_ARENA_NEW(a, kmp_friction_run, 1);
    int count = 0;
    for (int k = 0; k < events->count; k++)
        count += events->condition[k].role == KMP_ROLE_SENSE;
    *none = count == 0;
    if (!x || *none)
        return NULL;
    x->t = -INFINITY;
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(element, count, &x->element), KMP_ROOM(int, count, &x->which, &x->side),
                        KMP_ROOM(double, events->count, &x->change), KMP_ROOM(double, count *count, &x->d),
                        KMP_ROOM(double, kmp_box_room(count), &x->room),
                        KMP_ROOM(double, count, &x->a, &x->lower, &x->upper, &x->f, &x->y, &x->tried)))
        return NULL;
    for (int k = 0; k < events->count; k++)
        if (events->condition[k].role == KMP_ROLE_SENSE)
            x->element[x->count++] = (element){.slot = k, .name = name_of(run->s, k)};
    return x;
}

/* -- inputs and values of an element ------------------------------------------------------------------- */

static double value(const kmp_friction_run *x, const element *e, kmp_role role)
{
    return x->change[e->slot + (int)role - KMP_ROLE_SENSE];
}

static void put(kmp_runner *run, const element *e, kmp_role role, double input)
{
    kmp_eval_set_kink(run->eval, e->slot + (int)role - KMP_ROLE_SENSE, input);
}

/* 1/s: the rate of the motion. */
static double pace(const kmp_runner *run, const double *qd)
{
    double rate = fmax(run->rate_scale, 1 / (run->spec.t_end - run->spec.t_start));
    for (int i = 0; i < run->s->n; i++)
        rate = fmax(rate, fabs(qd[i]) / run->s->scale[i]);
    return rate;
}

/* Size of an element's place: the scale of its row. */
static double scale_of(const kmp_runner *run, const element *e)
{
    const kmp_force *force = run->s->events.condition[e->slot].of;
    for (int r = 0; r < run->s->m; r++)
        if (run->s->rows[r].closure == force->closure)
            return run->s->row_scale[r];
    return 1;
}

static void set_slip(kmp_runner *run, element *e, double sense, double none)
{
    e->stance = SLIPS;
    e->sense = sense;
    put(run, e, KMP_ROLE_SENSE, sense);
    put(run, e, KMP_ROLE_HELD, 0);
    put(run, e, KMP_ROLE_GIVEN, 0);
    put(run, e, KMP_ROLE_PLACE, none);
}

/* At rest with a given force; `none`: a larger rate would be an event. */
static void set_given(kmp_runner *run, element *e, double force, double none)
{
    set_slip(run, e, 0, none);
    put(run, e, KMP_ROLE_GIVEN, force);
}

static void set_held(kmp_runner *run, element *e, double place)
{
    set_slip(run, e, 0, place);
    e->stance = HELD;
    put(run, e, KMP_ROLE_HELD, 1);
}

/* -- evaluation ---------------------------------------------------------------------------------------- */

static kempe_status choose(kmp_runner *run, double t, const double *q)
{
    kmp_partition_free(&run->part);
    return kmp_runner_choose(run, t, q, -1, NULL, 0);
}

/* Accelerations and multipliers with the present inputs, and all values. */
static kempe_status measure(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_friction_run *x = run->friction;
    kmp_eval_closure(run->eval, t, q);
    KMP_TRY(kmp_runner_accelerate(run, t, q, qd));
    kmp_eval_all_changes(run->eval, t, q, qd, run->qdd, run->lambda, x->change);
    return KEMPE_OK;
}

void kmp_friction_note(kmp_runner *run)
{
    kmp_friction_run *x = run->friction;
    memcpy(x->change, run->crossing->change, (size_t)run->s->events.count * sizeof(double));
    for (int i = 0; i < x->count; i++) {
        element *e = &x->element[i];
        e->fired = e->stance == HELD && value(x, e, KMP_ROLE_HELD) < 0;
        e->before = value(x, e, KMP_ROLE_GIVEN);
    }
}

void kmp_friction_release(kmp_runner *run)
{
    for (int i = 0; i < run->friction->count; i++)
        put(run, &run->friction->element[i], KMP_ROLE_HELD, 0);
}

void kmp_friction_show(kmp_runner *run, double t, double *row)
{
    const kempe_system *s = run->s;
    kmp_friction_run *x = run->friction;
    double *lambda = row + 3 * s->n;
    kmp_eval_all_changes(run->eval, t, row, row + s->n, row + 2 * s->n, lambda, x->change);
    for (int r = 0; r < s->m; r++) {
        const kmp_closure *closure = &s->model->closures[s->rows[r].closure];
        for (int i = 0; i < x->count && kmp_closure_is_friction(closure); i++)
            if (s->events.condition[x->element[i].slot].of == &s->model->forces[closure->force])
                lambda[r] = value(x, &x->element[i], KMP_ROLE_GIVEN);
    }
}

/* -- the problem at a state ------------------------------------------------------------------------------ */

/* Lists the elements at rest; the others slip on. */
static void list_resting(kmp_runner *run, double rate)
{
    kmp_friction_run *x = run->friction;
    x->rest = 0;
    for (int i = 0; i < x->count; i++) {
        element *e = &x->element[i];
        double size = scale_of(run, e) * rate, v = value(x, e, KMP_ROLE_RATE);
        e->decides = fabs(v) <= KMP_FRICTION_STILL * size;
        e->broken = e->implied = false;
        if (e->decides) {
            set_given(run, e, 0, 0);
            x->which[x->rest++] = i;
        } else {
            set_slip(run, e, v > 0 ? 1 : -1, KMP_FRICTION_NONE * size);
        }
    }
}

/* True if the row of an element is independent of the rows that are kept now. */
static kempe_status adds_row(kmp_runner *run, element *e, double t, const double *q, bool *adds)
{
    int rank = run->part.r;
    set_held(run, e, value(run->friction, e, KMP_ROLE_PLACE));
    KMP_TRY(choose(run, t, q));
    *adds = run->part.r > rank;
    return KEMPE_OK;
}

static kempe_status find_implied(kmp_runner *run, double t, const double *q)
{
    kmp_friction_run *x = run->friction;
    bool adds;
    for (int k = 0; k < x->rest; k++) {
        element *e = &x->element[x->which[k]];
        KMP_TRY(adds_row(run, e, t, q, &adds));
        e->implied = !adds;
        set_given(run, e, 0, 0);
        KMP_TRY(choose(run, t, q));
    }
    return KEMPE_OK;
}

/* A force of a size that occurs, by which D is found. */
static double unit_of(double level)
{
    return level > 0 ? level : 1;
}

/* a0 and D, column by column; rounding of what closures imply is removed. */
static kempe_status find_matrix(kmp_runner *run, double t, const double *q, const double *qd, double rate)
{
    kmp_friction_run *x = run->friction;
    int n = x->rest;
    KMP_TRY(measure(run, t, q, qd));
    for (int i = 0; i < n; i++) {
        const element *e = &x->element[x->which[i]];
        bool none = e->implied &&
                    fabs(value(x, e, KMP_ROLE_ACCELERATION)) <= KMP_FRICTION_STILL * scale_of(run, e) * rate * rate;
        x->a[i] = none ? 0 : value(x, e, KMP_ROLE_ACCELERATION);
        x->upper[i] = value(x, e, KMP_ROLE_LEVEL);
    }
    for (int j = 0; j < n; j++) {
        element *by = &x->element[x->which[j]];
        double unit = unit_of(x->upper[j]);
        set_given(run, by, unit, 0);
        KMP_TRY(measure(run, t, q, qd));
        for (int i = 0; i < n; i++) {
            const element *e = &x->element[x->which[i]];
            bool none = e->implied || by->implied;
            x->d[i + j * n] = none ? 0 : (value(x, e, KMP_ROLE_ACCELERATION) - x->a[i]) / unit;
        }
        set_given(run, by, 0, 0);
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            x->d[i + j * n] = x->d[j + i * n] = (x->d[i + j * n] + x->d[j + i * n]) / 2;
    return KEMPE_OK;
}

/* The guess: the friction before. Elements that were at rest with a given force take all they can of the load of one
 * whose reserve is used up. */
static void guess(kmp_friction_run *x)
{
    int n = x->rest;
    for (int i = 0; i < n; i++)
        x->f[i] = x->element[x->which[i]].fired ? 0 : x->element[x->which[i]].before;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n && x->element[x->which[j]].fired; i++) {
            const element *e = &x->element[x->which[i]];
            double along = x->d[i + j * n] * x->element[x->which[j]].before;
            if (e->was == CARRIED && along != 0)
                x->f[i] = along > 0 ? INFINITY : -INFINITY;
        }
}

/* The bounds at the levels of the last measurement. */
static void set_bounds(kmp_friction_run *x)
{
    for (int i = 0; i < x->rest; i++) {
        const element *e = &x->element[x->which[i]];
        double slip = fmax(value(x, e, KMP_ROLE_LEVEL), 0), most = fmax(value(x, e, KMP_ROLE_STATIC), slip);
        x->lower[i] = e->broken ? -e->sense * slip : -most;
        x->upper[i] = e->broken ? -e->sense * slip : most;
    }
}

static kempe_status solve(kmp_runner *run, double t)
{
    kmp_friction_run *x = run->friction;
    const kmp_box box = {x->rest, x->d, x->a, x->lower, x->upper};
    if (kmp_box_minimum(&box, x->f, x->y, x->side, x->room) == KMP_BOX_FOUND)
        return KEMPE_OK;
    return kmp_fail(run->s->context, KEMPE_E_FAILED, "the modes of friction at t = %.9g are not determined", t);
}

/* Largest change of a force from pass to pass, over the largest force. */
static double changed_by(const kmp_friction_run *x)
{
    double most = 0, size = 0;
    for (int i = 0; i < x->rest; i++) {
        most = fmax(most, fabs(x->f[i] - x->tried[i]));
        size = fmax(size, fmax(fabs(x->f[i]), fabs(x->tried[i])));
    }
    return size > 0 ? most / size : 0;
}

/* Solves with levels that fit the multipliers of the solution. */
static kempe_status solve_levels(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_friction_run *x = run->friction;
    set_bounds(x);
    KMP_TRY(solve(run, t));
    for (int pass = 0; pass < MOST_PASSES && run->loaded_friction; pass++) {
        memcpy(x->tried, x->f, (size_t)x->rest * sizeof *x->f);
        for (int i = 0; i < x->rest; i++)
            put(run, &x->element[x->which[i]], KMP_ROLE_GIVEN, x->f[i]);
        KMP_TRY(measure(run, t, q, qd));
        set_bounds(x);
        KMP_TRY(solve(run, t));
        if (changed_by(x) <= KMP_FRICTION_SETTLED)
            return KEMPE_OK;
    }
    return KEMPE_OK;
}

/* -- the decision ---------------------------------------------------------------------------------------- */

/* Rounding of the acceleration of element i. */
static double rounding_of(const kmp_friction_run *x, int i)
{
    double size = fabs(x->a[i]);
    for (int j = 0; j < x->rest; j++)
        size = fmax(size, fabs(x->d[i + j * x->rest] * x->f[j]));
    return KMP_FRICTION_ROUNDING * size;
}

static bool is_at_bound(const kmp_friction_run *x, int i)
{
    return fabs(x->f[i]) >= (1 - KMP_FRICTION_TIE) * x->upper[i] && x->lower[i] < x->upper[i];
}

/* True if an element at its bound has no acceleration yet, but begins to slip: its reserve is used up, or that of
 * another element whose load it shares. */
static bool is_exhausted(const kmp_friction_run *x, int i)
{
    bool with = false;
    for (int j = 0; j < x->rest; j++)
        with = with || (x->element[x->which[j]].fired && is_at_bound(x, j) && (i == j || x->d[i + j * x->rest] != 0));
    return with && is_at_bound(x, i);
}

/* Lets the elements slip that the solution accelerates, or whose reserve is used up. True: there are new ones. */
static bool break_away(kmp_runner *run)
{
    kmp_friction_run *x = run->friction;
    bool any = false;
    for (int i = 0; i < x->rest; i++) {
        element *e = &x->element[x->which[i]];
        bool moves = x->side[i] != 0 && fabs(x->y[i]) > rounding_of(x, i);
        if (e->broken || !(moves || is_exhausted(x, i)))
            continue;
        e->broken = any = true;
        e->sense = moves ? (x->y[i] > 0 ? 1 : -1) : (x->f[i] > 0 ? -1 : 1);
    }
    return any;
}

/* Solves, with the level of slip for those that break away. */
static kempe_status decide(kmp_runner *run, double t, const double *q, const double *qd)
{
    KMP_TRY(solve_levels(run, t, q, qd));
    while (break_away(run))
        KMP_TRY(solve_levels(run, t, q, qd));
    return KEMPE_OK;
}

static double reserve(const kmp_friction_run *x, int i)
{
    return x->upper[i] - fabs(x->f[i]);
}

/* The element at rest with the k-th largest reserve; of equal ones the first. */
static int with_reserve(const kmp_friction_run *x, int k)
{
    for (int i = 0; i < x->rest; i++) {
        int above = 0;
        for (int j = 0; j < x->rest; j++)
            above += reserve(x, j) > reserve(x, i) || (reserve(x, j) == reserve(x, i) && j < i);
        if (above == k)
            return i;
    }
    return 0;
}

/* Sets the modes of the elements at rest. Rows that others imply are not added: those of the elements with the largest
 * reserve come first. */
static kempe_status set_modes(kmp_runner *run, double t, const double *q, double rate)
{
    kmp_friction_run *x = run->friction;
    for (int k = 0; k < x->rest; k++) {
        element *e = &x->element[x->which[k]];
        if (e->broken)
            set_slip(run, e, e->sense, KMP_FRICTION_NONE * scale_of(run, e) * rate);
        else
            set_given(run, e, 0, 0);
    }
    KMP_TRY(choose(run, t, q));
    for (int k = 0; k < x->rest; k++) {
        int i = with_reserve(x, k);
        element *e = &x->element[x->which[i]];
        bool adds = false;
        if (e->broken)
            continue;
        if (!e->implied)
            KMP_TRY(adds_row(run, e, t, q, &adds));
        if (adds)
            continue;
        set_given(run, e, e->implied ? 0 : x->f[i], KMP_FRICTION_STILL * scale_of(run, e) * rate);
        e->stance = e->implied ? IDLE : CARRIED;
        KMP_TRY(choose(run, t, q));
    }
    return KEMPE_OK;
}

/* -- the log --------------------------------------------------------------------------------------------- */

static const char *words_of(const element *e)
{
    switch (e->stance) {
    case SLIPS:
        return e->sense > 0 ? "slips forward" : "slips backward";
    case IDLE:
        return "rests by other closures: its force is not determined, and taken as zero";
    default:
        return "sticks";
    }
}

static bool is_as_before(const element *e)
{
    bool rests = e->stance == HELD || e->stance == CARRIED, rested = e->was == HELD || e->was == CARRIED;
    return e->known && (rests ? rested : e->stance == e->was && e->sense == e->before_sense);
}

static kempe_status settle(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_friction_run *x = run->friction;
    double rate = pace(run, qd);
    const double *now = kmp_eval_changes(run->eval, t, q, qd);
    memcpy(x->change, now, (size_t)run->s->events.count * sizeof *now);
    list_resting(run, rate);
    KMP_TRY(choose(run, t, q));
    KMP_TRY(find_implied(run, t, q));
    if (x->rest > 0) {
        KMP_TRY(find_matrix(run, t, q, qd, rate));
        guess(x);
        KMP_TRY(decide(run, t, q, qd));
        KMP_TRY(set_modes(run, t, q, rate));
    }
    KMP_TRY(kmp_runner_project(run, t, q, qd));
    return kmp_runner_accelerate(run, t, q, qd);
}

/* Fails where decisions repeat without time between them. */
static kempe_status watch(kmp_runner *run, double t)
{
    kmp_friction_run *x = run->friction;
    x->repeats = t - x->t <= KMP_FRICTION_INSTANT * (run->spec.t_end - run->spec.t_start) ? x->repeats + 1 : 0;
    x->t = t;
    if (x->repeats < MOST_REPEATS)
        return KEMPE_OK;
    return kmp_fail(run->s->context, KEMPE_E_FAILED, "modes of friction change without end at t = %.9g", t);
}

kempe_status kmp_friction_settle(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_friction_run *x = run->friction;
    for (int i = 0; i < x->count; i++) {
        x->element[i].was = x->element[i].stance;
        x->element[i].before_sense = x->element[i].sense;
    }
    KMP_TRY(settle(run, t, q, qd));
    for (int i = 0; i < x->count; i++) {
        element *e = &x->element[i];
        if (!is_as_before(e))
            kmp_run_log_add(run->log, "friction", t, e->before_sense, e->sense, "'%s' %s", e->name, words_of(e));
        e->known = true;
        e->fired = false;
    }
    return watch(run, t);
}
