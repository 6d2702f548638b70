/* SPDX-License-Identifier: BSD-3-Clause */
/* Comparison: every chosen method at every tolerance from one assembled start, judged at the reference's times. */
#include "studies/compare/compare_study.h"
#include "base/memory.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/partition/undetermined_loads.h"
#include "integrators/run/methods.h"
#include "integrators/steppers/solver.h"
#include "integrators/sundials/linear.h"
#include "output/print.h"
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_levels.h"
#include "studies/compare/compare_reference.h"
#include "studies/compare/compare_runs.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

/* The default processor time of all runs, s, and the part of it available for the reference. */
#define BUDGET         60.0
#define REFERENCE_PART 0.4
/* Rows of runs whose time counts, less one. */
#define FEW 10

/* A given table of fewer rows is extended by the own reference if both differ in q by at most AGREED. */
#define MANY_ROWS 200
#define AGREED    1e-5

/* -- the choice of methods and tolerances ---------------------------------------------------------------- */

/* Comma-separated lists of formulations, forms, integrators and tolerances, compared with the table of methods. */

static const char default_rtols[] = "1e-3,1e-4,1e-5,1e-6,1e-7,1e-8,1e-9,1e-10,1e-11,1e-12,1e-13";

typedef enum part { PART_FORMULATION, PART_FORM, PART_INTEGRATOR, PARTS } part;

static const char *const part_name[PARTS] = {"formulation", "form", "integrator"};

static const char *part_of(const kmp_method *method, part p)
{
    const char *name = p == PART_FORMULATION ? method->formulation : p == PART_FORM ? method->form : method->integrator;
    return name ? name : "";
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool word_is(const char *s, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(s, name, length) == 0;
}

/* True if the list contains the name; an absent list contains all. */
static bool list_has(const char *list, const char *name)
{
    for (const char *s = list; s; s = s[strcspn(s, ",")] ? s + strcspn(s, ",") + 1 : NULL)
        if (word_is(s, strcspn(s, ","), name))
            return true;
    return !list;
}

static kempe_status check_names(kempe_context *context, const char *list, part p)
{
    for (const char *s = list; s;) {
        size_t length = strcspn(s, ",");
        kmp_method method, before;
        bool known = false;
        for (int k = 0; kmp_method_get(k, &method); k++)
            known = known || (length > 0 && word_is(s, length, part_of(&method, p)));
        if (!known) {
            kmp_text sentence = {0};
            kmp_text_printf(&sentence, "unknown %s '%.*s'; available: ", part_name[p], (int)length, s);
            /* Each name of the table once. */
            for (int k = 0, said = 0; kmp_method_get(k, &method); k++) {
                const char *name = part_of(&method, p);
                bool again = !*name;
                for (int i = 0; i < k && kmp_method_get(i, &before); i++)
                    again = again || strcmp(part_of(&before, p), name) == 0;
                if (!again)
                    kmp_text_printf(&sentence, "%s%s", said++ ? ", " : "", name);
            }
            return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
        }
        s = s[length] ? s + length + 1 : NULL;
    }
    return KEMPE_OK;
}

/* -- methods and tolerances -------------------------------------------------------------------------- */

/* A method run in addition to the standard ones when neither a form nor an integrator is given. */
static const char *const beside[PARTS] = {"reduced", "integrated", "dopri5"};

/* True if the method is selected. Forms and integrators that are not given by name must be standard ones. */
static bool is_chosen(const kmp_method *method, const char *const list[PARTS])
{
    bool chosen = true, is_beside = !list[PART_FORM] && !list[PART_INTEGRATOR];
    for (part p = PART_FORMULATION; p < PARTS; p++) {
        chosen = chosen && list_has(list[p], part_of(method, p));
        is_beside = is_beside && strcmp(part_of(method, p), beside[p]) == 0;
    }
    return chosen && (list[PART_FORM] || method->standard_form) &&
           (list[PART_INTEGRATOR] || method->standard_integrator || is_beside);
}

bool kmp_is_implicit(const kmp_method *method)
{
    const kmp_solver_kind *solver = kmp_solver_find(method->integrator);
    return solver->dae || solver->implicit || solver->lanes;
}

/* Adds a method: once, or with each linear solver of the list if its integrator takes one. */
static void add_method(kempe_comparison *c, kmp_method method, const char *linear)
{
    bool each = linear && kmp_solver_find(method.integrator)->sparse;
    if (each)
        method.linear = "auto";
    if (!each || list_has(linear, method.linear))
        c->methods[c->method_count++] = method;
    for (int k = 0; each && kmp_linear_name(k); k++) {
        method.linear = kmp_linear_name(k);
        if (list_has(linear, method.linear))
            c->methods[c->method_count++] = method;
    }
}

static kempe_status check_linear(kempe_context *context, const char *list)
{
    for (const char *s = list; s; s = s[strcspn(s, ",")] ? s + strcspn(s, ",") + 1 : NULL) {
        size_t length = strcspn(s, ",");
        bool known = word_is(s, length, "auto");
        for (int k = 0; kmp_linear_name(k); k++)
            known = known || word_is(s, length, kmp_linear_name(k));
        if (!known)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown linear solver '%.*s'; available: %s", (int)length, s,
                            kmp_linear_names());
    }
    return KEMPE_OK;
}

