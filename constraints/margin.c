/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/margin.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <math.h>

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

double kmp_margin_at(kmp_margin *margin, const kmp_plant *plant)
{
    const kempe_system *s = margin->system;
    if (margin->r == 0)
        return 1;
    kmp_plant_dense_jacobian(plant, margin->a);
    for (int k = 0; k < s->n; k++)
        for (int i = 0; i < s->m; i++)
            margin->a[i + k * s->m] *= s->scale[k] / s->row_scale[i];
    kmp_lu_complete(s->m, s->n, margin->a, NULL, margin->row, margin->col, margin->pivots);
    margin->usual = fmax(margin->usual, margin->pivots[margin->r - 1]);
    return margin->pivots[margin->r - 1] / margin->usual;
}
