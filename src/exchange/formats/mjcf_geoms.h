/* SPDX-License-Identifier: BSD-3-Clause */
/* Geoms of MJCF: pictures, and masses. If a mesh gives a body a part of its mass, the masses of all its geoms are
 * added here; otherwise they are those of the shapes in the document. */
#pragma once

#include "exchange/formats/mjcf.h"

/** Between two places, `fromto`: the centre, the axis z, and half the length as the second size, of a box or ellipsoid
 * the third one. */
void kmp_mjcf_put_between(kmp_mjcf *m, const kmp_mjcf_item *item, int solid, kmp_pose *f, double size[3]);

/** Adds the shapes of geoms; `heavy`: they give the body its mass. */
void kmp_mjcf_add_geoms(kmp_mjcf *m, const kmp_mjcf_body *body, bool heavy, const kmp_mjcf_part *geoms);
