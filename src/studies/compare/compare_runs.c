/* SPDX-License-Identifier: BSD-3-Clause */
/* The runs of a comparison: every method at every tolerance, coarse ones first, each judged at the reference's times. A
 * method that is much slower than the fastest is stopped, and runs without remaining time are left out. */
#include "studies/compare/compare_runs.h"
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>

/* Repeats of runs shorter than this, s. */
enum { MOST_REPEATS = 5, SOME_REPEATS = 3 };
#define SHORT    0.02
#define NOT_LONG 0.1
/* A run may take HOPELESS times as long as the fastest at its tolerance, and SHORT in any case. The fastest itself may
 * use a part of the remaining time. */
#define HOPELESS  100.0
#define FREE      0.25
#define MOST_PART 0.125
/* Rows per right-hand side below which their time is negligible. */
#define ROW_PART 0.02

/* -- one run ----------------------------------------------------------------------------------------- */

kempe_status kmp_compare_once(kmp_compare_job *j, const kmp_method *method, double rtol, const kmp_times *times,
                              double limit_s, kmp_samples *table, kmp_run_report *report)
{
    const kempe_system *system = j->comparison->system;
    kmp_run_spec spec = {.formulation = method->formulation,
                         .form = method->form,
                         .integrator = method->integrator,
                         .linear = method->linear,
                         .rtol = rtol,
                         .atol = rtol,
                         .t_end = j->comparison->t_end,
                         .time_count = times->count,
                         .times = times->t,
                         .limit_s = limit_s};
    table->rows = 0;
    *report = (kmp_run_report){0};
    kempe_status status = kmp_run_resolve(system, &spec);
    const bool quiet = kmp_context_quiet(j->context, j->quiet);
    if (status == KEMPE_OK)
        status = kmp_run(system, &spec, j->start, kmp_samples_add, table, report);
    (void)kmp_context_quiet(j->context, quiet);
    j->quiet = true;
    j->left_s -= report->cpu_s + report->build_s;
    return status;
}

static void report(const kmp_compare_job *j, const kmp_compared *run)
{
    kmp_text text = {0};
    kmp_compare_name(&text, run->method);
    const char *name = text.s ? text.s : "";
    if (run->status == KEMPE_OK)
        kmp_log(j->context, KEMPE_LOG_PROGRESS, "%s, rtol %g: error q %.1e, %.3g ms", name, run->rtol,
                run->verdict.error[KMP_QUANTITY_Q], 1e3 * run->cpu_s);
    else
        kmp_log(j->context, KEMPE_LOG_PROGRESS, "%s, rtol %g: %s", name, run->rtol, run->reason);
    kmp_text_free(&text);
}

static kempe_status run_one(kmp_compare_job *j, kmp_compared *run, double limit_s, kmp_samples *table)
{
    kempe_status status = kmp_compare_once(j, run->method, run->rtol, &j->times, limit_s, table, &run->report);
    bool cut = run->report.cut;
    if (status == KEMPE_OK) {
        run->verdict = kmp_verdict_of(table, j->eval, j->comparison->has_reference ? &j->reference : NULL);
        run->cpu_s = run->report.cpu_s;
        run->build_s = run->report.build_s;
    }
    run->reason = kmp_arena_strdup(&j->comparison->arena,
                                   run->report.reason ? run->report.reason : kempe_context_message(j->context));
    kmp_free(run->report.reason);
    run->report.reason = NULL;
    if (!kmp_has_result(status))
        return status;
    if (status != KEMPE_OK)
        run->verdict = kmp_verdict_none();
    else if (run->reason)
        run->reason = "";
    run->status = status;
    run->left_out = cut;
    kmp_context_clear(j->context);
    return run->reason ? KEMPE_OK : kmp_fail_memory(j->context);
}

/* -- all runs ---------------------------------------------------------------------------------------- */

typedef struct grid {
    kmp_compare_job *job;
    kmp_arena arena;
    kempe_comparison *comparison;
    kmp_samples table;
    kmp_samples *before;  /* of each method: the rows at the last tolerance with a complete run */
    int *before_run;      /* its run, -1: none */
    double *cpu_s;        /* of each method so far */
    int *repeats;         /* of each run, for its time */
    bool *out;            /* methods that are abandoned */
    int *methods, *rtols; /* in the order in which they are run */
} grid;

static kmp_compared *run_of(const grid *g, int method, int rtol)
{
    return &g->comparison->runs[method * g->comparison->rtol_count + rtol];
}

