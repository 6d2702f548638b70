/* SPDX-License-Identifier: BSD-3-Clause */
/* The course of a track, piece by piece.
 *
 * Curvature is linear over the arc length in transitions (clothoids), cant too except at its corners, which are rounded
 * within half a metre. A jump of curvature becomes a transition within 5 cm. The line is integrated to rounding and
 * kept as cubic splines: positions within 1e-9 m, directions within 1e-8 rad of it. Before and after the course it is
 * straight.
 *
 * Pieces of a course are integrated by Gauss-Legendre with four points. Knots of the cubic splines are placed by the
 * fourth derivative (de Boor 1978, chapter V); candidates for the nearest point are refined until they are unambiguous.
 */
#include "rail/model/read_course.h"
#include "base/arena.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/language/limits.h"
#include "model/read/read_values.h"
#include "rail/model/wheel_words.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

typedef enum course_result {
    LAID,
    MEMORY,
    LARGE /* more points than KMP_MOST_COURSE_KNOTS */
} course_result;

enum { SHORTEST = 1, LONGEST = 1000 }; /* of a piece, in mm; of all pieces, in km */

static const double lead = 1;          /* m of straight before and after the course */
static const double jump = 0.05;       /* m over which curvature changes where it would jump */
static const double corner = 0.5;      /* m over which the slope of cant changes at either end of its ramp */
static const double direction = 1e-9;  /* rad: error of the spline's slope away from rounding */
static const double growth = 0.4;      /* of the spacing with the distance from a joint */
static const double least_step = 1e-5; /* m */

/* A part of the line: curvature linear, cant a parabola over the distance from its beginning. */
typedef struct section {
    double length, curvature, curvature_rate, cant, cant_rate, cant_curvature;
} section;

typedef struct laying {
    kmp_arena arena;
    const kmp_track *track;
    section *section;
    int count;
    double *s, *x, *y, *cant;
    int knots;
    bool canted;
} laying;

/* -- sections -------------------------------------------------------------------------------------- */

/* The k-th piece; before the first and after the last are straights. */
static kmp_course_piece piece_at(const kmp_track *track, int k)
{
    if (k < 0 || k >= track->course_count)
        return (kmp_course_piece){KMP_COURSE_STRAIGHT, lead, 0, 0};
    return track->course[k];
}

/* Signed: a curve to the left is positive; 0 of a straight, and meaningless of a transition. */
static double curvature_at(const kmp_track *track, int k)
{
    kmp_course_piece piece = piece_at(track, k);
    if (piece.kind == KMP_COURSE_STRAIGHT)
        return 0;
    return piece.kind == KMP_COURSE_LEFT ? 1 / piece.radius : -1 / piece.radius;
}

/* Angle by which the left rail is up, over the distance of the rails' middles. */
static double cant_at(const kmp_track *track, int k)
{
    kmp_course_piece piece = piece_at(track, k);
    double angle = asin(piece.cant / (2 * track->rail_at));
    return piece.kind == KMP_COURSE_LEFT ? -angle : angle;
}

static bool is_transition(const kmp_track *track, int k)
{
    return piece_at(track, k).kind == KMP_COURSE_TRANSITION;
}

/* The length over which curvature changes from piece k - 1 to piece k, half of it on either. */
static double jump_length(const kmp_track *track, int k)
{
    if (is_transition(track, k - 1) || is_transition(track, k) || curvature_at(track, k - 1) == curvature_at(track, k))
        return 0;
    return fmin(jump, fmin(piece_at(track, k - 1).length, piece_at(track, k).length) / 2);
}

static void add(laying *l, section s)
{
    if (s.length > 0)
        l->section[l->count++] = s;
    l->canted = l->canted || s.cant != 0 || s.cant_curvature != 0;
}

