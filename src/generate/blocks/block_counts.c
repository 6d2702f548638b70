/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/blocks/block_counts.h"
#include "base/context.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/motion.h"

#include <kempe/check.h>

static kempe_status evaluate(const kempe_system *system, const kempe_assembly *start, kmp_block_counts *counts)
{
    kmp_evaluator *eval = kmp_eval_new(system, "tape");
    kempe_status status = kmp_made(system->context, eval);
    if (status == KEMPE_OK && system->bodies->program)
        status = kmp_eval_add_articulated(eval);
    if (status == KEMPE_OK) {
        kmp_eval_take(eval, eval->articulated != NULL);
        kmp_eval_closure(eval, 0, kempe_assembly_q(start));
        kmp_eval_mass(eval);
        kmp_eval_bias(eval, kempe_assembly_qd(start));
        *counts = kmp_machine_count(eval->motion);
    }
    kmp_eval_free(eval);
    return status;
}

kempe_status kmp_block_counts_at_start(const kempe_system *system, kmp_block_counts *counts)
{
    const kmp_program *program = kmp_motion_known(system);
    kempe_assembly *start = NULL;
    *counts = (kmp_block_counts){0};
    if (!program || program->block_count == 0)
        return KEMPE_OK;
    kempe_status status = kempe_assembly_new(system, &start);
    if (status == KEMPE_OK)
        status = evaluate(system, start, counts);
    kempe_assembly_free(start);
    return status;
}
