/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "report/page.h"

/** Words, curves of a table with their extreme values, the accuracy of a run, parameters and the text of the model. */
extern const kmp_page_view kmp_result_view;
