/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state: programs of the system, each run stage by stage on its back end.
 *
 * An evaluator has up to four machines. `composite` gives h, J, M, C and jdqd, with M by composite rigid bodies;
 * `bodies` gives accelerations and multipliers by the recursion of articulated bodies (Featherstone 1983), in place of
 * M and C; `judge` gives energies, reactions and outputs (judged_values.h); `conditions` gives conditions
 * (present_conditions.h). `motion` is `composite` or `bodies`, as the caller has selected.
 * Its stages are cut where the inputs become known: constants and charts, then (t, q), then qd, then multipliers. A
 * caller that needs only h pays for nothing else. */
#include "constraints/evaluation/evaluator.h"
#include "backend/native.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator_inside.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/evaluation/validity.h"
#include "dynamics/motion.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Products with J and M, and dense copies of them, from the entries that the last evaluation gave. Entries are stored
 * by the patterns of the system: J in row-major order, M by its lower triangle. */

void kmp_eval_dense_jacobian(const kmp_evaluator *eval, double *jacobian)
{
    const kmp_pattern *p = &eval->system->jacobian;
    memset(jacobian, 0, (size_t)(eval->m * eval->n) * sizeof *jacobian);
    for (int k = 0; k < p->count; k++)
        jacobian[p->row[k] + p->col[k] * eval->m] = eval->jacobian[k];
}

void kmp_eval_rates(const kmp_evaluator *eval, const double *qd, double *rates)
{
    const kmp_pattern *p = &eval->system->jacobian;
    for (int r = 0; r < eval->m; r++)
        rates[r] = eval->h_t ? eval->h_t[r] : 0;
    for (int k = 0; k < p->count; k++)
        rates[p->row[k]] += eval->jacobian[k] * qd[p->col[k]];
}

double kmp_eval_drive_power(const kmp_evaluator *eval, const double *lambda)
{
    double power = 0;
    for (int r = 0; eval->h_t && r < eval->m; r++)
        power -= lambda[r] * eval->h_t[r];
    return power;
}

/* M x, until the next product. */
static const double *product_with(const kmp_evaluator *eval, const double *x)
{
    kmp_machine_set(eval->composite, KMP_IN_QDD, x);
    return kmp_machine_run(eval->composite, KMP_STAGE_PRODUCT);
}

void kmp_eval_dense_mass(const kmp_evaluator *eval, double *mass)
{
    const kmp_pattern *p = &eval->system->mass;
    int n = eval->n;
    memset(mass, 0, (size_t)(n * n) * sizeof *mass);
    if (eval->by_products) {
        for (int k = 0; k < n; k++) {
            memset(eval->by_mass, 0, (size_t)n * sizeof *eval->by_mass);
            eval->by_mass[k] = 1;
            memcpy(mass + (size_t)k * (size_t)n, product_with(eval, eval->by_mass), (size_t)n * sizeof *mass);
        }
        return;
    }
    for (int k = 0; k < p->count; k++)
        mass[p->row[k] + p->col[k] * n] = mass[p->col[k] + p->row[k] * n] = eval->mass[k];
}

void kmp_eval_add_mass_times(const kmp_evaluator *eval, const double *x, double *out)
{
    const kmp_pattern *m = &eval->system->mass;
    if (eval->by_products) {
        const double *product = product_with(eval, x);
        for (int i = 0; i < eval->n; i++)
            out[i] += product[i];
        return;
    }
    for (int k = 0; k < m->count; k++) {
        int i = m->row[k], j = m->col[k];
        out[i] += eval->mass[k] * x[j];
        if (i != j)
            out[j] += eval->mass[k] * x[i];
    }
}

/* The inputs of programs, and their stages that are constant during steps. */

void kmp_eval_set_all(kmp_evaluator *eval, kmp_input_kind kind, const double *values)
{
    kmp_machine *machines[] = {eval->composite, eval->bodies.machine, eval->judge, eval->conditions.machine};
    for (size_t k = 0; k < sizeof machines / sizeof *machines; k++)
        if (machines[k])
            kmp_machine_set(machines[k], kind, values);
}

