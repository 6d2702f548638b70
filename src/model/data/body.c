/* SPDX-License-Identifier: BSD-3-Clause */
/* Motions by their numbers, and the tree of the bodies. */
#include "model/data/body.h"
#include "model/data/model.h"

const kmp_motion *kmp_model_motion(const kempe_model *model, int k)
{
    return &model->motions[k];
}

int kmp_model_common_body(const kempe_model *model, int a, int b)
{
    while (a != b)
        if (a > b)
            a = model->bodies[a].parent;
        else
            b = model->bodies[b].parent;
    return a;
}
