/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/limit_cycles/flow.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

/* -- construction ------------------------------------------------------------------------------------ */

const char *const kmp_flow_kinds[] = {"q", "qd", "state"};

const char *kmp_flow_name(const kempe_model *model, const kmp_flow_entry *entry)
{
    return entry->kind == KMP_FLOW_STATE ? kmp_state_of(model, entry->motion)->name
                                         : model->motions[entry->motion].name;
}

static bool make_room(kmp_flow *f)
{
    int n = f->size;
    return KMP_ARENA_MAKE(
        &f->arena, KMP_ROOM(kmp_flow_entry, n, &f->entry), KMP_ROOM(double, n + 1, &f->values, &f->sizes),
        KMP_ROOM(double, n, &f->begin, &f->end, &f->begin_rate, &f->end_rate),
        KMP_ROOM(double, n *(n + 1), &f->slope, &f->monodromy), KMP_ROOM(double, KMP_FLOW_PIECES + 1, &f->times),
        KMP_ROOM(double, n *(KMP_FLOW_PIECES + 1), &f->history));
}

static double value_of(const kmp_flow_entry *e, const double *q, const double *qd)
{
    return (e->kind == KMP_FLOW_POSITION ? q : qd)[e->motion];
}

/* The state of a row, and at both ends also its rates and derivatives. */
static int take_row(void *user, const kmp_varied_row *row)
{
    kmp_flow *f = user;
    const int n = f->size, systems = f->rows->system->n, at = f->row++;
    if (at > f->pieces)
        return 0;
    bool first = at == 0, last = at == f->pieces;
    for (int i = 0; i < n; i++) {
        const kmp_flow_entry *e = &f->entry[i];
        double x = value_of(e, row->q, row->qd), rate = value_of(e, row->qd, row->qdd);
        f->history[i + (ptrdiff_t)at * n] = x;
        if (first)
            f->begin[i] = x, f->begin_rate[i] = rate;
        if (last)
            f->end[i] = x, f->end_rate[i] = rate;
        for (int k = 0; (first || last) && k <= n; k++) {
            double slope = value_of(e, row->dq + (ptrdiff_t)k * systems, row->dqd + (ptrdiff_t)k * systems);
            double *sum = &f->slope[i + (ptrdiff_t)k * n];
            *sum = first ? -slope : *sum + slope;
            if (last && k < n)
                f->monodromy[i + (ptrdiff_t)k * n] = slope;
        }
    }
    return 0;
}

static kempe_status make_runs(kmp_flow *f, const char *name, const char *outputs, const kempe_run_options *run)
{
    kmp_text names = {0};
    for (int i = 0; i < f->size; i++)
        kmp_text_printf(&names, "%s.%s,", kmp_flow_kinds[f->entry[i].kind],
                        kmp_flow_name(f->system->model, &f->entry[i]));
    kmp_text_put(&names, name);
    for (int k = 0; k <= KMP_FLOW_PIECES; k++)
        f->times[k] = (double)k / KMP_FLOW_PIECES;
    kempe_run_options own = *run;
    own.rtol = f->rtol;
    const kempe_sensitivity_options ask = {.parameters = names.s, .outputs = outputs, .run = &own};
    kempe_status status =
        names.failed ? kmp_fail_memory(f->context)
                     : kmp_slope_runs_new(f->system->model, &ask, KMP_FLOW_PIECES + 1, f->times, false, &f->runs);
    kmp_text_free(&names);
    return status;
}

kempe_status kmp_flow_new(const kempe_system *system, const char *name, const char *outputs,
                          const kempe_run_options *run, int size, const kmp_flow_entry *entry, kmp_flow **flow)
{
    KMP_MAKE(system->context, kmp_flow, f);
    *f = (kmp_flow){.context = system->context, .system = system, .size = size, .pieces = 1};
    f->rtol = run->rtol > 0 ? run->rtol : KMP_CYCLE_RTOL;
    kempe_status status = kmp_made(system->context, make_room(f));
    if (status == KEMPE_OK) {
        memcpy(f->entry, entry, (size_t)size * sizeof *entry);
        status = make_runs(f, name, outputs, run);
    }
    if (status == KEMPE_OK) {
        f->rows = kmp_slope_runs_rows(f->runs);
        kmp_slope_runs_watch(f->runs, take_row, f);
        kmp_slope_runs_keep_length(f->runs, system->length);
    }
    return KMP_GIVE_OR_FREE(status, flow, f, kmp_flow_free);
}

