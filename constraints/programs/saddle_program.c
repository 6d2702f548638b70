/* SPDX-License-Identifier: BSD-3-Clause */
/* The saddle system as a program: it is made once its cost, in operations, is less than what the evaluations of a run
 * would save. It serves corrections and closings as a kmp_closer, too, with the factors of its last run. */
#include "constraints/programs/saddle_program.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/programs/saddle_program_inside.h"
#include "constraints/programs/saddle_program_nearby.h"
#include "constraints/programs/saddle_program_write.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

/* Cost of making the program, in operations for each of its own: measured by bench/bench_evaluations.c, 450 to 1200. */
#define MAKING 700.0
/* Fewer evaluations than this are those of some dozen steps, which nearly every run takes. */
#define AT_ONCE 200.0

struct kmp_saddle_program {
    kmp_evaluator *eval;
    kmp_arena arena;
    kmp_writer_machine made;
    kmp_saddle_program_layout layout;
    double *effort;    /* n: user-defined forces; NULL: there are none */
    const double *end; /* outputs of the last END */
};

/* -- making -------------------------------------------------------------------------------------------- */

kempe_status kmp_saddle_program_new(kmp_saddle_program **out, kmp_evaluator *eval, const kmp_partition *part)
{
    const kempe_system *s = eval->system;
    kmp_saddle_program_written written = {0};
    bool good = false;
    *out = NULL;
    kmp_saddle_program *program = KMP_NEW(kmp_saddle_program, 1);
    if (program)
        *program = (kmp_saddle_program){.eval = eval};
    double *still = program ? KMP_ARENA_NEW(&program->arena, double, s->n) : NULL;
    if (still && s->force)
        program->effort = KMP_ARENA_NEW(&program->arena, double, s->n);
    const kmp_saddle_program_plan plan = {.part = part};
    bool made = still && !program->arena.failed && kmp_saddle_program_write(eval, &plan, &written);
    kmp_free(written.row); /* no elimination of v */
    if (!made || (written.program && !kmp_writer_machine_init(&program->made, eval, written.program))) {
        kmp_saddle_program_free(program);
        return kmp_fail_memory(s->context);
    }
    program->layout = written.layout;
    if (written.program) {
        /* Pivots do not depend on rates and efforts, which may be zero here. */
        kmp_machine_set(program->made.machine, KMP_IN_QD, still);
        kmp_writer_machine_place(&program->made, eval->t, eval->q);
        good = kmp_saddle_program_is_good(&program->layout,
                                          kmp_machine_run(program->made.machine, KMP_SADDLE_PROGRAM_RUN), 1);
    }
    if (good)
        *out = program;
    else
        kmp_saddle_program_free(program);
    return KEMPE_OK;
}

void kmp_saddle_program_free(kmp_saddle_program *program)
{
    if (!program)
        return;
    kmp_writer_machine_free(&program->made);
    kmp_arena_free(&program->arena);
    kmp_free(program);
}

const kmp_saddle_program_layout *kmp_saddle_program_layout_of(const kmp_saddle_program *program)
{
    return &program->layout;
}

kmp_counts kmp_saddle_program_count(const kmp_saddle_program *program)
{
    return kmp_program_count(program->made.program, KMP_SADDLE_PROGRAM_RATES, KMP_SADDLE_PROGRAM_RUN);
}

long kmp_saddle_program_wait(const kmp_evaluator *eval, const kmp_partition *part, double operations, bool lanes)
{
    double own = kmp_saddle_program_operations(eval, part), saved = operations - own;
    if (own < 0 || (lanes && isfinite(own)))
        return own < 0 ? -1 : 0;
    double wait = saved > 0 ? MAKING * own / saved : INFINITY;
    return wait < AT_ONCE ? 0 : wait < 1e9 ? (long)wait : LONG_MAX;
}

/* -- running ------------------------------------------------------------------------------------------- */

bool kmp_saddle_program_applies(kmp_saddle_program *program)
{
    return kmp_writer_machine_applies(&program->made) && !program->eval->given;
}

bool kmp_saddle_program_is_stale(kmp_saddle_program *program)
{
    return kmp_writer_machine_is_stale(&program->made);
}

