/* SPDX-License-Identifier: BSD-3-Clause */
/* Zones by sampling: the wheel without yaw is put over the rail at many positions, at a few rolls, and lowered until it
 * touches. The heights of both are on fine even grids. */
#include "rail/model/zones.h"
#include "base/arena.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lengths are in m for a wheel of that radius: times kmp_wheel.scale. */
#define USUAL  0.46
#define GRID   2.5e-4 /* of the wheel's points */
#define FINE   1e-4   /* of the rail's */
#define MARGIN 1e-2   /* lateral distance from the rail */
#define SHIFT  2.5e-4 /* from one position of the wheel to the next */
#define JUMP   2e-3   /* shorter ones are none */
#define BEYOND 2e-3   /* extent of a zone beyond the last point that touches */
#define FAR    1.0    /* below the rail's top, where there is no rail */
#define TURN   0.3    /* rad: contacts of an elastic wheel whose normals differ by less are in one zone */
enum { BISECTIONS = 10, FEWEST_POINTS = 40, MOST_POINTS = 4000, WIDE = 32, NARROW = 4 };

static const double rolls[] = {-0.01, 0, 0.01};

/* A jump of the contact from one point of the wheel to another, with no contact between them. */
typedef struct jump {
    int first, last;
} jump;

/* Runs of neighbouring points of the wheel. */
typedef struct runs {
    int points;   /* of each */
    double *low;  /* the least of scan.below */
    double *over; /* the point of the rail that the run begins over */
    double *top;  /* the greatest height of the rail under a run that begins at a point of the rail */
} runs;

typedef struct scan {
    kmp_arena arena;
    double scale;
    int count; /* points of the wheel */
    double first, step;
    double *radius;
    int lowest, highest; /* of those that touch anywhere */
    int jump_count;
    jump *jump;
    int rail_count;
    double rail_first, rail_step;
    double *rail;
    double *aside, *below; /* the wheel's points at the current roll: laterally and upwards from its centre */
    runs wide, narrow;     /* a wide run is WIDE / NARROW narrow ones */
    bool elastic;
} scan;

static double end_of(const kmp_table *table)
{
    return table->x[table->count - 1];
}

static double *sample(kmp_arena *arena, const kmp_table *table, double first, double step, int count)
{
    double *y = KMP_ARENA_NEW(arena, double, count);
    for (int k = 0; y && k < count; k++)
        y[k] = kmp_table_value(table, 0, first + step * k);
    return y;
}

/* The number of points in a length. A length of whole steps has this number on each scale, independent of rounding. */
static int points_of(double length, double step)
{
    return (int)fmin(MOST_POINTS, fmax(1, ceil(length / step - 1e-6))) + 1;
}

double kmp_zones_scale(const kmp_wheel *wheel)
{
    const kmp_table *height = wheel->profile->height;
    double width = (end_of(height) - height->x[0]) / GRID;
    return fmin(fmax(wheel->radius.value / USUAL, width / MOST_POINTS), width / FEWEST_POINTS);
}

static bool make_runs(scan *s, runs *r, int points)
{
    int count = (s->count + points - 1) / points;
    r->points = points;
    return KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, count, &r->over, &r->low),
                          KMP_ROOM(double, s->rail_count, &r->top));
}

static bool begin(scan *s, const kmp_track *track, const kmp_wheel *wheel)
{
    const kmp_table *height = wheel->profile->height;
    double length = end_of(height) - height->x[0], margin = MARGIN * wheel->scale;
    *s = (scan){.scale = wheel->scale,
                .first = height->x[0],
                .rail_first = track->rail->x[0] - margin,
                .elastic = wheel->form == KMP_CONTACT_ELASTIC};
    s->count = points_of(length, GRID * s->scale);
    s->step = length / (s->count - 1);
    double head = end_of(track->rail) + margin - s->rail_first;
    s->rail_count = points_of(head, FINE * s->scale);
    s->rail_step = head / (s->rail_count - 1);
    s->radius = sample(&s->arena, height, s->first, s->step, s->count);
    s->rail = sample(&s->arena, track->rail, s->rail_first, s->rail_step, s->rail_count);
    s->lowest = s->count - 1;
    if (!make_runs(s, &s->wide, WIDE) || !make_runs(s, &s->narrow, NARROW) ||
        !KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, s->count, &s->aside, &s->below)))
        return false;
    for (int k = 0; k < s->count; k++)
        s->radius[k] = wheel->radius.value - s->radius[k];
    return true;
}

