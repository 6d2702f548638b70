/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinate partitioning: Jv by blocks, its tangent with all zeros of the pattern, the reduced mass X' M X and its
 * Cholesky factor. Trees skip all that: there X is a permutation. Multipliers follow from the rows of v in M qdd + C =
 * J' lambda. */
#include "constraints/partition/reduction.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/partition/sparse_tangent.h"
#include "integrators/decide/coordinate_exchange.h"
#include "linalg/dense/dot.h"
#include <math.h>
#include <string.h>

enum { WORTH_SHARING = 5000 }; /* products: some 2 us, as long as another thread takes to begin */

#define INLINE static inline __attribute__((always_inline))

/* -- setting up -------------------------------------------------------------------------------------- */

/* Places rows and coordinates, and analyses their matrices. false: no memory, or Jv is structurally singular. */
static bool prepare(kmp_reduction *red)
{
    const kmp_partition *part = red->part;
    size_t n = (size_t)red->n, p = (size_t)red->p, r = (size_t)red->r;
    if (!KMP_ARENA_MAKE(&red->arena, KMP_ROOM(int, part->m, &red->row_of), KMP_ROOM(int, n, &red->place),
                        KMP_ROOM(double, red->eval->system->jacobian.count, &red->jv),
                        KMP_ROOM(double, r *p, &red->bvu), KMP_ROOM(double, n *p, &red->x),
                        KMP_ROOM(double, r, &red->dv), KMP_ROOM(double, 2 * r, &red->room),
                        KMP_ROOM(double, p, &red->answer), KMP_ROOM(double, n, &red->x_t, &red->a0, &red->force),
                        KMP_ROOM(int, red->eval->system->jacobian.count, &red->jv_entry, &red->jv_row, &red->jv_col,
                                 &red->ju_entry, &red->ju_row, &red->ju_col)))
        return false;
    for (int i = 0; i < part->m; i++)
        red->row_of[i] = -1;
    for (int k = 0; k < part->r; k++) {
        red->row_of[part->rows[k]] = k;
        red->place[part->v[k]] = k;
    }
    for (int k = 0; k < red->p; k++) {
        red->x[part->u[k] + k * red->n] = 1;
        red->place[part->u[k]] = -1 - k;
    }
    /* Splits the Jacobian's entries into Jv and Ju. */
    const kmp_pattern *pattern = &red->eval->system->jacobian;
    for (int k = 0; k < pattern->count; k++) {
        int i = red->row_of[pattern->row[k]], place = red->place[pattern->col[k]];
        if (i < 0)
            continue;
        if (place >= 0) {
            red->jv_row[red->jv_count] = i;
            red->jv_col[red->jv_count] = place;
            red->jv_entry[red->jv_count++] = k;
        } else {
            red->ju_row[red->ju_count] = i;
            red->ju_col[red->ju_count] = -1 - place;
            red->ju_entry[red->ju_count++] = k;
        }
    }
    /* Analyses Jv, then the zeros of X. */
    unsigned long failures = kmp_memory_failures();
    red->block = red->r > 0 ? kmp_block_new(red->r, red->jv_count, red->jv_row, red->jv_col) : NULL;
    if (red->r > 0 && !red->block)
        return false;
    red->zeros = red->eval->by_products ? NULL : kmp_sparse_tangent_new(red, &red->arena);
    size_t order = (size_t)(red->zeros ? red->zeros->stride : red->p);
    red->mr = kmp_arena_aligned(&red->arena, order * order);
    red->mx = KMP_ARENA_NEW(&red->arena, double, (size_t)red->n *(size_t)(red->zeros || red->p == 0 ? 1 : red->p));
    return red->mr && red->mx && kmp_memory_failures() == failures; /* mx also holds one qdd */
}

kempe_status kmp_reduction_init(kmp_reduction *red, kmp_evaluator *eval, const kmp_partition *part)
{
    *red = (kmp_reduction){.eval = eval, .part = part, .n = part->n, .p = part->p, .r = part->r};
    unsigned long failures = kmp_memory_failures();
    if (prepare(red)) {
        kmp_eval_drop(eval, part->m - part->r, part->redundant);
        return KEMPE_OK;
    }
    kmp_reduction_free(red);
    if (kmp_memory_failures() != failures)
        return kmp_fail_memory(eval->system->context);
    return kmp_fail(eval->system->context, KEMPE_E_FAILED,
                    "the Jacobian of the dependent coordinates cannot be factored: its pattern is singular");
}

KMP_CLEARS(kmp_reduction, red, kmp_block_free(red->block), kmp_arena_free(&red->arena))

