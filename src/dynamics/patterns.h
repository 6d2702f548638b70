/* SPDX-License-Identifier: BSD-3-Clause */
/* Ways taken at many motions at once, as they follow from the tree: what the search for the shortest equations tries.
 */
#ifndef KMP_DYNAMICS_PATTERNS_H
#define KMP_DYNAMICS_PATTERNS_H

#include "dynamics/kinematics.h"
#include "dynamics/ways.h"

typedef struct kmp_pattern {
    void (*apply)(const kmp_tree *tree, kmp_ways *ways); /* on top of what the ways have */
    enum {
        KMP_PATTERN_EVER,
        KMP_PATTERN_SMALL,
        KMP_PATTERN_OPTIMIZE
    } when; /* of any model; of small ones; on demand */
} kmp_pattern;

/** In the order in which they are tried. */
const kmp_pattern *kmp_patterns(int *count);

#endif
