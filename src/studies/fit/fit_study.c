/* SPDX-License-Identifier: BSD-3-Clause */
/* The search: options, weights of the columns, trials. */
#include "studies/fit/fit_study.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "output/print.h"
#include "studies/ensemble/designs.h"
#include "studies/ensemble/statistics/shares.h"
#include <math.h>
#include <string.h>

enum { MOST_RUNS = 200, MOST_ROUNDS = 10 };

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status read_parameters(kempe_fit *f, const char *list, kmp_text *names)
{
    KMP_TRY(kmp_bounded_read(f->context, list, &f->arena, &f->bounded));
    f->count = f->bounded.count;
    f->name = f->bounded.name;
    f->lower = f->bounded.lower;
    f->upper = f->bounded.upper;
    for (int k = 0; k < f->count; k++)
        kmp_text_printf(names, "%s%s", k ? "," : "", f->name[k]);
    KMP_TRY(kmp_made(f->context, KMP_ARENA_MAKE(&f->arena,
                                                KMP_ROOM(double, f->count, &f->start, &f->value, &f->error, &f->low,
                                                         &f->high, &f->best),
                                                KMP_ROOM(double, (ptrdiff_t)f->count * f->count, &f->correlation),
                                                KMP_ROOM(kmp_fit_state, f->count, &f->state))));
    return kmp_made(f->context, !names->failed);
}

static int data_column(const kempe_fit *f, const char *name, size_t length)
{
    int c = 0;
    while (c < f->measured.columns &&
           (strlen(f->measured.name[c]) != length || strncmp(f->measured.name[c], name, length) != 0))
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
        if (!word[k][length] || c == f->measured.columns)
            return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                            "deviation '%s': COLUMN=VALUE with a column of the data is expected", word[k]);
        KMP_TRY(kmp_bounded_number(f->context, "deviation", word[k] + length + 1, strlen(word[k] + length + 1),
                                   &f->deviation[c]));
        if (!(f->deviation[c] > 0))
            return kmp_fail(f->context, KEMPE_E_ARGUMENT, "deviation '%s': it must be positive", word[k]);
    }
    f->given = count > 0;
    for (int c = 0; f->given && c < f->measured.columns; c++)
        if (!(f->deviation[c] > 0))
            return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                            "the deviation of '%s' is missing: give that of every column, or of none",
                            f->measured.name[c]);
    return kmp_made(f->context, !f->arena.failed);
}

/* -- trials ------------------------------------------------------------------------------------------ */

static double measured(const kempe_fit *f, int row, int column)
{
    return f->measured.value[(ptrdiff_t)row * f->measured.columns + column];
}

void kmp_fit_weigh(kempe_fit *fit, double *residual, double *slope)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(fit->runs);
    int at = 0;
    for (int row = 0; row < fit->measured.rows; row++)
        for (int c = 0; c < fit->measured.columns; c++) {
            double wanted = measured(fit, row, c), weight = 1 / fit->deviation[c];
            if (isnan(wanted))
                continue;
            residual[at] = weight * (kmp_sensitivity_value(rows, row, fit->column[c]) - wanted);
            for (int k = 0; k < fit->count; k++)
                slope[at + (ptrdiff_t)k * fit->residuals] =
                    weight * kmp_sensitivity_slope(rows, row, fit->column[c], k);
            at++;
        }
}

static double sum_of_squares(int count, const double *x)
{
    double sum = 0;
    for (int k = 0; k < count; k++)
        sum += x[k] * x[k];
    return sum;
}

static kmp_squares_said try(void *user, const double *x, double *residual, double *slope)
{
    kempe_fit *f = user;
    kmp_progress(f->context, KMP_PROGRESS_STUDY, f->evaluations, (double)f->most * f->starts, "runs");
    f->evaluations++;
    f->status = kmp_slope_runs_at(f->runs, x);
    if (f->status == KEMPE_E_FAILED) {
        kmp_free(f->refusal);
        f->refusal = kmp_strdup(kempe_context_message(f->context));
        return f->refusal ? KMP_SQUARES_NOWHERE : KMP_SQUARES_END;
    }
    if (f->status != KEMPE_OK)
        return KMP_SQUARES_END;
    kmp_fit_weigh(f, residual, slope);
    double size = sum_of_squares(f->residuals, residual);
    if (!(size >= f->size)) {
        f->size = size;
        memcpy(f->best, x, (size_t)f->count * sizeof *x);
    }
    return KMP_SQUARES_GO;
}

/* -- weights ----------------------------------------------------------------------------------------- */

