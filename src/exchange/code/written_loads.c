/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/written_loads.h"
#include "base/context.h"
#include "dynamics/load_dependent.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/read/loads.h"

bool kmp_uses_drives(const kempe_model *model)
{
    bool used = false;
    for (int c = 0; c < model->closure_count; c++) {
        if (!kmp_closure_is_drive(&model->closures[c]))
            continue;
        for (int k = 0; k < model->force_count; k++)
            used = used || kmp_force_depends_on_closure(&model->forces[k], c);
        for (int k = 0; k < model->sensor_count; k++)
            used = used || kmp_depends_on_closure(model->sensors[k].expr, c);
        for (const kmp_output *o = model->outputs; o < model->outputs + model->output_count; o++)
            used = used || (o->index == c && (o->kind == KMP_OUTPUT_REACTION || o->kind == KMP_OUTPUT_MOMENT));
    }
    return used;
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
