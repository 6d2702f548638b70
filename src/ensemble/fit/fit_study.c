/* SPDX-License-Identifier: BSD-3-Clause */
/* The search: options, weights of the columns, trials. */
#include "ensemble/fit/fit_study.h"
#include "analyses/parts/ranges.h"
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "base/memory.h"
#include "base/thread_pool.h"
#include "constraints/tolerances.h"
#include "ensemble/fit/fit_statistics.h"
#include "ensemble/fit/search_threads.h"
#include "ensemble/sampling/sampling.h"
#include "model/data/model_context.h"
#include "model/data/variant.h"
#include "model/read/loads.h"
#include "studies/simulate/trajectory.h"
#include <float.h>
#include <kempe/fit.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* -- options ----------------------------------------------------------------------------------------- */

static int data_column(const kempe_fit *f, const char *name, size_t length)
{
    int c = 0;
    while (c < f->columns && (strlen(f->column_name[c]) != length || strncmp(f->column_name[c], name, length) != 0))
        c++;
    return c;
}

static kempe_status read_deviations(kempe_fit *f, const char *list)
{
    char **word = NULL;
    int count = kmp_text_words(&f->arena, list, &word);
    for (int k = 0; k < count; k++) {
        size_t length = strcspn(word[k], "=");
        int c = data_column(f, word[k], length);
        if (!word[k][length] || c == f->columns)
            return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                            "deviation '%s': COLUMN=VALUE with a column of the data is expected", word[k]);
        KMP_TRY(kmp_range_of_unit(f->model, "deviations", f->column_name[c], word[k] + length + 1, f->column_unit[c],
                                  &f->deviation[c]));
        if (!(f->deviation[c] > 0))
            return kmp_fail(f->context, KEMPE_E_ARGUMENT, "deviation '%s': it must be positive", word[k]);
    }
    f->given = count > 0;
    for (int c = 0; f->given && c < f->columns; c++)
        if (!(f->deviation[c] > 0))
            return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                            "the deviation of '%s' is missing: give the deviation of every column, or of none",
                            f->column_name[c]);
    return kmp_made(f->context, !f->arena.failed);
}

/* -- trials ------------------------------------------------------------------------------------------ */

static double fit_measured(const kempe_fit *fit, const kmp_fit_cell *at)
{
    const kmp_measured *m = &fit->run[at->run].measured;
    return m->value[(ptrdiff_t)at->row * m->columns + at->column];
}

bool kmp_fit_next(const kempe_fit *fit, kmp_fit_cell *at)
{
    while (at->run < fit->run_count) {
        const kmp_measured *m = &fit->run[at->run].measured;
        if (++at->column >= m->columns) {
            at->column = 0;
            at->row++;
        }
        if (at->row >= m->rows)
            *at = (kmp_fit_cell){at->run + 1, 0, -1};
        else if (!isnan(fit_measured(fit, at)))
            return true;
    }
    return false;
}

/* The value of the last run at a measurement, and its column of the fit. */
static double value_at(const kempe_fit *f, const kmp_fit_cell *at)
{
    return kmp_sensitivity_value(kmp_fit_rows(f, at->run), at->row, f->run[at->run].column[at->column]);
}

static int column_of(const kempe_fit *f, const kmp_fit_cell *at)
{
    return f->run[at->run].among[at->column];
}

/* Weighted residuals and their derivatives at the last rows of runs, one for each data file; NULL: the runs of the fit.
 */
static void weigh_residuals(const kempe_fit *fit, kmp_slope_runs *const *runs, double *residual, double *slope)
{
    int i = 0;
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(fit, &at); i++) {
        const kmp_fit_run *r = &fit->run[at.run];
        const kempe_sensitivity *rows = runs ? kmp_slope_runs_rows(runs[at.run]) : kmp_fit_rows(fit, at.run);
        const int column = r->column[at.column];
        double weight = 1 / fit->deviation[column_of(fit, &at)];
        residual[i] = weight * (kmp_sensitivity_value(rows, at.row, column) - fit_measured(fit, &at));
        for (int k = 0; k < fit->count; k++)
            slope[i + (ptrdiff_t)k * fit->residuals] = 0;
        for (int k = 0; k < r->count; k++)
            slope[i + (ptrdiff_t)r->parameter[k] * fit->residuals] =
                weight * kmp_sensitivity_slope(rows, at.row, column, k);
    }
}

