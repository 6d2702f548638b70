/* SPDX-License-Identifier: BSD-3-Clause */
/* Words that the writer and the reader of program text share. */
#ifndef KMP_SYMBOLIC_PROGRAM_WORDS_H
#define KMP_SYMBOLIC_PROGRAM_WORDS_H

#include "symbolic/graph.h"

extern const char *const kmp_input_words[KMP_IN_COUNT];

#endif
