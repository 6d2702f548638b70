/* SPDX-License-Identifier: BSD-3-Clause */
/* The saddle system by dense LU or sparse LU, whichever takes fewer operations, by the recursion of articulated bodies,
 * which eliminates the multipliers on its way, or by a partition of coordinates, which needs no M. A row that is
 * left out is replaced by a row and column of a unit matrix, so that the pattern of the matrix stays the same. */
#include "constraints/closing/saddle.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include <math.h>
#include <string.h>

/* Sparse from this size, with fewer than one in SPARSE_BELOW entries nonzero. */
enum { SPARSE_FROM = 48, SPARSE_BELOW = 8 };
/* Cost of filling an entry of a dense matrix, in operations of straight code. */
#define FILLING 4.0

/* -- dense and sparse -------------------------------------------------------------------------------- */

static bool is_out(const kmp_saddle *saddle, int k)
{
    return saddle->out && saddle->out[k];
}

static void add_entry(kmp_saddle *saddle, int row, int col, int from)
{
    saddle->entry_row[saddle->count] = row;
    saddle->entry_col[saddle->count] = col;
    saddle->entry_from[saddle->count++] = from;
}

/* Lists the entries of the matrix: M with both its triangles, then J and -J' alternating, then 1 for each dropped row.
 */
static void list_entries(kmp_saddle *saddle)
{
    const kmp_pattern *mass = &saddle->eval->system->mass, *jac = &saddle->eval->system->jacobian;
    int n = saddle->n;
    for (int k = 0; k < mass->count; k++) {
        add_entry(saddle, mass->row[k], mass->col[k], k);
        if (mass->row[k] != mass->col[k])
            add_entry(saddle, mass->col[k], mass->row[k], k);
    }
    for (int k = 0; k < jac->count; k++) {
        int at = n + saddle->position[jac->row[k]];
        if (at < n)
            continue;
        add_entry(saddle, at, jac->col[k], mass->count + k);
        add_entry(saddle, jac->col[k], at, mass->count + k);
    }
    for (int k = n; saddle->out && k < n + saddle->r; k++)
        add_entry(saddle, k, k, -1);
}

/* Rows that are left out are zero but for the 1. */
static double value_of(const kmp_saddle *saddle, int entry)
{
    const kmp_evaluator *eval = saddle->eval;
    int n = saddle->n, from = saddle->entry_from[entry], masses = eval->system->mass.count;
    bool transposed = saddle->entry_col[entry] >= n;
    if (from >= 0 && from < masses)
        return eval->mass[from];
    bool out = is_out(saddle, (transposed ? saddle->entry_col : saddle->entry_row)[entry] - n);
    if (from < 0 || out)
        return from < 0 && out ? 1 : 0;
    return transposed ? -eval->jacobian[from - masses] : eval->jacobian[from - masses];
}

/* -- by articulated bodies ---------------------------------------------------------------------------- */

/* The recursion has eliminated the rows, the rows of this system also where another one has kept others since: 0, or 1
 * + the place of a row whose pivot is not positive. */
static int judge_pivots(const kmp_saddle *saddle)
{
    kmp_eval_keep_rows(saddle->eval, saddle->position);
    for (int k = 0; k < saddle->r; k++)
        if (!(saddle->eval->bodies.pivots[saddle->part->rows[k]] > 0))
            return 1 + k;
    return 0;
}

bool kmp_saddle_keeps_digits(const kmp_saddle *saddle)
{
    const kmp_evaluator *eval = saddle->eval;
    for (int k = 0; k < saddle->r; k++) {
        const int row = saddle->part->rows[k];
        if (!(eval->bodies.pivots[row] > KMP_SADDLE_PROGRAM_PIVOT * eval->bodies.diagonals[row]))
            return false;
    }
    return true;
}

/* -- by products with M --------------------------------------------------------------------------------- */

static void free_reduction(kmp_saddle_reduction *r)
{
    if (!r)
        return;
    kmp_reduction_free(&r->red);
    kmp_partition_free(&r->part);
    kmp_free(r);
}