/* Runs of all data files with these values at a multiple of the tolerance, up to one that fails; `runs` as above.
 * `value`: room for the values of one run. */
static kempe_status run_all(const kempe_fit *fit, kmp_slope_runs *const *runs, double factor, const double *x,
                            double *value)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < fit->run_count && status == KEMPE_OK; k++) {
        const kmp_fit_run *r = &fit->run[k];
        for (int p = 0; p < r->count; p++)
            value[p] = x[r->parameter[p]];
        status = kmp_slope_runs_coarser(runs ? runs[k] : r->runs, factor, value);
    }
    return status;
}

/* -- weights ----------------------------------------------------------------------------------------- */

/* True for a column whose deviation its few measurements cannot show. */
static bool fit_has_few(const kempe_fit *fit, int column)
{
    return !fit->given && fit->columns > 1 && fit->number[column] - fit->free < KMP_FIT_FEW;
}

/* Weights by the residuals over their degrees of freedom; true if they have changed. A column with few measurements
 * also counts the mean of all columns, each over its scatter, as one: by itself it would be taken for exact by
 * parameters that meet its few values. */
static bool weigh_again(kempe_fit *f, const double *scatter)
{
    const double least = KMP_FIT_NOISE * kmp_fit_rows(f, 0)->rtol;
    double mean = 0, freedoms = 0;
    bool changed = false;
    for (int c = 0; c < f->columns; c++) {
        mean += f->number[c] * f->rms[c] * f->rms[c] / (scatter[c] * scatter[c]);
        freedoms += f->freedom[c];
    }
    mean /= fmax(freedoms, 1);
    for (int c = 0; c < f->columns; c++) {
        double one = fit_has_few(f, c), sum = f->number[c] * f->rms[c] * f->rms[c];
        double variance = (sum + one * mean * scatter[c] * scatter[c]) / fmax(f->freedom[c] + one, DBL_EPSILON);
        double next = fmax(sqrt(variance), least * scatter[c]);
        f->exact[c] = sqrt(variance) < next;
        changed = changed || fabs(next - f->deviation[c]) > KMP_FIT_WEIGHTS * f->deviation[c];
        f->deviation[c] = next;
    }
    return changed;
}

/* -- searches ----------------------------------------------------------------------------------------------- */

/* Searches of a fit from several starts. Each thread has separate runs, with the same bound on their steps. */

/* A trial fails beyond this multiple of the steps of the first one, and beyond a number that any short run may take:
 * near a dead centre runs become as long as one likes. */
enum { MOST_TIMES = 100, SHORT_RUN = 10000 };

typedef struct shared_fit {
    kempe_fit *f;
    atomic_int tried; /* runs of all threads */
} shared_fit;

/* The runs of one thread. The runs of the caller are the fit's. */
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

static kmp_lm_message try(void *user, const double *x, double *residual, double *slope)
{
    searcher *w = user;
    const kempe_fit *f = w->f;
    kmp_fit_search *s = w->search;
    kmp_progress(w->context, KMP_PROGRESS_STUDY, atomic_fetch_add(&w->shared->tried, 1), (double)f->most * f->starts,
                 "runs");
    s->evaluations++;
    w->status = run_all(f, w->runs, 1, x, w->value);
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
    weigh_residuals(f, w->runs, residual, slope);
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

/* Another thread derives the equations again, in a separate context. */
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

/* A start at which the model does not run is not a failure. */
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
    f->searches += f->rounds == 0; /* later ones continue from the best */
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
    kempe_status status = run_all(f, NULL, 1, f->value, f->room);
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
    double waited_s = 0; /* of threads, in addition to their runs */
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

/* Searches from `count` starts by the threads of the fit. Their results are added to it, in the order of the starts;
 * the best values change only where a better one is found. KEMPE_E_FAILED: the model runs at no start. KEMPE_STOPPED:
 * an interrupt, with the best values so far. */
static kempe_status fit_searches(kempe_fit *fit, int count)
{
    kmp_arena arena = {0};
    /* The first start belongs to the fit, the others are places of a Sobol sequence between the bounds. */
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

enum { MOST_RUNS = 200, MOST_ROUNDS = 10, USUAL_STARTS = 8, LEAST_FOR_NOISE = 20 };

/* -- the search -------------------------------------------------------------------------------------- */

/* Rows, residuals and derivatives at the estimates. */
static kempe_status stand_at_estimates(kempe_fit *f)
{
    const bool quiet = kmp_context_quiet(f->context, false); /* what these runs are doubted for */
    kempe_status run = run_all(f, NULL, 1, f->value, f->room);
    (void)kmp_context_quiet(f->context, quiet);
    KMP_TRY(run);
    weigh_residuals(f, NULL, f->residual, f->slope);
    /* The root mean square of what remains, of each column. */
    memset(f->rms, 0, (size_t)f->columns * sizeof *f->rms);
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at);) {
        double away = fit_measured(f, &at) - value_at(f, &at);
        f->rms[column_of(f, &at)] += away * away;
    }
    for (int c = 0; c < f->columns; c++)
        f->rms[c] = sqrt(f->rms[c] / f->number[c]);
    for (int k = 0; k < f->run_count; k++) {
        const kmp_fit_run *r = &f->run[k];
        for (int row = 0; row < r->measured.rows; row++)
            for (int c = 0; c < r->measured.columns; c++)
                r->motion[(ptrdiff_t)row * r->measured.columns + c] =
                    kmp_sensitivity_value(kmp_fit_rows(f, k), row, r->column[c]);
    }
    return KEMPE_OK;
}