/* The rail's height; far away a slope that nothing touches. */
static double rail_at(const scan *s, double y)
{
    double x = (y - s->rail_first) / s->rail_step;
    if (!(x >= 0 && x < s->rail_count - 1))
        return -FAR * s->scale;
    int k = (int)x;
    return s->rail[k] + (x - k) * (s->rail[k + 1] - s->rail[k]);
}

/* Puts the greater of a height and that `farther` points on in its place; beyond the end there is none. */
static void raise_tops(const scan *s, double *top, int farther)
{
    for (int k = 0; k + farther < s->rail_count; k++)
        top[k] = top[k + farther] > top[k] ? top[k + farther] : top[k];
}

/* The runs with the wheel's centre at 0. */
static void find_runs(const scan *s, const runs *r)
{
    double widest = 0;
    for (int k = 0, run = 0; k < s->count; k += r->points, run++) {
        double from = s->aside[k], to = from, low = s->below[k];
        for (int l = k + 1; l < k + r->points && l < s->count; l++) {
            from = fmin(from, s->aside[l]);
            to = fmax(to, s->aside[l]);
            low = fmin(low, s->below[l]);
        }
        r->low[run] = low - 1e-9 * s->scale; /* room for rounding, as half a point is */
        r->over[run] = (from - s->rail_first) / s->rail_step - 0.5;
        widest = fmax(widest, to - from);
    }
    /* The greatest heights of the rail under a run that is as wide, from those of spans that double. */
    double *top = r->top;
    int reach = (int)fmin(widest / s->rail_step, MOST_POINTS) + 5, span = 1; /* with the points around either end */
    for (int k = 0; k < s->rail_count; k++)
        top[k] = fmax(s->rail[k], -FAR * s->scale);
    for (; 2 * span <= reach; span *= 2)
        raise_tops(s, top, span);
    raise_tops(s, top, reach - span);
}

/* A lower limit of the distance of a run from the rail. */
static double least_gap(const scan *s, const runs *r, double points, int run)
{
    double x = points + r->over[run], last = s->rail_count - 1;
    return r->low[run] - r->top[x <= 0 ? 0 : x < last ? (int)x : (int)last];
}

/* The point that touches with the wheel's centre there, and its distance from the rail. */
typedef struct touch {
    int point;
    double gap;
} touch;

static void look_at_run(const scan *s, double out, int first, touch *t)
{
    for (int k = first; k < first + NARROW && k < s->count; k++) {
        double gap = s->below[k] - rail_at(s, out + s->aside[k]);
        if (gap < t->gap || (gap == t->gap && k < t->point))
            *t = (touch){k, gap};
    }
}

/* The first point that touches with the wheel's centre there. `near` is tried first: runs of points that are farther
 * above all of the rail under them than it is above the rail need no look. */
static int touching(const scan *s, double out, int near)
{
    double points = out / s->rail_step;
    touch t = {near, s->below[near] - rail_at(s, out + s->aside[near])};
    for (int wide = 0, first = 0; first < s->count; wide++, first += WIDE) {
        if (least_gap(s, &s->wide, points, wide) > t.gap)
            continue;
        for (int k = first; k < first + WIDE && k < s->count; k += NARROW)
            if (least_gap(s, &s->narrow, points, k / NARROW) <= t.gap)
                look_at_run(s, out, k, &t);
    }
    return t.point;
}

