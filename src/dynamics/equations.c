/* SPDX-License-Identifier: BSD-3-Clause */
/* Derives the equations of a model as expressions in one graph: the sets that a request names, and only these.
 *
 * One function, derive_dynamics, goes through the sets in the order in which they share nodes: closures, M, forces with
 * C and the residual, accelerations, then friction, contacts, conditions and derivatives. M comes from composite rigid
 * bodies, C and the residual from the recursion of Newton and Euler, accelerations from articulated bodies; tangents
 * from one of two methods, the shorter one if the request leaves it open (Fisette and Samin 1996; Featherstone 1983).
 * A derivation can be repeated with other variants: the graph then returns to its state after the closures. */
#include "dynamics/equations.h"
#include "base/clones.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/kinds/kind.h"
#include "dynamics/choose_variants.h"
#include "dynamics/closures.h"
#include "dynamics/forces/forces.h"
#include "dynamics/formalisms/articulated.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "dynamics/outputs.h"
#include "dynamics/tangents.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "symbolic/derivative.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/live.h"
#include "symbolic/shorten.h"
#include <float.h>
#include <string.h>

/* -- implicit variables ------------------------------------------------------------------------------ */

/* The model's algebraic variables as nodes: an implicit block for each group, made when its first variable is used. */

/* The equations of a group, with conditions for kinks or without. */
KMP_NOINLINE static void write_group(const kmp_tree *tree, int index, bool kinks, bool bends, kmp_ref *residual)
{
    const kmp_unknowns *u = &tree->model->unknowns[index];
    kmp_tree inner = *tree;
    inner.conditions.kinks = kinks;
    inner.conditions.bends = bends;
    inner.names.solving = index + 1;
    for (int k = 0; k < u->count; k++)
        residual[k] = kmp_tree_expression(&inner, u->zero[k]);
}

/* The value of a name, or all variables of a group, in which kinks stay kinks. */
KMP_NOINLINE static void solve(const kmp_tree *tree, int index, const kmp_unknowns *u, kmp_ref *value)
{
    if (u->count == 0) {
        kmp_tree inner = *tree;
        inner.conditions.kinks = false;
        value[0] = kmp_tree_expression(&inner, u->zero[0]);
        return;
    }
    kmp_ref residual[KMP_UNKNOWNS_MOST], guess[KMP_UNKNOWNS_MOST];
    write_group(tree, index, false, tree->conditions.bends, residual);
    for (int k = 0; k < u->count; k++)
        guess[k] = kmp_tree_number(tree, &u->guess[k]);
    kmp_enclose(tree->graph, u->count, residual, guess, value);
}

/* A named expression, whose kinks are conditions: once for all laws of forces. */
KMP_NOINLINE static kmp_ref with_kinks(const kmp_tree *tree, int index, const kmp_unknowns *u)
{
    bool kept = tree->names.value && !tree->conditions.bends && (tree->reactions.row || !u->late);
    kmp_ref own = KMP_ZERO, *value = kept ? tree->names.branch + KMP_UNKNOWNS_MOST * index : &own;
    if (*value == KMP_ZERO)
        *value = kmp_tree_expression(tree, u->zero[0]);
    return *value;
}

/* The variables of a group, in which kinks stay kinks. */
static const kmp_ref *whole_group(const kmp_tree *tree, int index, const kmp_unknowns *u, kmp_ref *own)
{
    /* Multipliers are not final before the closures' rows are. */
    if (!tree->names.value || (!tree->reactions.row && u->late)) {
        solve(tree, index, u, own);
        return own;
    }
    kmp_ref *kept = tree->names.value + KMP_UNKNOWNS_MOST * index;
    if (tree->names.solved[index] == KMP_NAME_UNKNOWN) {
        solve(tree, index, u, kept);
        tree->names.solved[index] = tree->conditions.bends ? KMP_NAME_BENT : KMP_NAME_SOLVED;
    }
    return kept;
}

/* The variables of a group whose kinks are conditions. Newton's method begins at the solution with all kinks, and finds
 * the nearest one of several on a branch. If the branch has no solution beyond its kink, as c*abs(c) = q has none of
 * c^2 = q, the solution with all kinks counts, and the step passes the kink. */
KMP_NOINLINE static void solve_with_kinks(const kmp_tree *tree, int index, const kmp_unknowns *u, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    kmp_tree plain = *tree; /* where kinks are conditions, the knots of tables are not watched as well */
    kmp_ref own[KMP_UNKNOWNS_MOST], residual[2][KMP_UNKNOWNS_MOST];
    write_group(tree, index, true, false, residual[0]);
    plain.conditions.kinks = plain.conditions.watches = false;
    const kmp_ref *whole = whole_group(&plain, index, u, own);
    write_group(&plain, index, false, false, residual[1]);
    if (memcmp(residual[0], residual[1], (size_t)u->count * sizeof(kmp_ref)) == 0) {
        memcpy(value, whole, (size_t)u->count * sizeof *value);
        return;
    }
    kmp_enclose(g, u->count, residual[0], whole, value);
    kmp_ref found = kmp_less(g, value[0], kmp_const(g, DBL_MAX)); /* not of NaN */
    for (int k = 0; k < u->count; k++)
        value[k] = kmp_select(g, found, value[k], whole[k]);
}

