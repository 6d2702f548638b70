/* SPDX-License-Identifier: BSD-3-Clause */
/* The load that a joint of the tree carries: force and moment that its motions leave undetermined. */
#pragma once

#include "model/data/model.h"

/** The motions of a joint's chain that are free: without those that are locked for its reaction. */
static inline int kmp_joint_first_free(const kmp_body *body)
{
    return body->first_motion + body->load_count;
}

static inline int kmp_joint_free_count(const kmp_body *body)
{
    return body->motion_count - body->load_count;
}

/** The body that a joint of that name carries in the tree; -1: there is no such joint. */
int kmp_joint_find(const kempe_model *model, const char *name);

/** The reason why the load of a joint is not defined here, a clause that begins with "it"; NULL: it is. */
const char *kmp_joint_obstacle(const kempe_model *model, int body);
