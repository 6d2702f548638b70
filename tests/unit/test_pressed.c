/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on what closures transmit. */
#include "dynamics/system.h"
#include "loaded.h"
#include <math.h>
#include <string.h>

/* A block that may turn and slide in the plane, held to an incline by two rollers. */
static const char block[] = "kempe: 1\n"
                            "name: block\n"
                            "gravity: [0, 0, -9.81]\n"
                            "ground: {points: {O: [0, 0, 0]}}\n"
                            "bodies:\n"
                            "  block: {joint: {planar: y, at: ground}, mass: 2, inertia: {yy: 0.1},\n"
                            "          points: {A: [-0.1, 0, -0.05], B: [0.1, 0, -0.05]}}\n"
                            "loops:\n"
                            "  A: {point_on_plane: [ground.O, block.A], axis: z}\n"
                            "  B: {point_on_plane: [ground.O, block.B], axis: z}\n"
                            "forces:\n"
                            "  rub: {at: block.A, force: [\"-0.3*abs(lambda(A))\", 0, 0]}\n"
                            "sensors: {load: lambda(A) + lambda(B.1)}\n"
                            "run: {t_end: 1, outputs: [sensor(load), lambda]}\n";

static void equations(void)
{
    loaded l = load_text(block);
    if (l.system) {
        CHECK(l.system->m == 2);
        CHECK(l.system->pressed_count == 1);
        CHECK(l.system->pressed[0] == 0);
        CHECK(l.system->pressing.count >= 1 && l.system->pressing.col[0] == 0);
        CHECK(l.system->motion->stages == KMP_STAGE_PRESSING + 1);
    }
    unload(&l);
}

static void absent_row(void)
{
    static const char text[] = "kempe: 1\n"
                               "bodies:\n"
                               "  a: {joint: {revolute: y, at: ground}, mass: 1, points: {P: [1, 0, 0]}}\n"
                               "  b: {joint: {revolute: y, at: ground}, mass: 1, points: {P: [1, 0, 0]}}\n"
                               "loops:\n"
                               "  close: {ball: [a.P, b.P]}\n"
                               "forces:\n"
                               "  f: {joint: a, torque: \"lambda(close.3)\"}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    CHECK(kempe_model_read_text(context, text, "model.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(context),
               "model.yaml:8:3: force 'f' depends on lambda(close.3), but 'close' has 2 multipliers: rows that no "
               "coordinate moves have none");
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(equations);
    TEST(absent_row);
    return check_report();
}
