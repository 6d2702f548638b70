/* SPDX-License-Identifier: BSD-3-Clause */
/* Comma-separated lists of formulations, forms, integrators and tolerances, compared with the table of methods. */
#include "integrators/steppers/solver.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <string.h>

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

static bool is_known(const char *s, size_t length, part p)
{
    kmp_method method;
    for (int k = 0; kmp_method_get(k, &method); k++)
        if (length > 0 && word_is(s, length, part_of(&method, p)))
            return true;
    return false;
}

static kempe_status check_names(kempe_context *context, const char *list, part p)
{
    for (const char *s = list; s;) {
        size_t length = strcspn(s, ",");
        if (!is_known(s, length, p)) {
            kmp_text sentence = {0};
            kmp_text_printf(&sentence, "unknown %s '%.*s'; available: ", part_name[p], (int)length, s);
            /* Each name of the table once. */
            kmp_method method, before;
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

/* Methods run in addition to the standard ones when neither a form nor an integrator is given. */
static const kmp_method besides[] = {{.formulation = "reduced", .form = "integrated", .integrator = "dopri5"}};

static bool is_beside(const kmp_method *method)
{
    for (size_t k = 0; k < sizeof besides / sizeof *besides; k++) {
        bool same = true;
        for (part p = PART_FORMULATION; p < PARTS; p++)
            same = same && strcmp(part_of(method, p), part_of(&besides[k], p)) == 0;
        if (same)
            return true;
    }
    return false;
}

/* True if the method is selected. Forms and integrators that are not given by name must be standard ones. */
static bool is_chosen(const kmp_method *method, const char *const list[PARTS])
{
    return list_has(list[PART_FORMULATION], method->formulation) && list_has(list[PART_FORM], method->form) &&
           list_has(list[PART_INTEGRATOR], method->integrator) && (list[PART_FORM] || method->standard_form) &&
           (list[PART_INTEGRATOR] || method->standard_integrator ||
            (!list[PART_FORM] && !list[PART_INTEGRATOR] && is_beside(method)));
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

/* Chooses methods; `implicit`: integrators that use the Jacobian count as standard. */
static kempe_status choose_methods(kempe_comparison *c, const char *const list[PARTS], const char *linear,
                                   bool implicit)
{
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
            add_method(c, method, linear);
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

kempe_status kmp_compare_choose(kempe_comparison *c, const kempe_compare_options *options)
{
    const char *const list[PARTS] = {options->formulations, options->forms, options->integrators};
    for (part p = PART_FORMULATION; p < PARTS; p++)
        KMP_TRY(check_names(c->system->context, list[p], p));
    KMP_TRY(check_linear(c->system->context, options->linear));
    KMP_TRY(choose_methods(c, list, options->linear, false));
    return choose_rtols(c, options->rtols ? options->rtols : default_rtols);
}

kempe_status kmp_compare_add_implicit(kempe_comparison *c, const kempe_compare_options *options)
{
    const char *const list[PARTS] = {options->formulations, options->forms, options->integrators};
    return choose_methods(c, list, options->linear, true);
}
