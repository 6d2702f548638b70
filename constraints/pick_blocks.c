/* SPDX-License-Identifier: BSD-3-Clause */
/* Exchanges in a large J: in each of the blocks that share no row and no column for itself. */
#include "constraints/pick_blocks.h"
#include "base/memory.h"
#include "base/roots.h"
#include "linalg/sparse.h"
#include <math.h>
#include <string.h>

/* After an exchange of an entry of B of this size it is computed anew. */
#define LONG_DUE 100.0

/* -- one large block: its first r columns against the others, all of its r rows ----------------------- */

typedef struct tableau {
    int r, p;
    double *b;    /* r x p: Bvu */
    double *most; /* p: largest of each column, and where */
    int *at;
    double *moved; /* r */
} tableau;

static bool tableau_init(tableau *t, int r, int p)
{
    *t = (tableau){.r = r, .p = p};
    t->b = KMP_NEW(double, (size_t)r *(size_t)p);
    t->most = KMP_NEW(double, p);
    t->at = KMP_NEW(int, p);
    t->moved = KMP_NEW(double, r);
    return t->b && t->most && t->at && t->moved;
}

static void tableau_free(tableau *t)
{
    kmp_free(t->b);
    kmp_free(t->most);
    kmp_free(t->at);
    kmp_free(t->moved);
}

static double *column_of(const tableau *t, int k)
{
    return t->b + (size_t)k * (size_t)t->r;
}

static void look_through(tableau *t, int k)
{
    const double *b = column_of(t, k);
    t->most[k] = 0;
    t->at[k] = 0;
    for (int i = 0; i < t->r; i++)
        if (fabs(b[i]) > t->most[k]) {
            t->most[k] = fabs(b[i]);
            t->at[k] = i;
        }
}

/* The column with the largest entry. */
static int worst_column(const tableau *t)
{
    int worst = 0;
    for (int k = 1; k < t->p; k++)
        if (t->most[k] > t->most[worst])
            worst = k;
    return worst;
}

/* v_i and u_k change places: v = B u solved for u_k and put into the other rows. */
static void exchange(tableau *t, int i, int k)
{
    double *b = column_of(t, k), pivot = b[i];
    memcpy(t->moved, b, (size_t)t->r * sizeof *b);
    for (int c = 0; c < t->p; c++) {
        double *other = column_of(t, c), part = other[i] / pivot;
        if (c == k || !(fabs(part) > 0))
            continue;
        for (int j = 0; j < t->r; j++)
            other[j] -= t->moved[j] * part;
        other[i] = -part;
        look_through(t, c);
    }
    for (int j = 0; j < t->r; j++)
        b[j] = t->moved[j] / pivot;
    b[i] = 1 / pivot;
    look_through(t, k);
}

/* Jv factored; NULL: singular or no memory. */
static kmp_sparse *factor_jv(const kmp_pick *c, int r)
{
    int count = 0, *place = KMP_NEW(int, c->n), *row = KMP_NEW(int, c->nz), *col = KMP_NEW(int, c->nz);
    double *value = KMP_NEW(double, c->nz);
    kmp_sparse *jv = NULL;
    if (place && row && col && value) {
        for (int k = 0; k < c->n; k++)
            place[c->col[k]] = k;
        for (int e = 0; e < c->nz; e++)
            if (place[c->entry_col[e]] < r) {
                row[count] = c->entry_row[e];
                col[count] = place[c->entry_col[e]];
                value[count++] = c->value[e];
            }
        jv = kmp_sparse_new(r, count, row, col, false);
    }
    if (jv && kmp_sparse_factor(jv, value) != 0) {
        kmp_sparse_free(jv);
        jv = NULL;
    }
    kmp_free(place);
    kmp_free(row);
    kmp_free(col);
    kmp_free(value);
    return jv;
}

static bool compute_b(const kmp_pick *c, int r, kmp_sparse *jv, tableau *t)
{
    int *place = KMP_NEW(int, c->n);
    if (!place)
        return false;
    for (int k = 0; k < c->n; k++)
        place[c->col[k]] = k;
    memset(t->b, 0, (size_t)r * (size_t)t->p * sizeof *t->b);
    for (int e = 0; e < c->nz; e++)
        if (place[c->entry_col[e]] >= r)
            column_of(t, place[c->entry_col[e]] - r)[c->entry_row[e]] = -c->value[e];
    kmp_free(place);
    kmp_sparse_solve(jv, t->p, t->b);
    for (int k = 0; k < t->p; k++)
        look_through(t, k);
    return true;
}

/* B is brought along from exchange to exchange, and computed anew after one that was long due, whose rounding is large,
 * and when they seem to be done. */
