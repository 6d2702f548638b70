/* SPDX-License-Identifier: BSD-3-Clause */
/* A flexible body only by its constants; the mechanism without its coordinates. */
#pragma once

#include "model/data/flexible.h"
#include "model/flexible/body_spectrum.h"
#include <kempe/kempe.h>

/** False: the body has no shape that twists it (c = 0) or bends it about y or z (1, 2). */
bool kmp_flexible_bends(const kmp_flexible *flexible, int c);

/** The largest momentum and angular momentum of a shape, over the momenta of a rigid motion with the same mass. */
double kmp_flexible_rigid_part(const kmp_flexible *flexible);

/** The mechanism as if its flexible bodies were rigid. */
typedef struct kmp_rigid_mobility {
    int rank, freedom;
    bool *loads; /* of each flexible body: closures depend on its coordinates */
} kmp_rigid_mobility;

/** At closed q (n). False: no memory; otherwise the caller frees it. */
bool kmp_rigid_mobility_find(const kempe_system *system, const double *q, kmp_rigid_mobility *rigid);
void kmp_rigid_mobility_free(kmp_rigid_mobility *rigid);
