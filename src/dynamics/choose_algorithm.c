/* SPDX-License-Identifier: BSD-3-Clause */
/* Algorithms of the dynamics are chosen by counts of operations: counted where a program is made, and bounded from
 * below before an expensive one is derived. */
#include "dynamics/choose_algorithm.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/kinds/kind.h"
#include "dynamics/choose_variants.h"
#include "dynamics/motion.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <math.h>
#include <stdint.h>

/* -- products with M in place of M ------------------------------------------------------------------- */

/* Products M x are taken for at most this number of independent coordinates. Their operations per link, of a tree whose
 * root moves in space (14 to 22 in the plane), and the operations of an entry of M of a deep tree, where half of them
 * do not count; each column of M X takes four more. */
enum { MOST_PRODUCTS = 7 };
#define OF_PRODUCT 50
#define OF_ENTRY   10

/* Of p independent coordinates; with none as with one. */
static bool products_pay(const kempe_model *model, int p)
{
    const double columns = p > 1 ? p : 1;
    int *depth = KMP_NEW(int, model->body_count);
    double entries = 0; /* of M: of each motion with itself and the motions that carry it */
    for (int b = 1; depth && b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        depth[b] = depth[body->parent] + body->motion_count;
        entries += body->motion_count * (depth[body->parent] + 0.5 * (body->motion_count + 1));
    }
    kmp_free(depth);
    return columns * OF_PRODUCT * model->motion_count < (OF_ENTRY + 4 * columns) * entries;
}

bool kmp_motion_may_go_by_products(const kempe_system *s)
{
    const kempe_model *model = s->model;
    const int rows = kmp_closure_all_rows(model);
    bool needed = s->dynamics != KMP_DYNAMICS_AUTO || kmp_model_has_loads(model) || model->wheel_count > 0;
    for (int c = 0; c < model->closure_count; c++)
        needed = needed || model->closures[c].curve_count > 0;
    for (int k = 0; k < model->force_count; k++)
        needed = needed || kmp_force_has_load(&model->forces[k]) || kmp_force_has_modes(&model->forces[k]);
    return !needed && rows > 0 && model->motion_count - rows <= MOST_PRODUCTS && kmp_equations_are_large(model) &&
           products_pay(model, 1);
}

bool kmp_motion_goes_by_products(const kempe_system *s, int rows)
{
    const int p = s->model->motion_count - rows;
    return p <= MOST_PRODUCTS && products_pay(s->model, p);
}

/* -- articulated bodies ------------------------------------------------------------------------------ */

/* The choice between M and C and articulated bodies, made when articulated bodies are first asked for.
 *
 * The cost of a right-hand side is counted as in the reduced formulation: the program, and the solves with its values.
 * By M and C these are the mass of n - m independent coordinates and its Cholesky factors, or the sparse saddle system
 * where that costs less. By articulated bodies there are none. The work common to both, Jv and its tangent, is left
 * out. bench/bench_articulated.c measures the size from which articulated
 * bodies are faster. */

/* M and C cost fewer operations with fewer independent coordinates than this; nothing else is tried. */
#define FEW 7
/* Up to this number of independent coordinates the solution by M and C is written out in one program, in which closures
 * leave zeros: articulated bodies are tried only on trees. */
#define WRITTEN_OUT 8
/* The time of an operation by articulated bodies over the time in such a program: the recursion passes from link to
 * link, and waits for each. Measured on 20 examples and models of tests, 0.95 to 1.5. */
#define RECURSION_WAITS 1.25
/* A lower bound of the operations per coordinate by articulated bodies, in the plane, and for each row that is carried
 * over a joint, and each pair of them. If M and C take fewer, articulated bodies are not tried. */
#define LEAST_OF_COORDINATE 15
#define LEAST_OF_ROW        8
#define LEAST_OF_PAIR       1
/* The least operations by articulated bodies over the operations of M and C, on trees of that size. */
#define LEAST_OF_TREE 1.1

static double operations(kmp_flops f)
{
    return (double)f.add + (double)f.mul + (double)f.div;
}

static double operations_of(const kmp_program *program)
{
    return (double)kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
}

static int independent(const kempe_system *s)
{
    return s->n > s->m ? s->n - s->m : 0;
}

/* Entry k of [M -J'; J 0], of M with both its triangles; false after the last. */
static bool saddle_entry(const kempe_system *s, int k, int *row, int *col)
{
    int side = k % 2, e = k / 2 - s->mass.count;
    const kmp_pattern *pattern = e < 0 ? &s->mass : &s->jacobian;
    if (e >= s->jacobian.count)
        return false;
    int i = e < 0 ? pattern->row[k / 2] : s->n + pattern->row[e], j = pattern->col[e < 0 ? k / 2 : e];
    *row = side ? j : i;
    *col = side ? i : j;
    return true;
}

