/* SPDX-License-Identifier: BSD-3-Clause */
/* Tracks: two rails, and their positions. */
#include "rail/model/read_tracks.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/language/limits.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "rail/model/read_course.h"
#include "rail/model/read_profiles.h"
#include "rail/model/wheel_words.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdint.h>

/* -- a rail in its track: turned by the inclination, placed by the gauge --------------------------------- */

/* The position of a rail: values given by the track, and results. */
typedef struct rail_place {
    double gauge, gauge_depth, inclination;
    double depth_given; /* out: the inner side reaches so far below the top, m */
    double at;          /* out: the profile's origin, laterally from the track's middle */
    bool reaches;       /* out: the gauge can be measured */
    bool resolved;      /* result: its points are distinct there */
} rail_place;

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
static bool shift(section *s, const kmp_table *turned, rail_place *place)
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

/* The height of an inclined rail over the lateral coordinate from the track's middle, zero on its top. The gauge is
 * measured between the inner sides at a depth below the top. Overhanging parts of the inclined rail are left out. NULL:
 * it does not reach the depth, is not resolved, or no memory. */
static kmp_table *rail_new(const kmp_table *profile, rail_place *place)
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
    /* The part that is visible from above, from the highest point to both sides. */
    int top = 0, first, last;
    for (int k = 1; k < s.count; k++)
        if (s.z[k] > s.z[top])
            top = k;
    for (first = top; first > 0 && s.y[first - 1] < s.y[first]; first--)
        ;
    for (last = top; last + 1 < s.count && s.y[last + 1] > s.y[last]; last++)
        ;
    s = (section){last - first + 1, s.y + first, s.z + first};
    place->resolved = kmp_table_check(s.count, s.y, s.z) < 0;
    kmp_table *turned = place->resolved ? kmp_table_new(KMP_TABLE_CUBIC, s.count, s.y, s.z) : NULL, *rail = NULL;
    if (turned && shift(&s, turned, place)) {
        place->resolved = kmp_table_check(s.count, s.y, s.z) < 0;
        rail = place->resolved ? kmp_table_new(KMP_TABLE_CUBIC, s.count, s.y, s.z) : NULL;
    }
    kmp_table_free(turned);
    kmp_free(room);
    return rail;
}

/* -- irregularities with a spectrum ---------------------------------------------------------------------- */

/* Shinozuka and Jan, Digital simulation of random processes and its applications, J. Sound Vib. 25 (1972): each narrow
 * band becomes one harmonic, of the band's variance and with a random phase. */

typedef struct level {
    double alignment, level;
} level;

static const level levels[] = {
#define KMP_SPECTRUM(word, alignment, level) {alignment, level},
#include "rail/model/spectra.def"
#undef KMP_SPECTRUM
};

enum { KNOTS_A_WAVE = 16, FLAT_KNOTS = 8 };

static const double pi = 3.14159265358979323846;
static const double rise = 10; /* m over which irregularities begin and end */

/* ERRI B176: S = A wc^2 / ((w^2 + wr^2) (w^2 + wc^2)). For the angle between the rails, with half their distance b, A /
 * b^2 wc^2 w^2 / ((w^2 + wr^2) (w^2 + wc^2) (w^2 + ws^2)); for the height over 2 b this has the factor 4. */
double kmp_wave_spectrum_density(int kind, kmp_irregularity what, double frequency)
{
    static const double wc = 0.8246, wr = 0.0206, ws = 0.4380;
    double w2 = frequency * frequency, form = wc * wc / ((w2 + wr * wr) * (w2 + wc * wc));
    switch (what) {
    case KMP_IRREGULARITY_ALIGNMENT:
        return levels[kind].alignment * form;
    case KMP_IRREGULARITY_LEVEL:
        return levels[kind].level * form;
    case KMP_IRREGULARITY_CROSS:
        return 4 * levels[kind].level * form * w2 / (w2 + ws * ws);
    default:
        return 0;
    }
}

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* -- harmonics ----------------------------------------------------------------------------------- */

typedef struct waves {
    int count;
    double *frequency, *size, *phase;
    double *cosine, *sine;           /* at a knot, times the size */
    double *turn_cosine, *turn_sine; /* of the angle from knot to knot */
} waves;

enum { ARRAYS = 7 }; /* of waves */

/* The height at the knots 1, 2 .. in turn. From one to the next each wave is turned by its angle, which is much faster
 * than its cosine; it starts again before rounding adds up. */
