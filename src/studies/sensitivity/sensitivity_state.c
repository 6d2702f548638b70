/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivities of equilibria, and of reactions there or at the start: one row. */
#include "studies/sensitivity/sensitivity_state.h"
#include "base/memory.h"
#include "model/tables/output_table.h"
#include <kempe/sensitivity.h>
#include <string.h>

/* -- the state --------------------------------------------------------------------------------------- */

static bool make_room(kmp_sensitivity_state *x)
{
    size_t n = (size_t)x->s->system->n, count = (size_t)x->s->count, shown = (size_t)x->slopes->shown;
    x->q = KMP_NEW(double, n);
    x->qd = KMP_NEW(double, n);
    x->dq = KMP_NEW(double, n *count);
    x->dqd = KMP_NEW(double, n *count);
    x->shown = KMP_NEW(double, shown);
    x->by = KMP_NEW(double, shown *count);
    return x->q && x->qd && x->dq && x->dqd && x->shown && x->by;
}

/* The start with the accelerations that the equations give. */
static kempe_status take_start(kmp_sensitivity_state *x)
{
    kmp_linear *l = &x->varied.linear;
    kempe_status status = kmp_varied_start(&x->varied, x->q, x->qd, x->dq, x->dqd);
    if (status == KEMPE_OK)
        status = kmp_linear_choose(l, 0, x->q, NULL, 0);
    if (status != KEMPE_OK)
        return status;
    if (kmp_linear_at_rates(l, 0, x->q, x->qd, true) != KEMPE_OK)
        return kmp_fail(x->s->context, KEMPE_E_FAILED,
                        "the start has no accelerations: its closures are singular, or a coordinate moves no mass");
    return kmp_shift_at(&x->shift, l, x->slopes, KMP_KEEP_RATES, x->dq, x->dqd);
}

static kempe_status take_equilibrium(kmp_sensitivity_state *x)
{
    kmp_linear *l = &x->varied.linear;
    kempe_status status = kmp_operating_new(x->s->system, x->s->ask->at, l, &x->at);
    if (status == KEMPE_OK)
        status = kmp_operating_take(x->at, l, NULL, 0);
    if (status != KEMPE_OK)
        return status;
    memcpy(x->q, x->at->q, (size_t)l->n * sizeof *x->q);
    memcpy(x->qd, x->at->qd, (size_t)l->n * sizeof *x->qd);
    return kmp_shift_at(&x->shift, l, x->slopes, KMP_KEEP_EQUILIBRIUM, NULL, NULL);
}

kempe_status kmp_sensitivity_state_init(kmp_sensitivity_state *x, kempe_sensitivity *s, bool with_outputs)
{
    bool start = s->ask->at && strcmp(s->ask->at, "start") == 0;
    *x = (kmp_sensitivity_state){.s = s, .backend = s->ask->run.backend ? s->ask->run.backend : kmp_backend_default()};
    kempe_status status =
        kmp_slopes_new(s->system, x->backend, s->count, (const char *const *)s->name, with_outputs, &x->slopes);
    if (status == KEMPE_OK && !make_room(x))
        status = kmp_fail_memory(s->context);
    if (status == KEMPE_OK)
        status = kmp_shift_init(&x->shift, s->system, s->count, (const char *const *)s->name);
    if (status == KEMPE_OK)
        status = kmp_varied_init(&x->varied, s->system, x->backend, x->slopes);
    if (status == KEMPE_OK)
        status = start ? take_start(x) : take_equilibrium(x);
    return status;
}

void kmp_sensitivity_state_free(kmp_sensitivity_state *x)
{
    kmp_varied_free(&x->varied);
    kmp_shift_free(&x->shift);
    kmp_slopes_free(x->slopes);
    kmp_operating_free(x->at);
    double *const rooms[] = {x->q, x->qd, x->dq, x->dqd, x->shown, x->by};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
    *x = (kmp_sensitivity_state){0};
}

/* -- the row ----------------------------------------------------------------------------------------- */