/* Rounds: each column's weight follows from its residuals, and the search from the weights. Its start moves. */
static kempe_status search(kempe_fit *f)
{
    double *scatter = f->own_scatter;
    /* The scatter of each column about its mean: the first weights, and the size of rounding. */
    double *mean = KMP_ARENA_NEW(&f->arena, double, 3 * f->columns), *sum = mean + f->columns, *most = sum + f->columns;
    KMP_TRY(kmp_made(f->context, mean));
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at);) {
        int c = column_of(f, &at);
        mean[c] += fit_measured(f, &at) / f->number[c];
    }
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at);) {
        int c = column_of(f, &at);
        double away = fit_measured(f, &at) - mean[c];
        sum[c] += away * away;
        most[c] = fmax(most[c], fabs(fit_measured(f, &at)));
    }
    for (int c = 0; c < f->columns; c++)
        scatter[c] = sum[c] > 0 ? sqrt(sum[c] / f->number[c]) : most[c] > 0 ? most[c] : 1;
    if (!f->given)
        memcpy(f->deviation, scatter, (size_t)f->columns * sizeof *scatter);
    f->unsettled = true;
    while (f->unsettled && f->rounds < MOST_ROUNDS) {
        f->size = INFINITY;
        KMP_TRY(fit_searches(f, f->rounds == 0 ? f->starts : 1));
        f->rounds++;
        KMP_TRY(stand_at_estimates(f));
        KMP_TRY(kmp_fit_judge(f));
        f->unsettled = !f->given && weigh_again(f, scatter) && f->columns > 1 && f->outcome == KMP_SQUARES_FOUND;
    }
    weigh_residuals(f, NULL, f->residual, f->slope);
    return KEMPE_OK;
}

/* The change of the fitted motion at a hundredfold tolerance, in deviations of the noise. */
static kempe_status check_tolerance(kempe_fit *f)
{
    enum { COARSER = 100 };
    kempe_status status = run_all(f, NULL, COARSER, f->value, f->room);
    if (status != KEMPE_OK)
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    f->coarser = 0;
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at);) {
        const kmp_fit_run *r = &f->run[at.run];
        int c = column_of(f, &at);
        double fitted = r->motion[(ptrdiff_t)at.row * r->measured.columns + at.column];
        double away = fabs(value_at(f, &at) - fitted) / f->deviation[c];
        f->coarser = f->exact[c] ? f->coarser : fmax(f->coarser, away);
    }
    return KEMPE_OK;
}

/* -- data files -------------------------------------------------------------------------------------- */

/* NAME@K: a name in the run of the K-th data file; -1: NAME, of all. */
static kempe_status read_place(const kempe_fit *f, const char *word, int *length, int *run)
{
    const char *at = strchr(word, '@');
    size_t used = strcspn(word, ":=");
    *run = -1;
    *length = at && at < word + used ? (int)(at - word) : (int)used;
    if (word[*length] != '@')
        return KEMPE_OK;
    char *end;
    long number = strtol(word + *length + 1, &end, 10);
    if (end != word + used || number < 1 || number > f->run_count)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT, "'%.*s': NAME@K is of the K-th data file, and there %s %d",
                        (int)used, word, f->run_count == 1 ? "is" : "are", f->run_count);
    *run = (int)number - 1;
    return KEMPE_OK;
}

