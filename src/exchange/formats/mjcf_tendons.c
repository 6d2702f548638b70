/* SPDX-License-Identifier: BSD-3-Clause */
/* A spatial tendon is a rope without a force for each part between pulleys; its length is the sum of the
 * parts, each over its divisor. A rope turns one way round a cylinder. MuJoCo takes the way on the side of `sidesite`,
 * or the shorter one, which is decided here at the references of the joints. */
#include "exchange/formats/mjcf_tendons.h"
#include "exchange/formats/importing.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/three.h"
#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

const kmp_mjcf_site *kmp_mjcf_site_of(kmp_mjcf *m, const kmp_element *from, const char *name)
{
    const kmp_mjcf_site *s = m->sites;
    while (s && strcmp(s->name, name) != 0)
        s = s->next;
    if (!s)
        kmp_import_complain(m->im, from->place, "the site", name, "does not exist");
    return s;
}

static kmp_mjcf_geom *geom_of(kmp_mjcf *m, const kmp_element *from, const char *name)
{
    kmp_mjcf_geom *g = m->geoms;
    while (g && strcmp(g->name, name) != 0)
        g = g->next;
    if (!g)
        kmp_import_complain(m->im, from->place, "the geom", name, "does not exist");
    else if (!g->ball && !g->cylinder)
        kmp_import_complain(m->im, from->place, "the geom", name,
                            "is neither a sphere nor a cylinder, around which a tendon lies");
    return g && (g->ball || g->cylinder) ? g : NULL;
}

bool kmp_mjcf_is_wrapped(const kmp_element *tendon)
{
    return kmp_element_find(tendon, "geom") || kmp_element_find(tendon, "pulley");
}

/* -- ways round a geom --------------------------------------------------------------------------------- */

/* A way round the circle in the plane of a geom: over the tangent points, to the left or to the right. */
typedef struct way {
    double wrap, middle[2], apart; /* within half a turn; the sum of the tangent points, their distance */
    bool crossed, beyond;          /* negative wrap: the tangents cross, or it is more than half a turn */
} way;

static way way_of(const double end[2][2], double radius, int turn)
{
    way w = {.wrap = 0};
    double at[2], tangent[2][2], from[2], free[2];
    for (int k = 0; k < 2; k++) {
        at[k] = hypot(end[k][0], end[k][1]);
        free[k] = sqrt(at[k] * at[k] - radius * radius);
        from[k] = atan2(end[k][1], end[k][0]) + (k == 0 ? turn : -turn) * acos(radius / at[k]);
        tangent[k][0] = radius * cos(from[k]);
        tangent[k][1] = radius * sin(from[k]);
    }
    w.wrap = remainder(turn * (from[1] - from[0]), 2 * PI);
    for (int i = 0; i < 2; i++)
        w.middle[i] = tangent[0][i] + tangent[1][i];
    w.apart = hypot(tangent[0][0] - tangent[1][0], tangent[0][1] - tangent[1][1]);
    w.crossed = w.wrap < 0 && radius * tan(-w.wrap / 2) <= fmin(free[0], free[1]);
    w.beyond = w.wrap < 0 && !w.crossed;
    return w;
}

/* True where a straight line between the ends is MuJoCo's way: it meets no circle, and is on the side that is wanted.
 */
static bool is_straight(const double end[2][2], double radius, const double *side)
{
    const double d[2] = {end[1][0] - end[0][0], end[1][1] - end[0][1]}, square = d[0] * d[0] + d[1] * d[1];
    double a = square > 0 ? -(d[0] * end[0][0] + d[1] * end[0][1]) / square : 0;
    a = fmin(fmax(a, 0), 1);
    const double near[2] = {end[0][0] + a * d[0], end[0][1] + a * d[1]};
    return hypot(near[0], near[1]) > radius && (!side || side[0] * near[0] + side[1] * near[1] >= 0);
}

/* -1 to the right, 1 to the left: by the side; without it the shorter way, or the side of a straight line. */
static int turn_of(const way ways[2], bool straight, const double *side)
{
    enum { NEVER = -1000 };
    double good[2];
    for (int k = 0; k < 2; k++) {
        const double *middle = ways[k].middle;
        good[k] = straight && !side              ? (ways[k].wrap > 0 ? NEVER : ways[k].wrap)
                  : !straight && ways[k].crossed ? NEVER
                  : !side                        ? -ways[k].apart
                          : (side[0] * middle[0] + side[1] * middle[1]) / hypot(middle[0], middle[1]);
    }
    return good[0] > good[1] ? -1 : 1;
}

/* Components of a place in the plane of the geom and along its axis, from its centre. */
static void into_plane(const double axes[3][3], const double centre[3], const double place[3], double out[3])
{
    for (int k = 0; k < 3; k++) {
        out[k] = 0;
        for (int i = 0; i < 3; i++)
            out[k] += axes[k][i] * (place[i] - centre[i]);
    }
}

