/* SPDX-License-Identifier: BSD-3-Clause */
/* The comparison as text: all runs, the table at equal error, failures, and the summary, which comes last so that a
 * terminal shows it. */
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const kmp_quantity kmp_compare_shown[KMP_COMPARE_SHOWN] = {KMP_QUANTITY_Q, KMP_QUANTITY_QD, KMP_QUANTITY_LAMBDA};

enum { LINE = 100, INDENT = 4, FEW_RUNS = 24 };

static const char *form_of(const kmp_method *method)
{
    return method->form ? method->form : "-";
}

/* A sentence, broken between words; lines after the first are indented. */
static void show_wrapped(kmp_text *text, const char *first, const char *sentence)
{
    int begin = (int)strlen(first), column = begin;
    kmp_text_put(text, first);
    while (*sentence) {
        int word = (int)strcspn(sentence, " \n");
        bool breaks = column > begin && column + 1 + word > LINE;
        if (breaks)
            kmp_text_printf(text, "\n%*s", INDENT, "");
        kmp_text_printf(text, "%s%.*s", column > begin && !breaks ? " " : "", word, sentence);
        column = breaks ? INDENT + word : column + word + (column > begin);
        begin = breaks ? INDENT : begin;
        sentence += word + (sentence[word] != '\0');
    }
    kmp_text_put(text, "\n");
}

static void show_list(kmp_text *text, const char *title, const kmp_sentences *list)
{
    if (list->count > 0)
        kmp_text_printf(text, "\n%s\n", title);
    for (int k = 0; k < list->count; k++)
        show_wrapped(text, "  - ", list->s[k]);
}

/* -- the reference ----------------------------------------------------------------------------------- */

static void show_uncertainty(kmp_text *text, const kempe_comparison *c)
{
    const double *u = c->uncertainty;
    if (!(u[KMP_QUANTITY_Q] > 0))
        return;
    kmp_text_printf(text, "its error is about %.0e in q, %.0e in qd", u[KMP_QUANTITY_Q], u[KMP_QUANTITY_QD]);
    if (u[KMP_QUANTITY_LAMBDA] > 0)
        kmp_text_printf(text, ", %.0e in lambda", u[KMP_QUANTITY_LAMBDA]);
    kmp_text_put(text, ": errors below ten times that are blank\n");
}

/* -- runs -------------------------------------------------------------------------------------------- */

/* The first line of a reason, as far as the table is wide. */
static void show_reason(kmp_text *text, const kmp_compared *run, int room)
{
    int length = (int)strcspn(run->reason, "\n");
    kmp_text_put(text, " | ");
    if (!run->left_out)
        room -= (int)strlen(kmp_status_word(run->status)) + 2;
    if (!run->left_out)
        kmp_text_printf(text, "%s: ", kmp_status_word(run->status));
    kmp_text_printf(text, "%.*s%s\n", length > room ? room - 3 : length, run->reason, length > room ? "..." : "");
}

static void show_run(kmp_text *text, const kempe_comparison *c, const kmp_compared *run, int width)
{
    kmp_text name = {0};
    kmp_compare_name(&name, run->method);
    kmp_text_printf(text, "%-*s %5.0e", width, name.s ? name.s : "", run->rtol);
    kmp_text_free_part(text, &name);
    if (run->status != KEMPE_OK) {
        show_reason(text, run, LINE - width - 9);
        return;
    }
    kmp_text_put(text, " |");
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        if (kmp_compared_is_below(c, run, kmp_compare_shown[k]))
            kmp_text_printf(text, " %7s", "");
        else
            kmp_print_cell(text, 8, 1, run->verdict.error[kmp_compare_shown[k]]);
    kmp_text_put(text, " |");
    kmp_print_cell(text, 6, 0, run->verdict.h_max);
    kmp_print_cell(text, 8, 1, run->verdict.drift_rel);
    kmp_text_printf(text, " | %6ld %7ld", run->report.steps, run->report.rhs);
    kmp_compare_put_number(text, 6, 1e3 * run->cpu_s);
    kmp_text_put(text, "\n");
}

/* Few runs are listed; of many the tables tell. */
static void show_runs(kmp_text *text, const kempe_comparison *c)
{
    int width = kmp_compare_name_width(c);
    if (c->count > FEW_RUNS) {
        kmp_text_printf(text, "\n%d runs, %d methods at %d tolerances: --csv, --json and --report list them\n",
                        c->count, c->method_count, c->rtol_count);
        return;
    }
    if (c->count > 0)
        kmp_text_printf(text, "\n%-*s %5s | %7s %7s %7s | %5s %7s | %6s %7s %6s\n", width, "run", "rtol", "error q",
                        "qd", "lambda", "|h|", "energy", "steps", "evals", "cpu ms");
    for (int k = 0; k < c->count; k++)
        if (k % c->rtol_count == 0 || !c->runs[k].left_out || strcmp(c->runs[k].reason, c->runs[k - 1].reason) != 0)
            show_run(text, c, &c->runs[k], width);
}

