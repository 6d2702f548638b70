/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/start.h"
#include "model/data/model.h"

const kmp_start *kmp_model_start(const kempe_model *model)
{
    return &model->start;
}
