/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state: programs of the system, each run stage by stage on its back end.
 *
 * An evaluator has up to four machines. `composite` gives h, J, M, C and jdqd, with M by composite rigid bodies;
 * `articulated` gives accelerations and multipliers by the recursion of articulated bodies (Featherstone 1983), in
 * place of M and C; `judge` gives energies, reactions and outputs; `changes` gives conditions. `motion` is the one of
 * the first two that the caller has selected. Its stages are cut where the inputs become known: constants and charts,
 * then (t, q), then qd, then multipliers. A caller that needs only h pays for nothing else. */
#include "constraints/evaluation/evaluator.h"
#include "backend/native.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/evaluation/validity.h"
#include "dynamics/motion.h"
#include "model/data/closure_table.h"
#include "model/data/force.h"
#include "model/data/state.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The intended rank of rounded closures, kept in the system once it is known, and tolerances that follow from it. */

const kmp_rounding *kmp_rounding_of(const kempe_system *system)
{
    return system->rounding && atomic_load(&system->rounding->state) == KMP_ROUNDING_PRESENT ? system->rounding : NULL;
}

bool kmp_rounding_is_known(const kempe_system *system)
{
    return system->rounding && atomic_load(&system->rounding->state) >= KMP_ROUNDING_PRESENT;
}

void kmp_rounding_keep_none(const kempe_system *system)
{
    int none = KMP_ROUNDING_UNKNOWN;
    (void)atomic_compare_exchange_strong(&system->rounding->state, &none, KMP_ROUNDING_NONE);
}

double kmp_rounding_zero(const kempe_system *system, double strict)
{
    const kmp_rounding *rounding = kmp_rounding_of(system);
    return rounding ? fmax(strict, rounding->zero) : strict;
}

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

/* Residuals of closures, scaled by row, and the rows that count in them. A model of rounded numbers can have dependent
 * rows that agree only roughly. As many rows as the rank exceeds are dropped, and what stays open in them, the misfit,
 * is reported apart from the residual. */

bool kmp_eval_counts(const kmp_evaluator *eval, int row)
{
    return !eval->dropped[row] && (!eval->left_out || !eval->left_out[row]);
}

void kmp_eval_drop(kmp_evaluator *eval, int count, const int *rows)
{
    if (!kmp_rounding_of(eval->system))
        return;
    memset(eval->dropped, 0, (size_t)eval->m * sizeof *eval->dropped);
    for (int k = 0; k < count; k++)
        eval->dropped[rows[k]] = true;
}

void kmp_eval_drop_widest(kmp_evaluator *eval)
{
    const kmp_rounding *rounding = kmp_rounding_of(eval->system);
    if (!rounding)
        return;
    memset(eval->dropped, 0, (size_t)eval->m * sizeof *eval->dropped);
    for (int k = rounding->rank; k < eval->m; k++) {
        int widest = -1;
        for (int r = 0; r < eval->m; r++)
            if (!eval->dropped[r] && (widest < 0 || kmp_eval_opening(eval, r) > kmp_eval_opening(eval, widest)))
                widest = r;
        eval->dropped[widest] = true;
    }
}

double kmp_eval_opening(const kmp_evaluator *eval, int row)
{
    return fabs(eval->h[row]) / eval->system->row_scale[row];
}

double kmp_eval_misfit(const kmp_evaluator *eval, int *row)
{
    double widest = 0;
    *row = -1;
    for (int r = 0; r < eval->m; r++)
        if (eval->dropped[r] && !(eval->left_out && eval->left_out[r]) && !(kmp_eval_opening(eval, r) <= widest)) {
            widest = kmp_eval_opening(eval, r);
            *row = r;
        }
    return widest;
}

double kmp_eval_residual(const kmp_evaluator *eval)
{
    double worst = 0;
    for (int r = 0; r < eval->m; r++) {
        double open = kmp_eval_counts(eval, r) ? kmp_eval_opening(eval, r) : 0;
        if (!(open <= worst))
            worst = isnan(open) ? INFINITY : open;
    }
    return worst;
}

