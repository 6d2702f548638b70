/* SPDX-License-Identifier: BSD-3-Clause */
/* The whole run in memory: numbers of each step in one stream, written and read by the same functions, and stretches of
 * steps with the same unknowns, for which formulation and integrator are made once. */
#include "integrators/run/recording.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_center.h"
#include "integrators/run/runner_explain.h"
#include "integrators/run/runner_integrator.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/runner_visits.h"
#include <string.h>

/* Successive steps with the same unknowns: formulation, coordinates, rows, charts, integrator. */
typedef struct stretch {
    const kmp_formulation_kind *method;
    const kmp_solver_kind *integrator;
    bool near_singular, walks, by_bodies;
    kmp_rows_by rows_by;
    kmp_partition part;
    double *chart;
    double t, *row, work; /* a state to begin with: q, qd, qdd, lambda */
    bool known;           /* the state could be completed */
} stretch;

typedef struct step {
    double from, to;
    int stretch;
    size_t count;
    double *numbers;
} step;

struct kmp_recording {
    kmp_arena arena;
    stretch *stretches;
    step *steps;
    int stretch_count, step_count;
    int present;    /* the stretch that the runner is in; -1: another one */
    const step *at; /* the step whose polynomial the integrator has; NULL: another one */
    kmp_runner *runner;
    double held, most; /* bytes of numbers; most 0: any */
    bool over;
};

kmp_recording *kmp_recording_new(double most)
{
    kmp_recording *recording = KMP_NEW(kmp_recording, 1);
    if (recording)
        *recording = (kmp_recording){.present = -1, .most = most};
    return recording;
}

static void forget_steps(kmp_recording *recording)
{
    for (int k = 0; k < recording->stretch_count; k++)
        kmp_partition_free(&recording->stretches[k].part);
    recording->stretch_count = recording->step_count = 0;
    recording->stretches = NULL;
    recording->steps = NULL;
    recording->at = NULL;
    kmp_arena_free(&recording->arena);
}

bool kmp_recording_is_over(const kmp_recording *recording)
{
    return recording->over;
}

void kmp_recording_free(kmp_recording *recording)
{
    if (!recording)
        return;
    kmp_runner_free(recording->runner);
    forget_steps(recording);
    kmp_free(recording);
}

/* -- what a row depends on ---------------------------------------------------------------------------- */

/* Apart from the solver: conditions, inputs, multipliers in loads, the user's coordinates of spherical joints, work. */
static void transfer_surroundings(kmp_runner *run, kmp_number_stream *stream)
{
    kmp_present_inputs *inputs = &run->eval->inputs;
    _Static_assert(sizeof *inputs->piece % sizeof(double) == 0, "pieces are transferred as numbers");
    int piece = (int)(sizeof *inputs->piece / sizeof(double));
    kmp_stream_numbers(stream, run->s->events.count, run->eval->conditions.mode);
    kmp_stream_numbers(stream, piece * inputs->count, (double *)inputs->piece);
    if (run->eval->nu)
        kmp_stream_numbers(stream, run->s->m, run->eval->nu);
    if (kmp_charts_count(run->s) > 0) {
        kmp_stream_numbers(stream, run->s->n, run->turned.now);
        kmp_stream_numbers(stream, 1, &run->turned.t);
    }
    kmp_stream_numbers(stream, 1, &run->balance.work);
    kmp_stream_numbers(stream, 1, &run->balance.t);
}

/* The integrator's polynomial; the closed position at its end, if rows are predicted from there. false: it cannot be
 * reached again. */
static bool transfer_polynomial(kmp_runner *run, kmp_number_stream *stream)
{
    kmp_formulation *formulation = run->formulation;
    double *q = run->balance.row;
    run->kind->transfer(run->solver, stream);
    double t = run->solver->t;
    if (!formulation->stand)
        return true;
    bool good = stream->back || !stream->at || kmp_runner_position(run, t, q) == KEMPE_OK;
    kmp_stream_numbers(stream, run->s->n, q);
    if (stream->back)
        good = kmp_runner_dense(run, t) == KEMPE_OK && formulation->stand(formulation, t, run->room.y, q) == KMP_GO;
    kmp_stream_numbers(stream, formulation->curves, formulation->curve);
    return good;
}

/* -- recording ----------------------------------------------------------------------------------------- */