/* The scatter of each column about its mean: the first weights, and the size of rounding. */
static void find_scatter(const kempe_fit *f, double *scatter)
{
    for (int c = 0; c < f->measured.columns; c++) {
        double mean = 0, sum = 0, most = 0;
        for (int row = 0; row < f->measured.rows; row++)
            mean += isnan(measured(f, row, c)) ? 0 : measured(f, row, c) / f->number[c];
        for (int row = 0; row < f->measured.rows; row++) {
            double away = isnan(measured(f, row, c)) ? 0 : measured(f, row, c) - mean;
            sum += away * away;
            most = fmax(most, isnan(measured(f, row, c)) ? 0 : fabs(measured(f, row, c)));
        }
        scatter[c] = sum > 0 ? sqrt(sum / f->number[c]) : most > 0 ? most : 1;
    }
}

static void find_rms(kempe_fit *f)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(f->runs);
    for (int c = 0; c < f->measured.columns; c++) {
        double sum = 0;
        for (int row = 0; row < f->measured.rows; row++) {
            double away = measured(f, row, c) - kmp_sensitivity_value(rows, row, f->column[c]);
            sum += isnan(away) ? 0 : away * away;
        }
        f->rms[c] = sqrt(sum / f->number[c]);
    }
}

/* Weights by the residuals; true if they have changed. */
static bool weigh_again(kempe_fit *f, const double *scatter)
{
    const double least = KMP_FIT_NOISE * kmp_slope_runs_rows(f->runs)->rtol;
    bool changed = false;
    for (int c = 0; c < f->measured.columns; c++) {
        double next = fmax(f->rms[c], least * scatter[c]);
        f->exact[c] = f->rms[c] < next;
        changed = changed || fabs(next - f->deviation[c]) > KMP_FIT_WEIGHTS * f->deviation[c];
        f->deviation[c] = next;
    }
    return changed;
}

/* -- the search -------------------------------------------------------------------------------------- */

static kempe_status search_once(kempe_fit *f)
{
    const kmp_squares squares = {.rows = f->residuals,
                                 .count = f->count,
                                 .lower = f->lower,
                                 .upper = f->upper,
                                 .tolerance = KMP_FIT_ENOUGH,
                                 .most = f->most,
                                 .at = try,
                                 .user = f};
    kmp_squares_report report = {0};
    if (!kmp_squares_minimise(&squares, f->value, &report))
        return kmp_fail_memory(f->context);
    f->iterations += report.iterations;
    f->refused += report.refused;
    f->outcome = report.outcome;
    if (report.outcome != KMP_SQUARES_NO_START || f->status != KEMPE_E_FAILED)
        return f->status == KEMPE_E_FAILED ? KEMPE_OK : f->status;
    kmp_context_clear(f->context);
    return kmp_fail(f->context, KEMPE_E_FAILED, "the model does not run with the values of the start: %s",
                    f->refusal ? f->refusal : "");
}

/* Searches from all starts: the first one is given, the others are places of a Sobol sequence between the bounds. Those
 * at which the model does not run are passed over unless there is no other. */
static kempe_status search_all(kempe_fit *f)
{
    kmp_squares_outcome outcome = KMP_SQUARES_NO_START;
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < f->starts; k++) {
        const double before = f->size;
        for (int p = 0; k > 0 && p < f->count; p++) {
            double part = kmp_design_point(KMP_DESIGN_SOBOL, 1, (uint64_t)k - 1, 0, p, f->count);
            f->value[p] = f->lower[p] + part * (f->upper[p] - f->lower[p]);
        }
        status = search_once(f);
        if (status != KEMPE_OK && (status != KEMPE_E_FAILED || f->outcome != KMP_SQUARES_NO_START))
            return status;
        f->searches++;
        outcome = f->size < before ? f->outcome : outcome;
    }
    if (!isfinite(f->size))
        return status;
    kmp_context_clear(f->context);
    memcpy(f->value, f->best, (size_t)f->count * sizeof *f->best);
    f->outcome = outcome;
    return KEMPE_OK;
}

/* Rows, residuals and derivatives at the estimates. */
static kempe_status stand_at_estimates(kempe_fit *f)
{
    KMP_TRY(kmp_slope_runs_at(f->runs, f->value));
    kmp_fit_weigh(f, f->residual, f->slope);
    find_rms(f);
    const kempe_sensitivity *rows = kmp_slope_runs_rows(f->runs);
    for (int row = 0; row < f->measured.rows; row++)
        for (int c = 0; c < f->measured.columns; c++)
            f->motion[(ptrdiff_t)row * f->measured.columns + c] = kmp_sensitivity_value(rows, row, f->column[c]);
    return KEMPE_OK;
}

