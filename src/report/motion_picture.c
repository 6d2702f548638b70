/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames are 16-bit integers: positions within the box of all of them, and unit quaternions. A large mechanism has
 * fewer frames, the largest ones are drawn in part. */
#include "report/motion_picture.h"
#include "model/pose.h"
#include "output/mechanism/drawing.h"
#include "report/drawn_shapes.h"
#include "report/railway.h"
#include <math.h>
#include <string.h>

enum { MOST_BODIES = 350, MOST_NUMBERS = 360000, BODY_NUMBERS = 7 };

/* Largest rotation of a joint between two frames, and the excess that is accepted. Another limit applies to rotations
 * that move no visible point, such as the spin of a wheel, of which only the direction must be visible. */
#define FOLLOWED 0.35
#define SPARED   1.5
#define SPUN     1.2

typedef struct picture {
    const kempe_model *model;
    const kmp_samples *row;
    const double *at; /* of each row; NULL: its time */
    kmp_drawing drawing;
    int frames, stride; /* every so many rows is a frame, and the last row */
    kmp_pose *poses;
    double *position, *rotation; /* 3 and 4 a frame and body, without the ground */
    int16_t *room;
    kmp_arena arena;
} picture;

/* The larger of the squares of a place's distance from an axis, and of `across`; and of its distance from the origin,
 * and of `away`. */
static void measure(const kmp_number *at, const double axis[3], double *across, double *away)
{
    double x = at[0].value, y = at[1].value, z = at[2].value, along = x * axis[0] + y * axis[1] + z * axis[2];
    *away = fmax(*away, x * x + y * y + z * z);
    *across = fmax(*across, x * x + y * y + z * z - along * along);
}

/* True if a body's points and its centre of mass lie on an axis through its origin, and no body is attached to it. */
static bool is_on_axis(const kempe_model *model, int body, const double axis[3])
{
    double across = 0, away = 0;
    measure(model->bodies[body].com, axis, &across, &away);
    for (int k = 0; k < model->point_count; k++)
        if (model->points[k].body == body)
            measure(model->points[k].at, axis, &across, &away);
    for (int b = 0; b < model->body_count; b++)
        if (b != body && model->bodies[b].parent == body)
            return false;
    return across <= 1e-12 * away;
}

/* True if a coordinate rotates its body about an axis that contains all its visible points. */
static bool is_spin(const kempe_model *model, int k)
{
    const kmp_motion *motion = &model->motions[k];
    const kmp_body *body = &model->bodies[motion->body];
    bool last = k + 1 == model->motion_count || model->motions[k + 1].body != motion->body;
    return last && !body->turned && !body->reversed && body->to < 0 && is_on_axis(model, motion->body, motion->axis);
}

double kmp_motion_picture_end(const kempe_model *model, const kmp_record *record)
{
    const kmp_samples *row = &record->row;
    double most = 0, t_end = row->rows > 0 ? kmp_samples_time(row, row->rows - 1) : 0;
    for (int k = 0; k < model->motion_count; k++) {
        double turn = 0;
        for (int r = 1; model->motions[k].rotation && r < row->rows; r++)
            turn = fmax(turn, fabs(kmp_samples_get(row, KMP_QUANTITY_Q, r)[k] -
                                   kmp_samples_get(row, KMP_QUANTITY_Q, r - 1)[k]));
        if (turn > FOLLOWED)
            most = fmax(most, is_spin(model, k) ? turn * FOLLOWED / SPUN : turn);
    }
    return most > SPARED * FOLLOWED ? t_end * FOLLOWED / most : t_end;
}

/* -- frames ------------------------------------------------------------------------------------------ */

static int row_index(const picture *p, int frame)
{
    int row = frame * p->stride;
    return row < p->row->rows ? row : p->row->rows - 1;
}

static const double *row_of(const picture *p, int frame)
{
    return kmp_samples_get(p->row, KMP_QUANTITY_Q, row_index(p, frame));
}

