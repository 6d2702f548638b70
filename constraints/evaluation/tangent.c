/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact tangents of the residual: forward differentiation column by column, or composite bodies where these take fewer
 * operations. Entries that are zero for every state are left out, and the others listed by column, as sparse matrices
 * have them. */
#include "constraints/evaluation/tangent.h"
#include "backend/native.h"
#include "base/memory.h"
#include "constraints/evaluation/tangent_record.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/motion.h"
#include "dynamics/tangents.h"
#include "symbolic/derivative.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Larger mechanisms are only differentiated: the other methods need room for whole matrices. */
enum { MOST_MOTIONS = 512 };

/* Bounds on operations, in total and per coordinate, for a second derivation of R. It takes as long as the gain of some
 * thousand evaluations for bodies that turn in space, and longer in the plane, or where M and C take few operations. */
enum { LEAST_OPERATIONS = 350, LEAST_A_MOTION = 32 };
/* Above LARGE coordinates composite bodies are taken without differentiation of R. They took 0.6 to 0.95 of its
 * operations in all spatial models of more than 18. */
enum { LARGE = 40 };
/* Nodes of the graph, as a multiple of the operations of motion, about. */
enum { NODES = 6 };

/* Blocks of each value by q and by qd; -1: zero, or not needed. */
static const int by_q[KMP_VALUES] = {KMP_R_Q, KMP_JTMU_Q, -1, KMP_RATE_Q, KMP_CURVE_Q, KMP_POWER_Q};
static const int by_qd[KMP_VALUES] = {KMP_R_QD, -1, -1, -1, KMP_CURVE_QD, KMP_POWER_QD};

/* Expressions of the requested values, and the tangent outputs found so far. */
typedef struct gather {
    kmp_tangents *t;
    kmp_equations eq;
    kmp_ref *value;
    int value_count, size[KMP_VALUES];
    int given; /* of the values, the first whose derivatives are known: R only by composite bodies */
    int last;  /* of the values, the last ones whose derivatives are known: the power, with them */
    kmp_ref *matrix[KMP_TANGENT_BLOCKS]; /* by differentiation, rows x n; NULL: its entries are outputs as they come */
    kmp_listing list;
    kmp_arena arena; /* of values and matrices */
} gather;

/* -- expressions ------------------------------------------------------------------------------------- */

static bool collect_values(gather *g, unsigned values)
{
    int n = g->eq.n, m = g->eq.m;
    const int size[KMP_VALUES] = {n, n, m, m, m, 1};
    const kmp_ref *value[KMP_VALUES] = {[KMP_VALUE_R] = g->eq.dynamics.residual,
                                        [KMP_VALUE_JTMU] = g->eq.dynamics.jt_mu,
                                        [KMP_VALUE_H] = g->eq.closures.h,
                                        [KMP_VALUE_RATE] = g->eq.closures.hdot,
                                        [KMP_VALUE_POWER] = &g->eq.energy.power};
    g->value = KMP_ARENA_NEW(&g->arena, kmp_ref, 2 * n + 3 * m + 1);
    for (int v = 0; g->value && v < KMP_VALUES; v++) {
        bool requested = (values >> v & 1u) != 0;
        g->t->at[v] = requested ? g->value_count : -1;
        g->size[v] = requested ? size[v] : 0;
        for (int i = 0; i < g->size[v]; i++)
            g->value[g->value_count++] = v == KMP_VALUE_CURVE ? kmp_equations_curve(&g->eq, i) : value[v][i];
    }
    return g->value;
}

/* -- tangents ---------------------------------------------------------------------------------------- */

/* Derivatives of all values along one coordinate or rate, in one pass. false: no memory. */
static bool add_column(gather *g, kmp_partials *partials, kmp_input_kind kind, int k)
{
    const int *block = kind == KMP_IN_Q ? by_q : by_qd, *which;
    const kmp_ref *column;
    int count = kmp_partials_along(partials, kmp_input(g->eq.graph, kind, (uint32_t)k), &which, &column), v = 0;
    for (int i = 0; i < count; i++) {
        int at = g->given + which[i];
        while (g->t->at[v] < 0 || at >= g->t->at[v] + g->size[v])
            v++;
        int row = at - g->t->at[v], b = block[v];
        if (b >= 0 && g->matrix[b])
            g->matrix[b][row * g->eq.n + k] = column[i];
        else if (b >= 0)
            kmp_listing_put(&g->list, b, row, k, column[i]);
    }
    return count >= 0;
}

