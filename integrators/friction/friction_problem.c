/* SPDX-License-Identifier: BSD-3-Clause */
/* The decision on modes at a state: the box-constrained problem of the elements at rest, with levels that may depend on
 * its solution; where these do not settle, all combinations of modes. */
#include "integrators/friction/friction_problem.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/friction/shared_contacts.h"
#include <math.h>
#include <string.h>

/* The level in slip against rates of one sign; one without a limit does not grow. */
static double limited_level(const kmp_friction_run *x, const kmp_friction_element *e, double way)
{
    const double level = kmp_friction_level_at(x, e, KMP_ROLE_LEVEL, way);
    return level < INFINITY ? level : 0;
}

/* The growth of levels with friction at a state, and the element whose level grows most. No row is held afterwards. */
static int friction_grow(kmp_friction_run *x, double t, const double *q, const double *qd, double *growth, int *most)
{
    *growth = 0;
    *most = 0;
    for (int i = 0; i < x->count; i++)
        kmp_friction_set_given(x, &x->element[i], 0, 0);
    KMP_FRICTION_TRY(kmp_friction_choose(x, t, q));
    KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
    for (int i = 0; i < x->count; i++) {
        x->tried[i] = limited_level(x, &x->element[i], 1);
        x->under[i] = limited_level(x, &x->element[i], -1);
        x->aside[i] = 0;
    }
    for (int j = 0; j < x->count; j++) {
        if (x->element[j].contact) /* its force is not friction */
            continue;
        const double size = fmax(x->tried[j], x->under[j]);
        double unit = KMP_FRICTION_UNIT * (size > 0 ? size : 1); /* the sizes of reactions have kinks */
        kmp_friction_set_given(x, &x->element[j], unit, 0);
        KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
        for (int i = 0; i < x->count; i++) {
            const kmp_friction_element *e = &x->element[i];
            const double ahead = fabs(limited_level(x, e, 1) - x->tried[i]),
                         back = fabs(limited_level(x, e, -1) - x->under[i]);
            x->aside[i] += fmax(ahead, back) / unit;
        }
        kmp_friction_set_given(x, &x->element[j], 0, 0);
    }
    for (int i = 0; i < x->count; i++) {
        *most = x->aside[i] > *growth ? i : *most;
        *growth = fmax(*growth, x->aside[i]);
    }
    if (x->site->forget_loads)
        x->site->forget_loads(x->site->self);
    return 0;
}

/* Fails with the elements that can neither slip nor stick, and the growth of a level if that is the reason. */
static int friction_complain(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    for (int k = 0; k < x->rest; k++)
        x->element[x->which[k]].tries = true;
    if (friction_grow(x, t, q, qd, &x->growth, &x->most) != 0)
        x->growth = 0;
    x->site->forget(x->site->self);
    return x->site->fail(x->site->self, KMP_FRICTION_IMPOSSIBLE, t);
}

enum {
    MOST_LEVELS = 200, /* passes of the iteration for levels that depend on multipliers */
    MOST_TRIED = 6     /* elements whose modes are tried one after the other where it does not end */
};

/* -- the problem at a state ------------------------------------------------------------------------------ */

/* True if a contact is away from its surface, or leaves it. */
static bool is_open(const kmp_friction_run *x, const kmp_friction_element *e, double rate)
{
    if (x->pins)
        return !e->pinned;
    double size = e->size, gap = kmp_friction_at(x, e, KMP_ROLE_PLACE);
    return gap > KMP_TOUCH_NEAR * size ||
           kmp_friction_at(x, e, KMP_ROLE_RATE) > fmax(KMP_FRICTION_STILL * size * rate, e->stopped);
}

static void list_element(kmp_friction_run *x, int i)
{
    kmp_friction_set_given(x, &x->element[i], 0, 0);
    x->which[x->rest++] = i;
}

static void list_contact(kmp_friction_run *x, int i, double rate)
{
    kmp_friction_element *e = &x->element[i];
    if (x->pins)
        return;
    if (is_open(x, e, rate)) {
        kmp_friction_set_moving(x, e, 1, rate);
    } else {
        e->lift = e->was == KMP_FRICTION_SLIPS ? e->lift : 0;
        list_element(x, i);
    }
}

/* An element of friction. The friction of a closed contact takes part also where it slips, because its force depends on
 * the force of the contact. */
static void list_friction(kmp_friction_run *x, int i, double rate)
{
    kmp_friction_element *e = &x->element[i], *base = e->base < 0 ? NULL : &x->element[e->base];
    double v = kmp_friction_at(x, e, KMP_ROLE_RATE);
    double still = fmax(kmp_friction_still(x) * e->size * rate, e->stopped);
    if (e->was == KMP_FRICTION_SLIPS && e->sense != 0) /* at the event its rate is this one against its sense */
        still = fmax(still, (1 + KMP_FRICTION_TIE) * e->back);
    if (base && is_open(x, base, rate)) {
        kmp_friction_set_off(x, e);
    } else if (kmp_friction_stays_smooth(x, e)) {
        kmp_friction_set_smooth(x, e);
    } else if (fabs(v) <= still) {
        list_element(x, i);
    } else if (base) {
        list_element(x, i);
        e->rubs = v > 0 ? 1 : -1;
    } else {
        kmp_friction_set_moving(x, e, v > 0 ? 1 : -1, rate);
        x->locked = e->unlimited * v > 0 ? i : x->locked;
    }
}

/* The direction of slip that begins, at an event of others: of its rates v and the rates w that are added to them, as
 * in the equations. False: it does not begin, or its own event or an impact decides on it again. */
static bool goes_on_beginning(const kmp_friction_run *x, kmp_friction_element **pair, const double *v)
{
    const kmp_friction_element *contact = &x->element[pair[0]->base];
    double ww = 0, vv = 0, way[2];
    for (int k = 0; k < 2; k++) {
        ww += pair[k]->ahead * pair[k]->ahead;
        vv += v[k] * v[k];
    }
    if (!(ww > 0) || pair[0]->was != KMP_FRICTION_SLIPS || pair[0]->sense == 0 || pair[0]->turned || contact->struck)
        return false;
    for (int k = 0; k < 2; k++)
        way[k] = v[k] + pair[k]->ahead * (ww / (ww + vv));
    const double size = hypot(way[0], way[1]);
    for (int k = 0; k < 2; k++)
        pair[k]->along = way[k] / size;
    return size > 0;
}

