/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/start_choice.h"
#include "base/context.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include <string.h>

static bool has_row(const kmp_code_elements *elements, int row)
{
    for (int k = 0; k < elements->count; k++)
        if (elements->row[k] == row)
            return true;
    return false;
}

/* The independent rows, with all rows of friction and contacts, which are zero in some modes. */
static void take_rows(kmp_code_source *source, const kmp_partition *part)
{
    struct kmp_start_choice *choice = source->choice;
    for (int row = 0, k = 0; row < source->m; row++) {
        while (k < part->r && part->rows[k] < row)
            k++;
        if ((k < part->r && part->rows[k] == row) || has_row(&source->frictions, row) ||
            has_row(&source->contacts, row))
            choice->rows[choice->row_count++] = row;
    }
}

static kempe_status choose(kmp_code_source *source, kmp_evaluator *eval, const kempe_assembly *assembly)
{
    struct kmp_start_choice *choice = source->choice;
    kmp_arena *arena = &source->arena;
    kmp_partition part;
    kmp_eval_closure(eval, 0, assembly->q);
    KMP_TRY(kmp_partition_init(&part, eval->system, eval->jacobian, NULL, 0));
    kmp_partition_sort(&part);
    choice->independent = kmp_arena_copy(arena, part.u, part.p, sizeof *part.u);
    choice->dependent = kmp_arena_copy(arena, part.v, part.r, sizeof *part.v);
    choice->rows = KMP_ARENA_NEW(arena, int, source->m);
    choice->independent_count = part.p;
    choice->dependent_count = part.r;
    if (!arena->failed)
        take_rows(source, &part);
    kmp_partition_free(&part);
    return kmp_made(source->context, !arena->failed);
}

static kempe_status choose_of(kmp_code_source *source, const kempe_system *system)
{
    bool equal = system->m == source->m;
    for (int r = 0; equal && r < source->m; r++)
        equal = strcmp(system->row_names[r], source->row_names[r]) == 0;
    if (!equal) {
        source->choice->missing = "the rows of drives and locks, which --drives adds";
        return KEMPE_OK;
    }
    kempe_assembly *assembly = NULL;
    kmp_evaluator *eval = NULL;
    kempe_status status = kmp_assembly_at_start(system, &assembly);
    if (status == KEMPE_OK)
        status = kmp_made(system->context, (eval = kmp_eval_new_of_closures(system)));
    if (status == KEMPE_OK)
        status = choose(source, eval, assembly);
    kmp_eval_free(eval);
    kempe_assembly_free(assembly);
    return status;
}

kempe_status kmp_start_choose(kmp_code_source *source)
{
    kempe_system *system = NULL;
    source->choice = KMP_ARENA_NEW(&source->arena, struct kmp_start_choice, 1);
    KMP_TRY(kmp_made(source->context, source->choice));
    kempe_status status = kmp_system_new_by(source->model, NULL, &system);
    if (status == KEMPE_OK)
        status = choose_of(source, system);
    kempe_system_free(system);
    if (status == KEMPE_OK || status == KEMPE_E_MEMORY)
        return status;
    kmp_log(source->context, KEMPE_LOG_WARNING,
            "functions of accelerations are not written, since the model's start cannot be closed: %s",
            kempe_context_message(source->context));
    source->choice->missing = "a start at which the closures are met";
    kmp_context_clear(source->context);
    return KEMPE_OK;
}