static void leave_out(kmp_compared *run, const char *reason)
{
    run->status = KEMPE_STOPPED;
    run->left_out = true;
    run->reason = reason;
}

/* A method that was abandoned is so at all tighter tolerances. */
static void give_up(const grid *g, int method, int rtol, double limit_s, double fastest)
{
    double bound = run_of(g, method, rtol)->rtol;
    kmp_text reason = {0};
    kmp_text_printf(&reason, "omitted: at rtol %g it is not finished after %.3g s", bound, limit_s);
    if (limit_s >= fmax(FREE, HOPELESS * fastest))
        kmp_text_printf(&reason, ", compared with %.3g s of the fastest", fastest);
    else
        kmp_text_printf(&reason, " of the %.3g s for all runs; increase --budget", g->comparison->budget_s);
    const char *kept = kmp_text_keep(&reason, &g->comparison->arena);
    for (int k = 0; k < g->comparison->rtol_count; k++)
        if (run_of(g, method, k)->rtol <= bound)
            leave_out(run_of(g, method, k), kept);
    g->out[method] = true;
}

/* The difference of q between the previous run and this one, which is tighter. */
static void compare_before(grid *g, int method, int run)
{
    kempe_comparison *c = g->comparison;
    double error[KMP_QUANTITIES];
    if (g->before_run[method] >= 0) {
        kmp_reference tighter = g->table;
        tighter.shared = c->shared;
        kmp_verdict_errors(&g->before[method], c->system, &tighter, INFINITY, error);
        c->runs[g->before_run[method]].apart = error[KMP_QUANTITY_Q];
    }
    kmp_samples swap = g->before[method];
    g->before[method] = g->table;
    g->table = swap;
    g->before_run[method] = run;
}

/* A repeat takes the same steps, and only its time counts. The first one replaces the time of the judged run. */
static kempe_status repeat(grid *g, kmp_compared *run, bool first)
{
    kmp_run_report report;
    kempe_status status = kmp_compare_once(g->job, run->method, run->rtol, &g->job->few, 0, &g->table, &report);
    kmp_free(report.reason);
    report.reason = NULL;
    if (status != KEMPE_OK)
        return kmp_has_result(status) ? KEMPE_OK : status;
    run->cpu_s = first ? report.cpu_s : fmin(run->cpu_s, report.cpu_s);
    run->build_s = fmin(run->build_s, report.build_s);
    run->report = report;
    return KEMPE_OK;
}

static kempe_status run_cell(grid *g, int method, int rtol, double *fastest)
{
    kmp_compared *run = run_of(g, method, rtol);
    double left = MOST_PART * g->job->left_s;
    double limit_s = isinf(*fastest) ? left : fmin(fmax(FREE, HOPELESS * *fastest), fmax(left, 2 * *fastest));
    if (g->out[method])
        return KEMPE_OK;
    if (kmp_interrupted(g->job->context))
        leave_out(run, "interrupted");
    else if (!(g->job->left_s > 0))
        leave_out(run,
                  kmp_arena_printf(&g->comparison->arena,
                                   "omitted: the processor time of %.3g s for all runs is used up; increase --budget",
                                   g->comparison->budget_s));
    if (run->left_out)
        return KEMPE_OK;
    KMP_TRY(run_one(g->job, run, limit_s, &g->table));
    if (run->left_out)
        give_up(g, method, rtol, limit_s, *fastest);
    KMP_TRY(kmp_made(g->job->context, run->reason));
    report(g->job, run);
    g->cpu_s[method] = run->report.cpu_s;
    if (run->status != KEMPE_OK)
        return KEMPE_OK;
    const int at = method * g->comparison->rtol_count + rtol;
    /* Rows that are judged take additional time, which must not be measured. For a long run it is negligible, unless
     * there are as many rows as right-hand sides. */
    g->repeats[at] = run->cpu_s < SHORT      ? MOST_REPEATS
                     : run->cpu_s < NOT_LONG ? SOME_REPEATS
                                             : g->job->times.count > ROW_PART * (double)run->report.rhs;
    compare_before(g, method, at);
    if (g->repeats[at] > 0)
        KMP_TRY(repeat(g, run, true));
    *fastest = fmin(*fastest, run->cpu_s);
    return KEMPE_OK;
}

/* Sorts a list by keys of its entries, the smallest first (`sign` 1) or the largest (-1); equal ones stay in order. */
static void sort_by(int count, int *list, double sign, const double *key)
{
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && sign * key[list[k]] < sign * key[list[k - 1]]; k--) {
            int swap = list[k];
            list[k] = list[k - 1];
            list[k - 1] = swap;
        }
}