/* Derivatives by multipliers of forces that depend on them. */
static bool add_loads(gather *g, const kempe_system *system)
{
    if (system->load_row_count == 0)
        return true;
    kmp_partials *partials = kmp_partials_new(g->eq.graph, g->eq.n, g->eq.dynamics.inverse);
    bool ok = partials;
    for (int k = 0; ok && k < system->load_row_count; k++) {
        const int *row;
        const kmp_ref *value;
        kmp_ref lambda = kmp_input(g->eq.graph, KMP_IN_LAMBDA, (uint32_t)system->load_rows[k]);
        int count = kmp_partials_along(partials, lambda, &row, &value);
        for (int i = 0; i < count; i++)
            kmp_listing_put(&g->list, KMP_C_LAMBDA, row[i], system->load_rows[k], value[i]);
        ok = count >= 0;
    }
    kmp_partials_free(partials);
    return ok;
}

/* -- other methods for derivatives --------------------------------------------------------------------- */

static int rows_of(const gather *g, int block)
{
    for (int v = 0; v < KMP_VALUES; v++)
        if (by_q[v] == block || by_qd[v] == block)
            return g->size[v];
    return 0;
}

static void add_matrix(gather *g, int block, const kmp_ref *matrix)
{
    int count = matrix ? rows_of(g, block) * g->eq.n : 0;
    for (int k = 0; k < count; k++)
        kmp_listing_put(&g->list, block, k / g->eq.n, k % g->eq.n, matrix[k]);
}

/* Chooses composite bodies, if R was derived by them too, or differentiation, unless composite bodies are given. */
static void add_residual(gather *g)
{
    kmp_ref *const of_q[2] = {g->eq.dynamics.closed_q, g->matrix[KMP_R_Q]};
    kmp_ref *const of_qd[2] = {g->eq.dynamics.inverse_qd, g->matrix[KMP_R_QD]};
    kmp_tangent_choice *choice = &g->t->choice;
    int n = g->eq.n;
    if (!g->matrix[KMP_R_Q] && !g->given)
        return;
    *choice = (kmp_tangent_choice){.by_q = !g->given, .by_qd = !g->given};
    if (g->eq.dynamics.closed_q && !g->given && !g->list.failed)
        g->list.failed =
            !kmp_tangents_choose(g->eq.graph, g->list.output_count, g->list.output, n * n, of_q, of_qd, choice);
    add_matrix(g, KMP_R_Q, of_q[choice->by_q]);
    add_matrix(g, KMP_R_QD, of_qd[choice->by_qd]);
}

/* Adds the matrices with a choice after the matrices without. */
static void add_matrices(gather *g)
{
    static const int plain[] = {KMP_RATE_Q, KMP_CURVE_Q, KMP_POWER_Q, KMP_POWER_QD};
    for (size_t k = 0; k < sizeof plain / sizeof *plain; k++)
        add_matrix(g, plain[k], g->matrix[plain[k]]);
    /* J' mu is the gradient of mu' h. */
    if (g->matrix[KMP_JTMU_Q])
        g->list.failed = g->list.failed || !kmp_tangents_mirror(g->eq.graph, g->eq.n, g->matrix[KMP_JTMU_Q]);
    add_matrix(g, KMP_JTMU_Q, g->matrix[KMP_JTMU_Q]);
    /* The derivative of the second time derivative of h(q, t) by qd is twice the derivative of the first one by q. */
    int count = rows_of(g, KMP_CURVE_QD) * g->eq.n;
    const kmp_ref *rate = g->matrix[KMP_RATE_Q];
    kmp_ref *curve = g->matrix[KMP_CURVE_QD], *twice = rate && curve ? KMP_ARENA_NEW(&g->arena, kmp_ref, count) : NULL;
    kmp_ref *const none[2] = {NULL, NULL}, *const methods[2] = {twice, curve};
    kmp_tangent_choice choice = {.by_qd = 1};
    g->list.failed = g->list.failed || (rate && curve && !twice);
    for (int k = 0; twice && k < count; k++)
        twice[k] = kmp_mul(g->eq.graph, kmp_const(g->eq.graph, 2), rate[k]);
    if (twice && !kmp_tangents_choose(g->eq.graph, g->list.output_count, g->list.output, count, none, methods, &choice))
        g->list.failed = true;
    add_matrix(g, KMP_CURVE_QD, methods[choice.by_qd]);
    add_residual(g);
}