kmp_ref kmp_tree_unknown(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_ref own[KMP_UNKNOWNS_MOST] = {KMP_ZERO};
    const kmp_unknowns *u = &tree->model->unknowns[e->index];
    const kmp_tree_conditions *conditions = &tree->conditions;
    if (tree->names.solving == e->index + 1)
        return kmp_unknown(tree->graph, e->number);
    if (u->count == 0 && (conditions->kinks || conditions->bends))
        return with_kinks(tree, e->index, u);
    const bool kept = tree->names.value, bent = kept && tree->names.solved[e->index] == KMP_NAME_BENT;
    if (!conditions->kinks || conditions->bends || bent)
        return whole_group(tree, e->index, u, own)[e->number];
    kmp_ref *branch = kept ? tree->names.branch + KMP_UNKNOWNS_MOST * e->index : own;
    if (branch[0] == KMP_ZERO)
        solve_with_kinks(tree, e->index, u, branch);
    return branch[e->number];
}

/* -- dynamics ---------------------------------------------------------------------------------------- */

/* The links of the dynamics: the links with variants, if there are any. */
static const kmp_tree *dynamic_links(const kmp_equations *eq)
{
    return eq->links.count ? &eq->links : &eq->tree;
}

/* Newton/Euler less the efforts, with the accelerations as inputs or zero. */
static void derive_efforts(kmp_equations *eq, const kmp_forces *forces, bool accelerated, kmp_ref *out)
{
    kmp_ref *qdd = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
    for (int k = 0; qdd && accelerated && k < eq->n; k++)
        qdd[k] = kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k);
    if (qdd)
        kmp_newton_euler(dynamic_links(eq), qdd, forces->applied, out);
    for (int k = 0; k < eq->n; k++)
        out[k] = kmp_sub(eq->graph, out[k], forces->effort[k]);
}

/* -- tangents ---------------------------------------------------------------------------------------- */

enum { TANGENT_SETS = KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD | KMP_SET_CLOSED_Q };

/* Both derivations of both matrices: by composite bodies, by differentiation. */
typedef struct both_methods {
    kmp_ref *by_q[2], *by_qd[2];
} both_methods;

/* Chooses the requested variant, or the one in which all requested sets have the fewest operations. */
static bool choose_methods(kmp_equations *eq, unsigned sets, const both_methods *b)
{
    kmp_ref *other = KMP_GRAPH_NEW(eq->graph, kmp_ref, kmp_equations_most_outputs(eq));
    const bool q = sets & (KMP_SET_INVERSE_Q | KMP_SET_CLOSED_Q), qd = sets & KMP_SET_INVERSE_QD;
    kmp_ref *const by_q[2] = {q ? b->by_q[0] : NULL, q ? b->by_q[1] : NULL};
    kmp_ref *const by_qd[2] = {qd ? b->by_qd[0] : NULL, qd ? b->by_qd[1] : NULL};
    kmp_tangent_choice choice = {0};
    int others = 0;
    if (other)
        others = kmp_equations_outputs(eq, sets & ~(unsigned)(TANGENT_SETS | KMP_SET_CLOSED), other);
    bool ok = other && kmp_tangents_choose(eq->graph, others, other, eq->n * eq->n, by_q, by_qd, &choice);
    eq->savings.by_q = choice.by_q ? KMP_TANGENT_FORWARD : KMP_TANGENT_COMPOSITE;
    eq->savings.by_qd = choice.by_qd ? KMP_TANGENT_FORWARD : KMP_TANGENT_COMPOSITE;
    return ok;
}

