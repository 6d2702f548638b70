/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs by handle: one program with the values, their Jacobian and its product with the rates. The closed-chain
 * Jacobian takes the tangent of coordinate partitioning (Fisette and Samin 1996, eq. 43). */
#include "base/memory.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "integrators/run/runner_inputs.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/stepper_inside.h"
#include "symbolic/derivative.h"
#include <kempe/check.h>
#include <kempe/output_handles.h>
#include <math.h>
#include <string.h>

/* Stages of the program beyond the values: J by columns and jdqd; jdqd of the closures. */
enum { SLOPES = KMP_OBSERVED_MORE, CLOSURES };

struct kempe_outputs {
    const kempe_system *system;
    kmp_arena arena;
    kmp_output_program observed;
    int n, m, count;
    bool *moves;         /* of each value: it has a Jacobian */
    kmp_evaluator *eval; /* of the closures, for the tangent */
    kmp_partition part;
    kmp_reduction red;
    bool reduces;  /* `red` is there */
    double *rate;  /* n */
    double *slope; /* count x n, and count: J and jdqd */
};

/* -- the program ------------------------------------------------------------------------------------- */

/* J by q, of outputs that depend on rates by qd; jdqd is the second, or the first, total derivative by time. */
static void differentiate(kempe_outputs *o, const kmp_equations *eq, int count, const kmp_ref *value, kmp_ref *slope)
{
    kmp_graph *g = eq->graph;
    const unsigned late = 1u << KMP_IN_QDD | 1u << KMP_IN_LAMBDA;
    kmp_derivative *d = kmp_time_derivative(&eq->tree);
    kmp_ref *by = KMP_GRAPH_NEW(g, kmp_ref, 2 * count * o->n);
    if (!by)
        return;
    kmp_ref *by_rates = by + count * o->n;
    kmp_partials_all(g, count, value, KMP_IN_Q, o->n, by);
    kmp_partials_all(g, count, value, KMP_IN_QD, o->n, by_rates);
    for (int i = 0; i < count; i++) {
        unsigned depends = kmp_graph_node(g, kmp_id(value[i]))->depends;
        bool rates = depends & 1u << KMP_IN_QD;
        o->moves[i] = !(depends & late);
        kmp_ref rate = rates ? value[i] : kmp_derivative_of(d, value[i]);
        for (int k = 0; k < o->n && o->moves[i]; k++)
            slope[k * count + i] = (rates ? by_rates : by)[i * o->n + k];
        slope[o->n * count + i] = o->moves[i] ? kmp_derivative_of(d, rate) : KMP_ZERO;
    }
    kmp_derivative_free(d);
}

static void make_slopes(void *user, const kmp_equations *eq, int count, const kmp_ref *value, int *counts,
                        const kmp_ref **groups)
{
    kempe_outputs *o = user;
    kmp_ref *slope = KMP_GRAPH_NEW(eq->graph, kmp_ref, count * (o->n + 1));
    o->count = count;
    o->moves = KMP_ARENA_NEW(&o->arena, bool, count);
    if (slope && o->moves)
        differentiate(o, eq, count, value, slope);
    counts[0] = count * (o->n + 1);
    groups[0] = slope;
    counts[1] = o->m;
    groups[1] = eq->jdqd;
}

/* -- new and free ------------------------------------------------------------------------------------ */

/* Chooses the independent coordinates at the start, `count` of them the caller's; a choice that fails changes nothing.
 */
static kempe_status choose(kempe_outputs *o, const int *u, int count)
{
    kmp_partition part = {0};
    kempe_assembly *a = NULL;
    KMP_TRY(kempe_assembly_new(o->system, &a));
    kmp_eval_closure(o->eval, 0, kempe_assembly_q(a));
    kempe_assembly_free(a);
    kempe_status status = kmp_partition_init(&part, o->system, o->eval->jacobian, count ? u : NULL, count);
    if (status != KEMPE_OK) {
        kmp_partition_free(&part);
        return status;
    }
    if (o->reduces)
        kmp_reduction_free(&o->red);
    kmp_partition_free(&o->part);
    o->part = part;
    status = kmp_reduction_init(&o->red, o->eval, &o->part);
    o->reduces = status == KEMPE_OK;
    return status;
}

static kempe_status make(kempe_outputs *o, const char *words)
{
    const kmp_output_program_stages slopes = {o, make_slopes};
    KMP_TRY(kmp_output_program_init(&o->observed, o->system, words, 0, &slopes));
    o->eval = kmp_eval_new_of_closures(o->system);
    o->rate = KMP_ARENA_NEW(&o->arena, double, o->n);
    o->slope = KMP_ARENA_NEW(&o->arena, double, o->count *(o->n + 1));
    if (!o->eval || o->arena.failed)
        return KEMPE_E_MEMORY;
    /* The choice at the start; none where it cannot be assembled: closed-chain Jacobians are then refused. */
    kempe_status status = choose(o, NULL, 0);
    KMP_TRY(status == KEMPE_E_MEMORY ? status : KEMPE_OK);
    kmp_context_clear(o->system->context);
    return KEMPE_OK;
}

