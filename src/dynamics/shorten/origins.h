/* SPDX-License-Identifier: BSD-3-Clause */
/* A joint's origin may be anywhere along its axis, that of a translation anywhere at all: zeros of the data can be had
 * that way. Points, and thus all that a user sees, stay where they are. */
#ifndef KMP_DYNAMICS_SHORTEN_ORIGINS_H
#define KMP_DYNAMICS_SHORTEN_ORIGINS_H

#include "dynamics/kinematics/kinematics.h"

/** Where the origin goes, as far as the joint lets it. */
typedef enum kmp_origin {
    KMP_ORIGIN_KEPT,
    KMP_ORIGIN_PARENT, /* to its parent's */
    KMP_ORIGIN_MASS,   /* to the centre of mass */
    KMP_ORIGIN_CHILD,  /* to that of the first link that it carries */
    KMP_ORIGINS
} kmp_origin;

/** `origin` of each motion. The tree has axes that turn with their links, and inertias about centres of mass alone.
 *  Links are moved from the ground outwards, each where those before it let it. */
void kmp_move_origins(kmp_tree *tree, const uint8_t *origin);

#endif
