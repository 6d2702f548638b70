/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Inputs of a model: functions of time that are given to a run (docs/model/inputs.md).
 *
 *     int u = kempe_model_input_find(model, "u");
 *     ...
 *     kempe_stepper_set_input(stepper, u, 3.5);
 *
 * A model's own values, or those of its settings (kempe/settings.h), hold until a stepper (kempe/stepper.h) or a
 * workspace (kempe/workspace.h) gives others. Values in this interface are in SI.
 */
#ifndef KEMPE_INPUTS_H
#define KEMPE_INPUTS_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** Number of inputs; number of the input with a name, -1: there is none. */
KEMPE_API int kempe_model_input_count(const kempe_model *model);
KEMPE_API int kempe_model_input_find(const kempe_model *model, const char *name);

/** Name of an input, and its unit as written in the model ("" without one). */
KEMPE_API const char *kempe_model_input_name(const kempe_model *model, int input);
KEMPE_API const char *kempe_model_input_unit(const kempe_model *model, int input);

/** Value at t by the model's own samples or default, in SI. */
KEMPE_API double kempe_model_input_value(const kempe_model *model, int input, double t);

KEMPE_END
#endif