static kmp_pick_outcome exchange_all(kmp_pick *c, int r, int most, int *exchanges, tableau *t,
                                     kmp_pick_quality *quality)
{
    for (int done = 0;;) {
        kmp_sparse *jv = factor_jv(c, r);
        if (!jv || !compute_b(c, r, jv, t)) {
            kmp_sparse_free(jv);
            return jv ? KMP_PICK_NO_MEMORY : KMP_PICK_SINGULAR;
        }
        double max_b = t->p > 0 ? t->most[worst_column(t)] : 0, norm, inverse;
        if (max_b <= c->growth || done >= most) {
            *exchanges = done;
            kmp_sparse_norms(jv, &norm, &inverse);
            quality->max_b = fmax(quality->max_b, max_b);
            quality->norm = fmax(quality->norm, norm);
            quality->inverse = fmax(quality->inverse, inverse);
            kmp_sparse_free(jv);
            return KMP_PICK_MADE;
        }
        kmp_sparse_free(jv);
        double size = 0;
        for (int k; done < most && size < LONG_DUE && t->most[k = worst_column(t)] > c->growth; done++) {
            int i = t->at[k];
            size = t->most[k];
            exchange(t, i, k);
            kmp_pick_swap(c, i, r + k);
        }
    }
}

static kmp_pick_outcome improve_sparse(kmp_pick *c, int r, int most, int *exchanges, kmp_pick_quality *quality)
{
    tableau t;
    unsigned long failures = kmp_memory_failures();
    kmp_pick_outcome outcome =
        tableau_init(&t, r, c->n - r) ? exchange_all(c, r, most, exchanges, &t, quality) : KMP_PICK_NO_MEMORY;
    tableau_free(&t);
    return kmp_memory_failures() != failures ? KMP_PICK_NO_MEMORY : outcome;
}

/* -- the blocks -------------------------------------------------------------------------------------- */

/* Chosen rows, columns and entries sorted by block, and where each block begins. */
typedef struct split {
    int count;
    int *root;                                /* of a column: union and find */
    int *block_of;                            /* of a column */
    int *row_at;                              /* of a row among the chosen ones, -1 when it is not */
    int *first_row, *first_col, *first_entry; /* count + 1 */
    int *rows, *places, *entries;             /* places of columns: chosen ones first in each block */
    int *chosen;                              /* columns of each block that are */
    int *local;                               /* of a row, then of a column: its place in its block */
} split;

static bool split_init(split *s, const kmp_pick *c)
{
    *s = (split){0};
    s->root = KMP_NEW(int, c->n);
    s->block_of = KMP_NEW(int, c->n);
    s->row_at = KMP_NEW(int, c->m);
    s->first_row = KMP_NEW(int, c->n + 2);
    s->first_col = KMP_NEW(int, c->n + 2);
    s->first_entry = KMP_NEW(int, c->n + 2);
    s->rows = KMP_NEW(int, c->m);
    s->places = KMP_NEW(int, c->n);
    s->entries = KMP_NEW(int, c->nz);
    s->chosen = KMP_NEW(int, c->n);
    s->local = KMP_NEW(int, c->m + c->n);
    return s->root && s->block_of && s->row_at && s->first_row && s->first_col && s->first_entry && s->rows &&
           s->places && s->entries && s->chosen && s->local;
}

static void split_free(split *s)
{
    void *arrays[] = {s->root, s->block_of, s->row_at,  s->first_row, s->first_col, s->first_entry,
                      s->rows, s->places,   s->entries, s->chosen,    s->local};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
}

/* Columns that meet in a chosen row belong together; blocks are numbered by their first column. */
static bool number_blocks(split *s, const kmp_pick *c, int r)
{
    int *first = KMP_NEW(int, c->m);
    if (!first)
        return false;
    for (int k = 0; k < c->n; k++)
        s->root[k] = k;
    for (int i = 0; i < c->m; i++)
        first[i] = s->row_at[i] = -1;
    for (int i = 0; i < r; i++)
        s->row_at[c->row[i]] = i;
    for (int e = 0; e < c->nz; e++) {
        int i = c->entry_row[e], k = c->entry_col[e];
        if (s->row_at[i] < 0)
            continue;
        if (first[i] < 0)
            first[i] = k;
        int a = kmp_root_of(s->root, first[i]), b = kmp_root_of(s->root, k);
        s->root[a > b ? a : b] = a > b ? b : a;
    }
    for (int k = 0; k < c->n; k++) { /* a root is the first column of its block */
        int root = kmp_root_of(s->root, k);
        s->block_of[k] = root == k ? s->count++ : s->block_of[root];
    }
    for (int i = 0; i < c->m; i++) /* an empty row belongs to none */
        s->row_at[i] = first[i] < 0 ? -1 : s->block_of[first[i]];
    kmp_free(first);
    return true;
}

