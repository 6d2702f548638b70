/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs of accelerations, in groups of outputs that become stages: h, J and h_t; M; C and jdqd; power. With forces
 * that depend on multipliers jdqd comes before C, and dC/dlambda after it. M and C can wait until their first use
 * (late): patterns and variants are known before, the program is made under a lock. */
#include "dynamics/motion.h"
#include "base/memory.h"
#include "dynamics/choose_algorithm.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/load_dependent.h"
#include "dynamics/system_record.h"
#include "model/data/body.h"
#include "model/data/flexible.h"
#include "symbolic/derivative.h"
#include "symbolic/live.h"
#include <math.h>
#include <string.h>

/* -- outputs ----------------------------------------------------------------------------------------- */

/* Groups of a motion program: the outputs of its stages one after the other. */
typedef struct groups {
    kmp_ref *out;
    int total, last; /* outputs, and the group that grows */
    int count[6];
} groups;

static void put_outputs(groups *g, int count, const kmp_ref *of)
{
    memcpy(g->out + g->total, of, (size_t)count * sizeof *of);
    g->total += count;
    g->count[g->last] += count;
}

/* The nonzero entries of a matrix. */
static void put_pattern(groups *g, kmp_arena *arena, kmp_pattern *pattern, int rows, int cols, const kmp_ref *matrix)
{
    kmp_pattern_init(pattern, arena, rows, cols, matrix, g->out + g->total);
    g->total += pattern->count;
    g->count[g->last] += pattern->count;
}

/* The rows, in room for all groups. False: no memory. */
static bool begin_groups(groups *g, const kempe_system *s, const kmp_equations *eq)
{
    int n = s->n, m = s->m, most = m * (2 * n + m + 8) + n * (n + 4) + 1;
    *g = (groups){.out = KMP_GRAPH_NEW(eq->graph, kmp_ref, (uint32_t)(most + n * m) + kmp_graph_count(eq->graph))};
    if (!g->out)
        return false;
    put_outputs(g, m, eq->closures.h);
    for (int k = 0; k < s->jacobian.count; k++)
        put_outputs(g, 1, &eq->closures.jacobian[s->jacobian.row[k] * n + s->jacobian.col[k]]);
    if (s->rheonomic)
        put_outputs(g, m, eq->closures.h_t);
    return true;
}

/* With the power of forces after the last stage, and `shorter` by the passes. */
static kmp_program *program_of(groups *g, const kempe_system *s, const kmp_equations *eq, bool shorter)
{
    const int *count = g->count;
    const kmp_ref *group[6] = {g->out};
    int stages = 3;
    if (g->last < 4 && eq->energy.power != KMP_ZERO) {
        g->last = 4;
        put_outputs(g, 1, &eq->energy.power);
    }
    for (int k = 1; k < 6; k++) {
        group[k] = group[k - 1] + count[k - 1];
        stages = count[k] > 0 && k >= stages ? k + 1 : stages;
    }
    if (s->arena.failed || (shorter && !s->brief && !kmp_equations_shorten(eq, g->total, g->out)))
        return NULL;
    return kmp_program_new(eq->graph, stages, count, group);
}

/* Finds the pattern of J, for both programs. */
static bool find_jacobian(kempe_system *s, const kmp_equations *eq)
{
    kmp_ref *entry = KMP_GRAPH_NEW(eq->graph, kmp_ref, s->m * s->n);
    if (entry)
        kmp_pattern_init(&s->jacobian, &s->arena, s->m, s->n, eq->closures.jacobian, entry);
    for (int r = 0; r < s->m; r++) {
        s->rheonomic = s->rheonomic || eq->closures.h_t[r] != KMP_ZERO;
        s->switches = s->switches || eq->closures.rows[r].of_rates;
    }
    if (!entry)
        return false;
    /* Finds whether rows depend on conditions that switch; kinks do not. */
    uint32_t nodes = kmp_graph_count(eq->graph);
    uint8_t *needed = KMP_NEW(uint8_t, nodes);
    if (needed)
        kmp_live_mark(eq->graph, s->m, eq->closures.h, needed);
    for (uint32_t id = 0; needed && id < nodes; id++) {
        const kmp_node *node = kmp_graph_node(eq->graph, id);
        if (needed[id] && node->op == KMP_OP_INPUT && node->depends & 1u << KMP_IN_MODE)
            s->switches = s->switches || !s->events.condition[node->b].kink;
    }
    kmp_free(needed);
    return needed && !s->arena.failed;
}

