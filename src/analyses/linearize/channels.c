/* SPDX-License-Identifier: BSD-3-Clause */
/* Builds the system with inputs and outputs: a variant for parameters among the inputs, outputs for force points, then
 * the linear equations at the requested state. The state is checked for equilibrium. */
#include "analyses/linearize/channels.h"
#include "base/clock.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/load_dependent.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "output/print.h"
#include "studies/simulate/observed.h"
#include <kempe/extend.h>

/* A state counts as an equilibrium when the residual R is this small relative to the forces: far above rounding, far
 * below a visible motion. */
static const double at_rest = 1e-8;

/* -- names ------------------------------------------------------------------------------------------- */

static bool names_init(kmp_channels *c, kmp_names *names, int count)
{
    *names = (kmp_names){count, KMP_ARENA_NEW(&c->arena, char *, count), KMP_ARENA_NEW(&c->arena, char *, count)};
    return !c->arena.failed;
}

static bool name_states(kmp_channels *c)
{
    static const char *const turns[] = {"rad", "rad/s"}, *const slides[] = {"m", "m/s"};
    int p = c->linear.p, width = kmp_transfer_width(&c->transfer);
    bool ok = names_init(c, &c->states, width);
    for (int i = 0; ok && i < width; i++) {
        int k = kmp_transfer_state(&c->transfer, i), coordinate = c->linear.part.u[k % p];
        const kmp_motion *motion = &c->system->model->motions[coordinate];
        bool state = kmp_state_of(c->system->model, coordinate);
        kmp_text name = {0};
        kmp_text_printf(&name, "%s.%s", state ? "state" : k < p ? "q" : "qd", motion->name);
        const char *unit = state ? "" : (motion->rotation ? turns : slides)[k / p];
        c->states.name[i] = kmp_text_keep(&name, &c->arena);
        c->states.unit[i] = kmp_arena_strdup(&c->arena, unit);
    }
    return !c->arena.failed;
}

/* In SI. */
static char *unit_of_input(kmp_arena *arena, const kmp_model_input *input, int order)
{
    kmp_text unit = {0};
    kmp_dimension dimension = input->dimension;
    for (int k = 0; k < order; k++)
        dimension = kmp_dimension_times(dimension, KMP_DIM_TIME, -1);
    if (kmp_dimension_is_physical(dimension))
        kmp_dimension_print(&unit, dimension);
    else
        kmp_text_put(&unit, "");
    return kmp_text_keep(&unit, arena);
}

static char *unit_of_load(kmp_arena *arena, const kempe_model *model, const kmp_requested_input *input, int order)
{
    static const char *const turns[] = {"rad", "rad/s", "rad/s^2"}, *const slides[] = {"m", "m/s", "m/s^2"};
    switch (input->kind) {
    case KMP_REQUESTED_EFFORT:
        return kmp_arena_strdup(arena, model->motions[input->index].rotation ? "N m" : "N");
    case KMP_REQUESTED_FORCE:
        return kmp_arena_strdup(arena, "N");
    case KMP_REQUESTED_DRIVE:
        return kmp_arena_strdup(
            arena, (model->motions[model->closures[input->index].motion].rotation ? turns : slides)[order]);
    case KMP_REQUESTED_INPUT:
        return unit_of_input(arena, &model->inputs[input->index], order);
    case KMP_REQUESTED_PARAMETER:
        break;
    }
    return kmp_arena_strdup(arena, "");
}

/* In the arena; NULL: no memory. */
static char *name_of_load(kmp_channels *c, const kmp_requested_input *input, int order)
{
    return kmp_arena_printf(&c->arena, "%s%s", input->name, kmp_derivative_ends[order]);
}

static bool name_loads(kmp_channels *c)
{
    const kmp_transfer *t = &c->transfer;
    bool ok = names_init(c, &c->loads, t->columns);
    for (int k = 0; ok && k < t->columns; k++) {
        const kmp_requested_input *input = &c->inputs.input[t->load[k].input];
        c->loads.name[k] = name_of_load(c, input, t->load[k].order);
        c->loads.unit[k] = unit_of_load(&c->arena, c->system->model, input, t->load[k].order);
    }
    return !c->arena.failed;
}

/* -- outputs ----------------------------------------------------------------------------------------- */

