/* SPDX-License-Identifier: BSD-3-Clause */
/* The part of the loads at which a flexible body buckles that a state has. */
#pragma once

#include "dynamics/system.h"

typedef struct kmp_load_margin kmp_load_margin;

/** For states with the independent coordinates of this closed one; NULL without flexible bodies, or where no such
 * coordinates exist, or where wheels creep. KEMPE_E_MEMORY. */
kempe_status kmp_load_margin_new(const kempe_system *system, const double *q, const double *qd,
                                 kmp_load_margin **margin);
void kmp_load_margin_free(kmp_load_margin *margin);

/** The part of the stiffness of each flexible body that the loads at a state take away, in the direction where it is
 * largest (of the model's flexible bodies; NaN: it is not known): one over the factor at which they make it buckle, as
 * far as they grow together. qdd NULL: independent coordinates have no accelerations, as where deformations are in
 * balance. */
void kmp_load_margin_at(kmp_load_margin *margin, double t, const double *q, const double *qd, const double *qdd,
                        double *taken);

/** True if forces that depend on positions take part, such as springs: these do not grow with the loads. */
bool kmp_load_margin_has_springs(const kempe_system *system);

/** True if wheels creep on rails. A section that turns takes its wheels with it, because independent joints hold, and
 * their rolling motion on the rails is not a load of the body: the part that loads take cannot be separated from it. */
bool kmp_load_margin_has_creep(const kempe_system *system);
