/* SPDX-License-Identifier: BSD-3-Clause */
/* The runner is advanced here step by step, so that unmonitored runs have no overhead. When there is no more room for
 * ranges of steps, neighbours are merged in pairs, and from then on each range has twice as many steps. */
#include "report/step_record.h"
#include "base/memory.h"
#include <kempe/compare.h>
#include <math.h>

/* -- steps ------------------------------------------------------------------------------------------- */

typedef struct watch {
    kmp_record *record;
    long in_last; /* steps in the last range */
} watch;

static void halve(kmp_record *record)
{
    int half = record->range_count / 2;
    for (int k = 0; k < half; k++) {
        const kmp_step_range *a = &record->ranges[2 * k], *b = a + 1;
        record->ranges[k] = (kmp_step_range){a->t, fmin(a->least, b->least), fmax(a->most, b->most)};
    }
    record->range_count = half;
    record->each *= 2;
}

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
    if (record->range_count == KMP_RECORD_RANGES)
        halve(record);
    record->ranges[record->range_count++] = (kmp_step_range){t, step, step};
    w->in_last = 1;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static kempe_status deliver(kmp_runner *runner, kmp_record *record, double t_end, double *room)
{
    int n = record->row.n;
    double t = kmp_runner_t(runner), work;
    while (record->row.rows <= KMP_RECORD_ROWS) {
        int k = record->row.rows;
        double at = k == KMP_RECORD_ROWS ? t_end : t_end * k / KMP_RECORD_ROWS;
        if (at > t)
            return KEMPE_OK;
        KMP_TRY(kmp_runner_row(runner, at, room, &work));
        if (kmp_samples_add(&record->row, at, room, room + n, room + 2 * n, room + 3 * n, work))
            return kmp_fail_memory(record->log.context);
    }
    return KEMPE_OK;
}

static kempe_status advance(kmp_runner *runner, kmp_record *record, double t_end, double *room)
{
    watch w = {record, 0};
    kempe_status status = deliver(runner, record, t_end, room);
    while (status == KEMPE_OK && kmp_runner_t(runner) < t_end) {
        double before = kmp_runner_t(runner);
        status = kmp_runner_step(runner);
        double t = kmp_runner_t(runner);
        if (t > before)
            add_step(&w, before, t - before);
        if (status == KEMPE_OK || status == KEMPE_STOPPED) {
            kempe_status delivered = deliver(runner, record, t_end, room);
            status = delivered == KEMPE_OK ? status : delivered;
        }
    }
    return status;
}

static kempe_status run_again(const kempe_comparison *c, kmp_record *record, double t_end, double *room)
{
    const kmp_compared *run = &c->runs[record->run];
    kmp_run_spec spec = {.formulation = run->method->formulation,
                         .form = run->method->form,
                         .integrator = run->method->integrator,
                         .rtol = run->rtol,
                         .atol = run->rtol,
                         .t_end = t_end,
                         .log = &record->log};
    kmp_runner *runner = NULL;
    kempe_status status = kmp_run_resolve(c->system, &spec);
    if (status == KEMPE_OK)
        status = kmp_runner_new(c->system, &spec, NULL, &runner);
    if (status == KEMPE_OK)
        status = advance(runner, record, t_end, room);
    kmp_runner_free(runner);
    return status;
}

/* -- residuals and energy ---------------------------------------------------------------------------- */

static void judge_row(kmp_record *record, int row, kmp_evaluator *eval)
{
    double t = kmp_samples_time(&record->row, row);
    const double *q = kmp_samples_get(&record->row, KMP_QUANTITY_Q, row);
    const double *qd = kmp_samples_get(&record->row, KMP_QUANTITY_QD, row);
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    record->h[row] = kmp_eval_residual(eval);
    record->hdot[row] = kmp_eval_rate_residual(eval, qd);
    record->kinetic[row] = kmp_eval_kinetic(eval, qd);
    record->potential[row] = kmp_eval_potential(eval, t, q);
    record->energy[row] = record->kinetic[row] + record->potential[row] - kmp_samples_work(&record->row, row);
}

/* Kinetic energy below this part of the potential's value counts as rounding, as in verdicts. */
#define AT_REST 1e-9

static void relate_energy(kmp_record *record)
{
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
}

static kempe_status judge(const kempe_comparison *c, kmp_record *record)
{
    kmp_run_spec spec = {.t_end = c->t_end};
    kempe_status status = kmp_run_resolve(c->system, &spec);
    kmp_evaluator *eval = status == KEMPE_OK ? kmp_eval_new(c->system, spec.backend) : NULL;
    if (!eval)
        return status == KEMPE_OK ? KEMPE_E_MEMORY : status;
    for (int row = 0; row < record->row.rows; row++)
        judge_row(record, row, eval);
    kmp_eval_free(eval);
    relate_energy(record);
    return KEMPE_OK;
}

/* -- the record -------------------------------------------------------------------------------------- */

kempe_status kmp_record_make(const kempe_comparison *c, int run, double t_end, kmp_record *record)
{
    const int rows = KMP_RECORD_ROWS + 1;
    kmp_record r = {.run = run, .each = 1, .log = {.context = c->system->context}};
    kmp_samples_init(&r.row, c->system->n, c->system->m);
    double *room = NULL;
    const kmp_arena_group groups[] = {{rows, {&r.h, &r.hdot, &r.energy, &r.kinetic, &r.potential}},
                                      {3 * c->system->n + c->system->m, {&room}}};
    r.ranges = KMP_ARENA_NEW(&r.arena, kmp_step_range, KMP_RECORD_RANGES);
    bool ok = kmp_arena_make_groups(&r.arena, sizeof groups / sizeof *groups, groups);
    kempe_status status = ok ? run_again(c, &r, t_end, room) : kmp_fail_memory(c->system->context);
    if (status == KEMPE_OK || status == KEMPE_STOPPED) {
        kempe_status judged = r.row.rows > 0 ? judge(c, &r) : KEMPE_OK;
        status = judged == KEMPE_OK ? status : judged;
    }
    if (status == KEMPE_OK || status == KEMPE_STOPPED)
        *record = r;
    else
        kmp_record_free(&r);
    return status;
}

void kmp_record_free(kmp_record *record)
{
    kmp_samples_free(&record->row);
    kmp_arena_free(&record->arena);
    kmp_run_log_free(&record->log);
    *record = (kmp_record){0};
}
