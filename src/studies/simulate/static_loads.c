/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheel loads at rest. They take an equilibrium, which costs as much as some seconds of a run; they depend on the model
 * alone, and are kept like its programs. */
#include "base/context.h"
#include "base/memory.h"
#include "dynamics/kept.h"
#include "studies/equilibrium/balances.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/running_safety.h"
#include <kempe/equilibrium.h>
#include <math.h>
#include <string.h>

/* By descent, then by Newton's method. */
static kempe_status loads_at_rest(const kempe_system *system, kmp_observed *o, kmp_arena *room, double *loads)
{
    kempe_equilibrium *e = NULL;
    double *value = KMP_ARENA_NEW(room, double, o->columns.count), least = INFINITY;
    kempe_status status = kmp_made(system->context, value);
    for (int newton = 0; newton < 2 && !e && status != KEMPE_E_MEMORY && status != KEMPE_STOPPED; newton++) {
        const kempe_equilibrium_options options = {.size = sizeof options, .newton = newton};
        status = kempe_equilibrium_new(system, &options, &e);
    }
    if (status == KEMPE_OK && e->count > 0 && !e->averaged) {
        const kmp_balance *b = &e->balance[0];
        kmp_observed_at(o, 0, b->q, b->qd, NULL, b->lambda, value);
        for (int w = 0; w < system->model->wheel_count; w++)
            least = fmin(least, loads[w] = value[4 * w]);
    }
    for (int w = 0; w < system->model->wheel_count && !(isfinite(least) && least > 0); w++)
        loads[w] = NAN;
    kempe_equilibrium_free(e);
    return status == KEMPE_E_MEMORY || status == KEMPE_STOPPED ? status : KEMPE_OK;
}

bool kmp_has_irregularities(const kempe_model *model)
{
    bool any = false;
    for (int k = 0; k < model->track_count; k++)
        for (int i = 0; i < KMP_IRREGULARITIES; i++)
            any = any || model->tracks[k].irregularities.named[i] || model->tracks[k].irregularities.made[i];
    return any;
}

/* A copy whose tracks are ideal, with the parts of the given one. */
static bool copy_without_irregularities(const kempe_model *given, kmp_arena *arena, kempe_model *ideal)
{
    *ideal = *given;
    ideal->has_digest = false; /* its equations are others */
    ideal->tracks = KMP_ARENA_NEW(arena, kmp_track, given->track_count);
    for (int k = 0; ideal->tracks && k < given->track_count; k++) {
        ideal->tracks[k] = given->tracks[k];
        ideal->tracks[k].irregularities = (kmp_irregularities){.spectrum = {.kind = -1}};
    }
    return ideal->tracks;
}

static kempe_status loads_of(const kempe_system *system, kmp_arena *room, double *loads)
{
    kmp_observed o;
    kmp_text words = {0};
    for (int w = 0; w < system->model->wheel_count; w++)
        kmp_text_printf(&words, "%sguidance(%s)", w > 0 ? "," : "", system->model->wheels[w].name);
    kempe_status status =
        words.failed ? kmp_fail_memory(system->context) : kmp_observed_init(&o, system, words.s, 0, NULL);
    kmp_text_free(&words);
    KMP_TRY(status);
    status = loads_at_rest(system, &o, room, loads);
    kmp_observed_free(&o);
    return status;
}

static kempe_status find(const kempe_system *system, double *loads)
{
    kempe_model ideal;
    kempe_system *level = NULL;
    kmp_arena room = {0};
    kempe_status status = KEMPE_OK;
    const bool quiet = kmp_context_quiet(system->context, true);
    if (kmp_has_irregularities(system->model)) {
        status = kmp_made(system->context, copy_without_irregularities(system->model, &room, &ideal));
        if (status == KEMPE_OK)
            status = kempe_system_new(&ideal, &level);
        if (status == KEMPE_OK)
            kempe_system_set_force(level, system->force, system->force_user);
    }
    if (status == KEMPE_OK)
        status = loads_of(level ? level : system, &room, loads);
    kempe_system_free(level);
    (void)kmp_context_quiet(system->context, quiet);
    if (status == KEMPE_OK)
        kmp_context_clear(system->context);
    kmp_arena_free(&room);
    return status;
}

/* -- kept loads ---------------------------------------------------------------------------------------- */

/* By the values of parameters, which may differ from those of the model's file. */
static kmp_kept_name name_of(const kempe_system *s)
{
    kmp_kept_name name = {.what = "static loads"};
    kmp_digest digest;
    kmp_digest_begin(&digest);
    kmp_digest_add_part(&digest, s->parameters, (size_t)s->model->parameter_count * sizeof *s->parameters);
    kmp_digest_end(&digest, name.choice.digest);
    return name;
}

static bool recall(const kempe_system *s, kmp_kept_name name, double *loads)
{
    kmp_cached file = kmp_kept_recall(s, name);
    kmp_byte_source source = kmp_byte_source_of(file.bytes, file.size);
    KMP_BYTES_TAKE(&source, loads, s->model->wheel_count);
    bool good = file.whole && !source.failed && source.at == source.end;
    kmp_free(file.whole);
    return good;
}

kempe_status kmp_static_loads(const kempe_system *system, double *loads)
{
    bool kept = system->has_key && !system->force; /* nothing is known of the force of a user's function */
    kmp_kept_name name = kept ? name_of(system) : (kmp_kept_name){0};
    if (kept && recall(system, name, loads))
        return KEMPE_OK;
    kempe_status status = find(system, loads);
    if (kept && status == KEMPE_OK) {
        kmp_bytes bytes = {0};
        KMP_BYTES_PUT(&bytes, loads, system->model->wheel_count);
        kmp_kept_write(system, name, &bytes);
        kmp_bytes_free(&bytes);
    }
    return status;
}