/* The axes of a cylinder's plane and its own; of a sphere the plane of both ends, in which the way to the left is the
 * shorter one. False: ends and centre are in one line. */
static bool plane_of(const kmp_mjcf_geom *g, const double *const end[2], double axes[3][3])
{
    double from[2][3], length[2];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            axes[k][i] = g->world.r[i][k];
    if (!g->ball)
        return true;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++)
            from[k][i] = end[k][i] - g->world.p[i];
    kmp_cross3(from[0], from[1], axes[2]);
    length[0] = sqrt(kmp_dot(3, from[0], from[0]));
    length[1] = sqrt(kmp_dot(3, axes[2], axes[2]));
    for (int i = 0; i < 3; i++) {
        axes[0][i] = from[0][i] / length[0];
        axes[2][i] /= length[1];
    }
    kmp_cross3(axes[2], axes[0], axes[1]);
    return length[1] > 1e-9 * length[0] * sqrt(kmp_dot(3, from[1], from[1]));
}

/* The length between two places round a geom, and the turn about its axis; 0 after a complaint. */
static int go_round(kmp_mjcf *m, const kmp_element *e, const kmp_mjcf_geom *g, const double *const end[2],
                    const double *side, double *length)
{
    double axes[3][3], local[2][3], flat[2][2], to[3] = {0}, free = 0;
    const char *wrong = NULL;
    if (!plane_of(g, end, axes))
        wrong = "has its centre on the line through both neighbours: at the references the side is not defined";
    for (int k = 0; k < 2 && !wrong; k++) {
        into_plane((const double(*)[3])axes, g->world.p, end[k], local[k]);
        memcpy(flat[k], local[k], sizeof flat[k]);
        const double square = flat[k][0] * flat[k][0] + flat[k][1] * flat[k][1] - g->radius * g->radius;
        free += sqrt(fmax(square, 0));
        if (!(square > 0))
            wrong = "has a neighbour of the tendon inside";
    }
    if (side)
        into_plane((const double(*)[3])axes, g->world.p, side, to);
    if (side && kmp_dot(3, to, to) < g->radius * g->radius)
        wrong = "has its sidesite inside: tendons inside geoms are not read";
    if (!wrong) {
        const way ways[2] = {way_of((const double(*)[2])flat, g->radius, -1),
                             way_of((const double(*)[2])flat, g->radius, 1)};
        bool straight = is_straight((const double(*)[2])flat, g->radius, side ? to : NULL);
        const int turn = turn_of(ways, straight, side ? to : NULL);
        const way *own = &ways[turn > 0];
        straight = straight || own->crossed;
        double apart[3];
        for (int i = 0; i < 3; i++)
            apart[i] = end[1][i] - end[0][i];
        *length = straight ? sqrt(kmp_dot(3, apart, apart))
                           : hypot(free + g->radius * own->wrap, g->ball ? 0 : local[1][2] - local[0][2]);
        if (g->ball && turn < 0)
            wrong = "has its sidesite on the far side: ropes have the shortest way over a sphere";
        else if (straight ? own->wrap > 1e-9 : own->beyond)
            wrong = "has more than half a turn of the tendon, or none where a rope would lie on it, at the references";
        else
            return turn;
    }
    kmp_import_leave_out(m->im, e->place, KMP_PART_MECHANICS, "geom", "the geom '%s' %s", g->name, wrong);
    return 0;
}

/* -- paths --------------------------------------------------------------------------------------------- */

/* A tendon that is being read, and its part since the last pulley. */
typedef struct tendon_path {
    const kmp_element *tendon;
    const char *name; /* in Kempe */
    kmp_text sum;     /* of lengths of the parts before */
    double reference; /* their sum */
    int number;
    kmp_yaml *list;
    const kmp_mjcf_site *last;
    const kmp_element *round; /* a geom behind it */
    double divisor, length;
} tendon_path;

