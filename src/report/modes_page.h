/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "report/page.h"

/** Moves the mechanism along each mode, and puts the results. */
kempe_status kmp_modes_fill(kmp_result_page *page, const void *modes);
extern const kmp_page_view kmp_modes_view;
