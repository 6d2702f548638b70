/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of 4, 8 or 16 numbers, one of each right-hand side, as sums of one to four fours; in line, for functions of
 * clones.h. */
#pragma once

#include "base/clones.h"
#include "base/simd4.h"
#include <stddef.h>

enum { KMP_WIDEST = 16, KMP_WIDE_FOURS = KMP_WIDEST / KMP_FOUR };

/** The width for `count` right-hand sides, or for the first ones of more. */
static inline int kmp_wide(int count)
{
    return count <= KMP_FOUR ? KMP_FOUR : count <= 2 * KMP_FOUR ? 2 * KMP_FOUR : KMP_WIDEST;
}

/** Row k of rows of `fours` fours. */
#define KMP_WIDE_ROW(fours, rows, k) ((rows) + (ptrdiff_t)(k)*KMP_FOUR * (fours))

/** The call of a kernel f(int fours, ...) with the number of fours as a constant. */
#define KMP_OF_WIDE(kernel, width, ...)                                                                                \
    do {                                                                                                               \
        if ((width) == 4 * KMP_FOUR)                                                                                   \
            kernel(4, __VA_ARGS__);                                                                                    \
        else if ((width) == 2 * KMP_FOUR)                                                                              \
            kernel(2, __VA_ARGS__);                                                                                    \
        else                                                                                                           \
            kernel(1, __VA_ARGS__);                                                                                    \
    } while (0)

/** sum = row. */
static KMP_INTO_CLONES void kmp_wide_load(int fours, const double *row, kmp_four *sum)
{
    for (int f = 0; f < fours; f++)
        sum[f] = KMP_FOUR_CONST(row + KMP_FOUR * f);
}

static KMP_INTO_CLONES void kmp_wide_clear(int fours, kmp_four *sum)
{
    for (int f = 0; f < fours; f++)
        sum[f] = (kmp_four){0};
}

/** sum += by * row. */
static KMP_INTO_CLONES void kmp_wide_add(int fours, double by, const double *row, kmp_four *sum)
{
    for (int f = 0; f < fours; f++)
        sum[f] += KMP_FOUR_CONST(row + KMP_FOUR * f) * by;
}

/** sum -= by * row. */
static KMP_INTO_CLONES void kmp_wide_subtract(int fours, double by, const double *row, kmp_four *sum)
{
    for (int f = 0; f < fours; f++)
        sum[f] -= KMP_FOUR_CONST(row + KMP_FOUR * f) * by;
}

/** row = sum. */
static KMP_INTO_CLONES void kmp_wide_store(int fours, const kmp_four *sum, double *row)
{
    for (int f = 0; f < fours; f++)
        KMP_FOUR_AT(row + KMP_FOUR * f) = sum[f];
}

/** row = factor * sum. */
static KMP_INTO_CLONES void kmp_wide_store_times(int fours, double factor, const kmp_four *sum, double *row)
{
    for (int f = 0; f < fours; f++)
        KMP_FOUR_AT(row + KMP_FOUR * f) = sum[f] * factor;
}

/** Column k of `to`, of leading dimension ld, = number k of the rows: a tile of four rows and columns, transposed. */
static KMP_INTO_CLONES void kmp_wide_transpose(const double *const row[KMP_FOUR], ptrdiff_t ld, double *to)
{
    const kmp_four a = KMP_FOUR_CONST(row[0]), b = KMP_FOUR_CONST(row[1]), c = KMP_FOUR_CONST(row[2]),
                   d = KMP_FOUR_CONST(row[3]);
    const kmp_four e = KMP_FOUR_OF(a, b, 0, 4, 2, 6), f = KMP_FOUR_OF(a, b, 1, 5, 3, 7),
                   g = KMP_FOUR_OF(c, d, 0, 4, 2, 6), h = KMP_FOUR_OF(c, d, 1, 5, 3, 7);
    KMP_FOUR_AT(to) = KMP_FOUR_OF(e, g, 0, 1, 4, 5);
    KMP_FOUR_AT(to + ld) = KMP_FOUR_OF(f, h, 0, 1, 4, 5);
    KMP_FOUR_AT(to + 2 * ld) = KMP_FOUR_OF(e, g, 2, 3, 6, 7);
    KMP_FOUR_AT(to + 3 * ld) = KMP_FOUR_OF(f, h, 2, 3, 6, 7);
}