/* Both components of slip in two directions. */
static void list_across(kmp_friction_run *x, int i, double rate)
{
    kmp_friction_element *pair[] = {&x->element[i], &x->element[x->element[i].twin]};
    double still = fmax(kmp_friction_halt(x, pair[0], rate), fmax(pair[0]->stopped, pair[1]->stopped)), v[2];
    for (int k = 0; k < 2; k++)
        v[k] = kmp_friction_at(x, pair[k], KMP_ROLE_RATE);
    if (pair[0]->was == KMP_FRICTION_SLIPS && pair[0]->sense != 0) /* at the event it has this rate */
        still = fmax(still, 2 * pair[0]->back);
    double size = hypot(v[0], v[1]);
    const bool begins = goes_on_beginning(x, pair, v);
    for (int k = 0; k < 2; k++) {
        if (is_open(x, &x->element[pair[k]->base], rate)) {
            kmp_friction_set_off(x, pair[k]);
            continue;
        }
        list_element(x, k == 0 ? i : pair[0]->twin);
        pair[k]->rubs = begins || size > still;
        pair[k]->begins = begins;
        pair[k]->along = begins ? pair[k]->along : size > still ? v[k] / size : 0;
    }
}

/* Lists the elements at rest; the others slip on. */
static void list_resting(kmp_friction_run *x, double rate)
{
    x->rest = 0;
    x->locked = -1;
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        e->broken = e->implied = e->begins = e->stays = e->beside = false;
        e->rubs = 0;
        e->still = KMP_FRICTION_STILL * e->size * rate * rate;
    }
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i];
        if (e->contact)
            list_contact(x, i, rate);
        else if (e->twin < 0)
            list_friction(x, i, rate);
        else if (e->twin > i)
            list_across(x, i, rate);
    }
}

/* True if a force on one element at rest accelerates the other, or bounds its force. */
static bool is_coupled(const kmp_friction_run *x, int i, int k)
{
    const kmp_friction_element *a = &x->element[x->which[i]], *b = &x->element[x->which[k]];
    return a->base == x->which[k] || b->base == x->which[i] || a->twin == x->which[k] || x->d[i + k * x->rest] != 0;
}

/* Finds the columns of D of the elements that may change, and of all that are connected with them, directly or through
 * others. Marks the others, which stay as they are. */
static int reach_connected(kmp_friction_run *x)
{
    enum { APART, REACHED, FOUND };
    bool goes_on = true;
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        /* An element that its row has held may stay, with nothing at this instant that would change it. */
        const bool may = e->was == KMP_FRICTION_HELD && e->known && !e->fired && !e->turned && !e->struck;
        x->side[k] = x->partly && may && e->stopped == 0 ? APART : REACHED;
    }
    while (goes_on) {
        goes_on = false;
        for (int k = 0; k < x->rest; k++) {
            if (x->side[k] != REACHED)
                continue;
            KMP_FRICTION_TRY(x->site->column(x->site->self, x->rest, x->rows, k, x->d + k * x->rest));
            x->side[k] = FOUND;
            for (int i = 0; i < x->rest; i++)
                if (x->side[i] == APART && is_coupled(x, i, k)) {
                    x->side[i] = REACHED;
                    goes_on = true;
                }
        }
    }
    for (int k = 0; k < x->rest; k++)
        x->element[x->which[k]].stays = x->side[k] == APART;
    return 0;
}

/* Leaves those out that stay as they are. */
static void leave_out(kmp_friction_run *x)
{
    const int n = x->rest;
    int kept = 0;
    for (int k = 0; k < n; k++)
        if (!x->element[x->which[k]].stays)
            x->side[kept++] = k;
    for (int k = 0; k < kept && kept < n; k++)
        for (int i = 0; i < kept; i++)
            x->d[i + k * kept] = x->d[x->side[i] + x->side[k] * n];
    for (int k = 0; k < kept; k++)
        x->which[k] = x->which[x->side[k]];
    x->partly = x->partly && kept < n;
    x->rest = kept;
}

/* D from the rows of the elements at rest. *known: false where accelerations are not linear in the forces. */
static int find_inertia(kmp_friction_run *x, double t, const double *q, bool *known)
{
    *known = false;
    if (!x->site->rows)
        return 0;
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        x->rows[k] = e->row;
        kmp_friction_set_held(x, e, kmp_friction_at(x, e, KMP_ROLE_PLACE));
    }
    x->site->rows(x->site->self, t, q, known);
    const int status = *known ? reach_connected(x) : 0;
    for (int k = 0; k < x->rest; k++)
        kmp_friction_set_given(x, &x->element[x->which[k]], 0, 0);
    if (*known)
        leave_out(x);
    return status;
}

/* D column by column, by forces of a size that occurs. Elements that slip with levels that depend on multipliers make
 * accelerations nonlinear in the forces: then these are small. */
static int measure_inertia(kmp_friction_run *x, double t, const double *q, const double *qd, bool nonlinear)
{
    const int n = x->rest;
    for (int j = 0; j < n; j++) {
        kmp_friction_element *by = &x->element[x->which[j]];
        double unit = (nonlinear ? KMP_FRICTION_UNIT : 1) * (x->upper[j] > 0 ? x->upper[j] : 1);
        kmp_friction_set_given(x, by, unit, 0);
        KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
        for (int i = 0; i < n; i++)
            x->d[i + j * n] = (kmp_friction_at(x, &x->element[x->which[i]], KMP_ROLE_ACCELERATION) - x->a[i]) / unit;
        kmp_friction_set_given(x, by, 0, 0);
    }
    return 0;
}

/* a0 and D, which is known or measured; rounding of what closures imply is removed. */
static int find_matrix(kmp_friction_run *x, double t, const double *q, const double *qd, double rate, bool known,
                       bool nonlinear)
{
    const int n = x->rest;
    for (int i = 0; i < n; i++) {
        const kmp_friction_element *e = &x->element[x->which[i]];
        bool none = e->implied &&
                    fabs(kmp_friction_at(x, e, KMP_ROLE_ACCELERATION)) <= KMP_FRICTION_STILL * e->size * rate * rate;
        x->a[i] = none ? 0 : kmp_friction_at(x, e, KMP_ROLE_ACCELERATION);
        x->upper[i] = fmax(limited_level(x, e, 1), limited_level(x, e, -1));
    }
    if (!known)
        KMP_FRICTION_TRY(measure_inertia(x, t, q, qd, nonlinear));
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (x->element[x->which[i]].implied || x->element[x->which[j]].implied)
                x->d[i + j * n] = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            x->d[i + j * n] = x->d[j + i * n] = (x->d[i + j * n] + x->d[j + i * n]) / 2;
    return 0;
}

