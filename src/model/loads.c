/* SPDX-License-Identifier: BSD-3-Clause */
/* Which forces depend on what closures transmit. */
#include "model/model.h"

const kmp_expr *kmp_force_lambda(const kmp_force *force)
{
    const kmp_expr *found = kmp_expr_lambda(force->effort);
    for (int k = 0; !found && k < 3; k++)
        found = kmp_expr_lambda(force->vector[k]);
    return found;
}

bool kmp_model_has_loads(const kempe_model *model)
{
    for (int k = 0; k < model->force_count; k++)
        if (kmp_force_lambda(&model->forces[k]))
            return true;
    for (int k = 0; k < model->sensor_count; k++)
        if (kmp_expr_lambda(model->sensors[k].expr))
            return true;
    for (int k = 0; k < model->wheel_count; k++)
        if (model->wheels[k].form == KMP_CONTACT_RIGID)
            return true;
    return false;
}
