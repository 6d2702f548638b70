/* SPDX-License-Identifier: BSD-3-Clause */
/* Data of a comparison's page: the comparison, the runs in detail, the picture. */
#include "base/memory.h"
#include "output/print.h"
#include "report/encode.h"
#include "report/motion_picture.h"
#include "report/page.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

static const kmp_quantity shown[] = {KMP_QUANTITY_Q, KMP_QUANTITY_QD, KMP_QUANTITY_LAMBDA};

enum { SHOWN = sizeof shown / sizeof *shown, DIGITS = 4 };

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
        if (c->runs[k].status == KEMPE_OK && strcmp(c->runs[k].way->formulation, formulation) == 0 &&
            is_better(c, k, best))
            best = k;
    return best;
}

int kmp_page_choose(const kempe_comparison *c, int *chosen)
{
    int count = 0;
    if (c->advice.run >= 0)
        chosen[count++] = c->advice.run;
    for (int w = 0; w < c->way_count; w++) {
        bool seen = false;
        for (int k = 0; k < count && !seen; k++)
            seen = strcmp(c->runs[chosen[k]].way->formulation, c->ways[w].formulation) == 0;
        int best = seen ? -1 : best_of(c, c->ways[w].formulation);
        if (best >= 0)
            chosen[count++] = best;
    }
    return count;
}

/* -- the comparison ---------------------------------------------------------------------------------- */

static void key(kmp_text *text, const char *name)
{
    kmp_text_printf(text, ",\"%s\":", name);
}

static void put_string(kmp_text *text, const char *name, const char *s)
{
    key(text, name);
    kmp_encode_string(text, s ? s : "");
}

static void put_number(kmp_text *text, const char *name, double x, int digits)
{
    key(text, name);
    kmp_text_rounded(text, x, digits);
}

static void put_sentences(kmp_text *text, const char *name, const kmp_sentences *list)
{
    key(text, name);
    kmp_text_put(text, "[");
    for (int k = 0; k < list->count; k++) {
        kmp_text_put(text, k > 0 ? "," : "");
        kmp_encode_string(text, list->s[k]);
    }
    kmp_text_put(text, "]");
}

static void put_reference(kmp_text *text, const kempe_comparison *c)
{
    double uncertainty[SHOWN];
    for (int k = 0; k < SHOWN; k++)
        uncertainty[k] = c->has_reference ? c->uncertainty[shown[k]] : NAN;
    key(text, "reference");
    kmp_text_printf(text, "{\"there\":%s", c->has_reference ? "true" : "false");
    put_string(text, "source", c->source);
    key(text, "uncertainty");
    kmp_encode_numbers(text, SHOWN, uncertainty, 3);
    kmp_text_put(text, "}");
}

