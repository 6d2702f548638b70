/* SPDX-License-Identifier: BSD-3-Clause */
/* The contents of an implicit block, for the files that make such blocks (implicit.c, average.c). */
#pragma once

#include "symbolic/implicit.h"

struct kmp_implicit {
    kmp_program_block block;
    kmp_graph *local;                                     /* has the room of all arrays */
    kmp_ref slope[KMP_IMPLICIT_MOST * KMP_IMPLICIT_MOST]; /* dF_i/dy_j at i unknowns + j */
    kmp_ref change[KMP_IMPLICIT_MOST];                    /* dF_i along dp = KMP_IN_LAMBDA */
    kmp_ref *row; /* of averages: the exponent and the averaged expressions, then `needed`; otherwise NULL */
    int *derived; /* with them: number of the block of their derivatives in the graph; -1: not yet made */
};

/** Number of the first block of the graph that `is` is true for; one that it had before it returned to a mark becomes
 * its block again. -1: there is none. */
typedef bool kmp_implicit_test(const kmp_implicit *block, const void *user);
int kmp_graph_find_implicit(kmp_graph *g, kmp_implicit_test *is, const void *user);

/** References in the enclosing graph for the inputs of a local graph: unknowns for KMP_IN_Q, arguments for
 * KMP_IN_PARAMETER, differentials for KMP_IN_LAMBDA. */
typedef struct kmp_setting {
    kmp_graph *g;
    const kmp_ref *unknowns, *arguments, *differentials;
} kmp_setting;