/* Evaluates all values that are constant during steps. */
static void evaluate_constants(kmp_evaluator *eval)
{
    kmp_machine *machines[] = {eval->composite, eval->bodies.machine, eval->judge, eval->conditions.machine};
    kmp_eval_set_all(eval, KMP_IN_CHART, eval->chart);
    for (size_t k = 0; k < sizeof machines / sizeof *machines; k++)
        if (machines[k])
            (void)kmp_eval_run(eval, machines[k], KMP_STAGE_PARAMETERS);
}

void kmp_eval_renew_parameters(kmp_evaluator *eval)
{
    kmp_eval_set_all(eval, KMP_IN_PARAMETER, eval->system->parameters);
    evaluate_constants(eval);
}

void kmp_eval_set_charts(kmp_evaluator *eval, const double *chart)
{
    memmove(eval->chart, chart, (size_t)(KMP_CHART_SIZE * eval->system->chart_count) * sizeof *chart);
    eval->chart_version++;
    evaluate_constants(eval);
}

/* The inputs of machines that have been added. */
static void set_constant_inputs(kmp_evaluator *eval)
{
    kmp_eval_set_all(eval, KMP_IN_PARAMETER, eval->system->parameters);
    kmp_eval_set_all(eval, KMP_IN_MODE, eval->conditions.mode);
    evaluate_constants(eval);
}

/* Makes the machines, the arrays, and the values that are constant during steps. Programs that are rarely evaluated use
 * the tape, which needs no compilation. False: no memory. */

static bool make_machines(kmp_evaluator *eval, kmp_eval_use use)
{
    const kempe_system *s = eval->system;
    const kmp_backend *seldom = kmp_backend_find("tape"), *waiting = kmp_backend_waiting(eval->backend);
    const bool closes = use == KMP_EVAL_CLOSES, follows = s->changes && (!closes || s->switches);
    const kmp_program *program = closes ? s->closing : kmp_eval_program(eval, false);
    eval->motion = eval->composite = kmp_machine_new(program, use == KMP_EVAL_STEPS ? eval->backend : waiting);
    if (!closes)
        eval->judge = kmp_machine_new(s->judge, s->dissipative ? waiting : seldom);
    const kmp_backend *following = use == KMP_EVAL_STEPS ? waiting : seldom;
    bool made = kmp_present_conditions_init(&eval->conditions, &eval->arena, s, follows ? following : NULL);
    made = made && eval->motion && (closes || eval->judge);
    eval->validity = kmp_validity_marks_new(s, &eval->arena);
    eval->state_ends = kmp_state_ends_new(s, &eval->arena);
    KMP_ARENA_MAKE(&eval->arena, KMP_ROOM(bool, eval->m, &eval->unmet.dropped),
                   KMP_ROOM(double, KMP_CHART_SIZE * s->chart_count, &eval->chart),
                   KMP_ROOM(double, eval->n, &eval->q, &eval->outer.sum, &eval->outer.effort));
    if (eval->weighs_only || eval->by_products)
        eval->by_mass = KMP_ARENA_NEW(&eval->arena, double, eval->n + eval->m);
    if (s->load_row_count > 0) {
        eval->nu = KMP_ARENA_NEW(&eval->arena, double, eval->m);
        eval->load = kmp_load_work_new(s, &eval->arena);
    }
    if (!kmp_present_inputs_init(&eval->inputs, &eval->arena, s->model) || eval->arena.failed || !made)
        return false;
    if (eval->nu)
        kmp_eval_set_all(eval, KMP_IN_LAMBDA, eval->nu);
    kmp_charts_reset(s, eval->chart);
    set_constant_inputs(eval);
    return true;
}

