/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels on rails: each becomes a force, and where its contact is rigid a closure, of its name. */
#include "rail/model/read_wheels.h"
#include "base/arena.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/read/read_closures.h"
#include "model/read/read_values.h"
#include "rail/model/read_profiles.h"
#include "rail/model/wheel_words.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* -- zones by sampling ----------------------------------------------------------------------------------- */

/* Zones by sampling: the wheel without yaw is put over the rail at many positions, at a few rolls, and lowered until it
 * touches. The heights of both are on fine even grids. */

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
    int lowest, highest; /* of the wheels that touch anywhere */
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
    /* The greatest heights of the rail under a run that is as wide, from the heights of spans that double. */
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
    if (KMP_ARENA_GROW(&s->arena, s->jump, s->jump_count))
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

/* Collects the zones; returns their number with room for all. */
static int collect(scan *s, kmp_wheel *wheel)
{
    int all = join_jumps(s), borders = all;
    while (borders > KMP_WHEEL_ZONES - 1) { /* the smallest jumps have no room */
        int least = 0;
        for (int k = 1; k < borders; k++)
            if (s->jump[k].last - s->jump[k].first < s->jump[least].last - s->jump[least].first)
                least = k;
        memmove(s->jump + least, s->jump + least + 1, (size_t)(--borders - least) * sizeof(jump));
    }
    double end = s->first + s->step * (s->count - 1), beyond = BEYOND * s->scale;
    wheel->zone[0][0] = fmax(s->first, s->first + s->step * s->lowest - beyond);
    for (int k = 0; k < borders; k++)
        wheel->zone[k][1] = wheel->zone[k + 1][0] = s->first + s->step * (s->jump[k].first + s->jump[k].last) / 2;
    wheel->zone[borders][1] = fmin(end, s->first + s->step * s->highest + beyond);
    wheel->zone_count = borders + 1;
    return all + 1;
}

/* The neutral position of the wheel: a straight line with the slope in the middle of its profile, put on the rail. */
static double zones_stand(const kmp_track *track, const kmp_wheel *wheel)
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

/* Samples the wheel over the rail, around its neutral position (zones_stand), at a few rolls, and notes the points
 * that touch. One zone ends, and the next one begins, in the middle of each jump of the point of contact. Jumps count
 * above 2 mm (for a wheel of 0.46 m, and in proportion). For an elastic wheel only jumps count over which the normal
 * turns by 0.3 rad or more. Jumps that overlap, at different rolls, share a border. Borders of the smallest jumps are
 * left out where there is no room. Returns the number of zones with room for all; 0: no memory. */
static int zones_find(const kmp_track *track, kmp_wheel *wheel)
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
#define OUTSIDE    2.5e-3 /* of places beyond a zone: the limit by patch.c's penalty */

/* A point of the rail: its angle and curvature. */
typedef struct bend {
    double angle, curvature;
} bend;

static int by_curvature(const void *a, const void *b)
{
    double x = ((const bend *)a)->curvature, y = ((const bend *)b)->curvature;
    return (x > y) - (x < y);
}

/* The greatest curvatures of the gap where a point of the wheel touches, by point, with the points of the rail whose
 * normals are nearly equal. */
