/* SPDX-License-Identifier: BSD-3-Clause */
/* The straight arithmetic of a layout: as a list of operations a segment, and as machine code in one of the forms. */
#pragma once

#include "backend/layout.h"
#include "backend/x86/registers.h"
#include "symbolic/row_code.h"

/** A segment's arithmetic on all slots, of which each has as many doubles as the form. */
typedef void kmp_routine(double *v);

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
kmp_x86_op kmp_code_op(const kmp_instruction *in);

/** Lists the operations, of a layout made with that. false: no memory; kmp_code_free in any case. */
bool kmp_code_list(kmp_code *code, kmp_layout *l);

/** Writes them as machine code; where it cannot run, `pages` stays NULL. false: no memory. */
bool kmp_code_write(kmp_code *code, kmp_layout *l, kmp_x86_form form);

#define KMP_NO_ROUTINE UINT32_MAX

/** Lets machine code run that begins at `offset` for each segment (KMP_NO_ROUTINE: it has no arithmetic), all in
 * `arena`. If it cannot run, `pages` stays NULL. false: no memory. */
bool kmp_code_load(kmp_code *code, kmp_arena *arena, const void *bytes, size_t size, uint32_t segments,
                   const uint32_t *offset);

/** Sets a pointer to a function, at `routine`, to that which begins at an offset: C converts the address of an object
 * only by copying. */
void kmp_code_at(const void *pages, uint32_t offset, void *routine);

void kmp_code_free(kmp_code *code);
