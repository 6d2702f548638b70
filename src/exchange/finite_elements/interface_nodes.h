/* SPDX-License-Identifier: BSD-3-Clause */
/* Interfaces of a mesh: groups of nodes that move as rigid bodies, by numbers, sets or places. */
#pragma once

#include "exchange/finite_elements/finite_mesh.h"

typedef struct kmp_interface {
    const char *name;
    int count;
    int *nodes; /* ascending */
} kmp_interface;

/** Reads "root=x=0,tip=290-314,bore=SET": each name with numbers and ranges of nodes, names of sets, and ranges of
 * places that its nodes have. KEMPE_E_ARGUMENT: no such list; KEMPE_E_INPUT: nodes that the mesh does not have, or that
 * are not an interface: fewer than three, in a line, in two interfaces. */
kempe_status kmp_interfaces_read(const kmp_finite_mesh *mesh, const char *words, int *count,
                                 kmp_interface **interfaces);
