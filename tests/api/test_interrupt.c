/* SPDX-License-Identifier: BSD-3-Clause */
/* An interrupt ends one computation, the running one or the next, and no other. */
#include "loaded.h"
#include <kempe/compare.h>
#include <kempe/kempe.h>
#include <kempe/kinematics.h>
#include <kempe/sensitivity.h>
#include <kempe/stepper.h>

static kempe_status simulate(const loaded *s)
{
    kempe_run_options run = {.t_end = 0.1, .no_convergence_check = 1};
    kempe_trajectory *t = NULL;
    kempe_status status = kempe_simulate(s->system, &run, &t);
    CHECK_TEXT(kempe_trajectory_reason(t), status == KEMPE_OK ? "" : "interrupted");
    kempe_trajectory_free(t);
    return status;
}

static kempe_status compare(const loaded *s)
{
    kempe_compare_options run = {.t_end = 0.05, .formulations = "reduced", .rtols = "1e-6,1e-8"};
    kempe_comparison *c = NULL;
    kempe_status status = kempe_comparison_new(s->system, &run, &c);
    kempe_comparison_free(c);
    return status;
}

static kempe_status lead(const loaded *s)
{
    kempe_kinematics_options options = {.sweep = "crank=0:1", .points = 20};
    kempe_kinematics *k = NULL;
    kempe_status status = kempe_kinematics_new(s->system, &options, &k);
    kempe_kinematics_free(k);
    return status;
}

static kempe_status step(const loaded *s)
{
    kempe_run_options run = {.t_end = 0.1};
    kempe_stepper *stepper = NULL;
    CHECK(kempe_stepper_new(s->system, &run, &stepper) == KEMPE_OK);
    kempe_status status = kempe_stepper_advance(stepper, 0.05);
    kempe_stepper_free(stepper);
    return status;
}

static kempe_status differentiate(const loaded *s)
{
    kempe_sensitivity_options options = {.parameters = "crank", .run = &(kempe_run_options){.t_end = 0.05}};
    kempe_sensitivity *d = NULL;
    kempe_status status = kempe_sensitivity_new(s->model, &options, &d);
    kempe_sensitivity_free(d);
    return status;
}

static kempe_status (*const computations[])(const loaded *s) = {simulate, compare, lead, differentiate};
enum { COMPUTATIONS = sizeof computations / sizeof *computations };

static void one_computation_ends(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    for (int a = 0; a < COMPUTATIONS; a++)
        for (int b = 0; b < COMPUTATIONS; b++) {
            kempe_context_interrupt(s.context);
            kempe_context_interrupt(s.context);
            CHECK(computations[a](&s) == KEMPE_STOPPED);
            CHECK(computations[b](&s) == KEMPE_OK);
        }
    unload(&s);
}

static void each_has_its_own(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    for (int k = 0; k < 3; k++) {
        kempe_context_interrupt(s.context);
        CHECK(simulate(&s) == KEMPE_STOPPED);
    }
    CHECK(simulate(&s) == KEMPE_OK);
    unload(&s);
}

/* A stepper that is made takes the interrupt with its first step. */
static void steppers_too(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    CHECK(step(&s) == KEMPE_OK);
    kempe_run_options run = {.t_end = 0.1};
    kempe_stepper *stepper = NULL;
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    kempe_context_interrupt(s.context);
    CHECK(kempe_stepper_advance(stepper, 0.05) == KEMPE_STOPPED);
    CHECK_TEXT(kempe_stepper_reason(stepper), "interrupted");
    kempe_stepper_free(stepper);
    CHECK(simulate(&s) == KEMPE_OK && step(&s) == KEMPE_OK);
    unload(&s);
}

/* A request that is withdrawn ends nothing. */
static void withdrawn(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    kempe_context_clear_interrupt(s.context);
    for (int a = 0; a < COMPUTATIONS; a++) {
        kempe_context_interrupt(s.context);
        kempe_context_clear_interrupt(s.context);
        CHECK(computations[a](&s) == KEMPE_OK);
    }
    unload(&s);
}

int main(void)
{
    TEST(one_computation_ends);
    TEST(each_has_its_own);
    TEST(steppers_too);
    TEST(withdrawn);
    return check_report();
}