double kmp_eval_rate_residual(const kmp_evaluator *eval, const double *qd)
{
    const kmp_pattern *p = &eval->system->jacobian;
    double worst = 0;
    for (int r = 0, k = 0; r < eval->m; r++) { /* entries are in row-major order */
        double rate = eval->h_t ? eval->h_t[r] : 0;
        for (; k < p->count && p->row[k] == r; k++)
            rate += eval->jacobian[k] * qd[p->col[k]];
        if (kmp_eval_counts(eval, r))
            worst = fmax(worst, fabs(rate) / eval->system->row_scale[r]);
    }
    return worst;
}

double kmp_eval_size(const kmp_evaluator *eval, const double *x)
{
    double size = 0;
    for (int i = 0; i < eval->n; i++)
        size = fmax(size, fabs(x[i]) / eval->system->scale[i]);
    return size;
}

/* The conditions of piecewise laws: which branch holds at a state. The program of conditions gives first - second of
 * each one; a machine reads the branches as constants, so that its laws are smooth while a step is integrated.
 * Conditions may depend on conditions. Repeated passes set one level each, as signals in a circuit without loops
 * settle, and at most as many as there are conditions. */

/* Sets an input of all programs. */
static void eval_set_all(kmp_evaluator *eval, kmp_input_kind kind, const double *values)
{
    kmp_machine *machines[] = {eval->composite, eval->articulated, eval->judge, eval->changes};
    for (size_t k = 0; k < sizeof machines / sizeof *machines; k++)
        if (machines[k])
            kmp_machine_set(machines[k], kind, values);
}

/* Runs a stage with the present modes. A decision sets many modes one after the other before an evaluation. */
static const double *run_stage(kmp_evaluator *eval, kmp_machine *machine, int stage)
{
    if (eval->modes_wait)
        eval_set_all(eval, KMP_IN_MODE, eval->mode);
    eval->modes_wait = false;
    return kmp_machine_run(machine, stage);
}

/* The mode of a condition at its value. Friction slips by the sign of its rate. */
static double mode_at(const kmp_condition *condition, const double *change)
{
    double rate = condition->role == KMP_ROLE_SENSE ? change[KMP_ROLE_RATE - KMP_ROLE_SENSE] : 0;
    if (condition->role != KMP_ROLE_NONE)
        return (rate > 0) - (rate < 0);
    return *change < 0 && !condition->ends && !condition->kink ? 1 : 0;
}

/* Takes new inputs of an evaluation, NULL: the last values, and sets the conditions to that state, unless they are
 * fixed. Every evaluation does so first. */
static void eval_follow_conditions(kmp_evaluator *eval, const double *t, const double *q, const double *qd)
{
    if (!eval->changes || eval->frozen)
        return;
    if (t)
        kmp_machine_set(eval->changes, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, *t));
    if (q)
        kmp_machine_set(eval->changes, KMP_IN_Q, q);
    if (qd)
        kmp_machine_set(eval->changes, KMP_IN_QD, qd);
    /* Updates the conditions to the state. Conditions may depend on conditions: each pass settles one level. */
    int count = eval->system->events.count;
    for (int pass = 0; pass <= count; pass++) {
        bool same = true;
        const double *change = run_stage(eval, eval->changes, 1);
        for (int k = 0; k < count; k++) {
            const kmp_condition *condition = &eval->system->events.condition[k];
            bool held = condition->role != KMP_ROLE_NONE &&
                        (eval->holds_friction ||
                         ((const kmp_force *)condition->of)->kind == KMP_FORCE_TOUCH /* of a contact */);
            double mode = held ? eval->mode[k] : mode_at(condition, change + k);
            same = same && mode == eval->mode[k];
            eval->mode[k] = mode;
        }
        if (same)
            return;
        eval->modes_wait = true;
    }
}

const double *kmp_eval_changes(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    if (!eval->changes)
        return NULL;
    kmp_machine_set(eval->changes, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->changes, KMP_IN_Q, q);
    kmp_machine_set(eval->changes, KMP_IN_QD, qd);
    return run_stage(eval, eval->changes, 1);
}

