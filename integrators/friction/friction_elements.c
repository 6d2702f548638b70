/* SPDX-License-Identifier: BSD-3-Clause */
/* Elements of friction that sticks: their inputs and values. */
#include "integrators/friction/friction_elements.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

/* A rate, m/s. */
#define NEVER_REACHED 1e200

/* -- inputs and values of an element ------------------------------------------------------------------- */

KMP_LOCAL double kmp_friction_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role)
{
    return x->change[e->slot + (int)role - KMP_ROLE_SENSE];
}

KMP_LOCAL double kmp_friction_level_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role,
                                       double way)
{
    if (e->unlimited * way > 0)
        return INFINITY;
    const kmp_role back = role == KMP_ROLE_LEVEL ? KMP_ROLE_LEVEL_BACK : KMP_ROLE_STATIC_BACK;
    return e->contact ? 0 : kmp_friction_at(x, e, e->sides && way < 0 ? back : role);
}

KMP_LOCAL double kmp_friction_bound(const kmp_friction_run *x, const kmp_friction_element *e, double way)
{
    const double slip = fmax(kmp_friction_level_at(x, e, KMP_ROLE_LEVEL, way), 0);
    return fmax(kmp_friction_level_at(x, e, KMP_ROLE_STATIC, way), slip);
}

KMP_LOCAL void kmp_friction_put(kmp_friction_run *x, const kmp_friction_element *e, kmp_role role, double input)
{
    x->site->put(x->site->self, e->slot + (int)role - KMP_ROLE_SENSE, input);
}

KMP_LOCAL double kmp_friction_still(const kmp_friction_run *x)
{
    return x->site->numbers(x->site->self).still;
}

KMP_LOCAL void kmp_friction_set_slip(kmp_friction_run *x, kmp_friction_element *e, double sense, double none)
{
    e->stance = KMP_FRICTION_SLIPS;
    e->sense = sense;
    kmp_friction_put(x, e, KMP_ROLE_SENSE, sense);
    kmp_friction_put(x, e, KMP_ROLE_HELD, 0);
    kmp_friction_put(x, e, KMP_ROLE_GIVEN, 0);
    kmp_friction_put(x, e, KMP_ROLE_PLACE, none);
    if (e->twin >= 0)
        kmp_friction_put(x, e, KMP_ROLE_RATE, 0);
}

KMP_LOCAL void kmp_friction_set_off(kmp_friction_run *x, kmp_friction_element *e)
{
    kmp_friction_set_slip(x, e, 0, NEVER_REACHED);
}

KMP_LOCAL double kmp_friction_halt(const kmp_friction_run *x, const kmp_friction_element *e, double rate)
{
    double none = fmax(KMP_FRICTION_STILL, KMP_FRICTION_DRIFT * x->site->numbers(x->site->self).rtol);
    return none * e->size * rate;
}

KMP_LOCAL void kmp_friction_pair_components(const kmp_friction_run *x, int count, const int *which, int *partner)
{
    for (int k = 0; k < count; k++) {
        partner[k] = -1;
        for (int i = 0; i < count && x->element[which[k]].twin >= 0; i++)
            if (x->element[which[k]].twin == which[i])
                partner[k] = i;
    }
}

KMP_LOCAL double kmp_friction_size(const kmp_friction_run *x, int i)
{
    return x->partner[i] < 0 ? fabs(x->f[i]) : hypot(x->f[i], x->f[x->partner[i]]);
}

KMP_LOCAL kmp_box_outcome kmp_friction_minimum(kmp_friction_run *x, const double *lower, const double *upper)
{
    const kmp_box box = {x->rest, x->d, x->a, lower, upper};
    return kmp_disc_minimum(&box, x->partner, x->f, x->y, x->side, x->room);
}

/* Slip in two directions follows its own direction. From rest it has none yet: a rate in the direction of its
 * acceleration is added until it has begun. If the reserve is used up gradually, the direction of small rates is stiff;
 * so this rate is larger than what counts as none. It is so large, too, that slip which turns round at the rate of its
 * event has not come back at once.
 *
 * A contact that opens is open from where it is, and slip begins with the rate that it has: what rounding leaves of an
 * overlap, or of a rate against the slip, is none. Decisions about others before its surfaces are apart leave the
 * overlap that it was given. */
