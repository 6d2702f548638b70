/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/impact/impact_problem.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/shared_contacts.h"
#include "integrators/impact/impact_inside.h"
#include <math.h>
#include <string.h>

enum {
    MOST_PASSES = 600, /* of the iteration for bounds of friction */
    PATIENCE = 60      /* passes with bounds that alternate after which they follow by half as much */
};

KMP_LOCAL kmp_friction_element *kmp_impact_element(const kmp_impact_run *p, int k)
{
    return &p->friction->element[p->which[k]];
}

static void *self_of(const kmp_impact_run *p)
{
    return p->friction->site->self;
}

/* -- who takes part -------------------------------------------------------------------------------------- */

/* Contacts whose surfaces touch, with their friction, and elements without a limit. True: a contact strikes; p->side is
 * then 1. */
static bool list_touching(kmp_impact_run *p, double rate)
{
    const kmp_friction_run *x = p->friction;
    bool strikes = false;
    p->count = 0;
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i], *base = e->base >= 0 ? &x->element[e->base] : e;
        double v = kmp_friction_at(x, e, KMP_ROLE_RATE), still = KMP_FRICTION_STILL * e->size * rate;
        const bool touches = base->contact && kmp_friction_at(x, base, KMP_ROLE_PLACE) <= KMP_TOUCH_NEAR * base->size;
        if (!touches && e->unlimited == 0)
            continue;
        bool hits = e->contact && v < -still;
        p->v[p->count] = v;
        p->e[p->count] = hits ? kmp_friction_at(x, e, KMP_ROLE_LEVEL) : 0;
        p->side[p->count] = hits;
        p->which[p->count++] = i;
        strikes = strikes || hits;
    }
    return strikes;
}

/* -- the impulses ------------------------------------------------------------------------------------------ */

/* The closures imply some rows: no impulse along these changes a rate. */
static int clear_implied(kmp_impact_run *p, double t, const double *q)
{
    for (int k = 0; k < p->count; k++) {
        bool adds;
        kmp_friction_put(p->friction, kmp_impact_element(p, k), KMP_ROLE_HELD, 1);
        int status = p->friction->site->adds(self_of(p), t, q, &adds);
        kmp_friction_put(p->friction, kmp_impact_element(p, k), KMP_ROLE_HELD, 0);
        KMP_FRICTION_TRY(status);
        for (int i = 0; i < p->n && !adds; i++)
            p->row[k * p->n + i] = p->way[k * p->n + i] = 0;
    }
    return 0;
}

/* The rate of element k by a unit impulse along another one. Rows have few entries, from `first` to `last`. */
static double rate_by(const kmp_impact_run *p, int k, int other)
{
    const double *row = p->row + k * p->n, *way = p->way + other * p->n;
    double sum = 0;
    for (int i = p->first[k]; i < p->last[k]; i++)
        sum += row[i] * way[i];
    return sum;
}

/* The rows of all that touch. */
static void find_rows(kmp_impact_run *p, double t, const double *q)
{
    int *rows = p->first;
    for (int k = 0; k < p->count; k++) {
        rows[k] = kmp_impact_element(p, k)->row;
        kmp_friction_put(p->friction, kmp_impact_element(p, k), KMP_ROLE_HELD, 1);
    }
    p->site->rows(self_of(p), t, q, p->count, rows, p->row);
    for (int k = 0; k < p->count; k++) {
        const double *row = p->row + k * p->n;
        kmp_friction_put(p->friction, kmp_impact_element(p, k), KMP_ROLE_HELD, 0);
        p->first[k] = 0;
        p->last[k] = p->n;
        while (p->first[k] < p->last[k] && row[p->first[k]] == 0)
            p->first[k]++;
        while (p->last[k] > p->first[k] && row[p->last[k] - 1] == 0)
            p->last[k]--;
    }
}

/* True if impulses of one element change the rate, or bound the impulse, of the other. */
static bool is_connected(const kmp_impact_run *p, int k, int other)
{
    const kmp_friction_element *a = kmp_impact_element(p, k), *b = kmp_impact_element(p, other);
    return a->base == p->which[other] || b->base == p->which[k] || a->twin == p->which[other] ||
           rate_by(p, k, other) != 0;
}

