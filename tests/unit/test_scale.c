/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 3 */
/* Large mechanisms: the sparse ways give what the dense ones do, and cost as much as there are non-zeros, counted in
 * products and in bytes. */
#include "base/memory.h"
#include "bench/chain.h"
#include "constraints/closing/assemble.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/partition/partition.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include "loaded.h"
#include "random.h"
#include "takes_bodies.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <kempe/workspace.h>
#include <stdbool.h>

enum { MOST = 40, MOST_NZ = MOST * MOST };

/* -- matrices ---------------------------------------------------------------------------------------- */

typedef struct matrix {
    kmp_entries entries;
    int row[MOST_NZ], col[MOST_NZ];
    double value[MOST_NZ], dense[MOST_NZ];
} matrix;

static void clear(matrix *a, int m, int n)
{
    *a = (matrix){.entries = {m, n, 0, NULL, NULL, NULL}};
    a->entries.row = a->row;
    a->entries.col = a->col;
    a->entries.value = a->value;
}

static void add(matrix *a, int i, int j, double value)
{
    int k = a->entries.nz++;
    a->row[k] = i;
    a->col[k] = j;
    a->value[k] = a->dense[i + j * a->entries.m] = value;
}

/* Small whole numbers, so that there are ties and exact zeros, or any. */
static void randomise(matrix *a, int m, int n, double filled, bool whole)
{
    clear(a, m, n);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++)
            if (between(0, 1) < filled)
                add(a, i, j, whole ? pick(5) - 2 : between(-1, 1));
}

/* -- complete pivoting ------------------------------------------------------------------------------- */

static void the_pivots_are_those_of_the_dense_matrix(void)
{
    static matrix a;
    static double lu[MOST_NZ];
    int r[MOST], c[MOST], dense_r[MOST], dense_c[MOST], fixed[MOST], different = 0;
    double pivots[MOST], dense_pivots[MOST];
    random_seed(5);
    for (int trial = 0; trial < 3000; trial++) {
        int m = 1 + pick(MOST), n = 1 + pick(MOST), least = m < n ? m : n;
        randomise(&a, m, n, between(0.02, 0.4), trial % 2);
        for (int k = 0; k < n; k++)
            fixed[k] = trial % 3 == 0 && pick(4) == 0;
        memcpy(lu, a.dense, sizeof lu);
        kmp_lu_complete(m, n, lu, fixed, dense_r, dense_c, dense_pivots);
        CHECK(kmp_sparse_complete(&a.entries, fixed, r, c, pivots, NULL));
        different += memcmp(r, dense_r, (size_t)m * sizeof *r) != 0 || memcmp(c, dense_c, (size_t)n * sizeof *c) != 0 ||
                     memcmp(pivots, dense_pivots, (size_t)least * sizeof *pivots) != 0;
    }
    CHECK(different == 0);
}

static void what_is_not_finite_has_no_rank(void)
{
    static matrix a;
    int r[3], c[3];
    double pivots[3];
    clear(&a, 3, 3);
    for (int k = 0; k < 3; k++)
        add(&a, k, k, k == 1 ? NAN : 1);
    CHECK(kmp_sparse_complete(&a.entries, NULL, r, c, pivots, NULL));
    CHECK(isnan(pivots[0]) && r[2] == 2 && c[2] == 2);
}

/* The closures of a chain of n windows that lie almost flat: complete pivoting takes the large rows y first, column by
 * column, and fills the small rows x. Returns its products; the rank from the pivots. */
