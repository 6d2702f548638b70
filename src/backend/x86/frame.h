/* SPDX-License-Identifier: BSD-3-Clause */
/* What back ends that keep every value in a slot have in common: the slots, which values are inputs and outputs, and
 * what is no arithmetic. A stage is a row of segments: straight arithmetic, which is the back end's own, then the sines
 * and cosines of all angles that are known by then, in lanes, then other functions. */
#ifndef KMP_BACKEND_X86_FRAME_H
#define KMP_BACKEND_X86_FRAME_H

#include "backend/sincos.h"
#include "backend/x86/machine.h"
#include "base/thread_pool.h"
#include "symbolic/implicit.h"

/* A function, or a division where that is not the back end's own. Operands of an implicit one: the first item of its
 * list, where it is solved. */
typedef struct kmp_special {
    uint8_t op;
    bool minus[3]; /* of the operands */
    uint32_t d, operand[3], instruction;
} kmp_special;

typedef struct kmp_segment {
    uint32_t angle, angles; /* the first, and how many; the list goes on to a multiple of eight */
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
    double factor; /* 1 or -1 */
} kmp_list_item;

/* A stage in parts that do not read each other (backend/parts.h), by their first segments within the stage: what comes
 * before them, the parts, what comes after, the end. */
typedef struct kmp_parting {
    int parts; /* 0: it is in one */
    uint32_t *first;
} kmp_parting;

/* An input: where its value goes and where in the vector given it stands. */
typedef struct kmp_feed {
    uint32_t slot, index;
} kmp_feed;

enum { KMP_SLOT_ONE, KMP_SLOT_MINUS_ONE, KMP_SLOT_MINUS_ZERO, KMP_SLOT_WASTE, KMP_FIRST_SLOT };
enum { KMP_LANES = 8 }; /* of sines and cosines */

typedef struct kmp_frame {
    const kmp_program *program;
    double *memory; /* of v */
    double *v;      /* slots: the four above, constants, inputs, instructions, outputs, what else the back end wants */
    uint32_t slots;
    kmp_special *specials;
    uint32_t special_count;
    uint32_t *angle, *sine, *cosine; /* slots; sines and cosines by eights, as kmp_sincos_slots leaves them */
    uint32_t angles;
    kmp_segment *segments;
    uint32_t segment_count; /* the end stands behind */
    uint32_t *stage;        /* stages + 1: first segment */
    kmp_copy *copies;
    uint32_t *copy_start; /* stages + 1: first copy */
    double *out;          /* the outputs' slots */
    kmp_feed *feeds;
    int feed_start[KMP_IN_COUNT + 1]; /* first feed of each kind */
    kmp_block_runner runner;          /* of blocks */
    kmp_solving **solving;            /* of each block with each list of arguments: both remember */
    uint32_t solving_count;
    kmp_list_item *items; /* of implicit instructions, one after another */
    uint32_t item_count;
    kmp_team *team;       /* NULL: there is none */
    kmp_parting *parting; /* by stage; NULL without a team */
} kmp_frame;

void kmp_frame_free(kmp_frame *frame);

/** Those that are no sine or cosine; the copies that end a stage. */
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

/** The back end's `set` and `outputs`, when the frame is the first thing in its code. */
void kmp_frame_set(void *code, kmp_input_kind kind, const double *values);
const double *kmp_frame_outputs(const void *code, int stage);

#endif
