/* SPDX-License-Identifier: BSD-3-Clause */
/* Comparing: every chosen way at every tolerance from one assembled start, judged at the reference's times. */
#include "results/compare.h"
#include "base/memory.h"
#include "results/times.h"
#include <math.h>
#include <string.h>

enum { MOST_REPEATS = 5 };

/* All that a comparison needs until it is done. */
typedef struct job {
    kempe_comparison *comparison;
    kempe_context *context;
    kmp_choice choice;
    kempe_assembly *start;
    kmp_plant *plant;
    kmp_reference reference;
    kmp_times times;
    kmp_samples table;
} job;

kempe_compare_run kempe_compare_run_default(void)
{
    return (kempe_compare_run){0};
}

/* -- one run ----------------------------------------------------------------------------------------- */

kempe_status kmp_compare_once(const kempe_system *system, const kmp_way *way, double rtol, double t_end, int time_count,
                              const double *times, const kempe_assembly *start, kmp_samples *table,
                              kmp_run_report *report)
{
    kmp_run_spec spec = {.road = way->road,
                         .form = way->form,
                         .integrator = way->integrator,
                         .rtol = rtol,
                         .atol = rtol,
                         .t_end = t_end,
                         .time_count = time_count,
                         .times = times};
    table->rows = 0;
    *report = (kmp_run_report){0};
    kempe_status status = kmp_run_resolve(system, &spec);
    return status == KEMPE_OK ? kmp_run(system, &spec, start, kmp_samples_add, table, report) : status;
}

static kempe_status run_once(job *j, kmp_compared *run)
{
    kmp_free(run->report.reason);
    return kmp_compare_once(j->comparison->system, run->way, run->rtol, j->comparison->t_end, j->times.count,
                            j->times.t, j->start, &j->table, &run->report);
}

/* Short runs are repeated, long ones speak for themselves. */
static int repeats_of(double cpu_s)
{
    return cpu_s < 0.2 ? MOST_REPEATS : cpu_s < 2 ? 3 : 1;
}

static double median(int count, double *x)
{
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && x[k] < x[k - 1]; k--) {
            double swap = x[k];
            x[k] = x[k - 1];
            x[k - 1] = swap;
        }
    return x[count / 2];
}

/* The repeats do the same to the last bit: only their time counts. */
static kempe_status time_run(job *j, kmp_compared *run)
{
    double cpu_s[MOST_REPEATS] = {run->report.cpu_s};
    int count = 1, wanted = repeats_of(run->report.cpu_s);
    while (count < wanted) {
        kempe_status status = run_once(j, run);
        if (status != KEMPE_OK)
            return status;
        cpu_s[count++] = run->report.cpu_s;
    }
    run->cpu_s = median(count, cpu_s);
    return KEMPE_OK;
}

static bool has_result(kempe_status status)
{
    return status == KEMPE_OK || status == KEMPE_STOPPED || status == KEMPE_E_FAILED;
}

static void tell(const job *j, const kmp_compared *run)
{
    const char *form = run->way->form ? run->way->form : "-";
    if (run->status == KEMPE_OK)
        kmp_log(j->context, KEMPE_LOG_PROGRESS, "%s %s %s, rtol %g: error q %.1e, %.3g ms", run->way->road, form,
                run->way->integrator, run->rtol, run->verdict.error[KMP_QUANTITY_Q], 1e3 * run->cpu_s);
    else
        kmp_log(j->context, KEMPE_LOG_PROGRESS, "%s %s %s, rtol %g: %s", run->way->road, form, run->way->integrator,
                run->rtol, run->reason);
}

static kempe_status run_one(job *j, kmp_compared *run)
{
    run->verdict = kmp_verdict_none();
    run->cpu_s = NAN;
    kempe_status status = run_once(j, run);
    if (status == KEMPE_OK) {
        run->verdict = kmp_verdict_of(&j->table, j->plant, j->comparison->has_reference ? &j->reference : NULL);
        status = time_run(j, run);
    }
    if (!has_result(status))
        return status;
    if (status != KEMPE_OK)
        run->verdict = kmp_verdict_none();
    const char *reason = run->report.reason ? run->report.reason : kempe_context_message(j->context);
    run->status = status;
    run->reason = kmp_strdup(status == KEMPE_OK ? "" : reason);
    if (!run->reason)
        return kmp_fail_memory(j->context);
    kmp_context_clear(j->context);
    tell(j, run);
    return KEMPE_OK;
}

/* -- all runs ---------------------------------------------------------------------------------------- */

static kempe_status run_all(job *j)
{
    kempe_comparison *c = j->comparison;
    c->runs = KMP_NEW(kmp_compared, j->choice.way_count * j->choice.rtol_count);
    if (!c->runs)
        return kmp_fail_memory(j->context);
    for (int w = 0; w < j->choice.way_count; w++)
        for (int k = 0; k < j->choice.rtol_count && !kmp_interrupted(j->context); k++) {
            kmp_compared *run = &c->runs[c->count++];
            run->way = &j->comparison->ways[w];
            run->rtol = j->choice.rtols[k];
            kempe_status status = run_one(j, run);
            if (status != KEMPE_OK)
                return status;
        }
    return KEMPE_OK;
}

