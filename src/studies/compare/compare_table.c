/* SPDX-License-Identifier: BSD-3-Clause */
/* A comparison as tables for other programs. */
#include "output/result_table.h"
#include "studies/compare/compare_study.h"
#include <math.h>

static void put_method(kempe_table *table, const kmp_method *method)
{
    kmp_tabulate_cells(table, "%s %s %s %s", method->formulation, method->form ? method->form : "", method->integrator,
                       method->linear ? method->linear : "");
}

static void put_run(kempe_table *table, const kempe_comparison *c, const kmp_compared *run)
{
    const kmp_run_report *r = &run->report;
    kmp_tabulate_row(table);
    put_method(table, run->method);
    kmp_tabulate_cells(table, "%g %s %s", run->rtol, kmp_status_word(run->status), run->reason);
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        kmp_tabulate_number(table, kmp_compare_error(c, run, kmp_compare_shown[k]));
    kmp_tabulate_cells(table, "%g %g %g %ld %ld %ld %ld", run->verdict.h_max, run->verdict.hdot_max,
                       run->verdict.drift_rel, r->steps, r->rejected, r->refused, r->rhs);
    kmp_tabulate_cells(table, "%ld %ld %ld %ld %g %g %g %g %g", r->newton, r->jacobians, r->factorizations,
                       r->exchanges, run->cpu_s, run->build_s, kmp_compare_first_s(c, run),
                       r->heap > 0 ? (double)r->heap : NAN, run->apart);
}

static void fill_runs(kempe_table *table, const void *result)
{
    const kempe_comparison *c = result;
    kmp_tabulate_columns(table, "formulation[words] form[words] integrator[words] linear[words] rtol");
    kmp_tabulate_look(table, KMP_LOOK_LOGARITHMIC);
    kmp_tabulate_apart(table);
    kmp_tabulate_columns(table, "status[words] reason[words] error_q error_qd error_lambda h_max hdot_max drift_rel "
                                "steps rejected refused rhs newton jacobians factorizations exchanges cpu_s build_s "
                                "first_s memory_bytes difference");
    for (int k = 0; k < c->count; k++)
        put_run(table, c, &c->runs[k]);
}

static void fill_levels(kempe_table *table, const void *result)
{
    const kempe_comparison *c = result;
    const kmp_levels *levels = &c->levels;
    kmp_tabulate_columns(table, "formulation[words] form[words] integrator[words] linear[words] error rtol cpu_s ratio "
                                "steps rhs");
    for (int l = 0; l < levels->count; l++)
        for (int w = 0; w < c->method_count && !levels->blank[l]; w++) {
            int run = levels->run[w * levels->count + l];
            kmp_method_cost cost = kmp_compare_cost(c, w, l);
            kmp_tabulate_row(table);
            put_method(table, &c->methods[w]);
            kmp_tabulate_number(table, levels->level[l]);
            if (run >= 0)
                kmp_tabulate_cells(table, "%g %g %g %g %g", c->runs[run].rtol, cost.cpu_s, kmp_compare_ratio(c, w, l),
                                   cost.steps, cost.rhs);
        }
}

KMP_TABLES(kempe_comparison, comparison, comparison->system->context, {"runs", fill_runs}, {"levels", fill_levels})
