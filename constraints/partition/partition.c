/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of independent coordinates and rows: columns that a user wants come first, then complete pivoting decides,
 * then exchanges of columns keep |Bvu| small. A choice of the user that is not possible is an error that names a
 * possible one. */
#include "constraints/partition/partition.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "integrators/decide/coordinate_exchange.h"
#include "linalg/sparse.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Complete pivoting of the scaled J, and exchanges of columns in a tableau -Jv^-1 Ju: a column enters in place of one
 * where its entry is largest, until none is above the bound. Sparse matrices keep the same pivots. */

/* A matrix is not made dense with more entries than SPARSE_FROM of which fewer than one in SPARSE_BELOW is nonzero, or
 * with more than DENSE_MOST. */
enum { SPARSE_FROM = 256, SPARSE_BELOW = 6, DENSE_MOST = 1 << 14 };

bool kmp_pick_init(kmp_pick *c, int m, int n, int nz, kmp_arena_lent *room)
{
    double places = (double)m * n;
    bool large = places > DENSE_MOST || (places > SPARSE_FROM && nz * SPARSE_BELOW < places);
    *c = (kmp_pick){.m = m, .n = n, .dense = !large, .growth = KMP_PICK_GROWTH};
    if (room)
        kmp_arena_lend(&c->arena, room);
    return KMP_ARENA_MAKE(&c->arena, KMP_ROOM(int, m, &c->row), KMP_ROOM(int, n, &c->col, &c->fixed),
                          KMP_ROOM(int, nz, &c->entry_row, &c->entry_col), KMP_ROOM(double, nz, &c->value));
}

KMP_CLEARS(kmp_pick, c, kmp_arena_free(&c->arena))

void kmp_pick_add(kmp_pick *c, int row, int col, double value)
{
    c->entry_row[c->nz] = row;
    c->entry_col[c->nz] = col;
    c->value[c->nz++] = value;
}

bool kmp_pick_pivot(kmp_pick *c, const int *fixed, double *pivots)
{
    if (!c->dense) {
        kmp_entries a = {c->m, c->n, c->nz, c->entry_row, c->entry_col, c->value};
        return kmp_sparse_complete(&a, fixed, c->row, c->col, pivots, NULL);
    }
    double *a = KMP_ARENA_NEW(&c->arena, double, c->m * c->n);
    for (int e = 0; a && e < c->nz; e++)
        a[c->entry_row[e] + c->entry_col[e] * c->m] = c->value[e];
    if (a)
        kmp_lu_complete(c->m, c->n, a, fixed, c->row, c->col, pivots);
    return a;
}

/* -- exchanges of columns ------------------------------------------------------------------------------ */

/* The tableau of exchanges between the first r columns and the others, on the first r rows; its arrays are in the arena
 * of the choice. */
typedef struct tableau {
    int r, p;
    double *b;    /* r x p: Bvu */
    double *most; /* p: the largest entry of each column, and its row */
    int *at;
    double *moved;        /* r */
    int *row_at, *col_at; /* m, n: original index of each row and column */
    double *jv;           /* dense: r x r, its factors; sparse: its entries */
    int *pivot;           /* dense: r */
    int *jv_row, *jv_col; /* sparse: row and column of each entry */
    kmp_sparse *sparse;
} tableau;

static bool tableau_init(tableau *t, kmp_pick *c, int r)
{
    size_t rows = (size_t)r, p = (size_t)(c->n - r), nz = c->dense ? 0 : (size_t)c->nz;
    *t = (tableau){.r = r, .p = c->n - r};
    return KMP_ARENA_MAKE(&c->arena, KMP_ROOM(double, rows *p, &t->b), KMP_ROOM(double, p, &t->most),
                          KMP_ROOM(int, p, &t->at), KMP_ROOM(double, rows, &t->moved), KMP_ROOM(int, c->m, &t->row_at),
                          KMP_ROOM(int, c->n, &t->col_at), KMP_ROOM(double, c->dense ? rows *rows : nz, &t->jv),
                          KMP_ROOM(int, rows, &t->pivot), KMP_ROOM(int, nz, &t->jv_row, &t->jv_col));
}

static double *column_of(const tableau *t, int k)
{
    return t->b + (size_t)k * (size_t)t->r;
}

