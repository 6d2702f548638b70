/* SPDX-License-Identifier: BSD-3-Clause */
/* Who pulls along a coordinate: the virtual work of gravity, of each force element and of the motion itself on a small
 * change of one independent coordinate, the others held and the closures met. Closures do none. Each is evaluated from
 * equations of its own, which have that element alone. */
#ifndef KMP_STUDIES_EQUILIBRIUM_LOAD_PATH_H
#define KMP_STUDIES_EQUILIBRIUM_LOAD_PATH_H

#include "derivatives/linearized.h"

/** Along u[k] of the last state: "gravity -9.81 N, 'k' 2 N, together -7.81 N", what is not zero, largest first. Nothing
 * where nobody pulls. KEMPE_E_MEMORY. */
kempe_status kmp_load_path_tell(kmp_text *text, const kmp_linear *linear, int k);

#endif
