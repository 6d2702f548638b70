/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/evaluation/plant.h"
#include "base/memory.h"
#include "constraints/closing/charts.h"
#include "constraints/evaluation/pressing.h"
#include "constraints/rounding/rounding.h"
#include <math.h>
#include <string.h>

/* -- conditions -------------------------------------------------------------------------------------- */

/* Sets an input of all programs. */
static void set_all(kmp_plant *plant, kmp_input_kind kind, const double *values)
{
    kmp_machine *machines[] = {plant->composite, plant->articulated, plant->judge, plant->changes};
    for (size_t k = 0; k < sizeof machines / sizeof *machines; k++)
        if (machines[k])
            kmp_machine_set(machines[k], kind, values);
}

static void set_modes(kmp_plant *plant)
{
    set_all(plant, KMP_IN_MODE, plant->mode);
}

/* Updates the conditions to the state. Conditions may depend on conditions: each pass settles one level. */
static void follow(kmp_plant *plant)
{
    int count = plant->system->events.count;
    for (int pass = 0; pass <= count; pass++) {
        bool same = true;
        const double *change = kmp_machine_run(plant->changes, 1);
        for (int k = 0; k < count; k++) {
            const kmp_condition *condition = &plant->system->events.condition[k];
            double mode = change[k] < 0 && !condition->ends && !condition->kink ? 1 : 0;
            same = same && mode == plant->mode[k];
            plant->mode[k] = mode;
        }
        if (same)
            return;
        set_modes(plant);
    }
}

/* Takes new inputs of an evaluation; inputs that are NULL keep their last values. */
static void visit(kmp_plant *plant, const double *t, const double *q, const double *qd)
{
    if (!plant->changes || plant->frozen)
        return;
    if (t)
        kmp_machine_set(plant->changes, KMP_IN_TIME, t);
    if (q)
        kmp_machine_set(plant->changes, KMP_IN_Q, q);
    if (qd)
        kmp_machine_set(plant->changes, KMP_IN_QD, qd);
    follow(plant);
}

const double *kmp_plant_changes(kmp_plant *plant, double t, const double *q, const double *qd)
{
    if (!plant->changes)
        return NULL;
    kmp_machine_set(plant->changes, KMP_IN_TIME, &t);
    kmp_machine_set(plant->changes, KMP_IN_Q, q);
    kmp_machine_set(plant->changes, KMP_IN_QD, qd);
    return kmp_machine_run(plant->changes, 1);
}

void kmp_plant_all_changes(kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda, double *change)
{
    const kmp_events *events = &plant->system->events;
    const double *now = kmp_plant_changes(plant, t, q, qd), *late = NULL;
    for (int k = 0; k < events->count; k++)
        change[k] = now[k];
    for (int k = 0; k < events->count; k++) {
        if (!events->condition[k].late)
            continue;
        if (!late) {
            kmp_machine_set(plant->changes, KMP_IN_QDD, qdd);
            kmp_machine_set(plant->changes, KMP_IN_LAMBDA, lambda);
            late = kmp_machine_run(plant->changes, 2);
        }
        change[k] = *late++;
    }
    plant->solved[0] = now + events->count;
    plant->solved[1] = late;
}

void kmp_plant_freeze(kmp_plant *plant, double t, const double *q, const double *qd)
{
    plant->frozen = false;
    visit(plant, &t, q, qd);
    plant->frozen = true;
}

void kmp_plant_set_mode(kmp_plant *plant, int condition, bool holds)
{
    plant->mode[condition] = holds && !plant->system->events.condition[condition].kink ? 1 : 0;
    set_modes(plant);
}

void kmp_plant_set_kink(kmp_plant *plant, int condition, int side)
{
    plant->mode[condition] = side;
    set_modes(plant);
}

/* -- charts ------------------------------------------------------------------------------------------ */

/* Evaluates all values that are constant during steps. */
static void run_constants(kmp_plant *plant)
{
    kmp_machine *machines[] = {plant->composite, plant->articulated, plant->judge, plant->changes};
    set_all(plant, KMP_IN_CHART, plant->chart);
    for (size_t k = 0; k < sizeof machines / sizeof *machines; k++)
        if (machines[k])
            (void)kmp_machine_run(machines[k], KMP_STAGE_PARAMETERS);
}

