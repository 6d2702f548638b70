/* SPDX-License-Identifier: BSD-3-Clause */
/* Distributions of several quantities as users write them, and their samples, each found by its number alone. */
#pragma once

#include "studies/ensemble/sampling/designs.h"
#include "studies/ensemble/sampling/distributions.h"

typedef struct kmp_sampling kmp_sampling;

/** Reads the ranges, correlations and design of the options for a model, which must outlive it. KEMPE_E_ARGUMENT: a
 * sentence says which is wrong. */
kempe_status kmp_sampling_new(const kempe_model *model, const kempe_sample_options *options, kmp_sampling **sampling);
void kmp_sampling_free(kmp_sampling *sampling);

int kmp_sampling_columns(const kmp_sampling *sampling);
const char *const *kmp_sampling_names(const kmp_sampling *sampling);

/** Number of samples. */
int kmp_sampling_count(const kmp_sampling *sampling);

/** Sample k: a value for each column. */
void kmp_sampling_row(const kmp_sampling *sampling, int k, double *row);
