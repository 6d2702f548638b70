/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the permutation C = A(P, Q) to upper block-triangular form (Pothen, Fan, ACM TOMS 16 (1990) 303, by
 * SuiteSparse BTF) and the storage of its blocks. */
#include "linalg/block_inside.h"

#include "base/memory.h"

#include <btf.h>

static bool allocate(kmp_block *b, int n, int nz)
{
    b->n = n;
    b->nz = nz;
    b->inverse = KMP_ARENA_NEW(&b->arena, double, n);
    b->off = KMP_ARENA_NEW(&b->arena, double, nz);
    b->scratch = KMP_ARENA_NEW(&b->arena, double, 2 * n);
    b->due = KMP_ARENA_NEW(&b->arena, char, n);
    KMP_ARENA_EACH(&b->arena, int, n + 1, &b->start, &b->lu_start, &b->off_start);
    KMP_ARENA_EACH(&b->arena, int, nz, &b->off_column, &b->target);
    return KMP_ARENA_EACH(&b->arena, int, n, &b->p, &b->q, &b->order, &b->pivot, &b->signs, &b->place, &b->row_place,
                          &b->block_of);
}

/* Compressed columns of the pattern; `ap` has n + 1 places, `ai` nz. */
static void compress(int n, int nz, const int *row, const int *col, int *ap, int *ai)
{
    for (int k = 0; k < nz; k++)
        ap[col[k] + 1]++;
    for (int j = 0; j < n; j++)
        ap[j + 1] += ap[j];
    for (int k = 0; k < nz; k++)
        ai[ap[col[k]]++] = row[k];
    for (int j = n; j > 0; j--)
        ap[j] = ap[j - 1];
    ap[0] = 0;
}

static bool permute(kmp_block *b, const int *row, const int *col)
{
    int n = b->n, matched = 0;
    double work;
    kmp_arena room = {0};
    int *ap = KMP_ARENA_NEW(&room, int, n + 1), *ai = KMP_ARENA_NEW(&room, int, b->nz),
        *scratch = KMP_ARENA_NEW(&room, int, 5 * n);
    bool ok = !room.failed;
    if (ok && n > 0) {
        compress(n, b->nz, row, col, ap, ai);
        b->count = btf_order(n, ap, ai, 0.0, &work, b->p, b->q, b->start, &matched, scratch);
    }
    kmp_arena_free(&room);
    return ok && matched == n;
}

/* The position of each block, row and column of A in C. */
static void place_blocks(kmp_block *b)
{
    for (int k = 0; k < b->count; k++) {
        int size = b->start[k + 1] - b->start[k];
        b->lu_start[k + 1] = b->lu_start[k] + size * size;
        for (int i = b->start[k]; i < b->start[k + 1]; i++) {
            b->row_place[b->p[i]] = i;
            b->place[b->q[i]] = i;
            b->block_of[i] = k;
        }
    }
    b->lu_size = b->lu_start[b->count];
    b->pairs = b->n == 2 * b->count;
    for (int k = 0; k < b->count; k++)
        b->pairs = b->pairs && b->start[k] == 2 * k;
}

/* Each entry's position in its diagonal block; -1 for an entry outside the blocks, counted in off_start[row + 1]. */
static void place_inside(kmp_block *b, const int *row, const int *col)
{
    for (int e = 0; e < b->nz; e++) {
        int i = b->row_place[row[e]], j = b->place[col[e]], k = b->block_of[i], first = b->start[k];
        if (k == b->block_of[j]) {
            b->target[e] = b->lu_start[k] + (i - first) + (j - first) * (b->start[k + 1] - first);
        } else {
            b->target[e] = -1;
            b->off_start[i + 1]++;
        }
    }
}

/* The positions of entries outside the blocks, by rows. */
static void place_outside(kmp_block *b, const int *row, const int *col)
{
    for (int i = 0; i < b->n; i++)
        b->off_start[i + 1] += b->off_start[i];
    for (int e = 0; e < b->nz; e++)
        if (b->target[e] == -1) {
            int place = b->off_start[b->row_place[row[e]]]++;
            b->off_column[place] = b->place[col[e]];
            b->target[e] = -1 - place;
        }
    for (int i = b->n; i > 0; i--)
        b->off_start[i] = b->off_start[i - 1];
    b->off_start[0] = 0;
}

static bool analyse(kmp_block *b, const int *row, const int *col)
{
    if (!permute(b, row, col))
        return false;
    place_blocks(b);
    place_inside(b, row, col);
    place_outside(b, row, col);
    b->lu = KMP_ARENA_NEW(&b->arena, double, b->lu_size);
    return b->lu;
}

kmp_block *kmp_block_new(int n, int nz, const int *row, const int *col)
{
    kmp_block *b = KMP_NEW(kmp_block, 1);
    if (b && allocate(b, n, nz) && analyse(b, row, col))
        return b;
    kmp_block_free(b);
    return NULL;
}

void kmp_block_free(kmp_block *b)
{
    if (b)
        kmp_arena_free(&b->arena);
    kmp_free(b);
}
