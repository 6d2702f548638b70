/* SPDX-License-Identifier: BSD-3-Clause */
/* The two tables at equal error: one integrator on several formulations, which shows what a formulation costs, and the
 * best method of each formulation, which is what a user chooses from. */
#include "integrators/steppers/solver.h"
#include "studies/compare/compare_study.h"
#include <math.h>
#include <string.h>

/* The errors of q that most users mean. */
static const double usual[KMP_MOST_AIMS] = {1e-6, 1e-8};

/* -- aims -------------------------------------------------------------------------------------------- */

static bool is_reported(const kempe_comparison *c, int l)
{
    return !c->levels.blank[l] && c->levels.best[l] >= 0;
}

/* The usual error levels for which statements are possible; if there are none, the finest possible one. */
static kmp_aims choose_aims(const kempe_comparison *c)
{
    kmp_aims a = {0};
    int finest = -1;
    for (int l = 0; l < c->levels.count; l++) {
        if (!is_reported(c, l))
            continue;
        finest = l;
        for (int k = 0; k < KMP_MOST_AIMS; k++)
            if (fabs(log10(c->levels.level[l] / usual[k])) < 0.01)
                a.level[a.count++] = l;
    }
    if (a.count == 0 && finest >= 0)
        a = (kmp_aims){1, {finest}};
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

double kmp_compare_worst(const kempe_comparison *c, const kmp_aims *aims, int method)
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

static bool spans_formulations(const kempe_comparison *c, int method)
{
    for (int w = 0; w < c->method_count; w++)
        if (same_family(c, w, method) && !same_formulation(c, w, method))
            return true;
    return false;
}

static bool is_first_of_family(const kempe_comparison *c, int method)
{
    int first = 0;
    while (!same_family(c, first, method))
        first++;
    return first == method;
}

/* -- the best of each formulation -------------------------------------------------------------------- */

/* True if a method attains more aims than another, or as many at a smaller worst ratio. */
static bool is_better(const kempe_comparison *c, int method, int than)
{
    for (kmp_aims a = c->tables.aims; a.count > 0; a.count--) {
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
    for (int first = 0; first < c->method_count; first++)
        for (int w = first; w < c->method_count && is_first_of_family(c, first) && spans_formulations(c, first); w++)
            if (same_family(c, w, first))
                t->same[t->same_count++] = w;
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