static void pose_frames(picture *p)
{
    int moving = p->drawing.body_count - 1;
    for (int f = 0; f < p->frames; f++) {
        kmp_pose_all(p->model, row_of(p, f), p->poses);
        for (int b = 0; b < moving; b++) {
            double *x = p->position + 3 * ((ptrdiff_t)f * moving + b),
                   *r = p->rotation + 4 * ((ptrdiff_t)f * moving + b);
            memcpy(x, p->poses[b + 1].p, 3 * sizeof *x);
            kmp_pose_quaternion(&p->poses[b + 1], f > 0 ? r - 4 * (ptrdiff_t)moving : NULL, r);
        }
    }
}

int kmp_motion_picture_frames(const kempe_model *model)
{
    int moving = (model->body_count < MOST_BODIES ? model->body_count : MOST_BODIES) - 1;
    return moving > 0 ? MOST_NUMBERS / (BODY_NUMBERS * moving) : MOST_NUMBERS;
}

static bool make_frames(picture *p)
{
    int moving = p->drawing.body_count - 1, rows = p->row->rows;
    int most = moving > 0 ? MOST_NUMBERS / (BODY_NUMBERS * moving) : rows;
    p->stride = 1;
    while ((rows + p->stride - 2) / p->stride + 1 > most && p->stride < rows)
        p->stride++;
    p->frames = (rows + p->stride - 2) / p->stride + 1;
    if (!KMP_ARENA_MAKE(&p->arena, KMP_ROOM(kmp_pose, p->model->body_count, &p->poses),
                        KMP_ROOM(double, 3 * (ptrdiff_t)p->frames * moving, &p->position),
                        KMP_ROOM(double, 4 * (ptrdiff_t)p->frames * moving, &p->rotation),
                        KMP_ROOM(int16_t, 4 * (ptrdiff_t)p->frames * moving, &p->room)))
        return false;
    pose_frames(p);
    return true;
}

static void put_positions(kmp_json *json, picture *p)
{
    size_t count = 3 * (size_t)p->frames * (size_t)(p->drawing.body_count - 1);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, middle[3] = {0};
    double scale = 0;
    for (size_t k = 0; k < count; k++) {
        low[k % 3] = fmin(low[k % 3], p->position[k]);
        high[k % 3] = fmax(high[k % 3], p->position[k]);
    }
    for (int i = 0; i < 3 && count > 0; i++) {
        middle[i] = (low[i] + high[i]) / 2;
        scale = fmax(scale, (high[i] - low[i]) / 2);
    }
    for (size_t k = 0; k < count; k++)
        p->room[k] = (int16_t)lround(scale > 0 ? INT16_MAX * ((p->position[k] - middle[k % 3]) / scale) : 0);
    kmp_json_rounded_numbers(json, "middle", 3, middle, 7);
    kmp_json_rounded(json, "unit", scale / INT16_MAX, 7);
    kmp_json_shorts(json, "position", count, p->room);
}

static double time_of(const picture *p, int frame)
{
    int row = row_index(p, frame);
    return p->at ? p->at[row] : kmp_samples_time(p->row, row);
}

/* Unevenly spaced times are listed. */
static void put_times(kmp_json *json, const picture *p)
{
    double begin = time_of(p, 0), range = time_of(p, p->frames - 1) - begin, off = 0;
    for (int f = 0; f < p->frames; f++)
        off = fmax(off, fabs(time_of(p, f) - begin - range * f / fmax(p->frames - 1, 1)));
    kmp_json_put(json, "t_start %.9g t_end %.9g", begin, begin + range);
    if (off <= 1e-3 * fabs(range) / p->frames)
        return;
    kmp_json_array(json, "t");
    for (int f = 0; f < p->frames; f++)
        kmp_json_rounded(json, NULL, time_of(p, f), 9);
    kmp_json_end(json);
}

/* -- drawn parts ------------------------------------------------------------------------------------- */

