/* SPDX-License-Identifier: BSD-3-Clause */
/* Valid combinations of formulation, form, integrator, linear solver and back end, and the defaults of a run. */
#pragma once

#include "integrators/formulations/formulation.h"
#include "integrators/run/run.h"

/** Row k of the table, NULL after the last. */
const kmp_formulation_kind *kmp_formulation_get(int k);

/** The kind of a formulation and form (NULL: the formulation's first); NULL if it does not exist. */
const kmp_formulation_kind *kmp_formulation_find(const char *formulation, const char *form);

/** Fills members that are NULL or 0 from the model and Kempe's defaults, and takes each name from its table, so that no
 * text of the caller is kept. KEMPE_E_ARGUMENT: a name is unknown; the message has the known ones. */
kempe_status kmp_run_resolve(const kempe_system *system, kmp_run_spec *spec);

/** The k-th valid combination of formulation, form and integrator; false after the last. */
bool kmp_method_get(int k, kmp_method *method);
