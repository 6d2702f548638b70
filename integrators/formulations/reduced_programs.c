/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs of the reduced formulation for the present choice of u: the program by the reduced mass, or the one by the
 * saddle system where that pays. Programs of earlier choices are kept, because a motion returns to them: a rocker that
 * swings exchanges u at each end. */
#include "integrators/formulations/reduced_programs.h"
#include "base/memory.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/programs/saddle_program.h"
#include "dynamics/motion.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/formulations/reduced.h"
#include <limits.h>
#include <math.h>
#include <string.h>

/* Programs of a choice of u and rows. `part`: only u and rows, which determine v. */
struct kmp_reduced_kept {
    int *u, *rows; /* p, r */
    kmp_reduced_programs programs;
};

/* -- earlier choices ----------------------------------------------------------------------------------- */

static void release(kmp_reduced_programs *programs)
{
    kmp_stage_lanes_free(&programs->stages);
    kmp_reduced_program_free(programs->scalar);
    kmp_arena_free(&programs->arena);
    *programs = (kmp_reduced_programs){0};
}

void kmp_reduced_free_programs(kmp_reduced *d)
{
    for (int k = 0; k < KMP_REDUCED_KEPT && d->use.kept; k++) {
        release(&d->use.kept[k].programs);
        kmp_free(d->use.kept[k].u);
    }
    kmp_free(d->use.kept);
    release(&d->programs);
}

/* The record of the present choice; NULL: it has not been left before. */
static struct kmp_reduced_kept *find_kept(const kmp_reduced *d)
{
    const kmp_partition *part = &d->part;
    for (int k = 0; k < KMP_REDUCED_KEPT && d->use.kept; k++) {
        struct kmp_reduced_kept *kept = &d->use.kept[k];
        if (kept->u && memcmp(kept->u, part->u, (size_t)part->p * sizeof *part->u) == 0 &&
            memcmp(kept->rows, part->rows, (size_t)part->r * sizeof *part->rows) == 0)
            return kept;
    }
    return NULL;
}

bool kmp_reduced_keep(kmp_reduced *d)
{
    const kmp_partition *part = &d->part;
    struct kmp_reduced_kept *kept = find_kept(d);
    if (!d->use.kept && !(d->use.kept = KMP_NEW(struct kmp_reduced_kept, KMP_REDUCED_KEPT)))
        return kmp_fail_memory(d->s->context) == KEMPE_OK;
    if (!kept) {
        /* A record for the present choice, in place of the oldest one. */
        kept = &d->use.kept[d->use.kept_next];
        d->use.kept_next = (d->use.kept_next + 1) % KMP_REDUCED_KEPT;
        release(&kept->programs);
        kmp_free(kept->u);
        *kept = (struct kmp_reduced_kept){.u = KMP_NEW(int, 1 + part->p + part->r)};
        if (!kept->u)
            return kmp_fail_memory(d->s->context) == KEMPE_OK;
        kept->rows = kept->u + part->p;
        memcpy(kept->u, part->u, (size_t)part->p * sizeof *part->u);
        memcpy(kept->rows, part->rows, (size_t)part->r * sizeof *part->rows);
    }
    release(&kept->programs);
    kept->programs = d->programs;
    d->use.had_saddle_program = kmp_reduced_has_saddle_program(d);
    d->programs = (kmp_reduced_programs){0};
    return true;
}

/* -- programs ------------------------------------------------------------------------------------------ */

/* True if a program by the reduced mass is possible. Without a reduced mass there is nothing to write out. */
static bool can_fuse(const kmp_reduced *d)
{
    bool explicit = !d->start.implicit && !d->start.dae, loaded = d->s->load_row_count > 0;
    return (d->integrated || (explicit && !loaded)) && !d->by_saddle;
}

/* Operations of a right-hand side by parts: of the program, and of the linear algebra. */
static double operations_of(kmp_reduced *d)
{
    const kmp_program *program = kmp_eval_program(d->eval, d->eval->by_bodies);
    if (!(d->use.of_program > 0))
        d->use.of_program = (double)kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
    double sum = d->use.of_program;
    double reduction = KMP_LOOPS_COST * (double)kmp_reduction_count(&d->red).paper;
    return sum + (d->by_saddle ? kmp_saddle_cost(&d->saddle) : reduction);
}

/* True if a program by the saddle system is possible, and worth while. A motion with forces that depend on
 * multipliers, as of feet that stick and slip, often has phases too brief to pay it: there the program by the reduced
 * mass is made late. */
static bool solves(const kmp_reduced *d)
{
    const bool loaded = d->s->load_row_count > 0;
    return d->has_v && (!loaded || (d->integrated && d->p > KMP_REDUCED_PROGRAM_FREEDOMS));
}

/* With many degrees of freedom the saddle system written out costs less than the reduced mass, from some number of
 * evaluations on, or `at_once`. */
static int wait_for_solved(kmp_reduced *d, bool at_once)
{
    long wait = solves(d) ? kmp_saddle_program_wait(d->eval, &d->part, operations_of(d), d->start.lanes) : LONG_MAX;
    if (wait >= 0)
        d->use.due_saddle_program =
            wait < LONG_MAX - d->formulation.by_parts ? d->formulation.by_parts + (at_once ? 0 : wait) : LONG_MAX;
    return wait < 0 ? KMP_HALT : KMP_GO;
}