/* Takes the coordinates of a partition, whose memory it owns then. false: no memory, or Jv is singular by its pattern.
 */
static bool take_reduction(kmp_saddle *saddle, kmp_partition *part)
{
    kmp_saddle_reduction *r = KMP_NEW(kmp_saddle_reduction, 1);
    if (!r) {
        kmp_partition_free(part);
        return false;
    }
    r->part = *part;
    if (kmp_reduction_init(&r->red, saddle->eval, &r->part) != KEMPE_OK) {
        free_reduction(r);
        return false;
    }
    free_reduction(saddle->reduction);
    saddle->reduction = r;
    return true;
}

/* Chooses other independent coordinates, for the same rows. */
static bool choose_coordinates(kmp_saddle *saddle)
{
    const kempe_system *s = saddle->eval->system;
    const kmp_pattern *pattern = &s->jacobian;
    kmp_partition part = {0};
    double *kept = KMP_NEW(double, pattern->count);
    for (int e = 0; kept && e < pattern->count; e++)
        kept[e] = saddle->position[pattern->row[e]] >= 0 ? saddle->eval->jacobian[e] : 0;
    bool made = kept && kmp_partition_of_rank(&part, s, kept, saddle->r, NULL, 0) == KEMPE_OK;
    kmp_free(kept);
    return made && take_reduction(saddle, &part);
}

/* The factors of Jv, and X. False: singular, or near to a dead centre. */
static bool is_regular(kmp_reduction *red)
{
    int v, u;
    if (kmp_reduction_factor(red))
        return false;
    kmp_reduction_tangent(red);
    return kmp_reduction_growth(red, &v, &u) <= KMP_EXCHANGE_WISH;
}

static int factor_by_products(kmp_saddle *saddle)
{
    bool good =
        is_regular(&saddle->reduction->red) || (choose_coordinates(saddle) && is_regular(&saddle->reduction->red));
    return good ? kmp_reduction_factor_mass(&saddle->reduction->red) : 1;
}

/* -- setting up ----------------------------------------------------------------------------------------- */

/* NULL: no memory. */
static kmp_sparse *make_sparse(const kmp_saddle *saddle)
{
    int *group = KMP_NEW(int, saddle->r + 1);
    for (int k = 0; group && k < saddle->r; k++)
        group[k] = saddle->eval->system->rows[saddle->part->rows[k]].closure;
    kmp_sparse *sparse =
        group ? kmp_sparse_new_saddle(saddle->n, saddle->r, saddle->count, saddle->entry_row, saddle->entry_col, group)
              : NULL;
    kmp_free(group);
    return sparse;
}

static bool init(kmp_saddle *saddle, const kmp_partition *part, kmp_saddle_kind kind)
{
    const kempe_system *s = saddle->eval->system;
    const bool matrix = kind == KMP_SADDLE_DENSE || kind == KMP_SADDLE_SPARSE;
    int n = part->n, r = part->r;
    int entries = 2 * (s->mass.count + s->jacobian.count) + r;
    saddle->part = part;
    saddle->n = n;
    saddle->r = r;
    saddle->kind = kind;
    KMP_ARENA_MAKE(&saddle->arena, KMP_ROOM(double, kind == KMP_SADDLE_SPARSE ? entries : 0, &saddle->matrix),
                   KMP_ROOM(double, n + r, &saddle->x), KMP_ROOM(int, part->m, &saddle->position),
                   KMP_ROOM(double, kind == KMP_SADDLE_BY_PRODUCTS ? part->m : 0, &saddle->rows));
    if (!KMP_ARENA_EACH(&saddle->arena, int, matrix ? entries : 0, &saddle->entry_row, &saddle->entry_col,
                        &saddle->entry_from))
        return false;
    for (int k = 0; k < part->m; k++)
        saddle->position[k] = -1;
    for (int k = 0; k < r; k++)
        saddle->position[part->rows[k]] = k;
    kmp_eval_drop(saddle->eval, part->m - part->r, part->redundant);
    if (kind == KMP_SADDLE_BY_BODIES) {
        kmp_eval_keep_rows(saddle->eval, saddle->position);
        return true;
    }
    if (kind == KMP_SADDLE_BY_PRODUCTS) {
        kmp_partition own;
        return kmp_partition_copy(&own, part) && take_reduction(saddle, &own);
    }
    list_entries(saddle);
    if (kind == KMP_SADDLE_DENSE)
        return kmp_dense_parts_init(&saddle->dense, &saddle->arena, n + r, saddle->count, saddle->entry_row,
                                    saddle->entry_col);
    unsigned long failures = kmp_memory_failures();
    saddle->sparse = make_sparse(saddle); /* NULL: singular by its pattern, or no memory */
    return kmp_memory_failures() == failures;
}

