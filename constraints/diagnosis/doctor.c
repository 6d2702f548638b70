/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of the examination in order. The cost grows with the cube of the coordinates, so that large models skip
 * it. */
#include "constraints/diagnosis/doctor.h"
#include "constraints/kinds/kind.h"

enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

static int declared_rows(const kempe_model *model)
{
    int rows = 0;
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure_kind *kind = kmp_closure_kind_find(model->closures[c].kind);
        rows += kind ? kmp_closure_rows(kind, &model->closures[c]) : 0;
    }
    return rows;
}

/* Runs all parts of the examination. */
static kempe_status ask(kmp_examination *x, const kmp_evaluator *eval)
{
    void (*const parts[])(kmp_examination *) = {kmp_doctor_points,  kmp_doctor_dependents,   kmp_doctor_second_order,
                                                kmp_doctor_repairs, kmp_doctor_alternatives, kmp_doctor_limits};
    x->walk = kmp_walk_new(x->system);
    if (!x->walk)
        return kmp_fail_memory(x->system->context);
    kmp_eval_set_charts(x->walk->eval, eval->chart);
    for (int k = 0; k < (int)(sizeof parts / sizeof *parts) && !x->arena->failed; k++)
        parts[k](x);
    kmp_walk_free(x->walk);
    return KEMPE_OK;
}

kempe_status kmp_doctor_examine(kmp_doctor *doctor, kmp_evaluator *eval, const double *q, const kmp_partition *part,
                                kmp_arena *arena)
{
    const kempe_system *system = eval->system;
    kmp_examination x = {.system = system, .q = q, .part = part, .arena = arena, .doctor = doctor};
    kempe_status status = KEMPE_OK;
    doctor->declared = declared_rows(system->model);
    doctor->generic_rank = part->r;
    doctor->margin = 1;
    doctor->block_count = kmp_loop_blocks(eval, part, arena, &doctor->blocks);
    doctor->ran = system->n <= MOST_COORDINATES && system->m <= MOST_ROWS;
    if (!doctor->ran) {
        doctor->why_not =
            "more than 100 coordinates or 200 rows: only rank, choice of coordinates and blocks were examined";
        doctor->limits.why_not = doctor->why_not;
    } else if (doctor->block_count >= 0) {
        status = ask(&x, eval);
    }
    if (doctor->block_count < 0 && !arena->failed)
        return KEMPE_E_FAILED; /* the reduction has set the message */
    return arena->failed ? kmp_fail_memory(system->context) : status;
}
