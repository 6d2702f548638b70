/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* ctest: not_sanitized */
/* Values that are not evaluated twice: the power of forces comes with the forces and equals that of the judging
 * program; rows without rates, accelerations and multipliers are the rows with them. */
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/formulations/formulation.h"
#include "integrators/formulations/projected.h"
#include "integrators/run/methods.h"
#include "loaded.h"
#include "random.h"
#include "takes_bodies.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <kempe/kempe.h>
#include <stdbool.h>

enum { MOST = 64, STATES = 5 };

/* With dampers and bushings, friction, loads, closures that move, wheels that are elastic or rigid. */
static const char *const models[] = {
    "examples/limousine/limousine.yaml", "examples/suspension/suspension.yaml",
    "tests/models/bushings.yaml",        "tests/models/friction.yaml",
    "tests/models/braked.yaml",          "tests/models/guide_friction.yaml",
    "tests/models/friction_loop.yaml",   "examples/driven_slider_crank/driven_slider_crank.yaml",
    "examples/bogie/bogie.yaml",         "examples/rolling_wheel/rolling_wheel.yaml",
    "examples/curving/curving.yaml",
};

/* Efforts of the user. */
static int push(void *user, double t, const double *q, const double *qd, double *effort)
{
    int n = *(const int *)user;
    for (int i = 0; i < n; i++)
        effort[i] = 3 * cos(t) - 2 * qd[i] + q[i];
    return 0;
}

/* -- power ------------------------------------------------------------------------------------------- */

static void place(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    double nu[MOST] = {0};
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd);
    for (int k = 0; eval->nu && k < eval->system->load_row_count; k++)
        nu[eval->system->load_rows[k]] = between(-100, 100);
    if (eval->nu)
        kmp_eval_bias_with(eval, nu);
}

/* Parts of the largest power that any of the states has. */
static double power_apart(kmp_evaluator *eval, const kempe_assembly *at, bool by_bodies)
{
    double qd[MOST], worst = 0, most = 1e-300;
    random_seed(5);
    kmp_eval_set_by_bodies(eval, by_bodies);
    for (int k = 0; k < STATES; k++) {
        for (int i = 0; i < eval->n; i++)
            qd[i] = at->qd[i] + 0.1 * between(-1, 1);
        place(eval, 0.1 * k, at->q, qd);
        double power = kmp_eval_power_here(eval, qd), judged = kmp_eval_power(eval, 0.1 * k, at->q, qd);
        CHECK(isfinite(power) && isfinite(judged));
        worst = check_max(worst, fabs(power - judged));
        most = check_max(most, fabs(judged));
    }
    CHECK(most > 1e-300 || (eval->system->rheonomic && !eval->system->force)); /* drives do work by multipliers */
    return worst / most;
}

static void check_power(const char *name, kempe_system *system, bool pushed)
{
    kempe_assembly *at = NULL;
    int n = system->n;
    CHECK(n <= MOST && system->m <= MOST && system->dissipative);
    CHECK(kempe_assembly_new(system, &at) == KEMPE_OK);
    if (pushed)
        kempe_system_set_force(system, push, &n);
    const char *const backends[] = {"native", "tape"};
    for (int k = 0; at && k < 2; k++) {
        kmp_evaluator *eval = kmp_eval_new(system, backends[k]);
        CHECK(eval && kmp_eval_add_articulated(eval) == KEMPE_OK);
        double apart = power_apart(eval, at, false), bodies = eval->bodies.machine ? power_apart(eval, at, true) : 0;
        printf("  %s, %s: %.1e, %.1e\n", name, backends[k], apart, bodies);
        CHECK(apart < 1e-12 && bodies < 1e-12);
        kmp_eval_free(eval);
    }
    kempe_assembly_free(at);
}

static void power(void)
{
    for (size_t k = 0; k < sizeof models / sizeof *models; k++)
        for (int pushed = 0; pushed < 2; pushed++) {
            loaded l = load(models[k]);
            if (l.system)
                check_power(models[k], l.system, pushed);
            unload(&l);
        }
}

