/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames are 16-bit integers: positions within the box of all of them, and unit quaternions. A large mechanism has
 * fewer frames, the largest ones are drawn in part. All meshes of a page share a number of triangles, and larger ones
 * are thinned: their vertices are 16-bit integers within the box of their mesh. Rails are drawn over the range of the
 * wheels, and a little more. */
#include "picture/motion_picture.h"
#include "base/arena.h"
#include "base/base64.h"
#include "base/memory.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "model/data/body.h"
#include "model/data/cam.h"
#include "model/data/closure.h"
#include "model/data/force.h"
#include "model/data/mesh.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "model/data/pose.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"
#include "model/data/wheels.h"
#include "model/language/expression.h"
#include "model/write/model_print.h"
#include "picture/beam_stress.h"
#include "picture/drawing.h"
#include "picture/road_heights.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* -- thinning -------------------------------------------------------------------------------------------- */

/* Vertices in one cell of a grid become one (Rossignac, Borrel, Multi-resolution 3D approximations, 1993), at the place
 * with the least sum of squared distances from the planes of their triangles (Lindstrom, Out-of-core simplification of
 * large polygonal models, SIGGRAPH 2000), so that edges and flat faces are kept. The finest grid with few enough
 * triangles is found by bisection. */

enum { FINEST = 1024 };

/* A vertex stays near the mean of its cell in directions that no plane determines. */
#define TOWARDS_MEAN 1e-3

typedef struct cell {
    int count;
    double mean[3], a[6], b[3]; /* of the planes, from the mean: xx yy zz xy xz yz */
} cell;

typedef struct grid {
    const kmp_mesh *mesh;
    double low[3], side; /* of a cell */
    int *cell_of;        /* vertex */
    uint32_t slots, *key;
    int *slot;
    int cells, triangles;
} grid;

static const int entry_row[6] = {0, 1, 2, 0, 0, 1}, entry_column[6] = {0, 1, 2, 1, 2, 2};

/* Numbers the cells in the order of their vertices; a key has ten bits for each direction. */
static int number_of(grid *g, uint32_t key)
{
    uint32_t k = (key * 2654435761u) & (g->slots - 1);
    while (g->slot[k] >= 0 && g->key[k] != key)
        k = (k + 1) & (g->slots - 1);
    if (g->slot[k] < 0) {
        g->slot[k] = g->cells++;
        g->key[k] = key;
    }
    return g->slot[k];
}

static bool is_kept(const grid *g, const int *t)
{
    int a = g->cell_of[t[0]], b = g->cell_of[t[1]], c = g->cell_of[t[2]];
    return a != b && b != c && c != a;
}

/* Divides the longest side into this number of cells, and counts the triangles that stay. */
static void divide(grid *g, double longest, int parts)
{
    g->side = longest / parts;
    g->cells = g->triangles = 0;
    memset(g->slot, -1, g->slots * sizeof *g->slot);
    for (int k = 0; k < g->mesh->vertex_count; k++) {
        uint32_t key = 0;
        for (int i = 0; i < 3; i++) {
            double x = g->side > 0 ? (g->mesh->vertex[k][i] - g->low[i]) / g->side : 0;
            key = key << 10 | (uint32_t)fmin(x, parts - 1);
        }
        g->cell_of[k] = number_of(g, key);
    }
    for (int k = 0; k < g->mesh->triangle_count; k++)
        g->triangles += is_kept(g, g->mesh->triangle[k]);
}

/* -- vertices of cells --------------------------------------------------------------------------------- */

/* The plane of a triangle counts by the square of its area. */
static void add_plane(cell *c, const double *at, const double normal[3])
{
    double off = 0;
    for (int i = 0; i < 3; i++)
        off += normal[i] * (at[i] - c->mean[i]);
    for (int k = 0; k < 6; k++)
        c->a[k] += normal[entry_row[k]] * normal[entry_column[k]];
    for (int i = 0; i < 3; i++)
        c->b[i] += normal[i] * off;
}

static double determinant(const double x[3], const double y[3], const double z[3])
{
    return x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) + x[2] * (y[0] * z[1] - y[1] * z[0]);
}

/* Solves for the place, by Cramer's rule; far from its cell the mean is taken. */
static void settle(const grid *g, const cell *c, double at[3])
{
    double more = TOWARDS_MEAN * (c->a[0] + c->a[1] + c->a[2]) / 3, d[3], far = 0;
    double x[3] = {c->a[0] + more, c->a[3], c->a[4]}, y[3] = {c->a[3], c->a[1] + more, c->a[5]};
    double z[3] = {c->a[4], c->a[5], c->a[2] + more}, whole = determinant(x, y, z);
    d[0] = determinant(c->b, y, z) / whole;
    d[1] = determinant(x, c->b, z) / whole;
    d[2] = determinant(x, y, c->b) / whole;
    for (int i = 0; i < 3; i++)
        far = fmax(far, isfinite(d[i]) ? fabs(d[i]) : INFINITY);
    for (int i = 0; i < 3; i++)
        at[i] = c->mean[i] + (far <= g->side ? d[i] : 0);
}

static bool collect(const grid *g, kmp_arena *arena, kmp_mesh *thin)
{
    cell *cells = KMP_NEW(cell, g->cells);
    thin->vertex = kmp_arena_alloc(arena, (size_t)g->cells, sizeof *thin->vertex);
    thin->triangle = kmp_arena_alloc(arena, (size_t)g->triangles, sizeof *thin->triangle);
    thin->vertex_count = g->cells;
    thin->triangle_count = 0;
    if (cells && thin->vertex && thin->triangle) {
        for (int k = 0; k < g->mesh->vertex_count; k++) {
            cell *c = &cells[g->cell_of[k]];
            c->count++;
            for (int i = 0; i < 3; i++)
                c->mean[i] += (g->mesh->vertex[k][i] - c->mean[i]) / c->count;
        }
        for (int k = 0; k < g->mesh->triangle_count; k++) {
            const int *t = g->mesh->triangle[k];
            const double *p = g->mesh->vertex[t[0]], *q = g->mesh->vertex[t[1]], *s = g->mesh->vertex[t[2]];
            double normal[3];
            for (int i = 0; i < 3; i++) {
                int j = (i + 1) % 3, l = (i + 2) % 3;
                normal[i] = (q[j] - p[j]) * (s[l] - p[l]) - (q[l] - p[l]) * (s[j] - p[j]);
            }
            for (int i = 0; i < 3; i++)
                add_plane(&cells[g->cell_of[t[i]]], p, normal);
        }
        for (int k = 0; k < g->cells; k++)
            settle(g, &cells[k], thin->vertex[k]);
        for (int k = 0; k < g->mesh->triangle_count; k++)
            if (is_kept(g, g->mesh->triangle[k])) {
                int *to = thin->triangle[thin->triangle_count++];
                for (int i = 0; i < 3; i++)
                    to[i] = g->cell_of[g->mesh->triangle[k][i]];
            }
    }
    bool good = cells && thin->vertex && thin->triangle;
    kmp_free(cells);
    return good;
}

