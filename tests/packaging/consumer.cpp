/* SPDX-License-Identifier: BSD-3-Clause */
/* A consumer in C++: a pendulum built in code, swung for a second. */
#include <cmath>
#include <cstdio>
#include <kempe/build.h>
#include <kempe/kempe.h>

int main()
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = nullptr;
    kempe_system *system = nullptr;
    kempe_trajectory *trajectory = nullptr;
    kempe_run_options run = {0};
    kempe_body_def arm = kempe_body_default("arm");
    double q = NAN;
    arm.mass = kempe_value(1);
    arm.com[0] = kempe_value(1);
    run.t_end = 1;
    if (kempe_model_new(context, "pendulum", &model) == KEMPE_OK &&
        kempe_model_set_gravity(model, kempe_value(0), kempe_value(-9.81), kempe_value(0)) == KEMPE_OK &&
        kempe_model_add_body(model, &arm) == KEMPE_OK && kempe_model_finish(model) == KEMPE_OK &&
        kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &trajectory) == KEMPE_OK)
        q = kempe_trajectory_q(trajectory, kempe_trajectory_row_count(trajectory) - 1)[0];
    std::printf("%s: q(1 s) = %.12g rad %s\n", kempe_model_name(model), q, kempe_context_message(context));
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return q < -1 && q > -3.2 ? 0 : 1;
}
