/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/modes/operating_family.h"
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/charts.h"
#include "constraints/rounding/mend.h"
#include <math.h>
#include <string.h>

kempe_status kmp_station_new(const kempe_system *system, const kmp_station_ask *ask, kmp_station **station)
{
    kmp_station *s = KMP_NEW(kmp_station, 1);
    if (!s)
        return kmp_fail_memory(system->context);
    s->base = system;
    s->ask = *ask;
    kempe_status status = ask->name ? kmp_variant_new(system->model, 1, &ask->name, &s->variant) : KEMPE_OK;
    if (status == KEMPE_OK && ask->name)
        status = kmp_system_of_variant(s->variant, &s->own);
    if (status == KEMPE_OK)
        status = kmp_linear_init(&s->linear, s->own ? s->own : system, kmp_backend_default());
    if (status == KEMPE_OK)
        *station = s;
    else
        kmp_station_free(s);
    return status;
}

void kmp_station_free(kmp_station *station)
{
    if (!station)
        return;
    kmp_operating_free(station->state);
    kmp_free(station->found);
    kmp_linear_free(&station->linear);
    kempe_system_free(station->own);
    kmp_variant_free(station->variant);
    kmp_free(station);
}

/* -- a state ----------------------------------------------------------------------------------------- */

/* `nearest`: any equilibrium nearby, so that one that is no longer stable is followed, too. */
static kempe_status settle(kmp_station *s, bool nearest)
{
    kmp_search search = {.newton = nearest, .rates = s->ask.rates, .rate_count = s->ask.rate_count};
    kempe_status status = kmp_operating_settle(s->state, &s->linear, &search);
    if (search.rates != s->ask.rates) {
        s->found = s->ask.rates = search.rates;
        s->ask.rate_count = search.rate_count;
    }
    return status;
}

static void forget_found(kmp_station *s)
{
    if (!s->found)
        return;
    kmp_free(s->found);
    s->found = s->ask.rates = NULL;
    s->ask.rate_count = 0;
}

static kempe_status find_state(kmp_station *s)
{
    kempe_context *context = s->base->context;
    bool settles = !s->ask.word || strcmp(s->ask.word, "equilibrium") == 0;
    if (s->state && s->state->equilibrium) {
        kempe_status status = settle(s, true);
        if (status == KEMPE_OK || status == KEMPE_STOPPED || status == KEMPE_E_MEMORY)
            return status;
        kmp_context_clear(context); /* the next search begins from the start and reports its own failure */
    }
    kmp_operating *fresh;
    KMP_TRY(kmp_operating_new(s->linear.system, settles ? "start" : s->ask.word, NULL, &fresh));
    kmp_operating_free(s->state);
    s->state = fresh;
    forget_found(s);
    return settles ? settle(s, false) : KEMPE_OK; /* here, where the equations are derived already */
}

kempe_status kmp_station_go(kmp_station *station, double value, kmp_modes *modes)
{
    kmp_station *s = station;
    kempe_context *context = s->base->context;
    kempe_status status = s->variant ? kmp_linear_vary(&s->linear, s->own, s->variant, &value) : KEMPE_OK;
    if (s->ask.varies)
        s->ask.varies->rate = value;
    if (status == KEMPE_OK)
        status = find_state(s);
    if (status != KEMPE_OK)
        return status;
    KMP_TRY(kmp_operating_take(s->state, &s->linear, s->ask.wish, s->ask.wish_count));
    if (s->linear.p == 0)
        return kmp_fail(context, KEMPE_E_FAILED, "there are no degrees of freedom, and so no modes");
    kmp_linear_matrices(&s->linear);
    return kmp_modes_init(modes, &s->linear);
}

/* -- pictures ---------------------------------------------------------------------------------------- */

int kmp_station_move(kmp_station *station, const kmp_modes *modes, int c, double amplitude, double angle, double *q)
{
    const kmp_linear *l = &station->linear;
    const double *re = modes->re + (ptrdiff_t)c * l->n, *im = modes->im + (ptrdiff_t)c * l->n;
    for (int i = 0; i < l->n; i++)
        q[i] = l->q[i] + amplitude * (re[i] * cos(angle) - im[i] * sin(angle));
    return kmp_reduction_close(&station->linear.red, l->t, q, NULL, 0);
}
