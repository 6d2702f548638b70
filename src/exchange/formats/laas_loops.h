/* SPDX-License-Identifier: BSD-3-Clause */
/* Loops of a robot in a file of their own, as LAAS-CNRS publishes robots with closed chains: `closed_loop` lists
 * pairs of frames of the URDF file beside it, which coincide (docs/urdf.md). The document includes that file. */
#pragma once

#include "exchange/formats/formats.h"

/** A conversion of formats.def. Errors are in import->status. */
void kmp_laas_convert(kmp_import *import);