/* The guess: the friction before. Elements that were at rest with a given force take all they can of the load of one
 * whose reserve is used up. That of a contact is used up where it has no load, with none to take: the sign of its force
 * is then due to rounding. */
static void guess(kmp_friction_run *x)
{
    int n = x->rest;
    for (int i = 0; i < n; i++)
        x->f[i] = x->element[x->which[i]].fired ? 0 : x->element[x->which[i]].before;
    for (int j = 0; j < n; j++) {
        const kmp_friction_element *of = &x->element[x->which[j]];
        for (int i = 0; i < n && of->fired && !of->contact; i++) {
            const kmp_friction_element *e = &x->element[x->which[i]];
            double along = x->d[i + j * n] * of->before;
            if (!e->contact && e->was == KMP_FRICTION_CARRIED && along != 0)
                x->f[i] = along > 0 ? INFINITY : -INFINITY;
        }
    }
}

/* The bounds at the levels of the last measurement. The direction of a component of slip that begins follows from the
 * accelerations. */
static void set_bounds(kmp_friction_run *x)
{
    for (int i = 0; i < x->rest; i++) {
        const kmp_friction_element *e = &x->element[x->which[i]];
        const double slip = fmax(kmp_friction_level_at(x, e, KMP_ROLE_LEVEL, e->sense), 0);
        const bool slips = e->broken && !(e->twin >= 0 && !e->rubs);
        x->under[i] = slips ? slip : kmp_friction_bound(x, e, 1);
        x->lower[i] = e->contact ? 0 : slips ? -e->sense * slip : -x->under[i];
        if (e->contact)
            x->upper[i] = e->broken ? 0 : INFINITY;
        else
            x->upper[i] = slips ? -e->sense * slip : kmp_friction_bound(x, e, -1);
    }
}

/* The minimum from the guess, and if rounding of D keeps that from an end, from no friction. If neither settles, modes
 * are tried. */
static int find_forces(kmp_friction_run *x, double t)
{
    kmp_box_outcome outcome = kmp_friction_minimum(x, x->lower, x->upper);
    if (outcome == KMP_BOX_UNSETTLED) {
        memset(x->f, 0, (size_t)x->rest * sizeof *x->f);
        outcome = kmp_friction_minimum(x, x->lower, x->upper);
    }
    x->open = outcome == KMP_BOX_UNSETTLED && x->rest <= MOST_TRIED;
    x->cause = x->open ? KMP_FRICTION_ROUNDED : x->cause;
    if (outcome == KMP_BOX_FOUND || x->open)
        return 0;
    for (int i = 0; i < x->rest; i++)
        x->locked = x->element[x->which[i]].unlimited != 0 ? x->which[i] : x->locked;
    if (outcome == KMP_BOX_UNBOUNDED && x->locked >= 0)
        return x->site->fail(x->site->self, KMP_FRICTION_JAMMED, t);
    return x->site->fail(x->site->self, outcome == KMP_BOX_UNBOUNDED ? KMP_FRICTION_FORCED : KMP_FRICTION_UNDECIDED, t);
}

/* Largest change of a force from the last pass, x->tried, over the largest force, or over forces that accelerate as
 * the motion does: where all of them vanish, as at a contact that closes without a load, changes are rounding. */
static double friction_changed(const kmp_friction_run *x)
{
    double most = 0, size = 0;
    for (int i = 0; i < x->rest; i++) {
        double inertia = x->d[i + i * x->rest], pace = x->element[x->which[i]].still / KMP_FRICTION_STILL;
        most = fmax(most, fabs(x->f[i] - x->tried[i]));
        size = fmax(size, fmax(fabs(x->f[i]), fabs(x->tried[i])));
        size = inertia > 0 ? fmax(size, pace / inertia) : size;
    }
    return size > 0 ? most / size : 0;
}

/* True if the change from the last pass accelerates nothing: where D is nearly singular, forces that hold an element
 * are not unique, and differ from pass to pass. */
static bool is_without_effect(const kmp_friction_run *x)
{
    double most = 0, size = 0;
    for (int i = 0; i < x->rest; i++) {
        double sum = 0, all = 0;
        for (int j = 0; j < x->rest; j++) {
            sum += x->d[i + j * x->rest] * (x->f[j] - x->tried[j]);
            all += fabs(x->d[i + j * x->rest] * x->f[j]);
        }
        most = fmax(most, fabs(sum));
        size = fmax(size, all);
    }
    return most <= KMP_FRICTION_ROUNDING * size;
}

/* Solves with levels that fit the multipliers of the solution. */
static int solve_levels(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    double changed = INFINITY;
    x->cause = KMP_FRICTION_LEVELS;
    set_bounds(x);
    KMP_FRICTION_TRY(find_forces(x, t));
    for (int pass = 0; pass < MOST_LEVELS && changed > KMP_FRICTION_SETTLED && x->loads && !x->open; pass++) {
        memcpy(x->tried, x->f, (size_t)x->rest * sizeof *x->f);
        for (int i = 0; i < x->rest; i++)
            kmp_friction_put(x, &x->element[x->which[i]], KMP_ROLE_GIVEN, x->f[i]);
        KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
        set_bounds(x);
        /* At the measured accelerations with the forces of the last pass, a + D f is these accelerations. */
        int n = x->rest;
        for (int i = 0; i < n; i++) {
            const kmp_friction_element *e = &x->element[x->which[i]];
            if (e->implied)
                continue;
            x->a[i] = kmp_friction_at(x, e, KMP_ROLE_ACCELERATION);
            for (int j = 0; j < n; j++)
                x->a[i] -= x->d[i + j * n] * x->f[j];
        }
        KMP_FRICTION_TRY(find_forces(x, t));
        changed = friction_changed(x);
    }
    x->open = x->open || (x->loads && changed > KMP_FRICTION_TIE && !is_without_effect(x));
    return 0;
}

/* -- the decision ---------------------------------------------------------------------------------------- */

KMP_LOCAL double kmp_friction_rounding(const kmp_friction_run *x, int i)
{
    double size = fabs(x->a[i]);
    for (int j = 0; j < x->rest; j++)
        size = fmax(size, fabs(x->d[i + j * x->rest] * x->f[j]));
    return KMP_FRICTION_ROUNDING * size;
}

