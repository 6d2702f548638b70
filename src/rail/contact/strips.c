/* SPDX-License-Identifier: BSD-3-Clause */
/* With A and B, half of the relative curvatures in a strip along and across, and its gap g:
 *
 * ANALYN (Sichani, Enblom, Berg, A novel method to model wheel-rail normal contact in vehicle dynamics simulation,
 * Veh. Syst. Dyn. 52 (2014) 1752). For an approach d Hertz's ellipse of A and B has the semi-axes a, b. The strip is
 * pressed by d' = d - d/(B b^2) g where that is positive. Its half length is a sqrt(d'/d), and its largest pressure is
 * Hertz's for A, B and d'. Both d/(B b^2) and d/a^2 are independent of d. Hence the load of a strip is linear in d'.
 *
 * Kik and Piotrowski (A fast, approximate method to calculate normal load at contact between wheel and rail and creep
 * forces during rolling, 2nd mini-conference on contact mechanics, Budapest 1996): half lengths l = sqrt((0.55 d -
 * g)/A), the pressure p0/l0 sqrt(l^2 - x^2), l0 the half length at the point of first contact. There Boussinesq's
 * deflection is d:
 *
 *     load = pi E* d I1/I3,   I1 = integral of sqrt(l^2 - x^2),   I3 = integral of sqrt(l^2 - x^2)/distance.
 *
 * In a strip at the distance e the integral over x of I3 is 2 l^2/r D(e/r), r^2 = l^2 + e^2, D the elliptic integral of
 * hertz.h; the mean over the middle strip, of width h, is 2 l log(8 l/h). */
#include "rail/contact/strips.h"
#include "base/bracket.h"
#include "rail/contact/hertz.h"
#include <math.h>

static const double pi = 3.14159265358979323846;

/* Least curvature across over that along: a strip that is flatter, or hollow, is not Hertz's. It is 1e-4/mm for a wheel
 * of 0.46 m, as in CONTACT. */
#define LEAST_ACROSS 0.092

/* The part of the approach by which undeformed bodies overlap in the patch of Kik and Piotrowski. */
#define OVERLAP 0.55

/* The approach is found to this part of itself. */
#define RESOLVED 1e-12

/* ANALYN in a strip: d' = d - loss g, half length = half sqrt(d'), largest pressure = pressure sqrt(d'). */
typedef struct hertz_strip {
    double loss, half, pressure;
} hertz_strip;

typedef struct press {
    const kmp_strip_gap *gap;
    double modulus;
    hertz_strip *hertz; /* of each strip */
    kmp_strip *strip;
} press;

/* -- ANALYN ------------------------------------------------------------------------------------------ */

static hertz_strip hertz_of(const press *p, int k)
{
    double along = p->gap->along[k], across = fmax(p->gap->bend[k], LEAST_ACROSS * along), root = sqrt(along * across);
    kmp_hertz h = kmp_hertz_of(log(along / across));
    double other = kmp_hertz_of(log(across / along)).axis, flat = root * h.approach;
    return (hertz_strip){.loss = 2 * flat / (other * other * across),
                         .half = h.axis / sqrt(flat),
                         .pressure = 1.5 * p->modulus * root / (pi * h.axis * other * sqrt(flat))};
}

static double analyn(const press *p, double approach)
{
    for (int k = 0; k < p->gap->count; k++) {
        const hertz_strip *h = &p->hertz[k];
        double root = sqrt(fmax(approach - h->loss * p->gap->gap[k], 0)), half = root * h->half;
        double x = p->gap->centre[k], pressure = root * h->pressure;
        p->strip[k] =
            root > 0 ? (kmp_strip){x - half, x + half, pressure, pi / 2 * pressure * half} : (kmp_strip){.load = 0};
    }
    double sum = 0;
    for (int k = 0; k < p->gap->count; k++)
        sum += p->strip[k].load;
    return sum * p->gap->step;
}

