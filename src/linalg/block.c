/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the permutation C = A(P, Q) to upper block-triangular form (Pothen, Fan, ACM TOMS 16 (1990) 303, by
 * SuiteSparse BTF), the storage of its blocks, and the pivoting inside them: after a factorisation `order`
 * says which row of C stands in each pivoted place, so a solve applies both permutations in its gather. */
#include "linalg/block.h"

#include "base/memory.h"

#include <btf.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

struct kmp_block {
    int n, nz, count;
    int *p, *q, *start; /* C(i, j) = A(p[i], q[j]); block k is rows and columns start[k] .. start[k+1] - 1 */
    int permutation_sign;
    bool pairs; /* every block has two rows */

    double *lu; /* the dense diagonal blocks, one after another */
    int lu_size;
    int *lu_start;   /* of each block in lu */
    int *order;      /* row of C in each pivoted row */
    double *inverse; /* 1 / u_ii */
    int *pivot;

    int *off_start, *off_column; /* entries of C beside the blocks, by rows */
    double *off;
    int *target; /* entry -> place in lu, or -1 - place in off */

    double *scratch; /* 2 n: right-hand sides in pivoted order, two interleaved */
    int sign;        /* of det A; 0: the last factorisation failed */
};

/* -- analysis -------------------------------------------------------------------------------------- */

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
    return b->p && b->q && b->start && b->lu_start && b->order && b->inverse && b->pivot && b->off_start &&
           b->off_column && b->off && b->target && b->scratch;
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

/* Where each block, row and column of A stands in C. */
static void place_blocks(kmp_block *b, int *row_at, int *col_at, int *block_of)
{
    for (int k = 0; k < b->count; k++) {
        int size = b->start[k + 1] - b->start[k];
        b->lu_start[k + 1] = b->lu_start[k] + size * size;
        for (int i = b->start[k]; i < b->start[k + 1]; i++) {
            row_at[b->p[i]] = i;
            col_at[b->q[i]] = i;
            block_of[i] = k;
        }
    }
    b->lu_size = b->lu_start[b->count];
    b->pairs = b->n == 2 * b->count;
    for (int k = 0; k < b->count; k++)
        b->pairs = b->pairs && b->start[k] == 2 * k;
}

/* Each entry's place in its diagonal block; -1 for one beside the blocks, counted in off_start[row + 1]. */
static void place_inside(kmp_block *b, const int *row, const int *col, const int *row_at, const int *col_at,
                         const int *block_of)
{
    for (int e = 0; e < b->nz; e++) {
        int i = row_at[row[e]], j = col_at[col[e]], k = block_of[i], first = b->start[k];
        if (k == block_of[j]) {
            b->target[e] = b->lu_start[k] + (i - first) + (j - first) * (b->start[k + 1] - first);
        } else {
            b->target[e] = -1;
            b->off_start[i + 1]++;
        }
    }
}

