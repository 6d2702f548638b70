/* SPDX-License-Identifier: BSD-3-Clause */
/* Many instances advanced by the caller (kempe/ensemble_stepper.h). Each part of them has a separate engine, whose
 * lanes make the steps; a stepper makes a step that lanes cannot make. Threads share the parts. */
#include "base/memory.h"
#include "base/thread_pool.h"
#include "constraints/workspace/state_workspace.h"
#include "ensemble/batch.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_run.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/lane_steps.h"
#include "model/data/model_context.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/stepper_run.h"
#include <kempe/ensemble_stepper.h>
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

typedef struct one_instance {
    bool begun, single;     /* `single`: a stepper has it */
    bool labours;           /* its stepper may choose another integrator than lanes have */
    bool lost;              /* neither lanes nor a stepper could begin its last step: it stays there */
    kempe_stepper *stepper; /* NULL: none was needed yet */
    kempe_status status;
    char *reason; /* NULL: there is none */
} one_instance;

/* Instances that share an engine. */
typedef struct ensemble_part {
    kempe_ensemble_stepper *whole;
    kmp_engine *engine;
    bool runs; /* the engine has begun */
    kempe_workspace *closer;
    kempe_outputs *outputs;
    int first, count;
    double *row;         /* q, qd, qdd, lambda */
    kempe_status status; /* of the present call */
} ensemble_part;

/* The present call of kempe_ensemble_stepper_advance. */
typedef struct ensemble_step {
    const double *t, *values;
    int input_count;
    const int *inputs;
    double *outputs;
} ensemble_step;

struct kempe_ensemble_stepper {
    const kempe_model *model;
    kmp_arena arena;
    kmp_run_spec spec, in_lanes;
    const char *no_lanes; /* NULL: lanes run the model */
    int count, n, value_count, part_count;
    ensemble_part *part;
    one_instance *instance; /* count */
    double *q, *qd;         /* count x n */
    kmp_team *team;
    ensemble_step step;
    bool *doubted; /* of each condition and end of a use of a table: instances have been doubted for it */
};

/* -- making one -------------------------------------------------------------------------------------- */

static void part_free(ensemble_part *p)
{
    kempe_outputs_free(p->outputs);
    kempe_workspace_free(p->closer);
    if (p->engine)
        kmp_lane_steps_end(p->engine);
    if (p->runs)
        kmp_engine_end(p->engine);
    kmp_engine_free(p->engine);
}

