/* SPDX-License-Identifier: BSD-3-Clause */
/* An ideal follower on a cam: h is the distance of its roller, edge or face from the profile, lambda the normal force,
 * positive where the cam pushes. */
#include "constraints/kinds/kind.h"
#include "dynamics/kinematics/cam_contact.h"

static void follower(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_cam_contact contact;
    kmp_cam_contact_find(tree, closure->cam, closure->point, closure->axis[1], &contact);
    h[0] = contact.gap;
}

static kmp_vec follower_force(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    return kmp_cam_load(tree, closure, lambda[0], false);
}

const kmp_part kmp_part_follower = {1, 1, follower, follower_force, NULL};
