/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/written/fused.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/written/fused_inside.h"
#include "dynamics/motion.h"
#include <float.h>
#include <math.h>
#include <string.h>

struct kmp_fused {
    const kmp_reduction *red;
    bool closes; /* with the stage KMP_FUSED_CLOSE */
    kmp_arena arena;
    kmp_written_machine made;
    kmp_fused_layout layout;
    kmp_eliminated *row; /* of multipliers */
    int *turn, *signs;   /* of each block of Jv: the factor from its pivots' signs to the block's sign; the block's
                          * sign */
    kmp_written_efforts given;
    const double *dv;    /* r: the last correction, where it closes */
    const double *left;  /* r: the one that is left after it */
    const double *power; /* of the last run */
};

/* Computes the product of the pivots' signs in each block; pivots are written from the last block to the first. false:
 * a pivot is zero or NaN. */
static bool find_signs(const kmp_fused *f, const double *pivot, int *signs)
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

static const double *run_rates(kmp_fused *f)
{
    if (f->closes)
        (void)kmp_machine_run(f->made.machine, KMP_FUSED_CLOSE);
    return kmp_machine_run(f->made.machine, KMP_FUSED_RATES);
}

static void find_turns(kmp_fused *f)
{
    const kmp_reduction *red = f->red;
    for (int c = 0; c < red->p; c++)
        f->given.state[c] = red->eval->q[red->part->u[c]];
    for (int i = 0; i < red->r; i++)
        f->given.state[2 * red->p + i] = red->eval->q[red->part->v[i]];
    kmp_written_machine_place(&f->made, red->eval->t, f->given.state);
    (void)run_rates(f);
    const double *end = kmp_machine_run(f->made.machine, KMP_FUSED_END);
    (void)find_signs(f, end + f->layout.multipliers, f->signs);
    if (red->r > 0)
        kmp_block_take_signs(red->block, f->turn);
    for (int block = kmp_block_count(red->block); block-- > 0;)
        f->turn[block] *= f->signs[block];
}

/* -- making ------------------------------------------------------------------------------------------ */

static bool allocate(kmp_fused *f)
{
    int n = f->red->n, efforts = f->red->eval->system->force ? n : 0;
    KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, 2 * n, &f->given.state), KMP_ROOM(int, f->red->r, &f->turn, &f->signs),
                   KMP_ROOM(double, efforts, &f->given.q, &f->given.qd));
    f->given.effort = efforts ? KMP_ARENA_NEW(&f->arena, double, efforts) : NULL;
    return !f->arena.failed;
}

static kmp_program *write_program(kmp_fused *f)
{
    const kempe_system *s = f->red->eval->system;
    int *order = KMP_ARENA_NEW(&f->arena, int, f->red->r);
    if (!order)
        return NULL;
    kmp_written_order(f->red, order);
    const kmp_fused_plan plan = {.order = order, .power = s->dissipative, .closes = f->closes};
    kmp_fused_written written = kmp_fused_write(f->red, &plan);
    f->layout = written.layout;
    f->row = written.row;
    return written.program;
}

kempe_status kmp_fused_new(kmp_fused **out, const kmp_reduction *red, bool closes)
{
    *out = NULL;
    /* The program must have all numbers, and the linear algebra be small. */
    if (red->p > KMP_FUSED_FREEDOMS || kmp_motion_known(red->eval->system)->block_count > 0 ||
        !kmp_written_blocks_fit(red))
        return KEMPE_OK;
    kmp_fused *f = KMP_NEW(kmp_fused, 1);
    if (f)
        *f = (kmp_fused){.red = red, .closes = closes};
    if (!f || !kmp_written_machine_init(&f->made, red->eval, write_program(f)) || !allocate(f)) {
        kmp_fused_free(f);
        return kmp_fail_memory(red->eval->system->context);
    }
    find_turns(f);
    *out = f;
    return KEMPE_OK;
}

void kmp_fused_free(kmp_fused *f)
{
    if (!f)
        return;
    kmp_written_machine_free(&f->made);
    kmp_arena_free(&f->arena);
    kmp_free(f->row);
    kmp_free(f);
}

/* -- running ----------------------------------------------------------------------------------------- */

