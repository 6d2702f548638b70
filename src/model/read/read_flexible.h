/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies: beams, their shapes, the points that move with their sections. */
#pragma once

#include "model/data/body.h"
#include "model/flexible/beam.h"
#include "model/read/reading.h"

/** Reads the key `flexible` of a body, if it has one: before the points. */
void kmp_begin_flexible(kmp_reader *r, const kmp_yaml *map, int body);

/** The beam of a mapping under `flexible`, without its damping where it is in segments; `body`: "body 'rod'". False
 * after an error. */
bool kmp_read_beam(kmp_reader *r, const kmp_yaml *map, const char *body, kmp_beam *beam);

/** Reads the place of a point, [x, y, z] or a mapping: its station and offset on a flexible body, a place that moves
 * with the body's axes otherwise. */
void kmp_read_point_place(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_point *point);

/** The ends of a flexible body's joint: it is held at the origin. `at`, `to`: where they are written, NULL: they are
 * not. The joint of a body on a flexible one is at one of its points. */
void kmp_check_flexible_joint(kmp_reader *r, int body, const kmp_yaml *at, const kmp_yaml *to);

/** The ground of an included file moves with a section, or with the axes where a body of these holds them; `at`: where
 * the body and its point, -1 without one, are written. */
void kmp_check_flexible_ground(kmp_reader *r, const kmp_yaml *at, int body, int point);

/** Reports a mass that is given twice. */
void kmp_check_flexible_mass(kmp_reader *r, const kmp_yaml *map, int body);

/** Makes the constants and the coordinates of all flexible bodies: after the coordinates of all joints. */
void kmp_read_flexibles(kmp_reader *r);

/** True if a flexible body stays in one plane with this normal in its axes, where its joints do. */
bool kmp_flexible_in_plane(const kmp_reader *r, int body, const double normal[3]);
