/* SPDX-License-Identifier: BSD-3-Clause */
/* Valid combinations of formulation, form, integrator, linear solver and back end, and the defaults of a run. */
#include "integrators/run/methods.h"
#include "backend/encoders.h"
#include "backend/machine.h"
#include "constraints/programs/saddle_program.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/run.h"
#include "integrators/steppers/solver.h"
#include "integrators/sundials/linear.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

static const kmp_formulation_kind *const formulations[] = {
#define KMP_FORMULATION(id) &kmp_formulation_##id,
#include "integrators/formulations/formulations.def"
#undef KMP_FORMULATION
};

enum { FORMULATIONS = sizeof formulations / sizeof *formulations };

static bool fits(const kmp_formulation_kind *formulation, const kmp_solver_kind *solver)
{
    bool same =
        formulation->dae == solver->dae || (formulation->both && solver->dae) || (formulation->solved && solver->lanes);
    return same && (solver->corrects || !formulation->corrected) && (!solver->implicit || formulation->jacobian);
}

bool kmp_method_get(int k, kmp_method *method)
{
    for (int r = 0; r < (int)FORMULATIONS; r++)
        for (int i = 0; kmp_solver_get(i); i++) {
            const kmp_formulation_kind *kind = formulations[r];
            const kmp_solver_kind *solver = kmp_solver_get(i);
            if (!fits(kind, solver) || k-- != 0)
                continue;
            /* An integrator of several stages at once is standard where the formulation evaluates them together. */
            bool solved = kind->solved && solver->lanes, lanes = !solver->lanes || kind->in_lanes || solved;
            *method = (kmp_method){.formulation = kind->formulation,
                                   .form = kind->form,
                                   .integrator = solver->name,
                                   .standard_form = kind->standard || solved,
                                   .standard_integrator = solver->standard && lanes};
            return true;
        }
    return false;
}

const kmp_formulation_kind *kmp_formulation_get(int k)
{
    return k >= 0 && k < (int)FORMULATIONS ? formulations[k] : NULL;
}

const kmp_formulation_kind *kmp_formulation_find(const char *formulation, const char *form)
{
    for (int k = 0; k < (int)FORMULATIONS; k++)
        if (strcmp(formulations[k]->formulation, formulation) == 0 &&
            (!form || strcmp(formulations[k]->form, form) == 0))
            return formulations[k];
    return NULL;
}

/* -- messages: the unknown name, and the known ones ---------------------------------------------------- */

enum { FORMULATION, FORM, INTEGRATOR };

/* Reports an unknown name, with the names of one part among the methods of a formulation and form (NULL: any), each
 * once, in order. */
static kempe_status unknown(const kempe_system *system, int part, const char *name, const char *formulation,
                            const char *form)
{
    static const char *const words[] = {[FORMULATION] = "formulation", [FORM] = "form", [INTEGRATOR] = "integrator"};
    kmp_text known = {0};
    kmp_method method;
    for (int k = 0; kmp_method_get(k, &method); k++) {
        if ((formulation && strcmp(method.formulation, formulation) != 0) || (form && strcmp(method.form, form) != 0))
            continue;
        const char *one = (const char *const[]){method.formulation, method.form, method.integrator}[part];
        if (!known.s || !strstr(known.s, one))
            kmp_text_printf(&known, "%s%s", known.length ? ", " : "", one);
    }
    kempe_status status =
        kmp_fail(system->context, KEMPE_E_ARGUMENT, "unknown %s '%s'%s%s%s; available: %s", words[part], name,
                 formulation ? " for the formulation " : "", formulation ? formulation : "",
                 form && formulation ? " in this form" : "", known.s ? known.s : "");
    kmp_text_free(&known);
    return status;
}

static const char AUTO[] = "auto";

/* -- defaults ---------------------------------------------------------------------------------------- */

static const char *or_default(const char *requested, const char *otherwise)
{
    return requested ? requested : otherwise;
}

