/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances that stay in lanes from one step of the caller to the next. A note has what an instance had when its step
 * began, so that it can return there. */
#include "ensemble/lanes/lane_steps.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/run/friction_run.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/runner_start.h"
#include <math.h>
#include <string.h>

/* Of an instance. */
typedef struct step_note {
    bool moves; /* its step is not settled yet */
    long tried; /* attempts of steps before it */
    double t, h, pace, limit, usual, next_sample;
    kmp_lane_group *home;
    double *y, *mode, *nu;
    kmp_condition_past *past;
    void *memory;
    kmp_present_inputs inputs;
    int rank;      /* of its closures where it has left the lanes */
    double margin; /* as in kmp_instance_take_back */
} step_note;

/* Steps within one of the caller that make an instance a case for another integrator: at least, and over the expected
 * ones (runner_integrator.c). */
enum { LABOURS_FROM = 64 };
static const double MANY_STEPS = 7.5;

struct kmp_lane_steps {
    step_note *note; /* count */
    size_t memory;   /* bytes */
    kmp_ensemble_done done;
    double none; /* the values of all instances */
};

kempe_status kmp_lane_steps_new(kmp_engine *e, int count, double *q, double *qd)
{
    kmp_arena *a = &e->arena;
    kmp_lane_steps *steps = KMP_ARENA_NEW(a, kmp_lane_steps, 1);
    e->count = count;
    e->q = q;
    e->qd = qd;
    if (steps && kmp_engine_make_instances(e) &&
        KMP_ARENA_MAKE(a, KMP_ROOM(kmp_ensemble_result, count, &e->results), KMP_ROOM(step_note, count, &steps->note),
                       KMP_ROOM(double, 2 * (size_t)count * (size_t)e->n, &e->starts))) {
        steps->memory = e->site ? kmp_runner_memory_size(e->s) : 0;
        steps->done.total = -1;
        e->values = &steps->none;
        e->all = &steps->done;
        e->steps = steps;
    }
    for (int i = 0; i < count && !a->failed; i++) {
        step_note *note = &steps->note[i];
        KMP_ARENA_MAKE(a, KMP_ROOM(double, kmp_lane_most(e), &note->y),
                       KMP_ROOM(double, e->s->events.count, &note->mode),
                       KMP_ROOM(double, e->s->load_row_count > 0 ? e->m : 0, &note->nu),
                       KMP_ROOM(kmp_condition_past, e->s->events.count, &note->past));
        note->memory = KMP_ARENA_NEW(a, double, steps->memory / sizeof(double) + 1);
        (void)kmp_present_inputs_init(&note->inputs, a, e->s->model);
        note->inputs.held = true;
        e->results[i].alone = true; /* it has not begun */
        e->results[i].why = "an instance that has not begun";
    }
    return kmp_made(e->context, !a->failed);
}

void kmp_lane_steps_end(kmp_engine *e)
{
    for (int i = 0; e->steps && i < e->count; i++)
        kmp_free(e->results[i].reason);
    e->steps = NULL;
    kmp_arena_free(&e->arena);
}

/* -- pools ------------------------------------------------------------------------------------------- */

/* A pool with instances that rest, or whose steps have begun in it, is kept. */
static void keep(kmp_lane_group **place, kmp_lane_group *pool)
{
    if (*place)
        (*place)->kept--;
    if (pool)
        pool->kept++;
    *place = pool;
}

bool kmp_lane_steps_rest(kmp_engine *e, kmp_lane_group *pool, int i)
{
    kmp_instance *x = &e->instances[i];
    if (!e->steps || x->t < x->end)
        return false;
    keep(&x->home, pool);
    x->rests = true;
    return true;
}

bool kmp_lane_steps_leave(kmp_engine *e, int i, int rank, const char *why)
{
    if (!e->steps)
        return false;
    e->instances[i].returns = true;
    e->steps->note[i].rank = rank;
    kmp_instance_leave(e, i, why);
    return true;
}

/* -- rows -------------------------------------------------------------------------------------------- */

