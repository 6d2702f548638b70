/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving mechanism of a run as glTF. */
#pragma once

#include "studies/simulate/trajectory.h"

/** Writes a file of glTF 2.0 of a run with rows. KEMPE_E_ARGUMENT: the model has flexible bodies. */
kempe_status kmp_gltf_write(const kempe_trajectory *trajectory, const char *path);
