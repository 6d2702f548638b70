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

/** The error of a run; NaN where it is unknown, or too close to the reference's own uncertainty. */
double kmp_compare_error(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity);

/** An array of sentences. */
void kmp_sentences_json(kmp_json *json, const char *key, const kmp_sentences *list);

void kmp_compare_json(kmp_text *text, const kempe_comparison *comparison);

#endif
