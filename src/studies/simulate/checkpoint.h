/* SPDX-License-Identifier: BSD-3-Clause */
/* Checkpoints of a long run, from which it can continue: a line that identifies the model, a line of columns, the rows
 * in full digits, the past of continuous delays, and a checksum of these. */
#pragma once

#include "base/text.h"
#include "model/data/past_signals.h"
#include "output/samples.h"

/** Appends the lines that a checkpoint of this system begins with. */
kempe_status kmp_checkpoint_head(const kempe_system *system, kmp_text *text);

/** Appends the last line: the checksum of the `length` bytes before it. */
void kmp_checkpoint_end(kmp_text *text, const char *s, size_t length);

/** Whole or not at all. With a past of delayed signals (NULL: there are none), the rows until its end. */
kempe_status kmp_checkpoint_write(const kempe_system *system, const kmp_samples *samples, const kmp_past *past,
                                  const char *path);

/** Replaces the samples by the rows of the file, and the past (NULL of a model without continuous delays), which
 * reaches the last of them. KEMPE_E_IO; KEMPE_E_INPUT when it is of another model or spoilt, with file:line:column;
 * both are then as they were. */
kempe_status kmp_checkpoint_read(const kempe_system *system, const char *path, kmp_samples *samples, kmp_past **past);
