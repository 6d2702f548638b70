/* SPDX-License-Identifier: BSD-3-Clause */
/* The comparison as a table of speed against error, as JSON, and as CSV. */
#include "base/memory.h"
#include "results/compare.h"
#include "results/print.h"
#include <math.h>
#include <string.h>

static const kmp_quantity shown[] = {KMP_QUANTITY_Q, KMP_QUANTITY_QD, KMP_QUANTITY_LAMBDA};

enum { SHOWN = sizeof shown / sizeof *shown, LINE = 120, NAMES = 32 };

static const char *form_of(const kmp_way *way)
{
    return way->form ? way->form : "-";
}

/* -- text -------------------------------------------------------------------------------------------- */

static void show_head(kmp_text *text, const kempe_comparison *c)
{
    double uncertainty = c->uncertainty[KMP_QUANTITY_Q];
    kmp_text_printf(text, "%s, 0 to %g s\nreference: %s\n", c->system->model->name, c->t_end, c->source);
    if (c->has_reference && uncertainty > 0)
        kmp_text_printf(text, "its error q is about %.1e; errors below ten times the reference's own are left blank\n",
                        uncertainty);
    if (c->count == 0)
        return;
    kmp_text_printf(text, "\n%-9s %-7s %-10s %6s | %8s %8s %8s | %8s %8s | %8s %9s %9s\n", "road", "form", "integrator",
                    "rtol", "error q", "qd", "lambda", "|h|", "energy", "steps", "rhs", "cpu ms");
}

static void show_rule(kmp_text *text)
{
    kmp_text_put(text, "------------------------------------+----------------------------+-------------------+---------"
                       "-------------------\n");
}

/* The first line of a reason, as far as the table is wide. */
static void show_reason(kmp_text *text, const kmp_compared *run)
{
    int room = LINE - NAMES - 16, length = (int)strcspn(run->reason, "\n");
    kmp_text_printf(text, " | %s: %.*s%s\n", kmp_status_word(run->status), length > room ? room - 3 : length,
                    run->reason, length > room ? "..." : "");
}

static void show_run(kmp_text *text, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_text_printf(text, "%-9s %-7s %-10s %6.0e", run->way->road, form_of(run->way), run->way->integrator, run->rtol);
    if (run->status != KEMPE_OK) {
        show_reason(text, run);
        return;
    }
    kmp_text_put(text, " |");
    for (int k = 0; k < SHOWN; k++)
        if (kmp_compared_is_below(c, run, shown[k]))
            kmp_text_printf(text, " %8s", "");
        else
            kmp_print_cell(text, 9, 1, run->verdict.error[shown[k]]);
    kmp_text_put(text, " |");
    kmp_print_cell(text, 9, 1, run->verdict.h_max);
    kmp_print_cell(text, 9, 1, run->verdict.drift_rel);
    kmp_text_printf(text, " | %8ld %9ld %9.4g\n", run->report.steps, run->report.rhs, 1e3 * run->cpu_s);
}

/* -- which way is the cheapest ----------------------------------------------------------------------- */

/* The cheapest run of a way (NULL: of all) with error.q <= target; NULL when none reaches it. */
static const kmp_compared *cheapest(const kempe_comparison *c, const kmp_way *way, double target)
{
    const kmp_compared *best = NULL;
    for (int k = 0; k < c->count; k++) {
        const kmp_compared *run = &c->runs[k];
        if (run->status == KEMPE_OK && (!way || run->way == way) && run->verdict.error[KMP_QUANTITY_Q] <= target &&
            (!best || run->cpu_s < best->cpu_s))
            best = run;
    }
    return best;
}

static void show_other(kmp_text *text, const kempe_comparison *c, const kmp_way *way, const kmp_compared *best,
                       double target)
{
    const kmp_compared *run = cheapest(c, way, target);
    kmp_text_printf(text, "    %-9s %-7s %-10s ", way->road, form_of(way), way->integrator);
    if (!run)
        kmp_text_put(text, "not reached\n");
    else
        kmp_text_printf(text, "%.3g x as long (rtol %g)\n", run->cpu_s / best->cpu_s, run->rtol);
}

