/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "report/page.h"

/** The runs of a comparison that the page shows in detail: the advised one first, then the best of each other
 * formulation. `shown` has room for way_count; returns their number. */
int kmp_page_choose(const kempe_comparison *comparison, int *shown);

/** Runs these once more, and puts the results. */
kempe_status kmp_comparison_fill(kmp_result_page *page, const void *comparison);
extern const kmp_page_view kmp_comparison_view;
