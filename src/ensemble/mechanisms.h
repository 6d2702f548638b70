/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances of mechanisms. Parameters that shape the equations (tracks, tables, axes) have a mechanism for each of
 * their values, whose model is read again (ensemble/sampling/model_instances.h); all others are variables of its
 * equations. */
#pragma once

#include "ensemble/lanes/ensemble_run.h"
#include "ensemble/quantity_words.h"

typedef struct kmp_mechanisms kmp_mechanisms;

/** With `count` names of values. Model, names and quantities must outlive the mechanisms. */
kempe_status kmp_mechanisms_new(const kempe_model *model, int count, const char *const *names,
                                const kmp_quantity_list *quantities, kmp_mechanisms **mechanisms);
void kmp_mechanisms_free(kmp_mechanisms *mechanisms);

/** The system of the model, with its values. */
const kempe_system *kmp_mechanisms_system(const kmp_mechanisms *mechanisms);

/** kmp_ensemble_run with the quantities, whose values go to execution->taken. An instance whose mechanism cannot be
 * made has the status KEMPE_E_INPUT and the reason. KEMPE_E_INPUT: files of the model have changed. */
kempe_status kmp_mechanisms_run(kmp_mechanisms *mechanisms, const kmp_run_spec *spec,
                                const kmp_ensemble_execution *execution, int instances, const double *values,
                                kmp_ensemble_result *results, double *q, double *qd);

/** Measurements of the last run. */
kmp_ensemble_work kmp_mechanisms_get_work(const kmp_mechanisms *mechanisms);
