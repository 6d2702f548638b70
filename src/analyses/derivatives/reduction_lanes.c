/* SPDX-License-Identifier: BSD-3-Clause */
/* Every loop goes over the entries that are not zero for every state, and does one operation on all lanes. The order of
 * elimination is the order of complete pivoting of the scaled Jv at one state; where its multipliers become large in a
 * lane, the caller must take another one. */
#include "analyses/derivatives/reduction_lanes.h"
#include "base/clones.h"
#include "base/simd4.h"
#include "constraints/evaluation/stage_lanes.h"
#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { W = KMP_STAGE_LANES };
_Static_assert((int)W == 8, "a lane is an entry of kmp_eight");

#define AT(p, k) KMP_EIGHT_AT((p) + (ptrdiff_t)(k)*W)
#define OF(p, k) KMP_EIGHT_CONST((p) + (ptrdiff_t)(k)*W)

/* -- the order of elimination ---------------------------------------------------------------------------- */

/* The order of complete pivoting of the scaled Jv (a, r x r, by rows), as positions of rows and columns. */
static void choose_order(int r, double *a, int *row, int *column)
{
    for (int k = 0; k < r; k++)
        row[k] = column[k] = k;
    for (int k = 0; k < r; k++) {
        int best_i = k, best_j = k;
        double most = -1;
        for (int i = k; i < r; i++)
            for (int j = k; j < r; j++) {
                double size = fabs(a[row[i] * r + column[j]]);
                if (size > most) {
                    most = size;
                    best_i = i;
                    best_j = j;
                }
            }
        int i = row[best_i], j = column[best_j];
        row[best_i] = row[k];
        column[best_j] = column[k];
        row[k] = i;
        column[k] = j;
        for (int below = k + 1; most > 0 && below < r; below++) {
            double *of = a + row[below] * r, factor = of[j] / a[i * r + j];
            for (int c = k + 1; factor != 0 && c < r; c++)
                of[column[c]] -= factor * a[i * r + column[c]];
        }
    }
}

/* Lists the factors' entries from the pattern, and the slots of their products: slot (r x r, by pivots), -1 where an
 * entry is zero. */
static bool list_factors(kmp_reduction_lanes *x, int *slot)
{
    kmp_terms *lower = &x->lower, *upper = &x->upper;
    const int r = x->r, most = r * (r - 1) / 2;
    int products = 0;
    if (!kmp_terms_make(&x->arena, r, most, lower) || !kmp_terms_make(&x->arena, r, most, upper))
        return false;
    for (int k = 0; k < r; k++) {
        kmp_terms_begin(lower, k);
        kmp_terms_begin(upper, k);
        for (int j = k + 1; j < r; j++)
            if (slot[k * r + j] >= 0)
                kmp_terms_add(upper, k, j, slot[k * r + j]);
        for (int i = k + 1; i < r; i++) {
            if (slot[i * r + k] < 0)
                continue;
            kmp_terms_add(lower, k, i, slot[i * r + k]);
            for (int e = upper->start[k]; e < upper->start[k + 1]; e++, products++)
                if (slot[i * r + upper->at[e]] < 0)
                    slot[i * r + upper->at[e]] = x->slots++;
        }
    }
    int *to = x->target = KMP_ARENA_NEW(&x->arena, int, products);
    for (int k = 0; to && k < r; k++)
        for (int e = lower->start[k]; e < lower->start[k + 1]; e++)
            for (int f = upper->start[k]; f < upper->start[k + 1]; f++)
                *to++ = slot[lower->at[e] * r + upper->at[f]];
    return x->target;
}

