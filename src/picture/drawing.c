/* SPDX-License-Identifier: BSD-3-Clause */
/* Points that coincide in the drawing are one: all marks are combined on it. Places of flexible bodies are drawn like
 * bodies, behind these. */
#include "picture/drawing.h"
#include "base/arena.h"
#include "base/memory.h"
#include "base/text.h"
#include "linalg/dense/three.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/flexible/beam.h"
#include "model/language/expression.h"
#include "model/language/expression_value.h"
#include "output/plot.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

static void values(const kmp_number number[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = number[k].value;
}

/* True if equal up to rounding. */
static bool is_same(const double a[3], const double b[3])
{
    double distance = 0, size = 0;
    for (int k = 0; k < 3; k++) {
        distance = fmax(distance, fabs(a[k] - b[k]));
        size = fmax(size, fmax(fabs(a[k]), fabs(b[k])));
    }
    return distance <= 1e-9 * size;
}

/* -- places of flexible bodies ----------------------------------------------------------------------- */

static const kmp_flexible *flexible_of(const kempe_model *model, int body)
{
    const int own = model->bodies[body].flexible;
    return own > 0 ? &model->flexibles[own - 1] : NULL;
}

/* The place with this offset from the station; place_count: there is none. */
static int find_place(const kmp_drawing *drawing, const kmp_station *station, const double offset[3])
{
    int k = 0;
    while (k < drawing->place_count && (drawing->places[k].station != station ||
                                        memcmp(drawing->places[k].offset, offset, 3 * sizeof *offset) != 0))
        k++;
    return k;
}

static int add_place(kmp_drawing *drawing, int body, const kmp_station *station, const double offset[3])
{
    const int k = find_place(drawing, station, offset);
    if (k == drawing->place_count) {
        drawing->places[drawing->place_count++] = (kmp_drawn_place){.body = body, .station = station, .along = -1};
        memcpy(drawing->places[k].offset, offset, sizeof drawing->places[k].offset);
    }
    return drawing->body_count + k;
}

/* The station that moves a point; NULL: its body does. The origin of a flexible body does not move in its axes. */
static const kmp_station *station_of(const kempe_model *model, int point, double offset[3])
{
    const kmp_point *p = &model->points[point];
    if (p->station == 0)
        return NULL;
    values(p->offset, offset);
    const bool origin = p->station == 1 && offset[0] == 0 && offset[1] == 0 && offset[2] == 0;
    return origin ? NULL : &flexible_of(model, p->body)->stations[p->station - 1];
}

kmp_drawn_point kmp_drawing_point(const kmp_drawing *drawing, const kempe_model *model, int point)
{
    double offset[3];
    kmp_drawn_point at = {.body = model->points[point].body};
    const kmp_station *station = station_of(model, point, offset);
    if (at.body >= drawing->body_count)
        at.body = -1;
    else if (station)
        at.body = drawing->body_count + find_place(drawing, station, offset);
    else if (model->points[point].station == 0)
        values(model->points[point].at, at.at);
    return at;
}

static void add_piece(kmp_drawing *drawing, const kempe_model *model, int body, int from, int to)
{
    drawing->is_rod[drawing->line_count] = true;
    drawing->lines[drawing->line_count++] =
        (kmp_line){.name = model->bodies[body].name, .body = {from, to}, .of = body};
}

int kmp_drawing_most_places(const kempe_model *model)
{
    return model->flexible_count > 0 ? (KMP_BEAM_PIECES + 1) * model->flexible_count + 2 * model->point_count : 0;
}

/* -- marks ------------------------------------------------------------------------------------------- */

/* NULL: the body is not drawn. */
static kmp_mark *mark(kmp_drawing *drawing, int body, unsigned marks, const char *name, const double at[3])
{
    if (body < 0 || (body >= drawing->body_count && body - drawing->body_count >= drawing->place_count))
        return NULL;
    kmp_mark *m = NULL;
    for (int k = 0; k < drawing->mark_count && !m; k++)
        if (drawing->marks[k].body == body && is_same(drawing->marks[k].at, at))
            m = &drawing->marks[k];
    if (!m) {
        m = &drawing->marks[drawing->mark_count++];
        *m = (kmp_mark){.body = body};
        memcpy(m->at, at, sizeof m->at);
    }
    m->marks |= marks;
    m->name = m->name ? m->name : name;
    return m;
}

static kmp_mark *mark_point(kmp_drawing *drawing, const kempe_model *model, int point, unsigned marks, const char *name)
{
    const kmp_drawn_point s = kmp_drawing_point(drawing, model, point);
    return mark(drawing, s.body, marks, name ? name : model->points[point].name, s.at);
}

/* The mark of a body's origin; NULL: the body is not drawn. */
static kmp_mark *mark_origin(kmp_drawing *drawing, int body, unsigned marks, const char *name)
{
    const double origin[3] = {0};
    return body < drawing->body_count ? mark(drawing, body, marks, name, origin) : NULL;
}

/* out = m v; m row by row. */
static void product(const double *m, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

/* Its axis is in the axes of a point, or of the body (-1). The first hinge of a mark is drawn. */
static void set_hinge(const kempe_model *model, int point, const double axis[3], kmp_mark *m)
{
    if (!m || m->marks & KMP_MARK_HINGE)
        return;
    memcpy(m->axis, axis, sizeof m->axis);
    if (point >= 0 && model->points[point].turned)
        product(&model->points[point].axes[0][0], axis, m->axis);
    m->marks |= KMP_MARK_HINGE;
}

/* v of the axes at the point where body's chain begins, in the axes of its parent. */
static void to_parent(const kempe_model *model, const kmp_body *body, const double v[3], double out[3])
{
    double w[3];
    memcpy(w, v, sizeof w);
    for (int i = 0; body->turned && !body->reversed && i < 3; i++)
        w[i] = kmp_dot3(body->frame[i], v);
    memcpy(out, w, sizeof w);
    if (body->at < 0 || !model->points[body->at].turned)
        return;
    const kmp_point *at = &model->points[body->at];
    for (int i = 0; i < 3; i++)
        out[i] = kmp_dot3(at->axes[i], w);
}

static void mark_joint(kmp_drawing *drawing, const kempe_model *model, int b)
{
    const kmp_body *body = &model->bodies[b];
    const int free_count = kmp_joint_free_count(body);
    const kmp_motion *first = free_count > 0 ? &model->motions[kmp_joint_first_free(body)] : NULL;
    bool slides = first && !first->rotation, is_free = free_count > 2;
    bool guided = slides && (free_count == 1 || (!is_free && first[1].rotation));
    unsigned marks = !slides ? KMP_MARK_JOINT : is_free ? KMP_MARK_NAMED : KMP_MARK_SLIDE;
    kmp_picture_slide slide = {.motion = kmp_joint_first_free(body), .body = body->parent, .slider = b};
    kmp_mark *own = body->to >= 0 ? mark_point(drawing, model, body->to, marks, body->joint)
                                  : mark_origin(drawing, b, marks, body->joint);
    if (first && first->rotation && free_count == 1) {
        /* The axis of a body's only rotation in the axes of the body, as positions follow from its chain (pose.c). */
        double axis[3];
        const kmp_motion *hinge = &model->motions[kmp_joint_first_free(body)];
        memcpy(axis, hinge->axis, sizeof axis);
        if (body->turned && body->reversed)
            product(&body->frame[0][0], hinge->axis, axis);
        set_hinge(model, body->to, axis, own);
    }
    if (!slides && body->at >= 0)
        mark_point(drawing, model, body->at, marks, body->joint);
    else if (!slides)
        mark_origin(drawing, body->parent, marks, body->joint);
    if (!guided || body->parent >= drawing->body_count)
        return;
    if (body->at >= 0) {
        const kmp_drawn_point at = kmp_drawing_point(drawing, model, body->at);
        slide.body = at.body;
        memcpy(slide.at, at.at, sizeof slide.at);
    }
    if (body->to >= 0)
        values(model->points[body->to].at, slide.end);
    to_parent(model, body, first->axis, slide.axis);
    drawing->slides[drawing->slide_count++] = slide;
}

static void add_line(kmp_drawing *drawing, const kempe_model *model, const char *name, const int point[2], bool is_rod)
{
    kmp_line line = {.name = name};
    for (int k = 0; k < 2; k++) {
        const kmp_drawn_point s = kmp_drawing_point(drawing, model, point[k]);
        line.body[k] = s.body;
        if (line.body[k] < 0)
            return;
        memcpy(line.at[k], s.at, sizeof line.at[k]);
    }
    drawing->is_rod[drawing->line_count] = is_rod;
    drawing->lines[drawing->line_count++] = line;
}

static void mark_closure(kmp_drawing *drawing, const kempe_model *model, const kmp_closure *closure)
{
    if (closure->point[0] < 0)
        return;
    const kmp_closure_figure figure = kmp_closure_row_of(closure)->figure;
    for (int k = 0; k < 2; k++) {
        kmp_mark *m = mark_point(drawing, model, closure->point[k], KMP_MARK_CLOSURE, closure->name);
        if (figure == KMP_FIGURE_HINGE)
            set_hinge(model, closure->point[k], closure->axis[k], m);
    }
    if (figure == KMP_FIGURE_LINE)
        add_line(drawing, model, closure->name, closure->point, true);
}

/* -- curves of flexible bodies ----------------------------------------------------------------------- */

/* Pieces from the place of a body's joint to the places that its points move with, where its modes are from a file. */
static void add_star(kmp_drawing *drawing, const kempe_model *model, int body)
{
    const double nothing[3] = {0};
    const kmp_flexible *flexible = flexible_of(model, body);
    const int origin = add_place(drawing, body, &flexible->stations[0], nothing);
    mark(drawing, origin, 0, NULL, nothing);
    for (int k = 0; k < model->point_count; k++) {
        const kmp_point *point = &model->points[k];
        const int before = drawing->place_count;
        if (point->body != body || point->station <= 1)
            continue;
        const int place = add_place(drawing, body, &flexible->stations[point->station - 1], nothing);
        mark(drawing, place, 0, NULL, nothing);
        if (place >= drawing->body_count + before)
            add_piece(drawing, model, body, origin, place);
    }
}

static double taper_at(const kmp_taper *taper, const double *parameters, double xi)
{
    double sum = 0;
    for (int k = 0; k < kmp_taper_shares(taper); k++) {
        const kmp_taper_share share = kmp_taper_share_of(taper, k);
        const kmp_polynomial term = kmp_taper_term(share.degree);
        if (xi >= share.from && (xi < share.to || share.to >= 1))
            sum += kmp_number_at(&share.c, parameters) *
                   kmp_polynomial_at(&term, (xi - share.from) / (share.to - share.from));
    }
    return sum;
}

/* The section at xi = x/length. */
static kmp_drawn_section section_of(const kmp_beam *beam, const double *parameters, double xi)
{
    kmp_drawn_section made = {.length = kmp_number_at(&beam->length, parameters),
                              .round = beam->round,
                              .lengthens = beam->count[KMP_BEAM_AXIAL] > 0};
    for (int k = 0; k < 2; k++) {
        made.about[k] = taper_at(&beam->section[1 + k], parameters, xi);
        made.edge[k] = taper_at(&beam->edge[k], parameters, xi);
    }
    if (beam->section[0].count > 0 && beam->section[0].c[0].value > 0 && beam->stiffness[KMP_BEAM_AXIAL].count > 0)
        made.young = kmp_number_at(&beam->stiffness[KMP_BEAM_AXIAL].c[0], parameters) /
                     kmp_number_at(&beam->section[0].c[0], parameters);
    return made;
}

/* The curve of a body: places from end to end, which are in view, and pieces between them. */
static bool add_curve(kmp_drawing *drawing, const kempe_model *model, const double *parameters, int body)
{
    const double nothing[3] = {0};
    const kmp_flexible *flexible = flexible_of(model, body);
    if (flexible->file) {
        add_star(drawing, model, body);
        return true;
    }
    kmp_drawn_section *sections = &drawing->sections[(flexible - model->flexibles) * (KMP_BEAM_PIECES + 1)];
    const kmp_station *stations = kmp_beam_stations(&drawing->arena, flexible, parameters, KMP_BEAM_PIECES + 1);
    for (int k = 0, before = 0; stations && k <= KMP_BEAM_PIECES; k++) {
        const int place = add_place(drawing, body, &stations[k], nothing);
        mark(drawing, place, 0, NULL, nothing);
        drawing->places[place - drawing->body_count].along = k;
        sections[k] = section_of(flexible->beam, parameters, k / (double)KMP_BEAM_PIECES);
        if (k > 0)
            add_piece(drawing, model, body, before, place);
        before = place;
    }
    return stations;
}

/* The place of a point; a point off the curve is joined to it. */
static void add_point(kmp_drawing *drawing, const kempe_model *model, int point)
{
    const double nothing[3] = {0};
    double offset[3];
    const int body = model->points[point].body, before = drawing->place_count;
    const kmp_station *station = body < drawing->body_count ? station_of(model, point, offset) : NULL;
    if (!station)
        return;
    const int place = add_place(drawing, body, station, offset), foot = add_place(drawing, body, station, nothing);
    if (place != foot && place >= drawing->body_count + before)
        add_piece(drawing, model, body, foot, place);
}

static bool is_beneath(const kempe_model *model, int body, int top)
{
    while (body > top)
        body = model->bodies[body].parent;
    return body == top;
}

/* True if a loop closes between what a body carries, itself included, and the rest. */
static bool is_in_loop(const kempe_model *model, int body)
{
    bool in_loop = false;
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        if (closure->point[0] >= 0 && closure->point[1] >= 0)
            in_loop = in_loop || is_beneath(model, model->points[closure->point[0]].body, body) !=
                                     is_beneath(model, model->points[closure->point[1]].body, body);
    }
    return in_loop;
}

/* All places of the station that a point has. */
static void hold_station(kmp_drawing *drawing, const kempe_model *model, int point)
{
    const kmp_point *p = &model->points[point];
    if (p->body >= drawing->body_count || p->station == 0)
        return;
    const kmp_station *station = &flexible_of(model, p->body)->stations[p->station - 1];
    for (int k = 0; k < drawing->place_count; k++)
        if (drawing->places[k].station == station)
            drawing->places[k].held = true;
}

/* Bodies on flexible bodies, and the places where loops close. */
static void add_riders(kmp_drawing *drawing, const kempe_model *model)
{
    for (int b = 1; b < drawing->body_count; b++) {
        const int at = model->bodies[b].at;
        const kmp_drawn_point s = at >= 0 ? kmp_drawing_point(drawing, model, at) : (kmp_drawn_point){.body = 0};
        if (s.body < drawing->body_count)
            continue;
        if (is_in_loop(model, b))
            hold_station(drawing, model, at);
        drawing->riders[drawing->rider_count++] = (kmp_drawn_rider){b, s.body - drawing->body_count};
    }
    for (int c = 0; c < model->closure_count; c++) {
        const int *point = model->closures[c].point;
        for (int k = 0; point[0] >= 0 && point[1] >= 0 && k < 2; k++)
            if (model->points[point[0]].body != model->points[point[1]].body)
                hold_station(drawing, model, point[k]);
    }
}

static bool add_flexibles(kmp_drawing *drawing, const kempe_model *model)
{
    double *parameters = KMP_NEW(double, model->parameter_count + 1);
    bool good = parameters;
    for (int k = 0; good && k < model->parameter_count; k++)
        parameters[k] = model->parameters[k].number.value;
    for (int b = 1; b < drawing->body_count; b++)
        good = good && (!flexible_of(model, b) || add_curve(drawing, model, parameters, b));
    kmp_free(parameters);
    for (int p = 0; good && p < model->point_count; p++)
        add_point(drawing, model, p);
    add_riders(drawing, model);
    return good;
}

/* -- the deformation --------------------------------------------------------------------------------- */

void kmp_drawing_poses(const kmp_drawing *drawing, const kempe_model *model, const double *q, kmp_pose *poses)
{
    kmp_pose_all(model, q, poses);
    for (int k = 0; k < drawing->place_count; k++) {
        const kmp_drawn_place *place = &drawing->places[k];
        kmp_pose pose = poses[place->body];
        kmp_pose_to_station(flexible_of(model, place->body), place->station, q, &pose);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                pose.p[i] += pose.r[i][j] * place->offset[j];
        poses[drawing->body_count + k] = pose;
    }
}

/* The pose of a station in the axes of its beam. */
static kmp_pose pose_in_beam(const kempe_model *model, int body, const kmp_station *station, const double *q)
{
    kmp_pose pose = {.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    kmp_pose_along_beam(flexible_of(model, body), station, q, &pose);
    return pose;
}

/* An end of a line along which a body would be straight. */
typedef struct line_end {
    double x, shift[3];
} line_end;

/* The line between the two places that are held, the origin among them, and between which x is, or to which it is
 * nearest: its displacement at x, and its slope. Both are zero where only the origin is held. */
static void find_line(const kmp_drawing *drawing, const kempe_model *model, int body, double x, const double *q,
                      double shift[3], double slope[3])
{
    line_end below = {0}, end = {0}; /* the last two, end beyond x where there is one */
    for (;;) {
        const kmp_station *next = NULL;
        for (int k = 0; k < drawing->place_count; k++) {
            const kmp_drawn_place *place = &drawing->places[k];
            if (place->body == body && place->held && place->station->at[0].value > end.x &&
                (!next || place->station->at[0].value < next->at[0].value))
                next = place->station;
        }
        if (!next || (end.x > 0 && end.x >= x))
            break;
        const kmp_pose pose = pose_in_beam(model, body, next, q);
        below = end;
        end.x = next->at[0].value;
        for (int i = 0; i < 3; i++)
            end.shift[i] = pose.p[i] - next->at[i].value;
    }
    for (int i = 0; i < 3; i++) {
        slope[i] = end.x > 0 ? (end.shift[i] - below.shift[i]) / (end.x - below.x) : 0;
        shift[i] = below.shift[i] + slope[i] * (x - below.x);
    }
}

static void to_ground_axes(const kmp_pose *pose, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = kmp_dot3(pose->r[i], v);
}

/* The vector of a rotation. */
static void rotation_vector(const kmp_pose *pose, double out[3])
{
    double r[4];
    kmp_pose_quaternion(pose, NULL, r);
    const double size = sqrt(kmp_dot3(r, r));
    for (int i = 0; i < 3; i++)
        out[i] = size > 0 ? 2 * atan2(size, r[3]) / size * r[i] : 0;
}

void kmp_drawing_deformation(const kmp_drawing *drawing, const kempe_model *model, const double *q,
                             const kmp_pose *poses, double *shift, double *turn)
{
    for (int k = 0; k < drawing->place_count; k++) {
        const kmp_drawn_place *place = &drawing->places[k];
        const kmp_flexible *flexible = flexible_of(model, place->body);
        const kmp_pose own = pose_in_beam(model, place->body, place->station, q);
        double line[3], slope[3], away[3], angle[3], o[3], moved[3], turned[3];
        kmp_flexible_from_body(flexible, place->offset, o);
        find_line(drawing, model, place->body, place->station->at[0].value, q, line, slope);
        rotation_vector(&own, angle);
        const double leaning[3] = {0, -slope[2], slope[1]};
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            const double straight = o[i] + leaning[j] * o[l] - leaning[l] * o[j];
            away[i] = own.p[i] + own.r[i][0] * o[0] + own.r[i][1] * o[1] + own.r[i][2] * o[2] -
                      (place->station->at[i].value + line[i] + straight);
            angle[i] -= leaning[i];
            if (place->held)
                away[i] = angle[i] = 0;
        }
        kmp_flexible_to_body(flexible, away, moved);
        kmp_flexible_to_body(flexible, angle, turned);
        to_ground_axes(&poses[place->body], moved, shift + 3 * (ptrdiff_t)k);
        to_ground_axes(&poses[place->body], turned, turn + 3 * (ptrdiff_t)k);
    }
}

/* -- all parts --------------------------------------------------------------------------------------- */

bool kmp_drawing_init(kmp_drawing *drawing, const kempe_model *model, int most_bodies)
{
    int bodies = model->body_count < most_bodies ? model->body_count : most_bodies;
    int places = kmp_drawing_most_places(model), lines = model->force_count + model->closure_count + places;
    for (int f = 0; f < model->force_count; f++)
        lines += model->forces[f].through_count;
    *drawing = (kmp_drawing){.body_count = bodies};
    drawing->marks = KMP_ARENA_NEW(&drawing->arena, kmp_mark,
                                   3 * model->body_count + 2 * (model->closure_count + model->force_count) +
                                       model->point_count + places);
    KMP_ARENA_MAKE(&drawing->arena, KMP_ROOM(kmp_line, lines, &drawing->lines), KMP_ROOM(bool, lines, &drawing->is_rod),
                   KMP_ROOM(kmp_picture_slide, model->body_count, &drawing->slides),
                   KMP_ROOM(kmp_drawn_place, places, &drawing->places),
                   KMP_ROOM(kmp_drawn_section, model->flexible_count * (KMP_BEAM_PIECES + 1), &drawing->sections),
                   KMP_ROOM(kmp_drawn_rider, model->body_count, &drawing->riders));
    if (drawing->arena.failed || (model->flexible_count > 0 && !add_flexibles(drawing, model))) {
        kmp_drawing_free(drawing);
        return false;
    }
    for (int b = 1; b < bodies; b++)
        mark_joint(drawing, model, b);
    for (int c = 0; c < model->closure_count; c++)
        mark_closure(drawing, model, &model->closures[c]);
    for (int f = 0; f < model->force_count; f++)
        for (int k = 0; model->forces[f].kind == KMP_FORCE_BUSHING && k < 2; k++)
            mark_point(drawing, model, model->forces[f].point[k], KMP_MARK_CLOSURE, model->forces[f].name);
    for (int p = 0; p < model->point_count; p++)
        mark_point(drawing, model, p, KMP_MARK_NAMED, NULL);
    for (int b = 1; b < bodies; b++) {
        double at[3];
        values(model->bodies[b].com, at);
        if (model->bodies[b].mass.value > 0 && !flexible_of(model, b))
            mark(drawing, b, KMP_MARK_COM, NULL, at);
    }
    for (int f = 0; f < model->force_count; f++)
        for (int k = 0; kmp_force_is_line(model->forces[f].kind) && k <= model->forces[f].through_count; k++)
            add_line(drawing, model, model->forces[f].name,
                     (const int[]){kmp_force_point(&model->forces[f], k), kmp_force_point(&model->forces[f], k + 1)},
                     model->forces[f].kind == KMP_FORCE_CYLINDER || model->forces[f].through_count > 0);
    return true;
}

KMP_CLEARS(kmp_drawing, drawing, kmp_arena_free(&drawing->arena))

/* -- a picture of the mechanism -------------------------------------------------------------------------- */

/* A mechanism whose points are in a plane of the axes is seen from its front, any other one from above and aside. */

enum { MOST_BODIES = 350, ZIGZAGS = 12 };

/* Range along an axis, of the largest one, below which all points are in a plane. */
#define FLAT 1e-3
/* Radians about the vertical, and downwards. */
#define ASIDE 0.6
#define ABOVE 0.4
/* Parts of the picture's size: space at its edge, thickness of a bar, of a line, radius of a joint, size of a pin,
 * width of a spring, length of a guide. */
#define EDGE  0.14
#define BAR   0.03
#define LINE  0.012
#define JOINT 0.02
#define PIN   0.05
#define COIL  0.03
#define GUIDE 0.3
#define BLOCK 0.2

typedef struct place {
    double x, y;
} place;

typedef struct picture {
    kmp_text *svg;
    kmp_drawing drawing;
    kmp_pose *poses;
    place *at, *hull;              /* of each mark; of a body */
    double right[3], up[3];        /* of the viewer */
    double size, scale, middle[2]; /* pixels; pixels a metre; in the viewer's axes */
} picture;

static void make_unit(double v[3])
{
    const double length = sqrt(kmp_dot3(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static void to_ground(const picture *p, int body, const double at[3], double out[3])
{
    const kmp_pose *pose = &p->poses[body];
    for (int i = 0; i < 3; i++)
        out[i] = pose->p[i] + kmp_dot3(pose->r[i], at);
}

static place see(const picture *p, int body, const double at[3])
{
    double v[3];
    to_ground(p, body, at, v);
    return (place){p->size / 2 + p->scale * (kmp_dot3(v, p->right) - p->middle[0]),
                   p->size / 2 - p->scale * (kmp_dot3(v, p->up) - p->middle[1])};
}

/* -- the viewer -------------------------------------------------------------------------------------- */

/* The axis that all points are perpendicular to; -1: none. z before y and x. */
static int find_plane(const picture *p)
{
    double range[3], largest = 0;
    for (int i = 0; i < 3; i++) {
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < p->drawing.mark_count; k++) {
            double v[3];
            to_ground(p, p->drawing.marks[k].body, p->drawing.marks[k].at, v);
            low = fmin(low, v[i]);
            high = fmax(high, v[i]);
        }
        range[i] = high - low;
        largest = fmax(largest, range[i]);
    }
    for (int i = 2; i >= 0; i--)
        if (!(range[i] > FLAT * largest))
            return i;
    return -1;
}

/* Up is against gravity, otherwise y, and z in space. */
static void place_viewer(picture *p, const kmp_number g[3])
{
    const double gravity[] = {g[0].value, g[1].value, g[2].value};
    const int plane = find_plane(p);
    double out[3] = {plane == 0, plane == 1 ? -1 : 0, plane == 2}, weight = sqrt(kmp_dot3(gravity, gravity));
    for (int i = 0; i < 3; i++)
        p->up[i] = weight > 0 ? -gravity[i] / weight : i == (plane == 2 ? 1 : 2);
    if (plane >= 0 && fabs(p->up[plane]) > 0.5) /* gravity is perpendicular to the plane */
        for (int i = 0; i < 3; i++)
            p->up[i] = i == (plane == 2 ? 1 : 2);
    if (plane < 0) {
        const double level[3] = {fabs(p->up[0]) < 0.9, fabs(p->up[0]) >= 0.9, 0};
        double right[3], front[3];
        kmp_cross3(level, p->up, front);
        make_unit(front);
        kmp_cross3(p->up, front, right);
        for (int i = 0; i < 3; i++) {
            const double aside = cos(ASIDE) * front[i] + sin(ASIDE) * right[i];
            out[i] = cos(ABOVE) * aside + sin(ABOVE) * p->up[i];
        }
    }
    kmp_cross3(p->up, out, p->right);
    make_unit(p->right);
    kmp_cross3(out, p->right, p->up);
    make_unit(p->up);
}

/* Pixels a metre, so that all points are inside of the edges. */
static void fit(picture *p)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, range = 0;
    for (int k = 0; k < p->drawing.mark_count; k++) {
        double v[3];
        to_ground(p, p->drawing.marks[k].body, p->drawing.marks[k].at, v);
        const double seen[] = {kmp_dot3(v, p->right), kmp_dot3(v, p->up)};
        for (int i = 0; i < 2; i++) {
            low[i] = fmin(low[i], seen[i]);
            high[i] = fmax(high[i], seen[i]);
        }
    }
    for (int i = 0; i < 2; i++) {
        p->middle[i] = (low[i] + high[i]) / 2;
        range = fmax(range, high[i] - low[i]);
    }
    p->scale = range > 0 ? (1 - 2 * EDGE) * p->size / range : p->size;
    for (int k = 0; k < p->drawing.mark_count; k++)
        p->at[k] = see(p, p->drawing.marks[k].body, p->drawing.marks[k].at);
}

/* -- parts ------------------------------------------------------------------------------------------- */

static void put_path(const picture *p, const place *points, int count, const char *end)
{
    kmp_text_put(p->svg, "<path d=\"");
    for (int k = 0; k < count; k++)
        kmp_text_printf(p->svg, "%c%.2f %.2f", k == 0 ? 'M' : 'L', points[k].x, points[k].y);
    kmp_text_put(p->svg, end);
}

static void put_line(const picture *p, const place *points, int count, double width, const char *colour)
{
    put_path(p, points, count, "\"");
    kmp_text_printf(p->svg,
                    " fill=\"none\" stroke=\"%s\" stroke-width=\"%.2f\" stroke-linecap=\"round\" "
                    "stroke-linejoin=\"round\"/>\n",
                    colour, width * p->size);
}

static double turn(place a, place b, place c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static bool is_before(place a, place b)
{
    return a.x < b.x || (a.x <= b.x && a.y < b.y);
}

/* The convex hull of `count` points, in order (Andrew 1979); they are sorted. Returns the number of its corners. */
static int find_hull(place *points, int count, place *hull)
{
    int corners = 0;
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && is_before(points[k], points[k - 1]); k--) {
            const place swapped = points[k];
            points[k] = points[k - 1];
            points[k - 1] = swapped;
        }
    for (int side = 0; side < 2; side++) {
        const int first = corners;
        for (int i = 0; i < count; i++) {
            const place next = points[side ? count - 1 - i : i];
            while (corners >= first + 2 && turn(hull[corners - 2], hull[corners - 1], next) <= 0)
                corners--;
            hull[corners++] = next;
        }
        corners--; /* the first one of the other side */
    }
    return corners > 0 ? corners : 1;
}

/* Points of a body that make its shape: all but its centre of mass, which counts where there are no others. */
static void put_body(const picture *p, int body)
{
    const int all = p->drawing.mark_count;
    place *own = p->hull, *hull = p->hull + all;
    int count = 0, centre = -1;
    for (int k = 0; k < all; k++)
        if (p->drawing.marks[k].body == body && p->drawing.marks[k].marks & ~(unsigned)KMP_MARK_COM)
            own[count++] = p->at[k];
        else if (p->drawing.marks[k].body == body)
            centre = k;
    if (centre >= 0 && count < 2)
        own[count++] = p->at[centre];
    if (count == 0)
        return;
    const int corners = find_hull(own, count, hull);
    put_path(p, hull, corners, "Z\"");
    kmp_text_printf(p->svg,
                    " fill=\"%s\" fill-opacity=\"0.3\" stroke=\"%s\" stroke-width=\"%.2f\" stroke-linejoin=\"round\" "
                    "stroke-linecap=\"round\"/>\n",
                    kmp_plot_colour(body - 1), kmp_plot_colour(body - 1), BAR * p->size);
}

/* The guide of a sliding body, and a block on it. */
static void put_guide(const picture *p, const kmp_picture_slide *slide)
{
    double v[3];
    const place at = see(p, slide->slider, slide->end);
    for (int i = 0; i < 3; i++)
        v[i] = slide->at[i] + slide->axis[i] / p->scale;
    const place from = see(p, slide->body, slide->at), to = see(p, slide->body, v);
    const double length = hypot(to.x - from.x, to.y - from.y);
    if (!(length > 1e-6))
        return;
    const double x = GUIDE / 2 * p->size * (to.x - from.x) / length, y = GUIDE / 2 * p->size * (to.y - from.y) / length;
    const place ends[] = {{at.x - x, at.y - y}, {at.x + x, at.y + y}};
    put_line(p, ends, 2, LINE, "#8a8f98");
    const place block[] = {{at.x - BLOCK * x, at.y - BLOCK * y}, {at.x + BLOCK * x, at.y + BLOCK * y}};
    put_line(p, block, 2, 2 * BAR, kmp_plot_colour(slide->slider - 1));
}

/* A spring is a zigzag, a rod a line, a piece of a flexible body a bar. */
static void put_connection(const picture *p, const kmp_line *line, bool is_rod)
{
    const place a = see(p, line->body[0], line->at[0]), b = see(p, line->body[1], line->at[1]);
    const double x = b.x - a.x, y = b.y - a.y, length = hypot(x, y), wide = COIL * p->size;
    place points[ZIGZAGS + 3] = {a, b};
    int count = 2;
    if (!is_rod && length > 0) {
        for (int k = 0; k <= ZIGZAGS; k++) {
            const double s = 0.15 + 0.7 * k / ZIGZAGS, side = k == 0 || k == ZIGZAGS ? 0 : k % 2 ? wide : -wide;
            points[k + 1] = (place){a.x + s * x - side * y / length, a.y + s * y + side * x / length};
        }
        points[ZIGZAGS + 2] = b;
        count = ZIGZAGS + 3;
    }
    put_line(p, points, count, line->of > 0 ? BAR : LINE, line->of > 0 ? kmp_plot_colour(line->of - 1) : "#5d6d7e");
}

bool kmp_mechanism_picture(kmp_text *svg, const kempe_model *model, const double *q, double size)
{
    kmp_arena arena = {0};
    picture p = {.svg = svg, .size = size};
    bool ok = kmp_drawing_init(&p.drawing, model, MOST_BODIES) &&
              KMP_ARENA_MAKE(&arena, KMP_ROOM(kmp_pose, model->body_count + p.drawing.place_count, &p.poses),
                             KMP_ROOM(place, p.drawing.mark_count + 1, &p.at),
                             KMP_ROOM(place, 3 * (ptrdiff_t)p.drawing.mark_count + 3, &p.hull));
    if (ok) {
        kmp_drawing_poses(&p.drawing, model, q, p.poses);
        place_viewer(&p, model->gravity);
        fit(&p);
        kmp_picture_begin(svg, size, size, "");
        const kmp_drawing *d = &p.drawing;
        for (int k = 0; k < d->slide_count; k++)
            put_guide(&p, &d->slides[k]);
        for (int k = 0; k < d->mark_count; k++)
            if (d->marks[k].body == 0 && d->marks[k].marks & (KMP_MARK_JOINT | KMP_MARK_CLOSURE)) {
                const place at = p.at[k];
                const double high = PIN * size;
                const place pin[] = {at, {at.x - 0.6 * high, at.y + high}, {at.x + 0.6 * high, at.y + high}};
                put_path(&p, pin, 3, "Z\" fill=\"#8a8f98\"/>\n");
            }
        for (int b = 1; b < d->body_count; b++)
            put_body(&p, b);
        for (int k = 0; k < d->line_count; k++)
            put_connection(&p, &d->lines[k], d->is_rod[k]);
        for (int k = 0; k < d->mark_count; k++)
            if (d->marks[k].marks & (KMP_MARK_JOINT | KMP_MARK_CLOSURE))
                kmp_text_printf(p.svg,
                                "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%.2f\" fill=\"#fff\" stroke=\"#222\" "
                                "stroke-width=\"%.2f\"/>\n",
                                p.at[k].x, p.at[k].y, JOINT * p.size, LINE / 2 * p.size);
        kmp_picture_end(svg);
    }
    kmp_drawing_free(&p.drawing);
    kmp_arena_free(&arena);
    return ok && !svg->failed;
}
