/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion that grows without end: the decision of runs, of lanes and of generated simulators, which have this file
 * too. Such a run would take shorter and shorter steps until its numbers overflow. */
#pragma once

#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/** Growth of the state by decades; zero at the start. */
typedef struct kmp_growth {
    double next;   /* attempted steps at the next look */
    double beyond; /* size at the end of the last decade; 0: the first one has not ended */
    double ended;  /* number of decades that have ended */
    double t[4];   /* ends of the last decades, the latest one first */
} kmp_growth;

/** The largest of `count` unknowns, each over its usual size, which the absolute tolerances have: `atol` in all, weight
 * each. Unknowns are `stride` apart. */
static inline double kmp_growth_size(int count, int stride, const double *y, const double *weight, double atol)
{
    double most = 0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(y[i * stride]) / weight[i * stride]);
    return most * atol;
}

/** The largest of `count` rates over their scales that is far beyond the rate `usual` of the motion, 1/s; -1: none is.
 * Rates and scales are `stride` apart. which: the coordinates of the rates, NULL: the first ones. Entries from
 * `motions` on are states, which may have any size. */
static inline int kmp_growth_explodes(int count, const int *which, int motions, int stride, const double *rate,
                                      const double *scale, double usual)
{
    double most = KMP_GROWTH_RATES * usual;
    int fastest = -1;
    for (int k = 0; k < count; k++) {
        const int c = which ? which[k] : k;
        const double size = c < motions ? fabs(rate[k * stride]) / scale[c * stride] : 0;
        fastest = size > most ? k : fastest;
        most = fmax(most, size);
    }
    return fastest;
}

/** A look after `tried` attempted steps: the largest unknown at t is `size` times its usual size. True for growth
 * without end: over the last three decades, far beyond usual sizes, at least as fast as an exponential function, and
 * after many steps. */
static inline bool kmp_growth_is_endless(kmp_growth *growth, double tried, double t, double size)
{
    double *end = growth->t;
    growth->next = tried + KMP_GROWTH_LOOKS;
    if (!(growth->beyond > 0))
        growth->beyond = KMP_GROWTH_USUAL;
    if (!(size <= DBL_MAX))
        return false; /* the next step finds it */
    bool jumps = size >= 10 * growth->beyond;
    for (; size >= growth->beyond; growth->beyond *= 10) {
        memmove(end + 1, end, 3 * sizeof *end);
        end[0] = t;
        growth->ended++;
    }
    growth->ended = jumps ? 1 : growth->ended;
    double last = end[0] - end[1], before = end[1] - end[2], first = end[2] - end[3];
    return growth->ended >= 4 && tried >= KMP_GROWTH_STEPS && last <= KMP_GROWTH_STEADY * before &&
           before <= KMP_GROWTH_STEADY * first && t - end[0] <= KMP_GROWTH_STEADY * last;
}
