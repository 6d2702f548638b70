/* SPDX-License-Identifier: BSD-3-Clause */
/* The encoder of machine code of this processor, and the forms that run here. */
#pragma once

#include "backend/encoder/encoder.h"

/** The encoder of the processor that this library was compiled for. Processors without one get the encoder of x86-64,
 * of which no form runs there. */
const kmp_encoder *kmp_encoder_here(void);

/** True if machine code of this form runs here. */
bool kmp_code_runs(kmp_code_form form);

/** The form of this number of lanes that runs best here; 0: there is none. */
kmp_code_form kmp_code_form_of(int lanes);
