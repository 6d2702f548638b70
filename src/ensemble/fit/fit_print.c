/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/study_print.h"
#include "ensemble/fit/fit_statistics.h"
#include "ensemble/fit/fit_study.h"
#include "model/data/start.h"
#include "output/print.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include <math.h>
#include <string.h>

static const char *const states[] = {"", "lower", "upper", "open"};
static const char *const outcomes[] = {"converged", "not converged", "interrupted", "no start"};

static kmp_shown column_shown(const kempe_fit *f, int column)
{
    return kmp_shown_as(f->context, kmp_print_unknown(f->context, f->column_unit[column]));
}

static kmp_shown parameter_shown(const kempe_fit *f, int k)
{
    return kmp_shown_of(kmp_fit_rows(f, 0)->system, f->name[k]);
}

/* -- text -------------------------------------------------------------------------------------------- */

static int known_in(const kempe_fit *f, int run)
{
    int count = 0;
    for (kmp_fit_cell at = KMP_FIT_BEGIN; kmp_fit_next(f, &at);)
        count += at.run == run;
    return count;
}

/* The end of the longest run. */
static double last_time(const kempe_fit *f)
{
    double t_end = 0;
    for (int k = 0; k < f->run_count; k++)
        t_end = fmax(t_end, kmp_fit_rows(f, k)->t_end);
    return t_end;
}

static void sum_times(const kempe_fit *f, double *cpu_s, double *build_s)
{
    *cpu_s = f->helped_s;
    *build_s = f->helped_build_s;
    for (int k = 0; k < f->run_count; k++) {
        *cpu_s += kmp_fit_rows(f, k)->cpu_s;
        *build_s += kmp_fit_rows(f, k)->build_s;
    }
}

/* "fit of rho to 251 measurements, residual 1e-9 rad in q.D (0.001 % of the deviation of the data)" */
static void put_answer(kmp_text *text, const kempe_fit *f)
{
    enum { NAMED = 2 };
    int c = 0; /* the column whose residual is the largest part of the deviation of its data */
    for (int k = 1; k < f->columns; k++)
        if (f->rms[k] * f->own_scatter[c] > f->rms[c] * f->own_scatter[k])
            c = k;
    kmp_print_title(text, f->model, kmp_outcome_of(f->status));
    kmp_text_put(text, "fit of ");
    if (f->count > NAMED)
        kmp_text_printf(text, "%d parameters", f->count);
    for (int k = 0; f->count <= NAMED && k < f->count; k++)
        kmp_text_printf(text, "%s%s", k ? " and " : "", f->name[k]);
    kmp_text_printf(text, " to %d measurements\n", f->residuals);
    kmp_starts_show(text, "run", kmp_model_start(f->model)->at);
    if (f->outcome == KMP_SQUARES_NO_START)
        return;
    kmp_text_put(text, f->columns > 1 ? "  residual at most " : "  residual ");
    kmp_print_quantity(text, f->context, 2, f->rms[c], kmp_print_unknown(f->context, f->column_unit[c]));
    kmp_text_printf(text, " of %s", f->column_name[c]);
    if (f->own_scatter[c] > 0)
        kmp_text_printf(text, ", %.2g %% of the deviation of the data from its mean",
                        kmp_print_clean(100 * f->rms[c] / f->own_scatter[c], 100 * KMP_PRINT_NOISE));
    kmp_text_put(text, "\n");
}

