/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/wings.h"
#include "rail/model/read_profiles.h"
#include "rail/model/read_tracks.h"
#include "rail/model/read_wheels.h"
#include "rail/model/write_wheels.h"
#include "rail/places/average.h"
#include "rail/places/scan.h"
#include "rail/running_safety.h"
#include "rail/wheel/wheel_contact.h"

static const char *const sections[] = {"profiles", "tracks", "wheels", NULL};

static void read_sections(kmp_reader *r, kmp_reader_stage stage)
{
    switch (stage) {
    case KMP_READ_AFTER_TABLES:
        kmp_read_profiles(r);
        break;
    case KMP_READ_WITH_STATES:
        break;
    case KMP_READ_AFTER_STATES:
        kmp_read_tracks(r);
        kmp_read_wheels(r);
        break;
    case KMP_READ_AFTER_CLOSURES:
        kmp_add_wheel_closures(r);
        break;
    case KMP_READ_AFTER_FORCES:
        kmp_add_wheel_forces(r);
        break;
    }
}

static const kmp_reader_wing reader = {sections, read_sections};

static const kmp_places_wing places = {
    .averages = {kmp_average_room, kmp_average_room_free, kmp_average_run, kmp_average_count},
    .merits = {kmp_scan_of_candidates, kmp_scan_free, kmp_scan_run, kmp_scan_count},
    .derivative = kmp_average_derivative,
};

const kmp_wing kmp_wing_rail = {
    .name = "rail",
    .reader = &reader,
    .writer = kmp_wheel_writer,
    .closures = kmp_wheel_closures,
    .laws = kmp_wheel_laws,
    .outputs = kmp_wheel_outputs,
    .judge = &kmp_safety_judge,
    .places = &places,
};
