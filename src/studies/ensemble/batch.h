/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of an ensemble (kempe/ensemble.h) as its report page reads them. */
#pragma once

#include <kempe/ensemble.h>

/** The model and its varied values. */
const kempe_model *kmp_batch_model(const kempe_batch *batch);
const kempe_values *kmp_batch_values(const kempe_batch *batch);

/** The status of the whole, and warnings, one a line. */
kempe_status kmp_batch_outcome(const kempe_batch *batch);
const char *kmp_batch_warnings(const kempe_batch *batch);
