/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels as the reader understood them, in both forms, and the words for their properties. */
#include "model/print/model_print.h"

const char *const kmp_contact_form_words[] = {"rigid", "elastic", NULL};
const char *const kmp_creep_law_words[] = {"none", "linear", "shen", "polach", "tanh", NULL};
const char *const kmp_track_side_words[] = {"left", "right", NULL};

#define KMP_WORDS(all) ((int)(sizeof(all) / sizeof *(all)) - 1)
_Static_assert(KMP_WORDS(kmp_contact_form_words) == KMP_CONTACT_ELASTIC + 1, "a form of contact without a word");
_Static_assert(KMP_WORDS(kmp_creep_law_words) == KMP_CREEP_LAWS, "a law without a word");
_Static_assert(KMP_WORDS(kmp_track_side_words) == KMP_TRACK_SIDES, "a rail without a word");

/* The numbers of a wheel, in addition to its radius, that its form uses. */
typedef struct numbers {
    int count;
    const char *key[6];
    double value[6];
} numbers;

static void add(numbers *n, const char *key, double value)
{
    n->key[n->count] = key;
    n->value[n->count++] = value;
}

static numbers numbers_of(const kmp_wheel *wheel)
{
    numbers n = {0};
    bool creeps = wheel->law != KMP_CREEP_NONE, elastic = wheel->form == KMP_CONTACT_ELASTIC;
    if (creeps)
        add(&n, "friction", wheel->friction.value);
    if (creeps || (elastic && !wheel->has_stiffness)) {
        add(&n, "shear_modulus", wheel->shear_modulus.value);
        add(&n, "poisson", wheel->poisson);
    }
    if (elastic && wheel->has_stiffness)
        add(&n, "stiffness", wheel->stiffness.value);
    if (elastic)
        add(&n, "damping", wheel->damping.value);
    add(&n, "speed", wheel->speed.value);
    return n;
}

static void put_zones(kmp_text *text, const kmp_wheel *wheel)
{
    for (int k = 0; k < wheel->zone_count; k++) {
        kmp_text_put(text, k > 0 ? ", [" : "[");
        for (int i = 0; i < 2; i++) {
            kmp_text_put(text, i > 0 ? ", " : "");
            kmp_text_number(text, wheel->zone[k][i]);
        }
        kmp_text_put(text, "]");
    }
}

static void show_wheel(kmp_text *text, const kempe_model *model, const kmp_wheel *wheel)
{
    const numbers n = numbers_of(wheel);
    kmp_text_printf(text, "  %s: on %s.%s, at ", wheel->name, model->tracks[wheel->track].name,
                    kmp_track_side_words[wheel->side]);
    kmp_model_put_point(text, model, wheel->point);
    kmp_text_printf(text, ", profile %s, radius ", wheel->profile->name);
    kmp_text_number(text, wheel->radius.value);
    kmp_text_printf(text, ", contact %s, creep %s", kmp_contact_form_words[wheel->form],
                    kmp_creep_law_words[wheel->law]);
    for (int k = 0; k < n.count; k++) {
        kmp_text_printf(text, ", %s ", n.key[k]);
        kmp_text_number(text, n.value[k]);
    }
    kmp_text_put(text, ", zones ");
    put_zones(text, wheel);
    kmp_text_put(text, "\n");
}

void kmp_model_show_wheels(kmp_text *text, const kempe_model *model)
{
    if (model->wheel_count > 0)
        kmp_text_put(text, "wheels\n");
    for (int i = 0; i < model->wheel_count; i++)
        show_wheel(text, model, &model->wheels[i]);
}

static void json_wheel(kmp_text *text, const kempe_model *model, const kmp_wheel *wheel)
{
    const numbers n = numbers_of(wheel);
    kmp_text_put(text, "{\"on\": \"");
    kmp_text_printf(text, "%s.%s\", \"at\": \"", model->tracks[wheel->track].name, kmp_track_side_words[wheel->side]);
    kmp_model_put_point(text, model, wheel->point);
    kmp_text_put(text, "\", \"profile\": ");
    kmp_text_quote(text, wheel->profile->name);
    kmp_text_put(text, ", \"radius\": ");
    kmp_text_number(text, wheel->radius.value);
    kmp_text_printf(text, ", \"contact\": \"%s\", \"creep\": \"%s\"", kmp_contact_form_words[wheel->form],
                    kmp_creep_law_words[wheel->law]);
    for (int k = 0; k < n.count; k++) {
        kmp_text_printf(text, ", \"%s\": ", n.key[k]);
        kmp_text_number(text, n.value[k]);
    }
    kmp_text_put(text, ", \"zones\": [");
    put_zones(text, wheel);
    kmp_text_put(text, "]}");
}

void kmp_model_json_wheels(kmp_text *text, const kempe_model *model)
{
    if (model->wheel_count > 0)
        kmp_text_put(text, ",\n\"wheels\": {");
    for (int i = 0; i < model->wheel_count; i++) {
        kmp_text_put(text, i > 0 ? ",\n  " : "\n  ");
        kmp_text_quote(text, model->wheels[i].name);
        kmp_text_put(text, ": ");
        json_wheel(text, model, &model->wheels[i]);
    }
    kmp_text_put(text, model->wheel_count > 0 ? "}" : "");
}