bool kmp_mesh_thin(kmp_arena *arena, const kmp_mesh *mesh, int most, kmp_mesh *thin)
{
    *thin = *mesh;
    if (mesh->triangle_count <= most)
        return true;
    grid g = {.mesh = mesh, .slots = 16, .cell_of = KMP_NEW(int, mesh->vertex_count)};
    while (g.slots < 2 * (uint32_t)mesh->vertex_count)
        g.slots *= 2;
    g.key = KMP_NEW(uint32_t, g.slots);
    g.slot = KMP_NEW(int, g.slots);
    bool good = g.cell_of && g.key && g.slot;
    double corner[3];
    kmp_mesh_box(mesh, g.low, corner);
    double longest = fmax(corner[0] - g.low[0], fmax(corner[1] - g.low[1], corner[2] - g.low[2]));
    int low = 1, high = FINEST; /* low has few enough */
    while (good && high - low > 1) {
        int middle = (low + high) / 2;
        divide(&g, longest, middle);
        if (g.triangles <= most)
            low = middle;
        else
            high = middle;
    }
    if (good) {
        divide(&g, longest, low);
        good = collect(&g, arena, thin);
    }
    kmp_free(g.cell_of);
    kmp_free(g.key);
    kmp_free(g.slot);
    return good;
}

enum { MOST_BODIES = 350, MOST_NUMBERS = 330000, BODY_NUMBERS = 7, PLACE_NUMBERS = 14 };

/* Largest rotation of a joint between two frames, and the excess that is accepted. Another limit applies to rotations
 * that move no visible point, such as the spin of a wheel, of which only the direction must be visible. */
#define FOLLOWED 0.35
#define SPARED   1.5
#define SPUN     1.2

/* Part of its length that the largest deformation of a flexible body is drawn with, and the part below which there is
 * none but rounding. */
#define SEEN    0.05
#define NOTHING 1e-9

typedef struct picture {
    const kempe_model *model;
    const kmp_samples *row;
    const double *at; /* of each row; NULL: its time */
    kmp_drawing drawing;
    int frames, stride; /* rows at this stride are frames, and the last row */
    kmp_pose *poses;
    int moving;                  /* bodies without the ground, and places of flexible bodies */
    double *position, *rotation; /* 3 and 4 a frame and one of these */
    double *shift, *turn;        /* 3 a frame and place each */
    double *stress;              /* one a frame and place */
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
    const kmp_body rigid = kmp_body_undeformed(model, body);
    measure(rigid.com, axis, &across, &away);
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
    return last && !motion->elastic && body->flexible == 0 && !body->turned && !body->reversed && body->to < 0 &&
           is_on_axis(model, motion->body, motion->axis);
}

