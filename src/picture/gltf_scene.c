/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving mechanism of a run as a binary file of glTF 2.0 (Khronos, 2021): a node for each body with its shape, and
 * an animation of all nodes by the rows of the run. Lengths are in metres, y is up: the root turns the ground so that
 * gravity acts against y. Bodies are nodes below the root, with poses in the axes of the ground. */
#include "picture/gltf_scene.h"
#include "base/file.h"
#include "base/json.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/data/shape.h"
#include "output/named_arrays.h"
#include "picture/drawing.h"
#include "studies/simulate/trajectory.h"
#include <float.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define PI     3.14159265358979323846
#define SIDES  32          /* of a circle */
#define THICK  0.006       /* radius of a bar, as a part of the size of the mechanism */
#define LEAST  1e-9        /* length of a line whose ends meet, m: a scale of zero has no direction */
#define GROUND 0x8a949a    /* its colour */
#define MAGIC  0x46546c67u /* "glTF" */
#define JSON   0x4e4f534au
#define BINARY 0x004e4942u

/* -- surfaces ---------------------------------------------------------------------------------------- */

typedef struct surface {
    double (*vertex)[3];
    int (*triangle)[3];
    int vertices, triangles;
    bool failed;
} surface;

static void surface_free(surface *s)
{
    kmp_free(s->vertex);
    kmp_free(s->triangle);
    *s = (surface){0};
}

/* A vertex in the axes of a frame; its number. */
static int put_vertex(surface *s, const kmp_pose *frame, double x, double y, double z)
{
    double(*room)[3] = s->failed ? NULL : kmp_list_room(s->vertex, (size_t)s->vertices, sizeof *room);
    s->failed = !room;
    if (!room)
        return 0;
    s->vertex = room;
    for (int i = 0; i < 3; i++)
        room[s->vertices][i] = frame->p[i] + frame->r[i][0] * x + frame->r[i][1] * y + frame->r[i][2] * z;
    return s->vertices++;
}

/* Counterclockwise from outside. */
static void put_triangle(surface *s, int a, int b, int c)
{
    int(*room)[3] = s->failed ? NULL : kmp_list_room(s->triangle, (size_t)s->triangles, sizeof *room);
    s->failed = !room;
    if (!room)
        return;
    s->triangle = room;
    room[s->triangles][0] = a;
    room[s->triangles][1] = b;
    room[s->triangles++][2] = c;
}

/* Points (radius, height) from the lower end of z to the upper one, turned about z; radius 0: a pole. */
static void revolve(surface *s, const kmp_pose *frame, int count, const double (*profile)[2])
{
    int below = 0;
    for (int k = 0; k < count; k++) {
        const double radius = profile[k][0], height = profile[k][1];
        const bool pole = !(radius > 0), tip = k > 0 && !(profile[k - 1][0] > 0);
        const int first = s->vertices;
        for (int i = 0; i < (pole ? 1 : SIDES); i++)
            (void)put_vertex(s, frame, radius * cos(2 * PI * i / SIDES), radius * sin(2 * PI * i / SIDES), height);
        for (int i = 0; k > 0 && i < SIDES; i++) {
            const int next = (i + 1) % SIDES, a = below + (tip ? 0 : i), b = below + (tip ? 0 : next);
            const int c = first + (pole ? 0 : i), d = first + (pole ? 0 : next);
            if (!tip)
                put_triangle(s, a, b, c);
            if (!pole)
                put_triangle(s, b, d, c);
        }
        below = first;
    }
}

static void put_cylinder(surface *s, const kmp_pose *frame, double radius, double half)
{
    const double profile[4][2] = {{0, -half}, {radius, -half}, {radius, half}, {0, half}};
    revolve(s, frame, 4, profile);
}

/* Half a sphere at each end of a cylinder, or of none. */
static void put_rounded(surface *s, const kmp_pose *frame, double radius, double half)
{
    enum { STEPS = SIDES / 4 };
    double profile[2 * STEPS + 2][2];
    int count = 0;
    for (int end = -1; end <= 1; end += 2)
        for (int k = 0; k <= STEPS; k++) {
            const double angle = PI / 2 * (end < 0 ? k : STEPS - k) / STEPS;
            if (end > 0 && k == 0 && !(half > 0))
                continue; /* the equator is there */
            profile[count][0] = angle > 0 ? radius * sin(angle) : 0;
            profile[count++][1] = end * (half + radius * cos(angle));
        }
    revolve(s, frame, count, (const double(*)[2])profile);
}

