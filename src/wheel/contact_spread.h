/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of an elastic wheel with its rail: averages over a zone. */
#pragma once

#include "wheel/pair.h"

typedef struct kmp_spread {
    kmp_ref s;       /* on the wheel's profile */
    kmp_ref slope;   /* of the rail */
    kmp_ref depth;   /* along the normal, m */
    kmp_ref across;  /* relative curvature in the plane of the normals, 1/m */
    kmp_ref closing; /* rate of the gap along the normal at constant s, m/s */
} kmp_spread;

/** The graph fails when there is no memory. */
kmp_spread kmp_spread_find(const kmp_tree *tree, const kmp_wheel_pair *pair, const kmp_wheel *wheel, int zone,
                           const kmp_wheel_pose *pose);