static long flat_chain(int n, double small, int *rank)
{
    int nz = 6 * n, count = 0, *row = KMP_NEW(int, nz), *col = KMP_NEW(int, nz), *r = KMP_NEW(int, 2 * n),
        *c = KMP_NEW(int, 2 * n + 1);
    double *value = KMP_NEW(double, nz), *pivots = KMP_NEW(double, 2 * n);
    int64_t products;
    for (int i = 0; i < n; i++)
        for (int side = 0; side < 2; side++)
            for (int k = 0; k < 3; k++) {
                row[count] = 2 * i + side;
                col[count] = k == 1 ? n + 1 + i : i + k / 2;
                double size = k == 1 ? 1 : k == 0 ? 2 : -1;
                value[count++] = side ? size * (1 + 0.01 * (i % 5)) : small * (k + 1 + 0.1 * (i % 3));
            }
    kmp_entries a = {2 * n, 2 * n + 1, nz, row, col, value};
    CHECK(kmp_sparse_complete(&a, NULL, r, c, pivots, &products));
    *rank = 0;
    while (*rank < 2 * n && pivots[*rank] > 1e-10 * pivots[0])
        ++*rank;
    for (int k = 1; k < 2 * n; k++)
        CHECK(pivots[k] <= pivots[k - 1] * (1 + 1e-12));
    void *arrays[] = {row, col, r, c, value, pivots};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
    return products;
}

/* Twice the chain costs twice as much, where elimination by the largest entry alone makes it four times and more. */
static void products_grow_with_the_chain(void)
{
    int rank;
    long before = flat_chain(1000, 1e-3, &rank);
    CHECK(rank == 2000);
    for (int n = 2000; n <= 4000; n *= 2) {
        long now = flat_chain(n, 1e-3, &rank);
        CHECK(rank == 2 * n);
        CHECK((double)now < 2.3 * (double)before);
        CHECK(now > n);
        before = now;
    }
    (void)flat_chain(1000, 0, &rank);
    CHECK(rank == 1000);
    (void)flat_chain(1000, 1e-14, &rank);
    CHECK(rank == 1000);
}

/* -- systems of equations ---------------------------------------------------------------------------- */

static double one_norm(int n, const double *a)
{
    double most = 0;
    for (int j = 0; j < n; j++) {
        double sum = 0;
        for (int i = 0; i < n; i++)
            sum += fabs(a[i + j * n]);
        most = check_max(most, sum);
    }
    return most;
}

static void sparse_systems_are_solved(void)
{
    static matrix a;
    static double lu[MOST_NZ], inverse[MOST_NZ];
    int pivot[MOST], poor = 0;
    double x[MOST], norm, estimate;
    random_seed(7);
    for (int trial = 0; trial < 300; trial++) {
        int n = 2 + pick(MOST - 2);
        randomise(&a, n, n, 0.2, false);
        for (int k = 0; k < n; k++)
            if (a.dense[k + k * n] == 0)
                add(&a, k, k, between(1, 2));
        kmp_sparse *s = kmp_sparse_new(n, a.entries.nz, a.row, a.col, trial % 2);
        CHECK(s);
        for (int again = 0; s && again < 2; again++) { /* the second time with the pivots of the first */
            memcpy(lu, a.dense, sizeof lu);
            memset(inverse, 0, sizeof inverse);
            for (int k = 0; k < n; k++)
                inverse[k + k * n] = 1;
            CHECK(kmp_lu_factor(n, lu, pivot) == 0 && kmp_sparse_factor(s, a.value) == 0);
            kmp_lu_solve(n, lu, pivot, n, inverse);
            double size = one_norm(n, inverse);
            for (int k = 0; k < n; k++)
                x[k] = k == 0;
            kmp_sparse_solve(s, 1, x);
            for (int k = 0; k < n; k++)
                CHECK(fabs(x[k] - inverse[k]) < 1e-13 * size * size);
            kmp_sparse_norms(s, &norm, &estimate);
            CHECK_NEAR(norm, one_norm(n, a.dense), 1e-14);
            CHECK(estimate <= size * (1 + 1e-9 * size));
            poor += estimate < size / 3;
            for (int e = 0; e < a.entries.nz; e++)
                a.dense[a.row[e] + a.col[e] * n] = a.value[e] *= between(0.5, 1.5);
        }
        kmp_sparse_free(s);
    }
    CHECK(poor <= 6);
}

