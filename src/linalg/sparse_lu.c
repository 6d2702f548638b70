/* SPDX-License-Identifier: BSD-3-Clause */
/* The elimination by columns of Gilbert and Peierls (SIAM J. Sci. Stat. Comput. 9 (1988) 862), as KLU's
 * refactorisation, on the factors that KLU has chosen: with numbers of 32 bits, and with solutions of many right-hand
 * sides at once. */
#include "linalg/sparse_lu.h"
#include "base/arena.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "linalg/sparse.h"
#include <float.h>
#include <klu.h>
#include <math.h>
#include <string.h>

/* Cost of a product by lists of entries, in products of a dense block. */
#define BY_LISTS 4
/* Pivots are chosen as the largest entries of their columns, so that no entry of L exceeds 1; and again where an entry
 * of L of later values exceeds the limit, or an entry of U this multiple of the largest entry of the matrix. */
#define DIAGONAL_KEPT 1.0
#define MOST_OF_L     1e2
#define MOST_OF_U     1e2

/* Columns of L below the diagonal, or of U above it. */
typedef struct columns {
    int *start, *row;
    double *value;
} columns;

struct kmp_sparse_lu {
    kmp_arena arena, factors; /* factors: of the present pivots */
    int n, nz;
    int64_t *start, *row; /* entries by columns, in the order that was given */
    int *place;           /* of an entry among them */
    double *value;
    klu_l_common common;
    klu_l_symbolic *symbolic;
    bool pivoted;
    int *column;   /* the given column of each position */
    int *position; /* of a given row among the pivots */
    int *pivot;    /* its inverse */
    int parity;    /* of both permutations */
    columns l, u;
    double *work; /* n: a column; zero between uses */
    int64_t products;
};

/* -- analysis ---------------------------------------------------------------------------------------- */

static bool take_entries(kmp_sparse_lu *s, const int *row, const int *col)
{
    const int n = s->n;
    if (!KMP_ARENA_MAKE(&s->arena, KMP_ROOM(int64_t, n + 1, &s->start), KMP_ROOM(int64_t, s->nz, &s->row),
                        KMP_ROOM(double, s->nz, &s->value), KMP_ROOM(double, n, &s->work),
                        KMP_ROOM(int, n, &s->column, &s->position, &s->pivot), KMP_ROOM(int, s->nz, &s->place),
                        KMP_ROOM(int, n + 1, &s->l.start, &s->u.start)))
        return false;
    kmp_sparse_compress(n, s->nz, row, col, s->start, s->row, s->place);
    return true;
}

kmp_sparse_lu *kmp_sparse_lu_new(int n, int nz, const int *row, const int *col, int *order)
{
    kmp_sparse_lu *s = KMP_NEW(kmp_sparse_lu, 1);
    if (!s)
        return NULL;
    s->n = n;
    s->nz = nz;
    klu_l_defaults(&s->common);
    s->common.tol = DIAGONAL_KEPT;
    s->common.btf = 0;
    s->common.scale = 0;
    if (take_entries(s, row, col))
        s->symbolic = klu_l_analyze(n, s->start, s->row, &s->common);
    /* The estimated factors have to take fewer operations than dense ones. */
    if (!s->symbolic || !(BY_LISTS * (s->symbolic->lnz + s->symbolic->unz) < (double)n * n)) {
        kmp_sparse_lu_free(s);
        return NULL;
    }
    for (int k = 0; k < n; k++)
        order[k] = s->column[k] = (int)s->symbolic->Q[k];
    return s;
}

