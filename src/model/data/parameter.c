/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters by their numbers, and the number of inputs. */
#include "model/data/parameter.h"
#include "model/data/model.h"

const kmp_parameter *kmp_model_parameter(const kempe_model *model, int k)
{
    return &model->parameters[k];
}

int kmp_model_parameter_count(const kempe_model *model)
{
    return model->parameter_count;
}

int kmp_model_all_inputs(const kempe_model *model)
{
    return model->input_count;
}

int kmp_model_delay_count(const kempe_model *model)
{
    return model->delay_count;
}
