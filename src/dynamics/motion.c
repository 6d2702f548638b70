/* SPDX-License-Identifier: BSD-3-Clause */
/* The cost of a right-hand side is counted as in the reduced formulation: the program, and the solves with its values.
 * By M and C these are the mass of n - m independent coordinates and its Cholesky factors, or the sparse saddle system
 * where that costs less. By articulated bodies it is the m x m system of the multipliers, and none on a tree. The work
 * common to both, Jv and its tangent, is left out. bench/bench_articulated.c measures the size from which articulated
 * bodies are faster. */
#include "dynamics/motion.h"
#include "base/memory.h"
#include "dynamics/load_dependent.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include "symbolic/partials.h"
#include <math.h>
#include <string.h>

/* M and C cost fewer operations with fewer independent coordinates than this; nothing else is tried. */
#define FEW 12
/* A lower bound of the operations per coordinate by articulated bodies, in the plane, and per entry of M^-1 J'. If M
 * and C take fewer, articulated bodies are not tried. */
#define LEAST_OF_COORDINATE 15
#define LEAST_OF_ENTRY      8
/* Nodes of their graph, as a multiple of the operations by M and C, about. */
#define NODES 3
/* M^-1 J' has at most so many entries. */
#define MOST_ENTRIES 250000

/* -- outputs ----------------------------------------------------------------------------------------- */

/* Groups of a motion program: the outputs of its stages one after the other. */
typedef struct groups {
    kmp_ref *out;
    int total, last; /* outputs, and the group that grows */
    int count[5];
} groups;

static void put(groups *g, int count, const kmp_ref *of)
{
    memcpy(g->out + g->total, of, (size_t)count * sizeof *of);
    g->total += count;
    g->count[g->last] += count;
}

/* The nonzero entries of a matrix. */
static void put_pattern(groups *g, kempe_system *s, kmp_pattern *pattern, int rows, int cols, const kmp_ref *matrix)
{
    kmp_pattern_init(pattern, &s->arena, rows, cols, matrix, g->out + g->total);
    g->total += pattern->count;
    g->count[g->last] += pattern->count;
}

/* The rows, in room for all groups. False: no memory. */
static bool begin(groups *g, const kempe_system *s, const kmp_equations *eq)
{
    int n = s->n, m = s->m, most = m * (2 * n + m + 4) + n * (n + 1) + 1;
    *g = (groups){.out = KMP_GRAPH_NEW(eq->graph, kmp_ref, (uint32_t)(most + n * m) + kmp_graph_count(eq->graph))};
    if (!g->out)
        return false;
    put(g, m, eq->h);
    for (int k = 0; k < s->jacobian.count; k++)
        put(g, 1, &eq->jacobian[s->jacobian.row[k] * n + s->jacobian.col[k]]);
    if (s->rheonomic)
        put(g, m, eq->h_t);
    return true;
}

/* With the power of forces after the last stage. */
static kmp_program *program_of(groups *g, const kempe_system *s, const kmp_equations *eq)
{
    const int *count = g->count;
    const kmp_ref *group[5] = {g->out};
    g->last = 4;
    if (eq->power != KMP_ZERO)
        put(g, 1, &eq->power);
    for (int k = 1; k < 5; k++)
        group[k] = group[k - 1] + count[k - 1];
    if (s->arena.failed || (s->dynamics != KMP_DYNAMICS_PLAIN && !kmp_equations_shorten(eq, g->total, g->out)))
        return NULL;
    return kmp_program_new(eq->graph, count[4] > 0 ? 5 : count[3] > 0 ? 4 : 3, count, group);
}

/* Finds the pattern of J, for both programs. */
static bool find_jacobian(kempe_system *s, const kmp_equations *eq)
{
    kmp_ref *entry = KMP_GRAPH_NEW(eq->graph, kmp_ref, s->m * s->n);
    if (entry)
        kmp_pattern_init(&s->jacobian, &s->arena, s->m, s->n, eq->jacobian, entry);
    for (int r = 0; r < s->m; r++) {
        s->rheonomic = s->rheonomic || eq->h_t[r] != KMP_ZERO;
        s->switches = s->switches || kmp_graph_node(eq->graph, kmp_id(eq->h[r]))->depends & (1u << KMP_IN_MODE);
    }
    return entry && !s->arena.failed;
}

/* -- forces that depend on multipliers --------------------------------------------------------------- */

static bool depends_on_loads(const kmp_graph *g, kmp_ref x)
{
    return kmp_graph_node(g, kmp_id(x))->depends & 1u << KMP_IN_LAMBDA;
}

