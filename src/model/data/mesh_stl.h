/* SPDX-License-Identifier: BSD-3-Clause */
/* STL (3D Systems, StereoLithography Interface Specification, 1989), as text or binary: a text begins with `solid`
 * and does not have the length that its bytes 80 to 83 would mean in a binary file. */
#pragma once

#include "model/data/mesh.h"

/** False: `why` has the reason, or no memory. */
bool kmp_stl_read(kmp_mesh_maker *maker, const char *text, size_t length, kmp_text *why);
