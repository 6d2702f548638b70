/* SPDX-License-Identifier: BSD-3-Clause */
/* The runner is advanced here step by step, so that unmonitored runs have no overhead; a run in parts has rows only.
 * When there is no more room for ranges of steps, neighbours are merged in pairs, and from then on each range has twice
 * as many steps. */
#include "report/step_record.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/run/methods.h"
#include "output/print.h"
#include <kempe/check.h>
#include <math.h>

/* -- steps ------------------------------------------------------------------------------------------- */

typedef struct watch {
    kmp_record *record;
    long in_last; /* steps in the last range */
} watch;

static void add_step(watch *w, double t, double step)
{
    kmp_record *record = w->record;
    if (record->range_count > 0 && w->in_last < record->each) {
        kmp_step_range *last = &record->ranges[record->range_count - 1];
        last->least = fmin(last->least, step);
        last->most = fmax(last->most, step);
        w->in_last++;
        return;
    }
    if (record->range_count == KMP_RECORD_RANGES) {
        /* Two ranges become one. */
        int half = record->range_count / 2;
        for (int k = 0; k < half; k++) {
            const kmp_step_range *a = &record->ranges[2 * k], *b = a + 1;
            record->ranges[k] = (kmp_step_range){a->t, fmin(a->least, b->least), fmax(a->most, b->most)};
        }
        record->range_count = half;
        record->each *= 2;
    }
    record->ranges[record->range_count++] = (kmp_step_range){t, step, step};
    w->in_last = 1;
}

/* -- rows -------------------------------------------------------------------------------------------- */

/* A run at work. */
typedef struct recording {
    kmp_runner *runner;
    const kmp_run_spec *spec;
    kmp_record *record;
    int rows;     /* after the row of the start */
    double *room; /* of a row */
} recording;

static kempe_status add_row(recording *r, double at)
{
    double work, *x = r->room;
    int n = r->record->row.n;
    KMP_TRY(kmp_runner_row(r->runner, at, x, &work));
    if (kmp_samples_add(&r->record->row, at, x, x + n, x + 2 * n, x + 3 * n, work))
        return kmp_fail_memory(r->record->log.context);
    return KEMPE_OK;
}

/* The rows that the last step has reached. */
static kempe_status deliver(recording *r)
{
    double t = kmp_runner_t(r->runner), begin = r->spec->t_start, end = r->spec->t_end;
    while (r->record->row.rows <= r->rows) {
        int k = r->record->row.rows;
        double at = k == r->rows ? end : begin + (end - begin) * k / r->rows;
        if (at > t)
            return KEMPE_OK;
        KMP_TRY(add_row(r, at));
    }
    return KEMPE_OK;
}

static kempe_status advance(recording *r)
{
    watch w = {r->record, 0};
    kempe_status status = deliver(r);
    while (status == KEMPE_OK && kmp_runner_t(r->runner) < r->spec->t_end && !kmp_runner_ended(r->runner)) {
        double before = kmp_runner_t(r->runner);
        status = kmp_runner_step(r->runner);
        double t = kmp_runner_t(r->runner);
        if (t > before)
            add_step(&w, before, t - before);
        if (kmp_has_result(status)) {
            kempe_status delivered = deliver(r);
            status = status == KEMPE_OK ? delivered : status;
        }
    }
    /* The last state of a run that ends before t_end. */
    const int rows = r->record->row.rows;
    const double t = kmp_runner_t(r->runner);
    if (kmp_has_result(status) && rows > 0 && t > kmp_samples_time(&r->record->row, rows - 1) &&
        add_row(r, t) == KEMPE_E_MEMORY)
        return KEMPE_E_MEMORY;
    return status;
}

/* -- a run in parts ------------------------------------------------------------------------------------ */

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    return kmp_samples_add(&((kmp_record *)user)->row, t, q, qd, qdd, lambda, work);
}

/* Steps of parts are not recorded. */
static kempe_status run_apart(recording *r, const kempe_system *system, const kmp_run_spec *spec,
                              const kempe_assembly *start)
{
    kmp_run_spec own = *spec;
    kmp_run_report report;
    double *times = KMP_ARENA_NEW(&r->record->arena, double, r->rows + 1);
    KMP_TRY(kmp_made(system->context, times));
    for (int k = 0; k <= r->rows; k++)
        times[k] = k == r->rows ? own.t_end : own.t_start + (own.t_end - own.t_start) * k / r->rows;
    own.times = times;
    own.time_count = r->rows + 1;
    kempe_status status = kmp_run(system, &own, start, take_row, r->record, &report);
    if (status == KEMPE_E_FAILED && report.reason)
        (void)kmp_fail(system->context, status, "%s", report.reason);
    kmp_free(report.reason);
    return status;
}

/* -- residuals and energy ---------------------------------------------------------------------------- */

/* Kinetic energy below this part of the potential's value counts as rounding, as in verdicts. */
#define AT_REST 1e-9

