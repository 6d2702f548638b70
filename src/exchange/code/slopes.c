/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/slopes.h"
#include "base/context.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/tolerances.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/motion.h"
#include "exchange/code/simulated.h"
#include <kempe/stepper.h>
#include <stdio.h>
#include <string.h>

enum {
    LONGER = 4,        /* the code of slopes over that of the equations, at most: compilers take long */
    TRIAL_STEPS = 2000 /* of the trial run */
};

/* True if all nonzero entries of a matrix are in the pattern of the system, whose numbers may make some of them zero.
 */
static bool is_within(kmp_arena *arena, const kmp_pattern *pattern, int rows, int cols, const kmp_ref *matrix)
{
    bool *listed = KMP_ARENA_NEW(arena, bool, rows *cols);
    bool within = listed;
    for (int k = 0; listed && k < pattern->count; k++) {
        listed[pattern->row[k] * cols + pattern->col[k]] = true;
        if (rows == cols) /* of M the lower triangle */
            listed[pattern->col[k] * cols + pattern->row[k]] = true;
    }
    for (int k = 0; within && k < rows * cols; k++)
        within = listed[k] || matrix[k] == KMP_ZERO;
    return within;
}

/* The motion program with the parameters and conditions of the simulator. *motion is NULL where its zeros differ from
 * those of the system. */
static kempe_status derive_motion(kmp_code_source *source, const kmp_set_choice *choice, const kempe_system *system,
                                  kmp_program **motion)
{
    kmp_equations eq;
    kmp_derivation_request scene = choice->scene;
    scene.sets = KMP_MOTION_SETS;
    KMP_TRY(kmp_equations_derive(&eq, source->model, &scene));
    bool moves = false;
    for (int r = 0; r < eq.m; r++)
        moves = moves || eq.h_t[r] != KMP_ZERO;
    const bool same = eq.m == system->m && moves == system->rheonomic &&
                      is_within(&source->arena, &system->mass, eq.n, eq.n, eq.mass) &&
                      is_within(&source->arena, &system->jacobian, eq.m, eq.n, eq.jacobian);
    *motion = same ? kmp_motion_make_again(system, &eq) : NULL;
    kmp_equations_free(&eq);
    return kmp_made(source->context, !source->arena.failed && (*motion || !same));
}

/* Adds a routine with its choice. */
static kempe_status take(kmp_code_source *source, kmp_program *program, const kmp_partition *part)
{
    struct kmp_simulated *x = source->simulated;
    kmp_code_routine *routine = &source->routines[source->count++];
    const int p = part->p, r = part->r;
    const kmp_array arrays[] = {
        {.name = "udd", .meaning = "accelerations of the independent coordinates", .rows = p, .count = p},
        {.name = "vd", .meaning = "rates of the dependent coordinates", .rows = r, .first = p, .count = r},
        {.name = "checks",
         .meaning = "least pivot of the reduced mass; excess of the elimination, at most 1",
         .rows = 2,
         .first = p + r,
         .count = 2}};
    routine->program = program;
    routine->arguments = KMP_SIMULATOR_ARGUMENTS;
    routine->array_count = sizeof arrays / sizeof *arrays;
    memcpy(routine->arrays, arrays, sizeof arrays);
    snprintf(routine->name, sizeof routine->name, "slopes%d", x->slopes_count + 1);
    x->slopes[x->slopes_count++] =
        (struct kmp_slopes_choice){.independent = kmp_arena_copy(&source->arena, part->u, p, sizeof *part->u),
                                   .dependent = kmp_arena_copy(&source->arena, part->v, r, sizeof *part->v),
                                   .rows = kmp_arena_copy(&source->arena, part->rows, r, sizeof *part->rows)};
    return kmp_made(source->context, kmp_code_take_program(source, routine));
}

