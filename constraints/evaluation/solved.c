/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/evaluation/solved.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/evaluation/solved_inside.h"
#include "constraints/evaluation/written.h"
#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <string.h>

struct kmp_solved {
    kmp_evaluator *eval;
    kmp_arena arena;
    kmp_written_machine made;
    kmp_solved_layout layout;
    bool by_bodies;
    double *effort;     /* n; NULL: there are none */
    double *still;      /* n: zero */
    const double *open; /* n: of the last END */
};

/* -- making -------------------------------------------------------------------------------------------- */

/* False: no memory. */
static bool make(kmp_solved *solved, const kmp_partition *part)
{
    kmp_program *program;
    const kempe_system *s = solved->eval->system;
    if (!kmp_solved_write(solved->eval, part, &program, &solved->by_bodies, &solved->layout))
        return false;
    if (!program)
        return true;
    solved->effort = s->force ? KMP_ARENA_NEW(&solved->arena, double, s->n) : NULL;
    solved->still = KMP_ARENA_NEW(&solved->arena, double, s->n);
    return kmp_written_machine_init(&solved->made, solved->eval, program) && !solved->arena.failed;
}

/* Pivots do not depend on rates, which may be zero here. */
static bool is_good_here(kmp_solved *solved)
{
    bool good = false;
    if (solved->made.program)
        (void)kmp_solved_run(solved, solved->eval->t, solved->eval->q, solved->still, &good);
    return good;
}

kempe_status kmp_solved_new(kmp_solved **out, kmp_evaluator *eval, const kmp_partition *part)
{
    *out = NULL;
    kmp_solved *solved = KMP_NEW(kmp_solved, 1);
    if (solved)
        *solved = (kmp_solved){.eval = eval};
    if (!solved || !make(solved, part)) {
        kmp_solved_free(solved);
        return kmp_fail_memory(eval->system->context);
    }
    if (is_good_here(solved))
        *out = solved;
    else
        kmp_solved_free(solved);
    return KEMPE_OK;
}

void kmp_solved_free(kmp_solved *solved)
{
    if (!solved)
        return;
    kmp_written_machine_free(&solved->made);
    kmp_arena_free(&solved->arena);
    kmp_free(solved);
}

const kmp_solved_layout *kmp_solved_layout_of(const kmp_solved *solved)
{
    return &solved->layout;
}

kmp_counts kmp_solved_count(const kmp_solved *solved)
{
    return kmp_program_count(solved->made.program, KMP_SOLVED_RUN, KMP_SOLVED_RUN);
}

bool kmp_solved_by_bodies(const kmp_solved *solved)
{
    return solved->by_bodies;
}

/* -- running ------------------------------------------------------------------------------------------- */

bool kmp_solved_applies(kmp_solved *solved)
{
    return kmp_written_machine_applies(&solved->made) && !solved->eval->given;
}

bool kmp_solved_is_stale(kmp_solved *solved)
{
    return kmp_written_machine_is_stale(&solved->made);
}

bool kmp_solved_is_good(const kmp_solved_layout *layout, const double *out, int stride)
{
    const double *pivot = out + layout->pivot * stride, *diagonal = out + layout->diagonal * stride;
    for (int k = 0; k < layout->pivots; k++)
        if (!(pivot[k * stride] > KMP_SOLVED_PIVOT * diagonal[k * stride]))
            return false;
    return true;
}

const double *kmp_solved_run(kmp_solved *solved, double t, const double *q, const double *qd, bool *good)
{
    kmp_written_machine_place(&solved->made, t, q);
    kmp_machine_set(solved->made.machine, KMP_IN_QD, qd);
    if (solved->effort) {
        kmp_system_effort(solved->eval->system, t, q, qd, solved->effort);
        kmp_machine_set(solved->made.machine, KMP_IN_EFFORT, solved->effort);
    }
    const double *out = kmp_machine_run(solved->made.machine, KMP_SOLVED_RUN);
    *good = kmp_solved_is_good(&solved->layout, out, 1);
    return out;
}

void kmp_solved_lend(kmp_solved *solved, double t, const double *q)
{
    const kmp_solved_layout *l = &solved->layout;
    const double *out = kmp_machine_run(solved->made.machine, KMP_SOLVED_END);
    kmp_eval_lend_closure(solved->eval, t, q, out + l->h, out + l->jacobian, l->h_t >= 0 ? out + l->h_t : NULL);
    solved->open = out + l->open;
}

bool kmp_solved_is_cancelled(const kmp_solved *solved, double rtol, double rate_scale)
{
    const double *scale = solved->eval->system->scale;
    double most = 0;
    for (int i = 0; solved->layout.r > 0 && i < solved->layout.n; i++)
        most = isfinite(solved->open[i]) ? fmax(most, fabs(solved->open[i]) / scale[i]) : INFINITY;
    return DBL_EPSILON * most > KMP_MARGIN_CANCELLED * rtol * rate_scale * rate_scale;
}

void kmp_solved_correct(kmp_solved *solved, const double *violation, double *dx)
{
    kmp_machine_set(solved->made.machine, KMP_IN_MU, violation);
    memcpy(dx, kmp_machine_run(solved->made.machine, KMP_SOLVED_CORRECT), (size_t)solved->layout.n * sizeof *dx);
}

/* -- closing ------------------------------------------------------------------------------------------- */

static int place(void *self, double t, const double *q)
{
    kmp_solved_closing *closing = self;
    bool good;
    (void)kmp_solved_run(closing->solved, t, q, closing->qd, &good);
    kmp_solved_lend(closing->solved, t, q);
    return !good;
}

static bool correct(void *self, const double *violation, double *dx)
{
    kmp_solved_closing *closing = self;
    kmp_solved_correct(closing->solved, violation, dx);
    return true;
}

kmp_closer kmp_solved_closer(kmp_solved_closing *closing, double *dx)
{
    kmp_evaluator *eval = closing->solved->eval;
    return (kmp_closer){.self = closing,
                        .eval = eval,
                        .scale = eval->system->scale,
                        .count = eval->n,
                        .dx = dx,
                        .place = place,
                        .correct = correct};
}

const kmp_program *kmp_solved_program(const kmp_solved *solved)
{
    return solved->effort ? NULL : solved->made.program;
}

/* -- lanes --------------------------------------------------------------------------------------------- */

void kmp_solved_renew_lanes(const kmp_solved *solved, int width, kmp_lanes *lanes)
{
    const kmp_evaluator *eval = solved->eval;
    for (int lane = 0; lane < width; lane++) {
        kmp_lanes_set_one(lanes, KMP_IN_PARAMETER, lane, eval->system->parameters);
        kmp_lanes_set_one(lanes, KMP_IN_CHART, lane, eval->chart);
        kmp_lanes_set_one(lanes, KMP_IN_MODE, lane, eval->mode);
    }
    (void)kmp_lanes_run(lanes, KMP_STAGE_PARAMETERS);
}

kmp_lanes *kmp_solved_lanes(const kmp_solved *solved, int width)
{
    kmp_lanes *lanes = kmp_lanes_new(solved->made.program, width, false);
    if (lanes)
        kmp_solved_renew_lanes(solved, width, lanes);
    return lanes;
}
