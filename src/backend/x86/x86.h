/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code of x86-64 processors with AVX: arithmetic on doubles in the registers 0 to 15 and in memory. Addresses
 * are relative to rdi, the first argument of a function. Three forms: one double, four (ymm), eight (zmm, AVX-512).
 * Encodings: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, sections 2.3 (VEX) and 2.7 (EVEX).
 */
#ifndef KMP_BACKEND_X86_X86_H
#define KMP_BACKEND_X86_X86_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { KMP_X86_REGISTERS = 16 };

/** A form is its number of doubles. */
typedef enum kmp_x86_form { KMP_X86_ONE = 1, KMP_X86_FOUR = 4, KMP_X86_EIGHT = 8 } kmp_x86_form;

/** An operation is its opcode. */
typedef enum kmp_x86_op {
    KMP_X86_LOAD = 0x10,
    KMP_X86_STORE = 0x11,
    KMP_X86_SQRT = 0x51,
    KMP_X86_ADD = 0x58,
    KMP_X86_MUL = 0x59,
    KMP_X86_SUB = 0x5c,
    KMP_X86_DIV = 0x5e
} kmp_x86_op;

/** Code that is being written; `failed`: out of memory, sticky. */
typedef struct kmp_x86 {
    uint8_t *code;
    size_t size, capacity;
    size_t expected; /* about its size, in bytes; 0: unknown */
    kmp_x86_form form;
    bool failed;
} kmp_x86;

/** d = x op y; SQRT: d = sqrt y, x is the register of d. */
void kmp_x86_registers(kmp_x86 *c, kmp_x86_op op, int d, int x, int y);
/** d = x op y with y in memory, at a distance in bytes from rdi. LOAD: d = y, x is 0; STORE: y = d, x is 0. */
void kmp_x86_memory(kmp_x86 *c, kmp_x86_op op, int d, int x, int32_t y);
/** The end of a function. */
void kmp_x86_return(kmp_x86 *c);

/** True if this machine runs the form. */
bool kmp_x86_runs(kmp_x86_form form);

void kmp_x86_free(kmp_x86 *c);

/* Memory for machine code: written first, executable after, never both. */

/** A copy of the code that can be run; NULL where the system does not allow it. */
void *kmp_pages_new(const void *code, size_t size);
void kmp_pages_free(void *pages, size_t size);

#endif