static bool make_factors(kmp_reduction_lanes *x, const int *row, const int *column)
{
    const kmp_reduction *red = x->red;
    const double *scale = red->eval->system->row_scale;
    int r = x->r;
    int *slot = KMP_ARENA_NEW(&x->arena, int, r *r), *row_at = KMP_ARENA_NEW(&x->arena, int, r),
        *column_at = x->pivot_of = KMP_ARENA_NEW(&x->arena, int, r);
    if (!KMP_ARENA_MAKE(
            &x->arena, KMP_ROOM(int, r, &x->row, &x->column, &x->diagonal), KMP_ROOM(int, red->jv_count, &x->slot_of),
            KMP_ROOM(int, red->ju_count, &x->ju_row, &x->ju_column), KMP_ROOM(int, x->p, &x->full_of, &x->full_column)))
        return false;
    for (int k = 0; k < r; k++) {
        x->row[k] = red->part->rows[row[k]];
        x->column[k] = red->part->v[column[k]];
        row_at[row[k]] = column_at[column[k]] = k;
    }
    for (int k = 0; k < r * r; k++)
        slot[k] = -1;
    for (int k = 0; k < r; k++) /* pivots first */
        slot[k * r + k] = x->diagonal[k] = x->slots++;
    for (int k = 0; k < red->jv_count; k++) {
        int *of = &slot[row_at[red->jv_row[k]] * r + column_at[red->jv_col[k]]];
        *of = *of < 0 ? x->slots++ : *of;
        x->slot_of[k] = *of;
    }
    for (int c = 0; c < x->p; c++)
        x->full_of[c] = -1;
    for (int k = 0; k < red->ju_count; k++)
        x->full_of[red->ju_col[k]] = 0;
    for (int c = 0; c < x->p; c++)
        if (x->full_of[c] == 0) {
            x->full_column[x->full] = c;
            x->full_of[c] = x->full++;
        }
    for (int k = 0; k < red->ju_count; k++) {
        x->ju_row[k] = row_at[red->ju_row[k]];
        x->ju_column[k] = x->full_of[red->ju_col[k]];
    }
    if (!list_factors(x, slot))
        return false;
    x->bound = KMP_ARENA_NEW(&x->arena, double, x->lower.start[r]);
    for (int k = 0; x->bound && k < r; k++)
        for (int e = x->lower.start[k]; e < x->lower.start[k + 1]; e++)
            x->bound[e] = KMP_ELIMINATION * scale[x->row[x->lower.at[e]]] / scale[x->row[k]];
    return x->bound;
}

kempe_status kmp_reduction_lanes_init(kmp_reduction_lanes *lanes, const kmp_reduction *red, int vectors)
{
    kmp_reduction_lanes_free(lanes);
    *lanes = (kmp_reduction_lanes){.red = red, .p = red->p, .r = red->r};
    kmp_arena *a = &lanes->arena;
    const kempe_system *s = red->eval->system;
    int r = red->r, *row = KMP_ARENA_NEW(a, int, r), *column = KMP_ARENA_NEW(a, int, r);
    double *scaled = KMP_ARENA_NEW(a, double, r *r);
    if (!a->failed) {
        for (int k = 0; k < red->jv_count; k++)
            scaled[red->jv_row[k] * r + red->jv_col[k]] = red->eval->jacobian[red->jv_entry[k]] *
                                                          s->scale[red->part->v[red->jv_col[k]]] /
                                                          s->row_scale[red->part->rows[red->jv_row[k]]];
        choose_order(r, scaled, row, column);
        if (make_factors(lanes, row, column)) {
            lanes->factor = kmp_arena_aligned(a, (size_t)lanes->slots * W);
            lanes->inverse = kmp_arena_aligned(a, (size_t)r * W);
            lanes->bvu = kmp_arena_aligned(a, (size_t)(r * lanes->full) * W);
            lanes->room = kmp_arena_aligned(a, (size_t)(r * vectors) * W);
            lanes->mx = kmp_arena_aligned(a, (size_t)(red->n * lanes->p) * W);
            lanes->mr = kmp_arena_aligned(a, (size_t)(lanes->p * lanes->p) * W);
            lanes->diagonal_of_mass = kmp_arena_aligned(a, (size_t)lanes->p * W);
            const int p = lanes->p;
            KMP_ARENA_MAKE(a, KMP_ROOM(int, p, &lanes->mass_child), KMP_ROOM(int, p + 1, &lanes->mass_start),
                           KMP_ROOM(int, 2 * p, &lanes->mass_mark), KMP_ROOM(int, p *(p - 1) / 2, &lanes->mass_row));
            lanes->dv = kmp_arena_aligned(a, (size_t)r * W);
        }
    }
    if (!a->failed)
        return KEMPE_OK;
    kmp_reduction_lanes_free(lanes);
    return kmp_fail_memory(s->context);
}

void kmp_reduction_lanes_free(kmp_reduction_lanes *lanes)
{
    kmp_arena_free(&lanes->arena);
    *lanes = (kmp_reduction_lanes){0};
}

/* -- Jv ------------------------------------------------------------------------------------------------ */