void kmp_plant_renew_parameters(kmp_plant *plant)
{
    set_all(plant, KMP_IN_PARAMETER, plant->system->parameters);
    run_constants(plant);
}

void kmp_plant_set_charts(kmp_plant *plant, const double *chart)
{
    memmove(plant->chart, chart, (size_t)(KMP_CHART_SIZE * plant->system->chart_count) * sizeof *chart);
    plant->chart_version++;
    run_constants(plant);
}

/* -- making one -------------------------------------------------------------------------------------- */

/* Prepares the machines. Programs that are rarely evaluated use the tape, which needs no compilation. */
static bool prepare(kmp_plant *plant, const kmp_backend *backend)
{
    const kmp_backend *seldom = kmp_backend_find("tape");
    plant->motion = plant->composite = kmp_machine_new(plant->system->motion, backend);
    plant->judge = kmp_machine_new(plant->system->judge, plant->system->dissipative ? backend : seldom);
    if (plant->system->changes)
        plant->changes = kmp_machine_new(plant->system->changes, seldom);
    const kmp_arena_group groups[] = {{plant->n, {&plant->q, &plant->with_force, &plant->effort}},
                                      {plant->system->events.count, {&plant->mode}},
                                      {(ptrdiff_t)KMP_CHART_SIZE * plant->system->chart_count, {&plant->chart}},
                                      {plant->m, {plant->system->pressed_count > 0 ? &plant->nu : NULL}}};
    plant->dropped = KMP_ARENA_NEW(&plant->arena, bool, plant->m);
    if (!kmp_arena_make_groups(&plant->arena, sizeof groups / sizeof *groups, groups) || !plant->motion ||
        !plant->judge || (plant->system->changes && !plant->changes))
        return false;
    if (plant->nu) {
        plant->press = kmp_press_work_new(plant->system);
        if (!plant->press)
            return false;
        set_all(plant, KMP_IN_LAMBDA, plant->nu);
    }
    set_all(plant, KMP_IN_PARAMETER, plant->system->parameters);
    set_modes(plant);
    kmp_charts_reset(plant->system, plant->chart);
    run_constants(plant);
    return true;
}

kmp_plant *kmp_plant_new(const kempe_system *system, const char *backend)
{
    return kmp_plant_new_shared(system, backend, NULL);
}

kmp_plant *kmp_plant_new_shared(const kempe_system *system, const char *backend, kmp_team *team)
{
    const kmp_backend *b = kmp_backend_find(backend);
    if (!b) {
        (void)kmp_fail(system->context, KEMPE_E_ARGUMENT, "unknown back end '%s'; available: %s", backend,
                       kmp_backend_names());
        return NULL;
    }
    kmp_plant *plant = KMP_NEW(kmp_plant, 1);
    if (plant) {
        *plant = (kmp_plant){.system = system, .shared = *b, .n = system->n, .m = system->m};
        plant->shared.team = team;
        plant->backend = team ? &plant->shared : b;
    }
    if (!plant || !prepare(plant, plant->backend)) {
        kmp_plant_free(plant);
        (void)kmp_fail_memory(system->context);
        return NULL;
    }
    return plant;
}

kempe_status kmp_plant_add_articulated(kmp_plant *plant)
{
    const kempe_system *s = plant->system;
    if (!s->articulated || plant->articulated)
        return KEMPE_OK;
    plant->articulated = kmp_machine_new(s->articulated, plant->backend);
    if (!plant->articulated)
        return kmp_fail_memory(s->context);
    set_all(plant, KMP_IN_PARAMETER, s->parameters);
    set_modes(plant);
    kmp_machine_set(plant->articulated, KMP_IN_EFFORT, plant->effort); /* zero, or set before use */
    run_constants(plant);
    return KEMPE_OK;
}

/* Switches between the two machines. Values of the other one are no longer valid. */
void kmp_plant_take(kmp_plant *plant, bool by_bodies)
{
    plant->by_bodies = by_bodies && plant->articulated;
    plant->motion = plant->by_bodies ? plant->articulated : plant->composite;
    plant->mass = plant->bias = plant->jdqd = NULL;
    plant->compliance = plant->mobility = plant->free_qdd = plant->drift = NULL;
}

