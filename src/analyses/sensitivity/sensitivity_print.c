/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/sensitivity/sensitivity_study.h"
#include "output/print.h"
#include "output/result_table.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

enum { A_LINE = 5 }; /* parameters */

/* -- text -------------------------------------------------------------------------------------------- */

/* The factor of a column and its derivatives from SI to the shown unit; that unit, of the time integral too. */
static double factor_of(const kempe_sensitivity *s, int column)
{
    return kmp_shown_as(s->context, s->unit[column]).factor;
}

static void put_unit(kmp_text *text, const kempe_sensitivity *s, int column)
{
    const char *unit = kmp_shown_as(s->context, s->unit[column]).unit;
    kmp_text_printf(text, "%s%s", unit, s->integral && *unit ? " s" : "");
}

/* The last row by some of the parameters. */
static void put_block(const kempe_sensitivity *s, kmp_text *text, int first, int name_width)
{
    int end = first + A_LINE < s->count ? first + A_LINE : s->count, row = s->rows - 1;
    kmp_text_printf(text, "\n  %-*s  %15s", name_width, "", "value");
    for (int k = first; k < end; k++)
        kmp_text_printf(text, "  d/d %-*s", kmp_print_widest(1, &s->name[k], 11), s->name[k]);
    kmp_text_put(text, "\n");
    for (int c = 0; c < s->columns; c++) {
        kmp_text_printf(text, "  %-*s", name_width, s->column[c]);
        kmp_print_cells(text, "  %15.8g", factor_of(s, c) * kmp_sensitivity_value(s, row, c));
        for (int k = first; k < end; k++)
            kmp_print_cells(text, "  %*.8g", kmp_print_widest(1, &s->name[k], 11) + 4,
                            factor_of(s, c) * kmp_sensitivity_slope(s, row, c, k));
        kmp_text_put(text, "  ");
        put_unit(text, s, c);
        kmp_text_put(text, "\n");
    }
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_sensitivity *s = result;
    int name_width = kmp_print_widest(s->columns, s->column, 8);
    kmp_print_title(text, s->model, kmp_checked_word(s->status, !s->unchecked));
    kmp_text_printf(text, "%s with respect to %d parameter%s\n\n", s->kind->name, s->count, s->count == 1 ? "" : "s");
    if (s->reason[0])
        kmp_text_printf(text, "reason    %s\n", s->reason);
    if (s->t_end > 0) {
        kmp_text_printf(text, "run       %s, %s to t = %g s, rtol %g, atol %g\n", s->method, s->integrator, s->t_end,
                        s->rtol, s->atol);
        kmp_convergence_show(text, s->context, &s->again, "a number", s->again_name, NULL);
        kmp_text_printf(text, "work      steps %ld, rejected %ld, failed %ld, right-hand sides %ld, exchanges %ld\n",
                        s->work.steps, s->work.rejected, s->work.refused, s->work.rhs, s->work.exchanges);
        if (s->backwards > 0)
            kmp_text_printf(text, "adjoint   steps %.0f, %.3g MB of the motion stored\n", s->backwards, s->kept * 1e-6);
    }
    kmp_text_printf(text, "cpu       %.3f s, and %.3f s to derive the equations\n", s->cpu_s, s->build_s);
    if (s->rows > 0 && s->kind->row)
        kmp_text_printf(text, "rows      %d, the last one at %s = %.9g:\n", s->rows, s->kind->row, s->at[s->rows - 1]);
    for (int first = 0; s->rows > 0 && first < s->count; first += A_LINE)
        put_block(s, text, first, name_width);
    if (s->note)
        kmp_text_printf(text, "\nnote      %s\n", s->note);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void put_json(kmp_text *text, const void *result)
{
    const kempe_sensitivity *s = result;
    kmp_json json = kmp_json_begin(text);
    kmp_print_head(&json, s->system, kmp_checked_word(s->status, !s->unchecked), s->reason, s->build_s, s->warnings);
    kmp_json_string(&json, "of", s->kind->name);
    if (s->t_end > 0) {
        kmp_json_put(&json, "method %s integrator %s t_end %g rtol %g atol %g", s->method, s->integrator, s->t_end,
                     s->rtol, s->atol);
        kmp_convergence_json(&json, &s->again, s->again_name);
        kmp_json_put(
            &json, "work { steps %ld rejected %ld refused %ld rhs %ld exchanges %ld backwards %g kept_bytes %g }",
            s->work.steps, s->work.rejected, s->work.refused, s->work.rhs, s->work.exchanges, s->backwards, s->kept);
    }
    kmp_json_put(&json, "cpu_s %g parameters {", s->cpu_s);
    for (int k = 0; k < s->count; k++)
        kmp_json_number(&json, s->name[k], s->parameter[k]);
    kmp_json_end(&json);
    if (s->note)
        kmp_json_string(&json, "note", s->note);
    kmp_json_whole(&json, "rows", s->rows);
    if (s->rows > 0) {
        int row = s->rows - 1;
        kmp_json_object(&json, "end");
        if (s->kind->row)
            kmp_json_number(&json, s->kind->row, s->at[row]);
        kmp_json_object(&json, "values");
        for (int c = 0; c < s->columns; c++)
            kmp_json_number(&json, s->column[c], kmp_sensitivity_value(s, row, c));
        kmp_json_put(&json, "} derivatives {");
        for (int c = 0; c < s->columns; c++) {
            kmp_json_object(&json, s->column[c]);
            for (int k = 0; k < s->count; k++)
                kmp_json_number(&json, s->name[k], kmp_sensitivity_slope(s, row, c, k));
            kmp_json_end(&json);
        }
        kmp_json_put(&json, "} }");
    }
    kmp_json_end(&json);
}

KMP_PRINT(kempe_sensitivity, sensitivity, sensitivity->context, put_json, put_text)

/* -- tables ------------------------------------------------------------------------------------------ */

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_sensitivity *s = result;
    bool times = s->kind->row && strcmp(s->kind->row, "t") == 0;
    kmp_tabulate_column(table, times ? "s" : "", "%s", s->kind->row ? s->kind->row : "row");
    for (int c = 0; c < s->columns; c++) {
        /* A column and its derivatives: [NAME] is the SI unit of a parameter. */
        kmp_text unit = {0};
        kmp_text_put(&unit, "");
        put_unit(&unit, s, c);
        kmp_tabulate_column(table, unit.s ? unit.s : "", "%s", s->column[c]);
        for (int k = 0; k < s->count; k++) {
            kmp_text by = {0};
            kmp_text_printf(&by, "%s/[%s]", unit.s && *unit.s ? unit.s : "1", s->name[k]);
            kmp_tabulate_column(table, by.s ? by.s : "", "%s/%s", s->column[c], s->name[k]);
            kmp_text_free(&by);
        }
        kmp_text_free(&unit);
    }
    for (int row = 0; row < s->rows; row++) {
        KMP_TABULATE(table, "%g", s->at[row]);
        for (int c = 0; c < s->columns; c++) {
            kmp_tabulate_number(table, factor_of(s, c) * kmp_sensitivity_value(s, row, c));
            for (int k = 0; k < s->count; k++)
                kmp_tabulate_number(table, factor_of(s, c) * kmp_sensitivity_slope(s, row, c, k));
        }
    }
}

static void fill_parameters(kempe_table *table, const void *result)
{
    const kempe_sensitivity *s = result;
    kmp_tabulate_columns(table, "parameter[words] value");
    for (int k = 0; k < s->count; k++)
        KMP_TABULATE(table, "%s %g", s->name[k], s->parameter[k]);
}

KMP_TABLES(kempe_sensitivity, sensitivity, sensitivity->context, {"rows", fill_rows}, {"parameters", fill_parameters})
