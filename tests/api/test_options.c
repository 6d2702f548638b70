/* SPDX-License-Identifier: BSD-3-Clause */
/* Options of programs that were compiled against an older or a newer header: shorter structs, longer ones, wrong sizes.
 */
#include "testing.h"
#include <kempe/kinematics.h>
#include <kempe/sensitivity.h>
#include <stddef.h>

static kempe_context *context;
static kempe_model *model;
static kempe_system *system_;

static kempe_status simulate(const kempe_run_options *run)
{
    kempe_trajectory *trajectory = NULL;
    kempe_status status = kempe_simulate(system_, run, &trajectory);
    kempe_trajectory_free(trajectory);
    return status;
}

/* A member beyond the caller's size is not read, although it would be refused. */
static void older_programs(void)
{
    kempe_run_options run = {.t_end = 0.01, .no_convergence_check = 1, .threads = 1000};
    CHECK(simulate(&run) == KEMPE_E_ARGUMENT);
    run.size = sizeof run;
    CHECK(simulate(&run) == KEMPE_E_ARGUMENT);
    run.size = offsetof(kempe_run_options, threads);
    CHECK(simulate(&run) == KEMPE_OK);
    kempe_sensitivity *sensitivity = NULL;
    const kempe_sensitivity_options options = {
        .size = offsetof(kempe_sensitivity_options, run), .parameters = "crank", .outputs = "q(crank)", .run = &run};
    kempe_run_options wrong = {.resume = "rows.csv"};
    kempe_sensitivity_options refused = {.parameters = "crank", .run = &wrong};
    CHECK(kempe_sensitivity_new(model, &refused, &sensitivity) == KEMPE_E_ARGUMENT && !sensitivity);
    CHECK(kempe_sensitivity_new(model, &options, &sensitivity) == KEMPE_OK);
    kempe_sensitivity_free(sensitivity);
}

typedef struct longer {
    kempe_kinematics_options known;
    double added;
} longer;

/* Members that the library does not know must be zero. */
static void newer_programs(void)
{
    kempe_kinematics *sweep = NULL;
    longer options = {.known = {.size = sizeof options, .sweep = "crank=0:0.1", .points = 3}};
    CHECK(kempe_kinematics_new(system_, &options.known, &sweep) == KEMPE_OK);
    kempe_kinematics_free(sweep);
    sweep = NULL;
    options.added = 1;
    CHECK(kempe_kinematics_new(system_, &options.known, &sweep) == KEMPE_E_ARGUMENT && !sweep);
    CHECK(strstr(kempe_context_message(context), "does not know") != NULL);
}

static void wrong_sizes(void)
{
    const size_t sizes[] = {1, sizeof(size_t) - 1, (size_t)-1};
    for (int k = 0; k < 3; k++) {
        CHECK(simulate(&(kempe_run_options){.size = sizes[k], .t_end = 0.01}) == KEMPE_E_ARGUMENT);
        CHECK(strstr(kempe_context_message(context), "does not belong to any version of this struct") != NULL);
    }
}

int main(void)
{
    context = kempe_context_new();
    CHECK(kempe_model_read(context, KEMPE_ROOT "/examples/four_bar/four_bar.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system_) == KEMPE_OK);
    TEST(older_programs);
    TEST(newer_programs);
    TEST(wrong_sizes);
    kempe_system_free(system_);
    kempe_model_free(model);
    kempe_context_free(context);
    return check_report();
}
