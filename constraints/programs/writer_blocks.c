/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions for Jv^-1, block by block from the last to the first. The order of elimination in a block is that of
 * complete pivoting at the state where the program is written; bounds of the multipliers tell at other states that it
 * is no longer good. */
#include "constraints/programs/writer_blocks.h"
#include "base/memory.h"
#include "linalg/dense/dense.h"
#include "symbolic/function_table.h"
#include <math.h>
#include <string.h>

/* A diagonal block: its matrix, then its factors; rows in the order of elimination. */
struct kmp_writer_block {
    int size, row[KMP_WRITER_BLOCK], col[KMP_WRITER_BLOCK];
    kmp_ref a[KMP_WRITER_BLOCK][KMP_WRITER_BLOCK];
    kmp_ref inverse[KMP_WRITER_BLOCK]; /* of the pivots; for two rows: of the determinant */
};

/* Largest multiplier of the elimination, rows scaled, for which its order is good. */
#define MULTIPLIER 10.0

bool kmp_writer_order_is_good(int count, const kmp_eliminated *rows, const double *multiplier, const double *row_scale,
                              size_t stride)
{
    for (int k = 0; k < count; k++) {
        double by = row_scale[(size_t)rows[k].by * stride], row = row_scale[(size_t)rows[k].row * stride];
        if (!(fabs(multiplier[(size_t)k * stride]) * by <= MULTIPLIER * row))
            return false;
    }
    return true;
}

void kmp_writer_order(const kmp_reduction *red, int *order)
{
    const double *scale = red->eval->system->row_scale;
    double value[KMP_WRITER_BLOCK * KMP_WRITER_BLOCK];
    int size, pivot[KMP_WRITER_BLOCK];
    for (int number = 0, count = kmp_block_count(red->block); number < count; number++, order += size) {
        const int *col = kmp_block_columns(red->block, number, &size), *row = kmp_block_rows(red->block, number);
        memcpy(order, row, (size_t)size * sizeof *order);
        if (size <= 2) /* by the determinant */
            continue;
        for (int i = 0; i < size; i++)
            for (int j = 0; j < size; j++) {
                int e = 0;
                while (e < red->jv_count && (red->jv_row[e] != row[i] || red->jv_col[e] != col[j]))
                    e++;
                double entry = e < red->jv_count ? red->eval->jacobian[red->jv_entry[e]] : 0;
                value[i + j * size] = entry / scale[red->part->rows[row[i]]];
            }
        int fault = kmp_lu_factor(size, value, pivot);
        for (int i = 0; i < (fault ? fault - 1 : size); i++)
            kmp_swap_int(&order[i], &order[pivot[i]]);
    }
}

static void solve_block(kmp_graph *g, const struct kmp_writer_block *b, kmp_ref *x)
{
    if (b->size == 2) {
        kmp_ref y = x[0], z = x[1], w = b->inverse[0];
        x[0] = kmp_sub(g, kmp_mul(g, kmp_mul(g, b->a[1][1], w), y), kmp_mul(g, kmp_mul(g, b->a[0][1], w), z));
        x[1] = kmp_sub(g, kmp_mul(g, kmp_mul(g, b->a[0][0], w), z), kmp_mul(g, kmp_mul(g, b->a[1][0], w), y));
        return;
    }
    for (int i = 1; i < b->size; i++)
        for (int j = 0; j < i; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, b->a[i][j], x[j]));
    for (int i = b->size - 1; i >= 0; i--) {
        for (int j = i + 1; j < b->size; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, b->a[i][j], x[j]));
        x[i] = kmp_mul(g, x[i], b->inverse[i]);
    }
}

/* The right-hand side of a row minus the known part of the solution: columns of later blocks. */
static kmp_ref left_over(const kmp_writer_blocks *k, int row, kmp_ref rhs, const kmp_ref *x, int stride, int number)
{
    for (int col = 0; col < k->red->r; col++)
        if (k->block_of[col] > number && k->jv[row * k->red->r + col] != KMP_ZERO)
            rhs = kmp_sub(k->g, rhs, kmp_mul(k->g, k->jv[row * k->red->r + col], x[col * stride]));
    return rhs;
}

void kmp_writer_blocks_solve(const kmp_writer_blocks *k, int number, int columns, const kmp_ref *rhs, kmp_ref *x)
{
    const struct kmp_writer_block *b = &k->block[number];
    for (int c = 0; c < columns; c++) {
        kmp_ref y[KMP_WRITER_BLOCK] = {0};
        for (int i = 0; i < b->size; i++)
            y[i] = left_over(k, b->row[i], rhs[b->row[i] * columns + c], x + c, columns, number);
        solve_block(k->g, b, y);
        for (int i = 0; i < b->size; i++)
            x[b->col[i] * columns + c] = y[i];
    }
}

