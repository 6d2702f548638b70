/* SPDX-License-Identifier: BSD-3-Clause */
/* Every element of a result is computed by the operations of a plain loop over its nonzeros, in the order of that loop;
 * zeros that pad a four change no bit. */
#include "constraints/partition/sparse_tangent_numbers.h"
#include "base/clones.h"
#include "constraints/partition/reduction.h"
#include "constraints/partition/sparse_tangent.h"
#include <float.h>
#include <math.h>

/* -- X ------------------------------------------------------------------------------------------------- */

void kmp_sparse_tangent_spread(const kmp_sparse_tangent *z, const double *bvu, const double *s, double *out)
{
    const int *row = z->b_row;
    for (int k = 0; k < z->p; k++, bvu += z->n - z->p)
        for (int e = z->x_start[k] - k; e < z->x_start[k + 1] - k - 1; e++)
            out[z->part->v[row[e]]] += bvu[row[e]] * s[k];
}

void kmp_sparse_tangent_project(const kmp_sparse_tangent *z, const double *x, const double *force, double *out)
{
    for (int k = 0; k < z->p; k++, x += z->n) {
        double sum = 0;
        for (int e = z->x_start[k]; e < z->x_start[k + 1]; e++)
            sum += x[z->x_row[e]] * force[z->x_row[e]];
        out[k] = -sum;
    }
}

void kmp_sparse_tangent_tangent(const kmp_sparse_tangent *z, const kmp_reduction *red, const double *jacobian)
{
    int count = z->x_start[z->p] - z->p;
    for (int k = 0; k < red->ju_count; k++)
        z->right[z->ju_place[k]] = -jacobian[red->ju_entry[k]];
    kmp_block_solve_rows(red->block, z->stride, z->reach_runs.start, z->reach_runs.at, z->right, z->b);
    for (int e = 0; e < count; e++)
        red->bvu[z->in_bvu[e]] = red->x[z->in_x[e]] = z->b[z->in_b[e]];
}

/* -- X' M X ---------------------------------------------------------------------------------------------- */

/* The transposed reduced mass is summed up row by row of M X, above the diagonal of mr; then tiles are transposed. */

static KMP_INTO_CLONES void clear_tiles(const kmp_sparse_tangent *z, double *mr)
{
    const kmp_lists *tiles = &z->tiles;
    for (int m = 0; m < z->stride / KMP_FOUR; m++)
        for (int e = tiles->start[m]; e < tiles->start[m + 1]; e++)
            for (int s = 0; s < KMP_FOUR; s++)
                KMP_FOUR_AT(mr + (ptrdiff_t)(KMP_FOUR * tiles->at[e] + s) * z->stride + KMP_FOUR * m) = (kmp_four){0};
}

/* to += by * from at runs of positions, as far as the four of `last`. */
static KMP_INTO_CLONES void add_runs(const int *run, const int *end, double by, const double *restrict from, int last,
                                     double *restrict to)
{
    for (; run < end && run[0] <= last; run += 2)
        for (int c = run[0], before = run[1] <= last ? run[1] : last + 1; c < before; c += KMP_FOUR)
            KMP_FOUR_AT(to + c) += KMP_FOUR_CONST(from + c) * by;
}

static KMP_INTO_CLONES const int *runs_at(const kmp_runs *runs, int k)
{
    return runs->at + (ptrdiff_t)2 * runs->start[k];
}

/* Row i of M X. */
static KMP_INTO_CLONES void multiply_row(const kmp_sparse_tangent *z, const double *mass, int i)
{
    double *row = z->row;
    const double *b = z->b;
    const int *place = z->m_place + z->m_start[i], *entry = z->m_entry + z->m_start[i], *block_of = z->block_of;
    const kmp_runs reach = z->reach_runs;
    int stride = z->stride, count = z->m_start[i + 1] - z->m_start[i];
    for (const int *run = runs_at(&z->mx_runs, i), *end = runs_at(&z->mx_runs, i + 1); run < end; run += 2)
        for (int c = run[0], before = run[1]; c < before; c += KMP_FOUR)
            KMP_FOUR_AT(row + c) = (kmp_four){0};
    for (int k = 0; k < count; k++) {
        int at = place[k];
        double by = mass[entry[k]];
        if (at >= 0)
            row[at] += by;
        else
            add_runs(runs_at(&reach, block_of[-1 - at]), runs_at(&reach, block_of[-1 - at] + 1), by,
                     b + (ptrdiff_t)(-1 - at) * stride, stride, row);
    }
}