double kmp_motion_picture_end(const kempe_model *model, const kmp_samples *row)
{
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

static int most_frames(int moving, int places)
{
    const int numbers = BODY_NUMBERS * moving + PLACE_NUMBERS * places;
    return numbers > 0 ? MOST_NUMBERS / numbers : MOST_NUMBERS;
}

int kmp_motion_picture_frames(const kempe_model *model)
{
    int moving = (model->body_count < MOST_BODIES ? model->body_count : MOST_BODIES) - 1;
    return most_frames(moving, kmp_drawing_most_places(model));
}

static bool make_frames(picture *p)
{
    const int bodies = p->drawing.body_count - 1, places = p->drawing.place_count, rows = p->row->rows;
    const ptrdiff_t moving = p->moving = bodies + places;
    int most = moving > 0 ? most_frames(bodies, places) : rows;
    p->stride = 1;
    while ((rows + p->stride - 2) / p->stride + 1 > most && p->stride < rows)
        p->stride++;
    p->frames = (rows + p->stride - 2) / p->stride + 1;
    if (!KMP_ARENA_MAKE(&p->arena, KMP_ROOM(kmp_pose, p->model->body_count + places, &p->poses),
                        KMP_ROOM(double, 3 * p->frames * moving, &p->position),
                        KMP_ROOM(double, 4 * p->frames * moving, &p->rotation),
                        KMP_ROOM(double, 3 * (ptrdiff_t)p->frames * places, &p->shift),
                        KMP_ROOM(double, 3 * (ptrdiff_t)p->frames * places, &p->turn),
                        KMP_ROOM(double, (ptrdiff_t)p->frames *places, &p->stress),
                        KMP_ROOM(int16_t, 4 * p->frames * moving, &p->room)))
        return false;
    for (ptrdiff_t f = 0; f < p->frames; f++) {
        kmp_drawing_poses(&p->drawing, p->model, row_of(p, (int)f), p->poses);
        kmp_drawing_deformation(&p->drawing, p->model, row_of(p, (int)f), p->poses, p->shift + 3 * f * places,
                                p->turn + 3 * f * places);
        kmp_drawing_stress(&p->drawing, p->model, row_of(p, (int)f), p->stress + f * places);
        for (int b = 0; b < moving; b++) {
            double *x = p->position + 3 * (f * moving + b), *r = p->rotation + 4 * (f * moving + b);
            memcpy(x, p->poses[b + 1].p, 3 * sizeof *x);
            kmp_pose_quaternion(&p->poses[b + 1], f > 0 ? r - 4 * moving : NULL, r);
        }
    }
    return true;
}

/* Places (count x 3) as 16-bit integers within the box of all of them, about its middle. */
static void put_places(kmp_json *json, const char *key, size_t count, const double *place, int16_t *room, int digits)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, middle[3] = {0};
    double unit = 0;
    for (size_t k = 0; k < 3 * count; k++) {
        low[k % 3] = fmin(low[k % 3], place[k]);
        high[k % 3] = fmax(high[k % 3], place[k]);
    }
    for (int i = 0; i < 3 && count > 0; i++) {
        middle[i] = low[i] + (high[i] - low[i]) / 2;
        unit = fmax(unit, (high[i] - low[i]) / 2 / INT16_MAX);
    }
    for (size_t k = 0; k < 3 * count; k++)
        room[k] = (int16_t)lround(unit > 0 ? (place[k] - middle[k % 3]) / unit : 0);
    kmp_json_rounded_numbers(json, "middle", 3, middle, digits);
    kmp_json_rounded(json, "unit", unit, digits);
    kmp_json_shorts(json, key, 3 * count, room);
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

/* -- shapes ------------------------------------------------------------------------------------------- */

enum { MOST_TRIANGLES = 16000, LEAST_TRIANGLES = 500 }; /* a page has at most some 200 kB of them */

static void put_solids(kmp_json *json, const kempe_model *model, int body)
{
    kmp_json_array(json, "solids");
    for (int k = 0; k < model->shape_count; k++)
        if (model->shapes[k].body == body) {
            kmp_json_put(json, "{ kind %s", kmp_shape_words[model->shapes[k].kind]);
            kmp_model_json_shape(json, &model->shapes[k]);
            kmp_json_end(json);
        }
    kmp_json_end(json);
}

/* -- meshes ------------------------------------------------------------------------------------------ */

/* The first shape of its mesh: several may have the same. */
static bool is_first_of_mesh(const kempe_model *model, int shape)
{
    for (int k = 0; k < shape; k++)
        if (model->shapes[k].mesh == model->shapes[shape].mesh)
            return false;
    return model->shapes[shape].mesh;
}

static void put_mesh(kmp_json *json, const kmp_mesh *mesh, int most)
{
    kmp_arena arena = {0};
    kmp_mesh thin;
    int16_t *points = NULL, *corners = NULL;
    bool good = kmp_mesh_thin(&arena, mesh, most, &thin) &&
                KMP_ARENA_MAKE(&arena, KMP_ROOM(int16_t, 3 * (ptrdiff_t)thin.vertex_count, &points),
                               KMP_ROOM(int16_t, 3 * (ptrdiff_t)thin.triangle_count, &corners));
    kmp_json_put(json, "{ file %s triangles %d", mesh->path, mesh->triangle_count);
    if (good) {
        kmp_json_whole(json, "drawn", thin.triangle_count);
        put_places(json, "points", (size_t)thin.vertex_count, thin.vertex[0], points, 9);
        /* Numbers up to 65,535, of which those above 32,767 are written as negative ones. */
        for (int k = 0; k < 3 * thin.triangle_count; k++)
            corners[k] = (int16_t)(uint16_t)thin.triangle[k / 3][k % 3];
        kmp_json_shorts(json, "corners", 3 * (size_t)thin.triangle_count, corners);
    }
    kmp_json_end(json);
    json->text->failed = json->text->failed || !good;
    kmp_arena_free(&arena);
}

static void put_meshes(kmp_json *json, const kempe_model *model)
{
    double all = 0;
    for (int k = 0; k < model->shape_count; k++)
        all += is_first_of_mesh(model, k) ? model->shapes[k].mesh->triangle_count : 0;
    kmp_json_array(json, "meshes");
    for (int k = 0; k < model->shape_count; k++)
        if (is_first_of_mesh(model, k)) {
            const kmp_mesh *mesh = model->shapes[k].mesh;
            put_mesh(json, mesh, (int)fmax(MOST_TRIANGLES * fmin(mesh->triangle_count / all, 1), LEAST_TRIANGLES));
        }
    kmp_json_end(json);
}

/* -- wheels and tracks -------------------------------------------------------------------------------- */

enum { COURSE_POINTS = 400, LOOKED_AT = 200 };

static double axis_at(const kmp_point *point, int i, int k)
{
    return point->turned ? point->axes[i][k] : i == k;
}

/* A wheel that turns about y of its point; `tyre`: the name of its tyre, or NULL. */
static void put_disc(kmp_json *json, const picture *p, int point, double radius, const char *tyre)
{
    const kmp_drawn_point at = kmp_drawing_point(&p->drawing, p->model, point);
    double axis[3];
    if (at.body < 0)
        return;
    for (int i = 0; i < 3; i++)
        axis[i] = axis_at(&p->model->points[point], i, 1);
    kmp_json_put(json, "{ body %d", at.body);
    kmp_json_rounded_numbers(json, "at", 3, at.at, 7);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    kmp_json_put(json, "radius %.7g", radius);
    if (tyre)
        kmp_json_string(json, "tyre", tyre);
    kmp_json_end(json);
}

/* -- gears ------------------------------------------------------------------------------------------- */

/* v of one body's axes in the axes of another one, at these poses. */
static void in_body(const kmp_pose *from, const kmp_pose *to, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = 0;
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 3; j++)
                out[i] += to->r[k][i] * from->r[k][j] * v[j];
    }
}

/* True if an earlier pair has the same wheel, as the sun of several planets. */
static bool is_drawn(const kempe_model *model, const kmp_closure *closure, int side)
{
    bool drawn = false;
    for (const kmp_closure *c = model->closures; c < closure; c++)
        for (int k = 0; c->gear && k < 2; k++)
            drawn = drawn || (c->gear->wheel[k] == closure->gear->wheel[side] &&
                              c->gear->centre[k] == closure->gear->centre[side] &&
                              c->gear->teeth[k] == closure->gear->teeth[side] && c->gear->teeth[k] > 0);
    return drawn;
}

/* The pitch circle of a wheel: about its centre, or where the axes are not parallel about the foot of the pitch point
 * on its axis. Wheels that are given by radii have marks as of a module of a twentieth of the smaller one. */
