/* SPDX-License-Identifier: BSD-3-Clause */
/* Rigid contacts: open or closed, by inputs of the roles of kmp_role, as friction that sticks (friction_modes.h). Open
 * (SENSE = 1) a contact is an event where its distance plus PLACE becomes negative. Closed by its row (HELD = 1) its
 * distance stays at PLACE, and a negative multiplier is the event. Closed by the rows of others it has a given force
 * (GIVEN). The force is not negative: friction between zero and infinity, against the distance. */
#pragma once

#include "dynamics/kinematics/friction_modes.h"

/** The force of a contact in any mode, along the normal. */
kmp_ref kmp_touch_push(const kmp_tree *tree, const kmp_force *contact);

/** The value of a contact's condition. */
kmp_ref kmp_touch_value(const kmp_tree *tree, const kmp_condition *condition);
