/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of a comparison: its results, and runs made once more with monitoring. */
#include "report/comparison_page.h"
#include "picture/motion_picture.h"
#include "studies/compare/compare_print.h"
#include "studies/compare/compare_study.h"
#include <math.h>
#include <string.h>

/* -- choice of runs ---------------------------------------------------------------------------------- */

/* The better of two runs of a formulation: one that reaches the level of the advice, then the cheaper one. Without
 * such, the more accurate one; without errors, the one at the tighter tolerance. */
static bool is_better(const kempe_comparison *c, int run, int than)
{
    if (than < 0)
        return true;
    const kmp_compared *a = &c->runs[run], *b = &c->runs[than];
    double e = a->verdict.error[KMP_QUANTITY_Q], f = b->verdict.error[KMP_QUANTITY_Q], level = c->advice.level;
    if ((e <= level) != (f <= level))
        return e <= level;
    if (e <= level)
        return a->cpu_s < b->cpu_s;
    return isnan(e) || isnan(f) ? a->rtol < b->rtol : e < f;
}

static int best_of(const kempe_comparison *c, const char *formulation)
{
    int best = -1;
    for (int k = 0; k < c->count; k++)
        if (c->runs[k].status == KEMPE_OK && strcmp(c->runs[k].method->formulation, formulation) == 0 &&
            is_better(c, k, best))
            best = k;
    return best;
}

int kmp_page_choose(const kempe_comparison *c, int *chosen)
{
    int count = 0;
    if (c->advice.run >= 0)
        chosen[count++] = c->advice.run;
    for (int w = 0; w < c->method_count; w++) {
        bool seen = false;
        for (int k = 0; k < count && !seen; k++)
            seen = strcmp(c->runs[chosen[k]].method->formulation, c->methods[w].formulation) == 0;
        int best = seen ? -1 : best_of(c, c->methods[w].formulation);
        if (best >= 0)
            chosen[count++] = best;
    }
    return count;
}

/* -- running again ----------------------------------------------------------------------------------- */

/* A run that ended well ends well again; one that is interrupted is shown as far as it came. */
static kempe_status record_runs(const kempe_comparison *c, kmp_result_page *page)
{
    int *run = KMP_ARENA_NEW(&page->arena, int, c->method_count + 1);
    page->motion.records = KMP_ARENA_NEW(&page->arena, kmp_record, c->method_count + 1);
    KMP_TRY(kmp_made(page->context, run && page->motion.records));
    int wanted = kmp_page_choose(c, run);
    for (int k = 0; k < wanted && !kmp_interrupted(page->context); k++) {
        const kmp_method *method = c->runs[run[k]].method;
        kmp_log(page->context, KEMPE_LOG_PROGRESS, "report: %s %s, rtol %g repeated", method->formulation,
                method->integrator, c->runs[run[k]].rtol);
        kempe_status status = kmp_record_make(c, run[k], c->t_end, &page->motion.records[page->motion.record_count]);
        page->motion.record_count += status == KEMPE_OK || status == KEMPE_STOPPED;
        if (!kmp_has_result(status))
            return status;
    }
    return KEMPE_OK;
}

/* A long run is shown from its beginning, as long as the eye can follow. */
static kempe_status record_picture(const kempe_comparison *c, kmp_result_page *page)
{
    page->picture.frames = &page->picture.start.row;
    if (page->motion.record_count == 0)
        return kmp_record_start(c->system, &page->picture.start);
    const kmp_record *shown = &page->motion.records[0];
    const kmp_samples *row = page->picture.frames = &shown->row;
    double t_end = kmp_motion_picture_end(c->system->model, &shown->row);
    if (row->rows == 0 || !(t_end < kmp_samples_time(row, row->rows - 1)) || kmp_interrupted(page->context))
        return KEMPE_OK;
    kempe_status status = kmp_record_make(c, shown->run, t_end, &page->picture.start);
    if (status == KEMPE_OK || status == KEMPE_STOPPED)
        page->picture.frames = &page->picture.start.row;
    return kmp_has_result(status) ? KEMPE_OK : status;
}

kempe_status kmp_comparison_fill(kmp_result_page *page, const void *result)
{
    const kempe_comparison *c = result;
    KMP_TRY(record_runs(c, page));
    KMP_TRY(record_picture(c, page));
    kmp_context_clear(page->context); /* errors of a start that cannot be assembled */
    kmp_page_set_outcome(page, kmp_outcome_of(c->status), c->reason, NULL,
                         kmp_arena_printf(&page->arena, "0 to %.3g s", c->t_end));
    kmp_json_number(&page->data, "build_s", c->system->build_s);
    kmp_compare_json(&page->data, c);
    return KEMPE_OK;
}

static const char *const *const scripts[] = {kmp_records_js, kmp_comparison_js, NULL};
const kmp_page_view kmp_comparison_view = {kmp_comparison_html, scripts, NULL};
