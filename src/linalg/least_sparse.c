/* SPDX-License-Identifier: BSD-3-Clause */
/* x = A' y with (A A' + d^2) y = b, by the square system [1 -A'; A d^2], which KLU factors with what A has of zeros;
 * with rows that are to be left out y = 0 stands in place of theirs. */
#include "base/memory.h"
#include "linalg/least.h"
#include "linalg/sparse.h"
#include <string.h>

/* Rows that depend on others matter to y alone while the square of the damping is far above rounding. */
#define DAMPED_ENOUGH 1e-6

typedef struct work {
    int *row, *col, *pivot_row, *pivot_col;
    double *value, *pivots, *x;
    bool *out;
} work;

static bool allocate(work *w, int m, int n, int nz)
{
    int entries = n + m + 2 * nz;
    *w = (work){.row = KMP_NEW(int, entries), .col = KMP_NEW(int, entries), .value = KMP_NEW(double, entries)};
    w->pivot_row = KMP_NEW(int, m);
    w->pivot_col = KMP_NEW(int, n);
    w->pivots = KMP_NEW(double, m < n ? m : n);
    w->x = KMP_NEW(double, n + m);
    w->out = KMP_NEW(bool, m);
    return w->row && w->col && w->value && w->pivot_row && w->pivot_col && w->pivots && w->x && w->out;
}

static void release(work *w)
{
    void *arrays[] = {w->row, w->col, w->pivot_row, w->pivot_col, w->value, w->pivots, w->x, w->out};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
}

/* Rows behind the last pivot that counts go out. */
static bool leave_out(work *w, const kmp_entries *a, double rcond)
{
    int most = a->m < a->n ? a->m : a->n, rank = 0;
    if (!kmp_sparse_complete(a, NULL, w->pivot_row, w->pivot_col, w->pivots))
        return false;
    while (rank < most && w->pivots[rank] > rcond * w->pivots[0])
        rank++;
    for (int i = rank; i < a->m; i++)
        w->out[w->pivot_row[i]] = true;
    return true;
}

static int put(work *w, int count, int row, int col, double value)
{
    w->row[count] = row;
    w->col[count] = col;
    w->value[count] = value;
    return count + 1;
}

static int list(work *w, const kmp_entries *a, double damping)
{
    int count = 0;
    for (int k = 0; k < a->n; k++)
        count = put(w, count, k, k, 1);
    for (int i = 0; i < a->m; i++)
        count = put(w, count, a->n + i, a->n + i, w->out[i] ? 1 : damping * damping);
    for (int k = 0; k < a->nz; k++) {
        double value = w->out[a->row[k]] ? 0 : a->value[k];
        count = put(w, count, a->n + a->row[k], a->col[k], value);
        count = put(w, count, a->col[k], a->n + a->row[k], -value);
    }
    return count;
}

kmp_least_outcome kmp_least_squares_sparse(const kmp_entries *a, const double *b, double damping, double rcond,
                                           double *x)
{
    work w;
    unsigned long failures = kmp_memory_failures();
    bool ok = allocate(&w, a->m, a->n, a->nz) && (damping > DAMPED_ENOUGH || leave_out(&w, a, rcond));
    kmp_sparse *s = NULL;
    if (ok) {
        s = kmp_sparse_new(a->n + a->m, list(&w, a, damping), w.row, w.col, true);
        ok = s && kmp_sparse_factor(s, w.value) == 0;
    }
    for (int i = 0; ok && i < a->m; i++)
        w.x[a->n + i] = w.out[i] ? 0 : b[i];
    if (ok) {
        kmp_sparse_solve(s, 1, w.x);
        memcpy(x, w.x, (size_t)a->n * sizeof *x);
    }
    kmp_sparse_free(s);
    release(&w);
    return ok ? KMP_LEAST_FOUND : kmp_memory_failures() != failures ? KMP_LEAST_NO_MEMORY : KMP_LEAST_NONE;
}