/* -- forces that depend on multipliers --------------------------------------------------------------- */

/* dC/dlambda row by row (n x m), and which rows C depends on. NULL: no memory. */
static kmp_ref *find_load_jacobian(kempe_system *s, const kmp_equations *eq)
{
    kmp_ref *entry = KMP_GRAPH_NEW(eq->graph, kmp_ref, s->n * s->m);
    s->load_rows = KMP_ARENA_NEW(&s->arena, int, s->m);
    if (!entry || !s->load_rows)
        return NULL;
    kmp_partials *partials = kmp_partials_new(eq->graph, s->n, eq->dynamics.bias);
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

bool kmp_list_independent(const kmp_graph *g, kmp_input_kind kind, int count, const kmp_ref *of, kmp_ref *to,
                          int *found)
{
    enum { NEEDED = 1, LISTED = 2 };
    uint32_t nodes = kmp_graph_count(g);
    uint8_t *mark = KMP_NEW(uint8_t, nodes);
    *found = 0;
    if (!mark)
        return false;
    for (int k = 0; k < count; k++)
        mark[kmp_id(of[k])] |= kmp_depends_on(g, of[k], kind) ? NEEDED : LISTED;
    for (uint32_t id = nodes; id-- > 0;) {
        const kmp_node *node = kmp_graph_node(g, id);
        for (int k = 0; mark[id] & NEEDED && k < kmp_op_arity((kmp_op)node->op); k++)
            mark[kmp_id(kmp_operand(node, k))] |= kmp_depends_on(g, kmp_operand(node, k), kind) ? NEEDED : LISTED;
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
    memcpy(last, eq->dynamics.bias, (size_t)n * sizeof *last);
    kmp_pattern_init(&s->load_jacobian, &s->arena, n, m, entry, last + n);
    put_outputs(g, m, eq->closures.jdqd);
    if (!kmp_list_independent(eq->graph, KMP_IN_LAMBDA, n + s->load_jacobian.count, last, g->out + g->total, &found))
        return false;
    g->total += found;
    g->count[g->last++] += found;
    put_outputs(g, n + s->load_jacobian.count, last);
    return true;
}

/* -- programs ---------------------------------------------------------------------------------------- */

bool kmp_motion_make(kempe_system *s, kmp_equations *eq)
{
    groups g;
    if (!find_jacobian(s, eq) || !begin_groups(&g, s, eq))
        return false;
    g.last = 1;
    put_pattern(&g, &s->arena, &s->mass, s->n, s->n, eq->dynamics.mass);
    g.last = 2;
    bool load_dependent = false;
    for (int k = 0; k < eq->n; k++)
        load_dependent = load_dependent || kmp_depends_on(eq->graph, eq->dynamics.bias[k], KMP_IN_LAMBDA);
    if (!load_dependent) {
        put_outputs(&g, s->n, eq->dynamics.bias);
        put_outputs(&g, s->m, eq->closures.jdqd);
    } else if (!put_load_dependent(&g, s, eq)) {
        return false;
    }
    s->motion = program_of(&g, s, eq, s->dynamics != KMP_DYNAMICS_PLAIN);
    return s->motion;
}

/* In place of M: what all products M x share, then C and jdqd, then a product. */
static kmp_program *program_by_products(groups *g, const kempe_system *s, const kmp_equations *eq)
{
    int found;
    if (!kmp_list_independent(eq->graph, KMP_IN_QDD, s->n, eq->dynamics.product, g->out + g->total, &found))
        return NULL;
    g->total += found;
    g->count[1] += found;
    g->last = 2;
    put_outputs(g, s->n, eq->dynamics.bias);
    put_outputs(g, s->m, eq->closures.jdqd);
    g->last = 3;
    put_outputs(g, s->n, eq->dynamics.product);
    return program_of(g, s, eq, true);
}

bool kmp_motion_make_weighing(kempe_system *s, kmp_equations *eq)
{
    groups g;
    if (!find_jacobian(s, eq) || !begin_groups(&g, s, eq))
        return false;
    g.last = 1;
    if (s->late->by_products) {
        s->late->weighing = program_by_products(&g, s, eq);
        return s->late->weighing;
    }
    if (!s->late->by_links)
        put_pattern(&g, &s->arena, &s->mass, s->n, s->n, eq->dynamics.mass);
    const kmp_ref *group[2] = {g.out, g.out + g.count[0]};
    if (!s->arena.failed) /* the passes would cost more than they save: it runs seldom */
        s->late->weighing = kmp_program_new(eq->graph, 2, g.count, group);
    return s->late->weighing;
}

kmp_program *kmp_motion_make_again(const kempe_system *s, kmp_equations *eq)
{
    groups g;
    if (!begin_groups(&g, s, eq))
        return NULL;
    g.last = 1;
    for (int k = 0; k < s->mass.count; k++)
        put_outputs(&g, 1, &eq->dynamics.mass[s->mass.row[k] * s->n + s->mass.col[k]]);
    g.last = 2;
    put_outputs(&g, s->n, eq->dynamics.bias);
    put_outputs(&g, s->m, eq->closures.jdqd);
    return program_of(&g, s, eq, true);
}

/* Makes the program of articulated bodies. False: no memory. */
static bool motion_make_bodies(const kempe_system *s, kmp_bodies *bodies, kmp_equations *eq)
{
    groups g;
    if (!begin_groups(&g, s, eq))
        return false;
    g.last = 1;
    put_outputs(&g, s->m, eq->articulated.pivots);
    put_outputs(&g, s->m, eq->articulated.diagonals);
    g.last = 2;
    put_outputs(&g, s->n, eq->articulated.accelerations);
    put_outputs(&g, s->m, eq->articulated.multipliers);
    g.last = 3;
    put_outputs(&g, s->n, eq->articulated.open);
    put_outputs(&g, s->m, eq->closures.jdqd);
    g.last = 4;
    put_outputs(&g, 1, &eq->energy.power);
    g.last = 5;
    put_outputs(&g, s->n, eq->articulated.correction);
    bool shorter =
        !s->late ||
        s->late->by_links; /* else their contacts take most of a right-hand side, which the passes do not shorten */
    bodies->program = program_of(&g, s, eq, shorter);
    return bodies->program;
}

/* -- M and C that wait ------------------------------------------------------------------------------- */

/* A system whose M and C wait knows the variants and patterns of both: they follow from the search and from M. The
 * program that is made later keeps all entries of these patterns, also entries that its variants make zero. */

kmp_lazy_equations *kmp_lazy_equations_new(kempe_system *s)
{
    kmp_lazy_equations *late = KMP_NEW(kmp_lazy_equations, 1);
    if (late && pthread_mutex_init(&late->lock, NULL) != 0) {
        kmp_free(late);
        return NULL;
    }
    if (late) {
        late->system = s;
        late->by_links = kmp_motion_goes_by_links(s->model);
    }
    return late;
}

void kmp_lazy_equations_free(kmp_lazy_equations *late)
{
    if (!late)
        return;
    kmp_program_free(late->weighing);
    kmp_savings_free(&late->chosen);
    pthread_mutex_destroy(&late->lock);
    kmp_free(late);
}

static bool has_pattern(const kmp_lazy_equations *late)
{
    return !late->by_links && !late->by_products;
}

static kempe_status make_late(kmp_lazy_equations *late)
{
    kempe_system *s = late->system;
    s->motion = has_pattern(late) ? kmp_motion_recall(s) : NULL; /* whose record of the system has it */
    if (s->motion)
        return KEMPE_OK;
    /* M and C by the variants that the search has chosen; without a search, by the links of the model as it is. */
    kmp_events events = s->events; /* the system has recorded all conditions: none is added */
    const kmp_derivation_request request = {.sets = KMP_MOTION_SETS,
                                            .savings = s->late->chosen.stay ? &s->late->chosen : NULL,
                                            .plain = s->brief,
                                            .quick = true,
                                            .events = &events,
                                            .charted = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive(&eq, s->model, &request));
    kmp_ref *entries = has_pattern(late) ? NULL : KMP_GRAPH_NEW(eq.graph, kmp_ref, s->n * s->n);
    if (entries)
        kmp_pattern_init(&s->mass, &s->arena, s->n, s->n, eq.dynamics.mass, entries);
    s->motion = s->arena.failed ? NULL : kmp_motion_make_again(s, &eq);
    kmp_equations_free(&eq);
    KMP_TRY(kmp_made(s->context, s->motion));
    if (has_pattern(late))
        kmp_motion_keep(s);
    return KEMPE_OK;
}

kempe_status kmp_motion_need(const kempe_system *s)
{
    kmp_lazy_equations *late = s->late;
    kempe_status status = KEMPE_OK;
    if (!late || atomic_load(&late->made))
        return KEMPE_OK;
    pthread_mutex_lock(&late->lock);
    if (!atomic_load(&late->made)) {
        status = make_late(late);
        atomic_store(&late->made, status == KEMPE_OK);
    }
    pthread_mutex_unlock(&late->lock);
    return status;
}

bool kmp_motion_is_made(const kempe_system *s)
{
    return !s->late || atomic_load(&s->late->made);
}

const kmp_program *kmp_motion_known(const kempe_system *s)
{
    if (!kmp_motion_is_made(s) && s->late->by_products)
        return s->late->weighing;
    if (!kmp_motion_is_made(s) && s->late->by_links && !(kmp_motion_need_bodies(s) == KEMPE_OK && s->bodies->program) &&
        kmp_motion_need(s) != KEMPE_OK)
        return NULL;
    return kmp_motion_is_made(s) ? s->motion : s->bodies->program;
}

/* -- articulated bodies ------------------------------------------------------------------------------ */

/* Nodes of their graph, as a multiple of the operations by M and C, about. The graph of a large mechanism, which is
 * searched little, has room for the nodes of the passes too, if these run. */
#define NODES       3
#define NODES_LARGE 6

static kempe_status derive_bodies(const kempe_system *s, kmp_bodies *bodies)
{
    /* Operations of closures and M are about a quarter of the operations by M and C. */
    enum { QUARTERS = 4, NODES_OF_LINK = 60 };
    bool passes = kmp_equations_are_large(s->model) && (!s->late || s->late->by_links);
    const kmp_program *p = s->late ? s->late->weighing : s->motion;
    const uint32_t nodes = s->late && s->late->by_links ? NODES_OF_LINK * (uint32_t)s->n
                                                        : (uint32_t)((s->late ? QUARTERS : 1) * p->code[p->stages]);
    kmp_events events = s->events; /* the system has recorded all conditions: none is added */
    const kmp_derivation_request request = {.sets =
                                                KMP_SET_ACCELERATION | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER,
                                            .efforts = true,
                                            .closed = true,
                                            .nodes = (passes ? NODES_LARGE : NODES) * nodes,
                                            .first = &bodies->first,
                                            .plain = s->brief,
                                            .quick = true,
                                            .events = &events,
                                            .frictionless = s->frictionless,
                                            .charted = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive(&eq, s->model, &request));
    bool made = motion_make_bodies(s, bodies, &eq);
    kmp_equations_free(&eq);
    return made ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* Derives articulated bodies. A coordinate that moves no mass is not an error unless they were requested. */
static kempe_status try_them(const kempe_system *s, kmp_bodies *bodies)
{
    bool may_pay;
    kempe_status status = kmp_bodies_may_pay(s, &may_pay);
    if (status != KEMPE_OK || !may_pay)
        return status;
    bool pay = true;
    status = derive_bodies(s, bodies);
    if (status == KEMPE_OK)
        status = kmp_bodies_pay(s, bodies->program, &pay);
    if (status == KEMPE_OK && !pay)
        kmp_bodies_forget(bodies);
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(s->context);
    return KEMPE_OK;
}

/* A flexible body whose mass matrix is not positive at all deflections; NULL: there is none. */
static const char *may_lose_its_sign(const kempe_model *model)
{
    for (int f = 0; f < kmp_model_flexible_count(model); f++) {
        const kmp_flexible *flexible = kmp_model_flexible(model, f);
        for (int k = flexible->first; k < flexible->first + flexible->count; k++)
            if (flexible->stiffening == KMP_STIFFENING_FIRST && kmp_model_motion(model, k)->rotation)
                return kmp_model_body(model, flexible->body)->name;
    }
    return NULL;
}

static kempe_status make_bodies(const kempe_system *s, kmp_bodies *bodies)
{
    bool pressed = s->load_row_count > 0;
    if (s->dynamics == KMP_DYNAMICS_AUTO)
        return pressed ? KEMPE_OK : try_them(s, bodies);
    if (s->dynamics != KMP_DYNAMICS_ARTICULATED)
        return KEMPE_OK;
    if (pressed) {
        /* Their recursion has the forces in it. */
        int row = s->load_rows[0];
        return kmp_fail(
            s->context, KEMPE_E_FAILED,
            "algorithm articulated: force '%s' depends on the multiplier of constraint equation '%s', which this "
            "algorithm does not support; use the algorithm composite",
            kmp_load_dependent_force(s, row), s->row_names[row]);
    }
    const char *uncertain = may_lose_its_sign(s->model);
    if (uncertain)
        return kmp_fail(
            s->context, KEMPE_E_FAILED,
            "algorithm articulated: body '%s' has 'stiffening: first' with torsion, whose inertia may lose its "
            "sign, which this algorithm does not see; use the algorithm composite, or 'full'",
            uncertain);
    return derive_bodies(s, bodies);
}

/* -- the store --------------------------------------------------------------------------------------- */

kmp_bodies *kmp_bodies_new(void)
{
    kmp_bodies *bodies = KMP_NEW(kmp_bodies, 1);
    if (bodies && pthread_mutex_init(&bodies->lock, NULL) != 0) {
        kmp_free(bodies);
        return NULL;
    }
    return bodies;
}

void kmp_bodies_forget(kmp_bodies *bodies)
{
    kmp_program_free(bodies->program);
    bodies->program = NULL;
}

void kmp_bodies_free(kmp_bodies *bodies)
{
    if (!bodies)
        return;
    kmp_bodies_forget(bodies);
    kmp_savings_free(&bodies->first);
    pthread_mutex_destroy(&bodies->lock);
    kmp_free(bodies);
}

kempe_status kmp_motion_need_bodies(const kempe_system *s)
{
    kmp_bodies *bodies = s->bodies;
    kempe_status status = KEMPE_OK;
    if (atomic_load(&bodies->made))
        return KEMPE_OK;
    pthread_mutex_lock(&bodies->lock);
    if (!atomic_load(&bodies->made)) {
        bool recalled = kmp_bodies_recall(s);
        status = recalled ? KEMPE_OK : make_bodies(s, bodies);
        if (status == KEMPE_OK && !recalled)
            kmp_bodies_keep(s);
        if (status != KEMPE_OK)
            kmp_bodies_forget(bodies);
        atomic_store(&bodies->made, status == KEMPE_OK);
    }
    pthread_mutex_unlock(&bodies->lock);
    return status;
}