/* -- tangent space ----------------------------------------------------------------------------------- */

int kmp_reduction_factor(kmp_reduction *red)
{
    if (red->r == 0)
        return 0;
    for (int k = 0; k < red->jv_count; k++)
        red->jv[k] = red->eval->jacobian[red->jv_entry[k]];
    red->factorizations++;
    int fault = kmp_block_factor(red->block, red->jv);
    return fault ? 1 + red->part->v[fault - 1] : 0;
}

/* dv = factor Jv^-1 rows, for all m given rows. */
static void solve_rows(kmp_reduction *red, double factor, const double *rows)
{
    for (int i = 0; i < red->r; i++)
        red->dv[i] = factor * rows[red->part->rows[i]];
    kmp_block_solve(red->block, 1, red->dv);
}

/* Writes dv to the entries of v. */
static void put_dependent(const kmp_reduction *red, double *out)
{
    for (int i = 0; i < red->r; i++)
        out[red->part->v[i]] = red->dv[i];
}

void kmp_reduction_tangent(kmp_reduction *red)
{
    if (red->r == 0)
        return;
    if (red->zeros) {
        kmp_sparse_tangent_tangent(red->zeros, red, red->eval->jacobian);
    } else { /* Bvu, with all its zeros, and the rows of v in X */
        const int n = red->n, p = red->p, r = red->r;
        memset(red->bvu, 0, (size_t)(r * p) * sizeof *red->bvu);
        for (int k = 0; k < red->ju_count; k++)
            red->bvu[red->ju_row[k] + red->ju_col[k] * r] = -red->eval->jacobian[red->ju_entry[k]];
        kmp_block_solve(red->block, p, red->bvu);
        for (int k = 0; k < p; k++)
            for (int i = 0; i < r; i++)
                red->x[red->part->v[i] + k * n] = red->bvu[i + k * r];
    }
    if (!red->eval->h_t)
        return;
    solve_rows(red, -1, red->eval->h_t);
    put_dependent(red, red->x_t);
}

/* out = X s + base; X is 1 in the rows of u. */
static void spread(const kmp_reduction *red, const double *s, const double *base, double *out)
{
    const int *u = red->part->u, *v = red->part->v;
    for (int i = 0; i < red->n; i++)
        out[i] = base[i];
    for (int k = 0; k < red->p; k++)
        out[u[k]] += s[k];
    if (red->zeros)
        kmp_sparse_tangent_spread(red->zeros, red->bvu, s, out);
    for (int k = 0; !red->zeros && k < red->p; k++)
        for (int i = 0; i < red->r; i++)
            out[v[i]] += red->bvu[i + k * red->r] * s[k];
}

void kmp_reduction_rates(const kmp_reduction *red, const double *ud, double *qd)
{
    spread(red, ud, red->x_t, qd);
}

void kmp_reduction_rates_alone(kmp_reduction *red, const double *ud, double *qd)
{
    const double *h_t = red->eval->h_t;
    for (int i = 0; i < red->r; i++)
        red->dv[i] = h_t ? -h_t[red->part->rows[i]] : 0;
    for (int k = 0; k < red->ju_count; k++)
        red->dv[red->ju_row[k]] -= red->eval->jacobian[red->ju_entry[k]] * ud[red->ju_col[k]];
    kmp_block_solve(red->block, 1, red->dv);
    for (int k = 0; k < red->p; k++)
        qd[red->part->u[k]] = ud[k];
    put_dependent(red, qd);
}

void kmp_reduction_accelerations(const kmp_reduction *red, const double *udd, double *qdd)
{
    spread(red, udd, red->a0, qdd);
}

/* -- dynamics ---------------------------------------------------------------------------------------- */

/* force = C + M qdd, NULL: C. */
static void set_force(kmp_reduction *red, const double *bias, const double *qdd)
{
    memcpy(red->force, bias, (size_t)red->n * sizeof *red->force);
    if (qdd)
        kmp_eval_add_mass_times(red->eval, qdd, red->force);
}

/* a0 = (0; -Jv^-1 jdqd), force = C + M a0. */
static void bias_force(kmp_reduction *red)
{
    solve_rows(red, -1, red->eval->jdqd);
    put_dependent(red, red->a0);
    set_force(red, red->eval->bias, red->r > 0 ? red->a0 : NULL);
}

/* On a tree X is a permutation: Mr = M but for the order of coordinates. By products there is no M. */
INLINE bool is_tree(const kmp_reduction *red)
{
    return red->r == 0 && !red->zeros && !red->eval->by_products;
}

