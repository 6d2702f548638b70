/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/frame.h"
#include "base/thread_pool.h"
#include "symbolic/op_value.h"
#include "symbolic/solving.h"
#include "symbolic/table_function.h"
#include <string.h>

void kmp_frame_free(kmp_frame *f)
{
    for (uint32_t k = 0; f->solving && k < f->solving_count; k++)
        kmp_solving_free(f->solving[k]);
    for (uint32_t k = 0; f->room && k < f->room_count; k++)
        kmp_solving_free(f->room[k]);
    kmp_arena_free(&f->arena);
    kmp_arena_free(&f->values);
    *f = (kmp_frame){0};
}

bool kmp_frame_extend(kmp_frame *f, uint32_t slots)
{
    kmp_arena values = {0};
    double *v = slots > 0 ? kmp_arena_aligned(&values, f->slots + slots) : f->v;
    if (!v)
        return false;
    if (slots > 0) {
        memcpy(v, f->v, f->slots * sizeof *v);
        kmp_arena_free(&f->values);
        f->values = values;
    }
    f->v = v;
    f->slots += slots;
    return true;
}

static kmp_solving *new_solving(const kmp_frame *f, uint32_t block)
{
    return kmp_solving_new(&f->program->block[block], f->runner.run ? &f->runner : NULL);
}

/* Rooms of the blocks for each thread. A room for each list of arguments would do as well, but a room is large: many
 * do not fit in a cache. */
static bool add_rooms(kmp_frame *f)
{
    uint32_t blocks = (uint32_t)f->program->block_count, threads = (uint32_t)kmp_team_threads(f->team);
    f->room_count = blocks * threads;
    f->room = KMP_ARENA_NEW(&f->arena, kmp_solving *, f->room_count);
    bool ok = f->room;
    for (uint32_t k = 0; ok && k < f->solving_count; k++)
        for (uint32_t r = f->block_of[k]; ok && r < f->room_count; r += blocks) {
            f->room[r] = f->room[r] ? f->room[r] : new_solving(f, f->block_of[k]);
            ok = f->room[r];
        }
    return ok;
}

bool kmp_frame_add_blocks(kmp_frame *f)
{
    f->solving = KMP_ARENA_NEW(&f->arena, kmp_solving *, f->solving_count);
    bool ok = f->solving && (!f->team || add_rooms(f));
    for (uint32_t k = 0; ok && k < f->solving_count; k++) {
        /* A block with another list of arguments is in the room of an earlier one. */
        uint32_t block = f->block_of[k], same = 0;
        while (!f->room && same < k && f->block_of[same] != block)
            same++;
        f->solving[k] = f->room    ? kmp_solving_beside(f->room[block])
                        : same < k ? kmp_solving_beside(f->solving[same])
                                   : new_solving(f, block);
        ok = f->solving[k];
    }
    return ok;
}

void kmp_frame_set(void *code, kmp_input_kind kind, const double *values)
{
    const kmp_frame *f = code;
    const kmp_input_slot *feed = f->feeds + f->feed_start[kind], *end = f->feeds + f->feed_start[kind + 1];
    double *restrict v = f->v;
    for (; feed < end; feed++)
        v[feed->slot] = values[feed->index];
}

const double *kmp_frame_outputs(const void *code, int stage)
{
    const kmp_frame *f = code;
    return f->v + f->out + f->program->outputs[stage];
}

static void add_count(const kmp_frame *f, uint32_t block, const kmp_solving *solving, kmp_block_counts *counts)
{
    const kmp_counts of = kmp_solving_count(solving);
    kmp_counts_add(f->program->block[block].averages ? &counts->averages : &counts->equations, &of, 1);
}

void kmp_frame_count(const void *code, kmp_block_counts *counts)
{
    const kmp_frame *f = code;
    for (uint32_t k = 0; f->room && k < f->room_count; k++)
        if (f->room[k])
            add_count(f, k % (uint32_t)f->program->block_count, f->room[k], counts);
    for (uint32_t k = 0; f->solving && k < f->solving_count; k++) {
        const bool averages = f->program->block[f->block_of[k]].averages;
        add_count(f, f->block_of[k], f->solving[k], counts);
        *(averages ? &counts->average_lists : &counts->equation_lists) += kmp_solving_is_done(f->solving[k]);
    }
}

static double run_implicit(const kmp_frame *f, const kmp_special *s, const double *v, size_t width)
{
    const kmp_instruction *in = &f->program->instruction[s->instruction];
    kmp_solving *solving = f->solving[s->operand[1]];
    if (f->room)
        kmp_solving_move(solving, f->room[kmp_team_thread(f->team) * f->program->block_count + (int)in->b]);
    double *p = kmp_solving_arguments(solving);
    for (int l = 0; l < f->program->block[in->b].arguments; l++) {
        const kmp_list_item *a = &f->items[s->operand[0] + (uint32_t)l];
        p[l] = v[a->slot * width] * a->factor;
    }
    return kmp_solving_value(solving, (int)in->c);
}

/* Operands that an operation has not are the slot of 1. *piece is that of the last table, since several tables are
 * often looked up at one place. */
static inline __attribute__((always_inline)) void run_special(const kmp_frame *f, const kmp_special *s, double *v,
                                                              size_t width, int *piece)
{
    double x[3];
    if (s->op == KMP_OP_DIV) { /* has no signs */
        v[s->d * width] = v[s->operand[0] * width] / v[s->operand[1] * width];
        return;
    }
    if (s->op == KMP_OP_IMPLICIT) {
        v[s->d * width] = run_implicit(f, s, v, width);
        return;
    }
    x[0] = s->minus[0] ? -v[s->operand[0] * width] : v[s->operand[0] * width];
    if (s->op == KMP_OP_TABLE) {
        const kmp_instruction *in = &f->program->instruction[s->instruction];
        v[s->d * width] = kmp_table_value_near(f->program->table[in->b], (int)in->c, x[0], piece);
        return;
    }
    for (int k = 1; k < 3; k++)
        x[k] = s->minus[k] ? -v[s->operand[k] * width] : v[s->operand[k] * width];
    v[s->d * width] = kmp_op_value_here((kmp_op)s->op, x[0], x[1], x[2]);
}

void kmp_frame_special(const kmp_frame *f, const kmp_special *special, double *v, size_t width)
{
    int piece = 0;
    run_special(f, special, v, width, &piece);
}

void kmp_frame_specials(kmp_frame *f, uint32_t segment)
{
    const kmp_special *special = f->specials + f->segments[segment].special;
    const kmp_special *end = f->specials + f->segments[segment + 1].special;
    int own = 0, *piece = f->team ? &own : &f->piece; /* a frame of several threads is not written to */
    const kmp_solving *solved = NULL; /* of one list of arguments, which are the same within a segment */
    for (; special < end; special++) {
        const bool implicit = special->op == KMP_OP_IMPLICIT;
        if (implicit && f->solving[special->operand[1]] == solved)
            f->v[special->d] = kmp_solving_component(solved, (int)f->program->instruction[special->instruction].c);
        else
            run_special(f, special, f->v, 1, piece);
        solved = implicit ? f->solving[special->operand[1]] : solved;
    }
}

void kmp_frame_copies(kmp_frame *f, int stage)
{
    const kmp_copy *copy = f->copies + f->copy_start[stage], *end = f->copies + f->copy_start[stage + 1];
    double *v = f->v;
    for (; copy < end; copy++)
        v[copy->to] = v[copy->from] * copy->factor;
}