/* The rest of the bounds of friction at rest beyond its force, and the larger one of them that is a limit. */
static double left_of(const kmp_friction_run *x, int i)
{
    if (x->partner[i] >= 0)
        return x->upper[i] - kmp_friction_size(x, i);
    return fmin(x->upper[i] - x->f[i], x->under[i] + x->f[i]);
}

static double limit_of(const kmp_friction_run *x, int i)
{
    const double up = x->upper[i] < INFINITY ? fabs(x->upper[i]) : 0, down = x->under[i] < INFINITY ? x->under[i] : 0;
    return x->element[x->which[i]].contact ? up : fmax(up, down);
}

/* True if what is left of the level of an element is rounding of what all elements can do to its acceleration. */
static bool is_at_bound(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    if (e->contact)
        return x->f[i] * x->d[i + i * x->rest] <= e->still && x->upper[i] > 0;
    double all = 0, left = left_of(x, i) * x->d[i + i * x->rest];
    for (int j = 0; j < x->rest; j++)
        all += fabs(x->d[i + j * x->rest] * limit_of(x, j));
    return left <= KMP_FRICTION_TIE * all && x->lower[i] < x->upper[i];
}

/* True if an element at its bound has no acceleration yet, but begins to slip: its reserve is used up, or the reserve
 * of another element whose load it shares. */
static bool is_exhausted(const kmp_friction_run *x, int i)
{
    bool with = false;
    for (int j = 0; j < x->rest; j++)
        with = with || (x->element[x->which[j]].fired && is_at_bound(x, j) && (i == j || x->d[i + j * x->rest] != 0));
    return with && is_at_bound(x, i);
}

/* True if another element, friction at rest that has a part of its level left, has the place of element i or a multiple
 * of it. An acceleration of only one of them, as of two feet with straight bars between them, shows that the places
 * differ. A contact whose load is used up stays closed there: it opens with the friction, at one instant. */
static bool is_kept(const kmp_friction_run *x, int i)
{
    int n = x->rest;
    bool kept = false;
    const kmp_friction_element *own = &x->element[x->which[i]];
    for (int k = 0; k < n && own->twin < 0 && fabs(x->y[i]) <= own->still; k++) {
        double product = x->d[i + i * n] * x->d[k + k * n], cross = x->d[i + k * n];
        bool one = cross * cross >= (1 - KMP_FRICTION_ONE_PLACE) * product && product > 0;
        const kmp_friction_element *e = &x->element[x->which[k]];
        kept = kept || (k != i && one && !e->broken && !e->contact && !is_at_bound(x, k) &&
                        limit_of(x, k) * x->d[k + k * n] > e->still);
    }
    return kept;
}

/* True for a contact that was open, whose surfaces touch without a force: it stays open. Closed, it would open again at
 * once, as the sign of its force is due to rounding. */
static bool stays_open(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    return e->contact && e->known && e->was == KMP_FRICTION_SLIPS && !e->struck && is_at_bound(x, i);
}

/* Lets both components slip where the solution accelerates them, or their reserve is used up. True: they are new. */
static bool break_across(kmp_friction_run *x, int i)
{
    int j = x->partner[i];
    kmp_friction_element *e = &x->element[x->which[i]], *other = &x->element[x->which[j]];
    double none = fmax(kmp_friction_rounding(x, i), kmp_friction_rounding(x, j));
    bool moves = x->side[i] != 0 && hypot(x->y[i], x->y[j]) > none, before = e->broken;
    if (e->rubs || !(before || moves || is_exhausted(x, i)))
        return false;
    /* The direction in which slip begins: of its acceleration, or against its force. */
    double size = hypot(x->f[i], x->f[j]);
    const double pace = hypot(x->y[i], x->y[j]);
    e->sense = size > 0 ? -x->f[i] / size : pace > 0 ? x->y[i] / pace : 1;
    other->sense = size > 0 ? -x->f[j] / size : pace > 0 ? x->y[j] / pace : 0;
    e->broken = other->broken = true;
    return !before;
}

/* Lets the elements slip that the solution accelerates, or whose reserve is used up. True: there are new ones. */
static bool break_away(kmp_friction_run *x)
{
    bool any = false;
    for (int i = 0; i < x->rest; i++) {
        kmp_friction_element *e = &x->element[x->which[i]];
        if (e->twin >= 0) {
            any = (x->partner[i] > i && break_across(x, i)) || any;
            continue;
        }
        bool moves = x->side[i] != 0 && fabs(x->y[i]) > kmp_friction_rounding(x, i);
        if (e->broken || !(moves || is_exhausted(x, i) || stays_open(x, i)) || is_kept(x, i))
            continue;
        e->broken = any = true;
        e->sense = e->contact ? 1 : moves ? (x->y[i] > 0 ? 1 : -1) : (x->f[i] > 0 ? -1 : 1);
    }
    return any;
}

/* -- modes one after the other ----------------------------------------------------------------------------- */

/* Direction of element k of the elements at rest in combination `code`; the mode before comes first. */
static int direction(const kmp_friction_element *e, int code, int k)
{
    int before = e->was == KMP_FRICTION_SLIPS ? (e->before_sense > 0) - (e->before_sense < 0) : 0;
    before = e->rubs ? e->rubs : before;
    for (; k > 0; k--)
        code /= 3;
    return (before + 1 + code % 3) % 3 - 1;
}

/* False where a contact would move into its surface, or friction that slips would do anything else. */
static bool is_allowed(const kmp_friction_run *x, int code)
{
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        int way = direction(e, code, k);
        if ((e->contact && way < 0) || (e->rubs && way != e->rubs) || e->unlimited * way > 0)
            return false;
    }
    return true;
}

/* Sets the modes of a combination, and computes accelerations with them. */
static int try_modes(kmp_friction_run *x, int code, double t, const double *q, const double *qd)
{
    bool adds;
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        kmp_friction_set_slip(x, e, direction(e, code, k), 0);
    }
    KMP_FRICTION_TRY(kmp_friction_choose(x, t, q));
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        if (e->implied || direction(e, code, k) != 0)
            continue;
        KMP_FRICTION_TRY(kmp_friction_adds_row(x, e, t, q, &adds));
        if (!adds)
            kmp_friction_set_given(x, e, 0, 0);
    }
    return kmp_friction_measure(x, t, q, qd);
}

