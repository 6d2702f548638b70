/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of the equations near a state, where forces depend on multipliers: inverse dynamics there and back,
 * sensitivities of motions against differences, and what refuses. */
#include "analyses/derivatives/linearized.h"
#include "analyses/inverse/inverse_dynamics.h"
#include "analyses/sensitivity/sensitivity_study.h"
#include "constraints/closing/assemble.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <stdlib.h>

enum { MOST = 16 };

static const char *const carrier = "tests/models/guide_friction_carrier.yaml";

/* -- inverse dynamics -------------------------------------------------------------------------------- */

typedef struct efforts {
    int n;
    double of[MOST];
} efforts;

static int add_efforts(void *user, double t, const double *q, const double *qd, double *effort)
{
    const efforts *e = user;
    (void)t, (void)q, (void)qd;
    for (int i = 0; i < e->n; i++)
        effort[i] += e->of[i];
    return 0;
}

/* Efforts that give accelerations, given as the user's force, give them back, and the same multipliers. */
static void efforts_come_back(void)
{
    loaded s = load(carrier);
    kempe_assembly *a = NULL;
    kmp_inverse inverse;
    kmp_linear forward;
    efforts e = {.n = s.system->n};
    int actuator[2] = {0, 3};
    double qdd[MOST] = {0};
    kmp_evaluator *eval = kmp_eval_new(s.system, "tape");
    CHECK(kempe_assembly_new(s.system, &a) == KEMPE_OK);
    CHECK(kmp_inverse_init(&inverse, eval, 2, actuator, NULL) == KEMPE_OK);
    for (int i = 0; i < s.system->n; i++)
        qdd[i] = 0.4 - 0.3 * i;
    CHECK(kmp_inverse_at(&inverse, 0, a->q, a->qd, qdd) == KEMPE_OK);
    CHECK(inverse.residual < 1e-14 && inverse.unmet < 1e-12 * inverse.size);
    for (int j = 0; j < 2; j++)
        e.of[actuator[j]] = inverse.tau[j];
    kempe_system_set_force(s.system, add_efforts, &e);
    CHECK(kmp_linear_init(&forward, s.system, "tape") == KEMPE_OK);
    CHECK(kmp_linear_choose(&forward, 0, a->q, inverse.part.u, inverse.p) == KEMPE_OK);
    double ud[MOST];
    for (int k = 0; k < forward.p; k++)
        ud[k] = a->qd[forward.part.u[k]];
    CHECK(kmp_linear_at_motion(&forward, 0, a->q, ud) == KEMPE_OK);
    for (int k = 0; k < forward.p; k++)
        CHECK_NEAR(forward.qdd[forward.part.u[k]], qdd[forward.part.u[k]], 1e-10);
    for (int r = 0; r < forward.m; r++)
        CHECK_NEAR(forward.lambda[r], inverse.lambda[r], 1e-10);
    kmp_linear_free(&forward);
    kmp_inverse_free(&inverse);
    kmp_eval_free(eval);
    kempe_assembly_free(a);
    unload(&s);
}

/* -- sensitivities ----------------------------------------------------------------------------------- */

/* The last row of q with a parameter moved by so much. */
static void end_at(double by, double *q)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    char path[1024], set[64];
    const kempe_run_options options = {.rtol = 1e-11, .t_end = 0.5, .output_step = 0.25, .no_convergence_check = 1};
    (void)snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, carrier);
    (void)snprintf(set, sizeof set, "%.17g", 0.3 + by);
    const kempe_setting setting = {"r", set};
    CHECK(kempe_model_read_set(context, path, &setting, 1, &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_simulate(system, &options, &t) == KEMPE_OK);
    memcpy(q, kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1), 5 * sizeof *q);
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void sensitivities_are_differences(void)
{
    loaded s = load(carrier);
    static const char *const methods[] = {"forward", "adjoint"};
    kempe_sensitivity *found[2] = {NULL, NULL};
    double plus[MOST], minus[MOST], step = 1e-5;
    end_at(step, plus);
    end_at(-step, minus);
    for (int k = 0; k < 2; k++) {
        kempe_sensitivity_options options = {
            .parameters = "r",
            .outputs = "q",
            .method = methods[k],
            .run = &(kempe_run_options){.rtol = 1e-10, .t_end = 0.5, .output_step = 0.25}};
        CHECK(kempe_sensitivity_new(s.model, &options, &found[k]) == KEMPE_OK);
        for (int i = 0; found[k] && i < 5; i++)
            CHECK_NEAR(kmp_sensitivity_slope(found[k], found[k]->rows - 1, i, 0), (plus[i] - minus[i]) / (2 * step),
                       1e-5);
    }
    for (int i = 0; found[0] && found[1] && i < 5; i++) {
        const double slope = kmp_sensitivity_slope(found[0], found[0]->rows - 1, i, 0);
        CHECK_NEAR(kmp_sensitivity_slope(found[1], 0, i, 0), slope, 1e-8 * (1 + fabs(slope)));
    }
    for (int k = 0; k < 2; k++)
        kempe_sensitivity_free(found[k]);
    unload(&s);
}

static void others_refuse(void)
{
    loaded s = load(carrier);
    const kempe_sensitivity_options request = {.parameters = "r", .of = "modes", .at = "start"};
    kempe_sensitivity *slopes = NULL;
    CHECK(kempe_sensitivity_new(s.model, &request, &slopes) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(s.context), "depends on the multiplier of constraint equation 'guide.1'") ||
          strstr(kempe_context_message(s.context), "the start is not an equilibrium"));
    kempe_sensitivity_free(slopes);
    unload(&s);
}

int main(void)
{
    TEST(efforts_come_back);
    TEST(sensitivities_are_differences);
    TEST(others_refuse);
    return check_report();
}