void kempe_ensemble_stepper_free(kempe_ensemble_stepper *s)
{
    if (!s)
        return;
    for (int k = 0; s->instance && k < s->count; k++) {
        kempe_stepper_free(s->instance[k].stepper);
        kmp_free(s->instance[k].reason);
    }
    for (int k = 0; s->part && k < s->part_count; k++)
        part_free(&s->part[k]);
    kmp_team_free(s->team);
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

/* Why lanes do not take the steps of a system; NULL: they do. */
static const char *obstacle(const kempe_ensemble_stepper *s, const kmp_engine *e)
{
    const char *why = kmp_engine_no_lanes(e);
    if (why)
        return why;
    if (s->spec.max_steps > 0)
        return "a bound on the number of steps";
    for (int k = 0; k < kempe_model_input_count(e->s->model); k++)
        if (kmp_model_moved_by(e->s->model, k))
            return "an input that moves a closure";
    return NULL;
}

/* Makes the engine of a part, and begins its run. */
static kempe_status make_engine(kempe_ensemble_stepper *s, ensemble_part *p, const kempe_run_options *run, int lanes)
{
    bool open, varies;
    p->whole = s;
    KMP_TRY(kmp_engine_new(s->model, 0, NULL, p != s->part, &p->engine));
    const kempe_system *system = p->engine->s;
    if (p == s->part) {
        s->n = system->n;
        KMP_TRY(kmp_spec_of(system, run, &s->arena, &s->spec));
        s->spec.threads = 0;
        s->in_lanes = s->spec;
        s->in_lanes.open_integrator = false;
        KMP_TRY(kmp_ensemble_limit_steps(system, &s->in_lanes, &open, &varies));
    }
    const kmp_ensemble_execution execution = {.width = kmp_ensemble_width(system, lanes > 0 ? lanes : 0, p->count, 1),
                                              .alone = lanes < 0};
    p->runs = true;
    return kmp_engine_begin(p->engine, &s->in_lanes, &execution, NULL);
}

static kempe_status make_part(kempe_ensemble_stepper *s, ensemble_part *p, const kempe_run_options *run, int lanes,
                              const char *outputs)
{
    KMP_TRY(make_engine(s, p, run, lanes));
    kmp_engine *e = p->engine;
    KMP_TRY(kempe_outputs_new(e->s, outputs, &p->outputs));
    s->value_count = kempe_outputs_count(p->outputs);
    const size_t at = (size_t)p->first * (size_t)s->n;
    if (p == s->part)
        KMP_TRY(kmp_made(kmp_model_context(s->model),
                         KMP_ARENA_EACH(&s->arena, double, (size_t)s->count *(size_t)s->n, &s->q, &s->qd)));
    p->row = KMP_ARENA_NEW(&s->arena, double, 3 * e->n + e->m);
    KMP_TRY(kmp_made(kmp_model_context(s->model), p->row));
    s->no_lanes = obstacle(s, e);
    if (!s->no_lanes)
        KMP_TRY(kmp_lane_steps_new(e, p->count, s->q + at, s->qd + at));
    return kmp_workspace_new(e->s, &p->closer);
}

static kempe_status make(kempe_ensemble_stepper *s, const kempe_run_options *run, int lanes, const char *outputs)
{
    const int wanted = run->threads > 0 ? run->threads : kmp_processors();
    s->part_count = wanted < s->count ? wanted : s->count;
    s->team = kmp_team_new(s->part_count);
    KMP_TRY(kmp_made(kmp_model_context(s->model),
                     s->team && KMP_ARENA_MAKE(&s->arena, KMP_ROOM(ensemble_part, s->part_count, &s->part),
                                               KMP_ROOM(one_instance, s->count, &s->instance))));
    for (int k = 0; k < s->part_count; k++) {
        ensemble_part *p = &s->part[k];
        p->first = (int)((long)s->count * k / s->part_count);
        p->count = (int)((long)s->count * (k + 1) / s->part_count) - p->first;
        KMP_TRY(make_part(s, p, run, lanes, outputs));
    }
    const kempe_system *system = s->part->engine->s;
    s->doubted = KMP_ARENA_NEW(&s->arena, bool, system->events.count + 2 * system->use_count + 1);
    return kmp_made(system->context, s->doubted);
}

kempe_status kempe_ensemble_stepper_new(const kempe_model *model, const kempe_run_options *run, int count, int lanes,
                                        const char *outputs, kempe_ensemble_stepper **stepper)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, stepper, "stepper");
    KMP_WANTED(context, outputs, "outputs");
    KMP_OPTIONS(context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(context, run, KMP_STUDY_STEPPER));
    kmp_model_begin_forces(model);
    KMP_TRY(kmp_batch_check_lanes(context, lanes));
    if (count < 1)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "%d instances: a positive number is expected", count);
    KMP_MAKE(context, kempe_ensemble_stepper, s);
    s->model = model;
    s->count = count;
    kempe_status status = make(s, run, lanes, outputs);
    return KMP_GIVE_OR_FREE(status, stepper, s, kempe_ensemble_stepper_free);
}

/* -- one instance ------------------------------------------------------------------------------------ */

static ensemble_part *part_of(const kempe_ensemble_stepper *s, int k)
{
    int at = 0;
    while (k >= s->part[at].first + s->part[at].count)
        at++;
    return &s->part[at];
}

/* Notes how the present call ends for an instance: `why` NULL: without a reason. */
static kempe_status note(one_instance *one, kempe_status status, const char *why)
{
    kmp_free(one->reason);
    one->status = status;
    one->reason = why ? kmp_strdup(why) : NULL;
    return why && !one->reason ? KEMPE_E_MEMORY : KEMPE_OK;
}

