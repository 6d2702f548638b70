/* SPDX-License-Identifier: BSD-3-Clause */
/* The linear algebra of a reduction written out, on the outputs of the motion program. Blocks of one and two rows are
 * solved by their determinant, larger ones by elimination in a given order. */
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/evaluation/fused_inside.h"
#include "constraints/evaluation/written.h"
#include "linalg/dense/dense.h"
#include <math.h>
#include <string.h>

/* A diagonal block: its matrix, then its factors; rows in the order of elimination. */
typedef struct block {
    int size, row[KMP_FUSED_BLOCK], col[KMP_FUSED_BLOCK];
    kmp_ref a[KMP_FUSED_BLOCK][KMP_FUSED_BLOCK];
    kmp_ref inverse[KMP_FUSED_BLOCK]; /* of the pivots; for two rows: of the determinant */
} block;

/* State of the writer. */
typedef struct maker {
    const kmp_reduction *red;
    kmp_written w;
    kmp_graph *g; /* its graph */
    const kmp_fused_plan *plan;
    int n, p, r;
    int named;               /* the first of the replaced inputs: q and qd of each u, then of each v */
    block *block;            /* of Jv, factored */
    kmp_ref *h, *h_t, *jdqd; /* r, of the independent rows; h_t is NULL if there is none */
    kmp_ref *ju;             /* r x p, row by row */
    kmp_ref *jv;             /* r x r, row by row */
    int *block_of;           /* by column */
    kmp_ref *b, *x_t, *a0;   /* r x p row by row, r, r */
    kmp_ref *dv;             /* r: the correction of v */
    kmp_ref *rate;           /* r: qd of v */
    kmp_ref *mx;             /* n x p, row by row */
    kmp_ref *multiplier;     /* of all blocks */
    double *factor;          /* of all blocks: scaling of each multiplier */
    int multipliers;
    kmp_ref *pivot; /* factors of det Jv, but for the sign of a permutation */
    int pivots;
} maker;

static double scale_of(const maker *k, int row)
{
    return k->plan->row_scale[k->red->part->rows[row]];
}

/* Rows of a block in the order of elimination; `begin`: how many rows the blocks before it have. */
static void take_block(const maker *k, int number, int begin, block *b)
{
    const int *col = kmp_block_columns(k->red->block, number, &b->size);
    for (int i = 0; i < b->size; i++) {
        b->col[i] = col[i];
        b->row[i] = k->plan->order[begin + i];
    }
    for (int i = 0; i < b->size; i++)
        for (int j = 0; j < b->size; j++)
            b->a[i][j] = k->jv[b->row[i] * k->r + b->col[j]];
}

static double value_at(const kmp_reduction *red, int row, int col)
{
    for (int e = 0; e < red->jv_count; e++)
        if (red->jv_row[e] == row && red->jv_col[e] == col)
            return red->eval->jacobian[red->jv_entry[e]];
    return 0;
}

void kmp_fused_order(const kmp_reduction *red, int *order)
{
    const double *scale = red->eval->system->row_scale;
    double value[KMP_FUSED_BLOCK * KMP_FUSED_BLOCK];
    int size, pivot[KMP_FUSED_BLOCK];
    for (int number = 0, count = kmp_block_count(red->block); number < count; number++, order += size) {
        const int *col = kmp_block_columns(red->block, number, &size), *row = kmp_block_rows(red->block, number);
        memcpy(order, row, (size_t)size * sizeof *order);
        if (size <= 2) /* by the determinant */
            continue;
        for (int i = 0; i < size; i++)
            for (int j = 0; j < size; j++)
                value[i + j * size] = value_at(red, row[i], col[j]) / scale[red->part->rows[row[i]]];
        int fault = kmp_lu_factor(size, value, pivot);
        for (int i = 0; i < (fault ? fault - 1 : size); i++)
            kmp_swap_int(&order[i], &order[pivot[i]]);
    }
}

/* Factors a block. One row: its inverse. Two rows: the inverse of the determinant. More: L below the diagonal, U on and
 * above it. */
static void factor_block(maker *k, block *b)
{
    kmp_graph *g = k->g;
    if (b->size == 2) {
        kmp_ref det = kmp_sub(g, kmp_mul(g, b->a[0][0], b->a[1][1]), kmp_mul(g, b->a[0][1], b->a[1][0]));
        b->inverse[0] = kmp_div(g, KMP_ONE, det);
        k->pivot[k->pivots++] = det;
        return;
    }
    for (int c = 0; c < b->size; c++) {
        k->pivot[k->pivots++] = b->a[c][c];
        b->inverse[c] = kmp_div(g, KMP_ONE, b->a[c][c]);
        for (int i = c + 1; i < b->size; i++) {
            if (b->a[i][c] == KMP_ZERO)
                continue;
            b->a[i][c] = kmp_mul(g, b->a[i][c], b->inverse[c]);
            k->multiplier[k->multipliers] = b->a[i][c];
            k->factor[k->multipliers++] = scale_of(k, b->row[c]) / scale_of(k, b->row[i]);
            for (int j = c + 1; j < b->size; j++)
                b->a[i][j] = kmp_sub(g, b->a[i][j], kmp_mul(g, b->a[i][c], b->a[c][j]));
        }
    }
}