static void put_marks(kmp_json *json, const picture *p, int body)
{
    for (int k = 0; k < p->drawing.mark_count; k++) {
        const kmp_mark *m = &p->drawing.marks[k];
        if (m->body != body)
            continue;
        kmp_json_array(json, NULL);
        for (int i = 0; i < 3; i++)
            kmp_json_rounded(json, NULL, m->at[i], 7);
        kmp_json_whole(json, NULL, m->marks);
        kmp_json_string(json, NULL, m->name ? m->name : "");
        for (int i = 0; m->marks & KMP_MARK_HINGE && i < 3; i++)
            kmp_json_rounded(json, NULL, m->axis[i], 7);
        kmp_json_end(json);
    }
}

/* A guide has the length of its slider's motion. */
static void put_slides(kmp_json *json, const picture *p)
{
    kmp_json_array(json, "guides");
    for (int k = 0; k < p->drawing.slide_count; k++) {
        const kmp_picture_slide *slide = &p->drawing.slides[k];
        double range[2] = {INFINITY, -INFINITY};
        for (int f = 0; f < p->frames; f++) {
            range[0] = fmin(range[0], row_of(p, f)[slide->motion]);
            range[1] = fmax(range[1], row_of(p, f)[slide->motion]);
        }
        kmp_json_put(json, "{ body %d", slide->body);
        kmp_json_rounded_numbers(json, "at", 3, slide->at, 7);
        kmp_json_rounded_numbers(json, "axis", 3, slide->axis, 7);
        kmp_json_rounded_numbers(json, "range", 2, range, 7);
        kmp_json_whole(json, "slider", slide->slider);
        kmp_json_rounded_numbers(json, "end", 3, slide->end, 7);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

void kmp_motion_picture(kmp_json *json, const char *key, const kempe_model *model, const kmp_samples *row,
                        const double *at)
{
    picture p = {.model = model, .row = row, .at = at};
    const double gravity[3] = {model->gravity[0].value, model->gravity[1].value, model->gravity[2].value};
    if (!row || row->rows == 0) {
        kmp_json_string(json, key, NULL);
        return;
    }
    if (kmp_drawing_init(&p.drawing, model, MOST_BODIES) && make_frames(&p)) {
        kmp_json_object(json, key);
        kmp_json_whole(json, "of_bodies", model->body_count - 1);
        kmp_json_rounded_numbers(json, "gravity", 3, gravity, 7);
        kmp_json_array(json, "bodies");
        for (int b = 0; b < p.drawing.body_count; b++) {
            kmp_json_put(json, "{ name %s points [", p.model->bodies[b].name);
            put_marks(json, &p, b);
            kmp_json_end(json);
            kmp_drawn_shapes(json, p.model, b);
            kmp_json_end(json);
        }
        kmp_json_end(json);
        kmp_drawn_shapes_meshes(json, model);
        kmp_json_array(json, "lines");
        for (int k = 0; k < p.drawing.line_count; k++) {
            const kmp_line *line = &p.drawing.lines[k];
            kmp_json_put(json, "{ name %s rod %i body [", line->name ? line->name : "", p.drawing.is_rod[k]);
            for (int i = 0; i < 2; i++)
                kmp_json_whole(json, NULL, line->body[i]);
            kmp_json_put(json, "] at [");
            for (int i = 0; i < 2; i++)
                kmp_json_rounded_numbers(json, NULL, 3, line->at[i], 7);
            kmp_json_put(json, "] }");
        }
        kmp_json_end(json);
        put_slides(json, &p);
        kmp_railway_put(json, model, &(kmp_travel){p.frames, p.drawing.body_count - 1, p.position});
        size_t count = 4 * (size_t)p.frames * (size_t)(p.drawing.body_count - 1);
        kmp_json_put(json, "frames { count %d", p.frames);
        put_times(json, &p);
        put_positions(json, &p);
        for (size_t k = 0; k < count; k++)
            p.room[k] = (int16_t)lround(INT16_MAX * p.rotation[k]);
        kmp_json_shorts(json, "rotation", count, p.room);
        kmp_json_put(json, "} }");
    } else {
        json->text->failed = true;
    }
    kmp_drawing_free(&p.drawing);
    kmp_arena_free(&p.arena);
}
