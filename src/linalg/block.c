/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides the permutation C = A(P, Q) to upper block-triangular form (Pothen, Fan, ACM TOMS 16 (1990) 303, by
 * SuiteSparse BTF), the storage of its blocks, and the pivoting inside them: `order` gives the row of C in each pivoted
 * position, so a solve applies both permutations in its gather. Large blocks with few entries have sparse factors;
 * their columns of C are in the order of elimination. */
#include "linalg/block.h"
#include "base/arena.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "linalg/sparse.h"
#include "linalg/sparse_lu.h"
#include "linalg/wide_rows.h"
#include <btf.h>
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

/* Smaller blocks are dense. */
enum { SPARSE_FROM = 32 };

struct kmp_block {
    kmp_arena arena;
    int n, nz, count;
    int *p, *q, *start;     /* C(i, j) = A(p[i], q[j]); block k is rows and columns start[k] .. start[k+1] - 1 */
    int *place, *row_place; /* positions of each column and row of A in C */
    int *block_of;          /* block of each column of C */
    char *due;              /* blocks that a right-hand side of few entries has reached */
    bool pairs;             /* every block has two rows */

    double *lu; /* the dense diagonal blocks, one after another; of a sparse one, its entries */
    int lu_size;
    kmp_sparse_lu **sparse; /* of each block; NULL: it is dense, or all are */
    int *lu_start;          /* start of each block in lu */
    int *order;             /* row of C in each pivoted row */
    double *inverse;        /* 1 / u_ii */
    int *pivot;

    int *off_start, *off_column; /* entries of C outside the blocks, by rows */
    double *off;
    int *target; /* entry -> position in lu, or -1 - position in off */

    double *scratch; /* 2 n: right-hand sides in pivoted order, two interleaved */
    bool factored;   /* the last factorisation has not failed */
    int *signs;      /* of the blocks' determinants */
};

/* -- analysis ---------------------------------------------------------------------------------------- */

static bool permute(kmp_block *b, const int *row, const int *col)
{
    int n = b->n, matched = 0;
    double work;
    kmp_arena room = {0};
    int *ap = KMP_ARENA_NEW(&room, int, n + 1), *ai = KMP_ARENA_NEW(&room, int, b->nz),
        *scratch = KMP_ARENA_NEW(&room, int, 5 * n);
    bool ok = !room.failed;
    if (ok && n > 0) {
        /* Compressed columns of the pattern; `ap` has n + 1 places, `ai` nz. */
        kmp_sort_entries(n, b->nz, col, ap, ai);
        for (int k = 0; k < b->nz; k++)
            ai[k] = row[ai[k]];
        b->count = btf_order(n, ap, ai, 0.0, &work, b->p, b->q, b->start, &matched, scratch);
    }
    kmp_arena_free(&room);
    return ok && matched == n;
}

/* The position of each block, row and column of A in C. */
static void place_blocks(kmp_block *b)
{
    for (int k = 0; k < b->count; k++)
        for (int i = b->start[k]; i < b->start[k + 1]; i++) {
            b->row_place[b->p[i]] = i;
            b->place[b->q[i]] = i;
            b->block_of[i] = k;
        }
}

static bool is_sparse(const kmp_block *b, int k)
{
    return b->sparse && b->sparse[k];
}

/* True for an entry of a diagonal block; *k: its block. */
static bool is_within(const kmp_block *b, int row, int col, int *k)
{
    *k = b->block_of[b->row_place[row]];
    return *k == b->block_of[b->place[col]];
}

