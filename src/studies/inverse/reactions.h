/* SPDX-License-Identifier: BSD-3-Clause */
/* Reactions of all closures: force and moment of each from q and lambda, by a program of its own. */
#ifndef KMP_STUDIES_INVERSE_REACTIONS_H
#define KMP_STUDIES_INVERSE_REACTIONS_H

#include "integrators/run/instant.h"

/** Values a closure: force, then moment about the second point (constraints/kinds/kind.h). */
enum { KMP_REACTION = 6 };

/** KMP_REACTION values a closure, in the order of the model, of t, q and lambda. KEMPE_E_MEMORY. */
kempe_status kmp_reactions_init(kmp_formulas *reactions, const kempe_system *system);

#endif