static void solve_two(kmp_graph *g, const block *b, kmp_ref *x)
{
    kmp_ref y = x[0], z = x[1], w = b->inverse[0];
    x[0] = kmp_sub(g, kmp_mul(g, kmp_mul(g, b->a[1][1], w), y), kmp_mul(g, kmp_mul(g, b->a[0][1], w), z));
    x[1] = kmp_sub(g, kmp_mul(g, kmp_mul(g, b->a[0][0], w), z), kmp_mul(g, kmp_mul(g, b->a[1][0], w), y));
}

static void solve_block(kmp_graph *g, const block *b, kmp_ref *x)
{
    if (b->size == 2) {
        solve_two(g, b, x);
        return;
    }
    for (int i = 1; i < b->size; i++)
        for (int j = 0; j < i; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, b->a[i][j], x[j]));
    for (int i = b->size - 1; i >= 0; i--) {
        for (int j = i + 1; j < b->size; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, b->a[i][j], x[j]));
        x[i] = kmp_mul(g, x[i], b->inverse[i]);
    }
}

/* The right-hand side of a row minus the known part of the solution: columns of later blocks. */
static kmp_ref left_over(const maker *k, int row, kmp_ref rhs, const kmp_ref *x, int stride, int number)
{
    for (int col = 0; col < k->r; col++)
        if (k->block_of[col] > number && k->jv[row * k->r + col] != KMP_ZERO)
            rhs = kmp_sub(k->g, rhs, kmp_mul(k->g, k->jv[row * k->r + col], x[col * stride]));
    return rhs;
}

/* Solves x = Jv^-1 rhs for every column, the last block first. */
static void solve_columns(maker *k, int number, const block *b, int columns, const kmp_ref *rhs, kmp_ref *x)
{
    for (int c = 0; c < columns; c++) {
        kmp_ref y[KMP_FUSED_BLOCK] = {0};
        for (int i = 0; i < b->size; i++)
            y[i] = left_over(k, b->row[i], rhs[b->row[i] * columns + c], x + c, columns, number);
        solve_block(k->g, b, y);
        for (int i = 0; i < b->size; i++)
            x[b->col[i] * columns + c] = y[i];
    }
}

static void negate(int count, kmp_ref *x)
{
    for (int i = 0; i < count; i++)
        x[i] = kmp_neg(x[i]);
}

/* Bvu, x_t and the correction: -Jv^-1 of Ju, h_t and h. */
static void make_tangent(maker *k)
{
    int begin = k->r;
    for (int number = kmp_block_count(k->red->block); number-- > 0;) {
        block *b = &k->block[number];
        (void)kmp_block_columns(k->red->block, number, &b->size);
        begin -= b->size;
        take_block(k, number, begin, b);
        factor_block(k, b);
        solve_columns(k, number, b, k->p, k->ju, k->b);
        if (k->h_t)
            solve_columns(k, number, b, 1, k->h_t, k->x_t);
        solve_columns(k, number, b, 1, k->h, k->dv);
    }
    negate(k->r * k->p, k->b);
    negate(k->r, k->x_t);
    negate(k->r, k->dv);
}

/* a0 = -Jv^-1 jdqd. */
static void make_curvature(maker *k)
{
    for (int number = kmp_block_count(k->red->block); number-- > 0;)
        solve_columns(k, number, &k->block[number], 1, k->jdqd, k->a0);
    negate(k->r, k->a0);
}

/* Entry of X = (1; Bvu) in the row of a coordinate. */
static kmp_ref x_entry(const maker *k, int coordinate, int column)
{
    int place = k->red->place[coordinate];
    if (place >= 0)
        return k->b[place * k->p + column];
    return -1 - place == column ? KMP_ONE : KMP_ZERO;
}

/* M X. */
static void make_mx(maker *k)
{
    const kmp_pattern *m = &k->w.s->mass;
    for (int e = 0; e < m->count; e++)
        for (int c = 0; c < k->p; c++) {
            int i = m->row[e], j = m->col[e];
            kmp_written_add_product(k->g, &k->mx[i * k->p + c], k->w.mass[e], x_entry(k, j, c));
            if (i != j)
                kmp_written_add_product(k->g, &k->mx[j * k->p + c], k->w.mass[e], x_entry(k, i, c));
        }
}

