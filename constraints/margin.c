/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/margin.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

/* A last pivot below this fraction of the first at the start is near a change point; what is usual then. */
#define NEAR_START 1e-2
#define USUAL      0.1

bool kmp_margin_init(kmp_margin *margin, const kempe_system *system, const kmp_partition *part)
{
    int m = system->m, n = system->n;
    *margin = (kmp_margin){.system = system, .r = part->r, .usual = part->r > 0 ? part->pivots[part->r - 1] : 1};
    if (part->r > 0 && margin->usual < NEAR_START * part->pivots[0])
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

/* The r-th pivot of some rows (all when `rows` is NULL) of the scaled J. */
static double last_pivot(kmp_margin *margin, const kmp_plant *plant, const int *rows, int count)
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
    return margin->pivots[margin->r - 1];
}

double kmp_margin_at(kmp_margin *margin, const kmp_plant *plant)
{
    if (margin->r == 0)
        return 1;
    margin->last = last_pivot(margin, plant, NULL, margin->system->m);
    margin->usual = fmax(margin->usual, margin->last);
    return margin->last / margin->usual;
}

double kmp_margin_of_rows(kmp_margin *margin, const kmp_plant *plant, const kmp_partition *part)
{
    return margin->r == part->m || margin->r == 0 ? 1 : last_pivot(margin, plant, part->rows, margin->r) / margin->last;
}