/* A transition: cant rises by a ramp whose ends are parabolas, curvature by one straight line. */
static void add_transition(laying *l, int k)
{
    const kmp_track *t = l->track;
    double length = piece_at(t, k).length, curvature = curvature_at(t, k - 1), cant = cant_at(t, k - 1);
    double rate = (curvature_at(t, k + 1) - curvature) / length, rise = cant_at(t, k + 1) - cant;
    if (rise == 0) {
        add(l, (section){length, curvature, rate, cant, 0, 0});
        return;
    }
    double round = fmin(corner, length / 4), slope = rise / (length - round), middle = length - 2 * round;
    double first = slope * round / 2, last = cant + first + slope * middle;
    add(l, (section){round, curvature, rate, cant, 0, slope / round});
    add(l, (section){middle, curvature + rate * round, rate, cant + first, slope, 0});
    add(l, (section){round, curvature + rate * (length - round), rate, last, slope, -slope / round});
}

static void add_sections(laying *l)
{
    const kmp_track *t = l->track;
    for (int k = -1; k <= t->course_count; k++) {
        double before = k < 0 ? 0 : jump_length(t, k), behind = k < t->course_count ? jump_length(t, k + 1) : 0;
        double curvature = curvature_at(t, k), next = curvature_at(t, k + 1);
        if (is_transition(t, k))
            add_transition(l, k);
        else
            add(l, (section){piece_at(t, k).length - (before + behind) / 2, curvature, 0, cant_at(t, k), 0, 0});
        if (behind > 0)
            add(l, (section){behind, curvature, (next - curvature) / behind, cant_at(t, k), 0, 0});
    }
}

/* -- knots ----------------------------------------------------------------------------------------- */

typedef struct spacing {
    double most, left, right; /* inside, and at either end */
} spacing;

/* A spline is off by about a tenth of the jump of the third derivative times the square of the spacing in slope there.
 */
static double spacing_at(const section *a, const section *b)
{
    double change = fmax(fabs(b->curvature_rate - a->curvature_rate), fabs(b->cant_curvature - a->cant_curvature));
    return change > 0 ? fmax(least_step, sqrt(direction / (0.1 * change))) : INFINITY;
}

/* The step in a section: near joints by spacing_at, elsewhere from the direction's error, the fourth derivative times
 * the step's cube, by 24 (de Boor, A Practical Guide to Splines, 1978, chapter V). */
static spacing spacing_of(const laying *l, int k)
{
    const section *s = &l->section[k];
    double curvature = fmax(fabs(s->curvature), fabs(s->curvature + s->curvature_rate * s->length));
    double fourth = curvature * curvature * curvature + 3 * curvature * fabs(s->curvature_rate);
    spacing w = {s->length / 4, INFINITY, INFINITY};
    if (fourth > 0)
        w.most = fmin(w.most, cbrt(24 * direction / fourth));
    if (k > 0)
        w.left = spacing_at(s - 1, s);
    if (k + 1 < l->count)
        w.right = spacing_at(s, s + 1);
    return w;
}

static double step_at(const spacing *w, double u, double length)
{
    return fmin(w->most, fmin(w->left + growth * u, w->right + growth * (length - u)));
}

/* The number of intervals of a section, and their length before they are scaled to fit; it stops beyond `most`. */
static int count_steps(const laying *l, int k, int most, double *reach)
{
    spacing w = spacing_of(l, k);
    double length = l->section[k].length, u = 0;
    int n = 0;
    for (; u < length && n <= most; n++)
        u += step_at(&w, u, length);
    *reach = u;
    return n;
}

/* -- the line -------------------------------------------------------------------------------------- */

typedef struct place {
    double x, y, lost_x, lost_y; /* lost: rounding errors of the sums */
} place;

static void sum(double *to, double *lost, double by)
{
    double rest = by - *lost, whole = *to + rest;
    *lost = (whole - *to) - rest;
    *to = whole;
}

/* Integrates over an interval of a section that begins with `heading`: Gauss-Legendre with four points. */
static void go(place *p, const section *s, double heading, double from, double to)
{
    static const double node[2] = {0.33998104358485626, 0.86113631159405258};
    static const double weight[2] = {0.65214515486254614, 0.34785484513745386};
    double half = (to - from) / 2, middle = (from + to) / 2, x = 0, y = 0;
    for (int k = 0; k < 4; k++) {
        double u = middle + (k % 2 ? half : -half) * node[k / 2];
        double angle = heading + u * (s->curvature + s->curvature_rate * u / 2);
        x += weight[k / 2] * half * cos(angle);
        y += weight[k / 2] * half * sin(angle);
    }
    sum(&p->x, &p->lost_x, x);
    sum(&p->y, &p->lost_y, y);
}