static double next_height(const waves *w, int knot, double at)
{
    enum { TURNS = 64 };
    const bool anew = knot % TURNS == 1;
    double sum = 0;
    for (int k = 0; anew && k < w->count; k++) {
        const double angle = w->frequency[k] * at + w->phase[k];
        w->cosine[k] = w->size[k] * cos(angle);
        w->sine[k] = w->size[k] * sin(angle);
    }
    for (int k = 0; !anew && k < w->count; k++) {
        const double cosine = w->cosine[k], sine = w->sine[k];
        w->cosine[k] = cosine * w->turn_cosine[k] - sine * w->turn_sine[k];
        w->sine[k] = sine * w->turn_cosine[k] + cosine * w->turn_sine[k];
    }
    for (int k = 0; k < w->count; k++)
        sum += w->cosine[k];
    return sum;
}

/* 0 at 0 and less, 1 at 1 and more, with two continuous derivatives. */
static double ease(double u)
{
    u = fmin(fmax(u, 0), 1);
    return u * u * u * (10 + u * (6 * u - 15));
}

/* The number of knots of a generated irregularity. */
static double wave_spectrum_knots(const kmp_wave_spectrum *s)
{
    return ceil(KNOTS_A_WAVE * (s->to - s->from) / s->shortest) + 1;
}

/* More knots beyond either end keep the spline flat there. */
static kmp_table *sample(const kmp_wave_spectrum *s, const waves *w, int knots, double *x, double *y)
{
    double length = s->to - s->from, step = length / (knots - 1), over = fmin(rise, length / 4);
    for (int k = 0; k < w->count; k++) {
        w->turn_cosine[k] = cos(w->frequency[k] * step);
        w->turn_sine[k] = sin(w->frequency[k] * step);
    }
    for (int k = 0; k < knots + 2 * FLAT_KNOTS; k++) {
        double at = (k - FLAT_KNOTS) * step;
        bool inside = k > FLAT_KNOTS && k < FLAT_KNOTS + knots - 1;
        x[k] = s->from + at;
        y[k] = inside ? next_height(w, k - FLAT_KNOTS, at) * ease(at / over) * ease((length - at) / over) : 0;
    }
    return kmp_table_new(KMP_TABLE_CUBIC, knots + 2 * FLAT_KNOTS, x, y);
}

/* Generates one irregularity from a spectrum, zero at its ends and beyond; it is determined by the seed. NULL: no
 * memory. */
static kmp_table *wave_spectrum_make(const kmp_wave_spectrum *s, kmp_irregularity what)
{
    int knots = (int)wave_spectrum_knots(s), all = knots + 2 * FLAT_KNOTS;
    /* Nothing repeats over the length with this number of waves, and each band is narrow against the lowest frequency.
     */
    double low = 2 * pi / s->longest, high = 2 * pi / s->shortest;
    waves w = {.count = (int)ceil((high - low) / fmin(low / 4, 2 * pi / (s->to - s->from)))};
    double *room = KMP_NEW(double, w.count *ARRAYS + 2 * all),
           **arrays[ARRAYS] = {&w.frequency, &w.size, &w.phase, &w.cosine, &w.sine, &w.turn_cosine, &w.turn_sine};
    if (!room)
        return NULL;
    for (int k = 0; k < ARRAYS; k++)
        *arrays[k] = room + (ptrdiff_t)k * w.count;
    double *x = room + (ptrdiff_t)ARRAYS * w.count;
    uint64_t state = (uint64_t)s->seed * KMP_IRREGULARITIES + (uint64_t)what;
    double step = (high - low) / w.count;
    for (int k = 0; k < w.count; k++) {
        w.frequency[k] = low + (k + 0.5) * step;
        w.size[k] = s->scale * sqrt(2 * step * kmp_wave_spectrum_density(s->kind, what, w.frequency[k]));
        w.phase[k] = 2 * pi * (double)(next_random(&state) >> 11) / 9007199254740992.0;
    }
    kmp_table *table = sample(s, &w, knots, x, x + all);
    kmp_free(room);
    return table;
}

/* -- irregularities -------------------------------------------------------------------------------------- */

/* Irregularities of a track: tables over the arc length, or generated from a spectrum. */

static const kmp_key irregularity_keys[] = {
#include "rail/keys/irregularity_keys.def"
    {0}};
static const char *const spectrum_keys[] = {"seed", "from", "to", "wavelengths", "scale"};

static const double farthest = 1e6, finest = 1e-3; /* m */
static const double largest_scale = 1000;

typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_wave_spectrum *spectrum;
} reading;

static bool read_value(const reading *c, const kmp_yaml *node, const char *key, double *value)
{
    return kmp_read_fixed(c->r, node, kmp_reader_say(c->r, "%s of %s", key, c->what),
                          kmp_key_dimension(irregularity_keys, key), value);
}

static bool read_kind(const reading *c, const kmp_yaml *node)
{
    if (!kmp_read_word(c->r, node, kmp_reader_say(c->r, "spectrum of %s", c->what)))
        return false;
    c->spectrum->kind = kmp_read_choice(c->r, node, c->what, kmp_wave_spectrum_words, "spectra are");
    return c->spectrum->kind >= 0;
}

