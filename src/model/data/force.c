/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces by their numbers. */
#include "model/data/force.h"
#include "model/data/model.h"

const kmp_force *kmp_model_force(const kempe_model *model, int k)
{
    return &model->forces[k];
}

int kmp_model_force_count(const kempe_model *model)
{
    return model->force_count;
}
