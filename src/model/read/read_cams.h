/* SPDX-License-Identifier: BSD-3-Clause */
/* Outlines that are cams, and ideal followers on them. */
#pragma once

#include "model/data/closure.h"
#include "model/data/outline.h"
#include "model/read/reading.h"

/** The shapes `polar`, `points` and `law` of an outline, whose value is `node`. */
bool kmp_read_cam_polar(kmp_reader *r, const kmp_yaml *map, const kmp_yaml *node, const char *what,
                        kmp_outline *outline);
bool kmp_read_cam_points(kmp_reader *r, const kmp_yaml *map, const kmp_yaml *node, const char *what,
                         kmp_outline *outline);
bool kmp_read_cam_law(kmp_reader *r, const kmp_yaml *map, const kmp_yaml *node, const char *what, kmp_outline *outline);

/** A closure of the kind `follower`: its points, its follower, the normal of a flat face. */
void kmp_read_follower(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure);

/** Reports a follower that does not fit an outline. */
bool kmp_check_follower(kmp_reader *r, const kmp_yaml *map, const char *what, const struct kmp_cam_follower *follower);
