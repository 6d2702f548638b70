/* SPDX-License-Identifier: BSD-3-Clause */
/* Data in the format DEFLATE (RFC 1951), as ZIP archives have them. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/** Writes `size` bytes, to which the `length` ones must expand exactly; false: they do not, and `to` is undefined. */
bool kmp_inflate(const unsigned char *from, size_t length, unsigned char *to, size_t size);
