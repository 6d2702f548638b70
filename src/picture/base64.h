/* SPDX-License-Identifier: BSD-3-Clause */
/* Arrays of numbers as members of JSON that pages decode. */
#pragma once

#include "base/json.h"
#include <stddef.h>
#include <stdint.h>

/** A string of base64, the lower byte of a number first: two bytes, or four as IEEE 754 single precision. */
void kmp_json_shorts(kmp_json *json, const char *key, size_t count, const int16_t *x);
void kmp_json_floats(kmp_json *json, const char *key, size_t count, const double *x);
