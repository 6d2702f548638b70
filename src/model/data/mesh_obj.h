/* SPDX-License-Identifier: BSD-3-Clause */
/* Wavefront OBJ: vertices and faces. Texture coordinates, normals, groups and materials are left out; polygons are
 * divided into triangles from their first corner. */
#pragma once

#include "model/data/mesh.h"

bool kmp_obj_read(kmp_mesh_maker *maker, const char *text, size_t length, kmp_text *why);
