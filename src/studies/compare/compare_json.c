/* SPDX-License-Identifier: BSD-3-Clause */
/* The comparison as one JSON object. */
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>

static void json_names(kmp_json *json, const kmp_method *method)
{
    kmp_json_string(json, "formulation", method->formulation);
    kmp_json_string(json, "form", method->form);
    kmp_json_string(json, "integrator", method->integrator);
    if (method->linear)
        kmp_json_string(json, "linear", method->linear);
}

double kmp_compare_error(const kempe_comparison *c, const kmp_compared *run, kmp_quantity quantity)
{
    return kmp_compared_is_below(c, run, quantity) ? NAN : run->verdict.error[quantity];
}

static void json_run(kmp_json *json, const kempe_comparison *c, const kmp_compared *run)
{
    kmp_json_object(json, NULL);
    json_names(json, run->method);
    kmp_json_put(json, "rtol %g status %s reason %s", run->rtol, kmp_status_word(run->status), run->reason);
    kmp_verdict verdict = run->verdict;
    for (int k = 0; k < KMP_COMPARE_SHOWN; k++)
        verdict.error[kmp_compare_shown[k]] = kmp_compare_error(c, run, kmp_compare_shown[k]);
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

void kmp_sentences_json(kmp_json *json, const char *key, const kmp_sentences *list)
{
    kmp_json_array(json, key);
    for (int k = 0; k < list->count; k++)
        kmp_json_string(json, NULL, list->s[k]);
    kmp_json_end(json);
}

static double number_or_none(double x)
{
    return isfinite(x) ? x : NAN;
}

/* The cost of a method for a level; null where it does not attain it. */
static void json_reached(kmp_json *json, const kempe_comparison *c, int method, int l)
{
    int k = c->levels.run[method * c->levels.count + l];
    kmp_json_object(json, NULL);
    json_names(json, &c->methods[method]);
    kmp_json_put(json, "rtol %g cpu_s %g ratio %g }", k >= 0 ? c->runs[k].rtol : NAN,
                 kmp_compare_cost(c, method, l).cpu_s,
                 c->levels.best[l] < 0 ? NAN : number_or_none(kmp_compare_ratio(c, method, l)));
}

static void json_split_all(kmp_json *json, const kempe_comparison *c, int method, bool same)
{
    const kmp_tables *t = &c->tables;
    kmp_json_object(json, NULL);
    json_names(json, &c->methods[method]);
    kmp_json_array(json, "errors");
    for (int k = 0; k < t->aims.count; k++) {
        int level = t->aims.level[k];
        /* The cost at one of the errors of the two tables, and its ratio to that of a base in three factors. */
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
    kmp_sentences_json(json, "reasons", &advice->because);
    kmp_json_end(json);
}

void kmp_compare_json(kmp_text *text, const void *result)
{
    const kempe_comparison *c = result;
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, c->system, kmp_status_word(c->status), c->reason, c->system->build_s, NULL);
    kmp_json_put(
        &j, "reference { source %s uncertainty %g uncertainty_qd %g uncertainty_lambda %g until %g instants %d",
        c->source, c->has_reference ? c->uncertainty[KMP_QUANTITY_Q] : NAN,
        c->has_reference ? c->uncertainty[KMP_QUANTITY_QD] : NAN,
        c->has_reference ? c->uncertainty[KMP_QUANTITY_LAMBDA] : NAN, c->has_reference ? c->until : NAN, c->instants);
    kmp_json_put(&j, "scales { angle %g length %g rate %g load %g } amplification %g runs [",
                 c->has_reference ? 1 : NAN, c->has_reference ? c->scales.length : NAN,
                 c->has_reference ? c->scales.rate : NAN, c->has_reference && c->system->m > 0 ? c->scales.load : NAN,
                 c->amplification);
    for (int k = 0; k < c->source_count; k++) {
        const kmp_source *source = &c->sources[k];
        kmp_json_object(&j, NULL);
        json_names(&j, &source->method);
        kmp_json_put(&j, "rtol %g own_difference %g distance %g }", source->rtol, source->own, source->distance);
    }
    kmp_json_put(&j, "] }");
    kmp_json_put(&j, "t_end %g runs [", c->t_end);
    for (int k = 0; k < c->count; k++)
        json_run(&j, c, &c->runs[k]);
    kmp_json_end(&j);
    kmp_json_array(&j, "equal_error");
    for (int l = 0; l < c->levels.count; l++) {
        kmp_json_put(&j, "{ error %g", c->levels.level[l]);
        if (c->levels.blank[l])
            kmp_json_boolean(&j, "below_reference", true);
        kmp_json_array(&j, "methods");
        for (int w = 0; w < c->method_count && !c->levels.blank[l]; w++)
            json_reached(&j, c, w, l);
        kmp_json_put(&j, "] }");
    }
    kmp_json_end(&j);
    /* Writes both tables: (a) the members of each family, one after another; (b) the best method of each formulation.
     */
    kmp_json_array(&j, "same_integrator");
    for (int k = 0; k < c->tables.same_count; k++)
        json_split_all(&j, c, c->tables.same[k], true);
    kmp_json_put(&j, "] best_of_formulation [");
    for (int k = 0; k < c->tables.best_count; k++)
        json_split_all(&j, c, c->tables.best[k], false);
    kmp_json_end(&j);
    json_stiffness(&j, c);
    json_advice(&j, c);
    kmp_sentences_json(&j, "failures", &c->failures);
    kmp_sentences_json(&j, "warnings", &c->warnings);
    kmp_json_end(&j);
}
