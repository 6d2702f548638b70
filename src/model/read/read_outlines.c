/* SPDX-License-Identifier: BSD-3-Clause */
/* Outlines: their shapes become edges counter-clockwise about the solid, and these become pieces. */
#include "model/read/read_outlines.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/read/read_cams.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

static const kmp_key outline_keys[] = {
#include "model/keys/outline_keys.def"
    {0}};
static const kmp_key arc_keys[] = {
#include "model/keys/outline_arc_keys.def"
    {0}};

typedef kmp_outline_reading reading;

/* -- values -------------------------------------------------------------------------------------------- */

static bool read_length(const reading *c, const kmp_yaml *node, const char *key, kmp_field_rule rule, double *value)
{
    return kmp_read_fixed_ruled(c->r, node, kmp_reader_say(c->r, "%s: %s", c->what, key), KMP_DIM_LENGTH, rule, value);
}

static bool read_place(const reading *c, const kmp_yaml *node, const char *key, double place[2])
{
    return kmp_read_list(c->r, node, kmp_reader_say(c->r, "%s: %s", c->what, key), 2) &&
           read_length(c, node->items[0], key, KMP_FIELD_ANY, &place[0]) &&
           read_length(c, node->items[1], key, KMP_FIELD_ANY, &place[1]);
}

/* The key `at`. */
static bool read_at(const reading *c, double place[2])
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "at");
    place[0] = place[1] = 0;
    return !node || read_place(c, node, "at", place);
}

/* -- edges --------------------------------------------------------------------------------------------- */

static void add_line(reading *c, const double from[2], const double to[2])
{
    kmp_outline_edge *edge = &c->edges[c->edge_count++];
    *edge = (kmp_outline_edge){.from = {from[0], from[1]}, .to = {to[0], to[1]}};
}

static void add_arc(reading *c, const double from[2], const double to[2], const double centre[2], double turn)
{
    kmp_outline_edge *edge = &c->edges[c->edge_count++];
    *edge = (kmp_outline_edge){
        .from = {from[0], from[1]}, .to = {to[0], to[1]}, .centre = {centre[0], centre[1]}, .turn = turn, .arc = true};
}

/* The circle through three places, and the angle from the first to the last one by the second. */
static bool arc_through(const double a[2], const double b[2], const double c[2], double centre[2], double *turn)
{
    const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
    const double cross = ux * vy - uy * vx, uu = ux * ux + uy * uy, vv = vx * vx + vy * vy;
    if (!(fabs(cross) > KMP_OUTLINE_STRAIGHT * sqrt(uu * vv)))
        return false;
    const double x = (uu * vy - vv * uy) / (2 * cross), y = (vv * ux - uu * vx) / (2 * cross);
    centre[0] = a[0] + x;
    centre[1] = a[1] + y;
    const double first = atan2(-y, -x), last = atan2(c[1] - centre[1], c[0] - centre[0]);
    *turn = fmod(last - first + 2 * KMP_TURN, KMP_TURN); /* to the left */
    if (cross < 0)
        *turn -= KMP_TURN;
    return true;
}

/* -- shapes -------------------------------------------------------------------------------------------- */

static bool read_path_arc(reading *c, const kmp_yaml *map, const double from[2], double to[2])
{
    double through[2], centre[2], turn;
    if (!kmp_read_map(c->r, map, kmp_reader_say(c->r, "%s: an arc", c->what), arc_keys))
        return false;
    const kmp_yaml *end = kmp_read_required(c->r, map, c->what, "arc");
    const kmp_yaml *middle = kmp_read_required(c->r, map, c->what, "through");
    if (!end || !middle || !read_place(c, end, "arc", to) || !read_place(c, middle, "through", through))
        return false;
    if (!arc_through(from, through, to, centre, &turn))
        return KMP_COMPLAIN(c, map, "the places of this arc are on a straight line");
    add_arc(c, from, to, centre, turn);
    return true;
}

/* Corners with lines between them, and of a path with arcs; the first corner and the last one. */
static bool read_chain(reading *c, double first[2], double last[2])
{
    double place[2];
    for (int k = 0; k < c->node->count; k++) {
        const kmp_yaml *node = c->node->items[k];
        const bool arc = k > 0 && c->outline->shape == KMP_OUTLINE_PATH && node->kind == KMP_YAML_MAP;
        if (arc ? !read_path_arc(c, node, last, place)
                : !read_place(c, node, kmp_outline_words[c->outline->shape], place))
            return false;
        if (k > 0 && hypot(place[0] - last[0], place[1] - last[1]) == 0)
            return KMP_COMPLAIN(c, node, "corner %d is at the place of corner %d", k + 1, k);
        if (k == 0)
            memcpy(first, place, sizeof place);
        else if (!arc)
            add_line(c, last, place);
        memcpy(last, place, sizeof place);
    }
    return true;
}

