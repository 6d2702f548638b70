/* SPDX-License-Identifier: BSD-3-Clause */
/* What every generated file begins with, and the names that it lists. */
#ifndef KMP_GENERATE_BANNER_H
#define KMP_GENERATE_BANNER_H

#include "generate/source.h"

/** Lines that begin with `mark`: what the file is, the model and its hash, how it was derived, what each routine costs
 *  by both rules, the entries of q and h. `base`: the first index. */
void kmp_banner_put(kmp_text *text, const kmp_code_source *source, const char *mark, int base);

/** Lines about one routine: what it takes and gives. */
void kmp_banner_routine(kmp_text *text, const kmp_code_source *source, const kmp_routine *routine, const char *mark);

/** The names of what a routine takes, in order: k, t, q .. of its arguments; kinds that are not its own are skipped. */
extern const char *const kmp_argument_names[KMP_IN_COUNT];

/** Appends a text in double quotes, as C, Octave and Python read it. */
void kmp_banner_quote(kmp_text *text, const char *s);

#endif
