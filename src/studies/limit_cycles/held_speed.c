/* SPDX-License-Identifier: BSD-3-Clause */
/* Vehicles whose speed no force decides, or a load holds (studies/equilibrium/running_state.c): in a limit cycle they
 * keep the speed of the start, by a load that changes over the period. The equations are those of a copy of the model,
 * in which drives have these rates. */
#include "base/memory.h"
#include "constraints/closing/charts.h"
#include "studies/limit_cycles/limit_cycles_study.h"
#include <string.h>

static bool is_held(const kempe_limit_cycles *c, int motion)
{
    for (int k = 0; k < c->held; k++)
        if (c->held_motion[k] == motion)
            return true;
    return false;
}

/* The first track that is curved, inclined or irregular; NULL: there is none. */
static const kmp_track *find_curved(const kempe_model *model)
{
    for (int k = 0; k < model->track_count; k++)
        if (model->tracks[k].curved)
            return &model->tracks[k];
    return NULL;
}

/* The copy of the model: with drives, and unless `as_given` a start at which all independent coordinates keep their
 * values. */
static kempe_status make_copy(kempe_limit_cycles *c, bool as_given)
{
    const kmp_linear *l = &c->family->linear;
    bool *hold = KMP_ARENA_NEW(&c->arena, bool, l->n);
    KMP_TRY(kmp_made(c->system->context, hold));
    for (int k = 0; k < l->p; k++)
        hold[l->part.u[k]] = !is_held(c, l->part.u[k]);
    const kmp_operating *state = c->family->state;
    as_given = as_given || !kmp_charts_are_own(c->system, state->chart);
    const kmp_driven driven = {c->held, c->held_motion, as_given ? NULL : hold, state->q};
    KMP_TRY(kmp_variant_driven(c->system->model, &driven, &c->copy));
    return kempe_system_new(c->copy, &c->driven);
}

static kempe_status hold_speed(kempe_limit_cycles *c, bool as_given)
{
    const kmp_operating_family_options options = {.name = c->name};
    kmp_modes modes;
    KMP_TRY(kmp_operating_family_new(c->system, &options, &c->family));
    KMP_TRY(kmp_operating_family_go(c->family, c->from, &modes));
    kmp_modes_free(&modes);
    /* Coordinates whose rates no force decides, or a load holds, at the state of the family. */
    const kmp_operating_family *f = c->family;
    const kempe_model *model = c->system->model;
    c->held_motion = KMP_ARENA_NEW(&c->arena, int, f->rate_count);
    KMP_TRY(kmp_made(c->system->context, c->held_motion));
    for (int k = 0; k < f->rate_count; k++) {
        int motion = f->rates[k].coordinate;
        if (f->rates[k].how != KMP_RATE_KEPT && f->rates[k].how != KMP_RATE_HELD)
            continue;
        if (!model->start.qd_given[motion])
            return kmp_fail(c->system->context, KEMPE_E_FAILED,
                            "the rate of '%s' is that of the start, which no force decides, and the start does not "
                            "give it: add it (start: {qd: {%s: ..}}), or drive it at a constant rate (drives:)",
                            model->motions[motion].name, model->motions[motion].name);
        c->held_motion[c->held++] = motion;
    }
    const kmp_track *curved = c->held > 0 ? find_curved(c->system->model) : NULL;
    if (curved)
        KMP_TRY(
            kmp_fail(c->system->context, KEMPE_E_FAILED,
                     "track '%s' is curved, inclined or irregular, so that motions along it are not periodic; take a "
                     "straight one, or find the motions that simulations reach (--settle T)",
                     curved->name));
    return c->held > 0 || (c->system->m > 0 && !as_given) ? make_copy(c, as_given) : KEMPE_OK;
}

kempe_status kmp_cycles_hold_speed(kempe_limit_cycles *cycles)
{
    kempe_limit_cycles *c = cycles;
    bool tries = c->settle > 0;
    if (tries && (c->system->model->wheel_count == 0 || find_curved(c->system->model)))
        return KEMPE_OK;
    kempe_status status = hold_speed(c, tries);
    kmp_operating_family_free(c->family);
    c->family = NULL;
    if (!tries || status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(c->system->context);
    c->held = 0;
    return KEMPE_OK;
}

/* -- loads --------------------------------------------------------------------------------------------- */

bool kmp_cycles_words(const kempe_limit_cycles *cycles, const char *outputs, kmp_text *words)
{
    kmp_text_put(words, outputs);
    for (int k = 0; k < cycles->held; k++)
        kmp_text_printf(words, ",lambda(load.%s)", cycles->system->model->motions[cycles->held_motion[k]].name);
    return !words->failed;
}

kempe_status kmp_cycles_name(kempe_limit_cycles *cycles, int count, char *const *columns, char *const *units,
                             int **load)
{
    kempe_limit_cycles *c = cycles;
    int *column = *load = KMP_ARENA_NEW(&c->arena, int, c->held), outputs = count;
    for (int k = c->held - 1; column && k >= 0; k--) {
        const char *name =
            kmp_arena_printf(&c->arena, "lambda.load.%s.1", c->system->model->motions[c->held_motion[k]].name);
        column[k] = -1;
        for (int i = 0; name && i < count; i++)
            column[k] = strcmp(columns[i], name) == 0 ? i : column[k];
        outputs -= column[k] == outputs - 1; /* a caller who asks for all multipliers has them among them */
    }
    c->output = KMP_ARENA_NEW(&c->arena, char *, outputs);
    c->unit = KMP_ARENA_NEW(&c->arena, char *, outputs);
    for (int k = 0; !c->arena.failed && k < outputs; k++) {
        c->output[k] = kmp_arena_strdup(&c->arena, columns[k]);
        c->unit[k] = kmp_arena_strdup(&c->arena, units[k]);
    }
    c->outputs = c->arena.failed ? 0 : outputs;
    return kmp_made(c->system->context, !c->arena.failed);
}

kempe_status kmp_cycles_flow(kempe_limit_cycles *cycles, const char *outputs, const kempe_run_options *run, int count,
                             const kmp_flow_entry *entry)
{
    kempe_limit_cycles *c = cycles;
    kmp_text words = {0};
    kempe_status status = !kmp_cycles_words(c, outputs, &words)
                              ? kmp_fail_memory(c->system->context)
                              : kmp_flow_new(kmp_cycles_equations(c), c->name, words.s, run, count, entry, &c->flow);
    kmp_text_free(&words);
    KMP_TRY(status);
    const kempe_sensitivity *rows = c->flow->rows;
    int *load;
    KMP_TRY(kmp_cycles_name(c, rows->columns, rows->column, rows->unit, &load));
    return kmp_shooting_init(&c->shooting, c->flow, c->held, load, &c->arena);
}

void kmp_cycles_loads_at_rest(const kempe_limit_cycles *cycles, kmp_cycle *hopf)
{
    const kmp_linear *l = &cycles->family->linear;
    for (int r = 0; r < l->m; r++) {
        int k = l->system->rows[r].closure - cycles->system->model->closure_count;
        if (k >= 0 && k < cycles->held)
            hopf->load[k] = l->lambda[r];
    }
}
