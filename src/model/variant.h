/* SPDX-License-Identifier: BSD-3-Clause */
/* A model whose parameters may change after it was read: a copy with its own numbers, each of which follows from the
 * parameters again when they are set. What is derived from the copy keeps those parameters, and what depends on them,
 * as inputs, whatever their values are at the moment. */
#ifndef KMP_MODEL_VARIANT_H
#define KMP_MODEL_VARIANT_H

#include "model/model.h"

typedef struct kmp_variant kmp_variant;

/** With `count` names of parameters that vary, and of start values as `q.NAME` and `qd.NAME`, which become parameters;
 *  in the copy these follow from no others, whatever the model says. The model must be finished and outlive it.
 * KEMPE_E_ARGUMENT: there is no such parameter or coordinate, one is given twice, or it decides what is no number in
 * the equations (axes, tables, settings of the run): which, and what to do.
 */
kempe_status kmp_variant_new(const kempe_model *model, int count, const char *const *names, kmp_variant **variant);
void kmp_variant_free(kmp_variant *variant);

/** The copy, which belongs to the variant. */
kempe_model *kmp_variant_model(kmp_variant *variant);

/** Sets all that vary, in the order of their names, and every number that follows. KEMPE_E_INPUT: the model cannot have
 *  these values; `why` (empty before) then has a sentence. KEMPE_E_MEMORY: no room for it. */
kempe_status kmp_variant_set(kmp_variant *variant, const double *values, kmp_text *why);

/** The parameter of a name; -1: there is none. */
int kmp_parameter_find(const kempe_model *model, const char *name);

/** Whether a name is one of those; where not `why` (empty before) has a sentence. */
bool kmp_variant_may(const kempe_model *model, const char *name, kmp_text *why);

/** Whether a parameter that varies occurs in an expression of the model. */
bool kmp_expr_varies(const kempe_model *model, const kmp_expr *expr);

#endif
