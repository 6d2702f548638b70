/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters: any may refer to any other. Each is valued as soon as its operands are; those left when nothing more
 * can be valued form a cycle. */
#pragma once

#include "model/read/reading.h"

void kmp_read_parameters(kmp_reader *r);

/** The value that a setting gives a parameter or an input; NULL: none does. */
const char *kmp_setting_of(const kmp_reader *r, const char *name);

/** After all reading: marks each parameter of the model as fixed or variable, used or unused, and warns of unused ones.
 */
void kmp_settle_parameters(kmp_reader *r);

void kmp_read_inputs(kmp_reader *r);

/** After all reading: warns of inputs that nothing uses. */
void kmp_settle_inputs(const kmp_reader *r);