static bool derive_by_both(kmp_equations *eq, const kmp_tree *tree, const kmp_forces *forces, unsigned sets,
                           const both_methods *b, kmp_ref *qdd)
{
    kmp_savings *savings = &eq->savings;
    if (eq->model->flexible_count > 0) /* the recursion by composite bodies does not know their coordinates */
        savings->by_q = savings->by_qd = KMP_TANGENT_FORWARD;
    const bool open = savings->by_q == KMP_TANGENT_SHORTER || savings->by_qd == KMP_TANGENT_SHORTER;
    if (open)
        savings->by_q = savings->by_qd = KMP_TANGENT_SHORTER;
    for (int k = 0; k < eq->n; k++)
        qdd[k] = kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k);
    if (savings->by_q != KMP_TANGENT_FORWARD || savings->by_qd != KMP_TANGENT_FORWARD) {
        if (sets & KMP_SET_POWER_SLOPES) {
            eq->energy.power_q = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
            eq->energy.power_qd = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
            if (!eq->energy.power_q || !eq->energy.power_qd)
                return false;
        }
        kmp_tangents_composite(tree, qdd, forces, b->by_q[0], b->by_qd[0], eq->energy.power_q, eq->energy.power_qd);
    }
    if (savings->by_q != KMP_TANGENT_COMPOSITE)
        kmp_partials_all(eq->graph, eq->n, eq->dynamics.inverse, KMP_IN_Q, eq->n, b->by_q[1]);
    if (savings->by_qd != KMP_TANGENT_COMPOSITE)
        kmp_partials_all(eq->graph, eq->n, eq->dynamics.inverse, KMP_IN_QD, eq->n, b->by_qd[1]);
    if (kmp_graph_failed(eq->graph) || (open && !choose_methods(eq, sets, b)))
        return false;
    for (int k = 0; k < eq->n * eq->n; k++) {
        eq->dynamics.inverse_q[k] = b->by_q[savings->by_q == KMP_TANGENT_FORWARD][k];
        eq->dynamics.inverse_qd[k] = b->by_qd[savings->by_qd == KMP_TANGENT_FORWARD][k];
    }
    return true;
}

/* J' lambda has symmetric derivatives: they are the second ones of lambda' h. `room`: n x n. */
static bool derive_closed(kmp_equations *eq, const kmp_ref *jt_lambda, kmp_ref *room)
{
    int n = eq->n;
    kmp_partials_all(eq->graph, n, jt_lambda, KMP_IN_Q, n, room);
    if (kmp_graph_failed(eq->graph) || !kmp_tangents_mirror(eq->graph, n, room))
        return false;
    for (int k = 0; k < n * n; k++)
        eq->dynamics.closed_q[k] = kmp_sub(eq->graph, eq->dynamics.inverse_q[k], room[k]);
    return true;
}

/* After the inverse dynamics; eq->inverse_q and the others by the variants of eq, or by the ones with the fewest
 * operations, which it then keeps. */
static void derive_tangents(kmp_equations *eq, const kmp_forces *forces, unsigned sets)
{
    const size_t size = (size_t)eq->n * (size_t)eq->n;
    kmp_ref *jt_lambda = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
    if (!jt_lambda)
        return;
    if (sets & (KMP_SET_CLOSED | KMP_SET_CLOSED_Q)) {
        kmp_closures_transposed(eq, KMP_IN_LAMBDA, jt_lambda);
        for (int k = 0; k < eq->n; k++)
            eq->dynamics.closed[k] = kmp_sub(eq->graph, eq->dynamics.inverse[k], jt_lambda[k]);
    }
    if (!(sets & TANGENT_SETS))
        return;
    kmp_ref *room = KMP_GRAPH_NEW(eq->graph, kmp_ref, 7 * size), *qdd = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
    if (!room || !qdd)
        return;
    const both_methods b = {{room, room + size}, {room + 2 * size, room + 3 * size}};
    eq->dynamics.inverse_q = room + 4 * size;
    eq->dynamics.inverse_qd = room + 5 * size;
    eq->dynamics.closed_q = room + 6 * size;
    if (!derive_by_both(eq, dynamic_links(eq), forces, sets, &b, qdd) ||
        (sets & KMP_SET_CLOSED_Q && !derive_closed(eq, jt_lambda, room)))
        kmp_graph_fail(eq->graph);
}

/* -- accelerations ----------------------------------------------------------------------------------- */