/* Takes sparse factors for large blocks, where these cost less, and the order of their columns. */
static bool make_sparse(kmp_block *b, const int *row, const int *col)
{
    unsigned long failures = kmp_memory_failures();
    kmp_arena room = {0};
    int *own_row, *own_col, *order, *q;
    if (kmp_block_largest(b) < SPARSE_FROM)
        return true;
    b->sparse = KMP_ARENA_NEW(&b->arena, kmp_sparse_lu *, b->count);
    bool ok =
        b->sparse && KMP_ARENA_MAKE(&room, KMP_ROOM(int, b->nz, &own_row, &own_col), KMP_ROOM(int, b->n, &order, &q));
    for (int k = 0; ok && k < b->count; k++) {
        const int first = b->start[k], size = b->start[k + 1] - first;
        if (size < SPARSE_FROM)
            continue;
        int count = 0, of;
        for (int e = 0; e < b->nz; e++) {
            if (!is_within(b, row[e], col[e], &of) || of != k)
                continue;
            own_row[count] = b->row_place[row[e]] - first;
            own_col[count++] = b->place[col[e]] - first;
        }
        b->sparse[k] = kmp_sparse_lu_new(size, count, own_row, own_col, order);
        if (!b->sparse[k])
            continue;
        for (int i = 0; i < size; i++)
            q[i] = b->q[first + order[i]];
        memcpy(b->q + first, q, (size_t)size * sizeof *q);
    }
    kmp_arena_free(&room);
    place_blocks(b);
    return ok && kmp_memory_failures() == failures;
}

static bool analyse(kmp_block *b, const int *row, const int *col)
{
    if (!permute(b, row, col))
        return false;
    place_blocks(b);
    if (!make_sparse(b, row, col))
        return false;
    for (int k = 0; k < b->count; k++) {
        int size = b->start[k + 1] - b->start[k];
        b->lu_start[k + 1] = b->lu_start[k] + (is_sparse(b, k) ? kmp_sparse_lu_entries(b->sparse[k]) : size * size);
    }
    b->lu_size = b->lu_start[b->count];
    b->pairs = b->n == 2 * b->count;
    for (int k = 0; k < b->count; k++)
        b->pairs = b->pairs && b->start[k] == 2 * k;
    /* Each entry's position in its diagonal block; -1 for an entry outside the blocks, counted in off_start[row + 1].
     * Of a sparse block, entries are listed in their order; order[k], not in use yet, counts them. */
    memset(b->order, 0, (size_t)b->n * sizeof *b->order);
    for (int e = 0, k; e < b->nz; e++) {
        int i = b->row_place[row[e]], j = b->place[col[e]];
        if (is_within(b, row[e], col[e], &k)) {
            const int first = b->start[k];
            b->target[e] = b->lu_start[k] +
                           (is_sparse(b, k) ? b->order[k]++ : (i - first) + (j - first) * (b->start[k + 1] - first));
        } else {
            b->target[e] = -1;
            b->off_start[i + 1]++;
        }
    }
    /* The positions of entries outside the blocks, by rows. */
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
    b->lu = KMP_ARENA_NEW(&b->arena, double, b->lu_size);
    return b->lu;
}

kmp_block *kmp_block_new(int n, int nz, const int *row, const int *col)
{
    kmp_block *b = KMP_NEW(kmp_block, 1);
    if (!b)
        return NULL;
    b->n = n;
    b->nz = nz;
    bool made = KMP_ARENA_MAKE(
        &b->arena, KMP_ROOM(double, n, &b->inverse), KMP_ROOM(double, nz, &b->off),
        KMP_ROOM(double, 2 * n, &b->scratch), KMP_ROOM(char, n, &b->due),
        KMP_ROOM(int, n + 1, &b->start, &b->lu_start, &b->off_start), KMP_ROOM(int, nz, &b->off_column, &b->target),
        KMP_ROOM(int, n, &b->p, &b->q, &b->order, &b->pivot, &b->signs, &b->place, &b->row_place, &b->block_of));
    if (made && analyse(b, row, col))
        return b;
    kmp_block_free(b);
    return NULL;
}

void kmp_block_free(kmp_block *b)
{
    for (int k = 0; b && b->sparse && k < b->count; k++)
        kmp_sparse_lu_free(b->sparse[k]);
    if (b)
        kmp_arena_free(&b->arena);
    kmp_free(b);
}

/* -- factors --------------------------------------------------------------------------------------- */