bool kmp_saddle_has_row(const kmp_saddle *saddle, int row)
{
    return saddle->position[row] >= 0 && !is_out(saddle, saddle->position[row]);
}

/* The cheaper factorisation. */
static kmp_saddle_kind by_size(const kempe_system *s, int rows)
{
    long size = s->n + rows;
    bool large = size > SPARSE_FROM && 2 * (s->mass.count + s->jacobian.count) < size * size / SPARSE_BELOW;
    return large ? KMP_SADDLE_SPARSE : KMP_SADDLE_DENSE;
}

bool kmp_saddle_init(kmp_saddle *saddle, kmp_evaluator *eval, const kmp_partition *part)
{
    *saddle = (kmp_saddle){.eval = eval};
    return init(saddle, part,
                eval->by_bodies     ? KMP_SADDLE_BY_BODIES
                : eval->by_products ? KMP_SADDLE_BY_PRODUCTS
                                    : by_size(eval->system, part->r));
}

bool kmp_saddle_init_anywhere(kmp_saddle *saddle, kmp_evaluator *eval, int rank)
{
    int n = eval->n, m = eval->m;
    *saddle = (kmp_saddle){.eval = eval, .rank = rank};
    saddle->all = (kmp_partition){.n = n, .m = m, .r = m, .rows = KMP_ARENA_NEW(&saddle->arena, int, m)};
    KMP_ARENA_MAKE(&saddle->arena, KMP_ROOM(bool, m, &saddle->out), KMP_ROOM(int, m, &saddle->row),
                   KMP_ROOM(int, n, &saddle->col), KMP_ROOM(double, (size_t)m *(size_t)n, &saddle->scaled),
                   KMP_ROOM(double, n, &saddle->largest), KMP_ROOM(double, m + n, &saddle->pivots));
    for (int i = 0; saddle->all.rows && i < m; i++)
        saddle->all.rows[i] = i;
    return saddle->all.rows && init(saddle, &saddle->all, by_size(eval->system, m));
}

KMP_CLEARS(kmp_saddle, saddle, kmp_sparse_free(saddle->sparse), free_reduction(saddle->reduction),
           kmp_arena_free(&saddle->arena))

/* -- all together -------------------------------------------------------------------------------------- */

/* Partitions all rows; rows that are independent at the evaluator's last closure stay in. */
static void choose_rows(kmp_saddle *saddle)
{
    const kempe_system *s = saddle->eval->system;
    int m = s->m;
    memset(saddle->scaled, 0, (size_t)(m * s->n) * sizeof *saddle->scaled);
    for (int e = 0; e < s->jacobian.count; e++) {
        int r = s->jacobian.row[e], k = s->jacobian.col[e];
        saddle->scaled[r + k * m] = saddle->eval->jacobian[e] * s->scale[k] / s->row_scale[r];
    }
    kmp_pivots_complete(m, s->n, saddle->scaled, saddle->largest, saddle->row, saddle->col, saddle->pivots);
    int rank = kmp_partition_rank(s, saddle->pivots);
    double undecided = KMP_CLOSED_DECIDED * kmp_eval_residual(saddle->eval) * (rank > 0 ? saddle->pivots[0] : 0);
    while (saddle->rank >= 0 && rank > saddle->rank && !(saddle->pivots[rank - 1] > undecided))
        rank--;
    for (int i = 0; i < m; i++)
        saddle->out[saddle->row[i]] = i >= rank;
}