/* The columns of a run's table that the outputs select; NULL parts: all. */
static kempe_status take_columns(kmp_channels *c, const unsigned *parts, bool none, kmp_output_source **source)
{
    kmp_columns columns;
    KMP_TRY(kmp_made(c->system->context, kmp_columns_init(&columns, c->system, c->system->model, parts)));
    int count = none ? 0 : columns.count - 1; /* without time */
    *source = KMP_ARENA_NEW(&c->arena, kmp_output_source, count);
    bool ok = names_init(c, &c->outputs, count);
    for (int k = 0; ok && k < count; k++) {
        const kmp_column *of = &columns.of[k + 1];
        (*source)[k] = (kmp_output_source){(kmp_output_kind_of_source)of->quantity, of->index};
        c->outputs.name[k] = kmp_arena_strdup(&c->arena, columns.name[k + 1]);
        c->outputs.unit[k] = kmp_arena_strdup(&c->arena, columns.unit[k + 1]);
    }
    kmp_columns_free(&columns);
    return c->arena.failed ? kmp_fail_memory(c->system->context) : KEMPE_OK;
}

/* -- the system -------------------------------------------------------------------------------------- */

static kempe_status make_system(kmp_channels *c, const kmp_channels_options *options, int count,
                                const char *const *names, unsigned **parts, int *place)
{
    const kempe_system *given = c->given;
    KMP_TRY(kmp_variant_new(given->model, count, names, &c->variant));
    /* The outputs of the copy: the requested ones, and the positions of points with input forces. */
    kempe_model *copy = kmp_variant_model(c->variant);
    if (options->outputs)
        KMP_TRY(kmp_requested_outputs(copy, options->outputs, parts));
    for (int k = 0; k < c->inputs.count; k++) {
        if (c->inputs.input[k].kind != KMP_REQUESTED_FORCE)
            continue;
        int output = kmp_requested_position(copy, c->inputs.input[k].index, parts);
        KMP_TRY(kmp_made(copy->context, output >= 0));
        place[k] = 0;
        for (int o = 0; o < output; o++)
            place[k] += kmp_output_width(copy, &copy->outputs[o]);
    }
    KMP_TRY(kmp_system_of_variant(c->variant, &c->own));
    kempe_system_set_force(c->own, given->force, given->force_user);
    c->system = c->own;
    return KEMPE_OK;
}

/* -- the state --------------------------------------------------------------------------------------- */

/* Checks that forces are constant while the independent coordinates move at the rates of the start. */
static kempe_status judge_steady(kmp_channels *c, bool *steady)
{
    kmp_linear *l = &c->linear;
    kmp_steady *rates = KMP_ARENA_NEW(&c->arena, kmp_steady, l->p);
    kmp_search search = {.rates = rates};
    KMP_TRY(kmp_made(c->system->context, rates));
    for (int k = 0; k < l->p; k++)
        if (!kmp_state_of(l->system->model, l->part.u[k]))
            rates[search.rate_count++] =
                (kmp_steady){.coordinate = l->part.u[k], .rate = c->at->inner_qd[l->part.u[k]]};
    KMP_TRY(kmp_linear_at_rates(l, c->at->t, c->at->inner_q, c->at->inner_qd, false));
    kmp_linear_matrices(l);
    c->residual = kmp_equilibrium_residual(l);
    *steady = c->residual <= at_rest;
    kempe_status status = *steady ? kmp_operating_check(l, &search) : KEMPE_OK;
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(c->system->context); /* balanced for an instant alone */
    *steady = false;
    return KEMPE_OK;
}