void kmp_eval_all_changes(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, double *change)
{
    const kmp_events *events = &eval->system->events;
    const double *now = kmp_eval_changes(eval, t, q, qd), *late = NULL;
    memcpy(change, now, (size_t)events->count * sizeof *change);
    if (eval->late_count > 0) {
        kmp_machine_set(eval->changes, KMP_IN_QDD, qdd);
        kmp_machine_set(eval->changes, KMP_IN_LAMBDA, lambda);
        late = run_stage(eval, eval->changes, 2);
    }
    for (int k = 0; k < eval->late_count; k++)
        change[eval->late[k]] = late[k];
    eval->solved[0] = now + events->count;
    eval->solved[1] = late ? late + eval->late_count : NULL;
}

void kmp_eval_show_friction(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                            double *lambda, double *change)
{
    const kempe_system *s = eval->system;
    kmp_eval_all_changes(eval, t, q, qd, qdd, lambda, change);
    for (int r = 0; r < s->m; r++) {
        const kmp_closure *closure = kmp_model_closure(s->model, s->rows[r].closure);
        const kmp_force *force = kmp_closure_is_friction(closure) ? kmp_model_force(s->model, closure->force) : NULL;
        for (int k = 0; k < s->events.count && force; k++)
            if (s->events.condition[k].role == KMP_ROLE_GIVEN && s->events.condition[k].of == force)
                lambda[r] = change[k];
    }
}

void kmp_eval_freeze(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    eval->frozen = false;
    eval_follow_conditions(eval, &t, q, qd);
    eval->frozen = true;
}

void kmp_eval_set_mode(kmp_evaluator *eval, int condition, bool holds)
{
    eval->mode[condition] = holds && !eval->system->events.condition[condition].kink ? 1 : 0;
    eval->modes_wait = true;
}

void kmp_eval_set_modes(kmp_evaluator *eval, const double *mode)
{
    memmove(eval->mode, mode, (size_t)eval->system->events.count * sizeof *mode);
    eval->modes_wait = true;
}

void kmp_eval_set_kink(kmp_evaluator *eval, int condition, double side)
{
    eval->mode[condition] = side;
    eval->modes_wait = true;
}

/* Values that judge or show a motion and do not make it: energy, power, reactions, outputs. They have a separate
 * program, so that steps do not pay for them. Its stages build on each other in this order: potential, power,
 * reactions, positions, outputs; each function runs the stages that it needs. */

double kmp_eval_potential(kmp_evaluator *eval, double t, const double *q)
{
    eval_follow_conditions(eval, &t, q, NULL);
    kmp_machine_set(eval->judge, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->judge, KMP_IN_Q, q);
    return *run_stage(eval, eval->judge, KMP_STAGE_POTENTIAL);
}

bool kmp_eval_goes_by_links(const kmp_evaluator *eval)
{
    return eval->weighs_only && eval->system->late->by_links;
}

/* True if the judging program has the kinetic energy. */
static bool has_links(const kmp_evaluator *eval)
{
    return eval->by_products || kmp_eval_goes_by_links(eval);
}

/* qd' M qd / 2 of the last M; or link by link, after the potential at the same place. */
static double kinetic_here(kmp_evaluator *eval, const double *qd)
{
    const kmp_pattern *p = &eval->system->mass;
    int coordinates = kmp_model_coordinates(eval->system->model);
    double sum = 0;
    if (has_links(eval)) {
        kmp_machine_set(eval->judge, KMP_IN_QD, qd);
        return run_stage(eval, eval->judge, KMP_STAGE_POWER)[1];
    }
    for (int k = 0; k < p->count && p->row[k] < coordinates; k++)
        sum += eval->mass[k] * qd[p->row[k]] * qd[p->col[k]] * (p->row[k] == p->col[k] ? 0.5 : 1);
    return sum;
}

double kmp_eval_kinetic(kmp_evaluator *eval, const double *qd)
{
    if (has_links(eval))
        (void)kmp_eval_potential(eval, eval->t, eval->q);
    return kinetic_here(eval, qd);
}

