/* SPDX-License-Identifier: BSD-3-Clause */
/* A model whose parameters may change after it was read: a copy with its own numbers, which are evaluated again when
 * parameters are set. Programs derived from the copy keep those parameters, and all numbers that depend on them, as
 * inputs, independent of their current values. */
#pragma once

#include "base/text.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef struct kmp_variant kmp_variant;

/** A variant with `count` names of variable parameters, and of start values as `q.NAME` and `qd.NAME`, which become
 * parameters. In the copy these depend on no others, whatever the model's expressions. The model must be finished and
 * outlive it. KEMPE_E_ARGUMENT, with a remedy: there is no such parameter or coordinate, one is given twice, or it
 * determines values outside the equations (axes, tables, settings of the run).
 */
kempe_status kmp_variant_new(const kempe_model *model, int count, const char *const *names, kmp_variant **variant);
/** The same for names that may be of inputs, too, if these are constant: parameters take their place. */
kempe_status kmp_variant_new_with_inputs(const kempe_model *model, int count, const char *const *names,
                                         kmp_variant **variant);
/** The same as the first for a context below the context of the model. */
kempe_status kmp_variant_new_in(kempe_context *context, const kempe_model *model, int count, const char *const *names,
                                kmp_variant **variant);
void kmp_variant_free(kmp_variant *variant);

/** Adds states with the value 0 at the start, and with these rates, to the copy of a variant without names, before
 * anything is derived from it: integrals over time. The rates are expressions of the copy that a state of a model file
 * may have, and live as long as the variant. KEMPE_E_MEMORY. */
kempe_status kmp_variant_add_states(kmp_variant *variant, int count, const char *const *names,
                                    const kmp_expr *const *rates);

/** The copy, which belongs to the variant. */
kempe_model *kmp_variant_model(kmp_variant *variant);

/** Sets all that vary, in the order of their names, and every number that follows. KEMPE_E_INPUT: the model cannot have
 *  these values; `why` (empty before) then has a sentence. KEMPE_E_MEMORY: no room for it. */
kempe_status kmp_variant_set(kmp_variant *variant, const double *values, kmp_text *why);

/** A model with other values of its parameters and start values: its own object, freed by kempe_model_free before the
 * model that it was made of. KEMPE_E_ARGUMENT as kmp_variant_new, KEMPE_E_FAILED: the model cannot have these values.
 */
kempe_status kmp_variant_instance(const kempe_model *model, int count, const char *const *names, const double *values,
                                  kempe_model **instance);
/** The variant frees the model of which it was made. */
void kmp_variant_own(kmp_variant *variant, kempe_model *model);

/** The parameter of a name; -1: there is none. */
int kmp_parameter_find(const kempe_model *model, const char *name);

/** True if a name may vary; otherwise `why` (empty before) receives the reason. */
bool kmp_variant_may(const kempe_model *model, const char *name, kmp_text *why);

/** The dimension of a parameter, a start value or a rate by its name; free where there is none. */
kmp_dimension kmp_variant_dimension(const kempe_model *model, const char *name);

/** True if a variable parameter occurs in an expression of the model. */
bool kmp_expr_varies(const kempe_model *model, const kmp_expr *expr);
