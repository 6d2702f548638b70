/* SPDX-License-Identifier: BSD-3-Clause */
/* States along a varied parameter: each equilibrium begins at the last one, with the rates that the start has at the
 * new value. */
#include "analyses/modes/operating_family.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/inexact/nearest_exact.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

static kempe_status prepare(kmp_operating_family *s)
{
    const kmp_operating_family_options *options = &s->options;
    KMP_TRY(kmp_made(s->base->context, KMP_ARENA_MAKE(&s->arena, KMP_ROOM(kmp_steady, s->base->n, &s->rates),
                                                      KMP_ROOM(double, s->base->n, &s->begun))));
    s->rate_count = options->rate_count;
    if (options->rate_count > 0)
        memcpy(s->rates, options->rates, (size_t)options->rate_count * sizeof *s->rates);
    if (options->name) {
        KMP_TRY(kmp_variant_new(s->base->model, 1, &options->name, &s->variant));
        KMP_TRY(kmp_system_of_variant(s->variant, &s->own));
    }
    return kmp_linear_init(&s->linear, s->own ? s->own : s->base, kmp_backend_default());
}

kempe_status kmp_operating_family_new(const kempe_system *system, const kmp_operating_family_options *options,
                                      kmp_operating_family **family)
{
    KMP_MAKE(system->context, kmp_operating_family, s);
    *s = (kmp_operating_family){.base = system, .options = *options};
    kempe_status status = prepare(s);
    return KMP_GIVE_OR_FREE(status, family, s, kmp_operating_family_free);
}

KMP_FREES(kmp_operating_family, family, kmp_operating_free(family->state), kmp_linear_free(&family->linear),
          kempe_system_free(family->own), kmp_variant_free(family->variant), kmp_arena_free(&family->arena))

/* -- a state ----------------------------------------------------------------------------------------- */

/* `nearest`: any equilibrium nearby, so that one that is no longer stable is followed, too. */
static kempe_status settle(kmp_operating_family *s, bool nearest)
{
    kmp_search search = {.newton = nearest, .told = s->options.told, .rates = s->rates, .rate_count = s->rate_count};
    kempe_status status = kmp_operating_settle(s->state, &s->linear, &search);
    if (status == KEMPE_OK)
        s->rate_count = search.rate_count; /* of a steady motion that was found where there is no rest */
    return status;
}

static bool moves(const kmp_operating *o)
{
    for (int i = 0; i < o->system->n; i++)
        if (o->inner_qd[i] != 0)
            return true;
    return false;
}

/* Takes the rates of the start at the value that varies, if those of a steady motion are found from it. A rate that
 * forces decide changes as that of the start: otherwise wheels would slide at another speed. *anew: the last state is
 * at rest, but the start moves now, so that a steady motion may be found. */
static kempe_status follow_start(kmp_operating_family *s, bool *anew)
{
    const bool follows = s->rate_count > s->options.rate_count || (s->rate_count == 0 && !moves(s->state));
    *anew = false;
    if (!s->variant || !follows)
        return KEMPE_OK;
    kmp_operating *start;
    KMP_TRY(kmp_operating_new(s->linear.system, "start", NULL, &start));
    *anew = s->rate_count == 0 && moves(start);
    for (int i = s->options.rate_count; i < s->rate_count; i++) {
        kmp_steady *found = &s->rates[i];
        const double rate = start->inner_qd[found->coordinate], before = s->begun[found->coordinate];
        if (found->how != KMP_RATE_FREED)
            found->rate = rate;
        else if (before != 0)
            found->rate *= rate / before;
    }
    memcpy(s->begun, start->inner_qd, (size_t)s->base->n * sizeof *s->begun);
    kmp_operating_free(start);
    return KEMPE_OK;
}

static kempe_status find_state(kmp_operating_family *s)
{
    kempe_context *context = s->base->context;
    bool settles = !s->options.word || strcmp(s->options.word, "equilibrium") == 0;
    bool anew = false;
    if (settles && s->state && s->state->equilibrium)
        KMP_TRY(follow_start(s, &anew));
    if (s->state && s->state->equilibrium && !anew) {
        kempe_status status = settle(s, true);
        if (status == KEMPE_OK || status == KEMPE_STOPPED || status == KEMPE_E_MEMORY)
            return status;
        kmp_context_clear(context); /* the next search begins from the start and reports its own failure */
    }
    kmp_operating *fresh;
    KMP_TRY(kmp_operating_new(s->linear.system, settles ? "start" : s->options.word, NULL, &fresh));
    kmp_operating_free(s->state);
    s->state = fresh;
    s->rate_count = s->options.rate_count;
    memcpy(s->begun, fresh->inner_qd, (size_t)s->base->n * sizeof *s->begun);
    return settles ? settle(s, false) : KEMPE_OK; /* here, where the equations are derived already */
}

kempe_status kmp_operating_family_go(kmp_operating_family *s, double value, kmp_modes *modes)
{
    KMP_TRY(s->variant ? kmp_linear_vary(&s->linear, s->own, s->variant, &value) : KEMPE_OK);
    if (s->options.varies)
        s->rates[s->options.varies - s->options.rates].rate = value;
    KMP_TRY(find_state(s));
    KMP_TRY(kmp_operating_take(s->state, &s->linear, s->options.wish, s->options.wish_count));
    KMP_TRY(kmp_averaged_judge(s->options.averaged, &s->linear));
    kmp_linear_matrices(&s->linear);
    kmp_linear_tell_tables(&s->linear);
    KMP_TRY(kmp_modes_init(modes, &s->linear, s->brief));
    if (!s->options.spare)
        modes->count = modes->spectrum.count = modes->shown;
    return KEMPE_OK;
}

/* -- pictures ---------------------------------------------------------------------------------------- */

int kmp_operating_family_move(kmp_operating_family *family, const kmp_modes *modes, int c, double amplitude,
                              double angle, double *q)
{
    const kmp_linear *l = &family->linear;
    const double *re = modes->re + (ptrdiff_t)c * l->n, *im = modes->im + (ptrdiff_t)c * l->n;
    for (int i = 0; i < l->n; i++)
        q[i] = l->q[i] + amplitude * (re[i] * cos(angle) - im[i] * sin(angle));
    return kmp_reduction_close(&family->linear.red, l->t, q, NULL, 0);
}