static void begin_at(int *first, int count)
{
    for (int k = count; k > 0; k--)
        first[k] = first[k - 1];
    first[0] = 0;
}

static void add_up(int *first, int count)
{
    for (int k = 0; k < count; k++)
        first[k + 1] += first[k];
}

static void sort_by_block(split *s, const kmp_pick *c, int r)
{
    for (int i = 0; i < r; i++)
        if (s->row_at[c->row[i]] >= 0)
            s->first_row[s->row_at[c->row[i]] + 1]++;
    for (int k = 0; k < c->n; k++)
        s->first_col[s->block_of[k] + 1]++;
    for (int e = 0; e < c->nz; e++)
        if (s->row_at[c->entry_row[e]] >= 0)
            s->first_entry[s->block_of[c->entry_col[e]] + 1]++;
    add_up(s->first_row, s->count);
    add_up(s->first_col, s->count);
    add_up(s->first_entry, s->count);
    for (int i = 0; i < r; i++)
        if (s->row_at[c->row[i]] >= 0)
            s->rows[s->first_row[s->row_at[c->row[i]]]++] = c->row[i];
    for (int k = 0; k < c->n; k++) {
        int block = s->block_of[c->col[k]];
        s->chosen[block] += k < r;
        s->places[s->first_col[block]++] = k;
    }
    for (int e = 0; e < c->nz; e++)
        if (s->row_at[c->entry_row[e]] >= 0)
            s->entries[s->first_entry[s->block_of[c->entry_col[e]]]++] = e;
    begin_at(s->first_row, s->count);
    begin_at(s->first_col, s->count);
    begin_at(s->first_entry, s->count);
}

/* Block `which` as a choice of its own, its rows and columns in the order that they have in c. */
static bool extract(const split *s, const kmp_pick *c, int which, kmp_pick *part)
{
    int m = s->first_row[which + 1] - s->first_row[which], n = s->first_col[which + 1] - s->first_col[which];
    int nz = s->first_entry[which + 1] - s->first_entry[which], *local_row = s->local, *local_col = s->local + c->m;
    if (!kmp_pick_init(part, m, n, nz, !kmp_pick_is_large(m, n, nz)))
        return false;
    part->growth = c->growth;
    for (int i = 0; i < m; i++)
        local_row[s->rows[s->first_row[which] + i]] = part->row[i] = i;
    for (int k = 0; k < n; k++)
        local_col[c->col[s->places[s->first_col[which] + k]]] = part->col[k] = k;
    for (int k = 0; k < nz; k++) {
        int e = s->entries[s->first_entry[which] + k];
        kmp_pick_add(part, local_row[c->entry_row[e]], local_col[c->entry_col[e]], c->value[e]);
    }
    return true;
}

/* The order of the block's columns into c; `moved` has room for them. */
static void put_back(const split *s, int which, const kmp_pick *part, kmp_pick *c, int *moved)
{
    const int *places = s->places + s->first_col[which];
    for (int k = 0; k < part->n; k++)
        moved[k] = c->col[places[part->col[k]]];
    for (int k = 0; k < part->n; k++)
        c->col[places[k]] = moved[k];
}

static kmp_pick_outcome improve_block(const split *s, int which, kmp_pick *c, int most, int *exchanges,
                                      kmp_pick_quality *quality)
{
    kmp_pick part;
    int r = s->chosen[which];
    kmp_pick_outcome outcome = KMP_PICK_NO_MEMORY;
    *exchanges = 0;
    if (s->first_row[which + 1] - s->first_row[which] != r)
        return KMP_PICK_SINGULAR;
    if (r == 0)
        return KMP_PICK_MADE;
    if (extract(s, c, which, &part)) {
        outcome = part.dense ? kmp_pick_improve_dense(&part, r, most, exchanges, quality)
                             : improve_sparse(&part, r, most, exchanges, quality);
        put_back(s, which, &part, c, s->root);
    }
    kmp_pick_free(&part);
    return outcome;
}

kmp_pick_outcome kmp_pick_improve_blocks(kmp_pick *c, int r, int most, int *exchanges, kmp_pick_quality *quality)
{
    split s;
    kmp_pick_outcome outcome = KMP_PICK_NO_MEMORY;
    if (split_init(&s, c) && number_blocks(&s, c, r)) {
        outcome = KMP_PICK_MADE;
        sort_by_block(&s, c, r);
    }
    for (int k = 0; outcome == KMP_PICK_MADE && k < s.count; k++) {
        int made;
        outcome = improve_block(&s, k, c, most - *exchanges, &made, quality);
        *exchanges += made;
    }
    split_free(&s);
    return outcome;
}