kmp_evaluator *kmp_eval_new_for(const kempe_system *system, const char *backend, kmp_team *team, kmp_eval_use use)
{
    const kmp_backend *b = kmp_backend_find(backend);
    if (!b) {
        (void)kmp_fail(system->context, KEMPE_E_ARGUMENT, "unknown back end '%s'; available: %s", backend,
                       kmp_backend_names());
        return NULL;
    }
    if (use > KMP_EVAL_WEIGHS && kmp_motion_need(system) != KEMPE_OK)
        return NULL;
    kmp_evaluator *eval = KMP_NEW(kmp_evaluator, 1);
    if (eval) {
        *eval = (kmp_evaluator){.system = system, .shared = *b, .n = system->n, .m = system->m};
        bool waits = use == KMP_EVAL_WEIGHS && !kmp_motion_is_made(system);
        eval->by_products = waits && system->late->by_products;
        eval->weighs_only = waits && !eval->by_products;
        eval->shared.team = team;
        eval->backend = team ? &eval->shared : b;
    }
    if (!eval || !make_machines(eval, use)) {
        kmp_eval_free(eval);
        (void)kmp_fail_memory(system->context);
        return NULL;
    }
    return eval;
}

kmp_evaluator *kmp_eval_new(const kempe_system *system, const char *backend)
{
    return kmp_eval_new_for(system, backend, NULL, KMP_EVAL_EVALUATES);
}

kmp_evaluator *kmp_eval_new_of_closures(const kempe_system *system)
{
    return kmp_eval_new_for(system, "tape", NULL, KMP_EVAL_CLOSES);
}

const kmp_program *kmp_eval_program(const kmp_evaluator *eval, bool by_bodies)
{
    const kempe_system *s = eval->system;
    return by_bodies ? s->bodies->program : eval->weighs_only || eval->by_products ? s->late->weighing : s->motion;
}

kmp_team *kmp_eval_team(const kmp_evaluator *eval)
{
    return eval->backend->team;
}

kempe_status kmp_eval_add_articulated(kmp_evaluator *eval)
{
    const kempe_system *s = eval->system;
    KMP_TRY(kmp_motion_need_bodies(s));
    if (!s->bodies->program || eval->bodies.machine)
        return KEMPE_OK;
    eval->bodies.machine = kmp_machine_new(s->bodies->program, eval->backend);
    KMP_TRY(kmp_made(s->context, eval->bodies.machine));
    kmp_machine_set(eval->bodies.machine, KMP_IN_EFFORT, eval->outer.effort); /* zero, or set before use */
    if (!eval->bodies.kept)
        eval->bodies.kept = KMP_ARENA_NEW(&eval->arena, double, eval->m);
    KMP_TRY(kmp_made(s->context, eval->bodies.kept));
    for (int r = 0; r < eval->m; r++)
        eval->bodies.kept[r] = 1;
    kmp_machine_set(eval->bodies.machine, KMP_IN_KEPT, eval->bodies.kept);
    set_constant_inputs(eval);
    return KEMPE_OK;
}

kempe_status kmp_eval_add_composite(kmp_evaluator *eval)
{
    const kempe_system *s = eval->system;
    if (!eval->weighs_only && !eval->by_products)
        return KEMPE_OK;
    KMP_TRY(kmp_motion_need(s));
    kmp_machine *made = kmp_machine_new(s->motion, kmp_backend_waiting(eval->backend));
    KMP_TRY(kmp_made(s->context, made));
    kmp_machine_free(eval->composite);
    eval->composite = made;
    eval->weighs_only = eval->by_products = false;
    kmp_eval_set_by_bodies(eval, eval->by_bodies);
    set_constant_inputs(eval);
    return KEMPE_OK;
}

/* Switches between the two machines. Values of the other one are no longer valid. */
void kmp_eval_set_by_bodies(kmp_evaluator *eval, bool by_bodies)
{
    eval->by_bodies = by_bodies && eval->bodies.machine;
    eval->motion = eval->by_bodies ? eval->bodies.machine : eval->composite;
    eval->mass = eval->bias = eval->jdqd = NULL;
    eval->bodies.pivots = eval->bodies.diagonals = eval->bodies.qdd = eval->bodies.multipliers = NULL;
}