/* Rounds: each column's weight follows from its residuals, and the search from the weights. Its start moves. */
static kempe_status search(kempe_fit *f)
{
    double *scatter = KMP_ARENA_NEW(&f->arena, double, f->measured.columns);
    KMP_TRY(kmp_made(f->context, scatter));
    find_scatter(f, scatter);
    if (!f->given)
        memcpy(f->deviation, scatter, (size_t)f->measured.columns * sizeof *scatter);
    bool again = true;
    while (again) {
        f->size = INFINITY;
        KMP_TRY(f->rounds == 0 ? search_all(f) : search_once(f));
        f->rounds++;
        KMP_TRY(stand_at_estimates(f));
        again = !f->given && weigh_again(f, scatter) && f->measured.columns > 1 && f->outcome == KMP_SQUARES_FOUND &&
                f->rounds < MOST_ROUNDS;
    }
    kmp_fit_weigh(f, f->residual, f->slope);
    return KEMPE_OK;
}

/* The change of the fitted motion at a hundredfold tolerance, in deviations of the noise. */
static kempe_status check_tolerance(kempe_fit *f)
{
    enum { COARSER = 100 };
    const kempe_sensitivity *rows = kmp_slope_runs_rows(f->runs);
    kempe_status status = kmp_slope_runs_coarser(f->runs, COARSER, f->value);
    if (status != KEMPE_OK)
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    f->coarser = 0;
    for (int row = 0; row < f->measured.rows; row++)
        for (int c = 0; c < f->measured.columns; c++) {
            double fitted = f->motion[(ptrdiff_t)row * f->measured.columns + c];
            double away = fabs(kmp_sensitivity_value(rows, row, f->column[c]) - fitted) / f->deviation[c];
            f->coarser = isnan(measured(f, row, c)) || f->exact[c] ? f->coarser : fmax(f->coarser, away);
        }
    return KEMPE_OK;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status count_measurements(kempe_fit *f)
{
    for (int c = 0; c < f->measured.columns; c++) {
        for (int row = 0; row < f->measured.rows; row++)
            f->number[c] += !isnan(measured(f, row, c));
        if (f->number[c] == 0)
            return kmp_complain(f->context, f->file, 0, 0, "the column '%s' is empty", f->measured.name[c]);
        f->residuals += f->number[c];
    }
    if (f->residuals <= f->count)
        return kmp_fail(f->context, KEMPE_E_FAILED,
                        "more measurements than parameters are needed, for their errors too: measurements %d, "
                        "parameters %d",
                        f->residuals, f->count);
    ptrdiff_t slopes = (ptrdiff_t)f->residuals * f->count, cells = (ptrdiff_t)f->measured.rows * f->measured.columns;
    return kmp_made(f->context,
                    KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, f->residuals, &f->residual),
                                   KMP_ROOM(double, slopes, &f->slope), KMP_ROOM(double, cells, &f->motion)));
}

/* The rows have all columns of the data, in any order. */
static void match_columns(kempe_fit *f)
{
    const kempe_sensitivity *rows = kmp_slope_runs_rows(f->runs);
    for (int c = 0; c < f->measured.columns; c++)
        for (int k = 0; k < rows->columns; k++)
            if (strcmp(rows->column[k], f->measured.name[c]) == 0)
                f->column[c] = k;
}

/* Several starts need places between bounds. */
static kempe_status check_starts(const kempe_fit *f)
{
    for (int k = 0; f->starts > 1 && k < f->count; k++)
        if (!isfinite(f->upper[k] - f->lower[k]))
            return kmp_fail(f->context, KEMPE_E_ARGUMENT,
                            "several starts are places between bounds, and parameter '%s' has not got both: "
                            "NAME:LOW:HIGH",
                            f->name[k]);
    return f->count <= KMP_SOBOL_MOST || f->starts == 1
               ? KEMPE_OK
               : kmp_fail(f->context, KEMPE_E_ARGUMENT, "several starts are possible of at most %d parameters",
                          (int)KMP_SOBOL_MOST);
}

