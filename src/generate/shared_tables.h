/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables that several routines of one source look up: each is written once. */
#pragma once

#include "generate/source.h"

/** Lists the tables of all routines and of the parts of their blocks. False: no memory. */
bool kmp_code_tables_list(kmp_code_source *source);

/** Number of a table in the list; -1: it is not there. */
int kmp_code_table_number(const kmp_code_source *source, const struct kmp_table *table);