static void move_element(kmp_impact_run *p, int from, int to)
{
    const size_t size = (size_t)p->n * sizeof *p->row;
    if (from == to)
        return;
    p->which[to] = p->which[from];
    p->v[to] = p->v[from];
    p->e[to] = p->e[from];
    p->first[to] = p->first[from];
    p->last[to] = p->last[from];
    memcpy(p->row + to * p->n, p->row + from * p->n, size);
    memcpy(p->way + to * p->n, p->way + from * p->n, size);
}

/* Finds the changes of the rates by the contacts that strike and all that are connected with them, directly or through
 * others: only these take part. Of the others no rate changes. */
static int keep_connected(kmp_impact_run *p)
{
    enum { APART, REACHED, FOUND }; /* p->side */
    int kept = 0;
    bool goes_on = true;
    while (goes_on) {
        goes_on = false;
        for (int k = 0; k < p->count; k++) {
            if (p->side[k] != REACHED)
                continue;
            KMP_FRICTION_TRY(p->site->way(self_of(p), p->row + k * p->n, p->way + k * p->n));
            p->side[k] = FOUND;
            for (int i = 0; i < p->count; i++)
                if (p->side[i] == APART && is_connected(p, i, k)) {
                    p->side[i] = REACHED;
                    goes_on = true;
                }
        }
    }
    for (int k = 0; k < p->count; k++)
        if (p->side[k] == FOUND)
            move_element(p, k, kept++);
    p->count = kept;
    return 0;
}

static int find_inverse_inertia(kmp_impact_run *p, double t, const double *q)
{
    find_rows(p, t, q);
    KMP_FRICTION_TRY(p->site->invert(self_of(p), t, q));
    KMP_FRICTION_TRY(keep_connected(p));
    kmp_friction_pair_components(p->friction, p->count, p->which, p->partner);
    KMP_FRICTION_TRY(clear_implied(p, t, q));
    for (int i = 0; i < p->count; i++)
        for (int j = 0; j <= i; j++)
            p->d[i + j * p->count] = p->d[j + i * p->count] = (rate_by(p, i, j) + rate_by(p, j, i)) / 2;
    return 0;
}

/* Bounds by the impulses of the last pass, which the bounds of friction follow by a part. */
static void bound_impulses(kmp_impact_run *p, double part)
{
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = kmp_impact_element(p, k);
        bool rubs = e->base >= 0;
        if (rubs) {       /* a contact that is held may pull: it represents impacts to come, with their friction */
            int base = 0; /* its number among the elements that take part */
            while (p->which[base] != e->base)
                base++;
            const double ratio = kmp_friction_at(p->friction, &p->friction->element[e->base], KMP_ROLE_STATIC);
            const double pressed = p->held[base] ? fabs(p->f[base]) : fmax(p->f[base], 0);
            p->most_friction[k] += part * (ratio * pressed - p->most_friction[k]);
        }
        double most = rubs ? p->most_friction[k] : INFINITY;
        p->a[k] = p->v[k] + p->e[k] * p->v[k];
        p->lower[k] = rubs || p->held[k] || e->unlimited > 0 ? -most : 0;
        p->upper[k] = e->unlimited > 0 ? 0 : most;
    }
}

static kmp_box_outcome find_minimum(kmp_impact_run *p)
{
    const kmp_box box = {p->count, p->d, p->a, p->lower, p->upper};
    return kmp_disc_minimum(&box, p->partner, p->f, p->y, p->side, p->room);
}

/* Rounding of the impulses, relative: the size of their rates over what is left of these. It is large where a body has
 * almost no inertia in one direction. */
