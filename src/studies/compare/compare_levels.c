/* SPDX-License-Identifier: BSD-3-Clause */
/* The table at equal error: the cheapest run of each method within a level of error, except accidental ones, and what
 * the method would need for the level itself. */
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>

static const double levels[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};

/* An error of rounding: smaller ones are accidental. */
#define LEAST 1e-16

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
        if (c->runs[k].method == c->runs[run].method && c->runs[k].rtol < c->runs[run].rtol &&
            c->runs[k].status == KEMPE_OK && !is_within(&c->runs[k], level))
            return false;
    return true;
}

/* The complete run of the method at the next coarser tolerance, -1: none. */
static int next_coarser(const kempe_comparison *c, int run)
{
    int found = -1;
    for (int k = 0; k < c->count; k++)
        if (c->runs[k].method == c->runs[run].method && c->runs[k].status == KEMPE_OK &&
            c->runs[k].rtol > c->runs[run].rtol && (found < 0 || c->runs[k].rtol < c->runs[found].rtol))
            found = k;
    return found;
}

static double between(double tight, double coarse, double part)
{
    return exp((1 - part) * log(tight) + part * log(coarse));
}

/* The cost at the level: where the next coarser run is outside it and cheaper, the point of the level on the straight
 * line between both in logarithms of error and cost. An error below ten times the reference's is taken as that. */
static kmp_method_cost cost_of(const kempe_comparison *c, int run, double level)
{
    const kmp_compared *tight = &c->runs[run];
    kmp_method_cost cost = {tight->cpu_s, (double)tight->report.steps, (double)tight->report.rhs};
    int k = next_coarser(c, run);
    const kmp_compared *coarse = k >= 0 ? &c->runs[k] : tight;
    double least = fmax(10 * c->uncertainty[KMP_QUANTITY_Q], LEAST);
    double in = fmax(tight->verdict.error[KMP_QUANTITY_Q], least), out = coarse->verdict.error[KMP_QUANTITY_Q];
    if (!(out > level) || !(in < level) || !(coarse->cpu_s < tight->cpu_s) || coarse->report.steps < 1)
        return cost;
    double part = log(level / in) / log(out / in);
    return (kmp_method_cost){between(cost.cpu_s, coarse->cpu_s, part),
                             between(cost.steps, (double)coarse->report.steps, part),
                             between(cost.rhs, (double)coarse->report.rhs, part)};
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
        int *own = &c->levels.run[(int)(c->runs[k].method - c->methods) * KMP_MOST_LEVELS + l];
        if (!counts(c, k, levels[l]))
            continue;
        if (is_cheaper(c, k, *own))
            *own = k;
    }
    /* The cheapest method at a level. */
    double least = INFINITY;
    for (int w = 0; w < c->method_count; w++) {
        int place = w * KMP_MOST_LEVELS + l, run = c->levels.run[place];
        c->levels.cost[place] = run >= 0 ? cost_of(c, run, levels[l]) : (kmp_method_cost){NAN, NAN, NAN};
        if (c->levels.cost[place].cpu_s < least) {
            least = c->levels.cost[place].cpu_s;
            c->levels.best[l] = run;
        }
    }
}

void kmp_compare_levels(kempe_comparison *c)
{
    c->levels.run = KMP_ARENA_NEW(&c->arena, int, KMP_MOST_LEVELS * c->method_count);
    c->levels.cost = KMP_ARENA_NEW(&c->arena, kmp_method_cost, KMP_MOST_LEVELS * c->method_count);
    if (!c->has_reference || c->arena.failed)
        return;
    for (int k = 0; k < KMP_MOST_LEVELS * c->method_count; k++)
        c->levels.run[k] = -1;
    c->levels.count = KMP_MOST_LEVELS;
    for (int l = 0; l < KMP_MOST_LEVELS; l++)
        settle(c, l);
}
