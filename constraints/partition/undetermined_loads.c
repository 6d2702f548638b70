/* SPDX-License-Identifier: BSD-3-Clause */
/* Shares of load by redundant rows: a dropped row is a combination of the kept ones, and each kept row with a share in
 * it has a multiplier that is not determined. */
#include "constraints/partition/undetermined_loads.h"
#include "base/memory.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include <math.h>
#include <string.h>

/* share (m): part of each kept row in the dropped one, from Jv' a = its v columns, scaled; infinite for the dropped
 * row. */
static void shares_of(kmp_reduction *red, int dropped, double *share)
{
    const kempe_system *s = red->eval->system;
    memset(red->force, 0, (size_t)red->n * sizeof *red->force);
    for (int e = 0; e < s->jacobian.count; e++)
        if (s->jacobian.row[e] == dropped)
            red->force[s->jacobian.col[e]] = red->eval->jacobian[e];
    kmp_reduction_pull(red, red->force, share);
    for (int r = 0; r < s->m; r++)
        share[r] = r == dropped ? INFINITY : fabs(share[r]) * s->row_scale[r] / s->row_scale[dropped];
}

/* share (m): room. */
static kempe_status check_row(kmp_reduction *red, int dropped, double *share)
{
    const kempe_system *s = red->eval->system;
    bool idle = true; /* a row that is not held (of friction, of a contact) has no load */
    for (int e = 0; e < s->jacobian.count; e++)
        idle = idle && !(s->jacobian.row[e] == dropped && red->eval->jacobian[e] != 0);
    if (idle)
        return KEMPE_OK;
    int most = red->part->rows[0];
    shares_of(red, dropped, share);
    for (int i = 1; i < red->r; i++)
        if (share[red->part->rows[i]] > share[most])
            most = red->part->rows[i];
    for (int k = 0; k < s->load_row_count; k++)
        if (share[s->load_rows[k]] > KMP_RANK_SHARED)
            return kmp_fail(s->context, KEMPE_E_FAILED,
                            "force '%s' depends on the multiplier of constraint equation '%s', which is not unique: "
                            "'%s' is redundant with it; remove one of them",
                            kmp_load_dependent_force(s, s->load_rows[k]), s->row_names[s->load_rows[k]],
                            s->row_names[(s->load_rows[k] == dropped ? most : dropped)]);
    return KEMPE_OK;
}

kempe_status kmp_load_check(kmp_evaluator *eval, const kmp_partition *part)
{
    kmp_reduction red;
    if (!eval->load || part->r == part->m || part->r == 0)
        return KEMPE_OK;
    KMP_TRY(kmp_reduction_init(&red, eval, part));
    double *share = KMP_ARENA_NEW(&red.arena, double, part->m);
    kempe_status status = kmp_made(eval->system->context, share);
    if (status == KEMPE_OK && kmp_reduction_factor(&red))
        status = kmp_fail(eval->system->context, KEMPE_E_FAILED,
                          "the Jacobian of the dependent coordinates is singular at t = %.9g s", eval->t);
    for (int k = 0; status == KEMPE_OK && k < part->m - part->r; k++)
        status = check_row(&red, part->redundant[k], share);
    kmp_reduction_free(&red);
    return status;
}

kempe_status kmp_find_shared(kmp_evaluator *eval, double t, const double *q, bool *shared, int *count)
{
    const kempe_system *s = eval->system;
    kmp_reduction red = {0};
    kmp_partition part = {0};
    double *share = KMP_NEW(double, s->m);
    *count = 0;
    memset(shared, 0, (size_t)s->m * sizeof *shared);
    kmp_eval_closure(eval, t, q);
    kempe_status status = !share     ? kmp_fail_memory(s->context)
                          : s->m > 0 ? kmp_partition_init(&part, s, eval->jacobian, NULL, 0)
                                     : KEMPE_OK;
    if (status == KEMPE_OK && part.r < part.m) {
        status = kmp_reduction_init(&red, eval, &part);
        bool good = status == KEMPE_OK && !kmp_reduction_factor(&red);
        for (int k = 0; good && k < part.m - part.r; k++) {
            shares_of(&red, part.redundant[k], share);
            for (int r = 0; r < s->m; r++)
                shared[r] = shared[r] || share[r] > KMP_RANK_SHARED;
        }
        kmp_reduction_free(&red);
    }
    for (int r = 0; r < s->m; r++)
        *count += shared[r];
    kmp_partition_free(&part);
    kmp_free(share);
    return status;
}