static kmp_pick_outcome factor_sparse(tableau *t, int count)
{
    unsigned long failures = kmp_memory_failures();
    kmp_sparse_free(t->sparse);
    t->sparse = kmp_sparse_new(t->r, count, t->jv_row, t->jv_col, false);
    kmp_sparse_outcome outcome = t->sparse ? kmp_sparse_factor(t->sparse, t->jv) : KMP_SPARSE_SINGULAR;
    return outcome == KMP_SPARSE_FACTORED                                         ? KMP_PICK_MADE
           : outcome == KMP_SPARSE_NO_MEMORY || kmp_memory_failures() != failures ? KMP_PICK_NO_MEMORY
                                                                                  : KMP_PICK_SINGULAR;
}

/* Factors Jv and writes -Ju into B. */
static kmp_pick_outcome factor(tableau *t, const kmp_pick *c)
{
    int r = t->r, count = 0;
    for (int i = 0; i < c->m; i++)
        t->row_at[c->row[i]] = i;
    for (int k = 0; k < c->n; k++)
        t->col_at[c->col[k]] = k;
    memset(t->b, 0, (size_t)r * (size_t)t->p * sizeof *t->b);
    if (c->dense)
        memset(t->jv, 0, (size_t)r * (size_t)r * sizeof *t->jv);
    for (int e = 0; e < c->nz; e++) {
        int i = t->row_at[c->entry_row[e]], k = t->col_at[c->entry_col[e]];
        if (i >= r)
            continue;
        if (k >= r) {
            column_of(t, k - r)[i] = -c->value[e];
        } else if (c->dense) {
            t->jv[i + k * r] = c->value[e];
        } else {
            t->jv_row[count] = i;
            t->jv_col[count] = k;
            t->jv[count++] = c->value[e];
        }
    }
    return !c->dense ? factor_sparse(t, count) : kmp_lu_factor(r, t->jv, t->pivot) ? KMP_PICK_SINGULAR : KMP_PICK_MADE;
}

/* Returns ||Jv||_1 ||Jv^-1||_1. */
static double condition(tableau *t, const kmp_pick *c)
{
    double norm = 0, inverse = 0;
    if (t->sparse) {
        kmp_sparse_norms(t->sparse, &norm, &inverse);
        return norm * inverse;
    }
    for (int k = 0; k < t->r; k++) {
        double sum = 0, sum_inverse = 0;
        for (int e = 0; e < c->nz; e++)
            if (c->entry_col[e] == c->col[k] && t->row_at[c->entry_row[e]] < t->r)
                sum += fabs(c->value[e]);
        for (int i = 0; i < t->r; i++)
            t->moved[i] = i == k;
        kmp_lu_solve(t->r, t->jv, t->pivot, 1, t->moved);
        for (int i = 0; i < t->r; i++)
            sum_inverse += fabs(t->moved[i]);
        norm = fmax(norm, sum);
        inverse = fmax(inverse, sum_inverse);
    }
    return norm * inverse;
}

/* Updates B at each exchange. B is computed again after one with a large entry, whose rounding is large, and when no
 * further exchange seems due. */
static kmp_pick_outcome exchange_all(tableau *t, kmp_pick *c, int most, int *exchanges, double *max_b)
{
    for (;;) {
        kmp_pick_outcome outcome = factor(t, c);
        if (outcome != KMP_PICK_MADE)
            return outcome;
        if (t->sparse)
            kmp_sparse_solve(t->sparse, t->p, t->b);
        else
            kmp_lu_solve(t->r, t->jv, t->pivot, t->p, t->b);
        int made = kmp_exchange_columns(t->r, t->p, t->b, c->col, c->growth, most - *exchanges, t->most, t->at, max_b);
        if (made == 0)
            return KMP_PICK_MADE;
        *exchanges += made;
    }
}

kmp_pick_outcome kmp_pick_improve(kmp_pick *c, int r, int most, int *exchanges, double *max_b)
{
    tableau t = {0};
    *exchanges = 0;
    *max_b = 0;
    if (r == 0)
        return KMP_PICK_MADE;
    kmp_pick_outcome outcome =
        tableau_init(&t, c, r) ? exchange_all(&t, c, most, exchanges, max_b) : KMP_PICK_NO_MEMORY;
    kmp_sparse_free(t.sparse);
    return outcome;
}

