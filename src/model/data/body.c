/* SPDX-License-Identifier: BSD-3-Clause */
/* Motions, bodies and points by their numbers, and the tree of the bodies. */
#include "model/data/body.h"
#include "model/data/model.h"

const kmp_motion *kmp_model_motion(const kempe_model *model, int k)
{
    return &model->motions[k];
}

const kmp_body *kmp_model_body(const kempe_model *model, int body)
{
    return &model->bodies[body];
}

const kmp_point *kmp_model_point(const kempe_model *model, int point)
{
    return &model->points[point];
}

int kmp_model_motion_count(const kempe_model *model)
{
    return model->motion_count;
}

int kmp_model_body_count(const kempe_model *model)
{
    return model->body_count;
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
