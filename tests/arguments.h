/* SPDX-License-Identifier: BSD-3-Clause */
/* Arguments for the calls of tests/arguments.py: an object of every type, made once, before the calls. A call has a
 * process of its own, and so a copy of each object. */
#ifndef KEMPE_TESTS_ARGUMENTS_H
#define KEMPE_TESTS_ARGUMENTS_H

#include <kempe/build.h>
#include <kempe/check.h>
#include <kempe/comfort.h>
#include <kempe/compare.h>
#include <kempe/derivatives.h>
#include <kempe/ensemble.h>
#include <kempe/ensemble_stepper.h>
#include <kempe/equilibrium.h>
#include <kempe/fit.h>
#include <kempe/flow.h>
#include <kempe/generate.h>
#include <kempe/gradient.h>
#include <kempe/inverse.h>
#include <kempe/kempe.h>
#include <kempe/kinematics.h>
#include <kempe/language_server.h>
#include <kempe/limit_cycles.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/optimize.h>
#include <kempe/output_handles.h>
#include <kempe/reduce.h>
#include <kempe/response.h>
#include <kempe/rolling_contact.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <kempe/table.h>
#include <kempe/vehicle.h>
#include <kempe/workbench.h>
#include <kempe/workspace.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static double some_doubles[4096];
static int some_ints[64];
static const char *const some_names[8] = {"crank", "base", "coupler", "rocker"}; /* then NULL */

static kempe_context *some_kempe_context(int open)
{
    (void)open;
    static kempe_context *context;
    return context ? context : (context = kempe_context_new());
}

static const void *made(const void *object, const char *what)
{
    if (!object)
        fprintf(stderr, "%s could not be made: %s\n", what, kempe_context_message(some_kempe_context(0)));
    return object ? object : (exit(3), NULL);
}

/* open: one that is under construction. */
static kempe_model *some_kempe_model(int open)
{
    static kempe_model *models[2];
    kempe_model **model = &models[open];
    if (!*model && open)
        (void)kempe_model_new(some_kempe_context(0), "open", model);
    else if (!*model)
        (void)kempe_model_read(some_kempe_context(0), KEMPE_ROOT "/examples/four_bar/four_bar.yaml", model);
    made(*model, "model");
    return *model;
}

typedef kempe_model manchester_model, oscillating_model;
typedef kempe_system manchester_system, oscillating_system;

