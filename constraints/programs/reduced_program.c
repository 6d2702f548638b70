/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced right-hand side as a program: it is written, run once at the state at rest, and kept if its pivots are
 * good there. After a run the factors are checked by the same bounds, and a step's end can lend h, J, Bvu and the
 * correction of v from its last stage. */
#include "constraints/programs/reduced_program.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/programs/reduced_program_inside.h"
#include "constraints/programs/reduced_program_write.h"
#include "constraints/programs/saddle_program.h"
#include "constraints/programs/saddle_program_inside.h"
#include "constraints/programs/saddle_program_write.h"
#include "dynamics/motion.h"
#include <float.h>
#include <math.h>
#include <string.h>

_Static_assert((int)KMP_REDUCED_PROGRAM_CLOSE == KMP_SADDLE_PROGRAM_CLOSE &&
                   (int)KMP_REDUCED_PROGRAM_RATES == KMP_SADDLE_PROGRAM_RATES &&
                   (int)KMP_REDUCED_PROGRAM_END == KMP_SADDLE_PROGRAM_END,
               "programs by the reduced mass and by the saddle system have their stages in the same order");

struct kmp_reduced_program {
    const kmp_reduction *red;
    bool closes; /* with the stage KMP_REDUCED_PROGRAM_CLOSE */
    bool by_saddle;
    kmp_arena arena;
    kmp_writer_machine made;
    kmp_saddle_program_layout layout;
    kmp_eliminated *row; /* of multipliers */
    int *turn, *signs;   /* of each block of Jv: the factor from its pivots' signs to the block's sign; the block's
                          * sign */
    kmp_writer_efforts given;
    const double *dv;    /* r: the last correction, where it closes */
    const double *left;  /* r: the one that is left after it */
    const double *power; /* of the last run */
};

/* Computes the product of the pivots' signs in each block; pivots are written from the last block to the first. false:
 * a pivot is zero or NaN. */
static bool find_signs(const kmp_reduced_program *f, const double *pivot, int *signs)
{
    bool regular = true;
    for (int block = kmp_block_count(f->red->block); block-- > 0;) {
        int size;
        (void)kmp_block_columns(f->red->block, block, &size);
        signs[block] = 1;
        for (int k = size == 2 ? 1 : size; k-- > 0; pivot++) {
            regular = regular && fabs(*pivot) > 0 && fabs(*pivot) <= DBL_MAX;
            signs[block] = *pivot < 0 ? -signs[block] : signs[block];
        }
    }
    return regular;
}

/* Runs the stages before END at a state, with the efforts of the last run. Returns the last outputs. */
static const double *run_stages(kmp_reduced_program *f, double t, const double *y)
{
    kmp_writer_machine_place(&f->made, t, y);
    if (f->closes)
        (void)kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_CLOSE);
    const double *out = kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_RATES);
    return f->by_saddle ? kmp_machine_run(f->made.machine, f->layout.stage) : out;
}

/* -- making ------------------------------------------------------------------------------------------ */

/* *program: NULL if there is none by the saddle system. False: no memory. */
static bool write_program(kmp_reduced_program *f, kmp_program **program)
{
    const kempe_system *s = f->red->eval->system;
    int *order = KMP_ARENA_NEW(&f->arena, int, f->red->r), p = f->red->p, r = f->red->r;
    if (!order)
        return false;
    kmp_writer_order(f->red, order);
    if (f->by_saddle) {
        const kmp_saddle_program_plan plan = {.part = f->red->part, .red = f->red, .order = order, .closes = f->closes};
        kmp_saddle_program_written written;
        bool made = kmp_saddle_program_write(f->red->eval, &plan, &written);
        f->layout = written.layout;
        f->row = written.row;
        *program = written.program;
        return made;
    }
    const kmp_reduced_program_plan plan = {.order = order, .power = s->dissipative, .closes = f->closes};
    kmp_reduced_program_written written = kmp_reduced_program_write(f->red, &plan);
    kmp_saddle_program_layout *l = &f->layout;
    *l = (kmp_saddle_program_layout){.stage = s->force ? KMP_REDUCED_PROGRAM_ACCELERATIONS : KMP_REDUCED_PROGRAM_RATES,
                                     .pivots = p,
                                     .multipliers = written.layout.multipliers,
                                     .rates = p,
                                     .pivot = s->force ? p : p + r,
                                     .turns = written.layout.turns,
                                     .h = written.layout.multipliers + written.layout.pivots};
    l->power = l->pivot + p;
    l->left = l->power + s->dissipative;
    l->jacobian = l->h + s->m;
    l->h_t = s->rheonomic ? l->jacobian + s->jacobian.count : -1;
    f->row = written.row;
    *program = written.program;
    return written.program;
}