/* Angle of the profile at a point, between its neighbours. */
static double angle_at(const scan *s, int k)
{
    int before = k > 0 ? k - 1 : k, after = k < s->count - 1 ? k + 1 : k;
    return atan((s->radius[before] - s->radius[after]) / (s->step * (after - before)));
}

/* Notes a jump of the contact point, unless the wheel is elastic and the normals are nearly equal: the average over a
 * zone then changes smoothly. */
static void note_jump(scan *s, int a, int b)
{
    if (s->elastic && fabs(angle_at(s, a) - angle_at(s, b)) < TURN)
        return;
    jump *list = kmp_arena_room(&s->arena, s->jump, s->jump_count, sizeof *list);
    if (!list)
        return;
    s->jump = list;
    s->jump[s->jump_count++] = (jump){a < b ? a : b, a < b ? b : a};
}

/* Between two positions, where k and l touch, finds the jumps that remain at any distance of the positions. */
static void follow(scan *s, double out, int k, double next, int l, int depth)
{
    s->lowest = k < s->lowest ? k : s->lowest;
    s->highest = k > s->highest ? k : s->highest;
    if (abs(l - k) * s->step <= JUMP * s->scale * (1 + 1e-9))
        return;
    if (depth == 0) {
        note_jump(s, k, l);
        return;
    }
    double middle = (out + next) / 2;
    int m = touching(s, middle, k);
    follow(s, out, k, middle, m, depth - 1);
    follow(s, middle, m, next, l, depth - 1);
}

/* Moves the rail under the wheel from one end of its profile to the other. */
static void roll_over(scan *s, double middle, double roll)
{
    /* The wheel's points at a roll. */
    double cosine = cos(roll), sine = sin(roll);
    for (int k = 0; k < s->count; k++) {
        double along = s->first + s->step * k, r = s->radius[k];
        s->aside[k] = along * cosine + r * sine;
        s->below[k] = along * sine - r * cosine;
    }
    find_runs(s, &s->wide);
    find_runs(s, &s->narrow);
    double reach = s->first + s->step * (s->count - 1), lean = s->radius[s->count / 2] * sin(roll);
    double out = middle - reach - lean, last = middle - s->first - lean, shift = SHIFT * s->scale;
    int k = touching(s, out, 0);
    while (out < last) {
        int l = touching(s, out + shift, k);
        follow(s, out, k, out + shift, l, BISECTIONS);
        out += shift;
        k = l;
    }
}

static int by_end(const void *a, const void *b)
{
    const jump *x = a, *y = b;
    return x->last != y->last ? (x->last > y->last) - (x->last < y->last)
                              : (x->first > y->first) - (x->first < y->first);
}

/* Overlapping jumps are replaced by their intersection: the fewest borders that leave no jump without one. */
static int join_jumps(scan *s)
{
    int count = 0;
    if (s->jump_count > 1)
        qsort(s->jump, (size_t)s->jump_count, sizeof(jump), by_end);
    for (int k = 0; k < s->jump_count; k++) {
        jump next = s->jump[k], *before = count > 0 ? &s->jump[count - 1] : NULL;
        if (before && next.first < before->last)
            before->first = next.first > before->first ? next.first : before->first;
        else
            s->jump[count++] = next;
    }
    return count;
}

/* Drops the smallest jumps beyond the available room. */
static int drop_smallest(scan *s, int count)
{
    while (count > KMP_WHEEL_ZONES - 1) {
        int least = 0;
        for (int k = 1; k < count; k++)
            if (s->jump[k].last - s->jump[k].first < s->jump[least].last - s->jump[least].first)
                least = k;
        memmove(s->jump + least, s->jump + least + 1, (size_t)(--count - least) * sizeof(jump));
    }
    return count;
}

