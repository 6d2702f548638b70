/* SPDX-License-Identifier: BSD-3-Clause */
/* The geometry of a pair of gear wheels, and the force between their teeth. All of it rests in the carrier, so that it
 * has numbers and parameters but no coordinates. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/gear.h"

/** In the axes of the carrier, from the origin of its link. */
typedef struct kmp_gear_mesh {
    kmp_ref lever[2];                  /* path of each pitch point by its coordinate: m, or 1 of a rack */
    kmp_ref radius[2], distance;       /* pitch radii (a rack has none); between the axes */
    kmp_vec centre[2], axis[2], pitch; /* of the wheels; the pitch point */
    kmp_vec along;                     /* the direction into which the first wheel drives the second one */
    kmp_vec tilted, apart;             /* directions of the axial and the separating force on the second wheel */
    kmp_ref axial, separating;         /* these forces over the one along `along` */
} kmp_gear_mesh;

kmp_gear_mesh kmp_gear_mesh_of(const kmp_tree *tree, const kmp_closure *closure);

/** The path of the pitch point of a wheel (0 or 1) against the carrier, m, both counted in the direction into which the
 * first wheel drives the second one; of a worm the advance of its thread. */
kmp_ref kmp_gear_path(const kmp_tree *tree, const kmp_closure *closure, int side);

/** The path of the first wheel's pitch point less the path of the second one's, zero at the start: the transmission
 * error. */
kmp_ref kmp_gear_error(const kmp_tree *tree, const kmp_closure *closure);

/** The force along the path on the second wheel: the multiplier of the row, or the forces of both flanks. */
kmp_ref kmp_gear_transmitted(const kmp_tree *tree, int closure);

/** The force of a multiplier on the second wheel, and its place from the origin of a link that carries the carrier, in
 * the axes of that link. */
void kmp_gear_force(const kmp_tree *tree, const kmp_closure *closure, kmp_ref lambda, int link, kmp_vec *force,
                    kmp_vec *place);

/** Numbers of a mesh at the parameters of a model, in the axes of the carrier and from its origin. */
typedef struct kmp_gear_numbers {
    double radius[2], distance;
    double centre[2][3], axis[2][3], pitch[3], along[3];
    double force[3]; /* on the second wheel, of a force of 1 along `along` */
} kmp_gear_numbers;

/** False: no memory. */
bool kmp_gear_numbers_of(const kempe_model *model, const kmp_closure *closure, kmp_gear_numbers *numbers);
