/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/written/solved.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "constraints/written/solved_inside.h"
#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

/* Cost of making the program, in operations for each of its own: measured by bench/bench_evaluations.c, 450 to 1200. */
#define MAKING 700.0
/* Fewer evaluations than this are those of some dozen steps, which nearly every run takes. */
#define AT_ONCE 200.0

struct kmp_solved {
    kmp_evaluator *eval;
    kmp_arena arena;
    kmp_written_machine made;
    kmp_solved_layout layout;
    const kmp_reduction *red;  /* of a state; NULL: of q and qd */
    bool closes;               /* with the stage KMP_SOLVED_CLOSE */
    const double *dv, *left;   /* r: the last correction; the one that is left after it */
    kmp_written_efforts given; /* also without a state: then `state` has zero rates */
    const double *end;         /* outputs of the last END */
    kmp_eliminated *row;       /* of multipliers */
};

/* -- making -------------------------------------------------------------------------------------------- */

/* False: no memory. */
static bool make(kmp_solved *solved, const kmp_partition *part)
{
    const kempe_system *s = solved->eval->system;
    solved->given.effort = s->force ? KMP_ARENA_NEW(&solved->arena, double, s->n) : NULL;
    solved->given.state = KMP_ARENA_NEW(&solved->arena, double, 2 * s->n);
    if (!KMP_ARENA_EACH(&solved->arena, double, s->n, &solved->given.q, &solved->given.qd))
        return false;
    kmp_solved_plan plan = {.part = part, .red = solved->red, .closes = solved->closes};
    kmp_solved_written written;
    if (plan.red) {
        int *order = KMP_ARENA_NEW(&solved->arena, int, part->r);
        if (!order)
            return false;
        kmp_written_order(plan.red, order);
        plan.order = order;
    }
    if (!kmp_solved_write(solved->eval, &plan, &written))
        return false;
    solved->layout = written.layout;
    solved->row = written.row;
    return !written.program || kmp_written_machine_init(&solved->made, solved->eval, written.program);
}

/* Sets the state of q at zero rates. */
static const double *put_still(kmp_solved *solved, const kmp_partition *part, const double *q)
{
    for (int c = 0; c < part->p; c++)
        solved->given.state[c] = q[part->u[c]];
    for (int i = 0; i < part->r; i++)
        solved->given.state[2 * part->p + i] = q[part->v[i]];
    return solved->given.state;
}

static void run(kmp_solved *solved, double t, const double *q, bool *good)
{
    kmp_written_machine_place(&solved->made, t, q);
    (void)kmp_machine_run(solved->made.machine, KMP_SOLVED_CLOSE);
    (void)kmp_machine_run(solved->made.machine, KMP_SOLVED_RATES);
    *good = kmp_solved_is_good(&solved->layout, kmp_machine_run(solved->made.machine, KMP_SOLVED_RUN), 1);
}

/* Pivots do not depend on rates and efforts, which may be zero here. */
static bool is_good_here(kmp_solved *solved, const kmp_partition *part)
{
    const kmp_evaluator *eval = solved->eval;
    bool good = false;
    if (!solved->made.program)
        return false;
    kmp_machine_set(solved->made.machine, KMP_IN_QD, solved->given.state);
    run(solved, eval->t, solved->red ? put_still(solved, part, eval->q) : eval->q, &good);
    return good;
}

static kempe_status make_new(kmp_solved **out, kmp_evaluator *eval, const kmp_partition *part, const kmp_reduction *red,
                             bool closes)
{
    *out = NULL;
    kmp_solved *solved = KMP_NEW(kmp_solved, 1);
    if (solved)
        *solved = (kmp_solved){.eval = eval, .red = red, .closes = closes};
    if (!solved || !make(solved, part)) {
        kmp_solved_free(solved);
        return kmp_fail_memory(eval->system->context);
    }
    if (is_good_here(solved, part))
        *out = solved;
    else
        kmp_solved_free(solved);
    return KEMPE_OK;
}

kempe_status kmp_solved_new(kmp_solved **out, kmp_evaluator *eval, const kmp_partition *part)
{
    return make_new(out, eval, part, NULL, false);
}

kempe_status kmp_solved_new_reduced(kmp_solved **out, const kmp_reduction *red, bool closes)
{
    return make_new(out, red->eval, red->part, red, closes);
}

void kmp_solved_free(kmp_solved *solved)
{
    if (!solved)
        return;
    kmp_written_machine_free(&solved->made);
    kmp_arena_free(&solved->arena);
    kmp_free(solved->row);
    kmp_free(solved);
}

const kmp_solved_layout *kmp_solved_layout_of(const kmp_solved *solved)
{
    return &solved->layout;
}

kmp_counts kmp_solved_count(const kmp_solved *solved)
{
    return kmp_program_count(solved->made.program, KMP_SOLVED_RATES, KMP_SOLVED_RUN);
}

