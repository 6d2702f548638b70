/* SPDX-License-Identifier: BSD-3-Clause */
/* The recursive Newton/Euler scheme of Fisette and Samin 1996, implicit and semi-explicit. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** An applied wrench on each link (F_ext and its moment about the link's origin, link axes). */
typedef struct kmp_wrench {
    kmp_vec force, moment;
} kmp_wrench;

/** Its component along the link's joint. */
static inline kmp_ref *kmp_wrench_along(const kmp_link *link, kmp_wrench *w)
{
    return link->rotation ? &w->moment.x[link->axis] : &w->force.x[link->axis];
}

/** The component along the link's motion, signed like q. */
kmp_ref kmp_wrench_project(const kmp_link *link, kmp_wrench *w);

/** The wrench about the origin that accelerates the composite body of link i along its own motion. */
kmp_wrench kmp_unit_wrench(const kmp_tree *tree, int i, const kmp_composite *c);

/** Motion of a link: omega, omega dot, beta = omega dot~ + omega~ omega~ (13), alpha = acceleration - g (10) of its
 *  origin. */
typedef struct kmp_link_motion {
    kmp_vec w, wd, alpha;
    kmp_matrix beta;
} kmp_link_motion;

/** The joint forces that give the accelerations qdd[k] (motion k; all zero: the bias C): eqs. (11)-(14), (25), (27),
 * and (18)-(21), (31)-(33), (37). applied[link] for every link. Signed like q. Here and below the graph
 * fails when there is no memory. */
void kmp_newton_euler(const kmp_tree *tree, const kmp_ref *qdd, const kmp_wrench *applied, kmp_ref *effort);

/** Inverse dynamics as kmp_newton_euler, with the movement of every link and the wrench about its origin that moves its
 * subtree: both arrays of tree->count. */
void kmp_newton_euler_whole(const kmp_tree *tree, const kmp_ref *qdd, const kmp_wrench *applied, kmp_link_motion *m,
                            kmp_wrench *w, kmp_ref *effort);

/** The wrench about the origin of the link of a flexible body that accelerates a part of its mass, where the link moves
 * by m: loads that act only on the part are not included. */
kmp_wrench kmp_newton_euler_part(const kmp_tree *tree, const kmp_deformation *part, const kmp_ref *qdd,
                                 const kmp_link_motion *m);

/** Each link's own share of (25) and (27) with the coordinates at rest in their rates (qdd = 0), about its origin, and
 * the inertial forces on coordinates of flexible bodies then (n, zero for others). */
void kmp_newton_euler_shares(const kmp_tree *tree, const kmp_wrench *applied, kmp_wrench *share, kmp_ref *elastic);

/** Adds link i's wrench about its origin to its parent's: the sums of (25) and (27). */
void kmp_wrench_to_parent(const kmp_tree *tree, int i, kmp_wrench w, kmp_wrench *parent);

/** The kinetic energy of all bodies link by link: a number of operations in proportion to the links, where qd' M qd / 2
 * takes the number of the entries of M. */
kmp_ref kmp_kinetic_energy(const kmp_tree *tree);

/** M[i, k] for k <= i as m[i * n + k]; entries off the tree are zero. */
typedef void kmp_mass_scheme(const kmp_tree *tree, kmp_ref *m);

/** Column by column as the paper: eqs. (22), (23), (34)-(36), (38). */
kmp_mass_scheme kmp_mass_ner;

/** M x by one sweep outwards and one inwards, (22) and (34)-(38) with x in place of a unit acceleration: a number of
 * operations in proportion to the links. */
void kmp_mass_times(const kmp_tree *tree, const kmp_ref *x, kmp_ref *out);

/** Mass matrix with composite bodies: the sums over the subtree in (35), (36) made once. Equal values from half the
 * operations.
 */
kmp_mass_scheme kmp_mass_composite;

/** Link i's composite in the axes of its parent about where the joint is at rest there; added to its parent's. */
kmp_composite kmp_composite_at_joint(const kmp_tree *tree, int i, kmp_composite c);
void kmp_composite_to_parent(const kmp_tree *tree, int i, kmp_composite c, kmp_composite *parent);
