/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces 0 .. N - 1 are the bodies BODY, BODY_1, .., of the length l = L/(N - 1), and half of it at both ends: each of
 * the joints between them is in the middle of an equal part of the beam, and no bending is left out at clamped ends. A
 * joint turns about z, then y, then x, where the beam has shapes of these, by the coordinates BODY_z1, BODY_y1,
 * BODY_phi1, .., each with a spring of the stiffness E I/l or G J/l and the damping that many seconds times this. The
 * nodes of the model have places for these numbers; the numbers themselves are set when they have been read, because
 * they may follow parameters. */
#include "model/read/segments.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/flexible/beam.h"
#include "model/language/number_algebra.h"
#include "model/read/read_flexible.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

enum { MOST_SEGMENTS = 500 };

/* The coordinates of a joint between two pieces, in their order. */
static const struct {
    kmp_beam_family family;
    const char *motion, *letter;
} turns[] = {{KMP_BEAM_Y, "R3", "z"}, {KMP_BEAM_Z, "R2", "y"}, {KMP_BEAM_TORSION, "R1", "phi"}};
enum { TURNS = sizeof turns / sizeof *turns };

typedef struct kmp_segmented {
    const char *name, *bare; /* with the prefix of its file, and without */
    kmp_place place;
    kmp_beam beam;
    kmp_number time; /* of damping, s */
    int pieces;
    const kmp_yaml *points;
    const kmp_yaml *axes; /* of a beam that is not along x of the body; NULL: it is */
} segmented;

/* The point where the next piece is; the point of the next piece there, where both have the axes of the beam. */
static const char next_piece[] = "next_piece", piece_before[] = "piece_before";

static const char *name_of(const kmp_reader *r, const char *name, int piece)
{
    return piece == 0 ? name : kmp_reader_say((kmp_reader *)(void *)r, "%s_%d", name, piece);
}

/* -- which piece ------------------------------------------------------------------------------------- */

static kmp_number number(double value)
{
    return (kmp_number){.value = value};
}

/* The place x/L where a piece begins; for N where the last one ends. */
static double begin_of(const segmented *s, int piece)
{
    return piece == 0 ? 0 : piece == s->pieces ? 1 : (piece - 0.5) / (s->pieces - 1);
}

static kmp_number piece_length(kmp_reader *r, const segmented *s, int piece)
{
    return kmp_number_scale(&r->model->arena, begin_of(s, piece + 1) - begin_of(s, piece), s->beam.length);
}

/* The piece that a station is on: at a joint the one before it. */
static int piece_of(const segmented *s, double x)
{
    const double rounding = 1e-9, at = x / s->beam.length.value * (s->pieces - 1) + 0.5;
    return !(at > 1 + rounding) ? 0 : at > s->pieces - 1 ? s->pieces - 1 : (int)ceil(at - rounding) - 1;
}

/* A point's station, x. False: it has none, or it is wrong, which is reported with the bodies. */
static bool station_of(kmp_reader *r, const kmp_yaml *point, double *x)
{
    const kmp_yaml *node = kmp_yaml_get(point, "station");
    kmp_number station;
    if (!node || !kmp_read_number(r, node, "a station", KMP_DIM_LENGTH, &station))
        return false;
    *x = station.value;
    return true;
}

/* -- names in other parts of the model --------------------------------------------------------------- */

typedef struct renaming {
    kmp_reader *r;
    const segmented *s;
    const char *from, *to; /* BODY.POINT */
} renaming;

static bool is_of_name(char c)
{
    return isalnum((unsigned char)c) || c == '_' || c == '.';
}

/* The next whole name in a text; NULL: there is none. */
static const char *find_name(const renaming *n, const char *text, const char *begin)
{
    const size_t length = strlen(n->from);
    const char *found = strstr(text, n->from);
    while (found && ((found > begin && is_of_name(found[-1])) || is_of_name(found[length])))
        found = strstr(found + 1, n->from);
    return found;
}

