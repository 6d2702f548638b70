/* SPDX-License-Identifier: BSD-3-Clause */
/* The neighbour list of molecular dynamics (Verlet 1967), with bounds of distances over boxes of coordinates in place
 * of radii, so that it holds for any distance. A piece begins with a guess of the boxes, from the rates at its start.
 * While it runs, every step widens the box in which it has been. If a distance that was left out may have been zero in
 * there, the piece is made again with this contact. So no contact is missed, whatever the guess was. A piece begins
 * as any run does that starts at its state: rest, stick and closed contacts are found again. On a dae surfaces overlap
 * by the errors of steps; such runs are not made in pieces. */
#include "integrators/run/near_runs.h"
#include "backend/bounds.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "integrators/events/event_pieces.h"
#include "integrators/run/island_runs.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "model/data/body.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    LEAST = 512,   /* contacts from which on pieces pay, */
    FRICTION = 10, /* one with friction counts as this number more: it has more conditions, and decisions */
    SHORTEST = 9,  /* the rest of the run is halved so often at most */
    ATTEMPTS = 4   /* attempts of a piece, after which it is halved */
};
/* A guess is longer than the way at the present rates and accelerations by this factor, and by this part of the size of
 * the coordinate. */
#define AHEAD  1.25
#define MARGIN 1e-3
static const double ANYTHING = 1e300;

/* The distances of contacts, as conditions of the system. */
typedef struct distances {
    kmp_bounds *bounds;
    int *output;   /* of each condition */
    int *force;    /* of each condition: its contact; -1: it is not such a distance */
    bool *wanted;  /* of each condition */
    int contacts;  /* distances */
    int frictions; /* of such contacts */
    bool computed; /* constants are known */
} distances;

typedef struct near_runs {
    const kempe_system *s;
    const kmp_run_spec *spec;
    kmp_arena arena;
    distances gaps;
    struct kmp_island_systems *parts;
    bool *out;          /* of each force: a contact that is left out */
    double *low, *high; /* n: where the coordinates are in the piece */
    int last;           /* part of the last step */
    double *row;        /* 3 n + m, work: at the start of the piece */
    double *times;      /* of the rows of a piece */
    double *rows;       /* of a piece */
    int room, kept;     /* the most rows that have room, and the rows that are there */
    double *look;       /* two rows of a part */
    kempe_assembly end; /* of the piece, in the charts of its joints: inner_q, inner_qd, chart */
} near_runs;

/* -- distances ------------------------------------------------------------------------------------------- */

static int width(const kempe_system *s)
{
    return 3 * s->n + s->m + 1;
}

/* The contact whose distance condition k is, where it depends on nothing but places; -1: it is none. */
static int contact_of(const kempe_system *s, const kmp_bounds *bounds, int k, int output)
{
    const kmp_condition *condition = &s->events.condition[k];
    const kmp_force *force = condition->of;
    const bool is = condition->role == KMP_ROLE_PLACE && force->kind == KMP_FORCE_TOUCH && !condition->late &&
                    !condition->by_rates && !bounds->given[output];
    return is ? (int)(force - s->model->forces) : -1;
}

/* Each contact with friction has one such condition, by which it is counted. */
static bool is_friction(const kmp_condition *condition)
{
    const kmp_force *force = condition->of;
    return condition->role == KMP_ROLE_PLACE && force->kind == KMP_FORCE_FRICTION && force->contact > 0;
}

static bool find_distances(near_runs *x)
{
    const kempe_system *s = x->s;
    distances *d = &x->gaps;
    const int count = s->events.count;
    d->bounds = kmp_bounds_new(s->changes, &x->arena);
    if (!KMP_ARENA_MAKE(&x->arena, KMP_ROOM(int, count, &d->output, &d->force), KMP_ROOM(bool, count, &d->wanted)) ||
        !d->bounds)
        return false;
    for (int k = 0; k < count; k++) {
        d->output[k] = s->changes->outputs[1] + k; /* late ones, which are left out, are elsewhere */
        d->force[k] = contact_of(s, d->bounds, k, d->output[k]);
        d->wanted[k] = d->force[k] >= 0;
        d->contacts += d->wanted[k];
        d->frictions += is_friction(&s->events.condition[k]);
    }
    return true;
}