static KMP_CLONES void eliminate(kmp_reduction_lanes *x)
{
    const kmp_terms *lower = &x->lower, *upper = &x->upper;
    const int *to = x->target;
    double *f = x->factor;
    for (int k = 0; k < x->r; k++) {
        AT(x->inverse, k) = 1 / OF(f, x->diagonal[k]);
        for (int e = lower->start[k]; e < lower->start[k + 1]; e++) {
            const kmp_eight by = OF(f, lower->from[e]) * OF(x->inverse, k);
            AT(f, lower->from[e]) = by;
            for (int g = upper->start[k]; g < upper->start[k + 1]; g++)
                AT(f, *to++) -= by * OF(f, upper->from[g]);
        }
    }
}

bool kmp_reduction_lanes_factor(kmp_reduction_lanes *lanes, const double *jacobian)
{
    const kmp_reduction *red = lanes->red;
    memset(lanes->factor, 0, (size_t)lanes->slots * W * sizeof *lanes->factor);
    for (int k = 0; k < red->jv_count; k++)
        memcpy(lanes->factor + lanes->slot_of[k] * W, jacobian + red->jv_entry[k] * W, W * sizeof *jacobian);
    eliminate(lanes);
    bool good = true; /* no multiplier exceeds its bound, and all pivots have finite reciprocals */
    for (int e = 0; e < lanes->lower.start[lanes->r]; e++)
        for (int l = 0; l < W; l++)
            good = good && fabs(lanes->factor[lanes->lower.from[e] * W + l]) <= lanes->bound[e];
    return good && kmp_stage_lanes_finite(lanes->r, lanes->inverse);
}

/* b (count vectors) += factor x, and b *= factor. */
static KMP_INTO_CLONES void add(int count, const double *factor, double sign, const double *x, double *b)
{
    const kmp_eight by = sign * OF(factor, 0);
    for (int c = 0; c < count; c++)
        AT(b, c) += by * OF(x, c);
}

static KMP_INTO_CLONES void multiply(int count, const double *factor, double *b)
{
    const kmp_eight by = OF(factor, 0);
    for (int c = 0; c < count; c++)
        AT(b, c) *= by;
}

#define ROW(b, k) ((b) + (ptrdiff_t)(k)*count * W)
#define SLOT(k)   (x->factor + (ptrdiff_t)(k)*W)

/* b <- Jv^-1 b, by pivots, of `count` vectors. */
static KMP_CLONES void solve(const kmp_reduction_lanes *x, int count, double *b)
{
    for (int k = 0; k < x->r; k++)
        for (int e = x->lower.start[k]; e < x->lower.start[k + 1]; e++)
            add(count, SLOT(x->lower.from[e]), -1, ROW(b, k), ROW(b, x->lower.at[e]));
    for (int k = x->r; k-- > 0;) {
        for (int e = x->upper.start[k]; e < x->upper.start[k + 1]; e++)
            add(count, SLOT(x->upper.from[e]), -1, ROW(b, x->upper.at[e]), ROW(b, k));
        multiply(count, x->inverse + (ptrdiff_t)k * W, ROW(b, k));
    }
}

static KMP_CLONES void solve_transposed(const kmp_reduction_lanes *x, int count, double *b)
{
    for (int k = 0; k < x->r; k++) {
        multiply(count, x->inverse + (ptrdiff_t)k * W, ROW(b, k));
        for (int e = x->upper.start[k]; e < x->upper.start[k + 1]; e++)
            add(count, SLOT(x->upper.from[e]), -1, ROW(b, k), ROW(b, x->upper.at[e]));
    }
    for (int k = x->r; k-- > 0;)
        for (int e = x->lower.start[k]; e < x->lower.start[k + 1]; e++)
            add(count, SLOT(x->lower.from[e]), -1, ROW(b, x->lower.at[e]), ROW(b, k));
}

void kmp_reduction_lanes_solve(kmp_reduction_lanes *lanes, const double *rows)
{
    for (int k = 0; k < lanes->r; k++)
        AT(lanes->dv, k) = -OF(rows, lanes->row[k]);
    solve(lanes, 1, lanes->dv);
}

static KMP_CLONES void scale_rows(int count, double factor, const double *from, double *to)
{
    for (int c = 0; c < count; c++)
        AT(to, c) = factor * OF(from, c);
}

