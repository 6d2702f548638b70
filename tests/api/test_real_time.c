/* SPDX-License-Identifier: BSD-3-Clause */
/* Fixed steps under a sampled controller allocate nothing: every allocation of the process is counted here. The delta
 * robot moves on its motors, whose torques change with every step. */
#include "counted_memory.h"
#include "testing.h"
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <stdbool.h>
#include <stdlib.h>

enum { STEPS = 20000, ARMS = 3 };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_stepper *stepper;
} scene;

static scene scene_new(double fixed_step, const char *integrator, double rtol)
{
    scene s = {.context = kempe_context_new()};
    kempe_run_options options = {.size = sizeof options,
                                 .formulation = "projected",
                                 .integrator = integrator,
                                 .change_points = "ignore",
                                 .fixed_step = fixed_step,
                                 .rtol = rtol,
                                 .t_end = 100};
    if (kempe_model_read(s.context, KEMPE_ROOT "/examples/delta_robot/delta_robot.yaml", &s.model) != KEMPE_OK ||
        kempe_system_new(s.model, &s.system) != KEMPE_OK ||
        kempe_stepper_new(s.system, &options, &s.stepper) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    CHECK(s.stepper != NULL);
    return s;
}

static void scene_free(scene *s)
{
    kempe_stepper_free(s->stepper);
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

/* The arms are the last three coordinates. Springs hold them near their start, and a wave moves them. */
static bool step(scene *s, int k)
{
    const double *q = kempe_stepper_q(s->stepper), *qd = kempe_stepper_qd(s->stepper);
    double t = 1e-3 * k;
    for (int i = 0; i < ARMS; i++) {
        double wanted = 0.15 + 0.2 * sin(5 * t + i), torque = 200 * (wanted - q[3 + i]) - 10 * qd[3 + i] - 1.6;
        if (kempe_stepper_set_input(s->stepper, i, torque) != KEMPE_OK)
            return false;
    }
    return kempe_stepper_advance(s->stepper, 1e-3 * (k + 1)) == KEMPE_OK;
}

/* Every function that promises not to allocate. */
static bool look(scene *s, int k)
{
    const kempe_stepper *stepper = s->stepper;
    kempe_stepper_keep_inputs(s->stepper, k % 2);
    bool set = kempe_stepper_set_input_rates(s->stepper, k % ARMS, kempe_stepper_input(stepper, k % ARMS), 0.1, 0.2) ==
               KEMPE_OK;
    set = set && kempe_stepper_set_stop(s->stepper, kempe_stepper_time(stepper) + 10) == KEMPE_OK;
    kempe_work work = kempe_stepper_work(stepper);
    return set && work.steps == k + 1 && *kempe_stepper_reason(stepper) == '\0' &&
           isfinite(kempe_stepper_qdd(stepper)[0] + kempe_stepper_lambda(stepper)[0]);
}

static void nothing_is_allocated(void)
{
    static const char *const integrators[] = {"dopri5", "dop853"};
    for (int i = 0; i < 2; i++) {
        scene s = scene_new(1e-3, integrators[i], 1e-6);
        long before = allocations, steps = 0, most = 0;
        for (int k = 0; k < STEPS && s.stepper; k++) {
            long first = allocations;
            if (!step(&s, k) || !look(&s, k))
                break;
            most = allocations - first > most ? allocations - first : most;
            steps++;
        }
        long made = allocations - before;
        printf("  %s: %ld steps, %ld allocations, %ld in one step at most\n", integrators[i], steps, made, most);
        CHECK(steps == STEPS && made == 0);
        kempe_work work = kempe_stepper_work(s.stepper);
        CHECK(work.steps == STEPS && work.rejected == 0 && work.refused == 0);
        scene_free(&s);
    }
}

/* The count counts: reading a model allocates. */
static void allocations_are_counted(void)
{
    long before = allocations;
    scene s = scene_new(1e-3, "dopri5", 1e-6);
    CHECK(!counts || allocations - before > 100);
    scene_free(&s);
}

/* Fixed steps agree with steps chosen by the error: with 1 ms to the fifth order of dopri5. */
static void fixed_steps_are_accurate(void)
{
    scene a = scene_new(1e-3, "dopri5", 1e-6), b = scene_new(0, "dop853", 1e-12);
    double error = 0;
    for (int k = 0; k < 1000 && a.stepper && b.stepper; k++) {
        CHECK(step(&a, k) && step(&b, k));
        for (int i = 0; i < 6; i++)
            error = check_max(error, fabs(kempe_stepper_q(a.stepper)[i] - kempe_stepper_q(b.stepper)[i]));
    }
    printf("  largest error of 1000 fixed steps %.1e\n", error);
    CHECK(error < 1e-8);
    scene_free(&a);
    scene_free(&b);
}

/* Other integrators have no fixed steps, and say so. */
static void refused(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_stepper *stepper = NULL;
    kempe_run_options options = {.size = sizeof options, .integrator = "bdf", .fixed_step = 1e-3};
    CHECK(kempe_model_read(context, KEMPE_ROOT "/examples/delta_robot/delta_robot.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_stepper_new(system, &options, &stepper) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(context), "'bdf' cannot make steps of constant length") != NULL);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(allocations_are_counted);
    TEST(nothing_is_allocated);
    TEST(fixed_steps_are_accurate);
    TEST(refused);
    return check_report();
}
