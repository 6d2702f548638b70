/* SPDX-License-Identifier: BSD-3-Clause */
/* A rigid wheel on a rigid rail: h is the gap along the normal at the closest points; lambda is the normal force. */
#include "constraints/kinds/kind.h"
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

const kmp_part kmp_part_wheel = {1, 1, residual, kmp_part_effort, NULL};
