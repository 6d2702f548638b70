/* SPDX-License-Identifier: BSD-3-Clause */
/* A branch of limit cycles, followed through its folds by its length (Keller 1977), with requested values of the
 * parameter, folds and changes of stability located on it. */
#pragma once

#include "studies/limit_cycles/shooting.h"

typedef struct kmp_cycle_branch {
    kmp_cycle **cycle; /* in the order of the branch; kmp_free */
    int count;
    char *end; /* of the caller's arena: why the branch ends, a sentence without full stop */
    bool ends_at_hopf;
} kmp_cycle_branch;

/** The request for a branch; nothing is owned. */
typedef struct kmp_branch_options {
    double from, to; /* of the parameter, in either order: the branch ends beyond them */
    int count;       /* of values between and at them that get a cycle each */
    int most;        /* cycles */
} kmp_branch_options;

/** Follows the branch from a cycle, which it takes, in the direction of its tangent, with sizes as they are. KEMPE_OK
 * also where the branch cannot be followed any more, which `end` says; KEMPE_STOPPED: an interrupt; KEMPE_E_MEMORY. */
kempe_status kmp_branch_follow(kmp_shooting *shooting, const kmp_branch_options *options, kmp_cycle *first,
                               kmp_cycle_branch *branch);

/** Adds a cycle. KEMPE_E_MEMORY. */
kempe_status kmp_branch_add(kempe_context *context, kmp_cycle_branch *branch, kmp_cycle *cycle);
