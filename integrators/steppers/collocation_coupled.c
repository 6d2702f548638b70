/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method for the stages with a Jacobian of each, in one system of all stages:
 *
 *     sum over the stages j of (delta_ij I - h A_ij f_v - (h A)^2_ij f_q) change_j = f(stage i) - g_i
 *
 * with f_q, f_v at stage i. If a stiff force turns its direction along a step, one Jacobian for all stages converges
 * slowly, however smooth the solution is: its error is the stiffness times the turn. This system has no such error and
 * costs more. A column of all Jacobians is one evaluation of all stages, which are the lanes of the rows.
 *
 * The matrix is inverted in place, by Gauss and Jordan: a solution is then a sum of columns, which vector registers do
 * several times as fast as two triangular solutions, each a chain of dependent operations. */
#include "integrators/steppers/collocation_coupled.h"
#include "base/clones.h"
#include "base/simd4.h"
#include "integrators/steppers/collocation.h"
#include "integrators/steppers/collocation_choice.h"
#include "integrators/steppers/collocation_newton.h"
#include "integrators/steppers/collocation_step.h"

#include <float.h>
#include <string.h>

typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));
typedef int64_t eight_mask __attribute__((vector_size(64), aligned(8), may_alias));

/* Largest system of all stages; lanes of a vector. */
enum { MOST_COUPLED = 240, V = 8 };

/* Rows of the system: all lanes of all unknowns, up to a multiple of V. The rows of lanes without a stage are zero. */
static int row_count(const kmp_collocation *s)
{
    return (s->inner * s->w + V - 1) / V * V;
}

bool kmp_collocation_allocate_coupled(kmp_collocation *s)
{
    kmp_arena *a = &s->base.arena;
    int count = s->inner * s->s;
    size_t rows = (size_t)row_count(s);
    if (count > MOST_COUPLED)
        return true;
    s->all = kmp_arena_aligned(a, (size_t)(s->p + s->inner) * (size_t)s->inner * (size_t)s->w);
    s->coupled = kmp_arena_aligned(a, rows * (size_t)count);
    s->joint = kmp_arena_aligned(a, 2 * rows);
    s->open = kmp_arena_aligned(a, rows);
    s->at_prediction = kmp_arena_aligned(a, (size_t)s->n * (size_t)s->w);
    s->coupled_pivot = KMP_ARENA_NEW(a, int, count);
    return !a->failed;
}

/* -- Jacobians ----------------------------------------------------------------------------------------- */

/* Column c of the Jacobians of all stages, f_c; zero in lanes without a stage. */
static int differentiate(kmp_collocation *s, int c)
{
    int w = s->w;
    double before[V], by[V] = {0}, *x = s->stage + c * w, *column = s->all + c * s->inner * w;
    const double *f = s->f + s->p * w, *base = s->at_prediction + s->p * w;
    memcpy(before, x, (size_t)w * sizeof *x);
    for (int l = 0; l < w; l++)
        by[l] = kmp_collocation_displace(s, c, &x[l]);
    int said = kmp_collocation_evaluate(s, s->s);
    memcpy(x, before, (size_t)w * sizeof *x);
    for (int k = 0; k < s->inner; k++)
        for (int l = 0; l < w; l++)
            column[k * w + l] = l < s->s ? (f[k * w + l] - base[k * w + l]) / by[l] : 0;
    return said;
}

/* The evaluation at the predicted stages is that of the first iteration, too. */
static int differentiate_all(kmp_collocation *s)
{
    size_t bytes = (size_t)(s->n * s->w) * sizeof *s->f;
    int said = kmp_collocation_evaluate(s, s->s);
    memcpy(s->at_prediction, s->f, bytes);
    for (int c = 0; c < s->p + s->inner && said == KMP_GO; c++)
        said = differentiate(s, c);
    memcpy(s->f, s->at_prediction, bytes);
    s->evaluated = said == KMP_GO;
    return said;
}

/* -- the system of all stages -------------------------------------------------------------------------- */

