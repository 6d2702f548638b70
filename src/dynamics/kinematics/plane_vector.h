/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors of a plane as pairs of nodes, in line. */
#pragma once

#include "symbolic/graph.h"

static inline kmp_ref kmp_plane_dot(kmp_graph *g, const kmp_ref a[2], const kmp_ref b[2])
{
    return kmp_add(g, kmp_mul(g, a[0], b[0]), kmp_mul(g, a[1], b[1]));
}

static inline kmp_ref kmp_plane_cross(kmp_graph *g, const kmp_ref a[2], const kmp_ref b[2])
{
    return kmp_sub(g, kmp_mul(g, a[0], b[1]), kmp_mul(g, a[1], b[0]));
}

/** A vector in axes that are turned, whose x axis is e: the product of both as complex numbers. It may be `out`. */
static inline void kmp_plane_turn(kmp_graph *g, const kmp_ref e[2], const kmp_ref v[2], kmp_ref out[2])
{
    const kmp_ref x = kmp_sub(g, kmp_mul(g, e[0], v[0]), kmp_mul(g, e[1], v[1]));
    out[1] = kmp_add(g, kmp_mul(g, e[0], v[1]), kmp_mul(g, e[1], v[0]));
    out[0] = x;
}

/** From a place of constant numbers. */
static inline void kmp_plane_from(kmp_graph *g, const double place[2], const kmp_ref to[2], kmp_ref v[2])
{
    for (int i = 0; i < 2; i++)
        v[i] = kmp_sub(g, to[i], kmp_const(g, place[i]));
}