static bool read_seed(const reading *c)
{
    const kmp_yaml *node = kmp_read_required(c->r, c->map, c->what, "seed");
    double *seed = &c->spectrum->seed;
    if (!node || !read_value(c, node, "seed", seed))
        return false;
    if (*seed >= 0 && *seed <= 1e9 && *seed == floor(*seed))
        return true;
    return kmp_reader_complain(c->r, node->place, "seed of %s is an integer up to 1e9, not %.9g", c->what, *seed);
}

static bool read_stretch(const reading *c)
{
    const kmp_yaml *from = kmp_yaml_get(c->map, "from"), *to = kmp_read_required(c->r, c->map, c->what, "to");
    bool good = !from || read_value(c, from, "from", &c->spectrum->from);
    if (!to || !read_value(c, to, "to", &c->spectrum->to) || !good)
        return false;
    if (fmax(fabs(c->spectrum->from), fabs(c->spectrum->to)) <= farthest)
        return true;
    return kmp_reader_complain(c->r, to->place,
                               "%s are made within %.9g m of the track's beginning, not from %.9g m to %.9g m", c->what,
                               farthest, c->spectrum->from, c->spectrum->to);
}

static bool read_wavelengths(const reading *c)
{
    const kmp_yaml *list = kmp_yaml_get(c->map, "wavelengths");
    double *shortest = &c->spectrum->shortest, *longest = &c->spectrum->longest;
    if (!list)
        return true;
    const char *what = kmp_reader_say(c->r, "wavelengths of %s", c->what);
    if (!kmp_read_list(c->r, list, what, 2) || !read_value(c, list->items[0], "wavelengths", shortest) ||
        !read_value(c, list->items[1], "wavelengths", longest))
        return false;
    if (*shortest >= finest && *longest > *shortest)
        return true;
    return kmp_reader_complain(c->r, list->place,
                               "%s are the shortest and the longest one, at least %.9g m, not %.9g and %.9g", what,
                               finest, *shortest, *longest);
}

static bool check_size(const reading *c)
{
    const kmp_wave_spectrum *s = c->spectrum;
    bool fits = s->longest / s->shortest <= KMP_MOST_SPECTRUM_KNOTS, lasts = s->to - s->from >= s->shortest;
    if (fits && lasts && wave_spectrum_knots(s) <= KMP_MOST_SPECTRUM_KNOTS)
        return true;
    if (!lasts)
        kmp_reader_complain(c->r, c->map->place, "%s go from %.9g m to %.9g m, which is shorter than a wave of %.9g m",
                            c->what, s->from, s->to, s->shortest);
    else
        kmp_reader_complain(c->r, c->map->place,
                            "%s: too many waves of %.9g m to %.9g m over %.9g m; at most %d points are made, 16 a wave",
                            c->what, s->shortest, s->longest, s->to - s->from, KMP_MOST_SPECTRUM_KNOTS);
    return false;
}

static bool read_scale(const reading *c)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "scale");
    double *scale = &c->spectrum->scale;
    if (!node)
        return true;
    if (!read_value(c, node, "scale", scale))
        return false;
    if (*scale >= 0 && *scale <= largest_scale)
        return true;
    return kmp_reader_complain(c->r, node->place, "scale of %s is a factor from 0 to %.9g, not %.9g", c->what,
                               largest_scale, *scale);
}

static bool read_spectrum(const reading *c)
{
    bool good = read_kind(c, kmp_yaml_get(c->map, "spectrum"));
    good = read_seed(c) && good;
    good = read_stretch(c) && good;
    good = read_wavelengths(c) && good;
    good = read_scale(c) && good;
    return good && check_size(c);
}

/* The irregularities of a track. */
static void read_irregularities(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    kmp_irregularities *all = &track->irregularities;
    double range[2] = {0};
    (void)kmp_key_default(irregularity_keys, "wavelengths", 2, range);
    all->spectrum = (kmp_wave_spectrum){.kind = -1, .shortest = range[0], .longest = range[1]};
    (void)kmp_key_default(irregularity_keys, "scale", 1, &all->spectrum.scale);
    reading c = {r, map, kmp_reader_say(r, "the irregularities of %s", what), &all->spectrum};
    if (!map || !kmp_read_map(r, map, c.what, irregularity_keys))
        return;
    for (int k = 0; k < KMP_IRREGULARITIES; k++) {
        const char *key = kmp_irregularity_words[k];
        const kmp_yaml *node = kmp_yaml_get(map, key);
        if (node)
            all->named[k] = kmp_read_table_name(r, node, kmp_reader_say(r, "%s of %s", key, c.what));
    }
    if (kmp_yaml_get(map, "spectrum")) {
        if (read_spectrum(&c) && !r->wrong) {
            /* Irregularities that no file names are made from the spectrum. */
            for (int k = 0; k < KMP_IRREGULARITIES; k++) {
                if (all->named[k] || kmp_wave_spectrum_density(c.spectrum->kind, (kmp_irregularity)k, 1) == 0)
                    continue;
                all->made[k] = wave_spectrum_make(c.spectrum, (kmp_irregularity)k);
                if (!all->made[k])
                    c.r->scratch.failed = true;
            }
        }
        return;
    }
    for (size_t k = 0; k < sizeof spectrum_keys / sizeof *spectrum_keys; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, spectrum_keys[k]);
        if (node)
            kmp_reader_complain(r, node->place, "%s have no spectrum, but %s needs one", c.what, spectrum_keys[k]);
    }
}