int kmp_saddle_factor(kmp_saddle *saddle)
{
    saddle->factorizations++;
    if (saddle->out)
        choose_rows(saddle);
    if (saddle->kind == KMP_SADDLE_BY_BODIES)
        return judge_pivots(saddle);
    if (saddle->kind == KMP_SADDLE_BY_PRODUCTS)
        return factor_by_products(saddle);
    if (saddle->kind == KMP_SADDLE_SPARSE) {
        for (int e = 0; e < saddle->count; e++)
            saddle->matrix[e] = value_of(saddle, e);
        return !saddle->sparse || kmp_sparse_factor(saddle->sparse, saddle->matrix) != KMP_SPARSE_FACTORED;
    }
    kmp_dense_parts_clear(&saddle->dense);
    for (int e = 0; e < saddle->count; e++)
        saddle->dense.matrix[saddle->dense.at[e]] = value_of(saddle, e);
    return kmp_dense_parts_factor(&saddle->dense);
}

double kmp_saddle_cost(const kmp_saddle *saddle)
{
    if (saddle->kind == KMP_SADDLE_BY_BODIES) /* the recursion is the solution */
        return 0;
    if (saddle->kind == KMP_SADDLE_BY_PRODUCTS)
        return KMP_LOOPS_COST * (double)kmp_reduction_count(&saddle->reduction->red).paper;
    if (saddle->sparse)
        return KMP_SPARSE_COST * kmp_sparse_operations(saddle->sparse);
    int size = saddle->n + saddle->r;
    kmp_flops f = kmp_lu_flops(size);
    return KMP_LOOPS_COST * ((double)f.add + (double)f.mul + (double)f.div) + FILLING * size * size;
}

/* Computes x and the multipliers behind it, by products if required. force, rows: NULL: zero. */
static void solve(kmp_saddle *saddle, const double *force, const double *rows, bool multipliers)
{
    double *x = saddle->x, *a = x + saddle->n;
    if (saddle->kind == KMP_SADDLE_BY_PRODUCTS) {
        kmp_reduction_solve_saddle(&saddle->reduction->red, force, rows, x, multipliers ? saddle->rows : NULL);
        for (int k = 0; multipliers && k < saddle->r; k++)
            a[k] = saddle->rows[saddle->part->rows[k]];
        return;
    }
    for (int i = 0; i < saddle->n; i++)
        x[i] = force ? -force[i] : 0;
    for (int k = 0; k < saddle->r; k++)
        a[k] = !rows || is_out(saddle, k) ? 0 : -rows[saddle->part->rows[k]];
    if (saddle->kind == KMP_SADDLE_SPARSE)
        kmp_sparse_solve(saddle->sparse, 1, x);
    else
        kmp_dense_parts_solve(&saddle->dense, x);
}

/* Copies the multipliers of the independent rows to their places among all. */
static void take_multipliers(const kmp_saddle *saddle, double *lambda)
{
    memset(lambda, 0, (size_t)saddle->eval->m * sizeof *lambda);
    for (int k = 0; k < saddle->r; k++)
        lambda[saddle->part->rows[k]] = saddle->x[saddle->n + k];
}

void kmp_saddle_solve(kmp_saddle *saddle, const double *f, const double *b, double *x, double *a)
{
    if (saddle->kind == KMP_SADDLE_BY_BODIES) {
        const double *correction = !f && !a && b ? kmp_eval_correction(saddle->eval, b) : NULL;
        for (int i = 0; i < saddle->n; i++)
            x[i] = correction ? correction[i] : NAN;
        return;
    }
    solve(saddle, f, b, a != NULL);
    if (x)
        memcpy(x, saddle->x, (size_t)saddle->n * sizeof *x);
    if (a)
        take_multipliers(saddle, a);
}

/* Callback for forces that depend on multipliers. */
static void multipliers(void *self, const double *bias, bool change, double *lambda)
{
    kmp_saddle *saddle = self;
    solve(saddle, bias, change ? NULL : saddle->eval->jdqd, true);
    take_multipliers(saddle, lambda);
}

