/* SPDX-License-Identifier: BSD-3-Clause */
/* Pieces of a course, laid one after the other. */
#pragma once

#include "rail/model/rail.h"

/** Computes the course of a track: x, y, cant, candidates and length. Radii of curves are larger than its gauge, pieces
 * and their sum within the limits above. */
kmp_course_result kmp_course_lay(kmp_track *track);
