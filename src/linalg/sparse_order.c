/* SPDX-License-Identifier: BSD-3-Clause */
/* Pivots in an order that is kept. Threshold complete pivoting finds the order, and where each row of the elimination
 * has its entries is written down; after that values alone are computed, row by row,
 *
 *     l_kj = x_j / u_jj for the pivots j before k,   x -= l_kj u_j,   u_k = x
 *
 * and every pivot is held against its column (the multipliers l) and its row (the entries of u): threshold rook
 * pivoting (Gill, Murray, Saunders, SIAM Review 47 (2005) 99, section 3), which tells rank nearly as well. Where a
 * pivot has become too small for that, the order is sought anew. */
#include "base/memory.h"
#include "linalg/sparse.h"
#include <math.h>
#include <string.h>

/* Entries of a pivot's row and column may be larger than it by this. */
#define MOST_OF_PIVOT 4.0
enum { END = -1 };

typedef struct rows { /* positions of entries, row by row */
    int *start, *at, room;
} rows;

struct kmp_order {
    kmp_pivoting *pivoting;
    int rows_made, columns_made;
    bool kept; /* there is an order, of these entries: */
    int m, n, nz, rank;
    int *row, *col, entry_room;
    int *r, *c;               /* rows and columns in the order of elimination */
    int *place, *row_place;   /* of a column, of a row: its position in it */
    int *first_entry, *entry; /* entries sorted by the position of their row */
    rows lower, upper;        /* upper: the pivot first */
    double *value;            /* of upper */
    double *x, *pivot;
    int *next; /* n + 1: columns of the row at hand as a list */
    long searches, products;
};

void kmp_order_free(kmp_order *o)
{
    if (!o)
        return;
    void *arrays[] = {o->row,         o->col,   o->r,           o->c,        o->place, o->row_place,
                      o->first_entry, o->entry, o->lower.start, o->lower.at, o->value, o->upper.start,
                      o->upper.at,    o->x,     o->pivot,       o->next};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
    kmp_pivoting_free(o->pivoting);
    kmp_free(o);
}

kmp_order *kmp_order_new(int m, int n)
{
    kmp_order *o = KMP_NEW(kmp_order, 1);
    if (!o)
        return NULL;
    o->rows_made = m;
    o->columns_made = n;
    o->pivoting = kmp_pivoting_new(m, n);
    o->r = KMP_NEW(int, m);
    o->c = KMP_NEW(int, n);
    o->place = KMP_NEW(int, n);
    o->row_place = KMP_NEW(int, m);
    o->first_entry = KMP_NEW(int, m + 2);
    o->lower.start = KMP_NEW(int, m + 1);
    o->upper.start = KMP_NEW(int, m + 1);
    o->x = KMP_NEW(double, n);
    o->pivot = KMP_NEW(double, m);
    o->next = KMP_NEW(int, n + 1);
    if (o->pivoting && o->r && o->c && o->place && o->row_place && o->first_entry && o->lower.start && o->upper.start &&
        o->x && o->pivot && o->next)
        return o;
    kmp_order_free(o);
    return NULL;
}

/* -- where entries stand ----------------------------------------------------------------------------- */

static bool reserve(void **p, int *room, int wanted, size_t size)
{
    if (wanted <= *room)
        return true;
    int more = wanted > 2 * *room ? wanted : 2 * *room;
    void *grown = kmp_realloc(*p, (size_t)more, size);
    if (!grown)
        return false;
    *p = grown;
    *room = more;
    return true;
}

static bool append(rows *list, int *count, int at)
{
    void *all = list->at;
    bool ok = reserve(&all, &list->room, *count + 1, sizeof *list->at);
    list->at = all;
    if (ok)
        list->at[(*count)++] = at;
    return ok;
}

static bool copy_entries(kmp_order *o, const kmp_entries *a)
{
    int room = o->entry_room, room_of_col = room, room_of_entry = room;
    void *row = o->row, *col = o->col, *entry = o->entry;
    bool ok = reserve(&row, &room, a->nz, sizeof *o->row);
    o->row = row;
    ok = ok && reserve(&col, &room_of_col, a->nz, sizeof *o->col);
    o->col = col;
    ok = ok && reserve(&entry, &room_of_entry, a->nz, sizeof *o->entry);
    o->entry = entry;
    if (!ok)
        return false;
    o->entry_room = room;
    o->m = a->m;
    o->n = a->n;
    o->nz = a->nz;
    memcpy(o->row, a->row, (size_t)a->nz * sizeof *o->row);
    memcpy(o->col, a->col, (size_t)a->nz * sizeof *o->col);
    return true;
}

static bool same_entries(const kmp_order *o, const kmp_entries *a, int rank)
{
    return o->kept && o->rank == rank && o->m == a->m && o->n == a->n && o->nz == a->nz &&
           memcmp(o->row, a->row, (size_t)a->nz * sizeof *o->row) == 0 &&
           memcmp(o->col, a->col, (size_t)a->nz * sizeof *o->col) == 0;
}

static void sort_entries(kmp_order *o)
{
    for (int k = 0; k < o->n; k++)
        o->place[o->c[k]] = k;
    for (int k = 0; k < o->m; k++)
        o->row_place[o->r[k]] = k;
    memset(o->first_entry, 0, (size_t)(o->m + 2) * sizeof *o->first_entry);
    for (int e = 0; e < o->nz; e++)
        o->first_entry[o->row_place[o->row[e]] + 2]++;
    for (int k = 0; k < o->m; k++)
        o->first_entry[k + 2] += o->first_entry[k + 1];
    for (int e = 0; e < o->nz; e++)
        o->entry[o->first_entry[o->row_place[o->row[e]] + 1]++] = e;
}