static void show_cheapest(kmp_text *text, const kempe_comparison *c, double target)
{
    const kmp_compared *best = cheapest(c, NULL, target);
    double uncertainty = c->uncertainty[KMP_QUANTITY_Q];
    if (uncertainty > 0 && target < 10 * uncertainty) {
        kmp_text_printf(text, "error q <= %.0e: the reference is too coarse to tell\n", target);
        return;
    }
    if (!best) {
        kmp_text_printf(text, "error q <= %.0e: not reached\n", target);
        return;
    }
    kmp_text_printf(text, "cheapest at error q <= %.0e: %s %s %s, rtol %g, %.3g ms\n", target, best->way->road,
                    form_of(best->way), best->way->integrator, best->rtol, 1e3 * best->cpu_s);
    for (int k = 0; k < c->count; k++)
        if ((k == 0 || c->runs[k].way != c->runs[k - 1].way) && c->runs[k].way != best->way)
            show_other(text, c, c->runs[k].way, best, target);
}

static void show(kmp_text *text, const kempe_comparison *c)
{
    static const double targets[] = {1e-6, 1e-8, 1e-10};
    show_head(text, c);
    for (int k = 0; k < c->count; k++) {
        if (k == 0 || c->runs[k].way != c->runs[k - 1].way)
            show_rule(text);
        show_run(text, c, &c->runs[k]);
    }
    kmp_text_put(text, "\n");
    for (size_t k = 0; c->has_reference && c->count > 0 && k < sizeof targets / sizeof *targets; k++)
        show_cheapest(text, c, targets[k]);
    if (c->status != KEMPE_OK)
        kmp_text_printf(text, "%s: %s\n", kmp_status_word(c->status), c->reason);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void json_reference(kmp_json *json, const kempe_comparison *c)
{
    kmp_json_object(json, "reference");
    kmp_json_string(json, "source", c->source);
    kmp_json_number(json, "uncertainty", c->has_reference ? c->uncertainty[KMP_QUANTITY_Q] : NAN);
    kmp_json_number(json, "uncertainty_qd", c->has_reference ? c->uncertainty[KMP_QUANTITY_QD] : NAN);
    kmp_json_number(json, "uncertainty_lambda", c->has_reference ? c->uncertainty[KMP_QUANTITY_LAMBDA] : NAN);
    kmp_json_end(json);
}

static void json_error(kmp_json *json, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_verdict verdict = run->verdict;
    for (int k = 0; k < SHOWN; k++)
        if (kmp_compared_is_below(c, run, shown[k]))
            verdict.error[shown[k]] = NAN;
    kmp_print_errors(json, &verdict);
    if (kmp_compared_is_below(c, run, KMP_QUANTITY_Q))
        kmp_json_true(json, "below_reference");
}

static void json_run(kmp_json *json, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_json_object(json, NULL);
    kmp_json_string(json, "road", run->way->road);
    kmp_json_string(json, "form", run->way->form);
    kmp_json_string(json, "integrator", run->way->integrator);
    kmp_json_number(json, "rtol", run->rtol);
    kmp_json_string(json, "status", kmp_status_word(run->status));
    kmp_json_string(json, "reason", run->reason);
    json_error(json, c, run);
    kmp_print_verdict(json, &run->verdict);
    kmp_print_work(json, &run->report);
    kmp_json_number(json, "cpu_s", run->cpu_s);
    kmp_json_end(json);
}

static void json_names(kmp_json *json, const kmp_way *way)
{
    kmp_json_string(json, "road", way->road);
    kmp_json_string(json, "form", way->form);
    kmp_json_string(json, "integrator", way->integrator);
}

static void json_sentences(kmp_json *json, const char *key, const kmp_sentences *list)
{
    kmp_json_array(json, key);
    for (int k = 0; k < list->count; k++)
        kmp_json_string(json, NULL, list->s[k]);
    kmp_json_end(json);
}

/* What a way needs for a level; null where it does not reach it. */
static void json_reached(kmp_json *json, const kempe_comparison *c, int way, int l)
{
    int k = c->levels.run[way * c->levels.count + l], best = c->levels.best[l];
    kmp_json_object(json, NULL);
    json_names(json, &c->ways[way]);
    kmp_json_number(json, "rtol", k >= 0 ? c->runs[k].rtol : NAN);
    kmp_json_number(json, "cpu_s", k >= 0 ? c->runs[k].cpu_s : NAN);
    kmp_json_number(json, "ratio", k >= 0 ? c->runs[k].cpu_s / c->runs[best].cpu_s : NAN);
    kmp_json_end(json);
}

static void json_levels(kmp_json *json, const kempe_comparison *c)
{
    kmp_json_array(json, "equal_error");
    for (int l = 0; l < c->levels.count; l++) {
        kmp_json_object(json, NULL);
        kmp_json_number(json, "error", c->levels.level[l]);
        if (c->levels.blank[l])
            kmp_json_true(json, "below_reference");
        kmp_json_array(json, "ways");
        for (int w = 0; w < c->way_count && !c->levels.blank[l]; w++)
            json_reached(json, c, w, l);
        kmp_json_end(json);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* null when nothing can be advised. */
static void json_advice(kmp_json *json, const kempe_comparison *c)
{
    const kmp_advice *advice = &c->advice;
    const kmp_compared *run = advice->run >= 0 ? &c->runs[advice->run] : NULL;
    kmp_json_object(json, "advice");
    kmp_json_string(json, "road", run ? run->way->road : NULL);
    kmp_json_string(json, "form", run ? run->way->form : NULL);
    kmp_json_string(json, "integrator", run ? run->way->integrator : NULL);
    kmp_json_number(json, "rtol", run ? run->rtol : NAN);
    kmp_json_number(json, "error", advice->level);
    if (advice->stiff)
        kmp_json_true(json, "stiff");
    json_sentences(json, "because", &advice->because);
    kmp_json_end(json);
}

static void json(kmp_text *text, const kempe_comparison *c)
{
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, c->system, c->status, c->reason, c->system->build_s);
    json_reference(&j, c);
    kmp_json_number(&j, "t_end", c->t_end);
    kmp_json_array(&j, "runs");
    for (int k = 0; k < c->count; k++)
        json_run(&j, c, &c->runs[k]);
    kmp_json_end(&j);
    json_levels(&j, c);
    json_advice(&j, c);
    json_sentences(&j, "failures", &c->failures);
    json_sentences(&j, "warnings", &c->warnings);
    kmp_json_end(&j);
}

kempe_status kempe_comparison_print(const kempe_comparison *comparison, kempe_format format, char **text)
{
    kmp_text out = {0};
    kmp_context_clear(comparison->system->context);
    if (format == KEMPE_JSON)
        json(&out, comparison);
    else
        show(&out, comparison);
    return kmp_print_finish(comparison->system->context, &out, text);
}

/* -- CSV --------------------------------------------------------------------------------------------- */

static void write_cell(kmp_text *text, double x)
{
    kmp_text_put(text, ",");
    if (isfinite(x))
        kmp_text_number(text, x);
}

static void write_run(kmp_text *text, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_text_printf(text, "%s,%s,%s", run->way->road, run->way->form ? run->way->form : "", run->way->integrator);
    write_cell(text, run->rtol);
    kmp_text_printf(text, ",%s", kmp_status_word(run->status));
    for (int k = 0; k < SHOWN; k++)
        write_cell(text, kmp_compared_is_below(c, run, shown[k]) ? NAN : run->verdict.error[shown[k]]);
    write_cell(text, run->verdict.h_max);
    write_cell(text, run->verdict.hdot_max);
    write_cell(text, run->verdict.drift_rel);
    const kmp_run_report *r = &run->report;
    kmp_text_printf(text, ",%ld,%ld,%ld,%ld,%ld,%ld,%ld", r->steps, r->rejected, r->refused, r->rhs, r->newton,
                    r->factorizations, r->exchanges);
    write_cell(text, run->cpu_s);
    kmp_text_put(text, "\n");
}

kempe_status kempe_comparison_write_csv(const kempe_comparison *comparison, const char *path)
{
    kempe_context *context = comparison->system->context;
    kmp_text text = {0};
    kmp_text_put(&text, "road,form,integrator,rtol,status,error_q,error_qd,error_lambda,h_max,hdot_max,drift_rel,steps,"
                        "rejected,refused,rhs,newton,factorizations,exchanges,cpu_s\n");
    for (int k = 0; k < comparison->count; k++)
        write_run(&text, comparison, &comparison->runs[k]);
    kmp_context_clear(context);
    char *whole = kmp_text_take(&text);
    if (!whole)
        return kmp_fail_memory(context);
    kempe_status status = kempe_write_file(context, path, whole);
    kmp_free(whole);
    return status;
}
