/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces along a coordinate: the virtual work of gravity, of each force element and of the motion itself on a small
 * change of one independent coordinate. The others are fixed and the closures satisfied. Closures do no work. Each
 * force is evaluated from equations of its own, which have that element alone. */
#ifndef KMP_STUDIES_EQUILIBRIUM_LOAD_PATH_H
#define KMP_STUDIES_EQUILIBRIUM_LOAD_PATH_H

#include "derivatives/linearized.h"

/** Appends the forces along u[k] of the last state: "gravity -9.81 N, 'k' 2 N, together -7.81 N", the nonzero ones,
 * largest first; nothing where there are none. KEMPE_E_MEMORY. */
kempe_status kmp_load_path_tell(kmp_text *text, const kmp_linear *linear, int k);

#endif