static bool read_polygon(reading *c)
{
    double area = 0, first[2], last[2];
    c->outline->closed = true;
    if (!kmp_read_list(c->r, c->node, kmp_reader_say(c->r, "%s: polygon", c->what), -1))
        return false;
    if (c->node->count < 3)
        return KMP_COMPLAIN(c, c->node, "a polygon has three corners or more");
    if (!read_chain(c, first, last))
        return false;
    add_line(c, last, first);
    for (int k = 0; k < c->edge_count; k++)
        area += c->edges[k].from[0] * c->edges[k].to[1] - c->edges[k].from[1] * c->edges[k].to[0];
    return area > 0 ||
           KMP_COMPLAIN(c, c->node,
                        "the corners go clockwise: write them counter-clockwise, and 'hollow: yes' for a hole");
}

static bool read_segment(reading *c)
{
    double first[2], last[2];
    return kmp_read_list(c->r, c->node, kmp_reader_say(c->r, "%s: segment", c->what), 2) && read_chain(c, first, last);
}

static bool read_rectangle(reading *c)
{
    double size[2], at[2], corner[4][2];
    c->outline->closed = true;
    if (!read_place(c, c->node, "rectangle", size) || !read_at(c, at))
        return false;
    if (!(size[0] > 0 && size[1] > 0))
        return KMP_COMPLAIN(c, c->node, "the sides %.6g m and %.6g m must be positive", size[0], size[1]);
    for (int k = 0; k < 4; k++) {
        corner[k][0] = at[0] + (k == 1 || k == 2 ? 0.5 : -0.5) * size[0];
        corner[k][1] = at[1] + (k >= 2 ? 0.5 : -0.5) * size[1];
    }
    for (int k = 0; k < 4; k++)
        add_line(c, corner[k], corner[(k + 1) % 4]);
    return true;
}

static bool read_circle(reading *c)
{
    double radius, at[2];
    c->outline->closed = true;
    if (!read_length(c, c->node, "circle", KMP_FIELD_POSITIVE, &radius) || !read_at(c, at))
        return false;
    const double start[2] = {at[0] + radius, at[1]};
    add_arc(c, start, start, at, KMP_TURN);
    return true;
}

/* Free inside, so clockwise. */
static bool read_slot(reading *c)
{
    const kmp_yaml *node = kmp_read_required(c->r, c->map, c->what, "width");
    double length, width, at[2];
    c->outline->closed = true;
    if (!node || !read_length(c, c->node, "slot", KMP_FIELD_POSITIVE, &length) ||
        !read_length(c, node, "width", KMP_FIELD_POSITIVE, &width) || !read_at(c, at))
        return false;
    const double r = width / 2, x = at[0] + length, far[2] = {x, at[1]};
    const double low[2][2] = {{at[0], at[1] - r}, {x, at[1] - r}}, high[2][2] = {{at[0], at[1] + r}, {x, at[1] + r}};
    add_line(c, high[0], high[1]);
    add_arc(c, high[1], low[1], far, -KMP_TURN / 2);
    add_line(c, low[1], low[0]);
    add_arc(c, low[0], high[0], at, -KMP_TURN / 2);
    return true;
}

/* The key `closed`: a line to the beginning, or to the beginning of the next copy. */
static bool close_path(reading *c, const double first[2], const double last[2])
{
    static const char *const words[] = {"yes", "no"};
    const double angle = KMP_TURN / c->outline->copies, cosine = cos(angle), sine = sin(angle);
    const double next[2] = {cosine * first[0] - sine * first[1], sine * first[0] + cosine * first[1]};
    const double *to = c->outline->copies > 1 ? next : first;
    const int word = kmp_read_choice_of(c->r, c->map, "closed", c->what, KMP_NAMES_OF(words), "closed is", 1);
    c->outline->closed = word == 0;
    if (c->outline->closed && hypot(to[0] - last[0], to[1] - last[1]) > KMP_WRITTEN_DIGITS * hypot(last[0], last[1]))
        add_line(c, last, to);
    return word >= 0;
}

static bool read_path(reading *c)
{
    double first[2] = {0}, last[2] = {0};
    if (!kmp_read_list(c->r, c->node, kmp_reader_say(c->r, "%s: path", c->what), -1))
        return false;
    if (c->node->count < 2 || c->node->items[0]->kind == KMP_YAML_MAP)
        return KMP_COMPLAIN(c, c->node, "a path has two corners or more, and begins with a corner");
    return read_chain(c, first, last) && close_path(c, first, last);
}

/* -- an outline ---------------------------------------------------------------------------------------- */