static kempe_status derive_accelerations(kmp_equations *eq, const kmp_forces *forces,
                                         const kmp_derivation_request *request)
{
    const int n = eq->n, m = request->closed ? eq->m : 0;
    kmp_graph *g = eq->graph;
    kmp_wrench *share = KMP_GRAPH_NEW(g, kmp_wrench, eq->tree.count);
    kmp_ref *effort = KMP_GRAPH_NEW(g, kmp_ref, n), *kept = KMP_GRAPH_NEW(g, kmp_ref, 3 * m);
    kmp_ref *elastic = KMP_GRAPH_NEW(g, kmp_ref, n);
    KMP_TRY(kmp_made(eq->context, share && effort && kept && elastic));
    kmp_ref *violation = kept + m, *unused = violation + m;
    for (int r = 0; r < m; r++) {
        kept[r] = kmp_input(g, KMP_IN_KEPT, (uint32_t)r);
        violation[r] = kmp_input(g, KMP_IN_MU, (uint32_t)r);
    }
    const kmp_carried carried = {.rows = m, .jacobian = eq->closures.jacobian, .kept = kept};
    kmp_articulated bodies;
    KMP_TRY(kmp_articulated_init(&bodies, dynamic_links(eq), &carried));
    eq->articulated.pivots = bodies.pivot;
    eq->articulated.diagonals = bodies.diagonal;
    kmp_newton_euler_shares(dynamic_links(eq), forces->applied, share, elastic);
    for (int k = 0; k < n; k++) {
        kmp_ref given = request->efforts ? kmp_input(g, KMP_IN_EFFORT, (uint32_t)k) : KMP_ZERO;
        effort[k] = kmp_add(g, forces->effort[k], given);
        if (elastic[k] != KMP_ZERO)
            effort[k] = kmp_sub(g, effort[k], elastic[k]);
    }
    kmp_articulated_solve(
        &bodies, effort, share, eq->closures.jdqd,
        &(kmp_articulated_result){eq->articulated.accelerations, eq->articulated.multipliers, eq->articulated.open});
    if (m > 0)
        kmp_articulated_solve(&bodies, NULL, NULL, violation,
                              &(kmp_articulated_result){.qdd = eq->articulated.correction, .lambda = unused});
    return KEMPE_OK;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static bool allocate_outputs(kmp_equations *eq)
{
    const kempe_model *model = eq->model;
    int n = model->motion_count, rows = KMP_KIND_MAX_ROWS * model->closure_count;
    int forces = model->force_count, states = model->state_count, delays = model->delay_count;
    KMP_GRAPH_MAKE(eq->graph, KMP_ROOM(kmp_ref, n * n, &eq->dynamics.mass),
                   KMP_ROOM(kmp_ref, n, &eq->dynamics.bias, &eq->dynamics.product, &eq->dynamics.residual,
                            &eq->dynamics.inverse, &eq->dynamics.closed, &eq->dynamics.jt_mu,
                            &eq->articulated.accelerations, &eq->articulated.open, &eq->articulated.correction),
                   KMP_ROOM(kmp_ref, rows, &eq->closures.h, &eq->closures.h_t, &eq->closures.rate, &eq->closures.jdqd,
                            &eq->closures.hdot, &eq->articulated.multipliers, &eq->closures.after),
                   KMP_ROOM(kmp_ref, rows * n, &eq->closures.jacobian), KMP_ROOM(kmp_ref, 2 * n, &eq->states.start),
                   KMP_ROOM(kmp_ref, 3 * model->closure_count, &eq->closures.reaction),
                   KMP_ROOM(kmp_ref, 3 * model->output_count, &eq->outputs.position),
                   KMP_ROOM(kmp_ref, kmp_outputs_width(model), &eq->outputs.shown),
                   KMP_ROOM(kmp_ref, forces, &eq->sticking.slip, &eq->sticking.level, &eq->sticking.holding,
                            &eq->sticking.force, &eq->contacts.gap, &eq->contacts.gap_rate, &eq->contacts.push),
                   KMP_ROOM(kmp_ref, states, &eq->states.next, &eq->states.when),
                   KMP_ROOM(kmp_ref, delays, &eq->delays.signal, &eq->delays.before, &eq->delays.delay),
                   KMP_ROOM(kmp_row, rows, &eq->closures.rows), KMP_ROOM(int, rows, &eq->closures.first),
                   KMP_ROOM(double, model->closure_count, &eq->closures.misfit), KMP_ROOM(int, n, &eq->run),
                   KMP_ROOM(kmp_noted, 1, &eq->noted));
    for (int k = 0; eq->closures.first && k < rows; k++)
        eq->closures.first[k] = -1;
    return !kmp_graph_failed(eq->graph);
}

static unsigned requested_energy(const kmp_equations *eq, unsigned sets)
{
    if (sets & KMP_SET_ENERGY || (sets & KMP_SET_OUTPUT && kmp_outputs_need_forces(eq->model)))
        return KMP_ENERGY_POTENTIAL | KMP_ENERGY_POWER | (sets & KMP_SET_KINETIC ? KMP_ENERGY_BY_LINKS : 0);
    return sets & KMP_SET_POWER ? KMP_ENERGY_POWER : 0;
}

/* The forces, and what is derived from them. */
static kempe_status derive_loaded(kmp_equations *eq, const kmp_derivation_request *request, unsigned energy)
{
    static const kmp_force none;
    const unsigned sets = request->sets, tangents = TANGENT_SETS | KMP_SET_CLOSED;
    kmp_forces forces;
    kmp_forces_init(&forces, dynamic_links(eq), energy, request->unloaded ? &none : request->alone);
    if (kmp_graph_failed(eq->graph))
        return kmp_fail_memory(eq->context);
    if (sets & KMP_SET_BIAS)
        derive_efforts(eq, &forces, false, eq->dynamics.bias);
    if (sets & KMP_SET_RESIDUAL) {
        derive_efforts(eq, &forces, true, eq->dynamics.residual);
        kmp_closures_transposed(eq, KMP_IN_LAMBDA, eq->dynamics.jt_mu);
        for (int k = 0; k < eq->n; k++)
            eq->dynamics.residual[k] = kmp_sub(eq->graph, eq->dynamics.residual[k], eq->dynamics.jt_mu[k]);
        kmp_closures_transposed(eq, KMP_IN_MU, eq->dynamics.jt_mu);
    }
    if (sets & (KMP_SET_INVERSE | tangents))
        derive_efforts(eq, &forces, true, eq->dynamics.inverse);
    if (sets & tangents)
        derive_tangents(eq, &forces, sets);
    if (sets & KMP_SET_ACCELERATION)
        KMP_TRY(derive_accelerations(eq, &forces, request));
    if (sets & KMP_SET_OUTPUT)
        KMP_TRY(kmp_outputs_derive(eq, &forces));
    eq->energy.potential = forces.potential;
    eq->energy.power = forces.power;
    return KEMPE_OK;
}

static kmp_ref value_of(const kmp_equations *eq, const kmp_force *force, kmp_role role)
{
    return kmp_friction_value(&eq->tree, &(kmp_condition){.of = force, .number = (int)role, .role = role});
}

/* J qd after an impact: no row has a rate, but rows of held contacts that strike rebound by Newton's law. */
static void derive_impact(kmp_equations *eq)
{
    kmp_graph *g = eq->graph;
    for (int r = 0; r < eq->m; r++) {
        const kmp_closure *closure = &eq->model->closures[eq->closures.rows[r].closure];
        const kmp_force *contact = kmp_closure_is_of_modes(closure) ? &eq->model->forces[closure->force] : NULL;
        eq->closures.after[r] = kmp_neg(eq->closures.h_t[r]);
        if (!contact || contact->kind != KMP_FORCE_TOUCH)
            continue;
        kmp_ref closing = kmp_binary(g, KMP_OP_MIN, value_of(eq, contact, KMP_ROLE_RATE), KMP_ZERO);
        kmp_ref rebound = kmp_mul(g, kmp_tree_number(&eq->tree, &contact->restitution), closing);
        kmp_ref held = kmp_friction_input(&eq->tree, contact, KMP_ROLE_HELD);
        eq->closures.after[r] = kmp_sub(g, eq->closures.after[r], kmp_mul(g, held, rebound));
    }
}

/* 1 where the condition holds at which a state changes; 0 of a sampled state. */
static kmp_ref when_of(const kmp_equations *eq, int state)
{
    const kempe_model *model = eq->model;
    const kmp_expr *rate = kmp_state_rate(model, state);
    const int contact = model->states[state].contact - 1;
    kmp_bearing_load pressing;
    if (contact >= 0) {
        kmp_bearing_load_find(&eq->tree, &model->forces[contact], &pressing);
        return kmp_bearing_load_holds(&eq->tree, &model->forces[contact], &pressing);
    }
    return rate && rate->a ? kmp_tree_expression(&eq->tree, rate->a) : KMP_ZERO;
}

static void derive_next(kmp_equations *eq)
{
    for (int k = 0; k < eq->model->state_count; k++)
        if (eq->model->states[k].next) {
            eq->states.when[eq->states.count] = when_of(eq, k);
            eq->states.next[eq->states.count++] = kmp_tree_expression(&eq->tree, eq->model->states[k].next);
        }
}

/* Signals before the start are functions of the time; rows that keep their value at the start have none. */
static void derive_delayed(kmp_equations *eq)
{
    for (int k = 0; k < eq->model->state_count; k++) {
        const kmp_state *state = &eq->model->states[k];
        if (!state->delayed)
            continue;
        const int d = eq->delays.count++;
        eq->delays.signal[d] = kmp_tree_expression(&eq->tree, state->delayed);
        eq->delays.before[d] = state->before  ? kmp_tree_expression(&eq->tree, state->before)
                               : state->began ? kmp_tree_number(&eq->tree, &state->start)
                                              : KMP_ZERO;
        eq->delays.delay[d] = kmp_tree_number(&eq->tree, &state->delay);
    }
}

static void derive_loads(kmp_equations *eq)
{
    kmp_ref *column = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
    eq->dynamics.loads = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n * eq->m);
    for (int r = 0; column && eq->dynamics.loads && r < eq->m; r++) {
        kmp_derivatives_by(eq->graph, kmp_input(eq->graph, KMP_IN_LAMBDA, (uint32_t)r), eq->n, eq->dynamics.bias,
                           column);
        for (int k = 0; k < eq->n; k++)
            eq->dynamics.loads[k * eq->m + r] = column[k];
    }
}