static size_t chart_size(const kmp_runner *run)
{
    return (size_t)(KMP_CHART_SIZE * run->s->chart_count) * sizeof(double);
}

static bool same_numbers(int count, const int *a, const int *b)
{
    return count == 0 || memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

static bool is_same(const stretch *s, const kmp_runner *run)
{
    const kmp_partition *part = run->formulation->part;
    return s->method == run->method && s->integrator == run->kind && s->near_singular == run->change_point.near &&
           s->walks == run->change_point.walks && s->by_bodies == run->by_bodies &&
           s->rows_by == run->formulation->rows_by && s->part.p == part->p && s->part.r == part->r &&
           same_numbers(part->p, s->part.u, part->u) && same_numbers(part->r, s->part.rows, part->rows) &&
           memcmp(s->chart, run->eval->chart, chart_size(run)) == 0;
}

static bool add_stretch(kmp_recording *r, kmp_runner *run)
{
    stretch *room = kmp_arena_room(&r->arena, r->stretches, r->stretch_count, sizeof *room);
    if (!room)
        return false;
    r->stretches = room;
    stretch *s = &room[r->stretch_count];
    *s = (stretch){.method = run->method,
                   .integrator = run->kind,
                   .near_singular = run->change_point.near,
                   .walks = run->change_point.walks,
                   .by_bodies = run->by_bodies,
                   .rows_by = run->formulation->rows_by,
                   .chart = KMP_ARENA_NEW(&r->arena, double, chart_size(run) / sizeof(double)),
                   .row = KMP_ARENA_NEW(&r->arena, double, 3 * run->s->n + run->s->m)};
    if (r->arena.failed || !kmp_partition_copy(&s->part, run->formulation->part))
        return false;
    r->stretch_count++;
    memcpy(s->chart, run->eval->chart, chart_size(run));
    /* The state at the start of the last step; what it says of a failure does not concern the run. */
    kmp_formulation *formulation = run->formulation;
    kmp_text why = formulation->reason;
    formulation->reason = (kmp_text){0};
    s->t = kmp_runner_t_old(run);
    s->known = kmp_runner_dense(run, s->t) == KEMPE_OK &&
               kmp_formulation_row(formulation, s->t, run->room.y, s->row, &s->work) == KMP_GO;
    kmp_text_free(&formulation->reason);
    formulation->reason = why;
    return true;
}

static bool add_step(kmp_recording *r, kmp_runner *run)
{
    kmp_number_stream stream = {0};
    (void)transfer_polynomial(run, &stream); /* which may have to be made */
    (void)kmp_runner_give_back(run, KEMPE_OK);
    transfer_surroundings(run, &stream);
    step *room = kmp_arena_room(&r->arena, r->steps, r->step_count, sizeof *room);
    double *numbers = KMP_ARENA_NEW(&r->arena, double, stream.count);
    if (!room || !numbers)
        return false;
    r->steps = room;
    stream = (kmp_number_stream){.at = numbers};
    transfer_surroundings(run, &stream);
    (void)transfer_polynomial(run, &stream);
    r->steps[r->step_count++] = (step){.from = kmp_runner_t_old(run),
                                       .to = kmp_runner_t(run),
                                       .stretch = r->stretch_count - 1,
                                       .count = stream.count,
                                       .numbers = numbers};
    return true;
}

kempe_status kmp_recording_add(kmp_recording *r, kmp_runner *run)
{
    if (r->over)
        return KEMPE_OK;
    if (r->step_count > 0 && !(kmp_runner_t(run) > r->steps[r->step_count - 1].to))
        return KEMPE_OK;
    bool goes_on = r->stretch_count > 0 && is_same(&r->stretches[r->stretch_count - 1], run);
    kmp_runner_keep(run);
    const bool made = (goes_on || add_stretch(r, run)) && add_step(r, run);
    KMP_TRY(kmp_runner_give_back(run, kmp_made(run->s->context, made)));
    r->held += (double)r->steps[r->step_count - 1].count * sizeof(double);
    r->over = r->most > 0 && r->held > r->most;
    if (r->over)
        forget_steps(r);
    return KEMPE_OK;
}

void kmp_recording_take(kmp_recording *r, kmp_runner *run)
{
    r->runner = run;
    if (!run)
        return;
    run->log = &run->own;
    run->spec.log = NULL;
    run->choice.open = run->brief = false;
}

void kmp_recording_keep_spec(kmp_recording *r, const kmp_run_spec *spec)
{
    if (r->runner)
        r->runner->spec = *spec;
}

/* -- rows ------------------------------------------------------------------------------------------------ */

bool kmp_recording_ends(const kmp_recording *r, double *from, double *until)
{
    if (!r->runner || r->step_count == 0)
        return false;
    *from = r->steps[0].from;
    *until = r->steps[r->step_count - 1].to;
    return true;
}

int kmp_recording_steps(const kmp_recording *r)
{
    return r->step_count;
}

double kmp_recording_step_end(const kmp_recording *r, int k)
{
    return r->steps[k].to;
}

/* The step in which the run delivered rows at t: the first that ends there or later. */
static const step *step_at(const kmp_recording *r, double t)
{
    int low = 0, high = r->step_count - 1;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (r->steps[middle].to < t)
            low = middle + 1;
        else
            high = middle;
    }
    return &r->steps[low];
}

