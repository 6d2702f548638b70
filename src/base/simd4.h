/* SPDX-License-Identifier: BSD-3-Clause */
/* Four doubles computed together, by operations lane by lane whose bits equal single operations. The compiler
 * maps them to the vectors of the machine; in functions of clones.h to one vector, where it is that wide. Never passed
 * by value: the registers differ among machines. */
#pragma once

#include <stddef.h>
#include <stdint.h>

enum { KMP_FOUR = 4 };

typedef double kmp_four __attribute__((vector_size(32), aligned(8), may_alias));
/** The result of a comparison: -1 in lanes where it is true, otherwise 0. */
typedef int64_t kmp_four_mask __attribute__((vector_size(32), aligned(8), may_alias));

/** Eight doubles, of which AVX-512 has registers. */
typedef double kmp_eight __attribute__((vector_size(64), aligned(8), may_alias));
typedef int64_t kmp_eight_mask __attribute__((vector_size(64), aligned(8), may_alias));
#define KMP_EIGHT_AT(p)    (*(kmp_eight *)(p))
#define KMP_EIGHT_CONST(p) (*(const kmp_eight *)(p))

/** Four doubles from an address on, to be read or written. */
#define KMP_FOUR_AT(p)    (*(kmp_four *)(p))
#define KMP_FOUR_CONST(p) (*(const kmp_four *)(p))
/** One number in all lanes. */
#define KMP_FOUR_ALL(value) ((value) + (kmp_four){0})
/** `yes` in the lanes of the mask, `no` in the others. */
#define KMP_FOUR_SELECT(mask, yes, no) ((kmp_four)(((mask) & (kmp_four_mask)(yes)) | (~(mask) & (kmp_four_mask)(no))))
/** Four of the eight lanes of x and y, by their numbers. */
#ifdef __clang__
#define KMP_FOUR_OF(x, y, a, b, c, d) __builtin_shufflevector(x, y, a, b, c, d)
#else
#define KMP_FOUR_OF(x, y, a, b, c, d) __builtin_shuffle(x, y, (kmp_four_mask){a, b, c, d})
#endif
