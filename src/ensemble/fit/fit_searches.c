/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches of a fit from several starts. Each thread has runs of its own, with the same bound on their steps. */
#include "ensemble/fit/fit_searches.h"
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "ensemble/fit/fit_study.h"
#include "ensemble/fit/search_threads.h"
#include "ensemble/sampling/designs.h"
#include "model/data/variant.h"
#include <math.h>
#include <stdatomic.h>
#include <string.h>

/* A trial fails beyond so many times the steps of the first one, and beyond a number that any short run may take: near
 * a dead centre runs become as long as one likes. */
enum { MOST_TIMES = 100, SHORT_RUN = 10000 };

typedef struct shared_fit {
    kempe_fit *f;
    atomic_int tried; /* runs of all threads */
} shared_fit;

/* The runs of one thread. Those of the caller are the fit's. */
typedef struct searcher {
    shared_fit *shared;
    kempe_fit *f;
    kempe_context *context;
    bool caller;
    kmp_variant **copy; /* the models, with this context */
    kmp_slope_runs **runs;
    double *value; /* of one run */
    kmp_fit_search *search;
    kempe_status status;
} searcher;

/* -- runs -------------------------------------------------------------------------------------------- */

static kmp_lm_message try(void *user, const double *x, double *residual, double *slope)
{
    searcher *w = user;
    const kempe_fit *f = w->f;
    kmp_fit_search *s = w->search;
    kmp_progress(w->context, KMP_PROGRESS_STUDY, atomic_fetch_add(&w->shared->tried, 1), (double)f->most * f->starts,
                 "runs");
    s->evaluations++;
    w->status = kmp_fit_run_all(f, w->runs, 1, x, w->value);
    if (w->status == KEMPE_E_FAILED) {
        kmp_free(s->refusal);
        s->refusal = kmp_strdup(kempe_context_message(w->context));
        return s->refusal ? KMP_SQUARES_NOWHERE : KMP_SQUARES_END;
    }
    if (w->status != KEMPE_OK)
        return KMP_SQUARES_END;
    /* The first trial that runs bounds the others, unless there is a bound. */
    kmp_slope_runs *const *runs = w->runs;
    for (int k = 0; k < f->run_count; k++)
        kmp_slope_runs_bound(runs[k], MOST_TIMES, SHORT_RUN);
    kmp_fit_weigh(f, w->runs, residual, slope);
    int count = f->residuals;
    double size = 0;
    for (int k = 0; k < count; k++)
        size += residual[k] * residual[k];
    if (!(size >= s->size)) {
        s->size = size;
        memcpy(s->best, x, (size_t)f->count * sizeof *x);
    }
    return KMP_SQUARES_GO;
}

/* -- one thread -------------------------------------------------------------------------------------- */

/* Another thread derives the equations anew, in a context of its own. */
static kempe_status derive_again(searcher *w, int k)
{
    const kmp_fit_run *r = &w->f->run[k];
    const kempe_sensitivity_options ask = {
        .parameters = r->names, .outputs = r->measured.outputs, .run = &w->f->run_options};
    KMP_TRY(kmp_variant_new_in(w->context, r->own ? r->own : w->f->model, 0, NULL, &w->copy[k]));
    return kmp_slope_runs_new(kmp_variant_model(w->copy[k]), &ask, r->measured.rows, r->measured.t, true, &w->runs[k]);
}

static kempe_status begin_searcher(void *self, void *job, kempe_context *context, bool caller)
{
    searcher *w = self;
    w->shared = job;
    w->f = w->shared->f;
    w->context = context;
    w->caller = caller;
    w->copy = KMP_NEW(kmp_variant *, w->f->run_count);
    w->runs = KMP_NEW(kmp_slope_runs *, w->f->run_count);
    w->value = KMP_NEW(double, w->f->count);
    if (!w->copy || !w->runs || !w->value)
        return KEMPE_E_MEMORY;
    for (int k = 0; k < w->f->run_count; k++)
        if (caller)
            w->runs[k] = w->f->run[k].runs;
        else
            KMP_TRY(derive_again(w, k));
    return KEMPE_OK;
}

static void end_searcher(void *self)
{
    searcher *w = self;
    for (int k = 0; !w->caller && w->copy && w->runs && k < w->f->run_count; k++) {
        if (w->runs[k]) {
            w->f->helped_s += kmp_slope_runs_rows(w->runs[k])->cpu_s;
            w->f->helped_build_s += kmp_slope_runs_rows(w->runs[k])->build_s;
        }
        kmp_slope_runs_free(w->runs[k]);
        kmp_variant_free(w->copy[k]);
    }
    kmp_free(w->copy);
    kmp_free(w->runs);
    kmp_free(w->value);
}

