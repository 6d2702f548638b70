/* SPDX-License-Identifier: BSD-3-Clause */
/* A run that makes no steps. It stands at states of other motions of its system, as those of instances in lanes, where
 * impacts, modes and next values of states are decided as in a run. Each motion has a memory for what it knows of its
 * past. */
#include "integrators/run/runner_site.h"
#include "base/memory.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "integrators/run/sampler.h"
#include <string.h>

enum { MOST_PIECES = 8 };

kempe_status kmp_runner_site_new(kmp_evaluator *eval, const kmp_run_spec *spec, kmp_runner **site)
{
    KMP_MAKE(eval->system->context, kmp_runner, run);
    run->s = eval->system;
    run->spec = *spec;
    run->eval = eval;
    run->stop = spec->t_end;
    kempe_status status = kmp_runner_make_parts(run);
    return KMP_GIVE_OR_FREE(status, site, run, kmp_runner_site_free);
}

void kmp_runner_site_free(kmp_runner *site)
{
    if (!site)
        return;
    site->eval = NULL; /* the caller's */
    kmp_runner_free(site);
}

static int list_pieces(kmp_runner *run, kmp_memory_piece *piece)
{
    int count = kmp_runner_sampler_memory(run, piece);
    count += kmp_friction_memory(run->friction, piece + count);
    return count + kmp_impact_memory(run->impacts, piece + count);
}

size_t kmp_runner_memory_size(const kempe_system *system)
{
    return kmp_sampler_memory_size(system->model) + kmp_friction_memory_size(&system->events) +
           kmp_impact_memory_size(&system->events);
}

void kmp_runner_keep_memory(kmp_runner *run, void *memory)
{
    kmp_memory_piece piece[MOST_PIECES];
    char *to = memory;
    int count = list_pieces(run, piece);
    for (int k = 0; k < count; to += piece[k++].size)
        memcpy(to, piece[k].at, piece[k].size);
}

void kmp_runner_take_memory(kmp_runner *run, const void *memory, bool elsewhere)
{
    kmp_memory_piece piece[MOST_PIECES];
    const char *from = memory;
    int count = elsewhere ? kmp_runner_sampler_memory(run, piece) : list_pieces(run, piece);
    for (int k = 0; k < count; from += piece[k++].size)
        memcpy(piece[k].at, from, piece[k].size);
    kmp_friction_renew(run);
}
