/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivities of equilibria, and of reactions there or at the start: one row. */
#include "studies/sensitivity/sensitivity_state.h"
#include "model/tables/output_table.h"
#include <string.h>

/* -- the state --------------------------------------------------------------------------------------- */

static bool make_room(kmp_sensitivity_state *x)
{
    int n = x->s->system->n, count = x->s->count, shown = x->slopes->shown;
    return KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, n, &x->q, &x->qd), KMP_ROOM(double, n *count, &x->dq, &x->dqd),
                          KMP_ROOM(double, shown, &x->shown), KMP_ROOM(double, shown *count, &x->by));
}

/* The start with the accelerations that the equations give. */
static kempe_status take_start(kmp_sensitivity_state *x)
{
    kmp_linear *l = &x->varied.linear;
    KMP_TRY(kmp_varied_start(&x->varied, x->q, x->qd, x->dq, x->dqd));
    KMP_TRY(kmp_linear_choose(l, 0, x->q, NULL, 0));
    if (kmp_linear_at_rates(l, 0, x->q, x->qd, true) != KEMPE_OK)
        return kmp_fail(x->s->context, KEMPE_E_FAILED,
                        "the start has no accelerations: its closures are singular, or a coordinate moves no mass");
    return kmp_state_sensitivity_at(&x->sensitivity_of_state, l, x->slopes, KMP_KEEP_RATES, x->dq, x->dqd);
}

static kempe_status take_equilibrium(kmp_sensitivity_state *x)
{
    kmp_linear *l = &x->varied.linear;
    KMP_TRY(kmp_operating_new(x->s->system, x->s->options->at, l, &x->at));
    if (x->at->held)
        return kmp_fail(x->s->context, KEMPE_E_FAILED,
                        "the speed of the steady motion is held by a load, whose derivatives are not supported; drive "
                        "the vehicle in the model (drives:), or vary a parameter by 'modes --sweep'");
    /* Rates that are those of the start are constants here: they must not change with a parameter. */
    int n = x->s->system->n;
    KMP_TRY(x->at->kept_count > 0 ? kmp_varied_start(&x->varied, x->q, x->qd, x->dq, x->dqd) : KEMPE_OK);
    for (int i = 0; i < x->at->kept_count; i++)
        for (int k = 0; k < x->s->count; k++)
            if (x->dqd[x->at->kept[i] + k * n] != 0)
                return kmp_fail(x->s->context, KEMPE_E_FAILED,
                                "the steady motion keeps the rate of '%s' as at the start, which depends on '%s': "
                                "derivatives of such a rate are not supported; omit the parameter, or vary it by "
                                "'modes --sweep'",
                                x->s->system->model->motions[x->at->kept[i]].name, x->s->name[k]);
    KMP_TRY(kmp_operating_take(x->at, l, NULL, 0));
    KMP_TRY(kmp_averaged_judge(x->s->averaged, l));
    memcpy(x->q, x->at->q, (size_t)l->n * sizeof *x->q);
    memcpy(x->qd, x->at->qd, (size_t)l->n * sizeof *x->qd);
    return kmp_state_sensitivity_at(&x->sensitivity_of_state, l, x->slopes, KMP_KEEP_EQUILIBRIUM, NULL, NULL);
}

kempe_status kmp_sensitivity_state_init(kmp_sensitivity_state *x, kempe_sensitivity *s, bool with_outputs)
{
    bool start = s->options->at && strcmp(s->options->at, "start") == 0;
    *x = (kmp_sensitivity_state){.s = s, .backend = s->run->backend ? s->run->backend : kmp_backend_default()};
    KMP_TRY(kmp_slopes_new(s->system, x->backend, s->count, (const char *const *)s->name, with_outputs, &x->slopes));
    KMP_TRY(kmp_made(s->context, make_room(x)));
    KMP_TRY(kmp_state_sensitivity_init(&x->sensitivity_of_state, s->system, s->count, (const char *const *)s->name));
    KMP_TRY(kmp_varied_init(&x->varied, s->system, x->backend, x->slopes));
    return start ? take_start(x) : take_equilibrium(x);
}