static void put(laying *l, double s, const place *p, double cant)
{
    l->s[l->knots] = s;
    l->x[l->knots] = p->x;
    l->y[l->knots] = p->y;
    l->cant[l->knots++] = cant;
}

static void follow(laying *l)
{
    double begin = -lead, heading = 0;
    place p = {-lead, 0, 0, 0};
    put(l, begin, &p, 0);
    for (int k = 0; k < l->count; k++) {
        const section *s = &l->section[k];
        spacing w = spacing_of(l, k);
        double reach, u = 0, raw = 0;
        int n = count_steps(l, k, KMP_MOST_COURSE_KNOTS, &reach);
        for (int i = 0; i < n; i++) {
            raw += step_at(&w, raw, s->length);
            double next = i + 1 < n ? raw * s->length / reach : s->length;
            go(&p, s, heading, u, next);
            u = next;
            put(l, begin + u, &p, s->cant + u * (s->cant_rate + u * s->cant_curvature / 2));
        }
        heading += s->length * (s->curvature + s->curvature_rate * s->length / 2);
        begin += s->length;
    }
}

/* -- candidates ------------------------------------------------------------------------------------ */

typedef struct candidate {
    double s, x, y;
} candidate;

typedef struct candidates {
    kmp_arena *arena;
    const kmp_track *track;
    candidate *list;
    int count;
} candidates;

static bool insert(candidates *c, int at, double s)
{
    if (!KMP_ARENA_GROW(c->arena, c->list, c->count))
        return false;
    memmove(c->list + at + 1, c->list + at, (size_t)(c->count - at) * sizeof *c->list);
    c->list[at] = (candidate){s, kmp_table_value(c->track->x, 0, s), kmp_table_value(c->track->y, 0, s)};
    c->count++;
    return true;
}

/* The ends of all pieces, and between them one for every half radian. */
static bool add_candidates(candidates *c)
{
    const kmp_track *t = c->track;
    double begin = 0;
    bool ok = insert(c, 0, 0);
    for (int k = 0; ok && k < t->course_count; k++) {
        double length = t->course[k].length, curvature = curvature_at(t, k);
        if (is_transition(t, k))
            curvature = fmax(fabs(curvature_at(t, k - 1)), fabs(curvature_at(t, k + 1)));
        int parts = 1 + (int)(2 * fabs(curvature) * length);
        for (int i = 1; ok && i <= parts; i++)
            ok = insert(c, c->count, i < parts ? begin + i * length / parts : begin + length);
        begin += length;
    }
    return ok;
}

/* True if the iteration from candidates finds s from a point at `aside` lateral distance, with a margin. */
static bool is_found(const candidates *c, double s, double aside, double margin)
{
    const kmp_track *t = c->track;
    double x = kmp_table_value(t->x, 0, s) - aside * kmp_table_value(t->y, 1, s),
           y = kmp_table_value(t->y, 0, s) + aside * kmp_table_value(t->x, 1, s), own = INFINITY, other = INFINITY;
    for (int k = 0; k < c->count; k++) {
        double dx = x - c->list[k].x, dy = y - c->list[k].y, far = dx * dx + dy * dy;
        bool beside = (k == 0 || s >= c->list[k - 1].s) && (k + 1 == c->count || s <= c->list[k + 1].s);
        double *least = beside ? &own : &other;
        *least = fmin(*least, far);
    }
    return sqrt(own) + margin <= sqrt(other);
}

/* Adds candidates where parts of the course are near each other. A place that is passed twice remains ambiguous. */
static bool refine(candidates *c)
{
    enum { SAMPLES = 2000, PASSES = 4 };
    const kmp_track *t = c->track;
    int samples = (int)fmin(SAMPLES, 1 + 2 * t->length / t->gauge), before = -1;
    double step = t->length / samples;
    for (int pass = 0; pass < PASSES && before != c->count; pass++) {
        before = c->count;
        for (int i = 0; i <= samples; i++) {
            double s = i * step;
            bool found = true;
            for (int side = -1; side <= 1; side++)
                found = found && is_found(c, s, side * t->gauge, step / 2);
            int at = 0;
            while (at < c->count && c->list[at].s <= s)
                at++;
            if (!found && s - c->list[at - 1].s > step / 2 && !insert(c, at, s))
                return false;
        }
    }
    return true;
}

