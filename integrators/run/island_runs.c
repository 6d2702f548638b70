/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of all parts are kept until the last part has run; then they are put together by their times. */
#include "integrators/run/island_runs.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/rounding.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/intended_rank.h"
#include "dynamics/program_cache.h"
#include "integrators/formulations/run_log.h"
#include "model/data/body.h"
#include "model/data/closure_table.h"
#include "model/data/islands.h"
#include "model/data/model.h"
#include "platform/platform.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- systems of the parts -------------------------------------------------------------------------------- */

/* The parts of a model as they were found, as long as a system of one of them lasts. */
typedef struct part_models {
    kmp_islands *islands;
    int uses;
} part_models;

/* A part with its system. */
typedef struct part_system {
    part_models *home;
    const kmp_island *island;
    kempe_system *system;
    int *row; /* of each of its rows: the row of the whole system */
} part_system;

struct kmp_island_systems {
    kmp_arena arena;
    int count;
    part_system *part;
};

static void leave(part_models *home)
{
    if (!home || --home->uses > 0)
        return;
    kmp_islands_free(home->islands);
    kmp_free(home);
}

static void systems_free(void *made)
{
    struct kmp_island_systems *all = made;
    for (int i = 0; i < all->count; i++) {
        kempe_system_free(all->part[i].system);
        leave(all->part[i].home);
    }
    kmp_arena_free(&all->arena);
    kmp_free(all);
}

void kmp_island_systems_free(struct kmp_island_systems *parts)
{
    if (parts)
        systems_free(parts);
}

/* True if two parts have the same elements: then they have the same equations. */
static bool same_part(const kmp_island *a, const kmp_island *b)
{
    const kempe_model *x = a->model, *y = b->model;
    return x->motion_count == y->motion_count && x->closure_count == y->closure_count &&
           x->force_count == y->force_count && x->body_count == y->body_count &&
           memcmp(a->motion, b->motion, (size_t)x->motion_count * sizeof *a->motion) == 0 &&
           memcmp(a->closure, b->closure, (size_t)x->closure_count * sizeof *a->closure) == 0;
}

/* Takes the system of a part from earlier ones. False: it is not there. */
static bool take_earlier(part_system *part, struct kmp_island_systems *earlier)
{
    for (int i = 0; earlier && i < earlier->count; i++) {
        part_system *old = &earlier->part[i];
        if (!old->system || !same_part(old->island, part->island))
            continue;
        leave(part->home);
        *part = *old;
        old->system = NULL;
        old->home = NULL;
        return true;
    }
    return false;
}

/* Finds the rows of the whole that a part has. False: no memory, or a row is not there. `first`: row of each closure.
 */
static bool find_rows(part_system *part, const kempe_system *whole, const int *first, kmp_arena *arena)
{
    const kempe_system *s = part->system;
    const int *closure = part->island->closure;
    int *rows = part->row = KMP_ARENA_NEW(arena, int, s->m);
    for (int r = 0; rows && r < s->m; r++) {
        const kmp_row *own = &s->rows[r];
        rows[r] = first[closure[own->closure]] + own->number;
        const kmp_row *there = rows[r] < whole->m ? &whole->rows[rows[r]] : own;
        if (there->closure != closure[own->closure] || there->component != own->component)
            return false;
    }
    return rows;
}

/* True if no body hangs on another one, and no closure but contacts and friction connects them: a search for fewer
 * operations would find next to nothing. */
static bool moves_freely(const kempe_model *model)
{
    bool freely = true;
    for (int b = 0; b < model->body_count; b++)
        freely = freely && model->bodies[b].parent <= 0;
    for (int c = 0; c < model->closure_count; c++)
        freely = freely && kmp_closure_is_of_modes(&model->closures[c]);
    return freely;
}

static kempe_status make_part(struct kmp_island_systems *all, const kempe_system *whole, const int *first, bool brief,
                              struct kmp_island_systems *earlier, part_system *part)
{
    if (!take_earlier(part, earlier)) {
        kempe_model *model = part->island->model;
        model->run.dynamics = whole->dynamics;
        KMP_TRY(brief && moves_freely(model) ? kmp_system_new_brief(model, whole->dynamics, &part->system)
                                             : kmp_system_new_by(model, NULL, &part->system));
    }
    if (find_rows(part, whole, first, &all->arena))
        return KEMPE_OK;
    return all->arena.failed ? kmp_fail_memory(whole->context)
                             : kmp_fail(whole->context, KEMPE_E_BUG, "a part of the model has other rows");
}