/* True if accelerations and forces of the last measurement agree with the modes; keeps the forces. */
static bool is_consistent(kmp_friction_run *x, int code, double rate)
{
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        double least = -KMP_FRICTION_STILL * e->size * rate * rate;
        int way = direction(e, code, k);
        x->f[k] = kmp_friction_at(x, e, KMP_ROLE_GIVEN);
        const kmp_role role = way ? KMP_ROLE_LEVEL : KMP_ROLE_STATIC;
        x->upper[k] = kmp_friction_level_at(x, e, role, way ? way : -1);
        x->under[k] = kmp_friction_level_at(x, e, role, way ? way : 1);
        const double tie = e->fired ? 1 - KMP_FRICTION_TIE : 1 + KMP_FRICTION_TIE;
        if (e->rubs || (e->contact && !way && x->f[k] * x->d[k + k * x->rest] >= (e->fired ? e->still : 0)))
            continue;
        const bool holds = x->f[k] <= tie * x->upper[k] && -x->f[k] <= tie * x->under[k];
        if (way ? way * kmp_friction_at(x, e, KMP_ROLE_ACCELERATION) < least : !holds)
            return false;
    }
    return true;
}

static bool may_be_smooth(const kmp_friction_element *e)
{
    return e->regularise > 0 && e->loaded && !e->smooth;
}

/* The number of elements at rest that may be regularised, and the first one. */
static int list_smooth(const kmp_friction_run *x, int *first)
{
    int count = 0;
    *first = -1;
    for (int k = x->rest; k-- > 0;)
        if (may_be_smooth(&x->element[x->which[k]])) {
            *first = x->which[k];
            count++;
        }
    return count;
}

/* Regularises the element at rest whose level grows most with friction, of the elements that allow it. True: there is
 * one, and the modes of all others are to be set again. */
static bool make_smooth(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    double growth;
    int chosen, most = -1, count = list_smooth(x, &chosen);
    if (count == 0)
        return false;
    if (count > 1 && friction_grow(x, t, q, qd, &growth, &most) != 0)
        x->site->forget(x->site->self);
    for (int k = 0; k < x->rest && count > 1; k++)
        chosen = x->which[k] == most && may_be_smooth(&x->element[most]) ? most : chosen;
    x->element[chosen].smooth = x->again = true;
    x->element[chosen].smooth_t = t;
    return true;
}

/* Tries all combinations of modes, and takes the first one that is consistent. */
static int enumerate(kmp_friction_run *x, double t, const double *q, const double *qd, double rate)
{
    int total = 1, first = -1, found = 0;
    x->tried_modes = 0;
    for (int k = 0; k < x->rest; k++)
        if (x->partner[k] >= 0) /* their directions are not combinations */
            return friction_complain(x, t, q, qd);
    for (int k = 0; k < x->rest && k < MOST_TRIED; k++)
        total *= 3;
    for (int code = 0; code < total && x->rest <= MOST_TRIED; code++) {
        if (!is_allowed(x, code))
            continue;
        x->tried_modes++;
        int status = try_modes(x, code, t, q, qd);
        if (status == x->site->failed)
            x->site->forget(x->site->self); /* no solution with these modes */
        else
            KMP_FRICTION_TRY(status);
        bool good = status == 0 && is_consistent(x, code, rate);
        first = good && first < 0 ? code : first;
        found += good;
    }
    if (found != 1 && make_smooth(x, t, q, qd))
        return 0;
    if (first < 0)
        return friction_complain(x, t, q, qd);
    if (found > 1)
        kmp_friction_report(x, KMP_FRICTION_FACT_SEVERAL, -1, t, found);
    KMP_FRICTION_TRY(try_modes(x, first, t, q, qd));
    (void)is_consistent(x, first, rate);
    for (int k = 0; k < x->rest; k++) { /* the ones that slip break away */
        kmp_friction_element *e = &x->element[x->which[k]];
        e->sense = direction(e, first, k);
        e->broken = e->sense != 0;
    }
    return 0;
}

/* True if an element that breaks away is accelerated against its slip by the levels of slip. */
static bool turns_back(const kmp_friction_run *x)
{
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        double least = e->contact ? e->still : kmp_friction_rounding(x, k);
        if (e->broken && !e->rubs && e->twin < 0 && e->sense * x->y[k] < -least)
            return true;
    }
    return false;
}

/* Solves, with the level of slip for elements that break away. */
static int solve_modes(kmp_friction_run *x, double t, const double *q, const double *qd, double rate)
{
    x->open = false;
    KMP_FRICTION_TRY(solve_levels(x, t, q, qd));
    while (!x->open && break_away(x))
        KMP_FRICTION_TRY(solve_levels(x, t, q, qd));
    if (!x->open && !turns_back(x))
        return 0;
    x->cause = x->open ? x->cause : KMP_FRICTION_REVERSES;
    return enumerate(x, t, q, qd, rate);
}

/* True if an element that is not listed makes accelerations nonlinear in the forces: friction whose level depends on
 * multipliers, as it slips or is regularised. That of a contact is listed while it is closed, and zero while it is
 * open. */
static bool is_nonlinear(const kmp_friction_run *x)
{
    bool any = false;
    for (int i = 0, k = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i];
        const bool listed = k < x->rest && x->which[k] == i;
        const bool follows = e->base >= 0 ? e->stance == KMP_FRICTION_SMOOTH : e->loaded;
        any = any || (follows && !listed);
        k += listed;
    }
    return any;
}

/* Sets up the problem of the elements that are listed: x->a, d, and the levels in x->upper. */
static int pose_listed(kmp_friction_run *x, double t, const double *q, const double *qd, double rate)
{
    bool known = false;
    KMP_FRICTION_TRY(kmp_friction_choose(x, t, q));
    if (x->rest == 0)
        return 0;
    KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
    const bool nonlinear = is_nonlinear(x);
    if (!nonlinear)
        KMP_FRICTION_TRY(find_inertia(x, t, q, &known));
    x->partly = x->partly && known;
    kmp_friction_pair_components(x, x->rest, x->which, x->partner);
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        bool adds;
        if (e->rubs)
            continue;
        KMP_FRICTION_TRY(kmp_friction_is_independent(x, e, t, q, &adds));
        e->implied = !adds;
        kmp_friction_set_given(x, e, 0, 0);
    }
    return find_matrix(x, t, q, qd, rate, known, nonlinear);
}

/* Sets up the problem of the elements at rest: x->which, a, d, and the levels in x->upper. */
static int friction_pose(kmp_friction_run *x, double t, const double *q, const double *qd, double rate)
{
    list_resting(x, rate);
    if (x->locked >= 0)
        return x->site->fail(x->site->self, KMP_FRICTION_LOCKED, t);
    return pose_listed(x, t, q, qd, rate);
}