static double rounding(const kmp_impact_run *p)
{
    double most = 0, left = 0;
    for (int i = 0; i < p->count; i++) {
        double sum = 0;
        for (int j = 0; j < p->count; j++)
            sum += fabs(p->d[i + j * p->count] * p->f[j]);
        most = fmax(most, sum);
        left = fmax(left, fabs(p->a[i]));
    }
    return left > 0 ? KMP_IMPACT_ROUNDING * most / left : 0;
}

/* True if elements without a limit take part, and restitution: a surface that they hold cannot rebound. The impact is
 * then plastic. */
static bool take_plastic(kmp_impact_run *p, double t)
{
    bool held = false, rebounds = false;
    for (int k = 0; k < p->count; k++) {
        held = held || kmp_impact_element(p, k)->unlimited != 0;
        rebounds = rebounds || p->e[k] > 0;
    }
    if (!held || !rebounds)
        return false;
    if (p->site->report_plastic)
        p->site->report_plastic(self_of(p), t, NAN);
    memset(p->e, 0, (size_t)p->count * sizeof *p->e);
    return true;
}

/* One minimum; *changed: by how much impulses differ from the last ones, relative to the largest. */
static int solve_once(kmp_impact_run *p, double t, double part, double *changed)
{
    double most = 0, size = 0;
    bound_impulses(p, part);
    memcpy(p->tried, p->f, (size_t)p->count * sizeof *p->f);
    kmp_box_outcome outcome = find_minimum(p);
    if (outcome == KMP_BOX_UNBOUNDED && take_plastic(p, t)) {
        bound_impulses(p, 0);
        outcome = find_minimum(p);
    }
    for (int k = 0; k < p->count; k++) {
        most = fmax(most, fabs(p->f[k] - p->tried[k]));
        size = fmax(size, fmax(fabs(p->f[k]), fabs(p->tried[k])));
    }
    *changed = size > 0 ? most / size : 0;
    *changed /= *changed > rounding(p) ? part : 1; /* a part of the way is not rounding */
    if (outcome == KMP_BOX_FOUND)
        return 0;
    return p->site->fail(self_of(p), outcome == KMP_BOX_UNBOUNDED ? KMP_IMPACT_FORCED : KMP_IMPACT_UNDECIDED, t,
                         p->count, p->which);
}

static int solve_impulses(kmp_impact_run *p, double t)
{
    double changed = 1;
    int alternating = 0;
    bool rubs = false;
    for (int k = 0; k < p->count; k++) {
        rubs = rubs || kmp_impact_element(p, k)->base >= 0;
        p->f[k] = p->most_friction[k] = 0;
    }
    KMP_FRICTION_TRY(solve_once(p, t, 1, &changed));
    for (int pass = 1; rubs && pass < MOST_PASSES && changed > KMP_FRICTION_SETTLED; pass++) {
        KMP_FRICTION_TRY(solve_once(p, t, ldexp(1, -(alternating / PATIENCE)), &changed));
        /* A leg without inertia carries what friction holds: both grow together from rounding, by the same factor in
         * each pass. */
        bool only_grows = true;
        for (int k = 0; k < p->count; k++)
            only_grows = only_grows && (p->tried[k] == 0 || p->f[k] / p->tried[k] >= 1);
        alternating += !only_grows;
    }
    return rubs && changed > fmax(KMP_FRICTION_TIE, rounding(p))
               ? p->site->fail(self_of(p), KMP_IMPACT_ALTERNATES, t, p->count, p->which)
               : 0;
}

/* -- after it ------------------------------------------------------------------------------------------------ */

/* Sets the rates, and returns the change of the kinetic energy. */
static double apply(const kmp_impact_run *p, double *qd)
{
    double before = p->site->kinetic(self_of(p), p->before);
    memcpy(qd, p->before, (size_t)p->n * sizeof *qd);
    for (int k = 0; k < p->count; k++)
        for (int i = 0; i < p->n; i++)
            qd[i] += p->f[k] * p->way[k * p->n + i];
    return p->site->kinetic(self_of(p), qd) - before;
}

/* Moves the surfaces apart by what the located time of the impact lies behind it, in the inverse inertia: the next
 * flight begins at the surface. Returns the largest overlap, in sizes. */
