/* SPDX-License-Identifier: BSD-3-Clause */
/* A force by a function is the force by an expression: to 1e-12 on the formulations that know it exactly, or to a few
 * times what the last bit of it makes in the run, since operations may come in another order; to the error of the run
 * on the dae formulation. */
#include "four_bar.h"
#include <float.h>
#include <kempe/extend.h>
#include <kempe/stepper.h>
#include <kempe/workspace.h>
#include <stdlib.h>
#include <string.h>

static int torque(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)t, (void)q;
    ++*(long *)user;
    effort[0] += 0.2 - 0.01 * qd[0];
    return 0;
}

/* Equal but for the last bits. */
static int other_torque(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user, (void)t, (void)q;
    effort[0] += (0.2 - 0.01 * qd[0]) * (1 + DBL_EPSILON);
    return 0;
}

static kempe_trajectory *run(const kempe_context *context, const kempe_system *system, const char *formulation,
                             const char *form)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options settings = {0};
    settings.formulation = formulation;
    settings.form = form;
    settings.integrator = strcmp(formulation, "dae") != 0 ? "dop853" : "ida"; /* functions have no lanes */
    settings.t_end = 1;
    settings.rtol = 1e-11;
    kempe_status status = kempe_simulate(system, &settings, &trajectory);
    CHECK(status == KEMPE_OK);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    return trajectory;
}

/* Largest difference over all rows. */
static double difference(const kempe_trajectory *a, const kempe_trajectory *b)
{
    double worst = 0;
    CHECK(kempe_trajectory_row_count(a) == kempe_trajectory_row_count(b));
    for (int k = 0; k < kempe_trajectory_row_count(a); k++)
        for (int i = 0; i < 3; i++) {
            worst = check_max(worst, fabs(kempe_trajectory_q(a, k)[i] - kempe_trajectory_q(b, k)[i]));
            worst = check_max(worst, fabs(kempe_trajectory_qd(a, k)[i] - kempe_trajectory_qd(b, k)[i]) / 20);
            worst = check_max(worst, fabs(kempe_trajectory_qdd(a, k)[i] - kempe_trajectory_qdd(b, k)[i]) / 400);
        }
    return worst;
}

static void same_as_expression(const char *formulation, const char *form, double tolerance)
{
    kempe_context *context = kempe_context_new();
    kempe_model *said = four_bar_new(context, FOUR_BAR_TORQUE), *bare = four_bar_new(context, NULL);
    kempe_system *by_expression = NULL, *by_function = NULL;
    long calls = 0;
    CHECK(kempe_system_new(said, &by_expression) == KEMPE_OK);
    CHECK(kempe_system_new(bare, &by_function) == KEMPE_OK);
    kempe_system_set_force(by_function, torque, &calls);
    kempe_trajectory *a = run(context, by_expression, formulation, form),
                     *b = run(context, by_function, formulation, form);
    CHECK(calls > 100);
    kempe_system_set_force(by_function, other_torque, NULL);
    kempe_trajectory *c = run(context, by_function, formulation, form);
    if (a && b && c) {
        double off = difference(a, b), bits = difference(b, c);
        CHECK(bits < 1e-11);
        CHECK_NEAR(off, 0, fmax(tolerance, 4 * bits));
    }
    kempe_trajectory_free(a);
    kempe_trajectory_free(b);
    kempe_trajectory_free(c);
    kempe_system_free(by_expression);
    kempe_system_free(by_function);
    kempe_model_free(said);
    kempe_model_free(bare);
    kempe_context_free(context);
}

static void carried(void)
{
    same_as_expression("reduced", "integrated", 1e-12);
}

static void closed(void)
{
    same_as_expression("reduced", "newton", 1e-12);
}

static void projected(void)
{
    same_as_expression("projected", NULL, 1e-12);
}

