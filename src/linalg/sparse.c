/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides KLU (Davis and Palamadai Natarajan, ACM TOMS 37 (2010) 36): one analysis and one factorisation with pivoting.
 * Later values are refactored with the same pivots, until pivot growth shows that they no longer suit. */
#include "linalg/sparse.h"
#include "base/arena.h"
#include "base/memory.h"
#include "linalg/dense/dot.h"
#include "linalg/saddle_order.h"
#include <float.h>
#include <klu.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A refactorisation whose reciprocal pivot growth is below this fraction of the last pivoted one's is not kept. */
#define GROWTH_KEPT 1e-3
/* An off-diagonal pivot is taken where the diagonal entry is below this fraction of it. The first value serves matrices
 * that are factored once or seldom, the second the matrices of an integrator's iteration, where fill matters more than
 * accuracy. */
#define DIAGONAL_KEPT         0.1
#define DIAGONAL_OF_ITERATION 1e-3
/* Beyond this size the block-triangular form is left out: its matching takes n^2 in long chains, whose iteration matrix
 * is one block. */
enum { BLOCKS_UP_TO = 4000 };

/* Off-diagonal pivots that fill the factors of a saddle system beyond this multiple of the estimate show that its order
 * does not serve. */
#define MOST_FILL 2

struct kmp_sparse {
    kmp_arena arena;
    int n, nz;
    int64_t *start, *row; /* compressed columns */
    int *place;           /* position of each entry in them; NULL: in its own columns */
    double *value;
    klu_l_common common;
    klu_l_symbolic *symbolic;
    klu_l_numeric *numeric;
    int coordinates;   /* of a saddle system; 0: the order of elimination is final */
    int *group;        /* of its multipliers */
    double operations; /* of a factorisation and a solution */
    double growth;     /* reciprocal, of the last factorisation with pivoting */
    bool good;         /* the factors belong to the last values */
};

/* A matrix without entries; freed and NULL when there is no memory. */
static kmp_sparse *make(int n, int nz)
{
    kmp_sparse *s = KMP_NEW(kmp_sparse, 1);
    if (!s)
        return NULL;
    s->n = n;
    s->nz = nz;
    KMP_ARENA_MAKE(&s->arena, KMP_ROOM(int64_t, n + 1, &s->start), KMP_ROOM(int64_t, nz, &s->row),
                   KMP_ROOM(double, nz, &s->value));
    klu_l_defaults(&s->common);
    if (!s->arena.failed)
        return s;
    kmp_sparse_free(s);
    return NULL;
}

static void estimate(kmp_sparse *s)
{
    s->operations = s->symbolic->est_flops + 2 * (s->symbolic->lnz + s->symbolic->unz);
}

void kmp_sparse_compress(int n, int nz, const int *row, const int *col, int64_t *start, int64_t *rows, int *place)
{
    for (int k = 0; k < nz; k++)
        start[col[k] + 1]++;
    for (int j = 0; j < n; j++)
        start[j + 1] += start[j];
    for (int k = 0; k < nz; k++) {
        place[k] = (int)start[col[k]]++;
        rows[place[k]] = row[k];
    }
    for (int j = n; j > 0; j--)
        start[j] = start[j - 1];
    start[0] = 0;
}

kmp_sparse *kmp_sparse_new(int n, int nz, const int *row, const int *col, bool symmetric)
{
    kmp_sparse *s = make(n, nz);
    if (!s)
        return NULL;
    s->common.tol = DIAGONAL_KEPT;
    s->common.btf = !symmetric;
    s->place = KMP_ARENA_NEW(&s->arena, int, nz);
    if (s->place)
        kmp_sparse_compress(n, nz, row, col, s->start, s->row, s->place);
    s->symbolic = s->place && n > 0 ? klu_l_analyze(n, s->start, s->row, &s->common) : NULL;
    if (s->symbolic && (symmetric || s->symbolic->structural_rank == n)) {
        estimate(s);
        return s;
    }
    kmp_sparse_free(s);
    return NULL;
}

kmp_sparse *kmp_sparse_new_saddle(int n, int r, int nz, const int *row, const int *col, const int *group)
{
    kmp_sparse *s = kmp_sparse_new(n + r, nz, row, col, true);
    if (!s)
        return NULL;
    s->group = KMP_ARENA_NEW(&s->arena, int, r);
    if (!s->group) {
        kmp_sparse_free(s);
        return NULL;
    }
    if (r > 0)
        memcpy(s->group, group, (size_t)r * sizeof *group);
    s->coordinates = n;
    return s;
}