/* -- Kik and Piotrowski ------------------------------------------------------------------------------ */

/* The integral of sqrt(l^2 - x^2)/distance over a strip `away` from the point. */
static double pull(double half, double away, double step)
{
    double B, D, far = hypot(half, away);
    if (fabs(away) < 0.5 * step)
        return 2 * half * fmax(log(8 * half / step), 0) * step;
    kmp_elliptic(fabs(away) / far, &B, &D);
    return 2 * half * half / far * D * step;
}

static double overlap(const press *p, double approach)
{
    const kmp_strip_gap *gap = p->gap;
    int point = 0;
    for (int k = 1; k < gap->count; k++)
        point = gap->gap[k] < gap->gap[point] ? k : point;
    double sum = 0, pulled = 0;
    for (int k = 0; k < gap->count; k++) {
        double deep = OVERLAP * approach - gap->gap[k], half = deep > 0 ? sqrt(2 * deep / gap->along[k]) : 0;
        double x = gap->centre[k];
        p->strip[k] = deep > 0 ? (kmp_strip){x - half, x + half, half, pi / 2 * half * half} : (kmp_strip){.load = 0};
        if (half > 0) {
            sum += p->strip[k].load * gap->step;
            pulled += pull(half, (k - point) * gap->step, gap->step);
        }
    }
    double scale = pulled > 0 ? pi * p->modulus * approach / pulled : 0; /* of pressures: p0/l0 */
    for (int k = 0; k < gap->count; k++) {
        p->strip[k].pressure *= scale;
        p->strip[k].load *= scale;
    }
    return scale * sum;
}

/* -- both ------------------------------------------------------------------------------------------------- */

double kmp_strips_sum(const kmp_strip_gap *gap, const kmp_strip *strip, kmp_normal_load_patch *pressed)
{
    double load = 0, moment = 0;
    pressed->area = pressed->pressure = 0;
    pressed->lobes = 0;
    for (int k = 0; k < gap->count; k++) {
        load += strip[k].load;
        moment += strip[k].load * (gap->first + k * gap->step);
        pressed->area += (strip[k].to - strip[k].from) * gap->step;
        pressed->pressure = fmax(pressed->pressure, strip[k].pressure);
        pressed->lobes += strip[k].load > 0 && (k == 0 || !(strip[k - 1].load > 0));
    }
    pressed->place = load > 0 ? moment / load : 0;
    return load * gap->step;
}

/* The approach at which strip k begins to touch. */
static double reaches(kmp_strip_method method, const press *p, int k)
{
    return method == KMP_STRIPS_KP ? p->gap->gap[k] / OVERLAP : p->gap->gap[k] * p->hertz[k].loss;
}

bool kmp_strips_press(kmp_strip_method method, const kmp_strip_gap *gap, double modulus, double normal,
                      kmp_arena *arena, kmp_strip *strip, kmp_normal_load_patch *pressed)
{
    double (*const load)(const press *, double) = method == KMP_STRIPS_KP ? overlap : analyn;
    const press p = {gap, modulus, KMP_ARENA_NEW(arena, hertz_strip, gap->count), strip};
    if (!p.hertz)
        return false;
    for (int k = 0; k < gap->count; k++)
        p.hertz[k] = hertz_of(&p, k);
    double high = fmin(reaches(method, &p, 0), reaches(method, &p, gap->count - 1)), x;
    double at_high = high > 0 ? load(&p, high) - normal : -normal;
    if (!(at_high > 0))
        return false;
    kmp_bracket b = kmp_bracket_of(0, -normal, high, at_high);
    while (kmp_bracket_next(&b, RESOLVED * b.far, &x)) {
        double f = load(&p, x) - normal;
        kmp_bracket_take(&b, x, f, f > 0);
    }
    load(&p, b.far);
    pressed->approach = b.far;
    kmp_strips_sum(gap, strip, pressed);
    return true;
}