/* Mr = X' M X with a dense X. */
INLINE void reduce_dense(kmp_reduction *red)
{
    int n = red->n, p = red->p;
    memset(red->mx, 0, (size_t)(n * p) * sizeof *red->mx);
    for (int k = 0; k < p; k++) {
        kmp_eval_add_mass_times(red->eval, red->x + k * n, red->mx + k * n);
        for (int i = k; i < p; i++)
            red->mr[i + k * p] = kmp_dot(n, red->x + i * n, red->mx + k * n);
    }
}

/* The reduced mass and its factor, only from M and X. */
INLINE void factor_mass(kmp_reduction *red)
{
    if (is_tree(red)) {
        /* M itself: no coordinate depends on others. */
        const kmp_pattern *m = &red->eval->system->mass;
        int p = red->p;
        memset(red->mr, 0, (size_t)(p * p) * sizeof *red->mr);
        for (int k = 0; k < m->count; k++) {
            int i = -1 - red->place[m->row[k]], j = -1 - red->place[m->col[k]];
            red->mr[(i > j ? i : j) + (i > j ? j : i) * p] = red->eval->mass[k];
        }
    } else if (red->zeros)
        kmp_sparse_tangent_reduce(red->zeros, red->eval->mass, red->mr);
    else
        reduce_dense(red);
    red->fault = red->zeros ? kmp_sparse_tangent_factor(red->zeros, red->mr) : kmp_cholesky_factor(red->p, red->mr);
}

int kmp_reduction_factor_mass(kmp_reduction *red)
{
    factor_mass(red);
    return red->fault;
}

void kmp_reduction_solve_mass(const kmp_reduction *red, double *b)
{
    if (red->zeros)
        kmp_sparse_tangent_solve(red->zeros, red->mr, b);
    else
        kmp_cholesky_solve(red->p, red->mr, b);
}

void kmp_reduction_solve_masses(const kmp_reduction *red, int count, double *b, int ld, double *room)
{
    if (red->zeros)
        for (int k = 0; k < count; k += KMP_FOUR)
            kmp_sparse_tangent_solve_four(red->zeros, red->mr, count - k < KMP_FOUR ? count - k : KMP_FOUR,
                                          b + (ptrdiff_t)k * ld, ld, room);
    else
        for (int k = 0; k < count; k++)
            kmp_cholesky_solve(red->p, red->mr, b + (ptrdiff_t)k * ld);
}

INLINE void project(const kmp_reduction *red, const double *force, double *out)
{
    if (red->zeros) {
        kmp_sparse_tangent_project(red->zeros, red->x, force, out);
        return;
    }
    for (int k = 0; k < red->p && red->r == 0; k++) /* X is a permutation */
        out[k] = -force[red->part->u[k]];
    for (int k = 0; k < red->p && red->r > 0; k++)
        out[k] = -kmp_dot(red->n, red->x + k * red->n, force);
}

void kmp_reduction_project(const kmp_reduction *red, const double *force, double *out)
{
    project(red, force, out);
}

void kmp_reduction_push_in(const kmp_reduction *red, double factor, const double *rows, double *room, double *out)
{
    double *dv = room;
    bool some = false;
    for (int i = 0; i < red->r; i++) {
        dv[i] = factor * rows[red->part->rows[i]];
        some = some || dv[i] != 0;
    }
    if (!some)
        return;
    kmp_block_solve_in(red->block, dv, room + red->r);
    for (int i = 0; i < red->r; i++)
        out[red->part->v[i]] += dv[i];
}

void kmp_reduction_pull(kmp_reduction *red, const double *force, double *rows)
{
    memset(rows, 0, (size_t)red->part->m * sizeof *rows);
    for (int i = 0; i < red->r; i++)
        red->dv[i] = force[red->part->v[i]];
    kmp_block_solve_transposed(red->block, red->dv);
    for (int i = 0; i < red->r; i++)
        rows[red->part->rows[i]] = red->dv[i];
}

void kmp_reduction_solve_saddle(kmp_reduction *red, const double *f, const double *b, double *x, double *a)
{
    const size_t bytes = (size_t)red->n * sizeof *f;
    memset(red->a0, 0, bytes);
    memset(red->force, 0, bytes);
    if (f)
        memcpy(red->force, f, bytes);
    if (b) {
        solve_rows(red, -1, b);
        put_dependent(red, red->a0);
        kmp_eval_add_mass_times(red->eval, red->a0, red->force);
    }
    project(red, red->force, red->answer);
    kmp_reduction_solve_mass(red, red->answer);
    if (a) { /* M x + f = J' a in the rows of v */
        memset(red->force, 0, bytes);
        if (f)
            memcpy(red->force, f, bytes);
    }
    spread(red, red->answer, red->a0, x);
    if (a) {
        kmp_eval_add_mass_times(red->eval, x, red->force);
        kmp_reduction_pull(red, red->force, a);
    }
}

