/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as the reader understood it: common parts of its summary and its JSON, and the choice of one. */
#include "model/write/model_print.h"
#include "base/context.h"
#include "base/text.h"
#include "base/wings.h"
#include "model/data/body.h"
#include "model/data/cam.h"
#include "model/data/closure.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/outline.h"
#include "model/data/run_settings.h"
#include "model/data/shape.h"
#include "model/data/start.h"
#include "model/data/touch.h"
#include "model/language/expression.h"
#include "model/language/expression_print.h"
#include "model/write/model_json.h"
#include "model/write/model_show.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

void kmp_model_put_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr)
{
    const kmp_expr_names names = {KMP_NAMED(model, parameter), KMP_NAMED(model, motion), KMP_NAMED(model, closure),
                                  KMP_NAMED(model, input), model->state_count};
    kmp_expr_print(text, expr, &names);
}

void kmp_model_put_point(kmp_text *text, const kempe_model *model, int index)
{
    const kmp_point *point = &model->points[index];
    kmp_text_printf(text, "%s.%s", model->bodies[point->body].name, point->name);
}

void kmp_model_put_goal(kmp_text *text, const kempe_model *model, const kmp_goal *goal)
{
    if (goal->motion >= 0) {
        kmp_text_put(text, model->motions[goal->motion].name);
        return;
    }
    kmp_text_put(text, "position(");
    kmp_model_put_point(text, model, goal->point);
    kmp_text_put(text, ")");
}

bool kmp_closure_has_axes(const kmp_closure *closure)
{
    const double *a = closure->axis[0];
    return a[0] != 0 || a[1] != 0 || a[2] != 0;
}

const char *const kmp_axis_names[3] = {"x", "y", "z"};

void kmp_model_settings(const kmp_run_settings *run, kmp_shown_setting list[KMP_SETTINGS])
{
    bool automatic = run->dynamics == KMP_DYNAMICS_AUTO, cross = run->change_points == KMP_CHANGE_POINTS_CROSS;
    bool of_rows = run->reaction_peaks == KMP_REACTION_PEAKS_ROWS;
    int count = 0;
#define PUT_NUMBER(name) list[count++] = (kmp_shown_setting){#name, false, (double)run->name, NULL};
#define PUT_TEXT(name)   list[count++] = (kmp_shown_setting){#name, true, 0, run->name};
#define KMP_RUN_OPTION(name, type, key, ...)                                                                           \
    KMP_RUN_IF_KEY_##key(KMP_RUN_IF_NUMBER_##type(PUT_NUMBER(name)) KMP_RUN_IF_TEXT_##type(PUT_TEXT(name)))
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    list[count++] = (kmp_shown_setting){"algorithm", true, 0, automatic ? NULL : kmp_dynamics_word(run->dynamics)};
    list[count++] =
        (kmp_shown_setting){"change_points", true, 0, cross ? NULL : kmp_change_points_word(run->change_points)};
    list[count++] =
        (kmp_shown_setting){"reaction_peaks", true, 0, of_rows ? NULL : kmp_reaction_peaks_word(run->reaction_peaks)};
}

kempe_status kempe_model_print(const kempe_model *model, kempe_format format, char **text)
{
    KMP_WANTED_BOTH(model, text);
    kmp_text out = {0};
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    if (format == KEMPE_JSON)
        kmp_model_json(&out, model);
    else
        kmp_model_show(&out, model);
    char *s = kmp_text_take(&out);
    KMP_TRY(kmp_made(model->context, s));
    *text = s;
    return KEMPE_OK;
}

/* Pairs of surfaces in contact, as text and as JSON. */

static const char *const shapes[] = {"sphere", "cylinder", "plane", "profile", "outline", "cam", "flat"};

/* Of a plane with the sign of its normal. */
static const char *axis_of(const kmp_touch_side *side)
{
    static const char *const opposite[3] = {"-x", "-y", "-z"};
    return side->against ? opposite[side->axis] : kmp_axis_names[side->axis];
}

