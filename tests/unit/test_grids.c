/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 3 */
/* Random grids of loops, in the plane and in space, with redundant closures: accelerations and multipliers of the
 * reduced formulation, of the saddle system and of articulated bodies are those of a dense solution with M, C and J. */
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/reduction.h"
#include "full.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include "loaded.h"
#include "random.h"
#include <inttypes.h>
#include <kempe/check.h>
#include <math.h>
#include <string.h>

/* In the plane or in space with random numbers, or of equal rods in the plane. */
typedef enum grid { GRID_PLANE, GRID_SPACE, GRID_REGULAR } grid;

/* Rods v in zigzag. */
static void put_start(kmp_text *text, int rows, int columns)
{
    kmp_text_put(text, "start: {q: {");
    for (int r = 0; r < rows; r++)
        for (int c = 0; c <= columns; c++) {
            kmp_text_printf(text, "%sa%dx%d: %d deg", r + c > 0 ? ", " : "", r, c,
                            r == 0       ? -80
                            : r % 2 == 1 ? 10
                                         : -10);
            if (c < columns)
                kmp_text_printf(text, ", b%dx%d: %d deg", r, c, r % 2 == 0 ? 80 : 90);
        }
    kmp_text_put(text, "}}\n");
}

/* Rods v hang from nodes, one below the other in each column; rods h join the nodes of neighbouring columns. In space
 * every joint has an axis of its own, and rods h turn about two. */
static loaded load_grid(int rows, int columns, grid kind, bool redundant)
{
    static const char *const axis[3] = {"x", "y", "z"};
    const bool in_space = kind == GRID_SPACE, regular = kind == GRID_REGULAR;
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\ngravity: [1, -9, 2]\nground: {points: {");
    for (int c = 0; c <= columns; c++)
        kmp_text_printf(&text, "%sG%d: [%d, %.3g, 0]", c > 0 ? ", " : "", c, c, regular ? 0 : between(-0.2, 0.2));
    kmp_text_put(&text, "}}\nbodies:\n");
    for (int r = 0; r < rows; r++)
        for (int c = 0; c <= columns; c++) {
            const double length = regular ? 1 : between(0.8, 1.2);
            kmp_text_printf(&text, "  v%dx%d: {joint: {name: a%dx%d, revolute: %s, at: ", r, c, r, c,
                            in_space ? axis[pick(3)] : "z");
            if (r == 0)
                kmp_text_printf(&text, "ground.G%d", c);
            else
                kmp_text_printf(&text, "v%dx%d.T", r - 1, c);
            kmp_text_printf(&text,
                            "}, mass: %.4g, com: [%.4g, %.4g, 0.1], inertia: {xx: 0.03, yy: 0.08, zz: 0.09, xy: 0.002},"
                            " points: {T: [%.6g, 0, 0]}}\n",
                            between(0.5, 2), length / 2, between(-0.1, 0.1), length);
            if (c == columns)
                continue;
            kmp_text_printf(&text, "  h%dx%d: {joint: {name: b%dx%d, ", r, c, r, c);
            if (in_space)
                kmp_text_printf(&text, "universal: [%s, %s]", c % 2 ? "x" : "y", "z");
            else
                kmp_text_put(&text, "revolute: z");
            kmp_text_printf(
                &text,
                ", at: v%dx%d.T}, mass: %.4g, com: [0.5, 0, 0.05], inertia: {xx: 0.03, yy: 0.08, zz: 0.09}, "
                "points: {T: [%.6g, 0, 0]}}\n",
                r, c, between(0.5, 2), regular ? 1 : between(0.8, 1.2));
        }
    kmp_text_put(&text, "loops:\n");
    for (int r = 0; r < rows; r++)
        for (int c = 0; c < columns; c++)
            kmp_text_printf(&text, "  C%dx%d: {ball: [h%dx%d.T, v%dx%d.T]}\n", r, c, r, c, r, c + 1);
    if (redundant)
        kmp_text_put(&text, "  again: {ball: [h1x1.T, v1x2.T]}\n");
    kmp_text_put(&text, "forces:\n  s: {joint: a1x1, spring: {stiffness: 40, rest: 0.1, damping: 0.3}}\n");
    put_start(&text, regular ? rows : 0, columns);
    loaded l = load_text(text.s);
    kmp_text_free(&text);
    return l;
}

/* Refines x of A x = b by residuals of 64 bits: the factors alone lose as many digits as the condition has. */
static void refine(int size, const double *a, const double *lu, const int *pivot, const double *b, double *x)
{
    double *rest = KMP_NEW(double, size);
    for (int round = 0; round < 5; round++) {
        for (int i = 0; i < size; i++) {
            long double sum = b[i];
            for (int k = 0; k < size; k++)
                sum -= (long double)a[i + k * size] * x[k];
            rest[i] = (double)sum;
        }
        kmp_lu_solve(size, lu, pivot, 1, rest);
        for (int i = 0; i < size; i++)
            x[i] += rest[i];
    }
    kmp_free(rest);
}

/* The dense solution of M qdd + C = J' lambda, J qdd = -jdqd on the independent rows; false: singular. x (n + r). */
static bool solve_densely(const kmp_evaluator *eval, const kmp_partition *part, double *x)
{
    const int n = eval->n, r = part->r, size = n + r;
    double *a = KMP_NEW(double, size *size), *mass = KMP_NEW(double, n *n), *j = KMP_NEW(double, eval->m *n);
    int *pivot = KMP_NEW(int, size);
    kmp_eval_dense_mass(eval, mass);
    kmp_eval_dense_jacobian(eval, j);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++)
            a[i + k * size] = mass[i + k * n];
        for (int k = 0; k < r; k++) {
            a[n + k + i * size] = j[part->rows[k] + i * eval->m];
            a[i + (n + k) * size] = -j[part->rows[k] + i * eval->m];
        }
        x[i] = -eval->bias[i];
    }
    for (int k = 0; k < r; k++)
        x[n + k] = -eval->jdqd[part->rows[k]];
    double *lu = KMP_NEW(double, size *size), *b = KMP_NEW(double, size);
    memcpy(lu, a, (size_t)size * (size_t)size * sizeof *lu);
    memcpy(b, x, (size_t)size * sizeof *b);
    const bool made = kmp_lu_factor(size, lu, pivot) == 0;
    if (made) {
        kmp_lu_solve(size, lu, pivot, 1, x);
        refine(size, a, lu, pivot, b, x);
    }
    kmp_free(a);
    kmp_free(lu);
    kmp_free(b);
    kmp_free(mass);
    kmp_free(j);
    kmp_free(pivot);
    return made;
}

