/* SPDX-License-Identifier: BSD-3-Clause */
/* A comparison as tables for other programs. */
#include "output/result_table.h"
#include "studies/compare/compare_study.h"
#include <math.h>

static void put_method(kempe_table *table, const kmp_method *method)
{
    kmp_tabulate_word(table, method->formulation);
    kmp_tabulate_word(table, method->form ? method->form : "");
    kmp_tabulate_word(table, method->integrator);
    kmp_tabulate_word(table, method->linear ? method->linear : "");
}

static void put_run(kempe_table *table, const kempe_comparison *c, const kmp_compared *run)
{
    const kmp_run_report *r = &run->report;
    const double numbers[] = {run->verdict.h_max,
                              run->verdict.hdot_max,
                              run->verdict.drift_rel,
                              (double)r->steps,
                              (double)r->rejected,
                              (double)r->refused,
                              (double)r->rhs,
                              (double)r->newton,
                              (double)r->jacobians,
                              (double)r->factorizations,
                              (double)r->exchanges,
                              run->cpu_s,
                              run->build_s,
                              kmp_compare_first_s(c, run),
                              run->report.heap > 0 ? (double)run->report.heap : NAN,
                              run->apart};
    kmp_tabulate_row(table);
    put_method(table, run->method);
    kmp_tabulate_number(table, run->rtol);
    kmp_tabulate_word(table, kmp_status_word(run->status));
    kmp_tabulate_word(table, run->reason);
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        kmp_tabulate_number(table, kmp_compare_error(c, run, kmp_compare_shown[k]));
    kmp_tabulate_numbers(table, sizeof numbers / sizeof *numbers, numbers);
}

static void fill_runs(kempe_table *table, const void *result)
{
    const kempe_comparison *c = result;
    kmp_tabulate_columns(table, NULL, "formulation form integrator linear");
    kmp_tabulate_columns(table, "", "rtol");
    kmp_tabulate_look(table, KMP_LOOK_LOGARITHMIC);
    kmp_tabulate_apart(table);
    kmp_tabulate_columns(table, NULL, "status reason");
    kmp_tabulate_columns(table, "",
                         "error_q error_qd error_lambda h_max hdot_max drift_rel steps rejected refused rhs newton "
                         "jacobians factorizations exchanges cpu_s build_s first_s memory_bytes difference");
    for (int k = 0; k < c->count; k++)
        put_run(table, c, &c->runs[k]);
}

static void fill_levels(kempe_table *table, const void *result)
{
    const kempe_comparison *c = result;
    const kmp_levels *levels = &c->levels;
    kmp_tabulate_columns(table, NULL, "formulation form integrator linear");
    kmp_tabulate_columns(table, "", "error rtol cpu_s ratio steps rhs");
    for (int l = 0; l < levels->count; l++)
        for (int w = 0; w < c->method_count && !levels->blank[l]; w++) {
            int run = levels->run[w * levels->count + l];
            kmp_method_cost cost = kmp_compare_cost(c, w, l);
            kmp_tabulate_row(table);
            put_method(table, &c->methods[w]);
            kmp_tabulate_number(table, levels->level[l]);
            if (run < 0)
                continue;
            kmp_tabulate_number(table, c->runs[run].rtol);
            kmp_tabulate_number(table, cost.cpu_s);
            kmp_tabulate_number(table, kmp_compare_ratio(c, w, l));
            kmp_tabulate_number(table, cost.steps);
            kmp_tabulate_number(table, cost.rhs);
        }
}

kempe_status kempe_comparison_table(const kempe_comparison *comparison, const char *name, kempe_table **table)
{
    static const kmp_table_kind kinds[] = {{"runs", fill_runs}, {"levels", fill_levels}, {0}};
    KMP_WANTED(NULL, comparison, "comparison");
    return kmp_tabulate_result(comparison->system->context, kinds, comparison, name, table);
}