/* Collects the zones; returns their number with room for all. */
static int collect(scan *s, kmp_wheel *wheel)
{
    int all = join_jumps(s), borders = drop_smallest(s, all);
    double end = s->first + s->step * (s->count - 1), beyond = BEYOND * s->scale;
    wheel->zone[0][0] = fmax(s->first, s->first + s->step * s->lowest - beyond);
    for (int k = 0; k < borders; k++)
        wheel->zone[k][1] = wheel->zone[k + 1][0] = s->first + s->step * (s->jump[k].first + s->jump[k].last) / 2;
    wheel->zone[borders][1] = fmin(end, s->first + s->step * s->highest + beyond);
    wheel->zone_count = borders + 1;
    return all + 1;
}

double kmp_zones_stand(const kmp_track *track, const kmp_wheel *wheel)
{
    const kmp_table *rail = track->rail;
    double slope = kmp_table_value(wheel->profile->height, 1, 0), best = rail->x[0], most = -INFINITY;
    int count = points_of(end_of(rail) - rail->x[0], FINE * wheel->scale);
    for (int k = 0; k < count; k++) {
        double y = rail->x[0] + (end_of(rail) - rail->x[0]) * k / (count - 1);
        double over = kmp_table_value(rail, 0, y) - slope * y;
        if (over > most) {
            most = over;
            best = y;
        }
    }
    return best;
}

int kmp_zones_find(const kmp_track *track, kmp_wheel *wheel)
{
    scan s;
    bool ok = begin(&s, track, wheel);
    for (size_t k = 0; ok && k < sizeof rolls / sizeof rolls[0]; k++)
        roll_over(&s, wheel->stands, rolls[k]);
    int zones = ok && !s.arena.failed ? collect(&s, wheel) : 0;
    kmp_arena_free(&s.arena);
    return zones;
}

/* -- places ------------------------------------------------------------------------------------------- */

/* A Gaussian of standard deviation sigma is summed up to 1e-6 of itself at places 1.2 sigma apart. */
#define RESOLVED   1.2
#define LEAST      8e-6 /* spread, relative to the radius */
#define MOST_LEAST 5e-5 /* upper limit, so that an edge blurs only a part of its zone */
#define NARROWEST  1e-4 /* distance of places */
#define WIDEST     1e-3
#define GROWING    0.12   /* of spacings, from each to the next */
#define ALIKE      0.05   /* rad: largest difference of normals of points that may touch, including the wheel's roll */
#define OUTSIDE    2.5e-3 /* of places beyond a zone: the limit by pair.c's penalty */

/* A point of the rail: its angle and curvature. */
typedef struct bend {
    double angle, curvature;
} bend;

static int by_curvature(const void *a, const void *b)
{
    double x = ((const bend *)a)->curvature, y = ((const bend *)b)->curvature;
    return (x > y) - (x < y);
}

/* The points of the rail with curvatures below 0, the least first; every other point. Returns their number. */
static int find_bends(const scan *s, const kmp_table *rail, bend *bends)
{
    int count = 0;
    for (int l = 0; l < s->rail_count; l += 2) {
        double at = s->rail_first + s->rail_step * l, curvature = kmp_table_value(rail, 2, at);
        if (curvature < 0)
            bends[count++] = (bend){atan(kmp_table_value(rail, 1, at)), curvature};
    }
    if (count > 1)
        qsort(bends, (size_t)count, sizeof *bends, by_curvature);
    return count;
}

/* The least curvature of the rail, at most 0, where its angle is near. */
static double least_near(int count, const bend *bends, double near)
{
    for (int k = 0; k < count; k++)
        if (fabs(bends[k].angle - near) <= ALIKE)
            return bends[k].curvature;
    return 0;
}

/* The greatest curvatures of the gap where a point of the wheel touches, by point, with those of the rail whose normals
 * are nearly equal. */
