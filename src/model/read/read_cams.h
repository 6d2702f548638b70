/* SPDX-License-Identifier: BSD-3-Clause */
/* Outlines that are cams, and ideal followers on them. */
#pragma once

#include "model/data/closure.h"
#include "model/data/outline.h"
#include "model/read/reading.h"

/** An outline that is being read. */
typedef struct kmp_outline_reading {
    kmp_reader *r;
    const kmp_yaml *map, *node; /* node: the value of its shape */
    const char *what;
    kmp_outline *outline;
    kmp_outline_edge *edges; /* of a shape with edges */
    int edge_count;
} kmp_outline_reading;

/** The shapes `polar`, `points` and `law`: curves without edges. */
bool kmp_read_cam_polar(kmp_outline_reading *c);
bool kmp_read_cam_points(kmp_outline_reading *c);
bool kmp_read_cam_law(kmp_outline_reading *c);

/** A closure of the kind `follower`: its points, its follower, the normal of a flat face. */
void kmp_read_follower(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure);

/** Reports a follower that does not fit an outline. */
bool kmp_check_follower(kmp_reader *r, const kmp_yaml *map, const char *what, const struct kmp_cam_follower *follower);