/* dC/dlambda row by row (n x m), and which rows C depends on. NULL: no memory. */
static kmp_ref *find_load_jacobian(kempe_system *s, const kmp_equations *eq)
{
    kmp_ref *entry = KMP_GRAPH_NEW(eq->graph, kmp_ref, s->n * s->m);
    s->load_rows = KMP_ARENA_NEW(&s->arena, int, s->m);
    if (!entry || !s->load_rows)
        return NULL;
    kmp_partials *partials = kmp_partials_new(eq->graph, s->n, eq->bias);
    for (int r = 0; r < s->m; r++) {
        const int *row;
        const kmp_ref *value;
        int count = kmp_partials_along(partials, kmp_input(eq->graph, KMP_IN_LAMBDA, (uint32_t)r), &row, &value);
        for (int i = 0; i < count; i++)
            entry[row[i] * s->m + r] = value[i];
        if (count > 0)
            s->load_rows[s->load_row_count++] = r;
    }
    kmp_partials_free(partials);
    return kmp_graph_failed(eq->graph) ? NULL : entry;
}

/* Operands of expressions of multipliers that do not depend on multipliers, in the order of the graph: they are
 * evaluated once, while the multipliers are solved for. `to` has room for one reference per node. False: no memory. */
static bool list_unloaded(const kmp_graph *g, int count, const kmp_ref *of, kmp_ref *to, int *found)
{
    enum { NEEDED = 1, LISTED = 2 };
    uint32_t nodes = kmp_graph_count(g);
    uint8_t *mark = KMP_NEW(uint8_t, nodes);
    *found = 0;
    if (!mark)
        return false;
    for (int k = 0; k < count; k++)
        mark[kmp_id(of[k])] |= depends_on_loads(g, of[k]) ? NEEDED : LISTED;
    for (uint32_t id = nodes; id-- > 0;) {
        const kmp_node *node = kmp_graph_node(g, id);
        for (int k = 0; mark[id] & NEEDED && k < kmp_op_arity((kmp_op)node->op); k++)
            mark[kmp_id(kmp_operand(node, k))] |= depends_on_loads(g, kmp_operand(node, k)) ? NEEDED : LISTED;
    }
    for (uint32_t id = 0; id < nodes; id++)
        if (mark[id] & LISTED && kmp_op_arity((kmp_op)kmp_graph_node(g, id)->op) > 0)
            to[(*found)++] = (kmp_ref)id << 1;
    kmp_free(mark);
    return true;
}

/* The last two stages: jdqd and all that multipliers do not change, then C and dC/dlambda. */
static bool put_load_dependent(groups *g, kempe_system *s, const kmp_equations *eq)
{
    int n = s->n, m = s->m, found;
    kmp_ref *last = KMP_GRAPH_NEW(eq->graph, kmp_ref, n + n * m), *entry = find_load_jacobian(s, eq);
    if (!last || !entry)
        return false;
    memcpy(last, eq->bias, (size_t)n * sizeof *last);
    kmp_pattern_init(&s->load_jacobian, &s->arena, n, m, entry, last + n);
    put(g, m, eq->jdqd);
    if (!list_unloaded(eq->graph, n + s->load_jacobian.count, last, g->out + g->total, &found))
        return false;
    g->total += found;
    g->count[g->last++] += found;
    put(g, n + s->load_jacobian.count, last);
    return true;
}

static bool is_load_dependent(const kmp_equations *eq)
{
    bool found = false;
    for (int k = 0; k < eq->n; k++)
        found = found || depends_on_loads(eq->graph, eq->bias[k]);
    return found;
}

/* -- programs ---------------------------------------------------------------------------------------- */

bool kmp_motion_make(kempe_system *s, kmp_equations *eq)
{
    groups g;
    if (!find_jacobian(s, eq) || !begin(&g, s, eq))
        return false;
    g.last = 1;
    put_pattern(&g, s, &s->mass, s->n, s->n, eq->mass);
    g.last = 2;
    if (!is_load_dependent(eq)) {
        put(&g, s->n, eq->bias);
        put(&g, s->m, eq->jdqd);
    } else if (!put_load_dependent(&g, s, eq)) {
        return false;
    }
    s->motion = program_of(&g, s, eq);
    return s->motion;
}

static bool make_articulated(kempe_system *s, kmp_equations *eq)
{
    groups g;
    if (!begin(&g, s, eq))
        return false;
    g.last = 1;
    put_pattern(&g, s, &s->compliance, s->m, s->n, eq->compliance);
    put_pattern(&g, s, &s->mobility, s->m, s->m, eq->mobility);
    g.last = 2;
    put(&g, s->n, eq->free_qdd);
    put(&g, s->m, eq->drift);
    s->articulated = program_of(&g, s, eq);
    return s->articulated;
}

/* -- the choice -------------------------------------------------------------------------------------- */

static double operations(kmp_flops f)
{
    return (double)f.add + (double)f.mul + (double)f.div;
}

static double operations_of(const kmp_program *program)
{
    return (double)kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
}