/* Adds tangents of the user-defined force after the outputs of the program: of R by q and qd, then of the power. */
static void add_effort(gather *g)
{
    int n = g->eq.n, source = g->list.output_count;
    g->t->first_effort = source;
    if (!g->t->forced)
        return;
    for (int k = 0; k < 2 * n; k++)
        for (int i = 0; i < n; i++)
            kmp_listing_place(&g->list, k < n ? KMP_R_Q : KMP_R_QD, i, k % n, source++);
    for (int k = 0; k < 2 * n && g->t->at[KMP_VALUE_POWER] >= 0; k++)
        kmp_listing_place(&g->list, k < n ? KMP_POWER_Q : KMP_POWER_QD, 0, k % n, source++);
}

static kempe_status collect_tangents(gather *g, const kempe_system *system)
{
    g->given = g->eq.dynamics.closed_q && g->eq.n > LARGE ? g->eq.n : 0;
    g->last = g->eq.energy.power_q && g->size[KMP_VALUE_POWER] ? 1 : 0;
    /* Room for matrices of blocks that are not given. */
    for (int b = 0; b < KMP_TANGENT_BLOCKS && g->eq.n <= MOST_MOTIONS; b++) {
        bool given = (g->given > 0 && (b == KMP_R_Q || b == KMP_R_QD)) ||
                     (g->last > 0 && (b == KMP_POWER_Q || b == KMP_POWER_QD));
        g->matrix[b] = rows_of(g, b) && !given ? KMP_ARENA_NEW(&g->arena, kmp_ref, rows_of(g, b) * g->eq.n) : NULL;
    }
    KMP_TRY(kmp_made(g->eq.context, !g->arena.failed));
    if (g->last) {
        g->matrix[KMP_POWER_Q] = g->eq.energy.power_q;
        g->matrix[KMP_POWER_QD] = g->eq.energy.power_qd;
    }
    for (int k = 0; k < g->eq.n; k++) {
        (void)kmp_input(g->eq.graph, KMP_IN_Q, (uint32_t)k);
        (void)kmp_input(g->eq.graph, KMP_IN_QD, (uint32_t)k);
    }
    kmp_partials *partials = kmp_partials_new(g->eq.graph, g->value_count - g->given - g->last, g->value + g->given);
    bool ok = partials;
    for (int k = 0; k < g->eq.n && ok; k++)
        ok = add_column(g, partials, KMP_IN_Q, k) && add_column(g, partials, KMP_IN_QD, k);
    kmp_partials_free(partials);
    int n = g->eq.n;
    for (int i = 0; i < n; i++)
        for (int k = 0; k <= i; k++) {
            if (g->eq.dynamics.mass[i * n + k] == KMP_ZERO)
                continue;
            int source = kmp_listing_add(&g->list, g->eq.dynamics.mass[i * n + k]);
            kmp_listing_place(&g->list, KMP_M, i, k, source);
            if (i != k)
                kmp_listing_place(&g->list, KMP_M, k, i, source);
        }
    for (int r = 0; r < g->eq.m; r++)
        for (int k = 0; k < n; k++)
            kmp_listing_put(&g->list, KMP_J, r, k, g->eq.closures.jacobian[r * n + k]);
    ok = ok && add_loads(g, system);
    add_matrices(g);
    add_effort(g);
    return g->list.failed || !ok ? kmp_fail_memory(g->eq.context) : KEMPE_OK;
}

static int by_place(const void *a, const void *b)
{
    const kmp_tangent *x = a, *y = b;
    if (x->block != y->block)
        return x->block - y->block;
    return x->col != y->col ? x->col - y->col : x->row - y->row;
}

void kmp_tangents_sort(kmp_tangents *t, kmp_listing *list)
{
    t->entry = list->entry;
    list->entry = NULL;
    if (list->count)
        qsort(t->entry, (size_t)list->count, sizeof *t->entry, by_place);
    for (int e = 0; e < list->count; e++)
        t->start[t->entry[e].block + 1] = e + 1;
    for (int b = 0; b < KMP_TANGENT_BLOCKS; b++)
        if (t->start[b + 1] < t->start[b])
            t->start[b + 1] = t->start[b];
}

static int columns_of(const kmp_tangents *t, int block)
{
    return block == KMP_C_LAMBDA ? t->m : t->n;
}

bool kmp_tangents_list_columns(kmp_tangents *t)
{
    int count = 0;
    for (int b = 0; b < KMP_TANGENT_BLOCKS; b++)
        count += columns_of(t, b) + 1;
    int *column = t->column = KMP_ARENA_NEW(&t->arena, int, count);
    for (int b = 0; column && b < KMP_TANGENT_BLOCKS; b++) {
        t->first_column[b] = (int)(column - t->column);
        for (int c = 0, k = t->start[b]; c <= columns_of(t, b); c++) {
            while (k < t->start[b + 1] && t->entry[k].col < c)
                k++;
            *column++ = k;
        }
    }
    return t->column;
}