/* Factors block k, with reciprocal pivots. Returns 0, or 1 + the index of a pivot that has none. */
static int factor_block(kmp_block *b, int k)
{
    int first = b->start[k], size = b->start[k + 1] - first, *order = b->order + first;
    double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + first;
    if (is_sparse(b, k)) {
        int fault = kmp_sparse_lu_factor(b->sparse[k], lu, order, inverse, &b->signs[k]);
        for (int i = 0; i < size; i++)
            order[i] += first;
        return fault;
    }
    int fault = kmp_lu_factor(size, lu, b->pivot);
    if (fault)
        return fault;
    for (int i = 0; i < size; i++)
        order[i] = first + i;
    for (int i = 0; i < size; i++)
        if (b->pivot[i] != i) {
            kmp_swap_int(&order[i], &order[b->pivot[i]]);
            b->signs[k] = -b->signs[k];
        }
    for (int i = 0; i < size; i++) {
        double u = lu[i + i * size];
        inverse[i] = 1.0 / u;
        if (!(fabs(inverse[i]) <= DBL_MAX))
            return i + 1;
        b->signs[k] = u < 0 ? -b->signs[k] : b->signs[k];
    }
    return 0;
}

/* True if x is the reciprocal of a pivot that is neither zero, too small, infinite nor NaN. */
static bool is_reciprocal(double x)
{
    return fabs(x) > 0.0 && fabs(x) <= DBL_MAX;
}

/* Factors a block of two rows, as of a planar loop, at once: the operations of kmp_lu_factor and of the reciprocals. */
static int factor_pair(kmp_block *b, int k)
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
    b->signs[k] = (1 - 2 * lower) * (u0 < 0 ? -1 : 1) * (u1 < 0 ? -1 : 1);
    return !is_reciprocal(inverse[0]) ? 1 : !is_reciprocal(inverse[1]) ? 2 : 0;
}

int kmp_block_factor(kmp_block *b, const double *values)
{
    /* Entries of A, in the blocks and outside. */
    memset(b->lu, 0, (size_t)b->lu_size * sizeof *b->lu);
    for (int e = 0; e < b->nz; e++) {
        int t = b->target[e];
        if (t >= 0)
            b->lu[t] = values[e];
        else
            b->off[-1 - t] = values[e];
    }
    b->factored = false;
    for (int k = 0; k < b->count; k++) {
        b->signs[k] = 1;
        int fault = b->start[k + 1] - b->start[k] == 2 ? factor_pair(b, k) : factor_block(b, k);
        if (fault)
            return 1 + b->q[b->start[k] + fault - 1];
    }
    b->factored = true;
    return 0;
}

/* -- solves: `lanes` right-hand sides interleaved in w, 1 or 2 ------------------------------------- */

#define INLINE static inline __attribute__((always_inline))

/* w <- U^-1 L^-1 w within one block. */
INLINE void solve_block(int size, int lanes, const double *lu, const double *inverse, double *w)
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

/* w <- (L U)^-T w within one block, for one right-hand side. */
INLINE void solve_block_transposed(int size, const double *lu, const double *inverse, double *w)
{
    for (int i = 0; i < size; i++) {
        double s = w[i];
        for (int j = 0; j < i; j++)
            s -= lu[j + i * size] * w[j];
        w[i] = s * inverse[i];
    }
    for (int i = size - 2; i >= 0; i--) {
        double s = w[i];
        for (int j = i + 1; j < size; j++)
            s -= lu[j + i * size] * w[j];
        w[i] = s;
    }
}

/* Calls for `size`; the compiler unrolls the common ones. */
#define FOR_SIZE(solve, ...)                                                                                           \
    do {                                                                                                               \
        switch (size) {                                                                                                \
        case 1:                                                                                                        \
            solve(1, __VA_ARGS__);                                                                                     \
            break;                                                                                                     \
        case 2:                                                                                                        \
            solve(2, __VA_ARGS__);                                                                                     \
            break;                                                                                                     \
        case 3:                                                                                                        \
            solve(3, __VA_ARGS__);                                                                                     \
            break;                                                                                                     \
        default:                                                                                                       \
            solve(size, __VA_ARGS__);                                                                                  \
        }                                                                                                              \
    } while (0)

