/* SPDX-License-Identifier: BSD-3-Clause */
/* The loads of joints of the tree: force and moment on the body that a joint carries, of its constraint alone. Efforts
 * along its motions, as of motors, springs and friction, are not among them. They follow from the accelerations and
 * the multipliers by virtual work: as if the body, with all that it carries, moved against its parent. */
#pragma once

#include "dynamics/equations.h"

typedef struct kmp_joint_loads kmp_joint_loads;

/** Sets tree->loads of the equations for the expressions of outputs, and takes them away. KEMPE_E_MEMORY. Nothing is
 * set where no output has one, unless `all` are wanted. */
kempe_status kmp_joint_loads_begin(kmp_equations *eq, bool all);
/** KEMPE_E_INPUT where one is not known: the context names the joint and the element in its way. */
kempe_status kmp_joint_loads_end(kmp_equations *eq);

/** The force or the moment of the joint that carries a body, by tree->loads, in ground axes: on that body about the end
 * of the joint's chain; where the joint's second body is the parent on that one, about the beginning of the chain. */
kmp_vec kmp_joint_load(const kmp_tree *tree, int body, bool moment);
