/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters without influence on the model: most are misspelt, or left over. The user is warned of those of the
 * file itself, and of any that is set in vain: by --set, or by the file that includes theirs. */
#pragma once

#include "model/read/reading.h"

/** After all reading: marks each parameter of the model as fixed or variable, used or unused, and warns of unused ones.
 */
void kmp_settle_parameters(kmp_reader *r);
