/* SPDX-License-Identifier: BSD-3-Clause */
/* A follower on a cam as expressions: distance, normal, place of contact and curvature. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/cam.h"

/** Vectors are in the axes of link `frame`, the nearest common ancestor of both bodies. */
typedef struct kmp_cam_contact {
    int frame;
    kmp_ref gap;       /* m: on the profile the distance, with its derivatives, negative where they overlap */
    kmp_vec normal;    /* out of the cam: unit length on the profile */
    kmp_vec axis;      /* z of the cam */
    kmp_vec arm;       /* from the follower's point to the place of contact */
    kmp_ref curvature; /* of the profile there, 1/m, positive where it is convex */
} kmp_cam_contact;

/** `point`: of the cam, of the follower. `face`: the normal of a flat face, in the axes of the second point. */
void kmp_cam_contact_find(const kmp_tree *tree, const kmp_cam_follower *follower, const int point[2],
                          const double face[3], kmp_cam_contact *contact);

/** The force of an ideal follower by its multiplier, or its moment about the follower's point: on its body, in the axes
 * of the nearest common body. */
kmp_vec kmp_cam_load(const kmp_tree *tree, const kmp_closure *closure, kmp_ref lambda, bool moment);

/** The angle from the direction in which a coordinate moves the follower's point to the normal, about z of the cam. */
kmp_ref kmp_cam_pressure_angle(const kmp_tree *tree, const kmp_cam_contact *contact, int point, int motion);
