/* SPDX-License-Identifier: BSD-3-Clause */
/* Equalities of MJCF as closures. An equality without positions keeps those of the file: the frames of the bodies at
 * the reference coordinates. */
#pragma once

#include "exchange/formats/mjcf.h"

/** Adds the closures of all elements `equality`. */
void kmp_mjcf_add_equalities(kmp_mjcf *m);