/* column[k] = -once of_v[k] - twice of_q[k], for n unknowns of w lanes; of_q NULL: without. */
static KMP_CLONES void fill_column(int n, int w, const double *once, const double *of_v, const double *twice,
                                   const double *of_q, double *column)
{
    for (int l = 0; l < w; l += KMP_FOUR)
        for (int k = l; k < n * w; k += w)
            KMP_FOUR_AT(column + k) = KMP_FOUR_CONST(once + l) * -KMP_FOUR_CONST(of_v + k);
    for (int l = 0; of_q && l < w; l += KMP_FOUR)
        for (int k = l; k < n * w; k += w)
            KMP_FOUR_AT(column + k) -= KMP_FOUR_CONST(twice + l) * KMP_FOUR_CONST(of_q + k);
}

/* The open row with the largest magnitude, the first of such rows; -1: none is usable. */
static KMP_INTO_CLONES int find_pivot(int rows, const double *column, const double *open)
{
    eight most = {0};
    eight_mask at = {0}, here = {0, 1, 2, 3, 4, 5, 6, 7};
    double best = 0;
    int row = -1;
    for (int i = 0; i < rows; i += V, here += V) {
        eight x = *(const eight *)(column + i) * *(const eight *)(open + i), size = (eight)((eight_mask)x & INT64_MAX);
        eight_mask more = size > most;
        most = (eight)((more & (eight_mask)size) | (~more & (eight_mask)most));
        at = (more & here) | (~more & at);
    }
    for (int l = 0; l < V; l++)
        if (most[l] > best || (row >= 0 && most[l] == best && at[l] < row)) {
            best = most[l];
            row = (int)at[l];
        }
    return best <= DBL_MAX ? row : -1;
}

/* A row of the elimination, the inverse of its pivot, and the column of that, zero in that row. */
typedef struct pivoted {
    int row;
    double inverse, *column;
} pivoted;

/* Takes the pivot of a column, which becomes that of the inverse. false: none is usable. */
static KMP_INTO_CLONES bool take_pivot(int rows, double *own, double *open, pivoted *p)
{
    p->row = find_pivot(rows, own, open);
    if (p->row < 0)
        return false;
    p->inverse = 1 / own[p->row];
    open[p->row] = 0;
    memcpy(p->column, own, (size_t)rows * sizeof *own);
    p->column[p->row] = 0;
    for (int i = 0; i < rows; i += V)
        *(eight *)(own + i) = *(eight *)(p->column + i) * -p->inverse;
    own[p->row] = p->inverse;
    return true;
}

static KMP_INTO_CLONES void eliminate(int rows, const pivoted *p, double *other)
{
    double f = other[p->row] * p->inverse;
    for (int i = 0; i < rows; i += V)
        *(eight *)(other + i) -= f * *(const eight *)(p->column + i);
    other[p->row] = f;
}

/* One elimination after the other in one pass over the column, which halves the transfers from and to memory. */
static KMP_INTO_CLONES void eliminate_two(int rows, const pivoted *p, const pivoted *next, double *restrict other)
{
    const double *x = p->column, *y = next->column;
    double f = other[p->row] * p->inverse, g = (other[next->row] - f * x[next->row]) * next->inverse;
    for (int i = 0; i < rows; i += V)
        *(eight *)(other + i) = (*(eight *)(other + i) - f * *(const eight *)(x + i)) - g * *(const eight *)(y + i);
    other[p->row] = f - g * y[p->row];
    other[next->row] = g;
}

/* Eliminates columns k and k + 1, or k alone if it is the last, from all others. */
static KMP_INTO_CLONES bool eliminate_pair(int rows, int count, int k, double *a, double *room, double *open,
                                           int *pivot)
{
    double *own = a + (ptrdiff_t)k * rows, *beside = own + rows;
    pivoted p = {.column = room}, next = {.column = room + rows};
    bool single = k + 1 == count;
    if (!take_pivot(rows, own, open, &p))
        return false;
    pivot[k] = p.row;
    if (!single) {
        eliminate(rows, &p, beside);
        if (!take_pivot(rows, beside, open, &next))
            return false;
        pivot[k + 1] = next.row;
        eliminate(rows, &next, own);
    }
    for (int j = 0; j < count; j++) {
        double *other = a + (ptrdiff_t)j * rows;
        if (j == k || j == k + 1)
            continue;
        if (single)
            eliminate(rows, &p, other);
        else
            eliminate_two(rows, &p, &next, other);
    }
    return true;
}

