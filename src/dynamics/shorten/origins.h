/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice of link origins: a rotation's origin may be anywhere along its axis, that of a translation anywhere. This
 * creates zeros of the data. Points, and thus all results, are unchanged. */
#ifndef KMP_DYNAMICS_SHORTEN_ORIGINS_H
#define KMP_DYNAMICS_SHORTEN_ORIGINS_H

#include "dynamics/kinematics/kinematics.h"

/** Targets of an origin, as far as the joint permits. */
typedef enum kmp_origin {
    KMP_ORIGIN_KEPT,
    KMP_ORIGIN_PARENT, /* to its parent's */
    KMP_ORIGIN_MASS,   /* to the centre of mass */
    KMP_ORIGIN_CHILD,  /* to that of the first link that it carries */
    KMP_ORIGINS
} kmp_origin;

/** Moves the origin of each motion to `origin`. The tree has axes that turn with their links, and inertias about
 * centres of mass alone. Links are processed from the ground outwards, each after those before it. */
void kmp_move_origins(kmp_tree *tree, const uint8_t *origin);

#endif