/* -- conditions and directions ------------------------------------------------------------------------- */

bool kmp_is_late(const kmp_graph *g, kmp_ref value)
{
    return kmp_depends_on(g, value, KMP_IN_QDD) || kmp_depends_on(g, value, KMP_IN_LAMBDA);
}

kmp_ref *kmp_conditions_with_solved(kmp_graph *g, const kmp_ref *conditions, int counts[2])
{
    int total = counts[0] + counts[1], solved = 0;
    uint32_t nodes = kmp_graph_count(g);
    uint8_t *needed = KMP_GRAPH_NEW(g, uint8_t, nodes);
    if (!needed)
        return NULL;
    kmp_live_mark(g, total, conditions, needed);
    for (uint32_t i = 0; i < nodes; i++) {
        needed[i] = needed[i] && kmp_graph_node(g, i)->op == KMP_OP_IMPLICIT;
        solved += needed[i];
    }
    kmp_ref *out = KMP_GRAPH_NEW(g, kmp_ref, total + solved);
    for (int late = 0, at = 0, from = 0; out && late < 2; late++) {
        memcpy(out + at, conditions + from, (size_t)counts[late] * sizeof *out);
        at += counts[late];
        from += counts[late];
        for (uint32_t i = 0; i < nodes; i++)
            if (needed[i] && kmp_is_late(g, i << 1) == late) {
                out[at++] = i << 1;
                counts[late]++;
            }
    }
    return out;
}