kmp_pick_outcome kmp_pick_condition(kmp_pick *c, int r, double *cond)
{
    tableau t = {0};
    *cond = 1;
    if (r == 0)
        return KMP_PICK_MADE;
    kmp_pick_outcome outcome = tableau_init(&t, c, r) ? factor(&t, c) : KMP_PICK_NO_MEMORY;
    if (outcome == KMP_PICK_MADE)
        *cond = condition(&t, c);
    kmp_sparse_free(t.sparse);
    return outcome;
}

/* Diagonal blocks of Jv as loops for reports: by the permutation to block triangular form of the reduction. */

/* -- blocks ------------------------------------------------------------------------------------------ */

/* Block b of Jv, its rows ascending, so that rows of one closure are contiguous. */
static void fill_block(const kmp_reduction *red, int b, kmp_arena *arena, kmp_loop_block *block)
{
    const int *column = kmp_block_columns(red->block, b, &block->size), *row = kmp_block_rows(red->block, b);
    KMP_ARENA_EACH(arena, int, block->size, &block->columns, &block->rows, &block->closures);
    for (int i = 0; !arena->failed && i < block->size; i++) {
        int k = i, r = red->part->rows[row[i]];
        for (; k > 0 && block->rows[k - 1] > r; k--)
            block->rows[k] = block->rows[k - 1];
        block->rows[k] = r;
        block->columns[i] = red->part->v[column[i]];
    }
    for (int i = 0; !arena->failed && i < block->size; i++) {
        int c = red->eval->system->rows[block->rows[i]].closure;
        if (block->closure_count == 0 || block->closures[block->closure_count - 1] != c)
            block->closures[block->closure_count++] = c;
    }
}

int kmp_loop_blocks(kmp_evaluator *eval, const kmp_partition *part, kmp_arena *arena, kmp_loop_block **blocks)
{
    kmp_reduction red;
    if (kmp_reduction_init(&red, eval, part) != KEMPE_OK)
        return -1;
    int count = kmp_block_count(red.block);
    *blocks = KMP_ARENA_NEW(arena, kmp_loop_block, count);
    for (int b = 0; !arena->failed && b < count; b++)
        fill_block(&red, count - 1 - b, arena, &(*blocks)[b]); /* blocks are solved from the last one to the first */
    kmp_reduction_free(&red);
    return arena->failed ? -1 : count;
}

int kmp_partition_rank(const kempe_system *s, const double *pivots)
{
    const kmp_rounding *rounding = kmp_rounding_of(s);
    int r = 0, most = s->m < s->n ? s->m : s->n;
    double zero = kmp_rounding_zero(s, KMP_RANK);
    most = rounding && rounding->rank < most ? rounding->rank : most;
    while (r < most && pivots[0] > KMP_RANK_FIRST && pivots[r] > zero * pivots[0])
        r++;
    return r;
}

static int compare_ints(const void *a, const void *b)
{
    return *(const int *)a - *(const int *)b;
}

static void sort(int *x, int count)
{
    if (count > 1)
        qsort(x, (size_t)count, sizeof *x, compare_ints);
}

void kmp_partition_sort(kmp_partition *part)
{
    sort(part->v, part->r);
    sort(part->u, part->p);
    sort(part->rows, part->r);
    sort(part->redundant, part->m - part->r);
}

static bool choice_init(kmp_pick *c, kmp_arena_lent *room, const kempe_system *s, const double *jacobian)
{
    const kmp_pattern *j = &s->jacobian;
    if (!kmp_pick_init(c, s->m, s->n, j->count, room))
        return false;
    for (int e = 0; e < j->count; e++)
        kmp_pick_add(c, j->row[e], j->col[e], jacobian[e] * s->scale[j->col[e]] / s->row_scale[j->row[e]]);
    return true;
}

static const char *coordinate(const kempe_system *s, int k)
{
    return kmp_model_motion(s->model, k)->name;
}