void kmp_plant_free(kmp_plant *plant)
{
    if (!plant)
        return;
    kmp_machine_free(plant->composite);
    kmp_machine_free(plant->articulated);
    kmp_machine_free(plant->judge);
    kmp_machine_free(plant->changes);
    kmp_arena_free(&plant->arena);
    kmp_press_work_free(plant->press);
    kmp_free(plant);
}

/* -- evaluation -------------------------------------------------------------------------------------- */

void kmp_plant_closure(kmp_plant *plant, double t, const double *q)
{
    visit(plant, &t, q, NULL);
    kmp_machine_set(plant->motion, KMP_IN_TIME, &t);
    kmp_machine_set(plant->motion, KMP_IN_Q, q);
    plant->h = kmp_machine_run(plant->motion, KMP_STAGE_CLOSURE);
    plant->jacobian = plant->h + plant->m;
    plant->h_t = plant->system->rheonomic ? plant->jacobian + plant->system->jacobian.count : NULL;
    plant->t = t;
    memmove(plant->q, q, (size_t)plant->n * sizeof *q);
}

void kmp_plant_lend_closure(kmp_plant *plant, double t, const double *q, const double *h, const double *jacobian,
                            const double *h_t)
{
    plant->h = h;
    plant->jacobian = jacobian;
    plant->h_t = h_t;
    plant->t = t;
    memmove(plant->q, q, (size_t)plant->n * sizeof *q);
}

void kmp_plant_mask(const kmp_plant *plant, const bool *left_out, double *masked)
{
    const kmp_pattern *j = &plant->system->jacobian;
    for (int e = 0; e < j->count; e++)
        masked[e] = left_out[j->row[e]] ? 0 : plant->jacobian[e];
}

void kmp_plant_mass(kmp_plant *plant)
{
    const double *out = kmp_machine_run(plant->motion, KMP_STAGE_MASS);
    if (plant->by_bodies) {
        plant->compliance = out;
        plant->mobility = out + plant->system->compliance.count;
    } else {
        plant->mass = out;
    }
}

/* Accelerations without closure forces, by the recursion; adds efforts outside the program. `effort` is zero, or that
 * of the user-defined force. */
static void accelerate_bodies(kmp_plant *plant)
{
    for (int i = 0; plant->given && i < plant->n; i++)
        plant->with_force[i] = plant->effort[i] + plant->given[i];
    if (plant->given || plant->gave || plant->system->force)
        kmp_machine_set(plant->motion, KMP_IN_EFFORT, plant->given ? plant->with_force : plant->effort);
    plant->gave = plant->given;
    plant->free_qdd = kmp_machine_run(plant->motion, KMP_STAGE_BIAS);
    plant->drift = plant->free_qdd + plant->n;
}

/* Adds generalized forces outside the program to C. */
static void add_efforts(kmp_plant *plant)
{
    const double *effort = plant->system->force ? plant->effort : NULL;
    plant->bias = plant->own_bias;
    if (!effort && !plant->given)
        return;
    for (int i = 0; i < plant->n; i++)
        plant->with_force[i] = plant->own_bias[i] - (effort ? effort[i] : 0) - (plant->given ? plant->given[i] : 0);
    plant->bias = plant->with_force;
}

void kmp_plant_give(kmp_plant *plant, const double *effort)
{
    plant->given = effort;
    if (!plant->by_bodies)
        add_efforts(plant);
}

/* Evaluates C with the present multipliers, after jdqd. */
static void run_pressed(kmp_plant *plant)
{
    kmp_machine_set(plant->motion, KMP_IN_LAMBDA, plant->nu);
    plant->own_bias = kmp_machine_run(plant->motion, KMP_STAGE_PRESSING);
    plant->pressing = plant->own_bias + plant->n;
}

/* Evaluates bias and jdqd of the machine by M and C. */
static void run_bias(kmp_plant *plant)
{
    plant->own_bias = kmp_machine_run(plant->motion, KMP_STAGE_BIAS);
    plant->jdqd = plant->nu ? plant->own_bias : plant->own_bias + plant->n;
    if (plant->nu)
        run_pressed(plant);
    add_efforts(plant);
}

