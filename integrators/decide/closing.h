/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method that closes loops: when it has converged, when it fails, and how far a correction goes; and the
 * correction of integrated coordinates at the end of a step. The decisions of every loop of the library that closes
 * states, of lanes and of generated simulators, which have this file too. */
#pragma once

#include "integrators/decide/inlined.h"

/* The most corrections of a state that is near to a closed one. */
enum { KMP_CLOSING_PASSES = 12 };

/** Rule of convergence: a correction is within a fraction of the weights, or rounding; or |h| is rounding; or
 * corrections no longer shrink and |h| is at most `enough`. */
typedef struct kmp_close_rule {
    int most;         /* maximum number of corrections */
    bool contracting; /* fail as soon as corrections no longer shrink */
    bool led;         /* x must meet more than h, so that |h| gives no information while corrections shrink */
    double longest;   /* longer corrections are cut, scaled; 0: none is */
    bool least;       /* corrections may vanish with h open: `enough` is required in any case */
    double enough;    /* scaled |h| */
    const double *w;  /* error weights of x; NULL: to round-off */
    double fraction;
    double seen; /* only longer corrections count in `ratio` */
} kmp_close_rule;

typedef struct kmp_closed {
    bool closed;
    int corrections;
    double first, ratio; /* length of the first correction; largest ratio of a correction to the one before it */
} kmp_closed;

/** Scaled rounding error of a coordinate of the largest size of x (n): a smaller correction gains nothing. */
KMP_INLINE double kmp_close_noise(int n, const double *scale, const double *x)
{
    double size = 1;
    for (int i = 0; i < n; i++)
        size = fmax(size, fabs(x[i]) / scale[i]);
    return 16 * DBL_EPSILON * size;
}

/** True if a correction is shorter than the one before, as Newton's corrections are near a solution. */
KMP_INLINE bool kmp_closing_contracts(double size, double last)
{
    return size <= 0.9 * last;
}

/** The outcome of a correction. */
typedef enum kmp_closing_move {
    KMP_CLOSING_GOES, /* it is added, and another one follows */
    KMP_CLOSING_ENDS, /* it is added, and is the last one */
    KMP_CLOSING_STOPS /* it is not added */
} kmp_closing_move;

/** Takes a correction of scaled length `size`, infinite if it is not finite, and of length `weighted` in error weights,
 * from a state whose rows are open by `open`, scaled. *last: the length of the one before, INFINITY at the beginning.
 * *part: of the correction that is added. */
KMP_INLINE kmp_closing_move kmp_closing_judge(kmp_closed *out, const kmp_close_rule *rule, double noise, double size,
                                              double weighted, double open, double *last, double *part)
{
    const bool done = size <= noise || weighted <= rule->fraction ||
                      ((!rule->led || size > 0.1 * *last) && open <= KMP_CLOSED_ROUNDING);
    const bool stalled = !done && !kmp_closing_contracts(size, *last);
    const bool cut = rule->longest > 0 && size > rule->longest;
    out->closed = (done && !rule->least) || ((done || stalled) && size < INFINITY && open <= rule->enough);
    out->first = out->corrections == 0 ? size : out->first;
    if (out->corrections > 0 && size > fmax(1e4 * noise, rule->seen))
        out->ratio = fmax(out->ratio, size / *last);
    out->corrections++;
    *part = cut ? rule->longest / size : 1;
    if ((stalled && (out->closed || rule->contracting)) || size == INFINITY)
        return KMP_CLOSING_STOPS;
    *last = cut ? INFINITY : size;
    return done ? KMP_CLOSING_ENDS : KMP_CLOSING_GOES;
}

/* -- the correction at the end of a step ----------------------------------------------------------------- */

/** The size of a correction of a dependent coordinate in its error weight; 0 within rounding of h, infinite if it is
 * not finite. */
KMP_INLINE double kmp_correction_size(double correction, double weight, double scale)
{
    double size = fabs(correction), rounded = KMP_CORRECTION_ROUNDING * scale, part = size / weight;
    double least = rounded < weight ? rounded : weight;
    return size <= least ? 0 : part <= DBL_MAX ? part : INFINITY;
}

/** The last correction at the end of an attempt, and the beginning of its step. */
typedef struct kmp_last_correction {
    double size, t;
} kmp_last_correction;

/** True if the largest correction at the end of an attempt that begins at t is small enough. Each choice of rows has
 * another motion off the loops where rows are `dropped`. A correction that a shorter attempt at the same step does not
 * make much smaller is one of rounding. */
KMP_INLINE bool kmp_correction_is_small(double size, bool dropped, double t, kmp_last_correction *last)
{
    const bool rounding = last->t == t && size > 0.5 * last->size && size <= KMP_CORRECTION_LIMIT;
    last->size = size;
    last->t = t;
    return size <= (dropped ? KMP_CORRECTION_REDUNDANT : KMP_CORRECTION_LIMIT) || rounding;
}