/* The names of a run's parameters, separated by commas; their places among the parameters of the fit. */
static kempe_status choose_parameters(kempe_fit *f, int k, kmp_text *names)
{
    kmp_fit_run *r = &f->run[k];
    for (int p = 0; p < f->count; p++) {
        int length, run;
        KMP_TRY(read_place(f, f->name[p], &length, &run));
        if (run >= 0 && run != k)
            continue;
        kmp_text_printf(names, "%s%.*s", r->count ? "," : "", length, f->name[p]);
        r->parameter[r->count++] = p;
    }
    if (r->count == 0)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT, "the run of '%s' has none of the parameters: leave the file out",
                        r->file);
    return kmp_made(f->context, !names->failed);
}

/* A value of only one run must not be one that all runs share. */
static kempe_status check_own(const kempe_fit *f, const char *word, int length)
{
    for (int p = 0; p < f->count; p++)
        if (strlen(f->name[p]) == (size_t)length && strncmp(f->name[p], word, (size_t)length) == 0)
            return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                            "'%s': parameter '%s' is to be found for all runs; write it as %s@K for one of them", word,
                            f->name[p], f->name[p]);
    return KEMPE_OK;
}

/* The model of a run with the values of `list`, NAME@K=VALUE,.., that are its own. */
static kempe_status set_own(kempe_fit *f, int k, const char *list)
{
    char **word = NULL;
    int count = kmp_text_words(&f->arena, list, &word), own = 0;
    const char **name = KMP_ARENA_NEW(&f->arena, const char *, count);
    double *value = KMP_ARENA_NEW(&f->arena, double, count);
    KMP_TRY(kmp_made(f->context, name && value));
    for (int i = 0; i < count; i++) {
        int length, run;
        KMP_TRY(read_place(f, word[i], &length, &run));
        const char *text = strchr(word[i], '=');
        if (run < 0 || !text)
            return kmp_fail(f->context, KEMPE_E_ARGUMENT, "'%s': NAME@K=VALUE is expected", word[i]);
        if (run != k)
            continue;
        KMP_TRY(check_own(f, word[i], length));
        name[own] = kmp_arena_printf(&f->arena, "%.*s", length, word[i]);
        KMP_TRY(kmp_made(f->context, name[own]));
        KMP_TRY(kmp_range_of_variable(f->model, "own", name[own], text + 1, strlen(text + 1), &value[own]));
        own++;
    }
    return own > 0 ? kmp_variant_instance(f->model, own, name, value, &f->run[k].own) : KEMPE_OK;
}

/* Columns of the data are columns of the rows, in any order, and one of the fit for all files that have its name. */
static void match_columns(kempe_fit *f, kmp_fit_run *r)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(r->runs);
    for (int c = 0; c < r->measured.columns; c++) {
        char *name = r->measured.name[c];
        for (int k = 0; k < rows->columns; k++)
            if (strcmp(rows->column[k], name) == 0)
                r->column[c] = k;
        r->among[c] = data_column(f, name, strlen(name));
        f->column_name[r->among[c]] = name;
        f->column_unit[r->among[c]] = rows->unit[r->column[c]];
        f->columns += r->among[c] == f->columns;
    }
}

