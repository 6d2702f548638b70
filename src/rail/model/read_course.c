/* SPDX-License-Identifier: BSD-3-Clause */
/* The course of a track, piece by piece. */
#include "rail/model/read_course.h"
#include "model/data/model.h"
#include "model/language/limits.h"
#include "model/read/read_values.h"
#include "rail/model/course.h"
#include "rail/model/rail.h"

static const kmp_key piece_keys[] = {
#include "model/keys/piece_keys.def"
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
    if (!(piece->length * 1000 >= KMP_COURSE_SHORTEST))
        return kmp_reader_complain(c->r, node->place, "%s of %s must be at least %d mm long, not %.9g m", kind, c->what,
                                   KMP_COURSE_SHORTEST, piece->length);
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

static bool check_length(kmp_reader *r, const kmp_yaml *list, const char *what, const kmp_track *t)
{
    double length = 0;
    for (int k = 0; k < t->course_count; k++)
        length += t->course[k].length;
    if (length <= 1000.0 * KMP_COURSE_LONGEST)
        return true;
    return kmp_reader_complain(r, list->place, "%s is %.9g m long: at most %d km are allowed", what, length,
                               KMP_COURSE_LONGEST);
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
    if (list->count == 0 || !check_joints(r, list, whole, track) || !check_length(r, list, whole, track))
        return;
    kmp_course_result result = kmp_course_lay(track);
    if (result == KMP_COURSE_LARGE)
        kmp_reader_complain(r, list->place, "%s has too much curvature: its line would have more than %d points", whole,
                            KMP_MOST_COURSE_KNOTS);
    else if (result == KMP_COURSE_MEMORY)
        r->scratch.failed = true;
    track->curved = result == KMP_COURSE_LAID;
}
