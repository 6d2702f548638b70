/* SPDX-License-Identifier: BSD-3-Clause */
/* Threads share the instances in chunks, and each thread has its own engine. The calling thread runs the first engine
 * and reports the progress. Every other thread makes its engine when it takes its first chunk. */
#include "ensemble/lanes/ensemble_run.h"
#include "base/memory.h"
#include "base/thread_pool.h"
#include "constraints/closing/assembly.h"
#include "constraints/diagnosis/shared_loads.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/run/methods.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "model/read/loads.h"
#include "platform/platform.h"
#include <math.h>
#include <pthread.h>
#include <string.h>

enum {
    MOST_CHUNK = 1024, /* instances: little memory, and few lanes that are empty at its end */
    LEAST_ROUNDS = 2,  /* a chunk fills all lanes this number of times */
    PARTS = 2,         /* and is a part of what each thread still has to do: the last chunks are small */
    ONE_REGISTER = 8,  /* lanes */
    MOST_WIDE = 20     /* coordinates: two registers take as long as one with 19 to 25, 1.6 times as long with 63 */
};

struct kmp_ensemble {
    const kempe_model *model;
    int columns, n;
    const char *const *names;
    kmp_engine *engine[KMP_TEAM_MOST]; /* NULL: not made yet */
    kmp_ensemble_work work;
};

kempe_status kmp_ensemble_new(const kempe_model *model, int count, const char *const *names, kmp_ensemble **ensemble)
{
    KMP_MAKE(model->context, kmp_ensemble, e);
    *e = (kmp_ensemble){.model = model, .columns = count, .names = names};
    kempe_status status = kmp_engine_new(model, count, names, false, &e->engine[0]);
    if (status == KEMPE_OK)
        e->n = e->engine[0]->n;
    return KMP_GIVE_OR_FREE(status, ensemble, e, kmp_ensemble_free);
}

void kmp_ensemble_free(kmp_ensemble *e)
{
    if (!e)
        return;
    for (int k = 0; k < KMP_TEAM_MOST; k++)
        kmp_engine_free(e->engine[k]);
    kmp_free(e);
}

const kempe_system *kmp_ensemble_system(const kmp_ensemble *e)
{
    return e->engine[0]->s;
}

kmp_ensemble_work kmp_ensemble_get_work(const kmp_ensemble *e)
{
    return e->work;
}

/* -- a run ------------------------------------------------------------------------------------------- */

/* A run that threads share. */
typedef struct shared_run {
    kmp_ensemble *e;
    const kmp_run_spec *spec;
    const kmp_ensemble_execution *execution;
    int count, threads, least; /* least: instances of a chunk */
    atomic_int next;           /* instance of the next chunk */
    const double *values;
    kmp_ensemble_result *results;
    double *q, *qd;
    pthread_t caller;
    atomic_bool busy[KMP_TEAM_MOST]; /* engines; the first is the caller's */
    bool begun[KMP_TEAM_MOST];
    atomic_int status; /* of a chunk that failed */
    kmp_ensemble_done done;
} shared_run;

/* Takes an engine that no other thread uses; there are as many as threads. */
static int take_engine(shared_run *r)
{
    if (pthread_equal(pthread_self(), r->caller))
        return 0;
    for (int k = 1;; k = k + 1 < r->threads ? k + 1 : 1)
        if (!atomic_exchange(&r->busy[k], true))
            return k;
}

/* Takes the next chunk; returns the number of its instances, 0: all are taken. */
static int take_chunk(shared_run *r, int *first)
{
    int size;
    *first = atomic_load(&r->next);
    do {
        int left = r->count - *first, part = left / (PARTS * r->threads);
        size = r->threads == 1 || part > MOST_CHUNK ? MOST_CHUNK : part < r->least ? r->least : part;
        size = size < left ? size : left;
    } while (size > 0 && !atomic_compare_exchange_weak(&r->next, first, *first + size));
    return size;
}

