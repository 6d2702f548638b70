/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the permutation C = A(P, Q) to upper block-triangular form (Pothen, Fan, ACM TOMS 16 (1990) 303, by
 * SuiteSparse BTF) and the storage of its blocks. */
#include "linalg/block_inside.h"

#include "base/memory.h"

#include <btf.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

static bool allocate(kmp_block *b, int n, int nz)
{
    b->n = n;
    b->nz = nz;
    b->p = KMP_NEW(int, n);
    b->q = KMP_NEW(int, n);
    b->start = KMP_NEW(int, n + 1);
    b->lu_start = KMP_NEW(int, n + 1);
    b->order = KMP_NEW(int, n);
    b->inverse = KMP_NEW(double, n);
    b->pivot = KMP_NEW(int, n);
    b->off_start = KMP_NEW(int, n + 1);
    b->off_column = KMP_NEW(int, nz);
    b->off = KMP_NEW(double, nz);
    b->target = KMP_NEW(int, nz);
    b->scratch = KMP_NEW(double, 2 * n);
    b->signs = KMP_NEW(int, n);
    b->place = KMP_NEW(int, n);
    b->block_of = KMP_NEW(int, n);
    b->due = KMP_NEW(char, n);
    return b->p && b->q && b->start && b->lu_start && b->order && b->inverse && b->pivot && b->off_start &&
           b->off_column && b->off && b->target && b->scratch && b->signs && b->place && b->block_of && b->due;
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
    int *ap = KMP_NEW(int, n + 1), *ai = KMP_NEW(int, b->nz), *scratch = KMP_NEW(int, 5 * n);
    if (ap && ai && scratch && n > 0) {
        compress(n, b->nz, row, col, ap, ai);
        b->count = btf_order(n, ap, ai, 0.0, &work, b->p, b->q, b->start, &matched, scratch);
    }
    bool ok = ap && ai && scratch && matched == n;
    kmp_free(ap);
    kmp_free(ai);
    kmp_free(scratch);
    return ok;
}

/* +1 or -1; `visited` has n zeroed places. */
static int permutation_sign(int n, const int *p, int *visited)
{
    int sign = 1;
    for (int i = 0; i < n; i++)
        for (int j = i, length = 0; !visited[j]; j = p[j]) {
            visited[j] = 1;
            if (length++)
                sign = -sign;
        }
    return sign;
}

/* The position of each block, row and column of A in C. */
static void place_blocks(kmp_block *b, int *row_at)
{
    for (int k = 0; k < b->count; k++) {
        int size = b->start[k + 1] - b->start[k];
        b->lu_start[k + 1] = b->lu_start[k] + size * size;
        for (int i = b->start[k]; i < b->start[k + 1]; i++) {
            row_at[b->p[i]] = i;
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
static void place_inside(kmp_block *b, const int *row, const int *col, const int *row_at)
{
    for (int e = 0; e < b->nz; e++) {
        int i = row_at[row[e]], j = b->place[col[e]], k = b->block_of[i], first = b->start[k];
        if (k == b->block_of[j]) {
            b->target[e] = b->lu_start[k] + (i - first) + (j - first) * (b->start[k + 1] - first);
        } else {
            b->target[e] = -1;
            b->off_start[i + 1]++;
        }
    }
}

/* The positions of entries outside the blocks, by rows. */
static void place_outside(kmp_block *b, const int *row, const int *col, const int *row_at)
{
    for (int i = 0; i < b->n; i++)
        b->off_start[i + 1] += b->off_start[i];
    for (int e = 0; e < b->nz; e++)
        if (b->target[e] == -1) {
            int place = b->off_start[row_at[row[e]]]++;
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
    int n = b->n, *zeroed = KMP_NEW(int, 3 * n);
    if (!zeroed)
        return false;
    int *row_at = zeroed + 2 * n;
    b->permutation_sign = permutation_sign(n, b->p, zeroed) * permutation_sign(n, b->q, zeroed + n);
    place_blocks(b, row_at);
    place_inside(b, row, col, row_at);
    place_outside(b, row, col, row_at);
    kmp_free(zeroed);
    b->lu = KMP_NEW(double, b->lu_size);
    return b->lu != NULL;
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
    if (!b)
        return;
    void *parts[] = {b->p,     b->q,         b->start,      b->lu_start, b->order,  b->inverse,
                     b->pivot, b->off_start, b->off_column, b->off,      b->target, b->scratch,
                     b->lu,    b->signs,     b->place,      b->block_of, b->due,    b};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        kmp_free(parts[i]);
}