/* True if an element may be regularised, and levels grow so much that there may be several solutions. */
static int may_be_several(kmp_friction_run *x, double t, const double *q, const double *qd, double rate, bool *may)
{
    double growth = 0;
    int first, most;
    *may = list_smooth(x, &first) > 0;
    if (!*may)
        return 0;
    int status = friction_grow(x, t, q, qd, &growth, &most);
    if (status == x->site->failed)
        x->site->forget(x->site->self);
    else
        KMP_FRICTION_TRY(status);
    *may = (status == x->site->failed || growth >= 1) && x->rest <= MOST_TRIED;
    return friction_pose(x, t, q, qd, rate); /* the growth was found without any modes */
}

/* Decides which elements at rest slip (`broken`, `sense`); x->f has the forces of the others. `rate`: of the motion,
 * 1/s. */
static int friction_decide(kmp_friction_run *x, double t, const double *q, const double *qd, double rate)
{
    bool several;
    do {
        x->again = false;
        KMP_FRICTION_TRY(friction_pose(x, t, q, qd, rate));
        if (x->rest == 0)
            return 0;
        KMP_FRICTION_TRY(may_be_several(x, t, q, qd, rate, &several));
        guess(x);
        for (int k = 0; k < x->rest; k++) { /* friction that slips keeps its direction */
            kmp_friction_element *e = &x->element[x->which[k]];
            e->broken = e->rubs != 0;
            e->sense = e->twin >= 0 && e->rubs ? e->along : e->rubs;
        }
        x->cause = KMP_FRICTION_LEVELS;
        KMP_FRICTION_TRY((several ? enumerate : solve_modes)(x, t, q, qd, rate));
    } while (x->again);
    return 0;
}

/* The part of their static levels with which friction elements keep a mechanism at rest: the least s for which forces
 * |f| <= s F exist with a + D f = 0. If the forces are unique, they give s. Otherwise s is bracketed, since every
 * larger part suffices as well. Levels that depend on multipliers are taken at the forces that are found. */

enum { MOST_DIVISIONS = 60, MOST_HALVINGS = 60 };

#define FAR_OFF    1e6  /* forces beyond this multiple of the largest one that a single element may need: none hold */
#define JUST_BELOW 1e-3 /* a part below the least one by this */
#define CLOSE      1e-8 /* to a bracket that rounding has ended */
#define UNIQUE     1e-6 /* A bound on forces that are not bounded by levels. */

/* True for a closed contact without friction: its force may be another one, as no level depends on it. */
static bool may_push(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    bool may = e->contact && !e->broken && x->found[i] > 0;
    for (int k = 0; k < x->count; k++)
        may = may && x->element[k].base != x->which[i];
    return may;
}

/* A part of a level, which may be without a limit, as `part` may be. */
static double part_of(double part, double level, double far)
{
    return !(level > 0) ? 0 : part < INFINITY && level < INFINITY ? part * level : far;
}

/* Finds the forces x->f within a part of the levels (INFINITY: any) that hold the elements that do not slip best. */
static bool find_within(kmp_friction_run *x, double part)
{
    double far = 0;
    for (int i = 0; i < x->rest; i++)
        if (x->d[i + i * x->rest] > 0)
            far = fmax(far, FAR_OFF * (fabs(x->a[i]) / x->d[i + i * x->rest]));
    for (int i = 0; i < x->rest; i++) {
        const kmp_friction_element *e = &x->element[x->which[i]];
        if (e->contact) {
            bool pushes = may_push(x, i);
            x->f[i] = pushes && e->fired ? 0 : x->found[i]; /* friction has taken its load */
            x->lower[i] = pushes ? 0 : x->f[i];
            x->tried[i] = pushes && !e->fired ? fmax(far, x->f[i]) : x->f[i];
            continue;
        }
        const bool free = e->implied || (x->spares && e->loaded);
        const double slip = -e->sense * fmax(kmp_friction_level_at(x, e, KMP_ROLE_LEVEL, e->sense), 0);
        x->lower[i] = e->broken ? slip : free ? 0 : -part_of(part, x->under[i], far);
        x->tried[i] = e->broken ? slip : free ? 0 : part_of(part, x->upper[i], far);
        x->f[i] = 0;
    }
    return kmp_friction_minimum(x, x->lower, x->tried) == KMP_BOX_FOUND;
}

/* True if forces within a part of the levels hold all elements that do not slip; they are in x->f. */
static bool suffices(kmp_friction_run *x, double part)
{
    bool holds = find_within(x, part);
    for (int i = 0; holds && i < x->rest; i++)
        holds = x->element[x->which[i]].broken || fabs(x->y[i]) <= kmp_friction_rounding(x, i);
    return holds;
}

/* True if without forces each acceleration is rounding of what its own level can do: there is nothing to divide. */
static bool needs_none(kmp_friction_run *x)
{
    bool none = find_within(x, 0);
    for (int i = 0; none && i < x->rest; i++) {
        const kmp_friction_element *e = &x->element[x->which[i]];
        const double able = e->contact ? 0 : fabs(x->d[i + i * x->rest]) * limit_of(x, i);
        none = e->broken || fabs(x->y[i]) <= KMP_FRICTION_ROUNDING * able;
    }
    return none;
}

/* Below the least part the largest acceleration falls linearly with the part, as long as the same forces are at their
 * bounds: its zero is more exact than a bracket, where tolerances of rounding decide. */
static double refine(kmp_friction_run *x, double part)
{
    double at[2] = {part * (1 - JUST_BELOW), part * (1 - 2 * JUST_BELOW)}, y[2];
    int most = 0;
    (void)suffices(x, at[0]);
    for (int i = 0; i < x->rest; i++)
        most = fabs(x->y[i]) > fabs(x->y[most]) ? i : most;
    y[0] = x->y[most];
    (void)suffices(x, at[1]);
    y[1] = x->y[most];
    double zero = at[0] + y[0] * (at[0] - at[1]) / (y[1] - y[0]);
    return fabs(zero - part) <= CLOSE * part ? zero : part;
}

