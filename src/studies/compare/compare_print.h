/* SPDX-License-Identifier: BSD-3-Clause */
/* Common functions of a comparison's reports. */
#ifndef KMP_STUDIES_COMPARE_COMPARE_PRINT_H
#define KMP_STUDIES_COMPARE_COMPARE_PRINT_H

#include "output/print.h"
#include "studies/compare/compare.h"
#include <kempe/compare.h>

enum { KMP_COMPARE_SHOWN = 3 };

/** The quantities whose errors are shown. */
extern const kmp_quantity kmp_compare_shown[KMP_COMPARE_SHOWN];

void kmp_compare_json(kmp_text *text, const kempe_comparison *comparison);

#endif
