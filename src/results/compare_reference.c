/* SPDX-License-Identifier: BSD-3-Clause */
/* The reference that Kempe makes itself: the reduced road at a tolerance near rounding, and how far the projected road,
 * which shares neither the choice of coordinates nor the closing with it, is from that. */
#include "base/memory.h"
#include "results/compare.h"
#include <math.h>

enum { ROWS = 10 };

static const kmp_way reference_way = {.road = "reduced", .form = "carried", .integrator = "dop853"};
static const kmp_way cross_check = {.road = "projected", .form = "none", .integrator = "dop853"};

/* The tightest that comes to the end: after many turns rounding alone may exceed the first. */
static const double tight[] = {1e-13, 1e-12, 1e-11};

static kempe_status describe(kempe_comparison *c, const kmp_way *first, double rtol, const char *remark)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "own: %s %s %s at rtol %g, %s", first->road, first->form ? first->form : "",
                    first->integrator, rtol, remark);
    kmp_free(c->source);
    c->source = kmp_text_take(&text);
    return c->source ? KEMPE_OK : kmp_fail_memory(c->system->context);
}

/* One run at one tolerance. A failure is told as `level`; `*done` tells whether it came to the end. */
static kempe_status attempt(const kempe_comparison *c, const kmp_way *way, double rtol, const kempe_assembly *start,
                            kempe_level level, kmp_samples *table, bool *done)
{
    double times[ROWS + 1];
    kmp_run_report report;
    for (int k = 0; k <= ROWS; k++)
        times[k] = k == ROWS ? c->t_end : c->t_end * k / ROWS;
    kmp_log(c->system->context, KEMPE_LOG_PROGRESS, "reference: %s %s at rtol %g", way->road, way->integrator, rtol);
    kempe_status status = kmp_compare_once(c->system, way, rtol, c->t_end, ROWS + 1, times, start, table, &report);
    *done = status == KEMPE_OK;
    if (status == KEMPE_STOPPED || status == KEMPE_E_FAILED) {
        kmp_log(c->system->context, level, "reference: %s %s at rtol %g: %s", way->road, way->integrator, rtol,
                report.reason ? report.reason : "it did not come to the end");
        status = KEMPE_OK;
    }
    kmp_free(report.reason);
    return status;
}

/* The tightest run of a way that comes to the end; `*rtol` is its tolerance, 0 when there is none. */
static kempe_status run_tight(const kempe_comparison *c, const kmp_way *way, const kempe_assembly *start,
                              kmp_samples *table, double *rtol)
{
    const int count = sizeof tight / sizeof *tight;
    bool done = false;
    kempe_status status = KEMPE_OK;
    *rtol = 0;
    for (int k = 0; way && k < count && !done && status == KEMPE_OK && !kmp_interrupted(c->system->context); k++) {
        kempe_level level = k == count - 1 ? KEMPE_LOG_WARNING : KEMPE_LOG_NOTE;
        status = attempt(c, way, tight[k], start, level, table, &done);
        if (done)
            *rtol = tight[k];
    }
    return status;
}

/* How far the second road is from the reference. */
static kempe_status confirm(kempe_comparison *c, const kmp_way *first, double rtol, const kempe_assembly *start,
                            kmp_plant *plant, const kmp_reference *reference)
{
    kmp_samples table;
    double second;
    kmp_samples_init(&table, c->system->n, c->system->m);
    kempe_status status = run_tight(c, &cross_check, start, &table, &second);
    if (status == KEMPE_OK && second > 0) {
        kmp_verdict verdict = kmp_verdict_of(&table, plant, reference);
        for (int k = 0; k < KMP_QUANTITIES; k++)
            c->uncertainty[k] = verdict.error[k];
        status = describe(c, first, rtol, "confirmed by the projected road");
    } else if (status == KEMPE_OK) {
        status = describe(c, first, rtol, "not confirmed by a second road");
    }
    kmp_samples_free(&table);
    return status;
}

kempe_status kmp_compare_own_reference(kempe_comparison *c, const kempe_assembly *start, kmp_plant *plant,
                                       kmp_reference *reference)
{
    const kmp_way *first = &reference_way;
    kmp_samples table;
    double rtol;
    kmp_samples_init(&table, c->system->n, c->system->m);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        c->uncertainty[k] = NAN;
    kempe_status status = run_tight(c, first, start, &table, &rtol);
    if (status == KEMPE_OK && rtol > 0 && !kmp_reference_from_table(reference, &table))
        status = kmp_fail_memory(c->system->context);
    kmp_samples_free(&table);
    c->has_reference = status == KEMPE_OK && rtol > 0;
    return c->has_reference ? confirm(c, first, rtol, start, plant, reference) : status;
}