/* Sets the bounds of the inputs while the coordinates are in the box; modes, rates and signals may be anything. */
static void set_box(near_runs *x, double from, double to)
{
    const kmp_program *program = x->s->changes;
    const kmp_bound any = {-ANYTHING, ANYTHING, -ANYTHING, ANYTHING};
    for (int k = 0; k < program->input_count; k++) {
        const kmp_program_input *in = &program->input[k];
        kmp_bound bound = any;
        if (in->kind == KMP_IN_TIME && in->index == 0)
            bound = (kmp_bound){from, to, 1, 1};
        else if (in->kind == KMP_IN_Q)
            bound = (kmp_bound){x->low[in->index], x->high[in->index], -ANYTHING, ANYTHING};
        else if (in->kind == KMP_IN_PARAMETER)
            bound = kmp_bound_still(x->s->parameters[in->index]);
        kmp_bounds_set(x->gaps.bounds, k, bound);
    }
}

/* Bounds the distances in the box. */
static void bound_distances(near_runs *x, double from, double to)
{
    distances *d = &x->gaps;
    set_box(x, from, to);
    if (!d->computed)
        kmp_bounds_run(d->bounds, true);
    d->computed = true;
    kmp_bounds_want(d->bounds, x->s->events.count, d->output, d->wanted);
    kmp_bounds_run_wanted(d->bounds);
}

/* True if the surfaces of condition k cannot touch in the box. */
static bool is_far(const near_runs *x, int k)
{
    return kmp_bounds_get(x->gaps.bounds, x->gaps.output[k]).low > KMP_CONTACT_APART * x->s->length;
}

/* Leaves out the contacts that are far away in the box. Returns how many are not. */
static int leave_out(near_runs *x, double from, double to)
{
    int near = 0;
    bound_distances(x, from, to);
    for (int k = 0; k < x->s->events.count; k++) {
        if (x->gaps.force[k] < 0)
            continue;
        x->out[x->gaps.force[k]] = is_far(x, k);
        near += !x->out[x->gaps.force[k]];
    }
    return near;
}

/* Takes contacts that were left out, and may have touched in the box, into the next attempt. True: there are some. */
static bool take_reached(near_runs *x, double from, double to)
{
    bool any = false;
    bound_distances(x, from, to);
    for (int k = 0; k < x->s->events.count; k++) {
        if (x->gaps.force[k] < 0 || !x->out[x->gaps.force[k]] || is_far(x, k))
            continue;
        x->out[x->gaps.force[k]] = false;
        any = true;
    }
    return any;
}

/* -- pieces ---------------------------------------------------------------------------------------------- */

/* Guesses the box of the next h seconds. */
static void guess_box(near_runs *x, double h)
{
    const int n = x->s->n;
    const double *q = x->row, *qd = q + n, *qdd = qd + n;
    for (int i = 0; i < n; i++) {
        const double way = AHEAD * h * (fabs(qd[i]) + 0.5 * h * fabs(qdd[i])) + MARGIN * x->s->scale[i];
        x->low[i] = q[i] - way;
        x->high[i] = q[i] + way;
    }
}

/* Chooses the end of a piece from t: as late as few contacts come near that are not near now. `near`: at that time. */
static double choose_end(near_runs *x, double t, int *near)
{
    double h = x->spec->t_end - t;
    guess_box(x, 0);
    const int most = leave_out(x, t, t) + x->s->n / 4;
    for (int k = 0;; k++, h /= 2) {
        guess_box(x, h);
        *near = leave_out(x, t, t + h);
        if (*near <= most || k == SHORTEST)
            return k == 0 ? x->spec->t_end : t + h;
    }
}

