/* SPDX-License-Identifier: BSD-3-Clause */
/* Rotated pairs. Every elementary rotation of the model goes through kmp_rotate, which remembers its results. A
 * rotation of a known result is a rotation of its source by the sum of the angles, so parallel axes and R R' = 1
 * collapse in O(1). The derivative of a rotated pair is found in the pair itself. */
#pragma once

#include "symbolic/graph.h"

typedef struct kmp_rotations kmp_rotations;

kmp_rotations *kmp_rotations_new(void);
void kmp_rotations_free(kmp_rotations *r);
/** NULL: no memory. */
kmp_rotations *kmp_rotations_copy(const kmp_rotations *r);
/** Makes r equal to an earlier copy of it. */
void kmp_rotations_assign(kmp_rotations *r, const kmp_rotations *copy);
bool kmp_rotations_failed(const kmp_rotations *r);

/** y, z <- y cos(angle) - z sin(angle), y sin(angle) + z cos(angle). */
void kmp_rotate(kmp_graph *g, kmp_ref angle, kmp_ref *y, kmp_ref *z);

/** a + b with the terms of both sums in one order, so that equal angles are one node. */
kmp_ref kmp_angle_add(kmp_graph *g, kmp_ref a, kmp_ref b);

/** When node `id` is a component of a rotated pair: (first, second) = Rot(angle) (y, z) with `first` = the node's
 *  positive reference. */
typedef struct kmp_pair {
    kmp_ref y, z, angle, second;
} kmp_pair;

bool kmp_rotated_pair(kmp_graph *g, uint32_t id, kmp_pair *pair);
