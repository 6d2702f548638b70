/* SPDX-License-Identifier: BSD-3-Clause */
/* The head comment of generated files, and the names that it lists. */
#ifndef KMP_GENERATE_BANNER_H
#define KMP_GENERATE_BANNER_H

#include "generate/source.h"

/** Lines that begin with `mark`: the file's content, the model and its hash, its derivation, operation counts of each
 * routine by both rules, the entries of q and h. `base`: the first index. */
void kmp_banner_put(kmp_text *text, const kmp_code_source *source, const char *mark, int base);

/** Lines about one routine: its arguments and results. */
void kmp_banner_routine(kmp_text *text, const kmp_code_source *source, const kmp_routine *routine, const char *mark);

/** The names of a routine's arguments, in order: k, t, q ..; kinds that are not arguments are skipped. */
extern const char *const kmp_argument_names[KMP_IN_COUNT];

#endif