/* The least part with the levels in x->upper, and its forces. */
static double least_part(kmp_friction_run *x)
{
    if (needs_none(x))
        return 0;
    if (!suffices(x, INFINITY))
        return INFINITY;
    double high = 0, low = 0;
    for (int i = 0; i < x->rest; i++)
        if (x->f[i] != 0 && !x->element[x->which[i]].broken)
            high = fmax(high, kmp_friction_size(x, i) / (x->f[i] < 0 ? x->under[i] : x->upper[i]));
    bool unique = high == 0 || !suffices(x, high * (1 - UNIQUE));
    for (int k = 0; !unique && k < MOST_HALVINGS; k++) {
        double part = (low + high) / 2;
        if (suffices(x, part))
            high = part;
        else
            low = part;
    }
    (void)suffices(x, unique ? INFINITY : high);
    if (unique)
        return high;
    memcpy(x->aside, x->f, (size_t)x->rest * sizeof *x->f);
    double part = refine(x, high);
    memcpy(x->f, x->aside, (size_t)x->rest * sizeof *x->f);
    return part;
}

/* Divides the load of the elements that do not slip in x->f so that the largest part of a static level is least; if
 * possible without elements whose level depends on multipliers, and may fall at any time. */
static void friction_share(kmp_friction_run *x)
{
    memcpy(x->found, x->f, (size_t)x->rest * sizeof *x->f);
    x->spares = true;
    bool divided = least_part(x) <= 1;
    x->spares = false;
    if (!divided && least_part(x) > 1)
        memcpy(x->f, x->found, (size_t)x->rest * sizeof *x->f);
}

KMP_LOCAL int kmp_friction_load(kmp_friction_run *x, double t, const double *q, const double *qd, double *part)
{
    KMP_FRICTION_TRY(friction_pose(x, t, q, qd, 1 / x->site->numbers(x->site->self).span));
    double change = INFINITY;
    memset(x->f, 0, (size_t)x->count * sizeof *x->f);
    *part = 0;
    for (int pass = 0; pass < MOST_DIVISIONS && change > KMP_FRICTION_SETTLED && *part < INFINITY; pass++) {
        for (int i = 0; i < x->rest; i++)
            kmp_friction_put(x, &x->element[x->which[i]], KMP_ROLE_GIVEN, x->f[i]);
        KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
        for (int i = 0; i < x->rest; i++) {
            const kmp_friction_element *e = &x->element[x->which[i]];
            x->upper[i] = kmp_friction_bound(x, e, -1);
            x->under[i] = kmp_friction_bound(x, e, 1);
        }
        double before = *part;
        *part = least_part(x);
        change = pass == 0 && x->loads ? INFINITY : fabs(*part - before) / *part;
    }
    if (change > KMP_FRICTION_TIE && *part < INFINITY)
        return x->site->fail(x->site->self, KMP_FRICTION_UNDECIDED, t);
    for (int i = 0; i < x->rest; i++)
        kmp_friction_put(x, &x->element[x->which[i]], KMP_ROLE_GIVEN, x->f[i]);
    KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
    /* Forces by element in place of by number among the elements at rest. */
    for (int i = x->count - 1, k = x->rest - 1; i >= 0; i--) {
        const bool rests = k >= 0 && x->which[k] == i;
        const double f = rests ? x->f[k] : 0;
        x->upper[i] = !rests  ? fmax(kmp_friction_level_at(x, &x->element[i], KMP_ROLE_STATIC, 1), 0)
                      : f < 0 ? x->under[k]
                              : x->upper[k];
        x->f[i] = f;
        k -= rests;
    }
    return 0;
}

/* Modes of all elements at a state: the decision, rows that are held, and what changes. */

/* That of a contact is its force, by which it can be relieved. */
static double reserve(const kmp_friction_run *x, int i)
{
    return x->element[x->which[i]].contact ? x->f[i] : left_of(x, i);
}

/* True for a contact with a force. One without would open at once by rounding where friction can hold its place. */
static bool pushes(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    return e->contact && x->f[i] * x->d[i + i * x->rest] > e->still;
}

/* True if the row of element j comes before the row of i: contacts that push first, then by their reserve. */
static bool is_before(const kmp_friction_run *x, int j, int i)
{
    bool first = pushes(x, j), second = pushes(x, i);
    double a = reserve(x, j), b = reserve(x, i);
    return first != second ? first : a > b || (a == b && j < i);
}

/* Lists the elements at rest in x->side, which the decision has used: rows with the largest reserve first. */
static void order_by_reserve(kmp_friction_run *x)
{
    memset(x->side, 0, (size_t)x->rest * sizeof *x->side);
    for (int i = 0; i < x->rest; i++) {
        int above = 0;
        for (int j = 0; j < x->rest; j++)
            above += is_before(x, j, i);
        x->side[above] = i;
    }
}

/* Sets the modes of the elements at rest. Rows that others imply are not added: the rows of the elements with the
 * largest reserve come first. */
static int set_modes(kmp_friction_run *x, double t, const double *q, double rate)
{
    if (x->loads) /* levels may fall below forces that are given */
        friction_share(x);
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
    order_by_reserve(x);
    for (int k = 0; k < x->rest; k++) {
        int i = x->side[k];
        kmp_friction_element *e = &x->element[x->which[i]];
        bool adds = false;
        if (e->broken || (e->base >= 0 && x->element[e->base].broken))
            continue;
        if (!e->implied)
            KMP_FRICTION_TRY(kmp_friction_adds_row(x, e, t, q, &adds));
        if (adds)
            continue;
        /* It keeps its force, unless that is rounding: the scale of all accelerations would exceed a level that is
         * rounding as well. */
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
    if (e->across == 2) /* the first component decides for both */
        return true;
    bool off = e->stance == KMP_FRICTION_SLIPS && (e->contact ? !e->known : e->sense == 0);
    return off || (e->known && (rests ? rested : e->stance == e->was && e->sense == e->before_sense));
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
    bool any = false;
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        bool changes = e->fired || !is_as_before(e);
        e->changes = (begins ? 0 : e->changes) + changes;
        any = any || changes;
    }
    x->past.changes += any;
    bool goes_on = x->past.repeats < KMP_FRICTION_REPEATS && x->past.changes < KMP_FRICTION_CROWDED;
    return goes_on ? 0 : x->site->fail(x->site->self, KMP_FRICTION_ALTERNATES, t);
}

/* Tells at the start of levels that grow so much with the friction that there may be several solutions or none. */
static int report_growth(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    double growth;
    int most;
    int status = friction_grow(x, t, q, qd, &growth, &most);
    if (status == x->site->failed)
        x->site->forget(x->site->self);
    else
        KMP_FRICTION_TRY(status);
    if (status == 0 && growth >= 1)
        kmp_friction_report(x, KMP_FRICTION_FACT_GROWTH, most, t, growth);
    return 0;
}

