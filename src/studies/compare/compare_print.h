/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "studies/compare/compare_study.h"

/** The quantities whose errors are shown. */
extern const kmp_quantity kmp_compare_shown[KMP_COMPARE_SHOWN];

/** The error of a run; NaN where it is unknown, or too close to the reference's own uncertainty. */
double kmp_compare_error(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity);

/** An array of sentences. */
void kmp_sentences_json(kmp_json *json, const char *key, const kmp_sentences *list);
