/* SPDX-License-Identifier: BSD-3-Clause */
/* Bytes and arrays of numbers as members of JSON that pages decode. */
#pragma once

#include "base/json.h"
#include <stddef.h>
#include <stdint.h>

/** A string of base64: bytes as they are; numbers with the lower byte first, two bytes or four as IEEE 754 single
 * precision. */
void kmp_json_bytes(kmp_json *json, const char *key, size_t count, const char *x);
void kmp_json_shorts(kmp_json *json, const char *key, size_t count, const int16_t *x);
void kmp_json_floats(kmp_json *json, const char *key, size_t count, const double *x);