static kempe_status derive_run(kempe_fit *f, int k, const kempe_fit_options *options)
{
    kmp_fit_run *r = &f->run[k];
    kmp_text names = {0};
    int columns = r->measured.columns;
    KMP_TRY(kmp_made(f->context, KMP_ARENA_MAKE(&f->arena, KMP_ROOM(int, columns, &r->column, &r->among),
                                                KMP_ROOM(int, f->count, &r->parameter))));
    kempe_status status = choose_parameters(f, k, &names);
    if (status == KEMPE_OK)
        status = set_own(f, k, options->own);
    if (status == KEMPE_OK)
        r->names = kmp_text_keep(&names, &f->arena);
    kmp_text_free(&names);
    KMP_TRY(status);
    KMP_TRY(kmp_made(f->context, !f->arena.failed));
    const kempe_sensitivity_options ask = {
        .parameters = r->names, .outputs = r->measured.outputs, .run = &f->run_options};
    KMP_TRY(kmp_slope_runs_new(r->own ? r->own : f->model, &ask, r->measured.rows, r->measured.t, true, &r->runs));
    r->most_steps = kmp_slope_runs_most(r->runs);
    KMP_TRY(kmp_measured_read(kmp_slope_runs_rows(r->runs), r->file, &r->measured));
    match_columns(f, r);
    for (int p = 0; p < r->count; p++) {
        double *start = &f->start[r->parameter[p]];
        *start = isnan(*start) ? kmp_slope_runs_rows(r->runs)->parameter[p] : *start;
    }
    return KEMPE_OK;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status count_run(kempe_fit *f, const kmp_fit_run *r)
{
    for (int c = 0; c < r->measured.columns; c++) {
        int known = 0;
        for (int row = 0; row < r->measured.rows; row++)
            known += !isnan(r->measured.value[(ptrdiff_t)row * r->measured.columns + c]);
        if (known == 0)
            return kmp_complain(f->context, r->file, 0, 0, "the column '%s' is empty", r->measured.name[c]);
        f->number[r->among[c]] += known;
        f->residuals += known;
    }
    return KEMPE_OK;
}

/* Several starts need places between bounds; they are usual where all parameters have both. */
static kempe_status choose_starts(kempe_fit *f, int asked)
{
    int endless = 0;
    while (endless < f->count && isfinite(f->upper[endless] - f->lower[endless]))
        endless++;
    bool possible = endless == f->count && f->count <= KMP_SOBOL_MOST;
    f->starts = asked > 0 ? asked : possible ? USUAL_STARTS : 1;
    if (f->starts == 1 || possible)
        return KEMPE_OK;
    if (endless < f->count)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                        "several starts (--starts) need both bounds of '%s': NAME:LOW:HIGH", f->name[endless]);
    return kmp_fail(f->context, KEMPE_E_ARGUMENT, "several starts are possible of at most %d parameters",
                    (int)KMP_SOBOL_MOST);
}

static kempe_status derive(kempe_fit *f, const kempe_fit_options *options)
{
    int columns = 0;
    for (int k = 0; k < f->run_count; k++)
        columns += f->run[k].measured.columns;
    KMP_TRY(kmp_made(
        f->context, KMP_ARENA_MAKE(&f->arena, KMP_ROOM(char *, columns, &f->column_name),
                                   KMP_ROOM(const char *, columns, &f->column_unit), KMP_ROOM(int, columns, &f->number),
                                   KMP_ROOM(double, columns, &f->deviation, &f->rms, &f->freedom, &f->own_scatter),
                                   KMP_ROOM(bool, columns, &f->exact))));
    for (int p = 0; p < f->count; p++)
        f->start[p] = NAN;
    for (int k = 0; k < f->run_count; k++)
        KMP_TRY(derive_run(f, k, options));
    KMP_TRY(read_deviations(f, options->deviations));
    if (options->start)
        KMP_TRY(kmp_box_bounds_read_start(f->context, options->start, &f->bounded, f->start));
    KMP_TRY(kmp_box_bounds_check(f->context, &f->bounded, f->start));
    memcpy(f->value, f->start, (size_t)f->count * sizeof *f->start);
    for (int k = 0; k < f->run_count; k++) {
        kmp_fit_run *r = &f->run[k];
        KMP_TRY(count_run(f, r));
        r->motion = KMP_ARENA_NEW(&f->arena, double, (ptrdiff_t)r->measured.rows * r->measured.columns);
        KMP_TRY(kmp_made(f->context, r->motion));
    }
    if (f->residuals <= f->count)
        return kmp_fail(f->context, KEMPE_E_FAILED,
                        "more measurements than parameters are needed, for their errors too: measurements %d, "
                        "parameters %d",
                        f->residuals, f->count);
    ptrdiff_t slopes = (ptrdiff_t)f->residuals * f->count;
    return kmp_made(f->context, KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, f->residuals, &f->residual),
                                               KMP_ROOM(double, slopes, &f->slope)));
}

