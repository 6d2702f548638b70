/* SPDX-License-Identifier: BSD-3-Clause */
/* Two bearings on one pin, which share the load of a revolute or cylindrical joint. */
#pragma once

#include "model/data/place.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef struct kmp_bearing_pair {
    const char *name;
    kmp_place place;
    const char *joint;
    int body;         /* of a joint of the tree: the body that it carries; otherwise 0 */
    int closure;      /* of a cut joint or a loop; otherwise -1 */
    kmp_number at[2]; /* m along the axis of the joint, from its point on the second body */
    double life[2];   /* exponents of the equivalent loads */
    int thrust;       /* the bearing that carries the load along the axis: 1 or 2; 0: there is none */
} kmp_bearing_pair;

enum { KMP_BEARING_VALUES = 7 }; /* the radial forces of both, in ground axes, and the force along the axis */

/** The rotation of a joint of the tree whose only other motion is along its axis; -1: it is another joint. */
int kmp_pin_motion(const kempe_model *model, int body);

/** True if such a joint slides along its axis. */
bool kmp_pin_slides(const kempe_model *model, const kmp_bearing_pair *pair);
