/* SPDX-License-Identifier: BSD-3-Clause */
/* The layout and code of a program, made once for all that run it, as machine code or as a tape: code refers to slots
 * only by their distance from the first, so that each machine has slots of its own and nothing else. */
#pragma once

#include "backend/compiled.h"
#include "base/cache/bytes.h"
#include "symbolic/program/program_forms.h"

/** A slot that is not zero at the start. */
typedef struct kmp_slot_start {
    double value;
    uint64_t slot;
} kmp_slot_start;

typedef struct kmp_prepared {
    kmp_program_form form; /* its kind is the number of lanes; 0: a tape */
    kmp_frame frame;       /* without slots and rooms of blocks */
    kmp_code code;         /* without its operations */
    kmp_slot_start *start; /* in the frame's arena */
    uint32_t start_count;
} kmp_prepared;

/** That of a form that runs here, made by the first call. Without code.pages there is no machine code. NULL: no memory.
 */
const kmp_prepared *kmp_prepared_of(const kmp_program *program, kmp_x86_form form);

/** That which an earlier call has made, or an earlier process has kept; NULL: none. */
const kmp_prepared *kmp_prepared_known(const kmp_program *program, kmp_x86_form form);

/** kmp_prepared_frame: a frame with its own rooms of blocks, without slots. kmp_prepared_values: adds these. False: no
 * memory; kmp_frame_free in any case. */
bool kmp_prepared_frame(const kmp_prepared *prepared, kmp_frame *frame);
bool kmp_prepared_values(const kmp_prepared *prepared, kmp_frame *frame);

/** Notes the slots that are not zero, and forgets all values of the frame. False: no memory. */
bool kmp_prepared_take_start(kmp_prepared *prepared);

/** Layout and machine code without a form that others use, in parts for a thread pool (NULL: in one). False: no memory.
 */
bool kmp_prepared_write(kmp_frame *frame, kmp_code *code, const kmp_program *program, kmp_x86_form form,
                        kmp_team *team);

/* prepared_bytes.c */

void kmp_prepared_put(kmp_bytes *bytes, kmp_prepared *prepared);
/** Fills an empty one for the program that it was made of. False: no memory, or the bytes are of none. */
bool kmp_prepared_take(kmp_byte_source *source, const kmp_program *program, kmp_prepared *prepared);
