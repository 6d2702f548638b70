/* SPDX-License-Identifier: BSD-3-Clause */
/* A frame from a program: values get slots, and stages are cut into segments at special functions. */
#pragma once

#include "backend/frame.h"
#include "symbolic/contraction.h"

/** Data of the preparation in addition to the frame. Arrays by instruction. */
typedef struct kmp_layout {
    kmp_frame *frame;
    const kmp_program *program;
    kmp_arena arena;            /* of all arrays here, and of others that are needed as long */
    bool *is_straight;          /* the back end's own arithmetic */
    const uint8_t *contraction; /* of the program; NULL: each instruction is alone */
    uint32_t special_count;     /* of instructions that are not */
    int leaves;                 /* constants and inputs: values before the instructions */
    uint32_t *depth;            /* segment, within the stage, in which a value appears */
    uint16_t *stage_of;
    uint32_t *slot;          /* by value */
    uint32_t lanes;          /* the first slot of sines and cosines */
    int *order;              /* instructions by segment, each segment's in the program's order */
    uint32_t *segment_start; /* in `order`; one more entry marks the end */
    uint32_t *angle_of;      /* by slot: the position of its angle in the frame, if any; NULL: there are none */
    uint32_t *solving_of;    /* by instruction: where an implicit one is solved; NULL: there are none */
    uint8_t *part;           /* by instruction; 0 where the stage is in one; NULL: no sharing */
} kmp_layout;

/** Fills the frame, in parts for so many threads (0: no sharing). `extra` slots from frame->slots on belong to the
 * back end; frame->slots grows as they are taken. `blocks` runs the contents of implicit blocks (NULL: interpreted),
 * after kmp_frame_add_blocks. False: no memory. kmp_layout_free and kmp_frame_free in any case. */
bool kmp_layout_init(kmp_layout *l, kmp_frame *frame, const kmp_program *program,
                     bool (*straight)(const kmp_instruction *in), uint32_t extra, const kmp_backend *blocks,
                     int threads);
void kmp_layout_free(kmp_layout *l);

/** The functions of a back end that run the contents of implicit blocks. */
kmp_block_runner kmp_layout_runner(const kmp_backend *backend);

/** Visits the straight instructions in the program's order, segment by segment, without products that are part of a
 * sum. `start` receives *count, which the callback increases, at the beginning of each segment and at the end. */
typedef void kmp_layout_write(void *self, int instruction);
void kmp_layout_visit(const kmp_layout *l, kmp_layout_write *write, void *self, const uint32_t *count, uint32_t *start);

/** The instruction behind an operand, -1 for a leaf; the slot of an operand; the slot of an instruction's value. */
static inline int kmp_layout_instruction(const kmp_layout *l, uint32_t operand)
{
    int i = (int)(operand >> 1) - l->leaves;
    return i >= 0 ? i : -1;
}
static inline uint32_t kmp_layout_slot(const kmp_layout *l, uint32_t operand)
{
    return l->slot[operand >> 1];
}
static inline uint32_t kmp_layout_target(const kmp_layout *l, int instruction)
{
    return l->slot[l->leaves + instruction];
}

static inline int kmp_layout_part(const kmp_layout *l, int instruction)
{
    return l->part ? l->part[instruction] : 0;
}

/** True if two straight instructions are in one segment. */
static inline bool kmp_layout_together(const kmp_layout *l, int i, int j)
{
    return l->stage_of[i] == l->stage_of[j] && l->depth[i] == l->depth[j];
}

static inline kmp_contraction kmp_layout_contraction(const kmp_layout *l, int instruction)
{
    return l->contraction ? (kmp_contraction)l->contraction[instruction] : KMP_ALONE;
}

/** The operands that the evaluation of an instruction reads, with signs, at most three; returns their number. For a sum
 * that takes a product they are x, y, z of x * y + z. */
static inline int kmp_layout_operands(const kmp_layout *l, int instruction, uint32_t operand[3])
{
    const kmp_instruction *in = &l->program->instruction[instruction];
    kmp_contraction with = kmp_layout_contraction(l, instruction);
    if (with == KMP_CONTRACTED)
        return 0;
    if (with != KMP_ALONE) {
        kmp_multiply_add m = kmp_multiply_add_of(l->program, instruction, with);
        operand[0] = m.x;
        operand[1] = m.y;
        operand[2] = m.z;
        return 3;
    }
    int count = kmp_op_arity((kmp_op)in->op);
    for (int k = 0; k < count; k++)
        operand[k] = kmp_instruction_operand(in, k);
    return count;
}

/* program_parts.c */

enum { KMP_PARTS_MOST = 64 };
