/* SPDX-License-Identifier: BSD-3-Clause */
/* Diagonal blocks of Jv as loops for reports: the permutation to block triangular form is that of the reduction. */
#include "constraints/partition/loop_blocks.h"
#include "constraints/partition/reduction.h"

/* -- blocks ------------------------------------------------------------------------------------------ */

/* Block b of Jv, its rows ascending, so that rows of one closure are contiguous. */
static void fill_block(const kmp_reduction *red, int b, kmp_arena *arena, kmp_loop_block *block)
{
    const int *column = kmp_block_columns(red->block, b, &block->size), *row = kmp_block_rows(red->block, b);
    KMP_ARENA_EACH(arena, int, block->size, &block->columns, &block->rows, &block->closures);
    for (int i = 0; !arena->failed && i < block->size; i++) {
        int k = i, r = red->part->rows[row[i]];
        for (; k > 0 && block->rows[k - 1] > r; k--)
            block->rows[k] = block->rows[k - 1];
        block->rows[k] = r;
        block->columns[i] = red->part->v[column[i]];
    }
    for (int i = 0; !arena->failed && i < block->size; i++) {
        int c = red->eval->system->rows[block->rows[i]].closure;
        if (block->closure_count == 0 || block->closures[block->closure_count - 1] != c)
            block->closures[block->closure_count++] = c;
    }
}

int kmp_loop_blocks(kmp_evaluator *eval, const kmp_partition *part, kmp_arena *arena, kmp_loop_block **blocks)
{
    kmp_reduction red;
    if (kmp_reduction_init(&red, eval, part) != KEMPE_OK)
        return -1;
    int count = kmp_block_count(red.block);
    *blocks = KMP_ARENA_NEW(arena, kmp_loop_block, count);
    for (int b = 0; !arena->failed && b < count; b++)
        fill_block(&red, count - 1 - b, arena, &(*blocks)[b]); /* blocks are solved from the last one to the first */
    kmp_reduction_free(&red);
    return arena->failed ? -1 : count;
}
