/* SPDX-License-Identifier: BSD-3-Clause */
/* A robot in URDF, with the loops and couplings of URDF+ (docs/urdf.md): links are bodies, joints are joints, and
 * what a file says in numbers of a rotated frame is turned into body axes here. */
#pragma once

#include "exchange/formats/formats.h"

/** A conversion of formats.def. Errors are in import->status. */
void kmp_urdf_convert(kmp_import *import);
