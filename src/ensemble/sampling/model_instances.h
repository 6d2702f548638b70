/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances of a model: other values of its parameters and start values. Most are variables of the equations
 * (model/data/variant.h). Parameters that shape the equations (tracks, tables, axes) have other equations for each
 * value: the file of the model is read again with them. */
#pragma once

#include "base/text.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** True if a name may differ between instances; otherwise `why` (empty before) receives the reason. */
bool kmp_instance_may(const kempe_model *model, const char *name, kmp_text *why);

/** True if other values of this name are other equations. */
bool kmp_instance_reads(const kempe_model *model, const char *name);

/** The model read again, with values of parameters that shape the equations. KEMPE_E_FAILED: it cannot have these
 * values; KEMPE_E_INPUT: its files have changed. */
kempe_status kmp_model_read_again(const kempe_model *model, int count, const char *const *names, const double *values,
                                  kempe_model **again);

/** A model with other values of its parameters and start values: its own object, freed by kempe_model_free before the
 * model that it was made of. KEMPE_E_ARGUMENT: a name must not differ, or is given twice. KEMPE_E_FAILED, KEMPE_E_INPUT
 * as above. */
kempe_status kmp_model_instance(const kempe_model *model, int count, const char *const *names, const double *values,
                                kempe_model **instance);
