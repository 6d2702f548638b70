/* SPDX-License-Identifier: BSD-3-Clause */
/* The paths of ropes. */
#pragma once

#include "model/data/pose.h"
#include "model/read/reading.h"

/** Reads the section `ropes`, after bodies. */
void kmp_read_ropes(kmp_reader *r);

/** Finds the angles of all paths at the start, and checks that there is a path. After the start is read. */
void kmp_settle_ropes(kmp_reader *r);

/** Poses of the bodies where coordinates are as they are driven, or written, at the start: *q. NULL: no memory, or no
 * start. */
const kmp_pose *kmp_start_poses(kmp_reader *r, const double **q);
