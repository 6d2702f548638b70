/* SPDX-License-Identifier: BSD-3-Clause */
/* The table at equal error: the cheapest run of each method within a level of error, except accidental ones. */
#include "studies/compare/compare.h"
#include <kempe/compare.h>
#include <math.h>

static const double levels[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};

_Static_assert(sizeof levels / sizeof *levels == KMP_MOST_LEVELS, "a level without a place");

bool kmp_compared_is_below(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity)
{
    double error = run->verdict.error[quantity], uncertainty = comparison->uncertainty[quantity];
    return uncertainty > 0 && error < 10 * uncertainty;
}

static bool is_within(const kmp_compared *run, double level)
{
    return run->status == KEMPE_OK && run->verdict.error[KMP_QUANTITY_Q] <= level;
}

/* True if no run of the method at a tighter tolerance contradicts this run, which would then be accidental. */
static bool counts(const kempe_comparison *c, int run, double level)
{
    if (!is_within(&c->runs[run], level))
        return false;
    for (int k = 0; k < c->count; k++)
        if (c->runs[k].way == c->runs[run].way && c->runs[k].rtol < c->runs[run].rtol &&
            c->runs[k].status == KEMPE_OK && !is_within(&c->runs[k], level))
            return false;
    return true;
}

static bool is_cheaper(const kempe_comparison *c, int run, int than)
{
    return than < 0 || c->runs[run].cpu_s < c->runs[than].cpu_s;
}

static void settle(kempe_comparison *c, int l)
{
    double uncertainty = c->uncertainty[KMP_QUANTITY_Q];
    c->levels.level[l] = levels[l];
    c->levels.best[l] = -1;
    c->levels.blank[l] = !(levels[l] >= 10 * uncertainty);
    for (int k = 0; k < c->count && !c->levels.blank[l]; k++) {
        int *own = &c->levels.run[(int)(c->runs[k].way - c->ways) * KMP_MOST_LEVELS + l];
        if (!counts(c, k, levels[l]))
            continue;
        if (is_cheaper(c, k, *own))
            *own = k;
        if (is_cheaper(c, k, c->levels.best[l]))
            c->levels.best[l] = k;
    }
}

void kmp_compare_levels(kempe_comparison *c)
{
    c->levels.run = KMP_ARENA_NEW(&c->arena, int, KMP_MOST_LEVELS * c->way_count);
    if (!c->has_reference || !c->levels.run)
        return;
    for (int k = 0; k < KMP_MOST_LEVELS * c->way_count; k++)
        c->levels.run[k] = -1;
    c->levels.count = KMP_MOST_LEVELS;
    for (int l = 0; l < KMP_MOST_LEVELS; l++)
        settle(c, l);
}
