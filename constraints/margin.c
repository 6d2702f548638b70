/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/margin.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

/* A last pivot below this fraction of the first at the start is near a change point; what is usual then. */
#define NEAR_START 1e-2
#define USUAL      0.1
/* A margin below LOCKED, which leaving out one row lifts above FREED, is that row's doing. */
#define LOCKED 0.1
#define FREED  0.2

bool kmp_margin_init(kmp_margin *margin, const kempe_system *system, const kmp_partition *part)
{
    int m = system->m, n = system->n;
    *margin = (kmp_margin){.system = system, .r = part->r, .usual = part->r > 0 ? part->pivots[part->r - 1] : 1};
    margin->near = part->r > 0 && margin->usual < NEAR_START * part->pivots[0];
    if (margin->near)
        margin->usual = USUAL * part->pivots[0]; /* started near a change point: its own size says nothing */
    margin->a = KMP_NEW(double, m *n);
    margin->pivots = KMP_NEW(double, m + n);
    margin->row = KMP_NEW(int, m);
    margin->col = KMP_NEW(int, n);
    return margin->a && margin->pivots && margin->row && margin->col;
}

void kmp_margin_free(kmp_margin *margin)
{
    kmp_free(margin->a);
    kmp_free(margin->pivots);
    kmp_free(margin->row);
    kmp_free(margin->col);
    *margin = (kmp_margin){0};
}

/* The given pivot of some rows (all when `rows` is NULL) of the scaled J. */
static double pivot_of(kmp_margin *margin, const kmp_plant *plant, const int *rows, int count, int which)
{
    const kempe_system *s = margin->system;
    memset(margin->a, 0, (size_t)(count * s->n) * sizeof *margin->a);
    for (int e = 0, at = 0; e < s->jacobian.count; e++) { /* entries are row by row */
        int row = s->jacobian.row[e], col = s->jacobian.col[e];
        while (rows && at < count && rows[at] < row)
            at++;
        if (rows && (at == count || rows[at] != row))
            continue;
        margin->a[(rows ? at : row) + col * count] = plant->jacobian[e] * s->scale[col] / s->row_scale[row];
    }
    kmp_lu_complete(count, s->n, margin->a, NULL, margin->row, margin->col, margin->pivots);
    return margin->pivots[which];
}

double kmp_margin_at(kmp_margin *margin, const kmp_plant *plant)
{
    if (margin->r == 0)
        return 1;
    margin->last = pivot_of(margin, plant, NULL, margin->system->m, margin->r - 1);
    margin->usual = fmax(margin->usual, margin->last);
    return margin->last / margin->usual;
}

double kmp_margin_of_rows(kmp_margin *margin, const kmp_plant *plant, const kmp_partition *part)
{
    if (margin->r == part->m || margin->r == 0)
        return 1;
    return pivot_of(margin, plant, part->rows, margin->r, margin->r - 1) / margin->last;
}

int kmp_margin_lock(kmp_margin *margin, const kmp_plant *plant)
{
    int m = margin->system->m, *rows, found = -1;
    if (margin->r == 0 || !plant->h_t || kmp_margin_at(margin, plant) > LOCKED || !(rows = KMP_NEW(int, m)))
        return -1;
    for (int row = 0; row < m && found < 0; row++) {
        if (fabs(plant->h_t[row]) == 0)
            continue;
        for (int k = 0; k < m - 1; k++)
            rows[k] = k + (k >= row);
        if (margin->r == 1 || pivot_of(margin, plant, rows, m - 1, margin->r - 2) > FREED * margin->usual)
            found = row;
    }
    kmp_free(rows);
    return found;
}
