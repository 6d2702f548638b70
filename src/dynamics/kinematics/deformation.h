/* SPDX-License-Identifier: BSD-3-Clause */
/* A flexible body in the graph: its fields of displacement, the moments of its deformed mass, and the motions of its
 * stations as functions of its coordinates. */
#pragma once

#include "dynamics/kinematics/vector.h"
#include "model/data/flexible.h"

struct kmp_tree;

/** The motion of a link that is a function of coordinates of a flexible body, s(q), in place of a coordinate. */
typedef struct kmp_guide {
    int first, count; /* motions of the coordinates */
    kmp_ref *slope;   /* ds/dq of each */
    kmp_ref curve;    /* qd' s_qq qd */
} kmp_guide;

/** With N fields z, of which the first n are coordinates; axes of the body. The rates of z are `slope` qd, their
 * accelerations slope qdd + curve. */
typedef struct kmp_deformation {
    int first, count, fields; /* motions of the coordinates; n; N */
    int innermost;         /* the link nearest to the ground that the coordinates move: the frame's, or a guided one */
    kmp_ref *slope;        /* N x n */
    kmp_ref *rate, *curve; /* N */
    kmp_vec *field;        /* N: int phi_k dm */
    kmp_matrix *moment;    /* N: int phi_k x' dm, x the place in the deformed body */
    kmp_matrix *by_field;  /* N x N: int phi_k phi_l' dm */
    kmp_composite whole;   /* mass, first and second moments of the deformed body about the body's origin */
    kmp_ref *stiffness, *damping; /* n x n */
} kmp_deformation;

/** In the room of the tree's graph; NULL: no memory, and the graph has failed. */
kmp_deformation *kmp_deformation_new(const struct kmp_tree *tree, const kmp_flexible *flexible, int innermost);

/** A number that moves with a flexible body's coordinates, sum_k linear_k q_k + q' more q / 2 times `sign`: its value
 * and rate, with the guide of a link that moves by it. False: it is constantly zero. */
bool kmp_guide_make(const struct kmp_tree *tree, const kmp_flexible *flexible, const kmp_number *linear,
                    const kmp_number *more, double sign, kmp_guide *guide, kmp_ref *value, kmp_ref *rate);

/** 1 less the square of the largest deflection of a flexible body over the part of its length up to which terms of
 * second order are right; and conditions of validity, which are violated where these margins are negative. */
kmp_ref kmp_flexible_margin(const struct kmp_tree *tree, const kmp_flexible *flexible);
/** The same of the rates of the joints between the ground and the body over kmp_flexible_fastest. */
kmp_ref kmp_flexible_rate_margin(const struct kmp_tree *tree, const kmp_flexible *flexible);
void kmp_flexible_watch(const struct kmp_tree *tree, const kmp_flexible *flexible);

/** Only of the deformation, in the axes of the body: sum rate_k phi_k dm; the angular momentum about the centre of
 * mass; twice the kinetic energy less the energy of the centre of mass. */
kmp_vec kmp_deformation_momentum(kmp_graph *g, const kmp_deformation *d);
kmp_vec kmp_deformation_spin(kmp_graph *g, const kmp_deformation *d);
kmp_ref kmp_deformation_energy(kmp_graph *g, const kmp_deformation *d);

/** The axial vector (y_32 - y_23, y_13 - y_31, y_21 - y_12). */
kmp_vec kmp_matrix_axial(kmp_graph *g, const kmp_matrix *y);
/** a + w b. */
kmp_matrix kmp_matrix_add(kmp_graph *g, kmp_matrix a, kmp_ref w, const kmp_matrix *b);
kmp_ref kmp_matrix_trace(kmp_graph *g, const kmp_matrix *y);