static bool choose_candidates(kmp_track *t, kmp_arena *arena)
{
    candidates c = {.arena = arena, .track = t};
    bool ok = add_candidates(&c) && refine(&c);
    t->candidate = ok ? KMP_NEW(double, c.count) : NULL;
    for (int k = 0; t->candidate && k < c.count; k++)
        t->candidate[k] = c.list[k].s;
    t->candidate_count = c.count;
    return t->candidate;
}

/* -- the whole course ------------------------------------------------------------------------------ */

static bool make_tables(kmp_track *t, laying *l)
{
    if (!KMP_ARENA_EACH(&l->arena, double, l->knots, &l->s, &l->x, &l->y, &l->cant))
        return false;
    l->knots = 0;
    follow(l);
    t->x = kmp_table_new(KMP_TABLE_CUBIC, l->knots, l->s, l->x);
    t->y = kmp_table_new(KMP_TABLE_CUBIC, l->knots, l->s, l->y);
    t->cant = l->canted ? kmp_table_new(KMP_TABLE_CUBIC, l->knots, l->s, l->cant) : NULL;
    return t->x && t->y && (t->cant || !l->canted);
}

/* Computes the course of a track: x, y, cant, candidates and length. Radii of curves are larger than its gauge, pieces
 * and their sum within the limits above. */
static course_result course_lay(kmp_track *t)
{
    laying l = {.track = t};
    course_result result = MEMORY;
    t->length = 0;
    for (int k = 0; k < t->course_count; k++)
        t->length += t->course[k].length;
    l.section = KMP_ARENA_NEW(&l.arena, section, 4 * t->course_count + 5);
    if (l.section) {
        add_sections(&l);
        double reach;
        l.knots = 1;
        for (int k = 0; k < l.count && l.knots <= KMP_MOST_COURSE_KNOTS; k++)
            l.knots += count_steps(&l, k, KMP_MOST_COURSE_KNOTS, &reach);
        if (l.knots > KMP_MOST_COURSE_KNOTS)
            result = LARGE;
        else if (make_tables(t, &l) && choose_candidates(t, &l.arena))
            result = LAID;
    }
    kmp_arena_free(&l.arena);
    return result;
}

static const kmp_key piece_keys[] = {
#include "rail/keys/piece_keys.def"
    {0}};

typedef struct reading {
    kmp_reader *r;
    const kmp_track *track;
    const char *what;
} reading;

/* The length under the key for the kind. */
static const kmp_yaml *find_kind(const reading *c, const kmp_yaml *map, kmp_course_kind *kind)
{
    int first = 0, count = kmp_count_keys(map, KMP_NAMES(kmp_course_words, KMP_COURSE_KINDS), &first);
    *kind = (kmp_course_kind)first;
    if (count == 1)
        return kmp_yaml_get(map, kmp_course_words[first]);
    kmp_reader_complain(c->r, map->place, "%s has one of straight, transition, left, right%s", c->what,
                        count ? ", not several" : "");
    return NULL;
}

static bool read_length(const reading *c, const kmp_yaml *node, const char *key, double *value)
{
    return kmp_read_fixed(c->r, node, kmp_reader_say(c->r, "%s of %s", key, c->what),
                          kmp_key_dimension(piece_keys, key), value);
}

static bool read_radius(const reading *c, const kmp_yaml *map, double *radius)
{
    const kmp_yaml *node = kmp_read_required(c->r, map, c->what, "radius");
    if (!node || !read_length(c, node, "radius", radius))
        return false;
    if (*radius > c->track->gauge)
        return true;
    return kmp_reader_complain(c->r, node->place, "radius of %s must be larger than the gauge %.9g, not %.9g", c->what,
                               c->track->gauge, *radius);
}

static bool read_cant(const reading *c, const kmp_yaml *map, double *cant)
{
    const kmp_yaml *node = kmp_yaml_get(map, "cant");
    double between = 2 * c->track->rail_at;
    if (!node)
        return true;
    if (!read_length(c, node, "cant", cant))
        return false;
    if (*cant > -between && *cant < between)
        return true;
    return kmp_reader_complain(c->r, node->place,
                               "cant of %s is the height of the outer rail above the inner one, less than the "
                               "%.9g m between them, not %.9g",
                               c->what, between, *cant);
}

