/* SPDX-License-Identifier: BSD-3-Clause */
/* Beams in segments: a flexible body with the key `segments` becomes as many rigid pieces, with joints and springs
 * between them, which is geometrically exact as their number grows; errors fall with its square. */
#pragma once

#include "model/read/reading.h"

/** Replaces such bodies by their pieces in r->root: after the parameters. The points of a piece are BODY_k.POINT then,
 * also where the model names BODY.POINT. */
void kmp_read_segments(kmp_reader *r);

/** The body of the model file that a body is a piece of; NULL: it is not one. */
const char *kmp_segments_name(const kmp_reader *r, int body);

/** Sets the places of points on all pieces, after the points of bodies; the masses, after the bodies; the springs
 * between pieces, after the forces; and that they hold at the start, unless they are free. */
void kmp_segments_place_points(kmp_reader *r);
void kmp_segments_set_masses(kmp_reader *r);
void kmp_segments_stiffen(kmp_reader *r);
void kmp_segments_hold(kmp_reader *r);