/* -- programs ---------------------------------------------------------------------------------------- */

static int outputs_of(const kmp_formulas *formulas)
{
    const kmp_program *p = formulas->program;
    return p ? p->outputs[p->stages] - p->outputs[1] : 0;
}

/* Derives the programs and lists their entries. */
static kempe_status derive_programs(kmp_tangents *tangents, const kempe_system *system, unsigned values)
{
    unsigned sets = KMP_SET_MASS | KMP_SET_CLOSURE | KMP_SET_RESIDUAL;
    KMP_TRY(kmp_motion_need(system));
    const long counted = kmp_program_count(system->motion, KMP_STAGE_MASS, KMP_STAGE_BIAS).paper;
    if (values & 1u << KMP_VALUE_R && system->n <= MOST_MOTIONS && counted >= LEAST_OPERATIONS &&
        counted >= (long)LEAST_A_MOTION * system->n)
        sets |= KMP_SET_CLOSED_Q | KMP_SET_INVERSE_QD;
    sets |= values & 1u << KMP_VALUE_CURVE ? KMP_SET_JDQD : 0;
    sets |= values & 1u << KMP_VALUE_POWER ? KMP_SET_ENERGY : 0;
    if (sets & KMP_SET_ENERGY && sets & KMP_SET_CLOSED_Q && system->n > LARGE)
        sets |= KMP_SET_POWER_SLOPES;
    sets |= system->load_row_count > 0 ? KMP_SET_INVERSE : 0;
    gather g = {.t = tangents};
    kmp_events events = system->events; /* the system has recorded all conditions: none is added */
    const uint32_t operations = (uint32_t)system->motion->code[system->motion->stages];
    const kmp_derivation_request scene = {.sets = sets,
                                          .nodes = NODES * operations,
                                          .scheme = KMP_SCHEME_COMPOSITE,
                                          .events = &events,
                                          .charted = true,
                                          .tangents = KMP_TANGENT_COMPOSITE};
    KMP_TRY(kmp_equations_derive(&g.eq, system->model, &scene));
    kempe_status status = kmp_made(system->context, collect_values(&g, values));
    if (status == KEMPE_OK)
        status = collect_tangents(&g, system);
    if (status == KEMPE_OK) {
        const kmp_ref *value = g.value, *tangent = g.list.output;
        bool with_values = values & KMP_TANGENTS_WITH_VALUES;
        kmp_tangents_sort(tangents, &g.list);
        if (with_values)
            tangents->value.program = kmp_program_new(g.eq.graph, 1, &g.value_count, &value);
        tangents->tangent.program = kmp_program_new(g.eq.graph, 1, &g.list.output_count, &tangent);
        status = kmp_made(system->context, (tangents->value.program || !with_values) && tangents->tangent.program);
    }
    kmp_free(g.list.output);
    kmp_free(g.list.entry);
    kmp_arena_free(&g.arena);
    kmp_equations_free(&g.eq);
    return status;
}

kempe_status kmp_tangents_add_values(kmp_tangents *t, const kempe_system *system, const kmp_backend *backend)
{
    return kmp_formulas_prepare(&t->value, backend, system->parameters) ? KEMPE_OK : kmp_fail_memory(system->context);
}

unsigned kmp_tangents_of_runs(const kempe_system *system)
{
    return KMP_TANGENTS_NEAR | (system->dissipative ? 1u << KMP_VALUE_POWER : 0);
}

kempe_status kmp_tangents_init(kmp_tangents *tangents, const kempe_system *system, const kmp_backend *backend,
                               unsigned values)
{
    kempe_status status = KEMPE_OK;
    *tangents = (kmp_tangents){.n = system->n, .m = system->m, .forced = system->force ? system : NULL};
    if (!kmp_tangents_recall(tangents, system, values)) {
        status = derive_programs(tangents, system, values);
        if (status == KEMPE_OK)
            kmp_tangents_keep(tangents, system, values);
    }
    const int n = tangents->n;
    bool made = status == KEMPE_OK && kmp_tangents_list_columns(tangents);
    if (made && system->force)
        made = KMP_ARENA_MAKE(
            &tangents->arena, KMP_ROOM(double, n, &tangents->effort, &tangents->moved),
            KMP_ROOM(double, 2 * n, &tangents->state),
            KMP_ROOM(double, outputs_of(&tangents->value), &tangents->with_effort),
            KMP_ROOM(double, outputs_of(&tangents->tangent) + 2 * n * n + 2 * n, &tangents->tangents_with_it));
    if (status == KEMPE_OK &&
        (!made || !kmp_formulas_prepare(&tangents->tangent, kmp_backend_waiting(backend), system->parameters)))
        status = kmp_fail_memory(system->context);
    if (status != KEMPE_OK)
        kmp_tangents_free(tangents);
    return status;
}