bool kmp_writer_blocks_init(kmp_writer_blocks *k, kmp_arena *arena, kmp_graph *g, const kmp_ref *jacobian)
{
    int r = k->red->r;
    k->g = g;
    KMP_ARENA_MAKE(arena, KMP_ROOM(struct kmp_writer_block, kmp_block_count(k->red->block), &k->block),
                   KMP_ROOM(int, r, &k->block_of), KMP_ROOM(kmp_eliminated, r * KMP_WRITER_BLOCK, &k->row),
                   KMP_ROOM(kmp_ref, r * k->red->p, &k->ju), KMP_ROOM(kmp_ref, r * KMP_WRITER_BLOCK, &k->multiplier),
                   KMP_ROOM(kmp_ref, r, &k->pivot));
    if (!KMP_ARENA_EACH(arena, kmp_ref, r * r, &k->jv))
        return false;
    /* Sorts the entries of J into Jv and Ju. */
    const kmp_reduction *red = k->red;
    for (int e = 0; e < red->jv_count; e++)
        k->jv[red->jv_row[e] * red->r + red->jv_col[e]] = jacobian[red->jv_entry[e]];
    for (int e = 0; e < red->ju_count; e++)
        k->ju[red->ju_row[e] * red->p + red->ju_col[e]] = jacobian[red->ju_entry[e]];
    for (int number = kmp_block_count(red->block); number-- > 0;) {
        int size;
        const int *col = kmp_block_columns(red->block, number, &size);
        for (int i = 0; i < size; i++)
            k->block_of[col[i]] = number;
    }
    return true;
}

void kmp_writer_blocks_factor(kmp_writer_blocks *k, int number)
{
    /* Rows of a block in the order of elimination. */
    struct kmp_writer_block *b = &k->block[number];
    const int *col = kmp_block_columns(k->red->block, number, &b->size), *order = k->order;
    for (int before = 0, size; before < number; before++, order += size)
        (void)kmp_block_columns(k->red->block, before, &size);
    for (int i = 0; i < b->size; i++) {
        b->col[i] = col[i];
        b->row[i] = order[i];
    }
    for (int i = 0; i < b->size; i++)
        for (int j = 0; j < b->size; j++)
            b->a[i][j] = k->jv[b->row[i] * k->red->r + b->col[j]];
    /* Factors a block. One row: its inverse. Two rows: the inverse of the determinant. More: L below the diagonal, U on
     * and above it. */
    kmp_graph *g = k->g;
    if (b->size == 2) {
        kmp_ref det = kmp_sub(g, kmp_mul(g, b->a[0][0], b->a[1][1]), kmp_mul(g, b->a[0][1], b->a[1][0]));
        b->inverse[0] = kmp_div(g, KMP_ONE, det);
        k->pivot[k->pivots++] = det;
        return;
    }
    for (int c = 0; c < b->size; c++) {
        k->pivot[k->pivots++] = b->a[c][c];
        b->inverse[c] = kmp_div(g, KMP_ONE, b->a[c][c]);
        for (int i = c + 1; i < b->size; i++) {
            if (b->a[i][c] == KMP_ZERO)
                continue;
            b->a[i][c] = kmp_mul(g, b->a[i][c], b->inverse[c]);
            k->multiplier[k->multipliers] = b->a[i][c];
            k->row[k->multipliers++] =
                (kmp_eliminated){.row = k->red->part->rows[b->row[i]], .by = k->red->part->rows[b->row[c]]};
            for (int j = c + 1; j < b->size; j++)
                b->a[i][j] = kmp_sub(g, b->a[i][j], kmp_mul(g, b->a[i][c], b->a[c][j]));
        }
    }
}

void kmp_writer_blocks_correct(const kmp_writer_blocks *k, const kmp_ref *h, kmp_ref *room, kmp_ref *x)
{
    for (int i = 0; i < k->red->r; i++)
        room[i] = h[k->red->part->rows[i]];
    for (int number = kmp_block_count(k->red->block); number-- > 0;)
        kmp_writer_blocks_solve(k, number, 1, room, x);
    for (int i = 0; i < k->red->r; i++)
        x[i] = kmp_neg(x[i]);
}

bool kmp_writer_close(kmp_program_writer *w, kmp_writer_blocks k, kmp_ref *dv)
{
    kmp_ref *room = KMP_ARENA_NEW(&w->arena, kmp_ref, k.red->r);
    if (!room || !kmp_writer_import_closure(w) || !kmp_writer_blocks_init(&k, &w->arena, w->g, w->jacobian))
        return false;
    for (int number = kmp_block_count(k.red->block); number-- > 0;)
        kmp_writer_blocks_factor(&k, number);
    kmp_writer_blocks_correct(&k, w->h, room, dv);
    return kmp_writer_correct(w, k.red->part, dv);
}

kmp_ref kmp_writer_blocks_excess(const kmp_writer_blocks *k)
{
    const double *row_scale = k->red->eval->system->row_scale;
    kmp_ref most = KMP_ZERO;
    for (int i = 0; i < k->multipliers; i++) {
        double bound = MULTIPLIER * row_scale[k->row[i].row] / row_scale[k->row[i].by];
        kmp_ref part = kmp_mul(k->g, kmp_unary(k->g, KMP_OP_ABS, k->multiplier[i]), kmp_const(k->g, 1 / bound));
        most = i > 0 ? kmp_binary(k->g, KMP_OP_MAX, most, part) : part;
    }
    return most;
}

kmp_eliminated *kmp_writer_rows(const kmp_writer_blocks *k)
{
    kmp_eliminated *row = KMP_NEW(kmp_eliminated, 1 + k->multipliers);
    if (row && k->multipliers > 0)
        memcpy(row, k->row, (size_t)k->multipliers * sizeof *row);
    return row;
}

bool kmp_writer_blocks_fit(const kmp_reduction *red)
{
    return kmp_block_largest(red->block) <= KMP_WRITER_BLOCK;
}