kmp_sparse *kmp_sparse_new_columns(int n, int nz)
{
    kmp_sparse *s = make(n, nz);
    if (s) {
        s->common.tol = DIAGONAL_OF_ITERATION;
        s->common.btf = n <= BLOCKS_UP_TO;
    }
    return s;
}

bool kmp_sparse_take_columns(kmp_sparse *s, const int64_t *start, const int64_t *row)
{
    s->nz = (int)start[s->n];
    memcpy(s->start, start, ((size_t)s->n + 1) * sizeof *start);
    memcpy(s->row, row, (size_t)s->nz * sizeof *row);
    s->symbolic = klu_l_analyze(s->n, s->start, s->row, &s->common);
    if (s->symbolic)
        estimate(s);
    return s->symbolic;
}

void kmp_sparse_free(kmp_sparse *s)
{
    if (!s)
        return;
    klu_l_free_numeric(&s->numeric, &s->common);
    klu_l_free_symbolic(&s->symbolic, &s->common);
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

double kmp_sparse_operations(const kmp_sparse *s)
{
    return s->operations;
}

/* In common.rgrowth. */
static bool measure_growth(kmp_sparse *s)
{
    return klu_l_rgrowth(s->start, s->row, s->value, s->symbolic, s->numeric, &s->common);
}

/* Refactors with the current pivots; false when they do not suit. */
static bool refactor(kmp_sparse *s)
{
    return s->numeric && klu_l_refactor(s->start, s->row, s->value, s->symbolic, s->numeric, &s->common) &&
           s->common.status == KLU_OK && measure_growth(s) && s->common.rgrowth >= GROWTH_KEPT * s->growth;
}

/* Factors with new pivots. */
static bool pivot(kmp_sparse *s)
{
    klu_l_free_numeric(&s->numeric, &s->common);
    s->numeric = klu_l_factor(s->start, s->row, s->value, s->symbolic, &s->common);
    return s->numeric && s->common.status == KLU_OK && measure_growth(s);
}

/* Operations of the present factors, as if L had the entries of U. */
static void count_operations(kmp_sparse *s)
{
    const klu_l_numeric *numeric = s->numeric;
    s->operations = 2.0 * (double)(numeric->lnz + numeric->unz);
    for (int k = 0; k < s->n; k++)
        s->operations += (double)numeric->Llen[k] * (double)(1 + 2 * numeric->Ulen[k]);
}

/* Takes an order in which the diagonal serves as pivots, once. The order stays as it is without memory. */
static void order_again(kmp_sparse *s)
{
    kmp_arena room = {0};
    int *row, *col;
    int64_t *order;
    const int n = s->coordinates;
    s->coordinates = 0;
    if (KMP_ARENA_MAKE(&room, KMP_ROOM(int, s->nz, &row, &col), KMP_ROOM(int64_t, s->n, &order))) {
        for (int j = 0; j < s->n; j++)
            for (int64_t e = s->start[j]; e < s->start[j + 1]; e++) {
                row[e] = (int)s->row[e];
                col[e] = j;
            }
        klu_l_symbolic *symbolic = kmp_saddle_order(n, s->n - n, s->nz, row, col, s->group, order)
                                       ? klu_l_analyze_given(s->n, s->start, s->row, order, order, &s->common)
                                       : NULL;
        if (symbolic) {
            klu_l_free_numeric(&s->numeric, &s->common);
            klu_l_free_symbolic(&s->symbolic, &s->common);
            s->symbolic = symbolic;
        }
    }
    kmp_arena_free(&room);
}

static bool factor(kmp_sparse *s)
{
    bool ok = pivot(s);
    if (ok && s->coordinates > 0 &&
        (double)(s->numeric->lnz + s->numeric->unz) > MOST_FILL * (s->symbolic->lnz + s->symbolic->unz)) {
        order_again(s);
        ok = pivot(s);
        if (ok)
            count_operations(s);
    }
    s->growth = ok ? s->common.rgrowth : 0;
    return ok;
}

kmp_sparse_outcome kmp_sparse_factor(kmp_sparse *s, const double *values)
{
    for (int k = 0; s->place && k < s->nz; k++)
        s->value[s->place[k]] = values[k];
    if (!s->place)
        memcpy(s->value, values, (size_t)s->nz * sizeof *values);
    s->good = refactor(s) || factor(s);
    if (s->good)
        return KMP_SPARSE_FACTORED;
    int status = (int)s->common.status;
    klu_l_free_numeric(&s->numeric, &s->common);
    return status == KLU_SINGULAR        ? KMP_SPARSE_SINGULAR
           : status == KLU_OUT_OF_MEMORY ? KMP_SPARSE_NO_MEMORY
                                         : KMP_SPARSE_FAILED;
}

int64_t kmp_sparse_fill(const kmp_sparse *s)
{
    return s->numeric ? s->numeric->lnz + s->numeric->unz + s->numeric->nzoff : 0;
}

void kmp_sort_entries(int n, int count, const int *col, int *start, int *order)
{
    for (int e = 0; e < count; e++)
        start[col[e] + 1]++;
    for (int k = 0; k < n; k++)
        start[k + 1] += start[k];
    for (int e = 0; e < count; e++)
        order[start[col[e]]++] = e;
    for (int k = n; k > 0; k--)
        start[k] = start[k - 1];
    start[0] = 0;
}

bool kmp_sparse_solve(kmp_sparse *s, int m, double *x)
{
    return s->good && klu_l_solve(s->symbolic, s->numeric, s->n, m, x, &s->common);
}

void kmp_sparse_norms(kmp_sparse *s, double *norm, double *inverse)
{
    *norm = 0;
    *inverse = INFINITY;
    for (int j = 0; j < s->n; j++) {
        double sum = 0;
        for (int64_t k = s->start[j]; k < s->start[j + 1]; k++)
            sum += fabs(s->value[k]);
        *norm = fmax(*norm, sum);
    }
    if (s->good && *norm > 0 && klu_l_condest(s->start, s->value, s->symbolic, s->numeric, &s->common))
        *inverse = s->common.condest / *norm;
}

/* -- complete pivoting ------------------------------------------------------------------------------- */

/* Complete pivoting of a sparse matrix. Rows hold their entries, columns the indices of their rows, and a heap the rows
 * by their largest entry; a pivot touches only the rows of its column. Entries are formed by the operations of the
 * dense elimination in its order. Products with a zero are left out, which changes no number, so that results equal the
 * dense ones.
 *
 * If that takes too many products, elimination restarts with thresholds. Among the rows with an entry within the
 * threshold it takes one with the fewest entries, and of these entries the one whose column has the fewest rows. When
 * none are left, the next threshold is a fraction of the largest entry then. */

/* Beyond this number of products for each entry, row and column, or this multiple of entries that are looked at,
 * thresholds are taken, of this part of the largest entry. */
enum { PRODUCTS_EACH = 40, LOOKS = 4 };
#define THRESHOLD 0.25

typedef struct entry {
    int col;
    double value;
} entry;

typedef struct list {
    int count, room;
} list;

typedef struct rank {
    double pivot;
    int r, c;
    bool fixed;
} rank;

typedef struct work {
    kmp_arena arena;
    int m, n;
    const int *fixed;
    entry **entries; /* of each row, in the remaining columns */
    list *row;
    int **rows; /* of each column; eliminated rows are skipped */
    list *column;
    bool *row_gone, *column_gone;
    int *best;           /* of a row: its largest entry, -1 when it has none */
    int *heap, *heap_at; /* rows, the best first; position of a row, -1 when it is not in the heap */
    int heap_count;
    int *place; /* column -> 1 + its position in the current row, 0 when absent */
    int *r_at, *c_at, *r, *c;
    int64_t products, most_products, looks;
    bool exhausted;

    bool relaxed;                /* by thresholds; the members below are only for that */
    double threshold, began_at;  /* the threshold, and the largest entry when it was set */
    bool of_fixed;               /* columns that the threshold applies to */
    int *users;                  /* of a column: its remaining rows */
    int *bucket, *next, *before; /* rows within the threshold by their entries: n + 1 lists; -1: none */
    bool *in_bucket;
    int lowest; /* no list before it has a row */
    rank *ranks;
} work;

static bool grow(work *w, void **p, list *l, size_t size)
{
    if (l->count < l->room)
        return true;
    int room = l->room ? 2 * l->room : 4;
    void *more = kmp_arena_alloc(&w->arena, (size_t)room, size);
    if (!more)
        return false;
    if (l->count > 0)
        memcpy(more, *p, (size_t)l->count * size);
    *p = more;
    l->room = room;
    return true;
}

static bool add_entry(work *w, int i, int j, double value)
{
    void *entries = w->entries[i], *rows = w->rows[j];
    bool ok = grow(w, &entries, &w->row[i], sizeof **w->entries);
    w->entries[i] = entries;
    ok = ok && grow(w, &rows, &w->column[j], sizeof **w->rows);
    w->rows[j] = rows;
    if (!ok)
        return false;
    w->users[j]++;
    w->entries[i][w->row[i].count++] = (entry){j, value};
    w->rows[j][w->column[j].count++] = i;
    return true;
}

static bool is_fixed(const work *w, int j)
{
    return w->fixed && w->fixed[j];
}

/* -- choice of the next entry ------------------------------------------------------------------------ */

/* A free column before a fixed one, then the larger entry, then the smaller column, then row. Zeros are not candidates.
 */
static bool better(const work *w, entry x, int x_row, entry y, int y_row)
{
    bool x_fixed = is_fixed(w, x.col), y_fixed = is_fixed(w, y.col);
    if (x_fixed != y_fixed)
        return y_fixed;
    double x_size = fabs(x.value), y_size = fabs(y.value);
    if (x_size < y_size || x_size > y_size)
        return x_size > y_size;
    return x.col != y.col ? x.col < y.col : x_row < y_row;
}

static bool goes_before(const work *w, int a, int b)
{
    return better(w, w->entries[a][w->best[a]], a, w->entries[b][w->best[b]], b);
}

static void put(work *w, int at, int i)
{
    w->heap[at] = i;
    w->heap_at[i] = at;
}

/* The row at `at` to where it belongs. */
static void settle(work *w, int at)
{
    int i = w->heap[at];
    for (; at > 0 && goes_before(w, i, w->heap[(at - 1) / 2]); at = (at - 1) / 2)
        put(w, at, w->heap[(at - 1) / 2]);
    for (int below; (below = 2 * at + 1) < w->heap_count; at = below) {
        if (below + 1 < w->heap_count && goes_before(w, w->heap[below + 1], w->heap[below]))
            below++;
        if (!goes_before(w, w->heap[below], i))
            break;
        put(w, at, w->heap[below]);
    }
    put(w, at, i);
}

static bool within(const work *w, entry e)
{
    return is_fixed(w, e.col) == w->of_fixed && fabs(e.value) >= w->threshold;
}

static void put_in_bucket(work *w, int i)
{
    int size = w->row[i].count;
    if (!within(w, w->entries[i][w->best[i]]))
        return;
    w->in_bucket[i] = true;
    w->before[i] = -1;
    w->next[i] = w->bucket[size];
    if (w->next[i] >= 0)
        w->before[w->next[i]] = i;
    w->bucket[size] = i;
    w->lowest = size < w->lowest ? size : w->lowest;
}

/* Before the row's entries change. */
static void take_from_bucket(work *w, int i)
{
    if (!w->in_bucket[i])
        return;
    w->in_bucket[i] = false;
    if (w->before[i] >= 0)
        w->next[w->before[i]] = w->next[i];
    else
        w->bucket[w->row[i].count] = w->next[i];
    if (w->next[i] >= 0)
        w->before[w->next[i]] = w->before[i];
}

static void take_out(work *w, int i)
{
    int at = w->heap_at[i];
    take_from_bucket(w, i);
    w->heap_at[i] = -1;
    if (at < 0 || at == --w->heap_count)
        return;
    put(w, at, w->heap[w->heap_count]);
    settle(w, at);
}

/* After the row's entries have changed. It must be out of the heap. */
static void put_back(work *w, int i)
{
    /* The best entry of the row. */
    w->best[i] = -1;
    w->looks += w->row[i].count;
    for (int k = 0; k < w->row[i].count; k++) {
        entry e = w->entries[i][k];
        if (fabs(e.value) > 0 && (w->best[i] < 0 || better(w, e, i, w->entries[i][w->best[i]], i)))
            w->best[i] = k;
    }
    if (w->best[i] < 0)
        return;
    put(w, w->heap_count++, i);
    settle(w, w->heap_count - 1);
    if (w->relaxed)
        put_in_bucket(w, i);
}

static entry best_of(const work *w, int i)
{
    return w->entries[i][w->best[i]];
}

/* A row with the fewest entries among those within the threshold; at least one exists. */
static int shortest_row(work *w)
{
    while (w->lowest <= w->n && w->bucket[w->lowest] < 0)
        w->lowest++;
    entry largest = best_of(w, w->heap[0]);
    bool grown = fabs(largest.value) * THRESHOLD > w->began_at || is_fixed(w, largest.col) != w->of_fixed;
    if (w->lowest <= w->n && !grown)
        return w->bucket[w->lowest];
    /* The next threshold, and the rows within it. */
    w->began_at = fabs(largest.value);
    w->threshold = THRESHOLD * w->began_at;
    w->of_fixed = is_fixed(w, largest.col);
    for (int k = 0; k < w->heap_count; k++) {
        take_from_bucket(w, w->heap[k]);
        put_in_bucket(w, w->heap[k]);
    }
    while (w->bucket[w->lowest] < 0)
        w->lowest++;
    return w->bucket[w->lowest];
}

/* The entry of row i, within the threshold, whose column has the fewest rows. */
static entry rarest_entry(const work *w, int i)
{
    entry found = best_of(w, i);
    for (int k = 0; k < w->row[i].count; k++) {
        entry e = w->entries[i][k];
        if (within(w, e) && (w->users[e.col] < w->users[found.col] ||
                             (w->users[e.col] == w->users[found.col] && better(w, e, i, found, i))))
            found = e;
    }
    return found;
}

/* The next pivot; false when nothing but zeros is left. */
static bool choose(work *w, int *i, entry *pivot)
{
    if (w->heap_count == 0)
        return false;
    *i = w->relaxed ? shortest_row(w) : w->heap[0];
    *pivot = w->relaxed ? rarest_entry(w, *i) : best_of(w, *i);
    return true;
}

/* -- elimination ------------------------------------------------------------------------------------- */

/* Subtracts a multiple of the pivot row from row i; the entries in column j have been removed from both. */
static bool subtract(work *w, int i, double multiple, int pivot_row)
{
    for (int k = 0; k < w->row[i].count; k++)
        w->place[w->entries[i][k].col] = 1 + k;
    bool ok = true;
    for (int k = 0; ok && k < w->row[pivot_row].count; k++) {
        entry u = w->entries[pivot_row][k];
        int at = w->place[u.col];
        w->products++;
        if (at)
            w->entries[i][at - 1].value -= multiple * u.value;
        else if (fabs(u.value) > 0)
            ok = add_entry(w, i, u.col, 0 - multiple * u.value);
    }
    for (int k = 0; k < w->row[i].count; k++)
        w->place[w->entries[i][k].col] = 0;
    return ok;
}

/* The value of column j in row i, which leaves the row; 0 when there is none. */
static double remove_entry(work *w, int i, int j)
{
    for (int k = 0; k < w->row[i].count; k++)
        if (w->entries[i][k].col == j) {
            double value = w->entries[i][k].value;
            w->entries[i][k] = w->entries[i][--w->row[i].count];
            w->users[j]--;
            return value;
        }
    return 0;
}

static bool eliminate(work *w, int i, int j)
{
    double pivot = remove_entry(w, i, j);
    for (int k = 0; k < w->column[j].count; k++) {
        int other = w->rows[j][k];
        if (w->row_gone[other] || other == i)
            continue;
        take_out(w, other);
        double multiple = remove_entry(w, other, j) / pivot;
        if (fabs(multiple) > 0 && !subtract(w, other, multiple, i))
            return false;
        put_back(w, other);
    }
    w->exhausted = !w->relaxed && (w->products > w->most_products || w->looks > LOOKS * w->most_products);
    return !w->exhausted;
}

/* The exchange of places that the dense elimination makes. */
static void exchange(int *order, int *at, int k, int which)
{
    int from = at[which], moved = order[k];
    order[k] = which;
    order[from] = moved;
    at[which] = k;
    at[moved] = from;
}

static void retire(work *w, int k, int i, int j)
{
    exchange(w->r, w->r_at, k, i);
    exchange(w->c, w->c_at, k, j);
    take_out(w, i);
    for (int e = 0; e < w->row[i].count; e++)
        w->users[w->entries[i][e].col]--;
    w->row_gone[i] = true;
    w->column_gone[j] = true;
}

/* The first index that is not eliminated; -1: none. `from` is the index to begin with next time. */
static int first_left(const bool *gone, int count, const int *fixed, bool want_fixed, int *from)
{
    while (*from < count && (gone[*from] || (fixed && fixed[*from]) != want_fixed))
        ++*from;
    return *from < count ? *from : -1;
}

static bool pivot_all(work *w, double *pivots)
{
    int next_row = 0, next_free = 0, next_fixed = 0;
    for (int k = 0; k < w->m && k < w->n; k++) {
        int free_left = first_left(w->column_gone, w->n, w->fixed, false, &next_free);
        int i;
        entry pivot;
        pivots[k] = 0;
        if (choose(w, &i, &pivot) && (free_left < 0 || !is_fixed(w, pivot.col))) {
            pivots[k] = fabs(pivot.value);
            retire(w, k, i, pivot.col);
            if (pivots[k] <= DBL_MAX && !eliminate(w, i, pivot.col))
                return false;
            continue;
        }
        /* Nothing but zeros is left, of free columns if there are any. */
        int j = free_left >= 0 ? free_left : first_left(w->column_gone, w->n, w->fixed, true, &next_fixed);
        retire(w, k, first_left(w->row_gone, w->m, NULL, false, &next_row), j);
    }
    return true;
}

/* -- by size ----------------------------------------------------------------------------------------- */

static int by_size(const void *a, const void *b)
{
    const rank *x = a, *y = b;
    if (x->fixed != y->fixed)
        return x->fixed ? 1 : -1;
    if (x->pivot < y->pivot || x->pivot > y->pivot)
        return x->pivot > y->pivot ? -1 : 1;
    return (x->c > y->c) - (x->c < y->c);
}

/* -- the whole --------------------------------------------------------------------------------------- */

static void reset(work *w)
{
    for (int i = 0; i < w->m; i++) {
        w->r[i] = w->r_at[i] = i;
        w->row[i].count = 0;
        w->row_gone[i] = w->in_bucket[i] = false;
        w->heap_at[i] = -1;
    }
    for (int j = 0; j < w->n; j++) {
        w->c[j] = w->c_at[j] = j;
        w->column[j].count = w->users[j] = w->place[j] = 0;
        w->column_gone[j] = false;
    }
    for (int k = 0; k <= w->n; k++)
        w->bucket[k] = -1;
    w->heap_count = 0;
    w->lowest = w->n + 1;
    w->threshold = INFINITY; /* until the first is set */
}

static bool run(work *w, const kmp_entries *a, bool relaxed, double *pivots)
{
    w->relaxed = relaxed;
    w->exhausted = false;
    bool ok = true;
    reset(w);
    for (int k = 0; ok && k < a->nz; k++)
        if (fabs(a->value[k]) > 0)
            ok = add_entry(w, a->row[k], a->col[k], a->value[k]);
    for (int i = 0; ok && i < w->m; i++)
        put_back(w, i);
    return ok && pivot_all(w, pivots);
}

/* All pivots are NaN when an entry is not finite. false: no memory. */
static bool find_pivots(work *w, const kmp_entries *a, double *pivots)
{
    if (!kmp_all_finite(a->nz, a->value)) {
        reset(w);
        for (int k = 0; k < a->m && k < a->n; k++)
            pivots[k] = NAN;
        return true;
    }
    if (run(w, a, false, pivots))
        return true;
    if (!w->exhausted || !run(w, a, true, pivots))
        return false;
    int count = w->m < w->n ? w->m : w->n;
    for (int k = 0; k < count; k++)
        w->ranks[k] = (rank){pivots[k], w->r[k], w->c[k], is_fixed(w, w->c[k])};
    if (count > 0)
        qsort(w->ranks, (size_t)count, sizeof *w->ranks, by_size);
    for (int k = 0; k < count; k++) {
        pivots[k] = w->ranks[k].pivot;
        w->r[k] = w->ranks[k].r;
        w->c[k] = w->ranks[k].c;
    }
    return true;
}

bool kmp_sparse_complete(const kmp_entries *a, const int *fixed, int *r, int *c, double *pivots, int64_t *products)
{
    work w = {.m = a->m, .n = a->n, .fixed = fixed, .r = r, .c = c};
    w.most_products = PRODUCTS_EACH * ((int64_t)a->nz + a->m + a->n);
    const int m = a->m, n = a->n;
    bool ok = KMP_ARENA_MAKE(&w.arena, KMP_ROOM(entry *, m, &w.entries), KMP_ROOM(list, m, &w.row),
                             KMP_ROOM(int *, n, &w.rows), KMP_ROOM(list, n, &w.column),
                             KMP_ROOM(rank, m < n ? m : n, &w.ranks), KMP_ROOM(bool, n, &w.column_gone),
                             KMP_ROOM(bool, m, &w.row_gone, &w.in_bucket),
                             KMP_ROOM(int, m, &w.best, &w.heap, &w.heap_at, &w.r_at, &w.next, &w.before),
                             KMP_ROOM(int, n + 1, &w.place, &w.c_at, &w.users, &w.bucket)) &&
              find_pivots(&w, a, pivots);
    if (products)
        *products = w.products;
    kmp_arena_free(&w.arena);
    return ok;
}