void kmp_plant_bias_with(kmp_plant *plant, const double *nu)
{
    memmove(plant->nu, nu, (size_t)plant->m * sizeof *nu);
    run_pressed(plant);
    add_efforts(plant);
}

void kmp_plant_bias(kmp_plant *plant, const double *qd)
{
    visit(plant, NULL, NULL, qd);
    kmp_machine_set(plant->motion, KMP_IN_QD, qd);
    (void)kmp_plant_effort(plant, plant->t, plant->q, qd);
    if (plant->by_bodies)
        accelerate_bodies(plant);
    else
        run_bias(plant);
}

const double *kmp_plant_effort(kmp_plant *plant, double t, const double *q, const double *qd)
{
    if (!plant->system->force)
        return NULL;
    kmp_system_effort(plant->system, t, q, qd, plant->effort);
    return plant->effort;
}

void kmp_plant_dense_jacobian(const kmp_plant *plant, double *jacobian)
{
    const kmp_pattern *p = &plant->system->jacobian;
    memset(jacobian, 0, (size_t)(plant->m * plant->n) * sizeof *jacobian);
    for (int k = 0; k < p->count; k++)
        jacobian[p->row[k] + p->col[k] * plant->m] = plant->jacobian[k];
}

void kmp_plant_dense_mass(const kmp_plant *plant, double *mass)
{
    const kmp_pattern *p = &plant->system->mass;
    int n = plant->n;
    memset(mass, 0, (size_t)(n * n) * sizeof *mass);
    for (int k = 0; k < p->count; k++)
        mass[p->row[k] + p->col[k] * n] = mass[p->col[k] + p->row[k] * n] = plant->mass[k];
}

void kmp_plant_add_mass_times(const kmp_plant *plant, const double *x, double *out)
{
    const kmp_pattern *m = &plant->system->mass;
    for (int k = 0; k < m->count; k++) {
        int i = m->row[k], j = m->col[k];
        out[i] += plant->mass[k] * x[j];
        if (i != j)
            out[j] += plant->mass[k] * x[i];
    }
}

double kmp_plant_potential(kmp_plant *plant, double t, const double *q)
{
    visit(plant, &t, q, NULL);
    kmp_machine_set(plant->judge, KMP_IN_TIME, &t);
    kmp_machine_set(plant->judge, KMP_IN_Q, q);
    return *kmp_machine_run(plant->judge, KMP_STAGE_POTENTIAL);
}

/* Stages build on each other: the power's needs the potential's. The power uses the multipliers of the last C. */
double kmp_plant_power(kmp_plant *plant, double t, const double *q, const double *qd)
{
    visit(plant, &t, q, qd);
    (void)kmp_plant_potential(plant, t, q);
    kmp_machine_set(plant->judge, KMP_IN_QD, qd);
    if (plant->nu)
        kmp_machine_set(plant->judge, KMP_IN_LAMBDA, plant->nu);
    double power = *kmp_machine_run(plant->judge, KMP_STAGE_POWER);
    const double *effort = kmp_plant_effort(plant, t, q, qd);
    for (int i = 0; effort && i < plant->n; i++)
        power += effort[i] * qd[i];
    return power;
}

double kmp_plant_power_here(kmp_plant *plant, const double *qd)
{
    const kmp_program *program = plant->by_bodies ? plant->system->articulated : plant->system->motion;
    double power = program->stages > KMP_STAGE_WORKING ? *kmp_machine_run(plant->motion, KMP_STAGE_WORKING) : 0;
    for (int i = 0; plant->system->force && i < plant->n; i++)
        power += plant->effort[i] * qd[i];
    return power;
}

const double *kmp_plant_reactions(kmp_plant *plant, double t, const double *q, const double *lambda)
{
    (void)kmp_plant_potential(plant, t, q);
    kmp_machine_set(plant->judge, KMP_IN_LAMBDA, lambda);
    (void)kmp_machine_run(plant->judge, KMP_STAGE_POWER);
    return kmp_machine_run(plant->judge, KMP_STAGE_REACTION);
}

