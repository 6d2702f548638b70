/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensors, which are named expressions, and the outputs of a run: the rows of output_kinds.def. */
#pragma once

#include "model/read/reading.h"
#include <kempe/kempe.h>

void kmp_read_sensors(kmp_reader *r);
void kmp_read_outputs(kmp_reader *r, const kmp_yaml *list);

/** The NAME of "word(NAME)"; NULL when `text` is not of that form. */
const char *kmp_read_argument(kmp_reader *r, const char *text, const char *word);
