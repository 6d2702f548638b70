/* SPDX-License-Identifier: BSD-3-Clause */
/* Requirements of derivatives at an event (forward_requirements.h). */
#include "analyses/sensitivity/forward_requirements.h"
#include "analyses/sensitivity/forward_changes.h"
#include "base/context.h"
#include <math.h>
#include <string.h>

bool kmp_forward_make_checks(const kmp_forward_formulation *f, kmp_arena *arena, int count, kmp_forward_check **checks)
{
    kmp_forward_check *made = *checks = KMP_ARENA_NEW(arena, kmp_forward_check, count > 0 ? count : 1);
    for (int k = 0; made && k < count; k++)
        (void)KMP_ARENA_EACH(arena, double, f->count, &made[k].off, &made[k].given);
    return !arena->failed;
}

double kmp_forward_part(const kmp_forward_check *check)
{
    return check->rates ? KMP_SLOPE_LOOSE : KMP_SLOPE_PARTS;
}

static int fail_memory(const kmp_forward_formulation *f)
{
    (void)kmp_fail_memory(f->system->context);
    return KMP_HALT;
}

/* A new requirement of the map, with room for its rows, of `terms` terms. NULL: no memory. */
static kmp_forward_requirement *add_requirement(kmp_forward_formulation *f, int terms, double **off, double **term)
{
    kmp_forward_requirement *requirement = KMP_ARENA_NEW(&f->arena, kmp_forward_requirement, 1);
    if (!requirement ||
        !KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, f->count, off), KMP_ROOM(double, terms * f->count, term)))
        return NULL;
    *requirement = (kmp_forward_requirement){.off = *off, .term = *term, .terms = terms, .before = f->map.requirement};
    f->map.requirement = requirement;
    return requirement;
}

/* Puts the terms of the coordinates into rows, the time of the event, and the part that is given. */
static void put_terms(const kmp_forward_formulation *f, const kmp_forward_check *check, const double *row, double *term)
{
    const double *before = check->rates ? f->dqd_before : f->dq_before,
                 *pace = check->rates ? f->pace_of_rates : f->pace;
    const size_t columns = (size_t)f->count;
    double along = 0;
    for (int i = 0; i < f->n; i++) {
        if (row[i] == 0)
            continue;
        for (int k = 0; k < f->count; k++)
            term[k] = row[i] * before[k * f->n + i];
        along += fabs(row[i]) * pace[i];
        term += columns;
    }
    for (int k = 0; k < f->count; k++)
        term[k] = along * f->common[k];
    memcpy(term + columns, check->given, columns * sizeof *term);
}

static int require_of_map(kmp_forward_formulation *f, const kmp_forward_check *check, const double *row,
                          const char *reason)
{
    int terms = 2;
    double rounding = 0, *off, *term;
    for (int i = 0; i < f->n; i++) {
        terms += row[i] != 0;
        rounding += fabs(row[i]) * kmp_forward_rounding(f, i) * (check->rates ? f->start.rate_scale : 1);
    }
    kmp_forward_requirement *requirement = add_requirement(f, terms, &off, &term);
    if (!requirement)
        return fail_memory(f);
    memcpy(off, check->off, (size_t)f->count * sizeof *off);
    put_terms(f, check, row, term);
    requirement->part = kmp_forward_part(check);
    requirement->rounding = rounding;
    requirement->reason = reason;
    return KMP_GO;
}

int kmp_forward_require(kmp_forward_formulation *f, const kmp_forward_check *check, const double *row,
                        const char *reason)
{
    if (!reason)
        return fail_memory(f);
    return f->options->alone ? require_of_map(f, check, row, reason) : kmp_forward_halt(f, "%s", reason);
}

int kmp_forward_require_one_time(kmp_forward_formulation *f, const char *reason)
{
    double *off, *term;
    if (!reason)
        return fail_memory(f);
    if (!f->options->alone)
        return kmp_forward_halt(f, "%s", reason);
    kmp_forward_requirement *requirement = add_requirement(f, 1, &off, &term);
    if (!requirement)
        return fail_memory(f);
    for (int k = 0; k < f->count; k++) {
        off[k] = f->swing[k] - f->common[k];
        term[k] = f->common[k];
    }
    requirement->part = KMP_SLOPE_SAME_TIME;
    requirement->rounding = KMP_SLOPE_ROUNDED / KMP_SLOPE_SAME_TIME / f->start.rate_scale;
    requirement->reason = reason;
    return KMP_GO;
}
