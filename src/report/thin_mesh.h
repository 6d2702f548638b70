/* SPDX-License-Identifier: BSD-3-Clause */
/* A mesh with fewer triangles, for a picture. */
#pragma once

#include "model/data/mesh.h"

/** At most so many triangles: the mesh itself where it has no more, else one in the arena, which may be open. False: no
 * memory. */
bool kmp_mesh_thin(kmp_arena *arena, const kmp_mesh *mesh, int most, kmp_mesh *thin);
