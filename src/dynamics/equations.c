/* SPDX-License-Identifier: BSD-3-Clause */
/* Derives the sets in the order in which they share: closures, mass, bias, residual, the rest. */
#include "dynamics/equations.h"
#include "base/memory.h"
#include "constraints/kinds/kind.h"
#include "dynamics/closures.h"
#include "dynamics/forces.h"
#include "dynamics/formalisms/articulated.h"
#include "dynamics/formalisms/tangent_sets.h"
#include "dynamics/outputs.h"
#include "dynamics/shorten/fixed_axes.h"
#include "dynamics/shorten/origins.h"
#include "dynamics/shorten/pseudo_inertia.h"
#include "dynamics/shorten/regroup.h"
#include "model/tables/output_table.h"
#include "symbolic/label.h"
#include "symbolic/passes/shorten.h"
#include <string.h>

/* -- dynamics ---------------------------------------------------------------------------------------- */

/* The links of the dynamics. */
static const kmp_tree *frames(const kmp_equations *eq)
{
    return eq->links.count ? &eq->links : &eq->tree;
}

/* Newton/Euler with given accelerations, less the efforts. */
static kempe_status derive_efforts(kmp_equations *eq, const kmp_forces *forces, const kmp_ref *qdd, kmp_ref *out)
{
    if (!kmp_newton_euler(frames(eq), qdd, forces->applied, out))
        return kmp_fail_memory(eq->context);
    for (int k = 0; k < eq->n; k++)
        out[k] = kmp_sub(eq->graph, out[k], forces->effort[k]);
    return KEMPE_OK;
}

static kempe_status derive_bias(kmp_equations *eq, const kmp_forces *forces)
{
    kmp_ref *qdd = KMP_NEW(kmp_ref, eq->n);
    kempe_status status = qdd ? derive_efforts(eq, forces, qdd, eq->bias) : kmp_fail_memory(eq->context);
    kmp_free(qdd);
    return status;
}

static kempe_status derive_inverse(kmp_equations *eq, const kmp_forces *forces, kmp_ref *out)
{
    kmp_ref *qdd = KMP_NEW(kmp_ref, eq->n);
    kempe_status status = qdd ? KEMPE_OK : kmp_fail_memory(eq->context);
    for (int k = 0; qdd && k < eq->n; k++)
        qdd[k] = kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k);
    if (status == KEMPE_OK)
        status = derive_efforts(eq, forces, qdd, out);
    kmp_free(qdd);
    return status;
}

static kempe_status derive_residual(kmp_equations *eq, const kmp_forces *forces)
{
    kempe_status status = derive_inverse(eq, forces, eq->residual);
    if (status == KEMPE_OK) {
        kmp_closures_transposed(eq, KMP_IN_LAMBDA, eq->jt_mu);
        for (int k = 0; k < eq->n; k++)
            eq->residual[k] = kmp_sub(eq->graph, eq->residual[k], eq->jt_mu[k]);
        kmp_closures_transposed(eq, KMP_IN_MU, eq->jt_mu);
    }
    return status;
}

/* -- tangents ---------------------------------------------------------------------------------------- */

/* After the inverse dynamics. */
static kempe_status derive_tangents(kmp_equations *eq, const kmp_forces *forces, unsigned sets)
{
    kmp_ref *jt_lambda = KMP_NEW(kmp_ref, eq->n);
    bool ok = jt_lambda;
    if (ok && sets & (KMP_SET_CLOSED | KMP_SET_CLOSED_Q)) {
        kmp_closures_transposed(eq, KMP_IN_LAMBDA, jt_lambda);
        for (int k = 0; k < eq->n; k++)
            eq->closed[k] = kmp_sub(eq->graph, eq->inverse[k], jt_lambda[k]);
    }
    if (ok && sets & KMP_TANGENT_SETS)
        ok = kmp_tangent_sets_derive(eq, frames(eq), forces, sets, jt_lambda);
    kmp_free(jt_lambda);
    return ok ? KEMPE_OK : kmp_fail_memory(eq->context);
}

/* -- accelerations ----------------------------------------------------------------------------------- */

static kmp_ref row_times(const kmp_equations *eq, int r, const kmp_ref *x)
{
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < eq->n; k++)
        sum = kmp_add(eq->graph, sum, kmp_mul(eq->graph, eq->jacobian[r * eq->n + k], x[k]));
    return sum;
}