static void put_box(surface *s, const kmp_pose *frame, const double edge[3])
{
    static const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    const int first = s->vertices;
    for (int k = 0; k < 8; k++)
        (void)put_vertex(s, frame, (k & 1 ? 0.5 : -0.5) * edge[0], (k & 2 ? 0.5 : -0.5) * edge[1],
                         (k & 4 ? 0.5 : -0.5) * edge[2]);
    for (int k = 0; k < 6; k++) {
        put_triangle(s, first + faces[k][0], first + faces[k][1], first + faces[k][2]);
        put_triangle(s, first + faces[k][0], first + faces[k][2], first + faces[k][3]);
    }
}

/* Its axes are the columns; z is along a direction, which need not be a unit vector. */
static void aim(kmp_pose *frame, const double along[3])
{
    const double length = sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
    const double z[3] = {along[0] / length, along[1] / length, along[2] / length};
    const int least = fabs(z[0]) < 0.9 ? 0 : 1;
    double x[3], norm = sqrt(1 - z[least] * z[least]);
    for (int i = 0; i < 3; i++)
        x[i] = ((i == least) - z[least] * z[i]) / norm;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        frame->r[i][0] = x[i];
        frame->r[i][1] = z[j] * x[l] - z[l] * x[j];
        frame->r[i][2] = z[i];
    }
}

/* A bar with round ends; none between two places that are one. */
static void put_bar(surface *s, const double a[3], const double b[3], double radius)
{
    kmp_pose frame = {.p = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2}};
    const double along[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double length = sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
    if (!(length > 0))
        return;
    aim(&frame, along);
    put_rounded(s, &frame, radius, length / 2);
}

static void put_shape(surface *s, const kmp_shape *shape, double thick)
{
    kmp_pose frame = {0};
    double along[3], edge[3];
    for (int i = 0; i < 3; i++) {
        frame.p[i] = shape->at[i].value;
        along[i] = shape->along[i].value;
        edge[i] = shape->edge[i].value;
        for (int k = 0; k < 3; k++)
            frame.r[i][k] = shape->turned ? shape->axes[i][k] : i == k;
    }
    const double radius = shape->radius.value, half = shape->length.value / 2, scale = shape->scale.value;
    const int first = s->vertices;
    switch (shape->kind) {
    case KMP_SHAPE_BOX:
        put_box(s, &frame, edge);
        break;
    case KMP_SHAPE_SPHERE:
        put_rounded(s, &frame, radius, 0);
        break;
    case KMP_SHAPE_ELLIPSOID:
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                frame.r[i][k] *= edge[k];
        put_rounded(s, &frame, 1, 0);
        break;
    case KMP_SHAPE_CYLINDER:
        aim(&frame, along);
        put_cylinder(s, &frame, radius, half);
        break;
    case KMP_SHAPE_CAPSULE:
        aim(&frame, along);
        put_rounded(s, &frame, radius, half);
        break;
    case KMP_SHAPE_LINE:
        for (int k = 1; k < shape->through_count; k++) {
            const kmp_number *from = shape->through[k - 1], *to = shape->through[k];
            const double a[3] = {from[0].value, from[1].value, from[2].value};
            const double b[3] = {to[0].value, to[1].value, to[2].value};
            put_bar(s, a, b, radius > 0 ? radius : thick);
        }
        break;
    case KMP_SHAPE_MESH:
        for (int k = 0; k < shape->mesh->vertex_count; k++) {
            const double *v = shape->mesh->vertex[k];
            (void)put_vertex(s, &frame, scale * v[0], scale * v[1], scale * v[2]);
        }
        for (int k = 0; k < shape->mesh->triangle_count; k++) {
            const int *t = shape->mesh->triangle[k];
            put_triangle(s, first + t[0], first + t[1], first + t[2]);
        }
        break;
    case KMP_SHAPE_KINDS:
        break;
    }
}

