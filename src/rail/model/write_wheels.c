/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels and tracks as the reader understood them, in both forms. */
#include "rail/model/write_wheels.h"
#include "base/text.h"
#include "model/data/model.h"
#include "model/data/wheels.h"
#include "model/language/nearest.h"
#include "model/write/model_json.h"
#include "model/write/model_print.h"
#include "rail/model/wheel_words.h"
#include "symbolic/table_function.h"
#include <kempe/kempe.h>
#include <stdbool.h>

static void put_wheel(kmp_json *json, const kempe_model *model, int number)
{
    const kmp_wheel *wheel = &model->wheels[number];
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

/* -- tracks ------------------------------------------------------------------------------------------ */

/* Profiles and tracks, as they were understood, in both forms. */

/* -- the summary --------------------------------------------------------------------------------- */

static void show_track(kmp_text *text, const kempe_model *model, int number)
{
    const kmp_track *track = &model->tracks[number];
    kmp_text_printf(text, "  %s: at ", track->name);
    kmp_model_put_point(text, model, track->point);
    kmp_text_printf(text, ", rail %s, gauge %.9g at %.9g below the top, inclination %.9g\n", track->profile->name,
                    track->gauge, track->gauge_depth, track->inclination);
    for (int k = 0; k < track->course_count; k++) {
        const kmp_course_piece *piece = &track->course[k];
        kmp_text_printf(text, "    %s %.9g", kmp_course_words[piece->kind], piece->length);
        if (piece->radius > 0)
            kmp_text_printf(text, ", radius %.9g", piece->radius);
        if (piece->cant != 0)
            kmp_text_printf(text, ", cant %.9g", piece->cant);
        kmp_text_put(text, "\n");
    }
    const kmp_irregularities *all = &track->irregularities;
    const kmp_wave_spectrum *s = &all->spectrum;
    for (int k = 0; k < KMP_IRREGULARITIES; k++)
        if (all->named[k])
            kmp_text_printf(text, "    %s by table %s\n", kmp_irregularity_words[k], all->named[k]->name);
    if (s->kind >= 0)
        kmp_text_printf(text, "    spectrum %s, seed %.9g, from %.9g to %.9g, wavelengths %.9g to %.9g, scale %.9g\n",
                        kmp_name_at(kmp_wave_spectrum_words, s->kind), s->seed, s->from, s->to, s->shortest, s->longest,
                        s->scale);
}

static void show_profile(kmp_text *text, const kempe_model *model, int k)
{
    const kmp_table *height = model->profiles[k].height;
    kmp_text_printf(text, "  %s: %d points, y from %.9g to %.9g\n", model->profiles[k].name, height->count,
                    height->x[0], height->x[height->count - 1]);
}

/* -- JSON ---------------------------------------------------------------------------------------- */

static void put_track(kmp_json *json, const kempe_model *model, int number)
{
    const kmp_track *track = &model->tracks[number];
    kmp_model_json_point(json, "at", model, track->point);
    kmp_json_put(json, "rail %s gauge %g gauge_depth %g inclination %g", track->profile->name, track->gauge,
                 track->gauge_depth, track->inclination);
    if (track->course_count > 0) {
        kmp_json_array(json, "course");
        for (int k = 0; k < track->course_count; k++) {
            const kmp_course_piece *piece = &track->course[k];
            kmp_json_put(json, "{ %s %g", kmp_course_words[piece->kind], piece->length);
            if (piece->radius > 0)
                kmp_json_number(json, "radius", piece->radius);
            if (piece->cant != 0)
                kmp_json_number(json, "cant", piece->cant);
            kmp_json_end(json);
        }
        kmp_json_end(json);
    }
    const kmp_irregularities *all = &track->irregularities;
    const kmp_wave_spectrum *s = &all->spectrum;
    bool any = s->kind >= 0;
    for (int k = 0; k < KMP_IRREGULARITIES; k++)
        any = any || all->named[k];
    if (!any)
        return;
    kmp_json_object(json, "irregularities");
    for (int k = 0; k < KMP_IRREGULARITIES; k++)
        if (all->named[k])
            kmp_json_string(json, kmp_irregularity_words[k], all->named[k]->name);
    if (s->kind >= 0) {
        kmp_json_put(json, "spectrum %s seed %g from %g to %g", kmp_name_at(kmp_wave_spectrum_words, s->kind), s->seed,
                     s->from, s->to);
        kmp_json_numbers(json, "wavelengths", 2, (const double[]){s->shortest, s->longest});
        kmp_json_number(json, "scale", s->scale);
    }
    kmp_json_end(json);
}

static void put_profile(kmp_json *json, const kempe_model *model, int k)
{
    const kmp_table *height = model->profiles[k].height;
    kmp_json_numbers(json, "y", height->count, height->x);
    kmp_json_numbers(json, "z", height->count, height->y);
}

const kmp_writer_wing kmp_wheel_writer[] = {{KMP_WRITTEN(profiles, profile), false, put_profile, show_profile},
                                            {KMP_WRITTEN(tracks, track), false, put_track, show_track},
                                            {KMP_WRITTEN(wheels, wheel), true, put_wheel, NULL},
                                            {0}};
