/* SPDX-License-Identifier: BSD-3-Clause */
/* Which coordinates could be independent, and the loops as blocks of Jv in order of solution, with their closures. */
#include "base/memory.h"
#include "constraints/doctor.h"
#include "constraints/reduction.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

/* b (r x p) = Bvu, scaled, from the scaled J here; false when singular. */
static bool dependent_rates(const kmp_examination *x, double *jv, int *pivot, double *b)
{
    const kmp_partition *part = x->part;
    const double *jacobian = kmp_doctor_jacobian(x, 0);
    int r = part->r, m = part->m;
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++)
            jv[i + k * r] = jacobian[part->rows[i] + part->v[k] * m];
        for (int k = 0; k < part->p; k++)
            b[i + k * r] = -jacobian[part->rows[i] + part->u[k] * m];
    }
    if (kmp_lu_factor(r, jv, pivot) != 0)
        return false;
    kmp_lu_solve(r, jv, pivot, part->p, b);
    return true;
}

/* max |B| once v_i is independent in place of u_k. */
static double after_exchange(const double *b, int r, int p, int i, int k)
{
    double pivot = b[i + k * r], most = fabs(1 / pivot);
    for (int c = 0; c < p; c++)
        for (int j = 0; j < r; j++) {
            double now = b[j + c * r];
            if (j == i && c == k)
                continue;
            if (j == i || c == k)
                now /= pivot;
            else
                now -= b[j + k * r] * b[i + c * r] / pivot;
            most = fmax(most, fabs(now));
        }
    return most;
}

static kmp_alternative best_exchange(const kmp_partition *part, const double *b, int i)
{
    kmp_alternative best = {part->v[i], -1, INFINITY, false};
    for (int k = 0; k < part->p; k++) {
        if (!(fabs(b[i + k * part->r]) > 1e-12))
            continue;
        double most = after_exchange(b, part->r, part->p, i, k);
        if (most < best.max_b) {
            best.max_b = most;
            best.instead = part->u[k];
        }
    }
    return best;
}

void kmp_doctor_alternatives(kmp_examination *x)
{
    const kmp_partition *part = x->part;
    int r = part->r, p = part->p;
    double *jv = KMP_ARENA_NEW(x->arena, double, r *r), *b = KMP_ARENA_NEW(x->arena, double, r *p);
    int *pivot = KMP_ARENA_NEW(x->arena, int, r);
    x->doctor->alternatives = KMP_ARENA_NEW(x->arena, kmp_alternative, part->n);
    if (r == 0 || p == 0 || !jv || !b || !pivot || !x->doctor->alternatives || !dependent_rates(x, jv, pivot, b))
        return;
    for (int k = 0, i = 0, c = 0; c < part->n; c++) {
        if (k < p && part->u[k] == c) {
            x->doctor->alternatives[c] = (kmp_alternative){c, -1, part->max_b, true};
            k++;
        } else
            x->doctor->alternatives[c] = best_exchange(part, b, i++);
    }
    x->doctor->alternative_count = part->n;
}

/* -- blocks ------------------------------------------------------------------------------------------ */

/* The block that each row of h belongs to: the last one, in order of solution, with an entry in it; -1: none. */
static void find_blocks_of_rows(const kempe_system *s, const int *block_of, int *last)
{
    for (int r = 0; r < s->m; r++)
        last[r] = -1;
    for (int e = 0; e < s->jacobian.count; e++)
        if (block_of[s->jacobian.col[e]] > last[s->jacobian.row[e]])
            last[s->jacobian.row[e]] = block_of[s->jacobian.col[e]];
}

static void add_row(const kempe_system *s, kmp_loop_block *block, int r)
{
    int c = s->rows[r].closure;
    block->rows[block->row_count++] = r;
    for (int k = 0; k < block->closure_count; k++)
        if (block->closures[k] == c)
            return;
    block->closures[block->closure_count++] = c;
}

/* Room for the rows of each block and their closures. */
static void count_rows(const kmp_partition *part, const int *last, int count, kmp_arena *arena, kmp_loop_block *blocks)
{
    for (int i = 0; i < part->r; i++)
        blocks[last[part->rows[i]]].row_count++;
    for (int b = 0; b < count; b++) {
        blocks[b].rows = KMP_ARENA_NEW(arena, int, blocks[b].row_count);
        blocks[b].closures = KMP_ARENA_NEW(arena, int, blocks[b].row_count);
        blocks[b].row_count = 0;
    }
}

static bool fill_blocks(const kempe_system *s, const kmp_partition *part, const kmp_block *matrix, kmp_arena *arena,
                        kmp_loop_block *blocks)
{
    int *block_of = KMP_ARENA_NEW(arena, int, s->n), *last = KMP_ARENA_NEW(arena, int, s->m);
    int count = kmp_block_count(matrix);
    if (!block_of || !last)
        return false;
    for (int c = 0; c < s->n; c++)
        block_of[c] = -1;
    for (int b = 0; b < count; b++) {
        const int *column = kmp_block_columns(matrix, count - 1 - b, &blocks[b].column_count); /* solved from below */
        blocks[b].columns = KMP_ARENA_NEW(arena, int, blocks[b].column_count);
        if (arena->failed)
            return false;
        for (int i = 0; i < blocks[b].column_count; i++)
            block_of[blocks[b].columns[i] = part->v[column[i]]] = b;
    }
    find_blocks_of_rows(s, block_of, last);
    count_rows(part, last, count, arena, blocks);
    for (int i = 0; !arena->failed && i < part->r; i++)
        add_row(s, &blocks[last[part->rows[i]]], part->rows[i]);
    return !arena->failed;
}

int kmp_loop_blocks(kmp_plant *plant, const kmp_partition *part, kmp_arena *arena, kmp_loop_block **blocks)
{
    kmp_reduction red;
    int count = -1;
    if (kmp_reduction_init(&red, plant, part) != KEMPE_OK)
        return -1;
    int found = kmp_block_count(red.block);
    *blocks = KMP_ARENA_NEW(arena, kmp_loop_block, found);
    if (*blocks && (found == 0 || fill_blocks(plant->system, part, red.block, arena, *blocks)))
        count = found;
    kmp_reduction_free(&red);
    return count;
}
