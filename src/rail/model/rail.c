/* SPDX-License-Identifier: BSD-3-Clause */
#include "rail/model/rail.h"
#include "base/memory.h"
#include "symbolic/table_function.h"
#include <math.h>

/* -- places of a spline ---------------------------------------------------------------------------- */

/* The highest place of a piece, between its ends: where the derivative, a parabola, decreases through zero. */
static double highest_inside(const kmp_table *t, int k, double here)
{
    const double *c = t->piece[k];
    double h = t->x[k + 1] - t->x[k], a = 3 * c[3], b = c[2], root = b * b - a * c[1];
    if (!(root > 0))
        return here;
    root = sqrt(root);
    /* a u^2 + 2 b u + c1 = 0 with a negative second derivative 2 (a u + b): u = (-b - root) / a */
    double u = b > 0 ? (-b - root) / a : c[1] / (root - b);
    double x = t->x[k] + u;
    return u > 0 && u < h && kmp_table_value(t, 0, x) > kmp_table_value(t, 0, here) ? x : here;
}

static double highest(const kmp_table *t)
{
    double best = t->x[0];
    for (int k = 0; k < t->count; k++) {
        if (t->y[k] > kmp_table_value(t, 0, best))
            best = t->x[k];
        if (k + 1 < t->count)
            best = highest_inside(t, k, best);
    }
    return best;
}

/* The abscissa where the table has the value `level`, between x = low, where it is not higher, and x = high, where it
 * is. */
static double bisect(const kmp_table *t, double level, double low, double high)
{
    for (;;) {
        double middle = low + (high - low) / 2;
        if (middle <= low || middle >= high)
            return middle;
        if (kmp_table_value(t, 0, middle) > level)
            high = middle;
        else
            low = middle;
    }
}

/* The first place before `top` that is as low as `level`; false: there is none. */
static bool falls_to(const kmp_table *t, double level, double top, double *x)
{
    double high = top;
    for (int k = t->count - 1; k >= 0; k--) {
        if (t->x[k] >= top)
            continue;
        if (t->y[k] <= level) {
            *x = bisect(t, level, t->x[k], high);
            return true;
        }
        high = t->x[k];
    }
    return false;
}

/* -- the rail ------------------------------------------------------------------------------------ */

typedef struct section {
    int count;
    double *y, *z;
} section;

/* Moves the section to its place; false: the gauge cannot be measured on it. */
static bool shift(section *s, const kmp_table *turned, kmp_rail_place *place)
{
    double top = highest(turned), height = kmp_table_value(turned, 0, top), face, lowest = height;
    for (int k = 0; k < s->count && s->y[k] < top; k++)
        lowest = fmin(lowest, s->z[k]);
    place->depth_given = height - lowest;
    place->reaches = falls_to(turned, height - place->gauge_depth, top, &face);
    if (!place->reaches)
        return false;
    place->at = place->gauge / 2 - face;
    for (int k = 0; k < s->count; k++) {
        s->y[k] += place->at;
        s->z[k] -= height;
    }
    return true;
}

static kmp_table *place_section(section *s, kmp_rail_place *place)
{
    /* Keeps the part that is visible from above, from the highest point to both sides. */
    int top = 0, first, last;
    for (int k = 1; k < s->count; k++)
        if (s->z[k] > s->z[top])
            top = k;
    for (first = top; first > 0 && s->y[first - 1] < s->y[first]; first--)
        ;
    for (last = top; last + 1 < s->count && s->y[last + 1] > s->y[last]; last++)
        ;
    s->count = last - first + 1;
    s->y += first;
    s->z += first;
    place->resolved = kmp_table_check(s->count, s->y, s->z) < 0;
    if (!place->resolved)
        return NULL;
    kmp_table *turned = kmp_table_new(KMP_TABLE_CUBIC, s->count, s->y, s->z), *rail = NULL;
    if (turned && shift(s, turned, place)) {
        place->resolved = kmp_table_check(s->count, s->y, s->z) < 0;
        rail = place->resolved ? kmp_table_new(KMP_TABLE_CUBIC, s->count, s->y, s->z) : NULL;
    }
    kmp_table_free(turned);
    return rail;
}

kmp_table *kmp_rail_new(const kmp_table *profile, kmp_rail_place *place)
{
    double *room = KMP_NEW(double, 2 * profile->count);
    if (!room)
        return NULL;
    section s = {profile->count, room, room + profile->count};
    place->reaches = true;
    /* The profile in axes that are turned by the slope. */
    double slope = place->inclination;
    double c = 1 / hypot(1, slope), sine = slope * c;
    for (int k = 0; k < profile->count; k++) {
        s.y[k] = c * profile->x[k] - sine * profile->y[k];
        s.z[k] = sine * profile->x[k] + c * profile->y[k];
    }
    kmp_table *rail = place_section(&s, place);
    kmp_free(room);
    return rail;
}