/* Runs a chunk by engine k, which begins at its first one. */
static kempe_status run_chunk(shared_run *r, int k, size_t first, int count)
{
    kmp_ensemble *e = r->e;
    const size_t n = (size_t)e->n;
    const kmp_run_quantities *quantities = r->execution->quantities;
    if (!r->begun[k] && !e->engine[k])
        KMP_TRY(kmp_engine_new(e->model, e->columns, e->names, true, &e->engine[k]));
    if (!r->begun[k]) {
        r->begun[k] = true;
        KMP_TRY(kmp_engine_begin(e->engine[k], r->spec, r->execution, &r->done));
    }
    e->engine[k]->taken = quantities ? r->execution->taken + first * (size_t)quantities->values : NULL;
    e->engine[k]->starts = r->execution->starts ? r->execution->starts + first * 2 * n : NULL;
    return kmp_engine_run(e->engine[k], count, r->values + first * (size_t)e->columns, r->results + first,
                          r->q + first * n, r->qd + first * n);
}

/* A thread's work: chunk after chunk. */
static void run_chunks(void *self, int thread)
{
    shared_run *r = self;
    int k = take_engine(r), first, count, none = KEMPE_OK;
    kempe_status status = KEMPE_OK;
    (void)thread;
    while (status == KEMPE_OK && atomic_load(&r->status) == KEMPE_OK && !kmp_interrupted(r->e->model->context) &&
           (count = take_chunk(r, &first)) > 0)
        status = run_chunk(r, k, (size_t)first, count);
    if (status != KEMPE_OK)
        (void)atomic_compare_exchange_strong(&r->status, &none, (int)status);
    atomic_store(&r->busy[k], false);
}

int kmp_ensemble_width(const kempe_system *system, int width, int instances, int threads)
{
    int best = kmp_lanes_best();
    if (width > 0)
        return width;
    bool large = system->n > MOST_WIDE, few = instances < LEAST_ROUNDS * best * threads;
    return best > ONE_REGISTER && (large || few) ? ONE_REGISTER : best;
}

/* Instances still marked as stopped, but not by their own conditions, were interrupted. */
static kempe_status say_interrupted(const shared_run *r)
{
    bool ok = true;
    for (int i = 0; i < r->count && ok; i++) {
        kmp_ensemble_result *result = &r->results[i];
        if (result->status == KEMPE_STOPPED && !result->reason)
            ok = (result->reason = kmp_strdup("interrupted"));
    }
    return kmp_made(r->e->model->context, ok);
}

static kempe_status run_all(shared_run *r)
{
    kempe_context *context = r->e->model->context;
    double wall = kmp_wall_now(), cpu = kmp_cpu_now();
    for (int i = 0; i < r->count; i++)
        r->results[i] = (kmp_ensemble_result){.status = KEMPE_STOPPED, .h = NAN, .hdot = NAN, .drift = NAN};
    for (size_t k = 0; k < (size_t)r->count * (size_t)r->e->n; k++)
        r->q[k] = r->qd[k] = NAN;
    const kmp_run_quantities *quantities = r->execution->quantities;
    for (size_t k = 0; quantities && k < (size_t)r->count * (size_t)quantities->values; k++)
        r->execution->taken[k] = NAN;
    int most = (r->count + r->least - 1) / r->least;
    r->threads = most < 1 ? 1 : most < r->threads ? most : r->threads;
    kmp_team *team = kmp_team_new(r->threads);
    KMP_TRY(kmp_made(context, team));
    r->e->work = (kmp_ensemble_work){0};
    kmp_team_run(team, r->threads, run_chunks, r);
    /* Ends the engines, and adds up their work. */
    kmp_ensemble *e = r->e;
    e->work.threads = r->threads;
    for (int k = 0; k < r->threads; k++) {
        if (!r->begun[k])
            continue;
        const kmp_ensemble_work *part = &e->engine[k]->work;
        e->work.width = part->width;
        e->work.native = e->work.native || part->native;
        e->work.alone += part->alone;
        e->work.sweeps += part->sweeps;
        e->work.lane_steps += part->lane_steps;
        for (int i = 0; i < e->engine[k]->pool_count; i++) {
            bool new = true;
            for (int j = 0; j < k && new; j++)
                new = !r->begun[j] || !kmp_lane_group_among(e->engine[j], e->engine[k]->pools[i]);
            e->work.pools += new;
        }
    }
    for (int k = 0; k < r->threads; k++)
        if (r->begun[k])
            kmp_engine_end(e->engine[k]);
    r->e->work.cpu_s = kmp_cpu_now() - cpu + kmp_team_cpu(team);
    r->e->work.wall_s = kmp_wall_now() - wall;
    kmp_team_free(team);
    kempe_status status = (kempe_status)atomic_load(&r->status);
    if (status == KEMPE_OK)
        return say_interrupted(r);
    return *kempe_context_message(context) ? status : kmp_fail_memory(context); /* another thread's message is lost */
}