/* Decides, sets modes and evaluates the site with them. */
static int decide_and_set(kmp_friction_run *x, double t, double *q, double *qd)
{
    const double rate = x->site->pace(x->site->self, qd);
    x->site->look(x->site->self, t, q, qd, x->change);
    int status = friction_decide(x, t, q, qd, rate);
    if (status == 0 && x->rest > 0)
        status = set_modes(x, t, q, rate);
    bool any = false;
    for (int i = 0; status == 0 && i < x->count; i++) { /* holds the elements that stay as they are */
        kmp_friction_element *e = &x->element[i];
        if (e->stays)
            kmp_friction_set_held(x, e, kmp_friction_at(x, e, KMP_ROLE_PLACE));
        any = any || e->stays;
    }
    if (any)
        status = kmp_friction_choose(x, t, q);
    return status == 0 ? x->site->finish(x->site->self, t, q, qd, x->partly ? x->change : NULL) : status;
}

/* True if all that stay as they are have a reserve left in the motion that follows. Forces and inertia are then the
 * same as in a decision of all: it is unique. */
static bool all_stay(const kmp_friction_run *x)
{
    double most = 0, least = INFINITY;
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i];
        most = fmax(most, fabs(kmp_friction_at(x, e, KMP_ROLE_GIVEN)));
        least = e->stays ? fmin(least, kmp_friction_at(x, e, KMP_ROLE_HELD)) : least;
    }
    return least > KMP_FRICTION_TIE * most;
}

/* First of the elements that are connected with what has changed, if they can be decided separately; otherwise, and
 * where that does not leave the others as they are, of all. */
static int decide_connected(kmp_friction_run *x, double t, double *q, double *qd)
{
    const size_t n = (size_t)x->n * sizeof *q, elements = (size_t)x->count * sizeof *x->element;
    x->partly = x->kept != NULL && !x->pins;
    for (int i = 0; i < x->count; i++) /* levels that depend on other multipliers connect all */
        x->partly = x->partly && !(x->element[i].loaded && x->element[i].base < 0);
    if (!x->partly)
        return decide_and_set(x, t, q, qd);
    memcpy(x->kept, q, n);
    memcpy(x->kept + x->n, qd, n);
    memcpy(x->kept_element, x->element, elements);
    int status = decide_and_set(x, t, q, qd);
    if (status != x->site->failed && (status != 0 || all_stay(x)))
        return status;
    x->site->forget(x->site->self);
    memcpy(q, x->kept, n);
    memcpy(qd, x->kept + x->n, n);
    memcpy(x->element, x->kept_element, elements);
    x->partly = false;
    kmp_friction_let_go(x);
    return decide_and_set(x, t, q, qd);
}

KMP_LOCAL int kmp_friction_settle_modes(kmp_friction_run *x, double t, double *q, double *qd)
{
    for (int i = 0; i < x->count; i++) {
        x->element[i].was = x->element[i].stance;
        x->element[i].before_sense = x->element[i].sense;
    }
    KMP_FRICTION_TRY(x->past.known || !x->loads ? 0 : report_growth(x, t, q, qd));
    int status = decide_connected(x, t, q, qd);
    if (status == x->site->failed && x->site->is_unsettled(x->site->self)) {
        x->cause = KMP_FRICTION_LOADS;
        x->tried_modes = 1;
        return friction_complain(x, t, q, qd);
    }
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
            kmp_friction_report(x, KMP_FRICTION_FACT_LEFT, i, t, e->regularise);
        if (changes)
            kmp_friction_report(x, KMP_FRICTION_FACT_CHANGE, i, t, e->sense);
        e->known = true;
        e->struck = false;
        e->stopped = 0;
        e->fired = e->turned = false;
    }
    if (status == 0)
        kmp_friction_find_shared(x, t);
    return status;
}

/* -- between decisions ----------------------------------------------------------------------------------- */

static bool rests_now(const kmp_friction_element *e)
{
    return e->stance == KMP_FRICTION_HELD || e->stance == KMP_FRICTION_CARRIED || e->beside;
}

/* Lists elements with their present modes: what rests, and friction that slips on closed contacts. */
static void list_present(kmp_friction_run *x, double rate)
{
    x->rest = 0;
    x->partly = false;
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        const kmp_friction_element *twin = e->twin >= 0 ? &x->element[e->twin] : e;
        const bool closed = e->base >= 0 && rests_now(&x->element[e->base]);
        e->broken = e->beside;
        e->implied = e->stays = false;
        e->rubs = 0;
        e->still = KMP_FRICTION_STILL * e->size * rate * rate;
        if (!closed && !rests_now(e) && !rests_now(twin))
            continue;
        const double v = kmp_friction_at(x, e, KMP_ROLE_RATE) + (e->twin < 0 ? 0 : e->ahead),
                     other = e->twin < 0 ? 0 : kmp_friction_at(x, twin, KMP_ROLE_RATE) + twin->ahead,
                     speed = hypot(v, other);
        if (closed && !rests_now(e) && !rests_now(twin) && speed > kmp_friction_still(x) * e->size * rate) {
            e->broken = true;
            e->rubs = e->twin < 0 && v < 0 ? -1 : 1;
            e->along = e->sense = v / speed;
        }
        x->found[x->rest] = kmp_friction_at(x, e, KMP_ROLE_GIVEN);
        x->which[x->rest++] = i;
    }
}

KMP_LOCAL bool kmp_friction_may_share(const kmp_friction_run *x)
{
    bool more = false, rubs = false;
    for (int i = 0; i < x->count && !x->past.felt; i++) {
        const kmp_friction_element *e = &x->element[i];
        more = more || kmp_sharing_is_carried(e);
        rubs = rubs || kmp_sharing_is_felt_by(e);
    }
    return more && rubs;
}

KMP_LOCAL int kmp_friction_examine(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    const double rate = x->site->pace(x->site->self, qd);
    list_present(x, rate);
    for (int k = 0; k < x->rest; k++)
        kmp_friction_set_given(x, &x->element[x->which[k]], 0, 0);
    KMP_FRICTION_TRY(pose_listed(x, t, q, qd, rate));
    memcpy(x->f, x->found, (size_t)x->rest * sizeof *x->f);
    return kmp_friction_find_present(x, t, q, qd);
}
