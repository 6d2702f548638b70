/* SPDX-License-Identifier: BSD-3-Clause */
/* Damped least changes: the Levenberg-Marquardt equations of the closed rows with mu from |h|, so that steps stay
 * bounded where rows are dependent and convergence is quadratic where they are not. Small ones by the normal equations,
 * dense; large ones as one sparse matrix, which has no product J J'. */
#include "constraints/closing/least_change.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/kinds/kind.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/dot.h"
#include "linalg/sparse.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

/* Rotation vectors of aligned axes, from the skew part and the trace of the relative rotation, and their rates by Bortz
 * 1971. They replace the rows of a closure while a search is far from it. */

bool kmp_rotation_vectors_init(kmp_rotation_vectors *v, const kempe_system *s, kmp_arena *arena)
{
    const kempe_model *model = s->model;
    *v = (kmp_rotation_vectors){.system = s};
    for (int c = 0; c < model->closure_count; c++)
        v->count += kmp_closure_aligns(kmp_closure_parts_of(model->closures[c].kind));
    if (v->count == 0)
        return true;
    v->vector = kmp_arena_alloc(arena, (size_t)v->count, sizeof *v->vector);
    v->rates = kmp_arena_alloc(arena, (size_t)v->count, sizeof *v->rates);
    v->axes = kmp_arena_alloc(arena, (size_t)s->n, sizeof *v->axes);
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(int, v->count, &v->closure), KMP_ROOM(double, v->count, &v->angle),
                        KMP_ROOM(int, s->m, &v->at, &v->component), KMP_ROOM(int, v->count * s->n, &v->side),
                        KMP_ROOM(kmp_pose, model->body_count, &v->poses), KMP_ROOM(double, s->m, &v->h),
                        KMP_ROOM(double, s->jacobian.count, &v->jacobian)))
        return false;
    for (int c = 0, i = 0; c < model->closure_count; c++)
        if (kmp_closure_aligns(kmp_closure_parts_of(model->closures[c].kind)))
            v->closure[i++] = c;
    for (int r = 0; r < s->m; r++) {
        v->at[r] = v->component[r] = -1;
        for (int i = 0; i < v->count; i++)
            if (v->closure[i] == s->rows[r].closure) {
                v->at[r] = i;
                v->component[r] =
                    s->rows[r].component - kmp_closure_parts_of(model->closures[v->closure[i]].kind)->force->rows;
            }
    }
    /* Rotations between the ground and both points cancel. */
    for (int i = 0; i < v->count; i++) {
        int *side = v->side + (ptrdiff_t)i * s->n;
        for (int end = 0; end < 2; end++)
            for (int b = model->points[model->closures[v->closure[i]].point[end]].body; b > 0;
                 b = model->bodies[b].parent)
                for (int k = 0; k < model->bodies[b].motion_count; k++)
                    side[model->bodies[b].first_motion + k] += end == 1 ? 1 : -1;
    }
    return true;
}

/* theta e of R; at half a turn, where both e and -e hold, the largest component is positive but for rounding. */
static double rotation_vector(double r[3][3], double x[3])
{
    double sine = 0, cosine = (r[0][0] + r[1][1] + r[2][2] - 1) / 2, size = 0;
    int largest = 0;
    for (int k = 0; k < 3; k++) {
        x[k] = (r[(k + 2) % 3][(k + 1) % 3] - r[(k + 1) % 3][(k + 2) % 3]) / 2;
        sine = hypot(sine, x[k]);
        largest = r[k][k] > r[largest][largest] ? k : largest;
    }
    double angle = atan2(sine, cosine);
    if (cosine > 0) {
        for (int k = 0; k < 3; k++)
            x[k] *= sine > 0 ? angle / sine : 1;
        return angle;
    }
    double sign = x[largest] < 0 ? -1 : 1; /* a column of (R + R')/2 - cosine 1 = (1 - cosine) e e' */
    for (int k = 0; k < 3; k++) {
        x[k] = sign * ((r[k][largest] + r[largest][k]) / 2 - (k == largest ? cosine : 0));
        size = hypot(size, x[k]);
    }
    for (int k = 0; k < 3; k++)
        x[k] *= angle / size;
    return angle;
}