bool kmp_solved_by_bodies(const kmp_solved *solved)
{
    return solved->layout.by_bodies;
}

long kmp_solved_wait(const kmp_evaluator *eval, const kmp_partition *part, double operations, bool lanes)
{
    double own = kmp_solved_operations(eval, part), saved = operations - own;
    if (own < 0 || (lanes && isfinite(own)))
        return own < 0 ? -1 : 0;
    double wait = saved > 0 ? MAKING * own / saved : INFINITY;
    return wait < AT_ONCE ? 0 : wait < 1e9 ? (long)wait : LONG_MAX;
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
    if (solved->given.effort) {
        kmp_system_effort(solved->eval->system, t, q, qd, solved->given.effort);
        kmp_machine_set(solved->made.machine, KMP_IN_EFFORT, solved->given.effort);
    }
    const double *out = kmp_machine_run(solved->made.machine, KMP_SOLVED_RUN);
    *good = kmp_solved_is_good(&solved->layout, out, 1);
    return out;
}

kmp_written_correction kmp_solved_close(kmp_solved *solved, double t, const double *y)
{
    kmp_written_correction c =
        kmp_written_machine_close(&solved->made, KMP_SOLVED_CLOSE, solved->red->r, solved->layout.turns, t, y);
    solved->dv = c.dv;
    return c;
}

const double *kmp_solved_left(const kmp_solved *solved)
{
    return solved->left;
}

void kmp_solved_run_state(kmp_solved *solved, double t, const double *y, double *dy, double *power, bool *good)
{
    const kmp_solved_layout *l = &solved->layout;
    size_t p = (size_t)solved->red->p, r = (size_t)solved->red->r;
    kmp_machine *machine = solved->made.machine;
    if (!solved->closes)
        kmp_written_machine_place(&solved->made, t, y);
    const double *rates = solved->given.effort ? kmp_machine_run(machine, KMP_SOLVED_RATES) : NULL;
    if (rates)
        kmp_written_put_efforts(&solved->made, &solved->given, solved->red->part, t, y,
                                solved->closes ? solved->dv : NULL, rates);
    const double *out = kmp_machine_run(machine, KMP_SOLVED_RUN);
    rates = rates ? rates : out + l->rates;
    solved->left = out + l->left;
    memcpy(dy, y + p, p * sizeof *dy);
    memcpy(dy + p, out + l->qdd, p * sizeof *dy);
    memcpy(dy + 2 * p, rates, r * sizeof *dy);
    if (power)
        *power = out[l->power];
    *good = kmp_solved_is_good(l, out, 1);
}

void kmp_solved_lend(kmp_solved *solved, double t, const double *q)
{
    const kmp_solved_layout *l = &solved->layout;
    const double *out = kmp_machine_run(solved->made.machine, KMP_SOLVED_END);
    kmp_eval_lend_closure(solved->eval, t, q, out + l->h, out + l->jacobian, l->h_t >= 0 ? out + l->h_t : NULL);
    solved->end = out;
}

bool kmp_solved_is_cancelled(const kmp_solved *solved, double rtol, double rate_scale)
{
    const double *scale = solved->eval->system->scale, *open = solved->end + solved->layout.open;
    int coordinates = kmp_model_coordinates(solved->eval->system->model);
    double most = 0;
    for (int i = 0; solved->layout.r > 0 && i < coordinates; i++)
        most = isfinite(open[i]) ? fmax(most, fabs(open[i]) / scale[i]) : INFINITY;
    return DBL_EPSILON * most > KMP_MARGIN_CANCELLED * rtol * rate_scale * rate_scale;
}

static bool order_is_good(const kmp_solved *solved, const double *end)
{
    const kmp_solved_layout *l = &solved->layout;
    return kmp_written_order_is_good(l->multipliers, solved->row, end + l->multiplier, solved->eval->system->row_scale,
                                     1);
}

bool kmp_solved_order_is_good(const kmp_solved *solved)
{
    return order_is_good(solved, solved->end);
}

bool kmp_solved_order_is_good_at(kmp_solved *solved, double t, const double *y)
{
    bool good;
    run(solved, t, y, &good);
    return good && order_is_good(solved, kmp_machine_run(solved->made.machine, KMP_SOLVED_END));
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
    return solved->given.effort ? NULL : solved->made.program;
}

kempe_status kmp_solved_write_nearby(const kmp_solved *solved, const kmp_partition *part, kmp_program **program)
{
    *program = NULL;
    if (solved->given.effort || solved->layout.factors == 0)
        return KEMPE_OK;
    double run = (double)kmp_solved_count(solved).paper;
    return kmp_solved_write_near(solved->eval, part, run, program) ? KEMPE_OK
                                                                   : kmp_fail_memory(solved->eval->system->context);
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
