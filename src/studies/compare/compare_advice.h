/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "studies/compare/compare_study.h"

/** Fill `levels` and `tables` from the runs. Missing memory is recorded in the arena. */
void kmp_compare_levels(kempe_comparison *comparison);
void kmp_compare_tables(kempe_comparison *comparison);

/** The cost of a method at a level. */
kmp_method_cost kmp_compare_cost(const kempe_comparison *comparison, int method, int level);

/** The time of a method at a level relative to the cheapest; infinite where the level is not attained. */
double kmp_compare_ratio(const kempe_comparison *comparison, int method, int level);

/** The method that the others of its family are compared with in the table of equal integrators: the first that attains
 * the level; -1: none. */
int kmp_compare_base(const kempe_comparison *comparison, int method, int level);

/** The first method of the table of the best ones that attains the level; -1: none. */
int kmp_compare_best(const kempe_comparison *comparison, int level);

/** Time from the model that has been read to the end of a run: preparation of the equations and of the run,
 * integration. */
double kmp_compare_first_s(const kempe_comparison *comparison, const kmp_compared *run);

/** True when an error is too close to the reference's own uncertainty: below ten times it. */
bool kmp_compared_is_below(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity);

/** Fill `failures` and `warnings`, and `advice`, from the runs. Missing memory is recorded in the arena. */
void kmp_compare_remark(kempe_comparison *comparison);
void kmp_compare_advise(kempe_comparison *comparison);

/** "reduced integrated dop853", "projected dop853", "dae stabilized1 ida klu". */
void kmp_compare_name(kmp_text *text, const kmp_method *method);

/** Adds a sentence; the text, unless it is empty, which is emptied. */
void kmp_sentences_add(kmp_arena *arena, kmp_sentences *list, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void kmp_sentences_take(kmp_arena *arena, kmp_sentences *list, kmp_text *text);
