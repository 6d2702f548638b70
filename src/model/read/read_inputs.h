/* SPDX-License-Identifier: BSD-3-Clause */
/* Inputs: their defaults and samples, and values given by settings: a number, or FILE:COLUMN:METHOD. */
#pragma once

#include "model/read/reading.h"

void kmp_read_inputs(kmp_reader *r);

/** True if a setting names an input; its value is then read by kmp_read_inputs. */
bool kmp_is_input_setting(const kmp_reader *r, const char *name);

/** After all reading: warns of inputs that nothing uses. */
void kmp_settle_inputs(const kmp_reader *r);