/* A piece of an outline by its ends, or by its centre and its radius; of a run where it begins. */
static void show_piece(kmp_text *text, const kmp_outline_part *part)
{
    const kmp_piece *piece = &part->piece;
    int more = 0;
    while ((part = part->next) != NULL)
        more++;
    if (more > 0)
        kmp_text_printf(text, "%d pieces from (%.6g, %.6g) at ", more + 1, piece->from[0], piece->from[1]);
    else if (piece->arc)
        kmp_text_printf(text, "arc about (%.6g, %.6g) of radius %.6g at ", piece->centre[0], piece->centre[1],
                        piece->radius);
    else
        kmp_text_printf(text, "line (%.6g, %.6g) - (%.6g, %.6g) at ", piece->from[0], piece->from[1], piece->to[0],
                        piece->to[1]);
}

static void show_side(kmp_text *text, const kempe_model *model, const kmp_contact_pair *pair, int k)
{
    const kmp_touch_side *side = &pair->side[k];
    kmp_text_printf(text, "%s%s ", side->hollow && !side->piece ? "inside " : "",
                    side->shape == KMP_TOUCH_SPHERE && !(pair->radius[k].value > 0) ? "point" : shapes[side->shape]);
    if (side->table || side->cam)
        kmp_text_printf(text, "%s at ", side->table ? side->table->name : side->cam->outline->name);
    if (side->piece)
        show_piece(text, side->piece);
    kmp_model_put_point(text, model, side->point);
    if (side->off)
        kmp_text_printf(text, " (%.6g, %.6g)", side->at[0], side->at[1]);
    if (side->shape == KMP_TOUCH_CYLINDER || side->shape == KMP_TOUCH_PLANE || side->shape == KMP_TOUCH_FACE)
        kmp_text_printf(text, " %s", axis_of(side));
}

void kmp_pair_show(kmp_text *text, const kempe_model *model, const kmp_contact_pair *pair)
{
    if (pair->gap) {
        kmp_text_put(text, "stop where zero: ");
        kmp_model_put_expr(text, model, pair->gap);
    } else if (pair->motion >= 0) {
        kmp_text_printf(text, "%s limit of %s", pair->upper ? "upper" : "lower", model->motions[pair->motion].name);
    } else {
        show_side(text, model, pair, 0);
        kmp_text_put(text, " on ");
        show_side(text, model, pair, 1);
    }
}

static void json_side(kmp_json *json, const kempe_model *model, const kmp_contact_pair *pair, int k)
{
    const kmp_touch_side *side = &pair->side[k];
    kmp_json_string(json, k ? "on" : "shape", shapes[side->shape]);
    kmp_model_json_point(json, k ? "on_point" : "point", model, side->point);
    kmp_json_string(json, k ? "on_axis" : "axis", axis_of(side));
    if (side->hollow)
        kmp_json_string(json, "inside", "yes");
    if (side->table)
        kmp_json_string(json, "profile", side->table->name);
    if (side->off)
        kmp_json_numbers(json, "circle_centre", 2, side->at);
    if (side->piece) {
        const kmp_piece *piece = &side->piece->piece;
        kmp_json_numbers(json, "from", 2, piece->from);
        kmp_json_numbers(json, "to", 2, piece->to);
        if (piece->arc)
            kmp_json_put(json, "centre [ %.17g %.17g ] radius %.17g", piece->centre[0], piece->centre[1],
                         piece->radius);
    }
    if (side->cam)
        kmp_json_string(json, "outline", side->cam->outline->name);
}

void kmp_pair_json(kmp_json *json, const kempe_model *model, const kmp_contact_pair *pair)
{
    kmp_text text = {0};
    if (pair->gap) {
        kmp_model_put_expr(&text, model, pair->gap);
        kmp_json_text(json, "gap", &text);
    } else if (pair->motion >= 0) {
        kmp_json_put(json, "coordinate %s end %s", model->motions[pair->motion].name, pair->upper ? "upper" : "lower");
    } else {
        json_side(json, model, pair, 0);
        json_side(json, model, pair, 1);
    }
}