void kmp_eval_free(kmp_evaluator *eval)
{
    if (!eval)
        return;
    kmp_machine_free(eval->composite);
    kmp_machine_free(eval->bodies.machine);
    kmp_machine_free(eval->judge);
    kmp_machine_free(eval->conditions.machine);
    kmp_arena_free(&eval->arena);
    kmp_free(eval);
}

void kmp_eval_closure(kmp_evaluator *eval, double t, const double *q)
{
    kmp_eval_follow_conditions(eval, &t, q, NULL);
    kmp_machine_set(eval->motion, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->motion, KMP_IN_Q, q);
    eval->h = kmp_eval_run(eval, eval->motion, KMP_STAGE_CLOSURE);
    eval->jacobian = eval->h + eval->m;
    eval->h_t = eval->system->rheonomic ? eval->jacobian + eval->system->jacobian.count : NULL;
    eval->t = t;
    memmove(eval->q, q, (size_t)eval->n * sizeof *q);
}

void kmp_eval_use_closure(kmp_evaluator *eval, double t, const double *q, const double *h, const double *jacobian,
                          const double *h_t)
{
    eval->h = h;
    eval->jacobian = jacobian;
    eval->h_t = h_t;
    eval->t = t;
    memmove(eval->q, q, (size_t)eval->n * sizeof *q);
}

void kmp_eval_mass(kmp_evaluator *eval)
{
    const double *out = kmp_eval_run(eval, eval->motion, KMP_STAGE_MASS);
    if (eval->by_bodies) {
        eval->bodies.pivots = out;
        eval->bodies.diagonals = out + eval->m;
    } else if (!eval->by_products) {
        eval->mass = out;
    }
}

void kmp_eval_keep_rows(kmp_evaluator *eval, const int *position)
{
    bool same = true;
    for (int r = 0; r < eval->m; r++) {
        const double kept = position[r] >= 0 ? 1 : 0;
        same = same && kept == eval->bodies.kept[r];
        eval->bodies.kept[r] = kept;
    }
    if (same)
        return;
    kmp_machine_set(eval->bodies.machine, KMP_IN_KEPT, eval->bodies.kept);
    if (eval->bodies.pivots)
        kmp_eval_mass(eval);
    if (eval->bodies.qdd)
        (void)kmp_eval_run(eval, eval->motion, KMP_STAGE_BIAS);
}

const double *kmp_eval_open(kmp_evaluator *eval)
{
    return eval->by_bodies && eval->bodies.qdd ? kmp_eval_run(eval, eval->bodies.machine, KMP_STAGE_OPEN) : NULL;
}

const double *kmp_eval_correction(kmp_evaluator *eval, const double *violation)
{
    kmp_machine_set(eval->bodies.machine, KMP_IN_MU, violation);
    return kmp_eval_run(eval, eval->bodies.machine, KMP_STAGE_CORRECT);
}

/* Adds generalized forces outside the program to C. */
static void add_outer_forces(kmp_evaluator *eval)
{
    const double *effort = eval->system->force ? eval->outer.effort : NULL;
    eval->bias = eval->own_bias;
    if (!effort && !eval->outer.given)
        return;
    for (int i = 0; i < eval->n; i++)
        eval->outer.sum[i] =
            eval->own_bias[i] - (effort ? effort[i] : 0) - (eval->outer.given ? eval->outer.given[i] : 0);
    eval->bias = eval->outer.sum;
}

void kmp_eval_set_effort(kmp_evaluator *eval, const double *effort)
{
    eval->outer.given = effort;
    if (!eval->by_bodies)
        add_outer_forces(eval);
}

void kmp_eval_lend_motion(kmp_evaluator *eval, const double *mass, const double *bias)
{
    eval->mass = mass;
    eval->own_bias = bias;
    eval->jdqd = bias + eval->n;
    add_outer_forces(eval);
}

