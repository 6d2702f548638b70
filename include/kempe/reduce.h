/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Flexible bodies from meshes of finite elements: stiffness and mass are reduced to a few modes by the method of Craig
 * and Bampton (docs/reduce.md).
 */
#ifndef KEMPE_REDUCE_H
#define KEMPE_REDUCE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** NULL and 0 take the default. */
typedef struct kempe_reduce_options {
    size_t size;            /* sizeof this struct; 0: its size in version 0.1 */
    const char *interfaces; /* comma-separated: names with the nodes that move as rigid bodies, "root=1,2,5-9", or the
                             * ranges of their places, "root=x=0,tip=x=0.5"; the first one is the origin of the body */
    int modes;         /* with all interfaces held, in addition to six static modes of each interface but the first */
    const char *frame; /* clamped (default): the first interface does not move in the body; chord: it may turn,
                        * and the second one stays on the line between both; mean: modes without momentum and
                        * angular momentum, for a body with a free joint */
    const char *units; /* of length, mass and time, where the file does not say them: "m kg s", "mm t s" */
    const char *mass;  /* mass matrix, where the stiffness is in Matrix Market */
    const char *nodes; /* a file with the places of the nodes, where only matrices are given */
} kempe_reduce_options;

typedef struct kempe_reduction kempe_reduction;

/** Reads the mesh and reduces it. The same files give the same bytes. KEMPE_E_INPUT: the mesh cannot be a free body
 * with these interfaces: it is supported or in parts, of rotations, without mass, or with unsymmetric matrices.
 * KEMPE_E_ARGUMENT: an option does not exist, or units are missing. KEMPE_E_FAILED: the modes do not converge. */
KEMPE_API kempe_status kempe_reduction_new(kempe_context *context, const char *mesh,
                                           const kempe_reduce_options *options, kempe_reduction **reduction);
KEMPE_API void kempe_reduction_free(kempe_reduction *reduction);

/** The modes of the body in its frame, slowest first, and their angular frequencies, rad/s. */
KEMPE_API int kempe_reduction_mode_count(const kempe_reduction *reduction);
KEMPE_API double kempe_reduction_frequency(const kempe_reduction *reduction, int k);

/** Writes the file that a model names under `flexible`, whole or not at all: .npz, kempe-flexible-1. */
KEMPE_API kempe_status kempe_reduction_write(kempe_reduction *reduction, const char *path);

/** Prints modes, mass and interfaces. After kempe_reduction_write the text begins with the file. */
KEMPE_API kempe_status kempe_reduction_print(const kempe_reduction *reduction, kempe_format format, char **text);

KEMPE_END
#endif
