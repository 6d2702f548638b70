/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving mechanism: the drawn parts and their positions, frame by frame, as JSON. */
#pragma once

#include "base/json.h"
#include "model/data/mesh.h"
#include "picture/picture_forces.h"

/** At most this number of triangles: the mesh itself where it has no more, else one in the arena, which may be open.
 * False: no memory. */
bool kmp_mesh_thin(kmp_arena *arena, const kmp_mesh *mesh, int most, kmp_mesh *thin);

/** Writes an object whose frames are the rows, at their times or at `at`, ascending (NULL: their times); null where
 * there are none. */
void kmp_motion_picture(kmp_json *json, const char *key, const kempe_model *model, const kmp_samples *row,
                        const double *at, const kmp_picture_forces *arrows);

/** The number of frames that a picture of the model can have without omissions. */
int kmp_motion_picture_frames(const kempe_model *model);

/** The end time of the picture so that no joint rotates too far between frames; the end of the rows when it satisfies
 * the limit. */
double kmp_motion_picture_end(const kempe_model *model, const kmp_samples *row);