void kmp_eval_energies(kmp_evaluator *eval, const double *qd, double *kinetic, double *potential)
{
    *potential = kmp_eval_potential(eval, eval->t, eval->q);
    *kinetic = kinetic_here(eval, qd);
}

/* Stages build on each other: the power's needs the potential's. The power uses the multipliers of the last C. */
double kmp_eval_power(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    eval_follow_conditions(eval, &t, q, qd);
    (void)kmp_eval_potential(eval, t, q);
    kmp_machine_set(eval->judge, KMP_IN_QD, qd);
    if (eval->nu)
        kmp_machine_set(eval->judge, KMP_IN_LAMBDA, eval->nu);
    double power = *run_stage(eval, eval->judge, KMP_STAGE_POWER);
    const double *effort = kmp_eval_effort(eval, t, q, qd);
    for (int i = 0; effort && i < eval->n; i++)
        power += effort[i] * qd[i];
    return power;
}

double kmp_eval_power_here(kmp_evaluator *eval, const double *qd)
{
    if (eval->weighs_only && !eval->by_bodies)
        return kmp_eval_power(eval, eval->t, eval->q, qd);
    const kmp_program *program = kmp_eval_program(eval, eval->by_bodies);
    double power = program->stages > KMP_STAGE_WORKING ? *run_stage(eval, eval->motion, KMP_STAGE_WORKING) : 0;
    for (int i = 0; eval->system->force && i < eval->n; i++)
        power += eval->effort[i] * qd[i];
    return power;
}

const double *kmp_eval_reactions(kmp_evaluator *eval, double t, const double *q, const double *lambda)
{
    (void)kmp_eval_potential(eval, t, q);
    kmp_machine_set(eval->judge, KMP_IN_LAMBDA, lambda);
    (void)run_stage(eval, eval->judge, KMP_STAGE_POWER);
    return run_stage(eval, eval->judge, KMP_STAGE_REACTION);
}

const double *kmp_eval_shown(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda)
{
    eval_follow_conditions(eval, &t, q, qd);
    kmp_machine_set(eval->judge, KMP_IN_QD, qd);
    kmp_machine_set(eval->judge, KMP_IN_QDD, qdd);
    (void)kmp_eval_reactions(eval, t, q, lambda);
    (void)run_stage(eval, eval->judge, KMP_STAGE_POSITION);
    return run_stage(eval, eval->judge, KMP_STAGE_SHOWN);
}

/* Evaluates all values that are constant during steps. */
static void evaluate_constants(kmp_evaluator *eval)
{
    kmp_machine *machines[] = {eval->composite, eval->articulated, eval->judge, eval->changes};
    eval_set_all(eval, KMP_IN_CHART, eval->chart);
    for (size_t k = 0; k < sizeof machines / sizeof *machines; k++)
        if (machines[k])
            (void)run_stage(eval, machines[k], KMP_STAGE_PARAMETERS);
}

void kmp_eval_renew_parameters(kmp_evaluator *eval)
{
    eval_set_all(eval, KMP_IN_PARAMETER, eval->system->parameters);
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
    eval_set_all(eval, KMP_IN_PARAMETER, eval->system->parameters);
    eval_set_all(eval, KMP_IN_MODE, eval->mode);
    evaluate_constants(eval);
}

/* Makes the machines, the arrays, and the values that are constant during steps. Programs that are rarely evaluated use
 * the tape, which needs no compilation. False: no memory. */