static void put_gear(kmp_json *json, const picture *p, const kmp_pose *poses, const kmp_closure *closure, int side,
                     const kmp_gear_numbers *mesh)
{
    const kmp_gear *gear = closure->gear;
    const int body = gear->wheel[side];
    const double least = gear->form == KMP_GEAR_RACK ? mesh->radius[0] : fmin(mesh->radius[0], mesh->radius[1]);
    const double teeth = gear->teeth[side] > 1 ? gear->teeth[side] : round(40 * mesh->radius[side] / least);
    double along = 0, at[3], axis[3], place[3] = {0};
    if (body >= p->drawing.body_count || is_drawn(p->model, closure, side))
        return;
    for (int i = 0; i < 3 && gear->form != KMP_GEAR_PARALLEL; i++)
        along += (mesh->pitch[i] - mesh->centre[side][i]) * mesh->axis[side][i];
    for (int i = 0; i < 3; i++) {
        at[i] = along * mesh->axis[side][i];
        place[i] = gear->centre[side] >= 0 ? p->model->points[gear->centre[side]].at[i].value : 0;
    }
    in_body(&poses[gear->carrier], &poses[body], at, axis);
    for (int i = 0; i < 3; i++)
        place[i] += axis[i];
    in_body(&poses[gear->carrier], &poses[body], mesh->axis[side], axis);
    kmp_json_put(json, "{ body %d", body);
    kmp_json_rounded_numbers(json, "at", 3, place, 7);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    kmp_json_put(json, "radius %.7g", mesh->radius[side]);
    if (side == 0 && gear->form == KMP_GEAR_WORM)
        kmp_json_put(json, "}");
    else
        kmp_json_put(json, "teeth %d ring %i }", (int)teeth, gear->ring == side);
}

/* All wheels of gears. */
static void put_gears(kmp_json *json, const picture *p)
{
    const kempe_model *model = p->model;
    kmp_arena room = {0};
    kmp_pose *poses = KMP_ARENA_NEW(&room, kmp_pose, model->body_count);
    const double *zero = KMP_ARENA_NEW(&room, double, model->motion_count + 1);
    if (poses && zero)
        kmp_pose_all(model, zero, poses);
    for (int c = 0; poses && zero && c < model->closure_count; c++) {
        kmp_gear_numbers mesh;
        const kmp_closure *closure = &model->closures[c];
        const bool known = closure->gear && kmp_gear_numbers_of(model, closure, &mesh);
        for (int side = 0; known && side < (closure->gear->form == KMP_GEAR_RACK ? 1 : 2); side++)
            put_gear(json, p, poses, closure, side, &mesh);
    }
    kmp_arena_free(&room);
}

/* -- ropes ------------------------------------------------------------------------------------------- */

/* In the axes of its body. */
static void sheave_axis(const kempe_model *model, const kmp_rope_place *place, double axis[3])
{
    for (int i = 0; i < 3; i++)
        axis[i] = axis_at(&model->points[place->point], i, place->axis);
}

/* Sheaves and drums. */
static void put_sheaves(kmp_json *json, const picture *p)
{
    const kempe_model *model = p->model;
    for (int r = 0; r < model->rope_count; r++)
        for (int k = 0; k < model->ropes[r].count; k++) {
            const kmp_rope_place *place = &model->ropes[r].places[k];
            const kmp_drawn_point at = kmp_drawing_point(&p->drawing, model, place->point);
            double axis[3];
            if (place->turn == 0 || place->ball || at.body < 0 || at.body >= p->drawing.body_count)
                continue;
            sheave_axis(model, place, axis);
            kmp_json_put(json, "{ body %d", at.body);
            kmp_json_rounded_numbers(json, "at", 3, at.at, 7);
            kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
            kmp_json_put(json, "radius %.7g sheave %i }", place->radius.value, 1);
        }
}

/* The number of the first drawn part of a rope. */
static int first_part(const kempe_model *model, int rope)
{
    kmp_rope part;
    int count = 0;
    for (int r = 0; r < rope; r++)
        for (int first = 0; kmp_rope_part(&model->ropes[r], &first, &part);)
            count++;
    return count;
}

/* The part of a belt that continues from the wheel with grip where a rope ends; -1: none does. Parts have the name of
 * their rope, and a number behind it. */
static int next_part(const kempe_model *model, const kmp_rope *rope)
{
    const kmp_rope_place *end = &rope->places[rope->count - 1];
    const char *number = strrchr(rope->name, '_');
    for (int r = 0; number && end->drum && r < model->rope_count; r++) {
        const kmp_rope *other = &model->ropes[r];
        const kmp_rope_place *begin = &other->places[0];
        if (begin->drum && begin->point == end->point && begin->turn == end->turn &&
            strncmp(other->name, rope->name, (size_t)(number - rope->name + 1)) == 0)
            return first_part(model, r);
    }
    return -1;
}

