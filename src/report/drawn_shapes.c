/* SPDX-License-Identifier: BSD-3-Clause */
/* All meshes of a page share a number of triangles; larger ones are thinned. Vertices are 16-bit integers within the
 * box of their mesh. */
#include "report/drawn_shapes.h"
#include "model/print/model_print.h"
#include "report/thin_mesh.h"
#include <math.h>

enum { MOST_TRIANGLES = 16000, LEAST_TRIANGLES = 500 }; /* a page has at most some 200 kB of them */

void kmp_drawn_shapes(kmp_json *json, const kempe_model *model, int body)
{
    int count = 0;
    for (int k = 0; k < model->shape_count; k++) {
        if (model->shapes[k].body != body)
            continue;
        if (count++ == 0)
            kmp_json_array(json, "solids");
        kmp_json_put(json, "{ kind %s", kmp_shape_words[model->shapes[k].kind]);
        kmp_model_json_shape(json, &model->shapes[k]);
        kmp_json_end(json);
    }
    if (count > 0)
        kmp_json_end(json);
}

/* -- meshes ------------------------------------------------------------------------------------------ */

/* The first shape of its mesh: several may have the same. */
static bool is_first(const kempe_model *model, int shape)
{
    for (int k = 0; k < shape; k++)
        if (model->shapes[k].mesh == model->shapes[shape].mesh)
            return false;
    return model->shapes[shape].mesh;
}

static void put_points(kmp_json *json, kmp_arena *arena, const kmp_mesh *mesh)
{
    int16_t *room = KMP_ARENA_NEW(arena, int16_t, 3 * (size_t)mesh->vertex_count);
    double low[3], high[3], middle[3], unit = 0;
    kmp_mesh_box(mesh, low, high);
    for (int i = 0; i < 3; i++) {
        middle[i] = low[i] + (high[i] - low[i]) / 2;
        unit = fmax(unit, (high[i] - low[i]) / 2 / INT16_MAX);
    }
    for (int k = 0; room && k < 3 * mesh->vertex_count; k++)
        room[k] = (int16_t)lround(unit > 0 ? (mesh->vertex[k / 3][k % 3] - middle[k % 3]) / unit : 0);
    kmp_json_rounded_numbers(json, "middle", 3, middle, 9);
    kmp_json_rounded(json, "unit", unit, 9);
    if (room)
        kmp_json_shorts(json, "points", 3 * (size_t)mesh->vertex_count, room);
}

static void put_mesh(kmp_json *json, const kmp_mesh *mesh, int most)
{
    kmp_arena arena = {0};
    kmp_mesh thin;
    bool good = kmp_mesh_thin(&arena, mesh, most, &thin);
    kmp_json_put(json, "{ file %s triangles %d", mesh->path, mesh->triangle_count);
    if (good) {
        kmp_json_whole(json, "drawn", thin.triangle_count);
        put_points(json, &arena, &thin);
        /* Numbers up to 65,535, of which those above 32,767 are written as negative ones. */
        int16_t *room = KMP_ARENA_NEW(&arena, int16_t, 3 * (size_t)thin.triangle_count);
        for (int k = 0; room && k < 3 * thin.triangle_count; k++)
            room[k] = (int16_t)(uint16_t)thin.triangle[k / 3][k % 3];
        if (room)
            kmp_json_shorts(json, "corners", 3 * (size_t)thin.triangle_count, room);
    }
    kmp_json_end(json);
    json->text->failed = json->text->failed || !good || arena.failed;
    kmp_arena_free(&arena);
}

void kmp_drawn_shapes_meshes(kmp_json *json, const kempe_model *model)
{
    double all = 0;
    for (int k = 0; k < model->shape_count; k++)
        all += is_first(model, k) ? model->shapes[k].mesh->triangle_count : 0;
    if (all == 0)
        return;
    kmp_json_array(json, "meshes");
    for (int k = 0; k < model->shape_count; k++)
        if (is_first(model, k)) {
            const kmp_mesh *mesh = model->shapes[k].mesh;
            put_mesh(json, mesh, (int)fmax(MOST_TRIANGLES * fmin(mesh->triangle_count / all, 1), LEAST_TRIANGLES));
        }
    kmp_json_end(json);
}