/* The places of the others, by rows. */
static void place_outside(kmp_block *b, const int *row, const int *col, const int *row_at, const int *col_at)
{
    for (int i = 0; i < b->n; i++)
        b->off_start[i + 1] += b->off_start[i];
    for (int e = 0; e < b->nz; e++)
        if (b->target[e] == -1) {
            int place = b->off_start[row_at[row[e]]]++;
            b->off_column[place] = col_at[col[e]];
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
    int n = b->n, *zeroed = KMP_NEW(int, 5 * n);
    if (!zeroed)
        return false;
    b->permutation_sign = permutation_sign(n, b->p, zeroed) * permutation_sign(n, b->q, zeroed + n);
    int *row_at = zeroed + 2 * n, *col_at = zeroed + 3 * n, *block_of = zeroed + 4 * n;
    place_blocks(b, row_at, col_at, block_of);
    place_inside(b, row, col, row_at, col_at, block_of);
    place_outside(b, row, col, row_at, col_at);
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
    void *parts[] = {b->p,         b->q,          b->start, b->lu_start, b->order,   b->inverse, b->pivot,
                     b->off_start, b->off_column, b->off,   b->target,   b->scratch, b->lu,      b};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        kmp_free(parts[i]);
}

/* -- factors --------------------------------------------------------------------------------------- */

static int factor_block(int size, double *lu, int *pivot, int *order, int first, int *sign)
{
    int fault = kmp_lu_factor(size, lu, pivot);
    if (fault)
        return fault;
    for (int i = 0; i < size; i++)
        order[i] = first + i;
    for (int i = 0; i < size; i++)
        if (pivot[i] != i) {
            int t = order[i];
            order[i] = order[pivot[i]];
            order[pivot[i]] = t;
            *sign = -*sign;
        }
    return 0;
}

/* Reciprocal pivots and their sign. Returns 0, or 1 + the place of a pivot too small to have a reciprocal. */
static int invert_pivots(int size, const double *lu, double *inverse, int *sign)
{
    for (int i = 0; i < size; i++) {
        double u = lu[i + i * size];
        inverse[i] = 1.0 / u;
        if (!(fabs(inverse[i]) <= DBL_MAX))
            return i + 1;
        *sign = u < 0 ? -*sign : *sign;
    }
    return 0;
}

/* Of a pivot that is neither zero, too small, infinite nor NaN. */
static bool is_reciprocal(double x)
{
    return fabs(x) > 0.0 && fabs(x) <= DBL_MAX;
}

/* The same for two rows, the block of a planar loop, in one: the operations of kmp_lu_factor and of the reciprocals. */
static int factor_pair(kmp_block *b, int k, int *sign)
{
    int first = b->start[k];
    double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + first;
    int lower = fabs(lu[1]) > fabs(lu[0]);
    double u0 = lu[lower], l = lu[1 - lower] / u0, u01 = lu[2 + lower], u1 = lu[3 - lower] - l * u01;
    b->order[first] = first + lower;
    b->order[first + 1] = first + 1 - lower;
    lu[0] = u0;
    lu[1] = l;
    lu[2] = u01;
    lu[3] = u1;
    inverse[0] = 1.0 / u0;
    inverse[1] = 1.0 / u1;
    *sign *= (1 - 2 * lower) * (u0 < 0 ? -1 : 1) * (u1 < 0 ? -1 : 1);
    return !is_reciprocal(inverse[0]) ? 1 : !is_reciprocal(inverse[1]) ? 2 : 0;
}

static void scatter(kmp_block *b, const double *values)
{
    memset(b->lu, 0, (size_t)b->lu_size * sizeof *b->lu);
    for (int e = 0; e < b->nz; e++) {
        int t = b->target[e];
        if (t >= 0)
            b->lu[t] = values[e];
        else
            b->off[-1 - t] = values[e];
    }
}

int kmp_block_factor(kmp_block *b, const double *values)
{
    scatter(b, values);
    b->sign = b->permutation_sign;
    for (int k = 0; k < b->count; k++) {
        int first = b->start[k], size = b->start[k + 1] - first;
        double *lu = b->lu + b->lu_start[k];
        int fault = size == 2 ? factor_pair(b, k, &b->sign)
                              : factor_block(size, lu, b->pivot + first, b->order + first, first, &b->sign);
        if (!fault && size != 2)
            fault = invert_pivots(size, lu, b->inverse + first, &b->sign);
        if (fault) {
            b->sign = 0;
            return 1 + b->q[first + fault - 1];
        }
    }
    return 0;
}

/* -- solves: `lanes` right-hand sides interleaved in w, 1 or 2 ------------------------------------- */

#define INLINE static inline __attribute__((always_inline))

/* w <- U^-1 L^-1 w within one block. */
INLINE void solve_block(int lanes, int size, const double *lu, const double *inverse, double *w)
{
    for (int l = 0; l < lanes; l++) {
        double *x = w + l;
        for (int i = 1; i < size; i++) {
            double s = x[i * lanes];
            for (int j = 0; j < i; j++)
                s -= lu[i + j * size] * x[j * lanes];
            x[i * lanes] = s;
        }
        for (int i = size - 1; i >= 0; i--) {
            double s = x[i * lanes];
            for (int j = i + 1; j < size; j++)
                s -= lu[i + j * size] * x[j * lanes];
            x[i * lanes] = s * inverse[i];
        }
    }
}

/* w <- (L U)^-T w within one block. */
INLINE void solve_block_transposed(int lanes, int size, const double *lu, const double *inverse, double *w)
{
    for (int l = 0; l < lanes; l++) {
        double *x = w + l;
        for (int i = 0; i < size; i++) {
            double s = x[i * lanes];
            for (int j = 0; j < i; j++)
                s -= lu[j + i * size] * x[j * lanes];
            x[i * lanes] = s * inverse[i];
        }
        for (int i = size - 2; i >= 0; i--) {
            double s = x[i * lanes];
            for (int j = i + 1; j < size; j++)
                s -= lu[j + i * size] * x[j * lanes];
            x[i * lanes] = s;
        }
    }
}

/* The compiler unrolls the common sizes. */
#define FOR_SIZE(solve)                                                                                                \
    do {                                                                                                               \
        switch (size) {                                                                                                \
        case 1:                                                                                                        \
            solve(lanes, 1, lu, inverse, w);                                                                           \
            break;                                                                                                     \
        case 2:                                                                                                        \
            solve(lanes, 2, lu, inverse, w);                                                                           \
            break;                                                                                                     \
        case 3:                                                                                                        \
            solve(lanes, 3, lu, inverse, w);                                                                           \
            break;                                                                                                     \
        default:                                                                                                       \
            solve(lanes, size, lu, inverse, w);                                                                        \
        }                                                                                                              \
    } while (0)

/* One right-hand side of row `row` of C, less what the later unknowns contribute. */
INLINE double remainder_of(const kmp_block *b, int row, const double *x, const double *solved)
{
    double s = x[b->p[row]];
    for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++)
        s -= b->off[e] * solved[b->off_column[e]];
    return s;
}