/* The places of a rope, none if a body of it is not drawn. */
static void put_path(kmp_json *json, const picture *p, const kmp_rope *rope)
{
    const kempe_model *model = p->model;
    bool drawn = true;
    for (int k = 0; k < rope->count; k++) {
        const kmp_drawn_point at = kmp_drawing_point(&p->drawing, model, rope->places[k].point);
        drawn = drawn && at.body >= 0 && at.body < p->drawing.body_count;
    }
    kmp_json_array(json, "places");
    for (int k = 0; drawn && k < rope->count; k++) {
        const kmp_rope_place *place = &rope->places[k];
        const kmp_drawn_point at = kmp_drawing_point(&p->drawing, model, place->point);
        kmp_json_put(json, "{ body %d", at.body);
        kmp_json_rounded_numbers(json, "at", 3, at.at, 7);
        kmp_json_put(json, "turn %d radius %.7g leaves %i wraps %i wrap %.7g", place->turn,
                     place->turn ? place->radius.value : 0, place->leaves, kmp_rope_wraps(rope, k),
                     kmp_rope_wraps(rope, k) ? place->wrap : 0);
        if (place->ball || place->helix)
            kmp_json_put(json, "%s 1", place->ball ? "ball" : "helix");
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void put_rope(kmp_json *json, const picture *p, const kmp_rope *rope)
{
    const kmp_rope_place *plane = &rope->places[rope->plane < 0 ? 0 : rope->plane];
    const kmp_drawn_point at = kmp_drawing_point(&p->drawing, p->model, plane->point);
    double axis[3] = {0, 0, 0};
    if (rope->plane >= 0)
        sheave_axis(p->model, plane, axis);
    kmp_json_put(json, "{ name %s closed %i next %d body %d", rope->name, rope->closed, next_part(p->model, rope),
                 at.body);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    put_path(json, p, rope);
    kmp_json_end(json);
}

static void put_ropes(kmp_json *json, const picture *p)
{
    kmp_rope part;
    if (p->model->rope_count == 0)
        return;
    kmp_json_array(json, "ropes");
    for (int r = 0; r < p->model->rope_count; r++)
        for (int first = 0; kmp_rope_part(&p->model->ropes[r], &first, &part);)
            put_rope(json, p, &part);
    kmp_json_end(json);
}

/* -- rails ------------------------------------------------------------------------------------------- */

/* A place in the axes of a point, in the axes of its body. */
static void to_body(const kempe_model *model, int point, const double place[3], double out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = model->points[point].at[i].value;
        for (int k = 0; k < 3; k++)
            out[i] += axis_at(&model->points[point], i, k) * place[k];
    }
}

/* A place of a rail in the axes of its track: x along, y left, z up from its beginning. */
static void rail_place(const kmp_track *track, double left, double s, double place[3])
{
    double heading = track->curved ? atan2(kmp_table_value(track->y, 1, s), kmp_table_value(track->x, 1, s)) : 0;
    double cant = track->curved && track->cant ? kmp_table_value(track->cant, 0, s) : 0;
    place[0] = (track->curved ? kmp_table_value(track->x, 0, s) : s) - left * cos(cant) * sin(heading);
    place[1] = (track->curved ? kmp_table_value(track->y, 0, s) : 0) + left * cos(cant) * cos(heading);
    place[2] = left * sin(cant);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/* The place of a wheel's body in the first frame; NULL: the wheel is on another track, or its body is not drawn. */
static const double *runner_of(const picture *p, int track, int w)
{
    const kmp_wheel *wheel = &p->model->wheels[w];
    int body = p->model->points[wheel->point].body;
    bool drawn = wheel->track == track && body > 0 && body < p->drawing.body_count;
    return drawn ? p->position + 3 * (ptrdiff_t)(body - 1) : NULL;
}

/* True if a body with a wheel on the track comes near a place of the ground. */
static bool is_run_on(const kempe_model *model, int track, const picture *p, const double place[3])
{
    ptrdiff_t stride = 1 + p->frames / LOOKED_AT, moving = p->moving;
    for (int w = 0; w < model->wheel_count; w++) {
        const double *at = runner_of(p, track, w);
        double near = 2 * model->tracks[track].gauge + 4 * model->wheels[w].radius.value;
        for (ptrdiff_t f = 0; at && f < p->frames; f += stride)
            if (distance(at + 3 * f * moving, place) < near)
                return true;
    }
    return false;
}

/* The range of bodies with a wheel on a straight track along it. */
static void straight_range(const kempe_model *model, int track, const picture *p, double range[2])
{
    const kmp_point *point = &model->points[model->tracks[track].point];
    for (int w = 0; w < model->wheel_count; w++) {
        const double *at = runner_of(p, track, w);
        double more = 3 * model->wheels[w].radius.value;
        for (int f = 0; at && f < p->frames; f++, at += 3 * (ptrdiff_t)p->moving) {
            double along = 0;
            for (int i = 0; i < 3; i++)
                along += axis_at(point, i, 0) * (at[i] - point->at[i].value);
            range[0] = fmin(range[0], along - more);
            range[1] = fmax(range[1], along + more);
        }
    }
}

static void put_rail(kmp_json *json, const kempe_model *model, int number, const picture *p, int side)
{
    const kmp_track *track = &model->tracks[number];
    double range[2] = {INFINITY, -INFINITY}, left = side == KMP_TRACK_LEFT ? track->rail_at : -track->rail_at;
    int points = track->curved ? COURSE_POINTS : 2;
    if (track->curved) {
        range[0] = -track->length / COURSE_POINTS;
        range[1] = track->length * (1 + 1.0 / COURSE_POINTS);
    } else
        straight_range(model, number, p, range);
    kmp_json_array(json, NULL);
    for (int k = 0; k < points && range[0] < range[1]; k++) {
        double place[3], at[3];
        rail_place(track, left, range[0] + (range[1] - range[0]) * k / (points - 1), place);
        to_body(model, track->point, place, at);
        if (!track->curved || is_run_on(model, number, p, at))
            kmp_json_rounded_numbers(json, NULL, 3, at, 7);
    }
    kmp_json_end(json);
}

static void put_railway(kmp_json *json, const picture *p)
{
    const kempe_model *model = p->model;
    kmp_json_array(json, "discs");
    for (int w = 0; w < model->wheel_count; w++)
        put_disc(json, p, model->wheels[w].point, model->wheels[w].radius.value, NULL);
    for (int w = 0; w < model->tyre_count; w++)
        put_disc(json, p, model->tyres[w].point, model->tyres[w].radius.value, model->tyres[w].name);
    put_gears(json, p);
    put_sheaves(json, p);
    kmp_json_put(json, "] rails [");
    for (int k = 0; k < model->track_count; k++)
        for (int side = 0; side < KMP_TRACK_SIDES; side++)
            put_rail(json, model, k, p, side);
    kmp_json_end(json);
}

/* -- surfaces ---------------------------------------------------------------------------------------- */

enum { CURVE_POINTS = 65, OUTLINE_STEPS = 8 /* by radian of an arc */ };

/* Opens a surface at a point. Points of flexible bodies that move in the axes of these have none. */
static bool begin_surface(kmp_json *json, const picture *p, const char *kind, const char *name, int point)
{
    const kmp_drawn_point at = kmp_drawing_point(&p->drawing, p->model, point);
    if (at.body < 0 || at.body >= p->drawing.body_count)
        return false;
    kmp_json_put(json, "{ kind %s name %s body %d", kind, name, at.body);
    kmp_json_rounded_numbers(json, "at", 3, at.at, 7);
    return true;
}

/* The curve y = table(x) in the axes of a point. */
static void put_table_curve(kmp_json *json, const picture *p, const char *name, int point, const kmp_table *table)
{
    if (!begin_surface(json, p, "curve", name, point))
        return;
    kmp_json_array(json, "points");
    for (int k = 0; k < CURVE_POINTS; k++) {
        const double x = table->x[0] + (table->x[table->count - 1] - table->x[0]) * k / (CURVE_POINTS - 1);
        double place[3] = {x, kmp_table_value(table, 0, x), 0}, out[3];
        to_body(p->model, point, place, out);
        kmp_json_rounded_numbers(json, NULL, 3, out, 7);
    }
    kmp_json_put(json, "] }");
}

static void put_place(kmp_json *json, const picture *p, int point, const double place[3])
{
    double out[3];
    to_body(p->model, point, place, out);
    kmp_json_rounded_numbers(json, NULL, 3, out, 7);
}

/* The axis along which a closed curve is extruded: it is filled. */
static void put_normal(kmp_json *json, const picture *p, int point)
{
    double axis[3];
    for (int i = 0; i < 3; i++)
        axis[i] = axis_at(&p->model->points[point], i, 2);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
}

/* An outline in the plane of a point; of copies that do not join each has its own curve. */
static void put_outline(kmp_json *json, const picture *p, const char *name, const kmp_outline *outline, int point)
{
    const bool joins = outline->closed && outline->shape == KMP_OUTLINE_PATH;
    const int last = outline->copies - 1;
    for (int copy = 0; copy < outline->copies; copy++) {
        if (copy == 0 || !joins) {
            if (!begin_surface(json, p, "curve", name, point))
                return;
            if (outline->closed && !outline->hollow)
                put_normal(json, p, point);
            kmp_json_array(json, "points");
        }
        for (int k = 0; k < outline->piece_count; k++) {
            const kmp_piece piece = kmp_piece_copy(outline, k, copy);
            const int steps = piece.arc && piece.radius > 0 ? 2 + (int)(OUTLINE_STEPS * fabs(piece.turn)) : 1;
            const bool ends = k == outline->piece_count - 1 && (copy == last || !joins);
            for (int i = 0; i < steps + ends; i++) {
                double place[3] = {0}, normal[2];
                kmp_piece_place(&piece, (double)i / steps, place, normal);
                put_place(json, p, point, place);
            }
        }
        if (copy == last || !joins)
            kmp_json_put(json, "] }");
    }
}

enum { CAM_PLACES = 180 };

/* The path of a roller's centre about its cam. */
static void put_pitch_curve(kmp_json *json, const picture *p, const char *name, int point,
                            const kmp_cam_follower *follower)
{
    if (follower->form != KMP_FOLLOWER_ROLLER || !follower->outline->cam ||
        !begin_surface(json, p, "pitch", name, point))
        return;
    kmp_json_array(json, "points");
    for (int k = 0; k <= CAM_PLACES; k++) {
        double place[3] = {0};
        kmp_cam_path_place(follower->outline->cam, follower, k, CAM_PLACES, place);
        put_place(json, p, point, place);
    }
    kmp_json_put(json, "] }");
}

/* The profile of a cam in the axes of a point. */
static void put_cam(kmp_json *json, const picture *p, const char *name, int point, const kmp_cam_follower *follower)
{
    put_pitch_curve(json, p, name, point, follower);
    if (!begin_surface(json, p, "curve", name, point))
        return;
    put_normal(json, p, point);
    kmp_json_array(json, "points");
    for (int k = 0; k <= CAM_PLACES; k++) {
        double place[3] = {0};
        kmp_outline_place(follower->outline, k, CAM_PLACES, place);
        put_place(json, p, point, place);
    }
    kmp_json_put(json, "] }");
}

/* An ideal follower: its cam, and its roller about the axis of the cam. */
static void put_follower(kmp_json *json, const picture *p, const kmp_closure *closure)
{
    const double axis[3] = {0, 0, 1};
    put_cam(json, p, closure->name, closure->point[0], closure->cam);
    if (closure->cam->form != KMP_FOLLOWER_ROLLER ||
        !begin_surface(json, p, "cylinder", closure->name, closure->point[1]))
        return;
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    kmp_json_put(json, "radius %.7g hollow %i }", closure->cam->radius, false);
}

static void put_side(kmp_json *json, const picture *p, const kmp_force *force, int k)
{
    static const char *const words[] = {"sphere", "cylinder", "plane", [KMP_TOUCH_FACE] = "plane"};
    const kmp_touch_side *side = &force->touch.side[k];
    double axis[3];
    if (side->shape == KMP_TOUCH_PROFILE) {
        put_table_curve(json, p, force->name, side->point, side->table->table);
        return;
    }
    if (side->shape == KMP_TOUCH_CAM) {
        put_cam(json, p, force->name, side->point, side->cam);
        return;
    }
    if ((side->shape != KMP_TOUCH_PLANE && side->shape != KMP_TOUCH_FACE && !(force->touch.radius[k].value > 0)) ||
        !begin_surface(json, p, words[side->shape], force->name, side->point))
        return;
    for (int i = 0; i < 3; i++)
        axis[i] = (side->against ? -1 : 1) * axis_at(&p->model->points[side->point], i, side->axis);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    kmp_json_put(json, "radius %.7g hollow %i }", force->touch.radius[k].value, side->hollow);
}

enum { ROAD_POINTS = 400 };

/* The range of the tyres of a road along one of its axes, and a little more. */
static void range_on_road(const picture *p, int road, int axis, double range[2])
{
    const kempe_model *model = p->model;
    const kmp_point *point = &model->points[model->roads[road].point];
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (int w = 0; w < model->tyre_count; w++) {
        const kmp_tyre *tyre = &model->tyres[w];
        const int body = model->points[tyre->point].body;
        const double more = (axis == model->roads[road].along ? 3 : 0.5) * tyre->radius.value;
        for (int f = 0; tyre->road == road && body > 0 && body < p->drawing.body_count && f < p->frames; f++) {
            const double *at = p->position + 3 * ((ptrdiff_t)f * p->moving + body - 1);
            double along = 0;
            for (int i = 0; i < 3; i++)
                along += axis_at(point, i, axis) * (at[i] - point->at[i].value);
            range[0] = fmin(range[0], along - more);
            range[1] = fmax(range[1], along + more);
        }
    }
}

/* A height, as a strip under the tyres. A road on a body that moves is not drawn. */
static void put_height(kmp_json *json, const picture *p, int number)
{
    const kmp_road *road = &p->model->roads[number];
    const int across = 3 - road->normal - road->along;
    double range[2], side[2], x[ROAD_POINTS], height[ROAD_POINTS];
    range_on_road(p, number, road->along, range);
    range_on_road(p, number, across, side);
    for (int k = 0; k < ROAD_POINTS; k++)
        x[k] = range[0] + (range[1] - range[0]) * k / (ROAD_POINTS - 1);
    if (!(range[0] < range[1]) || p->model->points[road->point].body > 0 ||
        !kmp_road_heights(p->model, road, ROAD_POINTS, x, height) ||
        !begin_surface(json, p, "strip", road->name, road->point))
        return;
    for (int edge = 0; edge < 2; edge++) {
        kmp_json_array(json, edge == 0 ? "points" : "others");
        for (int k = 0; k < ROAD_POINTS; k++) {
            double place[3], out[3];
            place[road->along] = x[k];
            place[road->normal] = height[k];
            place[across] = side[edge];
            to_body(p->model, road->point, place, out);
            kmp_json_rounded_numbers(json, NULL, 3, out, 6);
        }
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* A flat road as a plane, another one as a strip. */
static void put_road(kmp_json *json, const picture *p, int number)
{
    const kmp_road *road = &p->model->roads[number];
    const kmp_point *point = &p->model->points[road->point];
    double axis[3];
    if (road->height) {
        put_height(json, p, number);
        return;
    }
    if (!begin_surface(json, p, "plane", road->name, road->point))
        return;
    for (int i = 0; i < 3; i++)
        axis[i] = axis_at(point, i, road->normal);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    kmp_json_put(json, "radius %.7g hollow %i }", 0.0, false);
}

/* True if an earlier contact has the same outline at the same point: it is drawn. */
static bool has_outline(const kempe_model *model, int contact, int side)
{
    const kmp_outline_contact *of = &model->outline_contacts[contact];
    bool drawn = false;
    for (int c = 0; c <= contact; c++)
        for (int k = 0; k < (c < contact ? 2 : side); k++)
            drawn = drawn || (model->outline_contacts[c].outline[k] == of->outline[side] &&
                              model->outline_contacts[c].point[k] == of->point[side]);
    return drawn;
}

/* Of contacts both sides; of points on curves the curve of a table, or the point that runs along any other. */
static void put_surfaces(kmp_json *json, const picture *p)
{
    const kempe_model *model = p->model;
    kmp_json_array(json, "surfaces");
    for (int f = 0; f < model->force_count; f++) {
        const kmp_force *force = &model->forces[f];
        const kmp_touch_side *sides = force->touch.side;
        const bool touches = (force->kind == KMP_FORCE_TOUCH || force->kind == KMP_FORCE_COMPLIANT) && !sides[0].off &&
                             !sides[1].piece; /* sides with outlines are drawn below, once */
        for (int k = 0; k < 2 && touches && !force->touch.gap && force->touch.motion < 0; k++)
            put_side(json, p, force, k);
    }
    for (int k = 0; k < model->road_count; k++)
        put_road(json, p, k);
    for (int c = 0; c < model->outline_contact_count; c++) {
        const kmp_outline_contact *contact = &model->outline_contacts[c];
        const bool any = contact->outline[0] || contact->outline[1]; /* of friction none */
        for (int k = 0; k < 2 && any; k++)
            if (contact->outline[k] && has_outline(model, c, k))
                continue;
            else if (contact->outline[k])
                put_outline(json, p, contact->name, contact->outline[k], contact->point[k]);
            else
                put_side(json, p, &model->forces[contact->first], k);
    }
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        if (closure->cam)
            put_follower(json, p, closure);
        const kmp_drawn_point runner = closure->kind == KMP_CLOSURE_point_on_curve
                                           ? kmp_drawing_point(&p->drawing, model, closure->point[1])
                                           : (kmp_drawn_point){.body = -1};
        if (runner.body >= 0 && closure->table)
            put_table_curve(json, p, closure->name, closure->point[0], closure->table->table);
        else if (runner.body >= 0 && begin_surface(json, p, "path", closure->name, closure->point[0])) {
            kmp_json_put(json, "runner %d", runner.body);
            kmp_json_rounded_numbers(json, "end", 3, runner.at, 7);
            kmp_json_end(json);
        }
    }
    kmp_json_end(json);
}

/* -- drawn parts ------------------------------------------------------------------------------------- */

static void put_marks(kmp_json *json, const picture *p, int body)
{
    for (int k = 0; k < p->drawing.mark_count; k++) {
        const kmp_mark *m = &p->drawing.marks[k];
        if (m->body != body)
            continue;
        kmp_json_put(json, "[ %.7g %.7g %.7g %d %s", m->at[0], m->at[1], m->at[2], (int)m->marks,
                     m->name ? m->name : "");
        if (m->marks & KMP_MARK_HINGE)
            kmp_json_put(json, "%.7g %.7g %.7g", m->axis[0], m->axis[1], m->axis[2]);
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
        kmp_json_put(json, "range [ %.7g %.7g ] slider %d", range[0], range[1], slide->slider);
        kmp_json_rounded_numbers(json, "end", 3, slide->end, 7);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* -- flexible bodies --------------------------------------------------------------------------------- */

/* Places are listed as bodies after these, with the number of the body that they are on. */
static void put_drawn_places(kmp_json *json, const picture *p)
{
    for (int k = 0; k < p->drawing.place_count; k++) {
        const int body = p->drawing.places[k].body;
        kmp_json_put(json, "{ name %s of %d points [", p->model->bodies[body].name, body);
        put_marks(json, p, p->drawing.body_count + k);
        kmp_json_put(json, "] solids [ ] }");
    }
}

/* The factor of the deformation at first: 1, or one digit and zeros. */
static double choose_factor(const picture *p)
{
    double most = 0;
    for (ptrdiff_t k = 0; k < (ptrdiff_t)p->frames * p->drawing.place_count; k++) {
        const int body = p->drawing.places[k % p->drawing.place_count].body;
        const double *v = p->shift + 3 * k;
        most = fmax(most, sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) /
                              p->model->flexibles[p->model->bodies[body].flexible - 1].length->value);
    }
    if (!(most > NOTHING && most < SEEN))
        return 1;
    const double digit = pow(10, floor(log10(SEEN / most)));
    return floor(SEEN / most / digit) * digit;
}

/* Names of flexible bodies that are held, and of bodies with solids, which do not deform. */
static void put_names(kmp_json *json, const picture *p)
{
    kmp_json_array(json, "held");
    for (int b = 1; b < p->drawing.body_count; b++) {
        bool held = false; /* at a place other than its origin */
        for (int k = 0; k < p->drawing.place_count; k++)
            held = held || (p->drawing.places[k].body == b && p->drawing.places[k].held);
        if (held)
            kmp_json_string(json, NULL, p->model->bodies[b].name);
    }
    kmp_json_put(json, "] stiff [");
    for (int b = 1; b < p->drawing.body_count; b++) {
        bool stiff = false;
        for (int k = 0; p->model->bodies[b].flexible > 0 && k < p->model->shape_count; k++)
            stiff = stiff || p->model->shapes[k].body == b;
        if (stiff)
            kmp_json_string(json, NULL, p->model->bodies[b].name);
    }
    kmp_json_end(json);
}

/* Stresses as parts of the largest, and the names of bodies without any; -1: a place without. */
static void put_stress(kmp_json *json, const picture *p)
{
    const ptrdiff_t count = (ptrdiff_t)p->frames * p->drawing.place_count;
    double most = -1;
    for (ptrdiff_t k = 0; k < count; k++)
        most = fmax(most, p->stress[k]);
    for (ptrdiff_t k = 0; k < count; k++)
        p->room[k] = (int16_t)(p->stress[k] < 0 ? -1 : most > 0 ? lround(INT16_MAX * p->stress[k] / most) : 0);
    kmp_json_array(json, "plain");
    for (int b = 1; b < p->drawing.body_count; b++)
        if (p->model->bodies[b].flexible > 0 && !kmp_drawing_has_edges(&p->drawing, p->model, b))
            kmp_json_string(json, NULL, p->model->bodies[b].name);
    kmp_json_end(json);
    if (most < 0)
        return;
    kmp_json_put(json, "stress { most %.4g axial [", most);
    for (int b = 1; b < p->drawing.body_count; b++)
        if (kmp_drawing_lengthens(&p->drawing, p->model, b))
            kmp_json_string(json, NULL, p->model->bodies[b].name);
    kmp_json_end(json);
    kmp_json_shorts(json, "numbers", (size_t)count, p->room);
    kmp_json_end(json);
}

static void put_flexible(kmp_json *json, const picture *p)
{
    const size_t places = (size_t)p->frames * (size_t)p->drawing.place_count;
    if (p->model->flexible_count == 0)
        return;
    kmp_json_put(json, "flexible { factor %g", choose_factor(p));
    put_names(json, p);
    kmp_json_array(json, "parents");
    for (int b = 0; b < p->drawing.body_count; b++)
        kmp_json_whole(json, NULL, p->model->bodies[b].parent);
    kmp_json_put(json, "] riders [");
    for (int k = 0; k < p->drawing.rider_count; k++)
        kmp_json_put(json, "{ body %d place %d }", p->drawing.riders[k].body, p->drawing.riders[k].place);
    kmp_json_put(json, "] shift {");
    put_places(json, "numbers", places, p->shift, p->room, 7);
    kmp_json_put(json, "} turn {");
    put_places(json, "numbers", places, p->turn, p->room, 7);
    kmp_json_end(json);
    put_stress(json, p);
    kmp_json_end(json);
}

void kmp_motion_picture(kmp_json *json, const char *key, const kempe_model *model, const kmp_samples *row,
                        const double *at, const kmp_picture_forces *arrows)
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
            put_solids(json, p.model, b);
            kmp_json_end(json);
        }
        put_drawn_places(json, &p);
        kmp_json_end(json);
        put_meshes(json, model);
        kmp_json_array(json, "lines");
        for (int k = 0; k < p.drawing.line_count; k++) {
            const kmp_line *line = &p.drawing.lines[k];
            kmp_json_put(json, "{ name %s rod %i body [ %d %d ] at [", line->name ? line->name : "",
                         p.drawing.is_rod[k], line->body[0], line->body[1]);
            for (int i = 0; i < 2; i++)
                kmp_json_rounded_numbers(json, NULL, 3, line->at[i], 7);
            kmp_json_end(json);
            if (line->of > 0)
                kmp_json_whole(json, "of", line->of);
            kmp_json_end(json);
        }
        kmp_json_end(json);
        put_slides(json, &p);
        put_railway(json, &p);
        put_ropes(json, &p);
        put_surfaces(json, &p);
        put_flexible(json, &p);
        kmp_picture_forces_put(json, arrows, &p.drawing);
        size_t poses = (size_t)p.frames * (size_t)p.moving;
        kmp_json_put(json, "frames { count %d", p.frames);
        put_times(json, &p);
        put_places(json, "position", poses, p.position, p.room, 7);
        for (size_t k = 0; k < 4 * poses; k++)
            p.room[k] = (int16_t)lround(INT16_MAX * p.rotation[k]);
        kmp_json_shorts(json, "rotation", 4 * poses, p.room);
        kmp_json_put(json, "} }");
    } else {
        json->text->failed = true;
    }
    kmp_drawing_free(&p.drawing);
    kmp_arena_free(&p.arena);
}
