/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/evaluation/written.h"
#include "base/memory.h"
#include "constraints/closing/charts.h"
#include <string.h>

/* Entries of charts that are so in general: C = 1 until a joint comes near a singular position of its angles. */
static bool is_plain(double chart)
{
    return chart == 0 || chart == 1;
}

static int chart_entries(const kempe_system *s)
{
    return KMP_CHART_SIZE * s->chart_count;
}

bool kmp_written_init(kmp_written *w, const kmp_evaluator *eval, bool by_bodies, int inputs)
{
    const kempe_system *s = eval->system;
    *w = (kmp_written){.s = s, .source = by_bodies ? s->articulated : s->motion, .g = kmp_graph_new()};
    w->out = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->outputs[w->source->stages]);
    if (!KMP_ARENA_EACH(&w->arena, kmp_ref, inputs + chart_entries(s), &w->input, &w->by) || !w->g)
        return false;
    for (int k = 0; k < chart_entries(s); k++)
        if (is_plain(eval->chart[k]))
            kmp_written_replace(w, KMP_IN_CHART, k, eval->chart[k] == 0 ? KMP_ZERO : KMP_ONE);
    return true;
}

void kmp_written_free(kmp_written *w)
{
    kmp_graph_free(w->g);
    kmp_arena_free(&w->arena);
}

void kmp_written_replace(kmp_written *w, kmp_input_kind kind, int index, kmp_ref by)
{
    w->input[w->inputs] = kmp_input(w->g, kind, (uint32_t)index);
    w->by[w->inputs++] = by;
}

bool kmp_written_import(kmp_written *w)
{
    const kempe_system *s = w->s;
    const int *first = w->source->outputs;
    bool by_bodies = w->source == s->articulated;
    if (!kmp_program_import(w->source, w->g, w->inputs, w->input, w->by, w->out))
        return false;
    w->closure = w->h = w->out + first[KMP_STAGE_CLOSURE];
    w->jacobian = w->h + s->m;
    w->h_t = s->rheonomic ? w->jacobian + s->jacobian.count : NULL;
    const kmp_ref *mass = w->out + first[KMP_STAGE_MASS];
    w->mass = by_bodies ? NULL : mass;
    w->compliance = by_bodies ? mass : NULL;
    w->mobility = by_bodies ? mass + s->compliance.count : NULL;
    w->bias = w->out + first[KMP_STAGE_BIAS];
    w->jdqd = w->bias + s->n;
    w->power = w->source->stages > KMP_STAGE_WORKING ? w->out[first[KMP_STAGE_WORKING]] : KMP_ZERO;
    return true;
}

void kmp_written_add_efforts(kmp_written *w)
{
    for (int i = 0; w->s->force && w->mass && i < w->s->n; i++) /* C has generalized forces with their sign changed */
        w->bias[i] = kmp_sub(w->g, w->bias[i], kmp_input(w->g, KMP_IN_EFFORT, (uint32_t)i));
}

bool kmp_written_room(kmp_written *w, int outputs)
{
    w->all = w->to = KMP_ARENA_NEW(&w->arena, kmp_ref, outputs);
    return w->all;
}

void kmp_written_stage(kmp_written *w)
{
    w->group[w->stages++] = w->to;
}

void kmp_written_put(kmp_written *w, int count, const kmp_ref *of)
{
    if (count > 0)
        memcpy(w->to, of, (size_t)count * sizeof *of);
    w->to += count;
    w->count[w->stages - 1] += count;
}

int kmp_written_closure_count(const kempe_system *s)
{
    return (s->rheonomic ? 2 : 1) * s->m + s->jacobian.count;
}

kmp_program *kmp_written_program(kmp_written *w)
{
    return kmp_graph_failed(w->g) ? NULL : kmp_program_new(w->g, w->stages, w->count, w->group);
}

/* -- running ------------------------------------------------------------------------------------------- */

static void run_constants(kmp_written_machine *w)
{
    kmp_machine_set(w->machine, KMP_IN_CHART, w->eval->chart);
    (void)kmp_machine_run(w->machine, KMP_STAGE_PARAMETERS);
    for (int k = 0; k < chart_entries(w->eval->system); k++)
        w->stale = w->stale || (is_plain(w->chart[k]) && w->chart[k] != w->eval->chart[k]);
    w->chart_version = w->eval->chart_version;
}

bool kmp_written_machine_init(kmp_written_machine *w, const kmp_evaluator *eval, kmp_program *program)
{
    int charts = chart_entries(eval->system);
    *w = (kmp_written_machine){.eval = eval, .program = program, .chart = KMP_NEW(double, charts)};
    w->machine = program && w->chart ? kmp_machine_new(program, eval->backend) : NULL;
    if (!w->machine)
        return false;
    for (int k = 0; k < charts; k++)
        w->chart[k] = eval->chart[k];
    for (int k = 0; k < program->input_count; k++)
        w->reads[program->input[k].kind] = true;
    kmp_machine_set(w->machine, KMP_IN_PARAMETER, eval->system->parameters);
    run_constants(w);
    return true;
}

void kmp_written_machine_free(kmp_written_machine *w)
{
    kmp_machine_free(w->machine);
    kmp_program_free(w->program);
    kmp_free(w->chart);
}

void kmp_written_machine_place(kmp_written_machine *w, double t, const double *q)
{
    if (w->reads[KMP_IN_MODE])
        kmp_machine_set(w->machine, KMP_IN_MODE, w->eval->mode);
    if (w->reads[KMP_IN_TIME])
        kmp_machine_set(w->machine, KMP_IN_TIME, &t);
    kmp_machine_set(w->machine, KMP_IN_Q, q);
}

bool kmp_written_machine_is_stale(kmp_written_machine *w)
{
    if (w->chart_version != w->eval->chart_version)
        run_constants(w);
    return w->stale;
}

bool kmp_written_machine_applies(kmp_written_machine *w)
{
    return !kmp_written_machine_is_stale(w) && (w->eval->frozen || w->eval->system->events.count == 0);
}