/* Notes the state at the end of a piece in the charts of the joints in space: angles of the user may be singular. */
static bool note_end(near_runs *x, kmp_runner *runner, const int *motion, double t)
{
    const kempe_system *s = runner->s;
    const double *row = x->look;
    if (kmp_runner_look_inside(runner, t, false, x->look) != KEMPE_OK)
        return false;
    for (int i = 0; i < s->n; i++) {
        const int k = motion ? motion[i] : i;
        x->end.inner_q[k] = row[i];
        x->end.inner_qd[k] = row[s->n + i];
    }
    for (int c = 0; c < s->chart_count; c++) {
        const int there = kmp_chart_of(x->s, motion ? motion[s->chart_first[c]] : s->chart_first[c]);
        memcpy(x->end.chart + (ptrdiff_t)KMP_CHART_SIZE * there, runner->eval->chart + (ptrdiff_t)KMP_CHART_SIZE * c,
               KMP_CHART_SIZE * sizeof(double));
    }
    return true;
}

/* Widens the box by a step of a part, as the search for events bounds its coordinates. */
static int widen(void *user, kmp_runner *runner, double from, double to)
{
    near_runs *x = user;
    const kempe_system *s = runner->s;
    const int count = kmp_island_systems_count(x->parts), *motion = NULL;
    double *a = x->look, *b = x->look + 3 * s->n + s->m;
    while (count > 0 && kmp_island_system(x->parts, x->last, &motion) != s)
        x->last = (x->last + 1) % count;
    const bool known = kmp_runner_look(runner, from, a) == KEMPE_OK &&
                       kmp_runner_look(runner, to, b) == KEMPE_OK; /* otherwise anything */
    for (int i = 0; i < s->n; i++) {
        const int k = motion ? motion[i] : i;
        const kmp_bound way = known ? kmp_bound_over(to - from, a[i], a[s->n + i], b[i], b[s->n + i])
                                    : (kmp_bound){-ANYTHING, ANYTHING, -ANYTHING, ANYTHING};
        x->low[k] = fmin(x->low[k], way.low);
        x->high[k] = fmax(x->high[k], way.high);
    }
    return to >= runner->spec.t_end && x->end.inner_q && !note_end(x, runner, motion, to);
}

static int keep_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    near_runs *x = user;
    const int wide = width(x->s);
    double *to = x->rows + (ptrdiff_t)x->kept++ * wide;
    (void)t, (void)qd, (void)qdd, (void)lambda; /* they follow q */
    memcpy(to, q, (size_t)(wide - 1) * sizeof *to);
    to[wide - 1] = work;
    return 0;
}

/* A piece: the specification and the start of its run, and what came of it. */
typedef struct piece {
    kmp_run_spec spec;
    kempe_assembly start;
    kmp_run_log log;
    kmp_run_report report;
    kempe_status status;
    bool adds_end; /* its last row is at none of the times of the rows of the run */
} piece;

/* Runs a piece with the contacts that are not left out; with all of them where an element refers to one. */
static kempe_status attempt(near_runs *x, piece *p)
{
    const int n = x->s->n;
    struct kmp_island_systems *earlier = x->parts;
    x->parts = NULL;
    kempe_status status = kmp_island_systems_new(x->s, x->out, earlier, &x->parts);
    kmp_island_systems_free(earlier);
    KMP_TRY(status);
    memcpy(x->low, p->start.q, (size_t)n * sizeof *x->low);
    memcpy(x->high, p->start.q, (size_t)n * sizeof *x->high);
    x->kept = 0;
    x->last = 0;
    kmp_run_log_free(&p->log);
    kmp_free(p->report.reason);
    p->log = (kmp_run_log){0};
    p->spec.log = &p->log;
    p->status = kmp_island_systems_count(x->parts) > 0
                    ? kmp_island_runs(x->parts, x->s, &p->spec, &p->start, kmp_run_whole, keep_row, x, &p->report)
                    : kmp_run_whole(x->s, &p->spec, &p->start, keep_row, x, &p->report);
    const bool went = p->status == KEMPE_OK || p->status == KEMPE_E_FAILED || p->status == KEMPE_STOPPED;
    return went ? KEMPE_OK : p->status;
}