/* A column into the ascending list behind `before`, n standing for its head; returns where it is. */
static int insert(kmp_order *o, int before, int column)
{
    int *next = o->next;
    while (next[before] != END && next[before] < column)
        before = next[before];
    if (next[before] != column) {
        next[column] = next[before];
        next[before] = column;
    }
    return column;
}

/* Columns of row k of the elimination: those before it and before the rank into lower, the others into upper. */
static bool write_row(kmp_order *o, int k, int *lower, int *upper)
{
    int *next = o->next, head = o->n, last = k < o->rank ? k : o->rank;
    next[head] = END;
    for (int e = o->first_entry[k]; e < o->first_entry[k + 1]; e++)
        (void)insert(o, head, o->place[o->col[o->entry[e]]]);
    int j = next[head];
    for (; j != END && j < last; j = next[j]) {
        if (!append(&o->lower, lower, j))
            return false;
        int at = j;
        for (int u = o->upper.start[j] + 1; u < o->upper.start[j + 1]; u++)
            at = insert(o, at, o->upper.at[u]);
    }
    if (k < o->rank && j != k) /* no pivot stands there */
        return false;
    for (; j != END; j = next[j])
        if (!append(&o->upper, upper, j))
            return false;
    return true;
}

static bool write_rows(kmp_order *o)
{
    int lower = 0, upper = 0;
    sort_entries(o);
    for (int k = 0; k < o->m; k++) {
        o->lower.start[k] = lower;
        o->upper.start[k] = upper;
        if (!write_row(o, k, &lower, &upper))
            return false;
        o->lower.start[k + 1] = lower;
        o->upper.start[k + 1] = upper;
    }
    kmp_free(o->value);
    o->value = KMP_NEW(double, upper);
    return o->value;
}

/* -- values ------------------------------------------------------------------------------------------ */

/* x, the k-th row, less the rows before it; false when a multiplier is too large. */
static bool reduce(kmp_order *o, int k)
{
    for (int e = o->lower.start[k]; e < o->lower.start[k + 1]; e++) {
        int j = o->lower.at[e], first = o->upper.start[j], end = o->upper.start[j + 1];
        double l = o->x[j] / o->value[first];
        o->x[j] = 0;
        if (!(fabs(l) <= MOST_OF_PIVOT))
            return false;
        for (int u = first + 1; u < end; u++)
            o->x[o->upper.at[u]] -= l * o->value[u];
        o->products += end - first;
    }
    return true;
}

/* The largest entry of x in the k-th row, which moves into its place; *first: that of the pivot. */
static double store(kmp_order *o, int k, double *first)
{
    double largest = 0;
    int begin = o->upper.start[k], end = o->upper.start[k + 1];
    for (int u = begin; u < end; u++) {
        double value = o->x[o->upper.at[u]];
        o->x[o->upper.at[u]] = 0;
        o->value[u] = value;
        largest = isfinite(value) ? fmax(largest, fabs(value)) : INFINITY;
    }
    *first = end > begin ? fabs(o->value[begin]) : 0;
    return largest;
}

/* All rows in the order at hand; false when it does not suit. */
static bool follow(kmp_order *o, const double *value)
{
    double least = INFINITY;
    o->products = 0;
    memset(o->x, 0, (size_t)o->n * sizeof *o->x);
    for (int k = 0; k < o->m; k++) {
        double pivot;
        for (int e = o->first_entry[k]; e < o->first_entry[k + 1]; e++)
            o->x[o->place[o->col[o->entry[e]]]] = value[o->entry[e]];
        if (!reduce(o, k))
            return false;
        double largest = store(o, k, &pivot);
        if (k < o->rank) {
            if (!(pivot > 0 && largest <= MOST_OF_PIVOT * pivot))
                return false;
            least = fmin(least, pivot);
            o->pivot[k] = pivot;
        } else if (!(largest <= MOST_OF_PIVOT * least)) { /* a row that is left must not be better than those taken */
            return false;
        }
    }
    return true;
}

/* Sought anew, and kept where it can be. */
static bool search(kmp_order *o, const kmp_entries *a, int rank)
{
    o->kept = false;
    o->searches++;
    if (!copy_entries(o, a) || !kmp_pivoting_run_loosely(o->pivoting, a, o->r, o->c, o->pivot))
        return false;
    o->rank = rank;
    o->products = kmp_pivoting_products(o->pivoting);
    bool full = rank <= a->m && rank <= a->n && (rank == 0 || (o->pivot[rank - 1] > 0 && isfinite(o->pivot[rank - 1])));
    unsigned long failures = kmp_memory_failures();
    o->kept = full && write_rows(o);
    return kmp_memory_failures() == failures;
}

bool kmp_order_run(kmp_order *o, const kmp_entries *a, int rank, const int **r, const int **c, const double **pivots)
{
    if ((!same_entries(o, a, rank) || !follow(o, a->value)) && !search(o, a, rank))
        return false;
    *r = o->r;
    *c = o->c;
    *pivots = o->pivot;
    return true;
}

void kmp_order_extremes(const double *pivots, int count, double *largest, double *least)
{
    *largest = count > 0 ? pivots[0] : 1;
    *least = *largest;
    for (int k = 1; k < count; k++) {
        *largest = pivots[k] > *largest || isnan(pivots[k]) ? pivots[k] : *largest;
        *least = pivots[k] < *least || isnan(pivots[k]) ? pivots[k] : *least;
    }
}

long kmp_order_searches(const kmp_order *o)
{
    return o->searches;
}

long kmp_order_products(const kmp_order *o)
{
    return o->products;
}