static KMP_INTO_CLONES bool invert_rows(int rows, int count, double *a, double *room, double *open, int *pivot)
{
    for (int i = 0; i < rows; i++)
        open[i] = 1;
    for (int k = 0; k < count; k += 2)
        if (!eliminate_pair(rows, count, k, a, room, open, pivot))
            return false;
    return true;
}

/* Inverts in place, rows x count: the row of unknown k is pivot[k], whose column is that of b[pivot[k]]. No row moves:
 * `open` is 1 in those that may be pivots. room: 2 rows values. Loops over the rows of four unknowns and fewer are
 * unrolled. false: singular. */
static KMP_CLONES bool invert(int rows, int count, double *a, double *room, double *open, int *pivot)
{
    return rows == V       ? invert_rows(V, count, a, room, open, pivot)
           : rows == 2 * V ? invert_rows(2 * V, count, a, room, open, pivot)
           : rows == 4 * V ? invert_rows(4 * V, count, a, room, open, pivot)
                           : invert_rows(rows, count, a, room, open, pivot);
}

/* x = sum of the columns times b. */
static KMP_CLONES void multiply(int rows, int count, const double *a, const int *pivot, const double *b, double *x)
{
    for (int i = 0; i < rows; i += V) {
        eight sum = {0};
        for (int j = 0; j < count; j++)
            sum += b[pivot[j]] * *(const eight *)(a + (ptrdiff_t)j * rows + i);
        *(eight *)(x + i) = sum;
    }
}

kmp_collocation_outcome kmp_collocation_prepare_coupled(kmp_collocation *s, double h)
{
    /* Matrices of all stages. */
    s->base.work.matrices += s->s;
    s->factored = false;
    int said = s->whole ? KMP_GO : differentiate_all(s);
    for (int i = 0; s->whole && i < s->s && said == KMP_GO; i++) {
        double t = kmp_collocation_copy_stage(s, i, s->place);
        said = kmp_collocation_take_exact(s, t, s->place, s->jacobian);
        for (int k = 0; k < (s->p + s->inner) * s->inner; k++)
            s->all[k * s->w + i] = s->jacobian[k];
    }
    for (int k = 0; k < (s->p + s->inner) * s->inner; k++) /* for the filter of the estimate */
        s->jacobian[k] = s->all[k * s->w];
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    if (!kmp_collocation_factor(s, h))
        return KMP_COLLOCATION_BAD_ITERATION;
    /* Columns of unknowns c of stages j; rows of an unknown are its lanes. */
    int n = s->inner, w = s->w, rows = row_count(s), size = n * w;
    for (int c = 0; c < n; c++)
        for (int j = 0; j < s->s; j++) {
            double *column = s->coupled + (ptrdiff_t)(c * s->s + j) * rows;
            fill_column(n, w, s->once + j * w, s->all + (s->p + c) * size, s->twice + j * w,
                        c < s->p ? s->all + c * size : NULL, column);
            column[c * w + j] += 1;
            memset(column + size, 0, (size_t)(rows - size) * sizeof *column);
        }
    s->base.cycles += kmp_collocation_matrix_cost(s, KMP_ITERATION_COUPLED);
    return invert(row_count(s), s->inner * s->s, s->coupled, s->joint, s->open, s->coupled_pivot)
               ? KMP_COLLOCATION_TAKEN
               : KMP_COLLOCATION_BAD_ITERATION;
}

void kmp_collocation_correct_coupled(kmp_collocation *s)
{
    int w = s->w, count = s->inner * s->s;
    multiply(row_count(s), count, s->coupled, s->coupled_pivot, s->change, s->joint);
    for (int k = 0; k < count; k++)
        s->change[k / s->s * w + k % s->s] = s->joint[s->coupled_pivot[k]];
}