/* Mr = X' M X, lower triangle, and -Fr = -X' C - (M X)' a0. */
static void make_reduced(maker *k, kmp_ref mr[KMP_FUSED_FREEDOMS][KMP_FUSED_FREEDOMS],
                         kmp_ref force[KMP_FUSED_FREEDOMS])
{
    for (int c = 0; c < k->p; c++) {
        force[c] = KMP_ZERO;
        for (int i = 0; i < k->n; i++) {
            kmp_written_add_product(k->g, &force[c], x_entry(k, i, c), k->w.bias[i]);
            if (k->red->place[i] >= 0)
                kmp_written_add_product(k->g, &force[c], k->mx[i * k->p + c], k->a0[k->red->place[i]]);
        }
        force[c] = kmp_neg(force[c]);
        for (int d = 0; d <= c; d++) {
            mr[c][d] = KMP_ZERO;
            for (int i = 0; i < k->n; i++)
                kmp_written_add_product(k->g, &mr[c][d], x_entry(k, i, c), k->mx[i * k->p + d]);
        }
    }
}

/* Factors Mr = L D L' in place and solves for udd in `force`. The pivots D are returned, too. */
static void solve_reduced(maker *k, kmp_ref mr[KMP_FUSED_FREEDOMS][KMP_FUSED_FREEDOMS], kmp_ref *force, kmp_ref *pivot)
{
    kmp_graph *g = k->g;
    kmp_ref inverse[KMP_FUSED_FREEDOMS] = {0};
    for (int j = 0; j < k->p; j++) {
        pivot[j] = mr[j][j];
        inverse[j] = kmp_div(g, KMP_ONE, pivot[j]);
        for (int i = j + 1; i < k->p; i++) {
            kmp_ref l = kmp_mul(g, mr[i][j], inverse[j]);
            for (int c = j + 1; c <= i; c++)
                mr[i][c] = kmp_sub(g, mr[i][c], kmp_mul(g, l, mr[c][j]));
        }
        for (int i = j + 1; i < k->p; i++)
            mr[i][j] = kmp_mul(g, mr[i][j], inverse[j]);
    }
    for (int i = 0; i < k->p; i++)
        for (int j = 0; j < i; j++)
            force[i] = kmp_sub(g, force[i], kmp_mul(g, mr[i][j], force[j]));
    for (int i = k->p - 1; i >= 0; i--) {
        force[i] = kmp_mul(g, force[i], inverse[i]);
        for (int j = i + 1; j < k->p; j++)
            force[i] = kmp_sub(g, force[i], kmp_mul(g, mr[j][i], force[j]));
    }
}

/* qd of v. */
static void make_rates(const maker *k)
{
    for (int i = 0; i < k->r; i++) {
        k->rate[i] = k->x_t[i];
        for (int c = 0; c < k->p; c++)
            kmp_written_add_product(k->g, &k->rate[i], k->b[i * k->p + c], k->w.by[k->named + 2 * c + 1]);
    }
}

/* -- making ------------------------------------------------------------------------------------------ */

static bool allocate(maker *k)
{
    kmp_arena *a = &k->w.arena;
    int r = k->r;
    k->block = KMP_ARENA_NEW(a, block, kmp_block_count(k->red->block));
    k->block_of = KMP_ARENA_NEW(a, int, r);
    k->jv = KMP_ARENA_NEW(a, kmp_ref, r * r);
    k->mx = KMP_ARENA_NEW(a, kmp_ref, k->n * k->p);
    k->multiplier = KMP_ARENA_NEW(a, kmp_ref, r * KMP_FUSED_BLOCK);
    k->factor = KMP_NEW(double, r *KMP_FUSED_BLOCK);
    k->h_t = k->w.s->rheonomic ? KMP_ARENA_NEW(a, kmp_ref, r) : NULL;
    KMP_ARENA_EACH(a, kmp_ref, r * k->p, &k->ju, &k->b);
    return KMP_ARENA_EACH(a, kmp_ref, r, &k->h, &k->jdqd, &k->x_t, &k->a0, &k->dv, &k->rate, &k->pivot) && k->factor;
}

/* Rows of independent closures in the order of the partition, selected from all rows. */
static void select_rows(const maker *k, const kmp_ref *all, kmp_ref *into)
{
    for (int i = 0; i < k->r; i++)
        into[i] = all[k->red->part->rows[i]];
}

/* Replaces inputs by positions in the state (u, ud, v), given as q, and in the rates of v, given as qd if they are
 * computed before. */
