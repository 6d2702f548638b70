/* SPDX-License-Identifier: BSD-3-Clause */
/* A four-bar built in code: a parallel crank, coupler and rocker of uniform bars in the plane, turning under gravity
 * and a torque on the crank. Shared by the tests of the public interface. */
#ifndef KEMPE_TESTS_FOUR_BAR_H
#define KEMPE_TESTS_FOUR_BAR_H

#include "testing.h"
#include <kempe/build.h>
#include <kempe/kempe.h>

#define FOUR_BAR_TORQUE "0.2 - 0.01*qd(A)"

/* One bar of a length (a parameter) along x of its own axes, with a point at its end. */
static void four_bar_add_bar(kempe_model *model, const char *name, const char *joint, const char *at,
                             const char *length, const char *com, const char *inertia, const char *end)
{
    const kempe_number zero = kempe_value(0);
    kempe_body_def bar = kempe_body_default(name);
    bar.joint = joint;
    bar.at = at;
    bar.mass = kempe_value(1);
    bar.com[0] = kempe_expression(com);
    bar.inertia[2] = kempe_expression(inertia);
    CHECK(kempe_model_add_body(model, &bar) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, name, end, kempe_expression(length), zero, zero) == KEMPE_OK);
}

/* Everything but kempe_model_finish. `torque` may be NULL: no motor. */
static kempe_model *four_bar_begin(kempe_context *context, const char *torque)
{
    const kempe_number zero = kempe_value(0);
    kempe_model *model = NULL;
    CHECK(kempe_model_new(context, "four_bar", &model) == KEMPE_OK);
    CHECK(kempe_model_set_gravity(model, zero, kempe_value(-9.81), zero) == KEMPE_OK);
    CHECK(kempe_model_add_parameter(model, "crank", kempe_value(0.3)) == KEMPE_OK);
    CHECK(kempe_model_add_parameter(model, "coupler", kempe_value(0.8)) == KEMPE_OK);
    CHECK(kempe_model_add_parameter(model, "rocker", kempe_value(0.7)) == KEMPE_OK);
    CHECK(kempe_model_add_parameter(model, "base", kempe_expression("3*crank")) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "ground", "D", kempe_expression("base"), zero, zero) == KEMPE_OK);
    four_bar_add_bar(model, "crank", "A", "ground", "crank", "crank/2", "crank^2/12", "B");
    four_bar_add_bar(model, "coupler", "B", "crank.B", "coupler", "coupler/2", "coupler^2/12", "C");
    four_bar_add_bar(model, "rocker", "D", "ground.D", "rocker", "rocker/2", "rocker^2/12", "C");

    kempe_closure_def loop = kempe_closure_default("C");
    loop.point[0] = "coupler.C";
    loop.point[1] = "rocker.C";
    CHECK(kempe_model_add_closure(model, &loop) == KEMPE_OK);
    if (torque) {
        kempe_force_def motor = kempe_force_default("motor");
        motor.joint = "A";
        motor.torque = torque;
        CHECK(kempe_model_add_force(model, &motor) == KEMPE_OK);
    }
    CHECK(kempe_model_set_q(model, "A", kempe_expression("pi/2"), 1) == KEMPE_OK);
    CHECK(kempe_model_set_q(model, "B", kempe_value(-1.08), 0) == KEMPE_OK);
    CHECK(kempe_model_set_q(model, "D", kempe_value(1.85), 0) == KEMPE_OK);
    CHECK(kempe_model_set_qd(model, "A", kempe_value(20)) == KEMPE_OK);
    return model;
}

static kempe_model *four_bar_new(kempe_context *context, const char *torque)
{
    kempe_model *model = four_bar_begin(context, torque);
    kempe_status status = kempe_model_finish(model);
    CHECK(status == KEMPE_OK);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    return model;
}

#endif
