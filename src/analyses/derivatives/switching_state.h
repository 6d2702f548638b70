/* SPDX-License-Identifier: BSD-3-Clause */
/* States at which a condition of the equations changes: small motions have other equations on either side of it. */
#pragma once

#include "analyses/derivatives/linearized.h"

/** Looks at conditions that change at the state. The matrices and forces on all sides next to it may agree, and differ
 * at the state, as of teeth without load, which touch on neither flank: a state next to it then takes its place. If
 * they differ from side to side, and with `doubts`, small motions are doubted, once for `linear`. `damping`: not only
 * Kr counts, but also Gr and Mr. The matrices are present then, unless no condition changes. KEMPE_E_MEMORY. */
kempe_status kmp_linear_settle_switches(kmp_linear *linear, bool damping, bool doubts);
