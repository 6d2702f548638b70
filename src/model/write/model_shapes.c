/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes as text and as JSON. */
#include "model/data/numbers.h"
#include "model/write/model_print.h"

static void put_vector(kmp_json *json, const char *key, int count, const kmp_number *v)
{
    double x[3] = {0};
    for (int k = 0; k < count; k++)
        x[k] = v[k].value;
    kmp_json_numbers(json, key, count, x);
}

static void put_axes(kmp_json *json, double (*const m)[3])
{
    kmp_json_array(json, "axes");
    for (int k = 0; k < 3; k++)
        kmp_json_numbers(json, NULL, 3, (const double[]){m[0][k], m[1][k], m[2][k]});
    kmp_json_end(json);
}

void kmp_model_json_shape(kmp_json *json, const kmp_shape *s)
{
    double axes[3][3];
    for (int k = 0; k < 9; k++)
        axes[k / 3][k % 3] = s->axes[k / 3][k % 3];
    if (s->kind == KMP_SHAPE_BOX || s->kind == KMP_SHAPE_ELLIPSOID)
        put_vector(json, s->kind == KMP_SHAPE_BOX ? "size" : "radii", 3, s->edge);
    if (s->kind == KMP_SHAPE_MESH) {
        kmp_json_put(json, "file %s triangles %d scale %g", s->mesh->path, s->mesh->triangle_count, s->scale.value);
    }
    if (s->radius.value > 0)
        kmp_json_number(json, "radius", s->radius.value);
    if (s->kind == KMP_SHAPE_CYLINDER || s->kind == KMP_SHAPE_CAPSULE) {
        kmp_json_number(json, "length", s->length.value);
        put_vector(json, "along", 3, s->along);
    }
    if (s->kind == KMP_SHAPE_LINE) {
        kmp_json_array(json, "through");
        for (int k = 0; k < s->through_count; k++)
            put_vector(json, NULL, 3, s->through[k]);
        kmp_json_end(json);
    } else
        put_vector(json, "at", 3, s->at);
    if (s->turned && (s->kind == KMP_SHAPE_BOX || s->kind == KMP_SHAPE_ELLIPSOID || s->kind == KMP_SHAPE_MESH))
        put_axes(json, axes);
    if (s->heavy)
        kmp_json_number(json, s->by_density ? "density" : "mass", s->matter.value);
    if (s->hole)
        kmp_json_whole(json, "hole", 1);
    kmp_text colour = {0};
    kmp_text_printf(&colour, "#%06x", (unsigned)s->colour & 0xffffff);
    if (s->colour >= 0)
        kmp_json_string(json, "colour", colour.s);
    kmp_text_free_part(json->text, &colour);
    if (s->opacity < 1)
        kmp_json_number(json, "opacity", s->opacity);
}

void kmp_model_json_shapes(kmp_json *json, const kempe_model *model)
{
    if (model->shape_count == 0)
        return;
    kmp_json_line(json, "\n");
    kmp_json_array(json, "shapes");
    for (int k = 0; k < model->shape_count; k++) {
        kmp_model_json_item(json, NULL);
        kmp_json_put(json, "body %s kind %s", model->bodies[model->shapes[k].body].name,
                     kmp_shape_words[model->shapes[k].kind]);
        kmp_model_json_shape(json, &model->shapes[k]);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

void kmp_model_show_shape(kmp_text *text, const kmp_shape *shape)
{
    kmp_text_printf(text, "    shape %s: ", kmp_shape_words[shape->kind]);
    kmp_json json = kmp_json_begin_as(text, KMP_JSON_WORDS);
    kmp_json_object(&json, NULL);
    kmp_model_json_shape(&json, shape);
    kmp_json_end(&json);
    kmp_text_put(text, "\n");
}

void kmp_model_json_mass(kmp_json *json, const kmp_body *body)
{
    kmp_json_number(json, "mass", body->mass.value);
    put_vector(json, "com", 3, body->com);
    kmp_json_object(json, "inertia");
    for (int k = 0; k < 6; k++)
        kmp_json_number(json, kmp_inertia_names[k], body->inertia[k].value);
    kmp_json_end(json);
}
