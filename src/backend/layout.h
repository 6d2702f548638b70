/* SPDX-License-Identifier: BSD-3-Clause */
/* A frame is the common data of back ends that keep every value in a slot: the slots, the inputs and outputs, and
 * operations other than arithmetic. A stage is a sequence of segments. A segment is straight-line arithmetic of the
 * back end, then sines and cosines of all angles available by then, in lanes, then other functions. A layout makes a
 * frame from a program: values get slots, and stages are cut into segments at special functions. */
#pragma once

#include "backend/machine.h"
#include "backend/sincos.h"
#include "base/arena.h"
#include "symbolic/contraction.h"
#include "symbolic/implicit.h"

/* A function, or a division where that is not the back end's own. Operands of an implicit one: the first item of its
 * list, where it is solved. */
typedef struct kmp_special {
    uint8_t op;
    bool minus[3]; /* signs of the operands */
    uint32_t d, operand[3], instruction;
} kmp_special;

typedef struct kmp_segment {
    uint32_t angle, angles; /* the first, and the number; the list is padded to a multiple of eight */
    uint32_t special;       /* the first; the next segment's is the end */
} kmp_segment;

/* An output that no instruction of its stage computes straight into its place. */
typedef struct kmp_copy {
    uint32_t from, to;
    double factor; /* 1 or -1 */
} kmp_copy;

/* An item of the list that an implicit block takes. */
typedef struct kmp_list_item {
    uint32_t slot;
    float factor; /* 1 or -1 */
} kmp_list_item;

/* An input: the slot of its value and its index in the given vector. */
typedef struct kmp_input_slot {
    uint32_t slot, index;
} kmp_input_slot;

enum { KMP_SLOT_ONE, KMP_SLOT_MINUS_ONE, KMP_SLOT_MINUS_ZERO, KMP_SLOT_WASTE, KMP_FIRST_SLOT };

typedef struct kmp_frame {
    const kmp_program *program;
    kmp_arena arena;  /* of all arrays but v */
    kmp_arena values; /* of v */
    double *v;        /* slots: signs and ones, constants, inputs, instructions, outputs, the back end's own */
    uint32_t slots;
    kmp_special *specials;
    uint32_t special_count;
    uint32_t *angle, *sine, *cosine; /* slots; sines and cosines by eights, as kmp_sincos_slots leaves them */
    uint32_t angles;
    kmp_segment *segments;
    uint32_t segment_count; /* one more entry marks the end */
    uint32_t *stage;        /* stages + 1: first segment */
    kmp_copy *copies;
    uint32_t *copy_start; /* stages + 1: first copy */
    uint32_t out;         /* the first of the outputs' slots */
    kmp_input_slot *feeds;
    int feed_start[KMP_IN_COUNT + 1]; /* first feed of each kind */
    kmp_block_runner runner;          /* of implicit blocks */
    uint32_t *block_of;               /* blocks with a list of arguments each, all different */
    kmp_solving **solving;            /* of these: each keeps its last solution. NULL: kmp_frame_add_blocks */
    uint32_t solving_count;
    kmp_solving *
        *room; /* with a thread pool: the solvings whose code and room each thread uses, by threads and blocks */
    uint32_t room_count;
    kmp_list_item *items; /* of implicit instructions, one after another */
    uint32_t item_count;
    int piece;   /* of the table that was looked up last */
    bool taped;  /* the code is the tape */
    int threads; /* for which stages are in parts that do not read each other (backend/program_parts.c); 0: they are not
                  */
    kmp_team *team;       /* of as many threads; NULL: there is none */
    uint32_t *part_start; /* stages + 1: first entry of each stage in part_first, of which a stage in one has none */
    uint32_t *part_first; /* first segments within the stage: of those before the parts, of the parts, of those after
                           * them, the end */
} kmp_frame;

/** The number of parts of a stage; 0: it is in one. */
static inline int kmp_frame_parts(const kmp_frame *f, int stage)
{
    uint32_t entries = f->threads > 0 ? f->part_start[stage + 1] - f->part_start[stage] : 0;
    return entries > 0 ? (int)entries - 3 : 0;
}

void kmp_frame_free(kmp_frame *frame);

/** Adds slots after the others. False: no memory. */
bool kmp_frame_extend(kmp_frame *frame, uint32_t slots);

/** Room to solve the blocks in. False: no memory. */
bool kmp_frame_add_blocks(kmp_frame *frame);

/** One function, with slots of `width` numbers from v on. */
void kmp_frame_special(const kmp_frame *frame, const kmp_special *special, double *v, size_t width);

/** Functions other than sines and cosines; the copies that end a stage. */
void kmp_frame_specials(kmp_frame *frame, uint32_t segment);
void kmp_frame_copies(kmp_frame *frame, int stage);

/** The functions that follow the arithmetic of a segment. */
static inline void kmp_frame_functions(kmp_frame *f, uint32_t segment)
{
    const kmp_segment *here = &f->segments[segment];
    if (here->angles > 0)
        kmp_sincos_slots(here->angles, f->angle + here->angle, f->v, f->v + f->sine[here->angle]);
    if (here[1].special > here->special)
        kmp_frame_specials(f, segment);
}

/** The back end's `set`, `outputs` and `count`, when the frame is the first member of its code. */
void kmp_frame_set(void *code, kmp_input_kind kind, const double *values);
const double *kmp_frame_outputs(const void *code, int stage);
void kmp_frame_count(const void *code, kmp_block_counts *counts);

/** Data of the preparation in addition to the frame. Arrays by instruction. */
typedef struct kmp_layout {
    kmp_frame *frame;
    const kmp_program *program;
    kmp_arena arena;            /* of all arrays here, and of others that are needed as long */
    bool *is_straight;          /* the back end's own arithmetic */
    const uint8_t *contraction; /* of the program; NULL: each instruction is separate */
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

/** Fills the frame, in parts for a number of threads (0: no sharing). `extra` slots from frame->slots on belong to the
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

enum { KMP_PARTS_MOST = 64 };