/* Reports that a user's choice is not possible, with p coordinates that are: Kempe's own choice. */
static kempe_status complain_wish(const kempe_system *s, int p, int r, const int *best, const int *wish, int count,
                                  const double *pivots)
{
    kmp_text names = {0};
    for (int k = 0; k < p; k++)
        kmp_text_printf(&names, "%s%s", k ? ", " : "", coordinate(s, best[k]));
    char *would = kmp_text_take(&names);
    KMP_TRY(kmp_made(s->context, would));
    if (count != p)
        (void)kmp_fail(
            s->context, KEMPE_E_FAILED,
            "the mechanism has %d degree%s of freedom, but %d independent coordinate%s given; possible choice: %s", p,
            p == 1 ? "" : "s", count, count == 1 ? " was" : "s were", p ? would : "none");
    else
        (void)kmp_fail(s->context, KEMPE_E_FAILED,
                       "'%s' cannot be independent here: the other coordinates do not follow from it (the Jacobian of "
                       "the dependent ones is singular to %.2g); possible choice: %s",
                       coordinate(s, wish[0]), pivots[r - 1] / pivots[0], would);
    kmp_free(would);
    return KEMPE_E_FAILED;
}

static kempe_status follow_wish(kmp_pick *c, kmp_partition *part, const kempe_system *s, const int *wish, int count)
{
    double *pivots = KMP_ARENA_NEW(&c->arena, double, s->m + s->n);
    int *best = KMP_ARENA_NEW(&c->arena, int, s->n);
    KMP_TRY(kmp_made(s->context, !c->arena.failed));
    memcpy(best, c->col + part->r, (size_t)part->p * sizeof *best);
    sort(best, part->p);
    for (int k = 0; k < count; k++)
        c->fixed[wish[k]] = 1;
    for (int k = kmp_model_coordinates(s->model); k < s->n; k++) { /* states are independent in any case */
        count += !c->fixed[k];
        c->fixed[k] = 1;
    }
    part->user = true;
    KMP_TRY(kmp_made(s->context, kmp_pick_pivot(c, c->fixed, pivots)));
    /* One coordinate per degree of freedom, besides the states, which are the last ones, and Jv regular. */
    int p = part->p - kmp_model_state_count(s->model), r = part->r;
    count -= kmp_model_state_count(s->model);
    bool possible = count == p && (r == 0 || pivots[r - 1] * KMP_GROWTH_WISH > pivots[0]);
    return possible ? KEMPE_OK : complain_wish(s, p, r, best, wish, count, pivots);
}

/* Allocates the lists of coordinates and rows in one block. */
static bool allocate(kmp_partition *part, int n, int m)
{
    *part = (kmp_partition){.n = n, .m = m, .u = KMP_NEW(int, 2 * (n + m)), .pivots = KMP_NEW(double, m + n)};
    if (!part->u || !part->pivots)
        return false;
    part->v = part->u + n;
    part->rows = part->v + n;
    part->redundant = part->rows + m;
    return true;
}

/* Improves the first r rows and columns. KEMPE_E_FAILED without message: singular, part is untouched. */
static kempe_status improve(kmp_pick *c, kmp_partition *part, const kempe_system *s, bool fixed)
{
    int exchanges = 0;
    double max_b;
    kmp_pick_outcome outcome = kmp_pick_improve(c, part->r, fixed ? 0 : 4 * s->n, &exchanges, &max_b);
    if (outcome != KMP_PICK_MADE)
        return outcome == KMP_PICK_SINGULAR ? KEMPE_E_FAILED : kmp_fail_memory(s->context);
    part->exchanges += exchanges;
    part->max_b = max_b;
    /* The improved choice, in the order of coordinates. */
    int r = part->r;
    memcpy(part->v, c->col, (size_t)r * sizeof(int));
    memcpy(part->u, c->col + r, (size_t)part->p * sizeof(int));
    memcpy(part->rows, c->row, (size_t)r * sizeof(int));
    memcpy(part->redundant, c->row + r, (size_t)(part->m - r) * sizeof(int));
    kmp_partition_sort(part);
    return KEMPE_OK;
}

kempe_status kmp_partition_init(kmp_partition *part, const kempe_system *system, const double *jacobian,
                                const int *wish, int wish_count)
{
    return kmp_partition_of_rank(part, system, jacobian, -1, wish, wish_count);
}

