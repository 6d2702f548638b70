/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes of all elements at a state: the decision, rows that are held, and what changes. */
#include "integrators/friction/friction_settle.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_growth.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/friction/friction_load.h"
#include "integrators/friction/friction_problem.h"
#include <math.h>
#include <string.h>

/* That of a contact is its force, by which it can be relieved. */
static double reserve(const kmp_friction_run *x, int i)
{
    return x->element[x->which[i]].contact ? x->f[i] : x->upper[i] - kmp_friction_size(x, i);
}

/* True for a contact with a force. One without would open at once by rounding where friction can hold its place. */
static bool pushes(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    return e->contact && x->f[i] * x->d[i + i * x->rest] > e->still;
}

/* True if the row of element j comes before that of i: contacts that push first, then by their reserve. */
static bool is_before(const kmp_friction_run *x, int j, int i)
{
    bool first = pushes(x, j), second = pushes(x, i);
    double a = reserve(x, j), b = reserve(x, i);
    return first != second ? first : a > b || (a == b && j < i);
}

/* The element at rest with the k-th largest reserve; of equal ones the first. */
static int with_reserve(const kmp_friction_run *x, int k)
{
    for (int i = 0; i < x->rest; i++) {
        int above = 0;
        for (int j = 0; j < x->rest; j++)
            above += is_before(x, j, i);
        if (above == k)
            return i;
    }
    return 0;
}

/* Sets the modes of the elements at rest. Rows that others imply are not added: those of the elements with the largest
 * reserve come first. */
static int set_modes(kmp_friction_run *x, double t, const double *q, double rate)
{
    if (x->loads) /* levels may fall below forces that are given */
        kmp_friction_share(x);
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        if (e->broken)
            kmp_friction_set_moving(x, e, e->sense, rate);
        else
            kmp_friction_set_given(x, e, 0, 0);
    }
    for (int i = 0; i < x->count; i++) /* friction of contacts that open in this decision */
        if (x->element[i].base >= 0 && x->element[x->element[i].base].broken)
            kmp_friction_set_off(x, &x->element[i]);
    KMP_FRICTION_TRY(kmp_friction_choose(x, t, q));
    for (int k = 0; k < x->rest; k++) {
        int i = with_reserve(x, k);
        kmp_friction_element *e = &x->element[x->which[i]];
        bool adds = false;
        if (e->broken || (e->base >= 0 && x->element[e->base].broken))
            continue;
        if (!e->implied)
            KMP_FRICTION_TRY(kmp_friction_adds_row(x, e, t, q, &adds));
        if (adds)
            continue;
        /* It keeps its force, unless that is rounding: that of all accelerations would exceed a level that is rounding
         * as well. */
        bool none = e->implied || fabs(x->d[i + i * x->rest] * x->f[i]) <= kmp_friction_rounding(x, i);
        kmp_friction_set_given(x, e, none ? 0 : x->f[i], kmp_friction_still(x) * e->size * rate);
        e->stance = e->implied ? KMP_FRICTION_IDLE : KMP_FRICTION_CARRIED;
        KMP_FRICTION_TRY(kmp_friction_choose(x, t, q));
    }
    return 0;
}

/* -- changes --------------------------------------------------------------------------------------------- */

static bool is_as_before(const kmp_friction_element *e)
{
    bool rests = e->stance == KMP_FRICTION_HELD || e->stance == KMP_FRICTION_CARRIED,
         rested = e->was == KMP_FRICTION_HELD || e->was == KMP_FRICTION_CARRIED;
    if (e->across == 2) /* the first component tells of both */
        return true;
    bool off = e->stance == KMP_FRICTION_SLIPS && (e->contact ? !e->known : e->sense == 0);
    return off || (e->known && (rests ? rested : e->stance == e->was && e->sense == e->before_sense));
}

/* Notes which elements change in this decision, or have used up their reserve. True: any does. */
static bool count_changes(kmp_friction_run *x)
{
    bool any = false;
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        bool changes = e->fired || !is_as_before(e);
        e->changes += changes;
        any = any || changes;
    }
    return any;
}

/* Fails where modes change without progress of time: at one instant, or too often within a short part of the motion. */
static int watch(kmp_friction_run *x, double t, double rate)
{
    double span = x->site->numbers(x->site->self).span;
    x->past.repeats = t - x->past.t <= KMP_FRICTION_INSTANT * span ? x->past.repeats + 1 : 0;
    x->past.t = t;
    bool begins = !((t - x->past.since) * rate <= KMP_FRICTION_CROWD); /* another count */
    x->past.since = begins ? t : x->past.since;
    x->past.changes = begins ? 0 : x->past.changes;
    for (int i = 0; begins && i < x->count; i++)
        x->element[i].changes = 0;
    x->past.changes += count_changes(x);
    bool goes_on = x->past.repeats < KMP_FRICTION_REPEATS && x->past.changes < KMP_FRICTION_CROWDED;
    return goes_on ? 0 : x->site->fail(x->site->self, KMP_FRICTION_ALTERNATES, t);
}

/* Tells at the start of levels that grow so much with the friction that there may be several solutions or none. */
static int tell_growth(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    double growth;
    int most;
    int status = kmp_friction_grow(x, t, q, qd, &growth, &most);
    if (status == x->site->failed)
        x->site->forget(x->site->self);
    else
        KMP_FRICTION_TRY(status);
    if (status == 0 && growth >= 1)
        kmp_friction_tell(x, KMP_FRICTION_TELLS_GROWTH, most, t, growth);
    return 0;
}

KMP_LOCAL int kmp_friction_settle_modes(kmp_friction_run *x, double t, double *q, double *qd)
{
    for (int i = 0; i < x->count; i++) {
        x->element[i].was = x->element[i].stance;
        x->element[i].before_sense = x->element[i].sense;
    }
    KMP_FRICTION_TRY(x->past.known || !x->loads ? 0 : tell_growth(x, t, q, qd));
    double rate = x->site->pace(x->site->self, qd);
    x->site->look(x->site->self, t, q, qd, x->change);
    int status = kmp_friction_decide(x, t, q, qd, rate);
    if (status == 0 && x->rest > 0)
        status = set_modes(x, t, q, rate);
    if (status == 0)
        status = x->site->finish(x->site->self, t, q, qd);
    if (status == x->site->failed && x->site->is_unsettled(x->site->self))
        return kmp_friction_complain(x, t, q, qd);
    KMP_FRICTION_TRY(status);
    x->past.known = true;
    status = watch(x, t, x->site->pace(x->site->self, qd));
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        bool changes = !is_as_before(e);
        x->past.total += changes;
        bool leaves = e->smooth && e->stance != KMP_FRICTION_SMOOTH; /* it is no longer regularised */
        e->smooth = e->smooth && !leaves;
        if (leaves)
            kmp_friction_tell(x, KMP_FRICTION_TELLS_LEFT, i, t, e->regularise);
        if (changes)
            kmp_friction_tell(x, KMP_FRICTION_TELLS_CHANGE, i, t, e->sense);
        e->known = true;
        e->struck = false;
        e->stopped = 0;
        e->fired = false;
    }
    return status;
}