/* The text with all of them replaced; NULL: there is none. */
static const char *renamed(const renaming *n, const char *text)
{
    const char *made = NULL, *rest = text, *found;
    while (text && (found = find_name(n, rest, text))) {
        made = kmp_reader_say(n->r, "%s%.*s%s", made ? made : "", (int)(found - rest), rest, n->to);
        rest = found + strlen(n->from);
    }
    return made ? kmp_reader_say(n->r, "%s%s", made, rest) : NULL;
}

/* A node with other names, or the node itself. */
static const kmp_yaml *rename_in(const renaming *n, const kmp_yaml *node)
{
    kmp_arena *arena = &n->r->scratch;
    if (!node || (node->kind == KMP_YAML_SCALAR && node->place.file != n->s->place.file))
        return node;
    if (node->kind == KMP_YAML_SCALAR) {
        const char *text = renamed(n, node->text);
        return text ? kmp_yaml_word(arena, node->place, text) : node;
    }
    kmp_yaml *copy = NULL;
    for (int k = 0; k < node->count; k++) {
        const kmp_yaml *item = rename_in(n, node->items[k]);
        if (item == node->items[k])
            continue;
        copy = copy ? copy : kmp_yaml_copy(arena, node);
        if (copy)
            copy->items[k] = item;
    }
    return copy ? copy : node;
}

static void rename_points(kmp_reader *r, const segmented *s)
{
    for (int k = 0; s->points && k < s->points->count; k++) {
        double x;
        if (!station_of(r, s->points->items[k], &x) || piece_of(s, x) == 0)
            continue;
        const char *point = s->points->keys[k]->text;
        const renaming n = {r, s, kmp_reader_say(r, "%s.%s", s->bare, point),
                            kmp_reader_say(r, "%s.%s", name_of(r, s->bare, piece_of(s, x)), point)};
        r->root = rename_in(&n, r->root);
        for (int i = 0; i < r->instance_count; i++)
            r->instances[i].at = rename_in(&n, r->instances[i].at);
    }
}

/* -- pieces ------------------------------------------------------------------------------------------ */

static const kmp_yaml *word(kmp_reader *r, kmp_place place, const char *text)
{
    return kmp_yaml_word(&r->scratch, place, text);
}

/* A point at the origin, with axes unless they are the axes of the body. */
static const kmp_yaml *point_at_origin(kmp_reader *r, kmp_place place, const kmp_yaml *axes)
{
    kmp_yaml *origin = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, place);
    for (int k = 0; k < 3; k++)
        kmp_yaml_append(&r->scratch, origin, NULL, word(r, place, "0"));
    if (!axes)
        return origin;
    kmp_yaml *made = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, place);
    kmp_yaml_put(&r->scratch, made, place, "at", origin);
    kmp_yaml_put(&r->scratch, made, axes->place, "axes", axes);
    return made;
}

/* The points of a piece, with the points where its neighbours are; places are set later, axes are as given. */
static const kmp_yaml *points_of(kmp_reader *r, const segmented *s, int piece)
{
    kmp_yaml *map = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, s->place);
    for (int k = 0; s->points && k < s->points->count; k++) {
        const kmp_yaml *point = s->points->items[k];
        double x = 0;
        if ((station_of(r, point, &x) ? piece_of(s, x) : 0) == piece)
            kmp_yaml_append(&r->scratch, map, s->points->keys[k],
                            point_at_origin(r, point->place, kmp_yaml_get(point, "axes")));
    }
    kmp_yaml_put(&r->scratch, map, s->place, next_piece, point_at_origin(r, s->place, s->axes));
    if (s->axes && piece > 0)
        kmp_yaml_put(&r->scratch, map, s->place, piece_before, point_at_origin(r, s->place, s->axes));
    return map;
}

static const char *coordinate(kmp_reader *r, const segmented *s, bool bare, int turn, int piece)
{
    return kmp_reader_say(r, "%s_%s%d", bare ? s->bare : s->name, turns[turn].letter, piece);
}