kempe_status kmp_partition_of_rank(kmp_partition *part, const kempe_system *system, const double *jacobian, int rank,
                                   const int *wish, int wish_count)
{
    kmp_pick c;
    kmp_arena_lent room;
    bool made = allocate(part, system->n, system->m);
    bool counts = !made || rank > 0 || wish_count > 0;
    for (int e = 0; !counts && e < system->jacobian.count; e++)
        counts = jacobian[e] != 0;
    if (!counts) { /* as where all contacts are open: all coordinates are independent */
        part->p = part->n;
        for (int k = 0; k < part->n; k++)
            part->u[k] = k;
        for (int r = 0; r < part->m; r++)
            part->redundant[r] = r;
        return KEMPE_OK;
    }
    made = choice_init(&c, &room, system, jacobian) && made;
    made = made && kmp_pick_pivot(&c, NULL, part->pivots);
    kempe_status status = made ? KEMPE_OK : kmp_fail_memory(system->context);
    if (made) {
        part->r = rank >= 0 ? rank : kmp_partition_rank(system, part->pivots);
        part->p = system->n - part->r;
        if (wish_count > 0)
            status = follow_wish(&c, part, system, wish, wish_count);
    }
    if (status == KEMPE_OK) {
        status = improve(&c, part, system, part->user);
        if (status == KEMPE_E_FAILED)
            (void)kmp_fail(system->context, status, "the closures are singular for every choice of coordinates");
    }
    kmp_pick_free(&c);
    if (status != KEMPE_OK)
        kmp_partition_free(part);
    return status;
}

int kmp_partition_prefer(const kempe_system *system, const double *jacobian, const bool *liked, int *u)
{
    kmp_pick c;
    kmp_arena_lent room;
    int count = -1;
    double *pivots =
        choice_init(&c, &room, system, jacobian) ? KMP_ARENA_NEW(&c.arena, double, system->m + system->n) : NULL;
    for (int k = 0; pivots && k < system->n; k++)
        c.fixed[k] = liked[k];
    if (pivots && kmp_pick_pivot(&c, c.fixed, pivots)) {
        int rank = kmp_partition_rank(system, pivots);
        count = system->n - rank;
        memcpy(u, c.col + rank, (size_t)count * sizeof *u);
    }
    kmp_pick_free(&c);
    return count;
}

bool kmp_partition_pivots(const kempe_system *system, const double *jacobian, double *pivots)
{
    kmp_pick c;
    kmp_arena_lent room;
    bool ok = choice_init(&c, &room, system, jacobian) && kmp_pick_pivot(&c, NULL, pivots);
    kmp_pick_free(&c);
    return ok;
}

/* -- one row more ---------------------------------------------------------------------------------------- */

bool kmp_row_links_init(kmp_row_links *x, const kempe_system *s, kmp_arena *arena)
{
    const kmp_pattern *j = &s->jacobian;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(int, s->m + 1, &x->row_start), KMP_ROOM(int, s->n + 1, &x->col_start),
                        KMP_ROOM(int, j->count, &x->in_col), KMP_ROOM(int, s->m, &x->row, &x->row_at),
                        KMP_ROOM(int, s->n, &x->col, &x->col_at, &x->shared)))
        return false;
    for (int e = 0; e < j->count; e++) {
        x->row_start[j->row[e] + 1]++;
        x->col_start[j->col[e] + 1]++;
    }
    for (int r = 0; r < s->m; r++)
        x->row_start[r + 1] += x->row_start[r];
    for (int c = 0; c < s->n; c++)
        x->col_start[c + 1] += x->col_start[c];
    for (int e = 0; e < j->count; e++)
        x->in_col[x->col_start[j->col[e]] + x->col_at[j->col[e]]++] = e;
    for (int r = 0; r < s->m; r++)
        x->row_at[r] = -1;
    for (int c = 0; c < s->n; c++)
        x->col_at[c] = -1;
    return true;
}