static int fail(int p, double *out)
{
    for (int k = 0; k < p; k++)
        out[k] = NAN;
    return 0;
}

/* Multipliers for forces that depend on them, with the factors of the reduced mass. */
static void answer_moving(void *self, const double *bias, bool change, double *lambda)
{
    kmp_reduction *red = self;
    double *qdd = red->mx;
    set_force(red, bias, change ? NULL : red->a0);
    kmp_reduction_project(red, red->force, red->answer);
    kmp_reduction_solve_mass(red, red->answer);
    memset(qdd, 0, (size_t)red->n * sizeof *qdd);
    spread(red, red->answer, qdd, qdd);
    kmp_eval_add_mass_times(red->eval, qdd, red->force);
    kmp_reduction_pull(red, red->force, lambda);
}

/* Multipliers for forces that depend on them, with given accelerations, in mx. */
static void answer_given(void *self, const double *bias, bool change, double *lambda)
{
    kmp_reduction *red = self;
    set_force(red, bias, change ? NULL : red->mx);
    kmp_reduction_pull(red, red->force, lambda);
}

/* Solves for C at its own multipliers, and for the accelerations. */
static int accelerate_load_dependent(kmp_reduction *red, double *udd)
{
    const kmp_answer answer = {red, answer_moving};
    if (!kmp_load_settle(red->eval, &answer))
        return fail(red->p, udd);
    set_force(red, red->eval->bias, red->a0);
    kmp_reduction_project(red, red->force, udd);
    kmp_reduction_solve_mass(red, udd);
    return 0;
}

static void factor_mass_beside(void *self, int piece)
{
    (void)piece;
    factor_mass(self);
}

/* Accelerations with the factored mass. */
INLINE int accelerate(kmp_reduction *red, double *udd)
{
    if (red->fault)
        return red->fault;
    if (is_tree(red)) {
        for (int k = 0; k < red->p; k++)
            udd[k] = -red->eval->bias[red->part->u[k]];
        kmp_reduction_solve_mass(red, udd);
        return 0;
    }
    bias_force(red);
    project(red, red->force, udd);
    kmp_reduction_solve_mass(red, udd);
    return red->eval->load ? accelerate_load_dependent(red, udd) : 0;
}

int kmp_reduction_accelerate(kmp_reduction *red, double *udd)
{
    factor_mass(red);
    return accelerate(red, udd);
}

int kmp_reduction_move(kmp_reduction *red, const double *qd, double *udd)
{
    kmp_team *team = kmp_eval_team(red->eval);
    if (!team || !red->zeros || kmp_sparse_tangent_products(red->zeros) < WORTH_SHARING) {
        kmp_eval_bias(red->eval, qd);
        return kmp_reduction_accelerate(red, udd);
    }
    kmp_team_bring(team, factor_mass_beside, red);
    kmp_eval_bias(red->eval, qd);
    kmp_team_settle(team);
    return accelerate(red, udd);
}

void kmp_reduction_residual(kmp_reduction *red, const double *udd, double *out)
{
    const int *u = red->part->u, *v = red->part->v;
    double *qdd = red->mx;
    bias_force(red);
    spread(red, udd, red->a0, qdd);
    const kmp_answer answer = {red, answer_given};
    if (red->r > 0 && !kmp_load_settle(red->eval, &answer)) {
        (void)fail(red->p, out);
        return;
    }
    set_force(red, red->eval->bias, qdd);
    if (red->zeros) {
        kmp_sparse_tangent_project(red->zeros, red->x, red->force, out);
        for (int k = 0; k < red->p; k++)
            out[k] = -out[k];
        return;
    }
    for (int k = 0; k < red->p; k++) {
        out[k] = red->force[u[k]];
        for (int i = 0; i < red->r; i++)
            out[k] += red->bvu[i + k * red->r] * red->force[v[i]];
    }
}

bool kmp_reduction_load_factor(kmp_reduction *red, bool moving)
{
    const kmp_answer answer = {red, moving ? answer_moving : answer_given};
    return kmp_load_factor(red->eval, &answer);
}

void kmp_reduction_load_change(kmp_reduction *red, bool moving, double *bias)
{
    const kmp_answer answer = {red, moving ? answer_moving : answer_given};
    kmp_load_change(red->eval, &answer, bias);
}