static bool begin(grid *g)
{
    kempe_comparison *c = g->comparison;
    kmp_samples_init(&g->table, c->system->n, c->system->m);
    c->runs = KMP_ARENA_NEW(&c->arena, kmp_compared, c->method_count * c->rtol_count);
    KMP_ARENA_MAKE(&g->arena, KMP_ROOM(kmp_samples, c->method_count, &g->before),
                   KMP_ROOM(int, c->method_count, &g->before_run, &g->methods),
                   KMP_ROOM(double, c->method_count, &g->cpu_s),
                   KMP_ROOM(int, c->method_count * c->rtol_count, &g->repeats),
                   KMP_ROOM(bool, c->method_count, &g->out), KMP_ROOM(int, c->rtol_count, &g->rtols));
    if (!c->runs || g->arena.failed)
        return false;
    c->count = c->method_count * c->rtol_count;
    for (int w = 0; w < c->method_count; w++) {
        kmp_samples_init(&g->before[w], c->system->n, c->system->m);
        g->before_run[w] = -1;
        g->methods[w] = w;
    }
    for (int k = 0; k < c->count; k++)
        c->runs[k] = (kmp_compared){.method = &c->methods[k / c->rtol_count],
                                    .rtol = g->comparison->rtols[k % c->rtol_count],
                                    .verdict = kmp_verdict_none(),
                                    .cpu_s = NAN,
                                    .build_s = NAN,
                                    .apart = NAN};
    for (int k = 0; k < c->rtol_count; k++)
        g->rtols[k] = k;
    sort_by(c->rtol_count, g->rtols, -1, c->rtols);
    return true;
}

kempe_status kmp_compare_run_all(kmp_compare_job *j)
{
    grid g = {.job = j, .comparison = j->comparison};
    kempe_status status = begin(&g) ? KEMPE_OK : kmp_fail_memory(j->context);
    for (int k = 0; status == KEMPE_OK && k < g.comparison->rtol_count; k++) {
        double fastest = INFINITY;
        /* Fast methods first: time is spent on them, and the others are compared with them. */
        sort_by(g.comparison->method_count, g.methods, 1, g.cpu_s);
        for (int w = 0; status == KEMPE_OK && w < g.comparison->method_count; w++) {
            status = run_cell(&g, g.methods[w], g.rtols[k], &fastest);
            kmp_progress(j->context, KMP_PROGRESS_STUDY, k * g.comparison->method_count + w + 1, g.comparison->count,
                         "runs");
        }
    }
    /* Repeats all runs in alternation, so that a change of the machine's load affects all of them equally. The first
     * repetitions were made before. */
    for (int round = 1; round < MOST_REPEATS; round++)
        for (int k = 0; status == KEMPE_OK && k < g.comparison->count; k++)
            if (round < g.repeats[k] && !kmp_interrupted(j->context))
                status = repeat(&g, &g.comparison->runs[k], false);
    for (int w = 0; g.before && w < g.comparison->method_count; w++)
        kmp_samples_free(&g.before[w]);
    kmp_samples_free(&g.table);
    kmp_arena_free(&g.arena);
    return status;
}

/* -- stiffness ------------------------------------------------------------------------------------------- */

/* Stiffness detection by numbers of steps. In a stiff model stability limits explicit steps, whose number hardly grows
 * at a tighter tolerance, and implicit integrators need far fewer. */

/* Explicit steps that accuracy rules grow by a factor 1.33 a decade of the tolerance at order 8, by 1.58 at order 5. */
#define GROWTH 1.1
/* Implicit steps with a smaller reduction than this give no advantage. */
#define FEWER 2.0
/* Fewer explicit steps than these have no limit: little moves. */
#define MANY 50
/* The tolerances that are compared, and the part of the remaining time that a probing run may take. */
#define LOOSE      1e-3
#define TIGHT      1e-6
#define PROBE_PART 0.02

static const kmp_method explicit_method = {.formulation = "reduced", .form = "integrated", .integrator = "dop853"};
static const kmp_method implicit_method = {.formulation = "reduced", .form = "newton", .integrator = "bdf"};

bool kmp_steps_are_stiff(long loose, long tight, double decades, long implicit)
{
    return loose >= MANY && FEWER * (double)implicit < (double)loose &&
           (double)tight < (double)loose * pow(GROWTH, decades);
}