static void put_search(kmp_text *text, const kempe_fit *f)
{
    kmp_text words = {0};
    kmp_text_printf(&words, "%s after %d iterations, %d runs of the model; ", outcomes[f->outcome], f->iterations,
                    f->evaluations);
    if (f->starts > 1)
        kmp_text_printf(&words, "the best of %d searches; ", f->searches);
    kmp_text_printf(&words, "weights %s", f->given ? "given" : "from the residuals");
    kmp_print_wrapped(text, "search    ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
    if (f->refused == 0 || !f->refusal)
        return;
    kmp_text_printf(&words, "%d trials do not run, the last one because: %s", f->refused, f->refusal);
    kmp_print_wrapped(text, "failures  ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

static void put_method(kmp_text *text, const kempe_fit *f)
{
    const kempe_sensitivity *rows = kmp_fit_rows(f, 0);
    if (isfinite(f->coarser))
        kmp_text_printf(text, "accuracy  a hundredfold tolerance changes the motion by %.2g standard deviations\n",
                        f->coarser);
    if (rows->differences)
        kmp_text_printf(text,
                        "          derivatives by differences, because a body rolls in space: uncertain by %.2g\n",
                        kmp_fit_slope_error(f));
    for (int k = 0; k < f->run_count; k++) {
        const kmp_measured *m = &f->run[k].measured;
        kmp_text_printf(text, "%-9s %s: %d rows, %d column%s, %d measurements", k ? "" : "data", f->run[k].file,
                        m->rows, m->columns, m->columns == 1 ? "" : "s", known_in(f, k));
        kmp_text_put(text, f->run[k].own ? ", values of its own\n" : "\n");
    }
    put_search(text, f);
    kmp_text_printf(text, "run       %s to t = %.6g s, rtol %g, atol %g\n", rows->integrator, last_time(f), rows->rtol,
                    rows->atol);
}

static void put_columns(kmp_text *text, const kempe_fit *f)
{
    int width = kmp_print_widest(f->columns, f->column_name, 9);
    kmp_text_printf(text, "\n  %-*s  %14s  %14s  %14s\n", width, "column", "measurements", "rms residual", "deviation");
    for (int c = 0; c < f->columns; c++) {
        const kmp_shown shown = column_shown(f, c);
        kmp_text_printf(text, "  %-*s  %14d", width, f->column_name[c], f->number[c]);
        kmp_print_cells(text, "  %14.2g  %14.6g  %s\n", shown.factor * f->rms[c], shown.factor * f->deviation[c],
                        shown.unit);
    }
}

static void put_correlation(kmp_text *text, const kempe_fit *f)
{
    enum { A_LINE = 8 };
    int width = kmp_print_widest(f->count, f->name, 11);
    for (int first = 0; f->count > 1 && first < f->count; first += A_LINE) {
        int end = first + A_LINE < f->count ? first + A_LINE : f->count;
        kmp_text_printf(text, "\n  %-*s", width, first ? "" : "correlation");
        for (int i = first; i < end; i++)
            kmp_text_printf(text, "  %*s", kmp_print_widest(1, &f->name[i], 7), f->name[i]);
        kmp_text_put(text, "\n");
        for (int k = 0; k < f->count; k++) {
            kmp_text_printf(text, "  %-*s", width, f->name[k]);
            for (int i = first; i < end; i++)
                kmp_print_cells(text, "  %*.4f", kmp_print_widest(1, &f->name[i], 7), f->correlation[k + i * f->count]);
            kmp_text_put(text, "\n");
        }
    }
}

static void put_estimates(kmp_text *text, const kempe_fit *f)
{
    const int width = kmp_print_widest(f->count, f->name, 9);
    bool in_si = true;
    kmp_text_printf(text, "\n  %-*s  %12s  %14s  %13s  %12s  %12s\n", width, "parameter", "estimate", "standard error",
                    "interval from", "to", "start");
    for (int k = 0; k < f->count; k++) {
        const char *const words[] = {[KMP_FIT_INSIDE] = "",
                                     [KMP_FIT_LOWER] = "  on its lower bound",
                                     [KMP_FIT_UPPER] = "  on its upper bound",
                                     [KMP_FIT_OPEN] = "  not determined by the data"};
        const kmp_shown as = parameter_shown(f, k);
        kmp_print_cells(text, "  %-*s  %12.6g  %14.2g  %13.6g  %12.6g  %12.6g", width, f->name[k],
                        as.factor * f->value[k], as.factor * f->error[k], as.factor * f->low[k], as.factor * f->high[k],
                        as.factor * f->start[k]);
        kmp_text_printf(text, "%s%s%s\n", *as.unit ? "  " : "", as.unit, words[f->state[k]]);
        in_si = in_si && as.factor == 1;
    }
    kmp_text_printf(text, "  %s%g %% confidence intervals, %d degrees of freedom, condition number %.2g\n",
                    in_si ? "values in SI, " : "", 100 * f->confidence, f->freedoms, f->condition);
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_fit *f = result;
    kmp_text open = {0};
    put_answer(text, f);
    if (f->reason[0])
        kmp_print_wrapped(text, "  ", 4, f->reason);
    kmp_print_doubts(text, kmp_outcome_of(f->status), f->warnings);
    kmp_fit_put_open(f, &open);
    if (open.s)
        kmp_print_wrapped(text, "  ", 4, open.s);
    kmp_text_free_part(text, &open);
    put_estimates(text, f);
    if (f->columns > 1 || f->outcome == KMP_SQUARES_NO_START)
        put_columns(text, f);
    put_correlation(text, f);
    kmp_text_put(text, "\n");
    put_method(text, f);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void put_json(kmp_text *text, const void *result)
{
    const kempe_fit *f = result;
    const kempe_sensitivity *rows = kmp_fit_rows(f, 0);
    double cpu_s, build_s;
    int count = 0;
    sum_times(f, &cpu_s, &build_s);
    for (int k = 0; k < f->run_count; k++)
        count += f->run[k].measured.rows;
    kmp_json json = kmp_print_head(text, rows->system, kmp_outcome_of(f->status), f->reason, build_s, f->warnings);
    kmp_json_put(&json,
                 "data %s rows %d measurements %d search %s searches %d iterations %d runs %d shortened %d refusal %s",
                 f->run[0].file, count, f->residuals, outcomes[f->outcome], f->searches, f->iterations, f->evaluations,
                 f->refused, f->refusal);
    kmp_json_put(&json, "weights %s integrator %s t_end %g rtol %g atol %g cpu_s %g tolerance_change %g",
                 f->given ? "given" : "residuals", rows->integrator, last_time(f), rows->rtol, rows->atol, cpu_s,
                 f->coarser);
    kmp_json_put(&json, "confidence %g degrees_of_freedom %d rank %d free %d condition %g", f->confidence, f->freedoms,
                 f->rank, f->free, f->condition);
    kmp_json_put(&json, "slopes %s slope_error %g files [", rows->differences ? "differences" : "exact",
                 kmp_fit_slope_error(f));
    for (int k = 0; k < f->run_count; k++)
        kmp_json_put(&json, "{ file %s rows %d measurements %d }", f->run[k].file, f->run[k].measured.rows,
                     known_in(f, k));
    kmp_json_put(&json, "] parameters {");
    for (int k = 0; k < f->count; k++)
        kmp_json_put(&json, "%s { value %g error %g low %g high %g start %g lower %g upper %g state %s }", f->name[k],
                     f->value[k], f->error[k], f->low[k], f->high[k], f->start[k], f->lower[k], f->upper[k],
                     states[f->state[k]]);
    kmp_json_put(&json, "} correlation {");
    for (int k = 0; k < f->count; k++) {
        kmp_json_object(&json, f->name[k]);
        for (int i = 0; i < f->count; i++)
            kmp_json_number(&json, f->name[i], f->correlation[k + i * f->count]);
        kmp_json_end(&json);
    }
    kmp_json_put(&json, "} columns {");
    for (int c = 0; c < f->columns; c++)
        kmp_json_put(&json, "%s { measurements %d rms %g deviation %g unit %s }", f->column_name[c], f->number[c],
                     f->rms[c], f->deviation[c], f->column_unit[c]);
    kmp_json_put(&json, "} }");
}

KMP_PRINT(kempe_fit, fit, fit->context, put_json, put_text)

/* -- tables ------------------------------------------------------------------------------------------ */

static void fill_parameters(kempe_table *table, const void *result)
{
    const kempe_fit *f = result;
    kmp_tabulate_columns(table, "parameter[words] value error low high start lower upper state[words] unit[words]");
    for (int k = 0; k < f->count; k++) {
        const kmp_shown as = parameter_shown(f, k);
        KMP_TABULATE(table, "%s %g %g %g %g %g %g %g %s %s", f->name[k], as.factor * f->value[k],
                     as.factor * f->error[k], as.factor * f->low[k], as.factor * f->high[k], as.factor * f->start[k],
                     as.factor * f->lower[k], as.factor * f->upper[k], states[f->state[k]], as.unit);
    }
}

static void fill_correlation(kempe_table *table, const void *result)
{
    const kempe_fit *f = result;
    kmp_tabulate_columns(table, "parameter[words]");
    for (int k = 0; k < f->count; k++)
        kmp_tabulate_column(table, "", "%s", f->name[k]);
    for (int k = 0; k < f->count; k++) {
        KMP_TABULATE(table, "%s", f->name[k]);
        for (int i = 0; i < f->count; i++)
            kmp_tabulate_number(table, f->correlation[k + i * f->count]);
    }
}

static void fill_columns(kempe_table *table, const void *result)
{
    const kempe_fit *f = result;
    kmp_tabulate_columns(table, "column[words] count rms deviation unit[words]");
    for (int c = 0; c < f->columns; c++) {
        const kmp_shown as = column_shown(f, c);
        KMP_TABULATE(table, "%s %d %g %g %s", f->column_name[c], f->number[c], as.factor * f->rms[c],
                     as.factor * f->deviation[c], as.unit);
    }
}

/* Fitted motion, measurement and difference of each column of the fit; NaN where a file lacks it. */
static void tabulate_run(kempe_table *table, const kempe_fit *f, int run, bool numbered)
{
    const kmp_fit_run *r = &f->run[run];
    const kmp_measured *m = &r->measured;
    for (int row = 0; row < m->rows; row++) {
        kmp_tabulate_row(table);
        if (numbered)
            kmp_tabulate_number(table, run + 1);
        kmp_tabulate_number(table, m->t[row]);
        for (int c = 0; c < f->columns; c++) {
            double fitted = NAN, measured = NAN;
            for (int k = 0; k < m->columns; k++)
                if (r->among[k] == c) {
                    fitted = r->motion[(ptrdiff_t)row * m->columns + k];
                    measured = m->value[(ptrdiff_t)row * m->columns + k];
                }
            kmp_tabulate_number(table, fitted);
            kmp_tabulate_number(table, measured);
            kmp_tabulate_number(table, measured - fitted);
        }
    }
}

static void tabulate_heads(kempe_table *table, const kempe_fit *f)
{
    kmp_tabulate_columns(table, "t[s]");
    for (int c = 0; c < f->columns; c++) {
        const char *unit = kmp_print_unknown(f->context, f->column_unit[c]);
        kmp_tabulate_column(table, unit, "%s", f->column_name[c]);
        kmp_tabulate_column(table, unit, "%s.measured", f->column_name[c]);
        kmp_tabulate_look(table, KMP_LOOK_POINTS);
        kmp_tabulate_column(table, unit, "%s.residual", f->column_name[c]);
        kmp_tabulate_look(table, KMP_LOOK_RESIDUALS);
    }
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_fit *f = result;
    bool numbered = f->run_count > 1;
    if (numbered)
        kmp_tabulate_columns(table, "file");
    tabulate_heads(table, f);
    for (int k = 0; k < f->run_count; k++)
        tabulate_run(table, f, k, numbered);
}

static void fill_first(kempe_table *table, const void *result)
{
    tabulate_heads(table, result);
    tabulate_run(table, result, 0, false);
}

KMP_TABLES(kempe_fit, fit, fit->context, {"parameters", fill_parameters}, {"correlation", fill_correlation},
           {"columns", fill_columns}, {"rows", fill_rows}, {"first", fill_first})