/* Sets the times of the rows of a piece that ends at `to`, from row `next` of the run on. False: no memory. */
static bool set_times(near_runs *x, piece *p, int next, double to)
{
    int count = 0;
    p->spec.t_end = to;
    p->spec.times = x->times;
    for (int k = next; k < x->spec->time_count && x->spec->times[k] <= to; k++)
        x->times[count++] = x->spec->times[k];
    p->adds_end = to < x->spec->t_end && (count == 0 || x->times[count - 1] < to);
    if (p->adds_end)
        x->times[count++] = to;
    p->spec.time_count = count;
    if (count <= x->room)
        return true;
    kmp_free(x->rows);
    x->rows = KMP_NEW(double, (ptrdiff_t)count *width(x->s));
    x->room = x->rows ? count : 0;
    return x->rows;
}

/* Makes attempts until no contact that is left out was reached. */
static kempe_status run_piece(near_runs *x, piece *p, int next, double to)
{
    const double from = p->spec.t_start;
    for (int attempts = 1;; attempts++) {
        KMP_TRY(kmp_made(x->s->context, set_times(x, p, next, to)));
        kmp_context_hold(x->s->context);
        const kempe_status status = attempt(x, p);
        const bool discarded = status == KEMPE_OK && take_reached(x, from, to);
        kmp_context_release(x->s->context, !discarded);
        if (!discarded)
            return status;
        if (p->report.cut) { /* its rows may have passed through a contact */
            x->kept = 0;
            return KEMPE_OK;
        }
        if (attempts % ATTEMPTS == 0) {
            to = from + (to - from) / 2;
            guess_box(x, to - from);
            (void)leave_out(x, from, to);
        }
    }
}

/* -- together -------------------------------------------------------------------------------------------- */

static kempe_status near_runs_init(near_runs *x)
{
    const kempe_system *s = x->s;
    const int wide = width(s), most = x->spec->time_count + 1;
    x->end = (kempe_assembly){.system = s, .closed = true};
    return kmp_made(
        s->context,
        find_distances(x) &&
            KMP_ARENA_MAKE(&x->arena, KMP_ROOM(bool, s->model->force_count, &x->out),
                           KMP_ROOM(double, s->n, &x->low, &x->high), KMP_ROOM(double, wide, &x->row),
                           KMP_ROOM(double, most, &x->times), KMP_ROOM(double, 2 * wide, &x->look)) &&
            (s->chart_count == 0 || KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, s->n, &x->end.inner_q, &x->end.inner_qd),
                                                   KMP_ROOM(double, KMP_CHART_SIZE * s->chart_count, &x->end.chart))));
}

/* Adds the report of a piece, whose reason and time are the ones of the run until the next piece. */
static void add_report(kmp_run_report *sum, const kmp_run_report *one, bool first)
{
    kmp_run_report_add(sum, one);
    sum->least = first ? one->least : fmin(sum->least, one->least);
    sum->most = first ? one->most : fmax(sum->most, one->most);
    sum->t = one->t;
    sum->reason = one->reason;
}

/* Delivers the rows of a piece, of which the next one starts at the last. */
static kempe_status deliver(near_runs *x, const piece *p, int *next, kmp_row_fn *take, void *user)
{
    const kempe_system *s = x->s;
    const int wide = width(s), count = x->kept - (p->status == KEMPE_OK && p->adds_end);
    for (int k = 0; k < count; k++, ++*next) {
        const double *row = x->rows + (ptrdiff_t)k * wide;
        if (take(user, x->times[k], row, row + s->n, row + 2 * s->n, row + 3 * s->n, row[wide - 1]))
            return kmp_fail_memory(s->context);
    }
    x->end.q = x->row;
    x->end.qd = x->row + s->n;
    if (x->kept > 0)
        memcpy(x->row, x->rows + (ptrdiff_t)(x->kept - 1) * wide, (size_t)wide * sizeof *x->row);
    return KEMPE_OK;
}