static const char *first_integrator(const kmp_formulation_kind *formulation, bool lanes)
{
    for (int i = 0; kmp_solver_get(i); i++) {
        const kmp_solver_kind *solver = kmp_solver_get(i);
        if (fits(formulation, solver) && (lanes ? solver->lanes : formulation->dae == solver->dae))
            return solver->name;
    }
    return "";
}

static bool ignores_change_points(const kmp_run_spec *spec)
{
    return kmp_change_points_find(spec->change_points, NULL) == KMP_CHANGE_POINTS_IGNORE;
}

/* The reason against radau for a form of lanes; .because NULL: there is none. Linear solvers belong to DAEs in
 * residual form. The stages of a step on both sides of a change point that is ignored do not converge. */
static kmp_integrator_reason reason_against_lanes(const kempe_system *system, const kmp_run_spec *spec, bool dae)
{
    if (spec->linear && dae)
        return (kmp_integrator_reason){.because = "a linear solver is given, and radau uses none"};
    if (ignores_change_points(spec))
        return (kmp_integrator_reason){.because = "a step of radau cannot extend over a change point that is ignored"};
    if (spec->fixed_step > 0)
        return (kmp_integrator_reason){.because = "the steps of radau have no constant length"};
    const char *obstacle = system->force              ? "the model has user-defined forces"
                           : kmp_code_form_of(8) != 0 ? kmp_saddle_program_obstacle(system, system->n + system->m)
                                                      : "this machine has no vector registers of four or eight doubles";
    return (kmp_integrator_reason){.because = obstacle ? "radau would evaluate the stages of a step one by one" : NULL,
                                   .obstacle = obstacle};
}

/* The integrator, and the form if that is open too, where the user chose no integrator. */
static void choose_integrator(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_formulation_kind *first = NULL; /* the first form whose default evaluates several stages at once */
    for (int k = 0; !first && k < (int)FORMULATIONS; k++)
        if (formulations[k]->lanes_first && strcmp(formulations[k]->formulation, spec->formulation) == 0)
            first = formulations[k];
    const kmp_formulation_kind *kind = kmp_formulation_find(spec->formulation, spec->form);
    bool fits_lanes = first && (!spec->form || kind == first), lanes = false;
    if (fits_lanes) {
        spec->reason = reason_against_lanes(system, spec, kind->dae);
        lanes = !spec->reason.because;
        kind = lanes ? first : kind;
    }
    spec->form = kind->form;
    spec->integrator = first_integrator(kind, lanes);
    spec->open_integrator = kind->in_lanes && !kind->lanes_first;
    if (lanes)
        spec->reason.because = "the stages of its steps are evaluated at once, in vector registers";
    if (fits_lanes)
        spec->reason.integrator = spec->integrator;
}

/* Resolves the method. The model's form and integrator belong to the model's formulation. */
static kempe_status resolve_method(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_run_settings *model = &system->model->run;
    spec->open = !spec->formulation && !model->formulation && !spec->form && !model->form && !spec->keep_independent;
    bool own_formulation =
        !spec->formulation || (model->formulation && strcmp(spec->formulation, model->formulation) == 0);
    spec->formulation = or_default(spec->formulation, or_default(model->formulation, "reduced"));
    if (!kmp_formulation_find(spec->formulation, NULL))
        return unknown(system, FORMULATION, spec->formulation, NULL, NULL);
    if (own_formulation) {
        bool own_form = !spec->form || (model->form && strcmp(spec->form, model->form) == 0);
        spec->form = or_default(spec->form, model->form);
        spec->integrator = own_form ? or_default(spec->integrator, model->integrator) : spec->integrator;
    }
    const char *form = spec->form; /* NULL: an integrator may choose one */
    /* A given integrator without a form chooses the first form that it fits. */
    const kmp_solver_kind *solver = spec->integrator ? kmp_solver_find(spec->integrator) : NULL;
    for (int k = 0; solver && !spec->form && k < (int)FORMULATIONS; k++)
        if (strcmp(formulations[k]->formulation, spec->formulation) == 0 && fits(formulations[k], solver))
            spec->form = formulations[k]->form;
    const kmp_formulation_kind *kind = kmp_formulation_find(spec->formulation, spec->form);
    if (!kind)
        return unknown(system, FORM, spec->form, spec->formulation, NULL);
    spec->formulation = kind->formulation;
    if (!spec->integrator) {
        choose_integrator(system, spec);
        return KEMPE_OK;
    }
    spec->form = kind->form;
    spec->open_integrator = false;
    if (!solver || !fits(kind, solver))
        return unknown(system, INTEGRATOR, spec->integrator, spec->formulation, form);
    spec->integrator = solver->name;
    return KEMPE_OK;
}

