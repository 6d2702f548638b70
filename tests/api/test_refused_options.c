/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: analyses ensemble */
/* Options of a run that a study does not take are refused by their name. */
#include "loaded.h"
#include <kempe/ensemble.h>
#include <kempe/flow.h>
#include <kempe/sensitivity.h>
#include <kempe/stepper.h>

static void check_refused(const loaded *l, kempe_status status, const char *sentence)
{
    CHECK(status == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(l->context), sentence);
}

static void derivatives(void)
{
    const double t = 0.1;
    const kempe_run_options dae = {.formulation = "dae"}, threads = {.threads = 2};
    kempe_flow_options flow = {.variables = "crank", .outputs = "q(rocker)", .run = &dae};
    kempe_sensitivity_options sensitivity = {.parameters = "crank", .outputs = "q(rocker)", .run = &dae};
    kempe_flow *made = NULL;
    kempe_sensitivity *slopes = NULL;
    loaded l = load("examples/four_bar/four_bar.yaml");
    check_refused(&l, kempe_flow_new(l.model, &flow, 1, &t, &made),
                  "flows do not take the option 'formulation': leave it out");
    check_refused(&l, kempe_sensitivity_new(l.model, &sensitivity, &slopes),
                  "sensitivities do not take the option 'formulation': leave it out");
    flow.run = sensitivity.run = &threads;
    check_refused(&l, kempe_flow_new(l.model, &flow, 1, &t, &made),
                  "flows do not take the option 'threads': leave it out");
    sensitivity.of = "reactions";
    check_refused(&l, kempe_sensitivity_new(l.model, &sensitivity, &slopes),
                  "sensitivities of a state do not take the option 'threads': leave it out");
    CHECK(!made && !slopes);
    unload(&l);
}

static void runs(void)
{
    const double row[] = {0.3};
    const char *const names[] = {"crank"};
    const kempe_run_options rows = {.t_end = 0.1, .output_step = 0.01}, loads = {.t_end = 0.1, .loads = "least-norm"};
    kempe_stepper *stepper = NULL;
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_ensemble_result *batch = NULL;
    loaded l = load("examples/four_bar/four_bar.yaml");
    check_refused(&l, kempe_stepper_new(l.system, &rows, &stepper),
                  "steppers do not take the option 'output_step': leave it out");
    CHECK(kempe_values_new(l.model, 1, names, 1, row, &values) == KEMPE_OK);
    CHECK(kempe_ensemble_new(l.model, values, &ensemble) == KEMPE_OK);
    check_refused(&l, kempe_ensemble_run(ensemble, &loads, 0, &batch),
                  "ensembles do not take the option 'loads': leave it out");
    CHECK(!stepper && !batch);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    unload(&l);
}

int main(void)
{
    TEST(derivatives);
    TEST(runs);
    return check_report();
}
