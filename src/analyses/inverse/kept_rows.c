/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/inverse/kept_rows.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "dynamics/system.h"
#include "integrators/decide/dropped_rows.h"
#include <math.h>
#include <string.h>

bool kmp_keeps_rows_well(kmp_reduction *red, const bool *left_out, double *force, double *rows)
{
    const kmp_partition *part = red->part;
    const kempe_system *s = red->eval->system;
    const kmp_pattern *j = &s->jacobian;
    double most = 0;
    for (int i = 0; i < part->m - part->r; i++) {
        const int dropped = part->redundant[i];
        if (left_out[dropped])
            continue;
        memset(force, 0, (size_t)s->n * sizeof *force);
        for (int e = 0; e < j->count; e++)
            if (j->row[e] == dropped)
                force[j->col[e]] = red->eval->jacobian[e];
        kmp_reduction_pull(red, force, rows); /* J_dropped = T J_kept */
        for (int k = 0; k < part->r; k++) {
            const double t = fabs(rows[part->rows[k]]) * s->row_scale[part->rows[k]] / s->row_scale[dropped];
            most = t <= most ? most : t; /* NaN stays */
        }
    }
    return kmp_dropped_judge(most) == KMP_KEPT_WELL;
}
