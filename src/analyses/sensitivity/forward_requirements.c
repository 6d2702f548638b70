/* SPDX-License-Identifier: BSD-3-Clause */
/* Requirements of derivatives at an event (forward_requirements.h). */
#include "analyses/sensitivity/forward_requirements.h"
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/sensitivity/forward_map.h"
#include "base/context.h"
#include <math.h>
#include <string.h>

/* -- terms ------------------------------------------------------------------------------------------------ */

bool kmp_forward_terms_make(kmp_forward_terms *terms, kmp_arena *arena, int n, int columns)
{
    return KMP_ARENA_MAKE(arena, KMP_ROOM(double, n, &terms->pace, &terms->pace_of_rates),
                          KMP_ROOM(double, n *columns, &terms->dq, &terms->dqd, &terms->span, &terms->speed));
}

/* The size of the quantity by which column k differentiates. */
static double size_of(const kmp_forward_formulation *f, int k)
{
    return k < f->v->count ? f->sizes[k] : kmp_forward_map_column_size(f, k);
}

void kmp_forward_begin_terms(kmp_forward_formulation *f)
{
    for (int k = 0; k < f->count; k++)
        for (int i = 0; i < f->n; i++) {
            const int at = k * f->n + i;
            const double rounding = kmp_forward_rounding(f, i) / size_of(f, k);
            f->terms.span[at] = fabs(f->place.dq[at]) + rounding;
            f->terms.speed[at] = fabs(f->place.dqd[at]) + rounding * f->start.rate_scale;
        }
    const size_t size = (size_t)(f->count * f->n) * sizeof *f->place.dq;
    memcpy(f->terms.dq, f->place.dq, size);
    memcpy(f->terms.dqd, f->place.dqd, size);
    memset(f->terms.pace, 0, (size_t)f->n * sizeof *f->terms.pace);
    memset(f->terms.pace_of_rates, 0, (size_t)f->n * sizeof *f->terms.pace_of_rates);
}

void kmp_forward_add_terms(kmp_forward_formulation *f, const double *qd, const double *qdd, double sign,
                           const double *swing)
{
    for (int i = 0; i < f->n; i++) {
        const double usual = f->start.rate_scale * f->system->scale[i] * KMP_IMPACT_RATES / KMP_SLOPE_LOOSE;
        const double rate = fabs(qd[i]) + usual, acceleration = fabs(qdd[i]) + usual * f->start.rate_scale;
        f->terms.pace[i] += rate;
        f->terms.pace_of_rates[i] += acceleration;
        for (int k = 0; k < f->count; k++) {
            const int at = k * f->n + i;
            if (swing[k] == 0)
                continue;
            f->place.dq[at] += qd[i] * (sign * swing[k]);
            f->place.dqd[at] += qdd[i] * (sign * swing[k]);
            f->terms.span[at] += rate * fabs(swing[k]);
            f->terms.speed[at] += acceleration * fabs(swing[k]);
        }
    }
}

bool kmp_forward_have_one_time(const kmp_forward_formulation *f)
{
    bool have = true;
    for (int k = 0; k < f->count; k++) {
        const double size = fmax(fabs(f->times.swing[k]), fabs(f->event.swing[k]));
        const double rounding = KMP_SLOPE_ROUNDED / (f->start.rate_scale * size_of(f, k));
        have = have && fabs(f->times.swing[k] - f->event.swing[k]) <= KMP_SLOPE_SAME_TIME * size + rounding;
    }
    return have;
}

/* -- checks ----------------------------------------------------------------------------------------------- */

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

/* Puts the terms of the coordinates into rows, the time of the event, and the part that is given. */
static void put_terms(const kmp_forward_formulation *f, const kmp_forward_check *check, const double *row, double *term)
{
    const double *before = check->rates ? f->terms.dqd : f->terms.dq,
                 *pace = check->rates ? f->terms.pace_of_rates : f->terms.pace;
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
        term[k] = along * f->event.swing[k];
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
    kmp_forward_requirement *requirement = kmp_forward_map_require(f, terms, &off, &term);
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
    kmp_forward_requirement *requirement = kmp_forward_map_require(f, 1, &off, &term);
    if (!requirement)
        return fail_memory(f);
    for (int k = 0; k < f->count; k++) {
        off[k] = f->times.swing[k] - f->event.swing[k];
        term[k] = f->event.swing[k];
    }
    requirement->part = KMP_SLOPE_SAME_TIME;
    requirement->rounding = KMP_SLOPE_ROUNDED / KMP_SLOPE_SAME_TIME / f->start.rate_scale;
    requirement->reason = reason;
    return KMP_GO;
}
