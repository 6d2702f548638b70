/* SPDX-License-Identifier: BSD-3-Clause */
/* Zones by trying out: the wheel without yaw is put over the rail at many places, at a few rolls, and comes down until
 * it touches. Heights of both stand on fine even grids. */
#include "model/zones.h"
#include "base/memory.h"
#include "symbolic/table.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GRID   2.5e-4 /* m, of the wheel's points */
#define FINE   1e-4   /* of the rail's */
#define SHIFT  2.5e-4 /* from one place of the wheel to the next */
#define JUMP   2e-3   /* what is never touched between two zones, at least */
#define BEYOND 2e-3   /* a zone goes on so far after the last point that touches */
enum { BISECTIONS = 10, MOST_POINTS = 4000 };

static const double rolls[] = {-0.03, 0, 0.03};

typedef struct scan {
    int count; /* points of the wheel */
    double first, step;
    double *radius;
    bool *touched;
    int rail_count;
    double rail_first, rail_step;
    double *rail;
    double cosine, sine;
} scan;

static double end_of(const kmp_table *table)
{
    return table->x[table->count - 1];
}

static double *sample(const kmp_table *table, double first, double step, int count)
{
    double *y = KMP_NEW(double, count);
    for (int k = 0; y && k < count; k++)
        y[k] = kmp_table_value(table, 0, first + step * k);
    return y;
}

static int points_of(double length, double step)
{
    return (int)fmin(MOST_POINTS, ceil(length / step)) + 1;
}

static bool begin(scan *s, const kmp_track *track, const kmp_wheel *wheel)
{
    const kmp_table *height = wheel->profile->height;
    double length = end_of(height) - height->x[0], margin = 0.01;
    *s = (scan){.first = height->x[0], .rail_first = track->rail->x[0] - margin};
    s->count = points_of(length, GRID);
    s->step = length / (s->count - 1);
    double head = end_of(track->rail) + margin - s->rail_first;
    s->rail_count = points_of(head, FINE);
    s->rail_step = head / (s->rail_count - 1);
    s->radius = sample(height, s->first, s->step, s->count);
    s->rail = sample(track->rail, s->rail_first, s->rail_step, s->rail_count);
    s->touched = KMP_NEW(bool, s->count);
    for (int k = 0; s->radius && k < s->count; k++)
        s->radius[k] = wheel->radius.value - s->radius[k];
    return s->radius && s->rail && s->touched;
}

/* The rail's height; far away a slope that nothing touches. */
static double rail_at(const scan *s, double y)
{
    double x = (y - s->rail_first) / s->rail_step;
    if (!(x >= 0 && x < s->rail_count - 1))
        return -1;
    int k = (int)x;
    return s->rail[k] + (x - k) * (s->rail[k + 1] - s->rail[k]);
}

/* The point that touches with the wheel's centre there. */
static int touching(const scan *s, double out)
{
    int best = 0;
    double least = INFINITY;
    for (int k = 0; k < s->count; k++) {
        double along = s->first + s->step * k, r = s->radius[k];
        double y = out + along * s->cosine + r * s->sine, z = along * s->sine - r * s->cosine;
        double gap = z - rail_at(s, y);
        if (gap < least) {
            least = gap;
            best = k;
        }
    }
    return best;
}

static void mark(scan *s, int a, int b)
{
    for (int k = a < b ? a : b; k <= (a < b ? b : a); k++)
        s->touched[k] = true;
}

/* From one place to the next: what is between two points that touch is touched too, but for a jump that stays one
 * however near both places are. */
static void follow(scan *s, double out, int k, double next, int l)
{
    for (int i = 0; i < BISECTIONS && abs(l - k) * s->step > JUMP; i++) {
        double middle = (out + next) / 2;
        int m = touching(s, middle);
        if (abs(m - k) < abs(l - m)) {
            mark(s, k, m);
            out = middle;
            k = m;
        } else {
            mark(s, m, l);
            next = middle;
            l = m;
        }
    }
    if (abs(l - k) * s->step <= JUMP)
        mark(s, k, l);
    mark(s, k, k);
    mark(s, l, l);
}

/* The rail's middle goes under the wheel from one end of its profile to the other. */
static void roll_over(scan *s, double middle, double roll)
{
    s->cosine = cos(roll);
    s->sine = sin(roll);
    double reach = s->first + s->step * (s->count - 1), lean = s->radius[s->count / 2] * s->sine;
    double out = middle - reach - lean, last = middle - s->first - lean;
    int k = touching(s, out);
    while (out < last) {
        int l = touching(s, out + SHIFT);
        follow(s, out, k, out + SHIFT, l);
        out += SHIFT;
        k = l;
    }
}

/* The k-th of the pieces that are touched begins at *first and ends at *last; false: there is none from `from` on. */
static bool next_piece(const scan *s, int from, int *first, int *last)
{
    while (from < s->count && !s->touched[from])
        from++;
    if (from == s->count)
        return false;
    *first = *last = from;
    for (int k = from; k < s->count && (k - *last) * s->step <= JUMP; k++)
        if (s->touched[k])
            *last = k;
    return true;
}

/* One zone more; of too many the two with the narrowest way between them are one. */
static void add_zone(double (*zone)[2], int *count, double first, double last)
{
    zone[*count][0] = first;
    zone[*count][1] = last;
    if (++*count <= KMP_WHEEL_ZONES)
        return;
    int narrow = 1;
    for (int k = 2; k < *count; k++)
        if (zone[k][0] - zone[k - 1][1] < zone[narrow][0] - zone[narrow - 1][1])
            narrow = k;
    zone[narrow - 1][1] = zone[narrow][1];
    --*count;
    memmove(zone + narrow, zone + narrow + 1, (size_t)(*count - narrow) * sizeof *zone);
}

static void collect(const scan *s, kmp_wheel *wheel)
{
    double zone[KMP_WHEEL_ZONES + 1][2], end = s->first + s->step * (s->count - 1);
    int count = 0;
    for (int from = 0, first, last; next_piece(s, from, &first, &last); from = last + 1)
        add_zone(zone, &count, s->first + s->step * first, s->first + s->step * last);
    zone[0][0] = fmax(s->first, zone[0][0] - BEYOND);
    zone[count - 1][1] = fmin(end, zone[count - 1][1] + BEYOND);
    for (int k = 1; k < count; k++)
        zone[k - 1][1] = zone[k][0] = (zone[k - 1][1] + zone[k][0]) / 2;
    memcpy(wheel->zone, zone, (size_t)count * sizeof *zone);
    wheel->zone_count = count;
}

bool kmp_zones_find(const kmp_track *track, kmp_wheel *wheel)
{
    scan s;
    bool ok = begin(&s, track, wheel);
    for (size_t k = 0; ok && k < sizeof rolls / sizeof rolls[0]; k++)
        roll_over(&s, track->rail_at, rolls[k]);
    if (ok)
        collect(&s, wheel);
    kmp_free(s.radius);
    kmp_free(s.rail);
    kmp_free(s.touched);
    return ok;
}