/* The same within block k. */
INLINE void solve_at(const kmp_block *b, int k, int lanes, double *w)
{
    const int size = b->start[k + 1] - b->start[k];
    const double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + b->start[k];
    if (is_sparse(b, k))
        kmp_sparse_lu_solve(b->sparse[k], inverse, lanes, w);
    else
        FOR_SIZE(solve_block, lanes, lu, inverse, w);
}

INLINE void solve_transposed_at(const kmp_block *b, int k, double *w)
{
    const int size = b->start[k + 1] - b->start[k];
    const double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + b->start[k];
    if (is_sparse(b, k))
        kmp_sparse_lu_solve_transposed(b->sparse[k], inverse, w);
    else
        FOR_SIZE(solve_block_transposed, lu, inverse, w);
}

/* The right-hand side of row `row` of C, less the contributions of later unknowns. */
INLINE double remainder_of(const kmp_block *b, int row, const double *x, const double *solved)
{
    double s = x[b->p[row]];
    for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++)
        s -= b->off[e] * solved[b->off_column[e]];
    return s;
}

/* Solves for one right-hand side where all blocks have two rows; otherwise as solve(). */
INLINE void solve_pairs(const kmp_block *b, double *restrict w, double *restrict x)
{
    for (int k = b->n - 2; k >= 0; k -= 2) {
        const double *lu = b->lu + 2 * k, *inverse = b->inverse + k;
        double s = remainder_of(b, b->order[k], x, w), r = remainder_of(b, b->order[k + 1], x, w) - lu[1] * s;
        w[k + 1] = r * inverse[1];
        w[k] = (s - lu[2] * w[k + 1]) * inverse[0];
    }
    for (int j = 0; j < b->n; j++)
        x[b->q[j]] = w[j];
}

/* Last block first: the right-hand side less the contributions of later unknowns, then the block. */
INLINE void solve(const kmp_block *b, int lanes, double *restrict scratch, double *restrict x)
{
    int n = b->n;
    for (int k = b->count - 1; k >= 0; k--) {
        int first = b->start[k], size = b->start[k + 1] - first;
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
        solve_at(b, k, lanes, w);
    }
    for (int j = 0; j < n; j++)
        for (int l = 0; l < lanes; l++)
            x[b->q[j] + l * n] = scratch[j * lanes + l];
}

/* First block first: the block, then its unknowns out of the later right-hand sides. */
void kmp_block_solve_transposed(const kmp_block *b, double *restrict x)
{
    if (!b)
        return;
    double *restrict scratch = b->scratch;
    for (int j = 0; j < b->n; j++)
        scratch[j] = x[b->q[j]];
    for (int k = 0; k < b->count; k++) {
        int first = b->start[k], size = b->start[k + 1] - first;
        double *w = scratch + first;
        solve_transposed_at(b, k, w);
        for (int i = 0; i < size; i++) {
            int row = b->order[first + i];
            x[b->p[row]] = w[i];
            for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++)
                scratch[b->off_column[e]] -= b->off[e] * w[i];
        }
    }
}

/* Adds to the right-hand side at column j of C; the first entry of a block makes it due. `last`: the last one due. */
static void reach(const kmp_block *b, int j, double value, int *last)
{
    int k = b->block_of[j];
    if (!b->due[k])
        memset(b->scratch + b->start[k], 0, (size_t)(b->start[k + 1] - b->start[k]) * sizeof *b->scratch);
    b->due[k] = 1;
    b->scratch[j] += value;
    *last = k > *last ? k : *last;
}

static bool is_nothing(int count, double nothing, const double *x)
{
    for (int i = 0; i < count; i++)
        if (!(fabs(x[i]) <= nothing))
            return false;
    return true;
}

