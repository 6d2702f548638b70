/* SPDX-License-Identifier: BSD-3-Clause */
/* Control of steps: whether an attempt is taken, and how long the next one is. The decisions of runs, of lanes and of
 * generated simulators, which have this file too. Step sizes by the error after Hairer, Wanner, Solving Ordinary
 * Differential Equations II, IV.2 (Gustafsson's PI control), with the published bounds. */
#pragma once

#include "integrators/decide/inlined.h"

typedef struct kmp_rk_numbers {
    int stages;       /* derivatives k[1] .. k[stages], numbered as published */
    int end;          /* k[end] is the derivative at the step's end */
    int interpolants; /* vectors of the dense output */
    int order;
    double exponent; /* of the error in the next step's size */
    double shrink, grow;
} kmp_rk_numbers;

/** Result of an attempt at a step. */
typedef enum kmp_attempt {
    KMP_ATTEMPT_NONE, /* nothing more is to be done with it: its lane is empty, or no attempt can be made */
    KMP_ATTEMPT_TAKEN,
    KMP_ATTEMPT_EVENT,     /* it is taken up to an event within it */
    KMP_ATTEMPT_AGAIN,     /* it is made again with another length, and is not a failure */
    KMP_ATTEMPT_BAD_ERROR, /* the estimate exceeds the tolerance */
    KMP_ATTEMPT_BAD_STAGE, /* the right-hand side cannot be evaluated at a stage or at the end */
    KMP_ATTEMPT_BAD_STEP   /* its end is refused: a loop has changed its branch, or is not closed well enough */
} kmp_attempt;

enum {
    KMP_STEP_ATTEMPTS = 1000, /* the most attempts at one step */
    KMP_STEP_FINER = 100      /* the most steps that replace a coarse interpolant */
};

/* Stabilising exponent of the step-size control (Gustafsson's PI). */
#define KMP_RK_BETA 0.04
/* Compared with 0.9 at a given tolerance: half the error for 4 % more evaluations with DOP853, for 10 % more with
 * DOPRI5; at equal error 2 to 4 % fewer (docs/decisions/safety.md). */
#define KMP_RK_SAFETY 0.8
/* Least error of the last step in the control. */
#define KMP_RK_ERROR_FLOOR 1e-4
/* The largest part of a rejected step over the next attempt. An error far above the tolerance is still one of the order
 * of the method. The estimate vanishes at single step sizes that are too long: a rejected step that was shortened by
 * less than its error requires met one, and was accepted with an error of 200 tolerances. */
#define KMP_RK_SHORTEST 100

/* -- acceptance ---------------------------------------------------------------------------------------- */

/** True if the error of an attempt is within the tolerance, 1; a step of `fixed` length needs only a finite one. */
KMP_INLINE bool kmp_step_passes(double error, bool fixed)
{
    return error <= (fixed ? DBL_MAX : 1.0);
}

/** The error that the control of the next step knows of a step that is taken. */
KMP_INLINE double kmp_step_known_error(double error)
{
    return error > KMP_RK_ERROR_FLOOR ? error : KMP_RK_ERROR_FLOOR;
}

/* -- the next length ----------------------------------------------------------------------------------- */

/** The length of an attempt over the length of the next one. `factor`: the power of the error over the power of the
 * last error (1 after an attempt that is not taken), over the safety. */
KMP_INLINE double kmp_step_ratio(const kmp_rk_numbers *method, bool taken, double error, double factor)
{
    double least = taken ? 1.0 / method->grow : 0;
    double most = taken || !(error <= DBL_MAX) ? method->shrink : KMP_RK_SHORTEST;
    double ratio = factor < most ? factor : most;
    return ratio > least ? ratio : least;
}

/** The next length after a step that is taken: no longer than the step if an attempt at it had failed. */
KMP_INLINE double kmp_step_after_failures(double next, double h, bool rejected)
{
    return rejected && h < next ? h : next;
}

/** The next length after an attempt whose stages or whose end are bad: these have no error to go by. */
KMP_INLINE double kmp_step_retry(kmp_attempt what, double h)
{
    return what == KMP_ATTEMPT_BAD_STAGE ? h / 4 : h / 2;
}

/** The length of the next step, or of the next attempt at this one, after an attempt of length h. error_old: of the
 * last step that was taken; `rejected`: an attempt after it was not taken. */
KMP_INLINE double kmp_step_after(const kmp_rk_numbers *method, kmp_attempt what, double h, double error,
                                 double error_old, bool rejected)
{
    const bool taken = what == KMP_ATTEMPT_TAKEN;
    if (!taken && what != KMP_ATTEMPT_BAD_ERROR)
        return kmp_step_retry(what, h);
    double factor = INFINITY;
    if (error <= DBL_MAX)
        factor = pow(error, method->exponent) / (taken ? pow(error_old, KMP_RK_BETA) : 1) / KMP_RK_SAFETY;
    return kmp_step_after_failures(h / kmp_step_ratio(method, taken, error, factor), h, taken && rejected);
}

/* -- lengths that can be made --------------------------------------------------------------------------- */

/* Parts of t, in units of rounding: LEAST bounds a step; repeated steps below COLLAPSED are a collapse. */
#define KMP_STEP_LEAST     16
#define KMP_STEP_COLLAPSED 64
enum { KMP_STEP_MAX_HOPELESS = 100 };

/** The least length of a step at t, by the resolution of double precision. */
KMP_INLINE double kmp_step_least(double t)
{
    return KMP_STEP_LEAST * DBL_EPSILON * fabs(t);
}

/** The next step for the desired length `next`, 0 when it has become too short, and its end: exactly t_end if it would
 * come near, half-way if little more than one step is left. */
KMP_INLINE double kmp_step_next(double t, double t_end, double next, double *t_new)
{
    double left = t_end - t;
    double h = left < 1.01 * next ? left : left < 2.0 * next ? 0.5 * left : next;
    *t_new = h == left ? t_end : t + h;
    return h >= KMP_STEP_LEAST * DBL_EPSILON * fabs(t) && *t_new > t ? h : 0;
}

/** The length of an attempt after `tries` others at the same step, 0 when there is none, and its end. A step of
 * constant length, `fixed` > 0, is tried once; the last one may be longer or shorter. */
KMP_INLINE double kmp_step_to_try(int tries, double t, double t_end, double next, double fixed, double *t_new)
{
    if (!(fixed > 0))
        return kmp_step_next(t, t_end, next, t_new);
    *t_new = t_end - t < 1.01 * fixed ? t_end : t + fixed;
    return tries == 0 ? *t_new - t : 0;
}

/** True for a step of length h that ends at t and is hardly longer than the least. */
KMP_INLINE bool kmp_step_is_hopeless(double h, double t)
{
    return h < KMP_STEP_COLLAPSED * DBL_EPSILON * fabs(t);
}

/** After a step of length h that ended at t: true when more than 100 successive ones (counted in *hopeless, 0 at a
 * start) were hardly longer than the least. */
KMP_INLINE bool kmp_step_collapsed(int *hopeless, double h, double t)
{
    *hopeless = kmp_step_is_hopeless(h, t) ? *hopeless + 1 : 0;
    return *hopeless > KMP_STEP_MAX_HOPELESS;
}