/* The same as solve() for one right-hand side and blocks of two. */
static void solve_pairs(const kmp_block *b, double *restrict x)
{
    double *restrict w = b->scratch;
    for (int k = b->n - 2; k >= 0; k -= 2) {
        const double *lu = b->lu + 2 * k, *inverse = b->inverse + k;
        double s = remainder_of(b, b->order[k], x, w), r = remainder_of(b, b->order[k + 1], x, w) - lu[1] * s;
        w[k + 1] = r * inverse[1];
        w[k] = (s - lu[2] * w[k + 1]) * inverse[0];
    }
    for (int j = 0; j < b->n; j++)
        x[b->q[j]] = w[j];
}

/* Last block first: the right-hand side less what the later unknowns contribute, then the block. */
INLINE void solve(const kmp_block *b, int lanes, double *restrict x)
{
    int n = b->n;
    double *restrict scratch = b->scratch;
    for (int k = b->count - 1; k >= 0; k--) {
        int first = b->start[k], size = b->start[k + 1] - first;
        const double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + first;
        double *w = scratch + first * lanes;
        for (int i = 0; i < size; i++) {
            int row = b->order[first + i];
            for (int l = 0; l < lanes; l++) {
                double s = x[b->p[row] + l * n];
                for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++)
                    s -= b->off[e] * scratch[b->off_column[e] * lanes + l];
                w[i * lanes + l] = s;
            }
        }
        FOR_SIZE(solve_block);
    }
    for (int j = 0; j < n; j++)
        for (int l = 0; l < lanes; l++)
            x[b->q[j] + l * n] = scratch[j * lanes + l];
}

