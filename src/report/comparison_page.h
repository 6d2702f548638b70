/* SPDX-License-Identifier: BSD-3-Clause */
/* Data of a comparison's page: the comparison, the runs in detail, the picture. */
#pragma once

#include "report/step_record.h"

/** The runs of a comparison that the page shows in detail: the advised one first, then the best of each other
 * formulation. `shown` has room for way_count; returns their number. */
int kmp_page_choose(const kempe_comparison *comparison, int *shown);

/** Puts the residuals, the energy, the steps and the log of a run as one JSON object. */
void kmp_page_record(kmp_json *json, const kmp_record *record);
