/* SPDX-License-Identifier: BSD-3-Clause */
/* Stresses of beams in pictures. */
#pragma once

#include "picture/drawing.h"

/** True if the edges of the section of a flexible body are known. */
bool kmp_drawing_has_edges(const kmp_drawing *drawing, const kempe_model *model, int body);

/** True if it has axial shapes as well, by which N is known. */
bool kmp_drawing_lengthens(const kmp_drawing *drawing, const kempe_model *model, int body);

/** The largest normal stress of the section at each place of the drawing, at the user's coordinates q, in Pa: |N|/A and
 * the stress of bending at the farthest edge, by the strain of the shapes. -1: the place is off the axis of a beam, or
 * the edges of its section are not known. */
void kmp_drawing_stress(const kmp_drawing *drawing, const kempe_model *model, const double *q, double *stress);