/* A start at which the model does not run is no failure. */
static kempe_status search_from(void *self, int number)
{
    searcher *w = self;
    const kempe_fit *f = w->f;
    kmp_fit_search *s = &w->f->search[number];
    const kmp_squares squares = {.rows = f->residuals,
                                 .count = f->count,
                                 .lower = f->lower,
                                 .upper = f->upper,
                                 .tolerance = KMP_FIT_ENOUGH,
                                 .most = f->most,
                                 .at = try,
                                 .user = w};
    kmp_squares_report report = {0};
    w->search = s;
    w->status = KEMPE_OK;
    s->begun = true;
    for (int k = 0; k < f->run_count; k++)
        kmp_slope_runs_set_most(w->runs[k], f->run[k].most_steps);
    if (!kmp_squares_minimise(&squares, s->value, &report))
        return kmp_fail_memory(w->context);
    s->iterations = report.iterations;
    s->refused = report.refused;
    s->outcome = report.outcome;
    for (int k = 0; k < f->run_count; k++)
        s->most_steps[k] = kmp_slope_runs_most(w->runs[k]);
    if (w->status == KEMPE_E_FAILED && !s->refusal)
        return kmp_fail_memory(w->context);
    return w->status == KEMPE_E_FAILED ? KEMPE_OK : w->status;
}

/* -- all searches ------------------------------------------------------------------------------------ */

/* Adds a search to the fit. */
static void take_search(kempe_fit *f, kmp_fit_search *s)
{
    f->searches += f->rounds == 0; /* later ones go on from the best */
    f->evaluations += s->evaluations;
    f->iterations += s->iterations;
    f->refused += s->refused;
    if (s->refusal) {
        kmp_free(f->refusal);
        f->refusal = s->refusal;
        s->refusal = NULL;
    }
    if (s->size >= f->size)
        return;
    f->size = s->size;
    f->outcome = s->outcome;
    memcpy(f->best, s->best, (size_t)f->count * sizeof *f->best);
    for (int k = 0; k < f->run_count; k++)
        f->run[k].most_steps = s->most_steps[k];
}

/* Of several searches the trial at the first start bounds the steps of all. */
static kempe_status bound_all(kempe_fit *f)
{
    kempe_status status = kmp_fit_run_all(f, NULL, 1, f->value, f->room);
    f->evaluations++;
    if (status != KEMPE_OK) {
        kmp_context_clear(f->context);
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    }
    for (int k = 0; k < f->run_count; k++) {
        kmp_slope_runs_bound(f->run[k].runs, MOST_TIMES, SHORT_RUN);
        f->run[k].most_steps = kmp_slope_runs_most(f->run[k].runs);
    }
    return KEMPE_OK;
}

static kempe_status search_all(kempe_fit *f, int count)
{
    static const kmp_searcher_kind kind = {sizeof(searcher), begin_searcher, search_from, end_searcher};
    shared_fit shared = {.f = f};
    double waited_s = 0; /* of threads, beside their runs */
    KMP_TRY(count > 1 ? bound_all(f) : KEMPE_OK);
    atomic_init(&shared.tried, f->evaluations);
    kempe_status status = kmp_share_searches(f->context, &kind, &shared, f->threads, count, &waited_s);
    for (int k = 0; k < count; k++)
        if (f->search[k].begun)
            take_search(f, &f->search[k]);
    for (int k = 0; k < f->run_count; k++)
        kmp_slope_runs_set_most(f->run[k].runs, f->run[k].most_steps);
    KMP_TRY(status);
    kmp_context_clear(f->context);
    if (isfinite(f->size)) {
        memcpy(f->value, f->best, (size_t)f->count * sizeof *f->best);
        return KEMPE_OK;
    }
    return kmp_fail(f->context, KEMPE_E_FAILED, "the model does not run with the values of the start: %s",
                    f->refusal ? f->refusal : "");
}

kempe_status kmp_fit_searches(kempe_fit *fit, int count)
{
    kmp_arena arena = {0};
    /* The first start is that of the fit, the others are places of a Sobol sequence between the bounds. */
    fit->search = KMP_ARENA_NEW(&arena, kmp_fit_search, count);
    for (int k = 0; fit->search && k < count; k++) {
        kmp_fit_search *s = &fit->search[k];
        s->value = KMP_ARENA_NEW(&arena, double, fit->count);
        s->best = KMP_ARENA_NEW(&arena, double, fit->count);
        s->most_steps = KMP_ARENA_NEW(&arena, long, fit->run_count);
        s->size = INFINITY;
        s->outcome = KMP_SQUARES_NO_START;
        for (int p = 0; s->value && p < fit->count; p++) {
            double part = k > 0 ? kmp_design_point(KMP_DESIGN_SOBOL, 1, (uint64_t)k - 1, 0, p, fit->count) : 0;
            s->value[p] = k > 0 ? fit->lower[p] + part * (fit->upper[p] - fit->lower[p]) : fit->value[p];
        }
    }
    kempe_status status = kmp_made(fit->context, !arena.failed);
    if (status == KEMPE_OK)
        status = search_all(fit, count);
    for (int k = 0; fit->search && k < count; k++)
        kmp_free(fit->search[k].refusal);
    fit->search = NULL;
    kmp_arena_free(&arena);
    return status;
}
