/* SPDX-License-Identifier: BSD-3-Clause */
/* Of trajectories: rows over time by forward sensitivities; the end, or integrals up to it, by either method. */
#include "analysis/adjoint.h"
#include "base/clock.h"
#include "base/memory.h"
#include "integrators/solver.h"
#include "model/output_table.h"
#include "results/sensitivity.h"
#include "results/times.h"
#include "results/trajectory.h"
#include <string.h>

/* An adjoint run of one scalar takes about as long as forward ones with so many parameters (docs/sensitivity.md). */
enum { WORTH_ADJOINT = 4 };

typedef struct work {
    kempe_sensitivity *s;
    kmp_columns columns;
    int *chosen; /* columns of these that were asked for */
    kmp_slopes *slopes;
    kmp_varied varied;
    kmp_run_spec spec;
    int *u;
    kmp_times times;
    kmp_forward ask;
    double *w[KMP_QUANTITIES + 1], *gradient; /* weights of one column */
} work;

/* -- what is asked ----------------------------------------------------------------------------------- */

static bool carries(const kmp_solver_kind *kind)
{
    return kind->corrects && !kind->dae;
}

/* Of integrators with others of the same kind in their place where the model asks for those. */
static kempe_status choose_integrator(work *w, kempe_run *run)
{
    const kempe_sensitivity *s = w->s;
    const char *wished = s->model->run.integrator;
    const kmp_solver_kind *kind = wished ? kmp_solver_find(wished) : NULL;
    if (kind && !carries(kind))
        wished = kind->implicit || kind->dae ? "radau9" : NULL;
    run->integrator = s->ask->run.integrator ? s->ask->run.integrator : wished ? wished : "dop853";
    kind = kmp_solver_find(run->integrator);
    if (kind && carries(kind))
        return KEMPE_OK;
    kmp_text names = {0};
    for (int k = 0; kmp_solver_get(k); k++)
        if (carries(kmp_solver_get(k)))
            kmp_text_printf(&names, "%s%s", names.length ? ", " : "", kmp_solver_get(k)->name);
    kempe_status status =
        kmp_fail(s->context, KEMPE_E_ARGUMENT, "integrator '%s' carries no sensitivities; there are: %s",
                 run->integrator, names.s ? names.s : "");
    kmp_text_free(&names);
    return status;
}

static kempe_status choose_run(work *w)
{
    kempe_run run = w->s->ask->run;
    double every;
    run.road = "reduced";
    run.form = "closed";
    kempe_status status = choose_integrator(w, &run);
    if (status == KEMPE_OK)
        status = kmp_spec_of(w->s->system, &run, &w->spec, &w->u);
    if (status == KEMPE_OK)
        status = kmp_times_spacing(w->s->system, run.every, w->spec.t_end, &every);
    if (status == KEMPE_OK && !kmp_times_init(&w->times, every, w->spec.t_end, NULL))
        status = kmp_fail_memory(w->s->context);
    return status;
}

static bool is_asked(const kempe_sensitivity *s, const kmp_column *of)
{
    return of->output >= 0 && (!s->parts || s->parts[of->output] >> of->component & 1u);
}

static kempe_status choose_columns(work *w)
{
    kempe_sensitivity *s = w->s;
    if (!kmp_columns_init(&w->columns, s->system))
        return kmp_fail_memory(s->context);
    w->chosen = KMP_NEW(int, w->columns.count);
    for (int k = 0; w->chosen && k < w->columns.count; k++) {
        if (!is_asked(s, &w->columns.of[k]))
            continue;
        w->chosen[s->columns] = k;
        if (!kmp_sensitivity_add_column(s, w->columns.name[k], w->columns.unit[k]))
            return kmp_fail_memory(s->context);
    }
    return w->chosen ? KEMPE_OK : kmp_fail_memory(s->context);
}

static bool has_shown(const work *w)
{
    bool has = false;
    for (int c = 0; c < w->s->columns; c++)
        has = has || w->columns.of[w->chosen[c]].quantity == KMP_QUANTITIES;
    return has;
}