static void singular_systems_are_reported(void)
{
    const int row[3] = {0, 1, 1}, col[3] = {0, 0, 1};
    const double zero[3] = {1, 1, 0};
    kmp_sparse *s = kmp_sparse_new(2, 3, row, col, false);
    CHECK(s && kmp_sparse_factor(s, zero) != 0);
    kmp_sparse_free(s);
    CHECK(!kmp_sparse_new(2, 2, row, col, false)); /* nothing in the second column */
    s = kmp_sparse_new(2, 1, row, col, true);      /* told when factored */
    CHECK(s && kmp_sparse_factor(s, zero) != 0);
    kmp_sparse_free(s);
}

/* -- the choice -------------------------------------------------------------------------------------- */

/* Rows, columns and values of `blocks` full blocks with one column more than rows, shuffled. */
static void fill_blocks(kmp_pick *p, const int *shuffle, int blocks, int rows)
{
    for (int b = 0; b < blocks; b++)
        for (int i = 0; i < rows; i++)
            for (int k = 0; k <= rows; k++)
                kmp_pick_add(p, b * rows + i, shuffle[b * (rows + 1) + k], between(-1, 1));
}

static int compare_ints(const void *a, const void *b)
{
    return *(const int *)a - *(const int *)b;
}

static bool same_columns(kmp_pick *a, kmp_pick *b, int r)
{
    qsort(a->col, (size_t)r, sizeof *a->col, compare_ints);
    qsort(b->col, (size_t)r, sizeof *b->col, compare_ints);
    return memcmp(a->col, b->col, (size_t)r * sizeof *a->col) == 0;
}

static void blocks_are_chosen_as_the_whole(void)
{
    random_seed(13);
    int exchanged = 0;
    for (int trial = 0; trial < 200; trial++) {
        int blocks = 1 + pick(6), rows = 1 + pick(5), m = blocks * rows, n = blocks * (rows + 1), shuffle[36];
        kmp_pick whole, parts;
        double pivots[30], other[30], max_b, cond, max_parts, cond_parts;
        int made, made_parts;
        for (int k = 0; k < n; k++)
            shuffle[k] = k;
        for (int k = n - 1; k > 0; k--) {
            int j = pick(k + 1), t = shuffle[k];
            shuffle[k] = shuffle[j];
            shuffle[j] = t;
        }
        CHECK(kmp_pick_init(&whole, m, n, m * (rows + 1), NULL) && kmp_pick_init(&parts, m, n, m * (rows + 1), NULL));
        whole.dense = true;
        parts.dense = false;
        fill_blocks(&whole, shuffle, blocks, rows);
        for (int e = 0; e < whole.nz; e++)
            kmp_pick_add(&parts, whole.entry_row[e], whole.entry_col[e], whole.value[e]);
        CHECK(kmp_pick_pivot(&whole, NULL, pivots) && kmp_pick_pivot(&parts, NULL, other));
        CHECK(memcmp(pivots, other, (size_t)m * sizeof *pivots) == 0);
        for (int b = 0; trial % 2 && b < blocks; b++) { /* a choice that is not good: the last column of each block */
            for (int k = 0; k < rows; k++)
                whole.col[b * rows + k] = parts.col[b * rows + k] = shuffle[b * (rows + 1) + k];
            whole.col[m + b] = parts.col[m + b] = shuffle[b * (rows + 1) + rows];
        }
        CHECK(kmp_pick_improve(&whole, m, 100, &made, &max_b) == KMP_PICK_MADE);
        CHECK(kmp_pick_improve(&parts, m, 100, &made_parts, &max_parts) == KMP_PICK_MADE);
        CHECK(kmp_pick_condition(&whole, m, &cond) == KMP_PICK_MADE);
        CHECK(kmp_pick_condition(&parts, m, &cond_parts) == KMP_PICK_MADE);
        CHECK(same_columns(&whole, &parts, m) && made == made_parts);
        CHECK_NEAR(max_parts, max_b, 1e-10);
        CHECK(cond_parts <= cond * (1 + 1e-9) && cond_parts >= cond / 3);
        exchanged += made;
        kmp_pick_free(&whole);
        kmp_pick_free(&parts);
    }
    CHECK(exchanged > 100);
}