void kmp_reduction_lanes_pull(kmp_reduction_lanes *lanes, int count, double factor, const double *force, double *rows)
{
    memset(rows, 0, (size_t)(lanes->red->part->m * count) * W * sizeof *rows);
    for (int k = 0; k < lanes->r; k++)
        scale_rows(count, factor, ROW(force, lanes->column[k]), ROW(lanes->room, k));
    solve_transposed(lanes, count, lanes->room);
    for (int k = 0; k < lanes->r; k++)
        memcpy(ROW(rows, lanes->row[k]), ROW(lanes->room, k), (size_t)count * W * sizeof *rows);
}

/* -- the tangent space ----------------------------------------------------------------------------------- */

void kmp_reduction_lanes_tangent(kmp_reduction_lanes *lanes, const double *jacobian)
{
    const kmp_reduction *red = lanes->red;
    memset(lanes->bvu, 0, (size_t)(lanes->r * lanes->full) * W * sizeof *lanes->bvu);
    for (int k = 0; k < red->ju_count; k++)
        AT(lanes->bvu, lanes->ju_row[k] * lanes->full + lanes->ju_column[k]) = -OF(jacobian, red->ju_entry[k]);
    solve(lanes, lanes->full, lanes->bvu);
}

static KMP_CLONES void spread(const kmp_reduction_lanes *x, int count, const double *s, double *out)
{
    for (int i = 0; i < x->r; i++) {
        double *row = ROW(out, x->column[i]);
        memset(row, 0, (size_t)count * W * sizeof *row);
        for (int f = 0; f < x->full; f++)
            add(count, x->bvu + (ptrdiff_t)(i * x->full + f) * W, 1, ROW(s, x->full_column[f]), row);
    }
}

void kmp_reduction_lanes_spread(const kmp_reduction_lanes *lanes, int count, const double *s, double *out)
{
    for (int c = 0; c < lanes->p; c++)
        memcpy(ROW(out, lanes->red->part->u[c]), ROW(s, c), (size_t)count * W * sizeof *out);
    spread(lanes, count, s, out);
}

static KMP_CLONES void project(const kmp_reduction_lanes *x, int count, const double *force, double *out)
{
    for (int i = 0; i < x->r; i++)
        for (int f = 0; f < x->full; f++)
            add(count, x->bvu + (ptrdiff_t)(i * x->full + f) * W, 1, ROW(force, x->column[i]),
                ROW(out, x->full_column[f]));
}

void kmp_reduction_lanes_project(const kmp_reduction_lanes *lanes, int count, const double *force, double *out)
{
    for (int c = 0; c < lanes->p; c++)
        memcpy(ROW(out, c), ROW(force, lanes->red->part->u[c]), (size_t)count * W * sizeof *out);
    project(lanes, count, force, out);
}

/* -- the reduced mass ------------------------------------------------------------------------------------ */

static KMP_CLONES void add_mass_times(const kmp_pattern *m, const double *mass, const double *x, double *out)
{
    for (int e = 0; e < m->count; e++) {
        int i = m->row[e], j = m->col[e];
        AT(out, i) += OF(mass, e) * OF(x, j);
        if (i != j)
            AT(out, j) += OF(mass, e) * OF(x, i);
    }
}

void kmp_reduction_lanes_add_mass_times(const kmp_reduction_lanes *lanes, const double *mass, const double *x,
                                        double *out)
{
    add_mass_times(&lanes->red->eval->system->mass, mass, x, out);
}

/* out (p) += factor times row i of X. */
static KMP_INTO_CLONES void add_row_of_x(const kmp_reduction_lanes *x, const int *pivot_of, int i, const double *factor,
                                         double *out)
{
    int place = x->red->place[i];
    if (place < 0) {
        AT(out, -1 - place) += OF(factor, 0);
        return;
    }
    for (int f = 0; f < x->full; f++)
        AT(out, x->full_column[f]) += OF(factor, 0) * OF(x->bvu, pivot_of[place] * x->full + f);
}

/* M X, then the lower triangle of X' M X. */
static KMP_CLONES void reduce(kmp_reduction_lanes *x, const int *pivot_of, const double *mass)
{
    const kmp_pattern *m = &x->red->eval->system->mass;
    int p = x->p;
    for (int e = 0; e < m->count; e++) {
        int i = m->row[e], j = m->col[e];
        add_row_of_x(x, pivot_of, j, mass + (ptrdiff_t)e * W, x->mx + (ptrdiff_t)(i * p) * W);
        if (i != j)
            add_row_of_x(x, pivot_of, i, mass + (ptrdiff_t)e * W, x->mx + (ptrdiff_t)(j * p) * W);
    }
    for (int c = 0; c < p; c++)
        for (int d = c; d < p; d++) {
            kmp_eight sum = OF(x->mx, x->red->part->u[d] * p + c);
            for (int i = 0; x->full_of[d] >= 0 && i < x->r; i++)
                sum += OF(x->bvu, i * x->full + x->full_of[d]) * OF(x->mx, x->column[i] * p + c);
            AT(x->mr, d + c * p) = sum;
        }
}