void kmp_flow_free(kmp_flow *flow)
{
    if (!flow)
        return;
    kmp_slope_runs_free(flow->runs);
    kmp_arena_free(&flow->arena);
    kmp_free(flow);
}

/* -- a run -------------------------------------------------------------------------------------------- */

double kmp_flow_largest(const kmp_flow *flow, const double *sizes, kmp_flow_kind kind)
{
    double most = 0;
    for (int i = 0; i < flow->size; i++)
        if (flow->entry[i].kind == kind)
            most = fmax(most, sizes[i] / flow->system->scale[flow->entry[i].motion]);
    return most;
}

void kmp_flow_weigh(kmp_flow *flow, const double *sizes, double parameter)
{
    kmp_flow *f = flow;
    double largest = fmax(kmp_flow_largest(f, sizes, KMP_FLOW_POSITION), kmp_flow_largest(f, sizes, KMP_FLOW_STATE));
    memcpy(f->sizes, sizes, (size_t)f->size * sizeof *sizes);
    f->sizes[f->size] = parameter;
    kmp_slope_runs_weigh(f->runs, f->rtol * (largest > 0 ? largest : 1), f->sizes);
}

kempe_status kmp_flow_run(kmp_flow *flow, const double *x, double time, double value, int pieces)
{
    kmp_flow *f = flow;
    memcpy(f->values, x, (size_t)f->size * sizeof *x);
    f->values[f->size] = value;
    for (int k = 0; k <= pieces; k++)
        f->times[k] = k == pieces ? time : time * k / pieces;
    f->row = 0;
    f->pieces = pieces;
    kmp_slope_runs_set_times(f->runs, pieces + 1, f->times);
    return kmp_slope_runs_at(f->runs, f->values);
}

/* -- extremes ------------------------------------------------------------------------------------------ */

static double extreme_at(int count, const double *values, ptrdiff_t stride, int at)
{
    double y[5];
    for (int k = 0; k < 5; k++)
        y[k] = values[stride * ((at + k - 2 + count) % count)];
    /* The extreme value near the middle of five values at distances of 1, by Newton's method on the derivative of their
     * polynomial; the middle one where that leads away. */
    double d1 = (y[0] - 8 * y[1] + 8 * y[3] - y[4]) / 12, d2 = (-y[0] + 16 * y[1] - 30 * y[2] + 16 * y[3] - y[4]) / 12;
    double d3 = (-y[0] + 2 * y[1] - 2 * y[3] + y[4]) / 2, d4 = y[0] - 4 * y[1] + 6 * y[2] - 4 * y[3] + y[4];
    double s = 0;
    for (int k = 0; k < 6; k++) {
        double bend = d2 + s * (d3 + s * d4 / 2);
        if (bend == 0)
            break;
        s -= (d1 + s * (d2 + s * (d3 / 2 + s * d4 / 6))) / bend;
    }
    return fabs(s) <= 1 ? y[2] + s * (d1 + s * (d2 / 2 + s * (d3 / 6 + s * d4 / 24))) : y[2];
}

void kmp_flow_extremes(int count, const double *values, ptrdiff_t stride, double *high, double *low)
{
    int most = 0, least = 0;
    for (int k = 1; k < count; k++) {
        most = values[stride * k] > values[stride * most] ? k : most;
        least = values[stride * k] < values[stride * least] ? k : least;
    }
    *high = fmax(extreme_at(count, values, stride, most), values[stride * most]);
    *low = fmin(extreme_at(count, values, stride, least), values[stride * least]);
}