static double squared_distance(const double a[3], const double b[3])
{
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

/* Bars between the marks of a body by its shortest tree (Prim 1957), or a ball where all are at one place. */
static void put_bars(surface *s, const kmp_drawing *drawing, int body, double thick)
{
    const int count = drawing->mark_count;
    double *away = KMP_NEW(double, count);
    int *from = KMP_NEW(int, count), last = -1;
    s->failed = s->failed || !away || !from;
    for (int k = 0; k < count && !s->failed; k++)
        away[k] = drawing->marks[k].body == body && drawing->marks[k].marks != KMP_MARK_COM ? INFINITY : -1;
    for (bool more = !s->failed; more;) {
        int next = -1;
        for (int k = 0; k < count; k++)
            if (away[k] >= 0 && (next < 0 || away[k] < away[next]))
                next = k;
        more = next >= 0;
        if (!more)
            break;
        if (last >= 0)
            put_bar(s, drawing->marks[from[next]].at, drawing->marks[next].at, thick);
        away[next] = -1;
        last = next;
        for (int k = 0; k < count; k++) {
            const double d = squared_distance(drawing->marks[k].at, drawing->marks[next].at);
            if (away[k] >= 0 && d < away[k]) {
                away[k] = d;
                from[k] = next;
            }
        }
    }
    kmp_pose ball = {.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (s->vertices == 0 && !s->failed) {
        if (last >= 0)
            memcpy(ball.p, drawing->marks[last].at, sizeof ball.p);
        put_rounded(s, &ball, 2 * thick, 0);
    }
    kmp_free(away);
    kmp_free(from);
}

/* The joints of the ground as cubes. */
static void put_supports(surface *s, const kmp_drawing *drawing, double thick)
{
    const double edge[3] = {4 * thick, 4 * thick, 4 * thick};
    for (int k = 0; k < drawing->mark_count; k++) {
        const kmp_mark *mark = &drawing->marks[k];
        kmp_pose frame = {.p = {mark->at[0], mark->at[1], mark->at[2]}, .r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        if (mark->body == 0 && mark->marks & (KMP_MARK_JOINT | KMP_MARK_CLOSURE | KMP_MARK_HINGE))
            put_box(s, &frame, edge);
    }
}

/* -- parts of the file ------------------------------------------------------------------------------------ */

typedef enum part { NODES, MESHES, MATERIALS, ACCESSORS, VIEWS, SAMPLERS, CHANNELS, PARTS } part;

typedef struct scene {
    const kempe_model *model;
    kmp_drawing drawing;
    double thick;
    int frames, bodies, lines;
    double *time, *position, *rotation; /* frames; frames x bodies x 3 and 4 */
    double *ends;                       /* frames x lines x 6 */
    kmp_arena arena;
    kmp_text text[PARTS], binary; /* arrays of JSON, and what their accessors are in */
    kmp_json json[PARTS];
    int count[PARTS];
} scene;

enum { FLOAT = 5126, UNSIGNED = 5125, VERTICES = 34962, INDICES = 34963 };

/* Numbers of the kind of an accessor, `width` at each of `count` places; its number. target 0: none. */
static int put_accessor(scene *s, const char *kind, int width, int component, int target, int count, const double *x)
{
    float low[4] = {FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX}, high[4] = {-FLT_MAX, -FLT_MAX, -FLT_MAX, -FLT_MAX};
    const size_t begin = s->binary.length;
    for (ptrdiff_t k = 0; k < (ptrdiff_t)count * width; k++) {
        const float value = (float)x[k];
        uint32_t bits = (uint32_t)x[k];
        if (component == FLOAT)
            memcpy(&bits, &value, sizeof bits);
        kmp_put_integer(&s->binary, bits, 4);
        low[k % width] = fminf(low[k % width], value);
        high[k % width] = fmaxf(high[k % width], value);
    }
    kmp_json *view = &s->json[VIEWS], *accessor = &s->json[ACCESSORS];
    kmp_json_put(view, "{ buffer %d byteOffset %ld byteLength %ld", 0, (long)begin, (long)(s->binary.length - begin));
    if (target)
        kmp_json_whole(view, "target", target);
    kmp_json_end(view);
    kmp_json_put(accessor, "{ bufferView %d componentType %d count %d type %s", s->count[VIEWS]++, component, count,
                 kind);
    if (component == FLOAT)
        for (int side = 0; side < 2; side++) {
            kmp_json_array(accessor, side == 0 ? "min" : "max");
            for (int i = 0; i < width; i++)
                kmp_json_rounded(accessor, NULL, (double)(side == 0 ? low : high)[i], 9);
            kmp_json_end(accessor);
        }
    kmp_json_end(accessor);
    return s->count[ACCESSORS]++;
}

/* Of glTF in linear light; the table has sRGB (IEC 61966-2-1). */
static double linear(int byte)
{
    const double c = byte / 255.0;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static int put_material(scene *s, int colour, double opacity)
{
    kmp_json *json = &s->json[MATERIALS];
    kmp_json_put(json, "{ pbrMetallicRoughness { baseColorFactor [");
    for (int k = 16; k >= 0; k -= 8)
        kmp_json_rounded(json, NULL, linear(colour >> k & 255), 4);
    kmp_json_put(json, "%g ] metallicFactor %g roughnessFactor %g }", opacity, 0.0, 0.6);
    if (opacity < 1)
        kmp_json_put(json, "alphaMode %s", "BLEND");
    kmp_json_end(json);
    return s->count[MATERIALS]++;
}

/* A part of the mesh that is open; frees the surface. */
static void put_primitive(scene *s, surface *of, int colour, double opacity)
{
    double *corner = KMP_NEW(double, 3 * (ptrdiff_t)of->triangles);
    s->binary.failed = s->binary.failed || of->failed || !corner;
    if (!s->binary.failed && of->triangles > 0) {
        for (ptrdiff_t k = 0; k < of->triangles; k++)
            for (int i = 0; i < 3; i++)
                corner[3 * k + i] = of->triangle[k][i];
        const int places = put_accessor(s, "VEC3", 3, FLOAT, VERTICES, of->vertices, of->vertex[0]);
        const int corners = put_accessor(s, "SCALAR", 1, UNSIGNED, INDICES, 3 * of->triangles, corner);
        kmp_json_put(&s->json[MESHES], "{ attributes { POSITION %d } indices %d material %d }", places, corners,
                     put_material(s, colour, opacity));
    }
    kmp_free(corner);
    surface_free(of);
}

static int colour_of_body(int body)
{
    static const char *const colours[] = {
#define KMP_PLOT_COLOUR(light, dark) light,
#include "output/plot_colours.def"
#undef KMP_PLOT_COLOUR
    };
    const int count = (int)(sizeof colours / sizeof *colours);
    return body > 0 ? kmp_colour_find(colours[(body - 1) % count]) : GROUND;
}

/* The mesh of a body, its number; -1: nothing of it is drawn. Holes are left out. */
static int put_body_mesh(scene *s, int body)
{
    const kempe_model *model = s->model;
    surface own = {0};
    kmp_json *json = &s->json[MESHES];
    int solids = 0;
    for (int k = 0; k < model->shape_count; k++)
        solids += model->shapes[k].body == body && !model->shapes[k].hole;
    if (solids == 0 && body > 0)
        put_bars(&own, &s->drawing, body, s->thick);
    else if (solids == 0)
        put_supports(&own, &s->drawing, s->thick);
    if (solids == 0 && own.triangles == 0) {
        s->binary.failed = s->binary.failed || own.failed;
        surface_free(&own);
        return -1;
    }
    kmp_json_put(json, "{ name %s primitives [", model->bodies[body].name);
    put_primitive(s, &own, colour_of_body(body), 1);
    for (int k = 0; k < model->shape_count; k++) {
        const kmp_shape *shape = &model->shapes[k];
        if (shape->body != body || shape->hole)
            continue;
        put_shape(&own, shape, s->thick);
        put_primitive(s, &own, shape->colour >= 0 ? shape->colour : colour_of_body(body), shape->opacity);
    }
    kmp_json_put(json, "] }");
    return s->count[MESHES]++;
}

/* -- motion ----------------------------------------------------------------------------------------------- */

/* A channel of a node, unless it stays as it is at first; values: a row of `width` for each frame. */
static void put_channel(scene *s, int node, const char *path, const char *kind, int width, const double *values)
{
    bool moves = false;
    for (ptrdiff_t k = width; k < (ptrdiff_t)s->frames * width; k++)
        moves = moves || (float)values[k] != (float)values[k % width];
    if (!moves)
        return;
    kmp_json_put(&s->json[SAMPLERS], "{ input %d output %d interpolation %s }", 0,
                 put_accessor(s, kind, width, FLOAT, 0, s->frames, values), "LINEAR");
    kmp_json_put(&s->json[CHANNELS], "{ sampler %d target { node %d path %s } }", s->count[SAMPLERS]++, node, path);
}

static void put_body(scene *s, int body)
{
    const double *position = s->position + 3 * (ptrdiff_t)body * s->frames;
    const double *rotation = s->rotation + 4 * (ptrdiff_t)body * s->frames;
    const int mesh = put_body_mesh(s, body);
    kmp_json *json = &s->json[NODES];
    kmp_json_put(json, "{ name %s", s->model->bodies[body].name);
    if (mesh >= 0)
        kmp_json_whole(json, "mesh", mesh);
    kmp_json_rounded_numbers(json, "translation", 3, position, 9);
    kmp_json_rounded_numbers(json, "rotation", 4, rotation, 9);
    kmp_json_end(json);
    put_channel(s, s->count[NODES], "translation", "VEC3", 3, position);
    put_channel(s, s->count[NODES]++, "rotation", "VEC4", 4, rotation);
}

/* The rotation of y to a direction, of the two quaternions the one nearer to `near`. */
static void turn_y(const double along[3], double length, const double *near, double out[4])
{
    const double x = along[0] / length, y = along[1] / length, z = along[2] / length;
    double q[4] = {z, 0, -x, 1 + y}, norm = sqrt(z * z + x * x + (1 + y) * (1 + y)), sign = 1;
    if (!(norm > 1e-6)) {
        q[0] = norm = 1;
        q[2] = q[3] = 0;
    }
    if (near)
        sign = near[0] * q[0] + near[2] * q[2] + near[3] * q[3] < 0 ? -1 : 1;
    for (int i = 0; i < 4; i++)
        out[i] = sign * q[i] / norm;
}

/* A spring, a rod or a rope between two points: a cylinder of length 1 along y, which is moved, turned and stretched.
 */
static void put_line(scene *s, int line, double *room)
{
    double *at = room, *turn = room + 3 * s->frames, *stretch = room + 7 * s->frames;
    const kmp_pose frame = {.p = {0, 0.5, 0}, .r = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}};
    surface own = {0};
    for (int f = 0; f < s->frames; f++) {
        const double *ends = s->ends + 6 * ((ptrdiff_t)f * s->lines + line);
        const double along[3] = {ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]};
        const double length = fmax(sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]), LEAST);
        memcpy(at + 3 * f, ends, 3 * sizeof *ends);
        turn_y(along, length, f > 0 ? turn + 4 * (f - 1) : NULL, turn + 4 * f);
        stretch[3 * f] = stretch[3 * f + 2] = 1;
        stretch[3 * f + 1] = length;
    }
    const char *name = s->drawing.lines[line].name ? s->drawing.lines[line].name : "line";
    put_cylinder(&own, &frame, (s->drawing.is_rod[line] ? 0.7 : 0.4) * s->thick, 0.5);
    kmp_json_put(&s->json[MESHES], "{ name %s primitives [", name);
    put_primitive(s, &own, GROUND, 1);
    kmp_json_put(&s->json[MESHES], "] }");
    kmp_json *json = &s->json[NODES];
    kmp_json_put(json, "{ name %s mesh %d", name, s->count[MESHES]++);
    kmp_json_rounded_numbers(json, "translation", 3, at, 9);
    kmp_json_rounded_numbers(json, "rotation", 4, turn, 9);
    kmp_json_rounded_numbers(json, "scale", 3, stretch, 9);
    kmp_json_end(json);
    put_channel(s, s->count[NODES], "translation", "VEC3", 3, at);
    put_channel(s, s->count[NODES], "rotation", "VEC4", 4, turn);
    put_channel(s, s->count[NODES]++, "scale", "VEC3", 3, stretch);
}