/* Checks that the state is at rest or in steady motion: no acceleration, and no force that changes. */
static kempe_status judge_rest(kmp_channels *c, const int *wish, int wish_count)
{
    kmp_linear *l = &c->linear;
    KMP_TRY(kmp_operating_take(c->at, l, wish, wish_count));
    if (c->at->equilibrium) {
        c->rests = true;
        c->residual = c->at->residual;
    } else {
        KMP_TRY(judge_steady(c, &c->rests));
        KMP_TRY(kmp_operating_take(c->at, l, wish, wish_count));
    }
    for (int k = 0; k < kmp_model_coordinates(l->system->model); k++)
        c->goes_on = c->goes_on || (c->rests && l->qd[k] != 0);
    return KEMPE_OK;
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* The names of what derivatives are taken by: parameters of a variant, and after them the numbers of inputs of the
 * model. `place` of each. Their count. */
static int list_slopes(kmp_channels *c, const char **names, int *place, int *parameters)
{
    int count = 0;
    for (int k = 0; k < c->inputs.count; k++)
        if (c->inputs.input[k].kind == KMP_REQUESTED_PARAMETER) {
            place[k] = count;
            names[count++] = c->inputs.input[k].name;
        }
    *parameters = count;
    for (int k = 0; k < c->inputs.count; k++) {
        const kmp_requested_input *input = &c->inputs.input[k];
        if (input->kind != KMP_REQUESTED_INPUT)
            continue;
        place[k] = count;
        for (int order = 0; order < kmp_transfer_orders(c->given->model, input); order++)
            names[count++] = name_of_load(c, input, order);
    }
    return count;
}

static kempe_status build(kmp_channels *c, const kmp_channels_options *options)
{
    const char *backend = options->backend ? options->backend : kmp_backend_default();
    int parameters;
    unsigned *parts = NULL;
    kmp_output_source *source = NULL;
    KMP_TRY(options->inputs ? kmp_requested_inputs_read(c->system->model, options->inputs, &c->inputs) : KEMPE_OK);
    bool none = !options->outputs && c->inputs.count == 0;
    const char **names = KMP_ARENA_NEW(&c->arena, const char *, KMP_TIME_NUMBERS * c->inputs.count);
    int *place = KMP_ARENA_NEW(&c->arena, int, c->inputs.count); /* of each input, for kmp_transfer_init */
    KMP_TRY(kmp_made(c->system->context, !c->arena.failed));
    int count = list_slopes(c, names, place, &parameters);
    KMP_TRY(kmp_made(c->system->context, !c->arena.failed));
    bool own = parameters > 0 || options->outputs;
    for (int k = 0; k < c->inputs.count; k++)
        own = own || c->inputs.input[k].kind == KMP_REQUESTED_FORCE;
    if (own)
        KMP_TRY(make_system(c, options, parameters, names, &parts, place));
    KMP_TRY(take_columns(c, parts, none, &source));
    /* The state, in whose charts and coordinates the equations are linear. */
    int *wish = KMP_ARENA_NEW(&c->arena, int, c->system->n), wish_count = 0;
    KMP_TRY(kmp_made(c->system->context, wish));
    KMP_TRY(kmp_coordinates_read(c->system->model, "independent", options->independent, wish, &wish_count));
    KMP_TRY(kmp_linear_init(&c->linear, c->system, backend));
    KMP_TRY(kmp_operating_new(c->system, options->at, &c->linear, &c->at));
    kempe_status status = judge_rest(c, wish, wish_count);
    if (status == KEMPE_E_FAILED && !*kempe_context_message(c->system->context))
        return kmp_fail(c->system->context, status,
                        "%s: at this state the independent coordinates have no accelerations: the closures or the "
                        "reduced mass are singular; 'kempe check' gives details",
                        c->system->model->name);
    KMP_TRY(status);
    kmp_linear_tell_tables(&c->linear);
    KMP_TRY(kmp_averaged_judge(c->averaged, &c->linear));
    KMP_TRY(kmp_slopes_new(c->system, backend, count, names, true, &c->slopes));
    KMP_TRY(kmp_transfer_init(&c->transfer, &c->linear, c->slopes, &c->inputs, place, c->outputs.count, source));
    KMP_TRY(kmp_made(c->system->context, name_states(c) && name_loads(c)));
    kmp_transfer_eval(&c->transfer);
    return KEMPE_OK;
}

kempe_status kmp_channels_init(kmp_channels *channels, const kempe_system *system, const kmp_channels_options *options)
{
    double begin = kmp_cpu_now();
    *channels = (kmp_channels){0};
    kempe_status status = kmp_averaged_new(system, &channels->averaged);
    channels->given = channels->system = kmp_averaged_system(channels->averaged, system);
    if (status == KEMPE_OK)
        status = build(channels, options);
    channels->build_s = system->build_s + (kmp_cpu_now() - begin);
    if (status != KEMPE_OK)
        kmp_channels_free(channels);
    return status;
}

KMP_CLEARS(kmp_channels, c, kmp_free(c->warnings), kmp_transfer_free(&c->transfer), kmp_slopes_free(c->slopes),
           kmp_linear_free(&c->linear), kmp_operating_free(c->at), kempe_system_free(c->own),
           kmp_variant_free(c->variant), kmp_averaged_free(c->averaged), kmp_requested_inputs_free(&c->inputs),
           kmp_arena_free(&c->arena))