/* Lanes of a program of states, if the integrator uses them. */
static int prepare_stages(kmp_reduced *d)
{
    kmp_reduced_programs *programs = &d->programs;
    const kmp_program *program = programs->scalar ? kmp_reduced_program_code(programs->scalar) : NULL;
    const bool loaded = program && d->s->load_row_count > 0;
    if (!d->start.lanes || !d->integrated)
        return KMP_GO;
    if (kmp_stage_lanes_init(&programs->stages, program, d->eval) &&
        (!loaded || kmp_load_passes_init(&programs->loads, &programs->arena, d->s, &d->part, KMP_STAGE_LANES)))
        return KMP_GO;
    (void)kmp_fail_memory(d->s->context);
    return KMP_HALT;
}

int kmp_reduced_solve(kmp_reduced *d, double t)
{
    bool fuses = d->use.made_late && d->use.steps >= KMP_FORMULATION_BRIEF;
    if (!fuses && d->formulation.by_parts < d->use.due_saddle_program)
        return KMP_GO;
    kmp_eval_closure(d->eval, t, d->q);
    bool regular = !kmp_reduction_factor(&d->red);
    if (fuses)
        return regular ? kmp_reduced_make_program(d, true) : KMP_GO;
    d->use.due_saddle_program = LONG_MAX;
    if (!regular)
        return KMP_GO;
    if (kmp_reduced_program_new_by_saddle(&d->programs.scalar, &d->red, !d->integrated) != KEMPE_OK)
        return KMP_HALT;
    return prepare_stages(d);
}

int kmp_reduced_make_lanes(kmp_reduced *d, double t)
{
    if (d->start.lanes)
        return KMP_GO;
    d->start.lanes = true;
    if (d->programs.scalar)
        return prepare_stages(d);
    bool at_once = !d->use.made_late;
    return wait_for_solved(d, at_once) == KMP_GO ? kmp_reduced_solve(d, t) : KMP_HALT;
}

int kmp_reduced_count(kmp_reduced *d)
{
    kmp_ode *ode = &d->formulation.ode;
    bool lanes = d->integrated && !d->s->force, scalar = d->programs.scalar && !kmp_reduced_has_saddle_program(d);
    double operations = lanes && !scalar && solves(d) ? kmp_saddle_program_operations(d->eval, &d->part) : INFINITY;
    ode->cycles = kmp_cycles_by_parts(operations_of(d), d->eval->by_bodies);
    ode->drops_rows = d->part.r < d->part.m;
    if (lanes && scalar) {
        const kmp_counts count = kmp_reduced_program_count(d->programs.scalar);
        ode->cycles = kmp_cycles_of_one(count) + (d->eval->nu ? kmp_cycles_of_passes() : 0);
        ode->cycles_of_lanes = kmp_cycles_of_lanes(count, false) + (d->eval->nu ? kmp_cycles_of_passes_in_lanes() : 0);
        ode->cycles_to_make = kmp_cycles_to_make(count);
    } else if (operations >= 0 && isfinite(operations)) {
        /* The program by the saddle system is counted before it is written. Explicit methods wait for it, some runs to
         * their end. */
        kmp_counts count = kmp_program_count(kmp_motion_known(d->s), KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
        count.paper = (long)operations;
        if (d->use.due_saddle_program <= d->formulation.by_parts || d->programs.scalar)
            ode->cycles = kmp_cycles_of_one(count);
        ode->cycles_of_lanes = kmp_cycles_of_lanes(count, d->eval->by_bodies);
        ode->cycles_to_make = kmp_cycles_to_make(count);
    } else {
        ode->make_lanes = NULL;
    }
    return operations < 0 ? KMP_HALT : KMP_GO;
}

int kmp_reduced_make_program(kmp_reduced *d, bool worth)
{
    bool had = kmp_reduced_has_saddle_program(d) || d->use.had_saddle_program;
    bool at_once = d->start.early || (worth && (had || d->start.lanes));
    release(&d->programs);
    d->use.by_saddle_program = false;
    d->use.apart = false;
    d->use.steps = 0;
    struct kmp_reduced_kept *kept = find_kept(d);
    d->use.made_late = !worth && !kept && can_fuse(d);
    if (kept) {
        /* The programs that were kept for the present choice, if their order of elimination is good at d->q. */
        kmp_reduced_program *scalar = kept->programs.scalar;
        kmp_reduced_pack(&d->part, true, d->q, d->qd, d->state);
        if (scalar && !kmp_reduced_program_is_stale(scalar) && kmp_reduced_program_is_good(scalar, d->t, d->state)) {
            d->programs = kept->programs;
            kept->programs = (kmp_reduced_programs){0};
        } else {
            release(&kept->programs);
        }
    }
    if (d->programs.scalar) {
        d->use.due_saddle_program = LONG_MAX;
        return KMP_GO;
    }
    worth = worth || kept;
    if (worth && can_fuse(d) && kmp_reduced_program_new(&d->programs.scalar, &d->red, !d->integrated) != KEMPE_OK)
        return KMP_HALT;
    if (!d->programs.scalar)
        return wait_for_solved(d, at_once);
    d->use.due_saddle_program = LONG_MAX;
    return prepare_stages(d);
}
