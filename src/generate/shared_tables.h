/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables that several routines of one source look up: each is written once. */
#pragma once

#include "generate/source.h"

/** Lists the tables of all routines and of the parts of their blocks. False: no memory. */
bool kmp_code_tables_list(kmp_code_source *source);

/** True if a routine looks up the table, or a part of its blocks does. */
bool kmp_code_has_table(const kmp_code_routine *routine, const struct kmp_table *table);

/** Number of a table in the list; -1: it is not there. */
int kmp_code_table_number(const kmp_code_source *source, const struct kmp_table *table);
