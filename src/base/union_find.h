/* SPDX-License-Identifier: BSD-3-Clause */
/* Disjoint sets (union-find): each element points to another of its group or, the root, to itself. */
#pragma once

/** The root of k's group, with path compression. Two groups become one when a root points to the other. */
static inline int kmp_root_of(int *up, int k)
{
    while (up[k] != k)
        k = up[k] = up[up[k]];
    return k;
}