void kmp_sensitivity_state_free(kmp_sensitivity_state *x)
{
    kmp_varied_free(&x->varied);
    kmp_state_sensitivity_free(&x->sensitivity_of_state);
    kmp_slopes_free(x->slopes);
    kmp_operating_free(x->at);
    kmp_arena_free(&x->arena);
    *x = (kmp_sensitivity_state){0};
}

/* -- the row ----------------------------------------------------------------------------------------- */

static bool add_row(kmp_sensitivity_state *x)
{
    const kmp_linear *l = &x->varied.linear;
    const kmp_state_sensitivity *sh = &x->sensitivity_of_state;
    double *row = kmp_sensitivity_add_row(x->s, 0);
    if (row)
        kmp_sensitivity_fill(x->s,
                             &(kmp_sensitivity_source){{x->q, x->qd, l->qdd, l->lambda, x->shown},
                                                       {sh->q, sh->qd, sh->qdd, sh->lambda, x->by},
                                                       x->slopes->shown},
                             row);
    return row;
}

static kempe_status find_row(kempe_sensitivity *s)
{
    kmp_sensitivity_state x;
    kempe_status status = kmp_sensitivity_state_init(&x, s, true);
    if (status == KEMPE_OK && !kmp_sensitivity_choose(s))
        status = kmp_fail_memory(s->context);
    if (status == KEMPE_OK) {
        /* All additional outputs, with their derivatives: shown values per parameter. */
        kmp_instant at = kmp_linear_instant(&x.varied.linear);
        const kmp_state_sensitivity *sh = &x.sensitivity_of_state;
        const double *shown = kmp_slopes_values(&x.slopes->outputs, &at);
        if (x.slopes->shown)
            memcpy(x.shown, shown, (size_t)x.slopes->shown * sizeof *shown);
        for (int k = 0; k < x.s->count; k++) {
            kmp_direction along = {.q = sh->q + k * sh->n,
                                   .qd = sh->qd + k * sh->n,
                                   .qdd = sh->qdd + k * sh->n,
                                   .lambda = sh->lambda + k * sh->m};
            kmp_slopes_along(x.slopes, &x.slopes->outputs, &along, k, x.by + (size_t)k * (size_t)x.slopes->shown);
        }
        status = add_row(&x) ? KEMPE_OK : kmp_fail_memory(s->context);
    }
    kmp_sensitivity_state_free(&x);
    return status;
}

/* -- the kinds --------------------------------------------------------------------------------------- */

/* The default outputs: coordinates, states and the loads that keep them, and the model's additional outputs. */
static void place_outputs(const kempe_model *model, kmp_text *words)
{
    kmp_text_printf(words, "q%s%s", model->state_count ? ",state" : "", model->closure_count ? ",lambda" : "");
    for (int o = 0; o < model->output_count; o++)
        if (kmp_output_rows[model->outputs[o].kind].width > 0) {
            kmp_text_put(words, ",");
            kmp_output_print(words, model, &model->outputs[o]);
        }
}

/* Forces of closures between points, multipliers of the others. */
static void reaction_outputs(const kempe_model *model, kmp_text *words)
{
    for (int c = 0; c < model->closure_count; c++)
        kmp_text_printf(words, "%s%s(%s)", c ? "," : "", model->closures[c].point[0] >= 0 ? "reaction" : "lambda",
                        model->closures[c].name);
}

static kempe_status find_equilibrium(kempe_sensitivity *s)
{
    if (s->options->at && strcmp(s->options->at, "start") == 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "the start is not an equilibrium: use 'reactions', 'modes' or 'trajectory' there");
    return find_row(s);
}

static kempe_status find_reactions(kempe_sensitivity *s)
{
    if (s->model->closure_count == 0 && !s->options->outputs)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the model has no closures and therefore no reactions: name outputs to differentiate");
    return find_row(s);
}

const kmp_sensitivity_kind kmp_sensitivity_equilibrium = {
    .name = "equilibrium", .find = find_equilibrium, .outputs = place_outputs, .rests = true};

const kmp_sensitivity_kind kmp_sensitivity_reactions = {
    .name = "reactions", .find = find_reactions, .outputs = reaction_outputs, .rests = true};