int kmp_block_solve_transposed_few(const kmp_block *b, double nothing, int count, const int *column,
                                   const double *value, int *row, double *x)
{
    int first_due = b->count, last = -1, found = 0;
    for (int e = 0; e < count; e++) {
        int k = b->block_of[b->place[column[e]]];
        first_due = k < first_due ? k : first_due;
        reach(b, b->place[column[e]], value[e], &last);
    }
    for (int k = first_due; k <= last; k++) {
        int first = b->start[k], size = b->start[k + 1] - first;
        double *w = b->scratch + first;
        bool due = b->due[k];
        b->due[k] = 0;
        if (!due || is_nothing(size, nothing, w))
            continue;
        solve_transposed_at(b, k, w);
        for (int i = 0; i < size; i++) {
            int at = b->order[first + i];
            if (!(fabs(w[i]) <= nothing)) {
                row[found] = b->p[at];
                x[found++] = w[i];
            }
            for (int e = b->off_start[at]; e < b->off_start[at + 1]; e++)
                reach(b, b->off_column[e], -b->off[e] * w[i], &last);
        }
    }
    return found;
}

INLINE void solve_one(const kmp_block *b, double *x, double *room)
{
    if (b->pairs)
        solve_pairs(b, room, x);
    else
        solve(b, 1, room, x);
}

void kmp_block_solve(const kmp_block *b, int m, double *x)
{
    if (!b)
        return;
    for (; m >= 2; m -= 2, x += 2 * (ptrdiff_t)b->n)
        solve(b, 2, b->scratch, x);
    if (m == 1)
        solve_one(b, x, b->scratch);
}

void kmp_block_solve_in(const kmp_block *b, double *x, double *room)
{
    if (b)
        solve_one(b, x, room);
}

/* The right-hand side of row `row` of C, less the contributions of later unknowns, at the columns of [from, end). */
static KMP_INTO_CLONES void start_row(const kmp_block *b, int row, int stride, int from, int end, const double *right,
                                      const double *x, double *own)
{
    const double *own_right = right + (ptrdiff_t)b->p[row] * stride;
    for (int c = from; c < end; c += KMP_FOUR)
        KMP_FOUR_AT(own + c) = KMP_FOUR_CONST(own_right + c);
    for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++) {
        const double *solved = x + (ptrdiff_t)b->q[b->off_column[e]] * stride;
        for (int c = from; c < end; c += KMP_FOUR)
            KMP_FOUR_AT(own + c) -= KMP_FOUR_CONST(solved + c) * b->off[e];
    }
}

/* x_i -= lu_ij x_j at four columns, for j of [from, end). */
static KMP_INTO_CLONES void subtract(int from, int end, const double *lu, int size, const int *column, int stride,
                                     const double *x, double *own)
{
    kmp_four sum = KMP_FOUR_CONST(own);
    for (int j = from; j < end; j++)
        sum -= KMP_FOUR_CONST(x + (ptrdiff_t)column[j] * stride) * lu[(ptrdiff_t)j * size];
    KMP_FOUR_AT(own) = sum;
}

/* Solves within a block at four columns. */
static KMP_INTO_CLONES void solve_four(int size, const double *lu, const double *inverse, const int *column, int stride,
                                       double *x)
{
    for (int i = 1; i < size; i++)
        subtract(0, i, lu + i, size, column, stride, x, x + (ptrdiff_t)column[i] * stride);
    for (int i = size - 1; i >= 0; i--) {
        double *own = x + (ptrdiff_t)column[i] * stride;
        subtract(i + 1, size, lu + i, size, column, stride, x, own);
        KMP_FOUR_AT(own) *= inverse[i];
    }
}

static KMP_CLONES void solve_rows(const kmp_block *b, int stride, const int *start, const int *run, const double *right,
                                  double *x)
{
    for (int k = b->count - 1; k >= 0; k--) {
        int first = b->start[k], size = b->start[k + 1] - first;
        const int *column = b->q + first;
        for (int e = start[k]; e < start[k + 1]; e++) {
            for (int i = 0; i < size; i++)
                start_row(b, b->order[first + i], stride, run[2 * e], run[2 * e + 1], right, x,
                          x + (ptrdiff_t)column[i] * stride);
            if (is_sparse(b, k))
                kmp_sparse_lu_solve_rows(b->sparse[k], b->inverse + first, column, stride, run[2 * e], run[2 * e + 1],
                                         x);
            for (int c = run[2 * e]; !is_sparse(b, k) && c < run[2 * e + 1]; c += KMP_FOUR)
                solve_four(size, b->lu + b->lu_start[k], b->inverse + first, column, stride, x + c);
        }
    }
}