/* Chooses methods from the lists of the options, whose names are checked; lists that are not given contain the standard
 * ones. `implicit`: integrators that use the Jacobian count as standard. KEMPE_E_ARGUMENT: the unknown name, and the
 * valid ones. */
static kempe_status choose_methods(kempe_comparison *c, const kempe_compare_options *options, bool implicit)
{
    const char *const list[PARTS] = {options->formulations, options->forms, options->integrators};
    for (part p = PART_FORMULATION; p < PARTS; p++)
        KMP_TRY(check_names(c->system->context, list[p], p));
    KMP_TRY(check_linear(c->system->context, options->linear));
    kmp_method method;
    int count = 0, solvers = 1;
    while (kmp_method_get(count, &method))
        count++;
    while (kmp_linear_name(solvers - 1))
        solvers++;
    c->method_count = 0;
    c->methods = KMP_ARENA_NEW(&c->arena, kmp_method, count * solvers);
    KMP_TRY(kmp_made(c->system->context, c->methods));
    for (int k = 0; kmp_method_get(k, &method); k++) {
        method.standard_integrator =
            method.standard_integrator || (implicit && kmp_solver_find(method.integrator)->implicit);
        if (is_chosen(&method, list))
            add_method(c, method, options->linear);
    }
    if (c->method_count > 0)
        return KEMPE_OK;
    return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                    "the requested formulations, forms and integrators cannot be combined");
}

static kempe_status choose_rtols(kempe_comparison *c, const char *list)
{
    c->rtols = KMP_ARENA_NEW(&c->arena, double, strlen(list) + 1);
    KMP_TRY(kmp_made(c->system->context, c->rtols));
    for (const char *s = list; s;) {
        double *rtol = &c->rtols[c->rtol_count++];
        size_t length = strcspn(s, ","), blank = strspn(s, " "), read = kmp_text_to_number(s + blank, rtol);
        size_t tail = strspn(s + blank + read, " ");
        if (read == 0 || blank + read + tail != length || !(*rtol > 0) || !(*rtol < 1))
            return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                            "rtol '%.*s': numbers between 0 and 1 are expected, separated by commas", (int)length, s);
        s = s[length] ? s + length + 1 : NULL;
    }
    return KEMPE_OK;
}

/* -- end --------------------------------------------------------------------------------------------- */

/* One successful run makes a comparison; without one, the first failure gives its reason. */
static kempe_status conclude(kmp_compare_job *j)
{
    kempe_comparison *c = j->comparison;
    const kmp_compared *first = NULL;
    c->status = kmp_interrupted(j->context) ? KEMPE_STOPPED : KEMPE_E_FAILED;
    for (int k = 0; k < c->count; k++) {
        if (c->runs[k].status == KEMPE_OK && c->status != KEMPE_STOPPED)
            c->status = KEMPE_OK;
        else if (c->runs[k].status != KEMPE_OK && !first)
            first = &c->runs[k];
    }
    if (c->status == KEMPE_E_FAILED && first && first->status == KEMPE_STOPPED)
        c->status = KEMPE_STOPPED;
    const char *reason = c->status == KEMPE_OK ? "" : kmp_interrupted(j->context) ? "interrupted" : "no run was made";
    if (c->status != KEMPE_OK && !kmp_interrupted(j->context) && first)
        reason = first->reason;
    c->reason = reason;
    return c->status == KEMPE_E_FAILED ? kmp_fail(j->context, c->status, "%s", c->reason) : c->status;
}