static KMP_INTO_CLONES void transpose_tile(int stride, int k, int m, double *mr)
{
    const double *from = mr + (ptrdiff_t)(KMP_FOUR * k) * stride + KMP_FOUR * m;
    double *to = mr + (ptrdiff_t)(KMP_FOUR * m) * stride + KMP_FOUR * k;
    for (int s = 0; s < KMP_FOUR; s++)
        for (int t = 0; t < (k == m ? s : KMP_FOUR); t++)
            to[t * stride + s] = from[s * stride + t];
}

static KMP_CLONES void reduce(const kmp_sparse_tangent *z, const double *mass, double *mr)
{
    const kmp_lists *reach = &z->reach, *tiles = &z->tiles;
    int stride = z->stride;
    clear_tiles(z, mr);
    for (int i = 0; i < z->n; i++) {
        int at = z->place[i];
        const int *run = runs_at(&z->mx_runs, i), *end = runs_at(&z->mx_runs, i + 1);
        multiply_row(z, mass, i);
        if (at >= 0) {
            add_runs(run, end, 1.0, z->row, at, mr + (ptrdiff_t)at * stride);
            continue;
        }
        const double *b = z->b + (ptrdiff_t)(-1 - at) * stride;
        const int *c = reach->at + reach->start[z->block_of[-1 - at]],
                  *last = reach->at + reach->start[z->block_of[-1 - at] + 1];
        for (; c < last; c++)
            add_runs(run, end, b[*c], z->row, *c, mr + (ptrdiff_t)*c * stride);
    }
    for (int m = 0; m < z->stride / KMP_FOUR; m++)
        for (int e = tiles->start[m]; e < tiles->start[m + 1]; e++)
            transpose_tile(z->stride, tiles->at[e], m, mr);
}

void kmp_sparse_tangent_reduce(const kmp_sparse_tangent *z, const double *mass, double *mr)
{
    reduce(z, mass, mr);
}

/* -- factor ---------------------------------------------------------------------------------------------- */

/* Column c of four columns, with the tiles of their rows: its pivot, then its products from the next of the four. */
static KMP_INTO_CLONES bool finish_column(int stride, int last, int count, const int *tile, int c, double *mr)
{
    double *own = mr + (ptrdiff_t)c * stride;
    double pivot = own[c];
    if (!(pivot > 0.0 && pivot <= DBL_MAX))
        return false;
    pivot = sqrt(pivot);
    for (int e = 0; e < count; e++)
        KMP_FOUR_AT(own + KMP_FOUR * tile[e]) /= KMP_FOUR_ALL(pivot);
    own[c] = pivot;
    for (int next = c + 1; next < last; next++) {
        double *to = mr + (ptrdiff_t)next * stride, by = own[next];
        for (int e = 0; e < count; e++)
            KMP_FOUR_AT(to + KMP_FOUR * tile[e]) -= KMP_FOUR_CONST(own + KMP_FOUR * tile[e]) * by;
    }
    return true;
}

/* Subtracts the products of four finished columns from column c, at the tiles. */
static KMP_INTO_CLONES void subtract_four(int stride, int count, const int *tile, const double *four, double *to, int c)
{
    const double *second = four + stride, *third = second + stride, *fourth = third + stride;
    double by[KMP_FOUR] = {four[c], second[c], third[c], fourth[c]};
    for (int e = 0; e < count; e++) {
        int at = KMP_FOUR * tile[e];
        kmp_four sum = KMP_FOUR_AT(to + at);
        sum -= KMP_FOUR_CONST(four + at) * by[0];
        sum -= KMP_FOUR_CONST(second + at) * by[1];
        sum -= KMP_FOUR_CONST(third + at) * by[2];
        sum -= KMP_FOUR_CONST(fourth + at) * by[3];
        KMP_FOUR_AT(to + at) = sum;
    }
}