static double part_surfaces(kmp_impact_run *p, double t, double *q)
{
    double most = 0;
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = kmp_impact_element(p, k);
        p->f[k] = 0;
        p->a[k] = e->contact ? kmp_friction_at(p->friction, e, KMP_ROLE_PLACE) : 0;
        p->lower[k] = 0;
        p->upper[k] = e->contact ? INFINITY : 0;
        p->deep[p->which[k]] = fmax(-p->a[k], 0);
        most = fmax(most, -p->a[k] / e->size);
    }
    if (find_minimum(p) != KMP_BOX_FOUND)
        return 0; /* they stay as they are */
    for (int k = 0; k < p->count; k++)
        for (int i = 0; i < p->n; i++)
            q[i] += p->f[k] * p->way[k * p->n + i];
    p->site->weigh(self_of(p), t, q);
    return most;
}

/* True if the next impact of element k with restitution e < 1 would follow at once, or if the height that this one
 * takes from its flight is not larger than the overlap, by which surfaces are parted: then the rebounds would not
 * become lower. A flight of the time T that ends with the rate v has the height v T / 4. */
static bool is_last(const kmp_impact_run *p, int k, double since, double least)
{
    double e = p->e[k], lost = (1 - e * e) * fabs(p->v[k]) * since / 4;
    return e > 0 && (e * since < least || (e < 1 && lost < KMP_IMPACT_DEEP * p->deep[p->which[k]]));
}

/* Rounding of the rate of element k after the impact. */
static double rate_rounding(const kmp_impact_run *p, int k)
{
    double sum = 0;
    for (int i = 0; i < p->count; i++)
        sum += fabs(p->d[k + i * p->count] * p->f[i]);
    return KMP_IMPACT_ROUNDING * sum;
}

static void note_impacts(kmp_impact_run *p, double t, double gain)
{
    if (p->site->report_impact)
        p->site->report_impact(self_of(p), p, t, p->site->kinetic(self_of(p), p->before), gain);
    for (int k = 0; k < p->count; k++) {
        kmp_friction_element *e = kmp_impact_element(p, k);
        e->stopped = p->f[k] != 0 && p->side[k] == 0 && p->e[k] == 0 ? rate_rounding(p, k) : 0;
        if (p->f[k] == 0 || !e->contact)
            continue;
        p->since = fmin(p->since, t - e->last);
        e->last = t;
        e->struck = true;
    }
    p->total++;
}

/* Newton's law may gain energy where friction and several contacts take part: such an impact is plastic. */
static int keep_from_gaining(kmp_impact_run *p, double t, double *qd, double *gain)
{
    if (p->site->driven || *gain <= KMP_IMPACT_GAIN * p->site->kinetic(self_of(p), p->before))
        return 0;
    if (p->site->report_plastic)
        p->site->report_plastic(self_of(p), t, *gain);
    memset(p->e, 0, (size_t)p->count * sizeof *p->e);
    KMP_FRICTION_TRY(solve_impulses(p, t));
    *gain = apply(p, qd);
    return 0;
}

static void evaluate_contacts(kmp_impact_run *p, double t, const double *q, const double *qd)
{
    p->friction->site->look(self_of(p), t, q, qd, p->friction->change);
}

/* Ends sequences of impacts whose next one would follow at once. A contact that rebounds takes its rate away. When
 * contacts strike in turn, each throws the others off by a rate that is no more than the rate of a fall in this time:
 * they stay. */
static void end_sequences(kmp_impact_run *p, double t, double rate)
{
    double least = KMP_IMPACT_SPACING * p->friction->site->numbers(self_of(p)).span;
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *element = kmp_impact_element(p, k);
        double e = p->e[k], since = t - element->last;
        p->held[k] = element->contact && since < least && fabs(p->v[k]) < least * element->size * rate * rate;
        if (!is_last(p, k, since, least))
            continue;
        if (p->site->report_sequence)
            p->site->report_sequence(self_of(p), p->which[k], t, since, e < 1 ? t + e * since / (1 - e) : t);
        p->e[k] = 0;
    }
}