static bool find_kinks(scan *s, const kmp_track *track, const kmp_wheel *wheel, double *curvature)
{
    bend *bends = KMP_ARENA_NEW(&s->arena, bend, s->rail_count);
    if (!bends)
        return false;
    /* The points of the rail with curvatures below 0, the least first; every other point. */
    int count = 0;
    for (int l = 0; l < s->rail_count; l += 2) {
        double at = s->rail_first + s->rail_step * l, bent = kmp_table_value(track->rail, 2, at);
        if (bent < 0)
            bends[count++] = (bend){atan(kmp_table_value(track->rail, 1, at)), bent};
    }
    if (count > 1)
        qsort(bends, (size_t)count, sizeof *bends, by_curvature);
    for (int k = 0; k < s->count; k++) {
        const kmp_table *height = wheel->profile->height;
        double at = s->first + s->step * k, slope = atan(kmp_table_value(height, 1, at));
        curvature[k] = kmp_table_value(height, 2, at);
        for (int l = 0; l < count; l++)
            if (fabs(bends[l].angle - slope) <= ALIKE) {
                curvature[k] -= bends[l].curvature;
                break;
            }
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

/* The spacing of the places in an elastic wheel's zones, and the least spread that they resolve. Both follow from the
 * curvatures of points that can touch there, sampled every 0.25 mm (for a wheel of 0.46 m). At edges with a radius
 * below 0.3 mm, and at edges that the sampling misses, places do not resolve it. A contact there may be off by half of
 * the 0.1 mm between them. False: no memory. */
static bool zones_space(const kmp_track *track, kmp_wheel *wheel)
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

static const kmp_key wheel_keys[] = {
#include "rail/keys/wheel_keys.def"
    {0}};

/* A wheel being read. */
typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_wheel *wheel;
} reading;

/* -- words --------------------------------------------------------------------------------------- */

/* TRACK.left or TRACK.right */
static bool read_rail(const reading *w, const kmp_yaml *node)
{
    kmp_reader *r = w->r;
    const char *word = kmp_read_word(r, node, w->what), *dot = word ? strrchr(word, '.') : NULL;
    int side = dot ? kmp_name_find(KMP_NAMES(kmp_track_side_words, KMP_TRACK_SIDES), dot + 1) : -1;
    if (!word)
        return false;
    if (side < 0)
        return kmp_reader_complain(r, node->place, "%s: a rail is TRACK.left or TRACK.right, not '%s'", w->what, word);
    w->wheel->side = (kmp_track_side)side;
    kmp_yaml name = *node;
    name.text = kmp_reader_say(r, "%.*s", (int)(dot - word), word);
    int track = kmp_read_reference(r, &name, w->what, "track", KMP_NAMED(r->model, track));
    w->wheel->track = track < 0 ? 0 : track;
    return track >= 0;
}

static bool read_centre(const reading *w, const kmp_yaml *node)
{
    w->wheel->point = kmp_read_point(w->r, node, w->what);
    if (w->wheel->point < 0)
        return false;
    const kmp_body *body = &w->r->model->bodies[w->r->model->points[w->wheel->point].body];
    if (body->flexible > 0)
        return kmp_reader_complain(w->r, node->place, "%s: a wheel is at a point of a rigid body, and '%s' is flexible",
                                   w->what, body->name);
    if (body > w->r->model->bodies)
        return true;
    return kmp_reader_complain(w->r, node->place,
                               "%s: a wheel is at a point of a body that rotates with it, not of the ground", w->what);
}

/* -- numbers ------------------------------------------------------------------------------------- */

static bool read_poisson(const reading *w)
{
    double *poisson = &w->wheel->poisson;
    (void)kmp_key_default(wheel_keys, "poisson", 1, poisson);
    const kmp_yaml *node = kmp_yaml_get(w->map, "poisson");
    if (!node)
        return true;
    if (!kmp_read_fixed(w->r, node, kmp_reader_say(w->r, "poisson of %s", w->what),
                        kmp_key_dimension(wheel_keys, "poisson"), poisson))
        return false;
    if (*poisson >= 0 && *poisson <= 0.5)
        return true;
    return kmp_reader_complain(w->r, node->place, "%s: poisson must be between 0 and 0.5, not %.6g", w->what, *poisson);
}

static bool read_numbers(const reading *w)
{
    kmp_wheel *wheel = w->wheel;
    bool good = kmp_read_required(w->r, w->map, w->what, "radius");
    wheel->has_stiffness = kmp_yaml_get(w->map, "stiffness");
    for (int k = 0; k < KMP_WHEEL_FIELDS; k++) {
        const kmp_wheel_field *field = &kmp_wheel_fields[k];
        const kmp_yaml *node = kmp_yaml_get(w->map, field->key);
        const char *name = kmp_reader_say(w->r, "the %s of %s", field->key, w->what);
        kmp_number *number = (kmp_number *)(void *)((char *)wheel + field->offset);
        (void)kmp_key_default(wheel_keys, field->key, 1, &number->value);
        if (node)
            good = kmp_read_number(w->r, node, name, kmp_key_dimension(wheel_keys, field->key), number) &&
                   kmp_check_rule(w->r, node, name, field->rule, number->value, "") && good;
    }
    return read_poisson(w) && good;
}

/* Reports keys that a rigid wheel does not use. */
static bool check_form(const reading *w)
{
    static const char *const elastic[] = {"stiffness", "damping"};
    bool good = true;
    for (int k = 0; k < 2 && w->wheel->form == KMP_CONTACT_RIGID; k++) {
        const kmp_yaml *node = kmp_yaml_get(w->map, elastic[k]);
        if (node)
            kmp_reader_complain(w->r, node->place, "%s: the key '%s' belongs to an elastic contact", w->what,
                                elastic[k]);
        good = good && !node;
    }
    return good;
}

/* -- zones --------------------------------------------------------------------------------------- */

static bool read_zone(const reading *w, const kmp_yaml *node, int k, double (*zone)[2])
{
    const char *what = kmp_reader_say(w->r, "zone %d of %s", k + 1, w->what);
    if (!kmp_read_list(w->r, node, what, 2))
        return false;
    for (int i = 0; i < 2; i++)
        if (!kmp_read_fixed(w->r, node->items[i], what, kmp_key_dimension(wheel_keys, "zones"), &zone[k][i]))
            return false;
    if (zone[k][0] < zone[k][1] && (k == 0 || zone[k][0] >= zone[k - 1][1]))
        return true;
    return kmp_reader_complain(w->r, node->place, "%s is from %.6g to %.6g: zones must increase without overlap", what,
                               zone[k][0], zone[k][1]);
}

static bool read_zones(const reading *w)
{
    kmp_wheel *wheel = w->wheel;
    const kmp_yaml *list = kmp_yaml_get(w->map, "zones");
    if (!list)
        return true;
    if (!kmp_read_list(w->r, list, kmp_reader_say(w->r, "zones of %s", w->what), -1))
        return false;
    if (list->count < 1 || list->count > KMP_WHEEL_ZONES)
        return kmp_reader_complain(w->r, list->place, "%s: a wheel has 1 to %d zones, not %d", w->what, KMP_WHEEL_ZONES,
                                   list->count);
    bool good = true;
    for (int k = 0; k < list->count; k++)
        good = read_zone(w, list->items[k], k, wheel->zone) && good;
    wheel->zone_count = list->count;
    return good;
}

static bool has_same_shape(const kmp_wheel *a, const kmp_wheel *b)
{
    return a->track == b->track && a->profile == b->profile && a->radius.value == b->radius.value;
}

/* Copies the zones of an equal earlier wheel, or finds them. */
static void find_zones(const reading *w)
{
    const kempe_model *model = w->r->model;
    kmp_wheel *wheel = w->wheel;
    for (const kmp_wheel *other = model->wheels; other < wheel; other++)
        if (has_same_shape(other, wheel) && other->zone_count > 0 && other->form == wheel->form &&
            !other->zones_given) {
            wheel->zone_count = other->zone_count;
            memcpy(wheel->zone, other->zone, sizeof wheel->zone);
            return;
        }
    int zones = zones_find(&model->tracks[wheel->track], wheel);
    if (zones == 0)
        w->r->scratch.failed = true;
    if (zones > KMP_WHEEL_ZONES) {
        const kmp_place place = w->wheel->place;
        kmp_log(w->r->context, KEMPE_LOG_WARNING,
                "%s:%d:%d: %s would touch its rail in %d zones, and has at most %d: the contact may jump at omitted "
                "borders; use a smoother profile, or give 'zones'",
                w->r->model->source.files[place.file], place.line, place.column, w->what, zones, KMP_WHEEL_ZONES);
    }
}

/* Copies the places of an equal earlier wheel's zones, or finds them. */
static void space_zones(const reading *w)
{
    const kempe_model *model = w->r->model;
    kmp_wheel *wheel = w->wheel;
    for (const kmp_wheel *other = model->wheels; other < wheel; other++)
        if (other->track == wheel->track && other->profile == wheel->profile && other->form == wheel->form &&
            other->radius.value == wheel->radius.value && other->zone_count == wheel->zone_count &&
            memcmp(other->zone, wheel->zone, sizeof wheel->zone) == 0) {
            memcpy(wheel->node, other->node, sizeof wheel->node);
            memcpy(wheel->nodes_end, other->nodes_end, sizeof wheel->nodes_end);
            memcpy(wheel->least_spread, other->least_spread, sizeof wheel->least_spread);
            return;
        }
    if (!zones_space(&model->tracks[wheel->track], wheel))
        w->r->scratch.failed = true;
}

static void read_wheel(const reading *w)
{
    kmp_reader *r = w->r;
    kmp_wheel *wheel = w->wheel;
    int form = KMP_CONTACT_ELASTIC, law = KMP_CREEP_POLACH;
    if (!kmp_read_map(r, w->map, w->what, wheel_keys))
        return;
    const kmp_yaml *on = kmp_read_required(r, w->map, w->what, "on"), *at = kmp_read_required(r, w->map, w->what, "at"),
                   *profile = kmp_read_required(r, w->map, w->what, "profile");
    bool good = on && read_rail(w, on);
    good = at && read_centre(w, at) && good;
    wheel->profile = profile ? kmp_read_profile(r, profile, w->what) : NULL;
    good = wheel->profile && wheel->profile->height && good;
    good = kmp_read_word_of(w->r, w->map, w->what, "contact",
                            KMP_NAMES(kmp_contact_form_words, KMP_CONTACT_ELASTIC + 1), &form) &&
           good;
    good =
        kmp_read_word_of(w->r, w->map, w->what, "creep", KMP_NAMES(kmp_creep_law_words, KMP_CREEP_LAWS), &law) && good;
    wheel->form = (kmp_contact_form)form;
    wheel->law = (kmp_creep_law)law;
    good = check_form(w) && good;
    good = read_numbers(w) && good;
    wheel->zones_given = kmp_yaml_get(w->map, "zones");
    good = read_zones(w) && good;
    if (!good || !r->model->tracks[wheel->track].rail)
        return;
    /* The scale of the lengths in the search for contact: the wheel's radius over 0.46 m. For a profile that is very
     * wide or narrow for that radius its width decides. */
    const kmp_table *height = wheel->profile->height;
    double width = (end_of(height) - height->x[0]) / GRID;
    wheel->scale = fmin(fmax(wheel->radius.value / USUAL, width / MOST_POINTS), width / FEWEST_POINTS);
    /* Sets the neutral position: the one of an earlier wheel of the same shape, or finds it. */
    const kempe_model *model = w->r->model;
    const kmp_wheel *other = model->wheels;
    while (other < wheel && !(other->scale > 0 && has_same_shape(other, wheel)))
        other++;
    wheel->stands = other < wheel ? other->stands : zones_stand(&model->tracks[wheel->track], wheel);
    if (!wheel->zones_given)
        find_zones(w);
    if (wheel->form == KMP_CONTACT_ELASTIC)
        space_zones(w);
}

void kmp_read_wheels(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "wheels", "wheel");
    model->wheels = KMP_ARENA_NEW(&model->arena, kmp_wheel, s.count);
    while (model->wheels && kmp_section_next(&s)) {
        kmp_wheel *wheel = &model->wheels[model->wheel_count++];
        *wheel = (kmp_wheel){.name = s.name, .place = s.key->place, .point = -1, .closure = -1, .force = -1};
        read_wheel(&(reading){r, s.node, s.what, wheel});
    }
}