static kempe_status derive_changes(kmp_equations *eq, const kmp_events *events)
{
    int counts[2] = {events ? events->count : 0, 0};
    kmp_ref *changes = KMP_GRAPH_NEW(eq->graph, kmp_ref, counts[0]);
    for (int k = 0; changes && k < counts[0]; k++)
        if (!kmp_tree_event(&eq->tree, k, &changes[k]))
            return kmp_fail(eq->context, KEMPE_E_BUG, "a condition of an element is missing in its law");
    eq->conditions.count = counts[0];
    eq->conditions.changes = changes ? kmp_conditions_with_solved(eq->graph, changes, counts) : NULL;
    eq->conditions.watched_count = counts[0] + counts[1];
    return kmp_made(eq->context, eq->conditions.changes);
}

kmp_directions kmp_equations_directions(const kempe_model *model, int rows)
{
    const int n = model->motion_count, parameters = 1 + KMP_TIME_NUMBERS * kmp_model_given_inputs(model);
    const int q = parameters + model->parameter_count;
    return (kmp_directions){parameters, q, q + n, q + 2 * n, q + 3 * n, q + 3 * n + rows};
}

static void derive_along(kmp_equations *eq)
{
    const int m = eq->m;
    kmp_ref *curve = KMP_GRAPH_NEW(eq->graph, kmp_ref, m);
    for (int r = 0; curve && r < m; r++)
        curve[r] = kmp_equations_curve(eq, r);
    /* Every input of the graph moves along an entry of KMP_IN_ALONG. */
    const kmp_directions at = kmp_equations_directions(eq->model, eq->m);
    const struct {
        kmp_input_kind kind;
        int from, to;
    } list[] = {{KMP_IN_TIME, 0, at.parameters}, {KMP_IN_PARAMETER, at.parameters, at.q},
                {KMP_IN_Q, at.q, at.qd},         {KMP_IN_QD, at.qd, at.qdd},
                {KMP_IN_QDD, at.qdd, at.lambda}, {KMP_IN_LAMBDA, at.lambda, at.count}};
    kmp_graph *g = eq->graph;
    kmp_ref *leaf = KMP_GRAPH_NEW(g, kmp_ref, at.count), *direction = KMP_GRAPH_NEW(g, kmp_ref, at.count);
    for (size_t k = 0; leaf && direction && k < sizeof list / sizeof *list; k++)
        for (int i = list[k].from; i < list[k].to; i++) {
            leaf[i] = kmp_input(g, list[k].kind, (uint32_t)(i - list[k].from));
            direction[i] = kmp_input(g, KMP_IN_ALONG, (uint32_t)i);
        }
    kmp_derivative *d = leaf && direction ? kmp_derivative_new(g, at.count, leaf, direction) : NULL;
    eq->along.count = 0;
    eq->along.change =
        KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n + 3 * m + eq->outputs.shown_count + eq->conditions.count);
    if (!curve || !d || !eq->along.change)
        return;
    const struct {
        int count;
        const kmp_ref *value;
    } set[] = {{eq->n, eq->dynamics.closed},
               {m, eq->closures.h},
               {m, eq->closures.hdot},
               {m, curve},
               {eq->outputs.shown_count, eq->outputs.shown},
               {eq->conditions.count, eq->conditions.changes}};
    for (size_t k = 0; k < sizeof set / sizeof *set; k++)
        for (int i = 0; i < set[k].count; i++)
            eq->along.change[eq->along.count++] = kmp_derivative_of(d, set[k].value[i]);
    kmp_derivative_free(d);
}

