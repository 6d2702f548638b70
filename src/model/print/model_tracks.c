/* SPDX-License-Identifier: BSD-3-Clause */
/* Profiles and tracks, as they were understood, in both forms. */
#include "model/print/model_print.h"
#include "model/rail/wave_spectrum.h"
#include "symbolic/table.h"

static const char *const irregularity_words[] = {"alignment", "level", "cross", "gauge"};
static const char *const course_words[] = {"straight", "transition", "left", "right"};

/* -- the summary --------------------------------------------------------------------------------- */

static void show_profile(kmp_text *text, const kmp_profile *profile)
{
    const kmp_table *height = profile->height;
    kmp_text_printf(text, "  %s: %d points, y from %.9g to %.9g\n", profile->name, height->count, height->x[0],
                    height->x[height->count - 1]);
}

static void show_irregularities(kmp_text *text, const kmp_irregularities *all)
{
    const kmp_wave_spectrum *s = &all->spectrum;
    for (int k = 0; k < KMP_IRREGULARITIES; k++)
        if (all->named[k])
            kmp_text_printf(text, "    %s by table %s\n", irregularity_words[k], all->named[k]->name);
    if (s->kind >= 0)
        kmp_text_printf(text, "    spectrum %s, seed %.9g, from %.9g to %.9g, wavelengths %.9g to %.9g, scale %.9g\n",
                        kmp_wave_spectrum_word(s->kind), s->seed, s->from, s->to, s->shortest, s->longest, s->scale);
}

static void show_track(kmp_text *text, const kempe_model *model, const kmp_track *track)
{
    kmp_text_printf(text, "  %s: at ", track->name);
    kmp_model_put_point(text, model, track->point);
    kmp_text_printf(text, ", rail %s, gauge %.9g at %.9g below the top, inclination %.9g\n", track->profile->name,
                    track->gauge, track->gauge_depth, track->inclination);
    for (int k = 0; k < track->course_count; k++) {
        const kmp_course_piece *piece = &track->course[k];
        kmp_text_printf(text, "    %s %.9g", course_words[piece->kind], piece->length);
        if (piece->radius > 0)
            kmp_text_printf(text, ", radius %.9g", piece->radius);
        if (piece->cant != 0)
            kmp_text_printf(text, ", cant %.9g", piece->cant);
        kmp_text_put(text, "\n");
    }
    show_irregularities(text, &track->irregularities);
}

void kmp_model_show_tracks(kmp_text *text, const kempe_model *model)
{
    if (model->profile_count > 0)
        kmp_text_put(text, "profiles\n");
    for (int i = 0; i < model->profile_count; i++)
        show_profile(text, &model->profiles[i]);
    if (model->track_count > 0)
        kmp_text_put(text, "tracks\n");
    for (int i = 0; i < model->track_count; i++)
        show_track(text, model, &model->tracks[i]);
}

/* -- JSON ---------------------------------------------------------------------------------------- */

static void put_name(kmp_text *text, int i, const char *name)
{
    kmp_text_put(text, i > 0 ? ",\n  " : "\n  ");
    kmp_text_quote(text, name);
    kmp_text_put(text, ": {");
}

static void put_list(kmp_text *text, const char *key, int count, const double *x)
{
    kmp_text_printf(text, "\"%s\": [", key);
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k > 0 ? ", " : "");
        kmp_text_number(text, x[k]);
    }
    kmp_text_put(text, "]");
}

static void put_size(kmp_text *text, const char *key, double value)
{
    kmp_text_printf(text, ", \"%s\": ", key);
    kmp_text_number(text, value);
}

static void json_irregularities(kmp_text *text, const kmp_irregularities *all)
{
    const kmp_wave_spectrum *s = &all->spectrum;
    const char *between = ", \"irregularities\": {";
    bool any = s->kind >= 0;
    for (int k = 0; k < KMP_IRREGULARITIES; k++) {
        if (!all->named[k])
            continue;
        kmp_text_printf(text, "%s\"%s\": ", between, irregularity_words[k]);
        kmp_text_quote(text, all->named[k]->name);
        between = ", ";
        any = true;
    }
    if (s->kind >= 0) {
        kmp_text_printf(text, "%s\"spectrum\": \"%s\"", between, kmp_wave_spectrum_word(s->kind));
        put_size(text, "seed", s->seed);
        put_size(text, "from", s->from);
        put_size(text, "to", s->to);
        kmp_text_put(text, ", ");
        put_list(text, "wavelengths", 2, (const double[]){s->shortest, s->longest});
        put_size(text, "scale", s->scale);
    }
    kmp_text_put(text, any ? "}" : "");
}

static void json_course(kmp_text *text, const kmp_track *track)
{
    kmp_text_put(text, ", \"course\": [");
    for (int k = 0; k < track->course_count; k++) {
        const kmp_course_piece *piece = &track->course[k];
        kmp_text_printf(text, "%s{\"%s\": ", k > 0 ? ", " : "", course_words[piece->kind]);
        kmp_text_number(text, piece->length);
        if (piece->radius > 0)
            put_size(text, "radius", piece->radius);
        if (piece->cant != 0)
            put_size(text, "cant", piece->cant);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void json_track(kmp_text *text, const kempe_model *model, const kmp_track *track)
{
    kmp_text_put(text, "\"at\": \"");
    kmp_model_put_point(text, model, track->point);
    kmp_text_put(text, "\", \"rail\": ");
    kmp_text_quote(text, track->profile->name);
    put_size(text, "gauge", track->gauge);
    put_size(text, "gauge_depth", track->gauge_depth);
    put_size(text, "inclination", track->inclination);
    if (track->course_count > 0)
        json_course(text, track);
    json_irregularities(text, &track->irregularities);
}

void kmp_model_json_tracks(kmp_text *text, const kempe_model *model)
{
    if (model->profile_count > 0)
        kmp_text_put(text, ",\n\"profiles\": {");
    for (int i = 0; i < model->profile_count; i++) {
        const kmp_table *height = model->profiles[i].height;
        put_name(text, i, model->profiles[i].name);
        put_list(text, "y", height->count, height->x);
        kmp_text_put(text, ", ");
        put_list(text, "z", height->count, height->y);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, model->profile_count > 0 ? "}" : "");
    if (model->track_count > 0)
        kmp_text_put(text, ",\n\"tracks\": {");
    for (int i = 0; i < model->track_count; i++) {
        put_name(text, i, model->tracks[i].name);
        json_track(text, model, &model->tracks[i]);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, model->track_count > 0 ? "}" : "");
}