/* Keys that another shape has. */
static bool check_keys(const reading *c)
{
    static const char *const keys[] = {"width", "at", "closed", "round", "hollow", "copies", "base", "follower"};
    const int shape = (int)c->outline->shape;
    for (int k = 0; k < 8; k++)
        if (kmp_yaml_get(c->map, keys[k]) && !kmp_text_behind_word(kmp_outline_more[shape], keys[k]))
            return KMP_COMPLAIN(c, kmp_yaml_get(c->map, keys[k]), "the key '%s' does not belong to a '%s'", keys[k],
                                kmp_outline_words[shape]);
    return true;
}

static bool read_common(const reading *c)
{
    const kmp_yaml *copies = kmp_yaml_get(c->map, "copies"), *round = kmp_yaml_get(c->map, "round");
    const char *of = kmp_reader_say(c->r, "%s: copies", c->what);
    double count = 1;
    if (copies && !kmp_read_whole(c->r, copies, of, "is", 1, 1000, &count))
        return false;
    c->outline->copies = (int)count;
    if (round && !read_length(c, round, "round", KMP_FIELD_NOT_NEGATIVE, &c->outline->round))
        return false;
    c->outline->hollow = kmp_yaml_get(c->map, "hollow");
    return kmp_read_choice_of(c->r, c->map, "hollow", c->what, kmp_yes, "hollow is", 0) >= 0;
}

/* The same edges the other way. */
static void reverse(reading *c)
{
    for (int k = 0; k < c->edge_count; k++) {
        kmp_outline_edge *edge = &c->edges[k], was = *edge;
        memcpy(edge->from, was.to, sizeof was.to);
        memcpy(edge->to, was.from, sizeof was.from);
        edge->turn = -was.turn;
    }
    for (int k = 0; k < c->edge_count / 2; k++) {
        const kmp_outline_edge was = c->edges[k];
        c->edges[k] = c->edges[c->edge_count - 1 - k];
        c->edges[c->edge_count - 1 - k] = was;
    }
}

static bool (*const shape_readers[KMP_OUTLINE_SHAPES])(reading *) = {
#define KMP_OUTLINE(kind, word, reader, keys) [KMP_OUTLINE_##kind] = reader,
#include "model/data/outline_shapes.def"
#undef KMP_OUTLINE
};

static void read_outline(reading *c, int shape)
{
    int wrong = -1;
    double place[2];
    c->outline->shape = (kmp_outline_shape)shape;
    c->node = kmp_yaml_get(c->map, kmp_outline_words[shape]);
    c->edges = KMP_ARENA_NEW(&c->r->scratch, kmp_outline_edge, c->node->count + 4);
    if (!c->edges || !check_keys(c) || !read_common(c) || !shape_readers[shape](c) || c->outline->cam)
        return;
    if (c->outline->hollow)
        reverse(c);
    if (!kmp_outline_make(&c->r->model->arena, c->edges, c->edge_count, c->outline, &wrong)) {
        if (wrong >= 0)
            KMP_COMPLAIN(c, c->map,
                         "the edge from (%.6g, %.6g) m to (%.6g, %.6g) m is too short for corners of radius %.6g m",
                         c->edges[wrong].from[0], c->edges[wrong].from[1], c->edges[wrong].to[0], c->edges[wrong].to[1],
                         c->outline->round);
        return;
    }
    if (kmp_outline_crosses(c->outline, place))
        KMP_COMPLAIN(c, c->node, "it crosses itself at (%.6g, %.6g) m%s", place[0], place[1],
                     c->outline->copies > 1 ? ", perhaps with a copy: take fewer 'copies'" : "");
}

void kmp_read_outlines(kmp_reader *r)
{
    kmp_section s = kmp_read_section(r, "outlines", "outline");
    if (s.count == 0)
        return;
    r->model->outlines = KMP_ARENA_NEW(&r->model->arena, kmp_outline, s.count);
    while (r->model->outlines && kmp_section_next(&s)) {
        kmp_outline *outline = &r->model->outlines[r->model->outline_count++];
        *outline = (kmp_outline){.name = s.name, .place = s.node->place, .copies = 1};
        reading c = {.r = r, .map = s.node, .what = s.what, .outline = outline};
        if (!kmp_read_map(r, s.node, s.what, outline_keys))
            continue;
        const int shape = kmp_read_one_key(r, s.node, s.what, KMP_NAMES_OF(kmp_outline_words));
        if (shape >= 0)
            read_outline(&c, shape);
    }
}

const kmp_outline *kmp_read_outline_name(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const int found = kmp_read_reference(r, node, what, "outline", KMP_NAMED(r->model, outline));
    return found < 0 ? NULL : &r->model->outlines[found];
}