/* One long block, too large to be dense, begun with a column that moves others much. */
static void a_long_block_is_exchanged_as_well(void)
{
    enum { N = 150 };
    kmp_pick whole, parts;
    double max_b, cond, max_parts, cond_parts;
    int made, made_parts;
    random_seed(17);
    CHECK(kmp_pick_init(&whole, N, N + 4, 5 * N, NULL) && kmp_pick_init(&parts, N, N + 4, 5 * N, NULL));
    whole.dense = true;
    parts.dense = false;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 5; k++)
            kmp_pick_add(&whole, i, i + k, k % 4 ? between(-0.6, 0.6) : between(0.8, 1.2));
    for (int e = 0; e < whole.nz; e++)
        kmp_pick_add(&parts, whole.entry_row[e], whole.entry_col[e], whole.value[e]);
    for (int k = 0, v = 0, u = N; k < N + 4; k++) { /* u: columns 30, 32, 100, 102 */
        bool chosen = k % 70 != 30 && k % 70 != 32;
        int place = chosen ? v++ : u++;
        whole.col[place] = parts.col[place] = k;
    }
    for (int i = 0; i < N; i++)
        whole.row[i] = parts.row[i] = i;
    CHECK(kmp_pick_improve(&whole, N, 1000, &made, &max_b) == KMP_PICK_MADE);
    CHECK(kmp_pick_improve(&parts, N, 1000, &made_parts, &max_parts) == KMP_PICK_MADE);
    CHECK(kmp_pick_condition(&whole, N, &cond) == KMP_PICK_MADE);
    CHECK(kmp_pick_condition(&parts, N, &cond_parts) == KMP_PICK_MADE);
    CHECK(made > 2 && made == made_parts && same_columns(&whole, &parts, N));
    CHECK(max_b <= 1.5 && max_parts <= 1.5);
    CHECK_NEAR(max_parts, max_b, 1e-9);
    CHECK(cond_parts <= cond * (1 + 1e-9) && cond_parts >= cond / 3);
    kmp_pick_free(&whole);
    kmp_pick_free(&parts);
}

static void a_singular_choice_is_reported(void)
{
    kmp_pick p;
    double max_b, cond;
    int made;
    CHECK(kmp_pick_init(&p, 2, 3, 3, NULL));
    p.dense = false;
    kmp_pick_add(&p, 0, 0, 1); /* v = 0, 1; row 1 has column 2 alone */
    kmp_pick_add(&p, 1, 2, 1);
    for (int k = 0; k < 3; k++)
        p.col[k] = k;
    p.row[1] = 1;
    CHECK(kmp_pick_improve(&p, 2, 10, &made, &max_b) == KMP_PICK_SINGULAR);
    CHECK(kmp_pick_condition(&p, 2, &cond) == KMP_PICK_SINGULAR);
    kmp_pick_free(&p);
}

/* -- chains ------------------------------------------------------------------------------------------ */

static loaded chain(int n, bool unequal, double apart)
{
    char *text = chain_text(n, unequal, apart);
    loaded l = load_text(text);
    kmp_free(text);
    return l;
}

typedef struct last {
    int n;
    double *q, angle, lambda;
} last;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    last *l = user;
    (void)t, (void)qd, (void)qdd, (void)work;
    memcpy(l->q, q, (size_t)l->n * sizeof *q);
    l->lambda = lambda[1];
    return 0;
}