static kempe_status derive_dynamics(kmp_equations *eq, const kmp_derivation_request *request)
{
    const unsigned sets = request->sets, energy = requested_energy(eq, sets);
    const unsigned loaded =
        KMP_SET_BIAS | KMP_SET_RESIDUAL | KMP_SET_INVERSE | KMP_SET_ACCELERATION | TANGENT_SETS | KMP_SET_CLOSED;
    if (sets & KMP_SET_MASS)
        (request->scheme == KMP_SCHEME_NER ? kmp_mass_ner : kmp_mass_composite)(dynamic_links(eq), eq->dynamics.mass);
    if (sets & KMP_SET_PRODUCT) {
        kmp_ref *x = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->n);
        for (int k = 0; x && k < eq->n; k++)
            x[k] = kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k);
        if (x)
            kmp_mass_times(dynamic_links(eq), x, eq->dynamics.product);
    }
    if (sets & loaded || energy)
        KMP_TRY(derive_loaded(eq, request, energy));
    else if (sets & KMP_SET_OUTPUT)
        KMP_TRY(kmp_outputs_derive(eq, NULL));
    eq->energy.kinetic = sets & KMP_SET_KINETIC ? kmp_kinetic_energy(&eq->tree) : KMP_ZERO;
    eq->sticking.count = 0;
    if (sets & KMP_SET_FRICTION) {
        /* Rates, levels and forces of all elements that stick. */
        for (const kmp_force *f = eq->model->forces; f < eq->model->forces + eq->model->force_count; f++)
            if (kmp_force_sticks(f)) {
                if (kmp_force_has_sides(f))
                    return kmp_fail(eq->context, KEMPE_E_ARGUMENT,
                                    "friction '%s' has a level for each direction, and the sets level and holding have "
                                    "one: a simulator (--simulator) has both",
                                    f->name);
                int e = eq->sticking.count++;
                eq->sticking.slip[e] = value_of(eq, f, KMP_ROLE_RATE);
                eq->sticking.level[e] = value_of(eq, f, KMP_ROLE_LEVEL);
                eq->sticking.holding[e] = value_of(eq, f, KMP_ROLE_STATIC);
                eq->sticking.force[e] = value_of(eq, f, KMP_ROLE_GIVEN);
            }
    }
    eq->contacts.count = 0;
    if (sets & KMP_SET_CONTACT) {
        /* Distances of all rigid contacts, their rates and forces. */
        for (const kmp_force *f = eq->model->forces; f < eq->model->forces + eq->model->force_count; f++)
            if (f->kind == KMP_FORCE_TOUCH) {
                int e = eq->contacts.count++;
                eq->contacts.gap[e] = value_of(eq, f, KMP_ROLE_PLACE);
                eq->contacts.gap_rate[e] = value_of(eq, f, KMP_ROLE_RATE);
                eq->contacts.push[e] = value_of(eq, f, KMP_ROLE_GIVEN);
            }
    }
    if (sets & KMP_SET_IMPACT)
        derive_impact(eq);
    eq->states.count = 0;
    if (sets & KMP_SET_NEXT)
        derive_next(eq);
    if (sets & KMP_SET_START) {
        for (int k = 0; k < eq->n; k++) {
            eq->states.start[2 * k] = kmp_tree_number(&eq->tree, &eq->model->start.q[k]);
            eq->states.start[2 * k + 1] = kmp_tree_number(&eq->tree, &eq->model->start.qd[k]);
        }
    }
    eq->delays.count = 0;
    if (sets & KMP_SET_DELAYED)
        derive_delayed(eq);
    if (sets & KMP_SET_LOADS)
        derive_loads(eq);
    eq->conditions.count = eq->conditions.watched_count = 0;
    if (sets & KMP_SET_CONDITIONS)
        KMP_TRY(derive_changes(eq, request->events));
    if (sets & KMP_SET_ALONG)
        derive_along(eq);
    return kmp_graph_failed(eq->graph) ? kmp_fail_memory(eq->context) : KEMPE_OK;
}

static bool init_tree(kmp_equations *eq, const kmp_derivation_request *request, kmp_tree *tree)
{
    /* The links of the dynamics are the links of the other tree, before their variants: where equal nodes are one,
     * links made again are these. */
    bool again = tree == &eq->links && !request->body_inputs && kmp_graph_has_rule(eq->graph, KMP_RULE_SHARE);
    if (!(again ? kmp_tree_init_again(tree, &eq->tree)
                : kmp_tree_init(tree, eq->graph, eq->model, request->keep, request->charted)))
        return false;
    tree->conditions.events = request->events;
    tree->conditions.noted = eq->noted;
    tree->reactions.row = eq->closures.first;
    tree->reactions.of_closure = kmp_closure_load;
    for (int k = 0; request->modes_alone && k < eq->model->force_count; k++)
        if (kmp_force_has_modes(&eq->model->forces[k]))
            (void)kmp_friction_find(tree, &eq->model->forces[k]);
    tree->conditions.settled = request->modes_alone;
    tree->friction_in_place = request->friction_in_place;
    tree->given_delays = request->given_delays;
    return !kmp_graph_failed(eq->graph);
}