/* The rows and columns that non-zeros connect with a row, which is the first; returns the number of non-zeros. */
static int gather(kmp_row_links *x, const kmp_pattern *j, const double *jacobian, const bool *out, int row, int *rows,
                  int *cols)
{
    int entries = 0;
    *rows = *cols = 0;
    x->row_at[row] = 0;
    x->row[(*rows)++] = row;
    for (int i = 0; i < *rows; i++)
        for (int e = x->row_start[x->row[i]]; e < x->row_start[x->row[i] + 1]; e++) {
            const int col = j->col[e];
            entries += jacobian[e] != 0;
            if (jacobian[e] == 0 || x->col_at[col] >= 0)
                continue;
            x->col_at[col] = *cols;
            x->col[(*cols)++] = col;
            for (int k = x->col_start[col]; k < x->col_start[col + 1]; k++) {
                const int other = j->row[x->in_col[k]];
                if (jacobian[x->in_col[k]] == 0 || x->row_at[other] >= 0 || (out && out[other]))
                    continue;
                x->row_at[other] = *rows;
                x->row[(*rows)++] = other;
            }
        }
    return entries;
}

/* The largest scaled entry of a row, of all its columns or of the columns that no other row of the group has. */
static double largest_entry(const kempe_system *s, const double *jacobian, const kmp_row_links *x, int row, bool own)
{
    double most = 0;
    for (int e = x->row_start[row]; e < x->row_start[row + 1]; e++) {
        const int col = s->jacobian.col[e];
        if (!own || x->shared[col] == 1)
            most = fmax(most, fabs(jacobian[e]) * s->scale[col] / s->row_scale[row]);
    }
    return most;
}

static void count_columns(const kempe_system *s, const double *jacobian, const kmp_row_links *x, int row, int by)
{
    for (int e = x->row_start[row]; e < x->row_start[row + 1]; e++)
        if (jacobian[e] != 0)
            x->shared[s->jacobian.col[e]] += by;
}

/* True if the first of the gathered rows is independent only by its pattern: a row with a separate column takes part
 * in no dependence, and is set aside; so are then the rows that shared columns only with it. The first row can be set
 * aside after others, as where contacts form chains. Pivots would be about the parts of the rows' largest entries. */
static bool stands_alone(const kempe_system *s, const double *jacobian, const kmp_row_links *x, int rows)
{
    double part = 1;
    bool goes_on = true;
    for (int i = 0; i < rows; i++)
        count_columns(s, jacobian, x, x->row[i], 1);
    while (goes_on && x->row_at[x->row[0]] >= 0) {
        goes_on = false;
        for (int i = rows; i-- > 0;) {
            const int row = x->row[i];
            if (x->row_at[row] < 0)
                continue;
            const double own = largest_entry(s, jacobian, x, row, true),
                         all = largest_entry(s, jacobian, x, row, false);
            if (!(own > KMP_ROW_OWN * all && own > KMP_RANK_FIRST))
                continue;
            part *= own / all;
            x->row_at[row] = -1;
            count_columns(s, jacobian, x, row, -1);
            goes_on = true;
        }
    }
    const bool alone = x->row_at[x->row[0]] < 0 && part > KMP_ROW_OWN;
    for (int i = 0; i < rows; i++)
        for (int e = x->row_start[x->row[i]]; e < x->row_start[x->row[i] + 1]; e++)
            x->shared[s->jacobian.col[e]] = 0;
    return alone;
}

/* The rank of the gathered rows from `first` on, and its last pivot. */
static bool rank_of_gathered(const kempe_system *s, const double *jacobian, const kmp_row_links *x, int first, int rows,
                             int cols, int entries, int *rank, double *last)
{
    kmp_pick c;
    kmp_arena_lent room;
    const double zero = kmp_rounding_zero(s, KMP_RANK);
    double *pivots = kmp_pick_init(&c, rows - first, cols, entries, &room)
                         ? KMP_ARENA_NEW(&c.arena, double, rows - first + cols)
                         : NULL;
    for (int i = first; pivots && i < rows; i++)
        for (int e = x->row_start[x->row[i]]; e < x->row_start[x->row[i] + 1]; e++)
            if (jacobian[e] != 0) {
                const int col = s->jacobian.col[e];
                kmp_pick_add(&c, i - first, x->col_at[col], jacobian[e] * s->scale[col] / s->row_scale[x->row[i]]);
            }
    const bool made = pivots && kmp_pick_pivot(&c, NULL, pivots);
    const int most = rows - first < cols ? rows - first : cols;
    *rank = 0;
    while (made && *rank < most && pivots[0] > KMP_RANK_FIRST && pivots[*rank] > zero * pivots[0])
        ++*rank;
    *last = *rank > 0 ? pivots[*rank - 1] : 0;
    kmp_pick_free(&c);
    return made;
}