static kempe_status judge(const kempe_system *system, const char *backend, kmp_record *record)
{
    kmp_evaluator *eval = record->row.rows > 0 ? kmp_eval_new_for(system, backend, NULL, KMP_EVAL_WEIGHS) : NULL;
    if (!eval)
        return record->row.rows > 0 ? KEMPE_E_MEMORY : KEMPE_OK;
    for (int row = 0; row < record->row.rows; row++) {
        double t = kmp_samples_time(&record->row, row);
        const double *q = kmp_samples_get(&record->row, KMP_QUANTITY_Q, row);
        const double *qd = kmp_samples_get(&record->row, KMP_QUANTITY_QD, row);
        kmp_eval_closure(eval, t, q);
        kmp_eval_mass(eval);
        record->h[row] = kmp_eval_residual(eval);
        record->hdot[row] = kmp_eval_rate_residual(eval, qd);
        kmp_eval_energies(eval, qd, &record->kinetic[row], &record->potential[row]);
        record->energy[row] = record->kinetic[row] + record->potential[row] - kmp_samples_work(&record->row, row);
    }
    kmp_eval_free(eval);
    /* The change of the energy, relative to the kinetic energy or the range of the potential one. */
    double kinetic = 0, lowest = INFINITY, highest = -INFINITY, value = 0, first = record->energy[0];
    for (int k = 0; k < record->row.rows; k++) {
        kinetic = fmax(kinetic, record->kinetic[k]);
        lowest = fmin(lowest, record->potential[k]);
        highest = fmax(highest, record->potential[k]);
        value = fmax(value, fabs(record->potential[k]));
    }
    double size = fmax(fmax(kinetic, highest - lowest), AT_REST * value);
    for (int k = 0; k < record->row.rows; k++)
        record->energy[k] = size > 0 ? (record->energy[k] - first) / size : 0;
    return KEMPE_OK;
}

/* -- the record -------------------------------------------------------------------------------------- */

kempe_status kmp_record_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, int rows,
                            kmp_record *record)
{
    kmp_record r = {.each = 1, .log = {.context = system->context}};
    kmp_run_spec own = *spec;
    recording work = {.spec = &own, .record = &r, .rows = rows};
    own.log = &r.log;
    own.time_count = 0;
    kmp_samples_init(&r.row, system->n, system->m);
    r.ranges = KMP_ARENA_NEW(&r.arena, kmp_step_range, KMP_RECORD_RANGES);
    bool ok = KMP_ARENA_MAKE(&r.arena, KMP_ROOM(double, rows + 2, &r.h, &r.hdot, &r.energy, &r.kinetic, &r.potential),
                             KMP_ROOM(double, 3 * system->n + system->m, &work.room));
    bool apart = false;
    kempe_status status = kmp_made(system->context, ok);
    if (status == KEMPE_OK)
        status = kmp_run_goes_apart(system, work.spec, &apart);
    if (status == KEMPE_OK && !apart)
        status = kmp_runner_new(system, work.spec, start, &work.runner);
    if (status == KEMPE_OK)
        status = apart ? run_apart(&work, system, work.spec, start) : advance(&work);
    kmp_runner_free(work.runner);
    if (kmp_has_result(status)) {
        kempe_status judged = judge(system, own.backend, &r);
        status = judged == KEMPE_OK ? status : judged;
    }
    if (kmp_has_result(status))
        *record = r;
    else
        kmp_record_free(&r);
    return status;
}

kempe_status kmp_record_make(const kempe_comparison *c, int run, double t_end, kmp_record *record)
{
    const kmp_compared *shown = &c->runs[run];
    kmp_run_spec spec = {.formulation = shown->method->formulation,
                         .form = shown->method->form,
                         .integrator = shown->method->integrator,
                         .rtol = shown->rtol,
                         .atol = shown->rtol,
                         .t_end = t_end};
    KMP_TRY(kmp_run_resolve(c->system, &spec));
    kempe_status status = kmp_record_run(c->system, &spec, NULL, KMP_RECORD_ROWS, record);
    if (status == KEMPE_E_FAILED)
        kmp_record_free(record);
    else if (kmp_has_result(status))
        record->run = run;
    return status;
}

kempe_status kmp_record_start(const kempe_system *system, kmp_record *record)
{
    int n = system->n, m = system->m;
    kempe_assembly *start = NULL;
    double *zero = KMP_NEW(double, n + m);
    kempe_status status = zero ? kmp_assembly_at_start(system, &start) : kmp_fail_memory(system->context);
    kmp_samples_init(&record->row, n, m);
    if (start && kmp_samples_add(&record->row, 0, start->q, start->qd, zero, zero, 0))
        status = kmp_fail_memory(system->context);
    kempe_assembly_free(start);
    kmp_free(zero);
    return kmp_has_result(status) ? KEMPE_OK : status;
}

/* -- as data ----------------------------------------------------------------------------------------- */

void kmp_record_put(kmp_json *json, const kmp_record *record)
{
    enum { MOST = 300 };
    const kmp_samples *row = &record->row;
    const kmp_run_log *log = &record->log;
    double first = kmp_samples_time(row, 0), spacing = row->rows > 1 ? kmp_samples_time(row, 1) - first : 0;
    kmp_json_put(json, "{ run %d t_start %.7g spacing %.9g t_end %.7g", record->run, first, spacing,
                 kmp_samples_time(row, row->rows - 1));
    kmp_json_rounded_numbers(json, "h", row->rows, record->h, 3);
    kmp_json_rounded_numbers(json, "hdot", row->rows, record->hdot, 3);
    kmp_json_rounded_numbers(json, "energy", row->rows, record->energy, 3);
    kmp_json_put(json, "each %ld steps [", record->each);
    for (const kmp_step_range *range = record->ranges; range < record->ranges + record->range_count; range++)
        kmp_json_put(json, "[ %.6g %.3g %.3g ]", range->t, range->least, range->most);
    kmp_json_put(json, "] log_count %ld log [", log->count);
    for (int k = 0; k < log->kept && k < MOST; k++)
        kmp_json_put(json, "{ t %.7g kind %s text %s }", log->entries[k].t, log->entries[k].kind, log->entries[k].text);
    kmp_json_put(json, "] }");
}

KMP_CLEARS(kmp_record, record, kmp_samples_free(&record->row), kmp_arena_free(&record->arena),
           kmp_run_log_free(&record->log))