/* -- at equal error ---------------------------------------------------------------------------------- */

static void show_ratios(kmp_text *text, const kempe_comparison *c, int method)
{
    const kmp_method *w = &c->methods[method];
    char integrator[32];
    (void)snprintf(integrator, sizeof integrator, "%s%s%s", w->integrator, w->linear ? "/" : "",
                   w->linear ? w->linear : "");
    kmp_text_printf(text, "%-9s %-11s %-*s", w->formulation, form_of(w), kmp_compare_name_width(c) - 22, integrator);
    for (int l = 0; l < c->levels.count; l++) {
        double ratio = c->levels.blank[l] || c->levels.best[l] < 0 ? INFINITY : kmp_compare_ratio(c, method, l);
        if (c->levels.blank[l])
            kmp_text_printf(text, " %7s", "");
        else if (isinf(ratio))
            kmp_text_printf(text, " %7s", "-");
        else
            kmp_text_printf(text, ratio < 9.95 ? " %7.2f" : " %7.0f", ratio);
    }
    kmp_compare_end_line(text);
}

static void show_levels(kmp_text *text, const kempe_comparison *c)
{
    bool blank = false;
    if (c->levels.count == 0)
        return;
    kmp_text_put(text, "\nCPU time for a given error of q, relative to the fastest\n");
    kmp_text_printf(text, "%-*s", kmp_compare_name_width(c), "error q at most");
    for (int l = 0; l < c->levels.count; l++) {
        kmp_text_printf(text, " %7.0e", c->levels.level[l]);
        blank = blank || c->levels.blank[l];
    }
    kmp_text_put(text, "\n");
    kmp_text_printf(text, "%-*s", kmp_compare_name_width(c), "the fastest, ms");
    for (int l = 0; l < c->levels.count; l++) {
        int best = c->levels.best[l];
        if (c->levels.blank[l])
            kmp_text_printf(text, " %7s", "");
        else if (best < 0)
            kmp_text_printf(text, " %7s", "-");
        else
            kmp_text_printf(text, " %7.3g",
                            1e3 * kmp_compare_cost(c, (int)(c->runs[best].method - c->methods), l).cpu_s);
    }
    kmp_compare_end_line(text);
    for (int w = 0; w < c->method_count; w++)
        show_ratios(text, c, w);
    kmp_text_printf(text, "-: not attained%s\n", blank ? "; blank: below the accuracy of the reference" : "");
}

/* -- summary ----------------------------------------------------------------------------------------- */

static void show(kmp_text *text, const void *result)
{
    const kempe_comparison *c = result;
    kmp_print_title(text, c->system->model, kmp_status_word(c->status));
    kmp_text_printf(text, "0 to %g s\n", c->t_end);
    show_wrapped(text, "reference: ", c->source);
    if (c->has_reference)
        show_uncertainty(text, c);
    if (c->has_reference) {
        /* The sizes that errors are relative to. */
        const kmp_scales *s = &c->scales;
        kmp_text sentence = {0};
        kmp_text_printf(&sentence,
                        "the largest at %d instants, relative to the value or to 1 rad, %.3g m; %.3g rad/s, %.3g m/s",
                        c->instants, s->length, s->rate, s->rate * s->length);
        if (c->system->m > 0)
            kmp_text_printf(&sentence, "; of lambda to the largest load, %.3g", s->load);
        show_wrapped(text, "errors: ", sentence.s ? sentence.s : "");
        kmp_text_free_part(text, &sentence);
    }
    show_runs(text, c);
    kmp_compare_print_tables(text, c);
    show_levels(text, c);
    show_list(text, "not run", &c->failures);
    show_list(text, "warnings", &c->warnings);
    if (kmp_is_complete(c->status) || c->advice.run >= 0) {
        kmp_text_put(text, "\n");
        if (c->advice.run < 0) {
            kmp_text_put(text, "no recommendation\n");
        } else {
            const kmp_compared *run = &c->runs[c->advice.run];
            kmp_text_put(text, "use ");
            kmp_compare_name(text, run->method);
            kmp_text_printf(text, " at rtol %g for this model: error q at most %g in %.3g ms\n", run->rtol,
                            c->advice.level, 1e3 * run->cpu_s);
        }
        for (int k = 0; k < c->advice.because.count; k++)
            show_wrapped(text, "  - ", c->advice.because.s[k]);
    }
    if (!kmp_is_complete(c->status))
        kmp_text_printf(text, "reason: %s\n", c->reason);
}

KMP_PRINT(kempe_comparison, comparison, comparison->system->context, kmp_compare_json, show)
