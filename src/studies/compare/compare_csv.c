/* SPDX-License-Identifier: BSD-3-Clause */
/* The runs of a comparison as a table for other programs: one row each, empty where values are unknown. */
#include "base/file.h"
#include "studies/compare/compare_print.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

static void write_cell(kmp_text *text, double x)
{
    kmp_text_put(text, ",");
    if (isfinite(x))
        kmp_text_number(text, x);
}

/* Words that may contain commas: in quotes, on one line. */
static void write_quoted(kmp_text *text, const char *words)
{
    if (!*words)
        return;
    kmp_text_put(text, "\"");
    for (const char *s = words; *s; s++)
        kmp_text_printf(text, "%s%c", *s == '"' ? "\"" : "", *s == '\n' ? ' ' : *s);
    kmp_text_put(text, "\"");
}

static void write_run(kmp_text *text, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_text_printf(text, "%s,%s,%s", run->way->formulation, run->way->form ? run->way->form : "",
                    run->way->integrator);
    write_cell(text, run->rtol);
    kmp_text_printf(text, ",%s,", kmp_status_word(run->status));
    write_quoted(text, run->reason);
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        write_cell(
            text, kmp_compared_is_below(c, run, kmp_compare_shown[k]) ? NAN : run->verdict.error[kmp_compare_shown[k]]);
    write_cell(text, run->verdict.h_max);
    write_cell(text, run->verdict.hdot_max);
    write_cell(text, run->verdict.drift_rel);
    const kmp_run_report *r = &run->report;
    kmp_text_printf(text, ",%ld,%ld,%ld,%ld,%ld,%ld,%ld,%ld", r->steps, r->rejected, r->refused, r->rhs, r->newton,
                    r->jacobians, r->factorizations, r->exchanges);
    write_cell(text, run->cpu_s);
    write_cell(text, run->apart);
    kmp_text_put(text, "\n");
}

kempe_status kempe_comparison_write_csv(const kempe_comparison *comparison, const char *path)
{
    KMP_WANTED(NULL, comparison, "comparison");
    KMP_WANTED(comparison->system->context, path, "path");
    kempe_context *context = comparison->system->context;
    kmp_text text = {0};
    kmp_text_put(
        &text,
        "formulation,form,integrator,rtol,status,reason,error_q,error_qd,error_lambda,h_max,hdot_max,drift_rel,steps,"
        "rejected,refused,rhs,newton,jacobians,factorizations,exchanges,cpu_s,difference\n");
    for (int k = 0; k < comparison->count; k++)
        write_run(&text, comparison, &comparison->runs[k]);
    kmp_context_clear(context);
    return kmp_file_write(context, path, &text);
}