/* The geom between the last site and this one as a place of the rope. */
static bool add_geom(kmp_mjcf *m, tendon_path *b, const kmp_mjcf_site *next)
{
    kmp_import *im = m->im;
    const kmp_element *e = b->round;
    const char *name = kmp_import_attribute(im, e, "geom"), *by = kmp_element_text(e, "sidesite");
    kmp_mjcf_geom *g = name ? geom_of(m, e, name) : NULL;
    const kmp_mjcf_site *side = by ? kmp_mjcf_site_of(m, e, by) : NULL;
    const double *const end[2] = {b->last->world, next->world};
    double length = 0;
    const int turn = g && (side || !by) ? go_round(m, e, g, end, side ? side->world : NULL, &length) : 0;
    if (turn == 0)
        return false;
    if (!g->point)
        g->point = kmp_import_point(im, e->place, g->body, kmp_import_clean(im, g->name), &g->frame);
    kmp_yaml *map = kmp_import_map(im, e->place);
    kmp_import_word(im, map, e->place, g->ball ? "sphere" : "round", g->point);
    kmp_import_value(im, map, e->place, "radius", g->radius);
    if (!g->ball) {
        kmp_import_word(im, map, e->place, "turn", turn > 0 ? "left" : "right");
        kmp_import_word(im, map, e->place, "may_leave", "yes");
        kmp_import_word(im, map, e->place, "helix", "yes");
    }
    kmp_yaml_append(im->arena, b->list, NULL, map);
    b->length += length;
    return true;
}

static bool add_site(kmp_mjcf *m, tendon_path *b, const kmp_element *e)
{
    const char *name = kmp_import_attribute(m->im, e, "site");
    const kmp_mjcf_site *s = name ? kmp_mjcf_site_of(m, e, name) : NULL;
    if (!s || (b->round && !add_geom(m, b, s)))
        return false;
    double apart[3];
    for (int i = 0; i < 3; i++)
        apart[i] = b->last ? s->world[i] - b->last->world[i] : 0;
    b->length += b->round ? 0 : sqrt(kmp_dot(3, apart, apart));
    kmp_yaml_append(m->im->arena, b->list, NULL, kmp_yaml_word(m->im->arena, e->place, s->point));
    b->last = s;
    b->round = NULL;
    return true;
}

static bool add_place(kmp_mjcf *m, tendon_path *b, const kmp_element *e)
{
    if (strcmp(e->name, "site") == 0)
        return add_site(m, b, e);
    if (strcmp(e->name, "geom") != 0)
        return true;
    if (!b->last || b->round) {
        kmp_import_complain(m->im, e->place, "the geom", kmp_element_text(e, "geom"), "has no site before it");
        return false;
    }
    b->round = e;
    return true;
}

/* Begins the part behind a pulley, or the first one. */
static bool begin_part(kmp_mjcf *m, tendon_path *b, const kmp_element *pulley)
{
    b->list = kmp_yaml_new(m->im->arena, KMP_YAML_LIST, b->tendon->place);
    b->last = NULL;
    b->round = NULL;
    b->length = 0;
    b->divisor = pulley ? kmp_import_read_number(m->im, pulley, "divisor", 1) : 1;
    if (pulley && !(b->divisor > 0))
        kmp_import_complain(m->im, pulley->place, "the divisor of tendon", b->name, "is not positive");
    return b->list && b->divisor > 0;
}

/* Ends a part as a rope, unless the document has it, and adds its length to the sum. Before a pulley it may be empty.
 */
static bool end_part(kmp_mjcf *m, tendon_path *b, bool last)
{
    kmp_import *im = m->im;
    const kmp_place place = b->tendon->place;
    const bool alone = last && b->number == 0;
    if (b->list->count == 0 && !last)
        return true;
    b->number++;
    const char *name = alone ? kmp_arena_printf(im->arena, "%s_path", b->name)
                             : kmp_arena_printf(im->arena, "%s_path_%d", b->name, b->number);
    if (!name)
        return false;
    if (b->round || b->list->count < 2) {
        kmp_import_complain(im, place, "the part", name, "of a tendon does not go from a site to a site");
        return false;
    }
    kmp_text_put(&b->sum, b->number > 1 ? " + " : "");
    if (b->divisor != 1)
        kmp_text_printf(&b->sum, "%.17g*", 1 / b->divisor);
    kmp_text_printf(&b->sum, "length(%s)", name);
    b->reference += b->length / b->divisor;
    if (kmp_yaml_get(kmp_import_part(im, im->root, "ropes", KMP_YAML_MAP), name))
        return true;
    kmp_yaml *map = kmp_import_map(im, place);
    kmp_import_put(im, map, place, "along", b->list);
    kmp_import_word(im, map, place, "force", "0");
    kmp_import_add(im, "ropes", b->tendon, name, map);
    return true;
}

const char *kmp_mjcf_add_path(kmp_mjcf *m, const kmp_element *tendon, const char *name, double *reference)
{
    tendon_path b = {.tendon = tendon, .name = name};
    bool good = begin_part(m, &b, NULL);
    for (const kmp_element *e = tendon->first; good && e; e = e->next)
        good = strcmp(e->name, "pulley") == 0 ? end_part(m, &b, false) && begin_part(m, &b, e) : add_place(m, &b, e);
    good = good && end_part(m, &b, true);
    const char *length = kmp_text_keep(&b.sum, m->im->arena);
    *reference = b.reference;
    return good ? length : NULL;
}
