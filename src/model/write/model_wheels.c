/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels as the reader understood them, in both forms. */
#include "model/write/model_wheels.h"
#include "model/data/model.h"
#include "model/write/model_json.h"
#include "model/write/model_print.h"

static void put_wheel(kmp_json *json, const kempe_model *model, const kmp_wheel *wheel)
{
    kmp_text rail = {0};
    kmp_text_printf(&rail, "%s.%s", model->tracks[wheel->track].name, kmp_track_side_words[wheel->side]);
    kmp_json_text(json, "on", &rail);
    kmp_model_json_point(json, "at", model, wheel->point);
    kmp_json_put(json, "profile %s radius %g contact %s creep %s", wheel->profile->name, wheel->radius.value,
                 kmp_contact_form_words[wheel->form], kmp_creep_law_words[wheel->law]);
    /* The numbers of a wheel, in addition to its radius, that its form uses. */
    bool creeps = wheel->law != KMP_CREEP_NONE, elastic = wheel->form == KMP_CONTACT_ELASTIC;
    if (creeps)
        kmp_json_number(json, "friction", wheel->friction.value);
    if (creeps || (elastic && !wheel->has_stiffness)) {
        kmp_json_put(json, "shear_modulus %g poisson %g", wheel->shear_modulus.value, wheel->poisson);
    }
    if (elastic && wheel->has_stiffness)
        kmp_json_number(json, "stiffness", wheel->stiffness.value);
    if (elastic)
        kmp_json_number(json, "damping", wheel->damping.value);
    kmp_json_put(json, "speed %g zones [", wheel->speed.value);
    for (int k = 0; k < wheel->zone_count; k++)
        kmp_json_numbers(json, NULL, 2, wheel->zone[k]);
    kmp_json_end(json);
}

void kmp_model_show_wheels(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, model->wheel_count > 0 ? "wheels\n" : "");
    for (int i = 0; i < model->wheel_count; i++) {
        kmp_json words = kmp_json_begin_as(text, KMP_JSON_WORDS);
        kmp_text_printf(text, "  %s: ", model->wheels[i].name);
        put_wheel(&words, model, &model->wheels[i]);
        kmp_text_put(text, "\n");
    }
}

void kmp_model_json_wheels(kmp_json *json, const kempe_model *model)
{
    if (model->wheel_count == 0)
        return;
    kmp_model_json_begin(json, "wheels");
    for (int i = 0; i < model->wheel_count; i++) {
        kmp_model_json_item(json, model->wheels[i].name);
        put_wheel(json, model, &model->wheels[i]);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}
