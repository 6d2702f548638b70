/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/modes/operating_family.h"
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/charts.h"
#include "constraints/rounding/mend.h"
#include <math.h>
#include <string.h>

static kempe_status prepare(kmp_station *s)
{
    const kmp_station_ask *ask = &s->ask;
    s->rates = KMP_ARENA_NEW(&s->arena, kmp_steady, s->base->n);
    if (!s->rates)
        return kmp_fail_memory(s->base->context);
    s->rate_count = ask->rate_count;
    if (ask->rate_count > 0)
        memcpy(s->rates, ask->rates, (size_t)ask->rate_count * sizeof *s->rates);
    if (ask->name) {
        KMP_TRY(kmp_variant_new(s->base->model, 1, &ask->name, &s->variant));
        KMP_TRY(kmp_system_of_variant(s->variant, &s->own));
    }
    return kmp_linear_init(&s->linear, s->own ? s->own : s->base, kmp_backend_default());
}

kempe_status kmp_station_new(const kempe_system *system, const kmp_station_ask *ask, kmp_station **station)
{
    kmp_station *s = KMP_NEW(kmp_station, 1);
    if (!s)
        return kmp_fail_memory(system->context);
    *s = (kmp_station){.base = system, .ask = *ask};
    kempe_status status = prepare(s);
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
    kmp_linear_free(&station->linear);
    kempe_system_free(station->own);
    kmp_variant_free(station->variant);
    kmp_arena_free(&station->arena);
    kmp_free(station);
}

/* -- a state ----------------------------------------------------------------------------------------- */

/* `nearest`: any equilibrium nearby, so that one that is no longer stable is followed, too. */
static kempe_status settle(kmp_station *s, bool nearest)
{
    kmp_search search = {.newton = nearest, .rates = s->rates, .rate_count = s->rate_count};
    kempe_status status = kmp_operating_settle(s->state, &s->linear, &search);
    if (status == KEMPE_OK)
        s->rate_count = search.rate_count; /* of a steady motion that was found where there is no rest */
    return status;
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
    s->rate_count = s->ask.rate_count;
    return settles ? settle(s, false) : KEMPE_OK; /* here, where the equations are derived already */
}

kempe_status kmp_station_go(kmp_station *station, double value, kmp_modes *modes)
{
    kmp_station *s = station;
    kempe_context *context = s->base->context;
    KMP_TRY(s->variant ? kmp_linear_vary(&s->linear, s->own, s->variant, &value) : KEMPE_OK);
    if (s->ask.varies)
        s->rates[s->ask.varies - s->ask.rates].rate = value;
    KMP_TRY(find_state(s));
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
