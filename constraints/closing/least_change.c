/* SPDX-License-Identifier: BSD-3-Clause */
/* Damped least changes: the Levenberg-Marquardt equations of the closed rows with mu from |h|, so that steps stay
 * bounded where rows are dependent and convergence is quadratic where they are not. Small ones by the normal equations,
 * dense; large ones as one sparse matrix, which has no product J J'. */
#include "constraints/closing/least_change.h"
#include "base/memory.h"
#include "constraints/evaluation/row_residuals.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include <math.h>
#include <string.h>

/* Sparse from this many rows, with fewer than one in SPARSE_BELOW entries nonzero. */
enum { SPARSE_FROM = 24, SPARSE_BELOW = 8 };

/* -- making one -------------------------------------------------------------------------------------- */

static bool make_sparse(kmp_least_change *c, const kmp_pattern *jac, int n, int m)
{
    int count = n + m + 2 * jac->count, at = n + m, *row, *col;
    kmp_arena room = {0};
    if (KMP_ARENA_EACH(&room, int, count, &row, &col)) {
        for (int k = 0; k < n + m; k++)
            row[k] = col[k] = k;
        for (int e = 0; e < jac->count; e++, at += 2) {
            row[at] = col[at + 1] = n + jac->row[e];
            col[at] = row[at + 1] = jac->col[e];
        }
        c->sparse = kmp_sparse_new(n + m, count, row, col, true);
    }
    kmp_arena_free(&room);
    return c->sparse;
}

bool kmp_least_change_init(kmp_least_change *c, kmp_evaluator *eval)
{
    const kmp_pattern *jac = &eval->system->jacobian;
    int n = eval->n, m = eval->m, places = n + m + 2 * jac->count;
    bool large = m > SPARSE_FROM && places < (long)(n + m) * (n + m) / SPARSE_BELOW;
    *c = (kmp_least_change){.eval = eval};
    if (!KMP_ARENA_MAKE(&c->arena, KMP_ROOM(double, jac->count, &c->entry), KMP_ROOM(int, n + 1, &c->start),
                        KMP_ROOM(int, jac->count, &c->column), KMP_ROOM(double, n + m, &c->right),
                        KMP_ROOM(double, n, &c->dx), KMP_ROOM(double, large ? places : m *m, &c->matrix)))
        return false;
    kmp_sort_entries(n, jac->count, jac->col, c->start, c->column);
    return !large || make_sparse(c, jac, n, m);
}

KMP_CLEARS(kmp_least_change, c, kmp_sparse_free(c->sparse), kmp_arena_free(&c->arena))

/* -- a correction ------------------------------------------------------------------------------------ */

/* Factors J J' + `square`. false: singular. */
static bool factor_sparse(kmp_least_change *c, double square)
{
    const kmp_pattern *jac = &c->eval->system->jacobian;
    int n = c->eval->n, m = c->eval->m;
    double *value = c->matrix + n + m;
    for (int k = 0; k < n + m; k++)
        c->matrix[k] = k < n ? 1 : square;
    for (int e = 0; e < jac->count; e++) {
        *value++ = c->entry[e];
        *value++ = -c->entry[e];
    }
    return kmp_sparse_factor(c->sparse, c->matrix) == KMP_SPARSE_FACTORED;
}

static bool factor_dense(kmp_least_change *c, double square)
{
    const int *row = c->eval->system->jacobian.row;
    int m = c->eval->m;
    memset(c->matrix, 0, (size_t)(m * m) * sizeof *c->matrix);
    for (int r = 0; r < m; r++)
        c->matrix[r + r * m] = square;
    for (int k = 0; k < c->eval->n; k++)
        for (int a = c->start[k]; a < c->start[k + 1]; a++)
            for (int b = c->start[k]; b <= a; b++) {
                int i = c->column[a], j = c->column[b], high = row[i] > row[j] ? row[i] : row[j];
                c->matrix[high + (row[i] + row[j] - high) * m] += c->entry[i] * c->entry[j];
            }
    return kmp_cholesky_factor(m, c->matrix) == 0;
}

static int damp(void *self, double damping)
{
    kmp_least_change *c = self;
    double square = damping * damping;
    c->damping = damping;
    return !(c->sparse ? factor_sparse(c, square) : factor_dense(c, square));
}

static void evaluate(void *self, double t, const double *q)
{
    kmp_least_change *c = self;
    kmp_eval_closure(c->eval, t, q);
    if (c->vectors)
        kmp_rotation_vectors_lend(c->vectors, c->eval);
}

static int place(void *self, double t, const double *q)
{
    kmp_least_change *c = self;
    const kempe_system *s = c->eval->system;
    const kmp_pattern *jac = &s->jacobian;
    evaluate(c, t, q);
    for (int e = 0; e < jac->count; e++) {
        bool none = (c->hold && c->hold[jac->col[e]]) || !kmp_eval_counts(c->eval, jac->row[e]);
        c->entry[e] = none ? 0 : c->eval->jacobian[e] * s->scale[jac->col[e]] / s->row_scale[jac->row[e]];
    }
    return damp(c, fmax(kmp_close_length(c->eval), KMP_LEAST_DAMPING));
}

static bool correct(void *self, const double *violation, double *dx)
{
    kmp_least_change *c = self;
    const kempe_system *s = c->eval->system;
    int n = s->n, m = s->m;
    double *y = c->right + n;
    for (int r = 0; r < m; r++)
        y[r] = kmp_eval_counts(c->eval, r) ? -violation[r] / s->row_scale[r] : 0;
    if (c->sparse) {
        memset(c->right, 0, (size_t)n * sizeof *c->right);
        kmp_sparse_solve(c->sparse, 1, c->right);
    } else {
        kmp_cholesky_solve(m, c->matrix, y);
    }
    for (int k = 0; k < n; k++) {
        double sum = 0;
        for (int a = c->start[k]; a < c->start[k + 1]; a++)
            sum += c->entry[c->column[a]] * y[s->jacobian.row[c->column[a]]];
        dx[k] = sum * s->scale[k];
    }
    return true;
}

/* Returns the |h| predicted after dq: J dq + h = -mu^2 y. */
static double promise(void *self)
{
    const kmp_least_change *c = self;
    double sum = 0;
    for (int r = 0; r < c->eval->m; r++)
        sum += c->right[c->eval->n + r] * c->right[c->eval->n + r];
    return c->damping * c->damping * sqrt(sum);
}

kmp_closer kmp_least_change_closer(kmp_least_change *c)
{
    return (kmp_closer){.self = c,
                        .eval = c->eval,
                        .scale = c->eval->system->scale,
                        .count = c->eval->n,
                        .dx = c->dx,
                        .evaluate = evaluate,
                        .place = place,
                        .correct = correct,
                        .damp = damp,
                        .promise = promise};
}

kmp_close_rule kmp_least_change_rule(int most)
{
    return (kmp_close_rule){
        .most = most, .least = true, .longest = KMP_LONGEST_CORRECTION, .enough = KMP_CLOSED_ENOUGH};
}