/* Factors of a symmetric k x k matrix, and one solution. */
static double cholesky(int k)
{
    return operations(kmp_cholesky_factor_flops(k)) + operations(kmp_cholesky_solve_flops(k));
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
static double cost_by_mass(const kempe_system *s)
{
    double n = s->n, p = independent(s), mass = 2.0 * s->mass.count;
    double products = s->m > 0 ? mass * (p + 1) + p * n + p * (p + 1) / 2 * n : 0;
    double dense = 2 * products + cholesky(independent(s));
    return operations_of(s->motion) + (s->m > 0 ? fmin(dense, cost_of_saddle(s)) : dense);
}

/* The multipliers, and M^-1 J' lambda. */
static double cost_of_multipliers(const kempe_system *s, double entries)
{
    return cholesky(s->m) + 2 * entries;
}

/* Entries of M^-1 J': all coordinates coupled by M to those of a row. Each part of the tree that is attached to the
 * ground separately is identified by the first coordinate that M couples. `of`, `size`: n. */
static double count_entries(const kempe_system *s, int *of, int *size)
{
    const kmp_pattern *mass = &s->mass, *jacobian = &s->jacobian;
    double entries = 0;
    for (int k = 0; k < mass->count; k++) /* row by row */
        if (k == 0 || mass->row[k] != mass->row[k - 1]) {
            of[mass->row[k]] = mass->col[k] < mass->row[k] ? of[mass->col[k]] : mass->row[k];
            size[of[mass->row[k]]]++;
        }
    for (int k = 0; k < jacobian->count; k++) {
        bool again = false;
        for (int j = k - 1; j >= 0 && jacobian->row[j] == jacobian->row[k] && !again; j--)
            again = of[jacobian->col[j]] == of[jacobian->col[k]];
        entries += again ? 0 : size[of[jacobian->col[k]]];
    }
    return entries;
}

/* Finds whether articulated bodies may cost less, as far as this is visible before they are derived. */
static kempe_status look_ahead(const kempe_system *s, bool *may_pay)
{
    *may_pay = false;
    if (independent(s) < FEW || (double)s->m * s->n > MOST_ENTRIES)
        return KEMPE_OK;
    int *room = KMP_NEW(int, 2 * s->n);
    KMP_TRY(kmp_made(s->context, room));
    double entries = count_entries(s, room, room + s->n);
    kmp_free(room);
    *may_pay = LEAST_OF_COORDINATE * (double)s->n + LEAST_OF_ENTRY * entries + cost_of_multipliers(s, entries) <
               cost_by_mass(s);
    return KEMPE_OK;
}

static bool pays(const kempe_system *s)
{
    return operations_of(s->articulated) + cost_of_multipliers(s, s->compliance.count) < cost_by_mass(s);
}

static void forget_articulated(kempe_system *s)
{
    kmp_program_free(s->articulated);
    s->articulated = NULL;
    s->compliance = s->mobility = (kmp_pattern){0};
}

static kempe_status derive_articulated(kempe_system *s, const kmp_savings *first)
{
    const kmp_scene scene = {.sets = KMP_SET_ACCELERATION | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER,
                             .efforts = true,
                             .nodes = NODES * (uint32_t)s->motion->code[s->motion->stages],
                             .first = first,
                             .events = &s->events,
                             .frictionless = s->frictionless,
                             .charted = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive(&eq, s->model, &scene));
    bool made = make_articulated(s, &eq);
    kmp_equations_free(&eq);
    return made ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* Derives articulated bodies. A coordinate that moves no mass is no error unless they were requested. */
static kempe_status try_articulated(kempe_system *s, const kmp_savings *first)
{
    bool may_pay;
    kempe_status status = look_ahead(s, &may_pay);
    if (status != KEMPE_OK || !may_pay)
        return status;
    status = derive_articulated(s, first);
    if (status == KEMPE_OK && !pays(s))
        forget_articulated(s);
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(s->context);
    return KEMPE_OK;
}

/* Their recursion has the forces in it. */
static kempe_status refuse_load_dependent(const kempe_system *s)
{
    int row = s->load_rows[0];
    return kmp_fail(s->context, KEMPE_E_FAILED,
                    "algorithm articulated: force '%s' depends on the multiplier of closure row '%s', which this "
                    "algorithm does not support; use the algorithm composite",
                    kmp_load_dependent_force(s, row), s->row_names[row]);
}

kempe_status kmp_motion_add_articulated(kempe_system *s, const kmp_savings *first)
{
    bool pressed = s->load_row_count > 0;
    if (s->dynamics == KMP_DYNAMICS_AUTO)
        return pressed ? KEMPE_OK : try_articulated(s, first);
    if (s->dynamics != KMP_DYNAMICS_ARTICULATED)
        return KEMPE_OK;
    if (pressed)
        return refuse_load_dependent(s);
    if ((double)s->m * s->n > MOST_ENTRIES)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "algorithm articulated: the forces of %d closure rows on %d coordinates exceed the limit of "
                        "%d; use the algorithm composite",
                        s->m, s->n, MOST_ENTRIES);
    return derive_articulated(s, first);
}
