/* SPDX-License-Identifier: BSD-3-Clause */
/* Comparison: every chosen method at every tolerance from one assembled start, judged at the reference's times. */
#include "studies/compare/compare.h"
#include "base/memory.h"
#include "constraints/evaluation/load_multipliers.h"
#include "output/times.h"
#include <kempe/check.h>
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

/* The default processor time of all runs, s, and the part of it available for the reference. */
#define BUDGET         60.0
#define REFERENCE_PART 0.4
/* Rows of runs whose time counts, less one. */
#define FEW 10

kempe_compare_options kempe_compare_options_default(void)
{
    return (kempe_compare_options){0};
}

/* -- end --------------------------------------------------------------------------------------------- */

/* One successful run makes a comparison; without one, the first failure gives its reason. */
static kempe_status conclude(kmp_compare_job *j)
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
    const char *reason = c->status == KEMPE_OK ? "" : kmp_interrupted(j->context) ? "interrupted" : "no run was made";
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

static kempe_status use_reference(kmp_compare_job *j, const char *path)
{
    kempe_comparison *c = j->comparison;
    if (!path)
        return kmp_compare_own_reference(j, REFERENCE_PART * j->left_s);
    KMP_TRY(kmp_reference_read(c->system, path, &j->reference));
    kmp_reference_limit(&j->reference, c->t_end);
    c->has_reference = true;
    j->reference.shared = c->shared;
    kmp_free(c->source);
    c->source = kmp_strdup(base_name(path));
    return c->source ? KEMPE_OK : kmp_fail_memory(j->context);
}

static kempe_status settle_t_end(kmp_compare_job *j, const kempe_compare_options *options)
{
    const kmp_method *way = &j->choice.ways[0];
    kmp_run_spec spec = {
        .formulation = way->formulation, .form = way->form, .integrator = way->integrator, .t_end = options->t_end};
    if (!(options->t_end >= 0) || isinf(options->t_end))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end = %g: a positive number is expected", options->t_end);
    kempe_status status = kmp_run_resolve(j->comparison->system, &spec);
    if (status == KEMPE_OK && !(spec.t_end > 0))
        status = kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end is missing: give it in the model or as an option");
    j->comparison->t_end = j->comparison->until = spec.t_end;
    if (status == KEMPE_OK && !(j->eval = kmp_eval_new(j->comparison->system, spec.backend)))
        status = KEMPE_E_MEMORY;
    return status;
}

static kempe_status settle_budget(kmp_compare_job *j, double budget_s)
{
    if (!(budget_s >= 0) || isinf(budget_s))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "budget_s = %g: a positive number is expected", budget_s);
    j->comparison->budget_s = j->left_s = budget_s > 0 ? budget_s : BUDGET;
    return KEMPE_OK;
}

/* A stiff model is also run with implicit integrators, unless the user chose others. */
static kempe_status widen(kmp_compare_job *j, const kempe_compare_options *options)
{
    bool stiff = false;
    if (options->integrators)
        return KEMPE_OK;
    kempe_status status = kmp_compare_probe(j, &stiff);
    return status == KEMPE_OK && stiff ? kmp_choice_add_implicit(&j->choice, j->context, options) : status;
}

static void take_ways(kmp_compare_job *j)
{
    kempe_comparison *c = j->comparison;
    c->ways = j->choice.ways;
    c->way_count = j->choice.way_count;
    c->rtol_count = j->choice.rtol_count;
    j->choice.ways = NULL;
}

/* Finds multipliers that redundant rows leave undetermined: their errors are undefined, which the report states. */
static kempe_status find_shared(kmp_compare_job *j)
{
    kempe_comparison *c = j->comparison;
    const double *q = j->start->inner_q ? j->start->inner_q : j->start->q;
    int count = 0;
    c->shared = KMP_NEW(bool, c->system->m);
    if (!c->shared)
        return kmp_fail_memory(j->context);
    if (j->start->chart)
        kmp_eval_set_charts(j->eval, j->start->chart);
    kempe_status status = kmp_find_shared(j->eval, 0, q, c->shared, &count);
    if (status == KEMPE_OK && count > 0 &&
        !kmp_sentences_add(&c->warnings,
                           "%d of %d multipliers are not unique because of redundant rows: their errors are omitted "
                           "('kempe check' lists them)",
                           count, c->system->m))
        status = kmp_fail_memory(j->context);
    return status;
}