kempe_status kempe_outputs_new(const kempe_system *system, const char *words, kempe_outputs **outputs)
{
    KMP_WANTED_BOTH(system, words);
    KMP_WANTED(system->context, outputs, "outputs");
    kmp_model_begin(system->model);
    KMP_MAKE(system->context, kempe_outputs, o);
    o->system = system;
    o->n = system->n;
    o->m = system->m;
    kempe_status status = make(o, words);
    if (status == KEMPE_E_MEMORY)
        (void)kmp_fail_memory(system->context);
    return KMP_GIVE_OR_FREE(status, outputs, o, kempe_outputs_free);
}

KMP_FREES(kempe_outputs, o, kmp_reduction_free(&o->red), kmp_partition_free(&o->part), kmp_eval_free(o->eval),
          kmp_output_program_free(&o->observed), kmp_arena_free(&o->arena))

/* -- names ------------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_outputs_count(const kempe_outputs *outputs), outputs, outputs->count, 0)
KMP_GETTER_AT(const char *kempe_outputs_name(const kempe_outputs *outputs, int k), outputs, k, outputs->count,
              outputs->observed.columns.name[k + 1], NULL)
KMP_GETTER_AT(const char *kempe_outputs_unit(const kempe_outputs *outputs, int k), outputs, k, outputs->count,
              outputs->observed.columns.unit[k + 1], "")

int kempe_outputs_find(const kempe_outputs *outputs, const char *name)
{
    for (int k = 0; name && k < kempe_outputs_count(outputs); k++)
        if (strcmp(kempe_outputs_name(outputs, k), name) == 0)
            return k;
    return -1;
}

/* -- values ------------------------------------------------------------------------------------------ */

kempe_status kempe_outputs_at_state(kempe_outputs *o, double t, const double *q, const double *qd, const double *qdd,
                                    const double *lambda, double *values)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, q, "q");
    KMP_WANTED(o->system->context, values, "values");
    kmp_output_program_at(&o->observed, t, q, qd, qdd, lambda, values);
    return KEMPE_OK;
}

static kempe_status check_system(const kempe_outputs *o, const kempe_system *system)
{
    return system == o->system ? KEMPE_OK
                               : kmp_fail(o->system->context, KEMPE_E_ARGUMENT, "the outputs belong to another system");
}

kempe_status kempe_outputs_at_stepper(kempe_outputs *o, const kempe_stepper *s, double *values)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, s, "stepper");
    KMP_WANTED(o->system->context, values, "values");
    KMP_TRY(check_system(o, s->system));
    kmp_present_inputs *inputs = &o->observed.inputs;
    kmp_present_inputs_copy(inputs, kmp_runner_inputs(s->runner));
    inputs->held = true;
    kempe_status status = kempe_outputs_at_state(o, s->t, kempe_stepper_q(s), kempe_stepper_qd(s), kempe_stepper_qdd(s),
                                                 kempe_stepper_lambda(s), values);
    memset(inputs->replaced, 0, (size_t)inputs->count * sizeof *inputs->replaced);
    inputs->held = false;
    return status;
}

kempe_status kempe_outputs_at_row(kempe_outputs *o, const kempe_trajectory *t, int row, double *values)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, t, "trajectory");
    KMP_WANTED(o->system->context, values, "values");
    KMP_TRY(check_system(o, t->system));
    if (row < 0 || row >= kempe_trajectory_row_count(t))
        return kmp_fail(o->system->context, KEMPE_E_ARGUMENT, "there is no row %d: the trajectory has %d", row,
                        kempe_trajectory_row_count(t));
    return kempe_outputs_at_state(o, kempe_trajectory_time(t, row), kempe_trajectory_q(t, row),
                                  kempe_trajectory_qd(t, row), kempe_trajectory_qdd(t, row),
                                  kempe_trajectory_lambda(t, row), values);
}

kempe_status kempe_outputs_at_time(kempe_outputs *outputs, kempe_trajectory *trajectory, double t, double *values)
{
    KMP_WANTED(NULL, outputs, "outputs");
    KMP_WANTED(NULL, trajectory, "trajectory");
    const double *row = trajectory->at;
    int n = trajectory->system->n;
    KMP_TRY(kempe_trajectory_at_time(trajectory, t, NULL, NULL, NULL, NULL));
    return kempe_outputs_at_state(outputs, t, row, row + n, row + 2 * n, row + 3 * n, values);
}