/* One good run is a comparison; without one, the first reason speaks for all. */
static kempe_status conclude(job *j)
{
    kempe_comparison *c = j->comparison;
    const kmp_compared *first = NULL;
    c->status = kmp_interrupted(j->context) ? KEMPE_STOPPED : KEMPE_E_FAILED;
    for (int k = 0; k < c->count; k++) {
        if (c->runs[k].status == KEMPE_OK && c->status != KEMPE_STOPPED)
            c->status = KEMPE_OK;
        else if (c->runs[k].status != KEMPE_OK && !first)
            first = &c->runs[k];
    }
    if (c->status == KEMPE_E_FAILED && first && first->status == KEMPE_STOPPED)
        c->status = KEMPE_STOPPED;
    const char *reason = c->status == KEMPE_OK ? "" : kmp_interrupted(j->context) ? "interrupted" : "nothing was run";
    if (c->status != KEMPE_OK && !kmp_interrupted(j->context) && first)
        reason = first->reason;
    c->reason = kmp_strdup(reason);
    if (!c->reason)
        return kmp_fail_memory(j->context);
    return c->status == KEMPE_E_FAILED ? kmp_fail(j->context, c->status, "%s", c->reason) : c->status;
}

/* -- preparing --------------------------------------------------------------------------------------- */

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static kempe_status use_reference(job *j, const char *path)
{
    kempe_comparison *c = j->comparison;
    if (!path)
        return kmp_compare_own_reference(c, j->start, j->plant, &j->reference);
    kempe_status status = kmp_reference_read(c->system, path, &j->reference);
    if (status != KEMPE_OK)
        return status;
    kmp_reference_limit(&j->reference, c->t_end);
    c->has_reference = true;
    kmp_free(c->source);
    c->source = kmp_strdup(base_name(path));
    return c->source ? KEMPE_OK : kmp_fail_memory(j->context);
}

static kempe_status settle_t_end(job *j, const kempe_compare_run *options)
{
    const kmp_way *way = &j->comparison->ways[0];
    kmp_run_spec spec = {.road = way->road, .form = way->form, .integrator = way->integrator, .t_end = options->t_end};
    if (!(options->t_end >= 0) || isinf(options->t_end))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end = %g: a positive number is wanted", options->t_end);
    kempe_status status = kmp_run_resolve(j->comparison->system, &spec);
    if (status == KEMPE_OK && !(spec.t_end > 0))
        status = kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end: say how long to run, in the model or as an option");
    j->comparison->t_end = spec.t_end;
    if (status == KEMPE_OK && !(j->plant = kmp_plant_new(j->comparison->system, spec.backend)))
        status = KEMPE_E_MEMORY;
    return status;
}

/* The options are judged before anything is computed. */
static kempe_status prepare(job *j, const kempe_compare_run *options)
{
    kempe_comparison *c = j->comparison;
    kempe_status status = kmp_choice_init(&j->choice, j->context, options);
    c->ways = j->choice.ways;
    c->way_count = j->choice.way_count;
    c->rtol_count = j->choice.rtol_count;
    j->choice.ways = NULL;
    if (status == KEMPE_OK)
        status = settle_t_end(j, options);
    if (status == KEMPE_OK)
        status = kempe_assemble(c->system, &j->start);
    if (status == KEMPE_OK)
        status = use_reference(j, options->reference);
    if (status != KEMPE_OK)
        return status;
    kmp_context_clear(j->context);
    if (!kmp_times_init(&j->times, c->t_end, c->t_end, c->has_reference ? &j->reference : NULL))
        status = kmp_fail_memory(j->context);
    return status;
}

static void release(job *j)
{
    kmp_choice_free(&j->choice);
    kempe_assembly_free(j->start);
    kmp_plant_free(j->plant);
    kmp_reference_free(&j->reference);
    kmp_times_free(&j->times);
    kmp_samples_free(&j->table);
}

/* -- the comparison ---------------------------------------------------------------------------------- */

/* A mechanism that does not assemble has nothing to compare: the message says why, and so does the result. */
static kempe_status settle_failure(job *j)
{
    j->comparison->status = KEMPE_E_FAILED;
    j->comparison->reason = kmp_strdup(kempe_context_message(j->context));
    return j->comparison->reason ? KEMPE_E_FAILED : kmp_fail_memory(j->context);
}

kempe_status kempe_compare(const kempe_system *system, const kempe_compare_run *options, kempe_comparison **comparison)
{
    job j = {.comparison = KMP_NEW(kempe_comparison, 1), .context = system->context};
    kmp_context_clear(j.context);
    if (!j.comparison)
        return kmp_fail_memory(j.context);
    j.comparison->system = system;
    j.comparison->source = kmp_strdup("none");
    kmp_samples_init(&j.table, system->n, system->m);
    kempe_status status = j.comparison->source ? prepare(&j, options) : kmp_fail_memory(j.context);
    if (status == KEMPE_OK)
        status = run_all(&j);
    if (status == KEMPE_OK)
        status = kmp_compare_levels(j.comparison);
    if (status == KEMPE_OK)
        status = kmp_compare_advise(j.comparison);
    if (status == KEMPE_OK)
        status = conclude(&j);
    else if (status == KEMPE_E_FAILED)
        status = settle_failure(&j);
    release(&j);
    if (has_result(status))
        *comparison = j.comparison;
    else
        kempe_comparison_free(j.comparison);
    return status;
}

void kempe_comparison_free(kempe_comparison *comparison)
{
    if (!comparison)
        return;
    for (int k = 0; k < comparison->count; k++) {
        kmp_free(comparison->runs[k].reason);
        kmp_free(comparison->runs[k].report.reason);
    }
    kmp_free(comparison->runs);
    kmp_free(comparison->levels.run);
    kmp_sentences_free(&comparison->advice.because);
    kmp_sentences_free(&comparison->failures);
    kmp_sentences_free(&comparison->warnings);
    kmp_free(comparison->source);
    kmp_free(comparison->reason);
    kmp_free(comparison->ways);
    kmp_free(comparison);
}
