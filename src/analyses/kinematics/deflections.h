/* SPDX-License-Identifier: BSD-3-Clause */
/* Deformations of flexible bodies in balance with the loads at rest, at each position of a sweep, and their derivatives
 * along it. With x = (q, lambda) along the sweep, R = C - J' lambda at rest, and the rows e of the deformations and v
 * of the dependent coordinates,
 *
 *     R_e = R_v = 0,  h = 0:   (R_q q' - J' lambda')_e,v = 0,   (R_q q'' - J' lambda'' + R''[x', x'])_e,v = 0,
 *
 * where q' of the swept coordinates is given and their q'' is zero. */
#pragma once

#include "analyses/derivatives/parameter_slopes.h"
#include "constraints/closing/static_start.h"

typedef struct kmp_deflections {
    kmp_settling settling;
    kmp_second_derivatives second;
    kmp_arena arena;
    bool unstable;                                 /* a balance was beyond the load at which a body buckles */
    double *u, *ls, *curve, *force, *rows, *still; /* room: p; m; m; n; p; n */
} kmp_deflections;

/** The sweep's driven coordinates are `choice.liked`. KEMPE_E_FAILED, with the message: a kind of force that this does
 * not know. KEMPE_E_MEMORY. Free it also then. */
kempe_status kmp_deflections_init(kmp_deflections *deflections, const kempe_system *system,
                                  const kmp_deformation_choice *choice);
void kmp_deflections_free(kmp_deflections *deflections);

/** Moves q (n) into balance at t. `qs`: on entry derivatives of the swept coordinates along the sweep, as a result with
 * `qss` the derivatives of all (n each). `pace`: of the time. False: no balance is found near q. */
bool kmp_deflections_at(kmp_deflections *deflections, double t, double pace, double *q, double *qs, double *qss);
