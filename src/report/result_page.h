/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "report/page.h"

/** Words, curves of a table with their extreme values, the accuracy of a run, parameters and the text of the model. */
extern const kmp_page_view kmp_result_view;

/** True for the abscissa, and for columns that are drawn at first. */
bool kmp_page_is_first(const kmp_page_curves *curves, int column);