KMP_CLEARS(kmp_tangents, tangents, kmp_formulas_free(&tangents->value), kmp_formulas_free(&tangents->tangent),
           kmp_free(tangents->entry), kmp_arena_free(&tangents->arena))

/* -- numbers ----------------------------------------------------------------------------------------- */

static void copy_outputs(double *room, const double *outputs, const kmp_formulas *of)
{
    int count = outputs_of(of);
    if (count > 0)
        memcpy(room, outputs, (size_t)count * sizeof *room);
}

const double *kmp_tangents_values(kmp_tangents *tangents, const kmp_instant *at)
{
    const double *outputs = kmp_formulas_at(&tangents->value, at);
    if (!tangents->forced)
        return outputs;
    double *out = tangents->with_effort, *effort = tangents->effort;
    int r = tangents->at[KMP_VALUE_R], power = tangents->at[KMP_VALUE_POWER];
    copy_outputs(out, outputs, &tangents->value);
    kmp_system_effort(tangents->forced, at->t, at->q, at->qd, effort);
    for (int i = 0; i < tangents->n; i++) {
        if (r >= 0)
            out[r + i] -= effort[i];
        if (power >= 0)
            out[power] += effort[i] * at->qd[i];
    }
    return out;
}

/* The user-defined forces, and their negative derivatives by q and then qd, by forward differences. */
static void differentiate_effort(kmp_tangents *t, const kmp_instant *at, double *force)
{
    int n = t->n;
    kmp_system_effort(t->forced, at->t, at->q, at->qd, t->effort);
    memcpy(t->state, at->q, (size_t)n * sizeof *t->state);
    memcpy(t->state + n, at->qd, (size_t)n * sizeof *t->state);
    for (int k = 0; k < 2 * n; k++) {
        /* an increment that is exact in binary, of the root of the rounding of the coordinate or of its scale */
        double kept = t->state[k], size = fmax(fabs(kept), t->forced->scale[k % n]);
        volatile double moved = kept + 1.5e-8 * size;
        double by = moved - kept;
        t->state[k] += by;
        kmp_system_effort(t->forced, at->t, t->state, t->state + n, t->moved);
        for (int i = 0; i < n; i++)
            force[i + k * n] = -((t->moved[i] - t->effort[i]) / by);
        t->state[k] = kept;
    }
}

const double *kmp_tangents_derivatives(kmp_tangents *tangents, const kmp_instant *at)
{
    if (tangents->numbers)
        return tangents->by_numbers(tangents->numbers, at);
    const double *outputs = kmp_formulas_at(&tangents->tangent, at);
    int n = tangents->n;
    if (!tangents->forced)
        return outputs;
    copy_outputs(tangents->tangents_with_it, outputs, &tangents->tangent);
    double *force = tangents->tangents_with_it + tangents->first_effort, *power = force + 2 * n * n;
    differentiate_effort(tangents, at, force);
    for (int k = 0; k < 2 * n; k++) {
        power[k] = k < n ? 0 : tangents->effort[k - n];
        for (int i = 0; i < n; i++)
            power[k] -= force[i + k * n] * at->qd[i];
    }
    return tangents->tangents_with_it;
}

void kmp_tangents_add(const kmp_tangents *tangents, kmp_tangent_block block, const double *d, double factor,
                      const double *x, double *out)
{
    const int *column = tangents->column + tangents->first_column[block];
    for (int c = 0, count = columns_of(tangents, (int)block); c < count; c++) {
        if (x[c] == 0)
            continue;
        for (int k = column[c]; k < column[c + 1]; k++) {
            const kmp_tangent *e = &tangents->entry[k];
            out[e->row] += factor * d[e->source] * x[c];
        }
    }
}

void kmp_tangents_add_transposed(const kmp_tangents *tangents, kmp_tangent_block block, const double *d,
                                 const double *w, double *out)
{
    for (int k = tangents->start[block]; k < tangents->start[block + 1]; k++) {
        const kmp_tangent *e = &tangents->entry[k];
        out[e->col] += d[e->source] * w[e->row];
    }
}
