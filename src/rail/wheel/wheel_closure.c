/* SPDX-License-Identifier: BSD-3-Clause */
/* A rigid wheel on a rigid rail: h is the gap along the normal at the closest points; lambda is the normal force. */
#include "rail/wheel/wheel_closure.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "rail/wheel/patch.h"

static void residual(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    const kmp_wheel *wheel = &tree->model->wheels[closure->wheel];
    kmp_wheel_pose pose;
    kmp_patch patch;
    kmp_wheel_find(tree, wheel, &pose);
    kmp_wheel_touch(tree, wheel, &pose, &patch);
    h[0] = patch.gap;
}

static const kmp_part part = {1, 1, residual, kmp_part_effort, NULL};

const kmp_closure_of_wing kmp_wheel_closures[] = {{KMP_CLOSURE_wheel, {&part, &kmp_part_none}}, {0}};
