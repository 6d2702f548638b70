/* SPDX-License-Identifier: BSD-3-Clause */
/* The comparison as text, JSON and tables. Text: the recommendation with its reasons, warnings, times at equal error;
 * in full also all runs and the split of their times. */
#include "studies/compare/compare_print.h"
#include "integrators/run/methods.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_runs.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The quantities whose errors are shown. */
static const kmp_quantity shown[] = {KMP_QUANTITY_Q, KMP_QUANTITY_QD, KMP_QUANTITY_LAMBDA};
enum { SHOWN = sizeof shown / sizeof *shown };

/* NaN where it is unknown, or too close to the reference's own uncertainty. */
static double shown_error(const kempe_comparison *c, const kmp_compared *run, kmp_quantity quantity)
{
    return kmp_compared_is_below(c, run, quantity) ? NAN : run->verdict.error[quantity];
}

enum { NAME = 28, NUMBER = 16, INDENT = 4 };

/* -- the tables at equal error, each ratio of times split into steps, evaluations a step and time an evaluation ------
 */

static void put_number(kmp_text *text, int width, double x)
{
    char number[NUMBER];
    (void)snprintf(number, sizeof number, x >= 999.5 && x < 1e6 ? "%.0f" : "%.3g", x);
    kmp_text_printf(text, " %*s", width, number);
}

static void put_factor(kmp_text *text, int width, double x)
{
    char number[NUMBER];
    (void)snprintf(number, sizeof number, x < 9.995 ? "x%.2f" : x < 99.95 ? "x%.1f" : "x%.0f", x);
    kmp_text_printf(text, " %*s", width, number);
}

/* Time, steps, evaluations a step and microseconds an evaluation, of a base; of another method as multiples of it. */
static void put_cost(kmp_text *text, kmp_method_cost cost, const kmp_method_cost *base)
{
    kmp_text_put(text, " |");
    if (isnan(cost.cpu_s)) {
        kmp_text_printf(text, " %7s %24s", "-", "");
        return;
    }
    put_number(text, 7, 1e3 * cost.cpu_s);
    if (!base) {
        put_number(text, 5, 1);
        put_number(text, 6, round(cost.steps));
        put_number(text, 5, cost.rhs / cost.steps);
        put_number(text, 5, 1e6 * cost.cpu_s / cost.rhs);
        return;
    }
    put_factor(text, 5, cost.cpu_s / base->cpu_s);
    put_factor(text, 6, cost.steps / base->steps);
    put_factor(text, 5, cost.rhs / cost.steps * base->steps / base->rhs);
    put_factor(text, 5, cost.cpu_s / cost.rhs * base->rhs / base->cpu_s);
}

static int name_width(const kempe_comparison *c)
{
    size_t width = NAME;
    for (int w = 0; w < c->method_count; w++)
        if (c->methods[w].linear && width < NAME + 1 + strlen(c->methods[w].linear))
            width = NAME + 1 + strlen(c->methods[w].linear);
    return (int)width;
}

static void put_name(kmp_text *text, const kempe_comparison *c, const kmp_method *method)
{
    kmp_text name = {0};
    kmp_compare_name(&name, method);
    kmp_text_printf(text, "%-*s", name_width(c), name.s ? name.s : "");
    kmp_text_free_part(text, &name);
}

static void end_line(kmp_text *text)
{
    while (text->length > 0 && text->s[text->length - 1] == ' ')
        text->s[--text->length] = '\0';
    kmp_text_put(text, "\n");
}

static void put_titles(kmp_text *text, const kempe_comparison *c)
{
    kmp_text_printf(text, "%*s", name_width(c), "");
    for (int k = 0; k < c->tables.aims.count; k++) {
        char error[2 * NUMBER];
        (void)snprintf(error, sizeof error, "error of q %.0e", c->levels.level[c->tables.aims.level[k]]);
        kmp_text_printf(text, " | %-31s", error);
    }
    end_line(text);
    kmp_text_printf(text, "%*s", name_width(c), "");
    for (int k = 0; k < c->tables.aims.count; k++)
        kmp_text_printf(text, " | %7s %5s %6s %5s %5s", "ms", "ratio", "steps", "evals", "us");
    kmp_text_put(text, "\n");
}

