/* SPDX-License-Identifier: BSD-3-Clause */
/* Tracks: two rails, and their positions. */
#include "rail/model/read_tracks.h"
#include "model/data/model.h"
#include "model/read/read_values.h"
#include "rail/model/rail.h"
#include "rail/model/read_course.h"
#include "rail/model/read_irregularities.h"
#include "rail/model/read_profiles.h"
#include <math.h>

static const kmp_key track_keys[] = {
#include "model/keys/track_keys.def"
    {0}};

static bool read_length(kmp_reader *r, const kmp_yaml *node, const char *key, const char *of, double *value)
{
    const char *what = kmp_reader_say(r, "%s of %s", key, of);
    double read;
    if (!kmp_read_fixed(r, node, what, kmp_key_dimension(track_keys, key), &read))
        return false;
    if (read > 0)
        *value = read;
    else
        kmp_reader_complain(r, node->place, "%s must be positive, not %.9g", what, read);
    return read > 0;
}

static bool read_inclination(kmp_reader *r, const kmp_yaml *node, const char *what, double *value)
{
    double read;
    if (!kmp_read_fixed(r, node, what, kmp_key_dimension(track_keys, "inclination"), &read))
        return false;
    if (fabs(read) < 1)
        *value = read;
    else
        kmp_reader_complain(r, node->place, "%s is a slope such as 1/40, not %.9g", what, read);
    return fabs(read) < 1;
}

/* A point of the ground; -1 after an error. */
static int read_at(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    int point = kmp_read_point(r, node, what);
    if (point < 0 || r->model->points[point].body == 0)
        return point;
    kmp_reader_complain(r, node->place, "%s must begin at a point of the ground, not of body '%s'", what,
                        r->model->bodies[r->model->points[point].body].name);
    return -1;
}

static bool read_rails(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    const kmp_yaml *rail = kmp_read_required(r, map, what, "rail"), *gauge = kmp_read_required(r, map, what, "gauge"),
                   *depth = kmp_yaml_get(map, "gauge_depth"), *inclination = kmp_yaml_get(map, "inclination");
    (void)kmp_key_default(track_keys, "gauge_depth", 1, &track->gauge_depth);
    track->profile = rail ? kmp_read_profile(r, rail, what) : NULL;
    bool good = track->profile && gauge;
    if (gauge && !read_length(r, gauge, "gauge", what, &track->gauge))
        good = false;
    if (depth && !read_length(r, depth, "gauge_depth", what, &track->gauge_depth))
        good = false;
    if (inclination &&
        !read_inclination(r, inclination, kmp_reader_say(r, "inclination of %s", what), &track->inclination))
        good = false;
    return good && track->profile->height;
}

static void place_rails(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    kmp_rail_place place = {track->gauge, track->gauge_depth, track->inclination, 0, 0, true, true};
    track->rail = kmp_rail_new(track->profile->height, &place);
    track->rail_at = place.at;
    const kmp_yaml *depth = kmp_yaml_get(map, "gauge_depth"), *rail = kmp_yaml_get(map, "rail");
    if (!place.reaches)
        kmp_reader_complain(
            r, depth ? depth->place : rail->place,
            "%s: the gauge is measured %.9g m below the top of the rails, but the inner side of profile '%s', where y "
            "is negative, ends %.9g m below it: use another gauge_depth, or extend the profile",
            what, track->gauge_depth, track->profile->name, place.depth_given);
    else if (!place.resolved)
        kmp_reader_complain(r, rail->place, "%s: the points of profile '%s' coincide numerically at its position", what,
                            track->profile->name);
    else if (!track->rail)
        r->scratch.failed = true;
}

static void read_track(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    if (!kmp_read_map(r, map, what, track_keys))
        return;
    const kmp_yaml *at = kmp_read_required(r, map, what, "at");
    track->point = at ? read_at(r, at, what) : -1;
    if (read_rails(r, map, what, track))
        place_rails(r, map, what, track);
    const kmp_yaml *course = kmp_yaml_get(map, "course");
    if (course)
        kmp_read_course(r, course, what, track);
    kmp_read_irregularities(r, kmp_yaml_get(map, "irregularities"), what, track);
}

void kmp_read_tracks(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "tracks", "track");
    model->tracks = KMP_ARENA_NEW(&model->arena, kmp_track, s.count);
    while (model->tracks && kmp_section_next(&s)) {
        kmp_track *track = &model->tracks[model->track_count++];
        track->name = s.name;
        read_track(r, s.node, s.what, track);
    }
}