/* From w in the ground's axes, which the first point's turn into, to x'. */
static void rates_of(const double x[3], double angle, double first[3][3], double out[3][3])
{
    /* (1 - theta/2 cot(theta/2)) / theta^2 is 1/12 + theta^2/720 + .. */
    double half = angle / 2, factor = angle < 1e-3 ? 1.0 / 12 : (1 - half * cos(half) / sin(half)) / (angle * angle);
    for (int k = 0; k < 3; k++) {
        double w[3] = {first[k][0], first[k][1], first[k][2]}, once[3], twice[3]; /* the ground's axis k */
        kmp_cross3(x, w, once);
        kmp_cross3(x, once, twice);
        for (int i = 0; i < 3; i++)
            out[i][k] = w[i] - once[i] / 2 + factor * twice[i];
    }
}

void kmp_rotation_vectors_measure(kmp_rotation_vectors *v, const kmp_evaluator *eval)
{
    const kempe_system *s = v->system;
    const kmp_pose_charts charts = {s->chart_count, s->chart_first, s->chart_before, eval->chart};
    if (v->count > 0)
        kmp_pose_of_charts(s->model, &charts, eval->q, v->poses, v->axes);
    for (int i = 0; i < v->count; i++) {
        const kmp_closure *closure = &s->model->closures[v->closure[i]];
        kmp_pose first, second;
        double r[3][3];
        kmp_pose_of_point(s->model, v->poses, eval->q, closure->point[0], &first);
        kmp_pose_of_point(s->model, v->poses, eval->q, closure->point[1], &second);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                r[a][b] =
                    first.r[0][a] * second.r[0][b] + first.r[1][a] * second.r[1][b] + first.r[2][a] * second.r[2][b];
        v->angle[i] = rotation_vector(r, v->vector[i]);
        rates_of(v->vector[i], v->angle[i], first.r, v->rates[i]);
    }
}

void kmp_rotation_vectors_lend(kmp_rotation_vectors *v, kmp_evaluator *eval)
{
    const kempe_system *s = v->system;
    const kmp_pattern *jac = &s->jacobian;
    kmp_rotation_vectors_measure(v, eval);
    memcpy(v->h, eval->h, (size_t)s->m * sizeof *v->h);
    memcpy(v->jacobian, eval->jacobian, (size_t)jac->count * sizeof *v->jacobian);
    for (int r = 0; r < s->m; r++)
        if (v->at[r] >= 0 && v->component[r] >= 0)
            v->h[r] = v->vector[v->at[r]][v->component[r]];
    for (int e = 0; e < jac->count; e++) {
        int i = v->at[jac->row[e]], k = v->component[jac->row[e]], col = jac->col[e];
        if (i >= 0 && k >= 0)
            v->jacobian[e] = v->side[i * s->n + col] * kmp_dot3(v->rates[i][k], v->axes[col]);
    }
    kmp_eval_use_closure(eval, eval->t, eval->q, v->h, v->jacobian, eval->h_t);
}

/* Sparse from this many rows, with fewer than one in SPARSE_BELOW entries nonzero. */
enum { SPARSE_FROM = 24, SPARSE_BELOW = 8 };

/* -- making one -------------------------------------------------------------------------------------- */

static bool make_sparse(kmp_least_change *c, const kmp_pattern *jac, int n, int m)
{
    int count = n + m + 2 * jac->count, at = n + m, *row, *col, *group;
    kmp_arena room = {0};
    if (KMP_ARENA_MAKE(&room, KMP_ROOM(int, count, &row, &col), KMP_ROOM(int, m, &group))) {
        for (int r = 0; r < m; r++)
            group[r] = c->eval->system->rows[r].closure;
        for (int k = 0; k < n + m; k++)
            row[k] = col[k] = k;
        for (int e = 0; e < jac->count; e++, at += 2) {
            row[at] = col[at + 1] = n + jac->row[e];
            col[at] = row[at + 1] = jac->col[e];
        }
        c->sparse = kmp_sparse_new_saddle(n, m, count, row, col, group);
    }
    kmp_arena_free(&room);
    return c->sparse;
}

bool kmp_least_change_init(kmp_least_change *c, kmp_evaluator *eval)
{
    const kmp_pattern *jac = &eval->system->jacobian;
    int n = eval->n, m = eval->m, places = n + m + 2 * jac->count;
    bool large = m > SPARSE_FROM && places < (long)(n + m) * (n + m) / SPARSE_BELOW;
    *c = (kmp_least_change){.eval = eval, .scale = eval->system->scale};
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
        c->entry[e] = none ? 0 : c->eval->jacobian[e] * c->scale[jac->col[e]] / s->row_scale[jac->row[e]];
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
        dx[k] = sum * c->scale[k];
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
                        .scale = c->scale,
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