static const kmp_key track_keys[] = {
#include "rail/keys/track_keys.def"
    {0}};

static bool read_length(kmp_reader *r, const kmp_yaml *node, const char *key, const char *of, double *value)
{
    const char *what = kmp_reader_say(r, "%s of %s", key, of);
    double read;
    if (!kmp_read_fixed(r, node, what, kmp_key_dimension(track_keys, key), &read))
        return false;
    if (read > 0)
        *value = read;
    else
        kmp_reader_complain(r, node->place, "%s must be positive, not %.9g", what, read);
    return read > 0;
}

static bool read_inclination(kmp_reader *r, const kmp_yaml *node, const char *what, double *value)
{
    double read;
    if (!kmp_read_fixed(r, node, what, kmp_key_dimension(track_keys, "inclination"), &read))
        return false;
    if (fabs(read) < 1)
        *value = read;
    else
        kmp_reader_complain(r, node->place, "%s is a slope such as 1/40, not %.9g", what, read);
    return fabs(read) < 1;
}

static bool read_rails(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    const kmp_yaml *rail = kmp_read_required(r, map, what, "rail"), *gauge = kmp_read_required(r, map, what, "gauge"),
                   *depth = kmp_yaml_get(map, "gauge_depth"), *inclination = kmp_yaml_get(map, "inclination");
    (void)kmp_key_default(track_keys, "gauge_depth", 1, &track->gauge_depth);
    track->profile = rail ? kmp_read_profile(r, rail, what) : NULL;
    bool good = track->profile && gauge;
    if (gauge && !read_length(r, gauge, "gauge", what, &track->gauge))
        good = false;
    if (depth && !read_length(r, depth, "gauge_depth", what, &track->gauge_depth))
        good = false;
    if (inclination &&
        !read_inclination(r, inclination, kmp_reader_say(r, "inclination of %s", what), &track->inclination))
        good = false;
    return good && track->profile->height;
}

static void place_rails(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    rail_place place = {track->gauge, track->gauge_depth, track->inclination, 0, 0, true, true};
    track->rail = rail_new(track->profile->height, &place);
    track->rail_at = place.at;
    const kmp_yaml *depth = kmp_yaml_get(map, "gauge_depth"), *rail = kmp_yaml_get(map, "rail");
    if (!place.reaches)
        kmp_reader_complain(r, depth ? depth->place : rail->place,
                            "%s: the gauge is measured %.9g m below the rail's top, but the inner side of profile '%s' "
                            "ends at %.9g m: use another gauge_depth, or extend the profile",
                            what, track->gauge_depth, track->profile->name, place.depth_given);
    else if (!place.resolved)
        kmp_reader_complain(r, rail->place, "%s: the points of profile '%s' coincide numerically at its position", what,
                            track->profile->name);
    else if (!track->rail)
        r->scratch.failed = true;
}

static void read_track(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    if (!kmp_read_map(r, map, what, track_keys))
        return;
    const kmp_yaml *at = kmp_read_required(r, map, what, "at");
    track->point = at ? kmp_read_point(r, at, what) : -1;
    if (track->point >= 0 && r->model->points[track->point].body != 0) {
        kmp_reader_complain(r, at->place, "%s must begin at a point of the ground, not of body '%s'", what,
                            r->model->bodies[r->model->points[track->point].body].name);
        track->point = -1;
    }
    if (read_rails(r, map, what, track))
        place_rails(r, map, what, track);
    const kmp_yaml *course = kmp_yaml_get(map, "course");
    if (course)
        kmp_read_course(r, course, what, track);
    read_irregularities(r, kmp_yaml_get(map, "irregularities"), what, track);
}

void kmp_read_tracks(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "tracks", "track");
    model->tracks = KMP_ARENA_NEW(&model->arena, kmp_track, s.count);
    while (model->tracks && kmp_section_next(&s)) {
        kmp_track *track = &model->tracks[model->track_count++];
        track->name = s.name;
        read_track(r, s.node, s.what, track);
    }
}