static bool read_piece(const reading *c, const kmp_yaml *map, kmp_course_piece *piece)
{
    if (!kmp_read_map(c->r, map, c->what, piece_keys))
        return false;
    const kmp_yaml *node = find_kind(c, map, &piece->kind);
    const char *kind = kmp_course_words[piece->kind];
    if (!node || !read_length(c, node, kind, &piece->length))
        return false;
    if (!(piece->length * 1000 >= SHORTEST))
        return kmp_reader_complain(c->r, node->place, "%s of %s must be at least %d mm long, not %.9g m", kind, c->what,
                                   SHORTEST, piece->length);
    bool curve = piece->kind == KMP_COURSE_LEFT || piece->kind == KMP_COURSE_RIGHT;
    for (int k = 0; k < 2 && !curve; k++) {
        const char *key = k ? "cant" : "radius";
        if (kmp_yaml_get(map, key))
            return kmp_reader_complain(c->r, kmp_yaml_get(map, key)->place, "%s: a %s has no %s", c->what, kind, key);
    }
    return !curve || (read_radius(c, map, &piece->radius) && read_cant(c, map, &piece->cant));
}

/* The height of the raised rail: positive for the left one. */
static double lift(const kmp_course_piece *piece)
{
    return piece->kind == KMP_COURSE_LEFT ? -piece->cant : piece->cant;
}

static bool check_joints(kmp_reader *r, const kmp_yaml *list, const char *what, const kmp_track *t)
{
    bool good = true;
    const kmp_course_piece straight = {KMP_COURSE_STRAIGHT, 0, 0, 0};
    for (int k = 0; k <= t->course_count; k++) {
        const kmp_course_piece *a = k > 0 ? &t->course[k - 1] : &straight,
                               *b = k < t->course_count ? &t->course[k] : &straight;
        const kmp_yaml *at = list->items[k < t->course_count ? k : k - 1];
        bool plain = a->kind != KMP_COURSE_TRANSITION && b->kind != KMP_COURSE_TRANSITION;
        if (a->kind == KMP_COURSE_TRANSITION && b->kind == KMP_COURSE_TRANSITION)
            kmp_reader_complain(r, at->place, "%s: a straight or a curve is expected between two transitions", what);
        else if (plain && lift(a) != lift(b))
            kmp_reader_complain(
                r, at->place,
                "%s: the cant jumps from %.9g to %.9g m (left rail up): insert a transition, or use the same cant",
                what, lift(a), lift(b));
        else
            continue;
        good = false;
    }
    return good;
}

void kmp_read_course(kmp_reader *r, const kmp_yaml *list, const char *what, kmp_track *track)
{
    const char *whole = kmp_reader_say(r, "the course of %s", what);
    bool good = kmp_read_list(r, list, whole, -1);
    if (!good || !track->rail)
        return;
    track->course = KMP_ARENA_NEW(&r->model->arena, kmp_course_piece, list->count);
    for (int k = 0; track->course && k < list->count; k++) {
        reading c = {r, track, kmp_reader_say(r, "piece %d of %s", k + 1, whole)};
        good = read_piece(&c, list->items[k], &track->course[k]) && good;
    }
    if (!track->course || !good)
        return;
    track->course_count = list->count;
    if (list->count == 0 || !check_joints(r, list, whole, track))
        return;
    double length = 0;
    for (int k = 0; k < track->course_count; k++)
        length += track->course[k].length;
    if (!(length <= 1000.0 * LONGEST)) {
        kmp_reader_complain(r, list->place, "%s is %.9g m long: at most %d km are allowed", whole, length, LONGEST);
        return;
    }
    course_result result = course_lay(track);
    if (result == LARGE)
        kmp_reader_complain(r, list->place, "%s has too much curvature: its line would have more than %d points", whole,
                            KMP_MOST_COURSE_KNOTS);
    else if (result == MEMORY)
        r->scratch.failed = true;
    track->curved = result == LAID;
}
