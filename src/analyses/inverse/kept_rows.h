/* SPDX-License-Identifier: BSD-3-Clause */
/* Of redundant constraint equations some rows are kept. They may become dependent where the mechanism moves freely. */
#pragma once

#include "constraints/partition/reduction.h"

/** True if the rows that a reduction keeps determine the dropped ones well, as runs judge it (kmp_dropped_judge);
 * rows of `left_out` do not count. It has factors. `force` (n), `rows` (m): scratch. */
bool kmp_keeps_rows_well(kmp_reduction *red, const bool *left_out, double *force, double *rows);
