/* SPDX-License-Identifier: BSD-3-Clause */
/* Stiffness detection by numbers of steps. In a stiff model stability limits explicit steps, whose number hardly grows
 * at a tighter tolerance, and implicit integrators need far fewer. */
#include "base/memory.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>

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
