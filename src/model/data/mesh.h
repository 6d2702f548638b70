/* SPDX-License-Identifier: BSD-3-Clause */
/* Triangle meshes from STL and OBJ files: what they enclose. */
#pragma once

#include "base/arena.h"
#include "base/text.h"

typedef struct kmp_mesh {
    const char *path;
    int vertex_count, triangle_count;
    double (*vertex)[3]; /* in the units of the file */
    int (*triangle)[3];
} kmp_mesh;

/** Reads a file by its ending, .stl (binary or text) or .obj; the mesh is in the arena. Vertices at the same place are
 * one, triangles without area between three different vertices are left out. False: `why` (empty before) has the
 * reason, with the line in a text; or no memory (`why` or the arena has failed). */
bool kmp_mesh_read(kmp_arena *arena, const char *path, const char *text, size_t length, kmp_mesh *mesh, kmp_text *why);

/** The box of all vertices. */
void kmp_mesh_box(const kmp_mesh *mesh, double low[3], double high[3]);

/** The mass properties of the volume in a closed mesh, of density 1, in the units of its file. */
typedef struct kmp_mesh_volume {
    double volume, centre[3], inertia[6]; /* inertia: about the centre, as in kmp_body */
    bool inward;                          /* its triangles face inwards */
} kmp_mesh_volume;

/** The mass of a mesh is in the volume that it encloses, on its triangles, or in pyramids from the centroid of
 * its triangles to each of them, which count positive on both sides: of a convex mesh that is its volume, too. */
typedef enum kmp_mesh_matter { KMP_MESH_SOLID, KMP_MESH_SURFACE, KMP_MESH_PYRAMIDS } kmp_mesh_matter;

/** False: the mesh is not closed, or its triangles do not all face one way; `why` (empty before) has the sentence. */
bool kmp_mesh_enclose(const kmp_mesh *mesh, kmp_mesh_volume *volume, kmp_text *why);

/** The mass properties for a choice of matter; of triangles `volume` is their area. The inertia of pyramids is
 * taken from their own centre. False: as kmp_mesh_enclose, or nothing has an extent. */
bool kmp_mesh_weigh(const kmp_mesh *mesh, kmp_mesh_matter matter, kmp_mesh_volume *volume, kmp_text *why);