static const kmp_yaml *joint_of(kmp_reader *r, const segmented *s, int piece)
{
    kmp_yaml *joint = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, s->place);
    kmp_yaml *motions = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, s->place);
    kmp_yaml *names = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, s->place);
    for (int t = 0; t < TURNS; t++)
        if (s->beam.count[turns[t].family] > 0) {
            kmp_yaml_append(&r->scratch, motions, NULL, word(r, s->place, turns[t].motion));
            kmp_yaml_append(&r->scratch, names, NULL, word(r, s->place, coordinate(r, s, true, t, piece)));
        }
    kmp_yaml_put(&r->scratch, joint, s->place, "motions", motions);
    kmp_yaml_put(&r->scratch, joint, s->place, "coordinates", names);
    kmp_yaml_put_word(&r->scratch, joint, s->place, "at",
                      kmp_reader_say(r, "%s.%s", name_of(r, s->bare, piece - 1), next_piece));
    kmp_yaml_put_word(&r->scratch, joint, s->place, "to", s->axes ? piece_before : NULL);
    return joint;
}

/* The first piece keeps the body's joint. */
static void put_pieces(kmp_reader *r, const segmented *s, const kmp_yaml *key, const kmp_yaml *body, kmp_yaml *bodies)
{
    for (int piece = 0; piece < s->pieces; piece++) {
        kmp_yaml *made = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, body->place);
        const kmp_yaml *joint = piece == 0 ? kmp_yaml_get(body, "joint") : joint_of(r, s, piece);
        kmp_yaml_put(&r->scratch, made, s->place, "joint", joint);
        kmp_yaml_put(&r->scratch, made, s->place, "points", points_of(r, s, piece));
        if (piece == 0)
            kmp_yaml_append(&r->scratch, bodies, key, made);
        else
            kmp_yaml_put(&r->scratch, bodies, s->place, name_of(r, s->name, piece), made);
    }
}

static void put_springs(kmp_reader *r, const segmented *s, kmp_yaml *forces)
{
    for (int piece = 1; piece < s->pieces; piece++)
        for (int t = 0; t < TURNS; t++) {
            if (s->beam.count[turns[t].family] == 0)
                continue;
            kmp_yaml *spring = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, s->place);
            kmp_yaml *force = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, s->place);
            kmp_yaml_put_word(&r->scratch, spring, s->place, "stiffness", "1");
            kmp_yaml_put_word(&r->scratch, force, s->place, "joint", coordinate(r, s, true, t, piece));
            kmp_yaml_put(&r->scratch, force, s->place, "spring", spring);
            kmp_yaml_put(&r->scratch, forces, s->place, coordinate(r, s, false, t, piece), force);
        }
}

/* -- the beam ---------------------------------------------------------------------------------------- */

/* Keys that say how a sum of shapes is made have no meaning for pieces. */
static bool check_keys(kmp_reader *r, const kmp_yaml *body, const kmp_yaml *flexible, const segmented *s)
{
    static const char *const own[] = {"frame", "stiffening", "raw", "shear"};
    static const char *const others[] = {"shape", "mass", "com", "inertia"};
    bool good = true;
    for (size_t k = 0; k < sizeof own / sizeof *own; k++)
        if (kmp_yaml_get(flexible, own[k]))
            good = kmp_reader_complain(r, kmp_yaml_get(flexible, own[k])->place,
                                       "body '%s' is in segments, which have no '%s': remove one of the two", s->name,
                                       own[k]);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (kmp_yaml_get(body, others[k]))
            good = kmp_reader_complain(r, kmp_yaml_get(body, others[k])->place,
                                       "body '%s' is in segments: remove its '%s'", s->name, others[k]);
    if (s->beam.count[KMP_BEAM_AXIAL] > 0)
        good =
            kmp_reader_complain(r, kmp_yaml_get(flexible, "shapes")->place,
                                "body '%s' is in segments, whose length is constant: remove its axial shapes", s->name);
    return good;
}

static bool read_pieces(kmp_reader *r, const kmp_yaml *node, segmented *s)
{
    const char *what = kmp_reader_say(r, "segments of body '%s'", s->name);
    double count;
    if (!kmp_read_whole(r, node, what, "are", 2, MOST_SEGMENTS, &count))
        return false;
    s->pieces = (int)count;
    return true;
}