KMP_LOCAL void kmp_friction_set_moving(kmp_friction_run *x, kmp_friction_element *e, double sense, double rate)
{
    const double size = e->size;
    if (e->twin >= 0) {
        const double slip =
            hypot(kmp_friction_at(x, e, KMP_ROLE_RATE), kmp_friction_at(x, &x->element[e->twin], KMP_ROLE_RATE));
        const double back = kmp_friction_halt(x, e, rate), least = fmax(10 * back, 2 / KMP_FRICTION_BACK * slip);
        e->back = e->begins ? e->back : back;
        e->ahead = e->begins ? e->ahead : e->rubs ? 0 : fmax(KMP_FRICTION_BEGIN * (size * rate), least) * sense;
        kmp_friction_set_slip(x, e, 1, e->back);
        kmp_friction_put(x, e, KMP_ROLE_RATE, e->ahead);
        return;
    }
    double gap = kmp_friction_at(x, e, KMP_ROLE_PLACE);
    bool rebounds = kmp_friction_at(x, e, KMP_ROLE_RATE) > KMP_FRICTION_STILL * size * rate;
    bool leaves = e->lift > 0 && !e->struck && gap < 0;
    bool again = leaves && gap < -e->lift; /* the error of steps holds it back */
    double lift = (rebounds ? KMP_TOUCH_LIFT : KMP_TOUCH_LIFTED) * size + fmax(-gap, 0);
    e->lift = again ? 4 * e->lift : leaves ? fmax(e->lift, lift) : lift;
    double none = kmp_friction_still(x) > KMP_FRICTION_STILL ? kmp_friction_still(x) / 2 : KMP_FRICTION_NONE;
    e->back = none * size * rate + fmax(-sense * kmp_friction_at(x, e, KMP_ROLE_RATE), 0);
    kmp_friction_set_slip(x, e, sense, e->contact ? e->lift : e->back);
}

KMP_LOCAL void kmp_friction_set_given(kmp_friction_run *x, kmp_friction_element *e, double force, double none)
{
    kmp_friction_set_slip(x, e, 0, none);
    kmp_friction_put(x, e, KMP_ROLE_GIVEN, force);
}

KMP_LOCAL void kmp_friction_set_held(kmp_friction_run *x, kmp_friction_element *e, double place)
{
    kmp_friction_set_slip(x, e, 0, place);
    e->stance = KMP_FRICTION_HELD;
    kmp_friction_put(x, e, KMP_ROLE_HELD, 1);
}

/* The rate at which an element that is regularised has left. */
static double rate_left(const kmp_friction_element *e)
{
    return KMP_FRICTION_LEFT * e->regularise;
}

KMP_LOCAL void kmp_friction_set_smooth(kmp_friction_run *x, kmp_friction_element *e)
{
    kmp_friction_set_slip(x, e, 0, rate_left(e));
    e->stance = KMP_FRICTION_SMOOTH;
    kmp_friction_put(x, e, KMP_ROLE_SENSE, KMP_FRICTION_REGULARISED);
}

KMP_LOCAL bool kmp_friction_stays_smooth(const kmp_friction_run *x, const kmp_friction_element *e)
{
    return e->smooth && fabs(kmp_friction_at(x, e, KMP_ROLE_RATE)) < (1 - KMP_FRICTION_TIE) * rate_left(e);
}

/* -- evaluation ---------------------------------------------------------------------------------------- */

KMP_LOCAL int kmp_friction_choose(kmp_friction_run *x, double t, const double *q)
{
    return x->site->choose(x->site->self, t, q);
}

KMP_LOCAL int kmp_friction_measure(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    return x->site->measure(x->site->self, t, q, qd, x->change);
}

KMP_LOCAL void kmp_friction_report(const kmp_friction_run *x, kmp_friction_fact fact, int element, double t,
                                   double number)
{
    if (x->site->report)
        x->site->report(x->site->self, fact, element, t, number);
}

KMP_LOCAL void kmp_friction_begin(kmp_friction_run *x)
{
    memset(&x->past, 0, sizeof x->past);
    x->past.t = x->past.since = -INFINITY;
    for (int i = 0; i < x->count; i++)
        x->element[i].last = -INFINITY;
}

KMP_LOCAL void kmp_friction_note_values(kmp_friction_run *x)
{
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        bool keeps = e->stance == KMP_FRICTION_HELD || e->stance == KMP_FRICTION_CARRIED;
        const kmp_friction_element *twin = e->twin < 0 ? e : &x->element[e->twin];
        keeps = keeps || twin->stance == KMP_FRICTION_HELD || twin->stance == KMP_FRICTION_CARRIED;
        e->fired = keeps && kmp_friction_at(x, e, KMP_ROLE_HELD) < 0;
        e->turned = kmp_friction_at(x, e->across == 2 ? twin : e, KMP_ROLE_SENSE) < 0;
        e->before = kmp_friction_at(x, e, KMP_ROLE_GIVEN);
    }
}

KMP_LOCAL void kmp_friction_let_go(kmp_friction_run *x)
{
    for (int i = 0; i < x->count; i++)
        kmp_friction_put(x, &x->element[i], KMP_ROLE_HELD, 0);
}

KMP_LOCAL int kmp_friction_is_independent(kmp_friction_run *x, kmp_friction_element *e, double t, const double *q,
                                          bool *adds)
{
    kmp_friction_set_held(x, e, kmp_friction_at(x, e, KMP_ROLE_PLACE));
    return x->site->adds(x->site->self, t, q, adds);
}

KMP_LOCAL int kmp_friction_adds_row(kmp_friction_run *x, kmp_friction_element *e, double t, const double *q, bool *adds)
{
    KMP_FRICTION_TRY(kmp_friction_is_independent(x, e, t, q, adds));
    return *adds ? kmp_friction_choose(x, t, q) : 0;
}