/* -- preparing --------------------------------------------------------------------------------------- */

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* Takes the given table alone: errors are judged at its rows only. */
static void take_given(kmp_compare_job *j, kmp_reference *given, const char *name)
{
    kempe_comparison *c = j->comparison;
    kmp_samples_free(&j->reference);
    j->reference = *given;
    *given = (kmp_reference){0};
    c->has_reference = true;
    c->until = c->t_end;
    c->source = kmp_arena_strdup(&c->arena, name);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        c->uncertainty[k] = 0;
}

/* A table with few rows says nothing of the time between them: there the own reference counts, if it agrees with the
 * table. */
static kempe_status extend_given(kmp_compare_job *j, kmp_reference *given, const char *name)
{
    kempe_comparison *c = j->comparison;
    double off[KMP_QUANTITIES];
    int reported = c->warnings.count;
    KMP_TRY(kmp_compare_own_reference(j, REFERENCE_PART * j->left_s, given));
    given->shared = c->shared;
    kmp_verdict_errors(&j->reference, c->system, given, INFINITY, off);
    if (c->has_reference && c->until >= c->t_end && off[KMP_QUANTITY_Q] <= AGREED) {
        c->source = kmp_arena_printf(&c->arena, "%s, which agrees to %.0e in q with the one between its rows, %s", name,
                                     off[KMP_QUANTITY_Q], c->source);
        /* Values of a given table replace those of the own reference at the same times. */
        kmp_reference *own = &j->reference;
        for (int row = 0, r = 0; row < own->rows && r < given->rows; row++) {
            if (own->t[row] < given->t[r])
                continue;
            for (int k = 0; k < KMP_QUANTITIES; k++) {
                size_t width = (size_t)(k == KMP_QUANTITY_LAMBDA ? own->m : own->n);
                for (size_t i = 0; i < width; i++) {
                    double x = given->value[k][(size_t)r * width + i], *place = &own->value[k][(size_t)row * width + i];
                    *place = isnan(x) ? *place : x;
                }
            }
            r++;
        }
        return KEMPE_OK;
    }
    c->warnings.count = reported;
    if (c->has_reference && off[KMP_QUANTITY_Q] > AGREED)
        kmp_sentences_add(&c->arena, &c->warnings, "Kempe's own reference differs by %.1g in q from %s",
                          off[KMP_QUANTITY_Q], name);
    kmp_sentences_add(&c->arena, &c->warnings,
                      "errors are judged at the rows of %s only: between them they may be larger", name);
    take_given(j, given, name);
    return KEMPE_OK;
}

static kempe_status use_reference(kmp_compare_job *j, const char *path)
{
    kempe_comparison *c = j->comparison;
    kmp_reference given = {0};
    kempe_status status = KEMPE_OK;
    if (!path)
        return kmp_compare_own_reference(j, REFERENCE_PART * j->left_s, NULL);
    KMP_TRY(kmp_reference_read(c->system, path, &given));
    kmp_samples_limit(&given, c->t_end);
    if (given.rows < MANY_ROWS)
        status = extend_given(j, &given, base_name(path));
    else
        take_given(j, &given, base_name(path));
    kmp_samples_free(&given);
    j->reference.shared = c->shared;
    return status == KEMPE_OK && !c->source ? kmp_fail_memory(j->context) : status;
}