void kmp_block_solve_rows(const kmp_block *b, int stride, const int *start, const int *run, const double *right,
                          double *x)
{
    if (b)
        solve_rows(b, stride, start, run, right, x);
}

/* -- rows of 4, 8 or 16 right-hand sides --------------------------------------------------------------- */

static KMP_INTO_CLONES void solve_wide(int fours, const kmp_block *b, const double *right, double *x)
{
    const ptrdiff_t width = KMP_FOUR * fours;
    kmp_four sum[KMP_WIDE_FOURS];
    for (int k = b->count - 1; k >= 0; k--) {
        const int first = b->start[k], size = b->start[k + 1] - first, *column = b->q + first;
        const double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + first;
        const bool dense = !is_sparse(b, k);
        for (int i = 0; i < size; i++) {
            const int row = b->order[first + i];
            kmp_wide_load(fours, right + b->p[row] * width, sum);
            for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++)
                kmp_wide_subtract(fours, b->off[e], x + b->q[b->off_column[e]] * width, sum);
            for (int j = 0; dense && j < i; j++)
                kmp_wide_subtract(fours, lu[i + (ptrdiff_t)j * size], x + column[j] * width, sum);
            kmp_wide_store(fours, sum, x + column[i] * width);
        }
        for (int i = size - 1; dense && i >= 0; i--) {
            kmp_wide_load(fours, x + column[i] * width, sum);
            for (int j = i + 1; j < size; j++)
                kmp_wide_subtract(fours, lu[i + (ptrdiff_t)j * size], x + column[j] * width, sum);
            kmp_wide_store_times(fours, inverse[i], sum, x + column[i] * width);
        }
        if (!dense)
            kmp_sparse_lu_solve_rows(b->sparse[k], inverse, column, (int)width, 0, (int)width, x);
    }
}

/* One right-hand side after another. */
static void solve_sparse_transposed(const kmp_block *b, int k, ptrdiff_t width, double *right)
{
    const int first = b->start[k], size = b->start[k + 1] - first, *column = b->q + first;
    for (int l = 0; l < width; l++) {
        for (int i = 0; i < size; i++)
            b->scratch[i] = right[column[i] * width + l];
        kmp_sparse_lu_solve_transposed(b->sparse[k], b->inverse + first, b->scratch);
        for (int i = 0; i < size; i++)
            right[column[i] * width + l] = b->scratch[i];
    }
}

static KMP_INTO_CLONES void solve_transposed_wide(int fours, const kmp_block *b, double *right, double *x)
{
    const ptrdiff_t width = KMP_FOUR * fours;
    kmp_four sum[KMP_WIDE_FOURS];
    for (int k = 0; k < b->count; k++) {
        const int first = b->start[k], size = b->start[k + 1] - first, *column = b->q + first;
        const double *lu = b->lu + b->lu_start[k], *inverse = b->inverse + first;
        const bool dense = !is_sparse(b, k);
        for (int i = 0; dense && i < size; i++) {
            kmp_wide_load(fours, right + column[i] * width, sum);
            for (int j = 0; j < i; j++)
                kmp_wide_subtract(fours, lu[j + (ptrdiff_t)i * size], right + column[j] * width, sum);
            kmp_wide_store_times(fours, inverse[i], sum, right + column[i] * width);
        }
        for (int i = size - 2; dense && i >= 0; i--) {
            kmp_wide_load(fours, right + column[i] * width, sum);
            for (int j = i + 1; j < size; j++)
                kmp_wide_subtract(fours, lu[j + (ptrdiff_t)i * size], right + column[j] * width, sum);
            kmp_wide_store(fours, sum, right + column[i] * width);
        }
        if (!dense)
            solve_sparse_transposed(b, k, width, right);
        for (int i = 0; i < size; i++) {
            const int row = b->order[first + i];
            const double *own = right + column[i] * width;
            kmp_wide_load(fours, own, sum);
            kmp_wide_store(fours, sum, x + b->p[row] * width);
            for (int e = b->off_start[row]; e < b->off_start[row + 1]; e++) {
                double *later = right + b->q[b->off_column[e]] * width;
                kmp_wide_load(fours, later, sum);
                kmp_wide_subtract(fours, b->off[e], own, sum);
                kmp_wide_store(fours, sum, later);
            }
        }
    }
}