void kmp_sparse_lu_free(kmp_sparse_lu *s)
{
    if (!s)
        return;
    klu_l_free_symbolic(&s->symbolic, &s->common);
    kmp_arena_free(&s->factors);
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

/* -- pivots ------------------------------------------------------------------------------------------ */

/* 1 or -1; `seen` (n) is zero before and after. */
static int parity_of(int n, const int *order, double *seen)
{
    int parity = 1;
    for (int k = 0; k < n; k++)
        for (int i = k; seen[i] == 0; i = order[i]) {
            seen[i] = 1;
            parity = order[i] != k ? -parity : parity;
        }
    memset(seen, 0, (size_t)n * sizeof *seen);
    return parity;
}

/* Entries of KLU's columns without the diagonal, by ascending rows. */
static void take_columns(columns *c, int n, const int64_t *start, const int64_t *row)
{
    int count = 0;
    for (int k = 0; k < n; k++) {
        for (int64_t e = start[k]; e < start[k + 1]; e++)
            if (row[e] != k)
                c->row[count++] = (int)row[e];
        c->start[k + 1] = count;
    }
}

/* Takes patterns and pivots. */
static bool take_factors(kmp_sparse_lu *s, klu_l_numeric *numeric)
{
    const int n = s->n;
    const int64_t lnz = numeric->lnz, unz = numeric->unz;
    kmp_arena room = {0};
    int64_t *lp, *up, *li, *ui, *p;
    double *lx, *ux;
    kmp_arena_free(&s->factors);
    memset(s->l.start, 0, ((size_t)n + 1) * sizeof(int));
    memset(s->u.start, 0, ((size_t)n + 1) * sizeof(int));
    bool ok =
        KMP_ARENA_MAKE(&room, KMP_ROOM(int64_t, n + 1, &lp, &up), KMP_ROOM(int64_t, lnz, &li),
                       KMP_ROOM(int64_t, unz, &ui), KMP_ROOM(int64_t, n, &p), KMP_ROOM(double, lnz, &lx),
                       KMP_ROOM(double, unz, &ux)) &&
        KMP_ARENA_MAKE(&s->factors, KMP_ROOM(int, lnz, &s->l.row), KMP_ROOM(int, unz, &s->u.row),
                       KMP_ROOM(double, lnz, &s->l.value), KMP_ROOM(double, unz, &s->u.value)) &&
        klu_l_sort(s->symbolic, numeric, &s->common) &&
        klu_l_extract(numeric, s->symbolic, lp, li, lx, up, ui, ux, NULL, NULL, NULL, p, NULL, NULL, NULL, &s->common);
    if (ok) {
        for (int k = 0; k < n; k++) {
            s->pivot[k] = (int)p[k];
            s->position[p[k]] = k;
        }
        take_columns(&s->l, n, lp, li);
        take_columns(&s->u, n, up, ui);
        s->parity = parity_of(n, s->pivot, s->work) * parity_of(n, s->column, s->work);
        s->products = 0;
        for (int k = 0; k < n; k++) {
            s->products += s->l.start[k + 1] - s->l.start[k];
            for (int e = s->u.start[k]; e < s->u.start[k + 1]; e++)
                s->products += s->l.start[s->u.row[e] + 1] - s->l.start[s->u.row[e]];
        }
    }
    kmp_arena_free(&room);
    return ok;
}

/* Chooses pivots for the present values. Returns 0, or 1 + the position of a pivot that is zero; of the first without
 * memory. */
static int choose_pivots(kmp_sparse_lu *s)
{
    klu_l_numeric *numeric = klu_l_factor(s->start, s->row, s->value, s->symbolic, &s->common);
    s->pivoted = numeric && s->common.status == KLU_OK && take_factors(s, numeric);
    const int64_t rank = s->common.numerical_rank;
    const bool singular = s->common.status == KLU_SINGULAR && rank >= 0 && rank < s->n;
    klu_l_free_numeric(&numeric, &s->common);
    return s->pivoted ? 0 : singular ? 1 + (int)rank : 1;
}

/* -- factors ----------------------------------------------------------------------------------------- */

static inline double larger(double most, double x)
{
    return fabs(x) > most ? fabs(x) : most;
}

/* Factors with the present pivots: 0, or 1 + the position of a pivot without a reciprocal. *suit: they may be kept. */
static int eliminate(kmp_sparse_lu *s, double *inverse, bool *suit)
{
    double *restrict w = s->work, most_a = 0, most_l = 0, most_u = 0;
    int fault = 0;
    for (int k = 0; k < s->n; k++) {
        const int given = s->column[k];
        for (int64_t e = s->start[given]; e < s->start[given + 1]; e++) {
            w[s->position[s->row[e]]] = s->value[e];
            most_a = larger(most_a, s->value[e]);
        }
        for (int e = s->u.start[k]; e < s->u.start[k + 1]; e++) {
            const int j = s->u.row[e];
            const double by = s->u.value[e] = w[j];
            w[j] = 0;
            most_u = larger(most_u, by);
            for (int i = s->l.start[j]; i < s->l.start[j + 1]; i++)
                w[s->l.row[i]] -= s->l.value[i] * by;
        }
        most_u = larger(most_u, w[k]);
        const double over = 1.0 / w[k];
        w[k] = 0;
        inverse[k] = over;
        if (!fault && !(fabs(over) > 0 && fabs(over) <= DBL_MAX))
            fault = k + 1;
        for (int i = s->l.start[k]; i < s->l.start[k + 1]; i++) {
            const double x = s->l.value[i] = w[s->l.row[i]] * over;
            w[s->l.row[i]] = 0;
            most_l = larger(most_l, x);
        }
    }
    *suit = most_l <= MOST_OF_L && most_u <= MOST_OF_U * most_a;
    return fault;
}

int kmp_sparse_lu_factor(kmp_sparse_lu *s, const double *values, int *pivoted, double *inverse, int *sign)
{
    bool suit = false;
    for (int e = 0; e < s->nz; e++)
        s->value[s->place[e]] = values[e];
    int fault = s->pivoted ? eliminate(s, inverse, &suit) : 1;
    if (fault || !suit) {
        fault = choose_pivots(s);
        fault = fault ? fault : eliminate(s, inverse, &suit);
    }
    if (fault)
        return fault;
    *sign = s->parity;
    for (int k = 0; k < s->n; k++)
        *sign = inverse[k] < 0 ? -*sign : *sign;
    memcpy(pivoted, s->pivot, (size_t)s->n * sizeof *pivoted);
    return 0;
}

/* -- solutions --------------------------------------------------------------------------------------- */

static inline __attribute__((always_inline)) void solve_lanes(const kmp_sparse_lu *s, const double *inverse, int lanes,
                                                              double *restrict w)
{
    for (int k = 0; k < s->n; k++)
        for (int e = s->l.start[k]; e < s->l.start[k + 1]; e++)
            for (int l = 0; l < lanes; l++)
                w[s->l.row[e] * lanes + l] -= s->l.value[e] * w[k * lanes + l];
    for (int k = s->n - 1; k >= 0; k--) {
        for (int l = 0; l < lanes; l++)
            w[k * lanes + l] *= inverse[k];
        for (int e = s->u.start[k]; e < s->u.start[k + 1]; e++)
            for (int l = 0; l < lanes; l++)
                w[s->u.row[e] * lanes + l] -= s->u.value[e] * w[k * lanes + l];
    }
}

void kmp_sparse_lu_solve(const kmp_sparse_lu *s, const double *inverse, int lanes, double *w)
{
    if (lanes == 1)
        solve_lanes(s, inverse, 1, w);
    else
        solve_lanes(s, inverse, lanes, w);
}

void kmp_sparse_lu_solve_transposed(const kmp_sparse_lu *s, const double *inverse, double *w)
{
    for (int k = 0; k < s->n; k++) {
        double sum = w[k];
        for (int e = s->u.start[k]; e < s->u.start[k + 1]; e++)
            sum -= s->u.value[e] * w[s->u.row[e]];
        w[k] = sum * inverse[k];
    }
    for (int k = s->n - 1; k >= 0; k--) {
        double sum = w[k];
        for (int e = s->l.start[k]; e < s->l.start[k + 1]; e++)
            sum -= s->l.value[e] * w[s->l.row[e]];
        w[k] = sum;
    }
}

static KMP_INTO_CLONES void subtract(int from, int end, double by, const double *restrict x, double *restrict own)
{
    for (int c = from; c < end; c += KMP_FOUR)
        KMP_FOUR_AT(own + c) -= KMP_FOUR_CONST(x + c) * by;
}

static KMP_CLONES void solve_rows(const kmp_sparse_lu *s, const double *inverse, const int *column, int stride,
                                  int from, int end, double *x)
{
    for (int k = 0; k < s->n; k++) {
        const double *own = x + (ptrdiff_t)column[k] * stride;
        for (int e = s->l.start[k]; e < s->l.start[k + 1]; e++)
            subtract(from, end, s->l.value[e], own, x + (ptrdiff_t)column[s->l.row[e]] * stride);
    }
    for (int k = s->n - 1; k >= 0; k--) {
        double *own = x + (ptrdiff_t)column[k] * stride;
        for (int c = from; c < end; c += KMP_FOUR)
            KMP_FOUR_AT(own + c) *= inverse[k];
        for (int e = s->u.start[k]; e < s->u.start[k + 1]; e++)
            subtract(from, end, s->u.value[e], own, x + (ptrdiff_t)column[s->u.row[e]] * stride);
    }
}

void kmp_sparse_lu_solve_rows(const kmp_sparse_lu *s, const double *inverse, const int *column, int stride, int from,
                              int end, double *x)
{
    solve_rows(s, inverse, column, stride, from, end, x);
}

/* -- counts ------------------------------------------------------------------------------------------ */

int kmp_sparse_lu_entries(const kmp_sparse_lu *s)
{
    return s->nz;
}

int64_t kmp_sparse_lu_factor_products(const kmp_sparse_lu *s)
{
    return s->pivoted ? s->products : (int64_t)s->symbolic->est_flops / 2;
}

int64_t kmp_sparse_lu_solve_products(const kmp_sparse_lu *s)
{
    return s->pivoted ? (int64_t)s->l.start[s->n] + s->u.start[s->n] + s->n
                      : (int64_t)(s->symbolic->lnz + s->symbolic->unz);
}