/* Makes the systems of parts, of which `home` has the models. */
static kempe_status make_systems(struct kmp_island_systems *all, const kempe_system *whole, part_models *home,
                                 bool complete, struct kmp_island_systems *earlier)
{
    const int count = home->islands->count;
    int *first = KMP_ARENA_NEW(&all->arena, int, whole->model->closure_count + 1), rows = 0;
    all->part = KMP_ARENA_NEW(&all->arena, part_system, count);
    KMP_TRY(kmp_made(whole->context, !all->arena.failed));
    for (int r = whole->m; r-- > 0;)
        first[whole->rows[r].closure] = r;
    for (; all->count < count; all->count++, home->uses++)
        all->part[all->count] = (part_system){.home = home, .island = &home->islands->island[all->count]};
    for (int i = 0; i < count; i++) {
        KMP_TRY(make_part(all, whole, first, !complete, earlier, &all->part[i]));
        rows += all->part[i].system->m;
    }
    return rows == whole->m || count == 0 || !complete
               ? KEMPE_OK
               : kmp_fail(whole->context, KEMPE_E_BUG, "parts of the model lack rows");
}

kempe_status kmp_island_systems_new(const kempe_system *system, const bool *left_out,
                                    struct kmp_island_systems *earlier, struct kmp_island_systems **parts)
{
    KMP_MAKE(system->context, struct kmp_island_systems, all);
    part_models *home = KMP_NEW(part_models, 1);
    kempe_status status = kmp_made(system->context, home);
    if (status == KEMPE_OK) {
        home->uses = 1;
        status = kmp_islands_new(system->model, left_out, &home->islands);
        if (status == KEMPE_OK)
            status = make_systems(all, system, home, !left_out, earlier);
        leave(home);
    }
    return KMP_GIVE_OR_FREE(status, parts, all, systems_free);
}

bool kmp_runs_as_whole(const kempe_system *s, const kmp_run_spec *spec)
{
    return s->force || kmp_rounding_of(s) || s->frictionless || spec->u_count > 0 || spec->max_steps > 0 ||
           spec->recording || spec->kept_past || spec->kind || spec->step || spec->sample || spec->slopes ||
           spec->mode_start || spec->memory_start || spec->due || spec->inputs_start || spec->past_start;
}

/* The parts have the scales of the whole. */
static kempe_status take_scales(struct kmp_island_systems *parts, const kempe_system *whole)
{
    for (int i = 0; i < parts->count; i++) {
        kempe_system *s = parts->part[i].system;
        s->kept_length = whole->length;
        KMP_TRY(kmp_made(whole->context, kmp_system_rescale(s)));
        s->closure_tolerance = whole->closure_tolerance;
    }
    return KEMPE_OK;
}

static kempe_status find_kept(const kempe_system *s, bool scales, const struct kmp_island_systems **parts)
{
    const kmp_program_cache_name name = {.what = scales ? "islands of states" : "islands"};
    const struct kmp_island_systems *found = kmp_program_cache_find(s, name);
    if (!found) {
        struct kmp_island_systems *all;
        KMP_TRY(kmp_island_systems_new(s, NULL, NULL, &all));
        const kempe_status status = scales ? take_scales(all, s) : KEMPE_OK;
        if (status != KEMPE_OK)
            kmp_island_systems_free(all);
        KMP_TRY(status);
        found = kmp_program_cache_add(s, name, all, systems_free);
        KMP_TRY(kmp_made(s->context, found));
    }
    *parts = found->count > 0 ? found : NULL;
    return KEMPE_OK;
}

kempe_status kmp_island_systems_of(const kempe_system *s, const kmp_run_spec *spec,
                                   const struct kmp_island_systems **parts)
{
    *parts = NULL;
    return kmp_runs_as_whole(s, spec) ? KEMPE_OK : find_kept(s, false, parts);
}

kempe_status kmp_island_systems_of_states(const kempe_system *s, const struct kmp_island_systems **parts)
{
    const kmp_run_spec plain = {0};
    *parts = NULL;
    return kmp_runs_as_whole(s, &plain) ? KEMPE_OK : find_kept(s, true, parts);
}

int kmp_island_systems_count(const struct kmp_island_systems *parts)
{
    return parts->count;
}

const kempe_system *kmp_island_system(const struct kmp_island_systems *parts, int i, const int **motion)
{
    *motion = parts->part[i].island->motion;
    return parts->part[i].system;
}

