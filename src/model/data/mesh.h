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

/* -- readers (mesh_stl.c, mesh_obj.c) ---------------------------------------------------------------- */

typedef struct kmp_mesh_maker kmp_mesh_maker;

/** Adds a triangle of three vertices, or a vertex; -1 without memory. */
int kmp_mesh_vertex(kmp_mesh_maker *maker, const double at[3]);
bool kmp_mesh_triangle(kmp_mesh_maker *maker, int a, int b, int c);

/** A place in a text that is read word by word, with the number of its line. */
typedef struct kmp_token_reader {
    const char *s;
    int line;
} kmp_token_reader;

/** The next word of the line (of the text with `lines`); its length, 0: there is none. */
size_t kmp_token_next(kmp_token_reader *words, bool lines, const char **word);

/** Reads the next word as a finite number; false: `why` has "line 3: a number is expected, not 'x'". */
bool kmp_token_number(kmp_token_reader *words, bool lines, double *x, kmp_text *why);
