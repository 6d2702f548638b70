/* SPDX-License-Identifier: BSD-3-Clause */
/* The vectorised form of a routine: a statement for all operations of one kind in a step (levels.h). */
#pragma once

#include "exchange/code/language.h"

/* Words of the vectorised form (vectorised.c). */
void kmp_vectorised_lists(const kmp_code_writer *writer);
void kmp_vectorised_groups(const kmp_code_writer *writer);
void kmp_vectorised_operands(const kmp_code_writer *writer);
void kmp_vectorised_results(const kmp_code_writer *writer);
void kmp_vectorised_list(const kmp_code_writer *writer);