/* Copies the row of the stepper of an instance, and notes its status. */
static kempe_status note_stepper(ensemble_part *p, int k, kempe_status status)
{
    kempe_ensemble_stepper *s = p->whole;
    one_instance *one = &s->instance[k];
    const size_t n = (size_t)s->n, at = (size_t)k * n;
    if (n > 0) {
        memcpy(s->q + at, kempe_stepper_q(one->stepper), n * sizeof *s->q);
        memcpy(s->qd + at, kempe_stepper_qd(one->stepper), n * sizeof *s->qd);
    }
    const char *why = kempe_stepper_reason(one->stepper);
    return note(one, status, status == KEMPE_OK ? NULL : *why ? why : kempe_context_message(p->engine->context));
}

/* Makes the stepper of an instance, if it has none. */
static kempe_status need_stepper(const ensemble_part *p, one_instance *one)
{
    /* Steppers that lanes take instances back from have the integrator of the lanes. */
    const kempe_ensemble_stepper *all = p->whole;
    const kmp_run_spec *spec = one->labours || all->no_lanes ? &all->spec : &all->in_lanes;
    return one->stepper ? KEMPE_OK : kmp_stepper_new(p->engine->s, spec, &one->stepper);
}

/* Takes the stepper of an instance away, which had another integrator to choose, or is to have it. */
static void set_labours(one_instance *one, bool labours)
{
    if (one->labours == labours)
        return;
    kempe_stepper_free(one->stepper);
    one->stepper = NULL;
    one->labours = labours;
}

/* Begins an instance by its stepper. */
static kempe_status begin_stepper(ensemble_part *p, int k, const double *q, const double *qd)
{
    one_instance *one = &p->whole->instance[k];
    kempe_status status = one->stepper ? kempe_stepper_reset(one->stepper) : need_stepper(p, one);
    if (status == KEMPE_OK && q)
        status = kempe_stepper_set_state(one->stepper, q, qd, NULL);
    one->begun = one->begun && one->stepper;
    KMP_TRY(one->stepper ? note_stepper(p, k, status) : status);
    return status;
}

static kempe_status begin(ensemble_part *p, int k, const double *q, const double *qd)
{
    kempe_ensemble_stepper *s = p->whole;
    kmp_engine *e = p->engine;
    one_instance *one = &s->instance[k];
    const size_t n = (size_t)s->n;
    double *row = p->row;
    for (size_t i = 0; q && i < n; i++) {
        row[i] = q[i];
        row[n + i] = qd ? qd[i] : 0;
    }
    const kempe_status closed = q ? kempe_workspace_close(p->closer, 0, row, row + n, NULL) : KEMPE_OK;
    if (closed == KEMPE_E_FAILED)
        return kmp_fail(e->context, closed, "the state cannot be closed: %s", kempe_workspace_message(p->closer));
    KMP_TRY(closed);
    set_labours(one, false);
    one->begun = true;
    one->lost = false;
    one->single = s->no_lanes != NULL;
    if (!one->single) {
        KMP_TRY(kmp_lane_steps_begin(e, k - p->first, q ? row : NULL));
        one->single = kmp_lane_steps_absence(e, k - p->first) != NULL;
    }
    /* A stepper has taken the samples at t = 0 before it is at another start. */
    const bool follows = !one->single && q && e->site;
    if (!one->single && !follows)
        return note(one, KEMPE_OK, NULL);
    KMP_TRY(begin_stepper(p, k, q, qd));
    if (!follows)
        return KEMPE_OK;
    KMP_TRY(kmp_lane_steps_begin_as(e, k - p->first, one->stepper->runner));
    one->single = kmp_lane_steps_absence(e, k - p->first) != NULL;
    return KEMPE_OK;
}

/* Gives the message of a part to the caller. */
static kempe_status say_why(const ensemble_part *p, kempe_status status)
{
    kempe_context *context = kmp_model_context(p->whole->model), *own = p->engine->context;
    if (status >= 0 || own == context)
        return status;
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(context)
                                    : kmp_fail(context, status, "%s", kempe_context_message(own));
}

