/* SPDX-License-Identifier: BSD-3-Clause */
/* The motions and the forces of a model that belong to its states: the last ones of each. */
#include "model/data/state.h"
#include "model/data/model.h"

int kmp_model_coordinates(const kempe_model *model)
{
    return model->motion_count - model->state_count;
}

const kmp_state *kmp_state_of(const kempe_model *model, int k)
{
    int first = kmp_model_coordinates(model);
    return k >= first ? &model->states[k - first] : NULL;
}

bool kmp_model_has_samples(const kempe_model *model)
{
    bool found = false;
    for (int k = 0; k < model->state_count; k++)
        found = found || model->states[k].next;
    return found;
}

const kmp_expr *kmp_state_rate(const kempe_model *model, int k)
{
    return model->forces[model->force_count - model->state_count + k].effort;
}

const kmp_state *kmp_model_state(const kempe_model *model, int k)
{
    return &model->states[k];
}

int kmp_model_state_count(const kempe_model *model)
{
    return model->state_count;
}