static void complain_name(kmp_reader *r, const kmp_wheel *wheel, const char *other)
{
    kmp_reader_complain(r, wheel->place, "a wheel cannot have the name '%s' of a %s: its own has the name of the wheel",
                        wheel->name, other);
}

void kmp_add_wheel_closures(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int k = 0; k < model->wheel_count; k++) {
        kmp_wheel *wheel = &model->wheels[k];
        if (wheel->form != KMP_CONTACT_RIGID)
            continue;
        if (kmp_name_find(KMP_NAMED(model, closure), wheel->name) >= 0)
            complain_name(r, wheel, "loop");
        wheel->closure = model->closure_count;
        kmp_add_closure(r, wheel->name, KMP_CLOSURE_wheel, wheel->place)->wheel = k;
    }
}

void kmp_add_wheel_forces(kmp_reader *r)
{
    kempe_model *model = r->model;
    for (int k = 0; k < model->wheel_count; k++) {
        kmp_wheel *wheel = &model->wheels[k];
        if (kmp_name_find(KMP_NAMED(model, force), wheel->name) >= 0)
            complain_name(r, wheel, "force");
        wheel->force = model->force_count++;
        model->forces[wheel->force] =
            (kmp_force){.name = wheel->name, .kind = KMP_FORCE_WHEEL, .place = wheel->place, .motion = -1, .wheel = k};
    }
}