static kempe_status prepare(kempe_fit *f, const kempe_fit_options *options)
{
    f->confidence = options->confidence > 0 ? options->confidence : 0.95;
    f->most = options->most > 0 ? options->most : MOST_RUNS;
    f->coarser = NAN;
    const kempe_run_options *run = options->run;
    KMP_OPTIONS(f->context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(f->context, run, KMP_STUDY_FIT));
    f->run_options = *run;
    f->run_options.threads = 1;
    f->threads = run->threads > 0 ? run->threads : kmp_processors();
    if (!kmp_squares_available)
        return kmp_fail(f->context, KEMPE_E_FAILED,
                        "this build has no least squares: install libcminpack-dev and build Kempe again");
    if (!(f->confidence < 1) || options->confidence < 0)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT, "the confidence %g is not between 0 and 1", options->confidence);
    KMP_WANTED(f->context, options->data, "data");
    const char *list = options->parameters;
    KMP_TRY(kmp_box_bounds_read(f->model, list, &f->arena, &f->bounded));
    f->count = f->bounded.count;
    f->name = f->bounded.name;
    f->lower = f->bounded.lower;
    f->upper = f->bounded.upper;
    KMP_TRY(kmp_made(f->context, KMP_ARENA_MAKE(&f->arena,
                                                KMP_ROOM(double, f->count, &f->start, &f->value, &f->error, &f->low,
                                                         &f->high, &f->factor, &f->best, &f->room),
                                                KMP_ROOM(double, (ptrdiff_t)f->count * f->count, &f->correlation),
                                                KMP_ROOM(kmp_fit_state, f->count, &f->state))));
    KMP_TRY(choose_starts(f, options->starts));
    /* The data files: `data`, then the others. */
    if (options->file_count > 0)
        KMP_WANTED(f->context, options->files, "files");
    int count = 1 + (options->file_count > 0 ? options->file_count : 0);
    f->run = KMP_ARENA_NEW(&f->arena, kmp_fit_run, count);
    KMP_TRY(kmp_made(f->context, f->run));
    f->run_count = count;
    for (int k = 0; k < count; k++) {
        kmp_fit_run *r = &f->run[k];
        const char *file = k > 0 ? options->files[k - 1] : options->data;
        KMP_WANTED(f->context, file, "files");
        r->file = kmp_arena_strdup(&f->arena, file);
        KMP_TRY(kmp_made(f->context, r->file));
        KMP_TRY(kmp_measured_begin(f->model, r->file, options->columns, &r->measured));
    }
    return derive(f, options);
}

/* The correlation of neighbouring residuals of a column; 0: it has too few. Residuals of noise are independent. */
static double neighbours(const kempe_fit *f, int column)
{
    double last = NAN, products = 0, squares = 0;
    int i = 0, run = -1;
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at); i++) {
        if (column_of(f, &at) != column)
            continue;
        squares += f->residual[i] * f->residual[i];
        products += at.run == run ? last * f->residual[i] : 0;
        last = f->residual[i];
        run = at.run;
    }
    return f->number[column] >= LEAST_FOR_NOISE && squares > 0 ? products / squares : 0;
}

static void warn(kempe_fit *f)
{
    /* A minimum at which the motion differs from the data has narrow intervals, too. Large residuals that are
     * independent are noise. */
    for (int c = 0; c < f->columns; c++) {
        double alike = f->exact[c] ? 0 : neighbours(f, c);
        if (!(alike > KMP_FIT_ALIKE))
            continue;
        if (f->rms[c] > KMP_FIT_UNLIKE * f->own_scatter[c])
            kmp_doubt(f->context,
                      "the fitted motion does not follow the data: residual of '%s' is %.2g of the data's deviation; "
                      "the minimum may be local (--starts 8), or the model lacks an effect",
                      f->column_name[c], f->rms[c] / f->own_scatter[c]);
        else
            kmp_log(f->context, KEMPE_LOG_WARNING,
                    "the residuals of '%s' are not noise (correlation of neighbours %.2f), and the intervals too "
                    "narrow; the minimum may be local (--starts), or the model lacks an effect",
                    f->column_name[c], alike);
    }
    kmp_text open = {0};
    kmp_fit_put_open(f, &open);
    if (open.s)
        kmp_log(f->context, KEMPE_LOG_WARNING, "%s", open.s);
    for (int c = 0; c < f->columns; c++)
        if (fit_has_few(f, c))
            kmp_log(
                f->context, KEMPE_LOG_WARNING,
                "the column '%s' has %d measurements for %d parameters, too few to estimate its deviation: %.3g %s is "
                "taken, by the residuals of all columns; give it (--deviations)",
                f->column_name[c], f->number[c], f->free, f->deviation[c], f->column_unit[c]);
    if (f->unsettled)
        kmp_doubt(f->context,
                  "the deviations of the columns still change after %d searches: do not trust the intervals; give the "
                  "deviations (--deviations)",
                  f->rounds);
    if (f->outcome == KMP_SQUARES_MOST)
        kmp_doubt(f->context,
                  "the search has not converged after %d runs: continue from its result, or allow more runs",
                  f->evaluations);
    if (f->coarser > KMP_FIT_COARSE)
        kmp_log(f->context, KEMPE_LOG_WARNING,
                "the fitted motion changes by %.2g deviations of the noise at a hundredfold tolerance: use a smaller "
                "rtol",
                f->coarser);
    kmp_text_free(&open);
}