static bool make_machines(kmp_evaluator *eval, kmp_eval_use use)
{
    const kempe_system *s = eval->system;
    const kmp_backend *seldom = kmp_backend_find("tape"), *waiting = kmp_backend_waiting(eval->backend);
    bool follows = s->changes && (!eval->closes_only || s->switches);
    const kmp_program *program = eval->closes_only ? s->closing : kmp_eval_program(eval, false);
    eval->motion = eval->composite = kmp_machine_new(program, use == KMP_EVAL_STEPS ? eval->backend : waiting);
    if (!eval->closes_only)
        eval->judge = kmp_machine_new(s->judge, s->dissipative ? waiting : seldom);
    if (follows)
        eval->changes = kmp_machine_new(s->changes, use == KMP_EVAL_STEPS ? waiting : seldom);
    bool made = eval->motion && (eval->closes_only || eval->judge) && (eval->changes || !follows);
    eval->validity = kmp_validity_marks_new(s, &eval->arena);
    eval->state_ends = kmp_state_ends_new(s, &eval->arena);
    KMP_ARENA_MAKE(&eval->arena, KMP_ROOM(bool, eval->m, &eval->dropped),
                   KMP_ROOM(double, eval->system->events.count, &eval->mode),
                   KMP_ROOM(int, eval->changes ? eval->system->events.count : 0, &eval->late),
                   KMP_ROOM(double, KMP_CHART_SIZE * eval->system->chart_count, &eval->chart),
                   KMP_ROOM(double, eval->n, &eval->q, &eval->with_force, &eval->effort));
    if (eval->weighs_only || eval->by_products)
        eval->by_mass = KMP_ARENA_NEW(&eval->arena, double, eval->n + eval->m);
    if (eval->system->load_row_count > 0) {
        eval->nu = KMP_ARENA_NEW(&eval->arena, double, eval->m);
        eval->load = kmp_load_work_new(eval->system, &eval->arena);
    }
    if (!kmp_present_inputs_init(&eval->inputs, &eval->arena, eval->system->model) || eval->arena.failed || !made)
        return false;
    if (eval->nu)
        eval_set_all(eval, KMP_IN_LAMBDA, eval->nu);
    /* Late conditions have separate outputs, in their order. */
    for (int k = 0; eval->changes && k < s->events.count; k++)
        if (s->events.condition[k].late)
            eval->late[eval->late_count++] = k;
    kmp_charts_reset(eval->system, eval->chart);
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
        *eval = (kmp_evaluator){
            .system = system, .shared = *b, .closes_only = use == KMP_EVAL_CLOSES, .n = system->n, .m = system->m};
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
    if (!s->bodies->program || eval->articulated)
        return KEMPE_OK;
    eval->articulated = kmp_machine_new(s->bodies->program, eval->backend);
    KMP_TRY(kmp_made(s->context, eval->articulated));
    kmp_machine_set(eval->articulated, KMP_IN_EFFORT, eval->effort); /* zero, or set before use */
    if (!eval->kept)
        eval->kept = KMP_ARENA_NEW(&eval->arena, double, eval->m);
    KMP_TRY(kmp_made(s->context, eval->kept));
    for (int r = 0; r < eval->m; r++)
        eval->kept[r] = 1;
    kmp_machine_set(eval->articulated, KMP_IN_KEPT, eval->kept);
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
    eval->by_bodies = by_bodies && eval->articulated;
    eval->motion = eval->by_bodies ? eval->articulated : eval->composite;
    eval->mass = eval->bias = eval->jdqd = NULL;
    eval->pivots = eval->diagonals = eval->qdd = eval->multipliers = NULL;
}

void kmp_eval_free(kmp_evaluator *eval)
{
    if (!eval)
        return;
    kmp_machine_free(eval->composite);
    kmp_machine_free(eval->articulated);
    kmp_machine_free(eval->judge);
    kmp_machine_free(eval->changes);
    kmp_arena_free(&eval->arena);
    kmp_free(eval);
}

void kmp_eval_closure(kmp_evaluator *eval, double t, const double *q)
{
    eval_follow_conditions(eval, &t, q, NULL);
    kmp_machine_set(eval->motion, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->motion, KMP_IN_Q, q);
    eval->h = run_stage(eval, eval->motion, KMP_STAGE_CLOSURE);
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
    const double *out = run_stage(eval, eval->motion, KMP_STAGE_MASS);
    if (eval->by_bodies) {
        eval->pivots = out;
        eval->diagonals = out + eval->m;
    } else if (!eval->by_products) {
        eval->mass = out;
    }
}

void kmp_eval_keep_rows(kmp_evaluator *eval, const int *position)
{
    bool same = true;
    for (int r = 0; r < eval->m; r++) {
        const double kept = position[r] >= 0 ? 1 : 0;
        same = same && kept == eval->kept[r];
        eval->kept[r] = kept;
    }
    if (same)
        return;
    kmp_machine_set(eval->articulated, KMP_IN_KEPT, eval->kept);
    if (eval->pivots)
        kmp_eval_mass(eval);
    if (eval->qdd)
        (void)run_stage(eval, eval->motion, KMP_STAGE_BIAS);
}