static kempe_status make_program(kmp_reduced_program **out, const kmp_reduction *red, bool closes, bool by_saddle)
{
    int n = red->n, efforts = red->eval->system->force ? n : 0;
    kmp_reduced_program *f = KMP_NEW(kmp_reduced_program, 1);
    if (f)
        *f = (kmp_reduced_program){.red = red, .closes = closes, .by_saddle = by_saddle};
    kmp_program *program = NULL;
    bool made =
        f && write_program(f, &program) && (!program || kmp_writer_machine_init(&f->made, red->eval, program)) &&
        KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, 2 * n, &f->given.state), KMP_ROOM(int, red->r, &f->turn, &f->signs),
                       KMP_ROOM(double, efforts, &f->given.q, &f->given.qd));
    if (made && efforts > 0)
        f->given.effort = KMP_ARENA_NEW(&f->arena, double, efforts);
    if (!made || f->arena.failed) {
        kmp_reduced_program_free(f);
        return kmp_fail_memory(red->eval->system->context);
    }
    /* The state at rest. */
    for (int c = 0; c < red->p; c++)
        f->given.state[c] = red->eval->q[red->part->u[c]];
    for (int i = 0; i < red->r; i++)
        f->given.state[2 * red->p + i] = red->eval->q[red->part->v[i]];
    const double *there = NULL;
    if (program) {
        kmp_machine_set(f->made.machine, KMP_IN_QD, f->given.state);
        there = run_stages(f, red->eval->t, f->given.state);
    }
    if (by_saddle && (!there || !kmp_saddle_program_is_good(&f->layout, there, 1))) {
        kmp_reduced_program_free(f);
        return KEMPE_OK;
    }
    *out = f;
    if (by_saddle)
        return KEMPE_OK;
    /* The signs of blocks by those of their pivots. */
    const double *end = kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_END);
    (void)find_signs(f, end + f->layout.multipliers, f->signs);
    if (red->r > 0)
        kmp_block_take_signs(red->block, f->turn);
    for (int block = kmp_block_count(red->block); block-- > 0;)
        f->turn[block] *= f->signs[block];
    return KEMPE_OK;
}

kempe_status kmp_reduced_program_new(kmp_reduced_program **out, const kmp_reduction *red, bool closes)
{
    *out = NULL;
    /* The program must have all numbers, and the linear algebra be small. */
    bool fits = red->p <= KMP_REDUCED_PROGRAM_FREEDOMS && kmp_motion_known(red->eval->system)->block_count == 0 &&
                kmp_writer_blocks_fit(red);
    return fits ? make_program(out, red, closes, false) : KEMPE_OK;
}

kempe_status kmp_reduced_program_new_by_saddle(kmp_reduced_program **out, const kmp_reduction *red, bool closes)
{
    *out = NULL;
    return make_program(out, red, closes, true);
}

void kmp_reduced_program_free(kmp_reduced_program *f)
{
    if (!f)
        return;
    kmp_writer_machine_free(&f->made);
    kmp_arena_free(&f->arena);
    kmp_free(f->row);
    kmp_free(f);
}

bool kmp_reduced_program_is_by_saddle(const kmp_reduced_program *f)
{
    return f->by_saddle;
}

/* -- running ----------------------------------------------------------------------------------------- */

kmp_writer_correction kmp_reduced_program_close(kmp_reduced_program *f, double t, const double *y)
{
    kmp_writer_correction c =
        kmp_writer_machine_close(&f->made, KMP_REDUCED_PROGRAM_CLOSE, f->red->r, f->layout.turns, t, y);
    f->dv = c.dv;
    return c;
}

const double *kmp_reduced_program_left(const kmp_reduced_program *f)
{
    return f->left;
}

