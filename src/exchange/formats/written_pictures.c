/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes and points of bodies, for the writers of foreign formats. */
#include "exchange/formats/written_pictures.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/written_tree.h"
#include "model/data/model.h"
#include "model/read/read_values.h"
#include <string.h>

/* -- shapes -------------------------------------------------------------------------------------------- */

static void put_size(const kmp_shape *shape, kmp_writer_shape *out)
{
    bool three = shape->kind == KMP_SHAPE_BOX || shape->kind == KMP_SHAPE_ELLIPSOID;
    for (int k = 0; k < 3; k++)
        out->size[k] = shape->kind == KMP_SHAPE_MESH ? shape->scale.value
                       : three                       ? shape->edge[k].value
                       : k == 0                      ? shape->radius.value
                       : k == 1                      ? shape->length.value
                                                     : 0;
}

bool kmp_export_shape(kmp_export *w, int shape, int link, const int *known, kmp_writer_shape *out)
{
    const kmp_shape *s = &w->model->shapes[shape];
    if (s->body != w->links[link].body)
        return false;
    while (*known >= 0 && *known != (int)s->kind)
        known++;
    if (*known < 0)
        return false;
    kmp_pose at = kmp_frame_none();
    double along[3];
    for (int k = 0; k < 3; k++) {
        at.p[k] = s->at[k].value;
        along[k] = s->along[k].value;
    }
    if (s->kind == KMP_SHAPE_CYLINDER || s->kind == KMP_SHAPE_CAPSULE)
        kmp_complete_axes(2, along, at.r);
    else if (s->turned)
        memcpy(at.r, s->axes, sizeof at.r);
    *out = (kmp_writer_shape){.kind = s->kind,
                              .at = kmp_frame_in(&w->in_link[s->body], &at),
                              .mesh = s->mesh ? s->mesh->path : NULL,
                              .coloured = s->colour >= 0};
    put_size(s, out);
    for (int k = 0; k < 3 && out->coloured; k++)
        out->rgba[k] = (double)(s->colour >> (16 - 8 * k) & 255) / 255;
    out->rgba[3] = s->opacity;
    w->drawn++;
    return true;
}

void kmp_export_text(kmp_text *text, const char *s)
{
    static const char *const signs[] = {"&&amp;", "<&lt;", ">&gt;", "\"&quot;"};
    for (; *s; s++) {
        size_t k = 0;
        while (k < sizeof signs / sizeof *signs && signs[k][0] != *s)
            k++;
        if (k < sizeof signs / sizeof *signs)
            kmp_text_put(text, signs[k] + 1);
        else
            kmp_text_printf(text, "%c", *s);
    }
}

/* -- points -------------------------------------------------------------------------------------------- */

static bool is_end(const kempe_model *model, int point)
{
    for (int b = 1; b < model->body_count; b++)
        if (model->bodies[b].at == point || model->bodies[b].to == point)
            return true;
    for (int k = 0; k < model->closure_count; k++)
        if (model->closures[k].point[0] == point || model->closures[k].point[1] == point)
            return true;
    return false;
}

static const char *plain_name(kmp_export *w, int point)
{
    const kmp_point *p = &w->model->points[point];
    kmp_text name = {0};
    kmp_export_name(&name, w->links[w->of_body[p->body]].name);
    kmp_text_put(&name, "_");
    kmp_export_name(&name, p->name);
    const char *copy = name.failed ? NULL : kmp_arena_strdup(&w->arena, name.s);
    w->arena.failed = w->arena.failed || name.failed;
    kmp_text_free(&name);
    return copy;
}

static bool is_taken(kmp_export *w, int point, const char *name)
{
    for (int k = 0; k < w->count; k++)
        if (strcmp(name, w->links[k].name) == 0 || (k > 0 && strcmp(name, w->links[k].joint) == 0))
            return true;
    for (int k = 0; k < w->model->closure_count; k++)
        if (strcmp(name, w->model->closures[k].name) == 0)
            return true;
    for (int k = 0; k < point; k++)
        if (w->point_name[k] && strcmp(name, w->point_name[k]) == 0)
            return true;
    return false;
}

const char *kmp_export_point_name(kmp_export *w, int point)
{
    const kmp_point *p = &w->model->points[point];
    if (!p->name || strcmp(p->name, "origin") == 0 || is_end(w->model, point))
        return NULL;
    const char *name = plain_name(w, point);
    while (name && is_taken(w, point, name))
        name = kmp_arena_printf(&w->arena, "%s_", name);
    w->point_name[point] = name;
    return name;
}