/* True if a value is zero in all lanes. */
static bool is_nothing(const double *x)
{
    bool nothing = true;
    for (int l = 0; l < W; l++)
        nothing = nothing && x[l] == 0;
    return nothing;
}

/* Lists the rows of each column of the factor: of the matrix, and of the columns that are eliminated into it, which
 * are the ones whose first row it is. */
static void find_rows(kmp_reduction_lanes *x)
{
    const int p = x->p;
    int *start = x->mass_start, *row = x->mass_row, *child = x->mass_child, *mark = x->mass_mark;
    for (int k = 0; k < p; k++)
        child[k] = mark[k] = -1; /* child: the last column with this first row; the one before it is in `next` */
    int *next = mark + p, count = 0;
    for (int k = 0; k < p; k++) {
        for (int i = k + 1; i < p; i++)
            if (!is_nothing(x->mr + (ptrdiff_t)(i + k * p) * W))
                mark[i] = k;
        for (int c = child[k]; c >= 0; c = next[c])
            for (int e = start[c]; e < start[c + 1]; e++)
                mark[row[e]] = k;
        start[k] = count;
        for (int i = k + 1; i < p; i++)
            if (mark[i] == k)
                row[count++] = i;
        start[k + 1] = count;
        if (count > start[k]) {
            next[k] = child[row[start[k]]];
            child[row[start[k]]] = k;
        }
    }
}

/* L D L' in place, D in the diagonal; its reciprocals. Parts that share no inertia take a time that grows with their
 * number. */
static KMP_CLONES void factor_mass(int p, const int *start, const int *row, double *a, double *inverse)
{
    for (int k = 0; k < p; k++) {
        AT(inverse, k) = 1 / OF(a, k + k * p);
        for (int e = start[k]; e < start[k + 1]; e++) {
            const int j = row[e];
            const kmp_eight by = OF(a, j + k * p) * OF(inverse, k);
            for (int f = e; f < start[k + 1]; f++)
                AT(a, row[f] + j * p) -= OF(a, row[f] + k * p) * by;
        }
        for (int e = start[k]; e < start[k + 1]; e++)
            AT(a, row[e] + k * p) *= OF(inverse, k);
    }
}

bool kmp_reduction_lanes_reduce(kmp_reduction_lanes *lanes, const double *mass)
{
    int p = lanes->p;
    memset(lanes->mx, 0, (size_t)(lanes->red->n * p) * W * sizeof *lanes->mx);
    reduce(lanes, lanes->pivot_of, mass);
    find_rows(lanes);
    factor_mass(p, lanes->mass_start, lanes->mass_row, lanes->mr, lanes->diagonal_of_mass);
    for (int k = 0; k < p; k++)
        for (int l = 0; l < W; l++)
            if (!(lanes->diagonal_of_mass[k * W + l] > 0 && lanes->diagonal_of_mass[k * W + l] <= DBL_MAX))
                return false;
    return true;
}

static KMP_CLONES void solve_mass(const kmp_reduction_lanes *x, int count, double *b)
{
    const int p = x->p, *start = x->mass_start, *row = x->mass_row;
    const double *a = x->mr;
    for (int k = 0; k < p; k++)
        for (int e = start[k]; e < start[k + 1]; e++)
            add(count, a + (ptrdiff_t)(row[e] + k * p) * W, -1, ROW(b, k), ROW(b, row[e]));
    for (int k = p; k-- > 0;) {
        multiply(count, x->diagonal_of_mass + (ptrdiff_t)k * W, ROW(b, k));
        for (int e = start[k]; e < start[k + 1]; e++)
            add(count, a + (ptrdiff_t)(row[e] + k * p) * W, -1, ROW(b, row[e]), ROW(b, k));
    }
}

void kmp_reduction_lanes_solve_mass(const kmp_reduction_lanes *lanes, int count, double *b)
{
    solve_mass(lanes, count, b);
}