const int *kmp_island_closures(const struct kmp_island_systems *parts, int i)
{
    return parts->part[i].island->closure;
}

/* -- runs ------------------------------------------------------------------------------------------------ */

/* The rows of a part: q, qd, qdd, lambda, work. */
typedef struct part_rows {
    int width, count, most;
    double *row;
} part_rows;

static int keep_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    part_rows *rows = user;
    (void)t, (void)qd, (void)qdd, (void)lambda; /* they follow q */
    if (rows->count == rows->most)
        return 0;
    double *to = rows->row + (ptrdiff_t)rows->count++ * rows->width;
    memcpy(to, q, (size_t)(rows->width - 1) * sizeof *to);
    to[rows->width - 1] = work;
    return 0;
}

/* A run by parts, under way. */
typedef struct part_runs {
    const struct kmp_island_systems *parts;
    const kempe_system *system;
    const kmp_run_spec *spec;
    const kempe_assembly *start;
    kmp_arena arena;
    part_rows *rows; /* by parts */
    kmp_run_log *log;
    kmp_run_fn *run;        /* of a part */
    kmp_run_report *report; /* of all */
    kempe_status status;    /* of the first part that did not come to its end */
} part_runs;

void kmp_run_report_add(kmp_run_report *sum, const kmp_run_report *part)
{
    sum->steps += part->steps;
    sum->rejected += part->rejected;
    sum->refused += part->refused;
    sum->rhs += part->rhs;
    sum->newton += part->newton;
    sum->jacobians += part->jacobians;
    sum->factorizations += part->factorizations;
    sum->exchanges += part->exchanges;
    sum->centrings += part->centrings;
    sum->events += part->events;
    sum->impacts = part->impacts < 0 ? sum->impacts : (sum->impacts < 0 ? 0 : sum->impacts) + part->impacts;
    sum->changes = part->changes < 0 ? sum->changes : (sum->changes < 0 ? 0 : sum->changes) + part->changes;
    sum->cut = sum->cut || part->cut;
    sum->prescribed = sum->prescribed && part->prescribed;
    sum->by_bodies = sum->by_bodies || part->by_bodies;
    sum->rate_scale = fmax(sum->rate_scale, part->rate_scale);
    sum->cpu_s += part->cpu_s;
    sum->build_s += part->build_s;
    sum->chosen_ratio = fmax(sum->chosen_ratio, part->chosen_ratio);
    sum->integrator = part->integrator ? part->integrator : sum->integrator;
    if (part->continued && (!sum->continued || part->continued_t < sum->continued_t)) {
        sum->continued = part->continued;
        sum->continued_t = part->continued_t;
    }
}

/* The start of part i; false: no memory. */
static bool take_start(part_runs *all, int i, kempe_assembly *start)
{
    const kempe_assembly *from = all->start;
    const kempe_system *s = all->parts->part[i].system, *whole = all->system;
    const int *motion = all->parts->part[i].island->motion, charts = from->inner_q ? s->chart_count : 0;
    *start = (kempe_assembly){.system = s, .closed = true};
    if (!KMP_ARENA_MAKE(&all->arena, KMP_ROOM(double, s->n, &start->q, &start->qd)) ||
        (charts > 0 && !KMP_ARENA_MAKE(&all->arena, KMP_ROOM(double, s->n, &start->inner_q, &start->inner_qd),
                                       KMP_ROOM(double, KMP_CHART_SIZE *charts, &start->chart))))
        return false;
    for (int k = 0; k < s->n; k++) {
        start->q[k] = from->q[motion[k]];
        start->qd[k] = from->qd[motion[k]];
        if (charts > 0) {
            start->inner_q[k] = from->inner_q[motion[k]];
            start->inner_qd[k] = from->inner_qd[motion[k]];
        }
    }
    for (int c = 0; c < charts; c++)
        memcpy(start->chart + (ptrdiff_t)KMP_CHART_SIZE * c,
               from->chart + (ptrdiff_t)KMP_CHART_SIZE * kmp_chart_of(whole, motion[s->chart_first[c]]),
               KMP_CHART_SIZE * sizeof(double));
    return true;
}