static void put_ways(kmp_text *text, const kempe_comparison *c)
{
    key(text, "methods");
    kmp_text_put(text, "[");
    for (int k = 0; k < c->way_count; k++) {
        const kmp_method *way = &c->ways[k];
        kmp_text t = {0};
        kmp_compare_name(&t, way->formulation, way->form, way->integrator);
        kmp_text_put(text, k > 0 ? ",{\"name\":" : "{\"name\":");
        kmp_encode_string(text, t.s ? t.s : "");
        text->failed = text->failed || t.failed;
        kmp_text_free(&t);
        put_string(text, "formulation", way->formulation);
        put_string(text, "form", way->form);
        put_string(text, "integrator", way->integrator);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void put_run(kmp_text *text, const kempe_comparison *c, const kmp_compared *run)
{
    const kmp_run_report *r = &run->report;
    double error[SHOWN];
    for (int k = 0; k < SHOWN; k++)
        error[k] = kmp_compared_is_below(c, run, shown[k]) ? NAN : run->verdict.error[shown[k]];
    kmp_text_printf(text, "{\"way\":%d", (int)(run->way - c->ways));
    put_number(text, "rtol", run->rtol, 6);
    put_string(text, "status", kmp_status_word(run->status));
    put_string(text, "reason", run->reason);
    key(text, "left_out");
    kmp_text_put(text, run->left_out ? "true" : "false");
    key(text, "error");
    kmp_encode_numbers(text, SHOWN, error, 3);
    key(text, "below");
    kmp_text_put(text, kmp_compared_is_below(c, run, KMP_QUANTITY_Q) ? "true" : "false");
    put_number(text, "h", run->verdict.h_max, 3);
    put_number(text, "hdot", run->verdict.hdot_max, 3);
    put_number(text, "drift", run->verdict.drift_rel, 3);
    kmp_text_printf(text,
                    ",\"steps\":%ld,\"rejected\":%ld,\"refused\":%ld,\"rhs\":%ld,\"newton\":%ld,"
                    "\"jacobians\":%ld,\"factorizations\":%ld,\"exchanges\":%ld",
                    r->steps, r->rejected, r->refused, r->rhs, r->newton, r->jacobians, r->factorizations,
                    r->exchanges);
    put_number(text, "cpu", run->cpu_s, DIGITS);
    kmp_text_put(text, "}");
}

static void put_runs(kmp_text *text, const kempe_comparison *c)
{
    key(text, "runs");
    kmp_text_put(text, "[");
    for (int k = 0; k < c->count; k++) {
        kmp_text_put(text, k > 0 ? "," : "");
        put_run(text, c, &c->runs[k]);
    }
    kmp_text_put(text, "]");
}

static void put_levels(kmp_text *text, const kempe_comparison *c)
{
    const kmp_levels *levels = &c->levels;
    key(text, "levels");
    kmp_text_put(text, "[");
    for (int l = 0; l < levels->count; l++) {
        kmp_text_put(text, l > 0 ? ",{\"level\":" : "{\"level\":");
        kmp_text_rounded(text, levels->level[l], 3);
        kmp_text_printf(text, ",\"blank\":%s,\"best\":%d,\"run\":[", levels->blank[l] ? "true" : "false",
                        levels->best[l]);
        for (int w = 0; w < c->way_count; w++)
            kmp_text_printf(text, "%s%d", w > 0 ? "," : "", levels->run[w * levels->count + l]);
        kmp_text_put(text, "]}");
    }
    kmp_text_put(text, "]");
}

static void put_advice(kmp_text *text, const kempe_comparison *c)
{
    key(text, "advice");
    kmp_text_printf(text, "{\"run\":%d", c->advice.run);
    put_number(text, "level", c->advice.level, 3);
    kmp_text_printf(text, ",\"stiff\":%s", c->advice.stiff ? "true" : "false");
    put_sentences(text, "reasons", &c->advice.because);
    kmp_text_put(text, "}");
}

/* -- runs in detail ---------------------------------------------------------------------------------- */

static void put_steps(kmp_text *text, const kmp_record *record)
{
    static const char *const name[3] = {"t", "least", "most"};
    key(text, "each");
    kmp_text_printf(text, "%ld,\"step\":{\"count\":%d", record->each, record->range_count);
    for (int part = 0; part < 3; part++) {
        key(text, name[part]);
        kmp_text_put(text, "[");
        for (int k = 0; k < record->range_count; k++) {
            const kmp_step_range *range = &record->ranges[k];
            kmp_text_put(text, k > 0 ? "," : "");
            kmp_text_rounded(text, part == 0 ? range->t : part == 1 ? range->least : range->most, part == 0 ? 6 : 3);
        }
        kmp_text_put(text, "]");
    }
    kmp_text_put(text, "}");
}

static void put_notes(kmp_text *text, const kmp_journal *journal)
{
    enum { MOST = 300 };
    key(text, "note_count");
    kmp_text_printf(text, "%ld", journal->count);
    key(text, "notes");
    kmp_text_put(text, "[");
    for (int k = 0; k < journal->kept && k < MOST; k++) {
        kmp_text_put(text, k > 0 ? ",{\"t\":" : "{\"t\":");
        kmp_text_rounded(text, journal->notes[k].t, 7);
        put_string(text, "kind", journal->notes[k].kind);
        put_string(text, "text", journal->notes[k].text);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void put_record(kmp_text *text, const kmp_record *record)
{
    int rows = record->row.rows;
    kmp_text_printf(text, "{\"run\":%d,\"rows\":%d", record->run, rows);
    put_number(text, "t_end", rows > 0 ? kmp_samples_time(&record->row, rows - 1) : 0, 7);
    key(text, "h");
    kmp_encode_numbers(text, rows, record->h, 3);
    key(text, "hdot");
    kmp_encode_numbers(text, rows, record->hdot, 3);
    key(text, "energy");
    kmp_encode_numbers(text, rows, record->energy, 3);
    put_steps(text, record);
    put_notes(text, &record->journal);
    kmp_text_put(text, "}");
}

bool kmp_page_data(kmp_text *text, const kempe_comparison *c, int count, const kmp_record *records,
                   const kmp_record *picture)
{
    kmp_text_put(text, "{\"kempe\":");
    kmp_encode_string(text, KEMPE_VERSION);
    put_string(text, "model", c->system->model->name);
    put_string(text, "status", kmp_status_word(c->status));
    put_string(text, "reason", c->reason);
    put_number(text, "t_end", c->t_end, 7);
    kmp_text_printf(text, ",\"n\":%d,\"m\":%d", c->system->n, c->system->m);
    put_reference(text, c);
    put_ways(text, c);
    put_runs(text, c);
    put_levels(text, c);
    put_advice(text, c);
    put_sentences(text, "failures", &c->failures);
    put_sentences(text, "warnings", &c->warnings);
    key(text, "shown");
    kmp_text_put(text, "[");
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k > 0 ? "," : "");
        put_record(text, &records[k]);
    }
    kmp_text_put(text, "]");
    key(text, "picture");
    if (picture && picture->row.rows > 0 && !kmp_motion_picture(text, c->system->model, &picture->row))
        return false;
    kmp_text_put(text, picture && picture->row.rows > 0 ? "}" : "null}");
    return !text->failed;
}