bool kmp_reduced_program_run(kmp_reduced_program *f, double t, const double *y, double *dy)
{
    if (f->closes)
        (void)kmp_reduced_program_close(f, t, y);
    else
        kmp_writer_machine_place(&f->made, t, y);
    return kmp_reduced_program_finish(f, t, y, dy);
}

bool kmp_reduced_program_finish(kmp_reduced_program *f, double t, const double *y, double *dy)
{
    const kmp_saddle_program_layout *l = &f->layout;
    size_t p = (size_t)f->red->p, r = (size_t)f->red->r;
    const double *rates = f->given.effort ? kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_RATES) : NULL;
    if (rates)
        kmp_writer_put_efforts(&f->made, &f->given, f->red->part, t, y, f->closes ? f->dv : NULL, rates);
    const double *out = kmp_machine_run(f->made.machine, l->stage);
    f->left = rates && !f->by_saddle ? rates + r : out + l->left;
    f->power = out + l->power;
    bool positive = true;
    if (rates || f->by_saddle) {
        memcpy(dy + p, out, p * sizeof *dy);
        memcpy(dy + 2 * p, rates ? rates : out + l->rates, r * sizeof *dy);
    } else { /* one after the other */
        memcpy(dy + p, out, (p + r) * sizeof *dy);
    }
    for (size_t c = 0; c < p; c++) {
        dy[c] = y[p + c];
        positive = positive && (f->by_saddle || out[(size_t)l->pivot + c] > 0);
    }
    return f->by_saddle ? kmp_saddle_program_is_good(l, out, 1) : positive;
}

double kmp_reduced_program_power(const kmp_reduced_program *f)
{
    double power = *f->power;
    for (int i = 0; f->given.effort && !f->by_saddle && i < f->red->n; i++)
        power += f->given.effort[i] * f->given.qd[i];
    return power;
}

bool kmp_reduced_program_applies(kmp_reduced_program *f)
{
    if (f->by_saddle && f->red->eval->given)
        return false;
    return kmp_writer_machine_applies(&f->made);
}

bool kmp_reduced_program_is_stale(kmp_reduced_program *f)
{
    return kmp_writer_machine_is_stale(&f->made);
}

static bool is_good(const kmp_reduced_program *f, const double *end)
{
    return kmp_writer_order_is_good(f->layout.multipliers, f->row, end + f->layout.multiplier,
                                    f->red->eval->system->row_scale, 1);
}

kmp_reduced_program_end kmp_reduced_program_at_end(kmp_reduced_program *f)
{
    const kmp_saddle_program_layout *l = &f->layout;
    const double *out = kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_END);
    kmp_reduced_program_end end = {
        .good = is_good(f, out), .signs = f->signs, .h = out + l->h, .jacobian = out + l->jacobian};
    end.regular = find_signs(f, out + l->multipliers, f->signs);
    for (int block = kmp_block_count(f->red->block); block-- > 0;)
        f->signs[block] *= f->turn[block];
    end.h_t = l->h_t >= 0 ? out + l->h_t : NULL;
    end.bvu = end.h + kmp_writer_closure_count(f->red->eval->system);
    end.dv = end.bvu + f->red->r * f->red->p;
    end.x_t = f->closes ? end.dv + f->red->r : NULL;
    end.a0 = f->closes ? end.x_t + f->red->r : NULL;
    return end;
}

bool kmp_reduced_program_lend(kmp_reduced_program *f, double t, const double *q, double rtol, double rate_scale,
                              bool *cancelled)
{
    const double *end = kmp_saddle_program_end(&f->made, &f->layout, f->red->eval, t, q);
    *cancelled = kmp_saddle_program_cancels(&f->layout, f->red->eval->system, end, rtol, rate_scale);
    return is_good(f, end);
}

bool kmp_reduced_program_is_good(kmp_reduced_program *f, double t, const double *y)
{
    if (f->layout.multipliers == 0 && !f->by_saddle)
        return true;
    const double *out = run_stages(f, t, y);
    return (!f->by_saddle || kmp_saddle_program_is_good(&f->layout, out, 1)) &&
           is_good(f, kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_END));
}

const kmp_program *kmp_reduced_program_code(const kmp_reduced_program *f)
{
    return f->given.effort ? NULL : f->made.program;
}

const kmp_saddle_program_layout *kmp_reduced_program_layout_of(const kmp_reduced_program *f)
{
    return &f->layout;
}