/* The pieces from the first one, whose end is known. */
static kempe_status run_pieces(near_runs *x, piece *p, double to, kmp_row_fn *take, void *user, kmp_run_report *report)
{
    const kmp_run_spec *spec = x->spec;
    int next = 0, near;
    for (bool first = true;; first = false) {
        KMP_TRY(run_piece(x, p, next, to));
        add_report(report, &p->report, first);
        p->report.reason = NULL;
        KMP_TRY(kmp_made(x->s->context, kmp_run_log_merge(spec->log, x->s->context, &p->log, 1, INFINITY)));
        KMP_TRY(deliver(x, p, &next, take, user));
        if (p->status != KEMPE_OK || p->report.cut || p->spec.t_end >= spec->t_end)
            return p->status;
        p->spec.t_start = p->spec.t_end;
        p->spec.continues = true;
        p->spec.work_start = x->row[width(x->s) - 1];
        p->spec.rate_scale = report->rate_scale;
        p->spec.limit_s = spec->limit_s > 0 ? fmax(spec->limit_s - report->cpu_s, DBL_MIN) : 0;
        p->start = x->end;
        to = choose_end(x, p->spec.t_start, &near);
    }
}

/* *pays: pieces pay, and the model may have parts, which a model with states, a past or conditions that end it has not.
 * Its first parts are made, and *to is the end of the first piece. */
static kempe_status begin(near_runs *x, const kempe_assembly *start, double *to, bool *pays)
{
    const int n = x->s->n;
    int near;
    *pays = false;
    KMP_TRY(near_runs_init(x));
    if (x->gaps.contacts + FRICTION * x->gaps.frictions < LEAST)
        return KEMPE_OK;
    memcpy(x->row, start->q, (size_t)n * sizeof *x->row);
    memcpy(x->row + n, start->qd, (size_t)n * sizeof *x->row);
    for (int i = 0; i < n; i++) /* accelerations are not known yet */
        x->row[2 * n + i] = kmp_model_motion(x->s->model, i)->rotation ? 0 : kmp_system_gravity(x->s);
    *to = choose_end(x, x->spec->t_start, &near);
    if (2 * near >= x->gaps.contacts)
        return KEMPE_OK;
    KMP_TRY(kmp_island_systems_new(x->s, x->out, NULL, &x->parts));
    *pays = kmp_island_systems_count(x->parts) > 0;
    return KEMPE_OK;
}

bool kmp_near_may_pay(const kempe_system *system, const kmp_run_spec *spec)
{
    const kmp_formulation_kind *method = kmp_formulation_find(spec->formulation, spec->form);
    return system->events.count >= LEAST && !kmp_runs_as_whole(system, spec) && method && !method->dae;
}

kempe_status kmp_near_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                          kmp_row_fn *row, void *user, kmp_run_report *report)
{
    if (!kmp_near_may_pay(system, spec))
        return kmp_run_whole(system, spec, start, row, user, report);
    near_runs x = {.s = system, .spec = spec};
    piece p = {.spec = *spec, .start = *start};
    double to;
    bool pays;
    kempe_status status = begin(&x, start, &to, &pays);
    p.spec.step = widen;
    p.spec.user = &x;
    p.spec.all = (kmp_time_span){spec->t_start, spec->t_end};
    *report = KMP_RUN_REPORT_NONE(spec->t_end);
    if (status == KEMPE_OK && pays)
        status = run_pieces(&x, &p, to, row, user, report);
    kmp_run_log_free(&p.log);
    kmp_free(p.report.reason);
    kmp_island_systems_free(x.parts);
    kmp_free(x.rows);
    kmp_arena_free(&x.arena);
    return status == KEMPE_OK && !pays ? kmp_run_whole(system, spec, start, row, user, report) : status;
}