void kmp_lane_steps_show(kmp_engine *e, const kmp_lane_group *pool, int i)
{
    const kmp_instance *x = &e->instances[i];
    const kmp_partition *part = &pool->part;
    double *q = e->q + (size_t)i * (size_t)e->n, *qd = e->qd + (size_t)i * (size_t)e->n;
    for (int k = 0; k < part->p; k++) {
        q[part->u[k]] = x->y[k];
        qd[part->u[k]] = x->y[part->p + k];
    }
    for (int k = 0; k < part->r; k++) {
        q[part->v[k]] = x->y[2 * part->p + k];
        qd[part->v[k]] = x->dy[2 * part->p + k];
    }
}

void kmp_lane_steps_show_state(kmp_engine *e, int i)
{
    const size_t n = (size_t)e->n, at = (size_t)i * n;
    if (e->instances[i].t < e->instances[i].end)
        return;
    memcpy(e->q + at, e->state, n * sizeof *e->q);
    memcpy(e->qd + at, e->state + n, n * sizeof *e->qd);
}

/* Accelerations and multipliers of a row that has q and qd. false: they are not available. */
static bool complete(kmp_engine *e, int i, double *row)
{
    const kmp_instance *x = &e->instances[i];
    const size_t n = (size_t)e->n;
    if (!x->home)
        return false;
    kmp_instance_current(e, x);
    kmp_engine_hold_inputs(e, &x->inputs);
    kmp_eval_closure(e->eval, x->t, row);
    bool known = !kmp_reduction_factor(&x->home->red);
    if (known) {
        kmp_reduction_tangent(&x->home->red);
        known = kmp_instance_complete(e, x->home, row + n, row + 2 * n, row + 3 * n);
    }
    if (known && e->site && e->site->sticking.friction) {
        kmp_runner_take_memory(e->site, x->memory, false);
        kmp_friction_show(e->site, x->t, row);
    }
    kmp_engine_hold_inputs(e, NULL);
    return known;
}

void kmp_lane_steps_row(kmp_engine *e, int i, bool late, double *row)
{
    const size_t n = (size_t)e->n, at = (size_t)i * n;
    if (n > 0) {
        memcpy(row, e->q + at, n * sizeof *row);
        memcpy(row + n, e->qd + at, n * sizeof *row);
    }
    if (late && !complete(e, i, row))
        for (size_t k = 2 * n; k < 3 * n + (size_t)e->m; k++)
            row[k] = NAN;
}

double kmp_lane_steps_time(const kmp_engine *e, int i)
{
    return e->instances[i].t;
}

const kmp_present_inputs *kmp_lane_steps_inputs(const kmp_engine *e, int i)
{
    return &e->instances[i].inputs;
}

const char *kmp_lane_steps_absence(const kmp_engine *e, int i)
{
    return e->results[i].alone ? e->results[i].why : NULL;
}

/* -- start ------------------------------------------------------------------------------------------- */

/* An instance as it is before its start, in the same room. */
static void renew(kmp_engine *e, int i)
{
    kmp_instance *x = &e->instances[i];
    keep(&x->home, NULL);
    kmp_present_inputs_forget(&x->inputs);
    *x = (kmp_instance){.inputs = x->inputs,
                        .longest = x->longest,
                        .y = x->y,
                        .dy = x->dy,
                        .vdd = x->vdd,
                        .nu = x->nu,
                        .mode = x->mode,
                        .past = x->past,
                        .memory = x->memory,
                        .constants = x->constants,
                        .base = x->base,
                        .base_size = x->base_size,
                        .next_sample = INFINITY};
    x->inputs.waiting = false;
    for (int k = 0; k < x->inputs.count; k++)
        x->inputs.waits[k] = false;
    memset(x->y, 0, (size_t)kmp_lane_most(e) * sizeof *x->y);
    memset(x->mode, 0, (size_t)e->s->events.count * sizeof *x->mode);
    if (x->nu)
        memset(x->nu, 0, (size_t)(e->s->load_row_count > 0 ? e->m : 0) * sizeof *x->nu);
    kmp_free(e->results[i].reason);
    e->results[i] = (kmp_ensemble_result){.status = KEMPE_STOPPED};
}