void kmp_reduction_load_change_back(kmp_reduction *red, double *rows, double *weights)
{
    if (kmp_load_change_back(red->eval, weights, rows))
        kmp_reduction_push_in(red, 1, rows, red->room, weights);
}

void kmp_reduction_multipliers(kmp_reduction *red, const double *qdd, double *lambda)
{
    set_force(red, red->eval->bias, qdd);
    kmp_reduction_pull(red, red->force, lambda);
}

/* -- closure ----------------------------------------------------------------------------------------- */

void kmp_reduction_correction(kmp_reduction *red)
{
    solve_rows(red, -1, red->eval->h);
}

double kmp_reduction_growth(const kmp_reduction *red, int *v, int *u)
{
    return kmp_exchange_growth(red->r, red->part->v, red->p, red->part->u, red->bvu, red->eval->system->scale, v, u);
}

double kmp_reduction_lever(kmp_reduction *red)
{
    const kempe_system *s = red->eval->system;
    unsigned state = 1;
    double most = 0;
    for (int i = 0; i < red->r; i++) {
        state = state * 1664525u + 1013904223u;
        red->dv[i] = (state >> 31 ? 1 : -1) * s->row_scale[red->part->rows[i]];
    }
    kmp_block_solve(red->block, 1, red->dv);
    for (int i = 0; i < red->r; i++)
        most = isfinite(red->dv[i]) ? fmax(most, fabs(red->dv[i]) / s->scale[red->part->v[i]]) : INFINITY;
    return most;
}

double kmp_reduction_slip(const kmp_reduction *red, int k, const bool *left_out)
{
    const kempe_system *s = red->eval->system;
    const kmp_pattern *j = &s->jacobian;
    const double *x = red->x + k * red->n;
    double most = 0;
    for (int e = 0; e < j->count;) { /* entries are in row-major order */
        int row = j->row[e];
        double slip = 0;
        bool looked_at = red->row_of[row] < 0 && !(left_out && left_out[row]);
        for (; e < j->count && j->row[e] == row; e++)
            slip += looked_at ? red->eval->jacobian[e] * x[j->col[e]] : 0;
        most = fmax(most, isfinite(slip) ? fabs(slip) / s->row_scale[row] : INFINITY);
    }
    return most;
}

/* -- counts ------------------------------------------------------------------------------------------ */

static void count_products(kmp_flops *sum, long products)
{
    kmp_flops_add(sum, products, (kmp_flops){.add = 1, .mul = 1});
}

/* Operation count of add_mass_times, in products of two numbers. */
static long mass_products(const kmp_evaluator *eval)
{
    const kmp_pattern *m = &eval->system->mass;
    long products = 0;
    if (eval->by_products)
        return kmp_program_count(kmp_eval_program(eval, false), KMP_STAGE_PRODUCT, KMP_STAGE_PRODUCT).paper / 2;
    for (int k = 0; k < m->count; k++)
        products += m->row[k] == m->col[k] ? 1 : 2;
    return products;
}

kmp_counts kmp_reduction_count(const kmp_reduction *red)
{
    kmp_flops f = {0};
    long n = red->n, p = red->p, mass = mass_products(red->eval);
    const kmp_sparse_tangent *zeros = red->zeros;
    if (red->r > 0) {
        kmp_flops_add(&f, 1, kmp_block_factor_flops(red->block));
        /* columns of Bvu, x_t, a0 */
        kmp_flops_add(&f, (zeros ? 0 : p) + 1 + (red->eval->h_t ? 1 : 0), kmp_block_solve_flops(red->block, NULL));
        count_products(&f, mass);
    }
    if (zeros) {
        kmp_flops_add(&f, 1, zeros->solves);
        /* M X, X' force, X' M X */
        count_products(&f, 2L * zeros->x_start[p] + zeros->mass_products + zeros->x_products);
    } else if (red->r > 0) {
        count_products(&f, red->r * p);                           /* rates */
        count_products(&f, p * (mass + n) + p * (p + 1) / 2 * n); /* M X, X' force, X' M X */
    }
    if (zeros) {
        count_products(&f, zeros->factor_products + 2 * zeros->l_entries);
        kmp_flops_add(&f, 1, (kmp_flops){.div = zeros->l_entries + 2 * p, .root = p});
    } else {
        kmp_flops_add(&f, 1, kmp_cholesky_factor_flops(red->p));
        kmp_flops_add(&f, 1, kmp_cholesky_solve_flops(red->p));
    }
    long paper = f.add + f.mul + f.div;
    return (kmp_counts){
        .add = f.add, .mul = f.mul, .div = f.div, .other = f.root, .paper = paper, .robotran = paper + f.root};
}
