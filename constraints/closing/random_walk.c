/* SPDX-License-Identifier: BSD-3-Clause */
/* A walk on closed configurations: null spaces by complete pivoting of the dense scaled J, random combinations of
 * tangents as steps, least changes back to the loops. Random numbers come from a separate generator, so that all
 * machines walk alike. */
#include "constraints/closing/random_walk.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "model/data/body.h"
#include <math.h>
#include <string.h>

enum { MOST_ITERATIONS = 40, TRIES = 5 };
#define STEP  0.3 /* scaled, of the coordinate that moves most */
#define MOVED 0.2 /* least part of the step after closing */

/* A row that only deflections move opens by no more than they do: by a small unit it would pass for one of rounding. */
double kmp_walk_unit(const kempe_system *system, int k)
{
    const kmp_motion *motion = kmp_model_motion(system->model, k);
    return !motion->elastic ? system->scale[k] : motion->rotation ? 1 : system->length;
}

/* Takes the evaluator. NULL: no memory. */
static kmp_walk *new_walk(const kempe_system *system, kmp_evaluator *eval)
{
    kmp_walk *w = KMP_NEW(kmp_walk, 1);
    if (!w) {
        kmp_eval_free(eval);
        return NULL;
    }
    int n = system->n, m = system->m, size = m > n ? m : n;
    *w = (kmp_walk){.system = system, .n = n, .m = m, .eval = eval};
    const kmp_rounding *rounding = kmp_rounding_of(system);
    w->rank = rounding ? rounding->rank : -1;
    KMP_ARENA_MAKE(&w->arena, KMP_ROOM(double, m *n, &w->jacobian), KMP_ROOM(double, m, &w->h),
                   KMP_ROOM(double, m + n, &w->pivots), KMP_ROOM(double, n, &w->largest, &w->scale),
                   KMP_ROOM(int, size, &w->order, &w->row_order), KMP_ROOM(bool, m, &w->dropped));
    if (KMP_ARENA_EACH(&w->arena, double, size *size, &w->copy, &w->basis) && w->eval &&
        kmp_least_change_init(&w->least, w->eval)) {
        for (int k = 0; k < n; k++)
            w->scale[k] = kmp_walk_unit(system, k);
        return w;
    }
    kmp_walk_free(w);
    return NULL;
}

kmp_walk *kmp_walk_new(const kempe_system *system)
{
    return new_walk(system, kmp_eval_new(system, "tape"));
}

kmp_walk *kmp_walk_new_of_closures(const kempe_system *system)
{
    return new_walk(system, kmp_eval_new_of_closures(system));
}

void kmp_walk_free(kmp_walk *w)
{
    if (!w)
        return;
    kmp_least_change_free(&w->least);
    kmp_eval_free(w->eval);
    kmp_arena_free(&w->arena);
    kmp_free(w);
}

void kmp_walk_evaluate(kmp_walk *w, const double *q)
{
    const kempe_system *s = w->system;
    kmp_eval_closure(w->eval, 0, q);
    kmp_eval_dense_jacobian(w->eval, w->jacobian);
    for (int r = 0; r < w->m; r++)
        w->h[r] = w->excluded && w->excluded[r] ? 0 : w->eval->h[r] / s->row_scale[r];
    for (int k = 0; k < w->n; k++)
        for (int r = 0; r < w->m; r++)
            w->jacobian[r + k * w->m] *=
                (w->hold && w->hold[k]) || (w->excluded && w->excluded[r]) ? 0 : w->scale[k] / s->row_scale[r];
}

/* Selects the rows that closing ignores: the excluded ones, and with a given rank the rows beyond it. These are
 * dependent but for rounding, chosen at the start of closing and without regard to held coordinates. */
static void leave_out(kmp_walk *w, const double *q)
{
    const bool *hold = w->hold;
    w->hold = NULL;
    kmp_walk_evaluate(w, q);
    w->hold = hold;
    if (w->rank >= 0)
        kmp_walk_pivots(w, w->pivots);
    for (int k = 0; k < w->m; k++) {
        int r = w->rank >= 0 ? w->row_order[k] : k;
        w->dropped[r] = (w->rank >= 0 && k >= w->rank) || (w->excluded && w->excluded[r]);
    }
    w->eval->unmet.left_out = w->dropped;
}

