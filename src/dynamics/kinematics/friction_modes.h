/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction that sticks: a force f against the rate of a place (a coordinate, or an expression of coordinates), of
 * at most the static level while the rate is zero, and of the level while it slips. Both may depend on the direction:
 * -L+ where the rate is positive, L- where it is negative, within -S+ and S- at rest. Its mode is held during a step by
 * inputs of the roles of kmp_role. In slip f = -sense level. In stick it is the multiplier of a row of J, or, where
 * other rows imply that row, a given force. A run decides on modes (integrators/run/friction_run.h).
 *
 * Friction of a contact whose slip has two directions is two elements that slip and stick together: in slip each has
 * its share of the level, opposite to the direction of the slip, and the size of both forces is within the level.
 *
 * Rigid contacts: open or closed, by inputs of the roles of kmp_role, as friction that sticks. Open
 * (SENSE = 1) a contact is an event where its distance plus PLACE becomes negative. Closed by its row (HELD = 1) its
 * distance stays at PLACE, and a negative multiplier is the event. Closed by the rows of others it has a given force
 * (GIVEN). The force is not negative: friction between zero and infinity, against the distance. */
#pragma once

#include "dynamics/kinematics/friction_roles.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/force.h"

/** The number of the element's condition KMP_ROLE_SENSE, which the conditions of the other roles follow; -1: conditions
 * are evaluated in place, or there is no memory. */
int kmp_friction_find(const kmp_tree *tree, const kmp_force *force);

/** The input of a role; zero where kmp_friction_find gives none. */
kmp_ref kmp_friction_input(const kmp_tree *tree, const kmp_force *force, kmp_role role);

/** True if its place is an expression, not a coordinate. */
static inline bool kmp_friction_is_along(const kmp_force *force)
{
    return force->sliding || force->contact > 0;
}

/** The other component of slip in two directions. */
static inline const kmp_force *kmp_friction_twin(const kmp_force *force)
{
    return force->across == 1 ? force + 1 : force - 1;
}

/** False where no function of the coordinates has the rate, as of a sphere that rolls in space. Its place is zero. */
bool kmp_friction_has_place(const kmp_tree *tree, const kmp_force *force);

/** The place whose rate the friction opposes, and that rate. */
kmp_ref kmp_friction_place(const kmp_tree *tree, const kmp_force *force);
kmp_ref kmp_friction_rate(const kmp_tree *tree, const kmp_force *force);

/** The part of the rate by the motion of the coordinates, with which the friction has its power. A place that depends
 * on t, as on a belt, has another part: its power is of what moves the belt, and does not enter the mechanism. */
kmp_ref kmp_friction_own_rate(const kmp_tree *tree, const kmp_force *force);

/** The place, whose derivatives by q, or without one the rate, whose derivatives by qd are the generalized forces of 1
 * N of friction. Returns the kind of these inputs. */
kmp_input_kind kmp_friction_slopes_of(const kmp_tree *tree, const kmp_force *force, kmp_ref *of);

/** The displacement of the place since it was held, its input KMP_ROLE_PLACE: zero there, with the derivatives of the
 * place. A way around a cylinder starts again at each turn; its sine over one does not. */
kmp_ref kmp_friction_moved(const kmp_tree *tree, const kmp_force *force);

/** The level of the friction in slip, in its direction. */
kmp_ref kmp_friction_level(const kmp_tree *tree, const kmp_force *force);

/** The direction of slip: its input, or in place the sign of the rate. */
kmp_ref kmp_friction_sense(const kmp_tree *tree, const kmp_force *force);

/** The friction in every mode: of slip by its level, of stick by its multiplier, or as given. */
kmp_ref kmp_friction_force(const kmp_tree *tree, const kmp_force *force);

/** The force of a rigid contact in any mode, along the normal. */
kmp_ref kmp_touch_push(const kmp_tree *tree, const kmp_force *contact);

/** Either of them: the force of an element with modes. */
kmp_ref kmp_modes_force(const kmp_tree *tree, const kmp_force *force);

/** The value of a condition of friction or of a rigid contact. */
kmp_ref kmp_friction_value(const kmp_tree *tree, const kmp_condition *condition);
