/* SPDX-License-Identifier: BSD-3-Clause */
/* Which road, form, integrator, linear solver and back end go together, and what a run takes when nobody says. */
#include "backend/machine.h"
#include "integrators/road.h"
#include "integrators/run.h"
#include "integrators/solver.h"
#include <math.h>
#include <string.h>

static const kmp_road_kind *const roads[] = {
#define KMP_ROAD(id) &kmp_road_##id,
#include "integrators/roads.def"
#undef KMP_ROAD
};

enum { ROADS = sizeof roads / sizeof *roads };

static bool fits(const kmp_road_kind *road, const kmp_solver_kind *solver)
{
    bool same = road->dae == solver->dae || (road->both && solver->dae);
    return same && (solver->corrects || !road->corrected) && (!solver->implicit || road->jacobian);
}

bool kmp_way_get(int k, kmp_way *way)
{
    for (int r = 0; r < (int)ROADS; r++)
        for (int i = 0; kmp_solver_get(i); i++)
            if (fits(roads[r], kmp_solver_get(i)) && k-- == 0) {
                const kmp_solver_kind *solver = kmp_solver_get(i);
                *way = (kmp_way){roads[r]->road, roads[r]->form, solver->name, roads[r]->standard,
                                 solver->standard && roads[r]->dae == solver->dae};
                return true;
            }
    return false;
}

const kmp_road_kind *kmp_road_get(int k)
{
    return k >= 0 && k < (int)ROADS ? roads[k] : NULL;
}

const kmp_road_kind *kmp_road_find(const char *road, const char *form)
{
    for (int k = 0; k < (int)ROADS; k++)
        if (strcmp(roads[k]->road, road) == 0 && (!form || strcmp(roads[k]->form, form) == 0))
            return roads[k];
    return NULL;
}

/* -- complaints: the name, and what there is --------------------------------------------------------- */

enum { ROAD, FORM, INTEGRATOR };

/* The names of one part among the ways of a road and form (NULL: any), each once, in order. */
static kempe_status unknown(const kempe_system *system, const char *what, const char *name, int part, const char *road,
                            const char *form)
{
    kmp_text known = {0};
    kmp_way way;
    for (int k = 0; kmp_way_get(k, &way); k++) {
        if ((road && strcmp(way.road, road) != 0) || (form && strcmp(way.form, form) != 0))
            continue;
        const char *one = (const char *const[]){way.road, way.form, way.integrator}[part];
        if (!known.s || !strstr(known.s, one))
            kmp_text_printf(&known, "%s%s", known.length ? ", " : "", one);
    }
    kempe_status status = kmp_fail(system->context, KEMPE_E_ARGUMENT, "%s '%s' is unknown%s%s%s; there is: %s", what,
                                   name, road ? " on the road " : "", road ? road : "",
                                   form && road ? " in this form" : "", known.s ? known.s : "");
    kmp_text_free(&known);
    return status;
}

/* -- defaults ---------------------------------------------------------------------------------------- */

static const char *or_default(const char *asked, const char *otherwise)
{
    return asked ? asked : otherwise;
}

static const char *first_integrator(const kmp_road_kind *road)
{
    for (int i = 0; kmp_solver_get(i); i++)
        if (fits(road, kmp_solver_get(i)))
            return kmp_solver_get(i)->name;
    return "";
}

/* The model's form and integrator belong to the model's road. */
static kempe_status resolve_way(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_run_settings *model = &system->model->run;
    spec->open = !spec->road && !model->road && !spec->form && !model->form && !spec->fixed_u;
    bool own_road = !spec->road || (model->road && strcmp(spec->road, model->road) == 0);
    spec->road = or_default(spec->road, or_default(model->road, "reduced"));
    if (!kmp_road_find(spec->road, NULL))
        return unknown(system, "road", spec->road, ROAD, NULL, NULL);
    if (own_road) {
        bool own_form = !spec->form || (model->form && strcmp(spec->form, model->form) == 0);
        spec->form = or_default(spec->form, model->form);
        spec->integrator = own_form ? or_default(spec->integrator, model->integrator) : spec->integrator;
    }
    /* An integrator alone chooses the first form that it fits. */
    const kmp_solver_kind *solver = spec->integrator ? kmp_solver_find(spec->integrator) : NULL;
    for (int k = 0; solver && !spec->form && k < (int)ROADS; k++)
        if (strcmp(roads[k]->road, spec->road) == 0 && fits(roads[k], solver))
            spec->form = roads[k]->form;
    const kmp_road_kind *kind = kmp_road_find(spec->road, spec->form);
    if (!kind)
        return unknown(system, "form", spec->form, FORM, spec->road, NULL);
    spec->form = kind->form;
    spec->integrator = or_default(spec->integrator, first_integrator(kind));
    solver = kmp_solver_find(spec->integrator);
    if (!solver || !fits(kind, solver))
        return unknown(system, "integrator", spec->integrator, INTEGRATOR, spec->road, spec->form);
    return KEMPE_OK;
}

static kempe_status resolve_tools(const kempe_system *system, kmp_run_spec *spec)
{
    spec->linear = or_default(spec->linear, "auto");
    spec->backend = or_default(spec->backend, kmp_backend_default());
    if (!kmp_linear_known(spec->linear))
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "linear solver '%s' is unknown; there is: %s", spec->linear,
                        kmp_linear_names());
    if (!kmp_backend_find(spec->backend))
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "back end '%s' is unknown; there is: %s", spec->backend,
                        kmp_backend_names());
    return KEMPE_OK;
}

static kempe_status resolve_change_points(const kempe_system *system, kmp_run_spec *spec)
{
    kmp_text complaint = {0};
    spec->change_points = or_default(spec->change_points, kmp_change_points_word(system->model->run.change_points));
    kempe_status status = kmp_change_points_find(spec->change_points, &complaint) < KMP_CHANGE_POINTS_COUNT
                              ? KEMPE_OK
                              : kmp_fail(system->context, KEMPE_E_ARGUMENT, "%s", complaint.s ? complaint.s : "");
    kmp_text_free(&complaint);
    return status;
}

static double first_positive(double a, double b, double c)
{
    return a > 0 ? a : b > 0 ? b : c;
}

static kempe_status resolve_numbers(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_run_settings *model = &system->model->run;
    double asked = spec->rtol;
    if (spec->rtol < 0 || spec->atol < 0 || spec->t_end < 0 || isnan(spec->rtol + spec->atol + spec->t_end))
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "tolerances and t_end must be positive");
    spec->rtol = first_positive(spec->rtol, model->rtol, 1e-8);
    if (spec->rtol < 1e-15 || spec->rtol > 0.1)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "rtol = %g is outside 1e-15 .. 0.1", spec->rtol);
    spec->atol = first_positive(spec->atol, asked > 0 ? 0 : model->atol, spec->rtol);
    spec->t_end = first_positive(spec->t_end, model->t_end, 1);
    spec->max_steps = spec->max_steps ? spec->max_steps : model->max_steps;
    if (spec->u_count == 0) {
        spec->u = model->u;
        spec->u_count = model->u_count;
    }
    return KEMPE_OK;
}

kempe_status kmp_run_resolve(const kempe_system *system, kmp_run_spec *spec)
{
    kempe_status status = resolve_way(system, spec);
    if (status == KEMPE_OK)
        status = resolve_tools(system, spec);
    if (status == KEMPE_OK)
        status = resolve_change_points(system, spec);
    return status == KEMPE_OK ? resolve_numbers(system, spec) : status;
}
