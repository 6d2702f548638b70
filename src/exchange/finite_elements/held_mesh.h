/* SPDX-License-Identifier: BSD-3-Clause */
/* A mesh whose interfaces are held: the displacements that remain, their stiffness factored, and their slowest modes.
 */
#pragma once

#include "exchange/finite_elements/interface_nodes.h"

typedef struct kmp_held_mesh kmp_held_mesh;

/** Factors the stiffness. KEMPE_E_INPUT: it is singular, or no node is left. */
kempe_status kmp_held_mesh_new(const kmp_finite_mesh *mesh, int count, const kmp_interface *interfaces,
                               kmp_held_mesh **held);
void kmp_held_mesh_free(kmp_held_mesh *held);

/** The library that has factored it. */
const char *kmp_held_mesh_library(const kmp_held_mesh *held);

/** The number of displacements that remain. */
int kmp_held_mesh_count(const kmp_held_mesh *held);

/** u: 3 node_count; displacements at interfaces are kept, the others follow from static equilibrium. */
kempe_status kmp_held_mesh_settle(kmp_held_mesh *held, double *u);

/** The `wanted` slowest modes K x = value M x, of unit mass: values ascend; mode k is x + 3 node_count k, in the arena.
 * KEMPE_E_INPUT: the held mesh moves without stiffness; KEMPE_E_FAILED: they do not converge; KEMPE_STOPPED. */
kempe_status kmp_held_mesh_modes(kmp_held_mesh *held, int wanted, double *values, double **x);

/** y = K u, of all displacements. */
void kmp_mesh_load(const kmp_finite_mesh *mesh, const double *u, double *y);