bool kmp_walk_close(kmp_walk *w, double *q)
{
    const kmp_closer closer = kmp_least_change_closer(&w->least);
    const kmp_close_rule rule = kmp_least_change_rule(MOST_ITERATIONS);
    w->least.hold = w->hold;
    if (w->rank >= 0 || w->excluded)
        leave_out(w, q);
    bool closed = kmp_close(&closer, &rule, 0, q).closed;
    w->eval->unmet.left_out = NULL;
    kmp_walk_evaluate(w, q);
    return closed;
}

/* -- null spaces ------------------------------------------------------------------------------------- */

int kmp_walk_null_space(kmp_walk *w, int rows, int cols, double tolerance, int most)
{
    int all = rows < cols ? rows : cols, rank = 0;
    kmp_lu_complete(rows, cols, w->copy, NULL, w->row_order, w->order, w->pivots);
    while (rank < all && rank < most && w->pivots[rank] > tolerance * w->pivots[0])
        rank++;
    w->last = rank > 0 ? w->pivots[rank - 1] : 0;
    for (int k = rank; k < cols; k++)
        kmp_lu_null_vector(rows, cols, w->copy, w->order, rank, k, w->basis + (k - rank) * cols);
    return rank;
}

int kmp_walk_left(kmp_walk *w, double tolerance, int most)
{
    for (int r = 0; r < w->m; r++)
        for (int k = 0; k < w->n; k++)
            w->copy[k + r * w->n] = w->jacobian[r + k * w->m];
    return kmp_walk_null_space(w, w->n, w->m, tolerance, most);
}

int kmp_walk_tangents(kmp_walk *w, int most)
{
    memcpy(w->copy, w->jacobian, (size_t)(w->m * w->n) * sizeof *w->copy);
    most = w->rank >= 0 && w->rank < most ? w->rank : most;
    int rank = kmp_walk_null_space(w, w->m, w->n, kmp_rounding_zero(w->system, KMP_RANK), most);
    for (int k = 0; k < w->n - rank; k++) {
        double sum = 0, *x = w->basis + k * w->n;
        for (int i = 0; i < w->n; i++)
            sum += x[i] * x[i];
        for (int i = 0; i < w->n; i++)
            x[i] /= sqrt(sum);
    }
    return rank;
}

double kmp_walk_random(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 23) - 1;
}

void kmp_walk_pivots(kmp_walk *w, double *pivots)
{
    memcpy(w->copy, w->jacobian, (size_t)(w->m * w->n) * sizeof *w->copy);
    kmp_pivots_complete(w->m, w->n, w->copy, w->largest, w->row_order, w->order, pivots);
}

/* -- random directions --------------------------------------------------------------------------------- */

/* Writes a random direction of the tangent space to `direction`; its largest entry is one. */
static void random_tangent(kmp_walk *w, int count, unsigned *state, double *direction)
{
    double most = 0;
    memset(direction, 0, (size_t)w->n * sizeof *direction);
    for (int c = 0; c < count; c++) {
        double part = kmp_walk_random(state);
        for (int k = 0; k < w->n; k++)
            direction[k] += part * w->basis[k + c * w->n];
    }
    for (int k = 0; k < w->n; k++)
        most = fmax(most, fabs(direction[k]));
    for (int k = 0; k < w->n && most > 0; k++)
        direction[k] /= most;
}

double kmp_walk_distance(const kmp_walk *w, const double *a, const double *b)
{
    double most = 0;
    for (int k = 0; k < w->n; k++)
        most = fmax(most, fabs(a[k] - b[k]) / w->scale[k]);
    return most;
}

bool kmp_walk_wander(kmp_walk *w, const double *from, unsigned *state, double *direction, double *to)
{
    kmp_walk_evaluate(w, from);
    int count = w->n - kmp_walk_tangents(w, w->n);
    double step = STEP;
    for (int k = 0; k < TRIES && count > 0; k++, step *= 0.4) {
        random_tangent(w, count, state, direction);
        for (int c = 0; c < w->n; c++)
            to[c] = from[c] + step * direction[c] * w->scale[c];
        if (kmp_walk_close(w, to) && kmp_walk_distance(w, to, from) > MOVED * step &&
            kmp_walk_distance(w, to, from) < 3 * step)
            return true;
        kmp_walk_evaluate(w, from);
        count = w->n - kmp_walk_tangents(w, w->n);
    }
    return false;
}