/* Sections of wings. */

static void put_entry(kmp_json *json, const kempe_model *model, const kmp_writer_wing *row, const char *name, int k)
{
    if (json->layout != KMP_JSON_WORDS) {
        kmp_model_json_item(json, name);
        row->put(json, model, k);
        kmp_json_end(json);
    } else if (row->show) {
        row->show(json->text, model, k);
    } else {
        kmp_json words = kmp_json_begin_as(json->text, KMP_JSON_WORDS);
        kmp_text_printf(json->text, "  %s: ", name);
        row->put(&words, model, k);
        kmp_text_put(json->text, "\n");
    }
}

static void put_section(kmp_json *json, const kempe_model *model, const kmp_writer_wing *row)
{
    const char *members = (const char *)model;
    kmp_name_list names = {.size = row->size};
    memcpy(&names.count, members + row->count, sizeof names.count);
    memcpy(&names.list, members + row->list, sizeof names.list);
    if (names.count > 0 && json->layout == KMP_JSON_WORDS)
        kmp_text_printf(json->text, "%s\n", row->section);
    else if (names.count > 0)
        kmp_model_json_begin(json, row->section);
    for (int k = 0; k < names.count; k++)
        put_entry(json, model, row, kmp_name_at(names, k), k);
    if (names.count > 0 && json->layout != KMP_JSON_WORDS)
        kmp_json_end(json);
}

void kmp_model_put_wings(kmp_json *json, const kempe_model *model, bool behind_bodies)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        for (const kmp_writer_wing *row = (*wing)->writer; row && row->section; row++)
            if (row->behind_bodies == behind_bodies)
                put_section(json, model, row);
}

/* Shapes as text and as JSON. */

static void put_vector(kmp_json *json, const char *key, const kmp_number v[3])
{
    const double x[3] = {v[0].value, v[1].value, v[2].value};
    kmp_json_numbers(json, key, 3, x);
}

void kmp_model_json_shape(kmp_json *json, const kmp_shape *s)
{
    if (s->kind == KMP_SHAPE_BOX || s->kind == KMP_SHAPE_ELLIPSOID)
        put_vector(json, s->kind == KMP_SHAPE_BOX ? "size" : "radii", s->edge);
    if (s->kind == KMP_SHAPE_MESH) {
        kmp_json_put(json, "file %s triangles %d scale %g", s->mesh->path, s->mesh->triangle_count, s->scale.value);
    }
    if (s->radius.value > 0)
        kmp_json_number(json, "radius", s->radius.value);
    if (s->kind == KMP_SHAPE_CYLINDER || s->kind == KMP_SHAPE_CAPSULE) {
        kmp_json_number(json, "length", s->length.value);
        put_vector(json, "along", s->along);
    }
    if (s->kind == KMP_SHAPE_LINE) {
        kmp_json_array(json, "through");
        for (int k = 0; k < s->through_count; k++)
            put_vector(json, NULL, s->through[k]);
        kmp_json_end(json);
    } else {
        put_vector(json, "at", s->at);
    }
    if (s->turned && (s->kind == KMP_SHAPE_BOX || s->kind == KMP_SHAPE_ELLIPSOID || s->kind == KMP_SHAPE_MESH)) {
        kmp_json_array(json, "axes");
        for (int k = 0; k < 3; k++)
            kmp_json_numbers(json, NULL, 3, (const double[]){s->axes[0][k], s->axes[1][k], s->axes[2][k]});
        kmp_json_end(json);
    }
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

void kmp_model_json_mass(kmp_json *json, const kempe_model *model, int body)
{
    const kmp_body rigid = kmp_body_undeformed(model, body);
    kmp_json_number(json, "mass", rigid.mass.value);
    put_vector(json, "com", rigid.com);
    kmp_json_object(json, "inertia");
    for (int k = 0; k < 6; k++)
        kmp_json_number(json, kmp_inertia_names[k], rigid.inertia[k].value);
    kmp_json_end(json);
}