/* damping: {time: T} */
static bool read_time(kmp_reader *r, const kmp_yaml *damping, segmented *s)
{
    const kmp_yaml *node = kmp_yaml_get(damping, "time");
    const char *what = kmp_reader_say(r, "time of the damping of body '%s'", s->name);
    s->time = number(0);
    if (!damping)
        return true;
    if (!node || damping->count != 1)
        return kmp_reader_complain(
            r, damping->place,
            "the damping of body '%s', which is in segments, is {time: T}, in seconds: its joints "
            "have the damping T times their stiffness",
            s->name);
    return kmp_read_ruled(r, node, what, KMP_DIM_TIME, KMP_FIELD_NOT_NEGATIVE, &s->time);
}

/* The axes of the beam as points have them. */
static const kmp_yaml *axes_of(kmp_reader *r, const kmp_yaml *beam, const segmented *s)
{
    const kmp_yaml *along = kmp_yaml_get(beam, "along");
    if (!s->beam.turned || !along)
        return s->beam.turned ? kmp_yaml_get(beam, "axes") : NULL;
    kmp_yaml *made = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, along->place);
    kmp_yaml_put(&r->scratch, made, along->place, "x", along);
    return made;
}

static bool read_segmented(kmp_reader *r, const kmp_yaml *key, const kmp_yaml *body, segmented *s)
{
    const kmp_yaml *flexible = kmp_yaml_get(body, "flexible"), *points = kmp_yaml_get(body, "points");
    const kmp_include_instance *instance = kmp_reader_instance(r, key->place.file);
    *s = (segmented){.name = key->text, .place = key->place, .points = points};
    s->bare = s->name + (instance ? strlen(instance->prefix) : 0);
    if (points && points->kind != KMP_YAML_MAP)
        s->points = NULL;
    const bool good = read_pieces(r, kmp_yaml_get(flexible, "segments"), s) &&
                      read_time(r, kmp_yaml_get(flexible, "damping"), s) &&
                      kmp_read_beam(r, flexible, kmp_reader_say(r, "body '%s'", s->name), &s->beam) &&
                      check_keys(r, body, flexible, s);
    s->axes = axes_of(r, kmp_yaml_get(flexible, "beam"), s);
    return good;
}

void kmp_read_segments(kmp_reader *r)
{
    const kmp_yaml *map = kmp_yaml_get(r->root, "bodies"), *given = kmp_yaml_get(r->root, "forces");
    int count = 0;
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++)
        count += kmp_yaml_get(kmp_yaml_get(map->items[k], "flexible"), "segments") != NULL;
    if (count == 0)
        return;
    r->segmented = KMP_ARENA_NEW(&r->scratch, segmented, count);
    kmp_yaml *root = kmp_yaml_copy(&r->scratch, r->root);
    kmp_yaml *bodies = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, map->place);
    kmp_yaml *forces = given ? kmp_yaml_copy(&r->scratch, given) : kmp_yaml_new(&r->scratch, KMP_YAML_MAP, map->place);
    if (!r->segmented || !root || !bodies || !forces)
        return;
    for (int k = 0; k < map->count; k++) {
        segmented *s = &r->segmented[r->segmented_count];
        const bool is = kmp_yaml_get(kmp_yaml_get(map->items[k], "flexible"), "segments");
        if (is && read_segmented(r, map->keys[k], map->items[k], s)) {
            put_pieces(r, s, map->keys[k], map->items[k], bodies);
            put_springs(r, s, forces);
            r->segmented_count++;
        } else if (!is) {
            kmp_yaml_append(&r->scratch, bodies, map->keys[k], map->items[k]);
        } else { /* a rigid body, so that references to it cause no further errors */
            s->pieces = 1;
            put_pieces(r, s, map->keys[k], map->items[k], bodies);
        }
    }
    kmp_yaml_set(&r->scratch, root, "bodies", bodies);
    kmp_yaml_set(&r->scratch, root, "forces", forces);
    r->root = root;
    for (int k = 0; k < r->segmented_count; k++)
        rename_points(r, &r->segmented[k]);
}