bool kmp_ensemble_report_mark(const kempe_system *s, kempe_context *context, int k)
{
    const kmp_condition *condition = k < s->events.count ? &s->events.condition[k] : NULL;
    if (condition && condition->at_start) {
        kmp_log(context, KEMPE_LOG_WARNING, "in instances: %s", s->event_text[k]);
        return false;
    }
    if (condition && condition->role == KMP_ROLE_SENSE) {
        kmp_doubt(
            context,
            "friction makes the motion depend on the forces of redundant contacts in instances, such as '%s', which "
            "are not unique. Use fewer contacts, or a compliant 'law'",
            ((const kmp_force *)condition->of)->name);
    } else if (condition && condition->validity == KMP_VALIDITY_LEVEL) {
        kmp_doubt(context, "friction '%s' has a negative level in instances: it would push",
                  ((const kmp_force *)condition->of)->name);
    } else if (condition && condition->validity >= KMP_VALIDITY_DEFLECTION) {
        kmp_doubt(context, "in instances %s: %s", s->event_text[k],
                  condition->validity == KMP_VALIDITY_ROTATION
                      ? "without terms of second order its stiffness is lost at such speeds"
                      : "terms of second order suffice up to there");
    } else {
        const int of_use = k - s->events.count;
        const kmp_table_use *use = condition ? NULL : &s->use[of_use / 2];
        const kmp_named_table *table = condition ? condition->expr->table : &s->model->tables[use->table];
        const int end = condition ? condition->number - kmp_table_end_number(table, 0) : 2 * use->variable + of_use % 2;
        kmp_doubt(context,
                  "instances use table '%s' %s %.6g: it goes straight on there; give it more points, or say outside: "
                  "linear, hold or error",
                  table->name, end % 2 ? "above" : "below", kmp_table_end(table, end));
    }
    return true;
}

bool kmp_ensemble_has_mark(const kempe_system *s, int k)
{
    const kmp_condition *condition = k < s->events.count ? &s->events.condition[k] : NULL;
    return !condition || condition->validity != KMP_VALIDITY_NONE || condition->at_start ||
           (condition->role == KMP_ROLE_SENSE && ((const kmp_force *)condition->of)->kind == KMP_FORCE_TOUCH);
}

/* The first contact with a mark of a role in some engine; NULL: none. Marks are forgotten. */
static const char *take_contact(const kmp_ensemble *e, kmp_role role)
{
    const kmp_events *events = &e->engine[0]->s->events;
    const char *name = NULL;
    for (int k = 0; k < events->count; k++) {
        const kmp_force *force = events->condition[k].of;
        if (events->condition[k].role != role || force->kind != KMP_FORCE_TOUCH)
            continue;
        for (int i = 0; i < KMP_TEAM_MOST; i++)
            if (e->engine[i] && atomic_exchange(&e->engine[i]->s->left[k], false) && !name)
                name = force->name;
    }
    return name;
}

/* Warns of quantities by forces that rigid bodies leave open, and of means across impacts. */
static void report_contacts(const kmp_ensemble *e, const kmp_run_quantities *quantities, bool reports)
{
    const char *shares = take_contact(e, KMP_ROLE_HELD), *struck = take_contact(e, KMP_ROLE_LEVEL);
    if (!reports || !quantities)
        return;
    if (shares && quantities->loads)
        kmp_log(e->model->context, KEMPE_LOG_WARNING,
                "the forces of redundant contacts are not unique in instances, such as '%s', and quantities are of one "
                "solution",
                shares);
    for (int k = 0; struck && k < quantities->count; k++)
        if (quantities->of[k].averages) {
            kmp_log(e->model->context, KEMPE_LOG_WARNING,
                    "quantity '%s' lacks the impulses of impacts, such as of '%s', where forces and accelerations are "
                    "infinite: use a compliant 'law'",
                    quantities->name[quantities->of[k].first_value], struck);
            break;
        }
}

/* Reports the marks of all engines, or forgets earlier ones. Deflections are reported with their instances,
 * and which instances depend on shared loads. */
