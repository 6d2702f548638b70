/* SPDX-License-Identifier: BSD-3-Clause */
/* Masses on the axis of a rotation move as if they were fixed to its parent; so does the whole inertia of bodies
 * carried along a translation. Counted there they join the parent's own mass: the base parameters of identification
 * (Gautier and Khalil, IEEE Trans. Robotics and Automation 6, 1990; Niemeyer and Slotine, Int. J. Robotics Research 10,
 * 1991). */
#ifndef KMP_DYNAMICS_SHORTEN_REGROUP_H
#define KMP_DYNAMICS_SHORTEN_REGROUP_H

#include "dynamics/kinematics/kinematics.h"

/** The parts of a link's mass m, first moment b and inertia K about its origin that the parent receives; e is the
 * joint's axis. */
enum {
    KMP_GIVE_MASS = 1,    /* rotation: m at the origin */
    KMP_GIVE_MOMENT = 2,  /* rotation: the component of b along e, by masses on the axis */
    KMP_GIVE_INERTIA = 4, /* rotation: s (1 - e e'), of masses along the axis, s = K across it; translation: K */
    KMP_GIVE_ALL = 7
};

/** Applies `give` of each motion; links carried by the ground give nothing. The tree has axes that turn with their
 * links. Changes kmp_link.own alone, whose links use moments about their joints from then on. */
void kmp_regroup(kmp_tree *tree, const uint8_t *give);

/** Regroups composite bodies, changing kmp_link.base. The mass they receive is that of all carried bodies at the
 * joint's current position: it then moves with the parent, through a translation too. */
void kmp_lump(kmp_tree *tree, const uint8_t *give);

#endif