kempe_status kempe_ensemble_stepper_begin(kempe_ensemble_stepper *s, int k, const double *q, const double *qd)
{
    KMP_WANTED(NULL, s, "stepper");
    kmp_model_begin(s->model);
    if (k < 0 || k >= s->count)
        return kmp_fail(kmp_model_context(s->model), KEMPE_E_ARGUMENT, "instance %d does not exist: the stepper has %d",
                        k, s->count);
    ensemble_part *p = part_of(s, k);
    kmp_context_clear(p->engine->context);
    return say_why(p, begin(p, k, q, qd));
}

/* -- steps ------------------------------------------------------------------------------------------- */

static bool moves(const kempe_ensemble_stepper *s, int k)
{
    return !isnan(s->step.t[k]) && !s->instance[k].lost;
}

static const double *values_of(const kempe_ensemble_stepper *s, int k)
{
    return s->step.values ? s->step.values + (size_t)k * (size_t)s->step.input_count : NULL;
}

/* The outputs of a row that lanes have reached. */
static void find_outputs(ensemble_part *p, int k)
{
    const kempe_ensemble_stepper *s = p->whole;
    const int i = k - p->first;
    if (!s->step.outputs)
        return;
    kmp_lane_steps_row(p->engine, i, kmp_outputs_are_late(p->outputs), p->row);
    kmp_outputs_with_inputs(p->outputs, kmp_lane_steps_inputs(p->engine, i), kmp_lane_steps_time(p->engine, i), p->row,
                            s->step.outputs + (size_t)k * (size_t)s->value_count);
}

/* Makes a step by the stepper of an instance. */
static kempe_status step_single(ensemble_part *p, int k)
{
    const kempe_ensemble_stepper *s = p->whole;
    const ensemble_step *step = &s->step;
    one_instance *one = &s->instance[k];
    const double *values = values_of(s, k);
    bool taken = false;
    kempe_status status = KEMPE_OK;
    for (int j = 0; j < step->input_count && status == KEMPE_OK; j++)
        status = kempe_stepper_set_input(one->stepper, step->inputs[j], values[j]);
    if (status == KEMPE_OK)
        status = kempe_stepper_advance(one->stepper, step->t[k]);
    if (status < 0 && status != KEMPE_E_FAILED)
        return status;
    KMP_TRY(note_stepper(p, k, status));
    if (step->outputs)
        KMP_TRY(kempe_outputs_at_stepper(p->outputs, one->stepper, step->outputs + (size_t)k * (size_t)s->value_count));
    if (status == KEMPE_OK && !s->no_lanes)
        KMP_TRY(kmp_lane_steps_take_back(p->engine, k - p->first, one->stepper->runner, step->t[k], &taken));
    one->single = !taken;
    return KEMPE_OK;
}

/* Gives the stepper of an instance that has left the lanes its state at the beginning of its step. */
static kempe_status hand_over(ensemble_part *p, int k)
{
    one_instance *one = &p->whole->instance[k];
    kmp_lane_handed handed;
    KMP_TRY(need_stepper(p, one));
    if (!kmp_lane_steps_hand_over(p->engine, k - p->first, &handed))
        return kmp_fail(p->engine->context, KEMPE_E_FAILED, "the closures are singular at the beginning of the step");
    const kmp_stepper_start start = {.t = handed.t,
                                     .work = handed.work,
                                     .step = handed.h,
                                     .rate_scale = handed.rate_scale,
                                     .q = handed.row,
                                     .qd = handed.row + p->whole->n,
                                     .modes = handed.modes,
                                     .memory = handed.memory,
                                     .inputs = handed.inputs};
    return kmp_stepper_continue(one->stepper, &start);
}

/* Makes the step of an instance that has left the lanes, from its beginning. */
static kempe_status step_after_lanes(ensemble_part *p, int k)
{
    one_instance *one = &p->whole->instance[k];
    const kempe_status status = hand_over(p, k);
    one->single = status == KEMPE_OK;
    if (one->single)
        return step_single(p, k);
    if (status < 0 && status != KEMPE_E_FAILED)
        return status;
    one->lost = true;
    find_outputs(p, k);
    return note(one, status, kempe_context_message(p->engine->context));
}