kempe_status kmp_partition_adds(const kempe_system *s, const double *jacobian, kmp_row_links *x, const bool *out,
                                int row, double least, bool *adds)
{
    int rows, cols, rank[2];
    double last[2];
    const int entries = gather(x, &s->jacobian, jacobian, out, row, &rows, &cols);
    bool made = true;
    if (rows == 1) {
        *adds = largest_entry(s, jacobian, x, row, false) > KMP_RANK_FIRST;
    } else if (stands_alone(s, jacobian, x, rows)) {
        *adds = true;
    } else {
        for (int i = 0; i < 2 && made; i++) /* with the row, and without it */
            made = rank_of_gathered(s, jacobian, x, i, rows, cols, entries, &rank[i], &last[i]);
        *adds = made && rank[0] > rank[1] && last[0] > least * last[1];
    }
    for (int i = 0; i < rows; i++)
        x->row_at[x->row[i]] = -1;
    for (int k = 0; k < cols; k++)
        x->col_at[x->col[k]] = -1;
    return kmp_made(s->context, made);
}

/* -- copies and exchanges -------------------------------------------------------------------------------- */

void kmp_partition_take_rows(kmp_partition *part, const kmp_partition *from)
{
    memcpy(part->rows, from->rows, (size_t)from->r * sizeof *part->rows);
    memcpy(part->redundant, from->redundant, (size_t)(from->m - from->r) * sizeof *part->redundant);
}

bool kmp_partition_copy(kmp_partition *to, const kmp_partition *from)
{
    kmp_partition own;
    bool made = allocate(&own, from->n, from->m);
    *to = *from;
    to->u = own.u;
    to->v = own.v;
    to->rows = own.rows;
    to->redundant = own.redundant;
    to->pivots = own.pivots;
    if (!made) {
        kmp_partition_free(to);
        return false;
    }
    memcpy(to->u, from->u, 2 * (size_t)(from->n + from->m) * sizeof *to->u);
    memcpy(to->pivots, from->pivots, (size_t)(from->m + from->n) * sizeof *to->pivots);
    return true;
}

/* Orders rows and columns as a partition has them. */
static void begin_with(kmp_pick *c, const kmp_partition *part)
{
    memcpy(c->row, part->rows, (size_t)part->r * sizeof(int));
    memcpy(c->row + part->r, part->redundant, (size_t)(part->m - part->r) * sizeof(int));
    memcpy(c->col, part->v, (size_t)part->r * sizeof(int));
    memcpy(c->col + part->r, part->u, (size_t)part->p * sizeof(int));
}

kempe_status kmp_partition_condition(const kmp_partition *part, const kempe_system *system, const double *jacobian,
                                     double *cond)
{
    kmp_pick c;
    kmp_arena_lent room;
    kmp_pick_outcome outcome = KMP_PICK_NO_MEMORY;
    if (choice_init(&c, &room, system, jacobian)) {
        begin_with(&c, part);
        outcome = kmp_pick_condition(&c, part->r, cond);
    }
    kmp_pick_free(&c);
    if (outcome == KMP_PICK_SINGULAR)
        *cond = INFINITY;
    return kmp_made(system->context, outcome != KMP_PICK_NO_MEMORY);
}

kempe_status kmp_partition_exchange(kmp_partition *part, const kempe_system *system, const double *jacobian,
                                    double growth)
{
    kmp_pick c;
    kmp_arena_lent room;
    if (!choice_init(&c, &room, system, jacobian)) {
        kmp_pick_free(&c);
        return kmp_fail_memory(system->context);
    }
    c.growth = growth;
    begin_with(&c, part);
    kempe_status status = improve(&c, part, system, false);
    part->user = part->user && status != KEMPE_OK;
    kmp_pick_free(&c);
    return status;
}

void kmp_partition_free(kmp_partition *part)
{
    kmp_free(part->u); /* also frees the lists in its block */
    kmp_free(part->pivots);
    *part = (kmp_partition){0};
}
