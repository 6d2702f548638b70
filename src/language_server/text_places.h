/* SPDX-License-Identifier: BSD-3-Clause */
/* Places in a text: bytes, lines and characters as the reader counts them, positions as the protocol does. */
#pragma once

#include "model/data/place.h"
#include <stdbool.h>
#include <stddef.h>

/** A position of the protocol: a line and the units before it in that line, both from 0 on. */
typedef struct kmp_position {
    long line, unit;
} kmp_position;

/** The byte of a position, the nearest one where the text has no such position. `wide`: units of UTF-16;
 * otherwise bytes of UTF-8. */
size_t kmp_offset_of(const char *text, kmp_position position, bool wide);
kmp_position kmp_position_of(const char *text, size_t offset, bool wide);

/** The byte of a place of the reader, the nearest one. */
size_t kmp_offset_of_place(const char *text, kmp_place place);

/** The first byte of the line that has this byte. */
size_t kmp_line_begin(const char *text, size_t offset);