/* Settles the step that lanes have made, or have not. */
static kempe_status settle(ensemble_part *p, int k)
{
    one_instance *one = &p->whole->instance[k];
    if (kmp_lane_steps_settle(p->engine, k - p->first)) {
        find_outputs(p, k);
        if (p->whole->spec.open_integrator && kmp_lane_steps_dismiss(p->engine, k - p->first))
            set_labours(one, true); /* from the next step on */
        return note(one, KEMPE_OK, NULL);
    }
    const bool leaves = kmp_lane_steps_absence(p->engine, k - p->first) && !kmp_interrupted(p->engine->context);
    return leaves ? step_after_lanes(p, k) : note(one, KEMPE_STOPPED, "interrupted");
}

/* Makes the steps of a part: first all in lanes. */
static kempe_status step_part(ensemble_part *p)
{
    const kempe_ensemble_stepper *s = p->whole;
    const ensemble_step *step = &s->step;
    kmp_engine *e = p->engine;
    const int end = p->first + p->count;
    kempe_status status = KEMPE_OK;
    for (int k = p->first; k < end && status == KEMPE_OK && !s->no_lanes; k++)
        if (moves(s, k) && !s->instance[k].single && !s->instance[k].labours)
            status =
                kmp_lane_steps_prepare(e, k - p->first, step->t[k], step->input_count, step->inputs, values_of(s, k));
    if (status == KEMPE_OK && !s->no_lanes)
        status = kmp_engine_run_pools(e);
    for (int k = p->first; k < end && status == KEMPE_OK; k++) {
        if (!moves(s, k))
            continue;
        if (kmp_interrupted(e->context) && s->instance[k].single)
            status = note(&s->instance[k], KEMPE_STOPPED, "interrupted");
        else
            status = s->instance[k].single ? step_single(p, k) : settle(p, k);
    }
    return status;
}

static void run_part(void *self, int part)
{
    kempe_ensemble_stepper *s = self;
    ensemble_part *p = &s->part[part];
    kmp_context_clear(p->engine->context);
    p->status = step_part(p);
}

static kempe_status check_step(const kempe_ensemble_stepper *s, const ensemble_step *step)
{
    kempe_context *context = kmp_model_context(s->model);
    const int given = kempe_model_input_count(s->model);
    for (int j = 0; j < step->input_count; j++)
        if (step->inputs[j] < 0 || step->inputs[j] >= given)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "there is no input %d: the model has %d", step->inputs[j],
                            given);
    for (int k = 0; k < s->count; k++) {
        if (isnan(step->t[k]))
            continue;
        const double here = kempe_ensemble_stepper_time(s, k),
                     *values = step->values + (size_t)k * (size_t)step->input_count;
        if (!s->instance[k].begun)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "instance %d has not begun", k);
        if (!(step->t[k] >= here) || step->t[k] > kmp_last_equal(s->spec.t_end))
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "instance %d: t = %.9g s is not between here (%.9g s) and t_end = %g s", k, step->t[k],
                            here, s->spec.t_end);
        for (int j = 0; j < step->input_count; j++)
            if (!isfinite(values[j]))
                return kmp_fail(context, KEMPE_E_ARGUMENT, "instance %d: input '%s' is not finite", k,
                                kempe_model_input_name(s->model, step->inputs[j]));
    }
    return KEMPE_OK;
}

/* Doubts instances, once for each reason, whatever instances it is of. */
static void report_marks(kempe_ensemble_stepper *s)
{
    const kempe_system *system = s->part->engine->s;
    for (int k = 0; k < system->events.count + 2 * system->use_count; k++) {
        bool left = false;
        for (int p = 0; kmp_ensemble_has_mark(system, k) && p < s->part_count; p++)
            left = atomic_exchange(&s->part[p].engine->s->left[k], false) || left;
        if (left && !s->doubted[k])
            (void)kmp_ensemble_report_mark(system, kmp_model_context(s->model), k);
        s->doubted[k] = s->doubted[k] || left;
    }
}