kmp_written_correction kmp_fused_close(kmp_fused *f, double t, const double *y)
{
    kmp_written_correction c = kmp_written_machine_close(&f->made, KMP_FUSED_CLOSE, f->red->r, f->layout.turns, t, y);
    f->dv = c.dv;
    return c;
}

const double *kmp_fused_left(const kmp_fused *f)
{
    return f->left;
}

bool kmp_fused_run(kmp_fused *f, double t, const double *y, double *dy)
{
    if (f->closes)
        (void)kmp_fused_close(f, t, y);
    else
        kmp_written_machine_place(&f->made, t, y);
    return kmp_fused_finish(f, t, y, dy);
}

bool kmp_fused_finish(kmp_fused *f, double t, const double *y, double *dy)
{
    int p = f->red->p, r = f->red->r;
    bool positive = true;
    const double *out = kmp_machine_run(f->made.machine, KMP_FUSED_RATES), *pivot = out + p + r;
    f->left = f->given.effort ? out + r : pivot + p + f->red->eval->system->dissipative;
    if (f->given.effort) {
        memcpy(dy + 2 * p, out, (size_t)r * sizeof *dy);
        /* udd and pivots with the user-defined forces. */
        kmp_written_put_efforts(&f->made, &f->given, f->red->part, t, y, f->closes ? f->dv : NULL, out);
        out = kmp_machine_run(f->made.machine, KMP_FUSED_ACCELERATIONS);
        memcpy(dy + p, out, (size_t)p * sizeof *dy);
        pivot = out + p;
    } else {
        memcpy(dy + p, out, (size_t)(p + r) * sizeof *dy);
    }
    for (int c = 0; c < p; c++) {
        dy[c] = y[p + c];
        positive = positive && pivot[c] > 0;
    }
    f->power = pivot + p;
    return positive;
}

double kmp_fused_power(const kmp_fused *f)
{
    double power = *f->power;
    for (int i = 0; f->given.effort && i < f->red->n; i++)
        power += f->given.effort[i] * f->given.qd[i];
    return power;
}

bool kmp_fused_applies(kmp_fused *f)
{
    return kmp_written_machine_applies(&f->made);
}

bool kmp_fused_is_stale(kmp_fused *f)
{
    return kmp_written_machine_is_stale(&f->made);
}

static bool is_good(const kmp_fused *f, const double *multiplier)
{
    return kmp_written_order_is_good(f->layout.multipliers, f->row, multiplier, f->red->eval->system->row_scale, 1);
}

kmp_fused_end kmp_fused_at_end(kmp_fused *f)
{
    const kempe_system *s = f->red->eval->system;
    const double *out = kmp_machine_run(f->made.machine, KMP_FUSED_END), *pivot = out + f->layout.multipliers;
    kmp_fused_end end = {.good = is_good(f, out), .regular = find_signs(f, pivot, f->signs), .signs = f->signs};
    for (int block = kmp_block_count(f->red->block); block-- > 0;)
        f->signs[block] *= f->turn[block];
    end.h = pivot + f->layout.pivots;
    end.jacobian = end.h + s->m;
    end.h_t = s->rheonomic ? end.jacobian + s->jacobian.count : NULL;
    end.bvu = end.jacobian + s->jacobian.count + (s->rheonomic ? s->m : 0);
    end.dv = end.bvu + f->red->r * f->red->p;
    end.x_t = f->closes ? end.dv + f->red->r : NULL;
    end.a0 = f->closes ? end.x_t + f->red->r : NULL;
    return end;
}

bool kmp_fused_is_good(kmp_fused *f, double t, const double *y)
{
    if (f->layout.multipliers == 0)
        return true;
    kmp_written_machine_place(&f->made, t, y);
    (void)run_rates(f);
    return is_good(f, kmp_machine_run(f->made.machine, KMP_FUSED_END));
}

const kmp_program *kmp_fused_program(const kmp_fused *f)
{
    return f->given.effort ? NULL : f->made.program;
}

kmp_counts kmp_fused_count(const kmp_fused *f)
{
    return kmp_program_count(f->made.program, KMP_FUSED_RATES, KMP_FUSED_ACCELERATIONS);
}