/* -- numbers ----------------------------------------------------------------------------------------- */

/* Moves a place by x along the beam; its numbers have no separate names. */
static void move_along(kmp_reader *r, const segmented *s, kmp_number x, kmp_number at[3])
{
    for (int k = 0; k < 3; k++) {
        at[k].symbol = 0;
        at[k] = kmp_number_add(&r->model->arena, at[k], kmp_beam_part(&r->model->arena, &s->beam, k, x));
    }
}

/* A station less the beginning of its piece, plus the offset. */
static void place_point(kmp_reader *r, const segmented *s, int piece, const kmp_yaml *node, kmp_point *point)
{
    kmp_arena *arena = &r->model->arena;
    const kmp_yaml *station = kmp_yaml_get(node, "station"), *offset = kmp_yaml_get(node, "offset");
    const char *what = kmp_reader_say(r, "point '%s.%s'", s->name, point->name);
    kmp_number x;
    if (!station) {
        kmp_complain_of(
            r, node, what,
            "body '%s' is in segments: give the station instead of x, such as {station: 0, offset: [0, 0, 0]}",
            s->name);
        return;
    }
    if (offset && !kmp_read_vector(r, offset, what, KMP_DIM_LENGTH, point->at))
        return;
    if (!kmp_read_number(r, station, what, KMP_DIM_LENGTH, &x))
        return;
    const double rounding = 1e-12;
    if (x.value < 0 || x.value > s->beam.length.value * (1 + rounding)) {
        kmp_reader_complain(r, station->place, "the station of %s is %.6g m: the beam is %.6g m long", what, x.value,
                            s->beam.length.value);
        return;
    }
    x = kmp_number_subtract(arena, x, kmp_number_scale(arena, begin_of(s, piece), s->beam.length));
    x.symbol = 0;
    move_along(r, s, x, point->at);
}

static void place_points(kmp_reader *r, const segmented *s, int piece, int body)
{
    for (int k = 0; k < r->model->point_count; k++) {
        kmp_point *point = &r->model->points[k];
        if (point->body != body)
            continue;
        const kmp_yaml *node = kmp_yaml_get(s->points, point->name);
        if (node)
            place_point(r, s, piece, node, point);
        else if (strcmp(point->name, next_piece) == 0)
            move_along(r, s, piece_length(r, s, piece), point->at);
    }
}

/* A number of the sections over a piece. */
static kmp_taper part_of(kmp_reader *r, const segmented *s, int piece, const kmp_taper *whole)
{
    return kmp_taper_part(&r->model->arena, whole, begin_of(s, piece), begin_of(s, piece + 1));
}

/* The tensor that is diagonal in the axes of the beam, in the axes of the body. */
static void put_inertia(kmp_arena *arena, const kmp_beam *beam, const kmp_number about[3], kmp_number inertia[6])
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int e = 0; e < 6; e++) {
        inertia[e] = e < 3 && !beam->turned ? about[e] : number(0);
        for (int k = 0; k < 3 && beam->turned; k++)
            inertia[e] = kmp_number_add(
                arena, inertia[e], kmp_number_scale(arena, beam->axes[row[e]][k] * beam->axes[column[e]][k], about[k]));
    }
}