/* A type with a function that makes one of a system, or of a model, and options. */
#define SOME(type, make, ...)                                                                                          \
    static type *some_##type(int open)                                                                                 \
    {                                                                                                                  \
        static type *object;                                                                                           \
        (void)open;                                                                                                    \
        if (!object)                                                                                                   \
            (void)make(__VA_ARGS__, &object);                                                                          \
        made(object, #type);                                                                                           \
        return object;                                                                                                 \
    }
/* A struct of zeros. */
#define ZERO(type)                                                                                                     \
    static type *some_##type(int open)                                                                                 \
    {                                                                                                                  \
        static type zero;                                                                                              \
        (void)open;                                                                                                    \
        return &zero;                                                                                                  \
    }

static const kempe_run_options short_run = {.t_end = 0.01, .output_step = 0.005, .no_convergence_check = 1};
static const kempe_run_options plain_run = {.t_end = 0.01};
static const kempe_compare_options short_compare = {
    .formulations = "reduced", .forms = "integrated", .integrators = "dop853,dopri5", .rtols = "1e-6", .t_end = 0.01};
static const kempe_kinematics_options turn = {.sweep = "crank=0:0.1", .points = 5};
static const kempe_sensitivity_options by_crank = {.parameters = "crank",
                                                   .run = &(kempe_run_options){.t_end = 0.01, .output_step = 0.005}};
static const kempe_fit_options of_motion = {
    .data = KEMPE_ROOT "/tests/models/turning_crank.csv", .parameters = "crank_mass:0.1:10", .most = 2};
static const kempe_optimum_options least_base = {
    .minimize = "q(rocker)", .parameters = "base:0.89:0.91", .most = 2, .run = &(kempe_run_options){.t_end = 0.01}};
static const kempe_response_options push = {.inputs = "effort(crank)", .outputs = "q(crank)"};
static const kempe_comfort_options shaken = {
    .vertical = "acceleration(rocker.C).y",
    .run = &(kempe_run_options){.t_end = 5, .output_step = 1, .no_convergence_check = 1}};
static const kempe_linearize_options push_start = {.inputs = "effort(crank)", .outputs = "q(crank)"};
static const kempe_inverse_options by_motor = {.actuators = "crank", .independent = "crank"};
static const kempe_modes_options from_start = {.at = "start"};
static const kempe_flow_options of_crank = {.variables = "crank", .outputs = "q(rocker)"};
static const double end_of_flow = 0.01;
static const kempe_gradient_options of_base = {.parameters = "base", .driven = "crank"};

static const kempe_reduce_options of_brick = {.interfaces = "root=x=0",
                                              .modes = 2,
                                              .units = "m kg s",
                                              .mass = KEMPE_ROOT "/tests/models/brick_mass.mtx",
                                              .nodes = KEMPE_ROOT "/tests/models/brick_nodes.txt"};
static const kempe_fmu_options sources_alone = {.no_binary = 1};
static const kempe_sample_options two_cranks = {.ranges = "crank=0.29:0.31", .count = 2};

SOME(kempe_system, kempe_system_new, some_kempe_model(0))
SOME(kempe_assembly, kempe_assembly_new, some_kempe_system(0))
SOME(kempe_check, kempe_check_new, some_kempe_system(0))
SOME(kempe_branches, kempe_branches_new, some_kempe_system(0), 1)
SOME(kempe_trajectory, kempe_simulate, some_kempe_system(0), &short_run)
SOME(kempe_stepper, kempe_stepper_new, some_kempe_system(0), &plain_run)
SOME(kempe_stepper_state, kempe_stepper_save, some_kempe_stepper(0))
SOME(kempe_outputs, kempe_outputs_new, some_kempe_system(0), "energy")
SOME(kempe_comparison, kempe_comparison_new, some_kempe_system(0), &short_compare)
SOME(kempe_kinematics, kempe_kinematics_new, some_kempe_system(0), &turn)
SOME(kempe_equilibrium, kempe_equilibrium_new, some_kempe_system(0), NULL)
SOME(kempe_inverse, kempe_inverse_new, some_kempe_system(0), &by_motor)
SOME(kempe_linearization, kempe_linearization_new, some_kempe_system(0), &push_start)
SOME(kempe_response, kempe_response_new, some_kempe_system(0), &push)
SOME(kempe_comfort, kempe_comfort_new, some_kempe_system(0), &shaken)
SOME(kempe_modes, kempe_modes_new, some_kempe_system(0), &from_start)
SOME(kempe_sensitivity, kempe_sensitivity_new, some_kempe_model(0), &by_crank)
SOME(kempe_fit, kempe_fit_new, some_kempe_model(0), &of_motion)
SOME(kempe_optimum, kempe_optimum_new, some_kempe_model(0), &least_base)
SOME(kempe_flow, kempe_flow_new, some_kempe_model(0), &of_crank, 1, &end_of_flow)
SOME(kempe_gradient, kempe_gradient_new, some_kempe_model(0), &of_base)
SOME(kempe_table, kempe_inverse_table, some_kempe_inverse(0), "rows")
SOME(kempe_workspace, kempe_workspace_new, some_kempe_system(0))
SOME(kempe_count, kempe_count_new, some_kempe_model(0), NULL)
SOME(kempe_code, kempe_code_new, some_kempe_model(0), NULL)
SOME(kempe_reduction, kempe_reduction_new, some_kempe_context(0), KEMPE_ROOT "/tests/models/brick.mtx", &of_brick)
SOME(kempe_fmu_export, kempe_fmu_export_new, some_kempe_model(0), &sources_alone)
SOME(kempe_values, kempe_values_sample, some_kempe_model(0), &two_cranks)
ZERO(kempe_run_options)
ZERO(kempe_sample_options)
ZERO(kempe_folder_options)
ZERO(kempe_ensemble_options)
ZERO(kempe_compare_options)
ZERO(kempe_generate_options)
ZERO(kempe_fmu_options)
ZERO(kempe_reduce_options)
ZERO(kempe_kinematics_options)
ZERO(kempe_equilibrium_options)
ZERO(kempe_inverse_options)
ZERO(kempe_linearize_options)
ZERO(kempe_response_options)
ZERO(kempe_comfort_options)
ZERO(kempe_modes_options)
ZERO(kempe_limit_cycles_options)
ZERO(kempe_sensitivity_options)
ZERO(kempe_flow_options)
ZERO(kempe_gradient_options)
ZERO(kempe_fit_options)
ZERO(kempe_optimum_options)
ZERO(kempe_contact_options)
ZERO(kempe_setting)
ZERO(kempe_touch)
ZERO(kempe_workspace_rows)
ZERO(kempe_workspace_derivatives)
ZERO(kempe_inverse_derivatives)
ZERO(kempe_closed_equations)
ZERO(kempe_step_derivatives)
ZERO(kempe_state_direction)
ZERO(kempe_state_gradient)
ZERO(kempe_forward_values)
ZERO(kempe_ellipse)
ZERO(kempe_kalker)
ZERO(kempe_creep)
ZERO(kempe_creep_force)
ZERO(kempe_conicity)
ZERO(kempe_body_def)
ZERO(kempe_joint_def)
ZERO(kempe_closure_def)
ZERO(kempe_force_def)
ZERO(kempe_shape_def)

SOME(kempe_language_server, kempe_language_server_new, some_kempe_context(0))
SOME(kempe_drag, kempe_drag_new, some_kempe_context(0), "model.yaml")
SOME(kempe_workbench, kempe_workbench_new, some_kempe_context(0), KEMPE_ROOT "/examples/four_bar/four_bar.yaml", NULL,
     "kempe", 0)
SOME(kempe_ensemble, kempe_ensemble_new, some_kempe_model(0), some_kempe_values(0))
SOME(kempe_ensemble_stepper, kempe_ensemble_stepper_new, some_kempe_model(0), &plain_run, 2, 0, "q")
SOME(kempe_ensemble_result, kempe_ensemble_run, some_kempe_ensemble(0), &plain_run, 0)

/* A result folder whose files have gone since it was opened. */
static kempe_folder *some_kempe_folder(int open)
{
    static kempe_folder *folder;
    char path[] = "/tmp/kempe-arguments-XXXXXX", command[64];
    (void)open;
    if (folder)
        return folder;
    made(mkdtemp(path), "a folder for results");
    (void)kempe_ensemble_run_folder(some_kempe_ensemble(0), &plain_run, 0, path, NULL, &folder);
    (void)snprintf(command, sizeof command, "rm -rf %s", path);
    return made(system(command) == 0 ? folder : NULL, "kempe_folder") ? folder : NULL;
}

static kempe_status new_statistics(const kempe_ensemble_result *batch, kempe_statistics **statistics)
{
    kempe_table *instances = NULL;
    kempe_status status = kempe_ensemble_result_table(batch, "instances", &instances);
    if (status == KEMPE_OK)
        status = kempe_statistics_new(instances, 0, statistics);
    kempe_table_free(instances);
    return status;
}

SOME(kempe_statistics, new_statistics, some_kempe_ensemble_result(0))

static const kempe_contact_options shift = {.sweep = "shift=0:1 mm:2"};
SOME(manchester_model, kempe_model_read, some_kempe_context(0), KEMPE_ROOT "/examples/manchester/manchester.yaml")
SOME(manchester_system, kempe_system_new, some_manchester_model(0))
SOME(oscillating_model, kempe_model_read, some_kempe_context(0), KEMPE_ROOT "/tests/models/bautin.yaml")
SOME(oscillating_system, kempe_system_new, some_oscillating_model(0))
static const kempe_limit_cycles_options few_cycles = {.sweep = "mu=-0.1:0.1:3", .most = 3};
SOME(kempe_limit_cycles, kempe_limit_cycles_new, some_oscillating_system(0), &few_cycles)
SOME(kempe_contacts, kempe_contacts_new, some_manchester_system(0), &shift)

typedef struct row {
    const char *name;
    int (*call)(void);
} row;

/* A process each: one that crashes, or does not refuse what it must, is told. */
static int call_all(const row *rows, size_t count)
{
    int bad = 0;
    for (size_t k = 0; k < count; k++) {
        int status = 0;
        fflush(NULL);
        pid_t child = fork();
        if (child == 0) {
            int good = rows[k].call();
            fflush(NULL);
            _exit(good ? 0 : 1);
        }
        if (child < 0 || waitpid(child, &status, 0) != child || status == 0)
            continue;
        bad++;
        printf("%s: %s %d\n", rows[k].name, WIFSIGNALED(status) ? "signal" : "not refused",
               WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
    }
    printf("%zu calls, %d bad\n", count, bad);
    return bad > 0;
}

#endif