/* Makes the formulation and the integrator of a stretch. */
static kempe_status stand_in(kmp_runner *run, const stretch *s)
{
    int n = run->s->n;
    kmp_runner_release_integrators(run);
    kmp_runner_forget_visits(run);
    if (run->formulation)
        run->formulation->release(run->formulation);
    run->formulation = NULL;
    run->room.y = run->room.yp = NULL;
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_made(run->s->context, kmp_partition_copy(&run->part, &s->part)));
    run->method = s->method;
    run->choice.kind = s->integrator;
    run->change_point.near = s->near_singular;
    run->change_point.walks = s->walks;
    run->by_bodies = s->by_bodies;
    run->brief = s->rows_by != KMP_ROWS_BY_PROGRAM;
    run->early = s->rows_by == KMP_ROWS_BY_SADDLE_PROGRAM;
    kmp_eval_set_charts(run->eval, s->chart);
    kmp_eval_closure(run->eval, s->t, s->row);
    kmp_eval_drop(run->eval, s->part.m - s->part.r, s->part.redundant);
    memcpy(run->room.state, s->row, (size_t)(3 * n + run->s->m) * sizeof *s->row);
    KMP_TRY(kmp_runner_make(run, s->t, run->room.state, run->room.state + n, s->work));
    run->formulation->rows_by = s->rows_by; /* rows then have the same bits */
    return KEMPE_OK;
}

/* Returns to a step. The polynomial of the present one is kept. */
static kempe_status stand_at(kmp_recording *r, const step *at)
{
    kmp_runner *run = r->runner;
    const stretch *s = &r->stretches[at->stretch];
    kmp_number_stream stream = {.at = at->numbers, .back = true};
    bool stays = r->at == at;
    r->at = NULL;
    if (!s->known)
        return KEMPE_E_FAILED;
    transfer_surroundings(run, &stream);
    kmp_eval_set_modes(run->eval, run->eval->conditions.mode);
    if (r->present != at->stretch) {
        r->present = -1;
        KMP_TRY(stand_in(run, s));
        r->present = at->stretch;
        stream.count = 0;
        transfer_surroundings(run, &stream);
    }
    bool good = stays || (transfer_polynomial(run, &stream) && stream.count == at->count);
    run->events.here = true;
    run->events.t = at->to;
    r->at = good ? at : NULL;
    return good ? KEMPE_OK : KEMPE_E_FAILED;
}

kempe_status kmp_recording_row(kmp_recording *r, double t, bool whole, double *row)
{
    kmp_runner *run = r->runner;
    double work;
    kmp_free(run->reason);
    run->reason = NULL;
    run->locks = false;
    run->memory_failures = kmp_memory_failures();
    kempe_status status = stand_at(r, step_at(r, t));
    if (status == KEMPE_OK)
        status = whole ? kmp_runner_row(run, t, row, &work) : kmp_runner_motion(run, t, row);
    r->at = status == KEMPE_OK ? r->at : NULL;
    status = kmp_runner_give_up(run, status, "the step cannot be taken up again", t);
    if (status == KEMPE_OK || status == KEMPE_E_MEMORY)
        return status;
    return kmp_fail(run->s->context, KEMPE_E_FAILED, "the state at t = %.9g s cannot be completed: %s", t, run->reason);
}
