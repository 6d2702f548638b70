/* SPDX-License-Identifier: BSD-3-Clause */
/* Complete pivoting of a sparse matrix. Rows hold their entries, columns the rows that stand in them, and a heap the
 * rows by their largest entry; a pivot touches the rows of its column alone. Entries are formed by the operations of
 * the dense elimination in its order, so that nothing tells the two apart: a product with a zero is left out, which
 * changes no number. */
#include "base/memory.h"
#include "linalg/sparse.h"
#include <float.h>
#include <math.h>
#include <string.h>

typedef struct entry {
    int col;
    double value;
} entry;

typedef struct list {
    int count, room;
} list;

typedef struct work {
    int m, n;
    const int *fixed;
    entry **entries; /* of each row, of columns that are left */
    list *row;
    int **rows; /* of each column; those that are gone are skipped */
    list *column;
    bool *row_gone, *column_gone;
    int *best;           /* of a row: its largest entry, -1 when it has none */
    int *heap, *heap_at; /* rows, the best first; place of a row, -1 when it is out */
    int heap_count;
    int *place; /* column -> 1 + its place in the row at hand, 0 when absent */
    int *r_at, *c_at, *r, *c;
    long products;
} work;

static bool grow(void **p, list *l, size_t size)
{
    if (l->count < l->room)
        return true;
    int room = l->room ? 2 * l->room : 4;
    void *more = kmp_realloc(*p, (size_t)room, size);
    if (!more)
        return false;
    *p = more;
    l->room = room;
    return true;
}

static bool add_entry(work *w, int i, int j, double value)
{
    void *entries = w->entries[i], *rows = w->rows[j];
    bool ok = grow(&entries, &w->row[i], sizeof **w->entries);
    w->entries[i] = entries;
    ok = ok && grow(&rows, &w->column[j], sizeof **w->rows);
    w->rows[j] = rows;
    if (!ok)
        return false;
    w->entries[i][w->row[i].count++] = (entry){j, value};
    w->rows[j][w->column[j].count++] = i;
    return true;
}

static bool is_fixed(const work *w, int j)
{
    return w->fixed && w->fixed[j];
}

/* -- which entry goes first -------------------------------------------------------------------------- */

/* A free column before a fixed one, then the larger entry, then the smaller column, then row. Zeros are no candidates.
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

static void find_best(work *w, int i)
{
    w->best[i] = -1;
    for (int k = 0; k < w->row[i].count; k++) {
        entry e = w->entries[i][k];
        if (fabs(e.value) > 0 && (w->best[i] < 0 || better(w, e, i, w->entries[i][w->best[i]], i)))
            w->best[i] = k;
    }
}

static bool before(const work *w, int a, int b)
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
    for (; at > 0 && before(w, i, w->heap[(at - 1) / 2]); at = (at - 1) / 2)
        put(w, at, w->heap[(at - 1) / 2]);
    for (int below; (below = 2 * at + 1) < w->heap_count; at = below) {
        if (below + 1 < w->heap_count && before(w, w->heap[below + 1], w->heap[below]))
            below++;
        if (!before(w, w->heap[below], i))
            break;
        put(w, at, w->heap[below]);
    }
    put(w, at, i);
}

static void take_out(work *w, int i)
{
    int at = w->heap_at[i];
    w->heap_at[i] = -1;
    if (at < 0 || at == --w->heap_count)
        return;
    put(w, at, w->heap[w->heap_count]);
    settle(w, at);
}

/* After the row's entries have changed. It must be out of the heap. */
static void put_back(work *w, int i)
{
    find_best(w, i);
    if (w->best[i] < 0)
        return;
    put(w, w->heap_count++, i);
    settle(w, w->heap_count - 1);
}

/* -- elimination ------------------------------------------------------------------------------------- */

/* Row i less its multiple of the pivot row, whose entry in column j has gone from both. */
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
    return true;
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
    w->row_gone[i] = true;
    w->column_gone[j] = true;
}

/* The first that is not gone; -1: none. `from` is where to look next time. */
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
        int i = w->heap_count > 0 ? w->heap[0] : -1, j = i >= 0 ? w->entries[i][w->best[i]].col : -1;
        pivots[k] = 0;
        if (i >= 0 && (free_left < 0 || !is_fixed(w, j))) {
            double pivot = fabs(w->entries[i][w->best[i]].value);
            pivots[k] = pivot;
            retire(w, k, i, j);
            if (pivot <= DBL_MAX && !eliminate(w, i, j))
                return false;
            continue;
        }
        /* Nothing but zeros is left, of free columns if there are any. */
        j = free_left >= 0 ? free_left : first_left(w->column_gone, w->n, w->fixed, true, &next_fixed);
        retire(w, k, first_left(w->row_gone, w->m, NULL, false, &next_row), j);
    }
    return true;
}

/* -- all together ------------------------------------------------------------------------------------ */

static bool allocate(work *w)
{
    w->entries = KMP_NEW(entry *, w->m);
    w->row = KMP_NEW(list, w->m);
    w->rows = KMP_NEW(int *, w->n);
    w->column = KMP_NEW(list, w->n);
    w->row_gone = KMP_NEW(bool, w->m);
    w->column_gone = KMP_NEW(bool, w->n);
    w->best = KMP_NEW(int, w->m);
    w->heap = KMP_NEW(int, w->m);
    w->heap_at = KMP_NEW(int, w->m);
    w->place = KMP_NEW(int, w->n);
    w->r_at = KMP_NEW(int, w->m);
    w->c_at = KMP_NEW(int, w->n);
    return w->entries && w->row && w->rows && w->column && w->row_gone && w->column_gone && w->best && w->heap &&
           w->heap_at && w->place && w->r_at && w->c_at;
}

static void release(work *w)
{
    for (int i = 0; w->entries && i < w->m; i++)
        kmp_free(w->entries[i]);
    for (int j = 0; w->rows && j < w->n; j++)
        kmp_free(w->rows[j]);
    void *arrays[] = {w->entries, w->row,  w->rows,    w->column, w->row_gone, w->column_gone,
                      w->best,    w->heap, w->heap_at, w->place,  w->r_at,     w->c_at};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
}

static bool load(work *w, int nz, const int *row, const int *col, const double *value)
{
    bool ok = true;
    for (int k = 0; ok && k < nz; k++)
        if (fabs(value[k]) > 0)
            ok = add_entry(w, row[k], col[k], value[k]);
    for (int i = 0; ok && i < w->m; i++) {
        w->heap_at[i] = -1;
        put_back(w, i);
    }
    return ok;
}

static bool all_finite(int count, const double *x)
{
    for (int k = 0; k < count; k++)
        if (!isfinite(x[k]))
            return false;
    return true;
}

bool kmp_sparse_complete(int m, int n, int nz, const int *row, const int *col, const double *value, const int *fixed,
                         int *r, int *c, double *pivots, long *products)
{
    work w = {.m = m, .n = n, .fixed = fixed, .r = r, .c = c};
    bool ok = allocate(&w), finite = all_finite(nz, value);
    for (int i = 0; ok && i < m; i++)
        r[i] = w.r_at[i] = i;
    for (int j = 0; ok && j < n; j++)
        c[j] = w.c_at[j] = j;
    for (int k = 0; ok && !finite && k < m && k < n; k++)
        pivots[k] = NAN;
    ok = ok && (!finite || (load(&w, nz, row, col, value) && pivot_all(&w, pivots)));
    if (ok && products)
        *products = w.products;
    release(&w);
    return ok;
}