/* The options are judged before anything is computed. */
static kempe_status prepare(kmp_compare_job *j, const kempe_compare_options *options)
{
    kempe_comparison *c = j->comparison;
    KMP_TRY(choose_methods(c, options, false));
    KMP_TRY(choose_rtols(c, options->rtols ? options->rtols : default_rtols));
    double budget_s = options->budget_s;
    if (!(budget_s >= 0) || isinf(budget_s))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "budget_s = %g: a positive number is expected", budget_s);
    j->comparison->budget_s = j->left_s = budget_s > 0 ? budget_s : BUDGET;
    const kmp_method *method = &j->comparison->methods[0];
    kmp_run_spec spec = {.formulation = method->formulation,
                         .form = method->form,
                         .integrator = method->integrator,
                         .t_end = options->t_end};
    if (!(options->t_end >= 0) || isinf(options->t_end))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end = %g: a positive number is expected", options->t_end);
    KMP_TRY(kmp_run_resolve(j->comparison->system, &spec));
    if (!(spec.t_end > 0))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end is missing: give it in the model or as an option");
    j->comparison->t_end = j->comparison->until = spec.t_end;
    j->eval = kmp_eval_new(j->comparison->system, spec.backend);
    KMP_TRY(j->eval ? KEMPE_OK : KEMPE_E_MEMORY);
    KMP_TRY(kempe_assembly_new(c->system, &j->start));
    /* A stiff model is also run with implicit integrators, unless the user chose others. */
    bool stiff = false;
    if (!options->integrators) {
        KMP_TRY(kmp_compare_probe(j, &stiff));
        KMP_TRY(stiff ? choose_methods(c, options, true) : KEMPE_OK);
    }
    /* Finds multipliers that redundant rows leave undetermined: their errors are undefined, which the report states. */
    const double *q = j->start->inner_q ? j->start->inner_q : j->start->q;
    int count = 0;
    c->shared = KMP_ARENA_NEW(&c->arena, bool, c->system->m);
    KMP_TRY(kmp_made(j->context, c->shared));
    if (j->start->chart)
        kmp_eval_set_charts(j->eval, j->start->chart);
    KMP_TRY(kmp_find_shared(j->eval, 0, q, c->shared, &count));
    if (count > 0)
        kmp_sentences_add(&c->arena, &c->warnings,
                          "%d of %d multipliers are not unique because of redundant rows: their errors are omitted "
                          "('kempe check' lists them)",
                          count, c->system->m);
    KMP_TRY(use_reference(j, options->reference));
    kmp_context_clear(j->context);
    if (!kmp_times_init(&j->times, c->t_end, c->t_end, c->has_reference ? &j->reference : NULL) ||
        !kmp_times_init(&j->few, c->t_end / FEW, c->t_end, NULL))
        return kmp_fail_memory(j->context);
    if (c->has_reference)
        c->scales = kmp_verdict_scales(c->system, &j->reference);
    for (int k = 0; c->has_reference && k < j->reference.rows; k++)
        c->instants += j->reference.t[k] <= c->until;
    return KEMPE_OK;
}

/* -- the comparison ---------------------------------------------------------------------------------- */

static kempe_status compare(kmp_compare_job *j, const kempe_compare_options *options)
{
    kempe_comparison *c = j->comparison;
    KMP_TRY(prepare(j, options));
    /* Repeats the warnings of the start. */
    char *lines = kmp_context_warnings(j->context);
    for (const char *at = lines; at && *at; at += strcspn(at, "\n") + 1)
        kmp_sentences_add(&c->arena, &c->warnings, "%.*s", (int)strcspn(at, "\n"), at);
    kmp_free(lines);
    KMP_TRY(lines ? KEMPE_OK : kmp_fail_memory(j->context));
    KMP_TRY(kmp_compare_run_all(j));
    kmp_compare_levels(c);
    if (!c->arena.failed) {
        kmp_compare_tables(c);
        kmp_compare_remark(c);
        kmp_compare_advise(c);
    }
    return c->arena.failed ? kmp_fail_memory(j->context) : conclude(j);
}

kempe_status kmp_compare(const kempe_system *system, const kempe_compare_options *options,
                         kempe_comparison **comparison)
{
    KMP_OPTIONS(system->context, kempe_compare_options, options);
    kempe_comparison *c = KMP_NEW(kempe_comparison, 1);
    kmp_compare_job j = {.comparison = c, .context = system->context};
    KMP_TRY(kmp_made(j.context, c));
    *c = (kempe_comparison){
        .system = system, .source = "none", .amplification = NAN, .advice = {.run = -1, .level = NAN}};
    kempe_status status = compare(&j, options);
    if (status == KEMPE_E_FAILED && !c->reason) { /* it cannot be assembled: message and result give the reason */
        c->status = status;
        c->reason = kmp_arena_strdup(&c->arena, kempe_context_message(j.context));
    }
    if (c->arena.failed)
        status = kmp_fail_memory(j.context);
    kempe_assembly_free(j.start);
    kmp_eval_free(j.eval);
    kmp_samples_free(&j.reference);
    kmp_times_free(&j.times);
    kmp_times_free(&j.few);
    status = kmp_context_verdict(j.context, status);
    c->status = status == KEMPE_UNTRUSTED ? status : c->status;
    if (kmp_has_result(status))
        *comparison = c;
    else
        kempe_comparison_free(c);
    return status;
}

KMP_FREES(kempe_comparison, comparison, kmp_arena_free(&comparison->arena))