/* The direction of slip of element k after an impact, or its component; against its friction where it has no rate. Zero
 * for both components: it rests. */
static double slip_after(const kmp_impact_run *p, int k)
{
    const int other = p->partner[k];
    const double rate = other < 0 ? fabs(p->y[k]) : hypot(p->y[k], p->y[other]);
    const double size = other < 0 ? fabs(p->f[k]) : hypot(p->f[k], p->f[other]);
    if (p->side[k] == 0) /* within its bound */
        return 0;
    return rate > rate_rounding(p, k) ? p->y[k] / rate : size > 0 ? -p->f[k] / size : 0;
}

static bool rests_after(const kmp_impact_run *p, int k)
{
    return slip_after(p, k) == 0 && (p->partner[k] < 0 || slip_after(p, p->partner[k]) == 0);
}

/* Contacts that share impulses are reported where the rates after the impact depend on how. */
static void find_shared(kmp_impact_run *p, double t)
{
    kmp_friction_run *x = p->friction;
    bool rubs = false, felt;
    for (int k = 0; k < p->count; k++)
        rubs = rubs || x->element[p->which[k]].base >= 0;
    if (!rubs || x->past.felt)
        return;
    kmp_sharing s = kmp_sharing_begin(p->count, p->d, p->room);
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = &x->element[p->which[k]];
        const int base = e->base >= 0 ? kmp_sharing_number(e->base, p->count, p->which) : -1;
        if (p->f[base >= 0 ? base : k] < 0 && (base >= 0 || e->contact))
            continue; /* a contact that is held pulls, for impacts to come */
        if (base >= 0 && !rests_after(p, k))
            kmp_sharing_follow(&s, k, base, kmp_sharing_ratio(x, e, slip_after(p, k)));
        else if (base < 0 && p->side[k] != 0 && p->y[k] > rate_rounding(p, k))
            continue;
        else if (e->contact)
            kmp_sharing_contact(&s, k, p->f[k] == 0);
        else
            kmp_sharing_friction(&s, k, base, base < 0 ? 0 : kmp_sharing_ratio(x, e, -1));
    }
    const kmp_sharing_state at = {p->a, p->f, p->partner, p->lower, p->upper};
    if (kmp_sharing_mark(&s, x, p->which, &felt) && (felt || kmp_sharing_may_move(&s, &at)))
        kmp_sharing_report(x, KMP_FRICTION_FACT_SHARED_IMPULSES, t, true);
}

KMP_LOCAL int kmp_impact_decide(kmp_impact_run *p, double t, double *q, double *qd, double *gain)
{
    *gain = 0;
    p->since = INFINITY;
    evaluate_contacts(p, t, q, qd);
    double rate = p->friction->site->pace(self_of(p), qd);
    if (!list_touching(p, rate))
        return 0;
    memcpy(p->before, qd, (size_t)p->n * sizeof *qd);
    KMP_FRICTION_TRY(find_inverse_inertia(p, t, q));
    if (part_surfaces(p, t, q) > KMP_TOUCH_LIFT) { /* otherwise rows and rates are the same but for rounding */
        evaluate_contacts(p, t, q, qd);
        (void)list_touching(p, rate);
        KMP_FRICTION_TRY(find_inverse_inertia(p, t, q));
    }
    end_sequences(p, t, rate);
    KMP_FRICTION_TRY(solve_impulses(p, t));
    *gain = apply(p, qd);
    KMP_FRICTION_TRY(keep_from_gaining(p, t, qd, gain));
    note_impacts(p, t, *gain);
    find_shared(p, t);
    return 0;
}

KMP_LOCAL int kmp_impact_overlap(kmp_impact_run *p, double t, const double *q, const double *qd)
{
    const kmp_friction_run *x = p->friction;
    evaluate_contacts(p, t, q, qd);
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i];
        if (e->contact && kmp_friction_at(x, e, KMP_ROLE_PLACE) < -KMP_TOUCH_NEAR * e->size)
            return i;
    }
    return -1;
}
