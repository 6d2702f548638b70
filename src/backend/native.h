/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code that is written when it pays: a program that may run seldom begins on the tape. */
#pragma once

#include "backend/machine.h"
#include <stdbool.h>

/** True if this processor and this system run machine code; otherwise `native` is the tape. */
bool kmp_native_runs(void);

/** A back end for programs whose number of runs is not known. It has the bits of `backend`; of a large program,
 * it writes machine code after as many runs as that saves in its writing, or at once where the code exists. Others than
 * `native` without a thread pool are themselves. */
const kmp_backend *kmp_backend_waiting(const kmp_backend *backend);