static void report_conditions(kmp_ensemble *e, bool reports)
{
    const kempe_system *s = e->engine[0]->s;
    for (int k = 0; k < s->events.count + 2 * s->use_count; k++) {
        bool left = false;
        for (int i = 0; kmp_ensemble_has_mark(s, k) && i < KMP_TEAM_MOST; i++)
            left = (e->engine[i] && atomic_exchange(&e->engine[i]->s->left[k], false)) || left;
        const kmp_condition *condition = k < s->events.count ? &s->events.condition[k] : NULL;
        if (!left || !reports || (condition && condition->validity == KMP_VALIDITY_DEFLECTION))
            continue;
        const bool all = kmp_ensemble_report_mark(s, e->model->context, k);
        e->work.doubted = (all && !(condition && condition->role == KMP_ROLE_SENSE)) || e->work.doubted;
    }
}

kempe_status kmp_ensemble_time_scales(const kempe_system *system, const kmp_run_spec *spec, kmp_arena *arena,
                                      kmp_time_scales *found)
{
    return kmp_time_scales_find(system->model, system->parameters, spec->t_start, spec->t_end,
                                kmp_system_watches_loads(system) ? KMP_TIMED_ALL : KMP_TIMED_SHORT, arena, found);
}

kempe_status kmp_ensemble_limit_steps(const kempe_system *system, kmp_run_spec *spec, bool *open, bool *varies)
{
    kmp_time_scales scales;
    kmp_arena aside = {0};
    kempe_status status = kmp_ensemble_time_scales(system, spec, &aside, &scales);
    *open = status == KEMPE_OK && kmp_time_scales_doubt(system->context, &scales, spec->max_step);
    *varies = status == KEMPE_OK && scales.varies;
    if (status == KEMPE_OK && isfinite(scales.shortest))
        spec->max_step = spec->max_step > 0 ? fmin(spec->max_step, scales.shortest) : scales.shortest;
    kmp_arena_free(&aside);
    return status;
}

/* Friction by a load that is not unique, at the start of the model itself. */
static bool is_shared(const kempe_system *s)
{
    kempe_assembly *a = NULL;
    const kempe_status status = kmp_model_presses_friction(s->model) ? kmp_assemble_start(s, &a) : KEMPE_OK;
    const bool shared = status == KEMPE_OK && a && a->closed && kmp_doubt_shared_friction(s, 0, a->q);
    kempe_assembly_free(a);
    return shared;
}

kempe_status kmp_ensemble_run(kmp_ensemble *e, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              int instances, const double *values, kmp_ensemble_result *results, double *q, double *qd)
{
    kempe_context *context = e->model->context;
    kmp_run_spec resolved = *spec;
    kmp_context_clear(context);
    resolved.threads = 0; /* one thread per instance */
    KMP_TRY(kmp_run_resolve(e->engine[0]->s, &resolved));
    resolved.open = resolved.open || spec->open; /* it may have been resolved before */
    kmp_ensemble_execution chosen = *execution;
    bool open;
    chosen.max_step = resolved.max_step;
    KMP_TRY(kmp_ensemble_limit_steps(e->engine[0]->s, &resolved, &open, &chosen.own_pulses));
    int threads = execution->threads > 0 ? execution->threads : kmp_processors();
    chosen.width = kmp_ensemble_width(e->engine[0]->s, execution->width, instances, threads);
    resolved.open_integrator = false; /* an instance in lanes and one by itself have the same integrator */
    shared_run r = {.e = e,
                    .spec = &resolved,
                    .execution = &chosen,
                    .count = instances,
                    .threads = threads,
                    .values = values,
                    .results = results,
                    .q = q,
                    .qd = qd,
                    .caller = pthread_self(),
                    .least = execution->alone ? 1 : LEAST_ROUNDS * chosen.width,
                    .done = {.done = execution->before, .total = execution->total != 0 ? execution->total : instances}};
    const bool presses = is_shared(e->engine[0]->s), quiet = kmp_context_quiet(context, true);
    report_conditions(e, false);
    report_contacts(e, NULL, false);
    kempe_status status = run_all(&r);
    (void)kmp_context_quiet(context, quiet);
    for (int k = 0; k < KMP_TEAM_MOST && !open; k++)
        open = r.begun[k] && kmp_time_scales_doubt(context, &e->engine[k]->pulses, 0);
    e->work.doubted = open || presses;
    report_conditions(e, true);
    report_contacts(e, chosen.quantities, true);
    if (status == KEMPE_OK)
        kmp_context_clear(context);
    for (int i = 0; status != KEMPE_OK && i < instances; i++) {
        kmp_free(results[i].reason);
        results[i].reason = NULL;
    }
    return status;
}