/* -- before all runs --------------------------------------------------------------------------------- */

/* *steps: -1 when the run was not complete. */
static kempe_status count_steps(kmp_compare_job *j, const kmp_method *method, double rtol, long *steps)
{
    kmp_samples table;
    kmp_run_report report = {0};
    double t_end = j->comparison->t_end;
    kmp_times times = {1, &t_end};
    kmp_samples_init(&table, j->comparison->system->n, j->comparison->system->m);
    kmp_log(j->context, KEMPE_LOG_PROGRESS, "probe: %s %s %s at rtol %g", method->formulation, method->form,
            method->integrator, rtol);
    kempe_status status = kmp_compare_once(j, method, rtol, &times, PROBE_PART * j->left_s, &table, &report);
    *steps = status == KEMPE_OK ? report.steps : -1;
    kmp_free(report.reason);
    kmp_samples_free(&table);
    return kmp_has_result(status) ? KEMPE_OK : status;
}

kempe_status kmp_compare_probe(kmp_compare_job *j, bool *stiff)
{
    long loose, tight = -1, implicit = -1;
    KMP_TRY(count_steps(j, &explicit_method, LOOSE, &loose));
    if (loose >= 0)
        KMP_TRY(count_steps(j, &explicit_method, TIGHT, &tight));
    KMP_TRY(count_steps(j, &implicit_method, LOOSE, &implicit));
    if (loose < 0 || tight < 0)
        *stiff = implicit >= 0;
    else
        *stiff = implicit >= 0 && kmp_steps_are_stiff(loose, tight, log10(LOOSE / TIGHT), implicit);
    kmp_context_clear(j->context); /* errors of the probes */
    return KEMPE_OK;
}

/* -- after all runs ---------------------------------------------------------------------------------- */

static bool is_done(const kempe_comparison *c, int k)
{
    return c->runs[k].status == KEMPE_OK;
}

/* The loosest complete run of a method, -1: none. */
static int loosest(const kempe_comparison *c, int method)
{
    int found = -1;
    for (int k = method * c->rtol_count; k < (method + 1) * c->rtol_count; k++)
        if (is_done(c, k) && (found < 0 || c->runs[k].rtol > c->runs[found].rtol))
            found = k;
    return found;
}

/* The run of the method about three decades tighter, at least two; -1: none. */
static int tighter(const kempe_comparison *c, int loose)
{
    int found = -1;
    for (int k = 0; k < c->count; k++) {
        double decades = log10(c->runs[loose].rtol / c->runs[k].rtol);
        if (c->runs[k].method == c->runs[loose].method && is_done(c, k) && decades > 1.9 && decades < 3.1 &&
            (found < 0 || c->runs[k].rtol < c->runs[found].rtol))
            found = k;
    }
    return found;
}

/* The cheapest implicit run at a tolerance; at any for rtol 0; -1: none. */
static int cheapest_implicit(const kempe_comparison *c, double rtol)
{
    int found = -1;
    for (int k = 0; k < c->count; k++)
        if (kmp_is_implicit(c->runs[k].method) && is_done(c, k) &&
            (!(rtol > 0) || fabs(c->runs[k].rtol - rtol) < 0.01 * rtol) &&
            (found < 0 || c->runs[k].cpu_s < c->runs[found].cpu_s))
            found = k;
    return found;
}

kmp_stiffness kmp_compare_stiffness(const kempe_comparison *c)
{
    kmp_stiffness s = {-1, -1, -1, false};
    bool tried = false, done = false;
    for (int w = 0; w < c->method_count; w++) {
        int loose = kmp_is_implicit(&c->methods[w]) ? -1 : loosest(c, w);
        tried = tried || !kmp_is_implicit(&c->methods[w]);
        done = done || loose >= 0;
        int tight = loose >= 0 ? tighter(c, loose) : -1,
            implicit = loose >= 0 ? cheapest_implicit(c, c->runs[loose].rtol) : -1;
        if (tight < 0 || implicit < 0)
            continue;
        long steps = c->runs[loose].report.steps;
        s = (kmp_stiffness){loose, tight, implicit, false};
        s.stiff = kmp_steps_are_stiff(steps, c->runs[tight].report.steps,
                                      log10(c->runs[loose].rtol / c->runs[tight].rtol), c->runs[implicit].report.steps);
        return s;
    }
    if (tried && !done)
        s.implicit = cheapest_implicit(c, 0);
    s.stiff = s.implicit >= 0;
    return s;
}
