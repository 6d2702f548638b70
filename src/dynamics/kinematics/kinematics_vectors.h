/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors, tensors and matrices from the axes of one link in the axes of another, the path between links, points and
 * rates. */
#pragma once

#include "dynamics/kinematics/link_tree.h"

/** Turns v by an angle about a link's axis, when the link rotates. */
void kmp_link_turn(const kmp_tree *tree, const kmp_link *link, kmp_ref angle, kmp_vec *v);

/** Components of v in the parent's axes, from link i's, and back. */
kmp_vec kmp_link_to_parent(const kmp_tree *tree, int i, kmp_vec v);
kmp_vec kmp_link_to_child(const kmp_tree *tree, int i, kmp_vec v);

/** Entry (row, column) of the constant rotation g of link i, charts included. */
kmp_ref kmp_link_axes(const kmp_tree *tree, int i, int row, int column);

/** Tensors and matrices in the parent's axes: R t R'. */
kmp_tensor kmp_link_tensor_to_parent(const kmp_tree *tree, int i, kmp_tensor t);
kmp_matrix kmp_link_matrix_to_parent(const kmp_tree *tree, int i, kmp_matrix m);

/** The displacement of a translation along its axis, link axes; zero for a rotation (z^i of the paper). */
kmp_vec kmp_link_slide(const kmp_tree *tree, int i);

/** v of an ancestor's axes in link's. */
kmp_vec kmp_from_ancestor(const kmp_tree *tree, int link, int ancestor, kmp_vec v);

/** The angular velocity of vectors fixed to a link relative to the axes of an ancestor, in those axes. The ancestor's
 * axes may be non-rotating. */
kmp_vec kmp_link_spin(const kmp_tree *tree, int link, int ancestor);

/** The angle about `axis`, in the axes of `frame`, by which a virtual displacement of a joint turns a link against an
 * ancestor; zero without one. Sums of joint angles lack it, and loads of joints are forces along it
 * (dynamics/joint_loads.c). */
kmp_ref kmp_virtual_turn(const kmp_tree *tree, int link, int ancestor, int frame, kmp_vec axis);

/** The inputs KMP_IN_TIME whose derivatives by t equations need, and these derivatives: of t, and of the inputs of
 * the model. There are kmp_tree_time_leaf_count of them. */
int kmp_tree_time_leaves(const kmp_tree *tree, kmp_ref *leaf, kmp_ref *direction);

/** Direction of derivatives by t at constant q and qd. NULL: no memory, and the graph has failed. */
struct kmp_derivative *kmp_partial_time_derivative(const kmp_tree *tree);

/** Direction of total time derivatives: q -> qd, t -> 1. NULL: no memory, and the graph has failed. */
struct kmp_derivative *kmp_time_derivative(const kmp_tree *tree);

/** Seeds of the first total derivative by time, with the first `count` inputs KMP_IN_ALONG as further coordinates,
 * whose rates are the inputs behind them. False: no memory. */
bool kmp_tree_seeds_along(const kmp_tree *tree, int count, kmp_time_seeds *seeds);

/** The total time derivative of x(q, t), and of a rate, with qd -> qdd. */
kmp_vec kmp_vec_rate(const kmp_tree *tree, kmp_vec x);
kmp_vec kmp_vec_acceleration(const kmp_tree *tree, kmp_vec rate);

/** A number for each coordinate, equal for consecutive rotations about parallel axes; -1 for translations. */
void kmp_tree_runs(const kmp_tree *tree, int *run);

/** Nearest common ancestor of two links. */
int kmp_tree_common(const kmp_tree *tree, int i, int j);

/** True when link a is an ancestor of link i or i itself. */
bool kmp_tree_is_above(const kmp_tree *tree, int a, int i);

/** Link that a point of the model is fixed to. */
int kmp_point_link(const kmp_tree *tree, int point);

/** A point's position from the link's origin, link axes. */
kmp_vec kmp_point_local(const kmp_tree *tree, int point);

/** A vector of a link, and a position from the link's origin, in the axes of an ancestor link and from its origin. */
kmp_vec kmp_link_direction(const kmp_tree *tree, int link, kmp_vec v, int ancestor);
kmp_vec kmp_link_position(const kmp_tree *tree, int link, kmp_vec local, int ancestor);

/** A point's position from the origin of its ancestor link, in that link's axes. */
kmp_vec kmp_point_position(const kmp_tree *tree, int point, int ancestor);

/** A constant vector of a point's own axes, in the axes of an ancestor link. */
kmp_vec kmp_point_direction(const kmp_tree *tree, int point, const double v[3], int ancestor);

/** A point's three axes as vectors in the axes of an ancestor link. */
void kmp_point_axes(const kmp_tree *tree, int point, int ancestor, kmp_vec axes[3]);

/** The nearest common link of two points; where they are on stations of one flexible body, the link of its frame, which
 * has the axes of the body. */
int kmp_point_frame(const kmp_tree *tree, int a, int b);

/** From point a to point b in the axes of their frame, which is stored in *frame. */
kmp_vec kmp_point_difference(const kmp_tree *tree, int a, int b, int *frame);