/* Cost of the saddle system's sparse factors, in operations of dense ones; infinite when there is no memory or no
 * pattern.
 */
static double cost_of_saddle(const kempe_system *s)
{
    int most = 2 * (s->mass.count + s->jacobian.count), count = 0;
    int *row = KMP_NEW(int, most), *col = KMP_NEW(int, most);
    for (int k = 0; row && col && saddle_entry(s, k, &row[count], &col[count]); k++)
        count += k % 2 == 0 || row[count] != col[count];
    kmp_sparse *sparse = row && col ? kmp_sparse_new(s->n + s->m, count, row, col, true) : NULL;
    double cost = sparse ? KMP_SPARSE_COST * kmp_sparse_operations(sparse) : INFINITY;
    kmp_sparse_free(sparse);
    kmp_free(row);
    kmp_free(col);
    return cost;
}

/* Cost of M a0, M X, X' force and X' M X, then the factors; on a tree X is 1. With many coordinates and loops, where X'
 * M X is dense, the saddle system. */
static double cost_of_solves(const kempe_system *s)
{
    double n = s->n, p = independent(s), mass = 2.0 * s->mass.count;
    double products = s->m > 0 ? mass * (p + 1) + p * n + p * (p + 1) / 2 * n : 0;
    int k = independent(s);
    double dense = 2 * products + operations(kmp_cholesky_factor_flops(k)) + operations(kmp_cholesky_solve_flops(k));
    return s->m > 0 ? fmin(dense, cost_of_saddle(s)) : dense;
}

static bool pays_written_out(const kempe_system *s, double bodies)
{
    double tree = 0; /* factors of M and one solution: from the leaves to the root nothing fills its zeros */
    for (int i = 0; i < s->n; i++) {
        double coupled = 0;
        for (int e = 0; e < s->mass.count; e++)
            coupled += s->mass.row[e] != s->mass.col[e] &&
                       (s->mass.row[e] > s->mass.col[e] ? s->mass.row[e] : s->mass.col[e]) == i;
        tree += coupled * (coupled + 1) + 5 * coupled + 1;
    }
    return RECURSION_WAITS * bodies < operations_of(s->motion) + tree;
}

static double cost_by_mass(const kempe_system *s)
{
    return operations_of(s->motion) + cost_of_solves(s);
}

static int common(const int *parent, int i, int j)
{
    while (i != j) /* a parent has the smaller number */
        if (i > j)
            i = parent[i];
        else
            j = parent[j];
    return i;
}

/* The rows that are carried over each link, and where each is eliminated: sets of rows, as bits. */
typedef struct carried_sets {
    kmp_arena arena;
    int words, *parent, *home;
    uint64_t *open, *coupled; /* of each link, of each row */
} carried_sets;

static uint64_t *set_of(const carried_sets *c, uint64_t *sets, int k)
{
    return sets + (size_t)k * (size_t)c->words;
}

static int size_of(const carried_sets *c, const uint64_t *set)
{
    int size = 0;
    for (int w = 0; w < c->words; w++)
        size += __builtin_popcountll(set[w]);
    return size;
}

static void join(const carried_sets *c, uint64_t *into, const uint64_t *from)
{
    for (int w = 0; w < c->words; w++)
        into[w] |= from[w];
}

/* False: no memory. */
static bool find_carried(carried_sets *c, const kempe_system *s)
{
    const kmp_pattern *j = &s->jacobian;
    c->words = (s->m + 63) / 64;
    const size_t words = (size_t)c->words;
    if (!KMP_ARENA_MAKE(&c->arena, KMP_ROOM(int, s->n + 1, &c->parent), KMP_ROOM(int, s->m, &c->home),
                        KMP_ROOM(uint64_t, (size_t)(s->n + 1) * words, &c->open),
                        KMP_ROOM(uint64_t, (size_t)s->m * words, &c->coupled)))
        return false;
    /* The link before each motion's: the depth of the motion before it on its body, or of the body that carries it; 0:
     * the ground. */
    const kempe_model *model = s->model;
    for (int b = 1; b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        int from = body->parent;
        while (from > 0 && model->bodies[from].motion_count == 0)
            from = model->bodies[from].parent;
        const kmp_body *carrier = &model->bodies[from];
        for (int k = 0; k < body->motion_count; k++)
            c->parent[body->first_motion + k + 1] = k > 0      ? body->first_motion + k
                                                    : from > 0 ? carrier->first_motion + carrier->motion_count
                                                               : 0;
    }
    for (int e = 0, end; e < j->count; e = end) { /* row by row */
        const int row = j->row[e], word = row / 64;
        const uint64_t bit = (uint64_t)1 << (row % 64);
        int *home = &c->home[row];
        *home = c->parent[j->col[e] + 1];
        for (end = e; end < j->count && j->row[end] == row; end++)
            *home = common(c->parent, *home, c->parent[j->col[end] + 1]);
        for (int k = e; k < end; k++)
            for (int i = j->col[k] + 1; i != *home && !(set_of(c, c->open, i)[word] & bit); i = c->parent[i])
                set_of(c, c->open, i)[word] |= bit;
    }
    for (int i = 1; i <= s->n; i++)
        for (int r = 0; r < s->m; r++)
            if (set_of(c, c->open, i)[r / 64] >> (r % 64) & 1)
                join(c, set_of(c, c->coupled, r), set_of(c, c->open, i));
    return true;
}