/* Runs part i. The part that ends first gives the reason and the time of the whole. */
static kempe_status run_part(part_runs *all, int i)
{
    const kempe_system *s = all->parts->part[i].system;
    kmp_run_spec spec = *all->spec;
    kmp_run_report report = {0};
    part_rows *rows = &all->rows[i];
    kempe_assembly start;
    *rows = (part_rows){.width = 3 * s->n + s->m + 1, .most = spec.time_count};
    rows->row = KMP_ARENA_NEW(&all->arena, double, rows->most * rows->width);
    KMP_TRY(kmp_made(s->context, take_start(all, i, &start) && !all->arena.failed));
    spec.log = &all->log[i];
    spec.work_start = 0; /* which a part without such forces would not keep */
    spec.threads = 1;
    spec.limit_s = spec.limit_s > 0 ? fmax(spec.limit_s - all->report->cpu_s, DBL_MIN) : 0;
    spec.part = i;
    spec.parts = all->parts->count;
    kempe_status status = all->run(s, &spec, &start, keep_row, rows, &report);
    kmp_run_report_add(all->report, &report);
    all->report->least += report.least;
    all->report->most += report.most;
    const bool first = status != KEMPE_OK && (all->status == KEMPE_OK || report.t < all->report->t);
    if (first) {
        kmp_free(all->report->reason);
        all->report->reason = report.reason;
        all->report->t = report.t;
        all->status = status;
    } else {
        kmp_free(report.reason);
    }
    const bool goes_on = status == KEMPE_OK || status == KEMPE_E_FAILED || status == KEMPE_STOPPED;
    return report.cut || !goes_on ? status : KEMPE_OK;
}

/* -- together -------------------------------------------------------------------------------------------- */

/* Delivers the rows that all parts have. */
static kempe_status deliver(const part_runs *all, kmp_row_fn *take, void *user)
{
    const kempe_system *s = all->system;
    const int parts = all->parts->count;
    int count = all->spec->time_count;
    double *row = KMP_NEW(double, 3 * s->n + s->m + 1);
    KMP_TRY(kmp_made(s->context, row));
    for (int i = 0; i < parts; i++)
        count = all->rows[i].count < count ? all->rows[i].count : count;
    int given = 0;
    for (; given < count; given++) {
        double work = all->spec->work_start;
        for (int i = 0; i < parts; i++) {
            const part_rows *rows = &all->rows[i];
            const double *from = rows->row + (ptrdiff_t)given * rows->width;
            const int n = all->parts->part[i].system->n, m = all->parts->part[i].system->m;
            const int *motion = all->parts->part[i].island->motion;
            for (int k = 0; k < n; k++)
                for (int part = 0; part < 3; part++)
                    row[part * s->n + motion[k]] = from[part * n + k];
            for (int r = 0; r < m; r++)
                row[3 * s->n + all->parts->part[i].row[r]] = from[3 * n + r];
            work += from[3 * n + m];
        }
        if (take(user, all->spec->times[given], row, row + s->n, row + 2 * s->n, row + 3 * s->n, work))
            break;
    }
    kmp_free(row);
    return kmp_made(s->context, given == count);
}

kempe_status kmp_island_runs(const struct kmp_island_systems *parts, const kempe_system *system,
                             const kmp_run_spec *spec, const kempe_assembly *start, kmp_run_fn *run, kmp_row_fn *row,
                             void *user, kmp_run_report *report)
{
    const size_t heap = kmp_heap_in_use();
    part_runs all = {.parts = parts, .system = system, .spec = spec, .start = start, .run = run, .report = report};
    *report = KMP_RUN_REPORT_NONE(spec->t_end);
    report->least = report->most = spec->work_start;
    const int count = parts->count;
    kempe_status status = KEMPE_OK;
    if (!KMP_ARENA_MAKE(&all.arena, KMP_ROOM(part_rows, count, &all.rows), KMP_ROOM(kmp_run_log, count, &all.log)))
        status = kmp_fail_memory(system->context);
    for (int i = 0; i < count && status == KEMPE_OK; i++)
        status = run_part(&all, i);
    const double until = all.status == KEMPE_OK ? INFINITY : report->t;
    if (all.log && !kmp_run_log_merge(spec->log, system->context, all.log, count, until))
        status = kmp_fail_memory(system->context);
    const bool complete = status == KEMPE_OK;
    if (complete || status == KEMPE_STOPPED) {
        const kempe_status given = deliver(&all, row, user);
        status = given != KEMPE_OK ? given : complete ? all.status : status;
    }
    report->heap = heap > 0 ? kmp_heap_in_use() - heap : 0;
    kmp_arena_free(&all.arena);
    return status;
}