static double apart(int count, const double *x, const double *y)
{
    double size = 0, worst = 0;
    for (int i = 0; i < count; i++) {
        size = fmax(size, fabs(y[i]));
        worst = isfinite(x[i]) ? fmax(worst, fabs(x[i] - y[i])) : INFINITY;
    }
    return size > 0 ? worst / size : worst;
}

/* Counts of what a battery has met, and its largest differences. */
typedef struct met {
    int mechanisms, sparse_blocks, full_rows, saddles, by_bodies;
    double worst, worst_load; /* accelerations, multipliers: over the square of the condition of the rows */
    double well;              /* both as they are, where that condition is below 100 */
    double condition;         /* of the present ones: the first pivot of J over the last */
} met;

/* Entries of X have the condition as their size, and the reduced mass its square. Over 1000 grids the differences
 * grow as this square, whichever way makes them. */
static void note(met *all, double *worst, double difference)
{
    *worst = fmax(*worst, difference / (all->condition * all->condition));
    all->well = all->condition < 100 ? fmax(all->well, difference) : all->well;
}

static void place(kmp_evaluator *eval, const double *q, const double *qd)
{
    kmp_eval_closure(eval, 0.1, q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd);
}

static void compare_reduced(kmp_evaluator *eval, const kmp_partition *part, const double *qd, const double *x, met *all)
{
    kmp_reduction red;
    const int n = eval->n;
    double *udd = KMP_NEW(double, part->p + 1), *qdd = KMP_NEW(double, n), *lambda = KMP_NEW(double, eval->m + 1);
    CHECK(kmp_reduction_init(&red, eval, part) == KEMPE_OK);
    CHECK(kmp_reduction_factor(&red) == 0);
    kmp_reduction_tangent(&red);
    kmp_eval_bias(eval, qd);
    CHECK(kmp_reduction_accelerate(&red, udd) == 0);
    kmp_reduction_accelerations(&red, udd, qdd);
    kmp_reduction_multipliers(&red, qdd, lambda);
    all->sparse_blocks += kmp_block_largest(red.block) >= 32;
    all->full_rows += red.zeros && red.zeros->x_start[part->p] > n * part->p / 2;
    note(all, &all->worst, apart(n, qdd, x));
    double *own = KMP_NEW(double, part->r + 1);
    for (int k = 0; k < part->r; k++)
        own[k] = lambda[part->rows[k]];
    note(all, &all->worst_load, apart(part->r, own, x + n));
    kmp_free(own);
    kmp_reduction_free(&red);
    kmp_free(udd);
    kmp_free(qdd);
    kmp_free(lambda);
}

