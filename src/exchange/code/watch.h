/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of the conditions of a generated simulator, by which it finds their changes: kempe_watch. */
#pragma once

#include "exchange/code/source.h"

/** Sets source->simulated->watch from the routine of conditions. KEMPE_E_ARGUMENT with the name of a condition that has
 * no bounds. */
kempe_status kmp_watch_find(kmp_code_source *source);

/** The table `watch`, after the tables that it names and, where conditions have unknowns, the functions that give
 * conditions without them and with them. */
void kmp_watch_put(kmp_text *text, const kmp_code_source *source);

/** The arguments of KEMPE_SIMULATOR_WATCH. */
void kmp_watch_put_size(kmp_text *text, const kmp_code_source *source);
