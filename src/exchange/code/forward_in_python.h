/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations in generated Python: functions that call the functions of the sets and solve linear equations. */
#pragma once

#include "exchange/code/language.h"

/** Writes `forward`, `forward_reduced` and `close`, each where the file has what it needs; otherwise a comment that
 * says what is missing. */
void kmp_put_forward(const kmp_code_writer *writer);