/* -- Jacobians --------------------------------------------------------------------------------------- */

kempe_status kempe_outputs_jacobian(kempe_outputs *o, double t, const double *q, const double *qd, double *jacobian,
                                    double *jdqd)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, q, "q");
    KMP_WANTED(o->system->context, jacobian, "jacobian");
    /* J and jdqd at a state, owned by the machine. */
    kmp_output_program_place(&o->observed, t, q, qd, NULL, NULL);
    (void)kmp_machine_run(o->observed.machine, KMP_OBSERVED_VALUES);
    const double *slope = kmp_machine_run(o->observed.machine, SLOPES);
    for (int k = 0; k < o->n * o->count; k++)
        jacobian[k] = o->moves[k % o->count] ? slope[k] : NAN;
    for (int i = 0; jdqd && i < o->count; i++)
        jdqd[i] = o->moves[i] ? slope[o->n * o->count + i] : NAN;
    return KEMPE_OK;
}

kempe_status kempe_outputs_choose(kempe_outputs *o, const char *independent)
{
    KMP_WANTED(NULL, o, "outputs");
    kempe_context *context = o->system->context;
    kmp_model_begin(o->system->model);
    int count = 0, *u = KMP_NEW(int, o->n);
    kempe_status status =
        u ? kmp_coordinates_read(o->system->model, "independent", independent, u, &count) : kmp_fail_memory(context);
    if (status == KEMPE_OK)
        status = choose(o, u, count);
    kmp_free(u);
    return status;
}

KMP_GETTER(int kempe_outputs_independent_count(const kempe_outputs *outputs), outputs, outputs->part.p, 0)
KMP_GETTER(const int *kempe_outputs_independent(const kempe_outputs *outputs), outputs, outputs->part.u, NULL)

/* X and x_t at a closed position; at a dead centre its coordinates by name. */
static kempe_status find_tangent(kempe_outputs *o, double t, const double *q)
{
    const kempe_model *model = o->system->model;
    kempe_context *context = o->system->context;
    int v = 0, u = 0;
    if (!o->reduces)
        return kmp_fail(context, KEMPE_E_FAILED, "independent coordinates cannot be chosen at the start of the model");
    kmp_eval_closure(o->eval, t, q);
    int singular = kmp_reduction_factor(&o->red);
    if (singular > 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "the closures are singular at t = %.9g s: the independent coordinates do not determine '%s' "
                        "(a dead centre)",
                        t, model->motions[singular - 1].name);
    kmp_reduction_tangent(&o->red);
    double growth = o->part.p > 0 ? kmp_reduction_growth(&o->red, &v, &u) : 0;
    if (growth <= KMP_TANGENT_SINGULAR)
        return KEMPE_OK;
    return kmp_fail(
        context, KEMPE_E_FAILED,
        "'%s' is at a dead centre at t = %.9g s: it stops while '%s' moves (rates by a factor %.2g); choose "
        "other independent coordinates",
        model->motions[u].name, t, model->motions[v].name, growth);
}

kempe_status kempe_outputs_closed_jacobian(kempe_outputs *o, double t, const double *q, const double *qd,
                                           double *jacobian, double *drift)
{
    KMP_WANTED(NULL, o, "outputs");
    KMP_WANTED(o->system->context, q, "q");
    KMP_WANTED(o->system->context, jacobian, "jacobian");
    KMP_TRY(find_tangent(o, t, q));
    int n = o->n, p = o->part.p;
    const double *x = o->red.x;
    KMP_TRY(kempe_outputs_jacobian(o, t, q, qd, o->slope, o->slope + n * o->count));
    for (int k = 0; k < p; k++)
        for (int i = 0; i < o->count; i++) {
            double sum = 0;
            for (int j = 0; j < n; j++)
                sum += o->slope[j * o->count + i] * x[k * n + j];
            jacobian[k * o->count + i] = sum;
        }
    /* J a0 + jdqd with a0 = (0; -Jv^-1 jdqd of the closures): the accelerations at udd = 0. */
    if (drift) {
        memset(o->rate, 0, (size_t)n * sizeof *o->rate);
        if (o->m > 0)
            kmp_reduction_push_in(&o->red, -1, kmp_machine_run(o->observed.machine, CLOSURES), o->red.room, o->rate);
        for (int i = 0; i < o->count; i++) {
            drift[i] = o->slope[n * o->count + i];
            for (int k = 0; k < n; k++)
                drift[i] += o->slope[k * o->count + i] * o->rate[k];
        }
    }
    return KEMPE_OK;
}
