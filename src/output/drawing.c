/* SPDX-License-Identifier: BSD-3-Clause */
/* Points that coincide in the drawing are one: all marks are combined on it. */
#include "output/drawing.h"
#include "base/memory.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include <math.h>
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

/* NULL: the body is not drawn. */
static kmp_mark *mark(kmp_drawing *drawing, int body, unsigned marks, const char *name, const double at[3])
{
    if (body >= drawing->body_count)
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
    double at[3];
    values(model->points[point].at, at);
    return mark(drawing, model->points[point].body, marks, name ? name : model->points[point].name, at);
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
        w[i] = body->frame[i][0] * v[0] + body->frame[i][1] * v[1] + body->frame[i][2] * v[2];
    memcpy(out, w, sizeof w);
    if (body->at < 0 || !model->points[body->at].turned)
        return;
    const kmp_point *at = &model->points[body->at];
    for (int i = 0; i < 3; i++)
        out[i] = at->axes[i][0] * w[0] + at->axes[i][1] * w[1] + at->axes[i][2] * w[2];
}

static void mark_joint(kmp_drawing *drawing, const kempe_model *model, int b)
{
    const double origin[3] = {0};
    const kmp_body *body = &model->bodies[b];
    const int free_count = kmp_joint_free_count(body);
    const kmp_motion *first = free_count > 0 ? &model->motions[kmp_joint_first_free(body)] : NULL;
    bool slides = first && !first->rotation, is_free = free_count > 2;
    bool guided = slides && (free_count == 1 || (!is_free && first[1].rotation));
    unsigned marks = !slides ? KMP_MARK_JOINT : is_free ? KMP_MARK_NAMED : KMP_MARK_SLIDE;
    kmp_picture_slide slide = {.motion = kmp_joint_first_free(body), .body = body->parent, .slider = b};
    kmp_mark *own = body->to >= 0 ? mark_point(drawing, model, body->to, marks, body->joint)
                                  : mark(drawing, b, marks, body->joint, origin);
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
        mark(drawing, body->parent, marks, body->joint, origin);
    if (!guided || body->parent >= drawing->body_count)
        return;
    if (body->at >= 0)
        values(model->points[body->at].at, slide.at);
    if (body->to >= 0)
        values(model->points[body->to].at, slide.end);
    to_parent(model, body, first->axis, slide.axis);
    drawing->slides[drawing->slide_count++] = slide;
}

static void add_line(kmp_drawing *drawing, const kempe_model *model, const char *name, const int point[2], bool is_rod)
{
    kmp_line line = {.name = name};
    for (int k = 0; k < 2; k++) {
        line.body[k] = model->points[point[k]].body;
        if (line.body[k] >= drawing->body_count)
            return;
        values(model->points[point[k]].at, line.at[k]);
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

bool kmp_drawing_init(kmp_drawing *drawing, const kempe_model *model, int most_bodies)
{
    int bodies = model->body_count < most_bodies ? model->body_count : most_bodies;
    int lines = model->force_count + model->closure_count;
    for (int f = 0; f < model->force_count; f++)
        lines += model->forces[f].through_count;
    *drawing = (kmp_drawing){.body_count = bodies};
    drawing->marks =
        KMP_ARENA_NEW(&drawing->arena, kmp_mark,
                      3 * model->body_count + 2 * (model->closure_count + model->force_count) + model->point_count);
    KMP_ARENA_MAKE(&drawing->arena, KMP_ROOM(kmp_line, lines, &drawing->lines), KMP_ROOM(bool, lines, &drawing->is_rod),
                   KMP_ROOM(kmp_picture_slide, model->body_count, &drawing->slides));
    if (drawing->arena.failed) {
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
        if (model->bodies[b].mass.value > 0)
            mark(drawing, b, KMP_MARK_COM, NULL, at);
    }
    for (int f = 0; f < model->force_count; f++)
        for (int k = 0; kmp_force_is_line(model->forces[f].kind) && k <= model->forces[f].through_count; k++)
            add_line(drawing, model, model->forces[f].name,
                     (const int[]){kmp_force_point(&model->forces[f], k), kmp_force_point(&model->forces[f], k + 1)},
                     model->forces[f].kind == KMP_FORCE_CYLINDER);
    return true;
}

KMP_CLEARS(kmp_drawing, drawing, kmp_arena_free(&drawing->arena))
