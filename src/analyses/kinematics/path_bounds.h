/* SPDX-License-Identifier: BSD-3-Clause */
/* A test if closures follow a predicted path between two closed states. Bounds of the rate of each row of h along the
 * path say that the curve of closed states is nearly parallel to it everywhere, and not only at its ends: a narrow nose
 * between them, or a gap without closed states, makes the rate large there. */
#pragma once

#include "analyses/kinematics/sweep.h"
#include "backend/bounds.h"

/** A stretch of the curve from a to b, by the offset along a's tangent: Hermite's cubic of each x. */
typedef struct kmp_stretch {
    const kmp_sweep_pose *a, *b;
    double length, slant; /* offset of b; cosine of the tangents */
} kmp_stretch;

/** The cubic of x_i at a part of the length; its derivative by the offset, of order 0, 1 or 2. */
double kmp_stretch_x(const kmp_stretch *stretch, int i, double part, int order);

struct kmp_path_bounds {
    kmp_bounds *bounds; /* of the program of closures */
    long charts;        /* the evaluator's when values of constants were last computed; -1: never */
    int *output;        /* m: of h */
    bool *wanted;       /* m: the row counts */
    double *limit;      /* m: of the rate */
    double *x;          /* n + 1 */
    double *from, *to;  /* m: h at the ends of a piece that no bounds decide */
};

/** In the sweep's arena. NULL: no memory. */
kmp_path_bounds *kmp_path_bounds_new(kmp_sweep *sweep);

/** Expects J at an end of the stretch in the sweep's evaluator, whose closure is another one then. False: some row is
 * not followed. Some values have no bounds, and some steps need too many pieces: then h is compared at the ends of
 * pieces of the length `finest`. */
bool kmp_path_is_followed(kmp_sweep *sweep, const kmp_stretch *stretch, double finest);