/* The options are judged before anything is computed. */
static kempe_status prepare(kmp_compare_job *j, const kempe_compare_options *options)
{
    kempe_comparison *c = j->comparison;
    kempe_status status = kmp_choice_init(&j->choice, j->context, options);
    if (status == KEMPE_OK)
        status = settle_budget(j, options->budget_s);
    if (status == KEMPE_OK)
        status = settle_t_end(j, options);
    if (status == KEMPE_OK)
        status = kempe_assembly_new(c->system, &j->start);
    if (status == KEMPE_OK)
        status = widen(j, options);
    take_ways(j);
    if (status == KEMPE_OK)
        status = find_shared(j);
    if (status == KEMPE_OK)
        status = use_reference(j, options->reference);
    if (status != KEMPE_OK)
        return status;
    kmp_context_clear(j->context);
    if (!kmp_times_init(&j->times, c->t_end, c->t_end, c->has_reference ? &j->reference : NULL) ||
        !kmp_times_init(&j->few, c->t_end / FEW, c->t_end, NULL))
        return kmp_fail_memory(j->context);
    for (int k = 0; c->has_reference && k < j->reference.rows; k++)
        c->instants += j->reference.t[k] <= c->until;
    return status;
}

static void release(kmp_compare_job *j)
{
    kmp_choice_free(&j->choice);
    kempe_assembly_free(j->start);
    kmp_eval_free(j->eval);
    kmp_reference_free(&j->reference);
    kmp_times_free(&j->times);
    kmp_times_free(&j->few);
}

/* -- the comparison ---------------------------------------------------------------------------------- */

/* A mechanism that cannot be assembled has nothing to compare: message and result give the reason. */
static kempe_status settle_failure(kmp_compare_job *j)
{
    j->comparison->status = KEMPE_E_FAILED;
    j->comparison->reason = kmp_strdup(kempe_context_message(j->context));
    return j->comparison->reason ? KEMPE_E_FAILED : kmp_fail_memory(j->context);
}

static kempe_status judge(kmp_compare_job *j)
{
    kempe_comparison *c = j->comparison;
    kempe_status status = kmp_compare_run_all(j);
    if (status == KEMPE_OK)
        status = kmp_compare_levels(c);
    if (status == KEMPE_OK)
        status = kmp_compare_remark(c);
    return status == KEMPE_OK ? kmp_compare_advise(c) : status;
}

/* Repeats the warnings of the start. */
static kempe_status repeat_warnings(kmp_compare_job *j)
{
    char *lines = kmp_context_warnings(j->context);
    bool ok = lines;
    for (const char *at = lines; ok && *at; at += strcspn(at, "\n") + 1)
        ok = kmp_sentences_add(&j->comparison->warnings, "%.*s", (int)strcspn(at, "\n"), at);
    kmp_free(lines);
    return ok ? KEMPE_OK : kmp_fail_memory(j->context);
}

kempe_status kempe_comparison_new(const kempe_system *system, const kempe_compare_options *options,
                                  kempe_comparison **comparison)
{
    KMP_WANTED(NULL, system, "system");
    options = options ? options : &(const kempe_compare_options){0};
    KMP_WANTED(system->context, comparison, "comparison");
    kmp_compare_job j = {.comparison = KMP_NEW(kempe_comparison, 1), .context = system->context};
    kmp_context_begin(j.context);
    if (!j.comparison)
        return kmp_fail_memory(j.context);
    j.comparison->system = system;
    j.comparison->amplification = NAN;
    j.comparison->advice = (kmp_advice){.run = -1, .level = NAN};
    j.comparison->source = kmp_strdup("none");
    kempe_status status = j.comparison->source ? prepare(&j, options) : kmp_fail_memory(j.context);
    if (status == KEMPE_OK)
        status = repeat_warnings(&j);
    if (status == KEMPE_OK)
        status = judge(&j);
    if (status == KEMPE_OK)
        status = conclude(&j);
    else if (status == KEMPE_E_FAILED)
        status = settle_failure(&j);
    release(&j);
    if (kmp_compare_has_result(status))
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
    kmp_free(comparison->shared);
    kmp_free(comparison);
}
