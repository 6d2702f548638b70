/* SPDX-License-Identifier: BSD-3-Clause */
/* The flow over an interval: runs of a trajectory with its derivatives at other values (sensitivity_trajectory.c), for
 * callers in loops. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/model_context.h"
#include "studies/simulate/trajectory.h"
#include <kempe/check.h>
#include <kempe/flow.h>
#include <math.h>
#include <string.h>

struct kempe_flow {
    kempe_context *context;
    kmp_slope_runs *runs;
    int count; /* times */
};

static kempe_status check_times(kempe_context *context, int count, const double *t)
{
    if (count < 1)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "t has %d times, but a flow needs one", count);
    for (int k = 0; k < count; k++)
        if (!isfinite(t[k]) || t[k] < 0 || (k > 0 && !(t[k] > t[k - 1])))
            return kmp_fail(context, KEMPE_E_ARGUMENT, "t[%d] is %g s, but times begin at 0 and ascend", k, t[k]);
    if (!(t[count - 1] > 0))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "t has no time after 0: a flow needs an interval");
    return KEMPE_OK;
}

kempe_status kempe_flow_new(const kempe_model *model, const kempe_flow_options *options, int count, const double *t,
                            kempe_flow **flow)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, flow, "flow");
    KMP_WANTED(context, t, "t");
    KMP_OPTIONS(context, kempe_flow_options, options);
    KMP_TRY(check_times(context, count, t));
    if (options->run && (options->run->t_end != 0 || options->run->output_step != 0))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "a flow has values at the times t and ends at the last one: give no %s",
                        options->run->t_end != 0 ? "t_end" : "output_step");
    const kempe_run_options none = {0}, *run = options->run;
    KMP_OPTIONS(context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(context, run, KMP_STUDY_FLOW));
    const kempe_sensitivity_options ask = {
        .parameters = options->variables, .outputs = options->outputs, .run = options->run ? options->run : &none};
    KMP_MAKE(context, kempe_flow, f);
    f->context = context;
    f->count = count;
    kempe_status status = kmp_slope_runs_new(model, &ask, count, t, false, &f->runs);
    return KMP_GIVE_OR_FREE(status, flow, f, kempe_flow_free);
}

KMP_FREES(kempe_flow, flow, kmp_slope_runs_free(flow->runs))

static const kempe_sensitivity *rows_of(const kempe_flow *flow)
{
    return kmp_slope_runs_rows(flow->runs);
}

KMP_GETTER(int kempe_flow_variable_count(const kempe_flow *flow), flow, rows_of(flow)->count, 0)
KMP_GETTER_AT(const char *kempe_flow_variable(const kempe_flow *flow, int k), flow, k, rows_of(flow)->count,
              rows_of(flow)->name[k], "")
KMP_GETTER_AT(double kempe_flow_variable_value(const kempe_flow *flow, int k), flow, k, rows_of(flow)->count,
              rows_of(flow)->parameter[k], NAN)
KMP_GETTER(int kempe_flow_count(const kempe_flow *flow), flow, rows_of(flow)->columns, 0)
KMP_GETTER_AT(const char *kempe_flow_name(const kempe_flow *flow, int k), flow, k, rows_of(flow)->columns,
              rows_of(flow)->column[k], "")

kempe_status kempe_flow_at(kempe_flow *flow, const double *variables, double *values, double *jacobian)
{
    KMP_WANTED(NULL, flow, "flow");
    KMP_WANTED(flow->context, variables, "variables");
    KMP_WANTED(flow->context, values, "values");
    const kempe_sensitivity *rows = rows_of(flow);
    for (int k = 0; k < rows->count; k++)
        if (!isfinite(variables[k]))
            return kmp_fail(flow->context, KEMPE_E_ARGUMENT, "the variable '%s' is not finite", rows->name[k]);
    KMP_TRY(kmp_slope_runs_at(flow->runs, variables));
    const int columns = rows->columns, slopes = columns * rows->count;
    for (int row = 0; row < flow->count; row++) {
        const double *cells = rows->cell + (size_t)row * kmp_sensitivity_width(rows);
        memcpy(values + (size_t)row * (size_t)columns, cells, (size_t)columns * sizeof *cells);
        if (jacobian)
            memcpy(jacobian + (size_t)row * (size_t)slopes, cells + columns, (size_t)slopes * sizeof *cells);
    }
    return KEMPE_OK;
}
