/* SPDX-License-Identifier: BSD-3-Clause */
/* The layout and code of a program, made once for all that run it, as machine code or as a tape: code refers to slots
 * only by their distance from the first, so that each machine has its slots and nothing else. */
#pragma once

#include "backend/encoder/registers.h"
#include "backend/encoders.h"
#include "backend/layout.h"
#include "base/cache/bytes.h"
#include "base/clones.h"
#include "symbolic/program_forms.h"

/** A segment's arithmetic on all slots, of which each has as many doubles as the form. */
typedef void KMP_MACHINE_CODE kmp_routine(double *v);

typedef struct kmp_code {
    kmp_arena list; /* of the next two */
    kmp_straight *operations;
    uint32_t *start; /* first operation of each segment, and the end */
    void *pages;     /* NULL: the system does not let code run */
    size_t size;
    kmp_routine **segment; /* in the frame's arena; NULL: it has no arithmetic */
    uint32_t *offset;      /* of each in the code, there too */
} kmp_code;

/** True if an instruction is straight-line arithmetic of this back end: for kmp_layout_init. */
bool kmp_code_is_straight(const kmp_instruction *in);

/** The operation of such an instruction. */
kmp_operation kmp_code_op(const kmp_instruction *in);

/** Lists the operations, of a layout made with that. false: no memory; kmp_code_free in any case. */
bool kmp_code_list(kmp_code *code, kmp_layout *l);

/** Sets a pointer to a function, at `routine`, to the routine that begins at an offset: C converts the address of an
 * object only by copying. */
void kmp_code_at(const void *pages, uint32_t offset, void *routine);

void kmp_code_free(kmp_code *code);

/** A slot that is not zero at the start. */
typedef struct kmp_slot_start {
    double value;
    uint64_t slot;
} kmp_slot_start;

typedef struct kmp_prepared {
    kmp_program_form form; /* its kind: kmp_prepared_kind; 0: a tape */
    kmp_frame frame;       /* without slots and rooms of blocks */
    kmp_code code;         /* without its operations */
    kmp_slot_start *start; /* in the frame's arena */
    uint32_t start_count;
} kmp_prepared;

/** The kind of a form: the number of lanes, and of threads for which stages are in parts (0: they are in one). */
enum { KMP_PREPARED_THREAD = 256 };
static inline int kmp_prepared_kind(kmp_code_form form, int threads)
{
    return (int)form + KMP_PREPARED_THREAD * threads;
}

/** The code of a form that runs here, for a number of threads, made by the first call. Without code.pages there is no
 * machine code. NULL: no memory. */
const kmp_prepared *kmp_prepared_of(const kmp_program *program, kmp_code_form form, int threads);

/** That which an earlier call has made, or an earlier process has kept; NULL: none. */
const kmp_prepared *kmp_prepared_known(const kmp_program *program, kmp_code_form form, int threads);

/** kmp_prepared_frame: a frame with its own rooms of blocks, for a thread pool of as many threads as it was made for
 * (NULL: none), without slots. kmp_prepared_values: adds these. False: no memory; kmp_frame_free in any case. */
bool kmp_prepared_frame(const kmp_prepared *prepared, kmp_frame *frame, kmp_team *team);
bool kmp_prepared_values(const kmp_prepared *prepared, kmp_frame *frame);

/** Notes the slots that are not zero, and forgets all values of the frame. False: no memory. */
bool kmp_prepared_take_start(kmp_prepared *prepared);

void kmp_prepared_put(kmp_bytes *bytes, kmp_prepared *prepared);
/** Fills an empty one for the program that it was made of. False: no memory, or the bytes are of none. */
bool kmp_prepared_take(kmp_byte_source *source, const kmp_program *program, kmp_prepared *prepared);
