/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures by their numbers. */
#include "model/data/closure.h"
#include "model/data/model.h"

const kmp_closure *kmp_model_closure(const kempe_model *model, int k)
{
    return &model->closures[k];
}

int kmp_model_closure_count(const kempe_model *model)
{
    return model->closure_count;
}