void kmp_saddle_accelerations(kmp_saddle *saddle, double *qdd, double *lambda)
{
    kmp_evaluator *eval = saddle->eval;
    const kmp_answer pressed = {saddle, multipliers};
    if (!kmp_load_settle(eval, &pressed)) {
        for (int i = 0; i < saddle->n; i++)
            qdd[i] = NAN;
        for (int k = 0; lambda && k < eval->m; k++)
            lambda[k] = NAN;
        return;
    }
    if (saddle->kind == KMP_SADDLE_BY_BODIES) {
        memcpy(qdd, eval->bodies.qdd, (size_t)saddle->n * sizeof *qdd);
        for (int r = 0; lambda && r < eval->m; r++)
            lambda[r] = saddle->position[r] >= 0 ? eval->bodies.multipliers[r] : 0;
        return;
    }
    solve(saddle, eval->bias, eval->jdqd, lambda != NULL);
    memcpy(qdd, saddle->x, (size_t)saddle->n * sizeof *qdd);
    if (lambda)
        take_multipliers(saddle, lambda);
}

bool kmp_saddle_load_factor(kmp_saddle *saddle)
{
    const kmp_answer pressed = {saddle, multipliers};
    return kmp_load_factor(saddle->eval, &pressed);
}

bool kmp_saddle_find_other(kmp_saddle *saddle, int *row, double *value)
{
    const kmp_answer pressed = {saddle, multipliers};
    return kmp_load_find_other(saddle->eval, &pressed, row, value);
}

bool kmp_saddle_bodies_agree(double difference, double backward_error)
{
    return difference <= KMP_ARTICULATED_AGREE || backward_error <= KMP_ARTICULATED_BACKWARD;
}

double kmp_saddle_backward_error(const kmp_saddle *saddle, const double *qdd, const double *lambda)
{
    const kmp_evaluator *eval = saddle->eval;
    const kmp_pattern *mass = &eval->system->mass, *jacobian = &eval->system->jacobian;
    const int n = saddle->n;
    double *sum = KMP_NEW(double, 2 * (n + eval->m)), *size = sum + n + eval->m, worst = 0;
    if (!sum)
        return INFINITY;
#define PUT(row, term) (sum[row] += (term), size[row] += fabs(term))
    for (int k = 0; k < mass->count; k++) {
        const int i = mass->row[k], j = mass->col[k];
        PUT(i, eval->mass[k] * qdd[j]);
        if (i != j)
            PUT(j, eval->mass[k] * qdd[i]);
    }
    for (int k = 0; k < jacobian->count; k++) {
        const int r = jacobian->row[k], j = jacobian->col[k];
        PUT(j, -eval->jacobian[k] * lambda[r]);
        PUT(n + r, eval->jacobian[k] * qdd[j]);
    }
    for (int i = 0; i < n; i++)
        PUT(i, eval->bias[i]);
    for (int r = 0; r < eval->m; r++)
        PUT(n + r, eval->jdqd[r]);
#undef PUT
    for (int i = 0; i < n + eval->m; i++)
        if (i < n || saddle->position[i - n] >= 0)
            worst = isfinite(sum[i]) ? fmax(worst, size[i] > 0 ? fabs(sum[i]) / size[i] : 0) : INFINITY;
    kmp_free(sum);
    return worst;
}

static int place(void *self, double t, const double *q)
{
    kmp_saddle *saddle = self;
    kmp_eval_closure(saddle->eval, t, q);
    kmp_eval_mass(saddle->eval);
    return kmp_saddle_factor(saddle);
}

static bool correct(void *self, const double *violation, double *dx)
{
    kmp_saddle_solve(self, NULL, violation, dx, NULL);
    return true;
}

kmp_closer kmp_saddle_closer(kmp_saddle *saddle, double *dx)
{
    return (kmp_closer){.self = saddle,
                        .eval = saddle->eval,
                        .scale = saddle->eval->system->scale,
                        .count = saddle->n,
                        .dx = dx,
                        .place = place,
                        .correct = correct};
}
