/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies in balance with their loads, at the start and elsewhere. */
#pragma once

#include "constraints/closing/assemble.h"
#include "constraints/closing/deformation_rows.h"

typedef struct kmp_settling {
    kmp_deformation_rows rows;
    int *pivots;
    double *step, *next, *even; /* room */
} kmp_settling;

/** KEMPE_E_FAILED, KEMPE_E_MEMORY, with the message; free it also then. */
kempe_status kmp_settling_init(kmp_settling *settling, const kempe_system *system,
                               const kmp_deformation_choice *choice);
void kmp_settling_free(kmp_settling *settling);

/** Moves the deformations from rows.q until their rows are zero, at rows.t: other independent coordinates stay where
 * they are, dependent ones follow. The rows and their slope are there then. False: there is no such deformation nearby,
 * or it is not found. */
bool kmp_settle(kmp_settling *settling);

/** False beyond the load at which a body buckles, after kmp_settle. */
bool kmp_settling_is_stable(kmp_settling *settling);

/** With `elastic: static`, moves the deformations that hold at a closed start until their equations of motion are
 * satisfied without accelerations: independent joints stay where they are, dependent ones follow. Rates of independent
 * coordinates stay. KEMPE_E_FAILED, with the reason: there is no such deformation nearby, or it is not found. */
kempe_status kmp_static_start(const kempe_system *system, kempe_assembly *assembly);
