/* SPDX-License-Identifier: BSD-3-Clause */
/* The inertia of flexible bodies in the recursions of Newton and Euler and of composite bodies. */
#pragma once

#include "dynamics/formalisms/newton_euler.h"

/** Adds to the wrench of the body's link, which moves by m, what the accelerations qdd of all coordinates make of its
 * deformation, and to `effort` of its coordinates their inertial forces. */
void kmp_flexible_wrench(const kmp_tree *tree, const kmp_deformation *d, const kmp_ref *qdd, const kmp_link_motion *m,
                         kmp_wrench *w, kmp_ref *effort);

/** The same at rest, with the accelerations o and a of the link and its origin: of a column of M, or of M x. */
void kmp_flexible_column(const kmp_tree *tree, const kmp_deformation *d, const kmp_ref *qdd, kmp_vec o, kmp_vec a,
                         kmp_wrench *w, kmp_ref *effort);

/** Entries of M of the coordinates of the flexible body on link `frame`, with composite bodies c of all links. */
void kmp_flexible_mass(const kmp_tree *tree, int frame, const kmp_composite *c, kmp_ref *m);

/** The parts that the recursions by composite and by articulated bodies share, for the lower triangle of the inertia of
 * the coordinates (n x n) and, about a link's origin, the wrench that an acceleration of each needs: the body's own
 * part at its frame; the part of guided link i, where a unit acceleration of its motion needs `unit`. */
void kmp_flexible_own(const kmp_tree *tree, const kmp_deformation *d, kmp_wrench *column, kmp_ref *inertia);
void kmp_flexible_guide(const kmp_tree *tree, int i, const kmp_wrench *unit, kmp_wrench *column, kmp_ref *inertia);

/** The entries of motion k with the motion of link h, or with the coordinates that guide it, from the wrench that an
 * acceleration of k makes there. */
void kmp_mass_couple(const kmp_tree *tree, int h, int k, kmp_wrench *w, kmp_ref *m);
