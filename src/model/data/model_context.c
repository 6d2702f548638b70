/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/model_context.h"
#include "base/context.h"
#include "model/data/model.h"

kempe_context *kmp_model_context(const kempe_model *model)
{
    return model->context;
}

kempe_status kmp_model_check_finished(const kempe_model *model)
{
    if (!model->builder)
        return KEMPE_OK;
    return kmp_fail(model->context, KEMPE_E_ARGUMENT, "model '%s' is not finished: call kempe_model_finish first",
                    model->name);
}
