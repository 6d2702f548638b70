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
#define JUMP   2e-3   /* shorter ones are none */
#define BEYOND 2e-3   /* a zone goes on so far after the last point that touches */
enum { BISECTIONS = 10, MOST_POINTS = 4000, MOST_JUMPS = 64 };

static const double rolls[] = {-0.01, 0, 0.01};

/* From one point of the wheel to another one, with nothing that touches between them. */
typedef struct jump {
    int first, last;
} jump;

typedef struct scan {
    int count; /* points of the wheel */
    double first, step;
    double *radius;
    int lowest, highest; /* of those that touch anywhere */
    int jump_count;
    jump jump[MOST_JUMPS];
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
    s->lowest = s->count - 1;
    for (int k = 0; s->radius && k < s->count; k++)
        s->radius[k] = wheel->radius.value - s->radius[k];
    return s->radius && s->rail;
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

static void note_jump(scan *s, int a, int b)
{
    if (s->jump_count < MOST_JUMPS)
        s->jump[s->jump_count++] = (jump){a < b ? a : b, a < b ? b : a};
}

/* From one place, where k touches, to the next one, where l does: what stays a jump however near both places are. */
static void follow(scan *s, double out, int k, double next, int l, int depth)
{
    s->lowest = k < s->lowest ? k : s->lowest;
    s->highest = k > s->highest ? k : s->highest;
    if (abs(l - k) * s->step <= JUMP)
        return;
    if (depth == 0) {
        note_jump(s, k, l);
        return;
    }
    double middle = (out + next) / 2;
    int m = touching(s, middle);
    follow(s, out, k, middle, m, depth - 1);
    follow(s, middle, m, next, l, depth - 1);
}

/* What the wheel stands on goes under it from one end of its profile to the other. */
static void roll_over(scan *s, double middle, double roll)
{
    s->cosine = cos(roll);
    s->sine = sin(roll);
    double reach = s->first + s->step * (s->count - 1), lean = s->radius[s->count / 2] * s->sine;
    double out = middle - reach - lean, last = middle - s->first - lean;
    int k = touching(s, out);
    while (out < last) {
        int l = touching(s, out + SHIFT);
        follow(s, out, k, out + SHIFT, l, BISECTIONS);
        out += SHIFT;
        k = l;
    }
}

static int by_end(const void *a, const void *b)
{
    const jump *x = a, *y = b;
    return x->last != y->last ? (x->last > y->last) - (x->last < y->last)
                              : (x->first > y->first) - (x->first < y->first);
}

/* What jumps have in common that overlap becomes one: as few borders as leave none without one. */
static int join_jumps(scan *s)
{
    int count = 0;
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

/* Of more than there is room for the smallest are passed over. */
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

static void collect(scan *s, kmp_wheel *wheel)
{
    int borders = drop_smallest(s, join_jumps(s));
    double end = s->first + s->step * (s->count - 1);
    wheel->zone[0][0] = fmax(s->first, s->first + s->step * s->lowest - BEYOND);
    for (int k = 0; k < borders; k++)
        wheel->zone[k][1] = wheel->zone[k + 1][0] = s->first + s->step * (s->jump[k].first + s->jump[k].last) / 2;
    wheel->zone[borders][1] = fmin(end, s->first + s->step * s->highest + BEYOND);
    wheel->zone_count = borders + 1;
}

double kmp_zones_stand(const kmp_track *track, const kmp_wheel *wheel)
{
    const kmp_table *rail = track->rail;
    double slope = kmp_table_value(wheel->profile->height, 1, 0), best = rail->x[0], most = -INFINITY;
    int count = points_of(end_of(rail) - rail->x[0], FINE);
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

bool kmp_zones_find(const kmp_track *track, kmp_wheel *wheel)
{
    scan s;
    bool ok = begin(&s, track, wheel);
    for (size_t k = 0; ok && k < sizeof rolls / sizeof rolls[0]; k++)
        roll_over(&s, wheel->stands, rolls[k]);
    if (ok)
        collect(&s, wheel);
    kmp_free(s.radius);
    kmp_free(s.rail);
    return ok;
}

int kmp_wheel_contacts(const kmp_wheel *wheel)
{
    return wheel->form == KMP_CONTACT_RIGID ? 1 : wheel->zone_count;
}
