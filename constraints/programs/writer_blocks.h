/* SPDX-License-Identifier: BSD-3-Clause */
/* Jv of a reduction factored block by block, written out as expressions. Blocks of one and two rows are solved by their
 * determinant, larger ones by elimination in a given order. */
#pragma once

#include "constraints/partition/reduction.h"
#include "constraints/programs/program_writer.h"

enum { KMP_WRITER_BLOCK = 32 }; /* bound: rows of a block */

/** Rows of h that a multiplier of the elimination belongs to: the one that it changes, and the one that it takes. */
typedef struct kmp_eliminated {
    int row, by;
} kmp_eliminated;

/** True if the order of the elimination is good: no multiplier is large when rows are scaled. Multiplier k is at k
 * stride, the scale of row r (m of them) at r stride. */
bool kmp_writer_order_is_good(int count, const kmp_eliminated *rows, const double *multiplier, const double *row_scale,
                              size_t stride);

typedef struct kmp_writer_blocks {
    const kmp_reduction *red; /* the first two are set by the caller */
    const int *order;         /* of rows in the elimination: r positions among the independent rows, block by block */
    kmp_graph *g;
    struct kmp_writer_block *block;
    kmp_ref *jv, *ju;    /* r x r and r x p, row by row */
    int *block_of;       /* by column */
    kmp_ref *multiplier; /* of all blocks */
    kmp_eliminated *row; /* of each multiplier */
    int multipliers;
    kmp_ref *pivot; /* factors of det Jv, but for the sign of a permutation */
    int pivots;
} kmp_writer_blocks;

/** True if no block is too large. */
bool kmp_writer_blocks_fit(const kmp_reduction *red);

/** The order in which partial pivoting takes the rows at the evaluator's last closure. */
void kmp_writer_order(const kmp_reduction *red, int *order);

/** Takes the entries of J, in an arena. False: no memory. */
bool kmp_writer_blocks_init(kmp_writer_blocks *k, kmp_arena *arena, kmp_graph *g, const kmp_ref *jacobian);

/** Factors a block; solves its part of x = Jv^-1 rhs for every column (r x columns, row by row) after later blocks. The
 * last block comes first. */
void kmp_writer_blocks_factor(kmp_writer_blocks *k, int number);
void kmp_writer_blocks_solve(const kmp_writer_blocks *k, int number, int columns, const kmp_ref *rhs, kmp_ref *x);

/** x = -Jv^-1 of all rows (m) of h, in the order of the partition; `room`: r. */
void kmp_writer_blocks_correct(const kmp_writer_blocks *k, const kmp_ref *h, kmp_ref *room, kmp_ref *x);

/** The largest multiplier over its bound: the order of the elimination is good where it is at most 1. */
kmp_ref kmp_writer_blocks_excess(const kmp_writer_blocks *k);

/** A copy of `row`, which the caller frees; NULL: no memory. */
kmp_eliminated *kmp_writer_rows(const kmp_writer_blocks *k);

/** Writes the correction dv (r) of v of a state (kmp_writer_take_state), and adds it: later imports are those of the
 * corrected state. `k` has what the caller sets. False: no memory. */
bool kmp_writer_close(kmp_program_writer *w, kmp_writer_blocks k, kmp_ref *dv);