bool kmp_saddle_program_is_good(const kmp_saddle_program_layout *layout, const double *out, int stride)
{
    const double *pivot = out + layout->pivot * stride, *diagonal = out + layout->diagonal * stride;
    for (int k = 0; k < layout->pivots; k++)
        if (!(pivot[k * stride] > KMP_SADDLE_PROGRAM_PIVOT * diagonal[k * stride]))
            return false;
    return true;
}

const double *kmp_saddle_program_run(kmp_saddle_program *program, double t, const double *q, const double *qd,
                                     bool *good)
{
    kmp_writer_machine_place(&program->made, t, q);
    kmp_machine_set(program->made.machine, KMP_IN_QD, qd);
    if (program->effort) {
        kmp_system_effort(program->eval->system, t, q, qd, program->effort);
        kmp_machine_set(program->made.machine, KMP_IN_EFFORT, program->effort);
    }
    const double *out = kmp_machine_run(program->made.machine, KMP_SADDLE_PROGRAM_RUN);
    *good = kmp_saddle_program_is_good(&program->layout, out, 1);
    return out;
}

const double *kmp_saddle_program_end(kmp_writer_machine *made, const kmp_saddle_program_layout *l, kmp_evaluator *eval,
                                     double t, const double *q)
{
    const double *out = kmp_machine_run(made->machine, KMP_SADDLE_PROGRAM_END);
    kmp_eval_use_closure(eval, t, q, out + l->h, out + l->jacobian, l->h_t >= 0 ? out + l->h_t : NULL);
    return out;
}

void kmp_saddle_program_lend(kmp_saddle_program *program, double t, const double *q)
{
    program->end = kmp_saddle_program_end(&program->made, &program->layout, program->eval, t, q);
}

bool kmp_saddle_program_cancels(const kmp_saddle_program_layout *l, const kempe_system *s, const double *end,
                                double rtol, double rate_scale)
{
    const double *open = end + l->open;
    double most = 0;
    for (int i = 0; l->r > 0 && i < kmp_model_coordinates(s->model); i++)
        most = isfinite(open[i]) ? fmax(most, fabs(open[i]) / s->scale[i]) : INFINITY;
    return DBL_EPSILON * most > KMP_MARGIN_CANCELLED * rtol * rate_scale * rate_scale;
}

bool kmp_saddle_program_is_cancelled(const kmp_saddle_program *program, double rtol, double rate_scale)
{
    return kmp_saddle_program_cancels(&program->layout, program->eval->system, program->end, rtol, rate_scale);
}

void kmp_saddle_program_correct(kmp_saddle_program *program, const double *violation, double *dx)
{
    kmp_machine_set(program->made.machine, KMP_IN_MU, violation);
    memcpy(dx, kmp_machine_run(program->made.machine, KMP_SADDLE_PROGRAM_CORRECT),
           (size_t)program->layout.n * sizeof *dx);
}

/* -- closing ------------------------------------------------------------------------------------------- */

static int place(void *self, double t, const double *q)
{
    kmp_saddle_program_closing *closing = self;
    bool good;
    (void)kmp_saddle_program_run(closing->program, t, q, closing->qd, &good);
    kmp_saddle_program_lend(closing->program, t, q);
    return !good;
}

static bool correct(void *self, const double *violation, double *dx)
{
    kmp_saddle_program_closing *closing = self;
    kmp_saddle_program_correct(closing->program, violation, dx);
    return true;
}

kmp_closer kmp_saddle_program_closer(kmp_saddle_program_closing *closing, double *dx)
{
    kmp_evaluator *eval = closing->program->eval;
    return (kmp_closer){.self = closing,
                        .eval = eval,
                        .scale = eval->system->scale,
                        .count = eval->n,
                        .dx = dx,
                        .place = place,
                        .correct = correct};
}

const kmp_program *kmp_saddle_program_code(const kmp_saddle_program *program)
{
    return program->made.program;
}

kempe_status kmp_saddle_program_write_nearby(const kmp_saddle_program *program, const kmp_partition *part,
                                             kmp_program **nearby)
{
    *nearby = NULL;
    if (program->effort || program->layout.factors == 0)
        return KEMPE_OK;
    double run = (double)kmp_saddle_program_count(program).paper;
    return kmp_saddle_program_write_near(program->eval, part, run, nearby)
               ? KEMPE_OK
               : kmp_fail_memory(program->eval->system->context);
}