kempe_status kempe_ensemble_stepper_advance(kempe_ensemble_stepper *s, const double *t, int input_count,
                                            const int *inputs, const double *values, double *outputs)
{
    KMP_WANTED(NULL, s, "stepper");
    kempe_context *context = kmp_model_context(s->model);
    KMP_WANTED(context, t, "t");
    KMP_WANTED(context, input_count <= 0 || inputs, "inputs");
    KMP_WANTED(context, input_count <= 0 || values, "values");
    kmp_model_begin(s->model);
    const ensemble_step step = {t, values, input_count > 0 ? input_count : 0, inputs, outputs};
    KMP_TRY(check_step(s, &step));
    s->step = step;
    const bool quiet = kmp_context_quiet(context, true);
    kmp_team_run(s->team, s->part_count, run_part, s);
    (void)kmp_context_quiet(context, quiet);
    for (int k = 0; k < s->part_count; k++)
        if (s->part[k].status != KEMPE_OK)
            return say_why(&s->part[k], s->part[k].status);
    kmp_context_clear(context);
    report_marks(s);
    return kmp_interrupted(context) ? KEMPE_STOPPED : KEMPE_OK;
}

/* -- getters ----------------------------------------------------------------------------------------- */

static int count_ended(const kempe_ensemble_stepper *s)
{
    int count = 0;
    for (int k = 0; k < s->count; k++)
        count += s->instance[k].begun && s->instance[k].status != KEMPE_OK;
    return count;
}

KMP_GETTER(int kempe_ensemble_stepper_count(const kempe_ensemble_stepper *s), s, s->count, 0)
KMP_GETTER(int kempe_ensemble_stepper_value_count(const kempe_ensemble_stepper *s), s, s->value_count, 0)
KMP_GETTER(const char *kempe_ensemble_stepper_value_name(const kempe_ensemble_stepper *s, int value), s,
           kempe_outputs_name(s->part->outputs, value), NULL)
KMP_GETTER(int kempe_ensemble_stepper_ended_count(const kempe_ensemble_stepper *s), s, count_ended(s), 0)
KMP_GETTER(const char *kempe_ensemble_stepper_no_lanes(const kempe_ensemble_stepper *s), s,
           s->no_lanes ? s->no_lanes : "", "")

/* The instance k, if it has begun. */
static const one_instance *begun(const kempe_ensemble_stepper *s, int k)
{
    return s && k >= 0 && k < s->count && s->instance[k].begun ? &s->instance[k] : NULL;
}

const char *kempe_ensemble_stepper_single(const kempe_ensemble_stepper *s, int k)
{
    const one_instance *one = begun(s, k);
    if (!one || !one->single)
        return "";
    const ensemble_part *p = part_of(s, k);
    const char *why = s->no_lanes ? s->no_lanes : kmp_lane_steps_absence(p->engine, k - p->first);
    return why ? why : "";
}

double kempe_ensemble_stepper_time(const kempe_ensemble_stepper *s, int k)
{
    const one_instance *one = begun(s, k);
    if (!one)
        return NAN;
    const ensemble_part *p = part_of(s, k);
    return one->single ? kempe_stepper_time(one->stepper) : kmp_lane_steps_time(p->engine, k - p->first);
}

const double *kempe_ensemble_stepper_q(const kempe_ensemble_stepper *s, int k)
{
    return begun(s, k) ? s->q + (size_t)k * (size_t)s->n : NULL;
}

const double *kempe_ensemble_stepper_qd(const kempe_ensemble_stepper *s, int k)
{
    return begun(s, k) ? s->qd + (size_t)k * (size_t)s->n : NULL;
}

kempe_outcome kempe_ensemble_stepper_outcome(const kempe_ensemble_stepper *s, int k)
{
    const one_instance *one = begun(s, k);
    return one ? kmp_outcome_checked(one->status, false) : KEMPE_OUTCOME_NONE;
}

const char *kempe_ensemble_stepper_reason(const kempe_ensemble_stepper *s, int k)
{
    const one_instance *one = begun(s, k);
    return one && one->reason ? one->reason : "";
}
