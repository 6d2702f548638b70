/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants for many motions at once, as they follow from the tree: the candidates in the search for the shortest
 * equations.
 */
#pragma once

#include "dynamics/shorten/variants.h"

/** A value for each motion: of links whose parent has a mass, and of others. */
typedef struct kmp_pattern_set {
    size_t member; /* the array's offset in kmp_savings; 0: no more */
    uint8_t to_masses, to_others;
} kmp_pattern_set;

/** It changes variants in addition to those already chosen. */
typedef struct kmp_cost_pattern {
    enum {
        KMP_PATTERN_EVER,
        KMP_PATTERN_SMALL,
        KMP_PATTERN_OPTIMIZE
    } when;       /* of any model; of small ones; on demand */
    bool instead; /* of the first pattern, whose members it sets otherwise */
    void (*apply)(const kmp_tree *tree, kmp_savings *savings);
    kmp_pattern_set set[4];
} kmp_cost_pattern;

void kmp_pattern_apply(const kmp_cost_pattern *pattern, const kmp_tree *tree, kmp_savings *savings);

/** In the order in which they are tried. */
const kmp_cost_pattern *kmp_patterns(int *count);
