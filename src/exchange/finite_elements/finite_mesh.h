/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes of finite elements: nodes with three displacements each, and the matrices of stiffness and mass between them,
 * as other programs write them. A format is a row of mesh_formats.def. */
#pragma once

#include "base/arena.h"
#include "base/context.h"
#include <kempe/reduce.h>

/** Entries of a matrix as read; several at one place add up. */
typedef struct kmp_mesh_entries {
    int count;
    int *row, *col; /* 3 node + direction; node, in a mass that is the same for x, y and z */
    double *value;
    bool triangle; /* of one triangle, with the diagonal, of a symmetric matrix */
} kmp_mesh_entries;

/** A symmetric matrix by rows, columns ascending. */
typedef struct kmp_mesh_rows {
    int n;
    int *start, *col; /* start: n + 1 */
    double *value;
} kmp_mesh_rows;

typedef struct kmp_node_set {
    const char *name;
    int count;
    const int *nodes;
} kmp_node_set;

typedef struct kmp_finite_mesh {
    kempe_context *context;
    kmp_arena *arena;
    const char *path, *format; /* in words */
    const kempe_reduce_options *options;
    int node_count;
    const long *number; /* of nodes in the file; NULL: from 0 on */
    double *node;       /* x 3 */
    const char *units;  /* of the file; NULL: it has none */
    kmp_mesh_entries stiffness_read, mass_read;
    int mass_width; /* rows of the mass for each node: 1 or 3 */
    int set_count;
    kmp_node_set *sets;
    /* Made from these, in SI. */
    double length;                 /* unit */
    int unused;                    /* nodes left out, without stiffness and mass */
    kmp_mesh_rows stiffness, mass; /* 3 node_count; node_count: the same for x, y and z */
} kmp_finite_mesh;

/** Reads a mesh by the ending of its name, and checks it: symmetric and finite matrices, a positive mass that is the
 * same for x, y and z, units. KEMPE_E_INPUT, KEMPE_E_IO, KEMPE_E_ARGUMENT (units). */
kempe_status kmp_finite_mesh_read(kempe_context *context, kmp_arena *arena, const char *path,
                                  const kempe_reduce_options *options, kmp_finite_mesh *mesh);

/** KEMPE_E_INPUT with the mesh's name and a sentence. */
kempe_status kmp_mesh_refuse(const kmp_finite_mesh *mesh, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/** The number of a node in the file. */
long kmp_mesh_number(const kmp_finite_mesh *mesh, int node);

/** A node by its number in the file; -1: there is none. */
int kmp_mesh_find(const kmp_finite_mesh *mesh, long number);

/** Adds an entry; false: no memory. */
bool kmp_mesh_add(kmp_arena *arena, kmp_mesh_entries *entries, int row, int col, double value);

/** Readers of formats: nodes, entries, units and sets. */
typedef kempe_status kmp_mesh_reader(kmp_finite_mesh *mesh);
#define KMP_MESH_FORMAT(ending, words, reader) kmp_mesh_reader reader;
#include "exchange/finite_elements/mesh_formats.def"
#undef KMP_MESH_FORMAT
