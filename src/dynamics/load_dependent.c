/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/load_dependent.h"
#include "model/data/model.h"

bool kmp_depends_on_closure(const kmp_expr *e, int closure)
{
    if (!e || e->kind == KMP_EXPR_LAMBDA)
        return e && closure >= e->index && closure < e->index + (e->number < 0 ? -e->number : 1);
    return kmp_depends_on_closure(e->a, closure) || kmp_depends_on_closure(e->b, closure) ||
           kmp_depends_on_closure(e->c, closure);
}

bool kmp_force_depends_on_closure(const kmp_force *force, int closure)
{
    bool any = kmp_depends_on_closure(force->effort, closure) || kmp_depends_on_closure(force->holding_effort, closure);
    for (int k = 0; k < 3; k++)
        any = any || kmp_depends_on_closure(force->vector[k], closure);
    return any;
}

const char *kmp_load_dependent_force(const kempe_system *s, int row)
{
    const kempe_model *model = s->model;
    int closure = s->rows[row].closure;
    for (int k = 0; k < model->force_count; k++)
        if (kmp_force_depends_on_closure(&model->forces[k], closure))
            return model->forces[k].name;
    return model->closures[closure].name; /* a force of that name belongs to its kind */
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