static void name_inputs(maker *k)
{
    const kmp_partition *part = k->red->part;
    k->named = k->w.inputs;
    for (int c = 0; c < k->p; c++) {
        kmp_written_replace(&k->w, KMP_IN_Q, part->u[c], kmp_input(k->g, KMP_IN_Q, (uint32_t)c));
        kmp_written_replace(&k->w, KMP_IN_QD, part->u[c], kmp_input(k->g, KMP_IN_Q, (uint32_t)(k->p + c)));
    }
    for (int i = 0, v = 2 * k->p; i < k->r; i++) {
        kmp_written_replace(&k->w, KMP_IN_Q, part->v[i], kmp_input(k->g, KMP_IN_Q, (uint32_t)(v + i)));
        kmp_written_replace(&k->w, KMP_IN_QD, part->v[i], kmp_input(k->g, KMP_IN_QD, (uint32_t)(v + k->r + i)));
    }
}

/* Outputs of the motion program for qd. Without user-defined forces, which are functions of qd, the rates of v are
 * expressions. */
static bool take_motion(maker *k)
{
    for (int i = 0; !k->w.s->force && i < k->r; i++)
        k->w.by[k->named + 2 * (k->p + i) + 1] = k->rate[i];
    if (!k->w.s->force && !kmp_written_import(&k->w))
        return false;
    kmp_written_add_efforts(&k->w);
    select_rows(k, k->w.jdqd, k->jdqd);
    return true;
}

/* Sorts the entries of J into Jv and Ju. */
static void sort_jacobian(maker *k)
{
    const kmp_reduction *red = k->red;
    for (int e = 0; e < red->jv_count; e++)
        k->jv[red->jv_row[e] * k->r + red->jv_col[e]] = k->w.jacobian[red->jv_entry[e]];
    for (int e = 0; e < red->ju_count; e++)
        k->ju[red->ju_row[e] * k->p + red->ju_col[e]] = k->w.jacobian[red->ju_entry[e]];
    for (int number = kmp_block_count(k->red->block); number-- > 0;) {
        int size;
        const int *col = kmp_block_columns(k->red->block, number, &size);
        for (int i = 0; i < size; i++)
            k->block_of[col[i]] = number;
    }
}

/* Writes the outputs of all stages; `end`: udd, then the pivots of the reduced mass. */
static kmp_program *schedule(maker *k, const kmp_ref *end)
{
    kmp_written *w = &k->w;
    int closures = kmp_written_closure_count(w->s);
    if (!kmp_written_room(w, 2 * k->r + 2 * k->p + 1 + k->multipliers + k->pivots + closures + k->r * k->p))
        return NULL;
    kmp_written_stage(w);
    if (!w->s->force)
        kmp_written_put(w, k->p, end);
    kmp_written_put(w, k->r, k->rate);
    if (!w->s->force) {
        kmp_written_put(w, k->p, end + k->p);
        kmp_written_put(w, k->plan->power, &w->power);
    }
    kmp_written_stage(w);
    if (w->s->force) {
        kmp_written_put(w, 2 * k->p, end);
        kmp_written_put(w, k->plan->power, &w->power);
    }
    kmp_written_stage(w);
    kmp_written_put(w, k->multipliers, k->multiplier);
    kmp_written_put(w, k->pivots, k->pivot);
    kmp_written_put(w, closures, w->closure);
    for (int c = 0; c < k->p; c++)
        for (int i = 0; i < k->r; i++)
            kmp_written_put(w, 1, &k->b[i * k->p + c]);
    kmp_written_put(w, k->r, k->dv);
    return kmp_written_program(w);
}

static kmp_program *write_program(maker *k)
{
    kmp_ref mr[KMP_FUSED_FREEDOMS][KMP_FUSED_FREEDOMS], end[2 * KMP_FUSED_FREEDOMS];
    select_rows(k, k->w.h, k->h);
    if (k->h_t)
        select_rows(k, k->w.h_t, k->h_t);
    sort_jacobian(k);
    make_tangent(k);
    make_rates(k);
    if (!take_motion(k))
        return NULL;
    make_curvature(k);
    make_mx(k);
    make_reduced(k, mr, end);
    solve_reduced(k, mr, end, end + k->p);
    return schedule(k, end);
}

static kmp_program *make_program(maker *k)
{
    bool begun = kmp_written_init(&k->w, k->red->eval, false, 2 * k->n);
    k->g = k->w.g;
    if (!begun || !allocate(k))
        return NULL;
    name_inputs(k);
    return kmp_written_import(&k->w) ? write_program(k) : NULL;
}

kmp_program *kmp_fused_write(const kmp_reduction *red, const kmp_fused_plan *plan, kmp_fused_layout *layout)
{
    maker k = {.red = red, .plan = plan, .n = red->n, .p = red->p, .r = red->r};
    kmp_program *program = make_program(&k);
    *layout = (kmp_fused_layout){k.multipliers, k.pivots, k.factor};
    kmp_written_free(&k.w);
    return program;
}
