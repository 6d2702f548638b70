/* SPDX-License-Identifier: BSD-3-Clause */
/* Volume, centre and inertia of a closed mesh by the divergence theorem: sums over tetrahedra from one place to each
 * triangle (Mirtich, Fast and accurate computation of polyhedral mass properties, Journal of Graphics Tools 1, 1996;
 * the moments of a tetrahedron: Tonon, Journal of Mathematics and Statistics 1, 2004). */
#pragma once

#include "model/data/mesh.h"

/** False: the mesh is not closed, or its triangles do not all face one way; `why` (empty before) has the sentence. */
bool kmp_mesh_enclose(const kmp_mesh *mesh, kmp_mesh_volume *volume, kmp_text *why);

/** The mass properties for a choice of matter; of triangles `volume` is their area. The inertia of pyramids is that of
 * pyramids from their own centre. False: as kmp_mesh_enclose, or nothing has an extent. */
bool kmp_mesh_weigh(const kmp_mesh *mesh, kmp_mesh_matter matter, kmp_mesh_volume *volume, kmp_text *why);