static kempe_status resolve_tools(const kempe_system *system, kmp_run_spec *spec)
{
    const char *linear = or_default(spec->linear, AUTO);
    spec->linear = kmp_linear_find(linear);
    if (!spec->linear)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "unknown linear solver '%s'; available: %s", linear,
                        kmp_linear_names());
    const char *missing = kmp_linear_missing(spec->linear);
    if (missing)
        return kmp_fail(system->context, KEMPE_E_IO,
                        "linear solver '%s' cannot be loaded: %s; install it, or choose klu", spec->linear, missing);
    if (strcmp(spec->linear, AUTO) != 0 && !kmp_solver_find(spec->integrator)->sparse)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                        "linear solver '%s': integrator '%s' uses none of these, choose integrator 'ida'", spec->linear,
                        spec->integrator);
    const kmp_backend *backend = kmp_backend_choose(system->context, spec->backend);
    if (!backend)
        return KEMPE_E_ARGUMENT;
    spec->backend = backend->name;
    return KEMPE_OK;
}

static double first_positive(double a, double b, double c)
{
    return a > 0 ? a : b > 0 ? b : c;
}

static kempe_status resolve_numbers(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_run_settings *model = &system->model->run;
    const double usual = 1e-8;
    if (spec->rtol < 0 || spec->atol < 0 || spec->t_end < 0 || isnan(spec->rtol + spec->atol + spec->t_end))
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "tolerances and t_end must be positive");
    const double atol = spec->atol;
#define KMP_RUN_OPTION(name, type, key, engine, ...)                                                                   \
    KMP_RUN_IF_RUN_##engine(                                                                                           \
        KMP_RUN_IF_KEY_##key(KMP_RUN_IF_NUMBER_##type(spec->name = spec->name != 0 ? spec->name : model->name;)))
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    spec->rtol = spec->rtol > 0 ? spec->rtol : usual;
    if (spec->rtol < 1e-15 || spec->rtol > 0.1)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "rtol = %g is outside 1e-15 .. 0.1", spec->rtol);
    /* Another relative tolerance changes the absolute one in proportion: both bound one error. */
    spec->atol = first_positive(atol, model->atol * (spec->rtol / first_positive(model->rtol, usual, 0)), spec->rtol);
    if (spec->fixed_step > 0 && !kmp_solver_find(spec->integrator)->constant)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                        "integrator '%s' cannot make steps of constant length; dop853 and dopri5 can",
                        spec->integrator);
    spec->t_end = spec->t_end > 0 ? spec->t_end : 1;
    if (spec->u_count == 0) {
        spec->u = model->independent;
        spec->u_count = model->independent_count;
    }
    return KEMPE_OK;
}

kempe_status kmp_run_resolve(const kempe_system *system, kmp_run_spec *spec)
{
    kmp_text complaint = {0};
    kmp_change_points word = system->model->run.change_points;
    if (spec->change_points)
        word = kmp_change_points_find(spec->change_points, &complaint);
    if (word == KMP_CHANGE_POINTS_COUNT)
        return kmp_fail_text(system->context, KEMPE_E_ARGUMENT, &complaint);
    spec->change_points = kmp_change_points_word(word);
    KMP_TRY(resolve_method(system, spec));
    KMP_TRY(resolve_tools(system, spec));
    if (ignores_change_points(spec) || spec->fixed_step > 0)
        spec->open_integrator = false;
    return resolve_numbers(system, spec);
}