const double *kmp_eval_open(kmp_evaluator *eval)
{
    return eval->by_bodies && eval->qdd ? run_stage(eval, eval->articulated, KMP_STAGE_OPEN) : NULL;
}

const double *kmp_eval_correction(kmp_evaluator *eval, const double *violation)
{
    kmp_machine_set(eval->articulated, KMP_IN_MU, violation);
    return run_stage(eval, eval->articulated, KMP_STAGE_CORRECT);
}

/* Adds generalized forces outside the program to C. */
static void add_outer_forces(kmp_evaluator *eval)
{
    const double *effort = eval->system->force ? eval->effort : NULL;
    eval->bias = eval->own_bias;
    if (!effort && !eval->given)
        return;
    for (int i = 0; i < eval->n; i++)
        eval->with_force[i] = eval->own_bias[i] - (effort ? effort[i] : 0) - (eval->given ? eval->given[i] : 0);
    eval->bias = eval->with_force;
}

void kmp_eval_set_effort(kmp_evaluator *eval, const double *effort)
{
    eval->given = effort;
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
    eval->own_bias = run_stage(eval, eval->motion, KMP_STAGE_LOAD);
    eval->load_jacobian = eval->own_bias + eval->n;
}

/* Finds C and jdqd by M from the accelerations a0 without closure forces by articulated bodies, of which no row is
 * kept: M a0 + C = 0. */
static void find_bias(kmp_evaluator *eval, const double *qd)
{
    kmp_machine *m = eval->articulated; /* which the caller has added */
    double *bias = eval->by_mass, *jdqd = bias + eval->n;
    memset(jdqd, 0, (size_t)eval->m * sizeof *jdqd); /* no row is kept */
    kmp_machine_set(m, KMP_IN_KEPT, jdqd);
    kmp_machine_set(m, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, eval->t));
    kmp_machine_set(m, KMP_IN_Q, eval->q);
    kmp_machine_set(m, KMP_IN_QD, qd);
    for (int i = 0; i < eval->n; i++) {
        bias[i] = 0;
        eval->with_force[i] = 0;
    }
    kmp_machine_set(m, KMP_IN_EFFORT, eval->with_force);
    for (int stage = KMP_STAGE_CLOSURE; stage < KMP_STAGE_BIAS; stage++)
        (void)run_stage(eval, m, stage);
    const double *free_qdd = run_stage(eval, m, KMP_STAGE_BIAS);
    const double *open = run_stage(eval, m, KMP_STAGE_OPEN);
    kmp_machine_set(m, KMP_IN_EFFORT, eval->effort);
    kmp_machine_set(m, KMP_IN_KEPT, eval->kept);
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
    eval_follow_conditions(eval, NULL, NULL, qd);
    kmp_machine_set(eval->motion, KMP_IN_QD, qd);
    (void)kmp_eval_effort(eval, eval->t, eval->q, qd);
    if (eval->by_bodies) {
        /* Accelerations and multipliers by the recursion, with efforts outside the program; `effort` is zero, or of the
         * user-defined force. */
        for (int i = 0; eval->given && i < eval->n; i++)
            eval->with_force[i] = eval->effort[i] + eval->given[i];
        if (eval->given || eval->gave || eval->system->force)
            kmp_machine_set(eval->motion, KMP_IN_EFFORT, eval->given ? eval->with_force : eval->effort);
        eval->gave = eval->given;
        eval->qdd = run_stage(eval, eval->motion, KMP_STAGE_BIAS);
        eval->multipliers = eval->qdd + eval->n;
    } else if (eval->weighs_only) {
        find_bias(eval, qd);
    } else {
        eval->own_bias = run_stage(eval, eval->motion, KMP_STAGE_BIAS);
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
    kmp_system_effort(eval->system, t, q, qd, eval->effort);
    return eval->effort;
}