kempe_status kmp_lane_steps_begin(kmp_engine *e, int i, const double *start)
{
    const size_t n = (size_t)e->n;
    double *own = e->starts + (size_t)i * 2 * n;
    renew(e, i);
    keep(&e->steps->note[i].home, NULL);
    e->steps->note[i].moves = false;
    e->steps->note[i].margin = -1;
    for (size_t k = 0; k < 2 * n; k++)
        own[k] = start ? start[k] : NAN;
    KMP_TRY(kmp_instance_start(e, i));
    if (!e->results[i].alone)
        kmp_lane_steps_show(e, e->instances[i].home, i);
    /* The slopes of v are not known yet. */
    if (!e->results[i].alone && n > 0 && !isnan(own[0]))
        memcpy(e->qd + (size_t)i * n, own + n, n * sizeof *own);
    return KEMPE_OK;
}

/* -- a step ------------------------------------------------------------------------------------------ */

static long tried_steps(const kmp_engine *e, int i)
{
    const kmp_ensemble_result *result = &e->results[i];
    return result->steps + result->rejected + result->refused;
}

static void note_beginning(kmp_engine *e, int i)
{
    const kmp_instance *x = &e->instances[i];
    step_note *note = &e->steps->note[i];
    const size_t events = (size_t)e->s->events.count;
    note->t = x->t;
    note->tried = tried_steps(e, i);
    note->h = x->h;
    note->pace = x->pace;
    note->limit = x->limit;
    note->usual = x->usual;
    note->next_sample = x->next_sample;
    keep(&note->home, x->home);
    memcpy(note->y, x->y, (size_t)(e->n + x->home->part.p + e->s->dissipative) * sizeof *x->y);
    if (events > 0) {
        memcpy(note->mode, x->mode, events * sizeof *x->mode);
        memcpy(note->past, x->past, events * sizeof *x->past);
    }
    if (e->s->load_row_count > 0)
        memcpy(note->nu, x->nu, (size_t)e->m * sizeof *x->nu);
    memcpy(note->memory, x->memory, e->steps->memory);
    kmp_present_inputs_copy(&note->inputs, &x->inputs);
}

static void return_to_beginning(kmp_engine *e, int i)
{
    kmp_instance *x = &e->instances[i];
    step_note *note = &e->steps->note[i];
    const size_t events = (size_t)e->s->events.count;
    x->t = x->end = note->t;
    x->h = note->h;
    x->pace = note->pace;
    x->limit = note->limit;
    x->usual = note->usual;
    x->next_sample = note->next_sample;
    keep(&x->home, note->home);
    memcpy(x->y, note->y, (size_t)(e->n + x->home->part.p + e->s->dissipative) * sizeof *x->y);
    if (events > 0) {
        memcpy(x->mode, note->mode, events * sizeof *x->mode);
        memcpy(x->past, note->past, events * sizeof *x->past);
    }
    if (e->s->load_row_count > 0)
        memcpy(x->nu, note->nu, (size_t)e->m * sizeof *x->nu);
    memcpy(x->memory, note->memory, e->steps->memory);
    kmp_present_inputs_copy(&x->inputs, &note->inputs);
    x->signs.known = x->has_slope = x->rejected = x->again = false;
    x->rests = true;
    x->tries = x->hopeless = 0;
    x->error_old = KMP_RK_ERROR_FLOOR;
    x->seen_t = x->corrected.t = -1;
}

/* Takes the inputs from the present time on, as a run does at a sample: restarts where a value jumps. */
static kempe_status take_inputs(kmp_engine *e, int i)
{
    kmp_instance *x = &e->instances[i];
    kmp_lane_group *home = x->home;
    int input;
    const bool due = kmp_present_inputs_are_due(&x->inputs, x->t);
    keep(&x->home, NULL);
    if (e->site && (due || (x->next_sample < INFINITY && kmp_sample_is_due(x->next_sample, x->t))))
        return kmp_instance_meet(e, home, i);
    if (due && kmp_present_inputs_enter(&x->inputs, x->t, &input) == 0) {
        x->error_old = KMP_RK_ERROR_FLOOR;
        x->has_slope = false;
        if (!kmp_instance_renew_conditions(e, home, i)) {
            kmp_instance_leave(e, i, "a condition that ends the run where an input jumps");
            return KEMPE_OK;
        }
    }
    kmp_lane_group_put(e, home, i);
    return KEMPE_OK;
}

