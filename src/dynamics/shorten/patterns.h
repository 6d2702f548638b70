/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants for many motions at once, as they follow from the tree: the candidates in the search for the shortest
 * equations.
 */
#ifndef KMP_DYNAMICS_SHORTEN_PATTERNS_H
#define KMP_DYNAMICS_SHORTEN_PATTERNS_H

#include "dynamics/shorten/variants.h"

typedef struct kmp_cost_pattern {
    void (*apply)(const kmp_tree *tree, kmp_ways *ways); /* in addition to the variants already chosen */
    enum {
        KMP_PATTERN_EVER,
        KMP_PATTERN_SMALL,
        KMP_PATTERN_OPTIMIZE
    } when; /* of any model; of small ones; on demand */
} kmp_cost_pattern;

/** In the order in which they are tried. */
const kmp_cost_pattern *kmp_patterns(int *count);

#endif