/* All additional outputs, with their derivatives: shown values per parameter. */
static void look(kmp_sensitivity_state *x)
{
    kmp_instant at = kmp_linear_instant(&x->varied.linear);
    const kmp_shift *sh = &x->shift;
    const double *shown = kmp_slopes_values(&x->slopes->outputs, &at);
    if (x->slopes->shown)
        memcpy(x->shown, shown, (size_t)x->slopes->shown * sizeof *shown);
    for (int k = 0; k < x->s->count; k++) {
        kmp_direction along = {.q = sh->q + k * sh->n,
                               .qd = sh->qd + k * sh->n,
                               .qdd = sh->qdd + k * sh->n,
                               .lambda = sh->lambda + k * sh->m};
        kmp_slopes_along(x->slopes, &x->slopes->outputs, &along, k, x->by + (size_t)k * (size_t)x->slopes->shown);
    }
}

static bool is_asked(const kempe_sensitivity *s, const kmp_column *of)
{
    return of->output >= 0 && (!s->parts || s->parts[of->output] >> of->component & 1u);
}

static bool add_columns(kempe_sensitivity *s, const kmp_columns *columns, int *chosen)
{
    bool ok = true;
    for (int k = 0; ok && k < columns->count; k++)
        if (is_asked(s, &columns->of[k])) {
            chosen[s->columns] = k;
            ok = kmp_sensitivity_add_column(s, columns->name[k], columns->unit[k]);
        }
    return ok;
}

static bool add_row(kmp_sensitivity_state *x, const kmp_columns *columns, const int *chosen)
{
    kempe_sensitivity *s = x->s;
    const kmp_linear *l = &x->varied.linear;
    const kmp_shift *sh = &x->shift;
    const double *const values[] = {x->q, x->qd, l->qdd, l->lambda, x->shown};
    const double *const slopes[] = {sh->q, sh->qd, sh->qdd, sh->lambda, x->by};
    const int size[] = {sh->n, sh->n, sh->n, sh->m, x->slopes->shown};
    double *value, *slope;
    if (!kmp_sensitivity_add_row(s, 0, &value, &slope))
        return false;
    for (int c = 0; c < s->columns; c++) {
        const kmp_column *of = &columns->of[chosen[c]];
        value[c] = values[of->quantity][of->index];
        for (int k = 0; k < s->count; k++)
            slope[c * s->count + k] = slopes[of->quantity][k * size[of->quantity] + of->index];
    }
    return true;
}

static kempe_status find_row(kempe_sensitivity *s)
{
    kmp_sensitivity_state x;
    kmp_columns columns = {0};
    int *chosen = NULL;
    kempe_status status = kmp_sensitivity_state_init(&x, s, true);
    if (status == KEMPE_OK) {
        bool ok = kmp_columns_init(&columns, s->system);
        chosen = ok ? KMP_NEW(int, columns.count) : NULL;
        ok = chosen && add_columns(s, &columns, chosen);
        if (ok) {
            look(&x);
            ok = add_row(&x, &columns, chosen);
        }
        status = ok ? KEMPE_OK : kmp_fail_memory(s->context);
    }
    kmp_free(chosen);
    kmp_columns_free(&columns);
    kmp_sensitivity_state_free(&x);
    return status;
}

/* -- the kinds --------------------------------------------------------------------------------------- */

/* The default outputs: coordinates and the loads that keep them, and the model's additional outputs. */
static void place_outputs(const kempe_model *model, kmp_text *words)
{
    kmp_text_put(words, model->closure_count ? "q,lambda" : "q");
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
    if (s->ask->at && strcmp(s->ask->at, "start") == 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "the start is not an equilibrium: use 'reactions', 'modes' or 'trajectory' there");
    return find_row(s);
}

static kempe_status find_reactions(kempe_sensitivity *s)
{
    if (s->model->closure_count == 0 && !s->ask->outputs)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the model has no closures and therefore no reactions: name outputs to differentiate");
    return find_row(s);
}

const kmp_sensitivity_kind kmp_sensitivity_equilibrium = {
    .name = "equilibrium", .find = find_equilibrium, .outputs = place_outputs};

const kmp_sensitivity_kind kmp_sensitivity_reactions = {
    .name = "reactions", .find = find_reactions, .outputs = reaction_outputs};