/* The root: gravity acts against y. A model without gravity keeps its axes. */
static void put_root(scene *s)
{
    double up[3], length = 0, turn[4] = {0, 0, 0, 1};
    for (int i = 0; i < 3; i++) {
        up[i] = -s->model->gravity[i].value;
        length += up[i] * up[i];
    }
    if (length > 0)
        turn_y(up, sqrt(length), NULL, turn);
    for (int i = 0; i < 3; i++)
        turn[i] = -turn[i]; /* back from that direction to y */
    kmp_json *json = &s->json[NODES];
    kmp_json_put(json, "{ name %s", s->model->name);
    kmp_json_rounded_numbers(json, "rotation", 4, turn, 9);
    kmp_json_array(json, "children");
    for (int k = 0; k < s->bodies + s->lines; k++)
        kmp_json_whole(json, NULL, 1 + k);
    kmp_json_put(json, "] }");
    s->count[NODES]++;
}

/* -- frames ----------------------------------------------------------------------------------------------- */

static void to_ground(const kmp_pose *pose, const double at[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = pose->p[i] + pose->r[i][0] * at[0] + pose->r[i][1] * at[1] + pose->r[i][2] * at[2];
}

/* The longest edge of the box of all marks. */
static double size_of(const scene *s, const kmp_pose *poses)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0, at[3];
    for (int k = 0; k < s->drawing.mark_count; k++) {
        to_ground(&poses[s->drawing.marks[k].body], s->drawing.marks[k].at, at);
        for (int i = 0; i < 3; i++) {
            low[i] = fmin(low[i], at[i]);
            high[i] = fmax(high[i], at[i]);
            size = fmax(size, high[i] - low[i]);
        }
    }
    return size > 0 ? size : 1;
}

