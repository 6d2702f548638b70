/* SPDX-License-Identifier: BSD-3-Clause */
/* Finds the force that depends on multipliers, and rejects analyses that do not support one. */
#include "dynamics/load_dependent.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <math.h>
#include <string.h>

static bool depends_on(const kmp_expr *e, int closure)
{
    if (!e || e->kind == KMP_EXPR_LAMBDA)
        return e && closure >= e->index && closure < e->index + (e->number < 0 ? -e->number : 1);
    return depends_on(e->a, closure) || depends_on(e->b, closure) || depends_on(e->c, closure);
}

static bool force_depends_on(const kmp_force *force, int closure)
{
    bool any = depends_on(force->effort, closure) || depends_on(force->holding_effort, closure);
    for (int k = 0; k < 3; k++)
        any = any || depends_on(force->vector[k], closure);
    return any;
}

bool kmp_uses_drives(const kempe_model *model)
{
    bool used = false;
    for (int c = 0; c < model->closure_count; c++) {
        if (!kmp_closure_is_drive(&model->closures[c]))
            continue;
        for (int k = 0; k < model->force_count; k++)
            used = used || force_depends_on(&model->forces[k], c);
        for (int k = 0; k < model->sensor_count; k++)
            used = used || depends_on(model->sensors[k].expr, c);
        for (const kmp_output *o = model->outputs; o < model->outputs + model->output_count; o++)
            used = used || (o->index == c && (o->kind == KMP_OUTPUT_REACTION || o->kind == KMP_OUTPUT_MOMENT));
    }
    return used;
}

const char *kmp_load_dependent_force(const kempe_system *s, int row)
{
    const kempe_model *model = s->model;
    int closure = s->rows[row].closure;
    for (int k = 0; k < model->force_count; k++)
        if (force_depends_on(&model->forces[k], closure))
            return model->forces[k].name;
    return model->closures[closure].name; /* a force of that name belongs to its kind */
}

static bool is_wheel(const kempe_model *model, const char *name)
{
    for (int k = 0; k < model->wheel_count; k++)
        if (strcmp(model->wheels[k].name, name) == 0)
            return true;
    return false;
}

kempe_status kmp_refuse_samples(const kempe_model *model, const char *what, bool held)
{
    for (int k = 0; k < model->state_count; k++) {
        const kmp_state *state = &model->states[k];
        if (!state->next || (held && isinf(state->period)))
            continue;
        if (isinf(state->period))
            return kmp_fail(
                model->context, KEMPE_E_ARGUMENT,
                "%s: the state '%s' changes at events, which is not supported there; write its value in the "
                "expressions that have it",
                what, state->name);
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "%s: the state '%s' is sampled, which is not supported there; give it a "
                        "rate, or write its value in the expressions that have it",
                        what, state->name);
    }
    return KEMPE_OK;
}

kempe_status kmp_refuse_delays(const kempe_model *model, const char *what, const char *remedy)
{
    for (int k = 0; k < model->state_count; k++)
        if (model->states[k].delayed)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: the state '%s' is a delayed signal, which is not supported there; %s", what,
                            model->states[k].name, remedy);
    return KEMPE_OK;
}

kempe_status kmp_refuse_load_dependent(const kempe_system *s, const char *what)
{
    if (s->load_row_count == 0)
        return KEMPE_OK;
    const char *force = kmp_load_dependent_force(s, s->load_rows[0]);
    return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                    "%s: force '%s' depends on the multiplier of closure row '%s', which is not supported there; %s",
                    what, force, s->row_names[s->load_rows[0]],
                    is_wheel(s->model, force) ? "use elastic contact" : "give it a law without lambda");
}

kempe_status kmp_refuse_friction(const kempe_model *model, const char *what)
{
    for (int k = 0; k < model->force_count; k++)
        if (kmp_force_sticks(&model->forces[k]))
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: friction '%s' sticks and slips by modes that a run decides; give it a 'speed' to "
                            "regularise it",
                            what, model->forces[k].name);
    return KEMPE_OK;
}

kempe_status kmp_refuse_contacts(const kempe_model *model, const char *what)
{
    for (int k = 0; k < model->force_count; k++)
        if (model->forces[k].kind == KMP_FORCE_TOUCH)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: the contact '%s' opens and closes, which is not supported there; leave the section "
                            "'contacts' out",
                            what, model->forces[k].name);
    return KEMPE_OK;
}

kempe_status kmp_refuse_load_dependent_model(const kempe_model *model, const char *what)
{
    for (int k = 0; k < model->force_count; k++) {
        const kmp_expr *lambda = kmp_force_lambda(&model->forces[k]);
        if (lambda)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: force '%s' depends on lambda(%s), which these equations do not solve for; give it a "
                            "law without lambda",
                            what, model->forces[k].name, model->closures[lambda->index].name);
        if (kmp_force_has_load(&model->forces[k]))
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: the level of friction '%s' depends on the force of its contact, which these equations "
                            "do not solve for; leave its 'friction' out",
                            what, model->forces[k].name);
    }
    for (int k = 0; k < model->wheel_count; k++)
        if (model->wheels[k].form == KMP_CONTACT_RIGID && model->wheels[k].law != KMP_CREEP_NONE)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: the creep forces of wheel '%s' depend on its normal force, lambda(%s), which these "
                            "equations do not solve for; use 'contact: elastic' or 'creep: none'",
                            what, model->wheels[k].name, model->wheels[k].name);
    return KEMPE_OK;
}
