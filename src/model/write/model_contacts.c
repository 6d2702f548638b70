/* SPDX-License-Identifier: BSD-3-Clause */
/* Pairs of surfaces in contact, as text and as JSON. */
#include "model/write/model_print.h"

static const char *const shapes[] = {"sphere", "cylinder", "plane", "profile"};

static void show_side(kmp_text *text, const kempe_model *model, const kmp_contact_pair *pair, int k)
{
    const kmp_touch_side *side = &pair->side[k];
    kmp_text_printf(text, "%s%s ", side->hollow ? "inside " : "",
                    side->shape == KMP_TOUCH_SPHERE && !(pair->radius[k].value > 0) ? "point" : shapes[side->shape]);
    if (side->table)
        kmp_text_printf(text, "%s at ", side->table->name);
    kmp_model_put_point(text, model, side->point);
    if (side->shape == KMP_TOUCH_CYLINDER || side->shape == KMP_TOUCH_PLANE)
        kmp_text_printf(text, " %s", kmp_axis_names[side->axis]);
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
    kmp_json_string(json, k ? "on_axis" : "axis", kmp_axis_names[side->axis]);
    if (side->hollow)
        kmp_json_string(json, "inside", "yes");
    if (side->table)
        kmp_json_string(json, "profile", side->table->name);
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
