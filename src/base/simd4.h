/* SPDX-License-Identifier: BSD-3-Clause */
/* Four doubles that are computed together. The compiler makes of them what vectors the machine has, by operations lane
 * by lane whose bits are those of single ones; in functions of clones.h one vector, where there are such. Never passed
 * by value: in which registers differs among machines. */
#ifndef KMP_BASE_SIMD4_H
#define KMP_BASE_SIMD4_H

#include <stddef.h>
#include <stdint.h>

enum { KMP_FOUR = 4 };

typedef double kmp_four __attribute__((vector_size(32), aligned(8), may_alias));
/** What comparing gives: -1 in lanes where it holds, otherwise 0. */
typedef int64_t kmp_four_mask __attribute__((vector_size(32), aligned(8), may_alias));

/** Those from an address on, to be read or written. */
#define KMP_FOUR_AT(p)    (*(kmp_four *)(p))
#define KMP_FOUR_CONST(p) (*(const kmp_four *)(p))
/** The same number in all lanes. */
#define KMP_FOUR_ALL(value) ((value) + (kmp_four){0})
/** yes in the lanes of the mask, no in the others. */
#define KMP_FOUR_SELECT(mask, yes, no) ((kmp_four)(((mask) & (kmp_four_mask)(yes)) | (~(mask) & (kmp_four_mask)(no))))

#endif