/* Returns 0, or 1 + the position of a pivot that is not positive. */
static KMP_CLONES int factor(const kmp_sparse_tangent *z, double *mr)
{
    const kmp_lists *tiles = &z->tiles;
    int stride = z->stride;
    for (int m = 0; m < stride / KMP_FOUR; m++) {
        int first = KMP_FOUR * m, last = first + KMP_FOUR < z->p ? first + KMP_FOUR : z->p;
        int count = tiles->start[m + 1] - tiles->start[m];
        const int *tile = tiles->at + tiles->start[m];
        for (int c = first; c < last; c++)
            if (!finish_column(stride, last, count, tile, c, mr))
                return 1 + c;
        for (int e = 1; e < count; e++)
            for (int c = KMP_FOUR * tile[e]; c < KMP_FOUR * tile[e] + KMP_FOUR; c++)
                subtract_four(stride, count - e, tile + e, mr + (ptrdiff_t)first * stride, mr + (ptrdiff_t)c * stride,
                              c);
    }
    return 0;
}

int kmp_sparse_tangent_factor(const kmp_sparse_tangent *z, double *mr)
{
    int fault = factor(z, mr);
    return fault ? 1 + z->order[fault - 1] : 0;
}

/* -- solutions ------------------------------------------------------------------------------------------- */

void kmp_sparse_tangent_solve(const kmp_sparse_tangent *z, const double *mr, double *b)
{
    const int *start = z->l.start, *row = z->l.at;
    double *x = z->packed;
    for (int c = 0; c < z->p; c++)
        x[c] = b[z->order[c]];
    for (int c = 0; c < z->p; c++) {
        const double *own = mr + (size_t)c * (size_t)z->stride;
        double by = x[c] /= own[c];
        for (int e = start[c]; e < start[c + 1]; e++)
            x[row[e]] -= own[row[e]] * by;
    }
    for (int c = z->p - 1; c >= 0; c--) {
        const double *own = mr + (size_t)c * (size_t)z->stride;
        double sum = x[c];
        for (int e = start[c]; e < start[c + 1]; e++)
            sum -= own[row[e]] * x[row[e]];
        x[c] = sum / own[c];
    }
    for (int c = 0; c < z->p; c++)
        b[z->order[c]] = x[c];
}

/* Four solutions, interleaved in x. */
static KMP_CLONES void solve_four(const kmp_sparse_tangent *z, const double *mr, double *x)
{
    const int *start = z->l.start, *row = z->l.at;
    ptrdiff_t stride = z->stride;
    for (int c = 0; c < z->p; c++) {
        const double *own = mr + c * stride;
        kmp_four by = KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c) / KMP_FOUR_ALL(own[c]);
        KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c) = by;
        for (int e = start[c]; e < start[c + 1]; e++)
            KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * row[e]) -= by * own[row[e]];
    }
    for (int c = z->p - 1; c >= 0; c--) {
        const double *own = mr + c * stride;
        kmp_four sum = KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c);
        for (int e = start[c]; e < start[c + 1]; e++)
            sum -= KMP_FOUR_CONST(x + (ptrdiff_t)KMP_FOUR * row[e]) * own[row[e]];
        KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c) = sum / KMP_FOUR_ALL(own[c]);
    }
}

void kmp_sparse_tangent_solve_four(const kmp_sparse_tangent *z, const double *mr, int count, double *b, int ld,
                                   double *room)
{
    for (int c = 0; c < z->p; c++)
        for (int k = 0; k < KMP_FOUR; k++)
            room[KMP_FOUR * c + k] = k < count ? b[z->order[c] + (ptrdiff_t)k * ld] : 0;
    solve_four(z, mr, room);
    for (int c = 0; c < z->p; c++)
        for (int k = 0; k < count; k++)
            b[z->order[c] + (ptrdiff_t)k * ld] = room[KMP_FOUR * c + k];
}