/* First block first: the block, then its unknowns out of the later right-hand sides. */
INLINE void solve_transposed(const kmp_block *b, int lanes, double *restrict x)
{
    int n = b->n;
    double *restrict scratch = b->scratch;
    for (int j = 0; j < n; j++)
        for (int l = 0; l < lanes; l++)
            scratch[j * lanes + l] = x[b->q[j] + l * n];
    for (int k = 0; k < b->count; k++) {
        int first = b->start[k], size = b->start[k + 1] - first;
        const double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + first;
        double *w = scratch + first * lanes;
        FOR_SIZE(solve_block_transposed);
        for (int i = 0; i < size; i++) {
            int row = b->order[first + i];
            for (int l = 0; l < lanes; l++) {
                double s = w[i * lanes + l];
                x[b->p[row] + l * n] = s;
                for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++)
                    scratch[b->off_column[e] * lanes + l] -= b->off[e] * s;
            }
        }
    }
}

void kmp_block_solve(const kmp_block *b, int m, double *x)
{
    for (; m >= 2; m -= 2, x += 2 * (ptrdiff_t)b->n)
        solve(b, 2, x);
    if (m == 1 && b->pairs)
        solve_pairs(b, x);
    else if (m == 1)
        solve(b, 1, x);
}

void kmp_block_solve_transposed(const kmp_block *b, int m, double *x)
{
    for (; m >= 2; m -= 2, x += 2 * (ptrdiff_t)b->n)
        solve_transposed(b, 2, x);
    if (m == 1)
        solve_transposed(b, 1, x);
}

/* -- queries --------------------------------------------------------------------------------------- */

int kmp_block_count(const kmp_block *b)
{
    return b->count;
}

const int *kmp_block_columns(const kmp_block *b, int k, int *count)
{
    *count = b->start[k + 1] - b->start[k];
    return b->q + b->start[k];
}

int kmp_block_sign(const kmp_block *b)
{
    return b->sign;
}

/* Smallest and largest absolute pivot of block k. */
static void weigh_pivots(const kmp_block *b, int k, double *low, double *high)
{
    int size = b->start[k + 1] - b->start[k];
    *low = INFINITY;
    *high = 0.0;
    for (int i = 0; i < size; i++) {
        double s = fabs(b->lu[b->lu_start[k] + i + i * size]);
        *low = fmin(*low, s);
        *high = fmax(*high, s);
    }
}

double kmp_block_quality(const kmp_block *b)
{
    double quality = b->sign ? 1.0 : 0.0, low, high;
    for (int k = 0; b->sign && k < b->count; k++) {
        weigh_pivots(b, k, &low, &high);
        quality = fmin(quality, low / high);
    }
    return quality;
}

double kmp_block_smallest(const kmp_block *b)
{
    double smallest = b->sign ? INFINITY : 0.0, low, high;
    for (int k = 0; b->sign && k < b->count; k++) {
        weigh_pivots(b, k, &low, &high);
        smallest = fmin(smallest, low);
    }
    return smallest;
}

/* -- counts ---------------------------------------------------------------------------------------- */

static void accumulate(kmp_flops *sum, kmp_flops f)
{
    sum->add += f.add;
    sum->mul += f.mul;
    sum->div += f.div;
    sum->root += f.root;
}

kmp_flops kmp_block_factor_flops(const kmp_block *b)
{
    kmp_flops sum = {0};
    for (int k = 0; k < b->count; k++) {
        int size = b->start[k + 1] - b->start[k];
        accumulate(&sum, kmp_lu_flops(size));
        sum.div += size;
    }
    return sum;
}

kmp_flops kmp_block_solve_flops(const kmp_block *b)
{
    long off = b->n ? b->off_start[b->n] : 0;
    kmp_flops sum = {.add = off, .mul = off + b->n};
    for (int k = 0; k < b->count; k++) {
        long size = b->start[k + 1] - b->start[k], products = size * (size - 1);
        accumulate(&sum, (kmp_flops){.add = products, .mul = products});
    }
    return sum;
}