/* After an interrupt: the best values, their motion where it can be computed. */
static kempe_status keep_best(kempe_fit *f)
{
    if (!isfinite(f->size))
        return KEMPE_STOPPED;
    memcpy(f->value, f->best, (size_t)f->count * sizeof *f->best);
    f->outcome = KMP_SQUARES_ENDED;
    kmp_model_begin_forces(f->model);
    KMP_TRY(stand_at_estimates(f));
    KMP_TRY(kmp_fit_judge(f));
    (void)kmp_fail(f->context, KEMPE_STOPPED, "interrupted after %d runs: the best values so far are given",
                   f->evaluations);
    return KEMPE_STOPPED;
}

kempe_status kempe_fit_new(const kempe_model *model, const kempe_fit_options *options, kempe_fit **fit)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, fit, "fit");
    KMP_OPTIONS(context, kempe_fit_options, options);
    kmp_model_begin_forces(model);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(context, kempe_fit, f);
    f->context = context;
    f->model = model;
    kempe_status status = prepare(f, options);
    if (status == KEMPE_OK) {
        const bool quiet = kmp_context_quiet(f->context, true);
        status = search(f);
        if (status == KEMPE_OK)
            status = kmp_fit_judge(f);
        if (status == KEMPE_OK)
            status = check_tolerance(f);
        status = status == KEMPE_STOPPED ? keep_best(f) : status;
        (void)kmp_context_quiet(f->context, quiet);
    }
    bool given = status == KEMPE_OK || (status == KEMPE_STOPPED && isfinite(f->size));
    if (given) {
        warn(f);
        status = kmp_context_verdict(f->context, status);
        f->warnings = kmp_context_warnings(f->context);
        f->reason = kmp_strdup(kmp_is_complete(status) ? "" : kempe_context_message(f->context));
        f->status = status;
    }
    if (!given || !f->warnings || !f->reason) {
        kempe_fit_free(f);
        return given ? kmp_fail_memory(context) : status;
    }
    *fit = f;
    return status;
}

void kempe_fit_free(kempe_fit *fit)
{
    if (!fit)
        return;
    for (int k = 0; k < fit->run_count; k++) {
        kmp_slope_runs_free(fit->run[k].runs);
        kmp_measured_free(&fit->run[k].measured);
        kempe_model_free(fit->run[k].own);
    }
    kmp_free(fit->refusal);
    kmp_free(fit->reason);
    kmp_free(fit->warnings);
    kmp_arena_free(&fit->arena);
    kmp_free(fit);
}

KMP_GETTER(int kempe_fit_count(const kempe_fit *fit), fit, fit->count, 0)
KMP_GETTER(int kempe_fit_rank(const kempe_fit *fit), fit, fit->rank, 0)
KMP_GETTER_AT(const char *kempe_fit_name(const kempe_fit *fit, int k), fit, k, fit->count, fit->name[k], "")
KMP_GETTER_AT(double kempe_fit_value(const kempe_fit *fit, int k), fit, k, fit->count, fit->value[k], NAN)
KMP_GETTER_AT(double kempe_fit_error(const kempe_fit *fit, int k), fit, k, fit->count, fit->error[k], NAN)
KMP_GETTER_AT(double kempe_fit_low(const kempe_fit *fit, int k), fit, k, fit->count, fit->low[k], NAN)
KMP_GETTER_AT(double kempe_fit_high(const kempe_fit *fit, int k), fit, k, fit->count, fit->high[k], NAN)
