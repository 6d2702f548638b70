/* SPDX-License-Identifier: BSD-3-Clause */
/* The links of a loop as a polygon, which closes only if no side is longer than all others together. */
#pragma once

#include "model/data/model.h"

/** The polygon of one loop: its longest side and the sum of all sides, m. */
typedef struct kmp_loop_polygon {
    const kempe_model *model;
    double longest, sum;
    bool slides;        /* a joint of the loop slides */
    int body, from, to; /* of the longest side: points, -1 the origin */
} kmp_loop_polygon;

/** The polygon of a closure between two points. */
kmp_loop_polygon kmp_loop_polygon_of(const kempe_model *model, const kmp_closure *closure);

/** The longest distance of two joints or closure points on one body around a loop, m; 0 if no body has two. */
double kmp_loop_longest_side(const kempe_model *model, int closure);