static kempe_status derive(kempe_fit *f, const kempe_fit_options *options, const char *names)
{
    const kempe_sensitivity_options ask = {.parameters = names, .outputs = f->measured.outputs, .run = options->run};
    int columns = f->measured.columns;
    KMP_TRY(kmp_slope_runs_new(f->model, &ask, f->measured.rows, f->measured.t, &f->runs));
    KMP_TRY(kmp_measured_read(kmp_slope_runs_rows(f->runs), options->data, &f->measured));
    KMP_TRY(kmp_made(f->context, KMP_ARENA_MAKE(&f->arena, KMP_ROOM(int, columns, &f->column, &f->number),
                                                KMP_ROOM(double, columns, &f->deviation, &f->rms),
                                                KMP_ROOM(bool, columns, &f->exact))));
    match_columns(f);
    KMP_TRY(read_deviations(f, options->deviations));
    memcpy(f->start, kmp_slope_runs_rows(f->runs)->parameter, (size_t)f->count * sizeof *f->start);
    if (options->start)
        KMP_TRY(kmp_bounded_read_start(f->context, options->start, &f->bounded, f->start));
    KMP_TRY(kmp_bounded_check(f->context, &f->bounded, f->start));
    memcpy(f->value, f->start, (size_t)f->count * sizeof *f->start);
    return count_measurements(f);
}

static kempe_status prepare(kempe_fit *f, const kempe_fit_options *options)
{
    kmp_text names = {0};
    f->confidence = options->confidence > 0 ? options->confidence : 0.95;
    f->most = options->most > 0 ? options->most : MOST_RUNS;
    f->coarser = NAN;
    f->starts = options->starts > 0 ? options->starts : 1;
    if (!kmp_squares_available())
        return kmp_fail(f->context, KEMPE_E_FAILED,
                        "this build has no least squares: install libcminpack-dev and build Kempe again");
    if (!(f->confidence < 1) || options->confidence < 0)
        return kmp_fail(f->context, KEMPE_E_ARGUMENT, "the confidence %g is not between 0 and 1", options->confidence);
    KMP_WANTED(f->context, options->data, "data");
    f->file = kmp_arena_strdup(&f->arena, options->data);
    KMP_TRY(kmp_made(f->context, f->file));
    kempe_status status = read_parameters(f, options->parameters, &names);
    if (status == KEMPE_OK)
        status = check_starts(f);
    if (status == KEMPE_OK)
        status = kmp_measured_begin(f->model, options->data, options->columns, &f->measured);
    if (status == KEMPE_OK)
        status = derive(f, options, names.s);
    kmp_text_free(&names);
    return status;
}

static void warn(kempe_fit *f)
{
    kmp_text open = {0};
    kmp_fit_put_open(f, &open);
    if (open.s)
        kmp_log(f->context, KEMPE_LOG_WARNING, "%s", open.s);
    if (f->outcome == KMP_SQUARES_MOST)
        kmp_log(f->context, KEMPE_LOG_WARNING,
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
    kmp_context_begin(f->context);
    KMP_TRY(stand_at_estimates(f));
    KMP_TRY(kmp_fit_judge(f));
    (void)kmp_fail(f->context, KEMPE_STOPPED, "interrupted after %d runs: the best values so far are given",
                   f->evaluations);
    return KEMPE_STOPPED;
}

static kempe_status find(kempe_fit *f)
{
    kempe_status status = search(f);
    if (status == KEMPE_OK)
        status = kmp_fit_judge(f);
    if (status == KEMPE_OK)
        status = check_tolerance(f);
    return status == KEMPE_STOPPED ? keep_best(f) : status;
}

kempe_status kempe_fit_new(const kempe_model *model, const kempe_fit_options *options, kempe_fit **fit)
{
    KMP_WANTED_BOTH(model, fit);
    KMP_OPTIONS(model->context, kempe_fit_options, options);
    kmp_context_begin(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(model->context, kempe_fit, f);
    f->context = model->context;
    f->model = model;
    kempe_status status = prepare(f, options);
    if (status == KEMPE_OK) {
        kmp_context_quiet(f->context, true);
        status = find(f);
        kmp_context_quiet(f->context, false);
    }
    bool given = status == KEMPE_OK || (status == KEMPE_STOPPED && isfinite(f->size));
    if (given) {
        warn(f);
        f->warnings = kmp_context_warnings(f->context);
        f->reason = kmp_strdup(status == KEMPE_OK ? "" : kempe_context_message(f->context));
        f->status = status;
    }
    if (!given || !f->warnings || !f->reason) {
        kempe_fit_free(f);
        return given ? kmp_fail_memory(model->context) : status;
    }
    *fit = f;
    return status;
}

void kempe_fit_free(kempe_fit *fit)
{
    if (!fit)
        return;
    kmp_slope_runs_free(fit->runs);
    kmp_measured_free(&fit->measured);
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
