/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces of a program between two functions, with the values of places alone left out, as machine code whose bases
 * are its arguments. A value that leaves its register goes to its row, which no other value has before its last use. */
#pragma once

#include "symbolic/row_code.h"

/** A kmp_row_writer; NULL also on machines without such code. */
const kmp_row_code *kmp_row_code_of(const kmp_program *program, size_t width, const kmp_row_address *address);