/* Evaluates C with the present multipliers, after jdqd. */
static void run_load_dependent(kmp_evaluator *eval)
{
    kmp_machine_set(eval->motion, KMP_IN_LAMBDA, eval->nu);
    eval->own_bias = kmp_eval_run(eval, eval->motion, KMP_STAGE_LOAD);
    eval->load_jacobian = eval->own_bias + eval->n;
}

/* Finds C and jdqd by M from the accelerations a0 without closure forces by articulated bodies, of which no row is
 * kept: M a0 + C = 0. */
static void find_bias(kmp_evaluator *eval, const double *qd)
{
    kmp_machine *m = eval->bodies.machine; /* which the caller has added */
    double *bias = eval->by_mass, *jdqd = bias + eval->n;
    memset(jdqd, 0, (size_t)eval->m * sizeof *jdqd); /* no row is kept */
    kmp_machine_set(m, KMP_IN_KEPT, jdqd);
    kmp_machine_set(m, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, eval->t));
    kmp_machine_set(m, KMP_IN_Q, eval->q);
    kmp_machine_set(m, KMP_IN_QD, qd);
    for (int i = 0; i < eval->n; i++) {
        bias[i] = 0;
        eval->outer.sum[i] = 0;
    }
    kmp_machine_set(m, KMP_IN_EFFORT, eval->outer.sum);
    for (int stage = KMP_STAGE_CLOSURE; stage < KMP_STAGE_BIAS; stage++)
        (void)kmp_eval_run(eval, m, stage);
    const double *free_qdd = kmp_eval_run(eval, m, KMP_STAGE_BIAS);
    const double *open = kmp_eval_run(eval, m, KMP_STAGE_OPEN);
    kmp_machine_set(m, KMP_IN_EFFORT, eval->outer.effort);
    kmp_machine_set(m, KMP_IN_KEPT, eval->bodies.kept);
    kmp_eval_add_mass_times(eval, free_qdd, bias);
    for (int i = 0; i < eval->n; i++)
        bias[i] = -bias[i];
    memcpy(jdqd, open + eval->n, (size_t)eval->m * sizeof *jdqd);
    eval->own_bias = bias;
    eval->jdqd = jdqd;
    add_outer_forces(eval);
}

void kmp_eval_bias_with(kmp_evaluator *eval, const double *nu)
{
    memmove(eval->nu, nu, (size_t)eval->m * sizeof *nu);
    run_load_dependent(eval);
    add_outer_forces(eval);
}

void kmp_eval_bias(kmp_evaluator *eval, const double *qd)
{
    kmp_eval_follow_conditions(eval, NULL, NULL, qd);
    kmp_machine_set(eval->motion, KMP_IN_QD, qd);
    (void)kmp_eval_effort(eval, eval->t, eval->q, qd);
    if (eval->by_bodies) {
        /* Accelerations and multipliers by the recursion, with efforts outside the program; `effort` is zero, or of the
         * user-defined force. */
        for (int i = 0; eval->outer.given && i < eval->n; i++)
            eval->outer.sum[i] = eval->outer.effort[i] + eval->outer.given[i];
        if (eval->outer.given || eval->outer.gave || eval->system->force)
            kmp_machine_set(eval->motion, KMP_IN_EFFORT, eval->outer.given ? eval->outer.sum : eval->outer.effort);
        eval->outer.gave = eval->outer.given;
        eval->bodies.qdd = kmp_eval_run(eval, eval->motion, KMP_STAGE_BIAS);
        eval->bodies.multipliers = eval->bodies.qdd + eval->n;
    } else if (eval->weighs_only) {
        find_bias(eval, qd);
    } else {
        eval->own_bias = kmp_eval_run(eval, eval->motion, KMP_STAGE_BIAS);
        eval->jdqd = eval->nu ? eval->own_bias : eval->own_bias + eval->n;
        if (eval->nu)
            run_load_dependent(eval);
        add_outer_forces(eval);
    }
}

const double *kmp_eval_effort(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    if (!eval->system->force)
        return NULL;
    kmp_system_effort(eval->system, t, q, qd, eval->outer.effort);
    return eval->outer.effort;
}
