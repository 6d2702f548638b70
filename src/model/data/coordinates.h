/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinates as users write them: "A", and lists, "A,slide.2". */
#pragma once

#include "base/arena.h"
#include "model/data/body.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>

/** The coordinate with the name in the first `length` characters of `name`, without spaces around it. KEMPE_E_ARGUMENT:
 * there is none; the message has the nearest name; `what` (an option's name) begins it. */
kempe_status kmp_coordinate_find(const kempe_model *model, const char *what, const char *name, size_t length,
                                 int *coordinate);

/** The coordinates of a list separated by commas, none twice, into room for all; `text` may be NULL: none. Errors as
 * kmp_coordinate_find. */
kempe_status kmp_coordinates_read(const kempe_model *model, const char *what, const char *text, int *list, int *count);

/** Coordinate k of a joint between two points by its chain of motions (model/data/joints.def), whose axes a, b and c
 * are the columns of m in the axes of either point: a rotation in (-pi, pi], where it is not a sum of coordinates. As
 * the expression `q(name)`; NULL: no memory. */
const kmp_expr *kmp_cut_coordinate_of(kmp_arena *arena, const char *name, const char *chain, int k, double m[3][3],
                                      const kmp_measure_argument end[2]);

/** The number of a coordinate by its name, or by JOINT.k, in model->cut_coordinates; -1: there is none. */
int kmp_cut_coordinate_find(const kempe_model *model, const char *name);

/* The load that a joint of the tree carries: force and moment that its motions leave undetermined. */

/** The motions of a joint's chain that are free: without the coordinates that are locked for its reaction. */
static inline int kmp_joint_first_free(const kmp_body *body)
{
    return body->first_motion + body->load_count;
}

static inline int kmp_joint_free_count(const kmp_body *body)
{
    return body->motion_count - body->load_count;
}

/** True for a coordinate that is locked for the reaction of its joint: no drive of a user. */
bool kmp_motion_is_for_load(const kempe_model *model, int motion);

/** The body that a joint of that name carries in the tree; -1: there is no such joint. */
int kmp_joint_find(const kempe_model *model, const char *name);

/** The reason why the load of a joint is not defined here, a clause that begins with "it"; NULL: it is. */
const char *kmp_joint_obstacle(const kempe_model *model, int body);