/* A rigid rod with the sections of the beam. */
static void set_mass(kmp_reader *r, const segmented *s, int piece, kmp_body *body)
{
    kmp_arena *arena = &r->model->arena;
    const kmp_number length = piece_length(r, s, piece), square = kmp_number_times(arena, length, length);
    const kmp_taper line = part_of(r, s, piece, &s->beam.line_mass);
    const kmp_number line_mass = kmp_taper_coefficient(arena, &line, 0);
    const kmp_number mass = kmp_number_times(arena, line_mass, length);
    kmp_number along = kmp_number_scale(arena, 1 / 12.0, kmp_number_times(arena, mass, square)), section[2];
    kmp_number centre = kmp_number_scale(arena, 0.5, length);
    if (kmp_taper_varies(
            &line)) { /* the centre is off the middle by 1/6 of the length for each part of the second term */
        const kmp_number slope = kmp_number_over(arena, kmp_taper_coefficient(arena, &line, 1), line_mass),
                         bow = kmp_taper_coefficient(arena, &line, 2);
        const kmp_number off = kmp_number_scale(arena, 1 / 6.0, kmp_number_times(arena, slope, length));
        const kmp_number more = kmp_number_scale(arena, 1 / 30.0, kmp_number_times(arena, bow, length));
        along = kmp_number_add(arena, along, kmp_number_times(arena, more, square));
        along = kmp_number_subtract(arena, along, kmp_number_times(arena, mass, kmp_number_times(arena, off, off)));
        centre = kmp_number_add(arena, centre, off);
    }
    for (int k = 0; k < 2; k++) {
        const kmp_taper second = part_of(r, s, piece, &s->beam.section_mass[k]);
        section[k] = kmp_number_times(arena, kmp_taper_coefficient(arena, &second, 0), length);
    }
    body->mass = mass;
    move_along(r, s, centre, body->com);
    const kmp_number about[3] = {kmp_number_add(arena, section[0], section[1]),
                                 kmp_number_add(arena, along, section[1]), kmp_number_add(arena, along, section[0])};
    put_inertia(arena, &s->beam, about, body->inertia);
}

const char *kmp_segments_name(const kmp_reader *r, int body)
{
    for (int k = 0; k < r->segmented_count; k++)
        for (int piece = 0; piece < r->segmented[k].pieces; piece++)
            if (strcmp(r->model->bodies[body].name, name_of(r, r->segmented[k].name, piece)) == 0)
                return r->segmented[k].name;
    return NULL;
}

/* The body of a piece; not positive where it is not there. */
static int body_of(const kmp_reader *r, const segmented *s, int piece)
{
    return kmp_name_find(KMP_BODY_NAMES(r->model), name_of(r, s->name, piece));
}

void kmp_segments_place_points(kmp_reader *r)
{
    for (int k = 0; k < r->segmented_count; k++)
        for (int piece = 0; piece < r->segmented[k].pieces; piece++)
            place_points(r, &r->segmented[k], piece, body_of(r, &r->segmented[k], piece));
}

void kmp_segments_set_masses(kmp_reader *r)
{
    for (int k = 0; k < r->segmented_count; k++)
        for (int piece = 0; piece < r->segmented[k].pieces; piece++) {
            const int body = body_of(r, &r->segmented[k], piece);
            if (body > 0)
                set_mass(r, &r->segmented[k], piece, &r->model->bodies[body]);
        }
}

void kmp_segments_stiffen(kmp_reader *r)
{
    kmp_arena *arena = &r->model->arena;
    for (int k = 0; k < r->segmented_count; k++)
        for (int piece = 1; piece < r->segmented[k].pieces; piece++)
            for (int t = 0; t < TURNS; t++) {
                const segmented *s = &r->segmented[k];
                const int found = s->beam.count[turns[t].family] > 0
                                      ? kmp_name_find(KMP_NAMED(r->model, force), coordinate(r, s, false, t, piece))
                                      : -1;
                if (found < 0)
                    continue;
                kmp_force *force = &r->model->forces[found];
                const kmp_number stiffness =
                    kmp_taper_at(arena, &s->beam.stiffness[turns[t].family], number(begin_of(s, piece)));
                const kmp_number part = kmp_number_scale(arena, 1.0 / (s->pieces - 1), s->beam.length);
                force->stiffness = kmp_number_over(arena, stiffness, part);
                force->damping = kmp_number_times(arena, s->time, force->stiffness);
            }
}

void kmp_segments_hold(kmp_reader *r)
{
    const kempe_model *model = r->model;
    for (int k = 0; k < r->segmented_count; k++)
        for (int piece = 1; piece < r->segmented[k].pieces; piece++)
            for (int t = 0; t < TURNS; t++) {
                const int motion =
                    kmp_name_find(KMP_COORDINATES(model), coordinate(r, &r->segmented[k], false, t, piece));
                if (motion >= 0)
                    model->start.hold[motion] = model->start.qd_given[motion] = true;
            }
}
