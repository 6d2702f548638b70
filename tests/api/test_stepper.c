/* SPDX-License-Identifier: BSD-3-Clause */
/* A run under the caller's control is the run that kempe_simulate makes. */
#include "four_bar.h"

enum { N = 3, M = 2, ROWS = 40 };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} scene;

static scene scene_new(void)
{
    scene s = {0};
    s.context = kempe_context_new();
    s.model = four_bar_new(s.context, FOUR_BAR_TORQUE);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    return s;
}

static void scene_free(scene *s)
{
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static kempe_run settings(const char *road)
{
    kempe_run run = kempe_run_default();
    run.road = road;
    run.rtol = 1e-8;
    run.t_end = 1;
    run.every = 1.0 / ROWS;
    return run;
}

static void check_row(const kempe_stepper *stepper, const kempe_trajectory *trajectory, int row)
{
    const double *want[4] = {kempe_trajectory_q(trajectory, row), kempe_trajectory_qd(trajectory, row),
                             kempe_trajectory_qdd(trajectory, row), kempe_trajectory_lambda(trajectory, row)};
    const double *have[4] = {kempe_stepper_q(stepper), kempe_stepper_qd(stepper), kempe_stepper_qdd(stepper),
                             kempe_stepper_lambda(stepper)};
    for (int k = 0; k < 4; k++)
        CHECK(memcmp(have[k], want[k], (k < 3 ? N : M) * sizeof(double)) == 0);
}

static void same_as_simulate(const char *road)
{
    scene s = scene_new();
    kempe_trajectory *trajectory = NULL;
    kempe_stepper *stepper = NULL;
    kempe_run run = settings(road);
    CHECK(kempe_simulate(s.system, &run, &trajectory) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    CHECK(kempe_trajectory_row_count(trajectory) == ROWS + 1);
    for (int k = 0; k <= ROWS && stepper; k++) {
        double t = kempe_trajectory_time(trajectory, k);
        CHECK(kempe_stepper_advance(stepper, t) == KEMPE_OK);
        CHECK(kempe_stepper_t(stepper) == t);
        check_row(stepper, trajectory, k);
    }
    CHECK(kempe_stepper_work(stepper).steps > 10 && kempe_stepper_work(stepper).rhs > 100);
    CHECK_TEXT(kempe_stepper_reason(stepper), "");
    kempe_stepper_free(stepper);
    kempe_trajectory_free(trajectory);
    scene_free(&s);
}

static void reduced(void)
{
    same_as_simulate("reduced");
}

static void projected(void)
{
    same_as_simulate("projected");
}

static void dae(void)
{
    same_as_simulate("dae");
}

/* Steps end where the integrator's do, whatever is looked at between. */
static void single_steps(void)
{
    scene s = scene_new();
    kempe_stepper *a = NULL, *b = NULL;
    kempe_run run = settings(NULL);
    int steps = 0;
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &b) == KEMPE_OK);
    while (kempe_stepper_t(a) < run.t_end && steps < 10000) {
        double t = kempe_stepper_t(a);
        CHECK(kempe_stepper_step(a) == KEMPE_OK);
        CHECK(kempe_stepper_t(a) > t);
        CHECK(kempe_stepper_advance(b, t + 0.3 * (kempe_stepper_t(a) - t)) == KEMPE_OK);
        CHECK(kempe_stepper_step(b) == KEMPE_OK);
        CHECK(kempe_stepper_t(a) == kempe_stepper_t(b));
        CHECK(memcmp(kempe_stepper_q(a), kempe_stepper_q(b), N * sizeof(double)) == 0);
        steps++;
    }
    CHECK(kempe_stepper_work(a).steps == steps);
    CHECK(kempe_stepper_step(a) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_advance(a, 0.5) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_advance(a, 2) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_advance(a, NAN) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_t(a) == run.t_end);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    scene_free(&s);
}

static void refused(void)
{
    scene s = scene_new();
    kempe_stepper *stepper = NULL;
    kempe_run run = settings("reducd");
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_E_ARGUMENT && !stepper);
    CHECK(strlen(kempe_context_message(s.context)) > 0);
    scene_free(&s);
}

static void interrupted(void)
{
    scene s = scene_new();
    kempe_stepper *stepper = NULL;
    kempe_run run = settings(NULL);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    kempe_context_interrupt(s.context);
    CHECK(kempe_stepper_step(stepper) == KEMPE_STOPPED);
    CHECK_TEXT(kempe_stepper_reason(stepper), "interrupted");
    CHECK(kempe_stepper_t(stepper) > 0);
    kempe_stepper_free(stepper);
    scene_free(&s);
}

int main(void)
{
    TEST(reduced);
    TEST(projected);
    TEST(dae);
    TEST(single_steps);
    TEST(refused);
    TEST(interrupted);
    return check_report();
}