kempe_status kmp_lane_steps_prepare(kmp_engine *e, int i, double end, int count, const int *inputs,
                                    const double *values)
{
    kmp_instance *x = &e->instances[i];
    if (!(x->t < end) && count == 0)
        return KEMPE_OK;
    note_beginning(e, i);
    e->steps->note[i].moves = true;
    e->results[i].alone = false;
    for (int k = 0; k < count; k++)
        kmp_present_inputs_give(&x->inputs, inputs[k], x->t, (const double[3]){values[k], 0, 0});
    x->end = end;
    x->bound = (kmp_work_bound){.most = e->spec.max_steps};
    return take_inputs(e, i);
}

bool kmp_lane_steps_settle(kmp_engine *e, int i)
{
    kmp_instance *x = &e->instances[i];
    step_note *note = &e->steps->note[i];
    if (!note->moves)
        return !e->results[i].alone;
    note->moves = false;
    const bool arrived = !e->results[i].alone && x->home && !(x->t < x->end);
    if (!arrived)
        return_to_beginning(e, i);
    keep(&note->home, NULL);
    return arrived;
}

bool kmp_lane_steps_dismiss(kmp_engine *e, int i)
{
    const kmp_instance *x = &e->instances[i];
    const step_note *note = &e->steps->note[i];
    const long tried = tried_steps(e, i) - note->tried;
    if (tried < LABOURS_FROM ||
        (double)tried < MANY_STEPS * kmp_steps_expected(e->spec.rtol, x->rate_scale * (x->t - note->t)))
        return false;
    e->instances[i].returns = false;
    kmp_instance_leave(e, i, "a motion that takes many steps, for which a stepper may choose another integrator");
    return true;
}

/* -- other runs -------------------------------------------------------------------------------------- */

bool kmp_lane_steps_hand_over(kmp_engine *e, int i, kmp_lane_handed *handed)
{
    kmp_instance *x = &e->instances[i];
    kmp_lane_group *home = x->home;
    const size_t n = (size_t)e->n;
    if (!home || !kmp_instance_unpack(e, home, i, true))
        return false;
    *handed = (kmp_lane_handed){.t = x->t,
                                .work = e->s->dissipative ? x->y[e->n + home->part.p] : 0,
                                .h = x->has_step ? fmax(x->h, x->pace) : 0,
                                .rate_scale = x->rate_scale,
                                .modes = e->conditions ? x->mode : NULL,
                                .memory = x->stood ? x->memory : NULL,
                                .inputs = &x->inputs,
                                .row = e->state};
    memcpy(e->q + (size_t)i * n, e->state, n * sizeof *e->q);
    memcpy(e->qd + (size_t)i * n, e->state + n, n * sizeof *e->qd);
    keep(&x->home, NULL);
    e->steps->note[i].margin = -1;
    return true;
}

kempe_status kmp_lane_steps_take_back(kmp_engine *e, int i, kmp_runner *run, double t, bool *taken)
{
    kmp_instance *x = &e->instances[i];
    step_note *note = &e->steps->note[i];
    *taken = false;
    if (!x->returns || !kmp_same_time(kmp_runner_t(run), t) || strcmp(run->kind->name, e->spec.integrator) != 0)
        return KEMPE_OK;
    x->end = kmp_runner_t(run);
    e->results[i].alone = false;
    KMP_TRY(kmp_instance_take_back(e, i, run, note->rank, &note->margin, taken));
    *taken = *taken && !e->results[i].alone && x->home;
    x->returns = !*taken;
    e->results[i].alone = !*taken;
    return KEMPE_OK;
}

kempe_status kmp_lane_steps_begin_as(kmp_engine *e, int i, kmp_runner *run)
{
    kmp_instance *x = &e->instances[i];
    step_note *note = &e->steps->note[i];
    bool taken;
    note->rank = x->home->part.r;
    note->margin = 0;
    x->rate_scale = kmp_runner_rate_scale(run);
    x->returns = true;
    e->results[i].alone = true;
    e->results[i].why = "a start that needs a separate run";
    KMP_TRY(kmp_lane_steps_take_back(e, i, run, 0, &taken));
    note->margin = -1;
    if (!taken)
        keep(&x->home, NULL);
    return KEMPE_OK;
}
