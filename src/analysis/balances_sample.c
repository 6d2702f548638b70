/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/balances.h"
#include "analysis/way.h"
#include "constraints/assemble.h"
#include "constraints/charts.h"
#include "constraints/doctor_walk.h"
#include <math.h>
#include <string.h>

enum { STARTS = 100, STARTS_OF_LARGE = 25, LARGE = 40 };
#define HALF_TURN 3.141592653589793
#define FAR       1.0 /* a translation is sampled within so many characteristic lengths */

typedef struct sampling {
    kempe_equilibrium *e;
    kmp_linear *l;
    const kempe_assembly *start;
    double *guess;
    bool *still; /* n: not scattered */
    unsigned state;
} sampling;

/* Coordinates that nothing depends on, at the equilibrium at hand, and those that move steadily. */
static void find_still(sampling *s)
{
    const kempe_equilibrium *e = s->e;
    for (int k = 0; e->count > 0 && k < e->balance[0].idle_count; k++)
        s->still[e->balance[0].idle[k]] = true;
    for (int k = 0; k < e->rate_count; k++)
        s->still[e->rates[k].coordinate] = true;
}

static void scatter(sampling *s)
{
    const kempe_system *system = s->e->system;
    for (int k = 0; k < system->n; k++) {
        double reach = system->model->motions[k].rotation ? HALF_TURN : FAR * system->length;
        s->guess[k] = s->start->q[k];
        if (!s->still[k])
            s->guess[k] += reach * kmp_walk_random(&s->state);
    }
}

/* Every other one by Newton's method alone: unstable ones are found as well. */
static kempe_status try_start(sampling *s, const kempe_assembly *a)
{
    kempe_equilibrium *e = s->e;
    kmp_search search = {.rates = e->rates, .rate_count = e->rate_count, .nearest = e->starts % 2 == 0, .quiet = true};
    kmp_charts_reset(e->system, s->l->plant->chart);
    if (a->chart)
        memcpy(s->l->plant->chart, a->chart, (size_t)(KMP_CHART_SIZE * e->system->chart_count) * sizeof(double));
    kmp_plant_set_charts(s->l->plant, s->l->plant->chart);
    memcpy(s->guess, a->inner_q ? a->inner_q : a->q, (size_t)e->system->n * sizeof *s->guess);
    kempe_status status = kmp_equilibrium_find(s->l, 0, s->guess, &search);
    if (status == KEMPE_OK) {
        e->found++;
        status = kmp_balances_keep(e, s->l, &search, s->start->q);
    } else if (status == KEMPE_E_FAILED || status == KEMPE_STOPPED) { /* what is found stays */
        kmp_context_clear(e->system->context);
        status = KEMPE_OK;
    }
    return status;
}

static bool comes_before(const kempe_system *system, const kmp_balance *a, const kmp_balance *b)
{
    for (int k = 0; k < system->n; k++)
        if (fabs(a->q[k] - b->q[k]) > 1e-6 * system->scale[k])
            return a->q[k] < b->q[k];
    return false;
}

static void sort(kempe_equilibrium *e)
{
    int first = e->from_start ? 1 : 0;
    for (int i = first + 1; i < e->count; i++) {
        kmp_balance moved = e->balance[i];
        int k = i;
        for (; k > first && comes_before(e->system, &moved, &e->balance[k - 1]); k--)
            e->balance[k] = e->balance[k - 1];
        e->balance[k] = moved;
    }
}

static kempe_status sample(sampling *s)
{
    kempe_equilibrium *e = s->e;
    int starts = e->system->n > LARGE ? STARTS_OF_LARGE : STARTS;
    while (e->starts < starts && !e->many && !kmp_interrupted(e->system->context)) {
        kempe_assembly *a = NULL;
        scatter(s);
        kmp_guess guess = {s->guess, s->still, 0, false, 0};
        kempe_status status = kmp_assemble_from(e->system, &guess, &a);
        if (status != KEMPE_OK)
            return status;
        e->starts++;
        e->closed += a->closed;
        if (a->closed)
            status = try_start(s, a);
        kempe_assembly_free(a);
        if (status != KEMPE_OK)
            return status;
    }
    sort(e);
    return KEMPE_OK;
}

kempe_status kmp_balances_sample(kempe_equilibrium *e, kmp_linear *linear, const kempe_assembly *start, int seed)
{
    int n = e->system->n;
    sampling s = {.e = e, .l = linear, .start = start, .state = (unsigned)seed};
    s.guess = KMP_ARENA_NEW(&e->arena, double, n);
    s.still = KMP_ARENA_NEW(&e->arena, bool, n);
    if (!s.guess || !s.still)
        return kmp_fail_memory(e->system->context);
    find_still(&s);
    return sample(&s);
}