/* Times of single precision ascend: of rows at one time the first is a frame. */
static bool make_frames(scene *s, const kmp_samples *rows)
{
    kmp_pose *poses = NULL;
    const ptrdiff_t most = rows->rows;
    s->bodies = s->model->body_count;
    s->lines = s->drawing.line_count;
    if (!KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, most, &s->time), KMP_ROOM(kmp_pose, s->bodies, &poses)))
        return false;
    for (int k = 0; k < rows->rows; k++)
        if (s->frames == 0 || (float)kmp_samples_time(rows, k) > (float)s->time[s->frames - 1])
            s->time[s->frames++] = kmp_samples_time(rows, k);
    if (!KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, 3 * (ptrdiff_t)s->frames * s->bodies, &s->position),
                        KMP_ROOM(double, 4 * (ptrdiff_t)s->frames * s->bodies, &s->rotation),
                        KMP_ROOM(double, 6 * (ptrdiff_t)s->frames * s->lines, &s->ends)))
        return false;
    for (int k = 0, f = 0; k < rows->rows && f < s->frames; k++) {
        if (kmp_samples_time(rows, k) != s->time[f])
            continue;
        kmp_pose_all(s->model, kmp_samples_get(rows, KMP_QUANTITY_Q, k), poses);
        if (f == 0)
            s->thick = THICK * size_of(s, poses);
        for (int b = 0; b < s->bodies; b++) {
            const ptrdiff_t place = (ptrdiff_t)b * s->frames + f;
            memcpy(s->position + 3 * place, poses[b].p, sizeof poses[b].p);
            kmp_pose_quaternion(&poses[b], f > 0 ? s->rotation + 4 * (place - 1) : NULL, s->rotation + 4 * place);
        }
        for (int l = 0; l < s->lines; l++)
            for (int end = 0; end < 2; end++)
                to_ground(&poses[s->drawing.lines[l].body[end]], s->drawing.lines[l].at[end],
                          s->ends + 6 * ((ptrdiff_t)f * s->lines + l) + 3 * end);
        f++;
    }
    return true;
}