/* Writes slopes for the partition at the evaluator's last closure; *written: whether there are any. */
static kempe_status write(kmp_code_source *source, const kmp_program *motion, kmp_evaluator *eval,
                          const kmp_partition *part, bool *written)
{
    kmp_reduction red;
    int *order = KMP_ARENA_NEW(&source->arena, int, part->r);
    KMP_TRY(kmp_made(source->context, order));
    KMP_TRY(kmp_reduction_init(&red, eval, part));
    kmp_program *program = NULL;
    bool fits = kmp_writer_blocks_fit(&red) && kmp_reduction_factor(&red) == 0;
    if (fits) {
        kmp_writer_order(&red, order);
        const kmp_reduced_program_plan plan = {.order = order, .motion = motion};
        program = kmp_reduced_program_write_slopes(&red, &plan);
    }
    kmp_reduction_free(&red);
    bool others = program && program->block_count > 0;
    for (int k = 0; program && k < program->input_count; k++)
        others = others || program->input[k].kind == KMP_IN_LAMBDA;
    *written = program && !others && program->code[2] <= LONGER * motion->code[motion->stages];
    if (*written)
        return take(source, program, part);
    kmp_program_free(program);
    return kmp_made(source->context, program || !fits);
}

/* -- choices ------------------------------------------------------------------------------------------- */

static bool equal(int count, const int *a, const int *b)
{
    return count == 0 || memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

static bool is_known(const struct kmp_simulated *x, const kmp_partition *part)
{
    for (int k = 0; k < x->slopes_count; k++)
        if (equal(part->r, part->v, x->slopes[k].dependent) && equal(part->r, part->rows, x->slopes[k].rows))
            return true;
    return false;
}

/* Follows a run of the model, with exchanges as the runtime makes them, and writes slopes for the choices of u. */
static kempe_status follow(kmp_code_source *source, const kmp_program *motion, kmp_evaluator *eval, kmp_partition *part,
                           kempe_stepper *stepper)
{
    const kempe_system *system = eval->system;
    bool written = true;
    for (int step = 0; written && step < TRIAL_STEPS && source->simulated->slopes_count < KMP_SLOPES_MOST; step++) {
        if (kempe_stepper_step(stepper) != KEMPE_OK)
            break;
        kmp_eval_closure(eval, kempe_stepper_time(stepper), kempe_stepper_q(stepper));
        if (kmp_partition_exchange(part, system, eval->jacobian, KMP_EXCHANGE_GROWTH) != KEMPE_OK)
            break;
        kmp_partition_sort(part);
        if (!is_known(source->simulated, part))
            KMP_TRY(write(source, motion, eval, part, &written));
    }
    return KEMPE_OK;
}

static kempe_status write_others(kmp_code_source *source, const kmp_program *motion, kmp_evaluator *eval,
                                 const kmp_partition *first)
{
    const kempe_run_options run = {.size = sizeof run,
                                   .formulation = "reduced",
                                   .integrator = "dop853",
                                   .rtol = KMP_TRIAL_TOLERANCE,
                                   .atol = KMP_TRIAL_TOLERANCE};
    kempe_stepper *stepper;
    kmp_partition part;
    if (kempe_stepper_new(eval->system, &run, &stepper) != KEMPE_OK)
        return KEMPE_OK; /* the routine of the start is all */
    bool copied = kmp_partition_copy(&part, first);
    kempe_status status = kmp_made(source->context, copied);
    if (copied)
        status = follow(source, motion, eval, &part, stepper);
    if (copied)
        kmp_partition_free(&part);
    kempe_stepper_free(stepper);
    return status;
}

kempe_status kmp_slopes_add(kmp_code_source *source, const kmp_set_choice *choice, kmp_evaluator *eval,
                            const kmp_partition *part)
{
    const kempe_system *system = eval->system;
    kmp_program *motion;
    bool written = false;
    source->simulated->slopes = KMP_ARENA_NEW(&source->arena, struct kmp_slopes_choice, KMP_SLOPES_MOST);
    KMP_TRY(kmp_made(source->context, source->simulated->slopes));
    if (part->p == 0 || part->p > KMP_REDUCED_PROGRAM_MOST || system->load_row_count > 0)
        return KEMPE_OK;
    KMP_TRY(kmp_motion_need(system));
    if (system->motion->block_count > 0)
        return KEMPE_OK;
    KMP_TRY(derive_motion(source, choice, system, &motion));
    kempe_status status = motion ? write(source, motion, eval, part, &written) : KEMPE_OK;
    if (status == KEMPE_OK && written && part->r > 0)
        status = write_others(source, motion, eval, part);
    kmp_program_free(motion);
    return status;
}
