/* SPDX-License-Identifier: BSD-3-Clause */
/* Compact encoding of numbers in a page. */
#ifndef KMP_REPORT_ENCODE_H
#define KMP_REPORT_ENCODE_H

#include "base/text.h"
#include <stdint.h>

/** [a,b,...], each by kmp_text_rounded. */
void kmp_encode_numbers(kmp_text *text, int count, const double *x, int digits);

/** A string of base64: two bytes a number, the lower one first. */
void kmp_encode_short(kmp_text *text, size_t count, const int16_t *x);

/** A string inside a script: quoted, `<` escaped. */
void kmp_encode_string(kmp_text *text, const char *s);

#endif
