/* SPDX-License-Identifier: BSD-3-Clause */
/* The part of their static levels with which friction elements keep a mechanism at rest: the least s for which forces
 * |f| <= s F exist with a + D f = 0. If the forces are unique, they give s. Otherwise s is bracketed, since every
 * larger part suffices as well. Levels that depend on multipliers are those at the forces that are found. */
#include "integrators/friction/friction_load.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/friction/friction_problem.h"
#include <math.h>
#include <string.h>

enum { MOST_DIVISIONS = 60, MOST_HALVINGS = 60 };

#define FAR_OFF    1e6  /* forces beyond this multiple of the largest one that a single element may need: none hold */
#define JUST_BELOW 1e-3 /* a part below the least one by this */
#define CLOSE      1e-8 /* to a bracket that rounding has ended */
#define UNIQUE     1e-6 /* A bound on forces that are not bounded by levels. */
static double far_away(const kmp_friction_run *x)
{
    double far = 0;
    for (int i = 0; i < x->rest; i++)
        if (x->d[i + i * x->rest] > 0)
            far = fmax(far, fabs(x->a[i]) / x->d[i + i * x->rest]);
    return FAR_OFF * far;
}

/* True for a closed contact without friction of its own: its force may be another one, as no level depends on it. */
static bool may_push(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    bool may = e->contact && !e->broken && x->found[i] > 0;
    for (int k = 0; k < x->count; k++)
        may = may && x->element[k].base != x->which[i];
    return may;
}

/* True if forces within a part of the levels (INFINITY: any) hold all elements that do not slip; they are in x->f. */
static bool suffices(kmp_friction_run *x, double part)
{
    double far = far_away(x);
    for (int i = 0; i < x->rest; i++) {
        const kmp_friction_element *e = &x->element[x->which[i]];
        if (e->contact) {
            bool pushes = may_push(x, i);
            x->f[i] = pushes && e->fired ? 0 : x->found[i]; /* friction has taken its load */
            x->lower[i] = pushes ? 0 : x->f[i];
            x->tried[i] = pushes && !e->fired ? fmax(far, x->f[i]) : x->f[i];
            continue;
        }
        bool free = e->implied || !(x->upper[i] > 0) || (x->spares && e->loaded);
        double most = free ? 0 : part < INFINITY ? part * x->upper[i] : far;
        double slip = -e->sense * fmax(kmp_friction_level_at(x, e, KMP_ROLE_LEVEL), 0);
        x->lower[i] = e->broken ? slip : -most;
        x->tried[i] = e->broken ? slip : most;
        x->f[i] = 0;
    }
    bool holds = kmp_friction_minimum(x, x->lower, x->tried) == KMP_BOX_FOUND;
    for (int i = 0; holds && i < x->rest; i++)
        holds = x->element[x->which[i]].broken || fabs(x->y[i]) <= kmp_friction_rounding(x, i);
    return holds;
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
    if (!suffices(x, INFINITY))
        return INFINITY;
    double high = 0, low = 0;
    for (int i = 0; i < x->rest; i++)
        if (x->f[i] != 0 && !x->element[x->which[i]].broken)
            high = fmax(high, kmp_friction_size(x, i) / x->upper[i]);
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

KMP_LOCAL void kmp_friction_share(kmp_friction_run *x)
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
    KMP_FRICTION_TRY(kmp_friction_pose(x, t, q, qd, 1 / x->site->numbers(x->site->self).span));
    double change = INFINITY;
    memset(x->f, 0, (size_t)x->count * sizeof *x->f);
    *part = 0;
    for (int pass = 0; pass < MOST_DIVISIONS && change > KMP_FRICTION_SETTLED && *part < INFINITY; pass++) {
        for (int i = 0; i < x->rest; i++)
            kmp_friction_put(x, &x->element[x->which[i]], KMP_ROLE_GIVEN, x->f[i]);
        KMP_FRICTION_TRY(kmp_friction_measure(x, t, q, qd));
        for (int i = 0; i < x->rest; i++) {
            const kmp_friction_element *e = &x->element[x->which[i]];
            double level = fmax(kmp_friction_level_at(x, e, KMP_ROLE_LEVEL), 0);
            x->upper[i] = fmax(kmp_friction_level_at(x, e, KMP_ROLE_STATIC), level);
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
    /* Forces by element in place of by number among those at rest. */
    for (int i = x->count - 1, k = x->rest - 1; i >= 0; i--) {
        bool rests = k >= 0 && x->which[k] == i;
        x->f[i] = rests ? x->f[k] : 0;
        x->upper[i] = rests ? x->upper[k] : fmax(kmp_friction_level_at(x, &x->element[i], KMP_ROLE_STATIC), 0);
        k -= rests;
    }
    return 0;
}
