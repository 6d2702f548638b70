/* SPDX-License-Identifier: BSD-3-Clause */
/* A force by a function is the force by an expression, on every road. */
#include "four_bar.h"

static int torque(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)t, (void)q;
    ++*(long *)user;
    effort[0] += 0.2 - 0.01 * qd[0];
    return 0;
}

static kempe_trajectory *run(const kempe_context *context, const kempe_system *system, const char *road,
                             const char *form)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run settings = kempe_run_default();
    settings.road = road;
    settings.form = form;
    settings.t_end = 1;
    settings.rtol = strcmp(road, "dae") == 0 ? 1e-9 : 1e-11;
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
            worst = fmax(worst, fabs(kempe_trajectory_q(a, k)[i] - kempe_trajectory_q(b, k)[i]));
            worst = fmax(worst, fabs(kempe_trajectory_qd(a, k)[i] - kempe_trajectory_qd(b, k)[i]) / 20);
            worst = fmax(worst, fabs(kempe_trajectory_qdd(a, k)[i] - kempe_trajectory_qdd(b, k)[i]) / 400);
        }
    return worst;
}

static void same_as_expression(const char *road, const char *form, double tolerance)
{
    kempe_context *context = kempe_context_new();
    kempe_model *said = four_bar_new(context, FOUR_BAR_TORQUE), *bare = four_bar_new(context, NULL);
    kempe_system *by_expression = NULL, *by_function = NULL;
    long calls = 0;
    CHECK(kempe_system_new(said, &by_expression) == KEMPE_OK);
    CHECK(kempe_system_new(bare, &by_function) == KEMPE_OK);
    kempe_system_set_force(by_function, torque, &calls);
    kempe_trajectory *a = run(context, by_expression, road, form), *b = run(context, by_function, road, form);
    CHECK(calls > 100);
    if (a && b) {
        double off = difference(a, b);
        CHECK_NEAR(off, 0, tolerance);
    }
    kempe_trajectory_free(a);
    kempe_trajectory_free(b);
    kempe_system_free(by_expression);
    kempe_system_free(by_function);
    kempe_model_free(said);
    kempe_model_free(bare);
    kempe_context_free(context);
}

static void carried(void)
{
    same_as_expression("reduced", "carried", 1e-12);
}

static void closed(void)
{
    same_as_expression("reduced", "closed", 1e-12);
}

static void projected(void)
{
    same_as_expression("projected", NULL, 1e-12);
}

int main(void)
{
    TEST(carried);
    TEST(closed);
    TEST(projected);
    return check_report();
}