/* Accelerations by the closure forces J' lambda as generalized forces in the recursion, one multiplier at a time,
 * projected on all rows. lambda = - mobility^-1 drift is solved numerically. */
static void derive_compliance(kmp_equations *eq, kmp_articulated *bodies)
{
    int n = eq->n, m = eq->m;
    for (int r = 0; r < m; r++) {
        kmp_articulated_solve(bodies, eq->jacobian + r * n, NULL, eq->compliance + r * n);
        for (int s = 0; s <= r; s++)
            eq->mobility[r * m + s] = row_times(eq, r, eq->compliance + s * n);
        eq->drift[r] = kmp_add(eq->graph, row_times(eq, r, eq->free_qdd), eq->jdqd[r]);
    }
}

static kempe_status derive_accelerations(kmp_equations *eq, const kmp_forces *forces, bool efforts)
{
    kmp_articulated bodies;
    kmp_wrench *share = KMP_NEW(kmp_wrench, eq->tree.count);
    kmp_ref *effort = KMP_NEW(kmp_ref, eq->n);
    kempe_status status = kmp_articulated_init(&bodies, frames(eq));
    if (status == KEMPE_OK && (!share || !effort || !kmp_newton_euler_shares(frames(eq), forces->applied, share)))
        status = kmp_fail_memory(eq->context);
    for (int k = 0; status == KEMPE_OK && k < eq->n; k++) {
        kmp_ref given = efforts ? kmp_input(eq->graph, KMP_IN_EFFORT, (uint32_t)k) : KMP_ZERO;
        effort[k] = kmp_add(eq->graph, forces->effort[k], given);
    }
    if (status == KEMPE_OK) {
        kmp_articulated_solve(&bodies, effort, share, eq->free_qdd);
        derive_compliance(eq, &bodies);
    }
    kmp_articulated_free(&bodies);
    kmp_free(share);
    kmp_free(effort);
    return status;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static bool allocate(kmp_equations *eq)
{
    const kempe_model *model = eq->model;
    int n = model->motion_count, rows = KMP_KIND_MAX_ROWS * model->closure_count;
    eq->rows = KMP_NEW(kmp_row, rows);
    eq->row = KMP_NEW(int, rows);
    eq->misfit = KMP_NEW(double, model->closure_count);
    for (int k = 0; eq->row && k < rows; k++)
        eq->row[k] = -1;
    eq->mass = KMP_NEW(kmp_ref, n * n);
    eq->bias = KMP_NEW(kmp_ref, n);
    eq->h = KMP_NEW(kmp_ref, rows);
    eq->h_t = KMP_NEW(kmp_ref, rows);
    eq->jacobian = KMP_NEW(kmp_ref, rows * n);
    eq->jdqd = KMP_NEW(kmp_ref, rows);
    eq->residual = KMP_NEW(kmp_ref, n);
    eq->inverse = KMP_NEW(kmp_ref, n);
    eq->closed = KMP_NEW(kmp_ref, n);
    eq->jt_mu = KMP_NEW(kmp_ref, n);
    eq->hdot = KMP_NEW(kmp_ref, rows);
    eq->reaction = KMP_NEW(kmp_ref, 3 * model->closure_count);
    eq->position = KMP_NEW(kmp_ref, 3 * model->output_count);
    eq->shown = KMP_NEW(kmp_ref, kmp_outputs_width(model));
    eq->free_qdd = KMP_NEW(kmp_ref, n);
    eq->compliance = KMP_NEW(kmp_ref, rows * n);
    eq->mobility = KMP_NEW(kmp_ref, rows * rows);
    eq->drift = KMP_NEW(kmp_ref, rows);
    bool fast = eq->free_qdd && eq->compliance && eq->mobility && eq->drift;
    return fast && eq->rows && eq->row && eq->misfit && eq->mass && eq->bias && eq->h && eq->h_t && eq->jacobian &&
           eq->jdqd && eq->residual && eq->inverse && eq->closed && eq->jt_mu && eq->hdot && eq->reaction &&
           eq->position && eq->shown;
}

static unsigned asked_energy(const kmp_equations *eq, unsigned sets)
{
    if (sets & KMP_SET_ENERGY || (sets & KMP_SET_OUTPUT && kmp_outputs_need_forces(eq->model)))
        return KMP_ENERGY_POTENTIAL | KMP_ENERGY_POWER;
    return sets & KMP_SET_POWER ? KMP_ENERGY_POWER : 0;
}

static kempe_status derive_dynamics(kmp_equations *eq, const kmp_scene *scene)
{
    unsigned sets = scene->sets;
    kempe_status status = KEMPE_OK;
    kmp_forces forces;
    kmp_mass_scheme *mass = scene->scheme == KMP_SCHEME_NER ? kmp_mass_ner : kmp_mass_composite;
    if (sets & KMP_SET_MASS && !mass(frames(eq), eq->mass))
        return kmp_fail_memory(eq->context);
    const unsigned energy = asked_energy(eq, sets);
    const unsigned tangents = KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD | KMP_SET_CLOSED | KMP_SET_CLOSED_Q;
    const unsigned dynamic = KMP_SET_BIAS | KMP_SET_RESIDUAL | KMP_SET_INVERSE | KMP_SET_ACCELERATION | tangents;
    if (!(sets & dynamic) && !energy)
        return !(sets & KMP_SET_OUTPUT) || kmp_outputs_derive(eq, NULL) ? KEMPE_OK : kmp_fail_memory(eq->context);
    if (!kmp_forces_init(&forces, frames(eq), energy))
        return kmp_fail_memory(eq->context);
    if (sets & KMP_SET_BIAS)
        status = derive_bias(eq, &forces);
    if (status == KEMPE_OK && sets & KMP_SET_RESIDUAL)
        status = derive_residual(eq, &forces);
    if (status == KEMPE_OK && sets & (KMP_SET_INVERSE | tangents))
        status = derive_inverse(eq, &forces, eq->inverse);
    if (status == KEMPE_OK && sets & tangents)
        status = derive_tangents(eq, &forces, sets);
    if (status == KEMPE_OK && sets & KMP_SET_ACCELERATION)
        status = derive_accelerations(eq, &forces, scene->efforts);
    if (status == KEMPE_OK && sets & KMP_SET_OUTPUT && !kmp_outputs_derive(eq, &forces))
        status = kmp_fail_memory(eq->context);
    eq->potential = forces.potential;
    eq->power = forces.power;
    kmp_forces_free(&forces);
    return status;
}

static bool init_tree(kmp_equations *eq, const kmp_scene *scene, kmp_tree *tree)
{
    if (!kmp_tree_init(tree, eq->graph, eq->model, scene->keep, scene->charted))
        return false;
    tree->events = scene->events;
    tree->noted = eq->noted;
    tree->row = eq->row;
    return true;
}

static void finish_tree(const kmp_scene *scene, kmp_tree *tree)
{
    if (scene->body_inputs)
        kmp_tree_add_inputs(tree, scene->no_inputs);
}

static bool add_tree(kmp_equations *eq, const kmp_scene *scene)
{
    if (!init_tree(eq, scene, &eq->tree))
        return false;
    kmp_tree_sum_up(&eq->tree);
    finish_tree(scene, &eq->tree);
    return true;
}

/* Adds the links with the scene's variants. */
static bool add_links(kmp_equations *eq, const kmp_scene *scene)
{
    const kmp_ways *ways = scene->ways;
    kmp_tree *tree = &eq->links;
    if (!init_tree(eq, scene, tree))
        return false;
    kmp_move_origins(tree, ways->origin);
    kmp_tree_sum_up(tree);
    for (int k = 0; k < eq->n; k++)
        tree->links[k + 1].about = ways->about[k];
    kmp_regroup(tree, ways->give);
    kmp_lump(tree, ways->lump);
    if (ways->spread)
        kmp_spread_out(tree);
    kmp_let_stay(tree, ways->stay);
    finish_tree(scene, tree);
    return true;
}

/* Sets the variants of the dynamics, and makes a second tree when they differ from the model. */
static bool set_frames(kmp_equations *eq, const kmp_scene *scene)
{
    kmp_ways_copy(&eq->ways, scene->ways, eq->model);
    return kmp_ways_plain(scene->ways, eq->model) || add_links(eq, scene);
}

static void set_rules(const kmp_equations *eq, const kmp_scene *scene)
{
    unsigned without = scene->without | (eq->ways.apart ? KMP_RULE_RUNS : 0);
    kmp_graph_set_rules(eq->graph, KMP_RULE_ALL & ~without);
}

/* A copy of the scene's variants, or room for them. */
static bool add_ways(kmp_equations *eq, const kmp_scene *scene)
{
    if (!kmp_ways_init(&eq->ways, eq->model))
        return false;
    eq->ways.by_q = eq->ways.by_qd = scene->tangents;
    return !scene->ways || set_frames(eq, scene);
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
    swap(eq->h, eq->derived, m);
    swap(eq->hdot, eq->derived + m, m);
    swap(eq->jdqd, eq->derived + 2 * m, m);
    swap(eq->jacobian, eq->derived + 3 * m, m * eq->n);
}

kempe_status kmp_equations_derive_again(kmp_equations *eq, const kmp_scene *scene)
{
    kmp_graph_set_rules(eq->graph, KMP_RULE_ALL & ~scene->without);
    kmp_tree_free(&eq->links);
    eq->links.count = 0;
    if (!set_frames(eq, scene))
        return kmp_fail_memory(eq->context);
    set_rules(eq, scene);
    kempe_status status = derive_dynamics(eq, scene);
    return status == KEMPE_OK && kmp_graph_failed(eq->graph) ? kmp_fail_memory(eq->context) : status;
}

kempe_status kmp_equations_derive_once(kmp_equations *eq, const kempe_model *model, const kmp_scene *scene)
{
    *eq = (kmp_equations){.context = model->context, .model = model, .n = model->motion_count};
    eq->graph = kmp_graph_new();
    kempe_status status = KEMPE_OK;
    bool labelled = eq->graph && (!scene->labels || kmp_graph_keep_labels(eq->graph));
    if (eq->graph)
        kmp_graph_set_rules(eq->graph, KMP_RULE_ALL & ~scene->without);
    eq->run = KMP_NEW(int, eq->n);
    eq->noted = KMP_NEW(kmp_noted, 1);
    if (!labelled || !eq->run || !eq->noted || !allocate(eq) || !add_tree(eq, scene) || !add_ways(eq, scene))
        status = kmp_fail_memory(eq->context);
    else
        kmp_tree_runs(&eq->tree, eq->run);
    if (status == KEMPE_OK)
        status = kmp_closures_derive(eq, scene);
    if (status == KEMPE_OK) {
        set_rules(eq, scene);
        status = derive_dynamics(eq, scene);
    }
    if (status == KEMPE_OK && kmp_graph_failed(eq->graph))
        status = kmp_fail_memory(eq->context);
    if (status != KEMPE_OK)
        kmp_equations_free(eq);
    return status;
}

kempe_status kmp_equations_init(kmp_equations *eq, const kempe_model *model, unsigned sets, kmp_scheme scheme,
                                bool keep_parameters)
{
    const kmp_scene scene = {
        .sets = sets, .scheme = scheme, .keep = keep_parameters ? KMP_KEEP_PARAMETERS : KMP_KEEP_NOTHING};
    return kmp_equations_derive(eq, model, &scene);
}

bool kmp_equations_shorten(const kmp_equations *eq, int count, kmp_ref *outputs)
{
    const kmp_parallel parallel = {eq->run, eq->n};
    return kmp_shorten(eq->graph, &parallel, count, outputs);
}

void kmp_equations_free(kmp_equations *eq)
{
    kmp_tree_free(&eq->tree);
    kmp_tree_free(&eq->links);
    kmp_noted_free(eq->noted);
    kmp_free(eq->run);
    kmp_ways_free(&eq->ways);
    kmp_graph_free(eq->graph);
    kmp_free(eq->rows);
    kmp_free(eq->row);
    kmp_free(eq->misfit);
    kmp_free(eq->mass);
    kmp_free(eq->bias);
    kmp_free(eq->h);
    kmp_free(eq->h_t);
    kmp_free(eq->jacobian);
    kmp_free(eq->jdqd);
    kmp_free(eq->residual);
    kmp_free(eq->inverse);
    kmp_free(eq->closed);
    kmp_free(eq->inverse_q);
    kmp_free(eq->inverse_qd);
    kmp_free(eq->closed_q);
    kmp_free(eq->jt_mu);
    kmp_free(eq->hdot);
    kmp_free(eq->derived);
    kmp_free(eq->reaction);
    kmp_free(eq->position);
    kmp_free(eq->shown);
    kmp_free(eq->free_qdd);
    kmp_free(eq->compliance);
    kmp_free(eq->mobility);
    kmp_free(eq->drift);
    *eq = (kmp_equations){0};
}
