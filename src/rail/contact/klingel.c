/* SPDX-License-Identifier: BSD-3-Clause */
/* Equivalent conicity by integration of the kinematic motion (EN 15302, UIC 519). A wheelset that rolls without slip
 * obeys y'' = -d(y) / (e r0), where d is the difference of the rolling radii, e the distance of the contacts, r0 the
 * radius. The cone of the same wavelength L has the slope (2 pi / L)^2 e r0 / 2 (Klingel). With lengths along the track
 * in units of sqrt(e r0) both e and r0 cancel.
 *
 * d is linear between its points. Then the motion from one point to the next is harmonic, hyperbolic or of constant
 * acceleration, and its length is known in closed form, also at the ends, where the lateral velocity is zero:
 *
 *     v^2 = 2 (S(end) - S(y)),  S' = d,        w = (y1 - y0) / (v0 + v1),  k = (d1 - d0) / (y1 - y0),
 *     length = 2 w atan(w sqrt k) / (w sqrt k),  or with atanh and -k if k < 0.
 *
 * The motion of amplitude a is between the ends u - 2a and u of equal S with S below inside. Such an interval is found
 * by moving it over the table: S(u) - S(u - 2a) is a parabola between two points. */
#include "base/context.h"
#include <kempe/rolling_contact.h>
#include <math.h>

/* A smaller difference of radii, m, is rounding: cylinders do not oscillate. */
#define EQUAL_RADII 1e-9

static const double pi = 3.14159265358979323846;

typedef struct curve {
    int count;
    const double *y, *d;
} curve;

/* A place in the curve: its piece, and the place itself. */
typedef struct place {
    int piece;
    double y;
} place;

static double slope_of(const curve *c, int piece)
{
    return (c->d[piece + 1] - c->d[piece]) / (c->y[piece + 1] - c->y[piece]);
}

static double value_at(const curve *c, const place *p)
{
    return c->d[p->piece] + slope_of(c, p->piece) * (p->y - c->y[p->piece]);
}

/* Goes forwards within the piece, or to its end, where the next one begins. */
static void go(const curve *c, place *p, double step)
{
    p->y += step;
    if (c->y[p->piece + 1] - p->y <= 1e-12 * step) {
        p->y = c->y[p->piece + 1];
        p->piece += p->piece + 2 < c->count;
    }
}

/* The integral of d over `step` from a place in its piece. */
static double integral(const curve *c, const place *p, double step)
{
    return step * (value_at(c, p) + 0.5 * step * slope_of(c, p->piece));
}

static double rest_of(const curve *c, const place *p)
{
    return c->y[p->piece + 1] - p->y;
}

/* -- from one end to the other ------------------------------------------------------------------------------- */

/* The length between two points of a piece, with the squares of the velocities there; infinite: never. */
static double length_of(double step, double slope, double before, double after)
{
    double sum = sqrt(fmax(before, 0)) + sqrt(fmax(after, 0)), w = step / sum, z = slope * w * w, root = sqrt(fabs(z));
    if (sum == 0 || (z < 0 && root >= 1))
        return INFINITY;
    double factor = root < 1e-6 ? 1 - z / 3 : z > 0 ? atan(root) / root : atanh(root) / root;
    return 2 * w * factor;
}

/* The way to the next point or to `high`; to the place of equal radii inside, where the velocity is greatest. */
static double step_of(const curve *c, const place *p, double high)
{
    double step = fmin(rest_of(c, p), high - p->y), equal = -value_at(c, p) / slope_of(c, p->piece);
    bool inside = equal > 1e-9 * step && equal < (1 - 1e-9) * step && p->y + equal > p->y;
    return inside ? equal : step;
}

/* The length of the motion from `low` to `high`, in units of sqrt(e r0). False: it does not come through. */
static bool pass(const curve *c, place at, double high, double *length)
{
    double square = 0, least = -2 * EQUAL_RADII * (high - at.y);
    *length = 0;
    while (high - at.y > 1e-12 * (high - c->y[0])) {
        double step = step_of(c, &at, high);
        bool last = at.y + step >= high - 1e-12 * (high - c->y[0]);
        double after = last ? 0 : square - 2 * integral(c, &at, step), slope = slope_of(c, at.piece);
        if (after < least)
            return false;
        *length += length_of(step, slope, square, after);
        square = fmax(after, 0);
        go(c, &at, step);
    }
    return true;
}

/* -- the ends ------------------------------------------------------------------------------------------------- */