static void compare_saddle(kmp_evaluator *eval, const kmp_partition *part, const double *x, met *all)
{
    kmp_saddle saddle;
    const int n = eval->n;
    double *qdd = KMP_NEW(double, n), *lambda = KMP_NEW(double, eval->m + 1), *own = KMP_NEW(double, part->r + 1);
    CHECK(kmp_saddle_init(&saddle, eval, part) && kmp_saddle_factor(&saddle) == 0);
    kmp_saddle_accelerations(&saddle, qdd, lambda);
    for (int k = 0; k < part->r; k++)
        own[k] = lambda[part->rows[k]];
    all->saddles += saddle.kind == KMP_SADDLE_SPARSE;
    all->by_bodies += saddle.kind == KMP_SADDLE_BY_BODIES;
    note(all, &all->worst, apart(n, qdd, x));
    note(all, &all->worst_load, apart(part->r, own, x + n));
    kmp_saddle_free(&saddle);
    kmp_free(qdd);
    kmp_free(lambda);
    kmp_free(own);
}

/* At a random state, which no loop closes. */
static void compare_all(const loaded *l, met *all)
{
    enum { MOST_BY_BODIES = 60 }; /* their operations grow with the square of the open loops */
    kempe_system *by_mass = NULL, *by_bodies = NULL;
    CHECK(kempe_system_new_with_algorithm(l->model, "composite", &by_mass) == KEMPE_OK);
    if (by_mass->n <= MOST_BY_BODIES)
        CHECK(kempe_system_new_with_algorithm(l->model, "articulated", &by_bodies) == KEMPE_OK);
    kmp_evaluator *eval = kmp_eval_new(by_mass, "tape"), *bodies = by_bodies ? kmp_eval_new(by_bodies, "tape") : NULL;
    kmp_partition part;
    const int n = by_mass->n;
    double *q = KMP_NEW(double, 2 * n), *qd = q + n, *x = KMP_NEW(double, n + by_mass->m);
    for (int i = 0; i < n; i++) {
        q[i] = between(-1, 1);
        qd[i] = between(-1, 1);
    }
    place(eval, q, qd);
    CHECK(kmp_partition_init(&part, by_mass, eval->jacobian, NULL, 0) == KEMPE_OK);
    if (solve_densely(eval, &part, x)) {
        all->mechanisms++;
        all->condition = part.pivots[0] / part.pivots[part.r - 1];
        compare_reduced(eval, &part, qd, x, all);
        compare_saddle(eval, &part, x, all);
        if (bodies && kmp_eval_add_articulated(bodies) == KEMPE_OK && bodies->bodies.machine) {
            kmp_eval_set_by_bodies(bodies, true);
            place(bodies, q, qd);
            compare_saddle(bodies, &part, x, all);
        }
    }
    kmp_partition_free(&part);
    kmp_eval_free(eval);
    kmp_eval_free(bodies);
    kempe_system_free(by_mass);
    kempe_system_free(by_bodies);
    kmp_free(q);
    kmp_free(x);
}