static kmp_run_report run(const loaded *l, const char *formulation, const char *form, double rtol, double end,
                          last *row)
{
    kmp_run_report report;
    kmp_run_spec spec = {
        .formulation = formulation, .form = form, .rtol = rtol, .t_end = end, .time_count = 1, .times = &end};
    row->n = l->system->n;
    row->q = KMP_NEW(double, row->n);
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l->system, &spec, NULL, take_row, row, &report) == KEMPE_OK);
    if (report.reason)
        printf("  %s: %s\n", formulation, report.reason);
    kmp_free(report.reason);
    return report;
}

static double distance(const last *a, const last *b)
{
    double most = 0;
    for (int k = 0; k < a->n; k++)
        most = check_max(most, fabs(a->q[k] - b->q[k]));
    return most;
}

/* Long enough for every formulation to be sparse. */
static void the_formulations_agree_on_a_long_chain(void)
{
    loaded l = chain(300, true, 0);
    last carried, closed, projected, dae;
    run(&l, "reduced", "integrated", 1e-10, 0.4, &carried);
    run(&l, "reduced", "newton", 1e-10, 0.4, &closed);
    run(&l, "projected", NULL, 1e-10, 0.4, &projected);
    run(&l, "dae", "stabilized1", 1e-8, 0.4, &dae);
    CHECK(distance(&carried, &closed) < 1e-9);
    CHECK(distance(&carried, &projected) < 1e-9);
    CHECK(distance(&carried, &dae) < 1e-6);
    CHECK_NEAR(projected.lambda, carried.lambda, 1e-6);
    CHECK_NEAR(dae.lambda, carried.lambda, 1e-4);
    last *rows[] = {&carried, &closed, &projected, &dae};
    for (int k = 0; k < 4; k++)
        kmp_free(rows[k]->q);
    unload(&l);
}

/* Equal windows move as one: with c = cos a, M = (n + 1) / 3 + n, a'' = -g ((n + 1) / 2 + n) / M cos a (bars of 1 kg
 * and 1 m, whose loops leave the couplers level). */
static double angle_at(int n, double t)
{
    double k = 9.81 * ((n + 1) / 2.0 + n) / ((n + 1) / 3.0 + n), a = acos(-1) / 2, w = -1;
    int steps = 20000;
    double h = t / steps;
    for (int i = 0; i < steps; i++) { /* Runge and Kutta, order 4 */
        double a1 = w, w1 = -k * cos(a), a2 = w + h / 2 * w1, w2 = -k * cos(a + h / 2 * a1), a3 = w + h / 2 * w2,
               w3 = -k * cos(a + h / 2 * a2), a4 = w + h * w3, w4 = -k * cos(a + h * a3);
        a += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
        w += h / 6 * (w1 + 2 * w2 + 2 * w3 + w4);
    }
    return a;
}

/* Through the flat position, where all windows could fold. */
static void a_long_chain_passes_its_change_point(void)
{
    loaded l = chain(80, false, 0);
    last row;
    for (int k = 0; k < 3; k++) {
        const double rtol[] = {1e-7, 1e-8, 1e-10};
        run(&l, "reduced", "integrated", rtol[k], 1.3, &row);
        for (int i = 0; i <= 80; i += 20)
            CHECK_NEAR(row.q[i], angle_at(80, 1.3), 1e-6);
        kmp_free(row.q);
    }
    unload(&l);
}

/* Through a change point, by numbers that a run of a chain twice as long has twice: products of a look at the margin,
 * and right-hand sides as many. */