const double *kmp_plant_shown(kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                              const double *lambda)
{
    visit(plant, &t, q, qd);
    kmp_machine_set(plant->judge, KMP_IN_QD, qd);
    kmp_machine_set(plant->judge, KMP_IN_QDD, qdd);
    (void)kmp_plant_reactions(plant, t, q, lambda);
    (void)kmp_machine_run(plant->judge, KMP_STAGE_POSITION);
    return kmp_machine_run(plant->judge, KMP_STAGE_SHOWN);
}

double kmp_plant_drive_power(const kmp_plant *plant, const double *lambda)
{
    double power = 0;
    for (int r = 0; plant->h_t && r < plant->m; r++)
        power -= lambda[r] * plant->h_t[r];
    return power;
}

double kmp_plant_kinetic(const kmp_plant *plant, const double *qd)
{
    const kmp_pattern *p = &plant->system->mass;
    double sum = 0;
    for (int k = 0; k < p->count; k++)
        sum += plant->mass[k] * qd[p->row[k]] * qd[p->col[k]] * (p->row[k] == p->col[k] ? 0.5 : 1);
    return sum;
}

bool kmp_plant_counts(const kmp_plant *plant, int row)
{
    return !plant->dropped[row] && (!plant->left_out || !plant->left_out[row]);
}

void kmp_plant_drop(kmp_plant *plant, int count, const int *rows)
{
    if (!kmp_rounding_of(plant->system))
        return;
    memset(plant->dropped, 0, (size_t)plant->m * sizeof *plant->dropped);
    for (int k = 0; k < count; k++)
        plant->dropped[rows[k]] = true;
}

void kmp_plant_drop_widest(kmp_plant *plant)
{
    const kmp_rounding *rounding = kmp_rounding_of(plant->system);
    if (!rounding)
        return;
    memset(plant->dropped, 0, (size_t)plant->m * sizeof *plant->dropped);
    for (int k = rounding->rank; k < plant->m; k++) {
        int widest = -1;
        for (int r = 0; r < plant->m; r++)
            if (!plant->dropped[r] && (widest < 0 || kmp_plant_opening(plant, r) > kmp_plant_opening(plant, widest)))
                widest = r;
        plant->dropped[widest] = true;
    }
}

double kmp_plant_opening(const kmp_plant *plant, int row)
{
    return fabs(plant->h[row]) / plant->system->row_scale[row];
}

double kmp_plant_misfit(const kmp_plant *plant, int *row)
{
    double widest = 0;
    *row = -1;
    for (int r = 0; r < plant->m; r++)
        if (plant->dropped[r] && !(plant->left_out && plant->left_out[r]) && !(kmp_plant_opening(plant, r) <= widest)) {
            widest = kmp_plant_opening(plant, r);
            *row = r;
        }
    return widest;
}

double kmp_plant_residual(const kmp_plant *plant)
{
    double worst = 0;
    for (int r = 0; r < plant->m; r++) {
        double open = kmp_plant_counts(plant, r) ? kmp_plant_opening(plant, r) : 0;
        if (!(open <= worst))
            worst = isnan(open) ? INFINITY : open;
    }
    return worst;
}

void kmp_plant_rates(const kmp_plant *plant, const double *qd, double *rates)
{
    const kmp_pattern *p = &plant->system->jacobian;
    for (int r = 0; r < plant->m; r++)
        rates[r] = plant->h_t ? plant->h_t[r] : 0;
    for (int k = 0; k < p->count; k++)
        rates[p->row[k]] += plant->jacobian[k] * qd[p->col[k]];
}

double kmp_plant_rate_residual(const kmp_plant *plant, const double *qd)
{
    const kmp_pattern *p = &plant->system->jacobian;
    double worst = 0;
    for (int r = 0, k = 0; r < plant->m; r++) { /* entries are in row-major order */
        double rate = plant->h_t ? plant->h_t[r] : 0;
        for (; k < p->count && p->row[k] == r; k++)
            rate += plant->jacobian[k] * qd[p->col[k]];
        if (kmp_plant_counts(plant, r))
            worst = fmax(worst, fabs(rate) / plant->system->row_scale[r]);
    }
    return worst;
}