/* Sets the variants of the dynamics, and makes a second tree when they differ from the model. */
static bool set_frames(kmp_equations *eq, const kmp_derivation_request *request)
{
    const kmp_savings *savings = request->savings;
    kmp_tree *tree = &eq->links;
    kmp_savings_copy(&eq->savings, savings, eq->model);
    if (kmp_savings_plain(savings, eq->model))
        return true;
    if (!init_tree(eq, request, tree))
        return false;
    kmp_move_origins(tree, savings->origin);
    kmp_tree_sum_up(tree);
    for (int k = 0; k < eq->n; k++)
        tree->links[k + 1].about = savings->about[k];
    kmp_regroup(tree, savings->give);
    kmp_lump(tree, savings->lump);
    kmp_let_stay(tree, savings->stay);
    if (request->body_inputs)
        kmp_tree_add_inputs(tree, request->no_inputs);
    return true;
}

static void swap(kmp_ref *a, kmp_ref *b, int count)
{
    for (int k = 0; k < count; k++) {
        kmp_ref x = a[k];
        a[k] = b[k];
        b[k] = x;
    }
}

void kmp_equations_swap_derived(kmp_equations *eq)
{
    int m = eq->m;
    swap(eq->closures.h, eq->closures.derived, m);
    swap(eq->closures.hdot, eq->closures.derived + m, m);
    swap(eq->closures.jdqd, eq->closures.derived + 2 * m, m);
    swap(eq->closures.jacobian, eq->closures.derived + 3 * m, m * eq->n);
}

kempe_status kmp_equations_derive_again(kmp_equations *eq, const kmp_derivation_request *request)
{
    kmp_tree_free(&eq->links);
    eq->links.count = 0;
    kmp_graph_return(eq->graph, &eq->mark);
    kmp_tree_forget(&eq->tree);
    return set_frames(eq, request) ? derive_dynamics(eq, request) : kmp_fail_memory(eq->context);
}

static kempe_status derive_sets(kmp_equations *eq, const kmp_derivation_request *request)
{
    eq->graph = kmp_graph_new_for(request->nodes);
    KMP_TRY(kmp_made(eq->context, eq->graph));
    if (request->labels)
        kmp_graph_keep_labels(eq->graph);
    kmp_graph_set_rules(eq->graph, KMP_RULE_ALL & ~request->without);
    KMP_TRY(kmp_made(eq->context, allocate_outputs(eq) && init_tree(eq, request, &eq->tree)));
    kmp_tree_sum_up(&eq->tree);
    if (request->body_inputs)
        kmp_tree_add_inputs(&eq->tree, request->no_inputs);
    KMP_TRY(kmp_made(eq->context, kmp_savings_init(&eq->savings, eq->model)));
    eq->savings.by_q = eq->savings.by_qd = request->tangents;
    if (request->savings)
        KMP_TRY(kmp_made(eq->context, set_frames(eq, request)));
    kmp_tree_runs(&eq->tree, eq->run);
    KMP_TRY(kmp_closures_derive(eq, request));
    if (request->returns)
        KMP_TRY(kmp_made(eq->context, kmp_graph_mark_init(&eq->mark, eq->graph)));
    return derive_dynamics(eq, request);
}

kempe_status kmp_equations_derive_once(kmp_equations *eq, const kempe_model *model,
                                       const kmp_derivation_request *request)
{
    *eq = (kmp_equations){.context = model->context, .model = model, .n = model->motion_count};
    kempe_status status = derive_sets(eq, request);
    if (status != KEMPE_OK)
        kmp_equations_free(eq);
    return status;
}

kempe_status kmp_equations_init(kmp_equations *eq, const kempe_model *model, unsigned sets, kmp_scheme scheme,
                                bool keep_parameters)
{
    const kmp_derivation_request request = {
        .sets = sets, .scheme = scheme, .keep = keep_parameters ? KMP_KEEP_PARAMETERS : KMP_KEEP_NOTHING};
    return kmp_equations_derive(eq, model, &request);
}

kmp_ref kmp_equations_curve(const kmp_equations *eq, int row)
{
    kmp_ref sum = eq->closures.jdqd[row];
    for (int k = 0; k < eq->n; k++) {
        kmp_ref entry = eq->closures.jacobian[row * eq->n + k];
        if (entry != KMP_ZERO)
            sum = kmp_add(eq->graph, sum, kmp_mul(eq->graph, entry, kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k)));
    }
    return sum;
}

bool kmp_equations_shorten(const kmp_equations *eq, int count, kmp_ref *outputs)
{
    const kmp_parallel parallel = {eq->run, eq->n};
    return kmp_shorten(eq->graph, &parallel, count, outputs);
}

KMP_CLEARS(kmp_equations, eq, kmp_tree_free(&eq->tree), kmp_tree_free(&eq->links), kmp_noted_free(eq->noted),
           kmp_savings_free(&eq->savings), kmp_graph_mark_free(&eq->mark), kmp_graph_free(eq->graph))
