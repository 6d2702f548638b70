/* SPDX-License-Identifier: BSD-3-Clause */
/* The context of a model, and whether the model is finished: what studies need of a model that they do not read. */
#pragma once

#include <kempe/kempe.h>

/** The context that the model was made with, which has its messages. */
kempe_context *kmp_model_context(const kempe_model *model);

/** KEMPE_E_ARGUMENT with its sentence when the model is still under construction. */
kempe_status kmp_model_check_finished(const kempe_model *model);
