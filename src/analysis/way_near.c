/* SPDX-License-Identifier: BSD-3-Clause */
/* KINSOL on the coordinates that R depends on, with the exact Kr; Newton's steps to round-off. */
#include "analysis/way.h"
#include "base/memory.h"
#include "constraints/kinsol.h"
#include <math.h>
#include <string.h>

enum { GO = 0, RETRY = 1, MOST_POLISH = 6 };

/* -- near -------------------------------------------------------------------------------------------- */

static bool at_unknowns(kmp_way *w, const double *x)
{
    for (int i = 0; i < w->n; i++)
        w->trial[i] = w->q[i];
    for (int k = 0; k < w->active_count; k++)
        w->trial[w->l->part.u[w->active[k]]] = x[k];
    return kmp_way_at(w, w->trial);
}

static int newton_residual(void *self, const double *x, double *r)
{
    kmp_way *w = self;
    if (!at_unknowns(w, x))
        return RETRY;
    for (int k = 0; k < w->active_count; k++)
        r[k] = w->l->residual[w->active[k]];
    return GO;
}

static int newton_matrix(void *self, const double *x, double *a)
{
    kmp_way *w = self;
    const kmp_linear *l = w->l;
    if (!at_unknowns(w, x))
        return RETRY;
    kmp_linear_matrices(w->l);
    double residual = kmp_way_measure(l, w->right, &w->most);
    if (w->active_seen++ > 0 || !(w->told >= 0)) /* KINSOL begins where the way down ended */
        kmp_way_note(w, residual);
    for (int j = 0; j < w->active_count; j++)
        for (int i = 0; i < w->active_count; i++)
            a[i + j * w->active_count] = l->stiffness[w->active[i] + w->active[j] * l->p];
    return GO;
}

bool kmp_way_is_idle(const kmp_linear *l, int k, const double *work)
{
    for (int i = 0; i < l->p; i++)
        if (fabs(l->stiffness[i + k * l->p]) * kmp_way_scale(l, i) * kmp_way_scale(l, k) > KMP_WAY_FLAT * work[i])
            return false;
    return true;
}

static void find_active(kmp_way *w)
{
    w->active_count = 0;
    for (int k = 0; k < w->l->p; k++)
        if (!kmp_way_is_idle(w->l, k, w->work))
            w->active[w->active_count++] = k;
}

/* Where it fails q stays as it is. */
kempe_status kmp_way_newton(kmp_way *w)
{
    const kmp_linear *l = w->l;
    int p = l->p, done = 0;
    double *x = KMP_NEW(double, 3 * p), *scale_x = x ? x + p : NULL, *scale_f = x ? x + 2 * p : NULL;
    if (!x)
        return kmp_fail_memory(l->system->context);
    find_active(w);
    w->active_seen = 0;
    for (int k = 0; k < w->active_count; k++) {
        int a = w->active[k];
        x[k] = w->q[l->part.u[a]];
        scale_x[k] = 1 / kmp_way_scale(l, a);
        scale_f[k] = kmp_way_scale(l, a) / w->work[a];
    }
    const kmp_kinsol_problem problem = {w, w->active_count, scale_x, scale_f, newton_residual, newton_matrix};
    bool found = w->active_count == 0 || kmp_kinsol_solve(&problem, KMP_WAY_BALANCED, x, &done);
    kempe_status status = found ? KEMPE_OK : KEMPE_E_FAILED;
    if (status == KEMPE_OK && !at_unknowns(w, x))
        status = KEMPE_E_FAILED;
    if (status != KEMPE_OK)
        (void)kmp_way_at(w, w->q);
    if (!kmp_way_arrive(w) && status == KEMPE_OK)
        status = w->status != KEMPE_OK ? w->status : KEMPE_E_FAILED;
    kmp_free(x);
    return status;
}

/* Newton's steps as they are, while the residual falls. */
void kmp_way_polish(kmp_way *w)
{
    double far = 0;
    for (int k = 0; k < MOST_POLISH && w->residual > 0; k++) {
        double before = w->residual, *q = w->begin; /* not wanted any more */
        memcpy(q, w->q, (size_t)w->n * sizeof *q);
        if (!kmp_way_decompose(w) || !kmp_way_direction(w, false))
            return;
        far = kmp_way_spread(w);
        if (kmp_way_try(w, 1) && kmp_way_arrive(w) && w->residual < 0.5 * before) {
            kmp_way_note_step(w, far);
            kmp_way_note(w, w->residual);
            continue;
        }
        if (kmp_way_at(w, q))
            (void)kmp_way_arrive(w);
        return;
    }
}