/* The first root of from + b h + k h^2 / 2 as it rises from below zero. */
static double root_of(double from, double b, double k)
{
    return -2 * from / (b + sqrt(fmax(b * b - 2 * k * from, 0)));
}

/* An interval of the amplitude that is moved over the curve: its ends, and the integral of d between them. */
typedef struct interval {
    place low, high;
    double sum;
} interval;

static interval interval_of(const curve *c, double amplitude)
{
    interval i = {.low = {0, c->y[0]}, .high = {0, c->y[0]}};
    double last = fmin(c->y[0] + 2 * amplitude, c->y[c->count - 1]);
    while (i.high.y < last) {
        double step = fmin(rest_of(c, &i.high), last - i.high.y);
        i.sum += integral(c, &i.high, step);
        go(c, &i.high, step);
    }
    return i;
}

/* Candidates in sequence: the sum rises through zero, or is zero for a while, and the middle of that is taken. */
typedef struct search {
    const curve *c;
    double amplitude, small;
    double flat[2]; /* where the lower end began to have no sum, and last had none; NaN */
    bool below;     /* the sum was negative before */
    kempe_conicity *best;
    bool found;
} search;

static void try_at(search *s, double low)
{
    place begin = {0, low};
    while (begin.piece + 2 < s->c->count && s->c->y[begin.piece + 1] <= low)
        begin.piece++;
    double length, high = fmin(low + 2 * s->amplitude, s->c->y[s->c->count - 1]), middle = low + s->amplitude;
    bool nearer = !s->found || fabs(middle) < fabs(0.5 * (s->best->low + s->best->high));
    if (!nearer || !pass(s->c, begin, high, &length))
        return;
    *s->best = (kempe_conicity){.conicity = 0.5 * (pi / length) * (pi / length), .low = low, .high = high};
    s->found = true;
}

static void note(search *s, const interval *i)
{
    if (i->sum < -s->small) {
        s->below = true;
        s->flat[0] = NAN;
    } else if (i->sum <= s->small) {
        s->flat[0] = isnan(s->flat[0]) ? i->low.y : s->flat[0];
        s->flat[1] = i->low.y;
    }
}

/* Takes the interval a step on. */
static void advance(search *s, interval *i, double step)
{
    interval before = *i;
    double b = value_at(s->c, &i->high) - value_at(s->c, &i->low);
    double k = slope_of(s->c, i->high.piece) - slope_of(s->c, i->low.piece);
    i->sum += integral(s->c, &i->high, step) - integral(s->c, &i->low, step);
    go(s->c, &i->low, step);
    go(s->c, &i->high, step);
    if (i->sum > s->small) {
        if (!isnan(s->flat[0]))
            try_at(s, 0.5 * (s->flat[0] + s->flat[1]));
        else if (s->below)
            try_at(s, before.low.y + fmin(fmax(root_of(before.sum, b, k), 0), step));
        s->below = false;
        s->flat[0] = NAN;
    }
    note(s, i);
}

static bool find(const curve *c, double amplitude, kempe_conicity *best)
{
    search s = {.c = c, .amplitude = amplitude, .small = 2 * EQUAL_RADII * amplitude, .flat = {NAN, NAN}, .best = best};
    interval i = interval_of(c, amplitude);
    note(&s, &i);
    for (double step; (step = fmin(rest_of(c, &i.low), rest_of(c, &i.high))) > 0;) /* to the next point at either end */
        advance(&s, &i, step);
    if (!isnan(s.flat[0]))
        try_at(&s, 0.5 * (s.flat[0] + s.flat[1]));
    return s.found;
}

static bool is_curve(const curve *c)
{
    for (int k = 0; k < c->count; k++)
        if (!isfinite(c->y[k]) || !isfinite(c->d[k]) || (k > 0 && c->y[k] <= c->y[k - 1]))
            return false;
    return c->count >= 2;
}

kempe_status kempe_contact_conicity(int count, const double *y, const double *difference, double amplitude,
                                    kempe_conicity *conicity)
{
    KMP_WANTED(NULL, y, "y");
    KMP_WANTED(NULL, difference, "difference");
    KMP_WANTED(NULL, conicity, "conicity");
    const curve c = {count, y, difference};
    kempe_conicity found;
    if (!is_curve(&c) || !(amplitude > 0) || !isfinite(amplitude))
        return KEMPE_E_ARGUMENT;
    if (2 * amplitude > (y[count - 1] - y[0]) * (1 + 1e-12) || !find(&c, amplitude, &found))
        return KEMPE_E_FAILED;
    *conicity = found;
    return KEMPE_OK;
}
