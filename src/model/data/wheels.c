/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/wheels.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "symbolic/table_function.h"

int kmp_wheel_contacts(const kmp_wheel *wheel)
{
    return wheel->form == KMP_CONTACT_RIGID ? 1 : wheel->zone_count;
}

void kmp_profile_free(kmp_profile *profile)
{
    kmp_table_free(profile->height);
    profile->height = NULL;
}

void kmp_track_free(kmp_track *track)
{
    kmp_table **tables[] = {&track->rail, &track->x, &track->y, &track->cant};
    for (size_t k = 0; k < sizeof tables / sizeof *tables; k++) {
        kmp_table_free(*tables[k]);
        *tables[k] = NULL;
    }
    for (int k = 0; k < KMP_IRREGULARITIES; k++) {
        kmp_table_free(track->irregularities.made[k]);
        track->irregularities.made[k] = NULL;
    }
    kmp_free(track->candidate);
    track->candidate = NULL;
}

bool kmp_tracks_are_irregular(int count, const kmp_track *tracks)
{
    bool any = false;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < KMP_IRREGULARITIES; i++)
            any = any || tracks[k].irregularities.named[i] || tracks[k].irregularities.made[i];
    return any;
}

kmp_track *kmp_tracks_ideal(int count, const kmp_track *tracks, kmp_arena *arena)
{
    kmp_track *ideal = KMP_ARENA_NEW(arena, kmp_track, count);
    for (int k = 0; ideal && k < count; k++) {
        ideal[k] = tracks[k];
        ideal[k].irregularities = (kmp_irregularities){.spectrum = {.kind = -1}};
    }
    return ideal;
}

const kmp_wheel *kmp_model_wheel(const kempe_model *model, int k)
{
    return &model->wheels[k];
}

int kmp_model_wheel_count(const kempe_model *model)
{
    return model->wheel_count;
}

const kmp_track *kmp_model_track(const kempe_model *model, int k)
{
    return &model->tracks[k];
}
