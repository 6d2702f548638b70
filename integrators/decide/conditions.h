/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of a motion: which values change one, whether one may change within a step, on which branch a kink is
 * fixed, and when changes repeat without end. The decisions of runs, of lanes and of generated simulators, which have
 * this file too. A condition is fixed during a step by its mode: above zero it holds, its value is negative. */
#pragma once

#include "dynamics/kinematics/friction_roles.h"
#include "integrators/decide/inlined.h"

typedef enum kmp_condition_kind {
    KMP_CONDITION_SWITCHES, /* its change is an event */
    KMP_CONDITION_ENDS,     /* so is this one, which ends the motion */
    KMP_CONDITION_KINK,     /* of min, max, abs: 0 while its branch is not fixed */
    KMP_CONDITION_PASSES,   /* a number of friction or of a contact: that it is negative is an event */
    KMP_CONDITION_NUMBER,   /* another number of these */
    KMP_CONDITION_VALIDITY  /* where it is negative the motion is doubted; no event */
} kmp_condition_kind;

/** True if a value differs from the state that is fixed: the condition has changed. */
KMP_INLINE bool kmp_condition_differs(kmp_condition_kind kind, double mode, double value)
{
    if (kind >= KMP_CONDITION_PASSES)
        return kind == KMP_CONDITION_PASSES && value < 0;
    return (kind != KMP_CONDITION_KINK || mode != 0) && (value < 0) != (mode > 0);
}

/** True for a condition that is fixed where its value is negative. */
KMP_INLINE bool kmp_condition_holds(kmp_condition_kind kind, double mode)
{
    return mode > 0 && kind < KMP_CONDITION_PASSES;
}

/** False for a condition that is not an event in the present modes; `mode` is a pointer to its own, `sense`: it is the
 * one of the sense of slip. Rates of elements at rest that other rows keep are zero by them, which bounds do not know:
 * they are watched at ends of steps. */
KMP_INLINE bool kmp_condition_may_change(kmp_condition_kind kind, bool sense, const double *mode)
{
    if (kind == KMP_CONDITION_KINK)
        return *mode != 0;
    if (kind != KMP_CONDITION_PASSES)
        return kind < KMP_CONDITION_PASSES;
    return sense ? *mode != 0 && mode[KMP_ROLE_HELD - KMP_ROLE_SENSE] == 0
                 : *mode > 0 || mode[KMP_ROLE_GIVEN - KMP_ROLE_HELD] != 0;
}

/* -- kinks ------------------------------------------------------------------------------------------------- */

/** Takes a value of a kink into account. True if it is not fixed, and due to be: it is away from zero by more than the
 * part `within` of *largest, its largest value so far. Beyond the kink the equations are smooth, as high orders need.
 */
KMP_INLINE bool kmp_kink_is_away(double mode, double value, double within, double *largest)
{
    *largest = fmax(*largest, fabs(value));
    return mode == 0 && fabs(value) > 2 * within * *largest;
}

/** True if a kink that is not fixed, away from zero at the end of a step, was away on the other side near its
 * beginning. */
KMP_INLINE bool kmp_kink_is_passed(double near, double end, double within, double largest)
{
    return (near < 0) != (end < 0) && fabs(near) > 2 * within * largest;
}

/* -- repeated changes ---------------------------------------------------------------------------------------- */

/** True if a condition that changes at t has changed at `last` at once with it: within the least time `instant` of the
 * motion. */
KMP_INLINE bool kmp_changes_at_once(double t, double last, double instant)
{
    return t - last <= fmax(64 * DBL_EPSILON * fabs(t), instant);
}

/** True for a kink that is not fixed again where it changes: `most`, its largest value since the last change, is within
 * the errors of steps, as at rest; or it changes without end. */
KMP_INLINE bool kmp_kink_is_idle(double most, double within, double largest, int repeats)
{
    return most <= within * largest || repeats >= KMP_EVENT_REPEATS;
}
