/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/compliant.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include <math.h>

double kmp_force_clearance(const kempe_model *model, const kmp_force *force)
{
    const kmp_expr *clearance =
        force->kind == KMP_FORCE_COMPLIANT ? force->compliant->clearance : force->touch.clearance;
    double *parameters = clearance ? KMP_NEW(double, model->parameter_count + 1) : NULL, c = NAN;
    for (int k = 0; parameters && k < model->parameter_count; k++)
        parameters[k] = model->parameters[k].number.value;
    if (parameters)
        c = kmp_expr_value(clearance, parameters);
    kmp_free(parameters);
    return c;
}

double kmp_compliant_depth(const kempe_model *model, const kmp_force *force, double value)
{
    double c = kmp_force_clearance(model, force);
    return isnan(c) ? value : sqrt(c * (c + 2 * value)) - c;
}
