/* SPDX-License-Identifier: BSD-3-Clause */
/* Reduction of a mesh to modes (Craig and Bampton, AIAA Journal 6 (1968) 1313): static modes of rigid interfaces and
 * modes with all interfaces held, made orthogonal in the frame of the body. */
#pragma once

#include "exchange/finite_elements/interface_nodes.h"
#include "model/flexible/modal_body.h"

typedef struct kmp_reduced_mesh {
    kmp_modal_body body; /* its modes: slowest first, of unit mass, the largest displacement positive */
    double *values;      /* squares of their frequencies */
    int held_count;
    double *held_values;    /* with all interfaces held: those kept, and the next one where there is one */
    bool left_out;          /* there is one */
    double rigid[6];        /* values of the rigid motions, over the first one of the body */
    const char *library;    /* that factored the stiffness */
    double *interface_mass; /* of their nodes */
} kmp_reduced_mesh;

/** KEMPE_E_INPUT: in parts, supported, more modes than the mesh has. */
kempe_status kmp_craig_bampton(const kmp_finite_mesh *mesh, int count, const kmp_interface *interfaces, int modes,
                               kmp_flexible_frame frame, kmp_reduced_mesh *reduced);