static kempe_status prepare(work *w)
{
    kempe_sensitivity *s = w->s;
    kempe_status status = choose_run(w);
    if (status == KEMPE_OK)
        status = choose_columns(w);
    if (status == KEMPE_OK)
        status = kmp_slopes_new(s->system, w->spec.backend, s->count, (const char *const *)s->name, has_shown(w),
                                &w->slopes);
    if (status == KEMPE_OK)
        status = kmp_varied_init(&w->varied, s->system, w->spec.backend, w->slopes);
    if (status != KEMPE_OK)
        return status;
    s->integrator = kmp_solver_find(w->spec.integrator)->name;
    s->rtol = w->spec.rtol;
    s->atol = w->spec.atol;
    s->t_end = w->spec.t_end;
    w->ask = (kmp_forward){.spec = &w->spec};
    const int size[KMP_QUANTITIES + 1] = {s->system->n, s->system->n, s->system->n, s->system->m, w->slopes->shown};
    w->gradient = KMP_NEW(double, s->count);
    for (int k = 0; k <= KMP_QUANTITIES; k++)
        if (!(w->w[k] = KMP_NEW(double, size[k])))
            return kmp_fail_memory(s->context);
    return w->gradient ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* -- rows over time ---------------------------------------------------------------------------------- */

static int take_row(void *user, const kmp_varied_row *row)
{
    work *w = user;
    kempe_sensitivity *s = w->s;
    double *value, *slope;
    if (!kmp_sensitivity_add_row(s, row->t, &value, &slope))
        return 1;
    const double *values[] = {row->q, row->qd, row->qdd, row->lambda, row->shown};
    const double *slopes[] = {row->dq, row->dqd, row->dqdd, row->dlambda, row->dshown};
    const int size[] = {w->varied.n, w->varied.n, w->varied.n, w->varied.m, w->slopes->shown};
    for (int c = 0; c < s->columns; c++) {
        const kmp_column *of = &w->columns.of[w->chosen[c]];
        value[c] = values[of->quantity][of->index];
        for (int k = 0; k < s->count; k++)
            slope[c * s->count + k] = slopes[of->quantity][k * size[of->quantity] + of->index];
    }
    return 0;
}

static void add_work(kempe_sensitivity *s, const kmp_forward_report *report)
{
    s->work.steps += report->run.steps;
    s->work.rejected += report->run.rejected;
    s->work.refused += report->run.refused;
    s->work.rhs += report->run.rhs;
    s->work.exchanges += report->run.exchanges;
}

/* Takes the report's reason; the context's message is the same. */
static kempe_status close_report(kempe_sensitivity *s, kempe_status status, kmp_forward_report *report)
{
    add_work(s, report);
    if (report->run.reason) {
        if (status == KEMPE_E_FAILED)
            (void)kmp_fail(s->context, status, "%s", report->run.reason);
        kmp_free(s->reason);
        s->reason = report->run.reason;
    }
    return status;
}

static kempe_status find_rows(work *w)
{
    kmp_forward_report report;
    w->s->method = "forward";
    w->spec.times = w->times.t;
    w->spec.time_count = w->times.count;
    w->ask.watch = (kmp_varied_watch){.user = w, .row = take_row};
    kempe_status status = kmp_forward_run(&w->varied, &w->ask, w->s->size, NULL, &report);
    return close_report(w->s, status, &report);
}

/* -- one row ----------------------------------------------------------------------------------------- */

/* The weights of column c alone. */
static kmp_target target_of(work *w, int c)
{
    const kmp_column *of = &w->columns.of[w->chosen[c]];
    const int size[] = {w->varied.n, w->varied.n, w->varied.n, w->varied.m, w->slopes->shown};
    const double *part[KMP_QUANTITIES + 1] = {NULL};
    memset(w->w[of->quantity], 0, (size_t)size[of->quantity] * sizeof(double));
    w->w[of->quantity][of->index] = 1;
    part[of->quantity] = w->w[of->quantity];
    return (kmp_target){part[0], part[1], part[2], part[3], part[4]};
}

static kempe_status find_adjoint(work *w, const kmp_target *target, double *value)
{
    kempe_sensitivity *s = w->s;
    kmp_adjoint_report report;
    kempe_status status =
        kmp_adjoint_run(&w->varied, &w->ask, target, s->ask->integral != 0, s->size, w->gradient, &report);
    *value = report.value;
    s->backwards += (double)report.steps;
    s->work.rhs += report.rhs;
    s->kept = (double)report.kept > s->kept ? (double)report.kept : s->kept;
    return close_report(s, status, &report.forward);
}

static kempe_status find_integral(work *w, const kmp_target *target, double *value)
{
    kmp_forward_report report;
    w->ask.integrand = target;
    kempe_status status = kmp_forward_run(&w->varied, &w->ask, w->s->size, w->gradient, &report);
    w->ask.integrand = NULL;
    *value = report.integral;
    return close_report(w->s, status, &report);
}

/* A run a column. */
static kempe_status find_scalars(work *w, bool adjoint)
{
    kempe_sensitivity *s = w->s;
    double *value = KMP_NEW(double, s->columns), *slope = KMP_NEW(double, (size_t)s->columns *(size_t)s->count), *to,
           *slopes;
    kempe_status status = value && slope ? KEMPE_OK : kmp_fail_memory(s->context);
    s->method = adjoint ? "adjoint" : "forward";
    for (int c = 0; status == KEMPE_OK && c < s->columns; c++) {
        kmp_target target = target_of(w, c);
        status = adjoint ? find_adjoint(w, &target, &value[c]) : find_integral(w, &target, &value[c]);
        memcpy(slope + (size_t)c * (size_t)s->count, w->gradient, (size_t)s->count * sizeof *slope);
    }
    if (status == KEMPE_OK && !kmp_sensitivity_add_row(s, s->t_end, &to, &slopes))
        status = kmp_fail_memory(s->context);
    if (status == KEMPE_OK) {
        memcpy(to, value, (size_t)s->columns * sizeof *to);
        memcpy(slopes, slope, (size_t)s->columns * (size_t)s->count * sizeof *slopes);
    }
    kmp_free(value);
    kmp_free(slope);
    return status;
}

static kempe_status find(kempe_sensitivity *s)
{
    work w = {.s = s};
    double begin = kmp_cpu_now();
    kempe_status status = prepare(&w);
    s->build_s += kmp_cpu_now() - begin;
    const char *method = s->ask->method;
    bool many = s->ask->integral && s->count >= WORTH_ADJOINT && s->system->pressed_count == 0;
    bool adjoint = method ? strcmp(method, "adjoint") == 0 : many;
    if (status == KEMPE_OK)
        status = adjoint || s->ask->integral ? find_scalars(&w, adjoint) : find_rows(&w);
    kmp_columns_free(&w.columns);
    kmp_times_free(&w.times);
    kmp_varied_free(&w.varied);
    kmp_slopes_free(w.slopes);
    kmp_free(w.chosen);
    kmp_free(w.u);
    kmp_free(w.gradient);
    for (int k = 0; k <= KMP_QUANTITIES; k++)
        kmp_free(w.w[k]);
    return status;
}

const kmp_sensitivity_kind kmp_sensitivity_trajectory = {
    .name = "trajectory", .row = "t", .integrals = true, .find = find};