/* Steps, Newton iterations and the end of a dae run. */
static kempe_work implicit_run(const kempe_system *system, const char *formulation, const char *form,
                               const char *integrator, double rtol, double q[3])
{
    kempe_stepper *stepper = NULL;
    kempe_work work = {0};
    kempe_run_options settings = {0};
    settings.formulation = formulation;
    settings.form = form;
    settings.integrator = integrator;
    settings.rtol = rtol;
    settings.t_end = 1;
    CHECK(kempe_stepper_new(system, &settings, &stepper) == KEMPE_OK);
    if (!stepper)
        return work;
    CHECK(kempe_stepper_advance(stepper, 1) == KEMPE_OK);
    work = kempe_stepper_work(stepper);
    memcpy(q, kempe_stepper_q(stepper), 3 * sizeof *q);
    kempe_stepper_free(stepper);
    return work;
}

/* Iteration matrices have the force by differences: as many steps and iterations, the same error. Rounding alone moves
 * the steps of one run by a twentieth: those at some tolerances are added up. */
static void implicit(const char *formulation, const char *form, const char *integrator)
{
    kempe_context *context = kempe_context_new();
    kempe_model *said = four_bar_new(context, FOUR_BAR_TORQUE), *bare = four_bar_new(context, NULL);
    kempe_system *by_expression = NULL, *by_function = NULL;
    double a[3] = {0}, b[3] = {0};
    long calls = 0;
    CHECK(kempe_system_new(said, &by_expression) == KEMPE_OK);
    CHECK(kempe_system_new(bare, &by_function) == KEMPE_OK);
    kempe_system_set_force(by_function, torque, &calls);
    kempe_trajectory *exact = run(context, by_expression, "projected", NULL);
    long steps[2] = {0, 0}, newton[2] = {0, 0};
    for (int k = 7; k >= 0; k--) {
        double rtol = 1e-9 * (1 + 0.1 * k);
        kempe_work x = implicit_run(by_expression, formulation, form, integrator, rtol, a);
        kempe_work y = implicit_run(by_function, formulation, form, integrator, rtol, b);
        steps[0] += x.steps;
        steps[1] += y.steps;
        newton[0] += x.newton;
        newton[1] += y.newton;
    }
    CHECK(labs(steps[0] - steps[1]) <= steps[0] / 25 && labs(newton[0] - newton[1]) <= newton[0] / 25);
    for (int i = 0; i < 3 && exact; i++) {
        const double *q = kempe_trajectory_q(exact, kempe_trajectory_row_count(exact) - 1);
        CHECK(fabs(a[i] - q[i]) < 1e-5);
        CHECK(fabs(b[i] - q[i]) < 1e-5);
    }
    kempe_trajectory_free(exact);
    kempe_system_free(by_expression);
    kempe_system_free(by_function);
    kempe_model_free(said);
    kempe_model_free(bare);
    kempe_context_free(context);
}

static void dae_stabilized1(void)
{
    implicit("dae", "stabilized1", "ida");
}

static void dae_ggl(void)
{
    implicit("dae", "ggl", "ida");
}

static void dae_index1(void)
{
    implicit("dae", "index1", "ida");
}

static void reduced_bdf(void)
{
    implicit("reduced", "newton", "bdf");
}

/* A force that says no makes the start impossible, in words. */
static int refuse(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user, (void)t, (void)q, (void)qd, (void)effort;
    return 1;
}

static void refused(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_new(context, NULL);
    kempe_system *system = NULL;
    kempe_workspace *ws = NULL;
    kempe_trajectory *run = NULL;
    const double q[3] = {0};
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    kempe_system_set_force(system, refuse, NULL);
    CHECK(kempe_workspace_new(system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_evaluate(ws, 0, q, NULL) == KEMPE_E_FAILED);
    CHECK(kempe_simulate(system, NULL, &run) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(context), "the force function that was set for the system failed") != NULL);
    kempe_trajectory_free(run);
    kempe_system_set_force(system, NULL, NULL);
    CHECK(kempe_workspace_evaluate(ws, 0, q, NULL) == KEMPE_OK);
    kempe_workspace_free(ws);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(carried);
    TEST(closed);
    TEST(projected);
    TEST(dae_stabilized1);
    TEST(dae_ggl);
    TEST(dae_index1);
    TEST(reduced_bdf);
    TEST(refused);
    return check_report();
}