/* A line of one of the tables: `same` is the table of equal integrators. */
static void put_line(kmp_text *text, const kempe_comparison *c, int method, bool same)
{
    put_name(text, c, &c->methods[method]);
    for (int k = 0; k < c->tables.aims.count; k++) {
        int level = c->tables.aims.level[k],
            base = same ? kmp_compare_base(c, method, level) : kmp_compare_best(c, level);
        kmp_method_cost of_base = base >= 0 ? kmp_compare_cost(c, base, level) : (kmp_method_cost){NAN, NAN, NAN};
        put_cost(text, kmp_compare_cost(c, method, level), base == method ? NULL : &of_base);
    }
    end_line(text);
}

/* In addition to the integration: preparation, first result, memory, residuals and the other errors, of the run for the
 * first aim. */
static void put_beside(kmp_text *text, const kempe_comparison *c, int method)
{
    int k = c->levels.run[method * c->levels.count + c->tables.aims.level[0]];
    const kmp_compared *run = k >= 0 ? &c->runs[k] : NULL;
    if (!run)
        return;
    put_name(text, c, run->method);
    kmp_text_printf(text, " | %6.0e", run->rtol);
    put_number(text, 8, 1e3 * (c->system->build_s + run->build_s));
    put_number(text, 8, 1e3 * kmp_compare_first_s(c, run));
    size_t bytes = run->report.heap;
    if (bytes > 0)
        put_number(text, 9, (double)bytes / 1024);
    else
        kmp_text_printf(text, " %9s", "-");
    kmp_print_cells(text, "%8.0e%8.0e%9.1e%9.1e\n", run->verdict.h_max, run->verdict.drift_rel,
                    shown_error(c, run, KMP_QUANTITY_QD), shown_error(c, run, KMP_QUANTITY_LAMBDA));
}