static KMP_CLONES void solve_of_width(const kmp_block *b, int width, const double *right, double *x)
{
    KMP_OF_WIDE(solve_wide, width, b, right, x);
}

static KMP_CLONES void solve_transposed_of_width(const kmp_block *b, int width, double *right, double *x)
{
    KMP_OF_WIDE(solve_transposed_wide, width, b, right, x);
}

void kmp_block_solve_wide(const kmp_block *b, int width, const double *right, double *x)
{
    if (b)
        solve_of_width(b, width, right, x);
}

void kmp_block_solve_transposed_wide(const kmp_block *b, int width, double *right, double *x)
{
    if (b)
        solve_transposed_of_width(b, width, right, x);
}

/* -- queries --------------------------------------------------------------------------------------- */

bool kmp_block_keeps_pivots(const kmp_block *b)
{
    bool some = false;
    for (int k = 0; b && k < b->count; k++)
        some = some || is_sparse(b, k);
    return some;
}

int kmp_block_count(const kmp_block *b)
{
    return b ? b->count : 0;
}

const int *kmp_block_columns(const kmp_block *b, int k, int *count)
{
    *count = b->start[k + 1] - b->start[k];
    return b->q + b->start[k];
}

int kmp_block_largest(const kmp_block *b)
{
    int largest = 0;
    for (int k = 0; b && k < b->count; k++)
        largest = b->start[k + 1] - b->start[k] > largest ? b->start[k + 1] - b->start[k] : largest;
    return largest;
}

const int *kmp_block_rows(const kmp_block *b, int k)
{
    return b->p + b->start[k];
}

void kmp_block_take_signs(const kmp_block *b, int *signs)
{
    memcpy(signs, b->signs, (size_t)b->count * sizeof *signs);
}

bool kmp_block_has_signs(const kmp_block *b, const int *signs)
{
    return memcmp(signs, b->signs, (size_t)b->count * sizeof *signs) == 0;
}

double kmp_block_smallest(const kmp_block *b)
{
    double smallest = b->factored ? INFINITY : 0.0;
    for (int k = 0; b->factored && k < b->count; k++)
        for (int i = 0, size = b->start[k + 1] - b->start[k]; i < size; i++)
            smallest = fmin(smallest, is_sparse(b, k) ? fabs(1 / b->inverse[b->start[k] + i])
                                                      : fabs(b->lu[b->lu_start[k] + i * (size + 1)]));
    return smallest;
}

/* -- counts ---------------------------------------------------------------------------------------- */

kmp_flops kmp_block_factor_flops(const kmp_block *b)
{
    kmp_flops sum = {0};
    for (int k = 0; k < b->count; k++) {
        int size = b->start[k + 1] - b->start[k];
        sum.div += size;
        if (!is_sparse(b, k)) {
            kmp_flops_add(&sum, 1, kmp_lu_flops(size));
            continue;
        }
        const long products = (long)kmp_sparse_lu_factor_products(b->sparse[k]);
        kmp_flops_add(&sum, 1, (kmp_flops){.add = products, .mul = products});
    }
    return sum;
}

kmp_flops kmp_block_solve_flops(const kmp_block *b, const char *used)
{
    kmp_flops sum = {0};
    for (int k = 0; k < b->count; k++) {
        const long size = b->start[k + 1] - b->start[k],
                   off = b->off_start[b->start[k + 1]] - b->off_start[b->start[k]];
        const long products =
            (is_sparse(b, k) ? (long)kmp_sparse_lu_solve_products(b->sparse[k]) - size : size * (size - 1)) + off;
        if (!used || used[k])
            kmp_flops_add(&sum, 1, (kmp_flops){.add = products, .mul = products + size});
    }
    return sum;
}