static void random_grids_agree_with_dense_solutions(void)
{
    met all = {0};
    const int count = check_full() ? 1000 : 2;
    for (int k = 0; k < count; k++) {
        random_seed(100 + (uint64_t)k);
        const bool in_space = k % 3 > 0;
        const int rows = k == 0 ? 9 : k == 1 ? 4 : 2 + pick(9), columns = k == 0 ? 7 : 3 + pick(in_space ? 2 : 5);
        loaded l = load_grid(rows, columns, in_space ? GRID_SPACE : GRID_PLANE, k % 2 == 0);
        const double before = all.worst;
        compare_all(&l, &all);
        if (all.worst > fmax(before, 1e-13))
            printf("seed %d: %d x %d%s\n", 100 + k, rows, columns, in_space ? " in space" : "");
        unload(&l);
    }
    printf("  %d grids, %d with a sparse block, %d with a full X in fours, %d sparse saddle systems, %d by articulated "
           "bodies: accelerations to %.1e and multipliers to %.1e times the square of the condition, all to %.1e where "
           "it is below 100\n",
           all.mechanisms, all.sparse_blocks, all.full_rows, all.saddles, all.by_bodies, all.worst, all.worst_load,
           all.well);
    CHECK(all.mechanisms == count && all.sparse_blocks > count / 10 && all.full_rows > 0 && all.saddles > 0);
    CHECK(all.by_bodies > 0 && all.well < 1e-10 && all.worst < 1e-13 && all.worst_load < 1e-13);
}

/* The system [1 -J'; J tiny] of an assembled grid of equal rods. The order of least degree begins with multipliers and
 * needs pivots off the diagonal, which fill the factors; the order by closures needs fewer. */
static void saddle_systems_are_ordered_by_closures(void)
{
    enum { SIDE = 9 };
    loaded l = load_grid(SIDE, SIDE, GRID_REGULAR, false);
    kempe_assembly *assembled = NULL;
    CHECK(kempe_assembly_new(l.system, &assembled) == KEMPE_OK);
    kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
    kmp_eval_closure(eval, 0, kempe_assembly_q(assembled));
    const kmp_pattern *j = &l.system->jacobian;
    const int n = eval->n, m = eval->m, count = n + m + 2 * j->count;
    int *row = KMP_NEW(int, 3 * count), *col = row + count, *closure = col + count;
    double *value = KMP_NEW(double, count), *x = KMP_NEW(double, 3 * (n + m)), *y = x + n + m, *b = y + n + m;
    for (int k = 0; k < n + m; k++) {
        row[k] = col[k] = k;
        value[k] = k < n ? 1 : 1e-12;
        x[k] = y[k] = b[k] = between(-1, 1);
    }
    for (int e = 0, at = n + m; e < j->count; e++, at += 2) {
        row[at] = col[at + 1] = n + j->row[e];
        col[at] = row[at + 1] = j->col[e];
        value[at] = eval->jacobian[e];
        value[at + 1] = -eval->jacobian[e];
    }
    for (int r = 0; r < m; r++)
        closure[r] = l.system->rows[r].closure;
    kmp_sparse *plain = kmp_sparse_new(n + m, count, row, col, true);
    kmp_sparse *ordered = kmp_sparse_new_saddle(n, m, count, row, col, closure);
    const double estimate = kmp_sparse_operations(plain);
    CHECK(kmp_sparse_factor(plain, value) == KMP_SPARSE_FACTORED);
    for (int again = 0; again < 2; again++) {
        CHECK(kmp_sparse_factor(ordered, value) == KMP_SPARSE_FACTORED && kmp_sparse_solve(ordered, 1, x));
        for (int e = 0; e < count; e++)
            b[row[e]] -= value[e] * x[col[e]];
        for (int k = 0; k < n + m; k++) {
            CHECK(fabs(b[k]) < 1e-9);
            b[k] = x[k] = y[k];
        }
    }
    printf("  entries of factors: %" PRId64 " by closures, %" PRId64 " by least degree\n", kmp_sparse_fill(ordered),
           kmp_sparse_fill(plain));
    CHECK((double)kmp_sparse_fill(ordered) < 0.7 * (double)kmp_sparse_fill(plain) &&
          kmp_sparse_operations(ordered) > estimate);
    kmp_sparse_free(plain);
    kmp_sparse_free(ordered);
    kmp_free(row);
    kmp_free(value);
    kmp_free(x);
    kempe_assembly_free(assembled);
    kmp_eval_free(eval);
    unload(&l);
}

int main(void)
{
    TEST(random_grids_agree_with_dense_solutions);
    TEST(saddle_systems_are_ordered_by_closures);
    return check_report();
}
