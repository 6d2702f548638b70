/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs at both ends of a run. */
#pragma once

#include "loaded.h"
#include "testing.h"
#include <kempe/table.h>
#include <math.h>
#include <stdio.h>

/** The first `count` numbers of the outputs in the first and in the second row of a run, which must have this status.
 */
static inline void run_ends(const loaded *l, const kempe_run_options *run, kempe_status status, const char *outputs,
                            int count, double first[], double last[])
{
    kempe_trajectory *t = NULL;
    kempe_table *table = NULL;
    CHECK(l->system && kempe_simulate(l->system, run, &t) == status &&
          kempe_trajectory_outputs(t, outputs, &table) == KEMPE_OK);
    if (!table)
        printf("%s\n", kempe_context_message(l->context));
    for (int k = 0; k < count; k++) {
        first[k] = table ? kempe_table_number(table, 0, 1 + k) : NAN;
        last[k] = table ? kempe_table_number(table, 1, 1 + k) : NAN;
    }
    kempe_table_free(table);
    kempe_trajectory_free(t);
}
