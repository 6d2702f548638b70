/* SPDX-License-Identifier: BSD-3-Clause */
/* Remarks on the runs, a line for each method and kind: incomplete runs, and anomalies of complete ones. Then the
 * recommended method, by the rules in docs/compare.md, and the measurements that support it. */
#pragma once

#include "studies/compare/compare_study.h"

/** Fill `failures` and `warnings`, and `advice`, from the runs. The arena tells of missing memory. */
void kmp_compare_remark(kempe_comparison *comparison);
void kmp_compare_advise(kempe_comparison *comparison);

/** "reduced integrated dop853", "projected dop853", "dae stabilized1 ida klu". */
void kmp_compare_name(kmp_text *text, const kmp_method *method);

/** Adds a sentence; the text, unless it is empty, which is emptied. */
void kmp_sentences_add(kmp_arena *arena, kmp_sentences *list, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void kmp_sentences_take(kmp_arena *arena, kmp_sentences *list, kmp_text *text);
