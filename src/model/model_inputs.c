/* SPDX-License-Identifier: BSD-3-Clause */
/* The public names and values of a model's inputs. */
#include "model/model.h"
#include <kempe/settings.h>
#include <math.h>

static const kmp_model_input *input_at(const kempe_model *model, int input)
{
    return model && input >= 0 && input < model->input_count ? &model->inputs[input] : NULL;
}

int kempe_model_input_count(const kempe_model *model)
{
    return model ? model->input_count : 0;
}

int kempe_model_input_find(const kempe_model *model, const char *name)
{
    return model && name ? kmp_name_find(KMP_NAMED(model, input), name) : -1;
}

const char *kempe_model_input_name(const kempe_model *model, int input)
{
    const kmp_model_input *found = input_at(model, input);
    return found ? found->name : NULL;
}

const char *kempe_model_input_unit(const kempe_model *model, int input)
{
    const kmp_model_input *found = input_at(model, input);
    return found ? found->unit : "";
}

double kempe_model_input_value(const kempe_model *model, int input, double t)
{
    const kmp_model_input *found = input_at(model, input);
    return found ? kmp_signal_value(&found->signal, t) : NAN;
}