/* -- the file --------------------------------------------------------------------------------------------- */

static void put_chunk(kmp_text *file, uint32_t kind, kmp_text *content, char fill)
{
    while (content->length % 4 && !content->failed)
        kmp_text_append(content, &fill, 1);
    kmp_put_integer(file, content->length, 4);
    kmp_put_integer(file, kind, 4);
    if (content->s)
        kmp_text_append(file, content->s, content->length);
    file->failed = file->failed || content->failed;
}

/* Joins the parts, of which empty ones are left out, and empties them. */
static void put_document(scene *s, kmp_text *document)
{
    static const char *const names[] = {"nodes", "meshes", "materials", "accessors", "bufferViews"};
    kmp_text_printf(document,
                    "{\"asset\":{\"version\":\"2.0\",\"generator\":\"Kempe " KEMPE_VERSION "\"},\"scene\":0,"
                    "\"scenes\":[{\"nodes\":[0]}],\"buffers\":[{\"byteLength\":%zu}]",
                    s->binary.length);
    for (part k = NODES; k < PARTS; k++) {
        kmp_json_end(&s->json[k]);
        s->binary.failed = s->binary.failed || s->text[k].failed;
    }
    for (part k = NODES; k <= VIEWS && !s->binary.failed; k++)
        if (s->count[k] > 0)
            kmp_text_printf(document, ",\"%s\":%s", names[k], s->text[k].s);
    if (s->count[SAMPLERS] > 0 && !s->binary.failed)
        kmp_text_printf(document, ",\"animations\":[{\"name\":\"motion\",\"samplers\":%s,\"channels\":%s}]",
                        s->text[SAMPLERS].s, s->text[CHANNELS].s);
    kmp_text_put(document, "}");
    for (part k = NODES; k < PARTS; k++)
        kmp_text_free(&s->text[k]);
}

