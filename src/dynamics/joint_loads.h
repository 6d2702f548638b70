/* SPDX-License-Identifier: BSD-3-Clause */
/* The loads of sections of beams, which are of the part beyond the section in the same way, and the loads of joints of
 * the tree: force and moment on the body that a joint carries, only of its constraint. Efforts
 * along its motions, as of motors, springs and friction, are not among them. They follow from the accelerations and
 * the multipliers by virtual work: as if the body, with all that it carries, moved against its parent. */
#pragma once

#include "dynamics/equations.h"
#include "dynamics/formalisms/newton_euler.h"

typedef struct kmp_joint_loads kmp_joint_loads;

/** Sets tree->loads of the equations for the expressions of outputs, and takes them away. KEMPE_E_MEMORY. Nothing is
 * set where no output has one, unless `all` are wanted. */
kempe_status kmp_joint_loads_begin(kmp_equations *eq, bool all);
void kmp_joint_loads_end(kmp_equations *eq);

/** The force or the moment of the joint that carries a body, by tree->loads, in ground axes: on that body about the end
 * of the joint's chain; where the joint's second body is the parent on that one, about the beginning of the chain. */
kmp_vec kmp_joint_load(const kmp_tree *tree, int body, bool moment);

/** Force (N, V_y, V_z) and moment (M_x, M_y, M_z), by tree->loads, that the part of a beam beyond the section of a
 * point exerts on the rest of it: in the axes of the section, about the place of the axis there. N is positive in
 * tension. Loads at the station itself are beyond it. */
kmp_wrench kmp_section_load(const kmp_tree *tree, int point);

/** By these, the stress along x at the offset of a point, sigma = N/A - M_z y/I_z + M_y z/I_y. */
kmp_ref kmp_section_stress(const kmp_tree *tree, int point);

/** Torsion and bending moments of that section by its strain: (G J phi', -E Iy w'', E Iz v''). */
kmp_vec kmp_section_strained(const kmp_tree *tree, int point);
