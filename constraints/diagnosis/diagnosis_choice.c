/* SPDX-License-Identifier: BSD-3-Clause */
/* Possible independent coordinates; the loops as blocks of Jv in order of solution, with their closures. */
#include "constraints/diagnosis/diagnosis_choice.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/diagnosis/diagnosis_rank.h"
#include "constraints/partition/reduction.h"
#include "linalg/dense/dense.h"
#include <math.h>

/* b (r x p) = Bvu, scaled, from the scaled J here; false when singular. */
static bool dependent_rates(const kmp_examination *x, double *jv, int *pivot, double *b)
{
    const kmp_partition *part = x->part;
    const double *jacobian = kmp_diagnosis_jacobian(x, 0);
    int r = part->r, m = part->m;
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++)
            jv[i + k * r] = jacobian[part->rows[i] + part->v[k] * m];
        for (int k = 0; k < part->p; k++)
            b[i + k * r] = -jacobian[part->rows[i] + part->u[k] * m];
    }
    if (kmp_lu_factor(r, jv, pivot) != 0)
        return false;
    kmp_lu_solve(r, jv, pivot, part->p, b);
    return true;
}

/* max |B| with v_i independent in place of u_k. */
static double after_exchange(const double *b, int r, int p, int i, int k)
{
    double pivot = b[i + k * r], most = fabs(1 / pivot);
    for (int c = 0; c < p; c++)
        for (int j = 0; j < r; j++) {
            double now = b[j + c * r];
            if (j == i && c == k)
                continue;
            if (j == i || c == k)
                now /= pivot;
            else
                now -= b[j + k * r] * b[i + c * r] / pivot;
            most = fmax(most, fabs(now));
        }
    return most;
}

static kmp_alternative best_exchange(const kmp_partition *part, const double *b, int i)
{
    kmp_alternative best = {part->v[i], -1, INFINITY, false};
    for (int k = 0; k < part->p; k++) {
        if (!(fabs(b[i + k * part->r]) > 1e-12))
            continue;
        double most = after_exchange(b, part->r, part->p, i, k);
        if (most < best.max_b) {
            best.max_b = most;
            best.instead = part->u[k];
        }
    }
    return best;
}

void kmp_diagnosis_alternatives(kmp_examination *x)
{
    const kmp_partition *part = x->part;
    int r = part->r, p = part->p;
    double *jv = KMP_ARENA_NEW(x->arena, double, r *r), *b = KMP_ARENA_NEW(x->arena, double, r *p);
    int *pivot = KMP_ARENA_NEW(x->arena, int, r);
    x->diagnosis->alternatives = KMP_ARENA_NEW(x->arena, kmp_alternative, part->n);
    if (r == 0 || p == 0 || !jv || !b || !pivot || !x->diagnosis->alternatives || !dependent_rates(x, jv, pivot, b))
        return;
    for (int k = 0, i = 0, c = 0; c < part->n; c++) {
        if (k < p && part->u[k] == c) {
            x->diagnosis->alternatives[c] = (kmp_alternative){c, -1, part->max_b, true};
            k++;
        } else
            x->diagnosis->alternatives[c] = best_exchange(part, b, i++);
    }
    x->diagnosis->alternative_count = part->n;
}