static kempe_status write_scene(scene *s, kempe_context *context, const char *path)
{
    kmp_text document = {0}, file = {0};
    double *room = KMP_ARENA_NEW(&s->arena, double, 10 * (ptrdiff_t)s->frames);
    KMP_TRY(kmp_made(context, room));
    for (part k = NODES; k < PARTS; k++) {
        s->json[k] = kmp_json_begin_as(&s->text[k], KMP_JSON_COMPACT);
        kmp_json_array(&s->json[k], NULL);
    }
    (void)put_accessor(s, "SCALAR", 1, FLOAT, 0, s->frames, s->time); /* the input of all samplers */
    put_root(s);
    for (int b = 0; b < s->bodies; b++)
        put_body(s, b);
    for (int l = 0; l < s->lines; l++)
        put_line(s, l, room);
    put_document(s, &document);
    kempe_status status = KEMPE_OK;
    if (s->binary.length > UINT32_MAX / 2)
        status = kmp_fail(context, KEMPE_E_ARGUMENT,
                          "the animation has %zu bytes, more than a file of glTF holds: write fewer rows by a larger "
                          "output step",
                          s->binary.length);
    if (status == KEMPE_OK) {
        kmp_text chunks = {0};
        put_chunk(&chunks, JSON, &document, ' ');
        put_chunk(&chunks, BINARY, &s->binary, '\0');
        kmp_put_integer(&file, MAGIC, 4);
        kmp_put_integer(&file, 2, 4);
        kmp_put_integer(&file, 12 + chunks.length, 4);
        if (chunks.s)
            kmp_text_append(&file, chunks.s, chunks.length);
        kmp_text_free_part(&file, &chunks);
        status = kmp_file_write(context, path, &file);
    }
    kmp_text_free(&document);
    kmp_text_free(&s->binary);
    return status;
}

kempe_status kmp_gltf_write(const kempe_trajectory *trajectory, const char *path)
{
    kempe_context *context = trajectory->system->context;
    const kempe_model *model = trajectory->system->model;
    if (model->flexible_count > 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "body '%s' is flexible: an animation of glTF has only rigid bodies; write a report page, which "
                        "shows its deformation",
                        model->bodies[model->flexibles[0].body].name);
    scene s = {.model = model};
    kempe_status status = kmp_drawing_init(&s.drawing, model, model->body_count) && make_frames(&s, &trajectory->table)
                              ? write_scene(&s, context, path)
                              : kmp_fail_memory(context);
    kmp_drawing_free(&s.drawing);
    kmp_arena_free(&s.arena);
    return status;
}