/* A lower bound of the operations by which rows are carried and eliminated: some for each row at each link on its way,
 * and for each pair there. -1: no memory. */
static double least_of_rows(const kempe_system *s)
{
    carried_sets c = {0};
    double sum = find_carried(&c, s) ? 0 : -1;
    for (int i = s->n; i >= 0 && sum >= 0; i--) {
        for (int r = 0; r < s->m; r++) { /* those eliminated here couple the later ones with each other */
            uint64_t *later = set_of(&c, c.coupled, r);
            if (c.home[r] != i)
                continue;
            for (int t = 0; t < s->m; t++)
                if (later[t / 64] >> (t % 64) & 1 && (t == r || c.home[t] > i || (c.home[t] == i && t < r)))
                    later[t / 64] &= ~((uint64_t)1 << (t % 64));
            const double size = size_of(&c, later);
            sum += LEAST_OF_ROW * size + LEAST_OF_PAIR * size * size;
            for (int t = 0; t < s->m; t++)
                if (later[t / 64] >> (t % 64) & 1)
                    join(&c, set_of(&c, c.coupled, t), later);
        }
        const double size = i > 0 ? size_of(&c, set_of(&c, c.open, i)) : 0;
        sum += LEAST_OF_ROW * size + LEAST_OF_PAIR * size * size;
    }
    kmp_arena_free(&c.arena);
    return sum;
}

kempe_status kmp_bodies_may_pay(const kempe_system *s, bool *may_pay)
{
    *may_pay = false;
    if (independent(s) < FEW || s->model->flexible_count > 0)
        return KEMPE_OK;
    const double rows = least_of_rows(s), least = LEAST_OF_COORDINATE * (double)s->n + rows;
    KMP_TRY(kmp_made(s->context, rows >= 0));
    if (s->late && least < cost_of_solves(s)) {
        *may_pay = true;
        return KEMPE_OK;
    }
    KMP_TRY(kmp_motion_need(s));
    *may_pay = independent(s) > WRITTEN_OUT
                   ? least < cost_by_mass(s)
                   : s->m == 0 && pays_written_out(s, fmax(least, LEAST_OF_TREE * operations_of(s->motion)));
    return KEMPE_OK;
}

kempe_status kmp_bodies_pay(const kempe_system *s, const kmp_program *bodies, bool *pay)
{
    double cost = operations_of(bodies);
    if (independent(s) <= WRITTEN_OUT && !s->late) {
        *pay = pays_written_out(s, cost);
        return KEMPE_OK;
    }
    *pay = s->late && cost < cost_of_solves(s);
    if (*pay)
        return KEMPE_OK;
    KMP_TRY(kmp_motion_need(s));
    *pay = cost < cost_by_mass(s);
    return KEMPE_OK;
}

/* Without iteration runs may write out the solution by M and C, which they would need soon. */
bool kmp_motion_may_wait(const kempe_system *s)
{
    const kempe_model *model = s->model;
    int rows = kmp_closure_all_rows(model), n = model->motion_count;
    bool bodies = s->dynamics == KMP_DYNAMICS_AUTO || s->dynamics == KMP_DYNAMICS_ARTICULATED;
    bool pressed = kmp_model_has_loads(model), iterates = model->wheel_count > 0; /* wheels, and points on curves */
    for (int c = 0; c < model->closure_count; c++)
        iterates = iterates || model->closures[c].curve_count > 0;
    for (int k = 0; k < model->force_count; k++)
        pressed = pressed || kmp_force_has_load(&model->forces[k]);
    return bodies && !pressed && model->flexible_count == 0 && (iterates || kmp_motion_goes_by_links(model)) &&
           kmp_equations_are_large(model) && n - rows >= FEW;
}

/* Large trees: nothing is closed, and nothing strikes or sticks. */
bool kmp_motion_goes_by_links(const kempe_model *model)
{
    return model->motion_count == kmp_model_coordinates(model) && model->flexible_count == 0 &&
           kmp_closure_all_rows(model) == 0 && kmp_equations_are_large(model);
}
