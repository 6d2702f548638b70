/* SPDX-License-Identifier: BSD-3-Clause */
/* The plane in which two surfaces move and touch, from the normal of a plane or the plane of a profile. */
#include "model/data/touch_plane.h"
#include "model/data/angle_sum.h"

/* The plane of motion has the normal of a plane, and the curve of a profile. */
static bool may_be_across(const kmp_touch_side *side, int axis)
{
    return side->shape == KMP_TOUCH_PLANE ? axis != side->axis : side->shape == KMP_TOUCH_PROFILE ? axis == 2 : true;
}

int kmp_touch_plane(const kempe_model *model, const kmp_contact_pair *touch)
{
    const kmp_touch_side *side = touch->side;
    for (int k = 0; k < 3; k++) {
        int axis = (side[1].axis + k) % 3; /* that of a cylinder first */
        const kmp_measure_argument normal = {.point = side[1].point, .axis = axis};
        if (may_be_across(&side[1], axis) && kmp_moves_across(model, side[0].point, &normal))
            return axis;
    }
    return -1;
}
