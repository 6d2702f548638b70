/* SPDX-License-Identifier: BSD-3-Clause */
/* Trigonometric simplification of sums of products (Fisette and Samin 1996, section 3.1):
 *
 *     x cos^2 a + x sin^2 a = x
 *     x cos a cos b -+ x sin a sin b = x cos(a +- b)
 *     x sin a cos b +- x cos a sin b = x sin(a +- b)
 *
 * The second and third lines make new angles, which pays where axes are parallel: angles of unrelated joints are left
 * alone. */
#ifndef KMP_SYMBOLIC_COLLAPSE_H
#define KMP_SYMBOLIC_COLLAPSE_H

#include "symbolic/graph.h"

/** Coordinates that rotate about parallel axes, by runs; -1: not in a run. */
typedef struct kmp_parallel {
    const int *run;
    int count;
} kmp_parallel;

/** Rewrites the outputs in place where it takes fewer operations; `parallel` may be NULL: no axes are parallel. False:
 * no memory. */
bool kmp_collapse_trig(kmp_graph *g, const kmp_parallel *parallel, int count, kmp_ref *outputs);

#endif
