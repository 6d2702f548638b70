/* SPDX-License-Identifier: BSD-3-Clause */
/* The default bound judges progress over the last window, not a total: a run may be long while it advances, and a phase
 * of short steps has no effect unless it fills a window. */
#include "integrators/run/work_bound.h"
#include <limits.h>

/* Steps of a window: about half a second for a small mechanism. Short phases, as oscillations of microseconds, take a
 * tenth of it even at the finest tolerances (bench/results/light_carriage.txt). */
enum { WINDOW = 100000 };
/* Largest number of steps still needed at the pace of the last window: some minutes for the smallest mechanism. The
 * longest runs of the examples and benchmarks take 1e6. */
static const double MOST_TO_COME = 1e8;

long kmp_work_bound_spare(const kmp_work_bound *bound, long tried)
{
    if (bound->most != 0)
        return bound->most < 0 ? LONG_MAX : bound->most - tried - 1;
    return bound->has_looked ? bound->seen + WINDOW - tried - 1 : 0;
}

bool kmp_work_bound_passed(kmp_work_bound *bound, long tried, double t, double t_end, kmp_text *why)
{
    if (bound->most != 0) {
        const bool reached = bound->most > 0 && tried >= bound->most && t < t_end;
        if (reached && why)
            kmp_text_printf(why, "the limit of %ld steps (max_steps) is reached at t = %.9g s of %.9g s", bound->most,
                            t, t_end);
        return reached;
    }
    if (bound->has_looked && tried - bound->seen < WINDOW)
        return false;
    double made = t - bound->seen_t, taken = (double)(tried - bound->seen), left = t_end - t;
    bool slow = bound->has_looked && left * taken > MOST_TO_COME * made;
    bound->has_looked = true;
    bound->seen = tried;
    bound->seen_t = t;
    if (!slow || !why)
        return slow;
    kmp_text_printf(why,
                    "too much work: at t = %.9g s the last %.0f steps advanced %.3g s. To reach t_end = %.9g s about "
                    "%.1g more steps are needed. The motion is very fast or nearly singular: check start, masses and "
                    "forces, or allow more steps (max_steps)",
                    t, taken, made, t_end, made > 0 ? left * taken / made : 1e300);
    return true;
}