static void show_tables(kmp_text *text, const kempe_comparison *c)
{
    const kmp_tables *t = &c->tables;
    if (t->aims.count == 0)
        return;
    if (t->same_count > 0) {
        kmp_text_put(text, "\n(a) The same integrator on each formulation: the cost of the formulation\n");
        put_titles(text, c);
    }
    for (int k = 0; k < t->same_count; k++)
        put_line(text, c, t->same[k], true);
    kmp_text_put(text, "\n(b) The best method of each formulation: the choice of a user\n");
    put_titles(text, c);
    for (int k = 0; k < t->best_count; k++)
        put_line(text, c, t->best[k], false);
    kmp_text_put(text,
                 "ratio: to the time of the first line = steps x evaluations per step (evals) x time of one, us\n");
    kmp_text_printf(text, "\n%-*s | %6s %8s %8s %9s %7s %7s %8s %8s\n", name_width(c), "Run for the larger error",
                    "rtol", "prep. ms", "first ms", "memory kB", "|h|", "energy", "error qd", "lambda");
    for (int k = 0; k < t->best_count; k++)
        put_beside(text, c, t->best[k]);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void json_names(kmp_json *json, const kmp_method *method)
{
    kmp_json_string(json, "formulation", method->formulation);
    kmp_json_string(json, "form", method->form);
    kmp_json_string(json, "integrator", method->integrator);
    if (method->linear)
        kmp_json_string(json, "linear", method->linear);
}

static void json_run(kmp_json *json, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_json_object(json, NULL);
    json_names(json, run->method);
    kmp_json_put(json, "rtol %g status %s reason %s", run->rtol, kempe_outcome_text(kmp_outcome_of(run->status)),
                 run->reason);
    kmp_verdict verdict = run->verdict;
    for (int k = 0; k < SHOWN; k++)
        verdict.error[shown[k]] = shown_error(c, run, shown[k]);
    kmp_print_errors(json, &verdict);
    if (kmp_compared_is_below(c, run, KMP_QUANTITY_Q))
        kmp_json_boolean(json, "below_reference", true);
    kmp_print_verdict(json, &run->verdict);
    kmp_print_work(json, &run->report);
    kmp_json_put(json, "cpu_s %g build_s %g first_s %g memory_bytes %g difference %g", run->cpu_s, run->build_s,
                 kmp_compare_first_s(c, run), run->report.heap > 0 ? (double)run->report.heap : NAN, run->apart);
    if (run->left_out)
        kmp_json_boolean(json, "left_out", true);
    kmp_json_end(json);
}

static void json_sentences(kmp_json *json, const char *key, const kmp_sentences *list)
{
    kmp_json_array(json, key);
    for (int k = 0; k < list->count; k++)
        kmp_json_string(json, NULL, list->s[k]);
    kmp_json_end(json);
}

/* The cost of a method for a level; null where it does not attain it. */
static void json_reached(kmp_json *json, const kempe_comparison *c, int method, int l)
{
    int k = c->levels.run[method * c->levels.count + l];
    double ratio = c->levels.best[l] < 0 ? NAN : kmp_compare_ratio(c, method, l);
    kmp_json_object(json, NULL);
    json_names(json, &c->methods[method]);
    kmp_json_put(json, "rtol %g cpu_s %g ratio %g }", k >= 0 ? c->runs[k].rtol : NAN,
                 kmp_compare_cost(c, method, l).cpu_s, isfinite(ratio) ? ratio : NAN);
}

static void json_split_all(kmp_json *json, const kempe_comparison *c, int method, bool same)
{
    const kmp_tables *t = &c->tables;
    kmp_json_object(json, NULL);
    json_names(json, &c->methods[method]);
    kmp_json_array(json, "errors");
    for (int k = 0; k < t->aims.count; k++) {
        int level = t->aims.level[k];
        /* The cost at one of the errors of the two tables, and its ratio to the cost of a base in three factors. */
        int base = same ? kmp_compare_base(c, method, level) : kmp_compare_best(c, level);
        kmp_method_cost cost = kmp_compare_cost(c, method, level), of = {NAN, NAN, NAN};
        if (base >= 0)
            of = kmp_compare_cost(c, base, level);
        kmp_json_put(json, "{ error %g cpu_s %g steps %g evaluations %g", c->levels.level[level], cost.cpu_s,
                     cost.steps, cost.rhs);
        kmp_json_put(json, "ratio %g ratio_steps %g ratio_evaluations_per_step %g ratio_time_per_evaluation %g }",
                     cost.cpu_s / of.cpu_s, cost.steps / of.steps, cost.rhs / cost.steps * of.steps / of.rhs,
                     cost.cpu_s / cost.rhs * of.rhs / of.cpu_s);
    }
    kmp_json_put(json, "] }");
}

static double steps_of(const kempe_comparison *c, int run)
{
    return run >= 0 ? (double)c->runs[run].report.steps : NAN;
}

/* Writes the step counts that decide on stiffness: null where there is no such run. */
static void json_stiffness(kmp_json *json, const kempe_comparison *c)
{
    kmp_stiffness s = c->count > 0 ? kmp_compare_stiffness(c) : (kmp_stiffness){-1, -1, -1, false};
    kmp_json_put(
        json,
        "stiffness { stiff %i rtol %g rtol_tighter %g explicit_steps %g explicit_steps_tighter %g implicit_steps %g }",
        s.stiff, s.loose >= 0 ? c->runs[s.loose].rtol : NAN, s.tight >= 0 ? c->runs[s.tight].rtol : NAN,
        steps_of(c, s.loose), steps_of(c, s.tight), steps_of(c, s.implicit));
}

/* null when nothing can be advised. */
static void json_advice(kmp_json *json, const kempe_comparison *c)
{
    const kmp_advice *advice = &c->advice;
    const kmp_compared *run = advice->run >= 0 ? &c->runs[advice->run] : NULL;
    kmp_json_object(json, "advice");
    json_names(json, run ? run->method : &(const kmp_method){0});
    kmp_json_put(json, "rtol %g error %g", run ? run->rtol : NAN, advice->level);
    if (advice->stiff)
        kmp_json_boolean(json, "stiff", true);
    json_sentences(json, "reasons", &advice->because);
    kmp_json_end(json);
}

void kmp_compare_json(kmp_json *j, const kempe_comparison *c)
{
    kmp_json_put(j, "reference { source %s uncertainty %g uncertainty_qd %g uncertainty_lambda %g until %g instants %d",
                 c->source, c->has_reference ? c->uncertainty[KMP_QUANTITY_Q] : NAN,
                 c->has_reference ? c->uncertainty[KMP_QUANTITY_QD] : NAN,
                 c->has_reference ? c->uncertainty[KMP_QUANTITY_LAMBDA] : NAN, c->has_reference ? c->until : NAN,
                 c->instants);
    kmp_json_put(j, "scales { angle %g length %g rate %g load %g } amplification %g runs [", c->has_reference ? 1 : NAN,
                 c->has_reference ? c->scales.length : NAN, c->has_reference ? c->scales.rate : NAN,
                 c->has_reference && c->system->m > 0 ? c->scales.load : NAN, c->amplification);
    for (int k = 0; k < c->source_count; k++) {
        const kmp_source *source = &c->sources[k];
        kmp_json_object(j, NULL);
        json_names(j, &source->method);
        kmp_json_put(j, "rtol %g own_difference %g distance %g }", source->rtol, source->own, source->distance);
    }
    kmp_json_put(j, "] } t_end %g runs [", c->t_end);
    for (int k = 0; k < c->count; k++)
        json_run(j, c, &c->runs[k]);
    kmp_json_put(j, "] equal_error [");
    for (int l = 0; l < c->levels.count; l++) {
        kmp_json_put(j, "{ error %g", c->levels.level[l]);
        if (c->levels.blank[l])
            kmp_json_boolean(j, "below_reference", true);
        kmp_json_array(j, "methods");
        for (int w = 0; w < c->method_count && !c->levels.blank[l]; w++)
            json_reached(j, c, w, l);
        kmp_json_put(j, "] }");
    }
    kmp_json_end(j);
    /* Writes both tables: (a) the members of each family, one after another; (b) the best method of each formulation.
     */
    kmp_json_array(j, "same_integrator");
    for (int k = 0; k < c->tables.same_count; k++)
        json_split_all(j, c, c->tables.same[k], true);
    kmp_json_put(j, "] best_of_formulation [");
    for (int k = 0; k < c->tables.best_count; k++)
        json_split_all(j, c, c->tables.best[k], false);
    kmp_json_end(j);
    kmp_compare_bodies_json(j, c->system->context, &c->bodies);
    json_stiffness(j, c);
    json_advice(j, c);
    json_sentences(j, "failures", &c->failures);
    json_sentences(j, "warnings", &c->warnings);
}

static void json_all(kmp_text *text, const void *result)
{
    const kempe_comparison *c = result;
    kmp_json json = kmp_print_head(text, c->system, kmp_outcome_of(c->status), c->reason, c->system->build_s, NULL);
    kmp_start_balance_json(&json, c->balance);
    kmp_compare_json(&json, c);
    kmp_json_end(&json);
}

/* -- text -------------------------------------------------------------------------------------------- */

static void show_list(kmp_text *text, const char *title, const kmp_sentences *list)
{
    if (list->count > 0)
        kmp_text_printf(text, "\n%s\n", title);
    for (int k = 0; k < list->count; k++)
        kmp_print_wrapped(text, "  - ", INDENT, list->s[k]);
}

/* -- runs -------------------------------------------------------------------------------------------- */

static void show_run(kmp_text *text, const kempe_comparison *c, const kmp_compared *run, int width)
{
    kmp_text name = {0};
    kmp_compare_name(&name, run->method);
    kmp_text_printf(text, "%-*s %5.0e", width, name.s ? name.s : "", run->rtol);
    kmp_text_free_part(text, &name);
    if (run->status != KEMPE_OK) {
        /* The first line of the reason, as far as the table is wide. */
        const char *word = run->left_out ? "" : kempe_outcome_text(kmp_outcome_of(run->status)),
                   *after = run->left_out ? "" : ": ";
        int length = (int)strcspn(run->reason, "\n"),
            room = KMP_PRINT_LINE - width - 9 - (int)(strlen(word) + strlen(after));
        kmp_text_printf(text, " | %s%s%.*s%s\n", word, after, length > room ? room - 3 : length, run->reason,
                        length > room ? "..." : "");
        return;
    }
    kmp_text_put(text, " |");
    for (int k = 0; k < SHOWN; k++)
        if (kmp_compared_is_below(c, run, shown[k]))
            kmp_text_printf(text, " %7s", "");
        else
            kmp_print_cells(text, "%8.1e", run->verdict.error[shown[k]]);
    kmp_print_cells(text, " |%6.0e%8.1e | %6ld %7ld", run->verdict.h_max, run->verdict.drift_rel, run->report.steps,
                    run->report.rhs);
    put_number(text, 6, 1e3 * run->cpu_s);
    kmp_text_put(text, "\n");
}

static void show_runs(kmp_text *text, const kempe_comparison *c)
{
    int width = name_width(c);
    if (c->count > 0)
        kmp_text_printf(text, "\n%-*s %5s | %7s %7s %7s | %5s %7s | %6s %7s %6s\n", width, "Run", "rtol", "error q",
                        "qd", "lambda", "|h|", "energy", "steps", "evals", "cpu ms");
    for (int k = 0; k < c->count; k++)
        if (k % c->rtol_count == 0 || !c->runs[k].left_out || strcmp(c->runs[k].reason, c->runs[k - 1].reason) != 0)
            show_run(text, c, &c->runs[k], width);
}

/* -- at equal error ---------------------------------------------------------------------------------- */

static void show_ratios(kmp_text *text, const kempe_comparison *c, int method)
{
    const kmp_method *w = &c->methods[method];
    char integrator[32];
    (void)snprintf(integrator, sizeof integrator, "%s%s%s", w->integrator, w->linear ? "/" : "",
                   w->linear ? w->linear : "");
    kmp_text_printf(text, "%-9s %-11s %-*s", w->formulation, w->form ? w->form : "-", name_width(c) - 22, integrator);
    for (int l = 0; l < c->levels.count; l++) {
        double ratio = c->levels.blank[l] || c->levels.best[l] < 0 ? INFINITY : kmp_compare_ratio(c, method, l);
        if (c->levels.blank[l])
            kmp_text_printf(text, " %7s", "");
        else if (isinf(ratio))
            kmp_text_printf(text, " %7s", "-");
        else
            kmp_text_printf(text, ratio < 9.95 ? " %7.2f" : " %7.0f", ratio);
    }
    end_line(text);
}

static void show_levels(kmp_text *text, const kempe_comparison *c)
{
    bool blank = false;
    if (c->levels.count == 0)
        return;
    kmp_text_printf(text, "\nProcessor time for a given error of q, relative to the fastest\n%-*s", name_width(c),
                    "error of q, at most");
    for (int l = 0; l < c->levels.count; l++) {
        kmp_text_printf(text, " %7.0e", c->levels.level[l]);
        blank = blank || c->levels.blank[l];
    }
    kmp_text_printf(text, "\n%-*s", name_width(c), "fastest, ms");
    for (int l = 0; l < c->levels.count; l++) {
        int best = c->levels.best[l];
        if (c->levels.blank[l])
            kmp_text_printf(text, " %7s", "");
        else if (best < 0)
            kmp_text_printf(text, " %7s", "-");
        else
            kmp_text_printf(text, " %7.3g",
                            1e3 * kmp_compare_cost(c, (int)(c->runs[best].method - c->methods), l).cpu_s);
    }
    end_line(text);
    for (int w = 0; w < c->method_count; w++)
        show_ratios(text, c, w);
    kmp_text_printf(text, "-: not reached%s\n", blank ? "; blank: below the accuracy of the reference" : "");
}

/* -- summary ----------------------------------------------------------------------------------------- */

/* True if the integrator takes this form of the formulation where none is given. */
static bool is_default_form(const kmp_method *method)
{
    kmp_method first;
    for (int k = 0; kmp_method_get(k, &first); k++)
        if (strcmp(first.formulation, method->formulation) == 0 && strcmp(first.integrator, method->integrator) == 0)
            return !method->form || strcmp(first.form, method->form) == 0;
    return false;
}

/* The options of the recommended run. */
static void put_options(kmp_text *text, const kmp_compared *run)
{
    const kmp_method *method = run->method;
    kmp_text_printf(text, "use --formulation %s", method->formulation);
    if (!is_default_form(method))
        kmp_text_printf(text, " --form %s", method->form);
    kmp_text_printf(text, " --integrator %s --rtol %g", method->integrator, run->rtol);
    if (method->linear)
        kmp_text_printf(text, " --linear %s", method->linear);
}

static void show_title(kmp_text *text, const kempe_comparison *c)
{
    kmp_text title = {0};
    kmp_print_title(&title, c->system->model, kmp_outcome_of(c->status));
    kmp_text_printf(&title, "0 to %g s: ", c->t_end);
    if (c->advice.run >= 0)
        put_options(&title, &c->runs[c->advice.run]);
    else if (kmp_is_complete(c->status))
        kmp_text_put(&title, "no recommendation");
    else
        kmp_text_put(&title, c->reason);
    kmp_print_wrapped(text, "", INDENT, title.s ? title.s : "");
    kmp_text_free_part(text, &title);
    kmp_start_balance_show(text, c->balance);
    kmp_text doubt = {0};
    kmp_compare_bodies_put_doubt(&doubt, &c->bodies);
    if (c->status == KEMPE_UNTRUSTED && doubt.s)
        kmp_print_wrapped(text, "  ", INDENT, doubt.s);
    kmp_text_free_part(text, &doubt);
    if (!kmp_is_complete(c->status) && c->advice.run >= 0)
        kmp_print_wrapped(text, "  The comparison ended early: ", INDENT, c->reason);
}

static void show_reference(kmp_text *text, const kempe_comparison *c)
{
    const double *u = c->uncertainty;
    kmp_text sentence = {0};
    kmp_text_put(&sentence, c->source);
    if (c->has_reference && u[KMP_QUANTITY_Q] > 0) {
        kmp_text_printf(&sentence, "; its error is about %.0e in q, %.0e in qd", u[KMP_QUANTITY_Q], u[KMP_QUANTITY_QD]);
        if (u[KMP_QUANTITY_LAMBDA] > 0)
            kmp_text_printf(&sentence, ", %.0e in lambda", u[KMP_QUANTITY_LAMBDA]);
    }
    kmp_print_wrapped(text, "  Reference: ", INDENT, sentence.s ? sentence.s : "");
    kmp_text_free_part(text, &sentence);
}

/* The sizes that errors are relative to. */
static void show_scales(kmp_text *text, const kempe_comparison *c)
{
    const kmp_scales *s = &c->scales;
    kmp_text sentence = {0};
    if (!c->has_reference)
        return;
    kmp_text_printf(&sentence, "the largest at %d instants, relative to the value or to ", c->instants);
    const kempe_context *context = c->system->context;
    const struct {
        double size;
        const char *unit;
    } sizes[] = {{1, "rad"}, {s->length, "m"}, {s->rate, "rad/s"}, {s->rate * s->length, "m/s"}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        kmp_text_put(&sentence, k > 0 ? ", " : "");
        kmp_print_quantity(&sentence, context, 3, sizes[k].size, sizes[k].unit);
    }
    if (c->system->m > 0) {
        kmp_text_put(&sentence, "; of lambda to the largest load, ");
        kmp_print_quantity(&sentence, context, 3, s->load, "N");
    }
    kmp_print_wrapped(text, "Errors: ", INDENT, sentence.s ? sentence.s : "");
    kmp_text_free_part(text, &sentence);
}

static void show_parts(kmp_text *text, const kempe_comparison *c, bool all)
{
    show_title(text, c);
    for (int k = 0; k < c->advice.because.count; k++)
        kmp_print_wrapped(text, "  ", INDENT, c->advice.because.s[k]);
    if (c->count > 0)
        show_reference(text, c);
    show_list(text, "Not run to the end", &c->failures);
    show_list(text, "Warnings", &c->warnings);
    show_levels(text, c);
    kmp_compare_bodies_show(text, c->system->context, &c->bodies);
    if (all) {
        show_runs(text, c);
        show_tables(text, c);
    }
    if (c->count == 0)
        return;
    kmp_text_put(text, "\n");
    show_scales(text, c);
    if (!all)
        kmp_text_printf(text, "More: --all (%d runs; steps, evaluations, memory), --csv FILE, --report FILE\n",
                        c->count);
}

KMP_PRINT_FULL(kempe_comparison, comparison, comparison->system->context, json_all, show_parts)

/* -- tables ------------------------------------------------------------------------------------------ */

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
    kmp_tabulate_cells(table, "%g %s %s", run->rtol, kempe_outcome_text(kmp_outcome_of(run->status)), run->reason);
    for (int k = 0; k < SHOWN; k++)
        kmp_tabulate_number(table, shown_error(c, run, shown[k]));
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

static void fill_bodies(kempe_table *table, const void *result)
{
    const kmp_bodies_table *bodies = &((const kempe_comparison *)result)->bodies;
    kmp_tabulate_columns(table, "bodies[words] status[words] reason[words] coordinates steps cpu_s build_s "
                                "output[words] error part unit[words]");
    for (int k = 0; k < bodies->count; k++) {
        const kmp_compared_bodies *row = &bodies->rows[k];
        const int worst = row->worst;
        kmp_tabulate_row(table);
        const kmp_shown as =
            worst >= 0 ? kmp_shown_as(((const kempe_comparison *)result)->system->context, bodies->unit[worst])
                       : (kmp_shown){"", 1};
        kmp_tabulate_cells(table, "%s %s %s %d %ld %g %g %s %g %g %s", row->word, kempe_outcome_text(row->outcome),
                           row->reason, row->coordinates, row->steps, row->cpu_s, row->build_s,
                           worst >= 0 ? bodies->names[worst] : "", worst >= 0 ? as.factor * row->error[worst] : NAN,
                           row->part, as.unit);
    }
}

KMP_TABLES(kempe_comparison, comparison, comparison->system->context, {"runs", fill_runs}, {"levels", fill_levels},
           {"bodies", fill_bodies})
