/* SPDX-License-Identifier: BSD-3-Clause */
/* Statistics of instances (kempe/ensemble.h) as their report page reads them. */
#pragma once

#include "base/json.h"
#include <kempe/ensemble.h>

/** Writes a member with all of them; null for NULL. */
void kmp_statistics_put(kmp_json *json, const char *key, const kempe_statistics *statistics);

/** The part of the instances within the limits, with its interval; false: there are no limits, or nothing is known. */
bool kmp_statistics_yield(const kempe_statistics *statistics, double *part, double *low, double *high);

/** True for the column of a quantity; for a table that has one. */
bool kmp_statistics_is_quantity(const kempe_table *instances, int column);
bool kmp_statistics_has_quantities(const kempe_table *instances);

/** Marks the columns of a table "instances" that its statistics read; the table may have no rows. false: it has no
 * quantities. */
bool kmp_statistics_choose(const kempe_table *instances, bool *chosen);

/** Statistics of a result folder whose rows are `instances`; the words that repeat an extreme name the folder. */
kempe_status kmp_statistics_of_folder(const kempe_table *instances, const char *folder, kempe_statistics **statistics);
