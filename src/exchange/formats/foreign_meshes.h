/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes of foreign models, which are pictures alone. A package of ROS is a folder: its path is not in the file, so
 * that it is looked for beside the model and in the folders around it. */
#pragma once

#include "exchange/formats/formats.h"
#include "model/data/pose.h"

/** Adds the picture of a mesh to a body: a path from the model's file, or in a package of ROS, "package://NAME/PATH".
 * It is named as left out where there is no such file, or it cannot be drawn. */
void kmp_import_mesh(kmp_import *im, kmp_yaml *body, kmp_place place, const char *uri, const double scale[3],
                     const kmp_pose *at, const char *colour);

/** Reads a mesh whose path is found in the same way, into the arena. False: `why` (empty before) has the reason, or the
 * arena has failed. */
bool kmp_import_read_mesh(kmp_import *im, const char *uri, kmp_mesh *mesh, kmp_text *why);