static bool find_kinks(scan *s, const kmp_track *track, const kmp_wheel *wheel, double *curvature)
{
    bend *bends = KMP_ARENA_NEW(&s->arena, bend, s->rail_count);
    if (!bends)
        return false;
    int count = find_bends(s, track->rail, bends);
    for (int k = 0; k < s->count; k++) {
        const kmp_table *height = wheel->profile->height;
        double at = s->first + s->step * k, slope = atan(kmp_table_value(height, 1, at));
        curvature[k] = kmp_table_value(height, 2, at) - least_near(count, bends, slope);
    }
    return true;
}

static int point_near(const scan *s, double at)
{
    return (int)fmin(fmax(round((at - s->first) / s->step), 0), s->count - 1);
}

/* Places from one end of the zone to the other, at `wider` times their spacing, if there is room for them. */
static bool put_places(const scan *s, kmp_wheel *wheel, int zone, double wider, const double *spacing)
{
    int *end = &wheel->nodes_end[zone];
    double outside = OUTSIDE * s->scale, at = wheel->zone[zone][0] - outside, last = wheel->zone[zone][1] + outside;
    *end = zone > 0 ? wheel->nodes_end[zone - 1] : 0;
    while (*end < KMP_WHEEL_PLACES) {
        wheel->node[(*end)++] = at;
        if (at >= last)
            return true;
        double direction = spacing[point_near(s, at)] * wider;
        at += spacing[point_near(s, at + direction / 2)] * wider;
    }
    return false;
}

/* The spread that all places of a zone resolve. If curvatures exceed 3300 1/m (for a wheel of 0.46 m), places do not
 * resolve it, and contact there is at a place. */
static double resolved(const scan *s, const kmp_wheel *wheel, int zone, const double *curvature)
{
    double least = LEAST * wheel->radius.value;
    int place = zone > 0 ? wheel->nodes_end[zone - 1] : 0;
    for (int k = 0; k < s->count; k++) {
        double at = s->first + s->step * k;
        if (at < wheel->zone[zone][0] || at > wheel->zone[zone][1])
            continue;
        while (place + 1 < wheel->nodes_end[zone] - 1 && wheel->node[place + 1] < at)
            place++;
        double spacing = wheel->node[place + 1] - wheel->node[place];
        least = fmax(least, curvature[k] * spacing * spacing / (RESOLVED * RESOLVED));
    }
    return fmin(least, MOST_LEAST * wheel->radius.value);
}

bool kmp_zones_space(const kmp_track *track, kmp_wheel *wheel)
{
    scan s;
    bool ok = begin(&s, track, wheel);
    double *curvature = KMP_ARENA_NEW(&s.arena, double, s.count), *spacing = KMP_ARENA_NEW(&s.arena, double, s.count);
    ok = ok && curvature && spacing && find_kinks(&s, track, wheel, curvature);
    if (ok) {
        /* The spacing that resolves the least spread at each point, growing slowly from there. */
        double radius = wheel->radius.value;
        for (int k = 0; k < s.count; k++) {
            double widest = WIDEST * s.scale,
                   wanted = curvature[k] > 0 ? RESOLVED * sqrt(LEAST * radius / curvature[k]) : widest;
            spacing[k] = fmin(fmax(wanted, NARROWEST * s.scale), widest);
        }
        for (int k = 1; k < s.count; k++)
            spacing[k] = fmin(spacing[k], spacing[k - 1] + GROWING * s.step);
        for (int k = s.count - 1; k-- > 0;)
            spacing[k] = fmin(spacing[k], spacing[k + 1] + GROWING * s.step);
    }
    int zone = 0;
    for (double wider = 1; ok && zone < wheel->zone_count; wider *= 1.25)
        for (zone = 0; zone < wheel->zone_count && put_places(&s, wheel, zone, wider, spacing);)
            zone++;
    for (zone = 0; ok && zone < wheel->zone_count; zone++)
        wheel->least_spread[zone] = resolved(&s, wheel, zone, curvature);
    kmp_arena_free(&s.arena);
    return ok;
}
