/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps around events: whether a step is made again up to the event within it, and the length of the step that follows
 * an event or a sample. The decisions of runs, of lanes and of generated simulators, which have this file too. */
#pragma once

#include "integrators/decide/step_control.h"

/* A step within this multiple of the least one is not a measure of the next one. */
#define KMP_RESTART_BRIEF 64
/* An event within this part of a step from its beginning may be one of the step's polynomial, which is wrong there by
 * the error of the step: the next step is shorter by a factor, and so on until the motion decides. */
#define KMP_RESTART_SOON    1e-3
#define KMP_RESTART_SHORTER 0.25

/** The length with which a step between two times is made again up to the event within it; 0: it is not. The polynomial
 * of a step that meets equations which are not smooth is wrong before these too. At the end of a compliant contact
 * (`parts`) the law is continued beyond by the modulus of the depth, with a kink; other equations (`rough`) are wrong
 * as the square of the length beyond. A step that begins at the event within rounding is right there as it is. */
KMP_INLINE double kmp_restart_again(double from, double event, double to, bool parts, bool rough)
{
    const double h = (1 + KMP_STEP_BEYOND) * (event - from), closely = (1 + KMP_STEP_AT_ONCE) * (event - from);
    const bool shorter = closely * (1 + KMP_STEP_AT_ONCE) < to - from &&
                         closely > fmax(KMP_STEP_AT_ONCE * (to - from), KMP_RESTART_BRIEF * kmp_step_least(from));
    if (parts && h > kmp_step_least(from) && h < to - from)
        return h;
    return rough && shorter ? closely : 0;
}

/** The length of the step after an event at which rates may jump: the step across it, of which any part may lie
 * before the event, or a shorter one where the event is near its beginning. 0, to be chosen again, where it follows the
 * beginning of that step at once, within `instant`: steps of rounding size count as a motion that cannot continue.
 * flight: of the flight before an impact, INFINITY: there is none. */
KMP_INLINE double kmp_restart_length(double step, double since, double instant, double flight)
{
    const double next = since < KMP_RESTART_SOON * step ? KMP_RESTART_SHORTER * step : step;
    return fmin(since > instant ? next : 0, KMP_IMPACT_STEP * flight);
}

/** The length of a first step that is proposed at t; 0, to be chosen again, where the step before was cut short between
 * two breaks. */
KMP_INLINE double kmp_restart_proposed(double h, double t)
{
    return h < KMP_RESTART_BRIEF * kmp_step_least(t) ? 0 : h;
}