static void power_by_bodies(void)
{
    loaded l = load_text("kempe: 1\nname: chain\ngravity: [0, -9.81, 0]\nbodies:\n"
                         "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], points: {P: [1, 0, 0]}}\n"
                         "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [0.3, 0, 0]}\n"
                         "forces:\n"
                         "  d: {joint: b, spring: {stiffness: 3, damping: 0.4}}\n"
                         "  m: {joint: a, torque: \"if(q(a) > 0.1, -2*(q(a) - 0.1), 0)\"}\n"
                         "start: {q: {a: 0.3, b: 1}}\nrun: {algorithm: articulated}\n");
    CHECK(takes_bodies(l.system));
    if (l.system)
        check_power("chain", l.system, false);
    unload(&l);
}

/* A mechanism that is conservative has the programs it had. */
static void nothing_where_nothing_is_lost(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    CHECK(l.system && l.system->motion->stages == KMP_STAGE_BIAS + 1);
    unload(&l);
}

/* -- rows -------------------------------------------------------------------------------------------- */

static bool same(int count, const double *a, const double *b)
{
    return memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

/* Beside the closures, so that rows have something to close. */
static void check_rows(kmp_formulation *formulation, int n)
{
    double q[3][MOST], qd[2][MOST], qdd[MOST], lambda[MOST], work[3], y[4 * MOST];
    memcpy(y, formulation->y, (size_t)formulation->size * sizeof *y);
    for (int i = 0; i < n && i < formulation->size; i++)
        y[i] += 1e-6 * between(-1, 1);
    CHECK(formulation->row(formulation, 0, y, q[0], qd[0], qdd, lambda, &work[0]) == KMP_GO);
    CHECK(formulation->row(formulation, 0, y, q[1], qd[1], NULL, NULL, &work[1]) == KMP_GO);
    CHECK(formulation->row(formulation, 0, y, q[2], NULL, NULL, NULL, &work[2]) == KMP_GO);
    CHECK(same(n, q[0], q[1]) && same(n, q[0], q[2]) && same(n, qd[0], qd[1]));
    CHECK(work[0] == work[1] && work[0] == work[2]);
}

static void rows_on(const kmp_formulation_kind *kind, const kempe_system *system, const kempe_assembly *at)
{
    double zero[MOST] = {0};
    kmp_partition part;
    kmp_evaluator *eval = kmp_eval_new(system, "native");
    kmp_eval_closure(eval, 0, at->q);
    CHECK(kmp_partition_init(&part, system, eval->jacobian, NULL, 0) == KEMPE_OK);
    const kmp_formulation_start start = {.system = system,
                                         .eval = eval,
                                         .part = &part,
                                         .q = at->q,
                                         .qd = at->qd,
                                         .qdd = zero,
                                         .lambda = zero,
                                         .rtol = 1e-8,
                                         .atol = 1e-8,
                                         .rate_scale = 1};
    kmp_formulation *formulation = kind->create(kind, &start);
    CHECK(formulation && formulation->size <= 4 * MOST);
    if (formulation) {
        check_rows(formulation, system->n);
        formulation->release(formulation);
    }
    kmp_partition_free(&part);
    kmp_eval_free(eval);
}

static void rows(void)
{
    const char *const looped[] = {"examples/limousine/limousine.yaml", "examples/suspension/suspension.yaml",
                                  "tests/models/friction_loop.yaml"};
    for (size_t k = 0; k < sizeof looped / sizeof *looped; k++) {
        loaded l = load(looped[k]);
        kempe_assembly *at = NULL;
        CHECK(l.system && kempe_assembly_new(l.system, &at) == KEMPE_OK);
        for (int r = 0; at && kmp_formulation_get(r); r++)
            rows_on(kmp_formulation_get(r), l.system, at);
        if (at)
            rows_on(&kmp_formulation_near_singular, l.system, at);
        kempe_assembly_free(at);
        unload(&l);
    }
}

int main(void)
{
    TEST(power);
    TEST(power_by_bodies);
    TEST(nothing_where_nothing_is_lost);
    TEST(rows);
    return check_report();
}
