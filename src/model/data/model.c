/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/model.h"
#include "base/context.h"
#include <kempe/settings.h>
#include <math.h>

/* The public names and values of a model's inputs. */

KMP_GETTER(int kempe_model_input_count(const kempe_model *model), model, kmp_model_given_inputs(model), 0)
KMP_GETTER_AT(const char *kempe_model_input_name(const kempe_model *model, int input), model, input,
              kmp_model_given_inputs(model), model->inputs[input].name, NULL)
KMP_GETTER_AT(const char *kempe_model_input_unit(const kempe_model *model, int input), model, input,
              kmp_model_given_inputs(model), model->inputs[input].unit, "")
KMP_GETTER_AT(double kempe_model_input_value(const kempe_model *model, int input, double t), model, input,
              kmp_model_given_inputs(model), kmp_signal_value(&model->inputs[input].signal, t), NAN)

int kempe_model_input_find(const kempe_model *model, const char *name)
{
    return model && name ? kmp_name_find(KMP_NAMES(model->inputs, kmp_model_given_inputs(model)), name) : -1;
}
