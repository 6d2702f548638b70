/* SPDX-License-Identifier: BSD-3-Clause */
/* The tables at equal error: the cheapest run of each method within a level of error, except accidental ones, and what
 * the method would need for the level itself; one integrator on several formulations, which shows what a formulation
 * costs; the best method of each formulation, which is what a user chooses from. */
#include "studies/compare/compare_levels.h"
#include "integrators/steppers/solver.h"
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

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

static double between(double tight, double coarse, double part)
{
    return exp((1 - part) * log(tight) + part * log(coarse));
}

/* The cost at the level: where the next coarser run is outside it and cheaper, the point of the level on the straight
 * line between both in logarithms of error and cost. An error below ten times the reference's is taken as that. */
static kmp_method_cost cost_of(const kempe_comparison *c, int run, double level)
{
    const kmp_compared *tight = &c->runs[run], *coarse = tight;
    kmp_method_cost cost = {tight->cpu_s, (double)tight->report.steps, (double)tight->report.rhs};
    /* The complete run of the method at the next coarser tolerance. */
    for (const kmp_compared *r = c->runs; r < c->runs + c->count; r++)
        if (r->method == tight->method && r->status == KEMPE_OK && r->rtol > tight->rtol &&
            (coarse == tight || r->rtol < coarse->rtol))
            coarse = r;
    double least = fmax(10 * c->uncertainty[KMP_QUANTITY_Q], LEAST);
    double in = fmax(tight->verdict.error[KMP_QUANTITY_Q], least), out = coarse->verdict.error[KMP_QUANTITY_Q];
    if (!(out > level) || !(in < level) || !(coarse->cpu_s < tight->cpu_s) || coarse->report.steps < 1)
        return cost;
    double part = log(level / in) / log(out / in);
    return (kmp_method_cost){between(cost.cpu_s, coarse->cpu_s, part),
                             between(cost.steps, (double)coarse->report.steps, part),
                             between(cost.rhs, (double)coarse->report.rhs, part)};
}

/* The cheapest run of each method within a level, and the cheapest method there. */
static void find_cheapest(kempe_comparison *c, int l)
{
    c->levels.level[l] = levels[l];
    c->levels.best[l] = -1;
    c->levels.blank[l] = !(levels[l] >= 10 * c->uncertainty[KMP_QUANTITY_Q]);
    for (int k = 0; k < c->count && !c->levels.blank[l]; k++) {
        int *own = &c->levels.run[(int)(c->runs[k].method - c->methods) * KMP_MOST_LEVELS + l];
        if (counts(c, k, levels[l]) && (*own < 0 || c->runs[k].cpu_s < c->runs[*own].cpu_s))
            *own = k;
    }
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
        find_cheapest(c, l);
}

/* The errors of q that most users mean. */
static const double usual[KMP_MOST_AIMS] = {1e-6, 1e-8};

/* -- aims -------------------------------------------------------------------------------------------- */

/* The usual error levels for which statements are possible; if there are none, the finest possible one. */
static kmp_error_levels choose_aims(const kempe_comparison *c)
{
    kmp_error_levels a = {0};
    int finest = -1;
    for (int l = 0; l < c->levels.count; l++) {
        if (c->levels.blank[l] || c->levels.best[l] < 0)
            continue;
        finest = l;
        for (int k = 0; k < KMP_MOST_AIMS; k++)
            if (fabs(log10(c->levels.level[l] / usual[k])) < 0.01)
                a.level[a.count++] = l;
    }
    if (a.count == 0 && finest >= 0)
        a = (kmp_error_levels){1, {finest}};
    return a;
}

/* -- costs ------------------------------------------------------------------------------------------- */

kmp_method_cost kmp_compare_cost(const kempe_comparison *c, int method, int level)
{
    return c->levels.cost[method * c->levels.count + level];
}

double kmp_compare_ratio(const kempe_comparison *c, int method, int level)
{
    double cpu_s = kmp_compare_cost(c, method, level).cpu_s;
    int best = c->levels.best[level];
    return isnan(cpu_s) ? INFINITY : cpu_s / kmp_compare_cost(c, (int)(c->runs[best].method - c->methods), level).cpu_s;
}

double kmp_compare_worst(const kempe_comparison *c, const kmp_error_levels *aims, int method)
{
    double worst = 0;
    for (int k = 0; k < aims->count; k++)
        worst = fmax(worst, kmp_compare_ratio(c, method, aims->level[k]));
    return worst;
}

double kmp_compare_first_s(const kempe_comparison *c, const kmp_compared *run)
{
    return c->system->build_s + run->build_s + run->cpu_s;
}

/* -- the same integrator ----------------------------------------------------------------------------- */

static bool same_family(const kempe_comparison *c, int a, int b)
{
    return strcmp(kmp_solver_family(c->methods[a].integrator), kmp_solver_family(c->methods[b].integrator)) == 0;
}

static bool same_formulation(const kempe_comparison *c, int a, int b)
{
    return strcmp(c->methods[a].formulation, c->methods[b].formulation) == 0;
}

int kmp_compare_base(const kempe_comparison *c, int method, int level)
{
    for (int w = 0; w < c->method_count; w++)
        if (same_family(c, w, method) && !isnan(kmp_compare_cost(c, w, level).cpu_s))
            return w;
    return -1;
}

int kmp_compare_best(const kempe_comparison *c, int level)
{
    for (int k = 0; k < c->tables.best_count; k++)
        if (!isnan(kmp_compare_cost(c, c->tables.best[k], level).cpu_s))
            return c->tables.best[k];
    return -1;
}

/* -- the best of each formulation -------------------------------------------------------------------- */

/* True if a method attains more aims than another, or as many at a smaller worst ratio. */
static bool is_better(const kempe_comparison *c, int method, int than)
{
    for (kmp_error_levels a = c->tables.aims; a.count > 0; a.count--) {
        double own = kmp_compare_worst(c, &a, method), other = kmp_compare_worst(c, &a, than);
        if (isfinite(own) || isfinite(other))
            return own < other;
    }
    return false;
}

void kmp_compare_tables(kempe_comparison *c)
{
    c->tables = (kmp_tables){.aims = choose_aims(c),
                             .same = KMP_ARENA_NEW(&c->arena, int, c->method_count),
                             .best = KMP_ARENA_NEW(&c->arena, int, c->method_count)};
    if (c->arena.failed || c->tables.aims.count == 0)
        return;
    /* Methods of families that stand in several formulations. */
    kmp_tables *t = &c->tables;
    for (int first = 0; first < c->method_count; first++) {
        bool is_first = true, spans = false;
        for (int w = 0; w < c->method_count; w++) {
            is_first = is_first && (w >= first || !same_family(c, w, first));
            spans = spans || (same_family(c, w, first) && !same_formulation(c, w, first));
        }
        for (int w = first; w < c->method_count && is_first && spans; w++)
            if (same_family(c, w, first))
                t->same[t->same_count++] = w;
    }
    /* The best method of each formulation. */
    for (int w = 0; w < c->method_count; w++) {
        int k = 0;
        while (k < t->best_count && !same_formulation(c, t->best[k], w))
            k++;
        if (k == t->best_count)
            t->best[t->best_count++] = w;
        else if (is_better(c, w, t->best[k]))
            t->best[k] = w;
    }
    /* Best of all first. */
    int *best = c->tables.best;
    for (int i = 1; i < c->tables.best_count; i++)
        for (int k = i; k > 0 && is_better(c, best[k], best[k - 1]); k--) {
            int swap = best[k];
            best[k] = best[k - 1];
            best[k - 1] = swap;
        }
}
