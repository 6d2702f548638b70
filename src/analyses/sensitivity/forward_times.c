/* SPDX-License-Identifier: BSD-3-Clause */
/* Times of events and their derivatives (forward_times.h). */
#include "analyses/sensitivity/forward_times.h"
#include "analyses/derivatives/varied.h"
#include "analyses/sensitivity/forward_inside.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

bool kmp_event_times_make(kmp_event_times *times, kmp_arena *arena, const kempe_system *system, int columns)
{
    const int conditions = times->conditions = system->events.count;
    times->columns = columns;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, conditions, &times->t, &times->along),
                        KMP_ROOM(int, conditions, &times->cause), KMP_ROOM(double, conditions *columns, &times->swings),
                        KMP_ROOM(double, columns, &times->swing), KMP_ROOM(double, system->n, &times->jerk),
                        KMP_ROOM(double, system->m, &times->lambda_rate)))
        return false;
    (void)kmp_event_times_forget(times, NAN);
    return true;
}

/* -- derivatives of times -------------------------------------------------------------------------------- */

bool kmp_same_swing(int count, const double *a, const double *b)
{
    for (int i = 0; i < count; i++)
        if (fabs(a[i] - b[i]) > KMP_SLOPE_SAME_TIME * fmax(fabs(a[i]), fabs(b[i])))
            return false;
    return true;
}

bool kmp_swings_differ(int count, const double *a, const double *b)
{
    for (int i = 0; !(a && b) && i < count; i++)
        if ((a && a[i] != 0) || (b && b[i] != 0))
            return true;
    return a && b && !kmp_same_swing(count, a, b);
}

/* -- conditions that have changed ------------------------------------------------------------------------ */

void kmp_event_times_note(kmp_event_times *times, const double *from, const double *to, double t, int cause)
{
    for (int k = 0; k < times->conditions; k++)
        if ((from[k] != 0) != (to[k] != 0)) { /* also of kinks, where nothing jumps */
            memcpy(times->swings + (ptrdiff_t)k * times->columns, times->swing,
                   (size_t)times->columns * sizeof *times->swing);
            times->t[k] = t;
            times->cause[k] = cause;
        }
}

bool kmp_event_times_forget(kmp_event_times *times, double t)
{
    bool any = false;
    for (int k = 0; k < times->conditions; k++) {
        any = any || kmp_event_times_has(times, k, t);
        times->t[k] = NAN;
    }
    return any;
}

bool kmp_event_times_has(const kmp_event_times *times, int k, double t)
{
    return kmp_same_time(times->t[k], t);
}

const double *kmp_event_times_of(const kmp_event_times *times, int k)
{
    return k < 0 ? NULL : times->swings + (ptrdiff_t)k * times->columns;
}

bool kmp_event_times_any_other(const kmp_event_times *times, int count, const double *swing, double t)
{
    for (int k = 0; k < times->conditions; k++) {
        const double *other = kmp_event_times_of(times, times->cause[k]);
        if (kmp_event_times_has(times, k, t) && kmp_swings_differ(count, other, NULL) &&
            kmp_swings_differ(count, swing, other))
            return true;
    }
    return false;
}

/* -- the event that is looked at -------------------------------------------------------------------------- */

/* An event whose condition changes no faster than this part of its usual rate is touched, not passed. */
#define GRAZING 1e-9

/* The derivative of condition k along a direction, with parameter i (negative: none). */
static double along(kmp_forward_formulation *f, int k, const kmp_direction *direction, int i)
{
    kmp_slopes_along(f->v->slopes, &f->v->slopes->events, direction, i, f->times.along);
    return f->times.along[k];
}

bool kmp_forward_find_swing(kmp_forward_formulation *f, int k, const double *y)
{
    kmp_sensitivity_equations *v = f->v;
    const kmp_linear *l = &v->linear;
    kmp_event_times *times = &f->times;
    const bool late = kmp_slopes_event_is_late(v->slopes, k);
    const int n = f->n;
    double one = 1;
    kmp_instant at = kmp_linear_instant(&v->linear);
    const double value = kmp_slopes_values(&v->slopes->events, &at)[k];
    if (late)
        kmp_sensitivity_equations_rates(v, times->jerk, times->lambda_rate);
    const double by_place = along(f, k, &(kmp_direction){.t = &one, .q = l->qd}, -1);
    const double by_rates = along(f, k, &(kmp_direction){.qd = l->qdd}, -1);
    const double by_loads =
        late ? along(f, k, &(kmp_direction){.qdd = times->jerk, .lambda = times->lambda_rate}, -1) : 0;
    const double rate = by_place + by_rates + by_loads;
    times->distance = fabs(value / rate);
    for (int i = 0; i < f->count; i++) {
        kmp_direction direction = {.q = f->place.dq + i * n, .qd = f->place.dqd + i * n};
        if (late) {
            direction.qdd = f->dqdd;
            direction.lambda = f->dlambda;
            kmp_forward_follow(f, y, i, NULL, NULL, f->dqdd, f->dlambda);
        }
        times->swing[i] = -along(f, k, &direction, i) / rate;
    }
    return fabs(rate) > GRAZING * (fabs(by_place) + fabs(by_rates) + fabs(by_loads));
}

bool kmp_forward_input_jumps(const kmp_forward_formulation *f, double t)
{
    const kmp_present_inputs *inputs = &kmp_forward_eval(f)->inputs;
    bool jumps = false;
    for (int i = 0; i < inputs->count; i++)
        jumps = jumps || (kmp_same_time(inputs->piece[i].from, t) && inputs->piece[i].jump == 0);
    return jumps;
}

bool kmp_forward_coincides(kmp_forward_formulation *f, int k, double t, const double *y)
{
    return kmp_forward_find_swing(f, k, y) && f->times.distance * f->start.rate_scale <= KMP_SLOPE_JUMPED &&
           f->times.t[k] != t && kmp_swings_differ(f->count, f->times.swing, NULL);
}