static void passing_is_linear(void)
{
    long products[2];
    long rhs[2];
    for (int k = 0; k < 2; k++) {
        loaded l = chain(100 << k, false, 0);
        const double end = 0.9;
        kmp_runner *runner = NULL;
        kmp_run_report report;
        kmp_run_spec spec = {.rtol = 1e-8, .t_end = end};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK &&
              kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK);
        while (kmp_runner_t(runner) < end && kmp_runner_step(runner) == KEMPE_OK)
            continue;
        products[k] =
            kmp_block_factor_flops(runner->margin.block).mul + kmp_block_solve_flops(runner->margin.block, NULL).mul;
        kmp_runner_report(runner, &report);
        rhs[k] = report.rhs;
        printf("  N = %d: %ld evaluations, %ld products of a look\n", 100 << k, rhs[k], products[k]);
        CHECK(runner->log->count > 0 || !runner->change_point.near);
        kmp_free(report.reason);
        kmp_runner_free(runner);
        unload(&l);
    }
    CHECK(10 * products[1] < 21 * products[0] && rhs[1] < 2 * rhs[0]);
}

/* Equal windows, which pass their change point together in every row: an even number keeps the sign of det Jv. */
static void no_change_point_is_missed(void)
{
    for (int n = 32; n <= 128; n *= 2) {
        loaded l = chain(n, false, 0);
        const double end = 10;
        kmp_run_report report;
        kmp_run_log log = {.context = l.context};
        last row = {.n = l.system->n, .q = KMP_NEW(double, l.system->n)};
        kmp_run_spec spec = {.rtol = 1e-8, .t_end = end, .time_count = 1, .times = &end, .log = &log};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, NULL, take_row, &row, &report) == KEMPE_OK);
        CHECK(log.count == 10);
        for (int k = 0; k < log.kept; k++)
            CHECK(strcmp(log.entries[k].kind, "change point") == 0 && log.entries[k].before < 1e-9);
        kmp_free(row.q);
        kmp_free(report.reason);
        kmp_run_log_free(&log);
        unload(&l);
    }
}

static loaded pendulums(int n)
{
    char *text = chain_of_pendulums(n);
    loaded l = load_text(text);
    kmp_free(text);
    return l;
}

/* As many freedoms as loops: by the sparse saddle system of M and C, and by articulated bodies, which auto takes. The
 * operations of both grow with the number of loops. The reduced formulation gives what the projected one does. */
static void many_freedoms_stay_sparse(void)
{
    double cost[2];
    long factorizations[2], operations[2];
    for (int k = 0; k < 2; k++) {
        loaded l = pendulums(100 << k);
        last reduced, projected, by_bodies;
        kempe_system *by_auto = l.system;
        CHECK(takes_bodies(by_auto));
        operations[k] = kmp_program_count(by_auto->bodies->program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
        run(&l, "reduced", "integrated", 1e-9, 0.5, &by_bodies);
        CHECK(kempe_system_new_with_algorithm(l.model, "composite", &l.system) == KEMPE_OK);
        kmp_run_report report = run(&l, "reduced", "integrated", 1e-9, 0.5, &reduced);
        factorizations[k] = report.factorizations;
        CHECK(report.factorizations > 2 * report.rhs - 5); /* Jv's and the saddle system's */
        run(&l, "projected", NULL, 1e-9, 0.5, &projected);
        CHECK(distance(&reduced, &projected) < 1e-8 && distance(&reduced, &by_bodies) < 1e-8);
        kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
        kmp_partition part;
        kmp_saddle saddle;
        kmp_eval_closure(eval, 0, reduced.q);
        CHECK(kmp_partition_init(&part, l.system, eval->jacobian, NULL, 0) == KEMPE_OK);
        CHECK(kmp_saddle_init(&saddle, eval, &part) && saddle.sparse &&
              (cost[k] = kmp_sparse_operations(saddle.sparse)) > 0);
        kmp_saddle_free(&saddle);
        kmp_partition_free(&part);
        kmp_eval_free(eval);
        kempe_system_free(by_auto);
        kmp_free(reduced.q);
        kmp_free(projected.q);
        kmp_free(by_bodies.q);
        unload(&l);
    }
    printf("  operations of a saddle system: %.0f, %.0f; by articulated bodies: %ld, %ld\n", cost[0], cost[1],
           operations[0], operations[1]);
    CHECK(cost[1] < 2.1 * cost[0] && factorizations[1] < 2 * factorizations[0]);
    CHECK((double)operations[1] < 2.1 * (double)operations[0]);
}

static void a_chain_apart_is_assembled(void)
{
    loaded l = chain(300, true, 2);
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_OK);
    CHECK(a->residual < 1e-11 && a->iterations < 20);
    double moved = 0;
    for (int k = 0; k < l.system->n; k++)
        moved = check_max(moved, fabs(a->moved[k]));
    CHECK(moved > 1e-3 && moved < 0.2);
    kempe_assembly_free(a);
    unload(&l);
}

