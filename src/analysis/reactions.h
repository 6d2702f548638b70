/* SPDX-License-Identifier: BSD-3-Clause */
/* What all closures transmit: force and moment of each from q and lambda, by a program of its own. */
#ifndef KMP_ANALYSIS_REACTIONS_H
#define KMP_ANALYSIS_REACTIONS_H

#include "backend/machine.h"
#include "dynamics/system.h"

/** Values a closure: force, then moment about the second point (constraints/kinds/kind.h). */
enum { KMP_REACTION = 6 };

typedef struct kmp_reactions {
    const kempe_system *system;
    kmp_program *program;
    kmp_machine *machine;
} kmp_reactions;

/** KEMPE_E_MEMORY. */
kempe_status kmp_reactions_init(kmp_reactions *reactions, const kempe_system *system);
void kmp_reactions_free(kmp_reactions *reactions);

/** KMP_REACTION values a closure, in the order of the model; owned by `reactions`. */
const double *kmp_reactions_at(kmp_reactions *reactions, double t, const double *q, const double *lambda);

#endif