/* Bytes asked for by assembling, preparing and ten steps. */
static double bytes_of(int n, const char *formulation)
{
    loaded l = chain(n, true, 0);
    kmp_runner *runner = NULL;
    kmp_run_spec spec = {.formulation = formulation, .rtol = 1e-6, .t_end = 0.3};
    double before = (double)kmp_memory_bytes();
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK && kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK);
    for (int k = 0; k < 10 && kmp_runner_t(runner) < 0.3; k++)
        CHECK(kmp_runner_step(runner) == KEMPE_OK);
    double bytes = (double)kmp_memory_bytes() - before;
    kmp_runner_free(runner);
    unload(&l);
    return bytes;
}

static double bytes_of_check(int n)
{
    loaded l = chain(n, true, 2);
    kempe_check *check = NULL;
    double before = (double)kmp_memory_bytes();
    CHECK(kempe_check_new(l.system, &check) == KEMPE_OK);
    double bytes = (double)kmp_memory_bytes() - before;
    kempe_check_free(check);
    unload(&l);
    return bytes;
}

/* Twice the chain, twice the bytes: no matrix is made dense on the way. */
static void memory_grows_with_the_chain(void)
{
    const char *formulations[] = {"reduced", "projected"};
    for (int k = 0; k < 2; k++)
        CHECK(bytes_of(600, formulations[k]) < 2.3 * bytes_of(300, formulations[k]));
    CHECK(bytes_of_check(600) < 2.3 * bytes_of_check(300));
}

/* -- no memory --------------------------------------------------------------------------------------- */

static void every_want_of_memory_is_reported(void)
{
    loaded l = chain(100, false, 1);
    kempe_status status = KEMPE_E_MEMORY;
    int reported = 0;
    for (unsigned long at = 1; status != KEMPE_OK && at < 1000000; at += 1 + at / 8) {
        kempe_check *check = NULL;
        unsigned long failures = kmp_memory_failures();
        kmp_memory_fail_at(at);
        status = kempe_check_new(l.system, &check);
        kmp_memory_fail_at(0);
        if (kmp_memory_failures() != failures) {
            CHECK(status == KEMPE_E_MEMORY || status == KEMPE_OK);
            reported += status == KEMPE_E_MEMORY;
            status = KEMPE_E_MEMORY;
        }
        kempe_check_free(check);
    }
    CHECK(status == KEMPE_OK && reported > 20);
    unload(&l);
}

int main(void)
{
    TEST(the_pivots_are_those_of_the_dense_matrix);
    TEST(what_is_not_finite_has_no_rank);
    TEST(products_grow_with_the_chain);
    TEST(sparse_systems_are_solved);
    TEST(singular_systems_are_reported);
    TEST(blocks_are_chosen_as_the_whole);
    TEST(a_long_block_is_exchanged_as_well);
    TEST(a_singular_choice_is_reported);
    TEST(the_formulations_agree_on_a_long_chain);
    TEST(a_long_chain_passes_its_change_point);
    TEST(passing_is_linear);
    TEST(many_freedoms_stay_sparse);
    TEST(no_change_point_is_missed);
    TEST(a_chain_apart_is_assembled);
    TEST(memory_grows_with_the_chain);
    TEST(every_want_of_memory_is_reported);
    return check_report();
}
